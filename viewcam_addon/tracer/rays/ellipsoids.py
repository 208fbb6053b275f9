"""The spheres of a scene in camera space, ellipsoids by their objects' matrices, and where a ray meets one, in float64.

A sphere under an affine map is the set of points P with |A⁻¹P − f| = 1, A its linear part times the radius. The ray is taken
into that space, where the near root is (|f|² − 1)/q with q = f·d + √…, which never cancels. Two things would:

- The discriminant. Far away it is that of the perpendicular from the centre to the ray, which loses |f| where the textbook's
  loses |f|² (Haines et al., Precision improvements for ray/sphere intersection, Ray Tracing Gems, 2019). Near the surface the
  textbook's is the better one, given an exact |f|² − 1: it keeps the digits of a ray that runs along the surface.
- |f|² − 1, for an eye close to the surface. The eye is taken into the object's space as a pair of float64 and the square is
  summed in such pairs, so that an eye 1e-16 radii outside knows it. As in Cycles, an eye inside a sphere does not see it,
  and one exactly on it is inside.

Rejected: compensated discriminants for every ray. The ray's own rounding, 2⁻⁵³ of its direction, moves the foot of the
perpendicular by as much as the arithmetic that they would save.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...exact import difference, sum_terms, two_product, two_sum
from ..arrays import Float32s, Floats, Indices, dot, gather, linear
from ..scene import Object, Spheres
from .tables import by_material
from .view import View

# |f|² − 1 below which the textbook's discriminant, rounded by 2⁻⁵³ |f|² cos² at most, is not worse than the perpendicular's.
NEAR = 1.0
# Spheres whose squares come near the ends of float64's range, 1e±135 in size, are not seen: no pass of float32 could show them.
_MOST = 2.0**900


@dataclass(frozen=True, eq=False)
class Ellipsoids:
    """n spheres that the eye can see, in the order of their nearest depth.

    inverse : (9, n) float64: [3 · column + row, sphere] of A⁻¹. centres : (3, n) float64: f.
    tangent : (n,) float64: |f|² − 1 > 0, to all digits however near the surface the eye is.
    positions : (3, n) float64, camera space, the centres. reach : (n,) float64, no point is farther from the centre.
    nearest : (n,) float64, least depth z. The spheres without bounds come first, then the others, nearest first.
    bounds : (4, n) float64: least x, greatest x, least y, greatest y in the view plane at distance 1, −inf and inf where the
        sphere reaches behind the eye's plane.
    number : (n,) int32, which of the scene's spheres they are, counted from object to object.
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
    number: NDArray[np.int32]
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
        tangent = gather(self.tangent, sphere)
        near = tangent < NEAR
        if near.any():
            discriminant = np.where(near, along * foot - tangent, discriminant)
        met = (discriminant >= 0) & (along > 0)
        root = np.sqrt(np.where(met, discriminant, 0.0) * squared)
        return np.where(met, tangent / np.where(met, along + root, 1.0), np.inf)

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
    """The spheres of all objects that are spheres, without those that the eye does not see.

    It does not see those that are points, are flat, lie behind it, hold it, or are hidden from the camera.
    """
    owner = np.repeat(np.arange(len(pairs)), [len(spheres.radii) for _, spheres in pairs])
    centers = np.concatenate([np.empty((0, 3)), *(spheres.centers for _, spheres in pairs)]).T
    radii = np.concatenate([np.empty(0), *(spheres.radii for _, spheres in pairs)])
    matrices = np.array([placed.matrix for placed, _ in pairs], np.float64).reshape(-1, 4, 4)
    linear = matrices[:, :3, :3]
    solid = np.linalg.matrix_rank(linear) == 3
    inverse = np.linalg.inv(np.where(solid[:, None, None], linear, np.eye(3)))
    with np.errstate(all="ignore"):  # a sphere of radius 0 has no inverse and is never seen
        relative, tangent = _from_eye(matrices, inverse, owner, centers, radii, view.eye)
        turned = gather((view.axes @ linear).transpose(1, 2, 0), owner)
        positions = np.stack([dot(row, relative) for row in turned])
        nearest, bounds = _extent(positions, turned, radii)
        inverses = gather((inverse @ view.axes.T).transpose(2, 1, 0).reshape(9, -1), owner) / radii
        # By the same rounded inverse as the rays: an ellipsoid is then rounded in its shape and not in its place.
        centres = np.stack([dot(inverses[row::3], positions) for row in range(3)])
        squares = (inverses * inverses).sum(axis=0)
        extent = gather(np.sqrt((linear * linear).sum(axis=2)).T, owner) * radii
        reach = np.sqrt(dot(extent, extent))
        world = np.abs(view.axes.T @ positions + view.eye[:, None]) + extent
        largest = np.maximum(world.max(axis=0), np.abs(matrices[:, :3, 3]).max(axis=1)[owner])  # as in View.points
        magnitude = (largest + np.sqrt(dot(positions, positions))).astype(np.float32)
    held = (squares > 1 / _MOST) & (squares < _MOST) & (tangent < _MOST)
    shown = np.array(["camera" not in placed.hidden_from for placed, _ in pairs], bool)
    seen = np.flatnonzero((solid & shown)[owner] & held & (tangent > 0) & (positions[2] + reach > 0))
    seen = seen[np.lexsort((nearest[seen], np.isfinite(bounds[0, seen])))]
    objects = np.array([placed.object_index for placed, _ in pairs], np.float32)
    materials = by_material(pairs, [placed.material_indices for placed, _ in pairs], np.float32)
    return Ellipsoids(
        inverse=gather(inverses, seen),
        centres=gather(centres, seen),
        tangent=gather(tangent, seen),
        positions=gather(positions, seen),
        reach=gather(reach, seen),
        nearest=gather(nearest, seen),
        bounds=gather(bounds, seen),
        number=seen.astype(np.int32),
        object_index=gather(gather(objects, owner), seen),
        material_index=gather(materials, seen),
        magnitude=gather(magnitude, seen),
    )


