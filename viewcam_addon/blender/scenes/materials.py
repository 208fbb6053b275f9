"""The materials that change where a surface is or what its passes say, and the plain one that stands in for them in Cycles.

Level geometry models no material. Most leave the passes of geometry alone; some do not: displacement moves the surface, bump
and normal maps turn the Normal pass, and where a surface is transparent Cycles writes what lies behind. For the time of a
comparison such a material gets a second output for Cycles, a diffuse surface of its viewport color; its own nodes stay as
they are. So does one with subsurface scattering, for which Cycles only computes in another order; the ledger is silent. At
the levels of light the same is done to every material that the tracer only approximates, with the components that
shaders.py has found.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import bpy

from ...errors import InputError
from ...tracer.scene.materials import PLAIN, Color
from ...tracer.scene.shader_nodes import KINDS, SHADERS, Node, word_of
from ...tracer.scene.shader_nodes import node as _node
from ...tracer.scene.value_nodes import GENERATED, OWN, POSITION, UV
from ...tracer.scene.value_nodes import KINDS as VALUE_NODES
from .. import versions
from ..temporary_settings import Overrides
from . import images, nodes, shaders, value_nodes

# Node types that let something else than the surface's own geometry into the passes.
_TRANSPARENT = {"BSDF_TRANSPARENT", "HOLDOUT"}
_TURNING = {"BUMP", "NORMAL_MAP", "BEVEL"}
_UNKNOWN = {"SCRIPT"}
_WHITE = (1.0, 1.0, 1.0)


def departures(material: bpy.types.Material, lit: bool = False) -> list[str]:
    """The reasons that this material's surface is not what level geometry models, one clause each; empty for most materials.

    lit : or what the levels of light do, beside what shaders.py says.
    """
    tree = versions.node_tree(material)
    if tree is None:
        return []
    output = tree.get_output_node("CYCLES")
    if output is None:
        return ["has no output, so that Cycles draws nothing"]
    reasons = []
    if _is_fed(output, "Displacement") and not (lit and shaders.is_only_bumped(material)):
        reasons.append("is displaced")
    if _is_fed(output, "Volume"):
        reasons.append("has a volume")
    all_nodes = list(nodes.all_of(tree))
    if not lit and any(node.type in _TRANSPARENT or _sees_through(node) for node in all_nodes):
        reasons.append("is transparent")
    if not lit and any(node.type in _TURNING or _is_turned(node) for node in all_nodes):
        reasons.append("turns the normals")
    if any(node.type in _UNKNOWN for node in all_nodes):
        reasons.append("runs a script")
    if not _is_fed(output, "Surface"):
        reasons.append("has no surface")
    return reasons


def is_volume_alone(material: bpy.types.Material | None) -> bool:
    """True if a material fills what it covers with a volume and has no surface, as fog in a box."""
    tree = material and versions.node_tree(material)
    output = tree.get_output_node("CYCLES") if tree else None
    return output is not None and _is_fed(output, "Volume") and not _is_fed(output, "Surface")


def _is_fed(output: bpy.types.Node, name: str) -> bool:
    """True if a node feeds an input of a material's output."""
    return isinstance(nodes.source(nodes.Input(output.inputs[name])), nodes.Output)


def make_transparent(overrides: Overrides, material: bpy.types.Material) -> None:
    """Let Cycles see nothing where the material is until the overrides end."""
    output, adder = nodes.override_output(overrides, material.node_tree, "ShaderNodeOutputMaterial")
    adder.link(adder.add("ShaderNodeBsdfTransparent", Color=(1.0, 1.0, 1.0, 1.0)).outputs[0], output.inputs["Surface"])
    overrides.set(material, "use_transparent_shadow", True)


def make_plain(overrides: Overrides, material: bpy.types.Material) -> None:
    """Let Cycles see a diffuse surface of the viewport color until the overrides end."""
    stand_in(overrides, material, shaders.in_the_viewport(material))


def stand_in(overrides: Overrides, material: bpy.types.Material, reading: shaders.Reading) -> None:
    """Let Cycles see a tracer's material until the overrides end."""
    tables = {key: images.image_of(picture, key, overrides) for key, picture in reading.tables.items()}
    reading = replace(reading, images=reading.images | tables, texts=_texts_of(reading.material.nodes, overrides))
    output, adder = nodes.override_output(overrides, material.node_tree, "ShaderNodeOutputMaterial")
    _add_surface(adder, output, reading)


def _texts_of(shader_nodes: Iterable[Node], overrides: Overrides) -> dict[str, bpy.types.Text]:
    """The texts that nodes ask for, in Blender, until the overrides end."""
    result = {}
    for text in dict.fromkeys(node["text"] for node in shader_nodes if "text" in KINDS[node.type].inputs):
        result[text] = bpy.data.texts.new("IES")
        result[text].write(text)
        overrides.afterwards(bpy.data.batch_remove, [result[text]])
    return result


