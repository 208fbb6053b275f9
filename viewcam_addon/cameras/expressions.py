"""Values as they stand in programs and scenes: numbers, vectors, lists, strings, calls and sums of them, in any language.

`eye = glm::vec3(7, -6, 4) + offset`, `new THREE.Vector3(0, 1, 0)`, `<1, 0, 0> * 1.33`, `[7, -6, 4]`, `45 * M_PI / 180` and
`radians(45.0f)` are all read by one grammar. Nothing is executed: names stand for what the reader says they stand for, and what
is not understood becomes an `Unknown`, which is refused only if a camera needs it.

Rejected: Python's `ast`, which knows one language only and can be made to overflow the stack.
"""

import math
import re
from collections.abc import Callable

from . import texts

_DEEPEST = 30
_MOST_STEPS = 100_000  # of all values of a text

_BLANK = re.compile(r"\s*+")
_NUMBER = re.compile(r"(?:0[xX][\da-fA-F]++|(?:\d++(?:\.\d*+)?+|\.\d++)(?:[eE][-+]?+\d++)?+)(?:[fFlLuU]\b)?+(?![A-Za-z_\d.])")
_STRING = re.compile(r"[rbfu]?+(?:\"((?:[^\"\\\n]|\\.){0,1000}+)\"|'((?:[^'\\\n]|\\.){0,1000}+)')")
_NAME = re.compile(r"(?:(?:new|const|auto|return)\s++)*+([A-Za-z_$][\w$]*+(?:\s*+(?:\.|->|::)\s*+[A-Za-z_$][\w$]*+)*+)")
_TEMPLATE = re.compile(r"<[\w\s,:*]*+>(?=\s*+\()")
_UNIT = re.compile(r"\s*+(?:(°|deg(?:rees?)?\b)|(rad(?:ians?)?\b))")
_KEYWORD = re.compile(r"\s*+(?:([A-Za-z_]\w*+)|\"([^\"\n]{0,1000}+)\"|'([^'\n]{0,1000}+)')\s*+(=(?!=)|:(?!:))")
_VECTOR = re.compile(
    r"(?:make_?|d3dx|xm|scalar)?[a-z]?(?:vec(?:tor)?|point|float|double|cartesian|array|asarray|tuple|list|coord|position|xyz)_?[234]?[dfi]?_?t?"
)
_CAST = re.compile(r"\(\s*+(?:unsigned\s++)?(?:float|double|int|GLfloat|GLdouble|FLOAT|real)\s*+\)\s*+(?=[\w(.])")
_SKIPPED = re.compile(r"\"(?:[^\"\\\n]|\\.){0,1000}+\"|'(?:[^'\\\n]|\\.){0,1000}+'|[()\[\]{},;]")
_CLOSING = {"(": ")", "[": "]", "{": "}", "<": ">"}
_PLAIN = {"sqrt": math.sqrt, "tan": math.tan, "sin": math.sin, "cos": math.cos, "abs": abs, "min": min, "max": max}
_INVERSE = {"atan": math.atan, "atan2": math.atan2, "asin": math.asin, "acos": math.acos}
_PI = {
    "pi": 1.0,
    "mpi": 1.0,
    "mathpi": 1.0,
    "d3dxpi": 1.0,
    "xmpi": 1.0,
    "glmpi": 1.0,
    "pioverthree": 1 / 3,
    "pioverfour": 0.25,
    "piovertwo": 0.5,
    "pioversix": 1 / 6,
}
_TO_RADIANS = {"radians", "toradians", "deg2rad", "degtorad", "degreestoradians", "xmconverttoradians", "d3dxtoradian"}
_TO_DEGREES = {"degrees", "todegrees", "rad2deg", "radtodeg", "radianstodegrees"}


class Unknown:
    """What can't be computed: it shows where it stands, if somebody needs it."""

    def __init__(self, at: int) -> None:
        self.at = at


class Radians(float):
    """An angle that is said in radians."""


class Degrees(float):
    """An angle that is said in degrees."""


class _Failed(Exception):
    pass


