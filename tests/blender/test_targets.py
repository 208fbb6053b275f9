"""Eye and look-at as objects: followed as they are moved, over frames and in renders, wherever Blender hides them.

And their fate: loops, deletion, stating anew, copies, libraries, files, and Blender without the add-on.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon import roll as rolls
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks, findings, hold, targets, versions
from viewcam_addon.blender.interface import panel
from viewcam_addon.pinhole import Pinhole

POINTS = ("eye", "look_at")


def update():
    bpy.context.view_layer.update()


def is_where_stated(camera_object, scene):
    return findings.differences(cameras.stated(camera_object, scene), cameras.read(camera_object, scene), reach=50) == {}


def follow(camera_object, point, target):
    setattr(camera_object.virtual_pinhole, f"{point}_target", target)


def number_of(camera_object, point):
    return camera_object.virtual_pinhole.numbers()[POINTS.index(point)]


@pytest.fixture
def target(empty):
    """An empty at (1, 2, 3)."""
    return empty("Target", (1, 2, 3))


@pytest.fixture
def watching_camera(posed_camera, target):
    """The posed camera, whose look-at point is the target."""
    follow(posed_camera, "look_at", target)
    return posed_camera


@pytest.fixture
def moving_target(target, empty):
    """The target on a parent that goes from x = 0 at frame 1 to x = 10 at frame 11, at a constant speed."""
    carrier = empty("Carrier")
    target.parent = carrier
    driver = carrier.driver_add("location", 0).driver
    driver.expression = "frame - 1.0"
    return target


@pytest.mark.parametrize("point", POINTS)
def test_setting_a_target_moves_the_camera_at_once(posed_camera, scene, target, point):
    follow(posed_camera, point, target)
    assert number_of(posed_camera, point) == (1, 2, 3)
    assert is_where_stated(posed_camera, scene)


@pytest.mark.parametrize("point", POINTS)
def test_a_target_moved_by_hand_is_followed(posed_camera, scene, target, point):
    follow(posed_camera, point, target)
    for x in (4, 5.25):
        target.location.x = x
        update()
        assert number_of(posed_camera, point) == (x, 2, 3)
        assert is_where_stated(posed_camera, scene)
    assert (posed_camera.matrix_world.translation.x == 5.25) == (point == "eye")


def carried_by_a_parent(target, empty):
    carrier = empty("Carrier")
    target.parent, target.parent_type = carrier, "OBJECT"
    return carrier


def held_by_a_constraint(target, empty):
    carrier = empty("Carrier")
    target.constraints.new("CHILD_OF").target = carrier
    return carrier


def set_by_a_driver(target, empty):
    carrier = empty("Carrier")
    driver = target.driver_add("location", 0).driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = carrier, "location.x"
    return carrier


@pytest.mark.parametrize("carry", [carried_by_a_parent, held_by_a_constraint, set_by_a_driver])
def test_a_target_is_followed_through_what_moves_it(watching_camera, scene, target, empty, carry):
    carrier = carry(target, empty)
    update()
    before = number_of(watching_camera, "look_at")
    carrier.location.x = before[0] + 8
    update()
    assert number_of(watching_camera, "look_at") != before
    assert number_of(watching_camera, "look_at") == tuple(target.matrix_world.translation)
    assert is_where_stated(watching_camera, scene)


def test_a_target_is_followed_over_frames_and_between_them(watching_camera, scene, moving_target):
    for frame in (1, 6, 6.5, 3.25):
        scene.frame_set(math.floor(frame), subframe=frame % 1.0)
        assert number_of(watching_camera, "look_at") == pytest.approx((frame, 2, 3), rel=1e-6)
        assert is_where_stated(watching_camera, scene)


def test_the_stored_point_goes_along_so_that_clearing_leaves_the_camera(watching_camera, scene, moving_target):
    scene.frame_set(6)
    group, before = watching_camera.virtual_pinhole, watching_camera.matrix_world.copy()
    assert tuple(group.look_at) == number_of(watching_camera, "look_at") == (6, 2, 3)
    group.look_at_target = None
    update()
    assert watching_camera.matrix_world == before
    assert not datablocks.is_animated(watching_camera)
    moving_target.parent.driver_remove("location")
    scene.frame_set(1)
    assert watching_camera.matrix_world == before


def test_the_precision_of_a_followed_point_is_that_of_float32(camera_object, scene, target):
    cameras.apply(camera_object, Pinhole((7, -6, 5), (1, 2, 3), (0, 0, 1), 1500.0, 1920, 1080), scene)
    assert camera_object.virtual_pinhole.precision() == 2.0**-53
    follow(camera_object, "look_at", target)
    assert camera_object.virtual_pinhole.precision() == 2.0**-24


@settings(max_examples=30)
@given(st.lists(st.floats(-1e6, 1e6, width=32), min_size=3, max_size=3))
def test_the_eye_is_where_its_target_is_to_the_last_bit(location):
    scene = bpy.context.scene
    camera_object = bpy.data.objects.get("Follower") or bpy.data.objects.new("Follower", bpy.data.cameras.new("Follower"))
    target = bpy.data.objects.get("Place") or bpy.data.objects.new("Place", None)
    for block in (camera_object, target):
        if block.name not in scene.collection.objects:
            scene.collection.objects.link(block)
    group = camera_object.virtual_pinhole
    group.enabled, group.look_at, group.eye_target = True, (0, 0, 2e6), target
    target.location = location
    update()
    assert tuple(camera_object.matrix_world.translation) == tuple(target.matrix_world.translation) == group.numbers()[0]


# The ways in which Blender leaves an object out of the viewport, of the render, or of both.
def hidden_in_viewports(target):
    target.hide_viewport = target.parent.hide_viewport = True


def hidden_by_the_eye(target):
    target.hide_set(True)
    target.parent.hide_set(True)


def hidden_in_renders(target):
    target.hide_render = target.parent.hide_render = True


def move_to(collection, target):
    for block in (target, target.parent):
        bpy.context.scene.collection.objects.unlink(block)
        collection.objects.link(block)


def excluded(target):
    collection = bpy.data.collections.new("Excluded")
    bpy.context.scene.collection.children.link(collection)
    move_to(collection, target)
    update()
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True


def in_another_scene(target):
    move_to(bpy.data.scenes.new("Other").collection, target)


def in_no_scene(target):
    for block in (target, target.parent):
        bpy.context.scene.collection.objects.unlink(block)


LEFT_OUT = [hidden_in_viewports, hidden_by_the_eye, hidden_in_renders, excluded, in_another_scene, in_no_scene]


@pytest.mark.parametrize("leave_out", LEFT_OUT)
def test_a_target_that_blender_leaves_out_is_followed_all_the_same(watching_camera, scene, moving_target, leave_out):
    leave_out(moving_target)
    scene.frame_set(6)
    assert number_of(watching_camera, "look_at") == (6, 2, 3)
    assert is_where_stated(watching_camera, scene)
    moving_target.location.z = 9
    update()
    assert number_of(watching_camera, "look_at") == (6, 2, 9)
    assert is_where_stated(watching_camera, scene)


@pytest.mark.parametrize("leave_out", LEFT_OUT)
def test_a_keyed_roll_about_a_target_that_blender_leaves_out_is_right_at_every_frame(
    watching_camera, scene, moving_target, leave_out, capfd
):
    """Blender asks for the roll as it evaluates, and to evaluate the target for that began it anew until the stack was full."""
    group = watching_camera.virtual_pinhole
    for frame, roll in ((1, 0.1), (11, 0.6)):
        group.roll = roll
        group.keyframe_insert("roll", frame=frame)
    leave_out(moving_target)
    update()
    for frame in (6, 11, 1, 8):
        scene.frame_set(frame)
        curve = next(each for each in versions.animation_curves(watching_camera) if each.data_path == "virtual_pinhole.roll")
        assert group.roll == pytest.approx(curve.evaluate(frame), abs=1e-6)
        there = rolls.angle_from((0, 0, 1), cameras.read(watching_camera, scene))
        assert there == pytest.approx(curve.evaluate(frame), abs=1e-5), f"frame {frame}"
    assert capfd.readouterr().err == ""


def test_a_keyed_roll_about_a_target_is_told_in_a_scene_that_was_never_evaluated(watching_camera, tmp_path):
    watching_camera.virtual_pinhole.roll = 0.25
    watching_camera.virtual_pinhole.keyframe_insert("roll", frame=1)
    bpy.context.window.scene = bpy.data.scenes.new("Other")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "other.blend"))
    camera_object = bpy.data.objects["Camera"]
    assert datablocks.scene_of(camera_object).view_layers[0].depsgraph is None, "else the test proves nothing"
    assert camera_object.virtual_pinhole.roll == pytest.approx(0.25, abs=1e-6)


@pytest.mark.parametrize("leave_out", [lambda target: None, *LEFT_OUT])
def test_a_render_sees_the_target_where_it_is_at_each_frame(
    watching_camera, scene, moving_target, render_positions, picture_error, leave_out
):
    """The originals stand at frame 11 all the time."""
    leave_out(moving_target)
    expected = {}
    for frame in (6, 11):
        scene.frame_set(frame)
        expected[frame] = cameras.stated(watching_camera, scene)
    scene.frame_start, scene.frame_end, scene.frame_step = 6, 11, 5
    for frame, positions in render_positions(animation=True).items():
        error, tolerance = picture_error(expected[frame], positions)
        assert error <= tolerance, f"frame {frame}: {error:.1e} px, and {tolerance:.1e} are rounding"
    error, tolerance = picture_error(expected[6], positions)
    assert error > 100 * tolerance, "a target that stood still would not have been noticed"


def test_a_still_by_f12_sees_a_target_that_only_its_own_graph_moves(
    watching_camera, scene, moving_target, render_positions, picture_error
):
    scene.frame_set(6)
    expected = cameras.stated(watching_camera, scene)
    error, tolerance = picture_error(expected, render_positions())
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"


def test_motion_blur_sees_the_target_at_its_sub_frames(watching_camera, scene, moving_target, render_positions):
    seen = {}

    def look(scene, depsgraph):
        if depsgraph.mode == "RENDER":
            seen[scene.frame_current_final] = cameras.stated(watching_camera.evaluated_get(depsgraph), scene).look_at[0]

    scene.render.use_motion_blur = True
    scene.frame_start = scene.frame_end = 6
    bpy.app.handlers.frame_change_post.append(look)
    try:
        render_positions(animation=True)
    finally:
        bpy.app.handlers.frame_change_post.remove(look)
    assert {5.75, 6.0, 6.25} <= set(seen), f"the render looked at {sorted(seen)}"
    assert seen == pytest.approx({frame: frame for frame in seen}, rel=1e-6)


def test_a_render_leaves_the_stored_point_as_the_viewport_has_it(watching_camera, scene, moving_target, render_positions):
    scene.frame_set(1)
    before = tuple(watching_camera.virtual_pinhole.look_at), watching_camera.matrix_world.copy()
    scene.frame_start = scene.frame_end = 6
    render_positions(animation=True)
    update()
    assert (tuple(watching_camera.virtual_pinhole.look_at), watching_camera.matrix_world) == before


def test_the_camera_of_another_scene_is_followed_in_a_render(
    watching_camera, scene, moving_target, render_positions, picture_error
):
    """It is the camera of a scene that it does not belong to."""
    scene.frame_set(6)
    expected = cameras.stated(watching_camera, scene)
    other = bpy.data.scenes.new("Other")
    scene.collection.objects.unlink(watching_camera)
    other.collection.objects.link(watching_camera)
    scene.frame_set(1)
    scene.frame_start = scene.frame_end = 6
    error, tolerance = picture_error(expected, render_positions(animation=True)[6])
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"


def test_what_cycles_is_compared_with_follows_the_target(watching_camera, scene, moving_target, both_sides):
    hidden_in_renders(moving_target)
    bpy.ops.mesh.primitive_monkey_add(size=6, location=(6, 2, 3))
    comparison = both_sides(frame=6)
    assert comparison.exported.stated_camera.look_at == (6, 2, 3)
    comparison.check()
    assert targets.target_of(watching_camera, "look_at") == moving_target


def test_a_comparison_in_another_size_keeps_the_target(watching_camera, scene, target):
    from viewcam_addon.blender.jobs import renderer as jobs
    from viewcam_addon.jobs.job import Job

    jobs.export(Job(width=64, height=48))
    assert watching_camera.virtual_pinhole.look_at_target == target
    target.location.x = 3
    update()
    assert number_of(watching_camera, "look_at") == (3, 2, 3)


@pytest.fixture
def rig(scene):
    """An armature at (0, 0, 2) with the bones Hip, from its origin up, and Head on it, whose head is 1 above."""
    layer, armature = bpy.context.view_layer, bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    scene.collection.objects.link(armature)
    armature.location = (0, 0, 2)
    layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    hip, head = (armature.data.edit_bones.new(name) for name in ("Hip", "Head"))
    hip.head, hip.tail = (0, 0, 0), (0, 0, 1)
    head.head, head.tail, head.parent = (0, 0, 1), (0, 0, 1.5), hip
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("is_hidden", [False, True])
def test_a_bone_is_followed_as_it_is_posed_hidden_or_not(posed_camera, scene, rig, point, is_hidden):
    follow(posed_camera, point, rig)
    assert number_of(posed_camera, point) == (0, 0, 2)
    setattr(posed_camera.virtual_pinhole, f"{point}_bone", "Head")
    update()
    assert number_of(posed_camera, point) == pytest.approx((0, 0, 3), abs=1e-6)
    rig.hide_viewport = is_hidden
    update()
    rig.pose.bones["Hip"].rotation_mode = "XYZ"
    rig.pose.bones["Hip"].rotation_euler = (0, 0, 0)
    rig.pose.bones["Hip"].location = (0.5, 0, 0)
    update()
    assert number_of(posed_camera, point) == pytest.approx((0.5, 0, 3), abs=1e-6)
    assert is_where_stated(posed_camera, scene)


def test_a_keyed_bone_is_followed_in_the_render(posed_camera, scene, rig):
    from viewcam_addon.blender.scenes import depsgraph

    follow(posed_camera, "look_at", rig)
    posed_camera.virtual_pinhole.look_at_bone = "Head"
    for frame, x in ((1, 0.0), (11, 2.0)):
        rig.pose.bones["Hip"].location = (x, 0, 0)
        rig.pose.bones["Hip"].keyframe_insert("location", frame=frame)
    for frame, x in ((11, 2.0), (1, 0.0)):
        scene.frame_set(frame)
        pinhole = depsgraph.visit(scene, lambda graph: cameras.read(posed_camera.evaluated_get(graph), scene))
        assert -np.array(pinhole.basis()[2]) == pytest.approx(_unit(np.subtract((x, 0, 3), (7, -6, 5))), abs=1e-6)


def _unit(vector):
    return vector / np.linalg.norm(vector)


def test_a_bone_that_is_not_there_is_named_and_the_origin_followed(posed_camera, rig):
    follow(posed_camera, "look_at", rig)
    posed_camera.virtual_pinhole.look_at_bone = "Tail"
    update()
    assert number_of(posed_camera, "look_at") == (0, 0, 2)
    (sentence,) = targets.warnings(posed_camera)
    assert sentence == "The look-at target 'Rig' has no bone 'Tail', and its origin is followed: choose another, or clear it"
    posed_camera.virtual_pinhole.look_at_bone = ""
    assert targets.warnings(posed_camera) == []


def test_a_bone_that_hangs_on_the_camera_is_not_followed(posed_camera, rig):
    rig.pose.bones["Head"].constraints.new("COPY_LOCATION").target = posed_camera
    assert not targets.can_be_target(posed_camera, rig)


def test_letting_go_of_an_armature_forgets_the_bone_and_leaves_the_camera(posed_camera, scene, rig):
    follow(posed_camera, "look_at", rig)
    posed_camera.virtual_pinhole.look_at_bone = "Head"
    update()
    before = number_of(posed_camera, "look_at")
    targets.release(posed_camera, "look_at")
    assert number_of(posed_camera, "look_at") == before and posed_camera.virtual_pinhole.look_at_bone == ""


@pytest.fixture
def patch(scene):
    """A grid at (1, 2, 3), turned, whose group Some weighs five of its vertices, and one by nothing."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4, location=(1, 2, 3), rotation=(0.3, 0.2, 0.1))
    block = bpy.context.object
    block.vertex_groups.new(name="Other").add(range(20), 1.0, "REPLACE")
    group = block.vertex_groups.new(name="Some")
    for index, weight in ((0, 1.0), (3, 0.25), (7, 0.5), (12, 0.125), (16, 0.75), (18, 0.0)):
        group.add([index], weight, "REPLACE")
    bpy.context.view_layer.objects.active = None
    return block


