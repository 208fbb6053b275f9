"""The shell's entry point: `viewcam`, and `python -m viewcam_addon`.

While modules are imported, Ctrl-C ends the process at once. Rejected: to catch Python's KeyboardInterrupt, which some modules
swallow and others, as NumPy, replace by an error of their own.
"""

import contextlib
import importlib
import os
import signal
import sys
from typing import NoReturn

from .crashes import survived


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
    status = main(ended_by=number)
    with contextlib.suppress(OSError):  # whoever reads our lines may have gone
        sys.stdout.flush()
        sys.stderr.flush()
    if bpy := sys.modules.get("bpy"):
        with contextlib.suppress(OSError, AttributeError):  # Blender has put something there, or is none
            os.rmdir(bpy.app.tempdir)  # its session's own, which its clean-up would remove
    os._exit(status)


if __name__ == "__main__":
    main_and_exit()
