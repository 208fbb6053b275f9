"""`viewcam batch` as its users type it: each wrong word one sentence, a wrong list told whole, else a folder of pictures."""

import json
import os
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from viewcam_addon.cli import main
from viewcam_addon.commands.demo import SCENE as DEMO_SCENE
from viewcam_addon.errors import InputError
from viewcam_addon.jobs import cluster

ROOT = Path(__file__).parents[2]
CORNELL = DEMO_SCENE.with_name("cornell.blend")
CAMERA = "Virtual Pinhole"  # the sample scenes' name for theirs
SMALL = ("--size", "16x16", "--samples", "1")

HEADER = "name,eye_x,eye_y,eye_z,look_at,up,d,camera,width,height,frame,engine,samples,level"
GOOD = ["shot{}", "1", "-5", "2.5", '"0, 0, 1"', "0 0 1", "400", "", "32", "18", "1", "CYCLES", "4", "geometry"]
# A column and what can't stand there: each is a mistake of its own kind.
KINDS = [
    *(("name", text) for text in ("", "a/b", "a\\b", "a:b", "a?b", "a*b", "a<b", "a|b", "a#b", ".a", "a.", "nul", "summary")),
    *(("name", text) for text in ("shot3", "SHOT3", "x" * 201, "a\u200bb", '"a""b"')),
    *(("eye_x", text) for text in ("", "west", '"1,5"', "1_0", "nan", "inf", "1e999", "−1")),
    *(("look_at", text) for text in ("", '"0,0"', '"0,0,0,0"', '"0,0,z"', '"1,-5,2.5"')),
    *(("up", text) for text in ("", "0 0 0", "0 0 inf")),
    *(("d", text) for text in ("", "0", "-400", "1e-60", "400px")),
    *(("camera", text) for text in ("Camera", CAMERA)),
    *(("width", text) for text in ("", "3", "70000", "320.5", "320x180")),
    *(("frame", text) for text in ("1.5", "1048575", "first")),
    *(("engine", text) for text in ("cycles", "BLENDER")),
    *(("samples", text) for text in ("0", "many", "16777217")),
    ("level", "full"),
]


def batch(capfd, *words, status=0):
    """Run `viewcam batch`; what it said on standard output and standard error. It must end with this status."""
    assert main(["batch", *map(str, words)]) == status, capfd.readouterr()
    return capfd.readouterr()


def fails(capfd, *words, status=2):
    output = batch(capfd, *words, status=status)
    assert output.out == "" and len(output.err.splitlines()) == 1 and "bug" not in output.err, output
    return output.err


def files(folder):
    return sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))


