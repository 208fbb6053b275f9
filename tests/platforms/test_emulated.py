"""Pythons of other platforms, emulated (.ci/emulated.py), and what this machine computes, to compare with.

Linux on arm64, under qemu: the same bits as here (`make test-arm64`). Windows, under wine: the core's pictures, what the add-on
does with Blender 4.2 and 5.0, the wheels that its zip brings; `make test-windows-smoke` runs what is quick here, `make
test-windows` the rest as well, and the suite itself inside.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = [pytest.mark.platforms, pytest.mark.timeout(3600)]


ROOT = Path(__file__).resolve().parent.parent.parent
HASHES = Path(__file__).with_name("picture_hashes.py")
LONGEST = 1500
"""Seconds: a machine of two cores that has other work, too."""


@pytest.fixture(scope="session")
def run_emulated():
    """run_emulated(platform, arguments…) → what Python printed there; fails the test if its exit status is another."""
    import emulated

    def run(platform, *arguments, status=0, **variables):
        child = emulated.start(platform, *arguments, **variables)
        printed = child.communicate(timeout=LONGEST)[0].decode("utf-8", "replace")
        assert child.returncode == status, f"status {child.returncode}: {printed}"
        return printed

    return run


@pytest.fixture(scope="session")
def sample_scenes(tmp_path_factory):
    """Scene files of all sample scenes."""
    folder = tmp_path_factory.mktemp("scenes")
    for blend in sorted((ROOT / "sample_scenes").glob("*.blend")):
        command = [sys.executable, "-m", "viewcam_addon", "export", blend, folder / f"{blend.stem}.json"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return sorted(folder.glob("*.json"))


@pytest.fixture(scope="session")
def hashes_here(sample_scenes):
    """Hashes of the sample scenes' pictures and of the core's functions on this machine: 'scene level pass' → hash."""
    done = subprocess.run([sys.executable, HASHES, "2", *sample_scenes], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


@pytest.fixture(scope="session")
def hashes_there(run_emulated):
    """hashes_there(platform, threads, scene files): the same as hashes_here, on another platform."""

    def run(platform, threads, scenes):
        return json.loads(run_emulated(platform, HASHES, threads, *scenes).splitlines()[-1])

    return run


def test_on_arm64_every_sample_scene_has_the_same_bits_at_all_levels(sample_scenes, hashes_here, hashes_there):
    there = hashes_there("linux-arm64", 2, sample_scenes)
    assert there.keys() == hashes_here.keys()
    assert {name.split()[1] for name in there if not name.startswith("function")} == {"geometry", "direct", "path"}
    assert {name.split()[0] for name in there} >= {path.stem for path in sample_scenes}
    different = [name for name in there if there[name] != hashes_here[name]]
    assert not different, f"{len(different)} of {len(there)} are different: {different}"


def test_on_arm64_the_functions_are_as_right_as_here(run_emulated):
    printed = run_emulated("linux-arm64", "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/tracer/test_trig.py")
    assert " passed" in printed and "failed" not in printed, printed


CORNELL, STUDIO = ROOT / "sample_scenes" / "cornell.blend", ROOT / "sample_scenes" / "studio.blend"
BLENDERS = ["4.2", "5.0"]
DATASETS = {"coco": "coco.json", "panoptic": "panoptic.json", "bop": "bop", "colmap": "colmap", "kitti": "kitti"}
"""The format of a dataset of labels → the file or folder that it is written to."""


def colors_apart(name: str, contents: bytes) -> tuple[bytes, np.ndarray]:
    """A file of points without their colors, and these, (points, 3); of any other file all of it, and none.

    name : the file's name, points3D.txt of COLMAP or points3D.ply as viewcam_addon/labels writes it.
    """
    if name.endswith("points3D.ply"):
        header, body = contents.split(b"end_header\n")
        points = np.frombuffer(body, [("place", "<f4", 6), ("color", "u1", 3)])
        return header + points["place"].tobytes(), points["color"].astype(int)
    if name.endswith("points3D.txt"):
        rows = [line.split() for line in contents.splitlines()]
        points = [row for row in rows if row[0] != b"#"]
        others = b"\n".join(b" ".join(row if row[0] == b"#" else row[:4] + row[7:]) for row in rows)
        return others, np.array([row[4:7] for row in points], int)
    return contents, np.zeros((0, 3), int)


def is_same(name: str, ours: bytes | None, windows_bytes: bytes | None) -> bool:
    """True if a file's bytes are the same; of angles and rotations, all but what each system's libraries round otherwise.

    The colors of points are those of pictures to look at, and may be off by 1 of 255 as these are.
    """
    if ours == windows_bytes or ours is None or windows_bytes is None:
        return ours == windows_bytes
    (ours, colors), (windows_bytes, its_colors) = (colors_apart(name, each) for each in (ours, windows_bytes))
    if ours == windows_bytes:
        return colors.shape == its_colors.shape and bool((np.abs(colors - its_colors) <= 1).all())
    if not re.search(r"(bop/(objects|scene_gt)|transforms)\.json$", name):
        return False
    number = rb"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
    text, its_text = (re.sub(number, b"", each) for each in (ours, windows_bytes))
    figures, its_figures = (np.array(re.findall(number, each), float) for each in (ours, windows_bytes))
    return text == its_text and np.allclose(figures, its_figures, rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("color", [1, 2, None])
@pytest.mark.parametrize("name", ["points3D.txt", "sparse/0/points3D.ply"])
def test_smoke_points_are_the_same_up_to_1_of_255_of_their_colors(name, color):
    """color : the distance by which a color is off; None if a coordinate is off."""
    points = np.zeros(2, [("place", "<f4", 6), ("color", "u1", 3)])
    is_table = name.endswith(".txt")
    table = "# 3D points\n1 0.5 0.25 1 {} 0 9 0.0 1 2\n"
    ours = table.format("7 0") if is_table else b"ply\nend_header\n" + points.tobytes()
    points["color" if color else "place"][0, 0] = color or 1
    its = table.format(f"{7 + color} 0") if color else table.format("7 0").replace("0.5", "0.75")
    ours, its = (ours.encode(), its.encode()) if is_table else (ours, b"ply\nend_header\n" + points.tobytes())
    assert is_same(name, ours, its) == (color == 1)


def different_files(ours: Path, windows_folder: Path) -> list[str]:
    """Names of files that one of two folders lacks or has with other bytes.

    Left out are those that tell times and folders, and pictures to look at, in which Blender's view transform rounds otherwise.
    """
    left_out = re.compile(r"(.*/)?(contact-sheet\.html|summary\.json|\.viewcam\.lock|orbit_\d+\.(json|png)|rgb/\d+\.png)")
    contents = [
        {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        for folder in (ours, windows_folder)
    ]
    names = {name for name in contents[0].keys() | contents[1].keys() if not left_out.fullmatch(name)}
    assert names, f"{ours} and {windows_folder} hold nothing to compare"
    return sorted(name for name in names if not is_same(name, contents[0].get(name), contents[1].get(name)))


@pytest.fixture
def viewcam(run_emulated):
    """viewcam(system, blender, words…): the command, on "linux" or "windows", with a Blender as the module of Python."""

    def run(system, blender, *words):
        if system == "windows":
            run_emulated(f"windows-{blender}", "-m", "viewcam_addon", *words)
            return
        own = ROOT / ".venvs" / blender / "bin" / "python"
        command = [own if own.exists() else sys.executable, "-m", "viewcam_addon", *map(str, words)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    return run


@pytest.fixture(scope="session")
def windows_wheels():
    """The wheels that the Windows zip brings along, the core's among them."""
    import extension

    return [*extension.pure_wheels(), *extension.wheels_of("windows-x64"), extension.core_wheel("windows-x64", ROOT / "wheels")]


