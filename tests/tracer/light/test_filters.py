import math

import numpy as np
import pytest
from core_probes import offsets
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.tracer.scene.film import Film

WIDTHS = st.floats(0.01, 10.0)
UNITS = st.integers(0, 2**32 - 1).map(lambda digits: digits / 2**32)


COEFFICIENTS = (0.35875, 0.48829, 0.14128, 0.01168)


def density(x):
    """The Blackman-Harris filter at x, in widths from the centre, −1 to 1; 1 at the centre."""
    a, b, c, d = COEFFICIENTS
    theta = np.pi * (x + 1.0)
    return a - b * np.cos(theta) + c * np.cos(2 * theta) - d * np.cos(3 * theta)


def mass(x):
    """The part of the filter's mass that lies below x."""
    a, b, c, d = COEFFICIENTS
    theta = np.pi * (x + 1.0)
    return (a * theta - b * np.sin(theta) + c / 2 * np.sin(2 * theta) - d / 3 * np.sin(3 * theta)) / (2 * np.pi * a)


def places(u, width=1.0):
    """Where Blackman-Harris puts numbers, in widths from the centre."""
    return (offsets(Film("BLACKMAN_HARRIS", width), np.stack([u, u]))[0] - 0.5) / width


def gaussian_mass(x):
    """The part of GAUSSIAN's mass below x, in parts of its reach: six standard deviations."""
    return np.array([0.5 + math.erf(math.sqrt(18) * each) / (2 * math.erf(math.sqrt(18))) for each in np.ravel(x)])


def gaussian_places(u, width=1.0):
    """Where GAUSSIAN puts numbers, in parts of its reach from the centre."""
    return (offsets(Film("GAUSSIAN", width), np.stack([u, u]))[0] - 0.5) / (1.5 * width)


def cycles_table(reach, density=density):
    """The 1,024 places of intern/cycles/scene/film.cpp, from the pixel's lower left corner, the last of which is left at 0."""
    count, half = 1023, 511
    below = np.concatenate([[0.0], np.cumsum(density(np.arange(count) / (count - 1)))])
    aside = np.interp(np.arange(half + 1) / half, below / below[-1], np.arange(count + 1) / count) * reach
    return np.concatenate([0.5 - aside[::-1], 0.5 + aside[1:], [0.0]])


@given(WIDTHS, UNITS)
def test_a_box_is_one_pixel_wide_whatever_its_width(width, u):
    np.testing.assert_array_equal(offsets(Film("BOX", width), np.array([[u], [0.25]])), [[u], [0.25]])


@given(st.sampled_from(["BLACKMAN_HARRIS", "GAUSSIAN"]), WIDTHS)
def test_the_middle_of_the_numbers_is_the_pixels_centre(shape, width):
    np.testing.assert_array_equal(offsets(Film(shape, width), np.full((2, 1), 0.5)), 0.5)


@given(WIDTHS, UNITS)
def test_blackman_harris_reaches_its_width_to_either_side_and_is_symmetric(width, u):
    place, mirrored = places(np.array([u, 1 - u if u else 1 - 2.0**-53]), width)
    assert abs(place) <= 1 + 1e-12  # half a pixel's last bits over the least width
    assert mirrored == pytest.approx(-place, abs=1e-9)  # at the outermost step 1e-16 of mass are 1e-11 widths


def test_the_mass_is_the_integral_of_the_density_from_0_to_1():
    x = np.linspace(-1, 1, 20001)
    assert mass(np.array([-1.0, 0.0, 1.0])) == pytest.approx([0, 0.5, 1], abs=1e-15)
    middles = (x[1:] + x[:-1]) / 2
    # The mean of the density is its first coefficient; the midpoint rule is off by h² f″/24 < 1e-12 here.
    np.testing.assert_allclose(np.diff(mass(x)), density(middles) / 0.35875 * 0.5e-4, atol=1e-11)


def test_numbers_become_places_up_to_which_the_mass_is_the_number():
    """Exactly at the ends of the steps, the halvings' 64ths; between them by how far a cubic is off."""
    ends = np.ldexp(1 + np.arange(64) / 64, np.arange(16, dtype=np.int32)[:, None] - 17).ravel() - 2.0**-17
    np.testing.assert_allclose(mass(places(ends)), ends, atol=2e-15)
    np.testing.assert_allclose(mass(places(1 - ends[1:])), 1 - ends[1:], atol=2e-15)
    between = np.random.default_rng(1).random(100_000)
    assert np.abs(mass(places(between)) - between).max() < 1.1e-10


def test_places_keep_the_order_of_the_numbers():
    assert (np.diff(places(np.arange(1 << 20) / (1 << 20))) > 0).all()


