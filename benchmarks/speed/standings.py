"""The standings: from points to the time that an error takes, and from that to charts that say who is ahead and judge it."""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..charts import Chart, Curve
from .contest import Method, Point, Tracks

# The factors by which a curve may be followed on to a smaller error, and by which it must have fallen just before.
_FURTHEST, _STEEP = 4, 1.3


@dataclass(frozen=True)
class Reached:
    """The time in which a method reaches an error.

    seconds : the seconds that a method takes to an error.
    beyond : true if its points end before, and the last two were followed on.
    """

    method: Method
    seconds: float
    beyond: bool

    def summary(self) -> str:
        return f"{self.method.name} {self.seconds:.3g} s{' (its curve followed on)' if self.beyond else ''}"

    def figures(self) -> dict[str, object]:
        return {"method": self.method.name, "seconds": self.seconds, "beyond its points": self.beyond}


@dataclass(frozen=True)
class Standing:
    """The best of ours beside the best of the rivals, at one error. wanted : times as fast, None where nothing is asked for."""

    target: float
    ours: Reached
    rival: Reached
    wanted: float | None

    @property
    def ratio(self) -> float:
        return self.rival.seconds / self.ours.seconds

    def summary(self) -> str:
        wanted = "" if self.wanted is None else f", wanted {self.wanted:g}"
        return f"to {self.target:g} {self.ours.summary()}, {self.rival.summary()}: {self.ratio:.2f} times as fast{wanted}"

    def figures(self) -> dict[str, object]:
        sides = {"ours": self.ours.figures(), "rival": self.rival.figures()}
        return {"error": self.target, **sides, "ratio": self.ratio, "wanted": self.wanted}


@dataclass(frozen=True)
class Contested(Chart):
    """A chart of error against time, judged by its standings.

    standings : each with ratio, wanted, summary() and figures().
    times : error → when each method reaches it.
    measured : all points, for JSON.
    judged : true if what is wanted and missed counts.
    """

    standings: tuple[Any, ...] = ()
    times: Mapping[float, tuple[Reached, ...]] = field(default_factory=dict)
    measured: Mapping[str, object] = field(default_factory=dict)
    judged: bool = True

    def behind(self) -> list[str]:
        missed = (standing for standing in self.standings if standing.wanted is not None and standing.ratio < standing.wanted)
        return [f"{self.title}: {standing.summary()}" for standing in missed if self.judged]

    def lines(self) -> list[str]:
        """A table of the times of all methods, the fastest first."""
        lines = []
        for target, all_reached in self.times.items():
            lines += [
                f"  to {target:g}",
                *(f"    {each.summary()}" for each in sorted(all_reached, key=lambda each: each.seconds)),
            ]
        return lines

    def figures(self) -> dict[str, object]:
        times = {f"{target:g}": [each.figures() for each in all_reached] for target, all_reached in self.times.items()}
        return {
            **super().figures(),
            **self.measured,
            "times": times,
            "standings": [standing.figures() for standing in self.standings],
        }


def reached(method: Method, points: Sequence[Point], target: float) -> Reached | None:
    """The time at which the error is the target: between neighbors log error goes with log time. None where points don't tell.

    Where the first point is good enough already, its time.
    """
    if points and points[0].error <= target:
        return Reached(method, points[0].time, False)
    known = [point for point in points if point.error > 0]
    for first, other in itertools.pairwise(known):
        if other.error <= target:
            return Reached(method, _followed(first, other, target), False)
    if len(known) < 2 or target < known[-1].error / _FURTHEST:
        return None
    if known[-1].error * _STEEP > known[-2].error or known[-1].time <= known[-2].time:
        return None
    return Reached(method, _followed(*known[-2:], target), True)


def _followed(point: Point, next_point: Point, target: float) -> float:
    """The line through two points, in logarithms."""
    share = math.log(target / point.error) / math.log(next_point.error / point.error)
    return point.time * (next_point.time / point.time) ** share


def times(tracks: Tracks, targets: Iterable[float], reference_error: float) -> dict[float, tuple[Reached, ...]]:
    """Error → when each method reaches it, of those errors that the reference is good enough to tell."""
    return {
        target: tuple(each for method, points in tracks.items() if (each := reached(method, points, target)))
        for target in targets
        if target >= reference_error
    }


def standings(times: Mapping[float, tuple[Reached, ...]], wanted: Mapping[float, float | None]) -> tuple[Standing, ...]:
    """One for each error that both sides reach. wanted : error → times as fast."""
    result = []
    for target, all_reached in times.items():
        ours = _best(each for each in all_reached if each.method.ours)
        rival = _best(each for each in all_reached if each.method.rival)
        if ours and rival:
            result.append(Standing(target, ours, rival, wanted[target]))
    return tuple(result)


def _best(all_reached: Iterable[Reached]) -> Reached | None:
    """The fastest; whoever's curve had to be followed on only where all had to be."""
    return min(all_reached, key=lambda each: (each.beyond, each.seconds), default=None)


def with_point_by_line(points: Sequence[Point], samples: int, error: float) -> list[Point]:
    """One point more, of samples whose error is known from the reference: its time by the line through the last two.

    None more where the last took no longer than the one before it: their times tell nothing of samples yet.
    """
    if len(points) < 2 or samples <= points[-1].parameter:
        return list(points)
    first, other = points[-2:]
    slope = (other.time - first.time) / (other.parameter - first.parameter)
    if slope <= 0:
        return list(points)
    return [*points, Point(samples, [other.time + slope * (samples - other.parameter)], [error])]


def curves(tracks: Tracks, least: float, judged: Sequence[Standing] = ()) -> tuple[Curve, ...]:
    """The curves of a chart, one for each method.

    least : points of smaller errors are left out.
    judged : the methods that are judged; one that is the best of its side in none stays in the background.
    """
    result, best = [], {side.method for standing in judged for side in (standing.ours, standing.rival)}
    for method, points in tracks.items():
        visible_points = [point for point in points if point.error >= least]
        spread = tuple((min(point.seconds), max(point.seconds)) for point in visible_points)
        x, y = [point.time for point in visible_points], [point.error for point in visible_points]
        minor = bool(best) and method not in best
        result.append(Curve(method.name, x, y, ours=method.ours, spread=spread, minor=minor))
    return tuple(result)


def measured(tracks: Tracks) -> dict[str, object]:
    """All points, for JSON."""
    return {
        method.name: [
            {"parameter": point.parameter, "seconds": point.seconds, "errors": point.errors, "error": point.error}
            for point in points
        ]
        for method, points in tracks.items()
    }
