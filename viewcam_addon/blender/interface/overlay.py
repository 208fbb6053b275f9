"""The camera's diagram in the 3D viewport: what the text draws (diagram.py), of each enabled camera that is selected or active.

It is drawn in Blender's own drawing of the viewport and asks for none itself: whatever moves a camera redraws the viewport as
it is. Lines are sent to the graphics card once for each camera and each pose (`_batches`), relative to the eye. A viewport that
looks through the camera shows a small mark at its look-at point instead, and one whose overlays are off shows nothing. Lines
and letters have a dark halo, with which the same colors read on light and on dark.

Rejected: a custom gizmo (gizmos are drawn whole even where a surface hides them, and not with overlays), and mesh or empty
objects in the scene (they would be in the file, the outliner and the render).
"""

import functools
import math
from collections.abc import Iterable, Iterator
from typing import Any

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

from ... import diagram as diagrams
from ...errors import InputError
from ...pinhole import Pinhole, Triple
from .. import camera as cameras
from .. import datablocks, preferences
from . import panel_rows
from .panel_rows import SubPanel

_NAMES = ("u", "v", "w")
_LETTER_SIZE = 16  # points
_LETTER_AT = 1.1  # in lengths of the axis, beyond its tip
_BESIDE = 1.2  # in a letter's size, from the eye or the look-at point to its letter
_FAINT = 0.35  # share of a line's opacity, for the grid
HALO, _HALO_WIDTH = (0.0, 0.0, 0.0, 0.45), 2.5  # its color, and by how many pixels it is wider than its line
_OUTLINE = 6  # blf.shadow's number for it
_MARK = (4.0, 9.0)  # pixels from the look-at point at which each of the mark's four strokes begins and ends

_handlers: list[object] = []


def is_shown(camera_object: bpy.types.Object, context: bpy.types.Context) -> bool:
    """True if a 3D viewport shows this object as an enabled camera, and does not look through it."""
    if camera_object.type != "CAMERA" or not camera_object.virtual_pinhole.enabled:
        return False
    if not _is_viewport(context) or camera_object == looked_through(context):
        return False
    return camera_object.visible_get(view_layer=context.view_layer, viewport=context.space_data)


def looked_through(context: bpy.types.Context) -> bpy.types.Object | None:
    """The enabled camera that the context's viewport looks through."""
    if not _is_viewport(context) or context.region_data.view_perspective != "CAMERA":
        return None
    camera_object = context.space_data.camera if context.space_data.use_local_camera else context.scene.camera
    return camera_object if camera_object and camera_object.type == "CAMERA" and camera_object.virtual_pinhole.enabled else None


def _is_viewport(context: bpy.types.Context) -> bool:
    """True if it is a window's: File › Render › Viewport draws one from anywhere."""
    return context.space_data is not None and context.space_data.type == "VIEW_3D" and context.region_data is not None