def _from_eye(
    matrices: Floats, inverse: Floats, owner: Indices, centers: Floats, radii: Floats, eye: Floats
) -> tuple[Floats, Floats]:
    """(3, n) the centres less the eye in their objects' spaces, and (n,) |f|² − 1, the squares summed in pairs of float64.

    matrices : (k, 4, 4) of the objects, inverse : (k, 3, 3). owner : (n,) which object. centers : (3, n). radii : (n,).
    """
    apart = difference(tuple(matrices[:, :3, 3].T), tuple(eye))
    away, away_low = _solved(matrices[:, :3, :3], inverse, *map(np.array, apart))
    high, low = two_sum(centers, gather(away, owner))
    high, low = two_sum(high, low + gather(away_low, owner))
    exponent = np.frexp(radii)[1]  # scaled by it, no square leaves float64's range
    unit = np.ldexp(radii, -exponent)
    total, error = two_product(-unit, unit)
    for component, rest in zip(np.ldexp(high, -exponent), np.ldexp(low, -exponent), strict=True):
        square, square_error = two_product(component, component)
        total, sum_error = two_sum(total, square)
        error = error + (sum_error + square_error + 2 * component * rest)
    return high, (total + error) / unit**2


def _solved(linear: Floats, inverse: Floats, right: Floats, right_low: Floats) -> tuple[Floats, Floats]:
    """(3, k) x and x_low with linear · (x + x_low) = right + right_low: one step of refinement with an exact residual."""
    x = np.einsum("kij,jk->ik", inverse, right)
    products, errors = two_product(-linear.transpose(1, 2, 0), x)
    rows = zip(right, right_low, products, errors, strict=True)
    residual = np.array([sum_terms([high, low, *product, *error])[0] for high, low, product, error in rows])
    return x, np.einsum("kij,jk->ik", inverse, residual)


def _extent(centres: Floats, linear: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """Least depth, and bounds in the view plane, of spheres.

    centres : (3, n), camera space. linear : (3, 3, n), from object space to camera space. radii : (n,).

    A plane x = k z through the eye touches the ellipsoid where (c_x − k c_z)² = (1, 0, −k) Q (1, 0, −k)ᵀ with Q = A Aᵀ: the
    two k are the bounds.
    """
    x, y, z = linear
    reach = np.sqrt(dot(z, z)) * radii
    nearest, farthest = centres[2] - reach, centres[2] + reach
    before = nearest > 2.0**-10 * farthest  # far enough before the eye's plane for bounds that mean something
    bounds = np.empty((4, len(radii)))
    squared = nearest * farthest
    for axis, row in enumerate((x, y)):
        half = centres[axis] * centres[2] - dot(row, z) * radii**2
        constant = centres[axis] ** 2 - dot(row, row) * radii**2
        root = np.sqrt(np.maximum(half * half - squared * constant, 0.0))
        bounds[2 * axis] = np.where(before, (half - root) / squared, -np.inf)
        bounds[2 * axis + 1] = np.where(before, (half + root) / squared, np.inf)
    return nearest, bounds
