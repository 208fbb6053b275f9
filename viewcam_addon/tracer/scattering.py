"""Which way light goes on from a surface: Lambert's reflection, the mirror, refraction, and Fresnel's share of both.

Pure functions of arrays (3, n) float64, in any space. A direction is the way that a ray travels, a unit vector; a normal is unit
length and stands on the side that the ray comes from.
"""

import numpy as np

from .arrays import Floats, dot


def axes_about(normal: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors, each (3, n), that make a right-handed frame with unit vectors `normal`; without a singularity.

    After Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6 (2017): the error is 4e-16 for any normal.
    """
    x, y, z = normal
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    return np.stack([1.0 + sign * x * x * a, sign * b, -sign * x]), np.stack([b, sign + y * y * a, -y])


def cosine_direction(normal: Floats, u: Floats) -> tuple[Floats, Floats]:
    """Directions as often as the cosine of their angle to the normal is large, and how often that is.

    normal : (3, n). u : (2, n), in [0, 1).

    Returns directions (3, n), unit, and their density per solid angle (n,), the cosine over π. Squares of equal size are mapped
    to pieces of a disc of equal size, concentric (Shirley and Chiu 1997), and the disc lifted to the hemisphere (Malley).
    """
    right, up = axes_about(normal)
    a, b = 2.0 * u - 1.0
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    with np.errstate(invalid="ignore"):
        turn = np.pi / 4 * (np.where(wide, b, a) / radius)
    turn = np.where(radius == 0.0, 0.0, turn)
    far, aside = radius * np.cos(turn), radius * np.sin(turn)
    x, y = np.where(wide, far, aside), np.where(wide, aside, far)
    cosine = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    return x * right + y * up + cosine * normal, cosine / np.pi


def reflected(direction: Floats, normal: Floats) -> Floats:
    """(3, n): where a mirror sends rays."""
    return direction - 2.0 * dot(direction, normal) * normal


def refracted(direction: Floats, normal: Floats, ratio: Floats) -> tuple[Floats, Floats]:
    """Where Snell's law sends rays, and where there is total reflection instead.

    ratio : (n,) or one, the index of refraction on the far side over that on the side that the ray comes from.

    Returns directions (3, n), unit, and (n,) bool, True where no light goes through; there the direction is along the surface.
    """
    cosine = -dot(direction, normal)
    across = (direction + cosine * normal) / ratio
    squared = dot(across, across)
    total = squared >= 1.0
    length = np.where(total, np.sqrt(squared), 1.0)
    return across / length - np.sqrt(np.maximum(1.0 - squared, 0.0)) * normal, total


def fresnel(cosine: Floats, ratio: Floats) -> Floats:
    """(n,): the part of unpolarised light that a clear surface reflects; the rest is refracted.

    cosine : (n,), of the angle between the ray and the normal, 0 to 1. ratio : as in `refracted`.
    """
    inside = ratio * ratio - 1.0 + cosine * cosine
    g = np.sqrt(np.maximum(inside, 0.0))  # the ratio times the cosine on the far side
    # g − cosine and g − ratio² cosine, without cancellation where the ratio is near 1
    perpendicular = (ratio * ratio - 1.0) / np.square(g + cosine)
    parallel = (g - ratio * ratio * cosine) / (g + ratio * ratio * cosine)
    return np.where(inside > 0.0, 0.5 * (perpendicular * perpendicular + parallel * parallel), 1.0)
