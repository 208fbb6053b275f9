"""Which pixels an outline crosses: where what the eye sees may change by leaps, found from the geometry.

What is seen is continuous but for silhouettes (edges between a triangle that faces the eye and one that faces away), borders,
creases, changes of material, the outlines of spheres, cuts by the clip planes, and outlines of lamps that the eye sees. All
these are strokes in space; which pixels they cross is exact (strokes.py), however thin the wire.

**Hidden ones** don't count. A part of a stroke that lies in one pixel is seen if it lies nearer than what the pixel's centre
shows; else a ray beside its middle, on either side, meets nothing nearer than the triangles that it belongs to. One place is
enough: if the part is seen elsewhere in the pixel, then between there and its middle something nearer begins to hide it, whose
own outline is seen in this pixel. Of all outlines that are seen in a pixel, the nearest is seen at its middle.
Rejected: to compare with the depths at the centres around alone. A round surface falls off towards its own outline, so that
what is seen through a slit beside it lies behind all of these.

**What is promised**: every pixel is marked in whose square a visible outline is longer than twice the margin, and some beside
them. The margin is what Embree's float32 moves edges by, 16 · 2⁻²⁴ · d · r max(r, 1) for a place at the distance r · d from
the principal point, in the farthest corner of the picture: 0.001 pixels with a usual lens.

**What is not**: where surfaces penetrate one another nothing is marked, as that would need every pair of triangles: the centres
tell, which show other primitives there. Textures, what is seen in mirrors and through glass, and bends that are less than a
crease are none of an outline's.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...image import BACKGROUND_DEPTH
from ..arrays import Floats, Indices, cross, dot, gather
from ..scene import Scene
from ..scene.lamps import Area, Point, Spot, Sun
from .corners import REACH
from .ellipsoids import Ellipsoids
from .joints import Edges, Joints
from .rims import BULGE, Rims, circles, rims_seen_from
from .strokes import LEAST_MARGIN, Canvas, Pieces
from .triangles import Planes, Triangles
from .view import View
from .visibility import Visibility

CREASE = 2.0**-10
"""The difference of unit normals that is a crease: a leap by a 3000th of the light that falls on a matte surface."""

# Spheres that are smaller than this many pixels are marked whole: their light bends within a pixel.
_SMALL = 6.0
# What is this much farther than the centre counts as not hidden, before any ray is asked.
_SLIGHTLY = 2.0**-10
# How much nearer than an outline's own triangles something must be to hide it.
_NEARER = 2.0**-20

_FARTHEST = 1e-300  # one over it

_STROKES = 1 << 17  # at a time

Depths = Callable[[Floats, Floats], Floats]
"""How deep things are that are seen at columns and rows of the picture."""


@dataclass(frozen=True, eq=False)
class Strokes:
    """n strokes in camera space.

    starts, ends : (3, n) float64. within : (3, n) float64, a point of the surface that each is an outline of, on whose side
    of the stroke it is seen. nearest : (n,) float64, least depth of that surface, inf of what is infinitely far. bulge : pixels
    by which what they stand for may lie beside them.
    """

    starts: Floats
    ends: Floats
    within: Floats
    nearest: Floats
    bulge: float = 0.0

    def outwards(self, pieces: Pieces, some: Indices, distance: tuple[float, float]) -> Floats:
        """(2, k) unit vectors of the picture, across some of the pieces and away from their surfaces."""
        which, across = pieces.stroke[some], gather(pieces.across, some)
        plane = cross(gather(self.starts, which), gather(self.ends, which))  # through the eye and the stroke
        inside = dot(plane, gather(self.within, which))
        turned = plane[0] * across[0] / distance[0] + plane[1] * across[1] / distance[1]
        return across * np.where(inside * turned > 0, -1.0, 1.0)


class Outlines:
    """The outlines of a scene.

    visibility : what the eye sees. crease : the least difference of unit normals at an edge that counts as a crease.
    """

    def __init__(
        self,
        scene: Scene,
        view: View,
        triangles: Triangles,
        planes: Planes,
        ellipsoids: Ellipsoids,
        visibility: Visibility,
        crease: float = CREASE,
    ) -> None:
        self._scene, self._view, self._visibility = scene, view, visibility
        self._triangles, self._planes, self._ellipsoids = triangles, planes, ellipsoids
        self._crease = crease
        self._canvas = Canvas(scene.camera, scene.clip)
        corner = np.abs([self._canvas.x, self._canvas.y]).max()
        self.margin = LEAST_MARGIN + REACH * corner * max(corner, 1.0) * max(scene.camera.distance)

    @cached_property
    def joints(self) -> Joints:
        """How the triangles join; found when first asked for."""
        return Joints(self._triangles, self._crease)

    def seen(self, depth: NDArray, primitives: NDArray | None = None) -> NDArray[np.bool_]:
        """(height, width): the pixels whose squares a visible outline may cross, rows from the bottom.

        depth : (height, width), of what is seen at the pixel centres, 1e10 where nothing is. primitives : (height, width), what
            it is, as visibility.py numbers it, or −1: saves rays.
        """
        deepest = None if primitives is None else self._deepest(primitives.ravel())
        marks = Marks(self._canvas, depth, self.margin, self._depths, deepest)
        for strokes in self._of_triangles():
            marks.add(strokes)
        if self._ellipsoids.count:
            marks.add(self._of_spheres())
            self._fill_spheres(marks)
        lamps = Marks(Canvas(self._scene.camera, (0.0, np.inf)), depth, self.margin, self._depths, deepest)
        for strokes in self._of_lamps():
            lamps.add(strokes)
        return (marks.mask | lamps.mask).reshape(depth.shape)

    def _depths(self, columns: Floats, rows: Floats) -> Floats:
        """What the eye sees at places of the picture: how deep, inf where nothing."""
        x, y = self._scene.camera.view_plane(columns, rows)
        found = self._visibility.first(x, y)
        depth = np.full(len(x), np.inf)
        count = self._triangles.count
        for chosen, deep, first in ((found < count, self._planes.depth, 0), (found >= count, self._ellipsoids.depth, count)):
            which = np.flatnonzero(chosen & (found >= 0))
            if len(which):
                depth[which] = deep(found[which] - first, x[which], y[which])
        return depth

    def _deepest(self, primitives: NDArray) -> Floats:
        """The greatest depths of the objects, or spheres, that are seen; inf where nothing is."""
        sizes = np.array([len(mesh.triangles) for _, mesh in self._triangles.placed if len(mesh.triangles)], np.intp)
        objects = np.maximum.reduceat(self._planes.span[1], np.cumsum(sizes) - sizes) if len(sizes) else np.empty(0)
        spheres = self._ellipsoids.positions[2] + self._ellipsoids.reach
        return np.concatenate([np.repeat(objects, sizes), spheres, [np.inf]])[primitives]

    def _of_triangles(self) -> Iterator[Strokes]:
        joints, hidden = self.joints, self._triangles.hidden_from("camera")
        drawn = np.zeros(joints.pairs.shape[1], bool)
        drawn[joints.silhouettes(self._planes.side)] = True
        drawn[joints.creases] = True
        pairs = gather(joints.pairs, np.flatnonzero(drawn))
        nearest = self._planes.span[0]
        for edges, others in ((pairs[0], pairs[1]), (joints.borders, joints.borders)):
            if hidden.any():
                shown = np.flatnonzero(~hidden[edges >> 2])
                edges, others = edges[shown], others[shown]
            for begin in range(0, len(edges), _STROKES):
                some = slice(begin, begin + _STROKES)
                depth = np.minimum(gather(nearest, edges[some] >> 2), gather(nearest, others[some] >> 2))
                yield Strokes(*corners_of(self._triangles, edges[some]), depth)
        for clip in self._scene.clip:
            if 0 < clip < np.inf:
                yield self._cut(clip, hidden)

    def _cut(self, clip: float, hidden: NDArray[np.bool_]) -> Strokes:
        """Where a clip plane cuts triangles."""
        least, greatest = self._planes.span
        cut = np.flatnonzero((least < clip) & (greatest > clip) & ~hidden)
        corners = gather(self._triangles.vertices, gather(self._triangles.corners, cut))  # (axis, corner, triangle)
        corners = np.take_along_axis(corners, np.argsort(corners[2], axis=0)[None], axis=1)
        near, middle, far = corners.transpose(1, 0, 2)
        bent = np.where(middle[2] < clip, far, near)
        ends = []
        for a, b in ((near, far), (bent, middle)):
            with np.errstate(all="ignore"):
                part = np.nan_to_num((clip - a[2]) / (b[2] - a[2]))
            end = a + part * (b - a)
            end[2] = clip
            ends.append(end)
        return Strokes(*ends, np.where(middle[2] < clip, far, near), np.full(len(cut), clip))

    def _of_spheres(self) -> Strokes:
        spheres = self._ellipsoids
        shape = _inverses(spheres.inverse.reshape(3, 3, -1).swapaxes(0, 1))
        rims = rims_seen_from(shape, spheres.positions, spheres.centres, spheres.tangent)
        which, starts, ends = rims.arcs(self._canvas)
        return Strokes(starts, ends, gather(spheres.positions, which), gather(spheres.nearest, which), BULGE)

    def _fill_spheres(self, marks: "Marks") -> None:
        """Mark small spheres whole, and those that a clip plane cuts."""
        x0, x1, y0, y1 = self._ellipsoids.bounds
        right, up = self._scene.camera.distance
        small = ((x1 - x0) * right < _SMALL) | ((y1 - y0) * up < _SMALL)
        deepest = self._ellipsoids.positions[2] + self._ellipsoids.reach
        for clip in self._scene.clip:
            small |= (self._ellipsoids.nearest < clip) & (deepest > clip)
        some = np.flatnonzero(small)
        marks.fill(gather(self._ellipsoids.bounds, some), gather(self._ellipsoids.nearest, some))

    def _of_lamps(self) -> Iterator[Strokes]:
        """The outlines of lamps that the eye sees; those of suns are as far as a thing can be."""
        for lamp in self._scene.lamps:
            if "camera" in lamp.hidden_from or lamp.is_dark:
                continue
            if isinstance(lamp, Area):
                yield self._of_area(lamp)
            elif isinstance(lamp, Sun):
                if lamp.angle > 0:
                    towards = (self._view.axes @ np.array(lamp.towards))[:, None]
                    half = lamp.angle / 2
                    yield self._of_rims(circles(towards * np.cos(half), towards, np.array([np.sin(half)])), np.inf)
            elif lamp.radius > 0:
                yield from self._of_bulb(lamp)

    def _of_area(self, lamp: Area) -> Strokes:
        matrix = lamp.matrix @ np.diag([*np.divide(lamp.size, 2), 1, 1])
        if lamp.ellipse:
            middle, first, second = self._view.points(matrix, np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]))[0].T[:, :, None]
            return self._of_rims(Rims(middle, first - middle, second - middle))
        corners = self._view.points(matrix, np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]))[0]
        return Strokes(corners, np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1), np.full(4, corners[2].min()))

    def _of_bulb(self, lamp: Point | Spot) -> Iterator[Strokes]:
        place = lamp.matrix[:3, 3] if isinstance(lamp, Spot) else np.array(lamp.position)
        centre = self._view.axes @ (place - self._view.eye)[:, None]
        distance = np.sqrt(dot(centre, centre))
        if lamp.soft_falloff:
            yield self._of_rims(circles(centre, centre, np.array([lamp.radius])))
        elif distance[0] > lamp.radius:
            away = centre / lamp.radius
            shape = lamp.radius * np.eye(3)[:, :, None]
            yield self._of_rims(rims_seen_from(shape, centre, away, dot(away, away) - 1))
        if isinstance(lamp, Spot):
            yield self._of_rims(cone(lamp, self._view, -1.0), np.inf)

    def _of_rims(self, rims: Rims, nearest: float | None = None) -> Strokes:
        which, starts, ends = rims.arcs(Canvas(self._scene.camera, (0.0, np.inf)))
        depth = np.minimum(starts[2], ends[2]) if nearest is None else np.full(starts.shape[1], nearest)
        return Strokes(starts, ends, gather(rims.middle, which), depth, BULGE)


def cone(lamp: Spot, view: View, sign: float) -> Rims:
    """The directions along the rim of a spot's cone, times a sign, as points one unit from the eye at the axis or so."""
    half = lamp.angle / 2
    linear = view.axes @ lamp.matrix[:3, :3]
    middle, first, second = (
        sign * (linear @ np.array(ray))[:, None]
        for ray in ((0.0, 0.0, -np.cos(half)), (np.sin(half), 0.0, 0.0), (0.0, np.sin(half), 0.0))
    )
    return Rims(middle, first, second)


