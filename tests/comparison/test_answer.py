"""The three answers: what each of them says, by which status it ends, and how much of a picture is not modeled.

On how much of a picture something is not modeled: by the bits of geometry, and by light beyond noise.
"""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison.answer import DIFFERENT, SAME, SAME_BUT, NotModeled, answered, in_the_picture
from viewcam_addon.comparison.everything import not_modeled
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole

HAIR, FOG = "Hair", "Fog"


def mask(*pixels, size=(4, 5)):
    picture = np.zeros(size, bool)
    picture.reshape(-1)[list(pixels)] = True
    return picture


def test_all_that_is_seen_is_modeled_and_the_answer_is_the_same():
    answer = answered(True, "The same picture", "over 9 pixels.", NotModeled())
    assert (answer.answer, answer.passed, answer.color) == (SAME, True, "green")
    assert answer.sentence == "The same picture: over 9 pixels."
    assert answer.exit_status(strict=True) == 0


def test_what_is_not_modeled_is_named_with_its_share_and_fails_under_strict_alone():
    answer = answered(True, "The same picture", "over 9 pixels.", NotModeled((HAIR, FOG), 0.125, 0.1))
    assert (answer.answer, answer.passed, answer.color) == (SAME_BUT, True, "amber")
    assert answer.sentence == (
        "The same picture, but for 2 objects that are not modeled (Hair, Fog; 12 % of the picture): over 9 pixels."
    )
    assert answer.exit_status(strict=False) == 0 and answer.exit_status(strict=True) == 3
    assert answer.to_json() == {
        "passed": True,
        "answer": "same_but",
        "sentence": answer.sentence,
        "not_modeled": {
            "count": 2,
            "names": [HAIR, FOG],
            "share": 0.125,
            "shown": 0.1,
            "in_one_place": [],
            "seen_otherwise": [],
        },
    }


def test_what_is_modeled_and_still_said_nothing_of_is_told_as_what_it_is():
    actual = NotModeled((HAIR, "Floor", "Carpet", "Lamp"), 0.25).sorted_by(("Floor", "Carpet", "Unseen"), ("Lamp",))
    answer = answered(True, "The same picture", "over 9 pixels.", actual)
    assert answer.headline == (
        "The same picture, but for 1 object that is not modeled and 2 objects with surfaces in one place "
        "and 1 light or shadow that not all rays see (Hair, Floor, Carpet and 1 more; 25 % of the picture)"
    )


def test_what_differs_is_different_whatever_is_not_modeled():
    answer = answered(False, "Not the same picture", "it is rolled.", NotModeled((HAIR,), 0.5))
    assert (answer.answer, answer.passed, answer.color) == (DIFFERENT, False, "red")
    assert answer.exit_status(strict=True) == answer.exit_status(strict=False) == 1
    assert answer.headline == "Not the same picture"


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (1.0, "100 %"),
        (0.9996, "99.96 %"),
        (0.5, "50 %"),
        (1e-3, "0.1 %"),
        (1e-5, "less than 0.01 %"),
        (None, "was not measured"),
    ],
)
def test_a_share_is_told_as_large_as_it_is(share, words):
    answer = answered(True, "The same picture", "", NotModeled(tuple("abcdef"), share))
    assert "but for 6 objects that are not modeled (a, b, c and 3 more; " in answer.headline and words in answer.headline


def test_an_object_that_no_pixel_shows_and_that_changes_none_is_not_in_the_picture():
    actual = in_the_picture((HAIR, FOG), {HAIR: mask()}, mask(), is_lit=True)
    assert actual == NotModeled((), 0.0, 0.0)


def test_an_object_is_in_the_picture_by_the_pixels_that_show_it():
    actual = in_the_picture((HAIR, FOG), {HAIR: mask(1, 2)}, mask(1, 2), is_lit=True)
    assert actual == NotModeled((HAIR,), 0.1, 0.1)


def test_a_stand_in_that_changes_no_bit_of_the_passes_of_geometry_is_no_reason_for_amber():
    pixels_by_object = {HAIR: mask(1, 2, 3), FOG: mask(4)}
    assert in_the_picture((HAIR, FOG), pixels_by_object, mask(), is_lit=False) == NotModeled((), 0.0, 0.0)
    assert in_the_picture((HAIR, FOG), pixels_by_object, mask(1, 2), is_lit=False) == NotModeled((HAIR,), 0.1, 0.1)


def test_what_is_not_seen_is_in_the_picture_where_it_changes_another_pixel():
    actual = in_the_picture((HAIR, FOG), {HAIR: mask(1, 2)}, mask(2, 3, 4), is_lit=True)
    assert actual == NotModeled((HAIR, FOG), 0.2, 0.1)


def test_a_surface_that_is_not_seen_and_fills_the_picture_with_fog_is_in_it():
    assert in_the_picture((FOG,), {FOG: mask()}, mask(3, 4), is_lit=False) == NotModeled((FOG,), 0.1, 0.0)
    assert in_the_picture((HAIR, FOG), {FOG: mask()}, mask(3, 4), is_lit=False) == NotModeled((HAIR,), 0.1, 0.0)


def test_without_a_picture_of_everything_the_share_of_what_has_no_surface_is_unknown():
    assert in_the_picture((HAIR, FOG), {HAIR: mask(0)}, None, is_lit=False) == NotModeled((HAIR, FOG), None, 0.05)
    assert in_the_picture((HAIR,), {HAIR: mask(0)}, None, is_lit=False) == NotModeled((HAIR,), 0.05, 0.05)


def test_a_surface_that_is_not_seen_may_light_what_is_and_has_no_part_in_geometry():
    assert in_the_picture((HAIR,), {HAIR: mask()}, None, is_lit=False) == NotModeled((), 0.0, 0.0)
    assert in_the_picture((HAIR,), {HAIR: mask()}, None, is_lit=True) == NotModeled((HAIR,), None, 0.0)


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
