"""The panel "Virtual Pinhole": in Properties › Camera data, and in the 3D viewport's sidebar."""

import math
from typing import ClassVar

import bpy

from ..errors import InputError
from ..pinhole import Triple
from . import camera as cameras
from . import baking, clipboard, datablocks, hold, readouts
from .properties import VALUES


class _CameraPanel:
    bl_label = "Virtual Pinhole"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return datablocks.camera_in(context) is not None

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(datablocks.camera_in(context).virtual_pinhole, "enabled", text="")

    def draw(self, context: bpy.types.Context) -> None:
        camera_object, layout = datablocks.camera_in(context), self.layout
        group, scene = camera_object.virtual_pinhole, context.scene
        layout.use_property_split = True
        column = layout.column()
        column.active = group.enabled
        for name in VALUES:
            column.prop(group, name)
        column.prop(group, "zoom")
        column.prop(group, "held_roll" if group.pole == "HOLD" else "roll")
        column.prop(group, "pole")
        if group.pole == "HOLD":
            column.prop(group, "hold_within")
        buttons = layout.row(align=True)
        for operator in ("viewcam.apply_camera", "viewcam.adopt_camera"):
            button = buttons.row(align=True)
            button.enabled = group.enabled or operator != "viewcam.apply_camera"
            button.operator(operator).camera = camera_object.name
        clipboard.draw(layout, camera_object)
        rows, warnings = contents(camera_object, scene)
        self._draw_warnings(warnings, context)
        up = better_up(camera_object, scene)
        if up:
            layout.operator("viewcam.choose_up", text=f"Use Up {readouts.vector(up)}").camera = camera_object.name
        _draw_rows(rows, layout)
        baking.draw(layout, camera_object)

    def _draw_warnings(self, warnings: list[str], context: bpy.types.Context) -> None:
        width = context.region.width / context.preferences.system.ui_scale - 60
        for sentence in warnings:
            column = self.layout.column(align=True)
            for i, line in enumerate(readouts.wrapped(sentence, width)):
                column.label(text=line, icon="BLANK1" if i else "ERROR")


class _MovePanel:
    bl_label = "Move"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return datablocks.camera_in(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        name = datablocks.camera_in(context).name
        column = self.layout.column()
        for label, buttons in _MOVES.items():
            split = column.split(factor=0.25)
            heading = split.row()
            heading.alignment = "RIGHT"
            heading.label(text=label)
            row = split.row(align=True)
            for operator, look, properties in buttons:
                button = row.operator(operator, **look)
                button.camera = name
                for key, value in properties.items():
                    setattr(button, key, value)


_STEP = math.radians(15)  # as Blender's own view orbits by Numpad 4, 6, 8 and 2
# The rows: label → (operator, how its button looks, the operator's properties) from left to right.
_MOVES = {
    "From": (("viewcam.adopt_view", {"text": "Current View"}, {}),),
    "Look At": (
        ("viewcam.look_at_selection", {"text": "Selection"}, {}),
        ("viewcam.look_at_cursor", {"text": "Cursor"}, {}),
        ("viewcam.look_at_active", {"text": "Active"}, {}),
    ),
    "Frame by": (
        ("viewcam.frame_selection", {"text": "Eye"}, {"by": "EYE"}),
        ("viewcam.frame_selection", {"text": "Distance"}, {"by": "DISTANCE"}),
    ),
    "Orbit": (
        ("viewcam.orbit_camera", {"text": "", "icon": "TRIA_LEFT"}, {"around": -_STEP}),
        ("viewcam.orbit_camera", {"text": "", "icon": "TRIA_RIGHT"}, {"around": _STEP}),
        ("viewcam.orbit_camera", {"text": "", "icon": "TRIA_UP"}, {"around": 0.0, "upwards": _STEP}),
        ("viewcam.orbit_camera", {"text": "", "icon": "TRIA_DOWN"}, {"around": 0.0, "upwards": -_STEP}),
    ),
    "Eye": (
        ("viewcam.dolly_camera", {"text": "Dolly"}, {}),
        ("viewcam.swap_camera", {"text": "Swap"}, {}),
    ),
    "Up": (("viewcam.level_camera", {"text": "Level"}, {}),),
}


def _draw_rows(rows: list[tuple[str, ...]], layout: bpy.types.UILayout) -> None:
    column = layout.column(align=True)
    for label, *texts in rows:
        split = column.split(factor=0.46 if len(texts) == 1 else 0.1)
        name = split.row()
        name.alignment = "RIGHT"
        name.label(text=label)
        row = split.row()
        for text in texts:
            row.label(text=text)


def contents(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> tuple[list[tuple[str, ...]], list[str]]:
    """The read-outs (readouts.py) and the warnings that the panel shows for a camera."""
    group, warnings = camera_object.virtual_pinhole, []
    try:
        stated = cameras.stated(camera_object, scene)
        if stated:
            warnings += readouts.pose_warnings(stated, group.precision())
            warnings += filter(None, [hold.obstacle(camera_object)])
            warnings += cameras.check(camera_object, stated, scene)
        found = cameras.read(camera_object, scene)
    except InputError as error:
        sentence = datablocks.sentence(error)
        return [], [*warnings, *([] if sentence in warnings else [sentence])]
    warnings += datablocks.beyond_pinhole(camera_object, scene)
    length = datablocks.length(math.dist(stated.eye, stated.look_at), scene) if stated else None
    return readouts.readouts(found, camera_object.data.lens, length), warnings


def better_up(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Triple | None:
    """The up that the panel offers where the stated one leaves the roll in doubt."""
    try:
        stated = cameras.stated(camera_object, scene)
    except InputError:
        return None
    if stated and readouts.roll_warning(stated, camera_object.virtual_pinhole.precision()):
        return readouts.certain_up(stated)
    return None


class VIEWCAM_PT_data(_CameraPanel, bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.camera is not None  # the data may be a lamp's or a mesh's


class VIEWCAM_PT_sidebar(_CameraPanel, bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Pinhole"


class VIEWCAM_PT_data_move(_MovePanel, bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    bl_parent_id = "VIEWCAM_PT_data"


class VIEWCAM_PT_sidebar_move(_MovePanel, bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Pinhole"
    bl_parent_id = "VIEWCAM_PT_sidebar"


CLASSES = (VIEWCAM_PT_data, VIEWCAM_PT_sidebar, VIEWCAM_PT_data_move, VIEWCAM_PT_sidebar_move)
