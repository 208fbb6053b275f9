"""A check that an EXR that Blender wrote is whole (on a full disk Blender reports it as saved all the same), and its
attributes.

An EXR file holds a table with the offset of each chunk of pixels, written when all of them are; a chunk that is missing has the
offset 0. To read it takes a few lines, and OpenEXR itself must not be loaded into Blender's process. Layout: the format's own
documentation, "OpenEXR File Layout".
"""

import io
import os
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

_MAGIC = 20000630
_MULTIPART = 0x1000

_Header = dict[str, tuple[str, bytes]]
"""The attributes of a part: name → (type, value)."""

# Rows of a chunk, by the number of the compression in the header: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
_ROWS = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256)


def is_whole(path: str | os.PathLike[str]) -> bool:
    """True if all pixels of a scan-line EXR, of one part or several, are in the file."""
    try:
        with open(path, "rb") as file:
            (magic,) = struct.unpack("<I", file.read(4))
            many = _is_multipart(file)
            offsets = _offsets(file, list(_headers(file, many)))
            # The last chunk: its part's number, if there are several, its row, the size of what follows.
            file.seek(max(offsets) + (8 if many else 4))
            (size,) = struct.unpack("<i", file.read(4))
            end = file.tell() + size
            return magic == _MAGIC and min(offsets) > 0 and end <= os.fstat(file.fileno()).st_size
    except (OSError, ValueError, LookupError, struct.error):
        return False


def strip(path: str | os.PathLike[str], is_unwanted: Callable[[str], bool]) -> None:
    """Take attributes out of the headers of a whole EXR, by their names; its pixels stay as they are, byte for byte."""
    content = Path(path).read_bytes()
    file = io.BytesIO(content)
    file.seek(4)
    many = _is_multipart(file)
    headers = list(_headers(file, many))
    kept = [{name: attribute for name, attribute in header.items() if not is_unwanted(name)} for header in headers]
    packed = b"".join(map(_packed, kept)) + b"\0" * many
    shorter = file.tell() - 8 - len(packed)
    offsets = [offset - shorter for offset in _offsets(file, headers)]
    table = struct.pack(f"<{len(offsets)}Q", *offsets)
    Path(path).write_bytes(content[:8] + packed + table + content[file.tell() :])


def _is_multipart(file: BinaryIO) -> bool:
    (version,) = struct.unpack("<I", file.read(4))
    return bool(version & _MULTIPART)


def _offsets(file: BinaryIO, headers: list[_Header]) -> tuple[int, ...]:
    """The offsets in the file of each chunk of pixels, of all parts."""
    count = sum(map(_chunk_count, headers))
    return struct.unpack(f"<{count}Q", file.read(8 * count))


def _headers(file: BinaryIO, many: bool) -> Iterator[_Header]:
    """The attributes of each part."""
    while header := dict(_attributes(file)):
        yield header
        if not many:
            return


def _attributes(file: BinaryIO) -> Iterator[tuple[str, tuple[str, bytes]]]:
    while name := _text(file):
        kind = _text(file)
        (size,) = struct.unpack("<i", file.read(4))
        yield name, (kind, file.read(size))


def _packed(header: _Header) -> bytes:
    """A header as it stands in the file."""
    words = [
        f"{name}\0{kind}\0".encode("latin-1") + struct.pack("<i", len(value)) + value for name, (kind, value) in header.items()
    ]
    return b"".join(words) + b"\0"


def _text(file: BinaryIO) -> str:
    """A text that ends with a zero, or with the file."""
    letters = bytearray()
    while (letter := file.read(1)) not in (b"\0", b""):
        letters += letter
    return letters.decode("latin-1")


def _chunk_count(header: _Header) -> int:
    values = {name: value for name, (_, value) in header.items()}
    if "chunkCount" in values:
        return struct.unpack("<i", values["chunkCount"])[0]
    _, lowest, _, highest = struct.unpack("<4i", values["dataWindow"])
    return -(-(highest - lowest + 1) // _ROWS[values["compression"][0]])
