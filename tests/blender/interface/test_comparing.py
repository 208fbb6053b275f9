"""A comparison beside Blender: the same picture, another one, canceled, broken; and nothing of it in the file."""

import contextlib
import errno
import json
import os
import re
import shutil
import sys
import time
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.interface import comparing, proof, proof_image
from viewcam_addon.comparison.answer import DIFFERENT, SAME
from viewcam_addon.errors import InputError

pytestmark = pytest.mark.slow

# A process in place of `viewcam check`, which tells and leaves behind the same, step by step, when it is told to.
STAND_IN = """
import json, pathlib, sys, time
PICTURES = ["report/difference.png", "report/test.png", "report/reference.png"]
folder = pathlib.Path(sys.argv[1])
def step(name, text="x"):
    while not (folder / "go").exists() or int((folder / "go").read_text() or 0) < step.number:
        time.sleep(0.01)
    step.number += 1
    (folder / "report").mkdir(exist_ok=True)
    if name in TOLD:
        print("Blender's own words", json.dumps({"event": "step", **TOLD[name]}), sep=chr(10), flush=True)
    (folder / name).write_text(text)
step.number = 1
TOLD = {
    "report/cycles.exr": {"name": "rendering", "number": 1, "of": 1},
    "report/scene.json": {"name": "tracing"},
    "report/reference.exr": {"name": "comparing"},
}
for name in ("report/cycles.exr", "report/scene.json", "report/reference.exr", "report/index.html", *PICTURES):
    step(name)
result = {"passed": True, "answer": "same", "sentence": "The same picture: as told.", "passes": [], "ledger": []}
step("result.json", json.dumps(result))
"""


@pytest.fixture
def seen(monkey, posed_camera, scene):
    """A scene of Suzanne, 64 × 48 pixels, saved nowhere."""
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    posed_camera.virtual_pinhole.distance = 60
    bpy.context.view_layer.update()
    return scene


@pytest.fixture(autouse=True)
def nothing_left():
    """No comparison goes on, and none is remembered, from one test to the next."""
    yield
    proof.background.end()


@pytest.fixture
def stand_in(monkeypatch, seen):
    """A function that starts a comparison whose child is the stand-in, with a method `let(steps)`."""

    class Slow(comparing.RunningComparison):
        def let(self, steps):
            (self.folder / "go").write_text(str(steps))

    def command(copy, _scene, _written):
        return [sys.executable, "-c", STAND_IN, str(copy.parent)]

    monkeypatch.setattr(comparing, "command", command)
    monkeypatch.setattr(proof, "RunningComparison", Slow)
    return lambda **options: Slow(seen.camera, seen, **options)


def wait_for(what, seconds=100):
    ends = time.monotonic() + seconds
    while not (outcome := what()) and time.monotonic() < ends:
        time.sleep(0.02)
    assert outcome, "it does not come about"
    return outcome


def processes_of(folder):
    """The processes whose command line names the folder; one that has ended has none."""
    result = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            result += [process.name] if str(folder).encode() in (process / "cmdline").read_bytes() else []
    return result


def values_of(block):
    """Every property of a datablock or a group of settings that is no pointer, and what the pointers point to."""

    def plain(value):
        return tuple(map(plain, value)) if hasattr(value, "__len__") and not isinstance(value, str | bytes | set) else value

    result = {}
    for prop in block.bl_rna.properties:
        value = getattr(block, prop.identifier, None)
        if prop.type == "POINTER":
            result[prop.identifier] = value and getattr(value, "name", "")
        elif prop.type == "COLLECTION":
            result[prop.identifier] = len(value)
        elif prop.identifier != "rna_type":
            result[prop.identifier] = repr(plain(value))
    return result


def state(scene):
    """All that an artist has set: scene, render, Cycles, view layers, camera; which datablocks there are; and where."""
    camera_object = scene.camera
    blocks = [scene, scene.render, scene.render.image_settings, scene.cycles, scene.view_settings, *scene.view_layers]
    blocks += [camera_object, camera_object.data, camera_object.virtual_pinhole]
    collections = [prop.identifier for prop in bpy.data.bl_rna.properties if prop.type == "COLLECTION"]
    counts = {name: len(getattr(bpy.data, name)) for name in collections}
    result = {f"{type(block).__name__} {name}": value for block in blocks for name, value in values_of(block).items()}
    return result | counts | {"file": bpy.data.filepath, "dirty": bpy.data.is_dirty}


