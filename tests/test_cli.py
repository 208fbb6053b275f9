"""The command as its users type it: one sentence and an exit status for every bad input, and nothing half-written."""

import importlib
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from viewcam_addon import api, cameras, commands, image
from viewcam_addon.cli import main
from viewcam_addon.commands.demo import SCENE as DEMO_SCENE
from viewcam_addon.errors import InputError, counted
from viewcam_addon.jobs.folder import Folder
from viewcam_addon.pinhole import Pinhole

CAMERA = {"eye": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "distance": 100, "width": 64, "height": 48}
SCENE = {
    "format": "virtual-pinhole-scene",
    "version": 1,
    "camera": CAMERA,
    "geometries": {"ball": {"type": "spheres", "centers": [[0, 0, 0]], "radii": [1]}},
    "objects": [{"name": "Ball", "geometry": "ball", "object_index": 3}],
}

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such pipes, devices, limits and closed streams")


def fails(capfd, *arguments, status=2):
    """Run viewcam; it must fail with one line on stderr, which is returned."""
    assert main([str(word) for word in arguments]) == status
    lines = capfd.readouterr().err.strip().splitlines()
    assert len(lines) == 1, f"one line on stderr, not {lines}"
    assert "bug" not in lines[0], lines[0]
    return lines[0]


def write_scene(folder, **changes):
    path = folder / "scene.json"
    path.write_text(json.dumps(SCENE | changes))
    return path


def without(mapping, key):
    return {name: value for name, value in mapping.items() if name != key}


def test_a_command_imports_what_other_commands_need_for_no_one(tmp_path):
    words = ["render", str(write_scene(tmp_path)), str(tmp_path / "out.exr")]
    code = f"import sys; from viewcam_addon.cli import main; assert main({words}) == 0; print(*sys.modules, sep='\\n')"
    imported = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    needless = [name for name in imported if name.startswith(("viewcam_addon.cameras", "viewcam_addon.jobs"))]
    assert not needless, f"viewcam render has imported {', '.join(needless)}, which takes time at every start"


def test_a_scene_written_by_hand_is_traced_and_compared_with_itself(tmp_path, capfd):
    scene, picture = write_scene(tmp_path), tmp_path / "out.exr"
    assert main(["render", str(scene), str(picture), "--json", str(tmp_path / "render.json")]) == 0
    traced = image.read(picture)
    assert traced["Object Index"][24, 32, 0] == 3
    assert traced["Depth"][24, 32, 0] == pytest.approx(4, abs=1e-3)
    assert json.loads((tmp_path / "render.json").read_text())["exit_status"] == 0
    result = tmp_path / "compare.json"
    assert main(["compare", str(picture), str(picture), "--scene", str(scene), "--json", str(result)]) == 0
    assert json.loads(result.read_text())["passed"] is True
    assert capfd.readouterr().err == ""


def test_what_differs_is_drawn_where_it_is_wanted(tmp_path):
    scene, picture, drawn = write_scene(tmp_path), tmp_path / "out.exr", tmp_path / "new" / "difference.png"
    assert main(["render", str(scene), str(picture)]) == 0
    result = tmp_path / "compare.json"
    assert main(["compare", str(picture), str(picture), "--difference", str(drawn), "--json", str(result)]) == 0
    assert drawn.read_bytes().startswith(b"\x89PNG")
    record = json.loads(result.read_text())["difference"]
    assert record["image"] == str(drawn) and "px off" in record["colors"]


def test_two_cameras_a_pixel_apart_are_not_the_same_picture(tmp_path, capfd):
    for name, look_at in (("a", [0, 0, 0]), ("b", [0.05, 0, 0])):
        (tmp_path / name).mkdir()
        scene = write_scene(tmp_path / name, camera=CAMERA | {"look_at": look_at})
        assert main(["render", str(scene), str(tmp_path / f"{name}.exr")]) == 0
    report, result = tmp_path / "report", tmp_path / "result.json"
    words = ["compare", str(tmp_path / "a.exr"), str(tmp_path / "b.exr"), "--report", str(report), "--json", str(result)]
    assert main(words) == 1
    assert "Not the same picture" in capfd.readouterr().out
    assert json.loads(result.read_text())["exit_status"] == 1
    assert "Not the same picture" in (report / "index.html").read_text(encoding="utf-8")


