"""The references that errors are measured against: pictures converged by two renderers, and how far off each is itself.

Each of two sides renders two halves with seeds of their own. The halves of a side tell its noise; the reference is the mean of
both sides, each weighted with the inverse of its variance. How much the sides differ beyond their noise tells whether they
converge to the same picture. The reference's own variance is taken off each error that is measured against it, and errors
below the reference's own are not judged.

References are kept in ~/.cache/virtual-pinhole/references, by what they show: a second run is quick.
"""

import hashlib
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewcam_addon import image
from viewcam_addon.files import written_whole

from ..race import Runner

FOLDER = Path.home() / ".cache" / "virtual-pinhole" / "references"
_SEEDS = (7001, 7002)


@dataclass(frozen=True)
class Half:
    """The effort and the error of one of a side's two halves.

    samples : the samples of each pixel in each of a side's two halves.
    error : the error of one half.
    """

    side: str
    samples: int
    error: float


@dataclass(frozen=True, eq=False)
class Reference:
    """The picture that races are measured against.

    picture : (height, width, 3) float64.
    error : its own RMSE.
    differ : RMS of the difference between the sides.
    explained : the part of it that their noise explains.
    """

    picture: NDArray[np.float64]
    error: float
    differ: float
    explained: float
    halves: tuple[Half, Half]

    def error_of(self, path: Path) -> float:
        """The RMSE of Combined's color, the reference's own variance taken off."""
        measured = rms(combined(path) - self.picture)
        return math.sqrt(max(measured * measured - self.error * self.error, 0.0))

    def summary(self) -> str:
        sides = " and ".join(f"{half.side} with 2 × {half.samples:,} samples" for half in self.halves)
        return (
            f"The reference, {sides}, is itself off by {self.error:.2g}, which is taken off; the two differ by "
            f"{self.differ:.2g}, of which noise explains {self.explained:.2g}."
        )

    def figures(self) -> dict[str, object]:
        halves = [{"side": half.side, "samples": half.samples, "error": half.error} for half in self.halves]
        return {"error": self.error, "sides differ by": self.differ, "explained by noise": self.explained, "halves": halves}


def reference(
    name: str,
    scene: Path,
    sides: Mapping[str, Mapping[str, Runner]],
    samples: Mapping[str, int],
    folder: Path | None = None,
) -> Reference:
    """The reference of a scene file, made now or kept from before.

    samples : a pixel, of each half, of the two sides.
    """
    kept = (folder or FOLDER) / f"{name}-{_fingerprint(scene, samples)}.npz"
    if not kept.is_file():
        started = time.perf_counter()
        arrays = {}
        for side, number in samples.items():
            arrays |= {side: _halves(sides[side]["picture"], number, scene)}
        with written_whole(kept) as temporary:
            np.savez(temporary, **arrays)
        print(f"{name}: the reference took {time.perf_counter() - started:.0f} s and is kept as {kept}", flush=True)
    with np.load(kept) as file:
        return combine({side: file[side].astype(np.float64) for side in samples}, samples)


def combine(halves: Mapping[str, NDArray[np.float64]], samples: Mapping[str, int]) -> Reference:
    """The reference of both sides' pictures.

    halves : the two halves of each of two sides, (2, height, width, 3).
    """
    noise = {side: rms(pair[0] - pair[1]) / math.sqrt(2) for side, pair in halves.items()}
    (first, other), variances = halves.values(), [error * error / 2 for error in noise.values()]
    weight = variances[1] / sum(variances) if any(variances) else 0.5
    return Reference(
        picture=weight * first.mean(axis=0) + (1 - weight) * other.mean(axis=0),
        error=math.hypot(weight * math.sqrt(variances[0]), (1 - weight) * math.sqrt(variances[1])),
        differ=rms(first.mean(axis=0) - other.mean(axis=0)),
        explained=math.sqrt(sum(variances)),
        halves=tuple(Half(side, samples[side], error) for side, error in noise.items()),
    )


def combined(path: Path) -> NDArray[np.float64]:
    """(height, width, 3): the color of Combined."""
    return image.read(path, only=("Combined",))["Combined"][..., :3].astype(np.float64)


def rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _halves(picture: Runner, samples: int, scene: Path) -> NDArray[np.float32]:
    path = scene.with_name("half.exr")
    pictures = []
    for seed in _SEEDS:
        picture("samples", samples, seed, path)
        pictures.append(combined(path).astype(np.float32))
    return np.stack(pictures)


def _fingerprint(scene: Path, samples: Mapping[str, int]) -> str:
    digest = hashlib.sha256(repr(sorted(samples.items())).encode())
    for path in (scene, scene.with_suffix(".npz")):
        if path.is_file():
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
