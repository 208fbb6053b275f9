"""Whole pictures of light whose answer is known on paper.

What is random is judged by the mean of the picture: it must lie within 3 standard errors of the answer, and these must be
small. What is not random is judged by rounding.
"""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.colors import WHITE
from viewcam_addon.tracer.scene.film import Bounces, Film
from viewcam_addon.tracer.scene.lamps import Area, Point, Sun, World
from viewcam_addon.tracer.scene.materials import Color, Material, Picture, sum_of
from viewcam_addon.tracer.scene.shader_nodes import node

FLOAT32 = 2.0**-24
# A picture is a mean of float64, rounded once; smooth normals are float32, and what only visibility sees.
ROUNDED = 4 * FLOAT32
DOWN = Pinhole((0, 0, 4), (0, 0, 0), (0, 1, 0), 40, 32, 24)
"""Looks down at the origin, where a pixel is 0.1 wide."""
SUN = Sun("sun", towards=(1, -2, 3), irradiance=(3, 2, 1))


def lambert(*albedo) -> Material:
    return sum_of(diffuse=Color(albedo if len(albedo) == 3 else albedo * 3))


def glow(*radiance) -> Material:
    return sum_of(emission=Color(radiance if len(radiance) == 3 else radiance * 3))


def square(make_mesh, half=1.0, height=0.0, x=0.0, y=0.0, up=True):
    corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    return make_mesh(np.add(corners, (x, y, height)), [[0, 1, 2], [0, 2, 3]] if up else [[0, 2, 1], [0, 3, 2]])


def box(make_mesh, half=1.0):
    """A cube round the origin."""
    corners = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return make_mesh(corners, [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))])


def deviation(passes, expected):
    """The error of the picture's mean over all channels, in standard errors, and the standard error relative to it."""
    picture, variance = (passes[name][..., :3].astype(np.float64) for name in ("Combined", "Variance"))
    mean, error = picture.mean(), np.sqrt(variance.sum()) / picture.size
    return (mean - np.mean(expected)) / max(error, ROUNDED * np.mean(expected)), error / np.mean(expected)


def assert_close(passes, expected, precision):
    off, error = deviation(passes, expected)
    assert error <= precision, f"the standard error is {error:.2%}, too much to tell anything"
    assert abs(off) <= 3, f"{off:+.1f} standard errors of {error:.3%} off"


# Lamps and a sky that is darker


@pytest.mark.parametrize("count", [1, 2, 4, 5])
@pytest.mark.parametrize("level", ["direct", "path"])
def test_suns_and_a_much_darker_sky_add_up(make_mesh, make_lit, count, level):
    """The sky gets a ray of few samples only, where lamps are asked one by one; from five on they are not."""
    suns = tuple(replace(SUN, name=str(number), angle=0.2, irradiance=(3 / 2**number,) * 3) for number in range(count))
    scene = make_lit(DOWN, (square(make_mesh, 9.0), lambert(0.5)), lamps=suns, world=World((0.1, 0.1, 0.1)))
    # The mean cosine over a sun's disc is that of its middle, less a part of 0.1²/4 of which the tests' 1 % is four times.
    received = sum(sun.irradiance[0] for sun in suns) * 3 / np.sqrt(14) / np.pi
    assert_close(render(scene, level, 64, threads=1), 0.5 * (received + 0.1), 0.002)


# Furnaces


def furnace(make_mesh, make_lit, albedo, bounces, samples=64):
    camera = Pinhole((0.3, -0.2, 0.1), (1, 0.5, 0.7), (0, 0, 1), 20, 32, 24)
    material = sum_of(diffuse=Color((albedo,) * 3), emission=Color((1.0,) * 3))
    return render(make_lit(camera, (box(make_mesh), material), bounces=bounces), "path", samples, threads=1)


def in_furnace(albedo, scatterings):
    """E (1 + ρ + … + ρᵏ): a path that is scattered k times sees the emission of k + 1 places."""
    return sum(albedo**k for k in range(scatterings + 1))


