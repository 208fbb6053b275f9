"""One shot: rendered, perhaps checked, and written with its sidecar. And the shots of a batch one after another."""

import dataclasses
import time
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

from ..files import written_whole
from ..shots import Shot
from .folder import Folder, write_json

Outcome = dict[str, Any] | Exception
"""The sidecar of a shot, or why there is none."""

Work = Callable[[Iterator[Shot | None]], Iterator[tuple[Shot, Outcome]]]
"""Renders shots: takes them one by one as it can use them, and yields each with its outcome, in any order.

None in place of a shot says that another batch works on all that are left: look after what is under way, wait for a moment,
and ask again.
"""

_MOMENT = 0.2  # seconds


class Renderer(Protocol):
    """Holds one scene open, and renders its shots one after another.

    Both methods raise InputError if this shot can't be had, and FullDiskError if nothing more can be written; the next shot
    may then still be asked for.
    """

    def render(self, shot: Shot, image: Path, preview: Path) -> dict[str, Any]:
        """Write the picture (EXR) and its preview (PNG) to these two paths.

        Both paths are temporary, in the batch's folder: the caller renames them, and removes them after an error.

        Returns what the sidecar says of it: the keys of datasets.record, and `stated`, `rendered`, `warnings`, `versions`.
        The same shot gives the same bytes and the same values each time.
        """
        ...

    def check(self, shot: Shot) -> dict[str, Any]:
        """Compare the shot that was just rendered with the tracer: `passed` (bool), `verdict` (a sentence), and figures."""
        ...


def in_turn(folder: Folder, renderer: Renderer, settings: Mapping[str, str], check: bool) -> Work:
    """The work of one process: a shot after another. settings : their hashes by the shot's name."""

    def work(shots: Iterator[Shot | None]) -> Iterator[tuple[Shot, Outcome]]:
        for shot in shots:
            if shot is None:
                time.sleep(_MOMENT)
                continue
            try:
                outcome = render_one(shot, folder, renderer, settings[shot.name], check)
            except Exception as error:  # a shot that fails is reported, and the rest go on
                outcome = error
            yield shot, outcome

    return work


def render_one(shot: Shot, folder: Folder, renderer: Renderer, settings: str, check: bool) -> dict[str, Any]:
    """Render a shot into the folder; its sidecar, as it was written. `timing` is all in it that differs from run to run.

    settings : the hash of what it is made from. check : whether to compare it with the tracer, too.

    Raises
    ------
    InputError
        if the shot can't be rendered or checked, or the files not be written; FullDiskError if the disk is full.
    """
    started = time.monotonic()
    image, preview, sidecar = folder.image(shot.name), folder.preview(shot.name), folder.sidecar(shot.name)
    with written_whole(preview) as temporary_preview, written_whole(image) as temporary_image:
        said = renderer.render(shot, temporary_image, temporary_preview)
        verdict = {"check": renderer.check(shot)} if check else {}
        sizes = {"image": temporary_image.stat().st_size, "preview": temporary_preview.stat().st_size}
        sidecar.unlink(missing_ok=True)
    record = {
        "shot": {key: value for key, value in dataclasses.asdict(shot).items() if value is not None},
        "settings": settings,
        "image": image.name,
        "preview": preview.name,
        "bytes": sizes,
        **said,
        **verdict,
        "timing": {
            "seconds": round(time.monotonic() - started, 3),
            "finished": datetime.now(UTC).isoformat(timespec="seconds"),
        },
    }
    write_json(sidecar, record)
    return record
