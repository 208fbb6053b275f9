"""What scattered and shadow rays meet, against brute force: float64, in world space, every ray against every primitive."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays.offset import start
from viewcam_addon.tracer.scene import Mesh, Scene

SEEDS = st.integers(0, 2**32 - 1)


class Oracle:
    """Every ray against every primitive, in world space, by textbook formulas.

    What is met is told by `Points.primitive`'s numbers.
    """

    def __init__(self, stage, kind: str) -> None:
        self._view = stage.view
        corners, self._hidden, self._spheres = [np.empty((0, 3, 3))], [], []
        for placed in stage.scene.objects:
            geometry = stage.scene.geometries[placed.geometry]
            linear, move = placed.matrix[:3, :3], placed.matrix[:3, 3]
            if isinstance(geometry, Mesh):
                corners.append((geometry.vertices @ linear.T + move)[geometry.triangles])
                self._hidden += [kind in placed.hidden_from] * len(geometry.triangles)
            else:
                self._spheres += [
                    (np.linalg.inv(linear), linear @ center + move, radius, kind in placed.hidden_from)
                    for center, radius in zip(geometry.centers, geometry.radii, strict=True)
                ]
        self._corners = np.concatenate(corners)

    def first(self, starts, directions, leaving) -> tuple[np.ndarray, np.ndarray]:
        """Primitives, −1 for none, and distances, inf for none. starts, directions : (3, n), camera space."""
        origins = (self._view.axes.T @ starts).T + self._view.eye
        ways = (self._view.axes.T @ directions).T
        columns = [
            self._triangle(corner, hidden, origins, ways) for corner, hidden in zip(self._corners, self._hidden, strict=True)
        ]
        count = len(columns)
        columns += [
            np.where(leaving == count + number, np.inf, self._sphere(*sphere, origins, ways))
            for number, sphere in enumerate(self._spheres)
        ]
        distances = np.stack([np.full(len(origins), np.inf), *columns])
        nearest = distances.min(axis=0)
        return np.where(np.isfinite(nearest), distances.argmin(axis=0) - 1, -1), nearest

    @staticmethod
    def _triangle(corners, hidden, origins, ways):
        """Möller and Trumbore's."""
        a, first, second = corners[0], corners[1] - corners[0], corners[2] - corners[0]
        across = np.cross(ways, second)
        with np.errstate(all="ignore"):
            scale = 1 / (across @ first)
            apart = origins - a
            u = (apart * across).sum(axis=1) * scale
            beside = np.cross(apart, first)
            v = (ways * beside).sum(axis=1) * scale
            t = beside @ second * scale
            return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (not hidden), t, np.inf)

    @staticmethod
    def _sphere(inverse, center, radius, hidden, origins, ways):
        """The near root of the quadratic equation, in the object's space."""
        apart, way = (origins - center) @ inverse.T, ways @ inverse.T
        a, half, c = (way * way).sum(axis=1), (way * apart).sum(axis=1), (apart * apart).sum(axis=1) - radius**2
        with np.errstate(all="ignore"):
            t = (-half - np.sqrt(half * half - a * c)) / a
        return np.where((t > 0) & (c > 0) & (not hidden), t, np.inf)


# What decides in float32 which primitive is first: corners, start and direction, each rounded by 2⁻²⁴, and Embree's products.
NEARBY = 16 * 2.0**-24


def unexplained(stage, kind: str, starts, directions, leaving, found) -> np.ndarray:
    """Which rays meet a primitive (−1 for none) that neither they nor any ray near them meets, by brute force."""
    oracle = Oracle(stage, kind)
    wrong = np.flatnonzero(oracle.first(starts, directions, leaving)[0] != found)
    size = np.abs(stage.surfaces.triangles.vertices).max(initial=1.0)
    rng = np.random.default_rng(0)
    for _ in range(20):
        moved = starts[:, wrong] + NEARBY * size * rng.uniform(-1, 1, (3, len(wrong)))
        turned = directions[:, wrong] + NEARBY * rng.uniform(-1, 1, (3, len(wrong)))
        wrong = wrong[oracle.first(moved, turned, leaving[wrong])[0] != found[wrong]]
    return wrong


def found_first(stage, points, directions, kind="diffuse"):
    met, hits, distances = stage.space.first(points, directions, kind)
    found, far = np.full(points.count, -1), np.full(points.count, np.inf)
    found[met], far[met] = hits.primitive, distances
    return found, far, hits


