"""Handles in the 3D viewport that drag eye, look-at and up of the active camera.

Each is one of Blender's own move gizmos on a property that is got and set here (`Handles`, one for the window manager, not in
any file), so that Blender drags, snaps with Ctrl and shows the tooltip by itself. A drag starts with the first value that
Blender sets; the values and the camera as they were until then are kept. Canceling sets the first value again, upon which all
of it comes back to the bit. A drag ends when none of Blender's modal operators drags a gizmo any more: then it becomes one step
of undo, and a keyframe where a value has a curve and auto keying is on.

A viewport that looks through the camera has the look-at point's handle alone, smaller and without snapping: dragging it pans.
Eye and up would carry the view along, and what the mouse points at; these are dragged in another viewport.

Behind each handle lies a wider dark one that the mouse does not take: a halo, with which it reads on light and on dark.

Rejected: custom gizmos (Python's do not react to the mouse), `eye` itself as the gizmo's property (canceling would leave the
camera where the values put it, not where it was), `Gizmo.use_undo` (from 5.2 on alone), and watching `is_modal` when the
viewport is drawn (a quick drag is over before it is drawn, and in a quad view each view has its own handles).
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import bpy
import numpy as np

from ... import diagram as diagrams
from ...pinhole import Triple
from .. import datablocks
from . import overlay
from .dragging import key_changes
from .dragging import restore as _restore
from .dragging import state as _state

_TWEAK = "GIZMOGROUP_OT_gizmo_tweak"
_LOOKED_AT = 0.01  # seconds between two looks at whether a drag has ended
_LABELS = {"eye": "Eye", "look_at": "Look-At", "up": "Up"}
# The order in which the mouse takes handles that cover each other: seen from above, up's tip is over the eye.
_PRIORITY = {"eye": 2000, "look_at": 1000, "up": 0}
_HALO_WIDTH = 4.0  # pixels
_DRAWN = [(name, is_halo) for is_halo in (True, False) for name in _LABELS]  # in this order


@dataclass(frozen=True)
class _Drag:
    """A drag that goes on, from before its first move."""

    camera_name: str
    name: str
    start: Triple  # as Blender has it, rounded to float32
    length: float  # up's
    before: dict[str, object]  # `_state`
    window: bpy.types.Window


_drag: _Drag | None = None


def camera_in(context: bpy.types.Context) -> bpy.types.Object | None:
    """The camera that has handles in the context's viewport: the active object, if its values are in use and can be edited."""
    active = context.view_layer.objects.active
    if not active or not active.is_editable:
        return None
    is_seen = overlay.is_shown(active, context) or overlay.looked_through(context) == active
    return active if is_seen and active.virtual_pinhole.show_handles else None


def place(camera_object: bpy.types.Object, name: str) -> Triple | None:
    """The place of a handle, in world space, or None: an object has the point, or the values make no camera."""
    group = camera_object.virtual_pinhole
    if getattr(group, f"{name}_target", None):
        return None
    eye, look_at, up, _ = group.numbers()
    if name != "up":
        point = {"eye": eye, "look_at": look_at}[name]
    elif eye == look_at or not any(up):
        return None
    else:
        point = diagrams.up_tip(eye, look_at, up, group.plane_at)
    return point if np.isfinite(point).all() else None


def drag(camera_object: bpy.types.Object, name: str, value: Triple) -> None:
    """Bring a handle to a place in world space. A drag's first call keeps what was; the place at that time brings it back."""
    global _drag
    if _drag and (_drag.camera_name, _drag.name) != (camera_object.name, name):  # over, and the timer has not looked yet
        end_drag()
    if _drag is None:
        start: Any = tuple(np.array(place(camera_object, name), np.float32).tolist())
        length = math.hypot(*camera_object.virtual_pinhole.up)
        _drag = _Drag(camera_object.name, name, start, length, _state(camera_object), bpy.context.window)
        if not bpy.app.timers.is_registered(_end_if_over):
            bpy.app.timers.register(_end_if_over, first_interval=_LOOKED_AT)
    group = camera_object.virtual_pinhole
    if tuple(value) == _drag.start:
        _restore(camera_object, _drag.before)
    elif name != "up":
        setattr(group, name, value)
    elif any(arrow := np.subtract(value, group.numbers()[0])):
        group.up = arrow * (_drag.length / math.hypot(*arrow))


