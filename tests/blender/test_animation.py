"""Keyframed values move the camera, in the window's dependency graph and in a render's.

The lens in any unit, and the roll, take keyframes and drivers: what is kept is d and up, which follow at every frame.

Keyed cameras that a frame carries in one pass stand where each by itself would, to the bit; and the values of those that have
keyframes of their own follow them in one.
"""

import itertools
import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import camera_values, intrinsics, rotation
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import conversion, datablocks, findings, pose, storage, versions
from viewcam_addon.blender.camera import CameraSync
from viewcam_addon.blender.interface import panel
from viewcam_addon.blender.scenes import depsgraph
from viewcam_addon.pinhole import basis_of_views


@pytest.fixture
def flying_camera(posed_camera):
    """The eye goes from (7, −6, 5) at frame 1 to (7, −6, 25) at frame 11, the distance from 1500 to 500."""
    group = posed_camera.virtual_pinhole
    for frame, height, distance in ((1, 5, 1500), (11, 25, 500)):
        group.eye, group.distance = (7, -6, height), distance
        group.keyframe_insert("eye", frame=frame)
        group.keyframe_insert("distance", frame=frame)
    return posed_camera


def test_the_camera_follows_keyframed_values(flying_camera, scene):
    for frame in (1, 4, 6, 11):
        scene.frame_set(frame)
        height = flying_camera.virtual_pinhole.eye[2]
        assert flying_camera.matrix_world.translation.z == pytest.approx(height, rel=1e-6)
        assert findings.differences(cameras.stated(flying_camera, scene), cameras.read(flying_camera, scene), reach=30) == {}
    assert flying_camera.matrix_world.translation.z == 25


def test_it_follows_at_subframes(flying_camera, scene):
    scene.frame_set(6, subframe=0.5)
    assert flying_camera.matrix_world.translation.z == pytest.approx(flying_camera.virtual_pinhole.eye[2], rel=1e-6)
    scene.frame_set(6)
    assert flying_camera.matrix_world.translation.z == pytest.approx(15, rel=1e-6)


def test_it_follows_a_driver(posed_camera, scene):
    posed_camera.virtual_pinhole.driver_add("eye", 2).driver.expression = "frame * 2.0"
    scene.frame_set(9)
    assert posed_camera.matrix_world.translation.z == pytest.approx(18)


@pytest.fixture
def zooming_camera(posed_camera):
    """The zoom goes from 1 at frame 1 to 3 at frame 11."""
    group = posed_camera.virtual_pinhole
    for frame, zoom in ((1, 1), (11, 3)):
        group.zoom = zoom
        group.keyframe_insert("zoom", frame=frame)
    return posed_camera


def test_it_follows_a_keyed_zoom_at_frames_and_sub_frames(zooming_camera, scene):
    group = zooming_camera.virtual_pinhole
    for frame, subframe in ((1, 0.0), (6, 0.0), (6, 0.5), (11, 0.0)):
        scene.frame_set(frame, subframe=subframe)
        assert zooming_camera.data.lens == pytest.approx(group.zoom * 1500 * 36 / 1920, rel=2.0**-22)
        assert findings.differences(cameras.stated(zooming_camera, scene), cameras.read(zooming_camera, scene), reach=10) == {}
    assert (group.distance, group.zoom) == (1500, 3)
    scene.frame_set(6)
    assert group.zoom == pytest.approx(2)


def test_it_follows_a_driven_zoom(posed_camera, scene):
    posed_camera.virtual_pinhole.driver_add("zoom").driver.expression = "frame / 2.0"
    scene.frame_set(5)
    assert posed_camera.data.lens == pytest.approx(2.5 * 1500 * 36 / 1920, rel=2.0**-22)


