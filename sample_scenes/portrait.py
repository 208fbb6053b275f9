"""A palace of arches in upright format: shift keeps its verticals parallel, and its pixels are not square.

The view is level and the picture's principal point lies far below its middle, as with a view camera whose front is raised.
The picture has 480 × 1080 pixels, each 1.5 times as wide as high, and so is seen as 2 : 3.
"""

import math

import building as b
from building import fresh_scene, state_camera
from nodes import Nodes, use_nodes

BAY, STORY, DEPTH = 3.2, 4.1, 1.1  # the façade's arches, in meters
BAYS, STORIES = 6, 6


def build():
    """The scene of portrait.blend."""
    scene = fresh_scene("portrait", 480, 1080)
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = 1.5, 1.0
    stone, steps = b.matte("Travertine", "efe0c4"), b.matte("Steps", "dcc4a0")
    palace(stone, b.matte("Inner walls", "c98f62"))
    square(steps)
    statue(stone)
    b.sun(6.5, "ffdcab", elevation=27, azimuth=238, angle=0.6)
    b.sky("5f95c9", 0.75)
    state_camera(scene, eye=(5.2, -24.0, 1.7), look_at=(5.2, 0.0, 1.7), distance=500.0, principal_point=(240.0, 215.0))
    return scene


def palace(stone, inner_stone):
    """Storeys of arches on two sides of a square block, one arch repeated by arrays."""
    width = BAYS * BAY
    arch = _arch()
    for name, location, turn in [("Front", (0, 0, 0.9), 0), ("Side", (0, width, 0.9), -90)]:
        wall = b.place(name, arch, location=location, rotation=(0, 0, turn))
        for axis, count, step in [("bays", BAYS, (BAY, 0, 0)), ("storeys", STORIES, (0, 0, STORY))]:
            array = wall.modifiers.new(f"{count} {axis}", "ARRAY")
            array.count, array.use_relative_offset, array.use_constant_offset = count, False, True
            array.constant_offset_displace = step
    arch.materials.append(stone)
    height = STORIES * STORY
    b.box("Core", (width - 7, width - 7, height), inner_stone, (width / 2, width / 2, 0.9), bevel=0)
    for level in range(STORIES + 1):
        thickness = 1.5 if level == STORIES else 0.28
        overhang = 0.12 if level == STORIES else 0.06
        size = (width + 2 * overhang, width + 2 * overhang, thickness)
        b.box(f"Floor {level}", size, stone, (width / 2, width / 2, 0.9 + level * STORY - 0.14), bevel=0.03)
    b.box("Corner", (0.5, 0.5, height), stone, (0.2, 0.2, 0.9), bevel=0.02)


def _arch():
    """One bay of wall with a round-headed opening through it."""
    half, spring, sill, segments = 1.12, 2.35, 0.14, 20
    opening = [(BAY / 2 + half, sill), (BAY / 2 + half, spring)]
    opening += [
        (BAY / 2 + half * math.cos(math.pi * i / segments), spring + half * math.sin(math.pi * i / segments))
        for i in range(1, segments)
    ]
    opening += [(BAY / 2 - half, spring), (BAY / 2 - half, sill)]
    frame = [(BAY, sill), (BAY, spring)]
    frame += [_on_frame(x - BAY / 2, z - spring, spring) for x, z in opening[2:-2]]
    frame += [(0.0, spring), (0.0, sill)]
    n = len(opening)
    vertices = [(x, y, z) for y in (0.0, DEPTH) for line in (opening, frame) for x, z in line]
    faces = []
    for i in range(n - 1):
        faces.append((i, n + i, n + i + 1, i + 1))
        faces.append((2 * n + i, 2 * n + i + 1, 3 * n + i + 1, 3 * n + i))
        faces.append((i, i + 1, 2 * n + i + 1, 2 * n + i))
    return b.mesh("Arch", vertices, faces)


def _on_frame(x: float, z: float, spring: float):
    """The point where the ray from the arch's center through (x, z) meets the bay's outline."""
    reach = min(BAY / 2 / abs(x) if x else math.inf, (STORY - spring) / z if z else math.inf)
    return BAY / 2 + x * reach, spring + z * reach


def square(steps):
    """Paving, three steps, and a wall whose shadow falls into the picture."""
    b.ground("Square", 160, 160, b.matte("Paving", "cf9f63"), (10, 10, 0))
    for i in range(3):
        grow = 2 * (0.5 + 0.55 * (2 - i))
        size = (BAYS * BAY + grow, BAYS * BAY + grow, 0.3)
        b.box(f"Step {i + 1}", size, steps, (BAYS * BAY / 2, BAYS * BAY / 2, 0.3 * i), bevel=0.02)
    chimney = b.matte("Brick", "9c4f38")
    b.turned("Chimney", [(0, 0), (1.3, 0), (1.05, 14), (1.2, 14), (1.2, 14.6), (0.9, 14.6), (0.9, 13)], chimney, (-20.0, 36, 0))
    group = _paving_joints()
    joints = b.matte("Joints", "b5824b")
    use_nodes(b.place("Paving joints", b.mesh("Paving joints", []), joints), group, material=joints)


def _paving_joints():
    """Pale strips across the square that lead the eye to the palace."""
    nodes = Nodes("Strips in a row")
    material = nodes.parameter("Material", "Material")
    line = nodes.add("GeometryNodeMeshLine", {"Count": 14, "Start Location": (-26.0, -14.0, 0.0), "Offset": (4.6, 0, 0)})
    strip = nodes.add("GeometryNodeMeshCube", {"Size": (0.16, 30.0, 0.012), "Vertices Y": 16})
    strips = nodes.add("GeometryNodeInstanceOnPoints", {"Points": line, "Instance": strip})
    return nodes.finish(nodes.add("GeometryNodeSetMaterial", {"Geometry": strips, "Material": material}))


def statue(stone):
    """A marble head on a tall plinth, and its long shadow."""
    x, y = 0.6, -9.0
    b.box("Plinth foot", (1.5, 1.5, 0.35), stone, (x, y, 0), bevel=0.04)
    b.box("Plinth", (1.1, 1.1, 1.75), stone, (x, y, 0.35), bevel=0.03)
    b.box("Plinth cap", (1.3, 1.3, 0.18), stone, (x, y, 2.1), bevel=0.04)
    b.suzanne("Head", b.matte("Marble", "f5ede0"), (x, y, 2.98), (-6, 0, 28), 0.78)
