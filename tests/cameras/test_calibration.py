"""A lens put on a pinhole's picture: which picture covers it, and that OpenCV finds each pixel where it is put."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import axes, distortion
from viewcam_addon.cameras.calibration import Calibration, of_cameras
from viewcam_addon.cameras.undistortion import places_back, resampled, undistorted
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

cv2 = pytest.importorskip("cv2")

PLANE = axes.view_plane(150, 151, 83, 44, (160, 90))
K = np.array([[150.0, 0, 83], [0, 151, 44], [0, 0, 1]])
BROWN = {"k1": -0.2, "k2": 0.06, "p1": 0.004, "p2": -0.003}
FISHEYE = {"k1": 0.03, "k2": -0.01, "k3": 0.002, "k4": 0.0}
LENSES = {
    "OPENCV": (distortion.opencv(BROWN), lambda points: cv2.undistortPoints(points, K, np.array([*BROWN.values()]))),
    "OPENCV_FISHEYE": (
        distortion.fisheye(FISHEYE),
        lambda points: cv2.fisheye.undistortPoints(points, K, np.array([*FISHEYE.values()])),
    ),
}
CLOSE = 1e-3
"""Pixels, as `--distort` promises. OpenCV ends its iterations at 1e-8 of the focal length and earlier."""


def own_places(plane):
    """A picture whose pixels hold their own place, x and y from the corner; linear, so that nothing is lost between them."""
    return np.stack(np.meshgrid(np.arange(plane.width) + 0.5, np.arange(plane.height) + 0.5), axis=-1)


def seen_by_opencv(undistort):
    """The pinhole's points of all pixels' centers: (height, width, 2)."""
    centers = own_places(PLANE)
    if undistort is LENSES["OPENCV"][1]:
        criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12)
        distorted = np.array([*BROWN.values()])
        return cv2.undistortPointsIter(centers.reshape(-1, 1, 2), K, distorted, None, None, criteria).reshape(centers.shape)
    return undistort(centers.reshape(-1, 1, 2)).reshape(centers.shape)


def farthest(lens, undistort):
    """The largest distance in pixels of what a pixel shows from what OpenCV says that it shows."""
    calibration = Calibration(PLANE, lens)
    cut = calibration.cover
    picture = calibration.distorted(own_places(cut), cut)
    center = (cut.principal_point[0], cut.height - cut.principal_point[1])
    expected = seen_by_opencv(undistort) * cut.distance + center
    return np.abs(picture - expected).max()


@pytest.mark.parametrize("model", LENSES)
def test_each_pixel_shows_what_opencv_says(model):
    assert (worst := farthest(*LENSES[model])) < CLOSE, f"{worst:.2g} pixels aside"


def test_swapped_tangential_terms_are_found():
    swapped = distortion.opencv(BROWN | {"p1": BROWN["p2"], "p2": BROWN["p1"]})
    assert farthest(swapped, LENSES["OPENCV"][1]) > 100 * CLOSE


@settings(max_examples=10, deadline=None)
@given(st.floats(-0.2, 0.3), st.floats(-0.004, 0.004), st.floats(60, 100), st.floats(-10, 90))
def test_the_pinhole_covers_every_pixel_and_is_nowhere_coarser(k1, p1, c_x, c_y):
    plane = axes.view_plane(150, 140, c_x, c_y, (160, 90))
    calibration = Calibration(plane, distortion.opencv({"k1": k1, "p1": p1}))
    at, cut = places_back(calibration.lens, plane, calibration.cover), calibration.cover
    assert at.min() >= 0.5 and (at <= np.array([cut.width, cut.height]) - 0.5).all()
    steps = [np.linalg.norm(np.diff(at, axis=axis), axis=-1).min() for axis in (0, 1)]
    assert min(steps) > 1 - 1e-3, "a lattice of corners stands for the pixels' centers"


def test_what_no_lens_moves_is_the_same_pixel():
    plane = axes.view_plane(150, 150, 83, 44, (160, 90))
    calibration = Calibration(plane, distortion.opencv({"k1": 1e-13}))
    cut = calibration.cover
    picture = np.random.default_rng(3).integers(0, 65536, (cut.height, cut.width, 4), np.uint16)
    left, top = round(cut.principal_point[0] - 83), round(cut.height - cut.principal_point[1] - 44)
    assert np.array_equal(calibration.distorted(picture, cut), picture[top : top + 90, left : left + 160])


@pytest.mark.parametrize("model", LENSES)
def test_undistorted_again_all_is_where_it_was(model):
    lens = LENSES[model][0]
    cut = Calibration(PLANE, lens).cover
    bent = Calibration(PLANE, lens).distorted(own_places(cut), cut)
    straight = undistorted(lens, PLANE)
    again = resampled(bent, lens, PLANE, straight)
    x = (again[..., 0] - cut.principal_point[0]) / cut.distance[0]
    expected = (own_places(straight)[..., 0] - straight.principal_point[0]) / straight.distance[0]
    off = np.abs(x - expected)[again.any(axis=-1)] * PLANE.distance[0]
    assert off.max() < 0.1 and (again.any(axis=-1)).mean() > 0.99, f"{off.max():.2g} pixels aside"


def test_of_data_nothing_is_between():
    cut = Calibration(PLANE, LENSES["OPENCV"][0]).cover
    mask = np.random.default_rng(4).choice([0, 200], (cut.height, cut.width, 1)).astype(np.float32)
    assert {*np.unique(Calibration(PLANE, LENSES["OPENCV"][0]).distorted(mask, cut, nearest=True))} == {0, 200}


@pytest.mark.parametrize("model", LENSES)
def test_a_calibration_comes_back_from_json_and_a_camera_from_its_sidecar(tmp_path, model):
    calibration = Calibration(PLANE, LENSES[model][0])
    assert Calibration.from_json(json.loads(json.dumps(calibration.to_json()))) == calibration
    pinhole = calibration.at(Pinhole((1, 2, 3), (0, 0, 0), (0, 0, 1), 100, 10, 10))
    camera = cameras.Camera("shot", pinhole, image="shot.png", lens=calibration.lens)
    cameras.save([camera], tmp_path / "sidecars", "sidecar")
    assert [(each.pinhole, each.lens) for each in cameras.read(tmp_path / "sidecars")] == [(pinhole, calibration.lens)]


@pytest.mark.parametrize(
    "spoil",
    [
        {"radial": ["a"]},
        {"tangential": [1]},
        {"projection": "panorama"},
        {"projection": "fov"},
        {"projection": "measured", "parameters": [0]},
        {"radial": [float("nan")]},
        {"terms": 3},
        {"more": 1},
    ],
    ids=str,
)
def test_a_strangers_lens_is_a_sentence(spoil):
    with pytest.raises(InputError):
        distortion.Lens.from_json(LENSES["OPENCV"][0].to_json() | spoil)


def camera(name, lens, plane=PLANE):
    pinhole = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), plane.distance, plane.width, plane.height, plane.principal_point)
    return cameras.Camera(name, pinhole, lens=lens)


FOLDED, BEHIND = distortion.opencv({"k1": -1.5}), distortion.fisheye({})
WIDE = axes.view_plane(50, 50, 83, 44, (160, 90))


@pytest.mark.parametrize(
    ("read", "name", "sentence"),
    [
        ([camera("a", None)], None, "no camera of FILE has a lens that distorts"),
        ([camera("a", None)], "a", "the camera a of FILE has no lens"),
        (
            [camera("a", LENSES["OPENCV"][0]), camera("b", BEHIND)],
            None,
            "have 2 lenses or sizes, and none is called .* name one, as in a or b",
        ),
        ([camera("a", LENSES["OPENCV"][0])], "c", "there is no camera 'c'"),
        ([camera("a", FOLDED)], None, "a of FILE can't be rendered: from (.*) the model folds there"),
        ([camera("a", BEHIND, WIDE)], None, "or looks 90° and more aside"),
        (
            [camera("a", BEHIND, replace(PLANE, distance=(62.66, 62.66), width=175, principal_point=(87.5, 45)))],
            None,
            "sees so far aside that a pinhole's picture of it has",
        ),
    ],
)
def test_what_no_pinhole_covers_is_a_sentence(read, name, sentence):
    with pytest.raises(InputError, match=sentence.replace("(.*)", ".*")):
        of_cameras(read, "FILE", name).of("x")


def test_cameras_of_one_lens_need_no_name_and_those_of_several_are_told_by_theirs():
    bent, other = camera("a", LENSES["OPENCV"][0]), camera("d", LENSES["OPENCV_FISHEYE"][0])
    alike = [bent, replace(bent, name="b"), camera("c", None)]
    assert of_cameras(alike, "FILE").of("x", None) == Calibration(PLANE, bent.lens)
    rig = of_cameras([*alike, other], "FILE")
    assert [rig.of(None, name).lens for name in ("d", "b")] == [other.lens, bent.lens]
    with pytest.raises(InputError, match="2 lenses or sizes, and none is called 'c' or 'frame_1': name one, as in a or d"):
        rig.of("c", "frame_1")
