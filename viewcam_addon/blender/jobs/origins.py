"""The origins of a batch's pictures: the .blend, every file that it links and the colors' configuration, by content, and
the versions that render it.

Times and places of files say nothing: a farm copies them about. But which file is which counts, so they are in the order of
their paths, and those below the .blend's folder are told with the folders between. What can't be known is told as well: which
file a geometry node imports where other nodes put its path together, and what a binary USD file reads besides itself.

A simulation that is not baked writes its cache while it is rendered: that is no origin of the picture, whose warning says that
it depends on the frames before. Rejected: hashes of what Blender has loaded, which sees no pixel of an image until it is drawn.
"""

import contextlib
import glob
import hashlib
import importlib.metadata
import io
import itertools
import json
import os
import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import bpy

from ...errors import InputError
from .. import opening
from .. import versions as blender_versions

_MANIFEST = Path(__file__).parents[3] / "blender_manifest.toml"
_TILE = re.compile(r"<(UDIM|UVTILE)>")
_LAST_NUMBER = re.compile(r"(\d+)(?!.*\d)")
_NO_FILE = "missing"
# The most that is hashed: four caches of 25,000 frames in a folder, and of all files what takes some minutes.
_MOST_FILES = 100_000
_MOST_BYTES = 256 * 2**30

_USD = (".usd", ".usda", ".usdc")
_USD_BINARY = b"PXR-USDC"
_USD_ASSET = re.compile(rb"@@@(.+?)@@@|@([^@\n]+)@")
_COLORS_FOLDERS = re.compile(r"^search_path:[ \t]*(.*(?:\n[ \t]*-.*)*)", re.MULTILINE)
_COLORS_FILE = re.compile(r"\bsrc:\s*(?:\"([^\"]+)\"|'([^']+)'|([^\s,}]+))")
_POINT_CACHE = re.compile(r"(.*)_\d+_(\d+)\.bphys")


def made_from() -> dict[str, Any]:
    """Hashes of the open .blend, of what it links and of the colors' configuration, and the versions, as JSON has them.

    `unknown` is there where something can't be known: a sentence for each (see `unknown`).

    Raises InputError if the open file was never saved, or can't be read any more.
    """
    if not bpy.data.filepath:
        raise InputError("the open file was never saved, so that nobody could render the same again: save it first")
    blend = _hash(Path(bpy.data.filepath))
    if blend == _NO_FILE:
        raise InputError(f"{bpy.data.filepath} can't be read any more: save the open file again")
    lacking = unknown()
    return {
        "blend": blend,
        "linked": _hashes(_linked(), Path(bpy.data.filepath).parent),
        "colors": hashlib.sha256(json.dumps(_hashes(*_colors())).encode()).hexdigest(),
        "versions": versions(),
        **({"unknown": list(lacking)} if lacking else {}),
    }


def unknown() -> tuple[str, ...]:
    """A sentence for each thing that may change the pictures while nobody can know it from here."""
    nodes = (sentence for _, sentence in _imports() if sentence)
    layers = (
        f"The file {path.name!r} is binary USD: what it reads besides itself can't be known"
        for path in sorted(_linked())
        if path.suffix.lower() in _USD and _usd_layers(path) is None
    )
    return tuple(dict.fromkeys([*nodes, *layers]))


def versions() -> dict[str, str]:
    """The versions of Blender and of this add-on."""
    return {"blender": bpy.app.version_string, "viewcam": _version()}


def _version() -> str:
    try:
        return tomllib.loads(_MANIFEST.read_text(encoding="utf-8"))["version"]
    except OSError:  # installed as a Python package
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            return importlib.metadata.version("virtual-pinhole")
        return "unknown"  # a folder of modules that nothing has installed


def _hash(path: Path) -> str:
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, ValueError):  # or a name that no file can have
        return _NO_FILE


def _hashes(files: Iterable[Path], folder: Path) -> list[list[str]]:
    """[what a file is called, hash] in the order of their paths. folder : its files are called by their path in it."""
    paths = sorted({Path(os.path.normpath(path)) for path in files})
    _check_kinds(paths)
    inside = [path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.name for path in paths]
    return [[name, _hash(path)] for name, path in zip(inside, paths, strict=True)]


