"""A shot as a value: what it takes, what it keeps, what it refuses."""

import dataclasses
import json
import math
import os
import pickle
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from viewcam_addon import cli
from viewcam_addon import file_names as names
from viewcam_addon.cameras.calibration import Calibration
from viewcam_addon.cameras.distortion import opencv
from viewcam_addon.errors import InputError
from viewcam_addon.jobs import job
from viewcam_addon.jobs.folder import settings_hash
from viewcam_addon.jobs.job import FIELDS, Job
from viewcam_addon.jobs.lists import ShotsError
from viewcam_addon.jobs.plan import shard
from viewcam_addon.pinhole import ViewPlane

FOUR = {"eye": (1.0, 2.0, 3.0), "look_at": (0.0, 0.0, 0.0), "up": (0.0, 0.0, 1.0), "d": 400.0}
CALIBRATION = Calibration(ViewPlane((300.0, 301.0), (160.5, 90.0), 320, 180), opencv({"k1": 0.1, "p1": 0.0}))


def test_a_shot_keeps_plain_numbers_whatever_it_is_given():
    shot = Job("a", np.array([1, 2, 3]), [0, 0, 0], (0, 0, np.float32(1)), 400, width=np.int64(64), height=36.0)
    assert shot == Job("a", **FOUR, width=64, height=36)
    assert all(type(number) is float for number in (*shot.eye, *shot.look_at, *shot.up, shot.d))
    assert type(shot.width) is int and type(shot.height) is int


def test_a_shot_and_its_problems_travel_to_other_processes():
    shot, error = Job("a", camera="Camera"), ShotsError("list.csv", ("line 1: wrong", "line 2: wrong"))
    assert pickle.loads(pickle.dumps(shot)) == shot
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"eye": FOUR["look_at"]}, "the same point"),
        ({"up": (0, -0.0, 0)}, "no direction"),
        ({"d": 0}, "d > 0"),
        ({"d": math.nan}, "finite"),
        ({"d": 1e-40}, "1.17549e-38"),
        ({"eye": (1e39, 0, 0)}, "3.40282e"),
        ({"camera": "Camera"}, "either a camera"),
        ({"eye": None}, "eye of the shot 'a': missing"),
        ({"width": 64}, "height of the shot 'a': missing"),
        ({"width": 64.5, "height": 36}, "whole number from 4 to 65536"),
        ({"frame": True}, "give a number"),
        ({"engine": np.array(["CYCLES"])}, "CYCLES, EEVEE, VIEWCAM"),
        ({"level": "PATH"}, "geometry, direct, path, auto"),
    ],
)
def test_a_shot_that_can_not_be_is_refused(changes, sentence):
    Job("a", **FOUR)
    with pytest.raises(InputError, match=sentence):
        Job(**{"name": "a", **FOUR, **changes})


@given(st.text(max_size=40))
@example("left.v2")
@example("a" * 200)
@example("é" * 66)
@example("CONTACT")
def test_a_name_that_is_taken_is_one_of_a_file(tmp_path_factory, name):
    try:
        names.check("name", name)
    except InputError:
        return
    if not name:
        return
    folder = tmp_path_factory.getbasetemp() / "names"
    folder.mkdir(exist_ok=True)
    file = folder / f".{name}-0123abcd.json"  # as a temporary one of files.written_whole
    file.touch()
    assert file in folder.iterdir()
    file.unlink()


@pytest.mark.parametrize(
    "name",
    [
        *(f"a{character}b" for character in '/\\:*?"<>|#\0\n\x7f\u200b\u202e\u2028\ud800\ufdd0'),
        *("CON", "con", "NUL.left", "com1", "Lpt9.v2", "COM¹", "aux .exr", "conin$"),
        *(".", "..", ".hidden", "a.", "a ", " a", "\u00a0a"),
        *("summary", "Contact-Sheet", "TRANSFORMS", "summary-1-of-8", "Contact-Sheet-12-of-12"),
        *("a" * 201, "é" * 67, "左" * 67),
    ],
)
def test_a_name_that_some_system_does_not_take_is_refused(name):
    with pytest.raises(InputError, match=r"name is .*, which .*: "):
        Job(name, **FOUR)


