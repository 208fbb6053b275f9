"""`viewcam check` of many pictures: each a shot of a batch, with one page, one JUnit case each, and nothing lost by a kill."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest

pytest.importorskip("bpy")
sys.path.insert(0, str(Path(__file__).parents[1]))
from disturbed import assert_same
from walks import walk

from viewcam_addon.cli import main
from viewcam_addon.commands.demo import SCENE as DEMO_SCENE

ROOT = Path(__file__).parents[2]
FLIGHT = DEMO_SCENE.with_name("flight.blend")
CORNELL = DEMO_SCENE.with_name("cornell.blend")
SMALL = ("--size", "64x36", "--threads", "1")


def check(*words):
    return main(["check", *map(str, words)])


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--frames", "1..3", "--cameras", "*"), "--frames and --cameras say each which pictures"),
        (("--cameras", "*", "--camera", "Camera"), "--cameras says the cameras itself"),
        (("--frames", "1..3", "--frame", "2"), "--frame and --frames say both which frame"),
        (("--frames", "1..3", "--difference", "a.png"), "--difference is a picture of one check"),
        (("--frames", "1..3", "--resume"), "name their folder with --report"),
        (("--frames", "3..1"), "frames 3..1 run backwards"),
        (("--cameras", "Nobody*"), "no camera is called 'Nobody*'"),
        (("--resume",), "--resume is for many checks"),
        (("--size", "65536x65536"), "need 448 GiB of memory and there are"),
        (("--workers", "2"), "--workers is for many checks"),
        (("--find", "0.5%"), "--find is of light, and level geometry has none"),
        (("--find", "0.5%", "--level", "path", "--samples", "64"), "leave --samples and --error out"),
        (("--find", "0.5%", "--level", "direct", "--error", "0.1"), "leave --samples and --error out"),
        (("--find", "0.5%", "--engine", "EEVEE"), "--find is of light"),
        *(
            (("--level", "path", f"--find={wrong}"), "is no share in percent from 0.0001% to 100%: write 0.5%")
            for wrong in ("0%", "-1%", "0.5", "nan%", "101%", "much", "1%2")
        ),
    ],
)
def test_words_that_contradict_each_other_are_one_sentence(capfd, words, sentence):
    assert check(CORNELL, *words) == 2
    output = capfd.readouterr().err
    assert sentence in output and output.count("\n") == 1, output


@pytest.mark.parametrize("name", ["scene.json", "scene.npz", "cycles.exr", "reference.exr", "everything.exr", "index.html"])
def test_a_folder_where_a_file_of_the_report_belongs_is_refused_before_anything_is_rendered(tmp_path, capfd, monkeypatch, name):
    monkeypatch.setattr("viewcam_addon.blender.rendering.cycles.render", lambda *_: pytest.fail("it is rendered"))
    (tmp_path / name).mkdir()
    assert check(CORNELL, *SMALL, "--report", tmp_path) == 2
    output = capfd.readouterr().err
    assert f"{name} is a folder" in output and output.count("\n") == 1, output
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_scene_that_was_approved_is_not_replaced_by_the_reports_own_before_it_is_read(tmp_path, capfd):
    """The picture was then compared with what the .blend holds now, and was the same whatever that was."""
    report = tmp_path / "report"
    assert main(["export", str(CORNELL), str(report / "scene.json"), "--size", "16x9"]) == 0
    before = {path.name: path.read_bytes() for path in report.iterdir()}
    words = ["--size", "16x9", "--scene", str(report / "scene.json"), "--report", f"{report}/../report"]
    assert main(["check", str(CORNELL), *words]) == 2
    assert "would be overwritten by the report's own" in capfd.readouterr().err
    assert {path.name: path.read_bytes() for path in report.iterdir()} == before


@pytest.mark.slow
def test_each_camera_is_a_shot_with_its_report_and_a_junit_case(tmp_path, capfd):
    out, junit, result = tmp_path / "out", tmp_path / "a.xml", tmp_path / "a.json"
    words = ("--cameras", "*", *SMALL, "--report", out, "--junit", junit, "--json", result)
    assert check(CORNELL, *words) == 0
    assert "1 shot, in " in capfd.readouterr().out
    (sidecar,) = (path for path in out.glob("*.json") if path.name != "summary.json")
    name, record = sidecar.stem, json.loads(sidecar.read_text(encoding="utf-8"))
    assert record["check"]["passed"] and record["check"]["answer"] == "same" and record["check"]["level"] == "geometry"
    assert record["report"] == [f"{name}.html", f"{name}.test.png"] and record["bytes"].keys() == set(record["report"])
    assert "viewcam" not in (out / f"{name}.html").read_text(encoding="utf-8").partition("check cornell.blend")[0][-20:]
    assert f'href="{name.replace(" ", "%20")}.html"' in (out / "contact-sheet.html").read_text(encoding="utf-8")
    (case,) = ElementTree.parse(junit).getroot().iter("testcase")
    assert case.get("name") == name and not [child for child in case if child.tag != "properties"]
    assert json.loads(result.read_text(encoding="utf-8"))["counts"]["checked"] == 1
    assert check(CORNELL, *words) == 2, "what is there is not written over"
    assert "--resume continues" in capfd.readouterr().err
    assert check(CORNELL, *words, "--resume") == 0
    assert "1 of them kept" in capfd.readouterr().out


@pytest.mark.slow
def test_a_picture_that_differs_fails_its_case_and_the_command(tmp_path, monkeypatch):
    from viewcam_addon.blender.jobs import stage

    render, junit = stage.cycles.render, tmp_path / "a.xml"

    def magnified(scene, layer, camera_object, *rest, **options):
        lens = scene.camera.data.lens
        scene.camera.data.lens = lens * 1.001
        try:
            render(scene, layer, camera_object, *rest, **options)
        finally:
            scene.camera.data.lens = lens

    monkeypatch.setattr(stage.cycles, "render", magnified)
    assert check(FLIGHT, "--frames", "1..2", *SMALL, "--junit", junit) == 1
    suite = next(ElementTree.parse(junit).getroot().iter("testsuite"))
    assert (suite.get("tests"), suite.get("failures")) == ("2", "2")
    assert all("Not the same picture" in failure.get("message") for failure in suite.iter("failure"))


@pytest.mark.slow
def test_a_search_for_a_bias_ends_with_the_samples_that_it_takes_and_is_kept_as_any_check(tmp_path, capfd):
    words = ("--frames", "1..1", "--size", "32x18", "--threads", "1", "--level", "path", "--find", "5%")
    out, result = tmp_path / "out", tmp_path / "a.json"
    assert check(CORNELL, *words, "--report", out, "--json", result) == 0
    assert "samples a pixel, about" in capfd.readouterr().err
    (sidecar,) = out.glob("frame_*.json")
    record = json.loads(sidecar.read_text(encoding="utf-8"))["check"]
    searched = record["figures"]["find"]
    assert searched["wanted"] == 0.05 and 0 < searched["least"] <= 0.05 and "seconds" not in searched
    assert record["figures"]["samples"] == {"reference": searched["samples"], "test": searched["samples"]}
    page = sidecar.with_suffix(".html").read_text(encoding="utf-8")
    assert f"The samples came in {searched['rounds']} rounds" in page and "for one that is off by 5 %" in page
    assert searched["samples"] == 256 and searched["rounds"] == 3 and "in 99 of 100 cases" in record["verdict"]
    assert check(CORNELL, *words, "--report", out, "--resume") == 0
    assert "1 of them kept" in capfd.readouterr().out


@pytest.mark.slow
def test_a_search_for_a_bias_ends_with_the_first_round_of_a_wrong_picture(tmp_path, monkeypatch):
    from viewcam_addon.blender.jobs import stage

    render, result, seeds = stage.cycles.render, tmp_path / "a.json", []

    def turned(scene, layer, camera_object, path, remedies, threads, light, *rest):
        seeds.append(light.seed)
        scene.camera.data.shift_x += 0.1
        try:
            render(scene, layer, camera_object, path, remedies, threads, light, *rest)
        finally:
            scene.camera.data.shift_x -= 0.1

    monkeypatch.setattr(stage.cycles, "render", turned)
    words = ("--size", "32x18", "--threads", "1", "--level", "path", "--find", "0.5%", "--seed", str(2**31 - 4))
    assert check(CORNELL, *words, "--json", result, "--report", tmp_path / "out") == 1
    searched = json.loads(result.read_text(encoding="utf-8"))["find"]
    assert (searched["samples"], searched["rounds"]) == (16, 1) and searched["seconds"] > 0
    assert len(set(seeds)) == 8
    assert len(list((tmp_path / "out").glob("cycles-*.exr"))) == 8


@pytest.mark.exhaustive
@pytest.mark.skipif(sys.platform == "win32", reason="processes are killed here as POSIX has it")
def test_killed_in_its_middle_and_continued_by_two_workers_it_is_the_same_byte_for_byte(tmp_path):
    pytest.importorskip("distributed")
    words = [
        sys.executable,
        "-m",
        "viewcam_addon",
        "check",
        FLIGHT,
        "--frames",
        "1..4",
        *SMALL,
        "--level",
        "path",
        "--samples",
        "8",
        "--clay",
    ]
    variables = os.environ | {"PYTHONPATH": str(ROOT)}
    alone, out = tmp_path / "alone", tmp_path / "out"
    subprocess.run([*words, "--report", alone], env=variables, check=True)
    with subprocess.Popen([*words, "--report", out], env=variables, start_new_session=True) as killed:
        ends = time.monotonic() + 300
        while not list(out.glob("frame_*.json")) and time.monotonic() < ends:
            time.sleep(0.05)
        os.killpg(killed.pid, signal.SIGKILL)
    assert 1 <= len(list(out.glob("frame_*.json"))) < 4, "it was not killed in its middle"
    junit = tmp_path / "a.xml"
    subprocess.run([*words, "--report", out, "--resume", "--workers", "2", "--junit", junit], env=variables, check=True)
    (out / ".viewcam.lock").unlink(missing_ok=True)
    (alone / ".viewcam.lock").unlink(missing_ok=True)
    assert_same(out, alone)
    assert len(list(ElementTree.parse(junit).getroot().iter("testcase"))) == 4


ROOMS = ("tracer", "comparison", "jobs", "blender", "commands")
STATIONS = ["commands/check.py run", "blender/jobs/renderer.py BlenderRenderer.check", "blender/jobs/checking.py Checker.check"]
STATIONS_OF_THE_TRACER = ["jobs/tracing.py _Server._compare", "tracer/render.py render", "comparison/geometry.py compare"]

# The tracer's process, which reads its request and tells its answer and its walk. It is no part of Blender's.
TRACER = """
import json, sys
from viewcam_addon.jobs import tracing
from walks import walk

