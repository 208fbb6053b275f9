"""Files as strangers publish them, in ways of their own: read as their program sees them, or refused.

Each text is the least that shows what was read wrongly, or refused without need, of files that stand in public repositories.

Files with several cameras, one of which is no pinhole: the others are read, and that one is named.
"""

import dataclasses
import json
import math
import re
import time
from pathlib import Path

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Camera, Options, axes, distortion
from viewcam_addon.cameras.source import Source
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

from . import test_read_only_formats as files
from .conftest import CAMERAS

VGA = Options(size=(640, 480))
THREE = "const camera = new THREE.PerspectiveCamera(50, 1.333, 0.1, 100); camera.position.set(3, 4, 5);"
ROS = """image_width: 640
image_height: 480
camera_name: front
camera_matrix:
  rows: 3
  cols: 3
  data: [500, 0, 320, 0, 500, 240, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficents:
  rows: 1
  cols: 5
  data: [-0.2, 0.1, 0, 0, 0]
"""


def read(text):
    (camera,) = cameras.read(text, options=VGA)
    return camera


@pytest.mark.parametrize("name", ["OrbitControls", "TrackballControls", "MapControls", "ArcballControls"])
@pytest.mark.parametrize("before", ["", "camera.lookAt(0, 5, 0);"])
def test_controls_turn_the_camera_to_their_target_whatever_it_looked_at_before(name, before):
    program = f"{before} const controls = new THREE.{name}(camera, canvas);"
    assert read(THREE + program).pinhole.look_at == (0, 0, 0)
    with pytest.raises(InputError, match="write the target in plain numbers"):
        read(THREE + program + "controls.target.set(1, height, 0);")
    aimed = read(THREE + program + "controls.target.set(1, 2, 0);")
    assert aimed.pinhole.look_at == (1, 2, 0) and any(name in note for note in aimed.notes)


def test_a_position_that_is_computed_and_then_changed_in_one_coordinate_is_refused():
    with pytest.raises(InputError, match="plain numbers"):
        read("const eye = new THREE.Mesh(ball, red); camera.position.z = 5;")


@pytest.mark.parametrize("later", ["r = f(r);", "r = clamp(r, 1, 9);", "if (near) { r = distance(a, b); }", "r = 5; " * 30])
def test_a_name_that_is_known_once_and_computed_elsewhere_is_not_known(later):
    code = "float r = 5; {} gluPerspective(60, 1.333, 1, 100); gluLookAt(r, 0, 0, 0, 0, 0, 0, 0, 1);"
    assert read(code.format("")).pinhole.eye == (5, 0, 0)
    with pytest.raises(InputError, match="plain numbers"):
        read(code.format(later))


def test_meshes_that_are_called_eyes_are_no_cameras():
    assert read(THREE + "leftEye.position.x = -3; rightEye.position.x = 3;").pinhole.eye == (3, 4, 5)


def test_a_size_that_is_computed_twice_is_no_contradiction():
    resized = "renderer.setSize(innerWidth, innerHeight); onresize = () => { renderer.setSize(innerWidth, innerHeight); };"
    assert read(THREE + resized + "camera.lookAt(0, 0, 0);").pinhole.look_at == (0, 0, 0)


TURNED = "gluPerspective(60, 1.333, 1, 100); gluLookAt(eye.x, eye.y, eye.z, 0, 0, 0, 0, 1, 0);"
REFUSED = {
    "controls that turn it by themselves": (THREE + "new FirstPersonControls(camera).lon = -150;", "turn the camera"),
    "positions of several": (
        "a = new THREE.PerspectiveCamera(50, 1, 1, 9); a.position.z = 2; b = new THREE.PerspectiveCamera(50, 1, 1, 9);"
        "b.position.x = 2;",
        "another camera than a",
    ),
    "a name that is stepped": (
        f"angle = 0; {THREE} angle += 0.005; camera.position.x = Math.sin(angle) * 50;",
        "computed",
    ),
    "one coordinate by its number": (
        "lookfrom = vec3(1, 2, 3); lookfrom[2] = 9; lookat = vec3(0); vup = vec3(0, 1, 0);",
        "one",
    ),
    "one coordinate by its name": (f"vec3 eye(1, 2, 3); eye.z = 10; {TURNED}", "one coordinate"),
    "a light's focal point": (
        "vtkLight light; cam = vtkCamera(); cam.SetPosition(1, 2, 3); lgt = vtkLight(); lgt.SetFocalPoint(1, 1, 1)",
        "target",
    ),
    "distortion by a word with a slip": (ROS, "distortioncoefficents"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_would_be_another_camera_is_refused(what):
    text, sentence = REFUSED[what]
    with pytest.raises(InputError, match=sentence):
        read(text)


def test_a_key_of_the_keyboard_is_no_camera():
    assert read(f'{THREE} camera.lookAt(0, 0, 0); keyboard.up("R");').pinhole.up == (0, 1, 0)


def test_vtks_window_says_the_size_unless_it_has_several_views():
    text = (
        "renWin->SetSize(512, 256); camera->SetPosition(1, 2, 3); camera->SetFocalPoint(0, 0, 0); camera->SetViewUp(0, 1, 0);"
    )
    (camera,) = cameras.read(text)
    assert (camera.pinhole.width, camera.pinhole.height) == (512, 256)
    with pytest.raises(InputError, match="pixels"):
        cameras.read(text + "left->SetViewport(0, 0, 0.5, 1);")


def pov(text):
    return read(text).pinhole


def test_pov_rays_names_stand_for_what_they_were_where_they_are_used():
    declared = "#declare A = 1; #declare B = A * 2; #declare A = 5; camera { location <0, 1, -B> look_at 0 }"
    assert pov(declared).eye == (0, 1, -2)
    kept = "#declare D = 3; #declare C = camera { location <0, 1, -D> look_at 0 } #declare D = 9; camera { C }"
    assert pov(kept).eye == (0, 1, -3)


def test_pov_rays_names_that_double_twenty_times_take_no_time():
    doubled = "".join(f"#declare A{n + 1} = A{n} + A{n};" for n in range(19))
    started = time.process_time()
    assert pov(f"#declare A0 = 1; {doubled} camera {{ location <0, 1, -A19> look_at 0 }}").eye == (0, 1, -(2**19))
    assert time.process_time() - started < 1  # each twice as often as the one before: half a minute


@pytest.mark.parametrize(("version", "aspect"), [("3.7", 1.33), ("3.8", 640 / 480)])
def test_without_right_pov_rays_picture_is_1_33_times_as_wide_and_since_3_8_as_wide_as_the_film(version, aspect):
    pinhole = pov(f"#version {version}; camera {{ location <0, 0, -9> look_at 0 angle 60 }}")
    d_x, d_y = pinhole.distance  # the pixels are not square where the size is of another shape than the view plane
    assert (pinhole.width / d_x) / (pinhole.height / d_y) == pytest.approx(aspect, rel=1e-12)


def test_pov_ray_keeps_right_where_it_looks_along_the_sky():
    straight_down = pov("camera { location <1, 9, 2> look_at <1, 0, 2> right x * 4 / 3 angle 60 }")
    u, v, w = straight_down.basis()
    # up is look × right: (0, −1, 0) × (1, 0, 0), and x points right in the picture, which is mirrored.
    assert v == pytest.approx((0, 0, 1), abs=1e-15) and w == pytest.approx((0, 1, 0), abs=1e-15)
    assert straight_down.mirrored and u == pytest.approx((-1, 0, 0), abs=1e-15)


def test_opengls_arrays_of_sixteen_numbers_are_matrices():
    view = "GLfloat viewMatrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -2, -3, -4, 1};"
    projection = "const GLfloat projectionMatrix[16] = {1.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1.002, -1, 0, 0, -0.2002, 0};"
    assert read(view + projection).pinhole.eye == (2, 3, 4)


def test_mitsubas_parameters_matter_where_the_camera_needs_them():
    scene = """<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="{}"/>
        <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/>
        <string name="decomposition" value="$how"/></film></sensor></scene>"""
    assert read(scene.format(90)).pinhole.distance[0] == pytest.approx(32, rel=4 * 2**-53)
    with pytest.raises(InputError, match=r"fov .* '\$wide'"):
        read(scene.format("$wide"))


def test_mitsubas_scalar_points_are_points():
    look = "mi.ScalarTransform4f().look_at(origin=mi.ScalarPoint3f(0, 0, 10), target=[0, 0, 0], up=[0, 1, 0])"
    film = "{'type': 'hdrfilm', 'width': 64, 'height': 48}"
    assert read(f"{{'type': 'perspective', 'fov': 45, 'to_world': {look}, 'film': {film}}}").pinhole.eye == (0, 0, 10)


def test_a_scene_of_three_js_editor_has_its_windows_camera_and_its_own():
    lens = {"type": "PerspectiveCamera", "fov": 90, "aspect": 4 / 3}
    matrices = ([*(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0), 0, 0, z, 1] for z in (3, 7))
    first, second = ({**lens, "name": f"{index}", "matrix": matrix} for index, matrix in enumerate(matrices))
    document = {"metadata": {}, "camera": {"object": first}, "scene": {"object": {"type": "Scene", "children": [second]}}}
    cameras_read = cameras.read(json.dumps(document), options=VGA)
    assert [camera.pinhole.eye[2] for camera in cameras_read] == [3, 7]
    assert all(math.isclose(camera.pinhole.distance[1], 240, rel_tol=4 * 2**-53) for camera in cameras_read)


def test_a_stray_sign_before_pbrts_first_statement_hides_nothing_of_it():
    text = '-Scale -1 1 1\nLookAt 7 -6 4  0 0 1  0 0 1\nCamera "perspective" "float fov" 40\n'
    assert cameras.recognized(text) == "pbrt" and not read(text).pinhole.mirrored


GIVEN = Options(size=(640, 360))
KNOWN = files.Known("plain")
TURN, EYE = KNOWN.opencv.ravel().tolist(), KNOWN.e.tolist()


def transforms():
    document = json.loads(cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "transforms"))
    lens = {key: document.pop(key) for key in ("fl_x", "fl_y", "cx", "cy", "w", "h", "camera_angle_x", "camera_angle_y")}
    for frame, more in zip(document["frames"], ({}, {"camera_model": "EQUIRECTANGULAR"}), strict=True):
        frame.update(lens | more)
    return json.dumps(document)


def colmap(model="2 EQUIRECTANGULAR 640 360 640 360"):
    return {
        "cameras.txt": f"1 PINHOLE 640 360 600 600 320 180\n{model}\n",
        "images.txt": "1 1 0 0 0 0 0 4 1 good.png\n\n2 1 0 0 0 0.1 0 4 2 bad.png\n\n",
    }


def colmap_binary(tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    for name, text in (colmap() | {"points3D.txt": ""}).items():
        (tmp_path / name).write_text(text)
    pycolmap.Reconstruction(tmp_path).write_binary(tmp_path)
    return tmp_path


def kalibr():
    both = "\n  resolution: [640, 360]\n  intrinsics: [600, 600, 320, 180]\n  distortion_coeffs: [0, 0, 0, 0]\n"
    return f"good:{both}  distortion_model: radtan\nbad:{both}  distortion_model: fov\n"


def opencv():
    k = {"K": [[600, 0, 320], [0, 600, 180], [0, 0, 1]], "image_size": [640, 360]}
    return json.dumps({"good": k, "bad": k | {"model": "omni"}})


def skewed():
    k = {"image_size": [640, 360]}
    return json.dumps(
        {"good": k | {"K": [[600, 0, 320], [0, 600, 180], [0, 0, 1]]}, "bad": k | {"K": [600, 5, 320, 0, 600, 180, 0, 0, 1]}}
    )


def metashape():
    sphere = '<sensor id="1" type="spherical"><resolution width="8000" height="4000"/></sensor></sensors>'
    placed = (
        f'<camera id="7" label="bad.jpg" sensor_id="1"><transform>{files.text_of(np.eye(4))}</transform></camera></cameras>'
    )
    text = files.metashape(KNOWN, label="good.jpg")
    return text.replace("</sensors>", sphere).replace("</cameras>", placed)


def meshroom():
    views = [{"viewId": f"{i}", "poseId": f"{i}", "intrinsicId": f"{i}", "path": f"{name}.jpg"} for i, name in NAMED]
    lens = {"width": "640", "height": "360", "focalLength": "36", "sensorWidth": "36"}
    intrinsics = [lens | {"intrinsicId": f"{i}", "type": kind} for i, kind in enumerate(("pinhole", "equidistant"))]
    pose = {"transform": {"rotation": [*map(str, TURN)], "center": [*map(str, EYE)]}}
    poses = [{"poseId": f"{i}", "pose": pose} for i in range(2)]
    return json.dumps({"version": ["1", "2", "11"], "views": views, "intrinsics": intrinsics, "poses": poses})


def openmvg():
    def data(**values):
        return {"ptr_wrapper": {"data": values}}

    lens = {"width": 640, "height": 360, "focal_length": 600, "principal_point": [320, 180]}
    return json.dumps(
        {
            "sfm_data_version": "0.3",
            "views": [{"key": i, "value": data(filename=f"{name}.jpg", id_intrinsic=i, id_pose=i)} for i, name in NAMED],
            "intrinsics": [
                {"key": i, "value": {"polymorphic_id": i + 1, "polymorphic_name": kind} | data(**lens)}
                for i, kind in enumerate(("pinhole", "spherical"))
            ],
            "extrinsics": [{"key": i, "value": {"rotation": KNOWN.opencv.tolist(), "center": EYE}} for i in range(2)],
        }
    )


def realitycapture(tmp_path):
    for name, skew in (("good", "0"), ("bad", "0.1")):
        (tmp_path / f"{name}.xmp").write_text(
            f'<x xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:FocalLength35mm="30" xcr:Skew="{skew}">'
            f"<xcr:Rotation>1 0 0 0 1 0 0 0 1</xcr:Rotation><xcr:Position>1 2 3</xcr:Position></x>"
        )
    return tmp_path


def gltf():
    document = json.loads(cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "gltf"))
    document["cameras"][1] = {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}}
    return json.dumps(document)


