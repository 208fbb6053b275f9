"""Labels of one frame: on paper, against the tracer's own passes, and among one another."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import viewcam_addon as vp
from viewcam_addon import image
from viewcam_addon.image import BACKGROUND_DEPTH
from viewcam_addon.labels import coverage, files, masks
from viewcam_addon.labels.surfaces import Silhouettes, Surfaces, instances
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Object, Scene, Spheres

from .conftest import BALL, CAMERA, CUBE, mesh, moved, room

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
    """The eye at the origin looks along −z at a ball of radius 1 whose center is 4 away, and at a wall 8 away."""
    camera = vp.Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 40, 33, 25)
    ball = Spheres(np.array([[0.0, 0, -4]]), np.array([1.0]), np.zeros(1, np.int32))
    wall = replace(CUBE, vertices=CUBE.vertices * [50, 50, 1])
    behind = moved(z=-9)  # its front is at z = −8
    scene = Scene(camera, {"ball": ball, "wall": wall}, (Object("Ball", "ball", np.eye(4)), Object("Wall", "wall", behind)))
    labels = vp.label(scene)
    y, x = np.mgrid[0:25, 0:33]
    x, y = (x + 0.5 - 16.5) / 40, (y + 0.5 - 12.5) / 40
    square = x * x + y * y + 1
    # |t (x, y, −1) − (0, 0, −4)| = 1, the nearer of the two.
    under = 16 - 15 * square
    assert np.abs(under).min() > 1e-3, "no center is on the outline, where rounding would decide"
    depth = np.where(under > 0, (4 - np.sqrt(np.maximum(under, 0))) / square, 8.0)
    passes = {name: values.astype(float) for name, values in labels.image.passes.items()}
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
    ids = {each["name"]: each["id"] for each in labels.instances}
    np.testing.assert_array_equal(passes["Instance"][..., 0], np.where(under > 0, ids["Ball"], ids["Wall"]))
    of_ball = next(each for each in labels.instances if each["name"] == "Ball")
    np.testing.assert_array_equal(mask_of(of_ball["visible"]["segmentation"]), (under > 0)[::-1])
    wall_told = next(each for each in labels.instances if each["name"] == "Wall")
    assert wall_told["amodal"]["area"] == 33 * 25 and wall_told["visible"]["area"] == (under <= 0).sum()
    assert of_ball["box"] == {"min": [-1, -1, -5], "max": [1, 1, -3]}
    assert of_ball["visible_fraction"] == 1 and wall_told["visible_fraction"] == (under <= 0).mean()


def test_nothing_is_told_of_pixels_that_show_nothing():
    ball = Spheres(np.array([[0.0, 0, 0]]), np.array([0.5]), np.zeros(1, np.int32))
    labels = vp.label(Scene(CAMERA, {"ball": ball}, (Object("Ball", "ball", np.eye(4)),)))
    empty = labels.image["Instance"][..., 0] == 0
    assert 0 < empty.sum() < empty.size
    for name, values in labels.image.passes.items():
        assert (values[empty] == (BACKGROUND_DEPTH if name in ("Depth", "Distance") else 0)).all(), name


@settings(max_examples=15)
@given(cameras)
def test_labels_are_what_the_tracer_shows_at_level_geometry(camera):
    scene = room(camera)
    labels, passes = vp.label(scene), vp.render(scene, level="geometry")
    index = {each["id"]: each["object_index"] for each in labels.instances} | {0: 0}
    index_of_pixels = np.vectorize(index.get)(labels.image["Instance"].astype(int))
    np.testing.assert_array_equal(index_of_pixels, passes["Object Index"])
    np.testing.assert_array_equal(labels.image["Material Index"], passes["Material Index"])
    np.testing.assert_allclose(labels.image["Depth"], passes["Depth"], rtol=2 * FLOAT32)
    np.testing.assert_allclose(labels.image["Position"], passes["Position"], atol=20 * FLOAT32)
    np.testing.assert_array_equal(labels.image["Normal"], passes["Normal"])


@settings(max_examples=15)
@given(cameras)
def test_a_pixel_has_one_id_and_boxes_and_masks_agree_exactly(camera):
    labels = vp.label(room(camera), ("masks", "amodal"))
    ids = labels.image["Instance"][::-1, :, 0].astype(int)
    assert set(np.unique(ids)) <= {each["id"] for each in labels.instances} | {0}
    for each in labels.instances:
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
            amodal_entry = amodal.get((placed.name, number))
            mask = mask_of(amodal_entry["segmentation"]) if amodal_entry else np.zeros_like(alone)
            # Two ways to one ray, rounded apart: only a center within 1e-12 of an outline could differ, and none is.
            np.testing.assert_array_equal(mask, alone, err_msg=f"{placed.name} {number}")


def test_what_is_flattened_has_labels_too():
    flat = moved(0, -1, 0.5, 0.3, 0.5) @ np.diag([1, 1, 0, 1.0])
    scene = room(cubes=np.array([flat, moved(2, 1, 1)]))
    labels = vp.label(scene, ("depth", "normals", "position", "masks", "amodal", "flow"), next=scene)
    is_covered = labels.image["Instance"][..., 0] != 0
    assert all(np.isfinite(values[is_covered]).all() for values in labels.image.passes.values())
    flattened = next(each for each in labels.instances if (each["name"], each["number"]) == ("Cube", 0))
    board = replace(scene.objects[2], matrix=flat)
    alone = Surfaces(replace(scene, objects=(board,))).instance[::-1] == 0
    np.testing.assert_array_equal(mask_of(flattened["amodal"]["segmentation"]), alone)
    assert alone.sum() > flattened["visible"]["area"] > 40


def test_what_cuts_the_eye_plane_is_whole_too():
    """A box round the eye, of which some corners are behind it."""
    scene = room(cubes=np.array([moved(1, -6, 3, 0.2, 1.5)]))
    labels = {each["name"]: each for each in vp.label(scene, ("amodal",)).instances}
    assert labels["Cube"]["amodal"]["area"] == 64 * 48 and labels["Cube"]["visible_fraction"] == 1
    assert labels["Ball"]["amodal"]["area"] > 0 and labels["Ball"]["visible_fraction"] == 0


@settings(max_examples=50)
@given(st.data())
def test_run_lengths_of_a_part_of_a_picture_are_those_of_the_whole_picture(data):
    """The parts touch every edge, down to no pixel at all."""
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
    for values, picture in zip(masks.of_windows(windows, (height, width)), pictures, strict=True):
        assert (values is None) == (not picture.any())
        if values:
            np.testing.assert_array_equal(mask_of(values["segmentation"]), picture[::-1])
            assert min(values["segmentation"]["counts"][1:]) > 0 and values["area"] == picture.sum()


@settings(max_examples=25)
@given(cameras, st.floats(0.1, 9))
def test_a_silhouette_ends_where_the_clip_range_begins(camera, near):
    """Each pixel of boxes that are cut by it is found, however little of them is left."""
    scene = replace(room(camera), clip=(near, 100.0))
    windows = Silhouettes(Surfaces(scene)).windows()
    for number, (instance, window) in enumerate(zip(instances(scene), windows, strict=True)):
        alone = Surfaces(replace(scene, objects=(replace(instance.placed, matrix=instance.matrix),))).instance == 0
        actual = np.zeros_like(alone)
        if window:
            left, low, covered = window
            actual[low : low + covered.shape[0], left : left + covered.shape[1]] = covered
        np.testing.assert_array_equal(actual, alone, err_msg=f"instance {number}")


def test_what_is_shown_is_in_its_silhouette_even_if_its_box_seems_beside_the_picture(monkeypatch):
    scene = room()
    surfaces = Surfaces(scene)
    monkeypatch.setattr(Silhouettes, "_reaches", lambda self: np.zeros((len(surfaces.instances), 4), np.intp))
    windows = Silhouettes(surfaces).windows()
    for number, pixels in surfaces.visible_numbers:
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
        labels = vp.label(scene, ("position",))
        (d_x, d_y), (c_x, c_y) = camera.distance, camera.principal_point
        inner = np.array([[d_x, 0, c_x], [0, d_y, camera.height - c_y], [0, 0, 1]])
        for each in labels.instances:
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
        (("color",), {}, "there is no label 'color'"),
        (("flow",), {}, "flow goes to another frame"),
        (("flow",), {"next": room(CAMERA.resized(32, 24))}, "32 × 24 pixels and this one 64 × 48"),
    ],
)
def test_what_is_wrong_is_one_sentence(scene, kinds, more, sentence):
    with pytest.raises(vp.InputError, match=sentence):
        vp.label(scene, kinds, **more)


# --- Flow against depth and poses, by another formula; against paper where things deform; and what is hidden


ALLOWED = 1e-3
"""Pixels: what the issue of two frames may differ by where depths are float32."""

steps = st.floats(-0.3, 0.3)


def intrinsics(camera):
    """K for pixels from the left and from the top, and [R | t] of x right, y down, z forward."""
    u, v, w = camera.basis()
    (d_x, d_y), (c_x, c_y) = camera.distance, camera.principal_point
    rotation = np.array([u, -v, -w])
    return np.array([[d_x, 0, c_x], [0, d_y, camera.height - c_y], [0, 0, 1]]), rotation, -rotation @ np.array(camera.eye)


def flow_of_poses(labels, here, there, motions):
    """(height, width, 2), rows from the top: from the float32 depth, K, R and t of both cameras, and the instances' motions.

    motions : id to the (4, 4) that takes its points from world to world.
    """
    depth = labels.image["Depth"][::-1, :, 0].astype(float)
    ids = labels.image["Instance"][::-1, :, 0].astype(int)
    inner, rotation, shift = intrinsics(here)
    rows, columns = np.mgrid[0 : here.height, 0 : here.width] + 0.5
    seen = np.stack([columns, rows, np.ones_like(rows)], -1) @ np.linalg.inv(inner).T * depth[..., None]
    world = (seen - shift) @ rotation
    matrices = np.array([motions.get(number, np.eye(4)) for number in ids.ravel()]).reshape(*ids.shape, 4, 4)
    world = np.einsum("hwij,hwj->hwi", matrices[..., :3, :3], world) + matrices[..., :3, 3]
    inner, rotation, shift = intrinsics(there)
    angles = (world @ rotation.T + shift) @ inner.T
    return angles[..., :2] / angles[..., 2:] - np.stack([columns, rows], -1)


def largest_difference(labels, expected, name="Forward"):
    """Over all pixels that show something which both cameras see."""
    flow = labels.image[f"{name} Flow"][::-1].astype(float)
    is_visible = (labels.image["Instance"] != 0)[::-1, :, 0] & (labels.image[f"{name} Hidden"] == 0)[::-1, :, 0]
    assert is_visible.sum() > 100, "there is too little to compare"
    return np.abs(flow - expected)[is_visible].max()


@settings(max_examples=20)
@given(steps, steps, steps, st.floats(-0.4, 0.4), steps, st.floats(0.7, 1.4))
def test_rigid_flow_is_that_of_depth_and_poses(x, y, z, turn, zoom, scale):
    camera = replace(CAMERA, eye=tuple(np.add(CAMERA.eye, (x, y, z))), distance=(70 * (1 + zoom), 75 * (1 + zoom)))
    before, after = room(), room(camera, ball=moved(x, y, 0.9, turn, scale))
    labels = vp.label(before, ("depth", "masks", "flow"), next=after)
    poses = {each["id"]: each for each in labels.instances}
    number = next(number for number, each in poses.items() if each["name"] == "Ball")
    motions = {number: moved(x, y, 0.9, turn, scale) @ np.linalg.inv(np.array(poses[number]["object_to_world"]))}
    expected = flow_of_poses(labels, CAMERA, camera, motions)
    assert largest_difference(labels, expected) < ALLOWED
    # Half a pixel, a ball that is a hundredth of its size elsewhere, and a lens that is a thousandth longer are seen.
    elsewhere = flow_of_poses(labels, CAMERA, camera, {number: moved(0.01) @ motions[number]})
    longer = flow_of_poses(labels, CAMERA, replace(camera, distance=tuple(1.001 * np.array(camera.distance))), motions)
    for wrong in (expected + 0.5, elsewhere, longer):
        assert largest_difference(labels, wrong) > 5 * ALLOWED


def test_backward_is_towards_the_previous_frame(scene):
    camera = replace(CAMERA, eye=(1.3, -7.0, 3.2))
    both = vp.label(scene, ("depth", "masks", "flow"), previous=room(camera), next=room(camera))
    np.testing.assert_array_equal(both.image["Forward Flow"], both.image["Backward Flow"])
    other = vp.label(scene, ("depth", "masks", "flow"), previous=room(camera))
    assert "Forward Flow" not in other.image.passes
    assert largest_difference(other, flow_of_poses(other, CAMERA, camera, {}), "Backward") < ALLOWED


def test_what_stands_still_before_a_still_camera_has_no_flow_at_all(scene):
    labels = vp.label(scene, ("masks", "flow"), next=room())
    is_covered = labels.image["Instance"][..., 0] != 0
    # The point is projected back onto its own center, to the last bits.
    assert np.abs(labels.image["Forward Flow"][is_covered]).max() < 1e-12
    assert (labels.image["Forward Motion"][is_covered] == 0).all() and not labels.image["Forward Hidden"].any()
    assert np.isnan(labels.image["Forward Flow"][~is_covered]).all()


@settings(max_examples=10)
@given(st.lists(st.floats(-0.2, 0.2), min_size=12, max_size=12))
def test_a_mesh_that_deforms_moves_as_its_triangles_do(numbers):
    """An affine map of the vertices is the same map of all points between them: an answer on paper."""
    change = np.eye(4)
    change[:3] += np.reshape(numbers, (3, 4))
    bent = replace(CUBE, vertices=CUBE.vertices @ change[:3, :3].T + change[:3, 3])
    cubes = np.array([moved(1.6, 0.5, 0.4, 0.3, 0.4), moved(-1.5, 0, 0.8, 0.1, 0.8)])
    labels = vp.label(room(cubes=cubes), ("depth", "masks", "flow"), next=room(cubes=cubes, geometries={"cube": bent}))
    motions = {
        each["id"]: cubes[each["number"]] @ change @ np.linalg.inv(cubes[each["number"]])
        for each in labels.instances
        if each["name"] == "Cube"
    }
    assert labels.lost == {"forward": []}
    assert largest_difference(labels, flow_of_poses(labels, CAMERA, CAMERA, motions)) < ALLOWED


def test_a_ball_that_grows_carries_its_points_outwards(scene):
    grown = replace(BALL, centers=BALL.centers + np.array([0.1, 0, 0]), radii=BALL.radii * 1.2)
    labels = vp.label(scene, ("position", "masks", "flow"), next=room(geometries={"ball": grown}))
    number = next(each["id"] for each in labels.instances if each["name"] == "Ball")
    on_ball = labels.image["Instance"][..., 0] == number
    local, motion = (
        labels.image["Object Position"][on_ball].astype(float),
        labels.image["Forward Motion"][on_ball].astype(float),
    )
    upper = np.abs(np.linalg.norm(local - BALL.centers[1], axis=1) - 0.4) < 1e-6
    expected = 0.2 * (local - BALL.centers[upper.astype(int)]) + [0.1, 0, 0]
    np.testing.assert_allclose(motion, expected, atol=1e-6)  # coordinates below 2 in float32


@settings(max_examples=10)
@given(steps, steps, steps)
def test_a_point_is_hidden_where_the_other_frame_shows_another_one(x, y, z):
    """By the other frame's own picture, at the very place where the point would be."""
    camera = replace(CAMERA, eye=tuple(np.add(CAMERA.eye, (5 * x, y, z))))
    before, after = room(), room(camera, ball=moved(3 * x, y, 0.7 + z))
    labels = vp.label(before, ("position", "masks", "flow"), next=after)
    rows, columns = np.nonzero(labels.image["Instance"][..., 0])
    point = (labels.image["Position"].astype(float) + labels.image["Forward Motion"].astype(float))[rows, columns]
    column, row, depth = camera.project(point)
    inside = (column >= 0) & (column < 64) & (row >= 0) & (row < 48)
    rendered = Tracer(after).surface_at(np.floor(column[inside]), np.floor(row[inside]), column[inside] % 1, row[inside] % 1)
    hidden = labels.image["Forward Hidden"][rows, columns, 0] != 0
    assert hidden[~inside].all()
    # Float32 places each point within 1e-6; where what is before it is so near, either answer is right, and so at outlines.
    nearer = depth[inside] - rendered["Depth"][:, 0]
    sure = np.abs(np.abs(nearer) - 1e-4) > 0.9e-4
    assert sure.mean() > 0.97
    wrong = sure & (hidden[inside] != (nearer > 1e-4))
    assert wrong.mean() < 0.003, f"{wrong.sum()} of {len(wrong)} points"  # points within 1e-6 of an outline, but for a few none


