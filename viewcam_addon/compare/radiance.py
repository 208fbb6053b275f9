"""Compares the light of two pictures of the same camera.

The reference is the tracer's, the tests usually Cycles' pictures of several seeds. Where no pixel has noise, the two must agree
within what float32 rounds (steady.py). Else nothing is asked but whether the difference is more than chance, in each pixel, in
tiles of 8 and of 32 pixels and in the whole picture: the sum of a tile's differences tells a bias that no pixel shows. All
questions together raise a false alarm in one comparison of a hundred at most: the level is shared out evenly over the
quantities and over the sizes of tiles, and within each after Šidák.

The noise that a difference is held against is the larger of what a pixel or tile shows itself and what its 3 × 3 neighbourhood
shows in the mean. By itself, a place that rare light has missed so far looks darker and quieter than it is.

Rejected: a threshold for the mean error or for FLIP. Both shrink with the samples and grow with the scene's contrast, so that any
threshold is right for one picture; they are told, and judge nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from ..image import Image
from ..pinhole import Pinhole
from . import law, light_verdict, noise, perception, steady
from .law import Array
from .sides import CHANNEL_NAMES, Sides, all_sides, quiet, samples_of
from .statistics import Row
from .steady import Edges

FALSE_ALARMS = 0.01
"""The probability, at most, that two sides of the same light are called different."""

TILES = (8, 32)
# Beyond what one picture's float32 rounds, a tile's sum may be off by so many roundings of each pixel: their mean, which is below
# the law's 99th percentile whatever they have in common.
_SHARED = law.ROUNDINGS[law.PERCENTILES.index(99.0)]


@dataclass(frozen=True)
class Place:
    """Where a difference is. columns, rows : first and last, rows from the bottom. reference, test : mean there, in the channel.

    errors : the difference in standard errors, signed.
    """

    columns: tuple[int, int]
    rows: tuple[int, int]
    channel: str
    reference: float
    test: float
    errors: float


@dataclass(frozen=True)
class Question:
    """One size of tiles, asked in one quantity: 1 for pixels, 0 for the whole picture.

    count : how many times it was asked. allowed : standard errors that the worst of them may have. failing : how many have more.
    spread_out : the share of the tiles that fail in some channel.
    """

    size: int
    count: int
    allowed: float
    failing: int
    spread_out: float
    worst: Place

    @property
    def name(self) -> str:
        return {0: "whole picture", 1: "pixels"}.get(self.size, f"tiles of {self.size} × {self.size}")

    def to_json(self) -> dict:
        return {**asdict(self), "name": self.name, "ok": not self.failing}


@dataclass(frozen=True)
class LightRow:
    """What was found in one quantity.

    reference, test : means over the picture and its channels. ratio : test over reference, nan where that is 0. ratio_error : its
    standard error. visible : the relative bias of the whole picture that would be found half of the time.
    questions : the statistical ones, none where there is no noise. steady, edges : the exact comparison, None where there is noise.
    broken : pixels that are no numbers on either side. factor : what the test is times the reference, where that explains all of
    the difference.
    """

    name: str
    reference: float
    test: float
    ratio: float
    ratio_error: float
    visible: float
    questions: tuple[Question, ...]
    steady: Row | None
    edges: Edges | None
    broken: int
    factor: float | None = None

    @property
    def ok(self) -> bool:
        exact = self.steady is None or (self.steady.ok and self.edges.ok)
        return exact and not self.broken and not any(question.failing for question in self.questions)

    def to_json(self) -> dict:
        return {
            **{
                name: getattr(self, name)
                for name in ("name", "reference", "test", "ratio", "ratio_error", "visible", "broken", "factor")
            },
            "questions": [question.to_json() for question in self.questions],
            "steady": self.steady and self.steady.to_json(),
            "edges": self.edges and self.edges.to_json(),
            "ok": self.ok,
        }


@dataclass(frozen=True, eq=False)
class RadianceComparison:
    """What differs between a reference and the mean of some test pictures, in light.

    samples : of the reference, and of all test pictures together; None where the files do not tell. seeds : test pictures.
    is_noisy : whether chance had a part in it. rows : one for each quantity. black : quantities without any light on either side.
    appearance : relMSE and FLIP. maps : name to (height, width) float32, rows from the bottom.
    """

    pinhole: Pinhole
    samples: tuple[int | None, int | None]
    seeds: int
    is_noisy: bool
    rows: tuple[LightRow, ...]
    black: tuple[str, ...]
    appearance: "perception.Appearance"
    maps: dict[str, NDArray[np.float32]]

    @property
    def passed(self) -> bool:
        """Whether nothing differs by more than chance and rounding."""
        return all(row.ok for row in self.rows)

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        return light_verdict.sentence(self)

    def lines(self) -> list[str]:
        """The result for the shell: a line for each quantity, and the verdict."""
        return light_verdict.lines(self)

    def to_json(self) -> dict:
        """Everything but the maps, as plain JSON values."""
        return {
            "passed": self.passed,
            "sentence": self.sentence,
            "size": [self.pinhole.width, self.pinhole.height],
            "samples": {"reference": self.samples[0], "test": self.samples[1]},
            "seeds": self.seeds,
            "noisy": self.is_noisy,
            "false_alarms": FALSE_ALARMS,
            "quantities": [row.to_json() for row in self.rows],
            "black": list(self.black),
            "appearance": asdict(self.appearance),
        }


def carries_light(image: Image) -> bool:
    """Whether a reference is to be compared by its light."""
    return "Combined" in image.passes


def compare(reference: Image, tests: Sequence[Image], pinhole: Pinhole) -> RadianceComparison:
    """Compare one reference with one test picture or with several of different seeds.

    pinhole : the camera of the reference, which must have the passes Combined and Depth.

    Raises
    ------
    InputError
        if the sizes differ, a pass is missing, or there is no test picture.
    """
    found = list(all_sides(reference, tests))
    lit = [sides for sides in found if not sides.is_black or sides.name == "Combined"]
    combined, seeds = found[0], len(tests)
    samples = (samples_of(reference), samples_of(tests[0]))
    is_noisy = not quiet(combined.reference, combined.variance).all() or (
        seeds > 1 and not quiet(combined.test, combined.spread).all()
    )
    shift = steady.ray_shift(pinhole, reference)
    belongs = reference["Object Index"][..., 0] if "Object Index" in reference.passes else np.zeros(shift.shape)
    brightest = _brightest(reference, found)
    rows, maps = [], {}
    for sides in lit:
        one = steady.one_rounding(
            sides, shift, belongs, brightest if sides.name != "Alpha" else 1.0, max(filter(None, samples), default=1)
        )
        if is_noisy:
            row, drawn = _noisy_row(sides, one, samples[0], seeds, FALSE_ALARMS / len(lit))
        else:
            row, drawn = _steady_row(sides, one, shift)
        rows.append(row)
        if sides.name == "Combined" or not row.ok:
            maps |= {f"{sides.name}: {name}": values.astype(np.float32) for name, values in drawn.items()}
    appearance, flip = perception.appearance(combined)
    if flip is not None:
        maps["FLIP"] = flip
    black = tuple(sides.name for sides in found if sides.is_black)
    together = (samples[0], samples[1] and samples[1] * seeds)
    return RadianceComparison(pinhole, together, seeds, is_noisy, tuple(rows), black, appearance, maps)


def _brightest(reference: Image, found: list[Sides]) -> Array | float:
    """(height, width) what the light on each pixel's surface would be if it came from straight above, as far as the picture tells:
    the largest Diffuse Direct anywhere, in the surface's colour."""
    if "Diffuse Direct" not in reference.passes or "Diffuse Color" not in reference.passes:
        return 0.0
    most = np.nan_to_num(reference["Diffuse Direct"]).max()
    return float(most) * reference["Diffuse Color"].astype(np.float64).max(axis=-1)


