"""The quantities that light is compared in: for each quantity the reference, the mean of the test pictures, and the variance
of both.

Several test pictures are one picture rendered with several seeds: their mean is the test, and their spread tells its noise. The
reference brings the variance of its Combined pass along. Of the other passes only the spread is known, and that the reference
has none where its Combined has none and is one pass's light alone. A sum of several may never change while they do: where rays
go on to glass that shines as brightly as the world, light that is direct once is indirect another time. And colors and
alpha may change where there is no light, as at the edge of one unlit thing before another. A reference that was traced anew
with several seeds tells its noise as the tests do.

Cycles divides Diffuse Direct and Diffuse Indirect by the surface's color, each a mean over the pixel: a quotient of means,
which on edges depends on the number of samples. So their products with Diffuse Color are compared, the light itself.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..image import LIGHT_PASSES, SETTINGS, Image
from .mismatches import largest_around
from .tolerances import FLOAT32, Array

QUANTITIES = ("Combined", "Alpha", *(name for name in LIGHT_PASSES if name in SETTINGS))
_TIMES_COLOR = ("Diffuse Direct", "Diffuse Indirect")
_LIGHT = ("Emission", "Environment", *_TIMES_COLOR)
CHANNEL_NAMES = ("red", "green", "blue")

# A standard error below so many roundings of float32 of the value itself is no noise but rounding.
_QUIET = 16.0
# The number of test pictures from which their means tell whether all samples agree.
_MANY_SEEDS = 8
# The digits that a number of samples may have: more than anybody renders. Python refuses to read thousands of them.
_MOST_DIGITS = 9


@dataclass(frozen=True, eq=False)
class Sides:
    """Both sides of a quantity, each (height, width, channels) float64, rows from the bottom.

    test_variance : the variance of `test`, which is a mean, from the test pictures' differences; inf where there is one picture
        only.
    variance : the variance of `reference`; inf where it is not known.
    broken : (height, width) bool, true where one side or both have no number; there both are 0.
    breaks : a flag for the reference and one for the tests, true if some of `broken` is theirs.
    shared : the variance of `reference` that its pixels may have shared with their neighbors, or 0.
    certain : (height, width, 1) bool, true for pixels that have no noise, whatever is beside them.
    """

    name: str
    reference: Array
    test: Array
    variance: Array
    test_variance: Array
    broken: NDArray[np.bool_]
    breaks: tuple[bool, bool] = (False, False)
    shared: Array | float = 0.0
    certain: NDArray[np.bool_] | bool = False

    @property
    def difference(self) -> Array:
        return self.test - self.reference

    @property
    def are_equal(self) -> bool:
        """True if nothing differs, to the last bit, so that there is nothing to ask."""
        return bool((self.reference == self.test).all() and not self.broken.any())


def samples_of(image: Image) -> int | None:
    """Samples a pixel, as the file tells: the tracer's own attribute, or the one that Cycles writes for each view layer."""
    counts = [
        value
        for name, value in image.attributes.items()
        if name == "samples" or (name.startswith("cycles.") and name.endswith(".samples"))
    ]
    return _whole(counts[0]) if counts else None


def seed_of(image: Image) -> int:
    """The seed of the tracer's picture, as its file tells, else 0."""
    return _whole(image.attributes.get("seed", "")) or 0


def _whole(text: str) -> int | None:
    return int(text) if text.isdecimal() and len(text) <= _MOST_DIGITS else None


def all_sides(reference: Image, tests: Sequence[Image], other_seeds: Sequence[Image] = ()) -> Iterator[Sides]:
    """Every quantity that all pictures have, Combined first.

    other_seeds : the reference with several other seeds, whose mean and spread count in place of its own.

    Raises InputError if there is no test picture, if their sizes differ, or if one has no Combined.
    """
    if not tests:
        raise InputError("there is nothing to compare with the reference: give at least one test picture")
    for image in tests:
        if image.size != reference.size:
            raise InputError(
                f"{image.source} has {image.size[0]} × {image.size[1]} pixels and {reference.source} "
                f"{reference.size[0]} × {reference.size[1]}: compare pictures of the same size"
            )
    variance = _variance(reference)
    # Where there are as many samples as a wanted error takes, neighbors' noise is not independent, but adds up to what it was.
    shared = np.where(np.isfinite(variance), variance, 0.0) if "Sample Count" in reference.passes else 0.0
    references = other_seeds or [reference]
    combined = replace(_sides("Combined", references, tests, None if other_seeds else variance), shared=shared)
    unknown = None if other_seeds else np.array(np.inf)
    parts = [
        _sides(name, references, tests, unknown)
        for name in QUANTITIES[1:]
        if all(_has(image, name) for image in (*references, *tests))
    ]
    emission = [part for part in parts if part.name == "Emission"]
    has_many = bool(emission) and len(tests) >= _MANY_SEEDS
    yield replace(combined, certain=_is_certain(combined, emission[0])) if has_many else combined
    alone = np.any([_is_all(part, combined) for part in parts if part.name in _LIGHT], axis=0)
    is_quiet = quiet(combined.reference, combined.variance) & alone
    is_lit = (combined.reference > 0.0).any(axis=-1, keepdims=True)
    for part in parts:
        known = np.where(is_quiet if part.name in _LIGHT else is_quiet & is_lit, 0.0, part.variance)
        yield replace(part, variance=known, shared=shared if part.name in _TIMES_COLOR else 0.0)