def _add_surface(adder: nodes.Adder, output: bpy.types.Node, reading: shaders.Reading) -> None:
    """Add the nodes that shaders.read would read so, and link them to a material's output."""
    material = reading.material
    if material.displacement is not None:
        raised = adder.add("ShaderNodeDisplacement", Midlevel=0.0, Scale=1.0)
        raised.space = "WORLD"
        _color(adder, raised.inputs["Height"], material.displacement, reading)
        adder.link(raised.outputs[0], output.inputs["Displacement"])
    # Without any light Cycles would draw nothing: not even the depth.
    surface = material.surface or _node("diffuse", color=Color((0.0, 0.0, 0.0)))
    adder.link(_shader(adder, surface, reading).outputs[0], output.inputs["Surface"])


def _shader(adder: nodes.Adder, node: Node, reading: shaders.Reading) -> bpy.types.Node:
    """Add the nodes that a tree of shader nodes is."""
    shader = SHADERS[node.type]
    added = adder.add(shader.class_name)
    for name, theirs in shader.words.items():
        setattr(added, theirs, word_of(node[name]))
    for name, place in shader.inputs.items():
        value = node[name]
        if isinstance(value, Node) and not value.is_value:
            adder.link(_shader(adder, value, reading).outputs[0], added.inputs[place])
        elif value is not None and (isinstance(place, int) or place in added.inputs):
            _color(adder, added.inputs[place], value, reading)
    return added


def _value(adder: nodes.Adder, node: Node, reading: shaders.Reading) -> bpy.types.NodeSocket:
    """The output of nodes that make a value; those are one that differ by their output alone."""
    word = dict(node.inputs).get("output", node["output"] if "output" in KINDS[node.type].inputs else None)
    rows = VALUE_NODES[node.type].blender
    row = next((each for each in rows if word in each.outputs.values()), rows[0])
    key = node.type, row.class_name, tuple(each for each in node.inputs if each[0] != "output")
    added = adder.values.get(key)
    if added is None:
        added = adder.values[key] = adder.add(row.class_name)
        for name, wanted in row.fixed.items():
            setattr(added, name, wanted)
        for name, theirs in row.words.items():
            choices: Any = KINDS[node.type].inputs[name]
            if node[name] == choices[0] and not hasattr(added, theirs):
                continue  # the only choice of an older version
            _choose(added, theirs, row.word(node[name]))
        for name, theirs in row.flags.items():
            setattr(added, theirs, node[name])
        for name, theirs in row.names.items():
            setattr(added, theirs, "" if node[name] == row.unnamed else node[name])
        for name, theirs in row.numbers.items():
            setattr(added, theirs, type(getattr(added, theirs))(node[name][0]))
        if "image" in KINDS[node.type].inputs and node["image"] is not None:
            added.image = reading.images[node["image"].image]
        if "text" in KINDS[node.type].inputs:
            added.mode, added.ies = "INTERNAL", reading.texts[node["text"]]
        if "table" in KINDS[node.type].inputs:
            table, ends = reading.images[node["table"].image], (node["least"][0], node["most"][0])
            value_nodes.draw_curves(added.mapping, table, *ends, node["extrapolate"])
        for name, theirs in row.inputs.items():
            socket = value_nodes.input_of(added, theirs)
            if socket is None:
                _want_as_before(added, theirs, node[name], row.before[name](versions.CYCLES))
            elif KINDS[node.type].inputs[name] not in (UV, GENERATED, POSITION, *OWN) or name in dict(node.inputs):
                _color(adder, socket, node[name], reading)
    sockets = [socket for socket in added.outputs if row.outputs.get(socket.identifier, "") == word]
    return next((socket for socket in sockets if socket.enabled), sockets[0])


def _choose(node: bpy.types.Node, name: str, word: str) -> None:
    try:
        setattr(node, name, word)
    except (AttributeError, TypeError) as error:  # vectors' powers came with 4.3, DirectX's green with 5.2
        raise InputError(f"this Blender has no {node.bl_label} that is {word}: open the scene in a newer one") from error


def _want_as_before(node: bpy.types.Node, name: str, value: object, before: float) -> None:
    if value != (before,) * 3:
        raise InputError(f"this Blender has no {node.bl_label} with a {name} but {before:g}: open the scene in a newer one")


