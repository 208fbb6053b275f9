"""The buttons: set the camera by its values again, take them from the camera as it stands, choose an up that is certain.

They work in any mode and on any camera: the one that is named, else the active one, else the scene's.
"""

import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar

import bpy

from ...errors import InputError
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import datablocks
from . import readouts


def possible(operator: Any, condition: object, otherwise: str) -> bool:
    """The answer of an operator's `poll`: whether a condition holds.

    otherwise : a sentence that Blender shows beside the disabled button.
    """
    if not condition:
        operator.poll_message_set(otherwise)
    return bool(condition)


class NamesCamera:
    """An operator that is told which camera it is for."""

    camera: bpy.props.StringProperty(
        name="Camera",
        description="Name of the camera object, or empty for the active or the scene's camera",
        options={"SKIP_SAVE"},
    )

    def target_camera(self, context: bpy.types.Context) -> bpy.types.Object | None:
        """The object that is meant, if there is one."""
        return bpy.data.objects.get(self.camera) if self.camera else datablocks.camera_in(context)

    def required_camera(self, context: bpy.types.Context) -> bpy.types.Object:
        """The object that is meant, or InputError."""
        result = self.target_camera(context)
        if result is None:
            raise InputError(f"there is no camera {self.camera!r}: name another")
        return result


class ReportsErrors:
    """An operator that says in `run(context)` what it does; an InputError there is its report, and cancels it."""

    run: Callable[[bpy.types.Context], None]
    report: Callable[[set[str], str], None]  # Blender's

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            self.run(context)
        except InputError as error:
            self.report({"ERROR"}, datablocks.sentence(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class CameraOperator(NamesCamera, ReportsErrors):
    """The base of all operators of a camera. A subclass says in `work(camera_object, scene)` what it does."""

    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}
    work: Callable[[bpy.types.Object, bpy.types.Scene], None]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return possible(cls, context.scene and len(bpy.data.cameras), "There is no camera")

    def run(self, context: bpy.types.Context) -> None:
        camera_object = self.target_camera(context)
        if camera_object is None:
            raise InputError(f"there is no camera {self.camera!r}" if self.camera else "there is no camera: select one")
        self.work(camera_object, datablocks.scene_of(camera_object))


class VIEWCAM_OT_apply_camera(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.apply_camera"
    bl_label = "Apply Again"
    bl_description = "Set the camera by its eye, look-at, up and distance"

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        _stated(camera_object, scene)
        cameras.CameraSync.of(camera_object).edited(scene)
        for finding in cameras.check(camera_object, _stated(camera_object, scene), scene):
            self.report({"WARNING"}, finding.sentence)


class VIEWCAM_OT_adopt_camera(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.adopt_camera"
    bl_label = "Adopt Camera"
    bl_description = "Take eye, look-at, up and distance from the camera as it stands. It does not move"

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        cameras.adopt(camera_object, scene)


class VIEWCAM_OT_choose_up(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.choose_up"
    bl_label = "Use a Certain Up"
    bl_description = "Replace up by the one that gives the same picture and leaves no doubt about its roll"

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        pinhole = _stated(camera_object, scene)
        better = dataclasses.replace(pinhole, up=readouts.certain_up(pinhole))
        for finding in cameras.apply(camera_object, better, scene):
            self.report({"WARNING"}, finding)


def _stated(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole:
    pinhole = cameras.stated(camera_object, scene)
    if pinhole is None:
        raise InputError(f"the Virtual Pinhole of camera {camera_object.name!r} is not enabled: enable it, or adopt the camera")
    return pinhole


CLASSES = (VIEWCAM_OT_apply_camera, VIEWCAM_OT_adopt_camera, VIEWCAM_OT_choose_up)
