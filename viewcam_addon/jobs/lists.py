"""Lists of jobs in files: all of them read and checked before the first is rendered.

A reader (`read_table`, `read_document`, `read_lines`) knows the file's syntax and where everything stands; `shots_of` knows
what a row means. All that is wrong with a list is gathered, so that it is put right in one go. Nothing here knows Blender: what
the .blend says, its cameras' names, is handed in.
"""

import codecs
import contextlib
import csv
import difflib
import json
import os
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from .. import checks
from .. import file_names as names
from ..errors import InputError, counted
from ..files import read_bytes
from ..terminal import plain
from .job import BESIDE_THEM, FIELDS, Job, conflicts

VECTORS = ("eye", "look_at", "up")
LISTS = (*VECTORS, "principal_point")
TEXTS = ("name", "camera", "engine", "level", "mirrored")

# The forms in which a field may be written: as a whole, by another name, in three parts.
_PARTS = {vector: tuple(f"{vector}_{axis}" for axis in "xyz") for vector in VECTORS}
_SPELLINGS = {name: (name, *_PARTS.get(name, ())) for name in FIELDS} | {"d": ("d", "distance")}
_FIELD_OF = {spelling: name for name, spellings in _SPELLINGS.items() for spelling in spellings}

COLUMNS = tuple(_FIELD_OF)
"""All that a column or a key may be called."""

MOST_SHOWN = 100
"""The number of problems that are told one by one."""


class ShotsError(InputError):
    """A list of shots that can't be used. The message is the list of problems; `problems` has all, one sentence each."""

    def __init__(self, source: str, problems: tuple[str, ...]) -> None:
        super().__init__(source, problems)
        self.source, self.problems = source, problems

    def __str__(self) -> str:
        count = len(self.problems)
        lines = [f"{plain(self.source)}: {counted(count, 'problem')}, nothing is rendered"]
        lines += [f"  {plain(problem)}" for problem in self.problems[:MOST_SHOWN]]
        if count > MOST_SHOWN:
            lines.append(f"  … and {count - MOST_SHOWN} more")
        return "\n".join(lines)


