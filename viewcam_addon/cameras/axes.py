"""The one place where this project's conventions become those of others, and theirs ours: axes, rows, pixels, world.

**Axes.** This project's camera has u to the right, v upwards and w away from the view. That is OpenGL's and Blender's, and
that of `camera_to_world`. Computer vision's (OpenCV, COLMAP) has x to the right, y downwards and z into the view, which are u,
−v and −w: that of `world_to_camera` and `intrinsics`. A format's own matrix is brought to `camera_to_world`'s form
(`of_opencv`, `from_world_to_camera`), and `pinhole` makes the camera of it.

**Pixels.** Rows count from the top here, from the bottom in `Pinhole`. The upper left corner of the picture is (0, 0) and the
center of its first pixel (0.5, 0.5), so the middle of a picture is (width/2, height/2). OpenCV's own functions put (0, 0) at
the center of that pixel: for them, subtract 0.5 from both numbers of the principal point.

**World.** `moved` turns and scales it, for all formats alike; none does it by itself.

What is written is computed in plain floats, one operation after another, so that the same camera gives the same digits on
every machine. Rejected: `@` of NumPy and Python's `sum`, whose order or precision differs between versions.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole, Triple, ViewPlane
from .camera import Camera, Options

Rows = list[list[float]]
Quaternion = tuple[float, float, float, float]
UNTURNED: Quaternion = (1.0, 0.0, 0.0, 0.0)

# By Options.axes: the turn of a point out of a file, and back into it.
_TURNS: dict[str, tuple[Callable[[Triple], Triple] | None, Callable[[Triple], Triple] | None]] = {
    "as_is": (None, None),
    "y_up": (lambda p: (p[0], -p[2], p[1]), lambda p: (p[0], p[2], -p[1])),
    "y_down": (lambda p: (p[0], p[2], -p[1]), lambda p: (p[0], -p[2], p[1])),
}
_NO_MEAN = 1e-6  # length of a mean of unit vectors, below which it has no direction
# The errors that a rotation in a file may have, whose numbers have few digits: without a note, and as a rotation at all.
_NOTED, _NO_ROTATION, _NO_QUATERNION = 1e-5, 2e-3, 1e-2
_SCALED = 1e-3
_FARTHEST = 2.0**1022  # as far again as the eye from the origin there must be room for the look-at point


def camera_to_world(pinhole: Pinhole) -> Rows:
    """4 × 4, for column vectors, from the camera's axes (u, v, w) to world space: Blender's `matrix_world`.

    Its columns are u, v, w and the eye; u is negated where the pinhole is mirrored.
    """
    u, v, w = _axes(pinhole)
    return [*([*map(_plain, row)] for row in zip(u, v, w, pinhole.eye, strict=True)), [0.0, 0.0, 0.0, 1.0]]


def world_to_camera(pinhole: Pinhole) -> Rows:
    """4 × 4, for column vectors, from world space to the camera's x (right), y (down) and z (into the view).

    Its rows are u, −v and −w (u negated where the pinhole is mirrored), each with its part of the translation −R e, which is
    within 3 · 2⁻⁵³ |e| of exact arithmetic on these axes.

    Raises InputError if the translation is beyond float64.
    """
    u, v, w = _axes(pinhole)
    rotation = [u, tuple(-a for a in v), tuple(-a for a in w)]
    e = pinhole.eye
    moves = [-(row[0] * e[0] + row[1] * e[1] + row[2] * e[2]) for row in rotation]
    translation = checks.vector("the translation from the world's origin to the camera", moves, 3)
    rows = [[*map(_plain, (*row, part))] for row, part in zip(rotation, translation, strict=True)]
    return [*rows, [0.0, 0.0, 0.0, 1.0]]


def intrinsics(pinhole: Pinhole) -> Rows:
    """K, 3 × 3: (column, row, 1) · depth = K (x, y, z), in pixels, rows from the top."""
    (d_x, d_y), (c_x, c_y) = pinhole.distance, pinhole.principal_point
    return [[d_x, 0.0, c_x], [0.0, d_y, pinhole.height - c_y], [0.0, 0.0, 1.0]]


def view_plane(f_x: float, f_y: float, c_x: float, c_top: float, size: tuple[int, int]) -> ViewPlane:
    """The view plane of K's numbers, the principal point from the left and the **top** edge of the picture's corner."""
    width, height = size
    return ViewPlane((f_x, f_y), (c_x, height - c_top), width, height)


def pinhole(matrix: ArrayLike, plane: ViewPlane, what: str, scaled: bool = False) -> tuple[Pinhole, tuple[str, ...]]:
    """The camera of a matrix, and what is to be said of it.

    matrix : 3 × 4 or 4 × 4, for column vectors, from camera to world as `camera_to_world` has it.
    plane : the camera's view plane.
    what : the matrix' owner, as a sentence names it.
    scaled : true if the format lets nodes be scaled without scaling the camera.

    The look-at point, which no matrix says, lies as far before the eye as the eye from the origin, at least 1: so its rounding
    does not turn the view by more than 2⁻⁵².

    Raises InputError if it is no rotation and translation: transposed, sheared, or scaled differently along its axes.
    """
    matrix = checks.array(f"the matrix of {what}", matrix)
    if matrix.shape not in ((3, 4), (4, 4)):
        raise InputError(f"the matrix of {what} is {' × '.join(map(str, matrix.shape))}: give 3 × 4 or 4 × 4 numbers")
    rows = upper_rows(matrix, what)
    eye = checks.vector(f"the eye of {what}", [row[3] for row in rows], 3)
    away = math.hypot(*eye)
    if not away < _FARTHEST:
        raise InputError(f"{what} is {away:g} units from the world's origin, beyond all numbers: give another matrix")
    (x, y, z), notes = rotation([row[:3] for row in rows], what, scaled)
    mirrored = _dot(_cross(x, y), z) < 0
    if mirrored:
        notes = (*notes, f"The axes of {what} are left-handed: the picture is mirrored")
    reach = 2.0 ** math.ceil(math.log2(max(1.0, away)))
    camera = Pinhole(
        eye=eye, look_at=tuple(a - reach * b for a, b in zip(eye, z, strict=True)), up=y, **vars(plane), mirrored=mirrored
    )
    return camera, notes


def upper_rows(matrix: np.ndarray, what: str) -> list[list[float]]:
    """The upper three rows. Raises InputError if there is a fourth and it is not 0 0 0 1."""
    *rows, last = [*matrix.tolist(), [0.0, 0.0, 0.0, 1.0]][:4]
    if not all(abs(a - b) <= _NOTED for a, b in zip(last, (0.0, 0.0, 0.0, 1.0), strict=True)):  # nor if it is none
        hint = "transpose it" if not any(row[3] for row in rows) else "it should be 0 0 0 1"
        hint = hint if all(map(math.isfinite, last)) else "give finite numbers"
        raise InputError(f"the last row of the matrix of {what} is {checks.quoted(last)}: {hint}")
    return rows


def pinholes(matrices: np.ndarray, planes: Sequence[ViewPlane], whats: Sequence[str]) -> list[tuple[Pinhole, tuple[str, ...]]]:
    """The results of `pinhole` for many matrices: for files of thousands of poses, in a tenth of the time.

    matrices : (n, 3, 4), finite.
    planes, whats : the view plane and the owner's name of each.
    """
    turn, eye = matrices[:, :, :3], matrices[:, :, 3]
    with np.errstate(all="ignore"):
        lengths = _lengths(turn.swapaxes(1, 2))
        x, y, z = (turn[:, :, i] / lengths[:, i, None] for i in range(3))
        askew = np.max([np.abs((a * b).sum(axis=-1)) for a, b in ((x, y), (x, z), (y, z))], axis=0)
        fine = (np.abs(lengths - 1).max(axis=-1, initial=0.0) < _SCALED) & (askew <= _NOTED)
        fine &= (np.cross(x, y) * z).sum(axis=-1) > 0
        at = np.flatnonzero(fine & (_lengths(eye) < 1e150))
        reach = 2.0 ** np.ceil(np.log2(np.maximum(1.0, _lengths(eye[at]))))
    cameras = Pinhole.of_poses(eye[at], eye[at] - reach[:, None] * z[at], y[at], [planes[i] for i in at.tolist()])
    placed = dict(zip(at.tolist(), ((each, ()) for each in cameras), strict=True))
    return [placed.get(i) or pinhole(matrices[i], planes[i], whats[i]) for i in range(len(matrices))]


def _lengths(vectors: np.ndarray) -> np.ndarray:
    return np.hypot(np.hypot(vectors[..., 0], vectors[..., 1]), vectors[..., 2])


def rotation(rows: Sequence[Sequence[float]], what: str, scaled: bool = False) -> tuple[tuple[Triple, ...], tuple[str, ...]]:
    """The three columns of a rotation's rows, each of length 1, and notes; they may be left-handed.

    In plain floats, which for nine numbers are ten times as fast as arrays.

    scaled : see `pinhole`.

    Raises InputError if the columns are not perpendicular or of different lengths.
    """
    columns = [checks.vector(f"the rotation of {what}", column, 3) for column in zip(*rows, strict=True)]
    lengths = [math.hypot(*column) for column in columns]
    if not 1e-100 < min(lengths) <= max(lengths) < 1e100:
        raise InputError(f"the rotation of {what} has an axis of length {min(lengths):g}: give axes of length 1")
    if not scaled and min(lengths) < max(lengths) * (1 - _NO_ROTATION):
        stretched = " by ".join(f"{length:.6g}" for length in lengths)
        raise InputError(f"the rotation of {what} has axes of the lengths {stretched}: give axes of one length")
    axes = tuple((x / length, y / length, z / length) for (x, y, z), length in zip(columns, lengths, strict=True))
    askew = max(abs(_dot(axes[i], axes[j])) for i, j in ((0, 1), (0, 2), (1, 2)))
    if askew > _NO_ROTATION:
        degrees = math.degrees(math.asin(min(askew, 1)))
        raise InputError(f"the axes of {what} are {degrees:.3g}° from perpendicular: it is no rotation")
    notes = []
    size = sum(lengths) / 3
    if abs(size - 1) > _SCALED and not scaled:
        notes.append(f"The matrix of {what} is scaled by {size:.6g}, which changes no picture and was left out")
    if askew > _NOTED:
        notes.append(f"The axes of {what} are {askew:.1g} from perpendicular: it has no more digits than that")
    return axes, tuple(notes)


def _dot(a: Triple, b: Triple) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Triple, b: Triple) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def of_opencv(matrix: ArrayLike) -> np.ndarray:
    """Camera to world with columns x right, y down, z into the view (OpenCV's) → with columns u, v, w; and back.

    matrix : (..., 3 or 4, 4).
    """
    matrix = np.array(matrix, dtype=np.float64)
    matrix[..., :3, 1:3] = -matrix[..., :3, 1:3] + 0.0
    return matrix


def from_world_to_camera(turn: ArrayLike, translation: Sequence[float], what: str) -> np.ndarray:
    """R, t of x = R X + t with OpenCV's axes (x right, y down, z into the view) → camera to world, 4 × 4, columns u, v, w, e.

    The eye is −R⁻¹ t: where R has few digits, that is what R and t project from.

    Raises InputError if R is no rotation, or t no three numbers.
    """
    translation = checks.vector(f"the translation of {what}", translation, 3)
    turn = checks.array(f"the rotation of {what}", turn)
    if turn.shape != (3, 3):
        raise InputError(f"the rotation of {what} is {' × '.join(map(str, turn.shape))}: give 3 × 3 numbers")
    rotation(turn.tolist(), what)
    matrix = np.eye(4)
    matrix[:3, :3] = turn.T
    matrix[:3, 3] = -np.linalg.solve(turn, np.array(translation))
    return of_opencv(matrix)


def from_worlds_to_cameras(turns: np.ndarray, translations: np.ndarray, whats: Sequence[str]) -> np.ndarray:
    """(n, 3, 4): `from_world_to_camera` of many, (n, 3, 3) and (n, 3). Whether they are rotations, `pinholes` asks."""
    try:
        eyes = -np.linalg.solve(turns, translations[:, :, None])
    except np.linalg.LinAlgError:
        for turn, what in zip(turns, whats, strict=True):
            rotation(turn.tolist(), what)
        raise
    return of_opencv(np.concatenate([turns.swapaxes(1, 2), eyes], axis=2))


def rotation_of(quaternion: Sequence[float], what: str) -> np.ndarray:
    """(3, 3) of a quaternion (w, x, y, z), Hamilton's, of length 1 but for its few digits.

    Raises InputError if it has another length: then these four numbers are something else, as angles and a field of view.
    """
    numbers = checks.vector(f"the quaternion of {what}", quaternion, 4)
    length = math.hypot(*numbers)
    _check_length(length, what)
    return np.array(_turn(*(number / length for number in numbers)))


def rotations_of(quaternions: np.ndarray, whats: Sequence[str]) -> np.ndarray:
    """(n, 3, 3) of many quaternions (n, 4), finite, as `rotation_of` has them.

    whats : the owner's name of each.
    """
    lengths = np.sqrt((quaternions * quaternions).sum(axis=-1))
    for i in np.flatnonzero(~(np.abs(lengths - 1) <= _NO_QUATERNION)):
        _check_length(lengths[i], whats[i])
    return np.moveaxis(np.array(_turn(*(quaternions / lengths[:, None]).T)), -1, 0)


def _check_length(length: float, what: str) -> None:
    if abs(length - 1) > _NO_QUATERNION:
        raise InputError(f"the quaternion of {what} has the length {length:.6g}: give one of length 1")


def _turn(w: Any, x: Any, y: Any, z: Any) -> tuple:
    """The rows of the rotation of a quaternion of length 1, of floats or of arrays."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def continued(quaternion: Quaternion, before: Quaternion) -> Quaternion:
    """The one of a rotation's two quaternions that is nearer to the one before: else what goes from one to the next spins."""
    opposed = sum(a * b for a, b in zip(quaternion, before, strict=True)) < 0
    a, b, c, d = quaternion
    return (0.0 - a, 0.0 - b, 0.0 - c, 0.0 - d) if opposed else quaternion


def quaternion(rotation: Sequence[Sequence[float]]) -> Quaternion:
    """(w, x, y, z) of the rotation in the upper left 3 × 3 of a matrix, of length 1 to 4 · 2⁻⁵³.

    Of the two quaternions of a rotation it is the one whose first number that is not 0 is positive. Each row below is the
    quaternion times four times one of its own numbers; the row of the largest number, at least ½, cancels nothing.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = (row[:3] for row in rotation)
    multiples = (
        (1 + xx + yy + zz, zy - yz, xz - zx, yx - xy),
        (zy - yz, 1 + xx - yy - zz, yx + xy, xz + zx),
        (xz - zx, yx + xy, 1 - xx + yy - zz, zy + yz),
        (yx - xy, xz + zx, zy + yz, 1 - xx - yy + zz),
    )
    best = max(range(4), key=lambda i: multiples[i][i])
    w, x, y, z = multiples[best]
    size = math.copysign(math.sqrt(w * w + x * x + y * y + z * z), next(part for part in (w, x, y, z) if part))
    return w / size + 0.0, x / size + 0.0, y / size + 0.0, z / size + 0.0


def moved(camera: Camera, options: Options) -> Camera:
    """A camera out of a file, in the world that `options` asks for."""
    return _in_world(camera, _TURNS[options.axes][0], options.scale)


def moved_back(camera: Camera, options: Options) -> Camera:
    """A camera on its way into a file: the inverse of `moved`."""
    back = _in_world(camera, _TURNS[options.axes][1], 1 / options.scale)
    return back if camera.world else dataclasses.replace(back, world=None)  # which only what is read has


def leveled(cameras: Sequence[Camera]) -> list[Camera]:
    """The cameras in a world that is turned by the least angle after which the mean of their up, v, is z; each says so.

    Raises InputError if there is no such mean, as of cameras that stand upright and upside down.
    """
    up = np.mean([camera.pinhole.picture_axes()[1] for camera in cameras], axis=0)
    length = math.hypot(*up)
    if length < _NO_MEAN:
        raise InputError("the cameras' up directions cancel out: none is the world's, leave out --up-from")
    return turned_up(cameras, (up / length).tolist(), "the mean of the cameras' up")


def turned_up(cameras: Sequence[Camera], up: Sequence[float], what: str, rise: float = 0.0) -> list[Camera]:
    """The cameras in a world that is turned by the least angle after which `up` is z, and then moved up; each says so.

    up : a vector of length 1.
    what : `up`, as the note calls it.
    rise : the distance along z by which they move.
    """
    x, y, z = up
    rows = np.diag([1.0, -1.0, -1.0])  # for a world that is upside down
    if z > 0 or (x, y) != (0, 0):  # about up × z, by the angle between them: 1 + K + K² / (1 + cos)
        cross = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
        rows = np.identity(3) + cross + cross @ cross * (1 / (1 + z) if z > 0 else (1 - z) / (x * x + y * y))
    moved_up = f" and moved by {rise:.6g} along z" if rise else ""
    turn = f"{math.degrees(math.atan2(math.hypot(x, y), z)):.4g}°"
    note = f"The world was turned by {turn}{moved_up}: {what} is z"
    return [_in_world(camera, lambda p: tuple((rows @ p).tolist()), 1.0, rise).noted(note) for camera in cameras]


def moved_points(points: np.ndarray, options: Options) -> np.ndarray:
    """(n, 3): points out of a file, in the world that `options` asks for, as `moved` has its cameras."""
    return points @ _matrix(_TURNS[options.axes][0]).T * options.scale


def _matrix(turn: Callable[[Triple], Triple] | None) -> np.ndarray:
    """(3, 3) of a turn."""
    return np.identity(3) if turn is None else np.column_stack([turn(tuple(axis)) for axis in np.identity(3).tolist()]) + 0.0


def _in_world(camera: Camera, turn: Callable[[Triple], Triple] | None, scale: float, rise: float = 0.0) -> Camera:
    if turn is None and scale == 1:
        return camera
    pinhole = camera.pinhole
    e, l, up = ((turn(p) if turn else p) for p in (pinhole.eye, pinhole.look_at, pinhole.up))
    e, l = ((scale * x + 0.0 + 0.0, scale * y + 0.0 + 0.0, scale * z + rise + 0.0) for x, y, z in (e, l))
    world = np.column_stack([_matrix(turn) * scale, [0.0, 0.0, rise]])
    before = np.vstack([np.eye(3, 4) if camera.world is None else camera.world, [0, 0, 0, 1]])
    return dataclasses.replace(
        camera,
        pinhole=dataclasses.replace(pinhole, eye=e, look_at=l, up=(up[0] + 0.0, up[1] + 0.0, up[2] + 0.0)),
        world=tuple(map(tuple, (world @ before + 0.0).tolist())),
    )


def _axes(pinhole: Pinhole) -> list:
    return (pinhole.picture_axes() * [[1], [1], [-1]]).tolist()


def _plain(number: float) -> float:
    """The number, and 0 for −0."""
    return number + 0.0
