"""The report of a comparison: one HTML file that holds everything, to be looked at rather than read.

The page is report.html, which report_geometry.html and report_light.html extend with what tells their results; pictures.py
makes the pixels and charts.py the drawings. Rejected: pictures as files beside the page (a report gets mailed).
"""

import math
import os
import platform
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import html_page
from ..errors import InputError
from ..files import written_whole
from ..html_page import figure
from ..image import Image
from ..pinhole import Pinhole
from . import charts, difference, pictures
from .hypothesis_tests import CONTOURS, WHOLE, HypothesisTest
from .light_verdict import LightRow, RadianceComparison, change_text, edge_text, place_text, samples_text
from .statistics import percentile_name, plain
from .tolerances import PERCENTILES, ROUNDINGS
from .verdict import GeometryComparison

_MOST_CROPS = 8  # under the loupe: mismatches, the unexplained ones first, or a place for each test that failed
TRACER = "Tracer"
"""The name of the reference's side; that of the test's is its renderer's."""

SWAP = "Point at the picture, tap it, or press the space bar to swap the two."


@dataclass(frozen=True)
class Legend:
    """A color scale below a picture.

    strip : the scale, as a data: URI.
    figures : numbers along it, from end to end, each after its place, 0 to 1.
    limits : words for what is allowed, after their places.
    unit : the unit of the numbers.
    """

    strip: str
    figures: tuple[tuple[float, float], ...]
    limits: tuple[tuple[float, str], ...]
    unit: str


@dataclass(frozen=True)
class Tab:
    """A picture of the page to choose, by a tab.

    name : its name in the page's address.
    words : the button's text, which says what it shows.
    caption : a sentence.
    pictures : data: URIs by side, "image", or "reference" and "test", which are swapped.
    """

    name: str
    words: str
    caption: str
    pictures: Mapping[str, str]
    legend: Legend | None = None


@dataclass(frozen=True)
class Crop:
    """A place under the loupe: data: URIs of both sides, and what is to be seen there."""

    reference: str
    test: str
    words: str


def write(folder: str | os.PathLike[str], template: str, values: Mapping[str, Any]) -> Path:
    """Write folder/index.html and return its path.

    template : report_geometry.html or report_light.html.
    values : values for the names in it, those of `common` among them.

    Raises InputError if the folder can't be written, or there is no Jinja2.
    """
    path = Path(folder) / "index.html"
    if path.parent.exists() and not path.parent.is_dir():
        raise InputError(f"{path.parent} is a file: give a folder for the report")
    text = html_page.filled(f"comparison/{template}", **values)
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return path


def common(
    comparison: Any,
    reference: Image,
    test: Image,
    ledger: Sequence[Any],
    command: str,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
) -> dict[str, Any]:
    """The values that both reports give report.html; the views, the crops and their own parts are added to it.

    comparison : the comparison whose `answer` is told, with its `pinhole`, `stated` and `renderer`.
    ledger : the scene's entries, with `object`, `status` and `reason`.
    command : the command that repeats the comparison.
    origin : the point of the world that the camera's coordinates are counted from.
    """
    answer = comparison.answer
    names = [Path(image.source).name for image in (reference, test)]
    width, height = reference.size
    return {
        "comparison": comparison,
        "answer": answer.answer,
        "title": f"{answer.headline} · {_subject(test)}",
        "about": _subject(test),
        "headline": f"{answer.headline}.",
        "intro": with_powers(answer.text[:1].upper() + answer.text[1:]),
        "sides": {"reference": TRACER, "test": comparison.renderer},
        "plates": {"reference": f"{TRACER} · {names[0]}", "test": f"{comparison.renderer} · {names[1]}"},
        "width": width,
        "height": height,
        "percentile_names": [percentile_name(percentile) for percentile in PERCENTILES],
        "ledger": ledger,
        "facts": _facts(reference, test, comparison.renderer),
        "command": command,
        **_camera(comparison.pinhole, comparison.stated, origin),
    }


