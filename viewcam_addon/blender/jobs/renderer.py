"""Jobs where Blender is: a .blend is opened once, job after job of it is rendered, checked and exported, and all is given back.

    with BlenderRenderer(blend) as renderer:
        for job in jobs:
            renderer.render(job, image, preview)
            renderer.check(job)

A picture is what `blender -b FILE -f N` would render (all view layers, the compositor, samples, world and passes as they are),
from the job's camera: `job_settings.py` has what else is another. The four values go to a camera of our own, which has the clip
range of the scene's camera; one of the file is rendered as it stands. The file is never saved.

Rejected: `-f` in a process each (a start, a file and an acceleration structure built for each shot), and the artist's own
camera for the four values (what carries it would carry them).
"""

import contextlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from ...cameras.sidecar import record
from ...events import Events
from ...jobs import makers
from ...jobs.folder import Outputs
from ...jobs.job import Job
from ...jobs.tracing import Tracing, Written
from ...pinhole import Pinhole
from ...tracer.scene import LedgerEntry, Scene
from .. import camera as cameras
from .. import datablocks
from ..opening import opened
from ..rendering import picture_files
from ..rendering.engine import VIEWCAM_RenderEngine
from ..scenes.depsgraph import render_still
from ..scenes.export import survey
from ..temporary_settings import Overrides, numbered_indices, overridden
from . import obstacles, origins, persistent_data
from .checking import Checker
from .job_settings import JobSettings
from .labeling import ShotLabels
from .stage import staged

_NAME = "viewcam batch"


