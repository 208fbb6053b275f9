"""A small file of every format of cameras, of which the fuzzer makes mutants: written by us, or made by the format's rule."""

import io
import json
import struct
import zipfile
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tests.cameras import test_hostile as documents
from tests.cameras import test_of_strangers as mixed
from tests.cameras import test_paths as paths
from tests.cameras import test_read_only_formats as published
from tests.cameras.conftest import CAMERAS
from viewcam_addon import cameras
from viewcam_addon.cameras import Camera, Options

SHIFTED, PLAIN, SQUARE = (CAMERAS[name] for name in ("shifted_and_not_square", "plain", "rolled"))
POSE = "1 0 0\n0 1 0\n0 0 1\n0 0 -4\n"

BLENDER = """data = bpy.data.cameras.new("C")
cam = bpy.data.objects.new("C", data)
size = 640
cam.location = (1, 2, 3)
cam.rotation_mode = 'ZXY'
cam.rotation_euler = Euler((math.radians(60), 0.1, 45 * pi / 180), 'ZXY')
cam.rotation_euler[1] = 0.2  # a little
data.lens = 35
data.shift_x = 0.1
scene.render.resolution_x = size
"""
LOOKS = """const camera = new THREE.PerspectiveCamera(50, 1.33, 0.1, 100); camera.position.set(3, 4, 5); camera.lookAt(0, 1, 0);
gluPerspective(60, 1.333, 1, 100); gluLookAt(1, 2, 3, 0, 0, 0, 0, 0, 1);
plotter.camera_position = [(1, 2, 3), (0, 0, 0), (0, 0, 1)]
"""


def _several(form: str, *pinholes, axes: str = "as_is") -> str | dict[str, str | bytes]:
    written_cameras = [Camera(f"c{number}", pinhole, image=f"c{number}.png") for number, pinhole in enumerate(pinholes)]
    return cameras.write(written_cameras, form, Options(axes=axes))


def _npz() -> bytes:
    packed = io.BytesIO()
    np.savez(packed, K=np.array([[600.0, 0, 320], [0, 600, 180], [0, 0, 1]]), R=np.eye(3), t=np.zeros(3), image_size=[640, 360])
    return packed.getvalue()


def _neus(matrix: np.ndarray) -> bytes:
    packed = io.BytesIO()
    np.savez(packed, world_mat_0=np.vstack([matrix, [0, 0, 0, 1]]), scale_mat_0=np.diag([2.0, 2, 2, 1]))
    return packed.getvalue()


def _npy() -> bytes:
    saved = io.BytesIO()
    pose = np.column_stack([[[0, 1, 0], [-1, 0, 0], [0, 0, 1]], [1, 2, 3], [360, 640, 600]])  # down, right, back, eye, size
    np.save(saved, [[*pose.ravel(), 1, 9]] * 3)
    return saved.getvalue()


def _fspy() -> bytes:
    parameters = {
        "principalPoint": {"x": 0.1, "y": 0.0},
        "cameraTransform": {"rows": np.eye(4).tolist()},
        "relativeFocalLength": 1.5,
        "imageWidth": 640,
        "imageHeight": 360,
    }
    state = json.dumps(
        {"cameraParameters": parameters, "calibrationSettingsBase": {"referenceDistanceUnit": "Meters"}}
    ).encode()
    return b"fspy" + struct.pack("<III", 1, len(state), 0) + state


def _glb() -> bytes:
    document = str(_several("gltf", PLAIN, SQUARE)).encode()
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(document), len(document), b"JSON") + document


def _usdz() -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("a.usda", str(_several("usd", SHIFTED, PLAIN)))
    return packed.getvalue()


def _crate() -> bytes:
    """The binary kind of USD, as OpenUSD writes it."""
    import tempfile
    from pathlib import Path

    from pxr import Usd

    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "a.usda").write_text(str(_several("usd", SHIFTED, PLAIN)))
        Usd.Stage.Open(f"{folder}/a.usda").Export(f"{folder}/a.usdc")
        return (Path(folder) / "a.usdc").read_bytes()


