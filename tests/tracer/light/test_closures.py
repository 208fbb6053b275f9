"""Closures by themselves: densities are densities, samples follow them, no light is made, and light goes both ways alike.

And what they are made of: directions over cones and hemispheres, Fresnel, mirrored, refracted and bent rays.
"""

import numpy as np
import pytest
from core_probes import SampledLight, ScatteredBy, fresnel, reflected, refracted, specular_normal
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.tracer.native import constant_value
from viewcam_addon.tracer.scene.lamps import Point
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
    "refraction": node("refraction", **GLASSY, distribution="ggx"),  # GGX: Beckmann's tails have no density where they are 0
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


def can_be_refracted(came, directions, ratio):
    """True where some facet refracts light from (3, n) directions below to the viewer. ratio : the index of refraction."""
    bent = ratio * directions - came[:, None]
    facet = bent * np.sign(bent[2])
    return (came @ facet < 0) & ((directions * facet).sum(axis=0) < 0)


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
    if name not in OPAQUE:  # beside the density of samples it has one of light that no facet refracts
        there.pdf *= (directions[2] > 0) | can_be_refracted(came, directions, 1 / GLASSY["ior"] if behind else GLASSY["ior"])

    def cells(vectors):
        turn = np.arctan2(vectors[1], vectors[0]) / (2 * np.pi) % 1
        return np.minimum(((vectors[2] + 1) * 4).astype(int), 7) * 16 + np.minimum((turn * 16).astype(int), 15)

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


SEEDS = st.integers(0, 2**32 - 1)
RATIOS = st.floats(0.05, 20.0)
ROUNDING = 2.0**-52


def dot(a, b):
    return (a * b).sum(axis=0)


def axes_about(normal):
    """Two unit vectors, (3, n) each, at right angles to unit vectors and to each other."""
    aside = np.where(np.abs(normal[0]) < 0.5, [[1.0], [0.0], [0.0]], [[0.0], [1.0], [0.0]])
    first = np.cross(normal.T, aside.T).T
    first /= np.sqrt(dot(first, first))
    return first, np.cross(normal.T, first.T).T


def cosine_direction(normal, u):
    """Directions as often as their cosine is large, and the density: those of a lamp that a point stands inside of."""
    around = SampledLight(Point("around", radius=1.0), np.zeros(3), normal, u)
    return around.direction, around.pdf


def random_units(rng, count=200):
    """Unit vectors, some along the axes and some a hair beside −z, where frames have their singularities."""
    vectors = rng.normal(size=(3, count))
    vectors[:, 0], vectors[:, 1] = (0, 0, 1), (0, 0, -1)
    vectors[:, 2] = (1e-9, -1e-12, -1)
    vectors[:, 3] = (0, 1, -0.0)
    return vectors / np.sqrt(dot(vectors, vectors))


def incident(rng, flattest=1e-9, count=200):
    """Directions and normals on the side that they come from, from perpendicular to grazing, and the cosines between them."""
    normal = random_units(rng, count)
    cosine = np.concatenate([[1.0, 1e-3, flattest], np.maximum(rng.random(count - 3), flattest)])
    turn = rng.random(count) * 2 * np.pi
    first, second = axes_about(normal)
    across = np.cos(turn) * first + np.sin(turn) * second
    return np.sqrt(1 - cosine * cosine) * across - cosine * normal, normal, cosine


def from_angle(degrees):
    """A direction that meets a floor, z up, at so many degrees from its normal, and the normal."""
    angle = np.radians(degrees)
    return np.array([[np.sin(angle)], [0.0], [-np.cos(angle)]]), np.array([[0.0], [0.0], [1.0]])


@given(SEEDS)
def test_cosine_directions_are_unit_and_above_their_surface_with_the_cosine_over_pi_as_density(seed):
    rng = np.random.default_rng(seed)
    normal = random_units(rng)
    u = rng.random((2, 200))
    normal[:, 4:8] = normal[:, [0, 0, 1, 1]]
    u[0, :8] = [0.0, 0.5, 1 - 2**-53, 0.0, 0.0, 1 - 2**-53, 0.0, 1 - 2**-53]  # with normals along ±z
    direction, density = cosine_direction(normal, u)
    cosine = dot(direction, normal)
    np.testing.assert_allclose(dot(direction, direction), 1, atol=16 * ROUNDING)
    assert (cosine >= -4 * ROUNDING).all()
    np.testing.assert_allclose(density, cosine / np.pi, atol=4 * ROUNDING)


