"""Which pixels straight strokes in space cross, seen from the eye.

A stroke is clipped to the pyramid of the picture before it is divided by its depth, so that it may reach behind the eye. In the
picture it is walked along its longer side, column by column or row by row: in each it crosses one square, or two, or by its
margin three. Every square that comes within the margin of the stroke is found, up to one margin more at its ends.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...pinhole import Pinhole
from ..arrays import Floats, Indices, gather

# What float64's rounding can move a place in the picture by is far less than this, in pixels.
LEAST_MARGIN = 2.0**-20


@dataclass(frozen=True, eq=False)
class Pieces:
    """The parts of strokes that lie in one pixel each, and a place on each of them.

    stroke : (k,) which. pixel : (k,) row · width + column. nearness : (k,) float64, one over the depth of the place.
    along, aside : (k,) float64, where it is, along the picture's axis that the stroke runs along, and along the other. slope :
    (k,) of the one against the other, from −1 to 1. steep : (k,) bool, whether the stroke runs along columns.
    """

    stroke: Indices
    pixel: Indices
    nearness: Floats
    along: Floats
    aside: Floats
    slope: Floats
    steep: NDArray[np.bool_]

    def places(self, some: Indices) -> Floats:
        """(2, n) columns and rows."""
        along, aside, steep = self.along[some], self.aside[some], self.steep[some]
        return np.where(steep, [aside, along], [along, aside])

    def across(self, some: Indices) -> Floats:
        """(2, n) unit vectors of the picture at right angles to the strokes."""
        slope, steep = self.slope[some], self.steep[some]
        one = np.ones_like(slope)
        return np.where(steep, [one, -slope], [-slope, one]) / np.sqrt(1 + slope * slope)


class Canvas:
    """The picture as a grid of squares."""

    def __init__(self, camera: Pinhole, clip: tuple[float, float]) -> None:
        self.width, self.height = camera.width, camera.height
        self.distance, self._principal = camera.distance, camera.principal_point
        self._clip = clip
        # A pixel beyond the picture on all sides.
        self.x, self.y = camera.view_plane([-1.0, self.width + 1.0], [-1.0, self.height + 1.0])

    def planes(self, points: Floats) -> list[Floats]:
        """Linear functions of points (3, n), each (n,), all positive or 0 where they lie in the pyramid of the picture."""
        x, y, z = points
        sides = [x - self.x[0] * z, self.x[1] * z - x, y - self.y[0] * z, self.y[1] * z - y]
        start, end = self._clip
        # What was computed to lie on a clip plane shall count as within.
        sides.append(z - start * (1 - 2.0**-40))
        if end < np.inf:
            sides.append(end * (1 + 2.0**-40) - z)
        return sides

    def place(self, points: Floats) -> Floats:
        """(3, n): column, row and one over the depth of points before the eye."""
        with np.errstate(all="ignore"):
            nearness = 1.0 / points[2]
            column = points[0] * nearness * self.distance[0] + self._principal[0]
            row = points[1] * nearness * self.distance[1] + self._principal[1]
        return np.stack([column, row, nearness])

    def squares(self, bounds: Floats) -> tuple[Indices, Indices]:
        """The pixels of rectangles: of which, and row · width + column, (k,) each.

        bounds : (4, n) least x, greatest x, least y, greatest y in the view plane at distance 1.
        """
        limits = []
        for axis, size in enumerate((self.width, self.height)):
            first, last = bounds[2 * axis : 2 * axis + 2] * self.distance[axis] + self._principal[axis]
            limits.append(np.floor(np.clip(first, 0, size)).astype(np.intp))
            limits.append(np.floor(np.clip(last, -1, size - 1)).astype(np.intp))
        left, right, low, high = limits
        width = np.maximum(right - left + 1, 0)
        count = width * np.maximum(high - low + 1, 0)
        which = np.repeat(np.arange(len(count)), count)
        row, column = np.divmod(np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count), width[which])
        return which, (row + low[which]) * self.width + column + left[which]

    def pieces(self, starts: Floats, ends: Floats, margin: float | Floats) -> Pieces:
        """Where strokes lie in the picture.

        starts, ends : (3, n), camera space. margin : in pixels, of each stroke or of all.
        """
        stroke, first, last = self.clipped(starts, ends)
        margin = np.broadcast_to(margin, starts.shape[1:])[stroke]
        steep = np.abs(last[1] - first[1]) > np.abs(last[0] - first[0])
        way = last - first
        turned = np.where(steep, way[1], way[0]) < 0
        first, way = np.where(turned, last, first), np.where(turned, -way, way)
        begin, length = np.where(steep, first[1], first[0]), np.where(steep, way[1], way[0])
        per_step = 1.0 / np.where(length > 0, length, np.inf)
        slope = np.where(steep, way[0], way[1]) * per_step
        lines = begin, begin + length, np.where(steep, first[0], first[1]), slope, first[2], way[2] * per_step, margin
        which, cell = _cells(*lines[:2], margin, np.where(steep, self.height, self.width))
        place, square, along = _squares(cell, *(gather(values, which) for values in (*lines[:4], margin)))
        which, cell = which[place], cell[place]
        steep = steep[which]
        column, row = np.where(steep, square, cell), np.where(steep, cell, square)
        kept = np.flatnonzero((column >= 0) & (column < self.width) & (row >= 0) & (row < self.height))
        which, along = which[kept], along[kept]
        begin, _, aside, slope, nearness, deepening, _ = (gather(values, which) for values in lines)
        onwards = along - begin
        return Pieces(
            stroke[which],
            row[kept] * self.width + column[kept],
            nearness + onwards * deepening,
            along,
            aside + onwards * slope,
            slope,
            steep[kept],
        )

    def clipped(self, starts: Floats, ends: Floats) -> tuple[Indices, Floats, Floats]:
        """Which strokes reach into the picture, and the places of both ends of what does, (3, k) each."""
        begins, finishes = self.planes(starts), self.planes(ends)
        outside = np.zeros(starts.shape[1], bool)
        crossing = np.zeros(starts.shape[1], bool)
        for begin, finish in zip(begins, finishes, strict=True):
            before, after = begin < 0, finish < 0
            outside |= before & after
            crossing |= before ^ after
        stroke = np.flatnonzero(~outside)
        first, last = gather(starts, stroke), gather(ends, stroke)
        cut = np.flatnonzero(crossing[stroke])
        kept = np.ones(len(stroke), bool)
        if len(cut):
            enters, leaves = np.zeros(len(cut)), np.ones(len(cut))
            for begin, finish in zip(begins, finishes, strict=True):
                begin, finish = begin[stroke[cut]], finish[stroke[cut]]
                with np.errstate(all="ignore"):
                    part = begin / (begin - finish)
                enters = np.where(begin < 0, np.fmax(enters, part), enters)
                leaves = np.where(finish < 0, np.fmin(leaves, part), leaves)
            kept[cut] = enters <= leaves
            a, b = first[:, cut], last[:, cut]
            first[:, cut], last[:, cut] = a + enters * (b - a), b - (1 - leaves) * (b - a)
        kept &= (first[2] > 0) & (last[2] > 0)
        if not kept.all():
            kept = np.flatnonzero(kept)
            stroke, first, last = stroke[kept], gather(first, kept), gather(last, kept)
        return stroke, self.place(first), self.place(last)


def _cells(begin: Floats, end: Floats, margin: Floats, size: Indices) -> tuple[Indices, Indices]:
    """The columns, or rows, that lines run through from `begin` to `end` along it: of which line, and which column."""
    least = np.clip(np.floor(begin - margin), 0, size).astype(np.intp)
    most = np.clip(np.floor(end + margin), -1, size - 1).astype(np.intp)
    count = np.maximum(most - least + 1, 0)
    which = np.repeat(np.arange(len(count)), count)
    return which, np.arange(len(which)) + np.repeat(least - (np.cumsum(count) - count), count)


def _squares(
    cell: Indices, begin: Floats, end: Floats, aside: Floats, slope: Floats, margin: Floats
) -> tuple[Indices, Indices, Floats]:
    """The squares of columns that lines cross: in which column, their numbers in it, and a place in them, along the line.

    cell : (n,), of a line that runs along it from `begin` to `end`, and begins at `aside` with a slope. All (n,).
    """
    enters, leaves = np.clip(cell, begin, end), np.clip(cell + 1, begin, end)
    one, other = aside + (enters - begin) * slope, aside + (leaves - begin) * slope
    low, high = np.minimum(one, other), np.maximum(one, other)
    margin = 2 * margin  # aslant by 45° at most, with some to spare
    lowest, highest = np.floor(low - margin).astype(np.intp), np.floor(high + margin).astype(np.intp)
    parts = [(np.flatnonzero(lowest == highest), lowest)]
    for row in range(int((highest - lowest).max(initial=-1)) + 1):
        parts.append((np.flatnonzero((lowest + row <= highest) & (lowest < highest)), lowest + row))
    places, squares, alongs = [], [], []
    for number, (some, square) in enumerate(parts):
        square = square[some]
        along = (enters[some] + leaves[some]) / 2
        if number:
            # The middle of what lies in the square, or the nearest to it.
            middle = np.clip((np.maximum(low[some], square) + np.minimum(high[some], square + 1.0)) / 2, low[some], high[some])
            with np.errstate(all="ignore"):
                there = begin[some] + (middle - aside[some]) / slope[some]
            along = np.clip(np.where(np.isfinite(there), there, along), enters[some], leaves[some])
        places.append(some)
        squares.append(square)
        alongs.append(along)
    return np.concatenate(places), np.concatenate(squares), np.concatenate(alongs)
