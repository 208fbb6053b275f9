"""Pages take all that is put into them as text, and say what they lack."""

import html
from types import SimpleNamespace

import jinja2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon import html_page
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
