"""The labeller of a batch's shots: traces what is true of each picture, and writes it.

A process of its own, kept open, as the comparer is, and for the same reasons: no second copy of OpenEXR in Blender's process,
and hierarchies that are kept from shot to shot.

    python -m viewcam_addon.jobs.labeller HANDLE
"""

import dataclasses
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import child_process
from ..pinhole import Pinhole
from .comparer import TracingServer

if TYPE_CHECKING:
    from ..tracer.scene import Scene

_MOST_SCENES = 4
"""Kept: a frame, its neighbours, and the one that comes next."""


class Labeller(TracingServer):
    name = "labeller"

    @staticmethod
    def frame(scene: Path, camera: Pinhole, clip: tuple[float, float]) -> dict[str, Any]:
        """What is seen at a frame. scene : a file; the same path is the same scene. camera, clip : whatever the file's are."""
        return {"scene": str(scene), "camera": dataclasses.asdict(camera), "clip": list(clip)}

    def write(self, frames: Mapping[str, dict[str, Any]], picture: Path, kinds: Sequence[str], depth_steps: float) -> list[str]:
        """Write the labels beside a picture (labels.files); the names of the files.

        frames : "here", and of flow "previous" and "next" as well.

        Raises
        ------
        InputError
            if scenes can't be read or labels not be written, there is no OpenEXR, or the process ended first.
        """
        request = {"frames": dict(frames), "picture": str(picture), "kinds": list(kinds), "depth_steps": depth_steps}
        return self.ask(request)["files"]


class _Scenes:
    """What the process keeps from question to question."""

    def __init__(self) -> None:
        from ..labels.surfaces import Keepers

        self._files: dict[str, Any] = {}
        self._keepers = Keepers(_MOST_SCENES)

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        from ..labels import files
        from ..labels.scene_labels import label

        frames = {name: self._seen(**frame) for name, frame in request["frames"].items()}
        labels = label(frames.pop("here"), request["kinds"], **frames, threads=request["threads"], keepers=self._keepers)
        written = files.write(Path(request["picture"]), labels, request["depth_steps"])
        return {"files": [path.name for path in written]}

    def _seen(self, scene: str, camera: dict[str, Any], clip: list[float]) -> "Scene":
        """A scene from a camera. scene : its file."""
        from ..tracer.scene import scene_file

        self._files = {path: read for path, read in self._files.items() if path == scene or Path(path).exists()}
        if scene not in self._files:
            self._files[scene] = scene_file.read(scene)
        return dataclasses.replace(self._files[scene], camera=Pinhole(**camera), clip=tuple(clip))


if __name__ == "__main__":
    child_process.serve(sys.argv[1], _Scenes().answer)
