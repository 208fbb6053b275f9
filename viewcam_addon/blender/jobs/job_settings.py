"""The settings of the file that jobs change for their time, and why.

**For all of it.** One camera must be had: stereoscopy and the sequencer's strips would choose others, and markers are bound to
cameras only while the scene's own is wanted, which Blender then chooses as it does in an animation.
Files are the batch's own: the compositor's File Output nodes are muted. What Blender and Cycles have built is kept between
shots (persistent_data.py), and no camera of the file follows a picture of another size (resolution.py).

**For each job**, what it says: engine, size, frame, samples, level, seed, threads. What it does not say is as the file has it.
"""

import dataclasses
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import bpy

from ... import intrinsics
from ...jobs.job import Job
from .. import datablocks, resolution, versions
from ..rendering import picture_files
from ..rendering.engine import VIEWCAM_RenderEngine
from ..temporary_settings import Overrides
from . import origins, persistent_data

_ENGINES = {"CYCLES": "CYCLES", "EEVEE": versions.EEVEE, "VIEWCAM": "VIEWCAM", "WORKBENCH": "BLENDER_WORKBENCH"}

_OF_RENDER = ("engine", "resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y")


def engine_name(engine: str) -> str:
    """An engine of Blender's as a shot calls it, or as Blender does where no shot could."""
    return next((name for name, blender_name in _ENGINES.items() if blender_name == engine), engine)


class JobSettings:
    """A scene while a batch has it.

    warnings : a sentence for each thing that is another in a render by itself.

    off : sentences for what is off because the file is not trusted (opening.py).
    """

    def __init__(self, overrides: Overrides, scene: bpy.types.Scene, off: Iterable[str] = ()) -> None:
        self._scene, self._overrides, self.off = scene, overrides, tuple(off)
        self._threads_mode_of_file = scene.render.threads_mode
        self.warnings = (*_warnings(scene), *(f"{sentence[:1].upper()}{sentence[1:]}" for sentence in off))
        render = scene.render
        overrides.afterwards(setattr, scene, "camera", scene.camera)
        self._camera_of_file = scene.camera
        self._bindings = datablocks.bindings_of(scene)
        overrides.afterwards(self._bind_markers, True)
        for name in ("use_sequencer", "use_stamp"):
            overrides.set(render, name, False)
        overrides.set(render, "use_persistent_data", True)
        overrides.set(VIEWCAM_RenderEngine, "keeps_scene", True)
        persistent_data.drop(scene)
        self._drop_at_cameras = persistent_data.is_driven_by_camera()
        for node in _file_outputs(scene):
            overrides.set(node, "mute", True)
        picture_files.override_formats(overrides, scene)
        for camera_object in (each for each in scene.objects if each.type == "CAMERA"):
            overrides.enter(resolution.lens_kept(camera_object, scene))
        self._of_file = {owner_name: getattr(*owner_name) for owner_name in self._properties()}
        for (owner, name), value in self._of_file.items():
            overrides.afterwards(setattr, owner, name, value)
        self._frame_of_file = datablocks.frame_of(scene)
        self._time_of_file = (scene.frame_current, scene.frame_subframe)
        overrides.afterwards(self._go_to, *self._time_of_file)

    @property
    def engine(self) -> str:
        """The name of the engine that renders."""
        return engine_name(self._scene.render.engine)

    def engine_of(self, shot: Job) -> str:
        """The engine of a shot, as Blender calls it."""
        return _ENGINES[shot.engine] if shot.engine else self._of_file[self._scene.render, "engine"]

    def frame_of(self, shot: Job) -> intrinsics.Frame:
        """The picture of a shot."""
        values: dict[str, Any] = {}
        if shot.width is not None:
            values |= {"resolution_x": shot.width, "resolution_y": shot.height, "percentage": 100}
        if shot.pixel_aspect is not None:
            values |= _pixel_aspects(shot.pixel_aspect)
        return dataclasses.replace(self._frame_of_file, **values)

    def set(self, shot: Job) -> None:
        """Set the scene to a shot, but for its camera. What stands so already is not touched, so that nothing is built anew.

        The frame comes first: a camera's values follow its animation there in the picture that they are set for.
        """
        self._go_to(*(self._time_of_file if shot.frame is None else (shot.frame, 0.0)))
        wanted = self._of_file | dict(self._values(shot))
        changed = [(owner, name) for (owner, name), value in wanted.items() if getattr(owner, name) != value]
        for owner, name in changed:
            setattr(owner, name, wanted[owner, name])
        if _samples(self._scene).get("CYCLES") in changed:
            persistent_data.drop(self._scene)
        self._set_threads(shot.threads)

    def _set_threads(self, threads: int | None) -> None:
        """Set as many as a job asks for, the file's where None. Of automatic ones the file's number reads as another."""
        render = self._scene.render
        if threads is None:
            render.threads_mode = self._threads_mode_of_file
        elif render.threads_mode != "FIXED" or render.threads != threads:
            self._overrides.set(render, "threads_mode", "FIXED")
            self._overrides.set(render, "threads", threads)

    def scene_camera(self, frame: int | None = None) -> bpy.types.Object | None:
        """The object that is the scene's own camera at a frame, that of the file where None; None if it has none."""
        time = self._time_of_file if frame is None else (frame, 0.0)
        return datablocks.bound_camera(self._bindings, datablocks.time_of_markers(self._scene, *time)) or self._camera_of_file

    def look_through(self, camera_object: bpy.types.Object, is_scenes: bool = False) -> None:
        """Make it the camera that renders.

        is_scenes : true for the scene's own camera, which markers may change.
        """
        self._bind_markers(is_scenes)
        if self._scene.camera != camera_object:
            self._scene.camera = camera_object
            if self._drop_at_cameras:
                persistent_data.drop(self._scene)

    def _bind_markers(self, are_bound: bool) -> None:
        for marker, camera_object in self._bindings:
            marker.camera = camera_object if are_bound else None

    def _go_to(self, frame: int, subframe: float) -> None:
        if (self._scene.frame_current, self._scene.frame_subframe) != (frame, subframe):
            self._scene.frame_set(frame, subframe=subframe)
            persistent_data.drop(self._scene)

    def _values(self, shot: Job) -> Iterator[tuple[tuple[bpy.types.bpy_struct, str], object]]:
        """The values that a shot sets, by owner and name of the property."""
        scene, render = self._scene, self._scene.render
        engine = self.engine_of(shot)
        yield (render, "engine"), engine
        if shot.width is not None:
            yield (render, "resolution_x"), shot.width
            yield (render, "resolution_y"), shot.height
            yield (render, "resolution_percentage"), 100
        if shot.pixel_aspect is not None:
            for name, value in _pixel_aspects(shot.pixel_aspect).items():
                yield (render, name), value
        if shot.samples is not None and engine in (samples := _samples(scene)):
            yield samples[engine], shot.samples
            if engine == "CYCLES":
                yield (scene.cycles, "use_layer_samples"), "IGNORE"
        if shot.seed is not None:
            for owner in _seeds(scene).values():
                yield (owner, "seed"), shot.seed
        if shot.level is not None:
            yield (scene.virtual_pinhole_reference, "level"), shot.level.upper()

    def _properties(self) -> Iterator[tuple[bpy.types.bpy_struct, str]]:
        """All that a shot may set."""
        scene = self._scene
        yield from ((scene.render, name) for name in _OF_RENDER)
        yield from _samples(scene).values()
        if hasattr(scene, "cycles"):
            yield scene.cycles, "use_layer_samples"
        yield from ((owner, "seed") for owner in _seeds(scene).values())
        yield scene.virtual_pinhole_reference, "level"

    def rendered(self, by_engine: bool = True) -> dict[str, object]:
        """The settings of the scene, as a sidecar says them; None where the engine has no such thing.

        by_engine : true if there is a picture, of which the engine knows more.
        """
        scene, engine = self._scene, self._scene.render.engine
        samples, seed = _samples(scene).get(engine), _seeds(scene).get(engine)
        return {
            "engine": self.engine,
            "samples": getattr(*samples) if samples else None,
            "level": VIEWCAM_RenderEngine.level if engine == "VIEWCAM" and by_engine else None,
            "seed": seed.seed if seed else None,
            "width": datablocks.frame_of(scene).window[2],
            "height": datablocks.frame_of(scene).window[3],
            "frame": scene.frame_current,
            "file": Path(bpy.data.filepath).name,
            "scene": scene.name,
            "view_layers": [layer.name for layer in scene.view_layers if layer.use],
        }


