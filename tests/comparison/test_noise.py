"""The laws that noise is judged by, against many digits, against enumeration, and against their definitions."""

import itertools
import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.comparison import noise


def exact_student_tail(t, freedom):
    with mpmath.workdps(40):
        x = mpmath.mpf(freedom) / (mpmath.mpf(freedom) + mpmath.mpf(t) ** 2)
        return float(mpmath.betainc(mpmath.mpf(freedom) / 2, mpmath.mpf(1) / 2, 0, x, regularized=True))


@given(t=st.floats(1e-3, 1e3), freedom=st.floats(1.0, 1e4))
def test_students_tail_is_that_of_many_digits(t, freedom):
    """The fraction converges to 1e-13 a term; the logarithm of the prefactor, up to 700, is rounded to 700 · 2⁻⁵³ ≈ 1e-13, and
    ln Γ of 5,000, some 4e4, to 4e4 · 2⁻⁵³ ≈ 5e-12, a few of which are added."""
    exact = exact_student_tail(t, freedom)
    assert float(noise.student_tail(t, freedom)) == pytest.approx(exact, rel=1e-9, abs=1e-300)


@pytest.mark.parametrize("level", [1e-2, 1e-6, 1e-10])
@pytest.mark.parametrize("freedom", [1.0, 1.7, 3.0, 7.0, 28.4, 300.0, 1e4])
def test_the_critical_t_is_exceeded_with_the_probability_asked_for(level, freedom):
    """Interpolated between 256 nodes: within a percent of the probability."""
    (critical,) = noise.student_critical(np.array([freedom]), level)
    assert exact_student_tail(critical, freedom) == pytest.approx(level, rel=0.01)


def test_very_many_degrees_of_freedom_are_judged_as_many_and_not_as_normal():
    (many,) = noise.student_critical(np.array([1e9]), 1e-9)
    normal = float(mpmath.sqrt(2) * mpmath.erfinv(1 - mpmath.mpf("1e-9")))
    assert normal < many < 1.002 * normal


@pytest.mark.parametrize(
    "sizes",
    [[1] * 12, [1] * 3 + [0.1] * 9, list(range(1, 13)), [1.7**i for i in range(12)], [5, 5, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0]],
)
def test_no_signs_of_differences_go_beyond_the_sign_tail(sizes):
    """All 4,096 signs of twelve differences: the law holds whatever their sizes, equal or with one that outweighs the rest."""
    sums = np.abs([np.dot(signs, sizes) for signs in itertools.product((-1, 1), repeat=len(sizes))]) / np.linalg.norm(sizes)
    for errors in np.unique(sums.round(9)):
        share = (sums >= errors - 1e-9).mean()
        assert share <= noise.sign_tail(errors), (
            f"{errors:.3f}: {share:.4g} of the signs, {noise.sign_tail(errors):.4g} allowed"
        )


def test_students_t_would_be_too_sure_of_differences_of_one_size():
    """Why tiles are not judged by it: 64 differences of ± 1, of which at least 54 agree."""
    agree = 54
    share = 2 * sum(math.comb(64, k) for k in range(agree, 65)) / 2**64
    mean = (2 * agree - 64) / 64
    t = mean / math.sqrt((1 - mean**2) / 63)
    claimed = float(noise.student_tail(t, 63.0))
    errors = (2 * agree - 64) / 8
    assert claimed < share / 2, f"Student claims {claimed:.2g}, and it happens with {share:.2g}"
    assert noise.sign_tail(errors) >= share


@given(level=st.floats(1e-12, 0.3))
def test_the_sign_critical_value_is_the_sign_tails_inverse(level):
    assert noise.sign_tail(noise.sign_critical(level)) == pytest.approx(level, rel=1e-6)


@given(level=st.floats(1e-6, 0.5), count=st.integers(1, 10**7))
def test_all_tests_at_sidaks_level_together_have_the_level(level, count):
    single = noise.sidak(level, count)
    assert -math.expm1(count * math.log1p(-single)) == pytest.approx(level, rel=1e-9)


@pytest.mark.parametrize("mean", [0.0, 1e-3, 0.7, 12.0, 499.0, 501.0, 3e4])
def test_rare_events_exceed_their_allowance_once_in_a_thousand(mean):
    allowed = noise.poisson_allowance(mean, 1e-3)

    def more_than(count):
        with mpmath.workdps(30):
            return float(mpmath.gammainc(count + 1, 0, mean, regularized=True)) if mean else 0.0

    assert more_than(allowed) <= 1e-3
    # For many the normal law takes over, with the margin of its sign_critical: 3.9 for 3.1 standard deviations.
    assert allowed == 0 or more_than(math.floor(allowed - 1 - 0.9 * math.sqrt(mean) * (mean > 500))) > 1e-3


@given(length=st.integers(1, 200), size=st.integers(1, 40))
def test_tiles_cover_an_axis_and_are_not_smaller_than_asked(length, size):
    sizes = np.diff([*noise.tile_starts(length, size), length])
    assert sizes.sum() == length
    assert sizes.min() >= min(size, length)
    assert sizes.max() < 2 * size


def test_sums_over_tiles_are_the_sums_of_their_pixels():
    values = np.random.default_rng(0).random((19, 30, 2))
    sums = noise.tile_sums(values, 8)
    assert sums.shape == (2, 3, 2)
    assert sums[1, 2] == pytest.approx(values[9:, 20:].sum(axis=(0, 1)))
    assert noise.tile_sums(values, 0)[0, 0] == pytest.approx(values.sum(axis=(0, 1)))


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 7, 3), (5, 1, 1), (5, 7, 3)])
def test_the_mean_around_is_that_of_what_there_is(shape):
    values = np.random.default_rng(1).random(shape)
    around = noise.mean_around(values)
    for row, column in np.ndindex(shape[:2]):
        there = values[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        assert around[row, column] == pytest.approx(there.mean(axis=(0, 1)))
