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

from ...arrays import Floats, Indices, gather
from ...compiled.standing import or_compiled

BLOCK = 8
"""Rows and columns over which the efficiency of samples is measured, counted from the picture's corner."""

# The weight in each block of what is measured over all of them.
_SHARED = 0.1
# Pixels to either side that tell what a pixel's variance is.
AROUND = 2


def blocks(pixels: Indices, width: int) -> Indices:
    """(n,): the blocks that pixels lie in, which are numbered along the rows of a picture of this width."""
    rows, columns = np.divmod(pixels, width)
    return rows // BLOCK * -(-width // BLOCK) + columns // BLOCK


def efficiency(own: Floats, apart: Floats, block: Indices) -> Floats:
    """(n,): the variance of pixels' means over s²/N, 1 at most. own, apart : (n,), s²/N and D²/4. block : (n,), theirs."""
    total, known = own.sum(), np.count_nonzero(own)
    if total == 0.0:
        return np.ones(len(own))
    weight = _SHARED * BLOCK**2 * total / known
    there = np.bincount(block, apart) + weight * (apart.sum() / total)
    return gather(np.minimum(there / (np.bincount(block, own) + weight), 1.0), block)


@or_compiled
def mean_around(values: Floats, known: NDArray[np.bool_], pixels: Indices) -> Floats:
    """(n,): the mean of the known values round pixels, without their own; 0 where none is known.

    values, known : (height, width). pixels : (n,), row · width + column.
    """
    total, number = _sum_around(np.where(known, values, 0.0)), _sum_around(known.astype(np.float64))
    return gather(np.maximum(total, 0.0) / np.maximum(number, 1.0), pixels)


def _sum_around(values: Floats) -> Floats:
    size, (height, width) = 2 * AROUND + 1, values.shape
    padded = np.pad(values, AROUND)
    rows = sum(padded[shift : shift + height] for shift in range(size))
    return (sum(rows[:, shift : shift + width] for shift in range(size)) - values).ravel()
