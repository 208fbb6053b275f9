"""Bake: plain keyframes that give the live camera's picture without the add-on.

Among others, too: parents, constraints, targets, NLA, libraries; and what is refused.
"""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import versions
from viewcam_addon.blender.interface import baking, panel
from viewcam_addon.errors import InputError

CHANNELS = ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale")


@pytest.fixture
def over_the_target(posed_camera, scene, over_the_top):
    """A camera that flies over the origin from frame 1 to 21, is straight above it at frame 11, and zooms all the way."""
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    group = posed_camera.virtual_pinhole
    group.look_at = (0, 0, 0)
    for frame in range(1, 22):
        group.eye, group.up, group.distance = over_the_top(6 * (frame - 11)), (0, 0.01 * frame, 1), 30 + frame
        for name in ("eye", "up", "distance"):
            group.keyframe_insert(name, frame=frame)
    # Exactly straight above, up included.
    group.eye, group.up = (0, 0, 10), (0, 0, 1)
    for name in ("eye", "up"):
        group.keyframe_insert(name, frame=11)
    scene.frame_start, scene.frame_end = 1, 21
    scene.frame_set(1)
    return posed_camera


@pytest.fixture
def curves():
    """A function that gives the curves of a block's action by data path and index."""

    def of(block):
        return {(curve.data_path, curve.array_index): curve for curve in versions.action_curves(block)}

    return of


@pytest.fixture
def everything(curves):
    """A function that gives all that a bake may touch, in numbers: channels, data, values and curves."""

    def of(camera_object):
        blocks = (camera_object, camera_object.data)
        keys = {
            (type(block).__name__, *name): [(*point.co, point.interpolation) for point in curve.keyframe_points]
            for block in blocks
            for name, curve in curves(block).items()
        }
        data, group = camera_object.data, camera_object.virtual_pinhole
        return (
            [tuple(getattr(camera_object, name)) for name in CHANNELS],
            (data.lens, data.sensor_width, data.sensor_height, data.shift_x, data.shift_y),
            (group.enabled, group.numbers()),
            keys,
            tuple(getattr(block.animation_data, "action", None) is None for block in blocks),
        )

    return of


MODES = ("XYZ", "ZYX", "QUATERNION", "AXIS_ANGLE")


@pytest.fixture
def without_the_addon():
    """A function that takes the add-on out of Blender until the test ends."""
    yield viewcam_addon.unregister
    if not hasattr(bpy.types.Object, "virtual_pinhole"):
        viewcam_addon.register()


@pytest.mark.slow
@pytest.mark.parametrize("pole", [pytest.param("CANONICAL", marks=pytest.mark.exhaustive), "HOLD"])
def test_a_baked_flight_over_the_pole_renders_the_live_picture_without_the_addon(
    over_the_target, scene, render_positions, picture_error, without_the_addon, pole
):
    over_the_target.virtual_pinhole.pole = pole
    scene.frame_step, expected = 2, {}
    for frame in range(1, 22, 2):
        scene.frame_set(frame)
        expected[frame] = cameras.stated(over_the_target, scene)
    pictures = [render_positions(animation=True)]
    assert bpy.ops.viewcam.bake_camera() == {"FINISHED"}
    without_the_addon()
    scene.frame_set(500)
    pictures.append(render_positions(animation=True))
    for frame, pinhole in expected.items():
        for name, positions in zip(("live", "baked"), pictures, strict=True):
            error, tolerance = picture_error(pinhole, positions[frame])
            assert error <= tolerance, f"{name}, frame {frame}: {error:.1e} px, and {tolerance:.1e} are rounding"
    error, tolerance = picture_error(expected[13], pictures[1][11])
    assert error > 100 * tolerance, "keyframes of another frame would not have been noticed"


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
def test_keyframes_are_within_rounding_of_the_live_camera_and_never_flip(over_the_target, scene, mode, curves):
    over_the_target.rotation_mode = mode
    over_the_target.virtual_pinhole.pole = "HOLD"
    (flight,) = baking.bake([over_the_target], scene, 1, 21)
    assert flight.ok
    # 40 px from the axis at d = 40: the storage of a rotation, at most 4e-7 on both sides, shows as 4e-7 · 40 · 2.
    assert flight.at_keys < 1e-4, flight.sentence()
    # 6° a frame about the look-at point, ten away: half-way a straight line is 10 (1 − cos 3°) off, 0.014 of a length of 10.
    assert flight.between < 0.05 * 40, flight.sentence()
    name = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}.get(mode, "rotation_euler")
    for index in range(len(getattr(over_the_target, name))):
        steps = np.diff([point.co[1] for point in curves(over_the_target)[name, index].keyframe_points])
        assert (np.abs(steps) < 0.5).all(), f"{name} {index} jumps by {np.abs(steps).max():.2g}"


