"""The text's camera: its basis against exact arithmetic, its rays against its projection, its errors one by one.

Rounding errors that are kept: every claim of exact.py against rational arithmetic.
"""

import dataclasses
import math
import warnings
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from viewcam_addon import exact, pinhole
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole, basis, canonical_axes

# The rounding of a unit vector's component: ¾ unit roundoff from e − l or the product, one each from the root and the division,
# 2.8 · 2⁻⁵³.
BASIS_TOLERANCE = 4e-16

coordinates = st.floats(-1e6, 1e6)
points = st.tuples(coordinates, coordinates, coordinates)
any_float = st.floats(allow_nan=False, allow_infinity=False)
any_points = st.tuples(any_float, any_float, any_float)


def exact_basis(e, l, up):
    """(u, v, w) at 4500 bits: more than two products of float64 numbers of any size can need."""
    with mpmath.workprec(4500):
        apart = [mpmath.mpf(a) - mpmath.mpf(b) for a, b in zip(e, l, strict=True)]
        w = normalized(apart)
        u = normalized(cross([mpmath.mpf(a) for a in up], apart))
        return u, cross(w, u), w


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def normalized(a):
    length = mpmath.sqrt(sum(x * x for x in a))
    return [x / length for x in a]


def basis_error(axes, pose):
    with mpmath.workprec(4500):
        return max(
            float(abs(mpmath.mpf(float(have)) - want))
            for axis, true in zip(axes, exact_basis(*pose), strict=True)
            for have, want in zip(axis, true, strict=True)
        )


def poses_near_vertical(count, angles, seed=0):
    """e, l and up, (count, 3) each: up deviates from ±(e − l) by the given angles and by its own rounding, at random scales."""
    random = np.random.default_rng(seed)
    eye = random.normal(size=(count, 3)) * 10 ** random.uniform(-3, 3, (count, 1))
    look_at = eye + random.normal(size=(count, 3)) * 10 ** random.uniform(-3, 3, (count, 1))
    view = (eye - look_at) * random.choice([-1, 1], (count, 1))
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    aside = np.cross(view, random.normal(size=(count, 3)))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    up = np.cos(angles)[:, None] * view + np.sin(angles)[:, None] * aside
    return eye, look_at, up * 10 ** random.uniform(-6, 6, (count, 1))


def test_basis_is_exact_over_10_000_poses_from_1_to_1e_16_radians_from_vertical():
    angles = 10 ** np.random.default_rng(1).uniform(-16, 0, 10_000)
    e, l, up = poses_near_vertical(10_000, angles)
    axes = np.stack(basis(e, l, up), axis=1)
    errors = []
    with mpmath.workprec(600):  # float64 differences and products of these scales need no more than 400 bits
        for i in range(len(e)):
            apart = [mpmath.mpf(a) - mpmath.mpf(b) for a, b in zip(e[i].tolist(), l[i].tolist(), strict=True)]
            across = cross([mpmath.mpf(a) for a in up[i].tolist()], apart)
            assert any(across), f"pose {i} came out exactly singular: the sweep must not hold such a one"
            u, w = normalized(across), normalized(apart)
            true = [*u, *cross(w, u), *w]
            errors.append(
                max(abs(float(mpmath.mpf(have) - want)) for have, want in zip(axes[i].ravel().tolist(), true, strict=True))
            )
    sines = np.array([Pinhole(*pose, 500, 64, 48).sine_to_up for pose in zip(e, l, up, strict=True)])
    assert sines.min() < 1e-16 and sines.max() > 0.8, "the sweep must reach from one end to the other"
    worst = int(np.argmax(errors))
    assert errors[worst] <= BASIS_TOLERANCE, (
        f"error {errors[worst]:.3g} at sin θ = {sines[worst]:.3g}: {e[worst]}, {l[worst]}, {up[worst]}"
    )


