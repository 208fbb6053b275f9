"""A flight of 48 frames through gates in the sea: eye and look-at are animated, up and d stand still.

The eye follows a winding line through the gates, and the look-at point runs ahead of it on the same line, then rises to
the mountain.
"""

import math

import bmesh
import bpy
import building as b
from building import fresh_scene, state_camera
from nodes import Nodes, use_nodes

FRAMES, GATES, GATE_STEP = 48, 7, 7.0


def build():
    """The scene of flight.blend."""
    scene = fresh_scene("flight", 960, 540)
    scene.frame_start, scene.frame_end = 1, FRAMES
    b.ground("Sea", 700, 700, b.glossy("Sea", "2b6f86", roughness=0.16), (0, 250, 0))
    gates()
    islands()
    mountain()
    b.sun(6.5, "ffc98f", elevation=19, azimuth=298, angle=0.8)
    b.sky("f6c4a8", 1.05)
    eye, look_at = pose(0.0)
    camera = state_camera(scene, eye, look_at, distance=620.0)
    animate(camera)
    return scene


def course(y: float) -> tuple[float, float]:
    """The winding line through the gates: its x and its direction at y."""
    return 3.4 * math.sin(y / 11.0), 3.4 / 11.0 * math.cos(y / 11.0)


def pose(time: float):
    """Eye and look-at point at a time from 0 to 1."""
    y = -13.0 + 52.0 * time
    ahead, climb = y + 11.0, max(0.0, time - 0.6) / 0.4
    eye = (course(y)[0], y, 1.5 + 0.5 * math.sin(6.0 * time) + 3.2 * climb**2)
    return eye, (course(ahead)[0] * (1 - climb) + 2.0 * climb, ahead + 20 * climb, 1.9 + 2.4 * climb)


def animate(camera) -> None:
    """Keyframes on the stated values, every eighth of the flight."""
    state = camera.virtual_pinhole
    for step in range(9):
        state.eye, state.look_at = pose(step / 8)
        frame = 1 + round((FRAMES - 1) * step / 8)
        state.keyframe_insert("eye", frame=frame)
        state.keyframe_insert("look_at", frame=frame)
    bpy.context.scene.frame_set(1)


def gates():
    """Vermilion gates across the course, instances of one collection."""
    kit = b.kit("Gate kit")
    vermilion, black = b.matte("Vermilion", "d8432b"), b.matte("Black lacquer", "2a2022")
    for side in (-1, 1):
        post = [(0, -1.5), (0.2, -1.5), (0.2, 0.0), (0.16, 3.6), (0, 3.6)]
        b.turned(f"Post {side}", post, vermilion, (1.55 * side, 0, 0), steps=32, rotation=(0, -2.5 * side, 0), into=kit)
        b.turned(f"Foot {side}", [(0.23, -1.5), (0.25, 0.42), (0.2, 0.46)], black, (1.56 * side, 0, 0), steps=32, into=kit)
    b.box("Tie", (3.9, 0.2, 0.26), vermilion, (0, 0, 2.75), bevel=0.02, into=kit)
    b.box("Strut", (0.26, 0.14, 0.5), vermilion, (0, 0, 3.02), bevel=0.02, into=kit)
    b.place("Lintel", _swept_beam("Lintel", 2.35, 0.3, 0.3), vermilion, (0, 0, 3.5), into=kit)
    b.place("Roof", _swept_beam("Roof", 2.55, 0.46, 0.16), black, (0, 0, 3.8), into=kit)
    for number in range(GATES):
        y = GATE_STEP * number - 6.0
        x, slant = course(y)
        b.instance(f"Gate {number + 1}", kit, (x, y, 0), (0, 0, -math.degrees(math.atan(slant))))


def _swept_beam(name: str, half: float, depth: float, height: float, segments: int = 24):
    """A beam whose ends sweep upwards."""
    vertices, faces = [], []
    for i in range(segments + 1):
        x = half * (2 * i / segments - 1)
        z = 0.3 * (abs(x) / half) ** 2.6
        vertices += [(x, -depth / 2, z), (x, depth / 2, z), (x, depth / 2, z + height), (x, -depth / 2, z + height)]
    for i in range(segments):
        a, c = 4 * i, 4 * i + 4
        faces += [(a + k, a + (k + 1) % 4, c + (k + 1) % 4, c + k) for k in range(4)]
    return b.mesh(name, vertices, [*faces, (3, 2, 1, 0), range(4 * segments, 4 * segments + 4)])


