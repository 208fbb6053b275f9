"""Which pixels straight strokes in space cross, seen from the eye.

A stroke is clipped to the pyramid of the picture before it is divided by its depth, so that it may reach behind the eye. In the
picture it is walked along its longer side, column by column or row by row: in each it crosses one square, or two, or by its
margin three. Every square that comes within the margin of the stroke is found, up to one margin more at its ends.
"""

from dataclasses import dataclass

import numpy as np

from ...pinhole import Pinhole
from ..arrays import Floats, Indices, gather

# What float64's rounding can move a place in the picture by is far less than this, in pixels.
LEAST_MARGIN = 2.0**-20


@dataclass(frozen=True, eq=False)
class Pieces:
    """The parts of strokes that lie in one pixel each.

    stroke : (k,) which. pixel : (k,) row · width + column. column, row : (k,) float64, a place on the part. nearness : (k,)
    float64, one over its depth. across : (2, k) float64, a unit vector of the picture at right angles to the stroke.
    """

    stroke: Indices
    pixel: Indices
    column: Floats
    row: Floats
    nearness: Floats
    across: Floats


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
        along = np.where(steep, [first[1], last[1]], [first[0], last[0]])
        aside = np.where(steep, [first[0], last[0]], [first[1], last[1]])
        long_side = np.where(steep, self.height, self.width)
        least = np.clip(np.floor(along.min(axis=0) - margin), 0, long_side).astype(np.intp)
        most = np.clip(np.floor(along.max(axis=0) + margin), -1, long_side - 1).astype(np.intp)
        count = np.maximum(most - least + 1, 0)
        which = np.repeat(np.arange(len(count)), count)
        cell = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(least, count)
        a, b = gather(along, which)
        c, d = gather(aside, which)
        with np.errstate(all="ignore"):
            per_step = 1.0 / (b - a)
        point = np.isinf(per_step)
        per_step[point] = 0.0
        enters = np.clip((cell - a) * per_step, 0.0, 1.0)
        leaves = np.clip((cell + 1 - a) * per_step, 0.0, 1.0)
        leaves[point] = 1.0
        height = d - c
        at_entry, at_exit = c + enters * height, c + leaves * height
        margin = gather(margin, which) * 2  # aslant by 45° at most, with some to spare
        low, high = np.minimum(at_entry, at_exit), np.maximum(at_entry, at_exit)
        lowest, highest = np.floor(low - margin).astype(np.intp), np.floor(high + margin).astype(np.intp)
        parts = []
        for row in range(int((highest - lowest).max(initial=0)) + 1):
            some = np.flatnonzero(lowest + row <= highest) if row else np.arange(len(which))
            square = lowest[some] + row
            # The middle of what lies in the square, or the nearest to it.
            middle = (np.maximum(low[some], square) + np.minimum(high[some], square + 1.0)) / 2
            middle = np.minimum(np.maximum(middle, low[some]), high[some])
            with np.errstate(all="ignore"):
                part = (middle - c[some]) / height[some]
            part = np.where(np.isfinite(part), part, (enters[some] + leaves[some]) / 2)
            part = np.minimum(np.maximum(part, np.minimum(enters, leaves)[some]), np.maximum(enters, leaves)[some])
            parts.append((which[some], cell[some], square, part))
        which, cell, square, part = (np.concatenate(values) for values in zip(*parts, strict=True))
        steep = steep[which]
        column, row = np.where(steep, square, cell), np.where(steep, cell, square)
        kept = np.flatnonzero((column >= 0) & (column < self.width) & (row >= 0) & (row < self.height))
        which, column, row, part = which[kept], column[kept], row[kept], part[kept]
        begin = gather(first, which)
        way = gather(last, which) - begin
        at = begin + part * way
        length = np.hypot(way[0], way[1])
        length = np.where(length > 0, length, 1.0)
        across = np.stack([-way[1] / length, way[0] / length])
        across[0, (across[0] == 0) & (across[1] == 0)] = 1.0
        return Pieces(stroke[which], row * self.width + column, at[0], at[1], at[2], across)

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
