"""Lists of shots as files: each format says the same, to the last bit, and the page on them is right.

Shots by rule: what an orbit keeps, which frames and cameras are meant.
"""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.jobs import lists, makers
from viewcam_addon.jobs.job import ENGINES, FIELDS, LEVELS, Job
from viewcam_addon.jobs.lists import ShotsError
from viewcam_addon.jobs.plan import shard
from viewcam_addon.pinhole import Pinhole

PAGE = Path(__file__).parents[2].joinpath("docs", "batch.md").read_text(encoding="utf-8")
LARGEST_FLOAT32 = (2.0 - 2.0**-23) * 2.0**127

coordinates = st.floats(-LARGEST_FLOAT32, LARGEST_FLOAT32)
triples = st.tuples(coordinates, coordinates, coordinates)


def maybe(strategy):
    return st.none() | strategy


@st.composite
def lists_of_shots(draw):
    """Shots of every kind, with names of letters that spreadsheets don't take for something else."""
    result = []
    for i in range(draw(st.integers(1, 3))):
        eye, look_at = draw(st.lists(triples, min_size=2, max_size=2, unique=True))
        four = (eye, look_at, draw(triples.filter(any)), draw(st.floats(2.0**-126, LARGEST_FLOAT32)))
        camera = draw(maybe(st.sampled_from(["Camera", "Camera.001", "a, b", 'the "best"'])))
        size = draw(maybe(st.tuples(st.integers(4, 65536), st.integers(4, 65536)))) or (None, None)
        shot = Job(
            f"{draw(st.sampled_from(['left', 'Überblick, eins', '左']))} {i}",
            *([None] * 4 if camera else four),
            camera,
            *size,
            draw(maybe(st.integers(-1048574, 1048574))),
            draw(maybe(st.sampled_from(ENGINES))),
            draw(maybe(st.integers(1, 2**24))),
            draw(maybe(st.sampled_from(LEVELS))),
        )
        result.append(shot)
    return result


def as_cells(shot, in_parts):
    """A shot's values as texts, by column."""
    cells = {}
    for key in FIELDS:
        value = getattr(shot, key)
        if value is None:
            texts = ["", "", ""]
        else:
            texts = [repr(number) for number in value] if isinstance(value, tuple) else [str(value)]
        if key in ("eye", "look_at", "up") and in_parts:
            cells |= {f"{key}_{axis}": text for axis, text in zip("xyz", texts, strict=True)}
        else:
            cells[key] = ", ".join(texts) if value is not None else ""
    return cells


def as_objects(listed):
    return [shot.listed() for shot in listed]


def read(folder, name, text, cameras=None):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return lists.read(path, cameras)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("shots")


@settings(max_examples=50)
@given(
    lists_of_shots(),
    st.booleans(),
    st.sampled_from(",;\t|"),
    st.sampled_from(["\n", "\r\n", "\r", "\n\n", "\r\n \r\n"]),
    st.booleans(),
)
def test_a_csv_of_any_dialect_gives_every_bit_back(folder, listed, in_parts, separator, line_end, marked):
    table = [as_cells(shot, in_parts) for shot in listed]
    quoted = [['"' + text.replace('"', '""') + '"' for text in row.values()] for row in table]
    lines = [separator.join(row) for row in [list(table[0]), *quoted]]
    text = line_end.join(lines).encode("utf-8-sig" if marked else "utf-8")
    assert read(folder, "list.csv", text) == listed


@settings(max_examples=50)
@given(lists_of_shots(), st.booleans())
def test_json_and_json_lines_give_every_bit_back(folder, listed, with_nulls):
    objects = [{key: getattr(shot, key) for key in FIELDS} for shot in listed] if with_nulls else as_objects(listed)
    assert read(folder, "list.json", json.dumps(objects)) == listed
    assert read(folder, "list.json", json.dumps({"shots": objects}, indent=1)) == listed
    assert read(folder, "list.JSONL", "\n".join(map(json.dumps, objects))) == listed


