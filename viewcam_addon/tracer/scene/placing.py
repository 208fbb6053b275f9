"""The place of something in a scene file: a matrix, or what a hand writes instead of one."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .fields import Field

KEYS = ("matrix", "location", "rotation", "scale")


def matrix(field: Field, keys: dict[str, Field]) -> NDArray[np.float64]:
    """(4, 4), to world space: that of `keys`, or of a location, a rotation (degrees about x, then y, then z) and a scale (one
    number, or one for each axis). field : what is placed."""
    if "matrix" not in keys:
        return _placed(keys)
    if any(key in keys for key in KEYS[1:]):
        field.fail("has a matrix beside a location, rotation or scale: give one or the other")
    return keys["matrix"].array(None, np.float64, (4, 4))


def rotated(angles: Sequence[float] | NDArray) -> NDArray[np.float64]:
    """(3, 3): a rotation by angles in radians about x, then y, then z."""
    x, y, z = angles
    about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _placed(keys: dict[str, Field]) -> NDArray[np.float64]:
    rotation = rotated(np.radians(keys["rotation"].vector(3) if "rotation" in keys else (0.0, 0.0, 0.0)))
    scale: float | tuple[float, ...] = 1.0
    if "scale" in keys:
        scale = keys["scale"].vector(3) if isinstance(keys["scale"].value, list) else keys["scale"].number()
    placed = np.eye(4)
    placed[:3, :3] = rotation * scale
    placed[:3, 3] = keys["location"].vector(3) if "location" in keys else 0.0
    return placed
