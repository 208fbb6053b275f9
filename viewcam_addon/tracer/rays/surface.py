"""What a ray meets, as passes: depth, position, normal, indices, UV, and what a tolerance is derived from.

Everything is computed in float64 on the primitive that visibility.py found and rounded once, to the pass's float32. Passes are
named and laid out as in image.py. Only what the scene has is computed: no UV maps, no UV; no smooth normals, no interpolation.
"""

from collections.abc import Iterable

import numpy as np

from ...image import BACKGROUND_DEPTH, CHANNELS, GEOMETRY_PASSES
from ..arrays import Float32s, Floats, Indices, dot, gather
from .ellipsoids import Ellipsoids
from .triangles import Planes, Triangles
from .view import View

PASSES = {name: len(CHANNELS[name]) for name in GEOMETRY_PASSES}
"""The passes of level `geometry` and their numbers of channels."""

Passes = dict[str, Float32s]
Where = slice | Indices


def background(shape: tuple[int, ...]) -> Passes:
    """Passes of pixels that show nothing, as Cycles writes them. shape : all axes but the channels."""
    passes = {name: np.zeros((*shape, channels), np.float32) for name, channels in PASSES.items()}
    passes["Depth"][...] = BACKGROUND_DEPTH
    return passes


class Surface:
    """Writes what rays meet into passes."""

    def __init__(self, view: View, triangles: Triangles, planes: Planes, ellipsoids: Ellipsoids) -> None:
        self._view, self._triangles, self._planes, self._ellipsoids = view, triangles, planes, ellipsoids
        self._eye_magnitude = np.float32(np.abs(view.eye).max())

    def write(self, passes: Passes, primitives: Indices, x: Floats, y: Floats) -> None:
        """Write what n rays (x, y, 1) meet, the primitives that were found for them, into passes of n background pixels.

        passes : name → (n, channels). primitives : (n,), triangles first, then spheres, −1 for none.
        """
        spheres = primitives >= self._triangles.count
        for write, chosen, first in (
            (self._write_triangles, (primitives >= 0) & ~spheres, 0),
            (self._write_spheres, spheres, self._triangles.count),
        ):
            if chosen.all():
                write(passes, slice(None), primitives - first, x, y)
            elif chosen.any():
                where = np.flatnonzero(chosen)
                write(passes, where, primitives[where] - first, x[where], y[where])

    def _write_triangles(self, passes: Passes, where: Where, triangle: Indices, x: Floats, y: Floats) -> None:
        depth, first, second = self._planes.hit(triangle, x, y)
        cosine = gather(self._planes.distance, triangle) / (depth * np.sqrt(x * x + y * y + 1.0))
        if self._triangles.corner_uvs is not None:
            _store(passes["UV"], where, _interpolated(gather(self._triangles.corner_uvs, triangle), first, second))
        _store(passes["Normal"], where, self._normal(triangle, first, second))
        self._write_place(passes, where, x, y, depth, cosine)
        self._write_labels(passes, where, triangle, self._triangles, self._planes.magnitude)

    def _normal(self, triangle: Indices, first: Floats, second: Floats) -> Iterable[Floats]:
        """Three components of the normals at barycentric coordinates: smooth where the mesh has normals, else of the face."""
        if self._triangles.corner_normals is None:
            return gather(self._planes.normals, triangle)
        smooth = _interpolated(gather(self._triangles.corner_normals, triangle), first, second)
        length = np.sqrt(dot(smooth, smooth))
        side = gather(self._planes.side, triangle)
        if not length.all():  # the mesh has none, or they cancel: as in Cycles, the face's own
            smooth = np.where(length > 0, smooth, gather(self._planes.normals, triangle) * side)
            length = np.where(length > 0, length, 1.0)
        scale = side / length
        return [component * scale for component in smooth]

    def _write_spheres(self, passes: Passes, where: Where, sphere: Indices, x: Floats, y: Floats) -> None:
        depth = self._ellipsoids.depth(sphere, x, y)
        cosine = -dot(self._ellipsoids.normal(sphere, x, y, depth), (x, y, 1.0)) / np.sqrt(x * x + y * y + 1.0)
        normal = self._ellipsoids.shown_normal(sphere, x, y, depth)
        _store(passes["Normal"], where, [dot(axis, normal) for axis in self._view.axes.T])
        self._write_place(passes, where, x, y, depth, cosine)
        self._write_labels(passes, where, sphere, self._ellipsoids, self._ellipsoids.magnitude)

    def _write_place(self, passes: Passes, where: Where, x: Floats, y: Floats, depth: Floats, cosine: Floats) -> None:
        passes["Depth"][where, 0] = depth
        _store(passes["Position"], where, self._view.world_position(depth, x, y))
        passes["Facing"][where, 0] = np.clip(cosine, 0.0, 1.0)

    def _write_labels(
        self, passes: Passes, where: Where, index: Indices, table: Triangles | Ellipsoids, magnitude: Float32s
    ) -> None:
        passes["Object Index"][where, 0] = gather(table.object_index, index)
        passes["Material Index"][where, 0] = gather(table.material_index, index)
        passes["Magnitude"][where, 0] = np.maximum(gather(magnitude, index), self._eye_magnitude)


def _interpolated(corners: Float32s, first: Floats, second: Floats) -> list[Floats]:
    """Three components, each (n,), of what the (9, n) values at the corners are at the barycentric coordinates."""
    third = 1.0 - first - second
    return [corners[axis] * third + corners[axis + 3] * first + corners[axis + 6] * second for axis in range(3)]


def _store(target: Float32s, where: Where, components: Iterable[Floats]) -> None:
    for channel, component in enumerate(components):
        target[where, channel] = component
