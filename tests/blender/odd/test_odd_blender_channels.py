"""Channels of an enabled camera that something else sets too, or holds. docs/odd-blender.md says what each test expects."""

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import versions
from viewcam_addon.pinhole import Pinhole

MODES = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "QUATERNION", "AXIS_ANGLE")


def animate(block, path, *values, frames=(1, 5)):
    for frame, value in zip(frames, values, strict=True):
        setattr(block, path, value)
        block.keyframe_insert(path, frame=frame)
    bpy.context.scene.frame_set(1)


@pytest.mark.parametrize("mode", MODES)
def test_in_every_rotation_mode_the_pose_sticks(posed_camera, odd, mode):
    posed_camera.rotation_mode = mode
    odd.check(posed_camera)


def test_a_negative_scale_mirrors_the_picture_and_the_pose_sticks(posed_camera, scene, odd, render_positions, picture_error):
    posed_camera.scale = (-1, 2, 3)
    bpy.context.view_layer.update()
    pinhole = cameras.stated(posed_camera, scene)
    assert pinhole.mirrored
    cameras.apply(posed_camera, pinhole, scene)
    positions = render_positions()
    error, tolerance = picture_error(cameras.stated(posed_camera, scene), positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    odd.check(posed_camera)


def test_a_camera_that_is_scaled_to_zero_is_none(posed_camera, odd):
    posed_camera.scale = (1, 1, 0)
    odd.check(posed_camera)


@pytest.mark.parametrize("mode", MODES)
def test_delta_transforms_are_taken_off_and_the_pose_sticks(posed_camera, odd, mode):
    posed_camera.rotation_mode = mode
    posed_camera.delta_location, posed_camera.delta_scale = (1, 2, 3), (1, 2, 3)
    posed_camera.delta_rotation_euler = (0.1, 0.2, 0.3)
    posed_camera.delta_rotation_quaternion = (0.8, 0.0, 0.6, 0.0)
    odd.check(posed_camera)


def test_delta_transforms_that_change_later_move_the_camera(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera, "delta_location", (0, 0, 2)))


def test_locked_channels_are_moved_all_the_same(posed_camera, odd):
    posed_camera.lock_location[0] = posed_camera.lock_rotation[2] = True
    odd.check(posed_camera)


def test_a_driver_on_the_location_wins(posed_camera, odd):
    posed_camera.driver_add("location", 0).driver.expression = "1.0 + 1.0"
    odd.check(posed_camera)


def test_a_driver_on_the_rotation_wins(posed_camera, odd):
    posed_camera.driver_add("rotation_euler", 2).driver.expression = "1.0 + 0.0"
    odd.check(posed_camera)


def test_a_driver_on_the_lens_wins(posed_camera, odd):
    posed_camera.data.driver_add("lens").driver.expression = "20.0 + 1.0"
    odd.check(posed_camera)


def test_a_driver_on_the_shift_moves_the_picture_and_the_pose_sticks(posed_camera, odd):
    posed_camera.data.driver_add("shift_x").driver.expression = "0.1 + 0.1"
    odd.check(posed_camera)


def test_a_driver_that_is_muted_does_no_harm(posed_camera, odd):
    driver = posed_camera.driver_add("location", 0)
    driver.driver.expression, driver.mute = "1.0 + 1.0", True
    odd.check(posed_camera)


def test_a_camera_moved_by_hand_is_told_without_blaming_its_muted_driver(posed_camera, odd):
    driver = posed_camera.driver_add("location", 0)
    driver.driver.expression, driver.mute = "1.0 + 1.0", True
    odd.check(posed_camera, then=lambda: setattr(posed_camera, "location", (7, -6, 7)))


def test_drivers_on_the_four_values_move_the_camera(posed_camera, empty, odd):
    """The handle is moved between frames."""
    handle = empty("Handle", (0, 0, 5))
    driver = posed_camera.virtual_pinhole.driver_add("eye", 2).driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    target.id, target.data_path = handle, "location.z"
    bpy.context.scene.frame_set(1)
    odd.check(posed_camera, then=lambda: setattr(handle, "location", (0, 0, 8)))
    assert bpy.data.objects["Camera"].location.z == 8


def test_keyframes_on_the_location_win(posed_camera, odd):
    animate(posed_camera, "location", (7, -6, 5), (7, -6, 9))
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_keyframes_on_the_lens_win(posed_camera, odd):
    animate(posed_camera.data, "lens", posed_camera.data.lens, 50)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_keyframes_in_the_nla_win(posed_camera, odd):
    animate(posed_camera, "location", (7, -6, 5), (7, -6, 9))
    data = posed_camera.animation_data
    action = data.action
    data.action = None
    data.nla_tracks.new().strips.new("Strip", 1, action)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_keyframes_that_are_muted_do_no_harm(posed_camera, odd):
    animate(posed_camera, "location", (7, -6, 5), (7, -6, 9))
    for curve in versions.animation_curves(posed_camera):
        curve.mute = True
    odd.check(posed_camera)


def test_keyframes_on_location_and_values_alike_win_in_the_render_only(
    posed_camera, scene, odd, render_positions, picture_error
):
    animate(posed_camera, "location", (7, -6, 5), (7, -6, 9))
    animate(posed_camera.virtual_pinhole, "eye", (7, -6, 5), (7, -6, 6))
    scene.frame_start = scene.frame_end = 5
    positions = render_positions(animation=True)[5]
    scene.frame_set(5)
    stated = cameras.stated(posed_camera, scene)
    error, tolerance = picture_error(stated, positions)
    assert error > 100 * tolerance, "the render follows the four values"
    _, v, w = stated.basis()
    rendered = Pinhole((7, -6, 9), tuple((7, -6, 9) - w), tuple(v), stated.distance, stated.width, stated.height)
    error, tolerance = picture_error(rendered, positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    odd.check(posed_camera, reopened=False)


def test_keyframes_on_the_four_values_move_the_camera(posed_camera, odd):
    animate(posed_camera.virtual_pinhole, "eye", (7, -6, 5), (7, -6, 9))
    animate(posed_camera.virtual_pinhole, "distance", 1500, 500)
    odd.check(posed_camera)


def test_a_lens_changed_by_hand_is_told(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera.data, "lens", 50))


def test_a_shift_is_kept_and_the_pose_sticks(posed_camera, odd):
    posed_camera.data.shift_x, posed_camera.data.shift_y = 0.1, -0.2
    odd.check(posed_camera)


def test_a_lens_below_one_millimetre_grows_with_its_sensor(posed_camera, odd):
    posed_camera.virtual_pinhole.distance = 8
    odd.check(posed_camera)


def test_depth_of_field_blurs_the_picture_and_the_pose_sticks(posed_camera, odd):
    posed_camera.data.dof.use_dof = True
    odd.check(posed_camera)


def test_a_camera_made_orthographic_later_is_refused(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera.data, "type", "ORTHO"))


def test_a_camera_made_panoramic_later_is_refused(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera.data, "type", "PANO"))


def test_a_pose_far_from_the_origin_is_stored_as_well_as_float32_can(posed_camera, scene):
    pinhole = Pinhole((4.6e6, 1e6, 5.0), (4.6e6, 1e6 + 10, 1.0), (0, 0, 1), 1500, 1920, 1080)
    assert cameras.apply(posed_camera, pinhole, scene) == []
