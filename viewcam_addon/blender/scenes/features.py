"""Parts of a scene that the tracer does not model, found and named: each with the remedy that takes it out of Cycles' render
too.

Hair and volumes need no remedy: the view layer is told to leave them out (cycles.py).
"""

from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

import bpy

from ...errors import InputError
from ...tracer.scene.lamps import RAYS
from .. import datablocks, versions
from . import images, materials, nodes
from .ledger import Ledger
from .shading import Shading

_NO_SURFACE = {
    "VOLUME": "volumes are not modeled",
    "CURVES": "hair and curves without a surface are not modeled",
    "GREASEPENCIL": "Grease Pencil is not modeled",
    "GPENCIL": "Grease Pencil is not modeled",
}
# Blender itself draws them into Cycles' picture, and into its Depth pass.
_DRAWN_OVER_CYCLES = ("GREASEPENCIL", "GPENCIL")


def note_render(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    camera_object: bpy.types.Object,
    ledger: Ledger,
    light: bool = False,
) -> None:
    """Note what the camera and the render settings do beyond a pinhole. To be asked before the settings are overridden.

    Raises InputError of light in other colors than the tracer's.
    """
    space = versions.working_space()
    if light and space != versions.WORKING_SPACE:
        raise InputError(
            f"the file's working space is {space}, and the tracer's {versions.WORKING_SPACE}: change it in the scene's color "
            "management, or check level geometry"
        )
    for sentence in datablocks.beyond_pinhole(camera_object, scene):
        ledger.note(camera_object.name, "approximated", f"{sentence} (off on both sides)")
    ledger.set_for_cycles(camera_object.data.dof, "use_dof", False)
    for layer in scene.view_layers:
        if layer.use and layer != view_layer:
            ledger.note(f"view layer {layer.name}", "exported", f"another picture than that of {view_layer.name!r}")
    for library in bpy.data.libraries:
        if not Path(bpy.path.abspath(library.filepath)).is_file():
            ledger.note(library.name, "skipped", f"the library {library.filepath} is missing, and all that is linked from it")
    if not light and scene.world and (tree := versions.node_tree(scene.world)):
        output = tree.get_output_node("CYCLES")
        if output and output.inputs["Volume"].is_linked:
            ledger.note(scene.world.name, "approximated", "the world's volume is left out, and its light with it")
            ledger.set_for_cycles(scene, "world", None)


class Placed(NamedTuple):
    """An object in the depsgraph, each of the three evaluated.

    evaluated : the placed object, and its data.
    real : the object in the file that it comes from.
    parent : the object that places it; for an object that is no instance all three are the same.
    """

    evaluated: bpy.types.Object
    real: bpy.types.Object
    parent: bpy.types.Object

    @property
    def name(self) -> str:
        return self.real.original.name


def placed_by(instance: bpy.types.DepsgraphObjectInstance) -> Placed:
    """The object that a depsgraph's instance places, and how."""
    evaluated = instance.object
    real, parent = (instance.instance_object, instance.parent) if instance.is_instance else (evaluated, evaluated)
    return Placed(evaluated, real, parent)


def hidden_from(placed: Placed, layer: bpy.types.ViewLayer) -> frozenset[str]:
    """The kinds of rays (lights.RAYS) that don't see an object, be it by its own flags or by those of what places it."""
    evaluated, _, parent = placed
    hidden = {ray for ray in RAYS if not all(getattr(each, f"visible_{ray}") for each in (evaluated, parent))}
    if parent.indirect_only_get(view_layer=layer):
        hidden.add("camera")
    return frozenset(hidden)


def note_holdout(placed: Placed, depsgraph: bpy.types.Depsgraph, ledger: Ledger) -> None:
    """Note what a hole takes the place of. The layer knows of none in a background set, where 5.2 has one."""
    parent = placed.parent
    if parent.is_holdout or parent.holdout_get(view_layer=depsgraph.view_layer_eval):
        ledger.note(placed.name, "approximated", "a holdout, a plain object on both sides")
        ledger.set_for_cycles(parent.original, "is_holdout", False)
        for collection in _layer_collections(depsgraph.view_layer.layer_collection):
            ledger.set_for_cycles(collection, "holdout", False)


