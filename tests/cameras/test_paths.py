"""Paths of cameras as other programs fly them: SuperSplat, Google Earth Studio, After Effects' scripts of Blender's add-on.

Thousands of poses at once are those that are made one by one.
"""

import dataclasses
import io
import json
import math
import re
import zipfile

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Options, axes
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

from .conftest import CAMERAS, PLAIN

SIZE = Options(size=(1920, 1080))


def rotation():
    return pytest.importorskip("scipy.spatial.transform").Rotation


def aimed(camera, points):
    """Columns and rows from the top of points, by the camera."""
    column, row, _ = camera.pinhole.project(np.asarray(points, dtype=float))
    return np.column_stack([column, camera.pinhole.height - row])


# ---- SuperSplat


def supersplat_project():
    poses = [
        {"name": "camera_1", "frame": 60, "position": [2, 1, 3], "target": [0, 0.5, 0], "fov": 40},
        {"name": "camera_0", "frame": 0, "position": [0, 1, 4], "target": [0, 0, 0]},
    ]
    timeline = {"frames": 180, "frameRate": 24, "frame": 0}
    return {"version": 0, "camera": {"fov": 65}, "timeline": timeline, "poseSets": [{"name": "set0", "poses": poses}]}


def supersplat_viewer():
    values = {"position": [0, 1, 4, 2, 1, 3], "target": [0, 0, 0, 0, 0.5, 0], "fov": [65, 40]}
    track = {"name": "cameraAnim", "frameRate": 24, "keyframes": {"times": [0, 60], "values": values}}
    return {
        "version": 2,
        "animTracks": [track],
        "cameras": [{"initial": {"position": [0, 1, -1], "target": [0, 0, 0], "fov": 60}}],
    }


def ssproj(document):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("splat_0.ply", "ply")
        archive.writestr("document.json", json.dumps(document))
    return packed.getvalue()


@pytest.mark.parametrize("size", [(1920, 1080), (1080, 1920)])
def test_supersplats_field_of_view_is_that_of_the_longer_side(size):
    read = cameras.read(json.dumps(supersplat_project()), options=Options(size=size))
    assert [camera.name for camera in read] == ["camera_0", "camera_1"] and [camera.time for camera in read] == [0, 2.5]
    first, second = read
    assert first.pinhole.distance[0] == pytest.approx(960 / math.tan(math.radians(32.5)), rel=1e-14)
    assert second.pinhole.distance[0] == pytest.approx(960 / math.tan(math.radians(20)), rel=1e-14)
    # PlayCanvas' camera at (0, 1, 4) that looks at the origin, upright: a point above its target is above the middle.
    seen = aimed(first, [[0, 0, 0], [0, 1, 0], [1, 0, 0]]) - [size[0] / 2, size[1] / 2]
    assert abs(seen[0]).max() < 1e-9 and abs(seen[1, 0]) < 1e-9 and seen[1, 1] < 0 < seen[2, 0] and not first.size_stated


def test_supersplats_project_and_its_viewers_settings_are_the_same_path(tmp_path):
    (tmp_path / "a.ssproj").write_bytes(ssproj(supersplat_project()))
    (tmp_path / "settings.json").write_text(json.dumps(supersplat_viewer()))
    project, viewer = (cameras.read(tmp_path / name, options=SIZE) for name in ("a.ssproj", "settings.json"))
    assert [(c.pinhole, c.time) for c in project] == [(c.pinhole, c.time) for c in viewer]
    assert any("spline" in note for note in project[0].notes)


@pytest.mark.parametrize("cameras_key", ["cameras", "camera"])
def test_a_page_of_supersplat_without_a_path_has_the_view_that_it_starts_with(cameras_key):
    settings = supersplat_viewer() | {"animTracks": []}
    start = settings.pop("cameras")
    settings |= {"cameras": start} if cameras_key == "cameras" else {"camera": start[0]["initial"]}
    (camera,) = cameras.read(json.dumps(settings), options=SIZE)
    assert (camera.pinhole.eye, camera.pinhole.look_at, camera.time) == ((0, 1, -1), (0, 0, 0), None)


def test_supersplats_own_reader_of_cameras_json_turns_the_world_as_the_original_world_turns_it_back():
    """loadCameraPoses makes (−x, −y, z) of the eye and of the point 10 before it: of training's camera of the same picture."""
    turn = rotation().from_rotvec([0.4, 2.9, 0.0]).as_matrix()  # x right, y down, z into the view
    eye, ahead = np.array([1.0, -2.0, 3.0]), turn[:, 2]
    pose = {"name": "a", "frame": 0, "position": (eye * [-1, -1, 1]).tolist(), "fov": 50}
    pose["target"] = ((eye + 10 * ahead) * [-1, -1, 1]).tolist()
    (camera,) = cameras.read(
        json.dumps({"poseSets": [{"poses": [pose]}]}), options=Options(size=(640, 360), original_world=True)
    )
    assert camera.pinhole.eye == tuple(eye) and camera.pinhole.look_at == pytest.approx(tuple(eye + 10 * ahead))
    assert camera.pinhole.up == (0, -1, 0) and not any("turned" in note for note in camera.notes)


