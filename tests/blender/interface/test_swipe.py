"""Swipe in the viewport: the reference as the scene displays it, left of a line; in a window: tests/real_blender."""

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.interface import swipe
from viewcam_addon.blender.rendering import live_view
from viewcam_addon.blender.rendering.displayed import displayed


def looked_up(table, light):
    """The colors that the shader shows for light, (n, 3), by a table of `swipe.shades`."""
    last = swipe._COLORS - 1
    at = np.clip(np.log2(np.maximum(light, 0) / 2.0**swipe._LOWEST + 1) / swipe._STOPS, 0, 1) * last
    low = np.minimum(at.astype(int), last - 1)
    share, total = at - low, 0.0
    for corner in np.ndindex(2, 2, 2):
        red, green, blue = (low + corner).T
        weight = np.where(corner, share, 1 - share).prod(axis=1)
        total = total + weight[:, None] * table[blue, green * swipe._COLORS + red, :3]
    return total


@pytest.mark.parametrize("transform", ["Standard", "Filmic", "AgX"])
def test_the_table_shows_light_as_the_scene_displays_it(scene, transform):
    scene.view_settings.view_transform = transform
    scene.view_settings.exposure = 0.5
    light = np.exp2(np.random.default_rng(1).uniform(-10, 5, (32, 32, 3))).astype(np.float32)
    light[0, 0] = 0
    shaded = looked_up(swipe.shades(scene), light.reshape(-1, 3))
    expected = displayed(scene, light)[..., :3].reshape(-1, 3)
    off = np.abs(shaded - expected) * 255
    # Calibrated: both sides are rounded to 1/255, and a transform of three channels has edges between the table's numbers.
    assert off.mean() < 0.5 and np.quantile(off, 0.99) < 4 and off.max() < 16, (off.mean(), off.max())
    assert np.abs(shaded - looked_up(swipe.shades(scene)[::-1], light.reshape(-1, 3))).mean() > 0.05, (
        "a table upside down is as good"
    )


@pytest.fixture
def view(posed_camera, scene, monkey):
    """A viewport of 48 × 32 pixels that looks through the camera, as far as a swipe looks at it."""
    scene.render.resolution_x, scene.render.resolution_y = 48, 32
    bpy.context.view_layer.update()

    def matrices():
        matrix = posed_camera.calc_matrix_camera(bpy.context.evaluated_depsgraph_get(), x=48, y=32)
        return {"window_matrix": matrix, "view_matrix": posed_camera.matrix_world.inverted(), "is_perspective": True}

    region = SimpleNamespace(type="WINDOW", x=100, y=50, width=48, height=32)
    space = SimpleNamespace(region_3d=SimpleNamespace(**matrices()), clip_start=0.1, clip_end=100.0)
    drawn = []
    area = SimpleNamespace(
        type="VIEW_3D", regions=[region], spaces=SimpleNamespace(active=space), tag_redraw=lambda: drawn.append(1)
    )
    yield SimpleNamespace(area=area, region=region, space=space, matrices=matrices, camera=posed_camera)
    live_view.unregister()


@pytest.fixture
def swiped(view, scene):
    result = swipe._Swipe(view.area, scene)
    result.asked = []
    result.live.show = lambda *what: result.asked.append(what)
    yield result
    result.live.close()


def test_it_follows_the_view_and_reads_the_scene_anew_for_more_than_cameras_alone(swiped, view, monkey):
    swiped.follow(bpy.context)
    swiped.follow(bpy.context)
    assert len(swiped.asked) == 1, "an unchanged view begins anew"
    first = swiped.asked[0][0]
    view.camera.location.x += 1
    bpy.context.view_layer.update()
    vars(view.space.region_3d).update(view.matrices())
    swiped.follow(bpy.context)
    second = swiped.asked[1][0]
    assert second.camera != first.camera and second.geometries is first.geometries
    monkey.location.x += 1
    bpy.context.view_layer.update()
    swiped.live.scene_changed(SimpleNamespace(id_type_updated=lambda _: False, updates=[SimpleNamespace(id=monkey)]))
    swiped.follow(bpy.context)
    third = swiped.asked[2][0]
    assert third.camera == second.camera and not np.array_equal(third.objects[0].matrices, second.objects[0].matrices)


def test_what_can_not_be_shown_is_told_and_the_next_view_is(swiped, view):
    view.space.region_3d.is_perspective = False
    swiped.follow(bpy.context)
    assert "orthographic" in swiped.message and not swiped.asked
    view.space.region_3d.is_perspective = True
    swiped.follow(bpy.context)
    assert swiped.message == "" and len(swiped.asked) == 1


def test_another_view_transform_is_another_table(swiped, scene):
    swiped.follow(bpy.context)
    before = swiped._shades
    scene.view_settings.exposure += 1
    swiped.follow(bpy.context)
    assert not np.array_equal(swiped._shades, before)


def test_the_line_is_taken_where_it_is_and_stays_in_the_region(swiped):
    assert swiped.line() == 24
    assert swiped.is_near(SimpleNamespace(mouse_x=126, mouse_y=60), 1.0)
    assert not swiped.is_near(SimpleNamespace(mouse_x=135, mouse_y=60), 1.0)
    assert not swiped.is_near(SimpleNamespace(mouse_x=126, mouse_y=40), 1.0), "below the viewport"
    for x, expected in ((112, 12), (0, 0), (900, 48)):
        swiped.drag(SimpleNamespace(mouse_x=x, mouse_y=0))
        assert swiped.line() == expected


def test_without_a_window_the_button_says_that_there_is_no_viewport(fresh_blender):
    assert not bpy.ops.viewcam.swipe_reference.poll()
    with pytest.raises(RuntimeError, match="no 3D viewport"):
        bpy.ops.viewcam.swipe_reference("INVOKE_DEFAULT")
