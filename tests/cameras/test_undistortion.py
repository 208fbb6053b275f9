"""Pictures without their lens: as COLMAP cuts them, pixel by pixel, with masks, depth maps and points."""

import json

import numpy as np
import pytest

from viewcam_addon import cameras, cli
from viewcam_addon.cameras import axes, distortion
from viewcam_addon.cameras.undistortion import resampled, undistorted

from .test_distortion import COLMAP, of_colmap

cv2 = pytest.importorskip("cv2")
pycolmap = pytest.importorskip("pycolmap")

pytestmark = pytest.mark.slow

WIDTH, HEIGHT = 640, 360
BENT = [model for model in COLMAP if model not in ("THIN_PRISM_FISHEYE", "RAD_TAN_THIN_PRISM_FISHEYE")]


def photograph():
    """Smooth gradients and noise, (height, width, 3) uint8."""
    random = np.random.default_rng(5)
    column, row = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    smooth = np.stack([127 + 100 * np.sin(column / 9), 127 + 100 * np.cos(row / 7), column * 255 / WIDTH], axis=-1)
    return np.clip(smooth + random.normal(0, 8, smooth.shape), 0, 255).astype(np.uint8)


def undistorted_by_judge(numbers, model, blank):
    options = pycolmap.UndistortCameraOptions()
    options.blank_pixels = blank
    return options, pycolmap.Camera(model=model, width=WIDTH, height=HEIGHT, params=numbers)


