"""Parents of every kind above an enabled camera. docs/odd-blender.md says what each test expects (fixture `odd`)."""

import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Matrix

from viewcam_addon.blender import camera as cameras

TURNED = (0.3, 0.4, 0.5)


@pytest.fixture
def rig(add_rig):
    """An armature with one bone, Head, posed."""
    armature = add_rig(0.4)
    armature.location, armature.rotation_euler = (1, 2, 3), TURNED
    armature.pose.bones["Head"].location = (0.5, 0, 0)
    return armature


@pytest.fixture
def path():
    """A circle that carries what hangs on it along."""
    bpy.ops.curve.primitive_bezier_circle_add(radius=3, location=(1, 2, 3))
    curve = bpy.context.object
    curve.name = "Path"
    curve.data.use_path = curve.data.use_path_follow = True
    curve.data.eval_time = 30
    return curve


def apply_scale(block):
    """Object > Apply > Scale."""
    bpy.ops.object.select_all(action="DESELECT")
    block.select_set(True)
    bpy.context.view_layer.objects.active = block
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)


def set_again(camera_object, scene):
    return cameras.apply(camera_object, cameras.stated(camera_object, scene), scene)


def test_under_a_parent_that_is_moved_turned_and_scaled_the_pose_sticks(posed_camera, empty, odd):
    posed_camera.parent = empty("Dolly", (1, 2, 3), rotation_euler=TURNED, scale=(2, 2, 2))
    odd.check(posed_camera)


def test_under_a_parent_set_with_keep_transform_the_pose_sticks(posed_camera, empty, odd):
    parent = empty("Dolly", (1, 2, 3), rotation_euler=TURNED)
    posed_camera.parent, posed_camera.matrix_parent_inverse = parent, parent.matrix_world.inverted()
    parent.location = (4, 5, 6)
    odd.check(posed_camera)