# ---- Google Earth Studio


def heading_pitch(heading, pitch):
    """Right, down and forward in east, north, up, by their definition."""
    h, p = math.radians(heading), math.radians(pitch)
    forward = np.array([math.sin(h) * math.cos(p), math.cos(h) * math.cos(p), math.sin(p)])
    right = np.array([math.cos(h), -math.sin(h), 0.0])
    return np.column_stack([right, np.cross(forward, right), forward])


PUBLISHED_FRAMES = [  # latitude, longitude, altitude; heading and pitch of which they were made; rotation; digits of that
    ((33.9165151812, 0.0, 1725.0), (0, -90), (180, -56.0834848188, -89.9999999998), 1e-9),
    (
        (31.23933153689792, 121.73286024286688, 20695),
        (270.12, -44.61),
        (159.34465662912814, 67.17562316976208, 45.669011717197826),
        1e-4,
    ),
]


def earth_studio(position, coordinate=PUBLISHED_FRAMES[1][0], turn=PUBLISHED_FRAMES[1][2], count=3):
    frame = {
        "position": dict(zip("xyz", map(float, position), strict=True)),
        "rotation": dict(zip("xyz", turn, strict=True)),
        "coordinate": dict(zip(("latitude", "longitude", "altitude"), coordinate, strict=True)),
        "fovVertical": 20.0,
    }
    return {"name": "a", "width": 1920, "height": 1080, "numFrames": 60, "durationSeconds": 2, "cameraFrames": [frame] * count}


@pytest.mark.parametrize(("coordinate", "angles", "turn", "digits"), PUBLISHED_FRAMES)
def test_earth_studios_published_frames_look_where_they_were_made_to(coordinate, angles, turn, digits):
    read = cameras.read(json.dumps(earth_studio((10, 20, 30), coordinate, turn)))
    u, v, w = read[0].pinhole.axes()
    error = np.abs(np.column_stack([u, np.negative(v), np.negative(w)]) - heading_pitch(*angles)).max()
    assert error < digits, f"{error}"  # published are two decimals of heading and pitch, and all digits of the first
    assert [camera.time for camera in read] == [0, 1 / 30, 2 / 30]
    assert read[0].pinhole.distance[1] == pytest.approx(540 / math.tan(math.radians(10)), rel=1e-14)


def test_earth_studios_origin_is_the_tracks_or_the_point_below_the_first_camera():
    latitude, longitude, altitude = PUBLISHED_FRAMES[1][0]
    turn = (
        rotation().from_euler("ZY", [longitude, 90 - latitude], degrees=True).as_matrix()
    )  # south, east, up, along the Earth's
    south, east, up = turn.T
    local = 3 * east - 4 * south + 5 * up
    (camera, *_) = cameras.read(json.dumps(earth_studio(local)))
    assert camera.pinhole.eye == pytest.approx((3, 4, 5), abs=1e-12)
    (camera, *_) = cameras.read(json.dumps(earth_studio((6_371_010 + altitude) * up)))
    assert camera.pinhole.eye == pytest.approx((0, 0, altitude), abs=1e-8)  # float64 of the Earth's radius, 1e-9
    (camera, *_) = cameras.read(json.dumps(earth_studio(local)), options=Options(original_world=True))
    assert camera.pinhole.eye == pytest.approx(tuple(local), abs=1e-12)
    axes = rotation().from_euler("XYZ", PUBLISHED_FRAMES[1][2], degrees=True).as_matrix()
    assert np.abs(np.column_stack(camera.pinhole.axes()) - axes * [1, -1, -1]).max() < 1e-14


# ---- After Effects


AFTER_EFFECTS = """#target AfterEffects
function compFromBlender(){
var compName = prompt("Blender Comp's Name \\nEnter Name of newly created Composition","BlendComp","Composition's Name");
if (compName){
var newComp = app.project.items.addComp(compName, 1920, 1080, 1.000000, 10.416667, 24);
newComp.displayStartTime = 0.083333;


// **************  CAMERAS  **************


var _Camera = newComp.layers.addCamera("_Camera",[0,0]);
_Camera.autoOrient = AutoOrientType.NO_AUTO_ORIENT;
_Camera.property("position").setValue([842.057643,234.247770,-661.919546],);
_Camera.property("orientation").setValue([-13.355961,0.000111,0.000038],);
_Camera.property("zoom").setValue(2100.000000,);

}else{alert ("Exit Import Blender animation data \\nNo Comp's name has been chosen","EXIT")};}
"""
"""A script of Blender's add-on, as somebody published it in 2012."""


