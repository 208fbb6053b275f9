"""A scene as one job wants it, for as long as its two sides are made: the scene for the tracer, and an engine's pictures.

Frame, camera and size are set before (job_settings.py). Here are what only a comparison needs: one material on everything, the
least level, an origin at the eye, indices where nothing has any, and the ledger of what neither side models.
"""

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy

from ...jobs.job import Job
from ...tracer.scene import LedgerEntry, Scene
from ...tracer.scene.film import LEVELS, SAMPLES
from ..rendering import cycles, rasters
from ..scenes import materials, recentering
from ..scenes.export import Lighting, export_scene, level_needed
from ..scenes.ledger import Ledger
from ..temporary_settings import overridden
from . import persistent_data


@dataclass(frozen=True)
class Stage:
    """A scene to be exported and rendered.

    camera : the one that is seen through.
    is_chosen : true to make it Blender's camera; else Blender chooses its own once more, and another one is a difference.
    level : the level at which it is modeled, never "auto".
    ledger : the ledger of what is on this stage.
    origin, names, file_ledger : the file's origin, names and ledger, of a recentered stage (recentering.py).
    """

    scene: bpy.types.Scene
    view_layer: bpy.types.ViewLayer
    camera: bpy.types.Object
    is_chosen: bool
    level: str = LEVELS[0]
    ledger: Ledger = field(default_factory=Ledger)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    names: dict[str, str] = field(default_factory=dict)
    file_ledger: Ledger | None = None

    @property
    def is_lit(self) -> bool:
        return self.level != LEVELS[0]

    def entries(self, strict: bool) -> tuple[LedgerEntry, ...]:
        """The ledger's entries of the file; NotModeledError if `strict` and anything is approximated or left out."""
        ledger = self.ledger
        if self.file_ledger:
            self.file_ledger.add(self.ledger, self.names)
            ledger = self.file_ledger
        if strict:
            ledger.check_strict()
        return ledger.entries()

    def export(self, strict: bool = False) -> Scene:
        """The tracer's scene. Raises as export_scene does, and NotModeledError as `entries` does."""
        scene = export_scene(self.scene, self.view_layer, self.camera, self.ledger, self.is_lit)
        objects = recentering.as_in_file(scene.objects, self.names) if self.names else scene.objects
        return replace(scene, objects=objects, origin=self.origin, ledger=self.entries(strict))

    def render(
        self,
        job: Job,
        paths: Sequence[str | os.PathLike[str]],
        light: Lighting | None,
        rendering: Callable[[int], None] = lambda number: None,
        keep: bool = False,
        everything: str | os.PathLike[str] | None = None,
    ) -> None:
        """Write the pictures of the job's engine.

        paths : the files of the pictures. Several share the samples, and their seeds count from the job's.
        light : the exported light, of a stage that is lit.
        rendering : called with the number of each picture, from 1 on, before it is rendered.
        keep : see cycles.render.
        everything : a file for one more picture of Cycles, like the first but with all that has a stand-in, or is left out, in
            the others.
        """
        camera = self.camera if self.is_chosen or self.file_ledger else None
        share = max((job.samples or SAMPLES) // len(paths), 1)
        # Particles are others in the evaluated scene that Blender keeps.
        kept = keep and not self.file_ledger and not persistent_data.is_simulated()
        with overridden() as lasting:
            for number, path in enumerate([*paths, *([everything] if everything is not None else [])]):
                rendering(number + 1)
                is_of_everything, seed = number == len(paths), number % len(paths)
                settings = None
                if self.is_lit and light:
                    bounces = light.bounces.none if self.level == "direct" else light.bounces
                    settings = cycles.LightSettings(light.film, bounces, share, (job.seed or 0) + seed)
                remedies = self.ledger.remedies_of_everything if is_of_everything else self.ledger.remedies.values()
                target = self.scene, self.view_layer, camera, path
                if job.engine in ("EEVEE", "WORKBENCH"):
                    rasters.render(*target, job.engine, remedies, job.threads)
                else:
                    cycles.render(*target, remedies, job.threads, settings, kept, job.device, is_of_everything, lasting)
            if keep and lasting.is_shared:  # Cycles must not know it when it is gone
                persistent_data.drop(self.scene)


@contextlib.contextmanager
def staged(
    job: Job, scene: bpy.types.Scene, camera_object: bpy.types.Object, notes: Iterable[str] = (), whole: bool = False
) -> Iterator[Stage]:
    """Give the scene as a job's comparison wants it.

    notes : sentences of the file as a whole, for the ledger.
    whole : true to ignore a border that does not crop.
    """
    layer, ledger = rendered_layer(scene), Ledger()
    for sentence in notes:
        ledger.note(Path(bpy.data.filepath).name, "approximated", sentence)
    with overridden() as overrides:
        if whole and not scene.render.use_crop_to_border:
            overrides.set(scene.render, "use_border", False)
        if job.clay:
            overrides.set(layer, "material_override", materials.plain(overrides))
        level = level_needed(scene, layer, camera_object) if job.level == "auto" else job.level or LEVELS[0]
        stage = Stage(scene, layer, camera_object, not job.is_of_scenes_camera, level, ledger)
        if not job.recenter:
            yield stage
            return
        with recentering.recentered(scene, layer, camera_object, ledger, stage.is_lit) as moved:
            layer = moved.scene.view_layers[0]
            yield Stage(
                moved.scene, layer, moved.camera, True, level, origin=moved.origin, names=moved.names, file_ledger=ledger
            )


def rendered_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The window's view layer if it is rendered at all, else the first that is."""
    current = bpy.context.view_layer
    return current if current.use else next((layer for layer in scene.view_layers if layer.use), current)
