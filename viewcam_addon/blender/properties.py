"""`object.virtual_pinhole`: the values as Blender shows and keeps them, and the camera that moves when one of them is edited.

A property group that stores and does not think: what its values are is a `CameraValues` (camera_values.py, read and written by
storage.py), and what they do to the camera stands in camera.py.

`roll` is not stored: it is the angle about the view by which the picture is turned from what the preferred up axis says, read
off the axes, well defined straight down as well, where the canonical ones count. Setting it turns up, or where the roll is held
through the pole (hold.py), what is held. Rejected: to store it, a second truth beside up. A lens in millimeters or degrees is
another look at the distance likewise. All of these can be animated: of a keyed look and a keyed value the look wins.

Undo, redo and opening a file bring values and camera back together and call nothing. Callbacks raise nothing: values that make
no camera (eye = look-at) leave it where it was, and the panel says so.
"""

import contextlib
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import bpy

from ..camera_values import CANONICAL, FIELD_OF_VIEW, HOLD, PIXELS, without_border
from ..errors import InputError
from . import camera as cameras
from . import datablocks, storage, targets
from .camera import CameraSync


def _on_enabled(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    """The values are read off the camera, each time; but what was stated while they were off, or is animated, moves it."""
    if storage.is_storing:
        return
    keep = storage.stated(group.id_data) | (datablocks.animated_values(group.id_data) & storage.EXACT)
    storage.forget_stated(group.id_data)
    if not group.enabled:
        return
    with contextlib.suppress(InputError):
        cameras.answer(group.id_data)  # a curve of a look at a value has asked for it at this frame
    storage.begin(group.id_data)
    if keep != storage.EXACT:
        with storage.without_callbacks():
            group.enabled = False  # else a target would move the camera before it is read
        scene = datablocks.scene_of(group.id_data)
        try:
            CameraSync.of(group.id_data).adopt(scene, keep)
        except InputError:
            if cameras.takes_part(group.id_data, scene):
                return  # it is no pinhole: the panel says why
        with storage.without_callbacks():
            group.enabled = True
    if keep:
        _on_edited(group, context)


def _edit_of(*names: str) -> Callable[["VirtualPinhole", bpy.types.Context], None]:
    """The callback of a property whose edit states these values, whatever Blender has done to the camera since."""
    edited = frozenset(names)

    def on_edited(group: "VirtualPinhole", _context: bpy.types.Context) -> None:
        if storage.is_storing:
            return
        storage.forget_asked(group.id_data, edited)
        if not group.enabled:
            storage.state(group.id_data, edited & storage.EXACT)
            return
        with contextlib.suppress(InputError):  # the panel finds the same error and shows it
            CameraSync.of(group.id_data).edited(datablocks.scene_of(group.id_data), edited)

    return on_edited


_on_edited = _edit_of(*cameras.ALL)
_on_lens = _edit_of("distance")


def _on_distance(group: "VirtualPinhole", _context: bpy.types.Context) -> None:
    """Take a stated distance as the pixels of the picture as it is now."""
    if storage.is_storing:
        return
    camera_object = group.id_data
    storage.forget_asked(camera_object, {"distance"})
    with contextlib.suppress(InputError):  # the panel finds the same error and shows it
        scene = datablocks.scene_of(camera_object)
        picture = without_border(datablocks.frame_of(scene))
        values = storage.load(camera_object)
        if values.counted_in != picture and not storage.is_counted_in_earlier(camera_object, values):
            storage.store(camera_object, replace(values, counted_in=picture), "counted_in")
        if group.enabled:
            CameraSync.of(camera_object).edited(scene, frozenset({"distance"}))
        else:
            storage.state(camera_object, frozenset({"distance"}))


def _on_zoom(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    if group.enabled:  # else it says nothing of the distance
        _on_lens(group, context)


def _on_keeps(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    if not storage.is_storing:
        with contextlib.suppress(InputError):
            picture = without_border(datablocks.frame_of(datablocks.scene_of(group.id_data)))
            storage.store(group.id_data, replace(storage.load(group.id_data), counted_in=picture), "counted_in")
    _on_zoom(group, context)


def _on_pole(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    if group.pole != HOLD:
        with storage.without_callbacks():
            group.held_roll = 0.0
    _edit_of("held_roll")(group, context)


def _on_target(point: str) -> Callable[["VirtualPinhole", bpy.types.Context], None]:
    """The callback of what says which object a point follows."""
    on_edited, on_stated = _edit_of(), _edit_of(point)

    def on_target(group: "VirtualPinhole", context: bpy.types.Context) -> None:
        if storage.is_storing:
            return
        targets.connect(group.id_data)
        targets.mirror(group.id_data, group.id_data)
        (on_edited if group.enabled else on_stated)(group, context)

    return on_target


def _on_shown(_group: "VirtualPinhole", _context: bpy.types.Context) -> None:
    """Nothing, but without a callback Blender draws nothing anew where a script sets the property."""


def _can_be_target(group: "VirtualPinhole", candidate: bpy.types.Object) -> bool:
    return targets.can_be_target(group.id_data, candidate)


def _roll(group: "VirtualPinhole") -> float:
    return cameras.roll(group.id_data)


def _looks_like(look: str) -> Callable[["VirtualPinhole"], float]:
    """The lens's value as one of datablocks.LENSES reads it."""
    unit = datablocks.LENSES[look]
    return lambda group: cameras.lens(group.id_data, unit)


def _asks_for(look: str) -> Callable[["VirtualPinhole", float], None]:
    """The setter of another look at a value, which Blender calls for a curve or a driver as well, on evaluated objects too."""
    return lambda group, number: storage.ask(group.id_data, look, number)


def _on_asked(*names: str) -> Callable[["VirtualPinhole", bpy.types.Context], None]:
    """The callback of such a look, which Blender calls for an edit alone: the values that it names follow it."""
    on_edited = _edit_of(*names)

    def on_asked(group: "VirtualPinhole", context: bpy.types.Context) -> None:
        if not storage.is_storing:
            cameras.answer(group.id_data)
            on_edited(group, context)

    return on_asked


_on_lens_asked = _on_asked("distance")


def _field_of_view(group: "VirtualPinhole") -> float:
    """The angle of the side that `lens_unit` names, else the horizontal one."""
    unit = group.lens_unit if group.lens_unit in ("VERTICAL", "DIAGONAL") else "HORIZONTAL"
    return cameras.lens(group.id_data, unit)


def _set_field_of_view(group: "VirtualPinhole", value: float) -> None:
    name = {"VERTICAL": "vertical_fov", "DIAGONAL": "diagonal_fov"}.get(group.lens_unit, "horizontal_fov")
    storage.ask(group.id_data, name, value)


def _angle(look: str, side: str) -> Any:
    """The property that is the lens as the field of view of a side."""
    return bpy.props.FloatProperty(
        name="Lens",
        description=f"The {side} field of view, zoom included. It is kept as the view-plane distance d",
        subtype="ANGLE",
        soft_min=math.radians(0.4),
        soft_max=math.radians(173),
        step=10,
        precision=3,
        get=_looks_like(look),
        set=_asks_for(look),
        update=_on_lens_asked,
    )


class VirtualPinhole(bpy.types.PropertyGroup):
    """The four values of a camera object, world space. Distance counts pixels of the picture at 100 %."""

    enabled: bpy.props.BoolProperty(
        name="Virtual Pinhole",
        description="Set this camera by eye, look-at, up and view-plane distance. The values are read off it as it stands",
        update=_on_enabled,
        override={"LIBRARY_OVERRIDABLE"},
    )
    eye: bpy.props.FloatVectorProperty(
        name="Camera",
        description="Where the camera stands, in world space: the eye point e",
        subtype="TRANSLATION",
        step=1,
        precision=5,
        update=_edit_of("eye"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    look_at: bpy.props.FloatVectorProperty(
        name="Look At",
        description="The point in the middle of the view, in world space: the look-at point l",
        subtype="TRANSLATION",
        step=1,
        precision=5,
        update=_edit_of("look_at"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    up: bpy.props.FloatVectorProperty(
        name="Up",
        description="The direction that points up in the picture, in world space. Its length does not matter",
        subtype="XYZ",
        default=(0.0, 0.0, 1.0),
        step=1,
        precision=4,
        update=_edit_of("up"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    eye_target: bpy.props.PointerProperty(
        name="Eye Target",
        description="An object in whose origin the camera stands, wherever it is moved. Empty: the point above counts",
        type=bpy.types.Object,
        poll=_can_be_target,
        update=_on_target("eye"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    eye_bone: bpy.props.StringProperty(
        name="Eye Bone",
        description="A bone of the armature, in whose head the camera stands. Empty: the armature's origin",
        update=_on_target("eye"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    eye_group: bpy.props.StringProperty(
        name="Eye Vertex Group",
        description="A vertex group of the mesh, in whose middle the camera stands: its vertices' mean by weight, deformed as "
        "they are. Empty: the mesh's origin",
        update=_on_target("eye"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    look_at_target: bpy.props.PointerProperty(
        name="Look-At Target",
        description="An object at whose origin the camera looks, wherever it is moved. Empty: the point above counts",
        type=bpy.types.Object,
        poll=_can_be_target,
        update=_on_target("look_at"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    look_at_bone: bpy.props.StringProperty(
        name="Look-At Bone",
        description="A bone of the armature, at whose head the camera looks. Empty: the armature's origin",
        update=_on_target("look_at"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    look_at_group: bpy.props.StringProperty(
        name="Look-At Vertex Group",
        description="A vertex group of the mesh, at whose middle the camera looks: its vertices' mean by weight, deformed as "
        "they are. Empty: the mesh's origin",
        update=_on_target("look_at"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    followed: bpy.props.FloatVectorProperty(
        description="Driven by the targets of eye and look-at, so that Blender keeps them up to date. The values say nothing",
        size=2,
        options={"HIDDEN", "ANIMATABLE"},
    )
    # No minimum: Blender would clamp without a word, and so the panel says what is wrong with d ≤ 0.
    distance: bpy.props.FloatProperty(
        name="Lens",
        description="The view-plane distance d: from the eye to the view plane, in pixels of the picture at 100 %. Twice the "
        "distance zooms in by two",
        subtype="PIXEL",
        default=1000.0,
        soft_min=1.0,
        soft_max=100000.0,
        step=5000,
        precision=2,
        update=_on_distance,
        override={"LIBRARY_OVERRIDABLE"},
    )
    lens_unit: bpy.props.EnumProperty(
        name="Lens Unit",
        description="In which unit the lens is shown and typed",
        items=(
            ("MILLIMETERS", "Lens mm", "The focal length on the camera's sensor"),
            ("HORIZONTAL", "H FOV", "The horizontal field of view"),
            ("VERTICAL", "V FOV", "The vertical field of view"),
            ("DIAGONAL", "D FOV", "The diagonal field of view"),
            ("PIXELS", "Lens px", "The view-plane distance d, in pixels of the picture at 100 %"),
        ),
        update=_on_shown,
        options=set(),
        override={"LIBRARY_OVERRIDABLE"},
    )
    # Other looks at the distance: a property has one kind of unit. None is stored, nor overridable; all can be animated.
    focal_length: bpy.props.FloatProperty(
        name="Lens",
        description="The focal length, zoom included. It is kept as the view-plane distance d",
        subtype="DISTANCE_CAMERA",
        unit="CAMERA",
        soft_min=1.0,
        soft_max=5000.0,
        step=100,
        precision=4,
        get=_looks_like("focal_length"),
        set=_asks_for("focal_length"),
        update=_on_lens_asked,
    )
    horizontal_fov: _angle("horizontal_fov", "horizontal")
    vertical_fov: _angle("vertical_fov", "vertical")
    diagonal_fov: _angle("diagonal_fov", "diagonal")
    field_of_view: bpy.props.FloatProperty(
        name="Lens",
        description="The field of view of the side that the unit names, zoom included; of a script, for a curve needs one side",
        subtype="ANGLE",
        soft_min=math.radians(0.4),
        soft_max=math.radians(173),
        step=10,
        precision=3,
        get=_field_of_view,
        set=_set_field_of_view,
        update=_on_lens_asked,
        options=set(),
    )
    # No minimum either.
    zoom: bpy.props.FloatProperty(
        name="Zoom",
        description="A factor on the view-plane distance d, to key or drive a zoom apart from it: 2 shows all twice as large",
        default=1.0,
        soft_min=0.1,
        soft_max=10.0,
        step=1,
        precision=3,
        update=_on_zoom,
        override={"LIBRARY_OVERRIDABLE"},
    )
    keeps: bpy.props.EnumProperty(
        name="Resize Keeps",
        description="What the camera keeps when the picture gets another resolution",
        items=(
            (PIXELS, "Lens in Pixels", "d in pixels: a larger picture shows more, and each pixel as much as before"),
            (
                FIELD_OF_VIEW,
                "Field of View",
                "The lens: a larger picture shows as much, and the distance d in pixels grows with it",
            ),
        ),
        update=_on_keeps,
        options=set(),
        override={"LIBRARY_OVERRIDABLE"},
    )
    # Not overridable: an override keeps the up, or the held roll, that it stands for.
    roll: bpy.props.FloatProperty(
        name="Roll",
        description="By how much the picture is turned about the view, from how it is where up is the world's Z, or the axis "
        "in the preferences. Setting it turns up. Type 0 to level the picture",
        subtype="ANGLE",
        step=100,
        precision=5,
        get=_roll,
        set=_asks_for("roll"),
        update=_on_asked("up", "held_roll"),
    )
    pole: bpy.props.EnumProperty(
        name="At the Pole",
        description="What the picture does where the view comes close to up or down",
        items=(
            (
                CANONICAL,
                "Canonical Axes",
                "Up alone decides, and exactly along it fixed axes. The picture flips as the view passes by",
            ),
            (HOLD, "Hold the Roll", "The picture is carried along from the pose before, or from the first frame on: no flip"),
        ),
        update=_on_pole,
        options=set(),
        override={"LIBRARY_OVERRIDABLE"},
    )
    hold_within: bpy.props.FloatProperty(
        name="Within",
        description="How close to up or down the picture is carried along. At 90° it always is, and up says nothing any more",
        subtype="ANGLE",
        default=math.radians(10),
        min=0.0,
        max=math.pi / 2,
        step=100,
        precision=3,
        update=_edit_of(),
        options=set(),
        override={"LIBRARY_OVERRIDABLE"},
    )
    held_roll: bpy.props.FloatProperty(
        name="Roll",
        description="By how much the camera is turned about its view from what up says, in an animation at the first frame. "
        "Type 0 to level the picture",
        subtype="ANGLE",
        step=100,
        precision=5,
        update=_edit_of("held_roll"),
        override={"LIBRARY_OVERRIDABLE"},
    )
    show_overlay: bpy.props.BoolProperty(
        name="Diagram",
        description="Draw view plane, pyramid, axes and line of sight in the viewport while the camera is selected or active",
        default=True,
        update=_on_shown,
        options=set(),
        override={"LIBRARY_OVERRIDABLE"},
    )
    show_handles: bpy.props.BoolProperty(
        name="Handles",
        description="Handles that drag eye, look-at and up in the 3D viewport, while the camera is active",
        default=True,
        update=_on_shown,
        options=set(),
        override={"LIBRARY_OVERRIDABLE"},
    )
    focus_on_look_at: bpy.props.BoolProperty(
        name="Focus on Look-At",
        description="Keep the focus distance at that of the look-at point from the eye, along the view. A focus object, and "
        "keyframes or a driver of the focus distance, win",
        update=_edit_of(),
        options=set(),
        override={"LIBRARY_OVERRIDABLE"},
    )
    plane_at: bpy.props.FloatProperty(
        name="View Plane At",
        description="Where the view plane is drawn on the way from the eye to the look-at point. d pixels would be far away; "
        "at 100 % the picture is as large as what it shows of the world there",
        subtype="FACTOR",
        default=0.4,
        min=1e-4,
        soft_min=0.05,
        max=1.0,
        update=_on_shown,
        options=set(),
        override={"LIBRARY_OVERRIDABLE"},
    )
    exact: bpy.props.StringProperty(options={"HIDDEN"}, override={"LIBRARY_OVERRIDABLE"})
    stated: bpy.props.StringProperty(
        description="The names of the values that were edited while the Virtual Pinhole was off",
        options={"HIDDEN"},
        override={"LIBRARY_OVERRIDABLE"},
    )
    when_set: bpy.props.StringProperty(options={"HIDDEN"}, override={"LIBRARY_OVERRIDABLE"})
    picture: bpy.props.FloatVectorProperty(
        description="Resolution, percentage and pixel aspect of the picture for which the camera was set",
        size=5,
        options={"HIDDEN"},
        override={"LIBRARY_OVERRIDABLE"},
    )
    counted_in: bpy.props.FloatVectorProperty(
        description="Resolution, percentage and pixel aspect of the picture whose pixels the distance counts",
        size=5,
        options={"HIDDEN"},
        override={"LIBRARY_OVERRIDABLE"},
    )

    def numbers(self) -> tuple[tuple, tuple, tuple, float]:
        """Eye, look-at, up and the effective distance, zoom included, in float64. A followed point is where its target is."""
        values = targets.values(self.id_data)
        return values.eye, values.look_at, values.up, values.zoomed_distance

    def precision(self) -> float:
        """The relative rounding of the values: 2⁻⁵³ where all are known in float64, else float32's 2⁻²⁴."""
        return storage.load(self.id_data).precision


def register() -> None:
    bpy.utils.register_class(VirtualPinhole)
    bpy.types.Object.virtual_pinhole = bpy.props.PointerProperty(type=VirtualPinhole, override={"LIBRARY_OVERRIDABLE"})
    # On the data, since linked duplicates share its sensor.
    bpy.types.Camera.virtual_pinhole_sensor = bpy.props.FloatVectorProperty(
        description="Width and height of the sensor before it grew with a lens that would have been shorter than 1 mm",
        size=2,
        options={"HIDDEN"},
        override={"LIBRARY_OVERRIDABLE"},
    )


def unregister() -> None:
    del bpy.types.Camera.virtual_pinhole_sensor
    del bpy.types.Object.virtual_pinhole
    bpy.utils.unregister_class(VirtualPinhole)
