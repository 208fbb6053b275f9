"""One shot: rendered, labeled or checked, and written with its sidecar. And the shots of a batch one after another."""

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

from ..files import written_together, written_whole
from ..labels import KINDS
from .folder import Folder, Outputs, write_json
from .job import Job
from .tracing import PAGE, SIDES, Written

Outcome = dict[str, Any] | Exception
"""The sidecar of a shot, or why there is none."""

Work = Callable[[Iterator[Job | None]], Iterator[tuple[Job, Outcome]]]
"""Renders shots: takes them one by one as it can use them, and yields each with its outcome, in any order.

None in place of a shot says that another batch works on all that are left: look after what is under way, wait for a moment,
and ask again.
"""

_MOMENT = 0.2  # seconds
_KEPT = ("passed", "answer", "verdict", "figures", "not_modeled", "ledger", "level")
"""The keys of a check that a sidecar keeps."""


class Renderer(Protocol):
    """Holds one scene open, and renders its shots one after another.

    All methods raise InputError if this shot can't be had, and FullDiskError if nothing more can be written; the next shot
    may then still be asked for.
    """

    def render(self, shot: Job, image: Path | None, preview: Path | None) -> dict[str, Any]:
        """Write the picture (EXR) and its preview (PNG) to these two paths; None for both makes ready for the rest alone.

        Both paths are temporary, in the batch's folder: the caller renames them, and removes them after an error.

        Returns what the sidecar says of it: the keys of cameras/sidecar.py, and `stated`, `rendered`, `warnings`, `versions`.
        The same shot gives the same bytes and the same values each time.
        """
        ...

    def label(self, shot: Job, picture: Path, kinds: Sequence[str], depth_steps: float) -> list[str]:
        """Write the labels of the shot that was just rendered beside where its picture would be; the names of their files.

        kinds : kinds of labels, of labels.KINDS.
        depth_steps : the steps of their 16-bit depth in a scene unit. The same shot gives the same bytes.
        """
        ...

    def check(
        self, job: Job, has_picture: bool = True, written: Written | None = None, keep: Path | None = None
    ) -> dict[str, Any]:
        """Compare a job with the tracer: `passed` (bool), `verdict` (a sentence), and figures.

        has_picture : true to check camera and geometry of the picture that was just rendered; false to check the job's engine
            at the job's level, where `result` has all figures.
        written : files of the comparison.
        keep : a folder for scene and pictures.
        """
        ...


def in_turn(folder: Folder, renderer: Renderer, settings: Mapping[str, str], outputs: Outputs) -> Work:
    """The work of one process: a shot after another. settings : their hashes by the shot's name."""

    def work(shots: Iterator[Job | None]) -> Iterator[tuple[Job, Outcome]]:
        for shot in shots:
            if shot is None:
                time.sleep(_MOMENT)
                continue
            try:
                outcome: Outcome = render_one(shot, folder, renderer, settings[shot.name], outputs)
            except Exception as error:  # a shot that fails is reported, and the rest go on
                outcome = error
            yield shot, outcome

    return work


def render_one(shot: Job, folder: Folder, renderer: Renderer, settings: str, outputs: Outputs) -> dict[str, Any]:
    """Render a shot into the folder; its sidecar, as it was written. `timing` is all in it that differs from run to run.

    settings : the hash of what the shot is made from.
    outputs : the files that are wanted. A picture and labels that stand there and were made from the same settings stay: labels
        may come to a picture that was rendered before, and a picture to labels.

    Raises InputError if the shot can't be rendered, labeled or checked, or the files not be written; FullDiskError if the disk
    is full.
    """
    started = time.monotonic()
    image, preview, sidecar = folder.image(shot.name), folder.preview(shot.name), folder.sidecar(shot.name)
    former = folder.record(shot.name) or {}
    kept = folder.finished(shot.name, settings, Outputs(picture=False)) or {}
    is_kept = "image" in kept and ("check" in kept or not outputs.check)
    kinds = [kind for kind in KINDS if kind in {*outputs.labels, *kept.get("labels", {}).get("kinds", ())}]
    steps = outputs.depth_steps if outputs.labels else kept["labels"]["depth_steps"] if kinds else 0.0
    with contextlib.ExitStack() as files:
        new_image = new_preview = None
        if outputs.picture and not is_kept:
            new_preview, new_image = (files.enter_context(written_whole(path)) for path in (preview, image))
        rendered = renderer.render(shot, new_image, new_preview)
        if is_kept:
            rendered = {key: kept[key] for key in rendered if key in kept}
        sizes = {}
        if outputs.picture or is_kept:
            sizes = {"image": (new_image or image).stat().st_size, "preview": (new_preview or preview).stat().st_size}
        labels: dict[str, Any] = {}
        if kinds:
            beside = files.enter_context(written_together(folder.path, shot.name))
            names = renderer.label(shot, beside / image.name, kinds, steps)
            sizes |= {name: (beside / name).stat().st_size for name in names}
            labels = {"labels": {"kinds": kinds, "depth_steps": steps, "files": names}}
        verdict: dict[str, Any] = {key: kept[key] for key in ("check", "report") if key in kept}
        if outputs.check:
            beside = files.enter_context(written_together(folder.path, shot.name))
            verdict = _checked(shot, renderer, outputs.picture or bool(kinds), beside if outputs.report else None)
            sizes |= {name: (beside / name).stat().st_size for name in verdict.get("report", ())}
        sidecar.unlink(missing_ok=True)
        folder.remove_former(shot.name, former, of_labels_only="image" in sizes)
    record = {
        "shot": shot.listed(),
        "settings": settings,
        **({"image": image.name, "preview": preview.name} if "image" in sizes else {}),
        "bytes": sizes,
        **rendered,
        **labels,
        **verdict,
        "timing": {
            "seconds": round(time.monotonic() - started, 3),
            "finished": datetime.now(UTC).isoformat(timespec="seconds"),
        },
    }
    write_json(sidecar, record)
    return record


def _checked(job: Job, renderer: Renderer, has_picture: bool, folder: Path | None) -> dict[str, Any]:
    """The part of a check that a sidecar keeps. folder : receives its page and a thumbnail, NAME.html and NAME.test.png."""
    if folder is None:
        result = renderer.check(job, has_picture)
        return {"check": {key: result[key] for key in _KEPT if key in result}}
    result = renderer.check(job, has_picture, Written(report=str(folder), sides=str(folder), command=job.check_words()))
    names = [f"{job.name}.html", f"{job.name}.{SIDES['test']}"]
    for name, file in zip(names, (PAGE, SIDES["test"]), strict=True):
        (folder / file).rename(folder / name)
    for side in ("reference", "everything"):
        (folder / SIDES[side]).unlink(missing_ok=True)
    return {"check": {key: result[key] for key in _KEPT if key in result}, "report": names}
