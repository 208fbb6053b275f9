"""Shots by rule: what an orbit keeps, which frames and cameras are meant."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.jobs import makers
from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.problems import ShotsError
from viewcam_addon.jobs.shards import shard
from viewcam_addon.pinhole import Pinhole

coordinates = st.floats(-1e3, 1e3, allow_subnormal=False)
triples = st.tuples(coordinates, coordinates, coordinates)


@given(triples, triples, triples, st.floats(10, 1e4), st.integers(1, 24))
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
