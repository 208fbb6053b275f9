import dataclasses
import itertools
import math
import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import race
from benchmarks.speed import contest, figures, references, standings
from benchmarks.speed.contest import Effort, Method, Point
from benchmarks.speed.standings import Contested, reached
from viewcam_addon import image
from viewcam_addon.errors import InputError

OURS = Method("ours", "ours", "samples", (1.0, 2.0, 4.0, 8.0), ours=True)
CYCLES = Method("Cycles", "Cycles", "samples", (1.0, 2.0, 4.0, 8.0), rival=True)


def power_law(seconds, exponent, parameters=(1.0, 4.0, 16.0, 64.0)):
    """Points whose time goes with the parameter and whose error goes with a power of it."""
    return [Point(n, [seconds * n], [0.1 * n**exponent]) for n in parameters]


def contestants(log, seconds=lambda side, parameter: 0.0):
    """Sides that render nothing and write down who was asked for what."""

    def runner(side, sampling, parameter, seed, path):
        log.append((side, parameter, seed))
        return seconds(side, parameter)

    return {side: {"picture": lambda *asked, side=side: runner(side, *asked)} for side in ("ours", "Cycles")}


# How a contest goes.


def test_methods_take_turns_in_every_round_after_one_to_warm_up():
    log = []
    tracks = contest.measure(contestants(log), (OURS, CYCLES), "picture", lambda _: 1.0, Effort(2, 0.0, math.inf), None)
    turns = [(side, n, seed) for seed in (1, 2) for n in OURS.parameters for side in ("ours", "Cycles")]
    assert log == [("ours", 1.0, 0), ("Cycles", 1.0, 0), *turns]
    assert all(len(point.seconds) == len(point.errors) == 2 for points in tracks.values() for point in points)


def test_a_method_stops_when_it_is_good_enough_and_the_other_goes_on():
    errors = iter([0.1, 0.1, 0.01, 0.1, 0.1, 0.1])
    effort = Effort(1, enough=0.02, longest=math.inf)
    tracks = contest.measure(contestants([]), (OURS, CYCLES), "picture", lambda _: next(errors), effort, None)
    assert [len(points) for points in tracks.values()] == [2, 4]


def test_a_method_stops_after_a_picture_that_takes_too_long():
    sides = contestants([], lambda side, parameter: parameter)
    tracks = contest.measure(sides, (OURS,), "picture", lambda _: 1.0, Effort(1, 0.0, longest=3.0), None)
    assert [point.parameter for point in tracks[OURS]] == [1.0, 2.0, 4.0]


def test_a_method_whose_least_effort_takes_far_too_long_is_left_out_and_named(capsys):
    sides = contestants([], lambda side, parameter: 100.0 if side == "Cycles" else 0.1)
    tracks = contest.measure(sides, (OURS, CYCLES), "picture", lambda _: 1.0, Effort(1, 0.0, longest=3.0), None)
    assert list(tracks) == [OURS]
    assert "Cycles is left out: 100 s" in capsys.readouterr().out


def test_the_parameters_near_a_target_are_those_on_both_sides_of_it():
    points = power_law(1.0, -0.5)  # errors 0.1, 0.05, 0.025, 0.0125
    assert contest.near(points, [0.03]) == (4.0, 16.0)
    assert contest.near(points, [0.5]) == (1.0,)
    assert contest.near(points, [0.001]) == (16.0, 64.0)
    assert contest.near(points, [0.03, 0.001]) == (4.0, 16.0, 64.0)


# Who is ahead.


@given(st.floats(-1.5, -0.3), st.floats(0.01, 10.0), st.floats(0.001, 1.0))
def test_between_points_of_a_power_law_the_time_is_that_of_the_law(exponent, seconds, share):
    points = power_law(seconds, exponent)
    target = points[0].error * (points[-1].error / points[0].error) ** share
    actual = reached(OURS, points, target)
    assert not actual.beyond
    # t = s (target/0.1)^(1/exponent), in logarithms and back: some roundings of the exponent's inverse, at most 3.4.
    assert actual.seconds == pytest.approx(seconds * (target / 0.1) ** (1 / exponent), rel=1e-12)


