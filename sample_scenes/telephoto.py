"""The moon over a ridge, through a lens of half a degree: five kilometers away, a photographer at work.

At d = 146,677 pixels a pixel is seven millionths of a radian, which is 3.4 cm at the ridge. The moon here is a ball of 103 m at
a distance of 60 km. Terrain, trees and craters are geometry nodes.
"""

import math

import bmesh
import building as b
from building import distance_for, fresh_scene, state_camera
from mathutils import Euler
from nodes import Nodes, use_nodes

EYE = (0.0, -5000.0, -40.0)


def build():
    """The scene of telephoto.blend."""
    scene = fresh_scene("telephoto", 1280, 720)
    moon((4.6, 7.2), distance=60000.0, radius=103.0)
    pines = pine_kit()
    near = _terrain("Ridge with pines", pines)
    for name, code, y, z, seed, height, density in [
        ("Ridge", "141a2b", 0.0, 0.6, 3.0, 2.2, 0.13),
        ("Second ridge", "2a3350", 900.0, 8.0, 11.0, 4.5, 0.05),
        ("Third ridge", "3f4668", 2300.0, 21.0, 27.0, 5.0, 0.0),
    ]:
        width = 46.0 * (5000.0 + y) / 5000.0 * 1.15
        material = b.matte(name, code)
        ridge = b.place(name, b.mesh(name, []), material, location=(0, y, z))
        use_nodes(ridge, near, width=width, height=height, seed=seed, density=density, material=material)
    clouds()
    photographer((7.4, -0.5, 2.1))
    b.sun(5.5, "fff0d8", elevation=12, azimuth=196, angle=0.5)
    b.sky("5a5f95", 0.8)
    camera = state_camera(scene, EYE, look_at=(0.0, 0.0, 5.6), distance=distance_for(0.5, 1280))
    camera.data.clip_end = 100000.0
    return scene


def moon(seen_at, distance: float, radius: float):
    """A cratered ball that appears in the picture where the point (x, 0, z) at the ridge does."""
    reach = (distance - EYE[1]) / -EYE[1]
    x, z = seen_at[0] * reach, EYE[2] + (seen_at[1] - EYE[2]) * reach
    nodes = Nodes("Craters and seas")
    highland, sea = nodes.parameter("Highland", "Material"), nodes.parameter("Sea", "Material")
    shape = nodes.add("GeometryNodeMeshIcoSphere", {"Radius": radius, "Subdivisions": 7})
    normal = nodes.add("GeometryNodeInputNormal")
    lift = 0.0
    for size, depth in [(0.03, 1.6), (0.07, 0.7), (0.16, 0.3)]:
        cell = nodes.add("ShaderNodeTexVoronoi", {"Scale": size, "Randomness": 1.0}, "Distance")
        bowl = nodes.math(
            "SUBTRACT", nodes.ramp(cell, 0.0, 0.42, -depth, 0.35 * depth), nodes.ramp(cell, 0.38, 0.62, 0.0, 0.35 * depth)
        )
        lift = nodes.math("ADD", lift, bowl)
    offset = nodes.add("ShaderNodeVectorMath", {0: normal, "Scale": lift}, "Vector", operation="SCALE")
    cratered = nodes.add("GeometryNodeSetPosition", {"Geometry": shape, "Offset": offset})
    noise = nodes.add("ShaderNodeTexNoise", {"Scale": 0.0105, "Detail": 5.0, "Roughness": 0.55, "Distortion": 0.4}, "Fac")
    colored = nodes.add("GeometryNodeSetMaterial", {"Geometry": cratered, "Material": highland})
    is_sea = nodes.math("GREATER_THAN", noise, 0.5)
    colored = nodes.add("GeometryNodeSetMaterial", {"Geometry": colored, "Selection": is_sea, "Material": sea})
    group = nodes.finish(nodes.add("GeometryNodeSetShadeSmooth", {"Geometry": colored}))
    highland = b.matte("Highland", "f2e3c9")
    ball = b.place("Moon", b.mesh("Moon", []), highland, (x, distance, z), rotation=(0, 20, 35))
    use_nodes(ball, group, highland=highland, sea=b.matte("Sea", "b3a08a"))


def pine_kit():
    """Two pines of stacked cones, shown only where they are scattered."""
    kit = b.kit("Pine kit")
    needles = b.matte("Needles", "0d1420")
    for number, (tiers, height, girth) in enumerate([(9, 5.2, 1.15), (7, 3.6, 0.95)], 1):
        shape = bmesh.new()
        trunk = bmesh.ops.create_cone(shape, segments=8, radius1=0.12, radius2=0.05, depth=height, cap_ends=True)["verts"]
        bmesh.ops.translate(shape, verts=trunk, vec=(0, 0, height / 2))
        for tier in range(tiers):
            t = tier / tiers
            wide = girth * (1 - t) ** 0.85 * (1 + 0.12 * math.sin(7 * tier + number)) + 0.08
            tall = 1.6 * height / tiers
            cone = bmesh.ops.create_cone(shape, segments=11, radius1=wide, radius2=0.0, depth=tall)["verts"]
            bmesh.ops.rotate(shape, verts=cone, matrix=_tilt(0.09 * math.sin(5 * tier), 0.09 * math.cos(3 * tier)))
            bmesh.ops.translate(shape, verts=cone, vec=(0, 0, height * (0.2 + 0.8 * t)))
        data = b.mesh(f"Pine {number}", [])
        shape.to_mesh(data)
        shape.free()
        b.place(f"Pine {number}", data, needles, into=kit)
    return kit


