"""Twelve scenes of what artists' files are made of: materials, textures, worlds and lamps that a renderer has to shade.

    python sample_scenes/make.py glassware --folder DIR

They are not kept as files: the tests make them, compare them with Cycles and throw them away. Each is small, and together they
have every lobe and most nodes that the reference tracer models.
"""

import math
from pathlib import Path

import bmesh
import bpy
import building as b
import nodes
import numpy as np
from building import distance_for, fresh_scene, state_camera

WIDTH, HEIGHT = 640, 360
# The height of glass above a table: where both lie in one plane, which a ray meets first is float32's chance.
CLEAR = 0.004


def _scene(name: str, eye, look_at, field_of_view: float = 40.0):
    scene = fresh_scene(name, WIDTH, HEIGHT)
    scene.cycles.use_denoising = False
    state_camera(scene, eye=eye, look_at=look_at, distance=distance_for(field_of_view, WIDTH))
    return scene


def _sheet(name: str, width: float, depth: float, material, location=(0, 0, 0), rotation=(0, 0, 0)):
    """A rectangle with a UV map, of many small faces."""
    grid = b.primitive(name, bmesh.ops.create_grid, x_segments=16, y_segments=16, size=0.5, calc_uvs=True)
    if not grid.uv_layers:
        _map_flat(grid)
    return b.place(name, grid, material, location, rotation, scale=(width, depth, 1))


def _map_flat(mesh) -> None:
    uv = mesh.uv_layers.new(name="UVMap")
    for loop in mesh.loops:
        corner = mesh.vertices[loop.vertex_index].co
        uv.data[loop.index].uv = corner.x + 0.5, corner.y + 0.5


# Materials that several scenes have.


def brushed_metal(name: str = "Brushed metal", code: str = "c9c4bc"):
    """Metal whose roughness and height are noise drawn out along one axis, and whose facets are stretched."""

    def shade(s):
        grain = s.add("TexNoise", {"Vector": s.place((2.0, 2.0, 60.0)), "Scale": 1.0, "Detail": 2.0}, "Fac")
        return s.principled(
            Base_Color=code,
            Metallic=1.0,
            Roughness=s.range(grain, 0.22, 0.42),
            Anisotropic=0.6,
            Normal=s.bump(grain, 0.15, 0.01),
        )

    return nodes.material(name, shade)


def coated_paint(name: str = "Coated paint", code: str = "a8231c"):
    """Paint of two tones by the angle, below a clear coat."""

    def shade(s):
        facing = s.add("LayerWeight", {"Blend": 0.35}, "Facing")
        flakes = s.add("TexVoronoi", {"Vector": s.place(), "Scale": 60.0}, "Color")
        base = s.mix(facing, code, "3b0d2a")
        return s.principled(
            Base_Color=s.mix(0.15, base, flakes, "SOFT_LIGHT"),
            Metallic=0.35,
            Roughness=0.38,
            Specular_Tint="ffd9c0",
            Coat_Weight=1.0,
            Coat_Roughness=0.04,
            Coat_IOR=1.6,
            Coat_Tint="fff2e0",
        )

    return nodes.material(name, shade)


def glass(name: str = "Glass", code: str = "f4fff8", roughness: float = 0.0, ior: float = 1.45):
    """Glass as a Principled surface that lets all light through."""
    return nodes.material(name, lambda s: s.principled(Base_Color=code, Roughness=roughness, IOR=ior, Transmission_Weight=1.0))


def concrete(name: str = "Concrete", code: str = "9a948c"):
    """Gray with spots, and rough to the touch."""

    def shade(s):
        noise = s.add("TexNoise", {"Vector": s.place(), "Scale": 6.0, "Detail": 4.0, "Roughness": 0.6}, "Fac")
        return s.principled(
            Base_Color=s.mix(noise, code, "6f6a64"), Roughness=0.85, Diffuse_Roughness=0.4, Normal=s.bump(noise, 0.6, 0.03)
        )

    return nodes.material(name, shade)


