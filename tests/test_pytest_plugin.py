"""pytest-viewcam as its users have it: tests of tests, run by pytest's own `pytester`."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np  # noqa: F401 - before pytester, which forgets what is imported while it runs
import pytest

from viewcam_addon import junit, pytest_plugin
from viewcam_addon.cli import main
from viewcam_addon.errors import InputError
from viewcam_addon.jobs import check as checks

pytest_plugins = ["pytester"]

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")
VERDICT = "Not the same picture: all of it is blue."


@pytest.fixture
def run(pytester, monkeypatch):
    """Runs pytest with nothing but this plugin, on a test file with this text."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")

    def run(text, *words):
        pytester.makepyfile(test_shots=text)
        return pytester.runpytest_inprocess("-p", pytest_plugin.__name__, "--strict-markers", *words)

    return run


@pytest.fixture
def asked(monkeypatch):
    """The questions put to jobs.check, none of which is done; blue.blend fails, and none.blend is not there."""
    calls = []

    def answer(name):
        def call(*paths, **options):
            calls.append((name, [str(path) for path in paths], options))
            if "none.blend" in str(paths[0]):
                raise InputError("none.blend is not there: give another")
            passed = "blue" not in str(paths[0])
            answer = "same" if passed else "different"
            figures = {"answer": answer, "passed": passed, "passes": [{"name": "Depth", "max": 0.5}]}
            return checks.Check(passed, "fine" if passed else VERDICT, figures)

        return call

    for name in ("check", "compare"):
        monkeypatch.setattr(checks, name, answer(name))
    return calls


def test_a_failure_is_the_verdict_and_where_the_report_is_and_no_traceback(run, asked, pytester):
    outcome = run("def test_it(viewcam_check): viewcam_check('blue.blend')", "--viewcam-report", "out")
    outcome.assert_outcomes(failed=1)
    output = outcome.stdout.str()
    report = pytester.path / "out" / "test_shots.py-test_it"
    assert (
        VERDICT in output
        and f"report: {report / 'index.html'}" in output
        and "Traceback" not in output
        and "def test_it" not in output
    )
    assert asked == [("check", [str(pytester.path / "blue.blend")], {"report": report})]


def test_options_are_those_of_the_command_and_marks_give_them_for_all(run, asked, pytester):
    text = """
        import pytest
        pytestmark = pytest.mark.viewcam(level="path", samples=64)
        @pytest.mark.viewcam(level="direct")
        def test_it(viewcam_check, same_picture):
            viewcam_check("a.blend", samples=8, clay=True, camera=None, strict=False, scene="a.json")
            same_picture("a.exr", "b.exr", "c.exr", threads=3, level=None, samples=None)
    """
    run(text).assert_outcomes(passed=1)
    here = pytester.path
    options = {"level": "direct", "samples": 8, "clay": True, "scene": here / "a.json"}
    assert asked == [
        ("check", [str(here / "a.blend")], options),
        ("compare", [str(here / name) for name in ("a.exr", "b.exr", "c.exr")], {"threads": 3}),
    ]


def test_tests_that_judge_pictures_can_be_left_out(run, asked):
    outcome = run("def test_a(viewcam_check): viewcam_check('a.blend')\ndef test_b(): pass", "-m", "not viewcam")
    outcome.assert_outcomes(passed=1, deselected=1)
    assert not asked


def test_bad_input_is_its_sentence(run, asked):
    outcome = run("def test_it(viewcam_check): viewcam_check('none.blend')")
    outcome.assert_outcomes(failed=1)
    assert "none.blend is not there: give another" in outcome.stdout.str() and "Traceback" not in outcome.stdout.str()


