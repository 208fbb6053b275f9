"""The speed at which the noise of pictures falls: the tracer's, beside Cycles' and random numbers', on the same Blender scenes.

RMS error over all pixels, of a mean radiance of about 1: an edge of what shines by itself, which is anti-aliasing alone; a soft
shadow, cast on a floor by a board under a square lamp; and the same in a corner of white walls, at three bounces.

Each contestant is measured against a picture of its own of many more samples and another seed, so that what is compared is
noise, whatever their filters differ by. Random numbers are pairs of samples in the same integrator, each pair with a seed of
its own: a single sample would be the pixel's center.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
from numpy.typing import NDArray

from viewcam_addon.blender.rendering import cycles
from viewcam_addon.blender.scenes.export import export_scene
from viewcam_addon.blender.scenes.ledger import Ledger
from viewcam_addon.tracer.render import render

from ..charts import Chart, Curve
from ..stability.stage import empty_stage, read_elsewhere
from .convergence import slope

Picture = Callable[[int, int], NDArray[np.float32]]
"""(samples, seed) → (height, width, 3)."""


def charts(quick: bool = False) -> tuple[Chart, ...]:
    return tuple(
        _chart(name, title, size, level, build, quick)
        for name, title, size, level, build in (
            ("edge", "A picture of an edge", (72, 48), "direct", _edge),
            ("shadow", "A picture of a soft shadow", (36, 24), "direct", _shadow),
            ("corner", "A picture of a corner, three bounces", (36, 24), "path", partial(_shadow, walls=True)),
        )
    )


def _chart(
    name: str, title: str, size: tuple[int, int], level: str, build: Callable[[bpy.types.Scene], None], quick: bool
) -> Chart:
    samples = [4**power for power in range(1, 4 if quick else 6)]
    scene, camera = empty_stage(*size)
    camera.location, camera.rotation_euler = (0.0, -6.0, 4.0), (0.95, 0.0, 0.0)
    build(scene)
    bpy.context.view_layer.update()
    ledger = Ledger()
    exported = export_scene(scene, scene.view_layers[0], camera, ledger, lit=True)

    def ours(count: int, seed: int) -> NDArray[np.float32]:
        return render(exported, level, count, seed)["Combined"][..., :3]

    def noise(count: int, seed: int) -> NDArray[np.float32]:
        return np.mean([ours(2, seed + 1000 * (pair + 1)) for pair in range(count // 2)], axis=0)

    def theirs(count: int, seed: int) -> NDArray[np.float32]:
        light = cycles.LightSettings(exported.film, exported.bounces, count, seed)
        with TemporaryDirectory() as folder:
            path = Path(folder) / "picture.exr"
            cycles.render(scene, scene.view_layers[0], camera, path, ledger.remedies.values(), light=light)
            return read_elsewhere(path).passes["Combined"][..., :3]

    true = {picture: picture(samples[-1] * 16, 1) for picture in (ours, theirs)} | {noise: None}
    true[noise] = true[ours]
    curves = [
        Curve(label, samples, [_rms(picture(count, 0) - true[picture]) for count in samples], ours=picture is ours)
        for label, picture in (("random numbers", noise), ("Cycles", theirs), ("ours", ours))
    ]
    slopes = [f"{curve.name} {slope(curve.x, curve.y):.2f}" for curve in curves]
    return Chart(
        f"pictures-{name}",
        title,
        "samples of each pixel",
        "RMS error of all pixels",
        tuple(curves),
        f"Read how steeply the noise falls, as a power of the samples: {', '.join(slopes)}.",
        tie=0.0,
    )


def _rms(errors: NDArray[np.float32]) -> float:
    return float(np.sqrt(np.mean(np.square(errors, dtype=np.float64))))


def _edge(scene: bpy.types.Scene) -> None:
    board = _board(scene, (3.0, 2.0), (0.3, 0.1, 0.5), _material("ShaderNodeEmission"))
    board.rotation_euler = (0.4, 0.3, 0.5)


def _shadow(scene: bpy.types.Scene, walls: bool = False) -> None:
    gray = _material("ShaderNodeBsdfDiffuse")
    _board(scene, (20.0, 20.0), (0.0, 0.0, 0.0), gray)
    _board(scene, (1.2, 1.2), (0.2, 0.0, 0.8), gray)
    if walls:
        _board(scene, (20.0, 20.0), (0.0, 2.5, 0.0), gray).rotation_euler = (1.5707963, 0.0, 0.0)
    lamp = bpy.data.lights.new("Lamp", "AREA")
    lamp.energy, lamp.size = 150.0, 1.0
    placed = bpy.data.objects.new("Lamp", lamp)
    placed.location = (0.0, 0.0, 2.5)
    scene.collection.objects.link(placed)
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 3 if walls else 0


def _board(
    scene: bpy.types.Scene, size: tuple[float, float], place: tuple[float, float, float], material: bpy.types.Material
) -> bpy.types.Object:
    x, y = size[0] / 2, size[1] / 2
    mesh = bpy.data.meshes.new("Board")
    mesh.from_pydata([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    board = bpy.data.objects.new("Board", mesh)
    board.location = place
    scene.collection.objects.link(board)
    return board


def _material(shader: str) -> bpy.types.Material:
    material = bpy.data.materials.new(shader)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new(shader), tree.nodes.new("ShaderNodeOutputMaterial")
    node.inputs["Color"].default_value = (0.8, 0.8, 0.8, 1.0)
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material
