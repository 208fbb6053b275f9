"""The buttons that move the camera: from the viewport's view, look at, dolly, orbit, frame, swap, level.

Each takes the camera's values, or where the Virtual Pinhole is not enabled the camera as it stands, moves them in float64
(moves.py) and states them again, which enables it. A roll that is held through the pole becomes a part of up thereby. What a
button asks for can be adjusted afterwards, as with Blender's own, in the viewport's redo panel or by F9.

In the edit mode of an object Ctrl-Z brings back that object's geometry and nothing else; that is Blender's way with all that
stands outside of it.
"""

import contextlib
import math
from collections.abc import Callable
from dataclasses import replace

import bpy

from ... import moves, rotation
from ...errors import InputError
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import datablocks, preferences, targets
from . import dragging, readouts, selection, viewport
from .operators import CameraOperator, possible


class _Move(CameraOperator):
    """A subclass says in `moved(pinhole, camera_object, scene)` where the camera goes."""

    moved: Callable[[Pinhole, bpy.types.Object, bpy.types.Scene], Pinhole]

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        pinhole = cameras.current(camera_object, scene)
        before = dragging.state(camera_object)
        for finding in cameras.apply(camera_object, self.moved(pinhole, camera_object, scene), scene):
            self.report({"WARNING"}, finding)
        dragging.key_changes(camera_object, before, scene)


class _SelectionMove(_Move):
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        chosen = selection.objects(context, datablocks.camera_in(context))
        return possible(cls, chosen, "Nothing but the camera is selected: select what it shall look at")


