"""The tracer's materials, lamps, world, film and bounces as Blender's, as shaders.py, lamps.py, world.py and film.py read them.

What Blender's numbers can't hold is read back and told. A light's colour is what it shines with over the largest of red, green
and blue, which is its energy.
"""

import bpy
import numpy as np

from ...tracer.scene import Scene
from ...tracer.scene.film import Bounces, Film
from ...tracer.scene.lamps import RAYS, Lamp, World
from ...tracer.scene.materials import PLAIN, Material, Picture
from ...tracer.scene.shader_nodes import Node
from ..temporary_settings import LARGEST_INDEX, Overrides
from . import film, images, import_geometry, lamps, materials, nodes, shaders
from .ledger import Ledger

_COLUMN = 260.0  # between nodes, in the node editor's units


def has_light(scene: Scene) -> bool:
    """True if a scene says anything beyond geometry."""
    return bool(scene.materials or scene.lamps) or (scene.world, scene.film, scene.bounces) != (World(), Film(), Bounces())


class Paints:
    """Makes the Blender materials of a scene, each once."""

    def __init__(self, scene: Scene, overrides: Overrides, ledger: Ledger) -> None:
        self._scene, self._overrides, self._ledger = scene, overrides, ledger
        self._made: dict[tuple[str, int], bpy.types.Material] = {}
        self._images: dict[str, bpy.types.Image] = {}

    def material(self, name: str, index: int) -> bpy.types.Material:
        """The material of this name and pass index; without a name the plain one, where Blender's own is another since 5.0."""
        if (name, index) not in self._made:
            self._made[name, index] = self._new(name, index)
        return self._made[name, index]

    def _new(self, name: str, index: int) -> bpy.types.Material:
        material = bpy.data.materials.new(name or f"Index {index}")
        self._overrides.afterwards(bpy.data.batch_remove, [material])
        material.pass_index = min(index, LARGEST_INDEX)
        if index > LARGEST_INDEX:
            self._ledger.note(material.name, "approximated", f"its index is {index}, and Blender's end at {LARGEST_INDEX}")
        made = self._scene.materials[name] if name else PLAIN
        texts = materials.texts_of(made.nodes, self._overrides)
        paint(material, made, {key: self.image(key) for key in _images_of(made)}, texts)
        return material

    def light(self, lamp: Lamp) -> tuple[bpy.types.Light, np.ndarray]:
        """The light, and the (4, 4) matrix that it stands by, with the nodes of its emission."""
        data, matrix = lamps.light_from(lamp, self._overrides, self._ledger)
        if lamp.emission is not None:
            shown = {colour.image: self.image(colour.image) for colour in lamp.emission.colours if colour.image is not None}
            light_up(data, lamp.emission, shown, materials.texts_of(lamp.emission.all, self._overrides))
        return data, matrix

    def image(self, key: str) -> bpy.types.Image:
        if key not in self._images:
            self._images[key] = image_from(self._scene.images[key], key, self._overrides, self._ledger)
        return self._images[key]


def _images_of(made: Material) -> list[str]:
    return [colour.image for _, colour in made.inputs if colour.image is not None]


def light_up(
    data: bpy.types.Light, emission: Node, shown: dict[str, bpy.types.Image], texts: dict[str, bpy.types.Text]
) -> None:
    """Give a new light the nodes of a lamp's emission. shown, texts : as in `paint`."""
    if not data.node_tree:
        data.use_nodes = True
    data.node_tree.nodes.clear()
    adder = nodes.Adder(data.node_tree)
    output = adder.add("ShaderNodeOutputLight")
    materials.add_emission(adder, output, emission, shaders.Reading(images=shown, texts=texts))
    _arrange(output, 0, {})


def paint(
    material: bpy.types.Material,
    made: Material,
    shown: dict[str, bpy.types.Image],
    texts: dict[str, bpy.types.Text] | None = None,
) -> None:
    """Give a new material the nodes of the tracer's. shown : `Colour.image` → the image. texts : those of IES files."""
    if not material.node_tree:  # from 5.0 on new materials have one
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    material.use_transparent_shadow = made.transparent_shadow
    adder = nodes.Adder(tree)
    output = adder.add("ShaderNodeOutputMaterial")
    materials.add_surface(adder, output, shaders.Reading(made, shown, texts=texts or {}, renamed=import_geometry.RENAMED))
    _arrange(output, 0, {})
    colour = next((colour for _, colour in made.inputs), None)
    if colour:
        material.diffuse_color = (*np.clip(colour.rgb, 0.0, 1.0), 1.0)


