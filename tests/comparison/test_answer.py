"""The three answers: what each of them says, by which status it ends, and how much of a picture is not modeled."""

import numpy as np
import pytest

from viewcam_addon.comparison.answer import DIFFERENT, SAME, SAME_BUT, NotModeled, answered, in_the_picture

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
        "and 1 shadow that not all rays see (Hair, Floor, Carpet and 1 more; 25 % of the picture)"
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


def test_without_a_picture_of_everything_the_share_of_what_has_no_surface_is_unknown():
    assert in_the_picture((HAIR, FOG), {HAIR: mask(0)}, None, is_lit=False) == NotModeled((HAIR, FOG), None, 0.05)
    assert in_the_picture((HAIR,), {HAIR: mask(0)}, None, is_lit=False) == NotModeled((HAIR,), 0.05, 0.05)


def test_a_surface_that_is_not_seen_may_light_what_is_and_has_no_part_in_geometry():
    assert in_the_picture((HAIR,), {HAIR: mask()}, None, is_lit=False) == NotModeled((), 0.0, 0.0)
    assert in_the_picture((HAIR,), {HAIR: mask()}, None, is_lit=True) == NotModeled((HAIR,), None, 0.0)
