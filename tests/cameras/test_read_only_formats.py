"""Formats that are only read: files made here by each format's own rule, from the camera's axes alone, are the same camera."""

import json
import math
import re
import struct

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Options
from viewcam_addon.errors import InputError
from viewcam_addon.intrinsics import ViewPlane

from .conftest import CAMERAS, allowed, picture_error, points_before

UNMIRRORED = [name for name, pinhole in CAMERAS.items() if not pinhole.mirrored]
ONE_FOCAL = [name for name in UNMIRRORED if CAMERAS[name].distance[0] == CAMERAS[name].distance[1]]
CENTERED = [name for name in ONE_FOCAL if CAMERAS[name].principal_point == (CAMERAS[name].width / 2, CAMERAS[name].height / 2)]


class Known:
    """A camera in the terms in which formats are explained: axes as rows of the world, numbers from the top."""

    def __init__(self, name):
        self.pinhole = CAMERAS[name]
        self.u, self.v, self.w = (np.array(axis) for axis in self.pinhole.axes())
        self.e = np.array(self.pinhole.eye)
        self.width, self.height = self.pinhole.width, self.pinhole.height
        self.f_x, self.f_y = self.pinhole.distance
        self.c_x, self.c_y = self.pinhole.principal_point[0], self.height - self.pinhole.principal_point[1]
        self.opencv = np.array([self.u, -self.v, -self.w])  # world to camera
        self.opengl = np.column_stack([self.u, self.v, self.w, self.e])  # camera to world

    def quaternion(self):
        """x, y, z, w of OpenCV's camera to world, by scipy."""
        rotation = pytest.importorskip("scipy.spatial.transform").Rotation
        return rotation.from_matrix(self.opencv.T).as_quat().tolist()


def the_same(read, known, unit=2.0**-50):
    (camera,) = read
    points = points_before(known.pinhole)
    column, row, _ = camera.pinhole.project(points)
    limit = max(1e-3, allowed(known.pinhole, points, unit))
    error = picture_error(known.pinhole, column, row, points)
    assert error <= limit, f"{error:.3g} pixels, {limit:.3g} are allowed"
    assert (camera.pinhole.width, camera.pinhole.height, camera.pinhole.mirrored) == (known.width, known.height, False)
    return camera


def text_of(numbers):
    return " ".join(map(repr, np.asarray(numbers, dtype=float).ravel().tolist()))


@pytest.mark.parametrize("name", ONE_FOCAL)
def test_fspy_counts_in_halves_of_the_longer_side(tmp_path, name):
    known = Known(name)
    half = max(known.width, known.height) / 2
    camera = {
        "principalPoint": {
            "x": (known.c_x - known.width / 2) / half,
            "y": (known.height / 2 - known.c_y) / half,
        },
        "cameraTransform": {"rows": [*known.opengl.tolist(), [0, 0, 0, 1]]},
        "relativeFocalLength": known.f_x / half,
        "imageWidth": known.width,
        "imageHeight": known.height,
    }
    state = json.dumps({"cameraParameters": camera, "calibrationSettingsBase": {"referenceDistanceUnit": "Feet"}}).encode()
    picture = b"\x89PNG picture"
    (tmp_path / "house.fspy").write_bytes(b"fspy" + struct.pack("<III", 1, len(state), len(picture)) + state + picture)
    read = the_same(cameras.read(tmp_path / "house.fspy"), known)
    assert read.picture == picture and read.name == "house" and "feet" in read.notes[0]


FSPY_EXPORTED = {  # by fSpy, of a photograph that somebody published with it
    "principalPoint": {"x": 0, "y": 0},
    "cameraTransform": {
        "rows": [
            [-0.9734138207025481, 0.04196681158657723, -0.22517619854355045, -0.6959172306086093],
            [0.0965054651828195, -0.8164170790874036, -0.5693415918095569, -4.4653045032151235],
            [-0.2077311456068041, -0.5759357079567556, 0.7906616415668815, 9.234054171727681],
            [0, 0, 0, 1],
        ]
    },
    "horizontalFieldOfView": 1.3678550657796624,
    "verticalFieldOfView": 1.097495385241209,
    "vanishingPoints": [
        {"x": 0.3222986638911469, "y": 0.8935747627994785},
        {"x": -5.303011682125709, "y": 0.22862885996889182},
        {"x": 0.20793450169726774, "y": -1.7590846093077017},
    ],
    "vanishingPointAxes": ["zNegative", "xPositive", "yNegative"],
    "relativeFocalLength": 1.2267259679457512,
    "imageWidth": 4032,
    "imageHeight": 3024,
}


@pytest.mark.parametrize("left_out", ["horizontalFieldOfView", "relativeFocalLength"])
@pytest.mark.parametrize("wrapped", [False, True])
def test_what_fspy_exports_sees_its_axes_at_its_vanishing_points(left_out, wrapped):
    exported = {key: value for key, value in FSPY_EXPORTED.items() if key != left_out}
    (camera,) = cameras.read(json.dumps({"cameraParameters": exported} if wrapped else exported))
    assert camera.size_stated
    signs = {"zNegative": (0, 0, -1), "xPositive": (1, 0, 0), "yNegative": (0, -1, 0)}
    for point, axis in zip(exported["vanishingPoints"], exported["vanishingPointAxes"], strict=True):
        direction = np.array(signs[axis], float)
        toward = direction * np.sign(direction @ np.subtract(camera.pinhole.look_at, camera.pinhole.eye))
        column, row, _ = camera.pinhole.project((camera.pinhole.eye + 1e12 * toward)[None])
        there = 2016 + 2016 * point["x"], 1512 + 2016 * point["y"]  # in halves of the longer side
        assert math.hypot(column[0] - there[0], row[0] - there[1]) < 1e-3 * math.hypot(*there)


def test_fspys_principal_point_of_a_portrait_counts_in_halves_of_its_height():
    exported = FSPY_EXPORTED | {"imageWidth": 3024, "imageHeight": 4032, "principalPoint": {"x": 0.25, "y": -0.5}}
    (camera,) = cameras.read(json.dumps(exported))
    assert camera.pinhole.principal_point == (1512 + 504, 2016 - 1008)


def metashape(known, lens="", label="left.jpg"):
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])  # the chunk's, with a scale of 2.5 and a move
    moved = np.array([1.0, 2.0, 3.0])
    local = np.eye(4)
    local[:3, :3] = turn.T @ known.opencv.T
    local[:3, 3] = turn.T @ (known.e - moved) / 2.5
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<document version="1.2.0"><chunk label="Chunk 1"><sensors><sensor id="0" label="unknown" type="frame">
<resolution width="{known.width}" height="{known.height}"/><calibration type="frame" class="adjusted">
<resolution width="{known.width}" height="{known.height}"/><f>{known.f_y!r}</f><b1>{known.f_x - known.f_y!r}</b1>
<cx>{known.c_x - known.width / 2!r}</cx><cy>{known.c_y - known.height / 2!r}</cy>{lens}</calibration></sensor></sensors>
<cameras><camera id="0" label="{label}" sensor_id="0"><transform>{text_of(local)}</transform></camera>
<camera id="1" label="lost.jpg" sensor_id="0"/></cameras>
<transform><rotation>{text_of(turn)}</rotation><translation>{text_of(moved)}</translation><scale>2.5</scale></transform>
</chunk></document>"""


ENCODINGS = [
    ("UTF-8", "utf-8", ""),
    ("UTF-8", "utf-8-sig", ""),
    ("UTF-16", "utf-16", ""),
    ("UTF-16", "utf-16-le", ""),
    ("UTF-16", "utf-16-be", ""),
    ("ISO-8859-1", "latin-1", ""),
    ("latin1", "latin-1", ""),
    ("windows-1252", "cp1252", ""),
    ("UTF-8", "latin-1", "is not written in it"),
    ("US-ASCII", "latin-1", "is not written in it"),
    ("UTF-16", "utf-8", "is not written in it"),
    ("ISO-8859-1", "utf-16", "is not written in it"),
    ("UTF-99", "utf-8", "unknown"),
    ("rot13", "utf-8", "unknown"),
    ("unicode_escape", "utf-8", "unknown"),
]


@pytest.mark.parametrize(("declared", "written", "problem"), ENCODINGS)
def test_xml_is_read_in_the_encoding_that_it_declares(tmp_path, declared, written, problem):
    text = metashape(Known("plain"), label="für.jpg").replace("UTF-8", declared)
    path = tmp_path / "cameras.xml"
    path.write_bytes(text.encode(written))
    if not problem:
        assert the_same(cameras.read(path), Known("plain")).image == "für.jpg"
        return
    with pytest.raises(InputError, match=f"cameras.xml says that its encoding is '{declared}'.*{problem}"):
        cameras.read(path)


@pytest.mark.parametrize("declared", ["UTF-16", "ISO-8859-1", "UTF-99"])
def test_xml_from_the_clipboard_is_characters_whatever_it_declares(declared):
    text = metashape(Known("plain"), label="für.jpg").replace("UTF-8", declared)
    assert the_same(cameras.read(text), Known("plain")).image == "für.jpg"


@pytest.mark.parametrize("name", UNMIRRORED)
def test_metashape_stands_in_its_chunk(name):
    read = the_same(cameras.read(metashape(Known(name))), Known(name))
    assert read.name == "left" and read.image == "left.jpg" and any("not aligned" in note for note in read.notes)


def test_metashapes_chunk_says_once_more_where_its_component_stands():
    text = metashape(Known("plain")).replace('<camera id="0"', '<camera id="0" component_id="0"')
    placed = text[text.index("<transform><rotation>") : text.index("</chunk>")]
    components = f'<components><component id="0" active="true">{placed}</component><component id="1"/></components>'
    text = text.replace("</cameras>", f"</cameras>{components}")
    the_same(cameras.read(text), Known("plain"))
    with pytest.raises(InputError, match=r"component '1', of which .* is, has no transform"):
        cameras.read(text.replace('component_id="0"', 'component_id="1"'))


def test_metashapes_distortion_is_kept_and_told_with_its_pixels_or_left_out():
    known = Known("plain")
    text = metashape(known, "<k1>-0.1</k1><p1>0.001</p1>")
    (bent,) = cameras.read(text)
    assert bent.lens.radial[0] == -0.1 and bent.lens.tangential == (0, 0.001)  # Metashape's p1 is OpenCV's p2
    assert any(re.search(r"moves the picture's corner by [\d.]+ pixels", note) for note in bent.notes)
    (camera,) = cameras.read(text, options=Options(without_distortion=True))
    assert any("left out" in note and "pixels" in note for note in camera.notes)


@pytest.mark.parametrize("name", UNMIRRORED)
def test_reality_capture_counts_in_the_longer_side(name):
    known = Known(name)
    longer = max(known.width, known.height)
    text = f"""<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:Version="3" xcr:PosePrior="exact"
 xcr:DistortionModel="brown3" xcr:FocalLength35mm="{known.f_x / longer * 36!r}" xcr:Skew="0"
 xcr:AspectRatio="{known.f_y / known.f_x!r}" xcr:PrincipalPointU="{(known.c_x - known.width / 2) / longer!r}"
 xcr:PrincipalPointV="{(known.c_y - known.height / 2) / longer!r}">
