"""The folder of a batch: what stands where, and which shots are there already.

A shot NAME is three files, NAME.exr, NAME.png and NAME.json. The last one, its sidecar, is written when the other two stand,
and taken away before they are replaced. It says how many bytes they have, and from what they were made (shots.settings_hash).
Rejected: to hash the pictures as well; each was written whole, and to read them all again would cost more than it finds.
"""

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import read_bytes, written_whole

_TEMPORARY = re.compile(r"\.(.+)-[0-9a-f]{8}\.(?:exr|png|json|html|txt)")


class Folder:
    """The files of a batch, or of a part of one.

    part : "2-of-8" for a shard, which has a summary and a contact sheet of its own.

    Raises
    ------
    InputError
        if the folder can't be made.
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

    def finished(self, name: str, settings: str, check: bool) -> dict[str, Any] | None:
        """The sidecar of the shot, if it is there whole and made from these settings, else None.

        check : whether it must have been checked, too.
        """
        try:
            record = json.loads(read_bytes(self.sidecar(name)).decode("utf-8"))
            sizes = {"image": self.image(name).stat().st_size, "preview": self.preview(name).stat().st_size}
        except (OSError, ValueError, RecursionError):  # missing, or somebody else's
            return None
        if not _is_sidecar(record) or record.get("settings") != settings or record.get("bytes") != sizes:
            return None
        return None if check and "check" not in record else record

    def remove_leftovers(self, shots: Iterable[str]) -> None:
        """Remove what a batch that was killed wrote halfway; nobody may be writing here.

        shots : names of the shots whose leftovers they may be; those of the batch's own files go as well.
        """
        ours = {*shots, self.summary.stem, self.contact_sheet.stem}
        for path in self.path.iterdir():
            found = _TEMPORARY.fullmatch(path.name)
            if found and found[1] in ours:
                path.unlink(missing_ok=True)


def _is_sidecar(record: Any) -> bool:
    """Whether it says all that the summary and the contact sheet tell of a shot; else it is somebody else's, or damaged."""

    def has(owner: Any, **kinds: type | tuple[type, ...]) -> bool:
        return isinstance(owner, dict) and all(isinstance(owner.get(key), kind) for key, kind in kinds.items())

    return (
        has(record, rendered=dict, warnings=list, timing=dict)
        and has(record["rendered"], width=int, height=int)
        and has(record["timing"], seconds=(int, float))
        and all(isinstance(warning, str) for warning in record["warnings"])
        and ("check" not in record or has(record["check"], passed=bool, verdict=str))
    )


def write_json(path: Path, document: Mapping[str, Any]) -> None:
    """Write a document whole or not at all, a key a line, and of a list of objects an object a line.

    Raises
    ------
    InputError
        if it can't be written; FullDiskError if the disk is full.
    """
    with written_whole(path) as temporary:
        temporary.write_text(_text(document), encoding="utf-8", newline="\n")


def _text(document: Mapping[str, Any]) -> str:
    return "{\n" + ",\n".join(f" {_compact(key)}: {_lines(value)}" for key, value in document.items()) + "\n}\n"


def _lines(value: Any) -> str:
    if isinstance(value, list) and value and all(isinstance(item, Mapping) for item in value):
        return "[\n" + ",\n".join(f"  {_compact(item)}" for item in value) + "\n ]"
    return _compact(value)


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