@pytest.mark.parametrize("albedo", [0.3, 0.8])
@pytest.mark.parametrize("bounces", [0, 1, 2, 5])
def test_a_furnace_has_the_sum_of_as_many_reflections_as_there_are_bounces_and_one(make_mesh, make_lit, albedo, bounces):
    passes = furnace(make_mesh, make_lit, albedo, Bounces(bounces, 1024, 1024, 1024))
    assert_close(passes, in_furnace(albedo, bounces + 1), 0.01)


def test_a_furnace_without_limits_has_one_over_one_minus_albedo(make_mesh, make_lit):
    assert_close(furnace(make_mesh, make_lit, 0.8, Bounces(1024, 1024, 1024, 1024)), 1 / (1 - 0.8), 0.01)


def test_diffuse_bounces_are_limited_by_their_own_number(make_mesh, make_lit):
    assert_close(furnace(make_mesh, make_lit, 0.8, Bounces(12, 2, 0, 0)), in_furnace(0.8, 3), 0.01)


def test_a_white_ball_in_a_white_world_can_not_be_seen(ball, make_spheres, make_lit):
    camera = Pinhole((0, -4, 1), (0, 0, 0), (0, 0, 1), 40, 32, 24)
    flat = ball(12)
    flat = type(flat)(flat.vertices, flat.triangles, flat.materials)
    for shape in (flat, make_spheres([[0, 0, 0]], 1)):
        scene = make_lit(camera, (shape, lambert(1)), world=World((1, 1, 1)))
        passes = render(scene, "path", 16, threads=1)
        # Rays that rise from a facet by less than 2⁻¹⁸ count as blocked: a part of 2⁻³⁶ of the light.
        assert np.abs(passes["Combined"][..., :3] - 1).max() <= ROUNDED
        assert (passes["Diffuse Color"] > 0).any()


@pytest.mark.parametrize("level", ["direct", "path"])
@pytest.mark.parametrize(("hidden", "expected"), [("shadow", 0.0), ("diffuse", 0.5)])
def test_the_world_is_hidden_by_what_diffuse_rays_see_and_not_by_what_shadow_rays_see(
    make_mesh, make_lit, level, hidden, expected
):
    floor, roof = square(make_mesh, 3.0), square(make_mesh, 1e4, 5.0)
    scene = make_lit(DOWN, (floor, lambert(0.5)), (roof, lambert(0)), world=World((1, 1, 1)), bounces=Bounces(2, 2, 2, 2))
    roofed = replace(scene.objects[1], hidden_from=frozenset([hidden]))
    picture = render(replace(scene, objects=(scene.objects[0], roofed)), level, 4)["Combined"][..., :3]
    # Beside the roof a part of (5 / 1e4)² of the sky is seen.
    assert abs(picture.mean(dtype=float) - expected) <= 1e-4, f"{picture.mean():.4f} and not {expected}"


def test_a_smooth_ball_in_a_white_world_loses_what_its_normals_send_into_it(ball, make_lit):
    """The part of the cosine lobe about N_s beyond the plane of N_g is (1 − N_s·N_g)/2; a convex ball loses nothing else."""
    camera = Pinhole((0, -4, 1), (0, 0, 0), (0, 0, 1), 60, 32, 24)
    scene = make_lit(camera, (ball(12), lambert(1)), world=World((1, 1, 1)))
    passes, seen = render(scene, "path", 256, threads=1), render(scene)
    flat = ball(12)
    flat = render(make_lit(camera, (type(flat)(flat.vertices, flat.triangles, flat.materials), lambert(1))))["Normal"]
    lost = (1 - (seen["Normal"] * flat).sum(axis=-1)) / 2
    inside = (passes["Diffuse Color"] == 1).all(axis=-1)  # no pixels of the outline; normals there are those of their centers
    off = passes["Combined"][inside][:, 0] - 1 + lost[inside]
    error = np.sqrt(passes["Variance"][inside][:, 0].sum()) / inside.sum()
    assert lost[inside].mean() > 10 * error, "there is something to lose"
    # The mean of N_s·N_g over a pixel differs from that at its center by its curvature, here by less than the noise.
    assert abs(off.mean()) <= 3 * error, f"{off.mean():.1e}, {off.mean() / error:+.1f} standard errors"


