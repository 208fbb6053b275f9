"""Kernels of light: what they return is what NumPy's functions return, to the last bits.

They compute the same operations in the same order, so most agree bit for bit. Sine, cosine and arcsine are series of their own,
off by up to 3 units in the last place, as NumPy's are by up to 4: SERIES is what becomes of these in a direction, three sums of
products. Where a rectangle is sampled by its solid angle, a sum known to some 1e-15, all that follows is relative to it.
"""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import compiled
from viewcam_addon.tracer.compiled import standing
from viewcam_addon.tracer.light import emitters, filters, paths, sampler, scattering
from viewcam_addon.tracer.light.adaptive import estimate, interior
from viewcam_addon.tracer.light.sampler import Sampler
from viewcam_addon.tracer.light.sums import COLOUR, DIRECT, EMITTED, Light, Sums, add_samples
from viewcam_addon.tracer.rays import points, space
from viewcam_addon.tracer.rays.points import Surfaces
from viewcam_addon.tracer.rays.space import Space
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene.film import Film
from viewcam_addon.tracer.scene.lamps import Area, Point, Spot, Sun, World
from viewcam_addon.tracer.scene.materials import Colour, Material

SEEDS = st.integers(0, 2**32 - 1)
SERIES = 16 * 2.0**-53
ANGLE = 1e-15 / 1e-6  # plates.py samples no solid angle below 10⁻⁶

pytestmark = pytest.mark.skipif(not compiled.AVAILABLE, reason="numba or embreex is not installed, or turned off")


def both(function, *arguments):
    """What the kernel returns, and what NumPy's function does."""
    return function(*arguments), function.plain(*arguments)


def assert_same_points(found, expected):
    for name in ("position", "normal", "shading", "backside", "material", "primitive", "offset", "uv", "vertex_colour"):
        one, other = getattr(found, name), getattr(expected, name)
        assert (one is None) == (other is None), name
        assert one is None or (np.array_equal(one, other, equal_nan=True) and one.dtype == other.dtype), name


@pytest.fixture(scope="session")
def stage(random_scene):
    """stage(seed) → Surfaces, triangles of theirs, and points of the view plane."""

    def build(seed, count=300):
        scene, rng = random_scene(seed), np.random.default_rng(seed)
        tracer = Tracer(scene)
        surfaces = Surfaces(scene, tracer._view, tracer._triangles, tracer._planes, tracer._ellipsoids)
        return surfaces, rng.integers(0, tracer._triangles.count, count), rng.normal(size=(2, count)), rng

    return build


@settings(max_examples=15)
@given(seed=SEEDS)
def test_points_that_the_eye_sees_are_the_same_bit_for_bit(stage, seed):
    surfaces, triangles, (x, y), _ = stage(seed)
    assert_same_points(*both(points.triangles_seen, surfaces, triangles, x, y))


@settings(max_examples=15)
@given(seed=SEEDS)
def test_points_that_scattered_rays_meet_are_the_same_bit_for_bit(stage, seed):
    surfaces, triangles, _, rng = stage(seed)
    origins, ways = rng.normal(size=(2, 3, len(triangles)))
    (found, distances), (expected, as_far) = both(points.triangles_met, surfaces, triangles, origins, ways)
    assert_same_points(found, expected)
    assert np.array_equal(distances, as_far, equal_nan=True)


@settings(max_examples=15)
@given(seed=SEEDS)
def test_packets_of_scattered_rays_meet_what_embreex_meets_ray_by_ray(stage, seed):
    surfaces, triangles, (x, y), rng = stage(seed, 1000)
    at, ways = points.triangles_seen(surfaces, triangles, x, y), rng.normal(size=(3, 1000))
    sight = Space(surfaces)._sight("diffuse")
    given_rays = sight._embree, sight._unit, at, ways / np.sqrt((ways**2).sum(axis=0))
    distances = rng.exponential(size=1000)
    for function, more in ((space.first_triangles, ()), (space.any_triangle, ()), (space.triangle_before, (distances,))):
        found, expected = both(function, *given_rays, *more)
        assert np.array_equal(found, expected), f"{function.__name__}: {(found != expected).sum()} of 1000"
    lengths, as_long = both(space.shadow_lengths, sight._unit, *given_rays[2:], distances)
    assert np.array_equal(lengths, as_long), f"{(lengths != as_long).sum()} of 1000 lengths"


def lamps_of(rng, count):
    """Lamps of all kinds, of any size, here and there."""

    def matrix():
        turned = np.eye(4)
        turned[:3, :3], turned[:3, 3] = (
            np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.5, 2, 3),
            rng.normal(size=3) * 3,
        )
        return turned

    def size():
        return float(rng.choice([0.0, 1e-3, 0.3, 3.0]))

    make = (
        lambda: Sun("sun", towards=tuple(rng.normal(size=3)), irradiance=(3, 2, 1), angle=min(size(), 2.0)),
        lambda: Point(
            "point", position=tuple(rng.normal(size=3)), power=(3, 2, 1), radius=size(), soft_falloff=rng.random() < 0.5
        ),
        lambda: Spot("spot", matrix=matrix(), power=(3, 2, 1), radius=size(), angle=rng.uniform(0.1, 3), blend=rng.random()),
        lambda: Area("area", matrix=matrix(), size=tuple(rng.uniform(0.1, 4, 2)), power=(3, 2, 1), ellipse=rng.random() < 0.5),
    )
    return [make[rng.integers(len(make))]() for _ in range(count)]