def _is_all(part: Sides, combined: Sides) -> NDArray[np.bool_]:
    """(height, width, 1) bool: where all light of both sides is that of one pass, but for rounding."""
    rest = [
        np.abs(share - all_of).max(axis=-1) <= _QUIET * FLOAT32 * np.abs(all_of).max(axis=-1)
        for share, all_of in ((part.reference, combined.reference), (part.test, combined.test))
    ]
    return (rest[0] & rest[1])[..., None]


def _is_certain(combined: Sides, emission: Sides) -> NDArray[np.bool_]:
    """(height, width, 1) bool: where all samples of either side have seen surfaces that shine, alike, and nothing else.

    Had some seen an edge, the values of one side would differ among themselves, or as many samples of every seed have; so only
    pixels count that nothing beside them outshines, as a pixel that is covered in part is outshone by one that is whole.
    """
    certain = _is_all(emission, combined) & ~combined.broken[..., None]
    for values, variance in ((combined.reference, combined.variance), (combined.test, combined.test_variance)):
        brightest = values.max(axis=-1)
        outshone = largest_around(brightest) - brightest > _QUIET * FLOAT32 * brightest
        certain &= ~(outshone | (_noise(values, variance) > 0.0))[..., None]
    return certain


def quiet(values: Array, variance: Array) -> NDArray[np.bool_]:
    """(height, width, 1) bool: where neither a pixel nor any around it has noise above float32's rounding.

    The surroundings count because the variance of a pixel is an estimate: where an edge crosses a corner of it, all of its
    samples may miss the corner.
    """
    return ~(largest_around(_noise(values, variance)) > 0.0)[..., None]


def _noise(values: Array, variance: Array) -> Array:
    """(height, width): by how much the standard error is more than rounding; negative where it is not."""
    return np.sqrt(variance.max(axis=-1)) - _QUIET * FLOAT32 * np.abs(values).max(axis=-1)


def _variance(reference: Image) -> Array:
    """The variance of the reference's Combined: as its pass tells; 0 for one sample without that pass; else unknown."""
    if "Variance" in reference.passes:
        variance = reference["Variance"].astype(np.float64)
        return np.where(np.isnan(variance), np.inf, np.maximum(variance, 0.0))
    return np.full((*reference["Combined"].shape[:2], 3), 0.0 if samples_of(reference) == 1 else np.inf)


def _sides(name: str, references: Sequence[Image], tests: Sequence[Image], variance: Array | None) -> Sides:
    """Both sides of a quantity.

    variance : the variance of the reference; None where several references tell it.
    """
    expected, own = _mean_and_variance(name, references)
    mean, test_variance = _mean_and_variance(name, tests)
    each = [~np.isfinite(values).all(axis=-1) for values in (expected, mean)]
    broken, breaks = each[0] | each[1], (bool(each[0].any()), bool(each[1].any()))
    if any(breaks):
        expected, mean, test_variance, own = (
            np.where(broken[..., None], 0.0, array) for array in (expected, mean, test_variance, own)
        )
    return Sides(
        name,
        expected,
        mean,
        own if variance is None else np.broadcast_to(variance, expected.shape),
        test_variance,
        broken,
        breaks,
    )


def _mean_and_variance(name: str, images: Sequence[Image]) -> tuple[Array, Array]:
    """A quantity's mean over pictures with several seeds, and that mean's variance: inf where there is one picture only."""
    mean = np.zeros_like(values_of(images[0], name))
    squares, seeds = np.zeros_like(mean), len(images)
    with np.errstate(invalid="ignore"):
        for count, image in enumerate(images, 1):  # Welford's running mean and sum of squares
            step = values_of(image, name) - mean
            mean = mean + step / count
            squares += step**2 * (count - 1) / count
    return mean, squares / (seeds * (seeds - 1)) if seeds > 1 else np.full_like(mean, np.inf)


def _has(image: Image, name: str) -> bool:
    needed = ("Combined",) if name == "Alpha" else (name, "Diffuse Color") if name in _TIMES_COLOR else (name,)
    return all(pass_name in image.passes for pass_name in needed)


def values_of(image: Image, name: str) -> Array:
    """(height, width, channels): a quantity of one picture."""
    if name == "Alpha":
        return image["Combined"][..., 3:].astype(np.float64)
    values = image[name][..., :3].astype(np.float64)
    return values * image["Diffuse Color"] if name in _TIMES_COLOR else values
