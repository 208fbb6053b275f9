"""The report of a comparison of light; page.py has what it shares with that of geometry."""

import math
import os
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..image import Image
from . import charts, difference, page, pictures
from .charts import figure
from .hypothesis_tests import WHOLE, HypothesisTest
from .light_verdict import change_words, edge_words, place_words, samples_words
from .radiance import LightRow, RadianceComparison
from .tolerances import PERCENTILES, ROUNDINGS

# Under the loupe: one place for each test that failed, the first of them.
_MOST_CROPS = 8
_COLOURS = "blue where the test is darker, orange where it is brighter"
_FOOTER = (
    "Light is compared by statistics, never by looks: two pictures are called different only where a difference is more than "
    "chance explains, and chance itself brings that about in one comparison of a hundred at most."
)
_STEADY_FOOTER = "Without noise both pictures must agree within what float32 rounds, pixel by pixel."
_NOISY_NOTE = (
    "The worst difference of all pixels and of all tiles, in standard errors of its own noise, and how many chance allows "
    "there. A bar is the share of that, and a full bar is the limit. The ratio is test over reference in the mean."
)
_STEADY_NOTE = (
    "The error at five percentiles, relative to the light. A bar is the share of what float32 allows at each pixel: the "
    "picture's shift times the slope of the light, and the roundings of the light itself."
)


@np.errstate(all="ignore")
def write_report(
    comparison: RadianceComparison,
    reference: Image,
    tests: Sequence[Image],
    folder: str | os.PathLike[str],
    ledger: Sequence[Any] = (),
    command: str = "",
    facts: Mapping[str, str] | None = None,
) -> Path:
    """Write folder/index.html and return its path.

    tests : the pictures that were compared, in any number. ledger, command, facts : as for page.frame.

    Raises
    ------
    InputError
        if the folder can't be written.
    """
    bright = pictures.brightness(reference["Combined"][..., :3])
    shown = tuple(pictures.tone_mapped(side, bright) for side in (reference["Combined"][..., :3], comparison.test))
    viewer = page.Viewer()
    viewer.add(
        "picture", "Combined", f"{page.SWAP} Both under one exposure.{_mean_of(tests)}", reference=shown[0], test=shown[1]
    )
    for name, values in comparison.maps.items():
        _add_map(viewer, comparison, name, values)
    parts = {
        **page.frame(comparison, reference, tests[0], ledger, command, facts or {}),
        **viewer.parts(),
        "tiles": _tiles(comparison),
        "table_note": _NOISY_NOTE if comparison.is_noisy else _STEADY_NOTE,
        "table": _table(comparison),
        **_chart(comparison),
        "sides": _sides(comparison, reference, tests),
        "loupe": _loupe(comparison, shown),
        "camera": page.camera(comparison.pinhole, (0.0, 0.0, 0.0)),
        "view": page.view(comparison.pinhole),
        "footer": _FOOTER if comparison.is_noisy else _STEADY_FOOTER,
    }
    return page.written(folder, "report_light.html", parts)


def _mean_of(tests: Sequence[Image]) -> str:
    return f" The test is the mean of {len(tests)} pictures with other seeds." if len(tests) > 1 else ""


def _tiles(comparison: RadianceComparison) -> str:
    row, seen = comparison.rows[0], comparison.appearance
    flip = "–" if seen.flip is None else f"{seen.flip:.4f}"
    if not comparison.is_noisy:
        compared = row.noise_free.count
        told = {
            "Compared": f"{compared:,} <small>pixels without noise</small>",
            "Median error": figure(row.noise_free.values[0]) if compared else "–",
            "Worst error": figure(row.noise_free.values[-1]) if compared else "–",
            "At edges": f"{row.edges.count:,} <small>of {row.edges.allowed:,} allowed</small>",
        }
    else:
        worst = max(row.hypothesis_tests, key=lambda test: abs(test.worst.errors) / test.limit)
        told = {
            "Mean, test over reference": f"{row.ratio:.5f} <small>± {row.ratio_error:.5f}</small>",
            "Bias that would show": f"{100 * row.visible:.2f} <small>%</small>",
            "Worst difference": f"{abs(worst.worst.errors):.1f} <small>of {worst.limit:.1f} standard errors</small>",
            "FLIP": flip,
        }
    return page.tiles(told)


