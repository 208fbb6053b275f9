import numpy as np
import pytest

pytest.importorskip("bpy")

from benchmarks.stability import flight, pose_storage, roll


@pytest.fixture(scope="module")
def chart():
    (chart,) = roll.charts(quick=True)
    return chart


def test_ours_is_the_best_or_tied_at_every_angle(chart):
    assert chart.behind() == []


@pytest.mark.parametrize(
    ("name", "bound"), [("compensated (ours)", roll.COMPUTED), ("Blender's matrix after apply (ours)", roll.STORED)]
)
def test_ours_stays_within_its_bound_down_to_1e_17_radians(chart, name, bound):
    (curve,) = (curve for curve in chart.curves if curve.name == name)
    assert min(curve.x) == pytest.approx(1e-17) and max(curve.y) <= bound, f"{max(curve.y):.2e} of {bound:.0e}"


@pytest.mark.parametrize(
    ("name", "angle"), [("text's formula, float32", 1e-7), ("text's formula, float64", 1e-14), ("Gram–Schmidt, float64", 1e-14)]
)
def test_each_simpler_formula_has_lost_the_roll_by_some_angle(chart, name, angle):
    (curve,) = (curve for curve in chart.curves if curve.name == name)
    error = dict(zip((f"{x:.0e}" for x in curve.x), curve.y, strict=True))[f"{angle:.0e}"]
    assert not error < 1e-4, f"{name} is off by {error:.1e} only: the sweep does not reach its failure"


# --- Pose storage


@pytest.fixture(scope="module")
def curves():
    (chart,) = pose_storage.charts(quick=True)
    assert chart.behind() == []
    return {curve.name: curve for curve in chart.curves}


@pytest.mark.parametrize("name", ["apply, Euler (ours)", "apply, quaternion (ours)"])
def test_ours_costs_no_more_in_gimbal_lock_than_elsewhere(curves, name):
    assert max(curves[name].y) <= pose_storage.STORED, f"{max(curves[name].y):.2e}"


@pytest.mark.parametrize("name", ["matrix_world =, XYZ", "location and Matrix.to_euler"])
def test_blenders_own_conversion_fails_there(curves, name):
    assert max(curves[name].y) > 10 * pose_storage.STORED


# --- Flight


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