def test_clear_glass_in_a_white_world_can_not_be_seen(ball, make_mesh, make_spheres, make_lit):
    camera = Pinhole((0, -4, 1), (0, 0, 0), (0, 0, 1), 40, 32, 24)
    flat = ball(12)
    flat = type(flat)(flat.vertices, flat.triangles, flat.materials)
    without_end = Bounces(1024, 1024, 1024, 1024)
    for shape in (flat, box(make_mesh, 0.7), make_spheres([[0, 0, 0]], 1)):
        for material in (sum_of(glass=Color((1, 1, 1)), ior=1.5), sum_of(mirror=Color((1, 1, 1)))):
            scene = make_lit(camera, (shape, material), world=World((1, 1, 1)), bounces=without_end)
            picture = render(scene, "path", 8, threads=1)["Combined"]
            assert np.abs(picture[..., :3] - 1).max() <= ROUNDED, f"{np.abs(picture[..., :3] - 1).max():.1e}"


# Lamps


def test_a_plane_under_a_sun_has_albedo_times_irradiance_times_cosine_over_pi(make_mesh, make_lit):
    scene = make_lit(DOWN, (square(make_mesh, 10), lambert(0.8, 0.5, 0.2)), lamps=(SUN,))
    passes = render(scene, "direct", 1, threads=1)
    expected = np.array([0.8, 0.5, 0.2]) / np.pi * SUN.irradiance * SUN.towards[2]
    assert np.abs(passes["Combined"][..., :3] / expected - 1).max() <= ROUNDED
    assert np.abs(passes["Diffuse Direct"] / (SUN.irradiance * np.array(SUN.towards[2] / np.pi)) - 1).max() <= 2 * ROUNDED
    assert (passes["Variance"] == 0).all() and (passes["Combined"][..., 3] == 1).all()


def test_a_plane_under_a_point_has_power_over_four_pi_square_distance_times_cosine(make_mesh, make_lit):
    lamp = Point("point", position=(0.5, -0.3, 1.5), power=(30, 20, 10))
    passes = render(make_lit(DOWN, (square(make_mesh, 10), lambert(0.8)), lamps=(lamp,)), "direct", 1, threads=1)
    rows, columns = np.mgrid[: DOWN.height, : DOWN.width]
    directions = DOWN.ray_directions(columns, rows)
    floor = directions * (-4 / directions[..., 2:]) + (0, 0, 4)
    way = np.array(lamp.position) - floor
    distance = np.linalg.norm(way, axis=-1)
    irradiance = np.array(lamp.power) / (4 * np.pi * distance[..., None] ** 2) * (way[..., 2] / distance)[..., None]
    assert np.abs(passes["Combined"][..., :3] / (0.8 / np.pi * irradiance) - 1).max() <= ROUNDED


def test_a_lambert_sphere_under_a_sun_is_bright_by_its_cosine_and_dark_behind(make_spheres, make_lit):
    camera = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 80, 48, 36)
    passes = render(make_lit(camera, (make_spheres([[0, 0, 0]], 1), lambert(0.5)), lamps=(SUN,)), "direct", 1, threads=1)
    rows, columns = np.mgrid[: camera.height, : camera.width]
    ray = camera.ray_directions(columns, rows)
    along = 5 * -ray[..., 2]
    root = along**2 - (25 - 1)
    met = root > 0
    normal = ray[met] * (along[met] - np.sqrt(root[met]))[:, None] + (0, 0, 5)
    expected = 0.5 / np.pi * np.array(SUN.irradiance) * np.maximum(normal @ SUN.towards, 0)[:, None]
    assert 0.02 < (expected == 0).mean() < 0.6, "both sides are seen"
    # Near the terminator the cosine is a small difference: absolutely, it is rounded as elsewhere.
    assert np.abs(passes["Combined"][met][:, :3] - expected).max() <= ROUNDED * expected.max()
    assert (passes["Combined"][~met] == (0, 0, 0, 1)).all()


def lit_from_above(make_mesh, make_lit, lamp=None, body=None, samples=64, seed=0, albedo=0.8, **light):
    """The middle of a plane, 0.0016 wide, from below a lamp or a thing that shines: what it gets differs there by 1e-6."""
    camera = Pinhole((0, 0, 0.5), (0, 0, 0), (0, 1, 0), 5000, 16, 12)
    bodies = [(square(make_mesh, 0.05), lambert(albedo))] + ([body] if body else [])
    return render(make_lit(camera, *bodies, lamps=(lamp,) if lamp else (), **light), "direct", samples, seed, threads=1)