@settings(max_examples=50)
@given(lists_of_shots(), lists_of_shots())
def test_defaults_are_what_a_shot_does_not_say(folder, listed, others):
    defaults = as_objects(others[:1])[0]
    del defaults["name"]
    for width in ("width", "height"):
        defaults.setdefault(width, 64)
    four = {"eye", "look_at", "up", "d"}
    expected = []
    for row in as_objects(listed):
        other_kind = four if "camera" in row else {"camera"}
        expected.append(Job(**{key: value for key, value in defaults.items() if key not in other_kind} | row))
    document = json.dumps({"defaults": defaults, "shots": as_objects(listed)})
    assert read(folder, "list.json", document) == expected


def test_a_default_and_a_shot_may_write_a_value_in_different_ways(folder):
    document = (
        '{"defaults": {"up_x": 0, "up_y": 0, "up_z": 1, "distance": 5, "eye": [1, 2, 3]}, "shots": [{"name": "a", "d": 7, '
    )
    document += '"up": [0, 1, 0], "look_at_x": 1, "look_at_y": 0, "look_at_z": 0}]}'
    assert read(folder, "list.json", document) == [Job("a", (1, 2, 3), (1, 0, 0), (0, 1, 0), 7)]


@given(st.binary(max_size=300), st.sampled_from(["list.csv", "list.json", "list.jsonl"]))
@example(b"[" * 100_000, "list.json")
@example(b"[" + b"9" * 5000 + b"]", "list.json")
@example(b'"', "list.csv")
@example(b"a" * 200_000, "list.csv")
@example(b'sep="\nname', "list.csv")
@example(b'{"shots": 1, "shots": [], "defaults": null}', "list.json")
def test_whatever_a_file_holds_it_is_shots_or_a_sentence(folder, data, name):
    with pytest.raises(InputError) as raised:
        read(folder, name, data)
    assert str(raised.value).isprintable() or isinstance(raised.value, ShotsError), str(raised.value)


def test_each_list_of_the_page_is_the_same_two_shots(folder):
    four = {"look_at": (0, 0, 1), "up": (0, 0, 1), "d": 400, "width": 320, "height": 180}
    two = [Job("left", eye=(-3, -6, 2.5), frame=12, **four), Job("right", eye=(3, -6, 2.5), **four)]
    examples = re.findall(r"```(csv|jsonl?)\n(.*?)```", PAGE.split("## What is wrong")[0], re.DOTALL)
    assert [suffix for suffix, _ in examples] == ["csv"] * 3 + ["json"] * 2 + ["jsonl"]
    for suffix, text in examples:
        assert read(folder, f"page.{suffix}", text) == two, text


def test_the_page_shows_the_problems_as_they_are_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ((_, table), (_, report)) = re.findall(r"```(csv|text)\n(.*?)```", PAGE.split("## What is wrong")[1], re.DOTALL)
    Path("shots.csv").write_text(table, encoding="utf-8")
    with pytest.raises(ShotsError) as raised:
        lists.read("shots.csv")
    assert f"{raised.value}\n" == report


def test_the_page_has_every_key_and_every_choice():
    table = PAGE.split("| key | value |")[1].split("\n\n")[0]
    keys = {key for cell in re.findall(r"(?m)^\| (`.*?) \|", table) for key in re.findall(r"`(\w+)`", cell)}
    assert keys == {*FIELDS}
    assert {*ENGINES, *LEVELS} <= {*re.findall(r"`(\w+)`", table)}


@pytest.mark.parametrize("name", ["list.txt", "list", "list.xlsx"])
def test_a_suffix_of_no_list_is_refused(folder, name):
    with pytest.raises(InputError, match=r"\.csv"):
        read(folder, name, "[]")


@pytest.mark.parametrize(
    ("name", "text"), [("a.csv", "name,camera\n,,\n"), ("a.csv", ""), ("a.json", "[]"), ("a.jsonl", "\n\n")]
)
def test_a_list_of_none_is_refused(folder, name, text):
    with pytest.raises(InputError, match="holds no shots"):
        read(folder, name, text)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_a_list_that_is_not_utf_8_is_refused(folder, encoding):
    with pytest.raises(InputError, match="save it as UTF-8"):
        read(folder, "list.csv", "name,camera\na,b\n".encode(encoding))


