"""The contact sheet shows every shot, leads to its files whatever they are called, and says what went wrong."""

import json
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.jobs import sheet
from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.summary import Result, Summary


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.images, self.texts, self.tags, self.attributes = [], [], [], [], set()
        self.feed(text)
        self.text = " ".join(" ".join(self.texts).split())

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.tags.append(tag)
        self.attributes |= set(attributes)
        if tag == "a":
            self.links.append(unquote(attributes["href"]))
        if tag == "img":
            self.images.append(attributes)

    def handle_data(self, data):
        self.texts.append(data)


def page(folder):
    return Page((folder / "contact-sheet.html").read_text(encoding="utf-8"))


def test_each_shot_is_a_thumbnail_that_leads_to_its_files(tmp_path, painting):
    painting.paint(tmp_path, 3)
    actual = page(tmp_path)
    names = [f"shot_00{number}" for number in range(3)]
    assert [image["alt"] for image in actual.images] == names
    assert all(image["loading"] == "lazy" and (image["width"], image["height"]) == ("4", "3") for image in actual.images)
    assert actual.links == [f"{name}.{suffix}" for name in names for suffix in ("png", "exr", "json")]
    assert all((tmp_path / link).exists() for link in actual.links)
    assert "3 shots" in actual.text and "All are there." in actual.text and "Only what went wrong" not in actual.text


def test_pictures_that_were_not_checked_have_no_tick_on_the_page(tmp_path, painting):
    painting.paint(tmp_path / "unchecked", 2)
    painting.paint(tmp_path / "checked", 2, check=True)
    heads = {name: (tmp_path / name / "contact-sheet.html").read_text() for name in ("unchecked", "checked")}
    assert 'class="unasked"' in heads["unchecked"] and 'aria-hidden="true"><path' not in heads["unchecked"]
    assert 'class="same"' in heads["checked"] and 'aria-hidden="true"><path' in heads["checked"]


def test_a_picture_of_which_not_all_is_modeled_makes_the_page_amber(tmp_path):
    counts = {"shots": 2, "done": 2, "failed": 0, "left": 0, "checked": 2, "checks_failed": 0, "not_all_modeled": 1}
    sheet.write(tmp_path / "sheet.html", [], counts)
    text = (tmp_path / "sheet.html").read_text()
    assert 'class="same_but"' in text and "1 with objects that are not modeled" in text


def test_what_went_wrong_is_told_by_name(tmp_path, painting):
    broken = {"shot_001": InputError("the lamp <Key & Fill> is broken: mend it")}
    painting.paint(tmp_path, 4, painter=painting.Painter(broken=broken, unlike=["shot_002"]), check=True)
    actual = page(tmp_path)
    assert "3 are there, 1 could not be rendered, 1 different from Cycles' picture." in actual.text
    assert "the lamp <Key & Fill> is broken: mend it" in actual.text and "the left half is < the right half" in actual.text
    assert "Only what went wrong" in actual.text and 'class="different"' in (tmp_path / "contact-sheet.html").read_text()


def test_the_same_batch_gives_the_same_page(tmp_path, painting):
    for name, pause in (("a", 0.0), ("b", 0.01)):
        painting.paint(tmp_path / name, 2, painter=painting.Painter(pause=pause))
    assert (tmp_path / "a" / "contact-sheet.html").read_bytes() == (tmp_path / "b" / "contact-sheet.html").read_bytes()


def _can_be_a_shot(name):
    try:
        return bool(Job(name, camera="C"))
    except InputError:
        return False


names = st.text(st.characters(exclude_categories=["C"]) | st.sampled_from("&'%;=+@ü左𝔸(){}"), min_size=1, max_size=12)


@given(names.filter(_can_be_a_shot), st.text(max_size=20))
def test_names_and_sentences_of_any_letters_are_shown_and_led_to_as_they_are(name, words):
    files = {"image": f"{name}.exr", "preview": f"{name}.png"}
    check = {"passed": False, "verdict": words}
    record = files | {"rendered": {"width": 4, "height": 3}, "warnings": [words], "check": check}
    actual = Page(sheet.picture(Result(name, record)))
    assert actual.links == [f"{name}.png", f"{name}.exr", f"{name}.json"]
    assert unquote(actual.images[0]["src"]) == f"{name}.png" and actual.images[0]["alt"] == name
    assert actual.texts[0] == name
    assert set(actual.tags) <= {"figure", "a", "img", "figcaption", "b", "p", "span"}
    failed = Page(sheet.picture(Result(name, None, words or "it failed")))
    assert failed.texts[0] == name and set(failed.tags) <= {"figure", "figcaption", "b", "p", "span"}