def test_beyond_its_points_a_curve_is_followed_on_no_further_than_to_a_quarter_of_its_error_and_that_is_said():
    points = power_law(1.0, -0.5)
    actual = reached(OURS, points, points[-1].error / 2)
    assert actual.beyond and actual.seconds == pytest.approx(256.0) and "followed on" in actual.summary()
    assert reached(OURS, points, points[-1].error / 5) is None


def test_a_curve_that_hardly_falls_reaches_nothing():
    flat = [Point(1.0, [1.0], [0.1]), Point(2.0, [2.0], [0.09])]
    assert reached(OURS, flat, 0.03) is None
    assert reached(OURS, flat[:1], 0.01) is None


def test_a_first_point_that_is_good_enough_is_taken_as_it_is():
    assert reached(OURS, power_law(3.0, -0.5), 0.2).seconds == 3.0


def test_the_best_of_each_side_is_compared_and_one_that_gets_there_is_better_than_one_that_is_followed_on():
    slow, fast, short = (dataclasses.replace(CYCLES, name=name) for name in ("slow", "fast", "short"))
    tracks = {
        OURS: power_law(0.1, -0.5),
        slow: power_law(2.0, -0.5),
        fast: power_law(1.0, -0.5),
        short: power_law(0.5, -0.5, (1.0, 4.0)),
    }
    (standing,) = standings.standings(standings.times(tracks, [0.02], reference_error=0.001), {0.02: 8.0})
    assert standing.rival.method == fast
    assert standing.ratio == pytest.approx(10.0)


def test_nobody_is_ahead_where_the_reference_can_not_tell():
    tracks = {OURS: power_law(0.1, -0.5), CYCLES: power_law(1.0, -0.5)}
    assert standings.times(tracks, [0.02], reference_error=0.03) == {}


def contested(wanted, judged=True):
    tracks = {OURS: power_law(0.1, -0.5), CYCLES: power_law(1.0, -0.5)}
    times = standings.times(tracks, [0.02], 0.0)
    ranked = standings.standings(times, {0.02: wanted})
    curves = standings.curves(tracks, 0.0)
    return Contested("name", "A title", "x", "y", curves, "Read this.", 0.0, standings=ranked, times=times, judged=judged)


def test_who_is_the_best_of_his_side_nowhere_stays_in_the_background():
    slow = dataclasses.replace(CYCLES, name="Cycles, slowly")
    tracks = {OURS: power_law(0.1, -0.5), CYCLES: power_law(1.0, -0.5), slow: power_law(10.0, -0.5)}
    ranked = standings.standings(standings.times(tracks, [0.02], 0.0), {0.02: None})
    assert {curve.name: curve.minor for curve in standings.curves(tracks, 0.0, ranked)} == {
        "ours": False,
        "Cycles": False,
        "Cycles, slowly": True,
    }


def test_a_ratio_that_is_less_than_wanted_is_told_in_a_sentence_with_both_times():
    (sentence,) = contested(11.0).behind()
    assert "A title: to 0.02 ours 2.5 s, Cycles 25 s: 10.00 times as fast, wanted 11" in sentence


def test_the_times_of_all_methods_are_told_as_a_table_and_as_figures():
    chart = contested(9.0)
    assert chart.lines() == ["  to 0.02", "    ours 2.5 s", "    Cycles 25 s"]
    assert [each["method"] for each in chart.figures()["times"]["0.02"]] == ["ours", "Cycles"]
    assert chart.figures()["standings"][0]["ratio"] == pytest.approx(10.0)


@pytest.mark.parametrize(("wanted", "judged"), [(9.0, True), (None, True), (11.0, False)])
def test_a_ratio_that_is_enough_or_not_asked_for_or_of_a_quick_run_is_not_told(wanted, judged):
    assert contested(wanted, judged).behind() == []


def test_a_point_by_the_line_through_the_last_two_has_the_time_of_as_many_samples():
    points = [Point(n, [0.5 + 0.1 * n], [1 / n]) for n in (64.0, 128.0)]
    *before, added = standings.with_point_by_line(points, 1024, 0.001)
    assert before == points and added.time == pytest.approx(102.9) and added.error == 0.001
    assert standings.with_point_by_line(points, 100, 0.001) == points


