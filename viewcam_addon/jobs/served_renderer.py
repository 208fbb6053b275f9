"""A renderer in a process of its own: a Blender that holds one scene open and renders shot after shot, and what asks it to.

ServedRenderer is what BlenderRenderer is, without Blender in this process. The Blender is the one that VIEWCAM_BLENDER names,
with the extension installed; without it the bpy module does. One that crashes is started again, and what it was doing is done
again, a few times. There `viewcam serve` calls `serve`.

Rejected: a Blender for each shot (most of a small shot's time would be Blender's start and the file's loading), and Blender in
a worker's own process, which a crash of Blender would end, with all that the worker knows.
"""

import contextlib
import dataclasses
import importlib.util
import math
import os
import platform
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import child_process
from ..child_process import AnswerTimeout, ProcessEnded, ServerProcess
from ..errors import InputError
from ..events import Events
from ..pinhole import Pinhole
from .folder import Outputs
from .job import Job
from .tracing import Written

BLENDER = "VIEWCAM_BLENDER"
"""The variable that names the Blender."""
ATTEMPTS = 3
"""The number of Blenders that may crash in one shot until it counts as failed."""


class ServedRenderer:
    """A scene held open by a Blender in another process, which is started when it is first needed. See BlenderRenderer.

    blend : the file.
    trust : see Job.
    program : None, since this process is no Blender.
    time_limit : the seconds that a shot may take, rendered, labeled and checked, once the file is open.
    events : receives events that say how far a check is.

    Every method raises InputError, also if that Blender can't be started or ends again and again, and OSError where it could
    not write.
    """

    def __init__(self, blend: Path, trust: bool = False, time_limit: float | None = None, events: Events | None = None) -> None:
        self.blend, self.program = blend, None
        self._opening = {"open": {"blend": str(blend), "trust": trust}}
        self._server: ServerProcess | None = None
        self._limit, self._ends, self._events = time_limit, math.inf, events
        self._rendering: dict[str, Any] = {}

    def open(self) -> None:
        """Start the Blender and open the file, unless that is done."""
        self._ask()

    def render(self, shot: Job, image: Path | None, preview: Path | None) -> dict[str, Any]:
        paths = {"image": image and str(image), "preview": preview and str(preview)}
        self._rendering = {"render": {"shot": shot.to_json(), **paths}}
        return self._ask(self._rendering)

    def label(self, shot: Job, picture: Path, kinds: Sequence[str], depth_steps: float) -> list[str]:
        request = {"picture": str(picture), "kinds": list(kinds), "depth_steps": depth_steps}
        return self._ask(self._rendering, {"label": {"shot": shot.to_json(), **request}})

    def check(
        self, job: Job, has_picture: bool = True, written: Written | None = None, keep: Path | None = None
    ) -> dict[str, Any]:
        files = {"written": dataclasses.asdict(written or Written()), "keep": keep and str(keep)}
        request = {"check": {"job": job.to_json(), "has_picture": has_picture, **files}}
        return self._ask(self._rendering, request) if has_picture else self._ask(request)

    @property
    def cameras(self) -> tuple[str, ...]:
        return tuple(self._ask({"cameras": {}}))

    @property
    def scene_camera(self) -> str | None:
        return self._ask({"scene_camera": {}})

    def pinhole(self, camera: str | None, size: tuple[int, int] | None, frame: int | None) -> Pinhole:
        return Pinhole(**self._ask({"pinhole": {"camera": camera, "size": size, "frame": frame}}))

    def made_from(self) -> dict[str, Any]:
        return self._ask({"made_from": {}})

    def problems(self, shots: Iterable[Job], outputs: Outputs | None = None) -> tuple[str, ...]:
        records = [shot.to_json() for shot in shots]
        return tuple(self._ask({"problems": {"shots": records, "outputs": dataclasses.asdict(outputs or Outputs())}}))

    def close(self) -> None:
        """End the Blender."""
        if self._server is not None:
            self._server.close()
            self._server = None

    def __enter__(self) -> "ServedRenderer":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(self, *requests: dict[str, Any]) -> Any:
        """The answer to the last of the requests; those before it are repeated to a Blender that is new."""
        for attempt in range(1, ATTEMPTS + 1):
            try:
                return self._answer(requests)
            except ProcessEnded as gone:
                self.close()
                if attempt == ATTEMPTS:
                    raise InputError(f"{ATTEMPTS} times in a row {gone}") from gone
        raise AssertionError("unreachable")

    def _answer(self, requests: tuple[dict[str, Any], ...]) -> Any:
        if self._server is not None and not self._server.is_there():  # it was idle for long
            self.close()
        if self._server is None:
            self._start()
        else:
            requests = requests[-1:]
        answer = None
        for request in requests:
            if "render" in request:
                self._ends = time.monotonic() + self._limit if self._limit else math.inf
            try:
                assert self._server is not None
                answer = self._server.ask(request, self._ends if request.keys() & {"render", "label", "check"} else math.inf)
            except AnswerTimeout as late:
                self.close()
                limit = f"the shot took longer than the time limit of {self._limit:g} s, and its Blender was ended"
                raise InputError(f"{limit}: give --time-limit more, or the shot fewer samples") from late
        return answer

    def _start(self) -> None:
        name, command, variables = _blender()
        self._server = ServerProcess(name, command, variables, events=self._events)
        try:
            self._server.ask(self._opening)
        except ProcessEnded as gone:
            raise ProcessEnded(
                f"{gone.what} as it opened {self.blend}: see that the file is whole, that this is Blender 4.2 or newer with "
                "the extension Virtual Pinhole, and that there is memory enough"
            ) from gone
        except InputError:
            self.close()
            raise


