"""What a batch's pictures are made from: the .blend and every file that it links, by content, and the versions that render it.

Times and places of files say nothing: a farm copies them about. Rejected: hashes of what Blender has loaded, which sees no
pixel of an image before it is drawn.
"""

import glob
import hashlib
import importlib.metadata
import os
import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import bpy

from ...errors import InputError

_MANIFEST = Path(__file__).parents[3] / "blender_manifest.toml"
_TILE = re.compile(r"<(UDIM|UVTILE)>")
_LAST_NUMBER = re.compile(r"(\d+)(?!.*\d)")
_NO_FILE = "missing"


def made_from() -> dict[str, Any]:
    """Hashes of the open .blend and of what it links, and the versions, as JSON has them.

    Raises
    ------
    InputError
        if the open file was never saved, or can't be read any more.
    """
    if not bpy.data.filepath:
        raise InputError("the open file was never saved, so that nobody could render the same again: save it first")
    blend = _hash(Path(bpy.data.filepath))
    if blend == _NO_FILE:
        raise InputError(f"{bpy.data.filepath} can't be read any more: save the open file again")
    linked = sorted((path.name, _hash(path)) for path in _linked())
    return {"blend": blend, "linked": [list(each) for each in linked], "versions": versions()}


def versions() -> dict[str, str]:
    """Of Blender and of this add-on."""
    return {"blender": bpy.app.version_string, "viewcam": _version()}


def _version() -> str:
    try:
        return tomllib.loads(_MANIFEST.read_text(encoding="utf-8"))["version"]
    except OSError:  # installed as a Python package
        return importlib.metadata.version("virtual-pinhole")


def _hash(path: Path) -> str:
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return _NO_FILE


def _linked() -> Iterable[Path]:
    """Every file that the open one reads, those of linked libraries too, each once."""
    named = bpy.utils.blend_paths(absolute=True, packed=False, local=False)
    files = {file for path in [*named, *_folders()] for file in _files(path)}
    return files.union(*map(_siblings, _sequences())) - {Path(bpy.data.filepath)}


def _files(path: str) -> Iterator[Path]:
    """The files that a path of Blender's names: itself, all tiles of an image, or all that is in a folder."""
    if _TILE.search(path):
        yield from map(Path, glob.glob(_TILE.sub("*", glob.escape(path))))
    elif os.path.isdir(path):
        yield from (each for each in Path(path).rglob("*") if each.is_file())
    else:
        yield Path(path)


def _siblings(path: str) -> list[Path]:
    """The files of a sequence: named as this one but for the last number."""
    first = Path(bpy.path.abspath(path))
    number = _LAST_NUMBER.search(first.name)
    if not number:
        return []
    before, after = map(re.escape, (first.name[: number.start()], first.name[number.end() :]))
    likewise = re.compile(rf"{before}\d+{after}")
    return [each for each in first.parent.glob("*") if likewise.fullmatch(each.name)] if first.parent.is_dir() else []


def _sequences() -> Iterator[str]:
    """One file of each sequence of files."""
    data = bpy.data
    yield from (_path(each) for each in (*data.images, *data.movieclips) if each.source == "SEQUENCE")
    yield from (_path(each) for each in (*data.volumes, *data.cache_files) if each.is_sequence)


def _path(block: bpy.types.ID) -> str:
    return bpy.path.abspath(block.filepath, library=block.library)


def _folders() -> Iterator[str]:
    """Where simulations were baked to: point caches beside the .blend, fluids, nodes."""
    blend = Path(bpy.data.filepath)
    folders = [str(blend.with_name(f"blendcache_{blend.stem}"))]
    for block in bpy.data.objects:
        for modifier in block.modifiers:
            domain = getattr(modifier, "domain_settings", None)
            for path in (getattr(domain, "cache_directory", ""), getattr(modifier, "bake_directory", "")):
                folders.append(bpy.path.abspath(path, library=block.library))
    yield from filter(os.path.isdir, folders)
