"""The first SIGINT or SIGTERM asks a batch to end after the shot, the second ends the process at once.

Python itself answers a signal between two steps of Python, which is after the shot: Blender renders in between, for minutes
perhaps. So a thread of ours hears of it right away, tells the user, and counts. Blender's own answer to SIGINT, which breaks
the render off, is replaced meanwhile, and so is Python's: a KeyboardInterrupt while bpy opens a file ends in a crash.
"""

import os
import signal
import socket
import threading
from collections import Counter
from collections.abc import Callable, Mapping
from types import MappingProxyType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Listens while its block runs; in the main thread only, since signals are the main thread's. Elsewhere it does nothing.

    number : the number of the signal that asked for the end; None until there is one.
    on_signal : called once, as on_signal(signal="SIGINT"), from another thread.
    passed_on : signals by which one process tells this one of a SIGINT or SIGTERM of its own → which; this one may have had it
        as well, so that only the second of either way is a second one.
    """

    def __init__(self, on_signal: Callable[..., None], passed_on: Mapping[int, int] = MappingProxyType({})) -> None:
        self.number: int | None = None
        self._on_signal, self._passed_on = on_signal, passed_on
        self._listens = threading.current_thread() is threading.main_thread()

    def __enter__(self) -> "Interruption":
        if self._listens:
            self._receiver, self._sender = socket.socketpair()
            self._sender.setblocking(False)
            self._meant: dict[int, int] = dict(zip(_SIGNALS, _SIGNALS, strict=True)) | dict(self._passed_on)
            self._before = [(number, signal.signal(number, _do_nothing)) for number in self._meant]
            self._wakeup_before = signal.set_wakeup_fd(self._sender.fileno(), warn_on_full_buffer=False)
            self._thread = threading.Thread(target=self._listen, daemon=True)
            self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        if self._listens:
            signal.set_wakeup_fd(self._wakeup_before)
            for number, answer in self._before:  # None is an answer that was not Python's, and can't be put back
                after = signal.SIG_IGN if number in self._passed_on else answer
                signal.signal(number, signal.SIG_DFL if after is None else after)
            self._sender.close()
            self._thread.join()
            self._receiver.close()

    def _listen(self) -> None:
        came: Counter[bool] = Counter()  # to this process, and passed on to it
        while number := int.from_bytes(self._receiver.recv(1), "big"):  # none when the sender is closed
            if number not in self._meant:
                continue
            came[number in self._passed_on] += 1
            if max(came.values()) > 1:
                os._exit(128 + self._meant[number])
            if self.number is None:
                self.number = self._meant[number]
                self._on_signal(signal=signal.Signals(self.number).name)


def _do_nothing(number: int, frame: object) -> None:
    """For a signal to wake the thread, Python must have some answer to it."""
