import itertools
import math

import numpy as np
import pytest
from core_probes import looked_up, offsets
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import Mesh, Object, Scene
from viewcam_addon.tracer.scene.colors import RGBE
from viewcam_addon.tracer.scene.film import Film
from viewcam_addon.tracer.scene.materials import PLAIN_COLOR, Color, Picture, sum_of

CAMERA = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 10, 8, 8)
SEEDS = st.integers(0, 2**32 - 1)
COUNTS = st.integers(1, 9)
BLENDED = 4e-7  # some roundings of float32, in pixels up to 3
RED, GREEN = Color((0.8, 0.0, 0.0)), Color((0.0, 0.5, 0.0))


def gray(values):
    """A linear image of these values in each channel, rows from the bottom."""
    return Picture(np.repeat(np.array(values, np.float32)[:, :, None], 3, axis=2))


def at(u, v):
    return np.array(np.broadcast_arrays(*np.atleast_1d(u, v)), np.float64)


def decoded(codes):
    """sRGB values as light."""
    picture = Picture(np.repeat(np.float32(codes)[None, :, None], 3, axis=2), srgb=True)
    return looked_up(picture, at((np.arange(len(codes)) + 0.5) / len(codes), 0.5), True)[0]


@given(SEEDS, COUNTS, COUNTS, st.booleans())
def test_at_the_centers_of_pixels_an_image_shows_its_pixels_however_far_it_repeats(seed, width, height, closest):
    rng = np.random.default_rng(seed)
    picture = Picture(rng.random((height, width, 3)).astype(np.float32))
    row, column = np.mgrid[:height, :width].reshape(2, -1)
    away = rng.integers(-3, 4, (2, 1))
    uv = np.array([(column + 0.5) / width, (row + 0.5) / height]) + away
    expected = picture.pixels[row, column].T
    np.testing.assert_allclose(looked_up(picture, uv, closest), expected, atol=BLENDED)


def test_rows_count_from_the_bottom_and_columns_from_the_left():
    picture = gray([[0.1, 0.2], [0.3, 0.4]])
    hits = looked_up(picture, at([0.1, 0.9, 0.1, 0.9], [0.1, 0.1, 0.9, 0.9]), closest=True)
    np.testing.assert_allclose(hits[0], [0.1, 0.2, 0.3, 0.4], atol=1e-7)


def test_a_ramp_of_four_pixels_is_straight_between_their_centers_and_falls_back_over_the_border():
    picture = gray([[0.0, 1.0, 2.0, 3.0]])
    u = np.array([1, 2, 3, 4, 5, 6, 7]) / 8
    np.testing.assert_allclose(looked_up(picture, at(u, 0 * u), False)[1], [0, 0.5, 1, 1.5, 2, 2.5, 3], atol=BLENDED)
    # From the last center, 7/8, to the first of the next repetition, 9/8, it falls from 3 to 0.
    np.testing.assert_allclose(looked_up(picture, at([15 / 16, 1.0, -15 / 16], 0.5), False)[1], [2.25, 1.5, 0.75], atol=BLENDED)


def test_between_four_pixels_of_a_checkerboard_an_image_is_their_mean():
    picture = gray([[0.0, 1.0], [1.0, 0.0]])
    np.testing.assert_allclose(looked_up(picture, at([0.5, 0.0, 0.5], [0.5, 0.0, 0.0]), False), 0.5, atol=BLENDED)


def test_the_closest_pixel_changes_half_way_between_centers():
    picture = gray([[0.0, 1.0]])
    colors = looked_up(picture, at([0.499999, 0.5, 0.999999, 1.0, -1e-9, -1e-20], 0.5), True)[0]
    np.testing.assert_array_equal(colors, [0, 1, 1, 0, 1, 1])


def stood_for(pixels):
    """float32: a share is rounded as Blender and Cycles round it, times the rounded 255th; all else is exact."""
    if pixels.dtype == np.float16:
        return pixels.astype(np.float32)
    if pixels.dtype == RGBE:
        red, green, blue, exponent = (pixels[..., 0] >> np.uint32(8 * place) & np.uint32(255) for place in range(4))
        return (np.stack([red, green, blue], axis=-1) * 2.0 ** (exponent[..., None] - 136.0)).astype(np.float32)
    return pixels.astype(np.float32) * (np.float32(1) / np.float32({1: 255, 2: 65535}[pixels.itemsize]))


