"""The chart of the judge: its faults are faults, and what a good renderer makes is not one."""

import numpy as np
import pytest

pytest.importorskip("flip_evaluator")

from benchmarks.judge import detection, faults
from viewcam_addon.tracer.render import Tracer


@pytest.fixture(scope="module")
def bench():
    return detection.Bench()


def test_there_are_sixty_faults_of_four_families_each_with_a_name_of_its_own():
    assert len(faults.FAULTS) == 60 == len({fault.name for fault in faults.FAULTS})
    assert len(faults.FAMILIES) == 4
    assert all((fault.of_scene is None) != (fault.of_picture is None) for fault in faults.FAULTS)
    for fault in faults.FAULTS:
        assert (faults.changed(fault) != faults.room()) == (fault.of_scene is not None), fault.name


@pytest.mark.exhaustive
def test_a_good_picture_passes_and_a_fault_of_each_family_is_found(bench):
    good = [bench.trial(Tracer(bench.scene), None, seed) for seed in range(3)]
    assert all(said["ours"] < 1 for said in good), good
    for name in ("shifted by 0.01 px upwards", "the ball moved by 0.001", "the lamp 3.0% dimmer", "a firefly"):
        (fault,) = (fault for fault in faults.FAULTS if fault.name == name)
        said = bench.trial(Tracer(detection._scene(faults.changed(fault))), fault, 7)
        assert said["ours"] > 1, (fault.name, said)


def test_a_chart_counts_what_is_missed_at_how_many_false_alarms():
    clean = {"ours": np.arange(100.0) / 100, "SSIM": np.arange(100.0)}
    scores = [{"ours": np.array([2.0, 0.5]), "SSIM": np.array([98.5, 20.0])}]
    chart = detection._chart("all", scores, clean, 2, 100)
    ours, other = chart.curves
    assert list(ours.x) == [1e-2, 3e-2, 0.1, 0.3]
    assert list(ours.y) == [0.5, 0.5, 0.5, 0.5] and list(other.y) == [0.5, 0.5, 0.5, 0.5]
    assert ours.ours and "ours 50.0% at 0.00%" in chart.reading
