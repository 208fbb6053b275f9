"""A hostile .blend in a real Blender with the extension that its users install: nothing of it runs, unless it is trusted."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ARMS = Path(__file__).parents[1] / "blender" / "test_opening.py"
SMALL = ("--size", "16x16", "--samples", "1")


@pytest.fixture(params=["driver", "registered_text"])
def hostile(request, tmp_path):
    """(the file, the folder of what it has done), armed by the wheel of Blender."""
    environment = {**os.environ, "PYTHONPATH": str(ARMS.parents[2])}
    subprocess.run([sys.executable, ARMS, tmp_path, request.param], env=environment, check=True, capture_output=True)
    marks = tmp_path / "hostile" / "marks"
    assert not list(marks.iterdir())
    return tmp_path / "hostile" / "file" / "hostile.blend", marks


def commands(out):
    yield ["batch", "--orbit", "2", "--engine", "CYCLES", *SMALL, "--out", out / "batch"]
    yield ["check", *SMALL, "--json", out / "check.json"]


def test_nothing_of_a_hostile_file_runs_in_a_batch_and_a_check(real_blender, hostile, tmp_path):
    blend, marks = hostile
    for words in commands(tmp_path):
        done = real_blender.run("-q", "--disable-autoexec", "-b", blend, "--command", "viewcam", *words)
        assert done.returncode in (0, 1) and "Traceback" not in done.stdout + done.stderr, done
        assert not list(marks.iterdir()), f"{words[0]} ran what is in it"
    assert (tmp_path / "batch" / "orbit_000.exr").exists() and (tmp_path / "check.json").exists()


def test_trusted_it_does_so_that_the_test_above_can_fail(real_blender, hostile, tmp_path):
    blend, marks = hostile
    words = [*next(commands(tmp_path)), "--trust"]
    done = real_blender.run("-q", "--enable-autoexec", "-b", blend, "--command", "viewcam", *words)
    assert list(marks.iterdir()), done