def test_what_is_not_modeled_is_named_with_its_share_and_fails_under_strict(tmp_path, capfd):
    ledger = [
        {"object": "Ball", "status": "approximated", "reason": "is made of jelly"},
        {"object": "Sun", "status": "exported"},
    ]
    scene, picture = write_scene(tmp_path, ledger=ledger), str(tmp_path / "a.exr")
    assert main(["render", str(scene), picture]) == 0
    words = ["compare", picture, picture, "--scene", str(scene), "--json", str(tmp_path / "a.json")]
    words += ["--junit", str(tmp_path / "a.xml"), "--report", str(tmp_path / "report")]
    for strict, status in (([], 0), (["--strict"], 3)):
        assert main(words + strict) == status
        record = json.loads((tmp_path / "a.json").read_text())
        assert (record["exit_status"], record["answer"], record["passed"]) == (status, "same_but", True)
        seen = (image.read(picture)["Object Index"] == 3).mean()
        assert record["not_modeled"] == {
            "count": 1,
            "names": ["Ball"],
            "in_one_place": [],
            "seen_otherwise": [],
            "share": seen,
            "shown": seen,
        }
        assert f"but for 1 object that is not modeled (Ball; {100 * seen:.2g} % of the picture)" in capfd.readouterr().out
        page = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
        assert 'class="same_but"' in page and "but for 1 object that is not modeled" in page
        assert ("<failure" in (tmp_path / "a.xml").read_text()) == bool(strict)


def test_a_picture_of_nothing_is_no_answer_and_says_what_to_look_for(tmp_path, capfd):
    scene, picture = write_scene(tmp_path, camera=CAMERA | {"look_at": [0, -9, 0]}), tmp_path / "a.exr"
    assert main(["render", str(scene), str(picture)]) == 0
    capfd.readouterr()
    line = fails(capfd, "compare", picture, picture, "--scene", scene, "--report", tmp_path / "report")
    assert "Nothing to compare" in line and all(word in line for word in ("frame", "view layer", "clipping")), line
    assert not (tmp_path / "report").exists()


def test_a_picture_whose_light_is_all_a_renderers_choice_is_no_answer_in_shell_json_junit_and_python(tmp_path, capfd):
    """A room that is lit by a lamp in the plane of its ceiling alone; a renderer to which the ceiling hides half of that."""

    def room(power):
        square = {"type": "plane", "edges": [[6, 0, 0], [0, 6, 0]]}
        geometries = {"floor": {**square, "corner": [-3, -3, -1]}, "ceiling": {**square, "corner": [-3, -3, 1]}}
        lamp = {
            "type": "area",
            "name": "Lamp",
            "location": [0, 0, 1],
            "size": [1, 1],
            "power": [power] * 3,
            "hidden_from": ["camera"],
        }
        objects = [{"name": name.capitalize(), "geometry": name, "materials": ["matte"]} for name in geometries]
        changes = {
            "geometries": geometries,
            "objects": objects,
            "lamps": [lamp],
            "materials": {"matte": {"diffuse": [0.6] * 3}},
        }
        return write_scene(tmp_path, **changes)

    def traced(name, seed):
        words = ["--level", "direct", "--samples", "16", "--seed", str(seed)]
        assert main(["render", str(scene), str(tmp_path / name), *words]) == 0
        return str(tmp_path / name)

    scene = room(50)
    others = [traced(f"{seed}.exr", seed) for seed in (2, 3)]
    scene = room(100)
    sides = [traced("reference.exr", 1), *others]
    capfd.readouterr()
    report, result, junit = (tmp_path / name for name in ("report", "out.json", "out.xml"))
    line = fails(capfd, "compare", *sides, "--scene", scene, "--report", report, "--json", result, "--junit", junit)
    assert "Nothing to compare: 100 % of the pixels with light" in line and "('Ceiling' and 'Lamp')" in line, line
    record = json.loads(result.read_text())
    assert record["exit_status"] == 2 and "Nothing to compare" in record["error"], record
    assert "<error" in junit.read_text(encoding="utf-8") and "Nothing to compare" in junit.read_text(encoding="utf-8")
    assert not report.exists()
    with pytest.raises(InputError, match="Nothing to compare"):
        api.compare(sides[0], sides[1:], scene)