def _blender() -> tuple[str, list[str], Mapping[str, str]]:
    """The name of the Blender in sentences, the command that makes it serve, and its variables."""
    program = os.environ.get(BLENDER)
    if program:
        return program, [program, "-b", "--disable-autoexec", "--command", "viewcam", "serve"], os.environ
    if importlib.util.find_spec("bpy") is None:
        raise InputError(f"there is no Blender on {platform.node()}: name one in {BLENDER}, or pip install bpy")
    return "Blender", child_process.viewcam("serve"), child_process.environment(apart_from=child_process.blender_scripts())


IDLE = 120.0
"""Seconds after which a Blender that is asked for nothing ends: a farm's worker outlives the batches that it worked for."""


def serve(handle: str, opened: Callable[..., Any]) -> None:
    """Answer the ServedRenderer that started this process, until it has gone.

    handle : the last word of this process's command.
    opened : BlenderRenderer, or what takes its place; called with the file, `trust` and whoever is told events.
    """
    with contextlib.ExitStack() as stack:
        child_process.serve(handle, _Served(stack, opened).answer, IDLE)


class _Asker:
    """Whoever asks at the moment, to be told events."""

    tell: child_process.Tell


class _Served:
    def __init__(self, stack: contextlib.ExitStack, opened: Callable[..., Any]) -> None:
        self._stack, self._opened = stack, opened
        self._renderer: Any = None
        self._events = _Asker()

    def answer(self, request: dict[str, Any], tell: child_process.Tell) -> Any:
        """The answer to one request of the client.

        request : {what is asked for: its arguments}.
        """
        ((name, arguments),) = request.items()
        self._events.tell = tell
        return _ANSWERS[name](self, **arguments)

    def open(self, blend: str, trust: bool) -> None:
        self._renderer = self._stack.enter_context(self._opened(Path(blend), trust, self._events))

    def render(self, shot: dict[str, Any], image: str | None, preview: str | None) -> dict[str, Any]:
        return self._renderer.render(Job.from_json(shot), image and Path(image), preview and Path(preview))

    def label(self, shot: dict[str, Any], picture: str, kinds: list[str], depth_steps: float) -> list[str]:
        return self._renderer.label(Job.from_json(shot), Path(picture), kinds, depth_steps)

    def check(self, job: dict[str, Any], has_picture: bool, written: dict[str, Any], keep: str | None) -> dict[str, Any]:
        return self._renderer.check(Job.from_json(job), has_picture, Written(**written), keep and Path(keep))

    def cameras(self) -> list[str]:
        return list(self._renderer.cameras)

    def scene_camera(self) -> str | None:
        return self._renderer.scene_camera

    def pinhole(self, camera: str | None, size: tuple[int, int] | None, frame: int | None) -> dict[str, Any]:
        return dataclasses.asdict(self._renderer.pinhole(camera, size and tuple(size), frame))

    def made_from(self) -> dict[str, Any]:
        return self._renderer.made_from()

    def problems(self, shots: list[dict[str, Any]], outputs: dict[str, Any]) -> list[str]:
        return list(self._renderer.problems([Job.from_json(shot) for shot in shots], Outputs(**outputs)))


_ANSWERS: dict[str, Callable[..., Any]] = {name: method for name, method in vars(_Served).items() if name[0] != "_"}
