"""A batch's renderer where Blender is: opens a .blend once, renders shot after shot of it, and gives all back as it was.

    with BlenderRenderer(blend) as renderer:
        for shot in shots:
            renderer.render(shot, image, preview)

A shot is what `blender -b FILE -f N` would render (all view layers, the compositor, samples, world and passes as they are),
from the shot's camera: `shot_settings.py` has what else is another. The four values go to a camera of the batch's own, which
has the clip range of the scene's camera; one of the file is rendered as it stands. The file is never saved.

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
from ...jobs.folder import Outputs
from ...jobs.shot import Shot
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import datablocks
from ..opening import opened
from ..rendering.engine import VIEWCAM_RenderEngine
from ..scenes.depsgraph import render_still
from ..temporary_settings import Overrides
from . import obstacles, origins, persistent_data, pictures
from .checking import Checker
from .labelling import ShotLabels
from .shot_settings import ShotSettings

_NAME = "viewcam batch"


class BlenderRenderer:
    """Renders shots of one .blend (jobs.one.Renderer); a context manager.

    blend : the file, or None for the one that is open. seed : of Cycles' and our noise, threads : of all engines; as the file
    says where None. trust : whether what is in the file may run and write (opening.py); its File Output nodes never write.

    Raises
    ------
    InputError
        on entering, if the file can't be opened.
    """

    def __init__(
        self,
        blend: str | os.PathLike[str] | None = None,
        seed: int | None = None,
        threads: int | None = None,
        trust: bool = False,
    ) -> None:
        self._blend, self._seed, self._threads, self._trust = blend, seed, threads, trust
        self._loan = contextlib.ExitStack()
        self._has_drawn = False

    def __enter__(self) -> "BlenderRenderer":
        with contextlib.ExitStack() as stack:
            overrides, off = stack.enter_context(opened(self._blend, self._trust))
            self.scene = bpy.context.scene
            self._settings = ShotSettings(overrides, self.scene, self._threads, self._seed, off)
            self._own = _own_camera(overrides, self.scene, self.scene.objects.get(self.scene_camera or ""))
            self._checker = stack.enter_context(Checker(self._threads))
            self._labels = stack.enter_context(ShotLabels(self._threads))
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
        return self._settings.scene_camera()

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

        name : the scene's own at the frame where None. size, frame : the file's where None. A border counts for nothing: the
        pinhole is that of the whole picture.

        Raises
        ------
        InputError
            if there is none of that name, or if it is no pinhole.
        """
        width, height = size or (None, None)
        shot = Shot("pinhole", camera=name, width=width, height=height, frame=frame)
        camera_object = obstacles.camera_of(shot, self.scene, obstacles.cameras_of(self.scene, self._own), self._settings)
        self._settings.set(shot)
        found = cameras.as_it_stands(camera_object, self.scene, in_use=camera_object.virtual_pinhole.enabled)
        picture = self._settings.frame_of(shot)
        column, row, _, _ = picture.window
        return found.cropped(-column, -row, *picture.size)

    def made_from(self) -> dict[str, Any]:
        """What the pictures are made from, beside the shots: hashes of the .blend and of all that it links; versions; the seed;
        whether it is trusted.

        Raises
        ------
        InputError
            if the open file was never saved.
        """
        return origins.made_from() | {"seed": self._seed} | ({"trust": True} if self._trust else {})

    def problems(self, shots: Sequence[Shot], outputs: Outputs | None = None) -> tuple[str, ...]:
        """One sentence for each reason why a shot can't be had, as far as it is known before anything is rendered."""
        return tuple(obstacles.obstacles(shots, outputs or Outputs(), self.scene, self._own, self._settings))

    def render(self, shot: Shot, image: Path | None, preview: Path | None) -> dict[str, Any]:
        """Write the shot's picture and preview to these two paths, or nothing where they are None; what the sidecar says of it.

        Raises
        ------
        InputError
            if the camera can't be had, or if Blender can't render or write.
        OSError
            if the disk is full.
        """
        self._settings.set(shot)
        warnings = self._aim(shot)
        if image and preview:
            if self._settings.engine == "EEVEE" and not self._has_drawn:  # see persistent_data.py
                render_still(self.scene)
                self._has_drawn = True
            render_still(self.scene)
            if self.scene.render.engine == VIEWCAM_RenderEngine.bl_idname:
                warnings += VIEWCAM_RenderEngine.warnings
            pictures.write(self.scene, image, preview)
        evaluated = self.scene.camera.evaluated_get(datablocks.depsgraph_of(self.scene))
        self._taken = cameras.read(evaluated, self.scene)
        return {
            **record(self._taken, datablocks.camera_data_of(evaluated)),
            **({"stated": record(self._stated)["camera"]} if self._stated else {}),
            "rendered": self._settings.rendered(bool(image)) | ({} if self._stated else {"camera": self.scene.camera.name}),
            "warnings": [*self._settings.warnings, *warnings],
            "versions": origins.versions(),
        }

    def label(self, shot: Shot, picture: Path, kinds: Sequence[str], depth_steps: float) -> list[str]:
        """Write the labels of the shot that was just rendered beside a picture; the names of their files (labelling.py).

        Raises
        ------
        InputError
            if the scene can't be exported, or the labels not be written.
        """
        is_still = shot.eye is not None
        names = self._labels.write(self.scene, self.scene.camera, self._taken, picture, kinds, depth_steps, is_still)
        if "flow" in kinds:  # other frames were looked at
            persistent_data.drop(self.scene)
        return names

    def check(self, shot: Shot) -> dict[str, Any]:
        """Compare the shot that was just rendered with the tracer (checking.py).

        Of the scene's own camera Blender chooses once more which that is: a picture of another one is a difference.

        Raises
        ------
        InputError
            if Cycles can't render the scene, or if the two can't be compared.
        """
        camera_object = self.scene.camera
        return self._checker.check(self.scene, camera_object, self._taken, self._stated, is_scenes=_is_scenes(shot))

    def _aim(self, shot: Shot) -> list[str]:
        """Make the shot's camera the scene's; what a reader should know of it."""
        if shot.eye is None:
            among = obstacles.cameras_of(self.scene, self._own)
            camera_object = obstacles.camera_of(shot, self.scene, among, self._settings)
            self._stated, warnings = None, datablocks.beyond_pinhole(camera_object, self.scene)
        else:
            camera_object, self._stated = self._own, obstacles.stated(shot, self._settings.frame_of(shot))
            warnings = cameras.apply(camera_object, self._stated, self.scene)
            warnings += datablocks.beyond_pinhole(camera_object, self.scene)
        self._settings.look_through(camera_object, _is_scenes(shot))
        return warnings


def _is_scenes(shot: Shot) -> bool:
    """True if the scene's own camera takes the shot."""
    return shot.camera is None and shot.eye is None


def _own_camera(overrides: Overrides, scene: bpy.types.Scene, like: bpy.types.Object | None) -> bpy.types.Object:
    """A camera while the overrides last, sharp, with the clip range of another."""
    data = bpy.data.cameras.new(_NAME)
    overrides.afterwards(bpy.data.cameras.remove, data)
    camera_object = bpy.data.objects.new(_NAME, data)
    overrides.afterwards(bpy.data.objects.remove, camera_object)
    if like and like.type == "CAMERA":
        data.clip_start, data.clip_end = like.data.clip_start, like.data.clip_end
    scene.collection.objects.link(camera_object)
    return camera_object