def samples_apart(lighting, seed, rows=None, asked=lambda *_: ()):
    """How far the kernel's samples of 200 points are from NumPy's: name → (3, n) or (n,), relative to 1 or to what they are."""
    rng = np.random.default_rng(seed)
    at, u = lighting.points(rng.normal(size=(3, 200)) * 2, rng.normal(size=(3, 200)), 200), rng.random((3, 200))
    lighting.emitters.rows = rows
    found, expected = both(emitters.aimed, lighting.emitters, at, u, *asked(lighting.emitters, at))
    assert np.array_equal(found.shadowed, expected.shadowed) and np.array_equal(found.pdf, expected.pdf)
    apart = {}
    for name in ("direction", "distance", "light"):
        one, other = getattr(found, name), getattr(expected, name)
        with np.errstate(invalid="ignore"):  # suns are infinitely far off
            apart[name] = np.where(one == other, 0.0, np.abs(one - other) / np.maximum(np.abs(other), 1.0))
    return apart


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, count=st.sampled_from([1, 2, 5, 40]))
def test_lamps_of_all_kinds_are_sampled_the_same_to_a_few_roundings(make_lighting, seed, count):
    lighting = make_lighting(*lamps_of(np.random.default_rng(seed), count))
    for name, apart in samples_apart(lighting, seed).items():
        assert np.median(apart) <= SERIES and (apart <= ANGLE).mean() > 0.999, (name, np.median(apart), apart.max())


def one_of_them(lamp):
    return lambda all_emitters, at: (lamp, all_emitters.brightest(at))


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, count=st.sampled_from([1, 2, 4]))
def test_a_lamp_that_is_asked_by_itself_is_sampled_the_same_to_a_few_roundings(make_lighting, seed, count):
    lighting = make_lighting(*lamps_of(np.random.default_rng(seed), count))
    for lamp in range(lighting.emitters.count):
        for name, apart in samples_apart(lighting, seed, asked=one_of_them(lamp)).items():
            # Of points whose chance is within a rounding of their number, one side leaves the lamp out and the other does not.
            assert np.median(apart) <= SERIES and (apart <= ANGLE).mean() > 0.999, (name, np.median(apart), apart.max())


@settings(max_examples=10, deadline=None)
@given(seed=SEEDS)
def test_a_lamp_that_is_a_millionth_too_bright_or_beside_its_place_is_told(make_lighting, seed):
    from viewcam_addon.tracer.kernels.lamps import table_of

    lighting = make_lighting(*lamps_of(np.random.default_rng(seed), 2))
    rows = table_of(lighting.emitters.lamps, lighting.emitters.glowing)
    rows[:, 1:8] *= 1 + 1e-6  # colours and places
    apart = samples_apart(lighting, seed, rows)
    assert any((apart[name] > ANGLE).mean() > 0.01 for name in apart), {name: one.max() for name, one in apart.items()}


@settings(max_examples=20)
@given(seed=SEEDS, weighed=st.booleans())
def test_what_surfaces_receive_is_the_same_bit_for_bit(make_lighting, seed, weighed):
    rng = np.random.default_rng(seed)
    lighting = make_lighting(*lamps_of(rng, 3))
    at, u = lighting.points(rng.normal(size=(3, 200)), rng.normal(size=(3, 200)), 200), rng.random((3, 200))
    aimed = emitters.aimed.plain(lighting.emitters, at, u)._replace(pdf=rng.exponential(size=200))
    (factor, bright), (as_much, there) = both(emitters.received, at, aimed, rng.random(200), weighed)
    assert np.array_equal(factor, as_much)
    assert np.array_equal(np.arange(200)[bright], np.arange(200)[there])


@pytest.mark.parametrize("everywhere", [True, False])
@pytest.mark.parametrize("weighted", [True, False])
def test_what_is_received_is_added_the_same_bit_for_bit(everywhere, weighted):
    rng, sums = np.random.default_rng(3), []
    places = rng.permutation(300)
    which = slice(None) if everywhere else np.sort(rng.permutation(300)[:200])
    count = 300 if everywhere else 200
    bright = slice(None) if everywhere else np.sort(rng.permutation(count)[:90])
    hidden = rng.random(count if everywhere else 90) < 0.4
    radiance, factor = rng.random((3, count)), rng.random(count)
    colour, weight = rng.random((3, 300)), rng.random((3, 300)) if weighted else None
    for add in (paths.add_received, paths.add_received.plain):
        light = Light(300, [EMITTED, DIRECT])
        add(light, light.place(DIRECT) + places, which, bright, hidden, radiance, factor, colour, weight)
        sums.append(light.values)
    assert np.array_equal(*sums) and sums[0].any()


