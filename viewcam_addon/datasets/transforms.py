"""transforms.json of views. The format: cameras/transforms.py."""

import os
from collections.abc import Iterable
from typing import Any

from ..cameras import transforms
from ..files import written_whole
from . import View

FILE, AABB_SCALES = transforms.FILE, transforms.AABB_SCALES


def write(path: str | os.PathLike[str], views: Iterable[View], aabb_scale: int | None = None) -> None:
    """Write the `document`, one frame a line, whole or not at all; the same views give the same bytes.

    Raises
    ------
    InputError
        as `document` does, or if the folder can't be written or the disk is full.
    """
    content = transforms.text(document(views, aabb_scale))
    with written_whole(path) as temporary:
        temporary.write_text(content, encoding="utf-8", newline="\n")


def document(views: Iterable[View], aabb_scale: int | None = None) -> dict[str, Any]:
    """What the file holds, frames in the order of the views; see cameras/transforms.py."""
    return transforms.document([view.camera for view in views], aabb_scale)
