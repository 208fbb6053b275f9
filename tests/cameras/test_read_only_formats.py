"""Formats that are only read: files made here by each format's own rule, from the camera's axes alone, are the same camera."""

import json
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


def metashape(known, lens="", label="left.jpg"):
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])  # of the chunk, with a scale of 2.5 and a move
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
    assert not read.size_stated and any("1 cameras that were not placed" in note for note in read.notes)


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
    wide = 1 + known.f_y / known.height  # of a telephoto's angle less is kept
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


def test_yaml_in_brackets_is_read_as_pyyaml_reads_it():
    from viewcam_addon.cameras import yaml as ours

    yaml = pytest.importorskip("yaml")
    text = "a: {rows: 3, 'b c': [1.5, 2, [x y, 4]], d: {e: http://f/g, h: {}}}\nk: [[1, 2], [3, -4.0e-3]]\n"
    assert ours.read(text) == yaml.safe_load(text)
    for broken in ("[1, 2", "[1 2]]", "{a: 1", "{a: 1]", "[" * 50 + "]" * 50, "{[1]: 2}"):
        assert ours.read(f"k: {broken}\nl: 1\n").get("k") in (broken, f"{broken} l: 1", None)


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
