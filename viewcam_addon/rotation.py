"""Rotation matrices ↔ Blender's rotation modes, and the channels of a Blender object, in float64. Pure, no Blender.

Blender's own conversions run in float32, and near gimbal lock `Matrix.to_euler` (and so `matrix_world =`) turns rounding into
up to 2.5e-3 of a matrix entry. Here the third angle is read off after the first has been undone, which is well-conditioned in
gimbal lock too and needs no threshold (Herter and Lott, "Algorithms for decomposing 3-D orthogonal matrices into primitive
rotations", Computers & Graphics 17, 1993). What remains is the rounding of three angles to float32, 1.3e-7 of a matrix entry.

Every matrix is (3, 3) float64 and takes column vectors: its columns are the images of the axes.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .pinhole import Pinhole

Array = NDArray[np.float64]

IDENTITY = np.eye(4)
_THREE_HALVES = 1.5 * IDENTITY[:3, :3]
# Radians: in so small a turn the axis, and so close to gimbal lock one of the angles, may be any, within float32's rounding.
_FREE = 2.0**-26


def euler(rotation: Array, order: str) -> Array:
    """(..., 3): the angles about x, y and z in radians, applied in `order` ("XYZ": about x first), of rotation matrices.

    Of the two triples of angles that give the same rotation, the one of the smaller sum, which float32 also stores better.
    """
    triple, other = _triples(rotation, order)
    # The angles of the two differ from a half turn by one another's, so that their sums make 3π.
    return np.where(np.abs(triple).sum(-1, keepdims=True) <= 1.5 * math.pi, triple, other)


def _triples(m: Array, order: str, before: Sequence[float] | None = None) -> tuple[Array, Array]:
    """Both triples of angles in [−π, π] that give rotations, (..., 3) each.

    before : the angles before, for a single matrix; in gimbal lock the triples begin with the first of them.
    """
    i, j, k, sign = _axes(order)
    from_lock = np.hypot(m[..., i, i], m[..., j, i])
    is_locked = before is not None and from_lock <= _FREE
    first: Any = np.float64(sign * before[i]) if before is not None and is_locked else np.arctan2(m[..., k, j], m[..., k, k])
    second = np.arctan2(-m[..., k, i], from_lock)
    sine, cosine = np.sin(first), np.cos(first)
    third = np.arctan2(sine * m[..., i, k] - cosine * m[..., i, j], cosine * m[..., j, j] - sine * m[..., j, k])
    angles = np.empty((*np.shape(first), 3))
    angles[..., i], angles[..., j], angles[..., k] = sign * first, sign * second, sign * third
    other = angles.copy()
    other[..., j] = -angles[..., j]
    return angles, other - np.copysign(math.pi, other)


def from_euler(angles: Sequence[float], order: str) -> Array:
    """The rotation matrix of the angles about x, y and z, applied in `order`."""
    rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    for axis in order:
        i = "XYZ".index(axis)
        j, k = (i + 1) % 3, (i + 2) % 3
        sine, cosine = math.sin(angles[i]), math.cos(angles[i])
        pairs = list(zip(rows[j], rows[k], strict=True))
        rows[j], rows[k] = [cosine * a - sine * b for a, b in pairs], [sine * a + cosine * b for a, b in pairs]
    return np.array(rows)


def _axes(order: str) -> tuple[int, int, int, int]:
    """The axes in the order of their application, and −1 where they are a left-handed sequence (angles change their sign)."""
    i, j, k = ("XYZ".index(axis) for axis in order)
    return i, j, k, 1 if (j - i) % 3 == 1 else -1


def quaternion(rotation: Array) -> Array:
    """(..., 4): w, x, y, z with w ≥ 0 from the largest component, so that nothing cancels (Shepperd 1978)."""
    m = rotation
    trace = m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2]
    products = np.empty((*np.shape(trace), 4, 4))  # 4 q qᵀ
    products[..., 0, 0] = 1 + trace
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1)), 1):
        products[..., 0, i] = products[..., i, 0] = m[..., k, j] - m[..., j, k]
        products[..., i, i] = 1 - trace + 2 * m[..., i - 1, i - 1]
        products[..., j + 1, k + 1] = products[..., k + 1, j + 1] = m[..., j, k] + m[..., k, j]
    largest = np.diagonal(products, axis1=-2, axis2=-1).argmax(-1)
    numbers = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    length = np.sqrt((numbers * numbers).sum(-1, keepdims=True))
    return numbers / np.copysign(length, numbers[..., :1])


def from_quaternion(numbers: Sequence[float]) -> Array:
    """The rotation matrix of (w, x, y, z) of any length; of zero, as float32 measures it, Blender's half turn about x."""
    four = np.array(numbers, dtype=np.float64)
    if four @ four <= 2.0**-150:
        four = np.array([0.0, 1.0, 0.0, 0.0])
    w, x, y, z = four / np.linalg.norm(four)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def axis_angle(rotation: Array) -> Array:
    """(..., 4): radians in [0, π] and the unit axis, Blender's (0, 1, 0) where the angle is 0, of rotation matrices."""
    numbers = quaternion(rotation)
    sine = np.sqrt((numbers[..., 1:] * numbers[..., 1:]).sum(-1, keepdims=True))
    is_turned = sine > 0
    axis = np.where(is_turned, numbers[..., 1:] / np.where(is_turned, sine, 1.0), (0.0, 1.0, 0.0))
    return np.concatenate([2 * np.arctan2(sine, numbers[..., :1]), axis], axis=-1)


