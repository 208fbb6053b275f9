"""The values of lamps, the world, the film and the bounces, each declared once: what it may be, and how a scene file gives it.

Every function here is the default of a dataclass's field.
"""

from collections.abc import Callable
from dataclasses import field, fields
from typing import Any

import numpy as np

from ... import checks
from .colors import radiance

LARGEST = 1e18
"""The largest coordinate and size, as of scenes: products of a few of them are float64's."""


def value(default: Any, check: Callable[[str, Any], Any] | None, *read: Any) -> Any:
    """A field of a frozen dataclass with any value.

    check : a function: its name and a value → the value to store, or InputError.
    read : a method of `Field` and its arguments by which `scene_file` reads it, or another word.
    """
    return field(default=default, metadata={"check": check, "read": read})


def number(default: float, least: float = 0.0, most: float = LARGEST) -> Any:
    return value(default, lambda name, stated: checks.number(name, stated, least, most), "number")


def angle(default: float, least: float = 0.0) -> Any:
    """Radians, at most π, as which the float32 just above it counts, Blender's 180°."""
    half_turn = float(np.float32(np.pi))
    return value(default, lambda name, stated: min(checks.number(name, stated, least, half_turn), np.pi), "number")


def truth(default: bool) -> Any:
    return value(default, checks.truth, "truth")


def vector(default: tuple[float, ...]) -> Any:
    return value(default, lambda name, stated: checks.vector(name, stated, len(default)), "vector", len(default))


def light(default: float = 1.0) -> Any:
    """A field of red, green and blue."""
    return value((default,) * 3, radiance, "vector", 3)


def check(owner: Any, owner_name: str = "") -> None:
    """Let all declared values of a frozen dataclass be what they may be.

    owner_name : the owner of the values, as a sentence names it.
    """
    for each in fields(owner):
        if check := each.metadata.get("check"):
            name = f"{each.name} of {owner_name}" if owner_name else each.name
            object.__setattr__(owner, each.name, check(name, getattr(owner, each.name)))
