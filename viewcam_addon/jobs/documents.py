"""Rows of JSON, as one document or as one object a line.

json.loads takes a key that is there twice and NaN without a word: both are kept here until they can be named.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator

from .. import checks
from ..errors import InputError
from . import rows
from .problems import Problems
from .rows import Cell, Row

_LINE_END = re.compile(r"\r\n|\r|\n")


class _Object(dict):
    """A JSON object that knows which keys it had more than once."""

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
            yield Row(place, "key", rows.with_defaults(_cells(place, value, problems), defaults))
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
    for key, sentence in rows.unusable_columns(value.keys_as_written):
        problems.add(f"{place}, key {checks.quoted(key)} {sentence}")
    return {
        key: Cell(f"{place}, key {key}", entry) for key, entry in value.items() if key in rows.COLUMNS and entry is not None
    }


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