def is_surface(placed: Placed, ledger: Ledger, shading: Shading | None) -> bool:
    """True if this is a mesh or a point cloud; what is drawn but is neither is noted."""
    evaluated, real, _ = placed
    name = placed.name
    if evaluated.type in _NO_SURFACE:
        ledger.note(name, "skipped", _NO_SURFACE[evaluated.type])
        if evaluated.type in _DRAWN_OVER_CYCLES:
            ledger.set_for_cycles(real.original, "hide_render", True)
    elif evaluated.type == "LIGHT":
        if not shading:
            ledger.note(name, "exported", "a light, which leaves no mark in the passes of level geometry")
    elif (modifier := _gas(real)) and evaluated.data == real.data:
        ledger.note(name, "skipped", _NO_SURFACE["VOLUME"])
        if not modifier.show_render:  # Cycles reads its smoke all the same, and a modifier that is off has none: SIGSEGV
            ledger.set_for_cycles(real.original, "hide_render", True, stands_in=False)
    else:
        return isinstance(evaluated.data, bpy.types.Mesh | bpy.types.PointCloud)
    return False


def note_object(
    placed: Placed,
    slots: list[bpy.types.Material | None],
    used: Collection[int],
    depsgraph: bpy.types.Depsgraph,
    ledger: Ledger,
    shading: Shading | None,
) -> None:
    """Note what a visible surface is beyond its geometry.

    slots : its materials.
    used : the indices of the materials that are seen.
    """
    evaluated, real, parent = placed
    name = placed.name
    for each in (evaluated, parent):
        if each.is_shadow_catcher:
            ledger.note(name, "approximated", "a shadow catcher, a plain object on both sides")
            ledger.set_for_cycles(each.original, "is_shadow_catcher", False)
    adaptive = versions.adaptive_subdivision(real.original, depsgraph.scene)
    if adaptive:
        ledger.note(name, "approximated", "adaptive subdivision is subdivision at the render level on both sides")
        ledger.set_for_cycles(*adaptive, False)
    is_empty = isinstance(evaluated.data, bpy.types.Mesh) and any(slots[index] is None for index in used)
    if not shading and versions.DEFAULT_SURFACE_BENDS_NORMALS and is_empty:
        ledger.call_for_cycles(real.original, materials.fill_empty_slots, stands_in=False)
        if any(modifier.type == "NODES" and modifier.show_render for modifier in real.modifiers):
            ledger.bare[name] = real.original
    if used and all(materials.is_volume_alone(slots[index]) for index in used):
        # Transparent alone, where it lies on a floor a ray that has gone through it would miss the floor.
        ledger.set_for_cycles(real.original, "hide_render", True)
    for material in filter(None, slots):
        _note_material(material, placed, ledger, shading)
    if shading:
        _note_light(placed, slots, ledger, shading)


def note_bare(ledger: Ledger, placing: Collection[bpy.types.Object]) -> None:
    """Note the objects whose nodes make surfaces without a material. placing : the objects that place others, which would be
    their own as soon as a node sets materials."""
    for name, block in ledger.bare.items():
        if block.is_editable and block not in placing:
            ledger.call_for_cycles(block, materials.fill_what_nodes_make, stands_in=False)
        else:
            ledger.note(name, "approximated", "has no material, and Cycles may bend its normals where they graze")