<xcr:Rotation>{text_of(known.opencv)}</xcr:Rotation><xcr:Position>{text_of(known.e)}</xcr:Position>
<xcr:DistortionCoeficients>0 0 0 0 0 0</xcr:DistortionCoeficients></rdf:Description></rdf:RDF></x:xmpmeta>"""
    the_same(cameras.read(text, options=Options(size=(known.width, known.height))), known)


def meshroom(known):
    return {
        "version": ["1", "2", "11"],
        "views": [{"viewId": "7", "poseId": "7", "intrinsicId": "3", "path": "/photos/a.b.jpg"}],
        "intrinsics": [
            {
                "intrinsicId": "3",
                "width": str(known.width),
                "height": str(known.height),
                "sensorWidth": "36",
                "type": "pinhole",
                "focalLength": repr(known.f_y / known.width * 36),
                "pixelRatio": repr(known.f_y / known.f_x),
                "principalPoint": [repr(known.c_x - known.width / 2), repr(known.c_y - known.height / 2)],
                "distortionType": "none",
            }
        ],
        "poses": [
            {
                "poseId": "7",
                "pose": {
                    "transform": {
                        "rotation": [repr(float(x)) for x in known.opencv.T.ravel()],
                        "center": [repr(float(x)) for x in known.e],
                    }
                },
            }
        ],
    }


@pytest.mark.parametrize("name", UNMIRRORED)
def test_meshroom_lists_its_rotation_column_by_column(name):
    read = the_same(cameras.read(json.dumps(meshroom(Known(name)))), Known(name))
    assert read.name == "a.b" and read.image == "/photos/a.b.jpg"


@pytest.mark.parametrize(
    ("version", "f_y"), [("1.2.3", 1000 / 0.5), ("1.2.4", 1000 / 0.5), ("1.2.5", 1000 * 0.5), ("1.2.10", 1000 * 0.5)]
)
def test_meshrooms_ratio_of_pixels_was_the_other_way_round_before_1_2_5(version, f_y):
    """aliceVision/sfmDataIO/jsonIO.cpp; from 1.2.11 on the focal length is that of the height."""
    sfm = meshroom(Known("plain")) | {"version": version.split(".")}
    (intrinsic,) = sfm["intrinsics"]
    intrinsic |= {"focalLength": repr(1000 / Known("plain").width * 36), "pixelRatio": "0.5"}
    (camera,) = cameras.read(json.dumps(sfm))
    assert camera.pinhole.distance == pytest.approx((1000, f_y), rel=4 * 2**-53)


def test_meshrooms_cameras_of_a_rig_are_refused():
    sfm = meshroom(Known("plain"))
    sfm["views"][0] |= {"rigId": "5", "subPoseId": "1", "isPoseIndependant": "false"}
    with pytest.raises(InputError, match="rig"):
        cameras.read(json.dumps(sfm))


@pytest.mark.parametrize("name", ONE_FOCAL)
def test_openmvg_names_a_type_once_and_numbers_it_then(name):
    known = Known(name)
    data = {"width": known.width, "height": known.height, "focal_length": known.f_x, "principal_point": [known.c_x, known.c_y]}
    lens = {"disto_k3": [0.0, 0.0, 0.0]}
    sfm = {
        "sfm_data_version": "0.3",
        "root_path": "/photos",
        "views": [
            {
                "key": 0,
                "value": {
                    "polymorphic_id": 1073741824,
                    "ptr_wrapper": {
                        "id": 2147483649,
                        "data": {"local_path": "/", "filename": "a.jpg", "id_view": 0, "id_intrinsic": 5, "id_pose": 9},
                    },
                },
            }
        ],
        "intrinsics": [
            {
                "key": key,
                "value": {
                    "polymorphic_id": 2147483649 if key == 4 else 1,
                    **({"polymorphic_name": "pinhole_radial_k3"} if key == 4 else {}),
                    "ptr_wrapper": {"id": 2147483650 + key, "data": {**data, **lens}},
                },
            }
            for key in (4, 5)
        ],
        "extrinsics": [{"key": 9, "value": {"rotation": known.opencv.tolist(), "center": known.e.tolist()}}],
    }
    read = the_same(cameras.read(json.dumps(sfm)), known)
    assert any("counts pixels" in note for note in read.notes)
    sfm["intrinsics"][0]["value"]["polymorphic_name"] = "fisheye"
    with pytest.raises(InputError, match="fisheye"):
        cameras.read(json.dumps(sfm))


@pytest.mark.parametrize("name", CENTERED)
def test_bundler_looks_along_minus_z(name):
    known = Known(name)
    turn = np.array([known.u, known.v, known.w])
    rows = [[known.f_x, 0, 0], *turn, -turn @ known.e]
    text = "# Bundle file v0.3\n2 0\n" + "\n".join(map(text_of, rows)) + "\n0 0 0\n" + "0 0 0\n" * 4
    read = the_same(cameras.read(text, options=Options(size=(known.width, known.height))), known)
    assert not read.size_stated and any("1 camera not placed" in note for note in read.notes)


@pytest.mark.parametrize("name", CENTERED)
def test_llff_has_its_axes_down_right_and_backwards(tmp_path, name):
    known = Known(name)
    matrix = np.column_stack([-known.v, known.u, known.w, known.e, [known.height, known.width, known.f_x]])
    np.save(tmp_path / "poses_bounds.npy", np.array([[*matrix.ravel(), 0.1, 100]]))
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "IMG_1.JPG").touch()
    read = the_same(cameras.read(tmp_path), known)
    assert read.name == "IMG_1" and read.image == "images/IMG_1.JPG"


@pytest.mark.parametrize("name", UNMIRRORED)
@pytest.mark.parametrize("kind", ["TUM", "KITTI", "EuRoC"])
def test_a_trajectory_is_an_animation_through_the_intrinsics_that_are_given(tmp_path, name, kind):
    known = Known(name)
    plane = ViewPlane(known.pinhole.distance, known.pinhole.principal_point, known.width, known.height)
    x, y, z, w = known.quaternion()
    lines = {
        "TUM": f"# timestamp tx ty tz qx qy qz qw\n12.5 {text_of(known.e)} {text_of([x, y, z, w])}\n",
        "KITTI": text_of(np.column_stack([known.opencv.T, known.e])) + "\n",
        "EuRoC": "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n"
        + ",".join(["12500000000", *map(repr, known.e.tolist()), *map(repr, [w, x, y, z])])
        + "\n",
    }
    path = tmp_path / "state" / "data.csv"
    path.parent.mkdir()
    path.write_text(lines[kind])
    if kind == "EuRoC":
        with pytest.raises(InputError, match="body"):
            cameras.read(path, options=Options(view_plane=plane))
        (tmp_path / "cam0").mkdir()
        unit = "[1.0, 0.0, 0.0, 0.0,\n  0.0, 1.0, 0.0, 0.0,\n 0.0, 0.0, 1.0, 0.0,\n 0.0, 0.0, 0.0, 1.0]"
        (tmp_path / "cam0" / "sensor.yaml").write_text(f"T_BS:\n  cols: 4\n  rows: 4\n  data: {unit}\n")
    read = the_same(cameras.read(path, options=Options(view_plane=plane)), known)
    assert read.time == (0.0 if kind == "KITTI" else 12.5) and not read.size_stated
    assert any("whose poses" in note for note in read.notes) == (kind != "EuRoC")
    with pytest.raises(InputError, match="how it sees"):
        cameras.read(path)


def test_a_head_that_says_w_first_is_believed():
    known = Known("plain")
    x, y, z, w = known.quaternion()
    text = f"# timestamp tx ty tz qw qx qy qz\n12.5 {text_of(known.e)} {text_of([w, x, y, z])}\n"
    the_same(cameras.read(text, options=Options(base=CAMERAS["plain"])), known)


@pytest.mark.parametrize("first", ["timestamp tx ty tz qw qx qy qz", "time,x,y,z,q_w,q_x,q_y,q_z", "# t x y z qw qx qy qz"])
def test_a_head_of_a_trajectory_may_stand_without_a_sign_and_part_its_columns_by_commas(first):
    known = Known("plain")
    x, y, z, w = known.quaternion()
    line = f"12.5 {text_of(known.e)} {text_of([w, x, y, z])}\n"
    text = f"{first}\n{line.replace(' ', ',') if ',' in first else line}"
    assert the_same(cameras.read(text, options=Options(base=CAMERAS["plain"])), known).time == 12.5


def test_times_of_a_trajectory_that_are_nanoseconds_are_seconds_of_our_age():
    """ORB-SLAM3's of EuRoC's pictures, which are called by these."""
    text = "1403636579758555392.000000 1 2 3 0 0 0 1\n1403636580758555392.000000 1 2 3 0 0 0 1\n"
    first, second = (camera.time for camera in cameras.read(text, options=Options(base=CAMERAS["plain"])))
    assert second - first == pytest.approx(1, abs=1e-6) and first == pytest.approx(1403636579.758555392), (first, second)


def test_poses_of_kitti_360_have_a_frame_before_them(tmp_path):
    known = Known("plain")
    rows = [*np.column_stack([known.opencv.T, known.e]).ravel().tolist(), 0, 0, 0, 1]
    (tmp_path / "cam0_to_world.txt").write_text(f"4 {text_of(rows)} \n")
    read = the_same(cameras.read(tmp_path / "cam0_to_world.txt", options=Options(base=CAMERAS["plain"])), known)
    assert read.time == pytest.approx(0.4)


def test_places_and_quaternions_alone_are_told_what_they_lack():
    with pytest.raises(InputError, match="whose axes and times it does not say: write t tx ty tz qx qy qz qw"):
        cameras.read("1 2 3 0 0 0 1\n1.1 2 3 0 0 0.6 0.8\n", options=Options(base=CAMERAS["plain"]))


def test_what_was_tracked_stands_on_euroc_s_body_as_its_own_sensor_says(tmp_path):
    known = Known("plain")
    plane = ViewPlane(known.pinhole.distance, known.pinhole.principal_point, known.width, known.height)
    body = np.array([[0, -1, 0, 0.2], [0, 0, -1, 0.1], [1, 0, 0, -0.3], [0, 0, 0, 1]], float)  # the camera on the body
    marker = np.array([[0, 0, 1, -0.1], [1, 0, 0, 0.4], [0, 1, 0, 0.2], [0, 0, 0, 1]], float)
    camera = np.eye(4)
    camera[:3] = np.column_stack([known.opencv.T, known.e])
    tracked = camera @ np.linalg.inv(body) @ marker
    x, y, z, w = pytest.importorskip("scipy.spatial.transform").Rotation.from_matrix(tracked[:3, :3]).as_quat().tolist()
    for name, mounted in (("cam0", body), ("vicon0", marker)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "sensor.yaml").write_text(f"T_BS:\n  data: [{', '.join(map(repr, mounted.ravel().tolist()))}]\n")
    numbers = ",".join(map(repr, [*tracked[:3, 3].tolist(), w, x, y, z]))
    data = tmp_path / "vicon0" / "data.csv"
    data.write_text(f"#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w []\n0,{numbers}\n")
    the_same(cameras.read(data, options=Options(view_plane=plane)), known)


def test_eight_numbers_without_a_quaternion_are_no_trajectory_of_tum():
    with pytest.raises(InputError, match="quaternion of pose 0 has the length 46"):
        cameras.read("1.5 0.1 1.5 5 -10 2 0 45\n2.5 0.2 1.5 5 -10 4 0 45\n", options=Options(base=CAMERAS["plain"]))


@pytest.mark.parametrize("angles", ["-10 2 0 45", "0 0 0 45", "0 0 0 1", "-10 2 0"])
def test_nukes_chan_is_no_trajectory_of_tum(tmp_path, angles):
    """It has as many numbers: frame, place, three angles in degrees, and perhaps the field of view."""
    (tmp_path / "a.chan").write_text(f"1\t0.1 1.5 5 {angles}\n2\t0.2 1.5 5 {angles}\n")
    with pytest.raises(InputError, match="Nuke's chan"):
        cameras.read(tmp_path / "a.chan", options=Options(base=CAMERAS["plain"]))
    if angles.endswith("45"):  # told by its numbers alone
        with pytest.raises(InputError, match="Nuke's chan"):
            cameras.read((tmp_path / "a.chan").read_text(), options=Options(base=CAMERAS["plain"]))


def test_euroc_cameras_that_are_fisheyes_are_so_even_without_coefficients(tmp_path):
    (tmp_path / "state").mkdir()
    (tmp_path / "cam0").mkdir()
    data = tmp_path / "state" / "data.csv"
    data.write_text("#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w []\n0,1,2,3,1,0,0,0\n")
    sensor = "T_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nresolution: [640, 480]\n"
    sensor += "intrinsics: [500, 500, 320, 240]\ndistortion_model: {}\ndistortion_coefficients: [0, 0, 0, 0]\n"
    (tmp_path / "cam0" / "sensor.yaml").write_text(sensor.format("radial-tangential"))
    (straight,) = cameras.read(data)
    assert straight.pinhole.eye == (1, 2, 3) and straight.lens is None
    (tmp_path / "cam0" / "sensor.yaml").write_text(sensor.format("equidistant"))
    assert cameras.read(data)[0].lens.projection == "equidistant"
    (tmp_path / "cam0" / "sensor.yaml").write_text(sensor.format("omni"))
    with pytest.raises(InputError, match="omni"):
        cameras.read(data)


@pytest.mark.parametrize("name", UNMIRRORED)
def test_polycam_3d_scanner_app_and_record3d_are_arkits(name):
    known = Known(name)
    size = {"width": known.width, "height": known.height}
    k = {"fx": known.f_x, "fy": known.f_y, "cx": known.c_x, "cy": known.c_y}
    polycam = {f"t_{i}{j}": known.opengl[i, j] for i in range(3) for j in range(4)} | k | size
    read = the_same(cameras.read(json.dumps(polycam)), known)
    assert any("y points up" in note for note in read.notes)
    matrix = np.array([[known.f_x, 0, known.c_x], [0, known.f_y, known.c_y], [0, 0, 1]])
    scanner = {"cameraPoseARFrame": [*known.opengl.ravel(), 0, 0, 0, 1], "intrinsics": [*matrix.ravel()]}
    the_same(cameras.read(json.dumps(scanner), options=Options(size=(known.width, known.height))), known)
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    pose = [*rotation.from_matrix(known.opengl[:, :3]).as_quat(), *known.e]
    record = {"poses": [pose], "K": [*matrix.T.ravel()], "w": known.width, "h": known.height, "fps": 30}
    the_same(cameras.read(json.dumps(record)), known)


def test_arkits_last_row_may_be_rounded_to_float32():
    known = Known("plain")
    scanner = {"cameraPoseARFrame": [*known.opengl.ravel(), 0, 0, 0, 1 - 2.0**-23]}
    scanner["intrinsics"] = [known.f_x, 0, known.c_x, 0, known.f_y, known.c_y, 0, 0, 1]
    options = Options(size=(known.width, known.height))
    the_same(cameras.read(json.dumps(scanner), options=options), known)
    scanner["cameraPoseARFrame"][-1] = 0.99
    with pytest.raises(InputError, match="last row"):
        cameras.read(json.dumps(scanner), options=options)


def test_record3ds_intrinsics_may_be_another_for_each_picture():
    poses = [[0, 0, 0, 1, index, 0, 0] for index in range(2)]
    record = {"poses": poses, "K": [700, 0, 0, 0, 700, 0, 320, 240, 1], "w": 640, "h": 480}
    record["perFrameIntrinsicCoeffs"] = [[710, 720, 310, 250], [800, 810, 300, 260]]
    cameras_read = [camera.pinhole for camera in cameras.read(json.dumps(record))]
    assert [pinhole.distance for pinhole in cameras_read] == [(710, 720), (800, 810)]
    assert [pinhole.principal_point for pinhole in cameras_read] == [(310, 480 - 250), (300, 480 - 260)]  # from below
    with pytest.raises(InputError, match="perFrameIntrinsicCoeffs"):
        cameras.read(json.dumps(record | {"perFrameIntrinsicCoeffs": [[710, 720, 310, 250]]}))


def test_polycams_pictures_are_named_from_whichever_folder_is_given(tmp_path):
    known = Known("plain")
    k = {"fx": known.f_x, "fy": known.f_y, "cx": known.c_x, "cy": known.c_y, "width": known.width, "height": known.height}
    document = json.dumps({f"t_{i}{j}": known.opengl[i, j] for i in range(3) for j in range(4)} | k)
    for kind in ("", "corrected_"):
        folder = tmp_path / "keyframes" / f"{kind}cameras"
        folder.mkdir(parents=True)
        (folder / "123.json").write_text(document)
        for path in (tmp_path, folder, folder / "123.json"):
            (camera,) = cameras.read(path)
            assert (camera.name, camera.image) == ("123", f"keyframes/{kind}images/123.jpg")
    (tmp_path / "frame_00001.json").write_text(document)
    assert cameras.read(tmp_path / "frame_00001.json")[0].image == "frame_00001.jpg"


@pytest.mark.parametrize("name", CENTERED)
def test_gaussian_splatting_lists_camera_to_world(name):
    known = Known(name)
    values = {"id": 0, "img_name": "00001", "width": known.width, "height": known.height, "fx": known.f_x, "fy": known.f_y}
    values |= {"position": known.e.tolist(), "rotation": known.opencv.T.tolist()}
    read = the_same(cameras.read(json.dumps([values])), known)
    assert read.name == "00001" and any("principal point" in note for note in read.notes)


def test_gaussian_splattings_principal_point_counts_where_it_is_said():
    known = Known("shifted")
    values = {"id": 0, "img_name": "1", "width": known.width, "height": known.height, "fx": known.f_x, "fy": known.f_y}
    values |= {"position": known.e.tolist(), "rotation": known.opencv.T.tolist(), "cx": known.c_x, "cy": known.c_y}
    read = the_same(cameras.read(json.dumps([values])), known)
    assert not any("principal point" in note for note in read.notes)


def nerfstudio_path(*known, fov=None):
    """A path as get_path_from_json takes it: the focal length is height / 2 / tan(fov / 2)."""
    path = [
        {
            "camera_to_world": [*each.opengl.ravel().tolist(), 0, 0, 0, 1],
            "fov": fov or np.degrees(2 * np.arctan(each.height / 2 / each.f_y)),
            "aspect": each.width / each.height,
        }
        for each in known
    ]
    return {"camera_type": "perspective", "render_width": known[0].width, "render_height": known[0].height, "camera_path": path}


@pytest.mark.parametrize("name", CENTERED)
def test_nerfstudios_path_has_the_degrees_of_the_height(name):
    known = Known(name)
    wide = 1 + known.f_y / known.height  # a telephoto's angle keeps fewer digits
    read = the_same(cameras.read(json.dumps(nerfstudio_path(known))), known, wide * 2.0**-50)
    assert any("world that nerfstudio trains in" in note for note in read.notes)


def test_nerfstudios_world_is_undone_by_the_file_beside_the_path(tmp_path):
    known = Known(CENTERED[0])
    turn = pytest.importorskip("scipy.spatial.transform").Rotation.from_rotvec([0.3, -1.2, 0.7]).as_matrix()
    moved, scale = np.array([0.2, -0.5, 1.1]), 0.37
    there = Known(CENTERED[0])
    there.opengl = np.column_stack([turn @ known.opengl[:, :3], scale * (turn @ known.e + moved)])
    (tmp_path / "path.json").write_text(json.dumps(nerfstudio_path(there)))
    world = {"transform": np.column_stack([turn, moved]).tolist(), "scale": scale}
    (tmp_path / "dataparser_transforms.json").write_text(json.dumps(world))
    the_same(cameras.read(tmp_path / "path.json", options=Options(original_world=True)), known)
    (as_it_is,) = cameras.read(tmp_path / "path.json")
    assert as_it_is.pinhole.eye == pytest.approx(tuple(there.opengl[:, 3]))


def test_a_path_flies_at_its_frames_a_second_and_other_cameras_are_refused():
    known = Known(CENTERED[0])
    read = cameras.read(json.dumps(nerfstudio_path(known, known, known) | {"fps": 10}))
    assert [camera.time for camera in read] == [0, 0.1, 0.2]
    with pytest.raises(InputError, match="equirectangular"):
        cameras.read(json.dumps(nerfstudio_path(known) | {"camera_type": "equirectangular"}))
    pair = [cameras.Camera("a", known.pinhole), cameras.Camera("b", known.pinhole.resized(64, 36))]
    with pytest.raises(InputError, match="one size for all cameras"):
        cameras.write(pair, "nerfstudio_path")


def instant_ngp(known, scale=0.33, offset=0.5):
    """The other way than it is read: nerf_matrix_to_ngp of instant-ngp's nerf_loader.h, quaternions by scipy."""
    matrix = known.opengl @ np.diag([1.0, -1, -1, 1])
    matrix[:, 3] = known.e * scale + offset
    matrix = matrix[[1, 2, 0]]
    quaternion = pytest.importorskip("scipy.spatial.transform").Rotation.from_matrix(matrix[:, :3]).as_quat()
    fov = np.degrees(2 * np.arctan(0.5 * known.height / known.f_y))
    rest = {"slice": 0.0, "scale": 1.5, "aperture_size": 0.0}
    return {"R": quaternion.tolist(), "T": matrix[:, 3].tolist(), "fov": fov, **rest}


