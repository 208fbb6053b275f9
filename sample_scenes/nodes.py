"""A short way to write nodes: groups of geometry nodes, and those of materials and worlds, with images made by formulas.

One call a node, sockets by name, and of a group a tidy layout at the end. Node groups are what keeps the sample scenes small:
thousands of objects are a rule of a dozen nodes, not thousands of meshes.
"""

import math

import bpy
import numpy as np
from building import color

COLUMN_WIDTH, ROW_HEIGHT = 220, 190  # the layout, in the node editor's units


class Nodes:
    """A geometry-node group being built. Every method that adds something returns the socket that later calls take."""

    def __init__(self, name: str):
        self.tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
        self.tree.is_modifier = True
        self.tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
        self.tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        self._group_input = self.tree.nodes.new("NodeGroupInput")
        self.geometry = self._group_input.outputs["Geometry"]

    def parameter(self, name: str, kind: str, default=None):
        """Add an input that each modifier sets for itself, such as ("Count", "Int", 100)."""
        socket = self.tree.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
        if default is not None:
            socket.default_value = default
        return self._group_input.outputs[name]

    def add(self, kind: str, inputs: dict | None = None, output: str | int = 0, **settings):
        """Add a node with its settings and inputs (values or sockets, by name or index) and return one output socket."""
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for name, value in (inputs or {}).items():
            self._connect(_available(node.inputs, name), value)
        return _available(node.outputs, output)

    def math(self, operation: str, *values):
        """A Math node on numbers or sockets."""
        return self.add("ShaderNodeMath", dict(enumerate(values)), operation=operation)

    def vector(self, x=0.0, y=0.0, z=0.0):
        """A Combine XYZ node on numbers or sockets."""
        return self.add("ShaderNodeCombineXYZ", {"X": x, "Y": y, "Z": z})

    def separate(self, vector):
        """The three components of a vector socket."""
        outputs = self.add("ShaderNodeSeparateXYZ", {"Vector": vector}).node.outputs
        return outputs["X"], outputs["Y"], outputs["Z"]

    def ramp(self, value, start: float, end: float, low: float = 0.0, high: float = 1.0):
        """A smooth step from `low` at `start` to `high` at `end`."""
        inputs = {"Value": value, "From Min": start, "From Max": end, "To Min": low, "To Max": high}
        return self.add("ShaderNodeMapRange", inputs, interpolation_type="SMOOTHSTEP")

    def random(self, low, high, seed: int, kind: str = "FLOAT"):
        """A random value for each element."""
        return self.add("FunctionNodeRandomValue", {"Min": low, "Max": high, "Seed": seed}, _VALUE, data_type=kind)

    def join(self, *geometries):
        """All geometries as one."""
        joined = self.add("GeometryNodeJoinGeometry")
        for geometry in reversed(geometries):  # a multi-input socket puts the newest link first
            self.tree.links.new(geometry, joined.node.inputs[0])
        return joined

    def finish(self, geometry):
        """Connect the result, lay the nodes out from left to right, and return the finished group."""
        group_output = self.tree.nodes.new("NodeGroupOutput")
        self.tree.links.new(geometry, group_output.inputs["Geometry"])
        self._arrange(group_output)
        return self.tree

    def _connect(self, socket, value) -> None:
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def _arrange(self, group_output) -> None:
        columns = {}
        unseen = [(group_output, 0)]
        while unseen:
            node, column = unseen.pop()
            if columns.get(node, -1) < column:
                columns[node] = column
                unseen += [(link.from_node, column + 1) for link in self.tree.links if link.to_node == node]
        rows = {}
        for node, column in columns.items():
            rows[column] = rows.get(column, 0) + 1
            node.location = (-COLUMN_WIDTH * column, -ROW_HEIGHT * rows[column])


_VALUE = "Value"


def _available(sockets, key: str | int):
    """The socket of that name or number, passing over those that the node's settings switch off."""
    usable = [socket for socket in sockets if socket.enabled]
    if isinstance(key, int):
        return usable[key]
    return next(socket for socket in usable if socket.name == key)


