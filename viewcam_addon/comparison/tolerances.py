"""Tolerances of two exact pictures, in closed form, for every pixel of every pass.

Cycles computes in float32, with a relative rounding of 2⁻²⁴. Three things are rounded on the way to a hit at the distance t
along the ray and the planar depth z: the world coordinates, of the size of the largest, that of the object's origin included
(a vertex is multiplied and added to it); the barycentric coordinates, computed from the eye, which move the hit along the
triangle by the distance times the triangle's slenderness; and the ray's direction, which moves the hit by the distance. With M
the sum of the first two (the tracer's Magnitude pass) a hit moves by 2⁻²⁴ · (M + t), and the picture, seen through a view
plane at the distance d, by

    s = 2⁻²⁴ · d · (M + t) / z · t / z    pixels,

where t / z is what a perspective adds away from its axis. k · s is allowed, where k counts the roundings. A renderer's errors
are a distribution: k is given for five percentiles, and calibrated on Cycles' own pictures (ROUNDINGS). Everything else follows
from s by the chain rule: a picture that moves by s pixels shows a depth, a normal or a texture coordinate that is off by s
times its slope in the picture.

Rejected: a fixed number of pixels (right for one scene, wrong for one that is small, far from the origin, wide or telephoto);
a number for each sample scene (it would be chosen, not derived); and k · 2⁻²⁴ · d · max(|P|, |e|) / z, which forgets the ray
and the triangle: k would have to be three times larger for a view of 170°, and thousands of times for the bevel of a long
beam, along which Cycles' positions slide by whole pixels.

"Seen" below means a dict from pass name to (n, channels) arrays: the same pixels, or re-traced rays, in every pass.
"""

import numpy as np
from numpy.typing import NDArray

from ..image import BACKGROUND_DEPTH
from ..pinhole import Pinhole

Array = NDArray[np.float64]
Seen = dict[str, NDArray]

PERCENTILES = (50.0, 90.0, 99.0, 99.9, 100.0)

# Pixels that Cycles' rays are beside the pixels' centers in any case, upwards to the right: its filter table of 512 entries
# answers the middle of a pixel with 3.505e-4 of the filter's width to either side, which is 0.01. Small where a picture has
# hundreds of pixels, and more than all roundings where it has a few.
FILTER_BIAS = 3.505e-6 * 2**0.5

# The error of a position at each of PERCENTILES, in roundings of 2⁻²⁴ · (M + t). The form of s is derived, these factors are
# calibrated, on pictures of the renderer under test: half as much again as in the worst of 120 pictures by Cycles of Blender
# 4.2, 4.5, 5.0 and 5.2 against the tracer, 24 million hits, and twice as much at the maximum. They were views of 0.14° to 170°,
# up to 8 km from the origin, of smooth and flat meshes, faces of 270 m and text: worst 0.41, 0.94, 1.96, 3.2 and 10, over all
# hits 0.23, 0.54, 1.0, 1.5 and 10.
ROUNDINGS = (0.7, 1.4, 3.0, 5.0, 20.0)
# The mean of errors of which each is as large as the next percentile allows: what all of them share is no larger.
MEAN_ROUNDINGS = float(np.diff((0.0, *PERCENTILES)) @ ROUNDINGS) / 100.0

FLOAT32 = 2.0**-24
HALF = 2.0**-11
"""The rounding of a number that is stored as half a float, relative; below LEAST_HALF as much as there."""
LEAST_HALF = 2.0**-14

# A radiance is the product and quotient of some fourteen rounded figures (strength, color, 1/π, the square of a distance, a
# normal's length, a cosine, the exposure, the division by the number of samples): as many roundings at most, and about half of
# them where their signs differ. Counted in units of ROUNDINGS, whose median is below one.
RADIANCE_ROUNDINGS = 8.0
# The cosine between a surface and the lamp is a sum of three products of rounded normals. The normal of a flat face is that of
# its rounded vertices, which turns it by their rounding over the face's extent: measured on flat faces of some pixels to some
# hundred, 8 roundings for one pixel in a thousand and up to 37. With all of these the worst of 64 pictures by Cycles of 4.2,
# 5.0 and 5.2, each with a sun, a point or a spot lamp, uses up 0.8 of the tolerance at the percentile where it comes closest.
COSINE_ROUNDINGS = 6.0
# Cycles adds its samples up in float32. The sum is rounded by half a unit of its last place at most, N times, and half of the
# samples are added while it has its last exponent: N / 4 roundings if all of them go the same way, which is N / 80 times the
# maximum of ROUNDINGS.
SAMPLES_PER_ROUNDING = 80.0

