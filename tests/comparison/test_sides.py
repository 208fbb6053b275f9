"""The quantities that light is compared in: means and variances of several seeds, what is linear, and what no number is."""

import numpy as np
import pytest

from viewcam_addon.comparison.sides import all_sides, quiet, samples_of
from viewcam_addon.errors import InputError
from viewcam_addon.image import Image

SHAPE = (4, 5)
RNG = np.random.default_rng(0)


def drawn(channels):
    return RNG.random((*SHAPE, channels)).astype(np.float32)


def picture(combined=None, **passes):
    named = {name.replace("_", " "): values for name, values in passes.items()}
    return Image({"Combined": drawn(4) if combined is None else combined, **named}, source="picture.exr")


def sides(reference, tests, name):
    return next(actual for actual in all_sides(reference, tests) if actual.name == name)


def test_the_test_is_the_mean_of_its_pictures_and_its_spread_the_variance_of_that():
    tests = [picture() for _ in range(6)]
    widgets = sides(picture(Variance=drawn(3)), tests, "Combined")
    stack = np.stack([image["Combined"][..., :3] for image in tests]).astype(np.float64)
    assert widgets.test == pytest.approx(stack.mean(axis=0), rel=1e-12)
    assert widgets.test_variance == pytest.approx(stack.var(axis=0, ddof=1) / 6, rel=1e-9)


def test_one_picture_tells_nothing_of_its_noise():
    assert np.isinf(sides(picture(Variance=drawn(3)), [picture()], "Combined").test_variance).all()


def test_the_references_variance_is_its_pass_and_unknown_without_one():
    variance = drawn(3)
    variance[0, 0, 0] = np.inf
    assert (sides(picture(Variance=variance), [picture()], "Combined").variance == variance).all()
    assert np.isinf(sides(picture(), [picture()], "Combined").variance).all()


def test_a_reference_of_one_sample_that_tells_no_variance_has_none():
    reference = Image({"Combined": drawn(4)}, attributes={"samples": "1"})
    assert not sides(reference, [picture()], "Combined").variance.any()


def test_diffuse_light_is_compared_as_light_and_not_as_a_quotient():
    """Two pictures whose light is 1 and 3 by other colors: the mean is 2 in either order."""
    half, ones = np.full((*SHAPE, 3), 0.5, np.float32), np.ones((*SHAPE, 3), np.float32)
    tests = [picture(Diffuse_Direct=2 * ones, Diffuse_Color=half), picture(Diffuse_Direct=3 * ones, Diffuse_Color=ones)]
    actual = sides(picture(Diffuse_Direct=ones, Diffuse_Color=ones), tests, "Diffuse Direct")
    assert (actual.test == 2.0).all() and (actual.reference == 1.0).all()


def test_only_what_all_pictures_have_is_compared():
    three = drawn(3)
    names = [result.name for result in all_sides(picture(Emission=three, Diffuse_Direct=three), [picture(Emission=three)])]
    assert names == ["Combined", "Alpha", "Emission"]


def test_a_quantity_has_no_noise_where_it_is_all_of_a_picture_that_has_none_there_and_around():
    variance = np.zeros((*SHAPE, 3), np.float32)
    variance[0, 0] = 1.0
    combined = drawn(4)
    glowing = {"combined": combined, "Emission": combined[..., :3] * np.float32(1 + 2**-22)}
    for name in ("Emission", "Environment"):
        black = {"Environment": np.zeros((*SHAPE, 3), np.float32)}
        actual = sides(picture(Variance=variance, **glowing, **black), [picture(**glowing, **black)], name)
        assert np.isinf(actual.variance[:2, :2]).all()
        assert (actual.variance[2:] == 0).all() and (actual.variance[:, 2:] == 0).all()


@pytest.mark.parametrize("side", [0, 1])
def test_passes_that_may_trade_their_light_have_noise_though_their_sum_has_none(side):
    """A ray in sixteen goes on to glass that shines as brightly as the world: what was direct is indirect, on either side."""
    white = np.ones((*SHAPE, 3), np.float32)
    direct, indirect = [white.copy(), white.copy()], [0 * white, 0 * white]
    direct[side][2, 2], indirect[side][2, 2] = 15 / 16, 1 / 16
    reference, test = (
        picture(np.ones((*SHAPE, 4), np.float32), Diffuse_Direct=a, Diffuse_Indirect=b, Diffuse_Color=white, **more)
        for a, b, more in zip(direct, indirect, ({"Variance": 0 * white}, {}), strict=True)
    )
    traded = np.zeros(SHAPE, bool)
    traded[2, 2] = True
    for name in ("Diffuse Direct", "Diffuse Indirect"):
        actual = sides(reference, [test, test], name)
        assert np.isinf(actual.variance[traded]).all() and not actual.variance[~traded].any()


def test_roundings_are_no_noise_and_more_is():
    values = np.full((*SHAPE, 3), 2.0)
    assert quiet(values, np.full(values.shape, (8 * 2.0**-23) ** 2)).all()
    assert not quiet(values, np.full(values.shape, (32 * 2.0**-23) ** 2)).any()


def test_what_is_no_number_is_marked_and_spoils_nothing_else():
    broken = drawn(4)
    broken[1, 2, 1] = np.nan
    broken[3, 3, 0] = np.inf
    for reference, tests in ((picture(broken), [picture(), picture()]), (picture(), [picture(broken), picture()])):
        actual = sides(reference, tests, "Combined")
        assert np.argwhere(actual.broken).tolist() == [[1, 2], [3, 3]]
        assert np.isfinite(actual.difference).all() and np.isfinite(actual.test_variance).all()


@pytest.mark.parametrize(
    ("attributes", "samples"),
    [
        ({"samples": "64"}, 64),
        ({"cycles.View Layer.1.samples": "9"}, 9),
        ({"cycles.ViewLayer.render_time": "1"}, None),
        ({}, None),
    ],
)
def test_samples_are_what_either_program_writes(attributes, samples):
    assert samples_of(Image({"Combined": drawn(4)}, attributes=attributes)) == samples


def test_pictures_of_other_sizes_or_none_are_refused():
    with pytest.raises(InputError, match=r"small\.exr has 1 × 1 pixels"):
        list(all_sides(picture(), [Image({"Combined": np.zeros((1, 1, 4), np.float32)}, source="small.exr")]))
    with pytest.raises(InputError, match="at least one test picture"):
        list(all_sides(picture(), []))
    with pytest.raises(InputError, match="no pass 'Combined'"):
        list(all_sides(picture(), [Image({"Depth": np.zeros((*SHAPE, 1), np.float32)})]))


def test_light_may_be_shared_where_samples_are_counted_and_nowhere_else():
    variance = drawn(3)
    variance[1, 2] = np.inf
    passes = {"Variance": variance, "Diffuse_Direct": drawn(3), "Diffuse_Color": drawn(3)}
    for counted in ({}, {"Sample_Count": drawn(1)}):
        reference = picture(**passes, **counted)
        result = {each.name: each.shared for each in all_sides(reference, [picture(**passes)])}
        expected = np.where(np.isfinite(variance), variance, 0.0) if counted else 0.0
        assert np.all(result["Combined"] == expected) and np.all(result["Diffuse Direct"] == expected)
        assert not np.any(result["Diffuse Color"])
