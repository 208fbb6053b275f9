import math
from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

FLOAT32 = 2.0**-24
# Three angles or four numbers of a quaternion rounded to float32 (6), and the products of the rotation (3).
ROTATION = 9 * FLOAT32
# A parent adds the product with its inverse and the product with the local matrix, four roundings each.
ROTATION_UNDER_PARENT = ROTATION + 8 * FLOAT32
MODES = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "QUATERNION", "AXIS_ANGLE"]


def random_pinhole(random, **changes):
    eye = random.normal(0, 5, 3)
    values = (tuple(eye), tuple(eye + random.normal(0, 3, 3)), tuple(random.normal(size=3)), 1000.0, 1920, 1080)
    return replace(Pinhole(*values), **changes)


def wanted_axes(pinhole):
    u, v, w = pinhole.basis()
    return np.column_stack([-u if pinhole.mirrored else u, v, w])


def errors(camera_object, pinhole):
    """(largest error of a normalized matrix entry, distance of the eyes) of the evaluated camera."""
    evaluated = camera_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    matrix = np.array(evaluated.matrix_world)
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    return np.abs(axes - wanted_axes(pinhole)).max(), math.dist(matrix[:3, 3], pinhole.eye)


@pytest.mark.parametrize("mode", MODES)
def test_the_pose_is_stored_to_float32_in_every_rotation_mode(camera_object, scene, mode):
    random = np.random.default_rng(1)
    camera_object.rotation_mode = mode
    for _ in range(200):
        pinhole = random_pinhole(random)
        assert cameras.apply(camera_object, pinhole, scene) == []
        turned, moved = errors(camera_object, pinhole)
        assert turned <= ROTATION, f"{mode}: a matrix entry is off by {turned:.2e}"
        assert moved <= FLOAT32 * np.linalg.norm(pinhole.eye), f"the eye is off by {moved:.2e}"
        assert camera_object.rotation_mode == mode


@pytest.mark.parametrize("mode", MODES)
def test_a_camera_rolled_on_its_side_keeps_its_roll_in_gimbal_lock(camera_object, scene, mode):
    random = np.random.default_rng(2)
    camera_object.rotation_mode = mode
    for exponent in range(-9, 0):
        view = np.array([*random.normal(size=2), 10.0**exponent])
        pinhole = Pinhole((0, 0, 0), tuple(view), tuple(np.cross(view, (0, 0, 1))), 1000.0, 1920, 1080)
        cameras.apply(camera_object, pinhole, scene)
        turned, _ = errors(camera_object, pinhole)
        assert turned <= ROTATION, f"1e{exponent} from gimbal lock a matrix entry is off by {turned:.2e}"


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9, 1e-12, 1e-16, 0.0])
def test_a_look_straight_down_keeps_the_roll_that_was_stated(camera_object, scene, angle):
    pinhole = Pinhole((angle, 0, 0), (0, 0, -1), (0, 0, 1), 1000.0, 1920, 1080)
    cameras.apply(camera_object, pinhole, scene)
    turned, _ = errors(camera_object, pinhole)
    assert turned <= ROTATION, f"a matrix entry is off by {turned:.2e}"


@pytest.mark.parametrize("mode", MODES)
def test_delta_transforms_are_taken_off(camera_object, scene, mode):
    camera_object.rotation_mode = mode
    camera_object.delta_location = (1, 2, 3)
    camera_object.delta_rotation_euler = (0.1, 0.2, 0.3)
    camera_object.delta_rotation_quaternion = (0.8, 0.0, 0.6, 0.0)
    camera_object.delta_scale = (1, 2, -3)
    pinhole = random_pinhole(np.random.default_rng(3), mirrored=True)
    assert cameras.apply(camera_object, pinhole, scene) == []
    turned, moved = errors(camera_object, pinhole)
    assert turned <= ROTATION + 4 * FLOAT32, f"{turned:.2e}"  # one product of rotations more
    assert moved <= 4 * FLOAT32 * (math.hypot(1, 2, 3) + np.linalg.norm(pinhole.eye))


