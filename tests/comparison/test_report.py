"""The report is one file that stands alone, says what the comparison says, and lets nothing through that comes from outside.

The report of light is one file that stands alone, and says and shows what the comparison says.
"""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from viewcam_addon.comparison import pictures, radiance, report
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.comparison.light_verdict import change_text
from viewcam_addon.comparison.verdict import FarFromOrigin, percent
from viewcam_addon.errors import InputError
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import LedgerEntry

LEDGER = (
    LedgerEntry("Suzanne", "exported"),
    LedgerEntry("<script>alert(1)</script>", "skipped", "hair & fur have no counterpart"),
)


class Page(HTMLParser):
    """The page as a browser would make it: tags with attributes, balanced, and the text."""

    VOID = frozenset(("meta", "img", "input", "br", "link", "hr"))

    def __init__(self, text):
        super().__init__()
        self.tags, self.words, self.open = [], [], []
        self.feed(text)
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        while self.open and self.open[-1] != tag and self.open[-1] in ("p", "li", "div"):
            self.open.pop()
        assert self.open and self.open.pop() == tag, f"</{tag}> closes nothing"

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())

    @property
    def tabs(self):
        return [attributes["value"] for tag, attributes in self.tags if tag == "input" and attributes.get("name") == "view"]


@pytest.fixture(scope="module")
def compared(far_scene):
    reference, test = (
        replace(far_scene.picture(), source="reference.exr"),
        replace(far_scene.rendered(seed=1), source="a<b>.exr"),
    )
    return compare(reference, test, far_scene.pinhole, far_scene.surfaces_at, far_scene.pinhole), reference, test


def written(tmp_path, comparison, reference, test, **more):
    path = report.write_geometry(comparison, reference, test, tmp_path / "report", **more)
    assert path == tmp_path / "report" / "index.html"
    text = path.read_text(encoding="utf-8")
    return text, Page(text)


def test_the_report_says_what_the_comparison_says(compared, tmp_path):
    comparison, reference, test = compared
    _, page = written(tmp_path, comparison, reference, test, ledger=LEDGER, command="viewcam compare a b")
    assert "The same picture." in page.text
    for words in ("Position", "Object index", "hair & fur", "1 of 2 objects", "viewcam compare a b", "Under the loupe"):
        assert words in page.text, words


def test_the_two_sides_are_called_by_their_names_and_the_camera_is_told_as_typed_and_as_read_back(compared, tmp_path):
    comparison, reference, test = compared
    x, y, z = comparison.pinhole.eye
    typed = replace(comparison.pinhole, eye=(float(np.float32(0.1)), y, z), distance=512.25)
    _, page = written(tmp_path, replace(comparison, stated=typed), reference, test)
    words = " ".join(page.text.split())
    assert "Tracer" in words and "Cycles" in words and "test on the right" not in words
    assert f"as typed e, eye 0.1 {y} {z}" in words and f"as read back from Blender e, eye {x:.9g}" in words, words[-900:]
    assert "512.25 px" in words
    _, page = written(tmp_path, replace(comparison, renderer="EEVEE", stated=None), reference, test)
    assert "EEVEE" in page.text and "as typed" not in page.text, "nobody typed one"


def test_a_failed_comparison_says_so_at_the_top(paper_scene, tmp_path):
    reference, test = paper_scene.picture(), paper_scene.picture(1.0, 0.5)
    text, page = written(tmp_path, compare(reference, test, paper_scene.pinhole, paper_scene.surfaces_at), reference, test)
    assert "Not the same picture." in page.text and "shifted by (+0.5" in page.text
    assert '<html lang="en" class="different">' in text


def test_the_report_is_called_by_file_camera_and_frame(compared, tmp_path):
    comparison, reference, test = compared
    stamp = {"File": r"C:\films\shot <7>.blend", "Camera": "Hero", "Frame": "012"}
    _, page = written(tmp_path, comparison, reference, replace(test, attributes=stamp))
    assert "shot <7>.blend · camera Hero · frame 12" in page.text
    _, page = written(tmp_path, *compared)
    assert "a<b>.exr" in page.text, "without a stamp the picture's own name is all that is known"


def test_the_report_stands_alone(compared, tmp_path):
    text, page = written(tmp_path, *compared, ledger=LEDGER)
    assert list((tmp_path / "report").iterdir()) == [tmp_path / "report" / "index.html"]
    sources = [attributes[key] for _, attributes in page.tags for key in ("src", "href") if key in attributes]
    assert sources and all(source.startswith("data:image/png;base64,") for source in sources)
    assert not re.search(r"https?://|@import|url\(", text)
    assert "$" not in re.sub(r"<script>.*</script>", "", text, flags=re.DOTALL), "a placeholder was left unfilled"


def test_what_comes_from_outside_is_escaped(compared, tmp_path):
    comparison, reference, test = compared
    text, page = written(tmp_path, comparison, reference, replace(test, attributes={"Note": "</td><b>5</b>"}), ledger=LEDGER)
    assert text.count("<script>") == 1 and "a<b>.exr" not in text
    assert "<script>alert(1)</script>" in page.text and "</td><b>5</b>" in page.text


def test_every_image_has_words_for_those_who_can_not_see_it(compared, tmp_path):
    _, page = written(tmp_path, *compared)
    images = [attributes for tag, attributes in page.tags if tag == "img"]
    assert images and all("alt" in attributes for attributes in images)
    stage = next(attributes for _, attributes in page.tags if attributes.get("id") == "stage")
    assert stage["tabindex"] == "0" and stage["role"] == "button" and stage["aria-label"]


