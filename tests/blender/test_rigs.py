"""Cameras that keyframes, a path, a bone or drivers place: followed at each of 250 frames, converted, and never disturbed."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import addon_utils

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks, findings, pose, versions
from viewcam_addon.blender.interface import panel

pytestmark = pytest.mark.slow

FRAMES = range(1, 251)


def keyed(camera_object, scene, empty):
    """Keyframes of location, rotation and lens, with Blender's own curves between them."""
    for frame, place, turn, lens in (
        (1, (7, -6, 5), (1.1, 0, 0.8), 35),
        (120, (-3, -9, 2), (1.4, 0.1, -0.3), 85),
        (250, (4, 5, 8), (0.7, 0, 2.4), 50),
    ):
        camera_object.location, camera_object.rotation_euler, camera_object.data.lens = place, turn, lens
        for block, path in ((camera_object, "location"), (camera_object, "rotation_euler"), (camera_object.data, "lens")):
            block.keyframe_insert(path, frame=frame)


def path_rig(camera_object, scene, empty):
    """The commonest rig: Follow Path and Track To."""
    bpy.ops.curve.primitive_bezier_circle_add(radius=6, location=(0, 0, 3))
    path = bpy.context.object
    path.data.use_path = True
    camera_object.location = (0, 0, 0)
    follow = camera_object.constraints.new("FOLLOW_PATH")
    follow.target = path
    for frame, offset in ((1, 0), (250, 100)):
        follow.offset = offset
        follow.keyframe_insert("offset", frame=frame)
    track = camera_object.constraints.new("TRACK_TO")
    track.target, track.track_axis, track.up_axis = empty("Target", (0.5, 0.2, 1)), "TRACK_NEGATIVE_Z", "UP_Y"


def on_a_bone(camera_object, scene, empty):
    """A child of an animated bone."""
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.data.edit_bones.new("Head")
    bone.head, bone.tail = (0, 0, 1), (0, 1, 2)
    bpy.ops.object.mode_set(mode="OBJECT")
    head = armature.pose.bones["Head"]
    head.rotation_mode = "XYZ"
    for frame, place, turn in ((1, (0, 0, 0), (0, 0, 0)), (250, (2, 1, -1), (0.5, 1.0, -2.0))):
        head.location, head.rotation_euler = place, turn
        head.keyframe_insert("location", frame=frame)
        head.keyframe_insert("rotation_euler", frame=frame)
    camera_object.parent, camera_object.parent_type, camera_object.parent_bone = armature, "BONE", "Head"
    camera_object.location, camera_object.rotation_euler = (1, -4, 2), (1.2, 0, 0.3)


def driven(camera_object, scene, empty):
    """Drivers of location, rotation and lens."""
    for index, expression in enumerate(("7 * cos(frame / 40)", "7 * sin(frame / 40)", "3 + frame / 100")):
        camera_object.driver_add("location", index).driver.expression = expression
    camera_object.driver_add("rotation_euler", 0).driver.expression = "1.1 + frame / 1000"
    camera_object.driver_add("rotation_euler", 2).driver.expression = "frame / 40 + 1.57"
    camera_object.data.driver_add("lens").driver.expression = "35 + frame / 10"


RIGS = {"keyed": keyed, "path": path_rig, "bone": on_a_bone, "driven": driven}


@pytest.fixture
def rigged(camera_object, scene, empty):
    """A function that places the camera by one of RIGS."""

    def make(name):
        RIGS[name](camera_object, scene, empty)
        scene.frame_start, scene.frame_end = FRAMES[0], FRAMES[-1]
        scene.frame_set(30)
        return camera_object

    return make


def stands(camera_object):
    """The evaluated matrix and lens, to the bit."""
    evaluated = camera_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return [tuple(row) for row in evaluated.matrix_world], evaluated.data.lens


def flight_of(camera_object, scene, frames=FRAMES):
    flight = []
    for frame in frames:
        scene.frame_set(frame)
        flight.append(stands(camera_object))
    return flight


def differences(camera_object, scene):
    reach = pose.reach(camera_object, bpy.context.evaluated_depsgraph_get())
    return findings.differences(cameras.stated(camera_object, scene), cameras.read(camera_object, scene), reach)


