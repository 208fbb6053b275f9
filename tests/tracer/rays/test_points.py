"""Points of surfaces: the same surfaces that the passes of level `geometry` show, and on paper what these don't."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays.points import Points, materials_of
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Object, Scene
from viewcam_addon.tracer.scene.materials import PLAIN, Colour, Material, Picture

SEEDS = st.integers(0, 2**32 - 1)
UNIT = 1e-12  # a unit vector's length: a dozen roundings of float64
ROUNDED = 2.0**-22  # passes are rounded to float32, and so are smooth normals


def world(stage, vectors):
    """(n, 3) directions in world space of (3, n) in camera space."""
    return (stage.view.axes.T @ vectors).T


@settings(max_examples=10)
@given(seed=SEEDS)
def test_points_are_where_the_passes_show_surfaces_and_as_they_turn(random_scene, stage_of, seed):
    scene = random_scene(seed)
    stage = stage_of(scene)
    passes = {name: values.reshape(-1, values.shape[-1])[stage.pixels] for name, values in Tracer(scene).render().items()}
    position = world(stage, stage.points.position) + stage.view.eye
    assert np.allclose(position, passes["Position"], rtol=ROUNDED, atol=10 * ROUNDED)
    assert np.allclose(world(stage, stage.points.shading), passes["Normal"], atol=4 * ROUNDED)
    for normals in (stage.points.normal, stage.points.shading):
        assert np.abs(np.linalg.norm(normals, axis=0) - 1).max(initial=0) < ROUNDED
    facing = -np.einsum("in,in->n", stage.points.normal, stage.points.position)
    assert (facing >= 0).all(), "a normal looks away from the eye"


@settings(max_examples=10)
@given(seed=SEEDS)
def test_rays_from_points_to_other_points_meet_those_with_the_same_normals_and_uvs(random_scene, stage_of, seed):
    """Seen from the eye and met by a ray from the eye's place, by the other formulas, a surface is the same."""
    scene = random_scene(seed)
    scene = replace(scene, clip=(0.0, np.inf), images={"dot": Picture(np.ones((1, 1, 3), np.float32))})
    scene = replace(scene, materials={"dotted": Material(diffuse=Colour((1, 1, 1), image="dot"))})
    stage = stage_of(scene)
    seen = stage.points
    if not seen.count:
        return
    flat = seen.primitive < stage.surfaces.triangles.count
    seen = seen.at(np.flatnonzero(flat))
    distance = np.linalg.norm(seen.position, axis=0)
    met, far = stage.surfaces.met(seen.primitive, np.zeros((3, seen.count)), seen.position / distance)
    # Both are right to float64 but where the surface is seen edge-on.
    clear = -np.einsum("in,in->n", seen.normal, seen.position) / distance > 1e-3
    assert np.abs(far / distance - 1)[clear].max(initial=0) < 1e-9
    for name in ("position", "normal", "shading", "uv"):
        apart = np.abs(getattr(met, name) - getattr(seen, name))[:, clear].max(initial=0)
        assert apart < 1e-6 * max(1, distance.max()), f"{name} is off by {apart:.1e}"
    assert np.array_equal(met.backside[clear], seen.backside[clear])
    assert np.array_equal(met.material, seen.material)


@pytest.mark.parametrize("mirrored_camera", [False, True])
@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize("inside", [False, True])
def test_the_backside_is_within_a_ball_also_where_matrix_or_camera_mirror_it(
    stage_of, make_scene, ball, mirrored_camera, mirror, inside
):
    matrix = np.diag([mirror, 1.0, 1.0, 1.0])
    eye = (0.1, 0.2, 0.3) if inside else (0.5, -4.0, 1.0)
    camera = Pinhole(eye, (0.2, 0.6, 0.4) if inside else (0, 0, 0), (0, 0, 1), 30, 20, 20, mirrored=mirrored_camera)
    stage = stage_of(make_scene(camera, (ball(24), matrix)))
    assert stage.points.count > 100
    assert (stage.points.backside == inside).all()
    outward = world(stage, stage.points.position) + stage.view.eye
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    side = -1 if inside else 1
    assert (np.einsum("ij,ij->i", world(stage, stage.points.normal), outward) * side > 0.95).all()
    # Interpolated over a facet, a normal differs from the ball's by the facet's size squared: (π/24)².
    assert (np.einsum("ij,ij->i", world(stage, stage.points.shading), outward) * side > 1 - 0.02).all()


