"""K, R, t and 4 × 4 matrices as they stand in code: NumPy, torch, lists, MATLAB, Julia, C++ (OpenCV's and Eigen's), R.

    K = np.array([[fx, 0, 320], [0, fx, 180], [0, 0, 1]])       fx = 600 may stand elsewhere in the text
    K = [600 0 320; 0 600 180; 0 0 1];                          MATLAB, and what NumPy prints
    cv::Mat K = (cv::Mat_<double>(3, 3) << 600, 0, 320, 0, 600, 180, 0, 0, 1);      Eigen: K << 600, 0, …;
    K <- matrix(c(600, 0, 0, 0, 600, 0, 320, 180, 1), nrow = 3)                     column by column, as R does unless byrow

    fc = [ 657.4 ; 657.8 ]; cc = …; kc = …; omc_1 = …; Tc_1 = …     the Camera Calibration Toolbox for MATLAB, a picture each

The arrays are found by their names and brought into rows; their meaning, and what the names are, is OpenCV's (opencv.py). A
4 × 4 matrix is also read without K: then the camera sees as `Options.view_plane` says; and without a name, as consoles print
one, where nothing stands beside it. Nothing is run: what is computed from other arrays (an inverse, a product) is refused where
the camera needs it.

Sources: the Camera Calibration Toolbox's description of its parameters; the manuals of numpy.array, torch.tensor, MATLAB's
matrices, cv::Mat_'s and Eigen's comma initializers, R's matrix.
"""

import functools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from . import opencv, own, texts, tokens
from .camera import Camera, Options
from .expressions import JOINTS, Expressions
from .source import Source

TITLE = "K, R, t or a 4 × 4 matrix in code (NumPy, torch, MATLAB, C++, R)"

_MOST_CHARACTERS = 2**20
_MOST_ARRAYS, _MOST_NUMBERS = 2_000, 64
_COMMENT = r"/\*.*?(?:\*/|\Z)|#[^\n]*|%[^\n]*"
_COMMENT_OF_C = rf"//[^\n]*|{_COMMENT}"  # in Python it divides
_IN_C = re.compile(r";[ \t]*(?://|$)", re.MULTILINE)
_MAKERS = re.compile(
    r"(?:as)?array|(?:as_)?tensor|(?:Float|Double)?Tensor|[Mm]atrix|matrix_from|float(?:32|64)|c|mat|Mat_|Matx\d\d[df]|Vec\d[df]"
    r"|(?:Matrix|Vector|RowVector)(?:X|\d)?(?:X|\d)?[df]?"
)
_KEPT = {
    *("reshape", "astype", "float", "double", "cuda", "cpu", "to", "view", "clone", "copy", "numpy", "finished", "tolist"),
    "detach",
}
_TRANSPOSED = {"T", "t", "transpose", "mT"}
_DIMENSIONS = re.compile(r"(?:\s*\[\s*(?:\d{1,2}\s*)?\]){1,2}")
_UNPACKED = re.compile(r"\s*(?:[A-Za-z_]\w{0,40}\s*,\s*)+")
_TEMPLATE = re.compile(r"\s*<[\w\s,:]{0,60}>")
_ORDER = re.compile(r"byrow\s*=\s*(?:TRUE|T)\b")
_SCALARS = ("fx", "fy", "cx", "cy")
_TERMS = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
_DIAGONAL = re.compile(r"\(\s*[1-4]\s*\)")
# The words of consoles around the numbers of a matrix; and a text of numbers alone.
_PRINTED_AROUND = re.compile(
    r"\A<?Matrix [34]x4|>\s*\Z|\A[34]×4 \w+\{[^}\n]{0,40}\}:|(?:\b\w{1,40}\.){0,4}\b(?:array|tensor|[Mm]atrix)\s{0,9}(?=\()"
    r"|,\s*(?:dtype|device|requires_grad|grad_fn)\s*=\s*[\w.'\"<>:]{1,40}"
)
_NUMBERS_ALONE = re.compile(r"[\s\d.eE+\-,;()\[\]{}]*")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_LONGEST_ALONE = 2_000  # characters of a matrix that stands alone
_LIKE_A_TURN = 1e-2  # rows of a rotation with few digits may be off square, relative to their lengths' square
# MATLAB's and Octave's way to show a variable, with the factor that they take out of its numbers; and a row that goes on.
_SHOWN = re.compile(
    r"^([A-Za-z]\w{0,40})[ \t]*=[ \t]*\n(?:[ \t]*\n)*(?:[ \t]+(1\.0e[-+]\d+)[ \t]*\*[ \t]*\n(?:[ \t]*\n)*)?"
    r"((?:[ \t]+[-+\d.][-+\d.eE \t]*(?:\n|\Z))+)",
    re.MULTILINE,
)
_GOES_ON = re.compile(r"\.\.\.(?=[ \t]*(?:%[^\n]*)?$)", re.MULTILINE)
_TOOLBOX = re.compile(r"^[ \t]*(fc|cc|kc|nx|ny|alpha_c|omc_\d+|Tc_\d+)[ \t]*=[ \t]*\[?([^\]\n]*)\]?", re.MULTILINE)


