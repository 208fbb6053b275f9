import pytest

pytest.importorskip("bpy")

from pathlib import Path

from benchmarks import light
from benchmarks.light import pictures
from benchmarks.light.convergence import slope


@pytest.fixture(scope="module")
def charts():
    return {chart.name.removeprefix("pictures-"): chart for chart in pictures.charts(quick=True)}


def slopes(chart):
    return {curve.name: slope(curve.x, curve.y) for curve in chart.curves}


def test_every_sweep_is_a_module_and_every_module_a_sweep():
    modules = {path.stem for path in Path(light.__file__).parent.glob("*.py")} - {"__init__"}
    assert modules == set(light.SWEEPS)


def test_our_pictures_are_noisier_than_no_others(charts):
    """Beside Cycles': at most by the tenth that the two pictures' own chance is good for, over some hundred noisy pixels."""
    for chart in charts.values():
        errors = {curve.name: curve.y for curve in chart.curves}
        assert all(ours <= 1.1 * expected for ours, expected in zip(errors["ours"], errors["Cycles"], strict=True)), errors


def test_the_noise_of_pictures_falls_as_that_of_integrals(charts):
    result = {name: slopes(chart)["ours"] for name, chart in charts.items()}
    assert result["edge"] <= -0.72, result  # −¾, measured in a picture in which two hundred pixels are noisy
    assert result["shadow"] <= -0.6, result  # an edge in four dimensions
    assert result["corner"] <= -0.5, result


def test_random_numbers_in_the_same_integrator_are_noisier(charts):
    for chart in charts.values():
        errors = {curve.name: curve.y for curve in chart.curves}
        assert errors["random numbers"][-1] > 1.4 * errors["ours"][-1], errors
