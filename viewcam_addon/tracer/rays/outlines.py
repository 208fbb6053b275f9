"""Which pixels an outline crosses: where what the eye sees may change by leaps, found from the geometry.

What is seen is continuous but for silhouettes (edges between a triangle that faces the eye and one that faces away), borders,
creases, changes of material, the outlines of spheres, cuts by the clip planes, outlines of lamps that the eye sees, and the
edges of the shadows of lamps without a size (shadow_outlines.py). All these are strokes in space; which pixels they cross is
exact (strokes.py), however thin the wire, and hidden ones don't count (marks.py).

**What is promised**: every pixel is marked in whose square a visible outline is longer than four margins, and some beside them.
The margin is what Embree's float32 moves edges by, 16 · 2⁻²⁴ · d · r max(r, 1) for a place r · d from the principal point, in
the farthest corner of the picture: 0.0003 pixels with a usual lens.

**What is not**: where surfaces penetrate one another nothing is marked, as that would need every pair of triangles; the centres
tell, which show other primitives there. Textures, what is seen in mirrors and through glass, and bends that are less than a
crease are no outlines.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...image import BACKGROUND_DEPTH
from ..arrays import Floats, cross, dot, gather
from ..scene import Scene
from .corners import REACH
from .ellipsoids import Ellipsoids
from .joints import Joints, corners_of
from .lamp_outlines import has_size, lamps_seen
from .marks import Marks, Strokes
from .points import Surfaces
from .rims import BULGE, rims_seen_from
from .shadow_outlines import ShadowOutlines
from .space import Space
from .strokes import LEAST_MARGIN, Canvas
from .tables import each, made_once
from .triangles import Planes, Triangles
from .view import View
from .visibility import Visibility

CREASE = 2.0**-10
"""The difference of unit normals that is a crease: a leap by a 3000th of the light that falls on a matte surface."""

# Spheres that are smaller than this many pixels are marked whole: their light bends within a pixel.
_SMALL = 6.0

_ENOUGH = 10000  # depths that tell what is typical
_STROKES = 1 << 17  # at a time


class Outlines:
    """The outlines of a scene.

    visibility : what the eye sees. crease : the least difference of unit normals at an edge that counts as a crease. joints :
    of these triangles, if they are known from another picture.
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
        joints: Joints | None = None,
    ) -> None:
        self._scene, self._view, self._visibility = scene, view, visibility
        self._triangles, self._planes, self._ellipsoids = triangles, planes, ellipsoids
        self._crease = crease
        self._camera = scene.camera
        if joints is not None:
            self.joints = joints

    @made_once
    def joints(self) -> Joints:
        """How the triangles join; found when first asked for."""
        return Joints(self._triangles, self._crease)

    def edges(self, depth: NDArray, surfaces: Surfaces, space: Space, primitives: NDArray | None = None) -> NDArray[np.bool_]:
        """(height, width): `seen` or `shadows`, of the whole picture, found side by side."""
        found = [
            partial(self.seen, depth, primitives),
            partial(self.shadows, depth, surfaces, space, primitives),
        ]
        seen, shadows = each(lambda find: find(), found, self._triangles.threads)
        return seen | shadows

    def seen(self, depth: NDArray, primitives: NDArray | None = None, first_row: int = 0) -> NDArray[np.bool_]:
        """(height, width): the pixels whose squares a visible outline may cross, rows from the bottom.

        depth : (height, width), of what is seen at the pixel centres, 1e10 where nothing is; of some rows of the picture, from
            first_row on, or of all. primitives : (height, width), what it is, as visibility.py numbers it, or −1: saves rays.
        """
        canvas, marks = self._marks(depth, primitives, first_row, self._scene.clip)
        for strokes in self._of_triangles():
            marks.add(strokes)
        if self._ellipsoids.count:
            marks.add(self._of_spheres(canvas))
            self._fill_spheres(canvas, marks)
        canvas, lamps = self._marks(depth, primitives, first_row, (0.0, np.inf))
        for strokes in lamps_seen(self._scene.lamps, self._view, canvas):
            lamps.add(strokes)
        return (marks.mask | lamps.mask).reshape(depth.shape)

    def shadows(
        self, depth: NDArray, surfaces: Surfaces, space: Space, primitives: NDArray | None = None, first_row: int = 0
    ) -> NDArray[np.bool_]:
        """(height, width): the pixels whose squares the edge of a shadow of a lamp without size may cross.

        depth, primitives, first_row : as in `seen`.
        """
        canvas, marks = self._marks(depth, primitives, first_row, self._scene.clip)
        lamps = [lamp for lamp in self._scene.lamps if not (lamp.is_dark or has_size(lamp) or "diffuse" in lamp.hidden_from)]
        if lamps:
            outlines = ShadowOutlines(self._view, surfaces, space, self.joints, canvas, _typical(depth))
            for lamp in lamps:
                for strokes in outlines.of(lamp):
                    marks.add(strokes)
        return marks.mask.reshape(depth.shape)

    def _marks(
        self, depth: NDArray, primitives: NDArray | None, first_row: int, clip: tuple[float, float]
    ) -> tuple[Canvas, Marks]:
        camera = self._camera.cropped(0, first_row, self._camera.width, len(depth))
        canvas = Canvas(camera, clip)
        corner = max(np.abs(slopes).max() for slopes in self._camera.view_plane([0, camera.width], [0, self._camera.height]))
        margin = LEAST_MARGIN + REACH * corner * max(corner, 1.0) * max(camera.distance)

        def depths(columns: Floats, rows: Floats) -> Floats:
            x, y = camera.view_plane(columns, rows)
            return self._depths(x, y)

        return canvas, Marks(canvas, depth, margin, depths, None if primitives is None else self._deepest(primitives.ravel()))

    def _depths(self, x: Floats, y: Floats) -> Floats:
        """How deep what the eye sees is, inf where nothing."""
        found = self._visibility.first(x, y)
        depth = np.full(len(x), np.inf)
        is_sphere = found >= self._triangles.count
        for chosen, deep, first in (
            (~is_sphere & (found >= 0), self._planes.depth, 0),
            (is_sphere, self._ellipsoids.depth, self._triangles.count),
        ):
            which = np.flatnonzero(chosen)
            if len(which):
                depth[which] = deep(found[which] - first, x[which], y[which])
        return depth

    def _deepest(self, primitives: NDArray) -> Floats:
        """The greatest depths of the objects, or spheres, that are seen; inf where nothing is."""
        sizes = np.array([count for count in self._triangles.counts if count], np.intp)
        objects = np.empty(0)
        if len(sizes):
            objects = np.maximum.reduceat(self._planes.span[1], np.cumsum(sizes) - sizes)
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
            for first in range(0, len(edges), _STROKES):
                some = slice(first, first + _STROKES)
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
        alone = np.where(middle[2] < clip, far, near)
        ends = []
        for start, end in ((near, far), (alone, middle)):
            with np.errstate(all="ignore"):
                part = np.nan_to_num((clip - start[2]) / (end[2] - start[2]))
            ends.append(start + part * (end - start))
            ends[-1][2] = clip
        seen = far if clip == self._scene.clip[0] else near
        return Strokes(*ends, seen, np.full(len(cut), clip))

    def _of_spheres(self, canvas: Canvas) -> Strokes:
        spheres = self._ellipsoids
        shape = _inverses(spheres.inverse.reshape(3, 3, -1).swapaxes(0, 1))
        which, starts, ends = rims_seen_from(shape, spheres.positions, spheres.centres, spheres.tangent).arcs(canvas)
        return Strokes(starts, ends, gather(spheres.positions, which), gather(spheres.nearest, which), BULGE)

    def _fill_spheres(self, canvas: Canvas, marks: Marks) -> None:
        """Mark small spheres whole, and those that a clip plane cuts."""
        spheres = self._ellipsoids
        x0, x1, y0, y1 = spheres.bounds
        with np.errstate(invalid="ignore"):  # those without bounds
            chosen = ((x1 - x0) * canvas.distance[0] < _SMALL) | ((y1 - y0) * canvas.distance[1] < _SMALL)
        for clip in self._scene.clip:
            chosen |= (spheres.nearest < clip) & (spheres.positions[2] + spheres.reach > clip)
        chosen = np.flatnonzero(chosen)
        marks.fill(gather(spheres.bounds, chosen), gather(spheres.nearest, chosen))


def _inverses(matrices: Floats) -> Floats:
    """(3, 3, n) of (3, 3, n)."""
    columns = [cross(matrices[first], matrices[second]) for first, second in ((1, 2), (2, 0), (0, 1))]
    return np.stack(columns, axis=1) / dot(matrices[0], columns[0])


def _typical(depth: NDArray) -> float:
    """A depth behind which 49 of 50 parts of what is seen lie."""
    depths = depth[depth < BACKGROUND_DEPTH]
    few = np.sort(depths[:: max(1, len(depths) // _ENOUGH)])
    return float(few[len(few) // 50]) if len(few) else 1.0
