"""A camera as it was before a drag, to the bit, for whoever cancels it."""

import bpy

from .. import storage

# What moving a camera changes besides its values.
_CHANNELS = ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale")
_LENS = ("lens", "shift_x", "shift_y", "sensor_width", "sensor_height", "virtual_pinhole_sensor")

# Of the values these are told from the others.
_TOLD = ("roll", "focal_length", "field_of_view")


def state(camera_object: bpy.types.Object) -> dict[str, object]:
    """All that a drag or a match changes, by its path from the camera."""
    stored = camera_object.virtual_pinhole.bl_rna.properties
    values = [each.identifier for each in stored if not each.is_readonly and each.type != "POINTER"]
    paths = [*_CHANNELS, *(f"data.{name}" for name in _LENS)]
    paths += [f"virtual_pinhole.{name}" for name in values if name not in _TOLD]
    found = {path: camera_object.path_resolve(path) for path in paths}
    return {
        path: tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
        for path, value in found.items()
    }


def restore(camera_object: bpy.types.Object, before: dict[str, object]) -> None:
    """Bring all of it back; callbacks hear nothing."""
    present = state(camera_object)
    with storage.without_callbacks():
        for path, value in before.items():
            if present[path] != value:
                owner, _, name = path.rpartition(".")
                setattr(camera_object.path_resolve(owner) if owner else camera_object, name, value)