@given(points, points, st.tuples(*[st.floats(-1, 1)] * 3), st.integers(-16, 0), points)
def test_basis_keeps_its_roll_down_to_1e_16_radians_from_vertical(eye, up, direction, exponent, aside):
    look_at = tuple(a + b + 10.0**exponent * c for a, b, c in zip(eye, up, aside, strict=True))
    assume(eye != look_at and any(up))
    camera = Pinhole(eye, look_at, up, 500, 64, 48)
    assume(not camera.is_singular)
    error = basis_error(camera.axes(), (eye, look_at, up))
    assert error <= BASIS_TOLERANCE, f"error {error:.3g} at sin θ = {camera.sine_to_up:.3g}"


@given(any_points, any_points, any_points)
@example((1e308, 0.0, 0.0), (-1e308, 5e-324, 0.0), (1.0, 0.0, 0.0))
@example((1.0, 1e-300, 0.0), (0.0, 0.0, 0.0), (1e300, 1.0, 1e-320))
@example((5e-324, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
@example((1.7e308, 1.0, 0.0), (1.7e308, 0.0, 5e-324), (0.0, 1.0, 0.0))
@example((1.7e308, 1.7e308, 0.0), (-1.7e308, -1.7e308, 0.0), (1.0, 1.0, 1.0))
def test_basis_neither_over_nor_underflows_at_any_scale(eye, look_at, up):
    assume(eye != look_at and any(up))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        camera = Pinhole(eye, look_at, up, 500, 64, 48)
        axes = np.array(camera.axes())
        many = np.array(basis(np.array([eye]), np.array([look_at]), np.array([up])))[:, 0]
    assert np.array_equal(axes, many)
    if not camera.is_singular:
        error = basis_error(camera.axes(), (eye, look_at, up))
        assert error <= BASIS_TOLERANCE, f"error {error:.3g}"


def poses_apart(random, exponents):
    """e, l and up, (n, 3) each: e − l is about 2^exponent long, up of any length; their components of like or mixed scales."""

    def vectors(exponents):
        mixed = random.integers(0, 2, (len(exponents), 1)) * random.integers(-300, 1, (len(exponents), 3))
        return np.ldexp(random.uniform(-1, 1, (len(exponents), 3)), (exponents[:, None] + mixed).astype(np.int32))

    apart, up = vectors(exponents), vectors(random.integers(-1074, 1024, len(exponents)))
    near_up = random.integers(0, 3, (len(exponents), 1)) == 0  # a third of the views is close to up
    moved = np.where(exponents > 0, -1000, 1000)[:, None].astype(np.int32)
    up = np.where(near_up, np.ldexp(apart * random.uniform(1, 1 + 1e-12, apart.shape), moved), up)
    halved = random.integers(0, 2, (len(exponents), 1)) == 1
    eye = np.where(halved, apart / 2, apart)
    look_at = np.where(halved, -apart / 2, random.choice([0.0, 5e-324], apart.shape))
    good = (eye != look_at).any(axis=1) & up.any(axis=1)
    return eye[good], look_at[good], up[good]


def test_basis_is_exact_from_the_smallest_difference_of_eye_and_look_at_to_the_largest():
    e, l, up = poses_apart(np.random.default_rng(7), np.linspace(-1073, 1024, 1500).astype(int))
    axes = np.stack(basis(e, l, up), axis=1)
    count = 0
    for i, pose in enumerate(zip(e.tolist(), l.tolist(), up.tolist(), strict=True)):
        camera = Pinhole(*pose, 500, 64, 48)
        assert np.array_equal(camera.axes(), axes[i]), f"one and many differ: {pose}"
        if not camera.is_singular:
            error, count = basis_error(camera.axes(), pose), count + 1
            assert error <= BASIS_TOLERANCE, f"error {error:.3g}: {pose}"
    assert count > 1300
    largest = np.maximum(np.abs(e), np.abs(l)).max(axis=1)
    assert largest.min() < 1e-320 and largest.max() > 1e307, "the sweep must reach from one end to the other"


@given(st.lists(st.tuples(points, points, points), min_size=1, max_size=5))
def test_many_poses_at_once_give_the_axes_of_each_alone(poses):
    poses = [pose for pose in poses if pose[0] != pose[1] and any(pose[2])]
    assume(poses)
    together = basis(*(np.array(vectors).reshape(1, -1, 3) for vectors in zip(*poses, strict=True)))
    for i, (eye, look_at, up) in enumerate(poses):
        alone = Pinhole(eye, look_at, up, 500, 64, 48).basis()
        assert all(np.array_equal(a[0, i], b) for a, b in zip(together, alone, strict=True)), f"pose {i} differs"


@pytest.mark.parametrize("count", [6, 7, 8, 20, 21])
def test_how_many_poses_are_computed_at_a_time_changes_no_bit(monkeypatch, count):
    """With poses at both sides of every border that take the way of singular ones."""
    rng = np.random.default_rng(count)
    eye, look_at, up = rng.normal(size=(3, count, 3))
    for border in range(0, count, 7):
        for i in (border - 1, border):
            up[i] = eye[i] - look_at[i]
    whole = np.array(basis(eye, look_at, up))
    monkeypatch.setattr(pinhole, "_AT_ONCE", 7)
    assert np.array_equal(whole, basis(eye, look_at, up))


@pytest.mark.parametrize(
    ("up", "looks", "axes"),
    [
        ((0, 1, 0), "down", ((0, 0, 1), (1, 0, 0), (0, 1, 0))),
        ((0, 1, 0), "up", ((1, 0, 0), (0, 0, 1), (0, -1, 0))),
        ((0, 0, 1), "down", ((0, -1, 0), (1, 0, 0), (0, 0, 1))),
        ((0, 0, 1), "up", ((1, 0, 0), (0, -1, 0), (0, 0, -1))),
    ],
)
def test_singular_views_take_the_canonical_axes_of_the_text_and_of_blender(up, looks, axes):
    side = 7.5 if looks == "down" else -7.5
    eye = tuple(0.1 + side * x for x in up)
    look_at = (0.1, 0.1, 0.1)
    camera = Pinhole(eye, look_at, tuple(3 * x for x in up), 500, 64, 48)
    assert camera.is_singular
    assert camera.axes() == axes
    assert np.array_equal(np.array(basis([eye], [look_at], [up]))[:, 0], axes)


@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(any), st.booleans())
def test_canonical_axes_of_any_up_are_right_handed_and_along_it(up, looking_down):
    u, v, w = (np.array(axis) for axis in canonical_axes(up, looking_down))
    matrix = np.stack([u, v, w])
    # Each component is a few products of rounded unit components: 8 units of 2⁻⁵³.
    assert np.abs(matrix @ matrix.T - np.eye(3)).max() < 8 * 2.0**-53
    assert np.abs(np.cross(u, v) - w).max() < 8 * 2.0**-53
    (up,) = np.array(exact.scaled_to_one(up))
    assert np.abs(np.cross(w, up)).max() < 8 * 2.0**-53
    assert (w @ up > 0) == looking_down


@given(points, points, points, st.floats(10, 1e4), st.floats(10, 1e4), st.booleans(), st.data())
def test_projecting_a_point_of_a_ray_gives_back_its_pixel(eye, look_at, up, d_x, d_y, mirrored, data):
    assume(math.dist(eye, look_at) > 1e-3 and any(up))
    camera = Pinhole(eye, look_at, up, (d_x, d_y), 640, 360, (data.draw(st.floats(-100, 700)), 180), mirrored)
    column, row = data.draw(st.integers(0, 639)), data.draw(st.integers(0, 359))
    px, py = data.draw(st.floats(0, 0.999)), data.draw(st.floats(0, 0.999))
    direction = camera.ray_directions(column, row, px, py)
    # Basis 4e-16 and sums 2 · 2⁻⁵³ off, the length by 2 and its division by 1: below 10 · 2⁻⁵³.
    assert abs(np.linalg.norm(direction) - 1) < 10 * 2.0**-53
    far = 10 * max(1.0, *map(abs, eye))
    at_column, at_row, depth = camera.project(np.array(eye) + far * direction)
    # The point is rounded to 2⁻⁵³ (|e| + far) ≤ 2.8 · 2⁻⁵³ far, at the depth far / s; both, divided, move the picture by s² d
    # of that.
    s = math.hypot(1, (column + px - camera.principal_point[0]) / d_x, (row + py - 180) / d_y)
    tolerance = 16 * 2.0**-53 * (700 + max(d_x, d_y) * s * s)
    assert abs(at_column - column - px) < tolerance and abs(at_row - row - py) < tolerance
    assert depth > 0


def test_the_center_ray_runs_along_the_view_and_columns_and_rows_run_right_and_up():
    camera = Pinhole((3, 0, 0), (0, 0, 0), (0, 0, 1), 100, 4, 2)
    u, v, w = camera.basis()
    assert np.array_equal(camera.ray_directions(2, 1, 0, 0), -w)
    assert camera.ray_directions(3, 1) @ u > 0 > camera.ray_directions(0, 1) @ u
    assert camera.ray_directions(2, 1) @ v > 0 > camera.ray_directions(2, 0) @ v
    first = camera.ray_directions(0, 0)
    expected = (-1.5 * u - 0.5 * v - 100 * w) / math.sqrt(1.5**2 + 0.5**2 + 100**2)
    assert np.abs(first - expected).max() < 4 * 2.0**-53


def test_a_mirrored_camera_shows_every_ray_at_the_other_side():
    camera = Pinhole((3, 1, 2), (0, 0, 0), (0, 0, 1), 100, 40, 20)
    mirror = dataclasses.replace(camera, mirrored=True)
    columns, rows = np.arange(40), np.arange(20)[:, None]
    assert np.array_equal(mirror.ray_directions(columns, rows), camera.ray_directions(columns[::-1], rows))


def test_what_lies_behind_the_eye_has_no_picture():
    camera = Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 100, 40, 20)
    column, row, depth = camera.project([[0, -1, 0], [0, 0, 0], [0, 2, 0]])
    assert np.array_equal(depth, [-1, 0, 2])
    assert np.isnan(column[:2]).all() and np.isnan(row[:2]).all()
    assert (column[2], row[2]) == (20, 10)


