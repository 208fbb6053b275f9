"""The shell's entry point: `viewcam`, and `python -m viewcam_addon`.

While modules are imported, Ctrl-C ends the process at once. Rejected: to catch Python's KeyboardInterrupt, which some modules
swallow and others, as NumPy, replace by an error of their own. So it does where Blender is a module of the process, which may
render for hours before Python hears of it; then what is half written goes first.
"""

import contextlib
import importlib
import os
import shutil
import signal
import sys
from signal import Signals
from typing import NoReturn

from .crashes import COMMANDS, survived


def main_and_exit() -> NoReturn:
    """Run the command and end this process with its exit status.

    Leaves without Python's clean-up: all files are written, and to take a large scene apart takes a tenth of a second. Where
    Blender is a module of this process, bpy 4.2 crashes in it and 4.5 hangs, after properties with `update=` were registered.
    """
    answer = signal.getsignal(signal.SIGINT)
    if answer is signal.default_int_handler:  # a shell lets those that it starts in the background ignore it
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    number = survived(sys.argv[1:])
    from . import commands
    from .cli import main
    from .terminal import open_streams, share_one_heap

    if (command := next(iter(sys.argv[1:]), "")) in commands.names():
        importlib.import_module(f".commands.{command}", __package__)
    signal.signal(signal.SIGINT, answer)
    open_streams()
    share_one_heap()
    with contextlib.ExitStack() as ends:
        if command in COMMANDS and answer is not signal.SIG_IGN:
            from .jobs.interruption import Interruption

            ends.enter_context(Interruption(_end_at_once))
        status = main(ended_by=number)
    with contextlib.suppress(OSError):  # whoever reads our lines may have gone
        sys.stdout.flush()
        sys.stderr.flush()
    if bpy := sys.modules.get("bpy"):
        with contextlib.suppress(OSError, AttributeError):  # Blender has put something there, or is none
            os.rmdir(bpy.app.tempdir)  # its session's own, which its clean-up would remove
    os._exit(status)


def _end_at_once(signal: str) -> NoReturn:
    """End this process as the signal of this name asks for, from another thread than the one that works."""
    from .files import remove_unfinished

    remove_unfinished()
    if bpy := sys.modules.get("bpy"):
        with contextlib.suppress(AttributeError):  # it is being loaded
            shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    os._exit(128 + Signals[signal])


if __name__ == "__main__":
    main_and_exit()
