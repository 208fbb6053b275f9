"""The property `roll`: the angle about the view by which the picture is turned from what the preferred up axis says.

It is read off the axes, well defined straight down as well, where the canonical ones count. Setting it turns up, or where the
roll is held through the pole (hold.py), changes what is held. Rejected: to store it, a second truth beside up, and to animate
it: up can be keyed, and a keyed roll with a keyed up would be two captains.
"""

import contextlib

import bpy

from .. import roll as rolls
from ..errors import InputError
from ..pinhole import Pinhole
from . import datablocks, hold, preferences

# A turn by less is lost in the float32 matrix in which a camera is stored, and would be shown as −0°.
_UNSEEN = 2.0**-24


def angle(group: bpy.types.PropertyGroup) -> float:
    """Radians, from u towards v; 0 where the values make no camera, and below what can be seen."""
    with contextlib.suppress(InputError):
        found = rolls.angle_from(preferences.up_axis(), _view(group))
        return found if abs(found) > _UNSEEN else 0.0
    return 0.0


def turn(group: bpy.types.PropertyGroup, wanted: float) -> None:
    """Give the picture that roll, radians. Values that make no camera stay as they are, and the panel says what is wrong."""
    with contextlib.suppress(InputError):
        view = _view(group)
        if group.pole == "HOLD":
            group.held_roll += wanted - rolls.angle_from(preferences.up_axis(), view)
        else:
            group.set_up(rolls.rolled(view, preferences.up_axis(), wanted).up)


def _view(group: bpy.types.PropertyGroup) -> Pinhole:
    """Where the values look and how the picture is turned, whatever its size."""
    *pose, _ = group.numbers()
    camera_object = group.id_data
    return rolls.turned(Pinhole(*pose, 1.0, 1, 1), hold.roll(camera_object, datablocks.scene_of(camera_object.original)))