def test_field_of_view_is_that_of_the_edges_and_corners():
    camera = Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 100, 200, 100 * 2)
    horizontal, vertical, diagonal = (math.degrees(angle) for angle in camera.field_of_view())
    assert horizontal == pytest.approx(90, abs=1e-13) and vertical == pytest.approx(90, abs=1e-13)
    assert diagonal == pytest.approx(math.degrees(2 * math.atan(math.sqrt(2))), abs=1e-13)


@given(st.integers(1, 400), st.integers(1, 300), st.integers(0, 100), st.integers(0, 100))
def test_cropping_and_resizing_keep_what_each_pixel_sees(width, height, column, row):
    camera = Pinhole((3, 1, 2), (0, 0, 0), (0, 0, 1), (300, 200), 640, 480, (300, 250))
    part = camera.cropped(column, row, width, height)
    assert np.abs(part.ray_directions(0, 0) - camera.ray_directions(column, row)).max() < 8 * 2.0**-53
    double = camera.resized(1280, 960)
    assert (
        np.abs(double.ray_directions(column, row, 0, 0) - camera.ray_directions(column / 2, row / 2, 0, 0)).max() < 8 * 2.0**-53
    )


def test_roll_uncertainty_is_the_rounding_of_the_inputs_over_the_sine():
    camera = Pinhole((1e-3, 0, 10), (0, 0, 0), (0, 0, 1), 500, 64, 48)
    assert camera.sine_to_up == pytest.approx(1e-4, rel=1e-7)
    assert camera.roll_uncertainty() == pytest.approx(2 * 2.0**-24 / 1e-4, rel=1e-3)
    assert Pinhole((0, 0, 10), (0, 0, 0), (0, 0, 1), 500, 64, 48).roll_uncertainty() == math.pi


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"look_at": (1, 2, 3)}, ["eye", "look_at", "same point"]),
        ({"up": (0, 0, 0)}, ["up", "(0, 0, 0)"]),
        ({"eye": (1, math.nan, 0)}, ["eye", "finite"]),
        ({"up": (0, 0, math.inf)}, ["up", "finite"]),
        ({"distance": 0}, ["distance", "0"]),
        ({"distance": (500, -1)}, ["distance", "-1"]),
        ({"distance": math.nan}, ["distance", "finite"]),
        ({"width": 0}, ["width", "0"]),
        ({"height": 2.5}, ["height", "2.5"]),
        ({"eye": (1, 2)}, ["eye", "3 numbers"]),
        ({"eye": "abc"}, ["eye", "3 numbers"]),
        ({"principal_point": (math.inf, 0)}, ["principal_point", "finite"]),
    ],
)
def test_bad_input_is_refused_in_one_sentence_that_names_it(changes, words):
    good = {"eye": (1, 2, 3), "look_at": (0, 0, 0), "up": (0, 0, 1), "distance": 500, "width": 64, "height": 48}
    with pytest.raises(InputError) as caught:
        Pinhole(**good | changes)
    message = str(caught.value)
    assert all(word in message for word in words) and "\n" not in message, message


