"""The spheres of a scene in camera space, ellipsoids by their objects' matrices, and where a ray meets one, in float64.

A sphere under an affine map is the set of points P with |A⁻¹P − f| = 1, A its linear part times the radius. The ray is taken
into that space, where the discriminant is that of the perpendicular from the centre to the ray and the near root is c/q: both
keep their digits for a small sphere far away (Haines et al., Precision improvements for ray/sphere intersection, Ray Tracing
Gems, 2019). As in Cycles, an eye inside a sphere does not see it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .arrays import Float32s, Floats, Indices, dot, gather, linear
from .scene import Object, Spheres
from .view import View


@dataclass(frozen=True, eq=False)
class Ellipsoids:
    """n spheres that the eye can see, in the order of their nearest depth.

    inverse : (9, n) float64: [3 · column + row, sphere] of A⁻¹. centres : (3, n) float64: f.
    tangent : (n,) float64: |f|² − 1 > 0.
    positions : (3, n) float64, camera space, the centres. reach : (n,) float64, no point is farther from the centre.
    nearest : (n,) float64, least depth z. The spheres without bounds come first, then the others, nearest first.
    bounds : (4, n) float64: least x, greatest x, least y, greatest y in the view plane at distance 1, −inf and inf where the
        sphere reaches behind the eye's plane.
    object_index, material_index, magnitude : (n,) float32, as in `Triangles`; magnitude is that of the sphere's extent, and
        a sphere is as slender as an equilateral triangle: not at all.
    """

    inverse: Floats
    centres: Floats
    tangent: Floats
    positions: Floats
    reach: Floats
    nearest: Floats
    bounds: Floats
    object_index: Float32s
    material_index: Float32s
    magnitude: Float32s

    @property
    def count(self) -> int:
        return len(self.nearest)

    def depth(self, sphere: Indices, x: Floats, y: Floats) -> Floats:
        """Planar depth at which rays (x, y, 1) first meet spheres, inf where they miss; all broadcast."""
        centre = gather(self.centres, sphere)
        direction = self._direction(sphere, x, y)
        squared = dot(direction, direction)
        along = dot(centre, direction)
        foot = along / squared
        beside = [f - foot * d for f, d in zip(centre, direction, strict=True)]
        discriminant = 1.0 - dot(beside, beside)
        met = (discriminant >= 0) & (along > 0)
        root = np.sqrt(np.where(met, discriminant, 0.0) * squared)
        depth = gather(self.tangent, sphere) / np.where(met, along + root, 1.0)
        return np.where(met, depth, np.inf)

    def normal(self, sphere: Indices, x: Floats, y: Floats, depth: Floats) -> list[Floats]:
        """Camera-space components, each (n,), of the unit normals at the depths that `depth` found; they face the eye."""
        inverse = gather(self.inverse, sphere)
        unit = [d * depth - f for d, f in zip(self._direction(sphere, x, y), gather(self.centres, sphere), strict=True)]
        return _unit([dot(inverse[column : column + 3], unit) for column in (0, 3, 6)])

    def shown_normal(self, sphere: Indices, x: Floats, y: Floats, depth: Floats) -> list[Floats]:
        """What Cycles' Normal pass shows, as `normal`: the direction from the centre, or to it where that faces the eye.

        Of a sphere this is the normal; of an ellipsoid it is not.
        """
        ray = (x, y, 1.0)
        outward = _unit([d * depth - centre for d, centre in zip(ray, gather(self.positions, sphere), strict=True)])
        towards_eye = np.where(dot(outward, ray) > 0, -1.0, 1.0)
        return [component * towards_eye for component in outward]

    def _direction(self, sphere: Indices, x: Floats, y: Floats) -> list[Floats]:
        """The three components of A⁻¹ (x, y, 1)."""
        inverse = gather(self.inverse, sphere)
        return [linear(inverse[row::3], x, y) for row in range(3)]


def _unit(vector: list[Floats]) -> list[Floats]:
    length = np.sqrt(dot(vector, vector))
    return [component / length for component in vector]


def ellipsoids_of(pairs: list[tuple[Object, Spheres]], view: View) -> Ellipsoids:
    """The spheres of all objects that are spheres, without those that are points, lie behind the eye or hold it."""
    parts = [_of_object(placed, spheres, view) for placed, spheres in pairs]
    tables = [np.concatenate(table, axis=-1) for table in zip(*parts, strict=True)] if parts else _of_nothing()
    _, _, tangent, positions, reach, nearest, bounds, *_ = tables
    seen = np.flatnonzero((tangent > 0) & (positions[2] + reach > 0))
    seen = seen[np.lexsort((nearest[seen], np.isfinite(bounds[0, seen])))]
    return Ellipsoids(*(np.take(table, seen, axis=-1) for table in tables))


def _of_nothing() -> list[NDArray]:
    shapes = [(9, 0), (3, 0), (0,), (3, 0), (0,), (0,), (4, 0), (0,), (0,), (0,)]
    return [np.empty(shape, np.float64 if i < 7 else np.float32) for i, shape in enumerate(shapes)]


def _of_object(placed: Object, spheres: Spheres, view: View) -> list[NDArray]:
    """The tables of `Ellipsoids`, in the order of its fields, for one object."""
    linear = placed.matrix[:3, :3]
    if np.linalg.matrix_rank(linear) < 3:
        return _of_nothing()
    radii = spheres.radii
    centres, _ = view.points(placed.matrix, spheres.centers)
    with np.errstate(all="ignore"):  # a sphere of radius 0 has no inverse and is never seen
        inverse = np.linalg.inv(view.axes @ linear)
        scaled = (inverse @ centres) / radii
        length = np.sqrt(dot(scaled, scaled))
        tangent = (length - 1) * (length + 1)
        nearest, bounds = _extent(centres, view.axes @ linear, radii)
        inverses = inverse.T.reshape(9, 1) / radii
    tangent[~(radii > 0)] = 0
    world = view.axes.T @ centres + view.eye[:, None]
    extent = np.sqrt(np.einsum("ij,ij->i", linear, linear))[:, None] * radii
    return [
        inverses,
        scaled,
        tangent,
        centres,
        np.linalg.norm(linear) * radii,
        nearest,
        bounds,
        np.full(len(radii), placed.object_index, np.float32),
        np.array(placed.material_indices, np.float32)[spheres.materials],
        ((np.abs(world) + extent).max(axis=0, initial=0.0) + np.sqrt(dot(centres, centres))).astype(np.float32),
    ]


def _extent(centres: Floats, linear: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """Least depth, and bounds in the view plane, of spheres.

    A plane x = k z through the eye touches the ellipsoid where (c_x − k c_z)² = (1, 0, −k) Q (1, 0, −k)ᵀ with Q = A Aᵀ: the
    two k are the bounds.
    """
    q = linear @ linear.T
    reach = np.sqrt(q[2, 2]) * radii
    nearest, farthest = centres[2] - reach, centres[2] + reach
    before = nearest > 2.0**-10 * farthest  # far enough before the eye's plane for bounds that mean something
    bounds = np.empty((4, len(radii)))
    squared = nearest * farthest
    for axis in range(2):
        half = centres[axis] * centres[2] - q[axis, 2] * radii**2
        constant = centres[axis] ** 2 - q[axis, axis] * radii**2
        root = np.sqrt(np.maximum(half * half - squared * constant, 0.0))
        bounds[2 * axis] = np.where(before, (half - root) / squared, -np.inf)
        bounds[2 * axis + 1] = np.where(before, (half + root) / squared, np.inf)
    return nearest, bounds