def test_the_size_and_the_stated_camera_can_be_chosen(tmp_path, capfd):
    scene = write_scene(tmp_path, stated_camera=CAMERA | {"distance": 50})
    assert main(["render", str(scene), str(tmp_path / "a.exr"), "--size", "32x24"]) == 0
    assert image.read(tmp_path / "a.exr").size == (32, 24)
    assert main(["compare", str(tmp_path / "a.exr"), str(tmp_path / "a.exr"), "--scene", str(scene)]) == 0
    assert main(["render", str(scene), str(tmp_path / "b.exr"), "--stated"]) == 0
    assert image.read(tmp_path / "b.exr").camera.distance == (50, 50)
    assert "stated_camera" in fails(capfd, "render", write_scene(tmp_path), tmp_path / "c.exr", "--stated")


def test_the_origin_of_a_recentered_scene_is_told(tmp_path, capfd):
    scene, picture = write_scene(tmp_path, origin=[4200952.125, 0, -2]), tmp_path / "out.exr"
    assert main(["render", str(scene), str(picture)]) == 0
    report, result = tmp_path / "report", tmp_path / "result.json"
    words = ["compare", picture, picture, "--scene", scene, "--report", report, "--json", result]
    assert main([str(word) for word in words]) == 0
    assert json.loads(result.read_text())["origin"] == [4200952.125, 0, -2]
    assert "<td>4200952.125</td>" in (report / "index.html").read_text(encoding="utf-8")


def test_a_camera_far_from_the_origin_is_told_to_recenter(tmp_path, capfd):
    """Positions in float32 are half a unit apart at 5e6: so much of the tracer's own picture is rounded away."""
    camera = CAMERA | {"eye": [5e6, -5, 0], "look_at": [5e6, 0, 0]}
    scene = write_scene(tmp_path, camera=camera, objects=[{"name": "Ball", "geometry": "ball", "location": [5e6, 0, 0]}])
    picture, result = tmp_path / "out.exr", tmp_path / "result.json"
    assert main(["render", str(scene), str(picture)]) == 0
    main(["compare", str(picture), str(picture), "--scene", str(scene), "--json", str(result)])
    far = json.loads(result.read_text())["far_from_origin"]
    assert far["error"] > 0.1 and far["away"] == pytest.approx(5e6)
    assert far["sentence"] in capfd.readouterr().out and "--recenter" in far["sentence"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"camera": without(CAMERA, "eye")}, ["camera", "eye"]),
        ({"camera": CAMERA | {"look_at": CAMERA["eye"]}}, ["camera", "eye", "look_at", "same point"]),
        ({"camera": CAMERA | {"up": [0, 0, 0]}}, ["camera", "up"]),
        ({"camera": CAMERA | {"eye": [0, float("nan"), 0]}}, ["NaN", "finite"]),
        ({"camera": CAMERA | {"distance": 0}}, ["camera", "distance", "0"]),
        ({"camera": CAMERA | {"distance": "far"}}, ["camera", "distance"]),
        ({"camera": CAMERA | {"width": 1.5}}, ["camera", "width"]),
        ({"version": 99}, ["version", "99"]),
        ({"objects": [{"name": "Ball", "geometry": "none"}]}, ["Ball", "none"]),
        ({"objects": "Ball"}, ["objects"]),
        ({"geometries": {"ball": {"type": "spheres", "centers": [[0, 0, 0]]}}}, ["ball", "radii"]),
        ({"geometries": {"ball": {"type": "spheres", "centers": [[0, 0]], "radii": [1]}}}, ["ball", "centers"]),
        ({"geometries": {"ball": {"type": "cube"}}}, ["ball", "cube"]),
        ({"surprise": 1}, ["surprise"]),
        ({"arrays": "../elsewhere.npz"}, ["arrays", "../elsewhere.npz"]),
    ],
)
def test_a_wrong_scene_file_is_refused_by_the_key_that_is_wrong(tmp_path, capfd, changes, words):
    line = fails(capfd, "render", write_scene(tmp_path, **changes), tmp_path / "out.exr")
    assert all(word in line for word in ["scene.json", *words]), line
    assert not (tmp_path / "out.exr").exists()


