"""How steeply something grows: the exponent of a power, fitted; and charts of what points of a sweep took.

Time is a fixed part and a part that grows, a + b xᵏ. A line fitted through all of it would tell neither; so the line goes, in
logarithms and by least squares, through the part where it has at least doubled.
"""

from collections.abc import Sequence

import numpy as np

from ..charts import Chart, Curve
from .point import Measured

_SEEN, _SLACK = 1e6, 1.25  # bytes; part of them
# Linux's allocator keeps freed memory of pieces smaller than this (tracer/tiles.py).
_KEPT = 32 << 20

Sweep = Sequence[tuple[float, Measured]]
"""x and what was measured there, x rising."""


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """The exponent of x with which y goes, fitted to all of them."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def exponent(x: Sequence[float], y: Sequence[float]) -> float | None:
    """The same for the last part, where y is at least twice its least; None where that is less than two points."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    below = np.flatnonzero(y < 2 * y.min(initial=np.inf))
    grown = slice(below.max(initial=-1) + 1, None)
    return slope(x[grown], y[grown]) if len(x[grown]) > 1 else None


def told(curves: Sequence[Curve], what: str) -> str:
    """A sentence with the exponents of all curves. what : they are powers of."""
    powers = [(curve.name, exponent(curve.x, curve.y)) for curve in curves]
    grown = ", ".join(f"{name} {power:.2f}" for name, power in powers if power is not None)
    flat = ", ".join(name for name, power in powers if power is None)
    return " ".join(
        filter(
            None,
            [
                grown and f"Fitted powers of {what}, where it has at least doubled: {grown}.",
                flat and f"Hardly growing: {flat}.",
            ],
        )
    )


def time_curves(sweep: Sweep, stages: Sequence[str], prefix: str = "") -> list[Curve]:
    """Seconds of each stage."""
    x = [x for x, _ in sweep]
    return [Curve(prefix + stage, x, [measured.seconds[stage] for _, measured in sweep]) for stage in stages]


def memory_curves(sweep: Sweep, stages: Sequence[str], prefix: str = "", league: str = "") -> list[Curve]:
    """Megabytes beyond the scene's own arrays at the peak of each stage; left out where some pages would change it."""
    curves = []
    for stage in stages:
        seen = [(x, measured.peak[stage] / 1e6) for x, measured in sweep if measured.peak[stage] >= _SEEN]
        curves.append(Curve(prefix + stage, *(zip(*seen, strict=True) if seen else ((), ())), league=league))
    return curves


def memory_limit(x: Sequence[float], fixed: float, each: float, name: str, league: str = "") -> Curve:
    """What may be taken: some bytes in any case, a quarter more, and what the allocator may keep; and some for each of x."""
    return Curve(name, x, [(_SLACK * fixed + _KEPT + each * number) / 1e6 for number in x], limit=True, league=league)


def chart(name: str, title: str, x_label: str, y_label: str, curves: Sequence[Curve], reading: str) -> Chart:
    """With logarithmic axes, and nothing judged but limits."""
    return Chart(name, title, x_label, y_label, tuple(curves), reading, tie=np.inf)


SECONDS, MEGABYTES = "time [s]", "memory at its peak, beyond the scene's own arrays [MB]"
