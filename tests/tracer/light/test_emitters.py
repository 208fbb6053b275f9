"""The choice of one emitter for each point, and the weights between ways of finding light."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.tracer.arrays import dot
from viewcam_addon.tracer.light import emitters
from viewcam_addon.tracer.light.emitters import weight
from viewcam_addon.tracer.light.sampler import Sampler
from viewcam_addon.tracer.scene.lamps import Area, Point, Sun, World
from viewcam_addon.tracer.scene.materials import Colour, Material

SEEDS = st.integers(0, 2**32 - 1)
DENSITIES = st.floats(1e-200, 1e200)
UP = (0, 0, 1)


def down(height, x=0.0, power=1.0, **more):
    matrix = np.eye(4)
    matrix[:3, 3] = x, 0, height
    return Area("area", matrix=matrix, power=(power,) * 3, **more)


def spread(rng, count):
    """Points of no size above the origin, of very different powers, and what they give to a surface there that looks up."""
    places = rng.uniform([[-5], [-5], [0.2]], [[5], [5], [5]], (3, count)).T
    powers = 10.0 ** rng.uniform(-2, 2, count)
    squares = (places**2).sum(axis=1)
    given_ = powers / (4 * np.pi * squares) * places[:, 2] / np.sqrt(squares)
    lamps = [
        Point(str(number), position=place, power=(power,) * 3)
        for number, (place, power) in enumerate(zip(places, powers, strict=True))
    ]
    return lamps, given_


# The weights


@given(a=DENSITIES, b=DENSITIES)
def test_the_weights_of_two_ways_sum_to_one(a, b):
    assert weight(a, b) + weight(b, a) == pytest.approx(1, rel=1e-15)


@given(a=DENSITIES)
def test_what_only_one_way_can_find_counts_whole(a):
    assert weight(np.inf, a) == 1 and weight(a, 0.0) == 1 and weight(a, np.inf) == 0 and weight(np.inf, 0.0) == 1


def test_the_heuristic_squares():
    assert weight(3.0, 1.0) == pytest.approx(0.9)


# The choice


@pytest.mark.parametrize("count", [1, 2, 8, 32, 33, 300])
def test_all_lamps_together_give_the_sum_of_each(make_lighting, off_by, count):
    lamps, alone = spread(np.random.default_rng(count), count)
    found = make_lighting(*lamps).irradiance((0, 0, 0), UP, 16384)
    assert abs(off_by(found, alone.sum(), 0.1)) <= 3, found


@pytest.mark.parametrize("count", [2, 32])
def test_of_a_few_lamps_without_a_size_each_is_chosen_by_what_it_gives_and_nothing_is_random(make_lighting, count):
    lamps, alone = spread(np.random.default_rng(1), count)
    mean, error = make_lighting(*lamps).irradiance((0, 0, 0), UP, 64)
    assert mean == pytest.approx(alone.sum(), rel=1e-12) and error <= 1e-12 * mean


@pytest.mark.parametrize("radius", [0.0, 0.1])
def test_lamps_that_are_asked_one_by_one_together_give_the_sum_of_each(make_lighting, off_by, radius):
    """The weakest gives a hundredth of the brightest and is asked at every 25th sample only, unless it has no size."""
    lamps = [Point(str(power), position=(0.3, 0.2, 2), power=(power,) * 3, radius=radius) for power in (1.0, 30.0, 0.3)]
    lighting = make_lighting(*lamps)
    all_emitters, points = lighting.emitters, lighting.points((0, 0, 0), UP, 16384)
    numbers = Sampler(1, 16384).numbers(np.zeros(16384, np.int64), np.arange(16384), 2, 3)
    total, sent = np.zeros(16384), []
    for lamp in range(3):
        aimed = all_emitters.sample(points, numbers, lamp, all_emitters.brightest(points))
        cosine = np.maximum(dot(points.normal, aimed.direction), 0.0)
        total += aimed.light[0] * cosine
        sent.append((cosine > 0).mean())
    squared = 0.3**2 + 0.2**2 + 2**2
    expected = 31.3 / (4 * np.pi * squared) * 2 / np.sqrt(squared)
    # A small sphere gives what a point does, but for a part of (radius / distance)² = 0.0025 at most.
    assert abs(off_by((total.mean(), max(total.std() / 128, 0.0025 * expected)), expected)) <= 3
    assert sorted(np.round(sent, 2)) == ([0.04, 0.13, 1.0] if radius else [1.0, 1.0, 1.0])


def test_five_thousand_lamps_are_all_found(make_lighting, off_by):
    """Each with the chance it has: those that it is divided by sum to one, and a red one among them is found."""
    lamps, alone = spread(np.random.default_rng(2), 4999)
    red = Point("red", position=(0, 0, 2), power=(50.0, 0, 0))
    lighting = make_lighting(*lamps, red)
    assert abs(off_by(lighting.irradiance((0, 0, 0), UP, 2**17), alone.sum() + 50 / (16 * np.pi), 0.1)) <= 3
    aimed, _ = lighting.aimed((0, 0, 0), UP, 2**17)
    assert ((aimed.light[0] > 0) & (aimed.light[1] == 0)).any()


@settings(max_examples=25)
@given(seed=SEEDS, count=st.sampled_from([2, 6]))
def test_no_sample_is_wasted_on_lamps_below_the_horizon_or_behind_their_backs(make_lighting, seed, count):
    rng = np.random.default_rng(seed)
    averted = np.diag([1.0, 1.0, -1.0, 1.0])
    averted[2, 3] = 2
    lost = [
        Point("below", position=(1, 2, -1), power=(1e6,) * 3, radius=0.9),
        Sun("set", towards=(0, 1, -1), irradiance=(1e6,) * 3, angle=1.0),
        down(-1, power=1e6),
        Area("averted", matrix=averted, power=(1e6,) * 3),
    ]
    lamps, _ = spread(rng, count)
    aimed, cosine = make_lighting(*lamps[:count], lost[rng.integers(4)]).aimed((0, 0, 0), UP, 256)
    assert (aimed.light[0] * cosine > 0).all()


@settings(max_examples=25)
@given(seed=SEEDS, count=st.sampled_from([2, 8, 40]))
def test_a_lamp_that_sees_the_least_of_a_surface_has_some_chance(make_lighting, seed, count):
    """A sphere whose top is just above the horizon, among others above it."""
    rng = np.random.default_rng(seed)
    lamps, _ = spread(rng, count - 1)
    rising = Point("rising", position=(2, 0, -0.99), power=(0, 1e6, 0), radius=1.0)
    others = [replace(lamp, power=(1, 0, 0)) for lamp in lamps]
    aimed, _ = make_lighting(*others, rising).aimed((0, 0, 0), UP, 2**14)
    assert (aimed.light[1] > 0).any()


def test_a_point_that_nothing_lights_gets_nothing(make_lighting):
    lighting = make_lighting(Sun("set", towards=(0, 0, -1)), Point("below", position=(0, 0, -2)))
    aimed, _ = lighting.aimed((0, 0, 0), UP, 64)
    assert not aimed.light.any() and np.isfinite(aimed.direction).all() and not np.isnan(aimed.pdf).any()


def test_the_order_of_lamps_does_not_matter(make_lighting, off_by):
    lamps = [Sun("sun", angle=0.3), down(1, power=5), Point("point", position=(1, 1, 1), power=(9,) * 3, radius=0.3)]
    first, second = (make_lighting(*some).irradiance((0, 0, 0), UP, 16384) for some in (lamps, lamps[::-1]))
    assert first[0] == pytest.approx(second[0], abs=3 * np.hypot(first[1], second[1]))


def test_suns_over_a_scene_of_one_tiny_sphere_have_their_chances(make_lighting, make_spheres, off_by):
    suns = [Sun(str(number), towards=(0, number / 40, 1), irradiance=(1 + number,) * 3) for number in range(40)]
    expected = sum((1 + number) / np.hypot(1, number / 40) for number in range(40))
    for radius in (0.0, 1e-9):
        lighting = make_lighting(*suns, surfaces=[(make_spheres([[0, 0, 0]], radius), None)])
        assert abs(off_by(lighting.irradiance((0, 0, 0), UP, 16384), expected)) <= 3


def test_a_wrong_chance_is_told(make_lighting, off_by, monkeypatch):
    lamps, alone = spread(np.random.default_rng(3), 40)
    lighting = make_lighting(*lamps)
    lighting.emitters.chances = lighting.emitters.chances[::-1]
    assert abs(off_by(lighting.irradiance((0, 0, 0), UP, 2**16), alone.sum(), 0.1)) > 3


def test_a_lamp_that_is_dropped_is_told(make_lighting, off_by):
    lamps, alone = spread(np.random.default_rng(4), 20)
    without = np.argmax(alone)
    found = make_lighting(*lamps[:without], *lamps[without + 1 :]).irradiance((0, 0, 0), UP, 2**16)
    assert abs(off_by(found, alone.sum(), 0.1)) > 3


@pytest.mark.parametrize("piece", [64, 1000])
def test_the_size_of_the_pieces_changes_no_bit(make_lighting, monkeypatch, piece):
    lamps = [*spread(np.random.default_rng(5), 4)[0], Sun("sun", angle=0.3), down(1, power=5), down(2, ellipse=True)]
    lighting = make_lighting(*lamps)
    whole, _ = lighting.aimed((0, 0, 0), UP, 3000)
    monkeypatch.setattr(emitters, "_POINTS", piece)
    pieces, _ = lighting.aimed((0, 0, 0), UP, 3000)
    assert all(np.array_equal(one, other) for one, other in zip(whole, pieces, strict=True))


def test_no_points_get_no_samples(make_lighting):
    aimed, _ = make_lighting(Sun("sun"), Point("point")).aimed((0, 0, 0), UP, 0)
    assert aimed.light.shape == aimed.direction.shape == (3, 0)


# What there is


def test_only_what_gives_light_is_lit_sampled_and_met(make_lighting, make_mesh):
    glow = Material(emission=Colour((1, 1, 1)))
    square = make_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    for lighting, expected in (
        (make_lighting(), (False, False, False, False)),
        (make_lighting(Sun("sun")), (True, True, False, False)),
        (make_lighting(Sun("sun", angle=1.0)), (True, True, False, True)),
        (make_lighting(down(1)), (True, True, False, True)),
        (make_lighting(world=World((1, 1, 1))), (True, False, True, True)),
        (make_lighting(world=World((1, 1, 1), hidden_from={"diffuse"})), (True, False, False, True)),
        (make_lighting(surfaces=[(square, glow)]), (True, True, True, True)),
        (make_lighting(surfaces=[(square, Material())]), (False, False, False, False)),
    ):
        found = lighting.emitters
        assert (found.lit, found.sampled("diffuse"), found.meets("diffuse"), found.meets("glossy")) == expected
        assert not found.sampled("glossy")


def test_the_world_is_the_same_everywhere_but_for_rays_that_it_is_hidden_from(make_lighting):
    world = make_lighting(world=World((1, 2, 3), hidden_from={"glossy"})).emitters.world
    assert np.array_equal(world("camera"), (1, 2, 3)) and np.array_equal(world("glossy"), (0, 0, 0))