@pytest.mark.parametrize("name", RIGS)
def test_ticked_the_values_are_true_at_each_frame_and_no_bit_of_the_camera_changes(rigged, scene, name):
    camera_object = rigged(name)
    before = flight_of(camera_object, scene)
    scene.frame_set(30)
    camera_object.virtual_pinhole.enabled = True
    for frame, stood in zip(FRAMES, before, strict=True):
        scene.frame_set(frame)
        assert stands(camera_object) == stood, f"frame {frame}"
        assert differences(camera_object, scene) == {}, f"frame {frame}"
        eye = np.float32(camera_object.virtual_pinhole.eye)
        step = 2.0**-23 * np.abs(eye).max()
        np.testing.assert_allclose(eye, np.array(stood[0])[:3, 3], rtol=0, atol=step, err_msg=f"frame {frame}")
    assert panel.notices(camera_object, scene) == []


@pytest.mark.parametrize("name", RIGS)
def test_what_an_engine_is_given_is_the_same_to_the_bit_before_and_after_ticking(rigged, scene, name, render_positions):
    camera_object = rigged(name)
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 250, 83
    before = render_positions(animation=True)
    camera_object.virtual_pinhole.enabled = True
    scene.frame_set(77)
    bpy.ops.render.render(animation=True)
    for frame, picture in again(scene).items():
        assert np.array_equal(picture, before[frame]), f"frame {frame}"


def again(scene):
    """The frames that were rendered last, as render_positions reads them."""
    result = {}
    for frame in range(scene.frame_start, scene.frame_end + 1, scene.frame_step):
        image = bpy.data.images.load(f"{scene.render.filepath}{frame:04d}.exr")
        width, height = image.size
        pixels = np.empty(width * height * 4, dtype=np.float32)
        image.colorspace_settings.name = "Non-Color"
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        result[frame] = pixels.reshape(height, width, 4)[..., :3]
    return result


@pytest.mark.parametrize("is_ticked", [True, False])
def test_keyframes_become_values_at_every_frame_and_go(rigged, scene, is_ticked):
    camera_object = rigged("keyed")
    before = flight_of(camera_object, scene)
    camera_object.virtual_pinhole.enabled = is_ticked
    scene.frame_set(30)
    assert bpy.ops.viewcam.convert_keyframes(camera="Camera") == {"FINISHED"}
    assert scene.frame_current == 30 and camera_object.virtual_pinhole.enabled
    assert {curve.data_path.split(".")[0] for curve in versions.action_curves(camera_object)} == {"virtual_pinhole"}
    assert versions.action_curves(camera_object.data) == []
    for (matrix, lens), (was, lens_before) in zip(flight_of(camera_object, scene), before, strict=True):
        assert lens == lens_before
        np.testing.assert_array_equal(np.array(matrix)[:3, 3], np.array(was)[:3, 3])
        np.testing.assert_allclose(matrix, was, rtol=0, atol=findings.LARGEST_TURN)
        assert differences(camera_object, scene) == {}
    assert panel.notices(camera_object, scene) == []


def test_there_and_back_by_bake_the_camera_flies_the_same(rigged, scene):
    camera_object = rigged("keyed")
    before = flight_of(camera_object, scene, range(1, 251, 10))
    bpy.ops.viewcam.convert_keyframes(camera="Camera")
    bpy.ops.viewcam.bake_camera(camera="Camera")
    assert not camera_object.virtual_pinhole.enabled
    for (matrix, _), (was, _) in zip(flight_of(camera_object, scene, range(1, 251, 10)), before, strict=True):
        np.testing.assert_allclose(matrix, was, rtol=0, atol=2 * findings.LARGEST_TURN)


def test_a_baked_camera_that_is_ticked_again_has_the_lens_of_its_frame(rigged, scene):
    """Not that of the last frame, up to which Bake has gone, where its lens is keyed in millimeters."""
    camera_object = rigged("keyed")
    bpy.ops.viewcam.convert_keyframes(camera="Camera")
    scene.frame_set(77)
    bpy.ops.viewcam.bake_camera(camera="Camera")
    (_, lens), last = stands(camera_object), flight_of(camera_object, scene, [250])[0][1]
    scene.frame_set(77)
    camera_object.virtual_pinhole.enabled = True
    assert abs(stands(camera_object)[1] - lens) <= lens * 2**-22 and abs(last - lens) > 1