def usd():
    pytest.importorskip("pxr")
    text = cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "usd")
    return '"orthographic"'.join(text.rsplit('"perspective"', 1))


def three_js():
    document = json.loads(cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "three_js"))
    document["object"]["children"][1]["type"] = "OrthographicCamera"
    return json.dumps(document)


def mitsuba():
    text = cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "mitsuba")
    return 'type="thinlens"'.join(text.rsplit('type="perspective"', 1))


def bop():
    k = [600, 0, 320, 0, 600, 180, 0, 0, 1]
    return json.dumps({"good": {"cam_K": k}, "bad": {"cam_K": [600, 5, *k[2:]]}})


NAMED = [*enumerate(("good", "bad"))]
MIXED = (
    *(transforms, colmap, colmap_binary, kalibr, opencv, skewed, metashape, meshroom, openmvg, realitycapture),
    *(gltf, usd, three_js, mitsuba, bop),
)


def source(make, folder) -> Path | str:
    contents = make(folder) if make in (colmap_binary, realitycapture) else make()
    if isinstance(contents, dict):
        for name, text in contents.items():
            (folder / name).write_text(text)
        return folder
    return contents


@pytest.mark.parametrize("make", MIXED)
def test_one_camera_that_is_no_pinhole_keeps_none_of_the_others_back(tmp_path, make):
    cameras_read = cameras.read(source(make, tmp_path), options=GIVEN)
    assert [camera.name for camera in cameras_read] == ["good"]
    (note,) = (note for note in cameras_read[0].notes if note.startswith("Left out"))
    assert re.search("bad", note) and re.search("pinhole", note), note
    assert cameras.choose(cameras_read, "good") is cameras_read[0]
    with pytest.raises(InputError, match="pinhole"):  # and not: there is no such camera
        cameras.choose(cameras_read, "bad")
    with pytest.raises(InputError, match="name one of 'good'"):
        cameras.choose(cameras_read, "nobody")


def test_where_all_are_no_pinholes_the_first_is_named():
    with pytest.raises(InputError, match="EQUIRECTANGULAR"):
        cameras.read(
            transforms()
            .replace("PINHOLE", "EQUIRECTANGULAR")
            .replace('"file_path": "good.png"', '"file_path": "good.png", "camera_model": "EQUIRECTANGULAR"')
        )


def test_a_camera_that_is_damaged_is_no_other_kind_of_camera_and_refuses_the_file():
    document = json.loads(transforms())
    document["frames"][0]["transform_matrix"][0][0] = 5
    with pytest.raises(InputError, match="length"):
        cameras.read(json.dumps(document))


def test_a_hundred_panoramas_are_one_note():
    images = "".join(f"{i} 1 0 0 0 0 0 4 {min(i, 2)} p{i}.png\n\n" for i in range(1, 101))
    actual = cameras.FORMATS["colmap"]
    texts = colmap() | {"images.txt": images}
    from viewcam_addon.cameras.source import Source

    (camera,) = actual.read(Source(texts), GIVEN)
    assert len(camera.notes) == 1 and len(camera.notes[0]) < 300 and len(camera.left_out) == 99


def test_a_model_is_found_above_its_folder_0(tmp_path):
    (tmp_path / "sparse" / "0").mkdir(parents=True)
    cameras.save([Camera("a", CAMERAS["plain"])], tmp_path / "sparse" / "0", "colmap")
    for place in (tmp_path / "sparse", tmp_path, tmp_path / "sparse" / "0"):
        assert cameras.read(place)[0].pinhole == CAMERAS["plain"]
    (tmp_path / "sparse" / "1").mkdir()
    with pytest.raises(InputError, match="2 models"):
        cameras.read(tmp_path / "sparse")


def storage(path, **values):
    """OpenCV's own file of matrices and numbers; their order stays."""
    cv2 = pytest.importorskip("cv2")
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        file.write(name, value)
    file.release()


@pytest.mark.parametrize(
    "names",
    [
        "M1 D1 M2 D2",
        "K1 D1 K2 D2",
        "cameraMatrix1 distCoeffs1 cameraMatrix2 distCoeffs2",
        "cameraMatrixL distCoeffsL cameraMatrixR distCoeffsR",
        "left_K left_D right_K right_D",
    ],
)
@pytest.mark.parametrize("beside", ["", "extrinsics.yml"])
def test_a_stereo_pair_of_opencv_is_two_cameras_in_the_places_that_its_r_and_t_say(tmp_path, names, beside):
    cv2 = pytest.importorskip("cv2")
    k = [np.array([[f, 0, 320.5], [0, f + 1, 240.25], [0, 0, 1.0]]) for f in (600, 620)]
    d = [np.array([[-0.2, 0.05, 0.001, -0.002, 0.01]]), np.array([[-0.1, 0.02, 0, 0.001, 0.0]])]
    turn, shift = cv2.Rodrigues(np.array([0.02, -0.05, 0.01]))[0], np.array([[-0.12], [0.003], [0.01]])
    pair = dict(zip(names.split(), (k[0], d[0], k[1], d[1]), strict=True))
    between = {"R": turn, "T": shift, "R1": np.eye(3), "R2": np.eye(3), "P1": np.eye(3, 4), "P2": np.eye(3, 4), "Q": np.eye(4)}
    if beside:
        storage(tmp_path / "intrinsics.yml", **pair)
        storage(tmp_path / beside, **between)
        with pytest.raises(InputError, match="has R and T and no K"):
            cameras.read(tmp_path / beside, options=VGA)
    else:
        storage(tmp_path / "intrinsics.yml", **pair, **between)
    read_cameras = cameras.read(tmp_path / "intrinsics.yml", options=VGA)
    points = np.array([[0.3, -0.2, 4], [-1, 0.5, 6], [0.1, 0.8, 3.0]])
    for camera, k_of, d_of, pose in zip(read_cameras, k, d, ((np.eye(3), np.zeros(3)), (turn, shift)), strict=True):
        wanted, _ = cv2.projectPoints(points, *pose, k_of, d_of)
        column, row, _ = distortion.project(camera.pinhole, camera.lens, points)
        np.testing.assert_allclose(np.stack([column, 480 - row], axis=-1) - 0.5, wanted[:, 0], atol=1e-9)


