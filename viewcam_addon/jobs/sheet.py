"""The contact sheet: every shot of a batch in one HTML page, in the folder beside the pictures.

Thumbnails are the previews themselves, loaded when they come into view, and are shown larger by a click; EXR and sidecar are
linked, and of a check without a picture its report. The page holds no times, so that the same batch gives the same page; when
it was made, the browser knows and says. Rejected: thumbnails inside the page, as reports have their pictures (ten thousand
shots make a page that no browser opens), and smaller copies (a third file a shot).

A sidecar may be anybody's: all that it says is text here and nothing else, and no link leads out of the folder.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from .. import html_page
from ..comparison.answer import DIFFERENT, NOTHING, SAME, SAME_BUT, but_for
from ..comparison.statistics import plain
from ..errors import counted
from ..files import written_whole
from .summary import Result

_WORDS = {
    "failed": "could not be rendered",
    "left": "left to render",
    "checks_failed": "different from Cycles' picture",
    "not_all_modeled": "with objects that are not modeled",
}


def picture(result: Result) -> str:
    """A shot's part of the page."""
    return html_page.filled(
        "jobs/sheet_picture.html",
        shot=result,
        file=quote(result.name),
        facts=facts(result.record or {}),
        verdict=verdict(result),
    )


def facts(record: Mapping[str, Any]) -> list[str]:
    """The facts of a shot's sidecar, a few words each: file, camera, frame, size, lens and angle of view."""
    rendered, camera, blender = (_part(record, name) for name in ("rendered", "camera", "blender"))
    parts = [str(rendered["file"])] if rendered.get("file") else []
    name = rendered.get("camera")
    parts += [str(name)] if name else []
    frame, width, height = (rendered.get(key) for key in ("frame", "width", "height"))
    parts += [f"frame {frame}"] if isinstance(frame, int) else []
    parts += [f"{width} × {height}"] if isinstance(width, int) and isinstance(height, int) else []
    lens, distance, across = blender.get("lens"), camera.get("distance"), camera.get("width")
    parts += [f"{lens:.4g} mm"] if isinstance(lens, float) else []
    if (
        isinstance(distance, list)
        and distance
        and isinstance(distance[0], float)
        and distance[0] > 0
        and isinstance(across, int)
    ):
        parts.append(f"{math.degrees(2 * math.atan2(across / 2, distance[0])):.3g}° across")
    return parts


def verdict(result: Result) -> str:
    """The verdict of a shot's check, in the words of the panel's proof."""
    check = result.check
    if not check:
        return "not checked"
    if result.answer == DIFFERENT:
        return NOTHING.lower() if str(check.get("verdict")).startswith(NOTHING) else "differs"
    figures = _part(check, "figures")
    largest = _part(figures, "position").get("max")
    words = f"identical to {plain(largest)} px" if isinstance(largest, float) else "identical"
    words = "the same within noise" if figures.get("noisy") else words
    not_modeled = _part(check, "not_modeled")
    return (
        f"{words}, {but_for(not_modeled)}"
        if result.answer == SAME_BUT and isinstance(not_modeled.get("names"), list)
        else words
    )


def _part(record: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    part = record.get(name)
    return part if isinstance(part, dict) else {}


def write(path: Path, pictures: Sequence[str], counts: Mapping[str, int]) -> None:
    """Write the page of these pictures. counts : Summary.counts.

    Raises InputError if it can't be written or there is no Jinja2; FullDiskError if the disk is full.
    """
    page = html_page.filled(
        "jobs/sheet.html",
        answer=_answer(counts),
        about="batch",
        title=(title := counted(counts["shots"], "shot")),
        headline=title,
        intro=_intro(counts),
        pictures=pictures,
    )
    with written_whole(path) as temporary:
        temporary.write_text(page, encoding="utf-8", newline="\n")


def _answer(counts: Mapping[str, int]) -> str | None:
    """The answer at the page's head: the worst of all answers, or none where nothing went wrong and nothing was checked."""
    if counts["done"] < counts["shots"] or counts["checks_failed"]:
        return DIFFERENT
    if counts["not_all_modeled"]:
        return SAME_BUT
    return SAME if counts["checked"] == counts["shots"] else None


def _intro(counts: Mapping[str, int]) -> str:
    parts = ["All are there" if counts["done"] == counts["shots"] else f"{counts['done']:,} are there"]
    parts += [f"{counts[state]:,} {words}" for state, words in _WORDS.items() if counts[state]]
    return ", ".join(parts) + "."