def test_what_is_not_in_the_other_frame_is_named_and_has_no_flow(scene):
    after = room()
    after = replace(after, objects=tuple(each for each in after.objects if each.name != "Ball"))
    other = replace(CUBE, triangles=CUBE.triangles[::-1].copy())
    after = replace(after, geometries=after.geometries | {"cube": other})
    labels = vp.label(scene, ("masks", "flow"), next=after)
    assert sorted(labels.lost["forward"]) == ["Ball", "Cube"]
    names = {each["id"]: each["name"] for each in labels.instances}
    known = np.isfinite(labels.image["Forward Flow"][..., 0])
    assert {names[number] for number in np.unique(labels.image["Instance"][known]).astype(int)} == {"Floor"}


@pytest.mark.parametrize("away", [1e3, 1e6])
def test_far_from_the_origin_flow_is_as_exact(away):
    shift = np.array([away, -away, away / 2])
    camera = replace(CAMERA, eye=tuple(np.add(CAMERA.eye, shift)), look_at=tuple(np.add(CAMERA.look_at, shift)))
    frames = []
    for step in (0, 0.3):
        scene = room(replace(camera, eye=tuple(np.add(camera.eye, (step, 0, 0)))))
        objects = []
        for placed in scene.objects:
            matrix = placed.matrix.copy()
            matrix[..., :3, 3] += shift
            objects.append(replace(placed, matrix=matrix))
        frames.append(replace(scene, objects=tuple(objects)))
    labels = vp.label(frames[0], ("depth", "masks", "flow"), next=frames[1])
    assert largest_difference(labels, flow_of_poses(labels, frames[0].camera, frames[1].camera, {})) < ALLOWED


