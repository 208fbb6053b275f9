"""PNG files that Blender wrote: whether they are whole, and their texts. A few lines in place of a library more to bundle.

Layout: the PNG specification (W3C), section 5: a signature, then chunks of length, type, data and checksum, IEND the last.
"""

import os
import struct
from collections.abc import Iterator
from pathlib import Path

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_TEXTS = (b"tEXt", b"zTXt", b"iTXt", b"tIME")


def is_whole(path: str | os.PathLike[str]) -> bool:
    """Whether the file has all of its chunks."""
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