def test_a_scene_file_that_is_no_json_or_not_there_is_refused(tmp_path, capfd):
    (tmp_path / "broken.json").write_text('{"version": 1,')
    assert "broken.json" in fails(capfd, "render", tmp_path / "broken.json", tmp_path / "out.exr")
    assert "none.json" in fails(capfd, "render", tmp_path / "none.json", tmp_path / "out.exr")


class Exploit:
    """A pickle that makes a folder on being read."""

    def __reduce__(self):
        return (os.mkdir, ("was-executed",))


def test_an_npz_with_pickled_objects_is_refused_and_nothing_of_it_runs(tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.savez(tmp_path / "scene.npz", centers=np.array([Exploit()], dtype=object))
    ball = {"type": "spheres", "centers": {"npz": "centers"}, "radii": [1]}
    scene = write_scene(tmp_path, geometries={"ball": ball}, arrays="scene.npz")
    line = fails(capfd, "render", scene, tmp_path / "out.exr")
    assert "centers" in line and "object" in line, line
    assert not (tmp_path / "was-executed").exists()


def test_pictures_that_can_not_be_compared_are_refused(tmp_path, capfd):
    for name, size in (("small", "32x24"), ("large", "64x48")):
        assert main(["render", str(write_scene(tmp_path)), str(tmp_path / f"{name}.exr"), "--size", size]) == 0
    small, large = tmp_path / "small.exr", tmp_path / "large.exr"
    assert "32 × 24" in fails(capfd, "compare", large, small)
    (tmp_path / "cut.exr").write_bytes(large.read_bytes()[:2000])
    assert "cut.exr" in fails(capfd, "compare", large, tmp_path / "cut.exr")
    image.write(tmp_path / "bare.exr", image.Image({"Depth": np.ones((48, 64, 1), np.float32)}))
    assert "'Position'" in fails(capfd, "compare", large, tmp_path / "bare.exr")
    assert "--scene" in fails(capfd, "compare", tmp_path / "bare.exr", large)
    assert "none.exr" in fails(capfd, "compare", tmp_path / "none.exr", large)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "COMMAND"),
        (["paint"], "paint"),
        (["render"], "SCENE.json"),
        (["render", "a", "b", "--size", "3"], "'3' is no size"),
        (["render", "a", "b", "--size", "0x3"], "'0'"),
        (["compare", "a", "b", "--difference", "d.jpg"], "'d.jpg' is drawn as PNG"),
        (["render", "a", "b", "--threads", "none"], "'none'"),
        (["render", "a", "b", "--level", "magic"], "magic"),
        (["check", "a.blend", "--frame", "1.5"], "1.5"),
        (["check", "a.blend", "--frame", "1_0"], "'1_0' is no whole number"),
        (["check", "a.blend", "--find", "1e-300%", "--level", "path"], "is no share in percent from 0.0001%"),
        (["render", "a", "b", "--threads", "5000"], "'5000' is no whole number from 1 to 1024"),
        (["render", "a", "b", "--samples", "9" * 5000], "9'… is no whole number above 0"),
        (["render", "a", "b", "--error", "1_0"], "'1_0' is no number above 0"),
        (["render", "a", "b", "--labels", ","], "',' names none"),
        (["render", "a", "b", "--recenter"], "--recenter"),  # a scene file has its origin already
    ],
)
def test_wrong_usage_is_one_line_that_says_where_help_is(capfd, words, expected):
    line = fails(capfd, *words)
    assert expected in line and "--help" in line and len(line) < 300, line