def test_a_thousand_rows_with_forty_kinds_of_bad_ones_are_named_by_line_and_column_and_nothing_is_rendered(tmp_path, capfd):
    assert len(KINDS) >= 40
    rows = [[cell.format(line) for cell in GOOD] for line in range(2, 1002)]
    wrong = {15 * number + 10: kind for number, kind in enumerate(KINDS)}
    for line, (column, text) in wrong.items():
        rows[line - 2][HEADER.split(",").index(column)] = text
    path, out, result = tmp_path / "shots.csv", tmp_path / "out", tmp_path / "result.json"
    path.write_text("\n".join([HEADER, *map(",".join, rows)]), encoding="utf-8")
    output = batch(capfd, CORNELL, path, "--out", out, "--json", result, "--log-json", status=2)
    lines = output.err.splitlines()
    assert lines[0].startswith(f"viewcam batch: {path}: ") and lines[0].endswith("problems, nothing is rendered")
    for line, (column, text) in wrong.items():
        about = [sentence for sentence in lines if f"  line {line}, column" in sentence]
        places = "".join(sentence.partition(":")[0].partition(" is ")[0] for sentence in about)
        assert column in places, f"line {line}, {column} = {text!r}: told was {about}"
    assert {int(sentence.split()[1].rstrip(",")) for sentence in lines[1:]} == {*wrong}, "a right line is called wrong"
    error = next(event for event in map(json.loads, output.out.splitlines()) if event["event"] == "error")
    assert error["problems"] == json.loads(result.read_text())["problems"] == [sentence.strip() for sentence in lines[1:]]
    assert not out.exists()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "--out"),
        ([CORNELL], "--out"),
        ([CORNELL, "--out", "OUT"], "which shots is not said"),
        ([CORNELL, "shots.csv", "--out", "OUT", "--orbit", "3"], "SHOTS and --orbit"),
        ([CORNELL, "--cameras", "*", "--frames", "1..2", "--out", "OUT"], "--frames and --cameras"),
        ([CORNELL, "shots.csv", "--camera", "Camera", "--out", "OUT"], "--camera is that of"),
        ([CORNELL, "--frames", "1..2", "--frame", "1", "--out", "OUT"], "--frame and --frames"),
        ([CORNELL, "--orbit", "0", "--out", "OUT"], "'0'"),
        ([CORNELL, "--orbit", "2", "--camera", "Camra", "--out", "OUT"], "'Camra'"),
        ([CORNELL, "--frames", "1..2", "--camera", "Camra", "--out", "OUT"], "'Camra'"),
        ([CORNELL, "--frames", "2..1", "--out", "OUT"], "write 1..2"),
        ([CORNELL, "--frames", "now", "--out", "OUT"], "'now'"),
        ([CORNELL, "--cameras", "X*", "--out", "OUT"], CAMERA),
        ([CORNELL, "--orbit", "4", "--shard", "5/4", "--out", "OUT"], "'5/4'"),
        ([CORNELL, "--orbit", "4", "--size", "2x2", "--out", "OUT"], "width is 2"),
        ([CORNELL, "--orbit", "4", "--samples", "99999999", "--out", "OUT"], "samples is 99999999"),
        ([CORNELL, "--orbit", "4", "--resume", "--overwrite", "--out", "OUT"], "--resume"),
        ([CORNELL, "--orbit", "4", "--workers", "0", "--out", "OUT"], "'0'"),
        ([CORNELL, "--orbit", "4", "--scheduler", "tcp://localhost:1", "--workers", "2", "--out", "OUT"], "--workers"),
        ([CORNELL, "--orbit", "4", "--scheduler", "localhost", "--out", "OUT"], "tcp://host:8786"),
        ([CORNELL, "none.csv", "--out", "OUT"], "none.csv"),
        ([CORNELL, ROOT / "LICENSE", "--out", "OUT"], "LICENSE is no camera"),
        ([CORNELL, "FILE", "--out", "OUT"], "FILE: the text says where the camera is but not how it sees"),
        (["none.blend", "--orbit", "4", "--out", "OUT"], "none.blend does not exist"),
        ([ROOT, "--orbit", "4", "--out", "OUT"], "is no file: check the name of the .blend file"),
        ([ROOT / "README.md", "--orbit", "4", "--out", "OUT"], "not a .blend"),
        ([CORNELL, "--orbit", "4", "--out", "FILE"], "can't be a folder"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_each_wrong_word_is_one_sentence_and_nothing_is_written(tmp_path, capfd, monkeypatch, words, sentence):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "FILE").write_text("camera.lookAt(eye=(7, -6, 4), look_at=(0, 0, 1), up=(0, 0, 1))")
    assert sentence in fails(capfd, *words)
    assert files(tmp_path) == ["FILE"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--distort", "shots.csv"], "shots.csv"),
        (["--distort", "lens", "a", "b"], "a b are more: name one or none"),
        (["--distort", "lens", "b"], "there is no camera 'b'"),
        (["--distort", "lens", "--size", "64x36"], "--size is 64 × 36 and the camera of --distort has 320 × 180 pixels"),
        (["--distort", "folded"], "the model folds there"),
        (["--distort", "straight"], "no camera of straight has a lens that distorts"),
        (["shots.csv", "--distort", "lens"], "the shot a has 64 × 36 pixels and the camera of --distort 320 × 180"),
    ],
    ids=str,
)
def test_what_can_not_be_distorted_is_one_sentence(tmp_path, capfd, monkeypatch, words, sentence):
    monkeypatch.chdir(tmp_path)
    Path("shots.csv").write_text(f"name,camera,width,height\na,{CAMERA},64,36\n")
    for name, terms in {"lens": "-0.1 0 0 0", "folded": "-0.9 0 0 0", "straight": "0 0 0 0"}.items():
        Path(name).mkdir()
        Path(name, "cameras.txt").write_text(f"1 OPENCV 320 180 200 200 160 90 {terms}\n")
        Path(name, "images.txt").write_text("1 1 0 0 0 0 0 4 1 a.png\n\n")
        Path(name, "points3D.txt").write_text("")
    shots = [] if words[0] == "shots.csv" else ["--orbit", "4"]
    assert sentence in fails(capfd, CORNELL, *shots, *words, "--out", "OUT")
    assert not Path("OUT").exists()


