"""The whole comparison of light: what it says, in one sentence, in lines and in JSON.

The quantities that light is compared in: means and variances of several seeds, what is linear, and what no number is.
"""

import json
import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from viewcam_addon.comparison import light_verdict, radiance
from viewcam_addon.comparison.sides import all_sides, quiet, samples_of
from viewcam_addon.errors import InputError
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole

WIDTH, HEIGHT, SAMPLES, SEEDS = 64, 48, 256, 8
PINHOLE = Pinhole((5, -7, 4), (0.2, 0.1, 0.6), (0, 0, 1), 60.0, WIDTH, HEIGHT)
rows, columns = np.mgrid[:HEIGHT, :WIDTH]
TRUTH = np.stack([0.2 + 0.5 * columns / WIDTH, 0.3 + 0.3 * rows / HEIGHT, np.full((HEIGHT, WIDTH), 0.4)], axis=-1)


def picture(rng, samples, truth=TRUTH, attribute="samples", **passes):
    """The mean of so many exponential variates in every pixel, gray noise, and its variance."""
    color = rng.gamma(samples, 1.0 / samples, (HEIGHT, WIDTH, 1)) * truth
    combined = np.concatenate([color, np.ones((HEIGHT, WIDTH, 1))], axis=-1)
    channels = {"Combined": combined, "Variance": TRUTH**2 / samples, "Depth": np.full((HEIGHT, WIDTH, 1), 8.0), **passes}
    channels = {name: values.astype(np.float32) for name, values in channels.items()}
    return Image(channels, PINHOLE, {attribute: str(samples)}, f"{attribute}.exr")


