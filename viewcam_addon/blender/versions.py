"""Every difference between Blender 4.2 and 5.2 that this project meets, each in one place."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ..image import OLDER_NAMES
from ..rotation import float64

# The Cycles whose materials a scene from here has: the tracer knows what Cycles changed (core/closures/shading_point.h).
CYCLES = bpy.app.version[:2]
# True if Light Falloff does nothing to suns; before, it multiplies them by as good as infinity.
SUNS_HAVE_NO_FALLOFF = bpy.app.version >= (4, 4)
# True if lights are objects to their nodes, in whose space places are; before, these are the world's.
LIGHTS_HAVE_SPACES = bpy.app.version >= (4, 5)
_LINEAR = 1  # an enum's number, as foreach_set takes it
# True if Cycles draws a Principled surface where there is no material, which bends grazing smooth normals; before 5.0, a
# diffuse one.
DEFAULT_SURFACE_BENDS_NORMALS = bpy.app.version >= (5, 0)
# True if Cycles has one normal a vertex, and splits those at sharp edges (export_geometry.py). Measured: 4.2, 4.5, 5.0 and 5.2.
CYCLES_HAS_VERTEX_NORMALS = bpy.app.version < (5, 1)

# Types of nodes that one Blender calls otherwise than those before and after it. Measured: 4.4.0.
NODE_TYPES = {"DIFFUSE_BSDF": "BSDF_DIFFUSE"}
# True if nodes whose links go in a circle are black; before, Cycles left these links out. Measured: 4.2, 5.0 and 5.2.
CIRCLES_ARE_BLACK = bpy.app.version >= (5, 0)
# True if an input keeps its value where a muted node or a reroute feeds it that nothing feeds; before, Cycles made it 0.
# Measured: 4.2, 4.5, 5.0 and 5.2.
MUTED_NODES_HAVE_NO_VALUES = bpy.app.version >= (5, 0)
# True if the value of a group's input counts wherever links inside lead; before, it was none where surfaces have one of their
# own, as the UV map that images are laid out by. Measured: 4.2, 5.0 and 5.2.
GROUPS_GIVE_ALL_VALUES = bpy.app.version >= (5, 0)
# True if a material slot of an object that is empty is that for Cycles; before, it had the mesh's material. Measured: 4.2, 4.5,
# 5.0 and 5.2.
EMPTY_SLOTS_OF_OBJECTS_STAY_EMPTY = bpy.app.version >= (5, 1)
# True if Cycles samples no light of a Principled surface that a displacement bumps. Measured: in 5.2, not in 4.2, 4.5 and 5.0.
LOSES_LIGHT_OF_BUMPED = bpy.app.version >= (5, 1)
# True if Brick Texture makes NaN of rows without a height. Measured: in 5.2, not in 4.2 and 5.0.
ROWS_NEED_HEIGHTS = bpy.app.version >= (5, 1)


WORKING_SPACE = "Linear Rec.709"
"""The space of a file's colors, unless it says otherwise."""


def working_space() -> str:
    """The space of the file's colors. Before 5.0 there is no choice."""
    return bpy.data.colorspace.working_space if bpy.app.version >= (5, 0) else WORKING_SPACE


