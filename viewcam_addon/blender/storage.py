"""`object.virtual_pinhole` as `CameraValues`, and back: the one place that knows how Blender keeps them.

Blender's properties are float32. What a script states in float64 would be lost in them, so the hidden text `exact` keeps the
ten numbers as they were given; each counts as long as it rounds to the property beside it, and an edit or a keyframe overrules
it. `when_set` keeps the view of the camera as it was last set, since a callback hears of an edit only when the old value is
gone. `picture` and `counted_in` keep resolution, percentage and pixel aspect. Rejected: ID properties for the values themselves
(float64, but without update callbacks, units, limits and library overrides).
"""

import contextlib
import functools
import json
import struct
from collections.abc import Collection, Iterator
from dataclasses import fields, replace
from typing import cast

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import checks
from ..camera_values import FACTORS, FIELD_OF_VIEW, HOLD, CameraValues, without_border
from ..errors import InputError
from ..intrinsics import Frame
from ..pinhole import Triple
from . import datablocks, versions

Raw = tuple[tuple[float, ...], str, tuple[float | None, ...]]
_View = tuple[Triple, Triple, Triple]  # eye, look-at and up

EXACT = frozenset({"eye", "look_at", "up", "distance"})  # `exact` has their digits
_VECTORS = ("eye", "look_at", "up")
# Values that are no property of their own, or not as they are; each other one is held by the property of its name.
_NOT_PLAIN = EXACT | {"counted_in", "set_for", "view_when_set", "precision", "follows", "asked"}
_PLAIN = tuple(each.name for each in fields(CameraValues) if each.name not in _NOT_PLAIN)
_ASKED = "asked"  # where Blender keeps what `ask` has noted
# Values that are noted of a camera once it has been set.
_NOTED = ("distance", "counted_in", "set_for", "view_when_set", "held_roll")
_NUMBERS = struct.Struct("<10d")
is_storing = False  # else the artist or a script sets a property, and the camera moves


@contextlib.contextmanager
def without_callbacks() -> Iterator[None]:
    """Properties may be set in here without moving the camera."""
    global is_storing
    before, is_storing = is_storing, True
    try:
        yield
    finally:
        is_storing = before


def is_enabled(camera_object: bpy.types.Object) -> bool:
    """True if the values place the camera."""
    return camera_object.virtual_pinhole.enabled


def enable(camera_object: bpy.types.Object) -> None:
    """Let the values place the camera, which stands there already."""
    with without_callbacks():
        camera_object.virtual_pinhole.enabled = True


def is_focused_on_look_at(camera_object: bpy.types.Object) -> bool:
    """True if the focus distance stays on the look-at point."""
    return camera_object.virtual_pinhole.focus_on_look_at


def load(camera_object: bpy.types.Object) -> CameraValues:
    """The values of a camera, its eye and look-at as they are where no target is followed (targets.values).

    The evaluated object of any depsgraph may be given as well.
    """
    group = camera_object.virtual_pinhole
    rounded = (*group.eye[:], *group.look_at[:], *group.up[:], group.distance)
    numbers, is_exact = _numbers(group.exact, rounded)
    follows = tuple(name for name in ("eye", "look_at") if getattr(group, f"{name}_target"))
    asked = asked_of(camera_object)
    when_set = _parsed(group.when_set, 9) if group.pole == HOLD else None  # nobody else asks
    return CameraValues(
        eye=cast(Triple, numbers[0:3]),
        look_at=cast(Triple, numbers[3:6]),
        up=cast(Triple, numbers[6:9]),
        distance=numbers[9],
        counted_in=_frame(tuple(group.counted_in)),
        set_for=_frame(tuple(group.picture)),
        view_when_set=cast(_View, (when_set[0][0:3], when_set[0][3:6], when_set[0][6:9])) if when_set else None,
        precision=2.0**-53 if is_exact and not follows else 2.0**-24,
        follows=follows,
        asked=tuple(asked.items()),
        **{name: getattr(group, name) for name in _PLAIN},
    )


def raw(camera_object: bpy.types.Object) -> Raw | None:
    """The four values and FACTORS as Blender holds them: ten numbers, `exact`, and the factors, None where one is the default.

    It takes a third of the time that the properties take. The evaluated object may be given as well. Returns None where a curve
    asks for another look at a value, or where a value has never been set.
    """
    stored = versions.stored_properties(camera_object.virtual_pinhole)
    try:
        rounded = (*stored["eye"].to_list(), *stored["look_at"].to_list(), *stored["up"].to_list(), stored["distance"])
    except KeyError:
        return None
    return None if _ASKED in stored else (rounded, stored.get("exact", ""), tuple(map(stored.get, FACTORS)))


