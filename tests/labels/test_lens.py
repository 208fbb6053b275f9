"""Labels of a picture that a lens bends: each is what OpenCV's ray through the pixel's center meets."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon import image
from viewcam_addon.cameras import distortion
from viewcam_addon.errors import InputError
from viewcam_addon.labels import bop, files
from viewcam_addon.labels.scene_labels import label
from viewcam_addon.labels.surfaces import Surfaces
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Mesh, Object, Scene

from .conftest import CAMERA, room

OpenEXR = pytest.importorskip("OpenEXR")
cv2 = pytest.importorskip("cv2")

WIDTH, HEIGHT = 64, 48
K = np.array([[70.0, 0, 30], [0, 75, 23], [0, 0, 1]])
COEFFICIENTS = np.array([-0.25, 0.08, 0.006, -0.004])
BROWN = distortion.opencv(dict(zip(("k1", "k2", "p1", "p2"), COEFFICIENTS, strict=True)))
CLOSE = 1e-3
"""Pixels, as `--distort` promises. A label's float32 is 5 units · 2⁻²⁴, which is 4e-6 pixels here."""


def of_opencv(camera):
    """Rotation vector and translation from world space to OpenCV's camera."""
    turn = camera.picture_axes() * [[1], [-1], [1]]
    return cv2.Rodrigues(turn)[0], -turn @ np.array(camera.eye)


def projected(camera, points):
    return cv2.projectPoints(np.ascontiguousarray(points, float), *of_opencv(camera), K, COEFFICIENTS)[0].reshape(-1, 2)


def centers():
    """(height, width, 2), rows from the bottom, y down."""
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, HEIGHT - 0.5 - np.arange(HEIGHT))
    return np.stack([x, y], axis=-1)


def farthest(labels, camera=CAMERA):
    """The largest distance in pixels of a label's point, projected by OpenCV, from its pixel's center."""
    hit = labels.image["Instance"][..., 0] > 0
    assert hit.mean() > 0.5
    return np.hypot(*(projected(camera, labels.image["Position"][hit]) - centers()[hit]).T).max()


def test_each_label_is_of_the_ray_through_the_center_that_opencv_has():
    labels = label(room(), lens=BROWN)
    assert (worst := farthest(labels)) < CLOSE, f"{worst:.2g} pixels aside"
    hit = labels.image["Instance"][..., 0] > 0
    camera_points = (labels.image["Position"][hit] - np.array(CAMERA.eye)) @ CAMERA.picture_axes().T
    np.testing.assert_allclose(labels.image["Depth"][hit][:, 0], camera_points[:, 2], rtol=1e-6)
    np.testing.assert_allclose(labels.image["Distance"][hit][:, 0], np.linalg.norm(camera_points, axis=1), rtol=1e-6)


def test_swapped_tangential_terms_are_found():
    k1, k2, p1, p2 = COEFFICIENTS
    labels = label(room(), lens=distortion.opencv({"k1": k1, "k2": k2, "p1": p2, "p2": p1}))
    assert farthest(labels) > 100 * CLOSE
    assert farthest(label(room())) > 100 * CLOSE, "no lens at all"


def board():
    """Squares of 1 in the plane z = 0, from −6 to 6, two triangles each, of two materials in turn."""
    corners = [(x, y, 0) for y in range(-6, 7) for x in range(-6, 7)]
    first = [(j * 13 + i, (i + j) % 2) for j in range(12) for i in range(12)]
    triangles = [each for k, _ in first for each in ((k, k + 1, k + 14), (k, k + 14, k + 13))]
    materials = np.repeat([color for _, color in first], 2).astype(np.int32)
    return Mesh(np.array(corners, float), np.array(triangles, np.int32), materials)


