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
HALF = 0.25  # of the square lamp, in the middle of the ceiling
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
