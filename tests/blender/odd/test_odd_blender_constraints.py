"""Constraints on an enabled camera. docs/odd-blender.md says what each test expects (fixture `odd`)."""

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras


@pytest.fixture
def constrain(posed_camera, empty):
    """A function that adds a constraint to the camera, by default with the empty Target at (5, 5, 5), turned."""

    def add(kind, target=True, **properties):
        constraint = posed_camera.constraints.new(kind)
        if target:
            constraint.target = bpy.data.objects.get("Target") or empty("Target", (5, 5, 5), rotation_euler=(0.3, 0.4, 0.5))
        for name, value in properties.items():
            setattr(constraint, name, value)
        bpy.context.view_layer.update()  # Child Of takes its inverse from where its target is now
        return constraint

    return add


@pytest.fixture
def path():
    """A circle that objects can follow."""
    bpy.ops.curve.primitive_bezier_circle_add(radius=3, location=(1, 2, 3))
    bpy.context.object.data.use_path = True
    return bpy.context.object


def test_track_to_turns_the_camera(posed_camera, constrain, odd):
    constrain("TRACK_TO")
    odd.check(posed_camera)


def test_damped_track_turns_the_camera(posed_camera, constrain, odd):
    constrain("DAMPED_TRACK", track_axis="TRACK_NEGATIVE_Z")
    odd.check(posed_camera)


def test_track_to_the_look_at_point_leaves_an_upright_camera_where_it_belongs(posed_camera, constrain, empty, odd):
    constrain("TRACK_TO", target=False, target_space="WORLD", track_axis="TRACK_NEGATIVE_Z", up_axis="UP_Y")
    posed_camera.constraints[0].target = empty("Look", (0, 0, 1))
    odd.check(posed_camera)


def test_locked_track_turns_the_camera(posed_camera, constrain, odd):
    constrain("LOCKED_TRACK")
    odd.check(posed_camera)


def test_copy_location_moves_the_camera(posed_camera, constrain, odd):
    constrain("COPY_LOCATION")
    odd.check(posed_camera)


def test_copy_location_with_offset_carries_the_camera_and_the_pose_sticks(posed_camera, constrain, odd):
    constrain("COPY_LOCATION", use_offset=True)
    odd.check(posed_camera)


def test_copy_rotation_turns_the_camera(posed_camera, constrain, odd):
    constrain("COPY_ROTATION")
    odd.check(posed_camera)


def test_copy_transforms_moves_and_turns_the_camera(posed_camera, constrain, odd):
    constrain("COPY_TRANSFORMS")
    odd.check(posed_camera)


def test_copy_scale_does_no_harm(posed_camera, constrain, odd):
    constrain("COPY_SCALE")
    bpy.data.objects["Target"].scale = (2, 3, 4)
    odd.check(posed_camera)


def test_child_of_carries_the_camera_and_the_pose_sticks(posed_camera, constrain, odd):
    constrain("CHILD_OF")
    bpy.data.objects["Target"].location = (2, 3, 4)
    odd.check(posed_camera)


def test_a_target_of_child_of_that_moves_later_takes_the_camera_along(posed_camera, constrain, odd):
    constrain("CHILD_OF")
    odd.check(posed_camera, then=lambda: setattr(bpy.data.objects["Target"], "location", (5, 5, 7)))


def test_child_of_a_target_that_is_scaled_non_uniformly_makes_the_camera_oblique(posed_camera, constrain, odd):
    constrain("CHILD_OF")
    bpy.data.objects["Target"].scale = (1, 1, 3)
    odd.check(posed_camera)


def test_child_of_with_half_its_influence_moves_the_camera(posed_camera, constrain, odd):
    constrain("CHILD_OF", influence=0.5)
    bpy.data.objects["Target"].location = (5, 5, 7)
    odd.check(posed_camera)


def test_child_of_under_a_parent_carries_the_camera_and_the_pose_sticks(posed_camera, constrain, empty, odd):
    constrain("CHILD_OF")
    bpy.data.objects["Target"].location = (2, 3, 4)
    posed_camera.parent = empty("Dolly", (1, 2, 3), rotation_euler=(0.5, 0.6, 0.7))
    odd.check(posed_camera)


def test_an_armature_constraint_carries_the_camera_and_the_pose_sticks(posed_camera, constrain, scene, odd):
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.data.edit_bones.new("Head")
    bone.head, bone.tail = (0, 0, 1), (0, 1, 2)
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.pose.bones["Head"].location = (1, 0, 0)
    target = constrain("ARMATURE", target=False).targets.new()
    target.target, target.subtarget = armature, "Head"
    odd.check(posed_camera)


