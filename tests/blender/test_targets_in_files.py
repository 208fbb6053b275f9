"""The fate of targets: loops, deletion, stating anew, copies, libraries, files, and Blender without the add-on."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks, findings, hold, targets
from viewcam_addon.blender.interface import panel
from viewcam_addon.pinhole import Pinhole


def update():
    bpy.context.view_layer.update()


def is_where_stated(camera_object, scene):
    return findings.differences(cameras.stated(camera_object, scene), cameras.read(camera_object, scene), reach=50) == {}


def hooks(camera_object):
    return [curve.array_index for curve in hold.versions.drivers(camera_object)]


@pytest.fixture
def target(empty):
    """An empty at (1, 2, 3)."""
    return empty("Target", (1, 2, 3))


@pytest.fixture
def watching_camera(posed_camera, target):
    """The posed camera, whose look-at point is the target."""
    posed_camera.virtual_pinhole.look_at_target = target
    return posed_camera


# Loops


def child_of_the_camera(target, camera_object, empty):
    target.parent = camera_object
    return "is moved by the camera itself"


def grandchild_of_the_camera(target, camera_object, empty):
    target.parent = empty("Between")
    target.parent.parent = camera_object
    return "is moved by 'Between', by the camera itself"


def constrained_to_the_camera(target, camera_object, empty):
    target.constraints.new("COPY_LOCATION").target = camera_object
    return "is moved by the camera itself"


def driven_by_the_camera(target, camera_object, empty):
    driver = target.driver_add("location", 0).driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = camera_object, "location.y"
    return "is moved by the camera itself"


LOOPS = [child_of_the_camera, grandchild_of_the_camera, constrained_to_the_camera, driven_by_the_camera]


@pytest.mark.parametrize("point", ["eye", "look_at"])
@pytest.mark.parametrize("tie", LOOPS)
def test_a_target_that_the_camera_moves_is_not_followed_and_the_panel_says_why(
    posed_camera, scene, target, empty, tie, point, capfd
):
    sentence = tie(target, posed_camera, empty)
    before = posed_camera.virtual_pinhole.numbers()
    setattr(posed_camera.virtual_pinhole, f"{point}_target", target)
    for frame in range(1, 6):
        scene.frame_set(frame)
        posed_camera.update_tag()
        update()
    assert posed_camera.virtual_pinhole.numbers() == before
    assert is_where_stated(posed_camera, scene)
    (warning,) = targets.warnings(posed_camera)
    words = point.replace("_", "-")
    assert warning == f"The {words} target 'Target' {sentence}, and is not followed: choose another, or clear it"
    assert capfd.readouterr().err == ""


def test_a_loop_that_is_made_later_stops_the_following_and_one_that_is_undone_takes_it_up_again(watching_camera, target):
    target.parent = watching_camera
    for _ in range(3):
        watching_camera.update_tag()
        update()
    assert watching_camera.virtual_pinhole.numbers()[1] == (1, 2, 3)
    assert targets.warnings(watching_camera)
    target.parent = None
    target.location.x = 5
    update()
    assert watching_camera.virtual_pinhole.numbers()[1] == (5, 2, 3)
    assert targets.warnings(watching_camera) == []


@pytest.mark.parametrize("point", ["eye", "look_at"])
def test_the_camera_itself_is_no_target(posed_camera, scene, point):
    group = posed_camera.virtual_pinhole
    assert not targets.can_be_target(posed_camera, posed_camera)
    setattr(group, f"{point}_target", posed_camera)
    update()
    assert is_where_stated(posed_camera, scene)
    assert "is the camera itself, and is not followed" in targets.warnings(posed_camera)[0]


def test_the_list_to_choose_from_leaves_out_what_the_camera_moves(posed_camera, target, empty):
    target.parent = posed_camera
    assert not targets.can_be_target(posed_camera, target)
    assert targets.can_be_target(posed_camera, empty("Other"))


def test_two_cameras_may_look_at_each_other(watching_camera, scene, target, add_camera):
    other = add_camera("Other")
    other.virtual_pinhole.eye, other.virtual_pinhole.enabled = (0, 9, 2), True
    other.virtual_pinhole.look_at_target = watching_camera
    watching_camera.virtual_pinhole.look_at_target = other
    watching_camera.virtual_pinhole.eye = (4, 4, 4)
    update()
    assert other.virtual_pinhole.numbers()[1] == (4, 4, 4)
    assert watching_camera.virtual_pinhole.numbers()[1] == (0, 9, 2)
    assert is_where_stated(watching_camera, scene) and is_where_stated(other, scene)
    assert targets.warnings(watching_camera) == targets.warnings(other) == []


def test_a_camera_that_flies_is_followed_without_a_frame_of_delay(watching_camera, scene, add_camera):
    flying = add_camera("Flying")
    group = flying.virtual_pinhole
    group.enabled = True
    for frame in (1, 11):
        group.eye = (frame, 9, 2)
        group.keyframe_insert("eye", frame=frame)
    watching_camera.virtual_pinhole.look_at_target = flying
    for frame in (11, 1, 6):
        scene.frame_set(frame)
        assert watching_camera.virtual_pinhole.numbers()[1] == pytest.approx((frame, 9, 2), rel=1e-6)
        assert is_where_stated(watching_camera, scene)


def test_what_hangs_on_a_flying_camera_comes_a_step_late_and_the_panel_says_so(watching_camera, target, add_camera):
    flying = add_camera("Flying")
    flying.virtual_pinhole.enabled = True
    flying.virtual_pinhole.keyframe_insert("eye", frame=1)
    target.parent = flying
    (sentence,) = targets.warnings(watching_camera)
    assert sentence.startswith("The look-at target 'Target' is moved by 'Flying', whose own values are animated")


# Deletion


def removed(target):
    bpy.data.objects.remove(target)


def deleted(target):
    target.select_set(True)
    bpy.ops.object.delete()


@pytest.mark.parametrize("point", ["eye", "look_at"])
def test_a_target_that_is_removed_leaves_the_camera_where_it_was(posed_camera, scene, target, point, capfd):
    setattr(posed_camera.virtual_pinhole, f"{point}_target", target)
    target.location.x = 4
    update()
    before = posed_camera.matrix_world.copy(), posed_camera.virtual_pinhole.numbers()
    removed(target)
    update()
    scene.frame_set(3)
    assert (posed_camera.matrix_world, posed_camera.virtual_pinhole.numbers()) == before
    assert hooks(posed_camera) == [] and not datablocks.is_animated(posed_camera)
    assert targets.warnings(posed_camera) == []
    assert capfd.readouterr().err == ""


def test_a_target_that_is_deleted_in_the_window_leaves_the_camera_where_it_was_and_the_panel_says_so(
    watching_camera, scene, target
):
    update()
    before = watching_camera.matrix_world.copy()
    deleted(target)
    update()
    scene.frame_set(3)
    assert watching_camera.matrix_world == before
    (sentence,) = targets.warnings(watching_camera)
    assert sentence == "The look-at target 'Target' is in no scene, deleted perhaps: clear it, or choose another"
    watching_camera.virtual_pinhole.look_at_target = None
    assert watching_camera.matrix_world == before and targets.warnings(watching_camera) == []


def test_a_target_without_a_place_leaves_the_camera_where_it_was_and_says_so(watching_camera, scene, target):
    update()
    before = watching_camera.matrix_world.copy()
    target.location.x = float("nan")
    update()
    assert watching_camera.matrix_world == before
    assert "Look_at is (nan, 2.0, 3.0)" in panel.notices(watching_camera, scene)[0].sentence


# Stating


def test_a_target_stays_where_the_point_is_stated_to_be_and_is_cleared_elsewhere(watching_camera, scene, target):
    group = watching_camera.virtual_pinhole
    where = cameras.stated(watching_camera, scene)
    assert cameras.apply(watching_camera, where, scene) == []
    assert group.look_at_target == target
    moved = Pinhole(where.eye, (0.5, 0, 0), where.up, where.distance, 1920, 1080)
    assert cameras.apply(watching_camera, moved, scene) == ["The look-at no longer follows 'Target'"]
    assert group.look_at_target is None and hooks(watching_camera) == []
    target.location.x = 7
    update()
    assert group.numbers()[1] == (0.5, 0, 0) and is_where_stated(watching_camera, scene)


def test_dolly_and_orbit_keep_the_target_and_looking_elsewhere_leaves_it(watching_camera, scene, target):
    group = watching_camera.virtual_pinhole
    bpy.ops.viewcam.dolly_camera(reach=4)
    bpy.ops.viewcam.orbit_camera()
    bpy.ops.viewcam.level_camera()
    assert group.look_at_target == target
    bpy.ops.viewcam.look_at_cursor()
    assert group.look_at_target is None and group.numbers()[1] == (0, 0, 0)


def test_adopting_a_camera_that_stands_as_its_targets_say_keeps_them(watching_camera, scene, target, empty):
    group = watching_camera.virtual_pinhole
    group.eye_target = empty("Eye", (4, -3, 2.7))
    update()
    cameras.adopt(watching_camera, scene)
    assert (group.look_at_target, group.eye_target.name) == (target, "Eye")
    assert group.numbers()[1] == (1, 2, 3) and is_where_stated(watching_camera, scene)


def test_adopting_a_camera_that_was_moved_lets_go_of_its_target(watching_camera, scene):
    group = watching_camera.virtual_pinhole
    group.enabled = False
    watching_camera.rotation_euler.x += 0.01
    update()
    cameras.adopt(watching_camera, scene)
    assert group.look_at_target is None and is_where_stated(watching_camera, scene)


def test_enabling_with_a_target_set_looks_at_it(camera_object, scene, target):
    group = camera_object.virtual_pinhole
    camera_object.location = (0, -9, 2)
    update()
    group.look_at_target = target
    group.enabled = True
    assert group.numbers()[:2] == ((0, -9, 2), (1, 2, 3))
    assert is_where_stated(camera_object, scene)


def test_the_roll_is_not_held_with_a_target_and_the_panel_says_so(watching_camera):
    watching_camera.virtual_pinhole.pole = "HOLD"
    assert hold.obstacle(watching_camera) == (
        "The look-at follows 'Target', whose place at other frames can't be known, so that the roll is not held: "
        "clear the target, or choose Canonical Axes"
    )
    watching_camera.virtual_pinhole.look_at_target = None
    assert hold.obstacle(watching_camera) is None


# Undo, copies, files, libraries


def test_undo_and_redo_bring_target_and_camera_together(watching_camera, target):
    def state():
        item = bpy.data.objects["Camera"]
        update()
        return [tuple(row) for row in item.matrix_world], item.virtual_pinhole.numbers(), hooks(item)

    bpy.ops.ed.undo_push(message="watching")
    before = state()
    target.location = (4, 5, 6)
    update()
    bpy.ops.ed.undo_push(message="moved")
    after = state()
    bpy.data.objects["Camera"].virtual_pinhole.look_at_target = None
    bpy.ops.ed.undo_push(message="cleared")
    bpy.ops.ed.undo()
    assert state() == after
    bpy.ops.ed.undo()
    assert state() == before
    bpy.ops.ed.redo()
    assert state() == after


def test_a_copy_follows_the_target_and_copies_of_both_follow_each_other(watching_camera, scene, target):
    for item in (watching_camera, target):
        item.select_set(True)
    bpy.ops.object.duplicate()
    twin, double = bpy.data.objects["Camera.001"], bpy.data.objects["Target.001"]
    assert twin.virtual_pinhole.look_at_target == double
    double.location.x = 8
    update()
    assert twin.virtual_pinhole.numbers()[1] == (8, 2, 3) and is_where_stated(twin, scene)
    assert watching_camera.virtual_pinhole.numbers()[1] == (1, 2, 3)


def test_renaming_the_target_changes_nothing(watching_camera, scene, target):
    target.name = "Renamed"
    target.location.x = 8
    update()
    assert watching_camera.virtual_pinhole.numbers()[1] == (8, 2, 3)


@pytest.fixture
def saved(watching_camera, tmp_path):
    """The path of a file with the watching camera and its target."""
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    return path


def test_without_the_add_on_the_camera_stays_and_with_it_follows_again(saved):
    viewcam_addon.unregister()
    try:
        bpy.ops.wm.open_mainfile(filepath=saved)
        before = bpy.data.objects["Camera"].matrix_world.copy()
        bpy.data.objects["Target"].location.x = 9
        bpy.context.scene.frame_set(2)
        assert bpy.data.objects["Camera"].matrix_world == before
        bpy.ops.wm.save_as_mainfile(filepath=saved)
    finally:
        viewcam_addon.register()
    bpy.ops.wm.open_mainfile(filepath=saved)
    camera_object, scene = bpy.data.objects["Camera"], bpy.context.scene
    scene.frame_set(1)
    assert camera_object.virtual_pinhole.numbers()[1] == (9, 2, 3) and is_where_stated(camera_object, scene)


def linked(path, name="Camera"):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(path, link=True) as (_, names):
        names.objects = [name]
    camera_object = bpy.data.objects[name]
    bpy.context.scene.collection.objects.link(camera_object)
    update()
    return camera_object


def test_a_linked_camera_follows_the_target_of_its_library(saved):
    camera_object = linked(saved)
    camera_object.virtual_pinhole.look_at_target.location.x = 8
    update()
    assert camera_object.virtual_pinhole.numbers()[1] == (8, 2, 3)
    assert is_where_stated(camera_object, bpy.context.scene)


def test_an_overridden_camera_follows_a_target_of_its_own_in_the_next_session_too(saved, tmp_path):
    override = linked(saved).override_create(remap_local_usages=True)
    override.data.override_create(remap_local_usages=True)
    own = bpy.data.objects.new("Own", None)
    bpy.context.scene.collection.objects.link(own)
    own.location = (5, 5, 5)
    override.virtual_pinhole.look_at_target = own
    shot = str(tmp_path / "shot.blend")
    bpy.ops.wm.save_as_mainfile(filepath=shot)
    bpy.ops.wm.open_mainfile(filepath=shot)
    camera_object = next(item for item in bpy.data.objects if item.override_library)
    bpy.data.objects["Own"].location.x = 8
    update()
    assert camera_object.virtual_pinhole.numbers()[1] == (8, 5, 5)
    assert is_where_stated(camera_object, bpy.context.scene)
    np.testing.assert_array_equal(camera_object.virtual_pinhole.look_at, (8, 5, 5))
