"""What rays that don't come from the eye meet: scattered rays, and those that ask whether a light is hidden.

Embree finds triangles in float32, from starts that offset.py moves off the surface; the hit is then computed in float64, from
the surface itself (points.py). Two sorts of things are tested by every ray, in float64: triangles that are wide (see
visibility.py), since Embree would round a ground plane, and the offset of the rays that leave it, by as much as its far corners
are far; and the few largest spheres. Without Embree, everything is.

**Other spheres** hide in octahedra. Wherever a ray crosses one's faces, its sphere is tested in float64 from where the ray
truly starts, and the ray goes on behind that crossing by a step that float32 can tell. It enters and leaves each octahedron, so
that a sphere is overlooked only if a step skips both; octahedra differ in size, so that those of spheres that touch or coincide
don't share their faces. Of those that hold the start only the way out is crossed: a ray goes on that far even if it has met
something.

Rejected: cards, as for eye rays, which need one direction to face; boxes, which more rays cross in vain than octahedra.
"""

import threading
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from . import offset
from .arrays import Float32s, Floats, Indices, cross, dot, gather
from .points import Points, Surfaces
from .visibility import EmbreeScene, embree_scene, unit_of

# As many spheres, the largest, are tested by all rays: a ground that is a huge sphere would else be in every ray's way.
_FEW = 4

_STEP = 2.0**-20  # of a coordinate: eight roundings of float32 of a start and of a crossing
_LEAST = 2.0**-17  # of a coordinate: how far octahedra reach beyond their spheres at least, so that both crossings are apart
_SPREAD = 2.0**-5  # of their size: by how much octahedra differ
_GOLDEN = 0.618033988749895


class Space:
    """What rays from points of surfaces meet.

    surfaces : what they can meet.
    """

    def __init__(self, surfaces: Surfaces) -> None:
        self._surfaces = surfaces
        triangles, balls = surfaces.triangles, surfaces.balls
        reach = np.abs(balls.centres).max(axis=0, initial=0.0) + np.abs(balls.axes).sum(axis=0).max(axis=0, initial=0.0)
        self._extent = max(np.abs(triangles.vertices).max(initial=0.0), reach.max(initial=0.0))
        self._sights: dict[bytes, _Sight] = {}
        self._building = threading.Lock()

    def first(self, points: Points, directions: Floats, kind: str) -> tuple[Indices, Points, Floats]:
        """What n rays that leave surfaces meet first.

        points : where they leave. directions : (3, n) float64, camera space, unit. kind : "diffuse", "glossy" or
        "transmission": objects that are hidden from such rays are not met.

        Returns which of the rays met something, (k,), the points that they met, and how far from theirs, (k,) float64.
        """
        starts = offset.start(points.position, points.normal, directions, points.offset)
        found = self._sight(kind).first(starts, directions, points.primitive)
        met = np.flatnonzero(found >= 0)
        return met, *self._surfaces.met(found[met], points.position[:, met], directions[:, met])

    def blocked(self, points: Points, directions: Floats, distances: Floats) -> NDArray[np.bool_]:
        """Whether something stands between points of surfaces and lights, (n,).

        A light that touches a surface is not hidden by it. What shines almost along the surface that it falls on is hidden.

        directions : (3, n) float64, camera space, unit, to the lights. distances : (n,) float64, inf for a sun.
        """
        starts = offset.start(points.position, points.normal, directions, points.offset)
        # Beyond twice the extent of all things nothing stands, and float32 need not go farther.
        lights = points.position + directions * np.minimum(distances, 8 * self._extent)
        blocked = np.abs(dot(points.normal, directions)) < offset.FLATTEST
        blocked |= self._sight("shadow").blocked(starts, lights, points.primitive)
        return blocked

    def _sight(self, kind: str) -> "_Sight":
        """What a kind of rays can meet; kinds that can meet the same share it."""
        hidden = np.concatenate([thing.hidden_from(kind) for thing in (self._surfaces.triangles, self._surfaces.balls)])
        key = np.packbits(hidden).tobytes()
        with self._building:
            if key not in self._sights:
                self._sights[key] = _Sight(self._surfaces, ~hidden, unit_of(self._extent))
        return self._sights[key]