@pytest.mark.parametrize("is_driven", [False, True])
def test_a_still_amid_two_frames_of_a_zoom_has_that_moments_lens(
    posed_camera, scene, render_positions, picture_error, is_driven
):
    group = posed_camera.virtual_pinhole
    if is_driven:
        group.driver_add("zoom").driver.expression = "frame / 4.0"
    else:
        for frame, zoom in ((1, 1), (11, 3)):
            group.zoom = zoom
            group.keyframe_insert("zoom", frame=frame)
    scene.frame_set(6, subframe=0.5)
    expected, positions = cameras.stated(posed_camera, scene), render_positions()
    error, tolerance = picture_error(expected, positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    scene.frame_set(6)
    other, _ = picture_error(cameras.stated(posed_camera, scene), positions)
    assert other > 100 * tolerance, f"the whole frame's zoom would pass, {other:.1e} px"


def test_a_zoom_rendered_in_one_go_is_that_of_each_frame(zooming_camera, scene, render_positions, picture_error):
    expected = {}
    for frame in (1, 11):
        scene.frame_set(frame)
        expected[frame] = cameras.stated(zooming_camera, scene)
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 11, 10
    for frame, positions in render_positions(animation=True).items():
        error, tolerance = picture_error(expected[frame], positions)
        assert error <= tolerance, f"frame {frame}: {error:.1e} px, and {tolerance:.1e} are rounding"
        other, _ = picture_error(expected[12 - frame], positions)
        assert other > 100 * tolerance, f"frame {frame}: the other frame's zoom would pass, {other:.1e} px"


def test_a_camera_whose_values_stand_still_is_left_to_its_artist(posed_camera, scene):
    posed_camera.location = (1, 1, 1)
    scene.frame_set(5)
    assert tuple(posed_camera.location) == (1, 1, 1)
    assert not datablocks.is_animated(posed_camera)


def test_a_camera_that_is_not_enabled_is_left_alone(flying_camera, scene):
    flying_camera.virtual_pinhole.enabled = False
    flying_camera.location = (1, 1, 1)
    scene.frame_set(5)
    assert tuple(flying_camera.location) == (1, 1, 1)


def test_a_frame_whose_values_make_no_camera_leaves_it_and_says_so(posed_camera, scene, capfd):
    group = posed_camera.virtual_pinhole
    for frame, eye in ((1, (7, -6, 5)), (2, (0, 0, 1))):
        group.eye = eye
        group.keyframe_insert("eye", frame=frame)
    scene.frame_set(1)
    scene.frame_set(2)
    assert tuple(posed_camera.location) == (7, -6, 5)
    assert "viewcam: frame 2: Camera: eye and look_at are the same point" in capfd.readouterr().err


def test_an_animation_rendered_in_one_go_follows_the_values(flying_camera, scene, render_positions, picture_error):
    """The originals stand at frame 11 all the time: only what the render itself evaluates can bring the camera down."""
    expected = {}
    for frame in (1, 6, 11):
        scene.frame_set(frame)
        expected[frame] = cameras.stated(flying_camera, scene)
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 11, 5
    for frame, positions in render_positions(animation=True).items():
        error, tolerance = picture_error(expected[frame], positions)
        assert error <= tolerance, f"frame {frame}: {error:.1e} px, and {tolerance:.1e} are rounding"


def test_the_picture_of_another_frame_would_be_noticed(flying_camera, scene, render_positions, picture_error):
    scene.frame_set(5)
    wrong = cameras.stated(flying_camera, scene)
    scene.frame_start = scene.frame_end = 6
    error, tolerance = picture_error(wrong, render_positions(animation=True)[6])
    assert error > 100 * tolerance


def test_what_hangs_on_the_camera_follows_in_a_render(flying_camera, scene, render_positions):
    bpy.ops.mesh.primitive_plane_add(size=0.5)
    child = bpy.context.object
    child.parent, child.location = flying_camera, (0, 0, -2)
    scene.frame_set(11)
    scene.frame_start = scene.frame_end = 6
    positions = render_positions(animation=True, also=[child])[6]
    scene.frame_set(6)
    pinhole = cameras.stated(flying_camera, scene)
    # 2 before the eye, in the pixel right and above of the middle: half a pixel off the axis.
    middle = positions[16, 16] - (np.array(pinhole.eye) - 2 * pinhole.basis()[2])
    assert np.abs(middle).max() <= 2 / min(pinhole.distance)


def test_it_follows_what_a_driver_reads_between_frames(posed_camera, scene):
    handle = bpy.data.objects.new("Handle", None)
    scene.collection.objects.link(handle)
    handle.location.z = 5
    driver = posed_camera.virtual_pinhole.driver_add("eye", 2).driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    target.id, target.data_path = handle, "location.z"
    scene.frame_set(1)
    for height in (8, 3):
        handle.location.z = height
        bpy.context.view_layer.update()
        assert posed_camera.matrix_world.translation.z == pytest.approx(height)


def test_a_constraint_in_the_way_of_a_driven_camera_makes_no_endless_loop(posed_camera, scene):
    posed_camera.virtual_pinhole.driver_add("eye", 2).driver.expression = "2.0 + 3.0"
    constraint = posed_camera.constraints.new("LIMIT_LOCATION")
    constraint.use_min_x, constraint.min_x = True, 9
    updates = []
    bpy.app.handlers.depsgraph_update_post.append(lambda *_: updates.append(None))
    try:
        posed_camera.update_tag()
        for _ in range(10):
            bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.pop()
    assert len(updates) == 1


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


MODES = (*("".join(order) for order in itertools.permutations("XYZ")), "QUATERNION", "AXIS_ANGLE")
FRAMES = range(2, 60, 7)
KEYS = {
    "eye": lambda i, frame: (7 - i, frame / 20 - 3, 5 + i / 3),
    "look_at": lambda i, frame: (frame / 30, i / 7, 1.0),
    "up": lambda i, frame: (i / 40, frame / 300, 1.0),
    "distance": lambda i, frame: 900.0 + 10 * i + frame,
    "zoom": lambda i, frame: 1.0 + frame / 100,
}


@pytest.fixture
def crowd(add_camera, scene):
    """Cameras in each rotation mode with each of the values keyed, some with deltas, mirrored, parented, held or focused."""
    result = []
    for i, mode in enumerate(MODES * 3):
        camera_object = add_camera(f"Camera {i}")
        camera_object.rotation_mode = mode
        group = camera_object.virtual_pinhole
        group.enabled, group.keeps = True, "PIXELS"
        for frame, name in itertools.product((1, 60), list(KEYS)[: 1 + i % len(KEYS)]):
            setattr(group, name, KEYS[name](i, frame))
            group.keyframe_insert(name, frame=frame)
        result.append(camera_object)
    result[1].delta_location = (1, 2, 3)
    result[2].scale = (-1, 1, 1)
    result[3].parent = result[0]
    result[4].virtual_pinhole.pole = "HOLD"
    result[5].virtual_pinhole.focus_on_look_at = True
    scene.frame_set(1)
    return result


def states(crowd):
    return [(conversion.state_of(each), storage.load(each), each.data.dof.focus_distance) for each in crowd]


def flight_of(crowd, scene):
    cameras.forget_all()
    scene.frame_set(1)
    flight = []
    for frame in FRAMES:
        scene.frame_set(frame)
        flight.append(states(crowd))
    return flight


def test_cameras_that_are_carried_together_stand_to_the_bit_where_each_by_itself_would(crowd, scene, monkeypatch):
    together = flight_of(crowd, scene)
    monkeypatch.setattr(CameraSync, "carry", lambda cameras, _scene, _depsgraph: [sync for sync, *_ in cameras])
    alone = flight_of(crowd, scene)
    for frame, *flight in zip(FRAMES, together, alone, strict=True):
        for each, state, expected in zip(crowd, *flight, strict=True):
            assert state == expected, f"frame {frame}, {each.name}, {each.rotation_mode}"


def test_most_of_them_are_carried_together(crowd, scene, monkeypatch):
    left, carry = [], CameraSync.carry

    def counting(*arguments):
        syncs = carry(*arguments)
        left.append([sync.camera_object.name for sync in syncs])
        return syncs

    scene.frame_set(2)
    monkeypatch.setattr(CameraSync, "carry", counting)
    scene.frame_set(3)
    assert set(left[0]) == {f"Camera {i}" for i in (1, 2, 3, 4)}


def test_a_camera_whose_values_make_none_for_a_while_stays_and_goes_on(add_camera, scene, capfd):
    first, second = add_camera("First"), add_camera("Second")
    for camera_object, eyes in ((first, ((0, 0, 4), (0, 0, -4))), (second, ((0, 3, 4), (0, 3, -4)))):
        group = camera_object.virtual_pinhole
        group.eye, group.look_at, group.enabled = (0, 3, 4), (0, 0, 0), True
        for frame, eye in zip((1, 9), eyes, strict=True):
            group.eye = eye
            group.keyframe_insert("eye", frame=frame)
        for curve in _curves(camera_object):
            for point in curve.keyframe_points:
                point.interpolation = "LINEAR"
    for frame in (4, 5, 6):
        scene.frame_set(frame)
        assert second.location.z == pytest.approx(5 - frame, abs=1e-6)
        assert first.location.z == pytest.approx(5 - frame if frame != 5 else 1, abs=1e-6)
    assert "First" in capfd.readouterr().err


def _curves(camera_object):
    from viewcam_addon.blender import versions

    return versions.action_curves(camera_object)


def test_a_camera_that_was_moved_by_hand_is_brought_back_by_the_next_frame(crowd, scene):
    expected = flight_of(crowd, scene)[0]
    scene.frame_set(1)
    crowd[0].location.x += 1
    scene.frame_set(FRAMES[0])
    assert states(crowd)[0][0] == expected[0][0]


@pytest.mark.parametrize("number", [1, 4], ids=["alone", "carried together"])
@pytest.mark.parametrize(("name", "value"), [("lens", 85.0), ("sensor_width", 24.0)])
def test_a_lens_that_a_script_sets_between_two_frames_counts_under_a_keyed_eye(add_camera, scene, number, name, value):
    """No update comes in between; the cameras are seen at a frame before."""
    flying = [add_camera(f"Camera {i}") for i in range(number)]
    for camera_object in flying:
        group = camera_object.virtual_pinhole
        group.enabled = True
        for frame in (1, 60):
            group.eye = KEYS["eye"](0, frame)
            group.keyframe_insert("eye", frame=frame)
    for frame in (1, 2, 3):
        scene.frame_set(frame)
    for camera_object in flying:
        setattr(camera_object.data, name, value)
    for frame in (4, 5):
        scene.frame_set(frame)
        for camera_object in flying:
            assert getattr(camera_object.data, name) == value
            assert findings.differences(cameras.stated(camera_object, scene), cameras.read(camera_object, scene), 20) == {}
            assert camera_object.virtual_pinhole.focal_length == pytest.approx(camera_object.data.lens)


@pytest.fixture
def flock(add_camera, scene):
    """Cameras in use in each rotation mode, with keyframes of their own; some of them with more that moves or holds them."""
    result = []
    for i, mode in enumerate(MODES * 2):
        camera_object = add_camera(f"Camera {i}")
        camera_object.rotation_mode = mode
        channel = pose.rotation_channel(camera_object)
        for frame in (1, 60):
            camera_object.location = (7 - i, frame / 20 - 3, 5 + i / 3)
            turn = rotation.from_euler((1 + frame / 90, i % 3 * frame / 200, frame / 40 + i), "XYZ")
            setattr(camera_object, channel, rotation.numbers(turn, mode, getattr(camera_object, channel)[:]))
            camera_object.keyframe_insert("location", frame=frame)
            camera_object.keyframe_insert(channel, frame=frame)
            if i % 4 == 3:
                camera_object.data.lens = 30 + frame / 3
                camera_object.data.keyframe_insert("lens", frame=frame)
        camera_object.virtual_pinhole.enabled = True
        result.append(camera_object)
    result[1].delta_location = (1, 2, 3)
    result[2].scale = (-1, 1, 1)
    result[4].parent = result[0]
    result[5].virtual_pinhole.pole = "HOLD"
    result[6].virtual_pinhole.keyframe_insert("look_at", frame=1)  # which stays, so that the camera turns to it
    result[8].scale = (3, 2, 1)
    scene.frame_set(1)
    return result


def numbers_of(flock):
    return np.array([(*v.eye, *v.look_at, *v.up, v.distance) for v in map(storage.load, flock)])


def test_the_values_of_many_keyed_cameras_are_true_at_each_frame_and_no_bit_of_a_camera_changes(flock, scene):
    for frame in FRAMES:
        scene.frame_set(frame)
        for each in flock:
            findings_of = cameras.check(each, cameras.stated(each, scene), scene)
            assert not any(finding.words or finding.differing for finding in findings_of), f"frame {frame}, {each.name}"
    in_use = [conversion.state_of(each) for each in flock]
    for each in flock:
        each.virtual_pinhole.enabled = False
    scene.frame_set(1)
    scene.frame_set(FRAMES[-1])
    for i, each in enumerate(flock):
        assert i == 6 or conversion.state_of(each) == in_use[i], each.name


def test_the_values_of_many_keyed_cameras_are_those_that_each_by_itself_would_have(flock, scene, monkeypatch):
    """But for what one of them takes for rounding and the other adopts."""
    together = [scene.frame_set(frame) or numbers_of(flock) for frame in FRAMES]
    assert storage.load(flock[0]).precision == 2.0**-53, "they have all of their digits"
    assert all(CameraSync.of(each)._values == storage.load(each) for each in flock)
    scene.frame_set(1)
    cameras.forget_all()
    monkeypatch.setattr(CameraSync, "carry", lambda cameras, _scene, _depsgraph: [sync for sync, *_ in cameras])
    alone = [scene.frame_set(frame) or numbers_of(flock) for frame in FRAMES]
    size = 1 + np.abs(alone).max(axis=(0, 2), keepdims=True)
    assert np.abs((np.array(together) - alone) / size).max() <= 2 * findings.LARGEST_TURN


def test_most_keyed_cameras_are_followed_together(flock, scene, monkeypatch):
    left, carry = [], CameraSync.carry
    monkeypatch.setattr(CameraSync, "carry", lambda *arguments: left.append(carry(*arguments)) or left[-1])
    scene.frame_set(2)
    scene.frame_set(3)
    assert {sync.camera_object.name for sync in left[-1]} == {f"Camera {i}" for i in (1, 2, 4, 5, 6)}


def test_keyframes_of_a_value_count_from_the_next_frame_on_and_no_longer_than_they_are_there(flock, scene):
    """Without an update in between; each action's curves are looked through once as long as they are the same."""
    scene.frame_set(2)
    scene.frame_set(3)
    group = flock[0].virtual_pinhole
    for step in range(2):
        group.eye = (1, 2, 3 + step)
        group.keyframe_insert("eye", frame=1)
        scene.frame_set(4)
        scene.frame_set(5)
        assert tuple(group.eye) == tuple(flock[0].matrix_world.translation) == (1, 2, 3 + step)
        versions.remove_curves(flock[0], "virtual_pinhole.eye")
        scene.frame_set(6)
        scene.frame_set(7)
        assert tuple(group.eye) == tuple(flock[0].location) and group.eye[0] == 7


def test_another_action_counts_from_the_next_frame_on(flock, scene):
    """Without an update in between: its curves are looked through, not those of the action before it."""
    group, data = flock[0].virtual_pinhole, flock[0].animation_data
    unkeyed, keyed = data.action, data.action.copy()
    data.action = keyed
    group.eye = (1, 2, 3)
    group.keyframe_insert("eye", frame=1)
    for frame, action in enumerate((unkeyed, keyed, unkeyed), 4):
        data.action = action
        scene.frame_set(2 * frame)
        scene.frame_set(2 * frame + 1)
        assert tuple(group.eye) == tuple(flock[0].matrix_world.translation), action.name
        assert (tuple(group.eye) == (1, 2, 3)) == (action == keyed)


def test_channels_that_a_script_makes_deltas_move_no_keyed_camera(crowd, scene):
    """Their matrices say nothing of it, and there is no update before the next frame."""
    expected = flight_of(crowd, scene)[1]
    scene.frame_set(FRAMES[0])
    for each in crowd[5:]:
        each.delta_location, each.location = each.location.copy(), (0, 0, 0)
    scene.frame_set(FRAMES[1])
    for each, (there, *_), (channels, *_) in zip(crowd, expected, states(crowd), strict=True):
        places = [np.add(state[0].location, state[0].delta_location) for state in (there, (channels[0],))]
        assert places[1] == pytest.approx(places[0], abs=1e-5), each.name


def test_an_up_that_is_taken_for_level_beyond_doubt_is_level_to_the_basis_too():
    """And most that are level are, else the basis would be asked for all of them."""
    rng, rounding = np.random.default_rng(3), findings.LARGEST_TURN
    poses = rng.normal(size=(4000, 3, 3))
    poses[:2000, 2] = (0, 0, 1)
    axes = basis_of_views(*poses.swapaxes(0, 1))[0].transpose(1, 2, 0)
    turns = rng.choice([0, 0.1, 0.3, 0.9, 1.1, 3, 1 / rounding], 4000) * rounding
    u, v, w = np.moveaxis(axes, -1, 0)
    cosine, sine = np.cos(turns)[:, None], np.sin(turns)[:, None]
    turned = np.stack([cosine * u - sine * v, cosine * v + sine * u, w], axis=-1)
    is_level = np.abs(v - turned[:, :, 1]).max(axis=-1) <= rounding
    beyond_doubt = camera_values._are_level(poses[:, 2], turned, rounding)
    assert not (beyond_doubt & ~is_level).any() and beyond_doubt[turns == 0].all()


def test_a_view_that_did_not_follow_its_camera_would_be_noticed(flock, scene, monkeypatch):
    monkeypatch.setattr(cameras, "moved_poses", lambda poses, *_: poses)
    scene.frame_set(2)
    scene.frame_set(30)
    assert cameras.check(flock[0], cameras.stated(flock[0], scene), scene)


def test_what_a_driver_reads_of_a_followed_camera_is_that_of_the_frame(flock, scene, empty):
    reader = empty("Reader")
    driver = reader.driver_add("location", 0).driver
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = flock[0], "virtual_pinhole.look_at[2]"
    driver.expression = variable.name
    for frame in (10, 20):
        scene.frame_set(frame)
        assert reader.matrix_world.translation.x == flock[0].virtual_pinhole.look_at[2]


def test_a_camera_that_is_keyed_straight_down_keeps_its_up(add_camera, scene):
    flock = [add_camera(f"Camera {i}") for i in range(4)]
    for i, each in enumerate(flock):
        for frame in (1, 60):
            each.location = (i, frame / 10, 9)
            each.keyframe_insert("location", frame=frame)
        each.rotation_euler = (0, 0, -math.pi / 2)  # as the canonical axes are
        each.virtual_pinhole.enabled = True
    before = storage.load(flock[0])
    for frame in (2, 30, 60):
        scene.frame_set(frame)
        assert storage.load(flock[0]).up == before.up
        assert storage.load(flock[0]).look_at[1] == pytest.approx(frame / 10, abs=0.2)
