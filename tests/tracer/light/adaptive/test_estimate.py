"""Estimates of a pixel's error: right in the mean for noise of any rate, and not fooled by luck."""

import numpy as np
import pytest

from viewcam_addon.tracer.light.adaptive.estimate import BLOCK, blocks, efficiency, mean_around
from viewcam_addon.tracer.light.adaptive.glints import largest_around

RNG = np.random.default_rng(5)
SHAPE = (40, 56)
EVERY = np.arange(40 * 56)


def halves(samples, rate, spread):
    """(own, apart) of pixels the errors of whose halves are independent and fall as samples to the power of −rate / 2."""
    one, other = RNG.normal(size=(2, *SHAPE)) * spread * (samples / 2) ** (-rate / 2)
    return np.full(SHAPE, spread**2 / samples), (one - other) ** 2 / 4


def by_pixel(own, apart):
    return efficiency(own.ravel(), apart.ravel(), blocks(EVERY, SHAPE[1])).reshape(SHAPE)


def test_independent_samples_have_the_variance_that_they_tell():
    factor = by_pixel(*halves(64, 1.0, 0.3))
    # 64 pixels of one degree of freedom each tell it to √(2/64) = 0.18.
    assert factor.mean() == pytest.approx(1.0, abs=0.2) and factor.min() > 0.3 and factor.max() <= 1.0


def test_samples_that_share_out_their_space_have_less():
    factor = by_pixel(*halves(64, 1.5, 0.3))
    # Of each half 32^−3/2, of the mean of two independent ones half of that, over 1/64.
    assert factor.mean() == pytest.approx(0.5 * 32**-1.5 * 64, rel=0.1)


def test_every_block_has_its_own_efficiency():
    own, apart = halves(64, 1.0, 0.3)
    apart[:, 24:] /= 100
    factor = by_pixel(own, apart)
    assert factor[:, :24].mean() > 5 * factor[:, 24:].mean()
    assert (factor[:BLOCK, :BLOCK] == factor[0, 0]).all()


def test_a_block_of_one_pixel_follows_the_others():
    own, apart = halves(64, 1.0, 0.3)
    own[32:, 48:], apart[32:, 48:] = 0.0, 0.0
    own[33, 50] = own[0, 0]  # its halves agree by luck
    assert by_pixel(own, apart)[33, 50] > 0.5


def test_nothing_known_is_no_gain():
    assert (by_pixel(np.zeros(SHAPE), np.zeros(SHAPE)) == 1).all()


def test_a_pixel_has_no_say_in_how_noisy_it_is():
    values = RNG.random(SHAPE)
    other = values.copy()
    other[10, 10] = 1e6
    there, elsewhere = (mean_around(each, np.ones(SHAPE, bool), EVERY) for each in (values, other))
    own = 10 * SHAPE[1] + 10
    assert elsewhere[own] == pytest.approx(there[own], rel=1e-9)
    assert (np.abs(elsewhere - there) > 1000).sum() == 24


def test_surroundings():
    values, known = RNG.random((9, 11)), RNG.random((9, 11)) < 0.7
    window = np.lib.stride_tricks.sliding_window_view
    around = window(np.pad(values, 1), (3, 3))
    np.testing.assert_array_equal(largest_around(values), around.max(axis=(2, 3)))
    sums, counts = (
        window(np.pad(each, 2), (5, 5)).sum(axis=(2, 3)) - each for each in (np.where(known, values, 0.0), known.astype(float))
    )
    expected, some = (sums / np.maximum(counts, 1)).ravel(), np.flatnonzero(known)
    for around in (mean_around, mean_around.plain):
        np.testing.assert_allclose(around(values, known, some), expected[some], rtol=1e-12, atol=1e-15)
        assert (around(values, np.zeros_like(known), some) == 0).all()