class BlenderRenderer:
    """Renders and checks jobs of one .blend (jobs.one.Renderer); a context manager.

    blend : the file, or None for the one that is open.
    trust : true if the file's scripts may run and write (opening.py); its File Output nodes never write.
    events : receives events that say how far a check is.

    Raises InputError on entering, if the file can't be opened.
    """

    def __init__(self, blend: str | os.PathLike[str] | None = None, trust: bool = False, events: Events | None = None) -> None:
        self._blend, self._trust, self._events = blend, trust, events
        self._loan = contextlib.ExitStack()
        self._own: bpy.types.Object | None = None
        self._of_file: bpy.types.Object | None = None
        self._has_drawn = False

    def __enter__(self) -> "BlenderRenderer":
        with contextlib.ExitStack() as stack:
            self._overrides, off = stack.enter_context(opened(self._blend, self._trust))
            self.scene = bpy.context.scene
            self._settings = JobSettings(self._overrides, self.scene, off)
            self._tracing = stack.enter_context(Tracing(self._events))
            self._checker = stack.enter_context(Checker(self._tracing, self._events))
            self._labels = stack.enter_context(ShotLabels(self._tracing))
            self._loan = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._loan.close()

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the scene's cameras, sorted."""
        return tuple(obstacles.cameras_of(self.scene, self._own))

    @property
    def scene_camera(self) -> str | None:
        """The name of the camera that a render of the file takes, at the file's frame."""
        camera_object = self._settings.scene_camera()
        return camera_object.name if camera_object else None

    @property
    def blend(self) -> Path | None:
        """The file that is open; None if it was never saved."""
        return Path(bpy.data.filepath) if bpy.data.filepath else None

    @property
    def program(self) -> str | None:
        """The Blender that this process is; None where it is a Python module."""
        return bpy.app.binary_path or None

    def pinhole(self, name: str | None, size: tuple[int, int] | None = None, frame: int | None = None) -> Pinhole:
        """A camera of the file as it stands at a frame, with a look-at point as people choose it.

        name : the scene's own at the frame where None.
        size, frame : the file's where None. A border counts for nothing: the pinhole is that of the whole picture.

        Raises InputError if there is none of that name, or if it is no pinhole.
        """
        width, height = size or (None, None)
        shot = Job("pinhole", camera=name, width=width, height=height, frame=frame)
        camera_object = obstacles.camera_of(shot, self.scene, obstacles.cameras_of(self.scene, self._own), self._settings)
        self._settings.set(shot)
        pinhole = cameras.as_it_stands(camera_object, self.scene)
        picture = self._settings.frame_of(shot)
        column, row, _, _ = picture.window
        return pinhole.cropped(-column, -row, *picture.size)

    def made_from(self) -> dict[str, Any]:
        """The origins of the pictures, beside the jobs: hashes of the .blend and of all that it links; versions.

        Raises InputError if the open file was never saved.
        """
        return origins.made_from()

    def problems(self, shots: Sequence[Job], outputs: Outputs | None = None) -> tuple[str, ...]:
        """One sentence for each reason why a shot can't be had, as far as it is known before anything is rendered."""
        return tuple(obstacles.obstacles(shots, outputs or Outputs(), self.scene, self._camera_of_values, self._settings))

    def render(self, shot: Job, image: Path | None, preview: Path | None) -> dict[str, Any]:
        """Write the shot's picture and preview to these two paths, or nothing where they are None; what the sidecar says of it.

        Raises InputError if the camera can't be had, or if Blender can't render or write. Raises OSError if the disk is full.
        """
        with overridden() as overrides:
            overrides.set(self.scene.render, "use_multiview", False)  # here alone: a check's ledger tells of stereoscopy
            warnings = self._set(shot)
            if image and preview:
                if self._settings.engine == "EEVEE" and not self._has_drawn:  # see persistent_data.py
                    render_still(self.scene)
                    self._has_drawn = True
                render_still(self.scene)
        if image and preview:
            if self.scene.render.engine == VIEWCAM_RenderEngine.bl_idname:
                warnings += VIEWCAM_RenderEngine.warnings
            picture_files.write(self.scene, image, preview)
        evaluated = self.scene.camera.evaluated_get(datablocks.depsgraph_of(self.scene))
        self._taken = cameras.read(evaluated, self.scene)
        camera = record(self._taken, datablocks.camera_data_of(evaluated))
        rendered = self._settings.rendered(bool(image)) | ({"camera": self._of_shot(shot).name} if self._of_file else {})
        if calibration := shot.calibration:
            if image and preview:
                self._tracing.distort(image, preview, calibration, self._taken.plane)
            camera = {**record(calibration.at(self._taken), lens=calibration.lens), "pinhole": camera}
            rendered |= {"width": calibration.plane.width, "height": calibration.plane.height}
        return {
            **camera,
            **({"stated": record(self._stated)["camera"]} if self._stated else {}),
            "rendered": rendered,
            "warnings": [*self._settings.warnings, *warnings],
            "versions": origins.versions(),
        }

    def label(self, shot: Job, picture: Path, kinds: Sequence[str], depth_steps: float) -> list[str]:
        """Write the labels of the shot that was just rendered beside a picture; the names of their files (labeling.py).

        Raises InputError if the scene can't be exported, or the labels not be written.
        """
        camera_object = self._of_shot(shot)
        names = self._labels.write(self.scene, camera_object, self._taken, picture, kinds, depth_steps, shot)
        if "flow" in kinds:  # other frames were looked at
            persistent_data.drop(self.scene)
        return names

    def check(
        self, job: Job, has_picture: bool = True, written: Written | None = None, keep: Path | None = None
    ) -> dict[str, Any]:
        """Compare a job with the tracer (checking.py).

        has_picture : true to check camera and geometry of the picture that was just rendered; false to check the job's engine
            at the job's level.
        written, keep : see Checker.check; for the latter only.

        Raises InputError if the engine can't render the scene, or if the two can't be compared.
        """
        if has_picture:
            return self._checker.check_picture(job, self.scene, self.scene.camera, self._taken, self._stated)
        self._set(job)
        return self._checker.check(job, self.scene, self.scene.camera, self._settings.off, written, keep)

    def export(self, job: Job) -> Scene:
        """The tracer's scene of a job.

        Raises InputError if there is no such camera, or one that is no pinhole. Raises NotModeledError if `strict` and anything
        is approximated or left out.
        """
        self._set(job)
        with staged(job, self.scene, self.scene.camera, self._settings.off) as stage:
            return stage.export(job.strict)

    def cycles(self, job: Job, path: str | os.PathLike[str]) -> tuple[LedgerEntry, ...]:
        """Render a job with Cycles for a comparison; what the ledger tells. Raises as `export` does, or if it can't write."""
        self._set(job)
        with staged(job, self.scene, self.scene.camera, self._settings.off) as stage:
            light = survey(stage.scene, stage.view_layer, stage.camera, stage.ledger, stage.is_lit)
            result = stage.entries(job.strict)
            stage.render(job, [path], light)
            return result

    def both_sides(self, job: Job, paths: Sequence[Path]) -> Scene:
        """The scene of a job and, at these paths, the pictures of its engine, of one state. Raises as `cycles` does."""
        self._set(job)
        with numbered_indices(), staged(job, self.scene, self.scene.camera, self._settings.off) as stage:
            return self._checker.both_sides(stage, job, paths)

    def _set(self, job: Job) -> list[str]:
        """Set the scene to a job, and make its camera the scene's; what a reader should know of it."""
        self._settings.set(job)
        self._of_file, self._stated = None, None
        if job.eye is None:
            among = obstacles.cameras_of(self.scene, self._own)
            camera_object = self._of_file = obstacles.camera_of(job, self.scene, among, self._settings)
            warnings = datablocks.beyond_pinhole(camera_object, self.scene)
        if job.calibration and self._of_file:  # the pinhole that covers is none of the file's
            evaluated = self._of_file.evaluated_get(datablocks.depsgraph_of(self.scene))
            job = makers.calibrated(job, job.calibration, cameras.read(evaluated, self.scene))
            self._settings.set(job)
        if job.eye is not None:
            camera_object, stated = self._camera_of_values(self._of_file), obstacles.stated(job, self._settings.frame_of(job))
            warnings = cameras.apply(camera_object, stated, self.scene)
            warnings += datablocks.beyond_pinhole(camera_object, self.scene)
            self._stated = None if self._of_file else stated
        self._settings.look_through(camera_object, job.is_of_scenes_camera)
        return warnings

    def _of_shot(self, shot: Job) -> bpy.types.Object:
        """The camera that a shot is of: the one that renders, which Blender may have chosen, or whose place it takes."""
        return (self._of_file if shot.calibration else None) or self.scene.camera

    def _camera_of_values(self, like: bpy.types.Object | None = None) -> bpy.types.Object:
        """The camera for the four values; made for the first of them, since objects are numbered by name.

        like : the camera whose clip range it has, the scene's own where None.
        """
        like = like or self._settings.scene_camera()
        if self._own is None:
            self._own = _own_camera(self._overrides, self.scene)
        if like and like.type == "CAMERA":
            self._own.data.clip_start, self._own.data.clip_end = like.data.clip_start, like.data.clip_end
        return self._own


