"""A group sequential test: light compared in rounds of samples, until a bias of a wanted size would have been found.

Each round adds samples on both sides, with seeds of its own, to those of the rounds before, so that nothing is thrown away: 16
a pixel after the first, which tells what is wrong by much; then as many as could decide at all, 256 for a bias of 0.5 %, since
a round costs more than such few samples; and then twice as many after each, up to 65,536. All hypothesis tests are made after
each. Pictures that differ end it. The others are the same as soon as the test of all of Combined would have found a picture
that is off by the wanted share everywhere, with the probability hypothesis_tests.POWER. In the whole most noise cancels; so
there are some samples at least, for what is wrong in a few pixels alone. Where so few pixels have light that their sum tells
nothing, the tile or pixel that tells most decides.

Who looks eleven times, as often as there are totals, has eleven chances of a false alarm. The false alarms that are promised
are spent over the looks (Lan and DeMets, Discrete sequential boundaries for clinical trials, Biometrika 70, 1983), an eleventh
on each. That their sum is an upper bound is Boole's inequality, which holds however the looks depend on one another, whatever
the noise is, and whichever of them is the last; to stop with *the same* can raise no alarm.

Rejected: the boundaries of Pocock (1977) and of O'Brien and Fleming (1979), a little lower because they take the rounds' sums
to be normal, which the noise of light is not at a level of 10⁻⁹; confidence sequences (Howard, Ramdas, McAuliffe and Sekhon,
Time-uniform, nonparametric, nonasymptotic confidence sequences, Annals of Statistics 49, 2021), which allow a look after every
sample, and are wider for looks that nobody makes; rounds of one size, of which there would be a thousand.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..image import Image
from .hypothesis_tests import BLOCKS, SIZES, least_findable
from .light_verdict import FALSE_ALARMS, RadianceComparison, Search

TOTALS = (16, 64, *(256 * 2**doubled for doubled in range(9)))
"""Samples of a pixel, of each side, that there may be after a round."""

FALSE_ALARMS_OF_EACH = FALSE_ALARMS / len(TOTALS)
"""The probability of a false alarm that each look may spend."""

# Samples at least, for noise to show at all: what a check takes by default.
_FEWEST_OF_ALL = TOTALS[1]
# Samples at least, times the bias. Calibrated in the judge's room (benchmarks/judge): with 256 for 0.5 % as many of its sixty
# faults are found as with 1,024; a block of 8 × 8 pixels that is 5 % brighter is the last of them.
_FEWEST = 1.28
# Lights that a pass has divided by the color that they fell on: quotients have no mean of their own.
_PER_COLOR = ("Diffuse Direct", "Diffuse Indirect")
_MEANS = ("Combined", "Emission", "Environment", "Diffuse Color")


class Rounds:
    """The pictures of all rounds so far, each the mean over all of its samples.

    samples : the samples of each side.
    reference, tests, everything : see radiance.compare and everything.not_modeled. Each of the tests has had a share of every
        round, so that they are alike and independent, and their spread tells their noise as ever.
    """

    samples = 0
    count = 0
    reference: Image
    tests: list[Image]
    everything: Image | None

    def add(self, samples: int, reference: Image, tests: Sequence[Image], everything: Image | None) -> None:
        """Add the pictures of one more round.

        samples : the samples of this round, on each side.
        """
        self.samples += samples
        self.count += 1
        if self.count == 1:
            self.reference, self.tests, self.everything = reference, list(tests), everything
            return
        share = samples / self.samples
        self.reference = _pooled(self.reference, reference, share)
        self.tests = [_pooled(before, now, share) for before, now in zip(self.tests, tests, strict=True)]
        if self.everything is not None and everything is not None:
            self.everything = _pooled(self.everything, everything, share)


def search(comparison: RadianceComparison, find: float, rounds: Rounds) -> Search:
    """The state of a search for a bias of this size. It ends where it would take more samples than there are rounds for."""
    least, in_blocks = _least(comparison)
    fewest = max(_FEWEST_OF_ALL, _FEWEST / find if comparison.is_noisy else 0)
    expected = max(rounds.samples * (least / find) ** 2, fewest)
    after = next((total for total in TOTALS if total >= expected), None)
    is_decided = rounds.samples >= _FEWEST_OF_ALL and (after is None or after <= rounds.samples)
    is_last = is_decided or not comparison.passed or rounds.samples == TOTALS[-1]
    more = [total for total in TOTALS if total > rounds.samples]
    enough = [total for total in more if after is not None and total >= fewest]
    following = next(iter(enough or more), None)
    expected = expected if after is None else after
    return Search(find, least, in_blocks, rounds.samples, rounds.count, is_last, expected, following)


def _least(comparison: RadianceComparison) -> tuple[float, float]:
    """The least bias that would be found if it is everywhere, and in a typical block alone; 0 without noise."""
    if not comparison.is_noisy:
        return 0.0, 0.0
    tests = comparison.rows[0].hypothesis_tests
    return least_findable(tests), tests[SIZES.index(BLOCKS)].typical_findable


def _pooled(before: Image, now: Image, share: float) -> Image:
    """The mean of two pictures.

    share : the second one's share of the samples of both.
    """
    passes = dict(before.passes)
    for name in _MEANS:
        if name in passes:
            passes[name] = _mixed(before.passes[name], now.passes[name], share)
    if "Diffuse Color" in passes:
        for name in _PER_COLOR:
            if name in passes:
                earlier, later = (image.passes[name] * image.passes["Diffuse Color"].astype(float) for image in (before, now))
                color, mean = passes["Diffuse Color"].astype(float), _mixed(earlier, later, share)
                passes[name] = np.divide(mean, color, out=np.zeros(color.shape), where=color > 0.0).astype(np.float32)
    if "Variance" in passes:  # the variance of a mean of two that are independent
        earlier, later = (image.passes["Variance"].astype(float) for image in (before, now))
        passes["Variance"] = ((1.0 - share) ** 2 * earlier + share**2 * later).astype(np.float32)
    counts = {
        name: str(int(text) + int(now.attributes[name]))
        for name, text in before.attributes.items()
        if (name == "samples" or name.endswith(".samples")) and text.isdecimal() and now.attributes.get(name, "").isdecimal()
    }
    return replace(before, passes=passes, attributes=before.attributes | counts)


def _mixed(before: NDArray, now: NDArray, share: float) -> NDArray[np.float32]:
    return (before + share * np.subtract(now, before, dtype=float)).astype(np.float32)
