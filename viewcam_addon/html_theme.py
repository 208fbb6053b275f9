"""What every HTML page of this project has in common: its colours by day and by night, its type, its two marks.

A page is a template of string.Template beside the code that fills it, one file that holds all it needs; `$paper` in it is
html_theme.css.
"""

from collections.abc import Mapping
from pathlib import Path
from string import Template
from typing import Any

MARKS = {True: "M20 6 9.5 17 4 11.5", False: "M5 5l14 14M19 5L5 19"}
"""A tick and a cross, as an SVG path in a square of 24."""


def filled(template: Path, parts: Mapping[str, Any]) -> str:
    """The page: a template and what it shall hold, all of it HTML already."""
    style = Path(__file__).with_suffix(".css").read_text(encoding="utf-8")
    return Template(template.read_text(encoding="utf-8")).substitute(parts, paper=style.rstrip())