def test_a_flip_that_up_asks_for_is_told_between_the_keyframes(over_the_target, scene):
    (flight,) = baking.bake([over_the_target], scene, 1, 21)
    assert flight.ok and flight.between > 10 and flight.frame in (10.5, 11.5), flight.sentence()


@pytest.mark.slow
def test_more_keys_a_frame_follow_the_flight_more_closely(over_the_target, scene, curves):
    over_the_target.virtual_pinhole.pole = "HOLD"
    (flight,) = baking.bake([over_the_target], scene, 1, 9)
    over_the_target.virtual_pinhole.enabled = True
    (four,) = baking.bake([over_the_target], scene, 1, 9, keys_per_frame=4)
    assert len(curves(over_the_target)["location", 0].keyframe_points) == 33
    # The error of a straight line goes with the square of its length; a corner of the keyed values goes with the length.
    assert four.between < flight.between / 3.5, f"{flight.sentence()}; {four.sentence()}"


@pytest.mark.parametrize("path", ["location", "rotation_euler", "lens"])
def test_the_report_notices_keyframes_that_are_wrong(over_the_target, scene, monkeypatch, path, curves):
    write = baking._write

    def spoil(flight):
        write(flight)
        block = over_the_target.data if path == "lens" else over_the_target
        curve = curves(block)[path, 0]
        for point in curve.keyframe_points:
            point.co[1] *= 1.001
        curve.update()

    monkeypatch.setattr(baking, "_write", spoil)
    (flight_baked,) = baking.bake([over_the_target], scene, 1, 21)
    assert not flight_baked.ok


def test_the_values_are_kept_and_turned_off_and_the_frame_is_restored(over_the_target, scene, curves):
    scene.frame_set(7, subframe=0.25)
    before = over_the_target.virtual_pinhole.numbers()
    place = tuple(over_the_target.location)
    bpy.ops.viewcam.bake_camera()
    assert (scene.frame_current, scene.frame_subframe) == (7, 0.25)
    group = over_the_target.virtual_pinhole
    assert group.numbers() == before and not group.enabled
    assert {path for path, _ in curves(over_the_target)} >= {"virtual_pinhole.eye", "virtual_pinhole.up", "location"}
    # A quarter of the way along a straight line, and not along the curve.
    assert 0 < math.dist(over_the_target.location, place) < 0.05
    scene.frame_set(7)
    assert tuple(over_the_target.location) == pytest.approx(tuple(group.eye), rel=1e-6)


def test_undo_brings_everything_back_bit_for_bit(over_the_target, scene, everything, curves):
    over_the_target.data.lens = 33
    over_the_target.data.keyframe_insert("lens", frame=3)
    curves(over_the_target.data)["lens", 0].mute = True  # or it would win over the values as soon as Blender plays it
    scene.frame_set(5)
    before = everything(over_the_target)
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.viewcam.bake_camera()
    after = everything(over_the_target)
    assert after != before
    bpy.ops.ed.undo_push(message="baked")
    bpy.ops.ed.undo()
    assert everything(bpy.data.objects["Camera"]) == before
    bpy.ops.ed.redo()
    assert everything(bpy.data.objects["Camera"]) == after