def test_files_and_options_stand_in_any_order(tmp_path, capfd):
    (tmp_path / "shots.csv").write_text(f"name,camera\na,{CAMERA}\n")
    for number, words in enumerate(
        [
            (CORNELL, tmp_path / "shots.csv", "--out", "OUT"),
            (CORNELL, "--out", "OUT", tmp_path / "shots.csv"),
            ("--out", "OUT", CORNELL, tmp_path / "shots.csv"),
        ]
    ):
        out = tmp_path / str(number)
        batch(capfd, *(out if word == "OUT" else word for word in words), *SMALL)
        assert files(out) == ["a.exr", "a.json", "a.png", "contact-sheet.html", "summary.json"]


def test_a_shot_s_own_words_count_more_than_the_command_line_s(tmp_path, capfd):
    (tmp_path / "shots.csv").write_text(f"name,camera,width,height,samples,frame\nown,{CAMERA},12,8,2,3\nother,{CAMERA},,,,\n")
    batch(capfd, CORNELL, tmp_path / "shots.csv", "--out", tmp_path / "out", *SMALL, "--frame", "5", "--engine", "CYCLES")
    shots = {name: json.loads((tmp_path / "out" / f"{name}.json").read_text())["shot"] for name in ("own", "other")}
    entries = [[shot[key] for key in ("width", "height", "samples", "frame", "engine")] for shot in shots.values()]
    assert entries == [[12, 8, 2, 3, "CYCLES"], [16, 16, 1, 5, "CYCLES"]]


def test_shards_are_the_whole_and_have_summaries_of_their_own(tmp_path, capfd):
    out = tmp_path / "out"
    for shard in ("1/2", "2/2"):
        batch(capfd, CORNELL, "--orbit", "3", "--shard", shard, "--out", out, *SMALL)
    assert {"summary-1-of-2.json", "summary-2-of-2.json", "orbit_000.exr", "orbit_001.exr", "orbit_002.exr"} < {*files(out)}
    assert "3 of them kept" in batch(capfd, CORNELL, "--orbit", "3", "--out", out, *SMALL, "--resume").out


@pytest.mark.parametrize("name", ["a.json", "summary.json"])
@pytest.mark.parametrize("kept", [[], ["--overwrite"], ["--resume"]], ids=" ".join)
def test_a_list_stays_what_it_is_where_a_file_of_the_batch_would_have_its_name(tmp_path, capfd, monkeypatch, name, kept):
    """With --overwrite the list shots.json became the sidecar of its shot `shots`."""
    monkeypatch.chdir(tmp_path)
    shots = json.dumps([{"name": "a", "camera": CAMERA, "width": 16, "height": 16, "samples": 1}])
    (tmp_path / name).write_text(shots)
    assert f"{name} is what the batch would write over" in fails(capfd, CORNELL, name, "--out", ".", *kept)
    assert (tmp_path / name).read_text() == shots and files(tmp_path) == [name]


def test_no_more_workers_are_started_than_there_are_shots(tmp_path, capfd, monkeypatch):
    """A hundred thousand for two shots were."""

    def opened(scheduler, workers, blender):
        raise InputError(f"{workers} are enough")

    monkeypatch.setattr(cluster, "opened", opened)
    words = (CORNELL, "--orbit", "2", "--out", tmp_path / "out", "--workers", "100000", *SMALL)
    assert "2 are enough" in fails(capfd, *words)


def test_frames_and_cameras_make_shots_of_their_names(tmp_path, capfd):
    out = tmp_path / "out"
    output = batch(capfd, CORNELL, "--frames=-1..1", "--out", out, *SMALL)
    assert output.out.startswith("3 shots, in ") and str(out / "contact-sheet.html") in output.out and output.err == ""
    batch(capfd, CORNELL, "--cameras", "Virtual*", "--out", out, *SMALL)
    assert {"frame_-001.exr", "frame_000.exr", "frame_001.exr", f"{CAMERA}.exr"} < {*files(out)}