@pytest.mark.parametrize("threads", [2, 8])
def test_smoke_the_core_s_pictures_have_linux_bits_in_threads(sample_scenes, hashes_here, hashes_there, threads):
    there = hashes_there("windows-4.2", threads, sample_scenes)
    different = [name for name in hashes_here if there[name] != hashes_here[name]]
    assert there.keys() == hashes_here.keys() and not different, f"{len(different)} of {len(there)}: {different}"


def test_smoke_the_zip_s_wheels_are_installed_and_used_as_4_2_does(run_emulated, windows_wheels, tmp_path):
    """The wheels of Python 3.11 are installed; and a file is checked with them and no other packages than Blender's own."""
    from emulated import of_windows

    wheels = [of_windows(wheel) for wheel in windows_wheels if re.search("cp311|py3", wheel.name)]
    script = Path(__file__).with_name("wheels_in_blender.py")
    printed = run_emulated("windows-4.2-bare", script, of_windows(tmp_path / "local"), *wheels)
    assert "MISSING" not in printed and "FOLDER" in printed, printed
    path = re.search("FOLDER (.*?)\r?\n", printed)[1] + ";" + of_windows(ROOT)
    result = tmp_path / "result.json"
    words = ["check", CORNELL, "--level", "path", "--samples", "16", "--size", "96x96", "--json", result]
    printed = run_emulated("windows-4.2-bare", "-m", "viewcam_addon", *words, PYTHONPATH=path)
    assert json.loads(result.read_text(encoding="utf-8"))["exit_status"] == 0, printed