@pytest.mark.parametrize(
    "name", ["COM10", "console", "com", "a.con", "summary.left", "summary-1", "left-1-of-2", "α", "a'b", "50%", "{x}"]
)
def test_a_name_that_only_looks_like_a_device_or_is_merely_odd_is_taken(name):
    assert Job(name, **FOUR).name == name


@pytest.mark.parametrize(("first", "second"), [("Left", "lEFT"), ("é", "e\u0301"), ("É", "e\u0301"), ("straße", "STRASSE")])
def test_names_that_are_one_file_somewhere_are_known(first, second):
    assert names.one_file(first) == names.one_file(second)


def test_every_field_has_a_check():
    assert {field.name for field in dataclasses.fields(Job)} == FIELDS.keys() | job._MORE.keys()


OTHERS = {"blend": "a.blend", "trust": True, "seed": 7, "threads": 2, "error": 0.01, "device": "CUDA", "clay": True}
OTHERS |= {"recenter": True, "strict": True, "scene": "b.json", "level": "path", "samples": 64, "width": 64, "height": 36}


def test_a_job_comes_back_from_json_as_it_was():
    for each in (Job(), Job("a", **FOUR), Job("a", camera="Camera", **OTHERS, calibration=CALIBRATION)):
        assert Job.from_json(json.loads(json.dumps(each.to_json()))) == each
    assert Job().to_json() == {}
    with pytest.raises(InputError, match="no option 'cmera' of a job: give some of name, eye"):
        Job.from_json({"cmera": "Camera"})


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"seed": 2**31}, "seed is 2147483648: give a whole number from 0"),
        ({"threads": 0}, "threads is 0"),
        ({"error": 0}, "error is 0: give a number above 0"),
        ({"device": "GPU"}, "device is 'GPU': give one of CPU, CUDA"),
        ({"clay": "yes"}, "clay is 'yes'"),
        ({"scene": 3}, "scene is 3: give the path of a file"),
    ],
)
def test_what_a_check_can_not_be_told_is_refused(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        Job(**changes)


def test_an_engine_is_checked_by_what_it_can_show():
    Job(engine="EEVEE").refuse_unchecked()
    for each in (Job(engine="EEVEE", level="direct"), Job(engine="WORKBENCH", error=0.1), Job(engine="VIEWCAM")):
        with pytest.raises(InputError):
            each.refuse_unchecked()


def test_the_words_of_a_check_are_the_job(monkeypatch):
    from viewcam_addon.commands import check

    asked = []
    monkeypatch.setattr(check, "check_one", lambda each, *_, **__: asked.append(each) or (0, {}))
    wanted = Job(camera="Left eye", frame=-3, engine="CYCLES", **{**OTHERS, "threads": None})
    searching = Job(engine="CYCLES", level="path", find="0.50 %", seed=0, blend=wanted.blend)
    for each in (wanted, searching):
        assert cli.main(shlex.split(each.check_words())) == 0
    assert asked == [wanted, searching] and searching.find == "0.5%"


# --- The hash of what a picture was made from: the same for the same, another for whatever differs, on every machine


SHOT = Job("a", (3.0, -6.0, 2.5), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 400.0, None, 320, 180, 1, "CYCLES", 16, "direct")
MADE_FROM = {"blend": "0f" * 32, "versions": {"blender": "5.2.2", "viewcam": "0.1.0"}, "seed": 0, "clay": False, "error": None}

plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


def exactly(value):
    """The value such that == tells 1, 1.0 and True, and 0.0 and −0.0 apart."""
    if isinstance(value, list):
        return [exactly(item) for item in value]
    if isinstance(value, dict):
        return {key: exactly(item) for key, item in value.items()}
    return type(value), value.hex() if isinstance(value, float) else value


def test_the_hash_is_the_same_on_every_machine_and_in_every_version():
    """Pinned: if it changes, every --resume renders everything again, so _FORMAT has to count up."""
    assert settings_hash(SHOT, MADE_FROM) == "b2c27a7b1fa59d7c973985ad2bb0e12fd0c9eda08afc8fac88cec2c97f2bd855"


def test_the_hash_is_the_same_in_another_process_with_other_hashes_of_texts():
    imports = "from viewcam_addon.jobs.folder import settings_hash; from viewcam_addon.jobs.job import Job"
    program = f"{imports}\nprint(settings_hash({SHOT!r}, {MADE_FROM!r}))"
    command = [sys.executable, "-X", "utf8", "-c", program]
    root, seed = Path(__file__).parents[2], os.environ | {"PYTHONHASHSEED": "7"}
    outcome = subprocess.run(command, cwd=root, env=seed, capture_output=True, text=True, check=True)
    assert outcome.stdout.strip() == settings_hash(SHOT, MADE_FROM)


@given(st.dictionaries(st.text(max_size=5), plain, max_size=4), st.dictionaries(st.text(max_size=5), plain, max_size=4))
def test_hashes_are_equal_if_and_only_if_the_settings_are(first, second):
    assert (settings_hash(SHOT, first) == settings_hash(SHOT, second)) == (exactly(first) == exactly(second))
    assert settings_hash(SHOT, first) == settings_hash(SHOT, dict(reversed(first.items())))


@pytest.mark.parametrize(
    "change",
    [
        {"eye": (math.nextafter(3.0, 4), -6.0, 2.5)},
        {"look_at": (0.0, 0.0, math.nextafter(1.0, 0))},
        {"up": (5e-324, 0.0, 1.0)},
        {"d": math.nextafter(400.0, 0)},
        dict.fromkeys(("eye", "look_at", "up", "d")) | {"camera": "Camera"},
        {"width": 321},
        {"height": 181},
        {"frame": None},
        {"engine": "EEVEE"},
        {"samples": 17},
        {"level": "path"},
        {"trust": True},
        {"seed": 1},
        {"error": 0.01},
        {"device": "CUDA"},
        {"clay": True},
        {"recenter": True},
        {"strict": True},
        {"scene": "approved.json"},
        {"find": "1%"},
        {"calibration": CALIBRATION},
        {"calibration": dataclasses.replace(CALIBRATION, lens=opencv({"k1": 0.1, "p1": 5e-324}))},
    ],
    ids=lambda change: next(iter(change)),
)
def test_whatever_decides_the_picture_changes_the_hash(change):
    assert settings_hash(dataclasses.replace(SHOT, **change), MADE_FROM) != settings_hash(SHOT, MADE_FROM)


@pytest.mark.parametrize("change", [{"name": "b"}, {"blend": "elsewhere/shot.blend"}, {"threads": 2}], ids=str)
def test_what_does_not_decide_the_picture_changes_nothing(change):
    assert settings_hash(dataclasses.replace(SHOT, **change), MADE_FROM) == settings_hash(SHOT, MADE_FROM)


def test_every_field_of_a_job_decides_or_does_not():
    fields = {"eye", "look_at", "up", "d", "camera", "width", "height", "frame", "engine", "samples", "level", "trust", "seed"}
    fields |= {"error", "find", "device", "clay", "recenter", "strict", "scene", "name", "blend", "threads", "calibration"}
    assert fields | {"principal_point", "pixel_aspect", "mirrored"} == {field.name for field in dataclasses.fields(SHOT)}


@pytest.mark.parametrize("value", [b"bytes", {1: 2}, {1, 2}, Path("a"), pytest.param(object(), id="object")], ids=repr)
def test_what_has_no_canonical_form_is_refused(value):
    with pytest.raises(TypeError, match="no canonical form"):
        settings_hash(SHOT, {"deep": [value]})


# --- The parts of a batch for several machines


@given(st.integers(0, 200), st.integers(1, 50))
def test_all_shards_together_are_the_batch_and_none_has_much_more_than_another(total, count):
    parts = [shard(range(total), f"{number}/{count}") for number in range(1, count + 1)]
    assert sorted(item for part in parts for item in part) == list(range(total))
    assert max(map(len, parts)) - min(map(len, parts)) <= 1
    assert all(part == sorted(part) for part in parts)


def test_neighbors_go_to_different_shards():
    assert [shard("abcdefg", f"{number}/3") for number in (1, 2, 3)] == [["a", "d", "g"], ["b", "e"], ["c", "f"]]


@pytest.mark.parametrize("text", ["", "1", "0/4", "5/4", "0/0", "-1/4", "1/4/2", "1/", "a/b", "1.0/4", "١/٢", "1/9999999999"])
def test_a_shard_that_is_none_is_refused(text):
    with pytest.raises(InputError, match="write 1/8"):
        shard([1, 2, 3], text)
