"""Scattered and shadow rays neither step over what is there nor meet what they leave, at any scale and place.

Counted where paper knows the answer: closed rooms, which no ray leaves; convex bodies and floors, which no ray that leaves
them outwards meets again; a mat on a floor, whose shadow ends where the light's slope says.
"""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays import offset, triangles, visibility

# Of the rays that scatter in a closed room, in all that was tried, at most 2 in 10⁶ left it: those of points that are nearer
# to a corner of the room than float32 can tell.
LEAKS = 1e-5

PLACES = [(1.0, 0.0), (1e-3, 0.0), (1e4, 0.0), (1.0, 1e3), (1e-2, 1e5), (1e-30, 0.0), (1e12, 0.0)]
HALVES = [[0, 1, 2], [0, 2, 3]]
SQUARE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])


@pytest.fixture
def turned():
    """A rotation askew to all axes."""
    return np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


@pytest.fixture
def box(make_mesh):
    """box(height) → a closed box of twelve triangles, from −1 to 1 in x and y."""

    def build(height=1.0):
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-height, height)], float)
        sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        return make_mesh(corners, [np.array(side)[half] for side in sides for half in HALVES])

    return build


def lambert(points, rng):
    """(3, n) unit directions, as a Lambert surface scatters them."""
    directions = rng.normal(size=(3, points.count))
    directions /= np.linalg.norm(directions, axis=0)
    directions += points.normal
    return directions / np.linalg.norm(directions, axis=0)


def placed(make_scene, turned, mesh, eye, look_at, scale=1.0, far=0.0, size=120, distance=60.0):
    """A scene of one mesh, turned, scaled and moved away, and the camera with it."""
    matrix = np.eye(4)
    matrix[:3, :3] = turned * scale
    matrix[:3, 3] = np.array([1.0, -0.7, 0.3]) * far
    e, to = (matrix[:3, :3] @ place + matrix[:3, 3] for place in (eye, look_at))
    return make_scene(Pinhole(tuple(e), tuple(to), tuple(turned @ (0.1, 0.9, -0.2)), distance, size, size), (mesh, matrix))


def leaks(stage, rng, bounces=8):
    """The share of the rays scattered in a closed room that leave it, and of shadow rays that see the sky."""
    points, escaped, lit, count = stage.points, 0, 0, 0
    for _ in range(bounces):
        directions = lambert(points, rng)
        lit += np.count_nonzero(~stage.space.blocked(points, directions, np.full(points.count, np.inf)))
        met, further, _ = stage.space.first(points, directions, "diffuse")
        escaped += points.count - len(met)
        count += points.count
        points = further
    return escaped / count, lit / count


@pytest.mark.parametrize(("scale", "far"), PLACES)
@pytest.mark.parametrize("room", ["box", "flat box", "ball"])
def test_no_ray_leaves_a_closed_room(stage_of, make_scene, turned, box, ball, room, scale, far):
    mesh = {"box": box(), "flat box": box(1e-2), "ball": ball(40)}[room]
    stage = stage_of(placed(make_scene, turned, mesh, (0.3, 0.2, 0.003), (0.1, 0.9, 0.0), scale, far))
    escaped, lit = leaks(stage, np.random.default_rng(0))
    assert max(escaped, lit) <= LEAKS, f"{escaped:.1e} of the scattered rays leave it, {lit:.1e} of the shadow rays"


@pytest.mark.parametrize("apart", [1e-2, 1e-4, 1e-7])
def test_no_ray_leaves_a_room_past_the_wall_that_the_eye_is_close_to(stage_of, make_scene, turned, box, apart):
    stage = stage_of(placed(make_scene, turned, box(), (0.3, 0.2, 1 - apart), (0.1, 0.9, 0.0)))
    escaped, lit = leaks(stage, np.random.default_rng(0), bounces=12)
    assert max(escaped, lit) <= LEAKS, f"{escaped:.1e} of the scattered rays leave it, {lit:.1e} of the shadow rays"


