"""Closures by themselves: densities are densities, samples follow them, no light is made, and light goes both ways alike."""

import numpy as np
import pytest
from core_probes import ScatteredBy

from viewcam_addon.tracer.native import constant_value
from viewcam_addon.tracer.scene.materials import Color
from viewcam_addon.tracer.scene.shader_nodes import KINDS, node

WHITE = (1.0, 1.0, 1.0)
GLASSY = {"roughness": 0.4, "ior": 1.5}
ROUGH = {
    "lambert": node("diffuse", color=WHITE),
    "oren-nayar": node("diffuse", color=WHITE, roughness=0.7),
    "translucent": node("translucent", color=WHITE),
    "ggx": node("glossy", color=WHITE, roughness=0.5, distribution="ggx"),
    "beckmann": node("glossy", color=WHITE, roughness=0.5, distribution="beckmann"),
    "multiscatter": node("glossy", color=WHITE, roughness=0.8),
    "stretched": node("glossy", color=WHITE, roughness=0.5, anisotropy=0.6, rotation=0.1, distribution="ggx"),
    "sheen": node("sheen", color=WHITE, roughness=0.6),
    "velvet": node("sheen", color=WHITE, roughness=0.6, distribution="ashikhmin"),
    "metal": node("metallic", color=(0.9, 0.6, 0.3), roughness=0.5),
    "conductor": node("metallic", fresnel="physical_conductor", roughness=0.5),
    "glass": node("glass", **GLASSY),
    "refraction": node("refraction", **GLASSY, distribution="ggx"),  # of what is 0, as Beckmann's tails, no density is told
    "principled": node("principled", base_color=WHITE),
    "cloth": node("principled", base_color=WHITE, sheen_weight=0.8, anisotropic=0.7, coat_weight=0.2, coat_roughness=0.5),
    "coated": node("principled", base_color=WHITE, coat_weight=0.7, coat_roughness=0.4, metallic=0.3),
    "clear": node("principled", base_color=WHITE, transmission_weight=0.6, roughness=0.6),
}
SIDES = [False, True]
COUNT = 40
# In what rough glass sends on of a lamp's light count half vectors that no facet has, as in Cycles: samples have none of that.
OPAQUE = [name for name in ROUGH if name not in ("glass", "refraction", "clear")]


def incoming(degrees):
    angle = np.radians(degrees)
    return np.array([np.sin(angle) * 0.8, np.sin(angle) * 0.6, -np.cos(angle)])


def sphere(rows):
    """(3, n) directions in the middle of cells of equal solid angle, and that angle."""
    z = (np.arange(2 * rows) + 0.5) / rows - 1
    turn = (np.arange(4 * rows) + 0.5) / (4 * rows) * 2 * np.pi
    z, turn = (each.ravel() for each in np.meshgrid(z, turn, indexing="ij"))
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z]), 4 * np.pi / len(z)


def numbers(count, seed=0):
    return np.random.default_rng(seed).random((3, count))


def test_every_closure_is_tried_here():
    tried = {shader.type for shader in ROUGH.values()}
    assert tried == {kind for kind, known in KINDS.items() if known.scatters}


@pytest.mark.parametrize("behind", SIDES)
@pytest.mark.parametrize("name", ROUGH)
def test_samples_fall_as_often_as_their_density_says(name, behind):
    """χ² over 8 × 16 cells of equal solid angle, the densities integrated over 16 × 16 points of each; cells of few are one."""
    count, rows = 20_000, 64
    came = incoming(50)
    drawn = ScatteredBy(ROUGH[name], came, (0, 0, 1), numbers(count), behind)
    directions, angle = sphere(rows)
    there = ScatteredBy(ROUGH[name], came, directions, np.zeros((3, directions.shape[1])), behind)

    def cells(of):
        turn = np.arctan2(of[1], of[0]) / (2 * np.pi) % 1
        return np.minimum(((of[2] + 1) * 4).astype(int), 7) * 16 + np.minimum((turn * 16).astype(int), 15)

    kept = drawn.sampled_pdf > 0
    kept &= drawn.sampled_pdf < np.inf
    expected = count * np.bincount(cells(directions), there.pdf * angle, 128)
    values = np.bincount(cells(drawn.sampled[:, kept]), minlength=128)
    many = expected > 20
    expected, values = np.append(expected[many], expected[~many].sum()), np.append(values[many], values[~many].sum())
    squares = ((values - expected) ** 2 / np.maximum(expected, 1)).sum()
    freedom = len(expected)
    assert squares < freedom + 5 * np.sqrt(2 * freedom) + 5, f"χ² is {squares:.0f} of {freedom}"
    assert abs(expected.sum() - kept.sum()) < 5 * np.sqrt(count), "the density's integral is the share of samples that are kept"


