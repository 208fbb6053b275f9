from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("bpy")

from benchmarks.stability import far_from_origin


@pytest.fixture(scope="module")
def chart():
    (chart,) = far_from_origin.charts(quick=True)
    return chart


@pytest.fixture(scope="module")
def curves(chart):
    return {curve.name: np.array(curve.y) for curve in chart.curves}


def test_the_tracer_and_recentered_cycles_are_as_exact_at_1e9_as_near_it(chart, curves):
    assert chart.behind() == []
    assert max(chart.curves[0].x) == 1e9
    assert curves["tracer: relative to the eye (ours)"].max() < far_from_origin.ARITHMETIC
    assert curves["Cycles, recentered (ours)"].max() < far_from_origin.NEAR_ORIGIN


def test_world_coordinates_and_plain_cycles_fail_far_from_origin(curves):
    float32, float64, cycles = (curves[name] for name in ("world space in float32", "world space in float64", "Cycles"))
    assert 0.1 < float32[2] < 10 and np.isnan(float32[3])
    # 2⁻⁵³ · 1e9 is a thousand times 2⁻⁵³ · 1e6, but for chance.
    assert float64[3] > 100 * float64[2] > 1e4 * far_from_origin.ARITHMETIC / 10
    assert 0.1 < cycles[2] < 10 and np.isnan(cycles[3])


def test_an_eye_that_is_rounded_to_float32_would_be_seen(monkeypatch):
    ours = far_from_origin._relative_to_the_eye

    def rounded(pinhole, matrix, points):
        return ours(replace(pinhole, eye=tuple(np.float32(pinhole.eye).tolist())), matrix, points)

    monkeypatch.setitem(far_from_origin.METHODS, "tracer: relative to the eye (ours)", rounded)
    curves = far_from_origin._arithmetic(np.array([1e3]), 20)
    assert curves[-1].ours and curves[-1].y[0] > 1e-5
