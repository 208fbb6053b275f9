"""The figures of one pass: percentiles of its error, and their share of the tolerance.

Each pixel has its own tolerance, so the errors are judged as shares of it: at the percentile p the p-th percentile of
error / tolerance_p must not exceed 1. Rejected: comparing percentiles of the error with percentiles of the tolerance, since
errors could then gather where little is allowed.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .tolerances import PERCENTILES, ROUNDINGS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PassErrors:
    """A line of the table of errors: one pass, or one quantity of light.

    name, unit : the pass and the unit of its figures.
    count : the number of pixels compared.
    values : the error at each of tolerances.PERCENTILES, in `unit`.
    tolerances : the tolerance at each of them, at the median pixel, in `unit`.
    shares : the error at each of them as a share of the tolerance of its own pixel; 1 is the limit.
    """

    name: str
    unit: str
    count: int
    values: tuple[float, ...]
    tolerances: tuple[float, ...]
    shares: tuple[float, ...]

    @property
    def ok(self) -> bool:
        """True if something was compared and stays within tolerance everywhere."""
        return self.count > 0 and all(share <= 1.0 for share in self.shares)

    @property
    def worst(self) -> tuple[float, float]:
        """(percentile, share) where the largest share of the tolerance is used."""
        return max(zip(PERCENTILES, self.shares, strict=True), key=lambda pair: pair[1], default=(100.0, 0.0))

    def to_json(self) -> dict:
        """Plain numbers, percentiles as keys."""
        figures = {}
        for p, value, tolerance, share in zip(PERCENTILES, self.values, self.tolerances, self.shares, strict=False):
            figures[percentile_name(p)] = {"value": value, "tolerance": tolerance, "share_of_tolerance": share}
        return {"name": self.name, "unit": self.unit, "count": self.count, "ok": self.ok, "percentiles": figures}


def measure(name: str, unit: str, errors: Array, one_rounding: Array, floor: Array | float = 0.0) -> PassErrors:
    """Errors against their tolerances.

    errors : (n,) in `unit`, finite.
    one_rounding : (n,) in `unit`, what one rounding causes at each pixel.
    floor : in `unit`, what storage alone may cause at every percentile; (n,) or one number.
    """
    if not len(errors):
        return PassErrors(name, unit, 0, (), (), ())
    values = np.percentile(errors, PERCENTILES)
    tolerances = [np.median(k * one_rounding + floor) for k in ROUNDINGS]
    shares = [
        np.percentile(errors / np.maximum(k * one_rounding + floor, np.finfo(float).tiny), p)
        for p, k in zip(PERCENTILES, ROUNDINGS, strict=True)
    ]
    return PassErrors(name, unit, len(errors), *(tuple(float(x) for x in figures) for figures in (values, tolerances, shares)))


def plain(value: float | None, digits: int = 2) -> str:
    """A few significant digits without powers of ten: 0.000052; 1,700; ∞ for None, which stands for it in JSON."""
    if value is None or not math.isfinite(value):
        return "∞"
    rounded = float(f"{value:.{digits - 1}e}")
    return f"{rounded:,.0f}" if abs(rounded) >= 1000 else np.format_float_positional(rounded, trim="-")


def percentile_name(percentile: float) -> str:
    """p50, p90, p99, p99.9, max."""
    return "max" if percentile == 100 else f"p{percentile:g}"


TURNS = {"upside down": (-1, 1), "mirrored left to right": (1, -1), "turned by half a turn": (-1, -1)}
_LOOKED_AT = 256  # pixels along a side


def looks_turned(reference: Array, test: Array, unlike: Callable[[Array, Array], Array], share: float) -> str:
    """The way in which a picture is turned over, one of TURNS, where it is that and little else; else empty.

    reference, test : (height, width, ...).
    unlike : the difference of pixels.
    share : the share of their difference that is left, at most, once the test is turned back.
    """
    steps = tuple(slice(None, None, max(side // _LOOKED_AT, 1)) for side in reference.shape[:2])
    errors = {
        name: float(unlike(reference[steps], test[::down, ::right][steps]).mean()) for name, (down, right) in TURNS.items()
    }
    best = min(errors, key=errors.__getitem__)
    return best if errors[best] < share * float(unlike(reference[steps], test[steps]).mean()) else ""


def compressed_with_loss(lossy: str) -> str:
    """The sentence that the test's file is. lossy : its compression, empty if it loses nothing."""
    return f"the test picture is compressed with loss ({lossy}): write it with ZIP" if lossy else ""
