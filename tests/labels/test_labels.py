"""Labels of one frame: on paper, against the tracer's own passes, and among one another."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import viewcam_addon as vp
from viewcam_addon.image import BACKGROUND_DEPTH
from viewcam_addon.labels import masks
from viewcam_addon.labels.surfaces import Silhouettes, Surfaces, instances
from viewcam_addon.tracer.scene import Object, Scene, Spheres

from .conftest import CAMERA, CUBE, moved, room

FLOAT32 = 2.0**-23
"""A value that was rounded to float32, and one more rounding on the way."""

cameras = st.builds(
    lambda x, y, z, turn, mirrored: replace(
        CAMERA, eye=(4 * np.sin(turn) + x, -6 * np.cos(turn) + y, 2.5 + z), mirrored=mirrored
    ),
    *[st.floats(-1, 1)] * 3,
    st.floats(-3, 3),
    st.booleans(),
)


def mask_of(segmentation):
    """COCO's run lengths by hand: rows from the top."""
    height, width = segmentation["size"]
    values = np.repeat(np.arange(len(segmentation["counts"])) % 2, segmentation["counts"])
    return values.reshape(width, height).T.astype(bool)


def test_a_ball_before_a_wall_is_what_it_is_on_paper():
    """The eye at the origin looks along −z at a ball of radius 1 whose centre is 4 away, and at a wall 8 away."""
    camera = vp.Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 40, 33, 25)
    ball = Spheres(np.array([[0.0, 0, -4]]), np.array([1.0]), np.zeros(1, np.int32))
    wall = replace(CUBE, vertices=CUBE.vertices * [50, 50, 1])
    behind = moved(z=-9)  # its front is at z = −8
    scene = Scene(camera, {"ball": ball, "wall": wall}, (Object("Ball", "ball", np.eye(4)), Object("Wall", "wall", behind)))
    found = vp.label(scene)
    y, x = np.mgrid[0:25, 0:33]
    x, y = (x + 0.5 - 16.5) / 40, (y + 0.5 - 12.5) / 40
    square = x * x + y * y + 1
    # |t (x, y, −1) − (0, 0, −4)| = 1, the nearer of the two.
    under = 16 - 15 * square
    assert np.abs(under).min() > 1e-3, "no centre is on the outline, where rounding would decide"
    depth = np.where(under > 0, (4 - np.sqrt(np.maximum(under, 0))) / square, 8.0)
    passes = {name: values.astype(float) for name, values in found.image.passes.items()}
    np.testing.assert_allclose(passes["Depth"][..., 0], depth, rtol=FLOAT32)
    np.testing.assert_allclose(passes["Distance"][..., 0], depth * np.sqrt(square), rtol=FLOAT32)
    points = depth[..., None] * np.stack([x, y, -np.ones_like(x)], -1)
    np.testing.assert_allclose(passes["Position"], points, atol=8 * FLOAT32)
    on_wall = np.array([0, 0, 1.0])
    normals = np.where(under[..., None] > 0, points - [0, 0, -4], on_wall)
    np.testing.assert_allclose(passes["Normal"], normals, atol=1e-6)  # the tracer's float32
    np.testing.assert_allclose(passes["Camera Normal"], normals * [1, -1, -1], atol=1e-6)
    local = np.where(under[..., None] > 0, points, points - behind[:3, 3])
    np.testing.assert_allclose(passes["Object Position"], local, atol=8 * FLOAT32)
    ids = {each["name"]: each["id"] for each in found.instances}
    np.testing.assert_array_equal(passes["Instance"][..., 0], np.where(under > 0, ids["Ball"], ids["Wall"]))
    of_ball = next(each for each in found.instances if each["name"] == "Ball")
    np.testing.assert_array_equal(mask_of(of_ball["visible"]["segmentation"]), (under > 0)[::-1])
    wall_told = next(each for each in found.instances if each["name"] == "Wall")
    assert wall_told["amodal"]["area"] == 33 * 25 and wall_told["visible"]["area"] == (under <= 0).sum()
    assert of_ball["box"] == {"min": [-1, -1, -5], "max": [1, 1, -3]}
    assert of_ball["visible_fraction"] == 1 and wall_told["visible_fraction"] == (under <= 0).mean()


def test_nothing_is_told_of_pixels_that_show_nothing():
    ball = Spheres(np.array([[0.0, 0, 0]]), np.array([0.5]), np.zeros(1, np.int32))
    found = vp.label(Scene(CAMERA, {"ball": ball}, (Object("Ball", "ball", np.eye(4)),)))
    empty = found.image["Instance"][..., 0] == 0
    assert 0 < empty.sum() < empty.size
    for name, values in found.image.passes.items():
        assert (values[empty] == (BACKGROUND_DEPTH if name in ("Depth", "Distance") else 0)).all(), name


