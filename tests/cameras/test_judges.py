"""Each format judged by a library that nobody here wrote, both ways: what we write it projects as we do, and what it writes we
read as the same camera. With mirrored, shifted, stretched, upright, long, and far cameras."""

import dataclasses
import json
import math

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Camera, Options, axes
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

from .conftest import CAMERAS, allowed, picture_error, points_before

pytestmark = pytest.mark.usefixtures("only_numbers", "openusd_in_this_process")

UNMIRRORED = [name for name, pinhole in CAMERAS.items() if not pinhole.mirrored]
UNSHIFTED = [name for name in UNMIRRORED if "shift" not in name and name != "off_the_picture"]
FLOAT32 = 2.0**-24


def of(name: str) -> Camera:
    return Camera(name, CAMERAS[name], image=f"{name}.png")


def judged(pinhole, column, row_from_top, points, unit=2.0**-53):
    error = picture_error(pinhole, column, pinhole.height - row_from_top, points)
    limit = max(1e-3, allowed(pinhole, points, unit))
    assert error <= limit, f"{error:.3g} pixels, {limit:.3g} are allowed"
    return error


def same_picture(camera: Camera, pinhole, unit=2.0**-53):
    points = points_before(pinhole)
    column, row, _ = camera.pinhole.project(points)
    judged(pinhole, column, pinhole.height - row, points, unit)
    assert (camera.pinhole.width, camera.pinhole.height) == (pinhole.width, pinhole.height)
    assert camera.pinhole.mirrored == pinhole.mirrored


@pytest.mark.parametrize("name", UNMIRRORED)
@pytest.mark.parametrize("form", ["colmap", "colmap_binary"])
def test_pycolmap_sees_through_what_we_write_as_we_do(tmp_path, name, form):
    pycolmap = pytest.importorskip("pycolmap")
    cameras.save([of(name)], tmp_path, form)
    (image,) = pycolmap.Reconstruction(tmp_path).images.values()
    points = points_before(CAMERAS[name])
    seen = np.array([image.project_point(point) for point in points])
    judged(CAMERAS[name], seen[:, 0], seen[:, 1], points)
    assert image.name == f"{name}.png"


@pytest.mark.parametrize("name", UNMIRRORED)
@pytest.mark.parametrize("binary", [False, True])
def test_what_pycolmap_writes_we_see_through_as_it_does(tmp_path, name, binary):
    pycolmap = pytest.importorskip("pycolmap")
    cameras.save([of(name)], tmp_path, "colmap")
    model = pycolmap.Reconstruction(tmp_path)
    expected = tmp_path / "theirs" / "sparse" / "0"
    expected.mkdir(parents=True)
    (model.write_binary if binary else model.write_text)(expected)
    (read,) = cameras.read(tmp_path / "theirs")
    same_picture(read, CAMERAS[name])
    assert read.name == name and read.size_stated


def with_rigs(folder, binary):
    """A model of two rigs with three cameras each, as pycolmap writes it, and the function that writes one of it there."""
    pycolmap = pytest.importorskip("pycolmap")
    options = pycolmap.SyntheticDatasetOptions(num_rigs=2, num_cameras_per_rig=3, num_frames_per_rig=2, num_points3D=3)
    options.camera_model_id, options.camera_params = pycolmap.CameraModelId.PINHOLE, [1280.0, 1290.0, 500.0, 384.0]
    options.sensor_from_rig_rotation_stddev, options.sensor_from_rig_translation_stddev = 30.0, 0.5
    model = pycolmap.synthesize_dataset(options)
    (model.write_binary if binary else model.write_text)(folder)
    return model


@pytest.mark.parametrize("binary", [False, True])
def test_cameras_of_rigs_are_where_pycolmap_has_them(tmp_path, binary):
    model = with_rigs(tmp_path, binary)
    read = {camera.image: camera.pinhole for camera in cameras.read(tmp_path)}
    assert read.keys() == {image.name for image in model.images.values()} and len(read) == 12
    assert (tmp_path / f"rigs.{'bin' if binary else 'txt'}").is_file()
    for image in model.images.values():
        points = points_before(read[image.name])
        seen = np.array([image.project_point(point) for point in points])
        judged(read[image.name], seen[:, 0], seen[:, 1], points)


