import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon import rotation

ORDERS = ["".join(order) for order in itertools.permutations("XYZ")]
angles = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)
# An angle of up to π stands 2⁻⁵² beside the real one; three of them, their sines and cosines, and two products of matrices.
ROUNDING = 40 * 2.0**-53


def rotation_about(angle, axis):
    """Rodrigues' formula: the oracle, which shares nothing with Euler angles or quaternions."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


@pytest.mark.parametrize("order", ORDERS)
@given(given_angles=angles)
def test_euler_angles_give_their_rotation_back(order, given_angles):
    matrix = rotation.from_euler(given_angles, order)
    error = np.abs(rotation.from_euler(rotation.euler(matrix, order), order) - matrix).max()
    assert error <= ROUNDING, f"{order} {given_angles}: off by {error:.1e}"


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("from_lock", [0.0, 1e-16, 1e-12, 1e-8, 1e-4])
@pytest.mark.parametrize("side", [-1, 1])
def test_euler_angles_are_right_in_gimbal_lock_and_next_to_it(order, from_lock, side):
    given_angles = [0.3, -1.1, 2.2]
    given_angles["XYZ".index(order[1])] = side * (math.pi / 2 - from_lock)
    matrix = rotation.from_euler(given_angles, order)
    error = np.abs(rotation.from_euler(rotation.euler(matrix, order), order) - matrix).max()
    assert error <= ROUNDING, f"off by {error:.1e}"


@pytest.mark.parametrize("order", ORDERS)
def test_euler_applies_the_axes_in_blenders_order(order):
    one, two, three = (
        rotation_about(angle, np.eye(3)["XYZ".index(axis)]) for axis, angle in zip(order, (0.3, 0.5, 0.7), strict=True)
    )
    given_angles = [0.0] * 3
    for axis, angle in zip(order, (0.3, 0.5, 0.7), strict=True):
        given_angles["XYZ".index(axis)] = angle
    np.testing.assert_allclose(rotation.from_euler(given_angles, order), three @ two @ one, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("order", ORDERS)
@given(given_angles=angles)
def test_euler_chooses_the_smaller_of_the_two_triples(order, given_angles):
    found = rotation.euler(rotation.from_euler(given_angles, order), order)
    assert sum(map(abs, found)) <= sum(map(abs, given_angles)) + 1e-6  # 1e-6: in gimbal lock one angle is free


@given(angle=st.floats(0, math.pi), direction=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda a: math.hypot(*a) > 1e-3))
def test_quaternion_and_axis_angle_are_those_of_the_rotation(angle, direction):
    axis = np.array(direction) / math.hypot(*direction)
    matrix = rotation_about(angle, axis)
    quaternion = rotation.quaternion(matrix)
    assert quaternion[0] >= 0
    assert abs(math.hypot(*quaternion) - 1) <= ROUNDING
    np.testing.assert_allclose(rotation.from_quaternion(quaternion), matrix, rtol=0, atol=ROUNDING)
    found, *found_axis = rotation.axis_angle(matrix)
    np.testing.assert_allclose(rotation_about(found, found_axis), matrix, rtol=0, atol=ROUNDING)


def test_no_rotation_turns_by_nothing_about_blenders_default_axis():
    assert rotation.axis_angle(np.eye(3)) == (0.0, 0.0, 1.0, 0.0)
    assert rotation.quaternion(np.eye(3)) == (1.0, 0.0, 0.0, 0.0)


def test_nearest_leaves_a_rotation_alone_and_keeps_a_mirroring():
    matrix = rotation_about(1.0, (0.6, 0.0, 0.8)) * [-1, 1, 1]
    np.testing.assert_allclose(rotation.nearest(matrix), matrix, rtol=0, atol=ROUNDING)


def test_skew_is_the_cosine_of_the_worst_pair_of_axes():
    assert rotation.skew(np.array([[1.0, 0.6, 0.0], [0.0, 0.8, 0.0], [0.0, 0.0, 5.0]])) == pytest.approx(0.6)


MODES = [*ORDERS, "QUATERNION", "AXIS_ANGLE"]


def rotation_of(numbers, mode):
    if mode == "QUATERNION":
        return rotation.from_quaternion(numbers)
    return rotation_about(numbers[0], numbers[1:]) if mode == "AXIS_ANGLE" else rotation.from_euler(numbers, mode)


@pytest.mark.parametrize("mode", MODES)
@given(given_angles=angles, angle=st.floats(-20, 20), axis=st.sampled_from([(1, 0, 0), (0, 0.6, -0.8), (0, 0, 1)]))
def test_numbers_near_others_give_the_same_rotation(mode, given_angles, angle, axis):
    matrix = rotation.from_euler(given_angles, "XYZ")
    before = (0.5, 0.5, -0.5, 0.5) if mode == "QUATERNION" else (angle, *axis) if mode == "AXIS_ANGLE" else (angle, 1, -9)
    found = rotation.numbers(matrix, mode, before)
    # A turn of 2⁻²⁶ about another axis, and an angle that begins elsewhere that close to gimbal lock: twice that, at most π.
    error = np.abs(rotation_of(found, mode) - matrix).max()
    assert error <= math.pi * 2.0**-26 + ROUNDING * 8, f"{mode} {found}: off by {error:.1e}"


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (0.48, -0.6, 0.64)])
def test_numbers_that_continue_others_never_jump(mode, axis):
    """Three turns about an axis, and through gimbal lock in the orders that have it there, a degree at a time."""
    tilt = rotation_about(0.4, (0.6, 0.8, 0))
    before = rotation.numbers(tilt, mode)
    for degree in range(1, 3 * 360):
        after = rotation.numbers(rotation_about(math.radians(degree), axis) @ tilt, mode, before)
        # Euler angles run as the cosine of the middle one gets small, and are within 0.03 of gimbal lock at the closest here.
        assert np.abs(np.subtract(after, before)).max() < math.radians(1) / 0.03, f"at {degree}°: {before} → {after}"
        before = after


@pytest.mark.parametrize("order", ORDERS)
def test_in_gimbal_lock_the_free_angle_stays_as_it_was(order):
    given_angles = [0.3, 0.3, 2.2]
    given_angles["XYZ".index(order[1])] = math.pi / 2
    found = rotation.numbers(rotation.from_euler(given_angles, order), order, given_angles)
    np.testing.assert_allclose(found, given_angles, atol=1e-7)


def test_without_numbers_before_a_rotation_is_the_plainest():
    matrix = rotation_about(math.pi - 0.1, (0, 0, 1))
    assert rotation.numbers(matrix, "QUATERNION") == rotation.quaternion(matrix)
    assert rotation.numbers(matrix, "AXIS_ANGLE") == rotation.axis_angle(matrix)
    assert rotation.numbers(matrix, "ZYX") == rotation.euler(matrix, "ZYX")
