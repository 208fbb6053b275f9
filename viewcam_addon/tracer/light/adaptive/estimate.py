"""How far a pixel's mean may be off, from its own samples and those of the pixels around it.

The samples of a pixel share its space out among them, so that their own variance over their number, s²/N, is 3 to 11 times the
variance of their mean. The means of their first and second half, apart by D, tell more: E[D²]/4 is the variance of the mean
where samples are independent, and 1.3 to 2 times that where it falls as N^−3/2 (measured: edges, area lamps, a sky). But of a
single pixel that is one number, and as often far too small as too large. So s²/N is multiplied by what D²/4 is in the mean over
8 × 8 pixels, over what s²/N is there.

Where light is random, a pixel's own samples have no say in how many it gets. What has missed a bright thing looks both darker
and quieter than it is, and would stop for that very reason, while its neighbour, which met it, would go on and average it away:
light would be lost. So s² is the mean of the pixels around, without the pixel itself. Measured at a Cornell box with a mirror
and a lamp that it shows (level `path`, E = 0.05): pixels that stop by themselves make the picture's tiles too dark by 16 of
their standard errors, those that stop by the larger of themselves and their neighbours by 1.4, these by 0.5. The price is a
thing that one pixel alone meets: it keeps the noise that its neighbours have not. Outlines make such pixels, but run through
neighbours, too; small things that shine are looked for where they are (glints.py).

Where no light is random, only what stands in a pixel is, and no sample is much brighter than all others: there the larger of
both counts.

Rejected: stopping a pixel by its own s² or D² alone.
"""

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats

BLOCK = 8
"""Rows and columns over which the efficiency of samples is measured, counted from the picture's corner."""

# The weight in each block of what is measured over all of them.
_SHARED = 0.1
# Pixels to either side that tell what a pixel's variance is.
_AROUND = 2


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


def mean_around(values: Floats, known: NDArray[np.bool_]) -> Floats:
    """(height, width): the mean of the known ones round each, without itself; 0 where none is known."""
    total, number = _sum_around(np.where(known, values, 0.0)), _sum_around(known.astype(np.float64))
    return np.maximum(total, 0.0) / np.maximum(number, 1.0)


def _sum_around(values: Floats) -> Floats:
    size, (height, width) = 2 * _AROUND + 1, values.shape
    padded = np.pad(values, _AROUND)
    rows = sum(padded[shift : shift + height] for shift in range(size))
    return sum(rows[:, shift : shift + width] for shift in range(size)) - values


def _over_blocks(values: Floats) -> Floats:
    """Sums over blocks; those at the far borders are smaller."""
    down, across = (np.arange(0, length, BLOCK) for length in values.shape)
    return np.add.reduceat(np.add.reduceat(values, down, axis=0), across, axis=1)
