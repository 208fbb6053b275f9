"""Which materials change where a surface is or what its passes say, and the plain one that stands in for them in Cycles.

Level geometry models no material. Most leave the passes of geometry alone; some do not: displacement moves the surface, bump
and normal maps turn the Normal pass, and where a surface is transparent Cycles writes what lies behind. For the time of a
comparison such a material gets a second output for Cycles, a diffuse surface of its viewport colour; its own nodes stay as
they are.
"""

from collections.abc import Iterator

import bpy

from . import versions
from .borrowing import Borrower

# Node types that let something else than the surface's own geometry into the passes.
_TRANSPARENT = {"BSDF_TRANSPARENT", "HOLDOUT"}
_TURNING = {"BUMP", "NORMAL_MAP", "BEVEL"}
_UNKNOWN = {"SCRIPT"}


def departures(material: bpy.types.Material) -> list[str]:
    """Why this material's surface is not what level geometry models, one clause each; empty for most materials."""
    tree = versions.node_tree(material)
    if tree is None:
        return []
    output = tree.get_output_node("CYCLES")
    if output is None:
        return ["has no output, so that Cycles draws nothing"]
    reasons = []
    if output.inputs["Displacement"].is_linked:
        reasons.append("is displaced")
    if output.inputs["Volume"].is_linked:
        reasons.append("has a volume")
    nodes = list(_nodes(tree, set()))
    if any(node.type in _TRANSPARENT or _sees_through(node) for node in nodes):
        reasons.append("is transparent")
    if any(node.type in _TURNING or _is_turned(node) for node in nodes):
        reasons.append("turns the normals")
    if any(node.type in _UNKNOWN for node in nodes):
        reasons.append("runs a script")
    if not output.inputs["Surface"].is_linked:
        reasons.append("has no surface")
    return reasons


def make_plain(borrow: Borrower, material: bpy.types.Material) -> None:
    """Let Cycles see a diffuse surface until the loan ends."""
    nodes = material.node_tree.nodes
    active = nodes.active
    outputs = [(node, node.is_active_output) for node in nodes if node.type == "OUTPUT_MATERIAL"]
    output, surface = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeBsdfDiffuse")

    def undo() -> None:
        nodes.remove(output)
        nodes.remove(surface)
        for node, was_active in outputs:
            node.is_active_output = was_active
        nodes.active = active

    borrow.afterwards(undo)
    output.target = "CYCLES"
    surface.inputs["Color"].default_value = material.diffuse_color
    material.node_tree.links.new(surface.outputs["BSDF"], output.inputs["Surface"])
    for node, _ in outputs:
        node.is_active_output = False
    output.is_active_output = True


def keep_normals(borrow: Borrower, material: bpy.types.Material) -> None:
    """Keep Cycles from bending the normals of smooth surfaces, seen at a grazing angle, so far that they reflect."""
    borrow.set(material.cycles, "use_bump_map_correction", False)


def fill_empty_slots(borrow: Borrower, block: bpy.types.Object) -> None:
    """Give an object a material where it has none, until the loan ends: Cycles' own default bends normals."""
    material = plain(borrow)
    if not block.material_slots:
        borrow.afterwards(block.data.materials.clear)  # pop would leave a slot behind on the object
        block.data.materials.append(material)
    for slot in block.material_slots:
        if slot.material is None:
            borrow.set(slot, "material", material)


def plain(borrow: Borrower) -> bpy.types.Material:
    """A material that leaves all passes alone, gone when the loan ends."""
    material = bpy.data.materials.new("Virtual Pinhole")
    borrow.afterwards(bpy.data.materials.remove, material)
    material.cycles.use_bump_map_correction = False
    return material


def _nodes(tree: bpy.types.NodeTree, seen: set[bpy.types.NodeTree]) -> Iterator[bpy.types.Node]:
    """All nodes of the tree and of the groups in it; whether they lead to the output is not asked."""
    seen.add(tree)
    for node in tree.nodes:
        if node.mute:
            continue
        yield node
        group = getattr(node, "node_tree", None)
        if group and group not in seen:
            yield from _nodes(group, seen)


def _sees_through(node: bpy.types.Node) -> bool:
    """Whether the node has an opacity that is not plainly 1."""
    alpha = node.inputs.get("Alpha") if node.type == "BSDF_PRINCIPLED" else None
    return alpha is not None and (alpha.is_linked or alpha.default_value != 1.0)


def _is_turned(node: bpy.types.Node) -> bool:
    """Whether a shader takes its normal from another node."""
    is_shader = any(output.type == "SHADER" for output in node.outputs)
    return is_shader and any("Normal" in socket.name and socket.is_linked for socket in node.inputs)
