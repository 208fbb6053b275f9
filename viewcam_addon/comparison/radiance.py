"""Compares the light of two pictures of the same camera.

The reference is the tracer's, the tests usually Cycles' pictures of several seeds. Where no pixel has noise, the two must agree
within what float32 rounds (noise_free.py). Else all that is tested is whether the difference is more than chance, in each
pixel, in tiles of 8 and of 32 pixels and in the whole picture, since the sum over a tile tells a bias that no pixel shows. All
tests together raise a false alarm in one comparison of a hundred at most.

A reference that has missed rare light, such as a lamp that grazes a metal, looks darker and quieter than it is, in many pixels
side by side. So where a difference is less than four times what chance allows, the reference is traced anew with SEEDS other
seeds, and what these say counts alone. Their spread tells such noise, and the difference has to be there a second time.

Rejected: a threshold for the mean error or for FLIP. Both shrink with the samples and grow with the scene's contrast, so that
any threshold is right for one picture; they are told, and decide nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..image import LIGHT_PASSES, Image
from ..pinhole import Pinhole
from . import hypothesis_tests, noise_free, perception
from .coincident import MakeCoincidentLight, Rest, TakenOut
from .light_verdict import FALSE_ALARMS, LightRow, RadianceComparison
from .sides import Sides, all_sides, quiet, samples_of
from .statistics import looks_turned
from .tolerances import FLOAT32, Array, in_float32

SEEDS = 8
"""The number of seeds with which a reference is traced anew, each with as many samples as it has."""

# Times what chance allows, from which on a difference is beyond doubt. Chosen: a file with rare light came to 2.2 times, and to
# trace a picture anew that plainly differs takes nine times as long and tells nothing.
_BEYOND_DOUBT = 4.0
# The share of its difference that a picture that is turned over has once it is turned back, at most: both have the noise.
_TURNED = 0.5

VARIANCE_BATCHES = 16
"""The number of means, or of one for each sample, the reference's Variance is estimated at least (tracer/core/film/film.h)."""


def carries_light(image: Image) -> bool:
    """True if a reference is to be compared by its light: Combined alone comes with every picture of Cycles."""
    return "Combined" in image.passes and any(name in image.passes for name in LIGHT_PASSES if name != "Combined")


@np.errstate(all="ignore")
def compare(
    reference: Image,
    tests: Sequence[Image],
    pinhole: Pinhole,
    test_samples: int | None = None,
    make_coincident: MakeCoincidentLight | None = None,
    trace_anew: Callable[[], Sequence[Image]] | None = None,
    false_alarms: float = FALSE_ALARMS,
) -> RadianceComparison:
    """Compare one reference with one test picture or with several of different seeds.

    pinhole : the camera of the reference, which must have the passes Combined and Depth.
    test_samples : the samples of each test picture, where its file does not tell them (Cycles counts a first sample that it
        leaves out).
    make_coincident : traces the light that is a renderer's choice, which is taken out; asked where the pictures differ.
    trace_anew : traces the reference with SEEDS other seeds; asked where they still differ, and not beyond doubt.
    false_alarms : the probability, at most, that two sides of the same light are called different.

    Whatever float32 can hold may stand in the pictures: what is no number is told as broken.

    Raises InputError if the sizes differ, a pass is missing, or there is no test picture.
    """
    compared = compare_quantities(reference, tests, pinhole, test_samples, false_alarms=false_alarms)
    combined, rest, taken_out = compared.combined, None, TakenOut()
    if make_coincident is not None and not all(row.ok for row in compared.rows) and (coincident := make_coincident()):
        rest = coincident.rest(combined)
        compared = compare_quantities(reference, tests, pinhole, test_samples, rest, false_alarms=false_alarms)
        brightest = np.maximum(combined.reference, combined.test).max(axis=-1)
        lit = brightest > FLOAT32 * brightest.mean()  # less is the cosine to a lamp in the surface's own plane, rounded
        share = float(rest.out[lit].mean()) if lit.any() else 0.0
        taken_out = TakenOut(rest.out, coincident.pairs, coincident.seen_otherwise, share)
    if trace_anew is not None and _is_doubtful(compared):
        compared = compare_quantities(reference, tests, pinhole, test_samples, rest, trace_anew(), false_alarms)
    maps = dict(compared.maps)
    appearance, flip = perception.appearance(combined)
    if flip is not None:
        maps["FLIP"] = flip
    samples, seeds = compared.samples, len(tests)
    together = (samples[0], samples[1] and samples[1] * seeds)
    return RadianceComparison(
        pinhole,
        together,
        seeds,
        compared.is_noisy,
        compared.rows,
        compared.equal,
        appearance,
        combined.test,
        maps,
        taken_out=taken_out,
        turned=looks_turned(combined.reference, combined.test, _unlike, _TURNED),
        lossy=next((picture.lossy for picture in tests if picture.lossy), ""),
    )


def _unlike(reference: Array, test: Array) -> Array:
    """The difference of light, from 0 to 1."""
    return np.nan_to_num(np.abs(test - reference) / (np.abs(test) + np.abs(reference)))


@dataclass(frozen=True, eq=False)
class QuantityComparison:
    """The arrays that the verdict stands on.

    combined : both sides of Combined.
    samples : the samples of the reference, and of each test picture.
    rows, equal, maps : see RadianceComparison; but there is no map of what an eye sees.
    """

    combined: Sides
    samples: tuple[int | None, int | None]
    is_noisy: bool
    rows: tuple[LightRow, ...]
    equal: tuple[str, ...]
    maps: dict[str, NDArray[np.float32]]