def test_materials_are_counted_from_plain_on_and_missing_ones_are_plain(stage_of, make_mesh, make_spheres):
    square = make_mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]], materials=[1, 2])
    red, blue = Material(diffuse=Colour((1, 0, 0))), Material(emission=Colour((0, 0, 1)))
    scene = Scene(
        Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 20, 8, 8),
        {"square": square, "spheres": make_spheres([[0, 0, 0]], 0.5)},
        (
            Object("square", "square", np.eye(4), 1, (0, 0, 0), ("blue", "red")),
            Object("spheres", "spheres", np.eye(4), 2, (0,), ("blue",)),
        ),
        materials={"red": red, "blue": blue},
    )
    stage = stage_of(scene)
    assert materials_of(scene) == (PLAIN, red, blue)
    of = dict(zip(stage.points.primitive.tolist(), stage.points.material.tolist(), strict=True))
    assert of == {0: 1, 1: 0, 2: 2}


def test_uv_and_colours_are_there_where_a_material_asks_for_them(stage_of, make_scene, ball, make_spheres):
    mesh = replace(ball(8), corner_colours=ball(8).corner_normals * 0.5 + 0.5)
    camera = Pinhole((0.5, -4, 1), (0.5, 0, 0), (0, 0, 1), 20, 16, 16)
    scene = make_scene(camera, mesh, make_spheres([[1.5, 0, 0]], 0.4))
    bare = stage_of(scene).points
    assert bare.uv is None and bare.vertex_colour is None
    painted = Material(diffuse=Colour((1, 1, 1), image="dot", vertex=True))
    scene = replace(scene, materials={"paint": painted}, images={"dot": Picture(np.ones((1, 1, 3), np.float32))})
    stage = stage_of(scene)
    points, on_ball = stage.points, stage.points.primitive < stage.surfaces.triangles.count
    assert on_ball.any() and not on_ball.all()
    where = (world(stage, points.position) + stage.view.eye).T
    # UV are x and y, colours half of the place and a half: linear over each facet, as the position is.
    assert np.abs(points.uv - where[:2])[:, on_ball].max() < 1e-6
    assert np.abs(points.vertex_colour - (where * 0.5 + 0.5))[:, on_ball].max() < 1e-6
    assert not points.uv[:, ~on_ball].any() and not points.vertex_colour[:, ~on_ball].any()


def test_some_of_the_points_and_several_in_one(stage_of, random_scene):
    points = stage_of(random_scene(3)).points
    halves = [points.at(slice(0, 50)), points.at(np.arange(50, points.count))]
    joined = Points.joined(halves)
    assert joined.count == points.count == halves[0].count + halves[1].count
    for name in ("position", "normal", "shading", "backside", "material", "primitive", "offset"):
        assert np.array_equal(getattr(joined, name), getattr(points, name)), name


def test_a_triangle_that_is_seen_edge_on_looks_at_the_ray(stage_of, make_scene, make_mesh):
    mesh = make_mesh([[0, -1, -1], [0, 1, -1], [0, 0, -3]], [[0, 1, 2]], corner_normals=np.tile([1.0, 0, 0], (1, 3, 1)))
    stage = stage_of(make_scene(Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 8, 8), mesh))
    points = stage.surfaces.seen(np.zeros(1, np.intp), np.zeros(1), np.zeros(1))
    assert points.normal[:, 0] == pytest.approx([0, 0, -1]) and np.linalg.norm(points.shading) == pytest.approx(1)
