"""Rays that meet triangles, what is interpolated there, and which way normals point."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Object, Scene

SEEDS = st.integers(0, 2**32 - 1)
FLOAT32, FLOAT64 = 2.0**-24, 2.0**-53


CAMERA = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 1, 1, 1)


def met(mesh, x, y):
    """Depths at which the rays (x, y, −1) from the origin meet a mesh, as the core says, inf where they do not."""
    core = CoreScene(Scene(CAMERA, {"mesh": mesh}, (Object("object", "mesh", np.eye(4)),)), 1)
    directions = np.stack(np.broadcast_arrays(x, y, -1.0), axis=-1).reshape(-1, 3)
    return core.closest(core.rays(np.zeros((1, 3)), directions))[0]


@settings(max_examples=60)
@given(seed=SEEDS, log_distance=st.integers(0, 4))
def test_depth_and_barycentric_coordinates_agree_with_rational_arithmetic(make_mesh, make_scene, seed, log_distance):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 1, (3, 3)) - (0, 0, 2.0 * 10**log_distance)
    uvs = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]])  # shown are the second and third coordinates
    weights = rng.dirichlet((1, 1, 1))
    point = weights @ (corners * (1, 1, -1))
    x, y = point[:2] / point[2]
    mesh = make_mesh(corners, [[0, 1, 2]], corner_uvs=uvs)
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 1, 1, 1, (0.0, 0.0))
    (depth,) = met(mesh, x, y)
    first, second, _ = Tracer(make_scene(camera, mesh), 1).surface_at([0], [0], x, y)["UV"][0].astype(float)

    a, b, c = ([Fraction(value) for value in corner] for corner in corners * (1, 1, -1))
    ray = [Fraction(x), Fraction(y), Fraction(1)]
    edges = [[q - p for p, q in zip(a, other, strict=True)] for other in (b, c)]
    whole = determinant(edges[0], edges[1], [-value for value in ray])
    start = [-value for value in a]
    exact_first = determinant(start, edges[1], [-value for value in ray]) / whole
    exact_second = determinant(edges[0], start, [-value for value in ray]) / whole
    exact_depth = determinant(edges[0], edges[1], start) / whole

    # Forward error: the rounding of n·A and of n·(x, y, 1), each some 8 products and sums of 2⁻⁵³, over the cosine between the
    # plane and the ray; barycentric coordinates lose distance over height besides.
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    cosine = abs(normal @ (x, y, -1)) / np.linalg.norm(normal) / np.linalg.norm((x, y, 1))
    distance, height = np.linalg.norm(corners, axis=1).max(), np.linalg.norm(normal) / 2.9
    allowed = 64 * FLOAT64 / max(cosine, 1e-300)
    assert abs(depth / float(exact_depth) - 1) <= allowed
    for value, exact in ((first, exact_first), (second, exact_second)):
        assert abs(value - float(exact)) <= allowed * distance / height + FLOAT32, f"{value} instead of {float(exact)}"


def determinant(a, b, c):
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@settings(max_examples=20)
@given(seed=SEEDS)
def test_a_uv_map_that_is_linear_in_the_position_is_shown_as_such(ball, make_scene, random_matrix, seed):
    rng = np.random.default_rng(seed)
    matrix = random_matrix(rng, spread=0.3)
    scene = make_scene(Pinhole((0, -5, 1), (0, 0, 0), (0, 0, 1), 40, 48, 48), (ball(6), matrix))
    passes = Tracer(scene).render()
    hit = passes["Object Index"][..., 0] == 1
    assert hit.any()
    in_object = (np.linalg.inv(matrix) @ np.append(passes["Position"][hit].astype(float), np.ones((hit.sum(), 1)), axis=1).T).T
    # The balls' UV map is the x and y of object space. Position and UV are rounded once, and the inverse magnifies the first.
    allowed = FLOAT32 * (4 * np.linalg.norm(np.linalg.inv(matrix), 2) * 6 + 4)
    worst = np.abs(passes["UV"][hit][:, :2] - in_object[:, :2]).max()
    assert worst <= allowed, f"UV differs by {worst:.1e}, allowed {allowed:.1e}"
    assert (passes["UV"][hit][:, 2] == 1).all() and (passes["UV"][~hit] == 0).all()


@settings(max_examples=20)
@given(seed=SEEDS)
def test_flat_normals_face_the_eye_and_stand_upright_on_the_face_under_any_matrix(make_mesh, make_scene, random_matrix, seed):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(3, 3))
    matrix = random_matrix(rng)
    camera = Pinhole((0, -9, 1), tuple(matrix[:3, 3] + matrix[:3, :3] @ corners.mean(axis=0)), (0, 0, 1), 500, 9, 9)
    passes = Tracer(make_scene(camera, (make_mesh(corners, [[0, 1, 2]]), matrix))).surface_at([4], [4])
    if passes["Facing"][0, 0] < 1e-3:
        return  # seen edge-on, perhaps missed
    world = corners @ matrix[:3, :3].T
    normal = passes["Normal"][0].astype(float)
    for edge in (world[1] - world[0], world[2] - world[0]):
        assert abs(normal @ edge) <= 4 * FLOAT32 * np.linalg.norm(edge)
    direction = camera.ray_directions(4, 4)
    assert normal @ direction < 0
    assert abs(-normal @ direction - passes["Facing"][0, 0]) <= 4 * FLOAT32


def smooth_triangle(make_mesh, tilt=0.5):
    """A triangle in the plane z = 0 whose corners' normals lean outwards."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [0, 1.5, 0.0]])
    normals = corners * tilt + (0, 0, 1)
    return make_mesh(corners, [[0, 1, 2]], corner_normals=[normals / np.linalg.norm(normals, axis=1, keepdims=True)])


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("mirrored", [False, True])
def test_smooth_normals_are_those_of_the_corners_turned_with_the_face_towards_the_eye(make_mesh, make_scene, side, mirrored):
    mesh = smooth_triangle(make_mesh)
    matrix = np.diag([-1.0 if mirrored else 1.0, 1, 1, 1])
    camera = Pinhole((0, 0, 5 * side), (0, 0, 0), (0, 1, 0), 400, 400, 400)
    passes = Tracer(make_scene(camera, (mesh, matrix))).render()
    column, row = 200, 150
    position = passes["Position"][row, column].astype(float)
    weights = np.linalg.solve(np.vstack([mesh.vertices[:, :2].T, np.ones(3)]), [position[0] * matrix[0, 0], position[1], 1])
    expected = weights @ mesh.corner_normals[0].astype(float)
    expected[0] *= matrix[0, 0]
    expected *= side / np.linalg.norm(expected)
    assert np.abs(passes["Normal"][row, column] - expected).max() <= 8 * FLOAT32


