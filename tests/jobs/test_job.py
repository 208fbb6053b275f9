"""A shot as a value: what it takes, what it keeps, what it refuses."""

import dataclasses
import json
import math
import pickle
import shlex

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from viewcam_addon import cli
from viewcam_addon.errors import InputError
from viewcam_addon.jobs import job, names
from viewcam_addon.jobs.job import FIELDS, Job
from viewcam_addon.jobs.problems import ShotsError

FOUR = {"eye": (1.0, 2.0, 3.0), "look_at": (0.0, 0.0, 0.0), "up": (0.0, 0.0, 1.0), "d": 400.0}


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


@pytest.mark.parametrize(("one", "other"), [("Left", "lEFT"), ("é", "e\u0301"), ("É", "e\u0301"), ("straße", "STRASSE")])
def test_names_that_are_one_file_somewhere_are_known(one, other):
    assert names.one_file(one) == names.one_file(other)


def test_every_field_has_a_check():
    assert {field.name for field in dataclasses.fields(Job)} == FIELDS.keys() | job._MORE.keys()


OTHERS = {"blend": "a.blend", "trust": True, "seed": 7, "threads": 2, "error": 0.01, "device": "CUDA", "clay": True}
OTHERS |= {"recenter": True, "strict": True, "scene": "b.json", "level": "path", "samples": 64, "width": 64, "height": 36}


def test_a_job_comes_back_from_json_as_it_was():
    for each in (Job(), Job("a", **FOUR), Job("a", camera="Camera", **OTHERS)):
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
    from viewcam_addon.commands import verification

    asked = []
    monkeypatch.setattr(verification, "check_one", lambda each, *_, **__: asked.append(each) or (0, {}))
    wanted = Job(camera="Left eye", frame=-3, engine="CYCLES", **{**OTHERS, "threads": None})
    assert cli.main(shlex.split(wanted.check_words())) == 0
    assert asked == [wanted]
