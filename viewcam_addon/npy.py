"""NumPy's arrays in files, written, and read of strangers: nothing is allocated for one before its header is known to be true.

A header says type and shape, of which follows how many bytes come after it; the file, or the archive's table, says how many do.
NumPy's own readers allocate what a header says, and raise whatever the parser of Python does where it says nothing.
"""

import io
import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

_format: Any = np.lib.format  # has no types
_HEADERS = {(1, 0): _format.read_array_header_1_0, (2, 0): _format.read_array_header_2_0}


def header(file: IO[bytes]) -> tuple[np.dtype, int]:
    """The type of an array and its size in bytes, as its header has them; the file then stands behind it.

    Raises ValueError if it is none.
    """
    try:
        version = _format.read_magic(file)
        shape, _, dtype = _HEADERS[version](file)
    except Exception as error:  # Python's tokenizer and parser have no common class
        raise ValueError("no header") from error
    if any(type(length) is not int or length < 0 for length in shape):
        raise ValueError("no shape")
    return dtype, math.prod(shape) * dtype.itemsize


def read(data: bytes) -> NDArray:
    """The array of real numbers that a .npy file holds. Raises ValueError if it holds none, or not all of it."""
    file = io.BytesIO(data)
    dtype, size = header(file)
    if dtype.kind not in "iuf" or file.tell() + size != len(data):
        raise ValueError("its header is not true")
    file.seek(0)
    try:
        array: NDArray = _format.read_array(file, allow_pickle=False)
    except (OSError, OverflowError, TypeError) as error:  # 33 axes, or one that no machine counts to
        raise ValueError("no array") from error
    return array


def members(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """The members of a .npz that are arrays, by their names, packed as NumPy packs them."""
    return {
        member.filename.removesuffix(".npy"): member
        for member in archive.infolist()
        if member.filename.endswith(".npy") and member.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
    }


def write_archive(path: Path, arrays: Mapping[str, NDArray], is_compressed: bool = False) -> None:
    """Write a .npz, the bytes of `np.savez`, which leaves an open archive that prints a traceback where a disk is full.

    Raises OSError if it can't be written.
    """
    kind = zipfile.ZIP_DEFLATED if is_compressed else zipfile.ZIP_STORED
    with open(path, "wb") as file, zipfile.ZipFile(file, "w", kind) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                _format.write_array(member, np.asanyarray(array), allow_pickle=False)