def facing_rectangle(half_x, half_y, height):
    """Form factor from a point to a parallel rectangle centered above it: four times that of a quarter, with a corner there
    (Howell, A Catalog of Radiation Configuration Factors, B-3)."""
    x, y = half_x / height, half_y / height
    a, b = np.hypot(1, x), np.hypot(1, y)
    return 4 / (2 * np.pi) * (x / a * np.arctan(y / a) + y / b * np.arctan(x / b))


def above(height, scale=(1, 1, 1)):
    """An area lamp's matrix: it shines down from there."""
    matrix = np.diag([*scale, 1.0])
    matrix[2, 3] = height
    return matrix


@pytest.mark.parametrize("ellipse", [False, True])
def test_an_area_lamp_lights_a_point_by_its_form_factor(make_mesh, make_lit, ellipse):
    lamp = Area("area", matrix=above(1.0), size=(1.6, 1.6 if ellipse else 0.6), power=(10, 10, 10), ellipse=ellipse)
    area = np.pi * 0.8**2 if ellipse else 1.6 * 0.6
    factor = 0.8**2 / (0.8**2 + 1) if ellipse else facing_rectangle(0.8, 0.3, 1.0)
    passes = lit_from_above(make_mesh, make_lit, lamp)
    assert_close(passes, 0.8 * 10 / (np.pi * area) * factor, 0.005)


def test_a_shining_square_lights_a_point_by_its_form_factor(make_mesh, make_lit):
    passes = lit_from_above(make_mesh, make_lit, body=(square(make_mesh, 0.5, 1.0), glow(5)))
    assert_close(passes, 0.8 * 5 * facing_rectangle(0.5, 0.5, 1.0), 0.005)


def test_a_shining_principled_square_lights_by_the_mean_of_its_image(make_mesh, make_lit):
    images = {"screen": Picture(np.tile(np.array([[[7.0], [3.0]]], np.float32), (1, 1, 3)))}
    screen = Material(node("principled", emission_color=Color(WHITE, image="screen"), emission_strength=1.0))
    mesh = replace(square(make_mesh, 0.5, 1.0), corner_uvs=np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], "f4"))
    passes = lit_from_above(make_mesh, make_lit, body=(mesh, screen), images=images)
    assert_close(passes, 0.8 * 5 * facing_rectangle(0.5, 0.5, 1.0), 0.005)


def test_a_coat_dims_what_shines_below_it_alike_in_all_colors(make_mesh, make_lit):
    def light_of(color):
        coated = Material(node("principled", emission_color=color, emission_strength=5.0, coat_weight=1.0))
        return lit_from_above(make_mesh, make_lit, body=(square(make_mesh, 0.5, 1.0), coated))["Combined"][..., 1]

    np.testing.assert_allclose(light_of((0.0, 1.0, 1.0)), light_of(WHITE), rtol=ROUNDED)


@pytest.mark.parametrize("radius", [0.05, 0.5, 0.9])
def test_a_spherical_lamp_above_the_horizon_lights_as_a_point_does(make_mesh, make_lit, radius):
    lamp = Point("point", position=(0, 0, 1.5), power=(10, 10, 10), radius=radius)
    assert_close(lit_from_above(make_mesh, make_lit, lamp), 0.8 / np.pi * 10 / (4 * np.pi * 1.5**2), 0.005)


# Unbiased


def test_means_of_many_pictures_are_right_at_any_number_of_samples(make_mesh, make_lit):
    """A picture of N samples is not wrong by a part of 1/N, or of anything: the mean over seeds is."""
    expected = 0.8 * 5 * facing_rectangle(0.5, 0.5, 1.0)
    for samples in (1, 4, 16, 64):
        means = [
            lit_from_above(make_mesh, make_lit, body=(square(make_mesh, 0.5, 1.0), glow(5)), samples=samples, seed=seed)[
                "Combined"
            ][..., :3].mean()
            for seed in range(12)
        ]
        error = np.std(means, ddof=1) / np.sqrt(len(means))
        assert error <= 0.01 * expected
        # Student's t with 11 degrees of freedom: 3.9 is what 3 standard errors of a normal distribution are.
        assert abs(np.mean(means) - expected) <= 3.9 * error, f"{samples} samples: {np.mean(means) / expected - 1:+.3%}"


