"""What is seen first: Embree against plain NumPy, and both against geometry that is known on paper."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays import visibility
from viewcam_addon.tracer.rays.ellipsoids import ellipsoids_of
from viewcam_addon.tracer.rays.triangles import Planes, triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.scene import Mesh, Spheres

SEEDS = st.integers(0, 2**32 - 1)
BOTH = pytest.mark.parametrize("kind", [visibility.Embree, visibility.Plain])

# float32 rounds each coordinate of a vertex and of the ray by 2⁻²⁴ of itself, and Embree's edge test adds as much again: an
# edge moves in the view plane by at most four times 2⁻²⁴ of its distance from the view axis.
ROUNDING = 4 * 2.0**-24


def prepared(scene, kind):
    view = View(scene.camera)
    things = [(placed, scene.geometries[placed.geometry]) for placed in scene.objects]
    triangles = triangles_of([thing for thing in things if isinstance(thing[1], Mesh)], view)
    ellipsoids = ellipsoids_of([thing for thing in things if isinstance(thing[1], Spheres)], view)
    return kind(triangles, Planes(triangles, view), ellipsoids, scene.clip)


def centres(scene):
    rows, columns = np.mgrid[: scene.camera.height, : scene.camera.width]
    return scene.camera.view_plane(columns.ravel() + 0.5, rows.ravel() + 0.5)


def unexplained(found, x, y, reach, oracle) -> int:
    """How many rays meet something that the oracle does not find within `reach` (relative to the picture's extent) of them."""
    differ = np.flatnonzero(found != oracle.first(x, y))
    explained = np.zeros(len(differ), bool)
    shift_x, shift_y = reach * np.abs(x).max(), reach * np.abs(y).max()
    for right in (-1, 0, 1):
        for up in (-1, 0, 1):
            explained |= found[differ] == oracle.first(x[differ] + right * shift_x, y[differ] + up * shift_y)
    return int((~explained).sum())


@settings(max_examples=15)
@given(seed=SEEDS)
def test_embree_and_plain_numpy_see_the_same_primitives_but_for_roundings_of_edges(random_scene, seed):
    scene = random_scene(seed)
    embree = prepared(scene, visibility.Embree)
    plain = prepared(scene, visibility.Plain)
    x, y = centres(scene)
    found = embree.first(x, y)
    assert (found >= 0).any() or seed != 0, "the scene of seed 0 shows nothing"
    wrong = unexplained(found, x, y, ROUNDING, plain)
    assert wrong == 0, f"{wrong} of {len(x)} rays meet what no ray within a rounding of them does"


def test_a_shift_by_half_a_pixel_is_not_explained_by_rounding(random_scene):
    scene = random_scene(0)
    embree = prepared(scene, visibility.Embree)
    plain = prepared(scene, visibility.Plain)
    x, y = centres(scene)
    half = 0.5 * abs(x[1] - x[0])
    wrong = unexplained(embree.first(x + half, y), x, y, ROUNDING, plain)
    assert wrong > 50, f"only {wrong} rays differ after a shift by half a pixel"


@BOTH
@settings(max_examples=10)
@given(seed=SEEDS)
def test_no_ray_leaves_a_closed_mesh_through_its_edges_or_vertices(ball, make_scene, kind, seed):
    rng = np.random.default_rng(seed)
    shell = ball(6)
    eye = rng.uniform(-0.4, 0.4, 3)
    scene = make_scene(Pinhole(tuple(eye), tuple(eye + rng.normal(size=3)), (0.1, 0.2, 1), 100, 100, 100), shell)
    seen_from = prepared(scene, kind)
    corners = shell.vertices[shell.triangles]
    share = rng.uniform(0, 1, (len(corners), 3, 1))
    on_edges = corners * share + np.roll(corners, 1, axis=1) * (1 - share)
    points = View(scene.camera).points(np.eye(4), np.concatenate([shell.vertices, on_edges.reshape(-1, 3)]))
    points = points[:, points[2] > 1e-3]
    found = seen_from.first(points[0] / points[2], points[1] / points[2])
    assert (found >= 0).all(), f"{(found < 0).sum()} of {len(found)} rays leave the closed ball"


@BOTH
def test_what_lies_before_the_clip_range_is_looked_through_and_what_lies_behind_it_is_not_seen(
    make_scene, make_spheres, make_mesh, kind
):
    def wall(depth):
        return make_mesh([[-9, -9, -depth], [9, -9, -depth], [0, 20, -depth]], [[0, 1, 2]])

    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 4, 4)
    things = (wall(1), make_spheres([[0, 0, -3]], 0.5), wall(5))  # triangles 0 and 1, sphere 2
    for clip, seen in (
        ((0, 100), 0),
        ((2, 100), 2),
        ((2.6, 100), 1),  # the sphere's near side is clipped, and its far side is never seen
        ((2, 2.4), -1),
        ((4, 5), 1),
        ((0, 0.9), -1),
    ):
        seen_from = prepared(make_scene(camera, *things, clip=clip), kind)
        found = seen_from.first(np.zeros(1), np.zeros(1))
        assert found[0] == seen, f"clip {clip}: primitive {found[0]} instead of {seen}"