@pytest.mark.parametrize("name", CENTERED)
def test_instant_ngps_path_is_taken_out_of_its_unit_cube(tmp_path, name):
    known = Known(name)
    options = Options(size=(known.width, known.height))
    unit = (1 + known.f_y / known.height) * 2.0**-48  # a telephoto's angle keeps fewer digits
    read = the_same(cameras.read(json.dumps({"path": [instant_ngp(known)], "time": 0.0}), options=options), known, unit)
    assert any("unit cube" in note for note in read.notes)
    offset = np.array([0.1, 0.2, -0.3])
    (tmp_path / "base_cam.json").write_text(json.dumps({"path": [instant_ngp(known, 2.5, offset)], "time": 0.0}))
    (tmp_path / "transforms.json").write_text(json.dumps({"scale": 2.5, "offset": offset.tolist(), "frames": []}))
    read = the_same(cameras.read(tmp_path / "base_cam.json", options=options), known, unit)
    assert not any("unit cube" in note for note in read.notes)
    (tmp_path / "transforms.json").write_text(json.dumps({"from_mitsuba": True, "frames": []}))
    with pytest.raises(InputError, match="from_mitsuba"):
        cameras.read(tmp_path / "base_cam.json", options=options)


def test_instant_ngps_keyframes_are_read_in_order_and_what_else_moves_the_picture_is_told():
    known, size = Known("plain"), Options(size=(640, 360))
    path = [instant_ngp(known) | {"T": [0.5 + 0.33 * i, 0.5, 0.5]} for i in range(3)]
    read = cameras.read(json.dumps({"path": path}), options=size)
    assert [camera.name for camera in read] == ["00000", "00001", "00002"]
    assert [camera.pinhole.eye for camera in read] == [pytest.approx((0, i, 0), abs=1e-15) for i in range(3)]
    assert any("spline" in note for note in read[0].notes)
    straight = cameras.read(json.dumps({"path": path, "spline_order": 1}), options=size)
    assert not any("spline" in note for note in straight[0].notes)
    path[1]["dof"] = 0.02
    assert any("aperture" in note for note in cameras.read(json.dumps({"path": path}), options=size)[0].notes)
    scaled = json.dumps({"path": [path[0] | {"R": [3 * part for part in path[0]["R"]]}]})  # as instant-ngp normalizes it
    assert cameras.read(scaled, options=size)[0].pinhole == read[0].pinhole
    for wrong, sentence in ({"R": [0, 0, 0, 0]}, "length 0"), ({"fov": 180}, "fov"), ({"T": [1, 2]}, "should have 3"):
        with pytest.raises(InputError, match=sentence):
            cameras.read(json.dumps({"path": [path[0] | wrong]}), options=size)


def kubric(*known, **metadata):
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    quaternions = [np.roll(rotation.from_matrix(each.opengl[:, :3]).as_quat(), 1).tolist() for each in known]
    camera = {"positions": [each.e.tolist() for each in known], "quaternions": quaternions, "sensor_width": 32.0}
    camera["focal_length"] = known[0].f_x / known[0].width * 32
    metadata_of_views = {"resolution": [known[0].width, known[0].height], "frame_rate": 12, **metadata}
    return {"camera": camera, "metadata": metadata_of_views, "instances": []}


@pytest.mark.parametrize("name", CENTERED)
def test_kubrics_sensor_is_as_wide_as_the_picture_also_of_a_portrait(name):
    read = the_same(cameras.read(json.dumps(kubric(Known(name)))), Known(name))
    assert (read.name, read.image, read.time) == ("00000", "rgba_00000.png", 0)


KUBRIC_PUBLISHED = {  # from examples/lts, whose R and image_positions say it twice more
    "camera": {
        "field_of_view": 0.6911111611634243,
        "focal_length": 50.0,
        "positions": [[7.0, 0.0, 2.0]],
        "quaternions": [[0.5645177364349365, 0.42581653594970703, 0.42581653594970703, 0.5645177364349365]],
        "sensor_width": 36.0,
    },
    "metadata": {"frame_rate": 24, "num_frames": 1, "resolution": [512, 512]},
}
SEEN_BY_KUBRIC = [  # positions, image_positions
    ([0.5, -1.0, 0.19651499390602112], [0.2940971851348877, 0.48937681317329407]),
    ([-1.5, -1.5, 0.3433150053024292], [0.2585403323173523, 0.3805278241634369]),
    ([0.0, 2.5, 0.46478700637817383], [0.9854609370231628, 0.41321828961372375]),
]


def test_kubric_sees_its_objects_where_it_says_it_does(tmp_path):
    (tmp_path / "metadata.json").write_text(json.dumps(KUBRIC_PUBLISHED))
    for path in (tmp_path, tmp_path / "metadata.json"):
        (camera,) = cameras.read(path)
        column, row, _ = camera.pinhole.project(np.array([place for place, _ in SEEN_BY_KUBRIC]))
        there = 512 * np.array([seen for _, seen in SEEN_BY_KUBRIC])
        error = np.abs(np.column_stack([column, 512 - row]) - there).max()
        assert error < 512 * 2.0**-20, f"{error} pixels"  # its numbers are float32's


def test_a_camera_of_kubric_flies_and_what_contradicts_itself_is_refused():
    path = kubric(Known("plain"), Known("portrait"), Known("rolled"))
    assert [camera.time for camera in cameras.read(json.dumps(path))] == [0, 1 / 12, 2 / 12]
    path["camera"]["quaternions"].pop()
    with pytest.raises(InputError, match="one length"):
        cameras.read(json.dumps(path))
    with pytest.raises(InputError, match="--size"):
        cameras.read(json.dumps(kubric(Known("plain"), resolution=None)))


