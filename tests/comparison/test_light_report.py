"""The report of light is one file that stands alone, and says and shows what the comparison says."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from viewcam_addon.comparison import light_report, pictures, radiance
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole

PINHOLE = Pinhole((5, -7, 4), (0.2, 0.1, 0.6), (0, 0, 1), 60.0, 64, 48)
rows, columns = np.mgrid[:48, :64]
TRUTH = np.stack([0.2 + 0.5 * columns / 64, 0.3 + 0.3 * rows / 48, np.full((48, 64), 0.4)], axis=-1)
VOID = frozenset(("meta", "img", "input", "br", "link", "hr"))


class Page(HTMLParser):
    """The words and tags of a page; every element must be closed."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.words, self.open = [], [], []
        self.feed(text)
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        while self.open[-1] != tag and self.open[-1] in ("p", "li", "div"):
            self.open.pop()
        assert self.open.pop() == tag, f"</{tag}> closes nothing"

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())

    @property
    def tabs(self):
        return [attributes["value"] for tag, attributes in self.tags if tag == "input" and attributes.get("name") == "view"]


def picture(values, samples, source):
    passes = {"Combined": np.concatenate([values, np.ones((48, 64, 1))], axis=-1), "Depth": np.full((48, 64, 1), 8.0)}
    passes["Variance"] = TRUTH**2 / samples if samples > 1 else 0 * TRUTH
    return Image({name: v.astype(np.float32) for name, v in passes.items()}, PINHOLE, {"samples": str(samples)}, source)


def noisy(factor, samples, seeds=8):
    rng = np.random.default_rng(0)
    drawn = [factor * rng.gamma(samples // seeds, seeds / samples, (48, 64, 1)) * TRUTH for _ in range(seeds)]
    tests = [picture(values, samples // seeds, f"<b>{seed}.exr") for seed, values in enumerate(drawn)]
    return picture(rng.gamma(samples, 1 / samples, (48, 64, 1)) * TRUTH, samples, "reference.exr"), tests


def written(folder, reference, tests, **more):
    comparison = radiance.compare(reference, tests, PINHOLE)
    path = light_report.write_report(comparison, reference, tests, folder / "report", **more)
    assert [path] == list((folder / "report").iterdir())
    text = path.read_text(encoding="utf-8")
    return comparison, text, Page(text)


@pytest.fixture(scope="module")
def passed(tmp_path_factory):
    return written(tmp_path_factory.mktemp("passed"), *noisy(1.0, 256), command="viewcam compare a b c")


def test_the_report_of_noise_says_what_the_comparison_says(passed):
    comparison, text, page = passed
    assert '<html lang="en" class="same">' in text
    for words in (
        "The same within noise at 256 samples.",
        "tiles of 32 × 32",
        "Is it noise?",
        "in 8 pictures",
        "the same to the last bit",
    ):
        assert words in page.text, words
    assert f"{comparison.rows[0].ratio:.5f}" in page.text and "viewcam compare a b c" in page.text
    assert "Under the loupe" not in page.text


def test_the_first_view_is_the_picture_and_all_maps_have_one(passed):
    """The page's script starts with the view "picture"."""
    assert passed[2].tabs == ["picture", "combined-difference", "combined-tiles", "combined-standard-errors", "flip"]


def test_the_report_of_light_stands_alone_and_every_image_has_words(passed):
    _, text, page = passed
    images = [attributes for tag, attributes in page.tags if tag == "img"]
    assert images and all(image["alt"] and image["src"].startswith("data:image/png;base64,") for image in images)
    assert not re.search(r"https?://|@import|url\(", text)
    assert "$" not in re.sub(r"<script>.*</script>", "", text, flags=re.DOTALL), "a placeholder was left unfilled"
    assert "<b>0.exr" not in text


def test_a_failed_comparison_shows_the_place_under_the_loupe(tmp_path):
    wrong = np.ones((48, 64, 1))
    wrong[8:16, 16:24] = 1.4
    _, text, page = written(tmp_path, *noisy(wrong, 256))
    assert '<html lang="en" class="different">' in text
    assert "Different here. In columns 16 to 23, rows 8 to 15 Combined" in page.text
    assert "Under the loupe" in page.text and "beyond" not in page.tabs


def test_light_without_noise_is_reported_in_roundings(tmp_path):
    exact = picture(TRUTH, 1, "reference.exr")
    test = replace(exact, passes={**exact.passes, "Combined": exact["Combined"] * np.float32(1 + 2e-7)})
    _, _, page = written(tmp_path, exact, [test])
    assert "The same picture." in page.text and "Roundings" in page.text and "Is it noise?" not in page.text
    assert page.tabs == ["picture", "combined-difference", "combined-roundings", "flip"]


@pytest.mark.parametrize("value", [0.0, 1e-20, 1e20])
def test_black_faint_and_glaring_pictures_make_a_report(tmp_path, value):
    image = picture(np.full((48, 64, 3), value), 1, "flat.exr")
    assert written(tmp_path, image, [image])[0].passed


def test_what_is_below_zero_is_blue_and_above_is_orange_and_zero_is_dark():
    levels = pictures.signed(np.array([[-1.0, 0.0, 1.0, 9.0, np.nan]], np.float32), 1.0)[0]
    assert levels.tolist() == [1, pytest.approx(pictures.LEVELS / 2, abs=1), pictures.LEVELS, pictures.LEVELS, 0]
    scale = pictures.signed_scale().astype(int)
    assert scale[0, 2] > scale[0, 0] + 40 and scale[-1, 0] > scale[-1, 2] + 40
    assert scale[pictures.LEVELS // 2].max() < 60
    brightness = scale.sum(axis=1)
    assert (np.diff(brightness[: pictures.LEVELS // 2]) <= 0).all() and (np.diff(brightness[pictures.LEVELS // 2 :]) >= 0).all()


def test_a_reduced_map_keeps_what_is_farthest_from_zero():
    values = np.zeros((40, 4000), np.float32)
    values[3, 7], values[30, 3001] = -5.0, 4.0
    levels = pictures.signed(values, 5.0)
    assert levels.shape[1] <= 1920
    assert (levels == 1).sum() == 1 and (levels > pictures.LEVELS * 0.8).sum() == 1
