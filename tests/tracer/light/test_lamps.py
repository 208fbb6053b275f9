"""Lamps against what is known on paper, with their own samples alone; areas against Lambert's formula and discs' form factors.

A mean of n samples must lie within 3 standard errors of the answer, taken as if the samples were independent, which overstates
them; where nothing is random it must be the answer, to the rounding of some twenty operations.
"""

import numpy as np
import pytest
from core_probes import SampledLight
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from viewcam_addon.tracer.scene.lamps import Area, Point, Spot, Sun

EXACT = 40 * 2.0**-53
SEEDS = st.integers(0, 2**32 - 1)
SCALES = st.integers(-6, 6)


def unit(rng):
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def tilted(rng, axis, angle):
    """A unit vector at an angle to another."""
    aside = np.cross(axis, unit(rng))
    return axis * np.cos(angle) + aside / np.linalg.norm(aside) * np.sin(angle)


def point(power, position, **more):
    return Point("point", position=tuple(position), power=(power, power / 2, 0), **more)


# Suns
@given(seed=SEEDS, angle=st.floats(0, np.pi / 2))
def test_a_sun_without_a_size_gives_its_irradiance_times_the_cosine(make_lighting, seed, angle):
    rng = np.random.default_rng(seed)
    towards = unit(rng)
    lighting = make_lighting(Sun("sun", towards=towards, irradiance=(3, 2, 1)))
    mean, error = lighting.irradiance((1, 2, 3), tilted(rng, towards, angle), 4)
    assert abs(mean - 3 * np.cos(angle)) <= 3 * EXACT and error <= 3 * EXACT


@settings(max_examples=25)
@given(seed=SEEDS, diameter=st.floats(1e-4, 2.0), share=st.floats(0, 1))
def test_a_sun_of_any_size_above_the_horizon_gives_as_much_as_one_without(make_lighting, off_by, seed, diameter, share):
    """The irradiance of a cone is that of its axis: π sin² L cos."""
    rng = np.random.default_rng(seed)
    towards, angle = unit(rng), share * (np.pi - diameter) / 2
    lighting = make_lighting(Sun("sun", towards=towards, irradiance=(3, 2, 1), angle=diameter))
    irradiance = lighting.irradiance((1, 2, 3), tilted(rng, towards, angle))
    assert abs(off_by(irradiance, 3 * np.cos(angle), 0.05 if share > 0.9 else 0.02)) <= 3, irradiance


@pytest.mark.parametrize("angle", [0.0, 0.7, 1.5, 2.5])
def test_a_sun_of_half_the_sky_fades_as_it_sets(make_lighting, off_by, angle):
    """The part of a hemisphere that is above a tilted horizon: (1 + cos)/2, by Lambert's law of the lune."""
    rng = np.random.default_rng(1)
    lighting = make_lighting(Sun("sun", towards=(1, 2, 3), irradiance=(3, 2, 1), angle=np.pi))
    irradiance = lighting.irradiance((1, 2, 3), tilted(rng, np.array((1, 2, 3)) / np.sqrt(14), angle))
    assert abs(off_by(irradiance, 3 * (1 + np.cos(angle)) / 2, 0.1)) <= 3, irradiance


def test_the_disc_of_a_sun_is_as_wide_and_as_bright_as_it_should_be(make_lighting):
    lighting = make_lighting(Sun("sun", towards=(0, 0, 1), irradiance=(3, 2, 1), angle=0.4))
    across = np.array([0.0, 0.1999999, 0.2000001, 1.0])
    ahead = np.stack([np.sin(across), 0 * across, np.cos(across)])
    seen = lighting.seen(np.zeros((3, 4)), ahead)
    assert seen[0] == pytest.approx([3 / (np.pi * np.sin(0.2) ** 2)] * 2 + [0, 0], rel=EXACT)


# Points
@given(seed=SEEDS, scale=SCALES, share=st.floats(0, 1))
def test_a_point_without_a_size_gives_its_power_over_four_pi_squared_distances(make_lighting, seed, scale, share):
    rng = np.random.default_rng(seed)
    size = 10.0**scale
    position, towards, distance = rng.normal(size=3) * size, unit(rng), size * rng.uniform(0.1, 10)
    lighting = make_lighting(point(7.0, position + towards * distance))
    mean, _ = lighting.irradiance(position, tilted(rng, towards, share * np.pi / 2), 4)
    expected = 7 / (4 * np.pi * distance**2)
    # Camera space moves everything by the eye's place, which is about 1: that many roundings more of what is small.
    moved = 1e-15 * (1 + size) / distance
    assert abs(mean - expected * np.cos(share * np.pi / 2)) <= expected * (EXACT + 10 * moved)


