"""What all formats of a camera's text share: numbers in any punctuation, keys in any spelling, and the place of an error.

Every pattern runs once over the text (possessive, or starting from a word), so that no text takes long.
"""

import math
import re
from typing import NoReturn

from .. import checks
from ..errors import InputError

Vector = tuple[float, ...]
# What a reader finds: eye, look_at, up; distance, width; fov, fov_x, fov_y in degrees with their axis; focal_length; notes.
Values = dict[str, object]

VECTORS = ("eye", "look_at", "up")
AXES = ("x", "y", "diagonal", "smaller", "larger")

# Each spelling without its spaces, hyphens and underscores → what it says.
SPELLINGS = {
    **dict.fromkeys(("eye", "from", "origin", "location", "position"), "eye"),
    **dict.fromkeys(("lookat", "at", "to", "target", "center", "centre"), "look_at"),
    **dict.fromkeys(("up", "upvector", "vup"), "up"),
    **dict.fromkeys(("distance", "dist", "d"), "distance"),
    **dict.fromkeys(("fov", "fieldofview", "angle"), "fov"),
    **dict.fromkeys(("hfov", "fovx"), "fov_x"),
    **dict.fromkeys(("vfov", "fovy"), "fov_y"),
    **dict.fromkeys(("fovaxis", "axis"), "axis"),
}
_AXIS_SPELLINGS = {
    **{axis: axis for axis in AXES},
    **dict.fromkeys(("horizontal", "width", "h"), "x"),
    **dict.fromkeys(("vertical", "height", "v"), "y"),
    **dict.fromkeys(("shorter", "narrower"), "smaller"),
    **dict.fromkeys(("longer", "wider"), "larger"),
}

_GAP = re.compile(r"[\s,;|()\[\]{}<>'\"]*+")
_SAYS = re.compile(r"\s*+['\"]?+\s*+[=:]?+\s*+(?:<?Vector\b)?+")
_NUMBER = re.compile(r"[-+]?+(?:\d++(?:\.\d*+)?+|\.\d++)(?:[eE][-+]?+\d++)?+")
_WORD = re.compile(r"[A-Za-z_][\w-]*+")
_TWO_WORDS = re.compile(r"(look\s++at|fov\s++axis|field\s++of\s++view|up\s++vector)\b", re.IGNORECASE)
_UNITS = {
    "distance": re.compile(r"(?:\s*+(?:px|pixels?)\b)?+"),
    "fov": re.compile(r"(?:\s*+(?:°|deg(?:rees?)?\b))?+"),
}


def fail(text: str, at: int, advice: str) -> NoReturn:
    """Raise the InputError that shows the place."""
    place = text[at : at + 40].strip()
    line = text.count("\n", 0, at) + 1
    raise InputError(
        f"the text is not understood {f'at {checks.shown(place)}' if place else 'at its end'} (line {line}): {advice}"
    )


def numbers(text: str, at: int, count: int, name: str) -> tuple[Vector, int]:
    """So many finite numbers from `at` on, whatever stands between them, and where they end."""
    result: list[float] = []
    while len(result) < count:
        at = _GAP.match(text, at).end()
        found = _NUMBER.match(text, at)
        if not found or not math.isfinite(float(found[0])):
            fail(text, at, f"give {count} finite numbers for {name}" if count > 1 else f"give a finite number for {name}")
        result.append(float(found[0]))
        at = found.end()
    return tuple(result), at


def pairs(text: str, at: int = 0, end: int | None = None) -> Values:
    """Keys and their values, with or without = and : between them, and any brackets and separators around them."""
    text = text[:end]
    values: Values = {}
    while (at := _GAP.match(text, at).end()) < len(text):
        word = _TWO_WORDS.match(text, at) or _WORD.match(text, at)
        name = word and SPELLINGS.get(re.sub(r"[\s_-]", "", word[0]).lower())
        if not name:
            fail(text, at, "write eye=…, look_at=…, up=… and d=…, or copy a camera")
        if name in values:
            fail(text, at, f"{name} is given twice, leave one out")
        start = _SAYS.match(text, word.end()).end()
        if name == "axis":
            values[name], at = axis(text, start)
            continue
        if name in VECTORS:
            values[name], at = numbers(text, start, 3, name)
            continue
        (values[name],), at = numbers(text, start, 1, name)
        at = _UNITS["distance" if name == "distance" else "fov"].match(text, at).end()
    return values


def axis(text: str, at: int) -> tuple[str, int]:
    """One of `AXES`, in any spelling, and where the word ends."""
    at = _GAP.match(text, at).end()
    word = _WORD.match(text, at)
    if not word or word[0].lower() not in _AXIS_SPELLINGS:
        fail(text, at, f"give one of {', '.join(AXES)} for the axis of the field of view")
    return _AXIS_SPELLINGS[word[0].lower()], word.end()


def closing(text: str, opened: int, brackets: str) -> int:
    """Where the bracket that opens at `opened` closes."""
    depth = 0
    for found in re.compile("[" + re.escape(brackets) + "]").finditer(text, opened):
        depth += 1 if found[0] == brackets[0] else -1
        if depth == 0:
            return found.start()
    fail(text, opened, f"close it with {brackets[1]}")


def without(comments: str, text: str) -> str:
    """The text with blanks in place of what a pattern matches, so that places stay where they are."""
    return re.sub(comments, lambda found: " " * len(found[0]), text, flags=re.DOTALL)


def left_handed(program: str) -> str:
    """The note on a camera of a left-handed program that does not mirror its picture back."""
    return (
        f"{program} is left-handed: the numbers are taken as they are, and the picture is the mirror image of {program}'s "
        "unless the scene is mirrored as well"
    )