def random_pixels(dtype, channels):
    rng = np.random.default_rng(3)
    if dtype == RGBE:  # up to 255, and down to what half floats can't hold
        return rng.integers(0, 2**24, (5, 7, 1), dtype) | (rng.integers(90, 136, (5, 7, 1), dtype, endpoint=True) << 24)
    if dtype == np.float16:
        return rng.normal(0.5, 1.0, (5, 7, channels)).astype(np.float16)
    return rng.integers(0, np.iinfo(dtype).max, (5, 7, channels), dtype, endpoint=True)


@pytest.mark.parametrize("srgb", [False, True])
@pytest.mark.parametrize(("dtype", "channels"), [(RGBE, 3), *itertools.product([np.uint8, np.uint16, np.float16], [3, 4])])
def test_an_image_of_small_numbers_shows_the_bits_that_its_floats_show(dtype, srgb, channels):
    pixels = random_pixels(dtype, channels)
    floats = stood_for(pixels)
    uv = np.random.default_rng(4).uniform(-2, 2, (2, 500))
    small, large, other = Picture(pixels, srgb), Picture(floats, srgb), Picture(np.nextafter(floats, 9), srgb)
    assert small.pixels.dtype == dtype and small.values.tobytes() == floats.tobytes()
    for closest in (False, True):
        hits, expected, beside = (looked_up(each, uv, closest).tobytes() for each in (small, large, other))
        assert hits == expected
        if not (srgb and channels == 4):  # which are multiplied in whole bytes
            assert hits != beside, "a rounding is seen"


def test_each_byte_pair_of_bytes_and_half_float_is_the_number_that_it_stands_for():
    bits = np.arange(65536, dtype=np.uint16)
    halves = bits.view(np.float16)
    for each, expected in (
        (np.arange(256, dtype=np.uint8), np.arange(256) / 255),
        (bits, bits / 65535),
        (halves[np.isfinite(halves)], halves[np.isfinite(halves)]),
    ):
        picture = Picture(np.repeat(each[None, :, None], 3, axis=2))
        hits = looked_up(picture, at((np.arange(len(each)) + 0.5) / len(each), 0.5), closest=True)[2]
        np.testing.assert_array_equal(hits, picture.values[0, :, 2])
        np.testing.assert_allclose(hits, np.float64(expected), rtol=0 if each.dtype == np.float16 else 2.0**-23)


@given(st.integers(0, 2**24 - 1), st.integers(0, 187))
def test_whatever_radiances_files_can_say_is_kept_in_four_bytes_and_shown_to_the_bit(colors, exponent):
    """187: colors up to the most that light can have."""
    written = Picture(np.full((1, 1, 1), colors | exponent << 24, RGBE))
    kept = Picture.compact(np.concatenate([written.values, np.full((1, 1, 3), 2.0**-100, np.float32)]))
    assert kept.pixels.dtype == RGBE
    hits = np.array([looked_up(picture, at(0.5, 0.25), closest=True)[:, 0] for picture in (written, kept)])
    np.testing.assert_array_equal(hits, 2 * [stood_for(written.pixels)[0, 0].astype(np.float64)])
    assert colors == 0 or (hits[0] != stood_for(written.pixels + np.uint32(1 << 24))[0, 0]).any(), "an exponent is seen"


@pytest.mark.parametrize("value", [-1.0, 257.0, np.nextafter(np.float32(1), np.float32(2)), 2.0**-137, 2.0**-149])
def test_a_color_that_needs_a_sign_or_more_than_its_byte_is_not_kept_in_four(value):
    values = np.array([[[2.0**-100, 0, 0], [1.0, 1.0, value]]], np.float32)
    assert Picture.compact(values).pixels.dtype != RGBE
    assert Picture.compact(values[:, :1]).pixels.dtype == RGBE


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, RGBE])
def test_floats_are_kept_in_the_fewest_bytes_that_hold_each_of_them_to_the_bit(dtype):
    floats = Picture(random_pixels(dtype, 3)).values
    assert Picture.compact(floats).pixels.dtype == dtype
    assert Picture.compact(floats).values.tobytes() == floats.tobytes()
    beside = floats.copy()
    beside[-1, -1, -1] = np.nextafter(np.abs(beside[-1, -1, -1]) + np.float32(2.0**-20), np.float32(9))
    kept = Picture.compact(beside)
    assert kept.pixels.dtype == np.float32 and kept.pixels.tobytes() == beside.tobytes()