def _steady_row(sides: Sides, one: Array, shift: Array) -> tuple[LightRow, dict[str, Array]]:
    row, edges, roundings = steady.compare(sides, one, shift)
    mean, other = float(sides.reference.mean()), float(sides.test.mean())
    ratio = other / mean if mean else float("nan")
    factor = _factor(sides, lambda scaled: steady.compare(scaled, one, shift)[0].ok) if not row.ok else None
    drawn = {"difference": sides.difference.mean(axis=-1), "roundings": roundings}
    return LightRow(sides.name, mean, other, ratio, 0.0, 0.0, (), row, edges, int(sides.broken.sum()), factor), drawn


def _noisy_row(sides: Sides, one: Array, samples: int | None, seeds: int, level: float) -> tuple[LightRow, dict[str, Array]]:
    asked = {size: (errors, allowed) for size, errors, allowed in _answers(sides, one, samples, seeds, level)}
    questions = tuple(_question(sides, size, *answer) for size, answer in asked.items())
    mean, other = float(sides.reference.mean()), float(sides.test.mean())
    error = float(np.sqrt((sides.difference.sum(axis=-1) ** 2).sum()) / sides.reference.size)
    ratio, ratio_error = (other / mean, error / mean) if mean else (float("nan"), float("nan"))
    row = LightRow(
        sides.name, mean, other, ratio, ratio_error, asked[0][1] * ratio_error, questions, None, None, int(sides.broken.sum())
    )
    drawn = {
        "difference": sides.difference.mean(axis=-1),
        "tiles": _spread_over(asked[TILES[0]][0], sides.reference.shape[:2], TILES[0]),
    }
    if seeds > 1 and np.isfinite(asked[1][0]).any():
        drawn["standard errors"] = _worst_channel(asked[1][0])
    if not row.ok:
        passes = lambda scaled: not any((np.abs(e) > a).any() for _, e, a in _answers(scaled, one, samples, seeds, level))
        row = LightRow(**{**row.__dict__, "factor": _factor(sides, passes)})
    return row, drawn