ORB_SLAM = """%YAML:1.0

# Camera calibration and distortion parameters (OpenCV)
Camera.type: "{}"
Camera.fx: 458.654
Camera.fy: 457.296
Camera.cx: 367.215
Camera.cy: 248.375

Camera.k1: -0.28340811
Camera.k2: 0.07395907
Camera.p1: 0.00019359
Camera.p2: 1.76187114e-05

Camera.width: 752
Camera.height: 480
Camera.fps: 20.0
Camera.RGB: 1
ORBextractor.nFeatures: 1000
"""
VINS = """%YAML:1.0
---
model_type: PINHOLE
camera_name: camera
image_width: 752
image_height: 480
distortion_parameters:
   k1: -0.28340811
   k2: 0.07395907
   p1: 0.00019359
   p2: 1.76187114e-05
projection_parameters:
   fx: 458.654
   fy: 457.296
   cx: 367.215
   cy: 248.375
"""
BY_NAME = {"fx": 458.654, "fy": 457.296, "width": 752, "height": 480}
OF_PYTHON = """camera_matrix:
- - 458.654
  - 0.0
  - 367.215
- - 0.0
  - 457.296
  - 248.375
- - 0.0
  - 0.0
  - 1.0
dist_coeff:
- - -0.28340811
  - 0.07395907
  - 0.00019359
  - 1.76187114e-05
  - 0.0
image_size:
- 752
- 480
"""


@pytest.mark.parametrize(
    "text",
    [
        ORB_SLAM.format("PinHole"),
        ORB_SLAM.replace("Camera.", "Camera1.").format("PinHole").replace("\n", "\r\n"),
        VINS,
        OF_PYTHON,
        json.dumps(
            {
                "color": {
                    **BY_NAME,
                    "ppx": 367.215,
                    "ppy": 248.375,
                    "coeffs": [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0],
                }
            }
        ),
        json.dumps(
            {
                **BY_NAME,
                "px": 367.215,
                "py": 248.375,
                "k1": -0.28340811,
                "k2": 0.07395907,
                "p1": 0.00019359,
                "p2": 1.76187114e-05,
            }
        ),
        json.dumps(
            {
                "intrinsics": {**BY_NAME, "cx": 367.215, "cy": 248.375},
                "distortion": {"k1": -0.28340811, "k2": 0.07395907, "p1": 0.00019359, "p2": 1.76187114e-05},
            }
        ),
    ],
    ids=["ORB-SLAM2", "ORB-SLAM3", "VINS", "yaml.dump", "RealSense", "by name", "objects"],
)
def test_k_and_distortion_number_by_number_and_in_blocks_are_those_of_opencv(text):
    (camera,) = cameras.read(text)
    pinhole = camera.pinhole
    assert (pinhole.width, pinhole.height, pinhole.distance) == (752, 480, (458.654, 457.296))
    assert pinhole.principal_point == pytest.approx((367.715, 231.125), abs=1e-12)
    assert camera.lens == distortion.opencv({"k1": -0.28340811, "k2": 0.07395907, "p1": 0.00019359, "p2": 1.76187114e-05})


def test_a_lens_of_another_model_is_none_of_opencvs_however_its_numbers_are_called():
    text = ORB_SLAM.replace("p1", "k3").replace("p2", "k4").format("KannalaBrandt8")
    (camera,) = cameras.read(text)
    assert camera.lens.projection == "equidistant"
    (camera,) = cameras.read(
        VINS.replace("PINHOLE", "KANNALA_BRANDT")
        .replace("fx", "mu")
        .replace("fy", "mv")
        .replace("cx", "u0")
        .replace("cy", "v0")
        .replace(
            "distortion_parameters:\n   k1: -0.28340811\n   k2: 0.07395907\n   p1: 0.00019359\n   p2: 1.76187114e-05\n", ""
        )
        .replace("parameters:\n", "parameters:\n   k2: 0.01\n   k3: 0.02\n   k4: 0.03\n   k5: 0.04\n")
    )
    assert camera.lens == distortion.fisheye({"k1": 0.01, "k2": 0.02, "k3": 0.03, "k4": 0.04})
    with pytest.raises(InputError, match="of the model 'MEI'"):
        cameras.read(
            VINS.replace("PINHOLE", "MEI").replace("fx", "gamma1").replace("fy", "gamma2") + "mirror_parameters:\n   xi: 3.6\n"
        )
    with pytest.raises(InputError, match="inverse_brown_conrady"):
        cameras.read(
            json.dumps({**BY_NAME, "ppx": 367, "ppy": 248, "model": "inverse_brown_conrady", "coeffs": [0.1, 0, 0, 0, 0]})
        )
    (camera,) = cameras.read(
        json.dumps({**BY_NAME, "ppx": 367, "ppy": 248, "model": "inverse_brown_conrady", "coeffs": [0] * 5})
    )
    assert camera.lens is None


K_ALONE = [[500, 0, 320], [0, 510, 240], [0, 0, 1]]


@pytest.mark.parametrize("name", ["k.json", "k.txt", "k.npy"])
def test_k_alone_is_a_camera_at_the_origin_and_asks_for_its_size(tmp_path, name):
    path = tmp_path / name
    match path.suffix:
        case ".json":
            path.write_text(json.dumps(K_ALONE))
        case ".txt":
            np.savetxt(path, K_ALONE)
        case _:
            np.save(path, K_ALONE)
    with pytest.raises(InputError, match="does not say how many pixels"):
        cameras.read(path)
    (camera,) = cameras.read(path, options=VGA)
    assert camera.pinhole.distance == (500, 510) and camera.pinhole.principal_point == (320.5, 239.5)


def test_arrays_of_poses_are_a_camera_each(tmp_path):
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 0, 3] = range(3)
    np.savez(tmp_path / "scene.npz", intrinsics=np.tile(K_ALONE, (3, 1, 1)), poses=poses)
    np.savez(tmp_path / "shared.npz", K=np.array(K_ALONE), extrinsics=np.linalg.inv(poses)[:, :3])
    np.save(tmp_path / "poses.npy", poses)
    vectors = {"rvecs": np.zeros((3, 3, 1)), "tvecs": -poses[:, :3, 3:]}
    np.savez(tmp_path / "calibration.npz", mtx=np.array(K_ALONE), dist=np.zeros((1, 5)), **vectors)
    options = Options(
        size=(640, 480), pose="c2w_opencv", view_plane=Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 500, 640, 480).plane
    )
    for name, pose in (
        ("scene.npz", "c2w_opencv"),
        ("shared.npz", None),
        ("poses.npy", "c2w_opencv"),
        ("calibration.npz", None),
    ):
        read_cameras = cameras.read(tmp_path / name, options=dataclasses.replace(options, pose=pose))
        assert [camera.pinhole.eye for camera in read_cameras] == [(0, 0, 0), (1, 0, 0), (2, 0, 0)]
    with pytest.raises(InputError, match="give --pose"):
        cameras.read(tmp_path / "scene.npz", options=VGA)
    text = json.dumps({"mtx": K_ALONE, "dist": [0] * 5, **{name: value.tolist() for name, value in vectors.items()}})
    read_cameras = cameras.read(text, options=VGA)
    assert [camera.pinhole.eye for camera in read_cameras] == [(0, 0, 0), (1, 0, 0), (2, 0, 0)]


MAIN_JS = """// Copyright
let cameras = [
    {
        id: 0,
        img_name: '00001', // the first
        width: 1959,
        height: 1090,
        position: [
            -3, -0.5, 2e0,
        ],
        rotation: [
            [1, 0, 0],
            [0, 1, 0],
            [0, 0, 1],
        ],
        fy: 1164.5,
        fx: 1159.25,
    },
];
let camera = cameras[0];
"""
PAGE = """<script type="module">
  const viewer = new GaussianSplats3D.Viewer({
    'cameraUp': [0, -1, 0],  // y is down
    'initialCameraPosition': [-1, -4, 6],
    'initialCameraLookAt': [0, 4, 0]
  });
"""
LOOKAT = "Cam0 -D origin=1,2,3 -D target=1,2,2 -D up=0,1,0 -D fovy=60.5 -D clip=0.01,1000\n" * 2


def test_cameras_of_splatting_viewers_are_those_that_they_show():
    """By the formulas of their own sources; the angles are degrees of the picture's height, by hand."""
    text = json.dumps({"id": 0, "img_name": "a", "width": 9, "height": 8, "position": [1, 2, 3], "fx": 5, "fy": 6,
                       "rotation": np.eye(3).tolist()})  # fmt: skip
    assert cameras.read(text)[0].pinhole.eye == (1, 2, 3)
    (camera,) = cameras.read(MAIN_JS)
    pinhole = camera.pinhole
    assert (pinhole.width, pinhole.height, pinhole.distance, pinhole.eye) == (1959, 1090, (1159.25, 1164.5), (-3, -0.5, 2))
    assert pinhole.basis()[1] == pytest.approx((0, -1, 0)) and pinhole.basis()[2] == pytest.approx((0, 0, -1))
    (camera,) = cameras.read(PAGE, options=VGA)
    assert (camera.pinhole.eye, camera.pinhole.look_at, camera.pinhole.up) == ((-1, -4, 6), (0, 4, 0), (0, -1, 0))
    assert camera.pinhole.distance[0] == pytest.approx(240 / math.tan(math.radians(25)))
    read_cameras = cameras.read(LOOKAT, options=VGA)
    assert len(read_cameras) == 2 and read_cameras[0].pinhole.look_at == (1, 2, 2)
    assert read_cameras[0].pinhole.distance[1] == pytest.approx(240 / math.tan(math.radians(30.25)))
    with pytest.raises(InputError, match="initialCameraPosition 0 times"):
        read(PAGE.replace("[-1, -4, 6]", "config.position"))


def test_an_intrinsic_of_open3d_alone_has_its_columns_first():
    text = json.dumps({"width": 640, "height": 480, "intrinsic_matrix": [525.5, 0, 0, 0, 526.5, 0, 319.5, 239.5, 1]})
    (camera,) = cameras.read(text)
    assert camera.pinhole.distance == (525.5, 526.5) and camera.pinhole.principal_point == (320, 240)
    assert camera.pinhole.eye == (0, 0, 0) and camera.pinhole.basis()[1] == pytest.approx((0, -1, 0))


def test_frames_that_are_kept_apart_for_tests_are_cameras_too():
    """ScanNet++'s, which the pictures that a method is measured by are of."""
    frames = [{"file_path": f"DSC{number}.JPG", "transform_matrix": np.eye(4).tolist()} for number in range(3)]
    document = {"fl_x": 500, "w": 640, "h": 480, "frames": frames[:2], "test_frames": frames[2:]}
    assert [camera.name for camera in cameras.read(json.dumps(document))] == ["DSC0", "DSC1", "DSC2"]


