"""The core's light against a path tracer out of the textbook: every triangle tried, directions by cosine, no more.

It shares nothing with the core but the scene and the camera's rays. Emission and sky are met by chance only, the sun is asked.
"""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.film import Bounces, Film
from viewcam_addon.tracer.scene.lamps import Sun, World
from viewcam_addon.tracer.scene.materials import Color, sum_of

CAMERA = Pinhole((0.3, -3.6, 1.2), (0, 0, 0.9), (0, 0, 1), 7, 8, 6)
SUN = Sun("sun", towards=(0.3, -0.5, 1.0), irradiance=(2.0, 1.8, 1.5))
SKY = World((0.3, 0.4, 0.6))
SAMPLES = 500
LEAST = 1e-9  # a scattered ray starts so far from where it is scattered


def quad(corner, first, second):
    corner, first, second = (np.array(each, float) for each in (corner, first, second))
    return np.array([[corner, corner + first, corner + first + second], [corner, corner + first + second, corner + second]])


# (triangles, albedo, emission): a room without ceiling or front, an oblique board in it, and a bright panel.
THINGS = [
    (quad((-2, -2, 0), (4, 0, 0), (0, 4, 0)), (0.8, 0.7, 0.6), (0, 0, 0)),
    (quad((-2, 2, 0), (4, 0, 0), (0, 0, 3)), (0.5, 0.6, 0.8), (0, 0, 0)),
    (quad((-2, -2, 0), (0, 4, 0), (0, 0, 3)), (0.9, 0.2, 0.2), (0, 0, 0)),
    (quad((0.2, -0.4, 0.1), (1.0, 0.6, 0.2), (-0.2, 0.3, 1.1)), (0.7, 0.7, 0.2), (0, 0, 0)),
    (quad((-1.2, -0.8, 2.2), (1.6, 0, 0.3), (0, 1.4, 0)), (0.3, 0.3, 0.3), (2.0, 1.6, 1.2)),
]
CORNERS = np.concatenate([triangles for triangles, _, _ in THINGS])
ALBEDO, EMISSION = (np.repeat([each[i] for each in THINGS], [len(each[0]) for each in THINGS], axis=0) for i in (1, 2))
NORMALS = np.cross(CORNERS[:, 1] - CORNERS[:, 0], CORNERS[:, 2] - CORNERS[:, 0])
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)


def nearest(origins, directions):
    """(n,) distances, inf where nothing is, and (n,) triangles: Möller and Trumbore, of all triangles."""
    a, first, second = CORNERS[:, 0], CORNERS[:, 1] - CORNERS[:, 0], CORNERS[:, 2] - CORNERS[:, 0]
    across = np.cross(directions[:, None], second)
    with np.errstate(all="ignore"):
        inverse = 1.0 / (across * first).sum(axis=-1)
        apart = origins[:, None] - a
        b1 = (apart * across).sum(axis=-1) * inverse
        aside = np.cross(apart, first)
        b2 = (aside * directions[:, None]).sum(axis=-1) * inverse
        t = (aside * second).sum(axis=-1) * inverse
    t = np.where((b1 >= 0) & (b2 >= 0) & (b1 + b2 <= 1) & (t > LEAST), t, np.inf)
    return t.min(axis=1), t.argmin(axis=1)


def scattered(rng, normals):
    """Directions about normals by Lambert's cosine: a point of the unit sphere, added to the normal."""
    z, turn = rng.uniform(-1, 1, len(normals)), rng.uniform(0, 2 * np.pi, len(normals))
    on_sphere = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    directions = normals + on_sphere
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def paths(rng, pixels, bounces):
    """(n, 3): the light of a random path through each of n pixels."""
    directions = CAMERA.ray_directions(pixels % CAMERA.width, pixels // CAMERA.width, *rng.random((2, len(pixels))))
    origins = np.broadcast_to(np.array(CAMERA.eye), directions.shape)
    light, throughput, alive = np.zeros((len(pixels), 3)), np.ones((len(pixels), 3)), np.arange(len(pixels))
    towards = np.array(SUN.towards) / np.linalg.norm(SUN.towards)
    for scattering in range(bounces + 2):
        t, triangle = nearest(origins, directions)
        met = np.isfinite(t)
        light[alive[~met]] += throughput[~met] * SKY.radiance
        alive, throughput, triangle = alive[met], throughput[met], triangle[met]
        light[alive] += throughput * EMISSION[triangle]
        if scattering > bounces:
            break
        points = origins[met] + directions[met] * t[met, None]
        normals = NORMALS[triangle] * -np.sign((NORMALS[triangle] * directions[met]).sum(axis=1, keepdims=True))
        throughput = throughput * ALBEDO[triangle]
        rises = normals @ towards
        lit = (rises > 0) & np.isinf(nearest(points, np.broadcast_to(towards, points.shape))[0])
        light[alive] += throughput * (np.where(lit, rises, 0) / np.pi)[:, None] * SUN.irradiance
        origins, directions = points, scattered(rng, normals)
    return light


def textbook(bounces, seed=1):
    """(height, width, 3): means, and their variances."""
    rng, count = np.random.default_rng(seed), CAMERA.width * CAMERA.height
    light = paths(rng, np.repeat(np.arange(count), SAMPLES), bounces).reshape(CAMERA.height, CAMERA.width, SAMPLES, 3)
    return light.mean(axis=2), light.var(axis=2, ddof=1) / SAMPLES


@pytest.fixture
def traced(make_lit, make_mesh):
    """traced(bounces) → (height, width, 3): the core's means, and their variances."""

    def trace(bounces):
        bodies = []
        for triangles, albedo, emission in THINGS:
            colors = {"diffuse": Color(albedo), **({"emission": Color(emission)} if any(emission) else {})}
            bodies.append((make_mesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles))), sum_of(**colors)))
        light = {"lamps": (SUN,), "world": SKY, "film": Film(filter="BOX"), "bounces": Bounces(bounces, bounces, 0, 0)}
        passes = render(make_lit(CAMERA, *bodies, **light), "path", 1024, 1)
        return passes["Combined"][..., :3].astype(float), passes["Variance"].astype(float)

    return trace


def off_by(actual, expected):
    """Standard errors between two pictures: (height, width, 3), and of their means."""
    (mean, variance), (other_mean, other_variance) = actual, expected
    rounding = 2.0**-23 * np.abs(other_mean)  # pixels without noise differ by rounding
    apart, error = mean - other_mean, np.sqrt(variance + other_variance + rounding**2)
    return apart / error, apart.sum() / np.sqrt((error**2).sum())


@pytest.mark.parametrize("bounces", [0, 3])
def test_light_is_what_the_textbook_says(traced, bounces):
    each, whole = off_by(traced(bounces), textbook(bounces))
    assert abs(whole) < 4, f"the picture is off by {whole:+.1f} standard errors"
    # One of 144 normal numbers exceeds 5 once in 12,000 pictures.
    assert np.abs(each).max() < 5, f"a pixel is off by {np.abs(each).max():.1f} standard errors"


def test_a_bounce_less_would_be_told(traced):
    _, whole = off_by(traced(2), textbook(1))
    assert whole > 6, f"the picture is off by {whole:+.1f} standard errors"
