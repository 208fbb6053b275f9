"""What a ray meets, as passes: depth, position, normal, indices, UV, and what a tolerance is derived from.

Everything is computed in float64 on the primitive that visibility.py found and rounded once, to the pass's float32. Passes are
named and laid out as in image.py. Only what the scene has is computed: no UV maps, no UV; no smooth normals, no interpolation.
"""

import numpy as np
from numpy.typing import NDArray

from ..image import BACKGROUND_DEPTH, CHANNELS
from .ellipsoids import Ellipsoids
from .triangles import Planes, Triangles
from .view import Floats, View

PASSES = {name: len(channels) for name, channels in CHANNELS.items() if name != "Combined"}
"""The passes of level `geometry` and their numbers of channels."""

Passes = dict[str, NDArray[np.float32]]
Where = slice | NDArray[np.intp]


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

    def write(self, passes: Passes, primitives: NDArray[np.intp], x: Floats, y: Floats) -> None:
        """Write what n rays (x, y, 1) meet, the primitives that were found for them, into passes of n background pixels.

        passes : name → (n, channels). primitives : (n,), −1 for none.
        """
        count = self._triangles.count
        for write, chosen, first in (
            (self._write_triangles, (primitives >= 0) & (primitives < count), 0),
            (self._write_spheres, primitives >= count, count),
        ):
            if chosen.all():
                write(passes, slice(None), primitives - first, x, y)
            elif chosen.any():
                where = np.flatnonzero(chosen)
                write(passes, where, primitives[where] - first, x[where], y[where])

    def _write_triangles(self, passes: Passes, where: Where, triangle: NDArray[np.intp], x: Floats, y: Floats) -> None:
        if not len(triangle):
            return
        triangles = self._triangles
        depth, first, second = self._planes.hit(triangle, x, y)
        normal = np.take(self._planes.normals, triangle, axis=1)
        cosine = np.take(self._planes.distance, triangle) / (depth * np.sqrt(x * x + y * y + 1.0))
        if triangles.corner_normals is not None:
            smooth = _interpolated(np.take(triangles.corner_normals, triangle, axis=1), first, second)
            length = np.sqrt(smooth[0] * smooth[0] + smooth[1] * smooth[1] + smooth[2] * smooth[2])
            normal = [
                np.where(length > 0, s, n) / np.where(length > 0, length, 1.0) for s, n in zip(smooth, normal, strict=True)
            ]
        if triangles.corner_uvs is not None:
            _store(passes["UV"], where, _interpolated(np.take(triangles.corner_uvs, triangle, axis=1), first, second))
        self._write_hit(passes, where, triangle, triangles, (x, y, depth), normal, cosine)

    def _write_spheres(self, passes: Passes, where: Where, sphere: NDArray[np.intp], x: Floats, y: Floats) -> None:
        if not len(sphere):
            return
        depth = self._ellipsoids.depth(sphere, x, y)
        normal = self._ellipsoids.normal(sphere, x, y, depth, self._view)
        right, up, forward = (axis @ np.array(normal) for axis in self._view.axes)
        cosine = np.abs(right * x + up * y + forward) / np.sqrt(x * x + y * y + 1.0)
        self._write_hit(passes, where, sphere, self._ellipsoids, (x, y, depth), normal, cosine)

    def _write_hit(self, passes, where, index, table: Triangles | Ellipsoids, hit, normal, cosine: Floats) -> None:
        x, y, depth = hit
        passes["Depth"][where, 0] = depth
        _store(passes["Position"], where, self._view.world_position(depth, x, y))
        _store(passes["Normal"], where, normal)
        passes["Facing"][where, 0] = np.minimum(cosine, 1.0)
        passes["Object Index"][where, 0] = np.take(table.object_index, index)
        passes["Material Index"][where, 0] = np.take(table.material_index, index)
        passes["Magnitude"][where, 0] = np.maximum(np.take(table.magnitude, index), self._eye_magnitude)


def _interpolated(corners: NDArray[np.float32], first: Floats, second: Floats) -> list[Floats]:
    """Three components, each (n,), of what the (9, n) values at the corners are at the barycentric coordinates."""
    third = 1.0 - first - second
    return [corners[axis] * third + corners[axis + 3] * first + corners[axis + 6] * second for axis in range(3)]


def _store(target: NDArray[np.float32], where: Where, components) -> None:
    for channel, component in enumerate(components):
        target[where, channel] = component
