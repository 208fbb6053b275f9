"""Stereo pairs: pixels that OpenCV reads, by the data sets' formulas; disparities and what is hidden, by the tracer's flow."""

from dataclasses import replace

import numpy as np
import pytest

import viewcam_addon as vp
from viewcam_addon import cameras
from viewcam_addon.cli import main
from viewcam_addon.image import BACKGROUND_DEPTH
from viewcam_addon.labels import files, stereo
from viewcam_addon.pinhole import Pinhole

from .conftest import room

cv2 = pytest.importorskip("cv2")

LEFT = Pinhole((1.0, -7.0, 3.0), (0.2, 0, 0.8), (0, 0, 1), (70, 75), 64, 48, principal_point=(30, 25))
BASELINE = 0.8


def moved(camera, across=0.0, up=0.0, **changes):
    u, v, _ = camera.basis()
    step = across * u + up * v
    return replace(camera, eye=tuple(camera.eye + step), look_at=tuple(camera.look_at + step), **changes)


RIGHT = moved(LEFT, BASELINE, principal_point=(33, 25))


def picture(path, camera):
    files.write(path, vp.label(room(camera), ("depth",)))
    cv2.imwrite(str(path.with_suffix(".png")), np.full((camera.height, camera.width, 3), 128, np.uint8))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """shots/ of a pair, and its two data sets, by the command."""
    folder = tmp_path_factory.mktemp("stereo")
    picture(folder / "shots" / "Left 1.exr", LEFT)
    picture(folder / "shots" / "Right 1.exr", RIGHT)
    assert main(["labels", str(folder / "shots"), str(folder / "middlebury"), "--to", "middlebury"]) == 0
    words = ["--to", "kitti", "--pair", "Left", "Right"]
    assert main(["labels", str(folder / "shots"), str(folder / "kitti"), *words]) == 0
    return folder


@pytest.fixture(scope="module")
def flow():
    """From the left picture to the right one, as the tracer finds it by rays: how far left, and what is hidden there."""
    image = vp.label(room(LEFT), ("flow", "depth"), next=room(RIGHT)).image
    disparity = -image["Forward Flow"][::-1, :, 0].astype(float)
    return disparity, image["Forward Hidden"][::-1, :, 0] != 0, image["Depth"][::-1, :, 0].astype(float)


def values_of(path):
    return dict(line.split("=", 1) for line in path.read_text().splitlines())


def test_middleburys_formula_gives_the_depth_that_the_pixels_have(folder, flow):
    own = folder / "middlebury" / "Left 1"
    values = values_of(own / "calib.txt")
    disparity = cv2.imread(str(own / "disp0.pfm"), cv2.IMREAD_UNCHANGED).astype(float)
    k = np.array([[float(number) for number in row.split()] for row in values["cam0"].strip("[]").split(";")])
    depth = float(values["baseline"]) * k[0, 0] / (disparity + float(values["doffs"])) / 1000
    visible = flow[2] < BACKGROUND_DEPTH
    assert visible.any() and not visible.all() and np.isinf(disparity[~visible]).all()
    off = np.abs(depth / flow[2] - 1)[visible].max()
    # A disparity and a depth are float32 each; the smallest disparity and doffs cancel to a third of themselves.
    assert off < 4 * 2.0**-24 * 3, f"depth is off by {off:.2g} of itself"
    assert float(values["doffs"]) == 3 and int(values["ndisp"]) == int(values["vmax"]) + 1
    assert (disparity[visible] >= int(values["vmin"])).all() and (disparity[visible] <= int(values["vmax"])).all()


def test_disparities_and_what_both_see_are_those_of_the_tracers_rays(folder, flow):
    disparity, hidden, _ = flow
    own = folder / "middlebury" / "Left 1"
    read = cv2.imread(str(own / "disp0.pfm"), cv2.IMREAD_UNCHANGED)
    mask = cv2.imread(str(own / "mask0nocc.png"), cv2.IMREAD_UNCHANGED)
    known = np.isfinite(disparity)
    off = np.abs(read - disparity)[known].max()
    assert off < 1e-4, (
        f"a disparity is {off:.2g} pixels from the flow"
    )  # float32 depth: 6e-8 of 70 px · 0.35 / 5, and flow's own
    assert ((mask > 0) == np.isfinite(read)).all()
    wrong = ((mask == 255) & hidden & known) | ((mask == 128) & ~hidden & known & (np.arange(64) - read >= 0))
    # Beside an outline the other picture's nearest pixel, up to half a pixel away, may show the other side of it.
    other = cv2.imread(str(own / "disp1.pfm"), cv2.IMREAD_UNCHANGED)
    levels = np.where(np.isfinite(other), other, -9)
    outlines = cv2.dilate(levels, np.ones((3, 3))) - cv2.erode(levels, np.ones((3, 3))) > 0.5
    there = np.clip(np.rint(np.arange(64) - np.where(known, disparity, 0)), 0, 63).astype(int)
    near = outlines[np.arange(48)[:, None], there]
    assert not (wrong & ~near).any() and wrong.sum() < hidden.sum(), f"{wrong.sum()} pixels differ from {hidden.sum()} hidden"
    assert ((mask == 255) & ~hidden).sum() > 1000 and ((mask == 128) & hidden).sum() > 10


