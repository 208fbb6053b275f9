"""Baking a camera among others: parents, constraints, targets, NLA, libraries; and what is refused."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.interface import baking
from viewcam_addon.errors import InputError


def test_an_animated_parent_and_a_constraint_that_carries_are_taken_into_account(over_the_target, scene):
    dolly, crane = (bpy.data.objects.new(name, None) for name in ("Dolly", "Crane"))
    for item in (dolly, crane):
        scene.collection.objects.link(item)
        for frame, x in ((1, -3.0), (21, 4.0)):
            item.location, item.rotation_euler = (x, 1, 2), (x / 9, x / 5, 0.3)
            item.keyframe_insert("location", frame=frame)
            item.keyframe_insert("rotation_euler", frame=frame)
    over_the_target.parent = dolly
    (flight,) = baking.bake([over_the_target], scene, 1, 21)
    assert flight.ok, flight.sentence()
    over_the_target.virtual_pinhole.enabled = True
    constraint = over_the_target.constraints.new("CHILD_OF")
    constraint.target = crane
    (flight,) = baking.bake([over_the_target], scene, 1, 21)
    assert flight.ok, flight.sentence()


def test_a_target_on_a_moving_object_is_followed_and_kept(over_the_target, scene):
    dolly, target = (bpy.data.objects.new(name, None) for name in ("Dolly", "Target"))
    for item in (dolly, target):
        scene.collection.objects.link(item)
    target.parent, target.location = dolly, (1, 0, 0)
    for frame, x in ((1, -2.0), (21, 2.0)):
        dolly.location, dolly.rotation_euler = (x, 0.5, 0), (0, x, x)
        dolly.keyframe_insert("location", frame=frame)
        dolly.keyframe_insert("rotation_euler", frame=frame)
    over_the_target.virtual_pinhole.look_at_target = target
    scene.frame_set(13)
    live = cameras.read(over_the_target, scene)
    (flight,) = baking.bake([over_the_target], scene, 1, 21)
    assert flight.ok, flight.sentence()
    assert over_the_target.virtual_pinhole.look_at_target == target
    np.testing.assert_allclose(cameras.read(over_the_target, scene).basis(), live.basis(), atol=1e-6)
    assert abs(live.project(tuple(target.matrix_world.translation))[0] - 32) < 1e-3  # in the middle of 64 px


def test_a_constraint_in_the_way_acts_on_keyframes_as_on_the_live_camera(over_the_target, scene):
    constraint = over_the_target.constraints.new("LIMIT_LOCATION")
    constraint.use_max_z, constraint.max_z = True, 8
    (flight,) = baking.bake([over_the_target], scene, 1, 21)
    assert flight.ok, flight.sentence()


def test_values_in_the_nla_are_baked_into_an_action_above_it(over_the_target, scene, curves):
    data = over_the_target.animation_data
    track, action, slot = data.nla_tracks.new(), data.action, getattr(data, "action_slot", None)
    strip = track.strips.new("Strip", 1, action)
    if slot:
        strip.action_slot = slot
    data.action = None
    scene.frame_set(1)
    (flight,) = baking.bake([over_the_target], scene, 1, 21)
    assert flight.ok, flight.sentence()
    assert data.action != action and {path for path, _ in curves(over_the_target)} == {"location", "rotation_euler"}


def test_a_camera_of_another_scene_is_baked_in_its_own(over_the_target, scene, curves):
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(over_the_target)
    other.render.resolution_x, other.render.resolution_y = 64, 36
    other.frame_start, other.frame_end = 3, 7
    scene.collection.objects.unlink(over_the_target)
    scene.frame_set(19)
    bpy.ops.viewcam.bake_camera(camera="Camera")
    assert [point.co[0] for point in curves(over_the_target)["location", 0].keyframe_points] == [3, 4, 5, 6, 7]
    assert scene.frame_current == 19
    other.frame_set(5)
    assert over_the_target.location.z == pytest.approx(over_the_target.virtual_pinhole.eye[2])


def test_a_hidden_camera_is_refused_and_named_unless_the_scene_needs_it(over_the_target, add_camera, scene):
    add_camera("Other")  # the scene's camera now
    over_the_target.hide_viewport = True
    with pytest.raises(RuntimeError, match="Frame 1: camera 'Camera' takes no part in scene 'Scene': enable it"):
        bpy.ops.viewcam.bake_camera(camera="Camera")
    scene.camera = over_the_target
    assert bpy.ops.viewcam.bake_camera(camera="Camera") == {"FINISHED"}


def test_all_selected_cameras_are_baked_in_one_go(over_the_target, scene, add_camera, curves):
    other, plain = add_camera("Other"), add_camera("Plain")
    group = other.virtual_pinhole
    group.enabled = True
    for frame in (1, 9):
        group.eye = (frame, 5, 1)
        group.keyframe_insert("eye", frame=frame)
    for item in (over_the_target, other, plain):
        item.select_set(True)
    bpy.context.view_layer.objects.active = over_the_target
    bpy.ops.viewcam.bake_camera(frame_start=2, frame_end=6, selected=True)
    for item in (over_the_target, other):
        assert [point.co[0] for point in curves(item)["location", 0].keyframe_points] == [2, 3, 4, 5, 6], item.name
    assert plain.animation_data is None


def test_a_linked_camera_is_refused_and_a_library_override_is_baked_and_saved(over_the_target, scene, tmp_path, everything):
    library, file = tmp_path / "library.blend", tmp_path / "shot.blend"
    bpy.data.libraries.write(str(library), {over_the_target})
    bpy.data.objects.remove(over_the_target)
    bpy.data.cameras.remove(bpy.data.cameras["Camera"])
    with bpy.data.libraries.load(str(library), link=True) as (_, into):
        into.objects = ["Camera"]
    (linked,) = into.objects
    scene.collection.objects.link(linked)
    with pytest.raises(InputError, match=r"'Camera' is linked from 'library.blend': make a local copy, or a library override"):
        baking.bake([linked], scene, 1, 21)
    override = linked.override_create(remap_local_usages=True)
    with pytest.raises(InputError, match=r"'CameraAction' is linked from"):
        baking.bake([override], scene, 1, 21)
    override.animation_data.action = override.animation_data.action.copy()
    with pytest.raises(InputError, match=r"'Camera' is linked from"):  # the data still is
        baking.bake([override], scene, 1, 21)
    override.data.override_create(remap_local_usages=True)
    (flight,) = baking.bake([override], scene, 1, 21)
    assert flight.ok, flight.sentence()
    before = everything(override)
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    bpy.ops.wm.open_mainfile(filepath=str(file))
    override = next(item for item in bpy.context.scene.objects if item.type == "CAMERA")
    assert override.override_library and everything(override) == before


def spoil_driver(camera_object, _scene):
    camera_object.data.driver_add("lens")


def spoil_enabled(camera_object, _scene):
    camera_object.virtual_pinhole.keyframe_insert("enabled", frame=1)


def spoil_shared_data(camera_object, scene):
    scene.collection.objects.link(bpy.data.objects.new("Twin", camera_object.data))


def spoil_shared_action(camera_object, scene):
    twin = bpy.data.objects.new("Twin", bpy.data.cameras.new("Twin"))
    scene.collection.objects.link(twin)
    twin.animation_data_create().action = camera_object.animation_data.action
    if hasattr(twin.animation_data, "action_slot"):
        twin.animation_data.action_slot = camera_object.animation_data.action_slot


def spoil_nla(camera_object, _scene):
    camera_object.animation_data.nla_tracks.new()
    camera_object.animation_data.action_blend_type = "ADD"


def spoil_type(camera_object, _scene):
    camera_object.data.type = "ORTHO"


def spoil_values(camera_object, _scene):
    group = camera_object.virtual_pinhole
    group.eye = group.look_at
    group.keyframe_insert("eye", frame=7)


def spoil_animation(camera_object, _scene):
    camera_object.animation_data_clear()


def spoil_switch(camera_object, _scene):
    camera_object.virtual_pinhole.enabled = False


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (spoil_driver, "A driver sets 'lens' of 'Camera', and would win over keyframes: remove it"),
        (spoil_enabled, "'enabled' of 'Camera' is animated, and would turn it on again: delete its keyframes"),
        (spoil_shared_data, "The camera data 'Camera' is shared with 'Twin', which keyframes of the lens would zoom too: "),
        (spoil_shared_action, " of 'Camera' moves 'Twin' too: make the action single-user"),
        (spoil_nla, "The NLA would mix the keyframes of 'Camera' with its tracks: "),
        (spoil_type, "Camera 'Camera' is orthographic, no pinhole: "),
        (spoil_values, "Frame 7: eye and look_at are the same point "),
        (spoil_animation, "The values of camera 'Camera' are not animated, and its pose and lens are plain Blender already: "),
        (spoil_switch, "The Virtual Pinhole of camera 'Camera' is not enabled, and the camera is plain Blender: enable it"),
    ],
)
def test_what_can_not_be_baked_is_refused_in_a_sentence_and_nothing_changes(
    over_the_target, scene, spoil, sentence, everything
):
    scene.frame_set(3)
    spoil(over_the_target, scene)
    scene.frame_set(3)
    before = everything(over_the_target)
    with pytest.raises(RuntimeError) as error:
        bpy.ops.viewcam.bake_camera(camera="Camera")
    assert sentence in str(error.value) and "Traceback" not in str(error.value)
    assert everything(over_the_target) == before
    assert scene.frame_current == 3
