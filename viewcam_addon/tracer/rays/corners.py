"""Which rays pass so close by a corner of triangles that Embree may let them slip through.

Embree tells on which side of an edge a ray d passes by the sign of d·((Q − P) × (Q + P)), P and Q the ends of the edge. Both
triangles of an edge get the same number, so no ray passes between them. But each edge is rounded for itself, and where edges
meet a ray can lie outside of all their triangles: of the rays that aim at the vertices of a ball of a million triangles, one in
a hundred leaves it. visibility.py traces what lies beside such rays too.

They are found by asking whether the cell of the view plane that a ray crosses holds a corner. Cells are as wide as 2⁻¹² of
their distance from the view axis, to serve short and long lenses alike, and of those taken only two hashes each are kept (a
Bloom filter): some rays are suspected without reason, but none is overlooked.

Rejected: triangles enlarged until they overlap, which moves outlines for all rays; a small triangle before each vertex, which
takes Embree as long again to build; vertices and rays on separate grids, which costs each two bits of its place.

The rays of a picture's pixel centres are found the other way round: of each corner it is known which pixel it stands in.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Float32s, Floats, Indices
from ..compiled.standing import or_compiled
from .tables import made_once

# How far from a corner, in each coordinate of the view plane, Embree can err, relative to the corner's distance r from the view
# axis, and to r² beyond 1, where rays run aslant. In units of 2⁻²⁴: 2 for rounding the vertex, X and Z, 2 for the sum Q + P, 1
# for the ray and 6 for products and sums, times √2 as an edge may run askew. The most that was seen is 5.
REACH = 16 * 2.0**-24

# Beyond, at 89.1° from the view axis, twice the reach is more than a cell: all rays are suspected there.
FARTHEST = 64.0

# Float32's multiples of 2⁻¹² of a power of two are what is left of a number to which 1.5 · 2¹¹ times that power is added.
EXPONENT, GRAIN = np.int32(0x7F800000), np.int32((11 << 23) + (1 << 22))

_PLACES_PER_CORNER = 32  # of which each takes two: of a thousand rays that pass by no corner, two are suspected
_WHOLE = np.uint64(64)
_BIT = np.array([1, 2, 4, 8, 16, 32, 64, 128], np.uint8)
MIXER = np.uint64(0x9E3779B97F4A7C15)  # 2⁶⁴ over the golden ratio, whose multiples spread evenly


# Corners at a time, which stay in a core's cache.
_PIECE = 1 << 15


class Corners:
    """The corners of triangles, as cells of the view plane.

    vertices : (3, n) float64, camera space.
    """

    def __init__(self, vertices: Floats) -> None:
        self._vertices = vertices

    @made_once
    def _filter(self) -> tuple[NDArray[np.uint8], np.uint64]:
        """The places that are taken, eight a byte, and how many bits the number of a place has."""
        x, y = _seen(self._vertices, FARTHEST)
        distance = np.maximum(np.abs(x), np.abs(y))
        reach = _reach(distance)
        bits = np.uint64(max((len(x) * _PLACES_PER_CORNER).bit_length(), 3))
        taken = np.zeros(1 << int(bits), bool)
        for farther in (-reach, reach):  # at powers of two, where cells of two widths meet
            grain = _grain((distance + farther).astype(np.float32))
            for right in (-reach, reach):
                for up in (-reach, reach):
                    cell = _cell((x + right).astype(np.float32), (y + up).astype(np.float32), grain)
                    for hashed in (cell, cell << bits):  # the second from the bits behind the first
                        taken[(hashed >> (_WHOLE - bits)).view(np.int64)] = True
        return np.packbits(taken, bitorder="little"), bits  # to stay in a core's cache

    def near(self, x: Floats, y: Floats) -> Indices:
        """Which of the rays (x, y, 1) pass close by a corner, perhaps. x, y : (n,)."""
        return suspects(*self._filter, x, y)

    def near_pixels(self, x: Floats, y: Floats) -> Indices | None:
        """Which pixels' centres rays pass close by a corner through: their numbers, counted along the rows, in order.

        x : (width,) of the columns. y : (height,) of the rows. None where a corner may concern several pixels, or all.
        """
        if min(len(x), len(y)) < 2:
            return None
        across, above = (x[-1] - x[0]) / (len(x) - 1), (y[-1] - y[0]) / (len(y) - 1)
        farthest = max(np.abs(x).max(), np.abs(y).max())
        if not (farthest <= FARTHEST and _reach(farthest) < 0.4 * min(across, above)):
            return None
        parts = (self._vertices[:, first : first + _PIECE] for first in range(0, self._vertices.shape[1], _PIECE))
        return np.unique(np.concatenate([np.empty(0, np.intp), *(_close_pixels(part, x, y, farthest) for part in parts)]))


def _close_pixels(vertices: Floats, x: Floats, y: Floats, farthest: float) -> Indices:
    """Those of `near_pixels` that pass close by some of the corners. farthest : from the view axis."""
    across, above = (x[-1] - x[0]) / (len(x) - 1), (y[-1] - y[0]) / (len(y) - 1)
    right, up = _seen(vertices, 2 * farthest)
    column, row = np.rint((right - x[0]) / across).astype(np.intp), np.rint((up - y[0]) / above).astype(np.intp)
    inside = np.flatnonzero((column >= 0) & (column < len(x)) & (row >= 0) & (row < len(y)))
    column, row, right, up = column[inside], row[inside], right[inside], up[inside]
    reach = _reach(np.maximum(np.abs(right), np.abs(up)))
    close = (np.abs(x[column] - right) <= reach) & (np.abs(y[row] - up) <= reach)
    return row[close] * len(x) + column[close]


def _seen(vertices: Floats, farthest: float) -> tuple[Floats, Floats]:
    """Where in the view plane the corners are that stand before the eye and no farther than this from its axis."""
    with np.errstate(all="ignore"):
        x, y = vertices[:2] / vertices[2]
        seen = np.flatnonzero((vertices[2] > 0) & (np.abs(x) <= farthest) & (np.abs(y) <= farthest))
    return x[seen], y[seen]


def _reach(distance: Floats | float) -> Floats | float:
    """How far from a corner, in each coordinate of the view plane, rays are suspected."""
    return REACH * distance * np.maximum(distance, 1.0)


@or_compiled
def suspects(taken: NDArray[np.uint8], bits: np.uint64, x: Floats, y: Floats) -> Indices:
    """Which rays cross a cell that is taken in both hashes. taken : the places, eight a byte. bits : of a place's number."""
    x, y = x.astype(np.float32), y.astype(np.float32)
    distance = np.abs(x)
    np.maximum(distance, np.abs(y), out=distance)
    if not distance.max(initial=0.0) <= FARTHEST:
        far = ~(distance <= FARTHEST)
        inner = np.flatnonzero(~far)
        return np.sort(np.concatenate([np.flatnonzero(far), inner[suspects.plain(taken, bits, x[inner], y[inner])]]))
    cell = _cell(x, y, _grain(distance))
    suspected = np.flatnonzero(_is_taken(taken, bits, cell))
    return suspected[_is_taken(taken, bits, cell[suspected] << bits) != 0]


def _is_taken(taken: NDArray[np.uint8], bits: np.uint64, cell: NDArray[np.uint64]) -> NDArray[np.uint8]:
    """Not 0 where the place of a cell is taken."""
    place = (cell >> (_WHOLE - bits)).view(np.int64)
    bit = _BIT.take(place & 7)
    place >>= 3
    bit &= taken.take(place, mode="clip")
    return bit


def _grain(distance: Float32s) -> Float32s:
    """What makes cells of the numbers it is added to, from their distance to the view axis, which it overwrites."""
    bits = distance.view(np.int32)
    bits &= EXPONENT
    bits += GRAIN
    return distance


def _cell(x: Float32s, y: Float32s, grain: Float32s) -> NDArray[np.uint64]:
    """A well-mixed number for each cell."""
    cell = np.empty((len(x), 2), np.float32)
    np.add(x, grain, out=cell[:, 0])
    np.add(y, grain, out=cell[:, 1])
    mixed = cell.view(np.uint64)[:, 0]
    mixed *= MIXER
    return mixed