# --- Coverage: areas on paper, masks at the centers, and Cryptomatte as it is specified


STEP = 1 / coverage.SAMPLES
CRYPTOMATTE = "cryptomatte/542cafa"


def soft(labels, name, number=0):
    entry = next(each for each in labels.instances if (each["name"], each["number"]) == (name, number))
    return coverage.soft_mask(labels.image, entry["coverage"]["name"])


def board(left, low, right, high):
    """Seen from the origin along −z, 1 away: a rectangle in the pixels of a picture of 8 × 6, x right and y up."""
    corners = [((x - 4) / 10, (y - 3) / 10, -1) for x, y in ((left, low), (right, low), (right, high), (left, high))]
    camera = vp.Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 8, 6)
    return Scene(camera, {"board": mesh(corners, [(0, 1, 2), (0, 2, 3)])}, (Object("Board", "board", np.eye(4)),))


@settings(max_examples=15)
@given(st.floats(0.01, 7.99), st.floats(0.01, 7.99), st.floats(0.01, 5.99), st.floats(0.01, 5.99))
def test_a_rectangle_covers_what_it_covers_on_paper(discrepancy, x, other_x, y, other_y):
    (left, right), (low, high) = sorted((x, other_x)), sorted((y, other_y))
    if right - left < 1e-6 or high - low < 1e-6:
        return
    labels = vp.label(board(left, low, right, high), ("coverage",))
    columns = np.clip(np.minimum(right, np.arange(1, 9)) - np.maximum(left, np.arange(8)), 0, 1)
    rows = np.clip(np.minimum(high, np.arange(1, 7)) - np.maximum(low, np.arange(6)), 0, 1)
    expected = rows[:, None] * columns
    name = labels.instances[0]["coverage"]["name"] if labels.instances else "Board"
    off = np.abs(coverage.soft_mask(labels.image, name) - expected).max()
    assert off <= discrepancy, f"a pixel is {off:.3f} off"


