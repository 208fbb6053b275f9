"""Lamps of all kinds together: each keeps its number and its light, and rays see all that they run through."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.tracer.light import lamps
from viewcam_addon.tracer.scene.lamps import Area, Point, Spot, Sun

SEEDS = st.integers(0, 2**32 - 1)


def placed(rng, spread=5.0):
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    matrix[:3, 3] = rng.uniform(-spread, spread, 3)
    return matrix


def assorted(rng, count, radius=0.5):
    """Lamps of all kinds, with and without a size, of any colours."""

    def one(number):
        colour, matrix, soft = tuple(rng.uniform(0, 5, 3)), placed(rng), bool(rng.integers(2))
        size = radius * rng.integers(2)
        return (
            Sun(f"{number}", towards=rng.normal(size=3), irradiance=colour, angle=rng.uniform(0, 1)),
            Point(f"{number}", position=matrix[:3, 3], power=colour, radius=size, soft_falloff=soft),
            Spot(f"{number}", matrix=matrix, power=colour, radius=size, angle=rng.uniform(0.5, 3), soft_falloff=soft),
            Area(f"{number}", matrix=matrix, power=colour, size=rng.uniform(0.1, 2, 2), ellipse=soft),
        )[rng.integers(4)]

    return [one(number) for number in range(count)]


def rays(rng, count, spread=0.0):
    ahead = rng.normal(size=(3, count))
    return rng.uniform(-spread, spread, (3, count)), ahead / np.linalg.norm(ahead, axis=0)


@settings(max_examples=25)
@given(seed=SEEDS, spread=st.sampled_from([0.0, 3.0]))
def test_rays_see_the_sum_of_what_they_see_of_each_lamp(make_lighting, seed, spread):
    rng = np.random.default_rng(seed)
    many = assorted(rng, 12)
    starts, ahead = rays(rng, 400, spread)
    together = make_lighting(*many).seen(starts, ahead)
    alone = sum(make_lighting(lamp).seen(starts, ahead) for lamp in many)
    assert together == pytest.approx(alone, rel=1e-12)


@settings(max_examples=25)
@given(seed=SEEDS, opening=st.sampled_from([1e-9, 0.01, 0.5, 3.0]), spread=st.sampled_from([0.0, 1e-3, 3.0]))
def test_no_lamp_is_overlooked_that_some_ray_of_a_beam_runs_into(make_lighting, seed, opening, spread):
    """A beam of rays is asked whether it can reach a lamp; each ray for itself always is."""
    rng = np.random.default_rng(seed)
    lighting = make_lighting(*assorted(rng, 30))
    starts, ahead = rays(rng, 200, spread)
    ahead = ahead[:, :1] + opening * ahead
    ahead /= np.linalg.norm(ahead, axis=0)
    together = lighting.seen(starts, ahead)
    alone = np.concatenate([lighting.seen(starts[:, [ray]], ahead[:, [ray]]) for ray in range(200)], axis=1)
    assert together == pytest.approx(alone, rel=1e-12)


def test_a_beam_that_is_too_narrow_is_told(make_lighting, monkeypatch):
    places = [(x, y, 4.0) for x in range(-3, 4) for y in range(-3, 4)]
    lighting = make_lighting(*(Point(f"{place}", position=place, radius=0.3) for place in places))
    ahead = np.array([(x, y, 4.0) for x, y, _ in places]).T
    ahead /= np.linalg.norm(ahead, axis=0)
    assert lighting.seen(np.zeros((3, len(places))), ahead).all()
    monkeypatch.setattr(lamps, "_ROUNDING", -0.3)
    assert not lighting.seen(np.zeros((3, len(places))), ahead).all()


@pytest.mark.parametrize("kind", ["camera", "glossy", "transmission"])
def test_rays_do_not_see_lamps_that_are_hidden_from_them(make_lighting, kind):
    ahead, above = np.array([[0.0], [0.0], [1.0]]), np.eye(4)
    above[2, 3] = 2
    for lamp in (
        Point("lamp", position=(0, 0, 2), radius=1.0, hidden_from={kind}),
        Sun("lamp", angle=0.5, hidden_from={kind}),
        Area("lamp", matrix=above, hidden_from={kind}),
    ):
        lighting = make_lighting(lamp)
        for other in ("camera", "glossy", "transmission"):
            seen = lighting.seen(np.zeros((3, 1)), ahead, other).any()
            assert seen == lighting.emitters.meets(other) == (other != kind), (lamp, other)
        assert not lighting.seen(np.zeros((3, 1)), ahead, "diffuse").any(), "diffuse rays leave lamps to shadow rays"


def test_lamps_that_diffuse_rays_do_not_see_light_nothing_and_are_still_seen(make_lighting):
    lighting = make_lighting(Point("lamp", position=(0, 0, 2), radius=1.0, hidden_from={"diffuse"}))
    assert lighting.emitters.lit and not lighting.emitters.sampled("diffuse")
    assert lighting.seen(np.zeros((3, 1)), np.array([[0.0], [0.0], [1.0]])).all()


@settings(max_examples=20)
@given(seed=SEEDS, count=st.sampled_from([2, 5, 20]))
def test_each_sample_is_of_a_lamp_that_is_there_and_keeps_whether_it_casts_shadows(make_lighting, seed, count):
    """Lamps of all kinds, in any order; those that cast no shadows shine in red alone, all others in blue alone."""
    rng = np.random.default_rng(seed)
    colours = {True: (0.0, 0.0, 2.0), False: (2.0, 0.0, 0.0)}

    def coloured(lamp, shadows):
        what = "irradiance" if isinstance(lamp, Sun) else "power"
        return replace(lamp, casts_shadow=shadows, **{what: colours[shadows]})

    mixed = [coloured(lamp, bool(rng.integers(2))) for lamp in assorted(rng, count)]
    aimed, _ = make_lighting(*mixed).aimed((0, 0, 0), rng.normal(size=3), 600)
    lit = aimed.light.any(axis=0)
    assert np.array_equal(aimed.shadowed[lit], aimed.light[2, lit] > 0)
    assert np.isinf(aimed.pdf).all()