@pytest.mark.parametrize(
    ("frames", "sentence"),
    [
        ([], "holds no camera"),
        ([{"file_path": "a.png", "w2c": np.eye(4).tolist()}], "frame 0 has no transform_matrix"),
        ({"left": {"file_path": "a.png"}}, "frame 'left' has no transform_matrix"),
        ([{"transform_matrix": [[True, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}], "of frame 0 is .*: give numbers, not true"),
    ],
)
def test_what_frames_lack_is_told_of_a_transforms_json(frames, sentence):
    with pytest.raises(InputError, match=sentence):
        cameras.read(json.dumps({"fl_x": 500, "w": 640, "h": 480, "frames": frames}))


def test_a_bare_list_of_frames_is_read_once_its_distance_and_size_are_said():
    plane = Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 500, 640, 480).plane
    pose = [[1.0, 0.0, 0.0, 2.0], [0.0, 1.0, 0.0, 3.0], [0.0, 0.0, 1.0, 4.0]]
    exported = json.dumps([{"file_path": "a.png", "transform": pose}, {"file_path": "b.png", "transform": pose}])
    matrices = exported.replace('"transform"', '"transform_matrix"')
    for text in (exported, matrices):
        first, _ = cameras.read(text, options=Options(size=(640, 480), view_plane=plane))
        assert first.pinhole.eye == (2, 3, 4) and first.pinhole.distance == (500, 500) and first.image == "a.png"
        with pytest.raises(InputError, match="--distance"):
            cameras.read(text, options=VGA)


OPEN3D_VIEW = {
    "boundingbox_max": [1, 2, 3],
    "boundingbox_min": [-1, -2, 1],
    "field_of_view": 60.0,
    "front": [0, -3, 4],  # any length
    "lookat": [10, 20, 30],
    "up": [0, 0, 1],
    "zoom": 0.5,
}


def test_half_the_height_of_a_view_of_open3d_is_zoom_times_the_longest_side_of_its_box():
    text = json.dumps({"class_name": "ViewTrajectory", "interval": 29, "trajectory": [OPEN3D_VIEW], "version_major": 1})
    (camera,) = cameras.read(text, options=VGA)
    pinhole, away = camera.pinhole, 0.5 * 4 / math.tan(math.radians(30))
    assert pinhole.look_at == (10, 20, 30)
    assert pinhole.eye == pytest.approx((10, 20 - 0.6 * away, 30 + 0.8 * away))
    column, row, _ = pinhole.project([np.array(pinhole.look_at) + 0.5 * 4 * pinhole.basis()[1]])
    assert (column[0], row[0]) == pytest.approx((320, 480))
    with pytest.raises(InputError, match="--size"):
        cameras.read(text)
    with pytest.raises(InputError, match="orthographic, no pinhole: widen its field_of_view"):
        cameras.read(text.replace("60.0", "5.0"), options=VGA)


@pytest.mark.parametrize("data", [b"Kaydara FBX Binary  \0\x1a\0", b"; FBX 7.4.0 project file\n", b"Ogawa\xff\0\1"])
def test_what_blenders_own_importers_read_is_sent_there(tmp_path, data):
    (tmp_path / "camera").write_bytes(data)
    with pytest.raises(InputError, match="camera is read by Blender itself: import it there"):
        cameras.read(tmp_path / "camera")


@pytest.mark.parametrize(
    ("name", "data", "sentence"),
    [
        ("transforms.json.gz", b"\x1f\x8b\x08\0", "is packed: unpack it"),
        ("scan.zip", b"PK\x03\x04\0", "is packed: unpack it"),
        ("transforms.json", b"<!DOCTYPE html>\n<html>", "is a page of the web: download the file itself"),
        ("a.exr", b"v/1\x01\x02", "is a picture: give the file of its camera"),
        ("a.ply", b"ply\nformat ascii 1.0\n", "is a point cloud or a mesh"),
        ("scene.ma", b"//Maya ASCII 2025 scene\n", "is a scene of Maya's, which is not read: export its cameras as USD"),
        ("a.tscn", b'[gd_scene format=3]\n\n[node name="Camera3D"]\nfov = 60.0\n', "is a scene of Godot's, which is not read"),
        ("a.dae", b'<?xml version="1.0"?>\n<COLLADA version="1.4.1"></COLLADA>', "is a scene of Collada's, which is not read"),
        ("a.nk", b"Camera2 {\n translate {1 2 3}\n focal 35\n}\n", "is a script of Nuke's, which is not read"),
        ("a.ass", b"persp_camera\n{\n name cam\n fov 54.4\n}\n", "is a scene of Arnold's, which is not read"),
        ("a.scn", b"scene.camera.lookat.orig = 1 2 3\nscene.camera.lookat.target = 0 0 0\n", "is a scene of LuxCore's"),
        ("a.xml", b"<cycles>\n<transform><camera type='perspective'/></transform>\n</cycles>", "is a scene of Cycles' own"),
        ("a.x3d", b"<X3D><Scene><Viewpoint position='0 0 9'/></Scene></X3D>", "is a scene of X3D or VRML"),
        ("a.t3d", b"Begin Map\n Begin Level\n", "is a part of a level of Unreal's"),
        ("database.db", b"SQLite format 3\0", "is a database, as COLMAP's, which has no poses"),
        ("poses.pkl", b"\x80\x04\x95", "is a pickle, which may run programs"),
        ("a.json", b" \n", "is empty"),
    ],
)
def test_a_file_of_another_kind_is_called_by_it_and_not_by_a_list_of_all_formats(tmp_path, name, data, sentence):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=f"{name} {sentence}"):
        cameras.read(tmp_path / name)


def test_code_of_a_scenes_camera_is_none_of_another_programs_texts():
    python = "scene.camera.location = (7, -6, 5)\nscene.camera.rotation_euler = (1.1, 0, 0.8)\nscene.camera.data.lens = 35\n"
    assert read(python).pinhole.eye == (7, -6, 5)
    babylon = (
        "camera.position = new BABYLON.Vector3(1, 2, 3);\ncamera.setTarget(new BABYLON.Vector3(0, 1, 0));\ncamera.fov = 0.8;\n"
    )
    with pytest.raises(InputError, match="does not say which way is up"):
        read(babylon)


@pytest.mark.parametrize("place", ["sparse/1", "dense/0/sparse", "nerf"])
def test_a_folder_without_cameras_says_in_which_of_its_folders_they_are(tmp_path, place):
    (tmp_path / place).mkdir(parents=True)
    (tmp_path / "images" / "left").mkdir(parents=True)
    with pytest.raises(InputError, match="is no camera that is understood"):
        cameras.read(tmp_path)
    (tmp_path / place / ("transforms.json" if place == "nerf" else "images.txt")).write_text("")
    with pytest.raises(InputError, match=f"has no cameras itself: give {place} in it"):
        cameras.read(tmp_path)


def test_k_in_a_matrix_of_four_columns_is_k_where_these_add_nothing():
    for more, is_read in ((0, True), (-50, False)):
        for rows in (
            [[500, 0, 320, more], [0, 500, 240, 0], [0, 0, 1, 0]],
            [[500, 0, 320, 0], [0, 500, 240, more], [0, 0, 1, 0]],
        ):
            for last in ([], [[0, 0, 0, 1]]):
                text = json.dumps({"intrinsic": rows + last, "width": 640, "height": 480})
                if is_read:
                    assert read(text).pinhole.distance == (500, 500)
                    continue
                with pytest.raises(InputError, match="more than K in its fourth"):
                    read(text)


def test_sections_in_brackets_are_no_damaged_json(tmp_path):
    """ZED's calibration, and whatever else is INI."""
    left = "[LEFT_CAM_HD]\nfx=700\nfy=700\ncx=640\ncy=360\n"
    (tmp_path / "SN1.conf").write_text(left)
    assert cameras.read(tmp_path / "SN1.conf", options=Options(size=(1280, 720)))[0].pinhole.distance == (700, 700)
    (tmp_path / "SN1.conf").write_text(left + left.replace("700", "710"))
    with pytest.raises(InputError, match="fx is something else before, copy one camera"):
        cameras.read(tmp_path / "SN1.conf")


@pytest.mark.parametrize("k", ["K = [[500, 0, 320], [0, 500, 240], [0, 0, 1]]", "fx = fy = 500\nfy = 500\ncx, cy = 320, 240"])
def test_coefficients_that_code_says_one_by_one_are_a_lens(k):
    bent = read(f"{k}\nk1 = -0.17\nk2 = 0.02\n")
    assert bent.lens == distortion.opencv({"k1": -0.17, "k2": 0.02}), bent.notes
    assert read(f"{k}\nk1, k2 = -0.17, 0.02\ndist = np.array([k1, k2, 0, 0])\n").lens == bent.lens
    assert read(f"{k}\nk1 = [1, 2, 3]\n").lens is None