@settings(max_examples=40)
@given(seed=SEEDS, scale=SCALES, radius=st.floats(1e-3, 0.99), share=st.floats(0, 1))
def test_a_sphere_above_the_horizon_gives_as_much_as_a_point(make_lighting, off_by, seed, scale, radius, share):
    """π L (R/d)² cos, with L = P/(4π² R²)."""
    rng = np.random.default_rng(seed)
    size = 10.0**scale
    towards, angle = unit(rng), share * np.arccos(radius)
    lighting = make_lighting(point(7.0, towards * size, radius=radius * size))
    irradiance = lighting.irradiance((0, 0, 0), tilted(rng, towards, angle))
    assert abs(off_by(irradiance, 7 / (4 * np.pi * size**2) * np.cos(angle), 0.05)) <= 3, irradiance


@pytest.mark.parametrize("angle", [1.2, 1.5, 1.7, 1.9])
def test_a_sphere_that_is_partly_set_gives_what_is_above_the_horizon(make_lighting, off_by, angle):
    """The form factor of a sphere that the horizon cuts (Naraghi; Howell's catalog B-44), ratio 0.6 of radius to distance."""
    ratio = 1 / 0.6
    root = np.sqrt(ratio**2 - 1)
    cotangent = np.cos(angle) / np.sin(angle)
    rest = np.sin(angle) * np.sqrt(1 - (root * cotangent) ** 2)
    form = (np.cos(angle) * np.arccos(-root * cotangent) - root * rest) / ratio**2 + np.arctan(rest / root)
    rng = np.random.default_rng(2)
    lighting = make_lighting(point(7.0, (0, 0, 2), radius=1.2))
    irradiance = lighting.irradiance((0, 0, 0), tilted(rng, np.array((0.0, 0.0, 1.0)), angle))
    assert abs(off_by(irradiance, form * 7 / (4 * np.pi**2 * 1.2**2), 0.05)) <= 3, irradiance


@given(seed=SEEDS, radius=st.floats(1.001, 100))
def test_inside_a_sphere_every_surface_gets_pi_times_its_radiance(make_lighting, seed, radius):
    rng = np.random.default_rng(seed)
    lighting = make_lighting(point(7.0, unit(rng), radius=radius))
    mean, error = lighting.irradiance((0, 0, 0), unit(rng), 64)
    assert mean == pytest.approx(7 / (4 * np.pi * radius**2), rel=1e-12) and error <= 1e-12 * mean


@pytest.mark.parametrize("radius", [0.0, 0.3, 2.0, 5.0])
@pytest.mark.parametrize("angle", [0.0, 0.15])
def test_a_soft_falloff_makes_a_disc_that_faces_the_point(make_lighting, off_by, radius, angle):
    """π L R²/(d² + R²) cos, as long as the disc is above the horizon."""
    rng = np.random.default_rng(3)
    lighting = make_lighting(point(7.0, (0, 0, 2), radius=radius, soft_falloff=True))
    angle = min(angle, np.arctan(2 / max(radius, 1e-9)))
    irradiance = lighting.irradiance((0, 0, 0), tilted(rng, np.array((0.0, 0.0, 1.0)), angle))
    assert abs(off_by(irradiance, 7 / (4 * np.pi * (4 + radius**2)) * np.cos(angle))) <= 3, irradiance


@settings(max_examples=30)
@given(seed=SEEDS, radius=st.floats(1e-6, 3.0), soft=st.booleans())
def test_every_sample_looks_where_rays_run_into_the_lamp_and_carries_its_radiance(make_lighting, seed, radius, soft):
    """Light over density is one value for all samples: they are even over the solid angle."""
    assume(abs(radius - 2) > 1e-6)  # on the sphere itself, where a rounding decides what is inside
    rng = np.random.default_rng(seed)
    center = unit(rng) * 2
    lighting = make_lighting(point(7.0, center, radius=radius, soft_falloff=soft))
    aimed, cosine = lighting.aimed((0, 0, 0), center, 200)
    ahead = aimed.direction
    inwards = 1e-7 * center[:, None] / 2  # rays along the outline may miss by a rounding
    ahead = (ahead + inwards) / np.linalg.norm(ahead + inwards, axis=0)
    seen = lighting.seen(np.zeros((3, 200)), ahead)
    assert seen[0] == pytest.approx(np.full(200, 7 / (4 * np.pi**2 * radius**2)), rel=1e-12)
    at = ahead * aimed.distance - center[:, None]
    if not soft:
        assert np.linalg.norm(at, axis=0) == pytest.approx(np.full(200, radius), rel=1e-5, abs=1e-6)
    if radius <= 2 or soft:  # else the point is inside
        solid = 2 * np.pi * (1 - (2 / np.hypot(2, radius) if soft else np.sqrt(1 - radius**2 / 4)))
        precision = 1e-15 / (1 - np.sqrt(1 - min(radius**2 / 4, 1.0)))
        assert aimed.light[0] / seen[0] == pytest.approx(np.full(200, solid), rel=max(1e-12, precision))
    else:
        assert aimed.light[0] * cosine == pytest.approx(seen[0] * np.pi, rel=1e-12)