def nvisii(known, transposed=True, **more):
    view = np.vstack([np.column_stack([known.opengl[:, :3].T, -known.opengl[:, :3].T @ known.e]), [0, 0, 0, 1]])
    data = {
        "camera_view_matrix": (view.T if transposed else view).tolist(),
        "intrinsics": {"fx": known.f_x, "fy": known.f_y, "cx": known.c_x, "cy": known.c_y},
        "width": known.width,
        "height": known.height,
    }
    return {"camera_data": data | more, "objects": []}


@pytest.mark.parametrize("name", UNMIRRORED)
def test_nvisii_lists_its_matrix_column_after_column(tmp_path, name):
    known = Known(name)
    written = (True, False) if known.e.any() else (True,)  # without a translation nothing tells that it is transposed
    for transposed in written:
        (tmp_path / f"{transposed:05d}.json").write_text(json.dumps(nvisii(known, transposed)))
        read = the_same(cameras.read(tmp_path / f"{transposed:05d}.json"), known)
        assert read.image == f"{transposed:05d}.png" and any("NVISII" in note for note in read.notes)
    assert len(cameras.read(tmp_path)) == len(written)


DOPE_PUBLISHED = {  # data_generation/nvisii_data_gen/output/output_example/00000.json of Deep_Object_Pose
    "camera_data": {
        "camera_look_at": {"at": [1.0, 0.0, 0.0], "eye": [0.0, 0.0, 0.0], "up": [0.0, 0.0, 1.0]},
        "camera_view_matrix": [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
        "height": 500,
        "intrinsics": {"cx": 250.0, "cy": 250.0, "fx": 603.5535278320312, "fy": 603.5535278320312},
        "width": 500,
    },
    "objects": [{"location": [-0.5842792987823486, -0.3898838460445404, 1.4419153928756714]}],
}
DOPE_OBJECT = [1.4419153928756714, 0.5842792987823486, 0.3898838460445404]  # location_worldframe of the same


@pytest.mark.parametrize("told_by", ["camera_look_at", "objects", "pose"])
def test_dopes_camera_looks_along_its_z_and_its_file_tells(told_by):
    document = json.loads(json.dumps(DOPE_PUBLISHED))
    if told_by != "camera_look_at":
        del document["camera_data"]["camera_look_at"]
    if told_by == "pose":
        del document["objects"]
    (camera,) = cameras.read(json.dumps(document), options=Options(pose="w2c_opencv" if told_by == "pose" else None))
    assert camera.notes == () and camera.pinhole.axes() == ((0, -1, 0), (0, 0, 1), (-1, 0, 0))  # at +x, upright
    column, row, depth = camera.pinhole.project(np.array([DOPE_OBJECT]))
    x, y, z = DOPE_PUBLISHED["objects"][0]["location"]
    f = document["camera_data"]["intrinsics"]["fx"]
    assert (column[0], 500 - row[0], depth[0]) == pytest.approx((250 + f * x / z, 250 + f * y / z, z), rel=1e-12)


def test_a_pose_of_nvisii_that_contradicts_the_matrix_is_refused():
    """It was passed over, whichever of the two was meant."""
    known = Known("rolled")
    scipy = pytest.importorskip("scipy.spatial.transform")
    c2w = np.vstack([np.column_stack([known.opengl[:, :3], known.e]), [0, 0, 0, 1]])
    again = {
        "cam2world": c2w.T.tolist(),
        "location_world": known.e.tolist(),
        "quaternion_world_xyzw": scipy.Rotation.from_matrix(known.opengl[:, :3]).as_quat().tolist(),
        "camera_look_at": {"eye": known.e.tolist(), "at": (known.e - 3 * known.w).tolist(), "up": [0, 0, 1]},
    }
    the_same(cameras.read(json.dumps(nvisii(known, **again))), known)
    untold = {"eye": [0, 0, 0], "at": [0, 0, 0], "up": [0, 0, 0]}
    the_same(cameras.read(json.dumps(nvisii(known, **again | {"camera_look_at": untold}))), known)
    turned = scipy.Rotation.from_euler("y", 1, degrees=True).as_matrix()
    wrong = {
        "cam2world": np.linalg.inv(c2w).T.tolist(),
        "location_world": np.add(known.e, [0, 0, 0.1]).tolist(),
        "quaternion_world_xyzw": np.roll(again["quaternion_world_xyzw"], 1).tolist(),
        "camera_look_at": again["camera_look_at"] | {"at": (known.e - turned @ known.w).tolist()},
    }
    for key, value in wrong.items():
        with pytest.raises(InputError, match=f"^{key} of camera_data says another pose than its camera_view_matrix"):
            cameras.read(json.dumps(nvisii(known, **again | {key: value})))


def infinigen(path, known, **other):
    t = np.vstack([np.column_stack([known.opencv.T, known.e]), [0, 0, 0, 1]])
    k = np.array([[known.f_x, 0, known.c_x], [0, known.f_y, known.c_y], [0, 0, 1]])
    arrays = {"K": k, "T": t, "HW": np.array([known.height, known.width]), **other}
    np.savez(path, **{name: array for name, array in arrays.items() if array is not None})


@pytest.mark.parametrize("name", UNMIRRORED)
def test_infinigen_has_camera_to_world_and_the_height_first(tmp_path, name):
    known = Known(name)
    for number in (1, 2):
        infinigen(tmp_path / f"camview_0_0_{number:04d}_0.npz", known)
    read = cameras.read(tmp_path)
    assert [camera.name for camera in read] == ["camview_0_0_0001_0", "camview_0_0_0002_0"]
    the_same(read[:1], known)
    infinigen(tmp_path / "old.npz", known, HW=None)
    the_same(cameras.read(tmp_path / "old.npz", options=Options(size=(known.width, known.height))), known)
    infinigen(tmp_path / "odd.npz", known, HW=np.arange(3))
    with pytest.raises(InputError, match="height and width"):
        cameras.read(tmp_path / "odd.npz")


def open3d(known):
    k = np.array([[known.f_x, 0, known.c_x - 0.5], [0, known.f_y, known.c_y - 0.5], [0, 0, 1]])
    extrinsic = np.vstack([np.column_stack([known.opencv, -known.opencv @ known.e]), [0, 0, 0, 1]])
    intrinsic = {"width": known.width, "height": known.height, "intrinsic_matrix": k.T.ravel().tolist()}
    return {"class_name": "PinholeCameraParameters", "extrinsic": extrinsic.T.ravel().tolist(), "intrinsic": intrinsic}


@pytest.mark.parametrize("name", UNMIRRORED)
def test_open3d_has_column_after_column_and_counts_from_the_first_pixels_center(name):
    known = Known(name)
    alone = cameras.read(json.dumps(open3d(known)))
    flight = cameras.read(json.dumps({"class_name": "PinholeCameraTrajectory", "parameters": [open3d(known)] * 2}))
    for read in (alone, flight[:1], flight[1:]):
        assert any("half a pixel" in note for note in the_same(read, known).notes)


def opensfm(known, **camera):
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation.from_matrix(known.opencv).as_rotvec().tolist()
    longer = max(known.width, known.height)
    entry = {"projection_type": "brown", "width": known.width, "height": known.height}
    entry |= {"focal_x": known.f_x / longer, "focal_y": known.f_y / longer}
    entry |= {"c_x": (known.c_x - known.width / 2) / longer, "c_y": (known.c_y - known.height / 2) / longer}
    shot = {"rotation": rotation, "translation": (-known.opencv @ known.e).tolist(), "camera": "c"}
    return [{"cameras": {"c": entry | camera}, "shots": {"a.jpg": shot}, "points": {}}]


@pytest.mark.parametrize("name", UNMIRRORED)
def test_opensfm_counts_in_the_longer_side_from_the_middle(name):
    known = Known(name)
    read = the_same(cameras.read(json.dumps(opensfm(known))), known, 2.0**-48)
    assert (read.name, read.image) == ("a", "a.jpg")


def test_opensfms_lenses_are_opencvs_and_panoramas_are_refused():
    cv2, known = pytest.importorskip("cv2"), Known("plain")
    points = np.array([[0.1, 0.2], [-0.3, 0.15], [0.25, -0.2]])
    rays = np.column_stack([points, np.ones(3)])
    k = {"k1": -0.12, "k2": 0.05, "k3": 0.01, "p1": 0.002, "p2": -0.003}
    (brown,) = cameras.read(json.dumps(opensfm(known, **k)))
    theirs, _ = cv2.projectPoints(
        rays, np.zeros(3), np.zeros(3), np.eye(3), np.array([k[n] for n in ("k1", "k2", "p1", "p2", "k3")])
    )
    assert np.abs(brown.lens.distort(points) - theirs[:, 0]).max() < 1e-12
    (fish,) = cameras.read(json.dumps(opensfm(known, projection_type="fisheye", focal=0.8, k1=-0.02, k2=0.003)))
    theirs, _ = cv2.fisheye.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), np.eye(3), np.array([-0.02, 0.003, 0, 0]))
    assert np.abs(fish.lens.distort(points) - theirs[:, 0]).max() < 1e-12
    with pytest.raises(InputError, match="spherical"):
        cameras.read(json.dumps(opensfm(known, projection_type="spherical")))
    with pytest.raises(InputError, match="no shots"):
        cameras.read(json.dumps([{"cameras": {}, "shots": {}}]))


KALIBR = """cam0:
  camera_model: pinhole
  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [500.0, 510.0, 320.0, 240.0]
  resolution: [640, 480]
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.1]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [501.0, 511.0, 321.0, 241.0]
  resolution: [640, 480]
"""


def test_kalibrs_second_camera_stands_beside_the_first():
    first, second = cameras.read(KALIBR)
    assert first.pinhole.eye == (0, 0, 0) and second.pinhole.eye == pytest.approx((0.1, 0, 0))
    assert second.pinhole.principal_point == (321.5, 480 - 241.5) and second.pinhole.distance == (501, 511)


K = {"K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]], "image_size": [640, 480]}


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ({"radial_distortion": [0.1, 0.2]}, "radialdistortion"),
        ({"kc": [0.1, 0.2]}, "kc"),
        ({"R": [0.1, 0.2, 0.3], "t": [0, 0, 0]}, "rotation vector"),
        ({"R": np.eye(3).tolist()}, "only a part"),
        ({"c2w": np.eye(4).tolist()}, "whose axes"),
        ({"R": (2 * np.eye(3) + np.diag([0, 0, 1])).tolist(), "t": [0, 0, 0]}, "lengths"),
        ({"R": np.eye(3).tolist(), "rvec": [0, 0, 1], "t": [0, 0, 0]}, "different rotations"),
        ({"K": [[500, 0, 0], [0, 500, 0], [320, 240, 1]]}, "transpose"),
        ({"K": [[500, 2, 320], [0, 500, 240], [0, 0, 1]]}, "skew"),
        ({"model": "omni"}, "omni"),
        ({"model": "fisheye", "dist": [0.1, 0, 0, 0, 0]}, "fisheye has four"),
        ({"distortion_model": "fov"}, "fov"),
        ({"cam_to_robot_transform": np.eye(4).tolist()}, "whose axes"),
        ({"qw": 1, "qx": 0, "qy": 0, "qz": 0, "tx": 1, "ty": 2, "tz": 3}, "has qw, qx, qy, qz, of which no pose is read"),
        ({"binning_x": 1.5}, "whole number of pixels"),
        ({"K": [[1.2, 0, 0.5], [0, 1.6, 0.5], [0, 0, 1]]}, "widths of the picture"),
    ],
)
def test_what_opencvs_names_leave_open_is_refused_and_not_guessed(more, sentence):
    with pytest.raises(InputError, match=sentence):
        cameras.read(json.dumps({**K, **more}))


def test_a_distortion_that_no_picture_shows_is_taken_and_its_figure_said():
    (camera,) = cameras.read(json.dumps({**K, "k1": 1e-6}))
    # 500 k1 r³, r the corner's distance over the focal length
    assert any("left out: it moves the picture's corner by 0.000257 pixels" in note for note in camera.notes)


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ({"camera_intrinsics": [700, 700, 400, 300]}, "has camera_intrinsics, which programs read differently"),
        ({"K": [[700, 0, 400], [0, 700, 300], [0, 0, 1]]}, "has K, which"),
        ({"camera_type": "equirectangular"}, "equirectangular"),
        ({"camera_convention": "opencv"}, "camera_convention 'opencv'"),
        ({"from_mitsuba": True}, "from_mitsuba"),
        ({"w": 800}, "w 800 and the size is given as 640 × 480"),
    ],
)
def test_what_a_transforms_json_says_in_other_words_is_not_passed_over(more, sentence):
    frame = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}
    options = Options(size=(640, 480))
    assert cameras.read(json.dumps({"camera_angle_x": 0.7, "frames": [frame]}), options=options)
    for document in ({**more, "frames": [frame]}, {"frames": [{**frame, **more}]}):
        with pytest.raises(InputError, match=sentence):
            cameras.read(json.dumps({"camera_angle_x": 0.7, **document}), options=options)


