"""The check of a job: does the engine render what the tracer sees?

Both sides are made from one state of the file, under one numbering of the indices, and the process beside this one compares
them (jobs/tracing.py). **Of a picture that was rendered**, the check is of its camera and geometry: Cycles renders the passes
through the very camera object that took the picture, whatever engine did, and the tracer traces the same scene with the camera
of the sidecar; of four values, their conversion to Blender's camera is checked as well. **Of a job without a picture**, it is
of the job's engine at the job's level.

Whatever the check changes (engine, samples, passes, indices where nothing has any) it restores, so that the pictures are the
same bytes with and without it. What Cycles has built serves checks and pictures alike. Rejected: a second Blender for checks
alone, with all of the scene in memory once more; and to ask Blender what has changed, as our engine does, since giving back is
a change, too.
"""

import contextlib
import dataclasses
import functools
import itertools
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import bpy

from ...comparison.sequential import TOTALS
from ...errors import InputError
from ...events import Events
from ...files import check_writable
from ...jobs.job import Job
from ...jobs.tracing import Tracing, Written
from ...pinhole import Pinhole
from ...tracer.scene import LedgerEntry, Scene, least_level, scene_file
from ...tracer.scene.film import LEVELS, SAMPLES, seeds
from .. import datablocks
from ..rendering import cycles, exr, picture_files
from ..scenes import features
from ..scenes.export import Lighting
from ..temporary_settings import numbered_indices
from . import persistent_data
from .scene_files import SceneFiles
from .stage import Stage, staged

_MOST_TOLD = 5
_AS_THE_SCENE_STANDS: dict[str, Any] = {"width": None, "height": None, "principal_point": None}


