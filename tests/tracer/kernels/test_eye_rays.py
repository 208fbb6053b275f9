"""Kernels of eye rays: the triangles that embreex finds, the corners that NumPy suspects, the passes that it writes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import compiled
from viewcam_addon.tracer.rays import corners, visibility
from viewcam_addon.tracer.rays.corners import Corners
from viewcam_addon.tracer.rays.surface import PASSES, unwritten, write_triangles
from viewcam_addon.tracer.rays.view import View
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
    run = int(np.random.default_rng(seed).choice([1, 5, 16, len(x)]))
    found, expected = both(visibility.first_triangles, eye._triangles, scene.clip[0] * eye._unit, 1e37, x, y, run)
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
    found = visibility.first_triangles(eye._triangles, 0.0, 1e37, x, y, len(x))
    moved = visibility.first_triangles.plain(eye._triangles, 0.0, 1e37, x * 1.001, y, len(x))
    assert (found != moved).any()


def written(function, tracer, x, y, names):
    """What a function writes of these rays."""
    passes = unwritten(x.shape, names)
    for values in passes.values():
        values[...] = np.nan
    function(tracer._surface, passes, tracer._visibility.first(x, y), x, y)
    return passes


@settings(max_examples=15)
@given(seed=SEEDS, names=st.lists(st.sampled_from(list(PASSES)), min_size=1, unique=True))
def test_passes_are_those_that_numpy_writes_bit_for_bit(random_scene, seed, names):
    scene = random_scene(seed)
    tracer = Tracer(scene)
    x, y = rays(scene.camera, np.random.default_rng(seed), 300, 2.0)
    kernel, plain = (written(function, tracer, x, y, names) for function in (write_triangles, write_triangles.plain))
    for name in names:
        differ = (kernel[name] != plain[name]).any(axis=-1)  # nothing is left unwritten: NaN differs from itself
        assert not differ.any(), f"{name} differs in {differ.sum()} of {len(x)} rays"


def test_a_face_without_normals_shows_its_own_in_both(make_mesh, make_scene):
    mesh = make_mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], corner_normals=np.zeros((1, 3, 3)))
    tracer = Tracer(make_scene(Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 100, 100), mesh))
    for function in (write_triangles, write_triangles.plain):
        normal = written(function, tracer, np.zeros(1), np.zeros(1), ["Normal"])["Normal"]
        assert np.array_equal(normal, [[0, 0, 1]])


def test_passes_that_are_no_planes_are_written_all_the_same(random_scene):
    scene = random_scene(1)
    tracer = Tracer(scene)
    x, y = rays(scene.camera, np.random.default_rng(1), 100, 2.0)
    interleaved = {"Position": np.full((len(x), 3), np.nan, np.float32)}
    write_triangles(tracer._surface, interleaved, tracer._visibility.first(x, y), x, y)
    assert np.array_equal(interleaved["Position"], written(write_triangles, tracer, x, y, ["Position"])["Position"])


def test_a_kernel_that_takes_another_triangle_is_found_out(random_scene):
    scene = random_scene(0)
    tracer = Tracer(scene)
    x, y = rays(scene.camera, np.random.default_rng(0), 300, 2.0)
    found = tracer._visibility.first(x, y)
    assert (found > 0).any()
    right, wrong = unwritten(x.shape), unwritten(x.shape)
    write_triangles(tracer._surface, right, found, x, y)
    write_triangles(tracer._surface, wrong, np.where(found > 0, found - 1, found), x, y)
    for name in ("Depth", "Position", "Normal", "UV", "Magnitude", "Facing"):
        assert (right[name] != wrong[name]).any(), name


def two_at_one_place(ball, make_scene):
    """A ball twice, so that all rays that meet it meet two triangles at one depth; and rays at its vertices."""
    shell = ball(30)
    scene = make_scene(Pinhole((0.3, -3, 0.2), (0, 0, 0), (0, 0, 1), 100, 100, 100), shell, shell)
    x, y, z = View(scene.camera).points(np.eye(4), shell.vertices)
    return scene, x / z, y / z


def test_of_two_things_at_one_depth_the_one_that_is_met_depends_on_its_own_run_only(ball, make_scene):
    scene, x, y = two_at_one_place(ball, make_scene)
    eye = Tracer(scene)._visibility

    def differ(rows: int, run: int) -> int:
        """How many rays meet something else if those of some rows of the ball's vertices are not traced."""
        without = slice(61 * rows, None)
        traced = (
            visibility.first_triangles(eye._triangles, 0.0, 1e37, x[part], y[part], run) for part in (slice(None), without)
        )
        whole, part = traced
        return int((whole[without] != part).sum())

    assert [differ(rows, 61) for rows in (1, 3, 8)] == [0, 0, 0]
    assert differ(3, len(x)) > 0, "packets that reach beyond a row change nothing here"


def test_on_edges_the_depth_is_the_same_whichever_triangle_is_met(ball, make_scene):
    scene, x, y = two_at_one_place(ball, make_scene)
    tracer = Tracer(scene)
    eye = tracer._visibility
    found, expected = both(visibility.first_triangles, eye._triangles, 0.0, 1e37, x, y, len(x))
    assert (found != expected).any(), "no ray finds two things at one depth"
    assert np.array_equal(found < 0, expected < 0)
    # Embree's depths are the same to 2⁻²⁴, and rounded by some of these; those of float64 on either triangle differ by as much.
    assert np.allclose(eye._depth(found, x, y), eye._depth(expected, x, y), rtol=8 * 2.0**-24, atol=0)