@pytest.mark.parametrize(
    "words",
    [
        ["render", "scene.json", "scene.json"],
        ["render", "scene.json", "./new.exr", "--json", "new.exr"],
        ["render", "scene.json", "new.exr", "--json", "link.json"],
        ["compare", "picture.exr", "other.exr", "--json", "other.exr"],
        ["compare", "picture.exr", "other.exr", "--scene", "scene.json", "--junit", "scene.json"],
        ["compare", "picture.exr", "other.exr", "--json", "new", "--junit", "new"],
        ["export", "file.blend", "file.blend"],
        ["cycles", "file.blend", "file.blend"],
        ["check", "file.blend", "--json", "file.blend"],
        ["batch", "file.blend", "--orbit", "2", "--out", "new", "--json", "file.blend"],
        ["labels", "shots", "shots", "--to", "bop", "--overwrite"],
        ["labels", "shots", "shots/a.labels.json"],
        ["labels", "shots", "shots/a.exr", "--to", "tracks"],
        ["camera", "scene.json", "--to", "look_at", "--out", "./scene.json"],
    ],
    ids=" ".join,
)
def test_nothing_is_written_over_what_is_read_or_over_another_output(tmp_path, capfd, monkeypatch, words, symlink):
    """viewcam export file.blend file.blend left a scene file in place of the .blend."""
    monkeypatch.chdir(tmp_path)
    write_scene(tmp_path)
    Path("shots").mkdir()
    for name in ("picture.exr", "other.exr", "file.blend", "shots/a.labels.json", "shots/a.exr"):
        Path(name).write_bytes(name.encode())
    symlink(tmp_path / "link.json", tmp_path / "scene.json")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert "give" in (line := fails(capfd, *words)) and "name" in line, line
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("words", ["compare FILE FILE", "labels FILE new", "render FILE new", "camera FILE"])
def test_a_name_that_no_file_can_have_is_no_bug(capfd, words):
    line = fails(capfd, *("a" * 300 if word == "FILE" else word for word in words.split()))
    assert "File name too long" in line or sys.platform == "win32", line


def limit_files_to_4_kilobytes():
    import resource

    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))


def viewcam(*words, **options):
    command = [sys.executable, "-m", "viewcam_addon", *map(str, words)]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent.parent)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, **options)


@posix
def test_a_picture_that_can_not_grow_leaves_nothing_behind(tmp_path):
    """A full disk, where nobody may mount one: the tracer's pictures and, where Blender is there, Cycles'."""
    jobs = [("render", write_scene(tmp_path))]
    if importlib.util.find_spec("bpy"):
        jobs.append(("cycles", DEMO_SCENE, "--size", "160x90"))
    out = tmp_path / "out"
    for command, source, *rest in jobs:
        done = viewcam(command, source, out / "picture.exr", *rest, preexec_fn=limit_files_to_4_kilobytes)
        assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
        assert "picture.exr can't be written" in done.stderr
        assert list(out.iterdir()) == []


def test_lines_that_nobody_reads_change_no_status_and_the_picture_is_there(tmp_path):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "viewcam_addon", "render", write_scene(tmp_path), tmp_path / "picture.exr"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent.parent), "PYTHONUNBUFFERED": ""}
    done = subprocess.run(command, env=environment, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")
    assert image.read(tmp_path / "picture.exr").size


@pytest.mark.parametrize("closed", [(1,), (2,), (0, 1, 2)], ids=["output", "errors", "all"])
@posix
def test_a_command_whose_standard_streams_are_closed_does_the_same(tmp_path, closed):
    done = viewcam("render", write_scene(tmp_path), tmp_path / "picture.exr", preexec_fn=lambda: [os.close(n) for n in closed])
    assert (done.returncode, done.stderr) == (0, "")
    assert image.read(tmp_path / "picture.exr").size
    assert (
        viewcam("render", tmp_path / "none.json", "out.exr", preexec_fn=lambda: [os.close(n) for n in closed]).returncode == 2
    )


def test_ctrl_c_while_modules_are_imported_ends_the_process_without_a_traceback(tmp_path):
    (tmp_path / "numpy.py").write_text("import signal, time\nsignal.raise_signal(signal.SIGINT)\ntime.sleep(60)")
    paths = os.pathsep.join([str(tmp_path), str(Path(__file__).parent.parent)])
    on_windows = sys.platform == "win32"
    foreground = {} if on_windows else {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
    command, environment = [sys.executable, "-m", "viewcam_addon", "render"], os.environ | {"PYTHONPATH": paths}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, **foreground)
    status = 3 if on_windows else -signal.SIGINT  # the status of C's runtime there
    assert (done.returncode, done.stdout, done.stderr) == (status, "", "")


def mounted(options, script, *arguments):
    """Run a shell script beside a small file system mounted at $1, in a mount namespace of its own."""
    mount = f'mount -t tmpfs -o {options} tmpfs "$1" && shift && '
    rights = [] if os.geteuid() == 0 else ["--map-root-user", "--user"]
    command = ["unshare", *rights, "--mount", "sh", "-c", mount + script, "sh", *map(str, arguments)]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent.parent)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


