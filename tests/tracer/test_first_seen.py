"""What is seen first: the ends of the clip range, nothing, eyes in spheres, and many spheres, against answers on paper."""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.render import Tracer


def found(scene):
    """(height, width) of a picture: the index of the object seen, 0 where there is none."""
    return Tracer(scene, 2).render()["Object Index"][..., 0].astype(int)


def first_of(scene, x, y):
    """Primitives of the first object and distances, of rays from the eye through (x, y) of the view plane."""
    u, v, w = scene.camera.basis()
    directions = np.stack([x, y, np.ones_like(x)], axis=1) @ np.stack([u, v, -w])
    core = CoreScene(scene, 2)
    depth, objects, primitives = core.closest(core.rays(np.array(scene.camera.eye)[None], directions))
    return np.where(objects == 0, primitives, -1), depth, directions


def centres(scene):
    rows, columns = np.mgrid[: scene.camera.height, : scene.camera.width]
    return scene.camera.view_plane(columns.ravel() + 0.5, rows.ravel() + 0.5)


def test_what_lies_before_the_clip_range_is_looked_through_and_what_lies_behind_it_is_not_seen(
    make_scene, make_spheres, make_mesh
):
    def wall(depth):
        return make_mesh([[-9, -9, -depth], [9, -9, -depth], [0, 20, -depth]], [[0, 1, 2]])

    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 4, 4)
    things = (wall(1), make_spheres([[0, 0, -3]], 0.5), wall(5))  # objects 1, 2 and 3
    for clip, seen in (
        ((0, 100), 1),
        ((2, 100), 2),
        ((2.6, 100), 3),  # the sphere's near side is clipped, and its far side is never seen
        ((2, 2.4), 0),
        ((4, 5), 3),
        ((0, 0.9), 0),
    ):
        shown = found(make_scene(camera, *things, clip=clip))[2, 2]
        assert shown == seen, f"clip {clip}: object {shown} instead of {seen}"


def test_scenes_and_meshes_that_are_empty_or_degenerate_show_nothing(make_scene, make_mesh, make_spheres):
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
        assert not found(scene).any(), f"{things}: {np.unique(found(scene))}"


def test_an_eye_inside_a_sphere_sees_through_it_and_one_just_outside_sees_it(make_scene, make_spheres):
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 1, 1)
    around, beyond = [0, 0, -0.5], [0, 0, -4]
    for radius, seen in ((0.5 + 1e-12, 2), (0.5 - 1e-12, 1)):
        shown = found(make_scene(camera, make_spheres([around], radius), make_spheres([beyond], 1.0)))[0, 0]
        assert shown == seen, f"radius {radius}: object {shown}"


def depths_by_testing_each(scene, spheres, directions):
    """The oracle: the nearest sphere's distance by the textbook's quadratic about the foot, inf where there is none."""
    relative = spheres.centers - np.array(scene.camera.eye)
    best = np.full(len(directions), np.inf)
    for ray, direction in enumerate(directions):
        foot = relative @ direction / (direction @ direction)
        beside = relative - foot[:, None] * direction
        half = (spheres.radii**2 - np.einsum("ij,ij->i", beside, beside)) / (direction @ direction)
        depth = np.where((half >= 0) & (foot > 0), foot - np.sqrt(np.maximum(half, 0)), np.inf)
        best[ray] = depth[depth > 0].min(initial=np.inf)
    return best


@pytest.mark.exhaustive
@pytest.mark.parametrize("radius", [0.003, 0.03, 0.15])
def test_a_hundred_thousand_spheres_are_told_apart_as_by_testing_each(make_scene, make_spheres, radius):
    rng = np.random.default_rng(1)
    spheres = make_spheres(rng.uniform(-2, 2, (100_000, 3)), rng.uniform(0.5, 1.5, 100_000) * radius)
    for eye in ((0, -7, 1), (0.3, 0.1, 0.2)):  # before the cloud, and in it, where many spheres reach behind the eye
        scene = make_scene(Pinhole(eye, (0, 1, 0), (0, 0, 1), 80, 100, 100), spheres)
        number, traced, directions = first_of(scene, *rng.uniform(-0.6, 0.6, (2, 120)))
        depth = depths_by_testing_each(scene, spheres, directions)
        hits = np.isfinite(depth)
        assert hits.any() and np.array_equal(number >= 0, hits), "other rays hit than by testing each sphere"
        # Both in float64, by different formulas: the root of a discriminant as small as 1e-6 keeps ten digits.
        worst = np.abs(traced[hits] / depth[hits] - 1).max()
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
        number, traced, directions = first_of(scene, *centres(scene))
        depth = depths_by_testing_each(scene, spheres, directions)
        hits = np.isfinite(depth)
        assert hits.any() and np.array_equal(number >= 0, hits), name
        worst = np.abs(traced[hits] / depth[hits] - 1).max()
        # A sphere that was stepped over would show one that lies behind it by 2e-10 at least.
        assert worst < 1e-11, f"{name}: depths differ by {worst:.1e}"