def _color(
    adder: nodes.Adder, socket: bpy.types.NodeSocket, color: Color | Node | tuple[float, ...], reading: shaders.Reading
) -> None:
    """The color of an input: a value, or the product that a color is."""
    if isinstance(color, Node):
        adder.link(_value(adder, color, reading), socket)
        return
    if isinstance(color, tuple):
        socket.default_value = {"VALUE": color[0], "VECTOR": color}.get(socket.type, (*color, 1.0))
        return
    if color.image is None and not color.vertex:
        values = {"VALUE": color.rgb[0], "VECTOR": color.rgb}
        socket.default_value = values.get(socket.type, (*color.rgb, 1.0))
        return
    factors = []
    if color.image is not None:
        texture = adder.add("ShaderNodeTexImage")
        texture.image = reading.images[color.image]
        texture.interpolation = "Closest" if color.closest else "Linear"
        factors.append(texture.outputs["Color"])
    if color.vertex:
        factors.append(adder.add("ShaderNodeVertexColor").outputs["Color"])
    product = factors[0]
    for other in factors[1:]:
        product = _times(adder, product, other).outputs[0]
    if color.rgb != _WHITE:
        multiply = _times(adder, product)
        multiply.inputs[1].default_value = color.rgb
        product = multiply.outputs[0]
    adder.link(product, socket)


def _times(adder: nodes.Adder, *factors: bpy.types.NodeSocket) -> bpy.types.Node:
    multiply = adder.add("ShaderNodeVectorMath", *factors)
    multiply.operation = "MULTIPLY"
    return multiply


def keep_normals(overrides: Overrides, material: bpy.types.Material) -> None:
    """Keep Cycles from bending the normals of smooth surfaces, seen at a grazing angle, so far that they reflect.

    And from interpolating them before the object's scale has turned them, which it does in a mesh that only one object uses
    if light scatters below its surface (ObjectManager::apply_static_transforms of intern/cycles/scene/object.cpp).
    """
    overrides.set(material.cycles, "use_bump_map_correction", False)
    tree = versions.node_tree(material)
    if tree and any(map(_scatters_below, nodes.all_of(tree))) and not departures(material):
        make_plain(overrides, material)


def fill_empty_slots(overrides: Overrides, block: bpy.types.Object) -> None:
    """Give an object a material where it has none, until the overrides end: Cycles' own default bends normals."""
    material = overrides.shared(plain)  # to remove a material, Blender looks at all that could use it
    if not block.material_slots:
        overrides.afterwards(block.data.materials.clear)  # pop would leave a slot behind on the object
        block.data.materials.append(material)
    for number, slot in enumerate(block.material_slots):
        stays_empty = versions.EMPTY_SLOTS_OF_OBJECTS_STAY_EMPTY or block.data.materials[number] is None
        if slot.material is None and stays_empty:
            overrides.set(slot, "material", material)


def fill_what_nodes_make(overrides: Overrides, block: bpy.types.Object) -> None:
    """Give what the geometry nodes of an object make a material where it has none, by a modifier until the overrides end."""
    tree = overrides.shared(_nodes_that_fill)
    modifier = block.modifiers.new(tree.name, "NODES")
    overrides.afterwards(block.modifiers.remove, modifier)
    modifier.show_viewport, modifier.node_group = False, tree


def _nodes_that_fill(overrides: Overrides) -> bpy.types.NodeTree:
    tree = bpy.data.node_groups.new("Virtual Pinhole", "GeometryNodeTree")
    overrides.afterwards(bpy.data.node_groups.remove, tree)
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    geometry = tree.nodes.new("NodeGroupInput").outputs[0]
    for _ in range(2):  # the first gives an empty slot to meshes that have none
        fill = tree.nodes.new("GeometryNodeSetMaterial")
        fill.inputs["Material"].default_value = overrides.shared(plain)
        tree.links.new(tree.nodes.new("GeometryNodeMaterialSelection").outputs[0], fill.inputs["Selection"])
        tree.links.new(geometry, fill.inputs[0])
        geometry = fill.outputs[0]
    tree.links.new(geometry, tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


def plain(overrides: Overrides) -> bpy.types.Material:
    """The tracer's own plain material, which leaves all passes of geometry alone, gone when the overrides end."""
    material = bpy.data.materials.new("Virtual Pinhole")
    overrides.afterwards(bpy.data.materials.remove, material)
    material.cycles.use_bump_map_correction = False
    if not material.node_tree:  # from 5.0 on new materials have one
        material.use_nodes = True
    stand_in(overrides, material, shaders.Reading(PLAIN))
    return material


def _sees_through(node: bpy.types.Node) -> bool:
    """True if the node has an opacity that is not plainly 1."""
    alpha = node.inputs.get("Alpha") if node.type == "BSDF_PRINCIPLED" else None
    return alpha is not None and (alpha.is_linked or alpha.default_value != 1.0)


def _scatters_below(node: bpy.types.Node) -> bool:
    """True if Cycles takes the node for one that lets light scatter below the surface."""
    weight = node.inputs.get("Subsurface Weight") if node.type == "BSDF_PRINCIPLED" else None
    return node.type == "SUBSURFACE_SCATTERING" or (weight is not None and (weight.is_linked or weight.default_value > 0.0))


def _is_turned(node: bpy.types.Node) -> bool:
    """True if a shader takes its normal from another node."""
    is_shader = any(output.type == "SHADER" for output in node.outputs)
    return is_shader and any("Normal" in socket.name and socket.is_linked for socket in node.inputs)
