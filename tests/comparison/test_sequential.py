"""A comparison in rounds raises no more false alarms than one look does, finds what it says it finds, and throws nothing away.

Two sides of the same light are drawn round after round, with the noise that renderers have, many times over.
"""

import numpy as np
import pytest

from viewcam_addon.comparison import radiance, sequential
from viewcam_addon.comparison.hypothesis_tests import POWER
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole

WIDTH, HEIGHT, SEEDS = 40, 32, 8
PINHOLE = Pinhole((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), 40.0, WIDTH, HEIGHT)
rows, columns = np.mgrid[:HEIGHT, :WIDTH]
TRUTH = np.stack([0.2 + 0.5 * columns / WIDTH, 0.3 + 0.3 * rows / HEIGHT, np.full((HEIGHT, WIDTH), 0.4)], axis=-1)
DEPTH = np.full((HEIGHT, WIDTH, 1), 5.0, np.float32)


def exponential(rng, samples):
    """The mean of exponential variates, and its variance as 16 batches tell it."""
    return rng.gamma(samples, 1.0 / samples, (HEIGHT, WIDTH, 3)), rng.chisquare(15, (HEIGHT, WIDTH, 3)) / 15 / samples


def rare(rng, samples):
    """`exponential`, and a third of the light comes with one sample in five hundred."""
    mean, variance = exponential(rng, samples)
    count = rng.poisson(samples / 500, (HEIGHT, WIDTH, 1))
    return (mean + count * 250 / samples) / 1.5, (variance + count * (250 / samples) ** 2) / 2.25


def picture(rng, kind, samples, truth=TRUTH, attribute="samples"):
    mean, variance = kind(rng, samples)
    passes = {"Combined": np.concatenate([mean * truth, np.ones((HEIGHT, WIDTH, 1))], axis=-1), "Depth": DEPTH}
    passes["Variance"] = variance * truth**2
    return Image({name: values.astype(np.float32) for name, values in passes.items()}, PINHOLE, {attribute: str(samples)})