def turned_by_cofactors(linear, normals):
    """Normals as cross products of sides turn: (n, 3), unit."""
    a, b, c = linear.T
    turned = normals @ np.array([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)


@settings(max_examples=30)
@given(seed=SEEDS, squeezed=st.sampled_from([1.0, 1e-3, 1e-9, 1e-30, 0.0]))
def test_smooth_normals_are_turned_by_the_cofactors_of_any_matrix_mirrored_sheared_or_flat(
    make_mesh, make_scene, random_matrix, seed, squeezed
):
    """Flattened along the triangle's own normal it stays what it is, and all of its normals become one."""
    rng = np.random.default_rng(seed)
    mesh, matrix = smooth_triangle(make_mesh), random_matrix(rng)
    matrix[:3, 2] *= squeezed
    weights = rng.dirichlet((3, 3, 3))
    corners = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    eye = corners.mean(axis=0) + rng.normal(size=3) * 5
    passes = Tracer(make_scene(Pinhole(tuple(eye), tuple(weights @ corners), (0, 0, 1), 500, 9, 9), (mesh, matrix))).surface_at(
        [4], [4]
    )
    if passes["Facing"][0, 0] < 1e-3:
        return  # seen edge-on
    side = -np.sign(np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ (weights @ corners - eye))
    expected = weights @ turned_by_cofactors(matrix[:3, :3], mesh.corner_normals[0].astype(float))
    expected *= side / np.linalg.norm(expected)
    # Weights are off by rounding over the cosine under which the triangle is seen, at most 1e-12.
    off = np.abs(passes["Normal"][0] - expected).max()
    assert off <= FLOAT32, f"{passes['Normal'][0]} instead of {expected}"


def test_normals_of_a_mesh_with_one_user_are_normalized_at_its_corners_and_shared_ones_are_not(make_mesh):
    """Cycles does so with a mesh that it moves to world space beforehand, and with one that it can't."""
    mesh = smooth_triangle(make_mesh)
    matrix = np.diag([3.0, 1, 1, 1])
    camera = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 100, 100)
    away = np.eye(4)
    away[2, 3] = -100
    normals = []
    for objects in (("single",), ("first", "second")):
        placed = tuple(Object(name, "mesh", matrix if index == 0 else away) for index, name in enumerate(objects))
        passes = Tracer(Scene(camera, {"mesh": mesh}, placed)).surface_at([50], [40])
        normals.append(passes["Normal"][0])
    turned = mesh.corner_normals[0] / (3, 1, 1)
    weights = np.array([0.5, 0.5, 0]) + (passes["Position"][0, 1] + 1) / 2.5 * np.array([-0.5, -0.5, 1])
    weights += passes["Position"][0, 0] / 3 / 2 * np.array([-1, 1, 0])
    for normal, corners in zip(normals, (turned / np.linalg.norm(turned, axis=1, keepdims=True), turned), strict=True):
        expected = weights @ corners
        assert np.abs(normal - expected / np.linalg.norm(expected)).max() <= 16 * FLOAT32
    assert np.abs(normals[0] - normals[1]).max() > 1e-3, "the two ways differ on this triangle"