def test_figures_are_properties_of_the_test_in_the_form_that_junit_has(run, asked, pytester, tmp_path):
    text = """
        def test_twice(viewcam_check):
            viewcam_check('a.blend')
            viewcam_check('blue.blend')
    """
    run(text, "--junit-xml=a.xml").assert_outcomes(failed=1)
    root = ElementTree.parse(pytester.path / "a.xml").getroot()
    properties = {each.get("name"): each.get("value") for each in root.iter("property")}
    assert (
        properties["viewcam.passed"] == "true"
        and properties["viewcam-2.passed"] == "false"
        and properties["viewcam-2.passes.Depth.max"] == "0.5"
    )
    # The file of --junit has the same elements, and no attribute that pytest's has not.
    junit.write(tmp_path / "b.xml", "check", 1, {"sentence": VERDICT}, 1.0)
    expected = {each.tag: set(each.attrib) for each in root.iter()}
    for each in ElementTree.parse(tmp_path / "b.xml").getroot().iter():
        assert set(each.attrib) <= expected[each.tag], each.tag
    (failure,) = root.iter("failure")
    assert VERDICT in failure.get("message")


def test_pictures_are_judged_for_real(run, pytester):
    camera = {"eye": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "distance": 100, "width": 32, "height": 24}
    scene = {
        "format": "virtual-pinhole-scene",
        "version": 1,
        "camera": camera,
        "geometries": {"ball": {"type": "spheres", "centers": [[0, 0, 0]], "radii": [1]}},
        "objects": [{"name": "Ball", "geometry": "ball", "object_index": 3}],
    }
    for name, distance in (("a", 100), ("b", 100.1)):
        (pytester.path / f"{name}.json").write_text(json.dumps(scene | {"camera": camera | {"distance": distance}}))
        assert main(["render", str(pytester.path / f"{name}.json"), str(pytester.path / f"{name}.exr")]) == 0
    text = "def test_it(same_picture): assert same_picture('a.exr', 'a.exr').passed; same_picture('a.exr', 'b.exr')"
    outcome = run(text, "--viewcam-report=out")
    outcome.assert_outcomes(failed=1)
    assert "Not the same picture: positions are" in outcome.stdout.str()
    assert (pytester.path / "out" / "test_shots.py-test_it-2" / "index.html").is_file()


def test_loading_it_brings_nothing_along_that_takes_time():
    """It is imported in every run of pytest in its environment."""
    code = (
        "import sys, pytest; before = set(sys.modules); import viewcam_addon.pytest_plugin; print(*set(sys.modules) - before)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True)
    assert set(done.stdout.split()) == {"viewcam_addon", "viewcam_addon.pytest_plugin"}


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_action_of_the_page_checks_every_file_and_fails_if_one_does(tmp_path):
    import yaml

    action = yaml.safe_load(*blocks("yaml"))
    assert action["runs"]["using"] == "composite" and set(action["inputs"]) == {"files", "options"}
    install, check, upload = action["runs"]["steps"]
    assert install["shell"] == check["shell"] == "bash" and upload["if"] == "always()"
    log, stub = tmp_path / "said", tmp_path / "viewcam"
    stub.write_text(f'#!/bin/sh\necho "$@" >> "{log}"\ncase $2 in *bad*) exit 1 ;; esac\n')
    stub.chmod(0o755)
    assert set(check["env"].values()) == {"${{ inputs.files }}", "${{ inputs.options }}"}
    for files, status in (("a.blend bad.blend c.blend", 1), ("a.blend", 0)):
        environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "FILES": files, "OPTIONS": "--size 8x8"}
        # GitHub runs bash with these words.
        done = subprocess.run(
            ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", check["run"]], env=environment, cwd=tmp_path
        )
        assert done.returncode == status
    to = "viewcam-report/{0}"
    expected = [
        f"check {n}.blend --size 8x8 --report {to.format(n)} --junit {to.format(n)}.xml" for n in ("a", "bad", "c", "a")
    ]
    assert log.read_text().splitlines() == expected


