"""A drop above a sea of pearls: 6,000 exact spheres and one exact ellipsoid.

Geometry nodes lay points out in a phyllotaxis (each a golden angle on from the last, as the seeds of a sunflower are),
lift them into a ripple, and make them a point cloud with a radius for each: spheres without a single triangle. The drop is a
point cloud of one point, scaled differently along each axis, and so an ellipsoid.
"""

import math

import building as b
from building import fresh_scene, state_camera
from nodes import Nodes, use_nodes

GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
SPACING = 0.053  # the n-th pearl lies at SPACING · √n from the middle
BANDS = [  # pearls from the middle outwards: how many, and their color
    (90, "ffe9c9"),
    (260, "f7c59f"),
    (520, "ea8f79"),
    (860, "b9648a"),
    (1200, "6a5596"),
    (1450, "34508c"),
    (1620, "1d3a66"),
]


def build():
    """The scene of spheres.blend."""
    scene = fresh_scene("spheres", 960, 720)
    pearls(_phyllotaxis())
    drop()
    b.ground("Floor", 120, 120, b.matte("Night", "1c2a4d"), (0, 30, -0.62))
    b.softbox("Window", 900, "ffeedd", (-4.5, 1.0, 5.0), (0, 0, 0.2), 3.0, 5.0)
    b.softbox("Backdrop", 1500, "8fa4ff", (0, 9, 7), (0, 12, -0.6), 8.0, 4.0)
    b.softbox("Rim", 420, "9fb4ff", (4.5, 4.5, 2.4), (0, 0, 0.4), 1.0, 5.0)
    b.sky("6f86b8", 0.35)
    state_camera(scene, eye=(0.9, -6.3, 3.0), look_at=(0.1, 0.0, 0.42), distance=1180.0)
    return scene


def pearls(group):
    """One point cloud a band, for a point cloud has one material."""
    into, first = b.collection("Pearls"), 0
    for number, (count, code) in enumerate(BANDS, 1):
        material = b.glossy(f"Pearl {number}", code, roughness=0.22)
        cloud = b.place(f"Band {number}", b.mesh(f"Band {number}", []), material, into=into)
        use_nodes(cloud, group, first=first, count=count, material=material)
        first += count


def drop():
    """An ellipsoid: one exact sphere, scaled along the axes of its object."""
    nodes = Nodes("One sphere")
    material = nodes.parameter("Material", "Material")
    point = nodes.add("GeometryNodePoints", {"Count": 1, "Radius": 0.3})
    group = nodes.finish(nodes.add("GeometryNodeSetMaterial", {"Geometry": point, "Material": material}))
    gold = b.glossy("Gold", "f2b45a", roughness=0.12, metallic=1.0)
    for name, location, scale, tilt in [
        ("Drop", (0, 0, 1.42), (1.0, 1.0, 1.5), (8, -14, 0)),
        ("Droplet", (0.62, 0.35, 1.12), (0.36, 0.36, 0.3), (20, 30, 0)),
        ("Splash", (-0.52, -0.3, 0.98), (0.24, 0.24, 0.28), (0, 20, 0)),
    ]:
        cloud = b.place(name, b.mesh(name, []), gold, location=location, rotation=tilt, scale=scale)
        use_nodes(cloud, group, material=gold)


def _phyllotaxis():
    """Spheres first … first + count of a rippling golden-angle spiral."""
    nodes = Nodes("Rippling phyllotaxis")
    first, count = nodes.parameter("First", "Int", 0), nodes.parameter("Count", "Int", 100)
    material = nodes.parameter("Material", "Material")
    number = nodes.math("ADD", nodes.math("ADD", nodes.add("GeometryNodeInputIndex"), first), 0.5)
    angle, distance = nodes.math("MULTIPLY", number, GOLDEN_ANGLE), nodes.math("MULTIPLY", nodes.math("SQRT", number), SPACING)
    swell = nodes.math("MULTIPLY", nodes.math("EXPONENT", nodes.math("MULTIPLY", distance, -0.75)), 0.42)
    height = nodes.math("MULTIPLY", nodes.math("COSINE", nodes.math("MULTIPLY", distance, 4.6)), swell)
    x, y = (nodes.math("MULTIPLY", distance, nodes.math(function, angle)) for function in ("COSINE", "SINE"))
    line = nodes.add("GeometryNodeMeshLine", {"Count": count, "Offset": (0, 0, 0)})
    placed = nodes.add("GeometryNodeSetPosition", {"Geometry": line, "Position": nodes.vector(x, y, height)})
    radius = nodes.math("ADD", nodes.math("MULTIPLY", height, 0.035), 0.041)
    points = nodes.add("GeometryNodeMeshToPoints", {"Mesh": placed, "Radius": radius})
    return nodes.finish(nodes.add("GeometryNodeSetMaterial", {"Geometry": points, "Material": material}))
