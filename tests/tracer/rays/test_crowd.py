"""Which of many spheres rays from anywhere meet: as by testing each."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays import crowd

CAMERA = Pinhole((0.3, -9, 2), (0, 0, 0), (0, 0, 1), 60, 40, 40)


def each(spheres, starts, directions, leaving) -> np.ndarray:
    """How far rays go to the nearest of the spheres, by the perpendicular from each centre; inf where they meet none.

    starts, directions : (3, n), world space. leaving : (n,), spheres that are not met. A sphere that holds the start is not.
    """
    distances = np.full(starts.shape[1], np.inf)
    for ray in range(len(distances)):
        relative = spheres.centers - starts[:, ray]
        along = relative @ directions[:, ray]
        beside = relative - along[:, None] * directions[:, ray]
        half = spheres.radii**2 - np.einsum("ij,ij->i", beside, beside)
        outside = np.einsum("ij,ij->i", relative, relative) > spheres.radii**2
        met = (half >= 0) & (along > 0) & outside
        met[leaving[ray]] = False
        distances[ray] = (along - np.sqrt(np.maximum(half, 0)))[met].min(initial=np.inf)
    return distances


def lattice(make_spheres):
    """Spheres that touch one another on all sides."""
    return make_spheres(np.stack(np.mgrid[-6:7, -6:7, -6:7], axis=-1).reshape(-1, 3) * 0.4, 0.2)


def cloud(make_spheres):
    rng = np.random.default_rng(1)
    return make_spheres(rng.normal(size=(5000, 3)) * 1.5, rng.lognormal(-3.5, 0.7, 5000))


def nested(make_spheres):
    """Fifty spheres about each of forty centres, each larger by 1e-4."""
    rng = np.random.default_rng(2)
    return make_spheres(np.repeat(rng.normal(size=(40, 3)) * 2, 50, axis=0), np.tile(0.3 * (1 + 1e-4 * np.arange(50)), 40))


def sand_and_a_planet(make_spheres):
    rng = np.random.default_rng(3)
    grains = np.column_stack([rng.uniform(-4, 4, (3000, 2)), rng.uniform(0, 0.5, 3000)])
    return make_spheres(np.vstack([grains, [[0, 0, -1000]]]), np.append(rng.uniform(0.01, 0.1, 3000), 1000))


def dust(make_spheres):
    """Spheres smaller than a rounding of float32."""
    rng = np.random.default_rng(4)
    return make_spheres(rng.normal(size=(3000, 3)) * (1e-6, 1e-6, 1e-6) + (1, 1, 1), 1e-7)


CROWDS = [lattice, cloud, nested, sand_and_a_planet, dust]


def rays(stage, spheres, rng, count):
    """Points of the spheres that the camera sees, directions that leave them, half of them aimed at other spheres."""
    points = stage.points.at(rng.integers(0, stage.points.count, count))
    directions = rng.normal(size=(3, count))
    aimed = np.arange(count) % 2 == 0
    aims = spheres.centers + rng.normal(size=spheres.centers.shape) * spheres.radii[:, None]
    aims = aims[rng.integers(0, len(aims), count)].T - stage.view.eye[:, None]
    directions[:, aimed] = (stage.view.axes @ aims - points.position)[:, aimed]
    return points, directions / np.linalg.norm(directions, axis=0)


def wrong_distances(stage, spheres, count=400) -> tuple[int, int]:
    """How many rays go another way than to the nearest sphere, and how many shadow rays are wrong."""
    rng = np.random.default_rng(0)
    points, directions = rays(stage, spheres, rng, count)
    # The perpendicular of what starts on a sphere of 1000, and ends on one of 0.01, is rounded by 1e-13 · 1000 / 0.01.
    starts = stage.view.axes.T @ points.position + stage.view.eye[:, None]
    nearest = each(spheres, starts, stage.view.axes.T @ directions, points.primitive)
    found = np.full(count, np.inf)
    met, _, distances = stage.space.first(points, directions, "diffuse")
    found[met] = distances
    with np.errstate(invalid="ignore"):
        wrong = ~((found == nearest) | (np.abs(found - nearest) < 1e-7 * nearest))
    limits = np.where(np.isfinite(nearest), nearest, 5.0) * rng.choice([0.99, 1.01], count)
    blocked = stage.space.blocked(points, directions, limits)
    # Shadow rays end a few roundings before the light (offset.py), and don't leave flatter than they may.
    clear = np.abs(limits - nearest) > 2.0**-24 * 2 * (3.5 * np.abs(points.position).max() + 12 * limits)
    clear &= np.abs(np.einsum("in,in->n", points.normal, directions)) > 1e-5
    return int(wrong.sum()), int(((blocked != (nearest < limits)) & clear).sum())


@pytest.mark.parametrize("kind", CROWDS)
def test_the_nearest_of_many_spheres_is_met(stage_of, make_scene, make_spheres, kind):
    spheres = kind(make_spheres)
    camera = replace(CAMERA, eye=(1, 1 - 2e-5, 1), look_at=(1, 1, 1)) if kind is dust else CAMERA
    stage = stage_of(make_scene(camera, spheres))
    assert stage.points.count > 100
    wrong, shadows = wrong_distances(stage, spheres)
    assert wrong == 0 and shadows == 0, f"{wrong} rays of 400 miss the nearest sphere, {shadows} shadow rays are wrong"


@pytest.mark.parametrize("kind", CROWDS)
def test_without_embree_it_is_met_too(monkeypatch, without_embree, stage_of, make_scene, make_spheres, kind):
    without_embree(monkeypatch)
    spheres = kind(make_spheres)
    camera = replace(CAMERA, eye=(1, 1 - 2e-5, 1), look_at=(1, 1, 1)) if kind is dust else CAMERA
    wrong, shadows = wrong_distances(stage_of(make_scene(camera, spheres)), spheres, 60)
    assert wrong == 0 and shadows == 0, (wrong, shadows)


@pytest.mark.skipif(crowd.EmbreeScene is None, reason="without Embree there are no octahedra")
def test_long_steps_skip_spheres(monkeypatch, without_kernels, stage_of, make_scene, make_spheres):
    monkeypatch.setattr(crowd, "_STEP", 0.1)
    spheres = cloud(make_spheres)
    assert wrong_distances(stage_of(make_scene(CAMERA, spheres)), spheres)[0] > 0


@pytest.mark.skipif(crowd.EmbreeScene is None, reason="without Embree there are no octahedra")
def test_octahedra_that_hold_the_start_are_left_even_where_something_is_met(
    without_kernels, stage_of, make_scene, make_spheres
):
    spheres = lattice(make_spheres)
    stage = stage_of(make_scene(CAMERA, spheres))
    assert wrong_distances(stage, spheres) == (0, 0)
    stage.space._sight("diffuse")._crowd._widest = 0.0
    assert wrong_distances(stage, spheres)[0] > 0


def test_spheres_that_the_eye_does_not_see_shade_and_are_met(stage_of, make_scene, make_mesh, make_spheres, finder):
    """One behind the eye, one that holds it; and rays that start inside one pass out."""
    floor = make_mesh([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2], [0, 2, 3]])
    down = Pinhole((0, 0, 2), (0, 0, 0), (0, 1, 0), 10, 1, 1)
    up = np.array([[0.0], [0.0], [-1.0]])  # camera space: towards the eye
    for center, radius, distance in (((0, 0, 5), 1.0, 4.0), ((0, 0, 2), 0.5, 1.5), ((0, 0, 0.5), 1.0, np.inf)):
        stage = stage_of(make_scene(down, floor, make_spheres([center], radius)))
        points = replace(stage_of(make_scene(down, floor)).points, position=np.array([[0.0], [0.0], [2.0]]), normal=up)
        met, hits, far = stage.space.first(points, up, "glossy")
        blocked = stage.space.blocked(points, up, np.array([np.inf]))
        if np.isinf(distance):
            assert not len(met) and not blocked[0], "a ray that starts inside a sphere meets it"
        else:
            assert far[0] == pytest.approx(distance, rel=1e-12) and blocked[0]
            assert not hits.backside[0] and hits.primitive[0] == 2
            assert hits.normal[:, 0] == pytest.approx(-up[:, 0], abs=1e-12)


def test_rays_through_the_inside_of_a_sphere_leave_it_unmet_and_meet_what_is_in_it_and_behind(
    stage_of, make_scene, make_mesh, make_spheres, finder
):
    wall = make_mesh([[-9, 9, -9], [9, 9, -9], [9, 9, 9], [-9, 9, 9]], [[0, 1, 2], [0, 2, 3]])
    for inner, distance in ((None, 10.0), (0.3, 0.7)):
        spheres = [make_spheres([[0, 0, 0]], 1.0)] + ([] if inner is None else [make_spheres([[0, 0, 0]], inner)])
        stage = stage_of(make_scene(Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 1000, 1, 1), wall, *spheres))
        assert stage.points.primitive[0] == 2
        ahead = np.array([[0.0], [0.0], [1.0]])
        _, _, far = stage.space.first(stage.points, ahead, "transmission")
        assert far[0] == pytest.approx(distance, rel=1e-6)
        assert not stage.space.blocked(stage.points, ahead, np.array([distance * 0.999]))[0]
        assert stage.space.blocked(stage.points, ahead, np.array([distance * 1.001]))[0]