def test_the_filters_mean_is_the_centre_and_its_variance_is_on_paper():
    """With y = x/f: the integral of y² cos(kπ(y + 1)) over −1 … 1 is 4 / (kπ)² for each cosine, 2/3 for the constant."""
    a, b, c, d = 0.35875, 0.48829, 0.14128, 0.01168
    variance = (a * 2 / 3 + 4 / np.pi**2 * (-b + c / 4 - d / 9)) / (2 * a)
    place = places((np.arange(1 << 22) + 0.5) / (1 << 22))
    assert place.mean() == pytest.approx(0, abs=1e-12)
    assert place.var() == pytest.approx(variance, abs=1e-9)


def test_the_cubics_differ_from_the_filter_by_a_97_000_000th_of_its_mass():
    numbers = np.concatenate([np.arange(1 << 14) * 2.0**-31, np.arange(1 << 5, 1 << 22) * 2.0**-22])
    numbers = numbers[: np.searchsorted(numbers, 0.5, "right")]
    # What is off in each piece, on both sides; half of it is what would have to be moved.
    apart = np.abs(np.diff(mass(places(numbers))) - np.diff(numbers)).sum()
    assert apart < 1.1e-8


@given(WIDTHS, UNITS)
def test_a_gaussian_reaches_one_and_a_half_widths_to_either_side_and_is_symmetric(width, u):
    place, mirrored = gaussian_places(np.array([u, 1 - u if u else 1 - 2.0**-53]), width)
    assert abs(place) <= 1 + 1e-12
    assert mirrored == pytest.approx(-place, abs=1e-7)


def test_a_gaussian_is_cycles_own():
    """exp(−8 (v/f)²), where its mass is on paper; and no other: a hundredth wider is found."""
    ends = np.ldexp(1 + np.arange(64) / 64, np.arange(16, dtype=np.int32)[:, None] - 17).ravel() - 2.0**-17
    x = gaussian_places(ends)
    np.testing.assert_allclose(gaussian_mass(x), ends, atol=2e-15)
    np.testing.assert_allclose(gaussian_mass(gaussian_places(1 - ends[1:])), 1 - ends[1:], atol=2e-15)
    assert np.abs(gaussian_mass(1.01 * x) - ends).max() > 1e-3
    between = np.random.default_rng(1).random(100_000)
    assert np.abs(gaussian_mass(gaussian_places(between)) - between).max() < 1e-7
    places = gaussian_places((np.arange(1 << 20) + 0.5) / (1 << 20), 2.0) * 3.0
    assert places.mean() == pytest.approx(0, abs=1e-12) and places.std() == pytest.approx(0.5, abs=1e-5)


def test_a_gaussians_places_keep_the_order_of_the_numbers():
    numbers = np.concatenate([np.arange(1 << 10) * 2.0**-33, np.arange(1, 1 << 20) * 2.0**-20])
    assert (np.diff(gaussian_places(np.unique(numbers))) > 0).all()


def test_the_cubics_differ_from_a_gaussian_by_a_17_000_000th_of_its_mass():
    numbers = np.unique(np.concatenate([np.arange(1 << 14) * 2.0**-33, np.arange(1 << 19) * 2.0**-20]))
    apart = np.abs(np.diff(gaussian_mass(gaussian_places(numbers))) - np.diff(numbers)).sum()
    assert apart < 6e-8


def test_cycles_table_of_a_gaussian_differs_from_it_by_less_than_is_allowed_for():
    """Judges allow twice the shift of the default one, 9.8e-4 px (hypothesis_tests.py), and 0.0021 of the contrast."""
    table = cycles_table(2.25, lambda x: np.exp(-18 * x * x))
    middles = (table[1:] + table[:-1]) / 2
    assert middles.mean() - 0.5 == pytest.approx((2.25 / 2 - 0.25) / 1023, rel=1e-6)  # 8.6e-4 px
    x = np.linspace(-2.25, 2.25, 20_001)
    low, high = np.minimum(table[1:], table[:-1]) - 0.5, np.maximum(table[1:], table[:-1]) - 0.5
    below = sum(np.clip((x - a) / (b - a), 0, 1) for a, b in zip(low, high, strict=True)) / 1023
    assert np.abs(below - gaussian_mass(x / 2.25)).max() < 1e-3


def test_cycles_table_differs_from_the_filter_by_what_the_module_says():
    table = cycles_table(1.5)
    assert table[511] == 0.5
    assert (table[511] + table[512]) / 2 - 0.5 == pytest.approx(3.505e-4 * 1.5, rel=2e-3)  # its first sample
    middles = (table[1:] + table[:-1]) / 2
    assert middles.mean() - 0.5 == pytest.approx((1.5 / 2 - 0.25) / 1023, rel=1e-6)
    x = np.linspace(-1.5, 1.5, 200_001)
    low, high = np.minimum(table[1:], table[:-1]) - 0.5, np.maximum(table[1:], table[:-1]) - 0.5
    below = sum(np.clip((x - a) / (b - a), 0, 1) for a, b in zip(low, high, strict=True)) / 1023
    assert np.abs(below - mass(x / 1.5)).max() == pytest.approx(5.2e-4, abs=1e-5)  # edges along an axis
