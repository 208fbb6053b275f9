"""Rounding errors that are kept: every claim of exact.py against rational arithmetic."""

from fractions import Fraction

import numpy as np
from hypothesis import example, given
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


@given(st.lists(factors, min_size=4, max_size=8))
def test_a_sum_of_floats_and_of_arrays_is_rounded_once(terms):
    true = sum(map(Fraction, terms))
    high, low, _ = exact.sum_terms(terms)
    assert high == float(true)
    assert abs(Fraction(high) + Fraction(low) - true) <= abs(Fraction(low)) * Fraction(2) ** -53

    *pair, settled = exact.sum_terms([np.array([term]) for term in terms])
    assert not settled or pair == [high, low], "where arrays say that they have settled, they give the bits of floats"
    assert abs(Fraction(float(pair[0][0])) - true) <= Fraction(float(np.spacing(abs(high)))), "off by more than a step"


def test_a_sum_halfway_between_two_floats_that_a_third_part_decides_is_not_called_settled():
    tie = [np.array([term]) for term in (1.0, 2.0**-53, 2.0**-120, 0.0)]
    *pair, settled = exact.sum_terms(tie)
    assert exact.sum_terms([float(term[0]) for term in tie])[0] == 1 + 2.0**-52 != pair[0], "pairs round it to even"
    assert not settled
    assert exact.sum_terms([*tie[:2], tie[3], tie[3]])[2], "without the third part even is right"


sizes = st.floats(allow_nan=False, allow_infinity=False)


@given(sizes, sizes, sizes.filter(lambda divisor: divisor > 0))
@example(1.7e308, -1.7e308, 5e-324)
@example(5e-324, 0.0, 5e-324)
@example(5e-324, -5e-324, 1.7e308)
def test_a_quotient_of_any_size_has_two_roundings_and_the_same_bits_as_an_array(a, b, divisor):
    fraction, exponent = exact.quotient(a, b, divisor)
    true = (Fraction(a) - Fraction(b)) / Fraction(divisor)
    assert abs(fraction) < 2
    # Quartering, where one of the two is huge, takes at most the last bits of one that is tiny beside it.
    assert abs(Fraction(fraction) * Fraction(2) ** exponent - true) <= abs(true) * Fraction(2) ** -52
    many = exact.quotient(np.array([a]), b, divisor)
    assert (fraction, exponent) == (many[0][0], many[1][0])


@given(st.lists(st.tuples(st.floats(-2, 2), st.integers(-5000, 5000)), min_size=1, max_size=4))
def test_numbers_of_one_scale_keep_their_ratios_and_the_largest_is_about_1(numbers):
    if not any(fraction for fraction, _ in numbers):
        return
    scaled = exact.of_one_scale(*numbers)
    arrays = exact.of_one_scale(*((np.array(fraction), np.array(exponent)) for fraction, exponent in numbers))
    assert scaled == arrays
    assert max(map(abs, scaled)) <= 2
    largest = max(exponent for fraction, exponent in numbers if fraction)
    for (fraction, exponent), have in zip(numbers, scaled, strict=True):
        assert abs(Fraction(have) - Fraction(fraction) * Fraction(2) ** (exponent - largest)) <= Fraction(2) ** -1075


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
