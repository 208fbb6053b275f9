"""Light that is Cycles' choice, at surfaces in one place or past what not all rays see, is taken out and named, no other."""

import pytest

bpy = pytest.importorskip("bpy")

import math
from dataclasses import replace

from viewcam_addon import api
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.errors import InputError
from viewcam_addon.image import Image
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer import render

pytestmark = pytest.mark.slow


@pytest.fixture
def room(scene, camera, add, add_lamp, mesh_from):
    """A tilted floor, a ball on it, a wall, a sun, and a world; room(kind) puts something in the floor's place."""

    def painted(mesh, color):
        material = bpy.data.materials.new(mesh.name)
        material.use_nodes = True
        material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1)
        material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 1.0
        mesh.materials.append(material)
        return mesh

    def make(kind):
        tilt = (0.11, 0.07, 0.2)
        add(painted(mesh_from("plane", size=6), (0.6, 0.6, 0.6)), "Floor", rotation_euler=tilt)
        if kind == "copy":
            add(painted(mesh_from("plane", size=6), (0.2, 0.5, 0.7)), "Copy", rotation_euler=tilt)
        else:
            grid = mesh_from("grid", size=2.2, x_subdivisions=3, y_subdivisions=5)
            add(painted(grid, (0.8, 0.3, 0.1)), "Carpet", rotation_euler=tilt)
        add(painted(mesh_from("uv_sphere", radius=0.6), (0.7, 0.7, 0.2)), "Ball", (1.4, 1.4, 0.8))
        add(painted(mesh_from("plane", size=8), (0.3, 0.5, 0.4)), "Wall", (0, 4, 0), rotation_euler=(1.4, 0, 0))
        add_lamp("SUN", (0, 0, 5), (0.5, 0.2, 0), energy=3.0, angle=0.2)
        scene.render.resolution_x, scene.render.resolution_y = 72, 48

    return make


@pytest.mark.parametrize("level", ["direct", "path"])
@pytest.mark.parametrize("kind", ["carpet", "copy"])
def test_light_on_surfaces_in_one_place_is_taken_out_and_named(room, tmp_path, read_passes, kind, level):
    room(kind)
    paths = [tmp_path / f"cycles-{number}.exr" for number in range(4)]
    exported = jobs.both_sides(Job(threads=2, level=level, samples=64), paths)
    tests = [Image(passes, exported.camera) for passes in read_passes(paths)]

    comparison = compared(exported, level, tests)
    assert comparison.passed, "\n".join(comparison.lines())
    assert comparison.answer.answer == "same_but", comparison.sentence
    assert set(comparison.taken_out.names) == {"Floor", kind.capitalize()}
    assert 0.02 < comparison.taken_out.pixels.mean() < 0.9
    assert 0.02 < comparison.not_modeled.share < 0.9 and set(comparison.not_modeled.names) == {"Floor", kind.capitalize()}
    brighter = tuple(replace(lamp, irradiance=tuple(1.06 * x for x in lamp.irradiance)) for lamp in exported.lamps)
    assert not compared(replace(exported, lamps=brighter), level, tests, exported).passed


def compared(scene, level, tests, known=None):
    """The comparison with a scene's own picture, which is said to be of another."""
    passes = render.render(scene, level, 64, threads=2)
    reference = Image(passes, scene.camera, {"samples": "64", "level": level, "albedo tables": "yes"})
    return api.compare(reference, tests, known or scene, 2, 16)


def hidden_from_scattered_rays(sheet):
    sheet.visible_diffuse = sheet.visible_glossy = False


def without_a_shadow(sheet):
    sheet.visible_shadow = False