# Three files of a user, a ball on a floor under a sun each, and what breaks them. Where the add-on is enabled the four values
# would follow the constraint: it is added where it is not.
MAKE = """
import os, sys
import bpy
import viewcam_addon
from viewcam_addon.blender.camera import apply
from viewcam_addon.pinhole import Pinhole

viewcam_addon.register()
for name in ("hall", "table", "lamp"):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, location=(0, 0, 1))
    bpy.ops.mesh.primitive_plane_add(size=20)
    scene, ball = bpy.context.scene, bpy.data.objects["Sphere"]
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    sun.data.angle, sun.rotation_euler = 0, (0.5, 0.3, 0)
    for each in (sun, camera):
        scene.collection.objects.link(each)
    scene.camera, scene.render.resolution_x, scene.render.resolution_y = camera, 64, 36
    apply(camera, Pinhole((0, -8, 3), (0, 0, 1), (0, 0, 1), 90, 64, 36), scene)
    bpy.ops.wm.save_as_mainfile(filepath=f"{name}.blend")
    viewcam_addon.unregister()
    if name == "hall":
        limit = camera.constraints.new("LIMIT_LOCATION")
        limit.use_max_z, limit.max_z = True, 2.999
    elif name == "table":
        ball.location.x += 0.01
    else:
        sun.data.energy *= 0.99
    bpy.ops.wm.save_as_mainfile(filepath=f"broken/{name}.blend", copy=True)
    viewcam_addon.register()
sys.stdout.flush()
os._exit(0)
"""


@pytest.mark.exhaustive
def test_from_a_wheel_in_an_environment_of_its_own_three_broken_files_fail_with_a_sentence_each(tmp_path):
    """The page's ten lines. What the project depends on is what is installed here; the project is what its wheel brings."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    subprocess.run([*pip, "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", tmp_path, ROOT], check=True)
    (wheel,) = tmp_path.glob("*.whl")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "fresh"], check=True)
    (site,) = (tmp_path / "fresh" / "lib").glob("*/site-packages")
    subprocess.run([*pip, "install", "-q", "--no-deps", "--target", site, wheel], check=True)
    # Only what stands in this folder is found of it: a .pth there, which is how the project itself is installed, is not read.
    (site / "dependencies.pth").write_text(str(Path(pytest.__file__).parents[1]), encoding="utf-8")
    folder = tmp_path / "shots"
    broken = folder / "broken"
    broken.mkdir(parents=True)
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "PYTEST"))}

    def run(*words):
        command = [str(word) for word in (tmp_path / "fresh" / "bin" / "python", *words)]
        return subprocess.run(command, cwd=folder, env=clean, capture_output=True, text=True)

    process = run("-c", MAKE)
    assert process.returncode == 0, process.stderr
    for name in ("table", "lamp"):
        done = run("-m", "viewcam_addon", "export", f"{name}.blend", f"{name}.json", "--level", "direct")
        assert done.returncode == 0, done.stderr
        for file in folder.glob(f"{name}.[jn]*"):
            shutil.copy(file, broken)
    (text,) = blocks("python")
    for each in (folder, broken):
        (each / "test_shots.py").write_text(text.replace(', size="320x180"', ""), encoding="utf-8")
    only = ("-m", "pytest", "-p", "no:cacheprovider", "-p", "no:hypothesispytest", "-p", "no:xdist")
    good = run(*only, "test_shots.py", "--junit-xml=good.xml")
    assert good.returncode == 0, good.stdout
    run(*only, "broken/test_shots.py", "--junit-xml=bad.xml", "--viewcam-report=reports")
    cases = list(ElementTree.parse(folder / "bad.xml").getroot().iter("testcase"))
    sentences = [case.find("failure").get("message").splitlines()[0].removeprefix("Failed: ") for case in cases]
    camera, table, lamp = sentences
    assert "the camera in Blender is" in camera and "from the stated one" in camera, sentences
    assert table.startswith("Not the same picture: ") and "pixels see another surface" in table, sentences
    assert lamp.startswith("Different here: ") and "1.00 % darker" in lamp, sentences
    assert len(list((folder / "reports").glob("*/index.html"))) == 3
