"""Drawings of the report as SVG: they scale, print, and take the page's colors in light and dark.

parts.html draws them. Rejected: matplotlib, whose pictures know one background only and which Blender does not
have.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import html_page
from ..html_page import figure
from . import pictures
from .mismatches import KINDS, Mismatches
from .statistics import percentile_name
from .tolerances import PERCENTILES, ROUNDINGS

_PARTS = "comparison/parts.html"

# More mismatches than this are painted as pixels (pictures.stain): marks would hide the picture.
_MOST_MARKED = 400

# The charts' geometry in SVG units: names stand left of _LEFT, figures may reach into _RIGHT.
_WIDTH, _LEFT, _RIGHT, _BASE = 640, 52, 628, 196


class Lane(NamedTuple):
    """A percentile below the histogram: its figures, and where they lie."""

    name: str
    measured: float
    limit: float
    dot: float
    end: float


def histogram(roundings: NDArray[np.floating]) -> str:
    """A chart of the positions' errors, in roundings of float32, with the tolerances.

    roundings : (n,) error of each pixel over what one rounding causes there.
    """
    low, high = -3.0, max(2.0, math.ceil(math.log10(max(float(roundings.max(initial=0.0)), 1e-9))))

    def place(value: float) -> float:
        exponent = min(max(math.log10(max(value, 1e-30)), low), high)
        return round(_LEFT + (_RIGHT - _LEFT) * (exponent - low) / (high - low), 1)

    counts, edges = np.histogram(np.log10(np.clip(roundings, 10**low, 10**high)), bins=84, range=(low, high))
    measured = [float(np.percentile(roundings, p)) if roundings.size else 0.0 for p in PERCENTILES]
    return _drawn(
        "Histogram of position errors in roundings of float32, and below it each percentile with its tolerance",
        128,
        bars=_bars(counts, [place(10**edge) for edge in edges], max(int(counts.max(initial=0)), 1)),
        ticks=[(place(10.0**decade), figure(10.0**decade)) for decade in range(int(low), int(high) + 1)],
        lanes=[
            Lane(percentile_name(p), value, limit, place(value), place(limit))
            for p, value, limit in zip(PERCENTILES, measured, ROUNDINGS, strict=True)
        ],
    )


def bell(errors: NDArray[np.float64], limit: float) -> str:
    """A chart of the tiles' differences, in standard errors, below the curve that chance alone makes.

    errors : (n,).
    limit : standard errors, what is allowed.
    """
    reach = max(math.ceil(1.2 * limit), 4)

    def place(value: float) -> float:
        return round(_LEFT + (_RIGHT - _LEFT) * (min(max(value, -reach), reach) + reach) / (2 * reach), 1)

    counts, edges = np.histogram(np.clip(errors, -reach, reach), bins=6 * reach, range=(-reach, reach))
    chance = [len(errors) * (math.erf(b / math.sqrt(2)) - math.erf(a / math.sqrt(2))) / 2 for a, b in pairwise(edges)]
    most = max(*counts, *chance, 1.0)
    middles = [place((a + b) / 2) for a, b in pairwise(edges)]
    return _drawn(
        "Histogram of the tiles' differences in standard errors, with the curve of chance and what is allowed",
        48,
        bars=_bars(counts, [place(edge) for edge in edges], most),
        ticks=[(place(x), f"{x:+d}") for x in range(-reach, reach + 1, max(reach // 4, 1))],
        limits=[place(-limit), place(limit)],
        curve=" ".join(f"{x},{_BASE - _tall(count, most)}" for x, count in zip(middles, chance, strict=True)),
    )


def marks(mismatches: Mismatches, size: tuple[int, int]) -> str:
    """The mismatches over a picture of this size, (width, height): as marks, or as pixels where they are many."""
    width, height = size
    if len(mismatches.kinds) > _MOST_MARKED:
        return html_page.filled(_PARTS, "marks", stain=pictures.png_uri(pictures.stain(mismatches, size)))
    places = [
        (mismatches.columns[i] + 0.5, height - mismatches.rows[i] - 0.5, mismatches.explained[i], mismatch_text(mismatches, i))
        for i in range(len(mismatches.kinds))
    ]
    return html_page.filled(_PARTS, "marks", stain=None, width=width, height=height, places=places)


def mismatch_text(mismatches: Mismatches, i: int) -> str:
    """A mismatch, told in a line."""
    where = f"column {mismatches.columns[i]}, row {mismatches.rows[i]}: {KINDS[mismatches.kinds[i]]}"
    if mismatches.explained[i]:
        return f"{where}, explained by a shift of {figure(mismatches.shifts[i])} px"
    return f"{where}, unexplained"


def _drawn(label: str, below: int, **parts: object) -> str:
    """The chart. below : the room below the axis."""
    placed = {"width": _WIDTH, "height": _BASE + below, "left": _LEFT, "right": _RIGHT, "base": _BASE, "label": label}
    return html_page.filled(_PARTS, "chart", **({"lanes": (), "limits": (), "curve": ""} | placed | parts))


def _bars(counts: NDArray[np.int64], edges: list[float], most: float) -> list[tuple[float, float, float, float]]:
    return [
        (start, round(_BASE - _tall(count, most), 1), round(stop - start - 1, 1), _tall(count, most))
        for count, (start, stop) in zip(counts, pairwise(edges), strict=True)
        if count
    ]


def _tall(count: float, most: float) -> float:
    """A bar's height: the square root, so that few show too."""
    return round((_BASE - 8) * math.sqrt(count / most), 1)