# --- A box whose light is known by another method, and what sabotage does to it


# Walls of the box from −1 to 1: the axis and sign of the way out, and the albedo. The lamp is in the ceiling.
WALLS = {
    "left": (0, -1, (0.63, 0.06, 0.05)),
    "right": (0, 1, (0.14, 0.45, 0.09)),
    "floor": (2, -1, (0.73, 0.73, 0.73)),
    "ceiling": (2, 1, (0.73, 0.73, 0.73)),
    "back": (1, 1, (0.73, 0.73, 0.73)),
    "front": (1, -1, (0.2, 0.3, 0.7)),
}
BACK, CEILING = list(WALLS).index("back"), list(WALLS).index("ceiling")
RADIANCE = 10.0
HALF = 0.25  # half the square lamp, in the middle of the ceiling
# Looks at the back wall, which fills the picture: a pixel is an equal part of it.
CAMERA = Pinhole((0, -0.5, 0), (0, 1, 0), (0, 0, 1), 18, 24, 24)


def corners(axis, sign, low, high):
    """(4, 3): a rectangle in a wall, counter-clockwise seen from within. low, high : along the two other axes, in order."""
    a, b = (other for other in range(3) if other != axis)
    points = np.zeros((4, 3))
    points[:, axis] = sign
    points[:, a] = [low[0], high[0], high[0], low[0]]
    points[:, b] = [low[1], low[1], high[1], high[1]]
    inwards = np.zeros(3)
    inwards[axis] = -sign
    return points if np.cross(points[1] - points[0], points[2] - points[1]) @ inwards > 0 else points[::-1]


def form_factors(points, normals, polygons):
    """(n, m): the irradiance at points over the radiosity of polygons, (m, 4, 3), that stand before them."""
    ways = polygons[None] - points[:, None, None]
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    following = np.roll(ways, -1, axis=2)
    sides = np.cross(ways, following)
    length = np.linalg.norm(sides, axis=-1)
    angle = np.arctan2(length, (ways * following).sum(axis=-1))
    with np.errstate(invalid="ignore"):
        sides *= np.nan_to_num(angle / length)[..., None]
    return np.abs(np.einsum("nmkc,nc->nm", sides, normals)) / (2 * np.pi)


def radiosity(patches, most):
    """(most + 1, 3): the mean radiance of the back wall after 0, 1, … reflections from wall to wall.

    patches : along each side of each wall.
    """
    steps = np.linspace(-1, 1, patches + 1)
    polygons, albedo, normals = [], [], []
    for axis, sign, color in WALLS.values():
        for a in range(patches):
            for b in range(patches):
                polygons.append(corners(axis, sign, (steps[a], steps[b]), (steps[a + 1], steps[b + 1])))
                albedo.append(color)
                normals.append(-sign * np.eye(3)[axis])
    polygons, albedo, normals = np.array(polygons), np.array(albedo), np.array(normals)
    centers, walls = polygons.mean(axis=1), np.repeat(np.arange(6), patches**2)
    between = np.zeros((len(walls), len(walls)))
    from_lamp = np.zeros(len(walls))
    for wall in range(6):
        here, there = walls == wall, walls != wall
        between[np.ix_(here, there)] = form_factors(centers[here], normals[here], polygons[there])
        if wall != CEILING:
            from_lamp[here] = form_factors(centers[here], normals[here], corners(2, 1, (-HALF, -HALF), (HALF, HALF))[None])[
                :, 0
            ]
    light = first = RADIANCE * from_lamp[:, None] * albedo
    means = []
    for _ in range(most + 1):
        means.append(light[walls == BACK].mean(axis=0))
        light = first + albedo * (between @ light)
    return np.array(means)


