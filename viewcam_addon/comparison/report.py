"""The report of a comparison of geometry; page.py has what it shares with that of light."""

import os
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..image import Image
from . import charts, difference, page, pictures
from .charts import figure
from .geometry import Comparison
from .statistics import Row
from .tolerances import PERCENTILES

# Under the loupe: so many mismatches, the unexplained ones first.
_MOST_CROPS = 8
_UNIT_WORDS = {"px": "in pixels", "relative": "relative to its depth", "°": "in degrees", "absolute": "in texture coordinates"}
_TOOLS = '<label><input type="checkbox" id="show-marks" checked> Mismatches ({count:,})</label>'
_FOOTER = (
    "Both pictures are compared pass by pass, never by looks. Pixels on edges count as explained only where a re-traced ray, "
    "shifted within tolerance, sees what the test picture shows."
)


@np.errstate(all="ignore")
def write_report(
    comparison: Comparison,
    reference: Image,
    test: Image,
    folder: str | os.PathLike[str],
    ledger: Sequence[Any] = (),
    command: str = "",
    facts: Mapping[str, str] | None = None,
) -> Path:
    """Write folder/index.html and return its path.

    ledger : the scene's entries, with `object`, `status` and `reason`. command : what repeats the comparison.
    facts : further lines for the last table, such as versions.

    Raises
    ------
    InputError
        if the folder can't be written.
    """
    shades = (pictures.shaded(reference), pictures.shaded(test))
    pinhole = comparison.stated or comparison.pinhole
    parts = {
        **page.frame(comparison, reference, test, ledger, command, facts or {}),
        "hint": _hint(comparison),
        "tiles": _tiles(comparison),
        "tools": _TOOLS.format(count=len(comparison.mismatches.kinds)),
        **_views(comparison, shades, reference, test),
        "marks": _marks(comparison),
        "passes": _passes(comparison),
        "histogram": charts.histogram(comparison.roundings),
        "errors": _errors(comparison),
        "loupe": _loupe(comparison, shades),
        "camera": page.camera(pinhole, comparison.origin),
        "view": page.view(pinhole),
        "footer": _FOOTER,
    }
    return page.written(folder, "report_geometry.html", parts)


def _hint(comparison: Comparison) -> str:
    """What would mend the picture, if there is such a thing."""
    far = comparison.far_from_origin
    return f'<p class="hint">{escape(page.with_powers(far.sentence))}</p>' if far else ""


def _tiles(comparison: Comparison) -> str:
    position, mismatches = comparison.rows[0], comparison.mismatches
    tiles = {
        "Compared": f"{position.count:,} <small>pixels of {comparison.pixels:,}</small>",
        "Median error": f"{figure(position.values[0])} <small>px</small>" if position.count else "–",
        "Worst error": f"{figure(position.values[-1])} <small>px</small>" if position.count else "–",
        "Mismatches": f"{len(mismatches.kinds):,} <small>{mismatches.unexplained_count:,} unexplained</small>",
    }
    return page.tiles(tiles)


def _views(comparison: Comparison, shades: tuple, reference: Image, test: Image) -> dict[str, str]:
    viewer = page.Viewer()
    caption = f"{page.SWAP} Shaded here from depth, normals and object indices."
    viewer.add("picture", "Both pictures", caption, reference=shades[0], test=shades[1])
    lit = [pictures.tone_mapped(image["Combined"][..., :3]) for image in (reference, test) if "Combined" in image.passes]
    if len(lit) == 2:
        viewer.add("combined", "Combined", page.SWAP, reference=lit[0], test=lit[1])
    elif "Combined" in test.passes:
        caption = "What the renderer made of it; the tracer has no light at this level."
        viewer.add("combined", "As rendered", caption, image=lit[0])
    for row in comparison.rows:
        if row.count:
            low, high = difference.decades(row)
            picture = pictures.on_scale(comparison.maps[row.name], low, high)
            viewer.add(row.name.lower().replace(" ", "-"), f"{row.name} error", _legend(row, low, high), image=picture)
    return viewer.parts()


