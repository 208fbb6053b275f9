"""The data that Blender keeps from one render to the next (`use_persistent_data`), and where it must not.

With it Cycles and our engine keep what they have built, and Blender keeps the evaluated scene. Each picture must be the same
to the bit as in a process of its own. Measured on 4.2, 4.5, 5.0 and 5.2: with other cameras, engines and sizes between the
shots it is; three changes leak into the next picture, and after these all is dropped.

- Another frame: hair of particles is evaluated from where it was (all versions), and where a world and a material show one
  image sequence they may show the last frame's (5.0). Rejected: to drop only where such things are; nobody knows them all.
- Another number of samples: Cycles 5.2 keeps the random numbers for the most that were asked for.
- Another camera, where a driver reads a property of the scene's camera: it keeps the value of the camera before.

EEVEE keeps nothing that could be dropped: its first picture in a process differs from all later ones by a bit of half a float
here and there (measured: 5.0), so a first one is drawn for nothing, and then all are the same in every batch.
"""

from collections.abc import Iterator

import bpy

_SIMULATING = ("CLOTH", "SOFT_BODY", "DYNAMIC_PAINT", "FLUID")


def drop(scene: bpy.types.Scene) -> None:
    """Let the next render begin with nothing."""
    scene.render.use_persistent_data = False
    scene.render.use_persistent_data = True


def is_simulated() -> bool:
    """True if anything in the file may depend on the frames before."""
    objects, groups = bpy.data.objects, bpy.data.node_groups
    return (
        any(scene.rigidbody_world for scene in bpy.data.scenes)
        or any(modifier.type in _SIMULATING for each in objects for modifier in each.modifiers)
        or any(system.settings.type == "EMITTER" for each in objects for system in each.particle_systems)
        or any(node.bl_idname == "GeometryNodeSimulationOutput" for tree in groups for node in tree.nodes)
    )


def is_driven_by_camera() -> bool:
    """True if a driver in the file reads a property of whichever camera the scene has."""
    return any(
        (variable.type == "CONTEXT_PROP" or target.id_type == "SCENE") and "camera" in target.data_path
        for driver in _drivers()
        for variable in driver.variables
        for target in variable.targets
    )


def changes_between_renders() -> bool:
    """True if anything in the file may be another in the next render of the same frame, though nobody but the camera moved."""
    asks = any(node.bl_idname == "GeometryNodeInputActiveCamera" for tree in bpy.data.node_groups for node in tree.nodes)
    return asks or is_simulated() or is_driven_by_camera()


def _drivers() -> Iterator[bpy.types.Driver]:
    kinds = [prop.identifier for prop in bpy.data.bl_rna.properties if prop.type == "COLLECTION"]
    blocks = [block for kind in kinds for block in getattr(bpy.data, kind)]
    trees = [tree for block in blocks if (tree := getattr(block, "node_tree", None))]
    for block in (*blocks, *trees):
        data = getattr(block, "animation_data", None)
        yield from (curve.driver for curve in data.drivers) if data else ()
