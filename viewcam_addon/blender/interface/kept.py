"""A camera as it was before it is moved: to the bit, for whoever cancels a drag, and what has changed, for auto keying."""

import bpy

from .. import datablocks, storage, versions

# The properties that moving a camera changes besides its values.
_CHANNELS = ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale")
_LENS = ("lens", "shift_x", "shift_y", "sensor_width", "sensor_height", "virtual_pinhole_sensor", "dof.focus_distance")

# Other looks at the values, which are no values of their own.
_LOOKS = (*datablocks.LOOKS, "field_of_view")


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