@dataclass(frozen=True)
class _Unknown:
    """An array that is computed from what the text does not say.

    name : its name in the text.
    """

    name: str


def recognizes(source: Source) -> bool:
    if source.is_binary or source.is_folder or source.xml is not None or len(source.text) > _MOST_CHARACTERS:
        return False
    if _alone(source.text):
        return True
    if source.document:
        return False
    if own.lines_of(source):  # several cameras of our own, whose names look like a program's
        return False
    if source.json_problem and not {*"('"} & {*source.text}:  # JSON that is damaged, and no dictionary of Python
        return False
    if _of_toolbox(source.text):
        return True
    values = _values(source.text)
    return opencv.says_intrinsics(values) or any(_is_whole_pose(name, value) for name, value in values.items())


def _is_whole_pose(name: str, value: object) -> bool:
    return opencv.is_of_pose(name) and _is_whole(value)


def _is_whole(value: object) -> bool:
    """True if it has as many numbers as a whole pose."""
    return isinstance(value, list) and len(_flat(value)) in (12, 16)


def _flat(rows: list) -> list:
    return [number for row in rows for number in (row if isinstance(row, list) else [row])]


def read(source: Source, options: Options) -> list[Camera]:
    if named := _of_toolbox(source.text):
        return [opencv.camera(name, values, options) for name, values in named.items()]
    values = _values(source.text)
    known = {name: value for name, value in values.items() if not isinstance(value, _Unknown)}
    is_posed = any(_is_whole_pose(name, value) for name, value in known.items())
    for key in values.keys() - known.keys():
        if not opencv.is_size(key) and not (is_posed and opencv.is_of_pose(key)):
            raise InputError(f"{values[key].name} is computed from what the text does not say: write its numbers")
    camera = opencv.camera("Camera", known, options)
    unread = [] if camera.size_stated else [value.name for key, value in values.items() if key not in known]
    return [
        camera.noted(*(f"{name} is computed from what the text does not say: the size is the one given" for name in unread))
    ]


def _of_toolbox(text: str) -> dict[str, dict[str, Any]]:
    """The cameras of the Camera Calibration Toolbox for MATLAB by the numbers of their pictures; none if it is not its text.

    Those of pictures that were not used, NaN, are left out.
    """
    if "cc" not in text or "fc" not in text:
        return {}
    stated = {}
    for name, value in _TOOLBOX.findall(texts.without(_COMMENT, text)):
        try:
            stated[name] = [float(word) for word in re.split(r"[\s,;]+", value.strip().rstrip(";").strip())]
        except ValueError:
            return {}
    if any(len(stated.get(name, ())) != 2 for name in ("fc", "cc")):
        return {}
    skew = stated.get("alpha_c", [0.0])[0] * stated["fc"][0]
    (f_x, f_y), (c_x, c_y) = stated["fc"], stated["cc"]
    shared: dict[str, Any] = {"k": [[f_x, skew, c_x], [0.0, f_y, c_y], [0.0, 0.0, 1.0]]}
    shared |= {"dist": stated["kc"]} if "kc" in stated else {}
    shared |= {own_name: stated[name][0] for name, own_name in (("nx", "width"), ("ny", "height")) if name in stated}
    turns = {name.removeprefix("omc_"): turn for name, turn in stated.items() if name.startswith("omc_")}
    posed = {
        f"image_{number}": {**shared, "rvec": turn, "t": stated[f"Tc_{number}"]}
        for number, turn in turns.items()
        if f"Tc_{number}" in stated and not any(map(math.isnan, turn))
    }
    return posed or {"Camera": shared}


def _alone(text: str) -> list[float]:
    """The numbers of a text that is nothing but a matrix of a pose; none if it is anything else."""
    if len(text) > _LONGEST_ALONE:
        return []
    left = _PRINTED_AROUND.sub(" ", text.strip().replace("−", "-"))
    numbers = [*map(float, _NUMBER.findall(left))] if _NUMBERS_ALONE.fullmatch(left) else []
    if len(numbers) == 16:
        last = numbers[12:], numbers[3::4]
        return numbers if [0.0, 0.0, 0.0, 1.0] in last else []
    if len(numbers) != 12:
        return []
    turn = np.reshape(numbers, (3, 4))[:, :3]
    square, scale = turn @ turn.T, (turn * turn).sum() / 3
    return numbers if np.abs(square - scale * np.eye(3)).max() <= _LIKE_A_TURN * scale else []


