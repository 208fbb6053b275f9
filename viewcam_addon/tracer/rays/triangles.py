"""The triangles of a scene in camera space, and where a ray that meets one meets it, in float64.

Seen from the eye, the reciprocal of the depth and the two barycentric coordinates divided by the depth are linear in the view
plane: 1/t = N·(x, y, 1), b₁/t = G₁·(x, y, 1), b₂/t = G₂·(x, y, 1). N, G₁ and G₂ are computed once for each triangle, from the
differences of its vertices, so that a hit costs nine products.

Rejected: the scalar triple products of vertices (they lose the square of distance/size instead of distance/size), and keeping
Embree's own t, u, v (float32).
"""

from collections import Counter
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from ... import exact
from ..arrays import Float32s, Floats, Indices, cross, dot, gather, linear
from ..scene import Mesh, Object
from .tables import Piece, by_material, each, in_camera_space, joined, made_once, matrices, parts, pieces, spread
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
    placed : the objects with their meshes, whose triangles follow one another.
    threads : how many fill the other tables. These are made when they are first asked for.
    moving : whether other views of them are expected. embree_scenes : what embree.py made of them. former_scenes : what it
        made of them in the view before.
    """

    vertices: Floats
    corners: NDArray[np.int32]
    placed: tuple[tuple[Object, Mesh], ...]
    threads: int = 1
    moving: bool = False
    embree_scenes: dict = field(default_factory=dict)
    former_scenes: dict = field(default_factory=dict)

    @property
    def count(self) -> int:
        return self.corners.shape[1]

    @property
    def counts(self) -> list[int]:
        """How many triangles each object has."""
        return [len(mesh.triangles) for _, mesh in self.placed]

    @made_once
    def extent(self) -> float:
        """The largest coordinate in camera space, without its sign."""
        return max(self.vertices.max(initial=0.0), -self.vertices.min(initial=0.0))

    def hidden_from(self, ray: str) -> NDArray[np.bool_]:
        """(m,): which triangles a kind of rays does not see (lights.RAYS)."""
        return np.repeat(np.array([ray in placed.hidden_from for placed, _ in self.placed], bool), self.counts)

    def moved(self, view: View, refit: bool = True) -> "Triangles":
        """The same triangles seen by another camera. refit : whether Embree's scenes are to stand elsewhere, instead of new
        ones: then this takes possession of them."""
        vertices = in_camera_space(self.placed, [mesh.vertices for _, mesh in self.placed], view, self.threads)
        former = self.embree_scenes if refit and self.moving else {}
        moved = replace(self, vertices=vertices, moving=refit, embree_scenes={}, former_scenes=former)
        vars(moved).update({name: table for name, table in vars(self).items() if name in _OF_THE_WORLD})
        return moved

    @made_once
    def object_index(self) -> Float32s:
        """(m,), what the pass shows."""
        return np.repeat(np.array([placed.object_index for placed, _ in self.placed], np.float32), self.counts)

    @made_once
    def material_index(self) -> Float32s:
        """(m,), what the pass shows."""
        return by_material(self.placed, [placed.material_indices for placed, _ in self.placed], np.float32)

    def largest_coordinates(self) -> Float32s:
        """(v,), of vertices in world space or of their object, without its sign: what is far from its object's own origin is
        the small difference of large numbers."""
        largest = np.empty(self.vertices.shape[1], np.float32)
        placing, meshes = matrices(self.placed), [mesh.vertices for _, mesh in self.placed]

        def fill(part: tuple[slice, list[Piece]]) -> None:
            where, some = part
            matrix, points = spread(placing, some), joined(meshes, some).T
            coordinates = [np.abs(dot(row, points) + row[3]) for row in matrix]
            largest[where] = np.maximum(reduce(np.maximum, coordinates), np.abs(matrix[:, 3]).max(axis=0))

        each(fill, pieces([len(points) for points in meshes]), self.threads)
        return largest

    @made_once
    def corner_normals(self) -> Float32s | None:
        """(9, m), world space: [3 · corner + axis, triangle], of any length, on the side from which the corners run
        counter-clockwise, 0 on meshes without; or None where no mesh has any.

        They are turned by the cofactors of their object's matrix, as the normals of its faces are. Cycles turns those of a mesh
        that only one object uses into world space before it interpolates, and normalises them there; those of a mesh that
        several objects share it interpolates in object space.
        """
        if all(mesh.corner_normals is None for _, mesh in self.placed):
            return None
        users = Counter(id(mesh) for _, mesh in self.placed)
        shared = np.array([users[id(mesh)] > 1 for _, mesh in self.placed])
        first, second, third = matrices(self.placed)[:, :3]
        cofactors = np.stack([cross(second, third), cross(third, first), cross(first, second)])
        largest = np.abs(cofactors).max(axis=(0, 1))
        cofactors /= np.where(largest > 0, largest, 1.0)
        normals = np.empty((9, self.count), np.float32)
        meshes = [mesh.corner_normals for _, mesh in self.placed]

        def fill(part: tuple[slice, list[Piece]]) -> None:
            where, some = part
            turn, as_they_are = spread(cofactors, some), spread(shared, some)
            for corner, given in enumerate(_joined_corners(meshes, some)):
                turned = np.stack([dot(row, given) for row in turn])
                if not as_they_are.all():
                    length = np.sqrt(dot(turned, turned))
                    turned /= np.where((length > 0) & ~as_they_are, length, 1.0)
                normals[3 * corner : 3 * corner + 3, where] = turned

        each(fill, pieces(self.counts), self.threads)
        return normals

    @made_once
    def corner_uvs(self) -> Float32s | None:
        """(6, m): [2 · corner + channel, triangle], 0 on meshes without a UV map; or None where no mesh has one."""
        if all(mesh.corner_uvs is None for _, mesh in self.placed):
            return None
        uvs = np.empty((6, self.count), np.float32)
        meshes = [mesh.corner_uvs for _, mesh in self.placed]

        def fill(part: tuple[slice, list[Piece]]) -> None:
            where, some = part
            uvs[:, where] = _joined_corners(meshes, some, 2).reshape(6, -1)

        each(fill, pieces(self.counts), self.threads)
        return uvs

    @made_once
    def mapped(self) -> NDArray[np.bool_] | None:
        """(m,): which triangles are of meshes that have a UV map; or None where all are."""
        mapped = [mesh.corner_uvs is not None for _, mesh in self.placed]
        return None if all(mapped) else np.repeat(np.array(mapped, bool), self.counts)


_OF_THE_WORLD = ("object_index", "material_index", "corner_normals", "corner_uvs", "mapped")
"""The tables that do not depend on the camera."""


def triangles_of(pairs: list[tuple[Object, Mesh]], view: View, threads: int = 1) -> Triangles:
    """The triangles of all objects that are meshes, instances written out (embreex has no instances)."""
    first = np.cumsum([0, *(len(mesh.vertices) for _, mesh in pairs)], dtype=np.int32)[:-1]
    corners = np.empty((3, sum(len(mesh.triangles) for _, mesh in pairs)), np.int32)
    meshes = [mesh.triangles for _, mesh in pairs]

    def fill(part: tuple[slice, list[Piece]]) -> None:
        where, some = part
        np.add(joined(meshes, some).T, spread(first, some), out=corners[:, where])

    each(fill, pieces([len(triangles) for triangles in meshes]), threads)
    vertices = in_camera_space(pairs, [mesh.vertices for _, mesh in pairs], view, threads)
    return Triangles(vertices, corners, tuple(pairs), threads)


def _joined_corners(meshes: list[Float32s | None], some: list[Piece], channels: int = 3) -> NDArray:
    """(3, channels, n): what the corners of some triangles have, 0 on meshes without."""
    given = [
        np.zeros((part.stop - part.start, 3, channels), np.float32) if meshes[number] is None else meshes[number][part]
        for number, part in some
    ]
    return np.ascontiguousarray((given[0] if len(given) == 1 else np.concatenate(given)).transpose(1, 2, 0))


def facing(forms: Floats) -> Floats:
    """(3, n): the unit normals of planes, towards the eye, in camera space; not finite where there is none.

    forms : (3, n) or more, of which the first three rows are N.
    """
    with np.errstate(all="ignore"):
        return forms[:3] / -np.sqrt(dot(forms, forms))


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
    """Where rays meet the planes of triangles: the linear forms N, G₁, G₂.

    forms : (9, m) float64. span : (2, m) float64, least and greatest depth of the triangle's vertices.
    side : (m,) int8: 1 where the eye sees the corners run counter-clockwise, −1 where clockwise.
    wide : (k,) indices of triangles whose corners are more than `WIDE` times as far from the eye as they themselves.

    The other tables are made when they are first asked for.
    """

    def __init__(self, triangles: Triangles, view: View) -> None:
        self._triangles, self._view = triangles, view
        count = triangles.count
        self.forms: Floats = np.empty((9, count))
        self.span: Floats = np.empty((2, count))
        self.side: NDArray[np.int8] = np.empty(count, np.int8)
        self._far = dot(triangles.vertices, triangles.vertices)
        wide = each(self._fill, parts(count), triangles.threads)
        del self._far
        self.wide: Indices = np.concatenate([np.empty(0, np.intp), *wide])

    def _fill(self, part: slice) -> Indices:
        """Fill the tables for a part of the triangles; which of them are wide."""
        corners = self._triangles.corners[:, part]
        a, b, c = gather(self._triangles.vertices, corners).transpose(1, 0, 2)
        np.minimum(np.minimum(a[2], b[2]), c[2], out=self.span[0, part])
        np.maximum(np.maximum(a[2], b[2]), c[2], out=self.span[1, part])
        first, second = b - a, c - a
        with np.errstate(all="ignore"):  # a triangle without area, or one seen edge-on, has no forms: depth() sees to it
            normal = _normal(first, second)
            squared = dot(normal, normal)
            volume = dot(normal, a)
            plane = np.divide(normal, volume, out=self.forms[0:3, part])
            for rows, gradient in ((slice(3, 6), cross(second, normal)), (slice(6, 9), cross(normal, first))):
                gradient /= squared
                np.subtract(gradient, dot(gradient, a) * plane, out=self.forms[rows, part])
            self.side[part] = np.sign(volume) * -self._view.handedness
            farthest = reduce(np.maximum, (gather(self._far, corner) for corner in corners))
            near = np.flatnonzero((farthest * squared > WIDE**2 * volume * volume) & (volume != 0))
            # One whose plane comes near the eye, but not itself, has no side that is nearly as long as it is far.
            ends = a[:, near], b[:, near], c[:, near]
            sides = (dot(side, side) for side in (ends[1] - ends[0], ends[2] - ends[0], ends[2] - ends[1]))
            return part.start + near[reduce(np.maximum, sides) > 0.9**2 * farthest[near]]

    @made_once
    def distance(self) -> Float32s:
        """(m,), of the plane from the eye; 0 where it is seen edge-on, or has no area."""
        distance = np.empty(self._triangles.count, np.float32)

        def fill(part: slice) -> None:
            plane = self.forms[:3, part]
            with np.errstate(all="ignore"):
                distance[part] = np.nan_to_num(1.0 / np.sqrt(dot(plane, plane)))

        each(fill, parts(self._triangles.count), self._triangles.threads)
        return distance

    @made_once
    def normals(self) -> Float32s:
        """(3, m), unit, world space, facing the eye; 0 where the plane is seen edge-on."""
        normals = np.empty((3, self._triangles.count), np.float32)

        def fill(part: slice) -> None:
            towards_eye = facing(self.forms[:3, part])
            normals[:, part] = [np.nan_to_num(dot(axis, towards_eye)) for axis in self._view.axes.T]

        each(fill, parts(self._triangles.count), self._triangles.threads)
        return normals

    @made_once
    def magnitude(self) -> Float32s:
        """(m,): what a renderer's relative rounding applies to, the largest coordinate in world space plus the distance of the
        farthest corner from the eye times the triangle's slenderness, its longest side over its height: barycentric coordinates
        that are computed from the eye are off by a rounding of that distance over the height, and move the hit along the
        longest side.
        """
        magnitude = np.empty(self._triangles.count, np.float32)
        largest = self._triangles.largest_coordinates()

        def fill(part: slice) -> None:
            corners = self._triangles.corners[:, part]
            a, b, c = gather(self._triangles.vertices, corners).transpose(1, 0, 2)
            sides = b - a, c - a, c - b
            normal = _normal(*sides[:2])
            longest = reduce(np.maximum, (dot(side, side) for side in sides))
            farthest = np.sqrt(reduce(np.maximum, (dot(corner, corner) for corner in (a, b, c))))
            with np.errstate(all="ignore"):
                slender = np.minimum(longest / np.sqrt(dot(normal, normal)), _MOST_SLENDER)
                magnitude[part] = reduce(np.maximum, (gather(largest, corner) for corner in corners)) + farthest * slender

        each(fill, parts(self._triangles.count), self._triangles.threads)
        return magnitude

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
