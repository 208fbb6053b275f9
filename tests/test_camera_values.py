import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.camera_values import FIELD_OF_VIEW, CameraValues, without_border
from viewcam_addon.errors import InputError
from viewcam_addon.intrinsics import FITS, CameraData, Frame, view_plane

VALUES = CameraValues((7.0, -6.0, 5.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1500.0)
ROUNDING = 2.0**-53

frames = st.builds(
    Frame, st.integers(4, 8192), st.integers(4, 8192), st.integers(50, 200), st.floats(1, 200), st.floats(1, 200)
)
fits = st.sampled_from(FITS)
distances = st.floats(1e-3, 1e6)
zooms = st.floats(1e-3, 1e3)
keeps = st.sampled_from(["PIXELS", FIELD_OF_VIEW])


@given(distances, zooms, keeps, frames, frames, fits)
def test_what_is_stated_is_asked_for_whatever_zoom_and_resolution(distance, zoom, keeps, earlier, frame, fit):
    values = replace(VALUES, zoom=zoom, keeps=keeps, counted_in=without_border(earlier))
    message = values.stating((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), distance, frame, fit)
    assert (message.zoom, message.enabled, message.held_roll) == (zoom, True, 0.0)
    # Two quotients and two products, each rounded once.
    assert abs(message.distance_at_full_size(frame, fit) - distance) <= 4.5 * ROUNDING * distance
    assert message.view_when_set == ((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@given(distances, keeps, frames, frames, fits)
def test_counting_the_distance_anew_changes_no_camera(distance, keeps, earlier, frame, fit):
    values = replace(VALUES, distance=distance, keeps=keeps, counted_in=without_border(earlier))
    anew = values.counted_anew(frame, fit)
    before, after = (each.distance_at_full_size(frame, fit) for each in (values, anew))
    assert after == before and anew.counted_in == without_border(frame)


@given(frames, frames, fits)
def test_a_kept_field_of_view_is_a_kept_lens(earlier, frame, fit):
    lens = CameraData(50.0, sensor_fit=fit)
    at_full_size = [replace(each, percentage=100) for each in (earlier, frame)]
    before, after = (view_plane(lens, each).distance[0] for each in at_full_size)
    values = replace(VALUES, distance=before, keeps=FIELD_OF_VIEW, counted_in=without_border(earlier))
    # lens / sensor · n / aspect on both sides: five roundings, and the quotient and product of the growth.
    assert values.distance_at_full_size(frame, fit) == pytest.approx(after, rel=16 * ROUNDING)


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
