"""A picture's path stays inside the batch's folder, and what no dataset can say is refused in a sentence that names it."""

import re

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from viewcam_addon.cameras import colmap, naming, transforms
from viewcam_addon.cameras.camera import Camera
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

PINHOLE = Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), 1200.0, 640, 360)
MIRRORED = Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), 1200.0, 640, 360, mirrored=True)

FORMATS = pytest.mark.parametrize("make", [transforms.document, colmap.texts], ids=["transforms", "colmap"])


def refusal(make, *arguments):
    with pytest.raises(InputError) as caught:
        make(*arguments)
    sentence = str(caught.value)
    assert "\n" not in sentence and len(sentence) < 300, sentence
    return sentence


@pytest.mark.parametrize(
    "file", ["a.png", "images/left eye.png", "a/b/c.exr", "Žluťoučký/été.png", "...png", "left\u00a0eye.png"]
)
def test_a_path_inside_the_folder_is_taken(file):
    naming.check_image(file)


@pytest.mark.parametrize(
    "file",
    ["", "/etc/a.png", "../a.png", "a/../../b.png", "a//b.png", "./a.png", "a/", "a\\b.png", "a\nb.png", "\ud800", None, 7],
)
def test_a_path_that_is_none_or_leaves_the_folder_is_refused(file):
    assert "file is" in refusal(naming.check_image, file)


@given(st.text(max_size=12))
def test_any_text_is_a_path_on_one_line_or_refused(text):
    try:
        naming.check_image(text)
    except InputError:
        return
    assert text.splitlines() == [text] and ".." not in text.split("/")


@FORMATS
def test_no_pictures_make_no_dataset(make):
    assert "no picture" in refusal(make, [])


@FORMATS
def test_two_pictures_of_one_file_are_refused_by_its_name(make):
    assert "a.png would be" in refusal(make, [Camera("a", PINHOLE), Camera("b", PINHOLE), Camera("a", PINHOLE)])


@FORMATS
def test_mirrored_cameras_are_refused_by_name_however_many(make):
    views = [Camera("fine", PINHOLE), *(Camera(f"{i}", MIRRORED) for i in range(1000))]
    sentence = refusal(make, views)
    assert "mirrored" in sentence and "0.png, 1.png, 2.png and 997 more" in sentence and "fine" not in sentence


@pytest.mark.parametrize("file", ["left eye.png", "left\u00a0eye.png"], ids=["plain", "non-breaking"])
def test_a_name_with_a_space_is_refused_by_colmap_alone(file):
    views = [Camera("view", PINHOLE, image=file)]
    assert file in refusal(colmap.texts, views)
    assert transforms.document(views)["frames"][0]["file_path"] == file


any_float = st.floats(allow_nan=False, allow_infinity=False)
any_triple = st.tuples(any_float, any_float, any_float)


@FORMATS
@given(any_triple, any_triple, any_triple, st.floats(min_value=5e-324, allow_infinity=False), st.tuples(any_float, any_float))
def test_any_camera_is_written_in_finite_numbers_or_refused(make, eye, look_at, up, distance, point):
    assume(eye != look_at and any(up))
    try:
        content = repr(make([Camera("a", Pinhole(eye, look_at, up, distance, 640, 360, point))]))
    except InputError as error:
        assert make is colmap.texts and "translation" in str(error)
    else:
        assert not re.search(r"\b(nan|inf)\b", content)


def test_an_eye_whose_translation_float64_can_not_hold_is_refused():
    far = Pinhole((1.7e308, 1.7e308, 1.7e308), (0, 0, 0), (0, 0, 1), 1200.0, 640, 360)
    assert "translation" in refusal(colmap.texts, [Camera("a", far)])
