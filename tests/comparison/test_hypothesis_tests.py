"""Chance raises a false alarm once in a hundred comparisons at most, whatever the noise; and what is wrong by so much is found.

Two sides of the same light are drawn again and again, with the noise that renderers have: many small contributions, few large
ones, edges that a sample hits or misses, variances that are told too large, sides of unequal samples.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison import hypothesis_tests
from viewcam_addon.comparison.noise_free import Allowance
from viewcam_addon.comparison.radiance import VARIANCE_BATCHES
from viewcam_addon.comparison.sides import Sides

pytestmark = pytest.mark.slow

LEVEL = 0.01
HEIGHT, WIDTH = 32, 40
# Trials that fail with a probability of 0.01 each have more failures than these once in a thousand (binomial distribution).
TRIALS = [pytest.param(50, 4, id="50"), pytest.param(200, 8, id="200", marks=pytest.mark.exhaustive)]

rows, columns = np.mgrid[:HEIGHT, :WIDTH]
TRUTH = np.stack([0.2 + 0.5 * columns / WIDTH, 0.3 + 0.3 * rows / HEIGHT, np.full((HEIGHT, WIDTH), 0.4)], axis=-1)
# The share of each pixel that lies behind an edge which crosses the picture aslant.
COVER = np.clip((columns - WIDTH / 3 + 0.3 * rows) / 3, 0.0, 1.0)[..., None]


def rounding(allowed):
    """One rounding of each pixel's value; nothing is shifted, nothing stored in short."""
    none = np.zeros((HEIGHT, WIDTH))
    return Allowance(none, none + allowed, none, none)


NO_ROUNDING = rounding(1e-9)


# Each draws the mean of so many samples of every pixel, and the variance of that mean as its samples tell it.


def even(rng, samples):
    """Every sample an exponential variate, each channel for itself."""
    mean = rng.gamma(samples, TRUTH / samples)
    return mean, TRUTH**2 / samples * rng.chisquare(samples - 1, TRUTH.shape) / (samples - 1)


def batched(rng, samples):
    """`even`, but the variance is that of 16 batches of the samples."""
    mean, _ = even(rng, samples)
    return mean, TRUTH**2 / samples * rng.chisquare(15, TRUTH.shape) / 15


def gray(rng, samples):
    """`even`, but all channels have the same noise."""
    mean = rng.gamma(samples, 1.0 / samples, (HEIGHT, WIDTH, 1)) * TRUTH
    return mean, TRUTH**2 / samples * rng.chisquare(samples - 1, (HEIGHT, WIDTH, 1)) / (samples - 1)


def fireflies(rng, samples, chance=2e-5, size=3000.0):
    """`even`, but one sample in fifty thousand is three thousand times as bright."""
    mean, variance = even(rng, samples)
    count = rng.poisson(samples * chance, (HEIGHT, WIDTH, 1))
    return mean + TRUTH * count * size / samples, variance + TRUTH**2 * count * size**2 / samples**2


def rare(rng, samples):
    """A third of the light comes with one sample in five hundred."""
    return fireflies(rng, samples, chance=2e-3, size=300.0)


def edge(rng, samples):
    """Black and white, and nothing between: what an edge makes of samples; most pixels have no noise at all."""
    mean = rng.binomial(samples, COVER) / samples * np.ones(3)
    return mean, mean * (1.0 - mean) / max(samples - 1, 1)


def endless(rng, samples):
    """Pareto's distribution, whose variance is infinite."""
    drawn = rng.pareto(1.5, (samples, HEIGHT, WIDTH, 1)) * TRUTH
    return drawn.mean(axis=0), drawn.var(axis=0) / (samples - 1)


def sides_of(kind, rng, samples, each, seeds, claimed=1.0):
    """The reference at so many samples, the mean of so many pictures with `each` samples; claimed : factor on the variance."""
    reference, variance = kind(rng, samples)
    pictures = np.stack([kind(rng, each)[0] for _ in range(seeds)])
    test = pictures.mean(axis=0)
    test_variance = pictures.var(axis=0, ddof=1) / seeds if seeds > 1 else np.full(TRUTH.shape, np.inf)
    return Sides("Combined", reference, test, claimed * variance, test_variance, np.zeros((HEIGHT, WIDTH), bool))


