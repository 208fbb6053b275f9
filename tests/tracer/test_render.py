"""Whole pictures: where things appear, what no thread, tile or place in the world may change, and how much memory they take."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon import image
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import render as render_module
from viewcam_addon.tracer.render import PASSES, Tracer, render
from viewcam_addon.tracer.scene import Object, Scene

SEEDS = st.integers(0, 2**32 - 1)
FLOAT32 = 2.0**-24


def assert_same(first, second):
    assert first.keys() == second.keys() == PASSES.keys()
    for name in first:
        differ = (first[name] != second[name]).any(axis=-1).sum()
        assert differ == 0, f"{name} differs in {differ} pixels"


@settings(max_examples=5)
@given(seed=SEEDS)
def test_pictures_are_the_same_bit_for_bit_for_any_number_of_threads_and_any_tile(random_scene, seed):
    scene = random_scene(seed, width=201, height=160)
    reference = render(scene, threads=1)
    for threads in (2, 3, 7):
        assert_same(reference, render(scene, threads=threads))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(render_module, "BAND", 7)
        assert_same(reference, render(scene, threads=2))


@settings(max_examples=5)
@given(seed=SEEDS)
def test_single_samples_at_pixel_centres_are_the_picture(random_scene, seed):
    scene = random_scene(seed)
    tracer = Tracer(scene)
    rows, columns = np.mgrid[: scene.camera.height, : scene.camera.width]
    picture = tracer.render()
    samples = tracer.surface_at(columns.ravel(), rows.ravel())
    assert_same({name: values.reshape(-1, values.shape[-1]) for name, values in picture.items()}, samples)
    shifted = tracer.surface_at(columns.ravel(), rows.ravel(), 0.9, 0.1)
    assert (shifted["Depth"] != samples["Depth"]).any(), "a sample elsewhere in the pixel sees something else"


@settings(max_examples=10)
@given(seed=SEEDS)
def test_positions_appear_at_their_pixels_centre_and_at_their_depth(random_scene, seed):
    scene = random_scene(seed)
    camera, passes = scene.camera, render(scene)
    hit = passes["Depth"][..., 0] < image.BACKGROUND_DEPTH
    rows, columns = np.nonzero(hit)
    position = passes["Position"][hit].astype(float)
    column, row, depth = camera.project(position)
    # The position is rounded once to float32, in each of three coordinates.
    rounding = FLOAT32 * np.sqrt(3) * np.abs(position).max(axis=1, initial=0)
    allowed = (
        rounding
        / depth
        * max(camera.distance)
        * (
            1
            + np.hypot(
                *((np.array([column, row]) - np.array(camera.principal_point)[:, None]) / np.array(camera.distance)[:, None])
            )
        )
    )
    off = np.hypot(column - columns - 0.5, row - rows - 0.5)
    assert (off <= allowed + 1e-9).all(), f"{(off - allowed).max():.1e} px more than the rounding of the position explains"
    assert (np.abs(depth - passes["Depth"][hit][:, 0]) <= rounding + FLOAT32 * depth).all()


def test_rows_count_from_the_bottom_and_columns_from_the_left(make_scene, make_spheres):
    camera = Pinhole((0, -10, 0), (0, 0, 0), (0, 0, 1), 100, 60, 40)
    scene = make_scene(camera, make_spheres([[2, 0, 0]], 0.3), make_spheres([[0, 0, 1]], 0.3))
    index = render(scene)["Object Index"][..., 0]
    assert index[20, 50] == 1 and index[30, 30] == 2, "x = 2 is 20 px right of the centre, z = 1 is 10 px above it"
    mirrored = render(replace(scene, camera=replace(camera, mirrored=True)))["Object Index"][..., 0]
    assert np.array_equal(mirrored, index[:, ::-1])


def test_a_cropped_picture_is_a_part_of_the_whole(random_scene):
    scene = random_scene(3)
    whole = render(scene)
    part = render(replace(scene, camera=scene.camera.cropped(17, 5, 40, 30)))
    for name, values in part.items():
        of_whole = whole[name][5:35, 17:57]
        # The principal point moves, and with it the rounding of x and y: indices agree, the rest within a rounding of float32.
        close = np.isclose(values, of_whole, rtol=8 * FLOAT32, atol=8 * FLOAT32).all(axis=-1)
        assert close.mean() > 0.999, f"{name}: {close.mean():.2%} of the pixels agree"


@settings(max_examples=5)
@given(seed=SEEDS)
def test_a_scene_a_million_metres_off_the_origin_shows_the_same_picture(random_scene, seed):
    scene = random_scene(seed)
    # A power of two, and eye, look-at and matrices that stay exact beside it: multiples of 2⁻²⁴.
    far = 2.0**20

    def exact(values):
        return np.round(np.array(values) * 2.0**24) / 2.0**24

    def moved(by):
        camera = replace(scene.camera, eye=tuple(exact(scene.camera.eye) + by), look_at=tuple(exact(scene.camera.look_at) + by))
        objects = []
        for placed in scene.objects:
            matrix = exact(placed.matrix)
            matrix[:3, 3] += by
            objects.append(replace(placed, matrix=matrix))
        return render(replace(scene, camera=camera, objects=tuple(objects)))

    here, there = moved(0.0), moved(far)
    for name in ("Depth", "Normal", "UV", "Object Index", "Material Index", "Facing"):
        assert np.array_equal(here[name], there[name]), name
    assert (there["Magnitude"][here["Depth"] < image.BACKGROUND_DEPTH] >= far - 20).all()


def test_the_magnitude_of_what_is_far_from_its_own_origin_is_that_distance(make_mesh, make_spheres, make_scene):
    """The vertices lie 1e6 away in object space, the object −1e6 in the world: their sum is rounded like the terms."""
    camera = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 60, 20)
    square = [[-2, -1, 0], [2, -1, 0], [2, 1, 0], [-2, 1, 0]]
    for make in (
        lambda away: make_mesh(np.add(square, (away, 0, 0)), [[0, 1, 2], [0, 2, 3]]),
        lambda away: make_spheres([(away, 0, 0)], 1),
    ):
        near, far = make_scene(camera, make(0)), make_scene(camera, make(1e6))
        matrix = np.eye(4)
        matrix[0, 3] = -1e6
        far = replace(far, objects=tuple(replace(placed, matrix=matrix) for placed in far.objects))
        near, far = render(near), render(far)
        hit = near["Depth"] < image.BACKGROUND_DEPTH
        assert hit.any() and np.array_equal(near["Depth"], far["Depth"])
        assert (near["Magnitude"][hit] < 100).all() and (np.abs(far["Magnitude"][hit] / 1e6 - 1) < 1e-4).all()


def test_what_shows_nothing_is_written_as_cycles_writes_it(make_scene):
    passes = render(make_scene(Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 5, 3)))
    for name, values in passes.items():
        assert values.shape == (3, 5, PASSES[name]) and values.dtype == np.float32
        assert (values == (1e10 if name == "Depth" else 0)).all(), name


def test_objects_and_materials_show_their_indices(make_mesh):
    squares = make_mesh(
        [[-2, -1, 0], [0, -1, 0], [0, 1, 0], [-2, 1, 0], [2, -1, 0], [2, 1, 0]],
        [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]],
        materials=[0, 0, 1, 1],
    )
    camera = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 60, 20)
    passes = render(Scene(camera, {"squares": squares}, (Object("squares", "squares", np.eye(4), 7, (3, 9)),)))
    assert (passes["Object Index"] == 7)[5, [15, 45]].all()
    assert passes["Material Index"][5, 15] == 3 and passes["Material Index"][5, 45] == 9


def test_memory_beside_the_passes_does_not_grow_with_the_picture(ball, make_scene):
    def beside(width, height):
        camera = Pinhole((0, -4, 1), (0, 0, 0), (0, 0, 1), width, width, height)
        tracer = Tracer(make_scene(camera, ball(24)), threads=1)
        tracemalloc.start()
        passes = tracer.render()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak - sum(values.nbytes for values in passes.values())

    small, large = beside(640, 480), beside(1920, 1080)  # both are cut into tiles of full size
    # Python's own things, of some tiles at a time.
    assert large <= 1e6, f"{large / 1e6:.1f} MB"
    assert large <= 1.5 * small + 1e6, f"{small / 1e6:.1f} MB for the small picture, {large / 1e6:.1f} MB for the large one"