def _subject(test: Image) -> str:
    """The subject of the picture, by file, camera and frame as Blender stamps them in its pictures, else the picture's own
    name."""
    stamp = test.attributes
    if "File" not in stamp:
        return Path(test.source).name
    parts = [PureWindowsPath(stamp["File"]).name]
    parts += [f"camera {stamp['Camera']}"] if "Camera" in stamp else []
    parts += [f"frame {stamp['Frame'].lstrip('0') or '0'}"] if "Frame" in stamp else []
    return " · ".join(parts)


def logarithmic_legend(low: float, high: float, limits: Mapping[str, float], unit: str) -> Legend:
    """The color scale from low to high, whole decades, with a tick for each limit: words → value."""
    decades = round(math.log10(high / low))
    figures = tuple((i / decades, low * 10.0**i) for i in range(decades + 1))
    ticks = tuple((math.log10(limit / low) / decades, name) for name, limit in limits.items())
    return Legend(_strip(), figures, ticks, unit)


def signed_legend(limit: float, unit: str, allowed: float | None = None) -> Legend:
    """The signed color scale, with ticks at what is allowed on both sides."""
    figures = tuple((i / 4, limit * (i - 2) / 2) for i in range(5))
    places = [] if allowed is None else [(1 + sign * allowed / limit) / 2 for sign in (-1, 1)]
    ticks = tuple((place, "allowed") for place in places if 0 <= place <= 1)
    return Legend(_strip(pictures.signed_scale()), figures, ticks, unit)


def crop(
    shades: Sequence[pictures.Picture], size: tuple[int, int], column: int, row: int, words: str, around: int = 15
) -> Crop:
    """The surroundings of a pixel in both sides' pictures; size, column and row as for pictures.crop."""
    reference, test = (pictures.png_uri(pictures.crop(shade, size, column, row, around)) for shade in shades)
    return Crop(reference, test, words)


def with_powers(text: str) -> str:
    """The shell's 1.6e-04 as 1.6·10⁻⁴."""
    return re.sub(r"\d\.\d+e[+-]\d+", lambda match: figure(float(match[0])), text)


def _strip(scale: NDArray[np.uint8] | None = None) -> str:
    return pictures.png_uri(np.arange(1, pictures.LEVELS + 1, dtype=np.uint8)[None], scale)


def _camera(pinhole: Pinhole, stated: Pinhole | None, origin: Sequence[float]) -> dict[str, Any]:
    """The rows of the page's table of the camera.

    pinhole : the camera as it was read back.
    stated : the camera as it was typed, None where nobody did.
    """
    angle = f"{math.degrees(math.asin(min(pinhole.sine_to_up, 1.0))):.4g}° from up"
    return {
        "pinhole": pinhole,
        "origin": origin if any(origin) else None,
        "cameras": [
            *([("as typed", stated, _as_typed)] if stated else []),
            ("as read back from Blender" if stated else "", pinhole, "{:.9g}".format),
        ],
        "center": ", ".join(f"{c:.9g}" for c in pinhole.principal_point),
        "field_of_view": " × ".join(f"{math.degrees(angle):.4g}°" for angle in pinhole.field_of_view()[:2]),
        "angle_to_up": "exactly along up: canonical axes" if pinhole.is_singular else angle,
    }


def _as_typed(value: float) -> str:
    """The fewest digits that tell a number; of one that went through float32, those that tell it among float32s."""
    return f"{np.float32(value) if float(np.float32(value)) == value else value!s}"


def _facts(reference: Image, test: Image, renderer: str) -> dict[str, str]:
    facts = {TRACER: reference.source, renderer: test.source}
    for side, image in ((TRACER, reference), (renderer, test)):
        facts |= {f"{key} ({side})": value for key, value in sorted(image.attributes.items())}
    return facts | {"Compared with": f"Python {platform.python_version()}, NumPy {np.__version__}"}


_UNIT_WORDS = {"px": "in pixels", "relative": "relative to its depth", "°": "in degrees", "absolute": "in texture coordinates"}


