"""The pages that show charts: all of them, and no others, with the figures that they were drawn from."""

import html
import json
import re
from pathlib import Path

import pytest

from benchmarks import charts

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.parametrize("subject", ["stability", "light", "speed", "judge"])
def test_the_page_shows_every_chart_and_the_figures_that_it_was_drawn_from(subject):
    figures = json.loads((DOCS / "charts" / f"{subject}.json").read_text(encoding="utf-8"))
    page = (DOCS / f"{subject}.md").read_text(encoding="utf-8")
    present = set(re.findall(rf"\(charts/({subject}-[a-z-]+)\.svg\)", page))
    drawings = {each["drawing"] for each in figures["charts"].values()}
    assert present == drawings == {path.stem for path in (DOCS / "charts").glob(f"{subject}-*.svg")}
    # What is missed is told in so many words; of races, by the page's table (tests/test_project.py).
    assert subject == "speed" or all(sentence in page.replace("\n", " ") for sentence in figures["behind"])


@pytest.mark.parametrize("subject", ["stability", "light", "speed", "judge"])
def test_every_chart_follows_a_dark_page_and_is_of_its_figures(subject):
    figures = json.loads((DOCS / "charts" / f"{subject}.json").read_text(encoding="utf-8"))
    for name, each in figures["charts"].items():
        drawn = html.unescape((DOCS / "charts" / f"{each['drawing']}.svg").read_text(encoding="utf-8"))
        chart = charts.Chart.of_figures(each)
        assert "prefers-color-scheme: dark" in drawn, f"{name} stays light on a dark page"
        for record in (chart.title, chart.reading, each["command"], each["machine"]):
            assert record in drawn, (
                f"{name} does not say {record!r}: python -m benchmarks {subject} --figures docs/charts/{subject}.json"
            )
