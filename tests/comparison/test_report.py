"""The report is one file that stands alone, says what the comparison says, and lets nothing through that comes from outside."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from viewcam_addon.comparison.far_from_origin import FarFromOrigin
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.comparison.report import write_report
from viewcam_addon.errors import InputError
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


@pytest.fixture(scope="module")
def compared(far_scene):
    reference, test = (
        replace(far_scene.picture(), source="reference.exr"),
        replace(far_scene.rendered(seed=1), source="a<b>.exr"),
    )
    return compare(reference, test, far_scene.pinhole, far_scene.surfaces_at, far_scene.pinhole), reference, test


def written(tmp_path, comparison, reference, test, **more):
    path = write_report(comparison, reference, test, tmp_path / "report", **more)
    assert path == tmp_path / "report" / "index.html"
    text = path.read_text(encoding="utf-8")
    return text, Page(text)


def test_the_report_says_what_the_comparison_says(compared, tmp_path):
    comparison, reference, test = compared
    _, page = written(tmp_path, comparison, reference, test, ledger=LEDGER, command="viewcam compare a b")
    assert "The same picture." in page.text
    for words in ("Position", "Object index", "hair & fur", "1 of 2 objects", "viewcam compare a b", "Under the loupe"):
        assert words in page.text, words
    assert not page.open, f"never closed: {page.open}"


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
        write_report(*compared, tmp_path / "taken")


def test_the_report_tells_what_mends_it_and_where_its_origin_is(compared, tmp_path):
    comparison, reference, test = compared
    far = FarFromOrigin(1.2, True, 6.4e6)
    path = write_report(replace(comparison, far_from_origin=far), reference, test, tmp_path / "far")
    page = Page(path.read_text(encoding="utf-8"))
    assert "Cycles is 1.2 px off here, because the camera stands 6.4·10⁶ from the origin: check with --recenter." in page.text
    path = write_report(replace(comparison, origin=(4600000.25, 0.0, -1.0)), reference, test, tmp_path / "recentered")
    page = Page(path.read_text(encoding="utf-8"))
    assert "origin 4600000.25 0 -1" in page.text and "--recenter" not in page.text
