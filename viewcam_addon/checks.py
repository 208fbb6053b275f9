"""Checks of numbers before anyone computes with them: the one place where hostile input becomes a sentence.

A number is real and finite: no text, no truth value, no complex or masked one, whatever `float()` would make of it. NumPy's
scalars, arrays without axes and fractions are numbers. Everything below raises InputError with the name that it is given.
Rejected: checks in every formula (they would hide it), and letting NaN travel to be found where a picture is black.
"""

import itertools
import math
import operator
import sys
import warnings
from collections.abc import Mapping, Set
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

# The largest number that scene files, image files and Blender count with.
LARGEST_WHOLE = 2**31 - 1

_WITHOUT_ORDER = (bytes, bytearray, memoryview, Set, Mapping)  # or whose items are no numbers of anybody's
_MOST_DIGITS = 310  # more than the largest float64 has
_LONGEST = 60  # characters of a refused value: a sentence is one line


def number(name: str, value: object, least: float = -math.inf, most: float = math.inf) -> float:
    """The value as a finite float from least to most."""
    try:
        result = _real(value)
    except TypeError:
        raise InputError(f"{name} is {quoted(value)}: give a number") from None
    if not math.isfinite(result):
        raise InputError(f"{name} is {quoted(value)}: give a finite number")
    if not least <= result <= most:
        raise InputError(f"{name} is {quoted(value)}: give a number from {least:.6g} to {most:.6g}")
    return result


# No overloads by count: typing would keep them, and with them this module, once the add-on is gone.
def vector(name: str, values: Any, count: int) -> tuple[Any, ...]:
    """`count` values, of whatever can be iterated over, as finite floats."""
    try:
        if type(values) not in (tuple, list) and isinstance(values, _WITHOUT_ORDER):  # abstract classes are slow to ask
            raise TypeError
        numbers = tuple([x if type(x) is float else _real(x) for x in itertools.islice(values, count + 1)])
    except TypeError:
        numbers = ()
    if len(numbers) != count:
        raise InputError(f"{name} is {quoted(values)}: give {count} numbers")
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"{name} is {quoted(numbers)}: every number of it must be finite")
    return numbers


def whole(name: str, value: Any) -> int:
    """The value as an int from 1 to `LARGEST_WHOLE`."""
    try:
        result = 0 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        result = 0
    if not 1 <= result <= LARGEST_WHOLE:
        raise InputError(f"{name} is {quoted(value)}: give a whole number from 1 to {LARGEST_WHOLE}")
    return result


def whole_of_json(digits: str) -> int | float:
    """A whole number of JSON, for json.loads as `parse_int`; of more digits than float64 reaches it is a float.

    Python refuses to read thousands of digits with an error that is no JSONDecodeError.
    """
    return int(digits) if len(digits) <= _MOST_DIGITS else float(digits)


def for_json(value: Any) -> Any:
    """The value with null in place of each float that JSON can't hold."""
    if isinstance(value, Mapping):
        return {key: for_json(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [for_json(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def truth(name: str, value: object) -> bool:
    """The value as a bool, which it must be."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} is {quoted(value)}: give True or False")
    return bool(value)


def array(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """The values as float64, real but perhaps not yet finite (see `finite`): to look costs as much as a formula."""
    if type(values) is np.ndarray and values.dtype == np.float64:
        return values
    try:
        if not isinstance(values, np.ndarray):
            with warnings.catch_warnings():  # a masked element in a list becomes nan, with a warning
                warnings.simplefilter("ignore")
                values = np.asarray(values)
        # Nothing is masked where nobody has loaded what masks: to load it takes as long as to read a scene.
        if (masks := sys.modules.get("numpy.ma")) and masks.is_masked(values):
            raise TypeError
        if values.dtype == object:
            values = np.array([_real(value) for value in values.flat], dtype=np.float64).reshape(values.shape)
        if values.dtype.kind not in "iuf":
            raise TypeError
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} is {quoted(values)}: give numbers, in lists of equal length") from None
    with np.errstate(over="ignore"):  # longer floats overflow
        return np.asarray(values, dtype=np.float64)


def finite(name: str, values: NDArray[np.float64]) -> None:
    """Refuse an array that holds something else than finite numbers."""
    bad = ~np.isfinite(values)
    if bad.any():
        place = np.argwhere(bad)[0].tolist()
        where = f" at {place}" if place else ""
        raise InputError(f"{name} holds {values[tuple(place)]}{where}: every number of it must be finite")


def broadcast(**arrays: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """The named arrays, read-only, in their common shape."""
    try:
        return tuple(np.broadcast_arrays(*arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {values.shape}" for name, values in arrays.items())
        raise InputError(f"the shapes do not fit together ({shapes}): give equal ones, or single numbers") from None


def quoted(value: object) -> str:
    """The value in a sentence: one line, and not too long a one."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # Python prints no int of more than 4300 digits
        return "a number of thousands of digits"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _real(value: object) -> float:
    """The value as a float, infinite where it is too large; TypeError if it is no real number, though it may look like one."""
    if isinstance(value, float):
        return float(value)
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf  # type: ignore[operator] # a whole number beyond float64