def test_a_face_whose_corner_normals_cancel_shows_its_own(make_mesh, make_scene):
    mesh = make_mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], corner_normals=np.zeros((1, 3, 3)))
    camera = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 100, 100)
    normal = Tracer(make_scene(camera, mesh)).surface_at([50], [50])["Normal"][0]
    assert np.array_equal(normal, [0, 0, 1])


def test_a_triangle_seen_nearly_edge_on_is_met_within_its_own_depths(make_mesh, make_scene):
    result = []
    for lift in (0.0, 1e-300, 1e-17, 1e-12):
        mesh = make_mesh([[-1, lift, -2], [1, lift, -2], [0, -lift, -9]], [[0, 1, 2]])
        depth = met(mesh, np.array([0, 0, 0.1]), np.array([0, lift / 10, -lift / 20]))
        result += depth[np.isfinite(depth)].tolist()
    assert len(result) > 3 and all(2 <= depth <= 9 for depth in result), result


@pytest.mark.parametrize("slenderness", [1e2, 1e6, 1e12])
def test_the_depth_of_a_sliver_does_not_know_how_slender_it_is(make_mesh, slenderness):
    rng = np.random.default_rng(2)
    for _ in range(20):
        along = rng.normal(size=3)
        across = np.cross(along, rng.normal(size=3))
        across /= np.linalg.norm(across) * slenderness / np.linalg.norm(along)
        corners = np.array([along, -along, 0.2 * along + across]) * 0.3 - (0, 0, 3.0)
        point = np.array([0.3, 0.3, 0.4]) @ (corners * (1, 1, -1))
        x, y = point[:2] / point[2]
        core = CoreScene(Scene(CAMERA, {"mesh": make_mesh(corners, [[0, 1, 2]])}, (Object("object", "mesh", np.eye(4)),)), 1)
        _, _, (depth,), _, _ = core.leaving(core.rays([[0, 0, 0]], [[x, y, -1.0]]), np.array([0.0, 0.0, 1.0]))
        a, b, c = ([Fraction(value) for value in corner] for corner in corners * (1, 1, -1))
        p, q = ([end - start for start, end in zip(a, other, strict=True)] for other in (b, c))
        ray = [Fraction(x), Fraction(y), Fraction(1)]
        exact_depth = float(determinant(a, p, q) / determinant(ray, p, q))
        cosine = abs(np.dot(np.cross(along, across), (x, y, -1))) / np.linalg.norm(np.cross(along, across))
        # As for any triangle: some eight products and sums of 2⁻⁵³, over the cosine between the plane and the ray.
        assert abs(depth / exact_depth - 1) <= 16 * FLOAT64 / cosine, f"{depth / exact_depth - 1:.1e}"


