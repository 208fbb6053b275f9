"""Hold the roll through the pole (`virtual_pinhole.pole` = HOLD): it is carried along from the poses before the stated one.

While the artist edits, that is the pose that the camera stands in: each edit carries its axes along (roll.py) and writes the
new roll beside the values. In an animation these are the poses of all whole frames since the range's first, read from the
curves: the roll at a frame is `held_roll` plus what all steps up to it have carried, backwards before the first frame. So a
frame's roll depends on the file alone, not on the frames that were shown before, and is the same in a window, in `blender -b`
and at the sub-frames of motion blur, where a last step leads from the whole frame before. Values that differ from the
curves, edited and not keyed yet, are one step more.

`held_roll` may be keyframed, and is added as it is at each frame. `pole` and `hold_within` may not: they count for all frames
alike.

Rejected: a cache of rolls by frame (stale after any edit of a curve; 10,000 frames take some 30 ms), baking the roll into
keyframes (stale likewise, and in the artist's way), and the evaluated values of other frames, which Blender gives to no
handler: drivers and NLA strips can be evaluated at the current frame only, and `obstacle` says so.
"""

import math

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import roll as rolls
from ..camera_values import HOLD, CameraValues
from ..pinhole import Pinhole, make_views
from . import storage, versions
from .targets import POINTS, target_of

Array = NDArray[np.float64]

# The values that decide the view, as nine columns.
_COLUMNS = {f"virtual_pinhole.{name}": 3 * i for i, name in enumerate(("eye", "look_at", "up"))}


def roll(camera_object: bpy.types.Object, values: CameraValues, scene: bpy.types.Scene) -> float:
    """Radians by which the picture is turned from what up says, at the scene's current frame.

    The evaluated object of any depsgraph may be given as well, with its values.

    Raises InputError if the values make no camera.
    """
    if values.pole != HOLD:
        return 0.0
    curves = _view_curves(versions.action_curves(camera_object.original))
    if not curves or obstacle(camera_object.original):
        return values.held_roll
    return values.held_roll + _carried_since_first_frame(values, curves, scene)


def obstacle(camera_object: bpy.types.Object) -> str | None:
    """The sentence that says why an animation's roll can't be held, or None where it can."""
    if storage.load(camera_object).pole != HOLD:
        return None
    for point, words in POINTS.items():
        if target := target_of(camera_object, point):
            return (
                f"The {words} follows {target.name!r}, whose place at other frames can't be known, so that the roll is not "
                "held: clear the target, or choose Canonical Axes"
            )
    for what, curves in (("A driver", versions.drivers(camera_object)), ("An NLA strip", versions.strip_curves(camera_object))):
        if view_curves := _view_curves(curves):
            name = view_curves[0].data_path.removeprefix("virtual_pinhole.").replace("_", "-")
            return (
                f"{what} sets the {name}, which can't be known at other frames, so that the roll is not held: "
                "give the value keyframes, or choose Canonical Axes"
            )
    return None


def after_edit(before: Pinhole, stated: Pinhole, roll: float, within: float) -> float:
    """The roll, in [−π, π], of an edited view: carried along if the way there leads by the pole, else as it was.

    before, stated : the views without roll, as up alone says.
    roll : radians, that of `before`. Rounded to float32, as the property will have it, so that the camera is what its values
        say.
    """
    turn = _step([_numbers(before), _numbers(stated)], within)
    return roll if turn is None else float(np.float32(math.remainder(roll + turn, 2 * math.pi)))


def _numbers(pinhole: Pinhole) -> tuple[float, ...]:
    return (*pinhole.eye, *pinhole.look_at, *pinhole.up)


def _view_curves(curves: list[bpy.types.FCurve]) -> list[bpy.types.FCurve]:
    return [curve for curve in curves if curve.data_path in _COLUMNS and not versions.is_muted(curve)]


def _carried_since_first_frame(values: CameraValues, curves: list[bpy.types.FCurve], scene: bpy.types.Scene) -> float:
    now, first = scene.frame_current_final, scene.frame_start
    whole = math.floor(now)
    stated = np.array([*values.eye, *values.look_at, *values.up])
    frames = np.arange(min(first, whole), max(first, whole + 1) + 1)
    poses = _poses(stated, curves, frames)
    valid = make_views(*_vectors(poses))  # across frames whose values make no camera the roll is carried
    frames, poses = frames[valid], poses[valid]
    if not len(frames):
        return 0.0
    turns, near = rolls.steps(*_vectors(poses), values.hold_within)
    totals = np.concatenate([[0.0], np.cumsum(np.where(near, turns, 0.0))])
    start, here = np.maximum(np.searchsorted(frames, (first, whole), side="right") - 1, 0)
    # A sub-frame belongs to the step that it is a part of: were it to decide alone, the picture would jump within a frame.
    amid_carried_step = now > whole and here < len(near) and near[here]
    last = _step([poses[here], stated], math.pi / 2 if amid_carried_step else values.hold_within)
    return float(totals[here] - totals[start] + (last or 0.0))


def _poses(stated: Array, curves: list[bpy.types.FCurve], frames: Array) -> Array:
    """(n, 9): eye, look-at and up at each frame, where no curve says otherwise as stated."""
    poses = np.tile(stated, (len(frames), 1))
    for curve in curves:
        column = _COLUMNS[curve.data_path] + curve.array_index
        poses[:, column] = np.fromiter(map(curve.evaluate, frames.tolist()), dtype=np.float64, count=len(frames))
    return poses


def _vectors(poses: Array) -> tuple[Array, Array, Array]:
    return poses[:, 0:3], poses[:, 3:6], poses[:, 6:9]


def _step(poses: list, within: float) -> float | None:
    """The turn of a single step, or None if it is not carried."""
    (turn,), (near,) = rolls.steps(*_vectors(np.array(poses)), within)
    return float(turn) if near else None