def use_nodes(obj, group, **parameters):
    """Give an object a geometry-nodes modifier with this group and these parameters."""
    modifier = obj.modifiers.new(group.name, "NODES")
    modifier.node_group = group
    identifiers = {item.name: item.identifier for item in group.interface.items_tree if item.in_out == "INPUT"}
    for name, value in parameters.items():
        modifier[identifiers[name.replace("_", " ").capitalize()]] = value
    return modifier


class Shading:
    """The nodes of a material or a world being built."""

    def __init__(self, tree):
        self.tree = tree

    def add(self, kind: str, inputs=None, output=None, **properties):
        """Add a shader node; returns the first output that is in use, or that of a name.

        kind : its class, without "ShaderNode".
        inputs : sockets, numbers, or colors as hex codes, by the input's identifier or name.
        """
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in properties.items():
            setattr(node, name, value)
        for name, value in (inputs or {}).items():
            socket = _socket(node.inputs, name)
            if socket is None:  # older versions lack some
                continue
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = color(value) if isinstance(value, str) else value
        return next(each for each in node.outputs if each.enabled) if output is None else _socket(node.outputs, output)

    def principled(self, **inputs):
        """A Principled BSDF; names with underscores for blanks."""
        return self.add("BsdfPrincipled", {_name(each): value for each, value in inputs.items()})

    def math(self, operation: str, *values):
        return self.add("Math", dict(zip(("Value", "Value_001", "Value_002"), values, strict=False)), operation=operation)

    def mix(self, factor, a, b, blend: str = "MIX"):
        """A mixture of colors."""
        return self.add("Mix", {"Factor_Float": factor, "A_Color": a, "B_Color": b}, data_type="RGBA", blend_type=blend)

    def mix_shaders(self, factor, first, second):
        return self.add("MixShader", {"Fac": factor, "Shader": first, "Shader_001": second})

    def ramp(self, factor, *stops, interpolation: str = "LINEAR"):
        """A Color Ramp of (position, hex code)."""
        socket = self.add("ValToRGB", {"Fac": factor})
        ramp = socket.node.color_ramp
        ramp.interpolation = interpolation
        while len(ramp.elements) < len(stops):
            ramp.elements.new(1.0)
        for element, (position, code) in zip(ramp.elements, stops, strict=True):
            element.position, element.color = position, color(code)
        return socket

    def range(self, value, low: float, high: float):
        """A number from 0 to 1, put between two others."""
        return self.add("MapRange", {"Value": value, "To Min": low, "To Max": high})

    def place(self, scale=(1.0, 1.0, 1.0), rotation=(0.0, 0.0, 0.0), coordinates: str = "Object"):
        """Texture coordinates, turned and scaled."""
        return self.add("Mapping", {"Vector": self.add("TexCoord", output=coordinates), "Scale": scale, "Rotation": rotation})

    def bump(self, height, strength: float = 0.5, distance: float = 0.02):
        return self.add("Bump", {"Height": height, "Strength": strength, "Distance": distance})


def _name(identifier: str) -> str:
    return identifier.replace("_", " ").replace("Ior", "IOR")


def _socket(sockets, name):
    return next((each for each in sockets if each.identifier == name), None) or sockets.get(name)


def material(name: str, build):
    """A material whose surface is what build(Shading) returns."""
    new_material = bpy.data.materials.new(name)
    shading, output = _shading(new_material, "ShaderNodeOutputMaterial")
    shading.tree.links.new(build(shading), output.inputs["Surface"])
    return new_material


def world(build):
    """The scene's world, whose surface is what build(Shading) returns."""
    new_world = bpy.data.worlds.new("World")
    shading, output = _shading(new_world, "ShaderNodeOutputWorld")
    shading.tree.links.new(build(shading), output.inputs["Surface"])
    # Cycles makes its map anew for each picture, by its own choice one of megapixels.
    new_world.cycles.sampling_method, new_world.cycles.sample_map_resolution = "MANUAL", 512
    bpy.context.scene.world = new_world
    return new_world


def environment(image, turn: float = 0.0, strength: float = 1.0):
    """A world of one equirectangular image, turned about the vertical by degrees."""

    def surround(s):
        place = s.place(rotation=(0.0, 0.0, math.radians(turn)), coordinates="Generated")
        return s.add("Background", {"Color": s.add("TexEnvironment", {"Vector": place}, image=image), "Strength": strength})

    return world(surround)