@pytest.mark.parametrize("seed", range(20))
def test_a_parents_place_rotation_and_uniform_scale_are_respected(camera_object, scene, seed):
    random = np.random.default_rng(seed)
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    camera_object.parent = parent
    parent.location, parent.rotation_euler = random.normal(0, 5, 3), random.normal(0, 2, 3)
    parent.scale = [random.choice([-1, 1]) * math.exp(random.normal())] * 3
    bpy.context.view_layer.update()
    if seed % 2:
        camera_object.matrix_parent_inverse = parent.matrix_world.inverted()
        parent.location = random.normal(0, 5, 3)
    pinhole = random_pinhole(random)
    assert cameras.apply(camera_object, pinhole, scene) == []
    turned, moved = errors(camera_object, pinhole)
    assert turned <= ROTATION_UNDER_PARENT, f"{turned:.2e}"
    assert moved <= 9 * FLOAT32 * 100, f"{moved:.2e}"  # lengths below 100 went into it


def test_a_bone_as_parent_is_respected(camera_object, scene, add_rig):
    armature = add_rig(0.4)
    armature.location = (1, 2, 3)
    camera_object.parent, camera_object.parent_type, camera_object.parent_bone = armature, "BONE", "Head"
    pinhole = random_pinhole(np.random.default_rng(4))
    assert cameras.apply(camera_object, pinhole, scene) == []
    turned, moved = errors(camera_object, pinhole)
    assert turned <= 2 * ROTATION_UNDER_PARENT, f"{turned:.2e}"
    assert moved <= 9 * FLOAT32 * 30, f"{moved:.2e}"


def test_read_gives_back_what_apply_was_given(camera_object, scene):
    random = np.random.default_rng(5)
    for mirrored in (False, True):
        pinhole = random_pinhole(random, mirrored=mirrored, principal_point=(1000.0, 500.0))
        cameras.apply(camera_object, pinhole, scene)
        read_back = cameras.read(camera_object, scene)
        assert read_back.mirrored == mirrored
        np.testing.assert_allclose(np.stack(read_back.basis()), np.stack(pinhole.basis()), rtol=0, atol=ROTATION)
        np.testing.assert_allclose(read_back.eye, pinhole.eye, rtol=FLOAT32)
        np.testing.assert_allclose(read_back.distance, pinhole.distance, rtol=2 * FLOAT32)
        np.testing.assert_allclose(read_back.principal_point, pinhole.principal_point, rtol=0, atol=2 * FLOAT32 * 1920)


def test_stated_gives_back_in_float64_what_apply_was_given(camera_object, scene):
    scene.render.resolution_percentage = 37
    frame = (1920 * 37 // 100, 1080 * 37 // 100)
    pinhole = Pinhole((1 / 3, 0, 7e5 / 3), (0, 1e-9 / 3, 0), (0, 1 / 3, 1), 1000 / 3, *frame)
    cameras.apply(camera_object, pinhole, scene)
    stated = cameras.stated(camera_object, scene)
    assert (stated.eye, stated.look_at, stated.up) == (pinhole.eye, pinhole.look_at, pinhole.up)
    assert stated.distance[0] == pytest.approx(pinhole.distance[0], rel=4e-16)


def test_a_camera_that_is_not_enabled_states_nothing(camera_object, scene):
    assert cameras.stated(camera_object, scene) is None


@pytest.mark.parametrize(
    ("scale", "mirrored", "looks_back"),
    [((2, 3, 4), False, False), ((-1, 1, 1), True, False), ((1, -1, 1), True, False), ((1, 1, -1), True, True)],
)
def test_a_scale_is_read_as_cycles_reads_it(camera_object, scene, scale, mirrored, looks_back):
    camera_object.scale = scale
    pinhole = cameras.read(camera_object, scene)
    assert pinhole.mirrored == mirrored
    np.testing.assert_allclose(pinhole.basis()[2], (0, 0, -1 if looks_back else 1), atol=1e-15)


@pytest.mark.parametrize("scale", [(2, 3, 4), (-1, 1, 1), (1, -2, 1), (1, 1, -1), (-1, -1, -1)])
@pytest.mark.parametrize("mirrored", [False, True])
def test_the_artists_scale_stays_unless_the_picture_asks_for_another_sign(camera_object, scene, scale, mirrored):
    camera_object.scale = scale
    before_mirrored = cameras.read(camera_object, scene).mirrored
    pinhole = random_pinhole(np.random.default_rng(6), mirrored=mirrored)
    assert cameras.apply(camera_object, pinhole, scene) == []
    assert cameras.read(camera_object, scene).mirrored == mirrored
    assert errors(camera_object, pinhole)[0] <= ROTATION
    assert tuple(map(abs, camera_object.scale)) == tuple(map(abs, scale))
    assert (tuple(camera_object.scale) == scale) == (before_mirrored == mirrored)


def test_a_short_lens_grows_the_sensor_and_a_longer_one_brings_the_artists_back(camera_object, scene):
    camera = camera_object.data
    camera.sensor_width, camera.sensor_height = 35.5, 20.25
    wide = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 8.0, 1920, 1080)
    (finding,) = cameras.apply(camera_object, wide, scene)
    assert "1 mm" in finding
    assert camera.lens >= 1
    assert (camera.sensor_width, camera.sensor_height) == (35.5 * 8, 20.25 * 8)
    assert cameras.read(camera_object, scene).distance == pytest.approx((8.0, 8.0), rel=2 * FLOAT32)
    assert cameras.apply(camera_object, replace(wide, distance=1500.0), scene) == []
    assert (camera.sensor_width, camera.sensor_height) == (35.5, 20.25)


