"""Rounds of samples for a band of a picture's rows, until each pixel's standard error is below what is wanted.

First every pixel's centre is traced. Where the light of a point depends on no chance, pixels are done whose centre tells all
(interior.py). The others get samples, those that they get in any picture, twice as many with every round, until their error is
small enough (estimate.py) or there are as many as allowed. Those that go on all have the same number, so that halves can be
compared.

A band is cut into parts over threads, and each pixel of a part is computed alone: neither parts nor threads change a bit. What
pixels tell of each other is asked between the rounds, by one thread, over the whole band.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats, Indices, gather, put
from ...rays.surface import Passes
from ..illumination import Illumination
from ..sums import DIRECT, Light, Sums, store
from .estimate import BLOCK, efficiency, missed
from .interior import CORRECTED, correction, interior

# Samples of each pixel that its centre does not tell all of, and how many are traced at a time.
_FIRST, _AT_A_TIME = 8, 16
# Pixels of a band: some hundred bytes of each are kept between the rounds. And of a part, when passes are written.
_BAND, _WRITTEN = 1 << 19, 1 << 15

Parts = Callable[[Callable[[slice], None], int, int], None]
"""Calls a function with slices of so many things, each of no more than so many, in some thread."""
Centres = Callable[[Passes, Indices, Indices], tuple[Floats, Floats, Indices]]
"""Writes the passes of pixels' centres, at columns and rows; tells the rays through them and the primitives that these meet."""


