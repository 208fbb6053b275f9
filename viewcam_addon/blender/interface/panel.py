"""The panel "Virtual Pinhole": in Properties › Camera data, and in the 3D viewport's sidebar; and the menu of its buttons.

What it says is found by functions that a test calls without a window: `notices` here, the rest in readouts.py. They run at
every redraw, so the camera is stated once for the panel, and read once for the read-outs while these are open. Read-outs are
text and no read-only properties: Blender asks for a property at times when nothing may be evaluated, in drivers and overrides.

Blender translates what is a literal here, bl_label and bl_description. What is made of pieces is translated before the pieces
go in (`iface`), and then not again.
"""

import math
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface

from ... import roll as rolls
from ...errors import InputError
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import causes, datablocks, findings, hold, preferences, targets
from . import (
    baking,
    clipboard,
    converting,
    dragging,
    moving,
    operators,
    panel_rows,
    photo_matching,
    presets,
    readouts,
    scene_cameras,
    swipe,
)
from .panel_rows import CameraPanel, InProperties, InSidebar, SubPanel


@dataclass(frozen=True)
class Notice:
    """A sentence of warning.

    remedy : (operator, its button's text) that mends it and nothing else, if there is one.

    is_mended_by_applying : true if setting the camera by its values again mends it.
    """

    sentence: str
    remedy: tuple[str, str] | None = None
    is_mended_by_applying: bool = False


class _MainPanel(CameraPanel):
    bl_label = "Virtual Pinhole"

    def draw_header(self, context: bpy.types.Context) -> None:
        camera_object = datablocks.camera_in(context)
        if camera_object is None:
            return
        group, row = camera_object.virtual_pinhole, self.layout.row()
        row.enabled = group.enabled or bool(standing(camera_object, context.scene))
        row.prop(group, "enabled", text="")

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        presets.VIEWCAM_PT_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        camera_object, layout = datablocks.camera_in(context), self.layout
        if camera_object is None:
            scene_cameras.draw_none(layout)
            return
        scene_cameras.draw_header(layout, camera_object, context)
        panel_rows.begin(layout, context, decorate=True)
        for notice in notices(camera_object, context.scene):
            _draw_notice(layout.column(align=True), notice, camera_object, context)
        if camera_object.virtual_pinhole.enabled:
            _draw_values(layout.column(), camera_object.virtual_pinhole)
        else:
            _draw_standing(layout, camera_object, context)
        clipboard.draw(layout, camera_object)


def _draw_standing(layout: bpy.types.UILayout, camera_object: bpy.types.Object, context: bpy.types.Context) -> None:
    """The camera as it stands while its values are off, which may be stale, and the button that reads them off it."""
    column = layout.column(align=True)
    column.active = False
    values = standing(camera_object, context.scene)
    for label, texts in values:
        panel_rows.listed(column, context, label, texts, share=0.25)
    row = layout.row()
    row.use_property_split = row.use_property_decorate = False
    row.enabled = bool(values)  # else it is no pinhole, as a notice says
    row.prop(camera_object.virtual_pinhole, "enabled", text="Use", toggle=True)