def _as_written(match: re.Match) -> str:
    """A variable that MATLAB shows, as it is written."""
    factor = float(match[2] or 1)
    rows = [" ".join(repr(factor * float(word)) for word in line.split()) for line in match[3].splitlines() if line.strip()]
    return f"{match[1]} = [{'; '.join(rows)}];\n"


@functools.lru_cache(maxsize=1)
def _values(text: str) -> Mapping[str, Any]:
    """The arrays, in rows, and the numbers of a text by their plain names. What is recognized is then read."""
    if alone := _alone(text):
        return {"pose": alone}
    text = _SHOWN.sub(_as_written, _GOES_ON.sub("   ", text))
    text = texts.without(_COMMENT_OF_C, text) if _IN_C.search(text) else texts.without(_COMMENT, text)
    values = _Code(text.replace("−", "-")).values()
    if all(isinstance(values.get(name), float) for name in _SCALARS) and not opencv.says_intrinsics(values):
        f_x, f_y, c_x, c_y = (values.pop(name) for name in _SCALARS)
        values["k"] = [[f_x, 0.0, c_x], [0.0, f_y, c_y], [0.0, 0.0, 1.0]]
    return values


class _Code:
    """The arrays of a text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._words, self._places = tokens.words(text)
        self._words += [""] * 4
        self._places += [len(text)] * 4
        self._reader = Expressions(text, self._number)
        self._assigned: dict[str, list[int]] = {}  # name → where its values begin
        for at, word in enumerate(self._words[:-4]):
            if (word[:1].isalpha() or word[:1] == "_") and (begins := self._value_of(at)) is not None:
                for name, place in self._unpacked(at, begins):
                    self._assigned.setdefault(self._whole(name, at), []).append(place)
        self._numbers: dict[str, float | None] = {}

    def _whole(self, name: str, at: int) -> str:
        """The name with the word before it where both are a name together: Camera matrix, as people print it."""
        before, place = self._words[at - 1], self._places[at - 1]
        is_one = at > 0 and self.text[place + len(before) : self._places[at]] == " " and not opencv.is_known(opencv.plain(name))
        return before + name if is_one and opencv.is_known(opencv.plain(before + name)) else name

    def _value_of(self, at: int) -> int | None:
        """The beginning of the value that a name gets: by =, : (also behind a quote), <- or <<."""
        words, places = self._words, self._places
        behind = places[at] + len(words[at])
        if dimensions := _DIMENSIONS.match(self.text, behind):
            behind = dimensions.end()
        sign = tokens.token(self.text, behind)
        if sign.text in ("'", '"'):
            sign = tokens.token(self.text, sign.end)
        if sign.text in ("=", ":"):
            return sign.end
        if sign.text in ("(", "{") and _MAKERS.fullmatch(words[at - 1]):  # cv::Matx33d K(1, …)
            return sign.start
        if sign.text == "<" and self.text[sign.end : sign.end + 1] in ("-", "<"):
            return sign.end + 1
        return None

    def _unpacked(self, at: int, begins: int) -> list[tuple[str, int]]:
        """The names that get values together with the last of them, and where each one's begins: cx, cy = 320, 180."""
        start = self.text.rfind("\n", 0, self._places[at]) + 1
        names = _UNPACKED.fullmatch(self.text, start, self._places[at]) if self._words[at - 1] == "," else None
        if not names:
            return [(self._words[at], begins)]
        depth, places = 0, [begins]
        for sign, place in tokens.outside_strings(self.text, begins):
            if "\n" in self.text[places[-1] : place]:
                break
            depth += (sign in "([{") - (sign in ")]}")
            if sign == "," and not depth:
                places.append(place + 1)
        every = [*re.findall(r"\w+", names[0]), self._words[at]]
        return (
            list(zip(every, places, strict=True)) if len(every) == len(places) else [(name, len(self.text)) for name in every]
        )

    def _number(self, path: str) -> float | None:
        """The one number that a name is given."""
        places = self._assigned.get(path, [])
        if path not in self._numbers:
            self._numbers[path] = None  # while it is looked for
            numbers = {value if isinstance(value := self._reader.value(place)[0], float) else None for place in places[:20]}
            self._numbers[path] = numbers.pop() if len(numbers) == 1 and len(places) <= 20 else None
        return self._numbers[path]

    def values(self) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for name, places in list(self._assigned.items())[:_MOST_ARRAYS]:
            key = opencv.plain(name)
            is_known = opencv.is_known(key) or key in (*_SCALARS, *_TERMS)
            if not is_known and not opencv.may_be_pose(key):
                continue
            filled = [place for place in places if self.text[place - 2 : place] == "<<"]  # whatever it was made as
            for place in (filled or places)[:20]:
                array = self._array(place)
                value: object = array if array else self._reader.value(place)[0]
                if array == []:
                    value = _Unknown(name)
                if key in _SCALARS or opencv.is_size(key):
                    value = value if isinstance(value, float | list) else _Unknown(name)
                elif not (isinstance(value, float if key in _TERMS else list | _Unknown) and (is_known or _is_whole(value))):
                    continue  # K1 of a pair is no k1
                if key == "t" and _is_whole(value):
                    key = "transform"
                if key in result and result[key] != value:
                    texts.fail(self.text, place, f"{name} is something else before, copy one camera")
                result[key] = value
        is_listed = any(map(opencv.is_distortion, result))  # a list of what stands one by one, too
        return {key: value for key, value in result.items() if not (is_listed and key in _TERMS)}

    # ---- one array

    def _array(self, at: int) -> list | None:
        """The rows of an array that begins at a place, none if they are computed; None if there is no array."""
        parsed = self._parsed(at, 0)
        if parsed is None:
            return None
        rows, end = parsed
        after = tokens.token(self.text, end)
        is_computed = after.text in ("*", "/", "@", "+", "-") and "\n" not in self.text[end : after.start]
        is_part = after.text in JOINTS or (after.text in ("[", "(") and after.start == end)
        return [] if rows is None or is_computed or is_part else rows

    def _parsed(self, at: int, depth: int) -> "tuple[list | None, int] | None":
        """The rows and where they end; rows None if they are computed; None if no array begins there."""
        first = tokens.token(self.text, at)
        if depth > 6:
            return None
        if first.text == "new":
            return self._parsed(first.end, depth + 1)
        if first.kind == "name":
            return self._called(first)
        if first.text == "(" and (inner := self._parsed(first.end, depth + 1)):
            closed = tokens.token(self.text, inner[1])
            if closed.text == ")":
                return self._changed(inner[0], closed.end)
        if first.text in ("[", "(", "{"):
            rows, end = self._bracket(first.start, 0)
            return self._changed(rows, end)
        if depth == 0 and self.text[at - 2 : at] == "<<":  # K << 1, 2, 3;
            rows, end = self._listed(first.start)
            return (rows, end) if rows and len(rows) > 1 else None
        return None

    def _called(self, first: tokens.Token) -> "tuple[list | None, int] | None":
        last, after = first, tokens.token(self.text, first.end)
        while after.text in JOINTS and (part := tokens.token(self.text, after.end)).kind == "name":
            last, after = part, tokens.token(self.text, part.end)
        is_identity = last.text == "diag" and _DIAGONAL.match(self.text, after.start)
        if (last.text in ("eye", "identity", "zeros") or is_identity) and after.text == "(":
            return self._filled(last.text, after.start)
        if not _MAKERS.fullmatch(last.text):
            return (None, after.start) if after.text == "(" else None
        end = after.start
        if template := _TEMPLATE.match(self.text, last.end):
            after, end = tokens.token(self.text, template.end()), template.end()
        if after.text == "[":  # float[] { … }
            return None
        if after.text not in ("(", "{"):
            return None
        inner = self._parsed(after.end, 1)
        holds_array = inner is not None and tokens.token(self.text, after.end).kind != "number"
        close = _end_of(self.text, after.start)
        if self.text[close : close + 60].lstrip().startswith("<<"):  # cv::Mat_<double>(3, 3) << 1, 2, …
            rows, end = self._listed(self.text.index("<<", close) + 2)
            return rows, end
        rows = inner[0] if holds_array and inner else self._bracket(after.start, 0)[0]
        if last.text == "matrix" and rows is not None and "c" in self.text[after.end : after.end + 3]:  # R's
            order = _ORDER.search(self.text[after.start : close])
            side = math.isqrt(len(rows))
            shape = (3, 4) if len(rows) == 12 else (side, side)
            if math.prod(shape) == len(rows):
                rows = (np.reshape(rows, shape) if order else np.reshape(rows, shape[::-1]).T).tolist()
        return self._changed(rows, close)

    def _filled(self, kind: str, opened: int) -> "tuple[list | None, int]":
        """The rows of eye(3) or zeros((3, 1))."""
        end = _end_of(self.text, opened)
        sides = [int(side) for side in re.findall(r"\b[1-4]\b", self.text[opened : min(end, opened + 40)])]
        if not sides or (kind != "zeros" and len({*sides}) > 1):
            return None, end
        return self._changed(np.eye(sides[0]).tolist() if kind != "zeros" else [0.0] * math.prod(sides[:2]), end)

    def _changed(self, rows: "list | None", end: int) -> "tuple[list | None, int]":
        """The rows after .T, .reshape(…) and what leaves numbers as they are; None after anything else."""
        while True:
            sign = tokens.token(self.text, end)
            if sign.text == "'" and sign.start == end:
                rows, end = _transposed(rows), sign.end
                continue
            if sign.text != ".":
                return rows, end
            name = tokens.token(self.text, sign.end)
            end = name.end
            if name.text in _TRANSPOSED:
                rows = _transposed(rows)
            elif name.text not in _KEPT:
                rows = None
            if tokens.token(self.text, end).text == "(":
                end = _end_of(self.text, tokens.token(self.text, end).start)

    def _bracket(self, opened: int, depth: int) -> "tuple[list | None, int]":
        """The content of brackets: numbers, or rows of them; rows None if one is computed."""
        close = _end_of(self.text, opened) - 1
        if depth > 3 or close - opened > 4_000:
            return None, close + 1
        signs = list(tokens.outside_strings(self.text, opened + 1, close))
        has_commas = any(sign == "," for sign, _ in signs)
        values: list | None = []
        rows: list[list] = []
        at = opened + 1
        while values is not None and (next_ := tokens.token(self.text, at)).start < close and next_.kind:
            at = next_.end
            if next_.text == ";":
                rows.append(values)
                values = []
            elif next_.text in ("[", "(", "{"):
                inner, at = self._bracket(next_.start, depth + 1)
                values = [*values, inner] if inner is not None else None
            elif next_.text != ",":
                if next_.kind == "name" and _MAKERS.fullmatch(next_.text) and (parsed := self._called(next_)):
                    value: object = parsed[0]
                    at = parsed[1]
                else:
                    value, at = self._element(next_.start, close, has_commas)
                if isinstance(value, str) or (next_.kind == "name" and tokens.token(self.text, next_.end).text == "="):
                    at = min((place for sign, place in signs if sign == "," and place >= next_.start), default=close)
                    continue  # dtype=…
                values = [*values, value] if isinstance(value, float | list) and len(values) < _MOST_NUMBERS else None
        if values is None:
            return None, close + 1
        if rows:
            rows += [values] if values else []
            return rows, close + 1
        if len(values) > 1 and isinstance(values[0], list) and not all(isinstance(value, list) for value in values):
            values = values[0]  # [[…], 3, 3]
        return (values[0] if len(values) == 1 and isinstance(values[0], list) else values), close + 1

    def _element(self, at: int, close: int, has_commas: bool) -> tuple[object, int]:
        """A number and where it ends. In rows without commas blanks part them, and 1 -2 is two of them."""
        if has_commas:
            value, end = self._reader.value(at)
            following = tokens.token(self.text, end)
            return (value, end) if following.text in (",", ";") or following.start >= close else (None, max(end, at + 1))
        chunk = re.match(r"[^\s,;\[\]{}]+", self.text[at : min(close, at + 200)])
        end = at + (chunk.end() if chunk else 1)
        value, stopped = Expressions(self.text[at:end], self._number).value(0)
        return (value if stopped == end - at else None), end

    def _listed(self, at: int) -> "tuple[list | None, int]":
        """The numbers between commas, up to the end of the statement."""
        numbers: list | None = []
        while numbers is not None and len(numbers) < _MOST_NUMBERS:
            value, at = self._reader.value(at)
            numbers = [*numbers, value] if isinstance(value, float) else None
            comma = tokens.token(self.text, at)
            if comma.text != ",":
                break
            at = comma.end
        return numbers, at


def _end_of(text: str, opened: int) -> int:
    """Behind the bracket that closes the one at a place; the text's end if none does."""
    depth = 0
    for sign, place in tokens.outside_strings(text, opened, min(len(text), opened + 8_000)):
        depth += (sign in "([{") - (sign in ")]}")
        if not depth:
            return place + 1
    return len(text)


def _transposed(rows: "list | None") -> "list | None":
    if rows is None or not rows or not isinstance(rows[0], list):
        return rows
    return [list(column) for column in zip(*rows, strict=True)] if len({len(row) for row in rows}) == 1 else None
