"""One job on one .blend, as the command line asks for it: export, render with Cycles, or both from the same state.

A job opens the file (or takes the one that is open), chooses camera, frame and size for its own time only, and never saves.
What is in the file does not run (opening.py).
"""

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy

from ...errors import InputError
from ...tracer.scene import LedgerEntry, Scene
from ...tracer.scene.film import LEVELS, SAMPLES
from .. import datablocks, resolution
from ..opening import opened
from ..scenes import materials, recentering
from ..scenes.export import Lighting, export_scene, level_needed, survey
from ..scenes.ledger import Ledger
from ..temporary_settings import Overrides, numbered_indices
from . import cycles, rasters

AUTO = "auto"

_LAST_FRAME = 1048574


@dataclass(frozen=True)
class Request:
    """blend : the file, or None for the one that is open. camera, frame, size : the scene's own where None.

    recenter : whether both sides see the scene with its origin at the eye. level : one of film.LEVELS, or "auto" for the least
    that models all light of the scene (levels.py). samples : a pixel, of all of Cycles' pictures together, from level `direct`
    on. clay : whether one and the same material covers all surfaces. trust : whether what is in the file may run and write
    (opening.py). numbered : what `export_and_render` numbers for the index passes where the file does not: objects, materials.
    engine : CYCLES, or EEVEE or WORKBENCH at level `geometry` (rasters.py). device : what Cycles renders on (cycles.py).
    """

    blend: str | os.PathLike[str] | None = None
    camera: str | None = None
    frame: int | None = None
    size: tuple[int, int] | None = None
    strict: bool = False
    recenter: bool = False
    threads: int | None = None
    level: str = "geometry"
    samples: int = SAMPLES
    seed: int = 0
    clay: bool = False
    trust: bool = False
    numbered: tuple[str, ...] = ("objects", "materials")
    engine: str = "CYCLES"
    device: str = "CPU"


@dataclass(frozen=True)
class _Stage:
    """What a job works on while it lasts.

    level : what is modelled, never "auto". ledger : of what is on this stage. origin, names, told : of the file that a
    recentred stage stands for, see recentering.py; told is the file's ledger.
    """

    scene: bpy.types.Scene
    view_layer: bpy.types.ViewLayer
    camera: bpy.types.Object
    level: str = LEVELS[0]
    ledger: Ledger = field(default_factory=Ledger)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    names: dict[str, str] = field(default_factory=dict)
    told: Ledger | None = None

    @property
    def is_lit(self) -> bool:
        return self.level != LEVELS[0]

    def entries(self, strict: bool) -> tuple[LedgerEntry, ...]:
        """What is told of the file; NotModelledError if `strict` and anything is approximated or left out."""
        ledger = self.ledger
        if self.told:
            self.told.add(self.ledger, self.names)
            ledger = self.told
        if strict:
            ledger.check_strict()
        return ledger.entries()


def export(request: Request) -> Scene:
    """The tracer's scene of a .blend.

    Raises
    ------
    InputError
        if the file can't be opened, or has no such camera, or one that is no pinhole.
    NotModelledError
        if `strict` and anything is approximated or left out.
    """
    with _stage(request) as stage, _seen_from(stage, request) as stage:
        return _export(stage, request)


def render(request: Request, path: str | os.PathLike[str]) -> tuple[LedgerEntry, ...]:
    """Render a .blend with Cycles for a comparison; returns what the ledger says.

    Raises as `export` does, and InputError if the picture can't be written.
    """
    with _stage(request) as stage, _seen_from(stage, request) as stage:
        light = survey(stage.scene, stage.view_layer, stage.camera, stage.ledger, stage.is_lit)
        told = stage.entries(request.strict)
        _render(stage, request, [path], light)
        return told


def export_and_render(
    request: Request,
    paths: Sequence[str | os.PathLike[str]],
    rendering: Callable[[int], None] = lambda number: None,
    everything: str | os.PathLike[str] | None = None,
) -> Scene:
    """Both sides of one state of the file, objects and materials numbered alike. Raises as `render` does.

    paths : for several pictures of Cycles, which share the samples; their seeds count from that of the request. rendering : is
    told of each, by its number from 1 on, before it is rendered. everything : for one more picture of Cycles, like the first
    but with all that has a stand-in, or is left out, in the others; written where there is any such thing. A recentred scene
    has none of it.
    """
    with _stage(request) as stage, numbered_indices(request.numbered), _seen_from(stage, request) as stage:
        scene = _export(stage, request)
        light = Lighting(scene.lamps, scene.world, scene.film, scene.bounces)
        _render(stage, request, paths, light, rendering)
        if everything is not None and scene.not_modelled and request.engine == "CYCLES" and not request.recenter:
            rendering(len(paths) + 1)
            _render_with_cycles(stage, request, 0, len(paths), everything, light, everything=True)
        return scene


def _export(stage: _Stage, request: Request) -> Scene:
    scene = export_scene(stage.scene, stage.view_layer, stage.camera, stage.ledger, stage.is_lit)
    objects = recentering.as_in_file(scene.objects, stage.names) if stage.names else scene.objects
    return replace(scene, objects=objects, origin=stage.origin, ledger=stage.entries(request.strict))


