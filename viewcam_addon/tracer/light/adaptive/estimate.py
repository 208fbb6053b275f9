"""How far a pixel's mean may be off, from its own samples and those of the pixels around it.

The samples of a pixel share its space out among them, so that their own variance over their number, s²/N, is 3 to 11 times the
variance of their mean. The means of their first and second half, apart by D, tell more: E[D²]/4 is the variance of the mean
where samples are independent, and 1.3 to 2 times that where it falls as N^−3/2 (measured: edges, area lamps, a sky). But of a
single pixel that is one number, and as often far too small as too large. So s²/N is multiplied by what D²/4 is in the mean over
8 × 8 pixels, over what s²/N is there.

Where all of N samples miss something, s² is too small. Its part of the pixel is then about 1/N or less, and its contrast is no
greater than what a neighbour saw, so that the pixel is off by less than that contrast over N. And no pixel stops because it is
quieter than those around it are in the mean.

Rejected: stopping a pixel by its own s² or D² alone. What has missed a bright thing looks both darker and quieter than it
is, and would stop for that very reason. It still does where all around have missed it, too: of pictures of an area lamp and a
sky, whose pixels get 26 samples for an error of 0.015, the mean is off by 1e-4 (by 3e-4 without what is said above).
"""

import numpy as np

from ...arrays import Floats

BLOCK = 8
"""Rows and columns over which the efficiency of samples is measured, counted from the picture's corner."""

# The weight in each block of what is measured over all of them.
_SHARED = 0.1
# Of the largest variance around over N²: one of a contrast c is c²/4 at most.
_MISSED = 4.0


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


def missed(spread: Floats, glints: Floats, samples: int) -> Floats:
    """(height, width): the variance of what so many samples may not have seen.

    spread : (height, width), the variance of each pixel's samples. glints : (height, width), see glints.py.
    """
    return np.maximum(largest_around(spread) * _MISSED, glints) / samples**2


def largest_around(values: Floats) -> Floats:
    """The largest in the 3 × 3 pixels round each."""
    for axis in (0, 1):
        padded = np.pad(values, [(1, 1) if axis == i else (0, 0) for i in (0, 1)])
        before, after = np.split(padded, [-2], axis)[0], np.split(padded, [2], axis)[1]
        values = np.maximum(np.maximum(before, after), values)
    return values


def mean_around(values: Floats) -> Floats:
    """The mean of the 3 × 3 pixels round each, those beside the picture being 0."""
    for axis in (0, 1):
        padded = np.pad(values, [(1, 1) if axis == i else (0, 0) for i in (0, 1)])
        values = (np.split(padded, [-2], axis)[0] + np.split(padded, [2], axis)[1] + values) / 3.0
    return values


def _over_blocks(values: Floats) -> Floats:
    """Sums over blocks; those at the far borders are smaller."""
    down, across = (np.arange(0, length, BLOCK) for length in values.shape)
    return np.add.reduceat(np.add.reduceat(values, down, axis=0), across, axis=1)
