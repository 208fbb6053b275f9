"""The report of a comparison of light; page.py has what it shares with that of geometry."""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..image import Image
from . import charts, difference, page, pictures
from .hypothesis_tests import CONTOURS, WHOLE, HypothesisTest
from .light_verdict import change_text, edge_text, place_text, samples_text
from .radiance import LightRow, RadianceComparison
from .statistics import plain
from .tolerances import ROUNDINGS

# Under the loupe: one place for each test that failed, the first of them.
_MOST_CROPS = 8
_COLORS = "blue where Cycles is darker, orange where it is brighter"


@np.errstate(all="ignore")
def write_report(
    comparison: RadianceComparison,
    reference: Image,
    tests: Sequence[Image],
    folder: str | os.PathLike[str],
    ledger: Sequence[Any] = (),
    command: str = "",
) -> Path:
    """Write folder/index.html and return its path.

    tests : the pictures that were compared, in any number. ledger, command : as for page.common.

    Raises
    ------
    InputError
        if the folder can't be written, or there is no Jinja2.
    """
    on_screen = difference.on_screen(comparison, reference, tests)
    mean_of = f" Cycles' is the mean of {len(tests)} pictures with other seeds." if len(tests) > 1 else ""
    sides = dict(zip(("reference", "test"), map(pictures.png_uri, on_screen), strict=True))
    combined = page.Tab("picture", "Combined", f"{page.SWAP} Both under one exposure.{mean_of}", sides)
    asked = comparison.rows[0].hypothesis_tests
    if comparison.is_noisy:
        chart = charts.bell(asked[1].errors.ravel(), asked[1].limit)
    else:
        chart = charts.histogram(comparison.maps["Combined: roundings"].ravel())
    values = {
        **page.common(comparison, reference, tests[0], ledger, command),
        "views": [combined, *(_view(comparison, name, values) for name, values in comparison.maps.items())],
        "worst": max(asked, key=lambda test: abs(test.worst.errors) / test.limit, default=None),
        "makers": (_maker(reference), _maker(tests[0])),
        "edge_text": edge_text,
        "place_text": place_text,
        "plain": plain,
        "samples_text": samples_text,
        "chart": chart,
        "crops": _crops(comparison, on_screen),
    }
    return page.write(folder, "report_light.html", values)


def _view(comparison: RadianceComparison, name: str, values: np.ndarray) -> page.Tab:
    """One map, in the scale that suits its kind."""
    quantity, _, kind = name.partition(": ")
    words = kind if quantity == "Combined" else name.replace(": ", " · ")
    words, view = words[:1].upper() + words[1:], name.lower().replace(": ", "-").replace(" ", "-")
    row = next((row for row in comparison.rows if row.name == quantity), None)
    if name == "FLIP":
        caption = "What an eye notices when the two are swapped on a screen, from 0 to 1, on a logarithmic scale."
        picture, legend = pictures.on_scale(values, 0.01, 1.0), page.logarithmic_legend(0.01, 1.0, {}, "FLIP")
        return page.Tab(view, words, caption, {"image": pictures.png_uri(picture)}, legend)
    if kind == "roundings":
        high = 10.0 ** max(2, math.ceil(math.log10(max(float(values.max()), 1e-9))))
        caption = "Error of each pixel in roundings of float32, on a logarithmic scale."
        limits = {"allowed in the median": ROUNDINGS[0], "at most": ROUNDINGS[-1]}
        picture, legend = pictures.on_scale(values, 1e-2, high), page.logarithmic_legend(1e-2, high, limits, "roundings")
        return page.Tab(view, words, caption, {"image": pictures.png_uri(picture)}, legend)
    if kind == "difference":
        caption = f"Cycles minus Tracer: {_COLORS}."
        limit, unit, allowed = difference.largest_drawn(values), "radiance", None
    else:
        test = row.hypothesis_tests[1 if kind == "tiles" else 0]
        what = {"tiles": f"The difference of each of the {test.name}"}.get(kind, "The difference of each pixel")
        caption = f"{what} in standard errors of its own noise: {_COLORS}."
        limit, unit, allowed = max(6.0, 1.25 * test.limit), "standard errors", test.limit
    picture = pictures.png_uri(pictures.signed(values, limit), pictures.signed_scale())
    return page.Tab(view, words, caption, {"image": picture}, page.signed_legend(limit, unit, allowed))


def _maker(image: Image) -> str:
    software = next((image.attributes[name] for name in ("software", "Software") if name in image.attributes), "")
    return software or Path(image.source).name


def _crops(comparison: RadianceComparison, on_screen: tuple) -> list[page.Crop]:
    asked = [(row, test) for row in comparison.rows for test in row.hypothesis_tests]
    failed = [(row, test) for row, test in asked if not test.ok and test.size not in (CONTOURS, WHOLE)]
    return [_crop(comparison, on_screen, row, test) for row, test in failed[:_MOST_CROPS]]


def _crop(comparison: RadianceComparison, on_screen: tuple, row: LightRow, test: HypothesisTest) -> page.Crop:
    place, size = test.worst, (comparison.pinhole.width, comparison.pinhole.height)
    column, line = (sum(ends) // 2 for ends in (place.columns, place.rows))
    words = (
        f"{row.name}{f' ({place.channel})' if place.channel else ''} {place_text(place, test.size)}: "
        f"{change_text(place.reference, place.test)}, {abs(place.errors):.1f} standard errors of {test.limit:.1f} allowed"
    )
    return page.crop(on_screen, size, column, line, words, max(15, 2 * test.size + 1))
