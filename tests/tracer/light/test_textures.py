import itertools

import numpy as np
import pytest
from core_probes import looked_up
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import Mesh, Object, Scene
from viewcam_addon.tracer.scene.colours import RGBE
from viewcam_addon.tracer.scene.materials import PLAIN, Colour, Material, Picture

CAMERA = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 10, 8, 8)
SEEDS = st.integers(0, 2**32 - 1)
COUNTS = st.integers(1, 9)
BLENDED = 4e-7  # of pixels up to 3: some roundings of float32
RED, GREEN = Colour((0.8, 0.0, 0.0)), Colour((0.0, 0.5, 0.0))


def grey(values):
    """A linear image of these values in each channel, rows from the bottom."""
    return Picture(np.repeat(np.array(values, np.float32)[:, :, None], 3, axis=2))


def at(u, v):
    return np.array(np.broadcast_arrays(*np.atleast_1d(u, v)), np.float64)


def decoded(codes):
    """sRGB values as light."""
    picture = Picture(np.repeat(np.float32(codes)[None, :, None], 3, axis=2), srgb=True)
    return looked_up(picture, at((np.arange(len(codes)) + 0.5) / len(codes), 0.5), True)[0]


@given(SEEDS, COUNTS, COUNTS, st.booleans())
def test_at_the_centres_of_pixels_an_image_shows_its_pixels_however_far_it_repeats(seed, width, height, closest):
    rng = np.random.default_rng(seed)
    picture = Picture(rng.random((height, width, 3)).astype(np.float32))
    row, column = np.mgrid[:height, :width].reshape(2, -1)
    away = rng.integers(-3, 4, (2, 1))
    uv = np.array([(column + 0.5) / width, (row + 0.5) / height]) + away
    expected = picture.pixels[row, column].T
    np.testing.assert_allclose(looked_up(picture, uv, closest), expected, atol=BLENDED)


def test_rows_count_from_the_bottom_and_columns_from_the_left():
    picture = grey([[0.1, 0.2], [0.3, 0.4]])
    found = looked_up(picture, at([0.1, 0.9, 0.1, 0.9], [0.1, 0.1, 0.9, 0.9]), closest=True)
    np.testing.assert_allclose(found[0], [0.1, 0.2, 0.3, 0.4], atol=1e-7)


def test_a_ramp_of_four_pixels_is_straight_between_their_centres_and_falls_back_over_the_border():
    picture = grey([[0.0, 1.0, 2.0, 3.0]])
    u = np.array([1, 2, 3, 4, 5, 6, 7]) / 8
    np.testing.assert_allclose(looked_up(picture, at(u, 0 * u), False)[1], [0, 0.5, 1, 1.5, 2, 2.5, 3], atol=BLENDED)
    # From the last centre, 7/8, to the first of the next repetition, 9/8, it falls from 3 to 0.
    np.testing.assert_allclose(looked_up(picture, at([15 / 16, 1.0, -15 / 16], 0.5), False)[1], [2.25, 1.5, 0.75], atol=BLENDED)


def test_between_four_pixels_of_a_checkerboard_an_image_is_their_mean():
    picture = grey([[0.0, 1.0], [1.0, 0.0]])
    np.testing.assert_allclose(looked_up(picture, at([0.5, 0.0, 0.5], [0.5, 0.0, 0.0]), False), 0.5, atol=BLENDED)


def test_the_closest_pixel_changes_half_way_between_centres():
    picture = grey([[0.0, 1.0]])
    found = looked_up(picture, at([0.499999, 0.5, 0.999999, 1.0, -1e-9, -1e-20], 0.5), True)[0]
    np.testing.assert_array_equal(found, [0, 1, 1, 0, 1, 1])


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
        found, expected, beside = (looked_up(each, uv, closest).tobytes() for each in (small, large, other))
        assert found == expected
        if not (srgb and channels == 4):  # which are multiplied in whole bytes
            assert found != beside, "a rounding is seen"


def test_each_byte_pair_of_bytes_and_half_float_is_the_number_that_it_stands_for():
    bits = np.arange(65536, dtype=np.uint16)
    halves = bits.view(np.float16)
    for each, expected in (
        (np.arange(256, dtype=np.uint8), np.arange(256) / 255),
        (bits, bits / 65535),
        (halves[np.isfinite(halves)], halves[np.isfinite(halves)]),
    ):
        picture = Picture(np.repeat(each[None, :, None], 3, axis=2))
        found = looked_up(picture, at((np.arange(len(each)) + 0.5) / len(each), 0.5), closest=True)[2]
        np.testing.assert_array_equal(found, picture.values[0, :, 2])
        np.testing.assert_allclose(found, np.float64(expected), rtol=0 if each.dtype == np.float16 else 2.0**-23)


