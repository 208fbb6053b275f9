"""A short way to write geometry-node groups: one call a node, sockets by name, and a tidy layout at the end.

Node groups are what keeps the sample scenes small: thousands of objects are a rule of a dozen nodes, not thousands of meshes.
"""

import bpy

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
