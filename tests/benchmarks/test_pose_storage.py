import pytest

pytest.importorskip("bpy")

from benchmarks.stability import pose_storage


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
