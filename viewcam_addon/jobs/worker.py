"""The function that a worker of the cluster runs: one shot at a time, by a Blender that it keeps open from shot to shot and
batch to batch.

A worker's process is Python's alone, so that it goes on when Blender crashes, and so that Blender ends when it is killed. It
tells what it did in words that both sides have; the shot itself stands in the folder, which both sides see.
"""

import os
import signal
import threading
from pathlib import Path
from typing import Any

from ..errors import FullDiskError, InputError, message_of
from .folder import Folder, Outputs
from .job import Job
from .one import render_one
from .served_renderer import ServedRenderer


class _Blender:
    """The Blender that this process keeps, with the scene that it has open."""

    def __init__(self) -> None:
        self._scene: dict[str, Any] = {}
        self._renderer: ServedRenderer | None = None

    def renderer(self, scene: dict[str, Any]) -> ServedRenderer:
        """The Blender with the scene open; it is another one if the file, what it was made from or an option has changed."""
        if self._renderer is None or scene != self._scene:
            self.close()
            _forget_dasks_variables()
            renderer = ServedRenderer(Path(scene["blend"]), scene["trust"], scene["time_limit"])
            try:
                renderer.open()
                _refuse_other(renderer.made_from(), scene["made_from"])
            except BaseException:
                renderer.close()
                raise
            self._scene, self._renderer = scene, renderer
        return self._renderer

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None


_blender = _Blender()
_one_at_a_time = threading.Lock()  # a worker may have several threads


def render(scene: dict[str, Any], folder: str, shot: dict[str, Any], settings: str, outputs: dict[str, Any]) -> dict[str, str]:
    """Render a shot into the folder.

    scene : `blend`, `trust`, `time_limit` and `made_from`, what the batch says the file is made from.
    outputs : the fields of Outputs.

    Returns nothing if the shot is there, {"failed": sentence} or {"full": sentence} if it is not, and {"unfit": sentence} if
    no shot of this batch can be rendered here.
    """
    with _one_at_a_time:
        try:
            if not Path(folder).is_dir():  # to make it would hide that it is another machine's
                raise InputError(f"{folder} is not there: share the folder of the pictures among the machines")
            renderer = _blender.renderer(scene)
        except Exception as error:
            return {"unfit": message_of(error)}
        try:
            render_one(Job.from_json(shot), Folder(Path(folder)), renderer, settings, Outputs(**outputs))
        except FullDiskError as error:
            return {"full": str(error)}
        except Exception as error:  # told as the shot's, and the next one is tried
            return {"failed": message_of(error)}
    return {}


def dask_setup(_worker: object) -> None:
    """Start a worker of ours (it is preloaded): Ctrl-C, which the terminal sends to all, is answered by the batch alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def dask_teardown(_worker: object) -> None:
    """End a worker of ours."""
    _blender.close()


def _forget_dasks_variables() -> None:
    """Take back the variables by which Dask has its workers compute in one thread: libraries may add up to other bits there."""
    import dask

    for name in dask.config.get("distributed.nanny.pre-spawn-environ", {}):
        os.environ.pop(name, None)


def _refuse_other(here: dict[str, Any], batch: dict[str, Any]) -> None:
    """Raise InputError where the pictures would be made here from something else than the batch's."""
    differing = [key for key in sorted(here.keys() | batch.keys()) if here.get(key) != batch.get(key)]
    if differing:
        raise InputError(
            f"the pictures would be made from another {', '.join(differing)} there: "
            "give all machines the same Blender, the same extension and the same files"
        )