def _add_map(viewer: page.Viewer, comparison: RadianceComparison, name: str, values: np.ndarray) -> None:
    """A view of one map, in the scale that suits its kind."""
    quantity, _, kind = name.partition(": ")
    words = kind if quantity == "Combined" else name.replace(": ", " · ")
    words, view = words[:1].upper() + words[1:], name.lower().replace(": ", "-").replace(" ", "-")
    row = next((row for row in comparison.rows if row.name == quantity), None)
    if name == "FLIP":
        caption = "What an eye notices when the two are swapped on a screen, from 0 to 1, on a logarithmic scale."
        legend = page.logarithmic_legend(0.01, 1.0, {}, "FLIP")
        viewer.add(view, words, caption + legend, image=pictures.on_scale(values, 0.01, 1.0))
    elif kind == "roundings":
        high = 10.0 ** max(2, math.ceil(math.log10(max(float(values.max()), 1e-9))))
        caption = "Error of each pixel in roundings of float32, on a logarithmic scale."
        limits = {"allowed in the median": ROUNDINGS[0], "at most": ROUNDINGS[-1]}
        legend = page.logarithmic_legend(1e-2, high, limits, "roundings")
        viewer.add(view, words, caption + legend, image=pictures.on_scale(values, 1e-2, high))
    elif kind == "difference":
        caption = f"Test minus reference: {_COLOURS}."
        _add_signed(viewer, view, words, caption, values, difference.spread(values), "radiance")
    else:
        test = row.hypothesis_tests[1 if kind == "tiles" else 0]
        what = {"tiles": f"The difference of each of the {test.name}"}.get(kind, "The difference of each pixel")
        caption = f"{what} in standard errors of its own noise: {_COLOURS}."
        limit = max(6.0, 1.25 * test.limit)
        _add_signed(viewer, view, words, caption, values, limit, "standard errors", test.limit)


def _add_signed(
    viewer: page.Viewer,
    view: str,
    words: str,
    caption: str,
    values: np.ndarray,
    limit: float,
    unit: str,
    allowed: float | None = None,
) -> None:
    legend = page.signed_legend(limit, unit, allowed)
    viewer.add(view, words, caption + legend, pictures.signed_scale(), image=pictures.signed(values, limit))


def _table(comparison: RadianceComparison) -> str:
    if not comparison.is_noisy:
        body = page.percentiles([row.noise_free for row in comparison.rows])
        body += "".join(_edge_line(row) for row in comparison.rows if row.edges.count + row.edges.leaks)
    else:
        names = ("Quantity", "Reference", "Test", "Ratio", *(q.name for q in comparison.rows[0].hypothesis_tests), "")
        body = f"<thead><tr>{''.join(f'<th scope=col>{name}</th>' for name in names)}</tr></thead><tbody>"
        body += "".join(map(_noisy_line, comparison.rows))
    width = 3 + len(PERCENTILES)
    body += "".join(
        f'<tr><th scope=row>{name}</th><td colspan="{width}" style="text-align:left">the same to the last bit</td></tr>'
        for name in comparison.equal
    )
    return body + "</tbody>"


def _noisy_line(row: LightRow) -> str:
    cells = f"<td>{figure(row.reference)}</td><td>{figure(row.test)}</td><td>{row.ratio:.5f} ± {row.ratio_error:.5f}</td>"
    cells += "".join(map(_answer_cell, row.hypothesis_tests))
    return f"<tr><th scope=row>{row.name}</th>{cells}<td>{page.mark(row.ok)}</td></tr>"


def _answer_cell(test: HypothesisTest) -> str:
    if test.is_open:
        return '<td title="the noise of single pixels is not known, or none differs">–</td>'
    errors = abs(test.worst.errors)
    title = f"{place_words(test.worst, test.size)}; {test.limit:.2f} standard errors are allowed"
    return page.bar_cell(f"{errors:.2f} of {test.limit:.2f}", title, errors / test.limit)