@settings(max_examples=15)
@given(cameras)
def test_labels_are_what_the_tracer_shows_at_level_geometry(camera):
    scene = room(camera)
    found, passes = vp.label(scene), vp.render(scene, level="geometry")
    index = {each["id"]: each["object_index"] for each in found.instances} | {0: 0}
    shown = np.vectorize(index.get)(found.image["Instance"].astype(int))
    np.testing.assert_array_equal(shown, passes["Object Index"])
    np.testing.assert_array_equal(found.image["Material Index"], passes["Material Index"])
    np.testing.assert_allclose(found.image["Depth"], passes["Depth"], rtol=2 * FLOAT32)
    np.testing.assert_allclose(found.image["Position"], passes["Position"], atol=20 * FLOAT32)
    np.testing.assert_array_equal(found.image["Normal"], passes["Normal"])


@settings(max_examples=15)
@given(cameras)
def test_a_pixel_has_one_id_and_boxes_and_masks_agree_exactly(camera):
    found = vp.label(room(camera), ("masks", "amodal"))
    ids = found.image["Instance"][::-1, :, 0].astype(int)
    assert set(np.unique(ids)) <= {each["id"] for each in found.instances} | {0}
    for each in found.instances:
        if each["visible"] is not None:
            np.testing.assert_array_equal(mask_of(each["visible"]["segmentation"]), ids == each["id"])
        else:
            assert each["id"] not in ids
        for part in filter(None, (each["visible"], each["amodal"])):
            mask = mask_of(part["segmentation"])
            rows, columns = np.nonzero(mask)
            x, y = columns.min(), rows.min()
            assert part["bbox"] == [x, y, columns.max() + 1 - x, rows.max() + 1 - y] and part["area"] == mask.sum()


@settings(max_examples=10)
@given(cameras)
def test_an_amodal_mask_is_the_object_alone(camera):
    scene = room(camera)
    amodal = {(each["name"], each["number"]): each["amodal"] for each in vp.label(scene, ("amodal",)).instances}
    for placed in scene.objects:
        for number, matrix in enumerate(placed.matrices):
            alone = Surfaces(replace(scene, objects=(replace(placed, matrix=matrix),))).instance[::-1] == 0
            told = amodal.get((placed.name, number))
            mask = mask_of(told["segmentation"]) if told else np.zeros_like(alone)
            # Two ways to one ray, rounded apart: only a centre within 1e-12 of an outline could differ, and none is.
            np.testing.assert_array_equal(mask, alone, err_msg=f"{placed.name} {number}")


def test_what_is_flattened_has_labels_too():
    flat = moved(0, -1, 0.5, 0.3, 0.5) @ np.diag([1, 1, 0, 1.0])
    scene = room(cubes=np.array([flat, moved(2, 1, 1)]))
    found = vp.label(scene, ("depth", "normals", "position", "masks", "amodal", "flow"), next=scene)
    shown = found.image["Instance"][..., 0] != 0
    assert all(np.isfinite(values[shown]).all() for values in found.image.passes.values())
    flattened = next(each for each in found.instances if (each["name"], each["number"]) == ("Cube", 0))
    board = replace(scene.objects[2], matrix=flat)
    alone = Surfaces(replace(scene, objects=(board,))).instance[::-1] == 0
    np.testing.assert_array_equal(mask_of(flattened["amodal"]["segmentation"]), alone)
    assert alone.sum() > flattened["visible"]["area"] > 40


def test_what_cuts_the_eye_plane_is_whole_too():
    """A box round the eye, of which some corners are behind it."""
    scene = room(cubes=np.array([moved(1, -6, 3, 0.2, 1.5)]))
    found = {each["name"]: each for each in vp.label(scene, ("amodal",)).instances}
    assert found["Cube"]["amodal"]["area"] == 64 * 48 and found["Cube"]["visible_fraction"] == 1
    assert found["Ball"]["amodal"]["area"] > 0 and found["Ball"]["visible_fraction"] == 0


