"""The choice of the light that a point is lit by: whatever it is, the mean is the sum of all lights. A floor, from above."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Tracer, render
from viewcam_addon.tracer.scene.film import Film
from viewcam_addon.tracer.scene.lamps import Area, Point, Spot, Sun, World
from viewcam_addon.tracer.scene.materials import Color, Material, sum_of
from viewcam_addon.tracer.scene.shader_nodes import node

pytestmark = pytest.mark.slow

# Looks at a square meter of floor, so far off that its pixels are alike; lamps stand beside its view.
CAMERA = Pinhole((0, 0, 100), (0, 0, 0), (0, 1, 0), 6400, 64, 64)
WHITE, MIRROR = sum_of(diffuse=Color((1.0, 1.0, 1.0))), sum_of(mirror=Color((1.0, 1.0, 1.0)))


@pytest.fixture(scope="module")
def floor(make_mesh):
    return make_mesh([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2), (0, 2, 3)])


@pytest.fixture(scope="module")
def lit(make_lit, floor):
    """lit(lamp, …, samples=…) → the mean radiance of the floor and its standard error, by the first channel."""

    def measure(*lamps, samples=16, bodies=(), **light):
        scene = make_lit(CAMERA, (floor, WHITE), *bodies, lamps=lamps, film=Film(filter="BOX"), **light)
        passes = {name: values.astype(float) for name, values in render(scene, "direct", samples, 3).items()}
        pixels = passes["Combined"][..., 0]
        return pixels.mean(), np.sqrt(passes["Variance"][..., 0].sum()) / pixels.size

    return measure


def beside(number, radius=0.0):
    """A lamp somewhere above, out of view."""
    rng = np.random.default_rng(number)
    angle, height = rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 6)
    place = (3 * np.cos(angle), 3 * np.sin(angle), height)
    return Point(f"point {number}", position=place, power=(10.0 ** rng.uniform(-1, 3),) * 3, radius=radius)


@pytest.mark.parametrize("count", [2, 4, 5, 32, 33, 100])
@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_many_lamps_give_the_sum_of_what_each_gives(lit, count, radius):
    """One by one up to 4, by what each may bring up to 32, by a tree beyond."""
    lamps = [beside(number, radius) for number in range(count)]
    alone = [lit(lamp, samples=4) for lamp in lamps]
    expected, known = sum(mean for mean, _ in alone), np.sqrt(sum(error**2 for _, error in alone))
    mean, error = lit(*lamps)
    assert error < 0.05 * expected, "that would tell nothing"
    assert abs(mean - expected) <= 4 * np.hypot(error, known) + 1e-6 * expected, f"{mean:.6g} for {expected:.6g} ± {error:.2g}"


def above(number, random_matrix):
    """A lamp of any kind that lights the floor or doesn't: points, spots, squares, ellipses, suns, anyhow turned."""
    rng = np.random.default_rng(number)
    name, power, place = f"lamp {number}", (10.0 ** rng.uniform(-1, 3),) * 3, rng.uniform((2, -3, 0.5), (6, 3, 6))
    matrix = random_matrix(rng)
    matrix[:3, 3] = place
    kind = number % 5
    if kind == 0:
        return Sun(name, towards=rng.normal(size=3), irradiance=(rng.uniform(0, 2),) * 3, angle=rng.uniform(0, 1))
    if kind == 1:
        return beside(number, rng.choice([0.0, 0.3]))
    if kind == 2:
        return Spot(
            name, matrix=matrix, power=power, radius=rng.choice([0.0, 0.5]), angle=rng.uniform(0.1, 3), blend=rng.uniform()
        )
    spread = rng.choice([np.pi, 1.5])
    return Area(name, matrix=matrix, size=rng.uniform(0.1, 2, 2), power=power, ellipse=bool(kind == 3), spread=spread)


@pytest.mark.parametrize("shader", [node("diffuse"), node("glossy", roughness=0.3, distribution="ggx"), node("translucent")])
def test_many_lamps_of_all_kinds_give_the_sum_of_what_each_gives(make_lit, floor, make_mesh, random_matrix, shader):
    """Whichever half of a tree is asked, from before and behind, and weighted against scattered rays where these find lamps."""
    square = make_mesh([(2, -1, 1), (2, 1, 1), (2, 1, 3), (2, -1, 3)], [(0, 2, 1), (0, 3, 2)])
    shining, dark = (square, sum_of(emission=Color((2.0,) * 3))), (square, sum_of(diffuse=Color((0.0,) * 3)))
    lamps = [above(number, random_matrix) for number in range(60)]

    def measure(*lamps, samples, body=dark):
        scene = make_lit(CAMERA, (floor, Material(surface=shader)), body, lamps=lamps, film=Film(filter="BOX"))
        passes = {name: values.astype(float) for name, values in render(scene, "direct", samples, 3).items()}
        pixels = passes["Combined"][..., 0]
        return pixels.mean(), np.sqrt(passes["Variance"][..., 0].sum()) / pixels.size

    alone = [measure(lamp, samples=4) for lamp in lamps] + [measure(samples=16, body=shining)]
    expected, known = sum(mean for mean, _ in alone), np.sqrt(sum(error**2 for _, error in alone))
    mean, error = measure(*lamps, samples=64, body=shining)
    assert error < 0.02 * expected, "that would tell nothing"
    assert abs(mean - expected) <= 4 * np.hypot(error, known), f"{mean:.6g} for {expected:.6g} ± {np.hypot(error, known):.2g}"