def _check_kinds(paths: Iterable[Path]) -> None:
    """Refuse what can't be hashed in some minutes: a pipe or a device, which may never end, and more than anybody reads."""
    total = 0
    for path in paths:
        total += opening.size_of(path)
        if total > _MOST_BYTES:
            raise InputError(
                f"the .blend reads more than {_MOST_BYTES / 2**30:g} GiB of other files, as {path}: take out what is not needed"
            )


def _linked() -> set[Path]:
    """Every file that the open one reads, those of linked libraries too."""
    named = bpy.utils.blend_paths(absolute=True, packed=False, local=False)
    imported = [path for path, _ in _imports() if path]
    files = {file for path in [*named, *imported, *_layers(), *_folders()] for file in _files(path)}
    files = files.union(*map(_siblings, _sequences())) - {Path(bpy.data.filepath)}
    written = _caches_of_unbaked()
    return _with_usd_layers({path for path in files if not _is_cache_of(path, written)})


def _files(path: str) -> Iterator[Path]:
    """The files that a path of Blender's names: itself, all tiles of an image, or all that is in a folder."""
    if _TILE.search(path):
        yield from map(Path, glob.glob(_TILE.sub("*", glob.escape(path))))
    elif os.path.isdir(path):
        within = list(itertools.islice(Path(path).rglob("*"), _MOST_FILES + 1))
        if len(within) > _MOST_FILES:
            raise InputError(
                f"the .blend names the folder {path}, which holds more than {_MOST_FILES:,} files: give its cache a folder "
                "of its own"
            )
        yield from (each for each in within if each.is_file())
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


def _layers() -> Iterator[str]:
    """The files that stand over those of caches."""
    for each in bpy.data.cache_files:
        yield from (bpy.path.abspath(layer.filepath, library=each.library) for layer in each.layers)


def _folders() -> Iterator[str]:
    """Folders that simulations were baked to: point caches beside the .blend and elsewhere, fluids, nodes."""
    blend = Path(bpy.data.filepath)
    folders = [str(blend.with_name(f"blendcache_{blend.stem}"))] if blend.name else []
    for block in bpy.data.objects:
        for modifier in block.modifiers:
            domain = getattr(modifier, "domain_settings", None)
            bakes = [bake.directory for bake in getattr(modifier, "bakes", ()) if bake.use_custom_path]
            for path in (getattr(domain, "cache_directory", ""), getattr(modifier, "bake_directory", ""), *bakes):
                folders.append(bpy.path.abspath(path, library=block.library))
    folders += [
        bpy.path.abspath(cache.filepath, library=owner.library) for owner, cache in _point_caches() if cache.use_external
    ]
    yield from filter(os.path.isdir, folders)


def _point_caches() -> Iterator[tuple[bpy.types.ID, bpy.types.PointCache]]:
    """Each with the datablock by which its files are called."""
    for block in bpy.data.objects:
        for modifier in block.modifiers:
            if cache := getattr(modifier, "point_cache", None):
                yield block, cache
            for surface in getattr(getattr(modifier, "canvas_settings", None), "canvas_surfaces", ()):
                yield block, surface.point_cache
        yield from ((block, system.point_cache) for system in block.particle_systems)
    yield from ((scene, scene.rigidbody_world.point_cache) for scene in bpy.data.scenes if scene.rigidbody_world)


def _caches_of_unbaked() -> set[tuple[str, int]]:
    """(how the files of a point cache begin, their last number) of those that are written whenever a frame is evaluated."""
    return {
        (cache.name or owner.name.encode().hex().upper(), cache.index)
        for owner, cache in _point_caches()
        if not cache.is_baked and not cache.use_external
    }


def _is_cache_of(path: Path, caches: set[tuple[str, int]]) -> bool:
    match = _POINT_CACHE.fullmatch(path.name)
    return match is not None and (match[1], int(match[2])) in caches


