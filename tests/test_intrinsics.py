"""Blender's camera data to the view plane and back, for every fit, shape, aspect, shift, percentage and border."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon import rotation
from viewcam_addon.camera_values import FIELD_OF_VIEW, CameraValues, without_border
from viewcam_addon.errors import InputError
from viewcam_addon.intrinsics import FITS, CameraData, Frame, ViewPlane, camera_data, growth, view_plane

fits = st.sampled_from(["AUTO", "HORIZONTAL", "VERTICAL"])
fractions = st.tuples(st.floats(0, 0.4), st.floats(0, 0.4), st.floats(0.6, 1), st.floats(0.6, 1))
frames = st.builds(
    Frame,
    resolution_x=st.integers(16, 4000),
    resolution_y=st.integers(16, 4000),
    percentage=st.integers(25, 200),
    pixel_aspect_x=st.floats(1, 3),
    pixel_aspect_y=st.floats(1, 3),
    border=st.none() | fractions,
    crop=st.booleans(),
)
cameras = st.builds(
    CameraData,
    lens=st.floats(1, 5000),
    sensor_width=st.floats(1, 100),
    sensor_height=st.floats(1, 100),
    sensor_fit=fits,
    shift_x=st.floats(-2, 2),
    shift_y=st.floats(-2, 2),
)


@given(cameras, frames)
def test_camera_data_of_a_view_plane_gives_the_camera_back(camera, frame):
    plane = view_plane(camera, frame)
    back = camera_data(plane, frame, camera.sensor_width, camera.sensor_height, camera.sensor_fit)
    # Nine roundings each way; shift is a difference of pixels, so that their size over the fitted side counts.
    assert back.lens == pytest.approx(camera.lens, rel=9 * 2.0**-53)
    roundings = 9 * 2.0**-53 * 4000 * 2 / 16 * 3
    assert (back.shift_x, back.shift_y) == pytest.approx((camera.shift_x, camera.shift_y), abs=roundings)
    assert (back.sensor_width, back.sensor_height) == (camera.sensor_width, camera.sensor_height)


@given(cameras, frames, frames)
def test_the_distance_grows_with_the_picture_as_that_of_the_same_lens_does(camera, before, after):
    was, now = (view_plane(camera, replace(frame, percentage=100, crop=False)).distance[0] for frame in (before, after))
    # Each side a quotient and a product, or two.
    assert growth(camera.sensor_fit, before, after) == pytest.approx(now / was, rel=8 * 2.0**-53)
    assert growth(camera.sensor_fit, before, before) == 1


@given(st.floats(1e-3, 1e7), frames, fits)
def test_a_lens_below_one_millimeter_grows_the_sensor_and_keeps_the_distance(distance, frame, fit):
    width, height = frame.window[2:]
    plane = ViewPlane(
        (distance, distance * frame.pixel_aspect_x / frame.pixel_aspect_y), (width / 2, height / 2), width, height
    )
    camera = camera_data(plane, frame, 36, 24, fit)
    assert np.float32(camera.lens) >= 1 and camera.sensor_width >= 36
    assert camera.lens < 2 or camera.sensor_width == 36, "grown further than needed"
    assert camera.sensor_width / camera.sensor_height == 1.5
    assert view_plane(camera, frame).distance == pytest.approx(plane.distance, rel=9 * 2.0**-53)


@given(cameras, frames.filter(lambda frame: frame.border and frame.crop))
def test_a_window_of_a_picture_is_a_crop_of_it(camera, frame):
    whole = view_plane(
        camera, Frame(frame.resolution_x, frame.resolution_y, frame.percentage, frame.pixel_aspect_x, frame.pixel_aspect_y)
    )
    column, row, width, height = frame.window
    part = view_plane(camera, frame)
    assert (part.width, part.height, part.distance) == (width, height, whole.distance)
    assert part.principal_point == (whole.principal_point[0] - column, whole.principal_point[1] - row)


def test_blenders_default_camera_at_full_hd_has_the_distance_2666_and_two_thirds():
    plane = view_plane(CameraData(lens=50), Frame(1920, 1080))
    assert plane == ViewPlane((50 / 36 * 1920,) * 2, (960, 540), 1920, 1080)


@pytest.mark.parametrize(
    ("fit", "resolution", "expected"),
    [
        ("AUTO", (200, 100), 200 / 36),
        ("AUTO", (100, 200), 200 / 36),  # the long side, and still the sensor's width
        ("HORIZONTAL", (100, 200), 100 / 36),
        ("VERTICAL", (100, 200), 200 / 24),
        ("VERTICAL", (200, 100), 100 / 24),
    ],
)
def test_each_fit_takes_its_side_of_the_picture_and_of_the_sensor(fit, resolution, expected):
    plane = view_plane(CameraData(lens=50, sensor_fit=fit), Frame(*resolution))
    assert plane.distance == pytest.approx((50 * expected,) * 2, rel=4 * 2.0**-53)


def test_pixel_aspect_decides_which_side_auto_fits_and_divides_each_distance():
    plane = view_plane(CameraData(lens=36), Frame(100, 150, pixel_aspect_x=2))
    assert plane.distance == (100, 200)


def test_shift_moves_the_principal_point_against_it_by_the_fitted_side():
    plane = view_plane(CameraData(lens=50, shift_x=0.25, shift_y=-0.1), Frame(200, 100))
    assert plane.principal_point == (100 - 0.25 * 200, 50 + 0.1 * 200)


def test_odd_sizes_at_a_percentage_round_down_as_blender_does():
    assert Frame(1921, 1081, 33).size == (633, 356)
    assert Frame(101, 51, 50, border=(0.1, 0.2, 0.9, 0.8), crop=True).window == (5, 5, 40, 15)


@pytest.mark.parametrize(
    ("plane", "words"),
    [
        (ViewPlane((100, 100), (50, 50), 100, 100), ["100 × 100", "200 × 100", "resolution"]),
        (ViewPlane((100, 110), (100, 50), 200, 100), ["100", "110", "pixel aspect"]),
        (ViewPlane((1e-307, 1e-307), (100, 50), 200, 100), ["1e-307", "too small"]),
    ],
)
def test_a_view_plane_that_the_scene_can_not_render_is_refused_by_name(plane, words):
    with pytest.raises(InputError) as caught:
        camera_data(plane, Frame(200, 100), 36, 24, "AUTO")
    assert all(word in str(caught.value) for word in words), caught.value


def test_an_empty_border_is_refused():
    with pytest.raises(InputError, match="0 × "):
        view_plane(CameraData(50), Frame(200, 100, border=(0.5, 0, 0.501, 1), crop=True))


def test_an_extreme_wide_angle_needs_no_clamp():
    width = 640
    distance = width / 2 / math.tan(math.radians(179.9999 / 2))
    camera = camera_data(ViewPlane((distance,) * 2, (320, 180), width, 360), Frame(width, 360), 36, 24, "AUTO")
    assert camera.lens >= 1
    assert view_plane(camera, Frame(width, 360)).distance[0] == pytest.approx(distance, rel=9 * 2.0**-53)


# --- Rotation


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
    first, two, three = (
        rotation_about(angle, np.eye(3)["XYZ".index(axis)]) for axis, angle in zip(order, (0.3, 0.5, 0.7), strict=True)
    )
    given_angles = [0.0] * 3
    for axis, angle in zip(order, (0.3, 0.5, 0.7), strict=True):
        given_angles["XYZ".index(axis)] = angle
    np.testing.assert_allclose(rotation.from_euler(given_angles, order), three @ two @ first, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("order", ORDERS)
@given(given_angles=angles)
def test_euler_chooses_the_smaller_of_the_two_triples(order, given_angles):
    angles = rotation.euler(rotation.from_euler(given_angles, order), order)
    assert sum(map(abs, angles)) <= sum(map(abs, given_angles)) + 1e-6  # 1e-6: in gimbal lock one angle is free


@given(angle=st.floats(0, math.pi), direction=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda a: math.hypot(*a) > 1e-3))
def test_quaternion_and_axis_angle_are_those_of_the_rotation(angle, direction):
    axis = np.array(direction) / math.hypot(*direction)
    matrix = rotation_about(angle, axis)
    quaternion = rotation.quaternion(matrix)
    assert quaternion[0] >= 0
    assert abs(math.hypot(*quaternion) - 1) <= ROUNDING
    np.testing.assert_allclose(rotation.from_quaternion(quaternion), matrix, rtol=0, atol=ROUNDING)
    angles, *found_axis = rotation.axis_angle(matrix)
    np.testing.assert_allclose(rotation_about(angles, found_axis), matrix, rtol=0, atol=ROUNDING)


def test_no_rotation_turns_by_nothing_about_blenders_default_axis():
    assert rotation.axis_angle(np.eye(3)).tolist() == [0.0, 0.0, 1.0, 0.0]
    assert rotation.quaternion(np.eye(3)).tolist() == [1.0, 0.0, 0.0, 0.0]


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
    angles = rotation.numbers(matrix, mode, before)
    # A turn of 2⁻²⁶ about another axis, and an angle that begins elsewhere that close to gimbal lock: twice that, at most π.
    error = np.abs(rotation_of(angles, mode) - matrix).max()
    assert error <= math.pi * 2.0**-26 + ROUNDING * 8, f"{mode} {angles}: off by {error:.1e}"


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
    angles = rotation.numbers(rotation.from_euler(given_angles, order), order, given_angles)
    np.testing.assert_allclose(angles, given_angles, atol=1e-7)


def test_without_numbers_before_a_rotation_is_the_plainest():
    matrix = rotation_about(math.pi - 0.1, (0, 0, 1))
    assert (rotation.numbers(matrix, "QUATERNION") == rotation.quaternion(matrix)).all()
    assert (rotation.numbers(matrix, "AXIS_ANGLE") == rotation.axis_angle(matrix)).all()
    assert (rotation.numbers(matrix, "ZYX") == rotation.euler(matrix, "ZYX")).all()


@pytest.mark.parametrize("mode", MODES)
def test_numbers_of_many_rotations_are_those_of_each(mode):
    matrices = np.stack([rotation_about(0.1 + i, (0.48, -0.6, 0.64)) for i in range(20)] + [np.eye(3)])
    each = [rotation.numbers(matrix, mode) for matrix in matrices]
    # NumPy may round otherwise in arrays than with one number, by an ulp or two.
    np.testing.assert_allclose(rotation.numbers(matrices, mode), each, rtol=0, atol=ROUNDING)


VALUES = CameraValues((7.0, -6.0, 5.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1500.0)
HALF_ULP = 2.0**-53

value_frames = st.builds(
    Frame, st.integers(4, 8192), st.integers(4, 8192), st.integers(50, 200), st.floats(1, 200), st.floats(1, 200)
)
value_fits = st.sampled_from(FITS)
distances = st.floats(1e-3, 1e6)
zooms = st.floats(1e-3, 1e3)
keeps = st.sampled_from(["PIXELS", FIELD_OF_VIEW])


@given(distances, zooms, keeps, value_frames, value_frames, value_fits)
def test_what_is_stated_is_asked_for_whatever_zoom_and_resolution(distance, zoom, keeps, earlier, frame, fit):
    values = replace(VALUES, zoom=zoom, keeps=keeps, counted_in=without_border(earlier))
    message = values.stating((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), distance, frame, fit)
    assert (message.zoom, message.enabled, message.held_roll) == (zoom, True, 0.0)
    # Two quotients and two products, each rounded once.
    assert abs(message.distance_at_full_size(frame, fit) - distance) <= 4.5 * HALF_ULP * distance
    assert message.view_when_set == ((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@given(distances, keeps, value_frames, value_frames, value_fits)
def test_counting_the_distance_anew_changes_no_camera(distance, keeps, earlier, frame, fit):
    values = replace(VALUES, distance=distance, keeps=keeps, counted_in=without_border(earlier))
    counted = values.counted_anew(frame, fit)
    before, after = (each.distance_at_full_size(frame, fit) for each in (values, counted))
    assert after == before and counted.counted_in == without_border(frame)


@given(value_frames, value_frames, value_fits)
def test_a_kept_field_of_view_is_a_kept_lens(earlier, frame, fit):
    lens = CameraData(50.0, sensor_fit=fit)
    at_full_size = [replace(each, percentage=100) for each in (earlier, frame)]
    before, after = (view_plane(lens, each).distance[0] for each in at_full_size)
    values = replace(VALUES, distance=before, keeps=FIELD_OF_VIEW, counted_in=without_border(earlier))
    # lens / sensor · n / aspect on both sides: five roundings, and the quotient and product of the growth.
    assert values.distance_at_full_size(frame, fit) == pytest.approx(after, rel=16 * HALF_ULP)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"eye": (0.0, 0.0, 1.0)}, "same point"),
        ({"up": (0.0, 0.0, 0.0)}, "up is"),
        ({"eye": (math.nan, 0.0, 0.0)}, "eye is"),
        ({"distance": 0.0}, "before the eye"),
        ({"distance": -5.0}, "before the eye"),
        ({"zoom": 0.0}, "zoom is 0"),
        ({"zoom": math.nan}, "zoom is nan"),
    ],
)
def test_values_that_make_no_camera_can_be_held_and_are_refused_as_a_pinhole(wrong, sentence):
    values, frame = replace(VALUES, **wrong), Frame(1920, 1080)
    plane = view_plane(CameraData(50.0), frame)
    with pytest.raises(InputError, match=sentence):
        values.pinhole(plane, frame, "AUTO", mirrored=False)