def _end_if_over() -> float | None:
    """Blender's timer asks again after so many seconds, as long as a gizmo is dragged."""
    windows = bpy.context.window_manager.windows
    if any(operator.bl_idname == _TWEAK for window in windows for operator in window.modal_operators):
        return _LOOKED_AT
    end_drag()
    return None


def end_drag() -> None:
    """End a drag: what was dragged becomes a keyframe, where auto keying asks for one, and a step of undo; what was canceled
    does not."""
    global _drag
    ended, _drag = _drag, None
    camera_object = bpy.data.objects.get((ended.camera_name, None)) if ended else None
    if ended is None or camera_object is None or _state(camera_object) == ended.before:
        return
    key_changes(camera_object, ended.before, datablocks.scene_of(camera_object))
    _push_undo(f"Drag {_LABELS[ended.name]}", ended.window)


def _push_undo(message: str, window: bpy.types.Window) -> None:
    windows = list(bpy.context.window_manager.windows)
    with bpy.context.temp_override(window=window if window in windows else windows[0]):
        bpy.ops.ed.undo_push(message=message)


def _handle_property(name: str, description: str) -> bpy.props.FloatVectorProperty:
    def get(_handles: "Handles") -> Triple:
        camera_object = camera_in(bpy.context)
        return (camera_object and place(camera_object, name)) or (0.0, 0.0, 0.0)

    def set(_handles: "Handles", value: Triple) -> None:
        camera_object = camera_in(bpy.context)
        if camera_object and place(camera_object, name):
            x, y, z = value
            drag(camera_object, name, (x, y, z))

    return bpy.props.FloatVectorProperty(
        name=_LABELS[name], description=description, subtype="TRANSLATION", get=get, set=set, options={"SKIP_SAVE"}
    )


class Handles(bpy.types.PropertyGroup):
    """The handles' places in the viewport that is drawn or used, world space. Setting one drags it."""

    eye: _handle_property("eye", "Drag the eye. Ctrl snaps to what is under the mouse, Shift is precise, Escape takes it back")
    look_at: _handle_property(
        "look_at", "Drag the look-at point. Ctrl snaps to what is under the mouse, Shift is precise, Escape takes it back"
    )
    up: _handle_property("up", "Drag the tip of up. Its length does not matter. Shift is precise, Escape takes it back")


class VIEWCAM_GGT_handles(bpy.types.GizmoGroup):
    bl_label = "Virtual Pinhole Handles"
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options: ClassVar[set[str]] = {"3D", "PERSISTENT", "SHOW_MODAL_ALL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.space_data.show_gizmo_context and camera_in(context) is not None

    def setup(self, context: bpy.types.Context) -> None:
        for name, is_halo in _DRAWN:
            handle = self.gizmos.new("GIZMO_GT_move_3d")
            handle.target_set_prop("offset", context.window_manager.virtual_pinhole_handles, name)
            handle.draw_style = "CROSS_2D" if name == "look_at" else "RING_2D"
            handle.draw_options = {"ALIGN_VIEW", "FILL_SELECT"}
            handle.use_tooltip = handle.use_draw_modal = True
            if is_halo:  # the mouse's target keeps its width, or it would take the things behind
                handle.hide_select, handle.line_width = True, _HALO_WIDTH
            handle.select_bias = _PRIORITY[name]

    def draw_prepare(self, context: bpy.types.Context) -> None:
        camera_object, theme = camera_in(context), context.preferences.themes[0].user_interface
        is_through = camera_object is not None and overlay.looked_through(context) == camera_object
        for handle, (name, is_halo) in zip(self.gizmos, _DRAWN, strict=True):
            handle.hide = camera_object is None or place(camera_object, name) is None or (is_through and name != "look_at")
            handle.scale_basis = 0.06 if is_through else 0.12
            handle.use_snap = name != "up" and not is_through
            if is_halo:
                handle.color, handle.alpha = overlay.HALO[:3], overlay.HALO[3]
                continue
            handle.color, handle.alpha = theme.gizmo_secondary if name == "up" else theme.gizmo_primary, 1.0
            handle.color_highlight, handle.alpha_highlight = theme.gizmo_hi, 1.0


CLASSES = (Handles, VIEWCAM_GGT_handles)


def register() -> None:
    bpy.types.WindowManager.virtual_pinhole_handles = bpy.props.PointerProperty(type=Handles, options={"SKIP_SAVE"})


def unregister() -> None:
    global _drag
    _drag = None
    if bpy.app.timers.is_registered(_end_if_over):
        bpy.app.timers.unregister(_end_if_over)
    del bpy.types.WindowManager.virtual_pinhole_handles