def run(sides, samples, seeds):
    """The tests, run as by radiance.compare, which takes the reference's variance to be that of batches."""
    return hypothesis_tests.run(sides, NO_ROUNDING, (min(samples, VARIANCE_BATCHES) - 1, max(seeds - 1, 1)), LEVEL)


@pytest.mark.parametrize(
    ("kind", "samples", "each", "seeds", "claimed"),
    [
        pytest.param(even, 256, 32, 8, 1.0, id="variances are right"),
        pytest.param(batched, 256, 32, 8, 1.0, id="the reference's variance is that of 16 batches"),
        pytest.param(gray, 256, 32, 8, 1.0, id="channels share their noise"),
        pytest.param(even, 256, 32, 8, 4.0, id="the reference's variance is told four times too large"),
        pytest.param(even, 256, 128, 2, 1.0, id="two seeds only"),
        pytest.param(even, 256, 256, 1, 1.0, id="one picture, whose noise nobody knows"),
        pytest.param(fireflies, 256, 32, 8, 1.0, id="fireflies"),
        pytest.param(rare, 256, 32, 8, 1.0, id="rare light"),
        pytest.param(edge, 64, 8, 8, 1.0, id="edges at 64 samples"),
        pytest.param(edge, 16, 2, 8, 1.0, id="edges at 16 samples"),
        pytest.param(even, 64, 128, 8, 1.0, id="the test has sixteen times the samples"),
        pytest.param(rare, 4096, 16, 8, 1.0, id="rare light, the reference has 32 times the samples"),
        pytest.param(rare, 64, 512, 8, 1.0, id="rare light, the test has 64 times the samples"),
        pytest.param(endless, 64, 8, 8, 1.0, id="noise of infinite variance"),
    ],
)
@pytest.mark.parametrize(("trials", "most"), TRIALS)
def test_chance_raises_no_more_than_one_false_alarm_in_a_hundred(kind, samples, each, seeds, claimed, trials, most):
    rng = np.random.default_rng(1)
    asked = [run(sides_of(kind, rng, samples, each, seeds, claimed), samples, seeds) for _ in range(trials)]
    alarms = [[test.name for test in trial if not test.ok] for trial in asked]
    count = sum(bool(names) for names in alarms)
    assert count <= most, f"{count} of {trials}: {[names for names in alarms if names]}"


def test_a_variance_told_too_small_is_found_out():
    """The test of the test: where the noise is larger than both sides tell, pixels must fail."""
    rng = np.random.default_rng(3)
    sides = sides_of(even, rng, 256, 32, 8)
    lied = replace(sides, variance=sides.variance / 400, test_variance=sides.test_variance / 400)
    assert not run(lied, 256, 8)[0].ok


# Faults that are found


def visible_bias(sides, limit):
    """The relative bias of the whole picture that is found half of the time: limit · standard error / light."""
    noise = sides.difference[..., 0].std() * np.sqrt(HEIGHT * WIDTH)
    return limit * noise / sides.reference[..., 0].sum()


@pytest.mark.parametrize(("share", "least", "most"), [(0.5, 0.0, 0.1), (1.0, 0.35, 0.65), (1.6, 0.95, 1.0)])
def test_a_bias_of_the_whole_picture_is_found_as_the_formula_says(share, least, most):
    """At the bias b = limit · σ / (√n · mean) the sum lies at the limit in the mean, and half of the time above. The limit is
    some 3.7 standard errors: half the bias lies 1.8 of them below it, 1.6 times the bias 2.2 above."""
    rng, trials, actual = np.random.default_rng(4), 200, 0
    for _ in range(trials):
        sides = sides_of(gray, rng, 256, 32, 8)
        sides = replace(
            sides, **{name: getattr(sides, name)[..., :1] for name in ("reference", "test", "variance", "test_variance")}
        )
        bias = share * visible_bias(sides, run(sides, 256, 8)[-1].limit)
        actual += not run(replace(sides, test=sides.test * (1.0 + bias)), 256, 8)[-1].ok
    # 200 trials: 0.5 ± 0.15 is four standard deviations of the binomial distribution.
    assert least <= actual / trials <= most


