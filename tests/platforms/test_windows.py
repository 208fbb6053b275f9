"""Windows, under wine: the core's pictures, what the add-on does with Blender 4.2 and 5.0, the wheels that its zip brings.

`make test-windows-smoke` runs what is quick here, `make test-windows` the rest as well, and the suite itself inside.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.platforms, pytest.mark.timeout(3600)]

ROOT = Path(__file__).resolve().parent.parent.parent
HASHES = Path(__file__).with_name("picture_hashes.py")
CORNELL, STUDIO = ROOT / "sample_scenes" / "cornell.blend", ROOT / "sample_scenes" / "studio.blend"
BLENDERS = ["4.2", "5.0"]


def viewcam(*words) -> None:
    subprocess.run([sys.executable, "-m", "viewcam_addon", *map(str, words)], check=True, stdout=subprocess.DEVNULL)


@pytest.fixture(scope="session")
def windows_wheels():
    """The wheels that the Windows zip brings along, the core's among them."""
    sys.path.insert(0, str(ROOT / ".ci"))
    import extension

    return [*extension.pure_wheels(), *extension.wheels_of("windows-x64"), extension.core_wheel("windows-x64", ROOT / "wheels")]


@pytest.mark.parametrize("threads", [2, 8])
def test_smoke_the_core_s_pictures_have_linux_bits_in_threads(run_emulated, sample_scenes, hashes_here, threads):
    there = json.loads(run_emulated("windows-5.0", HASHES, threads, *sample_scenes).splitlines()[-1])
    different = [name for name in hashes_here if there[name] != hashes_here[name]]
    assert there.keys() == hashes_here.keys() and not different, f"{len(different)} of {len(there)}: {different}"


def test_smoke_the_zip_s_wheels_are_installed_and_used_as_4_2_does(run_emulated, windows_wheels, tmp_path):
    """Of its Pythons' wheels, those of 3.11; and a check of a file with them and no other packages than Blender's own."""
    wheels = [wheel for wheel in windows_wheels if re.search("cp311|py3", wheel.name)]
    script = Path(__file__).with_name("wheels_in_blender.py")
    printed = run_emulated("windows-4.2-bare", script, tmp_path / "local", *wheels)
    assert "MISSING" not in printed and "FOLDER" in printed, printed
    path = re.search("FOLDER (.*?)\r?\n", printed)[1] + ";" + str(ROOT)
    result = tmp_path / "result.json"
    words = ["check", CORNELL, "--level", "path", "--samples", "16", "--json", result]
    printed = run_emulated("windows-4.2-bare", "-m", "viewcam_addon", *words, PYTHONPATH=path)
    assert json.loads(result.read_text(encoding="utf-8"))["exit_status"] == 0, printed


@pytest.mark.parametrize("blender", BLENDERS)
def test_a_studio_s_reference_has_linux_bytes_and_its_check_the_same_verdict(run_emulated, blender, tmp_path):
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    there.mkdir()
    export = ["export", STUDIO, there / "scene.json"]
    run_emulated(f"windows-{blender}", "-m", "viewcam_addon", *export)
    light = ["--level", "path", "--samples", "4", "--size", "192x108"]
    run_emulated(f"windows-{blender}", "-m", "viewcam_addon", "render", there / "scene.json", there / "out.exr", *light)
    viewcam("render", there / "scene.json", here / "out.exr", *light)
    assert (here / "out.exr").read_bytes() == (there / "out.exr").read_bytes(), "the reference has other bytes"
    check = ["check", STUDIO, "--level", "geometry", "--size", "192x108", "--json"]
    run_emulated(f"windows-{blender}", "-m", "viewcam_addon", *check, there / "check.json")
    viewcam(*check, here / "check.json")
    ours, theirs = (json.loads((folder / "check.json").read_text(encoding="utf-8")) for folder in (here, there))
    assert ours["exit_status"] == theirs["exit_status"] == 0


KILLED = """
import pathlib, subprocess, sys, time
out, *command = sys.argv[1:]
batch = subprocess.Popen([sys.executable, *command])
until = time.monotonic() + 600
while not list(pathlib.Path(out).rglob("*.exr")) and batch.poll() is None and time.monotonic() < until:
    time.sleep(0.1)
batch.kill()
print("KILLED", batch.wait())
"""
"""Kills a batch when its first picture is there."""


@pytest.mark.parametrize("blender", BLENDERS)
def test_a_batch_that_was_killed_is_finished_by_two_workers(run_emulated, blender, tmp_path):
    out = tmp_path / "out"
    batch = ["-m", "viewcam_addon", "batch", STUDIO, "--orbit", "6", "--out", out, "--size", "96x54"]
    assert "KILLED 1" in run_emulated(f"windows-{blender}", "-c", KILLED, out, *batch)
    assert 0 < len(list(out.glob("*.exr"))) < 6
    run_emulated(f"windows-{blender}", *batch, "--resume", "--workers", "2")
    assert len(list(out.glob("*.exr"))) == 6, sorted(out.rglob("*"))