def test_the_one_of_many_lamps_that_is_near_is_asked_by_what_it_brings(lit):
    """One of 64 lamps is near, the others 100 m away: sampled one time in 64, the noise of the near one would be 8
    times the mean; it is 0.67 of it."""
    far = [Point(f"far {i}", position=(100 * np.cos(i), 100 * np.sin(i), 10), power=(10.0,) * 3) for i in range(63)]
    mean, error = lit(*far, Point("near", position=(3, 0, 3), power=(10.0,) * 3), samples=16)
    alone, _ = lit(Point("near", position=(3, 0, 3), power=(10.0,) * 3))
    assert 1 < mean / alone < 1.02, "that would tell nothing"
    of_a_sample = error / mean * np.sqrt(64 * 64 * 16)
    assert of_a_sample < 1, f"the noise of a sample is {of_a_sample:.3g} of the mean"


def test_of_many_lamps_those_count_that_only_a_smooth_surface_has_before_it(make_lit, make_mesh):
    """Forty lamps in one place are one of forty times the power, also where they are behind the true floor."""
    tilted = np.broadcast_to(np.array([1, 0, 1]) / np.sqrt(2), (2, 3, 3))
    floor = make_mesh([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2), (0, 2, 3)], corner_normals=tilted)

    def light(count, power):
        lamps = [Point(f"{i}", position=(3, 0, -1), power=(power,) * 3) for i in range(count)]
        return render(make_lit(CAMERA, (floor, WHITE), lamps=lamps), "direct", 4)["Combined"][..., 0].mean()

    assert light(40, 10.0) == pytest.approx(light(1, 400.0), rel=1e-6) and light(1, 400.0) > 0


def test_a_sky_beside_lamps_gives_its_whole_light(lit):
    """The sky of 1 gives a white floor a radiance of 1, however seldom it is asked."""
    for power in (1.0, 1e2, 1e5):
        lamp = Point("point", position=(3, 0, 3), power=(power,) * 3)
        alone, _ = lit(lamp)
        mean, error = lit(lamp, world=World((1, 1, 1)), samples=64)
        assert abs(mean - alone - 1) <= 4 * error + 1e-6 * mean, f"{mean - alone:.4f} ± {error:.2g}"


def test_a_coated_surface_beside_a_lamp_and_a_sky_has_the_sum_of_both(make_lit, floor):
    """Its lobes are chosen otherwise than under either alone: rays that find the dim sky only are fewer."""
    lamp, coated = (
        Point("lamp", position=(1, 0, 2), power=(200.0,) * 3, radius=0.5),
        Material(surface=node("principled", roughness=0.5)),
    )

    def measure(lamps, world, samples):
        scene = make_lit(CAMERA, (floor, coated), lamps=lamps, world=world, film=Film(filter="BOX"))
        passes = render(scene, "direct", samples, 3)
        pixels = passes["Combined"][..., 0].astype(float)
        return pixels.mean(), np.sqrt(passes["Variance"][..., 0].sum(dtype=float)) / pixels.size

    sky = World((0.3,) * 3)
    (first, one_error), (other, other_error) = measure((lamp,), World(), 64), measure((), sky, 64)
    mean, error = measure((lamp,), sky, 64)
    assert error < 0.002 * mean and other > 0.02 * mean, "that would tell nothing"
    off = mean - first - other
    assert abs(off) <= 4 * np.sqrt(error**2 + one_error**2 + other_error**2), (
        f"{mean:.6g} for {first + other:.6g} ± {error:.2g}"
    )


def test_shining_surfaces_beside_lamps_are_found_as_often_as_it_takes(lit, make_mesh):
    """Both ways of finding them, weighted, and the choice among them and a lamp."""
    square = make_mesh([(2, -1, 1), (2, 1, 1), (2, 1, 3), (2, -1, 3)], [(0, 2, 1), (0, 3, 2)])
    glow = ((square, sum_of(emission=Color((5.0,) * 3))),)
    lamp = Point("point", position=(-3, 0, 3), power=(50.0,) * 3)
    (first, first_error), (second, two) = lit(lamp), lit(bodies=glow, samples=256)
    mean, error = lit(lamp, bodies=glow, samples=64)
    assert error < 0.02 * mean and abs(mean - first - second) <= 4 * np.sqrt(first_error**2 + two**2 + error**2)