def test_of_many_poses_the_bad_one_is_named():
    eyes = np.array([[1.0, 0, 0], [0, 0, 0], [2, 0, 0]])
    with pytest.raises(InputError, match="pose 1: eye and look_at"):
        basis(eyes, (0, 0, 0), (0, 0, 1))
    with pytest.raises(InputError, match="pose 2: up"):
        basis(eyes + 1, (0, 0, 0), np.array([[0, 0, 1], [0, 1, 0], [0, 0, 0]]))


def test_a_pinhole_is_immutable():
    camera = Pinhole((1, 2, 3), (0, 0, 0), (0, 0, 1), 500, 64, 48)
    with pytest.raises(dataclasses.FrozenInstanceError):
        camera.eye = (0, 0, 0)
    with pytest.raises(ValueError, match="read-only"):
        camera.basis()[0][0] = 1
    assert hash(camera) == hash(dataclasses.replace(camera))


# Products of two of these neither overflow nor lose their error term.
factors = st.one_of(st.just(0.0), *(st.floats(*sorted((s * 2.0**-400, s * 2.0**400))) for s in (1, -1)))
vectors = st.tuples(factors, factors, factors)


@given(factors, factors)
def test_two_sum_and_its_error_are_the_exact_sum(a, b):
    total, error = exact.two_sum(a, b)
    assert Fraction(total) + Fraction(error) == Fraction(a) + Fraction(b)