def test_what_a_half_float_or_a_byte_cannot_hold_stays_a_float():
    for value in (65520.0, 257 * 2.0**-33, 1e18, -0.1, 0.3, np.nextafter(np.float32(1), np.float32(2))):
        floats = np.full((2, 2, 3), value, np.float32)
        assert Picture.compact(floats).pixels.dtype == np.float32
    assert Picture.compact(np.full((2, 2, 3), -0.0, np.float32)).pixels.dtype == np.float16, "a byte has no sign"


def test_numbers_of_other_types_are_floats():
    for dtype in (np.float64, np.int64, ">f4"):
        picture = Picture(np.full((1, 2, 3), 2, dtype))
        assert picture.pixels.dtype == np.float32 and (picture.pixels == 2).all()
    assert (Picture(np.full((1, 2, 3), 257, ">u2")).pixels == np.full((1, 2, 3), 257, np.uint16)).all()
    assert Picture(np.full((1, 2, 3), 257, np.uint32)).pixels.dtype == np.float32, "RGBE are one number a pixel"
    assert (
        Picture(np.full((1, 2, 1), 1 << 24, ">u4")).values.max() == 0 and Picture(np.full((1, 2, 1), 1, ">u4")).values.max() > 0
    )


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, -np.nan])
def test_an_image_with_a_number_that_is_not_finite_is_refused(dtype, value):
    for rest in (-1.0, 1.0):
        pixels = np.full((1, 2, 3), rest, dtype)
        Picture(pixels)
        with np.errstate(invalid="ignore"):
            pixels[0, 0, 1] = value
        with pytest.raises(InputError, match="not finite"):
            Picture(pixels)


@given(SEEDS, COUNTS, COUNTS)
def test_an_interpolated_image_is_continuous_and_stays_between_its_pixels(seed, width, height):
    rng = np.random.default_rng(seed)
    picture = Picture(rng.random((height, width, 3)).astype(np.float32))
    uv = rng.uniform(-2, 2, (2, 100))
    here, beside = (looked_up(picture, place, False) for place in (uv, uv + 1e-9))
    assert np.abs(here - beside).max() < 1e-6
    assert here.min() >= picture.pixels.min() - BLENDED and here.max() <= picture.pixels.max() + BLENDED


def test_srgb_is_decoded_after_pixels_are_blended():
    """Half-way between 0 and 1 is the sRGB value ½, 0.2140; blending light would give ½."""
    pixels = gray([[0.0, 1.0]]).pixels
    colors = looked_up(Picture(pixels, srgb=True), at([0.25, 0.5, 0.75], 0.5), False)[0]
    np.testing.assert_allclose(colors, [0, 0.21404114, 1], atol=1e-7)
    assert looked_up(Picture(pixels), at(0.5, 0.5), False)[0, 0] == 0.5


def test_srgb_is_the_standards_curve_to_float32s_rounding():
    """At sRGB 8-bit values: 188 is nearly half the light; the two pieces meet at 0.04045."""
    codes = np.arange(256) / 255
    exact = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(decoded(codes), exact, rtol=6e-7)
    assert decoded(np.array([188 / 255]))[0] == pytest.approx(0.50289, abs=1e-5)
    below, above = decoded(np.array([0.0404499, 0.0404501]))
    assert above - below == pytest.approx(0, abs=1e-7)


def test_colors_that_are_not_finite_nowhere_come_from_uv_that_is_not():
    picture = gray([[0.25, 1.0], [1.0, 1.0]])
    uv = at([np.nan, np.inf, -np.inf, 1e30, -1e300], [0.3, np.nan, 0.3, 1e30, 0.25])
    for closest in (False, True):
        hits = looked_up(picture, uv, closest)
        assert np.isfinite(hits).all() and hits.min() >= 0.25


def pixels_of(*materials, pass_name="Diffuse Color", images=None, uv=None, vertex_colors=None):
    """(3,) of each material, None being none: what a pass shows at a triangle of it, with one UV and one color all over."""
    triangle = Mesh(
        np.array([[-9.0, -9, 0], [9, -9, 0], [0, 9, 0]]),
        np.array([[0, 1, 2]], np.int32),
        np.zeros(1, np.int32),
        corner_uvs=None if uv is None else np.full((1, 3, 2), uv, np.float32),
        corner_colors=None if vertex_colors is None else np.full((1, 3, 3), vertex_colors, np.float32),
    )
    result = []
    for number, material in enumerate(materials):
        names = ("",) if material is None else (f"material {number}",)
        table = {f"material {k}": each for k, each in enumerate(materials) if each is not None}
        placed = Object("triangle", "mesh", np.eye(4), materials=names)
        scene = Scene(CAMERA, {"mesh": triangle}, (placed,), materials=table, images=images or {})
        result.append(render(scene, "direct", 1, threads=1)[pass_name][4, 4])
    return np.array(result)