@pytest.fixture
def where_blender_has_it(scene, empty, patch):
    """() → the place of an empty that has Blender's own Copy Location of the group: the judge."""
    judge = empty("Judge")
    constraint = judge.constraints.new("COPY_LOCATION")
    constraint.target, constraint.subtarget = patch, "Some"

    def place():
        update()
        return tuple(judge.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation)

    return place


def deformed_by_a_key(patch, empty):
    patch.shape_key_add(name="Basis")
    key = patch.shape_key_add(name="Bent")
    for i, point in enumerate(key.data):
        point.co.z += 0.1 * i
    return lambda share: setattr(key, "value", share)


def deformed_by_a_hook(patch, empty):
    hook, modifier = empty("Hook"), patch.modifiers.new("Hook", "HOOK")
    modifier.object = hook
    modifier.vertex_indices_set([0, 3, 7])
    return lambda share: setattr(hook, "location", (share, 2 * share, 0))


def deformed_and_made_finer(patch, empty):
    modifier = patch.modifiers.new("Wave", "WAVE")
    patch.modifiers.new("Finer", "SUBSURF")
    return lambda share: setattr(modifier, "height", share)


def moved_with_its_vertices(patch, empty):
    return lambda share: (patch.data.vertices[7].co.__setitem__(2, share), patch.data.update())