def node_tree(block: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree | None:
    """The nodes that count in the render. Since 5.0 there is no switch between them and a plain color."""
    return block.node_tree if bpy.app.version >= (5, 0) or block.use_nodes else None


def light_tree(light: bpy.types.Light) -> bpy.types.NodeTree | None:
    """The nodes of a light that count in the render. Lights lost their switch later than materials: in 5.2 at the latest."""
    return light.node_tree if bpy.app.version >= (5, 2) or light.use_nodes else None


def panorama(camera: bpy.types.Camera) -> bpy.types.bpy_struct:
    """The block that has the settings of a panoramic camera. Until 4.5 they are the add-on's."""
    return camera if hasattr(camera, "panorama_type") else camera.cycles


def shadow_terminator(block: bpy.types.Object) -> tuple[tuple[bpy.types.bpy_struct, str], ...]:
    """The properties by which Cycles lights what lies in the shadow of its own facets. In 4.2 and 4.3 they are the add-on's."""
    if bpy.app.version >= (4, 5):
        return (block, "shadow_terminator_geometry_offset"), (block, "shadow_terminator_shading_offset")
    return (block.cycles, "shadow_terminator_geometry_offset"), (block.cycles, "shadow_terminator_offset")


def without_first_sample(samples: int) -> dict[str, object]:
    """Settings of Cycles for that many samples without the first, which goes through the pixel's center whatever the filter.

    It draws edges towards what stands at the center, by 0.22/samples of their contrast. Measured: 4.2, 4.5, 5.0 and 5.2.
    """
    if bpy.app.version < (4, 4):
        return {"sample_offset": 1, "samples": samples}
    return {"use_sample_subset": True, "sample_offset": 1, "sample_subset_length": samples, "samples": samples + 1}


def stored_properties(owner: bpy.types.bpy_struct) -> Any:
    """The values of the add-on's properties of an owner, by name. What is set here calls nothing, and no evaluation follows
    it."""
    return owner if bpy.app.version < (5, 0) else owner.bl_system_properties_get(do_create=True)


def numbers_of(matrices: Sequence[Matrix]) -> NDArray[np.float64]:
    """(n, 4, 4): `rotation.float64` of n matrices. Until 4.5 NumPy takes six times as long for a matrix as for its rows."""
    return float64(matrices if bpy.app.version >= (5, 0) else [[row[:] for row in matrix] for matrix in matrices])


def drivers(block: bpy.types.ID) -> list[bpy.types.FCurve]:
    """The drivers on a datablock's own properties."""
    return list(block.animation_data.drivers) if block.animation_data else []


def all_curves(block: bpy.types.ID) -> list[bpy.types.FCurve]:
    """The curves that animate a datablock, and its drivers."""
    data = block.animation_data
    if not data:
        return []
    strips = strip_curves(block) if data.nla_tracks else ()
    return [*_curves_of(data), *strips, *data.drivers]


def animation_curves(block: bpy.types.ID) -> list[bpy.types.FCurve]:
    """The curves that animate a datablock: those of its action and of the actions on its NLA tracks that are not muted."""
    return [*action_curves(block), *strip_curves(block)]


def action_curves(block: bpy.types.ID) -> list[bpy.types.FCurve]:
    """The curves of a datablock's own action."""
    data = block.animation_data
    return _curves_of(data) if data else []


def strip_curves(block: bpy.types.ID) -> list[bpy.types.FCurve]:
    """The curves of the actions on a datablock's NLA tracks, unless the strip, its track or all tracks are muted."""
    data = block.animation_data
    if not data or not data.use_nla:
        return []
    strips = [strip for track in data.nla_tracks if not track.mute for strip in track.strips if not strip.mute]
    return [curve for strip in strips for curve in _curves_of(strip)]


def _curves_of(source: bpy.types.AnimData | bpy.types.NlaStrip) -> list[bpy.types.FCurve]:
    return [curve for collection in _collections_of(source) for curve in collection]


def _collections_of(source: bpy.types.AnimData | bpy.types.NlaStrip) -> list[bpy.types.bpy_prop_collection]:
    action = source.action
    if not action:
        return []
    # Actions have slots since 4.4. What 4.4 and 4.5 still call action.fcurves are the curves of the first slot only.
    if bpy.app.version < (4, 4):
        return [action.fcurves]
    slot = source.action_slot
    bags = [strip.channelbag(slot) for layer in action.layers for strip in layer.strips] if slot else []
    return [bag.fcurves for bag in bags if bag]


def remove_curves(block: bpy.types.ID, data_path: str) -> None:
    """Take the curves of a property out of a datablock's own action."""
    for collection in _collections_of(block.animation_data) if block.animation_data else []:
        for curve in [curve for curve in collection if curve.data_path == data_path]:
            collection.remove(curve)


def new_curve(block: bpy.types.ID, data_path: str, index: int) -> bpy.types.FCurve:
    """A curve in a datablock's own action, which is made if it has none."""
    data = block.animation_data_create()
    if data.action is None:
        data.action = bpy.data.actions.new(f"{block.name}Action")
    if bpy.app.version < (4, 4):
        return data.action.fcurves.new(data_path, index=index)
    return data.action.fcurve_ensure_for_datablock(block, data_path, index=index)


def shares_animation(block: bpy.types.ID, other: bpy.types.ID) -> bool:
    """True if one curve moves both: they have the same action and, since 4.4, the same slot of it."""
    data, others = block.animation_data, other.animation_data
    if not data or not others or data.action is None or data.action != others.action:
        return False
    return bpy.app.version < (4, 4) or data.action_slot_handle == others.action_slot_handle


def is_muted(curve: bpy.types.FCurve) -> bool:
    """True if a curve is not played. Since 4.4 Blender plays those of muted groups. Measured: 4.2, 4.5, 5.0 and 5.2."""
    return curve.mute or (bpy.app.version < (4, 4) and curve.group is not None and curve.group.mute)


def adaptive_subdivision(block: bpy.types.Object, scene: bpy.types.Scene) -> tuple[bpy.types.bpy_struct, str] | None:
    """The property by which Cycles subdivides this object by its size in the picture, or None where it does not.

    Until 4.5 it is the object's and counts with Cycles' experimental features only; since 5.0 it is the modifier's.
    """
    last = block.modifiers[-1] if block.modifiers else None
    if last is None or last.type != "SUBSURF" or not last.show_render:
        return None
    if hasattr(last, "use_adaptive_subdivision"):
        owner = last
    elif scene.cycles.feature_set == "EXPERIMENTAL":
        owner = block.cycles
    else:
        return None
    return (owner, "use_adaptive_subdivision") if owner.use_adaptive_subdivision else None


def modifier_input(modifier: bpy.types.NodesModifier, identifier: str) -> Any:
    """The value that a modifier gives to an input of its nodes; None where it has none. They were custom properties."""
    if bpy.app.version < (5, 2):
        return modifier.get(identifier)
    return getattr(getattr(modifier.properties.inputs, identifier, None), "value", None)


# EEVEE's name among the render engines. The one of 4.2 was the next one then.
EEVEE = "BLENDER_EEVEE" if bpy.app.version >= (5, 0) else "BLENDER_EEVEE_NEXT"


# True if EEVEE draws a view layer's material in place of all others. Measured: 4.2 does not, 5.0 and 5.2 do.
EEVEE_OVERRIDES_MATERIALS = bpy.app.version >= (5, 0)


def compositor(scene: bpy.types.Scene) -> bpy.types.NodeTree | None:
    """The nodes that make the picture of what was rendered, if any. Since 5.0 they are a group of their own."""
    if bpy.app.version >= (5, 0):
        return scene.compositing_node_group
    return scene.node_tree if scene.use_nodes else None


def has_strips(editor: bpy.types.SequenceEditor) -> bool:
    """True if the sequencer has any strip. They were called sequences."""
    return len(editor.strips if hasattr(editor, "strips") else editor.sequences) > 0


def literal_path(path: Path) -> str:
    """A path as the render's output takes it. Since 4.5 braces in it name variables."""
    return str(path).replace("{", "{{").replace("}", "}}") if bpy.app.version >= (4, 5) else str(path)


def set_multilayer_file(settings: bpy.types.ImageFormatSettings) -> None:
    """Let a render write a multilayer EXR of 32-bit floats."""
    # Since 5.0 the kind of medium comes first, and the parts of a file collide where pixels are not square, unless interleaved.
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    settings.color_depth = "32"
    settings.exr_codec = "ZIP"
    if hasattr(settings, "use_exr_interleave"):
        settings.use_exr_interleave = True


def set_preview_file(settings: bpy.types.ImageFormatSettings) -> None:
    """Let a render write a PNG of 8 bits."""
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format = "PNG"
    settings.color_mode, settings.color_depth, settings.compression = "RGBA", "8", 15


def pass_name(name: str) -> str:
    """Blender's name of a pass in a render's result. Since 5.0 as we do."""
    older = {new: old for old, new in OLDER_NAMES.items()} if bpy.app.version < (5, 0) else {}
    return older.get(name, name)


def linear_keyframes(block: bpy.types.ID, path: str, at: Sequence[float], values: NDArray[np.float64]) -> None:
    """Put keyframes in the place of a property's curves; a single one for a number that stands still.

    at : frames, of the curves.
    values : (frames, numbers of the property).
    """
    remove_curves(block, path)
    for index, column in enumerate(values.T):
        count = 1 if (column == column[0]).all() else len(column)
        curve = new_curve(block, path, index)
        curve.keyframe_points.add(count)
        curve.keyframe_points.foreach_set("co", np.column_stack([at, column])[:count].ravel())
        curve.keyframe_points.foreach_set("interpolation", [_LINEAR] * count)
        curve.update()