def test_cosine_directions_fill_rings_and_sectors_of_equal_projected_area_equally_often():
    """In sin² of the angle and in the turn about the normal they are uniform: 16 × 16 cells, χ² of 255 degrees of freedom."""
    rng = np.random.default_rng(1)
    count = 256 * 400
    direction, _ = cosine_direction(np.tile([[0.0], [0.0], [1.0]], count), rng.random((2, count)))
    ring = np.minimum((direction[0] ** 2 + direction[1] ** 2) * 16, 15).astype(int)
    sector = ((np.arctan2(direction[1], direction[0]) / (2 * np.pi) + 0.5) * 16).astype(int) % 16
    cells = np.bincount(ring * 16 + sector, minlength=256)
    squares = ((cells - 400) ** 2 / 400).sum()
    assert abs(squares - 255) < 4 * np.sqrt(2 * 255), f"χ² is {squares:.0f}"


def test_cosine_directions_of_a_grid_are_spread_as_evenly_as_the_grid():
    """The mean of cos² is ½; on a grid of 64² it is off by far less than 4,096 random directions, by 5e-3, would be."""
    grid = (np.mgrid[:64, :64].reshape(2, -1) + 0.5) / 64
    _, density = cosine_direction(np.tile([[0.0], [0.0], [1.0]], 64 * 64), grid)
    assert np.mean((density * np.pi) ** 2) == pytest.approx(0.5, abs=3e-4)


def test_a_mirror_at_45_degrees_turns_a_ray_by_a_right_angle():
    direction, normal = from_angle(45)
    np.testing.assert_allclose(reflected(direction, normal)[:, 0], [np.sqrt(0.5), 0, np.sqrt(0.5)], atol=ROUNDING)


@given(SEEDS)
def test_a_mirror_keeps_the_angle_and_the_plane_and_gives_the_ray_back_when_turned_round(seed):
    direction, normal, cosine = incident(np.random.default_rng(seed))
    away = reflected(direction, normal)
    np.testing.assert_allclose(dot(away, normal), cosine, atol=8 * ROUNDING)
    np.testing.assert_allclose(away + dot(direction, normal) * normal, direction - dot(direction, normal) * normal, atol=1e-15)
    np.testing.assert_allclose(reflected(-away, normal), -direction, atol=8 * ROUNDING)


@pytest.mark.parametrize(
    ("ratio", "angle", "beyond"), [(1.5, 30, 19.4712206345), (1.33, 60, 40.6281306515), (1 / 1.5, 30, 48.5903779)]
)
def test_snells_angles_are_those_of_the_textbook(ratio, angle, beyond):
    direction, normal = from_angle(angle)
    through, total = refracted(direction, normal, ratio)
    assert not total[0]
    assert np.degrees(np.arctan2(through[0, 0], -through[2, 0])) == pytest.approx(beyond, abs=1e-6)


@given(SEEDS, RATIOS)
def test_refraction_obeys_snell_and_is_the_same_path_backwards(seed, ratio):
    direction, normal, cosine = incident(np.random.default_rng(seed), flattest=1e-3)
    through, total = refracted(direction, normal, ratio)
    clear = np.abs(1 - cosine * cosine - ratio * ratio) > 1e-12  # not at the critical angle's last bits
    np.testing.assert_array_equal(total[clear], (1 - cosine * cosine > ratio * ratio)[clear])
    through, normal, direction, cosine = through[:, ~total], normal[:, ~total], direction[:, ~total], cosine[~total]
    np.testing.assert_allclose(dot(through, through), 1, atol=16 * ROUNDING)
    sine = np.sqrt(1 - cosine * cosine)
    beyond = np.sqrt(dot(np.cross(through.T, normal.T).T, np.cross(through.T, normal.T).T))
    np.testing.assert_allclose(beyond * ratio, sine, atol=64 * ROUNDING * max(ratio, 1 / ratio))
    back, total = refracted(-through, -normal, 1 / ratio)
    flat = np.abs(dot(through, normal)) < 1e-3  # there a rounding of the sine moves the cosine by its root
    np.testing.assert_allclose(back[:, ~flat], -direction[:, ~flat], atol=1e-12)
    assert not total[~flat].any()


def test_refraction_between_sides_that_are_alike_goes_straight_on_and_reflects_nothing():
    direction, normal, cosine = incident(np.random.default_rng(2), flattest=1e-3)
    through, total = refracted(direction, normal, 1.0)
    np.testing.assert_allclose(through, direction, atol=1e-12)
    assert not total.any()
    assert (fresnel(cosine, np.ones(len(cosine))) <= 1e-15).all()


