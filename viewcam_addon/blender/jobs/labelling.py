"""The labels of a shot: the scene goes to the labeller (jobs/labeller.py), a process beside this one, which writes them.

Flow goes to the frames before and after through the shot's own camera, as it stands in each of them: one of the file moves as
it is animated, and the four values stand still. The scene is exported at those frames as well, and given back at the shot's.
"""

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from ...jobs.labeller import Labeller
from ...pinhole import Pinhole
from .. import datablocks
from ..rendering import job
from ..temporary_settings import overridden
from .scene_files import SceneFiles

_FRAMES = 4
"""Scenes kept: the frame, its neighbours, and the one that comes next."""


class ShotLabels:
    """Labels shots of one file after another; a context manager. threads : all by default."""

    def __init__(self, threads: int | None = None) -> None:
        self._ends = contextlib.ExitStack()
        self._labeller = self._ends.enter_context(Labeller(threads))
        self._files = self._ends.enter_context(SceneFiles(_FRAMES))

    def write(
        self,
        scene: bpy.types.Scene,
        camera_object: bpy.types.Object,
        pinhole: Pinhole,
        picture: Path,
        kinds: Sequence[str],
        depth_steps: float,
        is_still: bool,
    ) -> list[str]:
        """Write the labels of what a camera sees, as the scene stands, beside a picture; the names of the files.

        pinhole : the camera of the picture, as its sidecar has it. kinds, depth_steps : as in Renderer.label. is_still :
        whether it stands so at every frame.

        Raises
        ------
        InputError
            if the scene can't be exported, or the labeller can't write.
        """
        with overridden() as overrides:
            if not scene.render.use_crop_to_border:  # the picture is of the whole frame then
                overrides.set(scene.render, "use_border", False)
            frames = {"here": self._seen(scene, camera_object, pinhole)}
            if "flow" in kinds:
                frame, subframe = scene.frame_current, scene.frame_subframe
                overrides.afterwards(scene.frame_set, frame, subframe=subframe)
                for name, step in (("previous", -1), ("next", 1)):
                    scene.frame_set(frame + step, subframe=subframe)
                    frames[name] = self._seen(scene, camera_object, pinhole if is_still else None)
        return self._labeller.write(frames, picture, kinds, depth_steps)

    def _seen(self, scene: bpy.types.Scene, camera_object: bpy.types.Object, pinhole: Pinhole | None) -> dict[str, Any]:
        """What the labeller is told of the scene at its frame."""
        export = self._files.exported(scene, job.rendered_layer(scene), camera_object)
        data = camera_object.evaluated_get(datablocks.depsgraph_of(scene)).data
        clip = (data.clip_start, data.clip_end) if pinhole else export.scene.clip
        return Labeller.frame(self._files.file_of(export.scene), pinhole or export.scene.camera, clip)

    def __enter__(self) -> "ShotLabels":
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()