def animated(before: CameraValues, changed: Raw) -> CameraValues:
    """The values of a camera of which curves alone can have changed any: `before` itself if none has.

    before : the values before, which follow no target.
    changed : the numbers that Blender holds of them now, see `raw`.
    """
    rounded, exact, stored = changed
    factors = {
        name: number
        for name, number in zip(FACTORS, stored, strict=True)
        if number is not None and number != getattr(before, name)
    }
    numbers, is_exact = _numbers(exact, rounded)
    if not factors and numbers == (*before.eye, *before.look_at, *before.up, before.distance):
        return before
    precision = 2.0**-53 if is_exact else 2.0**-24
    eye, look_at, up = cast(_View, (numbers[0:3], numbers[3:6], numbers[6:9]))
    return before.animated(eye, look_at, up, numbers[9], precision, **factors)


def _numbers(text: str, rounded: tuple[float, ...]) -> tuple[tuple[float, ...], bool]:
    """Eye, look-at, up and distance, ten numbers, and whether all of them are known in float64.

    text : `exact` of the camera.
    rounded : the ten numbers of its properties.
    """
    exact = _parsed(text, 10)
    if not exact:
        return rounded, False
    columns = zip(*exact, _shown_values(exact[0]), rounded, strict=True)
    numbers = tuple([full if value == short else full if value == zeroed else value for full, short, zeroed, value in columns])
    return numbers, numbers == exact[0]


def ask(camera_object: bpy.types.Object, look: str, number: float) -> None:
    """Note what another look at a value shall be (datablocks.LOOKS), which an artist or a curve has set.

    Blender sets curves and drivers as it evaluates them, in any order, when nothing may be computed: the value follows later.
    """
    stored = versions.stored_properties(camera_object.virtual_pinhole)
    if _ASKED not in stored:
        stored[_ASKED] = {}
    stored[_ASKED][look] = number


def asked_of(camera_object: bpy.types.Object) -> dict[str, float]:
    """The looks at values that have been asked for and not been answered yet. The evaluated object may be given as well."""
    stored = versions.stored_properties(camera_object.virtual_pinhole)
    return stored[_ASKED].to_dict() if _ASKED in stored else {}


def forget_asked(camera_object: bpy.types.Object, names: Collection[str]) -> None:
    """Take it that the looks at these values have been answered, or that the values themselves were set since."""
    stored = versions.stored_properties(camera_object.virtual_pinhole)
    if _ASKED in stored:
        left = {look: number for look, number in stored[_ASKED].items() if datablocks.LOOKS[look] not in names}
        del stored[_ASKED]
        if left:
            stored[_ASKED] = left


def store(camera_object: bpy.types.Object, values: CameraValues, *names: str) -> None:
    """Write some of the values, by their names, and move nothing. Eye, look-at, up and distance are kept in float64."""
    global is_storing
    group, before, is_storing = camera_object.virtual_pinhole, is_storing, True
    try:
        for name in names:
            value = getattr(values, name)
            if name in _VECTORS:
                setattr(group, name, _as_shown(value))
            elif name == "view_when_set":
                group.when_set = json.dumps([*value[0], *value[1], *value[2]])
            elif isinstance(value, Frame):
                shape = (value.resolution_x, value.resolution_y, value.percentage, value.pixel_aspect_x, value.pixel_aspect_y)
                setattr(group, "picture" if name == "set_for" else name, shape)
            else:
                setattr(group, name, value)
        forget_asked(camera_object, names)
        if not EXACT.isdisjoint(names):
            group.exact = _digits(values)
    finally:
        is_storing = before


def follow(camera_object: bpy.types.Object, values: CameraValues, vectors: list[list[float]]) -> None:
    """Write the four values of a camera, each of which has been set before, and move nothing: as `store`, in half of the time.

    vectors : eye, look-at and up as `zeroed` has them. Blender hears of the distance, which is set last, and evaluates anew all
    that looks at any of them.
    """
    global is_storing
    group, before, is_storing = camera_object.virtual_pinhole, is_storing, True
    stored = versions.stored_properties(group)
    for name, vector in zip(_VECTORS, vectors, strict=True):
        stored[name][:] = vector
    stored["exact"] = _digits(values)
    try:
        group.distance = values.distance
    finally:
        is_storing = before


def stated(camera_object: bpy.types.Object) -> frozenset[str]:
    """The names of the values that were edited while they did not place the camera."""
    return frozenset(camera_object.virtual_pinhole.stated.split())


def state(camera_object: bpy.types.Object, names: frozenset[str]) -> None:
    """Note that values were edited while they do not place the camera: once they do, it is brought there."""
    if camera_object.type == "CAMERA" and not names <= stated(camera_object):
        camera_object.virtual_pinhole.stated = " ".join(sorted(stated(camera_object) | names))


def forget_stated(camera_object: bpy.types.Object) -> None:
    """Note that the values are in use, or no longer."""
    if camera_object.virtual_pinhole.stated:
        camera_object.virtual_pinhole.stated = ""


