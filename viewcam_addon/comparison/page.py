"""What every HTML report is made of: one file that holds everything, to be looked at rather than read.

The page is report.html, filled by string.Template, and the part that tells the result one of report_geometry.html and
report_light.html; pictures.py makes the pixels and charts.py the drawings. Everything that comes from outside (names, reasons,
paths) is escaped. Rejected: a template engine (two pages need none), and pictures as files beside the page (a report gets
mailed).
"""

import json
import math
import os
import platform
import re
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import written_whole
from ..html_theme import MARKS, filled
from ..image import Image
from ..pinhole import Pinhole
from . import pictures
from .charts import figure
from .statistics import Row, percentile_name
from .tolerances import PERCENTILES

SWAP = "Point at the picture, tap it, or press the space bar to swap the two."


class Viewer:
    """The pictures of a report: a tab, an image or two to be swapped, and a caption for each view."""

    def __init__(self) -> None:
        self._tabs: list[str] = []
        self._images: list[str] = []
        self._captions: list[str] = []

    def add(
        self, view: str, words: str, caption: str, scale: NDArray[np.uint8] | None = None, **sides: pictures.Picture
    ) -> None:
        """Add a view.

        view : its name in the page. words : what it shows. caption : HTML below it.
        scale : what levels are painted with (pictures.png). sides : pictures, named "image", or "reference" and "test".
        """
        checked = "" if self._tabs else " checked"
        radio = f'<input type="radio" name="view" value="{view}" data-words="{words}"{checked}>'
        self._tabs.append(f"<label>{radio} {words.removesuffix(' error')}</label>")
        self._images.extend(
            f'<img class="{side}" data-view="{view}" alt="{words}, {side}" src="{pictures.png_uri(picture, scale)}">'
            for side, picture in sides.items()
        )
        self._captions.append(f'<div data-caption="{view}"{"" if self._captions else " class=shown"}>{caption}</div>')

    def parts(self) -> dict[str, str]:
        return {"tabs": "".join(self._tabs), "images": "\n".join(self._images), "captions": "".join(self._captions)}


def written(folder: str | os.PathLike[str], result: str, parts: Mapping[str, Any]) -> Path:
    """Write folder/index.html and return its path.

    result : the template of the part that tells the result. parts : what fills it and the page around it.

    Raises
    ------
    InputError
        if the folder can't be written.
    """
    path = Path(folder) / "index.html"
    if path.parent.exists() and not path.parent.is_dir():
        raise InputError(f"{path.parent} is a file: give a folder for the report")
    beside = Path(__file__)
    text = filled(beside.with_name("report.html"), {**parts, "result": filled(beside.with_name(result), parts)})
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def frame(
    comparison: Any, reference: Image, test: Image, ledger: Sequence[Any], command: str, facts: Mapping[str, str]
) -> dict[str, Any]:
    """What all reports have around their result.

    comparison : what `passed` and `sentence` are asked of. ledger : the scene's entries, with `object`, `status` and `reason`.
    command : what repeats the comparison. facts : further lines for the last table, such as versions.
    """
    headline, _, rest = comparison.sentence.partition(": ")
    names = [Path(image.source).name for image in (reference, test)]
    width, height = reference.size
    return {
        "outcome": "passed" if comparison.passed else "failed",
        "title": escape(f"{headline} · {names[1]}"),
        "names": escape(f"{names[0]} against {names[1]}"),
        "icon": MARKS[comparison.passed],
        "headline": escape(headline) + ".",
        "lede": escape(with_powers(rest[:1].upper() + rest[1:])),
        "hint": "",
        "tools": "",
        "marks": "",
        "width": width,
        "height": height,
        "ledger": _ledger(ledger),
        "facts": _facts(reference, test, facts),
        "command": f"<pre><code>{escape(command)}</code></pre>" if command else "",
        "reference_name": _script_text(f"reference · {names[0]}"),
        "test_name": _script_text(f"test · {names[1]}"),
    }


def logarithmic_legend(low: float, high: float, limits: Mapping[str, float], unit: str) -> str:
    """The colour scale from low to high, whole decades, with a tick for each limit: words → value."""
    decades = round(math.log10(high / low))
    scale = "".join(f'<span style="left:{100 * i / decades:.2f}%">{figure(low * 10.0**i)}</span>' for i in range(decades + 1))
    ticks = "".join(
        f'<span style="left:{100 * math.log10(limit / low) / decades:.2f}%">{name}</span>' for name, limit in limits.items()
    )
    strip = pictures.png_uri(np.arange(1, pictures.LEVELS + 1, dtype=np.uint8)[None])
    return (
        f'<div class="legend"><img src="{strip}" alt="Colour scale from {figure(low)} to {figure(high)} {unit}">'
        f'<div class="scale">{scale}</div><div class="limits">{ticks}</div></div>'
    )