def numbers(rotation: Array, mode: str, before: Sequence[float] | None = None) -> Array:
    """(..., n): the numbers of rotations in one of Blender's modes, an order of Euler angles, "QUATERNION" or "AXIS_ANGLE".

    before : the numbers of another rotation, for a single matrix. Those nearest to them are given then, so that what is
        interpolated between the two neither flips nor takes the long way round: the other triple of Euler angles, the
        quaternion of the other sign, the opposite axis, and whole turns more or less.
    """
    if mode == "QUATERNION":
        turn = quaternion(rotation)
        return turn if before is None or np.dot(turn, before) >= 0 else -turn
    if mode == "AXIS_ANGLE":
        turn = axis_angle(rotation)
        return turn if before is None else np.array(_continued_axis_angle(*turn.tolist(), before=before))
    if before is None:
        return euler(rotation, mode)
    triples = [[*map(_wound, triple.tolist(), before)] for triple in _triples(rotation, mode, before)]
    return np.array(min(triples, key=lambda triple: math.dist(triple, before)))


def _continued_axis_angle(angle: float, *turned_about: float, before: Sequence[float]) -> tuple[float, ...]:
    axis: Sequence[float] = turned_about
    if angle <= _FREE:
        axis = before[1:]
    elif np.dot(axis, before[1:]) < 0:
        angle, axis = -angle, [-component for component in axis]
    return _wound(angle, before[0]), *axis


def _wound(angle: float, near: float) -> float:
    """The angle with as many whole turns more or less as bring it nearest to another."""
    return angle + 2 * math.pi * round((near - angle) / (2 * math.pi))


def neighbors(rounded: NDArray[np.float32]) -> Iterator[tuple[float, ...]]:
    """The 3ⁿ − 1 tuples that differ from n numbers of float32 by one of its steps in some of them."""
    choices = np.column_stack([rounded, *(np.nextafter(rounded, np.float32(limit)) for limit in (-np.inf, np.inf))])
    return itertools.islice(itertools.product(*choices.tolist()), 1, None)


def nearest(matrix: Array) -> Array:
    """The orthonormal matrices nearest to (..., 3, 3) ones (the polar decomposition's), mirroring where those mirror."""
    left, _, right = np.linalg.svd(matrix)
    return left @ right


def straightened(axes: Array) -> Array:
    """`nearest` of axes of length one whose skew is small, in a fifth of the time: (..., 3, 3).

    Two steps of Newton's method for the polar decomposition. Each leaves 3/2 of the square of what is off: of 2⁻¹⁷, 2⁻⁶⁶.
    """
    for _ in range(2):
        axes = axes @ (_THREE_HALVES - 0.5 * (axes.swapaxes(-2, -1) @ axes))
    return axes


def skew(matrix: Array) -> Array:
    """The largest |cosine| between two columns of (..., 3, 3) matrices: 0 if they are perpendicular. Returns (...)."""
    return _largest_cosine(matrix / np.linalg.norm(matrix, axis=-2, keepdims=True))


def _largest_cosine(axes: Array) -> Array:
    """`skew` of axes of length one."""
    return np.abs((axes.swapaxes(-2, -1) @ axes)[..., [0, 0, 1], [1, 2, 2]]).max(axis=-1)


