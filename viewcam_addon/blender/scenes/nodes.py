"""Reading shader nodes, and giving a tree another output for a while.

An input is followed to the node that feeds it: reroutes, muted nodes, node groups and what a menu chooses are looked through.
What nothing feeds has a value of its own, and so has what a link feeds that counts for nothing: those that Blender marks as
invalid, as where links go in a circle or from a shader to a color, and those from nodes that only EEVEE has, or that are muted
and pass nothing on.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import bpy

from .. import versions
from ..temporary_settings import Overrides
from .ledger import Ledger

_UNKNOWN_TO_CYCLES = ("SHADERTORGB", "EEVEE_SPECULAR")


class Input(NamedTuple):
    """An input of a node.

    groups : the group nodes that it stands in, the outermost first.
    is_zero : true if 0 is its value, whatever it shows.
    """

    socket: bpy.types.NodeSocket
    groups: tuple[bpy.types.Node, ...] = ()
    is_zero: bool = False


class Output(NamedTuple):
    """An output of a node, with the groups that it stands in."""

    node: bpy.types.Node
    socket: bpy.types.NodeSocket
    groups: tuple[bpy.types.Node, ...]

    def input(self, name: str | int) -> Input | None:
        """An input of this output's node by its name or number, or None where it has no such input."""
        if isinstance(name, str) and name not in self.node.inputs:
            return None
        return self.required(name)

    def required(self, name: str | int) -> Input:
        """An input that every node of this kind has."""
        return Input(self.node.inputs[name], self.groups)


def source(node_input: Input) -> Output | Input:
    """The output that feeds an input, or the input, perhaps of a group around it, that nothing feeds.

    What a muted node or a reroute passes on of its own is no value in Cycles: the input keeps its own, or is 0.
    """
    kept = node_input
    while True:
        links = node_input.socket.links if node_input.socket.is_linked else ()
        link = next((link for link in links if _counts(link)), None)
        if link is None:
            return kept if node_input is kept or versions.MUTED_NODES_HAVE_NO_VALUES else node_input._replace(is_zero=True)
        node, socket = link.from_node, link.from_socket
        through = _through(node, socket, node_input.groups)
        if through is None:
            return Output(node, socket, node_input.groups)
        is_passed_on = node.type == "REROUTE" or node.mute
        node_input, kept = through, kept if is_passed_on else through


def is_left_alone(node_input: Input) -> bool:
    """True if nothing is given to an input, so that Cycles takes for it what surfaces have of themselves, if anything."""
    end = source(node_input)
    return isinstance(end, Input) and (end.socket == node_input.socket or not versions.GROUPS_GIVE_ALL_VALUES)


def _counts(link: bpy.types.NodeLink) -> bool:
    """True if Cycles has a link, too."""
    is_one = link.is_valid and not link.is_muted and link.from_node.type not in _UNKNOWN_TO_CYCLES
    return is_one and not (link.from_node.mute and _passed_on(link.from_node, link.from_socket) is None)


