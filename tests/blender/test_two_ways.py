"""Blender's own ways to move a camera move its values."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import findings, pose, versions
from viewcam_addon.blender.interface import dragging, panel


def update():
    bpy.context.view_layer.update()


def differences(camera_object, scene):
    """Differences between values and camera by more than float32 storage explains."""
    update()
    reach = pose.reach(camera_object, bpy.context.evaluated_depsgraph_get())
    return findings.differences(cameras.stated(camera_object, scene), cameras.read(camera_object, scene), reach)


def test_a_camera_moved_in_blender_takes_eye_and_look_at_along(posed_camera, scene):
    posed_camera.location.x += 2
    update()
    group = posed_camera.virtual_pinhole
    assert tuple(group.eye) == (9, -6, 5) and tuple(group.look_at) == (2, 0, 1) and tuple(group.up) == (0, 0, 1)
    assert differences(posed_camera, scene) == {}


def test_a_camera_turned_in_blender_looks_as_far_as_before_and_keeps_its_eye(posed_camera, scene):
    reach = math.dist((7, -6, 5), (0, 0, 1))
    posed_camera.rotation_euler.z += 0.5
    update()
    eye, look_at, up, _ = posed_camera.virtual_pinhole.numbers()
    assert eye == (7, -6, 5) and up == (0, 0, 1)
    assert math.dist(eye, look_at) == pytest.approx(reach, rel=1e-15)
    assert differences(posed_camera, scene) == {}


def test_a_focal_length_typed_in_blender_is_the_values_distance(posed_camera, scene):
    posed_camera.data.lens = 85
    update()
    assert posed_camera.virtual_pinhole.distance == pytest.approx(85 * 1920 / 36, rel=2.0**-22)
    posed_camera.data.sensor_width = 24
    update()
    assert posed_camera.virtual_pinhole.distance == pytest.approx(85 * 1920 / 24, rel=2.0**-22)


def test_under_a_target_the_eye_moves_and_the_view_keeps_the_target(posed_camera, scene, empty):
    target = empty("Target", (1, 2, 3))
    posed_camera.virtual_pinhole.look_at_target = target
    update()
    posed_camera.location = (3, -9, 4)
    update()
    update()
    pinhole = cameras.read(posed_camera, scene)
    assert pinhole.eye == (3, -9, 4)
    assert differences(posed_camera, scene) == {}
    column, row, _ = pinhole.project(np.array([1, 2, 3.0]))
    assert (column, row) == pytest.approx((960, 540), abs=1e-3)


def test_a_canceled_move_gives_every_bit_back(posed_camera, scene):
    group = posed_camera.virtual_pinhole
    group.eye = (7.1, -6, 5)
    group.exact = "[7.1000000001, -6, 5, 0, 0, 1, 0, 0, 1, 1500]"  # more digits than Blender's
    update()
    pinhole = cameras.stated(posed_camera, scene)
    before = tuple(posed_camera.location)
    posed_camera.location = (1, 2, 3)
    update()
    assert cameras.stated(posed_camera, scene) != pinhole
    posed_camera.location = before
    update()
    assert cameras.stated(posed_camera, scene) == pinhole


def test_a_turn_that_is_canceled_after_a_move_that_was_not_gives_every_bit_back(posed_camera, scene):
    """Blender updates what a move has ended with once more. Many moves, and one of many steps."""
    posed_camera.rotation_euler = (1.1, 0.2, 0.7)
    update()
    for step in range(20):
        posed_camera.location.x += 1
        update()
        posed_camera.update_tag()
        update()
        before, stood, turned = (
            cameras.stated(posed_camera, scene),
            tuple(posed_camera.rotation_euler),
            range(100 if step == 7 else 3),
        )
        for _ in turned:
            posed_camera.rotation_euler.z += 0.1
            update()
        assert cameras.stated(posed_camera, scene) != before
        posed_camera.rotation_euler = stood
        update()
        assert cameras.stated(posed_camera, scene) == before, f"after {step + 1} moves"
        posed_camera.update_tag()
        update()


def test_values_edited_between_two_moves_are_not_forgotten(posed_camera, scene):
    posed_camera.location.x += 1
    update()
    posed_camera.location.x -= 1
    update()
    group = posed_camera.virtual_pinhole
    group.look_at = tuple(2 * l - e for e, l in zip(group.eye, group.look_at, strict=True))  # farther: the camera stays
    update()
    before = cameras.stated(posed_camera, scene)
    posed_camera.location.x += 1
    update()
    posed_camera.location.x -= 1
    update()
    assert cameras.stated(posed_camera, scene) == before


def test_a_parent_moved_by_hand_carries_the_values_along(posed_camera, scene, empty):
    posed_camera.parent = parent = empty("Parent")
    update()
    parent.location.z = 2
    update()
    assert tuple(posed_camera.virtual_pinhole.eye) == (7, -6, 7) and differences(posed_camera, scene) == {}


@pytest.mark.parametrize("way", ["unparented", "deleted", "constraint removed"])
def test_a_camera_that_nothing_carries_any_more_keeps_values_that_are_true(posed_camera, scene, empty, way):
    mover = empty("Mover", (1, 2, 3))
    if way == "constraint removed":
        posed_camera.constraints.new("COPY_LOCATION").target = mover
    else:
        posed_camera.parent = mover
    update()
    carried = tuple(posed_camera.virtual_pinhole.eye)
    if way == "deleted":
        bpy.data.objects.remove(mover)
    posed_camera.parent = None
    posed_camera.constraints.clear()
    assert differences(posed_camera, scene) == {}
    assert tuple(posed_camera.virtual_pinhole.eye) == (7, -6, 5) != carried


def test_a_file_opens_with_values_that_are_true_where_something_was_edited_and_not_keyed(posed_camera, scene, tmp_path):
    """Blender shows the keyed number then: that of the values moves the camera, that of the camera the values."""
    posed_camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    posed_camera.virtual_pinhole.eye = (1, 2, 3)
    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    scene.collection.objects.link(other)
    other.location = (4, 5, 6)
    other.keyframe_insert("location", frame=1)
    other.virtual_pinhole.enabled = True
    other.location = (1, 2, 3)
    update()
    path = str(tmp_path / "edited.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    for name, eye in (("Camera", (7, -6, 5)), ("Other", (4, 5, 6))):
        camera_object = bpy.data.objects[name]
        assert differences(camera_object, bpy.context.scene) == {}, name
        assert tuple(camera_object.virtual_pinhole.eye) == eye == tuple(camera_object.matrix_world.translation)


def test_keyframes_on_the_location_move_the_values_as_frames_pass(posed_camera, scene):
    for frame, height in ((1, 5), (11, 25)):
        posed_camera.location.z = height
        posed_camera.keyframe_insert("location", frame=frame)
    for frame in (11, 6, 1):
        scene.frame_set(frame)
        assert posed_camera.virtual_pinhole.eye[2] == pytest.approx(posed_camera.location.z, rel=1e-7)
        assert differences(posed_camera, scene) == {}


def test_a_keyed_value_wins_at_the_next_frame(posed_camera, scene):
    group = posed_camera.virtual_pinhole
    group.keyframe_insert("eye", frame=1)
    posed_camera.location = (1, 2, 3)
    update()
    assert tuple(group.eye) == (1, 2, 3)
    scene.frame_set(2)
    assert tuple(group.eye) == (7, -6, 5) == tuple(posed_camera.location)


def test_a_driven_number_stays_and_the_others_follow_the_move(posed_camera, scene):
    posed_camera.virtual_pinhole.driver_add("eye", 2).driver.expression = "2.0 + 3.0"
    scene.frame_set(1)
    posed_camera.location = (1, 2, 3)
    update()
    update()
    assert tuple(posed_camera.matrix_world.translation) == (1, 2, 5)
    assert differences(posed_camera, scene) == {}


def test_where_the_eye_follows_an_object_a_move_comes_back_and_a_turn_stays(posed_camera, scene, empty):
    target = empty("Target", (7, -6, 9))
    posed_camera.virtual_pinhole.eye_target = target
    update()
    posed_camera.location = (1, 2, 3)
    update()
    update()
    assert tuple(posed_camera.matrix_world.translation) == (7, -6, 9)
    look_at = tuple(posed_camera.virtual_pinhole.look_at)
    target.location.z = 11
    update()
    assert tuple(posed_camera.virtual_pinhole.look_at) == look_at, "the target's own move has turned the view"
    posed_camera.rotation_euler.z += 0.5
    update()
    assert tuple(posed_camera.virtual_pinhole.look_at) != look_at
    assert differences(posed_camera, scene) == {}


def test_the_values_follow_what_a_constraint_or_a_driver_sets(posed_camera, scene):
    constraint = posed_camera.constraints.new("LIMIT_LOCATION")
    constraint.use_min_x, constraint.min_x = True, 9
    update()
    assert tuple(posed_camera.virtual_pinhole.eye) == (9, -6, 5)
    posed_camera.data.driver_add("lens").driver.expression = "20.0 + 1.0"
    scene.frame_set(2)
    assert posed_camera.virtual_pinhole.distance == pytest.approx(21 * 1920 / 36)
    assert differences(posed_camera, scene) == {}


def test_where_the_eye_is_keyed_and_constrained_alike_the_values_stay_and_the_constraint_is_named(posed_camera, scene):
    posed_camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    constraint = posed_camera.constraints.new("LIMIT_LOCATION")
    constraint.use_min_x, constraint.min_x = True, 9
    update()
    assert tuple(posed_camera.virtual_pinhole.eye) == (7, -6, 5)
    (notice,) = panel.notices(posed_camera, scene)
    assert notice.sentence.startswith("The constraint 'Limit Location' moves 'Camera', the eye is 2 m away")


def test_a_roll_that_is_held_takes_a_turn_about_the_view(posed_camera, scene):
    posed_camera.virtual_pinhole.pole = "HOLD"
    posed_camera.rotation_mode = "QUATERNION"
    update()
    from mathutils import Quaternion

    posed_camera.rotation_quaternion = posed_camera.rotation_quaternion @ Quaternion((0, 0, 1), 0.3)
    update()
    group = posed_camera.virtual_pinhole
    assert tuple(group.up) == (0, 0, 1) and group.held_roll == pytest.approx(0.3, abs=1e-6)
    assert differences(posed_camera, scene) == {}


def test_an_edit_and_a_move_at_once_both_count(posed_camera, scene):
    update()
    posed_camera.location = (1, 2, 3)
    posed_camera.virtual_pinhole.distance = 800
    update()
    assert tuple(posed_camera.virtual_pinhole.eye) == (1, 2, 3) and posed_camera.virtual_pinhole.distance == 800
    assert differences(posed_camera, scene) == {}


def test_a_thousand_updates_of_nothing_change_no_bit(posed_camera, scene):
    posed_camera.rotation_euler = (1.1, 0.2, 0.7)
    posed_camera.data.lens = 41.3
    update()

    def bits():
        group = posed_camera.virtual_pinhole
        return group.exact, tuple(group.eye), tuple(group.look_at), group.distance, *map(tuple, posed_camera.matrix_world)

    before = bits()
    for _ in range(1000):
        posed_camera.update_tag()
        posed_camera.data.update_tag()
        update()
    assert bits() == before


@pytest.mark.parametrize("parented", [False, True])
@pytest.mark.parametrize("steps", [300, pytest.param(2000, marks=pytest.mark.exhaustive)])
def test_values_and_camera_agree_whoever_is_edited(posed_camera, scene, empty, steps, parented):
    """Random edits of values, transforms, lens, sensor, what carries the camera, frames, undo and redo, some before Blender
    evaluates. 4,600 in all. Nothing is deleted: Blender crashes as it undoes that here, the add-on or not."""
    random = np.random.default_rng(steps)
    if parented:
        posed_camera.parent = parent = empty("Parent", (1, 2, 3))
        parent.rotation_euler = (0.3, 0.2, 0.1)
    posed_camera.rotation_mode = "QUATERNION" if parented else "XYZ"
    empty("Mover")
    bpy.ops.ed.undo_push(message="start")

    def camera_():
        return bpy.data.objects["Camera"]

    def group():
        return camera_().virtual_pinhole

    def spin():
        name = "rotation_quaternion" if parented else "rotation_euler"
        setattr(camera_(), name, random.normal(0, 1, 4 if parented else 3))

    def mover():
        return bpy.data.objects["Mover"]

    def constrain():
        constraint = camera_().constraints.new("COPY_LOCATION")
        constraint.target = mover()

    edits = {
        "parent": lambda: setattr(camera_(), "parent", mover()),
        "no parent": lambda: setattr(camera_(), "parent", None),
        "constraint": constrain,
        "no constraints": lambda: camera_().constraints.clear(),
        "mover's location": lambda: setattr(mover(), "location", random.normal(0, 8, 3)),
        "eye": lambda: setattr(group(), "eye", random.normal(0, 8, 3)),
        "look-at": lambda: setattr(group(), "look_at", random.normal(0, 8, 3)),
        "up": lambda: setattr(group(), "up", random.normal(0, 1, 3)),
        "distance": lambda: setattr(group(), "distance", random.uniform(200, 5000)),
        "zoom": lambda: setattr(group(), "zoom", random.uniform(0.5, 2)),
        "roll": lambda: setattr(group(), "roll", random.uniform(-3, 3)),
        "location": lambda: setattr(camera_(), "location", random.normal(0, 8, 3)),
        "rotation": spin,
        "lens": lambda: setattr(camera_().data, "lens", random.uniform(10, 200)),
        "sensor": lambda: setattr(camera_().data, "sensor_width", random.uniform(8, 60)),
        "shift": lambda: setattr(camera_().data, "shift_x", random.uniform(-0.5, 0.5)),
        "frame": lambda: bpy.context.scene.frame_set(int(random.integers(1, 100))),
        "step of undo": lambda: bpy.ops.ed.undo_push(message="step"),
        "undo": lambda: bpy.ops.ed.undo(),
        "redo": lambda: bpy.ops.ed.redo(),
    }
    done = []
    for _ in range(steps):
        names = random.choice(sorted(edits), size=random.integers(1, 3))
        for name in names:
            done.append(name)
            try:
                edits[name]()
            except RuntimeError:  # nothing to undo
                done[-1] += " (none)"
        differing = differences(camera_(), bpy.context.scene)
        assert differing == {}, f"after {done[-6:]}: {differing}"
    assert {"undo", "redo"} <= set(done)


def test_auto_keying_keys_the_camera_that_is_moved_and_its_values_follow_those_keyframes(posed_camera, scene):
    """Blender keys what it moves, the camera's own location; without keyframes of their own the values are never in the way."""
    scene.tool_settings.use_keyframe_insert_auto = True
    for frame, x in ((1, 1.0), (11, 5.0)):
        scene.frame_set(frame)
        posed_camera.location = (x, -6, 5)
        update()
        posed_camera.keyframe_insert("location")  # as G does when it is confirmed
        update()
    scene.frame_set(1)
    assert posed_camera.virtual_pinhole.eye[0] == 1 and differences(posed_camera, scene) == {}
    assert not any(curve.data_path.startswith("virtual_pinhole") for curve in versions.action_curves(posed_camera))


