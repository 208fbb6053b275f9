"""What rays that don't come from the eye meet: scattered rays, and those that ask whether a light is hidden.

Embree finds triangles in float32, from starts that offset.py moves off the surface; the hit is then computed in float64, from
the surface itself (points.py). What float32 can't hold is found in float64: wide triangles (alone.py) and spheres (crowd.py).
Without Embree, everything is.

Rejected: guarding the corners of triangles, where Embree may let a ray slip through, as for rays from the eye. Scattered rays
seldom come that close: of 10⁶ none left a closed ball or box, at any scale, and one or two a room with a wall so close to the
eye that it is wide, from points in its edges; no picture shows that (tests/tracer/rays/test_tightness.py).
"""

import threading
from collections.abc import Iterator
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, dot, gather
from ..compiled.standing import or_compiled
from . import offset
from .crowd import Hits, crowd_of
from .embree import EmbreeScene, rows, scene_of, unit_of
from .points import Points, Surfaces
from .wide import Alone


class Space:
    """What rays from points of surfaces meet.

    surfaces : what they can meet.
    """

    def __init__(self, surfaces: Surfaces) -> None:
        self._surfaces = surfaces
        balls = surfaces.balls
        reach = np.abs(balls.centres).max(axis=0, initial=0.0) + balls.reach
        self._extent = max(surfaces.triangles.extent, reach.max(initial=0.0))
        self._sights: dict[str, _Sight] = {}
        self._building = threading.Lock()

    def first(self, points: Points, directions: Floats, kind: str) -> tuple[Indices, Points, Floats]:
        """What n rays that leave surfaces meet first.

        points : where they leave. directions : (3, n) float64, camera space, unit. kind : "diffuse", "glossy" or
        "transmission": objects that are hidden from such rays are not met.

        Returns which of the rays met something, (k,), the points that they met, and how far from theirs, (k,) float64.
        """
        found = self.found(points, directions, kind)
        met = np.flatnonzero(found >= 0)
        return met, *self.met(found, points, directions, met)

    def found(self, points: Points, directions: Floats, kind: str) -> Indices:
        """(n,) the primitive that each ray meets first, spheres counted as in `Surfaces.balls`, or −1."""
        return self._sight(kind).first(points, directions)

    def met(self, found: Indices, points: Points, directions: Floats, which: Indices) -> tuple[Points, Floats]:
        """The points that some of the rays met, and how far from theirs."""
        return self._surfaces.met(gather(found, which), gather(points.position, which), gather(directions, which))

    def blocked(self, points: Points, directions: Floats, distances: Floats) -> NDArray[np.bool_]:
        """Whether something stands between points of surfaces and lights, (n,).

        A light that touches a surface is not hidden by it. What shines almost along the surface that it falls on is hidden.

        directions : (3, n) float64, camera space, unit, to the lights. distances : (n,) float64, inf for a sun.
        """
        # Nothing stands beyond twice the extent of all things, and float32 need not go farther.
        distances = np.minimum(distances, 4 * self._extent)
        blocked = self._sight("shadow").blocked(points, directions, distances)
        blocked |= np.abs(dot(points.normal, directions)) < offset.FLATTEST
        return blocked

    def escaped(self, points: Points, directions: Floats, kind: str) -> Indices:
        """Which of n rays that leave surfaces meet nothing; as in `first`."""
        return self._sight(kind).escaped(points, directions)

    def _sight(self, kind: str) -> "_Sight":
        """What a kind of rays can meet; kinds that can meet the same share it."""
        if kind not in self._sights:
            with self._building:
                hidden = [thing.hidden_from(kind) for thing in (self._surfaces.triangles, self._surfaces.balls)]
                for sight in self._sights.values():
                    if all(map(np.array_equal, sight.hidden, hidden)):
                        break
                else:
                    sight = _Sight(self._surfaces, hidden, unit_of(self._extent))
                self._sights[kind] = sight
        return self._sights[kind]


