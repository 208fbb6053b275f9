"""The process that a terminal starts: what it prints, our lines and not what libraries print past Python, and its heap."""

import contextlib
import ctypes
import io
import os
import sys
from collections.abc import Iterator
from typing import TextIO

_MOST_HEAPS = -8  # M_ARENA_MAX


def open_closed_streams() -> None:
    """Let standard output and standard error lead nowhere, where whoever started this process has closed them."""
    for name, number in (("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, os.fdopen(number, "w"))


def copy_of(stream: int) -> TextIO:
    """Where standard output (1) or standard error (2) leads now, to write to inside `silent_libraries` as well."""
    return open(os.dup(stream), "w", encoding="utf-8", errors="backslashreplace")


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
