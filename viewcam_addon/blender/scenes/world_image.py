"""A world that is not modeled as it is, as an image that Cycles itself makes of it, and its suns as lamps.

Another Blender renders it (panorama.py), so that nothing here changes, whatever is going on: an export runs while Blender
renders. Both sides of a comparison are then shown the image and the lamps.
"""

import subprocess
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...files import temporary_folder
from ...tracer.scene.colors import LARGEST_RADIANCE
from ...tracer.scene.lamps import RAYS, Sun, World
from ...tracer.scene.materials import Picture
from .. import another_blender, versions
from ..temporary_settings import Overrides
from . import images, lamps, nodes
from .nodes import Input, Output

WIDTH = 2048
"""The width of an image that nothing in the world asks to be wider. A sky of 4096 gives surfaces the same light to 2e-5."""
MOST_WIDTH = 4096
_TIMEOUT = 600.0
_ALL_RAYS = frozenset(RAYS[:-1])


@dataclass(frozen=True)
class Rendered:
    """A world without what is hidden, its suns, and what it shows: name → picture."""

    world: World
    suns: tuple[Sun, ...]
    pictures: dict[str, Picture]


def obstacle(world: bpy.types.World) -> str | None:
    """The reason that no image can stand in for a world, one clause, or None where one can."""
    for each in _feeding(world):
        node, output = each.node, each.socket.name
        image = getattr(node, "image", None)
        if (
            node.type in ("CAMERA", "ATTRIBUTE", "SCRIPT")
            or (node.type == "TEX_COORD" and (output in ("Camera", "Window") or node.object))
            or (image is not None and image.is_dirty and image.source != "VIEWER")
        ):
            return f"has a node {node.name!r} that more than a direction and the file decides"
    return None


def width(world: bpy.types.World) -> int:
    """The width of the image that stands in, pixels."""
    wrapped = [each.node.image for each in _feeding(world) if each.node.type == "TEX_ENVIRONMENT" and each.node.image]
    return min(max([WIDTH, *(image.size[0] for image in wrapped)]), MOST_WIDTH)


def tells_rays_apart(world: bpy.types.World) -> bool:
    """True if other rays than the camera's see different worlds."""
    return any(each.node.type == "LIGHT_PATH" and each.socket.name != "Is Camera Ray" for each in _feeding(world))


def _feeding(world: bpy.types.World) -> set[Output]:
    """All outputs that a world's surface is made of."""
    tree: Any = versions.node_tree(world)
    return nodes.feeding(Input(tree.get_output_node("CYCLES").inputs["Surface"]))


def rendered(world: bpy.types.World, scene: bpy.types.Scene) -> Rendered | None:
    """The image that another Blender renders of a world without an obstacle at a scene's frame; None if it can't."""
    with temporary_folder() as folder:
        library, out = folder / "world.blend", folder / "world.npz"
        bpy.data.libraries.write(str(library), {world.original}, path_remap="ABSOLUTE", fake_user=True)
        arguments = [str(library), world.original.name, str(out), str(width(world)), str(scene.frame_current)]
        try:
            another_blender.call("blender.scenes.panorama", [*arguments, repr(scene.frame_subframe)], _TIMEOUT)
            with np.load(out) as arrays:
                return _rendered(world.name, {name: arrays[name] for name in arrays.files})
        except (OSError, subprocess.TimeoutExpired):
            return None


