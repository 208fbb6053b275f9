import hashlib

import numpy as np
import pytest
from core_probes import FILM, SCATTERING, Sampler
from hypothesis import given
from hypothesis import strategies as st

pytestmark = pytest.mark.slow

SEEDS = st.integers(0, 2**63)
# The pairs of dimensions of the film, and of each scattering: where on a lamp, and which way.
PAIRS = [0, *(FILM + SCATTERING * scattering + within for scattering in (0, 1, 7) for within in (1, 3))]
ROUNDING = 2.0**-32


def sets(sampler, pixels, samples, first, count):
    """(count, pixels, samples): all the samples of some pixels."""
    pixel, sample = np.repeat(pixels, samples), np.tile(np.arange(samples), len(pixels))
    return sampler.numbers(pixel, sample, first, count).reshape(count, len(pixels), samples)


def stratified(first, second, bits):
    """True if each elementary interval of a pair of (pixels, 2^bits) numbers holds one."""
    for halvings in range(bits + 1):
        cells = np.floor(first * 2**halvings) * 2 ** (bits - halvings) + np.floor(second * 2 ** (bits - halvings))
        if not (np.sort(cells, axis=-1) == np.arange(2**bits)).all():
            return False
    return True


def correlation(first, second):
    """The correlation of uniform numbers, in standard errors from 0."""
    return np.mean((first - 0.5) * (second - 0.5)) * 12 * np.sqrt(first.size)


@given(SEEDS, st.sampled_from(PAIRS), st.integers(0, 2**32 - 5))
def test_each_pair_that_belongs_together_is_stratified_after_any_power_of_two(seed, first, pixel):
    sampler = Sampler(seed, 256)
    x, y = sets(sampler, np.arange(pixel, pixel + 4), 256, first, 2)
    for bits in range(9):
        assert stratified(x[:, : 2**bits], y[:, : 2**bits], bits), f"{2**bits} samples"


def test_any_block_of_a_power_of_two_is_stratified_not_only_the_first():
    x, y = sets(Sampler(5, 1024), np.arange(3), 1024, FILM + 1, 2)
    for start in range(0, 1024, 64):
        assert stratified(x[:, start : start + 64], y[:, start : start + 64], 6)


@pytest.mark.parametrize("first", PAIRS[:3])
def test_samples_beyond_the_65536th_go_on_where_those_before_them_left_off(first):
    x, y = sets(Sampler(1, 1 << 18), np.array([9]), 1 << 18, first, 2)
    assert stratified(x, y, 18)
    few = Sampler(1, 1 << 16).numbers(np.array([9]), 65535, first, 2)
    np.testing.assert_array_equal(few[:, 0], [x[0, 65535], y[0, 65535]])


@given(SEEDS, st.integers(0, 200))
def test_every_dimension_alone_is_stratified(seed, dimension):
    numbers = sets(Sampler(seed, 64), np.arange(5), 64, dimension, 1)[0]
    assert (np.sort(np.floor(numbers * 64), axis=1) == np.arange(64)).all()


def test_any_two_dimensions_of_film_and_first_scattering_are_stratified_together_but_for_a_factor_of_16():
    """Every elementary interval of 2⁻ᵐ⁺⁴ holds 16 of 2ᵐ points: t ≤ 4, for each two of the ten."""
    numbers = sets(Sampler(3, 1024), np.arange(2), 1024, 0, FILM + SCATTERING)
    for a in range(len(numbers)):
        for b in range(a):
            for halvings in range(7):
                cells = np.floor(numbers[a] * 2**halvings) * 2 ** (6 - halvings) + np.floor(numbers[b] * 2 ** (6 - halvings))
                for pixel in cells.astype(int):
                    assert (np.bincount(pixel, minlength=64) == 16).all(), f"dimensions {b} and {a}"


