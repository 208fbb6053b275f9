"""Chance: tails of distributions, and how a picture is cut into tiles.

A comparison makes millions of tests (each pixel, each tile, each channel), and may raise one false alarm in a hundred
comparisons over all of them. What a single test may claim is therefore tiny, some 10⁻⁹, and there the shape of the noise
counts. So two laws are used, none of which takes noise to be milder than it is:

- A pixel's difference over its estimated standard error follows Student's t, whose tails are the wider, the fewer seeds the
  estimate comes from.
- A tile's sum of differences over the root of the sum of their squares. Nothing is assumed but that a difference is as likely
  positive as negative, which is so where both sides draw from like distributions, however heavy their tails: a firefly
  enlarges the sum and the root alike. The bound is that of Bentkus and Dzindzalieta (A tight Gaussian bound for weighted sums
  of Rademacher random variables, Bernoulli 21, 2015): at most 3.18 times the normal distribution's tail. Rejected: Student's t
  here, which at such levels is five times too sure where all differences of a tile have the same size.

Rejected: SciPy, for one function, which an add-on inside Blender does not have.
"""

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# 1 / (4 P(Z ≥ √2)), the best constant there is.
_RADEMACHER = 1.0 / (2.0 * math.erfc(1.0))

# Beyond, Student's t is the normal distribution within 0.2 % of the critical values used here, and on the safe side of it.
_MOST_FREEDOM = 1e4
_CONVERGED, _MOST_TERMS, _TINY = 1e-13, 2000, 1e-300


def sidak(level: float, count: int) -> float:
    """The level of each of `count` tests at which all of them together raise a false alarm with the probability `level`."""
    return -math.expm1(math.log1p(-level) / max(count, 1))


def sign_tail(errors: float) -> float:
    """The probability, at most, that a sum of symmetric independent terms is so many roots of their sum of squares from 0."""
    return min(1.0, _RADEMACHER * math.erfc(errors / math.sqrt(2.0)))


@lru_cache(maxsize=256)
def sign_critical(level: float) -> float:
    """The number that `sign_tail` brings to `level`."""
    return _bisected(lambda errors: sign_tail(errors) > level, 0.0, 38.0)


def student_tail(t: Array, freedom: Array) -> Array:
    """Two-sided tail of Student's t: the regularized incomplete beta function I_x(ν/2, ½) at x = ν/(ν + t²).

    By its continued fraction (Abramowitz and Stegun 26.5.8) after Lentz, for x below its mean; else by 1 − I_{1−x}(½, ν/2).
    """
    half, squared = np.broadcast_arrays(np.asarray(freedom, float) / 2.0, np.asarray(t, float) ** 2)
    inside, outside = 2.0 * half / (2.0 * half + squared), squared / (2.0 * half + squared)
    far = inside < (half + 1.0) / (half + 2.5)
    x, a, b = np.where(far, inside, outside), np.where(far, half, 0.5), np.where(far, 0.5, half)
    # The logarithm keeps x^(ν/2) exact where ν is large and x near 1.
    power = -half * np.log1p(squared / (2.0 * half)) + 0.5 * np.log(np.maximum(outside, _TINY))
    tail = np.exp(power - _log_beta(half)) / a * _beta_fraction(a, b, x)
    return np.where(far, tail, 1.0 - tail)


def student_critical(freedom: Array, level: float) -> Array:
    """The bound that |t| exceeds with the probability `level`, for each number of degrees of freedom (1 or more, not whole
    perhaps)."""
    inverse, critical = _student_table(level)
    return np.exp(np.interp(1.0 / np.clip(freedom, 1.0, _MOST_FREEDOM), inverse, critical))


def poisson_allowance(mean: float, level: float) -> int:
    """The least count that rare events of this mean exceed with at most the probability `level`."""
    if mean > 500.0:  # a normal distribution, and the first correction for its skewness
        z = sign_critical(level)
        return math.ceil(mean + z * math.sqrt(mean) + z * z / 6.0)
    count, probability = 0, math.exp(-mean)
    total = probability
    while 1.0 - total > level:
        count += 1
        probability *= mean / count
        total += probability
    return count


def tile_starts(length: int, size: int) -> NDArray[np.intp]:
    """The starts of the tiles of one axis: as even as can be, none smaller than `size` unless the axis is; 0 is one tile."""
    count = max(length // size, 1) if size else 1
    return np.arange(count) * length // count


def tile_sums(values: Array, size: int) -> Array:
    """(rows, columns, channels) sums of (height, width, channels) over tiles of at least size × size pixels."""
    down, across = (tile_starts(length, size) for length in values.shape[:2])
    return np.add.reduceat(np.add.reduceat(values, down, axis=0), across, axis=1)


def mean_around(values: Array) -> Array:
    """(rows, columns, channels): the mean of each 3 × 3 neighborhood, at the border of what there is of it."""
    for axis in (0, 1):
        if values.shape[axis] == 1:
            continue
        summed = values.copy()
        count = np.ones(values.shape[axis])
        here, there = [slice(None)] * 3, [slice(None)] * 3
        here[axis], there[axis] = slice(1, None), slice(None, -1)
        summed[tuple(here)] += values[tuple(there)]
        summed[tuple(there)] += values[tuple(here)]
        count[1:] += 1
        count[:-1] += 1
        values = summed / count.reshape([-1 if i == axis else 1 for i in range(3)])
    return values


@lru_cache(maxsize=64)
def _student_table(level: float) -> tuple[Array, Array]:
    """The logarithm of the critical t over 1/ν, fine enough to be interpolated."""
    inverse = np.concatenate([np.linspace(1.0 / _MOST_FREEDOM, 0.1, 128), np.linspace(0.1, 1.0, 129)[1:]])
    low, high = np.zeros(len(inverse)), np.full(len(inverse), math.log(2.0 / level) + 1.0)
    for _ in range(60):
        middle = (low + high) / 2.0
        above = student_tail(np.exp(middle), 1.0 / inverse) > level
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return inverse, high


def _beta_fraction(a: Array, b: Array, x: Array) -> Array:
    c, d = np.ones(x.shape), 1.0 / _nonzero(1.0 - (a + b) * x / (a + 1.0))
    value = d
    for m in range(1, _MOST_TERMS):
        for term in (
            m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)),
        ):
            d, c = 1.0 / _nonzero(1.0 + term * d), _nonzero(1.0 + term / c)
            value = value * d * c
        if (np.abs(d * c - 1.0) < _CONVERGED).all():
            break
    return value


def _nonzero(values: Array) -> Array:
    return np.where(np.abs(values) < _TINY, _TINY, values)


def _log_beta(a: Array) -> Array:
    """ln B(a, ½)."""
    return np.vectorize(lambda x: math.lgamma(x) + math.lgamma(0.5) - math.lgamma(x + 0.5))(a)


def _bisected(too_low: Callable[[float], bool], low: float, high: float) -> float:
    for _ in range(80):
        middle = (low + high) / 2.0
        low, high = (middle, high) if too_low(middle) else (low, middle)
    return high