def back_wall(make_mesh, make_lit, reflections, by_lamp=False, samples=256, seed=0, walls=WALLS, brightness=1.0):
    """The tracer's mean radiance of the back wall, and its standard error."""
    bodies = [
        (make_mesh(corners(axis, sign, (-1, -1), (1, 1)), [[0, 1, 2], [0, 2, 3]]), sum_of(diffuse=Color(color)))
        for axis, sign, color in walls.values()
    ]
    lamps, radiance = (), RADIANCE * brightness
    if by_lamp:
        matrix = np.diag([1.0, 1.0, 1.0, 1.0])
        matrix[2, 3] = 1
        power = radiance * np.pi * (2 * HALF) ** 2
        lamps = (Area("lamp", matrix=matrix, size=(2 * HALF, 2 * HALF), power=(power,) * 3),)
    else:  # part of the ceiling, which shines as well
        square = corners(2, 1, (-HALF, -HALF), (HALF, HALF)) - (0, 0, 1e-6)
        material = sum_of(diffuse=Color(walls["ceiling"][2]), emission=Color((radiance,) * 3))
        bodies.append((make_mesh(square, [[0, 1, 2], [0, 2, 3]]), material))
    scene = make_lit(CAMERA, *bodies, lamps=lamps, bounces=Bounces(reflections, 1024, 1024, 1024), film=Film(filter="BOX"))
    passes = render(scene, "path", samples, seed, threads=1)
    picture, variance = (passes[name][..., :3].astype(float) for name in ("Combined", "Variance"))
    return picture.mean(axis=(0, 1)), np.sqrt(variance.sum(axis=(0, 1))) / picture[..., 0].size


@pytest.fixture(scope="module")
def known():
    """Mean radiances of the back wall by reflections, and by how much they may be off.

    The error falls with the square of a patch's size, which gives the limit; how far two such limits are apart tells its own.
    """
    coarse, fine = (radiosity(2 * n, 60) + (radiosity(2 * n, 60) - radiosity(n, 60)) / 3 for n in (3, 5))
    return fine, np.abs(fine - coarse)


def off(known, seen, reflections):
    """By how many of the allowed errors the picture is off, in its worst channel, and the standard error relative to it."""
    (answers, errors), (mean, error) = known, seen
    allowed = 3 * error + errors[reflections]
    return np.abs((mean - answers[reflections]) / allowed).max(), (error / mean).max()


@pytest.mark.parametrize("by_lamp", [True, False])
@pytest.mark.parametrize("reflections", [0, 1, 3, 60])
def test_a_box_is_as_bright_as_radiosity_has_it(make_mesh, make_lit, known, reflections, by_lamp):
    far, error = off(known, back_wall(make_mesh, make_lit, reflections, by_lamp), reflections)
    assert error < 0.005 and (known[1] / known[0]).max() < 0.003, "that would tell nothing"
    assert far <= 1, f"{far:.2f} times what is allowed"


@pytest.mark.parametrize("by_lamp", [True, False])
def test_one_percent_more_light_is_told(make_mesh, make_lit, known, by_lamp):
    assert off(known, back_wall(make_mesh, make_lit, 3, by_lamp, brightness=1.01), 3)[0] > 1


def test_one_bounce_fewer_is_told(make_mesh, make_lit, known):
    assert off(known, back_wall(make_mesh, make_lit, 2, by_lamp=True), 3)[0] > 1


def test_an_albedo_that_is_1_percent_off_is_told(make_mesh, make_lit, known):
    darker = {name: (axis, sign, tuple(0.99 * value for value in color)) for name, (axis, sign, color) in WALLS.items()}
    assert off(known, back_wall(make_mesh, make_lit, 3, by_lamp=True, walls=darker), 3)[0] > 1


# --- Mirrors and glass: where things appear by Snell's law, and how bright by Fresnel's


WITHOUT_END = Bounces(1024, 1024, 1024, 1024)


def rectangle(make_mesh, x, y, z):
    """In the plane of height z, seen counter-clockwise from above. x, y : from and to."""
    corners = [[x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]]
    return make_mesh(corners, [[0, 1, 2], [0, 2, 3]])


def fresnel_of_angles(angle, ior):
    """Fresnel's equations as Fresnel had them, of the two angles."""
    inside = np.arcsin(np.sin(angle) / ior)
    across = (np.sin(angle - inside) / np.sin(angle + inside)) ** 2
    along = (np.tan(angle - inside) / np.tan(angle + inside)) ** 2
    return (across + along) / 2


