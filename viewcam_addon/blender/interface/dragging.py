"""Moves of the camera that follow the mouse: orbit, dolly, dolly zoom, truck, or a typed number in the mouse's place.

`Drag` is what goes on, and knows no event; the operator in moving.py feeds it. Every change starts from the camera as it was,
so that nothing adds up. Canceling gives that back to the bit (`state`, `restore`), and auto keying keys what has changed
(`key_changes`), of a handle's drag (gizmos.py) and of a match (photo_matching.py) as well.
"""

import contextlib
import math
from dataclasses import replace

import bpy

from ... import moves
from ...errors import InputError
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import datablocks, storage, targets, versions

ORBIT, DOLLY, DOLLY_ZOOM, TRUCK = "ORBIT", "DOLLY", "DOLLY_ZOOM", "TRUCK"
NAMES = {ORBIT: "Orbit", DOLLY: "Dolly", DOLLY_ZOOM: "Dolly Zoom", TRUCK: "Truck"}
_TURN = math.radians(0.5)  # for a pixel of the mouse, as a viewport's turntable
_CLOSER = 0.005  # share of the distance to the look-at point, for a pixel
_PRECISE = 0.1

# The properties that moving a camera changes besides its values.
_CHANNELS = ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale")
_LENS = ("lens", "shift_x", "shift_y", "sensor_width", "sensor_height", "virtual_pinhole_sensor", "dof.focus_distance")

# Other looks at the values, which are no values of their own.
_LOOKS = (*datablocks.LOOKS, "field_of_view")


def moved(pinhole: Pinhole, kind: str, amount: tuple[float, float]) -> Pinhole:
    """A camera moved by a drag. Pure.

    amount : radians around and upwards for an orbit, world units to the right and upwards for a truck, else world units away
        from the look-at point, of which the first counts. A dolly zoom keeps the picture's size at the look-at point.

    Raises InputError if the eye would reach the look-at point, or a number is not finite.
    """
    if kind == ORBIT:
        return moves.orbited(pinhole, -amount[0] if pinhole.mirrored else amount[0], amount[1])
    if kind == TRUCK:
        right, up, _ = pinhole.picture_axes()
        step = amount[0] * right + amount[1] * up
        return moves.trucked_to(pinhole, tuple((pinhole.look_at + step).tolist()))
    reach = math.dist(pinhole.eye, pinhole.look_at)
    dollied = moves.dollied(pinhole, reach + amount[0]) if amount[0] else pinhole
    if kind == DOLLY_ZOOM:
        d_x, d_y = (each * (reach + amount[0]) / reach for each in pinhole.distance)
        dollied = replace(dollied, distance=(d_x, d_y))
    return dollied


class Drag:
    """A drag that goes on.

    amount : the movement so far, as `moved` takes it.
    text : the typed characters, which count instead of the mouse where they are a number; degrees for an orbit.
    findings : the last findings of `camera.apply`.

    Raises InputError if the camera is none, or what it follows would have to be given up.
    """

    def __init__(self, camera_object: bpy.types.Object, scene: bpy.types.Scene, kind: str) -> None:
        followed = targets.names(camera_object)
        for words, name in followed.items():
            if words == "eye" or kind == TRUCK:
                raise InputError(f"the {words} follows {name!r}, and can't be dragged: clear that object first")
        self.start = cameras.current(camera_object, scene)
        self._before = state(camera_object)
        self._camera, self._scene, self._kind = camera_object, scene, kind
        self._mouse, self.amount, self.text = (0.0, 0.0), (0.0, 0.0), ""
        self.findings: list[str] = []

    def move(self, right: float, upwards: float, precise: bool = False) -> None:
        """The mouse has gone so many pixels."""
        factor = _PRECISE if precise else 1.0
        self._mouse = self._mouse[0] + factor * right, self._mouse[1] + factor * upwards
        self._follow()

    def type(self, text: str) -> None:
        """Show what is typed so far."""
        self.text = text
        self._follow()

    def confirm(self) -> None:
        key_changes(self._camera, self._before, self._scene)

    def cancel(self) -> None:
        restore(self._camera, self._before)

    def _follow(self) -> None:
        self.amount = self._by_mouse()
        with contextlib.suppress(ValueError):
            number = float(self.text)
            self.amount = (math.radians(number) if self._kind == ORBIT else number), 0.0
        with contextlib.suppress(InputError):  # beyond what there is: the camera waits for the mouse to come back
            self.findings = cameras.apply(self._camera, moved(self.start, self._kind, self.amount), self._scene)

    def _by_mouse(self) -> tuple[float, float]:
        x, y = self._mouse
        if self._kind == ORBIT:  # the thing under the mouse goes with it
            return -_TURN * x, -_TURN * y
        reach = math.dist(self.start.eye, self.start.look_at)
        if self._kind == TRUCK:
            return -x * reach / self.start.distance[0], -y * reach / self.start.distance[1]
        return reach * (math.exp(-_CLOSER * (x + y)) - 1), 0.0


def state(camera_object: bpy.types.Object) -> dict[str, object]:
    """All that a drag or a match changes, by its path from the camera, other looks at the values included."""
    stored = camera_object.virtual_pinhole.bl_rna.properties
    values = [each.identifier for each in stored if not each.is_readonly and each.type != "POINTER"]
    paths = [*_CHANNELS, *(f"data.{name}" for name in _LENS)]
    paths += [f"virtual_pinhole.{name}" for name in values]
    state = {path: camera_object.path_resolve(path) for path in paths}
    return {
        path: tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
        for path, value in state.items()
    }


def restore(camera_object: bpy.types.Object, before: dict[str, object]) -> None:
    """Bring all of it back; callbacks hear nothing."""
    present = state(camera_object)
    with storage.without_callbacks():
        for path, value in before.items():
            owner, _, name = path.rpartition(".")
            if present[path] != value and not (owner == "virtual_pinhole" and name in _LOOKS):
                setattr(camera_object.path_resolve(owner) if owner else camera_object, name, value)


def key_changes(camera_object: bpy.types.Object, before: dict[str, object], scene: bpy.types.Scene) -> None:
    """Insert keyframes for what has changed and has keyframes, where auto keying is on: as Blender's own fields get them.

    That is values, and channels of the camera itself, which would win over the values at the next frame.
    """
    tools = scene.tool_settings
    if not tools.use_keyframe_insert_auto:
        return
    options = {"INSERTKEY_REPLACE"} if tools.auto_keying_mode == "REPLACE_KEYS" else set()
    present = state(camera_object)
    for block, owner in ((camera_object, ""), (camera_object.data, "data.")):
        curves = versions.action_curves(block)
        if curves and not block.animation_data.action.library:
            for path in dict.fromkeys(curve.data_path for curve in curves):
                if f"{owner}{path}" in before and present[f"{owner}{path}"] != before[f"{owner}{path}"]:
                    block.keyframe_insert(path, options=options)