@pytest.mark.parametrize("binary", [False, True])
def test_images_that_were_changed_beside_their_rigs_are_refused_and_read_without(tmp_path, binary):
    """Scripts that know cameras, images and points alone do so: COLMAP would not see the change, and all others would."""
    suffix = "bin" if binary else "txt"
    model = with_rigs(tmp_path, binary)
    rigs = [tmp_path / f"{name}.{suffix}" for name in ("rigs", "frames")]
    before = [path.read_bytes() for path in rigs]
    pycolmap = pytest.importorskip("pycolmap")
    model.transform(pycolmap.Sim3d(1.0, pycolmap.Rotation3d(), [5e-4, 0.0, 0.0]))
    (model.write_binary if binary else model.write_text)(tmp_path)
    for path, content in zip(rigs, before, strict=True):
        path.write_bytes(content)
    with pytest.raises(InputError, match=rf"and 9 more is another by .*rigs\.{suffix} and .*frames\.{suffix}, and"):
        cameras.read(tmp_path)
    for path in rigs:
        path.unlink()
    assert len(cameras.read(tmp_path)) == 12


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("name", ["rigs", "frames"])
def test_damaged_rigs_are_a_sentence(tmp_path, binary, name):
    with_rigs(tmp_path, binary)
    path = tmp_path / f"{name}.{'bin' if binary else 'txt'}"
    content = path.read_bytes()
    path.write_bytes(content[:-9] if binary else content.rpartition(b" ")[0])
    with pytest.raises(InputError, match=rf"{path.name} ends in the middle"):
        cameras.read(tmp_path)