def test_rays_see_a_sphere_between_two_distances_only(make_lighting):
    lighting = make_lighting(point(7.0, (0, 0, 5), radius=1.0))
    ahead = np.array([[0.0], [0.0], [1.0]])
    for nearest, farthest, there in ((0, np.inf, True), (0, 3.9, False), (0, 4.1, True), (4.1, np.inf, False)):
        seen = lighting.seen(np.zeros((3, 1)), ahead, nearest=nearest, farthest=farthest)
        assert bool(seen.any()) == there, (nearest, farthest)
    assert not lighting.seen(np.zeros((3, 1)), -ahead).any()


# Spots
def turned(rng, scale, position):
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ np.diag(scale)
    matrix[:3, 3] = position
    return matrix


@given(
    seed=SEEDS,
    scale=st.tuples(*[st.sampled_from([-2.0, -1.0, 0.3, 1.0, 3.0])] * 3),
    angle=st.floats(0.02, np.pi),
    blend=st.floats(0, 1),
)
def test_a_spot_without_a_size_fades_with_the_angle_in_its_own_space(make_lighting, seed, scale, angle, blend):
    """Smoothstep of (cos α − cos H)/((1 − cos H) blend): facts of Cycles, section 6."""
    rng = np.random.default_rng(seed)
    matrix = turned(rng, scale, (1, 2, 3))
    lighting = make_lighting(Spot("spot", matrix=matrix, power=(7, 1, 1), angle=angle, blend=blend))
    local = np.array([*rng.normal(size=2) * np.tan(angle / 2) * 0.7, -1.0])
    way = matrix[:3, :3] @ local
    cosine = 1 / np.linalg.norm(local)
    edge = np.cos(angle / 2)
    x = np.clip((cosine - edge) / max((1 - edge) * blend, 1e-30), 0, 1)
    expected = 7 / (4 * np.pi * (way @ way)) * x * x * (3 - 2 * x)
    mean, _ = lighting.irradiance(matrix[:3, 3] + way, -way, 2)
    # The roundings of cos α and cos H count 1/((1 − cos H) blend) times as much.
    slope = 1 / max((1 - edge) * blend, 1e-9)
    if abs(cosine - edge) > 1e-12:
        assert mean == pytest.approx(expected, rel=1e-9, abs=7 * slope * 1e-13)


def by_running_into(lighting, position, normal, axis, count=65536):
    """The irradiance of lamps above the horizon, from what rays see that are spread evenly over a hemisphere about `axis`."""
    numbers = np.random.default_rng(8).random((2, count))
    height = numbers[0]
    right = np.cross(axis, (0.3, 0.5, 0.7))
    right /= np.linalg.norm(right)
    around, out = 2 * np.pi * numbers[1], np.sqrt(1 - height**2)
    ahead = (
        np.outer(axis, height) + np.outer(right, out * np.cos(around)) + np.outer(np.cross(axis, right), out * np.sin(around))
    )
    values = lighting.seen(np.outer(position, np.ones(count)), ahead)[0] * np.maximum(normal @ ahead, 0.0) * 2 * np.pi
    return values.mean(), values.std() / np.sqrt(count)


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize(("radius", "angle"), [(0.8, 1.2), (1.3, 0.6), (1.5, 1.2)])
@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 0.5, 1), (1, 1, -1)])
def test_a_spot_with_a_size_gives_what_rays_see_of_it(make_lighting, soft, radius, angle, scale):
    rng = np.random.default_rng(4)
    matrix = turned(rng, scale, (0, 0, 0))
    beam = -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    lighting = make_lighting(Spot("spot", matrix=matrix, power=(7, 1, 1), radius=radius, angle=angle, soft_falloff=soft))
    position = 2 * beam + 0.2 * unit(rng)
    mean, error = lighting.irradiance(position, -beam)
    other, other_error = by_running_into(lighting, position, -beam, -position / np.linalg.norm(position))
    both = np.hypot(error, other_error)
    assert both < 0.05 * other and abs(mean - other) <= 3 * both, (mean, other, both)