def boards(name: str = "Boards"):
    """Varnished wood: bands and noise to a ramp, a little bump, a glossy coat."""

    def shade(s):
        grain = s.add(
            "TexWave",
            {"Vector": s.place((1.0, 8.0, 8.0)), "Scale": 0.7, "Distortion": 4.0, "Detail": 2.0},
            "Fac",
            bands_direction="Y",
        )
        tone = s.ramp(grain, (0.0, "4a2a17"), (0.5, "8a5a33"), (1.0, "b98a55"))
        return s.principled(
            Base_Color=tone,
            Roughness=s.range(grain, 0.3, 0.55),
            Coat_Weight=0.4,
            Coat_Roughness=0.1,
            Normal=s.bump(grain, 0.1, 0.01),
        )

    return nodes.material(name, shade)


def bricks(name: str, scale: float, rotation=(0.0, 0.0, 0.0)):
    """Courses of bricks with mortar that lies back. rotation : in radians, from the wall to the xy plane."""

    def shade(s):
        words = {"Vector": s.place(rotation=rotation), "Color1": "9a4a35", "Color2": "7c3626", "Mortar": "b8b0a2"}
        words |= {"Scale": scale, "Mortar Size": 0.03}
        wall = s.add("TexBrick", words, "Color")
        joint = wall.node.outputs["Fac"]
        return s.principled(Base_Color=wall, Roughness=0.8, Normal=s.bump(s.math("SUBTRACT", 1.0, joint), 0.6, 0.02))

    return nodes.material(name, shade)


# The scenes.


def dressed_studio():
    """The studio still, with glass letters, a bust of coated paint on brushed metal, and an HDRI in place of its sky."""
    bpy.ops.wm.open_mainfile(filepath=str(Path(__file__).with_name("studio.blend")))
    scene = bpy.context.scene
    scene.name = "dressed_studio"
    scene.cycles.use_denoising = False
    metal, paint = brushed_metal(), coated_paint()
    for name, material in (
        ("Plinth", metal),
        ("Gate ring", metal),
        ("Suzanne", paint),
        ("Ball", paint),
        ("Virtual", glass()),
        ("Pinhole", glass("Frosted glass", "d8ecff", 0.25)),
        ("Small ball", glass("Heavy glass", "fff0e0", ior=1.7)),
    ):
        block = scene.objects[name]
        for slot in block.material_slots:
            slot.material = material
    nodes.environment(nodes.outdoors(sun=0.0), turn=40.0, strength=0.6)
    return scene


def perfume():
    """A product shot: a bottle with a label and a brushed cap on a seamless paper, between softboxes."""
    scene = _scene("perfume", (0.0, -5.2, 1.5), (0.0, 0.0, 0.85), 32.0)
    b.ground("Paper", 12, 12, b.matte("Paper", "e4dcd2"))
    bottle = [(0, 0), (0.55, 0), (0.6, 0.05), (0.6, 1.0), (0.5, 1.15), (0.2, 1.22), (0.2, 1.35), (0, 1.35)]
    b.turned("Bottle", bottle, glass(code="f6e6d0", ior=1.5), (0, 0, CLEAR))
    inside = [(0, 0.08), (0.5, 0.08), (0.53, 0.12), (0.53, 0.8), (0, 0.8)]
    b.turned("Scent", inside, glass("Scent", "f0b060", ior=1.36))
    b.turned("Cap", [(0, 1.35), (0.26, 1.35), (0.26, 1.75), (0.24, 1.78), (0, 1.78)], brushed_metal())
    image = nodes.label()

    def shade(s):
        return s.principled(Base_Color=s.add("TexImage", image=image), Roughness=0.45, Coat_Weight=0.6, Coat_Roughness=0.05)

    _sheet("Label", 0.5, 0.5, nodes.material("Label", shade), (0, -0.62, 0.5), (90, 0, 0))
    b.ball("Pearl", 0.22, b.glossy("Pearl", "efe2d8", 0.15), (-1.1, -0.4, 0.22))
    b.box("Box", (0.7, 0.7, 1.1), coated_paint("Lacquer", "1d2b4a"), (1.25, 0.35, 0), rotation=(0, 0, 24))
    b.softbox("Key", 120, "fff2e2", (-2.6, -1.6, 3.0), (0, 0, 0.6), 1.2, 1.8)
    b.softbox("Rim", 70, "dce8ff", (2.4, 1.8, 2.2), (0, 0, 0.8), 0.5, 1.6)
    b.sky("b8b4b0", 0.25)
    return scene


