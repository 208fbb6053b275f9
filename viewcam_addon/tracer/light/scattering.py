"""Which way light goes on from a surface: Lambert's reflection, the mirror, refraction, and Fresnel's share of both.

Pure functions of arrays (3, n) float64, in any space. A direction is the way that a ray travels, a unit vector; a normal is
of unit length and stands on the side that the ray comes from. What Cycles makes of smooth, perfectly specular surfaces
(measured with 4.2, 5.0 and 5.2) is this: Fresnel's equations as they are, no factor for the narrower cone of light
in glass, and normals bent as in `specular_normal`.
"""

import numpy as np

from ..arrays import Floats, dot
from ..compiled.standing import or_compiled

# Cycles': how far a mirror's ray rises above the surface at least, or this part of how far the ray rises that comes.
_LEAST_RISE, _RISE_SHARE = 0.01, 0.9
# Half of a sampler's last digit: no direction is a pole of the sphere, which would be no direction where it meets the surface.
POLE = 2.0**-33


def axes_about(normal: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors, each (3, n), that make a right-handed frame with unit vectors `normal`; without a singularity.

    After Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6 (2017): the error is 4e-16 for any normal.
    """
    x, y, z = normal
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    right, up = np.empty((2, *normal.shape))
    xa = x * a
    np.multiply(sign, x, out=right[2])
    np.multiply(right[2], xa, out=right[0])
    right[0] += 1.0
    np.multiply(xa, y, out=up[0])
    np.multiply(sign, up[0], out=right[1])
    np.negative(right[2], out=right[2])
    a *= y
    np.multiply(a, y, out=up[1])
    up[1] += sign
    np.negative(y, out=up[2])
    return right, up


def turned(u: Floats) -> tuple[Floats, Floats]:
    """Points of the unit circle, x and y, u of the way round it from (1, 0). One tangent of half the angle tells both: of
    float64, NumPy's sine and cosine take ten times as long."""
    slope = np.tan(u * np.pi)
    chord = 2.0 / (1.0 + slope * slope)
    return chord - 1.0, chord * slope


@or_compiled
def cosine_direction(normal: Floats, u: Floats) -> tuple[Floats, Floats]:
    """Directions as often as the cosine of their angle to the normal is large, and how often that is.

    normal : (3, n). u : (2, n), in [0, 1).

    Returns directions (3, n), unit, and their density per solid angle (n,), the cosine over π. They point from where a unit
    sphere touches the surface to points that lie evenly all over the sphere, twice the cosine away: no frame is needed.
    """
    direction = np.empty(normal.shape)
    height = u[0] * (2.0 - 4 * POLE)
    height += 2 * POLE - 1.0
    across = np.sqrt(1.0 - height * height)
    for component, turn in zip(direction[:2], turned(u[1]), strict=True):
        np.multiply(across, turn, out=component)
    direction[2] = height
    direction += normal
    length = np.sqrt(dot(direction, direction))
    direction /= length
    length *= 0.5 / np.pi
    return direction, length


def reflected(direction: Floats, normal: Floats) -> Floats:
    """(3, n): where a mirror sends rays."""
    return direction - 2.0 * dot(direction, normal) * normal


def refracted(direction: Floats, normal: Floats, ratio: Floats) -> tuple[Floats, Floats]:
    """Where Snell's law sends rays, and where there is total reflection instead.

    ratio : (n,) or one, the index of refraction on the far side over that on the side that the ray comes from.

    Returns directions (3, n), unit, and (n,) bool, True where no light goes through; there the direction is along the surface.
    """
    across = direction - dot(direction, normal) * normal
    across /= ratio
    squared = dot(across, across)
    total = squared >= 1.0
    if total.any():
        across /= np.where(total, np.sqrt(squared), 1.0)
    across -= np.sqrt(np.maximum(1.0 - squared, 0.0)) * normal
    return across, total


def fresnel(cosine: Floats, ratio: Floats) -> Floats:
    """(n,): the part of unpolarised light that a clear surface reflects; the rest is refracted.

    cosine : (n,), of the angle between the ray and the normal, 0 to 1. ratio : as in `refracted`.
    """
    excess = ratio * ratio - 1.0
    squared = excess + cosine * cosine
    far = np.sqrt(np.maximum(squared, 0.0))  # the cosine on the far side, times the ratio
    slowed = ratio * ratio * cosine
    with np.errstate(invalid="ignore", divide="ignore"):  # total reflection, and a ray along the surface
        perpendicular = excess / np.square(far + cosine)  # (far − cosine) / (far + cosine) without cancellation
        parallel = (far - slowed) / (far + slowed)
    share = 0.5 * (perpendicular * perpendicular + parallel * parallel)
    return np.where(squared > 0.0, np.minimum(share, 1.0), 1.0)


def specular_normal(direction: Floats, normal: Floats, shading: Floats) -> Floats:
    """(3, n): the smooth normals of a mirror or of glass, bent towards the true ones where their mirror's ray would go below.

    normal : of the true geometry. shading : smooth. `shading` itself is returned where none is bent.

    As in Cycles, a mirror's ray rises by a hundredth above the surface or, where the ray that comes is flatter still, by nine
    tenths of that one's rise, and the normal stays in the plane of the two. There the way back to the eye has the length r and
    the angle φ from the true normal, counted towards the smooth one, and a mirror whose normal is turned by α sends the ray off
    at 2α − φ. Its rise, r cos(2α − φ), is the least where α = (φ + arccos(rise / r)) / 2.
    """
    if shading is normal:
        return shading
    rise = np.minimum(_RISE_SHARE * np.maximum(-dot(direction, normal), 0.0), _LEAST_RISE)
    below = np.flatnonzero(dot(reflected(direction, shading), normal) < rise)
    if not len(below):
        return shading
    back, true, smooth, rise = -direction[:, below], normal[:, below], shading[:, below], rise[below]
    aside = smooth - dot(smooth, true) * true
    length = np.sqrt(dot(aside, aside))
    aside /= np.where(length > 0, length, 1.0)
    up, along = dot(back, true), dot(back, aside)
    reach = np.hypot(up, along)
    turn = (np.arctan2(along, up) + np.arccos(np.minimum(rise / np.where(reach > 0, reach, 1.0), 1.0))) / 2
    bent = shading.copy()
    bent[:, below] = np.sin(turn) * aside + np.cos(turn) * true
    return bent
