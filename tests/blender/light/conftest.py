"""A stage of random things under random light, and its pictures from both sides."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from viewcam_addon.tracer import render
from viewcam_addon.tracer.scene import Scene

SCENES = 10


@dataclass(frozen=True)
class Sides:
    """One scene from both sides. traced : passes. cycles : passes of each picture; all rows from the bottom."""

    exported: Scene
    traced: dict
    cycles: list


@pytest.fixture
def stage(fresh_blender, scene, camera, add, mesh_from, make_material, set_world):
    """Suzanne, flat, over a floor, both of random Lambert materials; stage(rng) moves and colours them anew."""
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    camera.data.lens = 35
    set_world((0, 0, 0), 0.0)
    monkey, floor = add(mesh_from("monkey"), "Monkey"), add(mesh_from("plane", size=14), "Floor")
    for block in (monkey, floor):
        block.data.materials.append(make_material(block.name, "ShaderNodeBsdfDiffuse", Roughness=0.0))

    def arrange(rng):
        monkey.rotation_euler = rng.uniform(-math.pi, math.pi, 3)
        monkey.scale = rng.uniform(0.7, 1.5, 3)
        monkey.location = rng.uniform(-0.5, 0.5, 3)
        floor.location, floor.rotation_euler = (0, 0, rng.uniform(-2, -1.5)), rng.uniform(-0.1, 0.1, 3)
        for block in (monkey, floor):
            colour = (*rng.uniform(0.2, 1, 3), 1)
            shader = block.data.materials[0].node_tree.nodes["Shader"] if block.data.materials else None
            if shader and "Color" in shader.inputs:
                shader.inputs["Color"].default_value = colour

    return arrange


@pytest.fixture
def pictures(stage, read_passes, tmp_path):
    """pictures(arrange, samples=…, count=…, …) → Sides of ten scenes: `arrange(rng)` changes what the stage has set up.

    samples : of each of Cycles' pictures; count : how many of them, the tracer having the samples of all. The rest is as in
    job.Request.
    """
    from viewcam_addon.blender.rendering import job

    def make(arrange=lambda rng: None, samples=1, count=1, level="direct", scenes=SCENES, **request):
        exported, paths = [], []
        for number in range(scenes):
            rng = np.random.default_rng(number)
            stage(rng)
            arrange(rng)
            paths.append([tmp_path / f"{number}-{picture}.exr" for picture in range(count)])
            wanted = job.Request(threads=2, level=level, samples=samples * count, **request)
            exported.append(job.export_and_render(wanted, paths[-1]))
        passes = iter(read_passes([path for each in paths for path in each]))
        return [
            Sides(each, render.render(each, level, samples * count, threads=2), [next(passes) for _ in range(count)])
            for each in exported
        ]

    return make