class _Sight:
    """What rays can meet from which some things are hidden.

    hidden : which triangles, (m,), and which balls, (n,).
    """

    def __init__(self, surfaces: Surfaces, hidden: list[NDArray[np.bool_]], unit: float) -> None:
        self.hidden, self._surfaces, self._unit = hidden, surfaces, unit
        triangles, (hidden_triangles, hidden_balls) = surfaces.triangles, hidden
        self._crowd = crowd_of(surfaces.balls, ~hidden_balls, unit)
        if EmbreeScene is None:
            self._alone, self._embree = Alone(triangles, np.flatnonzero(~hidden_triangles)), None
        else:
            wide = surfaces.planes.wide
            self._alone = Alone(triangles, wide[~hidden_triangles[wide]])
            left_out = hidden_triangles.copy()
            left_out[wide] = True
            self._embree = scene_of(triangles, left_out, unit)

    def first(self, points: Points, directions: Floats) -> Indices:
        """The primitive that each ray meets first, spheres counted as in `Surfaces.balls`, or −1."""
        if self._embree is None:
            found = np.full(points.count, -1, np.intp)
        else:
            found = first_triangles(self._embree, self._unit, points, directions)
        if self._alone.is_empty and self._crowd.is_empty:
            return found
        starts = offset.start(points.position, points.normal, directions, points.offset)
        nearest = np.full(len(found), np.inf)
        met = np.flatnonzero(found >= 0)
        nearest[met] = self._surfaces.distance(found[met], gather(starts, met), gather(directions, met))
        hits = chain(self._alone.met(starts, directions, nearest), self._balls(points, directions, nearest))
        for primitive, which, distance in hits:
            nearer = distance < nearest[which]
            which = which[nearer]
            nearest[which] = distance[nearer]
            found[which] = primitive if np.ndim(primitive) == 0 else primitive[nearer]
        return found

    def escaped(self, points: Points, directions: Floats) -> Indices:
        """Which rays meet nothing."""
        if self._embree is None:
            met = np.zeros(points.count, bool)
        else:
            met = any_triangle(self._embree, self._unit, points, directions)
        if not self._alone.is_empty:
            starts = offset.start(points.position, points.normal, directions, points.offset)
            limits = np.where(met, 0.0, np.inf)
            met |= _any(self._alone.met(starts, directions, limits), limits)
        if not self._crowd.is_empty:
            met |= self._crowd.any(points.position, directions, self._left(points), np.where(met, 0.0, np.inf))
        return np.flatnonzero(~met)

    def blocked(self, points: Points, directions: Floats, distances: Floats) -> NDArray[np.bool_]:
        """Whether anything stands before lights, (n,), at these finite distances."""
        if self._embree is None:
            blocked = np.zeros(points.count, bool)
        else:
            blocked = triangle_before(self._embree, self._unit, points, directions, distances)
        if self._alone.is_empty and self._crowd.is_empty:
            return blocked
        lengths = shadow_lengths(self._unit, points, directions, distances)
        if not self._alone.is_empty:
            starts = offset.start(points.position, points.normal, directions, points.offset)
            lights = points.position + directions * distances
            limits = np.where(blocked, 0.0, lengths)
            blocked |= _any(self._alone.met(starts, lights - starts, limits), limits)
        if not self._crowd.is_empty:
            limits = np.where(blocked, 0.0, lengths * distances)
            blocked |= self._crowd.any(points.position, directions, self._left(points), limits)
        return blocked

    def _balls(self, points: Points, directions: Floats, limits: Floats) -> Iterator[Hits]:
        """The spheres that rays meet nearer than limits, as primitives."""
        count = self._surfaces.triangles.count
        for ball, which, distance in self._crowd.met(points.position, directions, self._left(points), limits):
            yield count + ball, which, distance

    def _left(self, points: Points) -> Indices:
        """The numbers of the spheres that points lie on, below 0 for triangles."""
        return points.primitive - self._surfaces.triangles.count


@or_compiled
def first_triangles(embree: "EmbreeScene", unit: float, points: Points, directions: Floats) -> Indices:
    """The triangle that each ray meets first, or −1. unit : that of the scene; the rest as in `Space.first`."""
    starts = offset.start(points.position, points.normal, directions, points.offset)
    return embree.run(rows(starts * unit), rows(directions)).astype(np.intp)


@or_compiled
def any_triangle(embree: "EmbreeScene", unit: float, points: Points, directions: Floats) -> NDArray[np.bool_]:
    """Whether each ray meets any triangle."""
    starts = offset.start(points.position, points.normal, directions, points.offset)
    return embree.run(rows(starts * unit), rows(directions), query="OCCLUDED") >= 0


@or_compiled
def triangle_before(
    embree: "EmbreeScene", unit: float, points: Points, directions: Floats, distances: Floats
) -> NDArray[np.bool_]:
    """Whether a triangle stands before each light; as in `Space.blocked`."""
    starts = offset.start(points.position, points.normal, directions, points.offset)
    origins, ways, lengths = offset.shadow_rays(starts * unit, (points.position + directions * distances) * unit)
    return embree.run(origins, ways, dists=lengths, query="OCCLUDED") >= 0


@or_compiled
def shadow_lengths(unit: float, points: Points, directions: Floats, distances: Floats) -> NDArray[np.float32]:
    """How far the rays of `triangle_before` go, in lengths of what is between them and their lights."""
    starts = offset.start(points.position, points.normal, directions, points.offset)
    return offset.shadow_rays(starts * unit, (points.position + directions * distances) * unit)[2]


def _any(hits: Iterator[Hits], limits: Floats) -> NDArray[np.bool_]:
    """Which rays meet anything nearer than their limits; these become 0 then."""
    met = np.zeros(len(limits), bool)
    for _, which, distance in hits:
        which = which[distance < limits[which]]
        met[which], limits[which] = True, 0.0
    return met