def test_cameras_with_spaces_in_their_names_make_a_dataset(tmp_path, capfd):
    """The cameras of the samples have some, and --transforms refused them."""
    out = tmp_path / "out"
    batch(capfd, CORNELL, "--cameras", "Virtual*", "--transforms", "--out", out, *SMALL)
    name = CAMERA.replace(" ", "_")
    assert name != CAMERA and {f"{name}.exr", f"{name}.png", f"{name}.json"} < {*files(out)}
    assert json.loads((out / f"{name}.json").read_text())["shot"]["camera"] == CAMERA
    assert (out / "sparse" / "0" / "images.txt").read_text().splitlines()[-2].endswith(f" {name}.png")


def test_what_can_not_be_known_is_said_and_resume_known_renders_it_anew(tmp_path, capfd, fresh_blender):
    """Binary USD may read other files, and nobody here can know which: --resume kept pictures of them without a word."""
    bpy, out, blend = fresh_blender, tmp_path / "out", tmp_path / "usd.blend"
    bpy.ops.wm.open_mainfile(filepath=str(CORNELL))
    (tmp_path / "stage.usdc").write_bytes(b"PXR-USDC and more")
    bpy.ops.cachefile.open(filepath=str(tmp_path / "stage.usdc"))
    bpy.data.cache_files["stage.usdc"].use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
    words = ("--orbit", "2", "--out", out, *SMALL)

    def rendered():
        return json.loads((out / "summary.json").read_text())["timing"]["rendered"]

    batch(capfd, blend, *words)
    assert rendered() == 2
    for warned in (
        json.loads((out / "orbit_001.json").read_text()),
        json.loads((out / "summary.json").read_text())["shots"][1],
    ):
        assert any("'stage.usdc' is binary USD" in sentence for sentence in warned["warnings"])
    assert "is binary USD" in (out / "contact-sheet.html").read_text()
    output = batch(capfd, blend, *words, "--resume").out
    assert rendered() == 0 and "--resume-known" in output and "'stage.usdc' is binary USD" in output
    assert "not sure" not in batch(capfd, blend, *words, "--resume-known").out
    assert rendered() == 2
    known = ("--orbit", "2", "--out", tmp_path / "known", *SMALL)
    batch(capfd, CORNELL, *known, "--resume-known")
    assert "2 of them kept" in batch(capfd, CORNELL, *known, "--resume-known").out


def test_every_event_of_a_batch_is_a_line(tmp_path, capfd):
    output = batch(capfd, CORNELL, "--orbit", "2", "--out", tmp_path / "out", *SMALL, "--log-json")
    record = [json.loads(line) for line in output.out.splitlines()]
    shot = ["shot_started", "shot_done"]
    assert [event["event"] for event in record] == [
        *("started", "batch_started", *shot, *shot, "batch_finished", "message", "finished")
    ]
    assert record[3]["shot"] == "orbit_000" and Path(record[3]["image"]) == tmp_path / "out" / "orbit_000.exr"
    assert output.err == ""


def test_a_shot_that_fails_is_a_sentence_and_the_rest_are_there(tmp_path, symlink, capfd):
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "file").touch()
    symlink(out / "orbit_001.png", tmp_path / "file" / "picture.png")  # which is no folder
    output = batch(capfd, CORNELL, "--orbit", "3", "--out", out, *SMALL, status=4)
    failed, summary = output.err.splitlines()
    assert failed.startswith("viewcam batch: orbit_001: ") and "orbit_001.png" in failed
    assert "of 3 shots, 1 failed and 0 are left" in summary and "--resume" in summary and output.out == ""
    assert {"orbit_000.json", "orbit_002.json"} < {*files(out)} and "orbit_001.json" not in files(out)


def test_on_a_terminal_a_bar_counts_the_shots(tmp_path, on_a_terminal):
    pytest.importorskip("tqdm")
    command = [sys.executable, "-m", "viewcam_addon", "batch", CORNELL, "--orbit", "3", "--out", tmp_path / "out", *SMALL]
    status, printed = on_a_terminal(command, os.environ | {"PYTHONPATH": str(ROOT)})
    assert status == 0 and "orbit_000: " in printed and "| 0/3 [" in printed, printed
