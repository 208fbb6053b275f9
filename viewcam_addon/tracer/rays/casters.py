"""What casts the edges of shadows: outlines that a lamp without a size sees, as curves, cut into pieces."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Indices, cross, dot, gather
from ..scene.lamps import Lamp, Sun
from .lamp_outlines import place_of
from .rims import Rims
from .triangles import Planes, Triangles
from .view import View

# How far past a surface a ray goes, relative to its largest coordinate: four times what Embree rounds it by.
_PAST = 2.0**-20
_CIRCLE = 16  # pieces of a circle to begin with


@dataclass(frozen=True, eq=False)
class Light:
    """A lamp without a size in camera space.

    place : (3,), or of a sun the direction to it. is_sun, casts_shadow : as of the lamp.
    """

    place: Floats
    is_sun: bool
    casts_shadow: bool

    def ways(self, points: Floats) -> tuple[Floats, Floats]:
        """Unit directions (3, n) from the lamp to points, and how far, (n,)."""
        if self.is_sun:
            return np.broadcast_to(-self.place[:, None], points.shape), np.full(points.shape[1], np.inf)
        way = points - self.place[:, None]
        distance = np.sqrt(dot(way, way))
        return way / np.where(distance > 0, distance, 1.0), distance

    def rays(self, points: Floats) -> Floats:
        """(3, n) directions of any length, linear in the points."""
        return np.broadcast_to(-self.place[:, None], points.shape) if self.is_sun else points - self.place[:, None]

    def sides(self, triangles: Triangles, planes: Planes, handedness: float) -> Floats:
        """(m,) which side of triangles it shines on: positive where their corners run one way, negative where the other."""
        with np.errstate(all="ignore"):
            height = dot(planes.forms[:3], self.place) - (not self.is_sun)
            height *= planes.side
        edge_on = np.flatnonzero(~np.isfinite(height) | (planes.side == 0))
        if len(edge_on):  # as the eye sees them
            a, b, c = gather(triangles.vertices, triangles.corners[:, edge_on]).transpose(1, 0, 2)
            towards = self.place[:, None] - (0.0 if self.is_sun else a)
            height[edge_on] = dot(cross(b - a, c - a), towards) * -handedness
        return height


class Straight:
    """Edges of triangles as curves. starts, ends, third : (3, n), the third corners. largest : (n,), of their coordinates."""

    pieces, is_round, is_rim = 1, False, False

    def __init__(self, starts: Floats, ends: Floats, third: Floats) -> None:
        self._starts, self._ways, self._third = starts, ends - starts, third
        self.count = starts.shape[1]
        self._past = _PAST * np.maximum(np.abs(starts).max(axis=0, initial=0.0), np.abs(ends).max(axis=0, initial=0.0))
        self.primitives = np.full(self.count, -1)

    def at(self, which: Indices, part: Floats) -> Floats:
        return gather(self._starts, which) + part * gather(self._ways, which)

    def past(self, which: Indices, points: Floats, ahead: Floats, farther: Floats | float = 0.0) -> Floats:
        """Points just past the surface, seen along `ahead`, or farther past it."""
        aside = cross(ahead, gather(self._ways, which))
        length = np.sqrt(dot(aside, aside))
        aside /= np.where(length > 0, length, 1.0)
        inwards = dot(aside, gather(self._third, which) - points)
        return points - np.copysign(gather(self._past, which) + farther, inwards) * aside


class Round:
    """Outlines of spheres as curves. primitives : (n,) of the spheres."""

    pieces, is_round, is_rim = _CIRCLE, True, False

    def __init__(self, rims: Rims, centres: Floats, primitives: Indices) -> None:
        self._rims, self._centres, self.primitives = rims, centres, primitives
        self.count = rims.count

    def at(self, which: Indices, part: Floats) -> Floats:
        return self._rims.at(which, part)

    def past(self, which: Indices, points: Floats, ahead: Floats, farther: Floats | float = 0.0) -> Floats:
        """As of straight ones."""
        outward = points - gather(self._centres, which)
        return points + outward * ((_PAST * np.abs(points).max(axis=0) + farther) / np.sqrt(dot(outward, outward)))


class Rim(Round):
    """The rim of a spot's cone as a curve about the lamp, which is its centre."""

    is_rim = True

    def past(self, which: Indices, points: Floats, ahead: Floats, farther: Floats | float = 0.0) -> Floats:
        """Where its light comes from."""
        return gather(self._centres, which)


Curves = Straight | Round


@dataclass(frozen=True, eq=False)
class Pieces:
    """n pieces of curves. which : (n,) curve. first, width : (n,) where on it they begin and how long they are, of 1."""

    which: Indices
    first: Floats
    width: Floats

    @staticmethod
    def whole(curves: Curves) -> "Pieces":
        which = np.repeat(np.arange(curves.count), curves.pieces)
        first = np.tile(np.arange(curves.pieces) / curves.pieces, curves.count)
        return Pieces(which, first, np.full(len(which), 1 / curves.pieces))

    def ends(self, overlap: float = 0.0) -> tuple[Floats, Floats]:
        return self.first - overlap * self.width, self.first + (1 + overlap) * self.width

    def lengths(self, curves: Curves) -> Floats:
        """(n,) in units of the world."""
        start, end = (curves.at(self.which, part) for part in self.ends())
        return np.sqrt(dot(end - start, end - start))

    def some(self, chosen: Indices | slice) -> "Pieces":
        return Pieces(self.which[chosen], self.first[chosen], self.width[chosen])

    def cut(self, chosen: Indices, into: Indices) -> "Pieces":
        """Some of them in so many parts each."""
        some, number = np.repeat(chosen, into), np.arange(into.sum()) - np.repeat(np.cumsum(into) - into, into)
        width = self.width[some] / np.repeat(into, into)
        return Pieces(self.which[some], self.first[some] + number * width, width)


def light_of(lamp: Lamp, view: View) -> Light:
    if isinstance(lamp, Sun):
        return Light(view.axes @ np.array(lamp.towards), True, lamp.casts_shadow)
    return Light(view.axes @ (place_of(lamp) - view.eye), False, lamp.casts_shadow)