def test_numbers_lie_from_0_to_below_1_and_are_uniform():
    numbers = Sampler(11, 1).numbers(np.arange(1 << 18), 0, 0, 12)
    assert numbers.min() >= 0 and numbers.max() < 1 and numbers.dtype == np.float64
    errors = (numbers.mean(axis=1) - 0.5) * np.sqrt(12 * numbers.shape[1])
    assert np.abs(errors).max() < 4, f"means are {errors} standard errors off"
    # The variance of (u − ½)² is 1/180.
    errors = (((numbers - 0.5) ** 2).mean(axis=1) - 1 / 12) * np.sqrt(180 * numbers.shape[1])
    assert np.abs(errors).max() < 4, f"variances are {errors} standard errors off"
    for row in numbers:
        counts = np.bincount((row * 256).astype(int), minlength=256)
        squares = ((counts - 1024) ** 2 / 1024).sum()
        assert abs(squares - 255) < 4.5 * np.sqrt(2 * 255), f"χ² of 255 degrees of freedom is {squares:.0f}"


@pytest.mark.parametrize(("apart", "sample"), [(1, 0), (1, 37), (2, 1), (1920, 0), (65536, 1)])
def test_pixels_are_independent_of_their_neighbors_and_dimensions_of_one_another(apart, sample):
    pixels = np.arange(1 << 16)
    numbers = Sampler(2, 64).numbers(pixels, sample, 0, 12)
    others = Sampler(2, 64).numbers(pixels + apart, sample, 0, 12)
    for scale in (1, 16):  # the numbers, and what is left of them beyond their first four digits
        values = np.array([[correlation(a * scale % 1, b * scale % 1) for b in others] for a in numbers])
        assert np.abs(values).max() < 4.5, f"correlated by {np.abs(values).max():.1f} standard errors"  # the largest of 144


def test_the_error_of_one_pixel_says_nothing_about_that_of_its_neighbors():
    """Means of 16 samples of a function of the film, over 65,536 pixels: neighbors in a row of 256, and in a column."""
    x, y = sets(Sampler(8, 16), np.arange(65536), 16, 0, 2)
    errors = (x * 0.7 + y * 0.4 < 0.53).mean(axis=1).reshape(256, 256)
    errors = (errors - errors.mean()) / errors.std()
    for shift, axis in ((1, 0), (1, 1), (2, 0), (2, 1)):
        product = (errors * np.roll(errors, shift, axis)).mean() * 256
        assert abs(product) < 4, f"pixels {shift} apart are correlated by {product:.1f} standard errors"


def test_dimensions_of_different_scatterings_are_independent_in_each_pixels_samples():
    """No correlation of the samples of a pixel, over all pixels: padding must not pair the points of two scatterings."""
    pixels, samples = np.arange(1024), 64
    sampler = Sampler(4, samples)
    first = sets(sampler, pixels, samples, FILM, SCATTERING)
    for scattering in (1, 2, 5):
        second = sets(sampler, pixels, samples, FILM + SCATTERING * scattering, SCATTERING)
        for a in first:
            for b in second:
                products = ((a - 0.5) * (b - 0.5)).mean(axis=1) * 12 * np.sqrt(samples)
                # Shuffled halves pair evenly or not: no pixel's correlation is that of equal numbers, and its mean is 0.
                assert abs(products.mean()) * np.sqrt(len(pixels)) < 4.5 * max(products.std(), 1e-9)
                assert np.abs(products).max() < 0.75 * np.sqrt(samples)


@given(SEEDS, SEEDS)
def test_seeds_give_numbers_of_their_own(first, second):
    pixels = np.arange(4096)
    a, b = (Sampler(seed, 4).numbers(pixels, 0, 0, 2) for seed in (first, second))
    if first % 2**32 == second % 2**32:
        np.testing.assert_array_equal(a, b)
    else:
        assert np.abs(a - b).min(axis=0).max() > 0.5
        assert (a == b).mean() < 0.01


def test_a_sample_of_a_pixel_is_the_same_whoever_asks_for_it_and_how():
    """One pixel or many, one sample number or an array of them, alone or with other dimensions, in any order."""
    sampler, pixels = Sampler(7, 100), np.arange(50)
    all_at_once = sampler.numbers(np.tile(pixels, 100), np.repeat(np.arange(100), 50), 0, 20).reshape(20, 100, 50)
    for sample in (99, 0, 63):
        np.testing.assert_array_equal(sampler.numbers(pixels, sample, 0, 20), all_at_once[:, sample])
    np.testing.assert_array_equal(sampler.numbers(pixels[::-1], 5, 13, 2), all_at_once[13:15, 5, ::-1])
    np.testing.assert_array_equal(Sampler(7, 100).numbers(pixels[17:18], 5, 13, 2)[:, 0], all_at_once[13:15, 5, 17])