class Expressions:
    """The values of a text.

    names : what a name stands for, or None. angled : whether <1, 2, 3> is a vector, as in POV-Ray.
    """

    def __init__(self, text: str, names: Callable[[str], object] = lambda name: None, angled: bool = False) -> None:
        self.text, self._names, self._angled = text, names, angled
        self._steps = 0

    def value(self, at: int) -> tuple[object, int]:
        """The value at a place, and where it ends; an `Unknown` if it is none."""
        try:
            return self._sum(at, 0)
        except _Failed:
            return Unknown(at), at

    def arguments(self, opened: int) -> tuple[list, dict[str, object], int]:
        """What stands in the brackets that open at a place: values, named values, and where the brackets end."""
        try:
            return self._list(opened, 0)
        except _Failed:
            return [Unknown(opened)], {}, opened + 1

    def _next(self, at: int) -> int:
        self._steps += 1
        if self._steps > _MOST_STEPS:
            raise _Failed
        return _BLANK.match(self.text, at).end()

    def _sum(self, at: int, depth: int) -> tuple[object, int]:
        left, at = self._product(at, depth)
        while (sign := self.text[(after := self._next(at)) : after + 1]) in ("+", "-") and sign:
            right, at = self._product(after + 1, depth)
            left = _added(left, right, 1 if sign == "+" else -1)
        return left, at

    def _product(self, at: int, depth: int) -> tuple[object, int]:
        left, at = self._signed(at, depth)
        while (sign := self.text[(after := self._next(at)) : after + 1]) in ("*", "/") and sign:
            right, at = self._signed(after + 1, depth)
            left = _multiplied(left, right, sign)
        return left, at

    def _signed(self, at: int, depth: int) -> tuple[object, int]:
        if depth > _DEEPEST:
            raise _Failed
        at = self._next(at)
        if cast := _CAST.match(self.text, at):
            at = cast.end()
        sign = self.text[at : at + 1]
        if sign and sign in "-+&":
            value, end = self._signed(at + 1, depth + 1)
            return (_multiplied(-1.0, value, "*") if sign == "-" else value), end
        return self._single(at, depth)

    def _single(self, at: int, depth: int) -> tuple[object, int]:
        if found := _NUMBER.match(self.text, at):
            digits = found[0].rstrip("fFlLuU") if found[0][:2].lower() != "0x" else str(int(found[0], 16))
            number, at = float(digits), found.end()
            if unit := _UNIT.match(self.text, at):
                return (Degrees(number) if unit[1] else Radians(number)), unit.end()
            return (number if math.isfinite(number) else Unknown(found.start())), at
        if found := _STRING.match(self.text, at):
            return found[1] if found[1] is not None else found[2], found.end()
        opening = self.text[at : at + 1]
        if opening and (opening in "([{" or (opening == "<" and self._angled)):
            values, named, end = self._list(at, depth)
            if opening == "(" and len(values) == 1 and not named and not _has_comma(self.text, at, end):
                return values[0], end
            return (named if named else tuple(values)), end
        if found := _NAME.match(self.text, at):
            return self._named(found, depth)
        raise _Failed

    def _named(self, found: re.Match, depth: int) -> tuple[object, int]:
        path, at = re.sub(r"\s", "", found[1]), found.end()
        if template := _TEMPLATE.match(self.text, at):
            at = template.end()
        after = self._next(at)
        opening = self.text[after : after + 1]
        last = re.split(r"\.|->|::", path)[-1]
        if opening == "(" or (opening == "{" and _VECTOR.fullmatch(last.lower())):
            values, named, end = self._list(after, depth)
            value = _called(last, values, named, found.start())
            if self.text[self._next(end) : self._next(end) + 1] in (".", "["):
                value = Unknown(found.start())
                while (dotted := re.compile(r"\s*+\.\s*+\w++").match(self.text, end)) or self.text[end : end + 1] in ("(", "["):
                    end = dotted.end() if dotted else self._list(end, depth)[2]
            return value, end
        key = texts.plain(last)
        if key in _PI or key.removeprefix("math") in _PI:
            return Radians(_PI[key if key in _PI else key.removeprefix("math")] * math.pi), at
        value = self._names(path)
        return (Unknown(found.start()) if value is None else value), at

    def _skipped(self, at: int, closing: str) -> int:
        """Where what is not understood ends: at the comma after it, or the bracket around it."""
        depth = 0
        for found in _SKIPPED.finditer(self.text, at):
            self._steps += 1
            if self._steps > _MOST_STEPS:
                raise _Failed
            if found[0] in "([{":
                depth += 1
            elif found[0] in ")]}":
                if not depth:
                    if found[0] != closing:
                        raise _Failed
                    return found.start()
                depth -= 1
            elif found[0] in ",;" and not depth:
                return found.start()
        raise _Failed

    def _list(self, opened: int, depth: int) -> tuple[list, dict[str, object], int]:
        if depth > _DEEPEST:
            raise _Failed
        closing = _CLOSING[self.text[opened]]
        values, named = [], {}
        at = self._next(opened + 1)
        separated = True
        while self.text[at : at + 1] != closing:
            if at >= len(self.text):
                raise _Failed
            keyword = _KEYWORD.match(self.text, at)
            try:
                value, end = self._sum(keyword.end() if keyword else at, depth + 1)
            except _Failed:
                value, end = Unknown(at), self._skipped(at, closing)
                if not separated and values:  # 2 ? 3 : 4 is one value
                    values.pop()
            if keyword:
                named[keyword[1] or keyword[2] or keyword[3] or ""] = value
            else:
                values.append(value)
            at = self._next(end)
            separated = self.text[at : at + 1] in (",", ";") and at < len(self.text)
            if separated:
                at = self._next(at + 1)
            elif at == end and self.text[at : at + 1] != closing:
                at = self._skipped(at, closing)
                values = [*values[:-1], Unknown(end)]
        return values, named, at + 1