def _with_lenses(transforms: dict) -> dict:
    """The transforms with a lens of its own for each of the first two frames."""
    first, second, *_ = transforms["frames"]
    first |= {"camera_model": "OPENCV", "k1": -0.1, "k2": 0.02, "p1": 1e-3, "p2": -5e-4}
    second |= {"camera_model": "OPENCV_FISHEYE", "k1": 0.05, "k2": -0.01, "k3": 1e-3, "k4": -1e-4}
    return transforms


def _lenses() -> dict[str, str]:
    models = [
        "OPENCV 640 360 600 600 320 180 -0.1 0.02 0.001 0.002", "OPENCV_FISHEYE 640 360 300 300 320 180 0.1 0 0 0",
        "FOV 640 360 600 600 320 180 0.9", "DIVISION 640 360 600 600 320 180 -0.2", "EUCM 640 360 600 600 320 180 0.5 1.2",
        "FULL_OPENCV 640 360 600 600 320 180 0.1 -0.05 0.01 -0.02 0.03 0.05 0.01 0.02",
    ]  # fmt: skip
    return {
        ".": "",
        "cameras.txt": "".join(f"{number} {model}\n" for number, model in enumerate(models)),
        "images.txt": "".join(f"{number} 1 0 0 0 0 0 4 {number} {number}.png\n\n" for number in range(len(models))),
    }


def _camview(known: published.Known) -> bytes:
    file = io.BytesIO()
    published.infinigen(file, known)
    return file.getvalue()


def _ros() -> str:
    return published.ros("flow", (1280, 800), (2, 2), (320, 200, 640, 480))


def _euroc() -> dict[str, str]:
    sensor = "T_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nresolution: [640, 480]\n"
    sensor += "intrinsics: [500, 500, 320, 240]\ndistortion_model: radial-tangential\ndistortion_coefficients: [0, 0, 0, 0]\n"
    return {
        "state/data.csv": "#timestamp, p_RS_R_x [m], p_RS_R_y [m], q_RS_w []\n0,1,2,3,1,0,0,0\n",
        "cam0/sensor.yaml": sensor,
    }