def changed(before, after):
    """The values that are not as they were."""
    return {name: (before.get(name), value) for name, value in after.items() if value != before.get(name)}


def test_the_same_picture_is_the_verdict_and_the_file_stays_as_it_is(seen):
    seen.objects["Suzanne"].location.x = 0.25  # an edit that nobody has saved
    before = state(seen)
    comparison, lines = comparing.RunningComparison(seen.camera, seen), []
    while (outcome := comparison.poll()) is None:
        lines.append(comparison.progress())
        time.sleep(0.01)
    assert changed(before, state(seen)) == {}
    assert outcome.answer == SAME and outcome.verdict.startswith("The same picture: over "), outcome.verdict
    assert [share for share, _ in lines] == sorted(share for share, _ in lines) and lines[0][0] == 0
    assert lines[0][1] == "Rendering with Cycles" and lines[-1][1] == "Comparing"
    rows = dict(outcome.rows)
    assert rows["Median"].endswith(" px") and "Mismatches" in rows and rows["Modeled"] == "1 of 1 object"
    assert outcome.report.is_file() and all(path.is_file() for path in outcome.pictures.values()) and outcome.colors
    assert "check untitled.blend --camera Camera --level geometry" in outcome.report.read_text()
    exported = json.loads((outcome.folder / "scene.json").read_text())
    assert "0.25" in json.dumps(exported["objects"]), "the edit is not in the picture that was compared"
    assert outcome.is_of(seen.camera, seen)
    seen.camera.virtual_pinhole.distance = 61
    bpy.context.view_layer.update()
    assert not outcome.is_of(seen.camera, seen), "the camera has changed since"
    assert [path.name for path in comparison.folder.iterdir()] == ["report"]
    outcome.discard()
    assert not comparison.folder.exists() and outcome.report is None and outcome.pictures == {}


def test_a_camera_that_is_not_where_it_was_put_differs_and_then_is_mended(seen):
    """Twice by the operator: one image, of the second comparison in the end. The eye is keyed, so that it does not follow."""
    seen.camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    limit = seen.camera.constraints.new("LIMIT_LOCATION")
    limit.use_min_x, limit.min_x = True, seen.camera.location.x + 0.01
    bpy.context.view_layer.update()
    assert bpy.ops.viewcam.compare_with_cycles() == {"FINISHED"}
    first = proof.background.latest
    assert first.answer == DIFFERENT and "from the stated one" in first.verdict
    image = bpy.data.images["Virtual Pinhole Proof"]
    bytes_before = image.packed_file.data
    assert tuple(image.size) == (3 * 64 + 2 * proof_image._GAP, 48)
    seen.camera.constraints.remove(limit)
    assert bpy.ops.viewcam.compare_with_cycles(camera="Camera") == {"FINISHED"}
    second = proof.background.latest
    assert second.answer == SAME and not first.temporary.exists() and second.report.is_file()
    assert image.packed_file.data == bytes_before, "a pass shows nothing that nobody asked for"
    assert bpy.ops.viewcam.show_difference() == {"FINISHED"}
    (again,) = [each for each in bpy.data.images if each.name.startswith("Virtual Pinhole Proof")]
    assert again.packed_file.data != bytes_before and not again.is_dirty


def test_light_is_compared_with_as_many_samples_as_it_takes(seen, add_lamp):
    add_lamp("POINT", energy=500)
    seen.render.resolution_percentage = 50
    bpy.context.view_layer.update()
    settings = bpy.context.window_manager.virtual_pinhole_proof
    settings.level, settings.clay = "DIRECT", True
    try:
        assert bpy.ops.viewcam.compare_with_cycles() == {"FINISHED"}
    finally:
        for name in ("level", "chosen_level", "clay"):
            settings.property_unset(name)
    outcome = proof.background.latest
    assert outcome.answer == SAME, outcome.verdict
    assert outcome.what == "Camera, frame 1, direct" and "Light, to Tracer's" in dict(outcome.rows)
    assert "Orange where Cycles is brighter" in outcome.colors
    assert set(outcome.pictures) == {"cycles", "tracer", "difference"}, "all of it is modeled"
    page = outcome.report.read_text(encoding="utf-8")
    assert "--find 2%" in page and "--clay" in page
    assert len(list(outcome.folder.glob("cycles-*.exr"))) == 8