def roadster():
    """A product shot: toys of car paint, chrome and rubber under an HDRI of softboxes."""
    scene = _scene("roadster", (1.5, -5.0, 1.7), (0.0, 0.0, 0.4), 34.0)
    b.ground("Floor", 14, 14, b.glossy("Floor", "55585e", 0.25))
    paint = coated_paint()
    b.ball("Body", 0.55, paint, (0, 0, 0.55), scale=(1.9, 1.0, 0.75))
    b.ball("Cabin", 0.38, glass("Tinted glass", "4a5a60", 0.05), (0.05, 0, 0.95), scale=(1.3, 0.9, 0.6))
    rubber = nodes.material(
        "Rubber", lambda s: s.principled(Base_Color="1b1b1d", Roughness=0.7, Specular_IOR_Level=0.3, Diffuse_Roughness=0.8)
    )
    chrome = b.glossy("Chrome", "e8e8ec", 0.06, metallic=1.0)
    tire = [(0.12, -0.1), (0.3, -0.1), (0.33, -0.06), (0.33, 0.06), (0.3, 0.1), (0.12, 0.1), (0.12, -0.1)]
    hub = [(0, -0.11), (0.12, -0.12), (0.13, 0.12), (0, 0.11)]
    for number, (x, y) in enumerate([(x, y) for x in (-0.65, 0.65) for y in (-0.5, 0.5)], 1):
        b.turned(f"Tyre {number}", tire, rubber, (x, y, 0.33), steps=48, rotation=(90, 0, 0))
        b.turned(f"Hub {number}", hub, chrome, (x, y, 0.33), steps=48, rotation=(90, 0, 0))
    nodes.environment(nodes.studio_lights(), turn=70.0)
    return scene


def interior():
    """A room of boards and bricks, lit through a glazed window by the sky and by a lamp under a shade."""
    scene = _scene("interior", (0.0, -3.6, 1.5), (0.2, 1.0, 1.1), 62.0)
    _sheet("Floor", 6, 8, boards(), (0, 0, 0))
    _sheet("Ceiling", 6, 8, b.matte("Ceiling", "e8e4dc"), (0, 0, 2.8), (180, 0, 0))
    _sheet("Back wall", 6, 2.8, bricks("Bricks", 6.0), (0, 2.6, 1.4), (90, 0, 0))
    _sheet("Right wall", 8, 2.8, b.matte("Plaster", "d8cdb8"), (2.6, 0, 1.4), (90, 0, -90))
    for number, (width, height, y, z) in enumerate(
        [(4, 2.8, -2, 1.4), (1, 2.8, 2.5, 1.4), (2, 0.8, 1, 0.4), (2, 0.5, 1, 2.55)], 1
    ):
        _sheet(f"Left wall {number}", width, height, b.matte(f"Wall {number}", "c8c0b0"), (-2.6, y, z), (90, 0, 90))
    pane = nodes.material(
        "Pane",
        lambda s: s.mix_shaders(
            s.add("Fresnel", {"IOR": 1.45}),
            s.add("BsdfTransparent", {"Color": "f2fbf6"}),
            s.add("BsdfGlossy", {"Color": "ffffff", "Roughness": 0.1}),
        ),
    )
    _sheet("Pane", 2, 1.5, pane, (-2.6, 1, 1.55), (90, 0, 90))
    b.box("Table", (1.4, 0.8, 0.08), boards("Table top"), (0.6, 1.2, 0.7))
    for number, (x, y) in enumerate([(x, y) for x in (0.0, 1.2) for y in (0.9, 1.5)], 1):
        b.box(f"Leg {number}", (0.06, 0.06, 0.7), brushed_metal(f"Leg {number}"), (x, y, 0))
    b.turned(
        "Vase", [(0, 0), (0.1, 0), (0.16, 0.17), (0.07, 0.37), (0.1, 0.47)], glass(code="cfe6ff"), (0.35, 1.2, 0.78 + CLEAR)
    )
    shade = nodes.material(
        "Paper shade",
        lambda s: s.mix_shaders(0.5, s.add("BsdfTranslucent", {"Color": "f0dcb8"}), s.add("BsdfDiffuse", {"Color": "f0dcb8"})),
    )
    b.turned("Shade", [(0.16, 0), (0.26, -0.3)], shade, (0.9, 1.2, 1.9))
    lamp = bpy.data.lights.new("Bulb", "POINT")
    lamp.energy, lamp.color, lamp.shadow_soft_size = 25, (1.0, 0.75, 0.45), 0.06
    b.place("Bulb", lamp, location=(0.9, 1.2, 1.7))
    nodes.environment(nodes.outdoors(sun=60.0, elevation=30.0, bearing=0.5, width=6.0), turn=180.0, strength=2.5)
    return scene