@pytest.mark.parametrize("behind", SIDES)
@pytest.mark.parametrize("name", OPAQUE)
@pytest.mark.parametrize("degrees", [5, 70])
def test_samples_weigh_what_the_integral_of_the_bsdf_is(name, degrees, behind):
    came = incoming(degrees)
    drawn = ScatteredBy(ROUGH[name], came, (0, 0, 1), numbers(40_000), behind)
    directions, angle = sphere(100)
    there = ScatteredBy(ROUGH[name], came, directions, np.zeros((3, directions.shape[1])), behind)
    weights = drawn.weight * ((drawn.sampled[2] > 0) != (drawn.kind == 8))
    error = weights.std(axis=1) / np.sqrt(weights.shape[1])
    difference = np.abs(weights.mean(axis=1) - there.light.sum(axis=1) * angle)
    assert (difference < 5 * error + 2e-3).all(), (weights.mean(axis=1), there.light.sum(axis=1) * angle)


@pytest.mark.parametrize("name", ["multiscatter", "glass of all roughnesses", "oren-nayar"])
@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("degrees", [10, 60, 80])
@pytest.mark.parametrize("behind", SIDES)
def test_a_white_furnace_stays_white(name, roughness, degrees, behind):
    shader = {
        "multiscatter": node("glossy", color=WHITE, roughness=roughness),
        "glass of all roughnesses": node("glass", color=WHITE, roughness=roughness, ior=1.45),
        "oren-nayar": node("diffuse", color=WHITE, roughness=roughness),
    }[name]
    drawn = ScatteredBy(shader, incoming(degrees), (0, 0, 1), numbers(60_000), behind)
    weights = drawn.weight[0] * ((drawn.sampled[2] > 0) != (drawn.kind == 8))
    error = weights.std() / np.sqrt(len(weights))
    # The tables hold it to 1e-3 between nodes. Of glass they count refractions that go upwards, which are lost: calibrated.
    lost = (0.2 if behind else 0.06) if name.startswith("glass") and roughness > 0.2 else 2e-3
    assert -lost - 5 * error < weights.mean() - 1 < 2e-3 + 5 * error, weights.mean()


@pytest.mark.parametrize("name", ["ggx", "stretched", "velvet", "beckmann", "metal", "conductor", "lambert", "oren-nayar"])
def test_light_goes_both_ways_alike(name):
    """Light that is scattered more than once does not, as in Cycles."""
    shader = ROUGH[name]
    if shader.type == "metallic":
        shader = node("metallic", **dict(shader.inputs) | {"distribution": "ggx"})
    rng = np.random.default_rng(3)
    first, other = (rng.normal(size=(3, COUNT)) for _ in range(2))
    for each in (first, other):
        each[2] = np.abs(each[2]) + 0.05
        each /= np.linalg.norm(each, axis=0)
    forth, back = (
        np.stack([ScatteredBy(shader, -seen[:, i], lit[:, i], np.zeros((3, 1))).light[:, 0] for i in range(COUNT)], axis=1)
        / lit[2]
        for seen, lit in ((first, other), (other, first))
    )
    np.testing.assert_allclose(forth, back, rtol=1e-12)


def test_inputs_that_vary_are_numbers_by_their_luminance():
    assert Color((0.0, 1.0, 0.0), vertex=True).varies and not Color(WHITE).varies


def test_a_constant_color_is_a_number_by_its_luminance():
    """Also where a node has made it, which is then a constant itself."""
    luminance = np.dot((0.2126390, 0.7151687, 0.0721923), (0.5, 0.25, 1.0))
    for color in ((0.5, 0.25, 1.0), node("gamma", color=(0.5, 0.25, 1.0))):
        assert constant_value(node("math", operation="add", a=color, b=0.0))[1] == pytest.approx(luminance, rel=1e-12)


@pytest.mark.parametrize("version", [402, 502])
def test_a_tinted_coat_that_bends_no_light_is_black_toward_grazing(version):
    """Its way through is 1/cos, so that the tint's power leaves float64's range; a coat of IOR 1 reflects nothing."""
    cosines = np.array([1.0, 0.5, 0.1, 0.01, 1e-3, 9e-4, 1e-4, 1e-9, 1e-160])
    came = np.stack([np.sqrt(1 - cosines**2), 0 * cosines, -cosines])
    tint = (1.0, 0.5, 1e-30)

    def light(coat_tint):
        shader = node("principled", base_color=WHITE, coat_weight=1.0, coat_ior=1.0, coat_tint=coat_tint)
        return ScatteredBy(shader, came, (0, 0, 1), numbers(len(cosines)), version=version).light

    expected = np.array([np.exp(np.maximum(np.log(each) / cosines, -800)) for each in tint])
    bare, coated = light(WHITE), light(tint)
    assert (bare > 0).all()
    # cos² is had from 1 − cos², to 2⁻⁵³: of 0.01 and a power of 7, 4e-14. Lobes that bring next to nothing are left out.
    np.testing.assert_allclose(coated / bare, expected, rtol=1e-12, atol=1e-15)
    brighter = light((1.5, 1.0, 1.0))
    assert np.isfinite(brighter).all() and (brighter >= bare).all()