def searched(rng, find, kind=exponential, truth=TRUTH):
    """The comparison of a picture of `truth`, in rounds until it is decided."""
    rounds, total = sequential.Rounds(), sequential.TOTALS[0]
    while total:
        samples = total - rounds.samples
        tests = [picture(rng, kind, samples // SEEDS, truth, "cycles.ViewLayer.samples") for _ in range(SEEDS)]
        rounds.add(samples, picture(rng, kind, samples), tests, None)
        pictures = rounds.reference, rounds.tests, PINHOLE, rounds.samples // SEEDS
        compared = radiance.compare_quantities(*pictures, false_alarms=sequential.FALSE_ALARMS_OF_EACH)
        search = sequential.search(Compared(compared), find, rounds)
        if search.is_decided:
            return Compared(compared).passed, search
        total = search.following
    raise AssertionError("unreachable: the last round decides")


class Compared:
    """The part of a RadianceComparison that decides, without what an eye sees, which takes most of the time."""

    def __init__(self, compared):
        self.rows, self.is_noisy = compared.rows, compared.is_noisy
        self.passed = all(row.ok for row in compared.rows)


# Trials that fail with a probability of 0.01 each have more failures than these once in a thousand (binomial distribution).
TRIALS = [
    pytest.param(15, 2, id="15", marks=pytest.mark.slow),
    pytest.param(200, 8, id="200", marks=pytest.mark.exhaustive),
]


@pytest.mark.parametrize(("trials", "most"), TRIALS)
@pytest.mark.parametrize(("kind", "find"), [(exponential, 0.01), (rare, 0.05)])
def test_pictures_of_the_same_light_are_called_different_once_in_a_hundred_searches_at_most(kind, find, trials, most):
    alarms = sum(not searched(np.random.default_rng((seed, 1)), find, kind)[0] for seed in range(trials))
    assert alarms <= most, f"{alarms} of {trials}"


@pytest.mark.slow
def test_a_bias_of_the_wanted_size_is_found_with_the_power_that_is_promised():
    trials, find = 60, 0.03
    missed = sum(searched(np.random.default_rng((seed, 2)), find, truth=(1.0 + find) * TRUTH)[0] for seed in range(trials))
    # More than four of 60 are missed once in three thousand times, if each is with a probability of 0.01.
    assert missed <= 4, f"{missed} of {trials} missed, of {100 * (1 - POWER):.0f} in a hundred promised"


def test_what_differs_by_much_is_found_in_the_first_round_and_what_differs_by_little_later():
    by_much, by_little = (searched(np.random.default_rng(3), 0.005, truth=factor * TRUTH) for factor in (1.2, 1.012))
    assert not by_much[0] and by_much[1].samples == sequential.TOTALS[0]
    assert not by_little[0] and sequential.TOTALS[0] < by_little[1].samples


def test_the_wanted_bias_is_findable_in_the_end_and_was_not_a_round_before():
    passed, search = searched(np.random.default_rng(4), 0.01)
    assert passed and 0.005 < search.least <= min(0.01, search.least_in_blocks)
    # Fewer than 1.28 / 0.01 samples decide nothing, and no round ends with them.
    assert search.samples in sequential.TOTALS and search.rounds == sequential.TOTALS.index(search.samples)


def test_all_looks_together_may_raise_the_false_alarms_that_one_is_promised():
    spent = sequential.FALSE_ALARMS_OF_EACH * len(sequential.TOTALS)
    assert spent == pytest.approx(sequential.FALSE_ALARMS, rel=1e-12)


def test_the_pictures_of_all_rounds_are_the_means_of_all_samples():
    rng, rounds = np.random.default_rng(5), sequential.Rounds()
    parts = [(samples, picture(rng, exponential, samples)) for samples in (16, 16, 32)]
    for number, (samples, part) in enumerate(parts):
        rounds.add(samples, part, [part], None)
        assert rounds.count == number + 1
    for name, power in (("Combined", 1), ("Variance", 2)):
        expected = sum((samples / 64) ** power * part[name].astype(float) for samples, part in parts)
        assert np.allclose(rounds.reference[name], expected, rtol=4 * 2.0**-24, atol=0), name
    assert rounds.reference.attributes["samples"] == "64" and rounds.tests[0].attributes["samples"] == "64"


def test_light_that_is_stored_over_its_color_is_pooled_as_light():
    rng, rounds = np.random.default_rng(6), sequential.Rounds()
    shape, light = (HEIGHT, WIDTH, 3), 0.0
    for share in (0.5, 0.5):
        color = rng.integers(0, 4, shape) / 4.0
        passes = {"Diffuse Color": color, "Diffuse Direct": rng.random(shape), "Combined": np.ones((HEIGHT, WIDTH, 4))}
        light = light + share * color * passes["Diffuse Direct"]
        image = Image({name: values.astype(np.float32) for name, values in passes.items()}, PINHOLE)
        rounds.add(16, image, [image], image)
    for pooled in (rounds.reference, rounds.tests[0], rounds.everything):
        assert np.allclose(pooled["Diffuse Direct"] * pooled["Diffuse Color"], light, rtol=1e-6, atol=1e-7)


def test_a_bias_that_takes_more_samples_than_there_are_rounds_for_is_given_up_as_soon_as_that_is_seen():
    passed, search = searched(np.random.default_rng(7), 1e-5)
    assert passed and not search.reached and search.samples == 64 and search.expected > sequential.TOTALS[-1]


def test_pictures_without_noise_need_no_more_than_a_check_takes_by_default():
    def quiet(_, __):
        return np.ones((HEIGHT, WIDTH, 3)), np.zeros((HEIGHT, WIDTH, 3))

    passed, search = searched(np.random.default_rng(8), 1e-4, quiet)
    assert passed and (search.samples, search.least) == (64, 0.0)
