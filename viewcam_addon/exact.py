"""Sums, products and cross products whose rounding errors are kept instead of lost.

The direction "right" of a camera is up × (e − l). Close to vertical this cross product cancels nearly all of its digits, and
the rounding of e − l and of each product becomes the roll of the picture. Here e − l is kept as an unevaluated pair
high + low, each product as the pair of its rounded value and its error, and their sum is rounded once, at the end.

Beside them stand quotients beyond float64's range, as fraction · 2^exponent, for cameras and points of any size.

Every function takes floats or float64 arrays and runs the same formulas on both. A vector is a triple of floats, so that a
single pose costs no array at all, or one array of (3, n), so that few vectors cost few calls of NumPy.

Sources: two_sum is Knuth's (TAOCP 2, 4.2.2), two_product Dekker's (Numer. Math. 18, 1971), the array sum is Kahan's
distillation as analyzed by Ogita, Rump and Oishi (SIAM J. Sci. Comput. 26, 2005). math.fma would replace Dekker's
splitting, but Python has it from 3.13 only. Rejected: mpmath or Fraction for every pose (a hundred times slower; Python's
whole numbers serve the rare inputs whose products would leave float64's range), and numpy.longdouble (64 bits of mantissa on
some machines, 53 on others).
"""

import functools
import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Number = float | NDArray[np.float64]
Vector = tuple[float, float, float] | NDArray[np.float64]
Components = tuple[float, ...] | NDArray[np.float64]
Exponent = int | NDArray[np.intc]
Index = int | NDArray[np.intp]

# Terms of a sum settle in as many passes as there are terms or fewer; what has not settled by then is reported.
_DISTILLATION_PASSES = 12
_SPLITTER = 2.0**27 + 1
# In vectors whose largest component is about 1, the product of two components this small still has an exact error term.
SMALLEST_FACTOR = 2.0**-400
# The difference of two numbers below this can't overflow, nor can the splitting of its parts.
LARGEST_PART = 2.0**1000
# The axes that make each component of a cross product: of single vectors one by one, of arrays at once.
_NEXT, _AFTER_NEXT = np.array([1, 2, 0]), np.array([2, 0, 1])
_EACH = tuple(zip(_NEXT.tolist(), _AFTER_NEXT.tolist(), strict=True))
_BOTH_WAYS = np.concatenate([_NEXT, _AFTER_NEXT]), np.concatenate([_AFTER_NEXT, _NEXT])


def two_sum(a: Number, b: Number) -> tuple[Number, Number]:
    """The rounded sum and its error: a + b = sum + error, exactly, unless the sum overflows."""
    total = a + b
    b_part = total - a
    return total, (a - (total - b_part)) + (b - b_part)


def two_product(a: Number, b: Number) -> tuple[Number, Number]:
    """The rounded product and its error: a · b = product + error, exactly, for |a|, |b| < 2^996 and |a · b| > 2^-969 or 0."""
    product = a * b
    # Each factor in two parts of at most 26 significant bits. Not by a function: an edit in Blender multiplies 36 times.
    shifted_a, shifted_b = _SPLITTER * a, _SPLITTER * b
    a_high, b_high = shifted_a - (shifted_a - a), shifted_b - (shifted_b - b)
    a_low, b_low = a - a_high, b - b_high
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def sum_terms(terms: Sequence[Number]) -> tuple[Number, Number, bool | NDArray[np.bool_]]:
    """The sum of `terms`, at least four, as a pair high + low, high correctly rounded, whatever cancels.

    The third value says where the sum has settled (always, for floats): there floats and arrays give the same bits.
    """
    if isinstance(terms[0], float):
        high = math.fsum(terms)
        return high, math.fsum([*terms, -high]), True
    settled = np.zeros(np.shape(terms[0]), dtype=bool)
    parts = list(terms)
    for _ in range(_DISTILLATION_PASSES):
        before = list(parts)
        for i in range(1, len(parts)):
            parts[i], parts[i - 1] = two_sum(parts[i], parts[i - 1])
        settled = np.logical_and.reduce([new == old for new, old in zip(parts, before, strict=True)])
        if settled.all():
            break
    *_, fourth, third, low, high = parts
    return high, low, settled & ~_misrounded(high, low, third) & ~_misrounded(low, third, fourth)