def _rendered(name: str, arrays: dict[str, NDArray]) -> Rendered:
    pictures: dict[str, Picture] = {}
    world, backdrop = _world(f"{name} (rendered)", arrays["light"], pictures), None
    if arrays["seen"] is not arrays["light"] and not np.array_equal(arrays["seen"], arrays["light"]):
        backdrop = _world(f"{name} (seen)", arrays["seen"], pictures)
    suns = []
    for number, (lit, seen) in enumerate(zip(arrays["light_suns"], arrays["seen_suns"], strict=True)):
        same = np.allclose(lit, seen, rtol=1e-6, atol=0.0)
        sides = ((lit, frozenset()),) if same else ((lit, frozenset({"camera"})), (seen, _ALL_RAYS - {"camera"}))
        for (x, y, z, *irradiance, angle), hidden_from in sides:
            if any(irradiance):
                title = f"{name} (sun{f' {number + 1}' if number else ''})"
                suns.append(Sun(title, hidden_from, towards=(x, y, z), irradiance=tuple(irradiance), angle=angle))
    return Rendered(replace(world, backdrop=backdrop), tuple(suns), pictures)


def _world(name: str, pixels: NDArray[np.float32], pictures: dict[str, Picture]) -> World:
    """The world that looks like this: one color, or an image, which `pictures` receives by its name."""
    pixels = np.nan_to_num(np.clip(pixels, 0.0, LARGEST_RADIANCE), nan=0.0)
    if (pixels == pixels[0, 0]).all():
        return World(tuple(pixels[0, 0].tolist()))
    pictures[name] = Picture(pixels)
    return World((1.0, 1.0, 1.0), image=name)


def show(overrides: Overrides, world: bpy.types.World, scene: bpy.types.Scene, rendered: Rendered) -> None:
    """Let Cycles see the image and the lamps in place of a world."""
    output, adder = nodes.override_output(overrides, world.node_tree, "ShaderNodeOutputWorld")
    images_by_name = {
        name: images.image_of(picture, name, overrides, packed=False) for name, picture in rendered.pictures.items()
    }
    _add_world(adder, output, rendered.world, images_by_name)
    for sun in rendered.suns:
        data, matrix = lamps.light_of(sun, overrides)
        block = bpy.data.objects.new(sun.name, data)
        overrides.afterwards(bpy.data.batch_remove, [block])
        block.matrix_world = matrix.T.tolist()
        for ray in RAYS:
            setattr(block, f"visible_{ray}", ray not in sun.hidden_from)
        scene.collection.objects.link(block)


def _add_world(adder: nodes.Adder, output: bpy.types.Node, world: World, images_by_name: dict[str, bpy.types.Image]) -> None:
    """Let a world's output show what lights and, where that is another world, what the camera sees.

    images_by_name : `World.image` → the image.
    """
    backgrounds = []
    for each in filter(None, (world, world.backdrop)):
        background = adder.add("ShaderNodeBackground", Color=(*each.radiance, 1.0), Strength=1.0)
        if each.image is not None:
            background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
            _add_environment(adder, background, each, images_by_name[each.image])
        backgrounds.append(background.outputs[0])
    surface = backgrounds[0]
    if world.backdrop:
        is_camera = adder.add("ShaderNodeLightPath").outputs["Is Camera Ray"]
        surface = adder.add("ShaderNodeMixShader", is_camera, *backgrounds).outputs[0]
    adder.link(surface, output.inputs["Surface"])


def _add_environment(adder: nodes.Adder, background: bpy.types.Node, world: World, image: bpy.types.Image) -> None:
    """Let a Background node show an image that is wrapped around the world."""
    coordinates, mapping = adder.add("ShaderNodeTexCoord"), adder.add("ShaderNodeMapping", Rotation=world.rotation)
    texture = adder.add("ShaderNodeTexEnvironment")
    texture.image, texture.interpolation = image, "Closest" if world.closest else "Linear"
    adder.link(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    adder.link(mapping.outputs[0], texture.inputs["Vector"])
    color = texture.outputs["Color"]
    if len(set(world.radiance)) == 1:
        background.inputs["Strength"].default_value = world.radiance[0]
    else:
        multiply = adder.add("ShaderNodeVectorMath", color)
        multiply.operation = "MULTIPLY"
        multiply.inputs[1].default_value = world.radiance
        color = multiply.outputs[0]
    adder.link(color, background.inputs["Color"])