class Checker:
    """Checks jobs of one file after another; a context manager.

    tracing : the process that traces and compares.
    events : whoever is told how far it is.

    The file must stay as it is between two checks but for cameras and what jobs say.
    """

    def __init__(self, tracing: Tracing, events: Events | None = None) -> None:
        self._tracing, self._events = tracing, events
        self._ends = contextlib.ExitStack()
        self._files = self._ends.enter_context(SceneFiles())

    def check_picture(
        self, job: Job, scene: bpy.types.Scene, camera_object: bpy.types.Object, pinhole: Pinhole, stated: Pinhole | None = None
    ) -> dict[str, Any]:
        """Compare what Cycles renders through a camera, as the scene stands, with what `pinhole` sees.

        pinhole : the camera of the picture, as its sidecar has it.
        stated : the four values it was made from. Of the scene's own camera Blender chooses once more which that is: a picture
            of another one is a difference.

        Returns `passed`, `answer`, `verdict`, `not_modeled` and `figures` as Tracing.compare has them, and in `ledger` what
        both sides leave out or replace, a sentence for each of the first few.

        Raises InputError if the scene can't be exported or rendered by Cycles, or if the two can't be compared.
        """
        geometry_job = dataclasses.replace(
            job, engine="CYCLES", level=LEVELS[0], recenter=False, clay=False, device="CPU", error=None, **_AS_THE_SCENE_STANDS
        )
        image = self._files.folder / "cycles.exr"
        with numbered_indices(), staged(geometry_job, scene, camera_object, whole=True) as stage:
            export = self._files.exported(stage)
            camera = None if job.is_of_scenes_camera else camera_object
            ledger, render = export.ledger, functools.partial(cycles.render, scene, stage.view_layer, camera)
            render(image, ledger.remedies.values(), job.threads, keep=True)
            has_more = export.scene.not_modeled and not features.lacks_gas(scene)
            everything = self._files.folder / "everything.exr" if has_more else None
            if everything:
                render(everything, ledger.remedies_of_everything, job.threads, keep=True, everything=True)
        data = camera_object.evaluated_get(datablocks.depsgraph_of(scene)).data
        clip = data.clip_start, data.clip_end
        entries, path = export.scene.ledger, self._files.file_of(export.scene)
        comparison = self._tracing.compare(
            path, [image], geometry_job, pinhole, clip, stated, entries, everything=everything, may_be_empty=True
        )
        return _brief(comparison, entries)

    def check(
        self,
        job: Job,
        scene: bpy.types.Scene,
        camera_object: bpy.types.Object,
        notes: Iterable[str] = (),
        written: Written | None = None,
        keep: Path | None = None,
    ) -> dict[str, Any]:
        """Compare what the job's engine renders, as the scene stands, with what the tracer makes of the scene at a level.

        notes : sentences of the file as a whole, for the ledger.
        written : files beside the result.
        keep : a folder for scene and pictures: scene.json, cycles.exr or another engine's, of several with numbers.

        Returns as `check_picture` does, and `result`, all that --json has, `lines` for a terminal, `level`,
        with `reason` where it was chosen, and the `seconds` of both sides.

        Raises InputError as `check_picture` does.
        """
        job.refuse_unchecked()
        started = time.perf_counter()
        count = seeds(job.level or LEVELS[0], job.samples or SAMPLES)
        engine = (job.engine if job.engine in ("EEVEE", "WORKBENCH") else "CYCLES").lower()
        folder = keep or self._files.folder
        folder.mkdir(parents=True, exist_ok=True)
        tests = [folder / (f"{engine}-{i + 1}.exr" if count > 1 else f"{engine}.exr") for i in range(count)]
        everything = folder / "everything.exr"
        if keep:
            if job.scene and Path(job.scene).resolve() == (keep / "scene.json").resolve():
                raise InputError(
                    f"{job.scene} would be overwritten by the report's own: copy it, or give another report folder"
                )
            for path in (*tests, everything, *(keep / name for name in ("scene.json", "scene.npz", "reference.exr"))):
                check_writable(path)
        with numbered_indices(_numbered(job.scene)), staged(job, scene, camera_object, notes) as stage:
            everything.unlink(missing_ok=True)
            exported = stage.export()
            level = stage.level
            path = Path(job.scene) if job.scene else self._files.file_of(exported)
            if keep:
                scene_file.write(exported, keep / "scene.json")
            approved = scene_file.read(path) if job.scene else None
            leveled, ledger = dataclasses.replace(job, level=level), (approved or exported).ledger
            if level == LEVELS[0]:
                leveled = dataclasses.replace(leveled, find=None)
            camera, clip, stated = (None, None, None) if approved else (exported.camera, exported.clip, exported.stated_camera)
            if leveled.find:  # the check before ended with more samples than this one begins with
                persistent_data.drop(scene)
            rendered = traced = 0.0
            taken, total = 0, TOTALS[0]
            for number in itertools.count():
                part = _round(leveled, number, total - taken)
                begun = time.perf_counter() if number else started
                self._render(stage, exported, part, tests, everything)
                if not keep:  # the page has to be the same bytes each time
                    for file in filter(Path.exists, (*tests, everything)):
                        exr.strip(file, picture_files.is_passing)
                rendered += time.perf_counter() - begun
                sides = tests[:1] if level == LEVELS[0] else tests
                whole = everything if everything.exists() else None
                about = (camera, clip, stated, ledger, written, whole)
                comparison = self._tracing.compare(path, sides, part, *about, is_first_round=number == 0)
                traced += comparison["seconds"]
                if "undecided" not in comparison:
                    break
                self._forecast(comparison["undecided"], total, total - taken, time.perf_counter() - begun)
                taken, total = total, comparison["undecided"]["following"]
        for path in sorted(Path(written.sides).glob("*.npy")) if written and written.sides else ():
            picture_files.write_png(scene, path)
        result = {"result": comparison["result"], "lines": comparison["lines"], "level": level}
        result["seconds"] = {"rendered": rendered, "traced": traced}
        if "find" in comparison["result"]:
            comparison["result"]["find"]["seconds"] = round(time.perf_counter() - started, 3)
        if job.level == "auto":
            result["reason"] = least_level(exported)[1]
        return _brief(comparison, ledger) | result

    def both_sides(self, stage: Stage, job: Job, paths: Sequence[Path]) -> Scene:
        """The scene for the tracer, and the engine's pictures at these paths, from one state of the file."""
        exported = stage.export()
        self._render(stage, exported, job, paths)
        return exported

    def _render(self, stage: Stage, exported: Scene, job: Job, paths: Sequence[Path], everything: Path | None = None) -> None:
        """Render the engine's pictures at these paths.

        everything : a path for the picture with everything, see Stage.render; written where there is more to be seen. A
            recentered scene has none of it.
        """

        def rendering(number: int) -> None:
            if self._events:
                self._events.tell("step", name="rendering", number=number, of=max(number, len(paths)))

        lighting = Lighting(exported.lamps, exported.world, exported.film, exported.bounces)
        has_more = exported.not_modeled and job.engine not in ("EEVEE", "WORKBENCH") and not job.recenter
        has_more = has_more and not features.lacks_gas(stage.scene)
        stage.render(job, paths, lighting, rendering, keep=True, everything=everything if has_more else None)

    def _forecast(self, undecided: dict[str, Any], taken: int, latest: int, seconds: float) -> None:
        """Tell how much longer a search for a bias takes.

        taken : the number of samples so far.
        latest, seconds : the samples and the seconds of the last round.
        """
        if self._events:
            left = seconds * (undecided["expected"] - taken) / latest
            following = undecided["following"]
            self._events.tell(
                "forecast", samples=undecided["expected"], taken=taken, following=following, seconds=round(left, 1)
            )

    def __enter__(self) -> "Checker":
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()


def _round(job: Job, number: int, samples: int) -> Job:
    """A round of the search for a bias, of seeds of its own; of any other job itself.

    samples : the number of samples of this round.
    """
    if job.find is None:
        return job
    return dataclasses.replace(job, samples=samples, seed=((job.seed or 0) + number * seeds(LEVELS[-1], samples)) % 2**31)


def _numbered(scene_path: str | None) -> tuple[str, ...]:
    """The kinds of blocks of a .blend that must be numbered for its picture to be an approved scene's: what has numbers there,
    else all."""
    if scene_path is None:
        return "objects", "materials"
    objects = scene_file.read(Path(scene_path)).objects
    has_numbers = {
        "objects": any(placed.object_index for placed in objects),
        "materials": any(any(placed.material_indices) for placed in objects),
    }
    return tuple(kind for kind, has in has_numbers.items() if has)


def _brief(comparison: dict[str, Any], ledger: Sequence[LedgerEntry]) -> dict[str, Any]:
    """The part of a comparison that a sidecar keeps."""
    lacking = [f"{entry.object}: {entry.reason}" for entry in ledger if not entry.is_modeled]
    more = [f"and {len(lacking) - _MOST_TOLD} more, which viewcam check tells"] if len(lacking) > _MOST_TOLD else []
    result = {key: comparison[key] for key in ("passed", "answer", "not_modeled", "figures")}
    return {**result, "verdict": comparison["sentence"], "ledger": lacking[:_MOST_TOLD] + more}
