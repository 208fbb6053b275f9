import pytest

pytest.importorskip("bpy")

from benchmarks.stability import field_of_view


@pytest.fixture(scope="module")
def charts():
    return field_of_view.charts(quick=True)


def test_d_is_right_to_float32s_rounding_from_1e_4_to_179_9999_degrees(charts):
    for chart in charts:
        assert chart.behind() == []
        (ours,) = (curve for curve in chart.curves if curve.ours)
        assert min(ours.x) == pytest.approx(1e-4)
        assert max(ours.y) <= field_of_view.STORED, f"{chart.title}: {max(ours.y):.2e}"


def test_the_clamped_lens_and_the_angle_fail_towards_180_degrees(charts):
    wide = {curve.name: curve for curve in charts[0].curves}
    assert max(wide["camera.lens =, clamped at 1 mm"].y) > 1
    assert max(wide["camera.angle ="].y) > 1e-3


def test_cycles_picture_of_an_ordinary_lens_has_our_distance(fresh_blender):
    scene, camera = field_of_view.empty_stage(field_of_view.SIZE, field_of_view.SIZE)
    field_of_view._apply(scene, camera, 700.0)
    assert field_of_view._cycles_distance(scene, camera) == pytest.approx(700, rel=1e-6)