def signed_legend(limit: float, unit: str, allowed: float | None = None) -> str:
    """The signed colour scale, with ticks at what is allowed on both sides."""
    scale = "".join(f'<span style="left:{100 * i / 4:.0f}%">{figure(limit * (i - 2) / 2)}</span>' for i in range(5))
    places = [] if allowed is None else [(1 + sign * allowed / limit) / 2 for sign in (-1, 1)]
    ticks = "".join(f'<span style="left:{100 * place:.2f}%">allowed</span>' for place in places if 0 <= place <= 1)
    strip = pictures.png_uri(np.arange(1, pictures.LEVELS + 1, dtype=np.uint8)[None], pictures.signed_scale())
    return (
        f'<div class="legend"><img src="{strip}" alt="Colour scale from {figure(-limit)} to {figure(limit)} {unit}">'
        f'<div class="scale">{scale}</div><div class="limits">{ticks}</div></div>'
    )


def tiles(told: Mapping[str, str]) -> str:
    """The large figures at the top: name → HTML."""
    return "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in told.items())


def percentiles(rows: Sequence[Row]) -> str:
    """The rows of a table that tells each pass's percentiles: its head and its lines."""
    head = "".join(f"<th scope=col>{name}</th>" for name in ("Pass", "Pixels", *map(percentile_name, PERCENTILES), "Unit", ""))
    lines = [f"<thead><tr>{head}</tr></thead><tbody>"]
    for row in rows:
        cells = "".join(share_cell(*figures) for figures in zip(row.values, row.tolerances, row.shares, strict=True))
        cells = cells or f'<td colspan="{len(PERCENTILES)}">nothing was compared</td>'
        cells = f"<td>{row.count:,}</td>{cells}<td class=unit>{row.unit}</td><td>{mark(row.ok)}</td>"
        lines.append(f"<tr><th scope=row>{row.name}</th>{cells}</tr>")
    return "".join(lines)


def share_cell(value: float, tolerance: float, share: float) -> str:
    title = f"{figure(100 * share)} % of what is allowed; {figure(tolerance)} at the median pixel"
    return bar_cell(figure(value), title, share)


def bar_cell(words: str, title: str, share: float) -> str:
    """A cell of a table with a bar below its words, full where what is allowed is used up."""
    bar = f'<span class="track"><i style="width:{min(100 * share, 100):.1f}%"></i></span>'
    return f'<td title="{title}"{"" if share <= 1 else " class=over"}>{words}{bar}</td>'


def card(title: str, words: str, kind: str) -> str:
    return f'<div class="{kind}"><h3>{title}</h3><p>{words}</p></div>'


def camera(pinhole: Pinhole, origin: Sequence[float]) -> str:
    rows = {"e, eye": pinhole.eye, "l, look-at": pinhole.look_at, "up": pinhole.up}
    body = _vector_row("origin", origin, digits=12) if any(origin) else ""
    body += "".join(_vector_row(name, vector) for name, vector in rows.items())
    distance = " × ".join(f"{d:.9g}" for d in dict.fromkeys(pinhole.distance))
    centre = ", ".join(f"{c:.9g}" for c in pinhole.principal_point)
    body += f'<tr><th scope=row>d</th><td colspan="3">{distance} px</td></tr>'
    body += f'<tr><th scope=row>centre</th><td colspan="3">{centre} of {pinhole.width} × {pinhole.height} px</td></tr>'
    return f"<table class=vector><tbody>{body}</tbody></table>"


def view(pinhole: Pinhole) -> str:
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


def with_powers(text: str) -> str:
    """The shell's 1.6e-04 as 1.6·10⁻⁴."""
    return re.sub(r"\d\.\d+e[+-]\d+", lambda found: figure(float(found[0])), text)


def mark(ok: bool) -> str:
    return "<span class=ok>ok</span>" if ok else "<span class=bad>failed</span>"


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


def _script_text(text: str) -> str:
    """A string literal for a script element: nothing in it can end the element."""
    return json.dumps(text).replace("<", "\\u003c")
