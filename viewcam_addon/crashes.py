"""A process of its own for what opens a .blend in the shell: Blender can crash, and then somebody must be left who says so.

Blender's readers were not written for damaged or hostile files. The process forks before it has imported anything: the child
runs the command, and this one waits for it, with the same standard streams and the same terminal. Rejected: a handler of
SIGSEGV (no Python runs after one) and a child by exec, which starts Python twice. Where there is no fork (Windows) the system
tells of the crash, and the status is its own.
"""

import contextlib
import ctypes
import os
import signal
import sys

COMMANDS = ("export", "cycles", "check", "demo", "batch", "audit")
"""The commands that open a .blend in their own process. Of a batch, another one may do so, whose crashes served_renderer.py
tells."""

passed_on: dict[int, int] = {}
"""In a batch that is waited for: the signals by which it hears of those that the waiting process is sent → what these were.

A terminal sends a signal to both, `kill` to one. By numbers of their own, one that comes both ways is not counted as two,
the second of which ends a batch at once (jobs/interruption.py).
"""

_ASKED_FOR = (signal.SIGINT, signal.SIGTERM)
_PR_SET_PDEATHSIG = 1


def survived(words: list[str]) -> int | None:
    """Fork where `words` open a .blend, and return None in the process that shall run them.

    In the other, wait for that one: end with its status, or return the number of the signal that has ended it.
    """
    if not words or words[0] not in COMMANDS or not hasattr(os, "fork"):
        return None
    parent = os.getpid()
    is_batch = words[0] == "batch" or any(word.startswith(("--frames", "--cameras")) for word in words)
    passing: dict[int, signal.Signals] = {signal.SIGINT: signal.SIGUSR1, signal.SIGTERM: signal.SIGUSR2}
    child = os.fork()
    if child == 0:
        if sys.platform == "linux":  # whoever kills this command means Blender, too
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
            if os.getppid() != parent:
                os._exit(1)
        if is_batch:
            passed_on.update({number: meant for meant, number in passing.items()})
        return None

    def answer(number: int, _: object) -> None:
        with contextlib.suppress(ProcessLookupError):  # it had the signal as well, has ended with it and been waited for
            os.kill(child, passing[number] if is_batch else number)

    for asked in _ASKED_FOR:
        if signal.getsignal(asked) is not signal.SIG_IGN:
            signal.signal(asked, answer)
    _, status = os.waitpid(child, 0)
    if not os.WIFSIGNALED(status):
        os._exit(os.WEXITSTATUS(status))
    number = os.WTERMSIG(status)
    if is_batch:
        number = next((meant for meant, passed in passing.items() if passed == number), number)
    if number in _ASKED_FOR:
        signal.signal(number, signal.SIG_DFL)
        os.kill(parent, number)
    return number