@pytest.mark.parametrize(("form", "binary"), [("colmap", True), ("colmap", False), ("colmap_binary", False)])
def test_nothing_is_written_beside_a_model_that_would_be_read_in_its_place(tmp_path, form, binary):
    with_rigs(tmp_path, binary)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match=r"has rigs\.\w+, .* of another model.*: choose another folder, or take them out"):
        cameras.save([of(UNMIRRORED[0])], tmp_path, form)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_our_binary_model_is_pycolmaps_to_the_byte(tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    cameras.save([of(name) for name in UNMIRRORED], tmp_path / "ours", "colmap_binary")
    (tmp_path / "theirs").mkdir()
    pycolmap.Reconstruction(tmp_path / "ours").write_binary(tmp_path / "theirs")
    for name in ("cameras.bin", "points3D.bin"):
        assert (tmp_path / "ours" / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes(), name


@pytest.mark.parametrize("name", UNMIRRORED)
@pytest.mark.parametrize("suffix", [".yml", ".json", ".xml"])
def test_opencv_and_we_see_the_same(tmp_path, name, suffix):
    cv2 = pytest.importorskip("cv2")
    pinhole = CAMERAS[name]
    ours = tmp_path / "ours.yml"
    cameras.save([of(name)], ours, "opencv")
    storage = cv2.FileStorage(str(ours), cv2.FILE_STORAGE_READ)
    read = {key: storage.getNode(key).mat() for key in ("camera_matrix", "R", "rvec", "t", "distortion_coefficients")}
    storage.release()
    points = points_before(pinhole)
    turn, _ = cv2.Rodrigues(read["R"])
    seen, _ = cv2.projectPoints(points, turn, read["t"], read["camera_matrix"], read["distortion_coefficients"])
    judged(pinhole, seen[:, 0, 0] + 0.5, seen[:, 0, 1] + 0.5, points, unit=2.0**-51)
    assert np.abs(cv2.Rodrigues(read["rvec"])[0] - read["R"]).max() < 1e-14

    expected = tmp_path / f"theirs{suffix}"
    storage = cv2.FileStorage(str(expected), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", pinhole.width)
    storage.write("image_height", pinhole.height)
    storage.write("K", read["camera_matrix"])
    storage.write("rvec", read["rvec"])
    storage.write("tvec", read["t"])
    storage.release()
    (back,) = cameras.read(expected)
    same_picture(back, pinhole, unit=2.0**-51)


@pytest.mark.parametrize("name", [*CAMERAS])
def test_usd_and_we_see_the_same(tmp_path, name):
    pxr = pytest.importorskip("pxr.Usd")
    from pxr import UsdGeom

    pinhole = CAMERAS[name]
    cameras.save([of(name)], tmp_path / "ours.usda", "usd")
    stage = pxr.Stage.Open(str(tmp_path / "ours.usda"))
    (prim,) = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    frustum = UsdGeom.Camera(prim).GetCamera(pxr.TimeCode.Default()).frustum
    view = np.array(UsdGeom.Camera(prim).ComputeLocalToWorldTransform(pxr.TimeCode.Default()).GetInverse())
    points = points_before(pinhole)
    clip = np.c_[points, np.ones(len(points))] @ view @ np.array(frustum.ComputeProjectionMatrix())
    seen = (clip[:, :2] / clip[:, 3:] + 1) / 2 * [pinhole.width, pinhole.height]
    judged(pinhole, seen[:, 0], pinhole.height - seen[:, 1], points, FLOAT32)
    for suffix in (".usda", ".usdc"):
        stage.Export(str(tmp_path / f"theirs{suffix}"))
        (back,) = cameras.read(tmp_path / f"theirs{suffix}")
        same_picture(back, pinhole, FLOAT32)
        assert back.name == name


@pytest.mark.parametrize("name", UNSHIFTED)
def test_gltf_as_other_libraries_parse_it_sees_what_we_see(tmp_path, name):
    pygltflib, trimesh = pytest.importorskip("pygltflib"), pytest.importorskip("trimesh")
    pinhole = CAMERAS[name]
    cameras.save([of(name)], tmp_path / "ours.gltf", "gltf")
    model = pygltflib.GLTF2().load(str(tmp_path / "ours.gltf"))
    (node,), (camera,) = model.nodes, model.cameras
    x, y, z, w = node.rotation
    matrix = trimesh.transformations.quaternion_matrix([w, x, y, z])
    matrix[:3, 3] = node.translation
    points = points_before(pinhole)
    local = (points - matrix[:3, 3]) @ matrix[:3, :3]
    slope = math.tan(camera.perspective.yfov / 2)
    column = (local[:, 0] / -local[:, 2] / (slope * camera.perspective.aspectRatio) + 1) / 2 * pinhole.width
    row = (local[:, 1] / -local[:, 2] / slope + 1) / 2 * pinhole.height
    judged(pinhole, column, pinhole.height - row, points, unit=2.0**-50)
    model.save_binary(str(tmp_path / "theirs.glb"))
    (back,) = cameras.read(tmp_path / "theirs.glb")
    same_picture(back, pinhole, unit=2.0**-50)


@pytest.mark.parametrize("name", UNMIRRORED)
def test_ros_camera_info_as_pyyaml_reads_it_has_our_intrinsics(tmp_path, name):
    yaml = pytest.importorskip("yaml")
    pinhole = CAMERAS[name]
    cameras.save([of(name)], tmp_path / "ours.yaml", "ros")
    values = yaml.safe_load((tmp_path / "ours.yaml").read_text())
    k = np.array(values["camera_matrix"]["data"]).reshape(3, 3)
    expected = np.array(axes.intrinsics(pinhole)) - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
    assert np.array_equal(k, expected) and values["camera_name"] == name
    (tmp_path / "theirs.yaml").write_text(yaml.safe_dump(values))
    (back,) = cameras.read(tmp_path / "theirs.yaml")
    assert np.allclose(axes.intrinsics(back.pinhole), axes.intrinsics(pinhole), rtol=1e-15, atol=0)
    assert any("no pose" in note for note in back.notes)


@pytest.mark.parametrize("name", UNMIRRORED)
def test_bop_projects_as_its_format_says_and_comes_back(name):
    pinhole = CAMERAS[name]
    text = cameras.write([of(name)], "bop", Options(scale=0.001))
    record = json.loads(text)["0"]
    points = points_before(pinhole)
    local = points * 1000 @ np.array(record["cam_R_w2c"]).reshape(3, 3).T + record["cam_t_w2c"]
    seen = local @ np.array(record["cam_K"]).reshape(3, 3).T
    judged(pinhole, seen[:, 0] / seen[:, 2] + 0.5, seen[:, 1] / seen[:, 2] + 0.5, points)
    (back,) = cameras.read(text, options=Options(scale=0.001, size=(pinhole.width, pinhole.height)))
    same_picture(back, pinhole)
    assert not back.size_stated


@pytest.mark.parametrize("name", UNMIRRORED)
def test_transforms_as_nerfstudios_rays_go_pass_through_our_pixels(name):
    """Its formula, in NumPy: ((column + 0.5 − cx)/fl_x, −(row + 0.5 − cy)/fl_y, −1) turned by the matrix."""
    pinhole = CAMERAS[name]
    text = cameras.write([of(name)], "transforms")
    record = json.loads(text)
    matrix = np.array(record["frames"][0]["transform_matrix"])
    column, row = np.array([0, 17, pinhole.width - 1]), np.array([0, 33, pinhole.height - 1])
    local = np.c_[(column + 0.5 - record["cx"]) / record["fl_x"], -(row + 0.5 - record["cy"]) / record["fl_y"], -np.ones(3)]
    rays = local @ matrix[:3, :3].T
    ours = pinhole.ray_directions(column, pinhole.height - 1 - row)
    assert np.abs(rays / np.linalg.norm(rays, axis=1)[:, None] - ours).max() < 1e-14
    (back,) = cameras.read(text)
    same_picture(back, pinhole)
    assert axes.intrinsics(back.pinhole) == axes.intrinsics(pinhole) and back.pinhole.eye == pinhole.eye


@pytest.mark.parametrize("name", [*CAMERAS])
def test_a_sidecar_comes_back_to_the_bit(tmp_path, name):
    cameras.save([of(name)], tmp_path, "sidecar")
    (back,) = cameras.read(tmp_path)
    assert back.pinhole == CAMERAS[name] and back.name == name


@pytest.mark.parametrize("form", ["transforms", "colmap", "colmap_binary", "opencv", "ros", "bop", "gltf"])
def test_a_mirrored_camera_is_refused_by_what_can_not_say_it(form):
    with pytest.raises(InputError, match="mirrored"):
        cameras.write([of("mirrored")], form)


def test_npz_of_numpy_is_read_and_pickle_is_not(tmp_path):
    pinhole = CAMERAS["shifted"]
    rows = np.array(axes.world_to_camera(pinhole))
    k = np.array(axes.intrinsics(pinhole)) - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
    data = {"K": k, "R": rows[:3, :3], "t": rows[:3, 3], "image_size": [640, 360]}
    pickled = np.array([{"a": 1}], dtype=object)
    np.savez(tmp_path / "pickled.npz", **(data | {"K": pickled}))
    with pytest.raises(InputError):
        cameras.read(tmp_path / "pickled.npz")
    np.savez(tmp_path / "camera.npz", **data, other=pickled)  # which is none of the camera's, and is not read
    (back,) = cameras.read(tmp_path / "camera.npz")
    same_picture(back, pinhole)


@pytest.mark.parametrize("model", ["SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV", "FOV", "SIMPLE_DIVISION", "DIVISION"])
def test_the_displacement_that_a_lens_makes_is_pycolmaps(tmp_path, model):
    pycolmap = pytest.importorskip("pycolmap")
    straight = {"f": 600.0, "fx": 600.0, "fy": 610.0, "cx": 310.0, "cy": 190.0}
    bent = {"k": -0.05, "k1": -0.06, "k2": 0.02, "k3": 0.01, "k4": 0.03, "k5": 0.01, "k6": 0.002, "p1": 0.001, "p2": -0.002}
    numbers = [(straight | bent | {"omega": 0.7})[name] for name in cameras.FORMATS["colmap"].MODELS[model][1]]
    pycolmap_camera = pycolmap.Camera(model=model, width=640, height=360, params=numbers)
    f_x, f_y = pycolmap_camera.focal_length_x, pycolmap_camera.focal_length_y
    c_x, c_y = pycolmap_camera.principal_point_x, pycolmap_camera.principal_point_y
    corners = np.array([[x, y] for x in (0, 640) for y in (0, 360)], dtype=float)
    moved = pycolmap_camera.img_from_cam(np.c_[(corners - [c_x, c_y]) / [f_x, f_y], np.ones(4)])
    pixels = np.hypot(*(moved - corners).T).max()
    (tmp_path / "cameras.txt").write_text(f"1 {model} 640 360 {' '.join(map(repr, numbers))}\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n")
    (bent,) = cameras.read(tmp_path)
    assert any(f"moves the picture's corner by {pixels:.3g} pixels" in note for note in bent.notes)
    with pytest.raises(InputError, match=f"corner by {pixels:.3g} pixels"):
        cameras.write([bent], "pbrt")
    (taken,) = cameras.read(tmp_path, options=Options(without_distortion=True))
    assert taken.pinhole == bent.pinhole and taken.pinhole.distance == (f_x, f_y) and taken.lens is None
    assert any(f"{pixels:.3g} pixels" in note for note in taken.notes)


def test_a_panorama_of_colmap_is_refused_by_its_name(tmp_path):
    (tmp_path / "cameras.txt").write_text("1 EQUIRECTANGULAR 640 360 640 360\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n")
    with pytest.raises(InputError, match="EQUIRECTANGULAR"):
        cameras.read(tmp_path, options=Options(without_distortion=True))


def rig_of(shift=0.0):
    """Two cameras that go along together, the right one of another size;

    shift : the distance by which it is aside in the last moment.
    """
    result = []
    for i in range(3):
        angle = 0.4 * i
        across, ahead = np.array([math.cos(angle), math.sin(angle), 0]), np.array([-math.sin(angle), math.cos(angle), -0.2])
        for name, aside, turned, width in (("left", 0.0, 0.0, 320), ("right", 0.12 + shift * (i == 2), 0.1, 300)):
            eye = np.array([i, -5, 2.0]) + aside * across
            pinhole = Pinhole(eye.tolist(), (eye + ahead + turned * across).tolist(), (0, 0, 1), 300, width, 180)
            result.append(Camera(f"{name}_{i}", pinhole, image=f"{name}/{i:04}.png"))
    return result


def test_a_rig_of_cameras_is_written_as_pycolmap_reads_it_and_leaves_all_poses_where_they_are(tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    cameras.save(rig_of(), tmp_path / "model", "colmap")
    model = pycolmap.Reconstruction(tmp_path / "model")
    before = {image.name: image.cam_from_world().matrix() for image in model.images.values()}
    database = pycolmap.Database.open(":memory:")
    for camera in model.cameras.values():
        database.write_camera(camera, use_camera_id=True)
    for image in model.images.values():
        named = pycolmap.Image(name=image.name, camera_id=image.camera_id, image_id=image.image_id)
        database.write_image(named, use_image_id=True)
    pycolmap.apply_rig_config(pycolmap.read_rig_config(tmp_path / "model" / "rig_config.json"), database, model)
    assert (len(model.rigs), len(model.frames)) == (1, 3)
    for image in model.images.values():
        np.testing.assert_allclose(image.cam_from_world().matrix(), before[image.name], atol=1e-14)
    for camera, wanted in zip(cameras.read(tmp_path / "model"), rig_of(), strict=True):
        assert camera.pinhole.eye == pytest.approx(wanted.pinhole.eye, abs=1e-12)


@pytest.mark.parametrize(
    "others",
    [
        rig_of(shift=1e-3),  # it moves on the rig
        rig_of()[:-1],  # a moment without the right one
        rig_of()[::2],  # the left one alone
        rig_of()[:2],  # a moment is no rig
        [dataclasses.replace(camera, image=camera.image.replace("right/", "left/0")) for camera in rig_of()],
        [dataclasses.replace(camera, image=f"{camera.name.partition('_')[0]}.png") for camera in rig_of()[:2]],
    ],
)
def test_cameras_that_are_no_rig_have_no_file_of_it(others):
    assert "rig_config.json" not in cameras.write(others, "colmap")