class Problems:
    """The problems found so far, each sentence once."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._sentences: dict[str, None] = {}

    def add(self, sentence: str) -> None:
        self._sentences[sentence] = None

    @contextlib.contextmanager
    def caught(self) -> Iterator[None]:
        """Keep the InputError of the block, and go on after it."""
        try:
            yield
        except InputError as error:
            self.add(str(error))

    def raise_any(self) -> None:
        """Raise ShotsError if there are any."""
        if self._sentences:
            raise ShotsError(self._source, tuple(self._sentences))


class Cell(NamedTuple):
    """A value and what a sentence calls it ("line 17, column eye_x")."""

    place: str
    value: object


@dataclass(frozen=True)
class Row:
    """A row of a list of shots.

    place : its place in the list, "line 17" of a CSV, say.
    kind : the word for a field in this list, "column" or "key".
    cells : the cells that say something, by column.
    columns : the columns that the row could have had.
    excused : fields whose lack is told elsewhere.
    """

    place: str
    kind: str
    cells: Mapping[str, Cell]
    columns: Collection[str] = ()
    excused: frozenset[str] = frozenset()

    def place_of(self, fields: Iterable[str]) -> str:
        """The name in sentences of these fields of the row."""
        columns = [column for name in fields for column in self._columns_of(name)]
        return f"{self.place}, {self.kind}{'s' if len(columns) > 1 else ''} {', '.join(columns)}"

    def _columns_of(self, name: str) -> Sequence[str]:
        written = [column for column in _SPELLINGS[name] if column in self.cells or column in self.columns]
        return written or (name,)


def unusable_columns(columns: Sequence[str]) -> list[tuple[str, str]]:
    """(column, why it can't stand there) for each such: unknown, twice, or in two spellings at once."""
    result: list[tuple[str, str]] = []
    seen: set[str] = set()
    for column in columns:
        name = _FIELD_OF.get(column)
        others = [each for each in seen if _FIELD_OF[each] == name and not {each, column} <= {*_PARTS.get(name, ())}]
        if name is None:
            close = difflib.get_close_matches(column.strip().lower().replace(" ", "_"), COLUMNS, 1)
            result.append((column, f"is unknown: {f'write {close[0]}' if close else 'take it out'}"))
        elif column in seen:
            result.append((column, "is there twice: take one out"))
        elif others:
            result.append((column, f"says the same as {min(others)}: take one out"))
        else:
            seen.add(column)
    return result


def missing_fields(columns: Iterable[str]) -> list[str]:
    """The fields that every row needs, and which are none of these columns."""
    stated = {_FIELD_OF.get(column) for column in columns}
    needed = ("name",) if "camera" in stated else ("name", "eye", "look_at", "up", "d")
    return [name for name in needed if name not in stated]


def missing_parts(columns: Collection[str]) -> list[str]:
    """eye_y of eye_x and eye_z, and the like."""
    parts = [parts for parts in _PARTS.values() if not {*parts}.isdisjoint(columns)]
    return [part for of_one in parts for part in of_one if part not in columns]


def with_defaults(row: Mapping[str, Cell], defaults: Mapping[str, Cell]) -> dict[str, Cell]:
    """A row's cells, and the defaults of the fields that it does not have; its kind of camera displaces the other kind."""
    stated = {_FIELD_OF[column] for column in row}
    if "camera" in stated:
        stated |= {*VECTORS, "d", *BESIDE_THEM}
    elif stated & {*VECTORS, "d"}:
        stated.add("camera")
    return {column: cell for column, cell in defaults.items() if _FIELD_OF[column] not in stated} | dict(row)


def shots_of(rows: Iterable[Row], problems: Problems, cameras: Collection[str] | None) -> list[Job]:
    """The shots; what is wrong with a row is added to the problems, and its shot is left out.

    cameras : the names of the file's cameras, where they are known.
    """
    shots = []
    known, first, guesses = frozenset(cameras or ()), ", ".join(sorted(cameras or ())[:5]) or "none", MOST_SHOWN
    taken: dict[str, tuple[str, str]] = {}  # one_file(name) → (name, place)
    for row in rows:
        values = _values(row, problems)
        refused = conflicts(values, in_list=True)
        for fields, sentence in refused:
            if left := [name for name in fields if name not in row.excused]:
                problems.add(f"{row.place_of(left)}: {sentence}")
        _check_name(row, values, taken, problems)
        if cameras is not None and (camera := values.get("camera")) is not None and camera not in known:
            guesses -= 1  # a guess looks at every camera, and nobody reads those behind the problems that are shown
            close = ", ".join(difflib.get_close_matches(camera, cameras)) if guesses >= 0 else ""
            problems.add(f"{row.cells['camera'].place}: the file has no camera {checks.quoted(camera)}, but {close or first}")
        if None not in values.values() and not refused:
            shots.append(Job(**values))
    return shots


def _values(row: Row, problems: Problems) -> dict[str, Any]:
    """The row's values by field, None for those that are wrong."""
    values: dict[str, Any] = {}
    for name, check in FIELDS.items():
        written = [column for column in _SPELLINGS[name] if column in row.cells]
        if not written:
            continue
        values[name] = None
        cell: Cell | None = row.cells[written[0]]
        if written[0] in _PARTS.get(name, ()):
            cell = _joined(row, name, problems)
        if cell:
            with problems.caught():
                values[name] = check(*cell)
    return values


def _joined(row: Row, name: str, problems: Problems) -> Cell | None:
    """The three parts of a vector as one; None if one of them is wrong."""
    numbers = []
    for part in _PARTS[name]:
        if part in row.cells:
            with problems.caught():
                numbers.append(checks.number(*row.cells[part]))
        elif name not in row.excused:
            problems.add(f"{row.place}, {row.kind} {part}: missing, give a number")
    return Cell(row.place_of([name]), numbers) if len(numbers) == 3 else None


def _check_name(row: Row, values: Mapping[str, Any], taken: dict[str, tuple[str, str]], problems: Problems) -> None:
    name = values.get("name")
    if name is None:
        return
    before, place = taken.setdefault(names.one_file(name), (name, row.place))
    if place != row.place:
        same = "" if before == name else f" as {checks.quoted(before)}, which is the same file on Windows and macOS"
        problems.add(f"{row.place_of(['name'])} is {checks.quoted(name)}: {place} has this name already{same}, give another")


_SEPARATORS = ",;\t|"
_LINE_END = re.compile(r"\r\n|\r|\n")
_SEPARATOR_OF_EXCEL = re.compile(r"sep=([,;|\t])", re.IGNORECASE)
_WHOLE = re.compile(r"[-+]?\d{1,300}", re.ASCII)
_NUMBER = re.compile(r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf|infinity)", re.ASCII | re.IGNORECASE)
_BETWEEN_NUMBERS = re.compile(r"\s*[,;]\s*|\s+")


class _Line(NamedTuple):
    place: str
    text: str


def read_table(text: str, problems: Problems) -> Iterator[Row]:
    """The rows of a CSV; what is wrong with its header or the shape of a row is added to the problems.

    Each line is a row, with the number that an editor shows. Rejected: quoted cells that go on in the next line, as RFC 4180
    has them; no value of a shot needs them, and a quote that somebody forgot to close would swallow the rest of the file, with
    all that is wrong there.
    """
    lines = [_Line(f"line {number}", line) for number, line in enumerate(_LINE_END.split(text), start=1) if line.strip()]
    separator = None
    if lines and (chosen := _SEPARATOR_OF_EXCEL.fullmatch(lines[0].text.strip(" "))):
        separator = chosen[1]
        del lines[0]
    if not lines:
        return
    header, *lines = lines
    separator = separator or max(_SEPARATORS, key=header.text.count)
    columns = _header(header, separator, problems)
    if columns is None:
        return
    missing = missing_fields(columns)
    for name in missing:
        problems.add(f"{header.place}: there is no column {name}, add it")
    parts = missing_parts(columns)
    for part in parts:
        problems.add(f"{header.place}: there is no column {part}, add it")
    excused = frozenset([*missing, *(part.rpartition("_")[0] for part in parts)])
    known = [column for column in columns if column in COLUMNS]
    for line in lines:
        cells = _cells_of(line, separator, problems)
        if cells is None or not any(cells):
            continue
        if len(cells) != len(columns):
            has = f"{counted(len(cells), 'cell')} under {counted(len(columns), 'column')}"
            problems.add(f"{line.place} has {has}: quote a cell that holds {separator!r}")
            continue
        if any(cell and not column for column, cell in zip(columns, cells, strict=True)):
            problems.add(f"{line.place} has a cell under no column: take it out, or name its column")
        values = {
            column: Cell(f"{line.place}, column {column}", _value(column, cell))
            for column, cell in zip(columns, cells, strict=True)
            if cell and column in known
        }
        yield Row(line.place, "column", values, known, excused)


def _header(line: _Line, separator: str, problems: Problems) -> list[str] | None:
    """The columns, or None if the line is no row. Empty ones at the end are a spreadsheet's way, and stay empty below."""
    columns = _cells_of(line, separator, problems)
    if columns is None:
        return None
    named = max((number for number, column in enumerate(columns, start=1) if column), default=0)
    for column, sentence in unusable_columns(columns[:named]):
        problems.add(f"{line.place}, column {checks.quoted(column)} {sentence}")
    return columns


def _cells_of(line: _Line, separator: str, problems: Problems) -> list[str] | None:
    """The cells of a line, without blanks around them; None if its quotes do not match."""
    try:
        (cells,) = csv.reader([line.text], delimiter=separator, skipinitialspace=True, strict=True)
    except csv.Error as error:
        problems.add(
            f"{line.place} is no row of cells ({error}): open and close each quote on one line, and double those inside"
        )
        return None
    return [cell.strip() for cell in cells]


def _value(column: str, text: str) -> object:
    """The value of a cell: text, a number or a list of them; what is no number stays text, and is refused as such."""
    if column in TEXTS:
        return text
    if column in LISTS:
        return [_number(part) for part in _BETWEEN_NUMBERS.split(text.strip("()[] "))]
    return _number(text)


def _number(text: str) -> object:
    if _WHOLE.fullmatch(text):
        return int(text)
    return float(text) if _NUMBER.fullmatch(text) else text


class _Object(dict):
    """A JSON object that knows which keys it had more than once, which json.loads takes without a word."""

    def __init__(self, pairs: list[tuple[str, object]]) -> None:
        super().__init__(pairs)
        self.keys_as_written = [key for key, _ in pairs]


def read_document(text: str, problems: Problems) -> Iterator[Row]:
    """The rows of a list of objects, or of an object with `shots` and perhaps `defaults`."""
    document = _parsed(text)
    defaults: dict[str, Cell] = {}
    if isinstance(document, _Object):
        for key, count in Counter(document.keys_as_written).items():
            if key not in ("shots", "defaults"):
                problems.add(f"key {checks.quoted(key)} is unknown: the keys beside the list of shots are shots and defaults")
            elif count > 1:
                problems.add(f"key {key} is there twice: take one out")
        defaults = _cells("defaults", document.get("defaults", _Object([])), problems)
        if defaults.pop("name", None):
            problems.add("defaults, key name: take it out, each shot needs a name of its own")
        document = document.get("shots")
    if not isinstance(document, list):
        raise InputError('this is no list of shots: write [{"name": …}, …] or {"shots": [{"name": …}, …]}')
    for number, value in enumerate(document, start=1):
        name = value.get("name") if isinstance(value, _Object) else None
        place = f"shot {number} ({checks.quoted(name)})" if isinstance(name, str) else f"shot {number}"
        if isinstance(value, _Object):
            yield Row(place, "key", with_defaults(_cells(place, value, problems), defaults))
        else:
            problems.add(f"{place} is {checks.quoted(value)}: give an object with keys")


def read_lines(text: str, problems: Problems) -> Iterator[Row]:
    """The rows of JSON Lines."""
    for number, line in enumerate(_LINE_END.split(text), start=1):
        place, value = f"line {number}", None
        if not line.strip():
            continue
        try:
            value = _parsed(line, number)
        except InputError as error:
            problems.add(str(error))
            continue
        if isinstance(value, _Object):
            yield Row(place, "key", _cells(place, value, problems))
        else:
            problems.add(f"{place} is {checks.quoted(value)}: give an object with keys")


def _cells(place: str, value: object, problems: Problems) -> dict[str, Cell]:
    """The cells of an object; null says nothing."""
    if not isinstance(value, _Object):
        problems.add(f"{place} is {checks.quoted(value)}: give an object with keys")
        return {}
    for key, sentence in unusable_columns(value.keys_as_written):
        problems.add(f"{place}, key {checks.quoted(key)} {sentence}")
    return {key: Cell(f"{place}, key {key}", entry) for key, entry in value.items() if key in COLUMNS and entry is not None}


def _parsed(text: str, line: int = 1) -> object:
    """The JSON value. line : the number of the text's first line."""
    try:
        return json.loads(text, object_pairs_hook=_Object, parse_int=checks.whole_of_json)
    except json.JSONDecodeError as error:
        raise InputError(
            f"line {error.lineno + line - 1}, column {error.colno}: this is no JSON ({error.msg}), correct it"
        ) from None
    except RecursionError:
        raise InputError(f"line {line}: the brackets are nested too deeply, give a list of shots") from None


_READERS = {
    ".csv": read_table,
    ".tsv": read_table,
    ".json": read_document,
    ".jsonl": read_lines,
    ".ndjson": read_lines,
}
_OTHER_ENCODINGS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE, codecs.BOM_UTF32_BE)  # UTF-32 LE begins as UTF-16 LE does


