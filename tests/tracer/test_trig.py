"""The core's sine, cosine, inverses and powers (core/math/trig.h) against mpmath: the errors that its heading states."""

import mpmath
import numpy as np
import pytest
from core_probes import function

COUNT = 1500
UNIT = 2.0**-53
"""Half a unit in the last place of 1: of numbers between ½ and 1."""


def spread(low, high, seed=1):
    """Numbers whose logarithms are spread evenly, of both signs, and what lies next to 0 and ±1."""
    rng = np.random.default_rng(seed)
    sizes = 10.0 ** rng.uniform(low, high, COUNT) * rng.choice([-1, 1], COUNT)
    return np.concatenate([sizes, rng.uniform(-1, 1, COUNT), [0.0, 0.5, -0.5, 0.25, 1.0, -1.0, 1 - UNIT, UNIT - 1, 5e-324]])


def off_by(actual, exact, *arguments):
    """(n,) float64: errors, each rounded once."""
    with mpmath.workprec(200):
        inputs = zip(actual.tolist(), *(values.tolist() for values in arguments), strict=True)
        return np.array([float(mpmath.mpf(got) - exact(*map(mpmath.mpf, row))) for got, *row in inputs])


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_sines_of_turns_are_within_two_units_of_the_last_place_of_one(name):
    turns = np.concatenate([spread(-12, 0), spread(0, 9)])
    off = off_by(function(f"{name} of turns", turns), lambda x: getattr(mpmath, name)(2 * mpmath.pi * x), turns)
    assert np.abs(off).max() <= 2 * UNIT, f"{np.abs(off).max() / UNIT:.2f} units, at {turns[np.abs(off).argmax()]!r} turns"


@pytest.mark.parametrize("name", ["asin", "acos"])
def test_inverses_are_within_three_units_of_their_own_last_place(name):
    near_one = 1 - np.abs(spread(-16, -1)[:COUNT])
    x = np.clip(np.concatenate([spread(-300, 0), near_one, -near_one]), -1, 1)
    results = function(name, x)
    off = np.abs(off_by(results, getattr(mpmath, name), x)) / np.spacing(np.abs(results))
    assert off.max() <= 3, f"{off.max():.2f} units, at {x[off.argmax()]!r}"


def test_the_angle_of_a_vector_is_within_three_units_of_its_own_last_place():
    y, x = spread(-20, 20), np.roll(spread(-20, 20, 2), 7)
    results = function("atan2", y, x)
    off = np.abs(off_by(results, mpmath.atan2, y, x)) / np.maximum(np.spacing(np.abs(results)), 5e-324)
    assert off.max() <= 3, f"{off.max():.2f} units, at {y[off.argmax()]!r}, {x[off.argmax()]!r}"
    assert function("atan2", np.zeros(1), np.zeros(1))[0] == 0


def test_powers_are_right_to_two_roundings_of_their_logarithm():
    rng = np.random.default_rng(3)
    x, power = 10.0 ** rng.uniform(-30, 30, 2 * COUNT), rng.uniform(-8, 8, 2 * COUNT)
    results = function("pow", x, power)
    off = np.abs(off_by(results, mpmath.power, x, power)) / results
    allowed = 2 * UNIT * (1 + np.abs(power * np.log2(x)))
    assert (off <= allowed).all(), f"{(off / allowed).max():.2f} of what is allowed, at {x[(off / allowed).argmax()]!r}"


def test_powers_beyond_what_float64_holds_are_0_or_infinite():
    """Also what is given no number for a power: below the least normal number, 2⁻¹⁰²², and from 2¹⁰²³·⁵ on."""
    power = np.array([1021, 1022.001, 1023, 2000, 1e5, 2.0**62, 2.0**63, 2.0**70, 1e300, np.inf])
    small, large = function("pow", 0.5, power), function("pow", 0.5, -power)
    np.testing.assert_array_equal(small, [2.0**-1021, *np.zeros(9)])
    assert large[0] == 2.0**1021 and large[2] == 2.0**1023
    assert abs(large[1] / 2.0**1022 - 2**0.001) < 1023 * 2.0**-52 * 1.001
    np.testing.assert_array_equal(large[3:], np.inf)
    np.testing.assert_array_equal(function("pow", 2.0, power), large)
    np.testing.assert_array_equal(function("pow", 1.0, power[:-1]), 1)
    assert np.isnan(function("pow", 2.0, np.nan))


def test_an_error_of_three_units_would_be_told():
    turns = np.array([0.1])
    off = off_by(function("sin of turns", turns) + 4 * UNIT, lambda x: mpmath.sin(2 * mpmath.pi * x), turns)
    assert np.abs(off).max() > 2 * UNIT
