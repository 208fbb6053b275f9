"""Checks and comparisons as calls, for programs and tests: each in processes of their own, so that none can touch another."""

import argparse
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from .. import argument_types
from ..comparison.answer import exit_status
from ..errors import InputError
from .job import Job
from .served_renderer import ServedRenderer
from .tracing import Tracing, Written

File = str | os.PathLike[str]

_FLAGS = {field.name for field in fields(Job) if field.default is False}
_WHOLE = ("frame", "samples", "seed", "threads")


@dataclass(frozen=True)
class Check:
    """The result of `check`, or of a comparison of files.

    passed : true if Cycles renders the camera, or the pictures are the same.
    sentence : a sentence that says by how much they differ.
    figures : all that --json writes.
    answer : one of "same", "same_but" (the same, but for objects that are not modeled) and "different".
    """

    passed: bool
    sentence: str
    figures: dict[str, Any]

    @property
    def answer(self) -> str:
        return str(self.figures["answer"])


def check(
    blend: File,
    *words: File,
    size: str | tuple[int, int] | None = None,
    report: File | None = None,
    difference: File | None = None,
    **options: Any,
) -> Check:
    """Check that Cycles renders what a .blend file says: `check("shot.blend", camera="Camera", frame=24, level="direct")`.

    blend : the file.
    words : words of the command line, as "--camera", "Camera". Deprecated: give keywords.
    size : (width, height) in pixels, or "320x180"; the scene's where None.
    report : a folder for the HTML page, the scene and all pictures.
    difference : a PNG of what differs.
    options : fields of Job: camera, frame, level, samples, find, seed, error, engine, device, clay, recenter, strict, trust,
        threads, scene.

    Raises InputError as the command does: no Blender, no such file or camera, no such option.
    """
    if words:
        warnings.warn("viewcam_addon.check takes keywords, as camera='Camera'", DeprecationWarning, stacklevel=2)
        older = _options_of([os.fspath(word) for word in words])
        named = {"size": size, "report": report, "difference": difference, **options}
        return check(blend, **{**older, **{name: value for name, value in named.items() if value is not None}})
    width, height = (argument_type(argument_types.size, size) if isinstance(size, str) else size) or (None, None)
    stated = {name: value for name, value in options.items() if value is not None}
    job = Job.from_json({"level": "geometry", "engine": "CYCLES", **stated, "width": width, "height": height, "blend": blend})
    job.refuse_unchecked()
    folder = Path(report).absolute() if report is not None else None
    written = Written(
        report=str(folder) if folder else None,
        difference=str(Path(difference).absolute()) if difference else None,
        reference=str(folder / "reference.exr") if folder else None,
        command=f"viewcam {job.check_words()}",
    )
    with ServedRenderer(Path(blend).absolute(), job.trust) as renderer:
        result = renderer.check(job, has_picture=False, written=written, keep=folder)
    return _check_of(result, job.strict)


def compare(
    reference: File,
    *tests: File,
    scene: File | None = None,
    threads: int | None = None,
    channels: str | Sequence[str] | Mapping[str, Sequence[str]] | None = None,
    report: File | None = None,
    difference: File | None = None,
    strict: bool = False,
) -> Check:
    """Compare EXRs of one camera, in a process of its own; see tracing.compare_files.

    channels : the channels' names by pass, or as the command line has them.
    report : a folder for the HTML page.
    difference : a PNG.
    strict : true to fail pictures that are the same but for what is not modeled.

    Raises InputError as `viewcam compare` does.
    """
    named = channels if isinstance(channels, Mapping) else None
    if channels and named is None:
        texts = [channels] if isinstance(channels, str) else channels
        named = dict(argument_type(argument_types.channels, text) for text in texts)
    files = {name: str(path) for name, path in (("report", report), ("difference", difference)) if path}
    with Tracing() as tracing:
        result = tracing.compare_files(
            Path(reference),
            [Path(path) for path in tests],
            scene=scene and str(scene),
            threads=threads,
            channels=named and dict(named),
            written={**files, "command": "viewcam compare"},
        )
    return _check_of(result, strict)


def argument_type(parse: Any, text: str) -> Any:
    """A value of the command line's; InputError where it is none."""
    try:
        return parse(text)
    except argparse.ArgumentTypeError as error:
        raise InputError(str(error)) from error


def _check_of(answer: Mapping[str, Any], strict: bool) -> Check:
    result = answer["result"]
    status = exit_status(result["answer"], strict)
    return Check(status == 0, result["sentence"], {"exit_status": status, **result})


def _options_of(words: Sequence[str]) -> dict[str, Any]:
    """The keywords that words of the command line stand for."""
    options: dict[str, Any] = {}
    left = list(words)
    while left:
        name = left.pop(0)
        key = name.removeprefix("--").replace("-", "_")
        if not name.startswith("--") or (key not in _FLAGS and not left):
            raise InputError(f"{name!r} is no option with a value: give keywords, as camera='Camera'")
        if key in _FLAGS:
            options[key] = True
            continue
        text = left.pop(0)
        try:
            options[key] = int(text) if key in _WHOLE else float(text) if key == "error" else text
        except ValueError:
            raise InputError(f"{name} is {text!r}: give a number") from None
    return options
