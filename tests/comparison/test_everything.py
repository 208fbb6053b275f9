"""On how much of a picture something is not modeled: by the bits of geometry, and by light beyond noise."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison.everything import not_modeled
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole

WIDTH, HEIGHT, SEEDS, SAMPLES = 64, 48, 8, 16
PINHOLE = Pinhole((5, -7, 4), (0.2, 0.1, 0.6), (0, 0, 1), 60.0, WIDTH, HEIGHT)
BALL = np.zeros((HEIGHT, WIDTH), bool)
BALL[10:20, 10:30] = True


def geometry(paper_scene):
    return paper_scene.seen_by(PINHOLE).rendered()


def changed(picture, name, where, by=1.0):
    passes = {each: values.copy() for each, values in picture.passes.items()}
    passes[name][where] += np.float32(by)
    return replace(picture, passes=passes)


def light(rng, samples=SAMPLES, **passes):
    gray = rng.gamma(samples, 0.5 / samples, (HEIGHT, WIDTH, 1)) * np.ones(3)
    combined = np.concatenate([gray, np.ones((HEIGHT, WIDTH, 1))], axis=-1)
    passes = {"Combined": combined, "Variance": np.full(gray.shape, 0.25 / samples), "Depth": np.full((HEIGHT, WIDTH, 1), 8.0)}
    return Image({name: values.astype(np.float32) for name, values in passes.items()}, PINHOLE, {"samples": str(samples)})


def lit(seeds=SEEDS):
    rng = np.random.default_rng(7)
    return light(rng, seeds * SAMPLES), [light(rng) for _ in range(seeds)]


def test_a_picture_with_everything_that_is_the_same_shows_nothing_that_is_not_modeled(paper_scene):
    test = geometry(paper_scene)
    assert not_modeled(("Ball", "Hair"), {"Ball": BALL}, test, [test], test).names == ()
    reference, tests = lit()
    assert not_modeled(("Hair",), {}, reference, tests, tests[0], PINHOLE).share == 0.0


@pytest.mark.parametrize("name", ["Depth", "Position", "UV", "Object Index", "Material Index"])
def test_a_single_other_bit_of_geometry_is_counted(paper_scene, name):
    test = geometry(paper_scene)
    everything = changed(test, name, (3, 4), by=np.spacing(np.abs(test[name][3, 4]).max()) * 2)
    actual = not_modeled(("Hair",), {}, test, [test], everything)
    assert actual.names == ("Hair",) and actual.share == 1 / (WIDTH * HEIGHT) and actual.visible == 0.0


def test_other_normals_count_where_an_object_is_not_modeled_and_nowhere_else(paper_scene):
    test = geometry(paper_scene)
    everything = changed(test, "Normal", np.s_[12, :], by=0.1)
    actual = not_modeled(("Ball", "Hair"), {"Ball": BALL}, test, [test], everything)
    assert actual.names == ("Ball",) and actual.share == BALL[12].sum() / BALL.size


@pytest.mark.parametrize("seeds", [1, SEEDS])
def test_light_that_is_another_beyond_noise_is_counted_where_it_is(seeds):
    reference, tests = lit(seeds)
    everything = changed(tests[0], "Combined", np.s_[16:32, 16:32, :3], by=4.0)
    actual = not_modeled(("Lamp",), {}, reference, tests, everything, PINHOLE)
    assert actual.names == ("Lamp",)
    assert actual.share == pytest.approx(16 * 16 / (WIDTH * HEIGHT), rel=0.6), "its pixels, and the tiles that they reach into"


def test_a_faint_change_of_all_light_is_found_in_the_sum_and_is_all_of_the_picture():
    reference, tests = lit()
    everything = changed(tests[0], "Combined", np.s_[..., :3], by=0.02)
    assert not_modeled(("World",), {}, reference, tests, everything, PINHOLE).share == 1.0


def test_other_noise_of_the_same_light_is_no_change():
    reference, tests = lit()
    shares = [
        not_modeled(("Hair",), {}, reference, tests, light(np.random.default_rng(seed)), PINHOLE).share for seed in range(10)
    ]
    assert shares == [0.0] * 10


def test_what_is_seen_counts_at_levels_of_light_however_like_its_stand_in_it_is():
    reference, tests = lit()
    actual = not_modeled(("Ball", "Hair"), {"Ball": BALL}, reference, tests, tests[0], PINHOLE)
    assert actual.names == ("Ball",) and actual.share == actual.visible == BALL.mean()


def test_a_pixel_that_is_no_number_with_everything_is_another():
    reference, tests = lit()
    everything = changed(tests[0], "Combined", (5, 5), by=np.nan)
    assert not_modeled(("Hair",), {}, reference, tests, everything, PINHOLE).share > 0.0
