"""The HTML report: one file that holds everything, to be looked at rather than read.

The page is report.html, filled by string.Template; pictures.py makes its pixels and charts.py its drawings. Everything that
comes from outside (names, reasons, paths) is escaped. Rejected: a template engine (one page needs none), and pictures as
files beside the page (a report gets mailed).
"""

import json
import math
import os
import platform
import re
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import written_whole
from ..image import Image
from ..pinhole import Pinhole
from . import charts, pictures
from .charts import figure
from .geometry import Comparison
from .law import PERCENTILES
from .statistics import Row, percentile_name

# Under the loupe: so many mismatches, the unexplained ones first.
_MOST_CROPS = 8
_UNIT_WORDS = {"px": "in pixels", "relative": "relative to its depth", "°": "in degrees", "absolute": "in texture coordinates"}
_ICONS = {True: "M20 6 9.5 17 4 11.5", False: "M5 5l14 14M19 5L5 19"}


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
    path = Path(folder) / "index.html"
    if path.parent.exists() and not path.parent.is_dir():
        raise InputError(f"{path.parent} is a file: give a folder for the report")
    page = Template(Path(__file__).with_name("report.html").read_text(encoding="utf-8"))
    text = page.substitute(_parts(comparison, reference, test, ledger, command, facts or {}))
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _parts(
    comparison: Comparison, reference: Image, test: Image, ledger: Sequence[Any], command: str, facts: Mapping[str, str]
) -> dict[str, Any]:
    headline, _, rest = comparison.sentence.partition(": ")
    names = [Path(image.source).name for image in (reference, test)]
    width, height = comparison.pinhole.width, comparison.pinhole.height
    shades = (pictures.shaded(reference), pictures.shaded(test))
    return {
        "outcome": "passed" if comparison.passed else "failed",
        "title": escape(f"{headline} · {names[1]}"),
        "names": escape(f"{names[0]} against {names[1]}"),
        "icon": _ICONS[comparison.passed],
        "headline": escape(headline) + ".",
        "lede": escape(_with_powers(rest[:1].upper() + rest[1:])),
        "hint": _hint(comparison),
        "tiles": _tiles(comparison),
        "width": width,
        "height": height,
        "mismatch_count": f"{len(comparison.mismatches.kinds):,}",
        **_views(comparison, shades, reference, test),
        "marks": _marks(comparison),
        "passes": _passes(comparison),
        "histogram": charts.histogram(comparison.roundings),
        "errors": _errors(comparison),
        "loupe": _loupe(comparison, shades),
        "camera": _camera(comparison.stated or comparison.pinhole, comparison.origin),
        "view": _view(comparison.stated or comparison.pinhole),
        "ledger": _ledger(ledger),
        "facts": _facts(reference, test, facts),
        "command": f"<pre><code>{escape(command)}</code></pre>" if command else "",
        "reference_name": _script_text(f"reference · {names[0]}"),
        "test_name": _script_text(f"test · {names[1]}"),
    }


def _hint(comparison: Comparison) -> str:
    """What would mend the picture, if there is such a thing."""
    far = comparison.far_from_home
    return f'<p class="hint">{escape(_with_powers(far.sentence))}</p>' if far else ""


def _tiles(comparison: Comparison) -> str:
    position, mismatches = comparison.rows[0], comparison.mismatches
    tiles = {
        "Compared": f"{position.count:,} <small>pixels of {comparison.pixels:,}</small>",
        "Median error": f"{figure(position.values[0])} <small>px</small>" if position.count else "–",
        "Worst error": f"{figure(position.values[-1])} <small>px</small>" if position.count else "–",
        "Mismatches": f"{len(mismatches.kinds):,} <small>{mismatches.unexplained_count:,} unexplained</small>",
    }
    return "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in tiles.items())


def _views(comparison: Comparison, shades: tuple, reference: Image, test: Image) -> dict[str, str]:
    """The viewer: tabs, images and captions."""
    tabs, images, captions = [], [], []

    def add(view: str, words: str, caption: str, **sides: pictures.Picture) -> None:
        checked = "" if tabs else " checked"
        radio = f'<input type="radio" name="view" value="{view}" data-words="{words}"{checked}>'
        tabs.append(f"<label>{radio} {words.removesuffix(' error')}</label>")
        images.extend(
            f'<img class="{side}" data-view="{view}" alt="{words}, {side}" src="{pictures.png_uri(picture)}">'
            for side, picture in sides.items()
        )
        captions.append(f'<div data-caption="{view}"{"" if captions else " class=shown"}>{caption}</div>')

    swap = "Point at the picture, tap it, or press the space bar to swap the two."
    add(
        "picture",
        "Both pictures",
        f"{swap} Shaded here from depth, normals and object indices.",
        reference=shades[0],
        test=shades[1],
    )
    if "Combined" in reference.passes and "Combined" in test.passes:
        add(
            "combined",
            "Combined",
            swap,
            reference=pictures.tone_mapped(reference["Combined"][..., :3]),
            test=pictures.tone_mapped(test["Combined"][..., :3]),
        )
    elif "Combined" in test.passes:
        add(
            "combined",
            "As rendered",
            "What the renderer made of it; the tracer has no light at this level.",
            image=pictures.tone_mapped(test["Combined"][..., :3]),
        )
    for row in comparison.rows:
        if row.count:
            low, high = _range(row)
            view = row.name.lower().replace(" ", "-")
            picture = pictures.on_scale(comparison.maps[row.name], low, high)
            add(view, f"{row.name} error", _legend(row, low, high), image=picture)
    return {"tabs": "".join(tabs), "images": "\n".join(images), "captions": "".join(captions)}