def test_canceled_while_it_renders_it_leaves_no_process_and_no_file(seen):
    seen.render.resolution_x, seen.render.resolution_y = 1920, 1080
    bpy.context.view_layer.update()
    before, there = state(seen), set(Path(bpy.app.tempdir).iterdir())
    comparison = comparing.RunningComparison(seen.camera, seen)
    # Blender in the child has begun when it has a temporary folder.
    wait_for(lambda: list(comparison.folder.glob("blender_*")))
    assert processes_of(comparison.folder)
    comparison.cancel()
    # Blender is killed at once, but not waited for: it is no child of ours.
    wait_for(lambda: processes_of(comparison.folder) == [], seconds=2)
    assert set(Path(bpy.app.tempdir).iterdir()) == there and changed(before, state(seen)) == {}
    comparison.cancel()  # twice does no harm


def test_its_steps_tell_how_far_it_is(stand_in):
    comparison = stand_in()
    lines = [comparison.progress()]
    for steps, name in ((1, "cycles.exr"), (2, "scene.json"), (3, "reference.exr")):
        comparison.let(steps)
        wait_for((comparison.folder / "report" / name).exists)
        lines.append(comparison.progress())
    words = ["Rendering with Cycles", "Rendering with Cycles", "Tracing", "Comparing"]
    assert lines == list(zip((0, 0, 1 / 3, 2 / 3), words, strict=True))
    assert comparison.poll() is None
    comparison.let(8)
    outcome = wait_for(comparison.poll)
    assert outcome.verdict == "The same picture: as told."
    outcome.discard()


def test_light_is_rendered_in_pictures_that_are_counted(stand_in):
    comparison = stand_in(level="path")
    assert comparison.progress() == (0, "Rendering with Cycles, 1 of 8")
    with open(comparison.folder / "output.txt", "a", encoding="utf-8") as log:
        log.write('{"event": "step", "name": "rendering", "number": 4, "of": 8}\n')
        log.flush()
        assert comparison.progress() == (3 / 10, "Rendering with Cycles, 4 of 8")
        log.write('{"event": "step", "name": "tracing"}\n{"event": "progress", "share": 0.25}\n{"event": "pro')
        log.flush()
        assert comparison.progress() == (8.25 / 10, "Tracing"), "half a line is on its way"
    comparison.cancel()


def test_a_search_for_a_bias_tells_how_much_longer_it_takes(stand_in):
    comparison = stand_in(level="path", find="0.5%")
    with open(comparison.folder / "output.txt", "a", encoding="utf-8") as output:
        output.write('{"event": "forecast", "samples": 1024, "taken": 256, "following": 512, "seconds": 41.6}\n')
        output.flush()
        assert comparison.progress() == (1 / 4, "Rendering with Cycles, 1 of 8, about 42 s more")
        output.write('{"event": "step", "name": "rendering", "number": 6, "of": 8}\n')
        output.flush()
        assert comparison.progress() == ((256 + 256 / 2) / 1024, "Rendering with Cycles, 6 of 8, about 42 s more")
    comparison.cancel()


def test_a_report_that_is_kept_stands_in_its_folder_and_nothing_else_changes_there(stand_in, tmp_path):
    (tmp_path / "own.txt").write_text("the artist's")
    canceled = stand_in(keep_in=tmp_path)
    canceled.let(4)
    wait_for((canceled.folder / "report" / "index.html").exists)
    canceled.cancel()
    assert [path.name for path in tmp_path.iterdir()] == ["own.txt"]
    comparison = stand_in(keep_in=tmp_path / "new")
    comparison.let(8)
    outcome = wait_for(comparison.poll)
    assert outcome.report.parent.parent == tmp_path / "new" and not comparison.folder.exists()
    assert re.fullmatch(r"untitled Camera 0001 \d{4}-\d\d-\d\d \d\d\.\d\d\.\d\d", outcome.report.parent.name)
    outcome.discard()
    assert outcome.report.is_file(), "what the artist keeps is the artist's"


