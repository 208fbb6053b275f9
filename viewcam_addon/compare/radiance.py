"""Compares the light of two pictures of the same camera.

The reference is the tracer's, the tests usually Cycles' pictures of several seeds. Where no pixel has noise, the two must agree
within what float32 rounds (steady.py). Else nothing is asked but whether the difference is more than chance (questions.py): in
each pixel, in tiles of 8 and of 32 pixels and in the whole picture, since the sum over a tile tells a bias that no pixel shows.
All questions together raise a false alarm in one comparison of a hundred at most.

Rejected: a threshold for the mean error or for FLIP. Both shrink with the samples and grow with the scene's contrast, so that
any threshold is right for one picture; they are told, and judge nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..image import LIGHT_PASSES, Image
from ..pinhole import Pinhole
from . import light_verdict, perception, questions, steady
from .law import Array
from .perception import Appearance
from .questions import Question
from .sides import Sides, all_sides, quiet, samples_of
from .statistics import Row
from .steady import Edges

FALSE_ALARMS = 0.01
"""The probability, at most, that two sides of the same light are called different; shared out evenly over the quantities."""

VARIANCE_BATCHES = 16
"""Of so many means, or of one for each sample, the reference's Variance is estimated at least (tracer/core/film/film.h)."""


@dataclass(frozen=True)
class LightRow:
    """What was found in one quantity.

    reference, test : means over the picture and its channels. ratio : test over reference, nan where that is 0.
    ratio_error : its standard error. visible : the relative bias of the whole picture that is found half of the time.
    questions : the statistical ones, none where there is no noise. steady, edges : the exact comparison, None where there is.
    broken : pixels that are no numbers on one side or both. factor : the one that explains all of the difference, or None.
    """

    name: str
    reference: float
    test: float
    ratio_error: float
    visible: float
    broken: int
    questions: tuple[Question, ...] = ()
    steady: Row | None = None
    edges: Edges | None = None
    factor: float | None = None

    @property
    def ratio(self) -> float:
        return self.test / self.reference if self.reference else float("nan")

    @property
    def ok(self) -> bool:
        exact = self.steady is None or (self.steady.ok and self.edges.ok)
        return exact and not self.broken and all(question.ok for question in self.questions)

    def to_json(self) -> dict:
        names = ("name", "reference", "test", "ratio", "ratio_error", "visible", "broken", "factor", "ok")
        return {
            **{name: getattr(self, name) for name in names},
            "questions": [question.to_json() for question in self.questions],
            "steady": self.steady and self.steady.to_json(),
            "edges": self.edges and self.edges.to_json(),
        }


@dataclass(frozen=True, eq=False)
class RadianceComparison:
    """What differs between a reference and the mean of some test pictures, in light.

    samples : of the reference, and of all test pictures together; None where the files do not tell. seeds : test pictures.
    is_noisy : whether chance had a part in it. rows : one for each quantity, Combined first. equal : further quantities, the
    same to the last bit. appearance : relMSE and FLIP. test : the mean of the test pictures' Combined, (height, width, 3).
    maps : name to (height, width) float32, rows from the bottom: what differs in Combined and in quantities that fail.
    """

    pinhole: Pinhole
    samples: tuple[int | None, int | None]
    seeds: int
    is_noisy: bool
    rows: tuple[LightRow, ...]
    equal: tuple[str, ...]
    appearance: Appearance
    test: Array
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
        """Everything but the pictures, as plain JSON values."""
        return {
            "passed": self.passed,
            "sentence": self.sentence,
            "size": [self.pinhole.width, self.pinhole.height],
            "samples": {"reference": self.samples[0], "test": self.samples[1]},
            "seeds": self.seeds,
            "noisy": self.is_noisy,
            "false_alarms": FALSE_ALARMS,
            "quantities": [row.to_json() for row in self.rows],
            "equal": list(self.equal),
            "appearance": asdict(self.appearance),
        }


def carries_light(image: Image) -> bool:
    """Whether a reference is to be compared by its light: Combined alone comes with every picture of Cycles."""
    return "Combined" in image.passes and any(name in image.passes for name in LIGHT_PASSES if name != "Combined")


