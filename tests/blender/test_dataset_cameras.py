"""An audit by the .blend that rendered a dataset: its cameras by name, or by the frames that end the pictures' names."""

import dataclasses
import json

import bpy
import numpy as np
import pytest

from viewcam_addon import cameras as formats
from viewcam_addon import cli
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import dataset_cameras
from viewcam_addon.cameras import Camera
from viewcam_addon.errors import InputError

COUNT = 6


@pytest.fixture
def flight(scene, camera_object, tmp_path):
    """A .blend whose camera flies, shifted, for six frames, and its cameras as its pictures are called."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 640, 360, 50
    camera_object.data.shift_x, camera_object.data.shift_y = 0.05, -0.02
    for frame in range(1, COUNT + 1):
        camera_object.location = (frame, -6 + 0.4 * frame, 3 + 0.1 * frame)
        camera_object.rotation_euler = (1.1, 0.02 * frame, 0.15 * frame)
        camera_object.keyframe_insert("location", frame=frame)
        camera_object.keyframe_insert("rotation_euler", frame=frame)
    result = []
    for frame in range(1, COUNT + 1):
        scene.frame_set(frame)
        result.append(Camera(f"{frame}", cameras.read(camera_object, scene), image=f"images/{frame:04d}.png"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "flight.blend"))
    return tmp_path / "flight.blend", result


def audited(folder, blend, capsys):
    status = cli.main(["audit", str(folder / "transforms.json"), "--blend", str(blend)])
    return status, capsys.readouterr()


def test_cameras_of_the_frames_that_their_pictures_are_called_by_are_right(flight, tmp_path, capsys):
    blend, pinholes = flight
    formats.save(pinholes, tmp_path / "transforms.json", "transforms")
    status, verdict = audited(tmp_path, blend, capsys)
    assert status == 0 and "nothing is wrong" in verdict.out and f"by {60 * COUNT} observations of {blend}" in verdict.out


def test_a_mistake_is_named_by_the_blend_alone(flight, tmp_path, capsys):
    blend, pinholes = flight
    whole = [
        dataclasses.replace(camera, pinhole=camera.pinhole.resized(640, 360)) for camera in pinholes
    ]  # the resolution percentage was ignored
    formats.save(whole, tmp_path / "transforms.json", "transforms")
    status, verdict = audited(tmp_path, blend, capsys)
    assert status == 1 and "resolution percentage: times 1/2 is right" in verdict.out
    document = json.loads(formats.write(pinholes, "transforms"))
    for frame in document["frames"]:
        frame["transform_matrix"] = np.linalg.inv(frame["transform_matrix"]).tolist()
    (tmp_path / "transforms.json").write_text(json.dumps(document))
    status, verdict = audited(tmp_path, blend, capsys)
    assert status == 1 and "world to camera" in verdict.out


def test_pictures_that_are_called_as_cameras_are_theirs(scene, add_camera, tmp_path):
    for number, name in enumerate(("left", "right", "other")):
        add_camera(name).location = (number, -5, 2)
    bpy.context.view_layer.update()
    wanted = {each.name: cameras.read(each, scene) for each in scene.objects}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    read_cameras = dataset_cameras.of_pictures(["right", "none", "left"], tmp_path / "a.blend")
    assert {camera.name: camera.pinhole for camera in read_cameras} == {name: wanted[name] for name in ("right", "left")}


def test_a_blend_that_does_not_tell_which_camera_took_a_picture_is_refused(camera_object, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    with pytest.raises(InputError, match="stands still; give the true cameras with --against"):
        dataset_cameras.of_pictures(["r_1", "r_2"], tmp_path / "a.blend")
    with pytest.raises(InputError, match="called otherwise"):
        dataset_cameras.of_pictures(["left"], tmp_path / "a.blend")


def test_an_animated_camera_is_written_for_another_program_without_rendering(flight, tmp_path, capsys):
    blend, pinholes = flight
    words = ["camera", str(blend), "--frames", f"1..{COUNT}", "--to", "colmap", "--out", str(tmp_path / "path")]
    assert cli.main(words) == 0 and f"{COUNT} cameras" in capsys.readouterr().out
    written = formats.read(tmp_path / "path")
    assert [camera.pinhole for camera in written] == [camera.pinhole for camera in pinholes]
    assert len({camera.name for camera in written}) == COUNT


def test_all_cameras_of_a_blend_are_listed_and_one_that_is_not_there_is_told(flight, capfd):
    blend, _ = flight
    assert cli.main(["camera", str(blend), "--list"]) == 0
    assert "Camera: 320 × 180" in capfd.readouterr().out
    for words in (["--camera", "Other"], ["--camera", "Other", "--frames", "1..2"]):
        assert cli.main(["camera", str(blend), *words]) == 2
        assert "'Other'" in capfd.readouterr().err
    assert cli.main(["camera", "a.json", "--frames", "1..2"]) == 2
    assert "those of a .blend" in capfd.readouterr().err


def test_file_export_writes_each_frame_and_leaves_the_scene_at_its_own(flight, tmp_path):
    _, pinholes = flight
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.resolution_percentage = 2, COUNT, 100
    scene.frame_set(3, subframe=0.25)
    path = tmp_path / "path.json"
    assert bpy.ops.viewcam.export_cameras(filepath=str(path), format="transforms", which="FRAMES") == {"FINISHED"}
    assert (scene.frame_current, scene.frame_subframe) == (3, 0.25)
    written = formats.read(path)
    assert [camera.pinhole.eye for camera in written] == [camera.pinhole.eye for camera in pinholes[1:]]
    assert all((camera.pinhole.width, camera.pinhole.height) == (640, 360) for camera in written)