@settings(max_examples=50)
@given(st.data())
def test_run_lengths_of_a_part_of_a_picture_are_those_of_the_whole_picture(data):
    """Of parts that touch every edge, down to no pixel at all."""
    height, width = data.draw(st.integers(1, 7)), data.draw(st.integers(1, 7))
    windows, pictures = [], []
    for _ in range(data.draw(st.integers(0, 4))):
        left, low = data.draw(st.integers(0, width)), data.draw(st.integers(0, height))
        columns, rows = data.draw(st.integers(0, width - left)), data.draw(st.integers(0, height - low))
        chance = np.random.default_rng(data.draw(st.integers(0, 99)))
        covered = chance.random((rows, columns)) < data.draw(st.sampled_from([0.0, 0.5, 0.9, 1.0]))
        pictures.append(np.zeros((height, width), bool))
        pictures[-1][low : low + rows, left : left + columns] = covered
        windows.append((left, low, covered))
    for found, picture in zip(masks.of_windows(windows, (height, width)), pictures, strict=True):
        assert (found is None) == (not picture.any())
        if found:
            np.testing.assert_array_equal(mask_of(found["segmentation"]), picture[::-1])
            assert min(found["segmentation"]["counts"][1:]) > 0 and found["area"] == picture.sum()


@settings(max_examples=25)
@given(cameras, st.floats(0.1, 9))
def test_a_silhouette_ends_where_the_clip_range_begins(camera, near):
    """Of boxes that are cut by it, each pixel is found, however little of them is left."""
    scene = replace(room(camera), clip=(near, 100.0))
    windows = Silhouettes(Surfaces(scene)).windows()
    for number, (instance, window) in enumerate(zip(instances(scene), windows, strict=True)):
        alone = Surfaces(replace(scene, objects=(replace(instance.placed, matrix=instance.matrix),))).instance == 0
        found = np.zeros_like(alone)
        if window:
            left, low, covered = window
            found[low : low + covered.shape[0], left : left + covered.shape[1]] = covered
        np.testing.assert_array_equal(found, alone, err_msg=f"instance {number}")


def test_what_is_shown_is_in_its_silhouette_even_if_its_box_seems_beside_the_picture(monkeypatch):
    scene = room()
    surfaces = Surfaces(scene)
    monkeypatch.setattr(Silhouettes, "_reaches", lambda self: np.zeros((len(surfaces.instances), 4), np.intp))
    windows = Silhouettes(surfaces).windows()
    for number, pixels in surfaces.shown_numbers:
        left, low, covered = windows[number]
        rows, columns = np.divmod(pixels, scene.camera.width)
        assert covered[rows - low, columns - left].all() and min(rows - low) >= 0 and min(columns - left) >= 0


def test_an_id_stays_when_others_come_and_go_and_none_is_given_twice():
    scene = room()
    before = {each.key: each.id for each in instances(scene)}
    first = Object("A new one", "cube", np.array([moved(x=i) for i in range(3000)]))
    after = instances(replace(scene, objects=(first, *scene.objects)))
    assert {each.key: each.id for each in after if each.key[0] != "A new one"} == before
    assert len({each.id for each in after}) == len(after) == 3004
    assert all(0 < each.id < 2**24 for each in after)


def test_the_pose_takes_an_object_into_the_camera_that_opencv_has():
    cv2 = pytest.importorskip("cv2")
    for mirrored in (False, True):
        scene = room(replace(CAMERA, mirrored=mirrored))
        camera = scene.camera
        found = vp.label(scene, ("position",))
        (d_x, d_y), (c_x, c_y) = camera.distance, camera.principal_point
        inner = np.array([[d_x, 0, c_x], [0, d_y, camera.height - c_y], [0, 0, 1]])
        for each in found.instances:
            corners = np.array([each["box"]["min"], each["box"]["max"]])
            world = corners @ np.array(each["object_to_world"])[:3, :3].T + np.array(each["object_to_world"])[:3, 3]
            column, row, _ = camera.project(world)
            in_camera = corners @ np.array(each["object_to_camera"])[:3, :3].T + np.array(each["object_to_camera"])[:3, 3]
            before = in_camera[:, 2] > 0
            seen, _ = cv2.projectPoints(in_camera[before], np.zeros(3), np.zeros(3), inner, None)
            expected = np.stack([column, camera.height - row], 1)[before]
            np.testing.assert_allclose(seen.reshape(-1, 2), expected, atol=1e-9)


@pytest.mark.parametrize(
    ("kinds", "more", "sentence"),
    [
        (("colour",), {}, "there is no label 'colour'"),
        (("flow",), {}, "flow goes to another frame"),
        (("flow",), {"next": room(CAMERA.resized(32, 24))}, "32 × 24 pixels and this one 64 × 48"),
    ],
)
def test_what_is_wrong_is_one_sentence(scene, kinds, more, sentence):
    with pytest.raises(vp.InputError, match=sentence):
        vp.label(scene, kinds, **more)
