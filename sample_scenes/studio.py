"""A still life in a studio: a moon gate in a terracotta wall, a portrait bust before it, set text, a meadow.

Suzanne (subdivided, smooth) stands in the right third on a turned plinth. The meadow is scattered by geometry nodes: a
few small plants and pebbles, as dense as a noise says, clear of the furniture. One warm sun, one cool softbox, one cyclorama.
Every surface is a Lambert surface of one color.
"""

import math

import bmesh
import bpy
import building as b
from building import fresh_scene, state_camera
from nodes import Nodes, use_nodes

GATE_CENTER, GATE_RADIUS = (1.5, 1.66), 1.25
SUN_ELEVATION, SUN_BEARING = 34, 222


def build():
    """The scene of studio.blend."""
    scene = fresh_scene("studio", 1280, 720)
    plaster, trim = b.matte("Terracotta plaster", "c4806a"), b.matte("Pale stone", "efe3d0")
    cyclorama(b.matte("Cyclorama", "e8cdb0"))
    moon_gate(plaster, trim)
    bust(trim)
    furniture = lettering(trim)
    distant_hills()
    meadow([*furniture, bpy.data.objects["Plinth"], bpy.data.objects["Gate wall"]])
    b.sun(4.2, "ffe2b8", SUN_ELEVATION, SUN_BEARING, angle=1.0)
    frond()
    b.softbox("Softbox", 160, "b8d4ff", (4.5, -5.0, 4.2), (0.6, 1.0, 1.0), 2.5, 2.5)
    b.sky("a9c6e8", 0.45)
    state_camera(scene, eye=(-0.5, -7.6, 1.62), look_at=(0.04, 1.6, 1.36), distance=1580.0)
    return scene


def cyclorama(material):
    """A floor that turns up into a wall without an edge."""
    radius, back, height, half_width, columns = 3.0, 14.0, 8.0, 14.0, 48
    outline = [(y, 0.0) for y in range(-10, 12)]
    outline += [(back - radius + radius * math.sin(a), radius * (1 - math.cos(a))) for a in _steps(0, math.pi / 2, 12)]
    outline += [(back, z) for z in _steps(radius, height, 5)[1:]]
    xs = _steps(-half_width, half_width, columns)
    vertices = [(x, y, z) for y, z in outline for x in xs]
    faces = [
        (row * columns + i, row * columns + i + 1, (row + 1) * columns + i + 1, (row + 1) * columns + i)
        for row in range(len(outline) - 1)
        for i in range(columns - 1)
    ]
    b.place("Cyclorama", b.mesh("Cyclorama", vertices, faces, smooth=True), material)


def moon_gate(plaster, trim):
    """A wall with a round opening, and a stone ring set into it."""
    center_x, center_z = GATE_CENTER
    left, right, top, thickness, count = -7.0, 7.0, 3.55, 0.42, 96
    angles = sorted(
        [2 * math.pi * i / count for i in range(count)]
        + [math.atan2(z - center_z, x - center_x) % (2 * math.pi) for x in (left, right) for z in (0.0, top)]
    )
    inner = [(center_x + GATE_RADIUS * math.cos(a), center_z + GATE_RADIUS * math.sin(a)) for a in angles]
    outer = [_to_rectangle(center_x, center_z, a, left, right, 0.0, top) for a in angles]
    n = len(angles)
    rings = [(x, y, z) for y in (-thickness / 2, thickness / 2) for ring in (inner, outer) for x, z in ring]
    faces = []
    for i in range(n):
        j = (i + 1) % n
        faces.append((i, n + i, n + j, j))  # front
        faces.append((2 * n + i, 2 * n + j, 3 * n + j, 3 * n + i))  # back
        faces.append((i, j, 2 * n + j, 2 * n + i))  # reveal
        faces.append((n + i, 3 * n + i, 3 * n + j, n + j))  # outside
    b.place("Gate wall", b.mesh("Gate wall", rings, faces), plaster, (0, 2.0, 0))
    outline = [(1.0, -0.27), (1.085, -0.27), (1.1, -0.255), (1.1, 0.255), (1.085, 0.27), (1.0, 0.27), (0.985, 0.255)]
    outline = [(radius * GATE_RADIUS, height) for radius, height in [*outline, (0.985, -0.255), (1.0, -0.27)]]
    b.turned("Gate ring", outline, trim, (center_x, 2.0, center_z), rotation=(90, 0, 0), steps=128)