def begin(camera_object: bpy.types.Object) -> None:
    """Make a new camera keep its field of view in a picture of another size, as Blender's do. One that was set before stays."""
    group = camera_object.virtual_pinhole
    if not group.is_property_set("keeps") and load(camera_object).set_for is None:
        store(camera_object, replace(load(camera_object), keeps=FIELD_OF_VIEW), "keeps")


def settle(camera_object: bpy.types.Object, values: CameraValues, frame: Frame) -> None:
    """Take note that the camera has been set by these values for the picture of `frame`; the distance now counts its pixels."""
    before = load(camera_object)
    view = values.view_when_set if before.pole == HOLD else None
    after = replace(before, view_when_set=view, held_roll=values.held_roll, set_for=without_border(frame))
    if after.counted_in != after.set_for and not is_counted_in_earlier(camera_object, before):
        after = after.counted_anew(frame, camera_object.data.sensor_fit)
    store(camera_object, after, *(name for name in _NOTED if getattr(after, name) != getattr(before, name)))


def is_counted_in_earlier(camera_object: bpy.types.Object, values: CameraValues) -> bool:
    """True if `counted_in` has to stay: the field of view is kept, and the distance is animated."""
    if values.keeps != FIELD_OF_VIEW or values.counted_in is None:
        return False
    curves = [*versions.animation_curves(camera_object), *versions.drivers(camera_object)]
    return any(curve.data_path == "virtual_pinhole.distance" for curve in curves)


def scenes_it_is_set_for(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.Scene]:
    """The other scenes of a camera, those that render the very picture for which it was set."""
    set_for = load(camera_object).set_for
    others = (each for each in camera_object.users_scene if each != scene)
    return [each for each in others if without_border(datablocks.frame_of(each)) == set_for]


@contextlib.contextmanager
def restored(camera_object: bpy.types.Object, *names: str) -> Iterator[None]:
    """Give properties back what they hold now, whatever is stored within the block."""
    group = camera_object.virtual_pinhole
    before = {name: value if isinstance(value := getattr(group, name), str | float) else tuple(value) for name in names}
    try:
        yield
    finally:
        with without_callbacks():
            for name, value in before.items():
                setattr(group, name, value)


def zeroed(vectors: NDArray[np.float64]) -> NDArray[np.float32]:
    """`_as_shown` of (..., 3) vectors, as Blender rounds them."""
    sizes = np.abs(vectors)
    return np.where(sizes > 2.0**-23 * sizes.max(axis=-1, keepdims=True), vectors, 0.0).astype(np.float32)


def _as_shown(vector: tuple[float, ...]) -> tuple[float, ...]:
    """The numbers that the property of a vector holds: 0 for what is less than a float32 step of its largest number, and no −0.

    Such a remainder of a rotation or of an axis conversion would be shown as −0 m; `exact` keeps it.
    """
    step = 2.0**-23 * max(map(abs, vector))
    return tuple([number if abs(number) > step else 0.0 for number in vector])


@functools.lru_cache(maxsize=4096)
def _shown_values(numbers: tuple[float, ...]) -> tuple[float, ...]:
    """The numbers that the properties hold where the ten numbers of `exact` are stored."""
    rounded = [*_as_shown(numbers[0:3]), *_as_shown(numbers[3:6]), *_as_shown(numbers[6:9]), numbers[9]]
    with np.errstate(over="ignore"):
        return tuple(np.array(rounded, dtype=np.float32).tolist())


def _digits(values: CameraValues) -> str:
    """Eye, look-at, up and distance with all their digits: hexadecimal, since JSON takes twenty times as long."""
    return _NUMBERS.pack(*values.eye, *values.look_at, *values.up, values.distance).hex()


@functools.lru_cache(maxsize=4096)
def _parsed(text: str, count: int) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """So many finite numbers of a text, as `_digits` writes them or in JSON, and what float32 makes of them; None if it holds
    anything else."""
    with (
        contextlib.suppress(ValueError, RecursionError, struct.error),
        np.errstate(over="ignore"),
    ):  # InputError is a ValueError
        stated = json.loads(text) if text.startswith("[") else _NUMBERS.unpack(bytes.fromhex(text))
        numbers = checks.vector("the text", stated, count)
        return numbers, tuple(np.array(numbers, dtype=np.float32).tolist())
    return None


@functools.lru_cache(maxsize=256)
def _frame(stored: tuple[float, ...]) -> Frame | None:
    """The picture whose five numbers were stored, None where they are those of none."""
    with contextlib.suppress(InputError, ValueError, OverflowError):
        width, height, percentage, aspect_x, aspect_y = stored
        return Frame(int(width), int(height), int(percentage), aspect_x, aspect_y)
    return None
