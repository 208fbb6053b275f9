"""PNG files: the one encoder, a dozen lines over zlib; of those that Blender wrote, whether they are whole, and their texts.

Layout: the PNG specification (W3C), section 5: a signature, then chunks of length, type, data and checksum, IEND the last.
Rejected: Pillow, which an add-on inside Blender does not have, and which reads 16 bits of three channels as 8.
"""

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
# zlib's fastest: of depths, ids and masks a third more bytes than its usual 6, in a quarter to a third of the time.
_LEVEL = 1
_TEXTS = (b"tEXt", b"zTXt", b"iTXt", b"tIME")


def encoded(pixels: NDArray[np.uint8] | NDArray[np.uint16], palette: bytes | None = None) -> bytes:
    """A picture as a PNG file.

    pixels : rows from the top; (height, width, 3 or 4) colors, or (height, width): indices into `palette`, uint8, or grays.
    palette : three bytes a color; the first color is see-through.
    """
    height, width = pixels.shape[:2]
    lines = np.ascontiguousarray(pixels).astype(pixels.dtype.newbyteorder(">"), copy=False).view(np.uint8).reshape(height, -1)
    if palette is None:
        # Each row is stored as its difference to the one above (filter 2), which compresses well.
        kind, filtered, chunks = {1: 0, 3: 2, 4: 6}[pixels.shape[2] if pixels.ndim == 3 else 1], 2, ()
        lines = lines - np.vstack([np.zeros_like(lines[:1]), lines[:-1]])
    else:
        kind, filtered, chunks = 3, 0, ((b"PLTE", palette), (b"tRNS", b"\0"))
    rows = np.column_stack([np.full(height, filtered, np.uint8), lines])
    header = struct.pack(">IIBBBBB", width, height, 8 * pixels.dtype.itemsize, kind, 0, 0, 0)
    chunks = ((b"IHDR", header), *chunks, (b"IDAT", zlib.compress(rows.tobytes(), _LEVEL)), (b"IEND", b""))
    return _SIGNATURE + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks
    )


def is_whole(path: str | os.PathLike[str]) -> bool:
    """True if the file has all of its chunks."""
    try:
        content = Path(path).read_bytes()
    except OSError:
        return False
    kinds = [kind for kind, _ in _chunks(content)]
    return content.startswith(_SIGNATURE) and kinds[-1:] == [b"IEND"]


def strip(path: str | os.PathLike[str]) -> None:
    """Take texts and times out of a whole PNG; its pixels stay as they are, byte for byte."""
    kept = [chunk for kind, chunk in _chunks(Path(path).read_bytes()) if kind not in _TEXTS]
    Path(path).write_bytes(_SIGNATURE + b"".join(kept))


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """The type of each chunk that is there whole, and all of its bytes."""
    at = len(_SIGNATURE)
    while at + 12 <= len(content):
        (size,) = struct.unpack_from(">I", content, at)
        end = at + 12 + size
        if end <= len(content):
            yield content[at + 4 : at + 8], content[at:end]
        at = end