@pytest.mark.parametrize("kind", ["camera", "diffuse", "glossy", "transmission"])
def test_what_a_lamp_hides_from_it_does_not_light_and_is_not_seen_by(make_lit, floor, make_mesh, kind):
    """Diffuse surfaces get no light of it, mirrors and clear surfaces don't show it, nor does the camera see it."""
    matrix = np.eye(4)
    matrix[:3, 3] = (0, 0, 300)  # behind the camera, as large as all that is reflected
    up = Pinhole((0, 0, 100), (0, 0, 300), (0, 1, 0), 6400, 16, 16)
    pane = make_mesh(floor.vertices + np.array([0, 0, 150]), floor.triangles)
    views = {
        "camera": (up, ()),
        "diffuse": (CAMERA, ((floor, WHITE),)),
        "glossy": (CAMERA, ((floor, sum_of(mirror=Color((1.0,) * 3))),)),
        "transmission": (up, ((pane, sum_of(refraction=Color((1.0,) * 3))),)),
    }
    for hidden in (frozenset(), frozenset({kind})):
        lamp = Area("area", matrix=matrix, size=(900, 900), power=(1e6,) * 3, hidden_from=hidden)
        for ray, (camera, bodies) in views.items():
            seen_lamp = replace(lamp, hidden_from=hidden | {"camera"}) if ray == "transmission" else lamp
            bright = render(make_lit(camera, *bodies, lamps=(seen_lamp,)), "path", 1)["Combined"][..., :3].any()
            assert bright == (ray not in hidden), (ray, hidden)


def test_a_lamp_without_a_shadow_shines_through_things(lit, make_mesh):
    roof = make_mesh(
        [(-9, -9, 1), (9, -9, 1), (9, 9, 1), (-9, 9, 1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
        [(0, 1, 4), (1, 5, 4), (1, 2, 5), (2, 6, 5), (2, 3, 6), (3, 7, 6), (3, 0, 7), (0, 4, 7)],
    )
    lamp = Sun("sun", towards=(1, 0, 0.2), irradiance=(2, 2, 2))
    free, shut = lit(lamp)[0], lit(lamp, bodies=((roof, WHITE),))[0]
    through = lit(replace(lamp, casts_shadow=False), bodies=((roof, WHITE),))[0]
    assert free > 0 and shut == 0 and through == free


def met(rng, random_matrix, number):
    """A lamp of any kind that has a size, anywhere before or round the eye, and some at infinity."""
    kind, name = rng.integers(5), f"lamp {number}"
    power = (10.0 ** rng.uniform(0, 2),) * 3
    matrix, radius, soft = random_matrix(rng, spread=4), 10.0 ** rng.uniform(-2, 0.5), bool(rng.integers(2))
    if kind == 0:
        return Sun(name, towards=rng.normal(size=3), irradiance=power, angle=rng.uniform(0, 2))
    if kind == 1:
        return Point(name, position=rng.normal(size=3) * 4, power=power, radius=radius, soft_falloff=soft)
    if kind == 2:
        return Spot(name, matrix=matrix, power=power, radius=radius, soft_falloff=soft, angle=rng.uniform(0.1, 3))
    return Area(name, matrix=matrix, size=rng.uniform(0.1, 3, 2), power=power, ellipse=bool(kind == 3))


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1), count=st.sampled_from([1, 2, 9, 60]))
def test_the_eye_sees_of_many_lamps_the_sum_of_what_it_sees_of_each(make_lit, random_matrix, seed, count):
    """Whichever of them a ray is asked about: no more than the rounding of a sum of so many floats."""
    rng = np.random.default_rng(seed)
    lamps = [met(rng, random_matrix, number) for number in range(count)]

    def seen(*lamps):
        return render(make_lit(Pinhole((0, 0, 6), (0, 0, 0), (0, 1, 0), 40, 48, 32), lamps=lamps), "direct", 4, 1)["Combined"][
            ..., :3
        ]

    expected = np.sum([seen(lamp).astype(float) for lamp in lamps], axis=0)
    assert np.any(expected > 0) or count < 60, "that would tell nothing"
    np.testing.assert_allclose(seen(*lamps), expected, rtol=(count + 2) * 2.0**-24)


def test_a_ray_asks_few_of_many_lamps(make_lit, floor):
    """A hundred times as many squares over a mirror take less than four times as long: each ray would ask them all."""

    def took(count):
        side = int(count**0.5)
        places = [(x, y) for x in np.linspace(-3, 3, side) for y in np.linspace(-3, 3, side)]
        lamps = [
            Area(
                f"{i}",
                matrix=np.array([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, 2], [0, 0, 0, 1.0]]),
                size=(0.01, 0.01),
                power=(1, 1, 1),
            )
            for i, (x, y) in enumerate(places)
        ]
        tracer = Tracer(make_lit(CAMERA, (floor, MIRROR), lamps=lamps), threads=1)
        tracer.render_light("direct", 1, 0)
        times = []
        for _ in range(3):
            started = time.process_time()
            tracer.render_light("direct", 16, 0)
            times.append(time.process_time() - started)
        return min(times)

    few, many = took(36), took(3600)
    assert many < 4 * few, f"36 lamps take {few:.3f} s, 3600 {many:.3f} s"
