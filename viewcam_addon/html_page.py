"""HTML pages: the templates' engine, and what every page has in common.

A template stands beside the code that fills it and extends html_page.html, which has the colors by day and by night, the type
and the head. A page is one file that holds all it needs, to be mailed and kept. Whatever is put into a template is text there,
whoever wrote it: Jinja2 escapes it. Rejected: string.Template, which escapes nothing, so that each name had to be escaped where
it was put in, and knows no lists, so that tables were strings of Python.
"""

import functools
import importlib.util
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import InputError

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup


def lacking() -> str | None:
    """The package that pages need and is not here, as a sentence."""
    if importlib.util.find_spec("jinja2") is None:
        return "HTML pages need Jinja2: install the extension from its zip, or pip install Jinja2"
    return None


def filled(template: str, macro: str = "", **values: Any) -> "Markup":
    """A template with values put in: a page, or a part of one, which other templates take as HTML.

    template : its path below the package, with slashes.
    macro : the macro of it that is the part.
    values : a value for each name in it; filters and tests are Jinja2's.

    Raises InputError if there is no Jinja2.
    """
    if sentence := lacking():
        raise InputError(sentence)
    from markupsafe import Markup

    loaded = _environment().get_template(template)
    return getattr(loaded.module, macro)(**values) if macro else Markup(loaded.render(values))


@functools.cache
def _environment() -> "Environment":
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,  # a name that nobody gave is an error, no gap in the page
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )
    environment.filters |= {"figure": figure, "thousands": "{:,}".format}
    return environment


def figure(value: float) -> str:
    """A number with two significant digits: 0.50, 1.6·10⁻⁴."""
    if value < 0:
        return "−" + figure(-value)
    if value == 0:
        return "0"
    if not math.isfinite(value):
        return "∞" if value > 0 else "no number"
    digits, power = f"{value:.1e}".split("e")
    exponent = int(power)
    if -3 < exponent < 5:
        return f"{float(f'{value:.1e}'):.{max(1 - exponent, 0)}f}"
    return f"{digits}·10{str(exponent).translate(_SUPERSCRIPTS)}"


_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
