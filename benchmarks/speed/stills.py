"""Pictures of light, raced: both figures of a picture, measured against its reference, and their charts.

Beside Cycles they are six Suzannes, the studio still, in plain colors and in artists' materials, the sphere field and the
Cornell box. Ours renders with a wanted error, and with a number of samples for all pixels; Cycles with a number of samples, and
with its own adaptive sampling. All make the same passes.
"""

import contextlib
import dataclasses
import functools
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..charts import Chart
from ..race import Contestant, Runner
from . import contest, references, standings, tracer
from .contest import Effort, Method, Tracks
from .references import Reference

Sides = dict[str, dict[str, Runner]]
"""Side → figure → runner (contest.measure)."""


@dataclass(frozen=True)
class Still:
    """A picture.

    wanted : error → how many times as fast as the rivals, as (picture, job), None where nothing is asked for.

    samples : a pixel, of each half of the reference, of the two sides that make it.
    """

    name: str
    title: str
    level: str
    size: tuple[int, int]
    wanted: Mapping[float, tuple[float | None, float | None]]
    samples: Mapping[str, int]

    def small(self) -> "Still":
        """A sixteenth of the pixels, ten times the error, and a reference of few samples."""
        width, height = self.size
        wanted = {10 * error: ratios for error, ratios in self.wanted.items()}
        samples = {side: max(number // 16, 16) for side, number in self.samples.items()}
        return dataclasses.replace(self, size=(width // 4, height // 4), wanted=wanted, samples=samples)


@dataclass(frozen=True)
class Figure:
    """A duration that is compared.

    key : its name among contestants.
    name, seconds : its name and its unit on charts.
    """

    key: str
    name: str
    seconds: str


PICTURE = Figure("picture", "picture", "structures built and kept, no file")
WHOLE = Figure("whole", "whole job", "from the loaded scene to the EXR on the disk")
FRESH = Figure("fresh", "fresh process", "from a fresh process, its code compiled before, to the EXR on the disk")


OURS, CYCLES = "ours", "Cycles"
POWERS = tuple(2.0**power for power in range(13))
ERRORS = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)
NOISE_THRESHOLDS = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)

STILLS = (
    Still(
        "suzannes", "Six Suzannes, one sun", "direct", (640, 360), {0.003: (15, 12), 0.001: (15, 12)}, {OURS: 2048, CYCLES: 256}
    ),
    Still("studio", "Studio still", "direct", (160, 90), {0.003: (12, 12), 0.001: (12, 12)}, {OURS: 4096, CYCLES: 1024}),
    Still(
        "dressed_studio", "Studio still in artists' materials", "path", (160, 90), {0.01: (3, 3)}, {OURS: 2048, CYCLES: 2048}
    ),
    Still("spheres", "Sphere field", "direct", (160, 90), {0.003: (6, 6), 0.001: (6, 6)}, {OURS: 4096, CYCLES: 4096}),
    Still("cornell", "Cornell box", "path", (120, 120), {0.01: (3, 3)}, {OURS: 2048, CYCLES: 2048}),
)
OUR_METHODS = (
    Method(f"{OURS}, adaptive", OURS, "error", ERRORS, ours=True, job=True),
    Method(f"{OURS}, uniform", OURS, "samples", POWERS, ours=True, job=True),
)
METHODS = (
    *OUR_METHODS,
    Method(CYCLES, CYCLES, "samples", POWERS, rival=True, job=True),
    Method(f"{CYCLES}, adaptive", CYCLES, "error", NOISE_THRESHOLDS, rival=True, job=True),
)


def charts(still: Still, quick: bool) -> tuple[Chart, ...]:
    """The picture, and the whole job."""
    still = still.small() if quick else still
    threads = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as processes:
        scene = Path(folder) / "scene.json"
        start = functools.partial(start_contestant, processes)
        sides = {CYCLES: start(prepare_cycles, still.name, still.level, still.size, scene, threads)}  # writes the scene
        sides[OURS] = start(tracer.prepare, scene, still.level, threads)
        reference = references.reference(still.name, scene, sides, still.samples)
        return charts_of(still, WHOLE, sides, METHODS, reference, quick, Path(folder) / "picture.exr")


def start_contestant(processes: contextlib.ExitStack, *arguments: object, **options: object) -> dict[str, Runner]:
    """The runners that a process offers, which ends with the others."""
    return processes.enter_context(Contestant(*arguments, **options)).runners()


def prepare_cycles(*arguments: object) -> dict[str, Runner]:
    """In Blender's process, the only one that imports it."""
    from . import cycles

    return cycles.prepare(*arguments)


def charts_of(
    still: Still, job: Figure, sides: Sides, methods: tuple[Method, ...], reference: Reference, quick: bool, path: Path
) -> tuple[Chart, Chart]:
    """The picture, and the job around the errors that are asked for.

    path : a folder in which pictures may be written.
    """
    enough = max(0.9 * min(still.wanted), reference.error)
    effort = Effort(rounds=1, enough=enough, longest=1) if quick else Effort(rounds=3, enough=enough, longest=8)
    pictures = contest.measure(sides, methods, "picture", reference.error_of, effort, path)
    few = [
        dataclasses.replace(method, parameters=contest.near(points, tuple(still.wanted)))
        for method, points in pictures.items()
        if method.job
    ]
    effort = Effort(effort.rounds, enough=0, longest=float("inf"))
    jobs = contest.measure(sides, few, job.key, reference.error_of, effort, path)
    return (
        _chart(still, PICTURE, [ratio for ratio, _ in still.wanted.values()], pictures, reference, quick),
        _chart(still, job, [ratio for _, ratio in still.wanted.values()], jobs, reference, quick),
    )


def _chart(
    still: Still, figure: Figure, ratios: list[float | None], tracks: Tracks, reference: Reference, quick: bool
) -> Chart:
    tracks = {method: _with_half(method, points, reference) for method, points in tracks.items()}
    wanted = dict(zip(still.wanted, ratios, strict=True))
    times = standings.times(tracks, wanted, reference.error)
    ranked = standings.standings(times, wanted)
    claims = [standing.summary() for standing in ranked]
    claims += [f"to {error:g} nobody can tell" for error in wanted if error not in {standing.target for standing in ranked}]
    width, height = still.size
    rounds = max(len(point.seconds) for points in tracks.values() for point in points)
    return standings.Contested(
        f"{still.name}-{figure.name}".translate(str.maketrans(" _", "--")),
        f"{still.title}, {width} × {height}, {still.level}: the {figure.name}",
        f"seconds, {figure.seconds}: median, least and most of {rounds}",
        "RMS error of Combined",
        standings.curves(tracks, reference.error, ranked),
        f"Read how long each takes to an error: {'; '.join(claims)}. {reference.summary()}"
        + (" Quick: not judged." if quick else ""),
        tie=0.0,
        levels=tuple(wanted),
        standings=ranked,
        times=times,
        measured={"methods": standings.measured(tracks), "reference": reference.figures()},
        judged=not quick,
    )


def _with_half(method: Method, points: list[contest.Point], reference: Reference) -> list[contest.Point]:
    """The curves of numbers of samples go on with what the reference's own halves tell of those who made it."""
    uniform = method.sampling == "samples" and (method.ours or method.rival)
    half = next((half for half in reference.halves if uniform and method.side == half.side), None)
    return standings.with_point_by_line(points, half.samples, half.error) if half else points
