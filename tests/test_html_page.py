"""Pages take all that is put into them as text, and say what they lack."""

import html
import json
from types import SimpleNamespace
from xml.etree import ElementTree

import jinja2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon import html_page, junit
from viewcam_addon.cli import main
from viewcam_addon.errors import InputError

SHOT = "jobs/sheet_picture.html"


@given(st.text())
def test_whatever_is_put_in_is_text(words):
    failed = SimpleNamespace(record=None, name="shot", state="failed", error=words)
    page = str(html_page.filled(SHOT, shot=failed, file="shot"))
    before, after = str(html_page.filled(SHOT, shot=SimpleNamespace(**{**vars(failed), "error": "|"}), file="shot")).split("|")
    assert page.startswith(before) and page.endswith(after)
    inside = page[len(before) : len(page) - len(after)]
    assert html.unescape(inside) == words and not {"<", ">", '"', "'"} & set(inside)


def test_a_value_that_nobody_gave_is_an_error_and_no_gap():
    with pytest.raises(jinja2.UndefinedError, match="shot"):
        html_page.filled(SHOT)


def test_without_jinja_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setattr(html_page.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="HTML pages need Jinja2: install the extension from its zip"):
        html_page.filled(SHOT)


# --- JUnit XML as pytest writes it, judged by an XML parser and by what pytest itself writes


SCENE = {
    "format": "virtual-pinhole-scene",
    "version": 1,
    "camera": {"eye": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "distance": 100, "width": 32, "height": 24},
    "geometries": {"ball": {"type": "spheres", "centers": [[0, 0, 0]], "radii": [1]}},
    "objects": [{"name": "Ball", "geometry": "ball", "object_index": 3}],
}


def test_figures_are_properties_by_their_keys_and_what_has_no_name_is_left_out():
    figures = {
        "passed": False,
        "sentence": "not the same",
        "size": [64, 48],
        "passes": [{"name": "Depth", "max": 0.5}, {"name": "UV", "max": float("nan")}],
        "ledger": [{"object": "Cube"}],
        "conversion": None,
    }
    assert junit.properties(figures) == [
        ("passed", "false"),
        ("sentence", "not the same"),
        ("size", "64 48"),
        ("passes.Depth.max", "0.5"),
    ]


@pytest.mark.parametrize(
    ("status", "result", "kind", "message"),
    [
        (0, {"sentence": "same"}, None, None),
        (1, {"sentence": "not the same"}, "failure", "not the same"),
        (2, {"error": "no such file"}, "error", "no such file"),
        (3, {}, "error", "exit status 3"),
    ],
)
def test_the_verdict_is_the_message_and_counted_once(tmp_path, status, result, kind, message):
    junit.write(tmp_path / "a.xml", "check a.blend", status, result, 1.25)
    (suite,) = ElementTree.parse(tmp_path / "a.xml").getroot()
    counts = {"errors": kind == "error", "failures": kind == "failure", "skipped": False, "tests": True}
    assert {name: int(suite.get(name)) for name in counts} == counts
    (case,) = suite
    assert (case.get("name"), case.get("time")) == ("check a.blend", "1.250")
    collected = [child for child in case if child.tag != "properties"]
    assert [(child.tag, child.get("message"), child.text) for child in collected] == (
        [(kind, message, message)] if kind else []
    )


@given(st.text(st.characters(), max_size=40))
def test_any_text_makes_a_file_that_parsers_read(tmp_path_factory, text):
    path = tmp_path_factory.getbasetemp() / "any.xml"
    junit.write(path, text, 1, {"sentence": text, text or "k": text}, 0.0)
    (case,) = ElementTree.parse(path).getroot().iter("testcase")
    # Characters that XML can't hold are told as #x1B, and the rest of the text remains; a parser makes blanks of the ends of
    # lines.
    plain = "".join(f"#x{ord(c):02X}" if not _is_xml(c) else c for c in text)
    assert case.get("name") == plain


def _is_xml(character):
    return character in "\t\n\r" or " " <= character < "\ud800" or "\ue000" <= character <= "\ufffd" or character > "\uffff"


def test_a_comparison_writes_it_whole_and_what_can_not_be_written_is_one_sentence(tmp_path, capfd):
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    picture = str(tmp_path / "a.exr")
    assert main(["render", str(tmp_path / "scene.json"), picture]) == 0
    assert main(["compare", picture, picture, "--junit", str(tmp_path / "a.xml"), "--json", str(tmp_path / "a.json")]) == 0
    (case,) = ElementTree.parse(tmp_path / "a.xml").getroot().iter("testcase")
    properties = {each.get("name"): each.get("value") for each in case.iter("property")}
    assert properties == dict(junit.properties(json.loads((tmp_path / "a.json").read_text())))
    assert main(["compare", picture, str(tmp_path / "none.exr"), "--junit", str(tmp_path / "b.xml")]) == 2
    (case,) = ElementTree.parse(tmp_path / "b.xml").getroot().iter("testcase")
    assert "none.exr" in case.find("error").get("message")
    capfd.readouterr()
    assert main(["compare", picture, picture, "--junit", str(tmp_path)]) == 2
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert "is a folder" in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr", "a.json", "a.xml", "b.xml", "scene.json"]