def _edge_line(row: LightRow) -> str:
    edges = row.edges
    return (
        f"<tr><th scope=row>{row.name} at edges</th><td>{edges.count + edges.leaks:,}</td>"
        f'<td colspan="{len(PERCENTILES)}" style="text-align:left">{edge_words(edges)}</td><td></td>'
        f"<td>{page.mark(edges.ok)}</td></tr>"
    )


def _chart(comparison: RadianceComparison) -> dict[str, str]:
    if comparison.is_noisy:
        tiles = comparison.rows[0].hypothesis_tests[1]
        return {
            "chart_title": "Is it noise?",
            "chart_note": (
                f"How the differences of the {tiles.name} of Combined are distributed, in standard errors. The curve is what "
                "chance alone makes; what is wrong stands outside. Heights are square roots, so that few tiles show too."
            ),
            "chart": charts.bell(tiles.errors.ravel(), tiles.limit),
        }
    return {
        "chart_title": "Roundings",
        "chart_note": (
            "How many roundings of float32 the light of each pixel is off. Dashed lines are the tolerances; below, each "
            "dot is where a percentile of this picture lies, and its tick where it may end."
        ),
        "chart": charts.histogram(comparison.maps["Combined: roundings"].ravel()),
    }


def _sides(comparison: RadianceComparison, reference: Image, tests: Sequence[Image]) -> str:
    row, (mine, other) = comparison.rows[0], comparison.samples
    words = (
        f"{_maker(reference)}: {_count(mine, 'sample')} a pixel. The mean of Combined is <b>{figure(row.reference)}</b>.",
        f"{_maker(tests[0])}: {_count(other, 'sample')} a pixel in {_count(len(tests), 'picture')}. The mean of Combined is "
        f"<b>{figure(row.test)}</b>.",
    )
    cards = [page.card(title, text, "no-card") for title, text in zip(("Reference", "Test"), words, strict=True)]
    if comparison.is_noisy:
        text = (
            f"At {samples_words(comparison)} a picture that is <b>{100 * row.visible:.2f} %</b> too bright or too dark as a "
            "whole would be found half of the time, and one that is off by half as much again nearly always."
        )
        cards.append(page.card("What would be found", text, ""))
    return "".join(cards)


def _maker(image: Image) -> str:
    software = next((image.attributes[name] for name in ("software", "Software") if name in image.attributes), "")
    return escape(software or Path(image.source).name)


def _count(number: int | None, what: str) -> str:
    return f"an unknown number of {what}s" if number is None else f"{number:,} {what}{'s' if number != 1 else ''}"


def _loupe(comparison: RadianceComparison, shown: tuple) -> str:
    asked = [(row, test) for row in comparison.rows for test in row.hypothesis_tests]
    failed = [(row, test) for row, test in asked if not test.ok and test.size != WHOLE]
    if not failed:
        return ""
    items = "".join(_crop(comparison, shown, row, test) for row, test in failed[:_MOST_CROPS])
    return (
        "<h2>Under the loupe</h2><p class=note>The worst place of each test that failed, in Combined: reference on the "
        f"left, test on the right.</p><ul class=loupe>{items}</ul>"
    )


def _crop(comparison: RadianceComparison, shown: tuple, row: LightRow, test: HypothesisTest) -> str:
    place, size = test.worst, (comparison.pinhole.width, comparison.pinhole.height)
    column, line = (sum(ends) // 2 for ends in (place.columns, place.rows))
    around = max(15, 2 * test.size + 1)
    cut = [pictures.png_uri(pictures.crop(shade, size, column, line, around)) for shade in shown]
    crops = "".join(
        f'<span><img alt="{side}" src="{uri}"></span>' for side, uri in zip(("reference", "test"), cut, strict=True)
    )
    words = (
        f"{row.name}{f' ({place.channel})' if place.channel else ''} {place_words(place, test.size)}: "
        f"{change_words(place.reference, place.test)}, {abs(place.errors):.1f} standard errors of {test.limit:.1f} allowed"
    )
    return f'<li><div class="crops">{crops}</div>{escape(words)}</li>'
