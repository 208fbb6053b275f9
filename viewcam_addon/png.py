"""PNG files: encoder and decoder over zlib; of those that Blender wrote, whether they are whole, and their texts.

Layout: the PNG specification (W3C), section 5: a signature, then chunks of length, type, data and checksum, IEND the last.
Rejected: Pillow, which an add-on inside Blender does not have, and which reads 16 bits of three channels as 8.
"""

import os
import struct
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
# zlib's fastest: of depths, ids and masks a third more bytes than its usual 6, in a quarter to a third of the time.
_LEVEL = 1
_CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}  # by the kind of color
_TEXTS = (b"tEXt", b"zTXt", b"iTXt", b"tIME")


def encoded(pixels: NDArray[np.uint8] | NDArray[np.uint16], palette: bytes | None = None) -> bytes:
    """A picture as a PNG file.

    pixels : rows from the top; (height, width, 3 or 4) colors, or (height, width): indices into `palette`, uint8, or grays.
    palette : three bytes a color; the first color is see-through.
    """
    height, width = pixels.shape[:2]
    lines = np.ascontiguousarray(pixels).astype(pixels.dtype.newbyteorder(">"), copy=False).view(np.uint8).reshape(height, -1)
    colors: tuple[tuple[bytes, bytes], ...] = ()
    if palette is None:
        # Each row is stored as its difference to the one above (filter 2), which compresses well.
        kind, filtered = {1: 0, 3: 2, 4: 6}[pixels.shape[2] if pixels.ndim == 3 else 1], 2
        lines = lines - np.vstack([np.zeros_like(lines[:1]), lines[:-1]])
    else:
        kind, filtered, colors = 3, 0, ((b"PLTE", palette), (b"tRNS", b"\0"))
    rows = np.column_stack([np.full(height, filtered, np.uint8), lines])
    header = struct.pack(">IIBBBBB", width, height, 8 * pixels.dtype.itemsize, kind, 0, 0, 0)
    chunks = ((b"IHDR", header), *colors, (b"IDAT", zlib.compress(rows.tobytes(), _LEVEL)), (b"IEND", b""))
    return _SIGNATURE + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks
    )


def decoded(content: bytes) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """(height, width, channels) of a PNG of grays or colors in 8 or 16 bits, as Blender and `encoded` write them.

    Raises ValueError if it is damaged or another PNG: one with a palette, with fewer bits, or in seven passes (Adam7).
    """
    chunks = [(kind, chunk[8:-4]) for kind, chunk in _chunks(content)]
    if not content.startswith(_SIGNATURE) or not chunks or len(chunks[0][1]) != 13:
        raise ValueError("no PNG")
    width, height, depth, kind, _, _, passes = struct.unpack(">IIBBBBB", chunks[0][1])
    if depth not in (8, 16) or kind not in _CHANNELS or passes or not width * height:
        raise ValueError("another PNG")
    step = _CHANNELS[kind] * depth // 8  # bytes of a pixel
    most = min(height * (width * step + 1), sys.maxsize)
    try:
        data = zlib.decompressobj().decompress(b"".join(each for name, each in chunks if name == b"IDAT"), most)
        filtered = np.frombuffer(data, np.uint8).reshape(height, width * step + 1)
    except zlib.error as error:
        raise ValueError("a damaged PNG") from error
    lines = _unfiltered(filtered[:, 0], filtered[:, 1:].reshape(height, width, step))
    return lines.reshape(height, -1).view(f">u{depth // 8}").astype(f"u{depth // 8}").reshape(height, width, -1)


def _unfiltered(filters: NDArray[np.uint8], differences: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The bytes of all pixels, (height, width, bytes of a pixel).

    filters : the filter of each row.

    A byte needs those of the pixels to the left, above and between them. So what lies on one diagonal, column + row = k, needs
    only the two diagonals before it: each is a row of these arrays, and computed at once.
    """
    if filters.max() > 4:
        raise ValueError("a damaged PNG")
    height, width, step = differences.shape
    rows, columns = np.arange(height)[:, None], np.arange(width)
    skewed = np.zeros((height + width - 1, height, step), np.uint8)
    skewed[rows + columns, rows] = differences
    result = np.zeros((height + width + 1, height + 1, step), np.int16)  # from 2 and 1 on, and 0 around the picture
    for k in range(height + width - 1):
        low, high = max(0, k - width + 1), min(height, k + 1)
        left, over, corner = result[k + 1, low + 1 : high + 1], result[k + 1, low:high], result[k, low:high]
        to_left, to_over, to_corner = np.abs(over - corner), np.abs(left - corner), np.abs(left + over - 2 * corner)
        nearest = np.where(to_over <= to_corner, over, corner)
        paeth = np.where((to_left <= to_over) & (to_left <= to_corner), left, nearest)
        guess = np.choose(filters[low:high, None], (np.zeros_like(left), left, over, (left + over) >> 1, paeth))
        result[k + 2, low + 1 : high + 1] = (skewed[k, low:high] + guess) & 255
    return result[rows + columns + 2, rows + 1].astype(np.uint8)


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