# --- A ground that reaches far and comes near: what lies on it is seen, and so is the ground itself right below the eye


EXTENTS = [1e1, 1e2, 1e3, 1e4, 1e6, 1e9]


@pytest.fixture
def ground_and_mat(make_mesh, make_scene):
    """ground_and_mat(extent, thickness, height, seed) → a Scene, turned anyhow: a ground (object 1) with a mat on it (2)."""

    def build(extent, thickness, height=1.6, seed=0):
        turned = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        ground = np.array([[-1, -0.37, 0], [0.83, -0.71, 0], [0.91, 0.57, 0], [-0.77, 1, 0]]) * extent
        mat = np.array([[-0.5, 1, thickness], [0.5, 1, thickness], [0.5, 3, thickness], [-0.5, 3, thickness]])
        camera = Pinhole(tuple(turned @ (0, 0, height)), tuple(turned @ (0, 2, 0)), tuple(turned[:, 2]), 60, 60, 60)
        halves = [[0, 1, 2], [0, 2, 3]]
        return make_scene(camera, make_mesh(ground @ turned.T, halves), make_mesh(mat @ turned.T, halves))

    return build


def seen(scene):
    return Tracer(scene).render()["Object Index"][..., 0].astype(int)


def outline_of_the_mat(scene) -> np.ndarray:
    """The picture on paper: 2 where the ray through a pixel's center meets the mat's rectangle."""
    rows, columns = np.mgrid[: scene.camera.height, : scene.camera.width]
    corners = scene.geometries["geometry 1"].vertices
    directions = scene.camera.ray_directions(columns, rows)
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    distance = (corners[0] - np.array(scene.camera.eye)) @ normal / (directions @ normal)
    on_it = np.array(scene.camera.eye) + distance[..., None] * directions - corners[0]
    sides = [side / (side @ side) for side in (corners[1] - corners[0], corners[3] - corners[0])]
    return np.logical_and.reduce([(on_it @ side >= 0) & (on_it @ side <= 1) for side in sides]) & (distance > 0)


@pytest.mark.parametrize("extent", EXTENTS)
@pytest.mark.parametrize("seed", range(3))
def test_a_thin_mat_is_seen_on_a_ground_of_any_extent(ground_and_mat, extent, seed):
    scene = ground_and_mat(extent, thickness=1e-4, seed=seed)
    picture, mat = seen(scene), outline_of_the_mat(scene)
    assert mat.sum() > 500 and np.array_equal(picture == 2, mat), f"{(mat & (picture != 2)).sum()} pixels of the mat are lost"
    assert (picture[:20] > 0).all(), "the ground has a hole near the eye"


@pytest.mark.parametrize("height", [1e-2, 1e-5, 1e-8])
@pytest.mark.parametrize("seed", range(3))
def test_an_eye_close_above_a_ground_does_not_look_through_it(ground_and_mat, height, seed):
    scene = ground_and_mat(1e3, thickness=0.0, height=height, seed=seed)
    down = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0] @ (0.1, 0.2, -1)
    camera = Pinhole(scene.camera.eye, tuple(np.array(scene.camera.eye) + down), (0.3, 0.5, 0.8), 60, 60, 60)
    passes = Tracer(type(scene)(camera, scene.geometries, scene.objects[:1])).render()
    assert (passes["Object Index"] == 1).all(), f"{(passes['Object Index'] != 1).sum()} rays pass through the ground"
    below = camera.ray_directions(*np.meshgrid(np.arange(60), np.arange(60))) @ (down / np.linalg.norm(down))
    floor = scene.geometries["geometry 0"].vertices
    normal = np.cross(floor[1] - floor[0], floor[3] - floor[0])
    normal /= np.linalg.norm(normal)
    above = abs((np.array(camera.eye) - floor[0]) @ normal)
    slope = np.abs(camera.ray_directions(*np.meshgrid(np.arange(60), np.arange(60))) @ normal)
    # The eye's height over the plane is the difference of coordinates of up to 1e3, each rounded by 2⁻⁵³.
    allowed = 2.0**-23 + 32 * 2.0**-53 * 1e3 / height
    assert np.abs(passes["Depth"][..., 0] / (above / slope * below) - 1).max() <= allowed
