"""Vectors as arrays of components, (3, n): each component lies in one piece of memory, where NumPy is fastest."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]
Indices = NDArray[np.intp]


def gather(table: NDArray, index: Indices) -> NDArray:
    """The entries `index` of the last axis of `table`. They must exist: NumPy's check would take longer than the copying."""
    return table.take(index, axis=-1, mode="clip")


Some = slice | Indices
"""Some entries of the last axis; all of them as a slice, which copies nothing."""


def some(chosen: NDArray[np.bool_]) -> Some:
    """Those that were chosen."""
    return slice(None) if chosen.all() else np.flatnonzero(chosen)


def pick(table: NDArray, which: Some) -> NDArray:
    """Some entries of the last axis of `table`."""
    return table[..., which] if isinstance(which, slice) else gather(table, which)


def put(table: NDArray, which: Indices, values: NDArray) -> None:
    """Write some entries of the last axis of `table`, (n,) or (3, n): row by row takes NumPy a third of the time."""
    for row, part in zip(table, values, strict=True) if table.ndim > 1 else [(table, values)]:
        row[which] = part


def dot(a: NDArray, b: NDArray) -> NDArray:
    """a · b along the first axis, of three components."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Floats, b: Floats) -> Floats:
    """a × b along the first axis, of three components."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def linear(form: Floats, x: Floats, y: Floats) -> Floats:
    """form · (x, y, 1) along the first axis of `form`."""
    value = form[0] * x
    value += form[1] * y
    value += form[2]
    return value