def test_a_sensor_that_the_artist_changed_meanwhile_is_the_artists(camera_object, scene):
    wide = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 8.0, 1920, 1080)
    cameras.apply(camera_object, wide, scene)
    camera_object.data.sensor_width = 50.0
    cameras.apply(camera_object, replace(wide, distance=1500.0), scene)
    assert camera_object.data.sensor_width == 50.0


def test_the_scene_is_never_changed(camera_object, scene):
    render = scene.render
    render.resolution_x, render.resolution_y, render.pixel_aspect_x = 801, 333, 1.5
    cameras.apply(camera_object, Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), (700.0, 1050.0), 801, 333), scene)
    assert (render.resolution_x, render.resolution_y, render.resolution_percentage) == (801, 333, 100)
    assert (render.pixel_aspect_x, render.pixel_aspect_y) == (1.5, 1.0)


@pytest.mark.parametrize(
    "changes",
    [{"width": 1000}, {"distance": (1000.0, 1100.0)}, {"distance": 1e41}, {"eye": (1e39, 0, 0)}, {"up": (0, 1e39, 0)}],
)
def test_what_the_scene_or_blender_can_not_hold_is_refused_and_nothing_changes(posed_camera, scene, changes):
    before = (posed_camera.matrix_world.copy(), posed_camera.data.lens, posed_camera.virtual_pinhole.exact)
    with pytest.raises(InputError) as error:
        cameras.apply(posed_camera, replace(random_pinhole(np.random.default_rng(7)), **changes), scene)
    assert "\n" not in str(error.value)
    bpy.context.view_layer.update()
    assert (posed_camera.matrix_world, posed_camera.data.lens, posed_camera.virtual_pinhole.exact) == before


@pytest.mark.parametrize(("kind", "word"), [("ORTHO", "orthographic"), ("PANO", "panoramic")])
def test_what_is_no_pinhole_is_refused_by_name(camera_object, scene, kind, word):
    camera_object.data.type = kind
    for call in (
        lambda: cameras.read(camera_object, scene),
        lambda: cameras.apply(camera_object, random_pinhole(np.random.default_rng(8)), scene),
        lambda: cameras.adopt(camera_object, scene),
    ):
        with pytest.raises(InputError, match=f"'Camera' is {word}"):
            call()


def test_an_object_that_is_no_camera_is_refused_by_name(fresh_blender, scene):
    light = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(light)
    with pytest.raises(InputError, match="'Lamp' is no camera"):
        cameras.read(light, scene)


def test_a_sheared_camera_is_refused_and_its_parent_named(camera_object, scene):
    parent = bpy.data.objects.new("Stretched", None)
    scene.collection.objects.link(parent)
    parent.scale = (1, 1, 3)
    camera_object.parent = parent
    camera_object.rotation_euler = (0.7, 0, 0)
    bpy.context.view_layer.update()
    with pytest.raises(InputError, match=r"oblique.*'Stretched'"):
        cameras.read(camera_object, scene)


def test_a_parents_stretching_along_the_cameras_own_axes_is_no_shear(camera_object, scene):
    parent = bpy.data.objects.new("Stretched", None)
    scene.collection.objects.link(parent)
    parent.scale = (1, 1, 3)
    camera_object.parent = parent
    bpy.context.view_layer.update()
    np.testing.assert_allclose(cameras.read(camera_object, scene).basis(), np.eye(3), atol=1e-15)


