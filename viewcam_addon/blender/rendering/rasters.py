"""EEVEE's and Workbench's side of a comparison of geometry: one sample at each pixel's center, to be read by
comparison/renderers.py, which says what these engines lack.

EEVEE draws a material of ours in place of all others, which writes position, normal and object index into outputs of its own
(AOVs). Workbench draws objects flat in their colors, which are their indices, and its depth. Everything is overridden and
restored.

Both need a graphics driver, llvmpipe in software for one. Where there is neither display nor driver, Blender ends with a crash
as soon as it is asked to draw (measured: 4.2, 5.0 and 5.2), so a Blender of its own is asked: it draws a picture of 4 × 4
pixels of nothing. Rejected: `gpu.platform`, which says nothing in the background.
"""

import functools
import os
import subprocess
from collections.abc import Iterable, Sequence

import bpy

from ...comparison.renderers import DIGITS, PARTS, note, part_names
from ...errors import InputError
from .. import another_blender, datablocks, versions
from ..scenes.ledger import Remedy
from ..temporary_settings import Overrides, overridden
from . import cycles

_RENDER = {
    "film_transparent": True,
    # Nothing is left of the filter, and with one sample no jitter: EEVEE's rays go through the pixels' centers.
    "filter_size": 0.0,
    "use_high_quality_normals": True,
}
_EEVEE = {
    "taa_render_samples": 1,
    "use_raytracing": False,
    "use_shadows": False,
    "use_fast_gi": False,
    "use_overscan": False,
}
_WORKBENCH = {
    "light": "FLAT",
    "color_type": "OBJECT",
    "show_backface_culling": False,
    "show_xray": False,
    "show_shadows": False,
    "show_cavity": False,
    "show_object_outline": False,
    "use_dof": False,
}
_DRAW = """
import bpy
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
scene = bpy.context.scene
scene.camera = bpy.data.objects.new("", bpy.data.cameras.new(""))
scene.collection.objects.link(scene.camera)
scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "BLENDER_WORKBENCH", 4, 4
bpy.ops.render.render()
"""
_LONGEST = 120  # seconds


@functools.cache
def can_draw() -> bool:
    """True if a Blender like this one draws with a GPU here; asked once, which takes seconds."""
    try:
        return another_blender.run(_DRAW, _LONGEST).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def render(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    camera_object: bpy.types.Object | None,
    path: str | os.PathLike[str],
    engine: str,
    remedies: Iterable[Remedy] = (),
    threads: int | None = None,
) -> None:
    """Render one view layer at the current frame to a multilayer EXR, whole or not at all.

    engine : "EEVEE" or "WORKBENCH".
    camera_object, remedies, threads : see cycles.render.

    Raises InputError if there is no graphics driver, if this EEVEE can't draw our material, if Blender reports an error, or if
    the file can't be written.
    """
    if engine == "EEVEE" and not versions.EEVEE_OVERRIDES_MATERIALS:
        raise InputError(f"EEVEE of Blender {bpy.app.version_string} writes no geometry: check it with Blender 5.0 or newer")
    if not can_draw():
        raise InputError(f"{engine} needs a graphics driver, and there is none: install one (llvmpipe draws in software)")
    with overridden() as overrides:
        cycles.override_all(overrides, scene.render, _RENDER)
        seen_through = camera_object or datablocks.require_render_camera(scene)
        overrides.set(view_layer, "use_pass_combined", True)
        overrides.set(scene.render, "use_stamp_note", True)
        overrides.set(scene.render, "stamp_note_text", note(engine, seen_through.data.clip_start))
        if engine == "EEVEE":
            overrides.set(scene.render, "engine", versions.EEVEE)
            cycles.override_all(overrides, scene.eevee, _EEVEE)
            overrides.set(view_layer, "material_override", _material(overrides, view_layer))
        else:
            overrides.set(scene.render, "engine", "BLENDER_WORKBENCH")
            overrides.set(view_layer, "use_pass_z", True)
            overrides.set(scene.display, "render_aa", "OFF")
            cycles.override_all(overrides, scene.display.shading, _WORKBENCH)
            for each in bpy.data.objects:
                digits = [each.pass_index // DIGITS**place % DIGITS / DIGITS for place in range(3)]
                overrides.set(each, "color", (*digits, 1.0))
        cycles.render_file(overrides, scene, view_layer, camera_object, path, remedies, threads)


def _material(overrides: Overrides, view_layer: bpy.types.ViewLayer) -> bpy.types.Material:
    """A material that writes what renderers.PARTS names into outputs of the view layer, gone when the overrides end."""
    material = bpy.data.materials.new("Virtual Pinhole")
    overrides.afterwards(bpy.data.materials.remove, material)
    if not material.node_tree:  # from 5.0 on new materials have one
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    tree.links.new(tree.nodes.new("ShaderNodeEmission").outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[0])
    seen, placed = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeObjectInfo")
    for name, source in (
        ("Position", seen.outputs["Position"]),
        ("Normal", seen.outputs["Normal"]),
        ("Object Index", placed.outputs["Object Index"]),
    ):
        _write_parts(overrides, view_layer, tree, source, part_names(name), PARTS[name])
    return material


def _write_parts(
    overrides: Overrides,
    view_layer: bpy.types.ViewLayer,
    tree: bpy.types.NodeTree,
    rest: bpy.types.NodeSocket,
    names: Sequence[str],
    steps: Sequence[float],
) -> None:
    """Write the nearest whole steps of a vector, then those of the next step of what is left, and the rest."""
    for name, step in zip(names, (*steps, None), strict=True):
        part = rest
        if step is not None:
            nearest = _vector_node(tree, "ADD", rest, (step / 2,) * 3)
            part = _vector_node(tree, "SNAP", nearest, (step,) * 3)
            rest = _vector_node(tree, "SUBTRACT", rest, part)
        asked = view_layer.aovs.add()
        asked.name, asked.type = name, "COLOR"
        overrides.afterwards(_remove_output, view_layer, name)
        output = tree.nodes.new("ShaderNodeOutputAOV")
        output.aov_name = name
        tree.links.new(part, output.inputs["Color"])


def _remove_output(view_layer: bpy.types.ViewLayer, name: str) -> None:
    view_layer.aovs.remove(view_layer.aovs[name])  # asked by name: those added before may have moved in memory


def _vector_node(
    tree: bpy.types.NodeTree, operation: str, *operands: bpy.types.NodeSocket | tuple[float, float, float]
) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    for socket, operand in zip(node.inputs, operands, strict=False):
        if isinstance(operand, tuple):
            socket.default_value = operand
        else:
            tree.links.new(operand, socket)
    return node.outputs[0]