@pytest.mark.parametrize("is_json", [False, True])
def test_a_matrix_whose_name_may_be_a_poses_is_asked_for_its_way_in_code_as_in_json(is_json):
    """ManiSkill's, beside its extrinsic_cv."""
    pose = [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    values = {"cam2world_gl": pose, "K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]]}
    text = json.dumps(values) if is_json else "\n".join(f"{name} = np.array({rows})" for name, rows in values.items())
    with pytest.raises(InputError, match="has cam2worldgl, and whose axes it means and which way it goes is not said"):
        read(text)
    (camera,) = cameras.read(text, options=Options(size=(640, 480), pose="c2w_opengl"))
    assert camera.pinhole.eye == (1, 2, 3) and camera.pinhole.basis()[2] == pytest.approx((0, 0, 1))


@pytest.mark.parametrize(
    ("key", "value", "is_told"), [("crop", [9, 9, 99, 99], True), ("binning", 2, True), ("binning", 1, False)]
)
def test_what_may_have_been_cut_off_a_picture_is_told_where_k_is_taken(key, value, is_told):
    text = json.dumps({"K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]], "width": 640, "height": 480, key: value})
    assert any(f"has {key}, which was not taken" in note for note in read(text).notes) == is_told


def test_one_half_of_a_colmap_model_is_told_which_is_missing(tmp_path):
    (tmp_path / "images.txt").write_text("1 1 0 0 0 1 2 3 1 a.jpg\n\n")
    with pytest.raises(InputError, match=r"images\.txt of a COLMAP model and no cameras\.txt"):
        cameras.read(tmp_path)


def test_a_pointer_of_git_lfs_says_how_to_get_the_file():
    with pytest.raises(InputError, match="git lfs pull"):
        cameras.read("version https://git-lfs.github.com/spec/v1\noid sha256:997004fb\nsize 772721\n")


TOOLBOX = """% Intrinsic and Extrinsic Camera Parameters
%-- Focal length:
fc = [ 657.395353340077460 ; 658.763142353886830 ];
%-- Principal point:
cc = [ 302.983766534402610 ; 242.616284123219370 ];
%-- Skew coefficient:
alpha_c = 0.000000000000000;
%-- Distortion coefficients:
kc = [ -0.255835686105780 ; 0.127572945483490 ; -0.000208182110586 ; 0.000033353463620 ; 0.000000000000000 ];
fc_error = [ 0.3 ; 0.4 ];
nx = 640;
ny = 480;
omc_1 = [ 1.654766e+00 ; 1.651927e+00 ; -6.699815e-01 ];
Tc_1  = [ -1.778005e+02 ; -8.395097e+01 ; 8.528764e+02 ];
omc_error_1 = [ 5.0e-04 ; 6.0e-04 ; 8.0e-04 ];
omc_2 = [ NaN ; NaN ; NaN ];
Tc_2  = [ NaN ; NaN ; NaN ];
omc_3 = [ 1.849011e+00 ; 1.900554e+00 ; -3.970866e-01 ];
Tc_3  = [ -1.549437e+02 ; -1.595167e+02 ; 7.575891e+02 ];
"""


def test_pictures_of_the_calibration_toolbox_for_matlab_are_where_opencv_projects_them():
    cv2 = pytest.importorskip("cv2")
    read_cameras = cameras.read(TOOLBOX.replace("\n", "\r\n"))
    assert [camera.name for camera in read_cameras] == ["image_1", "image_3"]
    k = np.array([[657.395353340077460, 0, 302.983766534402610], [0, 658.763142353886830, 242.616284123219370], [0, 0, 1]])
    bent = np.array([-0.255835686105780, 0.127572945483490, -0.000208182110586, 0.000033353463620, 0.0])
    turns = ([1.654766, 1.651927, -0.6699815], [1.849011, 1.900554, -0.3970866])
    moved = ([-177.8005, -83.95097, 852.8764], [-154.9437, -159.5167, 757.5891])
    points = np.array([[0.0, 0, 0], [100, 0, 0], [0, 120, 30]])
    for camera, turn, at in zip(read_cameras, turns, moved, strict=True):
        wanted, _ = cv2.projectPoints(points, np.array(turn), np.array(at), k, bent)
        column, row, _ = distortion.project(camera.pinhole, camera.lens, points)
        np.testing.assert_allclose(np.stack([column, 480 - row], axis=-1) - 0.5, wanted[:, 0], atol=1e-6)


@pytest.mark.parametrize(
    "code",
    [
        "Eigen::Matrix3d K; K << 600, 0, 320, 0, 601, 240, 0, 0, 1;\n"
        "Eigen::Matrix4d T_cw = Eigen::Matrix4d::Identity();\nT_cw << 1,0,0,0, 0,1,0,0, 0,0,1,2, 0,0,0,1;",
        "K <- matrix(c(600,0,320, 0,601,240, 0,0,1), nrow=3, byrow=TRUE)\nR <- diag(3)\nt <- c(0,0,2)\n",
        "Camera matrix :\n [[6.00e+02 0.00e+00 3.20e+02]\n [0.00e+00 6.01e+02 2.40e+02]\n [0.00e+00 0.00e+00 1.00e+00]]\n"
        "R:\n [[1. 0. 0.]\n [0. 1. 0.]\n [0. 0. 1.]]\nt:\n [0. 0. 2.]\n",
    ],
    ids=["Eigen", "R", "print"],
)
def test_matrices_that_are_made_before_they_are_filled_and_names_of_two_words_are_read(code):
    camera = read(code)
    assert camera.pinhole.distance == (600, 601) and camera.pinhole.principal_point == (320.5, 239.5)
    assert camera.pinhole.eye == (0, 0, -2)


CALIBRATION = """<?xml version="1.0" encoding="UTF-8"?>
<calibration>
  <projection>frame</projection>
  <width>1384</width>
  <height>1032</height>
  <f>1278.25</f>
  <cx>-10.5</cx>
  <cy>-12.25</cy>
  <k1>-0.1776</k1>
  <k2>0.1568</k2>
  <p1>0.000397</p1>
  <p2>-8.5e-05</p2>
  <date>2020-07-15T09:43:30Z</date>
</calibration>
"""


def test_a_calibration_of_metashape_alone_is_a_camera_at_the_origin():
    (camera,) = cameras.read(CALIBRATION)
    pinhole = camera.pinhole
    assert (pinhole.width, pinhole.height, pinhole.distance, pinhole.eye) == (1384, 1032, (1278.25, 1278.25), (0, 0, 0))
    assert pinhole.principal_point == (692 - 10.5, 516 + 12.25)
    assert camera.lens == distortion.opencv({"k1": -0.1776, "k2": 0.1568, "p1": -8.5e-05, "p2": 0.000397})
    (camera,) = cameras.read(CALIBRATION.replace("frame", "fisheye"))
    assert camera.lens.projection == "equidistant"
    with pytest.raises(InputError, match="'spherical'"):
        cameras.read(CALIBRATION.replace("frame", "spherical"))


def test_the_world_of_nerfstudio_alone_says_where_it_belongs():
    with pytest.raises(InputError, match=r"has no cameras.* beside camera_path.json"):
        cameras.read(json.dumps({"transform": np.eye(4)[:3].tolist(), "scale": 0.5}))


def test_a_list_of_cameras_is_one_of_each_by_its_name():
    listed = [
        {"name": f"00_0{i}", "type": "hd", "resolution": [640, 480], "K": K_ALONE, "distCoef": [0.1, 0, 0, 0, 0],
         "R": np.eye(3).tolist(), "t": [[i], [0], [2]]}
        for i in range(2)
    ]  # fmt: skip
    read_cameras = cameras.read(json.dumps({"calibDataSource": "160906", "cameras": listed}))
    assert [camera.name for camera in read_cameras] == ["00_00", "00_01"]
    assert [camera.pinhole.eye for camera in read_cameras] == [(0, 0, -2), (-1, 0, -2)]
    assert read_cameras[0].lens == distortion.opencv({"k1": 0.1})


@pytest.mark.parametrize("sign", ["=", " "])
def test_options_of_f3d_are_a_camera_of_vtk(sign):
    words = {"position": "7,-6,4", "focal-point": "0,0,1", "view-up": "0,0,1", "view-angle": "40"}
    pinhole = read("f3d " + " ".join(f"--camera-{name}{sign}{value}" for name, value in words.items()) + " a.glb").pinhole
    assert (pinhole.eye, pinhole.look_at, pinhole.up) == ((7, -6, 4), (0, 0, 1), (0, 0, 1))
    assert pinhole.distance[1] == pytest.approx(240 / math.tan(math.radians(20)))


def test_options_of_openscad_are_its_eye_and_center():
    pinhole = read("openscad --camera=7,-6,4,0,0,1 --imgsize=640,360 a.scad -o a.png").pinhole
    assert (pinhole.eye, pinhole.look_at, pinhole.width, pinhole.height) == ((7, -6, 4), (0, 0, 1), 640, 360)
    assert pinhole.distance[1] == pytest.approx(180 / math.tan(math.radians(11.25)))


@pytest.mark.parametrize(
    ("angles", "eye", "up"),
    [
        ("0,0,0", (1, 2, 143), (0, 1, 0)),  # from above
        ("90,0,0", (1, -138, 3), (0, 0, 1)),  # from the front
        ("90,0,90", (141, 2, 3), (0, 0, 1)),  # from the right
    ],
)
def test_options_of_openscad_are_its_views(angles, eye, up):
    pinhole = read(f"openscad --camera 1,2,3,{angles},140 --imgsize=640,360 a.scad").pinhole
    assert pinhole.look_at == (1, 2, 3)
    np.testing.assert_allclose((pinhole.eye, pinhole.up), (eye, up), atol=1e-13)


def test_options_of_openscad_without_perspective_are_no_pinhole():
    with pytest.raises(InputError, match="in parallel projection"):
        read("openscad --camera=7,-6,4,0,0,1 --projection=o a.scad")


def test_json_with_a_comma_before_the_closing_bracket_in_the_next_line_is_read():
    text = cameras.write([Camera("a", CAMERAS["shifted"])], "transforms").rstrip().removesuffix("}") + ",\n}\n"
    (camera,) = cameras.read(text)
    assert camera.pinhole == CAMERAS["shifted"]


def test_cameras_that_their_file_does_not_name_are_called_so_that_colmap_can_name_their_pictures(tmp_path):
    storage(
        tmp_path / "intrinsics.yml", M1=np.array(K_ALONE, float), M2=np.array(K_ALONE, float), R=np.eye(3), T=np.ones((3, 1))
    )
    bundler = "# Bundle file v0.3\n1 0\n500 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 5\n"
    for source in (tmp_path / "intrinsics.yml", bundler, TOOLBOX):
        read_cameras = cameras.read(source, options=dataclasses.replace(VGA, without_distortion=True))
        cameras.save(read_cameras, tmp_path / "model", "colmap")
        assert [camera.name for camera in cameras.read(tmp_path / "model")] == [camera.name for camera in read_cameras]


def refusal(text):
    """The sentence of what is refused."""
    with pytest.raises(InputError) as error:
        cameras.read(text, options=GIVEN)
    assert error.value.__cause__ is None, error.value.__cause__
    return str(error.value)


@pytest.mark.parametrize(
    "pose", [{"rotation": [0.3, -0.7, 1.1, "ZYX"]}, {"quaternion": [0.2, -0.4, 0.4, 0.8]}, {"rotation": [0.3, -0.7, 1.1]}]
)
def test_three_js_objects_without_a_matrix_stand_by_their_position_and_rotation(pose):
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    lens = {"type": "PerspectiveCamera", "fov": 50, "aspect": 640 / 360}
    group = {"type": "Group", "position": [4, 5, 6], "scale": [2, 2, 2]}
    (camera,) = cameras.read(
        json.dumps({"object": group | {"children": [lens | pose | {"position": [1, 2, 3]}]}}), options=GIVEN
    )
    if "quaternion" in pose:
        turn = rotation.from_quat(pose["quaternion"])
    else:  # three.js' orders turn about the axes of what turns
        *angles, order = [*pose["rotation"], "XYZ"][:4]
        turn = rotation.from_euler(order, [angles["XYZ".index(axis)] for axis in order])
    assert camera.pinhole.eye == pytest.approx((6, 9, 12))
    assert np.column_stack(camera.pinhole.basis()) == pytest.approx(turn.as_matrix(), abs=1e-14)
    assert "rotation of" in refusal(json.dumps({"object": lens | {"rotation": [0, 1, 0, "XXX"]}}))


@pytest.mark.parametrize("suffix", ["gltf", "json"])
def test_json_that_is_damaged_is_no_code_of_mitsubas(tmp_path, suffix):
    """A glTF with a comma in a number was read as a camera at the origin."""
    path = tmp_path / f"a.{suffix}"
    path.write_text(cameras.write([Camera("a", CAMERAS["plain"])], "gltf").replace('"yfov": 0.', '"yfov": 0,'))
    assert "is none (line" in refusal(path)


def chain(*kinds):
    """Kalibr's, each camera 0.1 to the right of the one before; the names sorted as its writer of YAML does."""
    k = {"pinhole": [500, 500, 320, 240], "omni": [1.5, 500, 500, 320, 240], "eucm": [0.5, 1, 500, 500, 320, 240]}
    beside = "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
    blocks = {
        f"cam{i}": (beside if i else "")
        + f"  camera_model: {kind}\n  intrinsics: {k[kind]}\n  distortion_coeffs: [0, 0, 0, 0]\n"
        "  distortion_model: radtan\n  resolution: [640, 480]\n"
        for i, kind in enumerate(kinds)
    }
    return "".join(f"{name}:\n{blocks[name]}" for name in sorted(blocks))


def test_kalibrs_cameras_stand_behind_one_of_another_model_and_in_the_order_of_their_numbers():
    """The place of a camera with five intrinsics was left out of the chain, and cam2 stood behind cam10."""
    read = cameras.read(chain("pinhole", "omni", "pinhole", "eucm", *["pinhole"] * 8))
    places = {camera.name: camera.pinhole.eye[0] for camera in read}
    assert places == pytest.approx({f"cam{i}": 0.1 * i for i in range(12) if i not in (1, 3)})
    first, second = (note for note in read[0].notes if note.startswith("Left out"))
    assert "'cam1'" in first and "omni" in first and "'cam3'" in second and "eucm" in second


@pytest.mark.parametrize("rows", [1, 2, 4])
@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
def test_opencvs_table_of_extrinsic_parameters_is_a_camera_a_row(tmp_path, suffix, rows):
    """The program that OpenCV's documentation calibrates with writes it; projectPoints is the judge."""
    cv2 = pytest.importorskip("cv2")
    path, chance = tmp_path / f"a.{suffix}", np.random.default_rng(rows)
    k, table = np.array([[500.0, 0, 310], [0, 510, 170], [0, 0, 1]]), chance.normal(size=(rows, 6))
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 640)
    storage.write("image_height", 360)
    storage.write("camera_matrix", k)
    storage.write("extrinsic_parameters", table)
    storage.release()
    read = cameras.read(path)
    assert len(read) == rows
    for camera, row in zip(read, table, strict=True):
        points = (chance.normal((0, 0, 6), size=(5, 3)) - row[3:]) @ cv2.Rodrigues(row[:3])[0]
        theirs = cv2.projectPoints(points, row[:3], row[3:], k, None)[0][:, 0] + 0.5
        column, from_bottom, _ = camera.pinhole.project(points)
        assert np.abs(np.column_stack([column, 360 - from_bottom]) - theirs).max() < 1e-10


def test_a_distortion_of_an_unknown_model_is_named_and_not_taken_for_opencvs():
    k = {"K": [[500, 0, 320], [0, 500, 180], [0, 0, 1]], "image_size": [640, 360], "distortion_coeffs": [0.1, 0, 0, 0]}
    assert "unknown distortion model 'scaramuzza'" in refusal(json.dumps(k | {"distortion_model": "scaramuzza"}))
    ros = files.ros("calibration", (640, 360), (1, 1), (0, 0, 0, 0)).replace("plumb_bob", "scaramuzza")
    assert "unknown distortion model 'scaramuzza'" in refusal(ros)
    fisheye = (
        ros.replace("scaramuzza", "equidistant") + "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0.1]}\n"
    )
    assert "a fisheye has four" in refusal(fisheye)


def test_terms_of_a_lens_that_are_not_read_are_not_passed_over():
    assert "p3 and p4" in refusal(files.metashape(KNOWN, "<p1>0.001</p1><p4>0.5</p4>"))
    assert "k1 of sensor" in refusal(files.metashape(KNOWN, "<k1>0,1</k1>"))
    (camera,) = cameras.read(files.metashape(KNOWN, "<p4>0.5</p4>"))
    assert camera.lens is None, "it is a factor of p1 and p2, which are 0"
    sfm = files.meshroom(KNOWN)
    sfm["intrinsics"][0] |= {"undistortionType": "3deradial4", "undistortionParams": ["0.1", "0"]}
    assert "unknown model '3deradial4'" in refusal(json.dumps(sfm))
    sfm["intrinsics"][0]["undistortionParams"] = ""
    files.the_same(cameras.read(json.dumps(sfm)), KNOWN)


def test_a_lens_of_realitycapture_is_one_that_it_has(tmp_path):
    for model in ("perspective", "brown4t2", "division", "equirectangular"):
        (tmp_path / f"{model}.xmp").write_text(
            f'<x xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:FocalLength35mm="30"'
            f' xcr:DistortionModel="{model}">'
            "<xcr:Rotation>1 0 0 0 1 0 0 0 1</xcr:Rotation><xcr:Position>1 2 3</xcr:Position></x>"
        )
    read = cameras.read(tmp_path, options=GIVEN)
    assert {camera.name for camera in read} == {"perspective", "brown4t2", "division"}
    assert any("'equirectangular'" in note for note in read[0].notes)


def test_intrinsics_in_widths_are_refused_in_a_transforms_json_too():
    lens = {"fl_x": 0.9, "fl_y": 1.2, "cx": 0.5, "cy": 0.5, "w": 640, "h": 480}
    frames = [{"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}]
    assert "widths of the picture" in refusal(json.dumps(lens | {"frames": frames}))


def test_a_principal_point_outside_of_a_picture_whose_size_is_said_is_told():
    """A calibration of another size than the pictures'."""
    k = {"K": [[500, 0, 960], [0, 500, 540], [0, 0, 1]], "image_size": [640, 360]}
    (camera,) = cameras.read(json.dumps(k))
    assert any("lies outside of a picture of 640 × 360 pixels" in note for note in camera.notes)


def test_a_colmap_model_whose_lines_are_one_short_or_one_too_many_is_refused(tmp_path):
    camera, pose = "1 PINHOLE 640 360 500 500 320 180\n", " 1 0 0 0 1 2 3 1 "
    for cameras_of_model, images, sentence in (
        (camera, f"1{pose}a 1 b.jpg\n2{pose}a 2 b.jpg\n3{pose}a 3 b.jpg\n", "no list of image points"),
        (camera + camera, f"1{pose}a.jpg\n\n", "another camera 1"),
    ):
        (tmp_path / "cameras.txt").write_text(cameras_of_model)
        (tmp_path / "images.txt").write_text(images)
        assert sentence in refusal(tmp_path)


def test_a_table_is_read_with_blanks_at_its_end_and_middleburys_without_a_line_end():
    row = "a.jpg,1,2,3,0,0,0,36,0,0\n"
    (camera,) = cameras.read(f"#name,x,y,alt,heading,pitch,roll,f,px,py\n{row}   \n", options=GIVEN)
    assert camera.pinhole.eye == (1, 2, 3)
    (camera,) = cameras.read("1\na.png 500 0 320 0 500 180 0 0 1 1 0 0 0 1 0 0 0 1 0 0 0", options=GIVEN)
    assert camera.pinhole.distance == (500, 500)


AWKWARD = ("left/0001.png", "C:/a", "a\\b", "..", "", ' #1: "x" [y', "nul.exr", "x" * 300, "\u3042", "it's", "-x", "/")


@pytest.mark.parametrize("form", ["opencv", "ros", "pbrt", "pov_ray", "sidecar"])
@pytest.mark.parametrize("name", AWKWARD)
def test_a_camera_that_no_file_can_be_called_by_is_read_again_by_its_name(tmp_path, form, name):
    """A name with a slash became a subfolder's file, which was not read again."""
    called = [Camera(each, CAMERAS["plain"]) for each in ("front", name)]
    files = cameras.save(called, tmp_path, form)
    for file in files:
        assert file.parent == tmp_path and not set(file.name) & set('<>:"/\\|?*') and len(file.name.encode()) < 250
        assert not file.name.upper().startswith("NUL.") and file.stem.rstrip(". ") == file.stem
    back = {camera.name for camera in cameras.read(tmp_path)}
    assert back == {"front", name or ("_" if form == "ros" else "#1")}, f"{back} of {[file.name for file in files]}"


@pytest.mark.parametrize("form", ["opencv", "ros", "sidecar"])
def test_cameras_whose_files_would_be_one_have_files_with_numbers_and_their_own_names(form, tmp_path):
    """Both were refused, and who has a model of somebody else can't rename its pictures."""
    names = ["a/b", "A_b", "a_b_2", "a:b"]
    files = cameras.save([Camera(name, CAMERAS["plain"]) for name in names], tmp_path, form)
    assert [file.stem for file in files] == ["a_b", "A_b_2", "a_b_2_2", "a_b_3"]
    assert sorted(camera.name for camera in cameras.read(tmp_path)) == sorted(names)


def test_a_copy_of_a_cameras_file_is_called_by_its_own(tmp_path):
    file, _ = cameras.save([Camera(name, CAMERAS["plain"]) for name in ("rig/left", "b")], tmp_path, "opencv")
    (tmp_path / "right.yml").write_text(file.read_text())
    assert [camera.name for camera in cameras.read(tmp_path)] == ["b", "rig/left", "right"]


@pytest.mark.parametrize("form", ["gltf", "three_js", "mitsuba", "vtk", "text"])
def test_each_of_two_cameras_of_one_name_can_be_chosen(form):
    """Their names were said to be one, and to be changed."""
    called = [Camera("Cam", CAMERAS[name]) for name in ("plain", "rolled")]
    back = cameras.read(cameras.write(called, form), options=VGA)
    assert [camera.name for camera in back] == ["Cam", "Cam #2"]
    assert cameras.choose(back, "Cam #2").pinhole == CAMERAS["rolled"]


def test_mitsubas_ids_are_names_of_any_characters_and_none_is_twice():
    called = ['a & "b"', "<c>", "'", "Cam", "Cam"]
    text = cameras.write([Camera(name, CAMERAS["plain"]) for name in called], "mitsuba")
    assert [camera.name for camera in cameras.read(text)] == [*called[:4], "Cam #2"]
    assert text.count('id="Cam"') == 1


@pytest.mark.parametrize("form", ["gltf", "usd"])
def test_a_name_of_a_node_is_no_path(form):
    if form == "usd":
        pytest.importorskip("pxr")
    called = ["rig/left", "a.png", "a.png", "b"]
    back = cameras.read(cameras.write([Camera(name, CAMERAS["plain"]) for name in called], form), options=VGA)
    assert [camera.name for camera in back] == ["rig/left", "a.png", "a.png #2", "b"]


def test_a_matrix_that_is_transposed_is_refused_by_its_last_row():
    """Open3D's extrinsic row after row stood at the origin; MVSNet's and trajectories' last rows were not looked at."""
    transposed = np.eye(4)
    transposed[3, :3] = EYE
    intrinsic = {"width": 640, "height": 360, "intrinsic_matrix": [600, 0, 0, 0, 600, 0, 319.5, 179.5, 1]}
    alone = {"class_name": "PinholeCameraParameters", "intrinsic": intrinsic, "extrinsic": transposed.T.ravel().tolist()}
    numbers = files.text_of(transposed)
    for text in (
        json.dumps(alone),
        f"extrinsic\n{numbers}\n\nintrinsic\n600 0 320 0 600 180 0 0 1\n\n1 2\n",
        f"{files.text_of(np.eye(4))}\n" * 30 + f"{numbers}\n",
    ):
        with pytest.raises(InputError, match=r"the last row of the matrix of .* transpose it"):
            cameras.read(text, options=Options(view_plane=CAMERAS["plain"].plane))


def test_of_open3ds_cameras_one_with_skew_keeps_none_of_the_others_back():
    k = [600, 0, 0, 0, 600, 0, 319.5, 179.5, 1]
    parameters = [
        {"intrinsic": {"width": 640, "height": 360, "intrinsic_matrix": matrix}, "extrinsic": np.eye(4).ravel().tolist()}
        for matrix in (k, [*k[:3], 5, *k[4:]])
    ]
    (camera,) = cameras.read(json.dumps({"class_name": "PinholeCameraTrajectory", "parameters": parameters}))
    assert camera.name == "00000" and any("'00001'" in note and "skew" in note for note in camera.notes)


@pytest.mark.parametrize("form", ["calibration", "message"])
def test_of_cameras_in_a_list_of_yaml_none_is_made_of_two(form):
    rows = "[500, 0, 320, 0, 500, 240, 0, 0, 1]"
    left = f"  width: 640\n  height: 480\n  K: {rows}\n"
    head = "cameras:\n" if form == "message" else ""
    assert "in a list: leave one out" in refusal(f"{head}- name: a\n{left}- name: b\n{left}  R: {rows}\n  t: [1, 0, 0]\n")


def test_a_camera_on_its_body_stands_where_its_file_says():
    """EuRoC's sensor.yaml and OpenVINS' kalibr_imucam_chain.yaml, whose two cameras stood in one place."""
    inner = "intrinsics: [500, 500, 320, 240]\n  resolution: [640, 480]\n  camera_model: pinhole\n  distortion_model: none\n"
    rows = "[1, 0, 0, {}, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1]"
    chain = "".join(f"cam{i}:\n  T_imu_cam: {rows.format(i)}\n  {inner}" for i in range(2))
    assert [camera.pinhole.eye for camera in cameras.read(chain)] == [(0, 2, 3), (1, 2, 3)]
    (camera,) = cameras.read(f"T_BS:\n  rows: 4\n  cols: 4\n  data: {rows.format(9)}\n" + inner.replace("  ", ""))
    assert camera.pinhole.eye == (9, 2, 3) and camera.pinhole.basis()[2] == pytest.approx((0, 0, -1))


@pytest.mark.parametrize("form", ["calibration", "message"])
def test_of_two_cameras_in_one_yaml_none_is_made(form):
    """The second document's numbers were read into the first one's; a message that was printed twice is one."""
    text = files.ros(form, (1280, 800), (1, 1), (0, 0, 0, 0))
    stamped = [f"header: {{seq: {seq}}}\n{text}---\n" for seq in (1, 2)]
    (camera,) = cameras.read("".join(stamped))
    assert camera.pinhole.distance == (410.5, 410.5)
    assert "twice, with other values" in refusal(stamped[0] + stamped[1].replace("410.5", "500"))
    assert "the key" in refusal(f"{text}{'width' if form == 'message' else 'image_width'}: 640\n")


@pytest.mark.parametrize(
    ("before", "after", "words"), [("633.25", ".nan", "'.nan'"), ("rows: 3", "rows: 2", "2 × 3"), ("410.5", "4_10", "'4_10'")]
)
def test_a_damaged_k_is_named(before, after, words):
    text = files.ros("calibration", (1280, 800), (1, 1), (0, 0, 0, 0)).replace("distortion_model: plumb_bob", "")
    assert "K of camera" in refusal(text.replace(before, after, 1)) and words in refusal(text.replace(before, after, 1))


def test_a_pose_that_is_not_read_is_not_asked_for_again():
    k = {"K": [[500, 0, 320], [0, 500, 180], [0, 0, 1]], "image_size": [640, 360], "position": [1, 2, 3]}
    assert "give --pose" in refusal(json.dumps(k))
    with pytest.raises(InputError, match="has position, of which no pose is read: write R and t"):
        cameras.read(json.dumps(k), options=Options(pose="c2w_opencv"))


@pytest.mark.parametrize("size", [(640, 360), (320, 180)])
def test_a_picture_of_another_size_than_its_camera_says_is_told(tmp_path, size):
    """Copies at half the size are beside many data sets."""
    frames = [{"file_path": "images/a.png", "transform_matrix": np.eye(4).tolist()}]
    (tmp_path / "transforms.json").write_text(json.dumps({"fl_x": 600, "w": 640, "h": 360, "frames": frames}))
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "a.png").write_bytes(files.png(*size))
    (camera,) = cameras.read(tmp_path)
    assert any("has 320 × 180 pixels and its camera 640 × 360" in note for note in camera.notes) == (size == (320, 180))


POSED = "cam.location = (1, 2, 3)\ncam.rotation_euler = (1, 0, 0.5)\n"


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ("cam.constraints.new('TRACK_TO')", "by other means"),
        ("cam.parent = rig", "by other means"),
        ("cam.rotation_euler.z += 0.1", "from where it was"),
        ("cam.location = (1, 2, 4)", "location is something else before"),
        ("cam.location[2] = height", "give location in plain numbers"),
        ("cam.location = (1, 2, 3) if near else (4, 5, 6)", "give location in plain numbers"),
        ("cam.rotation_euler = (1, 0, 0.5)[::-1]", "give rotation_euler in plain numbers"),
        ("cam.scale = (-1, 1, 1)", "by other means"),
        ("camera2.location = (1, 2, 3)", "this is another camera"),
        ("cam.data.type = 'ORTHO'", "of the type ORTHO"),
        ("cam.rotation_mode = 'QUATERNION'", "turns by its rotation_quaternion, which the text does not say"),
        ("cam.data.lens = 50\ncam.data.angle = 1", "both a lens and an angle"),
    ],
)
def test_what_blenders_python_leaves_open_of_a_camera_is_refused(more, sentence):
    seen = Options(view_plane=CAMERAS["plain"].plane)
    (camera,) = cameras.read(POSED.replace("\n", f"  # {'far ' * 50}\n"), options=seen)
    assert camera.pinhole.eye == (1, 2, 3) and any("in Blender's own, XYZ" in note for note in camera.notes)
    with pytest.raises(InputError, match=sentence):
        cameras.read(POSED + more, options=seen)


@pytest.mark.parametrize("between", ["\n", "; "])
def test_blenders_python_may_leave_out_the_object_and_the_brackets(between):
    """Both were refused. What another statement calls the location stays a name."""
    seen = Options(view_plane=CAMERAS["plain"].plane)
    (bare,) = cameras.read(between.join(("location = 1, 2, 3", "rotation_euler = 1, 0, 0.5")), options=seen)
    assert bare.pinhole == cameras.read(POSED, options=seen)[0].pinhole
    (named,) = cameras.read(between.join(("location = 9, 9, 9", POSED)), options=seen)
    assert named.pinhole.eye == (1, 2, 3)
    with pytest.raises(InputError, match="location is something else before"):
        cameras.read(between.join(("location = 1, 2, 3", "location = 4, 5, 6", "rotation_euler = 1, 0, 0.5")), options=seen)


def test_angles_of_blenders_python_that_look_like_degrees_are_told():
    (camera,) = cameras.read(POSED.replace("(1, 0, 0.5)", "(63, 0, 46)"), options=Options(view_plane=CAMERAS["plain"].plane))
    assert any("more than a whole turn: are they degrees?" in note for note in camera.notes), camera.notes


def test_a_list_of_blenders_values_in_json_is_that_camera():
    """Half a turn about x and a quarter about z: it looks up, and its right is y. 36 mm are 640 pixels: 50 mm are 888.9."""
    values = {"location": [1, 2, 3], "rotation_euler": [math.pi, 0, math.pi / 2], "lens": 50, "sensor_width": 36}
    pinhole = read(json.dumps(values)).pinhole
    assert np.allclose(pinhole.axes(), [[0, 1, 0], [1, 0, 0], [0, 0, -1]], rtol=0, atol=1e-15)
    assert pinhole.distance[0] == 50 / 36 * 640


def test_arkits_k_in_the_other_order_and_a_pose_with_a_number_missing_are_refused():
    """The principal point was taken as 0, 0; the camera stood at the origin."""
    k = [500, 0, 300, 0, 500, 200, 0, 0, 1]
    scanned = {"cameraPoseARFrame": np.eye(4).ravel().tolist(), "intrinsics": k}
    recorded = {"poses": [[0, 0, 0, 1, 1, 2, 3]], "K": np.reshape(k, (3, 3)).T.ravel().tolist(), "w": 640, "h": 480}
    for document, key in ((scanned, "intrinsics"), (recorded, "K")):
        (camera,) = cameras.read(json.dumps(document), options=VGA)
        assert camera.pinhole.principal_point == (300, 480 - 200)
        turned = np.reshape(document[key], (3, 3)).T.ravel().tolist()
        with pytest.raises(InputError, match="transpose it"):
            cameras.read(json.dumps(document | {key: turned}), options=VGA)
    phone = {f"t_{row}{column}": float(row == column) for row in range(3) for column in range(4) if (row, column) != (1, 3)}
    with pytest.raises(InputError, match="has no t_13"):
        cameras.read(json.dumps(phone | {"fx": 500, "fy": 500, "cx": 320, "cy": 240, "width": 640, "height": 480}))


def test_gltf_without_its_asset_is_no_sensor_of_mitsubas():
    document = json.loads(cameras.write([Camera("a", CAMERAS["plain"])], "gltf"))
    del document["asset"]
    (camera,) = cameras.read(json.dumps(document))
    assert camera.name == "a" and camera.pinhole == CAMERAS["plain"]


def test_a_damaged_document_is_told_of_wherever_it_stands(tmp_path):
    """A folder, or XML without its declaration, was no camera that is understood, and why was not said."""
    document = json.dumps(files.nerfies(files.Known("plain")))
    for name, text, words in (
        ("camera/a.json", document.replace("[", "[,", 1), "a.json looks like JSON and is none (line 1, column "),
        ("a.sdf", "<sdf><model>\n<link></model></sdf>", "a.sdf looks like XML and is none (line 2, column 9: mismatched tag)"),
        ("a.xml", "<?xml version='1.0'?><document>", "a.xml looks like XML and is none (line 1, column 32: no element found)"),
    ):
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
        with pytest.raises(InputError) as refused:
            cameras.read(file.parent if name.startswith("camera/") else file)
        assert words in str(refused.value), f"{words!r} is not in {refused.value}"


@pytest.mark.parametrize(
    ("before", "after", "sentence"),
    [
        ("-3.861448e+02", "\N{MINUS SIGN}3.861448e+02", "^P1 of .* is '.*': give a number"),
        ("-3.861448e+02 ", "", "^P1 of .* has 11 numbers: it should have 12"),
        ("-3.861448e+02", "nan", "^P1 of .* is nan"),
        ("P1:", "P0:", "^P0 of .* is there twice"),
    ],
)
def test_a_damaged_camera_of_kittis_is_told_and_not_left_out(before, after, sentence):
    assert before in files.KITTI and len(cameras.read("  " + files.KITTI, options=VGA)) == 3
    with pytest.raises(InputError, match=sentence):
        cameras.read(files.KITTI.replace(before, after), options=VGA)


def test_a_damaged_matrix_of_neus_is_told_and_not_left_out(tmp_path):
    matrix = np.vstack([files.projection(files.Known("plain")), [0, 0, 0, 1]])
    np.savez(tmp_path / "cameras.npz", world_mat_0=matrix, world_mat_1=matrix * np.nan)
    with pytest.raises(InputError, match="projection matrix of camera 1 is flat"):
        cameras.read(tmp_path / "cameras.npz", options=VGA)


VIEWED = "view = {}[[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, -3], [0, 0, 0, 1]]{}\n"
VIEWED += "projection = [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, -1, -0.2], [0, 0, -1, 0]]\n"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (THREE.replace("5)", "5).multiplyScalar(2)"), "by other means"),
        ("eye = (3, 4, 5)[::-1]; look_at = (0, 0, 0); up = (0, 0, 1); vfov = 40;", "eye"),
        ("eye = [3, 4, 5] @ turn; look_at = (0, 0, 0); up = (0, 0, 1); vfov = 40;", "eye"),
        ("camera.SetPosition(1, 2, 3)\ncamera.SetFocalPoint(0, 0, 0)\ncamera.UseHorizontalViewAngleOn()", "by other means"),
        ("p.camera.position = (1, 2, 3)\np.camera.focal_point = (0, 0, 0)\np.camera.roll += 10", "moves the camera from where"),
        (VIEWED.format("np.linalg.inv(", ")"), "this view matrix is computed"),
        (VIEWED.format("np.array(", ") @ flip"), "this view matrix is computed"),
        (VIEWED.format("np.array(", ").T @ flip"), "this view matrix is computed"),
        (VIEWED.format("Matrix(", ").inverse()"), "this view matrix is computed"),
        (POSED + "for i in range(3):\n    cam.rotation_euler[i] = angles[i]", "one coordinate of many"),
        (POSED + "cam.rotation_euler.rotate_axis('Z', 1)", "by other means"),
        (POSED + "bpy.ops.transform.translate(value=(1, 0, 0))", "by other means"),
    ],
)
def test_what_is_done_with_a_value_that_is_read_is_refused_and_not_passed_over(text, sentence):
    """Each was read as if that did not stand there."""
    with pytest.raises(InputError, match=sentence):
        cameras.read(text, options=Options(size=(640, 480), view_plane=CAMERAS["plain"].plane))


