"""Compares the geometry passes of two pictures of the same camera.

The reference is the tracer's, the test usually Cycles'. Position is judged in pixels: the test's positions are projected
through the ideal camera, and must land on the centres of their pixels. That alone would not notice an object that is moved,
so depth, normal and UV are compared with the reference's, and indices and coverage must be the same. Combined is left alone
at this level.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..image import Image
from ..pinhole import Pinhole
from . import law, verdict
from .cameras import ConversionError, Systematic, conversion_error, systematic_error
from .law import Array, Seen
from .mismatches import (
    KINDS,
    PIXELS_PER_UNEXPLAINED,
    Agreement,
    Mismatches,
    SurfaceAt,
    at,
    explain,
    kinds_of,
    largest_around,
    reach_of,
)
from .statistics import Row, measure

# The passes that are compared with their channels (the third of UV is constant), and which of them both pictures must have.
_CHANNELS = {"Depth": 1, "Position": 3, "Normal": 3, "UV": 2, "Object Index": 1, "Material Index": 1}
_NEEDED = ("Depth", "Position", "Object Index")
# Passes that only the reference has: what the law is evaluated with.
_LAW = ("Magnitude", "Facing")


@dataclass(frozen=True, eq=False)
class Comparison:
    """What differs between a reference and a test picture.

    pinhole : the camera of the reference. stated : the camera that was asked for, or None.
    hits : pixels that hit something in (reference, test).
    rows : one for each measured pass. mismatches : pixels that see another surface.
    systematic : what is the same for all pixels, None where nothing was compared.
    conversion : the camera's own error, None where nobody stated a camera.
    maps : pass name to (height, width) float32, rows from the bottom: the error of each pixel in the unit of the pass's row,
    nan
        where it was not compared.
    roundings : (n,) float64, the error of each compared position over what one rounding of float32 causes there.
    """

    pinhole: Pinhole
    stated: Pinhole | None
    hits: tuple[int, int]
    rows: tuple[Row, ...]
    mismatches: Mismatches
    systematic: Systematic | None
    conversion: ConversionError | None
    maps: dict[str, NDArray[np.float32]]
    roundings: Array

    @property
    def pixels(self) -> int:
        return self.pinhole.width * self.pinhole.height

    @property
    def allowed_unexplained(self) -> int:
        """How many mismatches may stay unexplained in a picture of this size."""
        return _allowed_unexplained(self.pinhole)

    @property
    def mismatches_ok(self) -> bool:
        not_a_number = self.mismatches.counts()["not a number"][0]
        return not_a_number == 0 and self.mismatches.unexplained_count <= self.allowed_unexplained

    @property
    def passed(self) -> bool:
        """Whether the two are the same picture. False, too, where there was nothing to compare."""
        systematic_ok = self.systematic is not None and self.systematic.ok
        conversion_ok = self.conversion is None or self.conversion.ok
        return systematic_ok and conversion_ok and self.mismatches_ok and all(row.ok for row in self.rows)

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        return verdict.sentence(self)

    def lines(self) -> list[str]:
        """The result for the shell: a line for each pass, and the verdict."""
        return verdict.lines(self)

    def to_json(self) -> dict:
        """Everything but the maps, as plain JSON values."""
        return {
            "passed": self.passed,
            "sentence": self.sentence,
            "size": [self.pinhole.width, self.pinhole.height],
            "hits": {"reference": self.hits[0], "test": self.hits[1]},
            "passes": [row.to_json() for row in self.rows],
            "mismatches": {
                **self.mismatches.to_json(),
                "allowed_unexplained": self.allowed_unexplained,
                "ok": self.mismatches_ok,
            },
            "systematic": self.systematic and self.systematic.to_json(),
            "conversion": self.conversion and self.conversion.to_json(),
        }


def compare(
    reference: Image, test: Image, pinhole: Pinhole, surface_at: SurfaceAt | None = None, stated: Pinhole | None = None
) -> Comparison:
    """Compare two pictures of one camera.

    pinhole : the camera that traced the reference. surface_at : re-traces sub-pixel positions of the reference's scene;
    without it no mismatch can be explained. stated : the camera as the four values state it; with it the conversion's error
    is measured too.

    Raises
    ------
    InputError
        if the sizes differ, or a pass is missing.
    """
    expected, seen = _passes(reference, test, pinhole)
    size = (pinhole.height, pinhole.width)
    hit = law.is_hit(expected)
    shift = np.where(hit, law.ray_shift(pinhole, expected), np.nan)
    agreement = Agreement(pinhole, _slopes(expected, hit, size))

    kinds = kinds_of(expected, seen, agreement)
    # At an edge the ray may meet either surface, so a re-traced one is judged by the steepest slope around.
    around = Agreement(pinhole, {name: largest_around(slope.reshape(size)).ravel() for name, slope in agreement.slopes.items()})
    mismatches = _mismatches(kinds, seen, reach_of(shift.reshape(size)).ravel(), around, surface_at)

    compared = hit & np.isin(kinds, (-1, KINDS.index("material index"), KINDS.index("surface")))
    # What is explained, or few enough to be let pass, is no error of the passes; what is not, shows in their figures.
    settled = mismatches.explained | (mismatches.unexplained_count <= _allowed_unexplained(pinhole))
    compared[mismatches.rows[settled] * pinhole.width + mismatches.columns[settled]] = False
    chosen = np.flatnonzero(compared)
    rows, systematic, maps, roundings = _measure(chosen, at(expected, chosen), at(seen, chosen), agreement.at(chosen))

    depths = expected["Depth"][hit, 0]
    conversion = None
    if stated is not None and len(depths):
        conversion = conversion_error(stated, pinhole, np.percentile(depths, (0, 50, 100)))
    hits = (int(hit.sum()), int(law.is_hit(seen).sum()))
    return Comparison(pinhole, stated, hits, rows, mismatches, systematic, conversion, maps, roundings)


def _allowed_unexplained(pinhole: Pinhole) -> int:
    return pinhole.width * pinhole.height // PIXELS_PER_UNEXPLAINED


def _passes(reference: Image, test: Image, pinhole: Pinhole) -> tuple[Seen, Seen]:
    """The passes that both sides are compared in, each as (pixels, channels)."""
    for image in (reference, test):
        if image.size != (pinhole.width, pinhole.height):
            raise InputError(
                f"{image.source} has {image.size[0]} × {image.size[1]} pixels and the camera "
                f"{pinhole.width} × {pinhole.height}: compare pictures of the same size"
            )
    names = [name for name in _CHANNELS if name in reference.passes or name in _NEEDED]
    expected = {name: reference[name] for name in names} | {name: reference[name] for name in _LAW if name in reference.passes}
    seen = {name: test[name] for name in names}
    return _flattened(expected), _flattened(seen)


def _flattened(passes: Seen) -> Seen:
    return {name: values.reshape(-1, values.shape[2])[:, : _CHANNELS.get(name)] for name, values in passes.items()}


def _slopes(expected: Seen, hit: NDArray, size: tuple[int, int]) -> dict[str, Array]:
    belongs = np.where(hit, expected["Object Index"][:, 0], -1).reshape(size)
    names = [name for name in ("Normal", "UV") if name in expected]
    return {name: law.slopes(expected[name].reshape(*size, -1), belongs).ravel() for name in names}


def _mismatches(kinds: NDArray, seen: Seen, reach: Array, agreement: Agreement, surface_at: SurfaceAt | None) -> Mismatches:
    found = np.flatnonzero(kinds >= 0)
    columns, rows = found % agreement.pinhole.width, found // agreement.pinhole.width
    shifts, retraced = np.full(len(found), np.nan), 0
    if surface_at is not None:
        numbers = kinds[found] != KINDS.index("not a number")
        traced = found[numbers]
        shifts[numbers], retraced = explain(
            columns[numbers], rows[numbers], at(seen, traced), reach[traced], agreement.at(traced), surface_at
        )
    return Mismatches(columns, rows, kinds[found], shifts, reach[found], retraced)


def _measure(
    chosen: NDArray, expected: Seen, seen: Seen, agreement: Agreement
) -> tuple[tuple[Row, ...], Systematic | None, dict[str, NDArray[np.float32]], Array]:
    """The rows, the systematic part, the maps and the positions' roundings, over the chosen pixels."""
    pinhole = agreement.pinhole
    columns, rows = chosen % pinhole.width + 0.5, chosen // pinhole.width + 0.5
    column, row, along = pinhole.project(seen["Position"])
    # A position behind the eye has no picture: it counts as far off as the picture is large.
    diagonal = float(np.hypot(pinhole.width, pinhole.height))
    off_x, off_y = (np.nan_to_num(off, nan=diagonal) for off in (column - columns, row - rows))
    shift = law.position_shift(pinhole, expected)
    depth = expected["Depth"][:, 0].astype(np.float64)
    across = np.hypot(off_x, off_y)

    measured = {"Position": ("px", across, shift, 0.0)}
    measured["Position depth"] = ("relative", np.abs(along - depth) / depth, law.depth_error(pinhole, expected), law.FLOAT32)
    errors = agreement.errors(expected, seen)
    measured["Depth"] = ("relative", *errors["Depth"])
    if "Normal" in errors:
        measured["Normal"] = ("°", *(np.degrees(figure) for figure in errors["Normal"]))
    if "UV" in errors:
        measured["UV"] = ("absolute", *errors["UV"])

    maps = {}
    for name, (_, error, *_) in measured.items():
        flat = np.full(pinhole.width * pinhole.height, np.nan, dtype=np.float32)
        flat[chosen] = error
        maps[name] = flat.reshape(pinhole.height, pinhole.width)
    rows_measured = tuple(measure(name, *figures) for name, figures in measured.items())
    systematic = systematic_error(pinhole, columns, rows, off_x, off_y, shift) if len(chosen) else None
    return rows_measured, systematic, maps, across / shift
