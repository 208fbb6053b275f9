"""Level geometry at 1080p beside Cycles: how far positions lie from their pixels' centers against time; and how much of bare
Embree's speed is left, here and where light comes straight from a sun.
"""

import contextlib
import functools
import os
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from viewcam_addon import image
from viewcam_addon.image import BACKGROUND_DEPTH
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import scene_file

from ..charts import Chart, Curve
from ..guard import Yardstick
from ..race import Runner, timed
from . import contest, tracer
from .contest import Effort, Method
from .standings import Contested, measured
from .stills import CYCLES, OURS, PICTURE, WHOLE, Figure, prepare_cycles, start_contestant

_WANTED = {PICTURE: 10.0, WHOLE: 6.0}
_LEAST_SHARE = {"geometry": 0.6, "direct": 0.8}
_SAMPLES = 16  # a pixel, where rays are counted at `direct`
_ONCE = (1.0,)
METHODS = (
    Method(OURS, OURS, "samples", _ONCE, ours=True),
    Method(CYCLES, CYCLES, "samples", _ONCE, rival=True),
)


@dataclass(frozen=True)
class Claim:
    """A claim that its first thing is `ratio` times its second. wanted : at least."""

    sentence: str
    ratio: float
    wanted: float

    def summary(self) -> str:
        return f"{self.sentence}: {self.ratio:.2f}, wanted {self.wanted:g}"

    def figures(self) -> dict[str, object]:
        return {"what": self.sentence, "ratio": self.ratio, "wanted": self.wanted}


def charts(quick: bool) -> tuple[Chart]:
    size, light = ((480, 270), (160, 90)) if quick else ((1920, 1080), (640, 360))
    rounds = 1 if quick else 5
    tracks, claims = _beside_cycles(size, rounds)
    claims += [_share("geometry", "three suzannes", size, rounds), _share("direct", "suzannes", light, rounds)]
    curves = [
        Curve(
            method.name,
            [tracks[figure][method][0].time for figure in tracks],
            [tracks[figure][method][0].error for figure in tracks],
            ours=method.ours,
            spread=[(min(seconds), max(seconds)) for figure in tracks for seconds in [tracks[figure][method][0].seconds]],
        )
        for method in METHODS
    ]
    return (
        Contested(
            "geometry",
            f"Level geometry, {size[0]} × {size[1]}, three Suzannes: the picture, and the whole job",
            f"seconds: median, least and most of {rounds}",
            "pixels, median distance of positions from pixel centers",
            tuple(curves),
            f"Read {'; '.join(claim.summary() for claim in claims)}.{' Quick: not judged.' if quick else ''}",
            tie=0.0,
            standings=tuple(claims),
            measured={"methods": {figure.name: measured(actual) for figure, actual in tracks.items()}},
            judged=not quick,
            rows=tuple(figure.name for figure in tracks),
        ),
    )


def _beside_cycles(size: tuple[int, int], rounds: int) -> tuple[dict[Figure, contest.Tracks], list[Claim]]:
    threads = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as processes:
        scene, path = Path(folder) / "scene.json", Path(folder) / "picture.exr"
        start = functools.partial(start_contestant, processes)
        sides = {CYCLES: start(prepare_cycles, "three suzannes", "geometry", size, scene, threads)}
        sides[OURS] = start(tracer.prepare, scene, "geometry", threads)
        error = functools.partial(distance_from_centers, scene_file.read(scene).camera)
        effort = Effort(rounds, enough=0, longest=float("inf"))
        tracks = {figure: contest.measure(sides, METHODS, figure.key, error, effort, path) for figure in _WANTED}
    claims = []
    for figure, wanted in _WANTED.items():
        ours, cycles = (points[0].time for points in tracks[figure].values())
        claims.append(Claim(f"the {figure.name}, times as fast as Cycles", cycles / ours, wanted))
    return tracks, claims


def _share(level: str, scene_name: str, size: tuple[int, int], rounds: int) -> Claim:
    """The share of bare Embree's speed that the tracer has."""
    threads = os.cpu_count() or 1
    samples = _SAMPLES if level == "direct" else 0
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as processes:
        scene, path = Path(folder) / "scene.json", Path(folder) / "picture.exr"
        with contextlib.ExitStack() as blender:
            start_contestant(blender, prepare_cycles, scene_name, level, size, scene, threads)  # writes the scene
        start = functools.partial(start_contestant, processes)
        picture = start(tracer.prepare, scene, level, threads)["picture"]
        yardstick = start(_prepare_embree, scene, samples)["picture"]
        shares = [yardstick() / picture("samples", max(samples, 1), number, path) for number in range(rounds + 1)]
    median = statistics.median(shares[1:])  # the first round is to warm up
    return Claim(f"share of bare Embree's ray rate at {level}", median, _LEAST_SHARE[level])


def _prepare_embree(scene_path: Path, samples: int) -> dict[str, Runner]:
    """Embree's work on the same rays, made beforehand, and nothing else.

    samples : the samples of each pixel, the eye's rays and those to the first lamp, a sun; 0 for the pixels' centers alone.
    """
    scene = scene_file.read(scene_path)
    yardstick = Yardstick(scene)
    return {"picture": timed(yardstick.of_light(samples, scene.lamps[0]) if samples else yardstick.of_geometry())}


def distance_from_centers(camera: Pinhole, path: Path) -> float:
    """Pixels: the median over all that is hit."""
    picture = image.read(path, only=("Position", "Depth"))
    rows, columns = np.nonzero(picture["Depth"][..., 0] < BACKGROUND_DEPTH)
    column, row, _ = camera.project(picture["Position"][rows, columns].astype(np.float64))
    return float(np.median(np.hypot(column - columns - 0.5, row - rows - 0.5)))