def test_a_camera_of_usd_stands_at_every_time_that_has_a_sample(tmp_path):
    pytest.importorskip("pxr")
    samples = ", ".join(f"{time}: ({time + 1}, 0, 0)" for time in range(3))
    text = f"""#usda 1.0
    def Camera "mono" {{
        float3 xformOp:translate.timeSamples = {{ {samples} }}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}"""
    (tmp_path / "a.usda").write_text(text)
    cameras_read = cameras.read(tmp_path / "a.usda", options=Options(size=(640, 480)))
    meters = 0.01  # a unit of a stage that says none
    assert [camera.pinhole.eye for camera in cameras_read] == [pytest.approx((meters * x, 0, 0), rel=1e-15) for x in (1, 2, 3)]


@pytest.mark.parametrize("pointer", ["/nodes/1/translation", "/cameras/0/perspective/yfov"])
def test_an_animation_of_gltf_by_a_pointer_is_told(pointer):
    document = {"asset": {"version": "2.0"}, "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]}
    document |= {"nodes": [{"name": "floor"}, {"name": "mono", "camera": 0}], "scenes": [{"nodes": [0, 1]}]}
    target = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}
    for animations, is_told in (([], False), ([{"channels": [{"sampler": 0, "target": target}]}], True)):
        (camera,) = cameras.read(json.dumps(document | {"animations": animations}), options=Options(size=(640, 480)))
        assert any("animated" in note for note in camera.notes) == is_told


# ---- a window of a sensor


K_OF_SENSOR = [410.5, 0, 633.25, 0, 410.5, 372.75, 0, 0, 1]


def ros(form, size, binning, roi):
    """ROS camera_info, as a message is printed or as camera_calibration writes it."""
    names = ("width", "height") if form == "message" else ("image_width", "image_height")
    lines = [f"{name}: {side}" for name, side in zip(names, size, strict=True)] + ["distortion_model: plumb_bob"]
    if form == "message":
        lines += ["D: [0.0, 0.0, 0.0, 0.0, 0.0]", f"K: {K_OF_SENSOR}"]
    elif form == "flow":
        lines += [f"camera_matrix: {{rows: 3, cols: 3, data: {K_OF_SENSOR}}}"]
    else:
        lines += ["camera_matrix:", "  rows: 3", "  cols: 3", f"  data: {K_OF_SENSOR}"]
    lines += [f"binning_{side}: {number}" for side, number in zip("xy", binning, strict=True)]
    keys = dict(zip(("x_offset", "y_offset", "width", "height"), roi, strict=True))
    if form == "flow":
        return "\n".join([*lines, f"roi: {keys}".replace("'", ""), ""])
    return "\n".join([*lines, "roi:", *(f"  {key}: {number}" for key, number in keys.items()), ""])


@pytest.mark.parametrize("form", ["message", "calibration", "flow"])
@pytest.mark.parametrize(
    ("size", "binning", "roi"),
    [
        ((1280, 800), (1, 1), (320, 200, 640, 480)),
        ((640, 480), (0, 0), (320, 200, 640, 480)),
        ((1280, 800), (4, 4), (0, 0, 0, 0)),
        ((1280, 800), (2, 4), (320, 200, 640, 480)),
        ((1280, 800), (1, 1), (0, 0, 0, 0)),
    ],
)
def test_a_window_of_a_sensor_sees_what_the_sensor_sees_there(form, size, binning, roi):
    """A point that K puts at a place of the sensor is at that place of its window, by ROS' definition of roi and binning."""
    (camera,) = cameras.read(ros(form, size, binning, roi), options=Options(size=(1280, 800)))
    across, down = (max(number, 1) for number in binning)
    wanted = (roi[2] or size[0]) // across, (roi[3] or size[1]) // down
    assert (camera.pinhole.width, camera.pinhole.height) == wanted
    points = np.array([[0.3, -0.2, 2.0], [-0.1, 0.05, 1.0], [0, 0, 1.0]])
    column, row, _ = camera.pinhole.project(points)
    f, _, c_x, _, _, c_y, *_ = K_OF_SENSOR
    sensor = points[:, :2] / points[:, 2:] * f + [c_x + 0.5, c_y + 0.5]  # from the corner of the sensor
    there = (sensor - roi[:2]) / [across, down]
    assert np.abs(np.column_stack([column, wanted[1] - row]) - there).max() < 1e-9
    is_noted = any("window of its sensor" in note for note in camera.notes)
    assert is_noted == ((across, down, *roi) != (1, 1, 0, 0, 0, 0))


@pytest.mark.parametrize("form", ["message", "calibration", "flow"])
def test_the_place_in_its_pair_of_a_camera_that_has_no_pose_is_told(form):
    for offset, is_told in ((-49.26, True), (0.0, False)):
        p = [410.5, 0, 633.25, offset, 0, 410.5, 372.75, 0, 0, 0, 1, 0]
        key = f"P: {p}" if form == "message" else f"projection_matrix: {{rows: 3, cols: 4, data: {p}}}"
        turn = ["R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]"] if form == "message" else []
        text = "\n".join([ros(form, (1280, 800), (0, 0), (0, 0, 0, 0)), *turn, key, ""])
        (camera,) = cameras.read(text, options=Options(size=(1280, 800)))
        assert any("stands 0.12 right and 0 down" in note for note in camera.notes) == is_told, camera.notes


def test_yaml_in_brackets_is_read_as_pyyaml_reads_it():
    from viewcam_addon.cameras import yaml as ours

    yaml = pytest.importorskip("yaml")
    text = "a: {rows: 3, 'b c': [1.5, 2, [x y, 4]], d: {e: http://f/g, h: {}}}\nk: [[1, 2], [3, -4.0e-3]]\n"
    assert ours.read(text) == (yaml.safe_load(text), [])
    for broken in ("[1, 2", "[1 2]]", "{a: 1", "{a: 1]", "[" * 50 + "]" * 50, "{[1]: 2}"):
        assert ours.read(f"k: {broken}\nl: 1\n")[0].get("k") in (broken, f"{broken} l: 1", None)


@pytest.mark.parametrize(
    "text",
    [
        'a: "x # y" # c',
        "a: it's # c",
        'a: "x[y"\nb: 2',
        'a: [1, "]", 2]',
        "a: 'q # r' # d",
        'a: "\\u00e9\\\\ \\""',
        "a: 5'3 # x's",
    ],
)
def test_quotes_of_yaml_hold_whatever_stands_in_them_as_pyyaml_reads_it(text):
    from viewcam_addon.cameras import yaml as ours

    assert ours.read(text)[0] == pytest.importorskip("yaml").safe_load(text)


def test_infinigens_t_is_the_camera_in_the_world_and_its_k_counts_from_the_corner(tmp_path):
    known = Known("pixels_not_square")
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = known.opencv.T, known.e
    k = np.array([[known.f_x, 0, known.c_x], [0, known.f_y, known.c_y], [0, 0, 1]])
    np.savez(tmp_path / "camview_0_0_0001_0.npz", K=k, T=pose, HW=np.array([known.height, known.width]))
    the_same(cameras.read(tmp_path / "camview_0_0_0001_0.npz"), known)


def test_metashapes_slave_camera_stands_on_its_master(tmp_path):
    """Its eye is the location in its master's axes, its view the rotation's last column there, whatever the chunk does."""
    turn = Known("rolled").opencv.T
    sensor = '<sensor id="1" type="frame" master_id="0"><calibration><resolution width="640" height="360"/><f>500</f>'
    sensor += f"</calibration><rotation>{text_of(turn)}</rotation><location>0.25 0.01 -0.02</location></sensor>"
    slave = '<camera id="9" sensor_id="1" master_id="0" label="right.jpg"/>'
    text = metashape(Known("plain")).replace("</sensors>", f"{sensor}</sensors>").replace("</cameras>", f"{slave}</cameras>")
    master, other = cameras.read(text)
    away = np.array(other.pinhole.eye) - master.pinhole.eye
    axes_of_master = np.array(master.pinhole.axes()) * [[1], [-1], [-1]]
    u, v, w = np.array(other.pinhole.axes())
    assert other.name == "right" and any("of a rig" in note for note in other.notes)
    scale = np.linalg.norm(away) / np.linalg.norm([0.25, 0.01, -0.02])
    assert np.abs(axes_of_master @ away / scale - [0.25, 0.01, -0.02]).max() < 1e-12
    assert np.abs(axes_of_master @ np.column_stack([u, -v, -w]) - turn).max() < 1e-12
    with pytest.raises(InputError, match="of a rig"):
        cameras.read(text.replace("<rotation>" + text_of(turn) + "</rotation><location>0.25 0.01 -0.02</location>", ""))


RC_HEADS = (
    "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2",
    "#name,x,y,alt,yaw,pitch,roll,f_35mm,px_norm,py_norm,k1",
)


def realitycapture_table(known, head, *lens):
    """Heading, pitch and roll by scipy: the turn of a camera that looks down, about z, x and y."""
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation.from_matrix(known.opengl[:, :3])
    yaw, pitch, roll = rotation.as_euler("ZXY", degrees=True).tolist()
    longer = max(known.width, known.height)
    middle = [(known.c_x - known.width / 2) / longer, (known.c_y - known.height / 2) / longer]
    numbers = [*known.e.tolist(), -yaw, pitch, roll, known.f_x * 36 / longer, *middle, *lens]
    numbers += [0] * (head.count(",") - len(numbers))
    return f"#cameras 1\n{head}\nleft.jpg,{','.join(map(repr, numbers))}\n"


@pytest.mark.parametrize("head", RC_HEADS)
@pytest.mark.parametrize("name", ONE_FOCAL)
def test_realitycaptures_table_turns_a_camera_that_looks_down(name, head):
    known = Known(name)
    read = the_same(
        cameras.read(realitycapture_table(known, head), options=Options(size=(known.width, known.height))), known, 2.0**-47
    )
    assert read.name == "left" and read.image == "left.jpg" and read.lens is None and not read.size_stated


def test_realitycaptures_table_and_its_xmp_of_one_photograph_are_one_rotation():
    """Both as the program wrote them: "Different rotation of cameras in XMP and CSV", forum of RealityCapture."""
    table = f"{RC_HEADS[0]}\na.jpg,1,2,3,163.736597399311,83.4154313461628,174.386496244756,30{',0' * 8}\n"
    xmp = (  # three digits of the last number were published
        '<x xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:FocalLength35mm="30"><xcr:Rotation>0.982594073038806 '
        "0.185426733553445 -0.0112166890261935 -0.032113633044729 0.11008102707942 -0.993403685341366 -0.18296885582437 "
        "0.976472781986697 0.114</xcr:Rotation><xcr:Position>1 2 3</xcr:Position></x>"
    )
    (of_table,), (of_xmp,) = (cameras.read(text, options=Options(size=(640, 480))) for text in (table, xmp))
    assert np.abs(np.array(of_table.pinhole.axes()) - of_xmp.pinhole.axes()).max() < 2e-4  # three digits
    row = [0.982594073038806, 0.185426733553445, -0.0112166890261935]
    assert np.abs(np.array(of_table.pinhole.axes())[0] - row).max() < 3 * np.radians(5e-13) + 1e-15  # the digits of both


def test_realitycaptures_table_for_opencv_has_r_and_t_and_pixels():
    known = Known("shifted")
    turn = ",".join(f"R{row}{column}" for row in range(3) for column in range(3))
    inner = [known.f_x, known.c_x, known.c_y, -0.1, 0.02, 3e-3, -1e-3, 0, 0]
    numbers = [*(-known.opencv @ known.e), *known.opencv.ravel(), *inner]
    text = f"#name,tx,ty,tz,{turn},f_pix,px_pix,py_pix,k1,k2,t2,t1,k3,k4\na.jpg,{','.join(repr(float(x)) for x in numbers)}\n"
    read = the_same(cameras.read(text, options=Options(size=(known.width, known.height))), known)
    assert read.lens.radial == (-0.1, 0.02) and read.lens.tangential == (3e-3, -1e-3)  # OpenCV's p1 is t2


def test_realitycaptures_table_without_a_focal_length_has_poses():
    known = Known("plain")
    rows = realitycapture_table(known, RC_HEADS[0]).split("\n")[2].split(",")[:7]
    text = f"#name,x,y,z,heading,pitch,roll\n{','.join(rows)}\n"
    the_same(cameras.read(text, options=Options(base=known.pinhole)), known, 2.0**-47)
    with pytest.raises(InputError, match="how it sees"):
        cameras.read(text)


