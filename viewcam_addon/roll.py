"""The roll of the picture, and how it is carried along through the pole instead of flipping there.

The roll is the angle about w, from u towards v, by which the picture's axes are turned from those of the rule (pinhole.basis):

    u' = cos α u + sin α v     v' = cos α v − sin α u

The rule itself flips: the picture turns by half a turn within a frame as the view passes through up, and by nearly as much
within a few as it passes close by, in exact arithmetic too. *Holding* carries the picture's axes along by parallel transport,
the smallest rotation that takes one view direction to the next and the only one that does not turn about the view. Only steps
that pass near up or its opposite are carried; in all others α stays, and with it the tilt of the horizon. What such a passage
has turned the picture by is kept: who flies over the top hangs upside down, as in a loop.

Rejected: carrying always (a walk around a hill would tilt the horizon by the solid angle it encloses; `within` = 90° asks for
just that), returning to α = 0 after the passage (that is the flip, only slower), and blending towards another up near the pole
(the picture before the passage would depend on what comes after it).
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError
from .pinhole import Pinhole, Triple, basis

Array = NDArray[np.float64]


def turned(pinhole: Pinhole, angle: float) -> Pinhole:
    """A pinhole with its picture turned by `angle` radians, from u towards v; at 0 with the very same up.

    Raises InputError if the angle is not finite.
    """
    if not math.isfinite(angle):
        raise InputError(f"roll is {angle}: give a finite angle")
    if angle == 0:
        return pinhole
    u, v, _ = pinhole.basis()
    return replace(pinhole, up=tuple((math.cos(angle) * v - math.sin(angle) * u).tolist()))


def angle_from(up: Triple, pinhole: Pinhole) -> float:
    """The roll of a pinhole against another up: radians, in [−π, π], by which its picture is turned from what that up gives.

    up : three floats, world space, of any length but zero. Where the view is parallel to it, its canonical axes count.

    Raises InputError if that up is 0 or no finite vector.
    """
    u, _, _ = pinhole.axes()
    level_u, level_v, _ = replace(pinhole, up=up).axes()
    sine, cosine = (sum(a * b for a, b in zip(u, axis, strict=True)) for axis in (level_v, level_u))
    return math.atan2(sine, cosine)


def rolled(pinhole: Pinhole, up: Triple, angle: float) -> Pinhole:
    """A pinhole with its picture turned by `angle` radians from what another up gives: the way back from `angle_from`.

    At 0 its up is that very one, unless the view is parallel to it: then v, which gives the same picture for certain.

    Raises InputError if that up is 0 or no finite vector, or if the angle is not finite.
    """
    level = replace(pinhole, up=up)
    return turned(replace(level, up=level.axes()[1]) if level.is_singular else level, angle)


def steps(eye: ArrayLike, look_at: ArrayLike, up: ArrayLike, within: float) -> tuple[Array, NDArray[np.bool_]]:
    """The change of the roll by carrying the axes along, from each of n poses to the next.

    eye, look_at, up : (n, 3) float64, world space.
    within : radians, how near to up or its opposite a step counts as near.

    Returns (n − 1,) float64 in [−π, π], by which α changes if the step is carried, and (n − 1,) bool, whether it passes near:
    not only its ends, but the whole arc of view directions between them, as up sees it. A step to the opposite direction has no
    smallest rotation and is half a turn about u.

    Raises InputError as pinhole.basis does.
    """
    u, v, w = basis(eye, look_at, up)
    pole = _normalized(np.broadcast_to(np.asarray(up, dtype=np.float64), w.shape))
    carried = _rotated(u[:-1], w[:-1], w[1:])
    turns = np.arctan2(_dot(carried, v[1:]), _dot(carried, u[1:]))
    # Up may move as well: then the view's own start is where it would stand had it moved along with up.
    start = _rotated(w[:-1], pole[:-1], pole[1:])
    return turns, _passes_near(start, w[1:], pole[1:], within)


def carried(eye: ArrayLike, look_at: ArrayLike, up: ArrayLike, within: float) -> Array:
    """The roll α of each of n poses whose first is level; parameters and errors as in `steps`. Returns (n,) float64."""
    turns, near = steps(eye, look_at, up, within)
    return np.concatenate([[0.0], np.cumsum(np.where(near, turns, 0.0))])


def _rotated(vectors: Array, start: Array, end: Array) -> Array:
    """`vectors` under the smallest rotation that takes the unit vector `start` to `end`, all (n, 3).

    Where these are opposite it is half a turn about what the vector has in the plane perpendicular to them.
    """
    total = start + end
    squared = _dot(total, total)
    across = 2 * _dot(total, vectors) / np.where(squared == 0, 1.0, squared)
    return vectors - across[:, None] * total + 2 * _dot(start, vectors)[:, None] * end


def _passes_near(start: Array, end: Array, pole: Array, within: float) -> NDArray[np.bool_]:
    """True where the arcs from `start` to `end` come within an angle of ±`pole`; unit vectors, (n, 3) each."""
    cosine, at_start, at_end = _dot(start, end), _dot(start, pole), _dot(end, pole)
    # The great circle's nearest point to the pole is a sum of both ends. It lies on the arc if their shares have one sign, and
    # being such a sum, rounding can't put it elsewhere, however short the arc is.
    share_of_start, share_of_end = at_start - cosine * at_end, at_end - cosine * at_start
    on_arc = share_of_start * share_of_end > 0
    nearest = share_of_start[:, None] * start + share_of_end[:, None] * end
    nearest = np.where(on_arc[:, None], nearest, start)
    angles = [np.arctan2(np.linalg.norm(np.cross(pole, at), axis=-1), np.abs(_dot(pole, at))) for at in (start, end, nearest)]
    half_turn = (start + end == 0).all(-1)  # about u: through the pole itself
    return (np.minimum.reduce(angles) <= within) | half_turn


def _normalized(vectors: Array) -> Array:
    scaled = vectors / np.abs(vectors).max(axis=-1, keepdims=True)
    return scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("...i,...i->...", a, b)