def test_a_parent_that_moves_later_takes_the_camera_along(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Dolly")
    odd.check(posed_camera, then=lambda: setattr(parent, "location", (0, 0, 2)))


def test_under_a_mirrored_parent_the_pose_sticks_and_the_picture_stays_mirrored(posed_camera, empty, scene, odd):
    posed_camera.parent = empty("Mirror", scale=(-2, 2, 2))
    assert cameras.stated(posed_camera, scene).mirrored
    odd.check(posed_camera)


def test_under_a_turned_parent_that_is_scaled_non_uniformly_the_camera_is_oblique(posed_camera, empty, odd):
    posed_camera.parent = empty("Stretched", (1, 2, 3), rotation_euler=TURNED, scale=(1, 1, 3))
    odd.check(posed_camera)


def test_under_an_ancestor_that_is_scaled_non_uniformly_the_camera_is_oblique(posed_camera, empty, odd):
    ancestor = empty("Stretched", scale=(1, 1, 3))
    posed_camera.parent = empty("Dolly", (1, 2, 3), rotation_euler=TURNED)
    posed_camera.parent.parent = ancestor
    odd.check(posed_camera)


def test_applying_the_scale_of_the_parent_helps_as_the_sentence_says(posed_camera, empty, scene):
    posed_camera.parent = parent = empty("Stretched", (1, 2, 3), rotation_euler=TURNED, scale=(1, 1, 3))
    assert "apply the scale of 'Stretched'" in set_again(posed_camera, scene)[0]
    apply_scale(parent)
    assert set_again(posed_camera, scene) == []


def test_clearing_the_parent_inverse_helps_as_the_sentence_says(posed_camera, empty, scene):
    posed_camera.parent = empty("Dolly")
    posed_camera.matrix_parent_inverse = Matrix.Diagonal((1, 1, 3, 1))
    assert "clear the parent inverse" in set_again(posed_camera, scene)[0]
    posed_camera.matrix_parent_inverse = Matrix.Identity(4)
    assert set_again(posed_camera, scene) == []


def test_a_parents_stretching_along_the_cameras_own_axes_does_no_harm(posed_camera, empty, odd):
    group = posed_camera.virtual_pinhole
    group.eye, group.look_at, group.up = (0, 0, 5), (0, 0, 0), (0, 1, 0)
    posed_camera.parent = empty("Stretched", scale=(1, 1, 3))
    odd.check(posed_camera)


def test_under_a_parent_that_is_scaled_to_zero_there_is_no_camera(posed_camera, empty, odd):
    posed_camera.parent = empty("Flat", scale=(1, 0, 1))
    odd.check(posed_camera)


def test_under_a_parent_inverse_with_a_non_uniform_scale_the_camera_is_oblique(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Stretched", rotation_euler=TURNED, scale=(1, 1, 3))
    posed_camera.matrix_parent_inverse = parent.matrix_world.inverted()
    parent.rotation_euler, parent.scale = (0, 0, 0), (1, 1, 1)
    odd.check(posed_camera)


def test_on_a_bone_the_pose_sticks(posed_camera, rig, odd):
    posed_camera.parent, posed_camera.parent_type, posed_camera.parent_bone = rig, "BONE", "Head"
    odd.check(posed_camera)


def test_on_a_bone_that_is_scaled_non_uniformly_the_camera_is_oblique(posed_camera, rig, odd):
    posed_camera.parent, posed_camera.parent_type, posed_camera.parent_bone = rig, "BONE", "Head"
    rig.pose.bones["Head"].scale = (1, 1, 3)
    odd.check(posed_camera)


def test_on_an_animated_bone_the_camera_goes_along(posed_camera, rig, odd):
    posed_camera.parent, posed_camera.parent_type, posed_camera.parent_bone = rig, "BONE", "Head"
    bone = rig.pose.bones["Head"]
    for frame, x in ((1, 0.0), (5, 2.0)):
        bone.location.x = x
        bone.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


@pytest.mark.parametrize(("kind", "vertices"), [("VERTEX", (3, 0, 0)), ("VERTEX_3", (3, 50, 100))])
def test_on_one_vertex_or_three_the_pose_sticks(posed_camera, odd, kind, vertices):
    bpy.ops.mesh.primitive_monkey_add(location=(1, 2, 3), rotation=TURNED)
    posed_camera.parent, posed_camera.parent_type = bpy.context.object, kind
    posed_camera.parent_vertices = vertices
    odd.check(posed_camera)


def test_on_a_path_that_it_follows_the_pose_sticks(posed_camera, path, odd):
    posed_camera.parent = path
    odd.check(posed_camera)


def test_on_a_path_with_an_animated_time_the_camera_goes_along(posed_camera, path, odd):
    posed_camera.parent = path
    for frame, time in ((1, 0.0), (5, 50.0)):
        path.data.eval_time = time
        path.data.keyframe_insert("eval_time", frame=frame)
    bpy.context.scene.frame_set(1)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_under_a_parent_with_a_constraint_the_pose_sticks(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Dolly")
    parent.constraints.new("COPY_LOCATION").target = empty("Car", (3, 3, 3))
    odd.check(posed_camera)


def test_under_a_parent_whose_constraint_moves_it_later_the_camera_goes_along(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Dolly")
    parent.constraints.new("COPY_LOCATION").target = car = empty("Car", (3, 3, 3))
    odd.check(posed_camera, then=lambda: setattr(car, "location", (3, 3, 5)))


def animate(block):
    for frame, height in ((1, 0), (5, 2)):
        block.location.z = height
        block.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)


def test_under_an_animated_parent_the_camera_goes_along(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Dolly")
    animate(parent)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_under_a_parent_with_a_driver_the_camera_goes_along(posed_camera, empty, odd):
    posed_camera.parent = empty("Dolly")
    posed_camera.parent.driver_add("location", 2).driver.expression = "2.0 if frame > 4 else 0.0"
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_under_an_animated_parent_animated_values_win(posed_camera, empty, scene, odd, render_positions, picture_error):
    posed_camera.parent = parent = empty("Dolly", rotation_euler=TURNED)
    animate(parent)
    group = posed_camera.virtual_pinhole
    for frame, height in ((1, 5), (9, 9)):
        group.eye[2] = height
        group.keyframe_insert("eye", frame=frame)
    scene.frame_set(3)
    scene.frame_start = scene.frame_end = 5
    positions = render_positions(animation=True)[5]
    scene.frame_set(5)
    error, tolerance = picture_error(cameras.stated(posed_camera, scene), positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    odd.check(posed_camera)