def _marks(comparison: Comparison) -> str:
    size = (comparison.pinhole.width, comparison.pinhole.height)
    drawn = charts.marks(comparison.mismatches, *size)
    if len(comparison.mismatches.kinds) <= charts.MOST_MARKED:
        return drawn
    return f'<img class="marks" alt="" src="{pictures.png_uri(pictures.stain(comparison.mismatches, size))}">'


def _range(row: Row) -> tuple[float, float]:
    """Whole decades from a hundredth of the median's tolerance up to the largest error."""
    high = math.ceil(math.log10(max(row.values[-1], row.tolerances[-1])))
    low = math.floor(math.log10(row.tolerances[0] / 100))
    return 10.0**low, 10.0 ** max(high, low + 2)


def _legend(row: Row, low: float, high: float) -> str:
    decades = round(math.log10(high / low))
    scale = "".join(f'<span style="left:{100 * i / decades:.2f}%">{figure(low * 10.0**i)}</span>' for i in range(decades + 1))
    limits = ""
    for name, tolerance in (("allowed in the median", row.tolerances[0]), ("at most", row.tolerances[-1])):
        limits += f'<span style="left:{100 * math.log10(tolerance / low) / decades:.2f}%">{name}</span>'
    strip = pictures.png_uri(np.arange(1, pictures.LEVELS + 1, dtype=np.uint8)[None])
    return (
        f"Error of each pixel {_UNIT_WORDS[row.unit]}, on a logarithmic scale; see-through where nothing was compared."
        f'<div class="legend"><img src="{strip}" alt="Colour scale from {figure(low)} to {figure(high)} {row.unit}">'
        f'<div class="scale">{scale}</div><div class="limits">{limits}</div></div>'
    )


def _passes(comparison: Comparison) -> str:
    head = "".join(f"<th scope=col>{name}</th>" for name in ("Pass", "Pixels", *map(percentile_name, PERCENTILES), "Unit", ""))
    rows = [f"<thead><tr>{head}</tr></thead><tbody>"]
    for row in comparison.rows:
        cells = "".join(_cell(*figures) for figures in zip(row.values, row.tolerances, row.shares, strict=True))
        cells = cells or f'<td colspan="{len(PERCENTILES)}">nothing was compared</td>'
        cells = f"<td>{row.count:,}</td>{cells}<td class=unit>{row.unit}</td><td>{_mark(row.ok)}</td>"
        rows.append(f"<tr><th scope=row>{row.name}</th>{cells}</tr>")
    for kind, (count, explained) in comparison.mismatches.counts().items():
        words = f"{count - explained:,} unexplained, {explained:,} explained" if count else "none"
        ok = count == 0 or (kind != "not a number" and comparison.mismatches_ok)
        rows.append(
            f"<tr><th scope=row>{kind.capitalize()}</th><td>{count:,}</td>"
            f'<td colspan="{len(PERCENTILES)}" style="text-align:left">{words}</td><td></td><td>{_mark(ok)}</td></tr>'
        )
    return "".join(rows) + "</tbody>"


def _cell(value: float, tolerance: float, share: float) -> str:
    title = f"{figure(100 * share)} % of what is allowed; {figure(tolerance)} at the median pixel"
    bar = f'<span class="track"><i style="width:{min(100 * share, 100):.1f}%"></i></span>'
    return f'<td title="{title}"{"" if share <= 1 else " class=over"}>{figure(value)}{bar}</td>'


