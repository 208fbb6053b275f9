"""A Blender that serves: in a process of its own, it holds one scene open and renders shot after shot for another process.

This is what `viewcam serve` does, which render_client.py starts; both ends of their talk are in these two files. Rejected: a
Blender for each shot (most of a small shot's time would be Blender's start and the file's loading), and Blender in a worker's
own process, which a crash of Blender would end, with all that the worker knows.
"""

import contextlib
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .. import child_process
from .folder import Outputs
from .job import Job
from .tracing import Written

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