@settings(max_examples=20)
@given(seed=SEEDS, samples=st.sampled_from([1, 7, 64, 70_000]), first=st.integers(0, 30), count=st.integers(1, 5))
def test_random_numbers_are_the_same_bits(seed, samples, first, count):
    made, rng = Sampler(seed, samples), np.random.default_rng(seed)
    pixels, some = rng.integers(0, 2**32, 50), rng.integers(0, samples, 50)
    assert np.array_equal(*both(sampler.scrambled, made, pixels, some, first, count))
    assert np.array_equal(*both(sampler.scrambled, made, pixels, int(some[0]), first, count))
    assert np.array_equal(*both(sampler.scrambled_grid, made, pixels, some[:5], first, count))


@settings(max_examples=20)
@given(seed=SEEDS)
def test_directions_by_lamberts_law_are_the_same_to_a_few_roundings(seed):
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(3, 200))
    normal /= np.sqrt((normal**2).sum(axis=0))
    u = np.concatenate([rng.random((2, 197)), [[0, 1 - 2.0**-53, 0.5], [0, 0.5, 1 - 2.0**-53]]], axis=1)
    (found, density), (expected, as_often) = both(scattering.cosine_direction, normal, u)
    # Where the sum of the normal and a point of the sphere nearly vanishes, its direction is as uncertain as it is short.
    assert (np.abs(found - expected) <= SERIES * 2 / (2 * np.pi * as_often)).all()
    assert (np.abs(density - as_often) <= SERIES).all()


def test_places_on_the_film_are_the_same_bits():
    u = np.concatenate([np.random.default_rng(0).random((2, 1000)), [[0.0, 1 - 2.0**-53], [0.5, 2.0**-53]]], axis=1)
    assert np.array_equal(*both(filters.spread, u, 1.5))


def test_series_of_sine_cosine_and_arcsine_are_right_to_three_units():
    from viewcam_addon.tracer.kernels.vectors import arcsine, turned

    numbers = [*np.random.default_rng(0).uniform(-1, 1, 2000), 0.0, 0.25, 0.5, 0.75, -1.0, 1.0, 1e-300]
    with mpmath.workprec(100):
        for u in map(float, numbers):
            # Beside their own unit, those of the circle have the rounding of their angle, π/4 at most.
            cosine, sine = turned(u)
            assert (
                max(abs(cosine - mpmath.cospi(2 * mpmath.mpf(u))), abs(sine - mpmath.sinpi(2 * mpmath.mpf(u)))) <= 3 * 2.0**-53
            ), u
            assert abs(arcsine(u) - mpmath.asin(u)) <= 6 * 2.0**-53 * abs(mpmath.asin(u)), u


@pytest.mark.parametrize("level", ["direct", "path"])
def test_a_picture_is_the_same_to_float32_but_for_what_a_rounding_decides(make_lit, ball, level):
    """Directions that differ by 1e-16 end in another triangle once in some 10⁹ rays: of 1024 pixels hardly one may differ."""
    camera = Pinhole((0, -4, 1), (0, 0, 0), (0, 0, 1), 40, 32, 32)
    lamps = [Sun("sun", towards=(1, -1, 2), angle=0.1), Point("point", position=(-2, -2, 2), power=(50, 40, 30), radius=0.3)]
    scene = make_lit(camera, (ball(12), Material(diffuse=Colour((0.8, 0.5, 0.3)))), lamps=lamps, world=World((0.2, 0.3, 0.4)))
    found = Tracer(scene, 1).render_light(level, 4, 0)["Combined"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(standing, "AVAILABLE", False)
        expected = Tracer(scene, 1).render_light(level, 4, 0)["Combined"]
    apart = np.abs(found - expected).max(axis=-1) / expected[..., :3].max()
    assert (apart > 2.0**-23).sum() <= 1, (apart.max(), (apart > 2.0**-23).sum())
    assert expected[..., :3].any()


@pytest.mark.parametrize("samples", [1, 3, 16])
def test_sums_are_the_same_bit_for_bit(samples):
    found, expected = (Sums(50, [EMITTED, COLOUR, DIRECT], Film(), 40) for _ in range(2))
    for seed in range(3):
        rng = np.random.default_rng(seed)
        values, covered = rng.random((3, 3, 50, samples)), rng.random((50, samples)) < 0.5
        for sums, add in ((found, add_samples), (expected, add_samples.plain)):
            add(sums, values, covered)
            sums.taken += samples
        assert np.array_equal(found.state, expected.state), seed


@pytest.mark.parametrize("film", [Film("BOX"), Film()])
def test_second_differences_are_the_same_bit_for_bit(film):
    light = np.random.default_rng(3).normal(size=(4, 13, 17))
    assert np.array_equal(*both(interior.bends, light))
    assert np.array_equal(*both(interior.correction, light[0], film))


def test_what_is_around_pixels_is_the_same_to_a_few_roundings():
    rng = np.random.default_rng(4)
    values, known, pixels = rng.random((13, 17)), rng.random((13, 17)) < 0.6, rng.integers(0, 13 * 17, 40)
    found, expected = both(estimate.mean_around, values, known, pixels)
    assert found == pytest.approx(expected, rel=32 * 2.0**-53, abs=32 * 2.0**-53), "sums of 25"
