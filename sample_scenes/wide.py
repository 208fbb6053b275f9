"""A hall of striped arches, 170° wide.

Arcades stand parallel to the picture, one behind the other, and run far to both sides. What is parallel to the view plane keeps
its shape however wide the view is, while floor and ceiling rush towards the eye. On Blender's 36 mm this is a lens of 1.6 mm.
"""

import math

import bpy
import building as b
from building import distance_for, fresh_scene, state_camera
from nodes import Nodes, use_nodes

BAY, ROW = 3.0, 4.2  # meters from column to column and from arcade to arcade
BAYS, ROWS = 35, 6
COLUMN_HEIGHT, WALL_DEPTH = 2.5, 0.5


def build():
    """The scene of wide.blend."""
    scene = fresh_scene("wide", 1280, 420)
    arcades()
    hall()
    lights()
    state_camera(
        scene,
        eye=(0.0, 0.0, 1.75),
        look_at=(0.0, 10.0, 1.75),
        distance=distance_for(170.0, 1280),
        principal_point=(640.0, 150.0),
    )
    return scene


def arcades():
    """Columns and two tiers of voussoirs, repeated by arrays along and across."""
    marbles = [b.glossy("Grey marble", "8d9196", 0.4), b.glossy("Rose marble", "b98578", 0.4)]
    stone, brick = b.matte("Limestone", "efdcb8"), b.matte("Brick", "b5523a")
    plain = b.matte("Plaster", "e9d3ac")
    shaft = [(0, 0), (0.27, 0), (0.27, 0.1), (0.24, 0.16), (0.2, 0.2), (0.19, 1.2), (0.175, 2.02), (0.2, 2.06)]
    shaft += [(0.19, 2.1), (0.22, 2.2), (0.3, 2.34), (0.33, 2.4), (0.33, COLUMN_HEIGHT), (0, COLUMN_HEIGHT)]
    for number in (0, 1):  # the two marbles take turns
        column = b.turned(f"Columns {number + 1}", shaft, marbles[number], (_first_x() + number * BAY, _first_y(), 0), steps=32)
        _repeat(column, (BAYS + 2 - number) // 2, 2 * BAY)
    for name, height, rise in [("Lower arches", COLUMN_HEIGHT, 0.0), ("Upper arches", COLUMN_HEIGHT + 1.55, 0.55)]:
        arch = b.place(name, _voussoirs(name, 1.06 if rise else 1.08, 0.4), [stone, brick], (_first_x(), _first_y(), height))
        _repeat(arch, BAYS, BAY)
    pier = b.box("Piers", (0.6, WALL_DEPTH - 0.1, 1.75), plain, (_first_x(), _first_y(), COLUMN_HEIGHT), bevel=0.03)
    _repeat(pier, BAYS + 1, BAY)
    wall = b.place("Walls", _spandrel(), plain, (_first_x(), _first_y(), COLUMN_HEIGHT + 1.55))
    _repeat(wall, BAYS, BAY)


def _first_x() -> float:
    return -BAY * BAYS / 2


def _first_y() -> float:
    return 2.1


def _repeat(obj, count: int, step: float) -> None:
    for name, number, offset in [("Along", count, (step, 0, 0)), ("Rows", ROWS, (0, ROW, 0))]:
        array = obj.modifiers.new(name, "ARRAY")
        array.count, array.use_relative_offset, array.use_constant_offset = number, False, True
        array.constant_offset_displace = offset


def _voussoirs(name: str, radius: float, height: float, wedges: int = 15, steps: int = 2):
    """A half ring of wedges over one bay, alternately of the first and the second material."""
    vertices, faces, materials = [], [], []
    for i in range(wedges * steps + 1):
        angle = math.pi * i / (wedges * steps)
        for r in (radius, radius + height):
            x, z = BAY / 2 + r * math.cos(angle), r * math.sin(angle)
            vertices += [(x, -WALL_DEPTH / 2, z), (x, WALL_DEPTH / 2, z)]
    for i in range(wedges * steps):
        a, c = 4 * i, 4 * i + 4  # inner front, inner back, outer front, outer back
        faces += [(a, a + 2, c + 2, c), (a + 1, c + 1, c + 3, a + 3), (a, c, c + 1, a + 1), (a + 2, a + 3, c + 3, c + 2)]
        materials += [i // steps % 2] * 4
    return b.mesh(name, vertices, faces, face_materials=materials)


def _spandrel():
    """The wall above one upper arch, up to the ceiling."""
    radius, top, count = 1.25, 2.6, 24
    inner = [
        (BAY / 2 + radius * math.cos(math.pi * i / count), radius * math.sin(math.pi * i / count)) for i in range(count + 1)
    ]
    outer = [(BAY * (1 - i / count), top) for i in range(count + 1)]
    inner, outer = [(BAY, 0.0), *inner, (0.0, 0.0)], [(BAY, top), *outer, (0.0, top)]
    n = len(inner)
    vertices = [(x, y * 0.44, z) for y in (-0.5, 0.5) for line in (inner, outer) for x, z in line]
    faces = []
    for i in range(n - 1):
        faces.append((i, n + i, n + i + 1, i + 1))
        faces.append((2 * n + i, 2 * n + i + 1, 3 * n + i + 1, 3 * n + i))
    return b.mesh("Spandrel", vertices, faces)


def hall():
    """A floor of tiles, a ceiling of beams, the far walls."""
    width, depth = BAY * BAYS + 8, ROW * ROWS + 12
    b.ground("Floor", width, depth, b.glossy("Floor", "a8805c", 0.5), (0, 10, 0))
    strips = _strips()
    red = b.matte("Red tiles", "8c4630")
    use_nodes(b.place("Tiles across", b.mesh("Tiles across", []), red), strips, material=red)
    plank = b.matte("Ceiling", "6f5a48")
    b.ground("Ceiling", width, depth, plank, (0, 10, 6.65))
    # In short pieces: float32 tells little of where in a triangle of 37 m by 7 mm a ray arrives.
    pieces = round(depth / 0.6)
    piece = depth / pieces
    start = (_first_x(), 10 - (depth - piece) / 2, 6.35)
    beam = b.box("Beams", (0.22, piece, 0.3), b.matte("Beams", "4a3428"), start, bevel=0)
    lengthwise = beam.modifiers.new("Lengthwise", "ARRAY")
    lengthwise.count, lengthwise.relative_offset_displace = pieces, (0, 1, 0)
    array = beam.modifiers.new("Along", "ARRAY")
    array.count, array.use_relative_offset, array.use_constant_offset = 2 * BAYS + 1, False, True
    array.constant_offset_displace = (BAY / 2, 0, 0)
    b.box("Far wall", (width, 0.4, 6.7), b.matte("Far wall", "d9a76a"), (0, _first_y() + ROW * ROWS, 0), bevel=0)
    b.suzanne("Keeper", b.matte("Bronze", "3d7d78"), (0, _first_y() + 2.0, 1.9), (-4, 0, 0), 0.5)
    b.box("Pedestal", (0.6, 0.6, 1.45), b.matte("Pedestal", "efdcb8"), (0, _first_y() + 2.0, 0), bevel=0.03)


def _strips():
    """A lattice of thin slabs on the floor, by geometry nodes."""
    nodes = Nodes("Floor lattice")
    material = nodes.parameter("Material", "Material")
    along = nodes.add(
        "GeometryNodeMeshLine", {"Count": 2 * BAYS + 1, "Start Location": (_first_x(), 10, 0), "Offset": (BAY / 2, 0, 0)}
    )
    slab = nodes.add("GeometryNodeMeshCube", {"Size": (0.14, 34.0, 0.01), "Vertices Y": 24})
    lengthwise = nodes.add("GeometryNodeInstanceOnPoints", {"Points": along, "Instance": slab})
    rows = nodes.add("GeometryNodeMeshLine", {"Count": 23, "Start Location": (0, -6.7, 0), "Offset": (0, ROW / 3, 0)})
    slab = nodes.add("GeometryNodeMeshCube", {"Size": (BAY * BAYS, 0.14, 0.012), "Vertices X": 64})
    across = nodes.add("GeometryNodeInstanceOnPoints", {"Points": rows, "Instance": slab})
    both = nodes.join(lengthwise, across)
    return nodes.finish(nodes.add("GeometryNodeSetMaterial", {"Geometry": both, "Material": material}))


def lights():
    """Lamps between the arcades, and daylight from the end of the hall behind the eye."""
    for row in range(ROWS):
        y = _first_y() + (row + 0.5) * ROW
        b.softbox(f"Roof light {row + 1}", 5200, "ffe3b5", (0, y, 6.3), (0, y, 0), BAY * BAYS, 0.7)
    b.softbox("Daylight", 1500, "cfe0ff", (0, -5.5, 4.5), (0, 4, 2.0), BAY * BAYS, 2.5)
    b.sky("fff0d8", 0.25)
    bpy.context.scene.cycles.max_bounces = 6
