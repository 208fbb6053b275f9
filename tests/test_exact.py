"""Rounding errors that are kept: every claim of exact.py against rational arithmetic."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon import exact

# Products of two of these neither overflow nor lose their error term.
factors = st.one_of(st.just(0.0), *(st.floats(*sorted((s * 2.0**-400, s * 2.0**400))) for s in (1, -1)))
vectors = st.tuples(factors, factors, factors)


@given(factors, factors)
def test_two_sum_and_its_error_are_the_exact_sum(a, b):
    total, error = exact.two_sum(a, b)
    assert Fraction(total) + Fraction(error) == Fraction(a) + Fraction(b)


@given(factors, factors)
def test_two_product_and_its_error_are_the_exact_product(a, b):
    product, error = exact.two_product(a, b)
    assert Fraction(product) + Fraction(error) == Fraction(a) * Fraction(b)


@given(st.lists(factors, min_size=2, max_size=8))
def test_a_sum_of_floats_and_of_arrays_is_rounded_once(terms):
    true = sum(map(Fraction, terms))
    high, low, _ = exact.sum_terms(terms)
    assert high == float(true)
    assert abs(Fraction(high) + Fraction(low) - true) <= abs(Fraction(low)) * Fraction(2) ** -53

    array_high, _, settled = exact.sum_terms([np.array([term]) for term in terms])
    assert settled.all()
    # One unit in the last place more where the exact sum lies halfway between two floats.
    assert abs(Fraction(float(array_high[0])) - true) <= Fraction(float(np.spacing(abs(high)))) / 2 * (1 + Fraction(2) ** -50)


@given(vectors, vectors, vectors)
def test_cross_of_a_difference_is_right_to_its_last_bit_whatever_cancels(a, b, c):
    (a,), (high, low) = exact.scaled_to_one(a), exact.scaled_to_one(*exact.difference(b, c))
    if not (exact.are_factors(a, a) and exact.are_factors(high, high) and exact.are_factors(low, low)):
        return
    apart = [Fraction(x) + Fraction(y) for x, y in zip(high, low, strict=True)]
    rounded, _, _ = exact.cross(a, high, low)
    for component, j, k in zip(rounded, (1, 2, 0), (2, 0, 1), strict=True):
        assert component == float(Fraction(a[j]) * apart[k] - Fraction(a[k]) * apart[j])


@given(vectors.filter(any))
def test_length_is_within_one_unit_in_the_last_place(vector):
    (scaled,) = exact.scaled_to_one(vector)
    squared = sum(Fraction(component) ** 2 for component in scaled)
    length = exact.length(scaled)
    # From sqrt's half unit and the sum's half unit, which sqrt halves.
    assert abs(Fraction(length) ** 2 / squared - 1) <= 3 * Fraction(2) ** -53


def test_what_is_too_small_beside_the_rest_is_no_factor():
    assert exact.are_factors((1.0, 0.0, 2.0**-400), (1.0, 0.0, 2.0**-400))
    assert not exact.are_factors((1.0, 0.0, 2.0**-401), (1.0, 0.0, 2.0**-401))
    assert not exact.are_factors((1.0, 0.0, 5e-324), (2.0**-100, 0.0, 0.0)), "lost by scaling"