# Pixels. What is less is told in figures, and no sentence warns of it.
VISIBLE = 0.1

# Below this cosine between ray and surface the error grows with its inverse, since the barycentric coordinates are divided by
# it. Measured: k · cosine / 0.2 has its 99th percentile between 0.5 and 1.7 all the way from 0.1 down to 0.001.
GRAZING = 0.2

# Blender 5.2 stores smooth normals as two 16-bit octahedral coordinates. Half a step of both is at most 2.11 / 32767 on the
# sphere (found by encoding and decoding 2 million directions; 0.0037°). Between corners the normal is their sum over its
# length, which is below 1 where they diverge and divides their errors; a scale along the sum does so, too.
# By how much errors grow there, the tracer tells (Normal Enlargement).
NORMAL_STORAGE = 2.11 / 32767

# The error of a radiance where a surface's albedo is looked up in a table: Cycles made its tables by random numbers, the tracer
# by quadrature. Calibrated on 4.2 to 5.2: half of the pixels of random materials are off by 2.7e-5, all but a hundredth by
# 7.8e-5 (tests/blender/light/test_closures.py). A surface of one material is off by the same everywhere.
ALBEDO_TABLES = 1e-4
# The share of the light that Cycles loses of triangles that shine, where it samples them by solid angle: those that are no
# farther than their longest edge. Calibrated, twice the most that was measured on 5.0 (4.5e-4 of a square of two beside a room
# of six, 3e-4 and 2.4e-4 above a floor); beyond that distance it is below 1e-5, as of an area lamp in the square's place.
SHINING_TRIANGLES = 1e-3


def is_hit(seen: Seen) -> NDArray[np.bool_]:
    """(n,) bool: where a ray met something."""
    return seen["Depth"][..., 0] < BACKGROUND_DEPTH


def magnitude(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) M: what float32's relative rounding applies to at a hit, world units.

    From the Magnitude pass; without one max(|P|, |e|) and twice the distance, as for half a square: too small where a huge or a
    slender triangle was hit.
    """
    if "Magnitude" in seen:
        return seen["Magnitude"][..., 0].astype(np.float64)
    position = seen["Position"].astype(np.float64)
    largest = np.maximum(np.abs(position).max(axis=-1), np.abs(pinhole.eye).max())
    return largest + 2.0 * _distance(pinhole, seen)


def facing(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) |cos| between ray and surface, from the Facing pass, else from Normal (a smooth normal is close enough), else 1."""
    if "Facing" in seen:
        return seen["Facing"][..., 0].astype(np.float64)
    if "Normal" not in seen:
        return np.ones(seen["Depth"].shape[:-1])
    ray = seen["Position"].astype(np.float64) - pinhole.eye
    cosine = np.abs((ray * seen["Normal"]).sum(axis=-1)) / np.maximum(np.linalg.norm(ray, axis=-1), np.finfo(float).tiny)
    return np.minimum(cosine, 1.0)


def ray_shift(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) s in pixels: by how much one rounding moves a ray, whatever surface it meets."""
    depth = np.maximum(seen["Depth"][..., 0].astype(np.float64), np.finfo(float).tiny)
    distance = _distance(pinhole, seen)
    return FLOAT32 * max(pinhole.distance) * (magnitude(pinhole, seen) + distance) / depth * (distance / depth)


def position_shift(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) pixels: by how much one rounding moves a position in the picture; as `ray_shift`, and more on a grazed surface."""
    return ray_shift(pinhole, seen) * _grazing_factor(facing(pinhole, seen))


def depth_error(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) relative error of the planar depth that one rounding causes.

    Along the view at most s / d; and since the position lies on the surface but not exactly on the ray, its shift in the
    picture times the slope of ln z: for a plane whose normal makes the angle θ with the ray, tan θ / ρ for each pixel, where
    ρ ≥ d is the length of the ray as far as the view plane.
    """
    return ray_shift(pinhole, seen) * depth_slope(pinhole, seen)


def depth_slope(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) relative error of the planar depth for each pixel by which a ray is off; see `depth_error`."""
    cosine = np.maximum(facing(pinhole, seen), FLOAT32)
    tangent = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / cosine
    return (1.0 + _grazing_factor(cosine) * tangent) / max(pinhole.distance)


