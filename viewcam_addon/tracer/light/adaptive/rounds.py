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

from ...arrays import Float32s, Floats, Indices, gather
from ...compiled.standing import compiled_for
from ...rays.surface import Passes
from ..illumination import Illumination
from ..sums import DIRECT, Light, Sums
from .band import Band, shown_by
from .estimate import BLOCK
from .glints import glints
from .interior import interior, within

Mask = NDArray[np.bool_]

# Samples of each pixel that its centre does not tell all of, and how many are traced at a time.
_FIRST, _AT_A_TIME = 8, 16
# Pixels of a band: some hundred bytes of each are kept between the rounds. And of a part, when passes are written.
_BAND, _WRITTEN = 1 << 18, 1 << 15

Parts = Callable[[Callable[[slice], None], int, int], None]
"""Calls a function with slices of so many things, each of no more than so many, in some thread."""


class Rounds:
    """Samples one band of a picture after the other.

    error : that is wanted of each pixel's Combined, a standard error. edges : `Illumination.edges`. depth, primitives :
    (height, width), what is seen at the pixels' centres. parts : see above. check : called often; what it raises ends the work.
    """

    def __init__(
        self,
        illumination: Illumination,
        error: float,
        edges: Mask,
        depth: Float32s,
        primitives: Indices,
        parts: Parts,
        check: Callable[[], None],
    ) -> None:
        self._light, self._error, self._primitives = illumination, error, primitives
        self._parts, self._check = parts, check
        self._certain = illumination.paths_by_lamp()
        # Where light is random and falls on anything.
        self._shares = self._certain is None and DIRECT in illumination.paths.categories and illumination.film.exposure > 0
        self._edges = edges
        self._material = illumination.surfaces.materials_seen(primitives.ravel()).reshape(primitives.shape)
        self._glints = glints(illumination.camera, illumination.surfaces, illumination.palette, depth, self._material)

    def bands(self) -> list[range]:
        """Rows that are traced together: as many whole blocks as make no more than `_BAND` pixels, but at least one."""
        height, width = self._primitives.shape
        rows = max(_BAND // width // BLOCK, 1) * BLOCK
        return [range(first, min(first + rows, height)) for first in range(0, height, rows)]

    def trace(self, passes: Passes, rows: range) -> None:
        """Write the light of some rows into passes, name → (rows, width, channels)."""
        part = self._glints[rows.start : rows.stop]
        band = Band(self._light.means(part.size), self._light.film, part, rows, self._certain is None)
        alone = self._alone(band)
        active = np.flatnonzero(~self._by_centres(band, alone))
        sums = self._light.sums(len(active), 1)
        while len(active) and sums.taken < self._light.samples:
            self._sample(band, active, sums, min(2 * sums.taken or _FIRST, self._light.samples))
            variance = band.estimated(active)
            if self._shares and not gather(alone, active).all():
                shared = band.shared(~alone, self._error)
                variance = np.where(gather(alone, active), variance, gather(shared, active))
            going = np.flatnonzero(variance > self._error**2)
            active, sums = active[going], sums.at(going)
        if self._shares:
            band.share(~alone, self._error)
        flat = {name: values.reshape(-1, values.shape[2]) for name, values in passes.items()}
        self._parts(lambda part: band.write(flat, part), len(alone), _WRITTEN)

    def _alone(self, band: Band) -> Mask:
        """(n,): the pixels in which something may change that their neighbours don't show."""
        rows = slice(band.rows.start, band.rows.stop)
        unsteady = self._light.palette.specular
        if self._certain is not None:
            unsteady = unsteady | self._light.palette.patterned
        alone = self._edges[rows] | gather(unsteady, self._material[rows])
        return within(alone, self._light.film).ravel()

    def _by_centres(self, band: Band, alone: Mask) -> Mask:
        """Which of the pixels their centres are enough for, (n,), whose light there is then traced."""
        if self._certain is None:
            return np.zeros(len(alone), bool)

        def trace(part: slice) -> None:
            pixels, columns, rows = band.places(np.arange(part.start, part.stop))
            x, y = self._light.camera.view_plane(columns + 0.5, rows + 0.5)
            band.add_centres(part, self._certain_light(pixels, gather(self._primitives.ravel(), pixels), x, y))

        self._parts(trace, len(alone), self._light.paths_at_a_time)
        done = interior(band.shown, alone.reshape(band.shape), self._light.film, self._error)
        self._parts(lambda part: band.smooth(done, part.start), band.means, 1)
        return done.ravel()

    def _certain_light(self, pixels: Indices, primitives: Indices, x: Floats, y: Floats) -> Light:
        """The light of all lamps, where chance has no part in it."""
        samples = np.zeros(len(pixels), np.intp)
        light, *others = (paths.trace(pixels, samples, primitives, x, y, self._check) for paths in self._certain)
        for other in others:
            light.of(DIRECT)[:] += other.of(DIRECT)
        return light

    def _sample(self, band: Band, active: Indices, sums: Sums, more: int) -> None:
        """Take samples of the active pixels and add them to their sums, until they have so many."""
        taken = sums.taken
        half = taken or more // 2

        def trace(part: slice) -> None:
            which, some = active[part], sums.at(part)
            before = shown_by(some) if taken else None
            for first in range(taken, more, _AT_A_TIME):
                numbers = np.arange(first, min(first + _AT_A_TIME, more))
                light = self._light.light(numbers, *band.places(which), self._check)
                if before is None:
                    some.add(light, slice(half))
                    before = shown_by(some)
                    some.add(light, slice(half, None))
                else:
                    some.add(light)
            band.put(which, some, before, half)

        with compiled_for(len(active) * (more - taken)):
            self._parts(trace, len(active), self._light.paths_at_a_time // min(more - taken, _AT_A_TIME))
        sums.taken = more