def test_each_surface_has_the_color_of_its_material_and_black_where_its_material_has_none():
    materials = None, sum_of(diffuse=RED), sum_of(emission=GREEN)
    np.testing.assert_allclose(pixels_of(*materials), [PLAIN_COLOR.rgb, RED.rgb, (0, 0, 0)], rtol=1e-7)
    np.testing.assert_allclose(pixels_of(*materials, pass_name="Emission"), [(0, 0, 0), (0, 0, 0), GREEN.rgb], rtol=1e-7)


def test_images_and_vertex_colors_multiply_the_color_where_their_material_is_and_nowhere_else():
    images = {"ramp": gray([[0.5, 0.25]])}
    textured = sum_of(diffuse=Color((1.0, 0.5, 0.0), image="ramp", closest=True, vertex=True))
    of_red = sum_of(diffuse=RED)
    for u, expected in ((0.1, (0.5, 0.125, 0)), (0.9, (0.25, 0.0625, 0))):
        actual = pixels_of(textured, of_red, images=images, uv=(u, 0.5), vertex_colors=(1.0, 0.5, 0.25))
        np.testing.assert_allclose(actual, [expected, RED.rgb], rtol=1e-6)


# --- Filters


WIDTHS = st.floats(0.01, 10.0)
UNITS = st.integers(0, 2**32 - 1).map(lambda digits: digits / 2**32)


COEFFICIENTS = (0.35875, 0.48829, 0.14128, 0.01168)


def density(x):
    """The Blackman-Harris filter at x, in widths from the center, −1 to 1; 1 at the center."""
    a, b, c, d = COEFFICIENTS
    theta = np.pi * (x + 1.0)
    return a - b * np.cos(theta) + c * np.cos(2 * theta) - d * np.cos(3 * theta)


def mass(x):
    """The part of the filter's mass that lies below x."""
    a, b, c, d = COEFFICIENTS
    theta = np.pi * (x + 1.0)
    return (a * theta - b * np.sin(theta) + c / 2 * np.sin(2 * theta) - d / 3 * np.sin(3 * theta)) / (2 * np.pi * a)


def places(u, width=1.0):
    """The places of numbers under Blackman-Harris, in widths from the center."""
    return (offsets(Film("BLACKMAN_HARRIS", width), np.stack([u, u]))[0] - 0.5) / width


def gaussian_mass(x):
    """The part of GAUSSIAN's mass below x, in parts of its reach: six standard deviations."""
    return np.array([0.5 + math.erf(math.sqrt(18) * each) / (2 * math.erf(math.sqrt(18))) for each in np.ravel(x)])


def gaussian_places(u, width=1.0):
    """The places of numbers under GAUSSIAN, in parts of its reach from the center."""
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
def test_the_middle_of_the_numbers_is_the_pixels_center(shape, width):
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


def test_the_filters_mean_is_the_center_and_its_variance_is_on_paper():
    """With y = x/f: the integral of y² cos(kπ(y + 1)) over −1 … 1 is 4 / (kπ)² for each cosine, 2/3 for the constant."""
    a, b, c, d = 0.35875, 0.48829, 0.14128, 0.01168
    variance = (a * 2 / 3 + 4 / np.pi**2 * (-b + c / 4 - d / 9)) / (2 * a)
    place = places((np.arange(1 << 22) + 0.5) / (1 << 22))
    assert place.mean() == pytest.approx(0, abs=1e-12)
    assert place.var() == pytest.approx(variance, abs=1e-9)


def test_the_cubics_differ_from_the_filter_by_a_97_000_000th_of_its_mass():
    numbers = np.concatenate([np.arange(1 << 14) * 2.0**-31, np.arange(1 << 5, 1 << 22) * 2.0**-22])
    numbers = numbers[: np.searchsorted(numbers, 0.5, "right")]
    # The error of each piece, on both sides; half of it is what would have to be moved.
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
