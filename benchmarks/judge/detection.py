"""Faults found against false alarms: each judge sees the same pictures, of a good renderer and of one with a fault.

A renderer is our own tracer with other numbers and, where geometry is compared, with rays that are off by what float32 makes of
them (the law of comparison/tolerances.py). All pictures of a trial are one picture of a few seeds, as `viewcam check` has it.

What a judge misses depends on where it puts its threshold. So the threshold is moved: on the one axis how many good pictures
are called bad, on the other how many of the faults are missed. What a judge does at its own threshold is in the sentence below.
"""

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from viewcam_addon.comparison import tolerances
from viewcam_addon.image import Image
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Scene, scene_file

from ..charts import Chart, Curve
from . import faults, rivals
from .faults import FAMILIES, FAULTS, Fault

_LEVEL = "path"
_PICTURES, _SAMPLES = 8, 8
"""Test pictures of a trial, and samples of each: what `viewcam check --level path` takes by default."""
_REFERENCE_SAMPLES = 64
_REFERENCES = 10
# Half of what a renderer may be off: Rayleigh's distribution has its median at 0.41 then (tests/comparison/conftest.py).
_ROUNDINGS = 0.35


def charts(quick: bool = False) -> tuple[Chart, ...]:
    trials, good = (2, 20) if quick else (200, 2000)
    return drawn(*measured(trials, good), trials, good)


def measured(trials: int, good: int) -> tuple[dict[str, np.ndarray], dict[Fault, dict[str, np.ndarray]]]:
    """What each judge says of `good` pictures without a fault, and of `trials` of each fault."""
    bench = Bench()
    clean = _by_judge(bench.trial(Tracer(bench.scene), None, seed) for seed in range(good))
    found = {}
    for number, fault in enumerate(FAULTS):
        tracer = Tracer(_scene(faults.changed(fault)))
        found[fault] = _by_judge(bench.trial(tracer, fault, 10**6 * (number + 1) + seed) for seed in range(trials))
    return clean, found


def drawn(clean: dict, found: dict, trials: int, good: int) -> tuple[Chart, ...]:
    """A chart for each family and one for all of them."""
    return tuple(
        _chart(family, [of for fault, of in found.items() if family in ("all", fault.family)], clean, trials, good)
        for family in (*FAMILIES, "all")
    )


def _chart(family: str, scores: list[dict], clean: dict, trials: int, good: int) -> Chart:
    alarms = [share for share in (1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3) if share * good >= 1]
    curves, at_home = [], []
    for judge, said in clean.items():
        of_faults = np.concatenate([each[judge] for each in scores])
        # So many good pictures are above the threshold, and no more.
        limits = [np.sort(said)[::-1][int(share * good)] for share in alarms]
        missed = [float(np.mean(of_faults <= limit)) for limit in limits]
        curves.append(Curve(judge, alarms, missed, ours=judge == rivals.OURS))
        at_home.append(f"{judge} {np.mean(of_faults > 1):.1%} at {np.mean(said > 1):.2%}")
    return Chart(
        family,
        {"all": "All faults", "camera": "The camera", "geometry": "What stands in the scene", "light": "Light"}.get(
            family, "The picture itself"
        ),
        "good pictures that are called bad",
        "faults that are missed",
        tuple(curves),
        f"Read how much is missed at how few false alarms: {len(scores)} faults × {trials} seeds, {good} good pictures. Found "
        f"by each at its own threshold, and false alarms: {'; '.join(at_home)}.",
        tie=0.05,
        log_y=False,
    )


class Bench:
    """The room, its references, and what a trial needs."""

    def __init__(self) -> None:
        self.scene = _scene(faults.room())
        tracer = Tracer(self.scene)
        self._reference = Image(tracer.render(), self.scene.camera)
        self._surface_at = tracer.surface_at
        exact = {name: values.reshape(-1, values.shape[-1]) for name, values in self._reference.passes.items()}
        self._shift = tolerances.ray_shift(self.scene.camera, exact)
        attributes = {"samples": str(_REFERENCE_SAMPLES)}
        self._lit = [
            Image(tracer.render_light(_LEVEL, _REFERENCE_SAMPLES, seed), self.scene.camera, attributes)
            for seed in range(_REFERENCES)
        ]

    def trial(self, tracer: Tracer, fault: Fault | None, seed: int) -> dict[str, float]:
        """What each judge says of a picture by that tracer, with that fault."""
        rng = np.random.default_rng(seed)
        test = self._surfaces(tracer, rng)
        lit = [tracer.render_light(_LEVEL, _SAMPLES, 1000 + 50 * seed + number) for number in range(_PICTURES)]
        if fault and fault.of_picture:
            state = rng.bit_generator.state
            for passes in (test, *lit):
                rng.bit_generator.state = state  # the same place in all of them
                fault.of_picture(passes, rng) if "Combined" in passes else _of_geometry(fault, passes, rng)
        reference = self._lit[seed % _REFERENCES]
        pictures = [Image(passes, attributes={"samples": str(_SAMPLES)}) for passes in lit]
        pictures = [rivals.without_the_tracers_own(picture) for picture in pictures]
        test = rivals.without_the_tracers_own(Image(test))
        said = rivals.of_comparisons(self._reference, test, reference, pictures, self._surface_at)
        colours = np.mean([picture["Combined"][..., :3].astype(float) for picture in pictures], axis=0)
        expected, variance = reference["Combined"][..., :3].astype(float), reference["Variance"] * float(_REFERENCE_SAMPLES)
        samples = _PICTURES * _SAMPLES
        return said | {name: judge(expected, colours, variance, samples) for name, judge in rivals.RIVALS.items()}

    def _surfaces(self, tracer: Tracer, rng: np.random.Generator) -> dict[str, np.ndarray]:
        width, height = faults.SIZE
        rows, columns = np.mgrid[:height, :width]
        off = _ROUNDINGS * np.nan_to_num(self._shift) * rng.normal(size=(2, width * height))
        seen = tracer.surface_at(columns.ravel(), rows.ravel(), 0.5 + off[0], 0.5 + off[1])
        return {name: values.reshape(height, width, -1) for name, values in seen.items()}


def _of_geometry(fault: Fault, passes: dict, rng: np.random.Generator) -> None:
    """A fault of the whole picture is one of geometry, too; one of its colours is not."""
    colours = {**passes, "Combined": np.zeros((*faults.SIZE[::-1], 4), np.float32)}
    fault.of_picture(colours, rng)
    passes.update({name: colours[name] for name in passes})


def _scene(document: dict) -> Scene:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.json"
        path.write_text(json.dumps(document), encoding="utf-8")
        return scene_file.read(path)


def _by_judge(trials: Iterator[dict[str, float]]) -> dict[str, np.ndarray]:
    told = list(trials)
    return {judge: np.array([each[judge] for each in told]) for judge in told[0]}
