"""Which pixels' rays pass close by a corner: found from the corners, none is missed that is found from the rays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.tracer.rays.corners import REACH, Corners

SEEDS = st.integers(0, 2**32 - 1)


def grid(rng, extent):
    """x of some columns and y of some rows, about as far from the view axis as `extent`."""
    width, height = rng.integers(2, 60, 2)
    spacing, shift = extent / 60, rng.uniform(-extent, extent, 2)
    return shift[0] + np.arange(width) * spacing, shift[1] + np.arange(height) * spacing * rng.uniform(0.5, 2)


def beside(x, y, offset, rng, count=200):
    """Corners at some pixels' centres and beside others by `offset` of their reach, at any depth; and the pixels' numbers."""
    column, row = rng.integers(len(x), size=count), rng.integers(len(y), size=count)
    places = np.stack([x[column], y[row]])
    distance = np.abs(places).max(axis=0)
    places += offset * REACH * distance * np.maximum(distance, 1) * rng.choice([-1, 1], (2, count))
    depth = np.exp(rng.normal(size=count) * 5)
    return np.concatenate([places * depth, depth[None]]), np.unique(row * len(x) + column)


@settings(max_examples=40)
@given(seed=SEEDS, extent=st.sampled_from([1e-4, 1.0, 10.0]))
def test_pixels_with_a_corner_in_reach_are_found_and_no_others(seed, extent):
    rng = np.random.default_rng(seed)
    x, y = grid(rng, extent)
    # Corners are divided by their depth, and pixels' distances are theirs but for the offset: some 2⁻⁵² against REACH.
    for offset, expected in ((0.999, True), (1.001, False)):
        corners, pixels = beside(x, y, offset, rng)
        found = Corners(corners).near_pixels(x, y)
        assert np.array_equal(found, pixels if expected else []), f"{len(found)} of {len(pixels)} at {offset} of the reach"


@settings(max_examples=20)
@given(seed=SEEDS)
def test_what_is_found_from_corners_is_found_from_rays(seed):
    rng = np.random.default_rng(seed)
    x, y = grid(rng, 1.0)
    corners = Corners(beside(x, y, 0.9, rng)[0])
    rays = np.tile(x, len(y)), np.repeat(y, len(x))
    assert np.isin(corners.near_pixels(x, y), corners.near(*rays)).all()


def test_corners_behind_the_eye_and_outside_the_picture_are_in_no_pixel():
    x, y = np.linspace(-1, 1, 11), np.linspace(-1, 1, 9)
    corners = np.array([[0, 0, -1], [0, 0, 0], [2, 0, 1], [0, -2, 1], [1.2, 0, 1], [np.inf, 0, 1]]).T
    assert len(Corners(corners).near_pixels(x, y)) == 0


@pytest.mark.parametrize(
    ("x", "y"),
    [
        ([0.5], [0.5, 0.6]),
        (np.linspace(0.5, 0.5 + 1e-6, 10), np.linspace(0, 1, 10)),
        (np.linspace(50, 70, 10), np.linspace(0, 1, 10)),
    ],
    ids=["one column", "narrower than the reach", "too far from the axis"],
)
def test_where_pixels_are_no_measure_it_is_left_to_the_rays(x, y):
    corner = np.array([[1.0, 1.0, 1.0]]).T
    assert Corners(corner).near_pixels(np.array(x), np.array(y)) is None
