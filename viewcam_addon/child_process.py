"""Processes of our own beside this one: how they are started, asked and ended. There is no other way to have one.

A process is one of two kinds, and both are started as a ProcessGroup, which ends with all that it has started itself.

**It carries out what a file tells it (jobs/plan.py) to its end**: a ProcessGroup that is looked at now and then, and prints on
the way what `--log-json` tells (events.py).

**It is kept open and asked one thing after another** (ServerProcess): a dict in, a dict out. Both ends of the connection exist
before the process does, which inherits its own. So nothing has to be found, nobody else can call, and each side sees the end of
the connection as soon as the other is gone, however it went: a process whose asker was killed ends by itself. Requests and
answers are JSON; while an answer is being found, events are told (events.py), and an empty message each second is a heartbeat,
which a process that is stopped or stuck does not give.

Rejected: ending a child alone (`viewcam check` has children itself, which would trace on for minutes after it; and a signal
that the child could answer by ending them Blender does not let Python hear while it renders); standard input and output for
requests, into which Blender and libraries print; a socket with a name and a key, which waits for ever for a process that dies
before it calls; pickle, which runs what it is sent; files that appear, watched; on Windows, taskkill, which misses whoever has
lost its parent.
"""

import contextlib
import ctypes
import importlib.util
import json
import math
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from multiprocessing import connection
from pathlib import Path
from typing import Any, Self

from .errors import FullDiskError, InputError, NotModeledError, bug
from .events import Events
from .files import remove_unfinished

_PACKAGE = Path(__file__).parent
_ON_WINDOWS = sys.platform == "win32"

_EXIT_TIMEOUT = 10.0
"""Seconds for a process to end by itself."""

_HEARTBEAT = 1.0
"""Seconds between two heartbeats of a process that is finding an answer."""

HEARTBEAT_TIMEOUT = 60.0
"""Seconds without one after which a process is given up: Blender lets other threads run in all that takes long."""

START_TIMEOUT = 300.0
"""The timeout of the first heartbeat of a new process, which a busy machine may be long in starting."""

_GRACE = 1.0
"""Seconds for an answer to be finished that nobody waits for any more."""

_KINDS = {kind.__name__: kind for kind in (InputError, FullDiskError, NotModeledError)}
"""The errors that are raised here where the child raises them."""


def viewcam(*arguments: str | Path) -> list[str]:
    """The command that runs `viewcam` in a Python process of its own."""
    return [sys.executable, "-m", _PACKAGE.name, *map(str, arguments)]


def module(name: str, *arguments: str | Path) -> list[str]:
    """The command that runs a module of this package there. name : dotted, without the package's own."""
    return [sys.executable, "-m", f"{_PACKAGE.name}.{name}", *map(str, arguments)]


def environment(apart_from: str = "", **more: str) -> dict[str, str]:
    """The environment in which that process has the same modules in reach as this one.

    apart_from : a folder whose modules it shall not have.
    more : further variables.
    """
    others = [path for path in sys.path if path and not (apart_from and Path(path).is_relative_to(apart_from))]
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(_PACKAGE.parent), *others])} | more


def blender_scripts() -> str:
    """The folder, if any, that `environment` must leave out for a child which imports bpy, where this process has done so.

    Where bpy is loaded, here or in our parent, the path leads first to Blender's scripts, whose bpy is half of it.
    """
    loaded, spec = sys.modules.get("bpy"), importlib.util.find_spec("bpy")
    place = Path(getattr(loaded, "__file__", None) or (spec and spec.origin) or "")
    return str(place.parents[2]) if place.name == "__init__.py" else ""


def events_in(lines: Iterable[str | bytes]) -> Iterator[dict[str, Any]]:
    """The events among the lines that a process with --log-json has said; what Blender and libraries print is no event."""
    for line in lines:
        with contextlib.suppress(ValueError):
            event = json.loads(line)
            if isinstance(event, dict) and "event" in event:
                yield event