def _cameras(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The cameras whose diagram is drawn in the context's viewport."""
    if not _is_viewport(context) or not context.space_data.overlay.show_overlays:
        return []
    layer = context.view_layer
    meant = dict.fromkeys((*layer.objects.selected, layer.objects.active))  # once each
    return [block for block in meant if block and is_shown(block, context) and block.virtual_pinhole.show_overlay]


def _figures(context: bpy.types.Context) -> Iterator[tuple[Pinhole, Triple, float]]:
    """The cameras that `diagrams.diagram` is to draw in the context's viewport; values that make no camera have no diagram."""
    for camera_object in _cameras(context):
        group = camera_object.virtual_pinhole
        try:
            if stated := cameras.stated(camera_object, context.scene):
                yield stated, group.numbers()[2], group.plane_at
        except InputError:  # the panel shows it
            continue


@functools.lru_cache(maxsize=512)
def _diagram(pinhole: Pinhole, up: Triple, share: float) -> diagrams.Diagram | None:
    drawing = diagrams.diagram(pinhole, up, share)
    return drawing if drawing.is_drawable() else None


@functools.lru_cache(maxsize=512)
def _batches(pinhole: Pinhole, up: Triple, share: float) -> dict | None:
    """The diagram's parts on the graphics card, by name."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    figure = _diagram(pinhole, up, share)
    if figure is None:
        return None
    lines = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    frame = np.stack([figure.plane, np.roll(figure.plane, -1, axis=0)], axis=1)
    arrows = {name: diagrams.arrow(tip) for name, tip in zip((*_NAMES, "up"), (*figure.axes, figure.up), strict=True)}
    parts = {"grid": figure.grid, "pyramid": figure.pyramid, "frame": frame, "view": figure.view, **arrows}
    batches = {
        name: batch_for_shader(lines, "LINES", {"pos": part.reshape(-1, 3).astype(np.float32)})
        for name, part in parts.items()
        if part.size
    }
    flat = gpu.shader.from_builtin("UNIFORM_COLOR")
    batches["plane"] = batch_for_shader(flat, "TRI_FAN", {"pos": figure.plane.astype(np.float32)})
    return batches


def _axis_colors(context: bpy.types.Context) -> dict[str, tuple[float, ...]]:
    theme = context.preferences.themes[0].user_interface
    return {name: (*color, 1.0) for name, color in zip(_NAMES, (theme.axis_x, theme.axis_y, theme.axis_z), strict=True)}


def _draw_lines() -> None:
    context = bpy.context
    figures = list(_figures(context))
    if not figures:
        return
    import gpu

    chosen, pixel = preferences.get(), context.preferences.system.pixel_size
    line, plane = tuple(chosen.line_color), tuple(chosen.plane_color)
    faint = (*line[:3], _FAINT * line[3])
    pens = {"grid": (faint, 1.0), "pyramid": (line, 1.0), "view": (line, 1.0), "frame": (line, 2.0), "up": (line, 2.0)}
    pens |= {name: (color, 2.5) for name, color in _axis_colors(context).items()}
    halos = {name: (HALO, width + _HALO_WIDTH) for name, (_, width) in pens.items() if name != "grid"}
    lines, flat = (gpu.shader.from_builtin(name) for name in ("POLYLINE_UNIFORM_COLOR", "UNIFORM_COLOR"))
    state = gpu.state
    before = state.blend_get(), state.depth_test_get(), state.depth_mask_get()
    state.blend_set("ALPHA")
    state.depth_test_set("LESS_EQUAL")
    state.depth_mask_set(False)
    for figure in figures:
        batches = _batches(*figure)
        if batches is None:
            continue
        with gpu.matrix.push_pop():
            gpu.matrix.translate(figure[0].eye)
            flat.uniform_float("color", plane)
            batches["plane"].draw(flat)
            for name, (color, width) in (*halos.items(), *pens.items()):
                if name in batches:
                    lines.uniform_float("viewportSize", state.viewport_get()[2:])
                    lines.uniform_float("lineWidth", width * pixel)
                    lines.uniform_float("color", color)
                    batches[name].draw(lines)
    for restore, value in zip((state.blend_set, state.depth_test_set, state.depth_mask_set), before, strict=True):
        restore(value)


def _draw_letters() -> None:
    context = bpy.context
    figures = list(_figures(context))
    _draw_mark(context)
    if not figures:
        return
    import blf

    font, size, line = 0, _LETTER_SIZE * context.preferences.system.ui_scale, tuple(preferences.get().line_color)
    colors = _axis_colors(context) | dict.fromkeys(("up", "e", "l"), (*line[:3], 1.0))
    blf.size(font, size)
    blf.enable(font, blf.SHADOW)
    blf.shadow(font, _OUTLINE, *HALO[:3], 1.0)
    for pinhole, up, share in figures:
        figure = _diagram(pinhole, up, share)
        eye = _pixel(pinhole.eye, context)
        if figure is None:
            continue
        tips = zip((*_NAMES, "up"), (*figure.axes, figure.up), strict=True)
        places = {name: _pixel(np.add(pinhole.eye, _LETTER_AT * tip), context) for name, tip in tips} if eye else {}
        places = {name: at for name, at in places.items() if at and (at - eye).length > size}
        corners = [_pixel(np.add(pinhole.eye, corner), context) for corner in figure.plane]
        look_at = _pixel(pinhole.look_at, context)
        lines = {"e": (eye, [*places.values(), *corners, look_at]), "l": (look_at, [eye])}
        for name, (at, ends) in lines.items():
            if at:
                places[name] = at + _BESIDE * size * _clearest([end - at for end in ends if end])
        for name, at in places.items():
            assert at is not None
            width, height = blf.dimensions(font, name)
            blf.position(font, at.x - width / 2, at.y - height / 2, 0)
            blf.color(font, *colors[name])
            blf.draw(font, name)
    blf.disable(font, blf.SHADOW)


def _clearest(lines: list[Vector]) -> Vector:
    """The one of eight directions on the screen that is farthest from where lines go, of the same the first, to the lower
    right."""
    directions = [Vector((math.cos(angle), math.sin(angle))) for angle in np.arange(8) * (math.pi / 4) - math.pi / 4]
    return min(directions, key=lambda way: max((round(way.dot(line.normalized()), 6) for line in lines), default=0.0))


def mark(context: bpy.types.Context) -> Vector | None:
    """The place in the context's region of the look-at point of the camera that its viewport looks through."""
    camera_object = looked_through(context)
    if camera_object is None or not camera_object.virtual_pinhole.show_overlay or not context.space_data.overlay.show_overlays:
        return None
    look_at = camera_object.virtual_pinhole.numbers()[1]
    return _pixel(look_at, context) if np.isfinite(look_at).all() else None


def _draw_mark(context: bpy.types.Context) -> None:
    at = mark(context)
    if at is None:
        return
    import gpu
    from gpu_extras.batch import batch_for_shader

    pixel = context.preferences.system.pixel_size
    strokes = [
        (*(at + pixel * distance * Vector(side)), 0.0) for side in ((1, 0), (0, 1), (-1, 0), (0, -1)) for distance in _MARK
    ]
    lines = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    batch = batch_for_shader(lines, "LINES", {"pos": strokes})
    before = gpu.state.blend_get()
    gpu.state.blend_set("ALPHA")
    for color, width in ((HALO, 1.0 + _HALO_WIDTH), (tuple(preferences.get().line_color), 1.0)):
        lines.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
        lines.uniform_float("lineWidth", width * pixel)
        lines.uniform_float("color", color)
        batch.draw(lines)
    gpu.state.blend_set(before)


def _pixel(point: Iterable[float], context: bpy.types.Context) -> Vector | None:
    """The place in the context's region of a point in world space, or None where it lies beyond what the viewport shows."""
    clipped = context.region_data.perspective_matrix @ Vector((*point, 1.0))
    if abs(clipped.z) > clipped.w:
        return None
    return location_3d_to_region_2d(context.region, context.region_data, point)


class _ShowPanel(SubPanel):
    """The options of the diagram and the handles (gizmos.py)."""

    bl_label = "Show"

    def draw(self, context: bpy.types.Context) -> None:
        camera_object: Any = datablocks.camera_in(context)
        group, layout = camera_object.virtual_pinhole, self.layout
        panel_rows.begin(layout, context, decorate=True)
        column = layout.column(heading="Viewport")
        column.active = group.enabled
        column.prop(group, "show_handles")
        column.prop(group, "show_overlay")
        row = layout.column()
        row.active = group.enabled and (group.show_overlay or group.show_handles)
        row.prop(group, "plane_at")


VIEWCAM_PT_data_show, VIEWCAM_PT_sidebar_show = panel_rows.in_both_places("show", _ShowPanel)


CLASSES = (VIEWCAM_PT_data_show, VIEWCAM_PT_sidebar_show)


def register() -> None:
    for draw, when in ((_draw_lines, "POST_VIEW"), (_draw_letters, "POST_PIXEL")):
        _handlers.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", when))


def unregister() -> None:
    while _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(_handlers.pop(), "WINDOW")
    _batches.cache_clear()
    _diagram.cache_clear()