@pytest.mark.exhaustive
@pytest.mark.parametrize(("scale", "far"), PLACES)
def test_of_ten_million_rays_none_leaves_a_ball_of_a_hundred_thousand_triangles(stage_of, make_scene, turned, ball, scale, far):
    stage = stage_of(placed(make_scene, turned, ball(160), (0.3, 0.2, 0.1), (0.1, 0.9, 0.0), scale, far, 300, 150.0))
    escaped, lit = leaks(stage, np.random.default_rng(0), bounces=100)
    assert max(escaped, lit) <= 1e-6, f"{escaped:.1e} of the scattered rays leave it, {lit:.1e} of the shadow rays"


def test_a_room_with_a_hole_is_left(stage_of, make_scene, make_mesh, turned, ball):
    mesh = ball(40)
    holed = make_mesh(mesh.vertices, np.delete(mesh.triangles, 1000, axis=0))
    escaped, lit = leaks(
        stage_of(placed(make_scene, turned, holed, (0.3, 0.2, 0.1), (0.1, 0.9, 0.0))), np.random.default_rng(0)
    )
    assert min(escaped, lit) > LEAKS, (escaped, lit)


@pytest.mark.parametrize(("scale", "far"), PLACES)
@pytest.mark.parametrize("thing", ["ball", "floor", "wide floor"])
def test_no_ray_meets_the_surface_that_it_leaves(stage_of, make_scene, make_mesh, turned, ball, thing, scale, far):
    floor = {"floor": 3.0, "wide floor": 1e4}.get(thing)
    mesh = ball(20) if floor is None else make_mesh(SQUARE * floor, HALVES)
    stage = stage_of(placed(make_scene, turned, mesh, (0.3, 2.5, 1.6), (0.0, 0.3, 0.0), scale, far))
    rng = np.random.default_rng(0)
    assert stage.points.count > 1000
    for directions in (lambert(stage.points, rng), flat(stage.points, rng)):
        met, _, _ = stage.space.first(stage.points, directions, "diffuse")
        blocked = stage.space.blocked(stage.points, directions, np.full(stage.points.count, np.inf))
        assert not len(met) and not blocked.any(), f"{len(met)} rays and {blocked.sum()} shadow rays meet it"


def flat(points, rng):
    """(3, n) unit directions that rise from the surface by little."""
    across = np.cross(points.normal.T, rng.normal(size=(points.count, 3))).T
    slope = offset.FLATTEST ** rng.uniform(0, 0.99, points.count)
    return points.normal * slope + across / np.linalg.norm(across, axis=0) * np.sqrt(1 - slope**2)


def test_rays_that_start_on_the_surface_itself_meet_it(without_kernels, monkeypatch, stage_of, make_scene, turned, ball):
    if visibility.EmbreeScene is None:
        pytest.skip("without Embree all is float64")
    monkeypatch.setattr(offset, "start", lambda points, normals, directions, offsets: points)
    stage = stage_of(placed(make_scene, turned, ball(20), (0.3, 2.5, 1.6), (0.0, 0.3, 0.0)))
    met, _, _ = stage.space.first(stage.points, lambert(stage.points, np.random.default_rng(0)), "diffuse")
    assert len(met) > 0.05 * stage.points.count, len(met)


@pytest.fixture
def mat_on_a_floor(make_scene, make_mesh, turned, stage_of):
    """mat_on_a_floor(extent, thickness) → Stage: what the camera sees before the edge of a mat on a floor, and that edge."""

    def build(extent, thickness):
        mat = np.array([[-0.5, 1, thickness], [0.5, 1, thickness], [0.5, 3, thickness], [-0.5, 3, thickness]])
        front = np.array([[-0.5, 1, 0], [0.5, 1, 0]])
        floor = np.array([[-1, -0.37, 0], [0.83, -0.71, 0], [0.91, 0.57, 0], [-0.77, 1, 0]]) * extent
        vertices = np.concatenate([floor, mat, front]) @ turned.T
        mesh = make_mesh(vertices, [*HALVES, [4, 5, 6], [4, 6, 7], [8, 9, 5], [8, 5, 4]])
        eye, look_at = turned @ (0, 0, 1.6), turned @ (0, 1 - 2 * thickness, 0)
        return stage_of(make_scene(Pinhole(tuple(eye), tuple(look_at), tuple(turned[:, 2]), 12 / thickness, 40, 40), mesh))

    return build


