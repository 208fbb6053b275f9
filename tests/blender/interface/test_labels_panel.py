"""The sub-panel Labels: what it says it will write is what is written, beside Blender, and nothing of it is in the file."""

import json
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.interface import comparing, labels
from viewcam_addon.labels import KINDS
from viewcam_addon.labels import files as label_files

# In place of the batch: it keeps what it was to do, and writes the last of a label's files.
STAND_IN = """
import json, pathlib, sys
written = json.loads(pathlib.Path(sys.argv[1]).read_text())
(shot,), folder = written["jobs"], pathlib.Path(written["plan"]["out"])
(folder / (shot["name"] + ".labels.json")).write_text(json.dumps([shot, written["plan"]["outputs"]]))
"""


@pytest.fixture
def settings(fresh_blender, tmp_path):
    found = bpy.context.window_manager.virtual_pinhole_labels
    found.folder = str(tmp_path / "out")
    yield found
    labels.background.end()
    for name in ("kinds", "depth_steps", "folder"):
        found.property_unset(name)


@pytest.fixture
def camera(add_camera, scene):
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 48, 100
    scene.frame_current = 3
    return add_camera("Hero: close")


@pytest.fixture
def stand_in(monkeypatch):
    def command(_copy, _scene, written):
        return [sys.executable, "-c", STAND_IN, str(written)]

    monkeypatch.setattr(comparing, "command", command)


def test_each_label_can_be_chosen_and_none_is_unknown():
    assert tuple(name.lower() for name, *_ in labels._KINDS) == KINDS


def test_a_click_starts_a_batch_of_this_frame_with_labels_alone(settings, camera, stand_in, scene):
    settings.kinds, settings.depth_steps = {"FLOW", "DEPTH"}, 250
    bpy.data.objects["Hero: close"].select_set(True)
    assert bpy.ops.viewcam.write_labels(camera="Hero: close") == {"FINISHED"}
    folder, sentence = labels.background.latest
    assert folder.parent == Path(settings.folder) and sentence == f"Written to {folder}"
    assert folder.name.startswith("untitled Hero_ close 0003 labels 2")
    shot, outputs = json.loads((folder / "Hero_ close.labels.json").read_text())
    if not bpy.app.binary_path:  # else Blender is given the file, which is the job's then
        assert Path(shot.pop("blend")).name == "untitled.blend"
    assert shot == {"name": "Hero_ close", "camera": "Hero: close", "width": 64, "height": 48, "frame": 3}
    wanted = {"picture": False, "check": False, "labels": ["depth", "flow"], "depth_steps": 250.0, "report": False}
    assert outputs == wanted


def test_a_child_that_dies_leaves_no_folder_and_its_last_words_are_said(settings, camera, monkeypatch, tmp_path):
    monkeypatch.setattr(comparing, "command", lambda *_: [sys.executable, "-c", "print('out of memory'); raise SystemExit(9)"])
    with pytest.raises(RuntimeError, match="out of memory"):
        bpy.ops.viewcam.write_labels()
    folder, sentence = labels.background.latest
    assert folder is None and "out of memory" in sentence and list(Path(settings.folder).iterdir()) == []


def test_a_shot_that_fails_is_said_in_its_own_words(settings, camera, monkeypatch):
    summary = '{"shots": [{"name": "Hero", "error": "the disk is full"}]}'
    fails = "import json, pathlib, sys; out = json.loads(pathlib.Path(sys.argv[1]).read_text())['plan']['out'];"
    fails += "pathlib.Path(out, 'summary.json').write_text(sys.argv[2]); sys.exit(4)"
    monkeypatch.setattr(comparing, "command", lambda *given: [sys.executable, "-c", fails, str(given[2]), summary])
    with pytest.raises(RuntimeError, match="The disk is full"):
        bpy.ops.viewcam.write_labels()


def test_while_labels_are_written_there_is_cancel_and_no_second_start(settings, camera, monkeypatch, scene):
    monkeypatch.setattr(comparing, "command", lambda *_: [sys.executable, "-c", "import time; time.sleep(600)"])
    labels.background.running = writing = labels.Writing(camera, scene, settings)
    assert writing.poll() is None and not bpy.ops.viewcam.write_labels.poll()
    assert bpy.ops.viewcam.cancel_labels() == {"FINISHED"}
    assert not bpy.ops.viewcam.cancel_labels.poll() and not writing.folder.exists()
    assert writing._process.status() is not None


@pytest.mark.parametrize(
    ("kinds", "folder", "sentence"),
    [(set(), "out", "No label is chosen"), ({"DEPTH"}, "", "There is no folder for the labels, and the file is not saved")],
)
def test_what_can_not_be_begun_is_one_sentence(settings, camera, kinds, folder, sentence):
    settings.kinds, settings.folder = kinds, folder
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.viewcam.write_labels()


def test_nothing_is_left_of_it_without_the_add_on(registered_addon):
    registered_addon.unregister()
    try:
        assert not hasattr(bpy.types.WindowManager, "virtual_pinhole_labels")
        assert labels.background.on_load not in bpy.app.handlers.load_pre
    finally:
        registered_addon.register()


@pytest.mark.exhaustive
def test_the_files_that_the_panel_shows_are_those_that_are_written(settings, monkey):
    settings.kinds = {kind.upper() for kind in KINDS}
    shown = labels.file_names(bpy.context.scene.camera, settings.chosen())
    assert bpy.ops.viewcam.write_labels() == {"FINISHED"}
    folder, _ = labels.background.latest
    of_the_batch = {"summary.json", "contact-sheet.html"}
    assert {path.name for path in folder.glob("[!.]*")} - of_the_batch == set(shown)
    told = label_files.read(folder / shown[-1])
    assert "Suzanne" in {each["name"] for each in told["instances"]} and told["lost"] == {"forward": [], "backward": []}