@given(st.integers(0, 2**24 - 1), st.integers(0, 187))
def test_whatever_radiances_files_can_say_is_kept_in_four_bytes_and_shown_to_the_bit(colours, exponent):
    """187: colours up to the most that light can have."""
    written = Picture(np.full((1, 1, 1), colours | exponent << 24, RGBE))
    kept = Picture.compact(np.concatenate([written.values, np.full((1, 1, 3), 2.0**-100, np.float32)]))
    assert kept.pixels.dtype == RGBE
    found = np.array([looked_up(picture, at(0.5, 0.25), closest=True)[:, 0] for picture in (written, kept)])
    np.testing.assert_array_equal(found, 2 * [stood_for(written.pixels)[0, 0].astype(np.float64)])
    assert colours == 0 or (found[0] != stood_for(written.pixels + np.uint32(1 << 24))[0, 0]).any(), "an exponent is seen"


@pytest.mark.parametrize("value", [-1.0, 257.0, np.nextafter(np.float32(1), np.float32(2)), 2.0**-137, 2.0**-149])
def test_a_colour_that_needs_a_sign_or_more_than_its_byte_is_not_kept_in_four(value):
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
    pixels = grey([[0.0, 1.0]]).pixels
    found = looked_up(Picture(pixels, srgb=True), at([0.25, 0.5, 0.75], 0.5), False)[0]
    np.testing.assert_allclose(found, [0, 0.21404114, 1], atol=1e-7)
    assert looked_up(Picture(pixels), at(0.5, 0.5), False)[0, 0] == 0.5


def test_srgb_is_the_standards_curve_to_float32s_rounding():
    """At sRGB 8-bit values: 188 is nearly half the light; the two pieces meet at 0.04045."""
    codes = np.arange(256) / 255
    exact = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(decoded(codes), exact, rtol=6e-7)
    assert decoded(np.array([188 / 255]))[0] == pytest.approx(0.50289, abs=1e-5)
    below, above = decoded(np.array([0.0404499, 0.0404501]))
    assert above - below == pytest.approx(0, abs=1e-7)


def test_colours_that_are_not_finite_nowhere_come_from_uv_that_is_not():
    picture = grey([[0.25, 1.0], [1.0, 1.0]])
    uv = at([np.nan, np.inf, -np.inf, 1e30, -1e300], [0.3, np.nan, 0.3, 1e30, 0.25])
    for closest in (False, True):
        found = looked_up(picture, uv, closest)
        assert np.isfinite(found).all() and found.min() >= 0.25


def shown(*materials, pass_name="Diffuse Color", images=None, uv=None, vertex_colours=None):
    """(3,) of each material, None being none: what a pass shows at a triangle of it, with one UV and one colour all over."""
    triangle = Mesh(
        np.array([[-9.0, -9, 0], [9, -9, 0], [0, 9, 0]]),
        np.array([[0, 1, 2]], np.int32),
        np.zeros(1, np.int32),
        corner_uvs=None if uv is None else np.full((1, 3, 2), uv, np.float32),
        corner_colours=None if vertex_colours is None else np.full((1, 3, 3), vertex_colours, np.float32),
    )
    found = []
    for number, material in enumerate(materials):
        names = ("",) if material is None else (f"material {number}",)
        table = {f"material {k}": each for k, each in enumerate(materials) if each is not None}
        placed = Object("triangle", "mesh", np.eye(4), materials=names)
        scene = Scene(CAMERA, {"mesh": triangle}, (placed,), materials=table, images=images or {})
        found.append(render(scene, "direct", 1, threads=1)[pass_name][4, 4])
    return np.array(found)


def test_each_surface_has_the_colour_of_its_material_and_black_where_its_material_has_none():
    materials = None, Material(diffuse=RED), Material(emission=GREEN)
    np.testing.assert_allclose(shown(*materials), [PLAIN.diffuse.rgb, RED.rgb, (0, 0, 0)], rtol=1e-7)
    np.testing.assert_allclose(shown(*materials, pass_name="Emission"), [(0, 0, 0), (0, 0, 0), GREEN.rgb], rtol=1e-7)


def test_images_and_vertex_colours_multiply_the_colour_where_their_material_is_and_nowhere_else():
    images = {"ramp": grey([[0.5, 0.25]])}
    textured = Material(diffuse=Colour((1.0, 0.5, 0.0), image="ramp", closest=True, vertex=True))
    of_red = Material(diffuse=RED)
    for u, expected in ((0.1, (0.5, 0.125, 0)), (0.9, (0.25, 0.0625, 0))):
        found = shown(textured, of_red, images=images, uv=(u, 0.5), vertex_colours=(1.0, 0.5, 0.25))
        np.testing.assert_allclose(found, [expected, RED.rgb], rtol=1e-6)
