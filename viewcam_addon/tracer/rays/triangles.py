"""The triangles of a scene in camera space, and where a ray that meets one meets it, in float64.

Seen from the eye, the reciprocal of the depth and the two barycentric coordinates divided by the depth are linear in the view
plane: 1/t = N·(x, y, 1), b₁/t = G₁·(x, y, 1), b₂/t = G₂·(x, y, 1). N, G₁ and G₂ are computed once for each triangle, from the
differences of its vertices, so that a hit costs nine products.

Rejected: the scalar triple products of vertices (they lose the square of distance/size instead of distance/size), and keeping
Embree's own t, u, v (float32).
"""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ... import exact
from ..arrays import Float32s, Floats, Indices, cross, dot, gather, linear
from ..scene import Mesh, Object
from .view import View

# Thinner triangles than float32 can tell from a line are no surface.
_MOST_SLENDER = 2.0**24
# How many times its distance from the eye a triangle may reach before float32 rounds that distance with its corners' too much:
# what lies on it by 2⁻²⁴ · 8 · 128 = 6e-5 of that distance is still told from it.
WIDE = 2.0**7
# A triangle this many times as long as high costs a depth six bits of its 53, if its normal is not taken with care.
_SLENDER = 2.0**6


@dataclass(frozen=True, eq=False)
class Triangles:
    """m triangles.

    vertices : (3, v) float64, camera space: [axis, vertex].
    corners : (3, m) int32: [corner, triangle], indices into `vertices`.
    corner_normals : (9, m) float32, world space: [3 · corner + axis, triangle], of any length, on the side from which the
        corners run counter-clockwise, 0 on meshes without; or None where no mesh has any.
    corner_uvs : (9, m) float32: [3 · corner + channel, triangle] with the channels u, v, 1 (0, 0, 0 without a UV map); or None
        where no mesh has a UV map.
    object_index, material_index : (m,) float32, what the passes show.
    largest_coordinate : (m,) float32, of the three vertices in world space, without its sign.
    placed : the objects with their meshes, whose triangles follow one another.
    embree_scenes : what embree.py made of them. former_scenes : what it made of them when their vertices were elsewhere.
    """

    vertices: Floats
    corners: NDArray[np.int32]
    corner_normals: Float32s | None
    corner_uvs: Float32s | None
    object_index: Float32s
    material_index: Float32s
    largest_coordinate: Float32s
    placed: tuple[tuple[Object, Mesh], ...]
    embree_scenes: dict = field(default_factory=dict)
    former_scenes: dict = field(default_factory=dict)

    @property
    def count(self) -> int:
        return self.corners.shape[1]

    def hidden_from(self, ray: str) -> NDArray[np.bool_]:
        """(m,): which triangles a kind of rays does not see (lights.RAYS)."""
        hidden = np.array([ray in placed.hidden_from for placed, _ in self.placed], bool)
        return np.repeat(hidden, [len(mesh.triangles) for _, mesh in self.placed])


def triangles_of(pairs: list[tuple[Object, Mesh]], view: View) -> Triangles:
    """The triangles of all objects that are meshes, instances written out (embreex has no instances)."""
    users = Counter(id(mesh) for _, mesh in pairs)
    smooth = any(mesh.corner_normals is not None for _, mesh in pairs)
    mapped = any(mesh.corner_uvs is not None for _, mesh in pairs)
    vertices, corners, normals, uvs, objects, materials, largest = [], [], [], [], [], [], []
    vertex_count = 0
    for placed, mesh in pairs:
        points, coordinate = view.points(placed.matrix, mesh.vertices)
        vertices.append(points)
        corners.append(mesh.triangles.T + np.int32(vertex_count))
        vertex_count += points.shape[1]
        largest.append(coordinate[mesh.triangles.T].max(axis=0))
        objects.append(np.full(len(mesh.triangles), placed.object_index, np.float32))
        materials.append(np.array(placed.material_indices, np.float32)[mesh.materials])
        if smooth:
            normals.append(_corner_normals(placed, mesh, shared=users[id(mesh)] > 1))
        if mapped:
            uvs.append(_corner_uvs(mesh))
    return Triangles(
        vertices=_joined(vertices, (3, 0), np.float64),
        corners=_joined(corners, (3, 0), np.int32),
        corner_normals=_joined(normals, (9, 0), np.float32) if smooth else None,
        corner_uvs=_joined(uvs, (9, 0), np.float32) if mapped else None,
        object_index=_joined(objects, (0,), np.float32),
        material_index=_joined(materials, (0,), np.float32),
        largest_coordinate=_joined(largest, (0,), np.float32),
        placed=tuple(pairs),
    )


