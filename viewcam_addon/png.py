"""The one PNG encoder: a dozen lines over zlib.

Rejected: Pillow, which an add-on inside Blender does not have, and which reads 16 bits of three channels as 8.
"""

import struct
import zlib

import numpy as np
from numpy.typing import NDArray


def encoded(pixels: NDArray[np.uint8] | NDArray[np.uint16], palette: bytes | None = None) -> bytes:
    """A picture as a PNG file.

    pixels : rows from the top; (height, width, 3 or 4) colours, or (height, width): indices into `palette`, uint8, or greys.
    palette : three bytes a colour; the first colour is see-through.
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
    chunks = ((b"IHDR", header), *chunks, (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks
    )
