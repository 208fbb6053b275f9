"""Where a ray that leaves a surface starts, and where one that asks for a light ends.

A hit is known in float64, but Embree gets float32: corners, origins and directions in camera space, whose origin is the eye. A
ray that starts on the surface itself meets it again every second time (acne); one that starts too far off steps over what
stands close by (a leak). So it starts as far off as float32 can move surface and start, and no farther. With u = 2⁻²⁴, half a
unit in the last place, M the triangle's largest |coordinate| in camera space and L its longest side:

- Rounding the corners moves no point of the triangle along its normal by more than √3 u M, and rounding the origin moves that
  as far: 2 √3 u M. A ray that starts farther off and goes outwards meets no point of the rounded triangle in exact arithmetic.
- Embree, in robust mode, takes the corners relative to the origin, v, each coordinate rounded: √3 u L. Of two of their
  differences, e and e′, it takes the normal N = e × e′, and the sign of v·N tells on which side of the plane the ray starts.
  The rounding of e and e′ adds u |e| |e′ × v| and as much again, 2 u L |N|; that of the products u |e||e′||v|, that of their
  differences u |N||v|, the dot product 3 u |N||v|. Divided by |N|, in all: u L (√3 + 2 + σ + 1 + 3) with σ = |e||e′|/|N|.
  Embree takes the pair whose products are small, and one of it is the shortest side: with the longest as the other, σ is 1 for
  a needle with a right angle, 2/√3 for an equilateral triangle, and large for a cap only, three corners nearly in a line.

The sum is the triangle's offset, u (3.5 M + (8 + σ) L); with half of it there is acne. Scaling the scene scales it.

What it can't mend: directions are rounded too, and a flat ray passes over what lies farther off and is rounded by more. So a
ray that rises from its surface by less than 2⁻¹⁸ of its length counts as blocked: a rounding decides about it, and it brings no
more than that part of a light. Needles thinner than some u M are no surface in float32: of rays along them, a few in 100,000
meet them. And a wall that is nearer than the offset is behind the start: beside the eye, a floor of 10 km in two triangles
would have one of millimetres. Such wide triangles are tested in float64 (alone.py); what their rays need is to clear what
Embree sees near the eye, so they start as far off as those of a triangle that is as large as it is near.

Ellipsoids need none (offsets of 0): they are tested in float64, with the start as the eye. It may lie inside by a rounding,
from where nothing of them is seen, or outside, from where a ray that goes outwards has its near root behind it.

Rejected: a fixed distance, and one relative to |P| alone, which know nothing of how large the triangle is and leak at small
scales; steps of floats in each coordinate (Wächter and Binder, Ray Tracing Gems, 2019, ch. 6), for the same reasons; passing
over the primitive that the ray leaves, which embreex can't. What each of them costs is counted in
benchmarks/stability/secondary_rays.py.
"""

from functools import reduce

import numpy as np

from ..arrays import Float32s, Floats, cross, dot, gather
from .tables import each, parts
from .triangles import Planes, Triangles

FLATTEST = 2.0**-18
"""|cos| between a ray and its surface's normal below which it counts as blocked."""

FLOAT32 = 2.0**-24
ROUNDING, ARITHMETIC = 3.5, 8.0
# Flatter caps are lower than u σ L, and no surface to speak of.
_FLATTEST_CAP = 2.0**11
# Seen from the start, L is the distance: σ is taken as 1, and direction and length are rounded as well, by √3 and by 1.
ENDING = 4.0


def triangle_offsets(triangles: Triangles) -> Floats:
    """(m,) float64, camera space: how far off each triangle a ray that leaves it starts."""
    offsets = np.empty(triangles.count)

    def fill(part: slice) -> None:
        corners = gather(triangles.vertices, triangles.corners[:, part])
        a, b, c = corners.transpose(1, 0, 2)
        ab, ac, bc = b - a, c - a, c - b
        sides = dot(ab, ab), dot(ac, ac), dot(bc, bc)
        longest, shortest = (np.sqrt(reduce(choose, sides)) for choose in (np.maximum, np.minimum))
        normal = cross(ab, ac)
        with np.errstate(all="ignore"):
            cap = np.fmin(shortest * longest / np.sqrt(dot(normal, normal)), _FLATTEST_CAP)
        farthest = np.abs(corners, out=corners).max(axis=(0, 1))
        offsets[part] = FLOAT32 * (ROUNDING * farthest + (ARITHMETIC + cap) * longest)

    each(fill, parts(triangles.count), triangles.threads)
    return offsets


def wide_offsets(planes: Planes) -> Floats:
    """(k,) float64, camera space: that of `planes.wide`, which are tested in float64: as of a small triangle near the eye."""
    plane = gather(planes.forms[:3], planes.wide)
    return FLOAT32 * ROUNDING / np.sqrt(dot(plane, plane))


def start(points: Floats, normals: Floats, directions: Floats, offsets: Floats) -> Floats:
    """(3, n) float64, camera space: where rays that leave points of surfaces start, on the side that they go to.

    points : (3, n) float64, camera space. normals : (3, n), unit, of the true geometry, of either side. directions : (3, n), of
    any length. offsets : (n,) of the primitives that the points lie on.
    """
    starts = np.copysign(offsets, dot(normals, directions)) * normals
    starts += points
    return starts


def shadow_rays(starts: Floats, lights: Floats) -> tuple[Float32s, Float32s, Float32s]:
    """What Embree needs to ask whether anything stands between points and lights.

    A ray ends before its light by what float32 can move a surface on which the light lies, seen from the start: what the light
    touches does not hide it. Points of a lamp's surface are first moved off it by `start`, if something lies in that surface.

    starts : (3, n) float64, camera space, from `start`. lights : (3, n) float64, camera space.

    Returns origins (n, 3), directions (n, 3), lengths (n,) in directions: all float32.
    """
    origins, directions = np.empty((2, starts.shape[1], 3), np.float32)
    squared, largest = np.zeros((2, starts.shape[1]))
    for axis, light in enumerate(lights):
        origins[:, axis] = starts[axis]
        apart = light - origins[:, axis]
        directions[:, axis] = apart
        apart *= apart
        squared += apart
        np.maximum(largest, np.abs(light), out=largest)
    distance = np.sqrt(squared)
    slack = FLOAT32 * (ROUNDING * largest + (ARITHMETIC + ENDING) * distance)
    lengths = np.maximum(distance - slack, 0.0) / np.where(distance > 0, distance, 1.0)
    return origins, directions, lengths.astype(np.float32)
