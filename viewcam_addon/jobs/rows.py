"""The rows of a list of shots, in whatever format, and the shots that they are.

A reader (table.py, documents.py) knows the file's syntax and where everything stands; here is what a row means.
"""

import difflib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from .. import checks
from . import names
from .job import BESIDE_THEM, FIELDS, Job, conflicts
from .problems import MOST_SHOWN, Problems

VECTORS = ("eye", "look_at", "up")
LISTS = (*VECTORS, "principal_point")
TEXTS = ("name", "camera", "engine", "level", "mirrored")

# How each field may be written: as a whole, by another name, in three parts.
_PARTS = {vector: tuple(f"{vector}_{axis}" for axis in "xyz") for vector in VECTORS}
_SPELLINGS = {name: (name, *_PARTS.get(name, ())) for name in FIELDS} | {"d": ("d", "distance")}
_FIELD_OF = {spelling: name for name, spellings in _SPELLINGS.items() for spelling in spellings}

COLUMNS = tuple(_FIELD_OF)
"""All that a column or a key may be called."""


class Cell(NamedTuple):
    """A value and what a sentence calls it ("line 17, column eye_x")."""

    place: str
    value: object


@dataclass(frozen=True)
class Row:
    """One row.

    place : "line 17" of a CSV, say. kind : "column" or "key". cells : by column, those that say something. columns : all that
    the row could have had. excused : fields whose lack is told elsewhere.
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
    result, seen = [], set()
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


def _values(row: Row, problems: Problems) -> dict[str, object]:
    """The row's values by field, None for those that are wrong."""
    values: dict[str, object] = {}
    for name, check in FIELDS.items():
        written = [column for column in _SPELLINGS[name] if column in row.cells]
        if not written:
            continue
        values[name] = None
        cell = row.cells[written[0]]
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


def _check_name(row: Row, values: Mapping[str, object], taken: dict[str, tuple[str, str]], problems: Problems) -> None:
    name = values.get("name")
    if name is None:
        return
    before, place = taken.setdefault(names.one_file(name), (name, row.place))
    if place != row.place:
        same = "" if before == name else f" as {checks.quoted(before)}, which is the same file on Windows and macOS"
        problems.add(f"{row.place_of(['name'])} is {checks.quoted(name)}: {place} has this name already{same}, give another")