def bust(stone):
    """Suzanne on a turned plinth."""
    x, y = GATE_CENTER[0] - 0.1, 0.95
    plinth = [(0, 0), (0.42, 0), (0.44, 0.02), (0.44, 0.1), (0.42, 0.12), (0.36, 0.14), (0.33, 0.2), (0.31, 0.3), (0.305, 0.7)]
    plinth += [(0.31, 0.8), (0.33, 0.84), (0.38, 0.87), (0.4, 0.89), (0.4, 0.97), (0.385, 0.985), (0, 0.985)]
    b.turned("Plinth", plinth, stone, (x, y, 0))
    b.suzanne("Suzanne", b.matte("Deep teal", "3b8588"), (x, y - 0.02, 1.53), (-7, 0, -26), 0.62)


def lettering(stone):
    """Two words on two steps, with two balls for company; returns what the meadow keeps clear of."""
    ochre, blush = b.matte("Ochre", "e0a030"), b.matte("Blush", "f3b7a0")
    step = b.box("Step", (2.9, 0.62, 0.7), blush, (-1.6, 1.05, 0), bevel=0.03, pieces=40)
    b.text("Virtual", "Virtual", stone, 0.86, (-2.93, 1.05, 0.715))
    b.text("Pinhole", "Pinhole", stone, 0.86, (-2.66, 0.1, 0.19))
    low = b.box("Low step", (3.1, 0.5, 0.16), b.matte("Rose", "d98a70"), (-1.3, 0.1, 0), bevel=0.03, pieces=40)
    b.ball("Ball", 0.2, ochre, (-0.42, 0.95, 0.9))
    small = b.ball("Small ball", 0.11, b.matte("Teal", "2f7f86"), (0.42, -0.35, 0.11))
    return [step, low, small]


