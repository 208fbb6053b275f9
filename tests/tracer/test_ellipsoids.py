"""Rays that meet spheres and ellipsoids, against the quadric itself in many digits."""

import warnings

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Object, Scene

SEEDS = st.integers(0, 2**32 - 1)
FLOAT32, FLOAT64 = 2.0**-24, 2.0**-53
CAMERA = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 1, 1, 1)


def found_depths(placed, spheres, x, y, eye=(0.0, 0.0, 0.0)):
    """The depths where the rays (x, y, −1) from an eye meet some spheres, as the core says: in units of that direction."""
    core = CoreScene(Scene(CAMERA, {"spheres": spheres}, (placed,)), 1)
    directions = np.stack([x, y, np.full(np.shape(x), -1.0)], axis=-1)
    return core.closest(core.rays(np.asarray(eye, float)[None], directions))[0]


def quadric_root(matrix, center, radius, x, y):
    """The nearest depth > 0 at which the ray meets the ellipsoid, its discriminant over its square, in 60 digits, or None."""
    with mpmath.workdps(60):
        linear = mpmath.matrix(matrix[:3, :3].tolist())
        moved = linear * mpmath.matrix(center.tolist()) + mpmath.matrix(matrix[:3, 3].tolist())
        inverse = linear**-1
        ray = inverse * mpmath.matrix([mpmath.mpf(x), mpmath.mpf(y), -1]) / mpmath.mpf(radius)
        center = inverse * moved / mpmath.mpf(radius)
        a, half = sum(d * d for d in ray), sum(d * f for d, f in zip(ray, center, strict=True))
        discriminant = half * half - a * (sum(f * f for f in center) - 1)
        if discriminant < 0 or half <= 0:
            return None, float(discriminant / a), center
        return float((half - mpmath.sqrt(discriminant)) / a), float(discriminant / a), center


@settings(max_examples=80)
@given(seed=SEEDS, log_distance=st.integers(0, 6))
def test_the_near_root_agrees_with_the_quadric_in_sixty_digits(make_spheres, random_matrix, seed, log_distance):
    rng = np.random.default_rng(seed)
    matrix = random_matrix(rng)
    matrix[2, 3] -= 6.0 * 10**log_distance
    center, radius = rng.uniform(-1, 1, 3), rng.uniform(0.1, 1)
    middle = matrix[:3, :3] @ center + matrix[:3, 3]
    aim = middle + matrix[:3, :3] @ rng.normal(size=3) * radius * 0.6
    x, y = aim[:2] / -aim[2]
    depth = found_depths(Object("object", "spheres", matrix), make_spheres([center], radius), np.array([x]), np.array([y]))[0]
    exact, discriminant, unit_center = quadric_root(matrix, center, radius, x, y)

    # In the space of the unit sphere, the center stands at |f| and is rounded by some 2⁻⁵³ |f| times the matrix's condition; so
    # is the foot of the perpendicular, and the discriminant 1 − l² by twice that.
    size = float(mpmath.norm(unit_center))
    rounding = 32 * FLOAT64 * size * np.linalg.cond(matrix[:3, :3])
    if abs(discriminant) <= 2 * rounding:
        return  # the ray grazes the outline closer than float64 can tell
    assert (exact is None) == np.isinf(depth), f"depth {depth} instead of {exact}"
    if exact is not None:
        reach = abs(middle[2]) / size  # depth per unit of that space
        allowed = rounding * (1 + 1 / np.sqrt(discriminant)) * reach + 8 * FLOAT64 * exact
        assert abs(depth - exact) <= allowed, f"depth off by {abs(depth - exact):.1e}, allowed {allowed:.1e}"