@pytest.mark.parametrize("kept", ["", ".T", ".astype(np.float32)", "  # in meters", ", dtype=float"])
def test_a_matrix_that_stays_what_it_is_is_read(kept):
    assert read(VIEWED.format("np.array(", f"{kept})" if kept[:1] == "," else f"){kept}")).pinhole.eye == (-5, 0, 3)


def test_a_sidecars_matrices_that_contradict_its_camera_are_refused(tmp_path):
    """Whoever changed them had the old camera, since only the values of `camera` were read."""
    for key, at in (("cameraToWorld", (0, 3)), ("worldToCamera", (1, 2)), ("K", (0, 0))):
        (file,) = cameras.save([Camera("a", CAMERAS["rolled"])], tmp_path / key, "sidecar")
        document = json.loads(file.read_text())
        document[key][at[0]][at[1]] += 1e-3
        file.write_text(json.dumps(document))
        with pytest.raises(InputError, match=f"^{key} of .* is not that of its camera"):
            cameras.read(file)


def test_a_matrix_whose_last_row_is_no_number_is_refused():
    """A comparison with NaN is never true."""
    rows = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, math.nan, 0, 1]]
    document = {"fl_x": 500, "w": 640, "h": 480, "frames": [{"file_path": "a.png", "transform_matrix": rows}]}
    assert "the last row of the matrix" in refusal(json.dumps(document))