class ProcessGroup:
    """A process and all that it starts, which say what they have to say into a file.

    handle : an open handle of this process, which the child inherits under the same number.

    Raises OSError if the process can't be started, or the file not be written.
    """

    def __init__(self, command: Sequence[str], log: Path, variables: Mapping[str, str], handle: int | None = None) -> None:
        windows: Any = subprocess  # on Linux mypy knows nothing of what is Windows' own, here and below
        apart = {"creationflags": windows.CREATE_NO_WINDOW} if _ON_WINDOWS else {"start_new_session": True}
        if handle is not None:
            apart |= _inherited(handle)
        with open(log, "wb") as words:
            self._first = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=words, stderr=subprocess.STDOUT, env=variables, **apart
            )
        self._job = _WindowsJob(self._first) if _ON_WINDOWS else None

    def status(self) -> int | None:
        """The first process's exit status, None while it runs, negative if a signal has ended it."""
        return self._first.poll()

    def wait(self, seconds: float | None = None) -> None:
        """Wait until the first process has ended, or so many seconds."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._first.wait(seconds)

    def end(self) -> None:
        """End those that still run, and wait for the first."""
        if self._job:
            self._job.end()
            self._first.kill()  # if Windows has refused to take it into the job
        else:
            with contextlib.suppress(ProcessLookupError):  # all have ended by themselves
                os.killpg(self._first.pid, signal.SIGKILL)
        self._first.wait()


class _WindowsJob:
    """A job object: a process and all that it starts."""

    def __init__(self, process: Any) -> None:
        windows: Any = ctypes
        self._kernel32 = windows.WinDLL("kernel32")
        self._kernel32.CreateJobObjectW.restype = ctypes.c_void_p
        self._handle = ctypes.c_void_p(self._kernel32.CreateJobObjectW(None, None))
        self._kernel32.AssignProcessToJobObject(self._handle, ctypes.c_void_p(int(process._handle)))

    def end(self) -> None:
        """End those of its processes that still run, with status 1."""
        self._kernel32.TerminateJobObject(self._handle, 1)

    def __del__(self) -> None:
        self._kernel32.CloseHandle(self._handle)


def _inherited(handle: int) -> dict[str, Any]:
    """The arguments of Popen by which the child has a handle of ours."""
    if not _ON_WINDOWS:
        return {"pass_fds": (handle,)}
    windows: Any = os
    windows.set_handle_inheritable(handle, True)
    windows = subprocess
    return {"startupinfo": windows.STARTUPINFO(lpAttributeList={"handle_list": [handle]})}


class ProcessEnded(InputError):
    """The process has ended before it answered. what : the sentence without what to do."""

    def __init__(self, what: str, remedy: str = "") -> None:
        super().__init__(what + (f": {remedy}" if remedy else ""))
        self.what = what


class AnswerTimeout(InputError):
    """The answer was not there in time. Ask no more then."""


class ServerProcess:
    """The process, as the one who asks has it: it ends with `close`, or with whoever started it.

    name : its name in sentences.
    command : the command that starts it; its handle is added as the last word, for `answer`.
    log : a file for what it prints, nowhere by default.
    events : receives the events that it tells on the way; nothing does by default.

    Raises InputError if the process can't be started.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        variables: Mapping[str, str],
        log: Path = Path(os.devnull),
        events: Events | None = None,
    ) -> None:
        self._name, self._timeout, self._events = name, START_TIMEOUT, events
        self._ours, child_end = connection.Pipe()
        try:
            self._process = ProcessGroup([*command, str(child_end.fileno())], log, variables, child_end.fileno())
        except OSError as error:
            self._ours.close()
            raise InputError(f"{name} can't be started ({error.strerror or error}): check {command[0]}") from error
        finally:
            child_end.close()

    def is_there(self) -> bool:
        """True if the process still listens, as far as can be known without asking it."""
        try:
            return not self._ours.poll()  # it says nothing unasked, so what is there to read is the end
        except OSError:
            return False

    def ask(self, request: Mapping[str, Any], ends: float = math.inf) -> Any:
        """The answer of the process.

        ends : the time by which the answer must be there, of time.monotonic().

        Raises InputError with the sentence of the one that it met there. Raises OSError as the system refused it something.
        Raises ProcessEnded if it ended first, or gave no heartbeat for a minute. Ask no more then. Raises AnswerTimeout if it
        did not answer in time. It is ended then.
        """
        try:
            self._ours.send_bytes(json.dumps(request).encode())
            while "event" in (answer := self._next(ends)):
                if self._events:
                    self._events.tell(**answer)
        except (EOFError, OSError) as error:
            raise ProcessEnded(
                f"{self._name} has ended {self._how()}", "see whether there is memory enough, then try again"
            ) from error
        if "errno" in answer:
            raise OSError(answer["errno"], answer["error"])
        if "error" in answer:
            raise _KINDS[answer["kind"]](answer["error"])
        return answer["answer"]

    def close(self) -> None:
        """Let the process end, and wait until it has."""
        self._ours.close()
        self._process.wait(_EXIT_TIMEOUT)
        self._process.end()

    def __enter__(self) -> "ServerProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _next(self, ends: float) -> dict[str, Any]:
        """The next message that is no heartbeat."""
        while self._ours.poll(max(0.0, min(self._timeout, ends - time.monotonic()))):
            self._timeout = HEARTBEAT_TIMEOUT
            if message := self._ours.recv_bytes():
                return json.loads(message)
        self._process.end()
        if time.monotonic() >= ends:
            raise AnswerTimeout(f"{self._name} was ended before it had answered")
        raise ProcessEnded(
            f"{self._name} gave no sign of life for {self._timeout:g} s, and was ended", "see whether it was stopped"
        )

    def _how(self) -> str:
        self._process.wait(_EXIT_TIMEOUT)
        status = self._process.status()
        return f"with signal {-status}" if status is not None and status < 0 else f"with status {status}"


