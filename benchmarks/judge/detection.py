"""Faults found against false alarms: each judge sees the same pictures, of a good renderer and of one with a fault.

A renderer is our own tracer with other numbers and, where geometry is compared, with rays that are off by what float32 makes of
them (the law of comparison/tolerances.py). All pictures of a trial are one picture of a few seeds, as `viewcam check` has it.

What a judge misses depends on where it puts its threshold. So the threshold is moved: on the one axis how many good pictures
are called bad, on the other how many of the faults are missed. What a judge does at its own threshold is in the sentence below.

Rendering takes the time. So good pictures come in blocks: each of five is judged against each of five references, with errors
of geometry of its own. Blocks share nothing, and pairs within one are nearly independent where it counts: with one side in
common their differences have a correlation of one half, and where one of two normal numbers is 4.5 standard errors off the
other is, too, in 0.6 % of the cases. How often a second pair's figure is among the highest hundredth if the first one's is
is measured, and told. A fault is judged once for each picture of a block; one of the picture is put into the good one. Light
is not asked about where geometry has said no already, which costs ours nothing but the figure how much. The others judge one
pair of each block, always by light.
"""

import functools
import itertools
import json
import tempfile
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from viewcam_addon.comparison import tolerances
from viewcam_addon.image import Image
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Scene, scene_file

from ..charts import Chart, Curve
from . import faults, rivals
from .faults import FAMILIES, FAULTS, Fault, Passes

_LEVEL = "path"
_PICTURES, _SAMPLES = 8, 8
"""Test pictures of a trial, and samples of each: what `viewcam check --level path` takes by default."""
_REFERENCE_SAMPLES = 64
SIDE = 5
"""Pictures of a block, and references."""
# Half of what a renderer may be off: Rayleigh's distribution has its median at 0.41 then (tests/comparison/conftest.py).
_ROUNDINGS = 0.35

Judgments = dict[str, float]
"""Judge → how different two pictures are; 1 is where it says so by itself."""
Judged = tuple[list[Judgments], list[list[Judgments]]]
"""The judgments of a block: of each picture against each reference, row after row; and of each picture with each fault."""


def charts(quick: bool = False) -> tuple[Chart, ...]:
    blocks, with_faults = (4, 1) if quick else (170, 40)
    with ProcessPoolExecutor() as pool:
        return drawn(pool.map(judged, range(blocks), (block < with_faults for block in range(blocks))))


def judged(number: int, with_faults: bool) -> Judged:
    """The verdicts of all judges on one block."""
    block = Block(_bench(), number)
    return block.good(), [block.faulty(fault) for fault in FAULTS] if with_faults else []


def drawn(blocks: Iterable[Judged]) -> tuple[Chart, ...]:
    """A chart of all faults and one of each family."""
    good, bad = zip(*blocks, strict=True)
    clean = _by_judge(itertools.chain(*good))
    of_faults = (itertools.chain(*record) for record in zip(*filter(None, bad), strict=True))
    actual = dict(zip(FAULTS, map(_by_judge, of_faults), strict=True))
    return tuple(
        _chart(family, {fault: errors for fault, errors in actual.items() if family in ("all", fault.family)}, clean)
        for family in ("all", *FAMILIES)
    )


def together(scores: np.ndarray, share: float = 0.01) -> float:
    """The share of pairs among so many highest, where a pair with one side in common is among them.

    scores : (blocks × SIDE × SIDE,), as blocks have them.
    """
    is_high = (scores > np.quantile(scores, 1 - share)).reshape(-1, SIDE, SIDE)
    beside = sum(is_high.sum(axis=axis, keepdims=True) - is_high for axis in (1, 2))
    return float(beside[is_high].mean() / (2 * (SIDE - 1)))


def _by_judge(judged: Iterable[Judgments]) -> dict[str, np.ndarray]:
    judged = list(judged)
    return {judge: np.array([each[judge] for each in judged if judge in each]) for judge in judged[0]}


def _chart(family: str, errors_by_fault: dict[Fault, dict[str, np.ndarray]], clean: dict[str, np.ndarray]) -> Chart:
    curves, at_own_threshold = [], []
    for judge, record in clean.items():
        of_faults = np.concatenate([each[judge] for each in errors_by_fault.values()])
        # So many good pictures are above the threshold, and no more.
        alarms = [share for share in (1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3) if share * len(record) >= 1]
        limits = [np.sort(record)[::-1][int(share * len(record))] for share in alarms]
        missed = [float(np.mean(of_faults <= limit)) for limit in limits]
        curves.append(Curve(judge, alarms, missed, ours=judge == rivals.OURS))
        at_own_threshold.append(f"{judge} {np.mean(of_faults > 1):.1%} at {np.mean(record > 1):.2%}")
    share = together(clean[rivals.OURS])
    beside = f" Where a pair is in ours' highest hundredth, so are {share:.1%} of those that share a side."
    trials, seen = ([len(errors[judge]) for errors in (*errors_by_fault.values(), clean)] for judge in (rivals.OURS, "FLIP"))
    return Chart(
        family,
        {"all": "All faults", "camera": "The camera", "geometry": "What stands in the scene", "light": "Light"}.get(
            family, "The picture itself"
        ),
        "good pictures that are called bad",
        "faults that are missed",
        tuple(curves),
        f"Read how much is missed at how few false alarms: {len(errors_by_fault)} faults × {trials[0]} seeds, "
        f"{trials[-1]} pairs of good pictures; of these the others judged {seen[0]} and {seen[-1]}. "
        f"Found by each at its own threshold, and false alarms: "
        f"{'; '.join(at_own_threshold)}.{beside if family == 'all' else ''}",
        tie=0.05,
        log_y=False,
    )


