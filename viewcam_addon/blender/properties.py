"""`object.virtual_pinhole`: the four values, and the camera that moves when one of them is edited.

Blender's properties are float32. What a script states in float64 would be lost in them, so `exact` keeps the numbers as they
were given; each counts as long as it rounds to the property beside it, and an edit or a keyframe overrules it. Rejected: ID
properties for the values themselves (float64, but without update callbacks, units, limits and library overrides).

Where the roll is held through the pole (hold.py), an edit also writes the new roll. `when_set` remembers the view of the
camera as it was last set, from which the next edit sets out: a callback hears of an edit only when the old value is gone.

`zoom` is a factor on d of its own, so that a zoom can be keyed and taken off again: `numbers` gives the product. `roll` is not
stored (rolling.py).

`keeps` says what the camera keeps when the picture gets another resolution (picture.py, resolution.py).

Undo, redo and opening a file bring values and camera back together and call nothing. Callbacks raise nothing: values that make
no camera (eye = look-at) leave it where it was, and the panel says so.
"""

import contextlib
import functools
import json
import math
from collections.abc import Iterator

import bpy
import numpy as np

from .. import checks, intrinsics
from ..errors import InputError
from . import camera as cameras
from . import datablocks, picture, rolling, targets

VALUES = ("eye", "look_at", "up", "distance")
_stating = False


@contextlib.contextmanager
def without_callbacks() -> Iterator[None]:
    """Values may be written in here without moving the camera."""
    global _stating
    before, _stating = _stating, True
    try:
        yield
    finally:
        _stating = before