def _misrounded(high: NDArray[np.float64], low: NDArray[np.float64], rest: NDArray[np.float64]) -> NDArray[np.bool_]:
    """True where high may be a step off: low is half a step, and so was rounded to even with no regard to what comes after."""
    return (rest != 0) & ((high + 2 * low) - high == 2 * low)


def difference(a: Vector, b: Vector) -> tuple[Vector, Vector]:
    """a − b as a pair of vectors high + low, exactly, unless it overflows."""
    if not isinstance(a[0], float):
        return two_sum(a, -b)
    pairs = [two_sum(x, -y) for x, y in zip(a, b, strict=True)]
    return tuple(high for high, _ in pairs), tuple(low for _, low in pairs)


def cross(a: Vector, b_high: Vector, b_low: Vector) -> tuple[Vector, Vector, bool | NDArray[np.bool_]]:
    """a × (b_high + b_low) as a pair of vectors, each component correctly rounded however much cancels.

    The third value says where all three sums have settled. Non-zero components must not be smaller than `SMALLEST_FACTOR`.
    """
    zeros = [not x if isinstance(x, float) else not x.any() for x in a]
    if zeros.count(True) == 2:
        i = zeros.index(False)
        size = a[i]
        # As of an up that is an axis: no product rounds.
        if abs(size) == 0.5 if isinstance(size, float) else (np.abs(size) == 0.5).all():
            return _along_axis(i, size, b_high), _along_axis(i, size, b_low), True
    if not isinstance(a[0], float):
        high, low, settled = sum_terms(_cross_terms(a, b_high, b_low, _NEXT, _AFTER_NEXT))
        return high, low, settled.all(0)
    high, low, settled = zip(*(sum_terms(_cross_terms(a, b_high, b_low, j, k)) for j, k in _EACH), strict=True)
    return high, low, all(settled)


def _along_axis(i: int, size: Number, b: Vector) -> Vector:
    """a × b for an a of that size along axis i, without −0."""
    j, k, zero = (i + 1) % 3, (i + 2) % 3, size - size
    components = {i: zero + 0.0 * b[i], j: zero - size * b[k], k: zero + size * b[j]}
    vector = components[0], components[1], components[2]
    return vector if isinstance(size, float) else np.array(vector)


def _cross_terms(a: Vector, b_high: Vector, b_low: Vector, j: Index, k: Index) -> list[Number]:
    return [
        *two_product(a[j], b_high[k]),
        *two_product(a[j], b_low[k]),
        *two_product(-a[k], b_high[j]),
        *two_product(-a[k], b_low[j]),
    ]


def cross_of_perpendicular(a_high: Vector, a_low: Vector, b_high: Vector, b_low: Vector) -> Vector:
    """a × b for perpendicular a and b, each given as high + low: every component rounded once, give or take 2⁻¹⁰⁰ |a| |b|.

    Two perpendicular vectors lose nothing in their product as a whole, so the second-order terms need no care.
    """

    def product(j: Index, k: Index) -> tuple[Number, Number, Number]:
        return *two_product(a_high[j], b_high[k]), a_high[j] * b_low[k] + a_low[j] * b_high[k]

    def component(first: Sequence[Number], second: Sequence[Number]) -> Number:
        total, total_error = two_sum(first[0], -second[0])
        return total + (total_error + (first[1] - second[1]) + (first[2] - second[2]))

    if not isinstance(a_high[0], float):
        products = product(*_BOTH_WAYS)
        return component([each[:3] for each in products], [each[3:] for each in products])
    return tuple(component(product(j, k), product(k, j)) for j, k in _EACH)


def length(a: Vector) -> Number:
    """|a| to within one unit in the last place, of a vector whose largest component is about 1 (see `scaled_to_one`)."""
    is_single = isinstance(a[0], float)
    squares = map(two_product, a, a) if is_single else zip(*two_product(a, a), strict=True)
    total, error = next(squares)
    for square, square_error in squares:
        total, sum_error = two_sum(total, square)
        error = error + (sum_error + square_error)
    total = total + error
    return math.sqrt(total) if is_single else np.sqrt(total)


def scaled_to_one(*vectors: Vector) -> list[Vector]:
    """The vectors times the power of two that brings the largest component of the *first* into [½, 1)."""
    if isinstance(vectors[0][0], float):
        exponent = math.frexp(max(map(abs, vectors[0])))[1]
        return [tuple(math.ldexp(component, -exponent) for component in vector) for vector in vectors]
    exponent = np.frexp(largest_component(vectors[0]))[1]
    return [np.ldexp(vector, -exponent) for vector in vectors]