@np.errstate(all="ignore")
def write_geometry(
    comparison: GeometryComparison,
    reference: Image,
    test: Image,
    folder: str | os.PathLike[str],
    ledger: Sequence[Any] = (),
    command: str = "",
) -> Path:
    """Write folder/index.html and return its path.

    ledger : the scene's entries, with `object`, `status` and `reason`.
    command : the command that repeats the comparison.

    Raises InputError if the folder can't be written, or there is no Jinja2.
    """
    shades = difference.on_screen(comparison, reference, [test])
    far = comparison.far_from_origin
    values = {
        **common(comparison, reference, test, ledger, command, comparison.origin),
        "mend": with_powers(far.sentence) if far else "",
        "views": _views(comparison, shades, reference, test),
        "marks": charts.marks(comparison.mismatches, (comparison.pinhole.width, comparison.pinhole.height)),
        "histogram": charts.histogram(comparison.roundings),
        "crops": _crops(comparison, shades),
    }
    return write(folder, "report_geometry.html", values)


def _views(comparison: GeometryComparison, shades: tuple, reference: Image, test: Image) -> list[Tab]:
    def both(painted: Sequence[pictures.Picture]) -> dict[str, str]:
        return dict(zip(("reference", "test"), map(pictures.png_uri, painted), strict=True))

    caption = f"{SWAP} Shaded here from depth, normals and object indices."
    views = [Tab("picture", "Both pictures", caption, both(shades))]
    lit = [pictures.tone_mapped(image["Combined"][..., :3]) for image in (reference, test) if "Combined" in image.passes]
    if len(lit) == 2:
        views.append(Tab("combined", "Combined", SWAP, both(lit)))
    elif "Combined" in test.passes:
        caption = "What the renderer made of it; the tracer has no light at this level."
        views.append(Tab("combined", "As rendered", caption, {"image": pictures.png_uri(lit[0])}))
    for row in comparison.rows:
        if row.count:
            low, high = difference.decades(row)
            picture = pictures.png_uri(pictures.on_scale(comparison.maps[row.name], low, high))
            unit = _UNIT_WORDS[row.unit]
            caption = f"Error of each pixel {unit}, on a logarithmic scale; see-through where nothing was compared."
            limits = {"allowed in the median": row.tolerances[0], "at most": row.tolerances[-1]}
            legend = logarithmic_legend(low, high, limits, row.unit)
            name = row.name.lower().replace(" ", "-")
            views.append(Tab(name, f"{row.name} error", caption, {"image": picture}, legend))
    return views


def _crops(comparison: GeometryComparison, shades: tuple) -> list[Crop]:
    mismatches = comparison.mismatches
    order = np.argsort(mismatches.explained, kind="stable")
    chosen = order[np.unique(np.linspace(0, len(order) - 1, _MOST_CROPS).astype(int))] if len(order) > _MOST_CROPS else order
    size = (comparison.pinhole.width, comparison.pinhole.height)
    crops = []
    for i in chosen:
        words = charts.mismatch_text(mismatches, int(i))
        crops.append(crop(shades, size, mismatches.columns[i], mismatches.rows[i], words[:1].upper() + words[1:]))
    return crops


_COLORS = "blue where Cycles is darker, orange where it is brighter"


@np.errstate(all="ignore")
def write_light(
    comparison: RadianceComparison,
    reference: Image,
    tests: Sequence[Image],
    folder: str | os.PathLike[str],
    ledger: Sequence[Any] = (),
    command: str = "",
) -> Path:
    """Write folder/index.html and return its path.

    tests : the pictures that were compared, in any number.
    ledger, command : see common.

    Raises InputError if the folder can't be written, or there is no Jinja2.
    """
    on_screen = difference.on_screen(comparison, reference, tests)
    mean_of = f" Cycles' is the mean of {len(tests)} pictures with other seeds." if len(tests) > 1 else ""
    sides = dict(zip(("reference", "test"), map(pictures.png_uri, on_screen), strict=True))
    combined = Tab("picture", "Combined", f"{SWAP} Both under one exposure.{mean_of}", sides)
    asked = comparison.rows[0].hypothesis_tests
    if comparison.is_noisy:
        chart = charts.bell(asked[1].errors.ravel(), asked[1].limit)
    else:
        chart = charts.histogram(comparison.maps["Combined: roundings"].ravel())
    values = {
        **common(comparison, reference, tests[0], ledger, command),
        "views": [combined, *(_view(comparison, name, values) for name, values in comparison.maps.items())],
        "worst": max(asked, key=lambda test: abs(test.worst.errors) / test.limit, default=None),
        "makers": (_maker(reference), _maker(tests[0])),
        "edge_text": edge_text,
        "place_text": place_text,
        "plain": plain,
        "samples_text": samples_text,
        "chart": chart,
        "crops": _light_crops(comparison, on_screen),
    }
    return write(folder, "report_light.html", values)


