"""Surfaces in one place and things of a pixel, rendered by Cycles: either is right, and each has its own slope."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Matrix

from viewcam_addon.comparison import geometry
from viewcam_addon.image import Image
from viewcam_addon.tracer import render

SPHERES = Path(__file__).resolve().parents[3] / "sample_scenes" / "spheres.blend"
SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
TILTED = (0.3, 0.2, 0.1)


@pytest.fixture
def sheet(add):
    """sheet(name, vertices, faces, slots) adds a mesh of flat faces, tilted, with a UV map in which face follows face."""

    def make(name, vertices=SQUARE, faces=((0, 1, 2, 3),), slots=(), **properties):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(vertices, [], faces)
        layer = mesh.uv_layers.new()
        for loop in mesh.loops:
            layer.data[loop.index].uv = mesh.vertices[loop.vertex_index].co.xy * (1 + loop.index // 4)
        for number in range(max(slots, default=0) + 1):
            mesh.materials.append(bpy.data.materials.new(f"{name} {number}"))
        for face, slot in zip(mesh.polygons, slots, strict=False):
            face.material_index = slot
        return add(mesh, name, **{"rotation_euler": TILTED} | properties)

    return make


def objects(sheet, add):
    sheet("First")
    sheet("Second")
    return ("First", "Second")


def faces_of_one_mesh(sheet, add):
    sheet("Doubled", SQUARE + SQUARE, [(0, 1, 2, 3), (4, 5, 6, 7)], [0, 1])
    return ("Doubled", "Doubled")


def a_decal(sheet, add):
    sheet("Decal", [*SQUARE, (-0.61, -0.53, 0), (0.57, -0.49, 0), (0.59, 0.47, 0)], [(0, 1, 2, 3), (4, 5, 6)], [0, 1])
    return ("Decal", "Decal")


def other_triangles(sheet, add):
    sheet("Floor")
    across = np.linspace(-0.9, 0.9, 4)
    vertices = [(x + 0.03 * y, y, 0) for y in across for x in across]
    faces = [(4 * j + i, 4 * j + i + 1, 4 * j + i + 5, 4 * j + i + 4) for j in range(3) for i in range(3)]
    sheet("Carpet", vertices, faces)
    return ("Carpet", "Floor")


def a_crossing_at_a_hair(sheet, add):
    sheet("Level")
    sheet("Upright", [(0, -1, -1), (0, 1, -1), (0, 1, 1), (0, -1, 1)])
    sheet("Inclined", [(x, y, 1e-7 * x) for x, y, _ in SQUARE])
    return ("Inclined", "Level")


def doubles_in_instances(sheet, add):
    doubled = sheet("Source", SQUARE + SQUARE, [(0, 1, 2, 3), (4, 5, 6, 7)], [0, 1])
    collection = bpy.data.collections.new("Instanced")
    collection.objects.link(doubled)
    bpy.context.scene.collection.objects.unlink(doubled)
    for number in range(6):
        place = add(None, f"Place {number}", location=(number % 3 - 1, number // 3 - 0.5, 0), scale=(0.3,) * 3)
        place.instance_type, place.instance_collection = "COLLECTION", collection
    return ("Source", "Source")


def instances_in_one_place(sheet, add):
    single = sheet("Source", slots=[0])
    collection = bpy.data.collections.new("Instanced")
    collection.objects.link(single)
    bpy.context.scene.collection.objects.unlink(single)
    for number in range(3):
        place = add(None, f"Place {number}", location=(0.1, 0.2, 0.3), rotation_euler=(0, 0, number * np.pi / 2))
        place.instance_type, place.instance_collection = "COLLECTION", collection
    single.rotation_euler = (0, 0, 0)
    return ("Source", "Source")


IN_ONE_PLACE = [
    objects,
    faces_of_one_mesh,
    a_decal,
    other_triangles,
    a_crossing_at_a_hair,
    doubles_in_instances,
    instances_in_one_place,
]


@pytest.mark.parametrize("kind", IN_ONE_PLACE, ids=lambda kind: kind.__name__)
def test_either_of_two_surfaces_in_one_place_is_the_same_picture(both_sides, sheet, add, kind):
    pair = kind(sheet, add)
    sides = both_sides()
    sides.check()
    pairs = set(sides.comparison.in_one_place.pairs())
    assert pairs <= {pair}, f"{pairs} are named, and only {pair} are in one place"


@pytest.mark.parametrize("kind", IN_ONE_PLACE, ids=lambda kind: kind.__name__)
def test_whichever_surface_cycles_had_shown_would_have_been_right_and_no_third_one(both_sides, sheet, add, kind):
    """Cycles' choice may be the tracer's: so each pixel is made to show the last of those that the tracer knows there."""
    pair = kind(sheet, add)
    sides = both_sides()
    camera, tracer = sides.exported.camera, render.Tracer(sides.exported, 2)
    rows, columns = (places.ravel() for places in np.mgrid[: camera.height, : camera.width])
    rays, _, passes = tracer.surfaces_at(columns, rows, within=1e-7)
    last = np.searchsorted(rays, rays, side="right")[np.searchsorted(rays, np.arange(len(rows)))] - 1
    size = (camera.height, camera.width, -1)
    other = {name: passes[name][last].reshape(size) for name in sides.cycles if name in passes}

    def compared(test):
        return geometry.compare(Image(sides.traced), Image(test), camera, tracer.surfaces_at)

    found = compared(other)
    assert found.passed and set(found.in_one_place.pairs()) == {pair}, "\n".join(found.lines())
    row, column = found.in_one_place.rows[0], found.in_one_place.columns[0]
    wrong = {**other, "Material Index": other["Material Index"].copy()}
    wrong["Material Index"][row, column] += 7
    assert not compared(wrong).passed


def sprinkles(sheet, add, mesh_from):
    ball = mesh_from("ico_sphere", subdivisions=2, radius=0.025)
    ball.shade_smooth()
    return ball


def leaves(sheet, add, mesh_from):
    return sheet("Leaf", [(0.02 * x, 0.02 * y, 0) for x, y, _ in SQUARE]).data


def needles(sheet, add, mesh_from):
    return mesh_from("cone", vertices=7, radius1=0.006, depth=0.4)


def facets(sheet, add, mesh_from):
    return mesh_from("ico_sphere", subdivisions=4, radius=0.05)


# How far UV may not be off: of needles thinner than a pixel it changes by a whole map with each pixel, of which a ray's
# rounding is some ten thousandths.
@pytest.mark.parametrize(("kind", "apart"), [(sprinkles, 1e-4), (leaves, 1e-4), (needles, 1e-3), (facets, 1e-4)])
def test_things_of_a_pixel_are_the_same_picture(both_sides, sheet, add, mesh_from, kind, apart):
    mesh, random = kind(sheet, add, mesh_from), np.random.default_rng(5)
    for number in range(400):
        rotation = Matrix.Rotation(random.uniform(0, 6), 4, random.normal(size=3).tolist()).to_euler()
        add(mesh, f"{kind.__name__} {number}", location=random.uniform(-2, 2, 3).tolist(), rotation_euler=rotation)
    sides = both_sides()
    sides.check()
    shown = np.flatnonzero(sides.traced["Object Index"] > 0)
    off = {name: values.copy() for name, values in sides.cycles.items()}
    off["UV"].reshape(-1, off["UV"].shape[-1])[shown, :2] += np.float32(apart)
    tracer = render.Tracer(sides.exported, 2)
    found = geometry.compare(Image(sides.traced), Image(off), sides.exported.camera, tracer.surfaces_at)
    assert not found.passed, "\n".join(found.lines())
    flipped = replace(Image(sides.cycles), passes={**sides.cycles, "Normal": sides.cycles["Normal"].copy()})
    flipped["Normal"].reshape(-1, 3)[shown[len(shown) // 2]] *= -1
    assert not geometry.compare(Image(sides.traced), flipped, sides.exported.camera, tracer.surfaces_at).passed


@pytest.mark.parametrize(("width", "height"), [(16, 9), (32, 18)])
def test_thousands_of_spheres_in_a_few_pixels_are_the_same_picture(both_sides, width, height):
    """Nearly every pixel is at a silhouette, where the neighbors tell too little of how fast the normal turns."""
    bpy.ops.wm.open_mainfile(filepath=str(SPHERES))
    sides = both_sides(width=width, height=height)
    assert sides.comparison.passed, "\n".join(sides.comparison.lines())
    turned = np.roll(sides.cycles["Normal"], 1, axis=1)  # each pixel has its neighbor's
    wrong = Image({**sides.cycles, "Normal": turned})
    tracer = render.Tracer(sides.exported, 1)
    assert not geometry.compare(Image(sides.traced), wrong, sides.exported.camera, tracer.surfaces_at).passed
