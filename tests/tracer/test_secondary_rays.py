"""Rays that leave surfaces: none meets its surface again, none steps over what is far enough off, at any scale and place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.scene import Mesh, Object, Scene

SEEDS = st.integers(0, 2**32 - 1)
FLOAT64 = 2.0**-53
FLATTEST = 1e-6
"""Sine of the least angle at which rays leave here."""
CAMERA = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 1, 1, 1)
ASKEW = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
AWAY = np.array([1.0, -0.7, 0.4])
# Sizes, and distances from the origin, without 1e-6 at 1e7, which is some hundred numbers across: there is no surface.
PLACES = [(scale, far) for scale in (1e-6, 1e-3, 1.0, 1e3, 1e6) for far in (0.0, 1e3, 1e7) if scale > 1e4 * np.spacing(far)]
HALVES = [[0, 1, 2], [0, 2, 3]]
SQUARE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
SHAPES = {
    "equilateral": [[0, 0], [1, 0], [0.5, 0.87]],
    "right": [[0, 0], [1, 0], [0, 1]],
    "needle": [[0, 0], [1, 0], [0, 1e-3]],
    "cap": [[0, 0], [1, 0], [0.4, 1e-3]],
}


def placing(scale: float, far: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = ASKEW * scale, AWAY * far
    return matrix


def core_of(geometry, matrix, users: int = 1) -> CoreScene:
    """One thing, or instances of it that stand in one another's place."""
    return CoreScene(Scene(CAMERA, {"thing": geometry}, tuple(Object(f"{i}", "thing", matrix) for i in range(users))), 2)


def rays_at(core: CoreScene, matrix, starts, aims) -> np.ndarray:
    starts, aims = (points @ matrix[:3, :3].T + matrix[:3, 3] for points in (starts, aims))
    return core.rays(starts, aims - starts)


def onwards(normals, rng, sides=1.0) -> np.ndarray:
    """(n, 3) unit directions on the side of the normals, half of them as flat as they may be."""
    count = len(normals)
    cosine = np.where(np.arange(count) % 2, rng.uniform(FLATTEST, 1, count), FLATTEST ** rng.uniform(0, 1, count))[:, None]
    across = np.cross(normals, rng.normal(size=(count, 3)))
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)  # 0 where nothing was met
    return normals * cosine * np.reshape(sides, (-1, 1)) + across * np.sqrt(1 - cosine**2)


def traced(core: CoreScene, starts, directions, lengths=np.inf) -> tuple[np.ndarray, np.ndarray]:
    """The hits of rays from `starts`, and whether anything hides them, one by one and in packets."""
    rays = np.column_stack([starts, directions, np.zeros(len(starts)), np.broadcast_to(lengths, len(starts))])
    met, hidden = (
        [getattr(core, name)(rays, packets=packets) for packets in (False, True)] for name in ("closest", "occluded")
    )
    assert np.array_equal(met[0][1], met[1][1]) and np.array_equal(*hidden)
    return met[0][1], hidden[0]


@pytest.mark.parametrize(("scale", "far"), PLACES)
@pytest.mark.parametrize("body", ["ball", "spheres", "floor", "wide floor"])
def test_no_ray_meets_the_convex_thing_that_it_leaves_outwards(ball, make_mesh, make_spheres, body, scale, far):
    rng, count, matrix = np.random.default_rng(1), 20_000, placing(scale, far)
    extent = 1e4 if body == "wide floor" else 3.0
    bodies = {"ball": lambda: ball(20), "spheres": lambda: make_spheres([[0, 0, 0]], 1.0)}
    core = core_of(bodies.get(body, lambda: make_mesh(SQUARE * extent, HALVES))(), matrix)
    eyes = np.array([0.3, 2.5, 1.6]) + rng.normal(size=(count, 3)) * 0.1
    aims = rng.normal(size=(count, 3)) * 0.5 * ([1, 1, 0] if "floor" in body else [1, 1, 1])
    rays = rays_at(core, matrix, eyes, aims)
    _, normals, _, _, _ = core.leaving(rays, np.array([0.0, 0.0, 1.0]))
    directions = onwards(np.nan_to_num(normals), rng)
    _, _, _, starts, _ = core.leaving(rays, directions)
    values = np.isfinite(starts).all(axis=1)
    assert values.sum() > 0.5 * count
    met, hidden = traced(core, starts[values], directions[values])
    assert not hidden.any() and (met < 0).all(), f"{hidden.sum()} of {values.sum()} rays meet what they leave"