def test_a_list_that_is_not_there_or_a_folder_is_refused(tmp_path):
    (tmp_path / "folder.csv").mkdir()
    for name in ("none.csv", "folder.csv"):
        with pytest.raises(InputError, match="can't be read"):
            lists.read(tmp_path / name)


meters = st.floats(-1e3, 1e3, allow_subnormal=False)
places = st.tuples(meters, meters, meters)


@given(places, places, places, st.floats(10, 1e4), st.integers(1, 24))
def test_an_orbit_begins_at_the_camera_and_goes_evenly_around_up(eye, look_at, up, distance, count):
    reach = math.dist(eye, look_at)
    assume(reach > 1 and math.hypot(*up) > 1e-3)
    pinhole = Pinhole(eye, look_at, up, distance, 320, 180)
    assume(pinhole.sine_to_up > 1e-2)
    shots = makers.orbit(pinhole, count)
    assert shots[0] == Job("orbit_000", eye, look_at, up, distance, width=320, height=180)
    assert [shot.name for shot in shots] == [f"orbit_{i:03d}" for i in range(count)]
    axis = np.array(up) / math.hypot(*up)
    away = np.array([shot.eye for shot in shots]) - look_at
    # Rounding: a few operations on coordinates of up to 4e3, of 2⁻⁵³ each.
    allowed = 64 * 2.0**-53 * 4e3
    assert np.abs(np.linalg.norm(away, axis=1) - reach).max() <= allowed
    assert np.abs(away @ axis - away[0] @ axis).max() <= allowed
    u, _, w = pinhole.basis()
    outwards = w - (w @ axis) * axis
    radius, outwards = reach * np.linalg.norm(outwards), outwards / np.linalg.norm(outwards)
    for i, point in enumerate(away):
        angle = math.tau * i / count
        error = np.abs(point - (point @ axis) * axis - radius * (math.cos(angle) * outwards + math.sin(angle) * u)).max()
        assert error <= allowed, f"shot {i} of {count} is off by {error:.3g}, {allowed:.3g} is allowed"


def test_an_orbit_about_the_point_straight_below_turns_the_picture():
    shots = makers.orbit(Pinhole((0, 0, 5), (0, 0, 0), (0, 0, 1), 400, 320, 180), 8)
    assert {shot.eye for shot in shots} == {(0.0, 0.0, 5.0)}
    for i, shot in enumerate(shots):
        right = Pinhole(shot.eye, shot.look_at, shot.up, shot.d, 320, 180).basis()[0]
        angle = math.tau * i / 8  # from u = (0, −1, 0) on, as the canonical axes have it
        assert np.abs(right - (math.sin(angle), -math.cos(angle), 0)).max() <= 1e-15, f"shot {i} has u = {right}"


@pytest.mark.parametrize("count", [0, -1, 2.5, 1_000_001, 2**31, True])
def test_an_orbit_of_no_such_number_is_refused(count):
    with pytest.raises(InputError, match="shots"):
        makers.orbit(Pinhole((5, 0, 0), (0, 0, 0), (0, 0, 1), 400, 320, 180), count)


@given(st.integers(-1048574, 1048574), st.integers(0, 50))
def test_frames_are_a_shot_each_both_ends_included(first, more):
    last = min(first + more, 1048574)
    shots = makers.frames(f" {first}..{last} ", "Camera")
    assert [shot.frame for shot in shots] == list(range(first, last + 1))
    assert {shot.camera for shot in shots} == {"Camera"} and shots[0].eye is None
    assert len({shot.name for shot in shots}) == len(shots)
    if first >= 0:
        assert sorted(shots, key=lambda shot: shot.name) == list(shots), "the files do not sort as the frames do"


@pytest.mark.parametrize(
    "text", ["", "1", "1-9", "1...9", "a..b", "1..", "1.5..2", "9..1", "0..1048575", "0..999999999", "١..٢"]
)
def test_frames_that_are_no_range_are_refused(text):
    with pytest.raises(InputError, match=r"frames|frame of|shots: make"):
        makers.frames(text, "Camera")