def street():
    """A street under an HDRI with a sun: bricks, instances of windows, asphalt with puddles, a sign that is cut out."""
    scene = _scene("street", (0.6, -7.0, 1.7), (0.0, 4.0, 2.0), 58.0)

    def asphalt(s):
        noise = s.add("TexNoise", {"Vector": s.place(), "Scale": 0.5, "Detail": 2.0}, "Fac")
        wet = s.ramp(noise, (0.42, "000000"), (0.56, "ffffff"))
        grit = s.add("TexNoise", {"Vector": s.place(), "Scale": 18.0, "Detail": 1.0}, "Fac")
        return s.principled(
            Base_Color=s.mix(wet, "3a3b3e", "1a1b1d"),
            Roughness=s.range(wet, 0.75, 0.12),
            Normal=s.bump(grit, s.range(wet, 0.4, 0.02), 0.03),
        )

    _sheet("Road", 12, 40, nodes.material("Asphalt", asphalt), (0, 8, 0))
    for side in (-1, 1):
        b.box(
            f"House {side}",
            (3.0, 24.0, 6.0),
            bricks(f"Bricks {side}", 1.2, (math.pi / 2, math.pi / 2, 0.0)),
            (4.2 * side, 8.0, 0),
            bevel=0.0,
            pieces=8,
        )
        b.box(f"Kerb {side}", (0.9, 24.0, 0.14), concrete(f"Kerb {side}"), (2.4 * side, 8.0, 0), pieces=4)
    kit = b.kit("Window kit")
    b.box("Pane", (0.04, 1.0, 1.3), b.glossy("Window", "20282e", 0.05), (0, 0, 0), bevel=0.0, into=kit)
    b.box("Sill", (0.2, 1.2, 0.1), concrete("Sill"), (0, 0, -0.1), into=kit)
    for number in range(20):
        side, row, floor = (-1, 1)[number % 2], number // 4, number // 2 % 2
        b.instance(f"Window {number}", kit, (2.68 * side, 1.0 + 3.2 * row, 1.3 + 2.4 * floor))
    image = nodes.leaf()

    def sign(s):
        texture = s.add("TexImage", output="Color", image=image, extension="CLIP")
        return s.principled(Base_Color=texture, Roughness=0.4, Alpha=texture.node.outputs["Alpha"])

    _sheet("Sign", 1.1, 1.1, nodes.material("Sign", sign), (-1.5, 1.0, 2.6), (90, 0, 15))
    post = brushed_metal("Post")
    b.turned("Post", [(0, 0), (0.05, 0), (0.05, 3.2), (0, 3.2)], post, (-1.5, 1.05, 0), steps=24)
    b.ball("Bollard", 0.3, coated_paint("Bollard", "c87a1a"), (1.3, -1.0, 0.3))
    nodes.environment(nodes.outdoors(sun=900.0, elevation=48.0, bearing=0.28), turn=-20.0)
    return scene


