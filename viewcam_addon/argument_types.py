"""Types of the command line's arguments: text → value, or one sentence that argparse puts behind the option's name."""

import argparse
import math
from pathlib import Path

_MOST_THREADS = 1024
_LEAST_SHARE = 0.0001
"""Percent: far below what any number of samples finds."""
_MOST_DIGITS = 18
"""More than any count has; Python reads no number of thousands of digits."""
_LONGEST = 60
"""Characters of a refused text that a sentence quotes."""


def positive(text: str) -> int:
    if not text.isdecimal() or len(text) > _MOST_DIGITS or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{_quoted(text)} is no whole number above 0")
    return int(text)


def threads(text: str) -> int:
    if (count := positive(text)) > _MOST_THREADS:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number from 1 to {_MOST_THREADS}")
    return count


def frame(text: str) -> int:
    if not text.removeprefix("-").isdecimal() or len(text) > _MOST_DIGITS:
        raise argparse.ArgumentTypeError(f"{_quoted(text)} is no whole number")
    return int(text)


def above_zero(text: str) -> float:
    if not 0 < (number := _number(text)) < math.inf:
        raise argparse.ArgumentTypeError(f"{_quoted(text)} is no number above 0")
    return number


def _number(text: str) -> float:
    """The number that a text is, nan where it is none; an underscore within one is a slip of the hand."""
    try:
        return math.nan if "_" in text else float(text)
    except ValueError:
        return math.nan


def _quoted(text: str) -> str:
    return repr(text) if len(text) <= _LONGEST else f"{text[:_LONGEST]!r}…"


def percentage(text: str) -> str:
    """A share in percent as it is written shortest: "0.5%"."""
    number, percent, rest = text.partition("%")
    value = _number(number)
    if not (percent and not rest.strip() and _LEAST_SHARE <= value <= 100):
        raise argparse.ArgumentTypeError(f"{_quoted(text)} is no share in percent from {_LEAST_SHARE:.4f}% to 100%: write 0.5%")
    return f"{value:.12g}%"


def share(text: str) -> float:
    if not 0 <= (number := _number(text)) <= 1:
        raise argparse.ArgumentTypeError(f"{_quoted(text)} is no number from 0 to 1")
    return number


def seed(text: str) -> int:
    if not text.isdecimal() or len(text) > _MOST_DIGITS or int(text) >= 2**31:
        raise argparse.ArgumentTypeError(f"{_quoted(text)} is no whole number from 0 to {2**31 - 1}")
    return int(text)


def size(text: str) -> tuple[int, int]:
    width, x, height = text.partition("x")
    if not x:
        raise argparse.ArgumentTypeError(f"{_quoted(text)} is no size: write 1920x1080")
    return positive(width), positive(height)


def path(text: str) -> Path:
    if not text:  # which Path takes for the current folder
        raise argparse.ArgumentTypeError("the name is empty: give that of a file or folder, or . for the current folder")
    return Path(text)


def names(text: str) -> tuple[str, ...]:
    listed = tuple(name.strip() for name in text.split(",") if name.strip())
    if not listed:
        raise argparse.ArgumentTypeError(f"{_quoted(text)} names none: write some, with commas between them")
    return listed


_OF_GEOMETRY = {"depth": 1, "distance": 1, "position": 3, "normal": 3, "uv": 2, "object-index": 1, "material-index": 1}


def channels(text: str) -> tuple[str, list[str]]:
    """The name of a pass, as image.py has it, and its channels."""
    name, stated, listed = text.partition("=")
    if not stated or name.lower() not in _OF_GEOMETRY:
        known = ", ".join(_OF_GEOMETRY)
        raise argparse.ArgumentTypeError(f"{text!r} names no pass: write position=P.X,P.Y,P.Z, or one of {known}")
    chosen, count = names(listed), _OF_GEOMETRY[name.lower()]
    if len(chosen) != count:
        has = "1 channel" if count == 1 else f"{count} channels"
        raise argparse.ArgumentTypeError(f"{text!r} has {len(chosen)}: {name.lower()} has {has}, with commas between them")
    return ("UV" if name.lower() == "uv" else name.replace("-", " ").title()), list(chosen)


def png(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() != ".png":
        raise argparse.ArgumentTypeError(f"{text!r} is drawn as PNG: give a name that ends in .png")
    return path