def test_a_single_term_of_realitycaptures_table_is_divisions_and_several_are_browns():
    known = Known("plain")
    options = Options(size=(known.width, known.height))
    (division,) = cameras.read(realitycapture_table(known, RC_HEADS[0], -0.1), options=options)
    (brown,) = cameras.read(realitycapture_table(known, RC_HEADS[0], -0.1, 0.02), options=options)
    assert division.lens.projection == "division" and division.lens.parameters == (-0.1,)
    assert brown.lens.projection == "pinhole" and brown.lens.radial == (-0.1, 0.02)
    assert all(any("does not name the lens's model" in note for note in camera.notes) for camera in (division, brown))


def test_degrees_of_longitude_in_realitycaptures_table_are_refused():
    rows = "".join(f"{name}.jpg,{15.00012 + at},{50.1 + at},230.5,0,0,0,30\n" for name, at in (("a", 0), ("b", 1e-4)))
    with pytest.raises(InputError, match="longitude and latitude"):
        cameras.read(f"#name,x,y,alt,yaw,pitch,roll,f\n{rows}", options=Options(size=(640, 480)))
    meters = f"#name,x,y,alt,yaw,pitch,roll,f\n{rows}".replace("15.0", "5015.0")
    assert len(cameras.read(meters, options=Options(size=(64, 48)))) == 2


def visualsfm(known, kind="NVM_V3", term=0.0):
    x, y, z, w = known.quaternion()
    pose = [w, -x, -y, -z, *known.e]  # the way back
    if kind == "NVM_V3_R9T":
        pose = [*known.opencv.ravel(), *(-known.opencv @ known.e)]
    calibration = f"FixedK {known.f_x!r} {known.c_x!r} {known.f_y!r} {known.c_y!r}"
    camera = f'the"left.jpg {known.f_x!r} {text_of(pose)} {term!r} 0\n'
    return f"{kind} {calibration}\n\n1\n{camera}\n2\n1 2 3 9 9 9 1 0 0 5 5\n1 2 3 9 9 9 0\n\n1\n{camera}\n0\n\n0\n"


@pytest.mark.parametrize("kind", ["NVM_V3", "NVM_V3_R9T"])
@pytest.mark.parametrize("name", UNMIRRORED)
def test_visualsfm_has_the_eye_beside_its_quaternion(name, kind):
    known = Known(name)
    read = the_same(cameras.read(visualsfm(known, kind), options=Options(size=(known.width, known.height))), known, 2.0**-48)
    assert (read.name, read.image) == ("the left", "the left.jpg") and any("more models" in note for note in read.notes)


@pytest.mark.parametrize("term", [-0.2, 0.3])
def test_visualsfms_term_is_of_the_radius_in_the_photograph(term):
    known = Known("wide")
    (camera,) = cameras.read(
        visualsfm(known, term=term).replace("FixedK", "Free"), options=Options(size=(known.width, known.height))
    )
    random = np.random.default_rng(5)
    seen = random.uniform(-0.7, 0.7, (1000, 2))
    straight = seen * (1 + term * (seen * seen).sum(axis=1, keepdims=True))  # its rule, as PBA's cost has it
    assert np.abs(camera.lens.undistort(seen) - straight).max() < 16 * 2.0**-53
    assert np.abs(camera.lens.distort(straight) - seen).max() < 64 * 2.0**-53
    if term < 0:  # turns back at 1 / √(3 · 0.2) = 1.29
        assert np.isnan(camera.lens.undistort([[1.3, 0.0]])).all() and not np.isnan(camera.lens.undistort([[1.28, 0.0]])).any()
    assert camera.pinhole.principal_point == (known.width / 2, known.height / 2)


def mvsnet(known):
    """E and K by MVSNet's README.md, with the depths that BlendedMVS adds."""
    rows = [*np.column_stack([known.opencv, -known.opencv @ known.e]), [0, 0, 0, 1]]
    k = [[known.f_x, 0, known.c_x], [0, known.f_y, known.c_y], [0, 0, 1]]
    extrinsic, intrinsic = ("\n".join(map(text_of, each)) for each in (rows, k))
    return f"extrinsic\n{extrinsic}\n\nintrinsic\n{intrinsic}\n\n425.0 2.5 192 935.0\n"


@pytest.mark.parametrize("name", UNMIRRORED)
def test_mvsnet_counts_from_the_corner(name):
    known = Known(name)
    the_same(cameras.read(mvsnet(known), options=Options(size=(known.width, known.height))), known)


def png(width, height):
    return b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">II", width, height)


def test_mvsnets_data_set_is_read_by_its_folder_with_its_pictures(tmp_path):
    known = Known("shifted")
    for name in ("cams", "blended_images"):
        (tmp_path / name).mkdir()
    for number in range(2):
        (tmp_path / "cams" / f"{number:08d}_cam.txt").write_text(mvsnet(known))
        (tmp_path / "blended_images" / f"{number:08d}.png").write_bytes(png(known.width, known.height))
    (tmp_path / "cams" / "pair.txt").write_text("1\n0\n1 1 0.5\n")
    for place in (tmp_path, tmp_path / "cams"):
        read = cameras.read(place)
        assert [(camera.name, camera.image) for camera in read] == [(f"0000000{i}", f"0000000{i}.png") for i in range(2)]
        the_same(read[1:], known)
    (tmp_path / "cams" / "00000001_cam.txt").write_text("extrinsic\n1 0 0 0\n")
    with pytest.raises(InputError, match=r"00000001_cam\.txt"):
        cameras.read(tmp_path)


def test_middlebury_lists_k_r_and_t(tmp_path):
    names = ("plain", "pixels_not_square")
    lines = []
    for name in names:
        known = Known(name)
        k = [known.f_x, 0, known.c_x - 0.5, 0, known.f_y, known.c_y - 0.5, 0, 0, 1]
        lines.append(f"{name}.png {text_of(k)} {text_of(known.opencv)} {text_of(-known.opencv @ known.e)}")
        (tmp_path / f"{name}.png").write_bytes(png(known.width, known.height))
    (tmp_path / "temple_par.txt").write_text("\n".join(["2", *lines, ""]))
    for camera, name in zip(cameras.read(tmp_path / "temple_par.txt"), names, strict=True):
        assert the_same([camera], Known(name)).image == f"{name}.png" and camera.size_stated
        assert any("half a pixel was added" in note for note in camera.notes)
    (tmp_path / "temple_par.txt").write_text("\n".join(["3", *lines, "lost.png 1 2 3", ""]))
    with pytest.raises(InputError, match=r"line 4 .* 21 numbers"):
        cameras.read(tmp_path / "temple_par.txt")


def test_the_right_camera_of_middleburys_pair_sees_a_point_further_left():
    """A depth as scenes2014 has it: Z = baseline · f / (d + doffs). The numbers are Adirondack's."""
    text = "cam0=[4161.221 0 1445.577; 0 4161.221 984.686; 0 0 1]\ncam1=[4161.221 0 1654.636; 0 4161.221 984.686; 0 0 1]\n"
    left, right = cameras.read(text + "doffs=209.059\nbaseline=176.252\nwidth=2880\nheight=1988\nndisp=280\n")
    assert (left.pinhole.width, left.pinhole.height) == (2880, 1988) and (left.name, right.image) == ("cam0", "im1.png")
    point = np.array([[120.0, -80.0, 2500.0]])
    seen = [camera.pinhole.project(point) for camera in (left, right)]
    disparity = seen[0][0] - seen[1][0]
    assert 176.252 * 4161.221 / (disparity[0] + 209.059) == pytest.approx(2500, rel=1e-12)
    assert seen[0][0][0] == pytest.approx(4161.221 * 120 / 2500 + 1445.577 + 0.5, rel=1e-14)
    assert 1988 - seen[0][1][0] == pytest.approx(4161.221 * -80 / 2500 + 984.686 + 0.5, rel=1e-13)


def projection(known, half=0.5):
    k = [[known.f_x, 0, known.c_x - half], [0, known.f_y, known.c_y - half], [0, 0, 1]]
    return k @ np.column_stack([known.opencv, -known.opencv @ known.e])


@pytest.mark.parametrize("scale", [1.0, -2.5e-3])
@pytest.mark.parametrize("name", UNMIRRORED)
def test_neus_has_one_matrix_for_k_and_the_pose(tmp_path, name, scale):
    known = Known(name)
    (tmp_path / "image").mkdir()
    (tmp_path / "image" / "0042.png").write_bytes(png(known.width, known.height))
    world = np.vstack([scale * projection(known), [0, 0, 0, 1]])
    sphere = np.diag([3.0, 3, 3, 1])
    sphere[:3, 3] = 7, 8, 9
    np.savez(tmp_path / "cameras_sphere.npz", world_mat_0=world, scale_mat_0=sphere, world_mat_inv_0=np.linalg.inv(world))
    for place in (tmp_path, tmp_path / "cameras_sphere.npz"):
        read = the_same(cameras.read(place), known, 2.0**-45)
        assert (read.name, read.image) == ("0042", "image/0042.png")
        assert any("(7, 8, 9) with the radius 3" in note for note in read.notes)


def test_neus_matrices_are_those_that_opencv_takes_apart(tmp_path):
    cv2 = pytest.importorskip("cv2")
    world = np.array(  # DTU's scan 114, as its data set has it: float32
        [
            [-646.67957, -2440.9016, 1633.1099, -517707.4],
            [677.9055, 1317.4757, 2549.6375, -1194084.2],
            [-0.902711, 0.167153, 0.396449, 407.8815],
            [0, 0, 0, 1],
        ],
        dtype=np.float32,
    )
    np.savez(tmp_path / "cameras.npz", world_mat_0=world)
    (camera,) = cameras.read(tmp_path / "cameras.npz", options=Options(size=(1600, 1200)))
    k, turn, center, *_ = cv2.decomposeProjectionMatrix(world[:3].astype(float))
    k = k / k[2, 2]
    u, v, w = camera.pinhole.axes()
    assert np.abs(np.array([u, -np.array(v), -np.array(w)]) - turn).max() < 1e-6  # float32 has seven digits
    assert camera.pinhole.eye == pytest.approx((center[:3] / center[3]).ravel(), rel=1e-9)
    assert camera.pinhole.distance == pytest.approx((k[0, 0], k[1, 1]), rel=1e-6)
    assert camera.pinhole.principal_point == pytest.approx((k[0, 2] + 0.5, 1200 - k[1, 2] - 0.5), abs=1e-3)


KITTI = """P0: 7.188560e+02 0.0 6.071928e+02 0.0 0.0 7.188560e+02 1.852157e+02 0.0 0.0 0.0 1.0 0.0
P1: 7.188560e+02 0.0 6.071928e+02 -3.861448e+02 0.0 7.188560e+02 1.852157e+02 0.0 0.0 0.0 1.0 0.0
P2: 7.188560e+02 0.0 6.071928e+02 4.538225e+01 0.0 7.188560e+02 1.852157e+02 -1.130887e-01 0.0 0.0 1.0 3.779761e-03
Tr: 4.2e-04 -9.9e-01 -8.0e-03 -1.1e-02 -7.2e-03 8.0e-03 -9.9e-01 -5.4e-02 9.9e-01 4.8e-04 -7.2e-03 -2.9e-01
"""


def test_kittis_cameras_stand_side_by_side(tmp_path):
    (tmp_path / "image_1").mkdir()
    (tmp_path / "image_1" / "000000.png").write_bytes(png(1241, 376))
    (tmp_path / "calib.txt").write_text(KITTI)
    with pytest.raises(InputError, match=r"P0 .* how many pixels"):
        cameras.read(tmp_path / "calib.txt")
    read = cameras.read(tmp_path / "calib.txt", options=Options(size=(1241, 376)))
    assert [(camera.name, camera.size_stated) for camera in read] == [("P0", False), ("P1", True), ("P2", False)]
    assert read[1].pinhole.eye == pytest.approx((3.861448e02 / 7.188560e02, 0, 0), abs=1e-12)
    points = np.random.default_rng(3).uniform([-5, -2, 4], [5, 2, 40], (50, 3))
    for camera, line in zip(read, KITTI.split("\n"), strict=False):
        p = np.array(line.split()[1:], float).reshape(3, 4)
        column, row, depth = p @ np.c_[points, np.ones(50)].T
        ours = camera.pinhole.project(points)
        assert (
            np.abs(ours[0] - (column / depth + 0.5)).max() < 1e-9 and np.abs(376 - ours[1] - (row / depth + 0.5)).max() < 1e-9
        )
    (raw,) = cameras.read("S_rect_02: 1.242e+03 3.75e+02\n" + KITTI.split("\n")[2].replace("P2", "P_rect_02") + "\n")
    assert (raw.name, raw.pinhole.width, raw.pinhole.height) == ("P_rect_02", 1242, 375)
    with pytest.raises(InputError, match="widths"):
        cameras.read("P0: 1 0 0 0 0 1 0 0 0 0 1 0\n", options=Options(size=(1242, 375)))