@pytest.mark.parametrize("level", ["geometry", "path"])
@pytest.mark.parametrize("blender", BLENDERS)
def test_a_check_of_the_studio_has_linux_verdict(viewcam, blender, level, tmp_path):
    verdicts = {}
    for system in ("linux", "windows"):
        result = tmp_path / f"{system}.json"
        viewcam(system, blender, "check", STUDIO, "--level", level, "--samples", "16", "--size", "192x108", "--json", result)
        result = json.loads(result.read_text(encoding="utf-8"))
        parts = result["passes" if level == "geometry" else "quantities"]
        verdicts[system] = [result["answer"], *((each["name"], each["ok"]) for each in parts)]
    assert verdicts["windows"] == verdicts["linux"]


@pytest.mark.parametrize("blender", BLENDERS)
def test_the_studio_s_reference_labels_and_datasets_have_linux_bytes(viewcam, blender, tmp_path):
    """Both read one scene file: Blender for Windows itself computes some coordinates and normals with other last bits."""
    scene = tmp_path / "scene.json"
    viewcam("windows", blender, "export", STUDIO, scene)
    for system in ("linux", "windows"):
        folder = tmp_path / system
        light = ["--level", "path", "--samples", "4", "--size", "192x108"]
        viewcam(system, blender, "render", scene, folder / "reference.exr", *light)
        labels = ["--size", "192x108", "--labels", "depth,normals,position,masks,amodal,coverage"]
        viewcam(system, blender, "render", scene, folder / "labels" / "still.exr", *labels)
        for name in ("coco", "panoptic", "bop"):
            viewcam(system, blender, "labels", folder / "labels", folder / DATASETS[name], "--to", name)
    assert different_files(tmp_path / "linux", tmp_path / "windows") == []


def test_none_of_fifty_processes_crashes_in_two_to_eight_threads(sample_scenes, hashes_here, hashes_there):
    """A loader places a thread's storage amiss in some processes only."""
    (cornell,) = (path for path in sample_scenes if path.stem == "cornell")
    expected = {name: value for name, value in hashes_here.items() if name.startswith(("cornell ", "function "))}
    for run in range(50):
        threads = 2 + run % 7
        assert hashes_there("windows-5.0", threads, [cornell]) == expected, f"in {threads} threads, run {run}"


KILLED = """
import pathlib, subprocess, sys, time
out, *command = sys.argv[1:]
batch = subprocess.Popen([sys.executable, *command])
until = time.monotonic() + 600
while not list(pathlib.Path(out).glob("orbit_???.exr")) and batch.poll() is None and time.monotonic() < until:
    time.sleep(0.1)
batch.kill()
print("KILLED", batch.wait())
"""
"""Kills a batch when its first picture is there."""


@pytest.mark.parametrize("blender", BLENDERS)
def test_a_batch_that_was_killed_and_is_finished_by_two_workers_has_linux_pictures_labels_and_datasets(
    run_emulated, viewcam, blender, tmp_path
):
    """The Cornell box is taken, since Blender computes nothing of its geometry."""
    reference = ["--engine", "VIEWCAM", "--level", "path", "--samples", "4", "--labels", "all", "--transforms", "exr"]
    batch = ["batch", CORNELL, "--orbit", "6", "--size", "96x54", *reference, "--check", "--out"]
    linux, windows = tmp_path / "linux", tmp_path / "windows"
    viewcam("linux", blender, *batch, linux / "batch")
    out = windows / "batch"
    assert "KILLED 1" in run_emulated(f"windows-{blender}", "-c", KILLED, out, "-m", "viewcam_addon", *batch, out)
    assert 0 < len(list(out.glob("orbit_???.exr"))) < 6, sorted(out.iterdir())
    viewcam("windows", blender, *batch, out, "--resume", "--workers", "2")
    for system, folder in (("linux", linux), ("windows", windows)):
        for name, target in DATASETS.items():
            viewcam(system, blender, "labels", folder / "batch", folder / target, "--to", name)
    assert different_files(linux, windows) == []


@pytest.mark.parametrize("blender", BLENDERS)
def test_a_batch_of_the_studio_passes_its_checks_in_two_workers(viewcam, blender, tmp_path):
    batch = ["batch", STUDIO, "--orbit", "4", "--size", "96x54", "--samples", "1", "--check", "--workers", "2"]
    viewcam("windows", blender, *batch, "--json", tmp_path / "result.json", "--out", tmp_path / "out")
    assert json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))["exit_status"] == 0
    assert len(list((tmp_path / "out").glob("orbit_???.exr"))) == 4