def test_meshrooms_version_may_be_one_text():
    """The principal point was then taken from the picture's corner, as in the oldest files."""
    document = json.loads(meshroom())
    (camera,) = cameras.read(json.dumps(document | {"version": "1.2.3"}))
    assert camera.pinhole == cameras.read(json.dumps(document | {"version": ["1", "2", "3"]}))[0].pinhole
    assert "version" in refusal(json.dumps(document | {"version": "new"}))


def test_a_rotation_vector_in_degrees_is_refused():
    """90 was taken for 90 radians."""
    document = {"K": [[500, 0, 320], [0, 500, 180], [0, 0, 1]], "image_size": [640, 360], "rvec": [90, 0, 0], "t": [1, 2, 3]}
    assert "give an angle in radians" in refusal(json.dumps(document))


def test_a_key_of_opencvs_xml_that_is_there_twice_is_refused():
    """The last one counted, where JSON and YAML refuse it."""
    xml = "<opencv_storage><K><rows>3</rows><cols>3</cols><data>500 0 320 0 500 240 0 0 1</data></K>{}</opencv_storage>"
    size = "<image_width>640</image_width><image_height>480</image_height>"
    assert cameras.read(xml.format(size + size))[0].pinhole.width == 640
    assert "'image_width' twice" in refusal(xml.format(size + "<image_width>700</image_width>"))


