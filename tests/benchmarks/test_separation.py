import pytest

pytest.importorskip("bpy")

from benchmarks.stability import separation


@pytest.fixture(scope="module")
def chart():
    (chart,) = separation.charts(quick=True)
    return chart


def errors(chart, name):
    (curve,) = (curve for curve in chart.curves if curve.name == name)
    return dict(zip(curve.x, curve.y, strict=True))


def test_ours_is_the_best_or_tied_at_every_separation(chart):
    assert chart.behind() == []


def test_ours_stays_within_its_bound_from_1e_300_to_1e300(chart):
    differences = errors(chart, "power of two, compensated (ours)")
    assert min(differences) == -300 and max(differences) == 300
    assert max(differences.values()) <= separation.COMPUTED, differences


@pytest.mark.parametrize(
    ("name", "lost_at", "good_at"),
    [
        ("text's formula, float32", (-50, 50), 0),
        ("text's formula, float64", (-200, 200), 100),
        ("mathutils, Vector.normalized", (-50, 50), 0),
    ],
)
def test_the_simpler_formulas_lose_the_axes_on_both_sides(chart, name, lost_at, good_at):
    differences = errors(chart, name)
    assert all(not differences[exponent] < 0.1 for exponent in lost_at), (
        f"the sweep does not reach the failure of {name}: {differences}"
    )
    assert differences[good_at] < 1e-5
