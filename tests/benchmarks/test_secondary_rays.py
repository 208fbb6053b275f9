import pytest

from benchmarks.stability import secondary_rays


@pytest.fixture(scope="module")
def measured():
    return {chart.name: chart for chart in secondary_rays.charts(quick=True)}


def counts(chart, name="ours"):
    curve = next(curve for curve in chart.curves if curve.name == name)
    return dict(zip((f"{x:.0e}" for x in curve.x), curve.y, strict=True))


def test_ours_is_the_best_or_tied_everywhere(measured):
    assert [sentence for chart in measured.values() for sentence in chart.behind()] == []


@pytest.mark.parametrize(
    "name", ["secondary-acne", "secondary-large", "secondary-leaks", "secondary-spheres", "secondary-lamps"]
)
def test_ours_has_neither_acne_nor_leaks_over_the_whole_sweep(measured, name):
    assert not any(counts(measured[name]).values()), counts(measured[name])


def test_ours_holds_walls_of_1e_14_of_their_distance_and_objects_3e13_sizes_away(measured):
    walls, distances = counts(measured["secondary-wall"]), counts(measured["secondary-distance"])
    assert walls["1e-14"] == 0 and walls["1e-15"] > 0, f"the sweep does not reach the edge: {walls}"
    assert distances["3e+13"] == 0 and distances["3e+14"] > 0, f"the sweep does not reach the edge: {distances}"


@pytest.mark.parametrize(
    ("chart", "method", "x"),
    [
        ("secondary-acne", "no offset", "1e+00"),
        ("secondary-acne", "1e-4 along the normal", "1e+13"),
        ("secondary-large", "1e-6 · max(1, |P|) along the normal", "1e+12"),
        ("secondary-large", "256 steps of floats (Wächter, Binder)", "1e+12"),
        ("secondary-leaks", "1e-6 · max(1, |P|) along the normal", "1e-06"),
        ("secondary-leaks", "256 steps of floats (Wächter, Binder)", "1e-06"),
        ("secondary-spheres", "as from a triangle, for float32", "3e+03"),
        ("secondary-lamps", "at the lamp", "1e+00"),
        ("secondary-lamps", "1e-4 before it", "1e-03"),
    ],
)
def test_each_sweep_reaches_the_failure_of_what_was_rejected(measured, chart, method, x):
    assert counts(measured[chart], method)[x] > 1e5, f"{method}: {counts(measured[chart], method)}"
