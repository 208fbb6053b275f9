"""Drawings of the report as SVG text: they scale, print, and take the page's colours in light and dark.

Rejected: matplotlib, whose pictures know one background only and which Blender does not have.
"""

import math
from collections.abc import Callable
from html import escape
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .mismatches import KINDS, Mismatches
from .statistics import percentile_name
from .tolerances import PERCENTILES, ROUNDINGS

# More mismatches than this are painted as pixels (pictures.stain): marks would hide the picture.
MOST_MARKED = 400

# The histogram's geometry in SVG units: names stand left of _LEFT, figures may reach into _RIGHT.
_WIDTH, _LEFT, _RIGHT, _BASE = 640, 52, 12, 196


def histogram(roundings: NDArray[np.float64]) -> str:
    """How the positions' errors are distributed, in roundings of float32, with the tolerances.

    roundings : (n,) error of each pixel over what one rounding causes there.
    """
    low, high = -3.0, max(2.0, math.ceil(math.log10(max(float(roundings.max(initial=0.0)), 1e-9))))

    def place(value: float) -> float:
        exponent = min(max(math.log10(max(value, 1e-30)), low), high)
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * (exponent - low) / (high - low)

    counts, edges = np.histogram(np.log10(np.clip(roundings, 10**low, 10**high)), bins=84, range=(low, high))
    tall = (_BASE - 8) * np.sqrt(counts / max(int(counts.max(initial=0)), 1))
    bars = "".join(
        f'<rect x="{place(10**start):.1f}" y="{_BASE - bar:.1f}" '
        f'width="{place(10**stop) - place(10**start) - 1:.1f}" height="{bar:.1f}"/>'
        for bar, start, stop in zip(tall, edges[:-1], edges[1:], strict=True)
        if bar
    )
    ticks = "".join(
        f'<line x1="{place(10.0**decade):.1f}" x2="{place(10.0**decade):.1f}" y1="{_BASE}" y2="{_BASE + 5}"/>'
        f'<text x="{place(10.0**decade):.1f}" y="{_BASE + 19}" text-anchor="middle">{figure(10.0**decade)}</text>'
        for decade in range(int(low), int(high) + 1)
    )
    lanes = "".join(
        _lane(_BASE + 42 + 18 * i, place, p, float(np.percentile(roundings, p)) if roundings.size else 0.0, limit)
        for i, (p, limit) in enumerate(zip(PERCENTILES, ROUNDINGS, strict=True))
    )
    label = "Histogram of position errors in roundings of float32, and below it each percentile with its tolerance"
    return (
        f'<svg class="chart" viewBox="0 0 {_WIDTH} {_BASE + 128}" role="img" aria-label="{label}"><g class="bars">{bars}</g>'
        f'<line class="axis" x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{_BASE}" y2="{_BASE}"/>'
        f'<g class="ticks">{ticks}</g>{lanes}</svg>'
    )


def _lane(y: float, place: Callable[[float], float], percentile: float, measured: float, limit: float) -> str:
    """One percentile below the histogram: a dot where it lies, a tick where it may end."""
    name, dot, end = percentile_name(percentile), place(measured), place(limit)
    return (
        f'<g class="{"within" if measured <= limit else "beyond"}"><title>{name}: {measured:.2g} of {limit:g} roundings</title>'
        f'<line class="rule" x1="{end:.1f}" x2="{end:.1f}" y1="8" y2="{y:.1f}"/>'
        f'<line class="reach" x1="{_LEFT}" x2="{end:.1f}" y1="{y}" y2="{y}"/>'
        f'<line class="limit" x1="{end:.1f}" x2="{end:.1f}" y1="{y - 5}" y2="{y + 5}"/><circle cx="{dot:.1f}" cy="{y}" r="4"/>'
        f'<text class="name" x="{_LEFT - 8}" y="{y + 4}" text-anchor="end">{name}</text>'
        f'<text x="{end + 8:.1f}" y="{y + 4}">{figure(measured)} of {figure(limit)}</text></g>'
    )