def transparent_to_shadow_rays(sheet):
    tree = sheet.active_material.node_tree
    mix, path, transparent = (tree.nodes.new(f"ShaderNode{name}") for name in ("MixShader", "LightPath", "BsdfTransparent"))
    for start, end in (
        (path.outputs["Is Shadow Ray"], mix.inputs[0]),
        (tree.nodes["Principled BSDF"].outputs[0], mix.inputs[1]),
        (transparent.outputs[0], mix.inputs[2]),
        (mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"]),
    ):
        tree.links.new(start, end)


@pytest.fixture
def lit_past_a_sheet(scene, camera, add, add_lamp, mesh_from):
    """A floor, a sheet over one side of it, and far above that a light: an area lamp, or a surface that glows."""

    def material(name):
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        return material

    def make(light, sheet=lambda sheet: None):
        for name, size, place in (("Floor", 8, (0, 0, 0)), ("Sheet", 2, (1.5, 1, 2))):
            mesh = mesh_from("grid", size=size)
            mesh.materials.append(material(name))
            added = add(mesh, name, place)
        sheet(added)
        if light == "surface":
            mesh = mesh_from("grid", size=4)
            mesh.materials.append(material("Glow"))
            glow = mesh.materials[0].node_tree.nodes["Principled BSDF"].inputs
            glow["Emission Color"].default_value, glow["Emission Strength"].default_value = (1, 1, 1, 1), 0.4
            add(mesh, "Glow", (0, 0, 4))
        else:
            lamp = add_lamp("AREA", (0, 0, 4), energy=300.0, size=4.0)
            lamp.name, lamp.data.use_shadow = "Lamp", light != "shadowless"
        scene.render.resolution_x, scene.render.resolution_y = 48, 32

    return make


@pytest.mark.parametrize(
    ("light", "sheet", "name"),
    [
        ("surface", hidden_from_scattered_rays, "Sheet"),
        ("lamp", hidden_from_scattered_rays, "Sheet"),
        ("surface", without_a_shadow, "Sheet"),
        ("lamp", without_a_shadow, "Sheet"),
        ("lamp", transparent_to_shadow_rays, "Sheet"),
        ("shadowless", lambda sheet: None, "Lamp"),
    ],
)
def test_light_past_what_not_all_rays_see_is_taken_out_and_named(lit_past_a_sheet, tmp_path, read_passes, light, sheet, name):
    """Cycles' weights of importance sampling decide how much of it a picture has: 4 % less in a tile, or 14 times as much."""
    lit_past_a_sheet(light, sheet)
    paths = [tmp_path / f"cycles-{number}.exr" for number in range(4)]
    exported = jobs.both_sides(Job(threads=2, level="direct", samples=256), paths)
    tests = [Image(passes, exported.camera) for passes in read_passes(paths)]
    comparison = compared(exported, "direct", tests)
    assert comparison.passed, "\n".join(comparison.lines())
    assert comparison.taken_out.seen_otherwise.keys() == {name} and not comparison.pairs
    assert 0.02 < comparison.taken_out.pixels.mean() < 0.7
    assert comparison.not_modeled.names == (name,)
    if light != "shadowless":  # which the ledger tells as approximated already
        assert (
            "but for 1 light or shadow that not all rays see" in comparison.sentence
            and "not modeled" not in comparison.sentence
        )
    brighter = [replace(image, passes={**image.passes, "Combined": 1.06 * image["Combined"]}) for image in tests]
    assert not compared(exported, "direct", brighter).passed


@pytest.fixture
def lit_by_what_some_rays_see(scene, camera, add, add_lamp, mesh_from, set_world):
    """make(light, kind, closure) : a sheet of a closure near a light that is hidden from a kind of rays; the light's name."""

    def make(light, kind, closure):
        sheet = mesh_from("plane", size=4)
        material = bpy.data.materials.new("Sheet")
        material.use_nodes = True
        tree = material.node_tree
        shader = tree.nodes.new(closure)
        tree.links.new(shader.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
        if "Roughness" in shader.inputs:
            shader.inputs["Roughness"].default_value = 0.2
        sheet.materials.append(material)
        add(sheet, "Sheet")
        scene.render.resolution_x, scene.render.resolution_y = 48, 32
        if light == "world":
            set_world((0.5, 0.5, 0.5))
            setattr(scene.world.cycles_visibility, kind, False)
            return "World"
        below = kind == "transmission"
        lamp = add_lamp("AREA", (0, 0, -1 if below else 1), (math.pi if below else 0, 0, 0), energy=10.0, size=2.0)
        lamp.name, lamp.visible_camera = "Lamp", False
        setattr(lamp, f"visible_{kind}", False)
        if below:  # most of the light is another's
            add_lamp("SUN", (0, 0, -5), (math.pi, 0, 0), energy=20.0)
        return lamp.name

    return make


@pytest.mark.parametrize(
    ("light", "kind", "closure"),
    [
        ("lamp", "glossy", "ShaderNodeBsdfPrincipled"),
        ("lamp", "diffuse", "ShaderNodeBsdfPrincipled"),
        ("world", "glossy", "ShaderNodeBsdfPrincipled"),
        ("lamp", "transmission", "ShaderNodeBsdfTranslucent"),
    ],
)
def test_light_that_only_some_rays_see_is_taken_out_and_named(
    lit_by_what_some_rays_see, tmp_path, read_passes, light, kind, closure
):
    """A scattered ray of Cycles carries the light of all closures and sees with one's kind: 5 % of Diffuse Direct is lost."""
    name = lit_by_what_some_rays_see(light, kind, closure)
    paths = [tmp_path / f"cycles-{number}.exr" for number in range(8)]
    exported = jobs.both_sides(Job(threads=2, level="direct", samples=256), paths)
    tests = [Image(passes, exported.camera) for passes in read_passes(paths)]
    comparison = compared(exported, "direct", tests)
    assert comparison.passed, "\n".join(comparison.lines())
    assert comparison.taken_out.seen_otherwise.keys() == {name} and not comparison.pairs
    assert "but for 1 light or shadow that not all rays see" in comparison.sentence
    brighter = [replace(image, passes={**image.passes, "Combined": 1.1 * image["Combined"]}) for image in tests]
    assert not compared(exported, "direct", brighter).passed


@pytest.fixture
def lit_from_the_ceiling(scene, camera, add, add_lamp, mesh_from):
    """A floor, and a lamp exactly in the plane of a ceiling over it, both of them turned."""

    def make(turned):
        add(mesh_from("plane", size=4), "Floor", (0, 0, -1))
        add(mesh_from("plane", size=4), "Ceiling", (0, 0, 2), rotation_euler=turned)
        add_lamp("AREA", (0, 0, 2), turned, energy=100.0)
        scene.render.resolution_x, scene.render.resolution_y = 96, 64

    return make


TURNED = pytest.mark.parametrize("turned", [(0, 0, 0), (0.2, 0.13, 0.4), (-0.31, 0.05, 0)])


@TURNED
def test_a_room_that_is_lit_from_the_plane_of_its_ceiling_alone_is_nothing_to_compare(
    lit_from_the_ceiling, tmp_path, read_passes, turned
):
    lit_from_the_ceiling(turned)
    paths = [tmp_path / f"cycles-{number}.exr" for number in range(2)]
    exported = jobs.both_sides(Job(threads=2, level="direct", samples=64), paths)
    tests = [Image(passes, exported.camera) for passes in read_passes(paths)]
    with pytest.raises(InputError, match=r"^Nothing to compare: .*'Ceiling' and 'Lamp'.*move one of two"):
        compared(exported, "direct", tests)


@TURNED
def test_a_lamp_exactly_in_the_plane_of_a_ceiling_is_in_one_place_with_it(
    lit_from_the_ceiling, add, mesh_from, tmp_path, read_passes, turned
):
    """A wall that glows, and that its light does not reach, is compared as ever."""
    lit_from_the_ceiling(turned)
    glowing = mesh_from("plane", size=8)
    material = bpy.data.materials.new("Glow")
    material.use_nodes = True
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value, inputs["Emission Strength"].default_value = (0, 0, 0, 1), 0.5
    inputs["Specular IOR Level"].default_value, inputs["Emission Color"].default_value = 0, (1, 1, 1, 1)
    glowing.materials.append(material)
    add(glowing, "Wall", (0, 5, 0), rotation_euler=(1.57, 0, 0))
    paths = [tmp_path / f"cycles-{number}.exr" for number in range(2)]
    exported = jobs.both_sides(Job(threads=2, level="direct", samples=64), paths)
    tests = [Image(passes, exported.camera) for passes in read_passes(paths)]
    comparison = compared(exported, "direct", tests)
    assert comparison.passed, "\n".join(comparison.lines())
    assert ("Ceiling", "Lamp") in comparison.pairs and "but for 2 objects with surfaces in one place" in comparison.sentence
    assert 0.1 < comparison.taken_out.pixels.mean() < 0.9
    brighter = [replace(image, passes={**image.passes, "Combined": 1.01 * image["Combined"]}) for image in tests]
    assert not compared(exported, "direct", brighter).passed


@pytest.mark.parametrize("light", ["surface", "lamp"])
def test_where_all_rays_see_the_same_no_light_is_a_choice(lit_past_a_sheet, light):
    lit_past_a_sheet(light)
    exported = jobs.export(Job(threads=2, level="direct"))
    light, pairs, seen_otherwise = render.Tracer(exported, 2).coincident_light("direct", 16, 0, 64.0)
    assert not pairs and not seen_otherwise and not light["Combined"][..., :3].any()