# What errors are measured against.


def noisy(rng, true, *deviations, bias=0.0):
    return np.stack([true + bias + rng.normal(0, deviation, true.shape) for deviation in deviations])


def test_the_error_of_a_reference_is_what_its_halves_tell_of_it():
    """Two sides with standard deviations of 0.02 and 0.01 a half; over 30,000 values their estimates are off by 0.6 %."""
    rng = np.random.default_rng(1)
    true = rng.random((100, 100, 3))
    halves = {"one": noisy(rng, true, 0.02, 0.02), "other": noisy(rng, true, 0.01, 0.01)}
    reference = references.combine(halves, {"one": 5, "other": 7})
    assert reference.error == pytest.approx(references.rms(reference.picture - true), rel=0.03)
    assert reference.error < 0.01 / math.sqrt(2)
    assert reference.differ == pytest.approx(reference.explained, rel=0.03)
    assert [half.error for half in reference.halves] == pytest.approx([0.02, 0.01], rel=0.03)


def test_sides_that_converge_to_different_pictures_are_told():
    rng = np.random.default_rng(2)
    true = rng.random((100, 100, 3))
    halves = {"one": noisy(rng, true, 0.01, 0.01), "other": noisy(rng, true, 0.01, 0.01, bias=0.02)}
    reference = references.combine(halves, {"one": 5, "other": 5})
    assert reference.differ > 2 * reference.explained


def test_the_reference_s_own_variance_is_taken_off(tmp_path):
    rng = np.random.default_rng(3)
    true = rng.random((100, 100, 3))
    reference = references.combine({side: noisy(rng, true, 0.02, 0.02) for side in ("one", "other")}, {"one": 1, "other": 1})
    test = (true + rng.normal(0, 0.01, true.shape)).astype(np.float32)
    image.write(tmp_path / "test.exr", image.Image({"Combined": np.dstack([test, np.ones_like(test[..., 0])])}))
    assert reference.error == pytest.approx(0.01, rel=0.03)  # as large as what is measured
    assert reference.error_of(tmp_path / "test.exr") == pytest.approx(0.01, rel=0.05)


def test_a_reference_is_made_once_for_each_scene(tmp_path):
    asked = []

    def picture(sampling, samples, seed, path):
        asked.append((seed, samples))
        pixels = np.random.default_rng(seed).random((4, 5, 4)).astype(np.float32)
        image.write(path, image.Image({"Combined": pixels}))
        return 1.0

    scene = tmp_path / "scene.json"
    sides = {side: {"picture": picture} for side in ("one", "other")}
    for text, count in (("a scene", 1), ("a scene", 1), ("another", 2)):
        scene.write_text(text)
        reference = references.reference("name", scene, sides, {"one": 256, "other": 64}, tmp_path / "kept")
        assert len(asked) == 4 * count
    assert {samples for _, samples in asked} == {half.samples for half in reference.halves} == {256, 64}
    assert len({seed for seed, _ in asked}) == 2


def test_uniform_curves_of_both_sides_go_on_with_the_reference_s_halves_and_no_other_does():
    halves = tuple(references.Half(side, 256, 0.001) for side in ("ours", "Cycles"))
    scene = references.Reference(np.zeros((1, 1, 3)), 0.0007, 0.001, 0.001, halves)
    adaptive = dataclasses.replace(OURS, name="adaptive", sampling="error")
    for method, more in ((OURS, 1), (CYCLES, 1), (adaptive, 0), (dataclasses.replace(CYCLES, rival=False), 0)):
        points = figures._with_half(method, power_law(1.0, -0.5), scene)
        assert len(points) == 4 + more, method
        assert not more or (points[-1].time, points[-1].error) == (pytest.approx(256.0), 0.001)


# Contestants.


def offers(factor):
    def fail():
        raise KeyError("gone")

    return {
        "times": lambda number: factor * number,
        "environment": lambda: os.environ["A_CONTESTANT_S"],
        "fail": fail,
    }


