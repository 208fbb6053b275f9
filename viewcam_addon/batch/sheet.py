"""The contact sheet: every shot of a batch in one HTML page, in the folder beside the pictures.

Thumbnails are the previews themselves, loaded when they come into view, and lead to them; EXR and sidecar are linked. The page
holds no times, so that the same batch gives the same page. Rejected: thumbnails inside the page, as reports have their
pictures (ten thousand shots make a page that no browser opens), and smaller copies (a third file a shot).

A sidecar may be anybody's: all that it says is text here and nothing else, and no link leads out of the folder.
"""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

from .. import html_theme
from ..files import written_whole
from .summary import Result

_WORDS = {"failed": "failed", "left": "left to render", "checks_failed": "not what the reference tracer sees"}


def picture(result: Result) -> str:
    """A shot's part of the page."""
    words = f"<b>{escape(result.name)}</b>"
    record = result.record
    if not record:
        mark = f"<span class=bad>{result.state}</span>"
        return f'<figure class="wrong"><figcaption>{words} {mark}<p>{escape(result.error or "")}</p></figcaption></figure>'
    image, preview, sidecar = (escape(quote(f"{result.name}.{suffix}")) for suffix in ("exr", "png", "json"))
    width, height = (escape(str(record["rendered"][name])) for name in ("width", "height"))
    size = f'width="{width}" height="{height}"'
    words += f'<a href="{image}">EXR</a> · <a href="{sidecar}">JSON</a>'
    wrong = ""
    if result.check and result.check["passed"]:
        words += " · <span class=ok>ok</span>"
    elif result.check:
        wrong = ' class="wrong"'
        words += f" · <span class=bad>differs</span><p>{escape(result.check['verdict'])}</p>"
    words += "".join(f"<p>{escape(warning)}</p>" for warning in record["warnings"])
    return (
        f'<figure{wrong}><a href="{preview}"><img src="{preview}" {size} alt="{escape(result.name)}" loading="lazy"></a>'
        f"<figcaption>{words}</figcaption></figure>"
    )


def write(path: Path, pictures: Sequence[str], counts: Mapping[str, int]) -> None:
    """Write the page of these pictures. counts : Summary.counts.

    Raises
    ------
    InputError
        if it can't be written; FullDiskError if the disk is full.
    """
    well = counts["done"] == counts["shots"] and not counts["checks_failed"]
    parts = {
        "outcome": "passed" if well else "failed",
        "icon": html_theme.MARKS[well],
        "title": "1 shot" if counts["shots"] == 1 else f"{counts['shots']:,} shots",
        "lede": _lede(counts),
        "choice": "" if well else '<label class="choice"><input type="checkbox" id="wrong"> Only what went wrong</label>',
        "pictures": "\n".join(pictures),
    }
    with written_whole(path) as temporary:
        text = html_theme.filled(Path(__file__).with_suffix(".html"), parts)
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _lede(counts: Mapping[str, int]) -> str:
    told = ["All are there" if counts["done"] == counts["shots"] else f"{counts['done']:,} are there"]
    told += [f"{counts[state]:,} {words}" for state, words in _WORDS.items() if counts[state]]
    return ", ".join(told) + "."