class VIEWCAM_OT_adopt_view(_Move, bpy.types.Operator):
    bl_idname = "viewcam.adopt_view"
    bl_label = "From Current View"
    bl_description = (
        "Put the camera where the 3D viewport looks from, so that its picture shows all that the viewport shows. "
        "The point about which the view turns becomes the look-at point"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        sentence = "There is no 3D viewport in this window: open one"
        return super().poll(context) and possible(cls, viewport.area_in(context), sentence)

    def moved(self, pinhole: Pinhole, _camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole:
        area = viewport.area_in(bpy.context)
        if area is None:
            raise InputError("there is no 3D viewport in this window: open one")
        return viewport.pinhole_of(area, pinhole, scene)


class VIEWCAM_OT_look_at_selection(_SelectionMove, bpy.types.Operator):
    bl_idname = "viewcam.look_at_selection"
    bl_label = "Look at Selection"
    bl_description = "Bring the selection's center into the middle of the view. The camera turns and stays where it is"

    center: bpy.props.EnumProperty(
        name="Center",
        description="Which point of the selection the camera looks at",
        items=(
            ("BOUNDS", "Bounding Box", "The middle of the box about the selection, along the world's axes"),
            ("MEDIAN", "Median", "The mean of all vertices: where there are many it weighs more"),
        ),
    )

    def moved(self, pinhole: Pinhole, camera_object: bpy.types.Object, _scene: bpy.types.Scene) -> Pinhole:
        points = selection.points(bpy.context, camera_object)
        return replace(
            pinhole, look_at=selection.median(points) if self.center == "MEDIAN" else selection.bounds_center(points)
        )


class VIEWCAM_OT_look_at_cursor(_Move, bpy.types.Operator):
    bl_idname = "viewcam.look_at_cursor"
    bl_label = "Look at 3D Cursor"
    bl_description = "Bring the 3D cursor into the middle of the view. The camera turns and stays where it is"

    def moved(self, pinhole: Pinhole, _camera_object: bpy.types.Object, _scene: bpy.types.Scene) -> Pinhole:
        return replace(pinhole, look_at=tuple(bpy.context.scene.cursor.location))


class VIEWCAM_OT_look_at_active(_Move, bpy.types.Operator):
    bl_idname = "viewcam.look_at_active"
    bl_label = "Look at Active Object"
    bl_description = "Bring the active object's origin into the middle of the view. The camera turns and stays where it is"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        is_other = context.active_object and context.active_object != datablocks.camera_in(context)
        sentence = "No object but the camera is active: make another one active"
        return super().poll(context) and possible(cls, is_other, sentence)

    def moved(self, pinhole: Pinhole, camera_object: bpy.types.Object, _scene: bpy.types.Scene) -> Pinhole:
        active = bpy.context.active_object
        if active is None or active == camera_object:
            raise InputError("no object but the camera is active: make another one active")
        evaluated = active.evaluated_get(bpy.context.evaluated_depsgraph_get())
        return replace(pinhole, look_at=tuple(rotation.float64(evaluated.matrix_world.translation).tolist()))


class VIEWCAM_OT_dolly_camera(_Move, bpy.types.Operator):
    bl_idname = "viewcam.dolly_camera"
    bl_label = "Dolly to Distance"
    bl_description = "Move the eye along the view to a distance from the look-at point. The lens stays as it is"

    reach: bpy.props.FloatProperty(
        name="To Look-At",
        description="How far the eye shall be from the look-at point; at first as far as it is",
        subtype="DISTANCE",
        unit="LENGTH",
        soft_min=0.001,
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask for the distance: at the one that there is nothing would be seen to happen."""
        camera_object = self.target_camera(context)
        if camera_object is None or self.properties.is_property_set("reach"):
            return self.execute(context)
        with contextlib.suppress(InputError):  # which is told where the distance is confirmed
            pinhole = cameras.current(camera_object, datablocks.scene_of(camera_object))
            self.reach = math.dist(pinhole.eye, pinhole.look_at)
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.prop(self, "reach")

    def moved(self, pinhole: Pinhole, _camera_object: bpy.types.Object, _scene: bpy.types.Scene) -> Pinhole:
        if not self.properties.is_property_set("reach"):
            self.reach = math.dist(pinhole.eye, pinhole.look_at)
            return pinhole
        return moves.dollied(pinhole, self.reach)


class VIEWCAM_OT_orbit_camera(_Move, bpy.types.Operator):
    bl_idname = "viewcam.orbit_camera"
    bl_label = "Orbit"
    bl_description = (
        "Carry the eye about the look-at point. Over the pole the picture does not flip: the camera comes down the other side "
        "upside down, and up turns into its opposite"
    )

    around: bpy.props.FloatProperty(
        name="Around",
        description="By how much the eye goes around up, to the right as the picture shows it",
        subtype="ANGLE",
        default=math.radians(15),
        options={"SKIP_SAVE"},
    )
    upwards: bpy.props.FloatProperty(
        name="Upwards",
        description="By how much the eye rises over the look-at point, upwards as the picture shows it",
        subtype="ANGLE",
        options={"SKIP_SAVE"},
    )

    def moved(self, pinhole: Pinhole, _camera_object: bpy.types.Object, _scene: bpy.types.Scene) -> Pinhole:
        return moves.orbited(pinhole, -self.around if pinhole.mirrored else self.around, self.upwards)


class VIEWCAM_OT_drag_camera(_Move, bpy.types.Operator):
    bl_idname = "viewcam.drag_camera"
    bl_label = "Drag Camera"
    bl_description = (
        "Orbit, dolly or truck with the mouse, or by a typed number. Click or Enter is done, Escape takes it back, "
        "Shift is precise"
    )

    kind: bpy.props.EnumProperty(
        name="Move",
        description="How the camera goes with the mouse",
        items=tuple(
            (kind, dragging.NAMES[kind], text)
            for kind, text in (
                (dragging.ORBIT, "The eye goes around the look-at point"),
                (dragging.DOLLY, "The eye goes towards the look-at point or away from it"),
                (dragging.DOLLY_ZOOM, "The same, and the lens keeps the size of what is at the look-at point"),
                (dragging.TRUCK, "The camera goes sideways and up, and keeps its direction"),
            )
        ),
        options={"SKIP_SAVE"},
    )
    amount: bpy.props.FloatVectorProperty(
        name="Amount",
        description="Radians around and upwards, or world units to the right and upwards, or away from the look-at point",
        size=2,
        options={"SKIP_SAVE"},
    )

    def moved(self, pinhole: Pinhole, _camera_object: bpy.types.Object, _scene: bpy.types.Scene) -> Pinhole:
        return dragging.moved(pinhole, self.kind, tuple(self.amount))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        camera_object = self.target_camera(context)
        try:
            if camera_object is None:
                raise InputError("there is no camera: select one")
            self._drag = dragging.Drag(camera_object, datablocks.scene_of(camera_object), self.kind)
        except InputError as error:
            self.report({"ERROR"}, datablocks.sentence(error))
            return {"CANCELLED"}
        self._at = event.mouse_x, event.mouse_y
        context.window_manager.modal_handler_add(self)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        drag, is_pressed = self._drag, event.value == "PRESS"
        if event.type == "MOUSEMOVE":
            drag.move(event.mouse_x - self._at[0], event.mouse_y - self._at[1], event.shift)
            self._at = event.mouse_x, event.mouse_y
        elif event.type in {"ESC", "RIGHTMOUSE"} and is_pressed:
            drag.cancel()
            context.workspace.status_text_set(None)
            return {"CANCELLED"}
        elif event.type in {"LEFTMOUSE", "RET", "NUMPAD_ENTER"} and is_pressed:
            self.amount = drag.amount
            drag.confirm()
            for finding in drag.findings:
                self.report({"WARNING"}, finding)
            context.workspace.status_text_set(None)
            return {"FINISHED"}
        elif event.type == "BACK_SPACE" and is_pressed:
            drag.type(drag.text[:-1])
        elif is_pressed and event.unicode and event.unicode in "0123456789.-":
            drag.type(drag.text + event.unicode)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def _tell(self, context: bpy.types.Context) -> None:
        typed = f" [{self._drag.text}]" if self._drag.text else ""
        keys = "Mouse or number: move    Shift: precise    LMB, Enter: confirm    RMB, Esc: cancel"
        context.workspace.status_text_set(f"{dragging.NAMES[self.kind]}{typed}    {keys}")


class VIEWCAM_OT_frame_selection(_SelectionMove, bpy.types.Operator):
    bl_idname = "viewcam.frame_selection"
    bl_label = "Frame Selection"
    bl_description = "Bring the selection into the middle of the picture and make all of its points fill it, up to a margin"

    by: bpy.props.EnumProperty(
        name="By",
        description="What changes until the selection fills the picture",
        items=(
            ("EYE", "Eye", "The eye moves along the view, and the perspective changes"),
            ("DISTANCE", "Lens", "The view-plane distance d changes: the camera zooms, and the perspective stays"),
        ),
    )
    center: bpy.props.BoolProperty(
        name="Center",
        description="Bring the selection into the middle: by the eye, the camera moves sideways and keeps its direction; by "
        "the lens, it turns where it stands. Where the look-at point follows an object the view stays with that",
        default=True,
    )
    margin: bpy.props.FloatProperty(
        name="Margin",
        description="How much of the picture's width and height stays free at each edge",
        subtype="PERCENTAGE",
        default=5.0,
        min=0.0,
        max=49.0,
    )

    def moved(self, pinhole: Pinhole, camera_object: bpy.types.Object, _scene: bpy.types.Scene) -> Pinhole:
        points = selection.points(bpy.context, camera_object)
        if self.center and "look-at" not in targets.names(camera_object):
            center = selection.bounds_center(points)
            pinhole = replace(pinhole, look_at=center) if self.by == "DISTANCE" else moves.trucked_to(pinhole, center)
        frame = moves.framed_by_distance if self.by == "DISTANCE" else moves.framed_by_eye
        return frame(pinhole, points, self.margin / 100)


class VIEWCAM_OT_swap_camera(_Move, bpy.types.Operator):
    bl_idname = "viewcam.swap_camera"
    bl_label = "Swap Eye and Look-At"
    bl_description = "Look back from the look-at point to where the eye is now"

    def moved(self, pinhole: Pinhole, _camera_object: bpy.types.Object, _scene: bpy.types.Scene) -> Pinhole:
        return moves.swapped(pinhole)


class VIEWCAM_OT_level_camera(_Move, bpy.types.Operator):
    bl_idname = "viewcam.level_camera"
    bl_label = "Level"
    bl_description = (
        "Make up the preferred axis, the world's Z, so that the horizon is level. Where the view is so close to it that this "
        "leaves the roll in doubt, the up that says the same for certain"
    )

    def moved(self, pinhole: Pinhole, _camera_object: bpy.types.Object, _scene: bpy.types.Scene) -> Pinhole:
        level = replace(pinhole, up=preferences.up_axis())
        in_doubt = readouts.roll_warning(level, precision=2.0**-24)
        return replace(level, up=readouts.certain_up(level)) if in_doubt else level


CLASSES = (
    VIEWCAM_OT_adopt_view,
    VIEWCAM_OT_look_at_selection,
    VIEWCAM_OT_look_at_cursor,
    VIEWCAM_OT_look_at_active,
    VIEWCAM_OT_dolly_camera,
    VIEWCAM_OT_orbit_camera,
    VIEWCAM_OT_drag_camera,
    VIEWCAM_OT_frame_selection,
    VIEWCAM_OT_swap_camera,
    VIEWCAM_OT_level_camera,
)