def test_a_contestant_takes_arguments_and_finds_its_environment():
    with race.Contestant(offers, 3, environment={"A_CONTESTANT_S": "own"}) as contestant:
        asked = contestant.runners()
        assert asked["times"](4) == 12
        assert asked["environment"]() == "own"
    assert "A_CONTESTANT_S" not in os.environ


def test_what_goes_wrong_in_a_contestant_s_process_is_raised_here():
    with pytest.raises(InputError, match=r"KeyError.*gone"), race.Contestant(offers, 3) as contestant:
        contestant.runners()["fail"]()


# All of it.


def test_a_scene_is_raced_from_the_blend_to_the_charts(tmp_path, monkeypatch):
    """Both figures of the studio still, 96 × 54 pixels, to an error of 0.05."""
    pytest.importorskip("bpy")
    from benchmarks.speed import stills

    monkeypatch.setattr(references, "FOLDER", tmp_path)
    chosen = {f"{stills.OURS}, adaptive", f"{stills.OURS}, uniform", stills.CYCLES}
    few = [dataclasses.replace(each, parameters=each.parameters[:3]) for each in stills.METHODS if each.name in chosen]
    monkeypatch.setattr(stills, "METHODS", tuple(few))
    studio = next(still for still in stills.STILLS if still.name == "studio")
    samples = {stills.OURS: 1024, stills.CYCLES: 512}
    small = dataclasses.replace(studio, size=(384, 216), wanted={0.005: (8, 3)}, samples=samples)
    picture, job = stills.charts(small, quick=True)
    assert picture.name == "studio-picture" and job.name == "studio-whole-job"
    assert {curve.name for curve in picture.curves} == chosen
    measured = picture.figures()["methods"]
    for name, points in measured.items():
        errors = [point["error"] for point in points]
        assert errors == sorted(errors, reverse=True), f"{name} does not get better: {errors}"
    # Both sides see the same: their difference is noise, but for what chance and a few bright edges add.
    figures = picture.figures()["reference"]
    assert figures["sides differ by"] < 1.5 * figures["explained by noise"]


def test_mitsuba_converges_to_the_same_picture(tmp_path):
    """Two Lambert boxes under a sun, by its scalar variant: as far from ours as the noise of both."""
    mitsuba = pytest.importorskip("mitsuba")
    del mitsuba
    from benchmarks.speed import mitsuba3, tracer
    from viewcam_addon.pinhole import Pinhole
    from viewcam_addon.tracer.scene import Mesh, Object, Scene, scene_file
    from viewcam_addon.tracer.scene.film import Film
    from viewcam_addon.tracer.scene.lamps import Sun

    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([face for a, b, c, d in faces for face in ((a, b, c), (a, c, d))], np.int32)
    box = Mesh(corners, triangles, np.zeros(12, np.int32))
    floor = np.diag([8.0, 8.0, 0.1, 1.0])
    floor[2, 3] = -1.1
    scene = Scene(
        camera=Pinhole((3, -6, 3), (0, 0, 0), (0, 0, 1), 60, 64, 48),
        geometries={"box": box},
        objects=(Object("box", "box", np.eye(4)), Object("floor", "box", floor)),
        lamps=(Sun("sun", towards=(0.5, -0.3, 0.8), irradiance=(3.0, 2.0, 1.0)),),
        clip=(0.1, 100.0),
        film=Film("BOX"),
    )
    scene_file.write(scene, tmp_path / "scene.json")
    with race.Contestant(mitsuba3.prepare, tmp_path / "scene.json", tmp_path / "theirs", mitsuba3.SCALAR, 2) as expected:
        expected.runners()["picture"]("samples", 64, 1, tmp_path / "theirs.exr")
    tracer.prepare(tmp_path / "scene.json", "direct", 2)["picture"]("samples", 64, 1, tmp_path / "ours.exr")
    difference = references.combined(tmp_path / "theirs.exr") - references.combined(tmp_path / "ours.exr")
    # An edge's pixel is off by about 0.35 · 64^−¾ = 0.015 of its contrast, here 1; a tenth of the pixels have an edge, and both
    # sides noise: 0.015 √0.1 √2 = 0.007. A sun that is turned by a degree would be off by as much on every lit pixel.
    assert references.rms(difference) < 0.01, references.rms(difference)