@pytest.mark.parametrize("blank", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("model", COLMAP)
def test_the_pinhole_that_is_cut_from_a_lens_is_colmaps(tmp_path, model, blank):
    camera, numbers, _ = of_colmap(model, tmp_path)
    options, bent = undistorted_by_judge(numbers, model, blank)
    straight = pycolmap.undistort_camera(options, bent)
    cut = undistorted(camera.lens, camera.pinhole.plane, blank)
    f_x, f_y, c_x, c_y = straight.params
    assert (cut.width, cut.height) == (straight.width, straight.height)
    assert cut.distance == (f_x, f_y)
    assert (cut.principal_point[0], cut.height - cut.principal_point[1]) == pytest.approx((c_x, c_y), abs=1e-6)


@pytest.mark.parametrize("blank", [0.0, 1.0])
@pytest.mark.parametrize("model", BENT)
def test_the_undistorted_picture_is_colmaps_but_for_rounding(tmp_path, model, blank):
    camera, numbers, _ = of_colmap(model, tmp_path)
    options, bent = undistorted_by_judge(numbers, model, blank)
    picture = photograph()
    bitmap, _ = pycolmap.undistort_image(options, pycolmap.Bitmap.from_array(picture), bent)
    expected = bitmap.to_array().astype(int)
    plane = camera.pinhole.plane
    ours = resampled(picture, camera.lens, plane, undistorted(camera.lens, plane, blank)).astype(int)
    both_lit = (expected.sum(axis=-1) > 0) & (ours.sum(axis=-1) > 0)
    assert np.abs(ours - expected)[both_lit].max() <= 1, "a half that is rounded up there and to even here"
    edge = (expected.sum(axis=-1) > 0) != (ours.sum(axis=-1) > 0)
    assert edge.mean() < 1e-4, "whether a place is the last pixel's center is rounding"
    if not blank:
        assert both_lit.mean() > 0.999


def test_another_lens_is_seen_in_the_picture(tmp_path):
    camera, numbers, _ = of_colmap("OPENCV", tmp_path)
    options, bent = undistorted_by_judge(
        [*numbers[:6], numbers[7], numbers[6]], "OPENCV", 0.0
    )  # p1 and p2 swapped, as Metashape's are
    expected = pycolmap.undistort_image(options, pycolmap.Bitmap.from_array(photograph()), bent)[0].to_array().astype(int)
    plane = camera.pinhole.plane
    ours = resampled(photograph(), camera.lens, plane, undistorted(camera.lens, plane)).astype(int)
    height, width = min(expected.shape[0], ours.shape[0]), min(expected.shape[1], ours.shape[1])
    assert np.abs(expected[:height, :width] - ours[:height, :width]).mean() > 2


def test_what_is_beyond_the_fold_of_a_lens_is_empty_and_no_second_picture():
    lens = distortion.opencv({"k1": -0.3})
    plane = axes.view_plane(100, 100, 200, 100, (400, 200))
    picture = resampled(np.full((200, 400), 255, np.uint8), lens, plane, plane)
    radius = np.hypot(np.arange(400) + 0.5 - 200, 0.5) / 100
    assert (picture[100][radius < 1.05] == 255).all() and (picture[100][radius > 1.06] == 0).all()


def dataset(folder, lens="OPENCV", wide=(600.0, 610.0, 310.0, 190.0)):
    """A COLMAP model of two pictures with points, and masks."""
    numbers = " ".join(map(repr, [*wide, *COLMAP[lens][0]]))
    (folder / "sparse" / "0").mkdir(parents=True)
    (folder / "images").mkdir()
    (folder / "masks").mkdir()
    model = folder / "sparse" / "0"
    (model / "cameras.txt").write_text(f"1 {lens} 640 360 {numbers}\n2 PINHOLE 640 360 600 600 320 180\n")
    (model / "images.txt").write_text("1 1 0 0 0 0 0 4 1 a.png\n100 100 7\n2 1 0 0 0 0.5 0 4 2 b.png\n\n")
    (model / "points3D.txt").write_text("7 0.5 0.25 1.0 10 20 30 0.5 1 0\n")
    for name in ("a", "b"):
        cv2.imwrite(str(folder / "images" / f"{name}.png"), photograph())
        mask = np.where(photograph()[..., 2] > 127, 255, 0).astype(np.uint8)
        cv2.imwrite(str(folder / "masks" / f"{name}.png.png"), mask)
    return folder


def test_a_colmap_data_set_comes_out_as_pycolmap_reads_it_with_pictures_masks_and_points(tmp_path, capfd):
    folder = dataset(tmp_path / "given")
    assert cli.main(["camera", str(folder), "--undistort", str(tmp_path / "out")]) == 0
    assert "2 pictures, 1 of them undistorted" in capfd.readouterr().out
    model = pycolmap.Reconstruction(tmp_path / "out" / "sparse" / "0")
    options, bent = undistorted_by_judge([600, 610, 310, 190, *COLMAP["OPENCV"][0]], "OPENCV", 0.0)
    straight = pycolmap.undistort_camera(options, bent)
    (first,) = (image for image in model.images.values() if image.name == "a.png")
    assert first.camera.params == pytest.approx(straight.params, abs=1e-6) and first.camera.model.name == "PINHOLE"
    assert [tuple(point.xyz) for point in model.points3D.values()] == [(0.5, 0.25, 1.0)]
    assert tuple(next(iter(model.points3D.values())).color) == (10, 20, 30)
    picture, mask = (cv2.imread(str(tmp_path / "out" / name), cv2.IMREAD_UNCHANGED) for name in ("images/a.png", "masks/a.png"))
    assert picture.shape[:2] == mask.shape == (straight.height, straight.width)
    assert set(np.unique(mask)) == {0, 255}, "a mask has no values between"
    same = (tmp_path / "out" / "images" / "b.png").read_bytes()
    assert same == (folder / "images" / "b.png").read_bytes(), "what no lens bends stays to the bit"


def test_a_data_set_of_nerfstudio_keeps_its_depth_maps_and_masks(tmp_path):
    folder = dataset(tmp_path / "given", "OPENCV_FISHEYE", (300.0, 300.0, 310.0, 190.0))
    k = dict(zip(("k1", "k2", "k3", "k4"), COLMAP["OPENCV_FISHEYE"][0], strict=True))
    frame = {"file_path": "images/a.png", "mask_path": "masks/a.png.png", "depth_file_path": "depth/a.npy"}
    frame["transform_matrix"] = np.eye(4).tolist()
    document = {"camera_model": "OPENCV_FISHEYE", "fl_x": 300, "fl_y": 300, "cx": 310, "cy": 190, "w": 640, "h": 360, **k}
    (folder / "transforms.json").write_text(json.dumps(document | {"depth_unit_scale_factor": 0.5, "frames": [frame]}))
    (folder / "depth").mkdir()
    depth = np.where(photograph()[..., 2] > 127, 3.0, 5.0).astype(np.float32)
    np.save(folder / "depth" / "a.npy", depth)
    out = tmp_path / "out"
    assert cli.main(["camera", str(folder / "transforms.json"), "--undistort", str(out), "--blank", "0.5"]) == 0
    written = json.loads((out / "transforms.json").read_text())
    assert written["depth_unit_scale_factor"] == 0.5 and "k1" not in written
    (frame,) = written["frames"]
    (camera,) = cameras.read(out)
    actual = np.load(out / frame["depth_file_path"])
    mask = cv2.imread(str(out / frame["mask_path"]), cv2.IMREAD_UNCHANGED)
    assert actual.shape == mask.shape == (camera.pinhole.height, camera.pinhole.width) and actual.dtype == np.float32
    assert set(np.unique(actual)) <= {0.0, 3.0, 5.0}, "no depth lies between two"
    assert ((actual == 3) == (mask == 255)).all()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--to", "pbrt"], "transforms or colmap"),
        (["--axes", "y_up"], "leaves the world"),
        (["--camera", "a"], "all of a data set"),
        (["--blank", "2"], "no number from 0 to 1"),
    ],
)
def test_what_can_not_be_undistorted_is_told_in_a_sentence(tmp_path, capfd, words, sentence):
    folder = dataset(tmp_path / "given")
    assert cli.main(["camera", str(folder), "--undistort", str(tmp_path / "out"), *words]) == 2
    assert sentence in capfd.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [("missing", "can't be found"), ("size", "320 × 180"), ("damage", "no picture"), ("cut", "ends in the middle")],
)
def test_a_picture_that_is_not_its_cameras_is_told(tmp_path, capfd, change, sentence):
    """In one line, though OpenCV has others to print; a JPEG that was cut short came out gray from there on."""
    folder = dataset(tmp_path / "given")
    picture = folder / "images" / "a.png"
    if change == "missing":
        picture.unlink()
    elif change == "size":
        cv2.imwrite(str(picture), photograph()[::2, ::2])
    else:
        data = picture.read_bytes() if change == "damage" else cv2.imencode(".jpg", photograph())[1].tobytes()
        picture.write_bytes(data[: len(data) // 2])
    assert cli.main(["camera", str(folder), "--undistort", str(tmp_path / "out")]) == 2
    *notes, refusal = capfd.readouterr().err.splitlines()
    assert sentence in refusal and all("note:" in note for note in notes)
    assert not (tmp_path / "out").exists(), "half a data set"


def test_a_folder_that_holds_something_is_left_as_it_is(tmp_path, capfd):
    folder = dataset(tmp_path / "given")
    before = (folder / "images" / "a.png").read_bytes()
    assert cli.main(["camera", str(folder), "--undistort", str(folder)]) == 2
    assert "not an empty folder" in capfd.readouterr().err and (folder / "images" / "a.png").read_bytes() == before


def test_sixteen_bits_and_alpha_stay(tmp_path):
    camera, *_ = of_colmap("OPENCV", tmp_path)
    plane = camera.pinhole.plane
    deep = np.full((HEIGHT, WIDTH, 4), 40_001, np.uint16)
    assert (resampled(deep, camera.lens, plane, undistorted(camera.lens, plane)) == 40_001).all()


# --- ST maps, by pycolmap and by a picture that goes there and back


@pytest.mark.parametrize("model", ["OPENCV", "OPENCV_FISHEYE", "FULL_OPENCV"])
def test_maps_tell_pycolmaps_places_both_ways(tmp_path, capfd, model):
    numbers = {
        "OPENCV": (300.0, 305.0, 163.0, 88.0, -0.12, 0.05, 0.002, -0.003),
        "OPENCV_FISHEYE": (220.0, 221.0, 160.0, 91.0, 0.02, -0.01, 0.003, 0.001),
        "FULL_OPENCV": (300.0, 300.0, 161.0, 89.0, -0.1, 0.02, 0.001, 0.002, 0.01, 0.03, -0.01, 0.002),
    }[model]
    written = tmp_path / "scan"
    written.mkdir()
    (written / "cameras.txt").write_text(f"1 {model} 320 180 {' '.join(map(str, numbers))}\n")
    (written / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 1 0 0 1 b.png\n\n")
    assert cli.main(["camera", str(written), "--st-maps", str(tmp_path / "out"), "--blank", "1"]) == 0
    assert "lens_1: 320 × 180 with the lens, " in capfd.readouterr().out
    document = json.loads((tmp_path / "out" / "transforms.json").read_text())
    bent = pycolmap.Camera(model=model, width=320, height=180, params=numbers)
    pinhole = [document[key] for key in ("fl_x", "fl_y", "cx", "cy")]
    straight = pycolmap.Camera(model="PINHOLE", width=document["w"], height=document["h"], params=pinhole)
    for what, here, there in (("distort", bent, straight), ("undistort", straight, bent)):
        pixels = read_rgba(tmp_path / "out" / f"lens_1.{what}.exr")
        assert pixels.shape == (here.height, here.width, 4)
        rows, columns = np.nonzero(pixels[..., 3])
        assert len(rows) > 0.7 * here.width * here.height
        assert what == "undistort" or len(rows) == 320 * 180, "with --blank 1 the render fills the photograph"
        rays = here.cam_from_img(np.stack([columns, rows], axis=-1) + 0.5)
        expected = there.img_from_cam(np.column_stack([rays, np.ones(len(rays))]))
        s, t = pixels[rows, columns, :2].T.astype(float)
        off = np.abs(np.stack([s * there.width, (1 - t) * there.height], axis=-1) - expected)
        assert off.max() <= 1e-4, f"{what} is off by {off.max():.3g} pixels"  # float32's half step of 1 is 1e-5 of 320


def read_rgba(path):
    """(height, width, 4), rows from the top."""
    openexr = pytest.importorskip("OpenEXR")
    return openexr.File(str(path)).parts[0].channels["RGBA"].pixels


def test_maps_of_cameras_without_a_lens_are_a_sentence(tmp_path, capfd):
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 320 180 300 300 160 90\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n")
    assert cli.main(["camera", str(tmp_path), "--st-maps", str(tmp_path / "out")]) == 2
    assert "has a lens that distorts: there is nothing to map" in capfd.readouterr().err and not (tmp_path / "out").exists()
    assert cli.main(["camera", str(tmp_path), "--st-maps", str(tmp_path / "out"), "--to", "colmap"]) == 2
