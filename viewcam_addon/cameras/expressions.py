"""Values as they stand in programs and scenes: numbers, vectors, lists, strings, calls and sums of them, in any language.

`eye = glm::vec3(7, -6, 4) + offset`, `new THREE.Vector3(0, 1, 0)`, `<1, 0, 0> * 1.33`, `[7, -6, 4]`, `45 * M_PI / 180` and
`radians(45.0f)` are all read by one grammar. Nothing is executed: names stand for what the reader says they stand for, and what
is not understood becomes an `Unknown`, which is refused only if a camera needs it.

Rejected: Python's `ast`, which knows one language only and can be made to overflow the stack.
"""

import math
import re
from collections.abc import Callable

from . import texts, tokens

_DEEPEST = 30
_MOST_STEPS = 100_000  # all values of a text together

_TEMPLATE = re.compile(r"<[\w\s,:*]{0,200}>(?=\s*\()")
_UNIT = re.compile(r"\s*(?:(°|deg(?:rees?)?\b)|(rad(?:ians?)?\b))")
_VECTOR = re.compile(
    r"(?:make_?|d3dx|xm|scalar)?[a-z]?(?:vec(?:tor)?|point|float|double|cartesian|array|asarray|tuple|list|coord|position|xyz)_?[234]?[dfi]?_?t?"
)
_BEFORE_NAMES = {"new", "const", "auto", "return"}
_CAST_TO = {"float", "double", "int", "GLfloat", "GLdouble", "FLOAT", "real"}
JOINTS = {".", "->", "::"}
_CLOSING = {"(": ")", "[": "]", "{": "}", "<": ">"}
_PLAIN: dict[str, Callable[..., float]] = {
    "float": float,
    "float32": float,
    "float64": float,
    "double": float,
    "sqrt": math.sqrt,
    "tan": math.tan,
    "sin": math.sin,
    "cos": math.cos,
    "abs": abs,
    "min": min,
    "max": max,
}
_INVERSE: dict[str, Callable[..., float]] = {"atan": math.atan, "atan2": math.atan2, "asin": math.asin, "acos": math.acos}
_PI = {
    "pi": 1.0,
    "mpi": 1.0,
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
    """A value that can't be computed: it shows where it stands, if somebody needs it."""

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

    names : a function: name → its value, or None.
    angled : true if <1, 2, 3> is a vector, as in POV-Ray.
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
        """The content of the brackets that open at a place: values, named values, and where the brackets end."""
        try:
            return self._list(opened, 0)
        except _Failed:
            return [Unknown(opened)], {}, opened + 1

    def _token(self, at: int) -> tokens.Token:
        self._steps += 1
        if self._steps > _MOST_STEPS:
            raise _Failed
        return tokens.token(self.text, at)

    def _sum(self, at: int, depth: int) -> tuple[object, int]:
        left, at = self._product(at, depth)
        while (sign := self._token(at)).text in ("+", "-"):
            right, at = self._product(sign.end, depth)
            left = _added(left, right, 1 if sign.text == "+" else -1)
        return left, at

    def _product(self, at: int, depth: int) -> tuple[object, int]:
        left, at = self._signed(at, depth)
        while (sign := self._token(at)).text in ("*", "/"):
            right, at = self._signed(sign.end, depth)
            left = _multiplied(left, right, sign.text)
        return left, at

    def _signed(self, at: int, depth: int) -> tuple[object, int]:
        if depth > _DEEPEST:
            raise _Failed
        first = self._after_cast(self._token(at))
        if first.text in ("-", "+", "&"):
            value, end = self._signed(first.end, depth + 1)
            return (_multiplied(-1.0, value, "*") if first.text == "-" else value), end
        return self._single(first, depth)

    def _after_cast(self, first: tokens.Token) -> tokens.Token:
        """The token behind (float), if that is there and something stands behind it."""
        if first.text != "(":
            return first
        kind = self._token(first.end)
        kind = self._token(kind.end) if kind.text == "unsigned" else kind
        if kind.text in _CAST_TO and (closed := self._token(kind.end)).text == ")":
            after = self._token(closed.end)
            if after.kind in ("name", "number") or after.text == "(":
                return after
        return first

    def _single(self, first: tokens.Token, depth: int) -> tuple[object, int]:
        if first.kind == "number":
            number = tokens.number(first.text)
            if number is None:
                raise _Failed
            if unit := _UNIT.match(self.text, first.end):
                return (Degrees(number) if unit[1] else Radians(number)), unit.end()
            return (number if math.isfinite(number) else Unknown(first.start)), first.end
        if first.text in ("'", '"') and (quoted := tokens.string(self.text, first.start)):
            return quoted
        if first.text in ("(", "[", "{") or (first.text == "<" and self._angled):
            values, named, end = self._list(first.start, depth)
            if first.text == "(" and len(values) == 1 and not named and not _has_comma(self.text, first.start, end):
                return values[0], end
            return (named if named else tuple(values)), end
        if first.kind == "name":
            return self._named(first, depth)
        raise _Failed

    def _named(self, first: tokens.Token, depth: int) -> tuple[object, int]:
        after = self._token(first.end)
        has_prefix = first.text in ("r", "b", "f", "u") and after.text in ("'", '"') and after.start == first.end  # Python's
        if has_prefix and (quoted := tokens.string(self.text, after.start)):
            return quoted
        while first.text in _BEFORE_NAMES and after.kind == "name":
            first, after = after, self._token(after.end)
        path, last = [first.text], first
        while after.text in JOINTS and (part := self._token(after.end)).kind == "name":
            path += [after.text, part.text]
            last, after = part, self._token(part.end)
        if after.text == "<" and after.start == last.end and (template := _TEMPLATE.match(self.text, after.start)):
            after = self._token(template.end())
        if after.text == "(" or (after.text == "{" and _VECTOR.fullmatch(last.text.lower())):
            values, named, end = self._list(after.start, depth)
            value = _called(last.text, values, named, first.start)
            if self._token(end).text in (".", "["):
                return Unknown(first.start), self._past_calls(end, depth)
            return value, end
        if (key := texts.plain(last.text).removeprefix("math")) in _PI:
            return Radians(_PI[key] * math.pi), last.end
        value = self._names("".join(path))
        return (Unknown(first.start) if value is None else value), last.end

    def _past_calls(self, at: int, depth: int) -> int:
        """The end of .normalize().x[0] and its like, behind what is called or indexed."""
        while True:
            following = self._token(at)
            if following.text == "." and (part := self._token(following.end)).kind == "name":
                at = part.end
            elif following.text in ("(", "[") and following.start == at:
                at = self._list(at, depth)[2]
            else:
                return at

    def _skipped(self, at: int, closing: str) -> int:
        """The end of what is not understood: at the comma after it, or the bracket around it."""
        depth = 0
        for sign, place in tokens.outside_strings(self.text, at):
            self._steps += 1
            if self._steps > _MOST_STEPS:
                raise _Failed
            if sign in "([{":
                depth += 1
            elif sign in ")]}":
                if not depth:
                    if sign != closing:
                        raise _Failed
                    return place
                depth -= 1
            elif not depth:
                return place
        raise _Failed

    def _keyword(self, first: tokens.Token) -> tuple[str, int] | None:
        """The name before = or :, plain or in quotes, and where its value begins; None if there is none."""
        name, end = first.text, first.end
        if name in ("'", '"'):
            if not (quoted := tokens.string(self.text, first.start)):
                return None
            name, end = quoted
        elif first.kind != "name":
            return None
        sign = self._token(end)
        return (name, sign.end) if sign.text in ("=", ":") else None

    def _list(self, opened: int, depth: int) -> tuple[list, dict[str, object], int]:
        if depth > _DEEPEST:
            raise _Failed
        closing = _CLOSING[self.text[opened]]
        values: list[object] = []
        named: dict[str, object] = {}
        next_ = self._token(opened + 1)
        separated = True
        while next_.text != closing:
            if not next_.kind:
                raise _Failed
            keyword = self._keyword(next_)
            at = next_.start
            try:
                value, end = self._sum(keyword[1] if keyword else at, depth + 1)
            except _Failed:
                value, end = Unknown(at), self._skipped(at, closing)
                if not separated and values:  # 2 ? 3 : 4 is one value
                    values.pop()
            if keyword:
                named[keyword[0]] = value
            else:
                values.append(value)
            next_ = self._token(end)
            separated = next_.text in (",", ";")
            if separated:
                next_ = self._token(next_.end)
            elif next_.start == end and next_.kind and next_.text != closing:
                next_ = self._token(self._skipped(end, closing))
                values = [*values[:-1], Unknown(end)]
        return values, named, next_.end


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