@given(names.filter(_can_be_a_shot))
def test_a_link_stays_in_the_folder(name):
    record = {"image": f"{name}.exr", "preview": f"{name}.png", "rendered": {"width": 4, "height": 3}, "warnings": []}
    text = sheet.picture(Result(name, record))
    for image in Page(text).images:
        parts = urlsplit(image["src"])
        assert not parts.scheme and not parts.netloc and not parts.query and not parts.fragment and "/" not in parts.path


def test_each_shot_says_what_it_is_of_by_which_lens_and_at_what_angle():
    record = {
        "shot": {"name": "a"},
        "rendered": {"file": "film.blend", "camera": "Hero <1>", "width": 1000, "height": 500, "frame": 12},
        "camera": {"distance": [500.0, 500.0], "width": 1000},
        "blender": {"lens": 18.0},
    }
    assert sheet.facts(record) == ["film.blend", "Hero <1>", "frame 12", "1000 × 500", "18 mm", "90° across"]
    page = Page(sheet.picture(Result("a", {**record, "warnings": []})))
    assert "film.blend · Hero <1> · frame 12 · 1000 × 500 · 18 mm · 90° across" in page.text
    for broken in (
        {},
        {"camera": 5},
        {"camera": {"distance": []}, "rendered": {"frame": "1"}},
        {"camera": {"distance": [0.0]}},
    ):
        assert sheet.facts(broken) == []


def test_each_picture_has_its_verdict_or_says_that_it_was_not_checked():
    record = {"image": "a.exr", "rendered": {"width": 4, "height": 3}, "warnings": []}

    def text_of(check):
        return Page(sheet.picture(Result("a", {**record, **({"check": check} if check else {})}))).text

    assert "not checked" in text_of(None)
    passed = {"passed": True, "verdict": "The same picture.", "figures": {"position": {"p50": 1e-5, "max": 0.000304}}}
    assert "identical to 0.0003 px" in text_of(passed) and "not checked" not in text_of(passed)
    assert "identical" in text_of({**passed, "figures": {"position": {}}})
    assert "differs Another picture." in text_of({"passed": False, "verdict": "Another picture."})
    nothing = "Nothing to compare: no pixel of either picture shows an object."
    assert f"nothing to compare {nothing}" in text_of({"passed": False, "verdict": nothing})
    but = {**passed, "answer": "same_but", "not_modeled": {"count": 2, "names": ["Hair", "Fog"], "share": 0.25}}
    assert "identical to 0.0003 px, but for 2 objects that are not modeled" in text_of(but)
    assert "class=but" in sheet.picture(Result("a", {**record, "check": but}))
    without_picture = {key: value for key, value in record.items() if key != "image"}
    assert "not checked" not in Page(sheet.picture(Result("a", without_picture))).text, "labels alone are no picture"


def test_a_click_shows_a_picture_larger_and_the_page_says_when_it_was_made(tmp_path, painting):
    painting.paint(tmp_path, 2)
    text = (tmp_path / "contact-sheet.html").read_text(encoding="utf-8")
    assert text.count('class="large"') == 2 and "showModal" in text and "document.lastModified" in text


ATTACK = "4\"><script>alert(1)</script><img src=x onerror='alert(2)' alt=\""


def attacked(value):
    """The value, once for each leaf of it, with an attack in that leaf's place."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from (value | {key: each} for each in attacked(inner))
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from ([*value[:number], each, *value[number + 1 :]] for each in attacked(inner))
    else:
        yield ATTACK
        yield "javascript:alert(1)"
        yield "../../secret"


def test_whatever_a_sidecar_says_it_is_text_in_the_page(tmp_path, painting):
    """The size was not: a sidecar that comes from elsewhere could run a script in the browser of who opens the page."""
    painting.paint(tmp_path, 1, check=True)
    whole = json.loads((tmp_path / "shot_000.json").read_text(encoding="utf-8"))
    safe = Page(sheet.picture(Result("shot_000", whole)))
    records = list(attacked(whole))
    assert len(records) > 3 * 10, "the sidecar has lost its keys"
    for record in records:
        actual = Page(sheet.picture(Result("shot_000", record)))
        assert actual.attributes == safe.attributes and actual.links == safe.links, record
        assert [tag for tag in actual.tags if tag not in ("p", "span")] == [
            tag for tag in safe.tags if tag not in ("p", "span")
        ]


def test_counts_are_what_the_exit_status_goes_by():
    done, wrong = {"state": "done", "answer": "same"}, {"state": "done", "answer": "different"}
    failed, left = {"state": "failed"}, {"state": "left"}
    for shots, signal, status in [
        ([done], None, 0),
        ([done, {"state": "done", "answer": "same_but"}], None, 0),
        ([done, wrong], None, 1),
        ([done, wrong, failed], None, 4),
        ([left], None, 4),
        ([done], 2, 130),
        ([left, failed], 15, 143),
    ]:
        assert Summary(tuple(shots), 0, 0, 0, 1.0, signal).exit_status == status