def islands():
    """Rocky islets with bent pines and a few stones in the water."""
    kit = b.kit("Pine kit")
    needles, bark = b.matte("Needles", "2f6048"), b.matte("Bark", "5b4032")
    trunk = [(0, 0), (0.16, 0), (0.1, 0.8), (0.06, 2.0), (0, 2.0)]
    b.turned("Trunk", trunk, bark, steps=16, into=kit)
    for number, (x, y, z, size) in enumerate([(0.45, 0, 1.1, 0.62), (-0.4, 0.15, 1.5, 0.7), (0.1, -0.1, 2.05, 0.55)], 1):
        b.ball(f"Cushion {number}", size, needles, (x, y, z), scale=(1.25, 1.0, 0.38), into=kit)
    group = _island(kit)
    rock, moss = b.matte("Rock", "8c7468"), b.matte("Moss", "7f9656")
    spots = [(-8, -2, 3.2), (9.5, 6, 4.2), (-7.5, 15, 2.6), (11, 24, 3.4), (-9, 33, 4.6), (8.5, 42, 3.0), (-15, 50, 5.5)]
    spots += [(16, 58, 6.5)]
    for number, (x, y, size) in enumerate(spots, 1):
        islet = b.place(f"Islet {number}", b.mesh(f"Islet {number}", []), rock, location=(x, y, -0.25))
        use_nodes(islet, group, size=size, seed=number, rock=rock, moss=moss)


def _island(kit):
    """A dome roughened by noise, mossy on top, with pines."""
    nodes = Nodes("Islet")
    size, seed = nodes.parameter("Size", "Float", 3.0), nodes.parameter("Seed", "Int", 1)
    rock, moss = nodes.parameter("Rock", "Material"), nodes.parameter("Moss", "Material")
    shape = nodes.add("GeometryNodeMeshIcoSphere", {"Radius": 1.0, "Subdivisions": 6})
    x, y, z = nodes.separate(nodes.add("GeometryNodeInputPosition"))
    noise = nodes.add(
        "ShaderNodeTexNoise", {"W": seed, "Scale": 1.7, "Detail": 4.0, "Roughness": 0.55}, "Fac", noise_dimensions="4D"
    )
    bulk = nodes.math("MULTIPLY", nodes.ramp(noise, 0.2, 0.8, 0.55, 1.35), size)
    x, y = nodes.math("MULTIPLY", x, bulk), nodes.math("MULTIPLY", y, bulk)
    z = nodes.math("MULTIPLY", nodes.math("MULTIPLY", z, bulk), 0.42)
    land = nodes.add("GeometryNodeSetPosition", {"Geometry": shape, "Position": nodes.vector(x, y, z)})
    land = nodes.add("GeometryNodeSetMaterial", {"Geometry": land, "Material": rock})
    upward = nodes.separate(nodes.add("GeometryNodeInputNormal"))[2]
    is_top = nodes.math("GREATER_THAN", upward, 0.8)
    land = nodes.add("GeometryNodeSetMaterial", {"Geometry": land, "Selection": is_top, "Material": moss})
    points = {"Mesh": land, "Selection": is_top, "Distance Min": 1.3, "Density Max": 0.5, "Seed": seed}
    points = nodes.add("GeometryNodeDistributePointsOnFaces", points, "Points", distribute_method="POISSON")
    pines = nodes.add("GeometryNodeCollectionInfo", {"Collection": kit})
    turn = nodes.vector(nodes.random(-0.12, 0.12, 4), nodes.random(-0.12, 0.12, 6), nodes.random(0.0, 6.283, 8))
    trees = {"Points": points, "Instance": pines, "Rotation": turn, "Scale": nodes.random(0.6, 1.15, 10)}
    return nodes.finish(nodes.join(land, nodes.add("GeometryNodeInstanceOnPoints", trees)))


def mountain():
    """A far volcano with snow, lower hills, and the disc of the sun beside it."""
    profile = [(0, 62), (6, 61), (8, 62.5), (14, 52), (26, 38), (44, 23), (70, 10), (105, 2), (130, -1)]
    b.turned("Volcano", profile, b.matte("Volcano", "7f8fb0"), (22, 330, 0), steps=96)
    snow = [(0, 62.4), (6, 61.4), (8, 62.9), (14.3, 52.4), (21, 44)]
    b.turned("Snow", snow, b.matte("Snow", "fdf3ee"), (22, 330, 0), steps=96)
    hills = b.matte("Far hills", "9a93a8")
    for number, (x, y, width, height) in enumerate(
        [(-120, 300, 70, 16), (-60, 320, 60, 11), (130, 290, 80, 14), (190, 280, 60, 20)], 1
    ):
        b.ball(f"Far hill {number}", 1.0, hills, (x, y, 0), scale=(width, 20, height))
    disc = b.primitive("Sun disc", bmesh.ops.create_circle, cap_ends=True, segments=128, radius=24)
    b.place("Sun disc", disc, b.glowing("Sun disc", "ff7a4f", 1.6), (-62, 345, 42), (90, 0, 0))
