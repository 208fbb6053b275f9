"""Who is ahead: from points to the time that an error takes, and from that to charts that say so and judge it."""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..charts import Chart, Curve
from .contest import Method, Point, Tracks

# How much smaller an error a curve may be followed on to.
_FURTHEST = 4


@dataclass(frozen=True)
class Reached:
    """seconds : that a method takes to an error. beyond : whether its points end before, and the last two were followed on."""

    method: Method
    seconds: float
    beyond: bool

    def told(self) -> str:
        return f"{self.method.name} {self.seconds:.3g} s{' (its curve followed on)' if self.beyond else ''}"


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

    def told(self) -> str:
        wanted = "" if self.wanted is None else f", wanted {self.wanted:g}"
        return f"to {self.target:g} {self.ours.told()}, {self.rival.told()}: {self.ratio:.2f} times as fast{wanted}"

    def figures(self) -> dict[str, object]:
        sides = {
            who: {"method": reached.method.name, "seconds": reached.seconds, "beyond its points": reached.beyond}
            for who, reached in (("ours", self.ours), ("rival", self.rival))
        }
        return {"error": self.target, **sides, "ratio": self.ratio, "wanted": self.wanted}


@dataclass(frozen=True)
class Contested(Chart):
    """A chart of error against time, judged by its standings.

    standings : each with ratio, wanted, told() and figures(). measured : all points, for JSON. judged : whether what is wanted
    and missed counts.
    """

    standings: tuple[Any, ...] = ()
    measured: Mapping[str, object] | None = None
    judged: bool = True

    def behind(self) -> list[str]:
        missed = (standing for standing in self.standings if standing.wanted is not None and standing.ratio < standing.wanted)
        return [f"{self.title}: {standing.told()}" for standing in missed if self.judged]

    def figures(self) -> dict[str, object]:
        return {**(self.measured or {}), "standings": [standing.figures() for standing in self.standings]}


def reached(method: Method, points: Sequence[Point], target: float) -> Reached | None:
    """When the error falls to the target: between neighbours log error goes with log time. None where points don't tell.

    Where the first point is good enough already, its time.
    """
    if points and points[0].error <= target:
        return Reached(method, points[0].time, False)
    known = [point for point in points if point.error > 0]
    for one, other in itertools.pairwise(known):
        if other.error <= target:
            return Reached(method, _followed(one, other, target), False)
    if len(known) < 2 or not (known[-1].error < known[-2].error and known[-1].time > known[-2].time):
        return None
    if target < known[-1].error / _FURTHEST:
        return None
    return Reached(method, _followed(*known[-2:], target), True)


def _followed(one: Point, other: Point, target: float) -> float:
    """The line through two points, in logarithms."""
    share = math.log(target / one.error) / math.log(other.error / one.error)
    return one.time * (other.time / one.time) ** share


def standings(tracks: Tracks, wanted: Mapping[float, float | None], reference_error: float) -> tuple[Standing, ...]:
    """One for each error of `wanted` (error → times as fast) that the reference is good enough to tell."""
    found = []
    for target, ratio in wanted.items():
        ours = _best(tracks, target, (method for method in tracks if method.ours))
        rival = _best(tracks, target, (method for method in tracks if method.rival))
        if ours and rival and target >= reference_error:
            found.append(Standing(target, ours, rival, ratio))
    return tuple(found)


def _best(tracks: Tracks, target: float, methods: Iterable[Method]) -> Reached | None:
    """The fastest; whoever does not reach the target only where nobody does."""
    all_reached = [each for method in methods if (each := reached(method, tracks[method], target))]
    return min(all_reached, key=lambda each: (each.beyond, each.seconds), default=None)


def with_point_by_line(points: Sequence[Point], samples: int, error: float) -> list[Point]:
    """One point more, of samples whose error is known from the reference: its time by the line through the last two."""
    if len(points) < 2 or samples <= points[-1].parameter:
        return list(points)
    one, other = points[-2:]
    slope = (other.time - one.time) / (other.parameter - one.parameter)
    return [*points, Point(samples, [other.time + slope * (samples - other.parameter)], [error])]


def curves(tracks: Tracks, least: float) -> tuple[Curve, ...]:
    """least : points of smaller errors are left out."""
    found = []
    for method, points in tracks.items():
        shown = [point for point in points if point.error >= least]
        spread = tuple((min(point.seconds), max(point.seconds)) for point in shown)
        x, y = [point.time for point in shown], [point.error for point in shown]
        found.append(Curve(method.name, x, y, ours=method.ours, spread=spread))
    return tuple(found)


def measured(tracks: Tracks) -> dict[str, object]:
    """All points, for JSON."""
    return {
        method.name: [
            {"parameter": point.parameter, "seconds": point.seconds, "errors": point.errors, "error": point.error}
            for point in points
        ]
        for method, points in tracks.items()
    }