def test_a_checkers_label_changes_where_opencv_puts_its_edges():
    camera = replace(CAMERA, eye=(0.3, -2, 5), look_at=(0.1, 0.2, 0))
    labels = label(Scene(camera, {"board": board()}, (Object("Board", "board", np.eye(4), 1, (3, 4)),)), ["masks"], lens=BROWN)
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    x, y = cv2.undistortPointsIter(centers().reshape(-1, 1, 2), K, COEFFICIENTS, None, None, criteria).reshape(-1, 2).T
    directions = np.stack([x, -y, np.ones_like(x)], axis=-1) @ camera.picture_axes()
    at = (np.array(camera.eye) - directions * (camera.eye[2] / directions[:, 2:]))[:, :2]
    on_board, away = (np.abs(at) < 6).all(axis=1), np.abs(at - np.rint(at)).min(axis=1)
    clear = away > CLOSE * 5 / 70  # a pixel is at least 5 / 75 wide there
    assert on_board.mean() > 0.9 and clear.mean() > 0.95
    expected = np.where(on_board, 3 + np.floor(at).astype(int).sum(axis=1) % 2, 0)
    np.testing.assert_array_equal(labels.image["Material Index"].ravel()[clear], expected[clear])


def test_hits_at_the_centers_are_the_hits_of_the_pixels():
    tracer = Tracer(room())
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    names = ("Normal", "Material Index")
    for there, here in zip(tracer.hits_at(x, y, names)[:3], tracer.hits(names)[:3], strict=True):
        np.testing.assert_allclose(there, here, rtol=1e-13)
    for name in names:
        np.testing.assert_array_equal(tracer.hits_at(x, y, names)[3][name], tracer.hits(names)[3][name])


def test_an_amodal_mask_is_the_object_alone():
    scene = room()
    labels = label(scene, ["masks", "amodal"], lens=BROWN)
    for each in labels.instances:
        (placed,) = (placed for placed in scene.objects if placed.name == each["name"])
        alone = replace(scene, objects=(Object(placed.name, placed.geometry, placed.matrices[each["number"]]),))
        (only,) = label(alone, ["masks"], lens=BROWN).instances
        assert each["amodal"] == only["visible"], each["name"]
    assert min(each["visible_fraction"] for each in labels.instances) < 0.5, "one is behind the ball"


def test_flow_goes_to_where_opencv_sees_the_point_there():
    there = replace(CAMERA, eye=(1.4, -6.8, 3.1))
    labels = label(room(), ["position", "flow"], next=room(there), lens=BROWN)
    flow, hidden = labels.image["Forward Flow"], labels.image["Forward Hidden"][..., 0] > 0
    known = np.isfinite(flow).all(axis=-1)
    expected = projected(there, labels.image["Position"][known]) - centers()[known]
    np.testing.assert_allclose(flow[known], expected, atol=CLOSE)
    assert known.mean() > 0.5 and 0 < hidden[known].mean() < 0.5


def test_coverage_of_a_bent_picture_agrees_with_its_masks():
    labels = label(room(), ["masks", "coverage"], lens=BROWN)
    for each in labels.instances:
        whole = each["visible"]["area"] if each["visible"] else 0
        assert abs(each["coverage"]["area"] - whole) < 0.1 * max(whole, 100)


def test_a_lens_that_folds_within_the_picture_is_a_sentence():
    with pytest.raises(InputError, match="its model folds there"):
        label(room(), lens=distortion.opencv({"k1": -2.0}))


def test_label_files_say_the_lens_and_bop_which_has_none_refuses_it(tmp_path):
    labels = label(room(), ["depth", "masks", "amodal"], lens=BROWN)
    files.write(tmp_path / "shot.exr", labels)
    document = files.read(tmp_path / "shot.labels.json")
    assert files.lens(document) == BROWN and Pinhole(**document["camera"]) == CAMERA
    header = OpenEXR.File(str(tmp_path / "shot.labels.exr"), header_only=True).parts[0].header
    assert image.read(tmp_path / "shot.labels.exr").size == (WIDTH, HEIGHT)
    assert "worldToCamera" in header and not {"worldToNDC", "virtualPinhole"} & {*header}, "it is no pinhole's picture"
    with pytest.raises(InputError, match="lens distortion"):
        bop.write(tmp_path, tmp_path / "bop")


def test_a_pinhole_projects_as_before():
    surfaces = Surfaces(room())
    points = np.array([[0.0, 0, 0], [1, 2, 0.5]])
    np.testing.assert_array_equal(surfaces.project(points), CAMERA.project(points))