@pytest.mark.parametrize(("place", "is_told"), [((0, 0), True), ((640, 0), True), ((0, 240), False), ((320, 240), False)])
def test_a_principal_point_in_the_corner_is_told(place, is_told):
    """Programs that do not know it write 0 0."""
    frames = [{"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}]
    document = {"fl_x": 500, "w": 640, "h": 480, "cx": place[0], "cy": place[1], "frames": frames}
    notes = read(json.dumps(document)).notes
    assert any("lies in a corner" in note for note in notes) == is_told, f"{notes} of {place}"


def test_a_node_of_gltf_with_two_poses_is_refused_where_they_differ():
    """Its matrix counted. A node may have one or the other."""
    document = json.loads(cameras.write([Camera("a", CAMERAS["rolled"])], "gltf"))
    (node,) = [each for each in document["nodes"] if "camera" in each]
    matrix = np.array(axes.camera_to_world(CAMERAS["rolled"]))
    for moved, is_right in ((0, True), (0.1, False)):
        node["matrix"] = (matrix + np.array([[0, 0, 0, moved], *[[0] * 4] * 3])).T.ravel().tolist()
        if is_right:
            assert np.allclose(read(json.dumps(document)).pinhole.eye, CAMERAS["rolled"].eye)
        else:
            assert "has a matrix, and another as translation" in refusal(json.dumps(document))


def test_a_picture_as_far_across_as_up_that_is_no_square_is_told():
    for sides, is_told in (((0.7, 0.7), True), ((0.7, 0.4), False)):
        angles = dict(zip(("camera_angle_x", "camera_angle_y"), sides, strict=True))
        document = {**angles, "w": 1920, "h": 1080, "frames": [{"transform_matrix": np.eye(4).tolist()}]}
        (camera,) = cameras.read(json.dumps(document))
        assert any("1.78 times as high as wide" in note for note in camera.notes) == is_told, camera.notes


def test_cameras_in_geocentric_coordinates_are_told():
    for x, is_told in ((3_781_700, True), (378_170, False)):
        pose = [[1, 0, 0, x], [0, 1, 0, 900_000], [0, 0, 1, 5_040_000]]
        document = {"fl_x": 500, "w": 640, "h": 480, "frames": [{"transform_matrix": pose}]}
        (camera,) = cameras.read(json.dumps(document))
        assert any("in geocentric coordinates" in note for note in camera.notes) == is_told, camera.notes


def test_a_lens_of_another_model_is_doubted_where_it_leads_far_out_of_the_picture():
    pinhole = "1 {} 640 480 500 500 320 240\n"  # as many numbers as SIMPLE_RADIAL has, and others
    for model, is_told in (("SIMPLE_RADIAL", True), ("PINHOLE", False)):
        files = {"cameras.txt": pinhole.format(model), "images.txt": "1 1 0 0 0 0 0 0 1 a.jpg\n\n"}
        notes = cameras.FORMATS["colmap"].read(Source(files), Options())[0].notes
        assert any("which may be of another model" in note for note in notes) == is_told, notes
