"""Area lamps against Lambert's formula for polygons, the form factors of discs, and what rays see of them.

Means of n samples must lie within 3 standard errors, taken as if the samples were independent, which overstates them.
"""

import numpy as np
import pytest
from core_probes import SampledLight
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from viewcam_addon.tracer.scene.lamps import Area

SEEDS = st.integers(0, 2**32 - 1)
SCALES = st.integers(-6, 6)


def placed(linear, position=(0, 0, 0)):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, position
    return matrix


def down(height, **more):
    """A lamp above the origin that shines down, 1 × 1, of the radiance 1 unless `more` says otherwise."""
    size = more.pop("size", (1, 1))
    area = size[0] * size[1] * (np.pi / 4 if more.get("ellipse") else 1)
    return Area("area", matrix=placed(np.eye(3), (0, 0, height)), size=size, power=(np.pi * area,) * 3, **more)


def corners_of(lamp):
    sides = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2 * lamp.size
    return sides @ lamp.matrix[:3, :2].T + lamp.matrix[:3, 3]


def from_before(rng, lamp, distance):
    """A place that the lamp shines on, and a normal there that sees some of it."""
    normal = np.cross(lamp.matrix[:3, 0], lamp.matrix[:3, 1])
    normal *= -np.sign(normal @ lamp.matrix[:3, 2]) / np.linalg.norm(normal)
    corners = corners_of(lamp)
    size = np.linalg.norm(corners[0] - corners[2])
    position = lamp.matrix[:3, 3] + size * distance * (normal + rng.normal(size=3) * 0.3 * normal.max())
    side = (position - lamp.matrix[:3, 3]) @ normal
    position += normal * max(0, 0.2 * size * distance - side)
    return position, (corners.mean(axis=0) - position) / size / distance + rng.normal(size=3) * 0.5


@settings(max_examples=60)
@given(seed=SEEDS, scale=SCALES, log_distance=st.floats(-1.5, 2), shear=st.sampled_from([0.0, 0.5]))
def test_a_rectangle_anywhere_gives_what_lambert_says(make_lighting, polygon_irradiance, seed, scale, log_distance, shear):
    """Also a mirrored one, and the parallelogram that shear makes of one. Where little of it is above the horizon, an error of
    3 standard errors may be a large part of what it gives, but not of what it would give a surface that faces it."""
    rng = np.random.default_rng(seed)
    linear = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ np.diag(rng.uniform(0.2, 2, 3) * rng.choice([-1, 1], 3))
    linear[:, 0] += shear * linear[:, 1]
    lamp = Area("area", matrix=placed(linear * 10.0**scale), size=(1.5, 0.5), power=(2, 1, 1))
    position, normal = from_before(rng, lamp, 10**log_distance)
    expected = polygon_irradiance(corners_of(lamp) - position, normal) * 2 / (np.pi * lamp.area)
    whole = polygon_irradiance(corners_of(lamp) - position, lamp.matrix[:3, 3] - position) * 2 / (np.pi * lamp.area)
    mean, error = make_lighting(lamp).irradiance(position, normal)
    assert error <= (0.1 if shear else 0.02) * whole, (mean, error, whole)
    assert abs(mean - expected) <= 3 * error + 1e-9 * whole, (mean, error, expected)


@pytest.mark.parametrize(("a", "b", "c"), [(1, 1, 1), (3, 0.5, 0.2), (0.1, 0.2, 5)])
def test_a_rectangle_over_a_parallel_and_a_perpendicular_surface(make_lighting, off_by, a, b, c):
    """The form factors of a rectangle a × b from below one of its corners, at the distance c (Howell's catalog, B-3, B-4)."""
    x, y = a / c, b / c
    rx, ry = np.hypot(1, x), np.hypot(1, y)
    parallel = (x / rx * np.arctan(y / rx) + y / ry * np.arctan(x / ry)) / 2
    perpendicular = (np.arctan(x) - np.arctan(x / ry) / ry) / 2
    lighting = make_lighting(down(c, size=(a, b)))
    corner = (-a / 2, -b / 2, 0)
    assert abs(off_by(lighting.irradiance(corner, (0, 0, 1)), parallel, 0.02)) <= 3
    assert abs(off_by(lighting.irradiance(corner, (0, 1, 0)), perpendicular, 0.04)) <= 3


