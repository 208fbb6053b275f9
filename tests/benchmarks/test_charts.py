"""The pages that show charts: all of them, and no others, with the figures that they were drawn from."""

import html
import json
import math
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from benchmarks import charts
from benchmarks.charts import Chart, Curve
from viewcam_addon.errors import InputError

X = (1.0, 0.1, 0.01)


def chart_of(*curves, **changes):
    settings = {"reading": "Read this.", "tie": 1e-16, "reverse": True, **changes}
    return Chart("name", "A title", "x", "y", curves, **settings)


def test_a_method_in_use_that_is_best_everywhere_is_behind_nowhere():
    assert chart_of(Curve("ours", X, (1e-9, 1e-9, 1e-9), ours=True), Curve("other", X, (1e-9, 6e-10, 1e-3))).behind() == []


@pytest.mark.parametrize("error", [3e-9, math.inf, math.nan])
def test_a_method_in_use_that_is_worse_somewhere_is_told_with_both_figures(error):
    (sentence,) = chart_of(Curve("ours", X, (1e-9, error, 1e-9), ours=True), Curve("other", X, (1e-9, 1e-9, 1e-3))).behind()
    assert "at 0.1" in sentence and f"{error:.3g}" in sentence and "other by 1e-09" in sentence


def test_errors_within_a_tie_are_equal():
    assert chart_of(Curve("ours", X, (1e-16, 9e-17, 0), ours=True), Curve("other", X, (0, 0, 0))).behind() == []
    curve = Curve("ours", X, (3e-8, 0, 0), ours=True, tie=1e-7)
    assert chart_of(curve, Curve("other", X, (0, 0, 0))).behind() == []


def test_curves_compete_within_their_league_only():
    ours = Curve("stored", X, (1e-7, 1e-7, 1e-7), ours=True, league="float32")
    assert chart_of(ours, Curve("other", X, (0, 0, 0))).behind() == []
    assert len(chart_of(ours, Curve("other", X, (0, 0, 0), league="float32")).behind()) == 3


def test_a_rival_without_an_answer_beats_nobody():
    assert chart_of(Curve("ours", X, (1, 1, math.nan), ours=True), Curve("other", X, (math.nan,) * 3)).behind() == []


def test_what_is_above_a_limit_is_told_with_both_figures_and_what_is_below_it_is_not():
    limit = Curve("what is allowed", X, (3.0, 3.0, 3.0), limit=True)
    assert chart_of(limit, Curve("memory", X, (1.0, 2.9, 3.0))).behind() == []
    (sentence,) = chart_of(limit, Curve("memory", X, (1.0, 3.1, 3.0))).behind()
    assert "at 0.1 memory is 3.1, above what is allowed, 3" in sentence
    assert chart_of(limit, Curve("memory", X, (9.0, 9.0, 9.0), league="other")).behind() == []


def test_a_chart_is_drawn_with_its_caption_the_machine_and_the_command(tmp_path):
    ours, other = Curve("ours", X, (0.0, 1e-16, 2e-16), ours=True), Curve("no answer", X, (1e-3, math.nan, math.inf))
    charts.draw([chart_of(ours, other)], tmp_path / "chart.svg", "python -m benchmarks something")
    text = (tmp_path / "chart.svg").read_text(encoding="utf-8")
    assert ElementTree.fromstring(text).tag.endswith("svg")
    for record in ("A title", "Read this.", "ours", "no answer", "python -m benchmarks something", f"numpy {np.__version__}"):
        assert record in text, f"{record!r} is not in the chart"


SPREAD = tuple((0.9 * x, 1.2 * x) for x in X)
EVERY_KIND = (
    chart_of(Curve("ours", X, (1e-9, 0, math.nan), ours=True), Curve("most", X, X, limit=True, league="a"), levels=(1e-3,)),
    chart_of(Curve("other", np.array(X), X, spread=SPREAD), Curve("far", X, X, minor=True), tie=math.inf, log_x=False),
    chart_of(Curve("ours", X[:2], X[:2], ours=True, tie=1e-3, spread=SPREAD[:2]), rows=("at once", "one by one"), log_y=False),
)


@pytest.mark.parametrize("chart", EVERY_KIND)
def test_a_chart_is_drawn_from_its_figures_as_it_was_drawn_when_it_was_measured(chart, tmp_path, capsys):
    status, sentence = charts.run_all("subject", {"sweep": lambda quick: [chart]}, tmp_path)
    (tmp_path / "figures.json").write_text(json.dumps({"exit_status": status, **sentence}, allow_nan=False), encoding="utf-8")
    assert charts.redraw(charts.read(tmp_path / "figures.json"), tmp_path / "again") == (0, sentence)
    assert (tmp_path / "again" / "subject-sweep.svg").read_bytes() == (tmp_path / "subject-sweep.svg").read_bytes()


def test_what_is_measured_anew_stands_beside_the_figures_of_all_others():
    def document(charts, *behind):
        return {"behind": list(behind), "charts": {name: {"title": title, "run": run} for name, title, run in charts}}

    earlier = document([("s-a", "A", 1), ("s-b", "A box", 1)], "A: slow", "A box: slow")
    assert charts.beside(earlier, document([("s-a", "A", 2)])) == (
        1,
        document([("s-a", "A", 2), ("s-b", "A box", 1)], "A box: slow"),
    )
    assert charts.beside(earlier, document([("s-a", "A", 2), ("s-b", "A box", 2)]))[0] == 0
    again = document([("s-b", "A box", 2)], "A box: slower")
    assert charts.beside(earlier, again) == (1, document([("s-a", "A", 1), ("s-b", "A box", 2)], "A: slow", "A box: slower"))


@pytest.mark.parametrize("text", ["", "[]", '{"charts": {"a": {"title": "A"}}}', '{"behind": []}'])
def test_a_file_without_figures_of_charts_is_an_error_in_one_sentence(text, tmp_path):
    (tmp_path / "figures.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"has no figures of charts: give what"):
        charts.read(tmp_path / "figures.json")


def test_what_is_in_the_background_is_drawn_thin_and_without_its_spread(tmp_path):
    spread = [(0.9, 1.2), (0.09, 0.12), (0.009, 0.012)]
    sizes = []
    for minor in (False, True):
        charts.draw(
            [chart_of(Curve("other", X, X, spread=spread, minor=minor))], tmp_path / "chart.svg", "python -m benchmarks"
        )
        sizes.append((tmp_path / "chart.svg").read_text(encoding="utf-8").count("<path"))
    assert sizes[0] >= sizes[1] + len(spread)


DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.parametrize("subject", ["stability", "light", "speed", "judge"])
def test_the_page_shows_every_chart_and_the_figures_that_it_was_drawn_from(subject):
    figures = json.loads((DOCS / "charts" / f"{subject}.json").read_text(encoding="utf-8"))
    page = (DOCS / f"{subject}.md").read_text(encoding="utf-8")
    present = set(re.findall(rf"\(charts/({subject}-[a-z-]+)\.svg\)", page))
    drawings = {each["drawing"] for each in figures["charts"].values()}
    assert present == drawings == {path.stem for path in (DOCS / "charts").glob(f"{subject}-*.svg")}
    # A missed target is told in so many words; of races, by the page's table (tests/test_project.py).
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
