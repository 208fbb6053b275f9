"""Match Photo: edges, a rectangle or known points, dragged over the picture in camera view, become the camera (photo_match.py).

`Drawing` is what has been drawn, in pixels of the picture, and what follows from it; a test draws in it without a window. The
modal operator brings the mouse to it and the camera to what it says, after every move, so that the view shows what it found.
Escape brings all back to the bit; Enter makes one step of undo. Scene units are never touched: edges keep the eye where it
is, and sides and points are told in the units that the scene has.

What is drawn stays on the picture, whatever the camera does: in camera view the picture's frame stands still. How exactly it is
drawn follows from how many of its pixels one of the screen shows. Rejected: grease pencil or empties for the lines (they would
be in the file), and gizmos (Blender makes none of them on a picture's pixels).
"""

import functools
from dataclasses import dataclass, field
from typing import Any, ClassVar

import bpy
import numpy as np
from mathutils import Vector

from ... import photo_match
from ...comparison.statistics import plain
from ...errors import InputError, counted
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import datablocks, targets
from . import dragging, overlay, panel_rows, readouts
from .operators import CameraOperator, possible
from .panel_rows import BelowSidebar, SubPanel

EDGES, RECTANGLE, POINTS = "EDGES", "RECTANGLE", "POINTS"
_AXES = "XYZ"
_NEAR = 12  # pixels of the screen within which the mouse takes an end
_SHORT = 8  # and a line that is shorter than this was a click
_HANDLE, _LETTERS = 4, 13  # half a handle's size, and the letters', in points
_PANELS_LETTERS = 11  # points
_TOOLS = 50  # points that the toolbar may take
_HELP = {
    EDGES: "Drag along an edge, towards where its axis points   X Y Z: axis to draw, or to mend   Backspace: delete",
    RECTANGLE: "Click the corners: origin, along the first side, and around   Drag one to move it   Backspace: delete",
    POINTS: "Drag each selected object to where the picture shows it",
}

Place = tuple[float, float]  # in the picture, pixels

_drawn = None  # shown by the viewport while a match goes on


