"""Labels beside a batch's shots of an animated scene: they agree with the sidecars' cameras, and disturb no picture."""

import json
import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import image
from viewcam_addon.blender.jobs import scene_files
from viewcam_addon.blender.jobs.renderer import BlenderRenderer
from viewcam_addon.jobs.folder import Folder, Outputs
from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.one import render_one
from viewcam_addon.pinhole import Pinhole

pytestmark = pytest.mark.usefixtures("one_process")

ALLOWED = 1e-3
"""Pixels: what flow may differ by where depths are float32."""

SLOPE = 0.25
STATED = Job("stated", eye=(-3.0, -6.0, 2.5), look_at=(0.0, 0.0, 0.5), up=(0.0, 0.0, 1.0), d=90.0, frame=2)
FRAMES = [Job(f"frame_{number}", camera="Camera", frame=number) for number in (1, 2, 3)]
ALL = Outputs(picture=False, labels=("depth", "masks", "amodal", "flow"))


@pytest.fixture
def stage(fresh_blender, scene):
    """A sheet that tilts by a shape key, a monkey that turns and goes, a cube that stands, and a camera that goes: 1 … 3."""
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.render.resolution_x, scene.render.resolution_y = 96, 54
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=6, y_subdivisions=5, size=8, location=(0, 0, -0.5))
    sheet = bpy.context.object
    sheet.name = "Sheet"
    sheet.shape_key_add(name="Basis")
    tilted = sheet.shape_key_add(name="Tilted")
    for point in tilted.data:
        point.co.z += SLOPE * point.co.x
    for frame in (1, 2, 3):
        tilted.value = 0.5 * (frame - 1)
        tilted.keyframe_insert("value", frame=frame)
    bpy.ops.mesh.primitive_monkey_add(location=(0, 0, 1))
    monkey = bpy.context.object
    bpy.ops.mesh.primitive_cube_add(location=(2, 1.5, 0.5))
    data = bpy.data.cameras.new("Camera")
    camera = scene.camera = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(camera)
    for frame in (1, 2, 3):
        monkey.location.x, monkey.rotation_euler.z = 0.3 * frame, 0.1 * frame
        camera.location, camera.rotation_euler = (0.2 * frame, -7, 2 + 0.1 * frame), (math.radians(80), 0, 0.02 * frame)
        for owner in (monkey, camera):
            owner.keyframe_insert("location", frame=frame)
            owner.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(1)
    return scene


def shoot(path, shots, outputs):
    folder = Folder(path)
    with BlenderRenderer() as renderer:
        return {shot.name: render_one(shot, folder, renderer, "a hash", outputs) for shot in shots}


def read_labels(path, name):
    """The labels of a shot: their picture, and the instances of its labels.json by name."""
    document = json.loads((path / f"{name}.labels.json").read_text())
    return image.read(path / f"{name}.labels.exr"), {each["name"]: each for each in document["instances"]}


def world_points(passes, camera):
    """(height, width, 3) of a depth pass, rows from the bottom, by nothing but the four values."""
    u, v, w = camera.basis()
    rows, columns = np.mgrid[0 : camera.height, 0 : camera.width] + 0.5
    x, y = camera.view_plane(columns, rows)
    return np.array(camera.eye) + passes["Depth"].astype(float) * (x[..., None] * u + y[..., None] * v - w)


def flow_to(there, points, rows, columns):
    """Pixels right and down."""
    column, row, _ = there.project(points)
    return np.stack([column - columns - 0.5, rows + 0.5 - row], -1)


@pytest.mark.parametrize(("here", "there", "name"), [(1, 2, "Forward"), (2, 1, "Backward"), (2, 3, "Forward")])
def test_flow_of_a_batch_is_that_of_depth_and_the_sidecars_poses(stage, tmp_path, here, there, name):
    """Rigid things by their matrices in the other frame's labels, the sheet by its slope there."""
    records = shoot(tmp_path, FRAMES, ALL)
    cameras = {number: Pinhole(**records[f"frame_{number}"]["camera"]) for number in (here, there)}
    passes, instances = read_labels(tmp_path, f"frame_{here}")
    _, others = read_labels(tmp_path, f"frame_{there}")
    points = world_points(passes, cameras[here])
    compared = 0
    for which, instance in instances.items():
        seen = (passes["Instance"][..., 0] == instance["id"]) & (passes[f"{name} Hidden"][..., 0] == 0)
        before, after = (np.array(each[which]["object_to_world"]) for each in (instances, others))
        local = (points[seen] - before[:3, 3]) @ np.linalg.inv(before[:3, :3]).T
        if which == "Sheet":
            local[:, 2] += SLOPE * 0.5 * (there - here) * local[:, 0]
        moved = local @ after[:3, :3].T + after[:3, 3]
        rows, columns = np.nonzero(seen)
        difference = np.abs(flow_to(cameras[there], moved, rows, columns) - passes[f"{name} Flow"][seen])
        assert difference.max() < ALLOWED, f"{which}: {difference.max()} pixels"
        compared += seen.sum()
    assert compared > 0.4 * passes["Depth"].size and set(instances) == {"Sheet", "Suzanne", "Cube"}


