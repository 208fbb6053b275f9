"""A pinhole as matrices, in the conventions that datasets have.

**Axes.** This project's camera has u to the right, v upwards and w away from the view. That is OpenGL's and Blender's, and
that of `camera_to_world`. Computer vision's (OpenCV, COLMAP) has x to the right, y downwards and z into the view, which are u,
−v and −w: that of `world_to_camera` and `intrinsics`.

**Pixels.** Rows count from the top here, from the bottom in `Pinhole`. The upper left corner of the picture is (0, 0) and the
centre of its first pixel (0.5, 0.5), so the middle of a picture is (width/2, height/2). OpenCV's own functions put (0, 0) at
the centre of that pixel: for them, subtract 0.5 from both numbers of the principal point.

All is done in plain floats, one operation after another, so that the same camera gives the same digits on every machine.
Rejected: `@` of NumPy and Python's `sum`, whose order or precision differs between versions.
"""

from .. import checks
from ..pinhole import Pinhole

Rows = list[list[float]]


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

    Raises
    ------
    InputError
        if the translation is beyond float64.
    """
    u, v, w = _axes(pinhole)
    rotation = [u, tuple(-a for a in v), tuple(-a for a in w)]
    e = pinhole.eye
    translation = [-(row[0] * e[0] + row[1] * e[1] + row[2] * e[2]) for row in rotation]
    translation = checks.vector("the translation from the world's origin to the camera", translation, 3)
    rows = [[*map(_plain, (*row, part))] for row, part in zip(rotation, translation, strict=True)]
    return [*rows, [0.0, 0.0, 0.0, 1.0]]


def intrinsics(pinhole: Pinhole) -> Rows:
    """K, 3 × 3: (column, row, 1) · depth = K (x, y, z), in pixels, rows from the top."""
    (d_x, d_y), (c_x, c_y) = pinhole.distance, pinhole.principal_point
    return [[d_x, 0.0, c_x], [0.0, d_y, pinhole.height - c_y], [0.0, 0.0, 1.0]]


def _axes(pinhole: Pinhole) -> tuple:
    u, v, w = pinhole.axes()
    return (tuple(-a for a in u) if pinhole.mirrored else u), v, w


def _plain(number: float) -> float:
    """The number, and 0 for −0."""
    return number + 0.0
