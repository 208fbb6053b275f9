"""Lists of jobs in files: all of them read and checked before the first is rendered.

Nothing here knows Blender: what the .blend says, its cameras' names, is handed in.
"""

import codecs
import json
import os
from collections.abc import Collection
from pathlib import Path

from ..errors import InputError
from ..files import read_bytes
from . import documents, table
from .job import Job
from .problems import Problems
from .rows import shots_of

_READERS = {
    ".csv": table.read,
    ".tsv": table.read,
    ".json": documents.read_document,
    ".jsonl": documents.read_lines,
    ".ndjson": documents.read_lines,
}
_OTHER_ENCODINGS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE, codecs.BOM_UTF32_BE)  # that of UTF-32 LE begins as UTF-16 LE's


def read(path: str | os.PathLike[str], cameras: Collection[str] | None = None) -> list[Job]:
    """The shots of a file, in its order; its suffix tells the format.

    cameras : the names of the .blend's cameras, where they are known, so that a shot of another is a problem.

    Raises
    ------
    ShotsError
        if anything is wrong with any of them; it has all that is.
    InputError
        if the file can't be read, or its suffix is none of a list of shots.
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