@np.errstate(all="ignore")
def compare_quantities(
    reference: Image,
    tests: Sequence[Image],
    pinhole: Pinhole,
    test_samples: int | None = None,
    rest: Rest | None = None,
    other_seeds: Sequence[Image] = (),
    false_alarms: float = FALSE_ALARMS,
) -> QuantityComparison:
    """`compare` without what decides nothing.

    rest : the rest that is compared where light is a renderer's choice.
    other_seeds : the reference with several other seeds.
    """
    quantities = list(all_sides(reference, tests, other_seeds))
    if rest is not None:
        quantities = [rest.of(sides) for sides in quantities]
    combined, equal = quantities[0], tuple(sides.name for sides in quantities[1:] if sides.are_equal)
    unequal = [sides for sides in quantities if sides.name not in equal]
    samples, seeds = (samples_of(reference), test_samples or samples_of(tests[0])), len(tests)
    is_noisy = not quiet(combined.reference, combined.variance).all()
    # Where things shine as brightly as what is behind them, only the other passes have any.
    is_noisy |= seeds > 1 and any(not quiet(sides.test, sides.test_variance).all() for sides in (combined, *unequal))
    freedom = (len(other_seeds) - 1 if other_seeds else max(min(samples[0] or 2, VARIANCE_BATCHES) - 1, 1), max(seeds - 1, 1))
    if other_seeds and samples[0]:
        samples = samples[0] * len(other_seeds), samples[1]
    rounding = noise_free.Rounding(pinhole, reference, tests[0], max(filter(None, samples), default=1), rest)

    rows: list[LightRow] = []
    maps: dict[str, NDArray] = {}
    for sides in unequal:
        if is_noisy:
            row, drawn = _noisy(sides, rounding, freedom, false_alarms / len(unequal))
            if rest is not None:
                hidden, left = (
                    float(rest.tolerance(sides).mean()),
                    float(sides.reference[~rest.out].sum() / sides.reference.size),
                )
                row = replace(row, visible=_relative(row.visible * row.reference + hidden, left))
        else:
            row, drawn = _noise_free(sides, rounding)
        rows.append(row)
        if sides.name == "Combined" or not row.ok:
            maps |= {f"{sides.name}: {name}": in_float32(values) for name, values in drawn.items()}
    return QuantityComparison(combined, samples, is_noisy, tuple(rows), equal, maps)


def _is_doubtful(compared: QuantityComparison) -> bool:
    """True if something differs, and nothing beyond doubt."""
    tests = [test for row in compared.rows for test in row.hypothesis_tests]
    most = max((float((np.abs(test.errors) / test.allowed).max()) for test in tests), default=0.0)
    return 1.0 < most < _BEYOND_DOUBT and not any(row.broken for row in compared.rows)


def _noise_free(sides: Sides, rounding: noise_free.Rounding) -> tuple[LightRow, dict[str, Array]]:
    allowed = rounding.of(sides)
    row, edges, roundings = noise_free.compare(sides, allowed, rounding.belongs)
    factor = None if row.ok else _factor(sides, lambda scaled: noise_free.compare(scaled, allowed, rounding.belongs)[0].ok)
    drawn = {"difference": sides.difference.mean(axis=-1), "roundings": roundings}
    return LightRow(
        *_means(sides), 0.0, 0.0, int(sides.broken.sum()), sides.breaks, noise_free=row, edges=edges, factor=factor
    ), drawn


def _noisy(
    sides: Sides, rounding: noise_free.Rounding, freedom: tuple[int, int], level: float
) -> tuple[LightRow, dict[str, Array]]:
    settings = (rounding.of(sides), freedom, level)
    tests = hypothesis_tests.run(sides, *settings)
    errors = sides.difference - sides.difference.mean(axis=(0, 1))
    # Channels share their samples, so that each pixel's sum over them is one error; but each channel is asked by itself.
    ratio_error = _relative(np.sqrt((errors.sum(axis=-1) ** 2).sum()), sides.reference.sum())
    visible = hypothesis_tests.least_findable(tests)
    row = LightRow(*_means(sides), ratio_error, visible, int(sides.broken.sum()), sides.breaks, tests)
    if not row.ok:
        scaled_passes = _factor(sides, lambda scaled: all(q.ok for q in hypothesis_tests.run(scaled, *settings)))
        row = replace(row, factor=scaled_passes)
    pixels, tiles = tests[0], tests[1]
    height, width = sides.broken.shape
    worst_tiles = hypothesis_tests.over_pixels(hypothesis_tests.worst_channel(tiles.errors), (height, width), tiles.size)
    drawn = {"difference": sides.difference.mean(axis=-1), "tiles": worst_tiles}
    if pixels.errors.any():
        drawn["standard errors"] = hypothesis_tests.worst_channel(pixels.errors)
    return row, drawn


def _means(sides: Sides) -> tuple[str, float, float]:
    return sides.name, float(sides.reference.mean()), float(sides.test.mean())


def _relative(error: float, light: float) -> float:
    return float(error / light) if light > 0.0 else float("inf")


def _factor(sides: Sides, passes: Callable[[Sides], bool]) -> float | None:
    """The factor from the reference to the test, if that explains all of the difference."""
    _, reference, test = _means(sides)
    if min(reference, test) <= 0.0 or sides.broken.any():
        return None
    factor = test / reference
    return factor if passes(replace(sides, test=sides.test / factor, test_variance=sides.test_variance / factor**2)) else None
