"""A process of our own that is kept open and asked one thing after another: a dict in, a dict out.

Both ends of the connection exist before the process does, which inherits its own. So nothing has to be found, nobody else can
call, and each side sees the end of the connection as soon as the other is gone, however it went: a process whose asker was
killed ends by itself. Requests and answers are JSON; while an answer is being found, an
empty message each second is a sign of life, which a process that is stopped or stuck does not give. Rejected: standard input
and output, into which Blender and libraries print; a socket with a name and a key, which waits for ever for a process that dies
before it calls; pickle, which runs what it is sent.
"""

import contextlib
import json
import math
import os
import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from multiprocessing import connection
from pathlib import Path
from typing import Any

from ..children import Family
from ..errors import FullDiskError, InputError, NotModelledError, bug

_PATIENCE = 10.0
"""Seconds for a partner to end by itself."""

_BEAT = 1.0
"""Seconds between two signs of life of a process that is finding an answer."""

SILENCE = 60.0
"""Seconds without one after which a process is given up: Blender lets other threads run in all that takes long."""

STARTED_WITHIN = 300.0
"""The same for the first sign of life of a new process, which a busy machine may be long in starting."""

_GRACE = 1.0
"""Seconds for an answer to be finished that nobody waits for any more."""

_KINDS = {kind.__name__: kind for kind in (InputError, FullDiskError, NotModelledError)}
"""What is raised there is raised here."""


class Gone(InputError):
    """The process has ended before it answered. what : the sentence without what to do."""

    def __init__(self, what: str, remedy: str = "") -> None:
        super().__init__(what + (f": {remedy}" if remedy else ""))
        self.what = what


class TooLong(InputError):
    """The answer was not there in time. Ask no more then."""


class Partner:
    """The process, as the one who asks has it: it ends with `close`, or with whoever started it.

    name : what sentences call it. command : its handle is added as the last word, for `answer`. log : a file for what it
    prints, nowhere by default.

    Raises
    ------
    InputError
        if the process can't be started.
    """

    def __init__(self, name: str, command: Sequence[str], variables: Mapping[str, str], log: Path = Path(os.devnull)) -> None:
        self._name, self._patience = name, STARTED_WITHIN
        self._ours, theirs = connection.Pipe()
        try:
            self._family = Family([*command, str(theirs.fileno())], log, variables, theirs.fileno())
        except OSError as error:
            self._ours.close()
            raise InputError(f"{name} can't be started ({error.strerror or error}): check {command[0]}") from error
        finally:
            theirs.close()

    def is_there(self) -> bool:
        """Whether the process still listens, as far as can be known without asking it."""
        try:
            return not self._ours.poll()  # it says nothing unasked, so what is there to read is the end
        except OSError:
            return False

    def ask(self, request: Mapping[str, Any], ends: float = math.inf) -> Any:
        """What the process answers. ends : when the answer must be there, by time.monotonic().

        Raises
        ------
        InputError
            with the sentence of the one that it met there.
        OSError
            as the system refused it something.
        Gone
            if it ended first, or gave no sign of life for a minute. Ask no more then.
        TooLong
            if it did not answer in time. It is ended then.
        """
        try:
            self._ours.send_bytes(json.dumps(request).encode())
            while not (message := self._next(ends)):
                continue
            answer = json.loads(message)
        except (EOFError, OSError) as error:
            raise Gone(f"{self._name} has ended {self._how()}", "see whether there is memory enough, then try again") from error
        if "errno" in answer:
            raise OSError(answer["errno"], answer["error"])
        if "error" in answer:
            raise _KINDS[answer["kind"]](answer["error"])
        return answer["answer"]

    def close(self) -> None:
        """Let the process end, and wait until it has."""
        self._ours.close()
        self._family.wait(_PATIENCE)
        self._family.end()

    def __enter__(self) -> "Partner":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _next(self, ends: float) -> bytes:
        """The next message."""
        if self._ours.poll(max(0.0, min(self._patience, ends - time.monotonic()))):
            self._patience = SILENCE
            return self._ours.recv_bytes()
        self._family.end()
        if time.monotonic() >= ends:
            raise TooLong(f"{self._name} was ended before it had answered")
        raise Gone(f"{self._name} gave no sign of life for {self._patience:g} s, and was ended", "see whether it was stopped")

    def _how(self) -> str:
        self._family.wait(_PATIENCE)
        status = self._family.status()
        return f"with signal {-status}" if status is not None and status < 0 else f"with status {status}"


def answer(handle: str, answers: Callable[[dict[str, Any]], Any], idle: float | None = None) -> None:
    """Answer what is asked, until nobody is left to ask.

    handle : the last word of this process's command. answers : gives the answer to a request, which JSON can hold.
    idle : return as well when nothing was asked for so many seconds.

    A thread of its own listens, so that this process ends within a second of its asker also in the midst of an answer.
    """
    asked = _asked(int(handle))
    requests: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
    left = threading.Event()
    threading.Thread(target=_listen, args=(asked, requests, left), daemon=True).start()
    try:
        while (request := requests.get(timeout=idle)) is not None:
            with _beating(asked):
                reply = json.dumps(_reply(request, answers)).encode()
            asked.send_bytes(reply)
    except (queue.Empty, OSError):  # nobody asks any more, nobody hears it any more
        return
    finally:
        left.set()


def _asked(number: int) -> "connection.Connection":
    """Our end of the connection."""
    if sys.platform == "win32":
        return connection.PipeConnection(number)
    os.set_inheritable(number, False)  # else our own children would keep it open
    return connection.Connection(number)


def _listen(asked: "connection.Connection", requests: queue.SimpleQueue, left: threading.Event) -> None:
    try:
        while True:
            requests.put(json.loads(asked.recv_bytes()))
    except (EOFError, OSError):
        requests.put(None)
    if not left.wait(_GRACE):
        os._exit(1)  # whoever wanted this answer is gone


@contextlib.contextmanager
def _beating(asked: "connection.Connection") -> Iterator[None]:
    """Give signs of life meanwhile."""
    done = threading.Event()

    def beat() -> None:
        with contextlib.suppress(OSError):  # the thread that listens hears it, too
            while not done.wait(_BEAT):
                asked.send_bytes(b"")

    beats = threading.Thread(target=beat, daemon=True)
    beats.start()
    try:
        yield
    finally:
        done.set()
        beats.join()


def _reply(request: dict[str, Any], answers: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
    try:
        return {"answer": answers(request)}
    except InputError as error:
        kind = type(error).__name__
        return {"error": str(error), "kind": kind if kind in _KINDS else InputError.__name__}
    except OSError as error:
        return {"error": error.strerror or str(error), "errno": error.errno}
    except Exception as error:  # the next request may be answered all the same
        return {"error": bug(error), "kind": InputError.__name__}