def test_cameras_are_chosen_by_a_pattern_sorted_and_case_counts():
    names = ["Cam.002", "Top", "Cam.001", "cam.003", "Camera"]
    assert makers.from_cameras("Cam.*", names) == [Job("Cam.001", camera="Cam.001"), Job("Cam.002", camera="Cam.002")]
    assert [shot.name for shot in makers.from_cameras("[Cc]am.00?", names)] == ["Cam.001", "Cam.002", "cam.003"]
    assert len(makers.from_cameras("*", names)) == 5


def test_a_pattern_that_fits_no_camera_tells_which_there_are():
    with pytest.raises(InputError, match="called 'top': the file has Left, Top"):
        makers.from_cameras("top", ["Top", "Left"])
    with pytest.raises(InputError, match="has none"):
        makers.from_cameras("*", [])


def test_cameras_that_can_not_name_their_files_are_all_told():
    with pytest.raises(ShotsError) as raised:
        makers.from_cameras("*", ["a/b", "NUL", "left", "Left", "right", "right"])
    assert len(raised.value.problems) == 4, raised.value.problems
    for part in ("'a/b', which holds /", "'NUL', which is a device", "'Left' and 'left'", "'right' and 'right'"):
        assert any(part in problem for problem in raised.value.problems), part


def test_names_without_spaces_are_made_of_those_with_some_and_the_camera_is_still_the_same():
    names = ["Virtual Pinhole", "Left\u3000eye", "Right"]
    shots = makers.from_cameras("*", names, spaces=False)
    assert [(shot.name, shot.camera) for shot in shots] == [
        ("Left_eye", "Left\u3000eye"),
        ("Right", "Right"),
        ("Virtual_Pinhole", "Virtual Pinhole"),
    ]
    assert [shot.name for shot in makers.from_cameras("* *", names)] == ["Virtual Pinhole"]
    with pytest.raises(ShotsError, match="'A b' and 'a_B' would have one file"):
        makers.from_cameras("*", ["A b", "a_B"], spaces=False)
    with pytest.raises(ShotsError, match="begins or ends with a blank"):
        makers.from_cameras("*", [" a"], spaces=True)


def test_pinholes_whose_names_would_be_one_file_are_shots_with_numbers():
    pinhole = Pinhole((5, 0, 0), (0, 0, 0), (0, 0, 1), 400, 320, 180)
    shots = makers.from_pinholes((name, pinhole) for name in ("left/1", "left_1", "LEFT:1", "b"))
    assert [shot.name for shot in shots] == ["left_1", "left_1_2", "LEFT_1_3", "b"]


def test_an_orbit_keeps_the_principal_point_and_the_mirroring():
    pinhole = Pinhole((5, 0, 0), (0, 0, 0), (0, 0, 1), 400, 320, 180, (100, 120), mirrored=True)
    for shot in makers.orbit(pinhole, 3):
        assert (shot.principal_point, shot.mirrored, shot.width, shot.height) == ((100, 120), True, 320, 180)


@pytest.mark.parametrize(
    "make",
    [
        lambda: makers.orbit(Pinhole((5, 0, 0), (0, 0, 0), (0, 0, 1), 400, 320, 180), 1_000_000),
        lambda: makers.frames("1..1000000", "Camera"),
    ],
)
def test_of_a_million_shots_those_of_a_shard_are_made_and_no_others(make, monkeypatch):
    """One shot of a million took three minutes."""
    made_ones = []
    monkeypatch.setattr(makers, "Job", lambda name, *values, **named: made_ones.append(name) or Job(name, *values, **named))
    (last,) = shard(make(), "999999/1000000")
    assert last.name in ("orbit_999998", "frame_0999999") and len(made_ones) <= 3
    several = shard(make(), "2/100000")
    assert len(several) == 10 and len(made_ones) <= 3 + 12
    assert several[1].name in ("orbit_100001", "frame_0100002")
    assert make()[:3][-1] == list(make()[:3])[2]
    with pytest.raises(IndexError):
        make()[1_000_000]
