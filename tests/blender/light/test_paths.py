"""Light that is scattered many times or comes from large things: in all, it is Cycles' within a few standard errors.

The pictures are small and of few samples: what is random averages out over their pixels, and what is wrong does not.
"""

from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.tracer import render

pytestmark = pytest.mark.slow

# Cycles' pictures of a scene, for their spread tells Cycles' noise, and the samples of each.
SCENES, COUNT, SAMPLES = 4, 2, 16
# Standard errors. One set of random numbers in a hundred goes beyond by chance somewhere in 64 comparisons, with four Blenders.
MOST = 3.8


@pytest.fixture(autouse=True)
def light(add_lamp, set_world, scene):
    """A sun with a size, an area light, a little of the sky; small pictures."""
    scene.render.resolution_x, scene.render.resolution_y = 48, 36
    add_lamp("SUN", rotation=(0.4, 0.3, 0), angle=0.3, energy=1.5)
    add_lamp("AREA", (-2, -1, 3), (0.3, -0.6, 0), energy=100.0, size=1.0)


def deviation(sides, name="Combined"):
    """By how many standard errors, and by what share, all light of all scenes differs from Cycles'."""
    traced = cycles = variance = 0.0
    for each in sides:
        pictures = np.array([passes[name][..., :3] for passes in each.cycles], np.float64)
        traced += each.traced[name][..., :3].sum(dtype=np.float64)
        cycles += pictures.mean(axis=0).sum()
        variance += each.traced["Variance"].sum(dtype=np.float64) + (pictures.var(axis=0, ddof=1) / len(pictures)).sum()
    return (traced - cycles) / np.sqrt(variance), traced / cycles - 1


def check(sides):
    errors, share = deviation(sides)
    assert abs(errors) <= MOST and abs(share) < 0.01, f"{errors:+.2f} standard errors, {share:+.3%}"
    assert not [each for each in sides[0].exported.ledger if each.status != "exported"]


@pytest.fixture
def take(pictures, stage, set_world):
    """take(**request) → Sides of scenes at level path, under a sky."""

    def make(**options):
        set_world((0.2, 0.3, 0.4), 1.0)
        return pictures(**{"scenes": SCENES, "samples": SAMPLES, "count": COUNT, "level": "path"} | options)

    return make


def replace_monkey(make_material, kind, **inputs):
    bpy.data.objects["Monkey"].data.materials[0] = make_material("Of the monkey", kind, **inputs)


def smooth():
    for polygon in bpy.data.objects["Monkey"].data.polygons:
        polygon.use_smooth = True


@pytest.mark.parametrize("level", ["direct", "path"])
def test_lambert_surfaces(take, level):
    check(take(level=level))


@pytest.mark.parametrize("is_smooth", [False, True])
@pytest.mark.parametrize("kind", ["Glossy", "Glass", "Refraction"])
def test_mirrors_and_glass(take, make_material, kind, is_smooth):
    replace_monkey(make_material, f"ShaderNodeBsdf{kind}", Color=(0.9, 0.8, 0.7, 1), Roughness=0.0)
    if is_smooth:
        smooth()
    check(take())


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        ("Principled", {"Base Color": (0.9, 0.6, 0.3, 1), "Roughness": 0.3}),
        ("Glossy", {"Color": (0.9, 0.8, 0.7, 1), "Roughness": 0.4}),
        ("Glass", {"Color": (0.9, 0.8, 0.7, 1), "Roughness": 0.2}),
        ("Translucent", {"Color": (0.9, 0.8, 0.7, 1)}),
    ],
)
def test_rough_surfaces(take, make_material, kind, inputs):
    replace_monkey(make_material, f"ShaderNodeBsdf{kind}", **inputs)
    check(take())


def test_surfaces_that_shine_light_others(take, make_material):
    replace_monkey(make_material, "ShaderNodeEmission", Color=(0.9, 0.8, 0.7, 1), Strength=3.0)
    check(take())