def weighed_otherwise(patch, empty):
    return lambda share: patch.vertex_groups["Some"].add([18], share, "REPLACE")


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("is_hidden", [False, True])
@pytest.mark.parametrize(
    "deform", [deformed_by_a_key, deformed_by_a_hook, deformed_and_made_finer, moved_with_its_vertices, weighed_otherwise]
)
def test_a_vertex_group_is_followed_where_blenders_own_constraints_have_it(
    posed_camera, scene, patch, empty, where_blender_has_it, point, is_hidden, deform
):
    follow(posed_camera, point, patch)
    assert number_of(posed_camera, point) == pytest.approx((1, 2, 3), abs=1e-6)
    setattr(posed_camera.virtual_pinhole, f"{point}_group", "Some")
    numbers = [number_of(posed_camera, point)]
    assert numbers[0] == pytest.approx(where_blender_has_it(), abs=1e-6)
    assert math.dist(numbers[0], (1, 2, 3)) > 0.1
    change = deform(patch, empty)
    patch.hide_viewport = is_hidden
    for share in (0.25, 1.0):
        change(share)
        update()
        numbers.append(number_of(posed_camera, point))
        assert numbers[-1] == pytest.approx(where_blender_has_it(), abs=1e-6)  # sums of few numbers below 8, in float32 there
        assert math.dist(*numbers[-2:]) > 1e-3, "the group has not moved, and nothing is tried"
        assert is_where_stated(posed_camera, scene)
    patch.location.x = 4
    update()
    assert number_of(posed_camera, point) == pytest.approx(where_blender_has_it(), abs=2e-6)


