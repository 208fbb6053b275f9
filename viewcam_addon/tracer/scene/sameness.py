"""Equality of two scenes: what was made for one of them can then serve the other.

Nothing in a scene is ever changed in place, so that what is one object is the same without a look inside. Everything else is
compared to the last bit. Rejected: fingerprints, which read all of both scenes where most of them is one object.
"""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import Scene

_FEW = 64  # numbers, below which NumPy takes longer to compare two arrays than to copy them


def same_things(first: Scene, second: Scene) -> bool:
    """True if the same geometries stand in the same places, made of materials of the same names."""
    return same(first.objects, second.objects) and same(first.geometries, second.geometries)


def same(first: Any, second: Any) -> bool:
    """True if two values, of those that scenes are made of, are the same."""
    if first is second:
        return True
    if type(first) is not type(second):
        return False
    if isinstance(first, np.ndarray):
        return _same_array(first, second)
    if isinstance(first, dict):
        return list(first) == list(second) and all(same(value, second[key]) for key, value in first.items())
    if isinstance(first, tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if is_dataclass(first):
        return all(same(getattr(first, field.name), getattr(second, field.name)) for field in fields(first))
    return first == second


def _same_array(first: NDArray, second: NDArray) -> bool:
    if first.shape != second.shape or first.dtype != second.dtype:
        return False
    if first.size < _FEW:
        return first.tobytes() == second.tobytes()
    return np.array_equal(first, second)
