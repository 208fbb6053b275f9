"""The cameras of a batch of pictures, in the formats of the programs that learn or reconstruct a scene from them.

    transforms.py   transforms.json, as NeRF, instant-ngp and nerfstudio read it
    colmap.py       cameras.txt, images.txt and points3D.txt of COLMAP
    record.py       what a picture's sidecar says of its camera
    matrices.py     the one place where this project's conventions become theirs: axes, rows, pixels

World space stays as it is: no format here scales, centres or turns it. Rejected: writing what only some readers need and others
trip over (distortions of 0, a camera model), and guessing what the scene's size asks of one of them (`scale`, `offset`).
"""

import unicodedata
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole

_NAMED = 3  # files in a sentence


@dataclass(frozen=True)
class View:
    """A picture and the camera that took it.

    file : the picture's path inside the folder of the batch, "/" between folders, suffix included. Dataset files name pictures
        by it, so they belong in that folder, or it is what their reader takes for the folder of images.

    Raises
    ------
    InputError
        if the file is no such path.
    """

    file: str
    pinhole: Pinhole

    def __post_init__(self) -> None:
        file = self.file
        if not isinstance(file, str) or any(map(_is_unseen, file)) or "\\" in file or {"", ".", ".."} & set(file.split("/")):
            raise InputError(
                f"file is {checks.shown(file)}: give the picture's path inside the folder of the batch, as in images/left.png"
            )


def _is_unseen(character: str) -> bool:
    """Whether it is no character of a line of text: a control or format character, half of one, or a line's end."""
    category = unicodedata.category(character)
    return category[0] == "C" or category in ("Zl", "Zp")


def checked(views: Iterable[View], written: str) -> tuple[View, ...]:
    """The views, if a dataset can be made of them.

    written : what they are for, as a sentence names it.

    Raises
    ------
    InputError
        if there are none, if two are of one file, or if a camera is mirrored, since a rotation can't say that.
    """
    views = tuple(views)
    if not views:
        raise InputError(f"there is no picture for {written}: give one at least")
    twice = [file for file, count in Counter(view.file for view in views).items() if count > 1]
    if twice:
        raise InputError(f"{named(twice)} would be several pictures of {written}: give each a file of its own")
    mirrored = [view.file for view in views if view.pinhole.mirrored]
    if mirrored:
        raise InputError(f"{written} can't say that a camera is mirrored, as in {named(mirrored)}: make its scale positive")
    return views


def named(files: list[str]) -> str:
    """The files in a sentence, not too long a one."""
    rest = len(files) - _NAMED
    return ", ".join(files[:_NAMED]) + (f" and {rest} more" if rest > 0 else "")
