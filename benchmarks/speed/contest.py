"""A contest: methods on one scene, each at rising effort, measured in turns.

In every round all methods take their turn at one effort before any goes on to the next (A B A B …), since a machine's speed
drifts; each round has a seed of its own. A method goes on until it is good enough, or takes too long.
"""

import functools
import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..race import Runner

Error = Callable[[Path], float]
"""Root mean square error of a picture in a file."""


@dataclass(frozen=True)
class Method:
    """One curve.

    side : the side that it is on, a key of the contestants.
    sampling : the kind of the parameters, as the contestant knows it.
    parameters : parameters of rising effort.
    ours : true for this project's method, as it is meant to be used.
    rival : true if ours has to be ahead of it.
    job : true to measure its job too, beside the picture.
    """

    name: str
    side: str
    sampling: str
    parameters: tuple[float, ...]
    ours: bool = False
    rival: bool = False
    job: bool = False


@dataclass
class Point:
    """A method at one parameter: seconds and error of each round."""

    parameter: float
    seconds: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)

    @property
    def time(self) -> float:
        return statistics.median(self.seconds)

    @property
    def error(self) -> float:
        """Root mean square over the rounds."""
        return math.sqrt(statistics.fmean(error * error for error in self.errors))


# The times of the longest picture that a method's first one may take at most.
_HOPELESS = 3

Tracks = dict[Method, list[Point]]


@dataclass(frozen=True)
class Effort:
    """The extent of a race.

    enough : the error at which a method stops.
    longest : seconds of a picture that is not followed by a longer one.
    """

    rounds: int
    enough: float
    longest: float


def measure(
    sides: Mapping[str, Mapping[str, Runner]], methods: Sequence[Method], figure: str, error: Error, effort: Effort, path: Path
) -> Tracks:
    """Points of all methods.

    sides : side → figure → a function of sampling, parameter, seed and path, that returns its seconds and leaves a picture at
        the path.
    path : a folder in which pictures may be written.
    """
    tracks: Tracks = {}
    for method in methods:
        least = functools.partial(sides[method.side][figure], method.sampling, method.parameters[0], 0, path)
        if _takes_part(method, least, effort):
            tracks[method] = []
    for number in range(effort.rounds):
        for method, point in _turns(tracks, number == 0, effort):
            seconds = sides[method.side][figure](method.sampling, point.parameter, number + 1, path)
            point.seconds.append(seconds)
            point.errors.append(error(path))
    return tracks


def _takes_part(method: Method, least: Callable[[], float], effort: Effort) -> bool:
    """Warm up; true if a method can be measured in a reasonable time, once what it loads, compiles or builds is there."""
    if least() <= _HOPELESS * effort.longest or (seconds := least()) <= _HOPELESS * effort.longest:
        return True
    print(f"{method.name} is left out: {seconds:.0f} s for its least effort", flush=True)
    return False


def _turns(tracks: Tracks, first: bool, effort: Effort) -> Iterator[tuple[Method, Point]]:
    """The points of a round, one of each method at a time; in the first round they come into being."""
    for place in range(max(len(method.parameters) for method in tracks)):
        for method, points in tracks.items():
            if first and place == len(points) and _goes_on(method, points, effort):
                points.append(Point(method.parameters[place]))
            if place < len(points):
                yield method, points[place]


def _goes_on(method: Method, points: Sequence[Point], effort: Effort) -> bool:
    if len(points) == len(method.parameters):
        return False
    return not points or (points[-1].error > effort.enough and points[-1].time < effort.longest)


def near(points: Sequence[Point], targets: Sequence[float]) -> tuple[float, ...]:
    """The parameters on both sides of where the error falls to each target; the last two where it does not."""
    chosen = set()
    for target in targets:
        reached = next((place for place, point in enumerate(points) if point.error <= target), len(points) - 1)
        chosen |= {max(reached - 1, 0), reached}
    return tuple(points[place].parameter for place in sorted(chosen))