def _shading(owner, output: str):
    if not owner.node_tree:  # new ones have one from 5.0 on
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return Shading(owner.node_tree), owner.node_tree.nodes.new(output)


def picture(name: str, pixels: np.ndarray, is_data: bool = False, linear: bool = False):
    """A packed image.

    pixels : (height, width, 3 or 4), rows from the bottom.
    linear : floats, else bytes.
    """
    height, width, channels = pixels.shape
    image = bpy.data.images.new(name, width, height, alpha=channels == 4, float_buffer=linear, is_data=is_data or linear)
    if channels == 3:
        pixels = np.concatenate([pixels, np.ones((height, width, 1))], axis=2)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.update()
    image.pack()
    return image


def _grid(width: int, height: int):
    return np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)


def outdoors(sun: float = 400.0, elevation: float = 35.0, bearing: float = 0.3, width: float = 2.5):
    """An HDRI: a sky with a sun that fades at its edge, clouds and brown earth.

    sun : its radiance.
    bearing : the sun's place, as a share of the picture's width.
    width : the sun's, in degrees.
    """
    u, v = _grid(256, 128)
    height, around = (v - 0.5) * np.pi, (u - bearing) * 2 * np.pi
    sky = np.exp(-3 * np.clip(np.sin(height), 0, 1))[..., None]
    radiance = sky * (1.0, 0.85, 0.7) + (1 - sky) * (0.18, 0.35, 0.8)
    clouds = np.clip(np.sin(9 * u * np.pi) * np.sin(23 * v + 4 * np.sin(6 * np.pi * u)), 0, 1)[..., None]
    radiance = radiance + clouds * (height > 0.1)[..., None] * 0.9
    radiance = np.where((height < 0)[..., None], (0.12, 0.1, 0.08), radiance)
    cosine = np.sin(height) * np.sin(np.radians(elevation))
    cosine += np.cos(height) * np.cos(np.radians(elevation)) * np.cos(around)
    disc = np.clip(1.5 - np.degrees(np.arccos(np.clip(cosine, -1, 1))) / width, 0, 1)[..., None]
    return picture("Outdoors", radiance + disc * sun * np.array((1.0, 0.9, 0.75)), linear=True)


def studio_lights():
    """An HDRI: a dark room with three softboxes of different warmth."""
    u, v = _grid(128, 64)
    radiance = np.repeat((0.05 + 0.15 * v)[..., None], 3, axis=2)
    for left, right, low, high, light in (
        (0.1, 0.25, 0.55, 0.85, (14.0, 12.0, 10.0)),
        (0.55, 0.62, 0.4, 0.9, (6.0, 8.0, 11.0)),
        (0.75, 0.95, 0.8, 0.95, (5.0, 5.0, 5.0)),
    ):
        radiance[(u > left) & (u < right) & (v > low) & (v < high)] = light
    return picture("Studio lights", radiance, linear=True)


def label():
    """A label: rings and stripes on cream, in bytes."""
    u, v = _grid(64, 64)
    rings = (np.hypot(u - 0.5, v - 0.5) * 14).astype(int) % 2 == 0
    stripes = (v * 16).astype(int) % 4 == 0
    pixels = np.where(rings[..., None], (0.75, 0.2, 0.15), (0.93, 0.88, 0.75))
    return picture("Label", np.where(stripes[..., None], (0.1, 0.25, 0.4), pixels))


def leaf():
    """A leaf with an alpha: green with veins, cut out softly."""
    u, v = _grid(64, 64)
    inside = np.clip(12 * (0.42 * np.sin(np.pi * v) - np.abs(u - 0.5)), 0, 1)
    veins = (np.abs(u - 0.5) < 0.02) | (np.abs((v * 10 + 6 * np.abs(u - 0.5)) % 1.0) < 0.12)
    pixels = np.where(veins[..., None], (0.45, 0.6, 0.25), (0.16, 0.42, 0.12))
    return picture("Leaf", np.dstack([pixels, inside]))


def normals(waves: int = 6, steep: float = 0.4):
    """A normal map of crossing waves, tangent space."""
    u, v = _grid(64, 64)
    x, y = (steep * np.cos(2 * np.pi * waves * each) for each in (u, v))
    normal = np.dstack([x, y, np.ones_like(x)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return picture("Normals", normal / 2 + 0.5, is_data=True)