def test_a_mirror_shows_things_where_their_mirror_images_stand(make_mesh, make_lit):
    camera = Pinhole((0, -3, 2), (0, 0, 0), (0, 0, 1), 150, 160, 120)
    patch = rectangle(make_mesh, (-0.4, 0.3), (0.5, 1.1), 1.0)
    floor = rectangle(make_mesh, (-9, 9), (-9, 9), 0.0)
    scene = make_lit(camera, (floor, sum_of(mirror=Color((0.9, 0.6, 0.3)))), (patch, glow(2)))
    picture = render(scene, "direct", 1, threads=1)["Combined"][..., :3]
    image = make_lit(camera, (rectangle(make_mesh, (-0.4, 0.3), (0.5, 1.1), -1.0), glow(2)))
    seen = render(image)["Object Index"][..., 0] == 1
    direct = render(make_lit(camera, (patch, glow(2))))["Object Index"][..., 0] == 1
    assert seen.sum() > 100 and not (seen & direct).any()
    assert np.abs(picture[seen] - 2 * np.array([0.9, 0.6, 0.3])).max() <= 8 * FLOAT32
    assert (picture[direct] == 2).all() and (picture[~seen & ~direct] == 0).all()


def test_refraction_shows_things_where_snell_says(make_mesh, make_lit):
    """From 2 above water of 1.5 that is 1 deep, the floor beyond x = 0.8 is lit: the ray at x = 2 tan a there arrives at
    2 tan a + tan b with sin a = 1.5 sin b."""
    camera = Pinhole((0, 0, 2), (0.7, 0, 0), (0, 1, 0), 1000, 400, 4)
    bodies = (
        (rectangle(make_mesh, (-9, 9), (-9, 9), 0.0), sum_of(refraction=Color((1.0, 0.5, 0.25)), ior=1.5)),
        (rectangle(make_mesh, (0.8, 9), (-9, 9), -1.0), glow(1)),
    )
    picture = render(make_lit(camera, *bodies), "direct", 1, threads=1)["Combined"][..., :3]
    rows, columns = np.mgrid[:4, :400]
    x, y, z = np.moveaxis(camera.ray_directions(columns, rows), -1, 0)
    sine = np.hypot(x, y)
    inside = np.arcsin(sine / 1.5)
    arrives = (2 * sine / -z + np.tan(inside)) * x / sine
    lit = picture[..., 0] > 0
    assert np.array_equal(lit, arrives > 0.8) and 0.1 < lit.mean() < 0.9
    assert (picture[lit] == (1.0, 0.5, 0.25)).all()


def test_glass_shares_light_out_by_fresnel(make_mesh, make_lit):
    """Water, seen flat: F of the bright ceiling and 1 − F of the floor."""
    camera = Pinhole((0, 0, 1), (5, 0, 0), (0, 0, 1), 2000, 16, 12)
    bodies = (
        (rectangle(make_mesh, (-90, 90), (-90, 90), 0.0), sum_of(glass=Color(WHITE), ior=1.33)),
        (rectangle(make_mesh, (-900, 900), (-900, 900), 9.0), glow(5)),
        (rectangle(make_mesh, (-90, 90), (-90, 90), -1.0), glow(1)),
    )
    passes = render(make_lit(camera, *bodies), "direct", 256, threads=1)
    angle = np.arccos(-camera.ray_directions(*np.meshgrid(np.arange(16), np.arange(12)))[..., 2])
    reflectance = fresnel_of_angles(angle, 1.33)
    off = passes["Combined"][..., 0] - (1 + 4 * reflectance)
    error = np.sqrt(passes["Variance"][..., 0].sum()) / off.size
    assert error <= 0.01 * 4 * reflectance.mean(), "the picture tells F"
    # A sample is not at its pixel's center, of which the angle is; over the picture that cancels but for F's curvature.
    assert abs(off.mean()) <= 3 * error, f"{off.mean() / error:+.1f} standard errors"
    assert abs(off.mean() + 4 * reflectance.mean() - 4 * ((1.33 - 1) / (1.33 + 1)) ** 2) > 30 * error, "not F of a steep ray"


