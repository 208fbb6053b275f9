"""Trees of shaders that are sums of components, and those that are not."""

import functools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.tracer.scene.materials import Colour, Material, components
from viewcam_addon.tracer.scene.shader_nodes import node

RED, BLUE = Colour((0.5, 0.25, 0.125)), Colour((0.0, 0.25, 1.0))
WOOD, BARK = Colour((1.0, 1.0, 1.0), "wood"), Colour((1.0, 1.0, 1.0), "bark")
COLOURS = st.builds(Colour, st.tuples(*[st.floats(0.01, 1.0)] * 3))


def added(*shaders):
    return functools.reduce(lambda first, second: node("add", first=first, second=second), shaders)


def mixed(factor, first, second):
    return node("mix", factor=factor, first=first, second=second)


@given(st.dictionaries(st.sampled_from(["diffuse", "emission", "mirror", "glass", "refraction"]), COLOURS))
def test_the_components_of_what_a_material_adds_up_are_its_own(given):
    material = Material(**given, ior=1.3)
    tree = added(*(closure.node for closure in material.closures)) if given else None
    found = components(tree)
    assert Material(**found).colours == given
    assert found.get("ior", 1.3) == 1.3


def test_a_mixture_shares_out_colours_and_adds_those_that_are_alike():
    red, blue = node("diffuse", color=RED), node("diffuse", color=BLUE)
    assert components(mixed(0.25, red, None)) == {"diffuse": Colour((0.375, 0.1875, 0.09375))}
    assert components(mixed(0.5, red, blue)) == {"diffuse": Colour((0.25, 0.25, 0.5625))}
    assert components(mixed(0.0, red, node("sheen"))) == {"diffuse": RED}
    wood = node("diffuse", color=WOOD)
    assert components(mixed(0.25, wood, wood)) == {"diffuse": WOOD}


def test_a_principled_surface_without_gloss_is_diffuse_and_may_shine():
    plain = {"base_color": RED, "roughness": 0.3, "specular_ior_level": 0.0}
    assert components(node("principled", **plain)) == {"diffuse": RED}
    assert components(node("principled", base_color=RED, ior=1.0)) == {"diffuse": RED}
    shining = node("principled", **plain, emission_color=BLUE, emission_strength=2.0)
    assert components(shining) == {"diffuse": RED, "emission": Colour((0.0, 0.5, 2.0))}
    for name in ("metallic", "transmission_weight", "coat_weight", "sheen_weight", "diffuse_roughness", "specular_ior_level"):
        assert components(node("principled", **(plain | {name: 0.1}))) is None, name
    assert components(node("principled", **plain, alpha=0.9)) is None


@pytest.mark.parametrize(
    "tree",
    [
        node("glossy", color=RED, roughness=0.1),
        node("diffuse", color=RED, roughness=0.1),
        node("diffuse", color=node("noise")),
        node("diffuse", color=RED, normal=node("geometry", output="normal")),
        node("emission", color=RED, strength=node("noise")),
        node("emission", color=Colour((1e18, 0.0, 0.0)), strength=2.0),
        node("glass", color=RED, roughness=0.0, ior=node("noise")),
        added(node("glass", roughness=0.0, ior=1.3), node("refraction", roughness=0.0, ior=1.4)),
        added(node("diffuse", color=WOOD), node("diffuse", color=BARK)),
        mixed(node("noise"), node("diffuse"), None),
        mixed(0.5, node("diffuse"), node("sheen")),
        node("transparent"),
    ],
)
def test_what_components_can_not_say_is_none(tree):
    assert components(tree) is None