def joined(*vectors: Vector) -> Components:
    """The components of vectors one after the other, so that what is asked of all of them is asked once."""
    if isinstance(vectors[0][0], float):
        return tuple(itertools.chain(*vectors))
    return np.concatenate(vectors)


def largest_component(a: Components) -> Number:
    """max |aᵢ|, elementwise."""
    if isinstance(a[0], float):
        return max(map(abs, a))
    return np.abs(a).max(axis=0)


def are_factors(vector: Components, scaled: Components) -> bool | NDArray[np.bool_]:
    """True where every component of `scaled`, which was `vector` before, is 0 or large enough for `cross`."""
    if not isinstance(vector[0], float):
        return ((vector == 0) | (np.abs(scaled) >= SMALLEST_FACTOR)).all(axis=0)
    return all(before == 0 or abs(after) >= SMALLEST_FACTOR for before, after in zip(vector, scaled, strict=True))


def quotient(a: Number, b: float, divisor: float) -> tuple[Number, Exponent]:
    """(a − b) / divisor of any size, as fraction · 2^exponent with |fraction| < 2: of two roundings, whatever its size."""
    if isinstance(a, float):
        quartered = 2 if max(abs(a), abs(b)) > LARGEST_PART else 0
        fraction, exponent = math.frexp(math.ldexp(a, -quartered) - math.ldexp(b, -quartered))
    else:
        quartered = 2 * (np.maximum(np.abs(a), abs(b)) > LARGEST_PART)
        fraction, exponent = np.frexp(np.ldexp(a, -quartered) - np.ldexp(b, -quartered))
    divisor, below = math.frexp(divisor)
    return fraction / divisor, exponent - below + quartered


def of_one_scale(*numbers: tuple[Number, Exponent]) -> list[Number]:
    """Numbers of any size, each fraction · 2^exponent and not all 0, times the power of two that makes the largest about 1."""
    if isinstance(numbers[0][0], float):
        largest = max(exponent for fraction, exponent in numbers if fraction)
        return [math.ldexp(fraction, exponent - largest) for fraction, exponent in numbers]
    absent = np.iinfo(np.intc).min // 2  # the exponent of zero is below all others
    largest = functools.reduce(np.maximum, (np.where(fraction == 0, absent, exponent) for fraction, exponent in numbers))
    return [np.ldexp(fraction, exponent - largest) for fraction, exponent in numbers]


def whole_number_cross(
    a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]
) -> tuple[tuple[Vector, Vector], tuple[Vector, Vector], float]:
    """b − c and a × (b − c) for floats of any size: every float64 is a whole number of 2⁻¹⁰⁷⁴, and Python's have no end.

    Returns two pairs of vectors high + low, each scaled so that its largest component is ±1 (what is smaller than float64's
    range beside it becomes 0), and the largest component that the product would have if a and b − c were so scaled before.
    """
    a, b, c = (tuple(map(_in_smallest_units, vector)) for vector in (a, b, c))
    apart = tuple(x - y for x, y in zip(b, c, strict=True))
    product = tuple(a[j] * apart[k] - a[k] * apart[j] for j, k in ((1, 2), (2, 0), (0, 1)))
    largest_a, largest_apart, largest_product = (max(map(abs, vector)) for vector in (a, apart, product))
    return (
        _pair_of_floats(apart, largest_apart),
        _pair_of_floats(product, largest_product or 1),
        largest_product / (largest_a * largest_apart),
    )


def _in_smallest_units(number: float) -> int:
    numerator, denominator = number.as_integer_ratio()
    return numerator * (2**1074 // denominator)


def _pair_of_floats(vector: tuple[int, ...], unit: int) -> tuple[Vector, Vector]:
    """The vector / unit; Python rounds the quotient of two whole numbers once, whatever their size."""
    high = tuple(component / unit for component in vector)
    ratios = (rounded.as_integer_ratio() for rounded in high)
    low = (
        (component * denominator - numerator * unit) / (unit * denominator)
        for component, (numerator, denominator) in zip(vector, ratios, strict=True)
    )
    return high, tuple(low)
