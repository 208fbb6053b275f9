"""Inputs of shaders baked by Cycles' own baker, in a Blender that was started for it by baked_inputs.py."""

import contextlib
import json
import math
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import versions
from ..temporary_settings import Overrides, overridden
from . import charts

LARGEST = 2048
"""Texels across the largest image."""
DIFFERENCE = 0.01
"""Between an image and one of half its width (charts.difference), up to which it is exact enough: 2.5 levels of 255."""
SMALLEST_CELL = 8
_SMALLEST = 128
_MARGIN = 2  # texels round each face, of the two that the smallest cell of a finer image has
_SAMPLES = 64
"""The samples of an input that is noisy, each with the samples that its nodes take."""


def main(library: str, name: str, jobs: str, faces: str, out: str, layer: str, frame: str, subframe: str) -> None:
    """Bake inputs of shaders in the scene of this name in a .blend.

    jobs : JSON, a list of {object, material, node, input, is_number, is_noisy}. faces : an npz, of job 0 `totals0`, how many
    corners each face has, and `shown0`, whether it is of the material. out : the npz that is written, of it `pixels0`,
    (n, n, 3) float32, rows from the bottom, and `difference0`; nothing of what Blender refuses to bake.
    """
    bpy.data.batch_remove([*bpy.data.objects, *bpy.data.materials])  # whose names others may have
    with bpy.data.libraries.load(library) as (_, wanted):
        wanted.scenes = [name]
    (scene,) = wanted.scenes
    scene.frame_set(int(frame), subframe=float(subframe))
    _reset(scene)
    found: dict[str, NDArray | float] = {}
    with np.load(faces) as shape:
        for number, job in enumerate(json.loads(jobs)):
            with overridden() as overrides, contextlib.suppress(RuntimeError):
                baker = _Baker(overrides, scene, scene.view_layers[layer], job, shape[f"totals{number}"])
                found[f"pixels{number}"], found[f"difference{number}"] = baker.exact_enough(shape[f"shown{number}"])
    np.savez(out, **found)


def _reset(scene: bpy.types.Scene) -> None:
    """Let nothing that an artist has set for other bakes and renders have a say."""
    scene.render.engine, scene.cycles.shading_system = "CYCLES", False  # and no script of any material
    settings = {"device": "CPU", "use_adaptive_sampling": False, "use_denoising": False, "film_exposure": 1.0}
    for name, value in (settings | {"sample_clamp_direct": 0.0, "sample_clamp_indirect": 0.0}).items():
        setattr(scene.cycles, name, value)
    bake = scene.render.bake
    bake.use_selected_to_active, bake.use_clear, bake.use_split_materials = False, True, False
    bake.target, bake.save_mode = "IMAGE_TEXTURES", "INTERNAL"
    bake.margin, bake.margin_type = _MARGIN, "EXTEND"


class _Baker:
    """Bakes one input, to images of any width."""

    def __init__(
        self,
        overrides: Overrides,
        scene: bpy.types.Scene,
        layer: bpy.types.ViewLayer,
        job: dict[str, Any],
        totals: NDArray[np.int32],
    ) -> None:
        self._scene, self._layer, self._totals = scene, layer, totals
        self._block = scene.objects[job["object"]]
        uvs = self._block.data.uv_layers
        uvs.new(name=charts.NAME, do_init=False)  # which the baker asks for before there are geometry nodes
        overrides.afterwards(lambda: uvs.remove(uvs[charts.NAME]))
        charts.lay_out(overrides, self._block, len(totals), "FLOAT2")
        scene.cycles.samples = _SAMPLES if job["is_noisy"] else 1  # the first one is in the middle of a texel
        tree = bpy.data.materials[job["material"]].node_tree
        _show(tree, next(each for each in tree.nodes[job["node"]].inputs if each.identifier == job["input"]), job["is_number"])

    def exact_enough(self, shown: NDArray[np.bool_]) -> tuple[NDArray[np.float32], float]:
        """The first image that differs little from one of half its width, or the last that is tried, and that difference.

        No further one is tried where a quarter of the difference with each doubling, as where all is smooth, would not do.
        """
        across, size = charts.columns(len(self._totals)), SMALLEST_CELL
        while size * across < _SMALLEST:
            size *= 2
        coarse = self._image(size * across)
        while True:
            size *= 2
            fine = self._image(size * across)
            difference = charts.difference(coarse, fine, charts.covered(self._totals, shown, size))
            left = int(math.log2(LARGEST / (size * across)))
            if difference <= DIFFERENCE or left == 0 or difference > DIFFERENCE * 4**left:
                return fine, difference
            coarse = fine

    def _image(self, width: int) -> NDArray[np.float32]:
        """(width, width, 3) of the whole object."""
        image = bpy.data.images.new(charts.NAME, width, width, alpha=False, float_buffer=True, is_data=True)
        for slot in self._block.material_slots:
            slot.material = slot.material or bpy.data.materials.new(charts.NAME)
            if versions.node_tree(slot.material) is None:
                slot.material.use_nodes = True
            tree = slot.material.node_tree
            texture = tree.nodes.new("ShaderNodeTexImage")
            texture.image, tree.nodes.active = image, texture
        block = self._block
        chosen = {"object": block, "active_object": block, "selected_objects": [block]}
        with bpy.context.temp_override(scene=self._scene, view_layer=self._layer, **chosen):
            bpy.ops.object.bake(type="EMIT", uv_layer=charts.NAME)
        pixels = np.empty(width * width * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return np.ascontiguousarray(pixels.reshape(width, width, -1)[..., :3])


def _show(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, is_number: bool) -> None:
    """Let a material give off what an input of one of its nodes is given."""
    source = next(link.from_socket for link in socket.links if link.is_valid and not link.is_muted)
    if is_number:
        as_number = tree.nodes.new("ShaderNodeMath")
        as_number.operation, as_number.inputs[1].default_value = "ADD", 0.0
        tree.links.new(source, as_number.inputs[0])
        source = as_number.outputs[0]
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(source, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
