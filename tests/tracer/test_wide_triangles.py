"""A ground that reaches far and comes near: what lies on it is seen, and so is the ground itself right below the eye."""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Tracer

EXTENTS = [1e1, 1e2, 1e3, 1e4, 1e6, 1e9]


@pytest.fixture
def ground_and_mat(make_mesh, make_scene):
    """ground_and_mat(extent, thickness, height, seed) → a Scene, turned anyhow: a ground (object 1) with a mat on it (2)."""

    def build(extent, thickness, height=1.6, seed=0):
        turned = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        ground = np.array([[-1, -0.37, 0], [0.83, -0.71, 0], [0.91, 0.57, 0], [-0.77, 1, 0]]) * extent
        mat = np.array([[-0.5, 1, thickness], [0.5, 1, thickness], [0.5, 3, thickness], [-0.5, 3, thickness]])
        camera = Pinhole(tuple(turned @ (0, 0, height)), tuple(turned @ (0, 2, 0)), tuple(turned[:, 2]), 60, 60, 60)
        halves = [[0, 1, 2], [0, 2, 3]]
        return make_scene(camera, make_mesh(ground @ turned.T, halves), make_mesh(mat @ turned.T, halves))

    return build


def seen(scene):
    return Tracer(scene).render()["Object Index"][..., 0].astype(int)


def outline_of_the_mat(scene) -> np.ndarray:
    """The picture on paper: 2 where the ray through a pixel's centre meets the mat's rectangle."""
    rows, columns = np.mgrid[: scene.camera.height, : scene.camera.width]
    corners = scene.geometries["geometry 1"].vertices
    directions = scene.camera.ray_directions(columns, rows)
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    distance = (corners[0] - np.array(scene.camera.eye)) @ normal / (directions @ normal)
    on_it = np.array(scene.camera.eye) + distance[..., None] * directions - corners[0]
    sides = [side / (side @ side) for side in (corners[1] - corners[0], corners[3] - corners[0])]
    return np.logical_and.reduce([(on_it @ side >= 0) & (on_it @ side <= 1) for side in sides]) & (distance > 0)


@pytest.mark.parametrize("extent", EXTENTS)
@pytest.mark.parametrize("seed", range(3))
def test_a_thin_mat_is_seen_on_a_ground_of_any_extent(ground_and_mat, extent, seed):
    scene = ground_and_mat(extent, thickness=1e-4, seed=seed)
    picture, mat = seen(scene), outline_of_the_mat(scene)
    assert mat.sum() > 500 and np.array_equal(picture == 2, mat), f"{(mat & (picture != 2)).sum()} pixels of the mat are lost"
    assert (picture[:20] > 0).all(), "the ground has a hole near the eye"


@pytest.mark.parametrize("height", [1e-2, 1e-5, 1e-8])
@pytest.mark.parametrize("seed", range(3))
def test_an_eye_close_above_a_ground_does_not_look_through_it(ground_and_mat, height, seed):
    scene = ground_and_mat(1e3, thickness=0.0, height=height, seed=seed)
    down = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0] @ (0.1, 0.2, -1)
    camera = Pinhole(scene.camera.eye, tuple(np.array(scene.camera.eye) + down), (0.3, 0.5, 0.8), 60, 60, 60)
    passes = Tracer(type(scene)(camera, scene.geometries, scene.objects[:1])).render()
    assert (passes["Object Index"] == 1).all(), f"{(passes['Object Index'] != 1).sum()} rays pass through the ground"
    below = camera.ray_directions(*np.meshgrid(np.arange(60), np.arange(60))) @ (down / np.linalg.norm(down))
    floor = scene.geometries["geometry 0"].vertices
    normal = np.cross(floor[1] - floor[0], floor[3] - floor[0])
    normal /= np.linalg.norm(normal)
    above = abs((np.array(camera.eye) - floor[0]) @ normal)
    slope = np.abs(camera.ray_directions(*np.meshgrid(np.arange(60), np.arange(60))) @ normal)
    # The eye's height over the plane is the difference of coordinates of up to 1e3, each rounded by 2⁻⁵³.
    allowed = 2.0**-23 + 32 * 2.0**-53 * 1e3 / height
    assert np.abs(passes["Depth"][..., 0] / (above / slope * below) - 1).max() <= allowed