def test_follow_path_carries_the_camera_and_the_pose_sticks(
    posed_camera, constrain, path, scene, odd, render_positions, picture_error
):
    constrain("FOLLOW_PATH", target=False, use_curve_follow=True, offset=20).target = path
    cameras.apply(posed_camera, cameras.stated(posed_camera, scene), scene)
    positions = render_positions()
    error, tolerance = picture_error(cameras.stated(posed_camera, scene), positions)
    assert error <= 2 * tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    odd.check(posed_camera)


def test_follow_path_along_a_scaled_curve_moves_the_camera(posed_camera, constrain, path, odd):
    path.scale = (2, 2, 2)
    constrain("FOLLOW_PATH", target=False, offset=20).target = path
    odd.check(posed_camera)


def test_what_carries_the_camera_is_told_exactly_though_it_stood_far_away(posed_camera, constrain, scene):
    constrain("CHILD_OF")
    bpy.data.objects["Target"].location = (2, 3, 4)
    group = posed_camera.virtual_pinhole
    for height in (1e6, 5):
        group.eye = (7, -6, height)
        assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene) == []


def test_follow_path_with_an_animated_offset_takes_the_camera_along(posed_camera, constrain, path, scene, odd):
    constraint = constrain("FOLLOW_PATH", target=False)
    constraint.target = path
    for frame, offset in ((1, 0), (5, 50)):
        constraint.offset = offset
        constraint.keyframe_insert("offset", frame=frame)
    scene.frame_set(1)
    odd.check(posed_camera, then=lambda: scene.frame_set(5))


def test_limit_location_that_the_eye_keeps_does_no_harm(posed_camera, constrain, odd):
    constrain("LIMIT_LOCATION", target=False, use_min_x=True, min_x=2)
    odd.check(posed_camera)


def test_limit_location_moves_the_camera(posed_camera, constrain, odd):
    constrain("LIMIT_LOCATION", target=False, use_min_x=True, min_x=9)
    odd.check(posed_camera)


def test_limit_location_in_local_space_under_a_parent_moves_the_camera(posed_camera, constrain, empty, odd):
    posed_camera.parent = empty("Dolly", (5, 0, 0))
    constrain("LIMIT_LOCATION", target=False, use_min_x=True, min_x=3, owner_space="LOCAL")
    odd.check(posed_camera)


def test_limit_rotation_turns_the_camera(posed_camera, constrain, odd):
    constrain("LIMIT_ROTATION", target=False, use_limit_x=True, max_x=0.1)
    odd.check(posed_camera)


def test_limit_scale_does_no_harm(posed_camera, constrain, odd):
    constrain("LIMIT_SCALE", target=False, use_max_x=True, max_x=0.5)
    odd.check(posed_camera)


def test_limit_distance_moves_the_camera(posed_camera, constrain, odd):
    constrain("LIMIT_DISTANCE", distance=3, limit_mode="LIMITDIST_INSIDE")
    odd.check(posed_camera)


def test_a_transformation_constraint_moves_the_camera(posed_camera, constrain, odd):
    constrain("TRANSFORM", from_max_x=10, to_max_x=4)
    odd.check(posed_camera)


def test_stretch_to_turns_the_camera(posed_camera, constrain, odd):
    constrain("STRETCH_TO")
    odd.check(posed_camera)


def test_a_muted_constraint_does_no_harm(posed_camera, constrain, odd):
    constrain("TRACK_TO", mute=True)
    odd.check(posed_camera)


def test_a_constraint_without_influence_does_no_harm(posed_camera, constrain, odd):
    constrain("COPY_TRANSFORMS", influence=0)
    odd.check(posed_camera)


def test_a_constraint_without_a_target_does_no_harm(posed_camera, constrain, odd):
    constrain("TRACK_TO", target=False)
    odd.check(posed_camera)


def test_of_two_constraints_the_guilty_one_is_named(posed_camera, constrain, odd):
    constrain("LIMIT_LOCATION", target=False, use_min_x=True, min_x=2)
    constrain("TRACK_TO")
    odd.check(posed_camera)


def test_animated_values_follow_a_moving_target_of_child_of(posed_camera, constrain, scene, odd):
    constrain("CHILD_OF")
    target, group = bpy.data.objects["Target"], posed_camera.virtual_pinhole
    for frame, height in ((1, 5), (9, 9)):
        target.location.z, group.eye[2] = height, height
        target.keyframe_insert("location", frame=frame)
        group.keyframe_insert("eye", frame=frame)
    scene.frame_set(1)
    odd.check(posed_camera)
