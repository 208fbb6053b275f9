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
from .shot import Shot

IDLE = 120.0
"""Seconds after which a Blender that is asked for nothing ends: a farm's worker outlives the batches that it worked for."""


def serve(handle: str, opened: Callable[..., Any]) -> None:
    """Answer the ServedRenderer that started this process, until it has gone.

    handle : the last word of this process's command. opened : BlenderRenderer, or what takes its place; called with the file,
    `seed`, `threads` and `trust`.
    """
    with contextlib.ExitStack() as stack:
        child_process.serve(handle, _Served(stack, opened).answer, IDLE)


class _Served:
    def __init__(self, stack: contextlib.ExitStack, opened: Callable[..., Any]) -> None:
        self._stack, self._opened = stack, opened
        self._renderer: Any = None

    def answer(self, request: dict[str, Any]) -> Any:
        """request : {what is asked for: its arguments}."""
        ((name, arguments),) = request.items()
        return _ANSWERS[name](self, **arguments)

    def open(self, blend: str, seed: int | None, threads: int | None, trust: bool) -> None:
        self._renderer = self._stack.enter_context(self._opened(Path(blend), seed=seed, threads=threads, trust=trust))

    def render(self, shot: dict[str, Any], image: str | None, preview: str | None) -> dict[str, Any]:
        return self._renderer.render(Shot(**shot), image and Path(image), preview and Path(preview))

    def label(self, shot: dict[str, Any], picture: str, kinds: list[str], depth_steps: float) -> list[str]:
        return self._renderer.label(Shot(**shot), Path(picture), kinds, depth_steps)

    def check(self, shot: dict[str, Any]) -> dict[str, Any]:
        return self._renderer.check(Shot(**shot))

    def cameras(self) -> list[str]:
        return list(self._renderer.cameras)

    def scene_camera(self) -> str | None:
        return self._renderer.scene_camera

    def pinhole(self, camera: str | None, size: tuple[int, int] | None, frame: int | None) -> dict[str, Any]:
        return dataclasses.asdict(self._renderer.pinhole(camera, size and tuple(size), frame))

    def made_from(self) -> dict[str, Any]:
        return self._renderer.made_from()

    def problems(self, shots: list[dict[str, Any]], outputs: dict[str, Any]) -> list[str]:
        return list(self._renderer.problems([Shot(**shot) for shot in shots], Outputs(**outputs)))


_ANSWERS: dict[str, Callable[..., Any]] = {name: method for name, method in vars(_Served).items() if name[0] != "_"}