@pytest.mark.parametrize("radius", [0.02, 0.3, 1.0, 5.0])
@pytest.mark.parametrize("aside", [0.0, 0.5, 3.0])
def test_a_disc_over_a_parallel_and_a_perpendicular_surface(make_lighting, off_by, radius, aside):
    """The form factors of a disc, at the height 1, `aside` from its axis (Howell's catalog, B-12, B-13)."""
    lighting = make_lighting(down(1, size=(2 * radius, 2 * radius), ellipse=True))
    z = 1 + aside**2 + radius**2
    root = np.sqrt(z * z - 4 * aside**2 * radius**2)
    irradiance = lighting.irradiance((aside, 0, 0), (0, 0, 1))
    assert abs(off_by(irradiance, np.pi * (1 - (1 + aside**2 - radius**2) / root) / 2, 0.04)) <= 3, irradiance
    if aside > radius:
        irradiance = lighting.irradiance((aside, 0, 0), (-1, 0, 0))
        assert abs(off_by(irradiance, np.pi / (2 * aside) * (z / root - 1), 0.04)) <= 3, irradiance


@pytest.mark.parametrize("ellipse", [False, True])
@pytest.mark.parametrize("height", [1e-9, 1e-4, 0.3, 4.0, 2e3])
@pytest.mark.parametrize("aside", [0.0, 0.9, 1.1])
def test_every_sample_looks_where_rays_run_into_the_lamp(make_lighting, ellipse, height, aside):
    """The samples' distances are those of the plane, as far as 1e-9 of the size allows to know."""
    lamp = down(height, size=(2, 3), ellipse=ellipse)
    lighting = make_lighting(lamp)
    aimed, _ = lighting.aimed((aside, 0.2, 0), (0, 0, 1), 500)
    there = aimed.light[0] > 0
    assert there.mean() > 0.5  # of an ellipse seen from just outside, less than its π/4
    ahead = aimed.direction[:, there]
    at = np.array([[aside], [0.2], [0]]) + ahead * aimed.distance[there]
    assert at[2] == pytest.approx(np.full(there.sum(), height), rel=1e-6, abs=1e-15 * 10)
    inside = np.linalg.norm(at[:2] / [[1], [1.5]], axis=0) if ellipse else np.abs(at[:2] / [[1], [1.5]]).max(axis=0)
    assert inside.max() <= 1 + 1e-9
    inner = inside < 1 - 1e-6
    seen = lighting.seen(np.tile([[aside], [0.2], [0.0]], inner.sum()), ahead[:, inner])
    assert seen[0] == pytest.approx(np.ones(inner.sum()), rel=1e-12)


@pytest.mark.parametrize("spread", [0.08, 1.0, 2.5])
@pytest.mark.parametrize(("size", "ellipse", "height"), [((2, 3), False, 0.5), ((2, 3), True, 0.5), ((1e-3, 1e-3), False, 1.0)])
def test_a_spread_is_a_grid_of_slats_that_costs_no_light(make_lighting, spread, size, ellipse, height):
    """Light at an angle a falls as tan of half the spread less tan a, and all of it is what it would be without."""
    lamp = down(height, size=size, ellipse=ellipse, spread=spread)
    lighting = make_lighting(lamp)
    cosine = np.cos(spread / 2 * np.linspace(0.01, 1.2, 40))
    cosine = cosine[cosine > 0]
    straight = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, cosine])
    start = np.array([[0.0], [0.0], [height]]) - straight * (height / cosine)
    seen = np.array([lighting.seen(start[:, [i]], straight[:, [i]])[0, 0] for i in range(cosine.size)])
    slope = np.maximum(np.tan(spread / 2) - np.sqrt(1 - cosine**2) / cosine, 0)
    assert seen == pytest.approx(seen[0] * slope / slope[0], rel=1e-9, abs=1e-12)
    angle = np.linspace(0, spread / 2, 20001)
    flux = (np.maximum(np.tan(spread / 2) - np.tan(angle), 0) * np.cos(angle) * np.sin(angle)).mean() * spread / 2
    assert 2 * np.pi * seen[0] / slope[0] * flux == pytest.approx(
        np.pi, rel=2e-3
    )  # Cycles' series for small ones is off by 1e-3
    aimed, _ = lighting.aimed((0.2 * size[0], 0.1 * size[1], 0), (0, 0, 1), 2000)
    back = lighting.seen(np.tile([[0.2 * size[0]], [0.1 * size[1]], [0.0]], 2000), aimed.direction)[0]
    lit = aimed.light[0] > 0
    assert ((back > 0) == lit).mean() > 0.999 and lit.any()
    assert aimed.light[0, lit] * aimed.pdf[lit] == pytest.approx(back[lit], rel=1e-6)
    assert (aimed.estimate > 0).all()


def on_rectangle(x, y, depth, u):
    """Places on a rectangle that are spread over the solid angle it fills, seen from the origin, and that angle of each."""
    matrix = np.diag([1.0, -1.0, -1.0, 1.0])  # shines up
    matrix[:3, 3] = np.mean(x), np.mean(y), depth
    lamp = Area("area", matrix=matrix, size=(x[1] - x[0], y[1] - y[0]), power=(1, 1, 1))
    aimed = SampledLight(lamp, np.zeros(3), np.array([0.0, 0.0, -1.0]), u)
    return (aimed.direction * aimed.distance)[:2], 1 / aimed.pdf