class ServerOnDemand:
    """A server process that is started with the first question, and again if it was lost.

    name : its name in sentences.
    module : a module of this package, which serves when it is run.
    events : see ServerProcess.
    """

    def __init__(self, name: str, module: str, events: Events | None = None) -> None:
        self._name, self._module, self._events = name, module, events
        self._server: ServerProcess | None = None

    def ask(self, request: Mapping[str, Any]) -> Any:
        """The answer of the process; raises as ServerProcess does."""
        if self._server is None:
            self._server = ServerProcess(self._name, module(self._module), environment(), events=self._events)
        try:
            return self._server.ask(request)
        except ProcessEnded:
            self.close()
            raise

    def close(self) -> None:
        """End the process."""
        if self._server is not None:
            self._server.close()
            self._server = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


Tell = Callable[..., None]
"""Tells an event to whoever asks: its name, and fields that JSON can hold."""


def serve(handle: str, answers: Callable[[dict[str, Any], Tell], Any], idle: float | None = None) -> None:
    """Answer what is asked, until nobody is left to ask.

    handle : the last word of this process's command.
    answers : gives the answer to a request, which JSON can hold, and may tell events meanwhile.
    idle : return as well when nothing was asked for so many seconds.

    A thread of its own listens, so that this process ends within a second of its asker also in the midst of an answer.
    """
    asked = _asked(int(handle))
    requests: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
    left = threading.Event()
    threading.Thread(target=_listen, args=(asked, requests, left), daemon=True).start()
    try:
        while (request := requests.get(timeout=idle)) is not None:
            with _sending(asked) as send:
                reply = _reply(request, answers, lambda event, send=send, **fields: send({"event": event, **fields}))
            asked.send_bytes(json.dumps(reply).encode())
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
        remove_unfinished()
        os._exit(1)  # whoever wanted this answer is gone


@contextlib.contextmanager
def _sending(asked: "connection.Connection") -> Iterator[Callable[[dict[str, Any]], None]]:
    """Give heartbeats meanwhile, and what sends a message between them."""
    done, one_at_a_time = threading.Event(), threading.Lock()

    def send(message: bytes) -> None:
        with contextlib.suppress(OSError), one_at_a_time:  # the thread that listens hears it, too
            asked.send_bytes(message)

    def beat() -> None:
        while not done.wait(_HEARTBEAT):
            send(b"")

    thread = threading.Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield lambda message: send(json.dumps(message, default=str).encode())
    finally:
        done.set()
        thread.join()


def _reply(request: dict[str, Any], answers: Callable[[dict[str, Any], Tell], Any], tell: Tell) -> dict[str, Any]:
    try:
        return {"answer": answers(request, tell)}
    except InputError as error:
        kind = type(error).__name__
        return {"error": str(error), "kind": kind if kind in _KINDS else InputError.__name__}
    except OSError as error:
        return {"error": error.strerror or str(error), "errno": error.errno}
    except Exception as error:  # the next request may be answered all the same
        return {"error": bug(error), "kind": InputError.__name__}
