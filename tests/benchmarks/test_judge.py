"""The chart of the judge: its faults are faults, and what a good renderer makes is not one."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("flip_evaluator")

from benchmarks.judge import detection, faults, rivals
from viewcam_addon.comparison import radiance, sequential
from viewcam_addon.image import Image


@pytest.fixture(scope="module")
def block():
    return detection.Block(detection.Bench(), 0)


def test_there_are_sixty_faults_of_four_families_each_with_a_name_of_its_own():
    assert len(faults.FAULTS) == 60 == len({fault.name for fault in faults.FAULTS})
    assert len(faults.FAMILIES) == 4
    assert all((fault.of_scene is None) != (fault.of_picture is None) for fault in faults.FAULTS)
    for fault in faults.FAULTS:
        assert (faults.changed(fault) != faults.room()) == (fault.of_scene is not None), fault.name


@pytest.mark.exhaustive
def test_good_pictures_pass_and_a_fault_of_each_family_is_found_in_each(block):
    good = block.good()
    assert len(good) == detection.SIDE**2 and all(record["ours"] < 1 for record in good), good
    assert len({record["ours"] for record in good}) == len(good), "no pair is another's"
    for name in ("shifted by 0.01 px upwards", "the ball moved by 0.001", "the lamp 3.0% dimmer", "a firefly"):
        (fault,) = (fault for fault in faults.FAULTS if fault.name == name)
        record = block.faulty(fault)
        assert len(record) == detection.SIDE and all(each["ours"] > 1 for each in record), (name, record)
        assert set(record[0]) == {"ours", "FLIP", "idiff", "SSIM", "z-test"}
    assert block.good() == good, "a fault of the picture is put into a copy"


def test_a_chart_counts_what_is_missed_at_how_few_false_alarms():
    clean = {"ours": np.arange(100.0) / 100, "SSIM": np.arange(10.0), "FLIP": np.zeros(10)}
    values = {faults.FAULTS[0]: {"ours": np.array([2.0, 0.5]), "SSIM": np.array([8.5]), "FLIP": np.zeros(1)}}
    chart = detection._chart("all", values, clean)
    ours, ssim, _ = chart.curves
    assert list(ours.x) == [1e-2, 3e-2, 0.1, 0.3] and list(ours.y) == [0.5] * 4
    assert list(ssim.x) == [0.1, 0.3] and list(ssim.y) == [0.0, 0.0]
    assert ours.ours and "ours 50.0% at 0.00%" in chart.reading


def test_alarms_that_come_together_are_counted():
    side = detection.SIDE
    scores = np.zeros((4, side, side))
    assert detection.together(scores.ravel() + np.arange(4 * side**2), 0.01) == 0.0
    scores[1, 2] = 1.0  # one picture against all references
    assert detection.together(scores.ravel(), 0.05) == 0.5


@pytest.mark.exhaustive
@pytest.mark.parametrize("family", ["light", "picture", "none"])
def test_a_search_for_half_a_percent_finds_what_a_thousand_samples_find_and_takes_a_quarter_of_them(family):
    """All but one of the faults of light, and of the picture; geometry is compared without samples."""
    bench, is_missed = detection.Bench(), "the sun is a fifth wider"
    right = [None] * 3
    asked = right if family == "none" else [fault for fault in faults.FAULTS if fault.family == family]
    took = {}
    for number, fault in enumerate(asked):
        comparison = _searched(bench, fault, 1000 * (1 + number))
        expected = fault is None or fault.name == is_missed
        assert comparison.passed == expected, (fault, comparison.sentence)
        took[number] = comparison.search.samples
        assert took[number] <= 256, (fault, took[number])
    if family != "none":
        assert np.median(list(took.values())) == 16


def _searched(bench, fault, seed):
    """The comparison in rounds of the room with a fault with the room."""
    rounds, total = sequential.Rounds(), sequential.TOTALS[0]
    tracer = bench.faulty[fault] if fault else bench.tracer
    for number in itertools.count():
        samples = total - rounds.samples
        reference = Image(bench.tracer.render_light("path", samples, seed + number), bench.camera, {"samples": str(samples)})
        tests = []
        for i in range(8):
            passes = tracer.render_light("path", samples // 8, 10**6 + seed + 8 * number + i)
            if fault and fault.of_picture:
                fault.of_picture(passes, np.random.default_rng(seed))  # one place in all of them
            tests.append(rivals.without_the_tracers_own(Image(passes, attributes={"samples": str(samples // 8)})))
        rounds.add(samples, reference, tests, None)
        pictures = rounds.reference, rounds.tests, bench.camera, rounds.samples // 8
        comparison = radiance.compare(*pictures, false_alarms=sequential.FALSE_ALARMS_OF_EACH)
        search = sequential.search(comparison, 0.005, rounds)
        if search.is_decided:
            return replace(comparison, search=search)
        total = search.following