def test_one_step_of_undo_brings_the_keyframes_back(rigged, scene):
    camera_object = rigged("keyed")
    before = flight_of(camera_object, scene, range(1, 251, 50))
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.viewcam.convert_keyframes(camera="Camera")
    bpy.ops.ed.undo_push(message="after")  # as a window does after an operator
    bpy.ops.ed.undo()
    camera_object, scene = bpy.data.objects["Camera"], bpy.context.scene
    assert {curve.data_path for curve in versions.action_curves(camera_object)} == {"location", "rotation_euler"}
    assert flight_of(camera_object, scene, range(1, 251, 50)) == before


def test_keyframes_under_a_moving_parent_become_values_in_the_world(rigged, scene, empty):
    camera_object = rigged("keyed")
    camera_object.parent = parent = empty("Dolly")
    for frame, x in ((1, 0), (250, 5)):
        parent.location.x = x
        parent.keyframe_insert("location", frame=frame)
    before = flight_of(camera_object, scene)
    bpy.ops.viewcam.convert_keyframes(camera="Camera")
    for (matrix, _), (was, _) in zip(flight_of(camera_object, scene), before, strict=True):
        np.testing.assert_allclose(matrix, was, rtol=0, atol=2 * findings.LARGEST_TURN * 10)


def clear(camera_object, empty):
    camera_object.animation_data_clear()
    camera_object.data.animation_data_clear()


def key_the_eye(camera_object, empty):
    camera_object.virtual_pinhole.keyframe_insert("eye")


def track(camera_object, empty):
    camera_object.constraints.new("TRACK_TO").target = empty("Elsewhere", (1, 1, 1))


def drive_the_scale(camera_object, empty):
    camera_object.driver_add("scale", 0)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [(clear, "nothing to"), (key_the_eye, "animated themselves"), (track, "apply it"), (drive_the_scale, "remove it")],
)
def test_keyframes_that_can_not_become_values_are_refused_and_stay(rigged, empty, spoil, words):
    camera_object = rigged("keyed")
    spoil(camera_object, empty)
    before = len(versions.action_curves(camera_object))
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.viewcam.convert_keyframes(camera="Camera")
    assert len(versions.action_curves(camera_object)) == before


@pytest.mark.parametrize("is_ticked", [True, False])
def test_a_track_to_becomes_the_look_at_target_and_the_path_goes_on(rigged, scene, is_ticked):
    camera_object = rigged("path")
    before = flight_of(camera_object, scene)
    scene.frame_set(30)
    camera_object.virtual_pinhole.enabled = is_ticked
    assert bpy.ops.viewcam.convert_track_to(camera="Camera") == {"FINISHED"}
    group = camera_object.virtual_pinhole
    assert group.look_at_target.name == "Target" and [each.type for each in camera_object.constraints] == ["FOLLOW_PATH"]
    location = tuple(camera_object.location)
    for frame, (matrix, lens), (was, lens_before) in zip(FRAMES, flight_of(camera_object, scene), before, strict=True):
        assert lens == lens_before
        np.testing.assert_allclose(matrix, was, rtol=0, atol=findings.LARGEST_TURN, err_msg=f"frame {frame}")
    assert tuple(camera_object.location) == location, "the path places the eye, and no frame feeds anything into it"
    assert location == pytest.approx((0, 0, 0), abs=1e-12)
    scene.frame_set(200)
    assert differences(camera_object, scene) == {} and panel.notices(camera_object, scene) == []
    bpy.data.objects["Target"].location.z = 3
    bpy.context.view_layer.update()
    column, row, _ = cameras.read(camera_object, scene).project(np.array([0.5, 0.2, 3.0]))
    assert (column, row) == pytest.approx((960, 540), abs=2e-3)