def both(truth=TRUTH, seed=0):
    rng = np.random.default_rng(seed)
    tests = [picture(rng, SAMPLES // SEEDS, truth, "cycles.ViewLayer.samples") for _ in range(SEEDS)]
    return picture(rng, SAMPLES), tests


def with_rare_light(rng):
    """A picture that has four fifths of its light from one of 640 samples, and of whose noise it tells what it has met."""
    hits, steady = (
        rng.binomial(SAMPLES, 1 / 640, (HEIGHT, WIDTH, 1)) / SAMPLES,
        rng.gamma(SAMPLES, 1 / SAMPLES, (HEIGHT, WIDTH, 1)),
    )
    variance = (0.2**2 + (0.8 * 640) ** 2 * hits * (1 - hits)) / SAMPLES
    image = picture(rng, SAMPLES, Variance=variance * np.ones(3))
    image.passes["Combined"][..., :3] = 0.2 * steady + 0.8 * 640 * hits
    return image


@pytest.mark.parametrize("seed", range(4))
def test_rare_light_that_the_reference_has_missed_is_no_difference_and_hides_none(seed):
    """In one pixel of forty neither it nor any beside it has met that light: there it looks dark and quiet."""

    def compared(factor, is_traced_anew=True):
        rng = np.random.default_rng(seed)
        tests = [picture(rng, 50, np.full_like(TRUTH, factor), "cycles.ViewLayer.samples") for _ in range(SEEDS)]
        references = [with_rare_light(rng) for _ in range(1 + radiance.SEEDS)]
        return radiance.compare(references[0], tests, PINHOLE, trace_anew=(lambda: references[1:]) if is_traced_anew else None)

    assert not compared(1.0, is_traced_anew=False).passed, "else the test proves nothing"
    comparison = compared(1.0)
    assert comparison.passed and comparison.samples[0] == SAMPLES * radiance.SEEDS, "\n".join(comparison.lines())
    assert not compared(1.1).passed


def test_light_70_stops_below_the_brightest_is_no_difference_from_none_and_20_stops_below_it_is():
    """No sample varies there, so that any difference is certain."""

    def compared(stops):
        reference, tests = both()
        for image in (reference, *tests):
            image.passes["Combined"][5:16, 5:16, :3] = image.passes["Variance"][5:16, 5:16] = 0.0
        reference.passes["Combined"][10, 10, :3] = 2.0**-stops
        return radiance.compare(reference, tests, PINHOLE)

    assert compared(70).passed, "\n".join(compared(70).lines())
    assert not compared(20).passed


def test_what_differs_beyond_doubt_is_not_traced_anew():
    def never():
        raise AssertionError("nobody has to ask")

    assert not radiance.compare(*both(1.2 * TRUTH), PINHOLE, trace_anew=never).passed
    assert radiance.compare(*both(), PINHOLE, trace_anew=never).passed


@pytest.fixture(scope="module")
def same():
    return radiance.compare(*both(), PINHOLE)


def test_the_same_light_is_the_same_within_noise(same):
    assert same.passed and same.is_noisy and same.samples == (SAMPLES, SAMPLES) and same.seeds == SEEDS
    assert same.sentence.startswith("The same within noise at 256 samples: no pixel and no tile differs by more than chance; ")
    assert same.equal == ("Alpha",)
    assert any(line.startswith("To the last bit  Alpha") for line in same.lines())
    assert same.lines()[-1] == same.sentence


def test_noise_in_another_pass_alone_is_noise():
    """A white furnace: what is seen is as bright everywhere, and what of a pixel is surface and what is world is a draw."""

    def drawn(rng, samples, share, attribute="samples"):
        world = rng.binomial(samples, share, (HEIGHT, WIDTH, 1)) / samples * np.ones(3)
        image = picture(rng, samples, attribute=attribute, Environment=world, Variance=np.zeros((HEIGHT, WIDTH, 3)))
        image.passes["Combined"][:] = 1.0
        return image

    def compared(share):
        rng = np.random.default_rng(3)
        tests = [drawn(rng, SAMPLES // SEEDS, share, "cycles.ViewLayer.samples") for _ in range(SEEDS)]
        return radiance.compare(drawn(rng, SAMPLES, 0.5), tests, PINHOLE)

    assert compared(0.5).passed and compared(0.5).is_noisy, "\n".join(compared(0.5).lines())
    # 64 × 48 pixels of 256 draws have a standard error of 0.11 %, on both sides: a hundredth is six of their difference.
    assert not compared(0.505).passed and "Environment" in compared(0.505).sentence


def test_the_mean_is_told_in_as_many_digits_as_its_error_has():
    """Never "differs by −0.000 % ± 0.000 %"."""

    def sentence(difference, error):
        return light_verdict._mean_text(light_verdict.LightRow("Combined", 1.0, 1.0 + difference, error, 2 * error, 0))

    assert sentence(-2.5e-7, 4.4e-7).startswith("the mean differs by −0.000025 %, with a standard error of 0.000044 %; ")
    assert sentence(-2.5e-9, 4.4e-7) == (
        "the mean is the same within a standard error of 0.000044 %; a picture 0.000088 % brighter or darker throughout would "
        "have been found in 99 of 100 cases"
    )
    assert sentence(0.25, 0.3).startswith("the mean differs by +25 %, with a standard error of 30 %")
    assert sentence(0.0, 0.0).startswith("the mean is the same within a standard error of 0 %")
    assert "−0.000 %" not in sentence(-1e-9, math.inf)


def test_a_bias_below_the_error_of_the_mean_is_said_to_be_found_by_the_channel_that_tells_it():
    """Blue has a hundredth of red's noise: where the mean of all is known to 0.4 %, blue is to 0.01 %."""
    rng, noise = np.random.default_rng(8), np.array([0.5, 0.05, 0.005])

    def side(factor=1.0):
        colors = TRUTH * (1.0 + rng.normal(size=(HEIGHT, WIDTH, 3)) * noise)
        combined = np.dstack([factor * colors, np.ones((HEIGHT, WIDTH))])
        return picture(rng, SAMPLES, Combined=combined, Variance=(TRUTH * noise) ** 2)

    comparison = radiance.compare(side(), [side() for _ in range(SEEDS)], PINHOLE)
    visible = comparison.rows[0].visible
    assert comparison.passed and visible < comparison.rows[0].ratio_error, "else there is nothing to explain"
    assert "would have been found in 99 of 100 cases by its blue channel, which has the least noise" in comparison.sentence
    assert not radiance.compare(side(), [side(1.0 + visible) for _ in range(SEEDS)], PINHOLE).passed


def test_noise_explains_the_relative_error_of_the_right_picture(same):
    """The mean of 3,072 squares of normal errors: within 4 · √(2/3072) = 10 % of what it should be."""
    assert same.appearance.relmse == pytest.approx(same.appearance.expected_relmse, rel=0.1)


def test_a_wrong_corner_is_named_by_its_columns_rows_and_ratio():
    wrong = TRUTH.copy()
    wrong[:8, 8:16] *= 1.3
    comparison = radiance.compare(*both(wrong), PINHOLE)
    assert not comparison.passed
    sentence = comparison.sentence
    assert sentence.startswith("Different here: in columns 8 to 15, rows 0 to 7 Combined"), sentence
    assert "brighter" in sentence and "standard errors where chance allows" in sentence and "factor" not in sentence


@pytest.mark.parametrize(("factor", "words"), [(np.pi, "which is π"), (1 / np.pi, "which is 1/π"), (2.0, "which is 2")])
def test_a_factor_is_told_by_name_in_spite_of_noise(factor, words):
    sentence = radiance.compare(*both(factor * TRUTH), PINHOLE).sentence
    assert sentence.startswith("Different here: over the whole picture Combined") and words in sentence, sentence


def test_a_factor_that_is_none_of_the_famous_is_told_as_a_number():
    sentence = radiance.compare(*both(1.2 * TRUTH), PINHOLE).sentence
    assert "all of it is a factor of 1.2" in sentence and "which is" not in sentence


def test_a_fault_of_one_quantity_is_named():
    """Emission has the tests' spread only; tiles find it."""
    rng = np.random.default_rng(2)
    emission = 0.2 * TRUTH
    reference = picture(rng, SAMPLES, Emission=emission * rng.gamma(64, 1 / 64, (HEIGHT, WIDTH, 1)))
    tests = [
        picture(rng, 32, attribute="cycles.V.samples", Emission=1.2 * emission * rng.gamma(8, 1 / 8, (HEIGHT, WIDTH, 1)))
        for _ in range(SEEDS)
    ]
    comparison = radiance.compare(reference, tests, PINHOLE)
    assert [row.name for row in comparison.rows if not row.ok] == ["Emission"]
    assert "Emission" in comparison.sentence and "all of it is a factor of 1.1979 ± 0.0" in comparison.sentence


def test_one_noisy_picture_is_compared_by_its_tiles():
    reference, _ = both()
    rng = np.random.default_rng(3)
    assert radiance.compare(reference, [picture(rng, SAMPLES)], PINHOLE).passed
    assert not radiance.compare(reference, [picture(rng, SAMPLES, 1.05 * TRUTH)], PINHOLE).passed


def test_one_pixel_that_is_no_number_fails():
    reference, tests = both()
    combined = tests[3]["Combined"].copy()
    combined[5, 6, 1] = np.nan
    tests[3] = replace(tests[3], passes={**tests[3].passes, "Combined": combined})
    comparison = radiance.compare(reference, tests, PINHOLE)
    assert comparison.sentence == "Different here: Combined has 1 pixel without a number, in Cycles."
    wrong = replace(reference, passes={**reference.passes, "Combined": combined})
    assert "number, in the reference" in radiance.compare(wrong, both()[1], PINHOLE).sentence


def test_a_softer_picture_is_said_to_be_softer():
    stripes = np.where(columns // 4 % 2, 0.3, 0.6)[..., None] * np.ones(3)
    blurred = 0.8 * stripes + 0.1 * (np.roll(stripes, 1, axis=1) + np.roll(stripes, -1, axis=1))
    _, tests = both(blurred)
    sentence = radiance.compare(picture(np.random.default_rng(1), SAMPLES, stripes), tests, PINHOLE).sentence
    assert re.match(r"Different here: along the contours Combined \(\w+\) is softer, ", sentence), sentence


def test_the_json_is_plain_and_says_what_the_sentence_says(same):
    record = json.loads(json.dumps(same.to_json(), allow_nan=False))
    assert record["passed"] is True and record["sentence"] == same.sentence
    assert record["quantities"][0]["name"] == "Combined" and len(record["quantities"][0]["hypothesis_tests"]) == 5
    assert record["samples"] == {"reference": 256, "test": 256} and record["equal"] == ["Alpha"]


def test_the_maps_are_pictures_of_the_same_size(same):
    assert {"Combined: difference", "Combined: tiles", "Combined: standard errors", "FLIP"} == same.maps.keys()
    assert all(values.shape == (HEIGHT, WIDTH) and values.dtype == np.float32 for values in same.maps.values())


def test_without_the_package_flip_is_left_out(monkeypatch):
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    comparison = radiance.compare(*both(), PINHOLE)
    assert comparison.appearance.flip is None and "FLIP" not in comparison.maps
    assert not any("FLIP" in line for line in comparison.lines())


def test_flip_is_nothing_for_equal_pictures_and_much_for_others(same):
    reference, _ = both()
    single = replace(reference, attributes={"samples": "1"}, passes={**reference.passes, "Variance": 0 * reference["Variance"]})
    assert radiance.compare(single, [single], PINHOLE).appearance.flip == 0.0
    black = replace(single, passes={**single.passes, "Combined": 0 * single["Combined"]})
    assert radiance.compare(single, [black], PINHOLE).appearance.flip > 0.4
    assert radiance.compare(black, [black], PINHOLE).passed
    assert 0.0 < same.appearance.flip < 0.3


def test_a_reference_without_light_is_not_judged_by_light(paper_scene):
    assert radiance.carries_light(both()[0])
    geometry = paper_scene.picture()
    assert not radiance.carries_light(geometry)
    combined = np.zeros((*geometry["Depth"].shape[:2], 4), np.float32)
    assert not radiance.carries_light(replace(geometry, passes=geometry.passes | {"Combined": combined})), "as Cycles writes it"
    with pytest.raises(InputError, match="no pass 'Depth'"):
        dark = Image({"Combined": np.zeros((HEIGHT, WIDTH, 4), np.float32)}, PINHOLE)
        radiance.compare(dark, [dark], PINHOLE)


def test_samples_that_the_file_tells_wrongly_can_be_given():
    reference, tests = both()
    assert radiance.compare(reference, tests, PINHOLE, test_samples=16).sentence.startswith(
        "The same within noise at 256 and 128 samples: "
    )


def test_the_references_variance_is_told_from_as_many_batches_as_it_is_judged_by():
    header = Path(__file__).parents[2] / "viewcam_addon" / "tracer" / "core" / "film" / "film.h"
    assert re.findall(r"BATCHES = (\d+)\b", header.read_text(encoding="utf-8")) == [str(radiance.VARIANCE_BATCHES)]


SHAPE = (4, 5)
RNG = np.random.default_rng(0)


def drawn(channels):
    return RNG.random((*SHAPE, channels)).astype(np.float32)


def painted(combined=None, **passes):
    named = {name.replace("_", " "): values for name, values in passes.items()}
    return Image({"Combined": drawn(4) if combined is None else combined, **named}, source="picture.exr")


def sides(reference, tests, name):
    return next(actual for actual in all_sides(reference, tests) if actual.name == name)


def test_the_test_is_the_mean_of_its_pictures_and_its_spread_the_variance_of_that():
    tests = [painted() for _ in range(6)]
    widgets = sides(painted(Variance=drawn(3)), tests, "Combined")
    stack = np.stack([image["Combined"][..., :3] for image in tests]).astype(np.float64)
    assert widgets.test == pytest.approx(stack.mean(axis=0), rel=1e-12)
    assert widgets.test_variance == pytest.approx(stack.var(axis=0, ddof=1) / 6, rel=1e-9)


def test_one_picture_tells_nothing_of_its_noise():
    assert np.isinf(sides(painted(Variance=drawn(3)), [painted()], "Combined").test_variance).all()


def test_the_references_variance_is_its_pass_and_unknown_without_one():
    variance = drawn(3)
    variance[0, 0, 0] = np.inf
    assert (sides(painted(Variance=variance), [painted()], "Combined").variance == variance).all()
    assert np.isinf(sides(painted(), [painted()], "Combined").variance).all()


def test_a_reference_of_one_sample_that_tells_no_variance_has_none():
    reference = Image({"Combined": drawn(4)}, attributes={"samples": "1"})
    assert not sides(reference, [painted()], "Combined").variance.any()


def test_diffuse_light_is_compared_as_light_and_not_as_a_quotient():
    """Two pictures whose light is 1 and 3 by other colors: the mean is 2 in either order."""
    half, ones = np.full((*SHAPE, 3), 0.5, np.float32), np.ones((*SHAPE, 3), np.float32)
    tests = [painted(Diffuse_Direct=2 * ones, Diffuse_Color=half), painted(Diffuse_Direct=3 * ones, Diffuse_Color=ones)]
    actual = sides(painted(Diffuse_Direct=ones, Diffuse_Color=ones), tests, "Diffuse Direct")
    assert (actual.test == 2.0).all() and (actual.reference == 1.0).all()


def test_only_what_all_pictures_have_is_compared():
    three = drawn(3)
    names = [result.name for result in all_sides(painted(Emission=three, Diffuse_Direct=three), [painted(Emission=three)])]
    assert names == ["Combined", "Alpha", "Emission"]


def test_a_quantity_has_no_noise_where_it_is_all_of_a_picture_that_has_none_there_and_around():
    variance = np.zeros((*SHAPE, 3), np.float32)
    variance[0, 0] = 1.0
    combined = drawn(4)
    glowing = {"combined": combined, "Emission": combined[..., :3] * np.float32(1 + 2**-22)}
    for name in ("Emission", "Environment"):
        black = {"Environment": np.zeros((*SHAPE, 3), np.float32)}
        actual = sides(painted(Variance=variance, **glowing, **black), [painted(**glowing, **black)], name)
        assert np.isinf(actual.variance[:2, :2]).all()
        assert (actual.variance[2:] == 0).all() and (actual.variance[:, 2:] == 0).all()


@pytest.mark.parametrize("side", [0, 1])
def test_passes_that_may_trade_their_light_have_noise_though_their_sum_has_none(side):
    """A ray in sixteen goes on to glass that shines as brightly as the world: what was direct is indirect, on either side."""
    white = np.ones((*SHAPE, 3), np.float32)
    direct, indirect = [white.copy(), white.copy()], [0 * white, 0 * white]
    direct[side][2, 2], indirect[side][2, 2] = 15 / 16, 1 / 16
    reference, test = (
        painted(np.ones((*SHAPE, 4), np.float32), Diffuse_Direct=a, Diffuse_Indirect=b, Diffuse_Color=white, **more)
        for a, b, more in zip(direct, indirect, ({"Variance": 0 * white}, {}), strict=True)
    )
    traded = np.zeros(SHAPE, bool)
    traded[2, 2] = True
    for name in ("Diffuse Direct", "Diffuse Indirect"):
        actual = sides(reference, [test, test], name)
        assert np.isinf(actual.variance[traded]).all() and not actual.variance[~traded].any()


def test_colors_and_alpha_have_noise_where_there_is_no_light():
    """A sample in 64 meets a black thing before another: that its light is quiet says nothing of its color."""
    lit, white = np.zeros((*SHAPE, 4), np.float32), np.ones((*SHAPE, 3), np.float32)
    lit[..., 2:, :] = 1.0
    passes = {"Diffuse_Direct": lit[..., :3], "Diffuse_Color": white}
    reference, test = painted(lit, Variance=0 * white, **passes), painted(lit, **passes)
    for name in ("Diffuse Color", "Alpha"):
        variance = sides(reference, [test, test], name).variance
        assert np.isinf(variance[:, :2]).all() and not variance[:, 2:].any()


def test_roundings_are_no_noise_and_more_is():
    values = np.full((*SHAPE, 3), 2.0)
    assert quiet(values, np.full(values.shape, (8 * 2.0**-23) ** 2)).all()
    assert not quiet(values, np.full(values.shape, (32 * 2.0**-23) ** 2)).any()


def test_what_is_no_number_is_marked_and_spoils_nothing_else():
    broken = drawn(4)
    broken[1, 2, 1] = np.nan
    broken[3, 3, 0] = np.inf
    for reference, tests in ((painted(broken), [painted(), painted()]), (painted(), [painted(broken), painted()])):
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
        list(all_sides(painted(), [Image({"Combined": np.zeros((1, 1, 4), np.float32)}, source="small.exr")]))
    with pytest.raises(InputError, match="at least one test picture"):
        list(all_sides(painted(), []))
    with pytest.raises(InputError, match="no pass 'Combined'"):
        list(all_sides(painted(), [Image({"Depth": np.zeros((*SHAPE, 1), np.float32)})]))


def test_light_may_be_shared_where_samples_are_counted_and_nowhere_else():
    variance = drawn(3)
    variance[1, 2] = np.inf
    passes = {"Variance": variance, "Diffuse_Direct": drawn(3), "Diffuse_Color": drawn(3)}
    for counted in ({}, {"Sample_Count": drawn(1)}):
        reference = painted(**passes, **counted)
        result = {each.name: each.shared for each in all_sides(reference, [painted(**passes)])}
        expected = np.where(np.isfinite(variance), variance, 0.0) if counted else 0.0
        assert np.all(result["Combined"] == expected) and np.all(result["Diffuse Direct"] == expected)
        assert not np.any(result["Diffuse Color"])
