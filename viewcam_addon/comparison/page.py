"""The common part of both HTML reports: one file that holds everything, to be looked at rather than read.

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
from . import pictures
from .statistics import percentile_name
from .tolerances import PERCENTILES

TRACER = "Tracer"
"""The name of the reference's side; that of the test's is its renderer's."""

SWAP = "Point at the picture, tap it, or press the space bar to swap the two."


@dataclass(frozen=True)
class Legend:
    """A color scale below a picture.

    strip : the scale, as a data: URI. figures : numbers along it, from end to end, each after its place, 0 to 1. limits : words
    for what is allowed, after their places. unit : of the numbers.
    """

    strip: str
    figures: tuple[tuple[float, float], ...]
    limits: tuple[tuple[float, str], ...]
    unit: str


@dataclass(frozen=True)
class Tab:
    """One of the pictures to choose from.

    name : in the page's address. words : what it shows. caption : a sentence. pictures : data: URIs by side, "image", or
    "reference" and "test", which are swapped.
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

    template : report_geometry.html or report_light.html. values : what it names, those of `common` among them.

    Raises
    ------
    InputError
        if the folder can't be written, or there is no Jinja2.
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

    comparison : whose `answer` is told, with its `pinhole`, `stated` and `renderer`. ledger : the scene's entries, with
    `object`, `status` and `reason`.
    command : what repeats the comparison. origin : the point of the world that the camera's coordinates are counted from.
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
    """pinhole : as it was read back. stated : as it was typed, None where nobody did."""
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
