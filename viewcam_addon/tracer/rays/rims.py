"""Circles and ellipses in space, as strokes: where ellipsoids are touched by the rays of an eye or a lamp.

In the space in which an ellipsoid is the unit sphere, the rays of a point f away from its centre touch it in a circle, in the
plane f/|f|² before the centre, of the radius √(1 − 1/|f|²); those of a sun in a great circle. The way back to camera space
makes an ellipse of it, in a plane, with the depths that its picture has not. No square is taken of what is far away, so that
the outline of a far sphere is as exact as its place.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Indices, cross, dot, gather
from .strokes import Canvas

BULGE = 0.05
"""Pixels by which arcs may bulge over the strokes that stand for them."""

# An outline is first cut into so many arcs, and arcs are halved so often at most: then a circle that fills the view of an eye
# beside it bulges by as much in a picture of a million pixels.
_ARCS, _HALVINGS = 8, 10


@dataclass(frozen=True, eq=False)
class Rims:
    """n ellipses in camera space: middle + cosine · cos + sine · sin, each (3, n) float64."""

    middle: Floats
    cosine: Floats
    sine: Floats

    @property
    def count(self) -> int:
        return self.middle.shape[1]

    def at(self, which: Indices, part: Floats) -> Floats:
        """(3, k) points. part : (k,) of the way round."""
        angle = part * (2 * np.pi)
        point = np.cos(angle) * gather(self.cosine, which)
        point += np.sin(angle) * gather(self.sine, which)
        point += gather(self.middle, which)
        return point

    def arcs(self, canvas: Canvas) -> tuple[Indices, Floats, Floats]:
        """Strokes along what may be seen of the rims: of which, and from and to where, (3, k) each."""
        which, middle = np.repeat(np.arange(self.count), _ARCS), np.tile((np.arange(_ARCS) + 0.5) / _ARCS, self.count)
        width = 1.0 / _ARCS
        starts = self.at(which, middle - width / 2)
        ends = np.roll(starts.reshape(3, -1, _ARCS), -1, axis=2).reshape(3, -1)
        done = []
        for halving in range(_HALVINGS + 1):
            middles = self.at(which, middle)
            seen = np.flatnonzero(~_outside(canvas, starts, middles, ends))
            which, middle = which[seen], middle[seen]
            starts, middles, ends = (gather(points, seen) for points in (starts, middles, ends))
            bulging = _bulging(canvas, starts, middles, ends) if halving < _HALVINGS else np.zeros(len(which), bool)
            flat, round_ones = np.flatnonzero(~bulging), np.flatnonzero(bulging)
            done.append((which[flat], gather(starts, flat), gather(ends, flat)))
            if not len(round_ones):
                break
            width /= 2
            starts, middles, ends = (gather(points, round_ones) for points in (starts, middles, ends))
            starts, ends = np.concatenate([starts, middles], axis=1), np.concatenate([middles, ends], axis=1)
            which = np.tile(which[round_ones], 2)
            middle = np.concatenate([middle[round_ones] - width / 2, middle[round_ones] + width / 2])
        return tuple(np.concatenate(parts, axis=-1) for parts in zip(*done, strict=True))


def _outside(canvas: Canvas, starts: Floats, middles: Floats, ends: Floats) -> np.ndarray:
    """Which arcs lie wholly beside the picture, with what they can bulge: half of what their middles do."""
    sag = middles - (starts + ends) / 2
    outside = np.zeros(starts.shape[1], bool)
    for *values, across in zip(*map(canvas.planes, (starts, middles, ends)), canvas.planes(sag), strict=True):
        outside |= np.maximum.reduce(values) < -np.abs(across) / 2
    return outside


def _bulging(canvas: Canvas, starts: Floats, middles: Floats, ends: Floats) -> np.ndarray:
    (a, b, _), (c, d, _), (e, f, _) = (canvas.place(points) for points in (starts, middles, ends))
    with np.errstate(all="ignore"):
        length = np.hypot(e - a, f - b)
        aside = np.abs((c - a) * (f - b) - (d - b) * (e - a))
        flat = np.where(length > BULGE, aside <= BULGE * length, np.hypot(c - a, d - b) <= BULGE)
    return ~(flat & (starts[2] > 0) & (middles[2] > 0) & (ends[2] > 0))


def rims_seen_from(shape: Floats, centres: Floats, away: Floats, tangent: Floats) -> Rims:
    """Where rays from points touch ellipsoids.

    shape : (3, 3, n): [component, axis, ellipsoid], from the spaces in which they are unit spheres to camera space. centres :
    (3, n), camera space. away : (3, n), in the units' spaces, from the points to the centres. tangent : (n,) |away|² − 1.
    """
    squared = tangent + 1.0
    radius = np.sqrt(np.maximum(tangent, 0.0) / squared)
    return _rims(shape, centres - _carried(shape, away / squared), away, radius)


def rims_lit_by_sun(shape: Floats, centres: Floats, towards: Floats) -> Rims:
    """The same of a sun. towards : (3, n), in the units' spaces."""
    return _rims(shape, centres, towards, np.ones(centres.shape[1]))


def circles(centres: Floats, axes: Floats, radii: Floats) -> Rims:
    """Circles about axes, (3, n)."""
    return _rims(np.broadcast_to(np.eye(3)[:, :, None], (3, 3, centres.shape[1])), centres, axes, radii)


def _rims(shape: Floats, middle: Floats, axes: Floats, radius: Floats) -> Rims:
    aside = np.where(np.abs(axes) == np.abs(axes).min(axis=0), 1.0, 0.0)
    first = cross(axes, aside)
    first /= np.sqrt(dot(first, first))
    second = cross(axes, first)
    second /= np.sqrt(dot(second, second))
    return Rims(middle, _carried(shape, first) * radius, _carried(shape, second) * radius)


def _carried(shape: Floats, vectors: Floats) -> Floats:
    return np.stack([dot(row, vectors) for row in shape])
