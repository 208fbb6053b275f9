"""The lens in any unit, and the roll, take keyframes and drivers: what is kept is d and up, which follow at every frame."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import intrinsics
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks, versions
from viewcam_addon.blender.interface import panel
from viewcam_addon.blender.scenes import depsgraph

FULL_HD = intrinsics.Frame(1920, 1080)
LENSES = {
    "focal_length": (35.0, 70.0),
    "horizontal_fov": (0.6, 1.2),
    "vertical_fov": (0.4, 0.8),
    "diagonal_fov": (0.7, 1.3),
    "distance": (1500.0, 3000.0),
}


def key(group, name, first, last):
    for frame, value in ((1, first), (11, last)):
        setattr(group, name, value)
        group.keyframe_insert(name, frame=frame)
    (curve,) = (each for each in versions.action_curves(group.id_data) if each.data_path == f"virtual_pinhole.{name}")
    for point in curve.keyframe_points:
        point.interpolation = "LINEAR"


def focal_length_of(name, value):
    """Millimeters on a sensor of 36 mm, of a picture of 1920 × 1080."""
    unit = datablocks.LENSES.get(name, "PIXELS")
    return intrinsics.distance_by_lens(unit, value, FULL_HD, (36.0, 24.0), "AUTO") * 36 / 1920


@pytest.mark.parametrize("name", LENSES)
def test_a_lens_that_is_keyed_in_any_unit_is_that_at_every_frame(posed_camera, scene, name):
    first, last = LENSES[name]
    key(posed_camera.virtual_pinhole, name, first, last)
    for frame in (1, 6, 4, 11):
        scene.frame_set(frame)
        value = first + (last - first) * (frame - 1) / 10
        assert getattr(posed_camera.virtual_pinhole, name) == pytest.approx(value, rel=1e-6)
        assert posed_camera.data.lens == pytest.approx(focal_length_of(name, value), rel=1e-6)
        assert posed_camera.virtual_pinhole.distance == pytest.approx(posed_camera.data.lens * 1920 / 36, rel=1e-6)
        assert panel.notices(posed_camera, scene) == []


@pytest.mark.parametrize("name", LENSES)
def test_a_render_has_the_keyed_lens(posed_camera, scene, name):
    first, last = LENSES[name]
    key(posed_camera.virtual_pinhole, name, first, last)
    scene.frame_set(6)
    pinhole = depsgraph.visit(scene, lambda graph: cameras.stated(posed_camera.evaluated_get(graph), scene).distance[0])
    assert pinhole * 36 / 1920 == pytest.approx(focal_length_of(name, (first + last) / 2), rel=1e-6)


def test_a_curve_keeps_its_meaning_whatever_unit_is_shown(posed_camera, scene):
    group = posed_camera.virtual_pinhole
    group.lens_unit = "VERTICAL"
    key(group, "vertical_fov", 0.4, 0.8)
    group.lens_unit = "MILLIMETERS"
    scene.frame_set(6)
    assert group.vertical_fov == pytest.approx(0.6, rel=1e-6)


def test_a_roll_that_is_keyed_while_the_eye_flies_is_that_at_every_frame(posed_camera, scene):
    group = posed_camera.virtual_pinhole
    key(group, "roll", 0.0, 1.0)
    for frame, eye in ((1, (7, -6, 5)), (11, (-7, -6, 3))):
        group.eye = eye
        group.keyframe_insert("eye", frame=frame)
    for frame in (6, 1, 11, 3):
        scene.frame_set(frame)
        assert group.roll == pytest.approx((frame - 1) / 10, abs=1e-6)
        u = np.array(cameras.read(posed_camera, scene).basis()[0])
        assert u[2] == pytest.approx(
            math.sin(group.roll) * np.hypot(*cameras.read(posed_camera, scene).basis()[2][:2]), abs=1e-6
        )
    assert panel.notices(posed_camera, scene) == []


@pytest.mark.parametrize(("name", "value"), [("focal_length", 42.0), ("horizontal_fov", 1.0), ("roll", 0.25)])
def test_a_driver_of_a_look_is_followed(posed_camera, scene, name, value):
    driver = posed_camera.virtual_pinhole.driver_add(name).driver
    driver.expression = f"{value} * frame"
    for frame in (1, 2):
        scene.frame_set(frame)
        assert getattr(posed_camera.virtual_pinhole, name) == pytest.approx(value * frame, rel=1e-5)
    assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene) == []


def test_an_edit_of_what_is_keyed_lasts_until_the_next_frame_as_any_of_blenders(posed_camera, scene):
    group = posed_camera.virtual_pinhole
    key(group, "focal_length", 35.0, 70.0)
    scene.frame_set(6)
    group.focal_length = 20.0
    bpy.context.view_layer.update()
    assert posed_camera.data.lens == 20 and group.focal_length == pytest.approx(20)
    group.distance = 2000.0
    bpy.context.view_layer.update()
    assert posed_camera.data.lens == pytest.approx(37.5) and group.focal_length == pytest.approx(37.5)
    scene.frame_set(7)
    assert posed_camera.data.lens == pytest.approx(35 + 35 * 0.6)


def test_a_keyed_lens_moves_no_bit_of_the_pose(posed_camera, scene):
    posed_camera.rotation_euler = (1.1, 0.2, 0.3)
    bpy.context.view_layer.update()
    key(posed_camera.virtual_pinhole, "focal_length", 35.0, 70.0)
    before = [tuple(row) for row in posed_camera.matrix_world]
    for frame in (1, 6, 11):
        scene.frame_set(frame)
        assert [tuple(row) for row in posed_camera.matrix_world] == before


def test_auto_keying_keys_the_lens_in_the_unit_in_which_it_is_keyed(posed_camera, scene):
    key(posed_camera.virtual_pinhole, "focal_length", 35.0, 35.0)
    scene.frame_set(6)
    scene.tool_settings.use_keyframe_insert_auto = True
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 1))
    bpy.ops.viewcam.frame_selection(camera="Camera", by="DISTANCE", center=False)
    there = posed_camera.data.lens
    assert there != pytest.approx(35)
    scene.frame_set(7)
    scene.frame_set(6)
    assert posed_camera.data.lens == pytest.approx(there, rel=1e-6)


def test_what_is_asked_of_a_look_is_saved_as_its_value_alone(posed_camera):
    posed_camera.virtual_pinhole.focal_length = 42.0
    assert "asked" not in versions.stored_properties(posed_camera.virtual_pinhole)