def test_a_converted_path_rig_renders_what_it_rendered(rigged, scene, render_positions, picture_error):
    camera_object = rigged("path")
    camera_object.virtual_pinhole.enabled = True
    bpy.ops.viewcam.convert_track_to(camera="Camera")
    scene.frame_start, scene.frame_end, scene.frame_step = 10, 240, 115
    for frame, positions in render_positions(animation=True).items():
        scene.frame_set(frame)
        error, tolerance = picture_error(cameras.stated(camera_object, scene), positions)
        assert error <= 2 * tolerance, f"frame {frame}: {error:.1e} px, and {tolerance:.1e} are rounding"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"track_axis": "TRACK_X"}, "set it to -Z"),
        ({"influence": 0.5}, "set its influence to 1"),
        ({"use_target_z": True}, "turn Target Z off"),
        ({"owner_space": "LOCAL"}, "spaces to World"),
    ],
)
def test_a_track_to_that_is_no_look_at_point_is_refused_and_stays(rigged, change, words):
    camera_object = rigged("path")
    for name, value in change.items():
        setattr(camera_object.constraints["Track To"], name, value)
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.viewcam.convert_track_to(camera="Camera")
    assert len(camera_object.constraints) == 2 and not camera_object.virtual_pinhole.enabled


def test_an_eye_on_a_keyed_location_and_a_look_at_target_go_together(rigged, scene, empty):
    """An animated value wins of its part alone."""
    camera_object = rigged("keyed")
    versions.remove_curves(camera_object, "rotation_euler")
    before = flight_of(camera_object, scene)
    camera_object.virtual_pinhole.enabled = True
    camera_object.virtual_pinhole.look_at_target = empty("Target", (0, 1, 2))
    for frame, (matrix, lens) in zip(FRAMES, before, strict=True):
        scene.frame_set(frame)
        eye, now = stands(camera_object)
        assert [row[3] for row in eye] == [row[3] for row in matrix] and now == lens, f"frame {frame}"
        column, row, _ = cameras.read(camera_object, scene).project(np.array([0, 1, 2.0]))
        assert math.dist((column, row), (960, 540)) < 2e-3, f"frame {frame}"
        assert differences(camera_object, scene) == {}, f"frame {frame}"
    assert panel.notices(camera_object, scene) == [] and datablocks.animated_values(camera_object) == {"look_at"}


# Debian's Blender is built without Alembic.
@pytest.mark.parametrize("program", ["fbx", *(["alembic"] if bpy.app.build_options.alembic else [])])
def test_an_animated_camera_that_blender_imports_is_followed(camera_object, scene, empty, tmp_path, program):
    """1e-5 : what FBX's angles and units leave in matrices of float32, calibrated."""
    frames, path = (1, 60, 120), str(tmp_path / {"alembic": "camera.abc", "fbx": "camera.fbx"}[program])
    keyed(camera_object, scene, empty)
    scene.frame_end = frames[-1]
    for each in scene.objects:
        each.select_set(each == camera_object)

    def matrices(followed):
        return np.array([(scene.frame_set(frame), np.array(followed.matrix_world))[1] for frame in frames])

    before = matrices(camera_object)
    addon_utils.enable("io_scene_fbx")
    if program == "alembic":
        bpy.ops.wm.alembic_export(filepath=path, selected=True, start=1, end=frames[-1])
    else:
        bpy.ops.export_scene.fbx(filepath=path, use_selection=True, bake_anim_simplify_factor=0, object_types={"CAMERA"})
    bpy.data.objects.remove(camera_object)
    if program == "alembic":
        bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)
    else:
        bpy.ops.import_scene.fbx(filepath=path)
    (imported,) = (each for each in scene.objects if each.type == "CAMERA")
    np.testing.assert_allclose(matrices(imported), before, atol=1e-5)
    scene.camera, imported.virtual_pinhole.enabled = imported, True
    for frame in frames:
        scene.frame_set(frame)
        stated = cameras.stated(imported, scene)
        assert stated.eye == pytest.approx(tuple(imported.matrix_world.translation), abs=1e-6)
        assert not any(finding.words for finding in cameras.check(imported, stated, scene))