def _joined(parts: list[NDArray], empty: tuple[int, ...], dtype: type) -> NDArray:
    joined = np.concatenate(parts, axis=-1, dtype=dtype, casting="same_kind") if parts else np.empty(empty, dtype)
    return np.ascontiguousarray(joined)  # what is not, NumPy copies whole whenever some of it is gathered


def _corner_normals(placed: Object, mesh: Mesh, shared: bool) -> Float32s:
    """(9, m) corner normals of one object, turned by the cofactors of its matrix, as the normal of its faces is.

    Cycles turns the normals of a mesh that only one object uses into world space before it interpolates, and normalises
    them there; those of a mesh that several objects share it interpolates in object space.
    """
    if mesh.corner_normals is None:
        return np.zeros((9, len(mesh.triangles)), np.float32)
    linear = placed.matrix[:3, :3]
    cofactors = cross(linear[:, [1, 2, 0]], linear[:, [2, 0, 1]])
    cofactors /= np.abs(cofactors).max() or 1.0
    normals = cofactors @ mesh.corner_normals.reshape(-1, 3).T
    if not shared:
        length = np.sqrt(dot(normals, normals))
        normals /= np.where(length > 0, length, 1.0)
    return normals.reshape(3, -1, 3).transpose(2, 0, 1).reshape(9, -1).astype(np.float32)


def _corner_uvs(mesh: Mesh) -> Float32s:
    uvs = np.zeros((3, 3, len(mesh.triangles)), np.float32)
    if mesh.corner_uvs is not None:
        uvs[:, :2] = mesh.corner_uvs.transpose(1, 2, 0)
        uvs[:, 2] = 1
    return uvs.reshape(9, -1)


def _normal(first: Floats, second: Floats) -> Floats:
    """first × second, two sides of each triangle; rounded but once, in each component, where the triangle is slender.

    There the products cancel, and their roundings would tilt the normal lengthwise by 2⁻⁵³ times what the triangle is longer
    than high. Those of the corners don't: they turn it about its length, where that matters as little as the triangle is high.
    """
    normal = cross(first, second)
    slender = np.flatnonzero(dot(normal, normal) * _SLENDER**2 < dot(first, first) * dot(second, second))
    if len(slender):
        rest = (0.0, 0.0, 0.0)
        normal[:, slender] = exact.cross_of_perpendicular(first[:, slender], rest, second[:, slender], rest)
    return normal