@given(factors, factors)
def test_two_product_and_its_error_are_the_exact_product(a, b):
    product, error = exact.two_product(a, b)
    assert Fraction(product) + Fraction(error) == Fraction(a) * Fraction(b)


@given(st.lists(factors, min_size=4, max_size=8))
def test_a_sum_of_floats_and_of_arrays_is_rounded_once(terms):
    true = sum(map(Fraction, terms))
    high, low, _ = exact.sum_terms(terms)
    assert high == float(true)
    assert abs(Fraction(high) + Fraction(low) - true) <= abs(Fraction(low)) * Fraction(2) ** -53

    *pair, settled = exact.sum_terms([np.array([term]) for term in terms])
    assert not settled or pair == [high, low], "where arrays say that they have settled, they give the bits of floats"
    assert abs(Fraction(float(pair[0][0])) - true) <= Fraction(float(np.spacing(abs(high)))), "off by more than a step"


def test_a_sum_halfway_between_two_floats_that_a_third_part_decides_is_not_called_settled():
    tie = [np.array([term]) for term in (1.0, 2.0**-53, 2.0**-120, 0.0)]
    *pair, settled = exact.sum_terms(tie)
    assert exact.sum_terms([float(term[0]) for term in tie])[0] == 1 + 2.0**-52 != pair[0], "pairs round it to even"
    assert not settled
    assert exact.sum_terms([*tie[:2], tie[3], tie[3]])[2], "without the third part even is right"


