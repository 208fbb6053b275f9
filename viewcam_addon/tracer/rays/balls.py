"""All spheres of a scene in camera space, for rays that come from anywhere; ellipsoids.py is for those from the eye.

As Cycles does with point clouds, a ray meets a sphere from outside only: one that starts inside, or on it, passes out through
it, and a sphere is never met by a ray that leaves it. (So a glass sphere refracts on the way in and not on the way out.)
Spheres that the eye does not see, since they lie behind it or hold it, are here too.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, dot, gather
from ..scene import Object, Spheres
from .tables import in_camera_space
from .view import View

# |f|² − 1 below which the textbook's discriminant is better than the perpendicular's (ellipsoids.py).
NEAR = 1.0
# Spheres smaller or larger than this are not met: their squares leave float64's range.
_SMALLEST, _LARGEST = 2.0**-450, 2.0**450


@dataclass(frozen=True, eq=False)
class Balls:
    """n spheres that are not flat.

    centres : (3, n) float64, camera space. radii : (n,) float64, in their objects' spaces.
    inverse : (9, k) float64, from camera space to the objects' spaces: [3 · column + row, object].
    owner : (n,) int32, which of the k objects.
    axes : (3, 3, n) float64: [axis, component, sphere], the principal half axes, camera space.
    reach : (n,) float64, the longest of them.
    number : (n,) int32, which of the scene's spheres they are, counted from object to object.
    placed : all objects with their spheres.
    """

    centres: Floats
    radii: Floats
    inverse: Floats
    owner: NDArray[np.int32]
    axes: Floats
    reach: Floats
    number: NDArray[np.int32]
    placed: tuple[tuple[Object, Spheres], ...]

    @property
    def count(self) -> int:
        return len(self.radii)

    def hidden_from(self, ray: str) -> NDArray[np.bool_]:
        """(n,): which spheres a kind of rays does not see (lights.RAYS)."""
        hidden = np.array([ray in placed.hidden_from for placed, _ in self.placed], bool)
        return gather(hidden, self.owner)

    def near(self, ball: int, origins: Floats, directions: Floats, limits: Floats) -> Indices:
        """Which of n rays may meet one sphere nearer than their limits. As in `distance`, with directions of unit length."""
        relative = self.centres[:, ball, None] - origins
        along = dot(relative, directions)
        reach = self.reach[ball] * (1 + 1e-9)
        apart = dot(relative, relative)
        apart *= 1 - 2.0**-48  # less its rounding
        apart -= along * along
        return np.flatnonzero((apart <= reach * reach) & (along > -reach) & (along < limits + reach))

    def distance(self, ball: Indices, origins: Floats, directions: Floats) -> Floats:
        """Where rays from outside first meet spheres, in lengths of their directions; inf where they don't. All broadcast.

        ball : (n,), or one for all. origins, directions : (3, n), camera space.
        """
        if np.ndim(ball) == 0:
            ball = np.array([ball])
        inverse = gather(self.inverse, gather(self.owner, ball))
        scale = 1.0 / gather(self.radii, ball)
        relative = (gather(self.centres, ball) - origins) * scale
        towards = directions * scale
        centre = [dot(inverse[row::3], relative) for row in range(3)]
        way = [dot(inverse[row::3], towards) for row in range(3)]
        squared = dot(way, way)
        along = dot(centre, way)
        tangent = dot(centre, centre) - 1.0
        with np.errstate(all="ignore"):  # a direction of 0
            foot = along / squared
            beside = [f - foot * d for f, d in zip(centre, way, strict=True)]
            discriminant = np.where(tangent < NEAR, along * foot - tangent, 1.0 - dot(beside, beside))
            met = (discriminant >= 0) & (along > 0) & (tangent > 0)
            root = np.sqrt(np.where(met, discriminant, 0.0) * squared)
            return np.where(met, tangent / (along + root), np.inf)


def balls_of(pairs: list[tuple[Object, Spheres]], view: View) -> Balls:
    """The spheres of all objects that are spheres, without those that are points or flat."""
    matrices = np.array([placed.matrix for placed, _ in pairs]).reshape(-1, 4, 4)
    solid = np.linalg.matrix_rank(matrices[:, :3, :3]) == 3
    turned = view.axes @ matrices[:, :3, :3]
    inverse = np.linalg.inv(np.where(solid[:, None, None], turned, np.eye(3)))
    directions, lengths, _ = np.linalg.svd(turned)
    axes = (directions * lengths[:, None]).transpose(2, 1, 0)  # [axis, component, object]
    centres = in_camera_space(pairs, [spheres.centers for _, spheres in pairs], view)
    owner = np.repeat(np.arange(len(pairs)), [len(spheres.radii) for _, spheres in pairs])
    radii = np.concatenate([np.empty(0), *(spheres.radii for _, spheres in pairs)])
    half_axes = gather(axes, owner) * radii
    extent = np.sqrt((half_axes * half_axes).sum(axis=1))
    held = solid[owner] & (extent > _SMALLEST).all(axis=0) & (extent < _LARGEST).all(axis=0)
    chosen = np.flatnonzero(held)
    return Balls(
        centres=gather(centres, chosen),
        radii=gather(radii, chosen),
        inverse=inverse.transpose(2, 1, 0).reshape(9, -1),
        owner=gather(owner, chosen).astype(np.int32),
        axes=gather(half_axes, chosen),
        reach=gather(extent.max(axis=0, initial=0.0), chosen),
        number=chosen.astype(np.int32),
        placed=tuple(pairs),
    )