def test_a_principled_surface_that_shines(take, make_material):
    inputs = {"Specular IOR Level": 0.0, "Emission Color": (0.2, 0.5, 1, 1), "Emission Strength": 0.5}
    replace_monkey(make_material, "ShaderNodeBsdfPrincipled", **inputs)
    check(take())


def test_a_mixture_of_everything(take, make_material):
    replace_monkey(make_material, "ShaderNodeBsdfDiffuse", Color=(0.3, 0.5, 0.9, 1))
    tree = bpy.data.objects["Monkey"].data.materials[0].node_tree
    last = tree.nodes["Shader"]
    for kind in ("BsdfGlass", "BsdfGlossy", "Emission"):
        shader, mixed = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes.new("ShaderNodeMixShader")
        if "Roughness" in shader.inputs:
            shader.inputs["Roughness"].default_value = 0.0
        tree.links.new(last.outputs[0], mixed.inputs[1])
        tree.links.new(shader.outputs[0], mixed.inputs[2])
        mixed.inputs[0].default_value = 0.3
        last = mixed
    tree.links.new(last.outputs[0], tree.nodes["Output"].inputs["Surface"])
    check(take())


@pytest.mark.parametrize("kind", ["Diffuse", "Glossy"])
def test_an_image_around_the_world(take, make_material, set_world, kind):
    """With a window in it, that scattered rays seldom find."""
    replace_monkey(make_material, f"ShaderNodeBsdf{kind}", Color=(0.9, 0.6, 0.4, 1), Roughness=0.4 * (kind == "Glossy"))
    pixels = np.random.default_rng(1).uniform(0, 0.3, (16, 32, 4)).astype(np.float32)
    pixels[11:13, 4:6, :3] = 80.0, 60.0, 30.0
    check(take(arrange=lambda _: surround(set_world, pixels)))


@pytest.mark.parametrize(
    ("kind", "distribution"),
    [("Glass", "MULTI_GGX"), ("Glass", "GGX"), ("Glass", "BECKMANN"), ("Refraction", "GGX"), ("Refraction", "BECKMANN")],
)
def test_rough_glass_under_an_image_of_the_sky_has_cycles_weights(take, make_material, set_world, kind, distribution):
    """A third of its light would be too much, were light by half vectors that no facet has not weighed."""

    def arrange(_):
        for lamp in [each for each in bpy.data.objects if each.type == "LIGHT"]:
            bpy.data.objects.remove(lamp)
        material = make_material("Rough", f"ShaderNodeBsdf{kind}", Color=(0.9, 0.8, 0.7, 1), Roughness=0.8)
        next(node for node in material.node_tree.nodes if "Roughness" in node.inputs).distribution = distribution
        for name in ("Floor", "Monkey"):
            bpy.data.objects[name].data.materials[0] = material
        surround(set_world, np.full((16, 32, 4), 0.25, np.float32))

    check(take(arrange=arrange))


@pytest.mark.parametrize("roughness", [0.8, 1.0])
def test_rough_gloss_on_a_tilted_normal_is_cycles(take, make_material, roughness):
    """Before 5.0 rays count that facets send below the plane of the normal and above the surface: up to 1.3 % of the light."""

    def arrange(_):
        for lamp in [each for each in bpy.data.objects if each.type == "LIGHT"]:
            bpy.data.objects.remove(lamp)
        material = make_material("Rough", "ShaderNodeBsdfGlossy", Color=(0.9, 0.8, 0.7, 1), Roughness=roughness)
        tree = material.node_tree
        tilted = tree.nodes.new("ShaderNodeCombineXYZ")
        for socket, value in zip(tilted.inputs, (0.3, 0.1, 1.0), strict=True):
            socket.default_value = value
        tree.links.new(tilted.outputs[0], tree.nodes["Shader"].inputs["Normal"])
        bpy.data.objects["Floor"].data.materials[0] = material

    check(take(arrange=arrange, level="direct", samples=64))


