"""Estimates of a pixel's error: right in the mean for noise of any rate, and not fooled by luck."""

import numpy as np
import pytest

from viewcam_addon.tracer.light.adaptive.estimate import BLOCK, efficiency, largest_around, mean_around, missed

RNG = np.random.default_rng(5)
SHAPE = (40, 56)


def halves(samples, rate, spread):
    """(own, apart) of pixels the errors of whose halves are independent and fall as samples to the power of −rate / 2."""
    one, other = RNG.normal(size=(2, *SHAPE)) * spread * (samples / 2) ** (-rate / 2)
    return np.full(SHAPE, spread**2 / samples), (one - other) ** 2 / 4


def test_independent_samples_have_the_variance_that_they_tell():
    factor = efficiency(*halves(64, 1.0, 0.3))
    # 64 pixels of one degree of freedom each tell it to √(2/64) = 0.18.
    assert factor.mean() == pytest.approx(1.0, abs=0.2) and factor.min() > 0.3 and factor.max() <= 1.0


def test_samples_that_share_out_their_space_have_less():
    factor = efficiency(*halves(64, 1.5, 0.3))
    # Of each half 32^−3/2, of the mean of two independent ones half of that, over 1/64.
    assert factor.mean() == pytest.approx(0.5 * 32**-1.5 * 64, rel=0.1)


def test_every_block_has_its_own_efficiency():
    own, apart = halves(64, 1.0, 0.3)
    apart[:, 24:] /= 100
    factor = efficiency(own, apart)
    assert factor[:, :24].mean() > 5 * factor[:, 24:].mean()
    assert (factor[:BLOCK, :BLOCK] == factor[0, 0]).all()


def test_a_block_of_one_pixel_follows_the_others():
    own, apart = halves(64, 1.0, 0.3)
    own[32:, 48:], apart[32:, 48:] = 0.0, 0.0
    own[33, 50] = own[0, 0]  # its halves agree by luck
    assert efficiency(own, apart)[33, 50] > 0.5


def test_nothing_known_is_no_gain():
    assert (efficiency(np.zeros(SHAPE), np.zeros(SHAPE)) == 1).all()


def test_what_a_neighbour_saw_may_have_been_missed():
    spread = np.zeros(SHAPE)
    spread[10, 10] = 0.25  # half black, half white
    found = missed(spread, np.zeros(SHAPE), 16)
    assert np.sqrt(found[9:12, 9:12]) == pytest.approx(1 / 16)
    assert np.count_nonzero(found) == 9


def test_surroundings():
    values = RNG.random((5, 7))
    padded = np.pad(values, 1)
    around = np.lib.stride_tricks.sliding_window_view(padded, (3, 3))
    np.testing.assert_array_equal(largest_around(values), around.max(axis=(2, 3)))
    np.testing.assert_allclose(mean_around(values), around.mean(axis=(2, 3)), rtol=1e-12)