def _passed_on(node: bpy.types.Node, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The input that a muted node shows at an output, or None where it has none of its type."""
    return next((inner.from_socket for inner in node.internal_links if inner.to_socket == socket), None)


def _through(node: bpy.types.Node, socket: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...]) -> Input | None:
    """The socket at which the search goes on behind an output, or None where it ends."""
    if node.type == "REROUTE":
        return Input(node.inputs[0], groups)
    if node.mute:
        inner = _passed_on(node, socket)
        return inner and Input(inner, groups)
    if node.type == "GROUP" and node.node_tree:
        ends = [each for each in node.node_tree.nodes if each.type == "GROUP_OUTPUT"]
        end = next((each for each in ends if each.is_active_output), None)
        return end and _by_identifier(end, socket, (*groups, node))
    if node.type == "GROUP_INPUT" and groups:
        return _by_identifier(groups[-1], socket, groups[:-1])
    if node.type == "MENU_SWITCH" and socket == node.outputs[0]:
        menu = source(Input(node.inputs[0], groups))
        chosen = None if isinstance(menu, Output) else menu.socket.default_value
        return next((Input(each, groups) for each in node.inputs[1:] if each.name == chosen), None)
    return None


def _by_identifier(node: bpy.types.Node, socket: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...]) -> Input | None:
    inner = next((each for each in node.inputs if each.identifier == socket.identifier), None)
    return inner and Input(inner, groups)


def feeding(node_input: Input, inputs_of: Callable[[Output], Iterable[Input]] | None = None) -> set[Output]:
    """All outputs that an input is made of.

    inputs_of : a function that says which inputs an output is made of; all of its node's where None.
    """
    result: set[Output] = set()
    left = [node_input]
    while left:
        output = source(left.pop())
        if isinstance(output, Output) and output not in result:
            result.add(output)
            left += inputs_of(output) if inputs_of else (Input(socket, output.groups) for socket in output.node.inputs)
    return result


def all_of(tree: bpy.types.NodeTree, seen: set[bpy.types.NodeTree] | None = None) -> Iterator[bpy.types.Node]:
    """All nodes of the tree and of the groups in it that are not muted; whether they lead to the output is not asked.

    seen : trees that are left out.
    """
    seen = set() if seen is None else seen
    seen.add(tree)
    for node in tree.nodes:
        if node.mute:
            continue
        yield node
        group = getattr(node, "node_tree", None)
        if group and group not in seen:
            yield from all_of(group, seen)


def circular_links(tree: bpy.types.NodeTree) -> list[bpy.types.NodeLink]:
    """The links that Blender marks as invalid since they go in a circle, of sockets that are in use."""
    trees = {node.id_data for node in all_of(tree)}
    links = [link for each in trees for link in each.links if not link.is_valid and not link.is_muted]
    return [
        link
        for link in links
        if link.from_socket.enabled
        and link.to_socket.enabled
        and (link.from_socket.type == "SHADER") == (link.to_socket.type == "SHADER")
    ]


def leave_out_circles(tree: bpy.types.NodeTree | None, ledger: Ledger, name: str, whose: str) -> None:
    """Note for the object of this name that links of a tree go in a circle, and take them out of Cycles' render.

    whose : the beginning of the clause that says so.
    """
    if versions.CIRCLES_ARE_BLACK and tree and circular_links(tree):
        ledger.note(name, "approximated", f"{whose} links that go in a circle, which are left out on both sides")
        ledger.call_for_cycles(tree.original, cut_circles)


def cut_circles(overrides: Overrides, tree: bpy.types.NodeTree) -> None:
    """Take links that go in a circle out of a tree until the overrides end: muting them changes nothing."""
    for link in circular_links(tree):
        owner, ends = link.id_data, (link.from_socket, link.to_socket)
        owner.links.remove(link)
        overrides.afterwards(owner.links.new, *ends)


def override_output(overrides: Overrides, tree: bpy.types.NodeTree, kind: str) -> tuple[bpy.types.Node, "Adder"]:
    """Let Cycles see another output of a tree until the overrides end.

    kind : the output's class, "ShaderNodeOutputMaterial", … Returns it, and what adds nodes that go with it.
    """
    nodes = tree.nodes
    active = nodes.active
    before = [(node, node.is_active_output) for node in nodes if node.bl_idname == kind]
    adder = Adder(tree)

    def undo() -> None:
        adder.remove()
        for node, was_active in before:
            node.is_active_output = was_active
        nodes.active = active

    overrides.afterwards(undo)
    output = adder.add(kind)
    output.target = "CYCLES"
    for node, _ in before:
        node.is_active_output = False
    output.is_active_output = True
    return output, adder


class Adder:
    """Adds nodes to a tree, and takes them out again."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        self._tree = tree
        self._added: list[bpy.types.Node] = []
        # The nodes that make values, by what they are, of which one of each will do.
        self.values: dict[object, bpy.types.Node] = {}

    def add(self, kind: str, *linked: bpy.types.NodeSocket, **values: object) -> bpy.types.Node:
        """A node of this class.

        linked : the outputs to link to its first inputs.
        values : the values of its inputs, by name.
        """
        node = self._tree.nodes.new(kind)
        self._added.append(node)
        for number, socket in enumerate(linked):
            self._tree.links.new(socket, node.inputs[number])
        for name, value in values.items():
            node.inputs[name].default_value = value
        return node

    def link(self, output: bpy.types.NodeSocket, socket: bpy.types.NodeSocket) -> None:
        self._tree.links.new(output, socket)

    def remove(self) -> None:
        for node in self._added:
            self._tree.nodes.remove(node)