class _Sight:
    """What rays can meet that see these primitives, those of all triangles and all balls."""

    def __init__(self, surfaces: Surfaces, visible: NDArray[np.bool_], unit: float) -> None:
        self._surfaces, self._unit = surfaces, unit
        triangles, balls = surfaces.triangles, surfaces.balls
        seen, seen_balls = visible[: triangles.count], np.flatnonzero(visible[triangles.count :])
        if EmbreeScene is None:
            alone, crowd = np.flatnonzero(seen), seen_balls[:0]
        else:
            alone = surfaces.planes.wide[seen[surfaces.planes.wide]]
            seen_balls = seen_balls[
                np.argsort(-np.abs(balls.axes[:, :, seen_balls]).max(axis=(0, 1), initial=0.0), kind="stable")
            ]
            crowd = seen_balls[_FEW:]
        self._alone = [_Alone(surfaces, triangle) for triangle in alone]
        self._balls = [ball for ball in seen_balls if ball not in set(crowd.tolist())]
        self._crowd = _Crowd(surfaces, crowd, unit) if len(crowd) else None
        self._embree = None
        if EmbreeScene is not None and seen.any():
            corners = triangles.corners.T.copy()
            corners[surfaces.planes.wide] = corners[~seen] = 0  # for Embree they are points, which are never met
            self._embree = embree_scene(triangles.vertices.T * unit, corners)

    def first(self, starts: Floats, directions: Floats, leaving: Indices) -> Indices:
        """The primitive that each ray meets first, spheres counted as in `Surfaces.balls`, or −1."""
        if self._embree is None:
            found = np.full(starts.shape[1], -1, np.intp)
        else:
            found = self._embree.run(_rows(starts * self._unit), _rows(directions)).astype(np.intp)
        if not (self._alone or self._balls or self._crowd):
            return found
        nearest = np.full(len(found), np.inf)
        met = np.flatnonzero(found >= 0)
        nearest[met] = self._surfaces.distance(found[met], starts[:, met], directions[:, met])
        for primitive, which, distance in self._others(starts, directions, leaving, nearest):
            nearer = distance < nearest[which]
            nearest[which[nearer]] = distance[nearer]
            found[which[nearer]] = primitive if np.ndim(primitive) == 0 else primitive[nearer]
        return found

    def blocked(self, starts: Floats, lights: Floats, leaving: Indices) -> NDArray[np.bool_]:
        origins, ways, lengths = offset.shadow_rays(starts, lights)
        if self._embree is None:
            blocked = np.zeros(starts.shape[1], bool)
        else:
            unit = np.float32(self._unit)
            blocked = self._embree.run(origins * unit, ways * unit, dists=lengths, query="OCCLUDED") >= 0
        if not (self._alone or self._balls or self._crowd):
            return blocked
        open_ = np.flatnonzero(~blocked)
        starts = starts[:, open_]
        directions = lights[:, open_] - starts
        limits = lengths[open_].astype(np.float64)
        length = np.sqrt(dot(directions, directions))
        directions /= np.where(length > 0, length, 1.0)
        limits *= length
        for _, which, distance in self._others(starts, directions, leaving[open_], limits):
            hit = which[distance < limits[which]]
            blocked[open_[hit]] = True
            limits[hit] = 0.0
        return blocked

    def _others(
        self, starts: Floats, directions: Floats, leaving: Indices, limits: Floats
    ) -> Iterator[tuple[int | Indices, Indices, Floats]]:
        """Hits on what Embree does not see: primitive, which rays, how far; `limits` may shrink from one to the next."""
        for alone in self._alone:
            yield alone.triangle, *alone.met(starts, directions, limits)
        count, balls = self._surfaces.triangles.count, self._surfaces.balls
        for ball in self._balls:
            which = np.flatnonzero(leaving != count + balls.number[ball])
            yield (
                count + ball,
                which,
                balls.distance(np.array([ball]), starts[:, which], directions[:, which]),
            )
        if self._crowd is not None:
            for ball, which, distance in self._crowd.met(starts, directions, leaving, limits):
                yield count + ball, which, distance