def _answers(
    sides: Sides, one: Array, samples: int | None, seeds: int, level: float
) -> Iterator[tuple[int, Array, Array | float]]:
    """For each size of tiles: (size, signed standard errors (rows, columns, channels), how many are allowed)."""
    share = level / (len(TILES) + 2)
    difference = sides.difference
    errors, freedom = _pixel_errors(sides, law.ROUNDINGS[-1] * one[..., None], samples, seeds)
    yield 1, errors, noise.student_critical(freedom, noise.sidak(share, errors.size))
    squares, rounding = difference**2, np.repeat(_SHARED * one[..., None], difference.shape[2], axis=2)
    for size in (*TILES, 0):
        window = size or max(difference.shape)
        total, square, allowance = (noise.tile_sums(values, window) for values in (difference, squares, rounding))
        excess = np.sign(total) * np.maximum(np.abs(total) - allowance, 0.0)
        spread = np.sqrt(np.maximum(square, noise.mean_around(square)))
        errors = excess / np.maximum(spread, np.finfo(float).tiny)
        yield size, errors, noise.sign_critical(noise.sidak(share, errors.size))


def _pixel_errors(sides: Sides, rounding: Array, samples: int | None, seeds: int) -> tuple[Array, Array]:
    """Each pixel's difference beyond rounding over its standard error, and Welch's degrees of freedom of that."""
    reference, test = (np.maximum(variance, noise.mean_around(variance)) for variance in (sides.variance, sides.spread))
    excess = np.sign(sides.difference) * np.maximum(np.abs(sides.difference) - rounding, 0.0)
    variance = reference + test
    errors = excess / np.sqrt(np.maximum(variance, np.finfo(float).tiny))
    with np.errstate(invalid="ignore"):
        weight = np.nan_to_num(reference / np.maximum(variance, np.finfo(float).tiny), nan=0.5)
    freedom = 1.0 / (weight**2 / max((samples or 2) - 1, 1) + (1.0 - weight) ** 2 / max(seeds - 1, 1))
    return errors, freedom


def _question(sides: Sides, size: int, errors: Array, allowed: Array | float) -> Question:
    share = np.abs(errors) / allowed
    row, column, channel = (int(i) for i in np.unravel_index(np.argmax(share), share.shape))
    height, width = sides.reference.shape[:2]
    rows, columns = (_extent(length, size, i) for length, i in ((height, row), (width, column)))
    there = (slice(rows[0], rows[1] + 1), slice(columns[0], columns[1] + 1), channel)
    name = CHANNEL_NAMES[channel] if share.shape[2] == 3 else ""
    place = Place(
        columns,
        rows,
        name,
        float(sides.reference[there].mean()),
        float(sides.test[there].mean()),
        float(errors[row, column, channel]),
    )
    failing = share > 1.0
    limit = float(np.broadcast_to(allowed, share.shape)[row, column, channel])
    return Question(size, errors.size, limit, int(failing.sum()), float(failing.any(axis=-1).mean()), place)


def _extent(length: int, size: int, i: int) -> tuple[int, int]:
    if size == 1:
        return i, i
    starts = [*noise.tile_starts(length, size or length), length]
    return int(starts[i]), int(starts[i + 1]) - 1


def _factor(sides: Sides, passes) -> float | None:
    """The one factor that explains all of the difference, if there is one."""
    light = float(sides.reference.sum())
    factor = float(sides.test.sum()) / light if light > 0.0 else 0.0
    if factor <= 0.0:
        return None
    scaled = Sides(sides.name, sides.reference, sides.test / factor, sides.variance, sides.spread / factor**2, sides.broken)
    return factor if passes(scaled) else None


def _worst_channel(errors: Array) -> Array:
    return np.take_along_axis(errors, np.abs(errors).argmax(axis=-1)[..., None], axis=-1)[..., 0]


def _spread_over(errors: Array, shape: tuple[int, int], size: int) -> Array:
    """The worst channel of each tile, over all of its pixels."""
    lengths = (np.diff([*noise.tile_starts(length, size), length]) for length in shape)
    values = _worst_channel(errors)
    for axis, repeats in enumerate(lengths):
        values = np.repeat(values, repeats, axis=axis)
    return values
