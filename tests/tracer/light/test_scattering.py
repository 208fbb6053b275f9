import numpy as np
import pytest
from core_probes import SampledLight, fresnel, reflected, refracted, specular_normal
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.tracer.scene.lamps import Point

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
