"""Kernels of eye rays: the triangles that NumPy and embreex find, and the corners that NumPy suspects."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.tracer import compiled
from viewcam_addon.tracer.rays import corners, visibility
from viewcam_addon.tracer.rays.corners import Corners
from viewcam_addon.tracer.render import Tracer

SEEDS = st.integers(0, 2**32 - 1)

pytestmark = pytest.mark.skipif(not compiled.AVAILABLE, reason="numba or embreex is not installed, or turned off")


def both(function, *arguments):
    """What the kernel returns, and what NumPy's function does."""
    return function(*arguments), function.plain(*arguments)


def rays(camera, rng, count, extent):
    """Points of the view plane: pixel after pixel, here and there, and in a beam."""
    beside = rng.uniform(-extent, extent, (2, count))
    column, row = rng.uniform(0, camera.width, count), rng.uniform(0, camera.height, count)
    pixels = camera.view_plane(np.sort(column), row)
    beam = beside[:, :1] + rng.normal(size=(2, count)) * 1e-4
    return np.concatenate([np.stack(pixels), beside, beam], axis=1)


@settings(max_examples=15)
@given(seed=SEEDS, count=st.integers(0, 200))
def test_packets_of_eye_rays_meet_what_embreex_meets_ray_by_ray(random_scene, seed, count):
    scene = random_scene(seed)
    eye = Tracer(scene)._visibility
    x, y = rays(scene.camera, np.random.default_rng(seed), count, 2.0)
    found, expected = both(visibility.first_triangles, eye._triangles, scene.clip[0] * eye._unit, 1e37, x, y)
    assert np.array_equal(found, expected), f"{(found != expected).sum()} of {len(x)} rays meet something else"


@settings(max_examples=15)
@given(seed=SEEDS, extent=st.sampled_from([1e-6, 1.0, 70.0, 1e30]))
def test_the_same_rays_are_suspected_of_passing_close_by_a_corner(seed, extent):
    rng = np.random.default_rng(seed)
    vertices = np.concatenate([rng.uniform(-extent, extent, (2, 3000)), np.ones((1, 3000))])
    near = vertices[:2, ::3] + rng.normal(size=(2, 1000)) * corners.REACH * extent
    x, y = np.concatenate([near, rng.uniform(-extent, extent, (2, 1000)), [[0, np.nan, np.inf], [0, 0, -1]]], axis=1)
    kept = Corners(vertices)
    suspected, expected = both(corners.suspects, *kept._filter, x, y)
    assert np.array_equal(suspected, expected)
    assert extent > 1e20 or len(expected) >= 900, f"only {len(expected)} of 1000 rays beside corners are suspected"


def test_rays_that_are_off_by_a_thousandth_meet_something_else(random_scene):
    """What the first test would see if the kernel computed rays another way."""
    scene = random_scene(0)
    eye = Tracer(scene)._visibility
    x, y = rays(scene.camera, np.random.default_rng(0), 20_000, 2.0)
    found = visibility.first_triangles(eye._triangles, 0.0, 1e37, x, y)
    moved = visibility.first_triangles.plain(eye._triangles, 0.0, 1e37, x * 1.001, y)
    assert (found != moved).any()