@pytest.fixture(scope="module")
def discrepancy():
    """The largest difference of a box in the pixel from its share of the places, found by trying all boxes between them."""
    i = np.arange(coverage.SAMPLES)
    points = np.stack([(i + 0.5) * STEP, (i * coverage._STEP % coverage.SAMPLES + 0.5) * STEP])
    edges = np.append(np.append(0.0, (i + 0.5) * STEP), 1.0)
    table = np.histogram2d(*points, bins=[np.append(i * STEP, 1.0)] * 2)[0]
    sums = np.pad(table.cumsum(0).cumsum(1), ((1, 0), (1, 0)))  # over the places below each pair of edges
    worst = 0.0
    for a in range(len(i) + 1):
        for b in range(a, len(i) + 1):
            strip = sums[b] - sums[a]
            counts = strip[None, :] - strip[:, None]
            j = np.arange(len(i) + 1)
            is_box = j[None, :] >= j[:, None]
            # Between the last place that is left out and the first that is in, the box's edges may be anywhere.
            widest = (edges[min(b + 1, len(i) + 1)] - edges[a]) * (edges[j + 1][None, :] - edges[j][:, None])
            least = max(edges[b] - edges[a + 1], 0) * np.maximum(edges[j][None, :] - edges[j + 1][:, None], 0)
            worst = max(worst, np.abs(counts * STEP - widest)[is_box].max(), np.abs(counts * STEP - least)[is_box].max())
    return worst


