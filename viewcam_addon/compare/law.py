"""What two exact pictures may differ by: tolerances in closed form, for every pixel of every pass.

Cycles computes in float32, with a relative rounding of 2⁻²⁴. A coordinate that is rounded at its largest magnitude M moves by
2⁻²⁴ · M, and is seen at the planar depth z through a view plane at the distance d; so the picture moves by

    s = 2⁻²⁴ · d · M / z    pixels,

and k · s is allowed, where k counts the roundings. A renderer's errors are a distribution: k is given for five percentiles.
Everything else follows from s by the chain rule: a picture that moves by s pixels shows a depth, a normal or a texture
coordinate that is off by s times its slope in the picture.

Rejected: a fixed number of pixels (right for one scene, wrong for one that is small, far from the origin, wide or telephoto),
and a number for each sample scene (it would be chosen, not derived).

"Seen" below means a dict from pass name to (n, channels) arrays: the same pixels, or re-traced rays, in every pass.
"""

import numpy as np
from numpy.typing import NDArray

from ..image import BACKGROUND_DEPTH
from ..pinhole import Pinhole

Array = NDArray[np.float64]
Seen = dict[str, NDArray]

PERCENTILES = (50.0, 90.0, 99.0, 99.9, 100.0)

# How many roundings of 2⁻²⁴ · M a position is off at each of PERCENTILES. Measured on 50 random cameras, 10.5 million hits
# with a cosine above 0.1, Cycles of Blender 4.2 to 5.2, against a float64 tracer.
ROUNDINGS = (2.2, 4.6, 7.6, 11.0, 43.0)

FLOAT32 = 2.0**-24

# Below this cosine between ray and surface the error grows with its inverse, since the barycentric coordinates are divided by
# it.
GRAZING = 0.1

# Blender 5.2 stores smooth normals as two 16-bit octahedral coordinates. Half a step of both is at most 2.11 / 32767 on the
# sphere (found by encoding and decoding 2 million directions; 0.0037°).
NORMAL_STORAGE = 2.11 / 32767


def is_hit(seen: Seen) -> NDArray[np.bool_]:
    """(n,) bool: where a ray met something."""
    return seen["Depth"][..., 0] < BACKGROUND_DEPTH


def magnitude(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) M: the largest coordinate that a hit was computed from, world units.

    From the Magnitude pass; an image without one gives max(|P|, |e|), which is too small where a huge triangle was hit.
    """
    if "Magnitude" in seen:
        return seen["Magnitude"][..., 0].astype(np.float64)
    position = seen["Position"].astype(np.float64)
    return np.maximum(np.linalg.norm(position, axis=-1), np.linalg.norm(pinhole.eye))


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
    return FLOAT32 * max(pinhole.distance) * magnitude(pinhole, seen) / depth


def position_shift(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) pixels: by how much one rounding moves a position in the picture; as `ray_shift`, and more on a grazed surface."""
    return ray_shift(pinhole, seen) * _grazing_factor(facing(pinhole, seen))


def depth_error(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) relative error of the planar depth that one rounding causes.

    Along the view 2⁻²⁴ · M / z; and since the position lies on the surface but not exactly on the ray, its shift in the
    picture times the slope of ln z: for a plane whose normal makes the angle θ with the ray, tan θ / ρ for each pixel, where
    ρ ≥ d is the length of the ray as far as the view plane.
    """
    cosine = np.maximum(facing(pinhole, seen), FLOAT32)
    tangent = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / cosine
    return ray_shift(pinhole, seen) / max(pinhole.distance) * (1.0 + _grazing_factor(cosine) * tangent)


def normal_error(pinhole: Pinhole, seen: Seen, slope: Array) -> Array:
    """(n,) radians that one rounding turns a normal by.

    The shift of the picture times the slope of the normal (`slope`, radians a pixel); and for a flat triangle the rounding of
    its vertices over its extent, which is the same shift over its extent in pixels. The latter is taken as one pixel: no
    picture shows the extent of smaller ones.
    """
    return position_shift(pinhole, seen) * (slope + 1.0)


def uv_error(pinhole: Pinhole, seen: Seen, slope: Array) -> Array:
    """(n,) error of a texture coordinate that one rounding causes: its own, and the picture's shift times the slope."""
    return FLOAT32 * np.abs(seen["UV"][..., :2]).max(axis=-1) + position_shift(pinhole, seen) * slope


def slopes(values: NDArray, belongs: NDArray) -> Array:
    """How much a pass changes from pixel to pixel: the largest distance to the four neighbours that show the same object.

    values : (height, width, channels). belongs : (height, width), the object of each pixel, negative for none.

    Returns (height, width) float64, in the pass's unit a pixel.
    """
    values = values.astype(np.float64)
    slope = np.zeros(values.shape[:2])
    for axis in (0, 1):
        here, there = (slice(None, -1), slice(1, None))
        if axis == 1:
            here, there = (slice(None), here), (slice(None), there)
        step = np.linalg.norm(values[there] - values[here], axis=-1)
        step[(belongs[there] != belongs[here]) | (belongs[here] < 0) | ~np.isfinite(step)] = 0.0
        slope[here] = np.maximum(slope[here], step)
        slope[there] = np.maximum(slope[there], step)
    return slope


def angle_between(a: NDArray, b: NDArray) -> Array:
    """(n,) radians between unit vectors (n, 3), by their chord: exact for small angles, not fooled by a vector of length 0."""
    chord = np.linalg.norm(a.astype(np.float64) - b, axis=-1)
    return 2.0 * np.arcsin(np.minimum(chord / 2.0, 1.0))


def _grazing_factor(cosine: Array) -> Array:
    return np.maximum(1.0, GRAZING / np.maximum(cosine, FLOAT32))