def test_a_unit_sphere_a_million_away_keeps_its_digits(make_spheres):
    """The textbook's quadratic is off by 7e-3 there; the perpendicular's discriminant by 2e-10 (facts of prior art)."""
    placed = Object("object", "spheres", np.eye(4))
    x = np.linspace(0, 0.9e-6, 50)
    depth = found_depths(placed, make_spheres([[0, 0, -1e6]], 1.0), x, np.zeros(50))
    with mpmath.workdps(40):
        exact = [
            (mpmath.mpf(10) ** 6 - mpmath.sqrt(1 - mpmath.mpf(value) ** 2 * (mpmath.mpf(10) ** 12 - 1)))
            / (1 + mpmath.mpf(value) ** 2)
            for value in map(float, x)
        ]
    worst = max(abs(mpmath.mpf(float(a)) - b) for a, b in zip(depth, exact, strict=True))
    assert worst <= 1e-9, f"{float(worst):.1e}"


@settings(max_examples=20)
@given(seed=SEEDS)
def test_positions_lie_on_the_ellipsoid_facing_is_its_normals_and_the_normal_shown_is_cycles(
    make_scene, make_spheres, random_matrix, seed
):
    rng = np.random.default_rng(seed)
    matrix = random_matrix(rng, spread=0.5)
    camera = Pinhole((5, -6, 3), tuple(matrix[:3, 3]), (0, 0, 1), 60, 40, 40)
    passes = Tracer(make_scene(camera, (make_spheres([[0, 0, 0]], 1.0), matrix))).render()
    hit = passes["Object Index"][..., 0] == 1
    rays = camera.ray_directions(*np.nonzero(hit)[::-1])
    inverse = np.linalg.inv(matrix)
    position, normal = passes["Position"][hit].astype(float), passes["Normal"][hit].astype(float)
    unit = position @ inverse[:3, :3].T + inverse[:3, 3]
    stretch = np.linalg.norm(inverse[:3, :3], 2)
    off = np.abs(np.linalg.norm(unit, axis=1) - 1).max()
    assert off <= 8 * FLOAT32 * stretch, f"positions are off the ellipsoid by {off:.1e} of its radius"

    gradient = unit @ inverse[:3, :3]
    cosine = -np.einsum("ij,ij->i", gradient, rays) / np.linalg.norm(gradient, axis=1)
    # The gradient is taken at a position that is rounded to float32, and turns with it by the ellipsoid's curvature.
    allowed = FLOAT32 * (4 + 8 * stretch * np.linalg.cond(matrix[:3, :3]))
    worst = np.abs(cosine - passes["Facing"][hit][:, 0]).max()
    assert worst <= allowed, f"Facing is off by {worst:.1e}, allowed {allowed:.1e}"

    outward = position - matrix[:3, 3]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    along = np.einsum("ij,ij->i", outward, rays)
    clear = np.abs(along) > allowed  # at a right angle to the ray, a rounding decides which side is shown
    expected = -outward * np.sign(along)[:, None]
    worst = np.abs(normal - expected)[clear].max()
    assert worst <= allowed, f"the normal shown is off by {worst:.1e}, allowed {allowed:.1e}"


def test_a_spheres_shown_normal_is_its_normal(make_scene, make_spheres):
    camera = Pinhole((5, -6, 3), (0, 0, 0), (0, 0, 1), 60, 40, 40)
    passes = Tracer(make_scene(camera, make_spheres([[0.1, 0.2, 0.3]], 2.0))).render()
    hit = passes["Object Index"][..., 0] == 1
    rays = camera.ray_directions(*np.nonzero(hit)[::-1])
    cosine = -np.einsum("ij,ij->i", passes["Normal"][hit].astype(float), rays)
    assert np.abs(cosine - passes["Facing"][hit][:, 0]).max() <= 4 * FLOAT32


