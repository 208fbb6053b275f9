"""What is known of the pixels of some rows between rounds of samples, and what they tell of one another."""

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats, Indices, gather, put
from ...rays.surface import Passes
from ...scene.film import Film
from ..sharing import shared
from ..sums import COLOUR, DIRECT, INDIRECT, Light, Means, Sums, store, without_colour
from .estimate import blocks, efficiency, mean_around
from .interior import CORRECTED, correction

Mask = NDArray[np.bool_]

# So many times the variance of light that is shared counts as its error's square: what bends the light by less than the noise
# of the window before, which is twice as much, can not be told from noise.
_HIDDEN = 4.0


class Band:
    """n pixels.

    means : that have no samples yet. glints : (rows, width), see glints.py. rows : of the picture. random : whether paths
    through the same point of the film may bring different light.

    taken : (n,) samples of each. variance : (3, n), of their mean. The rest, (n,), are means over red, green and blue, with
    alpha's own on top. spread : of the samples themselves. apart : how far the means of their halves are apart, as a variance.
    doubt : the variance of their mean, as those around tell it, with what they may have missed.
    """

    def __init__(self, means: Means, film: Film, glints: Floats, rows: range, random: bool) -> None:
        self.shape, self.rows, self._random = glints.shape, rows, random
        self._film, self._means, self._glints = film, means, glints * film.exposure**2
        self.taken = np.ones(means.count, np.int32)
        self._variance = np.zeros((3, means.count))
        self._spread, self._apart, self._doubt = np.zeros((3, means.count))

    def places(self, pixels: Indices) -> tuple[Indices, Indices, Indices]:
        """Where pixels of the band are in the picture: row · width + column, columns and rows, (n,) each."""
        rows, columns = np.divmod(pixels, self.shape[1])
        return pixels + self.rows.start * self.shape[1], columns, rows + self.rows.start

    def add_centres(self, part: slice, light: Light) -> None:
        """Add the light at some pixels' centres."""
        self._means.at(part).begin(light)

    @property
    def means(self) -> int:
        """How many rows of the means' state are to be smooth where the light is."""
        return self._means.means

    @property
    def shown(self) -> Floats:
        """(channels, height, width): what the centres show, with alpha where there is any."""
        shown = self._means.first * self._film.exposure
        if self._film.transparent:
            shown = np.concatenate([shown, self._means.covered[None]])
        return shown.reshape(-1, *self.shape)

    def smooth(self, done: Mask, row: int) -> None:
        """Make of the centres' light the filter's mean where pixels are done, in one row of the sums.

        What may be wrong with that, of what the pixels show, is taken for their variance.
        """
        values = self._means.state[row].reshape(self.shape)
        more = correction(values, self._film) * done
        values += more
        channel = row - (self.means - 3)
        if channel >= 0:
            self._variance[channel] = (CORRECTED * self._film.exposure * more.ravel()) ** 2

    def put(self, which: Indices, sums: Sums, before: Floats, half: int) -> None:
        """Put sums back. before : `shown_by` them when so many samples were taken, about half of those that are now."""
        self._means.put(which, sums)
        self.taken[which] = sums.taken
        variance, alpha = sums.variance, sums.alpha
        put(self._variance, which, variance)
        self._spread[which] = variance.mean(axis=0) * sums.taken + alpha * (1.0 - alpha)
        apart = (shown_by(sums) - before) ** 2 * (half / (sums.taken - half))
        self._apart[which] = apart[:3].mean(axis=0) + apart[3]

    def estimated(self, active: Indices) -> Floats:
        """The variances of the means of pixels that have just got samples, as many each."""
        samples, own = self.taken[active[0]], gather(self._spread, active)
        factor = efficiency(own / samples, gather(self._apart, active), blocks(active, self.shape[1]))
        put(self._variance, active, gather(self._variance, active) * factor)
        spread = mean_around(self._spread.reshape(self.shape), self.taken.reshape(self.shape) > 1, active)
        if not self._random:
            spread = np.maximum(spread, own)
        unseen = gather(self._glints.ravel(), active) / samples**2
        self._doubt[active] = np.maximum(spread / samples * factor, unseen)
        return gather(self._doubt, active)

    def shared(self, which: Mask, error: float) -> Floats:
        """(n,): the variances of the pixels' means, if those of `which` share the light that falls on them.

        which : (n,). error : that is wanted.
        """
        _, left, _ = self._shared(which, error)
        return left.ravel()

    def share(self, which: Mask, error: float) -> None:
        """Give pixels of `which` the light that they share."""
        more, _, kinds = self._shared(which, error)
        more *= self.taken
        for number, kind in enumerate(kinds):
            self._means.change(kind, more[3 * number : 3 * number + 3])

    def _shared(self, which: Mask, error: float) -> tuple[Floats, Floats, list[str]]:
        """What sharing adds to the means, (3 kinds, n), their variance, (n,), and the kinds of light that are shared."""
        means = self._means
        means.taken = self.taken
        colour = means.mean(COLOUR)
        bright = (colour * colour).mean(axis=0)
        which = which & (bright > 0)
        kinds = [kind for kind in (DIRECT, INDIRECT) if kind in means.categories]
        light = np.concatenate([without_colour(means.mean(kind), colour) for kind in kinds])
        # Of one kind, if both have as much.
        share = np.where(which, bright, 1.0) * (self._film.exposure**2 * len(kinds))
        tolerance = error / np.sqrt(share[which].max(initial=1e-300))
        shape = (-1, *self.shape)
        mean, left = shared(
            light.reshape(shape),
            (self._variance.mean(axis=0) / share).reshape(self.shape),
            which.reshape(self.shape),
            tolerance,
        )
        left = left.ravel() * (share * _HIDDEN)
        more = np.where(which, mean.reshape(light.shape) - light, 0.0) * np.tile(colour, (len(kinds), 1))
        return more, np.where(which, np.minimum(left, self._doubt), self._doubt), kinds

    def write(self, passes: Passes, part: slice) -> None:
        """Write some pixels' passes."""
        passes = {name: values[part] for name, values in passes.items()}
        means = self._means.at(part)
        means.taken = self.taken[part]
        means.write_means(passes)
        store(passes["Variance"], self._variance[:, part])
        passes["Sample Count"][:, 0] = means.taken


def shown_by(sums: Means) -> Floats:
    """(4, n): colour and alpha so far."""
    return np.concatenate([sums.combined, sums.alpha[None]])