def _arrange(node: bpy.types.Node, column: int, taken: dict[int, int]) -> None:
    """Lay out a node and all that feeds it from right to left, each below those that stand in its column already."""
    row = taken[column] = taken.get(column, 0) + 1
    node.location = (-_COLUMN * column, _COLUMN * (1 - row))
    for socket in node.inputs:
        for link in socket.links:
            _arrange(link.from_node, column + 1, taken)


def image_from(picture: Picture, name: str, overrides: Overrides, ledger: Ledger) -> bpy.types.Image:
    """A packed image with these pixels."""
    if picture.srgb and np.abs(picture.values - np.rint(picture.values * 255) / 255).max() > 2.0**-20:
        ledger.note(name, "approximated", "its sRGB pixels are rounded to the 256 levels that Blender keeps")
    return images.image_of(picture, name, overrides)


def add_world(adder: nodes.Adder, output: bpy.types.Node, made: World, shown: dict[str, bpy.types.Image]) -> None:
    """Let a world's output show what lights and, where that is another world, what the camera sees.

    shown : `World.image` → the image.
    """
    backgrounds = []
    for each in filter(None, (made, made.backdrop)):
        background = adder.add("ShaderNodeBackground", Color=(*each.radiance, 1.0), Strength=1.0)
        if each.image is not None:
            background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
            _add_environment(adder, background, each, shown[each.image])
        backgrounds.append(background.outputs[0])
    surface = backgrounds[0]
    if made.backdrop:
        is_camera = adder.add("ShaderNodeLightPath").outputs["Is Camera Ray"]
        surface = adder.add("ShaderNodeMixShader", is_camera, *backgrounds).outputs[0]
    adder.link(surface, output.inputs["Surface"])


def _add_environment(adder: nodes.Adder, background: bpy.types.Node, made: World, image: bpy.types.Image) -> None:
    """Let a Background node show an image that is wrapped around the world."""
    coordinates, mapping = adder.add("ShaderNodeTexCoord"), adder.add("ShaderNodeMapping", Rotation=made.rotation)
    texture = adder.add("ShaderNodeTexEnvironment")
    texture.image, texture.interpolation = image, "Closest" if made.closest else "Linear"
    adder.link(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    adder.link(mapping.outputs[0], texture.inputs["Vector"])
    color = texture.outputs["Color"]
    if len(set(made.radiance)) == 1:
        background.inputs["Strength"].default_value = made.radiance[0]
    else:
        multiply = adder.add("ShaderNodeVectorMath", color)
        multiply.operation = "MULTIPLY"
        multiply.inputs[1].default_value = made.radiance
        color = multiply.outputs[0]
    adder.link(color, background.inputs["Color"])


def hide(block: bpy.types.Object, hidden_from: frozenset[str]) -> None:
    """Let these kinds of rays pass by an object, and all others see it."""
    for ray in RAYS:
        setattr(block, f"visible_{ray}", ray not in hidden_from)


def set_surroundings(scene: bpy.types.Scene, made: Scene, name: str, overrides: Overrides, ledger: Ledger) -> None:
    """Give a scene the file's world, film and bounces. name : of the new world."""
    world = bpy.data.worlds.new(name)
    overrides.afterwards(bpy.data.batch_remove, [world])
    if not world.node_tree:
        world.use_nodes = True
    world.node_tree.nodes.clear()
    adder = nodes.Adder(world.node_tree)
    output = adder.add("ShaderNodeOutputWorld")
    shown = {key: image_from(made.images[key], key, overrides, ledger) for key in dict.fromkeys(made.world.images)}
    add_world(adder, output, made.world, shown)
    _arrange(output, 0, {})
    overrides.set(scene, "world", world)
    overrides.set(scene.render, "film_transparent", made.film.transparent)
    if not hasattr(scene, "cycles"):
        ledger.note(scene.name, "skipped", "film and bounces are Cycles' settings, and Cycles is disabled")
        return
    for ray in RAYS[:-1]:
        setattr(world.cycles_visibility, ray, ray not in made.world.hidden_from)
    numbers = {"filter_width": made.film.filter_width, "film_exposure": made.film.exposure}
    numbers |= {theirs: getattr(made.bounces, ours) for ours, theirs in film.BOUNCES.items()}
    for name, value in numbers.items():
        overrides.afterwards(setattr, scene.cycles, name, getattr(scene.cycles, name))
        ledger.store(scene.cycles, name, value, scene.name)
    overrides.set(scene.cycles, "pixel_filter_type", made.film.filter)
    for name in film.CAUSTICS:
        overrides.set(scene.cycles, name, True)
