"""Processes of our own beside this one: how they are started, and how a whole family of them ends.

Rejected: ending a child alone. `viewcam check` has children itself, which would trace on for minutes after it; and a signal
that the child could answer by ending them, since Blender does not let Python hear it while it renders.
"""

import contextlib
import importlib.util
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

_PACKAGE = Path(__file__).parent
_ON_WINDOWS = sys.platform == "win32"


def viewcam(*arguments: str | Path) -> list[str]:
    """The command that runs `viewcam` in a Python process of its own."""
    return [sys.executable, "-m", _PACKAGE.name, *map(str, arguments)]


def module(name: str, *arguments: str | Path) -> list[str]:
    """The command that runs a module of this package there. name : dotted, without the package's own."""
    return [sys.executable, "-m", f"{_PACKAGE.name}.{name}", *map(str, arguments)]


def environment(apart_from: str = "", **more: str) -> dict[str, str]:
    """The environment in which that process has the same modules in reach as this one.

    apart_from : a folder whose modules it shall not have. more : further variables.
    """
    others = [path for path in sys.path if path and not (apart_from and Path(path).is_relative_to(apart_from))]
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(_PACKAGE.parent), *others])} | more


def blender_scripts() -> str:
    """The folder, if any, that `environment` must leave out for a child which imports bpy, where this process has done so.

    Where bpy is loaded, here or in our parent, the path leads first to Blender's scripts, whose bpy is half of it.
    """
    loaded, found = sys.modules.get("bpy"), importlib.util.find_spec("bpy")
    place = Path(getattr(loaded, "__file__", None) or (found and found.origin) or "")
    return str(place.parents[2]) if place.name == "__init__.py" else ""


class Family:
    """A process and all that it starts, which say what they have to say into a file.

    handle : of this process, which the child inherits under the same number.

    Raises
    ------
    OSError
        if the process can't be started, or the file not be written.
    """

    def __init__(self, command: Sequence[str], log: Path, variables: Mapping[str, str], handle: int | None = None) -> None:
        apart = {"creationflags": subprocess.CREATE_NO_WINDOW} if _ON_WINDOWS else {"start_new_session": True}
        if handle is not None:
            apart |= _inherited(handle)
        with open(log, "wb") as words:
            self._first = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=words, stderr=subprocess.STDOUT, env=variables, **apart
            )

    def status(self) -> int | None:
        """The first process's exit status, None while it runs, negative if a signal has ended it."""
        return self._first.poll()

    def wait(self, seconds: float | None = None) -> None:
        """Until the first process has ended, or so many seconds."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._first.wait(seconds)

    def end(self) -> None:
        """End those that still run, and wait for the first."""
        if _ON_WINDOWS:
            subprocess.run(["taskkill", "/F", "/T", "/PID", str(self._first.pid)], capture_output=True, check=False)
        else:
            with contextlib.suppress(ProcessLookupError):  # all have ended by themselves
                os.killpg(self._first.pid, signal.SIGKILL)
        self._first.wait()


def _inherited(handle: int) -> dict[str, object]:
    """What Popen must be told so that the child has a handle of ours."""
    if not _ON_WINDOWS:
        return {"pass_fds": (handle,)}
    os.set_handle_inheritable(handle, True)
    return {"startupinfo": subprocess.STARTUPINFO(lpAttributeList={"handle_list": [handle]})}