@pytest.mark.parametrize("shape", SHAPES)
@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, size=st.integers(-4, 3), scale=st.integers(-6, 6), users=st.sampled_from([1, 2]))
def test_no_ray_meets_the_triangle_it_leaves_at_any_size_distance_and_scale(make_mesh, shape, seed, size, scale, users):
    rng, count = np.random.default_rng(seed), 3000
    turn, middle = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)
    corners = np.column_stack([SHAPES[shape], np.zeros(3)]) * 10.0 ** (size + scale) @ turn
    corners += middle / np.abs(middle).max() * 10.0**scale
    core = core_of(make_mesh(corners, [[0, 1, 2]]), np.eye(4), users)
    eye = corners.mean(axis=0) + turn[2] * 10.0 ** (size + scale)
    rays = core.rays(eye, rng.dirichlet((0.5, 0.5, 0.5), count) @ corners - eye)
    directions = onwards(np.broadcast_to(turn[2], (count, 3)), rng, rng.choice([-1, 1], count))
    _, _, _, starts, _ = core.leaving(rays, directions)
    met = np.isfinite(starts).all(axis=1)
    assert met.sum() > 0.5 * count, f"only {met.sum()} rays meet the triangle"
    again, hidden = traced(core, starts[met], directions[met])
    assert not hidden.any() and (again < 0).all(), f"{hidden.sum()} of {met.sum()} rays"


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("far", [0.0, 1e3])
def test_rays_that_start_on_the_surface_itself_meet_it(ball, scale, far):
    rng, matrix = np.random.default_rng(2), placing(scale, far)
    core = core_of(ball(20), matrix)
    rays = rays_at(core, matrix, np.full((5000, 3), 2.0), rng.normal(size=(5000, 3)) * 0.4)
    points, normals, _, _, _ = core.leaving(rays, np.array([0.0, 0.0, 1.0]))
    met, _ = traced(core, points, onwards(normals, rng))
    assert (met >= 0).mean() > 0.02, f"{(met >= 0).mean():.1%}: without an offset a good part of the rays must meet their start"


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, scale=st.integers(-6, 6), far=st.sampled_from([0.0, 1.0, 100.0]))
def test_a_wall_two_offsets_off_is_not_stepped_over(make_mesh, seed, scale, far):
    """The start is one offset off the floor. Start and wall are rounded by less than the other one."""
    rng, count = np.random.default_rng(seed), 500
    matrix = placing(10.0**scale, far * 10.0**scale)
    floor = make_mesh(SQUARE, HALVES)
    rays = rays_at(core_of(floor, matrix), matrix, np.full((count, 3), 2.0), rng.uniform(-0.9, 0.9, (count, 3)) * [1, 1, 0])
    up = matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    core = core_of(floor, matrix)
    points, _, _, starts, _ = core.leaving(rays, up)
    offset = np.linalg.norm(starts - points, axis=1).max() / 10.0**scale
    # On paper: at most 40 roundings of the largest coordinate and the longest side, 1 + far and 3.
    assert 0 < offset < 64 * FLOAT64 * (4 + far), f"{offset:.1e}"
    both = make_mesh(np.concatenate([SQUARE, SQUARE + np.array([0, 0, 2 * offset])]), [*HALVES, [4, 5, 6], [4, 6, 7]])
    wall = core_of(both, matrix)
    assert np.array_equal(wall.origin, core.origin)
    rows = np.column_stack([starts, np.tile(up, (count, 1)), np.zeros(count), np.full(count, np.inf)])
    _, objects, primitives = wall.closest(rows)
    assert ((objects == 0) & (primitives >= 2)).all(), f"{(primitives < 2).sum()} of {count} rays do not meet the wall"


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, exponent=st.integers(-20, 20))
def test_offsets_scale_with_the_scene(make_mesh, seed, exponent):
    rng = np.random.default_rng(seed)
    corners, eye = rng.normal(size=(3, 3)), np.full(3, 9.0)
    aims = rng.dirichlet((2, 2, 2), 20) @ corners
    moved = []
    for factor in (1.0, 2.0**exponent):
        core = core_of(make_mesh(corners * factor, [[0, 1, 2]]), np.eye(4))
        moved.append(core.leaving(core.rays(eye * factor, (aims - eye) * factor), np.array([0.0, 0.0, 1.0]))[3] / factor)
    assert np.array_equal(*moved, equal_nan=True)


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e4])
@pytest.mark.parametrize("extent", [3.0, 1e4])
def test_a_light_in_or_just_before_a_wall_is_seen_and_one_just_behind_it_is_not(make_mesh, scale, extent):
    """Lights 1e-10 of the way off a ceiling, also one that reaches far, and lights that touch it, seen from a floor."""
    rng, count, matrix = np.random.default_rng(0), 5000, placing(scale, 0.0)
    mesh = make_mesh(np.concatenate([SQUARE * 3, SQUARE * extent + np.array([0, 0, 2])]), [*HALVES, *(np.array(HALVES) + 4)])
    core = core_of(mesh, matrix)
    rays = rays_at(core, matrix, np.tile([0.3, 2.5, 1.9], (count, 1)), rng.uniform(-2, 2, (count, 3)) * [1, 1, 0])
    points, _, _, _, _ = core.leaving(rays, np.array([0.0, 0.0, 1.0]))
    lights = np.column_stack([rng.uniform(-1, 1, (count, 2)), np.full(count, 2.0)])
    for rise, hidden in ((-1e-10, False), (0.0, False), (1e-10, True)):
        if extent > 10:
            # The far corners of a turned ceiling of 1e4 are rounded by 1e-12: what touches it on paper need not touch it.
            rise *= 100
            if not rise:
                continue
        apart = (lights + np.array([0, 0, 2 * rise])) @ matrix[:3, :3].T - points
        distance = np.linalg.norm(apart, axis=1)
        directions = apart / distance[:, None]
        _, _, _, starts, lengths = core.leaving(rays, directions, distance)
        _, blocked = traced(core, starts, directions, lengths)
        assert (blocked == hidden).all(), f"{rise}: {(blocked != hidden).sum()} of {count} lights"


def test_a_room_with_a_hole_is_left_and_a_closed_one_is_not(ball):
    rng = np.random.default_rng(4)
    whole = ball(20)
    kept = whole.vertices[whole.triangles].mean(axis=1)[:, 2] < 0.9
    half = Mesh(whole.vertices, whole.triangles[kept], whole.materials[kept])
    left = []
    for mesh in (whole, half):
        core = core_of(mesh, np.eye(4))
        rays = core.rays(np.zeros((20_000, 3)), rng.normal(size=(20_000, 3)))
        _, normals, _, _, _ = core.leaving(rays, np.array([0.0, 0.0, 1.0]))
        inside = np.isfinite(normals[:, 0])
        directions = onwards(np.nan_to_num(normals), rng)
        _, _, _, starts, _ = core.leaving(rays, directions)
        left.append(int((~traced(core, starts[inside], directions[inside])[1]).sum()))
    assert left[0] == 0 and left[1] > 20, f"{left[0]} rays leave the closed ball, {left[1]} the one with a hole"
