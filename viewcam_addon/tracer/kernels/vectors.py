"""What kernels do with three numbers: vectors are tuples, which stay in registers."""

import math
from collections.abc import Callable

import numba
import numpy as np
from numpy.polynomial import Chebyshev

from ..light import scattering


def inlined(function: Callable) -> Callable:
    """The function as a part of the kernels that call it."""
    return numba.njit(nogil=True, error_model="numpy", forceinline=True)(function)


# Taylor's series of sine and cosine up to π/4, where the next terms are 5e-17 and 2e-18.
_SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(8))
_COSINE = tuple((-1) ** k / math.factorial(2 * k) for k in range(9))


@inlined
def turned(u):
    """scattering.turned, to 3e-16. The C library's tangent takes five times as long."""
    quarter = np.rint(4 * u)
    angle = (4 * u - quarter) * (np.pi / 2)
    squared = angle * angle
    sine, cosine = _SINE[7], _COSINE[8]
    for k in range(7):
        sine = sine * squared + _SINE[6 - k]
    for k in range(8):
        cosine = cosine * squared + _COSINE[7 - k]
    sine *= angle
    place = int(quarter) & 3
    if place & 1:
        sine, cosine = cosine, -sine
    return (-cosine, -sine) if place & 2 else (cosine, sine)


def _arcsine_series() -> tuple[float, ...]:
    """The polynomial nearest to (arcsin √z / √z − 1) / z from 0 to ¼, highest power first: off by 2e-17."""
    terms = [math.comb(2 * k, k) / 4**k / (2 * k + 1) for k in range(1, 40)]
    nearest = Chebyshev.interpolate(np.polynomial.Polynomial(terms), 12, domain=[0.0, 0.25])
    return tuple(float(term) for term in nearest.convert(kind=np.polynomial.Polynomial).coef[::-1])


_ARCSINE = _arcsine_series()


@inlined
def arcsine(x):
    """np.arcsin, to 6e-16; the C library's takes three times as long."""
    size = abs(x)
    squared = x * x if size <= 0.5 else 0.5 * (1 - size)
    root = size if size <= 0.5 else np.sqrt(squared)
    value = 0.0
    for term in _ARCSINE:
        value = value * squared + term
    value = root + root * squared * value
    return np.copysign(value if size <= 0.5 else np.pi / 2 - 2 * value, x)


@inlined
def taken(table, column):
    """Three numbers of a column of a (3, n) array."""
    return table[0, column], table[1, column], table[2, column]


@inlined
def put(table, column, vector):
    table[0, column], table[1, column], table[2, column] = vector


@inlined
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def scaled(vector, factor):
    return vector[0] * factor, vector[1] * factor, vector[2] * factor


@inlined
def divided(vector, divisor):
    return vector[0] / divisor, vector[1] / divisor, vector[2] / divisor


@inlined
def sum_of(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def difference(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def axes_about(normal):
    """scattering.axes_about."""
    x, y, z = normal
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    xa = x * a
    signed = sign * x
    across = xa * y
    return (signed * xa + 1.0, sign * across, -signed), (across, y * (a * y) + sign, -y)


@inlined
def cosine_direction(normal, u, v):
    """scattering.cosine_direction, of two numbers."""
    height = u * (2.0 - 4 * scattering.POLE)
    height += 2 * scattering.POLE - 1.0
    across = np.sqrt(1.0 - height * height)
    x, y = turned(v)
    direction = across * x + normal[0], across * y + normal[1], height + normal[2]
    length = np.sqrt(dot(direction, direction))
    return divided(direction, length), length * (0.5 / np.pi)