def corners_of(triangles: Triangles, edges: Edges) -> list[Floats]:
    """(3, n) each, camera space: both ends of edges, and the third corner of their triangles."""
    triangle, side = edges >> 2, edges & 3
    flat, corners = triangles.corners.ravel(), []
    for further in range(3):
        corner = side + np.int32(further)
        corner[corner > 2] -= 3
        corners.append(gather(triangles.vertices, flat.take(corner * np.intp(triangles.count) + triangle)))
    return corners


def _inverses(matrices: Floats) -> Floats:
    """(3, 3, n) of (3, 3, n)."""
    rows = [cross(matrices[first], matrices[second]) for first, second in ((1, 2), (2, 0), (0, 1))]
    return np.stack(rows, axis=1) / dot(matrices[0], rows[0])


class Marks:
    """Pixels that strokes have been found to cross.

    depth : (height, width), of what is seen at the centres. depths : what is seen elsewhere. deepest : (height · width,), the
    greatest depth of the object that is seen at the centre, or None.
    """

    def __init__(self, canvas: Canvas, depth: NDArray, margin: float, depths: Depths, deepest: Floats | None) -> None:
        self._canvas, self._margin, self._depths, self._deepest = canvas, margin, depths, deepest
        flat = np.asarray(depth, np.float64).ravel()
        self._nearness = np.where(flat < BACKGROUND_DEPTH, 1.0 / flat, 0.0)
        self.mask = np.zeros(len(flat), bool)

    def add(self, strokes: Strokes) -> None:
        """Mark the pixels in which strokes are seen."""
        pieces = self._canvas.pieces(strokes.starts, strokes.ends, self._margin + strokes.bulge)
        nearest = gather(strokes.nearest, pieces.stroke)
        nearness = np.where(nearest < np.inf, pieces.nearness, 0.0)
        seen = nearness * (1 + _SLIGHTLY) >= gather(self._nearness, pieces.pixel)
        self.mask[pieces.pixel[seen]] = True
        asked = ~(seen | gather(self.mask, pieces.pixel))
        if self._deepest is not None:
            asked &= nearest * (1 - _SLIGHTLY) <= gather(self._deepest, pieces.pixel)
        asked = np.flatnonzero(asked)
        if len(asked):
            # Nearer than the outline's own surface, and than where it was computed to be.
            hides = np.minimum(nearest[asked], 1.0 / np.maximum(nearness[asked], _FARTHEST)) * (1 - _NEARER)
            aside = strokes.outwards(pieces, asked, self._canvas.distance) * (2 * self._margin + strokes.bulge)
            found = self._depths(pieces.column[asked] + aside[0], pieces.row[asked] + aside[1])
            self.mask[pieces.pixel[asked[found >= hides]]] = True

    def fill(self, bounds: Floats, nearest: Floats) -> None:
        """Mark rectangles of the view plane where they are not hidden at the centres. bounds : as in `Ellipsoids`."""
        which, pixel = self._canvas.squares(bounds)
        seen = gather(self._nearness, pixel) <= (1 + _SLIGHTLY) / np.maximum(nearest[which], _FARTHEST)
        self.mask[pixel[seen]] = True