@dataclass
class Drawing:
    """The drawing on a picture.

    like : the camera as it was, whose picture it is.
    kind : EDGES, RECTANGLE or POINTS.
    axes : the axes along which the rectangle's sides run.
    sides : the lengths of the rectangle's sides.
    origin : the rectangle's first corner, world space.
    places : the points' places in world space.
    ends : pixels, two an edge, or one a corner or point.
    along : the axis of each edge.
    axis : the axis of the next edge.
    exact : the largest error of what is drawn, pixels of the picture.
    is_lens_known : true to keep the lens as it was.
    is_principal_point_free : true to find it from edges.
    length : world units, of the first edge, which begins at the origin then; 0 where that is not known.
    """

    like: Pinhole
    kind: str = EDGES
    axes: str = "XY"
    sides: Place = (1.0, 1.0)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    places: tuple = ()
    ends: list[Place] = field(default_factory=list)
    along: list[str] = field(default_factory=list)
    axis: str = "X"
    exact: float = 1.0
    is_lens_known: bool = False
    is_principal_point_free: bool = False
    length: float = 0.0
    taken: int | None = None

    def press(self, place: Place, reach: float, exact: float) -> None:
        """Take the end that is within reach, pixels of the picture, else begin a new edge or corner.

        Edges along other axes keep their ends: a box has edges along all three that begin in one corner.
        """
        self.exact = max(self.exact, exact)
        distances = [
            np.hypot(x - place[0], y - place[1]) if self.kind != EDGES or self.along[i // 2] == self.axis else np.inf
            for i, (x, y) in enumerate(self.ends)
        ]
        if distances and min(distances) <= reach:
            self.taken = int(np.argmin(distances))
        elif self.kind == EDGES:
            self.ends += [place, place]
            self.along.append(self.axis)
            self.taken = len(self.ends) - 1
        elif self.kind == RECTANGLE and len(self.ends) < 4:
            self.ends.append(place)
            self.taken = len(self.ends) - 1

    def move(self, place: Place) -> None:
        if self.taken is not None:
            self.ends[self.taken] = place

    def release(self, shortest: float) -> None:
        """Let go. shortest : an edge that is not as long was a click, and is none."""
        if self.taken is not None and self.kind == EDGES:
            first = self.taken - self.taken % 2
            (a, b), (c, d) = self.ends[first : first + 2]
            if np.hypot(a - c, b - d) < shortest:
                del self.ends[first : first + 2], self.along[first // 2]
        self.taken = None

    def delete(self) -> None:
        """Take away what was drawn last; known points stay."""
        if self.kind != POINTS and self.ends:
            del self.ends[-2 if self.kind == EDGES else -1 :]
            del self.along[len(self.ends) // 2 :]
        self.taken = None

    def match(self) -> photo_match.Match:
        """The camera that follows. Raises InputError as photo_match does."""
        distance = self.like.distance[0] if self.is_lens_known else None
        if self.kind == EDGES:
            edges = [(axis, self.ends[2 * i], self.ends[2 * i + 1]) for i, axis in enumerate(self.along)]
            whole = [edge for edge in edges if np.hypot(*np.subtract(edge[2], edge[1])) >= 1.0]
            known = photo_match.KnownEdge(0, self.length, self.origin) if self.length > 0 else None
            return photo_match.from_edges(whole, self.like, self.exact, distance, known, self.is_principal_point_free)
        if self.kind == RECTANGLE:
            if len(self.ends) < 4:
                raise InputError(f"the rectangle has {len(self.ends)} of 4 corners: click the next")
            return photo_match.from_rectangle(self.ends, self.sides, self.like, self.exact, self.origin, self.axes, distance)
        return photo_match.from_points(self.places, self.ends, self.like, self.exact, distance)


def summary_of(match: photo_match.Match, lens: float) -> list[str]:
    """The lines of the viewport about a match. lens : millimeters."""
    low, high = match.distance_between
    d = match.pinhole.distance[0]
    share = (high - low) / 2 / d
    size = f"{lens:.4g} mm ± {plain(100 * share)} %,  d = {d:.5g} px ± {plain((high - low) / 2)} px"
    lines = [size if high > low else f"{lens:.4g} mm as it was,  d = {d:.5g} px"]
    if match.principal_point_error:
        middle = match.pinhole.width / 2, match.pinhole.height / 2
        off = zip(np.subtract(match.pinhole.principal_point, middle), match.principal_point_error, strict=True)
        right, up = (f"{value:+.4g} ± {plain(error)} px" for value, error in off)
        lines.append(f"Principal point: {right} to the right of the middle, {up} above it")
    names = {"look_at": "look-at", "up": "roll", "distance": "lens", "eye": "eye", "principal_point": "principal point"}
    lines.append("In the picture: " + ",  ".join(f"{names[name]} ± {plain(value)} px" for name, value in match.pixels.items()))
    if match.error:
        lines.append(f"What is drawn misses by {plain(match.error)} px")
    return lines


class MatchSettings(bpy.types.PropertyGroup):
    """`window_manager.virtual_pinhole_match`: how the next photo is matched, and what the last one came to."""

    kind: bpy.props.EnumProperty(
        name="From",
        description="What of the photo is known",
        items=(
            (
                EDGES,
                "Edges",
                "Two or more edges along each of two or three axes. The camera turns and zooms; the eye stays, unless a length "
                "is known",
            ),
            (RECTANGLE, "Rectangle", "A rectangle of known sides, one corner of which is at the 3D cursor"),
            (POINTS, "Selected Objects", "Objects whose places are known: four in one plane, or six"),
        ),
    )
    axes: bpy.props.EnumProperty(
        name="Along",
        description="The axes along which the rectangle's first and second side run",
        items=[(pair, f"{pair[0]}, {pair[1]}", "") for pair in ("XY", "XZ", "YZ", "YX", "ZX", "ZY")],
    )
    sides: bpy.props.FloatVectorProperty(
        name="Sides",
        description="Lengths of the rectangle's first and second side",
        subtype="XYZ_LENGTH",
        unit="LENGTH",
        size=2,
        default=(1.0, 1.0),
        min=1e-9,
    )
    is_lens_known: bpy.props.BoolProperty(
        name="Keep the Lens", description="The camera has the photo's lens already, from its EXIF data: only the pose is asked"
    )
    is_principal_point_free: bpy.props.BoolProperty(
        name="Free Principal Point",
        description="Find the camera's Shift as well, as of a photo that was cropped or taken with a shift lens: it takes "
        "edges along all three axes, which converge. Else the camera keeps its own",
    )
    length: bpy.props.FloatProperty(
        name="First Edge",
        description="Length of the edge that is drawn first, which begins at the 3D cursor: it says where the camera stands. "
        "With 0 the eye stays where it is",
        unit="LENGTH",
        min=0.0,
    )
    precision: bpy.props.FloatProperty(
        name="Precision",
        description="How exactly you drag, in pixels of the screen: one standard deviation. Zoom in to be more exact",
        default=1.0,
        min=0.01,
        soft_max=10.0,
        precision=2,
    )


class VIEWCAM_OT_match_photo(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.match_photo"
    bl_label = "Match Photo"
    bl_description = (
        "Find the camera of a photograph: in camera view, over its background image, drag along edges whose axes are known, "
        "or the corners of a rectangle, or known objects to where the photo shows them"
    )
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO", "BLOCKING"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        area = context.area
        is_through = area and area.type == "VIEW_3D" and area.spaces.active.region_3d.view_perspective == "CAMERA"
        sentence = "Look through the camera first (Numpad 0): the edges are drawn in camera view"
        return super().poll(context) and possible(cls, is_through, sentence)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        global _drawn
        try:
            space = context.space_data
            self.camera_object = space.camera if space.use_local_camera else context.scene.camera
            self.drawing = begun(self.camera_object, context)
        except InputError as error:
            self.report({"ERROR"}, datablocks.sentence(error))
            return {"CANCELLED"}
        self.before, self.sentence = dragging.state(self.camera_object), ""
        self.result: Any = None  # a Match
        self.frame: Any = None  # left, bottom, right and top of the picture in the region, once it has been drawn
        _drawn = self
        context.window_manager.modal_handler_add(self)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        drawing = self.drawing
        if event.type in ("ESC", "RIGHTMOUSE") and event.value == "PRESS":
            return self._leave(context, canceled=True)
        if event.type in ("RET", "NUMPAD_ENTER") and event.value == "PRESS":
            return self._leave(context, canceled=self.result is None)
        if context.region_data is None or context.region_data.view_perspective != "CAMERA":
            return self._leave(context, canceled=True)
        if event.type in ("WHEELUPMOUSE", "WHEELDOWNMOUSE") or (event.type == "MIDDLEMOUSE" and (event.shift or event.ctrl)):
            return {"PASS_THROUGH"}
        if self.frame is None:  # nothing has been drawn yet
            return {"RUNNING_MODAL"}
        place, zoom = self._in_picture(event)
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            drawing.press(place, _NEAR * zoom, zoom * context.window_manager.virtual_pinhole_match.precision)
        elif event.type == "MOUSEMOVE" and drawing.taken is not None:
            drawing.move(place)
        elif event.type == "LEFTMOUSE" and event.value == "RELEASE":
            drawing.move(place)
            drawing.release(_SHORT * zoom)
        elif event.type in _AXES and event.value == "PRESS":
            drawing.axis = event.type
        elif event.type in ("BACK_SPACE", "DEL") and event.value == "PRESS":
            drawing.delete()
        else:
            return {"RUNNING_MODAL"}
        self._follow(context)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender closes the window or the file."""
        self._leave(context, canceled=True)

    def _in_picture(self, event: bpy.types.Event) -> tuple[Place, float]:
        """The mouse's place in the picture, and how many of its pixels one of the screen shows."""
        left, bottom, right, top = self.frame
        like = self.drawing.like
        x, y = event.mouse_region_x + 0.5, event.mouse_region_y + 0.5
        place = (x - left) / (right - left) * like.width, (y - bottom) / (top - bottom) * like.height
        return place, like.width / (right - left)

    def _follow(self, context: bpy.types.Context) -> None:
        """The camera goes where what is drawn says; where it says nothing, it is as it was."""
        try:
            self.result = self.drawing.match()
            cameras.apply(self.camera_object, self.result.pinhole, context.scene)
            self.sentence = ""
        except InputError as error:
            self.result, self.sentence = None, datablocks.sentence(error)
            dragging.restore(self.camera_object, self.before)

    def _tell(self, context: bpy.types.Context) -> None:
        axis = f"   Axis: {self.drawing.axis}" if self.drawing.kind == EDGES else ""
        context.workspace.status_text_set(f"{_HELP[self.drawing.kind]}{axis}   Enter: confirm   Esc: cancel")
        context.area.tag_redraw()

    def _leave(self, context: bpy.types.Context, canceled: bool) -> set[str]:
        global _drawn
        _drawn = None
        context.workspace.status_text_set(None)
        if context.area:
            context.area.tag_redraw()
        if canceled:
            dragging.restore(self.camera_object, self.before)
            return {"CANCELLED"}
        self.report({"INFO"}, summary_of(self.result, self.camera_object.data.lens)[0])
        return {"FINISHED"}


def begun(camera_object: bpy.types.Object | None, context: bpy.types.Context) -> Drawing:
    """A drawing on the picture of a camera, as the settings say.

    Raises InputError if there is no such camera, or its values can't be set, or its pixels are not square.
    """
    scene, settings = context.scene, context.window_manager.virtual_pinhole_match
    if camera_object is None:
        raise InputError("there is no camera: add one")
    datablocks.check_perspective(camera_object)
    if any(targets.place(camera_object, point) is not None for point in targets.POINTS):
        raise InputError(f"camera {camera_object.name!r} follows an object: clear it first")
    if datablocks.is_animated(camera_object):
        raise InputError(f"camera {camera_object.name!r} has animated values: clear their keyframes and drivers first")
    if scene.render.use_border and scene.render.use_crop_to_border:
        raise InputError("the picture is cropped to the render region: switch Crop to Render Region off")
    like = cameras.current(camera_object, scene)
    if like.mirrored or like.distance[0] != like.distance[1]:
        raise InputError("the picture is mirrored or its pixels are not square: a photo's are neither")
    drawing = Drawing(like, settings.kind, settings.axes, tuple(settings.sides), tuple(scene.cursor.location))
    drawing.is_lens_known, drawing.length = settings.is_lens_known, settings.length
    drawing.is_principal_point_free = settings.is_principal_point_free
    if drawing.kind == POINTS:
        chosen = [each for each in context.selected_objects if each != camera_object]
        drawing.places = tuple(tuple(each.matrix_world.translation) for each in chosen)
        if len(chosen) < 4:
            raise InputError(f"only {counted(len(chosen), 'object')} selected: select four in one plane, or six")
        column, row, away = like.project(drawing.places)
        middle = like.width / 2, like.height / 2
        drawing.ends = [
            (float(x), float(y)) if z > 0 and 0 <= x <= like.width and 0 <= y <= like.height else middle
            for x, y, z in zip(column, row, away, strict=True)
        ]
    return drawing


def frame_in(context: bpy.types.Context, camera_object: bpy.types.Object) -> tuple[float, float, float, float]:
    """(left, bottom, right, top) of the picture in the region that is drawn, in its pixels."""
    region, matrix = context.region, context.region_data.window_matrix
    corners = []
    for corner in camera_object.data.view_frame(scene=context.scene):
        x, y, _, w = matrix @ Vector((*corner, 1.0))
        corners.append(((x / w + 1) / 2 * region.width, (y / w + 1) / 2 * region.height))
    xs, ys = zip(*corners, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def _right_end(context: bpy.types.Context) -> float:
    """The right end of what the sidebar leaves of the region that is drawn, in its pixels."""
    region = context.region
    begins = [each.x - region.x for each in context.area.regions if each.type == "UI" and each.width > 1]
    return min([region.width, *(x for x in begins if x > region.width / 2)])


def _draw() -> None:
    """The lines, their ends, and what follows from them."""
    context, match = bpy.context, _drawn
    if match is None or context.region_data is None or context.region_data.view_perspective != "CAMERA":
        return
    import blf
    import gpu
    from gpu_extras.batch import batch_for_shader

    match.frame = frame_in(context, match.camera_object)
    left, bottom, right, top = match.frame
    drawing, scale = match.drawing, context.preferences.system.ui_scale
    size = np.array([(right - left) / drawing.like.width, (top - bottom) / drawing.like.height])
    ends = [tuple(np.array(end) * size + (left, bottom)) for end in drawing.ends]
    theme = dict(zip(_AXES, overlay._axis_colors(context).values(), strict=True))
    if drawing.kind == EDGES:
        lines = [(ends[2 * i], ends[2 * i + 1], theme[axis]) for i, axis in enumerate(drawing.along)]
    elif drawing.kind == RECTANGLE:
        closed = [*ends, ends[0]] if len(ends) == 4 else ends
        along = [theme[drawing.axes[i % 2]] for i in range(4)]
        lines = [(a, b, color) for a, b, color in zip(closed, closed[1:], along, strict=False)]
    else:
        lines = []
    gpu.state.blend_set("ALPHA")
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    for width, dark in ((5.0, True), (2.5, False)):
        for start, end, color in lines:
            shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
            shader.uniform_float("lineWidth", width * scale)
            shader.uniform_float("color", (0.0, 0.0, 0.0, 0.5) if dark else color)
            batch_for_shader(shader, "LINES", {"pos": [(*start, 0.0), (*end, 0.0)]}).draw(shader)
    flat = gpu.shader.from_builtin("UNIFORM_COLOR")
    for half, color in ((_HANDLE + 1.5, (0.0, 0.0, 0.0, 0.6)), (_HANDLE, (1.0, 1.0, 1.0, 1.0))):
        flat.uniform_float("color", color)
        for x, y in ends:
            r = half * scale
            square = [(x - r, y - r), (x + r, y - r), (x - r, y + r), (x + r, y + r)]
            batch_for_shader(flat, "TRI_STRIP", {"pos": square}).draw(flat)
    gpu.state.blend_set("NONE")
    words = (
        summary_of(match.result, match.camera_object.data.lens) if match.result else [match.sentence] if match.sentence else []
    )
    blf.size(0, _LETTERS * scale)
    # Along the lower edge: above are the header, the names of view and camera, and left the tools.
    x, y = max(left, _TOOLS * scale) + 10 * scale, max(bottom, 0.0) + 0.8 * _LETTERS * scale
    room = (_right_end(context) - x) / scale * _PANELS_LETTERS / _LETTERS
    lines_of_text = [line for sentence in words for line in readouts.wrapped(sentence, room)]
    for number, line in enumerate(reversed(lines_of_text)):
        blf.enable(0, blf.SHADOW)
        blf.shadow(0, 3, 0.0, 0.0, 0.0, 1.0)
        blf.color(0, 1.0, 1.0, 1.0, 1.0)
        blf.position(0, x, y + 1.6 * number * _LETTERS * scale, 0)
        blf.draw(0, line)
        blf.disable(0, blf.SHADOW)


class VIEWCAM_PT_sidebar_match(SubPanel, BelowSidebar, bpy.types.Panel):
    bl_label = "Photo Match"

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.window_manager.virtual_pinhole_match
        panel_rows.begin(layout, context)
        column = layout.column()
        panel_rows.field(column, settings, "kind")
        if settings.kind == RECTANGLE:
            column.prop(settings, "sides")
            panel_rows.field(column, settings, "axes")
        elif settings.kind == EDGES:
            column.prop(settings, "length")
            column.prop(settings, "is_principal_point_free")
        column.prop(settings, "is_lens_known")
        column.prop(settings, "precision")
        layout.operator("viewcam.match_photo", icon="CAMERA_DATA")


OPERATORS = (VIEWCAM_OT_match_photo,)
CLASSES = (*OPERATORS, VIEWCAM_PT_sidebar_match)


@functools.cache
def _handler() -> object:
    return bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_PIXEL")


def register() -> None:
    bpy.utils.register_class(MatchSettings)
    bpy.types.WindowManager.virtual_pinhole_match = bpy.props.PointerProperty(type=MatchSettings)
    _handler()


def unregister() -> None:
    global _drawn
    if _drawn:  # Blender takes a modal operator that is unregistered away without its cancel()
        dragging.restore(_drawn.camera_object, _drawn.before)
        bpy.context.workspace.status_text_set(None)
    _drawn = None
    bpy.types.SpaceView3D.draw_handler_remove(_handler(), "WINDOW")
    _handler.cache_clear()
    del bpy.types.WindowManager.virtual_pinhole_match
    bpy.utils.unregister_class(MatchSettings)
