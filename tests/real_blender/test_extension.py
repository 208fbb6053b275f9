"""The zip that artists install: built by a real Blender, accepted by it, and the same camera in every Blender it is for."""

import dataclasses
import json
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest

from viewcam_addon import image

ROOT = Path(__file__).resolve().parent.parent.parent

# The four values that inside_blender.py states, in numbers that float32 holds, so that no rounding differs. The file renders
# 320 × 240 at 50 %, and the stated distance counts the pixels of 100 %.
PINHOLE = {
    "eye": (4.5, -3.25, 2.125),
    "look_at": (0.25, 0.125, -0.5),
    "up": (0.0, 0.5, 2.0),
    "distance": 410.5 / 2,
    "width": 160,
    "height": 120,
}


@pytest.fixture(scope="session")
def scene_file(host):
    path = host.user_folder / "scene.blend"
    host.run_inside("make", path)
    return path


@pytest.fixture(scope="session")
def python_picture(host, scene_file):
    """The passes of the picture whose camera `apply` set."""
    path = host.user_folder / "applied.exr"
    host.run_inside("apply", scene_file, path, json.dumps(PINHOLE))
    return image.read(path).passes


def differing(first, second):
    """The names of the passes in which two pictures differ in any bit."""
    assert first.keys() == second.keys()
    return [name for name in first if not np.array_equal(first[name], second[name])]


def test_blender_accepts_the_zip(real_blender, extension_zip):
    outcome = real_blender.run("--command", "extension", "validate", extension_zip)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr


def test_the_zip_holds_the_extension_and_its_wheels_and_nothing_else(extension_zip):
    with zipfile.ZipFile(extension_zip) as archive:
        names = archive.namelist()
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    tops = {name.split("/")[0] for name in names}
    assert tops == {"__init__.py", "blender_manifest.toml", "viewcam_addon", "wheels", "README.md", "LICENSE"}
    assert not [name for name in names if "__pycache__" in name]
    # OpenEXR's and MarkupSafe's for each Python of Blender 4.2 to 5.2, the core's, Jinja2's and tqdm's for all.
    assert sorted(f"./{name}" for name in names if name.endswith(".whl")) == sorted(manifest["wheels"])
    assert len(manifest["wheels"]) == 9
    # 6.9 of its 8.0 MB are wheels: a fourth OpenEXR, or a picture among the modules, would be seen.
    assert extension_zip.stat().st_size < 9e6, f"the zip has {extension_zip.stat().st_size} bytes"


def test_it_installs_from_the_shell(real_blender):
    """install-file's status says nothing; what it left behind does."""
    folder = real_blender.user_folder / "extensions" / "user_default" / "virtual_pinhole"
    assert (folder / "viewcam_addon" / "pinhole.py").exists()
    listing = real_blender.run("--command", "extension", "list")
    assert "virtual_pinhole" in listing.stdout, listing.stdout + listing.stderr


def test_it_installs_from_the_preferences_and_registers(host, extension_zip):
    host.run_inside("install", extension_zip)


def test_installing_and_removing_it_three_times_leaves_nothing_behind(real_blender, extension_zip, tmp_path):
    """tests/test_leftovers.py does the same with wheels, and shows that what is left behind is found."""
    script = [ROOT / "tests" / "leftovers.py", "--", extension_zip, "3", ""]
    fresh = dataclasses.replace(real_blender, user_folder=tmp_path)
    outcome = fresh.run("-b", "--factory-startup", "--python", *script)
    assert outcome.returncode == 0 and "0 left behind after 3 rounds" in outcome.stdout, outcome.stdout + outcome.stderr


def test_a_checkout_linked_into_the_extensions_folder_works_without_wheels(real_blender, tmp_path):
    folder = tmp_path / "extensions" / "user_default"
    folder.mkdir(parents=True)
    (folder / "virtual_pinhole").symlink_to(ROOT)
    linked = dataclasses.replace(real_blender, user_folder=tmp_path)
    linked.run_inside("make", tmp_path / "scene.blend")
    assert (tmp_path / "scene.blend").exists()


def test_a_frame_of_the_file_is_the_picture_of_the_python_path(host, scene_file, python_picture):
    """With -f 1 and the preferences' own add-ons in a real Blender; a wheel has no command line and renders by its operator."""
    path = host.user_folder / "stated_0001.exr"
    if host.is_real:
        outcome = host.run("-b", scene_file, "-o", host.user_folder / "stated_####", "-f", "1")
        assert path.exists(), outcome.stdout + outcome.stderr
    else:
        host.run_inside("render", scene_file, path)
    stated = image.read(path).passes
    assert {"Combined", "Depth", "Position", "Normal"} <= stated.keys()
    assert differing(stated, python_picture) == []


@pytest.mark.parametrize("host", ["real"], indirect=True)
def test_a_camera_a_thousandth_of_a_pixel_off_makes_another_picture(host, scene_file, python_picture):
    path = host.user_folder / "off.exr"
    off = {**PINHOLE, "distance": PINHOLE["distance"] + 1e-3}
    host.run_inside("apply", scene_file, path, json.dumps(off))
    assert {"Depth", "Position"} <= set(differing(image.read(path).passes, python_picture))


def test_check_passes_inside_a_real_blender(real_blender, tmp_path):
    """The tracer and the comparison run as children of Blender's own Python, with the wheels out of the zip."""
    file = tmp_path / "scene.blend"
    real_blender.run_inside("make", file)
    outcome = real_blender.run(
        "-b", file, "--command", "viewcam", "check", "--json", tmp_path / "result.json", "--report", tmp_path / "report"
    )
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
    assert json.loads((tmp_path / "result.json").read_text())["exit_status"] == 0
    assert (tmp_path / "report" / "index.html").exists()


def test_light_is_the_same_within_noise_inside_a_real_blender(real_blender):
    words = ["check", "--level", "path", "--samples", "256", "--size", "48x48"]  # test-light has 1,024
    outcome = real_blender.run("-b", ROOT / "sample_scenes" / "cornell.blend", "--command", "viewcam", *words)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
    assert "The same within noise at 256 samples" in outcome.stdout, outcome.stdout


def test_bad_input_inside_a_real_blender_is_one_sentence(real_blender, tmp_path):
    file = tmp_path / "scene.blend"
    real_blender.run_inside("make", file)
    outcome = real_blender.run("-b", file, "--command", "viewcam", "check", "--camera", "Nobody")
    assert outcome.returncode == 2, outcome.stdout + outcome.stderr
    (sentence,) = [line for line in outcome.stderr.splitlines() if line.startswith("viewcam")]
    assert "Nobody" in sentence
    assert "Traceback" not in outcome.stdout + outcome.stderr