RENDER_AND_LIST = '"$1" -m viewcam_addon render "$2" "$3/picture.exr"; status=$?; ls -A "$3"; exit $status'


@pytest.mark.parametrize(
    ("options", "reason"), [("size=8k", "space"), ("ro", "Read-only")], ids=["a full disk", "a read-only folder"]
)
@posix
def test_where_nothing_can_be_written_one_line_says_so_and_nothing_is_left(tmp_path, options, reason):
    scene, disk = write_scene(tmp_path), tmp_path / "disk"
    disk.mkdir()
    done = mounted(options, RENDER_AND_LIST, disk, sys.executable, scene, disk)
    if "unshare" in done.stderr or "mount" in done.stderr:
        pytest.skip(f"no right to mount a file system here: {done.stderr.strip()}")
    assert done.returncode == 2 and reason in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr
    assert done.stdout == "", "a file remains"


@pytest.mark.parametrize(
    ("words", "output"),
    [
        (["export", "a.blend", "OUT"], "scene"),
        (["render", "scene.json", "OUT"], "image"),
        (["cycles", "a.blend", "OUT"], "image"),
        (["compare", "a.exr", "b.exr", "--report", "OUT"], "report"),
        (["compare", "a.exr", "b.exr", "--difference", "OUT.png"], "difference"),
        (["check", "a.blend", "--report", "OUT"], "report"),
        (["demo", "--report", "OUT"], "report"),
        (["batch", "a.blend", "--orbit", "3", "--out", "folder", "--json", "OUT"], "json"),
        (["check", "a.blend", "--json", "OUT"], "json"),
        (["check", "a.blend", "--junit", "OUT"], "junit"),
    ],
)
def test_what_can_not_be_written_is_said_before_anything_is_traced_or_rendered(tmp_path, capfd, monkeypatch, words, output):
    """Before, `render` traced for half a minute and then found that its target is a folder."""
    begun = []
    command = importlib.import_module(f"viewcam_addon.commands.{words[0]}")
    monkeypatch.setattr(command, "run", lambda options: begun.append(options) or (0, {}))
    (tmp_path / "file").write_text("no folder")
    bad = str(tmp_path / "file" / "out.png")
    message = fails(capfd, *(word.replace("OUT.png", bad).replace("OUT", bad) for word in words))
    assert not begun and "can't be written" in message and "out.png" in message
    good = str(tmp_path / "new" / "out.png")
    assert main([word.replace("OUT.png", good).replace("OUT", good) for word in words]) == 0
    assert len(begun) == 1 and getattr(begun[0], output) == Path(good)
    assert not (tmp_path / "new").exists(), "to look whether it can be written leaves nothing"


@pytest.mark.parametrize(
    "words",
    [
        ["batch", "a.blend", "--orbit", "3", "--out", ""],
        ["check", "a.blend", "--report", ""],
        ["check", "a.blend", "--junit="],
        ["export", "a.blend", ""],
        ["labels", "", "out.json"],
        ["camera", "a.json", "--out", ""],
        ["render", "a.json", "a.exr", "--json", ""],
    ],
)
def test_an_empty_name_is_not_taken_for_the_current_folder(tmp_path, capfd, monkeypatch, words):
    """--out "", of a shell's variable that was empty, filled the folder that one stood in."""
    monkeypatch.chdir(tmp_path)
    assert "the name is empty" in fails(capfd, *words)
    assert not list(tmp_path.iterdir())