answers, server = [], tracing._Server()
request = json.load(sys.stdin)
entered, upward = walk(lambda: answers.append(server.answer(request, lambda *_, **__: None)), tuple(sys.argv[1:]))
json.dump([answers[0], entered, upward], sys.stdout)
"""


def test_the_walk_of_a_check_enters_each_station_once_and_never_calls_upward(monkeypatch):
    """The walk is that of CONTRIBUTING: commands, Blender, jobs, tracer, comparison."""
    from viewcam_addon.jobs.served_renderer import BLENDER
    from viewcam_addon.jobs.tracing import Tracing

    monkeypatch.delenv(BLENDER, raising=False)
    asked = []

    def ask(_self, request):
        variables = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests")])}
        words = [sys.executable, "-c", TRACER, *ROOMS]
        done = subprocess.run(words, env=variables, input=json.dumps(request), capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        answer, *walked = json.loads(done.stdout)
        asked.append(walked)
        return answer

    monkeypatch.setattr(Tracing, "ask", ask)
    results = []
    entered, upward = walk(lambda: results.append(check(CORNELL, *SMALL)), ROOMS)
    assert results == [0]
    ((entered_there, upward_there),) = asked
    assert upward == [] == upward_there
    assert [each for each in entered if each in STATIONS] == STATIONS
    assert [each for each in entered_there if each in STATIONS_OF_THE_TRACER] == STATIONS_OF_THE_TRACER
    assert not [each for each in entered_there if each.startswith(("blender/", "commands/"))]
