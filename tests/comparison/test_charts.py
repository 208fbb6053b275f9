"""Drawings of the report."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from viewcam_addon import html_page
from viewcam_addon.comparison import charts
from viewcam_addon.comparison.tolerances import ROUNDINGS


@pytest.mark.parametrize("roundings", [np.empty(0), np.zeros(10), np.geomspace(1e-5, 0.5, 1000), np.full(9, 1e6)])
def test_a_histogram_is_well_formed_whatever_it_shows(roundings):
    drawing = ElementTree.fromstring(charts.histogram(roundings))
    numbers = [float(value) for part in drawing.iter() for key, value in part.items() if key in ("x", "y", "x1", "x2", "width")]
    assert numbers and np.isfinite(numbers).all()


def test_a_percentile_beyond_its_limit_is_marked():
    drawing = charts.histogram(np.full(100, 1.01 * ROUNDINGS[0]))
    assert drawing.count('class="beyond"') == 1 and drawing.count('class="within"') == 4


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0, "0"),
        (0.5, "0.50"),
        (1, "1.0"),
        (12.3, "12"),
        (1.6e-4, "1.6·10⁻⁴"),
        (-2e-9, "−2.0·10⁻⁹"),
        (9.99e-8, "1.0·10⁻⁷"),
        (3e6, "3.0·10⁶"),
    ],
)
def test_figures_have_two_digits(value, words):
    assert html_page.figure(value) == words
