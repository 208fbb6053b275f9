"""The process that a terminal starts: what it prints, our lines and not what libraries print past Python, and its heap.

Names come from files, and files from strangers: a name may hold what moves a terminal's cursor, ends the line or turns the
direction of the text, and so write a verdict of its own. All that this project prints goes through `plain`, by `say` or by
events.py.
"""

import contextlib
import ctypes
import io
import os
import sys
import unicodedata
from collections.abc import Iterator
from typing import TextIO

_MOST_HEAPS = -8  # M_ARENA_MAX


def open_streams() -> None:
    """Let standard output and standard error take whatever is printed.

    They lead nowhere where whoever started this process has closed them. What their encoding has no character for, as Windows'
    code pages have none for most, is written as an escape of Python's.
    """
    for name, number in (("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, os.fdopen(number, "w"))
        elif isinstance(stream := getattr(sys, name), io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def plain(text: str) -> str:
    """The text on one line of characters that only show themselves; all others are written as escapes of Python's.

    Kept are letters, marks, digits, punctuation, symbols and spaces. Escaped are line ends, controls and formats (among them
    all that changes the direction of text), halves of characters, and what is private or not assigned.
    """
    return text if text.isprintable() else "".join(map(_plain, text))


def _plain(character: str) -> str:
    shows = character.isprintable() or unicodedata.category(character) == "Zs"
    return character if shows else character.encode("unicode_escape").decode("ascii")


def say(*lines: str) -> None:
    """Print the lines to standard output, each of them plain, and see that they are there."""
    with contextlib.suppress(OSError):  # nobody listens any more: that ends no command
        print(*map(plain, lines), sep="\n", flush=True)


def copy_of(stream: int) -> TextIO:
    """A copy of standard output (1) or standard error (2) as it leads now, to write to inside `silent_libraries` as well."""
    encoding = getattr(sys.stdout if stream == 1 else sys.stderr, "encoding", None) or "utf-8"
    return open(os.dup(stream), "w", encoding=encoding, errors="backslashreplace")


@contextlib.contextmanager
def silent_libraries() -> Iterator[None]:
    """Send to nowhere what is printed inside the block, by Python or by C, to standard output and standard error.

    OpenEXR prints what it raises as well; Blender prints a line for each file, frame and step.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(stream) for stream in (1, 2)]
    try:
        with contextlib.redirect_stdout(io.StringIO()), open(os.devnull, "w") as nowhere:
            for stream in (1, 2):
                os.dup2(nowhere.fileno(), stream)
            yield
    finally:
        for stream, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, stream)
            os.close(copy)


def share_one_heap() -> None:
    """Let all threads of this process take memory from one heap, where the C library is Linux's.

    Each would else get one of its own, whose pages are asked for anew while those lie idle that other threads gave back: that
    is a tenth of the time from a fresh process to a picture. For a process of our own only, since it concerns all of it.
    """
    if sys.platform == "linux" and (mallopt := getattr(ctypes.CDLL(None), "mallopt", None)):
        mallopt(_MOST_HEAPS, 1)
