"""Kernel of rays/corners.py: which rays pass close by a corner of triangles."""

import numpy as np

from ..rays import corners
from .packets import kernel

_FARTHEST, _EXPONENT, _GRAIN, _MIXER = np.float32(corners.FARTHEST), corners.EXPONENT, corners.GRAIN, corners.MIXER
_ONE, _SEVEN, _THREE, _HALF, _WHOLE = (np.uint64(number) for number in (1, 7, 3, 32, 64))


@kernel
def _is_taken(taken, rest, cell):
    place = cell >> rest
    return (np.uint64(taken[place >> _THREE]) >> (place & _SEVEN)) & _ONE


@kernel
def _suspects(taken, bits, x, y, suspected):
    """Write the suspects' numbers into `suspected`; how many they are."""
    count = 0
    rest = _WHOLE - bits
    for ray in range(x.size):
        across, above = np.float32(x[ray]), np.float32(y[ray])
        distance = max(abs(across), abs(above))
        if distance <= _FARTHEST:
            grain = np.int32((np.float32(distance).view(np.int32) & _EXPONENT) + _GRAIN).view(np.float32)
            low, high = np.float32(across + grain).view(np.uint32), np.float32(above + grain).view(np.uint32)
            cell = (np.uint64(low) | (np.uint64(high) << _HALF)) * _MIXER
            if not (_is_taken(taken, rest, cell) and _is_taken(taken, rest, cell << bits)):
                continue
        suspected[count] = ray
        count += 1
    return count


def suspects(taken, bits, x, y):
    suspected = np.empty(len(x), np.intp)
    return suspected[: _suspects(taken, bits, x, y, suspected)]
