"""A COLMAP model as text, of views. The format: cameras/colmap.py."""

import os
from collections.abc import Iterable

from ..cameras import colmap, save
from . import View

check_names = colmap.check_names


def write(folder: str | os.PathLike[str], views: Iterable[View]) -> None:
    """Write the `texts` into a folder, which is made if need be: each whole or not at all, images.txt last.

    Raises
    ------
    InputError
        as `texts` does, or if the folder can't be written or the disk is full.
    """
    save([view.camera for view in views], folder, "colmap")


def texts(views: Iterable[View]) -> dict[str, str]:
    """Name of the file → what it holds; cameras and images are numbered from 1, in the order of the views."""
    return colmap.texts([view.camera for view in views])
