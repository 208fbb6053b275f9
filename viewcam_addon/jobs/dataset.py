"""A finished batch as a dataset: transforms.json and a COLMAP model beside its pictures, from what their sidecars say.

The cameras are those that took the pictures, as Blender has them, not those that were asked for; the sidecars have both. A
dataset is of all shots of the list or there is none: programs that learn from one take what is named in it for all there is.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from ..cameras import Camera, colmap, save, transforms
from ..errors import InputError, several
from ..files import check_writable
from ..pinhole import Pinhole
from .folder import Folder
from .job import Job

MODEL = ("sparse", "0")
"""Where COLMAP and those who read its models look for one."""


def refuse(shots: Sequence[Job], suffix: str) -> None:
    """Raise InputError for shots that no dataset could name, before any of them is rendered. suffix : as of `write`."""
    colmap.check_names([f"{shot.name}.{suffix}" for shot in shots])


def check_folder(folder: Folder) -> None:
    """Raise InputError if a dataset can't be written into the folder, as far as that is known before anything is rendered."""
    check_writable(folder.path / transforms.FILE)
    for file in colmap.TEXTS:
        check_writable(folder.path.joinpath(*MODEL, file))


def write(folder: Folder, shots: Sequence[Job], settings: Mapping[str, str], suffix: str) -> str:
    """Write transforms.json and sparse/0 into the folder, each file whole or not at all, if all shots are there.

    shots : all of the list, whose order the dataset has. settings : the hash of what each is made from, by its name.
    suffix : "png" for the previews as pictures, "exr" for the pictures themselves.

    Returns a sentence: that it is written, or which shots are missing.

    Raises
    ------
    InputError
        if a camera is mirrored or a name holds a space, which these formats can't say, or if the files can't be written;
        FullDiskError if the disk is full.
    """
    records = {shot.name: folder.finished(shot.name, settings[shot.name]) for shot in shots}
    missing = [name for name, record in records.items() if record is None]
    if missing:
        return f"no dataset is written, since {len(missing)} of {len(shots)} shots are missing: {several(missing)}"
    cameras = [Camera(name, _pinhole(folder, name, record), image=f"{name}.{suffix}") for name, record in records.items()]
    model, file = folder.path.joinpath(*MODEL), folder.path / transforms.FILE
    save(cameras, model, "colmap")
    save(cameras, file, "transforms")
    return f"dataset of {len(cameras)} pictures: {file} and {model}"


def _pinhole(folder: Folder, name: str, record: Mapping[str, Any]) -> Pinhole:
    try:
        return Pinhole(**record["camera"])
    except (KeyError, TypeError, InputError) as error:
        raise InputError(
            f"{folder.sidecar(name)} has no camera that can be read: render the shot again, with --overwrite"
        ) from error