def surround(set_world, pixels):
    """Put an image, turned, around the world. pixels : (height, width, 4)."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new("Room", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(pixels.ravel())
    world = set_world((0, 0, 0), 1.0)
    texture, mapping = (world.node_tree.nodes.new(f"ShaderNode{name}") for name in ("TexEnvironment", "Mapping"))
    coordinates = world.node_tree.nodes.new("ShaderNodeTexCoord")
    # Cycles' own map for sampling, made anew for each picture, is of megapixels otherwise, and takes seconds.
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", 256
    texture.image, mapping.inputs["Rotation"].default_value = image, (0.3, 0.1, 2.0)
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    world.node_tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    world.node_tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
    world.node_tree.links.new(texture.outputs[0], background.inputs["Color"])


def look_into_another_world(world):
    tree = world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    other, mix, path = (tree.nodes.new(f"ShaderNode{name}") for name in ("Background", "MixShader", "LightPath"))
    other.inputs["Color"].default_value, other.inputs["Strength"].default_value = (1.0, 0.2, 0.1, 1.0), 3.0
    for number, socket in enumerate((path.outputs["Is Camera Ray"], background.outputs[0], other.outputs[0])):
        tree.links.new(socket, mix.inputs[number])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


def test_the_camera_may_see_another_world_than_what_lights(take, make_material):
    """Through what is transparent, too, but not in mirrors nor through glass."""
    replace_monkey(make_material, "ShaderNodeBsdfGlass", Roughness=0.0)
    bpy.data.objects["Floor"].data.materials[0] = make_material("Veil", "ShaderNodeBsdfTransparent", Color=(0.5, 0.8, 0.5, 1))
    sides = take(arrange=lambda _: look_into_another_world(bpy.context.scene.world))
    check(sides)
    assert deviation(sides, "Environment")[1] == pytest.approx(0.0, abs=0.01)
    worlds = [replace(each.exported, world=replace(each.exported.world, backdrop=None)) for each in sides]
    wrong = [replace(each, traced=render.render(world, "path", 4)) for each, world in zip(sides, worlds, strict=True)]
    assert abs(deviation(wrong, "Environment")[1]) > 0.1


@pytest.mark.parametrize("ray", ["diffuse", "glossy", "transmission", "shadow"])
def test_what_is_hidden_from_one_kind_of_rays(take, make_material, ray, mesh_from, add):
    """A glowing ball before a mirror and glass: seen in neither, or in all but one."""
    replace_monkey(make_material, "ShaderNodeBsdfGlass", Roughness=0.0)
    ball = add(mesh_from("uv_sphere", radius=0.5), "Ball", (1.2, -0.5, 0.3))
    ball.data.materials.append(make_material("Glow", "ShaderNodeEmission", Color=(1, 0.7, 0.4, 1), Strength=2.0))
    setattr(ball, f"visible_{ray}", False)
    check(take())


def test_lamps_and_worlds_that_hide(take, make_material):
    replace_monkey(make_material, "ShaderNodeBsdfGlossy", Roughness=0.0)
    lamp = next(block for block in bpy.data.objects if block.type == "LIGHT" and block.data.type == "AREA")
    lamp.visible_glossy = lamp.visible_camera = False
    sides = take()
    check(sides)
    bpy.context.scene.world.cycles_visibility.diffuse = False
    assert sides[0].exported.lamps[1].hidden_from >= {"glossy", "camera"}


def test_few_bounces_of_each_kind_are_counted_alike(take, make_material, scene):
    replace_monkey(make_material, "ShaderNodeBsdfGlass", Roughness=0.0)
    scene.cycles.max_bounces, scene.cycles.transmission_bounces, scene.cycles.diffuse_bounces = 3, 2, 1
    check(take())


@pytest.mark.parametrize("kind", ["diffuse", "glossy"])
def test_velvet_scatters_diffuse_rays_of_glossy_light(take, make_material, mesh_from, add, scene, kind):
    """In a white room, without glossy bounces it has the light of the walls, and without diffuse ones it has none."""
    setattr(scene.cycles, f"{kind}_bounces", 0)
    room = add(mesh_from("uv_sphere", radius=8), "Room")
    room.visible_camera = False
    room.data.materials.append(make_material("White", "ShaderNodeBsdfDiffuse", Color=(0.9, 0.9, 0.9, 1)))

    def arrange(_):
        material = make_material("Velvet", "ShaderNodeBsdfSheen", Color=(0.9, 0.8, 0.7, 1), Roughness=1.0)
        material.node_tree.nodes["Shader"].distribution = "ASHIKHMIN"
        bpy.data.objects["Floor"].data.materials[0] = material
        bpy.data.objects["Monkey"].hide_render = True
        bpy.context.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0

    sides = take(arrange=arrange)
    errors, share = deviation(sides)
    assert abs(errors) <= MOST and abs(share) < 0.01, f"{errors:+.2f} standard errors, {share:+.3%}"


def test_bumps_shadow_no_ray_that_a_translucent_sheet_has_scattered(take, make_material, mesh_from, add, set_world):
    """It is lit from below alone, by a floor in the sun: its rays, shadowed, would leave it 9 % darker."""

    def arrange(_):
        for lamp in [each for each in bpy.data.objects if each.type == "LIGHT"]:
            if lamp.data.type == "AREA":
                bpy.data.objects.remove(lamp)
            else:
                lamp.rotation_euler, lamp.data.angle = (1.1, 0, 0), 0.0
        set_world((0, 0, 0), 0.0)
        material = make_material("Sheet", "ShaderNodeBsdfTranslucent", Color=(0.9, 0.8, 0.7, 1))
        tree = material.node_tree
        tilted = tree.nodes.new("ShaderNodeCombineXYZ")
        for socket, value in zip(tilted.inputs, (1.0, 0.0, 1.0), strict=True):
            socket.default_value = value
        tree.links.new(tilted.outputs[0], tree.nodes["Shader"].inputs["Normal"])
        bpy.data.objects["Floor"].data.materials[0] = material
        bpy.data.objects["Monkey"].hide_render = True

    ground = add(mesh_from("plane", size=200), "Ground", (0, 0, -12))
    ground.visible_camera = False
    ground.data.materials.append(make_material("White", "ShaderNodeBsdfDiffuse", Color=(0.9, 0.9, 0.9, 1)))
    check(take(arrange=arrange, samples=64))


@pytest.mark.parametrize("shape", ["BOX", "GAUSSIAN"])
def test_a_see_through_film_with_its_own_exposure_and_filter(take, scene, shape):
    scene.render.film_transparent, scene.cycles.film_exposure, scene.cycles.pixel_filter_type = True, 1.7, shape
    bpy.data.objects["Floor"].hide_render = True
    sides = take()
    check(sides)
    for each in sides:
        cycles = np.mean([passes["Combined"][..., 3] for passes in each.cycles])
        assert each.traced["Combined"][..., 3].mean() == pytest.approx(cycles, rel=0.05) and 0 < cycles < 0.9


@pytest.mark.parametrize("sabotage", ["albedo", "bounce"])
def test_a_percent_less_light_is_caught(take, scene, sabotage, monkeypatch):
    """The tests above must be able to fail."""
    from viewcam_addon.blender.scenes import export, shaders
    from viewcam_addon.tracer.scene.film import Bounces
    from viewcam_addon.tracer.scene.materials import Color, sum_of

    if sabotage == "albedo":
        right = shaders.read

        def darker(material):
            reading = right(material)
            rgb = tuple(0.99 * value for value in reading.material.surface["color"].rgb)
            reading.material = sum_of(diffuse=Color(rgb))
            return reading

        monkeypatch.setattr(shaders, "read", darker)
    else:
        scene.cycles.max_bounces = 1
        monkeypatch.setattr(export.film, "bounces_of", lambda scene, ledger: Bounces(0, 4, 4, 12))
        monkeypatch.setattr("viewcam_addon.blender.scenes.film.BOUNCES", {})
    errors, share = deviation(take())
    assert errors < -MOST, f"{errors:+.2f} standard errors, {share:+.3%}"
