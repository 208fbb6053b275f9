"""Rays that leave surfaces, by Embree itself: none meets its surface again, none steps over what is far enough off."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("embreex")

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays import offset
from viewcam_addon.tracer.rays.ellipsoids import ellipsoids_of
from viewcam_addon.tracer.rays.embree import embree_scene
from viewcam_addon.tracer.rays.triangles import triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.scene import Object

SEEDS = st.integers(0, 2**32 - 1)
ROUNDING = 2.0**-24
SHAPES = {
    "equilateral": [[0, 0], [1, 0], [0.5, 0.87]],
    "right": [[0, 0], [1, 0], [0, 1]],
    "needle": [[0, 0], [1, 0], [0, 1e-3]],
    "cap": [[0, 0], [1, 0], [0.4, 1e-3]],
}
VIEW = View(Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 1, 1, 1))


@pytest.fixture(scope="module")
def triangle(make_mesh):
    """triangle(shape, rng, size, distance) → Triangles of one, turned at random, and its unit normal in camera space."""

    def build(shape, rng, size, distance):
        middle = rng.normal(size=3)
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        corners = np.column_stack([SHAPES[shape], np.zeros(3)]) * size @ turn + middle / np.abs(middle).max() * distance
        triangles = triangles_of([(Object("triangle", "mesh", np.eye(4)), make_mesh(corners, [[0, 1, 2]]))], VIEW)
        return triangles, VIEW.axes @ turn[2]

    return build


def leaving(triangles, normal, rng, count):
    """Points of a triangle and directions to both sides of it, half of them as flat as they may be; (3, count) each."""
    points = triangles.vertices @ rng.dirichlet((0.5, 0.5, 0.5), count).T
    cosine = np.where(np.arange(count) % 2, rng.uniform(0, 1, count), offset.FLATTEST ** rng.uniform(0, 1, count))
    across = np.cross(normal, rng.normal(size=(count, 3))).T
    directions = normal[:, None] * np.maximum(cosine, offset.FLATTEST) * rng.choice([-1, 1], count)
    return points, directions + across / np.linalg.norm(across, axis=0) * np.sqrt(1 - cosine**2)


def hits(triangles, starts, directions, lengths=None):
    embree = embree_scene(triangles.vertices.T, triangles.corners.T)
    return embree.run(starts.T.astype(np.float32), np.ascontiguousarray(directions.T, np.float32), dists=lengths) >= 0


def acne(triangles, normal, rng, count, share=1.0):
    points, directions = leaving(triangles, normal, rng, count)
    normals = np.broadcast_to(normal[:, None], points.shape)
    offsets = np.repeat(offset.triangle_offsets(triangles) * share, count)
    return int(hits(triangles, offset.start(points, normals, directions, offsets), directions).sum())


@pytest.mark.parametrize("shape", SHAPES)
@settings(max_examples=25)
@given(seed=SEEDS, size=st.integers(-4, 3), scale=st.integers(-6, 6))
def test_no_ray_meets_the_triangle_it_leaves_at_any_size_distance_and_scale(triangle, shape, seed, size, scale):
    rng = np.random.default_rng(seed)
    leaves = triangle(shape, rng, 10.0 ** (size + scale), 10.0**scale)
    count = acne(*leaves, rng, 3000)
    assert count == 0, f"{count} of 3000 rays"


@pytest.mark.exhaustive
@pytest.mark.parametrize("shape", ["equilateral", "right", "cap"])
def test_no_ray_of_twenty_million_meets_the_triangle_it_leaves(triangle, shape):
    rng = np.random.default_rng(1)
    for ratio in (1e-4, 1e-2, 1, 100):
        for _ in range(50):
            count = acne(*triangle(shape, rng, ratio, 1.0), rng, 100_000)
            assert count == 0, f"{count} of 100,000 rays at a size of {ratio} of the distance"


@pytest.mark.parametrize(("shape", "size"), [("equilateral", 1e-3), ("right", 1e-3), ("needle", 0.1)])
def test_half_of_the_offset_is_not_enough(triangle, shape, size):
    rng = np.random.default_rng(2)
    count = sum(acne(*triangle(shape, rng, size, 1.0), rng, 10_000, share=0.5) for _ in range(60))
    assert count > 0, "the offset could be half as wide"


@settings(max_examples=30)
@given(seed=SEEDS, size=st.integers(-3, 1))
def test_a_wall_two_offsets_off_is_not_stepped_over(triangle, seed, size):
    """The start is one offset off. Start and wall are rounded by √3 u M each, less than the other."""
    rng = np.random.default_rng(seed)
    triangles, normal = triangle("right", rng, 10.0**size, 1.0)
    width = offset.triangle_offsets(triangles)[0]
    points = triangles.vertices @ rng.dirichlet((2, 2, 2), 500).T
    wall = replace(triangles, vertices=triangles.vertices + 2 * width * normal[:, None])
    normals = np.broadcast_to(normal[:, None], points.shape)
    met = hits(wall, offset.start(points, normals, normals, np.repeat(width, 500)), normals)
    assert met.all(), f"{(~met).sum()} of 500 rays step over the wall"


@settings(max_examples=30)
@given(seed=SEEDS, exponent=st.integers(-20, 20))
def test_offsets_scale_with_the_scene(triangle, seed, exponent):
    rng = np.random.default_rng(seed)
    triangles, _ = triangle("equilateral", rng, 0.3, 2.0)
    larger = replace(triangles, vertices=triangles.vertices * 2.0**exponent)
    assert offset.triangle_offsets(larger)[0] == offset.triangle_offsets(triangles)[0] * 2.0**exponent


def test_triangles_without_area_have_an_offset_too(make_mesh):
    mesh = make_mesh([[0, 0, -1], [1, 0, -1], [2, 1e-17, -1]], [[0, 1, 2], [0, 0, 0], [1, 1, 2]])
    offsets = offset.triangle_offsets(triangles_of([(Object("lines", "mesh", np.eye(4)), mesh)], VIEW))
    # At most 3.5 M + (8 + 2¹¹) L with M = L = 2.
    assert (offsets > 0).all() and (offsets <= 4120 * ROUNDING).all(), offsets


def test_a_ray_starts_on_its_own_side_and_an_offset_of_nothing_is_the_point_itself():
    points, normals = np.array([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]), np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0]])
    directions = np.array([[9.0, 9.0], [0.0, 0.0], [0.1, -0.1]])
    starts = offset.start(points, normals, directions, np.array([0.25, 0.25]))
    assert np.array_equal(starts[2], [3.25, 2.75]) and np.array_equal(starts[:2], points[:2])
    assert np.array_equal(offset.start(points, normals, directions, np.zeros(2)), points)


@settings(max_examples=40)
@given(seed=SEEDS, scale=st.integers(-6, 6))
def test_a_lamp_in_a_surface_is_not_hidden_by_it_and_one_behind_it_is(triangle, seed, scale):
    rng = np.random.default_rng(seed)
    size = 10.0**scale
    triangles, normal = triangle("right", rng, size, size)
    shares = rng.dirichlet((2, 2, 2), 1000).T
    lamps = triangles.vertices @ shares
    starts = lamps + normal[:, None] * size * rng.uniform(0.1, 1, 1000)
    origins, directions, lengths = offset.shadow_rays(starts, lamps)
    assert origins.dtype == directions.dtype == lengths.dtype == np.float32
    hidden = hits(triangles, origins.T, directions.T, lengths)
    assert not hidden.any(), f"{hidden.sum()} of 1000 lamps are hidden by the surface they lie in"
    # The ray ends by 3.5 u M + 12 u |way| before a lamp, M and the way less than 2, and the rest is rounded by half as much.
    behind = 50 * ROUNDING * size
    origins, directions, lengths = offset.shadow_rays(starts, lamps - behind * normal[:, None])
    open_ = ~hits(triangles, origins.T, directions.T, lengths)
    assert not open_.any(), f"{open_.sum()} of 1000 lamps shine through the surface before them"


def test_a_lamp_where_the_ray_starts_is_seen():
    point = np.array([[1.0], [2.0], [3.0]])
    _, _, lengths = offset.shadow_rays(point, point)
    assert lengths == 0
    _, _, lengths = offset.shadow_rays(point * 0, point * 0)
    assert lengths == 0


@settings(max_examples=20)
@given(seed=SEEDS, log_distance=st.integers(0, 6))
def test_no_ray_meets_the_ellipsoid_it_leaves_though_it_starts_on_it(make_spheres, random_matrix, seed, log_distance):
    rng = np.random.default_rng(seed)
    matrix = random_matrix(rng)
    matrix[2, 3] -= 4.0 * 10**log_distance
    pairs = [(Object("object", "spheres", matrix), make_spheres([[0, 0, 0]], 1.0))]
    ellipsoids = ellipsoids_of(pairs, VIEW)
    aim = rng.normal(size=(3, 60)) * 0.7
    aim = matrix[:3, :3] @ aim + matrix[:3, 3:]
    x, y = aim[:2] / -aim[2]
    first = np.zeros(60, np.intp)
    depth = ellipsoids.depth(first, x, y)
    met = np.isfinite(depth)
    points = np.stack([x, y, np.ones(60)])[:, met] * depth[met]
    normals = np.stack(ellipsoids.normal(first[met], x[met], y[met], depth[met]))
    for point, normal in zip(points.T, normals.T, strict=True):
        across = np.cross(normal, rng.normal(size=3))
        cosine = offset.FLATTEST ** rng.uniform(0, 1)
        direction = cosine * normal + across / np.linalg.norm(across) * np.sqrt(1 - cosine**2)
        eye, ahead = VIEW.axes.T @ point, VIEW.axes.T @ direction
        onwards = View(
            Pinhole(tuple(eye), tuple(eye + ahead * np.linalg.norm(eye)), tuple(np.cross(ahead, (1, 2, 3))), 1, 1, 1)
        )
        seen = ellipsoids_of(pairs, onwards)
        again = seen.depth(np.zeros(1, np.intp), np.zeros(1), np.zeros(1)) if seen.count else np.inf
        assert np.isinf(again), f"met again at {again}, {np.linalg.norm(point):.1e} from the eye"
