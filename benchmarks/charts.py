"""Charts of measurements: what a chart holds, how it is drawn as SVG, and whether the method in use is the best on it.

A sweep towards a failure gives one curve for each candidate method; the method in use is drawn bold. A method that gives no
answer somewhere is drawn as a cross at the upper edge, an error of exactly 0 on the lower one. Every chart carries its caption
with it: what to read off, the machine and the versions, and the command that draws it again.

Drawn with matplotlib, the ecosystem's usual choice. The report of a check draws its own (comparison/charts), since Blender has
no matplotlib.
"""

import dataclasses
import functools
import importlib
import importlib.metadata
import itertools
import json
import math
import operator
import os
import platform
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import LogLocator, MaxNLocator

from viewcam_addon.errors import InputError
from viewcam_addon.files import written_whole
from viewcam_addon.terminal import silent_libraries

# matplotlib's categories, as dark as paper needs them, without the gray of the grid and the blue of the method in use.
_COLORS = ("#d2620a", "#248c24", "#d62728", "#9467bd", "#8c564b", "#c9519f", "#85860f", "#0e8a99")
_MARKERS = "osv^Dd<>"
_OURS = "#0b3d91"
_OURS_STYLES = tuple((_OURS, marker, line) for marker, line in zip("osD^", ("-", "--", "-.", ":"), strict=True))
_INK, _BACKGROUND, _FAINT, _GRID = "#1f2328", "#ffffff", "#656d76", "#e5e8eb"
# The colors on dark pages. A picture on a page knows what its reader prefers, and not the page's own colors: so it brings its
# paper along.
_IN_THE_DARK = {_INK: "#e6edf3", _BACKGROUND: "#0d1117", _FAINT: "#9198a1", _GRID: "#30363d", _OURS: "#58a6ff"}
_LIGHTER = ("#ff9a3c", "#4cc24c", "#ff7b72", "#bc8cff", "#c69083", "#f19cd2", "#cfd03a", "#39cfe0")
_IN_THE_DARK |= dict(zip(_COLORS, _LIGHTER, strict=True))
_FEW = 300  # times the least x, up to which the greatest leaves room for numbers between the powers of ten
# Packages that a measurement depends on, as far as they are installed.
_PACKAGES = ("numpy", "embreex", "bpy", "mitsuba")


@dataclass(frozen=True)
class Curve:
    """One method on a chart.

    x, y : the points' numbers, as many of each. y = 0 lies on the lower edge; nan and inf mean that the method has no answer
        there.
    ours : true for the method in use.
    league : curves compete with those of the same league only (a method that computes in float64 does not compete with what
        Blender stores in float32).
    tie : errors up to this count as equal, the chart's own tie if it is None.
    limit : no method, but what the others of its league must not exceed.
    spread : the least and the most of each x, where it was measured several times.
    minor : true to draw it in the background.
    """

    name: str
    x: Sequence[float]
    y: Sequence[float]
    ours: bool = False
    league: str = ""
    tie: float | None = None
    limit: bool = False
    spread: Sequence[tuple[float, float]] = ()
    minor: bool = False

    def __post_init__(self) -> None:
        if len(self.x) != len(self.y):
            raise ValueError(f"curve {self.name!r} has {len(self.x)} x and {len(self.y)} y")


