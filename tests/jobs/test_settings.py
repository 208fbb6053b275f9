"""The hash of what a picture was made from: the same for the same, another for whatever differs, on every machine."""

import dataclasses
import math
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.settings import settings_hash

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
    imports = "from viewcam_addon.jobs.settings import settings_hash; from viewcam_addon.jobs.job import Job"
    program = f"{imports}\nprint(settings_hash({SHOT!r}, {MADE_FROM!r}))"
    command = [sys.executable, "-X", "utf8", "-c", program]
    root = Path(__file__).parents[2]
    outcome = subprocess.run(command, cwd=root, env={"PYTHONHASHSEED": "7"}, capture_output=True, text=True, check=True)
    assert outcome.stdout.strip() == settings_hash(SHOT, MADE_FROM)


@given(st.dictionaries(st.text(max_size=5), plain, max_size=4), st.dictionaries(st.text(max_size=5), plain, max_size=4))
def test_hashes_are_equal_if_and_only_if_the_settings_are(one, other):
    assert (settings_hash(SHOT, one) == settings_hash(SHOT, other)) == (exactly(one) == exactly(other))
    assert settings_hash(SHOT, one) == settings_hash(SHOT, dict(reversed(one.items())))


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
    ],
    ids=lambda change: next(iter(change)),
)
def test_whatever_decides_the_picture_changes_the_hash(change):
    assert settings_hash(dataclasses.replace(SHOT, **change), MADE_FROM) != settings_hash(SHOT, MADE_FROM)


@pytest.mark.parametrize("change", [{"name": "b"}, {"blend": "elsewhere/shot.blend"}, {"threads": 2}], ids=str)
def test_what_does_not_decide_the_picture_changes_nothing(change):
    assert settings_hash(dataclasses.replace(SHOT, **change), MADE_FROM) == settings_hash(SHOT, MADE_FROM)


def test_every_field_of_a_job_decides_or_does_not():
    told = {"eye", "look_at", "up", "d", "camera", "width", "height", "frame", "engine", "samples", "level", "trust", "seed"}
    told |= {"error", "device", "clay", "recenter", "strict", "scene", "name", "blend", "threads"}
    assert told | {"principal_point", "pixel_aspect", "mirrored"} == {field.name for field in dataclasses.fields(SHOT)}


@pytest.mark.parametrize("value", [b"bytes", {1: 2}, {1, 2}, Path("a"), pytest.param(object(), id="object")], ids=repr)
def test_what_has_no_canonical_form_is_refused(value):
    with pytest.raises(TypeError, match="no canonical form"):
        settings_hash(SHOT, {"deep": [value]})