@settings(max_examples=4)
@given(seed=SEEDS)
def test_scattered_rays_meet_first_what_brute_force_finds(random_scene, stage_of, outwards, seed):
    check_scattered_rays(random_scene, stage_of, outwards, seed)


@settings(max_examples=2)
@given(seed=SEEDS)
def test_without_embree_they_meet_the_same(random_scene, stage_of, outwards, without_embree, seed):
    with pytest.MonkeyPatch.context() as patch:
        without_embree(patch)
        check_scattered_rays(random_scene, stage_of, outwards, seed)


def check_scattered_rays(random_scene, stage_of, outwards, seed, shift=0.0):
    rng = np.random.default_rng(seed)
    stage = stage_of(random_scene(seed))
    if not stage.points.count:
        return
    points = stage.points.at(rng.integers(0, stage.points.count, 150))
    directions = outwards(points, rng)
    found, distances, hits = found_first(stage, points, directions)
    starts = start(points.position, points.normal, directions, points.offset) + shift
    wrong = unexplained(stage, "diffuse", starts, directions, points.primitive, found)
    assert not len(wrong), f"{len(wrong)} of 150 rays meet what no ray near them meets: {found[wrong][:5]}"
    alike, far = Oracle(stage, "diffuse").first(points.position, directions, points.primitive)
    same = np.flatnonzero((alike == found) & (found >= 0))
    # Brute force loses digits in world space: coordinates of 10, triangles seen at angles of 1e-5.
    assert len(same) < 10 or np.percentile(np.abs(distances[same] / far[same] - 1), 95) < 1e-9
    met = np.flatnonzero(found >= 0)
    on_ray = points.position[:, met] + directions[:, met] * distances[met]
    assert np.abs(hits.position - on_ray).max(initial=0) < 1e-5, "a hit is not on its ray"
    assert (np.einsum("in,in->n", hits.normal, directions[:, met]) <= 1e-12).all(), "a normal looks away from the ray"


def test_starts_that_are_moved_are_found_out(random_scene, stage_of, outwards):
    with pytest.raises(AssertionError, match="rays meet what no ray near them meets"):
        check_scattered_rays(random_scene, stage_of, outwards, 0, shift=0.1)


@settings(max_examples=4)
@given(seed=SEEDS)
def test_shadow_rays_are_blocked_where_brute_force_finds_something_on_their_way(random_scene, stage_of, outwards, seed):
    check_shadow_rays(random_scene, stage_of, outwards, seed)


@settings(max_examples=2)
@given(seed=SEEDS)
def test_without_embree_the_same_are_blocked(random_scene, stage_of, outwards, without_embree, seed):
    with pytest.MonkeyPatch.context() as patch:
        without_embree(patch)
        check_shadow_rays(random_scene, stage_of, outwards, seed)


def check_shadow_rays(random_scene, stage_of, outwards, seed, stretch=1.0):
    rng = np.random.default_rng(seed)
    stage = stage_of(random_scene(seed))
    if not stage.points.count:
        return
    points = stage.points.at(rng.integers(0, stage.points.count, 150))
    directions = outwards(points, rng)
    distances = np.where(rng.random(150) < 0.3, np.inf, rng.uniform(0, 6, 150))
    blocked = stage.space.blocked(points, directions, distances * stretch)
    starts = start(points.position, points.normal, directions, points.offset)
    oracle = Oracle(stage, "shadow")
    cosine = np.einsum("in,in->n", points.normal, directions)

    def answer(which, move, turn):
        far = oracle.first(starts[:, which] + move, directions[:, which] + turn, points.primitive[which])[1]
        return far < distances[which]

    wrong = np.flatnonzero((answer(slice(None), 0, 0) != blocked) & (cosine > 1e-3))
    for _ in range(20):
        move, turn = (NEARBY * rng.uniform(-1, 1, (3, len(wrong))) for _ in range(2))
        wrong = wrong[answer(wrong, 8 * move, turn) != blocked[wrong]]
    assert not len(wrong), f"{len(wrong)} of 150 shadow rays are blocked or open and no ray near them is"


def test_shadow_rays_that_go_a_tenth_too_far_are_found_out(random_scene, stage_of, outwards):
    with pytest.raises(AssertionError, match="blocked or open"):
        for seed in range(5):
            check_shadow_rays(random_scene, stage_of, outwards, seed, stretch=1.1)