@BOTH
def test_scenes_and_meshes_that_are_empty_or_degenerate_show_nothing(make_scene, make_mesh, make_spheres, kind):
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 8, 8)
    flat = np.diag([1.0, 1.0, 0.0, 1.0])
    flat[2, 3] = -2
    for things in (
        (),
        (make_mesh([], []),),
        (make_spheres([], []),),
        (make_mesh([[0, 0, -1]], [[0, 0, 0]]),),
        (make_mesh([[-1, 0, -1], [0, 0, -1], [1, 0, -1]], [[0, 1, 2]]),),  # a line
        (make_mesh([[0, -1, -1], [0, 1, -1], [0, 0, -3]], [[0, 1, 2]]),),  # its plane holds the eye
        (make_spheres([[0, 0, -2]], 0.0),),
        ((make_spheres([[0, 0, 0]], 1.0), flat),),  # a sphere that its matrix flattens
    ):
        scene = make_scene(camera, *things)
        seen_from = prepared(scene, kind)
        found = seen_from.first(*centres(scene))
        assert (found == -1).all(), f"{things}: {np.unique(found)}"


@BOTH
def test_an_eye_inside_a_sphere_sees_through_it_and_one_just_outside_sees_it(make_scene, make_spheres, kind):
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 1, 1)
    around, beyond = [0, 0, -0.5], [0, 0, -4]
    for radius, seen in ((0.5 + 1e-12, 1), (0.5 - 1e-12, 0)):
        seen_from = prepared(make_scene(camera, make_spheres([around], radius), make_spheres([beyond], 1.0)), kind)
        primitives = 2 if seen == 0 else 1  # the sphere round the eye is no primitive at all
        found = seen_from.first(np.zeros(1), np.zeros(1))
        assert seen_from._ellipsoids.count == primitives
        assert found[0] == 0, f"radius {radius}: primitive {found[0]}"


def spheres_in_world(scene, spheres, x, y):
    """The oracle: the nearest sphere of each ray by the textbook's quadratic equation about its foot, in world space."""
    view = View(scene.camera)
    directions = np.stack([x, y, np.ones_like(x)], axis=1) @ view.axes
    best, best_depth = np.full(len(x), -1), np.full(len(x), np.inf)
    relative = spheres.centers - view.eye
    for ray, direction in enumerate(directions):
        foot = relative @ direction / (direction @ direction)
        beside = relative - foot[:, None] * direction
        half = (spheres.radii**2 - np.einsum("ij,ij->i", beside, beside)) / (direction @ direction)
        depth = np.where((half >= 0) & (foot > 0), foot - np.sqrt(np.maximum(half, 0)), np.inf)
        depth[depth <= 0] = np.inf
        best[ray], best_depth[ray] = (depth.argmin(), depth.min()) if np.isfinite(depth).any() else (-1, np.inf)
    return best, best_depth