def test_more_samples_begin_with_those_of_fewer():
    few, many = Sampler(6, 16), Sampler(6, 5000)
    np.testing.assert_array_equal(few.numbers(np.arange(9), 15, 0, 30), many.numbers(np.arange(9), 15, 0, 30))


def test_numbers_are_multiples_of_2_to_the_minus_32():
    numbers = Sampler(0, 8).numbers(np.arange(1000), 3, 0, 10) / ROUNDING
    np.testing.assert_array_equal(numbers, np.floor(numbers))


def test_the_bits_are_the_same_on_every_machine_and_with_every_numpy():
    numbers = [
        sets(Sampler(seed, 64), np.array([0, 1, 2**32 - 1]), 64, first, 9)
        for seed in (0, 1, 2**40)
        for first in (0, FILM + 3 * SCATTERING)
    ]
    digest = hashlib.sha256((np.stack(numbers) / ROUNDING).astype("<u4").tobytes()).hexdigest()
    assert digest == "e50944ad96c3940a817dfe427ae47bf9f8e787a35d3c86b493a25567cafa088b"


def slope(errors, samples):
    return np.polyfit(np.log(samples), np.log(errors), 1)[0]


@pytest.fixture(scope="module")
def errors_of():
    """errors_of(function, dimensions, samples) → RMS error over 512 pixels of the mean of a function whose integral is 0."""

    def measure(function, first, count, samples):
        return [
            np.sqrt(np.mean(function(sets(Sampler(1, most), np.arange(512), most, first, count)).mean(axis=1) ** 2))
            for most in samples
        ]

    return measure


POWERS = [4, 16, 64, 256, 1024]
OTHERS = [5, 23, 91, 363, 1447]


@pytest.mark.parametrize("first", PAIRS[:4])
def test_the_error_of_a_smooth_function_falls_faster_than_any_bound_of_noise(errors_of, first):
    def smooth(u):
        return np.exp(u[0] + u[1]) - (np.e - 1) ** 2

    assert slope(errors_of(smooth, first, 2, POWERS), POWERS) < -1.3  # N^−3/2 but for a logarithm
    assert slope(errors_of(smooth, first, 2, OTHERS), OTHERS) < -0.9  # the last points lack partners: N^−1


@pytest.mark.parametrize("first", PAIRS[:4])
@pytest.mark.parametrize("samples", [POWERS, OTHERS])
def test_the_error_of_an_edge_falls_as_the_three_quarters_power(errors_of, first, samples):
    def edge(u):  # 0.53 = 0.7 x + 0.4 y covers 0.47143 of the square
        area = (0.53 / 0.7 + (0.53 - 0.4) / 0.7) / 2
        return (0.7 * u[0] + 0.4 * u[1] < 0.53) - area

    assert slope(errors_of(edge, first, 2, samples), samples) < -0.7  # −0.75, with the slope's own error over 512 pixels


def test_these_tests_find_white_noise_equal_pixels_and_points_that_lack_their_partners():
    rng = np.random.default_rng(1)
    noise, (x, y) = rng.random((2, 8, 256)), sets(Sampler(1, 256), np.arange(8), 256, 0, 2)
    assert not stratified(*noise, 8)
    assert not stratified(x, y[:, rng.permutation(256)], 8), "each dimension alone is stratified, the pair is not"
    assert abs(correlation(x, x)) > 4.5 and abs(correlation(x, 1 - x)) > 4.5
    assert abs(correlation(x, (x + 2.0**-8) % 1)) > 4.5
    errors = [np.sqrt(np.mean((rng.random((512, most)) - 0.5).mean(axis=1) ** 2)) for most in POWERS]
    assert slope(errors, POWERS) > -0.6


def test_the_error_of_film_and_lamp_together_falls_faster_than_noise(errors_of):
    """Padding from the start can't do it: a product of both is as smooth as each."""

    def product(u):
        return np.exp(u[0] * u[3]) * (1 + u[1] * u[4]) - expected

    # ∫∫ exp(x u) = Ei(1) − γ; ∫∫ 1 + y v = 5/4.
    expected = 1.3179021514544038 * 1.25
    assert slope(errors_of(product, 0, 5, POWERS), POWERS) < -0.8
