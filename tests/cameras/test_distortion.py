"""Lenses, both ways, as OpenCV and COLMAP have them, and every reader's as its own program counts its coefficients.

A lens put on a pinhole's picture: which picture covers it, and that OpenCV finds each pixel where it is put.
"""

import dataclasses
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import Options, axes, distortion
from viewcam_addon.cameras.calibration import Calibration, of_cameras
from viewcam_addon.cameras.undistortion import places_back, resampled, undistorted
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

from . import test_of_strangers as mixed
from . import test_read_only_formats as files


def opencv():
    """OpenCV's module; without it the test is skipped, and no other."""
    return pytest.importorskip("cv2")


RANDOM = np.random.default_rng(31)
POINTS = RANDOM.uniform(-0.5, 0.5, (1000, 2))  # a field of view of 53°, twice the corners of most lenses
OPENCV = [0.1, -0.05, 0.01, -0.02, 0.03, 0.05, 0.01, 0.02, 0.01, -0.02, 0.03, 0.01, 0.1, -0.2]
ROUNDING = 64 * 2.0**-53  # a polynomial's, of twenty terms, each below 1
THEIR_INVERSE = 1e-9  # calibrated: where pycolmap's and OpenCV's own iterations end

# Extra coefficients of each model of COLMAP, and how wide a view it is asked about, in half widths of POINTS.
COLMAP = {
    "SIMPLE_RADIAL": ([-0.2], 1),
    "RADIAL": ([-0.2, 0.05], 1),
    "OPENCV": ([-0.2, 0.05, 0.003, -0.002], 1),
    "FULL_OPENCV": ([0.1, -0.05, 0.01, -0.02, 0.03, 0.05, 0.01, 0.02], 1),
    "OPENCV_FISHEYE": ([0.05, -0.02, 0.005, -0.001], 3),
    "FOV": ([0.9], 3),
    "SIMPLE_RADIAL_FISHEYE": ([0.05], 3),
    "RADIAL_FISHEYE": ([0.05, -0.01], 3),
    "THIN_PRISM_FISHEYE": ([0.1, -0.05, 0.01, -0.02, 0.03, 0.01, 0.02, -0.01], 2),
    "RAD_TAN_THIN_PRISM_FISHEYE": ([0.1, -0.05, 0.02, 0.01, -0.005, 0.002, 0.01, -0.02, 0.01, 0.02, -0.01, 0.03], 2),
    "SIMPLE_DIVISION": ([-0.2], 3),
    "DIVISION": ([0.2], 1),
    "SIMPLE_FISHEYE": ([], 3),
    "FISHEYE": ([], 3),
    "EUCM": ([0.5, 1.2], 3),
}