class _Alone:
    """A triangle that all rays test in float64."""

    def __init__(self, surfaces: Surfaces, triangle: int) -> None:
        self.triangle = int(triangle)
        triangles = surfaces.triangles
        self._corner, b, c = triangles.vertices[:, triangles.corners[:, triangle]].T
        first, second = b - self._corner, c - self._corner
        normal = cross(first, second)
        squared = dot(normal, normal)
        with np.errstate(all="ignore"):  # without area it is never met
            self._normal = normal / np.sqrt(squared)
            self._first = cross(second, normal) / squared
            self._second = cross(normal, first) / squared

    def met(self, starts: Floats, directions: Floats, limits: Floats) -> tuple[Indices, Floats]:
        """Which rays meet it nearer than their limits, and how far off."""
        with np.errstate(all="ignore"):  # a ray along the plane
            distance = (self._normal @ self._corner - self._normal @ starts) / (self._normal @ directions)
        which = np.flatnonzero((distance > 0) & (distance < limits))
        distance = distance[which]
        inside = starts[:, which] + distance * directions[:, which] - self._corner[:, None]
        first, second = self._first @ inside, self._second @ inside
        kept = np.flatnonzero((first >= 0) & (second >= 0) & (first + second <= 1))
        return which[kept], distance[kept]


class _Crowd:
    """Many spheres, in octahedra.

    chosen : which of `Surfaces.balls`.
    """

    def __init__(self, surfaces: Surfaces, chosen: Indices, unit: float) -> None:
        self._balls, self._first, self._chosen, self._unit = surfaces.balls, surfaces.triangles.count, chosen, unit
        axes, centres = gather(self._balls.axes, chosen), gather(self._balls.centres, chosen)
        lengths = np.sqrt((axes * axes).sum(axis=1))
        largest = np.abs(centres).max(axis=0) + lengths.max(axis=0)
        size = np.sqrt(3) * (1 + _SPREAD * (chosen * _GOLDEN % 1)) * (1 + _LEAST * largest / lengths)
        self._widest = 2 * float((lengths * size).max())
        axes *= size[:, None]
        tips = np.stack([centres + sign * axis for axis in axes for sign in (-1, 1)])  # (6, 3, n)
        faces = np.array([[x, 2 + y, 4 + z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        corners = faces + 6 * np.arange(len(chosen))[:, None, None]
        self._embree = embree_scene(tips.transpose(2, 0, 1).reshape(-1, 3) * unit, corners.reshape(-1, 3).astype(np.int32))

    def met(
        self, starts: Floats, directions: Floats, leaving: Indices, limits: Floats
    ) -> Iterator[tuple[Indices, Indices, Floats]]:
        """Spheres that rays meet, from crossing to crossing; `limits` may shrink in between."""
        rays, gone = np.arange(starts.shape[1]), np.zeros(starts.shape[1])
        beyond = limits.copy()
        while len(rays):
            origins = starts[:, rays] + gone * directions[:, rays]
            ahead = np.minimum((beyond[rays] - gone) * self._unit, 1e37).astype(np.float32)
            crossed = self._embree.run(_rows(origins * self._unit), _rows(directions[:, rays]), dists=ahead, output=1)
            on = np.flatnonzero(crossed["primID"] >= 0)
            rays = rays[on]
            ball = self._chosen[crossed["primID"][on] >> 3]
            distance = self._balls.distance(ball, starts[:, rays], directions[:, rays])
            distance[leaving[rays] == self._first + self._balls.number[ball]] = np.inf
            yield ball, rays, distance
            gone = gone[on] + crossed["tfar"][on].astype(np.float64) / self._unit
            gone += _STEP * (np.abs(origins[:, on]).max(axis=0) + gone)
            # An octahedron that holds the start is left within `_widest`, be there a nearer hit or not.
            beyond[rays] = np.minimum(beyond[rays], np.maximum(limits[rays], np.where(limits[rays] > 0, self._widest, 0.0)))
            further = gone < beyond[rays]
            rays, gone = rays[further], gone[further]


def _rows(vectors: Floats) -> Float32s:
    """(n, 3) float32 of (3, n)."""
    return np.ascontiguousarray(vectors.T, np.float32)
