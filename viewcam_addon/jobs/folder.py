"""The folder of a batch: what stands where, and which shots are there already.

A shot NAME is three files, NAME.exr, NAME.png and NAME.json, and those of its labels. NAME.json, its sidecar, is written when
the others stand, and taken away before they are replaced. It says how many bytes they have, and from what they were made
(`settings_hash`).
Rejected: to hash the pictures as well; each was written whole, and to read them all again would cost more than it finds.
"""

import hashlib
import json
import os
import re
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import read_bytes, written_whole
from ..labels import PASSES
from ..labels import endings as endings_of_labels
from .job import Job
from .tracing import SIDES

_TEMPORARY = re.compile(r"\.(.+)-[0-9a-f]{8}\.(?:exr|png|json|html|txt|labels)")


@dataclass(frozen=True)
class Outputs:
    """The files that a batch makes of each shot, beside its sidecar.

    picture : true for EXR and preview.
    check : true to compare with the tracer: a picture's geometry, else the job's engine at its level.
    labels : kinds of labels, of labels.KINDS.
    depth_steps : the steps of the labels' 16-bit depth in a scene unit.
    report : true if a check without a picture writes its page and a thumbnail.
    """

    picture: bool = True
    check: bool = False
    labels: tuple[str, ...] = ()
    depth_steps: float = 1000.0
    report: bool = False


class Folder:
    """The files of a batch, or of a part of one.

    part : "2-of-8" for a shard, which has a summary and a contact sheet of its own.

    Raises InputError if the folder can't be made.
    """

    def __init__(self, path: Path, part: str = "") -> None:
        suffix = f"-{part}" if part else ""
        self.path = path
        self.lock = path / ".viewcam.lock"
        self.summary = path / f"summary{suffix}.json"
        self.contact_sheet = path / f"contact-sheet{suffix}.html"
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{path} can't be a folder of pictures ({error.strerror}): give another for --out") from error

    def image(self, name: str) -> Path:
        return self.path / f"{name}.exr"

    def preview(self, name: str) -> Path:
        return self.path / f"{name}.png"

    def sidecar(self, name: str) -> Path:
        return self.path / f"{name}.json"

    def refuse_what_is_in_the_way(self, shots: Iterable[str], outputs: Outputs) -> None:
        """Raise InputError where a folder, or anything else that is no file, has the name of a file that a batch would write.

        shots : the shots' names.
        outputs : the files that are made of each.
        """
        endings = ["json", *(("exr", "png") if outputs.picture else ()), *(("html", SIDES["test"]) if outputs.report else ())]
        if outputs.labels:
            endings += endings_of_labels([each for kind in outputs.labels for each in PASSES[kind]])
        file_names = {self.summary.name, self.contact_sheet.name, *(f"{shot}.{ending}" for shot in shots for ending in endings)}
        with os.scandir(self.path) as entries:
            for entry in entries:
                if entry.name in file_names and os.path.exists(entry.path) and not entry.is_file():
                    what = "a folder" if entry.is_dir() else "no file"
                    raise InputError(
                        f"{Path(entry.path)} is {what}, and a file is to be written there: move it, or choose another folder"
                    )

    def finished(self, name: str, settings: str, outputs: Outputs | None = None) -> dict[str, Any] | None:
        """The sidecar of the shot, if all that it tells of is there whole and made from these settings, else None.

        outputs : the files of which it must tell; by default the picture alone.
        """
        outputs, record = outputs or Outputs(), self.record(name)
        try:
            if record is None or record.get("settings") != settings or record.get("bytes") != self._sizes(name, record):
                return None
        except OSError:  # one is missing
            return None
        labels = record.get("labels", {})
        is_all = (
            ("image" in record or not outputs.picture)
            and ("check" in record or not outputs.check)
            and ("report" in record or not outputs.report)
            and set(outputs.labels) <= set(labels.get("kinds", ()))
            and (not outputs.labels or labels["depth_steps"] == outputs.depth_steps)
        )
        return record if is_all else None

    def record(self, name: str) -> dict[str, Any] | None:
        """The sidecar of the shot, whatever it was made from; None where it is missing, or somebody else's."""
        try:
            record = json.loads(read_bytes(self.sidecar(name)).decode("utf-8"))
            _compact(record).encode("utf-8")  # no summary could hold an infinite number, or bytes that are no text
        except (OSError, ValueError, RecursionError):
            return None
        return record if _is_sidecar(record, name) else None

    def _sizes(self, name: str, record: Mapping[str, Any]) -> dict[str, int]:
        """The sizes of the files that a sidecar tells of, by what `bytes` calls them."""
        paths = {"image": self.image(name), "preview": self.preview(name)} if "image" in record else {}
        paths |= {file: self.path / file for file in _files_beside(record)}
        return {key: path.stat().st_size for key, path in paths.items()}

    def remove_former(self, name: str, record: Mapping[str, Any], of_labels_only: bool) -> None:
        """Remove what a former sidecar tells of, and the sidecar first. of_labels_only : all but the picture."""
        self.sidecar(name).unlink(missing_ok=True)
        files = _files_beside(record)
        for path in (
            *(self.path / file for file in reversed(files)),  # the JSON first, which says that the others are there
            *(() if of_labels_only or "image" not in record else (self.image(name), self.preview(name))),
        ):
            path.unlink(missing_ok=True)

    def remove_leftovers(self, shots: Iterable[str]) -> None:
        """Remove what a batch that was killed wrote halfway; nobody may be writing here.

        shots : names of the shots whose leftovers they may be; those of the batch's own files go as well.
        """
        stems = {*shots, self.summary.stem, self.contact_sheet.stem}
        for path in self.path.iterdir():
            match = _TEMPORARY.fullmatch(path.name)
            if match and match[1] in stems and path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            elif match and match[1] in stems:
                path.unlink(missing_ok=True)


