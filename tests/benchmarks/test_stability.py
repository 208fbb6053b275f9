import json
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from benchmarks import stability
from benchmarks.__main__ import main

ROOT = Path(__file__).resolve().parent.parent.parent


def test_every_sweep_is_a_module_and_every_module_a_sweep():
    modules = {path.stem for path in (ROOT / "benchmarks" / "stability").glob("*.py")} - {"__init__", "stage", "oracle"}
    assert modules == set(stability.SWEEPS)


def test_an_unknown_sweep_is_refused_with_those_that_there_are(tmp_path, capsys):
    assert main(["stability", "--only", "rolls", "--output", str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("there is no sweep 'rolls': choose from roll, ")


def test_a_run_draws_its_charts_and_writes_their_figures(tmp_path, capsys):
    words = ["stability", "--only", "field_of_view", "--quick", "--output", str(tmp_path), "--json", str(tmp_path / "all.json")]
    assert main(words) == 0
    figures = json.loads((tmp_path / "all.json").read_text(encoding="utf-8"))
    names = {"stability-field-of-view-wide", "stability-field-of-view-narrow"}
    assert figures["behind"] == []
    assert set(figures["charts"]) == names == {path.stem for path in tmp_path.glob("*.svg")}
    assert "stability-field-of-view-wide: Read whether" in capsys.readouterr().out
    assert "python -m benchmarks stability" in (tmp_path / "stability-field-of-view-wide.svg").read_text(encoding="utf-8")


def test_a_run_in_which_another_method_is_better_says_so_and_fails(tmp_path, monkeypatch, capsys):
    from benchmarks.stability import roll

    ours = roll.basis
    monkeypatch.setattr(roll, "basis", lambda e, l, up: tuple(axis + 1e-6 for axis in ours(e, l, up)))
    status, result = stability.run(tmp_path, ["roll"], quick=True)
    assert status == 1 and result["behind"]
    assert "compensated (ours) is off by" in capsys.readouterr().out
