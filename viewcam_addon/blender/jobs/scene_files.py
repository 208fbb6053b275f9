"""The scene as files for processes beside this one, which check and label a batch's shots.

It is exported anew for another frame, camera object or size of the picture, and for each shot where more may change: in a batch
nothing else does. It is written where no file holds the same things yet.
"""

import contextlib
import functools
from dataclasses import dataclass, fields, replace
from pathlib import Path

from ...files import temporary_folder
from ...tracer.scene import Scene, same, scene_file
from .. import datablocks
from ..scenes.export import export_scene
from ..scenes.ledger import Ledger
from . import persistent_data
from .stage import Stage

_THINGS = [each.name for each in fields(Scene) if each.name not in ("camera", "stated_camera", "clip", "ledger")]


@dataclass(frozen=True, eq=False)
class Export:
    """An exported scene, as long as Blender's state is the same.

    state : Blender's state when the scene was exported.
    ledger : the export's ledger, with the remedies for Cycles.
    """

    state: tuple
    scene: Scene
    ledger: Ledger


class SceneFiles:
    """Scenes of one file, the last few of them kept; a context manager.

    most : the number of scenes to keep.

    The file must stay as it is between two exports but for cameras and what shots say.
    """

    def __init__(self, most: int = 1) -> None:
        self._most = most
        self._ends = contextlib.ExitStack()
        self._exports: list[Export] = []
        self._files: list[tuple[Scene, Path]] = []
        self._written = 0

    def exported(self, stage: Stage) -> Export:
        """The geometry of the scene as it is now, from a former shot if it can be no other."""
        scene, camera_object = stage.scene, stage.camera
        state = scene.frame_current, scene.frame_subframe, camera_object.name, datablocks.frame_of(scene)
        if self._changes:
            self._exports.clear()
        result = next((each for each in self._exports if each.state == state), None)
        if result is None:
            seen = export_scene(scene, stage.view_layer, camera_object, stage.ledger)
            result = Export(state, seen, stage.ledger)
            self._exports = [*self._exports[-self._most + 1 :], result] if self._most > 1 else [result]
        return result

    def file_of(self, scene: Scene) -> Path:
        """A file of the scene, one that is there if the same things are in it; cameras don't count."""
        for known, path in self._files:
            if all(same(getattr(scene, name), getattr(known, name)) for name in _THINGS):
                return path
        while len(self._files) >= self._most:
            _, former = self._files.pop(0)
            former.unlink(missing_ok=True)
            former.with_suffix(".npz").unlink(missing_ok=True)
        self._written += 1
        path = self.folder / f"scene-{self._written}.json"
        scene_file.write(replace(scene, ledger=()), path)
        self._files.append((scene, path))
        return path

    @functools.cached_property
    def folder(self) -> Path:
        """The files' folder, a temporary one, made when it is first needed: most batches need none."""
        return self._ends.enter_context(temporary_folder())

    @functools.cached_property
    def _changes(self) -> bool:
        return persistent_data.changes_between_renders()

    def __enter__(self) -> "SceneFiles":
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()
