"""What a ray meets, as passes: depth, position, normal, indices, UV, and what a tolerance is derived from.

What a tolerance applies to is computed in float64 on the primitive that visibility.py found, and rounded once, to the pass's
float32. Smooth normals and Facing are computed in float32, as by any renderer: their directions are off by some 2⁻²⁴, and both
are compared with, or scale, what is uncertain by far more. Passes are named and laid out as in image.py, each channel a plane
of memory of its own, as NumPy writes them fastest and as files store them. Only what is asked for and what the scene has is
computed: no UV maps, no UV; no smooth normals, no interpolation.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ...image import BACKGROUND_DEPTH, CHANNELS, GEOMETRY_PASSES
from ..arrays import Float32s, Floats, Indices, dot, gather
from ..compiled.standing import or_compiled
from .ellipsoids import Ellipsoids
from .triangles import Planes, Triangles
from .view import View

PASSES = {name: len(CHANNELS[name]) for name in GEOMETRY_PASSES}
"""The passes of level `geometry` and their numbers of channels."""

Passes = dict[str, Float32s]
Where = slice | NDArray[np.bool_]


def unwritten(shape: tuple[int, ...], names: Iterable[str] = PASSES) -> Passes:
    """Passes with nothing in them yet: (…, channels), views of planes. shape : all axes but the channels."""
    channels = [len(CHANNELS[name]) for name in names]
    planes = np.empty((sum(channels), *shape), np.float32)  # one piece: large ones come in large pages, five times as fast
    parts = np.split(planes, np.cumsum(channels)[:-1])
    return {name: np.moveaxis(part, 0, -1) for name, part in zip(names, parts, strict=True)}


class Surface:
    """Writes what rays meet into passes.

    eye_magnitude : the largest |coordinate| of the eye in world space, which a rounding applies to as well.
    """

    def __init__(self, view: View, triangles: Triangles, planes: Planes, ellipsoids: Ellipsoids) -> None:
        self.view, self.triangles, self.planes, self._ellipsoids = view, triangles, planes, ellipsoids
        self.eye_magnitude = np.float32(np.abs(view.eye).max())

    def write(self, passes: Passes, primitives: Indices, x: Floats, y: Floats) -> None:
        """Write what n rays (x, y, 1) meet, the primitives that were found for them; what meets nothing as Cycles writes it.

        passes : those that are wanted, name → (n, channels). primitives : (n,), triangles first, then spheres, −1 for none.
        """
        write_triangles(self, passes, primitives, x, y)
        if self._ellipsoids.count:
            where, sphere, x, y = _chosen(primitives >= self.triangles.count, primitives, x, y)
            if len(sphere):
                self._write_spheres(passes, where, sphere - self.triangles.count, x, y)

    def _write_spheres(self, passes: Passes, where: Where, sphere: Indices, x: Floats, y: Floats) -> None:
        depth = self._ellipsoids.depth(sphere, x, y)
        if "Normal" in passes:
            normal = self._ellipsoids.shown_normal(sphere, x, y, depth)
            _store(passes["Normal"], where, (dot(axis, normal) for axis in self.view.axes.T))
        if "Facing" in passes:
            _write_facing(passes, where, -dot(self._ellipsoids.normal(sphere, x, y, depth), (x, y, 1.0)), x, y)
        _write_place(passes, where, self.view, x, y, depth)
        _write_labels(passes, where, sphere, self._ellipsoids)
        if "Magnitude" in passes:
            _write_magnitude(passes, where, gather(self._ellipsoids.magnitude, sphere), self)


@or_compiled
def write_triangles(surface: Surface, passes: Passes, primitives: Indices, x: Floats, y: Floats) -> None:
    """Write what rays meet that meet triangles, and nothing into all other pixels; as in `Surface.write`."""
    triangles, planes = surface.triangles, surface.planes
    where, triangle, x, y = _chosen((primitives >= 0) & (primitives < triangles.count), primitives, x, y)
    if not isinstance(where, slice):
        for name, values in passes.items():
            values[...] = BACKGROUND_DEPTH if name == "Depth" else 0
    if not len(triangle):
        return
    depth, first, second = planes.hit(triangle, x, y)
    if "UV" in passes:
        _write_uv(passes["UV"], where, triangles, triangle, first, second)
    if "Normal" in passes:
        _store(passes["Normal"], where, _normal(triangles, planes, triangle, first, second))
    if "Facing" in passes:
        nearest = gather(planes.distance, triangle)
        _write_facing(passes, where, np.divide(nearest, depth, out=nearest), x, y)
    _write_place(passes, where, surface.view, x, y, depth)
    _write_labels(passes, where, triangle, triangles)
    if "Magnitude" in passes:
        _write_magnitude(passes, where, gather(planes.magnitude, triangle), surface)


def _chosen(chosen: NDArray[np.bool_], primitives: Indices, x: Floats, y: Floats) -> tuple[Where, Indices, Floats, Floats]:
    """Where some of the rays are, and what is known of them."""
    if chosen.all():
        return slice(None), primitives, x, y
    return chosen, primitives[chosen], x[chosen], y[chosen]


def _write_uv(target: Float32s, where: Where, triangles: Triangles, triangle: Indices, first: Floats, second: Floats) -> None:
    uvs = triangles.corner_uvs
    if uvs is None:
        target[where] = 0
        return
    third = 1.0 - first - second
    a, b, c = (gather(uvs[corner : corner + 2], triangle) for corner in (0, 2, 4))
    _store(target, where, (a[axis] * third + b[axis] * first + c[axis] * second for axis in range(2)))
    target[..., 2][where] = 1 if triangles.mapped is None else gather(triangles.mapped, triangle)


def _normal(triangles: Triangles, planes: Planes, triangle: Indices, first: Floats, second: Floats) -> Float32s:
    """(3, n) normals at barycentric coordinates: smooth where the mesh has normals, else of the face."""
    if triangles.corner_normals is None:
        return gather(planes.normals, triangle)
    weights = np.empty((3, len(triangle)), np.float32)
    weights[1], weights[2] = first, second
    np.subtract(1, weights[1], out=weights[0])
    weights[0] -= weights[2]
    corners = gather(triangles.corner_normals, triangle).reshape(3, 3, -1)
    corners *= weights[:, None]
    smooth = corners[0]
    smooth += corners[1]
    smooth += corners[2]
    length = np.sqrt(dot(smooth, smooth))
    side = gather(planes.side, triangle)
    if not length.all():  # the mesh has none, or they cancel: as in Cycles, the face's own
        smooth = np.where(length > 0, smooth, gather(planes.normals, triangle) * side)
        length = np.where(length > 0, length, np.float32(1))
    smooth *= np.divide(side, length, out=length)
    return smooth


def _write_facing(passes: Passes, where: Where, across: Floats, x: Floats, y: Floats) -> None:
    """The cosine between rays and surfaces, from what it is times the length of (x, y, 1)."""
    x, y, cosine = x.astype(np.float32), y.astype(np.float32), across.astype(np.float32)
    x *= x
    y *= y
    x += y
    x += 1
    cosine /= np.sqrt(x, out=x)
    np.minimum(cosine, 1, out=cosine)
    passes["Facing"][..., 0][where] = np.maximum(cosine, 0, out=cosine)


def _write_place(passes: Passes, where: Where, view: View, x: Floats, y: Floats, depth: Floats) -> None:
    if "Depth" in passes:
        passes["Depth"][..., 0][where] = depth
    if "Position" in passes:
        _store(passes["Position"], where, view.world_position(depth, x, y))


def _write_labels(passes: Passes, where: Where, index: Indices, table: Triangles | Ellipsoids) -> None:
    if "Object Index" in passes:
        passes["Object Index"][..., 0][where] = gather(table.object_index, index)
    if "Material Index" in passes:
        passes["Material Index"][..., 0][where] = gather(table.material_index, index)


def _write_magnitude(passes: Passes, where: Where, magnitude: Float32s, surface: Surface) -> None:
    passes["Magnitude"][..., 0][where] = np.maximum(magnitude, surface.eye_magnitude, out=magnitude)


def _store(target: Float32s, where: Where, components: Iterable[Floats]) -> None:
    for channel, component in enumerate(components):
        target[..., channel][where] = component