def files() -> dict[str, Mapping[str, str | bytes]]:
    """Name of a kind → its files by their names, of which the first one is opened, or the folder if that is called "."."""
    known = published.Known("plain")
    phone = {f"t_{row}{column}": float(row == column) for row in range(3) for column in range(4)}
    phone |= {"fx": 500.0, "fy": 500.0, "cx": 320.0, "cy": 240.0, "width": 640, "height": 480}
    scanner = {"cameraPoseARFrame": np.eye(4).ravel().tolist(), "intrinsics": [500, 0, 320, 0, 500, 240, 0, 0, 1]}
    record = {"poses": [[0, 0, 0, 1, 1, 2, 3]] * 2, "K": [500, 0, 0, 0, 500, 0, 320, 240, 1], "w": 640, "h": 480, "fps": 30}
    picture = {"id": 0, "img_name": "a.png", "width": 640, "height": 480, "position": [1, 2, 3], "rotation": np.eye(3).tolist()}
    xml = "<opencv_storage><K type_id='opencv-matrix'><rows>3</rows><cols>3</cols><data>500 0 320 0 500 240 0 0 1</data>"
    xml += "</K><image_width>640</image_width><image_height>480</image_height></opencv_storage>"
    dictionary = "{'type': 'perspective', 'fov': 40, 'to_world': mi.ScalarTransform4f().look_at(origin=[1, 2, 3], "
    dictionary += "target=[0, 0, 0], up=[0, 0, 1]), 'film': {'type': 'hdrfilm', 'width': 640, 'height': 360}}"
    pov = "#version 3.7;\n#declare E = <7,-6,4>;\n"
    pov += "camera { location E right -x*4/3 up y angle 40 sky z look_at <0,0,1> rotate 5*y }"
    written = {
        name: {f"a{cameras.FORMATS[name].SUFFIX}": _several(name, SHIFTED, PLAIN)}
        for name in ("transforms", "bop", "usd", "three_js", "matrices", "look_at")
    }
    return written | {
        "mitsuba": {"a.xml": _several("mitsuba", PLAIN, replace(PLAIN, principal_point=(300, 200)))},
        "mitsuba_dictionary": {"a.py": dictionary},
        "gltf": {"a.gltf": _several("gltf", PLAIN, SQUARE)},
        "glb": {"a.glb": _glb()},
        "usdz": {"a.usdz": _usdz()},
        "usdc": {"a.usdc": _crate()},
        "sidecar": {".": "", **_several("sidecar", SHIFTED, PLAIN)},
        "colmap": {".": "", **_several("colmap", SHIFTED, PLAIN)},
        "colmap_binary": {".": "", **_several("colmap_binary", SHIFTED, PLAIN)},
        "opencv": {"a.yml": _several("opencv", SHIFTED)},
        "opencv_json": {"a.json": mixed.opencv()},
        "opencv_xml": {"a.xml": xml},
        "opencv_npz": {"a.npz": _npz()},
        "kalibr": {"a.yaml": mixed.kalibr()},
        "ros": {"a.yaml": _several("ros", SHIFTED)},
        "ros_window": {"a.yaml": _ros()},
        "fspy": {"a.fspy": _fspy()},
        "metashape": {"a.xml": mixed.metashape()},
        "realitycapture": {"a.xmp": documents.texts()[-1]},
        "meshroom": {"a.sfm": mixed.meshroom()},
        "openmvg": {"a.json": mixed.openmvg()},
        "realitycapture_table": {"a.csv": published.realitycapture_table(known, published.RC_HEADS[0], -0.1, 0.02)},
        "visualsfm": {"a.nvm": published.visualsfm(known, term=-0.1)},
        "bundler": {"a.out": f"# Bundle file v0.3\n2 0\n600 0 0\n{POSE}600 -0.2 0.1\n{POSE}", "list.txt": "a.jpg\nb.jpg\n"},
        "mvsnet": {".": "", "cams/00000000_cam.txt": published.mvsnet(known)},
        "middlebury": {"a_par.txt": f"1\na.png {'9 0 4 0 9 3 0 0 1'} 1 0 0 0 1 0 0 0 1 1 2 3\n"},
        "middlebury_pair": {"calib.txt": "cam0=[400 0 32; 0 400 24; 0 0 1]\ncam1=[400 0 36; 0 400 24; 0 0 1]\nbaseline=176\n"},
        "neus": {"cameras_sphere.npz": _neus(published.projection(known))},
        "kitti_calibration": {"calib.txt": published.KITTI},
        "pmvs": {"a.txt": "CONTOUR\n" + "\n".join(map(published.text_of, published.projection(known)))},
        "pose_files": {
            ".": "",
            "intrinsic/intrinsic_color.txt": "500 0 32 0\n0 500 24 0\n0 0 1 0\n0 0 0 1\n",
            **{f"pose/{number}.txt": published.pose_text(known) for number in range(2)},
        },
        "redwood": {"a.log": f"0 0 1\n{published.pose_text(known)}" * 2},
        "replica": {"traj.txt": f"{published.pose_text(known).replace(chr(10), ' ')}\n" * 2},
        "bop_sensor": {"camera.json": json.dumps(dict(fx=572, fy=573, cx=325, cy=242, width=640, height=480, depth_scale=1))},
        "llff": {"poses_bounds.npy": _npy()},
        "polycam": {"a.json": json.dumps(phone)},
        "scanner": {"a.json": json.dumps(scanner)},
        "record3d": {"metadata": json.dumps(record)},
        "gaussian_splatting": {"cameras.json": json.dumps([picture | {"fx": 500, "fy": 500}] * 2)},
        "nerfstudio_path": {
            "a.json": json.dumps(published.nerfstudio_path(known, known)),
            "dataparser_transforms.json": json.dumps({"transform": np.eye(4)[:3].tolist(), "scale": 0.5}),
        },
        "open3d": {"a.json": json.dumps({"class_name": "PinholeCameraTrajectory", "parameters": [published.open3d(known)]})},
        "instant_ngp": {
            "a.json": json.dumps({"path": [published.instant_ngp(known)] * 3, "time": 0.0}),
            "transforms.json": json.dumps({"scale": 0.5, "offset": [0.5, 0.4, 0.3], "frames": []}),
        },
        "kubric": {"metadata.json": json.dumps(published.kubric(known, known))},
        "nvisii": {"a.json": json.dumps(published.nvisii(known))},
        "infinigen": {"a.npz": _camview(known)},
        "fspy_exported": {"a.json": json.dumps(published.FSPY_EXPORTED)},
        "supersplat": {"settings.json": json.dumps(paths.supersplat_viewer())},
        "supersplat_project": {"a.ssproj": paths.ssproj(paths.supersplat_project())},
        "earth_studio": {"a.json": json.dumps(paths.earth_studio((3.0, 4.0, 5.0)))},
        "after_effects": {"a.jsx": paths.AFTER_EFFECTS},
        "opensfm": {"reconstruction.json": json.dumps(published.opensfm(known, k1=-0.1, k2=0.02))},
        "tum": {"a.txt": "".join(f"{i} 1 2 3 0 0 0 1\n" for i in range(5))},
        "kitti": {"a.txt": "1 0 0 1 0 1 0 2 0 0 1 3\n" * 3},
        "euroc": _euroc(),
        "pbrt": {"a.pbrt": _several("pbrt", SHIFTED)},
        "pov_ray": {"a.pov": pov},
        "vtk": {"a.py": _several("vtk", replace(PLAIN, principal_point=(300, 200)))},
        "textbook": {"a.cpp": _several("textbook", PLAIN)},
        "looks": {"a.js": LOOKS.splitlines()[0]},
        "looks_gl": {"a.c": LOOKS.splitlines()[1]},
        "looks_vtk": {"a.py": LOOKS.splitlines()[2]},
        "blender_python": {"a.py": BLENDER},
        "realestate10k": {"a.txt": "https://a.b/c\n" + "1 0.5 0.9 0.5 0.5 0 0 1 0 0 1 0 1 0 2 0 0 1 3\n" * 3},
        "nerfies": {".": "", "camera/a.json": json.dumps(published.nerfies(known))},
        "basalt": {"a.json": json.dumps({"value0": published.basalt(known, "kb4", k1=0.1, k2=0, k3=0, k4=0)})},
        "azure_kinect": {"a.json": json.dumps(published.azure_kinect(known))},
        "nuscenes": {f"{name}.json": json.dumps(rows) for name, rows in published.nuscenes(known).items()},
        "gazebo": {"a.sdf": published.gazebo(known, "1 2 3 0.1 0.2 0.3")},
        "text": {"a.json": _several("text", SHIFTED)},
        "text_of_people": {"a.txt": "eye=(7, -6, 4) look_at=0,0,1 up=[0 0 1] fov=40° axis=x size=640x360"},
        "chan": {"a.chan": "1 0 1 5 0 0 0 45\n2 0 1 5 0 0 0 45\n"},
        "transforms_applied": {"a.json": json.dumps(documents.documents()[1])},
        "metashape_bent": {"a.xml": published.metashape(known, "<k1>-0.01</k1>")},
        "colmap_lenses": _lenses(),
        "transforms_lenses": {"a.json": json.dumps(_with_lenses(json.loads(_several("transforms", PLAIN, SQUARE))))},
        "opencv_fisheye": {"a.json": json.dumps({**published.K, "model": "fisheye", "dist": [0.1, -0.02, 0.005, 0]})},
    }  # fmt: skip
