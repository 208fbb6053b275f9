"""Texts of IES files (ANSI/IES LM-63): the candela that a lamp's maker has measured, by directions.

What they mean in watts, and how tables that tell a part of the directions are completed, is Cycles'
(intern/cycles/util/ies.cpp): a lumen is that of daylight, 1/177.83 W, and a candela 4π lumens of a lamp that a node multiplies.
"""

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ... import checks
from ...errors import InputError

_WATTS = 0.0706650768394  # watts of a candela: 4π / 177.83
_CLOSE = 1e-4  # degrees: files round their angles
_TYPES = {1: "C", 2: "B", 3: "A"}
_MOST = 1 << 20  # angles


@dataclass(frozen=True, eq=False)
class Table:
    """The light of an IES file by direction.

    across : about the axis z, up : from −z upwards, degrees, ascending.
    watts : (across, up).
    """

    across: NDArray[np.float64]
    up: NDArray[np.float64]
    watts: NDArray[np.float64]

    def in_words(self) -> str:
        """Numbers, as the core's node reads them: how many, the angles in radians, the watts."""
        numbers = (*np.radians(self.across).tolist(), *np.radians(self.up).tolist(), *self.watts.ravel().tolist())
        return " ".join(map(repr, (len(self.across), len(self.up), *numbers)))


def read(name: str, text: object) -> Table:
    """The table that a text is.

    name : its name in an error's sentence.

    Raises InputError if it is none.
    """
    if not isinstance(text, str):
        raise InputError(f"{name} is {checks.quoted(text)}: give the text of an IES file")
    try:
        return _table(text)
    except (ValueError, IndexError) as error:
        raise InputError(f"{name} is no text of an IES file ({error}): give one whole") from error


@functools.lru_cache(maxsize=16)
def _table(text: str) -> Table:
    _, separator, rest = text.replace(",", " ").partition("\nTILT=")
    if not separator:
        raise ValueError("it has no line TILT=")
    tilt, _, rest = rest.partition("\n")
    words = iter(rest.split())
    if tilt.strip().startswith("INCLUDE"):
        next(words, None)
        for _ in range(2 * _whole(words)):
            _number(words)
    _whole(words), _number(words)
    factor = _number(words)
    ups, acrosses = _whole(words), _whole(words)
    kind = _TYPES.get(_whole(words))
    if kind is None:
        raise ValueError("it is of no type A, B or C")
    if not (1 <= acrosses <= _MOST and 2 <= ups <= _MOST):
        raise ValueError(f"it has {acrosses} × {ups} angles")
    _whole(words)
    for _ in range(3):  # its size
        _number(words)
    factor *= _number(words) * _number(words)
    _number(words)
    up = np.array([_number(words) for _ in range(ups)])
    across = np.array([_number(words) for _ in range(acrosses)])
    watts = np.array([[_number(words) for _ in up] for _ in across]) * (factor * _WATTS)
    across, up, watts = {"A": _type_a, "B": _type_b, "C": _type_c}[kind](across, up, watts)
    if len(across) < 2 or not ((np.diff(across) > 0).all() and (np.diff(up) > 0).all()):
        raise ValueError("its angles do not ascend")
    return Table(across, up, watts)


def _number(words: Iterator[str]) -> float:
    word = next(words, None)
    if word is None:
        raise ValueError("it ends too early")
    try:
        value = float(word)
    except ValueError:
        raise ValueError(f"it has {checks.quoted(word)} where a number belongs") from None
    if not np.isfinite(value) or abs(value) > 1e18:
        raise ValueError(f"it has the number {checks.quoted(word)}")
    return value


def _whole(words: Iterator[str]) -> int:
    value = _number(words)
    if value != int(value):
        raise ValueError(f"it has {value:g} where a whole number belongs")
    return int(value)


def _mirrored(angles: NDArray, values: NDArray, about: float) -> tuple[NDArray, NDArray]:
    """Angles that end where they are mirrored, and what lies beyond.

    values : a row for each angle.
    """
    return np.concatenate([angles, 2 * about - angles[-2::-1]]), np.concatenate([values, values[-2::-1]])


def _around(angles: NDArray, values: NDArray) -> tuple[NDArray, NDArray]:
    """Angles from −90° or 0° to 90°, as from 0° to 180°."""
    if abs(angles[0]) < _CLOSE:
        angles, values = np.concatenate([-angles[:0:-1], angles]), np.concatenate([values[:0:-1], values])
    return angles + 90.0, values


def _type_a(across: NDArray, up: NDArray, watts: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    first = abs(across[0]) < _CLOSE
    turned, values = 180.0 - across[::-1], watts[::-1]
    if first:
        turned, values = np.concatenate([turned, 180.0 + across[1:]]), np.concatenate([values, watts[1:]])
    return turned, up + 90.0, values


def _type_b(across: NDArray, up: NDArray, watts: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Angles and candela of type B, whose axis lies flat: the angles change their places."""
    turned, values = _around(up, watts.T)
    risen, values = _around(across, values.T)
    return turned, risen, values.T


def _type_c(across: NDArray, up: NDArray, watts: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    if abs(across[0] - 90.0) < _CLOSE:
        across = across - 90.0
    if len(across) == 1:
        across, watts = np.array([0.0, 360.0]), np.concatenate([watts, watts])
    if abs(across[-1] - 90.0) < _CLOSE:
        across, watts = _mirrored(across, watts, 90.0)
    if abs(across[-1] - 180.0) < _CLOSE:
        across, watts = _mirrored(across, watts, 180.0)
    steps, gap = np.diff(across), 360.0 - across[-1]
    if abs(across[0]) < _CLOSE < gap and min(abs(steps[-1] - gap), abs(steps[0] - gap)) < _CLOSE:
        across, watts = np.append(across, 360.0), np.concatenate([watts, watts[:1]])
    return across, up, watts