def frond():
    """A palm leaf out of the picture, square to the sun, whose shadow falls across the wall."""
    vertices, faces = [], []
    pairs, stem_length = 13, 2.3
    for i in range(2 * pairs):
        along, side = (i // 2 + 0.5) / pairs, (-1, 1)[i % 2]
        x, y, length = stem_length * along, -0.55 * along**2, 1.05 * math.sin(math.pi * (0.15 + 0.75 * along))
        turn = -0.45 * along + side * math.radians(58 - 26 * along)
        c, s = math.cos(turn), math.sin(turn)
        outline = [(0, 0), (0.3, -0.045), (1, 0), (0.3, 0.045)]
        faces.append(range(len(vertices), len(vertices) + 4))
        vertices += [(x + length * p * c - q * s, y + length * p * s + q * c, 0.0) for p, q in outline]
    leaf = b.place("Palm leaf", b.mesh("Palm leaf", vertices, faces), b.matte("Palm", "5f8f5a"), (-4.6, 0.43, 4.75))
    leaf.rotation_euler = (math.radians(90 - SUN_ELEVATION), 0, math.radians(180 - SUN_BEARING))


def distant_hills():
    """The hills that the gate frames: three soft ones and a few cypresses."""
    sage, blue = b.matte("Sage", "8fae86"), b.matte("Distant blue", "86a9b4")
    b.ball("Hill", 1.0, sage, (0.2, 7.4, -0.35), scale=(3.4, 1.8, 1.55))
    b.ball("Far hill", 1.0, blue, (4.6, 9.6, -0.4), scale=(4.6, 1.6, 2.5))
    cypress = [(0, 0), (0.1, 0.02), (0.24, 0.25), (0.27, 0.5), (0.22, 0.9), (0.12, 1.35), (0.03, 1.7), (0, 1.74)]
    green = b.matte("Cypress", "2f5d4e")
    for number, (x, y, z, size) in enumerate([(2.05, 6.6, 0, 1.15), (2.6, 6.9, 0, 0.85), (0.95, 6.0, 0, 0.62)], 1):
        b.turned(f"Cypress {number}", cypress, green, (x, y, z), steps=32, scale=(size,) * 3)


def meadow(furniture):
    """Plants and pebbles over the floor, as dense as a noise says, but not under the furniture."""
    kit = b.kit("Meadow kit")
    grasses = [b.matte("Grass", "5f8f5a"), b.matte("Young grass", "a3b560")]
    for number, (blades, height) in enumerate([(9, 0.2), (6, 0.13)], 1):
        b.place(f"Tuft {number}", _tuft(f"Tuft {number}", blades, height), grasses[number - 1], into=kit)
    pebble = b.primitive("Pebble", bmesh.ops.create_icosphere, smooth=True, subdivisions=2, radius=0.05)
    pebble.vertices.foreach_set("co", [c for v in pebble.vertices for c in (v.co.x * 1.2, v.co.y, v.co.z * 0.6 + 0.015)])
    b.place("Pebble", pebble, b.matte("Pebble", "d8b48c"), into=kit)
    b.place("Flower", *_flower(), into=kit)
    kept_clear = b.collection("Kept clear")
    for obj in furniture:
        kept_clear.objects.link(obj)
    field = b.ground("Meadow", 9.0, 7.0, grasses[0], (0, 1.4, 0))
    use_nodes(field, _scatter(kit, kept_clear))


def _scatter(kit, kept_clear):
    """Points by noise density away from the furniture; on each an instance from the kit, turned and sized at random."""
    nodes = Nodes("Scatter by noise")
    seed = nodes.parameter("Seed", "Int", 7)
    noise = nodes.add("ShaderNodeTexNoise", {"Scale": 0.55, "Detail": 3.0, "Roughness": 0.6}, "Fac")
    obstacles = nodes.add("GeometryNodeCollectionInfo", {"Collection": kept_clear}, transform_space="RELATIVE")
    obstacles = nodes.add("GeometryNodeRealizeInstances", {"Geometry": obstacles})
    clearance = nodes.add("GeometryNodeProximity", {0: obstacles}, "Distance")
    density = nodes.math("MULTIPLY", nodes.ramp(noise, 0.44, 0.6), nodes.ramp(clearance, 0.06, 0.3))
    points = nodes.add(
        "GeometryNodeDistributePointsOnFaces",
        {"Mesh": nodes.geometry, "Distance Min": 0.06, "Density Max": 190.0, "Density Factor": density, "Seed": seed},
        "Points",
        distribute_method="POISSON",
    )
    plants = nodes.add("GeometryNodeCollectionInfo", {"Collection": kit, "Separate Children": True, "Reset Children": True})
    turn = nodes.vector(z=nodes.random(0.0, 2 * math.pi, 3))
    instances = nodes.add(
        "GeometryNodeInstanceOnPoints",
        {
            "Points": points,
            "Instance": plants,
            "Pick Instance": True,
            "Rotation": turn,
            "Scale": nodes.random(0.55, 1.25, 5),
        },
    )
    return nodes.finish(instances)


def _tuft(name: str, blades: int, height: float):
    """A tuft of grass: slender pyramids that lean outwards."""
    vertices, faces = [], []
    for i in range(blades):
        angle, lean = 2.399963 * i, 0.25 + 0.5 * i / blades
        c, s, tall = math.cos(angle), math.sin(angle), height * (1 - 0.35 * (i % 3) / 2)
        root, first = (0.03 * c * lean, 0.03 * s * lean), len(vertices)
        vertices += [(root[0] + 0.014 * math.cos(angle + k), root[1] + 0.014 * math.sin(angle + k), 0) for k in (0, 2.1, 4.2)]
        vertices += [(root[0] + tall * lean * c, root[1] + tall * lean * s, tall)]
        faces += [(first, first + 1, first + 3), (first + 1, first + 2, first + 3), (first + 2, first, first + 3)]
    return b.mesh(name, vertices, faces)


def _flower():
    """A stalk with a round head: a mesh of two materials, and the materials."""
    shape = bmesh.new()
    bmesh.ops.create_cone(shape, segments=6, radius1=0.008, radius2=0.005, depth=0.2, cap_ends=True)
    bmesh.ops.translate(shape, verts=shape.verts, vec=(0, 0, 0.1))
    stalk = set(shape.faces)
    head = bmesh.ops.create_icosphere(shape, subdivisions=2, radius=0.036)["verts"]
    bmesh.ops.translate(shape, verts=head, vec=(0, 0, 0.215))
    for face in shape.faces:
        face.material_index, face.smooth = int(face not in stalk), True
    data = bpy.data.meshes.new("Flower")
    shape.to_mesh(data)
    shape.free()
    return data, [b.matte("Stalk", "6f8f4e"), b.matte("Blossom", "fff4e0")]


def _steps(start: float, end: float, count: int) -> list[float]:
    return [start + (end - start) * i / (count - 1) for i in range(count)]


def _to_rectangle(x: float, z: float, angle: float, left: float, right: float, bottom: float, top: float):
    """The point where a ray from (x, z) leaves the rectangle."""
    c, s = math.cos(angle), math.sin(angle)
    reach = []
    if abs(c) > 1e-9:
        reach.append(((right if c > 0 else left) - x) / c)
    if abs(s) > 1e-9:
        reach.append(((top if s > 0 else bottom) - z) / s)
    return x + min(reach) * c, z + min(reach) * s
