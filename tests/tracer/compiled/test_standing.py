"""When kernels stand in: not for one small picture, which would be finished before numba has started."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import compiled
from viewcam_addon.tracer.compiled import standing
from viewcam_addon.tracer.scene import scene_file

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.skipif(not compiled.AVAILABLE, reason="numba or embreex is not installed, or turned off")
@pytest.mark.parametrize(
    ("traced", "loads"),
    [
        ("render(scene)", False),
        ("render(scene, 'direct', 2)", False),
        ("render(scene, 'direct', 16, error=0.01)", False),
        ("Tracer(scene).render()", True),
        ("Tracer(scene).render_light('direct', 2, 0)", True),
    ],
)
def test_one_small_picture_is_not_worth_loading_numba(ball, make_scene, tmp_path, traced, loads):
    camera = Pinhole((0, -5, 1), (0, 0, 0), (0, 0, 1), 40, 48, 48)
    scene_file.write(make_scene(camera, ball(6)), tmp_path / "scene.json")
    program = (
        "import sys; from viewcam_addon.tracer.render import Tracer, render; from viewcam_addon.tracer.scene import scene_file;"
        f"scene = scene_file.read(sys.argv[1]); {traced}; print('numba' in sys.modules)"
    )
    command = [sys.executable, "-c", program, tmp_path / "scene.json"]
    outcome = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert outcome.stdout.strip() == str(loads), outcome.stderr


def test_kernels_are_used_where_a_small_picture_turns_out_to_need_many_paths(monkeypatch):
    monkeypatch.setattr(standing, "PATHS_WORTH_COMPILING", 1000)
    answer = _answering(monkeypatch)
    with standing.uncompiled(True):
        with standing.compiled_for(paths=1000):
            assert answer() == "kernel"
        with standing.compiled_for(paths=999):
            assert answer() == "NumPy"
    with standing.compiled_for(paths=999):
        assert answer() == "kernel"


def _answering(monkeypatch):
    """A function that tells whether its kernel stood in for it."""
    monkeypatch.setattr(standing, "AVAILABLE", True)
    monkeypatch.setattr(standing.importlib, "import_module", lambda name: SimpleNamespace(answer=lambda: "kernel"))

    @standing.or_compiled
    def answer():
        return "NumPy"

    return answer
