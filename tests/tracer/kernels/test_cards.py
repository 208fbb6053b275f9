"""The kernel of the eye's spheres: those that are found through cards, as deep to the last bit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import compiled
from viewcam_addon.tracer.rays.cards import cards_of
from viewcam_addon.tracer.rays.ellipsoids import ellipsoids_of
from viewcam_addon.tracer.rays.embree import unit_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.scene import Object, Spheres

pytestmark = pytest.mark.skipif(not compiled.AVAILABLE, reason="numba or embreex is not installed, or turned off")

VIEW = View(Pinhole((0, -20, 0), (0, 0, 0), (0, 0, 1), 600, 400, 400))


def seen(rng, count):
    """Ellipsoids before the eye, some hidden in others, and the number of those without a card."""
    stretched = rng.normal(size=(3, 3)) + np.eye(3)
    pairs = []
    for linear in (np.eye(3), stretched):
        matrix = np.eye(4)
        matrix[:3, :3] = linear
        spheres = Spheres(rng.normal(size=(count, 3)), rng.lognormal(-2.5, 1.0, count), np.zeros(count, np.int32))
        pairs.append((Object("spheres", "spheres", matrix), spheres))
    ellipsoids = ellipsoids_of(pairs, VIEW)
    return ellipsoids, int(np.isinf(ellipsoids.bounds[0]).sum())


def limits(rng, count):
    """Depths that are seen already."""
    return rng.choice([15.0, 20.0, 25.0, np.inf], count)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), count=st.sampled_from([2, 50, 500]), start=st.sampled_from([0.0, 19.0]))
def test_the_eye_sees_the_spheres_that_stand_behind_cards(seed, count, start):
    rng = np.random.default_rng(seed)
    ellipsoids, first = seen(rng, count)
    x, y = rng.normal(size=(2, 700)) * 0.1
    nearest = limits(rng, 700)
    true = nearest.copy()
    unit = unit_of(100.0)
    found = cards_of(ellipsoids, first, unit).before(nearest, start, x, y)
    expected = cards_of.plain(ellipsoids, first, unit).before(true, start, x, y)
    wrong = np.flatnonzero(nearest != true)
    assert not len(wrong), f"{len(wrong)} of 700 rays: {nearest[wrong][:3]} where cards find {true[wrong][:3]}"
    assert np.array_equal(found, expected), f"rays {np.flatnonzero(found != expected)} meet other spheres"


def test_a_reach_that_is_forgotten_shows_spheres_through_walls():
    """What the test above would see if the depths that are seen already did not count."""
    rng = np.random.default_rng(0)
    ellipsoids, first = seen(rng, 50)
    x, y = rng.normal(size=(2, 700)) * 0.1
    cards = cards_of(ellipsoids, first, unit_of(100.0))
    before_a_wall = cards.before(np.full(700, 19.0), 0.0, x, y)
    before_nothing = cards.before(np.full(700, np.inf), 0.0, x, y)
    assert (before_a_wall != before_nothing).sum() > 10
