"""Inputs of shaders that are not modelled, as images that Cycles' own baker makes of them.

Another Blender bakes them (baker.py), so that nothing here changes. Both sides of a comparison are then shown the images, in
the places that a formula gives each face (charts.py). What is baked is what a surface is like wherever it is looked at from.
"""

import json
import subprocess
from dataclasses import dataclass

import bpy
import numpy as np

from ...files import temporary_folder
from ...tracer.scene.materials import Picture
from .. import another_blender, versions
from . import baker, export_geometry, features, nodes, shaders
from .nodes import Input, Output

_TIMEOUT = 600.0
# What is not modelled, and is baked.
_NOISY = {"AMBIENT_OCCLUSION"}
_BAKED = {*_NOISY, "TEX_GABOR", "ShaderNodeRadialTiling", "TEX_SKY"}
# What else than the place on the surface decides.
_ELSEWHERE = {
    *("LIGHT_PATH", "CAMERA", "FRESNEL", "LAYER_WEIGHT", "BUMP", "NORMAL_MAP", "WIREFRAME"),
    *("BEVEL", "MATERIAL_RAYCAST", "SCRIPT"),
    *("PARTICLE_INFO", "HAIR_INFO", "POINT_INFO", "UVALONGSTROKE", "VOLUME_INFO", "SHADERTORGB"),
    *(("TEX_COORD", output) for output in ("Reflection", "Camera", "Window")),
    *(("NEW_GEOMETRY", output) for output in ("Incoming", "Backfacing")),
}
_UVS = {"TEX_IMAGE", "UVMAP", "TANGENT", ("TEX_COORD", "UV")}

_Place = tuple[bpy.types.Object, bpy.types.Mesh]
"""An object, and its evaluated mesh."""


@dataclass(frozen=True)
class _Job:
    """An input to bake, and the evaluated mesh of the only object that shows it."""

    block: bpy.types.Object
    mesh: bpy.types.Mesh
    unknown: shaders.Unknown
    material: bpy.types.Material


def baked_in(depsgraph: bpy.types.Depsgraph) -> dict[str, dict[tuple[str, str], shaders.Baked | str]]:
    """The images that were baked for the materials of a depsgraph, by their full names, or a clause that says why it was
    not."""
    found: dict[str, dict[tuple[str, str], shaders.Baked | str]] = {}
    jobs = []
    for material, places in _shown(depsgraph).items():
        place = _only_place(material, places)
        for unknown in shaders.read(material.evaluated_get(depsgraph)).unknown:
            if not _is_of_the_place(unknown.of, isinstance(place, str) or bool(place[1].uv_layers)):
                continue
            refused = place if isinstance(place, str) else "nor can another Blender bake it"
            found.setdefault(material.name_full, {})[unknown.node, unknown.input] = refused
            if not isinstance(place, str):
                jobs.append(_Job(*place, unknown, material))
    if not jobs:
        return found
    with temporary_folder() as folder:
        library, faces, out = (folder / name for name in ("scene.blend", "faces.npz", "baked.npz"))
        scene = depsgraph.scene
        bpy.data.libraries.write(str(library), {scene.original}, path_remap="ABSOLUTE", fake_user=True)
        np.savez(faces, **{name: values for number, job in enumerate(jobs) for name, values in _faces(job, number).items()})
        asked = json.dumps([_described(job) for job in jobs])
        arguments = [
            str(library),
            scene.original.name,
            asked,
            str(faces),
            str(out),
            depsgraph.view_layer.name,
            str(scene.frame_current),
        ]
        try:
            another_blender.call("blender.scenes.baker", [*arguments, repr(scene.frame_subframe)], _TIMEOUT)
            with np.load(out) as made:
                for number, job in enumerate(jobs):
                    if f"pixels{number}" not in made:
                        continue
                    picture = Picture(np.nan_to_num(made[f"pixels{number}"], nan=0.0, posinf=0.0, neginf=0.0))
                    baked = shaders.Baked(picture, float(made[f"difference{number}"]), baker.DIFFERENCE)
                    found[job.material.name_full][job.unknown.node, job.unknown.input] = baked
        except (OSError, subprocess.TimeoutExpired):
            pass
    return found