@dataclass(frozen=True)
class Chart:
    """A sweep: one curve for each method.

    name : the name of its file, without subject and extension.
    reading : a sentence that says what to read off.
    tie : errors up to this count as equal, inf where nothing is judged.
    reverse : the failure lies at small x, and x falls to the right.
    log_x, log_y : true for a logarithmic axis.
    levels : heights that methods are compared at.
    rows : a row for each method, named at its left, with y written at its right: where methods have a point or two each. They
        are what the points of a row are, the first filled and the second hollow.
    """

    name: str
    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    reading: str
    tie: float
    reverse: bool = False
    log_x: bool = True
    log_y: bool = True
    levels: tuple[float, ...] = ()
    rows: tuple[str, ...] = ()

    def behind(self) -> list[str]:
        """One sentence for each place where the method in use is worse than twice the best of its league, and beyond a tie;
        and for each where a method is above a limit.
        """
        sentences = []
        for limit in (curve for curve in self.curves if curve.limit):
            judged = [curve for curve in self.curves if curve.league == limit.league and not curve.limit]
            for x, most in zip(limit.x, limit.y, strict=True):
                sentences += [
                    f"{self.title}: at {x:.3g} {name} is {y:.3g}, above {limit.name}, {most:.3g}"
                    for y, name in _errors_at(x, judged)
                    if y > most
                ]
        for ours in (curve for curve in self.curves if curve.ours):
            rivals = [curve for curve in self.curves if curve.league == ours.league and not (curve.ours or curve.limit)]
            tie = self.tie if ours.tie is None else ours.tie
            for x, error in zip(ours.x, ours.y, strict=True):
                best, name = min(_errors_at(x, rivals), default=(math.inf, ""))
                if math.isfinite(best) and not error <= max(tie, 2 * best):  # nan is worse than any
                    sentences.append(f"{self.title}: at {x:.3g} {ours.name} is off by {error:.3g}, {name} by {best:.3g}")
        return sentences

    def lines(self) -> list[str]:
        """The lines that the shell prints beside the reading."""
        return []

    def figures(self) -> dict[str, Any]:
        """All that it is drawn from, for JSON, but for what is left at its default: null where a method has no answer."""
        curves = [_stated(curve, dataclasses.fields(Curve)) for curve in self.curves]
        return {**_stated(self, dataclasses.fields(Chart)), "curves": curves}

    @staticmethod
    def of_figures(figures: Mapping[str, Any]) -> "Chart":
        """The chart that these figures are of."""
        known = {field.name: figures[field.name] for field in dataclasses.fields(Chart) if field.name in figures}
        curves = [curve | {"y": [math.nan if y is None else y for y in curve["y"]]} for curve in figures["curves"]]
        return Chart(**known | {"curves": tuple(Curve(**curve) for curve in curves), "tie": figures.get("tie") or math.inf})


def _stated(record: Chart | Curve, fields: Sequence[dataclasses.Field[Any]]) -> dict[str, Any]:
    values = ((field, _plain(getattr(record, field.name))) for field in fields if field.name != "curves")
    return {field.name: value for field, value in values if value != _plain(field.default)}


def _plain(value: Any) -> Any:
    """The value as JSON has it; None where a number is not finite."""
    if isinstance(value, str | bool | None) or value is dataclasses.MISSING:
        return value
    if isinstance(value, Iterable):
        return [_plain(each) for each in value]
    return float(value) if math.isfinite(value) else None


def _errors_at(x: float, curves: Sequence[Curve]) -> list[tuple[float, str]]:
    return [
        (y, curve.name)
        for curve in curves
        for where, y in zip(curve.x, curve.y, strict=True)
        if where == x and math.isfinite(y)
    ]


def machine() -> str:
    """The machine and the versions that a measurement was taken with, in a line."""
    versions = []
    for package in _PACKAGES:
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return f"{_processor()}, {os.cpu_count()} cores, Python {platform.python_version()}, {', '.join(versions)}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def draw(charts: Sequence[Chart], path: Path, command: str, measured_on: str = "") -> None:
    """Write charts, one above the other, as one SVG, whole or not at all.

    command : the command that measures them again, for the captions.
    measured_on : the machine and versions, those here if it is empty.

    Raises InputError if the file can't be written.
    """
    # Letters stay text. The font that matplotlib brings along is the widest of the usual ones, so that another fits as well.
    settings = {"svg.fonttype": "none", "svg.hashsalt": charts[0].name, "font.family": "DejaVu Sans", "font.size": 9}
    settings |= dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), _INK)
    settings |= dict.fromkeys(("figure.facecolor", "axes.facecolor", "savefig.facecolor"), _BACKGROUND)
    with matplotlib.rc_context(settings), written_whole(path) as temporary:
        heights = [sum(_heights(chart)) for chart in charts]
        figure = Figure(figsize=(9, sum(heights)))
        panels = figure.subfigures(len(charts), squeeze=False, hspace=0, height_ratios=heights)[:, 0]
        for chart, panel in zip(charts, panels, strict=True):
            _draw_panel(chart, panel, f"{command}\n{measured_on or machine()}")
        described = {
            "Title": "; ".join(chart.title for chart in charts),
            "Description": " ".join(chart.reading for chart in charts),
        }
        figure.savefig(temporary, format="svg", metadata={"Date": None, **described})
        text = temporary.read_text(encoding="utf-8")
        temporary.write_text(text.replace("</style>", f"{_dark_rules()}</style>", 1), encoding="utf-8")