def wrong_shadows(stage, turned, thickness):
    """The share of points whose shadow by a low sun beyond the mat's edge is not as long as on paper."""
    on_floor = stage.points.at(np.flatnonzero(stage.points.primitive < 2))
    before = 1 - (stage.view.axes.T @ on_floor.position + stage.view.eye[:, None]).T @ turned[:, 1]
    wrong = np.zeros(on_floor.count, bool)
    for slope in (0.2, 0.5, 1.0):
        sun = stage.view.axes @ turned @ np.array([0.0, 1.0, slope]) / np.hypot(1, slope)
        directions = np.repeat(sun[:, None], on_floor.count, axis=1)
        blocked = stage.space.blocked(on_floor, directions, np.full(on_floor.count, np.inf))
        met, _, _ = stage.space.first(on_floor, directions, "diffuse")
        below = before * slope / thickness
        clear = np.abs(below - 1) > 0.2
        hit = np.isin(np.arange(on_floor.count), met)
        wrong |= clear & ((blocked != (below < 1)) | (hit != (below < 1)))
    assert on_floor.count > 200 and 0.1 < (before < thickness).mean() < 0.9
    return wrong.mean()


@pytest.mark.parametrize(
    ("extent", "thickness"), [(1e1, 1e-4), (1e2, 1e-3), (1e3, 1e-2), (1e3, 1e-4), (1e4, 1e-4), (1e6, 1e-4)]
)
def test_the_shadow_of_a_thin_mat_is_as_long_as_on_paper_on_a_floor_of_any_extent(mat_on_a_floor, turned, extent, thickness):
    stage = mat_on_a_floor(extent, thickness)
    wrong = wrong_shadows(stage, turned, thickness)
    assert stage.points.offset.max() < 0.2 * thickness, "what rays start higher by is more than is allowed for"
    assert wrong == 0, f"{wrong:.1%} of the points beside the mat are lit or dark and should not"


def test_without_care_for_wide_triangles_the_shadow_is_lost(monkeypatch, mat_on_a_floor, turned):
    if visibility.EmbreeScene is None:
        pytest.skip("without Embree all is float64")
    monkeypatch.setattr(triangles, "WIDE", np.inf)
    wrong = wrong_shadows(mat_on_a_floor(1e5, 1e-2), turned, 1e-2)
    assert wrong > 0.1, f"{wrong:.1%}"


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("extent", [3.0, 1e4])
def test_a_light_just_before_a_wall_is_seen_and_one_just_behind_it_is_not(
    stage_of, make_scene, make_mesh, turned, scale, extent
):
    """Lights 1e-5 of the way off a ceiling, and lights that touch it, seen from a floor."""
    vertices = np.concatenate([SQUARE * 3, SQUARE * extent + (0, 0, 2)])
    mesh = make_mesh(vertices, [*HALVES, *(np.array(HALVES) + 4)])
    stage = stage_of(placed(make_scene, turned, mesh, (0.3, 2.5, 1.99), (0.0, 0.3, 0.0), scale))
    rng = np.random.default_rng(0)
    floor = stage.points.at(np.flatnonzero(stage.points.primitive < 2))
    aims = scale * turned @ np.concatenate([rng.uniform(-1, 1, (2, floor.count)), np.full((1, floor.count), 2.0)])
    aims = stage.view.axes @ (aims - stage.view.eye[:, None])
    apart = aims - floor.position
    distance = np.linalg.norm(apart, axis=0)
    up = stage.view.axes @ turned[:, 2]
    for rise, hidden in ((-1e-5, False), (0.0, False), (1e-5, True)):
        # The offset of a ceiling of 3 m is a roundings' dozen of 3 m, 1e-6 of the way.
        further = rise * 2 * scale / (up @ (apart / distance))
        blocked = stage.space.blocked(floor, apart / distance, distance + further)
        assert (blocked == hidden).all(), f"{rise}: {(blocked != hidden).sum()} of {floor.count} lights"
