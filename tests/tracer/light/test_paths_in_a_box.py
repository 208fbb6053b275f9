"""A box whose light is known by another method, and what sabotage does to it.

The other method is radiosity: walls cut into patches, of which each gets from each other its exact form factor, seen from the
patch's centre (Lambert's formula for polygons), and a linear system that counts all reflections, or some. Nothing of the tracer
is used.
"""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.film import Bounces, Film
from viewcam_addon.tracer.scene.lamps import Area
from viewcam_addon.tracer.scene.materials import Colour, Material

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
    for axis, sign, colour in WALLS.values():
        for a in range(patches):
            for b in range(patches):
                polygons.append(corners(axis, sign, (steps[a], steps[b]), (steps[a + 1], steps[b + 1])))
                albedo.append(colour)
                normals.append(-sign * np.eye(3)[axis])
    polygons, albedo, normals = np.array(polygons), np.array(albedo), np.array(normals)
    centres, walls = polygons.mean(axis=1), np.repeat(np.arange(6), patches**2)
    between = np.zeros((len(walls), len(walls)))
    from_lamp = np.zeros(len(walls))
    for wall in range(6):
        here, there = walls == wall, walls != wall
        between[np.ix_(here, there)] = form_factors(centres[here], normals[here], polygons[there])
        if wall != CEILING:
            from_lamp[here] = form_factors(centres[here], normals[here], corners(2, 1, (-HALF, -HALF), (HALF, HALF))[None])[
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
    things = [
        (make_mesh(corners(axis, sign, (-1, -1), (1, 1)), [[0, 1, 2], [0, 2, 3]]), Material(diffuse=Colour(colour)))
        for axis, sign, colour in walls.values()
    ]
    lamps, radiance = (), RADIANCE * brightness
    if by_lamp:
        matrix = np.diag([1.0, 1.0, 1.0, 1.0])
        matrix[2, 3] = 1
        power = radiance * np.pi * (2 * HALF) ** 2
        lamps = (Area("lamp", matrix=matrix, size=(2 * HALF, 2 * HALF), power=(power,) * 3),)
    else:  # part of the ceiling, which shines as well
        square = corners(2, 1, (-HALF, -HALF), (HALF, HALF)) - (0, 0, 1e-6)
        material = Material(diffuse=Colour(walls["ceiling"][2]), emission=Colour((radiance,) * 3))
        things.append((make_mesh(square, [[0, 1, 2], [0, 2, 3]]), material))
    scene = make_lit(CAMERA, *things, lamps=lamps, bounces=Bounces(reflections, 1024, 1024, 1024), film=Film(filter="BOX"))
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
    darker = {name: (axis, sign, tuple(0.99 * value for value in colour)) for name, (axis, sign, colour) in WALLS.items()}
    assert off(known, back_wall(make_mesh, make_lit, 3, by_lamp=True, walls=darker), 3)[0] > 1
