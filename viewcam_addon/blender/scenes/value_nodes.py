"""Blender's nodes that make values, read by their table (tracer/scene/value_nodes.py), and the curves and texts of some."""

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...tracer.scene.value_nodes import KINDS, BlenderNode
from .nodes import Output

_NODES = tuple((ours, node) for ours, kind in KINDS.items() for node in kind.blender)


def row_of(output: Output) -> tuple[str, BlenderNode] | None:
    """Our name of an output's node and what it is in the table, or None where it is not modeled."""
    for ours, row in _NODES:
        is_it = row.kind == output.node.type and output.socket.identifier in row.outputs
        if is_it and all(getattr(output.node, name) == wanted for name, wanted in row.fixed.items()):
            return ours, row
    return None


def given_words(output: Output, ours: str, row: BlenderNode) -> dict[str, object] | str:
    """The words and flags of a node; or, where one is not modeled, that clause."""
    words: dict[str, object] = {name: bool(getattr(output.node, theirs)) for name, theirs in row.flags.items()}
    words |= {name: getattr(output.node, theirs) or row.unnamed for name, theirs in row.names.items()}
    words |= {name: (float(getattr(output.node, theirs)),) * 3 for name, theirs in row.numbers.items()}
    for name, theirs in row.words.items():
        word = getattr(output.node, theirs, None)
        if word is None:  # an older version, in which it is what is the default here
            continue
        if name == "interpolation" and word == "Smart":
            word = "Cubic"
        choices: Any = KINDS[ours].inputs[name]
        known = next((each for each in choices if row.word(each) == word), None)
        if known is None:
            return f"has the {name} {word.lower()}"
        words[name] = known
    word = row.outputs[output.socket.identifier]
    return words if word is None else words | {"output": word}


_TABLE = 256  # Cycles looks curves up in a table of one more


def curve_table(mapping: bpy.types.CurveMapping) -> tuple[np.ndarray, float, float]:
    """The table that Cycles makes of curves, (1, 257, 3) float32, and where it begins and ends.

    Of four curves the last changes the three channels before the others do; one is that of all.
    """
    mapping.update()  # as Cycles does: a change of how it goes on beyond its ends alone makes no new one
    curves = list(mapping.curves)
    least = min(curve.points[0].location[0] for curve in curves)
    most = max(curve.points[len(curve.points) - 1].location[0] for curve in curves)
    places = [least + i / _TABLE * (most - least) for i in range(_TABLE + 1)]
    if len(curves) == 4:
        common = curves.pop()
        places = [mapping.evaluate(common, place) for place in places]
    channels = [[mapping.evaluate(curve, place) for place in places] for curve in curves]
    return np.array([channels * (3 // len(channels))], np.float32).transpose(0, 2, 1), least, most


def ies_text(node: bpy.types.Node) -> str:
    """The text of an IES Texture; empty where it is missing."""
    if node.mode == "INTERNAL":
        return node.ies.as_string() if node.ies else ""
    try:
        return Path(bpy.path.abspath(node.filepath, library=node.id_data.library)).read_text("utf-8", "replace")
    except OSError:
        return ""


def draw_curves(mapping: bpy.types.CurveMapping, table: bpy.types.Image, least: float, most: float, extrapolate: bool) -> None:
    """Let curves go straight between a table's entries."""
    pixels = np.empty(len(table.pixels), np.float32)
    table.pixels.foreach_get(pixels)
    row = pixels.reshape(table.size[1], table.size[0], table.channels)[table.size[1] // 2]
    places = np.linspace(least, most, len(row))
    mapping.use_clip = False
    mapping.clip_min_x = -100.0  # Blender's own table reaches at least from one end to the other, which must not cross
    mapping.clip_max_x, mapping.clip_min_x = most, least
    mapping.extend = "EXTRAPOLATED" if extrapolate else "HORIZONTAL"
    for channel, curve in enumerate(mapping.curves):
        points = np.column_stack([places, places if channel == 3 else row[:, channel]]).tolist()
        if channel == 3 or len(points) == 1:
            points = [points[0], points[-1]]
        curve.points[0].location, curve.points[len(curve.points) - 1].location = points[0], points[-1]
        for x, y in points[1:-1]:
            curve.points.new(x, y)
        for point in curve.points:
            point.handle_type = "VECTOR"
    mapping.update()


def input_of(node: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket | None:
    """An input by its identifier, or None where this version has none."""
    return next((socket for socket in node.inputs if socket.identifier == identifier), None)