def test_curves_of_these_channels_are_replaced_and_all_others_are_left_alone(over_the_target, scene, curves):
    camera = over_the_target.data
    for block, path in ((over_the_target, "location"), (over_the_target, "scale"), (camera, "lens"), (camera, "shift_x")):
        for frame in (1, 100):
            block.keyframe_insert(path, frame=frame)
    curves(over_the_target)["location", 0].modifiers.new("NOISE")
    curves(camera)["lens", 0].mute = True
    kept = [
        [tuple(point.co) for point in curves(block)[path, 0].keyframe_points]
        for block, path in ((over_the_target, "scale"), (camera, "shift_x"))
    ]
    (flight,) = baking.bake([over_the_target], scene, 1, 21)
    assert flight.ok, flight.sentence()
    assert [
        [tuple(point.co) for point in curves(block)[path, 0].keyframe_points]
        for block, path in ((over_the_target, "scale"), (camera, "shift_x"))
    ] == kept
    assert [point.co[0] for point in curves(camera)["lens", 0].keyframe_points] == list(range(1, 22))
    names = [(curve.data_path, curve.array_index) for curve in versions.action_curves(over_the_target)]
    assert len(names) == len(set(names))


def test_what_stands_still_gets_a_single_keyframe(posed_camera, scene, curves):
    group = posed_camera.virtual_pinhole
    for frame, distance in ((1, 500), (11, 600)):
        group.distance = distance
        group.keyframe_insert("distance", frame=frame)
    baking.bake([posed_camera], scene, 1, 11)
    counts = {name: len(curve.keyframe_points) for name, curve in curves(posed_camera).items() if name[0][0] != "v"}
    assert counts == {(path, i): 1 for path in ("location", "rotation_euler") for i in range(3)}
    assert len(curves(posed_camera.data)["lens", 0].keyframe_points) == 11
    assert ("sensor_width", 0) not in curves(posed_camera.data)


def test_a_sensor_that_must_grow_has_one_size_for_all_frames(posed_camera, scene, curves):
    """1920 px at d = 20 ask for a lens of 0.375 mm, at d = 200 for one of 3.75 mm."""
    group = posed_camera.virtual_pinhole
    for frame, distance in ((1, 20), (5, 200)):
        group.distance = distance
        group.keyframe_insert("distance", frame=frame)
    for point in curves(posed_camera)["virtual_pinhole.distance", 0].keyframe_points:
        point.interpolation = "LINEAR"
    scene.frame_set(5)
    assert posed_camera.data.sensor_width == 36
    (flight,) = baking.bake([posed_camera], scene, 1, 5)
    assert flight.ok and posed_camera.data.sensor_width == 4 * 36
    assert ("sensor_width", 0) not in curves(posed_camera.data)
    # The lens goes along a straight line as d does: 960 px from the middle, three roundings of float32 on both sides.
    assert flight.between < 6 * 960 * 2.0**-24, flight.sentence()
    group.enabled = True
    scene.frame_set(5)
    assert posed_camera.data.sensor_width == 36  # live again, with the artist's own


def test_an_animated_sensor_is_followed(over_the_target, scene, curves):
    camera = over_the_target.data
    for frame, width in ((1, 36), (21, 18)):
        camera.sensor_width = width
        camera.keyframe_insert("sensor_width", frame=frame)
    (flight,) = baking.bake([over_the_target], scene, 1, 21)
    assert flight.ok, flight.sentence()
    assert len(curves(camera)["sensor_width", 0].keyframe_points) == 21


def test_time_that_is_stretched_is_followed(over_the_target, scene, curves):
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 200
    (flight,) = baking.bake([over_the_target], scene, 1, 42)
    assert flight.ok, flight.sentence()
    assert curves(over_the_target)["location", 0].keyframe_points[-1].co[0] == 21