def _imports() -> Iterator[tuple[str, str]]:
    """(path, sentence) of each geometry node that reads a file: one is empty, the sentence where the path is known."""
    for block in bpy.data.objects:
        for modifier in block.modifiers:
            if modifier.type == "NODES" and modifier.node_group:
                for node, path in _imports_in(modifier.node_group, modifier):
                    if path is None:
                        place = f"object {block.name!r}, modifier {modifier.name!r}"
                        yield "", f"{place}: the file of node {node.name!r} can't be known, since other nodes say its path"
                    elif path:
                        yield bpy.path.abspath(path, library=block.library), ""


def _imports_in(tree: bpy.types.NodeTree, outer: Any) -> Iterator[tuple[bpy.types.Node, str | None]]:
    """Each node of the tree that reads a file, and its path, None where that can't be known.

    outer : the giver of the tree's inputs: a modifier, or (the group's node, the giver of the inputs of the tree that this one
        is in).
    """
    for node in tree.nodes:
        if node.bl_idname.startswith("GeometryNodeImport"):
            yield node, _text_at(node.inputs[0], outer)
        elif node.type == "GROUP" and node.node_tree:
            yield from _imports_in(node.node_tree, (node, outer))


def _text_at(socket: bpy.types.NodeSocket, outer: Any) -> str | None:
    """The text that an input has, None where nodes compute it."""
    if not socket.is_linked:
        return getattr(socket, "default_value", None)
    link = socket.links[0]
    node = link.from_node
    if node.bl_idname == "NodeReroute":
        return _text_at(node.inputs[0], outer)
    if node.bl_idname == "FunctionNodeInputString":
        return node.string
    if node.bl_idname != "NodeGroupInput":
        return None
    identifier = link.from_socket.identifier
    if not isinstance(outer, tuple):
        return blender_versions.modifier_input(outer, identifier)
    group, further = outer
    return next((_text_at(each, further) for each in group.inputs if each.identifier == identifier), None)


def _with_usd_layers(files: set[Path]) -> set[Path]:
    """The files, and all that those of USD read besides themselves, as far as that can be known."""
    result, todo = set(files), [path for path in files if path.suffix.lower() in _USD]
    while todo:
        further = set(_usd_layers(todo.pop()) or ()) - result
        result |= further
        todo += [path for path in further if path.suffix.lower() in _USD]
    return result


def _usd_layers(path: Path) -> list[Path] | None:
    """The layers that a USD file names; None where it is binary."""
    try:
        with open(path, "rb") if path.is_file() else io.BytesIO() as file:
            if file.read(len(_USD_BINARY)) == _USD_BINARY:
                return None
            content = file.read()
    except OSError:
        return []
    assets = (quoted or other for quoted, other in _USD_ASSET.findall(content))
    names = [
        asset.decode("utf-8", errors="surrogateescape").partition("[")[0] for asset in assets
    ]  # without what is in a .usdz
    return [file for name in names for file in _files(str(path.parent / name))]


def _colors() -> tuple[list[Path], Path]:
    """The files of the colors' configuration that Blender takes, and their folder."""
    chosen = os.environ.get("OCIO")
    config = Path(chosen) if chosen else _own_colors()
    try:
        text = config.read_text(encoding="utf-8", errors="replace") if config.is_file() else ""
    except OSError:
        text = ""
    stated = _COLORS_FOLDERS.search(text)
    names_of_folders = re.split(r"[:\n]", stated[1]) if stated else []
    folders = [config.parent / os.path.expandvars(folder.strip(" \t-\"'")) for folder in ["", *names_of_folders]]
    names = [os.path.expandvars("".join(match)) for match in _COLORS_FILE.findall(text)]
    tables = (folder / name for name in dict.fromkeys(names) for folder in dict.fromkeys(folders))
    return [config, *(table for table in tables if table.is_file())], config.parent


def _own_colors() -> Path:
    """The configuration that comes with Blender, or that the user has put in its place."""
    folders = (find("DATAFILES", path="colormanagement") for find in (bpy.utils.user_resource, bpy.utils.system_resource))
    return Path(next(filter(os.path.isdir, folders), "")) / "config.ocio"