def test_a_vertex_group_is_followed_as_it_is_edited(posed_camera, patch, where_blender_has_it):
    import bmesh

    follow(posed_camera, "look_at", patch)
    posed_camera.virtual_pinhole.look_at_group = "Some"
    bpy.context.view_layer.objects.active = patch
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        edited = bmesh.from_edit_mesh(patch.data)
        edited.verts.ensure_lookup_table()
        edited.verts[0].co.z += 2
        bmesh.update_edit_mesh(patch.data)
        update()
        assert number_of(posed_camera, "look_at") == pytest.approx(where_blender_has_it(), abs=1e-6)
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    assert number_of(posed_camera, "look_at") == pytest.approx(where_blender_has_it(), abs=1e-6)


def test_a_keyed_vertex_group_is_followed_in_the_render(posed_camera, scene, patch, empty):
    from viewcam_addon.blender.scenes import depsgraph

    follow(posed_camera, "look_at", patch)
    posed_camera.virtual_pinhole.look_at_group = "Some"
    deformed_by_a_key(patch, empty)
    key = patch.data.shape_keys.key_blocks["Bent"]
    for frame, share in ((1, 0.0), (11, 1.0)):
        key.value = share
        key.keyframe_insert("value", frame=frame)
    result = {}
    for frame in (11, 1):
        scene.frame_set(frame)
        at = number_of(posed_camera, "look_at")
        seen = depsgraph.visit(scene, lambda graph: cameras.read(posed_camera.evaluated_get(graph), scene))
        assert -np.array(seen.basis()[2]) == pytest.approx(_unit(np.subtract(at, (7, -6, 5))), abs=1e-6)
        result[frame] = at
    assert math.dist(result[1], result[11]) > 0.5


