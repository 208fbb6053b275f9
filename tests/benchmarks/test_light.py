import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks import light
from benchmarks.charts import Curve
from benchmarks.light import convergence, pictures
from benchmarks.light.convergence import OURS, slope


@pytest.fixture(scope="module")
def charts():
    return {chart.name.removeprefix("convergence-"): chart for chart in convergence.charts(quick=True)}


def curve(chart, name) -> Curve:
    (actual,) = (curve for curve in chart.curves if curve.name == name)
    return actual


def slope_of(chart, name):
    return slope(curve(chart, name).x, curve(chart, name).y)


def test_ours_is_behind_no_other_method_anywhere(charts):
    assert [sentence for chart in charts.values() for sentence in chart.behind()] == []


def test_the_error_of_edges_falls_as_the_three_quarters_power(charts):
    assert slope_of(charts["edge"], OURS) <= -0.75


def test_the_error_of_what_is_smooth_falls_nearly_as_the_power_of_one_and_a_half(charts):
    assert slope_of(charts["lamp"], OURS) <= -1.3


def test_an_edge_in_four_dimensions_falls_faster_than_noise_where_padding_does_not(charts):
    """The theory's −5/8 for an edge in four dimensions; padding ends at −½."""
    chart = charts["soft-shadow"]
    assert slope_of(chart, OURS) <= -0.6
    assert curve(chart, OURS).y[-1] < 0.9 * curve(chart, "Owen's permutations, padded").y[-1]


def test_random_numbers_fall_as_noise_does_in_every_chart(charts):
    """The answers on paper are tested, too: with a wrong one, errors would not fall."""
    for chart in charts.values():
        assert slope_of(chart, "random numbers") == pytest.approx(-0.5, abs=0.05), chart.name


@pytest.mark.parametrize("name", ["edge", "lamp"])
def test_in_two_dimensions_ours_is_owens_permutations(charts, name):
    """Both have one variance; RMS over 256 pixels is off by its own 1/√512 on both sides, thrice that is 19 %."""
    ours, owen = curve(charts[name], OURS).y, curve(charts[name], "Owen's permutations, padded").y
    np.testing.assert_allclose(np.log(ours), np.log(owen), atol=math.log(1.19))


def test_a_sampler_that_repeats_itself_is_told(monkeypatch):
    ours = convergence.METHODS[OURS]
    monkeypatch.setitem(
        convergence.METHODS, OURS, lambda pairs, pixels, samples: ours(pairs, pixels, samples // 4).repeat(4, 2)
    )
    assert any(chart.behind() for chart in convergence.charts(quick=True))


def test_the_cube_is_cut_as_on_paper():
    half = convergence._cut_cube(np.ones((4, 1)), np.array([2.0]))
    assert half[0] == pytest.approx(0.5, abs=1e-12)
    corner = convergence._cut_cube(np.array([[1.0], [2.0]]), np.array([1.0]))
    assert corner[0] == pytest.approx(0.25, abs=1e-15)
    # Seen from the other side: 1 − x < 0.3 is x > 0.7.
    assert convergence._cut_cube(np.array([[-1.0], [1e-9]]), np.array([-0.7]))[0] == pytest.approx(0.3, abs=1e-6)


def test_a_lamp_that_fills_the_sky_shines_on_a_floor_with_its_radiance():
    """¼ of the hemisphere for each of its four corners; and the textbook's square, as wide as high above the floor, 0.2395."""
    assert 4 * convergence._corner_share(np.array(1e9), np.array(1e9)) == pytest.approx(1)
    assert 4 * convergence._corner_share(np.array(0.5), np.array(0.5)) == pytest.approx(0.2394564705, abs=1e-9)


pytest.importorskip("bpy")


@pytest.fixture(scope="module")
def picture_charts():
    return {chart.name.removeprefix("pictures-"): chart for chart in pictures.charts(quick=True)}


def slopes(chart):
    return {curve.name: slope(curve.x, curve.y) for curve in chart.curves}


def test_every_sweep_is_a_module_and_every_module_a_sweep():
    modules = {path.stem for path in Path(light.__file__).parent.glob("*.py")} - {"__init__"}
    assert modules == set(light.SWEEPS)


def test_our_pictures_are_noisier_than_no_others(picture_charts):
    """Beside Cycles': at most by the tenth that the two pictures' own chance is good for, over some hundred noisy pixels."""
    for chart in picture_charts.values():
        errors = {curve.name: curve.y for curve in chart.curves}
        assert all(ours <= 1.1 * expected for ours, expected in zip(errors["ours"], errors["Cycles"], strict=True)), errors


def test_the_noise_of_pictures_falls_as_that_of_integrals(picture_charts):
    result = {name: slopes(chart)["ours"] for name, chart in picture_charts.items()}
    assert result["edge"] <= -0.72, result  # −¾, measured in a picture in which two hundred pixels are noisy
    assert result["shadow"] <= -0.6, result  # an edge in four dimensions
    assert result["corner"] <= -0.5, result


def test_random_numbers_in_the_same_integrator_are_noisier(picture_charts):
    for chart in picture_charts.values():
        errors = {curve.name: curve.y for curve in chart.curves}
        assert errors["random numbers"][-1] > 1.4 * errors["ours"][-1], errors