def test_two_hundredths_too_bright_are_found_at_256_samples_of_1280_pixels():
    """Noise of 1/16 on either side: the mean is known to √2/16/√1280 = 0.25 %, and the bias is eight times that."""
    rng = np.random.default_rng(5)
    result = [
        not run(replace(s, test=s.test * 1.02), 256, 8)[-1].ok for s in (sides_of(even, rng, 256, 32, 8) for _ in range(20))
    ]
    assert all(result)


@pytest.mark.parametrize("size", hypothesis_tests.SIZES[:3])
def test_a_wrong_tile_is_found_and_named(size):
    """A pixel that is half as bright again, or a tile by ten and by three per cent: beyond the limits of 9, 6 and 5 errors of
    √2/16 of the light, of 1/8 and of 1/32 of that."""
    factor = {1: 2.5, 8: 1.12, 32: 1.03}[size]
    sides = sides_of(gray, np.random.default_rng(6), 256, 32, 8)
    where = (slice(0, max(size, 1)), slice(0, max(size, 1)))
    test = sides.test.copy()
    test[where] *= factor
    test = next(q for q in run(replace(sides, test=test), 256, 8) if q.size == size)
    assert not test.ok
    assert test.worst.columns[0] == 0 and test.worst.rows[0] == 0
    assert test.worst.errors > test.limit
    assert test.failing[0, 0]


