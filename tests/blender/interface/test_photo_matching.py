"""Match Photo: what is drawn on a picture, the camera that follows, and Escape."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.interface import dragging, photo_matching
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

WIDTH, HEIGHT = 1920, 1080
PHOTO = Pinhole((6, -8, 4), (0.2, 0.1, 0.5), (0.05, 0, 1), 1800.0, WIDTH, HEIGHT)
ZOOM = 3.0  # pixels of the picture that one of the screen shows
LEFT, BOTTOM = 50.0, 80.0


def seen(*points, photo=PHOTO):
    column, row, _ = photo.project(np.array(points, float))
    return [(float(x), float(y)) for x, y in zip(column, row, strict=True)]


@pytest.fixture
def settings(fresh_blender):
    yield fresh_blender.context.window_manager.virtual_pinhole_match
    group = fresh_blender.context.window_manager.virtual_pinhole_match
    for name in ("kind", "axes", "sides", "precision", "is_lens_known", "is_principal_point_free", "length"):
        group.property_unset(name)


class Hand:
    """Uses the modal operator as Blender does, without a window: the picture stands somewhere in a region."""

    def __init__(self, camera_object, scene):
        self.operator = SimpleNamespace(
            camera_object=camera_object,
            before=dragging.state(camera_object),
            drawing=photo_matching.begun(camera_object, bpy.context),
            result=None,
            sentence="",
            frame=(LEFT, BOTTOM, LEFT + WIDTH / ZOOM, BOTTOM + HEIGHT / ZOOM),
            report=lambda *_: None,
        )
        for name in ("_in_picture", "_follow", "_tell", "_leave"):
            function = getattr(photo_matching.VIEWCAM_OT_match_photo, name)
            setattr(self.operator, name, function.__get__(self.operator))
        view = SimpleNamespace(view_perspective="CAMERA")
        self.context = SimpleNamespace(
            scene=scene,
            region_data=view,
            window_manager=bpy.context.window_manager,
            workspace=SimpleNamespace(status_text_set=lambda _: None),
            area=SimpleNamespace(tag_redraw=lambda: None),
        )

    def event(self, type, value="PRESS", at=(0, 0)):
        # Half a pixel of the screen is where the mouse's pixel has its center.
        x, y = at[0] / ZOOM + LEFT - 0.5, at[1] / ZOOM + BOTTOM - 0.5
        event = SimpleNamespace(type=type, value=value, mouse_region_x=x, mouse_region_y=y, shift=False, ctrl=False)
        return photo_matching.VIEWCAM_OT_match_photo.modal(self.operator, self.context, event)

    def drag(self, start, end):
        self.event("LEFTMOUSE", "PRESS", start)
        self.event("MOUSEMOVE", "NOTHING", end)
        self.event("LEFTMOUSE", "RELEASE", end)


def hand_with_edges(camera_object, scene, photo=PHOTO):
    """The hand of an artist who has drawn two edges along each axis."""
    hand = Hand(camera_object, scene)
    for axis, start, end in (
        ("X", (-2, -1, 0), (2, -1, 0)),
        ("X", (-2, 1, 0), (2, 1, 0)),
        ("Y", (-2, -1, 0), (-2, 2, 0)),
        ("Y", (2, -1, 1), (2, 2, 1)),
        ("Z", (0, 0, 0), (0, 0, 2)),
        ("Z", (2, 1, 0), (2, 1, 2)),
    ):
        hand.event(axis)
        hand.drag(*seen(start, end, photo=photo))
    return hand


def test_edges_dragged_over_a_picture_turn_the_camera_and_set_its_lens_and_the_eye_stays(posed_camera, scene, settings):
    before = dragging.state(posed_camera)
    units = scene.unit_settings.scale_length, scene.unit_settings.system
    hand = hand_with_edges(posed_camera, scene)
    assert hand.event("RET") == {"FINISHED"}
    bpy.context.view_layer.update()
    pinhole = cameras.read(posed_camera, scene)
    assert np.allclose(pinhole.basis(), PHOTO.basis(), atol=1e-6)
    assert pinhole.distance[0] == pytest.approx(1800, rel=1e-6)
    assert tuple(posed_camera.virtual_pinhole.eye) == before["virtual_pinhole.eye"]
    assert (scene.unit_settings.scale_length, scene.unit_settings.system) == units
    assert hand.operator.result.precision == ZOOM, "one pixel of the screen"


def test_the_length_of_the_first_edge_at_the_cursor_says_where_the_camera_stands(posed_camera, scene, settings):
    settings.length, scene.cursor.location = 4.0, (-2, -1, 0)
    hand = hand_with_edges(posed_camera, scene)
    assert hand.event("RET") == {"FINISHED"}
    bpy.context.view_layer.update()
    pinhole = cameras.read(posed_camera, scene)
    np.testing.assert_allclose(pinhole.eye, PHOTO.eye, atol=1e-4)
    assert np.allclose(pinhole.basis(), PHOTO.basis(), atol=1e-6)


def test_a_lens_that_is_known_stays_to_the_bit_and_the_viewport_says_so(posed_camera, scene, settings):
    settings.is_lens_known = True
    posed_camera.virtual_pinhole.distance = 1800
    hand = hand_with_edges(posed_camera, scene)
    assert hand.event("RET") == {"FINISHED"} and posed_camera.virtual_pinhole.distance == 1800
    bpy.context.view_layer.update()
    assert np.allclose(cameras.read(posed_camera, scene).basis(), PHOTO.basis(), atol=1e-6)
    line = photo_matching.summary_of(hand.operator.result, posed_camera.data.lens)[0]
    assert line == "33.75 mm as it was,  d = 1800 px"


def test_large_errors_are_told_without_powers_of_ten(posed_camera, scene, settings):
    settings.precision = 5.0
    hand = hand_with_edges(posed_camera, scene)
    text = " ".join(photo_matching.summary_of(hand.operator.result, posed_camera.data.lens))
    assert max(float(number.replace(",", "")) for number in re.findall(r"± ([\d.,]+) px", text)) >= 100 and "e+" not in text


def test_a_free_principal_point_becomes_the_shift_and_escape_takes_it_back(posed_camera, scene, settings):
    photo = replace(PHOTO, distance=1200.0, principal_point=(830.0, 600.0))
    settings.is_principal_point_free = True
    settings.length, settings.precision, scene.cursor.location = 4.0, 0.1, (-2, -1, 0)
    before = dragging.state(posed_camera)
    hand = hand_with_edges(posed_camera, scene, photo)
    bpy.context.view_layer.update()
    pinhole = cameras.read(posed_camera, scene)
    np.testing.assert_allclose(pinhole.principal_point, photo.principal_point, atol=1e-3)
    np.testing.assert_allclose(pinhole.eye, photo.eye, atol=1e-4)
    assert pinhole.distance[0] == pytest.approx(1200, rel=1e-5)
    # Blender's shift moves the picture the other way, in shares of its width.
    np.testing.assert_allclose((posed_camera.data.shift_x, posed_camera.data.shift_y), (130 / 1920, -60 / 1920), atol=1e-6)
    lines = photo_matching.summary_of(hand.operator.result, posed_camera.data.lens)
    assert lines[1].startswith("Principal point: -130 ± ") and " +60 ± " in lines[1], lines
    assert hand.event("ESC") == {"CANCELLED"} and dragging.state(posed_camera) == before


@pytest.mark.parametrize("enabled", [True, False])
def test_escape_brings_all_back_to_the_bit(posed_camera, scene, settings, enabled):
    posed_camera.virtual_pinhole.enabled = enabled
    posed_camera.location.x += 0.125  # not where its values are
    bpy.context.view_layer.update()
    before = dragging.state(posed_camera)
    hand = hand_with_edges(posed_camera, scene)
    assert dragging.state(posed_camera) != before
    assert hand.event("ESC") == {"CANCELLED"}
    assert dragging.state(posed_camera) == before


def test_what_says_nothing_yet_leaves_the_camera_and_enter_is_then_escape(posed_camera, scene, settings):
    before = dragging.state(posed_camera)
    hand = Hand(posed_camera, scene)
    hand.event("X")
    hand.drag((100, 100), (900, 200))
    assert hand.operator.sentence.startswith("Too few edges") and dragging.state(posed_camera) == before
    assert hand.event("RET") == {"CANCELLED"} and dragging.state(posed_camera) == before


def test_a_rectangle_of_known_sides_at_the_cursor_gives_all_of_the_camera(posed_camera, scene, settings):
    settings.kind, settings.sides, settings.axes = "RECTANGLE", (3, 2), "XY"
    scene.cursor.location = (-1, -0.5, 0.25)
    hand = Hand(posed_camera, scene)
    corners = seen((-1, -0.5, 0.25), (2, -0.5, 0.25), (2, 1.5, 0.25), (-1, 1.5, 0.25))
    for x, y in corners[:3]:
        hand.drag((x, y), (x, y))
    assert "3 of 4 corners" in hand.operator.sentence
    x, y = corners[3]
    hand.drag((x + 100, y), (x + 90, y + 50))  # put down in the wrong place,
    hand.drag((x + 90, y + 50), (x, y))  # and moved to the right one
    assert hand.event("RET") == {"FINISHED"}
    bpy.context.view_layer.update()
    pinhole = cameras.read(posed_camera, scene)
    assert np.allclose(pinhole.eye, PHOTO.eye, atol=1e-4) and pinhole.distance[0] == pytest.approx(1800, rel=1e-5)
    lines = photo_matching.summary_of(hand.operator.result, posed_camera.data.lens)
    assert lines[0].startswith("33.75 mm ± ") and "eye ±" in lines[1]


def test_objects_of_known_place_are_dragged_to_where_the_picture_shows_them(posed_camera, scene, settings, empty):
    places = [(-1, 0, 0), (1, -1, 0.5), (1, 1, 0), (0, 1, 2), (-1, 1, 1), (0.5, 0, 1.5)]
    for number, place in enumerate(places):
        empty(f"point {number}", place).select_set(True)
    posed_camera.select_set(False)
    settings.kind = "POINTS"
    hand = Hand(posed_camera, scene)
    order = [each.matrix_world.translation for each in bpy.context.selected_objects]
    for number, place in enumerate(order):
        hand.drag(hand.operator.drawing.ends[number], seen(tuple(place))[0])
    assert hand.event("RET") == {"FINISHED"}
    bpy.context.view_layer.update()
    assert np.allclose(cameras.read(posed_camera, scene).eye, PHOTO.eye, atol=1e-4)


def test_ends_of_edges_along_the_chosen_axis_can_be_moved(posed_camera, scene, settings):
    hand = Hand(posed_camera, scene)
    hand.drag((100, 100), (900, 200))
    hand.drag((905, 195), (800, 300))
    assert hand.operator.drawing.along == ["X"] and hand.operator.drawing.ends[1] == pytest.approx((800, 300))
    hand.event("Y")
    hand.drag((800, 300), (700, 900))
    assert hand.operator.drawing.along == ["X", "Y"] and hand.operator.drawing.ends[1] == pytest.approx((800, 300))


def test_a_click_is_no_edge_and_backspace_takes_the_last_one_away(posed_camera, scene, settings):
    hand = Hand(posed_camera, scene)
    hand.drag((500, 500), (503, 503))
    assert hand.operator.drawing.ends == [] == hand.operator.drawing.along
    hand.drag((100, 100), (900, 200))
    hand.event("Y")
    hand.drag((100, 900), (900, 800))
    assert hand.operator.drawing.along == ["X", "Y"]
    hand.event("BACK_SPACE")
    assert hand.operator.drawing.along == ["X"] and len(hand.operator.drawing.ends) == 2
    hand.event("BACK_SPACE")
    hand.event("BACK_SPACE")
    assert hand.operator.drawing.ends == []


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda camera, scene: setattr(camera.data, "type", "ORTHO"), "orthographic"),
        (lambda camera, scene: setattr(scene.render, "pixel_aspect_x", 2.0), "not square"),
        (lambda camera, scene: camera.virtual_pinhole.keyframe_insert("eye"), "animated values"),
        (lambda camera, scene: setattr(bpy.context.window_manager.virtual_pinhole_match, "kind", "POINTS"), "0 objects"),
        (
            lambda camera, scene: [setattr(scene.render, name, True) for name in ("use_border", "use_crop_to_border")],
            "Crop to Render Region",
        ),
    ],
)
def test_what_can_not_be_matched_is_refused_in_one_sentence(posed_camera, scene, settings, spoil, sentence):
    spoil(posed_camera, scene)
    for each in bpy.context.selected_objects:
        each.select_set(False)
    with pytest.raises(InputError, match=sentence):
        photo_matching.begun(posed_camera, bpy.context)


def test_a_camera_that_follows_an_object_is_refused(posed_camera, empty, settings):
    posed_camera.virtual_pinhole.look_at_target = empty("Target")
    with pytest.raises(InputError, match="follows an object"):
        photo_matching.begun(posed_camera, bpy.context)


def test_turning_the_add_on_off_while_it_goes_on_brings_the_camera_back(posed_camera, scene, settings, registered_addon):
    hand = hand_with_edges(posed_camera, scene)
    before = hand.operator.before["location"]
    photo_matching._drawn = hand.operator
    registered_addon.unregister()
    try:
        assert tuple(posed_camera.location) == before and photo_matching._drawn is None
    finally:
        registered_addon.register()
