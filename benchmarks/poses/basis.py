"""The basis (u, v, w) of a pose: time against error, for each formula and each way to call it.

The error is the largest angle between an axis and its true direction, over three kinds of poses:

- ordinary ones, a few units from the origin and with any angle between view and up,
- far ones, in geocentric coordinates: 6.4e6 units from the origin, the look-at point 10 to 100 away,
- nearly vertical ones, with a sine of the angle between view and up from 1 down to 1e-12.

up points in any direction, but for Blender's to_track_quat and Track To, which know the world's Z alone. methods.py has what is
compared, and the times, which are those of ordinary poses.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..charts import Chart, Curve
from ..stability import oracle
from .methods import METHODS, OURS, WORLD_Z, Array, times

# The bound of pinhole.py for each component, over the three of an axis.
EXACT = math.sqrt(3) * 4e-16
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Poses:
    """n poses and their truth. eye, look_at, up : (n, 3). high, low : (n, 3, 3), u, v and w, whose sum is the truth."""

    eye: Array
    look_at: Array
    up: Array
    high: Array
    low: Array

    def error(self, axes: Array) -> float:
        """The largest angle between axes, (n, 3, 3), and the true ones, in radians; nan where there is no answer."""
        apart = np.linalg.norm((axes - self.high) - self.low, axis=-1)
        return float(2 * np.arcsin(np.minimum(apart.max() / 2, 1.0)))


def charts(quick: bool = False) -> tuple[Chart, ...]:
    measured, trials = times(100 if quick else 1, 3 if quick else 7), 26 if quick else 260
    return tuple(_chart(name, title, measured, make(trials, None), make(trials, _Z)) for name, (title, make) in KINDS.items())


def _chart(name: str, title: str, measured: Mapping[str, Mapping[str, Sequence[float]]], any_up: Poses, z_up: Poses) -> Chart:
    curves = []
    for method, ways in measured.items():
        poses = z_up if method in WORLD_Z else any_up
        with np.errstate(all="ignore"):
            error = poses.error(METHODS[method](poses.eye, poses.look_at, poses.up))
        times = sorted((1e9 * np.median(rounds), (1e9 * min(rounds), 1e9 * max(rounds))) for rounds in ways.values())
        medians, spread = zip(*times, strict=True)
        curves.append(Curve(method, medians, [error] * len(times), ours=method == OURS, spread=spread))
    told = ", ".join(f"{1 / np.median(rounds):,.0f} ({way})" for way, rounds in measured[OURS].items())
    return Chart(
        f"basis-{name}",
        f"The basis of {title}",
        "time of a pose [ns]",
        "largest angle to the true axes [rad]",
        tuple(curves),
        "Read what an answer costs, and what it is worth: fast is to the left, exact is above. A formula with two points was "
        f"called with many poses at once, filled, and with one at a time, hollow. Ours, in a second: {told}.",
        tie=EXACT,
        rows=("many at once, or the only way", "one at a time"),
    )


# Kinds of poses, `trials` of them: up in any direction, or the one that is given.


def _ordinary(trials: int, up: Array | None) -> Poses:
    rng = np.random.default_rng(1)
    return _true(*rng.normal(size=(2, trials, 3)) * 3, rng.normal(size=(trials, 3)) if up is None else up)


def _far(trials: int, up: Array | None) -> Poses:
    rng = np.random.default_rng(2)
    home, towards = (_unit(rng.normal(size=(trials, 3))) for _ in range(2))
    eyes = 6.4e6 * home
    look_at = eyes + towards * rng.uniform(10, 100, (trials, 1))
    return _true(eyes, look_at, rng.normal(size=(trials, 3)) if up is None else up)


def _vertical(trials: int, up: Array | None) -> Poses:
    """Where up is given, the eye is above the origin or below it, so that its angle can be as small as float32 numbers are."""
    rng = np.random.default_rng(3)
    sine = np.repeat(10.0 ** -np.arange(13), max(1, trials // 13))[:, None]
    count, side = len(sine), np.where(rng.random((len(sine), 1)) < 0.5, 1.0, -1.0)
    if up is not None:
        across = _unit(np.cross(up, rng.normal(size=(count, 3))))
        return _true(5 * side * (sine * across + np.sqrt(1 - sine * sine) * up), np.zeros((count, 3)), up)
    eyes, look_at = rng.normal(size=(2, count, 3)) * 3
    w = _unit(eyes - look_at)
    across = _unit(np.cross(w, rng.normal(size=(count, 3))))
    return _true(eyes, look_at, side * np.sqrt(1 - sine * sine) * w + sine * across)


KINDS = {
    "ordinary": ("ordinary poses", _ordinary),
    "far": ("poses in geocentric coordinates", _far),
    "vertical": ("poses up to 1e-12 rad from vertical", _vertical),
}


def _true(eye: Array, look_at: Array, up: Array) -> Poses:
    up = np.broadcast_to(up, eye.shape)
    high, low = np.empty((2, len(eye), 3, 3))
    for i, pose in enumerate(zip(eye, look_at, up, strict=True)):
        high[i], low[i] = oracle.rounded(oracle.axes(*pose))
    return Poses(eye, look_at, up, high, low)


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1)[..., None]
