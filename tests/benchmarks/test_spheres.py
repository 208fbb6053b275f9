import numpy as np
import pytest

from benchmarks.stability import spheres


@pytest.fixture(scope="module")
def measured():
    return {chart.name: chart for chart in spheres.charts(quick=True)}


def curve(chart, name):
    return next(curve for curve in chart.curves if curve.name == name)


def test_ours_is_the_best_or_tied_everywhere(measured):
    assert [sentence for chart in measured.values() for sentence in chart.behind()] == []


@pytest.mark.parametrize("name", ["spheres-distance", "spheres-near", "spheres-stretched", "spheres-far-from-origin"])
def test_the_depth_of_ours_keeps_its_digits_over_the_whole_sweep(measured, name):
    ours = curve(measured[name], "ours")
    assert max(ours.y) <= spheres.SLANTED_TIE, f"{max(ours.y):.1e}"


def test_ours_decides_hit_or_miss_right_at_1e13_radii_1e_14_beside_the_silhouette_and_1e_16_above_the_surface(measured):
    for name, reach in (("spheres-distance-decisions", 1e13), ("spheres-grazing", 1e-14), ("spheres-near-decisions", 1e-16)):
        ours = curve(measured[name], "ours")
        wrong = [share for x, share in zip(ours.x, ours.y, strict=True) if (x <= reach if reach > 1 else x >= reach * 0.99)]
        assert len(wrong) > 10 and max(wrong) <= spheres.SHARE_TIE, f"{name}: {max(wrong):.1%} of the rays"


@pytest.mark.parametrize(
    ("chart", "method", "bound"),
    [
        ("spheres-distance", "textbook's quadratic, float64", 1e-9),
        ("spheres-distance-decisions", "perpendicular, c/q, float32", 0.1),
        ("spheres-grazing", "quadratic, near root c/q, float64", 0.1),
        ("spheres-near", "perpendicular, c/q, float64", 0.01),
        ("spheres-stretched", "textbook's quadratic, float64", 1e-9),
        ("spheres-far-from-origin", "perpendicular, c/q, float64", 1e-5),
    ],
)
def test_each_sweep_reaches_the_failure_of_what_was_rejected(measured, chart, method, bound):
    errors = np.array(curve(measured[chart], method).y)
    assert np.nanmax(errors) > bound, f"{method} is off by {np.nanmax(errors):.1e} only"
