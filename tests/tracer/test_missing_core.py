"""Where the core is not installed, one sentence says what to do, and what does not trace works as ever."""

import subprocess
import sys

import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import scene_file

WITHOUT_CORE = """
import importlib.util, sys
find_spec = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "viewcam_core" else find_spec(name, *rest)
"""


@pytest.fixture
def run_without_core(tmp_path):
    """run_without_core(program) → what a process did in which no core is installed."""

    def run(program: str) -> subprocess.CompletedProcess:
        command = [sys.executable, "-c", WITHOUT_CORE + program]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)

    return run


def test_a_picture_asks_for_the_core_in_one_sentence_and_writes_nothing(run_without_core, make_scene, ball, tmp_path):
    scene_file.write(make_scene(Pinhole((0, -4, 0), (0, 0, 0), (0, 0, 1), 20, 8, 8), ball(6)), tmp_path / "scene.json")
    program = "sys.argv = ['viewcam', 'render', 'scene.json', 'picture.exr']\nfrom viewcam_addon.__main__ import main_and_exit"
    outcome = run_without_core(f"{program}\nmain_and_exit()")
    assert outcome.returncode != 0 and not (tmp_path / "picture.exr").exists()
    assert "the tracer's core is missing" in outcome.stderr and "pip install" in outcome.stderr, outcome.stderr
    assert "Traceback" not in outcome.stderr and len(outcome.stderr.strip().splitlines()) == 1, outcome.stderr


def test_the_panel_and_the_camera_work_without_it(run_without_core):
    pytest.importorskip("bpy")
    program = """
import bpy, viewcam_addon
viewcam_addon.register()
scene = bpy.context.scene
camera = scene.camera
camera.virtual_pinhole.enabled = True
camera.virtual_pinhole.eye = (1, -5, 2)
from viewcam_addon.blender import camera as read_camera
print("EYE", *(round(x, 4) for x in read_camera.read(camera, scene).eye))
from viewcam_addon.tracer import render
viewcam_addon.unregister()
"""
    outcome = run_without_core(program)
    assert outcome.returncode == 0, outcome.stderr
    assert "EYE 1.0 -5.0 2.0" in outcome.stdout, outcome.stdout