def bell(errors: NDArray[np.float64], limit: float) -> str:
    """How the tiles' differences are distributed, in standard errors, below the curve that chance alone makes.

    errors : (n,). limit : standard errors, what is allowed.
    """
    reach = max(math.ceil(1.2 * limit), 4)

    def place(value: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * (min(max(value, -reach), reach) + reach) / (2 * reach)

    bins = 6 * reach
    counts, edges = np.histogram(np.clip(errors, -reach, reach), bins=bins, range=(-reach, reach))
    chance = [len(errors) * (math.erf(b / math.sqrt(2)) - math.erf(a / math.sqrt(2))) / 2 for a, b in pairwise(edges)]
    tall = (_BASE - 8) / math.sqrt(max(*counts, *chance, 1.0))
    bars = "".join(
        f'<rect x="{place(start):.1f}" y="{_BASE - tall * math.sqrt(count):.1f}" '
        f'width="{place(stop) - place(start) - 1:.1f}" height="{tall * math.sqrt(count):.1f}"/>'
        for count, (start, stop) in zip(counts, pairwise(edges), strict=True)
        if count
    )
    curve = " ".join(
        f"{place((a + b) / 2):.1f},{_BASE - tall * math.sqrt(count):.1f}"
        for count, (a, b) in zip(chance, pairwise(edges), strict=True)
    )
    ticks = "".join(
        f'<line x1="{place(x):.1f}" x2="{place(x):.1f}" y1="{_BASE}" y2="{_BASE + 5}"/>'
        f'<text x="{place(x):.1f}" y="{_BASE + 19}" text-anchor="middle">{x:+d}</text>'
        for x in range(-reach, reach + 1, max(reach // 4, 1))
    )
    limits = "".join(
        f'<line class="rule" x1="{place(x):.1f}" x2="{place(x):.1f}" y1="8" y2="{_BASE}"/>'
        f'<text x="{place(x):.1f}" y="{_BASE + 38}" text-anchor="middle">allowed</text>'
        for x in (-limit, limit)
    )
    label = "Histogram of the tiles' differences in standard errors, with the curve of chance and what is allowed"
    return (
        f'<svg class="chart" viewBox="0 0 {_WIDTH} {_BASE + 48}" role="img" aria-label="{label}"><g class="bars">{bars}</g>'
        f'<polyline class="curve" points="{curve}"/>'
        f'<line class="axis" x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{_BASE}" y2="{_BASE}"/>'
        f'<g class="ticks">{ticks}</g>{limits}</svg>'
    )


def marks(mismatches: Mismatches, width: int, height: int) -> str:
    """The mismatches as rings (explained) and crosses (unexplained) over a picture of this size."""
    radius = width / 90
    shapes = []
    for i in range(len(mismatches.kinds)):
        x, y = mismatches.columns[i] + 0.5, height - mismatches.rows[i] - 0.5
        told = escape(mismatch_words(mismatches, int(i)))
        if mismatches.explained[i]:
            shape = f'<circle class="explained" cx="{x}" cy="{y}" r="{radius:.2f}">'
            shapes.append(f"{shape}<title>{told}</title></circle>")
        else:
            arm = radius * 0.8
            path = f"M{x - arm:.2f} {y - arm:.2f}l{2 * arm:.2f} {2 * arm:.2f}m0 {-2 * arm:.2f}l{-2 * arm:.2f} {2 * arm:.2f}"
            shapes.append(f'<path class="unexplained" d="{path}"><title>{told}</title></path>')
    box = f'viewBox="0 0 {width} {height}" preserveAspectRatio="none"'
    return f'<svg class="marks" {box} aria-hidden="true">{"".join(shapes)}</svg>'


def mismatch_words(mismatches: Mismatches, i: int) -> str:
    """One mismatch in a line."""
    where = f"column {mismatches.columns[i]}, row {mismatches.rows[i]}: {KINDS[mismatches.kinds[i]]}"
    if mismatches.explained[i]:
        return f"{where}, explained by a shift of {figure(mismatches.shifts[i])} px"
    return f"{where}, unexplained"


def figure(value: float) -> str:
    """A number with two significant digits: 0.50, 1.6·10⁻⁴."""
    if value < 0:
        return "−" + figure(-value)
    if value == 0:
        return "0"
    if not math.isfinite(value):
        return "∞" if value > 0 else "no number"
    digits, exponent = f"{value:.1e}".split("e")
    exponent = int(exponent)
    if -3 < exponent < 5:
        return f"{float(f'{value:.1e}'):.{max(1 - exponent, 0)}f}"
    return f"{digits}·10{_superscript(exponent)}"


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