def read(path: str | os.PathLike[str], cameras: Collection[str] | None = None) -> list[Job]:
    """The shots of a file, in its order; its suffix tells the format.

    cameras : the names of the .blend's cameras, where they are known, so that a shot of another is a problem.

    Raises ShotsError if anything is wrong with any of them; it has all that is. Raises InputError if the file can't be read, or
    its suffix is none of a list of shots.
    """
    path = Path(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path} is no list of shots by its suffix: give a file called {', '.join(_READERS)}")
    text = _text(path)
    problems = Problems(str(path))
    shots: list[Job] = []
    with problems.caught():
        shots = shots_of(reader(text, problems), problems, cameras)
    problems.raise_any()
    if not shots:
        raise InputError(f"{path} holds no shots: give at least one")
    return shots


def is_list(path: str | os.PathLike[str]) -> bool:
    """True if a file is a list of shots by its suffix and its first row, and not cameras of another program."""
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in _READERS or path.is_dir():
        return False
    try:
        text = _text(path)
        if suffix != ".json":
            return not text.lstrip().startswith("#")  # as the tables of trajectories begin
        document = json.loads(text)
    except (InputError, ValueError, RecursionError):
        return True  # its own reader says what is wrong
    if isinstance(document, dict):
        return "shots" in document or "defaults" in document
    return isinstance(document, list) and not (document and isinstance(document[0], dict) and "name" not in document[0])


def _text(path: Path) -> str:
    """The file's text. Bytes that are not UTF-8 become lone surrogates, which are refused where they stand."""
    try:
        data = read_bytes(path)
    except OSError as error:
        raise InputError(f"{path} can't be read ({error.strerror}): check its name and permissions") from error
    if data.startswith(_OTHER_ENCODINGS) or b"\0" in data[:100]:
        raise InputError(f"{path} is not UTF-8: save it as UTF-8")
    return data.decode("utf-8-sig", errors="surrogateescape")