def test_a_camera_scaled_to_nothing_is_refused(camera_object, scene):
    camera_object.scale = (1, 0, 1)
    bpy.context.view_layer.update()
    with pytest.raises(InputError, match="scaled to zero"):
        cameras.read(camera_object, scene)


def test_a_parent_scaled_to_nothing_is_refused(camera_object, scene):
    parent = bpy.data.objects.new("Flat", None)
    scene.collection.objects.link(parent)
    parent.scale = (1, 0, 1)
    camera_object.parent = parent
    with pytest.raises(InputError, match="scaled to zero"):
        cameras.apply(camera_object, random_pinhole(np.random.default_rng(9)), scene)


def test_a_camera_that_blender_does_not_evaluate_is_refused(camera_object, add_camera, scene):
    add_camera("Other")
    camera_object.hide_viewport = True
    with pytest.raises(InputError, match="'Camera' takes no part in scene 'Scene'"):
        cameras.read(camera_object, scene)


def test_a_camera_of_another_scene_is_set_and_read_there(fresh_blender, camera_object):
    other = bpy.data.scenes.new("Other")
    other.render.resolution_x, other.render.resolution_y = 100, 200
    elsewhere = bpy.data.objects.new("Elsewhere", bpy.data.cameras.new("Elsewhere"))
    other.collection.objects.link(elsewhere)
    pinhole = Pinhole((1, 2, 3), (0, 0, 0), (0, 0, 1), 100.0, 100, 200)
    assert cameras.apply(elsewhere, pinhole, other) == []
    read_back = cameras.read(elsewhere, other)
    assert (read_back.width, read_back.height) == (100, 200)
    assert read_back.eye == (1, 2, 3)


def test_far_from_the_origin_reading_loses_no_digit_of_the_matrix(camera_object, scene):
    camera_object.location, camera_object.rotation_euler = (1e7, -3e6, 5e5), (1.0, 0.2, 0.3)
    bpy.context.view_layer.update()
    axes = np.array(camera_object.matrix_world)[:3, :3]
    # The matrix is orthonormal to float32, and reading takes the nearest orthonormal one.
    error = np.abs(np.column_stack(cameras.read(camera_object, scene).basis()) - axes).max()
    assert error <= 4 * FLOAT32, f"{error:.1e}"


def test_the_focus_is_left_alone_unless_it_is_asked_to_stay_on_the_look_at_point(posed_camera, scene, empty):
    focus, group = posed_camera.data.dof, posed_camera.virtual_pinhole
    focus.focus_distance = 3.5
    group.eye = (7, -6, 4)
    bpy.context.view_layer.update()
    assert focus.focus_distance == 3.5
    group.focus_on_look_at = True
    assert focus.focus_distance == pytest.approx(math.dist((7, -6, 4), (0, 0, 1)), rel=2.0**-23)
    group.eye = (7, -6, 5)
    assert focus.focus_distance == pytest.approx(math.dist((7, -6, 5), (0, 0, 1)), rel=2.0**-23)
    target = empty("Target", (1, 2, 3))
    group.look_at_target = target
    target.location = (1, 2, 4)
    bpy.context.view_layer.update()
    assert focus.focus_distance == pytest.approx(math.dist((7, -6, 5), (1, 2, 4)), rel=2.0**-23)


def test_keyframes_of_the_focus_distance_win_and_animated_values_pull_the_focus_in_the_render(posed_camera, scene):
    from viewcam_addon.blender.scenes import depsgraph

    group, focus = posed_camera.virtual_pinhole, posed_camera.data.dof
    group.focus_on_look_at = True
    for frame, z in ((1, 1.0), (11, 3.0)):
        group.look_at = (0, 0, z)
        group.keyframe_insert("look_at", frame=frame)
    result = {}
    for frame in (1, 11):
        scene.frame_set(frame)
        result[frame] = depsgraph.visit(scene, lambda graph: posed_camera.data.evaluated_get(graph).dof.focus_distance)
    assert result == {frame: pytest.approx(math.dist((7, -6, 5), (0, 0, z)), rel=2.0**-23) for frame, z in ((1, 1), (11, 3))}
    focus.focus_distance = 2.0
    focus.keyframe_insert("focus_distance", frame=1)
    scene.frame_set(5)
    assert depsgraph.visit(scene, lambda graph: posed_camera.data.evaluated_get(graph).dof.focus_distance) == 2.0