def _described(job: _Job) -> dict[str, object]:
    unknown = job.unknown
    is_noisy = any(each.node.type in _NOISY for each in nodes.feeding(unknown.of))
    named = {"object": job.block.name, "material": job.material.name, "node": unknown.node, "input": unknown.input}
    return named | {"is_number": unknown.is_number, "is_noisy": is_noisy}


def _faces(job: _Job, number: int) -> dict[str, np.ndarray]:
    materials = export_geometry.materials_of(job.mesh, len(job.block.material_slots))
    slots = [slot.material == job.material for slot in job.block.material_slots]
    totals = export_geometry.read(job.mesh.polygons, "loop_total", np.int32)
    return {f"totals{number}": totals, f"shown{number}": np.array(slots)[materials]}


def _shown(depsgraph: bpy.types.Depsgraph) -> dict[bpy.types.Material, list[_Place | None]]:
    """Where each material is shown that may ask for baking; None is an object that can't be given a modifier for a while."""
    suspects = {material for material in bpy.data.materials if not material.library and _has_any(material)}
    shown: dict[bpy.types.Material, list[_Place | None]] = {}
    for instance in depsgraph.object_instances if suspects else ():
        placed = features.placed_by(instance)
        if not instance.show_self or depsgraph.view_layer_eval.material_override:
            continue
        block, mesh = placed.real.original, placed.shown.data
        is_own = not instance.is_instance and isinstance(mesh, bpy.types.Mesh) and _may_change(block)
        for material in suspects & {slot.material.original for slot in placed.shown.material_slots if slot.material}:
            shown.setdefault(material, []).append((block, mesh) if is_own else None)
    return shown


def _only_place(material: bpy.types.Material, places: list[_Place | None]) -> _Place | str:
    """Where a material can be baked, or a clause that says why not."""
    if len(places) > 1:
        return "nor baked, since it is shown in several places"
    if places[0] is None:
        return "nor baked, since what shows it is an instance, linked, being edited, or no mesh"
    block, mesh = places[0]
    if material not in [slot.material for slot in block.material_slots]:
        return "nor baked, since geometry nodes gave it to what shows it"
    most = (baker.LARGEST // (2 * baker.SMALLEST_CELL)) ** 2
    if len(mesh.polygons) > most:
        return f"nor baked, since its mesh has more than {most:,} faces"
    return "nor baked, since Python drives something in the file" if _runs_scripts() else (block, mesh)


def _has_any(material: bpy.types.Material) -> bool:
    tree = versions.node_tree(material)
    return tree is not None and any(node.type in _BAKED for node in nodes.all_of(tree))


def _runs_scripts() -> bool:
    """True if something in the file is driven by Python, which does not run in the other Blender."""
    trees = [versions.node_tree(material) for material in bpy.data.materials]
    data = bpy.data
    blocks = [*data.objects, *data.meshes, *data.shape_keys, *data.armatures, *data.node_groups, *filter(None, trees)]
    drivers = [curve.driver for each in blocks if each.animation_data for curve in each.animation_data.drivers]
    return any(driver.type == "SCRIPTED" and not driver.is_simple_expression for driver in drivers)


def _may_change(block: bpy.types.Object) -> bool:
    """True if an object can be given a modifier for a while."""
    return block.type == "MESH" and not block.library and block.mode == "OBJECT"


def _is_of_the_place(of: Input, has_uvs: bool) -> bool:
    """True if what feeds an input is the same wherever a surface is looked at from, and something in it is baked."""
    feeding = nodes.feeding(of)
    return any(each.node.type in _BAKED for each in feeding) and all(_is_alike(each, has_uvs) for each in feeding)


def _is_alike(output: Output, has_uvs: bool) -> bool:
    node, named = output.node, (output.node.type, output.socket.name)
    image = getattr(node, "image", None)
    if {node.type, named} & _ELSEWHERE or (image is not None and image.original.is_dirty):
        return False
    if node.type == "VECT_TRANSFORM" and "CAMERA" in (node.convert_from, node.convert_to):
        return False
    return has_uvs or not {node.type, named} & _UVS