class Bench:
    """The room, what it looks like, and a tracer of it with each fault."""

    def __init__(self) -> None:
        self.tracer = _tracer(faults.room())
        self.camera = _scene(faults.room()).camera
        self.surfaces = Image(self.tracer.render(), self.camera)
        exact = {name: values.reshape(-1, values.shape[-1]) for name, values in self.surfaces.passes.items()}
        self.shift = np.nan_to_num(tolerances.ray_shift(self.camera, exact))
        self.faulty = {fault: _tracer(faults.changed(fault)) if fault.of_scene else self.tracer for fault in FAULTS}


_bench = functools.cache(Bench)


class Block:
    """Pictures and references, and what the judges say of them."""

    def __init__(self, bench: Bench, number: int) -> None:
        self._bench, self._number = bench, number
        attributes = {"samples": str(_REFERENCE_SAMPLES)}
        self._references = [
            Image(bench.tracer.render_light(_LEVEL, _REFERENCE_SAMPLES, self._seed(0, i)), bench.camera, attributes)
            for i in range(SIDE)
        ]
        self._lit = [self._light(0, bench.tracer, i) for i in range(SIDE)]

    def good(self) -> list[Judgments]:
        result = []
        for i, j in itertools.product(range(SIDE), repeat=2):
            of_geometry = self._of_geometry(self._surfaces(self._bench.tracer, self._random(0, i, j)))
            result.append(self._judgments(of_geometry, self._lit[i], j, by_all=i == j == 0))
        return result

    def faulty(self, fault: Fault) -> list[Judgments]:
        number, tracer, judged = 1 + FAULTS.index(fault), self._bench.faulty[fault], []
        for i in range(SIDE):
            test = self._surfaces(tracer, self._random(number, i))
            if fault.of_picture:
                # A fault of the whole picture is one of geometry, too; one of its colors is not.
                test["Combined"] = np.zeros((*faults.SIZE[::-1], 4), np.float32)
                fault.of_picture(test, self._random(number, i))
            of_geometry = self._of_geometry(test)
            if of_geometry > 1 and i > 0:
                judged.append({rivals.OURS: of_geometry})
                continue
            lit = self._light(number, tracer, i) if fault.of_scene else [dict(passes) for passes in self._lit[i]]
            if fault.of_picture:
                for passes in lit:
                    passes.update(Combined=passes["Combined"].copy())
                    fault.of_picture(passes, self._random(number, i))  # one place in all of them
            judged.append(self._judgments(of_geometry, lit, i, by_all=i == 0))
        return judged

    def _judgments(self, of_geometry: float, lit: list[Passes], j: int, by_all: bool) -> Judgments:
        reference = self._references[j]
        pictures = [rivals.without_the_tracers_own(Image(passes, attributes={"samples": str(_SAMPLES)})) for passes in lit]
        values = {rivals.OURS: max(of_geometry, rivals.of_light(reference, pictures))}
        if not by_all:
            return values
        colors = np.mean([picture["Combined"][..., :3].astype(float) for picture in pictures], axis=0)
        expected, variance = reference["Combined"][..., :3].astype(float), reference["Variance"] * float(_REFERENCE_SAMPLES)
        settings = expected, colors, variance, _PICTURES * _SAMPLES
        return values | {name: judge(*settings) for name, judge in rivals.RIVALS.items()}

    def _of_geometry(self, test: Passes) -> float:
        image = rivals.without_the_tracers_own(Image(test))
        return rivals.of_geometry(self._bench.surfaces, image, self._bench.tracer.surfaces_at)

    def _surfaces(self, tracer: Tracer, random: np.random.Generator) -> Passes:
        width, height = faults.SIZE
        rows, columns = np.mgrid[:height, :width]
        off = _ROUNDINGS * self._bench.shift * random.normal(size=(2, width * height))
        seen = tracer.surface_at(columns.ravel(), rows.ravel(), 0.5 + off[0], 0.5 + off[1])
        return {name: values.reshape(height, width, -1) for name, values in seen.items()}

    def _light(self, number: int, tracer: Tracer, i: int) -> list[Passes]:
        first = self._seed(number, i) + 1
        return [tracer.render_light(_LEVEL, _SAMPLES, seed) for seed in range(first, first + _PICTURES)]

    def _random(self, *place: int) -> np.random.Generator:
        return np.random.default_rng((self._number, *place))

    def _seed(self, number: int, i: int) -> int:
        """The first of a reference's and a picture's seeds.

        number : the fault's number, 0 for none.
        """
        return ((self._number * (1 + len(FAULTS)) + number) * SIDE + i) * (1 + _PICTURES)


def _tracer(document: dict) -> Tracer:
    return Tracer(_scene(document), threads=1)


def _scene(document: dict) -> Scene:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.json"
        path.write_text(json.dumps(document), encoding="utf-8")
        return scene_file.read(path)