def compare(reference: Image, tests: Sequence[Image], pinhole: Pinhole, test_samples: int | None = None) -> RadianceComparison:
    """Compare one reference with one test picture or with several of different seeds.

    pinhole : the camera of the reference, which must have the passes Combined and Depth. test_samples : of each test picture,
    where that is not what its file tells (Cycles counts a first sample that it leaves out).

    Raises
    ------
    InputError
        if the sizes differ, a pass is missing, or there is no test picture.
    """
    found = list(all_sides(reference, tests))
    combined, equal = found[0], tuple(sides.name for sides in found[1:] if sides.are_equal)
    unequal = [sides for sides in found if sides.name not in equal]
    samples, seeds = (samples_of(reference), test_samples or samples_of(tests[0])), len(tests)
    is_noisy = not quiet(combined.reference, combined.variance).all()
    is_noisy |= seeds > 1 and not quiet(combined.test, combined.spread).all()
    freedom = (max(min(samples[0] or 2, VARIANCE_BATCHES) - 1, 1), max(seeds - 1, 1))
    rounding = steady.Rounding(pinhole, reference, tests[0], max(filter(None, samples), default=1))

    rows, maps = [], {}
    for sides in unequal:
        if is_noisy:
            row, drawn = _noisy(sides, rounding, freedom, FALSE_ALARMS / len(unequal))
        else:
            row, drawn = _steady(sides, rounding)
        rows.append(row)
        if sides.name == "Combined" or not row.ok:
            maps |= {f"{sides.name}: {name}": values.astype(np.float32) for name, values in drawn.items()}
    appearance, flip = perception.appearance(combined)
    if flip is not None:
        maps["FLIP"] = flip
    together = (samples[0], samples[1] and samples[1] * seeds)
    return RadianceComparison(pinhole, together, seeds, is_noisy, tuple(rows), equal, appearance, combined.test, maps)


def _steady(sides: Sides, rounding: steady.Rounding) -> tuple[LightRow, dict[str, Array]]:
    allowed = rounding.of(sides)
    row, edges, roundings = steady.compare(sides, allowed, rounding.belongs)
    factor = None if row.ok else _factor(sides, lambda scaled: steady.compare(scaled, allowed, rounding.belongs)[0].ok)
    drawn = {"difference": sides.difference.mean(axis=-1), "roundings": roundings}
    return LightRow(*_means(sides), 0.0, 0.0, int(sides.broken.sum()), steady=row, edges=edges, factor=factor), drawn


def _noisy(
    sides: Sides, rounding: steady.Rounding, freedom: tuple[int, int], level: float
) -> tuple[LightRow, dict[str, Array]]:
    given = (rounding.of(sides), freedom, level)
    asked = questions.ask(sides, *given)
    errors = sides.difference - sides.difference.mean(axis=(0, 1))
    # Channels share their samples, so that each pixel's sum over them is one error; but each channel is asked by itself.
    ratio_error = _relative(np.sqrt((errors.sum(axis=-1) ** 2).sum()), sides.reference.sum())
    by_channel = map(_relative, np.sqrt((errors**2).sum(axis=(0, 1))), sides.reference.sum(axis=(0, 1)))
    visible = asked[-1].limit * min(by_channel)
    row = LightRow(*_means(sides), ratio_error, visible, int(sides.broken.sum()), asked)
    if not row.ok:
        scaled_passes = _factor(sides, lambda scaled: all(q.ok for q in questions.ask(scaled, *given)))
        row = replace(row, factor=scaled_passes)
    pixels, tiles = asked[0], asked[1]
    spread = questions.over_pixels(questions.worst_channel(tiles.errors), sides.broken.shape, tiles.size)
    drawn = {"difference": sides.difference.mean(axis=-1), "tiles": spread}
    if pixels.errors.any():
        drawn["standard errors"] = questions.worst_channel(pixels.errors)
    return row, drawn


def _means(sides: Sides) -> tuple[str, float, float]:
    return sides.name, float(sides.reference.mean()), float(sides.test.mean())


def _relative(error: float, light: float) -> float:
    return float(error / light) if light > 0.0 else float("inf")


def _factor(sides: Sides, passes: Callable[[Sides], bool]) -> float | None:
    """What the test is times the reference, if that explains all of the difference."""
    _, reference, test = _means(sides)
    if min(reference, test) <= 0.0 or sides.broken.any():
        return None
    factor = test / reference
    return factor if passes(replace(sides, test=sides.test / factor, spread=sides.spread / factor**2)) else None
