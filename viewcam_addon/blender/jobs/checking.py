"""The check of a shot: is the camera that its sidecar tells the one through which Blender renders?

Cycles renders the passes of geometry through the very camera object that took the picture, whatever engine did; the tracer
traces the same scene with the camera of the sidecar; and jobs/comparer.py, a process beside this one, compares the two.
So a check is about camera and geometry: not about light, nor about another engine's own rasteriser. Of a shot with the four
values, their conversion to Blender's camera is checked as well.

Whatever the check changes (engine,
samples, passes, indices where nothing has any) it restores, so that the pictures are the same bytes with and without it. What
Cycles has built serves checks and pictures alike. Rejected: a second Blender for checks alone, with all of the scene in memory
once more; and to ask Blender what has changed, as our engine does, since giving back is a change, too.
"""

import contextlib
import functools
from typing import Any

import bpy

from ...jobs.comparer import Comparer
from ...pinhole import Pinhole
from ...tracer.scene import LedgerEntry
from .. import datablocks
from ..rendering import cycles, job
from ..temporary_settings import numbered_indices, overridden
from .scene_files import SceneFiles

_MOST_TOLD = 5


class Checker:
    """Checks shots of one file after another; a context manager. threads : of Cycles and the tracer, all by default.

    The file must stay as it is between two checks but for cameras and what shots say.
    """

    def __init__(self, threads: int | None = None) -> None:
        self._threads = threads
        self._comparer = Comparer(threads)
        self._ends = contextlib.ExitStack()
        self._ends.enter_context(self._comparer)
        self._files = self._ends.enter_context(SceneFiles())

    def check(
        self,
        scene: bpy.types.Scene,
        camera_object: bpy.types.Object,
        pinhole: Pinhole,
        stated: Pinhole | None = None,
        is_scenes: bool = False,
    ) -> dict[str, Any]:
        """Compare what Cycles renders through a camera, as the scene stands, with what `pinhole` sees.

        pinhole : the camera of the picture, as its sidecar has it. stated : the four values it was made from. is_scenes :
        whether Cycles takes the camera that Blender chooses at this frame, as markers bind it, and not `camera_object`.

        Returns what Comparer.verdict does, and in `ledger` what both sides leave out or replace, a sentence for each of the
        first few.

        Raises
        ------
        InputError
            if the scene can't be exported or rendered by Cycles, or if the comparer can't compare.
        """
        layer, image = job.rendered_layer(scene), self._files.folder / "cycles.exr"
        with numbered_indices(), overridden() as overrides:
            if not scene.render.use_crop_to_border:  # the picture is of the whole frame then
                overrides.set(scene.render, "use_border", False)
            export = self._files.exported(scene, layer, camera_object)
            of = None if is_scenes else camera_object
            ledger, render = export.ledger, functools.partial(cycles.render, scene, layer, of)
            render(image, ledger.remedies.values(), self._threads, keep=True)
            names, everything = export.scene.not_modelled, None
            if names:
                everything = self._files.folder / "everything.exr"
                render(everything, ledger.remedies_of_everything, self._threads, keep=True, everything=True)
        data = camera_object.evaluated_get(datablocks.depsgraph_of(scene)).data
        clip = data.clip_start, data.clip_end
        path = self._files.file_of(export.scene)
        said = self._comparer.verdict(path, image, pinhole, clip, stated, names, everything)
        return said | {"ledger": _told(export.scene.ledger)}

    def __enter__(self) -> "Checker":
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()


def _told(ledger: tuple[LedgerEntry, ...]) -> list[str]:
    lacking = [f"{entry.object}: {entry.reason}" for entry in ledger if not entry.is_modelled]
    more = [f"and {len(lacking) - _MOST_TOLD} more, which viewcam check tells"] if len(lacking) > _MOST_TOLD else []
    return lacking[:_MOST_TOLD] + more