def test_the_rays_of_a_scene_without_anything_meet_nothing(stage_of, outwards, make_scene, make_mesh, make_spheres, finder):
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 8, 8)
    wall = make_mesh([[-9, -9, -5], [9, -9, -5], [0, 20, -5]], [[0, 1, 2]])
    points = stage_of(make_scene(camera, wall)).points
    flat = np.diag([1.0, 1.0, 0.0, 1.0])
    for things in (
        (),
        (make_mesh([], []),),
        (make_spheres([], []),),
        (make_mesh([[0, 0, -1]], [[0, 0, 0]]),),
        (make_mesh([[-1, 0, -1], [0, 0, -1], [1, 0, -1]], [[0, 1, 2]]),),  # a line
        (make_spheres([[0, 0, -2]], 0.0),),
        ((make_spheres([[0, 0, -2]], 1.0), flat),),  # a sphere that its matrix flattens
    ):
        stage = stage_of(make_scene(camera, *things))
        directions = outwards(points, np.random.default_rng(0))
        met, hits, distances = stage.space.first(points, directions, "diffuse")
        assert not len(met) and not hits.count and not len(distances)
        assert not stage.space.blocked(points, directions, np.full(points.count, np.inf)).any()


def test_no_rays_meet_nothing(random_scene, stage_of, finder):
    stage = stage_of(random_scene(1))
    none = stage.points.at(np.empty(0, np.intp))
    met, hits, distances = stage.space.first(none, np.empty((3, 0)), "glossy")
    assert not len(met) and not hits.count and not len(distances)
    assert stage.space.blocked(none, np.empty((3, 0)), np.empty(0)).shape == (0,)


def test_directions_that_are_no_directions_meet_nothing(random_scene, stage_of, finder):
    stage = stage_of(random_scene(1))
    points = stage.points.at(slice(0, 4))
    directions = np.array([[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0], [np.nan] * 3], float).T
    with np.errstate(invalid="ignore"):
        met, _, _ = stage.space.first(points, directions, "diffuse")
        assert not len(met)
        assert stage.space.blocked(points, directions, np.ones(4)).shape == (4,)


def _hidden(scene: Scene, number: int, *kinds: str) -> Scene:
    objects = list(scene.objects)
    objects[number] = replace(objects[number], hidden_from=frozenset(kinds))
    return replace(scene, objects=tuple(objects))


@pytest.mark.parametrize("kind", ["camera", "diffuse", "glossy", "transmission", "shadow"])
@pytest.mark.parametrize("thing", ["mesh", "wide mesh", "sphere"])
def test_what_is_hidden_from_a_kind_of_rays_is_met_by_all_others(
    stage_of, make_scene, make_mesh, make_spheres, finder, kind, thing
):
    """A floor, and between it and a ceiling something: it hides the one from the other."""
    size = 1e4 if thing == "wide mesh" else 3
    square = np.array([[-size, -size], [size, -size], [size, size], [-size, size]])
    halves = [[0, 1, 2], [0, 2, 3]]

    def level(z):
        return make_mesh(np.column_stack([square, np.full(4, z)]), halves)

    middle = make_spheres([[0, 0, 1]], 0.5) if thing == "sphere" else level(1.0)
    camera = Pinhole((0, -1, 1.5), (0, 0, 1), (0, 0, 1), 10, 1, 1)
    scene = make_scene(camera, level(0.0), middle, level(2.0))
    seen = []
    for hidden in (False, True):
        stage = stage_of(_hidden(scene, 1, kind) if hidden else scene)
        floor = stage_of(make_scene(Pinhole((0, 0, 0.5), (0, 0, 0), (0, 1, 0), 10, 1, 1), level(0.0))).points
        up = np.array([[0.0], [0.0], [1.0]])
        floor = replace(floor, position=stage.view.axes @ (0 * up - stage.view.eye[:, None]), normal=stage.view.axes @ up)
        if kind == "camera":
            seen.append(stage.points.position[:, 0])
        elif kind == "shadow":
            seen.append(stage.space.blocked(floor, stage.view.axes @ up, np.array([1.8]))[0])
        else:
            _, _, distance = stage.space.first(floor, stage.view.axes @ up, kind)
            seen.append(distance[0])
            others = {"diffuse", "glossy", "transmission"} - {kind}
            for other in others:
                _, _, distance = stage.space.first(floor, stage.view.axes @ up, other)
                assert distance[0] == pytest.approx(seen[0]), f"hidden from {kind}, and not seen by {other}"
    if kind == "camera":
        assert np.linalg.norm(seen[0] - seen[1]) > 0.5, "the camera sees what is hidden from it"
    elif kind == "shadow":
        assert seen == [True, False]
    else:
        assert seen == pytest.approx([0.5 if thing == "sphere" else 1.0, 2.0], rel=1e-6)