def foliage():
    """Instances of leaves that are cut out by their alpha and let light through, under a sun."""
    scene = _scene("foliage", (0.0, -4.5, 1.6), (0.0, 0.0, 0.9), 40.0)
    _sheet("Ground", 10, 10, concrete("Earth", "6b5238"), (0, 0, 0))
    image = nodes.leaf()

    def shade(s):
        texture = s.add("TexImage", output="Color", image=image, extension="CLIP")
        tint = s.add("HueSaturation", {"Hue": 0.52, "Saturation": 1.1, "Value": 1.2, "Color": texture})
        thin = s.mix_shaders(0.4, s.principled(Base_Color=tint, Roughness=0.4), s.add("BsdfTranslucent", {"Color": tint}))
        return s.mix_shaders(texture.node.outputs["Alpha"], s.add("BsdfTransparent"), thin)

    kit = b.kit("Leaf kit")
    leaf = _sheet("Leaf", 0.5, 0.7, nodes.material("Leaf", shade), (0, 0.3, 0))
    bpy.context.scene.collection.objects.unlink(leaf)
    kit.objects.link(leaf)
    random = np.random.default_rng(3)
    for number in range(60):
        angle, height = 2.399963 * number, 0.3 + 1.5 * number / 60
        reach = 0.55 * math.sin(math.pi * (0.15 + 0.8 * number / 60))
        turn = (random.uniform(-50, 30), random.uniform(-30, 30), math.degrees(angle) - 90)
        b.instance(f"Leaf {number}", kit, (reach * math.cos(angle), reach * math.sin(angle), height), turn)
    b.turned("Trunk", [(0.1, 0), (0.06, 1.2), (0.03, 1.8)], boards("Bark"), steps=24)
    b.sun(4.0, "ffe8c4", 42, 230, angle=2.0)
    b.sky("9fc0e8", 0.6)
    return scene


