"""Numbers for objects and materials that carry none, so that the index passes tell them apart.

Every object and material of a new file has the pass index 0. For the time of a comparison they are numbered from 1, for both
sides. As soon as one of them carries a number its artist has a use for them, and they stay.
"""

import contextlib
from collections.abc import Iterator

import bpy
import numpy as np

_LARGEST = 32767  # of pass_index


@contextlib.contextmanager
def numbered() -> Iterator[None]:
    """Number the file's objects, and its materials, where all of them have the index 0."""
    blank = [blocks for blocks in (bpy.data.objects, bpy.data.materials) if not _numbers(blocks).any()]
    try:
        for blocks in blank:
            # Beyond the largest they start again: two of them may share a number then.
            blocks.foreach_set("pass_index", np.arange(len(blocks), dtype=np.int32) % _LARGEST + 1)
        yield
    finally:
        for blocks in blank:
            blocks.foreach_set("pass_index", np.zeros(len(blocks), np.int32))


def _numbers(blocks: bpy.types.bpy_prop_collection) -> np.ndarray:
    numbers = np.zeros(len(blocks), np.int32)
    blocks.foreach_get("pass_index", numbers)
    return numbers
