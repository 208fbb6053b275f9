"""The report of a comparison of geometry; page.py has what it shares with that of light."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..image import Image
from . import charts, difference, page, pictures
from .verdict import GeometryComparison

# Under the loupe: so many mismatches, the unexplained ones first.
_MOST_CROPS = 8
_UNIT_WORDS = {"px": "in pixels", "relative": "relative to its depth", "°": "in degrees", "absolute": "in texture coordinates"}


@np.errstate(all="ignore")
def write_report(
    comparison: GeometryComparison,
    reference: Image,
    test: Image,
    folder: str | os.PathLike[str],
    ledger: Sequence[Any] = (),
    command: str = "",
) -> Path:
    """Write folder/index.html and return its path.

    ledger : the scene's entries, with `object`, `status` and `reason`. command : what repeats the comparison.

    Raises
    ------
    InputError
        if the folder can't be written, or there is no Jinja2.
    """
    shades = difference.on_screen(comparison, reference, [test])
    far = comparison.far_from_origin
    values = {
        **page.common(comparison, reference, test, ledger, command, comparison.origin),
        "mend": page.with_powers(far.sentence) if far else "",
        "views": _views(comparison, shades, reference, test),
        "marks": charts.marks(comparison.mismatches, (comparison.pinhole.width, comparison.pinhole.height)),
        "histogram": charts.histogram(comparison.roundings),
        "crops": _crops(comparison, shades),
    }
    return page.write(folder, "report_geometry.html", values)


def _views(comparison: GeometryComparison, shades: tuple, reference: Image, test: Image) -> list[page.Tab]:
    def both(painted: Sequence[pictures.Picture]) -> dict[str, str]:
        return dict(zip(("reference", "test"), map(pictures.png_uri, painted), strict=True))

    caption = f"{page.SWAP} Shaded here from depth, normals and object indices."
    views = [page.Tab("picture", "Both pictures", caption, both(shades))]
    lit = [pictures.tone_mapped(image["Combined"][..., :3]) for image in (reference, test) if "Combined" in image.passes]
    if len(lit) == 2:
        views.append(page.Tab("combined", "Combined", page.SWAP, both(lit)))
    elif "Combined" in test.passes:
        caption = "What the renderer made of it; the tracer has no light at this level."
        views.append(page.Tab("combined", "As rendered", caption, {"image": pictures.png_uri(lit[0])}))
    for row in comparison.rows:
        if row.count:
            low, high = difference.decades(row)
            picture = pictures.png_uri(pictures.on_scale(comparison.maps[row.name], low, high))
            unit = _UNIT_WORDS[row.unit]
            caption = f"Error of each pixel {unit}, on a logarithmic scale; see-through where nothing was compared."
            limits = {"allowed in the median": row.tolerances[0], "at most": row.tolerances[-1]}
            legend = page.logarithmic_legend(low, high, limits, row.unit)
            name = row.name.lower().replace(" ", "-")
            views.append(page.Tab(name, f"{row.name} error", caption, {"image": picture}, legend))
    return views


def _crops(comparison: GeometryComparison, shades: tuple) -> list[page.Crop]:
    mismatches = comparison.mismatches
    order = np.argsort(mismatches.explained, kind="stable")
    chosen = order[np.unique(np.linspace(0, len(order) - 1, _MOST_CROPS).astype(int))] if len(order) > _MOST_CROPS else order
    size = (comparison.pinhole.width, comparison.pinhole.height)
    crops = []
    for i in chosen:
        words = charts.mismatch_text(mismatches, int(i))
        crops.append(page.crop(shades, size, mismatches.columns[i], mismatches.rows[i], words[:1].upper() + words[1:]))
    return crops
