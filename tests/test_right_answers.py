"""The right answers to hostile numbers: pinhole.py and intrinsics.py against the same formulas at 300 bits and more.

test_hostile_numbers.py sees that nothing breaks; here the figures are right, from the smallest float64 to the largest.
"""

import contextlib
import math
from fractions import Fraction

import mpmath
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from viewcam_addon import intrinsics
from viewcam_addon.errors import InputError
from viewcam_addon.intrinsics import CameraData, Frame
from viewcam_addon.pinhole import Pinhole

pytestmark = pytest.mark.usefixtures("no_warnings")

ROUNDING = 2.0**-53
LARGEST = 1.7976931348623157e308

any_floats = st.floats(allow_nan=False, allow_infinity=False)
finite_floats = (
    st.sampled_from((0.0, 5e-324, 1e-308, 1e-162, 1.0, 1e154, 1e308, -1e308, LARGEST, -LARGEST))
    | any_floats
    | st.floats(-1e4, 1e4)
)
positive_floats = finite_floats.map(abs).filter(bool)
triples = st.tuples(finite_floats, finite_floats, finite_floats)
pairs = st.tuples(finite_floats, finite_floats)
sizes = st.integers(1, 4096)
# Cameras of any size: what Pinhole takes, from one end of float64 to the other.
cameras = st.builds(
    lambda poses, up, *rest: Pinhole(*poses, up, *rest),
    st.tuples(triples, triples).filter(lambda poses: poses[0] != poses[1]),
    triples.filter(any),
    st.tuples(positive_floats, positive_floats),
    sizes,
    sizes,
    pairs | st.none(),
    st.booleans(),
)


def precise(vector):
    return [mpmath.mpf(float(x)) for x in vector]


def dot(a, b):
    return mpmath.fsum(x * y for x, y in zip(a, b, strict=True))


def is_near(have, true, error):
    """True if a float is the true number to within the error; infinite, where that is beyond float64's range."""
    if math.isinf(have):
        return abs(true) + error >= LARGEST and (have > 0) == (true > 0)
    return abs(mpmath.mpf(float(have)) - true) <= error + 5e-324


@given(cameras, finite_floats, finite_floats)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 5e-324, 64, 48), 1e308, -1e308)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), (5e-324, 1e308), 64, 48, (-1e308, 1e308)), 1e308, -1e308)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 5e-324, 64, 48, (0, 0)), 5e-324, -5e-324)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 1e308, 64, 48, (-1e308, 0)), 1e308, 0.0)
def test_rays_and_the_view_plane_are_right_for_every_distance_and_column(camera, column, row):
    with mpmath.workprec(300):
        x, y = (
            (mpmath.mpf(place) - center) / distance
            for place, center, distance in zip((column, row), camera.principal_point, camera.distance, strict=True)
        )
        assert is_near(camera.view_plane(column, row)[0], x, 2 * ROUNDING * abs(x))
        assert is_near(camera.view_plane([column], [row])[1][0], y, 2 * ROUNDING * abs(y))
        u, v, w = map(precise, camera.axes())
        across = -x if camera.mirrored else x
        length = mpmath.sqrt(x * x + y * y + 1)
        true = [(across * a + y * b - c) / length for a, b, c in zip(u, v, w, strict=True)]
        direction = camera.ray_directions(column, row, 0.0, 0.0)
        error = max(float(abs(a - b)) for a, b in zip(precise(direction), true, strict=True))
    # Two roundings of x and y, three products and two sums, the length's three, the division: 10 of a component.
    assert error <= 10 * ROUNDING


@given(cameras, triples)
@example(Pinhole((1e308, 0, 0), (0, 0, 0), (0, 0, 1), 500, 64, 48), (-1.7e308, 1e308, 5e-324))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 500, 64, 48), (5e-324, 5e-324, -5e-324))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 5e-324, 64, 48), (1e308, 5e-324, 1.0))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 1e308, 64, 48, (-1e308, 1e308)), (1.5, 1.0, -1.5))
@example(Pinhole((0, 0, 0), (1, 1, 1), (0, 0, 1), 500, 64, 48), (1.7e308, 1.7e308, 1.7e308))
def test_a_point_of_any_size_appears_where_exact_arithmetic_puts_it(camera, point):
    column, row, depth = camera.project(point)
    with mpmath.workprec(300):
        relative = [mpmath.mpf(a) - mpmath.mpf(b) for a, b in zip(point, camera.eye, strict=True)]
        size = max(map(abs, relative))
        u, v, w = map(precise, camera.axes())
        z = -dot(relative, w)
        # The difference and each product is rounded, and their two sums: 5 of the largest, thrice.
        rounded = 15 * ROUNDING * size
        assert is_near(depth, z, rounded)
        assert math.isnan(column) == math.isnan(row) == (not depth > 0)
        if not depth > 0 or z <= 4 * rounded or z < 2 * 5e-324:
            return  # too near the plane of the eye for figures
        x, y = dot(relative, u) * (-1 if camera.mirrored else 1), dot(relative, v)
        for have, across, center, distance in zip((column, row), (x, y), camera.principal_point, camera.distance, strict=True):
            moved = distance * across / z
            error = distance * rounded / z * (1 + abs(across) / z) * 2 + 6 * ROUNDING * (abs(moved) + abs(center))
            assert is_near(have, center + moved, error), f"{have} for {center + moved}"