@settings(max_examples=60)
@given(seed=SEEDS, log_condition=st.integers(0, 4), log_distance=st.integers(0, 13))
@example(seed=0, log_condition=2, log_distance=13)
def test_a_ray_that_touches_an_ellipsoid_where_its_box_does_meets_what_it_meets_without_boxes(
    make_spheres, random_matrix, seed, log_condition, log_distance
):
    """An object's own rounding of a ray may move it to the other side of the box's plane. A thing far away makes boxes so
    coarse that they leave out nothing close by: that is the oracle."""
    rng = np.random.default_rng(seed)
    geometries, objects, origins, directions = {"far": make_spheres([[0, 0, 0]], 1.0)}, [], [], []
    for number in range(12):
        matrix = random_matrix(rng)
        matrix[:3, :3] *= 10.0 ** rng.uniform(-log_condition, 0, 3)  # each column by a factor of its own
        center = rng.normal(size=3) * 10.0 ** rng.uniform(0, log_distance)
        middle = rng.normal(size=3) * 3
        matrix[:3, 3] = middle - matrix[:3, :3] @ center
        name = f"spheres {number}"
        geometries[name] = make_spheres([center], rng.uniform(0.3, 2))
        objects.append(Object(name, name, matrix))
        linear = matrix[:3, :3] * geometries[name].radii[0]
        for axis in range(3):
            touching = linear @ linear[axis] / np.linalg.norm(linear[axis])  # the point that is farthest along the axis
            along = rng.normal(size=(40, 3))
            along[:, axis] = 0
            inward = np.linalg.norm(linear[axis]) * rng.uniform(-1, 1, (40, 1)) * 10.0 ** rng.uniform(-16, 0, (40, 1))
            origins.append(middle + touching - along - inward * np.eye(3)[axis])
            directions.append(along)
    origins, directions = np.concatenate(origins), np.concatenate(directions)

    def depths(*more):
        core = CoreScene(Scene(CAMERA, geometries, (*objects, *more)), 1)
        return core.closest(core.rays(origins, directions))[0]

    away = np.eye(4)
    away[:3, 3] = 1e6
    boxes, no_boxes = depths(), depths(Object("far", "far", away))
    differ = np.flatnonzero(boxes != no_boxes)
    pairs = list(zip(boxes[differ], no_boxes[differ], strict=True))
    assert not pairs, f"{len(pairs)} of {len(boxes)} rays: {pairs[0][0]!r}, and without boxes {pairs[0][1]!r}"


def exact_depth(center, radius, x, y):
    """Depth at which the ray (x, y, −1) from the origin meets a sphere, of these very numbers; inf if it does not."""
    with mpmath.workdps(60):
        center, ray = [mpmath.mpf(c) for c in center], [mpmath.mpf(x), mpmath.mpf(y), mpmath.mpf(-1)]
        tangent = mpmath.fdot(center, center) - mpmath.mpf(radius) ** 2
        along, square = mpmath.fdot(center, ray), mpmath.fdot(ray, ray)
        discriminant = along * along - square * tangent
        met = tangent > 0 and along > 0 and discriminant >= 0
        return float(tangent / (along + mpmath.sqrt(discriminant))) if met else np.inf


def found_depth(center, radius, x, y, spheres, matrix=None, eye=(0.0, 0.0, 0.0)):
    placed = Object("object", "spheres", np.eye(4) if matrix is None else matrix)
    camera = Pinhole(eye, (eye[0], eye[1], eye[2] - 1), (0, 1, 0), 1, 1, 1)
    core = CoreScene(Scene(camera, {"spheres": spheres([center], radius)}, (placed,)), 1)
    return core.closest(core.rays([eye], [[x, y, -1.0]]))[0][0]


@settings(max_examples=150)
@given(seed=SEEDS, digits=st.integers(0, 16), side=st.sampled_from([-1, 1]))
def test_an_eye_by_the_last_bit_outside_or_inside_a_sphere_knows_it_and_its_depth_keeps_all_digits(
    make_spheres, seed, digits, side
):
    rng = np.random.default_rng(seed)
    center = rng.normal(size=3) * (1, 1, 0.5) - (0, 0, 1)
    radius = float(np.linalg.norm(center) * (1 - side * 10.0**-digits))
    x, y = rng.normal(size=2)
    exact, depth = exact_depth(center, radius, x, y), found_depth(center, radius, x, y, make_spheres)
    cosine = abs(center @ (x, y, -1)) / np.linalg.norm(center) / np.linalg.norm((x, y, 1))
    if cosine < 0.03 or (np.isinf(exact) and 10.0**-digits > cosine**2 / 4):
        return  # the ray grazes: of that, the next test
    assert np.isinf(exact) == np.isinf(depth), f"depth {depth} instead of {exact}"
    if np.isfinite(exact):
        # c·d loses 2⁻⁵³ |c| |d| with each term; the root of along² − tangent · square as much again, by what is left of along².
        allowed = 32 * FLOAT64 / min(cosine, 1 - min(2 * 10.0**-digits / cosine**2, 0.999))
        assert abs(depth / exact - 1) <= allowed, f"off by {abs(depth / exact - 1):.1e}, allowed {allowed:.1e}"


