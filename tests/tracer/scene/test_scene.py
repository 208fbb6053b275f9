"""Scenes that are refused, each in a sentence that names the object."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres, least_level
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import RAYS, Area, Point, Spot, Sun, World
from viewcam_addon.tracer.scene.materials import Color, simplified, sum_of
from viewcam_addon.tracer.scene.shader_nodes import node

CAMERA = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 4, 4)


def triangle(**changes):
    arrays = {
        "vertices": np.eye(3),
        "triangles": np.array([[0, 1, 2]], np.int32),
        "materials": np.zeros(1, np.int32),
    }
    return Mesh(**(arrays | changes))


def beads(**changes):
    arrays = {"centers": np.zeros((2, 3)), "radii": np.ones(2), "materials": np.zeros(2, np.int32)}
    return Spheres(**(arrays | changes))


def placed(**changes):
    return Object(**({"name": "thing", "geometry": "mesh", "matrix": np.eye(4)} | changes))


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: triangle(vertices=np.zeros((3, 2))), ["vertices", "n × 3"]),
        (lambda: triangle(triangles=np.array([[0, 1, 3]], np.int32)), ["triangles", "0 … 2"]),
        (lambda: triangle(triangles=np.array([[0, 1, -1]], np.int32)), ["triangles", "0 … 2"]),
        (lambda: triangle(vertices=np.full((3, 3), np.nan)), ["vertices", "finite"]),
        (lambda: triangle(materials=np.zeros(2, np.int32)), ["materials", "1"]),
        (lambda: triangle(corner_normals=np.zeros((1, 3), np.float32)), ["corner_normals", "1 × 3 × 3"]),
        (lambda: triangle(corner_uvs=np.zeros((2, 3, 2), np.float32)), ["corner_uvs", "1 × 3 × 2"]),
        (lambda: beads(radii=np.array([1.0, -1.0])), ["radii", "negative"]),
        (lambda: beads(centers=np.full((2, 3), np.inf)), ["centers", "finite"]),
        (lambda: placed(matrix=np.eye(3)), ["thing", "4 × 4"]),
        (lambda: placed(matrix=np.full((4, 4), np.nan)), ["thing", "finite"]),
        (lambda: placed(matrix=np.diag([1.0, 1, 1, 2])), ["thing", "affine"]),
        (lambda: placed(material_indices=()), ["thing", "material_indices"]),
        (lambda: Scene(CAMERA, {}, (placed(),)), ["thing", "'mesh'"]),
        (lambda: Scene(CAMERA, {"mesh": triangle(materials=np.ones(1, np.int32))}, (placed(),)), ["thing", "1 … 1"]),
        (lambda: Scene(CAMERA, {"mesh": triangle(materials=-np.ones(1, np.int32))}, (placed(),)), ["thing", "-1"]),
        (lambda: Scene(CAMERA, {}, (), clip=(2, 1)), ["clip", "2 … 1"]),
        (lambda: Scene(CAMERA, {}, (), clip=(-1, 1)), ["clip"]),
        (lambda: Scene(CAMERA, {}, (), clip=(0, float("nan"))), ["clip"]),
        (lambda: Scene(CAMERA, {}, (), origin=(0.0, float("inf"), 0.0)), ["origin"]),
        (lambda: Scene(CAMERA, {}, (), origin=(0.0, 0.0)), ["origin", "three"]),
    ],
)
def test_what_is_wrong_is_named_in_one_sentence(build, words):
    with pytest.raises(InputError) as caught:
        build()
    message = str(caught.value)
    assert all(word in message for word in words), message
    assert "\n" not in message


def test_a_scene_that_is_right_is_taken():
    scene = Scene(CAMERA, {"mesh": triangle(), "beads": beads()}, (placed(), placed(geometry="beads")), clip=(1, 100))
    assert scene.clip == (1.0, 100.0) and isinstance(scene.clip[1], float)


# --- The least level: no more than a scene needs, and a sentence that names why


WHITE, BLACK = Color((1.0, 1.0, 1.0)), Color((0.0, 0.0, 0.0))
SUN = Sun("Sun", irradiance=(1.0, 1.0, 1.0))


@pytest.fixture
def scene(make_scene, make_mesh):
    """scene(material, field=value, …) → a Scene of one triangle of this material, "object 1"."""

    def build(material=None, **changes):
        scene = make_scene(Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 4, 4), make_mesh(np.eye(3), [[0, 1, 2]]))
        if material:
            placed = replace(scene.objects[0], materials=("M",))
            scene = replace(scene, objects=(placed,), materials={"M": material})
        return replace(scene, **changes)

    return build


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"lamps": (replace(SUN, irradiance=(0.0, 0.0, 0.0)), Point("Off", power=(0.0, 0.0, 0.0)))},
        {"world": World(hidden_from={"camera"})},
        {"material": sum_of(emission=BLACK)},
    ],
)
def test_without_light_there_is_only_geometry(scene, changes):
    level, reason = least_level(scene(**changes))
    assert level == "geometry" and "Nothing gives light" in reason


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lamps": (SUN,)}, "the lamp 'Sun'"),
        ({"lamps": (Area("Panel", matrix=np.eye(4)),)}, "the lamp 'Panel'"),
        ({"material": sum_of(emission=WHITE, diffuse=WHITE)}, "the surface of 'object 1'"),
        ({"world": World((0.0, 0.5, 0.0))}, "the world"),
        ({"world": World(backdrop=World((0.0, 0.5, 0.0)))}, "the world"),
    ],
)
def test_light_on_a_surface_that_reflects_needs_paths(scene, changes, words):
    level, reason = least_level(scene(**changes))
    assert level == "path" and words in reason and "'object 1' reflects" in reason


@pytest.mark.parametrize(
    ("material", "words"),
    [(sum_of(mirror=WHITE), "mirrors"), (sum_of(glass=WHITE), "is clear"), (sum_of(refraction=WHITE), "is clear")],
)
def test_mirrors_and_glass_need_paths(scene, material, words):
    level, reason = least_level(scene(material, lamps=(SUN,)))
    assert level == "path" and f"'object 1' {words}" in reason


@pytest.mark.parametrize(
    ("material", "bounces", "words"),
    [
        (None, Bounces().none, "allows no bounces"),
        (sum_of(emission=WHITE), Bounces(), "nothing reflects"),
        (sum_of(diffuse=BLACK), Bounces(), "nothing reflects"),
        (sum_of(diffuse=WHITE), Bounces(diffuse=0), "of the kinds"),
        (sum_of(mirror=WHITE), Bounces(glossy=0), "of the kinds"),
        (sum_of(glass=WHITE), Bounces(transmission=0, glossy=0), "of the kinds"),
    ],
)
def test_without_bounces_light_is_direct(scene, material, bounces, words):
    level, reason = least_level(scene(material, lamps=(SUN,), bounces=bounces))
    assert level == "direct" and words in reason


def test_glass_that_only_reflects_needs_paths(scene):
    assert least_level(scene(sum_of(glass=WHITE), lamps=(SUN,), bounces=Bounces(transmission=0)))[0] == "path"


def test_materials_that_nothing_shows_do_not_count(scene):
    material = scene(sum_of(emission=WHITE))
    unused = replace(material, materials=material.materials | {"Mirror": sum_of(mirror=WHITE)})
    assert least_level(unused)[0] == "direct"


# --- Trees of shaders that are sums of components, and those that are not


RED, BLUE = Color((0.5, 0.25, 0.125)), Color((0.0, 0.25, 1.0))
WOOD, BARK = Color((1.0, 1.0, 1.0), "wood"), Color((1.0, 1.0, 1.0), "bark")
COLORS = st.builds(Color, st.tuples(*[st.floats(0.01, 1.0)] * 3))


def added(*shaders):
    return functools.reduce(lambda first, second: node("add", first=first, second=second), shaders)


def mixed(factor, first, second):
    return node("mix", factor=factor, first=first, second=second)


@given(st.dictionaries(st.sampled_from(["diffuse", "emission", "mirror", "glass", "refraction"]), COLORS))
def test_the_components_of_what_a_material_adds_up_are_its_own(stated):
    material = sum_of(**stated, ior=1.3)
    tree = added(*(closure.node for closure in reversed(material.closures))) if stated else None
    assert simplified(tree) == material.surface


def test_a_mixture_shares_out_colors_and_adds_those_that_are_alike():
    red, blue = node("diffuse", color=RED), node("diffuse", color=BLUE)
    assert simplified(mixed(0.25, red, None)) == sum_of(diffuse=Color((0.375, 0.1875, 0.09375))).surface
    assert simplified(mixed(0.5, red, blue)) == sum_of(diffuse=Color((0.25, 0.25, 0.5625))).surface
    assert simplified(mixed(0.0, red, node("sheen"))) == sum_of(diffuse=RED).surface
    wood = node("diffuse", color=WOOD)
    assert simplified(mixed(0.25, wood, wood)) == sum_of(diffuse=WOOD).surface


def test_a_principled_surface_without_gloss_is_diffuse_and_may_shine():
    plain = {"base_color": RED, "roughness": 0.3, "specular_ior_level": 0.0}
    assert simplified(node("principled", **plain)) == sum_of(diffuse=RED).surface
    assert simplified(node("principled", base_color=RED, ior=1.0)) == sum_of(diffuse=RED).surface
    shining = node("principled", **plain, emission_color=BLUE, emission_strength=2.0)
    assert simplified(shining) == sum_of(diffuse=RED, emission=Color((0.0, 0.5, 2.0))).surface
    for name in ("metallic", "transmission_weight", "coat_weight", "sheen_weight", "diffuse_roughness", "specular_ior_level"):
        glossy = node("principled", **(plain | {name: 0.1}))
        assert simplified(glossy) is glossy, name
    clear = node("principled", **plain, alpha=0.9)
    assert simplified(clear) is clear


@pytest.mark.parametrize(
    "tree",
    [
        node("glossy", color=RED, roughness=0.1),
        node("diffuse", color=RED, roughness=0.1),
        node("diffuse", color=node("noise")),
        node("diffuse", color=RED, normal=node("geometry", output="normal")),
        node("emission", color=RED, strength=node("noise")),
        node("emission", color=Color((1e18, 0.0, 0.0)), strength=2.0),
        node("glass", color=RED, roughness=0.0, ior=node("noise")),
        added(node("glass", roughness=0.0, ior=1.3), node("refraction", roughness=0.0, ior=1.4)),
        added(node("diffuse", color=WOOD), node("diffuse", color=BARK)),
        mixed(node("noise"), node("diffuse"), None),
        mixed(0.5, node("diffuse"), node("sheen")),
        node("transparent"),
    ],
)
def test_what_components_can_not_say_stays(tree):
    assert simplified(tree) is tree


# --- What lamps may be: hostile values become a sentence, and what gives no light is known


EYE = np.eye(4)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: Sun("key", irradiance=(1, float("nan"), 1)), "irradiance of light 'key'"),
        (lambda: Sun("key", irradiance=(1, -1, 1)), "irradiance of light 'key'"),
        (lambda: Sun("key", towards=(0, 0, 0)), "towards of light 'key'"),
        (lambda: Sun("key", towards=(0, float("inf"), 0)), "towards of light 'key'"),
        (lambda: Sun("key", angle=3.2), "angle of light 'key'"),
        (lambda: Sun("key", casts_shadow=2), "casts_shadow of light 'key'"),
        (lambda: Sun("key", multiple_importance=2), "multiple_importance of light 'key'"),
        (lambda: Point("key", power=(1e30,) * 3), "power of light 'key'"),
        (lambda: Point("key", position=(0, 0, 1e19)), "position of light 'key'"),
        (lambda: Point("key", radius=-1), "radius of light 'key'"),
        (lambda: Point("key", hidden_from={"shadows"}), "light 'key'"),
        (lambda: Spot("key"), "matrix of light 'key'"),
        (lambda: Spot("key", matrix=EYE * float("nan")), "matrix of light 'key'"),
        (lambda: Spot("key", matrix=EYE[:3]), "matrix of light 'key'"),
        (lambda: Spot("key", matrix=EYE, blend=1.1), "blend of light 'key'"),
        (lambda: Spot("key", matrix=EYE, angle=-0.1), "angle of light 'key'"),
        (lambda: Area("key", matrix=EYE * 1e19), "matrix of light 'key'"),
        (lambda: Area("key", matrix=EYE, size=(1, -1)), "size of light 'key'"),
        (lambda: Area("key", matrix=EYE, size=(1, 2, 3)), "size of light 'key'"),
        (lambda: Area("key", matrix=EYE, spread=0), "spread of light 'key'"),
        (lambda: Area("key", matrix=EYE, spread=3.2), "spread of light 'key'"),
        (lambda: World((1, 2)), "radiance of the world"),
        (lambda: World((1, 2, 3), hidden_from={"eye"}), "the world"),
        (lambda: World(backdrop=World(hidden_from={"camera"})), "backdrop of the world"),
    ],
)
def test_a_lamp_that_cannot_be_is_refused_by_name(make, named):
    with pytest.raises(InputError, match=named) as refused:
        make()
    assert "\n" not in str(refused.value)


def test_half_a_turn_in_float32_is_half_a_turn():
    half = float(np.float32(np.pi))
    assert half > np.pi and Sun("sun", angle=half).angle == np.pi == Spot("spot", matrix=EYE, angle=half).angle


def test_the_direction_to_a_sun_is_of_unit_length_at_any_scale():
    for scale in (1e-300, 1.0, 1e300):
        assert np.linalg.norm(Sun("sun", towards=(scale, -2 * scale, 2 * scale)).towards) == pytest.approx(1, rel=1e-15)


def test_the_area_of_a_lamp_is_that_in_the_world():
    matrix = np.diag([2.0, -3.0, 5.0, 1.0])
    assert Area("area", matrix=matrix, size=(1, 0.5)).area == pytest.approx(3)
    assert Area("area", matrix=matrix, size=(1, 0.5), ellipse=True).area == pytest.approx(3 * np.pi / 4)
    sheared = EYE.copy()
    sheared[0, 1] = 7
    assert Area("area", matrix=sheared).area == pytest.approx(1)


@pytest.mark.parametrize(
    ("lamp", "dark"),
    [
        (Sun("lamp", irradiance=(0, 0, 0)), True),
        (Sun("lamp", irradiance=(0, 0, 1e-30)), False),
        (Point("lamp", power=(0, 0, 0)), True),
        (Point("lamp"), False),
        (Spot("lamp", matrix=np.diag([1.0, 1, 0, 1])), True),
        (Spot("lamp", matrix=EYE), False),
        (Area("lamp", matrix=EYE, size=(0, 1)), True),
        (Area("lamp", matrix=np.diag([0.0, 1, 1, 1])), True),
        (Area("lamp", matrix=np.diag([1.0, 1, 0, 1])), True),
        (Area("lamp", matrix=EYE), False),
    ],
)
def test_what_has_no_power_no_area_or_no_direction_is_dark(lamp, dark):
    assert lamp.is_dark == dark


def test_every_kind_of_ray_may_be_hidden_from():
    assert Sun("sun", hidden_from=RAYS).hidden_from == World(hidden_from=RAYS).hidden_from == frozenset(RAYS)