def _errors(comparison: Comparison) -> str:
    cards = []
    if comparison.conversion:
        c = comparison.conversion
        words = (
            f"The stated camera and the one read back from Blender differ by at most <b>{figure(c.largest)} px</b> over "
            f"corners, edges and centre; float32 storage allows {figure(c.tolerance)} px there."
        )
        cards.append(_card("Conversion: the four values → Blender's camera", words, "" if c.ok else "bad-card"))
    else:
        cards.append(_card("Conversion", "Nobody stated a camera, so there is none to compare Blender's with.", "no-card"))
    if comparison.systematic:
        s, position = comparison.systematic, comparison.rows[0]
        median, worst = figure(position.values[0]), figure(position.values[-1])
        words = f"Positions are <b>{median} px</b> off in the median and <b>{worst} px</b> at worst."
        cards.append(_card("Renderer: Blender's camera → the picture", words, "" if position.ok else "bad-card"))
        words = (
            f"Shift ({figure(s.shift_x)}, {figure(s.shift_y)}) px, zoom ({figure(s.zoom_x)}, {figure(s.zoom_y)}), "
            f"roll {figure(s.roll)} rad. The mean of all errors is <b>{figure(s.mean)} px</b> long; "
            f"{figure(s.tolerance)} px are allowed."
        )
        cards.append(_card("What all pixels share", words, "" if s.ok else "bad-card"))
    return "".join(cards)


def _card(title: str, words: str, kind: str) -> str:
    return f'<div class="{kind}"><h3>{title}</h3><p>{words}</p></div>'


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


def _camera(pinhole: Pinhole, origin: Sequence[float]) -> str:
    rows = {"e, eye": pinhole.eye, "l, look-at": pinhole.look_at, "up": pinhole.up}
    body = _vector_row("origin", origin, digits=12) if any(origin) else ""
    body += "".join(_vector_row(name, vector) for name, vector in rows.items())
    distance = " × ".join(f"{d:.9g}" for d in dict.fromkeys(pinhole.distance))
    centre = ", ".join(f"{c:.9g}" for c in pinhole.principal_point)
    body += f'<tr><th scope=row>d</th><td colspan="3">{distance} px</td></tr>'
    body += f'<tr><th scope=row>centre</th><td colspan="3">{centre} of {pinhole.width} × {pinhole.height} px</td></tr>'
    return f"<table class=vector><tbody>{body}</tbody></table>"


def _view(pinhole: Pinhole) -> str:
    body = "".join(
        _vector_row(name, axis) for name, axis in zip(("u, right", "v, up", "w, back"), pinhole.basis(), strict=True)
    )
    fields = " × ".join(f"{math.degrees(angle):.4g}°" for angle in pinhole.field_of_view()[:2])
    singular = (
        "exactly along up: canonical axes"
        if pinhole.is_singular
        else f"{math.degrees(math.asin(min(pinhole.sine_to_up, 1.0))):.4g}° from up"
    )
    body += f'<tr><th scope=row>field of view</th><td colspan="3">{fields}</td></tr>'
    body += f'<tr><th scope=row>view</th><td colspan="3">{singular}</td></tr>'
    return f"<table class=vector><tbody>{body}</tbody></table>"


def _vector_row(name: str, vector: Sequence[float], digits: int = 9) -> str:
    return f"<tr><th scope=row>{name}</th>{''.join(f'<td>{value:.{digits}g}</td>' for value in vector)}</tr>"


def _ledger(ledger: Sequence[Any]) -> str:
    if not ledger:
        return ""
    exported = [entry for entry in ledger if entry.status == "exported"]
    rest = [entry for entry in ledger if entry.status != "exported"]
    head = f"<h2>The ledger</h2><p class=note>{len(exported):,} of {len(ledger):,} objects are in the comparison whole.</p>"
    table = _entries(rest) if rest else ""
    listed = (
        f"<details><summary>The {len(exported):,} that came whole</summary>{_entries(exported)}</details>" if exported else ""
    )
    return head + table + listed


def _entries(entries: Sequence[Any]) -> str:
    body = "".join(
        f"<tr><th scope=row>{escape(entry.object)}</th><td>{escape(entry.status)}</td><td>{escape(entry.reason)}</td></tr>"
        for entry in entries
    )
    return f"<div class=scroll><table class=ledger><tbody>{body}</tbody></table></div>"


def _facts(reference: Image, test: Image, facts: Mapping[str, str]) -> str:
    told = {"Reference": reference.source, "Test": test.source, **facts}
    for side, image in (("reference", reference), ("test", test)):
        told.update({f"{key} ({side})": value for key, value in sorted(image.attributes.items())})
    told["Compared with"] = f"Python {platform.python_version()}, NumPy {np.__version__}"
    return "".join(f"<tr><th scope=row>{escape(name)}</th><td>{escape(str(value))}</td></tr>" for name, value in told.items())


def _with_powers(text: str) -> str:
    """The shell's 1.6e-04 as 1.6·10⁻⁴."""
    return re.sub(r"\d\.\d+e[+-]\d+", lambda found: figure(float(found[0])), text)


def _mark(ok: bool) -> str:
    return "<span class=ok>ok</span>" if ok else "<span class=bad>failed</span>"


def _script_text(text: str) -> str:
    """A string literal for a script element: nothing in it can end the element."""
    return json.dumps(text).replace("<", "\\u003c")
