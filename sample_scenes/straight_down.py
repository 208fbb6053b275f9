"""Breakfast for two, seen from exactly above: the view is parallel to up, and the axes become the canonical ones.

The eye stands over the look-at point and up is (0, 0, 1), so that u does not exist by its formula. The picture's right is
−y and its top is +x, on every machine.
"""

import math

import building as b
from building import fresh_scene, state_camera
from nodes import Nodes, use_nodes

TABLE_HEIGHT = 0.74
HALF_FORK = [(-0.09, 0.006), (-0.02, 0.0035), (0.02, 0.004), (0.035, 0.012), (0.085, 0.0125), (0.085, 0.0085), (0.045, 0.0075)]
HALF_FORK += [(0.045, 0.0045), (0.085, 0.0022)]
FORK = [*((x, -y) for x, y in HALF_FORK), *reversed(HALF_FORK)]
KNIFE = [(-0.1, -0.006), (-0.01, -0.006), (0.0, -0.0085), (0.07, -0.0085), (0.1, -0.002), (0.1, 0.002), (0.09, 0.006)]
KNIFE += [(-0.1, 0.006)]


def build():
    """The scene of straight_down.blend."""
    scene = fresh_scene("straight_down", 960, 960)
    floor()
    table(b.matte("Linen", "ece3d2"), b.matte("Table edge", "8a5a3c"))
    china, glaze = b.glossy("China", "f4efe6", 0.25), b.glossy("Blue glaze", "355f8d", 0.2)
    settings(china, glaze)
    middle(china, glaze)
    b.sun(4.6, "ffe0b5", elevation=36, azimuth=118, angle=1.2)
    b.softbox("Window", 30, "bcd3ff", (-1.8, 1.0, 2.2), (0, 0, TABLE_HEIGHT), 1.2, 1.2)
    b.sky("b9cdea", 0.5)
    state_camera(scene, eye=(0, 0, 3.6), look_at=(0, 0, TABLE_HEIGHT), distance=1587.0)
    return scene


def floor():
    """Tiles of two colors in a checker, laid by geometry nodes."""
    tile = b.box("Tile", (0.298, 0.298, 0.02), b.matte("Unglazed", "c9b79a"), (0, 0, -0.02), bevel=0.004)
    tile.hide_render = tile.hide_viewport = True
    group = _tiles(tile)
    for name, code, offset in [("Light tiles", "d9c3a0", 0), ("Dark tiles", "7d9488", 1)]:
        material = b.matte(name, code)
        use_nodes(b.place(name, b.mesh(name, []), material), group, odd=offset, material=material)
    b.ground("Grout", 6, 6, b.matte("Grout", "b5a68c"), (0, 0, -0.004))


def _tiles(tile):
    nodes = Nodes("Chequered tiles")
    odd, material = nodes.parameter("Odd", "Int", 0), nodes.parameter("Material", "Material")
    grid = {"Size X": 3.3, "Size Y": 3.3, "Vertices X": 12, "Vertices Y": 12}
    corners = nodes.add("GeometryNodeMeshGrid", grid)
    index = nodes.add("GeometryNodeInputIndex")
    parity = nodes.math("ADD", nodes.math("FLOOR", nodes.math("DIVIDE", index, 12.0)), nodes.math("ADD", index, odd))
    chosen = nodes.math("FLOORED_MODULO", parity, 2.0)
    shape = nodes.add("GeometryNodeObjectInfo", {"Object": tile, "As Instance": False}, "Geometry")
    shape = nodes.add("GeometryNodeSetMaterial", {"Geometry": shape, "Material": material})
    instances = {"Points": corners, "Selection": chosen, "Instance": shape}
    return nodes.finish(nodes.add("GeometryNodeInstanceOnPoints", instances))


