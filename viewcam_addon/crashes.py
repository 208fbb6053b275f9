"""A process of its own for what opens a .blend in the shell: Blender can crash, and then somebody must be left who says so.

Blender's readers were not written for damaged or hostile files. The process forks before it has imported anything: the child
runs the command, and this one waits for it, with the same standard streams and the same terminal. Rejected: a handler of
SIGSEGV (no Python runs after one) and a child by exec, which starts Python twice. Where there is no fork (Windows) the system
tells of the crash, and the status is its own.
"""

import ctypes
import os
import signal
import sys

COMMANDS = ("export", "cycles", "check", "demo")
"""Those that open a .blend in their own process. A batch whose Blender is another process says so itself (render_client.py)."""

_ASKED_FOR = (signal.SIGINT, signal.SIGTERM)
_PR_SET_PDEATHSIG = 1


def survived(words: list[str]) -> int | None:
    """Fork where `words` open a .blend, and return None in the process that shall run them.

    In the other, wait for that one: end with its status, or return the number of the signal that has ended it.
    """
    if not words or words[0] not in COMMANDS or not hasattr(os, "fork"):
        return None
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        if sys.platform == "linux":  # whoever kills this command means Blender, too
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
            if os.getppid() != parent:
                os._exit(1)
        return None
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)  # the terminal has sent it to both
    signal.signal(signal.SIGTERM, lambda number, _: os.kill(child, number))
    _, status = os.waitpid(child, 0)
    if not os.WIFSIGNALED(status):
        os._exit(os.WEXITSTATUS(status))
    number = os.WTERMSIG(status)
    if number in _ASKED_FOR:
        signal.signal(number, signal.SIG_DFL)
        os.kill(parent, number)
    return number