class Planes:
    """Where rays meet the planes of triangles: the linear forms N, G₁, G₂ and the face normals.

    forms : (9, m) float64. span : (2, m) float64, least and greatest depth of the triangle's vertices.
    normals : (3, m) float32, unit, world space, facing the eye. distance : (m,) float64, of the plane from the eye.
    side : (m,) float32: 1 where the eye sees the corners run counter-clockwise, −1 where clockwise.
    magnitude : (m,) float32: what a renderer's relative rounding applies to, the largest coordinate in world space plus the
        distance of the farthest corner from the eye times the triangle's slenderness, its longest side over its height:
        barycentric coordinates that are computed from the eye are off by a rounding of that distance over the height, and
        move the hit along the longest side.
    wide : (k,) indices of triangles whose corners are more than `WIDE` times as far from the eye as they themselves.
    """

    def __init__(self, triangles: Triangles, view: View) -> None:
        count = triangles.count
        self.forms: Floats = np.empty((9, count))
        self.span: Floats = np.empty((2, count))
        self.normals: Float32s = np.empty((3, count), np.float32)
        self.distance: Floats = np.empty(count)
        self.side: Float32s = np.empty(count, np.float32)
        self.magnitude: Float32s = np.empty(count, np.float32)
        wide = []
        step = 16384
        with np.errstate(all="ignore"):  # a triangle without area, or one seen edge-on, has no forms: depth() sees to it
            for first in range(0, count, step):
                wide.append(first + self._fill(slice(first, first + step), triangles, view))
        self.wide: Indices = np.concatenate([np.empty(0, np.intp), *wide])

    def _fill(self, part: slice, triangles: Triangles, view: View) -> Indices:
        """Fill the tables for a part of the triangles; which of the part are wide."""
        a, b, c = gather(triangles.vertices, triangles.corners[:, part]).transpose(1, 0, 2)
        self.span[0, part] = np.minimum(np.minimum(a[2], b[2]), c[2])
        self.span[1, part] = np.maximum(np.maximum(a[2], b[2]), c[2])
        first, second = b - a, c - a
        normal = _normal(first, second)
        squared = dot(normal, normal)
        volume = dot(normal, a)
        plane = normal / volume
        self.forms[0:3, part] = plane
        for rows, gradient in ((slice(3, 6), cross(second, normal)), (slice(6, 9), cross(normal, first))):
            gradient /= squared
            self.forms[rows, part] = gradient - dot(gradient, a) * plane
        length = np.sqrt(squared)
        self.distance[part] = np.nan_to_num(np.abs(volume) / length)
        self.normals[:, part] = np.nan_to_num(view.axes.T @ (normal * (-np.sign(volume) / length)))
        self.side[part] = np.sign(volume) * -view.handedness
        longest = np.maximum(np.maximum(dot(first, first), dot(second, second)), dot(c - b, c - b))
        farthest = np.sqrt(np.maximum(np.maximum(dot(a, a), dot(b, b)), dot(c, c)))
        reach = farthest * np.minimum(longest / length, _MOST_SLENDER)
        self.magnitude[part] = triangles.largest_coordinate[part] + reach
        # One whose plane comes near the eye, but not itself, has no side that is nearly as long as it is far.
        near = (np.sqrt(longest) > 0.9 * farthest) & (farthest > WIDE * self.distance[part]) & (self.distance[part] > 0)
        return np.flatnonzero(near)

    def depth(self, triangle: Indices, x: Floats, y: Floats) -> Floats:
        """Planar depth at which rays (x, y, 1) meet the triangles that were found for them; all broadcast.

        A triangle seen so nearly edge-on that its plane tells nothing is met within the depths of its vertices.
        """
        return self._depth(gather(self.forms[:3], triangle), triangle, x, y)

    def _depth(self, plane: Floats, triangle: Indices, x: Floats, y: Floats) -> Floats:
        with np.errstate(all="ignore"):
            depth = 1.0 / linear(plane, x, y)
        depth = np.fmax(depth, gather(self.span[0], triangle))
        return np.fmin(depth, gather(self.span[1], triangle), out=depth)

    def hit(self, triangle: Indices, x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
        """Depth and the barycentric coordinates b₁, b₂ of the hits, each (n,), b₁ and b₂ within the triangle."""
        forms = gather(self.forms, triangle)
        depth = self._depth(forms[:3], triangle, x, y)
        with np.errstate(all="ignore"):
            first = linear(forms[3:6], x, y) * depth
            second = linear(forms[6:9], x, y) * depth
        np.fmax(np.fmin(first, 1.0, out=first), 0.0, out=first)
        np.fmax(np.fmin(second, 1.0 - first, out=second), 0.0, out=second)
        return depth, first, second