def numbers(value: object, count: int) -> tuple[float, ...] | None:
    """So many plain numbers, or None."""
    if isinstance(value, list | tuple) and len(value) == count and all(type(x) in (float, Radians, Degrees) for x in value):
        return tuple(map(float, value))
    return None


def _has_comma(text: str, at: int, end: int) -> bool:
    return text[at:end].rstrip(")} ]\n\t").endswith(",")


def _called(name: str, values: list, named: dict[str, object], at: int) -> object:
    key = texts.plain(name)
    plain = [value for value in values if isinstance(value, float)]
    if len(plain) == len(values) and values and not named:
        try:
            if key in _TO_RADIANS and len(values) == 1:
                return Radians(values[0] if isinstance(values[0], Radians) else math.radians(values[0]))
            if key in _TO_DEGREES and len(values) == 1:
                return Degrees(math.degrees(values[0]))
            if key in _PLAIN:
                return float(_PLAIN[key](*values))
            if key in _INVERSE:
                return Radians(_INVERSE[key](*values))
        except (ValueError, TypeError, OverflowError):
            return Unknown(at)
    if key in ("normalize", "vnormalize", "normalized") and len(values) == 1 and (vector := numbers(values[0], 3)):
        length = math.hypot(*vector)
        return tuple(x / length for x in vector) if 0 < length < math.inf else Unknown(at)
    if key == "xmvectorset":
        return tuple(values[:3])
    if _VECTOR.fullmatch(name.lower()):
        if len(values) == 1:
            inner = values[0]
            if isinstance(inner, tuple):
                return inner
            return (inner,) * 3 if isinstance(inner, float) and "3" in name else Unknown(at)
        return tuple(values)
    if isinstance(values, list) and named and not values:
        return Unknown(at)
    return Unknown(at)


def _added(left: object, right: object, sign: int) -> object:
    if isinstance(left, float) and isinstance(right, float):
        return _angle_like(left, right)(left + sign * right)
    if isinstance(left, tuple) and isinstance(right, tuple) and len(left) == len(right):
        parts = tuple(_added(a, b, sign) for a, b in zip(left, right, strict=True))
        return parts if all(isinstance(part, float) for part in parts) else _unknown(*parts)
    return _unknown(left, right)


def _multiplied(left: object, right: object, sign: str) -> object:
    if sign == "/" and isinstance(right, float):
        if right == 0:
            return _unknown(left, right)
        if isinstance(left, float):
            return _angle_like(left, right)(left / right)
    elif isinstance(left, float) and isinstance(right, float):
        return _angle_like(left, right)(left * right)
    if isinstance(left, float) and isinstance(right, tuple) and sign == "*":
        left, right = right, left
    if isinstance(left, tuple) and isinstance(right, float):
        parts = tuple(_multiplied(part, right, sign) for part in left)
        return parts if all(isinstance(part, float) for part in parts) else _unknown(*parts)
    return _unknown(left, right)


def _angle_like(left: float, right: float) -> type:
    kinds = {type(left), type(right)} - {float}
    return kinds.pop() if len(kinds) == 1 else float


def _unknown(*values: object) -> Unknown:
    return next((value for value in values if isinstance(value, Unknown)), Unknown(0))