def test_nothing_compared_still_makes_a_report(paper_scene, tmp_path):
    pinhole = replace(paper_scene.pinhole, look_at=(5.0, -7.0, 9.0), up=(0.0, 1.0, 0.0))
    empty = paper_scene.seen_by(pinhole).picture()
    _, page = written(tmp_path, compare(empty, empty, pinhole), empty, empty)
    assert "Nothing to compare." in page.text and "nothing was compared" in page.text


def test_many_mismatches_are_painted_and_not_drawn(paper_scene, tmp_path):
    reference = paper_scene.picture()
    passes = {name: values.copy() for name, values in reference.passes.items()}
    passes["Object Index"] += passes["Object Index"] > 0
    test = replace(reference, passes=passes)
    text, _ = written(tmp_path, compare(reference, test, paper_scene.pinhole), reference, test)
    assert '<svg class="marks"' not in text and '<img class="marks"' in text
    assert len(text) < 3_000_000


def test_combined_is_shown_where_the_renderer_made_one(compared, tmp_path):
    comparison, reference, test = compared
    colors = np.random.default_rng(0).random((*test["Depth"].shape[:2], 4), dtype=np.float32)
    rendered = replace(test, passes={**test.passes, "Combined": colors})
    assert "As rendered" in written(tmp_path, comparison, reference, rendered)[1].text


def test_a_folder_that_is_a_file_is_refused(compared, tmp_path):
    (tmp_path / "taken").write_text("here")
    with pytest.raises(InputError, match="taken is a file"):
        report.write_geometry(*compared, tmp_path / "taken")


def test_the_report_tells_what_mends_it_and_where_its_origin_is(compared, tmp_path):
    comparison, reference, test = compared
    far = FarFromOrigin(1.2, True, 6.4e6)
    path = report.write_geometry(replace(comparison, far_from_origin=far), reference, test, tmp_path / "far")
    page = Page(path.read_text(encoding="utf-8"))
    assert "Cycles is 1.2 px off here, because the camera stands 6.4·10⁶ from the origin: check with --recenter." in page.text
    path = report.write_geometry(replace(comparison, origin=(4600000.25, 0.0, -1.0)), reference, test, tmp_path / "recentered")
    page = Page(path.read_text(encoding="utf-8"))
    assert "origin 4600000.25 0 -1" in page.text and "--recenter" not in page.text


PINHOLE = Pinhole((5, -7, 4), (0.2, 0.1, 0.6), (0, 0, 1), 60.0, 64, 48)
rows, columns = np.mgrid[:48, :64]
TRUTH = np.stack([0.2 + 0.5 * columns / 64, 0.3 + 0.3 * rows / 48, np.full((48, 64), 0.4)], axis=-1)


def picture(values, samples, source):
    passes = {"Combined": np.concatenate([values, np.ones((48, 64, 1))], axis=-1), "Depth": np.full((48, 64, 1), 8.0)}
    passes["Variance"] = TRUTH**2 / samples if samples > 1 else 0 * TRUTH
    return Image({name: v.astype(np.float32) for name, v in passes.items()}, PINHOLE, {"samples": str(samples)}, source)


def noisy(factor, samples, seeds=8):
    rng = np.random.default_rng(0)
    drawn = [factor * rng.gamma(samples // seeds, seeds / samples, (48, 64, 1)) * TRUTH for _ in range(seeds)]
    tests = [picture(values, samples // seeds, f"<b>{seed}.exr") for seed, values in enumerate(drawn)]
    return picture(rng.gamma(samples, 1 / samples, (48, 64, 1)) * TRUTH, samples, "reference.exr"), tests


def written_light(folder, reference, tests, **more):
    comparison = radiance.compare(reference, tests, PINHOLE)
    path = report.write_light(comparison, reference, tests, folder / "report", **more)
    assert [path] == list((folder / "report").iterdir())
    text = path.read_text(encoding="utf-8")
    return comparison, text, Page(text)


@pytest.fixture(scope="module")
def passed(tmp_path_factory):
    return written_light(tmp_path_factory.mktemp("passed"), *noisy(1.0, 256), command="viewcam compare a b c")


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
    _, text, page = written_light(tmp_path, *noisy(wrong, 256))
    assert '<html lang="en" class="different">' in text
    assert "Different here. In columns 16 to 23, rows 8 to 15 Combined" in page.text
    assert "Under the loupe" in page.text and "beyond" not in page.tabs


def test_light_without_noise_is_reported_in_roundings(tmp_path):
    exact = picture(TRUTH, 1, "reference.exr")
    test = replace(exact, passes={**exact.passes, "Combined": exact["Combined"] * np.float32(1 + 2e-7)})
    _, _, page = written_light(tmp_path, exact, [test])
    assert "The same picture." in page.text and "Roundings" in page.text and "Is it noise?" not in page.text
    assert page.tabs == ["picture", "combined-difference", "combined-roundings", "flip"]


@pytest.mark.parametrize("value", [0.0, 1e-20, 1e20])
def test_black_faint_and_glaring_pictures_make_a_report(tmp_path, value):
    image = picture(np.full((48, 64, 3), value), 1, "flat.exr")
    assert written_light(tmp_path, image, [image])[0].passed


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


@pytest.mark.parametrize(("share", "words"), [(0.87, "87%"), (12.04, "12 times"), (1683.2, "1,680 times"), (np.inf, "∞ times")])
def test_how_much_of_a_tolerance_is_used_has_no_powers_of_ten(share, words):
    assert percent(share) == words


def test_how_much_brighter_something_is_has_no_powers_of_ten():
    assert change_text(1e-4, 2.0) == "20,000 times as bright"
    assert change_text(2.0, 1e-4) == "0.00005 times as bright"