@settings(max_examples=50)
@given(seed=SEEDS, log_depth=st.floats(-6, 2))
def test_points_of_a_rectangle_are_as_frequent_as_the_solid_angle_of_where_they_lie(seed, log_depth):
    """A piece of the rectangle that fills p of its solid angle gets p n of n points, binomially."""
    rng = np.random.default_rng(seed)
    count = 20_000
    x, y = np.sort(rng.normal(size=(2, 2)) * 2, axis=1)
    depth = -(10.0**log_depth)
    (px, py), whole = on_rectangle(x, y, depth, rng.random((2, count)))
    assume(np.ptp(whole) == 0)  # one that is far away is sampled by its area
    piece = np.sort(rng.uniform([[x[0]], [y[0]]], [[x[1]], [y[1]]], (2, 2)), axis=1)
    _, part = on_rectangle(*piece, depth, np.full((2, 2), [0.3, 0.7]))
    assume(np.ptp(part) == 0)
    share = part[0] / whole[0]
    hits = ((px > piece[0, 0]) & (px < piece[0, 1]) & (py > piece[1, 0]) & (py < piece[1, 1])).mean()
    # 4 standard errors: fifty examples are looked at. The solid angle itself is known to 1e-15.
    assert abs(hits - share) <= 4 * np.sqrt(share / count) + 1e-14 / whole[0], (hits, share)


def test_the_solid_angle_of_a_rectangle_is_that_of_the_pieces_of_a_cube():
    """Each side of a cube fills a sixth of the sphere; four quarters of a side fill as much as it."""
    middle = np.full((2, 1), 0.5)
    _, angle = on_rectangle((-1, 1), (-1, 1), -1, middle)
    assert angle[0] == pytest.approx(4 * np.pi / 6, rel=2e-15)
    _, quarter = on_rectangle((0, 1), (0, 1), -1, middle)
    assert quarter[0] == pytest.approx(angle[0] / 4, rel=2e-15)


def test_a_lamp_shines_to_one_side_even_when_it_is_mirrored(make_lighting):
    for scale in ((1, 1, 1), (-1, 1, 1), (1, 1, -1), (-1, -1, -1)):
        lamp = Area("area", matrix=placed(np.diag(scale), (0, 0, 0)), power=(1, 1, 1))
        lighting = make_lighting(lamp)
        for side in (-1, 1):
            shines = side == -scale[2]
            assert bool(lighting.irradiance((0.1, 0.2, side), (0, 0, -side))[0] > 0) == shines, (scale, side)
            start, ahead = np.array([[0.1], [0.2], [side]]), np.array([[0.0], [0.0], [-side]])
            assert bool(lighting.seen(start, ahead).any()) == shines, (scale, side)


def test_a_lamp_gives_nothing_in_its_own_plane(make_lighting):
    """The plane is known to some 1e-16, and a lamp that is 2 away fills no larger an angle."""
    for ellipse in (False, True):
        for aside, height in ((2.0, 0.0), (0.0, 1e-12), (0.3, 1e-12)):
            aimed, cosine = make_lighting(down(0, ellipse=ellipse)).aimed((aside, 0, height), (-1, 0.1, 0), 64)
            assert (aimed.light * cosine).max() < 1e-14 and np.isfinite(aimed.light).all()


@pytest.mark.parametrize("linear", [np.diag([0, 1, 1]), np.diag([1, 1, 0]), [[1, 1, 0], [0, 0, 0], [0, 0, 1]]])
def test_a_lamp_without_an_area_or_a_direction_is_dark(make_lighting, linear):
    for ellipse in (False, True):
        lamp = Area("area", matrix=placed(linear), power=(1e10,) * 3, ellipse=ellipse)
        assert lamp.is_dark and not make_lighting(lamp).seen(np.zeros((3, 1)), np.array([[0.0], [0.0], [1.0]])).any()


def test_one_percent_of_a_solid_angle_and_uneven_samples_are_told(make_lighting, off_by):
    expected = 4 * (1 / np.sqrt(2)) * np.arctan(1 / np.sqrt(2))  # four times the quarter of 2 × 2 at the height 1
    lighting = make_lighting(down(1, size=(2, 2)))
    assert abs(off_by(lighting.irradiance((0, 0, 0), (0, 0, 1)), expected)) <= 3
    assert abs(off_by(lighting.irradiance((0, 0, 0), (0, 0, 1)), expected * 1.01)) > 3
    assert abs(off_by(lighting.irradiance((0, 0, 0), (0, 0, 1), skew=2.0), expected)) > 3