def export(job: Job) -> Scene:
    """The tracer's scene of one job. Raises as BlenderRenderer.export does, and InputError if the file can't be opened."""
    with BlenderRenderer(job.blend, job.trust) as renderer:
        return renderer.export(job)


def cycles(job: Job, path: str | os.PathLike[str]) -> tuple[LedgerEntry, ...]:
    """Render one job with Cycles; what the ledger tells. Raises as `export` does, and InputError if it can't be written."""
    with BlenderRenderer(job.blend, job.trust) as renderer:
        return renderer.cycles(job, path)


def both_sides(job: Job, paths: Sequence[Path]) -> Scene:
    """The scene of one job and, at these paths, the pictures of its engine. Raises as `cycles` does."""
    with BlenderRenderer(job.blend, job.trust) as renderer:
        return renderer.both_sides(job, paths)


def _own_camera(overrides: Overrides, scene: bpy.types.Scene) -> bpy.types.Object:
    """A camera while the overrides last, sharp."""
    data = bpy.data.cameras.new(_NAME)
    overrides.afterwards(bpy.data.cameras.remove, data)
    camera_object = bpy.data.objects.new(_NAME, data)
    overrides.afterwards(bpy.data.objects.remove, camera_object)
    scene.collection.objects.link(camera_object)
    return camera_object