def _files_beside(record: Mapping[str, Any]) -> list[str]:
    """The files of a shot that are neither its picture nor its sidecar."""
    return [*record.get("report", ()), *record.get("labels", {}).get("files", ())]


def _is_sidecar(record: Any, name: str) -> bool:
    """True if it says all that the summary and the contact sheet tell of a shot; else it is somebody else's, or damaged."""

    def has(owner: Any, **kinds: type | tuple[type, ...]) -> bool:
        return isinstance(owner, dict) and all(isinstance(owner.get(key), kind) for key, kind in kinds.items())

    return (
        has(record, rendered=dict, warnings=list, timing=dict)
        and has(record["rendered"], width=int, height=int)
        and has(record["timing"], seconds=(int, float))
        and all(isinstance(warning, str) for warning in record["warnings"])
        and ("check" not in record or has(record["check"], passed=bool, verdict=str))
        and ("labels" not in record or _are_labels(record["labels"], name))
        and ("report" not in record or _are_files(record["report"], name))
    )


def _are_labels(labels: Any, name: str) -> bool:
    """True if a sidecar's labels are files of its shot, which no other folder has."""
    return (
        isinstance(labels, dict)
        and isinstance(labels.get("depth_steps"), int | float)
        and isinstance(labels.get("kinds"), list)
        and all(isinstance(each, str) for each in labels["kinds"])
        and _are_files(labels.get("files"), name)
    )


def _are_files(names: Any, name: str) -> bool:
    """True if a list of a sidecar is of files of its shot, which no other folder has."""
    return isinstance(names, list) and all(
        isinstance(file, str) and file.startswith(f"{name}.") and _is_file_name(file) for file in names
    )


def _is_file_name(text: str) -> bool:
    """True if it is one of a file in the folder, which text of a damaged sidecar need not be."""
    return not set(text) & {"/", "\\", "\0"} and text.encode("utf-8", "replace").decode("utf-8") == text


def write_json(path: Path, document: Mapping[str, Any]) -> None:
    """Write a document whole or not at all, a key a line, and of a list of objects an object a line.

    Raises InputError if it can't be written; FullDiskError if the disk is full.
    """
    with written_whole(path) as temporary:
        lines = ",\n".join(f" {_compact(key)}: {_lines(value)}" for key, value in document.items())
        temporary.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8", newline="\n")


def _lines(value: Any) -> str:
    if isinstance(value, list) and value and all(isinstance(item, Mapping) for item in value):
        return "[\n" + ",\n".join(f"  {_compact(item)}" for item in value) + "\n ]"
    return _compact(value)


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


_DECIDE_NOTHING = ("name", "blend", "threads")
_FORMAT = 1  # counts up when the same settings are to have another hash


def settings_hash(job: Job, made_from: Mapping[str, object]) -> str:
    """SHA-256, in hexadecimal, over all that decides the job's picture and its check: the same on every machine and in every
    version.

    made_from : whatever else does: versions, the hash of the .blend's content and of what it links, seed, options. Of texts,
    numbers, truth values, None, and lists and dicts of these; 1 and 1.0 are not the same. Name, path and threads are
    left out: they decide nothing of the picture. Rejected: Python's hash (another in each process), pickle (another in each
    version), and floats of so many digits, of which two may be one.

    Raises TypeError if there is anything else among them, which could not be told apart for certain.
    """
    settings = {key: value for key, value in job.to_json().items() if key not in _DECIDE_NOTHING}
    document = {"format": _FORMAT, "shot": settings, "made_from": made_from}
    text = json.dumps(_canonical(document), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _canonical(value: object) -> object:
    """The value in JSON that is the same for equal values only; floats to the last bit."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return {"float": value.hex()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {"dict": {key: _canonical(item) for key, item in value.items()}}
    raise TypeError(f"{value!r} has no canonical form: give texts, numbers, lists and dicts")
