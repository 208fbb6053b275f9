"""Equality of two scenes: what was made for one of them can then serve the other.

Nothing in a scene is ever changed in place, so that what is one object is the same without a look inside. Everything else is
compared to the last bit. Rejected: fingerprints, which read all of both scenes where most of them is one object.
"""

from dataclasses import fields, is_dataclass

import numpy as np
from numpy.typing import NDArray

from . import Scene

_FEW = 64  # numbers, below which NumPy takes longer to compare two arrays than to copy them


def same_things(one: Scene, other: Scene) -> bool:
    """True if the same geometries stand in the same places, made of materials of the same names."""
    return same(one.objects, other.objects) and same(one.geometries, other.geometries)


def same(one: object, other: object) -> bool:
    """True if two values, of those that scenes are made of, are the same."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return _same_array(one, other)
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(value, other[key]) for key, value in one.items())
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if is_dataclass(one):
        return all(same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    return one == other


def _same_array(one: NDArray, other: NDArray) -> bool:
    if one.shape != other.shape or one.dtype != other.dtype:
        return False
    if one.size < _FEW:
        return one.tobytes() == other.tobytes()
    return np.array_equal(one, other)
