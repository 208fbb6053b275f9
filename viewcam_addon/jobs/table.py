"""Rows of a CSV: whatever separates its columns, and with the line numbers that an editor shows.

Each line is a row. Rejected: quoted cells that go on in the next line, as RFC 4180 has them; no value of a shot needs them,
and a quote that somebody forgot to close would swallow the rest of the file, with all that is wrong there.
"""

import csv
import re
from collections.abc import Iterator
from typing import NamedTuple

from .. import checks
from . import rows
from .problems import Problems
from .rows import Cell, Row

_SEPARATORS = ",;\t|"
_LINE_END = re.compile(r"\r\n|\r|\n")
_SEPARATOR_OF_EXCEL = re.compile(r"sep=([,;|\t])", re.IGNORECASE)
_WHOLE = re.compile(r"[-+]?\d{1,300}", re.ASCII)
_NUMBER = re.compile(r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf|infinity)", re.ASCII | re.IGNORECASE)
_BETWEEN_NUMBERS = re.compile(r"\s*[,;]\s*|\s+")


class _Line(NamedTuple):
    place: str
    text: str


def read(text: str, problems: Problems) -> Iterator[Row]:
    """The rows of a CSV; what is wrong with its header or the shape of a row is added to the problems."""
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
    missing = rows.missing_fields(columns)
    for name in missing:
        problems.add(f"{header.place}: there is no column {name}, add it")
    parts = rows.missing_parts(columns)
    for part in parts:
        problems.add(f"{header.place}: there is no column {part}, add it")
    excused = frozenset([*missing, *(part.rpartition("_")[0] for part in parts)])
    known = [column for column in columns if column in rows.COLUMNS]
    for line in lines:
        cells = _cells(line, separator, problems)
        if cells is None or not any(cells):
            continue
        if len(cells) != len(columns):
            problems.add(
                f"{line.place} has {len(cells)} cells under {len(columns)} columns: quote a cell that holds {separator!r}"
            )
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
    columns = _cells(line, separator, problems)
    if columns is None:
        return None
    named = max((number for number, column in enumerate(columns, start=1) if column), default=0)
    for column, sentence in rows.unusable_columns(columns[:named]):
        problems.add(f"{line.place}, column {checks.quoted(column)} {sentence}")
    return columns


def _cells(line: _Line, separator: str, problems: Problems) -> list[str] | None:
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
    if column in rows.TEXTS:
        return text
    if column in rows.LISTS:
        return [_number(part) for part in _BETWEEN_NUMBERS.split(text.strip("()[] "))]
    return _number(text)


def _number(text: str) -> object:
    if _WHOLE.fullmatch(text):
        return int(text)
    return float(text) if _NUMBER.fullmatch(text) else text
