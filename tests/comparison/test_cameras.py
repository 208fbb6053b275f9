"""Two cameras against each other, without a picture."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.comparison.cameras import conversion_error, systematic_error
from viewcam_addon.comparison.tolerances import PERCENTILES, ROUNDINGS
from viewcam_addon.pinhole import Pinhole

STATED = Pinhole((5.0, -7.0, 4.0), (0.0, 0.0, 0.5), (0.0, 0.0, 1.0), 1200.0, 1920, 1080)


def as_blender_stores_it(pinhole):
    """The camera with its axes, eye and distance rounded to float32."""
    _, v, w = (axis.astype(np.float32).astype(np.float64) for axis in pinhole.basis())
    eye = np.float32(pinhole.eye).astype(np.float64)
    return replace(
        pinhole,
        eye=tuple(eye),
        look_at=tuple(eye - w),
        up=tuple(v),
        distance=tuple(float(np.float32(d)) for d in pinhole.distance),
    )


def test_equal_cameras_have_no_error():
    error = conversion_error(STATED, STATED, [1.0, 10.0])
    assert error.largest < 1e-9 and error.ok


@given(
    eye=st.tuples(*[st.floats(-1000, 1000)] * 3),
    direction=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.hypot(v[0], v[1]) > 0.01),
    distance=st.floats(100, 50_000),
)
def test_a_camera_stored_in_float32_is_within_tolerance(eye, direction, distance):
    look_at = tuple(np.add(eye, 5 * np.array(direction)))
    stated = Pinhole(eye, look_at, (0.0, 0.0, 1.0), distance, 1920, 1080)
    error = conversion_error(stated, as_blender_stores_it(stated), [0.5, 10.0, 1000.0])
    assert error.ok, error


@pytest.mark.parametrize(
    "fault",
    [
        {"distance": 1200.0 * (1 + 1e-5)},
        {"principal_point": (960.01, 540.0)},
        {"eye": (5.0001, -7.0, 4.0)},
        {"look_at": (0.0, 1e-4, 0.5)},
        {"up": (1e-4, 0.0, 1.0)},
        {"mirrored": True},
        {"look_at": (10.0, -14.0, 7.5)},
    ],
)
def test_a_camera_that_is_elsewhere_is_found(fault):
    error = conversion_error(STATED, replace(STATED, **fault), [5.0, 10.0])
    assert not error.ok, f"{fault} went unnoticed: {error}"


def test_a_displaced_eye_shows_at_the_nearest_depth():
    """0.01 to the right at the depth 2 and d = 1200 is 6 px, at the depth 20 a tenth of it."""
    u, _, _ = STATED.basis()
    moved = replace(STATED, eye=tuple(STATED.eye + 0.01 * u), look_at=tuple(STATED.look_at + 0.01 * u))
    assert conversion_error(STATED, moved, [2.0, 20.0]).largest == pytest.approx(6.0, rel=1e-6)
    assert conversion_error(STATED, moved, [20.0]).largest == pytest.approx(0.6, rel=1e-6)


def test_shift_zoom_and_roll_are_told_apart():
    pixels = np.arange(0, STATED.width * STATED.height, 997)
    x, y = pixels % STATED.width + 0.5 - 960, pixels // STATED.width + 0.5 - 540
    off_x, off_y = 0.25 + 1e-3 * x - 2e-4 * y, -0.5 + 1e-3 * y + 2e-4 * x
    actual = systematic_error(STATED, pixels, off_x, off_y, np.full(len(x), 1e-4))
    assert (actual.shift_x, actual.shift_y) == pytest.approx((0.25, -0.5))
    assert (actual.zoom_x, actual.zoom_y) == pytest.approx((1e-3, 1e-3))
    assert actual.roll == pytest.approx(2e-4, rel=2e-3)  # arctan of 2e-4 / 1.001
    assert not actual.ok


def test_errors_that_their_percentiles_allow_may_all_go_one_way_and_larger_ones_may_not():
    pixels = np.arange(0, STATED.width * STATED.height, 997)
    one_rounding, still = np.full(len(pixels), 1e-2), np.zeros(len(pixels))
    largest = np.interp(np.linspace(0.0, 100.0, len(pixels)), (0.0, *PERCENTILES), (0.0, *ROUNDINGS)) * one_rounding
    assert systematic_error(STATED, pixels, largest, still, one_rounding).ok
    of_bands = np.array(ROUNDINGS)[np.searchsorted(PERCENTILES, np.linspace(0.0, 100.0, len(pixels)))] * one_rounding
    assert systematic_error(STATED, pixels, still, 0.99 * of_bands, one_rounding).ok
    assert not systematic_error(STATED, pixels, still, 1.01 * of_bands, one_rounding).ok


def test_what_all_share_is_not_hidden_by_a_few_uncertain_pixels():
    pixels = np.arange(0, STATED.width * STATED.height, 997)
    certain = np.arange(len(pixels)) % 10 > 0
    one_rounding = np.where(certain, 1e-4, 1.0)
    shared = np.full(len(pixels), 1e-2)
    assert not systematic_error(STATED, pixels, np.where(certain, shared, 0.5), shared * 0, one_rounding).ok
    assert systematic_error(STATED, pixels, np.where(certain, 0.0, 0.5), shared * 0, one_rounding).ok
