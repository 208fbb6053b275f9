"""Types of the command line's arguments: text → value, or one sentence that argparse puts behind the option's name."""

import argparse
import math
from pathlib import Path


def positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number above 0")
    return int(text)


def above_zero(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is no number above 0")
    return number


def percentage(text: str) -> str:
    """A share in percent as it is written shortest: "0.5%"."""
    number, percent, rest = text.partition("%")
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not (percent and not rest.strip() and 0 < value <= 100):
        raise argparse.ArgumentTypeError(f"{text!r} is no share in percent above 0%, up to 100%: write 0.5%")
    return f"{value:.12g}%"


def share(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 <= number <= 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no number from 0 to 1")
    return number


def seed(text: str) -> int:
    if not text.isdecimal() or int(text) >= 2**31:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number from 0 to {2**31 - 1}")
    return int(text)


def size(text: str) -> tuple[int, int]:
    width, x, height = text.partition("x")
    if not x:
        raise argparse.ArgumentTypeError(f"{text!r} is no size: write 1920x1080")
    return positive(width), positive(height)


def path(text: str) -> Path:
    if not text:  # which Path takes for the current folder
        raise argparse.ArgumentTypeError("the name is empty: give that of a file or folder, or . for the current folder")
    return Path(text)


def names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


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