def test_a_lattice_is_more_even_than_a_grid_of_as_many():
    """An upright edge that moves through a pixel: a grid of 6 × 6 is off by a twelfth."""
    places = np.linspace(0.005, 0.995, 19)
    shares = [soft(vp.label(board(0.5, 1, 3 + x, 5), ("coverage",)), "Board")[2, 3] for x in places]
    assert np.abs(shares - places).max() <= STEP / 2 + 1e-6


def test_shares_add_up_and_hold_the_masks_at_the_centers():
    labels = vp.label(room(), ("masks", "coverage"))
    shares = [soft(labels, each["name"], each["number"]) for each in labels.instances]
    hit = labels.image["Instance"][..., 0] != 0
    total = np.sum(shares, axis=0)
    assert total.max() <= 1 + 1e-6 and (total[hit] > 0).all()
    ids = labels.image["Instance"][..., 0]
    for each, share in zip(labels.instances, shares, strict=True):
        assert (share[ids == each["id"]] > 0).all(), "what is at the center covers some of the pixel"
        assert ((share > 0) & (share < 1)).any()
        assert each["coverage"]["area"] == pytest.approx(share.sum(), rel=1e-6)
        if each["visible"]:
            edge = 2 * (each["visible"]["bbox"][2] + each["visible"]["bbox"][3])
            assert abs(each["coverage"]["area"] - each["visible"]["area"]) <= edge
    layers = [name for name in labels.image.passes if name.startswith("Crypto")]
    ranks = np.concatenate([labels.image[name][..., 1::2] for name in layers], axis=-1)
    assert (np.diff(ranks, axis=-1) <= 0).all() and ranks[..., -2:].any(), "the largest first, and no layer for nothing"


