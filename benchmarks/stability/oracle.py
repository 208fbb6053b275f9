"""The text's formulas in so many digits that what the sweeps measure is not theirs."""

from collections.abc import Sequence

import mpmath
import numpy as np
from numpy.typing import NDArray

DIGITS = 80

Axis = list[mpmath.mpf]


def axes(eye: NDArray[np.float64], look_at: NDArray[np.float64], up: NDArray[np.float64]) -> tuple[Axis, Axis, Axis]:
    """(u, v, w) of one pose, (3,) each."""
    with mpmath.workdps(DIGITS):
        e, l, up = ([mpmath.mpf(float(number)) for number in vector] for vector in (eye, look_at, up))
        w = _unit([a - b for a, b in zip(e, l, strict=True)])
        u = _unit(_cross(up, w))
        return u, _cross(w, u), w


def rounded(axes: Sequence[Axis]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Axes as two arrays, (3, 3) each, high and low, whose sum they are to twice the digits of float64."""
    with mpmath.workdps(DIGITS):
        high = np.array([[float(number) for number in axis] for axis in axes])
        low = [[float(a - float(a)) for a in axis] for axis in axes]
    return high, np.array(low)


def _cross(a: Axis, b: Axis) -> Axis:
    return [a[j] * b[k] - a[k] * b[j] for j, k in ((1, 2), (2, 0), (0, 1))]


def _unit(vector: Axis) -> Axis:
    length = mpmath.sqrt(sum(number * number for number in vector))
    return [number / length for number in vector]