def _marks(comparison: Comparison) -> str:
    size = (comparison.pinhole.width, comparison.pinhole.height)
    drawn = charts.marks(comparison.mismatches, *size)
    if len(comparison.mismatches.kinds) <= charts.MOST_MARKED:
        return drawn
    return f'<img class="marks" alt="" src="{pictures.png_uri(pictures.stain(comparison.mismatches, size))}">'


def _legend(row: Row, low: float, high: float) -> str:
    words = f"Error of each pixel {_UNIT_WORDS[row.unit]}, on a logarithmic scale; see-through where nothing was compared."
    limits = {"allowed in the median": row.tolerances[0], "at most": row.tolerances[-1]}
    return words + page.logarithmic_legend(low, high, limits, row.unit)


def _passes(comparison: Comparison) -> str:
    rows = [page.percentiles(comparison.rows)]
    for kind, (count, explained) in comparison.mismatches.counts().items():
        words = f"{count - explained:,} unexplained, {explained:,} explained" if count else "none"
        ok = count == 0 or (kind != "not a number" and comparison.mismatches_ok)
        rows.append(
            f"<tr><th scope=row>{kind.capitalize()}</th><td>{count:,}</td>"
            f'<td colspan="{len(PERCENTILES)}" style="text-align:left">{words}</td><td></td><td>{page.mark(ok)}</td></tr>'
        )
    return "".join(rows) + "</tbody>"


def _errors(comparison: Comparison) -> str:
    cards = []
    if comparison.conversion:
        c = comparison.conversion
        words = (
            f"The stated camera and the one read back from Blender differ by at most <b>{figure(c.largest)} px</b> over "
            f"corners, edges and centre; float32 storage allows {figure(c.tolerance)} px there."
        )
        cards.append(page.card("Conversion: the four values → Blender's camera", words, "" if c.ok else "bad-card"))
    else:
        cards.append(page.card("Conversion", "Nobody stated a camera, so there is none to compare Blender's with.", "no-card"))
    if comparison.systematic:
        s, position = comparison.systematic, comparison.rows[0]
        median, worst = figure(position.values[0]), figure(position.values[-1])
        words = f"Positions are <b>{median} px</b> off in the median and <b>{worst} px</b> at worst."
        cards.append(page.card("Renderer: Blender's camera → the picture", words, "" if position.ok else "bad-card"))
        words = (
            f"Shift ({figure(s.shift_x)}, {figure(s.shift_y)}) px, zoom ({figure(s.zoom_x)}, {figure(s.zoom_y)}), "
            f"roll {figure(s.roll)} rad. The mean of all errors is <b>{figure(s.mean)} px</b> long; "
            f"{figure(s.tolerance)} px are allowed."
        )
        cards.append(page.card("What all pixels share", words, "" if s.ok else "bad-card"))
    return "".join(cards)


def _loupe(comparison: Comparison, shades: tuple) -> str:
    mismatches = comparison.mismatches
    if not len(mismatches.kinds):
        return ""
    order = np.argsort(mismatches.explained, kind="stable")
    chosen = order[np.unique(np.linspace(0, len(order) - 1, _MOST_CROPS).astype(int))] if len(order) > _MOST_CROPS else order
    size = (comparison.pinhole.width, comparison.pinhole.height)
    items = []
    for i in chosen:
        column, row = mismatches.columns[i], mismatches.rows[i]
        crops = "".join(
            f'<span><img alt="{side}" src="{pictures.png_uri(pictures.crop(shade, size, column, row))}"></span>'
            for side, shade in zip(("reference", "test"), shades, strict=True)
        )
        words = escape(charts.mismatch_words(mismatches, int(i)))
        items.append(f'<li><div class="crops">{crops}</div>{words[:1].upper() + words[1:]}</li>')
    shown = "" if len(chosen) == len(order) else f" {len(chosen)} of {len(order):,} are shown."
    return (
        "<h2>Under the loupe</h2><p class=note>Pixels that see another surface in the two pictures, amid their surroundings: "
        f"reference on the left, test on the right.{shown}</p><ul class=loupe>{''.join(items)}</ul>"
    )