def test_the_camera_of_four_values_stands_still_in_the_other_frames(stage, tmp_path):
    shoot(tmp_path, [STATED], ALL)
    passes, instances = read_labels(tmp_path, "stated")
    seen = passes["Instance"][..., 0] == instances["Cube"]["id"]
    assert seen.sum() > 50 and np.abs(passes["Forward Flow"][seen]).max() < 1e-9
    assert np.abs(passes["Forward Flow"][passes["Instance"][..., 0] == instances["Suzanne"]["id"]]).max() > 1


def test_an_instance_has_one_id_in_all_shots_and_what_its_properties_say(stage, tmp_path):
    monkey, nose = stage.objects["Suzanne"], bpy.data.objects.new("Empty", None)
    stage.collection.objects.link(nose)
    nose.parent, nose.location, nose["keypoint"], monkey["category"] = monkey, (0, -0.7, 0.1), "nose", "ape"
    records = shoot(tmp_path, [*FRAMES, STATED], Outputs(picture=False, labels=("masks",)))
    ids = [{name: each["id"] for name, each in read_labels(tmp_path, shot.name)[1].items()} for shot in (*FRAMES, STATED)]
    assert ids[0] == ids[1] == ids[2] == ids[3] and len(set(ids[0].values())) == 3
    ape = read_labels(tmp_path, "frame_2")[1]["Suzanne"]
    camera, matrix = Pinhole(**records["frame_2"]["camera"]), np.array(ape["object_to_world"])
    column, row, _ = camera.project(matrix[:3, :3] @ (0, -0.7, 0.1) + matrix[:3, 3])
    (point,) = ape["keypoints"]
    assert (ape["category"], point["name"], point["visible"]) == ("ape", "nose", 2)
    assert np.hypot(point["x"] - column, camera.height - point["y"] - row) < ALLOWED


def test_a_joint_hangs_on_the_next_empty_above_it_or_on_that_of_the_next_bone(stage, tmp_path):
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    stage.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bones = [armature.data.edit_bones.new(name) for name in ("arm", "forearm", "hand")]
    for i, bone in enumerate(bones):
        bone.head, bone.tail, bone.parent = (i, 0, 0), (i + 1, 0, 0), bones[i - 1] if i else None
    bpy.ops.object.mode_set(mode="OBJECT")
    stage.objects["Suzanne"].modifiers.new("Rig", "ARMATURE").object = armature

    def joint(name, parent, bone=None):
        empty = bpy.data.objects.new("Empty", None)
        stage.collection.objects.link(empty)
        empty["keypoint"], empty.parent = name, parent
        if bone:
            empty.parent_type, empty.parent_bone = "BONE", bone
        return empty

    joint("elbow", armature, "arm")
    wrist = joint("wrist", armature, "hand")  # the bone between has no joint
    joint("thumb", wrist)
    joint("root", armature)
    shoot(tmp_path, [STATED], Outputs(picture=False, labels=("masks",)))
    points = read_labels(tmp_path, "stated")[1]["Suzanne"]["keypoints"]
    above = {point["name"]: point.get("parent") for point in points}
    assert above == {"elbow": None, "wrist": "elbow", "thumb": "wrist", "root": None}


def test_pictures_are_the_same_bytes_with_and_without_labels_and_the_scene_is_as_before(stage, tmp_path):
    shots = [FRAMES[0], FRAMES[2], STATED]
    shoot(tmp_path / "with", shots, Outputs(labels=ALL.labels))
    shoot(tmp_path / "without", shots, Outputs())
    for shot in shots:
        for ending in ("exr", "png"):
            first, other = ((tmp_path / kind / f"{shot.name}.{ending}").read_bytes() for kind in ("with", "without"))
            assert first == other, f"{shot.name}.{ending}"
    assert (stage.frame_current, stage.camera.name) == (1, "Camera")


def test_labels_alone_are_those_beside_a_picture_and_nothing_is_rendered(stage, tmp_path, monkeypatch):
    from viewcam_addon.blender.jobs import renderer

    shoot(tmp_path / "with", FRAMES[:1], Outputs(labels=ALL.labels))

    def refused(*_):
        raise AssertionError("an engine renders")

    monkeypatch.setattr(renderer, "render_still", refused)
    shoot(tmp_path / "alone", FRAMES[:1], ALL)
    names = [path.name for path in (tmp_path / "alone").iterdir() if path.name != "frame_1.json"]
    assert len(names) == 9
    for name in names:
        assert (tmp_path / "alone" / name).read_bytes() == (tmp_path / "with" / name).read_bytes(), name


def test_a_scene_that_stands_is_read_once_for_labels(stage, tmp_path, monkeypatch):
    exported, export = [], scene_files.export_scene
    monkeypatch.setattr(scene_files, "export_scene", lambda *arguments: exported.append(1) or export(*arguments))
    shots = [Job(f"shot_{x}", eye=(x, -6, 2), look_at=(0, 0, 0.5), up=(0, 0, 1), d=90) for x in range(4)]
    shoot(tmp_path, shots, Outputs(picture=False, labels=("depth",)))
    assert len(exported) == 1
    depths = [image.read(tmp_path / f"{shot.name}.labels.exr")["Depth"] for shot in shots]
    assert not np.array_equal(depths[0], depths[1])


def test_flow_along_an_animation_reads_each_frame_once(stage, tmp_path, monkeypatch):
    exported, export = [], scene_files.export_scene
    monkeypatch.setattr(scene_files, "export_scene", lambda *arguments: exported.append(1) or export(*arguments))
    shoot(tmp_path, FRAMES, ALL)
    assert len(exported) == 5, "frames 0 to 4"
