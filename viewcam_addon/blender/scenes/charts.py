"""A layout of a mesh's faces in a square, none over another, for what is baked: a formula of each face's number and corners.

Faces stand in a grid, row by row; each is a regular polygon in the middle of its cell, whatever its shape. So geometry nodes
can lay out what modifiers have made, for Cycles, as NumPy does it for the tracer.
"""

import math

import bpy
import numpy as np
from numpy.typing import NDArray

from ..temporary_settings import Overrides

NAME = "Virtual Pinhole Chart"
RADIUS = 0.375
"""The radius of a polygon, in cells: between two there is a quarter of a cell, whose texels are baked as the nearest of the
polygon."""


def columns(faces: int) -> int:
    """Cells in a row, of which there are as many."""
    return math.ceil(math.sqrt(faces))


def corners(starts: NDArray[np.int32], totals: NDArray[np.int32]) -> NDArray[np.float32]:
    """(corners, 2) where each corner of the faces is, from 0 to 1. starts, totals : their first corners, and how many."""
    across = columns(len(starts))
    face = np.repeat(np.arange(len(starts)), totals)
    angles = 2 * np.pi * (np.arange(len(face)) - starts[face] + 0.5) / totals[face]
    cells = np.column_stack([face % across, face // across])
    return ((cells + 0.5 + RADIUS * np.column_stack([np.cos(angles), np.sin(angles)])) / across).astype(np.float32)


def covered(totals: NDArray[np.int32], shown: NDArray[np.bool_], size: int) -> NDArray[np.bool_]:
    """(height, width) which texels lie in a face. shown : of which faces. size : of a cell, texels."""
    across = columns(len(totals))
    found = np.zeros((across, across, size, size), bool)
    x, y = np.meshgrid(*[(np.arange(size) + 0.5) / size - 0.5] * 2)
    for total in np.unique(totals[shown]).tolist():
        sides = 2 * np.pi * np.arange(1, total + 1) / total
        reach = np.max([np.cos(angle) * x + np.sin(angle) * y for angle in sides], axis=0)
        faces = np.flatnonzero(shown & (totals == total))
        found[faces // across, faces % across] = reach <= RADIUS * np.cos(np.pi / total)
    return found.transpose(0, 2, 1, 3).reshape(across * size, across * size)


def lay_out(overrides: Overrides, block: bpy.types.Object, faces: int, data_type: str = "FLOAT_VECTOR") -> None:
    """Let an object's evaluated mesh have the attribute NAME until the overrides end. faces : how many that has."""
    group = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    overrides.afterwards(bpy.data.batch_remove, [group])
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    new, link = group.nodes.new, group.links.new

    def math_node(operation: str, *operands: float | bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        node = new("ShaderNodeMath")
        node.operation = operation
        for socket, operand in zip(node.inputs, operands, strict=False):
            if isinstance(operand, int | float):
                socket.default_value = operand
            else:
                link(operand, socket)
        return node.outputs[0]

    across = columns(faces)
    of_corner, of_face, place = new("GeometryNodeFaceOfCorner"), new("GeometryNodeCornersOfFace"), new("ShaderNodeCombineXYZ")
    face = of_corner.outputs["Face Index"]
    link(face, of_face.inputs["Face Index"])
    turned = math_node("MULTIPLY_ADD", of_corner.outputs["Index in Face"], 2 * math.pi, math.pi)
    angle = math_node("DIVIDE", turned, of_face.outputs["Total"])
    row = math_node("FLOOR", math_node("DIVIDE", math_node("ADD", face, 0.5), across))
    column = math_node("MULTIPLY_ADD", row, -across, face)
    for socket, cell, operation in zip(place.inputs, (column, row), ("COSINE", "SINE"), strict=False):
        inside = math_node("MULTIPLY_ADD", math_node(operation, angle), RADIUS, 0.5)
        link(math_node("DIVIDE", math_node("ADD", cell, inside), across), socket)
    store = new("GeometryNodeStoreNamedAttribute")
    store.data_type, store.domain = data_type, "CORNER"
    store.inputs["Name"].default_value = NAME
    link(place.outputs[0], next(socket for socket in store.inputs if socket.name == "Value" and socket.enabled))
    link(new("NodeGroupInput").outputs[0], store.inputs["Geometry"])
    link(store.outputs[0], new("NodeGroupOutput").inputs[0])
    overrides.afterwards(setattr, block.modifiers, "active", block.modifiers.active)
    modifier = block.modifiers.new(NAME, "NODES")
    overrides.afterwards(block.modifiers.remove, modifier)
    modifier.node_group = group


def difference(coarse: NDArray[np.float32], fine: NDArray[np.float32], within: NDArray[np.bool_]) -> float:
    """By how much 99 of 100 texels of `within` differ at most from what half as many rows and columns interpolate there.

    Of values above 1 relative to them. coarse, fine : (height, width, 3).
    """
    made = coarse.astype(np.float64)
    for axis in (0, 1):
        along = np.moveaxis(made, axis, 0)
        padded = np.concatenate([along[:1], along, along[-1:]])
        between = np.stack([0.75 * along + 0.25 * padded[:-2], 0.75 * along + 0.25 * padded[2:]], axis=1)
        made = np.moveaxis(between.reshape(-1, *along.shape[1:]), 0, axis)
    apart = np.abs(made - fine)[within] / np.maximum(np.abs(fine[within]), 1)
    return float(np.percentile(apart.max(axis=1), 99)) if len(apart) else 0.0