@given(cameras)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 5e-324, 4096, 1, (0, 0)))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), (5e-324, 1e308), 1, 1, (1e308, -1e308)))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 1e308, 1, 1, (-1e308, 0.5)))
def test_the_field_of_view_is_right_from_nothing_to_half_a_turn(camera):
    (c_x, c_y), (d_x, d_y) = camera.principal_point, camera.distance
    with mpmath.workprec(4500):  # the angle between the corners may be 1e-600
        left, right = (mpmath.mpf(0) - c_x) / d_x, (mpmath.mpf(camera.width) - c_x) / d_x
        bottom, top = (mpmath.mpf(0) - c_y) / d_y, (mpmath.mpf(camera.height) - c_y) / d_y
        cosine = (left * right + bottom * top + 1) / mpmath.sqrt(
            (left * left + bottom * bottom + 1) * (right * right + top * top + 1)
        )
        true = (mpmath.atan(right) - mpmath.atan(left), mpmath.atan(top) - mpmath.atan(bottom), mpmath.acos(cosine))
        errors = [float(abs(mpmath.mpf(a) - b)) for a, b in zip(camera.field_of_view(), true, strict=True)]
    assert max(errors) <= 1e-15, errors


@given(cameras, positive_floats)
@example(Pinhole((1e308, 5e-324, 0), (1e308, 0, 0), (0, 0, 1), 500, 64, 48), 1e-300)
@example(Pinhole((1.7e308, -1.7e308, 1.7e308), (-1.7e308, 1.7e308, -1.7e308), (0, 0, 1), 500, 64, 48), 2.0**-24)
@example(Pinhole((0, 0, 1), (2, 0, 0), (5e-324, 0, 0), 5e-324, 1, 1), 5e-324)
def test_sine_and_roll_uncertainty_are_right_for_every_pose(camera, precision):
    with mpmath.workprec(4500):
        e, l, up = map(precise, (camera.eye, camera.look_at, camera.up))
        view = [a - b for a, b in zip(e, l, strict=True)]
        across = [up[1] * view[2] - up[2] * view[1], up[2] * view[0] - up[0] * view[2], up[0] * view[1] - up[1] * view[0]]
        lengths = [mpmath.sqrt(dot(vector, vector)) for vector in (across, up, view, e, l)]
        sine = lengths[0] / (lengths[1] * lengths[2])
        assert is_near(camera.sine_to_up, sine, 10 * ROUNDING * sine)
        if sine < 1e-300:
            return
        roll = min(mpmath.pi, precision * ((lengths[3] + lengths[4]) / lengths[2] + 1) / sine)
        # The roll that precision has turned is rounded to whole multiples of 5e-324 where it is that small, and then divided by
        # sine.
        assert is_near(camera.roll_uncertainty(precision), roll, 30 * ROUNDING * roll + 5e-324 / sine)
    assert camera.roll_uncertainty(0.0) == 0


@given(cameras, st.integers(1, 2**31 - 1), st.integers(1, 2**31 - 1), finite_floats)
def test_resized_and_cropped_cameras_are_right_or_refused(camera, width, height, column):
    with contextlib.suppress(InputError):  # a number too large or too small
        resized = camera.resized(width, height)
        for name in ("distance", "principal_point"):
            for have, before, new, old in zip(
                getattr(resized, name), getattr(camera, name), (width, height), (camera.width, camera.height), strict=True
            ):
                assert is_near_fraction(have, Fraction(before) * new / old), f"{name}: {before} became {have}"
    with contextlib.suppress(InputError):
        assert camera.cropped(column, 0, width, height).principal_point[0] == camera.principal_point[0] - column


def is_near_fraction(have, true, roundings=4):
    return abs(Fraction(have) - true) <= abs(true) * Fraction(roundings * ROUNDING) + Fraction(5e-324)


float32_floats = positive_floats.map(lambda x: min(max(x, 2.0**-149), 3.4028234663852886e38))
blender_cameras = st.builds(
    CameraData,
    *[float32_floats] * 3,
    st.sampled_from(intrinsics.FITS),
    *[st.one_of(st.just(0.0), float32_floats, float32_floats.map(lambda x: -x))] * 2,
)
blender_frames = st.builds(Frame, sizes, sizes, st.integers(25, 200), float32_floats, float32_floats)


@given(blender_cameras, blender_frames)
def test_the_view_plane_of_every_camera_that_blender_can_store_is_right(camera, frame):
    assume(min(frame.size) >= 1)
    plane = intrinsics.view_plane(camera, frame)
    width, height = frame.size
    a_x, a_y = Fraction(frame.pixel_aspect_x), Fraction(frame.pixel_aspect_y)
    sides = {"HORIZONTAL": width * a_x, "VERTICAL": height * a_y, "AUTO": max(width * a_x, height * a_y)}
    sensor = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
    for axis, aspect in enumerate((a_x, a_y)):
        fitted = sides[camera.sensor_fit] / aspect
        assert is_near_fraction(plane.distance[axis], Fraction(camera.lens) / Fraction(sensor) * fitted)
        moved = Fraction((camera.shift_x, camera.shift_y)[axis]) * fitted
        half = Fraction(frame.size[axis], 2)
        error = 5 * Fraction(ROUNDING) * (abs(moved) + half)
        assert abs(Fraction(plane.principal_point[axis]) - (half - moved)) <= error
    with contextlib.suppress(InputError):  # a lens of 1 mm or more that Blender can't hold with this sensor
        back = intrinsics.camera_data(plane, frame, camera.sensor_width, camera.sensor_height, camera.sensor_fit)
        sensor_back = back.sensor_height if camera.sensor_fit == "VERTICAL" else back.sensor_width
        assert is_near_fraction(back.lens / sensor_back, Fraction(camera.lens) / Fraction(sensor), 10)