def test_glass_seen_straight_reflects_4_percent_and_from_inside_as_much():
    assert fresnel(np.array([1.0]), 1.5)[0] == pytest.approx(0.04, abs=1e-15)
    assert fresnel(np.array([1.0]), 1 / 1.5)[0] == pytest.approx(0.04, abs=1e-15)


@pytest.mark.parametrize("ratio", [1.1, 1.5, 2.4, 1 / 1.5])
def test_at_brewsters_angle_light_that_vibrates_in_the_plane_is_not_reflected(ratio):
    """There tan = ratio; what is left is half of the other's (ratio² − 1)² / (ratio² + 1)²."""
    cosine = np.cos(np.arctan(ratio))
    expected = 0.5 * ((ratio**2 - 1) / (ratio**2 + 1)) ** 2
    assert fresnel(np.array([cosine]), ratio)[0] == pytest.approx(expected, abs=1e-14)


def test_beyond_the_critical_angle_all_light_is_reflected():
    critical = np.arcsin(1 / 1.5)
    below, above = fresnel(np.cos([critical - 1e-6, critical + 1e-6]), 1 / 1.5)
    assert below < 0.992 and above == 1.0
    for angle, expected in ((critical - 1e-6, False), (critical + 1e-6, True)):
        assert refracted(*from_angle(np.degrees(angle)), 1 / 1.5)[1][0] == expected


@given(SEEDS, RATIOS)
def test_what_is_reflected_and_what_is_refracted_are_all_the_light_in_both_ways(seed, ratio):
    """Fresnel's amplitudes, which the code does not use, give what goes through; R is the same from behind (Stokes)."""
    direction, normal, cosine = incident(np.random.default_rng(seed), flattest=1e-3)
    through, total = refracted(direction, normal, ratio)
    reflectance = fresnel(cosine, ratio)
    np.testing.assert_allclose(reflectance[total], 1, atol=1e-6)  # the root of a rounding, at the critical angle
    cosine, beyond, reflectance = cosine[~total], -dot(through, normal)[~total], reflectance[~total]
    perpendicular = 2 * cosine / (cosine + ratio * beyond)
    parallel = 2 * cosine / (ratio * cosine + beyond)
    transmittance = ratio * beyond / cosine * (perpendicular**2 + parallel**2) / 2
    steep = beyond > 1e-3
    np.testing.assert_allclose((reflectance + transmittance)[steep], 1, atol=1e-9)
    np.testing.assert_allclose(fresnel(beyond, 1 / ratio)[steep], reflectance[steep], atol=1e-9)


@given(RATIOS)
def test_fresnels_share_lies_between_0_and_1_and_is_1_along_the_surface(ratio):
    shares = fresnel(np.linspace(0, 1, 1001), ratio)
    assert ((shares >= 0) & (shares <= 1)).all() and shares[0] == pytest.approx(1.0, abs=4 * ROUNDING)


@given(SEEDS)
def test_specular_normals_send_every_ray_above_the_surface_and_change_no_other(seed):
    rng = np.random.default_rng(seed)
    direction, normal, cosine = incident(rng)
    shading = random_units(rng)
    shading *= np.copysign(1.0, dot(shading, normal))
    bent = specular_normal(direction, normal, shading)
    rise, before = (dot(direction - 2 * dot(direction, each) * each, normal) for each in (bent, shading))
    least = np.minimum(0.9 * cosine, 0.01)
    clear = np.abs(before - least) > 1e-12  # beyond what roundings decide
    bent, shading, normal = (each[:, clear] for each in (bent, shading, normal))
    rise, before, least = (each[clear] for each in (rise, before, least))
    fine = before >= least
    np.testing.assert_array_equal(bent[:, fine], shading[:, fine])
    np.testing.assert_allclose(rise[~fine], least[~fine], atol=1e-9)
    np.testing.assert_allclose(dot(bent, bent), 1, atol=16 * ROUNDING)
    volume = dot(bent, np.cross(normal.T, shading.T).T)
    np.testing.assert_allclose(volume[~fine], 0, atol=1e-12, err_msg="bent out of the plane of the two normals")
    assert (dot(bent, shading)[~fine] >= dot(normal, shading)[~fine] - 1e-12).all(), "bent farther than to the true normal"


def test_normals_that_send_rays_above_the_surface_are_handed_back_as_they_are():
    direction, normal = from_angle(60)
    shading = np.array([[0.1], [0.0], [np.sqrt(0.99)]])
    for each in (normal, shading):
        assert np.array_equal(specular_normal(direction, normal, each), each)