def _reading(chart: Chart) -> list[str]:
    return textwrap.wrap(chart.reading, 132)


def _heights(chart: Chart) -> tuple[float, float, float]:
    """The inches above a chart's axes, of the axes, and below them. Rows have heads above their columns."""
    above, tall = (0.96, 0.5 + 0.4 * len(chart.curves)) if chart.rows else (0.46, 4.2)
    return above, tall, 1.19 + 0.17 * max(len(_reading(chart)), 3)


def _draw_panel(chart: Chart, panel: SubFigure, origin: str) -> None:
    above, tall, below = _heights(chart)
    up = 1 / (above + tall + below)
    if chart.rows:
        panel.text(0.03, 1 - 0.28 * up, chart.title, fontsize=12, fontweight="bold")
        _draw_rows(chart, panel.add_axes((0.27, below * up, 0.54, tall * up)))
    else:
        axes = panel.add_axes((0.085, below * up, 0.655, tall * up))
        _draw_axes(chart, axes)
        for curve, *style in _styles(chart):
            _draw_curve(curve, axes, *style)
        order = {_label(curve): place for place, curve in enumerate(chart.curves)}
        lines = sorted(axes.get_legend_handles_labels()[0], key=lambda line: order[line.get_label()])
        look = {"frameon": False, "labelspacing": 0.8, "handlelength": 3, "fontsize": 8.5}
        axes.legend(handles=lines, loc="upper left", bbox_to_anchor=(1.01, 1), **look)
    panel.text(0.03, (below - 0.64) * up, "\n".join(_reading(chart)), va="top", linespacing=1.35)
    panel.text(0.03, 0.16 * up, origin, color=_FAINT, fontsize=7.5, linespacing=1.4)


def _dark_rules() -> str:
    """CSS that turns the colors, which matplotlib writes into each element, where the reader prefers a dark page."""
    rules = [
        f'[style*="{what}: {light}"] {{{what}: {dark} !important}}'
        for light, dark in _IN_THE_DARK.items()
        for what in ("fill", "stroke")
    ]
    return "@media (prefers-color-scheme: dark) {" + " ".join(rules) + "}"


