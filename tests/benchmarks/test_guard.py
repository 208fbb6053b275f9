"""The guard of speed. `make bench-guard` and CI run what is marked; the rest is arithmetic."""

import json
import time

import pytest

pytest.importorskip("embreex")

from benchmarks import guard
from viewcam_addon.tracer.render import Tracer

RECORDED = json.loads(guard.RECORDED.read_text(encoding="utf-8"))


def test_a_ratio_may_fall_by_less_than_a_third():
    recorded = {"geometry": 0.6, "direct": 1.2}
    assert guard.fallen({"geometry": 0.41, "direct": 0.81}, recorded) == []
    (sentence,) = guard.fallen({"geometry": 0.39, "direct": 2.0}, recorded)
    assert sentence == "geometry: 0.39 of the yardstick's speed, and 0.60 was recorded: it has fallen by a third"
    assert len(guard.fallen({"geometry": float("nan"), "direct": 0.5}, recorded)) == 2


def test_what_is_slow_in_every_attempt_has_fallen_and_what_is_slow_in_two_has_not(monkeypatch):
    recorded, asked = {"geometry": 0.6, "direct": 1.0}, []
    actual = iter([{"geometry": 0.1, "direct": 0.9}, {"geometry": 0.2}, {"geometry": 0.5}])

    def measure(names):
        asked.append(names)
        return next(actual)

    monkeypatch.setattr(guard, "measure", measure)
    assert guard.judged(recorded) == ({"geometry": 0.5, "direct": 0.9}, [])
    assert asked == [["geometry", "direct"], ["geometry"], ["geometry"]]
    monkeypatch.setattr(guard, "measure", lambda names: dict.fromkeys(names, 0.35))
    _, sentences = guard.judged(recorded)
    assert len(sentences) == 2 and sentences[0].startswith("geometry: 0.35")


def test_everything_that_is_measured_has_a_ratio():
    assert RECORDED.keys() == guard._MEASURES.keys() == {"geometry", "direct", "path", "adaptive"}


@pytest.mark.speed
def test_the_tracer_has_not_become_slower_by_a_third():
    ratios, sentences = guard.judged(RECORDED)
    assert not sentences, f"{sentences}, of {ratios}"


def _traced_three_times():
    """Each picture of geometry is traced three times."""
    render = Tracer.render

    def thrice(self):
        render(self)
        render(self)
        return render(self)

    Tracer.render = thrice


def _sleep():
    """Each picture of light takes a sleep twice as long as itself."""
    render_light = Tracer.render_light

    def slow(self, *arguments):
        start = time.perf_counter()
        passes = render_light(self, *arguments)
        time.sleep(2 * (time.perf_counter() - start))
        return passes

    Tracer.render_light = slow


@pytest.mark.speed
@pytest.mark.parametrize(("sabotage", "name"), [(_traced_three_times, "geometry"), (_sleep, "direct")])
def test_what_takes_three_times_as_long_is_told(sabotage, name):
    # Against this machine's own ratio: half of what a third less allows is left for noise, whatever was recorded elsewhere.
    undisturbed, slow = guard.measure([name]), guard.measure([name], sabotage)
    assert guard.fallen(slow, undisturbed), f"{slow} is not told from {undisturbed}"
