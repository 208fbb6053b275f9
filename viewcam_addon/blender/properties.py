"""`object.virtual_pinhole`: the four values, and the camera that moves when one of them is edited.

Blender's properties are float32. What a script states in float64 would be lost in them, so `exact` keeps the numbers as they
were given; each counts as long as it rounds to the property beside it, and an edit or a keyframe overrules it. Rejected: ID
properties for the values themselves (float64, but without update callbacks, units, limits and library overrides).

Where the roll is held through the pole (hold.py), an edit also writes the new roll. `when_set` remembers the view of the
camera as it was last set, from which the next edit sets out: a callback hears of an edit only when the old value is gone.

Undo, redo and opening a file bring values and camera back together and call nothing. Callbacks raise nothing: values that make
no camera (eye = look-at) leave it where it was, and the panel says so.
"""

import contextlib
import json
import math
from collections.abc import Iterator

import bpy
import numpy as np

from .. import checks
from ..errors import InputError
from . import camera as cameras
from . import datablocks

VALUES = ("eye", "look_at", "up", "distance")
_stating = False


@contextlib.contextmanager
def _without_callbacks() -> Iterator[None]:
    global _stating
    _stating = True
    try:
        yield
    finally:
        _stating = False


def _on_enabled(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    """What nobody has stated yet follows the camera, so that enabling for the first time moves nothing."""
    if _stating or not group.enabled:
        return
    keep = frozenset(name for name in VALUES if group.is_property_set(name))
    if keep != frozenset(VALUES):
        with contextlib.suppress(InputError):
            cameras.adopt(group.id_data, datablocks.scene_of(group.id_data), keep)
    if keep:
        _on_edited(group, context)


def _on_edited(group: "VirtualPinhole", _context: bpy.types.Context) -> None:
    if _stating or not group.enabled:
        return
    camera_object = group.id_data
    scene = datablocks.scene_of(camera_object)
    with contextlib.suppress(InputError):  # the panel finds the same error and shows it
        cameras.follow(camera_object, scene)


def _on_pole(group: "VirtualPinhole", context: bpy.types.Context) -> None:
    if group.pole != "HOLD":
        with _without_callbacks():
            group.roll = 0.0
    _on_edited(group, context)


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
    # No minimum: Blender would clamp without a word, and so the panel says what is wrong with d ≤ 0.
    distance: bpy.props.FloatProperty(
        name="Distance",
        description="From the eye to the view plane, in pixels of the picture at 100 %: twice the distance zooms in by two",
        subtype="PIXEL",
        default=1000.0,
        soft_min=1.0,
        soft_max=100000.0,
        precision=3,
        update=_on_edited,
        override={"LIBRARY_OVERRIDABLE"},
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
    roll: bpy.props.FloatProperty(
        name="Roll",
        description="By how much the camera is turned about its view from what up says, in an animation at the first frame. "
        "Type 0 to level the picture",
        subtype="ANGLE",
        update=_on_edited,
        override={"LIBRARY_OVERRIDABLE"},
    )
    exact: bpy.props.StringProperty(options={"HIDDEN"}, override={"LIBRARY_OVERRIDABLE"})
    when_set: bpy.props.StringProperty(options={"HIDDEN"}, override={"LIBRARY_OVERRIDABLE"})
    size: bpy.props.IntVectorProperty(
        description="The picture's size in pixels when the camera was set",
        size=2,
        options={"HIDDEN"},
        override={"LIBRARY_OVERRIDABLE"},
    )

    def state(self, eye: tuple, look_at: tuple, up: tuple, distance: float, size: tuple[int, int], roll: float = 0.0) -> None:
        """Set the four values in float64 and enable them; the camera stays where it is."""
        with _without_callbacks():
            self.eye, self.look_at, self.up, self.distance = eye, look_at, up, distance
            self.exact = json.dumps([*eye, *look_at, *up, distance])
            self.enabled = True
        self.settle(size, roll)

    def settle(self, size: tuple[int, int], roll: float) -> None:
        """Take note that the camera has been set by the values as they are, for a picture of that size."""
        eye, look_at, up, _ = self.numbers()
        with _without_callbacks():
            self.roll, self.size, self.when_set = roll, size, json.dumps([*eye, *look_at, *up])

    def numbers_when_set(self) -> tuple[tuple, tuple, tuple] | None:
        """Eye, look-at and up as they were when the camera was last set, or None if that is not known."""
        numbers = _parsed(self.when_set, 9)
        return (tuple(numbers[0:3]), tuple(numbers[3:6]), tuple(numbers[6:9])) if numbers else None

    def numbers(self) -> tuple[tuple, tuple, tuple, float]:
        """Eye, look-at, up and distance in float64."""
        values = self._values()
        return tuple(values[0:3]), tuple(values[3:6]), tuple(values[6:9]), values[9]

    def precision(self) -> float:
        """The relative rounding of the values: 2⁻⁵³ where all are known in float64, else float32's 2⁻²⁴."""
        return 2.0**-53 if self._exact() == self._values() else 2.0**-24

    def _values(self) -> list[float]:
        shown = [*self.eye, *self.look_at, *self.up, self.distance]
        with np.errstate(over="ignore"):
            rounded = np.array(self._exact(), dtype=np.float32).tolist()
        return [number if short == value else value for number, short, value in zip(self._exact(), rounded, shown, strict=True)]

    def _exact(self) -> list[float]:
        """Ten numbers in float64, NaN where none is known."""
        return _parsed(self.exact, 10) or [math.nan] * 10


def _parsed(text: str, count: int) -> list[float] | None:
    """So many finite numbers from JSON, None if it holds anything else."""
    with contextlib.suppress(ValueError, RecursionError):  # InputError is a ValueError
        return list(checks.vector("the text", json.loads(text), count))
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