def _draw_axes(chart: Chart, axes: Axes) -> None:
    axes.set_title(chart.title, loc="left", fontsize=12, fontweight="bold", pad=12)
    axes.set_xlabel(chart.x_label)
    axes.set_ylabel(chart.y_label)
    axes.grid(color=_GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    if chart.log_x:
        _make_x_logarithmic(axes)
    elif all(float(x).is_integer() for curve in chart.curves for x in curve.x):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if chart.log_y:
        axes.set_yscale("log")
        axes.set_ylim(*_decades(chart))
    if chart.reverse:
        axes.invert_xaxis()
    for level in chart.levels:
        axes.axhline(level, color=_FAINT, linewidth=0.9, linestyle=(0, (4, 3)))
        axes.annotate(f"{level:g}", (0.995, level), xycoords=("axes fraction", "data"), ha="right", va="bottom", color=_FAINT)


def _draw_rows(chart: Chart, axes: Axes) -> None:
    """The best on top: by y, then by the first x. A line says how far a row's measurements spread."""
    curves = sorted(chart.curves, key=lambda curve: (not math.isfinite(curve.y[0]), curve.y[0], min(curve.x)), reverse=True)
    axes.set_xlabel(chart.x_label)
    axes.grid(axis="x", color=_GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)
    if chart.log_x:
        _make_x_logarithmic(axes)
    axes.set_ylim(-0.6, len(curves) - 0.4)
    axes.set_yticks(range(len(curves)), [curve.name for curve in curves])
    axes.tick_params(axis="y", length=0)
    for place, curve in enumerate(curves):
        color = _OURS if curve.ours else _COLORS[0]
        axes.axhline(place, color=_GRID, linewidth=0.8, zorder=0)
        if curve.spread:
            axes.hlines([place] * len(curve.x), *np.transpose(curve.spread), color=color, linewidth=2.5, alpha=0.5)
        for x, fill in zip(curve.x, (color, _BACKGROUND), strict=False):
            axes.plot(x, place, "o", markersize=8, markeredgewidth=2, markeredgecolor=color, markerfacecolor=fill)
        answer = f"{curve.y[0]:.2g}" if math.isfinite(curve.y[0]) else "no answer"
        axes.annotate(answer, (1.02, place), xycoords=("axes fraction", "data"), va="center")
    axes.annotate(textwrap.fill(chart.y_label, 23), (1.02, 1.01), xycoords="axes fraction", va="bottom", color=_FAINT)
    text = "   ".join(f"{mark} {what}" for mark, what in zip("●○", chart.rows, strict=False))
    axes.annotate(text, (0, 1.02), xycoords="axes fraction", va="bottom", color=_FAINT)


def _make_x_logarithmic(axes: Axes) -> None:
    """Numbers up to 100,000 are written out. 2 and 5 have ticks, and numbers where few decades are shown."""
    axes.set_xscale("log")
    axes.xaxis.set_minor_locator(LogLocator(subs=(2, 5)))  # 0.3 would meet 0.4
    powers = axes.xaxis.get_major_formatter()

    def written(x: float, is_minor: bool) -> str:
        low, high = sorted(axes.get_xlim())
        if is_minor and high > _FEW * low:
            return ""
        return f"{x:,.6g}" if low > 1e-4 and high < 1e6 else powers(x)

    axes.xaxis.set_major_formatter(lambda x, _: written(x, False))
    axes.xaxis.set_minor_formatter(lambda x, _: written(x, True))


def _decades(chart: Chart) -> tuple[float, float]:
    """The powers of ten about all that has a logarithm, and one more below for zeros and above for crosses."""
    drawn = np.concatenate([chart.levels, *(np.asarray(curve.y, float) for curve in chart.curves)])
    values = drawn[np.isfinite(drawn) & (drawn > 0)]
    low, high = (values.min(), values.max()) if len(values) else (chart.tie, chart.tie)
    below, above = bool((drawn == 0).any()), not np.isfinite(drawn).all()
    first, last = math.floor(math.log10(low)) - below, math.ceil(math.log10(high)) + above
    return 10.0**first, 10.0 ** max(last, first + 1)


def _styles(chart: Chart) -> list[tuple[Curve, str, str, str]]:
    """Each curve with its color, marker and line; those in use last, so that they lie on top."""
    ours = itertools.cycle(_OURS_STYLES)
    others = iter(zip(_COLORS, _MARKERS, strict=True))
    styled = [
        (curve, *(next(ours) if curve.ours else (_FAINT, "", "--") if curve.limit else (*next(others), "-")))
        for curve in chart.curves
    ]
    return sorted(styled, key=lambda style: style[0].ours)


def _draw_curve(curve: Curve, axes: Axes, color: str, marker: str, line: str) -> None:
    x, y = np.asarray(curve.x, float), np.asarray(curve.y, float)
    low, high = axes.get_ylim()
    answered = np.isfinite(y)
    clipped = np.where(answered, np.clip(y, low, high) if axes.get_yscale() == "log" else y, np.nan)
    style = {"linewidth": 2.8, "markersize": 5} if curve.ours else {"linewidth": 1.6, "markersize": 4}
    if curve.minor:
        style = {"linewidth": 1.0, "markersize": 3, "alpha": 0.45}
    axes.plot(x, clipped, color=color, marker=marker, linestyle=line, label=_label(curve), clip_on=False, **style)
    if curve.spread and not curve.minor:
        axes.hlines(clipped, *np.transpose(curve.spread), color=color, linewidth=1.2, alpha=0.6)
    if not answered.all():
        axes.plot(x[~answered], np.full((~answered).sum(), high), "x", color=color, markersize=6, clip_on=False)


def _label(curve: Curve) -> str:
    return textwrap.fill(curve.name, 25)


def run(
    package: str, sweeps: Sequence[str], folder: Path, only: Sequence[str] = (), quick: bool = False
) -> tuple[int, dict[str, Any]]:
    """Measure the sweeps of a package of benchmarks and draw their charts into `folder`.

    sweeps : the package's modules, each with a `charts(quick)`.
    only : some of them, all if it is empty.
    quick : few trials.

    Returns 0, or 1 if the method in use is behind another somewhere, and their figures.

    Raises InputError if there is no such sweep, or the folder can't be written to.
    """

    def measure(sweep: str, quick: bool) -> Iterable[Chart]:
        with silent_libraries():  # Blender prints a line for each picture
            return importlib.import_module(f".{sweep}", package).charts(quick)

    subject = package.rpartition(".")[2]
    return run_all(subject, {sweep: functools.partial(measure, sweep) for sweep in sweeps}, folder, only, quick)


def run_all(
    subject: str,
    sweeps: Mapping[str, Callable[[bool], Iterable[Chart]]],
    folder: Path,
    only: Sequence[str] = (),
    quick: bool = False,
) -> tuple[int, dict[str, Any]]:
    """`run` for sweeps that are given as name → a function of `quick`."""
    unknown = set(only) - set(sweeps)
    if unknown:
        raise InputError(f"there is no sweep {min(unknown)!r}: choose from {', '.join(sweeps)}")
    measured: dict[str, Any] = {}
    behind: list[str] = []
    for sweep in only or sweeps:
        command = f"python -m benchmarks {subject} --only {sweep}{' --quick' if quick else ''}"
        drawing, drawn = f"{subject}-{sweep.replace('_', '-')}", []
        for chart in sweeps[sweep](quick):
            drawn.append(chart)
            name = f"{subject}-{chart.name}"
            print(f"{name}: {chart.reading}", *chart.lines(), sep="\n", flush=True)
            measured[name] = {"drawing": drawing, "command": command, "machine": machine(), **chart.figures()}
            behind += chart.behind()
        draw(drawn, folder / f"{drawing}.svg", command)
    for sentence in behind:
        print(sentence)
    return (1 if behind else 0), {"behind": behind, "charts": measured}


def read(figures: Path) -> dict[str, Any]:
    """The figures of an earlier run, as `run_all` tells them. figures : the JSON that it wrote.

    Raises InputError if the file can't be read or has no figures of charts.
    """
    try:
        record = json.loads(figures.read_text(encoding="utf-8"))
        for each in record["charts"].values():
            Chart.of_figures(each), each["drawing"], each["command"], each["machine"]
        return {"behind": [*record["behind"]], "charts": record["charts"]}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"{figures} has no figures of charts: give what `python -m benchmarks SUBJECT --json` wrote"
        ) from error


def redraw(earlier: dict[str, Any], folder: Path) -> tuple[int, dict[str, Any]]:
    """Draw charts into `folder` from figures, without measuring anything. Returns 0 and these figures.

    Raises InputError if the folder can't be written to.
    """
    for drawing, group in itertools.groupby(earlier["charts"].values(), operator.itemgetter("drawing")):
        first, *others = group
        charts = [Chart.of_figures(each) for each in (first, *others)]
        draw(charts, folder / f"{drawing}.svg", first["command"], first["machine"])
    return 0, earlier


def beside(earlier: dict[str, Any], measured: dict[str, Any]) -> tuple[int, dict[str, Any]]:
    """The figures of a run of some sweeps, with those that an earlier run had of the others, as `run_all` tells them."""
    replaced = tuple(f"{each['title']}: " for each in measured["charts"].values())
    behind = [sentence for sentence in earlier["behind"] if not sentence.startswith(replaced)] + measured["behind"]
    return (1 if behind else 0), {"behind": behind, "charts": earlier["charts"] | measured["charts"]}
