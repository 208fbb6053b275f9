import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.tracer.light import sharing
from viewcam_addon.tracer.light.sharing import shared

SEEDS = st.integers(0, 2**32 - 1)
SHAPES = st.tuples(st.integers(1, 40), st.integers(1, 40))
NOISE = 0.05
# All of it is interior, and all its tiles are whole.
HEIGHT, WIDTH = 96, 128
ROW, COLUMN = np.mgrid[:HEIGHT, :WIDTH] - np.array([HEIGHT / 2, WIDTH / 2]).reshape(2, 1, 1)


def smooth(x):
    """From 0 at 0 to 1 at 1, as a penumbra."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


TRUTHS = {
    "constant": np.full((HEIGHT, WIDTH), 0.5),
    "ramp": 0.5 + 0.003 * COLUMN - 0.002 * ROW,
    "parabola": 0.1 + 0.8 * (2 * COLUMN / WIDTH) ** 2,
    "contact shadow": 1 - 1 / (1 + np.hypot(COLUMN, ROW) / 4),
    "waves": 0.5 + 0.3 * np.sin(COLUMN / 6) * np.sin(ROW / 6),
    "step": 0.1 + 0.8 * (COLUMN + 0.35 * ROW > 10),
    "faint step": 0.4 + 0.1 * (COLUMN + 0.35 * ROW > 10),
    "thin dark line": 0.5 - 0.3 * (np.abs(COLUMN - 0.5 * ROW) < 0.6),
    "penumbra 2 pixels wide": 0.1 + 0.8 * smooth((COLUMN + 0.35 * ROW) / 2),
    "penumbra 8 pixels wide": 0.1 + 0.8 * smooth((COLUMN + 0.35 * ROW) / 8),
    "penumbra 32 pixels wide": 0.1 + 0.8 * smooth((COLUMN + 0.35 * ROW) / 32),
}


def everywhere(value=True):
    return np.full((HEIGHT, WIDTH), value)


def coloured(values):
    return np.stack([values, 0.8 * values, 0.6 * values])


def gaussian(truth, noise, rng):
    """Light and the variance that it claims, of a noise that is the same everywhere and well known."""
    return coloured(truth + noise * rng.standard_normal(truth.shape)), np.full(truth.shape, noise**2 * 2 / 3)


def lit_or_not(truth, samples, rng):
    """The same of samples that meet the lamp or do not, which tell their own variance."""
    met = rng.random((samples, *truth.shape)) < truth
    return coloured(met.mean(axis=0)), met.var(axis=0, ddof=1) / samples * 2 / 3


def error(light, truth, where=slice(None)):
    return np.sqrt(((light - coloured(truth)) ** 2).mean(axis=0)[where].mean())


def tiles(values, size=32):
    height, width = values.shape
    return values.reshape(height // size, size, width // size, size).sum(axis=(1, 3))


@st.composite
def pictures(draw):
    """Any light, variance and interior."""
    shape, rng = draw(SHAPES), np.random.default_rng(draw(SEEDS))
    interior = rng.random(shape) >= draw(st.sampled_from([0.0, 0.02, 0.3]))
    light = rng.random((3, *shape)) * 10.0 ** rng.integers(-3, 4)
    variance = rng.random(shape) * 10.0 ** rng.integers(-8, 3, shape)
    variance[rng.random(shape) < draw(st.sampled_from([0.0, 0.5, 1.0]))] = np.inf
    return light, variance, interior


@given(pictures(), st.floats(-1e6, 1e6), st.floats(0, 1))
def test_a_constant_stays_itself_to_the_bit(picture, constant, tolerance):
    light, variance, interior = picture
    light = np.full_like(light, constant)
    np.testing.assert_array_equal(shared(light, variance, interior, tolerance)[0], light)


@given(pictures(), st.floats(-1, 1), st.floats(-1, 1))
def test_what_is_linear_stays_itself_whatever_is_interior(picture, along_rows, along_columns):
    _, variance, interior = picture
    row, column = np.indices(interior.shape)
    light = coloured(along_rows * column + along_columns * row)
    # Sixteen growths, each with four roundings to float32 of numbers up to 80; what is linear has no bend but these.
    np.testing.assert_allclose(shared(light, variance, interior, 0.0)[0], light, rtol=0, atol=64 * 80 * 2.0**-24)


@given(pictures(), st.floats(0, 1), st.sampled_from([0.0, 1e30, np.nan, np.inf]))
def test_what_is_not_interior_neither_changes_nor_matters(picture, tolerance, other):
    light, variance, interior = picture
    result, left = shared(light, variance, interior, tolerance)
    np.testing.assert_array_equal(result[:, ~interior], light[:, ~interior])
    np.testing.assert_array_equal(left[~interior], variance[~interior])
    again = shared(np.where(interior, light, other), np.where(interior, variance, other), interior, tolerance)
    np.testing.assert_array_equal(again[0][:, interior], result[:, interior])
    np.testing.assert_array_equal(again[1][interior], left[interior])


@given(pictures())
def test_a_mirrored_picture_is_shared_alike_to_the_bit(picture):
    light, variance, interior = picture
    expected = shared(light, variance, interior, 0.0)
    for mirror in ((..., slice(None, None, -1)), (..., slice(None, None, -1), slice(None))):
        result = shared(light[mirror], variance[mirror], interior[mirror], 0.0)
        for values, other in zip(result, expected, strict=True):
            np.testing.assert_array_equal(values[mirror], other)


@given(pictures(), st.floats(1e-6, 1e3))
def test_the_variance_never_grows(picture, variance):
    light, _, interior = picture
    left = shared(light, np.full(interior.shape, variance), interior, 0.0)[1]
    assert (left <= variance * (1 + 2.0**-20)).all()  # the pooled one of equal ones, rounded to float32 some ten times


@given(pictures())
def test_variances_are_neither_negative_nor_no_numbers(picture):
    left = shared(*picture, 0.0)[1]
    assert (left[picture[2]] >= 0).all()


@given(pictures())
def test_nothing_is_shared_where_noise_is_far_below_the_tolerance(picture):
    light, variance, interior = picture
    variance = np.minimum(variance, 1e-4)
    np.testing.assert_array_equal(shared(light, variance, interior, 0.041)[0], light)  # a quarter of it squared is 1.05e-4


def test_noise_in_the_open_is_what_the_largest_window_leaves_of_it():
    rng = np.random.default_rng(1)
    light, variance = gaussian(TRUTHS["constant"], NOISE, rng)
    result, left = shared(light, variance, everywhere(), 0.0)
    tent = np.convolve(np.ones(16), np.ones(16)) / 256
    weights = 2 * np.pad(np.outer(tent, tent), 15) - np.apply_along_axis(
        np.convolve, 1, np.apply_along_axis(np.convolve, 0, np.outer(tent, tent), tent), tent
    )
    inner = np.s_[30:-30, 30:-30]
    expected = NOISE * np.sqrt((weights**2).sum() * 2 / 3)
    # Some 36 × 68 / 16² independent windows: the error is known to a sixth, three of which are allowed, and one below that for
    # what was tested.
    assert error(result, TRUTHS["constant"], inner) == pytest.approx(expected, rel=0.5)
    assert np.sqrt(left[inner].mean()) == pytest.approx(expected, rel=0.5)


@pytest.mark.parametrize("name", TRUTHS)
@pytest.mark.parametrize("noise", [0.1, 0.03, 0.01, 0.003])
def test_whatever_the_light_the_error_falls_and_is_told(name, noise):
    light, variance = gaussian(TRUTHS[name], noise, np.random.default_rng(7))
    result, left = shared(light, variance, everywhere(), 0.0)
    before, after, told = error(light, TRUTHS[name]), error(result, TRUTHS[name]), np.sqrt(left.mean())
    assert after < 0.7 * before, f"{name}: {before:.4f} became {after:.4f}"
    assert 0.6 * after < told < 1.8 * after, f"{name}: an error of {after:.4f} is told to be {told:.4f}"


@pytest.mark.parametrize("samples", [2, 4, 16])
@pytest.mark.parametrize("name", TRUTHS)
def test_few_samples_that_meet_the_lamp_or_not_tell_enough(name, samples):
    truth, rng = np.clip(TRUTHS[name], 0, 1), np.random.default_rng(3)
    light, variance = lit_or_not(truth, samples, rng)
    assert error(shared(light, variance, everywhere(), 0.0)[0], truth) < 0.45 * error(light, truth)


NEAR_STEP = np.abs(COLUMN + 0.35 * ROW - 10) < 4
CONTRASTS = [0.5, 1, 2, 4, 8, 16, 64]


def errors_near_a_step(contrast):
    """Before and after, in standard errors of a pixel. contrast : of the step, in the same."""
    truth = 1 + contrast * NOISE * (COLUMN + 0.35 * ROW > 10)
    light, variance = gaussian(truth, NOISE, np.random.default_rng(5))
    after = shared(light, variance, everywhere(), 0.0)[0]
    return error(light, truth, NEAR_STEP) / NOISE, error(after, truth, NEAR_STEP) / NOISE


@pytest.mark.parametrize("contrast", CONTRASTS)
def test_a_step_is_not_blurred_beyond_its_noise(contrast):
    before, after = errors_near_a_step(contrast)
    assert after < 1.1 * before, f"a step of {contrast} standard errors: {before:.2f} of them became {after:.2f}"


def test_windows_that_always_grow_would_be_found(monkeypatch):
    monkeypatch.setattr(sharing, "_EXPLAINED", 1e9)
    monkeypatch.setattr(sharing, "_STRAY", 1e9)
    assert sum(after > 1.1 * before for before, after in map(errors_near_a_step, CONTRASTS)) >= 3


@given(SEEDS, st.floats(12, 1e4))
def test_a_single_bright_pixel_stays_as_it_is(seed, brightness):
    light, variance = gaussian(TRUTHS["ramp"], NOISE, np.random.default_rng(seed))
    light[:, 40, 50] += brightness * NOISE
    np.testing.assert_array_equal(shared(light, variance, everywhere(), 0.0)[0][:, 40, 50], light[:, 40, 50])


@pytest.mark.parametrize("brightness", [1e6, 1e30, 1e38, 1e300])
def test_a_pixel_as_bright_as_the_sun_spoils_only_what_is_near(brightness):
    light, variance = gaussian(TRUTHS["ramp"], NOISE, np.random.default_rng(2))
    expected = shared(light, variance, everywhere(), 0.0)
    light[:, 10, 20] = variance[10, 20] = brightness
    result = shared(light, variance, everywhere(), 0.0)
    # A window reaches 15 pixels, windows of windows 30, and what decides about their growth 31 further.
    far = np.hypot(ROW - ROW[10, 20], COLUMN - COLUMN[10, 20]) > 1.5 * 61
    assert far.any()
    np.testing.assert_array_equal(result[0][:, far], expected[0][:, far])
    assert np.isfinite(result[0]).all()


def test_more_noise_means_larger_windows():
    kept = []
    for noise in (0.003, 0.01, 0.03, 0.1):
        light, variance = gaussian(TRUTHS["waves"], noise, np.random.default_rng(9))
        kept.append(shared(light, variance, everywhere(), 0.0)[1].mean() / variance.mean())
    assert kept == sorted(kept, reverse=True), kept


def test_beside_an_edge_windows_are_thin():
    light, variance = gaussian(TRUTHS["ramp"], NOISE, np.random.default_rng(4))
    interior = everywhere()
    interior[:, ::4] = False
    interior[:, 2::4] = False
    light[:, ~interior] = 100.0
    result = shared(light, variance, interior, 0.0)[0]
    # One pixel wide and many long: [1 2 1] / 4 alone would leave √(3/8) = 0.61 of the noise, the next √(11/64) = 0.41.
    assert error(result, TRUTHS["ramp"], interior) < 0.45 * error(light, TRUTHS["ramp"], interior)


@pytest.mark.parametrize("factor", [1, 3, 10, np.inf])
@pytest.mark.parametrize("name", ["contact shadow", "waves", "penumbra 8 pixels wide"])
def test_samples_that_claim_too_much_noise_do_not_blur(name, factor):
    light, variance = gaussian(TRUTHS[name], 0.01, np.random.default_rng(6))
    known = error(shared(light, variance, everywhere(), 0.0)[0], TRUTHS[name])
    result, left = shared(light, factor * variance, everywhere(), 0.0)
    assert error(result, TRUTHS[name]) < 1.5 * known
    assert np.sqrt(left.mean()) < 2 * known


@pytest.mark.parametrize("factor", [0.0, 0.01])
def test_light_without_noise_keeps_all_its_bends_whatever_neighbours_tell(factor):
    """As a texture that was taken for interior: its bends would pass for noise, but for what the samples say."""
    rng = np.random.default_rng(8)
    light = coloured(rng.random((HEIGHT, WIDTH)))
    result = shared(light, everywhere(1.0) * factor * light[0].var(), everywhere(), 0.0)[0]
    assert np.abs(result - light).mean() < 0.02


def worst_sums(name):
    """How far sharing moves the sums over tiles, in their standard errors: on average, and the root of the mean square."""
    moved = []
    for seed in range(4):
        light, variance = gaussian(TRUTHS[name], NOISE, np.random.default_rng(seed))
        change = (shared(light, variance, everywhere(), 0.0)[0] - light).mean(axis=0) / 0.8  # the mean of the colours is 0.8
        moved.append(tiles(change) / np.sqrt(tiles(everywhere(NOISE**2))))
    return np.mean(moved), np.sqrt(np.mean(np.square(moved)))


@pytest.mark.parametrize("name", TRUTHS)
def test_sums_over_tiles_stay_within_their_noise(name):
    mean, spread = worst_sums(name)
    # Windows at the borders of a tile belong to two: that alone moves sums by 0.3 standard errors, and the mean of 48 by 0.05.
    assert abs(mean) < 0.25, f"{name}: the sums moved by {mean:.2f} standard errors on average"
    assert spread < 0.6, f"{name}: the sums moved by {spread:.2f} standard errors"


def test_sums_that_nothing_gives_back_would_be_found(monkeypatch):
    monkeypatch.setattr(sharing, "_spread", lambda light, growths: np.zeros_like(light))
    assert abs(worst_sums("parabola")[0]) > 1


@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (2, 2), (3, 5), (31, 4)])
def test_pictures_of_any_size_and_any_number_of_channels(shape, channels):
    light = np.random.default_rng(0).random((channels, *shape))
    result, left = shared(light, np.full(shape, 0.1), np.full(shape, True), 0.0)
    assert result.shape == light.shape and left.shape == shape
    assert np.isfinite(result).all() and (left > 0).all()