@contextlib.contextmanager
def _seen_from(stage: _Stage, request: Request) -> Iterator[_Stage]:
    """The stage itself or, where that is wanted, one whose origin is the camera's eye."""
    if not request.recenter:
        yield stage
        return
    with recentering.recentred(stage.scene, stage.view_layer, stage.camera, stage.ledger, stage.is_lit) as moved:
        layer = moved.scene.view_layers[0]
        yield _Stage(moved.scene, layer, moved.camera, stage.level, origin=moved.origin, names=moved.names, told=stage.ledger)


def _render(
    stage: _Stage,
    request: Request,
    paths: Sequence[str | os.PathLike[str]],
    light: Lighting | None,
    rendering: Callable[[int], None] = lambda number: None,
) -> None:
    """Cycles' pictures. light : as exported, of a stage that is lit.

    Unless a camera is named, Blender chooses it once more: one that we took for the scene's and is not is a difference then.
    """
    for number, path in enumerate(paths):
        rendering(number + 1)
        if request.engine == "CYCLES":
            _render_with_cycles(stage, request, number, len(paths), path, light)
        else:
            of = stage.scene, stage.view_layer, _camera_of(stage, request), path
            rasters.render(*of, request.engine, stage.ledger.remedies.values(), request.threads)


def _render_with_cycles(
    stage: _Stage,
    request: Request,
    number: int,
    count: int,
    path: str | os.PathLike[str],
    light: Lighting | None,
    everything: bool = False,
) -> None:
    """One of Cycles' pictures, of so many."""
    picture = None
    if stage.is_lit:
        bounces = light.bounces.none if stage.level == "direct" else light.bounces
        share = max(request.samples // count, 1)
        picture = cycles.LightSettings(light.film, bounces, share, request.seed + number)
    remedies = stage.ledger.remedies_of_everything if everything else stage.ledger.remedies.values()
    of = stage.scene, stage.view_layer, _camera_of(stage, request), path
    cycles.render(*of, remedies, request.threads, picture, device=request.device, everything=everything)


def _camera_of(stage: _Stage, request: Request) -> bpy.types.Object | None:
    return stage.camera if request.camera is not None or stage.told else None


@contextlib.contextmanager
def _stage(request: Request) -> Iterator[_Stage]:
    """Open the file, and set it to the request until the job is done."""
    with opened(request.blend, request.trust) as (overrides, off):
        scene = bpy.context.scene
        if request.frame is not None:
            _override_frame(overrides, scene, request.frame)
        camera = _camera(scene, request.camera)
        if request.size:
            _override_size(overrides, scene, camera, request.size)
        layer = rendered_layer(scene)
        if request.clay:
            overrides.set(layer, "material_override", materials.plain(overrides))
        level = level_needed(scene, layer, camera) if request.level == AUTO else request.level
        ledger = Ledger()
        for sentence in off:
            ledger.note(Path(bpy.data.filepath).name, "approximated", sentence)
        yield _Stage(scene, layer, camera, level, ledger)


def _camera(scene: bpy.types.Scene, name: str | None) -> bpy.types.Object:
    """The camera object that is meant, checked to be a perspective one."""
    if name is None:
        camera = datablocks.require_render_camera(scene)
    else:
        camera = scene.objects.get(name)
        if camera is None:
            cameras = sorted(each.name for each in scene.objects if each.type == "CAMERA")
            raise InputError(f"scene {scene.name!r} has no object {name!r}: its cameras are {', '.join(cameras) or 'none'}")
    datablocks.check_perspective(camera)
    return camera


def rendered_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The window's view layer if it is rendered at all, else the first that is."""
    current = bpy.context.view_layer
    return current if current.use else next((layer for layer in scene.view_layers if layer.use), current)


def _override_frame(overrides: Overrides, scene: bpy.types.Scene, frame: int) -> None:
    before = (scene.frame_current, scene.frame_subframe)
    if before == (frame, 0.0):
        return
    if abs(frame) > _LAST_FRAME:
        raise InputError(f"frame {frame} is beyond Blender's last, {_LAST_FRAME}: give another")
    overrides.afterwards(setattr, scene, "camera", scene.camera)  # a marker may change it, here and on the way back
    overrides.afterwards(scene.frame_set, before[0], subframe=before[1])
    scene.frame_set(frame)


def _override_size(overrides: Overrides, scene: bpy.types.Scene, camera: bpy.types.Object, size: tuple[int, int]) -> None:
    """Another number of pixels for the same lens; the stated distance counts pixels and goes with the lens."""
    if not all(4 <= number <= 65536 for number in size):
        raise InputError(f"Blender can't render {size[0]} × {size[1]} pixels: choose from 4 to 65536 each way")
    overrides.enter(resolution.lens_kept(camera, scene))
    for name, value in zip(("resolution_x", "resolution_y", "resolution_percentage"), (*size, 100), strict=True):
        overrides.set(scene.render, name, value)