STRIPES = np.where(columns // 4 % 2, 0.3, 0.6)[..., None] * np.ones(3)


def striped(rng, blur):
    """Both sides of stripes of four pixels, the test with so much of each pixel in the two beside it; noise of 1/16."""
    blurred = STRIPES + blur * (np.roll(STRIPES, 1, axis=1) + np.roll(STRIPES, -1, axis=1) - 2 * STRIPES)
    reference, test = (truth * (1 + rng.normal(0, 1 / 16, (HEIGHT, WIDTH, 1))) for truth in (STRIPES, blurred))
    variance = (STRIPES / 16) ** 2
    return Sides("Combined", reference, test, variance, variance, np.zeros((HEIGHT, WIDTH), bool))


@pytest.mark.parametrize(("blur", "sign"), [(0.1, -1), (-0.1, 1)])
def test_what_is_softer_or_sharper_is_told_along_contours_where_no_tile_tells_it(blur, sign):
    """A tenth of the contrast is 0.7 of a pixel's noise; half of √500 pixels are at contours: eight standard errors."""
    for seed in range(10):
        asked = {test.name: test for test in run(striped(np.random.default_rng(seed), blur), 256, 8)}
        contours = asked.pop("contours")
        assert not contours.ok and all(test.ok for test in asked.values())
        assert np.sign(contours.worst.errors) == sign and contours.worst.columns == (0, WIDTH - 1)
        assert all(test.ok for test in run(striped(np.random.default_rng(seed), 0.0), 256, 8))


def test_a_pixels_own_noise_is_not_in_its_weight():
    """Else what is noise alone would look softer than its reference: by a standard error for each of √960 pixels, near 30."""
    rng = np.random.default_rng(10)
    result = [run(sides_of(gray, rng, 256, 32, 8), 256, 8)[3].errors[0, 0, 0] for _ in range(100)]
    assert abs(np.mean(result)) < 0.4 and 0.5 < np.std(result) < 1.2  # the mean of 100 draws is off by 0.1, times four
    sides = sides_of(gray, rng, 256, 32, 8)
    assert run(replace(sides, shared=sides.variance), 256, 8)[3].is_open, "neighbors that share noise have no such weights"


def test_a_pixel_without_noise_may_differ_by_rounding_and_by_no_more():
    """20 roundings of 1e-8 are allowed where there is no contrast, and then nothing, since there is no noise."""
    none, reference = np.zeros((HEIGHT, WIDTH, 3)), np.full((HEIGHT, WIDTH, 3), 0.5)
    flat = Sides("Combined", reference, reference + 1.9e-7, none, none, np.zeros((HEIGHT, WIDTH), bool))
    assert hypothesis_tests.run(flat, rounding(1e-8), (255, 7), LEVEL)[0].ok
    assert not hypothesis_tests.run(replace(flat, test=flat.test + 2e-8), rounding(1e-8), (255, 7), LEVEL)[0].ok


def test_a_shift_of_cycles_filter_table_is_allowed_and_one_of_a_tenth_of_a_pixel_is_not():
    """An edge without noise, known to 1e-4: 4.9e-4 px shift it by 4.9e-4 of its contrast, a tenth of a pixel by a tenth."""
    rng = np.random.default_rng(7)
    profile = np.clip((columns - 15.3 + 1.0) / 3.0, 0, 1)[..., None]

    def shifted(by):
        moved = np.clip((columns - by - 15.3 + 1.0) / 3.0, 0, 1)[..., None] + rng.normal(0, 1e-4, profile.shape)
        variances = np.full(profile.shape, 0.5e-8)
        sides = Sides("Combined", profile, moved, variances, variances, np.zeros((HEIGHT, WIDTH), bool))
        return all(test.ok for test in run(sides, 256, 8))

    assert shifted(0.0) and shifted(4.9e-4)
    assert not shifted(0.1) and not shifted(-0.1) and not shifted(0.01)


def test_a_row_of_the_result_is_plain_json():
    entries = [test.to_json() for test in run(sides_of(even, np.random.default_rng(8), 64, 8, 8), 64, 8)]
    assert json.loads(json.dumps(entries)) == [
        {**entry, "worst": {**entry["worst"], **{name: list(entry["worst"][name]) for name in ("columns", "rows")}}}
        for entry in entries
    ]
    assert [entry["name"] for entry in entries] == ["pixels", "tiles of 8 × 8", "tiles of 32 × 32", "contours", "whole picture"]


def test_a_shift_of_the_picture_is_no_excuse_for_a_bias_of_noisy_light():
    """Noise looks like slopes, of a tenth a pixel; a shift by 1e-3 px times them would allow a bias, were they not summed."""
    shift = np.full((HEIGHT, WIDTH), 1e-3)
    allowed = replace(NO_ROUNDING, moved=0.1 * shift, shift=shift)
    sides = sides_of(gray, np.random.default_rng(9), 256, 32, 8)
    right, wrong = (
        hypothesis_tests.run(replace(sides, test=factor * sides.test), allowed, (255, 7), LEVEL) for factor in (1.0, 1.02)
    )
    assert right[-1].errors.all() and right[-1].ok and not wrong[-1].ok


def test_pixels_that_share_their_noise_are_judged_by_that_of_their_samples():
    """Each pixel is the mean of a window: its own noise is a fifth, and that of a tile's sum what it was."""
    rng = np.random.default_rng(8)
    actual = sides_of(even, rng, 64, 1024, 8)
    noise = actual.reference - TRUTH
    for axis in (0, 1):
        noise = sum(np.roll(noise, shift, axis) for shift in range(-2, 3)) / 5.0
    smooth = replace(actual, reference=TRUTH + noise)
    failing = [test.name for test in run(smooth, 64, 8) if not test.ok]
    assert failing, "sums of what is not independent look certain"
    claimed = replace(smooth, shared=actual.variance)
    assert all(test.ok for test in run(claimed, 64, 8)), [test.name for test in run(claimed, 64, 8) if not test.ok]
    assert not all(test.ok for test in run(replace(claimed, test=claimed.test * 1.02), 64, 8)), "2 % is not found"
