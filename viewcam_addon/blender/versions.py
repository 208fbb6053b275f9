"""Every difference between Blender 4.2 and 5.2 that this project meets, each in one place."""

import bpy


def drivers(block: bpy.types.ID) -> list[bpy.types.FCurve]:
    """The drivers on a datablock's own properties."""
    return list(block.animation_data.drivers) if block.animation_data else []


def animation_curves(block: bpy.types.ID) -> list[bpy.types.FCurve]:
    """The curves that animate a datablock: those of its action and of the actions on its NLA tracks that are not muted."""
    data = block.animation_data
    if not data:
        return []
    strips = [strip for track in data.nla_tracks if not track.mute for strip in track.strips if not strip.mute]
    return [curve for source in (data, *strips) if source.action for curve in _curves_of(source)]


def _curves_of(source: bpy.types.AnimData | bpy.types.NlaStrip) -> list[bpy.types.FCurve]:
    # Actions have slots since 4.4. What 4.4 and 4.5 still call action.fcurves are the curves of the first slot only.
    if bpy.app.version < (4, 4):
        return list(source.action.fcurves)
    bags = [
        strip.channelbag(source.action_slot) for layer in source.action.layers for strip in layer.strips if source.action_slot
    ]
    return [curve for bag in bags if bag for curve in bag.fcurves]