def axes_of(matrices: Array) -> tuple[Array, Array, Array]:
    """The axes of (..., 4, 4) matrices, of length one; their volume; and their skew: (..., 3, 3), (...) and (...).

    The volume is −1 where they mirror, about 0 where they are flat, and nan where one has no length or is not finite.
    """
    with np.errstate(all="ignore"):
        axes = matrices[..., :3, :3] / np.linalg.norm(matrices[..., :3, :3], axis=-2, keepdims=True)
        volumes = np.where(np.isfinite(matrices).all(axis=(-2, -1)), np.linalg.det(axes), np.nan)
        return axes, volumes, _largest_cosine(axes)


def largest_error(matrices: Array, axes: Array) -> Array:
    """The largest difference between the axes of (..., 4, 4) matrices, of whatever length, and those wanted.

    axes : (..., 3, 3), as columns. Returns (...).
    """
    columns = matrices[..., :3, :3]
    sizes = np.sqrt(np.einsum("...ij,...ij->...j", columns, columns))
    sizes[sizes == 0] = 1.0
    return np.abs(columns / sizes[..., None, :] - axes).max(axis=(-2, -1))


def float64(numbers: Iterable) -> Array:
    """The numbers of a Blender matrix or vector. From 5.0 on NumPy takes these for float32, and would compute in it."""
    return np.array(numbers, dtype=np.float64)


def mirrors(matrix: Iterable) -> bool:
    """True if a (4, 4) matrix of float32 numbers mirrors; one that is not finite does nothing."""
    (a, b, c, _), (d, e, f, _), (g, h, i, _), _ = matrix
    return -math.inf < a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) < 0


def has_inverse(matrix: Array) -> bool:
    """True if a matrix is finite and not singular."""
    return bool(np.isfinite(matrix).all() and np.linalg.det(matrix) != 0)


class Channels(NamedTuple):
    """All that says where a Blender object stands relative to what carries it, as it is stored.

    mode : an order of Euler angles, "QUATERNION" or "AXIS_ANGLE".
    rotation : its numbers in this mode, and delta_rotation those that Blender applies after it; () for AXIS_ANGLE, for which it
        shows none.
    """

    mode: str
    location: tuple[float, float, float]
    rotation: tuple[float, ...]
    scale: tuple[float, float, float]
    delta_location: tuple[float, float, float]
    delta_rotation: tuple[float, ...]
    delta_scale: tuple[float, float, float]

    @property
    def is_plain(self) -> bool:
        """True without deltas and without a negative scale: then location and rotation are where an object stands."""
        deltas = self.delta_rotation[1:] if self.mode == "QUATERNION" else self.delta_rotation
        return self.delta_scale == (1, 1, 1) and min(self.scale) > 0 and not any(self.delta_location) and not any(deltas)

    @property
    def full_scale(self) -> Array:
        """(3,): the scale, delta included."""
        return float64([a * b for a, b in zip(self.scale, self.delta_scale, strict=True)])

    @property
    def signs(self) -> Array:
        """(3,): −1 for each axis that the scale turns round."""
        return float64([-1.0 if size < 0 else 1.0 for size in self.full_scale])

    @property
    def delta(self) -> Array:
        """(3, 3): the rotation that Blender applies after the object's own."""
        numbers = self.delta_rotation
        if not any(numbers) and self.mode != "QUATERNION":  # none, or no turn
            return IDENTITY[:3, :3]
        return from_quaternion(numbers) if self.mode == "QUATERNION" else from_euler(numbers, self.mode)

    def bringing_to(self, pinhole: Pinhole, parent: Array) -> tuple[tuple[float, ...], Array, tuple[float, ...]]:
        """Location, (3, 3) rotation and scale that bring a camera to the pose of a pinhole.

        parent : (4, 4), invertible, from the camera's own channels to world space.
        """
        is_free = parent is IDENTITY or np.array_equal(parent, IDENTITY)  # as most cameras are: no linear algebra
        wanted = pinhole.picture_axes().T * (1, 1, -1)
        scale, signs = float64(self.scale), self.signs
        local = wanted if is_free else np.linalg.solve(parent[:3, :3], wanted)
        if (pinhole.mirrored if is_free else np.linalg.det(local) < 0) != (signs.prod() < 0):
            scale[0], signs[0] = -scale[0], -signs[0]
        turn = local * signs if is_free else nearest(local / np.linalg.norm(local, axis=0) * signs)
        eye = np.array(pinhole.eye)
        location = eye if is_free else np.linalg.solve(parent[:3, :3], eye - parent[:3, 3])
        location = location - float64(self.delta_location)
        return tuple(location.tolist()), self.delta.T @ turn, tuple(scale.tolist())
