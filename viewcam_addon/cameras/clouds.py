"""Points of data sets: COLMAP's points3D, text and binary, and the vertices of the PLY files of splatting and nerfstudio.

`of` finds them where a data set has them; nothing but their places is read. Rejected: plyfile, a dependency for three numbers
of a vertex.
"""

import itertools
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .. import checks
from ..errors import InputError
from ..files import read_bytes
from . import colmap, naming
from .source import Source

_PLACES = ("points3D.ply", "sparse_pc.ply", "sparse/0/points3D.ply", "input.ply", "points.ply")
_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST_HEAD = 2**16


def of(source: Source) -> np.ndarray | None:
    """(n, 3) the points of a data set, in its world and unit; None if it has none.

    source : its folder or file of cameras. Of a COLMAP model they are its points3D, of a transforms.json the `ply_file_path`
    that it names, else a PLY beside the cameras, called as these programs call theirs.

    Raises InputError if they are damaged.
    """
    if source.path is None:
        return None
    folder = source.path if source.is_folder else source.path.parent
    if model := colmap.model(source):
        points = folder.joinpath(*model[0], f"points3D{model[1]}")
        if points.is_file():
            return np.array([place for _, place in of_colmap(points)]).reshape(-1, 3)
    transforms = source.file("transforms.json") if source.is_folder else source
    named = transforms.document.get("ply_file_path") if transforms else None
    for name in (*((named,) if isinstance(named, str) else ()), *_PLACES):
        if (file := naming.near(name, folder)) and file.suffix == ".ply":
            return of_ply(file)
    return None


def of_colmap(path: Path) -> Iterator[tuple[int, tuple[float, ...]]]:
    """The number and place of each point of a points3D.txt or .bin. Raises InputError if it is damaged."""
    return _of_binary(path) if path.suffix == ".bin" else _of_text(path)


def _of_text(path: Path) -> Iterator[tuple[int, tuple[float, ...]]]:
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        words = line.split()
        if words and not words[0].startswith("#"):
            try:
                yield int(words[0]), checks.vector("a point", [float(word) for word in words[1:4]], 3)
            except ValueError:
                raise InputError(f"line {number} of {path} is {checks.quoted(line)}: it should be POINT3D_ID X Y Z …") from None


def _of_binary(path: Path) -> Iterator[tuple[int, tuple[float, ...]]]:
    data = path.read_bytes()
    try:
        (count,), at = struct.unpack_from("<Q", data), 8
        for _ in range(count):
            point, x, y, z = struct.unpack_from("<Q3d", data, at)
            (length,) = struct.unpack_from("<Q", data, at + 43)
            at += 51 + 8 * length
            yield point, checks.vector("a point", (x, y, z), 3)
    except (struct.error, OverflowError):
        raise InputError(f"{path} ends too early: copy it again") from None


def of_ply(path: Path) -> np.ndarray:
    """(n, 3) the places of a PLY's vertices, which stand first in it. Raises InputError if it is no PLY, or ends too early."""
    data = read_bytes(path)
    head, end, body = data[:_LONGEST_HEAD].partition(b"end_header")
    lines = [line.split() for line in head.decode("ascii", errors="replace").splitlines()]
    formats = [words[1] for words in lines if words[:1] == ["format"] and len(words) > 1]
    elements = [number for number, words in enumerate(lines) if words[:1] == ["element"]]
    if lines[:1] != [["ply"]] or not end or not formats or not elements or lines[elements[0]][1:2] != ["vertex"]:
        raise InputError(f"{path} is no PLY with vertices: give another")
    start = len(head) + len(end) + body.find(b"\n") + 1
    properties = itertools.takewhile(lambda words: words[:1] != ["element"], lines[elements[0] + 1 :])
    fields = [(words[2], words[1]) for words in properties if words[:1] == ["property"] and len(words) == 3]
    try:
        count = int(lines[elements[0]][2])
        columns = [[name for name, _ in fields].index(axis) for axis in "xyz"]
        if formats[0] == "ascii":
            rows = data[start:].split(b"\n", count)[:count]
            points = np.array([[float(row.split()[column]) for column in columns] for row in rows]).reshape(-1, 3)
        else:
            vertex = np.dtype([(name, _ORDERS[formats[0]] + _TYPES[kind]) for name, kind in fields])
            vertices = np.frombuffer(data, vertex, count, start) if count else np.zeros(0, vertex)
            points = np.column_stack([vertices[axis] for axis in "xyz"]).astype(np.float64)
        if len(points) != count:
            raise ValueError
    except (ValueError, LookupError, OverflowError):
        raise InputError(f"{path} is damaged, or is a PLY of another kind: write it again") from None
    return points[np.isfinite(points).all(axis=1)]