def test_the_right_pictures_disparities_lead_back(folder):
    own = folder / "middlebury" / "Left 1"
    d0, d1 = (cv2.imread(str(own / f"disp{i}.pfm"), cv2.IMREAD_UNCHANGED) for i in (0, 1))
    both = cv2.imread(str(own / "mask1nocc.png"), cv2.IMREAD_UNCHANGED) == 255
    rows, columns = np.nonzero(both)
    back = d0[rows, np.rint(columns + d1[both]).astype(int)]
    assert len(rows) > 1000 and np.abs(back - d1[both]).max() <= 1


def test_kittis_disparities_and_matrices_are_those_of_the_pair(folder, flow):
    occluded, visible = (
        cv2.imread(str(folder / "kitti" / name / "Left 1.png"), cv2.IMREAD_UNCHANGED) for name in ("disp_occ_0", "disp_noc_0")
    )
    disparity = cv2.imread(str(folder / "middlebury" / "Left 1" / "disp0.pfm"), cv2.IMREAD_UNCHANGED)
    known = np.isfinite(disparity) & (disparity > 1 / 256)
    assert np.abs(occluded[known] / 256 - disparity[known]).max() <= 0.5 / 256 and not occluded[~np.isfinite(disparity)].any()
    assert 0 < np.count_nonzero(visible) < np.count_nonzero(occluded)
    matrices = {
        line.split(":")[0]: np.array([float(word) for word in line.split()[1:]])
        for line in (folder / "kitti" / "calib_cam_to_cam" / "Left 1.txt").read_text().splitlines()
    }
    k, turn, place = cv2.decomposeProjectionMatrix(matrices["P_rect_03"].reshape(3, 4))[:3]
    np.testing.assert_allclose(turn, np.eye(3), atol=1e-12)
    np.testing.assert_allclose((place[:3] / place[3])[:, 0], (BASELINE, 0, 0), atol=1e-12)
    np.testing.assert_allclose(k, [[70, 0, 32.5], [0, 75, 22.5], [0, 0, 1]], rtol=1e-12)
    for name in ("image_2", "image_3"):
        assert (folder / "kitti" / name / "Left 1.png").read_bytes()


@pytest.mark.parametrize("form", ["middlebury", "kitti"])
def test_the_cameras_that_are_read_back_are_those_of_the_pair(folder, form):
    path = folder / "middlebury/Left 1/calib.txt" if form == "middlebury" else folder / "kitti/calib_cam_to_cam/Left 1.txt"
    left, right = (camera.pinhole for camera in cameras.read(path))
    scale = 1000 if form == "middlebury" else 1
    assert [left.plane, right.plane] == [LEFT.plane, RIGHT.plane]
    np.testing.assert_allclose(np.subtract(right.eye, left.eye), (BASELINE * scale, 0, 0), atol=1e-12 * scale)


@pytest.mark.parametrize(
    ("right", "words", "sentence"),
    [
        (moved(RIGHT, up=0.01), (), "rows apart: turn both cameras alike"),
        (replace(RIGHT, look_at=(0.5, 0, 0.8)), (), "rows apart"),
        (moved(LEFT, -BASELINE), (), "have the left camera on the right"),
        (replace(RIGHT, distance=(71, 75)), (), "different distances or sizes"),
        (replace(RIGHT, mirrored=True), (), "is mirrored"),
        (RIGHT, ("--pair", "L", "R"), "has no partner with 'R' in its name"),
        (RIGHT, ("--pair", "port", "starboard"), "has 'port' in its name: name the two of a pair by --pair LEFT RIGHT"),
    ],
)
def test_what_is_no_pair_is_one_sentence_and_leaves_no_folder(tmp_path, capfd, right, words, sentence):
    picture(tmp_path / "shots" / "Left.exr", LEFT)
    picture(tmp_path / "shots" / "Right.exr", right)
    assert main(["labels", str(tmp_path / "shots"), str(tmp_path / "out"), "--to", "middlebury", *words]) == 2
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert sentence in line
    assert [each.name for each in tmp_path.iterdir()] == ["shots"]


def test_a_pair_without_depth_and_a_pair_for_coco_are_refused(tmp_path, capfd):
    for name in ("left", "right"):
        files.write(tmp_path / f"{name}.exr", vp.label(room(LEFT), ("masks",)))
    assert main(["labels", str(tmp_path), str(tmp_path / "out"), "--to", "middlebury"]) == 2
    assert "left.labels.json has no depth: render it with --labels depth" in capfd.readouterr().err
    assert main(["labels", str(tmp_path), str(tmp_path / "out.json"), "--pair", "a", "b"]) == 2
    assert "--pair is for stereo" in capfd.readouterr().err


def test_a_folder_of_pairs_may_be_replaced_and_another_may_not(folder, tmp_path, capfd):
    words = ["labels", str(folder / "shots"), str(tmp_path / "out"), "--to", "middlebury", "--overwrite"]
    assert main(words) == 0 and main(words) == 0
    (tmp_path / "out" / "mine").mkdir()
    assert main(words) == 2 and "is there already" in capfd.readouterr().err


def test_a_pair_that_is_off_by_a_pixel_is_told_from_one_that_is_not():
    disparity = np.full((3, 9), 2.0)
    assert stereo._agree(disparity, disparity, -1)[:, 2:].all() and not stereo._agree(disparity, disparity, -1)[:, :2].any()
    assert not stereo._agree(disparity, disparity + 1.01, -1).any()