def _tilt(x: float, y: float):
    return Euler((x, y, 0)).to_matrix()


def _terrain(name: str, kit):
    """A ridge along x whose crest and slopes a noise shapes, with trees."""
    nodes = Nodes(name)
    width, height = nodes.parameter("Width", "Float", 50.0), nodes.parameter("Height", "Float", 2.0)
    seed, density = nodes.parameter("Seed", "Float", 0.0), nodes.parameter("Density", "Float", 0.1)
    material = nodes.parameter("Material", "Material")
    grid = nodes.add("GeometryNodeMeshGrid", {"Size X": width, "Size Y": 40.0, "Vertices X": 320, "Vertices Y": 96})
    x, y, _ = nodes.separate(nodes.add("GeometryNodeInputPosition"))
    across = nodes.math("DIVIDE", x, width)
    rolling = nodes.add("ShaderNodeTexNoise", {"Vector": nodes.vector(across, seed, 0.0), "Scale": 4.5, "Detail": 5.0}, "Fac")
    rocks = {"Vector": nodes.vector(x, y, seed), "Scale": 0.4, "Detail": 4.0, "Roughness": 0.65}
    rocks = nodes.add("ShaderNodeTexNoise", rocks, "Fac")
    crest = nodes.math("MULTIPLY", nodes.math("SUBTRACT", rolling, 0.5), nodes.math("MULTIPLY", height, 3.2))
    rough = nodes.math("MULTIPLY", nodes.math("SUBTRACT", rocks, 0.5), nodes.math("MULTIPLY", height, 0.4))
    slope = nodes.math("MULTIPLY", nodes.math("MULTIPLY", y, y), -0.05)
    z = nodes.math("ADD", nodes.math("ADD", crest, rough), slope)
    land = nodes.add("GeometryNodeSetPosition", {"Geometry": grid, "Offset": nodes.vector(z=z)})
    land = nodes.add("GeometryNodeSetMaterial", {"Geometry": land, "Material": material})
    left = nodes.math("MULTIPLY", nodes.ramp(across, 0.08, -0.12), density)
    points = nodes.add("GeometryNodeDistributePointsOnFaces", {"Mesh": land, "Density": left, "Seed": 5}, "Points")
    trees = nodes.add("GeometryNodeCollectionInfo", {"Collection": kit, "Separate Children": True, "Reset Children": True})
    placed = {"Points": points, "Instance": trees, "Pick Instance": True, "Scale": nodes.random(0.6, 1.5, 9)}
    placed = nodes.add("GeometryNodeInstanceOnPoints", placed | {"Rotation": nodes.vector(z=nodes.random(0.0, 6.283, 2))})
    return nodes.finish(nodes.join(land, placed))


def clouds():
    """Long thin clouds, 25 km away."""
    mist, reach = b.matte("Cloud", "c9a9ae"), 6.0
    for number, (x, z, long, thick) in enumerate(
        [(-9, 3.4, 14, 0.32), (8, 2.3, 16, 0.28), (-2, 1.5, 18, 0.3), (15, 4.6, 6, 0.16)], 1
    ):
        center = (x * reach, 25000.0, EYE[2] + (z - EYE[2]) * reach)
        b.ball(f"Cloud {number}", reach, mist, center, scale=(long / 2, 2, thick / 2))


def photographer(foot):
    """Someone on a boulder, bent over a camera on a tripod."""
    dark = b.matte("Figure", "0b0f18")
    x, y, z = foot
    b.ball("Boulder", 1.0, b.matte("Boulder", "141a2b"), (x - 0.3, y, z - 1.2), scale=(3.4, 2.4, 1.25))
    parts = [((0.1, 0), (0.0, 0.85), 0.1), ((0.42, 0), (0.08, 0.85), 0.1), ((0.03, 0.8), (-0.12, 1.45), 0.19)]
    parts += [((-0.14, 1.4), (-0.5, 1.3), 0.065), ((-0.1, 1.42), (-0.42, 1.12), 0.065), ((0.16, 0.95), (0.1, 1.42), 0.16)]
    parts += [((-0.78, 1.25), (-1.12, 0), 0.03), ((-0.78, 1.25), (-0.5, 0), 0.03), ((-0.78, 1.25), (-0.8, 0), 0.03)]
    parts += [((-0.62, 1.4), (-0.86, 1.4), 0.12), ((-0.86, 1.4), (-1.22, 1.43), 0.085)]
    for number, ((x0, z0), (x1, z1), radius) in enumerate(parts, 1):
        length, lean = math.hypot(x1 - x0, z1 - z0), math.degrees(math.atan2(x1 - x0, z1 - z0))
        limb = [(0, 0), (0.8 * radius, 0), (radius, 0.1 * length), (radius, 0.9 * length), (0.8 * radius, length), (0, length)]
        b.turned(f"Figure {number}", limb, dark, (x + x0, y, z + z0), steps=16, rotation=(0, lean, 0))
    b.ball("Head", 0.13, dark, (x - 0.27, y, z + 1.62))
    b.turned("Hat", [(0, 0.1), (0.11, 0.08), (0.13, 0), (0.22, -0.02), (0.13, -0.015)], dark, (x - 0.27, y, z + 1.68), steps=24)