@pytest.mark.parametrize("radius", [0.003, 0.03, 0.15])
def test_a_hundred_thousand_spheres_are_told_apart_as_by_testing_each(make_scene, make_spheres, radius):
    rng = np.random.default_rng(1)
    spheres = make_spheres(rng.uniform(-2, 2, (100_000, 3)), rng.uniform(0.5, 1.5, 100_000) * radius)
    for eye in ((0, -7, 1), (0.3, 0.1, 0.2)):  # before the cloud, and in it, where many spheres reach behind the eye
        scene = make_scene(Pinhole(eye, (0, 1, 0), (0, 0, 1), 80, 100, 100), spheres)
        embree = prepared(scene, visibility.Embree)
        x, y = rng.uniform(-0.6, 0.6, (2, 120))
        found = embree.first(x, y)
        _, depth = spheres_in_world(scene, spheres, x, y)
        assert np.array_equal(found >= 0, np.isfinite(depth)), "other rays hit than by testing each sphere"
        hits = np.flatnonzero(found >= 0)
        traced = embree._ellipsoids.depth(found[hits], x[hits], y[hits])
        # Both in float64, by different formulas: the root of a discriminant as small as 1e-6 keeps ten digits.
        worst = np.abs(traced / depth[hits] - 1).max(initial=0)
        assert worst < 1e-9, f"another sphere is nearer than the one that was found: depths differ by {worst:.1e}"


def test_spheres_that_touch_one_depth_overlap_or_coincide_are_all_found(make_scene, make_spheres):
    """The cases in which a ray that continues behind a box would step over the next one."""
    side = np.linspace(-1, 1, 41)
    grid = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    lattice = np.column_stack([grid, np.full(len(grid), -3.0)])
    nested = np.repeat([[0.0, 0.0, -2.0]], 50, axis=0)
    for name, spheres in {
        "equal spheres side by side at one depth, overlapping": make_spheres(lattice, 0.04),
        "fifty spheres of one centre, each larger by 1e-9": make_spheres(nested, 0.3 * (1 + 1e-9 * np.arange(50))),
    }.items():
        scene = make_scene(Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 100, 60, 60), spheres)
        embree = prepared(scene, visibility.Embree)
        x, y = centres(scene)
        found = embree.first(x, y)
        index, depth = spheres_in_world(scene, spheres, x, y)
        assert np.array_equal(found >= 0, index >= 0), name
        hits = np.flatnonzero(found >= 0)
        traced = embree._ellipsoids.depth(found[hits], x[hits], y[hits])
        worst = np.abs(traced / depth[hits] - 1).max()
        # A sphere that was stepped over would show one that lies behind it by 2e-10 at least.
        assert worst < 1e-11, f"{name}: depths differ by {worst:.1e}"


def test_the_floor_is_seen_right_beside_where_a_sphere_rests_on_it(make_scene, make_spheres, make_mesh):
    """A ray that passes under a resting sphere meets its card, misses it, and must still meet the floor."""
    floor = make_mesh([[-50, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]], [[0, 1, 2], [0, 2, 3]])
    spheres = make_spheres(np.column_stack([np.mgrid[-3:4, -3:4].reshape(2, -1).T, np.full(49, 0.4)]), 0.4)
    scene = make_scene(Pinhole((0, -9, 0.6), (0, 0, 0.2), (0, 0, 1), 900, 400, 120), floor, spheres)
    embree = prepared(scene, visibility.Embree)
    plain = prepared(scene, visibility.Plain)
    x, y = centres(scene)
    found = embree.first(x, y)
    assert {0, 1} & set(found) and (found >= 2).any(), "the picture shows floor and spheres"
    wrong = unexplained(found, x, y, ROUNDING, plain)
    assert wrong == 0, f"{wrong} rays differ from the exact answer"