def test_motion_blur_gets_keyframes_before_and_behind_the_range(over_the_target, scene, curves):
    scene.render.use_motion_blur = True
    baking.bake([over_the_target], scene, 5, 9)
    assert [point.co[0] for point in curves(over_the_target)["location", 0].keyframe_points] == list(range(4, 11))


@pytest.mark.slow
def test_keys_where_the_shutter_looks_give_the_same_motion_blur(over_the_target, scene, render_positions):
    """A shutter of half a frame is open from a quarter before to a quarter behind: four keyframes a frame hit both."""
    over_the_target.virtual_pinhole.pole = "HOLD"
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.5
    scene.frame_start, scene.frame_end = 10, 12
    live = render_positions(animation=True)
    apart = {}
    for keys_per_frame in (1, 4):
        over_the_target.virtual_pinhole.enabled = True
        baking.bake([over_the_target], scene, 10, 12, keys_per_frame)
        baked = render_positions(animation=True)
        apart[keys_per_frame] = max(np.abs(baked[frame] - live[frame]).max() for frame in live)
    # In world units on a sphere of 40: some roundings of float32. In fact no bit differed, and with one key 0.018.
    assert apart[4] < 40 * 2.0**-18 < apart[1], apart


def test_a_range_that_runs_backwards_is_refused(over_the_target):
    with pytest.raises(RuntimeError, match="The last frame 2 is before the first frame 5"):
        bpy.ops.viewcam.bake_camera(frame_start=5, frame_end=2)


def test_a_single_frame_is_baked(over_the_target, scene):
    (flight,) = baking.bake([over_the_target], scene, 4, 4)
    assert flight.ok and "between" not in flight.sentence()


def test_turned_on_again_after_a_bake_one_warning_names_the_keyframes_and_its_button_brings_the_live_camera_back(
    over_the_target, scene, everything
):
    before = everything(over_the_target)
    bpy.ops.viewcam.bake_camera()
    over_the_target.virtual_pinhole.enabled = True
    bpy.context.view_layer.update()
    notice, *more = (each for each in panel.notices(over_the_target, scene) if "Keyframes" in each.sentence)
    assert not more and "_" not in notice.sentence
    assert notice.sentence.startswith(
        "Keyframes set the location, rotation and focal length of 'Camera', and in a render they win"
    )
    assert notice.remedy == ("viewcam.delete_keyframes", "Delete These Keyframes")
    assert bpy.ops.viewcam.delete_keyframes() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert everything(over_the_target)[3].keys() == before[3].keys()
    assert [each for each in panel.notices(over_the_target, scene) if "Keyframes" in each.sentence] == []
    with pytest.raises(RuntimeError, match="has keyframes of its own channels"):
        bpy.ops.viewcam.delete_keyframes()


def test_turned_on_again_after_a_bake_the_values_that_have_no_keyframes_are_as_they_were(posed_camera, scene):
    """Not what the plane of focus says: at another frame the camera would look past its look-at point."""
    group = posed_camera.virtual_pinhole
    group.up = (0.1, 0, 1)
    for frame, eye in ((1, (7, -6, 5)), (21, (-7, -6, 5))):
        group.eye = eye
        group.keyframe_insert("eye", frame=frame)
    scene.frame_start, scene.frame_end = 1, 21
    scene.frame_set(1)
    before = group.numbers()
    baking.bake([posed_camera], scene, 1, 21)
    group.enabled = True
    assert group.numbers() == before


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


def test_a_linked_camera_is_refused_and_a_library_override_is_baked_and_saved(
    over_the_target, scene, tmp_path, everything, link_object
):
    library, file = tmp_path / "library.blend", tmp_path / "shot.blend"
    bpy.data.libraries.write(str(library), {over_the_target})
    bpy.data.objects.remove(over_the_target)
    bpy.data.cameras.remove(bpy.data.cameras["Camera"])
    linked = link_object(library)
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
