"""What paths bring to the eye, sorted by the pass that shows it, and the passes that become of all samples of a tile.

The samples of a tile are added one after the other, in order, so that a sum is the same, bit for bit, whatever the tile.
Colours are summed as differences from the pixel's first sample: where all are equal the variance is 0, and not a rounding.

**Variance** of a mean is that of the means of batches, some 16 of as many samples that follow one another, over their number.
The samples of a pixel share its space out among them (sampler.py), so that their own variance over their number is 3 to 11
times too large at 64 to 256 samples. So are batches among themselves, but less: by 1.7 to 3.2, with 16 of them, and their
estimate is off by a third (24 seeds of an area lamp with a world, at 0 and 4 bounces). Below 32 samples each is a batch.
Rejected: batches that are scrambled each on its own, which makes the estimate right by making the picture noisier.
"""

from collections.abc import Sequence
from copy import copy
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, Some, pick, put
from ..compiled.standing import or_compiled
from ..rays.surface import Passes
from ..scene.film import Film

COLOUR, EMITTED, BACKGROUND, DIRECT, INDIRECT, OTHER = "Diffuse Color", "Emission", "Environment", "Direct", "Indirect", "Other"
"""The colour of diffuse surfaces that the eye sees, and what it sees of lights; of the world behind all; after one diffuse
scattering; after more, the first of them diffuse; and what mirrors and glass show. All light is the picture."""

_BATCHES = 16
# The largest float32, so that no pixel is infinite.
_MOST = float(np.finfo(np.float32).max)


class Light:
    """The light of n paths.

    A place is a category's `place` + path, so that one number tells where what a path brings next belongs.
    categories : those that the scene can have. covered : (n,) whether the eye sees any surface.
    """

    def __init__(self, count: int, categories: Sequence[str]) -> None:
        self.count = count
        self._rows = {category: row for row, category in enumerate(categories)}
        self.values = np.zeros((3, len(categories), count))
        self.flat = self.values.reshape(3, len(categories) * count)
        self.covered = np.zeros(count, bool)

    def __contains__(self, category: str) -> bool:
        return category in self._rows

    def place(self, category: str) -> int:
        return self._rows[category] * self.count

    def of(self, category: str) -> Floats:
        """(3, n): what the paths bring that belongs to a category."""
        return self.values[:, self._rows[category]]

    def add(self, places: Indices, radiance: Floats) -> None:
        """Add (3, k) or (3, 1) to k different places."""
        for total, component in zip(self.flat, radiance, strict=True):
            total[places] += component

    def put(self, category: str, paths: Indices | slice, radiance: Floats) -> None:
        """What some paths bring, (3, k) or (3, 1), and nothing else does."""
        for total, component in zip(self.values[:, self._rows[category]], radiance, strict=True):
            total[paths] = component


class Means:
    """The means over the samples of `count` pixels, which have none until `begin` or `put`.

    categories : of light. taken : how many samples there are, of all pixels alike or of each.
    """

    _ROWS = 7  # of the state, beside those of the categories

    def __init__(self, count: int, categories: Sequence[str], film: Film) -> None:
        self._film, self.count = film, count
        self.taken: int | Indices = 0
        self.categories = list(categories)
        hidden = (COLOUR, BACKGROUND) if film.transparent else (COLOUR,)
        self.shown = [row for row, category in enumerate(categories) if category not in hidden]
        self._hold(np.empty((3 * len(categories) + self._ROWS, count)))

    def _hold(self, state: Floats) -> None:
        """Keep all that is known of the pixels in the columns of one table, and names for its rows."""
        rows = 3 * len(self.categories)
        self.state = state
        self.totals = state[:rows].reshape(3, len(self.categories), state.shape[1])
        # The sum of the differences from the first sample is the last.
        self.covered, self.first, self.differences = state[rows], state[rows + 1 : rows + 4], state[rows + 4 : rows + 7]

    @property
    def means(self) -> int:
        """How many of the state's first rows are sums of what the pixels show, of categories or of all."""
        return 3 * len(self.categories) + 4

    def at(self, which: Some) -> Self:
        """Some of the pixels: a view of a slice, a copy of others."""
        some = copy(self)
        some._hold(pick(self.state, which))
        some.count = some.state.shape[1]
        return some

    def put(self, which: Indices, some: "Means") -> None:
        """Put some pixels here."""
        put(self.state, which, some.state[: len(self.state)])

    def begin(self, light: Light) -> None:
        """Take the first sample of every pixel."""
        self.totals[:], self.covered[:] = light.values, light.covered
        self.first[:] = sum(light.values[:, row] for row in self.shown)
        self.differences[:] = 0.0
        self.taken = 1

    @property
    def combined(self) -> Floats:
        """(3, count): the mean so far of what the pixels show."""
        return (self.first + self.differences / self.taken) * self._film.exposure

    @property
    def alpha(self) -> Floats:
        """(count,): the part of the pixels that surfaces cover, so far; 1 where the film is opaque."""
        return self.covered / self.taken if self._film.transparent else np.ones(self.count)

    def mean(self, category: str) -> Floats:
        """(3, count): of the light that belongs to a category, so far, without exposure."""
        if category not in self.categories:
            return np.zeros((3, self.count))
        return self.totals[:, self.categories.index(category)] / self.taken

    def change(self, category: str, more: Floats) -> None:
        """Add (3, count) to the sum of a category that shows in the picture."""
        self.totals[:, self.categories.index(category)] += more
        self.differences += more

    def write_means(self, passes: Passes) -> None:
        """Write all but Variance into passes, name → (count, channels), which are dark and stay so where there is no light."""
        exposure = self._film.exposure
        colour = self.mean(COLOUR)
        store(passes["Combined"], self.combined)
        passes["Combined"][:, 3] = self.alpha
        if COLOUR in self.categories:
            store(passes["Diffuse Color"], colour)
        for name, category in (("Emission", EMITTED), ("Environment", BACKGROUND)):
            if category in self.categories:
                store(passes[name], self.mean(category) * exposure)
        for name, category in (("Diffuse Direct", DIRECT), ("Diffuse Indirect", INDIRECT)):
            if category in self.categories:
                store(passes[name], without_colour(self.mean(category) * exposure, colour))