@pytest.mark.parametrize("name", ["None", "Empty"])
def test_a_vertex_group_that_has_no_vertex_is_named_and_the_origin_followed(posed_camera, patch, name):
    patch.vertex_groups.new(name="Empty").add([0], 0.0, "REPLACE")
    follow(posed_camera, "look_at", patch)
    posed_camera.virtual_pinhole.look_at_group = name
    update()
    assert number_of(posed_camera, "look_at") == pytest.approx((1, 2, 3), abs=1e-6)
    (sentence,) = targets.warnings(posed_camera)
    start = "The look-at target 'Grid' has no vertex in a group"
    assert sentence == f"{start} {name!r}, and its origin is followed: choose another, or clear it"
    posed_camera.virtual_pinhole.look_at_group = "Some"
    assert targets.warnings(posed_camera) == []


@pytest.mark.parametrize("kind", ["HOOK", "NODES"])
def test_a_vertex_group_that_the_camera_deforms_is_not_followed_and_the_origin_is(posed_camera, patch, kind):
    modifier = patch.modifiers.new("By the Camera", kind)
    if kind == "HOOK":
        modifier.object = posed_camera
    else:
        tree = bpy.data.node_groups.new("By the Camera", "GeometryNodeTree")
        tree.interface.new_socket("Object", in_out="INPUT", socket_type="NodeSocketObject").default_value = posed_camera
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Mesh", in_out=way, socket_type="NodeSocketGeometry")
        ends = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
        tree.links.new(ends[0].outputs["Mesh"], ends[1].inputs["Mesh"])
        modifier.node_group = tree
    follow(posed_camera, "look_at", patch)
    assert targets.warnings(posed_camera) == [] and number_of(posed_camera, "look_at") == pytest.approx((1, 2, 3), abs=1e-6)
    posed_camera.virtual_pinhole.look_at_group = "Some"
    (sentence,) = targets.warnings(posed_camera)
    assert sentence.startswith("The look-at target 'Grid' is moved by the camera itself, and is not followed")


