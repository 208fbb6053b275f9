"""What paths bring to the eye, sorted by the pass that shows it, and the passes that become of all samples of a tile.

Samples are added one after the other, in order, so that a sum is the same, bit for bit, however many are computed at a time.
Colours are summed as differences from the pixel's first sample: where all are equal the variance is 0, and not a rounding.
"""

import numpy as np

from .arrays import Floats, Indices
from .film import Film
from .surface import Passes

EMITTED, BACKGROUND, DIRECT, INDIRECT, OTHER = range(5)
"""What the eye sees of lights; of the world behind all; after one diffuse scattering; after more, the first of them diffuse;
and what mirrors and glass show. Their sum is the picture."""
_CATEGORIES = 5

# The largest float32, so that no pixel is infinite.
_MOST = float(np.finfo(np.float32).max)


class Light:
    """The light of n paths.

    A place is category · n + path, so that what a path brings next finds its place by one number.
    colour : (3, n), of the diffuse surface that the eye sees. covered : (n,) whether there is any surface.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self.radiance = np.zeros((3, _CATEGORIES * count))
        self.colour = np.zeros((3, count))
        self.covered = np.zeros(count, bool)

    def add(self, places: Indices, radiance: Floats) -> None:
        """Add (3, k) to k different places."""
        for total, component in zip(self.radiance, radiance, strict=True):
            total[places] += component


class Sums:
    """The sums over the samples of `count` pixels."""

    def __init__(self, count: int, film: Film) -> None:
        self._film, self._count, self._samples = film, count, 0
        self._categories = np.zeros((3, _CATEGORIES, count))
        self._colour = np.zeros((3, count))
        self._covered = np.zeros(count)
        self._first = np.zeros((3, count))
        self._difference = np.zeros((3, count))
        self._square = np.zeros((3, count))

    def add(self, light: Light) -> None:
        """Add some samples of every pixel: the paths are those of all pixels, sample after sample."""
        radiance = light.radiance.reshape(3, _CATEGORIES, -1, self._count)
        colour, covered = light.colour.reshape(3, -1, self._count), light.covered.reshape(-1, self._count)
        shown = [category for category in range(_CATEGORIES) if category != BACKGROUND or not self._film.transparent]
        for sample in range(len(covered)):
            value = radiance[:, :, sample]
            combined = value[:, shown].sum(axis=1)
            self._categories += value
            self._colour += colour[:, sample]
            self._covered += covered[sample]
            if self._samples == 0:
                self._first = combined.copy()
            combined -= self._first
            self._difference += combined
            self._square += combined * combined
            self._samples += 1

    def write(self, passes: Passes, random: bool) -> None:
        """Write the means into passes, name → (count, channels).

        random : whether another seed would give another picture; if so, the variance of a single sample is infinite.
        """
        number, exposure = self._samples, self._film.exposure
        mean = self._categories * (exposure / number)
        colour = self._colour / number
        _store(passes["Combined"], self._first * exposure + self._difference * (exposure / number))
        passes["Combined"][:, 3] = self._covered / number if self._film.transparent else 1.0
        _store(passes["Emission"], mean[:, EMITTED])
        _store(passes["Environment"], mean[:, BACKGROUND])
        _store(passes["Diffuse Direct"], _without_colour(mean[:, DIRECT], colour))
        _store(passes["Diffuse Indirect"], _without_colour(mean[:, INDIRECT], colour))
        _store(passes["Diffuse Color"], colour)
        if number > 1:
            _store(passes["Variance"], self._variance() * exposure**2)
        else:
            passes["Variance"][:] = np.inf if random else 0.0

    def _variance(self) -> Floats:
        """Of the mean: the samples' own over their number."""
        number = self._samples
        of_samples = (self._square - self._difference * self._difference / number) / (number - 1)
        return np.maximum(of_samples, 0.0) / number


def _without_colour(light: Floats, colour: Floats) -> Floats:
    """Light divided by the colour that it fell on; where a channel is black, the mean of the others, as in Cycles."""
    black = colour == 0
    divided = light / np.where(black, 1.0, colour)
    divided[black] = 0.0
    others = np.maximum((~black).sum(axis=0), 1)
    return np.where(black, divided.sum(axis=0) / others, divided)


def _store(target: np.ndarray, values: Floats) -> None:
    target[:, :3] = np.minimum(values, _MOST).T