def test_pmvs_counts_from_the_corner_and_dtu_from_the_first_pixels_center(tmp_path):
    known = Known("shifted_and_not_square")
    options = Options(size=(known.width, known.height))
    the_same(cameras.read("CONTOUR\n" + "\n".join(map(text_of, projection(known, 0))) + "\n", options=options), known, 2.0**-48)
    for number in range(2):
        (tmp_path / f"pos_{number:03d}.txt").write_text("\n".join(map(text_of, projection(known))))
    read = cameras.read(tmp_path, options=options)
    assert [camera.name for camera in read] == ["pos_000", "pos_001"]
    the_same(read[1:], known, 2.0**-48)
    with pytest.raises(InputError, match="--pose"):  # a pose, in which K is missing
        cameras.read("1 0 0 5\n0 1 0 6\n0 0 1 7\n", options=options)


def test_bops_camera_json_is_k_alone():
    """The numbers are those of LM's camera.json."""
    sensor = {"cx": 325.2611, "cy": 242.04899, "depth_scale": 1.0, "fx": 572.4114, "fy": 573.57043, "height": 480, "width": 640}
    (camera,) = cameras.read(json.dumps(sensor))
    column, row, _ = camera.pinhole.project(np.array([[0.1, -0.2, 1.5]]))
    assert column[0] == pytest.approx(572.4114 / 15 + 325.2611 + 0.5, rel=1e-14)
    assert 480 - row[0] == pytest.approx(-573.57043 * 2 / 15 + 242.04899 + 0.5, rel=1e-13)
    assert any("no world" in note for note in camera.notes)


def pose_text(known):
    return "\n".join(map(text_of, [*np.column_stack([known.opencv.T, known.e]), [0, 0, 0, 1]])) + "\n"


@pytest.mark.parametrize("name", UNMIRRORED)
def test_redwoods_log_has_five_lines_a_pose_and_replicas_trajectory_one(name):
    known = Known(name)
    plane = ViewPlane(known.pinhole.distance, known.pinhole.principal_point, known.width, known.height)
    line = pose_text(known).replace("\n", " ")
    for text in (f"0 0 1\n{pose_text(known)}1 1 2\n{pose_text(known)}", f"{line}\n{line}\n"):
        first, second = cameras.read(text, options=Options(view_plane=plane))
        the_same([first], known)
        the_same([second], known)
        assert second.time == pytest.approx(1 / 30) and any("whose poses" in note for note in first.notes)


def test_scannets_folder_has_its_intrinsics_and_pictures(tmp_path):
    known = Known("shifted")
    for name in ("pose", "color", "intrinsic"):
        (tmp_path / name).mkdir()
    k = [[known.f_x, 0, known.c_x - 0.5, 0], [0, known.f_y, known.c_y - 0.5, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    (tmp_path / "intrinsic" / "intrinsic_color.txt").write_text("\n".join(map(text_of, k)))
    (tmp_path / "color" / "0.jpg").write_bytes(png(known.width, known.height))
    for number in (0, 2, 10):
        (tmp_path / "pose" / f"{number}.txt").write_text(pose_text(known))
    (tmp_path / "pose" / "3.txt").write_text("-inf -inf -inf -inf\n" * 4)
    for place in (tmp_path, tmp_path / "pose"):
        read = cameras.read(place)
        assert [(camera.name, camera.image) for camera in read] == [(f"{i}", f"{i}.jpg") for i in (0, 2, 10)]
        assert the_same(read[2:], known).size_stated and any("1 picture not placed" in note for note in read[0].notes)
    the_same(cameras.read(tmp_path / "pose" / "2.txt", options=Options(size=(known.width, known.height))), known)


def test_a_scan_of_3rscan_has_its_intrinsics_and_size_in_its_info(tmp_path):
    known = Known("shifted")
    k = f"{known.f_x!r} 0 {known.c_x - 0.5!r} 0 0 {known.f_y!r} {known.c_y - 0.5!r} 0 0 0 1 0 0 0 0 1"
    info = f"m_colorWidth = {known.width}\nm_colorHeight = {known.height}\nm_calibrationColorIntrinsic = {k} \n"
    (tmp_path / "_info.txt").write_text(f"m_versionNumber = 4\nm_sensorName = a phone\n{info}m_frames.size = 1\n")
    (tmp_path / "frame-000000.pose.txt").write_text(pose_text(known))
    assert the_same(cameras.read(tmp_path), known).size_stated
    (tmp_path / "_info.txt").write_text("m_colorWidth = 640\n")
    with pytest.raises(InputError, match=r"K in .*_info\.txt is .*give a number"):
        cameras.read(tmp_path)


def test_seven_scenes_frames_go_to_the_world_and_a_pose_of_nobody_knows_is_asked_for(tmp_path):
    known = Known("plain")
    (tmp_path / "frame-000001.pose.txt").write_text(pose_text(known))
    options = Options(base=known.pinhole)
    assert the_same(cameras.read(tmp_path, options=options), known).name == "frame-000001"
    with pytest.raises(InputError, match="--pose"):
        cameras.read(pose_text(known), options=options)
    the_same(cameras.read(pose_text(known), options=Options(base=known.pinhole, pose="c2w_opencv")), known)
    with pytest.raises(InputError, match="how it sees"):
        cameras.read(tmp_path)


# ---- MuJoCo and The Ray Tracer Challenge, by numbers that MuJoCo itself and the book say

VGA = Options(size=(640, 480))


def mujoco(camera, before="", around=("", "")):
    return f"<mujoco>{before}<worldbody>{around[0]}{camera}{around[1]}</worldbody></mujoco>"


def axes_and_eye(text):
    (camera,) = cameras.read(text, options=VGA)
    return np.column_stack(camera.pinhole.axes()), camera.pinhole.eye, camera.pinhole


# cam_xmat of MuJoCo 3, row by row, to six digits
MATRICES_OF_MUJOCO = {
    'xyaxes="0 1 0 -1 0 2"': [0, -0.447214, 0.894427, 1, 0, 0, 0, 0.894427, 0.447214],
    'quat="0.9 0.1 -0.3 0.2"': [0.726316, -0.442105, -0.526316, 0.315789, 0.894737, -0.315789, 0.610526, 0.063158, 0.789474],
    'euler="10 20 30"': [0.813798, -0.469846, 0.34202, 0.543838, 0.823173, -0.163176, -0.204874, 0.318796, 0.925417],
    'zaxis="1 2 3"': [0.960357, -0.079287, 0.267261, -0.079287, 0.841427, 0.534522, -0.267261, -0.534522, 0.801784],
    'axisangle="1 1 0 30"': [0.933013, 0.066987, 0.353553, 0.066987, 0.933013, -0.353553, -0.353553, 0.353553, 0.866025],
    "": [1, 0, 0, 0, 1, 0, 0, 0, 1],
}


@pytest.mark.parametrize("orientation", MATRICES_OF_MUJOCO)
def test_mujocos_camera_has_the_matrix_that_mujoco_computes(orientation):
    turn, eye, pinhole = axes_and_eye(mujoco(f'<camera name="a" pos="1 2 3" {orientation} fovy="40"/>'))
    np.testing.assert_allclose(turn, np.reshape(MATRICES_OF_MUJOCO[orientation], (3, 3)), atol=1e-6)
    assert eye == (1, 2, 3) and not pinhole.mirrored
    assert pinhole.distance[1] == pytest.approx(240 / math.tan(math.radians(20)))


def test_a_camera_of_a_body_stands_where_the_body_stands():
    """By MuJoCo 3: eye 3 1 3."""
    around = '<body pos="5 0 0" euler="0 0 90">', "</body>"
    turn, eye, pinhole = axes_and_eye(mujoco('<camera pos="1 2 3" euler="10 20 30"/>', around=around))
    expected = [-0.543838, -0.823173, 0.163176, 0.813798, -0.469846, 0.34202, -0.204874, 0.318796, 0.925417]
    np.testing.assert_allclose(turn, np.reshape(expected, (3, 3)), atol=1e-6)
    assert eye == pytest.approx((3, 1, 3)) and pinhole.distance[1] == pytest.approx(240 / math.tan(math.radians(22.5)))


def test_mujocos_compiler_says_the_unit_and_the_order_of_angles():
    """Capitals turn about the axes that stay, so the order is the other way round."""
    angles = [math.radians(angle) for angle in (30, 20, 10)]
    before = '<compiler angle="radian" eulerseq="ZYX"/>'
    turn, _, _ = axes_and_eye(mujoco(f'<camera pos="1 2 3" euler="{" ".join(map(repr, angles))}"/>', before))
    np.testing.assert_allclose(turn, np.reshape(MATRICES_OF_MUJOCO['euler="10 20 30"'], (3, 3)), atol=1e-6)


def test_mujocos_sensor_is_the_lens_and_the_resolution_the_size():
    text = '<camera pos="0 0 0" resolution="320 200" sensorsize="0.0064 0.004" focal="0.005 0.006" zaxis="0 0 1"/>'
    (camera,) = cameras.read(text)
    assert camera.size_stated and (camera.pinhole.width, camera.pinhole.height) == (320, 200)
    assert camera.pinhole.distance == pytest.approx((250, 300))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (mujoco('<camera pos="0 0 0" mode="targetbody" target="a"/>'), "turns towards a body"),
        (mujoco('<camera pos="0 0 0" quat="1 0 0 0" euler="0 0 0"/>'), "MuJoCo takes one orientation"),
        (mujoco('<camera pos="0 0 0" xyaxes="1 0 0 2 0 0"/>'), "no direction"),
        (mujoco('<camera pos="0 0 0" projection="orthographic"/>'), "orthographic"),
        (mujoco('<camera pos="0 0" />'), "has 2 numbers"),
        (mujoco('<camera pos="0 0 0" fovy="180"/>'), "between 0 and 180"),
        (mujoco('<camera pos="0 0 0" principal="0.1 0"/>'), "principal point"),
        (
            mujoco('<camera pos="0 0 0"/>', '<default><default class="a"><camera fovy="3"/></default></default>'),
            "default class",
        ),
        (mujoco('<camera pos="0 0 0"/>', '<compiler eulerseq="abc"/>'), "eulerseq"),
    ],
)
def test_what_is_not_read_of_mujoco_is_named(text, problem):
    with pytest.raises(InputError, match=problem):
        cameras.read(text, options=VGA)


BOOK = """
# a comment
- add: light
  at: [ -10, 10, -10 ]
  intensity: [ 1, 1, 1 ]
- add: camera
  width: 201
  height: 101
  field-of-view: 1.5707963267948966
  from: [ 0, 0, 0 ]
  to: [ 0, 0, -1 ]
  up: [ 0, 1, 0 ]
- add: plane
  from: [ 3, 3, 3 ]
"""


def test_the_first_pixels_ray_is_the_one_that_the_ray_tracer_challenge_prints():
    assert cameras.recognized(BOOK) == "ray_tracer_challenge"
    (camera,) = cameras.read(BOOK)
    pinhole = camera.pinhole
    assert pinhole.mirrored and any("left-handed" in note for note in camera.notes)
    column, row, _ = pinhole.project(np.array([[0.66519, 0.33259, -0.66851]]))
    assert (column[0], row[0]) == pytest.approx((0.5, 100.5), abs=2e-3)  # the upper left pixel's center, of five digits


def test_the_books_angle_is_of_the_longer_side():
    upright = BOOK.replace("width: 201", "width: 50").replace("height: 101", "height: 100")
    assert cameras.read(upright)[0].pinhole.distance == pytest.approx((50, 50))


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("  up: [ 0, 1, 0 ]\n", "", "has no up"),
        ("1.5707963267948966", "60", "radians"),
        ("[ 0, 0, -1 ]", "[ 0, 0 ]", "2 numbers"),
    ],
)
def test_what_the_books_camera_lacks_is_named(old, new, problem):
    with pytest.raises(InputError, match=problem):
        cameras.read(BOOK.replace(old, new))
    with pytest.raises(InputError, match="adds 2 cameras"):
        cameras.read(BOOK + BOOK)


@pytest.mark.parametrize("name", UNMIRRORED)
def test_realestate10k_counts_in_the_pictures_sides(name):
    known = Known(name)
    parts = [known.f_x / known.width, known.f_y / known.height, known.c_x / known.width, known.c_y / known.height]
    pose = np.column_stack([known.opencv, -known.opencv @ known.e])
    text = f"https://www.youtube.com/watch?v=abc\n\n33366667 {text_of(parts)} 0.0 0.0 {text_of(pose)}\n"
    with pytest.raises(InputError, match="give the size"):
        cameras.read(text)
    size = Options(size=(known.width, known.height))
    assert len(cameras.read("\n".join(text.splitlines()[2:] * 2), options=size)) == 2
    read = the_same(cameras.read(text, options=size), known, 2.0**-48)
    assert (read.name, read.time, read.size_stated) == ("33366667", 33.366667, False)