def test_another_place_in_the_pixels_is_the_camera_shifted_and_leaves_the_centers_as_they_were(scene):
    surfaces = Surfaces(scene)
    there = surfaces.instances_at((0.2, 0.9))
    aside = replace(scene, camera=CAMERA.cropped(-0.3, 0.4, CAMERA.width, CAMERA.height))
    np.testing.assert_array_equal(there, Surfaces(aside).instance)
    np.testing.assert_array_equal(surfaces.instance, Surfaces(scene).instance)
    assert (there != surfaces.instance).any()


def test_an_object_behind_another_or_smaller_than_a_pixel_counts_for_what_is_seen_of_it():
    small = moved(-3, -3, 0.5, 0.2, 0.004)  # a cube a twentieth of a pixel wide
    scene = room(cubes=np.array([small, moved(1.6, 0.5, 0.4, 0.3, 0.4)]), camera=replace(CAMERA, width=64, height=48))
    labels = vp.label(scene, ("coverage",))
    names = {each["coverage"]["name"] for each in labels.instances}
    assert "Cube #1" in names and "Ball" in names
    assert all(each["coverage"]["area"] > 0 for each in labels.instances)


def test_the_file_is_cryptomatte(tmp_path):
    labels = vp.label(room(), ("coverage",))
    files.write(tmp_path / "shot.exr", labels)
    read = image.read(tmp_path / "shot.labels.exr")
    assert read.attributes[f"{CRYPTOMATTE}/name"] == "ViewLayer.CryptoObject"
    assert read.attributes[f"{CRYPTOMATTE}/hash"] == "MurmurHash3_32"
    assert read.attributes[f"{CRYPTOMATTE}/conversion"] == "uint32_to_float32"
    manifest = json.loads(read.attributes[f"{CRYPTOMATTE}/manifest"])
    assert set(manifest) == {each["coverage"]["name"] for each in labels.instances}
    held = {int(value) for name in read.passes for value in np.unique(read[name][..., ::2].copy().view(np.uint32))} - {0}
    assert held == {int(value, 16) for value in manifest.values()}
    for name in labels.image.passes:
        np.testing.assert_array_equal(read[name].view(np.uint32), labels.image[name].view(np.uint32))


def test_ids_are_those_that_blender_gives():
    """Read from files that Blender wrote; the last two are such whose float would be none."""
    ours = {name: f"{coverage.murmur3(name.encode()):08x}" for name in ("Quad", "Floor", "Mä t", "o14", "o108")}
    assert ours == {"Quad": "a9947c8d", "Floor": "6a2fb16e", "Mä t": "9e9d1370", "o14": "ff9c08d6", "o108": "8061a038"}
    assert [coverage._hex(coverage._mark(name)) for name in ("o14", "o108")] == ["ff1c08d6", "80e1a038"]


def test_a_name_that_another_object_has_is_not_given_to_a_copy():
    scene = room()
    floor = replace(scene.objects[0], name="Cube #1")
    labels = vp.label(replace(scene, objects=(floor, *scene.objects[1:])), ("coverage",))
    names = [each["coverage"]["name"] for each in labels.instances]
    assert sorted(names) == ["Ball", "Cube", "Cube #1", "Cube #1#"]
