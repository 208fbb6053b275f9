"""The difference as a picture, and both sides beside it, for a viewer of images such as Blender's: PNGs, and words for the
scale.

Geometry is drawn as the error of each position, light as Combined's difference, both in the scales of the report; what sees
another surface is marked. Rejected: the bare errors as an EXR, a ten-thousandth of a pixel being black on every screen.
"""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files import written_whole
from ..html_page import figure
from ..image import Image
from . import pictures
from .light_verdict import RadianceComparison
from .statistics import PassErrors
from .verdict import GeometryComparison

SIDES = ("reference", "test", "everything")

# sRGB, where nothing was compared.
_NOTHING = np.full((1, 3), 64, np.uint8)


@np.errstate(all="ignore")
def write(comparison: GeometryComparison | RadianceComparison, path: str | os.PathLike[str]) -> dict[str, Any]:
    """Write the PNG; returns its path, what its colors say, and the ends and unit of their scale, as plain JSON values.

    Raises InputError if the file can't be written.
    """
    picture, words, scale = _of_light(comparison) if isinstance(comparison, RadianceComparison) else _of_geometry(comparison)
    _write(picture, path)
    return {"image": str(path), "colors": words, "scale": scale}


def write_sides(
    comparison: GeometryComparison | RadianceComparison,
    reference: Image,
    tests: Sequence[Image],
    folder: str | os.PathLike[str],
    everything: Image | None = None,
) -> None:
    """Write both sides, and Cycles' picture with everything in it, as files in the folder that begin with SIDES.

    Geometry is shaded, as PNG. Light is as it was rendered, as arrays of NumPy: (height, width, 3) float32, scene linear, rows
    from the bottom, for a view transform that only Blender has.

    Raises InputError if a file can't be written.
    """
    light: dict[str, NDArray] = {} if everything is None else {"everything": everything["Combined"][..., :3]}
    if isinstance(comparison, RadianceComparison):
        light |= {"reference": reference["Combined"][..., :3], "test": comparison.test}
    else:
        for name, picture in zip(SIDES, on_screen(comparison, reference, tests), strict=False):
            _write(picture, Path(folder) / f"{name}.png")
    for name, values in light.items():
        with written_whole(Path(folder) / f"{name}.npy") as temporary, open(temporary, "wb") as file:
            np.save(file, pictures.reduced(values)[::-1].astype(np.float32))


@np.errstate(all="ignore")
def on_screen(
    comparison: GeometryComparison | RadianceComparison, reference: Image, tests: Sequence[Image]
) -> tuple[pictures.Picture, pictures.Picture]:
    """Reference and test as an eye can compare them: light tone-mapped alike, geometry shaded."""
    if isinstance(comparison, RadianceComparison):
        lit = reference["Combined"][..., :3]
        bright = pictures.brightness(lit)
        return pictures.tone_mapped(lit, bright), pictures.tone_mapped(comparison.test, bright)
    return pictures.shaded(reference), pictures.shaded(tests[0])


def _write(picture: pictures.Picture, path: str | os.PathLike[str]) -> None:
    with written_whole(path) as temporary:
        temporary.write_bytes(pictures.png(picture))


def decades(row: PassErrors) -> tuple[float, float]:
    """The ends of a scale for a pass's errors: from a hundredth of the median's tolerance up to the largest error."""
    high = math.ceil(math.log10(max(row.values[-1], row.tolerances[-1])))
    low = math.floor(math.log10(row.tolerances[0] / 100))
    return 10.0**low, 10.0 ** max(high, low + 2)


def largest_drawn(values: NDArray) -> float:
    """The end of a signed scale: what all but some outliers stay below."""
    return max(float(np.percentile(np.abs(values), 99.5)), 1e-12)


def _of_geometry(comparison: GeometryComparison) -> tuple[pictures.Picture, str, dict[str, Any]]:
    row, size = comparison.rows[0], (comparison.pinhole.width, comparison.pinhole.height)
    low, high = decades(row) if row.count else (1e-6, 1.0)
    levels = pictures.on_scale(comparison.maps[row.name], low, high) if row.count else None
    marks = pictures.stain(comparison.mismatches, size)
    drawn = np.zeros(marks.shape[:2], np.uint8) if levels is None else levels
    colors = _painted(drawn, pictures.color_scale())
    marks = marks[: len(colors), : len(colors[0])]
    share = marks[..., 3:] / 255.0
    blended = np.round(colors * (1 - share) + marks[..., :3] * share).astype(np.uint8)
    unit = "px" if row.unit == "px" else "of the depth"
    words = f"Dark {figure(low)} {unit} off, light {figure(high)} {unit}. Another surface seen: red, or teal where explained"
    return blended, words, {"kind": "logarithmic", "low": low, "high": high, "unit": unit}


def _of_light(comparison: RadianceComparison) -> tuple[pictures.Picture, str, dict[str, Any]]:
    values = comparison.maps["Combined: difference"]
    limit = largest_drawn(values)
    words = f"Orange where Cycles is brighter, by {figure(limit)} at the full color, blue where it is darker"
    scale = {"kind": "signed", "low": -limit, "high": limit, "unit": "of light"}
    return _painted(pictures.signed(values, limit), pictures.signed_scale()), words, scale


def _painted(levels: pictures.Picture, scale: NDArray[np.uint8]) -> pictures.Picture:
    return np.concatenate([_NOTHING, scale])[levels]
