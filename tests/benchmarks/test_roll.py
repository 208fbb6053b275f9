import pytest

pytest.importorskip("bpy")

from benchmarks.stability import roll


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