def normal_error(pinhole: Pinhole, seen: Seen, slope: Array) -> Array:
    """(n,) radians that one rounding turns a normal by.

    The shift of the picture times the slope of the normal (`slope`, radians a pixel); and for a flat triangle the rounding of
    its vertices over its extent, which is the same shift over its extent in pixels. The latter is taken as one pixel: no
    picture shows the extent of smaller ones.
    """
    return position_shift(pinhole, seen) * (slope + 1.0)


def uv_error(pinhole: Pinhole, seen: Seen, slope: Array) -> Array:
    """(n,) error of a texture coordinate that one rounding causes: the picture's shift times the slope."""
    return position_shift(pinhole, seen) * slope


def uv_storage(seen: Seen) -> Array:
    """(n,) error of a texture coordinate by its own rounding: of three products and two sums, each at most half the largest."""
    return 2.5 * FLOAT32 * np.maximum(np.abs(seen["UV"][..., :2]).max(axis=-1), 1.0)


def radiance_error(value: Array, brightest: Array | float, samples: int) -> Array:
    """Error of a radiance that one rounding of its own figures causes, in its own unit.

    Its roundings (RADIANCE_ROUNDINGS, and those of adding up the samples), and those of the cosine between the surface and the
    lamp, which are absolute: on a surface that the light grazes they are roundings of what the light would be from straight
    above (`brightest`). The picture's shift times the slope of the radiance comes on top.
    """
    roundings = RADIANCE_ROUNDINGS + samples / SAMPLES_PER_ROUNDING
    return FLOAT32 * (roundings * value + COSINE_ROUNDINGS * brightest)


def slopes(values: NDArray, belongs: NDArray) -> Array:
    """The change of a pass from pixel to pixel: the largest distance to the four neighbors that show the same object.

    values : (height, width, channels).
    belongs : (height, width), the object of each pixel, negative for none.

    Returns (height, width) float64, in the pass's unit a pixel.
    """
    values = values.astype(np.float64)
    slope = np.zeros(values.shape[:2])
    for axis in (0, 1):
        here, there = ((*(slice(None),) * axis, side) for side in (slice(None, -1), slice(1, None)))
        step = np.linalg.norm(values[there] - values[here], axis=-1)
        step[(belongs[there] != belongs[here]) | (belongs[here] < 0) | ~np.isfinite(step)] = 0.0
        slope[here] = np.maximum(slope[here], step)
        slope[there] = np.maximum(slope[there], step)
    return slope


def at_borders(belongs: NDArray) -> NDArray[np.bool_]:
    """(height, width): pixels of an object one of whose four neighbors shows another, or nothing, or is beyond the picture.

    On that side `slopes` knows nothing, and near its silhouette a round surface turns the faster the nearer it comes.
    """
    inside = np.ones(belongs.shape, bool)
    for axis in (0, 1):
        beside = np.pad(belongs, 1, constant_values=-1).take(range(1, 1 + belongs.shape[1 - axis]), 1 - axis)
        for first in (0, 2):
            inside &= beside.take(range(first, first + belongs.shape[axis]), axis) == belongs
    return ~inside & (belongs >= 0)


def angle_between(a: NDArray, b: NDArray) -> Array:
    """(n,) radians between unit vectors (n, 3), by their chord: exact for small angles, not fooled by a vector of length 0."""
    chord = np.linalg.norm(a.astype(np.float64) - b, axis=-1)
    return 2.0 * np.arcsin(np.minimum(chord / 2.0, 1.0))


def in_float32(values: NDArray) -> NDArray[np.float32]:
    """The values rounded; what is larger than float32 can hold is the largest that it can."""
    largest = np.finfo(np.float32).max
    return np.clip(values, -largest, largest).astype(np.float32)


def _distance(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) t: how far the hits are from the eye, world units."""
    return np.linalg.norm(seen["Position"].astype(np.float64) - pinhole.eye, axis=-1)


def _grazing_factor(cosine: Array) -> Array:
    return np.maximum(1.0, GRAZING / np.maximum(cosine, FLOAT32))