sizes = st.floats(allow_nan=False, allow_infinity=False)


@given(sizes, sizes, sizes.filter(lambda divisor: divisor > 0))
@example(1.7e308, -1.7e308, 5e-324)
@example(5e-324, 0.0, 5e-324)
@example(5e-324, -5e-324, 1.7e308)
def test_a_quotient_of_any_size_has_two_roundings_and_the_same_bits_as_an_array(a, b, divisor):
    fraction, exponent = exact.quotient(a, b, divisor)
    true = (Fraction(a) - Fraction(b)) / Fraction(divisor)
    assert abs(fraction) < 2
    # Quartering, where one of the two is huge, takes at most the last bits of one that is tiny beside it.
    assert abs(Fraction(fraction) * Fraction(2) ** exponent - true) <= abs(true) * Fraction(2) ** -52
    many = exact.quotient(np.array([a]), b, divisor)
    assert (fraction, exponent) == (many[0][0], many[1][0])


@given(st.lists(st.tuples(st.floats(-2, 2), st.integers(-5000, 5000)), min_size=1, max_size=4))
def test_numbers_of_one_scale_keep_their_ratios_and_the_largest_is_about_1(numbers):
    if not any(fraction for fraction, _ in numbers):
        return
    scaled = exact.of_one_scale(*numbers)
    arrays = exact.of_one_scale(*((np.array(fraction), np.array(exponent)) for fraction, exponent in numbers))
    assert scaled == arrays
    assert max(map(abs, scaled)) <= 2
    largest = max(exponent for fraction, exponent in numbers if fraction)
    for (fraction, exponent), have in zip(numbers, scaled, strict=True):
        assert abs(Fraction(have) - Fraction(fraction) * Fraction(2) ** (exponent - largest)) <= Fraction(2) ** -1075


@given(vectors, vectors, vectors)
def test_cross_of_a_difference_is_right_to_its_last_bit_whatever_cancels(a, b, c):
    (a,), (high, low) = exact.scaled_to_one(a), exact.scaled_to_one(*exact.difference(b, c))
    if not (exact.are_factors(a, a) and exact.are_factors(high, high) and exact.are_factors(low, low)):
        return
    apart = [Fraction(x) + Fraction(y) for x, y in zip(high, low, strict=True)]
    rounded, _, _ = exact.cross(a, high, low)
    for component, j, k in zip(rounded, (1, 2, 0), (2, 0, 1), strict=True):
        assert component == float(Fraction(a[j]) * apart[k] - Fraction(a[k]) * apart[j])


@given(vectors.filter(any))
def test_length_is_within_one_unit_in_the_last_place(vector):
    (scaled,) = exact.scaled_to_one(vector)
    squared = sum(Fraction(component) ** 2 for component in scaled)
    length = exact.length(scaled)
    # From sqrt's half unit and the sum's half unit, which sqrt halves.
    assert abs(Fraction(length) ** 2 / squared - 1) <= 3 * Fraction(2) ** -53


def test_what_is_too_small_beside_the_rest_is_no_factor():
    assert exact.are_factors((1.0, 0.0, 2.0**-400), (1.0, 0.0, 2.0**-400))
    assert not exact.are_factors((1.0, 0.0, 2.0**-401), (1.0, 0.0, 2.0**-401))
    assert not exact.are_factors((1.0, 0.0, 5e-324), (2.0**-100, 0.0, 0.0)), "lost by scaling"
