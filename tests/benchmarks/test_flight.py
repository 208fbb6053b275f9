import numpy as np
import pytest

pytest.importorskip("bpy")

from benchmarks.stability import flight


@pytest.fixture(scope="module")
def charts():
    return flight.charts(quick=True)


def test_holding_is_behind_nowhere(charts):
    assert [sentence for chart in charts for sentence in chart.behind()] == []


def test_held_the_picture_turns_no_more_than_the_view_which_is_a_degree_each_frame(charts):
    for curve in charts[0].curves:
        if curve.ours:
            assert np.abs(np.diff(curve.y)).max() <= 1.0, curve.name


def test_canonical_axes_flip(charts):
    for curve in charts[0].curves:
        if not curve.ours:
            two_frames = np.asarray(curve.y)[2:] - np.asarray(curve.y)[:-2]
            assert two_frames.max() > 165, f"{curve.name}: {two_frames.max():.0f}°"
    assert max(charts[1].curves[0].y) > np.radians(85)


def test_held_the_picture_turns_ever_less_the_closer_the_flight(charts):
    (held,) = (curve for curve in charts[1].curves if curve.ours)
    assert (np.diff(held.y)[np.array(held.x[1:]) < np.radians(5)] <= 1e-15).all()
    assert held.y[-1] < 1e-14