def test_where_the_report_can_not_be_kept_a_sentence_says_so(stand_in, tmp_path):
    (tmp_path / "file").write_text("")
    comparison = stand_in(keep_in=tmp_path / "file" / "report")
    comparison.let(8)
    outcome = wait_for(comparison.poll)
    assert outcome.answer is None and "can't be kept in" in outcome.verdict and not comparison.folder.exists()


def test_a_full_disk_leaves_no_half_of_a_report_s_file(stand_in, tmp_path, monkeypatch):
    def copy_half(_source, target):
        Path(target).write_bytes(b"half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(shutil, "copyfile", copy_half)
    comparison = stand_in(keep_in=tmp_path / "new")
    comparison.let(8)
    outcome = wait_for(comparison.poll)
    assert outcome.answer is None and "No space left" in outcome.verdict and "free some space" in outcome.verdict
    assert [path for path in (tmp_path / "new").rglob("*") if path.is_file()] == [] and not comparison.folder.exists()


@pytest.mark.parametrize("ends", ["another file", "the add-on"])
def test_another_file_and_turning_the_add_on_off_end_it(stand_in, registered_addon, ends):
    proof.background.running = comparison = stand_in()
    assert not bpy.ops.viewcam.compare_with_cycles.poll(), "two at a time"
    if ends == "another file":
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    else:
        registered_addon.unregister()
        registered_addon.register()
    assert proof.background.running is None and proof.background.latest is None
    assert not comparison.folder.exists() and processes_of(comparison.folder) == []


def test_cancel_ends_it_and_keeps_what_the_last_one_came_to(stand_in):
    comparison = stand_in()
    comparison.let(8)
    wait_for(lambda: comparison._process.status() is not None)
    proof.background.running = comparison
    assert proof.background.poll() is proof.background.latest and proof.background.running is None
    assert not bpy.ops.viewcam.cancel_comparison.poll()
    proof.background.running = stand_in()
    assert bpy.ops.viewcam.cancel_comparison() == {"FINISHED"}
    assert proof.background.running is None and proof.background.latest.report.is_file()


def test_a_child_that_dies_is_told_with_its_last_words(monkeypatch, seen):
    program = "import os; print('Writing: something'); print('out of memory', flush=True); os.kill(os.getpid(), 11)"
    monkeypatch.setattr(comparing, "command", lambda *_: [sys.executable, "-c", program])
    with pytest.raises(RuntimeError, match="was ended by signal 11 after saying: out of memory"):
        bpy.ops.viewcam.compare_with_cycles()
    outcome = proof.background.latest
    assert outcome.answer is None and outcome.report is None and outcome.rows == ()
    assert not bpy.ops.viewcam.open_report.poll() and not bpy.ops.viewcam.show_difference.poll()
    assert list(Path(bpy.app.tempdir).glob("viewcam-*")) == []


@pytest.mark.parametrize(
    ("output", "status", "sentence"),
    [
        ('traced\n{"event": "error", "text": "out.exr can\'t be written"}\nleft\n', 2, "Out.exr can't be written"),
        ('{"event": "error", "text": "l.json: one problem", "problems": ["shot 1: no EEVEE"]}', 2, "Shot 1: no EEVEE"),
        ('{"event": "error", "text": "l.json", "problems": ["a", "b", "c"]}', 2, "A (and 2 more problems)"),
        ("", 3, "The process that compares ended with status 3"),
        ("first\n\n last \n", -9, "The process that compares was ended by signal 9 after saying: last"),
    ],
)
def test_the_sentence_is_the_childs_own_where_it_has_one(output, status, sentence):
    assert comparing.failure(output, status) == sentence


@pytest.mark.parametrize(
    ("result", "rows"),
    [
        (
            {
                "passes": [{"name": "Position", "percentiles": {"p50": {"value": 5.23e-5}, "p99.9": {"value": 0.00276}}}],
                "mismatches": {"kinds": {"surface": {"count": 1200, "explained": 7}, "coverage": {"count": 0, "explained": 0}}},
                "ledger": [{"status": "exported"}, {"status": "skipped"}],
            },
            [
                ("Median", "0.000052 px"),
                ("99.9 % within", "0.0028 px"),
                ("Mismatches", "1,200, 7 explained"),
                ("Modeled", "1 of 2 objects"),
            ],
        ),
        ({"passes": [{"name": "Position", "percentiles": {}}], "ledger": []}, [("Modeled", "0 of 0 objects")]),
        (
            {"quantities": [{"ratio": 1.000123, "ratio_error": 3.1e-4, "noise_free": None}], "ledger": []},
            [("Light, to Tracer's", "1.00012 ± 0.00031"), ("Modeled", "0 of 0 objects")],
        ),
        (
            {"quantities": [{"noise_free": {"percentiles": {"p50": {"value": 0.0}, "p99.9": {"value": 2e-7}}}}], "ledger": []},
            [("Median", "0 of the light"), ("99.9 % within", "0.0000002 of the light"), ("Modeled", "0 of 0 objects")],
        ),
    ],
)
def test_the_panel_tells_the_figures_that_tell_most(result, rows):
    assert comparing.figures(result) == rows


def test_what_can_not_be_compared_is_refused_at_once_in_one_sentence(seen, monkeypatch):
    there = set(Path(bpy.app.tempdir).iterdir())
    with monkeypatch.context() as patch:
        patch.setattr("importlib.util.find_spec", lambda name: None)
        with pytest.raises(InputError, match="OpenEXR is missing"):
            comparing.RunningComparison(seen.camera, seen)
    other = bpy.data.scenes.new("Other")
    with pytest.raises(InputError, match="camera 'Camera' is not in scene 'Other'"):
        comparing.RunningComparison(seen.camera, other)
    with monkeypatch.context() as patch:
        patch.setattr(comparing, "_file_name", lambda: "no/such/folder/copy.blend")
        with pytest.raises(RuntimeError, match="A copy of the file can't be saved"):
            bpy.ops.viewcam.compare_with_cycles()
    with monkeypatch.context() as patch:
        patch.setattr(comparing, "command", lambda *_: ["/no/such/program"])
        with pytest.raises(RuntimeError, match="The comparison can't be started"):
            bpy.ops.viewcam.compare_with_cycles()
    seen.camera.data.type = "ORTHO"
    with pytest.raises(RuntimeError, match="is orthographic, no pinhole"):
        bpy.ops.viewcam.compare_with_cycles()
    seen.camera = None
    bpy.context.view_layer.objects.active = None
    assert not bpy.ops.viewcam.compare_with_cycles.poll()
    assert set(Path(bpy.app.tempdir).iterdir()) == there and proof.background.running is None


@pytest.mark.parametrize("compress", [False, True])
def test_the_copy_finds_what_the_file_finds_and_the_file_keeps_its_ways(seen, tmp_path, compress):
    """Its name, the paths in it, whether it is compressed when it is saved the next time."""
    picture = bpy.data.images.new("Picture", 4, 4)
    picture.filepath_raw, picture.file_format = str(tmp_path / "picture.png"), "PNG"
    picture.save()
    picture.use_fake_user = True
    path = tmp_path / "scene.blend"
    picture.filepath, picture.source = str(tmp_path / "picture.png"), "FILE"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=compress)
    picture.filepath = "//picture.png"
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    seen.objects["Suzanne"].location.x = 3
    comparing.save_copy(folder / "copy.blend")
    assert bpy.data.filepath == str(path) and picture.filepath == "//picture.png"
    assert comparing._is_compressed() == compress
    magic = [each.read_bytes()[:4] for each in (path, folder / "copy.blend")]
    assert magic[0] == magic[1] and (magic[0] == b"BLEN") != compress
    assert sorted(each.name for each in tmp_path.iterdir()) == ["elsewhere", "picture.png", "scene.blend"]
    bpy.ops.wm.open_mainfile(filepath=str(folder / "copy.blend"))
    assert bpy.data.objects["Suzanne"].location.x == 3
    image_path = bpy.data.images["Picture"].filepath
    assert os.path.samefile(bpy.path.abspath(image_path), tmp_path / "picture.png")
