"""The labels of a shot: the scene goes to the tracer's process (jobs/tracing.py), which writes them.

What objects are and where their joints are, custom properties say: `category` of an object, and `keypoint`, its name, of an
empty below it, or below the armature that moves it.

Flow goes to the frames before and after through the shot's own camera, as it stands in each of them: one of the file moves as
it is animated, and the four values stand still. The scene is exported at those frames as well, and given back at the shot's.
"""

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from ...cameras.calibration import Calibration
from ...jobs.job import Job
from ...jobs.tracing import Tracing
from ...pinhole import Pinhole
from .. import datablocks
from ..temporary_settings import overridden
from .scene_files import SceneFiles
from .stage import staged

_FRAMES = 4
"""Scenes kept: the frame, its neighbors, and the one that comes next."""


class ShotLabels:
    """Labels shots of one file after another; a context manager. tracing : the process that traces."""

    def __init__(self, tracing: Tracing) -> None:
        self._tracing = tracing
        self._ends = contextlib.ExitStack()
        self._files = self._ends.enter_context(SceneFiles(_FRAMES))

    def write(
        self,
        scene: bpy.types.Scene,
        camera_object: bpy.types.Object,
        pinhole: Pinhole,
        picture: Path,
        kinds: Sequence[str],
        depth_steps: float,
        job: Job,
    ) -> list[str]:
        """Write the labels of what a camera sees, as the scene stands, beside a picture; the names of the files.

        pinhole : the camera that took the picture.
        kinds, depth_steps : see Renderer.label.
        job : the job; a camera of four values stands still.

        Raises InputError if the scene can't be exported, or the labels not be written.
        """
        calibration = job.calibration
        annotations = _annotations(scene)
        with overridden() as overrides:
            frames = {"here": self._seen(scene, camera_object, pinhole, calibration)}
            if "flow" in kinds:
                frame, subframe = scene.frame_current, scene.frame_subframe
                overrides.afterwards(scene.frame_set, frame, subframe=subframe)
                for name, step in (("previous", -1), ("next", 1)):
                    scene.frame_set(frame + step, subframe=subframe)
                    still = pinhole if job.eye is not None else None
                    frames[name] = self._seen(scene, camera_object, still, calibration)
        lens = calibration.lens if calibration else None
        return self._tracing.label(frames, picture, kinds, depth_steps, job.threads, lens, annotations)

    def _seen(
        self, scene: bpy.types.Scene, camera_object: bpy.types.Object, pinhole: Pinhole | None, calibration: Calibration | None
    ) -> dict[str, Any]:
        """The request of the tracer's process about the scene at its frame."""
        with staged(Job(), scene, camera_object, whole=True) as stage:
            export = self._files.exported(stage)
        data = camera_object.evaluated_get(datablocks.depsgraph_of(scene)).data
        clip = (data.clip_start, data.clip_end) if pinhole else export.scene.clip
        seen = pinhole or export.scene.camera
        return Tracing.frame(self._files.file_of(export.scene), calibration.at(seen) if calibration else seen, clip)

    def __enter__(self) -> "ShotLabels":
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()


def _annotations(scene: bpy.types.Scene) -> dict[str, dict[str, Any]]:
    """The category and the keypoints of each object that has some, by its name."""
    graph = datablocks.depsgraph_of(scene)
    result: dict[str, dict[str, Any]] = {
        each.name: {"category": str(each["category"])} for each in bpy.data.objects if "category" in each
    }
    joints = {
        each: str(each["keypoint"]) or each.name for each in bpy.data.objects if each.type == "EMPTY" and "keypoint" in each
    }
    of_bones = {(each.parent, each.parent_bone): name for each, name in joints.items() if each.parent_type == "BONE"}
    for empty, name in joints.items():
        above, owner = _joint_above(empty, joints, of_bones), empty.parent
        while owner is not None and owner.type == "EMPTY":
            owner = owner.parent
        if owner is None:
            continue
        owners = [owner] if owner.type != "ARMATURE" else [each for each in bpy.data.objects if each.find_armature() == owner]
        place = empty.evaluated_get(graph).matrix_world.translation
        for each in owners:
            local = each.evaluated_get(graph).matrix_world.inverted_safe() @ place
            about = result.setdefault(each.name, {})
            about.setdefault("keypoints", {})[name] = [*local]
            if above is not None:
                about.setdefault("bones", {})[name] = above
    return result


def _joint_above(
    empty: bpy.types.Object, joints: dict[bpy.types.Object, str], of_bones: dict[tuple[bpy.types.Object, str], str]
) -> str | None:
    """The joint that a joint hangs on: the next empty above it that is one, or that of the next bone above its own."""
    while empty.parent is not None and empty.parent_type != "BONE":
        empty = empty.parent
        if empty in joints:
            return joints[empty]
    rig = empty.parent
    bone = rig.data.bones.get(empty.parent_bone) if rig is not None and rig.type == "ARMATURE" else None
    above = (of_bones.get((rig, each.name)) for each in (bone.parent_recursive if bone else ()))
    return next(filter(None, above), None)
