from pathlib import Path

import pytest

pytest.importorskip("bpy")

from benchmarks import stability
from viewcam_addon.errors import InputError

ROOT = Path(__file__).resolve().parent.parent.parent


def test_every_sweep_is_a_module_and_every_module_a_sweep():
    modules = {path.stem for path in (ROOT / "benchmarks" / "stability").glob("*.py")} - {"__init__", "stage", "oracle"}
    assert modules == set(stability.SWEEPS)


def test_an_unknown_sweep_is_refused_with_those_that_there_are(tmp_path):
    with pytest.raises(InputError, match="no sweep 'rolls': choose from roll, "):
        stability.run(tmp_path, ["rolls"])


def test_a_run_draws_its_charts_and_returns_their_figures(tmp_path):
    status, result = stability.run(tmp_path, ["field_of_view"], quick=True)
    names = {"stability-field-of-view-wide", "stability-field-of-view-narrow"}
    assert status == 0 and result["behind"] == []
    assert set(result["charts"]) == names == {path.stem for path in tmp_path.glob("*.svg")}


def test_a_run_in_which_another_method_is_better_says_so_and_fails(tmp_path, monkeypatch, capsys):
    from benchmarks.stability import roll

    ours = roll.basis
    monkeypatch.setattr(roll, "basis", lambda e, l, up: tuple(axis + 1e-6 for axis in ours(e, l, up)))
    status, result = stability.run(tmp_path, ["roll"], quick=True)
    assert status == 1 and result["behind"]
    assert "compensated (ours) is off by" in capsys.readouterr().out