def of_colmap(model, folder):
    extra, wide = COLMAP[model]
    names = cameras.FORMATS["colmap"].MODELS[model][1]
    straight = {"f": 600.0, "fx": 600.0, "fy": 610.0, "cx": 310.0, "cy": 190.0}
    numbers = [straight[name] for name in names if name in straight] + extra
    (folder / "cameras.txt").write_text(f"1 {model} 640 360 {' '.join(map(repr, numbers))}\n")
    (folder / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n")
    (camera,) = cameras.read(folder)
    return camera, numbers, POINTS * wide


@pytest.mark.parametrize("model", COLMAP)
def test_a_lens_of_colmap_moves_points_there_and_back_as_pycolmap_does(tmp_path, model):
    pycolmap = pytest.importorskip("pycolmap")
    camera, numbers, points = of_colmap(model, tmp_path)
    pycolmap_camera = pycolmap.Camera(model=model, width=640, height=360, params=numbers)
    (d_x, d_y), (c_x, c_yb) = camera.pinhole.distance, camera.pinhole.principal_point
    moved = pycolmap_camera.img_from_cam(np.c_[points, np.ones(len(points))])
    ours = camera.lens.distort(points) * [d_x, d_y] + [c_x, 360 - c_yb]
    assert np.abs(ours - moved).max() < 1000 * ROUNDING, "pixels"
    back = camera.lens.undistort((moved - [c_x, 360 - c_yb]) / [d_x, d_y])
    assert np.abs(back - points).max() < 1e-11, "at distance 1"
    assert np.abs(pycolmap_camera.cam_from_img(moved) - back).max() < THEIR_INVERSE
    assert not camera.lens.folds(points).any()


def test_opencvs_fourteen_coefficients_move_points_as_opencv_does():
    cv2 = opencv()
    document = {"K": np.eye(3).tolist(), "size": [4, 4], "dist": OPENCV}
    document["K"] = [[100, 0, 2], [0, 100, 2], [0, 0, 1]]
    (camera,) = cameras.read(json.dumps(document))
    moved, _ = cv2.projectPoints(np.c_[POINTS, np.ones(len(POINTS))], np.zeros(3), np.zeros(3), np.eye(3), np.array(OPENCV))
    assert np.abs(camera.lens.distort(POINTS) - moved[:, 0]).max() < ROUNDING
    assert np.abs(camera.lens.undistort(moved[:, 0]) - POINTS).max() < 1e-11


@pytest.mark.parametrize("model", ["equidistant", "fisheye", "kannala_brandt4"])
def test_a_fisheye_of_kalibr_and_opencv_is_opencvs(model):
    cv2 = opencv()
    k = [0.05, -0.02, 0.005, -0.001]
    (camera,) = cameras.read(json.dumps({**files.K, "distortion_model": model, "distortion_coeffs": k}))
    points = 3 * POINTS
    moved, _ = cv2.fisheye.projectPoints(
        np.c_[points, np.ones(len(points))][:, None], np.zeros(3), np.zeros(3), np.eye(3), np.array(k)
    )
    assert np.abs(camera.lens.distort(points) - moved[:, 0]).max() < ROUNDING
    assert np.abs(camera.lens.undistort(moved[:, 0]) - points).max() < 1e-11


BROWN = {"k1": -0.2, "k2": 0.05, "k3": -0.01, "p1": 0.003, "p2": -0.002}


def metashape():
    """By Agisoft's manual x′ = x (1 + K1 r² + …) + P1 (r² + 2x²) + 2 P2 x y: its P1 is OpenCV's p2."""
    tags = "".join(
        f"<{name}>{BROWN[brown]}</{name}>" for name, brown in zip(("k1", "k2", "k3", "p1", "p2"), _SWAPPED, strict=True)
    )
    return files.metashape(files.Known("plain"), tags)


_SWAPPED = ("k1", "k2", "k3", "p2", "p1")


def meshroom():
    document = json.loads(mixed.meshroom())
    document["intrinsics"][0] |= {"distortionType": "brown", "distortionParams": [*map(str, BROWN.values())]}
    return json.dumps(document)


def openmvg():
    document = json.loads(mixed.openmvg())
    data = document["intrinsics"][0]["value"]["ptr_wrapper"]["data"]
    data["disto_t2"] = [*BROWN.values()]
    return json.dumps(document)


def nerfstudio():
    document = json.loads(mixed.transforms())
    document["frames"] = [document["frames"][0] | BROWN | {"camera_model": "OPENCV"}]
    return json.dumps(document)


def realitycapture():
    """Its tangential terms are swapped against OpenCV's (camorph 1.0)."""
    numbers = " ".join(str(BROWN[name]) for name in ("k1", "k2", "k3")) + f" 0 {BROWN['p2']} {BROWN['p1']}"
    return (
        '<x xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:FocalLength35mm="30" xcr:DistortionModel="brown3t2">'
        "<xcr:Rotation>1 0 0 0 1 0 0 0 1</xcr:Rotation><xcr:Position>1 2 3</xcr:Position>"
        f"<xcr:DistortionCoeficients>{numbers}</xcr:DistortionCoeficients></x>"
    )


@pytest.mark.parametrize("make", [metashape, meshroom, openmvg, nerfstudio, realitycapture])
def test_brown_and_conradys_lens_is_opencvs_by_every_programs_names(make):
    cv2 = opencv()
    camera = cameras.read(make(), options=Options(size=(640, 360)))[0]
    numbers = np.array([BROWN[name] for name in ("k1", "k2", "p1", "p2", "k3")])
    moved, _ = cv2.projectPoints(np.c_[POINTS, np.ones(len(POINTS))], np.zeros(3), np.zeros(3), np.eye(3), numbers)
    assert np.abs(camera.lens.distort(POINTS) - moved[:, 0]).max() < ROUNDING
    assert any("pinhole of the undistorted picture" in note for note in camera.notes)


def test_bundlers_radial_terms_are_colmaps(tmp_path):
    pose = "1 0 0\n0 1 0\n0 0 1\n0 0 -4\n"
    (camera,) = cameras.read(f"# Bundle file v0.3\n1 0\n600 -0.2 0.05\n{pose}", options=Options(size=(640, 360)))
    assert camera.lens == of_colmap("RADIAL", tmp_path)[0].lens


@pytest.mark.parametrize("model", ["OPENCV_FISHEYE", "FISHEYE"])
def test_nerfstudios_fisheye_is_colmaps(tmp_path, model):
    document = json.loads(mixed.transforms())
    k = COLMAP["OPENCV_FISHEYE"][0]
    terms = dict(zip(("k1", "k2", "k3", "k4"), k, strict=True))
    key = "camera_model" if model == "OPENCV_FISHEYE" else "camera_type"
    document["frames"] = [document["frames"][0] | terms | {key: model}]
    (camera,) = cameras.read(json.dumps(document))
    assert camera.lens == of_colmap("OPENCV_FISHEYE", tmp_path)[0].lens


def test_a_picture_that_no_lens_shows_is_no_point():
    barrel = distortion.opencv({"k1": -0.3})  # r (1 − 0.3 r²) turns back at r = 1.054, where it is 0.703
    assert np.isnan(barrel.undistort([[0.71, 0.0]])).all() and not np.isnan(barrel.undistort([[0.70, 0.0]])).any()
    assert barrel.folds([[1.06, 0.0], [1.04, 0.0], [3.0, 0.0], [0.0, 0.0]]).tolist() == [True, False, True, False]
    fisheye = distortion.fisheye({})
    assert np.isnan(fisheye.undistort([[1.58, 0.0]])).all()  # more than a quarter turn from the axis


@pytest.mark.parametrize("form", ["colmap", "colmap_binary"])
@pytest.mark.parametrize("model", COLMAP)
def test_a_lens_that_is_written_for_colmap_is_the_same_to_pycolmap(tmp_path, model, form):
    pycolmap = pytest.importorskip("pycolmap")
    camera, numbers, points = of_colmap(model, tmp_path)
    cameras.save([camera], tmp_path / "out", form)
    (back,) = cameras.read(tmp_path / "out")
    assert back.lens == camera.lens and back.pinhole == camera.pinhole
    (tmp_path / "out" / "points3D.txt").touch()
    (pycolmap_camera,) = pycolmap.Reconstruction(tmp_path / "out").cameras.values()
    written = pycolmap.Camera(model=model, width=640, height=360, params=numbers)
    seen, expected = (each.img_from_cam(np.c_[points, np.ones(len(points))]) for each in (pycolmap_camera, written))
    assert np.abs(seen - expected).max() < 1000 * ROUNDING, pycolmap_camera.model


@pytest.mark.parametrize("model", ["SIMPLE_RADIAL", "OPENCV", "OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE"])
def test_a_lens_that_is_written_for_nerfstudio_comes_back(tmp_path, model):
    camera, *_ = of_colmap(model, tmp_path)
    text = cameras.write([camera], "transforms")
    (back,) = cameras.read(text)
    assert back.lens == camera.lens and back.pinhole == camera.pinhole
    assert json.loads(text)["camera_model"] == ("OPENCV_FISHEYE" if "FISHEYE" in model else "OPENCV")


def test_a_rigs_camera_model_is_where_nerfstudio_and_instant_ngp_look_for_it(tmp_path):
    """nerfstudio's is at the top, and a fisheye without is_fisheye is to instant-ngp a lens whose p1 is k3."""
    fisheye, *_ = of_colmap("OPENCV_FISHEYE", tmp_path)
    brown, *_ = of_colmap("OPENCV", tmp_path)
    shorter = dataclasses.replace(fisheye.pinhole, distance=500.0)
    rig = [fisheye, dataclasses.replace(fisheye, name="b", image="b.png", pinhole=shorter)]
    text = cameras.write(rig, "transforms")
    document = json.loads(text)
    assert document["camera_model"] == "OPENCV_FISHEYE" and all(frame["is_fisheye"] for frame in document["frames"])
    assert [(each.lens, each.pinhole) for each in cameras.read(text)] == [(each.lens, each.pinhole) for each in rig]
    other = dataclasses.replace(brown, name="c", image="c.png")
    with pytest.raises(InputError, match="one camera_model for all pictures, and 'b' has a fisheye's where 'c' has none"):
        cameras.write([*rig, other], "transforms")
    straight = dataclasses.replace(other, name="d", image="d.png", lens=None)
    assert json.loads(cameras.write([other, straight], "transforms"))["camera_model"] == "OPENCV"


@pytest.mark.parametrize("form", ["transforms", "colmap"])
def test_a_lens_that_a_format_has_no_model_of_is_refused(tmp_path, form):
    camera, *_ = of_colmap("EUCM", tmp_path)
    skewed = distortion.opencv({"k1": 0.1}, skew=0.01)
    lens = skewed if form == "colmap" else camera.lens
    with pytest.raises(InputError, match="no model of"):
        cameras.write([dataclasses.replace(camera, lens=lens)], form)


@pytest.mark.parametrize("form", [form for form in cameras.writable() if not hasattr(cameras.FORMATS[form], "LENSES")])
def test_no_format_that_has_no_lens_drops_one(tmp_path, form):
    camera, *_ = of_colmap("OPENCV", tmp_path)
    with pytest.raises(InputError, match="lens distortion"):
        cameras.write([camera], form)


def test_an_unknown_lens_is_refused_or_left_out_and_said_so():
    document = json.loads(meshroom())
    document["intrinsics"][0]["distortionType"] = "3deanamorphic4"
    with pytest.raises(InputError, match="3deanamorphic4"):
        cameras.read(json.dumps(document))
    camera = cameras.read(json.dumps(document), options=Options(without_distortion=True))[0]
    assert camera.lens is None and any("3deanamorphic4" in note for note in camera.notes)


PLANE = axes.view_plane(150, 151, 83, 44, (160, 90))
K = np.array([[150.0, 0, 83], [0, 151, 44], [0, 0, 1]])
BROWN_LENS = {"k1": -0.2, "k2": 0.06, "p1": 0.004, "p2": -0.003}
FISHEYE = {"k1": 0.03, "k2": -0.01, "k3": 0.002, "k4": 0.0}
LENSES = {
    "OPENCV": (
        distortion.opencv(BROWN_LENS),
        lambda points: opencv().undistortPoints(points, K, np.array([*BROWN_LENS.values()])),
    ),
    "OPENCV_FISHEYE": (
        distortion.fisheye(FISHEYE),
        lambda points: opencv().fisheye.undistortPoints(points, K, np.array([*FISHEYE.values()])),
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
        cv2 = opencv()
        criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12)
        distorted = np.array([*BROWN_LENS.values()])
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
    swapped = distortion.opencv(BROWN_LENS | {"p1": BROWN_LENS["p2"], "p2": BROWN_LENS["p1"]})
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