def table(linen, edge):
    """A round table with a cloth that hangs in folds."""
    b.turned("Table", [(0, 0.70), (0.78, 0.70), (0.8, 0.72), (0.78, 0.735), (0, 0.735)], edge, steps=96)
    b.turned("Foot", [(0, 0), (0.3, 0), (0.28, 0.04), (0.05, 0.08), (0.05, 0.7)], edge)
    rings, spokes = 20, 132
    vertices = [(0, 0, TABLE_HEIGHT)]
    for ring in range(1, rings + 1):
        for spoke in range(spokes):
            angle, run = 2 * math.pi * spoke / spokes, 0.98 * ring / rings
            hang = max(0.0, run - 0.8)
            fold = 0.5 * hang * math.sin(11 * angle) * min(1, hang / 0.08)
            radius = min(run, 0.8) + 0.36 * hang + fold
            vertices.append((radius * math.cos(angle), radius * math.sin(angle), TABLE_HEIGHT - 0.93 * hang))
    faces = [(0, 1 + s, 1 + (s + 1) % spokes) for s in range(spokes)]
    for ring in range(rings - 1):
        for s in range(spokes):
            here, there = 1 + ring * spokes, 1 + (ring + 1) * spokes
            faces.append((here + s, there + s, there + (s + 1) % spokes, here + (s + 1) % spokes))
    b.place("Tablecloth", b.mesh("Tablecloth", vertices, faces, smooth=True), linen)


def settings(china, glaze):
    """A plate with a bowl of yoghurt, a cup of coffee, a fork on a napkin and a knife, for each of the two."""
    kit = b.kit("Setting")
    middle, top = 0.47, TABLE_HEIGHT
    steel = b.glossy("Steel", "d7d3cc", 0.28, metallic=1.0)
    plate = [(0, 0), (0.09, 0), (0.1, 0.006), (0.168, 0.02), (0.17, 0.023), (0.165, 0.024), (0.1, 0.012), (0, 0.01)]
    rim = [(0.152, 0.0225), (0.157, 0.0265), (0.163, 0.0265), (0.166, 0.0235)]
    bowl = [(0, 0.014), (0.05, 0.014), (0.085, 0.035), (0.1, 0.062), (0.098, 0.065), (0.093, 0.062), (0.07, 0.034), (0, 0.024)]
    yoghurt = [(0, 0.056), (0.04, 0.055), (0.075, 0.052), (0.09, 0.05)]
    saucer = [(0, 0.002), (0.045, 0.002), (0.078, 0.014), (0.08, 0.017), (0.076, 0.017), (0.045, 0.006), (0, 0.006)]
    cup = [(0, 0.008), (0.026, 0.008), (0.04, 0.03), (0.044, 0.062), (0.042, 0.064), (0.039, 0.06), (0.035, 0.03), (0, 0.016)]
    white, brown = b.glossy("Yoghurt", "fbf6ec", 0.3), b.glossy("Coffee", "4a2814", 0.08)
    here, there = (middle, 0, top), (middle - 0.13, -0.29, top)
    for name, profile, material, spot in [
        ("Plate", plate, china, here),
        ("Plate rim", rim, glaze, here),
        ("Bowl", bowl, glaze, here),
        ("Yoghurt", yoghurt, white, here),
        ("Saucer", saucer, glaze, there),
        ("Cup", cup, china, there),
        ("Coffee", [(0, 0.054), (0.0405, 0.054)], brown, there),
    ]:
        b.turned(name, profile, material, spot, steps=96, into=kit)
    handle = (there[0] - 0.056, there[1] - 0.02, top + 0.032)
    b.box("Handle", (0.032, 0.01, 0.02), china, handle, bevel=0.004, into=kit)
    berry = b.glossy("Berries", "7b2140", 0.3)
    for i in range(9):
        angle, reach = 2.4 * i, 0.016 * math.sqrt(i)
        center = (middle + reach * math.cos(angle), reach * math.sin(angle), top + 0.062)
        b.ball(f"Berry {i + 1}", 0.0105, berry, center, into=kit)
    mint, leaf_spot = b.matte("Mint", "5f8f4e"), (middle + 0.05, 0.02, top + 0.062)
    b.ball("Mint", 0.02, mint, leaf_spot, (1, 0.5, 0.15), rotation=(0, 10, 50), into=kit)
    b.box("Napkin", (0.2, 0.1, 0.004), b.matte("Napkin", "c8705a"), (middle, 0.25, top), bevel=0.002, into=kit)
    _flatware("Fork", FORK, steel, (middle, 0.25, top + 0.006), kit)
    _flatware("Knife", KNIFE, steel, (middle, -0.2, top + 0.002), kit)
    b.instance("Setting for one", kit)
    b.instance("Setting for the other", kit, rotation=(0, 0, 180))


def _flatware(name: str, outline, steel, location, into):
    """An outline cut from sheet steel."""
    data = b.mesh(name, [(x, y, 0) for x, y in outline], [range(len(outline))])
    obj = b.place(name, data, steel, location, into=into)
    solid = obj.modifiers.new("Thickness", "SOLIDIFY")
    solid.thickness, solid.offset = 0.003, 1.0