def test_the_addons_script_is_the_camera_of_blender_that_it_was_made_of():
    (camera,) = cameras.read(AFTER_EFFECTS, options=Options(axes="y_down", scale=0.01))
    place = ((842.057643 - 960) / 100, -661.919546 / 100, -(234.247770 - 540) / 100)  # convert_transform_matrix, backwards
    assert camera.pinhole.eye == pytest.approx(place, abs=1e-12) and camera.notes == ()
    angles = (-13.355961 + 90, -0.000111, -0.000038)
    blender = rotation().from_euler("XYZ", angles, degrees=True).as_matrix()  # mathutils' ZYX is Rx Ry Rz
    assert np.abs(np.column_stack(camera.pinhole.axes()) - blender).max() < 1e-14
    assert (camera.name, camera.pinhole.distance, camera.pinhole.width, camera.pinhole.height) == (
        "_Camera",
        (2100, 2100),
        1920,
        1080,
    )
    assert any("y_down and a scale of 0.01" in note for note in cameras.read(AFTER_EFFECTS)[0].notes)


def test_a_value_holds_until_its_next_keyframe():
    text = AFTER_EFFECTS.replace(
        "setValue([842.057643,234.247770,-661.919546],);",
        "setValuesAtTimes([0.0,0.5,1.0],[[960,540,0],[961,540,0],[962,540,0]]);",
    ).replace("setValue(2100.000000,);", "setValuesAtTimes([0.0,0.75],[2100.0,1050.0]);")
    read = cameras.read(text)
    assert [camera.time for camera in read] == [0, 0.5, 0.75, 1]
    assert [camera.pinhole.eye[0] for camera in read] == [0, 1, 1, 2]
    assert [camera.pinhole.distance[0] for camera in read] == [2100, 2100, 1050, 1050]


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("1080, 1.000000", "1080, 1.5", "square pixels"),
        ('_Camera.property("zoom").setValue(2100.000000,);', "", "no zoom"),
        ("setValue(2100.000000,);", "setValue(0.0,);", "zoom of _Camera is 0"),
        ("661.919546],", "661.919546, 7],", "4 numbers"),
        ('property("zoom").setValue(2100.000000,);', 'property("rotationX").setValue(2,);', "first versions"),
    ],
)
def test_a_script_that_says_no_camera_is_refused(old, new, sentence):
    assert old in AFTER_EFFECTS
    with pytest.raises(InputError, match=re.escape(sentence)):
        cameras.read(AFTER_EFFECTS.replace(old, new))


def test_matrices_at_once_are_the_pinholes_and_the_notes_of_each():
    pinholes = [*CAMERAS.values()]  # mirrored ones among them, which are told
    matrices = np.array([axes.camera_to_world(pinhole) for pinhole in pinholes])[:, :3]
    matrices[0, :, :3] *= 1.5  # a scale, which is told
    matrices[1, 0, 1] += 5e-4  # few digits, likewise
    planes, names = [pinhole.plane for pinhole in pinholes], [*CAMERAS]
    together = axes.pinholes(matrices, planes, names)
    apart = [axes.pinhole(*each) for each in zip(matrices, planes, names, strict=True)]
    assert [notes for _, notes in together] == [notes for _, notes in apart]
    assert [bool(notes) for _, notes in together] == [
        name in names[:2] or pinhole.mirrored for name, pinhole in CAMERAS.items()
    ]
    for (first, _), (other, _) in zip(together, apart, strict=True):
        assert (first.eye, first.plane, first.mirrored) == (other.eye, other.plane, other.mirrored)
        assert np.abs(np.array(first.axes()) - other.axes()).max() < 2e-15
    matrices[4, :, 0] *= 2
    with pytest.raises(InputError, match=f"{names[4]} has axes of the lengths 2 by 1 by 1"):
        axes.pinholes(matrices, planes, names)


def test_pinholes_of_arrays_are_those_of_the_constructor():
    pinholes = [dataclasses.replace(pinhole, mirrored=False) for pinhole in CAMERAS.values()]
    points = [[getattr(pinhole, name) for pinhole in pinholes] for name in ("eye", "look_at", "up")]
    many = Pinhole.of_poses(*points, [pinhole.plane for pinhole in pinholes])
    assert many == pinholes and [hash(each) for each in many] == [hash(each) for each in pinholes]
    assert [each.axes() for each in many] == [each.axes() for each in pinholes]
    assert repr(dataclasses.replace(many[0], width=7)) == repr(dataclasses.replace(pinholes[0], width=7))
    points[0][2] = points[1][2]
    with pytest.raises(InputError, match="pose 2: "):
        Pinhole.of_poses(*points, [pinhole.plane for pinhole in pinholes])


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("3 1 2 x 0 0 0 1", "line 32 of"),
        ("3 1 2 3 0 0 0", "line 32 of .* has 7 numbers and others have 8"),
        ("3 1 2 3 0 0 0 1e999", "line 32 of"),
        ("3 1 2 nan 0 0 0 1", "line 32 of"),
        ("3 1 2 3 0 0 1 1", "quaternion of pose 30 has the length 1.41421"),
    ],
)
def test_a_wrong_line_of_a_trajectory_is_named(tmp_path, line, sentence):
    path = tmp_path / "groundtruth.txt"
    right = "".join(f"{second} 1 2 3 0 0 0 1\n" for second in range(30))  # by more lines than it is recognized by
    path.write_text(f"# timestamp tx ty tz qx qy qz qw\n{right}{line}\n")
    with pytest.raises(InputError, match=sentence):
        cameras.read(path, format="trajectories", options=Options(base=PLAIN))