class Sums(Means):
    """The same with the sums that tell variance. samples : how many there will be."""

    _ROWS = Means._ROWS + 6

    def __init__(self, count: int, categories: Sequence[str], film: Film, samples: int) -> None:
        super().__init__(count, categories, film)
        self.state.fill(0.0)
        # A power of two, since that is how many points together fill their space.
        self.batch_size = 1 << max(samples // _BATCHES, 1).bit_length() - 1

    def _hold(self, state: Floats) -> None:
        super()._hold(state)
        # The sum of the differences when the last batch began, and the batches' own sums, squared.
        self.before, self.squares = state[-6:-3], state[-3:]

    def add(self, light: Light, some: slice = slice(None)) -> None:
        """Add some of the light's samples of every pixel: its paths are those of all samples of a pixel, pixel after pixel."""
        samples = light.count // self.count
        values = light.values.reshape(3, len(self.categories), self.count, samples)[..., some]
        add_samples(self, values, light.covered.reshape(self.count, samples)[:, some])
        self.taken += values.shape[3]

    def write(self, passes: Passes, random: bool) -> None:
        """Write means and variances into passes, as in `write_means`.

        random : whether another seed would give another picture; if so, the variance of a single sample is infinite.
        """
        self.write_means(passes)
        if self.taken > 1:
            store(passes["Variance"], self.variance)
        else:
            passes["Variance"][:] = np.inf if random else 0.0

    @property
    def variance(self) -> Floats:
        """(3, count), of `combined`: that of the batches' means over their number, as if one that has begun had ended."""
        batches = self.taken // self.batch_size
        of_sums = (self.squares - self.before * self.before / batches) / (batches - 1)
        return np.maximum(of_sums, 0.0) / self.batch_size / self.taken * self._film.exposure**2


@or_compiled
def add_samples(sums: Sums, values: Floats, covered: NDArray[np.bool_]) -> None:
    """Add some samples of every pixel, one after the other.

    values : (3, categories, count, samples). covered : (count, samples).
    """
    values = values.transpose(0, 1, 3, 2).copy()
    combined = np.zeros((3, *values.shape[2:]))
    for row in sums.shown:
        combined += values[:, row]
    if sums.taken == 0:
        sums.first[:] = combined[:, 0]
    combined -= sums.first[:, None]
    for sample in range(values.shape[2]):
        sums.totals += values[:, :, sample]
        sums.differences += combined[:, sample]
        if (sums.taken + sample + 1) % sums.batch_size == 0:
            of_batch = sums.differences - sums.before
            of_batch *= of_batch
            sums.squares += of_batch
            sums.before[:] = sums.differences
    sums.covered += covered.sum(axis=1)


def without_colour(light: Floats, colour: Floats) -> Floats:
    """Light divided by the colour that it fell on; where a channel is black, the mean of the others, as in Cycles."""
    black = colour == 0
    divided = light / np.where(black, 1.0, colour)
    divided[black] = 0.0
    others = np.maximum((~black).sum(axis=0), 1)
    return np.where(black, divided.sum(axis=0) / others, divided)


def store(target: np.ndarray, values: Floats) -> None:
    """Write (3, n) colours into a pass."""
    target[:, :3] = np.minimum(values, _MOST).T