def test_what_realestate10k_does_not_explain_is_refused():
    text = "https://a.b/c\n0 1 1 0.5 0.5 {} 0 1 0 0 0 0 1 0 0 0 0 1 0\n"
    (camera,) = cameras.read(text.format("0.0"), options=Options(size=(640, 360)))
    assert camera.pinhole.distance == (640, 360) and camera.pinhole.principal_point == (320, 180)
    with pytest.raises(InputError, match="what they mean is not published"):
        cameras.read(text.format("0.1"), options=Options(size=(640, 360)))
    with pytest.raises(InputError, match="focal lengths 0 and 1"):
        cameras.read(text.replace("0 1 1", "0 0 1", 1).format("0.0"), options=Options(size=(640, 360)))


def basalt(known, kind="pinhole", **numbers):
    x, y, z, w = known.quaternion()
    pose = dict(zip(("px", "py", "pz", "qx", "qy", "qz", "qw"), (*known.e.tolist(), x, y, z, w), strict=True))
    k = {"fx": known.f_x, "fy": known.f_y, "cx": known.c_x - 0.5, "cy": known.c_y - 0.5}
    entry = {"camera_type": kind, "intrinsics": k | numbers}
    return {"T_imu_cam": [pose], "intrinsics": [entry], "resolution": [[known.width, known.height]]}


@pytest.mark.parametrize("name", UNMIRRORED)
def test_basalts_cameras_stand_on_their_imu(name):
    known = Known(name)
    the_same(cameras.read(json.dumps({"value0": basalt(known)})), known, 2.0**-48)


def test_basalts_lenses_are_opencvs_and_double_spheres_are_left_out():
    cv2, known = pytest.importorskip("cv2"), Known("plain")
    k = dict(
        zip(("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), (0.3, -0.1, 1e-3, -2e-3, 0.01, 0.6, -0.1, 0.02), strict=True)
    )
    several = basalt(known, "pinhole-radtan8", rpmax=2.7, **k)
    for key, value in basalt(known, "ds", xi=-0.2, alpha=0.6).items():
        several[key] += value
    (camera,) = cameras.read(json.dumps({"value0": several}))
    points = np.array([[0.1, 0.2], [-0.3, 0.15], [0.25, -0.2]])
    rays = np.column_stack([points, np.ones(3)])
    theirs, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), np.array([*k.values()]))
    assert np.abs(camera.lens.distort(points) - theirs[:, 0]).max() < 1e-12
    assert camera.name == "cam0" and any("cam1 is of the model 'ds'" in note for note in camera.notes)


def azure_kinect(known):
    numbers = [known.c_x / known.width, known.c_y / known.height, known.f_x / known.width, known.f_y / known.height]
    pose = {"Rotation": known.opencv.ravel().tolist(), "Translation": (-known.opencv @ known.e).tolist()}
    model = {"ModelType": "CALIBRATION_LensDistortionModelBrownConrady", "ModelParameters": [*numbers, *[0.0] * 10]}
    entry = {"Intrinsics": model, "Rt": pose, "SensorWidth": known.width, "SensorHeight": known.height}
    entry["Location"] = "CALIBRATION_CameraLocationPV0"
    return {"CalibrationInformation": {"Cameras": [entry]}}


@pytest.mark.parametrize("name", UNMIRRORED)
def test_azure_kinect_counts_in_the_sides_of_its_sensor(tmp_path, name):
    """A published device: its SDK prints 0.49676 and 0.470907 of 1920, 953.784 and 904.1415, as 953.284 and 904.1415."""
    known = Known(name)
    document = azure_kinect(known)
    path = tmp_path / "calibration.json"
    path.write_bytes(json.dumps(document).encode() + b"\0")
    assert the_same(cameras.read(path), known, 2.0**-48).name == "PV0"
    model = document["CalibrationInformation"]["Cameras"][0]["Intrinsics"]
    model["ModelParameters"][-2:] = [-2e-3, 1e-3]
    (camera,) = cameras.read(json.dumps(document))
    assert camera.lens.tangential == (1e-3, -2e-3)
    model["ModelType"] = "CALIBRATION_LensDistortionModelRational6KT"
    with pytest.raises(InputError, match="Rational6KT"):
        cameras.read(json.dumps(document))


def nuscenes(known):
    """The tables of a camera on a vehicle that has turned by 90° to the left and moved, and of a lidar."""
    vehicle = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    moved = np.array([600.0, 1600, 0])
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    quaternions = [
        rotation.from_matrix(each).as_quat()[[3, 0, 1, 2]].tolist() for each in (vehicle, vehicle.T @ known.opencv.T)
    ]
    place = (vehicle.T @ (known.e - moved)).tolist()
    k = [[known.f_x, 0, known.c_x - 0.5], [0, known.f_y, known.c_y - 0.5], [0, 0, 1]]
    lidar = {"token": "l", "translation": [0, 0, 2], "rotation": [1, 0, 0, 0], "camera_intrinsic": []}
    picture = {"filename": "samples/CAM_FRONT/a.jpg", "width": known.width, "height": known.height, "ego_pose_token": "e"}
    return {
        "calibrated_sensor": [lidar, {"token": "c", "translation": place, "rotation": quaternions[1], "camera_intrinsic": k}],
        "ego_pose": [{"token": "e", "timestamp": 1, "translation": moved.tolist(), "rotation": quaternions[0]}],
        "sample_data": [picture | {"calibrated_sensor_token": "l"}, picture | {"calibrated_sensor_token": "c"}],
    }


@pytest.mark.parametrize("name", [name for name in UNMIRRORED if name != "far"])
def test_nuscenes_cameras_stand_on_a_vehicle_that_moves(tmp_path, name):
    known = Known(name)
    for table, rows in nuscenes(known).items():
        (tmp_path / f"{table}.json").write_text(json.dumps(rows))
    read = the_same(cameras.read(tmp_path), known, 2.0**-40)
    assert (read.name, read.image) == ("a", "samples/CAM_FRONT/a.jpg")
    (alone,) = cameras.read(tmp_path / "calibrated_sensor.json", options=Options(size=(640, 360)))
    assert alone.name == "c" and any("stands at the origin" in note for note in alone.notes)


def gazebo(known, pose, camera="", attributes=""):
    angle = 2 * math.atan2(known.width / 2, known.f_x)
    return (
        f'<sdf version="1.9"><world name="w"><model name="m"><pose>1 2 3 0 0 {math.pi / 2!r}</pose><link name="l">'
        f'<sensor name="s" type="camera"><pose {attributes}>{pose}</pose><camera><horizontal_fov>{angle!r}</horizontal_fov>'
        f"<image><width>{known.width}</width><height>{known.height}</height></image>{camera}</camera></sensor></link></model>"
        "</world></sdf>"
    )


@pytest.mark.parametrize("name", [name for name in CENTERED if name != "far"])
@pytest.mark.parametrize("form", ["radians", "degrees", "quaternion"])
def test_gazebos_camera_looks_along_x_in_its_model(name, form):
    """The model has turned by 90°: its x is the world's y."""
    known = Known(name)
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    model = rotation.from_euler("z", 90, degrees=True)
    sensor = model.inv() * rotation.from_matrix(np.column_stack([-known.w, -known.u, known.v]))
    place = model.inv().apply(known.e - np.array([1, 2, 3]))
    turn = sensor.as_quat() if form == "quaternion" else sensor.as_euler("xyz", degrees=form == "degrees")
    attributes = {"radians": "", "degrees": 'degrees="true"', "quaternion": 'rotation_format="quat_xyzw"'}[form]
    the_same(cameras.read(gazebo(known, text_of([*place, *turn]), attributes=attributes)), known, 2.0**-40)


def test_gazebos_camera_that_nothing_turns_looks_along_the_models_x():
    (camera,) = cameras.read(gazebo(Known("plain"), "0.5 0 0 0 0 0"))
    assert np.allclose(camera.pinhole.eye, (1, 2.5, 3)) and np.allclose(
        camera.pinhole.axes(), [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    )
    lens = "<lens><intrinsics><fx>500</fx><fy>400</fy><cx>300</cx><cy>200</cy></intrinsics></lens>"
    (camera,) = cameras.read(gazebo(Known("plain"), "0 0 0 0 0 0", lens))
    assert camera.pinhole.distance == (500, 400)
    assert camera.pinhole.principal_point == (300, Known("plain").height - 200)
    for more, attributes, problem in (
        ("<distortion><k1>-0.1</k1></distortion>", "", "a distortion"),
        ("<lens><type>equidistant</type></lens>", "", "equidistant"),
        ("", 'relative_to="arm"', "relative to 'arm', which does not stand beside it"),
        ("", 'relative_to="a::b"', "relative to 'a::b', which does not stand beside it"),
    ):
        with pytest.raises(InputError, match=problem):
            cameras.read(gazebo(Known("plain"), "0 0 0 0 0 0", more, attributes))


@pytest.mark.parametrize(
    ("frames", "relative_to"),
    [
        ('<frame name="f"><pose>0 0 1 0 0 0</pose></frame>', "f"),
        (
            '<frame name="f" attached_to="o"><pose>0 0 0.5 0 0 0</pose></frame><link name="o"><pose>0 0 .5 0 0 0</pose></link>',
            "f",
        ),
        ('<joint name="j"><child>o</child></joint><link name="o"><pose relative_to="__model__">0 0 1 0 0 0</pose></link>', "j"),
        (
            '<model name="n"><pose relative_to="f">0 0 1 0 0 0</pose></model><frame name="f"/>',
            "n",
        ),
    ],
)
def test_gazebos_poses_are_followed_through_the_frames_of_their_model(frames, relative_to):
    """The link stands 5 aside, which does not count: its sensor's pose is relative to what is 1 above the model."""
    text = gazebo(Known("plain"), "0.5 0 0 0 0 0", attributes=f'relative_to="{relative_to}"')
    text = text.replace('<link name="l">', f'{frames}<link name="l"><pose>0 5 0 0 0 0</pose>')
    (camera,) = cameras.read(text)
    assert np.allclose(camera.pinhole.eye, (1, 2.5, 4)), f"{camera.pinhole.eye} for 1, 2.5, 4"


def test_gazebos_poses_that_lead_to_themselves_or_stand_for_another_are_refused():
    text = gazebo(Known("plain"), "0.5 0 0 0 0 0", attributes='relative_to="f"')
    circle = '<frame name="f"><pose relative_to="g"/></frame><frame name="g" attached_to="f"/>'
    with pytest.raises(InputError, match="'f', which leads back to it"):
        cameras.read(text.replace('<link name="l">', f'{circle}<link name="l">'))
    with pytest.raises(InputError, match="placement_frame"):
        cameras.read(text.replace('<model name="m">', '<model name="m" placement_frame="l">'))


def nerfies(known, **more):
    return {
        "orientation": known.opencv.tolist(),
        "position": known.e.tolist(),
        "focal_length": known.f_x,
        "pixel_aspect_ratio": known.f_y / known.f_x,
        "principal_point": [known.c_x, known.c_y],
        "image_size": [known.width, known.height],
        "skew": 0.0,
        "radial_distortion": [0, 0, 0],
        "tangential": [0, 0],
        **more,
    }


@pytest.mark.parametrize("name", UNMIRRORED)
def test_nerfies_have_world_to_camera_and_the_eye(tmp_path, name):
    known = Known(name)
    (tmp_path / "camera").mkdir()
    (tmp_path / "camera" / "000001.json").write_text(json.dumps(nerfies(known)))
    read = the_same(cameras.read(tmp_path), known, 2.0**-48)
    assert (read.name, read.image) == ("000001", "000001.png")


def test_nerfies_lens_is_opencvs_and_skew_is_named():
    cv2, known = pytest.importorskip("cv2"), Known("plain")
    document = nerfies(known, radial_distortion=[-0.1, 0.02, 0.003], tangential=[1e-3, -2e-3])
    (camera,) = cameras.read(json.dumps(document))
    points = np.array([[0.1, 0.2], [-0.3, 0.15], [0.25, -0.2]])
    rays = np.column_stack([points, np.ones(3)])
    coefficients = np.array([-0.1, 0.02, 1e-3, -2e-3, 0.003])
    theirs, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), coefficients)
    assert np.abs(camera.lens.distort(points) - theirs[:, 0]).max() < 1e-12
    with pytest.raises(InputError, match="a camera with skew"):
        cameras.read(json.dumps(nerfies(known, skew=2.0)))