@posix
def test_the_result_goes_to_standard_output_by_its_name_and_devices_stay(tmp_path):
    """Once --json /dev/null left a file in its place, where root typed it."""
    scene = write_scene(tmp_path)
    command = [sys.executable, "-m", "viewcam_addon", "render", scene, tmp_path / "out.exr", "--json"]
    output = subprocess.run([*command, "/dev/stdout"], capture_output=True, text=True, check=True).stdout
    message, _, result = output.partition("\n")
    assert "traced 64 × 48" in message and json.loads(result)["exit_status"] == 0
    subprocess.run([*command, "/dev/null"], capture_output=True, check=True)
    assert Path("/dev/null").is_char_device()
    mixed = subprocess.run([*command, "/dev/stdout", "--log-json"], capture_output=True, text=True, check=False)
    assert mixed.returncode == 2 and "is where viewcam prints" in mixed.stderr
    assert all(json.loads(line) for line in mixed.stdout.splitlines())


@pytest.mark.parametrize(
    "words",
    [
        ["render", "PIPE", "out.exr"],
        ["compare", "PIPE", "PIPE"],
        ["compare", "out.exr", "out.exr", "--scene", "PIPE"],
        ["export", "PIPE", "scene.json"],
        ["batch", "PIPE", "--orbit", "2", "--out", "out"],
        ["batch", "a.blend", "PIPE.csv", "--out", "out"],
    ],
)
@pytest.mark.timeout(120)
@posix
def test_a_pipe_in_place_of_a_file_is_refused_and_not_waited_for(tmp_path, monkeypatch, capfd, words):
    """A pipe that nobody writes to kept its reader for ever."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    os.mkfifo(tmp_path / "pipe.csv")
    shutil.copy(DEMO_SCENE.with_name("cornell.blend"), tmp_path / "a.blend")
    assert main(["render", str(write_scene(tmp_path)), str(tmp_path / "out.exr"), "--size", "8x6"]) == 0
    capfd.readouterr()
    status, errors = main([word.replace("PIPE", "pipe") for word in words]), capfd.readouterr().err
    assert status == 2 and "pipe" in errors and "bug" not in errors, errors
    assert len(errors.splitlines()) == 1


@posix
def test_a_pipe_in_place_of_a_sidecar_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "shot.json")
    assert Folder(tmp_path).finished("shot", "hash") is None


def test_a_command_with_blender_leaves_no_folder_among_the_temporary_files(tmp_path):
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("there is no Blender")
    temporary, project = tmp_path / "temporary", Path(__file__).parent.parent
    temporary.mkdir()
    environment = os.environ | {"PYTHONPATH": str(project), "TMPDIR": str(temporary)}
    files = [project / "sample_scenes" / "spheres.blend", tmp_path / "scene.json"]
    command = [sys.executable, "-m", "viewcam_addon", "export", *files]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert list(temporary.iterdir()) == []


def test_a_picture_made_elsewhere_is_judged_by_the_channels_that_are_named(tmp_path, capfd):
    import OpenEXR

    from viewcam_addon import image

    scene, traced, rendered = tmp_path / "scene.json", tmp_path / "traced.exr", tmp_path / "made.exr"
    scene.write_text(json.dumps(SCENE))
    assert main(["render", str(scene), str(traced)]) == 0
    passes = image.read(traced).passes
    away = np.linalg.norm(passes["Position"] - np.array(SCENE["camera"]["eye"]), axis=-1)
    hit = passes["Depth"][..., 0] < image.BACKGROUND_DEPTH
    pixels = {f"P.{letter}": passes["Position"][::-1, :, i] for i, letter in enumerate("XYZ")}
    pixels |= {"far": np.where(hit, away, np.inf)[::-1], "id": passes["Object Index"][::-1, :, 0]}
    OpenEXR.File({}, {name: np.ascontiguousarray(values, np.float32) for name, values in pixels.items()}).write(str(rendered))
    compare = ["compare", str(traced), str(rendered), "--scene", str(scene), "--channels"]
    result = tmp_path / "result.json"
    stated = ["position=P.X,P.Y,P.Z", "distance=far", "object-index=id"]
    assert main([*compare, *stated, "--json", str(result), "--report", str(tmp_path / "report")]) == 0
    record = json.loads(result.read_text())
    assert [row["name"] for row in record["passes"]] == ["Position", "Position depth", "Depth"]
    assert "Normal" in record["not_compared"] and (tmp_path / "report" / "index.html").is_file()
    assert main([*compare, "distance=far", "--report", str(tmp_path / "depth")]) == 0
    assert main([*compare, "position=P.Y,P.X,P.Z"]) == 1
    assert "no channel 'W': name some of P.X" in fails(capfd, *compare[:-1], "--channels", "depth=W")
    assert "names no pass" in fails(capfd, *compare[:-1], "--channels", "depht=far")
    assert "position has 3 channels" in fails(capfd, *compare[:-1], "--channels", "position=far")
    assert "name depth, distance or position" in fails(capfd, *compare[:-1], "--channels", "object-index=id")
    assert "names a pass twice" in fails(capfd, *compare[:-1], "--channels", "distance=far", "distance=id")
    assert "leave one of them out" in fails(capfd, *compare[:-1], "--channels", "distance=far", "depth=id")


def test_a_picture_by_mitsuba_of_the_same_scene_is_the_same_and_one_of_a_moved_ball_is_not(tmp_path):
    import OpenEXR

    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    scene, traced, rendered, camera = (tmp_path / name for name in ("scene.json", "traced.exr", "made.exr", "camera.xml"))
    scene.write_text(json.dumps(SCENE))
    assert main(["render", str(scene), str(traced)]) == 0
    cameras.save([cameras.Camera("camera", Pinhole(**CAMERA))], camera, "mitsuba")
    # One sample, through each pixel's center.
    number, flag = "<integer name='sample_count' value='1'/>", "<boolean name='jitter' value='false'/>"
    body = f"<rfilter type='box'/></film><sampler type='stratified'>{number}{flag}</sampler>"
    text = camera.read_text().replace("</film>", body)
    (sensor,) = mitsuba.load_string(text).sensors()
    for x, status in ((0, 0), (0.002, 1)):
        ball = {"type": "sphere", "center": [x, 0, 0]}
        document = {"type": "scene", "integrator": {"type": "aov", "aovs": "P:position"}, "ball": ball}
        pixels = np.array(mitsuba.render(mitsuba.load_dict(document), sensor=sensor))
        channels = {f"P.{letter}": np.ascontiguousarray(pixels[..., i], np.float32) for i, letter in enumerate("XYZ")}
        OpenEXR.File({}, channels).write(str(rendered))
        stated = ["--scene", str(scene), "--channels", "position=P.X,P.Y,P.Z"]
        assert main(["compare", str(traced), str(rendered), *stated]) == status


def test_another_engine_is_checked_by_its_geometry_alone(capfd):
    assert "--device is for Cycles" in fails(capfd, "check", "any.blend", "--engine", "EEVEE", "--device", "CUDA")
    assert "--engine EEVEE is checked at level geometry" in fails(
        capfd, "check", "any.blend", "--engine", "EEVEE", "--level", "path"
    )


LISTING = """
import sys
sys.path.insert(0, sys.argv[1])
import viewcam_addon
from viewcam_addon import cli, commands
assert viewcam_addon.__file__.startswith(sys.argv[1]), viewcam_addon.__file__
assert cli.main(["--help"]) == 0
named = [name for name in sys.modules if name.startswith("viewcam_addon.commands.")]
assert not named, f"--help imports {named}"
"""


@pytest.mark.parametrize("form", ["folder", "zip"])
def test_help_tells_the_first_line_of_each_module_of_a_command_and_imports_none(tmp_path, form):
    package = Path(commands.__file__).parent.parent
    path = package.parent
    if form == "zip":
        path = Path(shutil.make_archive(str(tmp_path / "viewcam"), "zip", package.parent, package.name))
    done = subprocess.run([sys.executable, "-P", "-c", LISTING, path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    listed = " ".join(done.stdout.split())
    assert {"check", "batch", "demo"} <= set(commands.names())
    for name in commands.names():
        summary = importlib.import_module(f"viewcam_addon.commands.{name}").__doc__.splitlines()[0]
        assert summary.endswith(".") and f"{name} {summary}" in listed, name
    assert "serve" not in listed.partition("positional")[2], "a command for our own processes is listed"


@pytest.mark.parametrize(("count", "sentence"), [(0, "0 lenses"), (1, "1 lens"), (2000, "2,000 lenses")])
def test_a_sentence_counts_in_the_singular_where_there_is_one(count, sentence):
    assert counted(count, "lens", "lenses") == sentence
    assert counted(count, "camera") == sentence.replace("lenses", "cameras").replace("lens", "camera")