def _on_enabled(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    """What nobody has stated yet follows the camera, so that enabling for the first time moves nothing."""
    if _stating or not group.enabled:
        return
    keep = frozenset(name for name in VALUES if group.is_property_set(name))
    if keep != frozenset(VALUES):
        with without_callbacks():
            group.enabled = False  # else a target would move the camera before it is read
        with contextlib.suppress(InputError):
            cameras.adopt(group.id_data, datablocks.scene_of(group.id_data), keep)
        with without_callbacks():
            group.enabled = True
    if keep:
        _on_edited(group, context)


def _on_edited(group: "VirtualPinhole", _context: bpy.types.Context) -> None:
    if _stating or not group.enabled:
        return
    camera_object = group.id_data
    scene = datablocks.scene_of(camera_object)
    with contextlib.suppress(InputError):  # the panel finds the same error and shows it
        cameras.follow(camera_object, scene)


def _on_distance(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    """Who states a distance means the pixels of the picture as it is now."""
    if not _stating and not picture.is_counted_in_earlier(group):
        _count_in_present_picture(group)
    _on_edited(group, context)


def _on_keeps(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    if not _stating:
        _count_in_present_picture(group)
    _on_edited(group, context)


def _count_in_present_picture(group: "VirtualPinhole") -> None:
    with contextlib.suppress(InputError):  # the panel finds the same error and shows it
        group.counted_in = picture.shape(datablocks.frame_of(datablocks.scene_of(group.id_data)))


def _on_pole(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    if group.pole != "HOLD":
        with without_callbacks():
            group.held_roll = 0.0
    _on_edited(group, context)


def _on_target(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    if _stating:
        return
    targets.connect(group.id_data)
    group.mirror(group)
    _on_edited(group, context)


def _on_shown(_group: "VirtualPinhole", _context: bpy.types.Context) -> None:
    """Nothing, but without a callback Blender draws nothing anew where a script sets the property."""


class VirtualPinhole(bpy.types.PropertyGroup):
    """The four values of a camera object, world space. Distance counts pixels of the picture at 100 %."""

    enabled: bpy.props.BoolProperty(
        name="Virtual Pinhole",
        description="Set this camera by eye, look-at, up and view-plane distance. The first time, the values are taken from it",
        update=_on_enabled,
        override={"LIBRARY_OVERRIDABLE"},
    )
    eye: bpy.props.FloatVectorProperty(
        name="Eye",
        description="Where the camera stands, in world space",
        subtype="TRANSLATION",
        precision=4,
        update=_on_edited,
        override={"LIBRARY_OVERRIDABLE"},
    )
    look_at: bpy.props.FloatVectorProperty(
        name="Look-At",
        description="The point in the middle of the view, in world space",
        subtype="TRANSLATION",
        precision=4,
        update=_on_edited,
        override={"LIBRARY_OVERRIDABLE"},
    )
    up: bpy.props.FloatVectorProperty(
        name="Up",
        description="The direction that points up in the picture, in world space. Its length does not matter",
        subtype="XYZ",
        default=(0.0, 0.0, 1.0),
        precision=4,
        update=_on_edited,
        override={"LIBRARY_OVERRIDABLE"},
    )
    eye_target: bpy.props.PointerProperty(
        name="Eye Target",
        description="An object in whose origin the camera stands, wherever it is moved. Empty: the point above counts",
        type=bpy.types.Object,
        poll=targets.can_be_target,
        update=_on_target,
        override={"LIBRARY_OVERRIDABLE"},
    )
    look_at_target: bpy.props.PointerProperty(
        name="Look-At Target",
        description="An object at whose origin the camera looks, wherever it is moved. Empty: the point above counts",
        type=bpy.types.Object,
        poll=targets.can_be_target,
        update=_on_target,
        override={"LIBRARY_OVERRIDABLE"},
    )
    followed: bpy.props.FloatVectorProperty(
        description="Driven by the targets of eye and look-at, so that Blender keeps them up to date. The values say nothing",
        size=2,
        options={"HIDDEN", "ANIMATABLE"},
    )
    # No minimum: Blender would clamp without a word, and so the panel says what is wrong with d ≤ 0.
    distance: bpy.props.FloatProperty(
        name="Distance",
        description="From the eye to the view plane, in pixels of the picture at 100 %: twice the distance zooms in by two",
        subtype="PIXEL",
        default=1000.0,
        soft_min=1.0,
        soft_max=100000.0,
        precision=3,
        update=_on_distance,
        override={"LIBRARY_OVERRIDABLE"},
    )
    # No minimum either.
    zoom: bpy.props.FloatProperty(
        name="Zoom",
        description="A factor on the distance, to key or drive a zoom apart from it: 2 shows everything twice as large",
        default=1.0,
        soft_min=0.1,
        soft_max=10.0,
        step=1,
        precision=3,
        update=_on_edited,
        override={"LIBRARY_OVERRIDABLE"},
    )
    keeps: bpy.props.EnumProperty(
        name="Resize Keeps",
        description="What the camera keeps when the picture gets another resolution",
        items=(
            ("PIXELS", "Distance", "The distance in pixels: a larger picture shows more, and each pixel as much as before"),
            (
                "FIELD_OF_VIEW",
                "Field of View",
                "The lens: a larger picture shows as much, and the distance in pixels grows with it",
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
        get=rolling.angle,
        set=rolling.turn,
        options=set(),
    )
    pole: bpy.props.EnumProperty(
        name="At the Pole",
        description="What the picture does where the view comes close to up or down",
        items=(
            (
                "CANONICAL",
                "Canonical Axes",
                "Up alone decides, and exactly along it fixed axes. The picture flips as the view passes by",
            ),
            ("HOLD", "Hold the Roll", "The picture is carried along from the pose before, or from the first frame on: no flip"),
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
        update=_on_edited,
        options=set(),
        override={"LIBRARY_OVERRIDABLE"},
    )
    held_roll: bpy.props.FloatProperty(
        name="Roll",
        description="By how much the camera is turned about its view from what up says, in an animation at the first frame. "
        "Type 0 to level the picture",
        subtype="ANGLE",
        update=_on_edited,
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

    def state(self, eye: tuple, look_at: tuple, up: tuple, distance: float, frame: intrinsics.Frame, roll: float = 0.0) -> None:
        """Set the four values in float64 and enable them; the camera stays where it is.

        distance : the effective one in the picture of `frame`, zoom included. A zoom that can be kept stays, others become 1.
        A target that stands exactly where the point is stated stays, any other is cleared.
        """
        released = [point for point, at in (("eye", eye), ("look_at", look_at)) if targets.place(self, point) != tuple(at)]
        if not picture.is_counted_in_earlier(self):
            self.counted_in = picture.shape(frame)
        distance /= picture.growth(self, frame)
        with without_callbacks():
            for point in released:
                targets.release(self, point)
            if not _can_divide(self.zoom, distance):
                self.zoom = 1.0
            distance /= self.zoom
            self.eye, self.look_at, self.up, self.distance = eye, look_at, up, distance
            self.exact = json.dumps([*eye, *look_at, *up, distance])
            self.enabled = True
        self.settle(frame, roll)

    def mirror(self, evaluated: "VirtualPinhole") -> None:
        """Store where the targets stand, so that the camera stays in place when they are cleared."""
        with without_callbacks():
            for point in targets.POINTS:
                at = targets.place(evaluated, point)
                if at is not None and at != tuple(getattr(self, point)):
                    setattr(self, point, at)

    def set_up(self, up: tuple) -> None:
        """Set up alone, in float64, as an edit does."""
        eye, look_at, _, distance = self.stored()
        self.exact = json.dumps([*eye, *look_at, *up, distance])
        self.up = up

    def multiply_distance(self, factor: float) -> None:
        """Set the distance alone, in float64; the camera stays where it is."""
        eye, look_at, up, distance = self.stored()
        with without_callbacks():
            self.distance = factor * distance
            self.exact = json.dumps([*eye, *look_at, *up, factor * distance])

    def settle(self, frame: intrinsics.Frame, roll: float) -> None:
        """Take note that the camera has been set by the values as they are, for the picture of `frame`."""
        eye, look_at, up, _ = self.numbers()
        with without_callbacks():
            self.held_roll, self.when_set = roll, json.dumps([*eye, *look_at, *up])
        picture.settle(self, frame)

    def numbers_when_set(self) -> tuple[tuple, tuple, tuple] | None:
        """Eye, look-at and up as they were when the camera was last set, or None if that is not known."""
        numbers = _parsed(self.when_set, 9)
        return (tuple(numbers[0:3]), tuple(numbers[3:6]), tuple(numbers[6:9])) if numbers else None

    def numbers(self) -> tuple[tuple, tuple, tuple, float]:
        """Eye, look-at, up and the effective distance, zoom included, in float64. A followed point is where its target is."""
        eye, look_at, up, distance = self.stored()
        eye, look_at = targets.place(self, "eye") or eye, targets.place(self, "look_at") or look_at
        return eye, look_at, up, distance * self.zoom

    def precision(self) -> float:
        """The relative rounding of the values: 2⁻⁵³ where all are known in float64, else float32's 2⁻²⁴."""
        eye, look_at, up, distance = self.stored()
        is_exact = self._exact() == (*eye, *look_at, *up, distance) and not (self.eye_target or self.look_at_target)
        return 2.0**-53 if is_exact else 2.0**-24

    def stored(self) -> tuple[tuple, tuple, tuple, float]:
        """The four values without zoom, and as they are where no target is followed."""
        exact, shown = self._exact(), [*self.eye, *self.look_at, *self.up, self.distance]
        with np.errstate(over="ignore"):
            rounded = np.array(exact, dtype=np.float32).tolist()
        values = [number if short == value else value for number, short, value in zip(exact, rounded, shown, strict=True)]
        return tuple(values[0:3]), tuple(values[3:6]), tuple(values[6:9]), values[9]

    def _exact(self) -> tuple[float, ...]:
        """Ten numbers in float64, NaN where none is known."""
        return _parsed(self.exact, 10) or (math.nan,) * 10


def _can_divide(zoom: float, distance: float) -> bool:
    """Whether a zoom is a factor above 0 that leaves of the distance a number which Blender stores with all its digits."""
    float32 = np.finfo(np.float32)
    return 0 < zoom < math.inf and float(float32.tiny) <= distance / zoom <= float(float32.max)


@functools.lru_cache(maxsize=256)
def _parsed(text: str, count: int) -> tuple[float, ...] | None:
    """So many finite numbers from JSON, None if it holds anything else."""
    with contextlib.suppress(ValueError, RecursionError):  # InputError is a ValueError
        return tuple(checks.vector("the text", json.loads(text), count))
    return None


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