def _note_material(material: bpy.types.Material, placed: Placed, ledger: Ledger, shading: Shading | None) -> None:
    """Note what a surface's material is that is not modeled, and what stands in for it on both sides."""
    name, words = placed.name, f"material {material.name!r}"
    if materials.is_volume_alone(material):
        ledger.note(name, "skipped", f"{words} is a volume without a surface, which is not modeled")
        ledger.call_for_cycles(material.original, materials.make_transparent)
        return
    reasons = materials.departures(material, lit=shading is not None)
    if not shading:  # the Normal pass; mirrors and glass bend normals on both sides (scattering.specular_normal)
        ledger.call_for_cycles(material.original, materials.keep_normals, stands_in=False)
    else:
        reading = shading.reading(material)
        reasons += reading.reasons
        tree = versions.node_tree(material)
        nodes.leave_out_circles(tree, ledger, name, f"{words} has")
        for missing in images.missing(tree):
            ledger.note(name, "exported", f"{words} {missing}")
        if reading.mixes_refractions:  # Cycles weighs directions that no facet refracts into as if it sampled them
            reason = "refracts roughly beside another closure that lets light through: Cycles shows up to 5 % more or less"
            ledger.note(name, "approximated", f"{words} {reason}")
        mesh = placed.evaluated.data
        if reading.material.follows_own_uv and isinstance(mesh, bpy.types.Mesh) and not mesh.uv_layers:
            reason = "follows a UV map that the mesh has not: Cycles makes tangents round its origin, and here are none"
            ledger.note(name, "approximated", f"{words} {reason}")
        if reading.is_bumped and not material.cycles.use_bump_map_correction:
            ledger.note(name, "approximated", f"{words} has its bumped normals corrected on both sides")
            ledger.set_for_cycles(material.original.cycles, "use_bump_map_correction", True)
    for reason in reasons:
        ledger.note(name, "approximated", f"{words} {reason}, and a plain one stands in")
    if reasons and shading:
        ledger.call_for_cycles(material.original, materials.stand_in, shading.reading(material))
    elif reasons:
        ledger.call_for_cycles(material.original, materials.make_plain)


def _note_light(placed: Placed, slots: list[bpy.types.Material | None], ledger: Ledger, shading: Shading) -> None:
    """Note what matters as soon as there is light."""
    evaluated, real, parent = placed
    if isinstance(evaluated.data, bpy.types.PointCloud):
        for asked in sorted(shading.attributes(tuple(slots))):
            ledger.note(
                placed.name, "approximated", f"is a point cloud, of which the attribute {asked!r} does not come along: 0"
            )
    for each in (real.original, parent.original):
        for owner, name in versions.shadow_terminator(each):
            ledger.set_for_cycles(owner, name, 0.0, stands_in=False)
        ledger.set_for_cycles(each.cycles, "is_caustics_caster", False, stands_in=False)
        ledger.set_for_cycles(each.cycles, "is_caustics_receiver", False, stands_in=False)


def note_hair(instance: bpy.types.DepsgraphObjectInstance, ledger: Ledger) -> None:
    """Hair of a particle system, which grows beside the object itself."""
    evaluated = instance.object
    if not instance.show_particles or not evaluated.particle_systems:
        return
    systems = (each.particle_system for each in evaluated.modifiers if each.type == "PARTICLE_SYSTEM" and each.show_render)
    if any(system.settings.type == "HAIR" and system.settings.render_type == "PATH" for system in systems):
        ledger.note(evaluated.original.name, "skipped", "particle hair is not modeled")


def lacks_gas(scene: bpy.types.Scene) -> bool:
    """True if smoke is off that Blender may show: what was baked elsewhere, or is simulated as it plays (opening.py)."""
    off = (modifier for each in scene.objects if (modifier := _gas(each)) and not modifier.show_render)
    settings = [modifier.domain_settings for modifier in off]
    return any(each.cache_type == "REPLAY" or each.has_cache_baked_any or each.is_cache_baking_any for each in settings)


def _gas(real: bpy.types.Object) -> bpy.types.FluidModifier | None:
    """The modifier by which an object holds smoke or fire, if any."""
    domains = (each for each in real.modifiers if each.type == "FLUID" and each.fluid_type == "DOMAIN")
    return next((each for each in domains if each.domain_settings.domain_type == "GAS"), None)


def _layer_collections(top: bpy.types.LayerCollection) -> list[bpy.types.LayerCollection]:
    return [top, *(each for child in top.children for each in _layer_collections(child))]