def bands(width: int, height: int) -> list[range]:
    """Rows that are traced together: as many whole blocks as make no more than `_BAND` pixels, but at least one."""
    rows = max(_BAND // width // BLOCK, 1) * BLOCK
    return [range(first, min(first + rows, height)) for first in range(0, height, rows)]


class Rounds:
    """Samples one band after the other.

    error : that is wanted of each pixel's Combined, a standard error. centres, parts : see above. check : called often; what it
    raises ends the work.
    """

    def __init__(
        self, illumination: Illumination, error: float, width: int, centres: Centres, parts: Parts, check: Callable[[], None]
    ) -> None:
        self._light, self._error, self._width = illumination, error, width
        self._centres, self._parts, self._check = centres, parts, check
        self._certain = illumination.paths_by_lamp()

    def trace(self, passes: Passes, rows: range) -> None:
        """Write the light of some rows into passes, name → (rows, width, channels)."""
        passes = {name: values.reshape(-1, values.shape[2]) for name, values in passes.items()}
        band = _Band(self._light, rows, self._width)
        active = np.flatnonzero(~self._by_centres(band, passes))
        taken = 0
        while len(active) and taken < self._light.samples:
            more = min(2 * taken or _FIRST, self._light.samples)
            self._sample(band, active, taken, more)
            taken = more
            active = active[band.estimated(active) > self._error**2]
        self._parts(lambda part: band.write(passes, part), len(band.pixels), _WRITTEN)

    def _by_centres(self, band: "_Band", passes: Passes) -> NDArray[np.bool_]:
        """Trace the pixels' centres; which of the pixels these are enough for, (n,)."""
        excluded = np.zeros(len(band.pixels), bool)

        def trace(part: slice) -> None:
            self._check()
            there = {name: values[part] for name, values in passes.items()}
            x, y, primitives = self._centres(there, band.columns[part], band.rows[part])
            if self._certain is not None:
                band.add_centres(part, self._certain_light(band.pixels[part], primitives, x, y))
                excluded[part] = self._light.unsteady(primitives, x, y)

        self._parts(trace, len(band.pixels), self._light.paths_at_a_time)
        if self._certain is None:
            return excluded
        done = interior(band.shown, excluded.reshape(band.shape), self._light.film, self._error)
        band.doubt(done)
        self._parts(lambda part: band.smooth(done, part.start), band.means, 1)
        return done.ravel()

    def _certain_light(self, pixels: Indices, primitives: Indices, x: Floats, y: Floats) -> Light:
        """The light of all lamps, where chance has no part in it."""
        samples = np.zeros(len(pixels), np.intp)
        light, *others = (paths.trace(pixels, samples, primitives, x, y, self._check) for paths in self._certain)
        for other in others:
            light.of(DIRECT)[:] += other.of(DIRECT)
        return light

    def _sample(self, band: "_Band", active: Indices, taken: int, more: int) -> None:
        """Take samples of the active pixels, of which they have `taken` so far, until they have `more`."""
        halves = (taken or more // 2, more)

        def trace(part: slice) -> None:
            which = active[part]
            sums = band.sums_of(which, taken)
            means = []
            for half in halves:
                for first in range(sums.taken, half, _AT_A_TIME):
                    some = np.arange(first, min(first + _AT_A_TIME, half))
                    self._light.add(sums, some, band.pixels[which], band.columns[which], band.rows[which], self._check)
                means.append(sums.combined)
            band.put(which, sums, means[0], halves[0])

        self._parts(trace, len(active), self._light.paths_at_a_time // min(more - taken, _AT_A_TIME))


class _Band:
    """What is known so far of the n pixels of some rows.

    taken : (n,) samples of each. variance : (3, n), of their mean. spread : (n,), the samples' own. apart : (n,), how far their
    halves' means are apart, as a variance. The latter two are means over the channels.
    """

    def __init__(self, light: Illumination, rows: range, width: int) -> None:
        self.pixels = np.arange(rows.start * width, rows.stop * width)
        self.rows, self.columns = np.divmod(self.pixels, width)
        self.shape = len(rows), width
        count = len(self.pixels)
        self._film, self._sums = light.film, light.sums(count, 1)
        self.taken = np.ones(count, np.int32)
        self._variance, self._spread, self._apart = np.zeros((3, count)), np.zeros(count), np.zeros(count)

    def add_centres(self, part: slice, light: Light) -> None:
        """Add the light at some pixels' centres."""
        sums = self._sums.at(part)
        sums.add(light)
        self._sums.put(part, sums)

    @property
    def means(self) -> int:
        """How many rows of the sums' state are to be smooth where the light is."""
        return self._sums.means

    @property
    def shown(self) -> Floats:
        """(channels, height, width): what the centres show, with alpha where not all is opaque."""
        self._sums.taken = 1
        shown = self._sums.combined
        if self._film.transparent:
            shown = np.concatenate([shown, self._sums.covered[None]])
        return shown.reshape(-1, *self.shape)

    def smooth(self, done: NDArray[np.bool_], row: int) -> None:
        """Make of the centres' light the filter's mean where pixels are done, and nothing elsewhere, in one row of the sums."""
        values = self._sums.state[row].reshape(self.shape)
        values[:] = np.where(done, values + correction(values, self._film), 0.0)

    def doubt(self, done: NDArray[np.bool_]) -> None:
        """Take for the variance of pixels that are done what may be wrong with their correction."""
        for variance, shown in zip(self._variance, self.shown, strict=False):
            off = CORRECTED * correction(shown, self._film)
            variance[:] = np.where(done, off * off, 0.0).ravel()

    def sums_of(self, which: Indices, taken: int) -> Sums:
        """A copy of the sums of some pixels, of which so many samples were taken."""
        sums = self._sums.at(which)
        sums.taken = taken
        return sums

    def put(self, which: Indices, sums: Sums, before: Floats, half: int) -> None:
        """Put sums back. before : their mean when so many samples were taken, about half of those that are now."""
        self._sums.put(which, sums)
        self.taken[which] = sums.taken
        variance = sums.variance
        put(self._variance, which, variance)
        self._spread[which] = variance.mean(axis=0) * sums.taken
        self._apart[which] = ((sums.combined - before) ** 2).mean(axis=0) * (half / (sums.taken - half))

    def estimated(self, active: Indices) -> Floats:
        """The variances of the means of pixels that have just got samples, as many each."""
        own, apart = np.zeros((2, *self.shape))
        samples = self.taken[active[0]]
        own.ravel()[active] = gather(self._spread, active) / samples
        apart.ravel()[active] = gather(self._apart, active)
        factor = gather(efficiency(own, apart).ravel(), active)
        put(self._variance, active, gather(self._variance, active) * factor)
        unseen = gather(missed(self._spread.reshape(self.shape), samples).ravel(), active)
        return np.maximum(gather(own.ravel(), active) * factor, unseen)

    def write(self, passes: Passes, part: slice) -> None:
        """Write some pixels' passes."""
        passes = {name: values[part] for name, values in passes.items()}
        sums = self._sums.at(part)
        sums.taken = self.taken[part]
        sums.write_means(passes)
        store(passes["Variance"], self._variance[:, part])
        passes["Sample Count"][:, 0] = sums.taken