def _view(comparison: RadianceComparison, name: str, values: np.ndarray) -> Tab:
    """The view of a map, in the scale that suits its kind."""
    quantity, _, kind = name.partition(": ")
    words = kind if quantity == "Combined" else name.replace(": ", " · ")
    words, view = words[:1].upper() + words[1:], name.lower().replace(": ", "-").replace(" ", "-")
    if name == "FLIP":
        caption = "What an eye notices when the two are swapped on a screen, from 0 to 1, on a logarithmic scale."
        picture, legend = pictures.on_scale(values, 0.01, 1.0), logarithmic_legend(0.01, 1.0, {}, "FLIP")
        return Tab(view, words, caption, {"image": pictures.png_uri(picture)}, legend)
    if kind == "roundings":
        high = 10.0 ** max(2, math.ceil(math.log10(max(float(values.max()), 1e-9))))
        caption = "Error of each pixel in roundings of float32, on a logarithmic scale."
        limits = {"allowed in the median": ROUNDINGS[0], "at most": ROUNDINGS[-1]}
        picture, legend = pictures.on_scale(values, 1e-2, high), logarithmic_legend(1e-2, high, limits, "roundings")
        return Tab(view, words, caption, {"image": pictures.png_uri(picture)}, legend)
    if kind == "difference":
        caption = f"Cycles minus Tracer: {_COLORS}."
        limit, unit, allowed = difference.largest_drawn(values), "radiance", None
    else:
        row = next(row for row in comparison.rows if row.name == quantity)
        test = row.hypothesis_tests[1 if kind == "tiles" else 0]
        what = {"tiles": f"The difference of each of the {test.name}"}.get(kind, "The difference of each pixel")
        caption = f"{what} in standard errors of its own noise: {_COLORS}."
        limit, unit, allowed = max(6.0, 1.25 * test.limit), "standard errors", test.limit
    uri = pictures.png_uri(pictures.signed(values, limit), pictures.signed_scale())
    return Tab(view, words, caption, {"image": uri}, signed_legend(limit, unit, allowed))


def _maker(image: Image) -> str:
    software = next((image.attributes[name] for name in ("software", "Software") if name in image.attributes), "")
    return software or Path(image.source).name


def _light_crops(comparison: RadianceComparison, on_screen: tuple) -> list[Crop]:
    tested = [(row, test) for row in comparison.rows for test in row.hypothesis_tests]
    failed = [(row, test) for row, test in tested if not test.ok and test.size not in (CONTOURS, WHOLE)]
    return [_crop(comparison, on_screen, row, test) for row, test in failed[:_MOST_CROPS]]


def _crop(comparison: RadianceComparison, on_screen: tuple, row: LightRow, test: HypothesisTest) -> Crop:
    place, size = test.worst, (comparison.pinhole.width, comparison.pinhole.height)
    column, line = (sum(ends) // 2 for ends in (place.columns, place.rows))
    words = (
        f"{row.name}{f' ({place.channel})' if place.channel else ''} {place_text(place, test.size)}: "
        f"{change_text(place.reference, place.test)}, {abs(place.errors):.1f} standard errors of {test.limit:.1f} allowed"
    )
    return crop(on_screen, size, column, line, words, max(15, 2 * test.size + 1))
