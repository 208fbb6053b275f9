"""The moves of a camera: dolly, orbit, frame, swap. Each takes a Pinhole and gives the moved one, in float64.

**Orbiting past the pole.** The axes (u, v, w) are turned as one rigid body: first the eye rises by an angle about u, then it
goes around up. Nothing flips, and what cannot be seen from the four values, that the camera has come over the top, is said by
them: up turns into its opposite, and the camera hangs upside down, as in a loop. Only where rounding lets neither up nor its
opposite give the picture for certain, which is at the pole itself, up becomes v. Rejected: to stop at the pole (the angles
asked for would be clamped silently), and to let up decide there (the picture would turn by half a turn between two angles).

**Framing.** A point (x, y, z) in the eye's axes, z > 0 being its depth, lies within a margin line `room` pixels beside the
principal point if d · x ≤ room · z. That is linear in d and, as the eye moves along the view, in z: the largest d and the
smallest distance are a minimum and a maximum over points and margin lines. No iteration, no bounding box, and the principal
point may lie anywhere. Rejected: a bounding sphere (right for spheres alone) and bounding boxes (a diagonal stick fills half
of its box).
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks, exact
from .errors import InputError
from .pinhole import Pinhole, Triple

Array = NDArray[np.float64]

# A turn by less is lost in the float32 matrix in which a camera is stored.
_UNSEEN = 2.0**-24
_ROUNDING = 2.0**-53
_LARGEST_MARGIN = 0.49


def swapped(pinhole: Pinhole) -> Pinhole:
    """The view from the look-at point back to the eye, with the same up."""
    return replace(pinhole, eye=pinhole.look_at, look_at=pinhole.eye)


def dollied(pinhole: Pinhole, reach: float) -> Pinhole:
    """The eye at the distance `reach` > 0 from the look-at point, world units, on the line on which it stands.

    The view direction is kept but for the rounding of the new eye, 2⁻⁵³ of its largest coordinate, seen from `reach`.

    Raises InputError if `reach` is no such number, or so small that the eye's rounding swallows it.
    """
    reach = checks.number("distance to the look-at point", reach)
    if reach <= 0:
        raise InputError(f"distance to the look-at point is {reach:g}: give one above 0, the view needs a direction")
    axes = pinhole.basis()
    return _with_axes(pinhole, _along(pinhole.look_at, axes[2], reach), pinhole.look_at, axes)


def trucked_to(pinhole: Pinhole, look_at: Triple) -> Pinhole:
    """Eye and look-at moved alike, so that the camera looks at another point, world space, from the same side."""
    return replace(
        pinhole, eye=tuple((np.array(pinhole.eye) + np.subtract(look_at, pinhole.look_at)).tolist()), look_at=look_at
    )


def orbited(pinhole: Pinhole, around: float, upwards: float) -> Pinhole:
    """The eye carried about the look-at point, which stays in the middle of the view at the same distance.

    around : radians about up; positive moves the eye towards u.
    upwards : radians about u; positive moves it towards v.

    Both at 0 give the very same pinhole. The way back is (−around, −upwards), and (around, −upwards) once up has turned into
    its opposite, since `around` is counted about up as it stands.

    Raises InputError if an angle is not finite.
    """
    around, upwards = checks.number("orbit's angle around", around), checks.number("orbit's angle upwards", upwards)
    if around == upwards == 0:
        return pinhole
    u, v, w = pinhole.basis()
    cosine, sine = math.cos(upwards), math.sin(upwards)
    axes = _turned_about(pinhole.up, around, np.array([u, cosine * v - sine * w, cosine * w + sine * v]))
    reach = math.dist(pinhole.eye, pinhole.look_at)
    return _with_axes(pinhole, _along(pinhole.look_at, axes[2], reach), pinhole.look_at, [*axes])


def framed_by_eye(pinhole: Pinhole, points: ArrayLike, margin: float = 0.0) -> Pinhole:
    """The eye moved along its view to where it is as near as all points in the picture allow; d stays.

    points : (n, 3), n ≥ 1, world space.
    margin : the share of the picture's width and height kept free at each edge, 0 to 0.49.

    The look-at point stays as long as it lies before the eye, else it moves along the view to the middle of the points' depths.

    Raises InputError if there is no such place (the nearest of the points on the view axis, or a principal point outside the
    margins), if the points are no finite numbers, or the margin no such share.
    """
    across, depth = _seen_from_eye(pinhole, points)
    nearest, farthest = np.zeros(len(depth)), np.full(len(depth), np.inf)  # depths that are allowed for each point
    for room, distance, offset in _sides(pinhole, margin, across):
        if room > 0:
            nearest = np.maximum(nearest, distance * offset / room)
        elif (offset > 0).any() or (room < 0 and (offset >= 0).any()):
            raise _off_center()
        elif room < 0:
            farthest = np.minimum(farthest, distance * offset / room)
    back = (nearest - depth).max()
    if back > (farthest - depth).min():
        raise _off_center()
    depth = depth + back
    if depth.min() <= 0:
        raise InputError("the nearest of the points lies on the view axis, and no distance is the smallest: frame by d instead")
    axes = pinhole.basis()
    eye, look_at = _along(pinhole.eye, axes[2], back), pinhole.look_at
    # Nearer to the eye, its rounding of 2⁻⁵³ would turn the view visibly.
    least = _UNSEEN * max(map(abs, (*eye, *look_at)))
    if math.dist(pinhole.eye, look_at) + back <= least:
        look_at = _along(eye, axes[2], -(depth.min() + depth.max()) / 2)
    return _with_axes(pinhole, eye, look_at, axes)


def framed_by_distance(pinhole: Pinhole, points: ArrayLike, margin: float = 0.0) -> Pinhole:
    """The largest view-plane distance d with which all points are in the picture; the eye stays. Parameters as `framed_by_eye`.

    Raises InputError if there is none (points that do not lie before the eye, nothing but points on the view axis, or a
    principal point outside the margins), if the points are no finite numbers, or the margin no such share.
    """
    across, depth = _seen_from_eye(pinhole, points)
    if depth.min() <= 0:
        raise InputError("not all of the points lie before the eye: frame by the eye's distance, or look at them first")
    least, largest = 0.0, math.inf  # factors on d that are allowed
    for room, distance, offset in _sides(pinhole, margin, across):
        slope = distance * offset / depth
        if room >= 0 and (slope <= 0).all():
            continue
        if room > 0:
            largest = min(largest, room / slope.max())
        elif room == 0 or (slope >= 0).any():
            raise _off_center()
        else:
            least = max(least, room / slope.max())
    if largest == math.inf:
        raise InputError("all of the points lie on the view axis, and any d frames them: give a point beside it too")
    if least > largest:
        raise _off_center()
    d_x, d_y = pinhole.distance
    return replace(pinhole, distance=(largest * d_x, largest * d_y))


def _seen_from_eye(pinhole: Pinhole, points: ArrayLike) -> tuple[tuple[Array, Array], Array]:
    """((n,) to the right in the picture, (n,) upwards in it), (n,) depth: world units from the eye."""
    points = checks.array("points", points)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"points have the shape {points.shape}: give three coordinates for each")
    if not len(points):
        raise InputError("there are no points: give at least one")
    checks.finite("points", points)
    right, up, ahead = pinhole.picture_axes()
    relative = points - np.array(pinhole.eye)
    return (relative @ right, relative @ up), relative @ ahead


def _sides(pinhole: Pinhole, margin: float, across: tuple[Array, Array]) -> list[tuple[float, float, Array]]:
    """(pixels from the principal point to the margin line, d, how far the points lie that way) for each of the four lines."""
    margin = checks.number("margin", margin, 0, _LARGEST_MARGIN)
    sides = []
    for axis, size in enumerate((pinhole.width, pinhole.height)):
        center, distance = pinhole.principal_point[axis], pinhole.distance[axis]
        sides += [((1 - margin) * size - center, distance, across[axis]), (center - margin * size, distance, -across[axis])]
    return sides


def _off_center() -> InputError:
    return InputError("the view axis meets the picture outside the margins, and the points cannot be framed: take shift off")


def _along(start: Triple, axis: Array, length: float) -> Triple:
    return tuple((np.array(start) + length * axis).tolist())


def _turned_about(up: Triple, angle: float, axes: Array) -> Array:
    """(3, 3): the axes, one in each row, turned by an angle about up."""
    (unit,) = exact.scaled_to_one(up)
    axis = np.array(unit) / math.hypot(*unit)
    along = np.outer(axes @ axis, axis)
    return along + math.cos(angle) * (axes - along) + math.sin(angle) * np.cross(axis, axes)


def _with_axes(pinhole: Pinhole, eye: Triple, look_at: Triple, axes: Sequence[Array]) -> Pinhole:
    """The pinhole at another place, with the up that gives these axes (u, v, w) for certain: its own, the opposite, else v."""
    x, y, z = pinhole.up
    for up in (pinhole.up, (0.0 - x, 0.0 - y, 0.0 - z)):
        moved = replace(pinhole, eye=eye, look_at=look_at, up=up)
        is_as_certain = moved.roll_uncertainty(_ROUNDING) <= max(pinhole.roll_uncertainty(_ROUNDING), _UNSEEN)
        if is_as_certain and np.abs(np.subtract(moved.basis(), axes)).max() <= _UNSEEN:
            return moved
    return replace(pinhole, eye=eye, look_at=look_at, up=tuple(axes[1].tolist()))
