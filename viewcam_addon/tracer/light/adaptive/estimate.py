"""How far a pixel's mean may be off, from its own samples and those of the pixels around it.

The samples of a pixel share its space out among them, so that their own variance over their number, s²/N, is 3 to 11 times the
variance of their mean. The means of their first and second half, apart by D, tell more: E[D²]/4 is the variance of the mean
where samples are independent, and 1.3 to 2 times that where it falls as N^−3/2 (measured: edges, area lamps, a sky). But of a
single pixel that is one number, and as often far too small as too large. So s²/N is multiplied by what D²/4 is in the mean over
8 × 8 pixels, over what s²/N is there.

Where all of N samples miss something, s² is too small. Its part of the pixel is then about 1/N or less, and its contrast is no
greater than what a neighbour saw, so that the pixel is off by about that contrast over N.

Rejected: stopping a pixel by its own s² or D² alone. What has missed a bright thing looks both darker and quieter than it
is, and would stop for that very reason.
"""

import numpy as np

from ...arrays import Floats

BLOCK = 8
"""Rows and columns over which the efficiency of samples is measured, counted from the picture's corner."""

# The weight in each block of what is measured over all of them.
_SHARED = 0.1
# Of the largest variance around over N²: a contrast c has a variance of c²/4 at most, and a part of the pixel that is anything
# from 0 to 1/N, whose mean square is 1/3N².
_MISSED = 4.0 / 3.0


def efficiency(own: Floats, apart: Floats) -> Floats:
    """(height, width): the variance of a mean over s²/N, 1 at most.

    own, apart : (height, width), s²/N and D²/4, 0 where they are not known.
    """
    total, known = own.sum(), np.count_nonzero(own)
    if total == 0.0:
        return np.ones(own.shape)
    weight = _SHARED * BLOCK**2 * total / known
    there = _over_blocks(apart) + weight * (apart.sum() / total)
    by_block = np.minimum(there / (_over_blocks(own) + weight), 1.0)
    return np.repeat(np.repeat(by_block, BLOCK, axis=0), BLOCK, axis=1)[: own.shape[0], : own.shape[1]]


def missed(spread: Floats, samples: int) -> Floats:
    """(height, width): the variance of what so many samples may not have seen.

    spread : (height, width), the variance of each pixel's samples.
    """
    return largest_around(spread) * (_MISSED / samples**2)


def largest_around(values: Floats) -> Floats:
    """The largest in the 3 × 3 pixels round each."""
    for axis in (0, 1):
        largest = values.copy()
        here, there = [slice(None)] * 2, [slice(None)] * 2
        here[axis], there[axis] = slice(1, None), slice(None, -1)
        np.maximum(largest[tuple(here)], values[tuple(there)], out=largest[tuple(here)])
        np.maximum(largest[tuple(there)], values[tuple(here)], out=largest[tuple(there)])
        values = largest
    return values


def _over_blocks(values: Floats) -> Floats:
    """Sums over blocks; those at the far borders are smaller."""
    down, across = (np.arange(0, length, BLOCK) for length in values.shape)
    return np.add.reduceat(np.add.reduceat(values, down, axis=0), across, axis=1)
