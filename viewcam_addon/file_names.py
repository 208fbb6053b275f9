"""The names that shots and their files may have, on Linux, Windows and macOS alike; and files of cameras.

A batch may be listed on one system and rendered on another, so the rules of all three hold everywhere. Rejected: replacing
what is not allowed in a shot's name in a list (nobody finds the picture by the name that he gave).
"""

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable

from . import checks
from .errors import InputError

# Bytes of UTF-8. 255 is what file systems take; a temporary file beside it needs a prefix and a suffix more.
LONGEST = 200

OWN = ("summary", "contact-sheet", "transforms", "transforms_train", "transforms_val", "transforms_test")
"""The names of a batch's own files; a part of one adds to each which part it is."""

_PART = re.compile(r"-\d+-of-\d+$", re.ASCII)

_FORBIDDEN = '/\\:*?"<>|#'  # Blender puts the frame's number in place of #
_UNFIT = "_"
_DEVICES = {
    "con",
    "prn",
    "aux",
    "nul",
    "conin$",
    "conout$",
    *(port + digit for port in ("com", "lpt") for digit in "0123456789"),
}


def check(place: str, name: str) -> None:
    """Refuse a name that can't be one of files.

    place : the name's place, as the sentence calls it.

    Raises InputError that says why.
    """
    if problem := _problem(name):
        raise InputError(f"{place} is {checks.quoted(name)}, which {problem}")


def made_fit(name: str) -> str:
    """The name with underscores for what no file's name may hold, and before it where that is not enough."""
    letters = [_UNFIT if c in _FORBIDDEN or unicodedata.category(c)[0] == "C" or c in "\u2028\u2029" else c for c in name]
    fit = "".join(letters).strip().rstrip(".") or _UNFIT
    fit = fit.encode()[: LONGEST // 2].decode(errors="ignore").strip().rstrip(".")
    return f"{_UNFIT}{fit}" if _problem(fit) else fit


def distinct(names: Iterable[str]) -> list[str]:
    """The names made fit, each for a file of its own: what would be one with another before it has a number, as in left_2."""
    taken: Counter[str] = Counter()
    result = []
    for name in names:
        fit = unique = made_fit(name)
        while one_file(unique) in taken:
            taken[one_file(fit)] += 1
            unique = f"{fit}_{taken[one_file(fit)]}"
        taken[one_file(unique)] += 1
        result.append(unique)
    return result


def one_file(name: str) -> str:
    """One text for all names that are one file on Windows or macOS: upper and lower case, letters composed or not."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFD", name).casefold())


def _problem(name: str) -> str | None:
    forbidden = next((character for character in name if character in _FORBIDDEN), None)
    if forbidden:
        return f"holds {forbidden}: leave it out, not every system and program takes it in the name of a file"
    if any(unicodedata.category(character)[0] == "C" or character in "\u2028\u2029" for character in name):
        return "holds a character that can't be seen: leave it out, a file's name should show all of it"
    if name != name.strip() or name.endswith("."):
        return "begins or ends with a blank or ends with a dot: leave it out, Windows does"
    if name.startswith("."):
        return "begins with a dot: leave it out, the file would be hidden"
    if unicodedata.normalize("NFKC", name.split(".")[0].rstrip()).casefold() in _DEVICES:
        return "is a device on Windows: give another"
    if _PART.sub("", one_file(name)) in OWN:
        return "is a file of the batch itself: give another"
    length = len(unicodedata.normalize("NFD", name).encode())
    if length > LONGEST:
        return f"has {length} bytes: give at most {LONGEST}, which any file system takes"
    return None