def test_a_pane_of_clear_glass_shifts_what_is_behind_it(make_mesh, make_lit):
    """By its thickness times tan a − tan b; and lets through (1 − F)/(1 + F), all inner reflections told."""
    camera = Pinhole((0, 0, 3), (1.5, 0, 0), (0, 1, 0), 1000, 400, 4)
    pane = [rectangle(make_mesh, (-9, 9), (-9, 9), 1.0), rectangle(make_mesh, (-9, 9), (-9, 9), 0.5)]
    below = make_mesh(pane[1].vertices, pane[1].triangles[:, ::-1])  # its front looks down, out of the glass
    glass = sum_of(glass=Color(WHITE), ior=1.5)
    bodies = ((pane[0], glass), (below, glass), (rectangle(make_mesh, (1.2, 9), (-9, 9), -1.0), glow(1)))
    passes = render(make_lit(camera, *bodies, bounces=WITHOUT_END), "path", 128, threads=1)
    rows, columns = np.mgrid[:4, :400]
    x, _, z = np.moveaxis(camera.ray_directions(columns, rows), -1, 0)
    angle = np.arccos(-z)
    inside = np.arcsin(np.sin(angle) / 1.5)
    arrives = (3.5 * np.tan(angle) + 0.5 * np.tan(inside)) * x / np.sin(angle)
    pixel = 4 / 1000 * 1.5  # on the floor, at the most; the filter reaches 1.5 pixels
    lit, dark = arrives > 1.2 + 2 * pixel, arrives < 1.2 - 2 * pixel
    assert lit.mean() > 0.2 and dark.mean() > 0.05
    reflectance = fresnel_of_angles(angle, 1.5)
    assert (passes["Combined"][dark][:, 0] <= 0.2).all(), "only inner reflections come from farther off"
    # Rays that are reflected inside arrive farther along, all of them lit where the first is.
    off = passes["Combined"][lit][:, 0] - ((1 - reflectance) / (1 + reflectance))[lit]
    error = np.sqrt(passes["Variance"][lit][:, 0].sum()) / lit.sum()
    assert error <= 0.003 and abs(off.mean()) <= 3 * error, f"{off.mean() / error:+.1f} standard errors of {error:.4f}"


@pytest.mark.parametrize("component", ["mirror", "glass"])
def test_between_two_mirrors_light_is_reflected_as_often_as_there_are_bounces(make_mesh, make_lit, component):
    """Two mirrors of 0.5 that glow by 1: with k bounces, k + 1 reflections; each kind is limited by its own number."""
    camera = Pinhole((0, 0, 1), (0, 0.1, 0), (0, 1, 0), 500, 8, 6)
    shining = {component: Color((0.5,) * 3), "emission": Color(WHITE), "ior": 1e3 if component == "glass" else 1.45}
    floor, ceiling = rectangle(make_mesh, (-99, 99), (-99, 99), 0.0), rectangle(make_mesh, (-99, 99), (-99, 99), 2.0)
    bodies = [(floor, sum_of(**shining)), (ceiling, sum_of(**shining))]
    for bounces, reflections in ((Bounces(0, 9, 9, 9), 1), (Bounces(3, 9, 9, 9), 4), (Bounces(9, 9, 2, 9), 3)):
        scene = make_lit(camera, *bodies, bounces=bounces)
        picture = render(scene, "path", 1, threads=1)["Combined"][..., :3]
        expected = sum(0.5**k for k in range(reflections + 1))
        if component == "mirror":
            assert np.abs(picture - expected).max() <= 8 * FLOAT32
        else:  # an index of 1000 reflects 99.6 %: of 48 pixels hardly one is refracted, and sees something else
            assert np.abs(np.median(picture) - expected) <= 8 * FLOAT32


def test_what_a_mirror_shows_is_of_no_pass_but_combined(make_mesh, make_lit):
    camera = Pinhole((0, 0, 1), (0, 0.1, 0), (0, 1, 0), 500, 8, 6)
    floor = rectangle(make_mesh, (-9, 9), (-9, 9), 0.0)
    passes = render(make_lit(camera, (floor, sum_of(mirror=Color(WHITE))), world=World((1, 2, 3))), "path", 1, threads=1)
    assert (passes["Combined"] == (1, 2, 3, 1)).all()
    for name in ("Emission", "Environment", "Diffuse Direct", "Diffuse Indirect", "Diffuse Color", "Variance"):
        assert (passes[name] == 0).all(), name
