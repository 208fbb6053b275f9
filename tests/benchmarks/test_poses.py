import numpy as np
import pytest

pytest.importorskip("bpy")

from benchmarks.poses import basis, methods
from benchmarks.poses.methods import FLOAT32, FLOAT64, OURS, SINGLE, TRACK_QUAT, TRACK_TO, TRUTH, VECTOR


@pytest.fixture(scope="module")
def charts():
    return {chart.name.removeprefix("basis-"): chart for chart in basis.charts(quick=True)}


def error(chart, name):
    (curve,) = (curve for curve in chart.curves if curve.name == name)
    return curve.y[0]


def test_ours_is_exact_to_its_bound_in_every_kind_of_pose(charts):
    for name, chart in charts.items():
        assert error(chart, OURS) <= basis.EXACT, f"{name}: {error(chart, OURS):.2e} of {basis.EXACT:.2e}"


def test_the_truth_is_itself_to_one_rounding(charts):
    """Three components of at most 1, each rounded by half a unit in the last place, 2⁻⁵⁴ for those above ½."""
    assert max(error(chart, TRUTH) for chart in charts.values()) <= 3**0.5 * 2.0**-54


@pytest.mark.parametrize("name", [FLOAT64, SINGLE])
def test_the_texts_formula_loses_near_vertical_what_the_angle_costs(charts, name):
    """Its cross product is off by 2⁻⁵³ or so, at 1e-12 rad that is 1e-4."""
    assert error(charts["ordinary"], name) < 1e-14
    assert 1e-7 < error(charts["vertical"], name) < 1e-2


@pytest.mark.parametrize("name", [FLOAT32, VECTOR, TRACK_QUAT, TRACK_TO])
def test_what_stores_float32_loses_geocentric_coordinates(charts, name):
    """At 6.4e6 neighbours are half a unit apart, which turns a view of 10 to 100 units by 1e-3 to 1e-1."""
    assert error(charts["ordinary"], name) < 1e-4
    assert 1e-4 < error(charts["far"], name) < 1


def test_each_method_has_one_time_for_each_way_to_call_it(charts):
    for chart in charts.values():
        assert {curve.name for curve in chart.curves} == methods.METHODS.keys()
        assert all(x > 0 for curve in chart.curves for x in curve.x)
        assert {curve.name for curve in chart.curves if len(curve.x) == 2} == {OURS, FLOAT64}


def test_an_axis_that_is_turned_is_off_by_its_angle():
    poses = basis._ordinary(5, None)
    for turn in (1e-15, 1e-9, 0.1, np.pi):
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        turned = poses.high.copy()
        turned[2, :2] = rotation @ turned[2, :2]  # u and v about w
        # The rounding of what is turned: a unit of the last place for each of three components, and of the turn itself.
        assert poses.error(turned) == pytest.approx(turn, rel=1e-9, abs=1e-15)


def test_kinds_of_poses_are_what_they_are_called():
    far, vertical = basis._far(50, None), basis._vertical(130, None)
    assert np.linalg.norm(far.eye, axis=1).min() > 6.3e6
    u, w = vertical.high[:, 0], vertical.high[:, 2]
    sine = np.linalg.norm(np.cross(vertical.up, w), axis=1)
    assert sine.max() > 0.99 and np.abs(sine - np.repeat(10.0 ** -np.arange(13), 10)).max() < 1e-14
    assert np.abs((u * vertical.up).sum(axis=1)).max() < 1e-15