def test_an_eye_exactly_on_a_sphere_sees_nothing_of_it(make_spheres):
    assert found_depth((0.0, 3.0, -4.0), 5.0, 0.0, 0.75, make_spheres) == np.inf
    assert found_depth((0.0, 3.0, -4.0), np.nextafter(5.0, 6), 0.0, 0.75, make_spheres) == np.inf
    # From 5's last place outside, 2⁻⁵⁰, the ray (0, 3/4, −1) goes straight to the center.
    just_outside = found_depth((0.0, 3.0, -4.0), np.nextafter(5.0, 4), 0.0, 0.75, make_spheres)
    assert just_outside == pytest.approx(2.0**-50 * 0.8, rel=8 * FLOAT64)


@settings(max_examples=60)
@given(seed=SEEDS, digits=st.integers(0, 12))
@example(seed=0, digits=12)
def test_a_turned_ellipsoid_far_from_the_origin_is_as_exact_as_one_near_it(make_spheres, random_matrix, seed, digits):
    """Eye, center and matrix are exact float64 numbers; only their difference is small."""
    rng = np.random.default_rng(seed)
    matrix = random_matrix(rng)
    center = rng.normal(size=3) * 10.0**digits
    middle = matrix[:3, :3] @ center + matrix[:3, 3]
    eye = middle + np.array([0.5, -0.25, 8])
    aim = matrix[:3, :3] @ (rng.normal(size=3) * 0.4) + middle - eye
    x, y = aim[:2] / -aim[2]
    depth = found_depth(center, 1.0, x, y, make_spheres, matrix, tuple(eye.tolist()))
    with mpmath.workdps(60):
        away = mpmath.matrix(matrix[:3, :3].tolist()) * mpmath.matrix(center.tolist())
        away += mpmath.matrix(matrix[:3, 3].tolist()) - mpmath.matrix(eye.tolist())
        inverse = mpmath.matrix(matrix[:3, :3].tolist()) ** -1
        f, d = inverse * away, inverse * mpmath.matrix([mpmath.mpf(float(x)), mpmath.mpf(float(y)), -1])
        along, square, tangent = mpmath.fdot(f, d), mpmath.fdot(d, d), mpmath.fdot(f, f) - 1
        discriminant = along * along - square * tangent
        if discriminant < 0.01 * square:
            return  # it misses or grazes
        exact = float(tangent / (along + mpmath.sqrt(discriminant)))
    # As in the first test: the shape is rounded by the inverse, the foot of the perpendicular by 2⁻⁵³ |f|.
    allowed = 64 * FLOAT64 * np.linalg.cond(matrix[:3, :3]) * (1 + 1 / 0.1)
    assert abs(depth / exact - 1) <= allowed, f"off by {abs(depth / exact - 1):.1e}, allowed {allowed:.1e}"


@pytest.mark.parametrize("exponent", [-320, -300, -160, -130, -40, -12, 12, 16])
@pytest.mark.parametrize("by_matrix", [False, True])
def test_spheres_of_any_size_are_seen_or_left_out_without_a_warning(make_spheres, exponent, by_matrix):
    size = 10.0**exponent
    matrix = np.diag([size, size, size, 1.0]) if by_matrix else np.eye(4)
    center, radius = ((0, 0, -5), 1.0) if by_matrix else ((0, 0, -5 * size), size)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        depth = found_depth(center, radius, 0.0, 0.0, make_spheres, matrix)
    # Below 1e-100 squares, and determinants of matrices, leave float64.
    assert depth == pytest.approx(4 * size, rel=8 * FLOAT64) or (exponent < -100 and depth == np.inf)
