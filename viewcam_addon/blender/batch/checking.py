"""The check of a shot: is the camera that its sidecar tells the one through which Blender renders?

Cycles renders the passes of geometry through the very camera object that took the picture, whatever engine did; the tracer
traces the same scene with the camera of the sidecar; and batch/comparer.py, a process beside this one, compares the two.
So a check is about camera and geometry: not about light, nor about another engine's own rasteriser. Of a shot with the four
values, their conversion to Blender's camera is checked as well.

The scene is exported anew for another frame, camera object or size of the picture, and for each shot where more may change: in
a batch nothing else does. It is written when it is another than the last one. Whatever the check changes (engine,
samples, passes, indices where nothing has any) it restores, so that the pictures are the same bytes with and without it. What
Cycles has built serves checks and pictures alike. Rejected: a second Blender for checks alone, with all of the scene in memory
once more; and to ask Blender what has changed, as our engine does, since giving back is a change, too.
"""

import contextlib
import functools
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy

from ...batch.comparer import Comparer
from ...pinhole import Pinhole
from ...tracer.scene import LedgerEntry, Scene, scene_file
from ...tracer.scene.sameness import same_things
from .. import datablocks
from ..rendering import cycles, job
from ..scenes.export import export_scene
from ..scenes.ledger import Ledger, Remedy
from ..temporary_settings import numbered_indices, overridden
from . import persistent_data

_MOST_TOLD = 5


@dataclass(frozen=True, eq=False)
class _Export:
    """state : of Blender, when the scene was exported. remedies : for Cycles (ledger.py)."""

    state: tuple
    scene: Scene
    remedies: tuple[Remedy, ...]


class Checker:
    """Checks shots of one file after another; a context manager. threads : of Cycles and the tracer, all by default.

    The file must stay as it is between two checks but for cameras and what shots say.
    """

    def __init__(self, threads: int | None = None) -> None:
        self._threads = threads
        self._comparer = Comparer(threads)
        self._ends = contextlib.ExitStack()
        self._ends.enter_context(self._comparer)
        self._export: _Export | None = None
        self._written = 0
        self._written_scene: Scene | None = None

    def check(
        self, scene: bpy.types.Scene, camera_object: bpy.types.Object, pinhole: Pinhole, stated: Pinhole | None = None
    ) -> dict[str, Any]:
        """Compare what Cycles renders through a camera, as the scene stands, with what `pinhole` sees.

        pinhole : the camera of the picture, as its sidecar has it. stated : the four values it was made from.

        Returns `passed`, `verdict` and `figures` as Comparer.verdict does, and `not_modelled`: what both sides leave out, the
        first few of it, a sentence each.

        Raises
        ------
        InputError
            if the scene can't be exported or rendered by Cycles, or if the comparer can't compare.
        """
        layer, image = job.rendered_layer(scene), self._folder / "cycles.exr"
        with numbered_indices(), overridden() as overrides:
            if not scene.render.use_crop_to_border:  # the picture is of the whole frame then
                overrides.set(scene.render, "use_border", False)
            export = self._exported(scene, layer, camera_object)
            cycles.render(scene, layer, camera_object, image, export.remedies, self._threads, keep=True)
        data = camera_object.evaluated_get(datablocks.depsgraph_of(scene)).data
        clip = data.clip_start, data.clip_end
        said = self._comparer.verdict(self._file_of(export.scene), image, pinhole, clip, stated)
        return said | {"not_modelled": _told(export.scene.ledger)}

    @functools.cached_property
    def _folder(self) -> Path:
        """A temporary one, made with the first check: most batches have none."""
        made = tempfile.TemporaryDirectory(prefix="viewcam-", ignore_cleanup_errors=True)
        return Path(self._ends.enter_context(made))

    @functools.cached_property
    def _changes(self) -> bool:
        return persistent_data.changes_between_renders()

    def _exported(self, scene: bpy.types.Scene, layer: bpy.types.ViewLayer, camera_object: bpy.types.Object) -> _Export:
        """The scene as it is now, from the last shot if it can be no other."""
        state = scene.frame_current, scene.frame_subframe, camera_object.name, datablocks.frame_of(scene)
        if self._export is None or self._export.state != state or self._changes:
            ledger = Ledger()
            seen = export_scene(scene, layer, camera_object, ledger)
            self._export = _Export(state, seen, tuple(ledger.remedies.values()))
        return self._export

    def _file_of(self, scene: Scene) -> Path:
        """A file of the scene, the last one if the same things are in it."""
        if self._written_scene is None or not same_things(scene, self._written_scene):
            self._path(self._written).unlink(missing_ok=True)
            self._path(self._written).with_suffix(".npz").unlink(missing_ok=True)
            self._written += 1
            scene_file.write(replace(scene, ledger=()), self._path(self._written))
            self._written_scene = scene
        return self._path(self._written)

    def _path(self, number: int) -> Path:
        return self._folder / f"scene-{number}.json"

    def __enter__(self) -> "Checker":
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()


def _told(ledger: tuple[LedgerEntry, ...]) -> list[str]:
    lacking = [f"{entry.object}: {entry.reason}" for entry in ledger if entry.status != "exported"]
    more = [f"and {len(lacking) - _MOST_TOLD} more, which viewcam check tells"] if len(lacking) > _MOST_TOLD else []
    return lacking[:_MOST_TOLD] + more