def standing(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> list[tuple[str, tuple[str, ...]]]:
    """(label, texts) of a camera's values as it stands, whatever is stored; none where it is no pinhole."""
    try:
        pinhole = cameras.as_it_stands(camera_object, scene)
    except InputError:
        return []
    roll = math.degrees(rolls.angle_from(preferences.up_axis(), pinhole))
    return [
        ("Camera", tuple(datablocks.length(number, scene, digits=4) for number in readouts.rounded(pinhole.eye))),
        ("Look At", tuple(datablocks.length(number, scene, digits=4) for number in readouts.rounded(pinhole.look_at))),
        ("Up", tuple(f"{number:.4g}" for number in readouts.rounded(pinhole.up))),
        ("Lens", (f"{camera_object.data.lens:.6g} mm",)),
        ("Roll", (f"{round(roll, 3) + 0.0:g}°",)),
    ]


def _draw_values(column: bpy.types.UILayout, group: bpy.types.PropertyGroup) -> None:
    column.active = group.enabled
    followed = causes.followed(group.id_data)
    for point, quantity in (("eye", findings.EYE), ("look_at", findings.VIEW)):
        # Where the point is, its target says, or what places the camera at every frame.
        is_free = quantity not in followed and targets.place(group.id_data, point) is None
        target = targets.target_of(group.id_data, point)
        followers: list[tuple[str, str, tuple[Any, str] | None]] = [(f"{point}_target", "Object", None)]
        if target and target.type == "ARMATURE":
            followers.append((f"{point}_bone", "Bone", (target.data, "bones")))
        elif target and target.type == "MESH":
            followers.append((f"{point}_group", "Group", (target, "vertex_groups")))
        panel_rows.point(column, group, point, is_free, followers)
        _draw_why(column, followed.get(quantity))
    turned = column.column()
    turned.enabled = findings.VIEW not in followed
    panel_rows.point(turned, group, "up", is_free=True, followers=[])
    zoomed = column.column()
    zoomed.enabled = findings.DISTANCE not in followed
    field = {unit: look for look, unit in datablocks.LENSES.items()}.get(group.lens_unit, "distance")
    panel_rows.value(zoomed, group, field, choice="lens_unit")
    is_override = bool(group.id_data.override_library)  # which keeps values, and not the other looks at them
    if is_override and group.lens_unit != "PIXELS":
        _draw_why(column, "Override: edit in px")
    _draw_why(column, followed.get(findings.DISTANCE))
    turned = column.column()
    turned.enabled = findings.VIEW not in followed
    panel_rows.value(turned, group, "held_roll" if group.pole == "HOLD" else "roll")
    if is_override and group.pole != "HOLD":
        _draw_why(column, "Override: edit Up")


def _draw_why(column: bpy.types.UILayout, word: str | None) -> None:
    """Draw what a value that can't be edited follows, if it does."""
    if word:
        row = column.row()
        row.alignment = "RIGHT"
        row.label(text=word, icon="LOCKED")


def _draw_setting(row: bpy.types.UILayout, camera_object: bpy.types.Object) -> None:
    """The two ways to bring values and camera together."""
    row.enabled = camera_object.library is None
    row.operator("viewcam.apply_camera").camera = camera_object.name
    row.operator("viewcam.adopt_camera").camera = camera_object.name


def _draw_notice(
    column: bpy.types.UILayout, notice: Notice, camera_object: bpy.types.Object, context: bpy.types.Context
) -> None:
    panel_rows.sentence(column, context, iface(notice.sentence), "ERROR")
    if notice.remedy:
        operator, text = notice.remedy
        column.operator(operator, text=text, translate=False).camera = camera_object.name
    if notice.is_mended_by_applying:
        _draw_setting(panel_rows.buttons(column, context), camera_object)


class _OptionsPanel(SubPanel):
    bl_label = "Options"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        camera_object = datablocks.camera_in(context)
        return camera_object is not None and camera_object.virtual_pinhole.enabled

    def draw(self, context: bpy.types.Context) -> None:
        camera_object: Any = datablocks.camera_in(context)
        group, layout = camera_object.virtual_pinhole, self.layout
        panel_rows.begin(layout, context, decorate=True)
        column = layout.column()
        zoomed = column.column()
        zoomed.enabled = findings.DISTANCE not in causes.followed(camera_object)
        panel_rows.field(zoomed, group, "zoom")
        panel_rows.field(column, group, "keeps")
        panel_rows.field(column, group, "pole")
        if group.pole == "HOLD":
            panel_rows.field(column, group, "hold_within")
        _draw_setting(panel_rows.buttons(layout, context), camera_object)
        baking.draw(layout, camera_object)
        converting.draw(layout, camera_object)


class _MovePanel(SubPanel):
    bl_label = "Move"

    def draw(self, context: bpy.types.Context) -> None:
        camera_object: Any = datablocks.camera_in(context)
        column = self.layout.column()
        column.enabled = camera_object.library is None
        for label, buttons in _MOVES.items():
            row = panel_rows.described(column, context, label, (), share=0.25)
            row = row.row(align=True) if "icon" in buttons[0][1] else panel_rows.buttons(row, context)
            for operator, look, properties in buttons:
                button = row.operator(operator, **look)
                button.camera = camera_object.name
                for key, value in properties.items():
                    setattr(button, key, value)


_STEP = math.radians(15)  # as Blender's own view orbits by Numpad 4, 6, 8 and 2
# The rows: label → (operator, how its button looks, the operator's properties) from left to right.
_MOVES: dict[str, tuple[tuple[str, dict[str, Any], dict[str, Any]], ...]] = {
    "From": (("viewcam.adopt_view", {"text": "Current View"}, {}),),
    "Look At": (
        ("viewcam.look_at_selection", {"text": "Selection"}, {}),
        ("viewcam.look_at_cursor", {"text": "Cursor"}, {}),
        ("viewcam.look_at_active", {"text": "Active"}, {}),
    ),
    "Frame by": (
        ("viewcam.frame_selection", {"text": "Eye"}, {"by": "EYE"}),
        ("viewcam.frame_selection", {"text": "Lens"}, {"by": "DISTANCE"}),
    ),
    "Orbit": (
        ("viewcam.orbit_camera", {"text": "", "icon": "TRIA_LEFT"}, {"around": -_STEP}),
        ("viewcam.orbit_camera", {"text": "", "icon": "TRIA_RIGHT"}, {"around": _STEP}),
        ("viewcam.orbit_camera", {"text": "", "icon": "TRIA_UP"}, {"around": 0.0, "upwards": _STEP}),
        ("viewcam.orbit_camera", {"text": "", "icon": "TRIA_DOWN"}, {"around": 0.0, "upwards": -_STEP}),
    ),
    "Drag": tuple(
        ("viewcam.drag_camera", {"text": dragging.NAMES[kind]}, {"kind": kind})
        for kind in (dragging.ORBIT, dragging.DOLLY, dragging.TRUCK)
    ),
    "Zoom": (("viewcam.drag_camera", {"text": dragging.NAMES[dragging.DOLLY_ZOOM]}, {"kind": dragging.DOLLY_ZOOM}),),
    "Eye": (("viewcam.swap_camera", {"text": "Swap"}, {}),),
    "Up": (("viewcam.level_camera", {"text": "Level"}, {}),),
}


class _ReadOutsPanel(SubPanel):
    bl_label = "Read-Outs"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.layout.column(align=True)
        for readout in readouts_of(datablocks.camera_in(context), context.scene):
            share = 0.4 if len(readout.texts) == 1 else 0.1
            row = panel_rows.described(column, context, readout.label, readout.texts, share)
            button = row.operator("viewcam.copy_readout", text="", icon="COPYDOWN", emboss=False)
            button.label, button.text = readout.label, readout.exact


def notices(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> list[Notice]:
    """The warnings of the panel."""
    try:
        stated = cameras.stated(camera_object, scene)
        if stated is None:
            cameras.read(camera_object, scene)
            result = []
        else:
            result = _doubts(camera_object, stated)
            result += map(_notice, cameras.check(camera_object, stated, scene))
    except InputError as error:
        return [Notice(datablocks.sentence(error))]
    return [*result, *map(Notice, datablocks.beyond_pinhole(camera_object, scene))]


def _notice(finding: findings.Finding) -> Notice:
    """A finding as it is drawn, with the button that mends it, if there is one."""
    button = finding.cause.mended_by if finding.cause else None
    deletes = button == findings.Button.DELETE_KEYFRAMES
    remedy = ("viewcam.delete_keyframes", iface("Delete These Keyframes")) if deletes else None
    return Notice(finding.sentence, remedy, is_mended_by_applying=button == findings.Button.APPLY_AGAIN)


def _doubts(camera_object: bpy.types.Object, stated: Pinhole) -> list[Notice]:
    """The warnings about the values, wherever the camera is."""
    result = []
    if sentence := readouts.roll_warning(stated, camera_object.virtual_pinhole.precision()):
        up = readouts.vector(readouts.certain_up(stated))
        result.append(Notice(sentence, ("viewcam.choose_up", iface("Use Up {up}").format(up=up))))
    sentences = (readouts.distance_warning(stated), hold.obstacle(camera_object), *targets.warnings(camera_object))
    return result + [Notice(sentence) for sentence in sentences if sentence]


def readouts_of(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> list[readouts.Readout]:
    """The read-outs of a camera; none where it is no pinhole, which a notice says."""
    group = camera_object.virtual_pinhole
    try:
        pinhole = cameras.read(camera_object, scene)
    except InputError:
        return []
    eye, look_at, _, _ = group.numbers()
    reach = math.dist(eye, look_at) if group.enabled else math.nan
    length = datablocks.length(reach, scene) if math.isfinite(reach) else None
    frame = datablocks.frame_of(scene)
    at_full_size = pinhole.distance[0] * (frame.resolution_x / frame.size[0])
    return readouts.readouts(pinhole, camera_object.data.lens, at_full_size, (length, reach) if length else None)


def _draw_focus(blenders: bpy.types.Panel, context: bpy.types.Context) -> None:
    """In Blender's own panel Depth of Field."""
    camera_object = datablocks.camera_in(context)
    if camera_object and camera_object.data == context.camera and camera_object.virtual_pinhole.enabled:
        row = blenders.layout.row()
        row.use_property_split = True
        row.active = context.camera.dof.use_dof and context.camera.dof.focus_object is None
        row.prop(camera_object.virtual_pinhole, "focus_on_look_at")


class VIEWCAM_PT_data(_MainPanel, InProperties, bpy.types.Panel):
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        # The data may be a lamp's or a mesh's, and pinned data may have lost its object.
        return context.camera is not None and super().poll(context)


class VIEWCAM_PT_sidebar(_MainPanel, InSidebar, bpy.types.Panel):
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene is not None


VIEWCAM_PT_data_options, VIEWCAM_PT_sidebar_options = panel_rows.in_both_places("options", _OptionsPanel)
VIEWCAM_PT_data_move, VIEWCAM_PT_sidebar_move = panel_rows.in_both_places("move", _MovePanel)
VIEWCAM_PT_data_readouts, VIEWCAM_PT_sidebar_readouts = panel_rows.in_both_places("readouts", _ReadOutsPanel)


class VIEWCAM_MT_cameras(bpy.types.Menu):
    """View › Cameras › Virtual Pinhole, in the 3D viewport: all buttons once more.

    Blender's search (F3) looks through menus; what stands in none is found by developers alone.
    """

    bl_idname = "VIEWCAM_MT_cameras"
    bl_label = "Virtual Pinhole"

    def draw(self, _context: bpy.types.Context) -> None:
        for group in (
            moving.CLASSES,
            operators.CLASSES,
            baking.CLASSES,
            clipboard.IN_MENUS,
            scene_cameras.OPERATORS,
            photo_matching.OPERATORS,
            swipe.CLASSES,
        ):
            for each in group:
                if each is moving.VIEWCAM_OT_drag_camera:
                    for kind, name in dragging.NAMES.items():
                        self.layout.operator(each.bl_idname, text=f"Drag: {name}").kind = kind
                else:
                    self.layout.operator(each.bl_idname)
            self.layout.separator()
        self.layout.menu(clipboard.VIEWCAM_MT_copy_camera_as.bl_idname)


def _draw_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.menu(VIEWCAM_MT_cameras.bl_idname)


CLASSES = (
    VIEWCAM_PT_data,
    VIEWCAM_PT_sidebar,
    VIEWCAM_PT_data_options,
    VIEWCAM_PT_sidebar_options,
    VIEWCAM_PT_data_move,
    VIEWCAM_PT_sidebar_move,
    VIEWCAM_PT_data_readouts,
    VIEWCAM_PT_sidebar_readouts,
    VIEWCAM_MT_cameras,
)


def register() -> None:
    bpy.types.DATA_PT_camera_dof.append(_draw_focus)
    bpy.types.VIEW3D_MT_view_cameras.append(_draw_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_view_cameras.remove(_draw_menu)
    bpy.types.DATA_PT_camera_dof.remove(_draw_focus)