def test_letting_go_of_a_mesh_forgets_its_group_and_leaves_the_camera(posed_camera, patch):
    follow(posed_camera, "look_at", patch)
    posed_camera.virtual_pinhole.look_at_group = "Some"
    update()
    before = number_of(posed_camera, "look_at")
    targets.release(posed_camera, "look_at")
    assert number_of(posed_camera, "look_at") == before and posed_camera.virtual_pinhole.look_at_group == ""


def test_a_vertex_group_is_looked_at_once_until_some_mesh_is_evaluated(posed_camera, patch):
    follow(posed_camera, "look_at", patch)
    posed_camera.virtual_pinhole.look_at_group = "Some"
    update()
    number_of(posed_camera, "look_at")
    ((key, kept),) = targets._shapes.items()
    for x in (8, 9):
        posed_camera.virtual_pinhole.eye[0] = x
        update()
        number_of(posed_camera, "look_at")
    assert targets._shapes[key] is kept
    patch.data.vertices[0].co.z = 1
    patch.data.update()
    update()
    number_of(posed_camera, "look_at")
    assert list(targets._shapes.values()) != [kept]


def hooks(camera_object):
    return [curve.array_index for curve in hold.versions.drivers(camera_object)]


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


def test_where_animation_data_are_cleared_the_target_is_followed_all_the_same(watching_camera, target):
    watching_camera.animation_data_clear()
    update()
    target.location.x = 8
    update()
    assert watching_camera.virtual_pinhole.numbers()[1] == (8, 2, 3)
    assert is_where_stated(watching_camera, bpy.context.scene)


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
