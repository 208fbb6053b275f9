import importlib
import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")

from benchmarks import stability
from benchmarks.__main__ import main

ROOT = Path(__file__).resolve().parent.parent.parent


def test_every_sweep_is_a_module_and_every_module_a_sweep():
    modules = {path.stem for path in (ROOT / "benchmarks" / "stability").glob("*.py")} - {"__init__", "stage", "oracle"}
    assert modules == set(stability.SWEEPS)


@pytest.mark.parametrize("name", stability.SWEEPS)
def test_what_is_in_use_is_the_best_or_tied_all_along_each_sweep_at_whose_end_another_fails(name):
    charts = importlib.import_module(f"benchmarks.stability.{name}").charts(quick=True)
    assert [sentence for chart in charts for sentence in chart.behind()] == []
    assert any(_worst(chart, False) > 10 * _worst(chart, True) for chart in charts), "no chart reaches a failure"


def _worst(chart, ours):
    """The largest error of the methods in use, or of all others."""
    return max(np.nan_to_num(curve.y, nan=np.inf).max() for curve in chart.curves if curve.ours == ours)


def test_an_unknown_sweep_is_refused_with_those_that_there_are(tmp_path, capsys):
    assert main(["stability", "--only", "rolls", "--output", str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("there is no sweep 'rolls': choose from roll, ")


def test_a_run_draws_its_charts_and_writes_their_figures(tmp_path, capsys):
    words = ["stability", "--only", "field_of_view", "--quick", "--output", str(tmp_path), "--json", str(tmp_path / "all.json")]
    assert main(words) == 0
    figures = json.loads((tmp_path / "all.json").read_text(encoding="utf-8"))
    names = {"stability-field-of-view-wide", "stability-field-of-view-narrow"}
    assert figures["behind"] == []
    assert set(figures["charts"]) == names and [path.stem for path in tmp_path.glob("*.svg")] == ["stability-field-of-view"]
    assert "stability-field-of-view-wide: Read whether" in capsys.readouterr().out
    assert "python -m benchmarks stability" in (tmp_path / "stability-field-of-view.svg").read_text(encoding="utf-8")


def test_a_run_in_which_another_method_is_better_says_so_and_fails(tmp_path, monkeypatch, capsys):
    from benchmarks.stability import roll

    ours = roll.basis
    monkeypatch.setattr(roll, "basis", lambda e, l, up: tuple(axis + 1e-6 for axis in ours(e, l, up)))
    status, result = stability.run(tmp_path, ["roll"], quick=True)
    assert status == 1 and result["behind"]
    assert "compensated (ours) is off by" in capsys.readouterr().out