def test_where_the_values_have_keyframes_those_win_over_what_auto_keying_keys_of_the_camera(posed_camera, scene):
    """And the panel names them, with a button."""
    posed_camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    scene.frame_set(5)
    posed_camera.location = (1, 2, 3)
    update()
    posed_camera.keyframe_insert("location")
    scene.frame_set(6)
    assert tuple(posed_camera.virtual_pinhole.eye) == (7, -6, 5) == tuple(posed_camera.matrix_world.translation)
    (notice,) = panel.notices(posed_camera, scene)
    assert notice.sentence.startswith("Keyframes set the location of 'Camera', and in a render they win")
    assert notice.remedy == ("viewcam.delete_keyframes", "Delete These Keyframes")
    assert bpy.ops.viewcam.delete_keyframes() == {"FINISHED"}
    update()
    assert panel.notices(posed_camera, scene) == [] and differences(posed_camera, scene) == {}
    assert [curve.data_path for curve in versions.action_curves(posed_camera)] == ["virtual_pinhole.eye"] * 3


@pytest.mark.parametrize("is_on", [True, False])
def test_auto_keying_keys_what_a_button_moves_where_it_has_keyframes(posed_camera, scene, is_on):
    group = posed_camera.virtual_pinhole
    group.keyframe_insert("eye", frame=1)
    scene.frame_set(5)
    scene.tool_settings.use_keyframe_insert_auto = is_on
    bpy.ops.viewcam.orbit_camera(around=0.5)
    there = tuple(group.eye)
    bpy.ops.viewcam.look_at_cursor()
    scene.frame_set(6)
    scene.frame_set(5)
    assert tuple(group.eye) == (there if is_on else (7, -6, 5))
    assert {curve.data_path for curve in versions.action_curves(posed_camera)} == {"virtual_pinhole.eye"}


def test_auto_keying_keys_the_cameras_own_channels_too_where_a_button_moves_them(posed_camera, scene):
    """They would win at the next frame."""
    posed_camera.keyframe_insert("location", frame=1)
    posed_camera.data.keyframe_insert("lens", frame=1)
    scene.frame_set(5)
    scene.tool_settings.use_keyframe_insert_auto = True
    drag = dragging.Drag(posed_camera, scene, dragging.DOLLY_ZOOM)
    drag.move(50, 0)
    drag.confirm()
    there = tuple(posed_camera.location), posed_camera.data.lens
    scene.frame_set(6)
    scene.frame_set(5)
    assert (tuple(posed_camera.location), posed_camera.data.lens) == there
    assert there[0] != (7, -6, 5) and differences(posed_camera, scene) == {}
