"""The walk of a call through this package: the functions that it enters, in order, and calls from a room to one above it."""

import sys
from collections.abc import Callable
from pathlib import Path

import viewcam_addon

PACKAGE = Path(viewcam_addon.__file__).parent


def walk(action: Callable[[], object], rooms: tuple[str, ...]) -> tuple[list[str], list[str]]:
    """The functions that a call enters, as "jobs/job.py Job.to_json", and the calls upward.

    rooms : folders of the package from below; what lies in none of them counts for nothing.
    """
    entered: list[str] = []
    upward: list[str] = []
    stack: list[int | None] = [None]

    def note(frame, event, _argument):
        if event == "return" and len(stack) > 1:
            stack.pop()
        if event != "call":
            return
        path, room = Path(frame.f_code.co_filename), stack[-1]
        if PACKAGE in path.parents and path.relative_to(PACKAGE).parts[0] in rooms:
            inside = path.relative_to(PACKAGE)
            here = f"{inside.as_posix()} {frame.f_code.co_qualname}"
            room = rooms.index(inside.parts[0])
            if stack[-1] is not None and room > stack[-1]:
                upward.append(f"{entered[-1]} → {here}")
            entered.append(here)
        stack.append(room)

    sys.setprofile(note)
    try:
        action()
    finally:
        sys.setprofile(None)
    return entered, upward