def _pixel_aspects(aspect: float) -> dict[str, float]:
    """Blender's two numbers of a pixel's width over its height; neither may be below 1."""
    return {"pixel_aspect_x": max(1.0, aspect), "pixel_aspect_y": max(1.0, 1 / aspect)}


def _samples(scene: bpy.types.Scene) -> dict[str, tuple[bpy.types.bpy_struct, str]]:
    """The property that says how many samples a pixel gets, by engine."""
    places = {"VIEWCAM": (scene.virtual_pinhole_reference, "samples"), versions.EEVEE: (scene.eevee, "taa_render_samples")}
    return places | ({"CYCLES": (scene.cycles, "samples")} if hasattr(scene, "cycles") else {})


def _seeds(scene: bpy.types.Scene) -> dict[str, bpy.types.bpy_struct]:
    """The block that has the seed, by engine. EEVEE has none."""
    places = {"VIEWCAM": scene.virtual_pinhole_reference}
    return places | ({"CYCLES": scene.cycles} if hasattr(scene, "cycles") else {})


def _file_outputs(scene: bpy.types.Scene) -> Iterator[bpy.types.Node]:
    """The compositor's nodes that write files, those in groups as well."""
    tree = versions.compositor(scene)
    trees = [tree] if tree else []
    for tree in trees:
        for node in tree.nodes:
            if node.type == "OUTPUT_FILE":
                yield node
            elif node.type == "GROUP" and node.node_tree and node.node_tree not in trees:
                trees.append(node.node_tree)


def _warnings(scene: bpy.types.Scene) -> Iterator[str]:
    render = scene.render
    if render.use_multiview:
        yield "Stereoscopy is off in a batch: each shot has one camera"
    if render.use_sequencer and scene.sequence_editor and versions.has_strips(scene.sequence_editor):
        yield "The sequencer's strips are left out in a batch: they would stand in place of the shot"
    if any(not node.mute for node in _file_outputs(scene)):
        yield "The compositor's File Output nodes write nothing in a batch: each shot would write over the last one's files"
    if render.use_border:
        yield "The render border is on: the picture is that part of the frame"
    if persistent_data.is_simulated():
        yield "Something is simulated: unless it is baked, its picture depends on the frames that were evaluated before"
    if getattr(getattr(scene, "cycles", None), "time_limit", 0.0) > 0:
        yield "Cycles has a time limit: another run may have other samples, and other pixels"
    yield from origins.unknown()