def middle(china, glaze):
    """Oranges in a bowl, a vase with a branch of blossom, a plate of croissants, a honey pot."""
    top = TABLE_HEIGHT
    bowl = [(0, 0.004), (0.06, 0.004), (0.11, 0.04), (0.135, 0.075), (0.132, 0.079), (0.126, 0.075), (0.1, 0.044), (0, 0.014)]
    b.turned("Fruit bowl", bowl, china, (0.05, 0.3, top), steps=96)
    peel, leaf = b.glossy("Orange", "e8862c", 0.4), b.matte("Leaf", "4d7a45")
    for i, (x, y, z) in enumerate([(-0.045, -0.03, 0.065), (0.05, -0.02, 0.062), (0.0, 0.055, 0.064), (0.005, 0.0, 0.125)], 1):
        b.ball(f"Orange {i}", 0.042, peel, (0.05 + x, 0.3 + y, top + z), scale=(1, 1, 0.94))
    b.ball("Orange leaf", 0.045, leaf, (0.085, 0.275, top + 0.165), (1, 0.42, 0.08), rotation=(12, 14, -40))
    walnut = b.matte("Walnut", "9a6a45")
    board = b.box("Board", (0.4, 0.21, 0.018), walnut, (-0.02, -0.02, top), bevel=0.006, rotation=(0, 0, 24))
    croissant = _croissant()
    croissant.materials.append(b.glossy("Crust", "c9843c", 0.45))
    for i, (x, y, turn) in enumerate([(-0.1, -0.03, 40), (0.085, 0.03, 235)], 1):
        b.place(f"Croissant {i}", croissant, None, (board.location.x + x, board.location.y + y, top + 0.018), (0, 0, turn))
    pot = [(0, 0), (0.036, 0), (0.042, 0.01), (0.044, 0.05), (0.036, 0.062), (0.036, 0.07), (0.032, 0.07), (0.032, 0.058)]
    pot += [(0, 0.058)]
    b.turned("Honey pot", pot, glaze, (0.16, -0.13, top))
    b.turned("Honey", [(0, 0.064), (0.0325, 0.064)], b.glossy("Honey", "d99a1e", 0.1), (0.16, -0.13, top))
    vase(glaze, leaf)


def _croissant():
    """A crescent of bulging rolls."""
    along, around, vertices, faces = 72, 20, [], []
    for i in range(along + 1):
        t = i / along
        angle = math.radians(-105 + 210 * t)
        thick = 0.027 * math.sin(math.pi * (0.04 + 0.92 * t)) ** 0.8 * (1 + 0.1 * abs(math.sin(math.pi * 7 * t)) - 0.05)
        for k in range(around):
            a = 2 * math.pi * k / around
            radius = 0.055 + thick * math.cos(a)
            vertices.append((radius * math.cos(angle), radius * math.sin(angle), 0.8 * thick * (1 + math.sin(a))))
    for i in range(along):
        for k in range(around):
            j, m = i * around, (i + 1) * around
            faces.append((j + k, m + k, m + (k + 1) % around, j + (k + 1) % around))
    faces += [range(around), range(along * around + around - 1, along * around - 1, -1)]
    return b.mesh("Croissant", vertices, faces, smooth=True)


def vase(glaze, leaf):
    """A vase whose branch of blossom throws its shadow over the cloth."""
    x, y, top = 0.02, -0.36, TABLE_HEIGHT
    outline = [(0, 0), (0.04, 0), (0.062, 0.05), (0.055, 0.11), (0.026, 0.16), (0.03, 0.19), (0.026, 0.19), (0.02, 0.16)]
    outline += [(0, 0.15)]
    b.turned("Vase", outline, glaze, (x, y, top))
    petal = b.matte("Blossom", "f6c9c4")
    for i in range(14):
        angle, reach, height = 2.4 * i, 0.03 + 0.008 * i, 0.3 - 0.007 * i
        center = (x + reach * math.cos(angle), y + reach * math.sin(angle), top + height)
        b.ball(f"Blossom {i + 1}", 0.021, petal, center, scale=(1, 1, 0.7))
        far = (x + 1.35 * reach * math.cos(angle + 0.5), y + 1.35 * reach * math.sin(angle + 0.5), top + height - 0.05)
        b.ball(f"Vase leaf {i + 1}", 0.04, leaf, far, (1, 0.36, 0.08), rotation=(10, -20, math.degrees(angle) + 30))
