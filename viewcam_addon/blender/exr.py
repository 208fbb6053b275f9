"""Whether an EXR that Blender wrote is whole: on a full disk Blender reports it as saved all the same.

An EXR file holds a table with the offset of each chunk of pixels, written when all of them are; a chunk that is missing has the
offset 0. To read it takes a few lines, and OpenEXR itself must not be loaded into Blender's process. Layout: the format's own
documentation, "OpenEXR File Layout".
"""

import os
import struct
from collections.abc import Iterator
from typing import BinaryIO

_MAGIC = 20000630
_MULTIPART = 0x1000
# Rows of a chunk, by the number of the compression in the header: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
_ROWS = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256)


def is_whole(path: str | os.PathLike[str]) -> bool:
    """Whether all pixels of a scan-line EXR, of one part or several, are in the file."""
    try:
        with open(path, "rb") as file:
            magic, version = struct.unpack("<II", file.read(8))
            many = bool(version & _MULTIPART)
            count = sum(map(_chunk_count, _headers(file, many)))
            offsets = struct.unpack(f"<{count}Q", file.read(8 * count))
            # The last chunk: its part's number, if there are several, its row, the size of what follows.
            file.seek(max(offsets) + (8 if many else 4))
            (size,) = struct.unpack("<i", file.read(4))
            end = file.tell() + size
            return magic == _MAGIC and min(offsets) > 0 and end <= os.fstat(file.fileno()).st_size
    except (OSError, ValueError, LookupError, struct.error):
        return False


def _headers(file: BinaryIO, many: bool) -> Iterator[dict[str, bytes]]:
    """The attributes of each part."""
    while header := dict(_attributes(file)):
        yield header
        if not many:
            return


def _attributes(file: BinaryIO) -> Iterator[tuple[str, bytes]]:
    while name := _text(file):
        _text(file)  # its type
        (size,) = struct.unpack("<i", file.read(4))
        yield name, file.read(size)


def _text(file: BinaryIO) -> str:
    """A text that ends with a zero, or with the file."""
    letters = bytearray()
    while (letter := file.read(1)) not in (b"\0", b""):
        letters += letter
    return letters.decode("latin-1")


def _chunk_count(header: dict[str, bytes]) -> int:
    if "chunkCount" in header:
        return struct.unpack("<i", header["chunkCount"])[0]
    _, lowest, _, highest = struct.unpack("<4i", header["dataWindow"])
    return -(-(highest - lowest + 1) // _ROWS[header["compression"][0]])