# Hostile
def test_a_lamp_where_the_surface_is_gives_numbers(make_lighting):
    matrix = np.eye(4)
    for lamp in (
        point(1e10, (0, 0, 0)),
        point(1e10, (0, 0, 0), radius=1e-30),
        point(1e10, (0, 0, 1), radius=1e-200),
        point(1e10, (0, 0, 0), radius=1.0, soft_falloff=True),
        Spot("spot", matrix=matrix, power=(1e10,) * 3),
        Spot("spot", matrix=matrix, power=(1e10,) * 3, radius=1.0, angle=np.pi),
    ):
        aimed, cosine = make_lighting(lamp).aimed((0, 0, 0), (0, 0, 1), 64)
        values = np.concatenate([aimed.direction, aimed.light, [cosine]])
        assert np.isfinite(values).all() and np.isfinite(aimed.distance).all(), lamp
        assert np.linalg.norm(aimed.direction, axis=0) == pytest.approx(np.ones(64))


def test_dark_lamps_are_not_there(make_lighting):
    flat = np.diag([1.0, 1.0, 0.0, 1.0])
    dark = [point(0.0, (0, 0, 1), radius=1.0), Sun("sun", irradiance=(0, 0, 0)), Spot("spot", matrix=flat)]
    assert all(lamp.is_dark for lamp in dark)
    assert not make_lighting(*dark).seen(np.zeros((3, 1)), np.array([[0.0], [0.0], [1.0]])).any()


def test_lamps_of_next_to_no_size_are_seen_as_numbers_or_not_at_all(make_lighting):
    for size in (1e-320, 1e-200, 1e-99, 1e-30):
        lighting = make_lighting(point(1e18, (0, 0, 1), radius=size), Sun("sun", towards=(0, 0, 1), angle=size))
        assert np.isfinite(lighting.seen(np.zeros((3, 1)), np.array([[0.0], [0.0], [1.0]]))).all()


# Sabotage: 1 % of a solid angle, a cosine, a π
NEAR = (0, 0, 2), (0, 0.3, 1), 7 / (16 * np.pi) / np.hypot(0.3, 1)
"""The place of a lamp of the power 7, the normal of the surface at the origin, and its irradiance."""


def test_one_percent_of_a_constant_is_told(make_lighting, off_by):
    place, normal, expected = NEAR
    for radius in (0.0, 0.7):
        irradiance = make_lighting(point(7.0 * 1.01, place, radius=radius)).irradiance((0, 0, 0), normal)
        assert abs(off_by(irradiance, expected)) > 3, radius


def test_samples_that_are_not_spread_evenly_are_told(make_lighting, off_by):
    place, normal, expected = NEAR
    irradiance = make_lighting(point(7.0, place, radius=1.6)).irradiance((0, 0, 0), normal, skew=1.2)
    assert abs(off_by(irradiance, expected)) > 3, irradiance


@settings(max_examples=40)
@given(seed=SEEDS, radius=st.floats(0.01, 3.0), kind=st.sampled_from(["sun", "point", "soft", "spot", "rectangle", "ellipse"]))
def test_a_sample_is_what_a_ray_sees_over_the_density_with_which_it_was_chosen(make_lighting, seed, radius, kind):
    """`sample_li`, `pdf_li` and `le` agree: weight · pdf = radiance, and the density of the direction is the sample's."""
    rng = np.random.default_rng(seed)
    matrix = np.eye(4)
    matrix[:3, 3] = (0, 0, 2)
    lamp = {
        "sun": Sun("sun", towards=unit(rng), irradiance=(3, 2, 1), angle=min(radius, 3.0)),
        "point": point(7.0, (0, 0, 2), radius=radius),
        "soft": point(7.0, (0, 0, 2), radius=radius, soft_falloff=True),
        "spot": Spot("spot", matrix=matrix, power=(7, 3, 0), radius=radius, angle=1.0, blend=0.3),
        "rectangle": Area("area", matrix=matrix, size=(2 * radius, radius), power=(7, 3, 0)),
        "ellipse": Area("area", matrix=matrix, size=(2 * radius, radius), power=(7, 3, 0), ellipse=True),
    }[kind]
    lighting = make_lighting(lamp)
    aimed, _ = lighting.aimed(rng.uniform(-1, 1, 3) * (1, 1, 0.1), unit(rng), 200, seed % 1000)
    there = aimed.light[0] > 0
    np.testing.assert_allclose(aimed.pdf_of_direction[there], aimed.pdf[there], rtol=1e-6)
    assert (aimed.estimate[there] >= 0).all()


def test_a_lost_cosine_and_a_lost_pi_are_told(make_lighting, off_by):
    place, normal, expected = NEAR
    lighting = make_lighting(point(7.0, place, radius=0.7))
    aimed, _ = lighting.aimed((0, 0, 0), normal)
    light = aimed.light[0]
    assert abs(off_by((light.mean(), light.std() / 64), expected)) > 3
    mean, error = lighting.irradiance((0, 0, 0), normal)
    assert abs(off_by((mean / np.pi, error / np.pi), expected)) > 3


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
    assert there.mean() > 0.5  # an ellipse seen from just outside fills less than its π/4
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