def fairground():
    """Sixty lamps of all kinds over a floor with a normal map: more than a renderer asks one by one."""
    scene = _scene("fairground", (0.0, -6.0, 2.4), (0.0, 0.5, 0.5), 46.0)
    image = nodes.normals(3, 0.25)

    def tiles(s):
        wide = s.add("Mapping", {"Vector": s.add("TexCoord", output="UV"), "Scale": (6.0, 6.0, 1.0)})
        normal = s.add("NormalMap", {"Color": s.add("TexImage", {"Vector": wide}, image=image), "Strength": 0.7})
        checks = s.add("TexChecker", {"Vector": wide, "Color1": "6d6f78", "Color2": "2a2c34", "Scale": 2.0}, "Color")
        return s.principled(Base_Color=checks, Roughness=0.35, Normal=normal)

    _sheet("Floor", 10, 10, nodes.material("Tiles", tiles), (0, 1, 0))
    b.suzanne("Suzanne", b.glossy("Glaze", "d8d2c8", 0.3), (0, 0.4, 0.75), (0, 0, -15), 0.7)
    random = np.random.default_rng(5)
    for number in range(60):
        kind = ("POINT", "SPOT", "AREA")[number % 3]
        lamp = bpy.data.lights.new(f"Lamp {number}", kind)
        lamp.energy = 6.0 if kind != "SPOT" else 25.0
        lamp.color = random.uniform(0.2, 1.0, 3)
        if kind == "AREA":
            lamp.shape, lamp.size, lamp.size_y = ("DISK", "RECTANGLE")[number // 3 % 2], 0.3, 0.15
        else:
            lamp.shadow_soft_size = 0.05
        angle = 2.399963 * number
        reach = 0.7 + 3.0 * math.sqrt(number / 60)
        place = (reach * math.cos(angle), 0.8 + reach * math.sin(angle), 0.6 + 1.4 * random.random())
        b.place(lamp.name, lamp, location=place, rotation=(random.uniform(-25, 25), random.uniform(-25, 25), 0))
    b.sky("0c1020", 0.3)
    return scene


def toys():
    """Toys painted by vertices, through a Gaussian filter, under spots."""
    scene = _scene("toys", (0.0, -5.0, 2.0), (0.0, 0.0, 0.5), 38.0)
    scene.cycles.pixel_filter_type = "GAUSSIAN"

    def painted(s):
        paint = s.add("VertexColor", output="Color", layer_name="Paint")
        faded = s.add("Gamma", {"Color": paint, "Gamma": 1.3})
        return s.principled(
            Base_Color=s.mix(0.25, faded, "f4e8d0", "OVERLAY"), Roughness=0.3, Specular_IOR_Level=0.7, Coat_Weight=0.3
        )

    paint = nodes.material("Painted", painted)
    for number, (x, y, size) in enumerate([(-1.2, 0.2, 0.5), (0.1, 0.0, 0.6), (1.3, 0.4, 0.45)], 1):
        toy = b.suzanne(f"Toy {number}", paint, (x, y, size), (0, 0, 20 * number - 40), size)
        colors = toy.data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
        for vertex, each in zip(toy.data.vertices, colors.data, strict=True):
            each.color = (*(0.5 + 0.5 * math.cos(3 * value + number) for value in vertex.co), 1.0)
        toy.data.color_attributes.active_color = colors
    _sheet("Shelf", 8, 6, boards("Shelf"), (0, 0, 0))
    _sheet("Wall", 8, 4, concrete("Wall", "c8c4d0"), (0, 1.6, 1.5), (90, 0, 0))
    for number, (x, code) in enumerate([(-2.0, "ffd8a8"), (2.2, "a8d0ff")], 1):
        lamp = bpy.data.lights.new(f"Spot {number}", "SPOT")
        lamp.energy, lamp.spot_size, lamp.spot_blend, lamp.shadow_soft_size = 400, math.radians(55), 0.4, 0.15
        lamp.color = b.color(code)[:3]
        b.place(f"Spot {number}", lamp, location=(x, -2.6, 3.0), rotation=(48, 0, math.degrees(math.atan2(x, 2.6))))
    b.sky("404858", 0.4)
    return scene


def gallery():
    """Balls of procedural textures on a marble slab."""
    scene = _scene("gallery", (0.0, -6.4, 2.6), (0.0, 0.3, 0.6), 40.0)

    def marble(s):
        veins = s.add(
            "TexWave", {"Vector": s.place(), "Scale": 0.9, "Distortion": 8.0, "Detail": 3.0, "Detail Scale": 1.3}, "Fac"
        )
        return s.principled(Base_Color=s.ramp(veins, (0.0, "e9e6e0"), (0.8, "d2cdc6"), (1.0, "6a6a70")), Roughness=0.15)

    def magic(s):
        return s.add("TexMagic", {"Vector": s.place(), "Scale": 2.0, "Distortion": 1.5}, "Color", turbulence_depth=3)

    def cells(s):
        edge = s.add("TexVoronoi", {"Vector": s.place(), "Scale": 4.0}, "Distance", feature="DISTANCE_TO_EDGE")
        return s.ramp(edge, (0.0, "1d2430"), (0.06, "2a6f8f"), (0.3, "e8d8a0"))

    def rust(s):
        noise = s.add("TexNoise", {"Vector": s.place(), "Scale": 3.0, "Detail": 5.0, "Roughness": 0.65}, "Color")
        return s.add("BrightContrast", {"Color": s.mix(0.7, noise, "b05a2c", "MULTIPLY"), "Bright": 0.2, "Contrast": 0.3})

    def sunset(s):
        fall = s.add("TexGradient", {"Vector": s.place((1, 1, 1), (0, math.pi / 2, 0))}, gradient_type="EASING")
        return s.ramp(fall, (0.0, "2b1b50"), (0.4, "c84b5a"), (0.8, "ffd27a"), interpolation="EASE")

    def static(s):
        where = s.add("VectorMath", {"Vector": s.place((6, 6, 6))}, operation="FLOOR")
        return s.add("Invert", {"Color": s.add("TexWhiteNoise", {"Vector": where}, "Color"), "Fac": 0.3})

    _sheet("Slab", 9, 6, nodes.material("Marble", marble), (0, 0, 0))
    for number, make in enumerate((magic, cells, rust, sunset, static)):
        material = nodes.material(make.__name__, lambda s, make=make: s.principled(Base_Color=make(s), Roughness=0.5))
        b.ball(make.__name__, 0.5, material, (1.15 * number - 2.3, 0.5 * (number % 2), 0.5))
    rough = nodes.material(
        "Rough", lambda s: s.add("BsdfDiffuse", {"Color": s.add("Blackbody", {"Temperature": 4200.0}), "Roughness": 0.8})
    )
    b.ball("Clay", 0.28, rough, (0.0, -0.9, 0.28))
    b.sun(2.6, "fff4e0", 46, 150, angle=4.0)
    b.softbox("Fill", 120, "cfe0ff", (3.0, -3.0, 3.5), (0, 0, 0.5), 2.0, 2.0)
    b.sky("c8d0d8", 0.4)
    return scene


def glassware():
    """Clear, frosted and tinted glass of each kind of node, before a striped wall."""
    scene = _scene("glassware", (0.0, -5.6, 1.5), (0.0, 0.0, 0.7), 36.0)
    stripes = nodes.material(
        "Stripes",
        lambda s: s.add(
            "BsdfDiffuse",
            {
                "Color": s.add(
                    "TexChecker", {"Vector": s.place(), "Color1": "e8e4da", "Color2": "4a6a7a", "Scale": 8.0}, "Color"
                )
            },
        ),
    )

    def cloth(s):
        return s.principled(Base_Color="b8b0a4", Roughness=0.9, Sheen_Weight=0.6, Sheen_Roughness=0.4, Sheen_Tint="ffe8d0")

    _sheet("Wall", 8, 4, stripes, (0, 1.8, 2.0), (90, 0, 0))
    _sheet("Table", 8, 6, nodes.material("Cloth", cloth), (0, 0, 0))
    glasses = {
        "Clear": lambda s: s.add("BsdfGlass", {"Color": "ffffff", "Roughness": 0.0, "IOR": 1.5}),
        "Frosted": lambda s: s.add("BsdfGlass", {"Color": "e8fff4", "Roughness": 0.3, "IOR": 1.45}, distribution="MULTI_GGX"),
        "Ruby": lambda s: s.add("BsdfGlass", {"Color": "d8485a", "Roughness": 0.15, "IOR": 1.76}, distribution="GGX"),
        "Bent": lambda s: s.add("BsdfRefraction", {"Color": "fff0d0", "Roughness": 0.2, "IOR": 1.33}, distribution="BECKMANN"),
    }
    goblet = [
        (0, 0),
        (0.3, 0),
        (0.3, 0.03),
        (0.05, 0.08),
        (0.05, 0.5),
        (0.3, 0.75),
        (0.34, 1.2),
        (0.3, 1.2),
        (0.26, 0.8),
        (0, 0.56),
    ]
    for number, (name, shade) in enumerate(glasses.items()):
        b.turned(name, goblet, nodes.material(name, shade), (1.0 * number - 1.5, 0, CLEAR), steps=48)
    b.ball(
        "Half glass",
        0.24,
        nodes.material(
            "Half glass", lambda s: s.principled(Base_Color="a0c8e8", Transmission_Weight=0.5, Roughness=0.1, IOR=1.5)
        ),
        (0.1, -1.0, 0.24),
    )
    b.softbox("Key", 150, "fff4e4", (-2.5, -2.0, 3.2), (0, 0, 0.6), 2.2, 2.2)
    b.sky("98a8b8", 0.5)
    return scene


def metals():
    """Balls of metals by every distribution and Fresnel law, under the softboxes of an HDRI."""
    scene = _scene("metals", (0.0, -6.2, 2.0), (0.0, 0.0, 0.55), 38.0)
    b.ground("Floor", 14, 14, concrete("Floor", "6c6e72"))
    makes = {
        "Gold": lambda s: s.add("BsdfGlossy", {"Color": "ffd070", "Roughness": 0.25}, distribution="MULTI_GGX"),
        "Copper": lambda s: s.add("BsdfGlossy", {"Color": "e09a78", "Roughness": 0.4}, distribution="BECKMANN"),
        "Steel": lambda s: s.principled(Base_Color="b8bcc4", Metallic=1.0, Roughness=0.3, Specular_Tint="ffb0a0"),
        "Half": lambda s: s.principled(Base_Color="6a8a5a", Metallic=0.5, Roughness=0.2, Specular_Tint="c0d0ff"),
    }
    if bpy.app.version >= (4, 3):
        makes |= {
            "Titanium": lambda s: s.add(
                "BsdfMetallic", {"Base Color": "9a8f88", "Edge Tint": "d8e0ff", "Roughness": 0.35}, fresnel_type="F82"
            ),
            "Silver": lambda s: s.add(
                "BsdfMetallic",
                {"IOR": (0.05, 0.06, 0.05), "Extinction": (4.2, 3.4, 2.3), "Roughness": 0.2},
                fresnel_type="PHYSICAL_CONDUCTOR",
            ),
        }
    makes["Brushed"] = None
    for number, (name, shade) in enumerate(makes.items()):
        material = nodes.material(name, shade) if shade else brushed_metal()
        b.ball(name, 0.42, material, (1.0 * number - (len(makes) - 1) / 2, 0.3 * (number % 2), 0.42))
    nodes.environment(nodes.studio_lights(), turn=-30.0, strength=1.5)
    return scene


def backdrop():
    """A portrait before a backdrop that only the camera sees, lit by an HDRI and by a neon tube that shines."""
    scene = _scene("backdrop", (0.0, -4.2, 1.2), (0.0, 0.0, 0.8), 40.0)
    b.ground("Stage", 8, 8, b.glossy("Stage", "3a3038", 0.2))
    skin = nodes.material(
        "Skin",
        lambda s: s.principled(
            Base_Color=s.mix(s.add("LayerWeight", {"Blend": 0.6}, "Fresnel"), "c08a70", "f0c8a8"),
            Roughness=0.42,
            Specular_Tint="ffd8c8",
            IOR=1.4,
            Emission_Color="ff4020",
            Emission_Strength=0.02,
        ),
    )
    b.suzanne("Sitter", skin, (0, 0, 0.85), (0, 0, 12), 0.75)
    tube = nodes.material(
        "Neon",
        lambda s: s.add(
            "AddShader",
            {
                "Shader": s.add("Emission", {"Color": "ff50a0", "Strength": 6.0}),
                "Shader_001": s.add("BsdfDiffuse", {"Color": "301020"}),
            },
        ),
    )
    b.turned("Tube", [(0, -0.6), (0.04, -0.6), (0.04, 0.6), (0, 0.6)], tube, (-1.15, 0.2, 0.95), steps=12, rotation=(0, 12, 0))
    image = nodes.outdoors(sun=150.0, elevation=25.0, bearing=0.1, width=5.0)

    def surround(s):
        light = s.add("Background", {"Color": s.add("TexEnvironment", image=image), "Strength": 0.8})
        seen = s.add("Background", {"Color": "5a7a8a", "Strength": 0.7})
        return s.mix_shaders(s.add("LightPath", output="Is Camera Ray"), light, seen)

    nodes.world(surround)
    return scene


BUILDERS = {
    build.__name__: build
    for build in (
        *(dressed_studio, perfume, roadster, interior, street, foliage),
        *(fairground, toys, gallery, glassware, metals, backdrop),
    )
}
