"""Numbers for objects and materials that carry none, so that the index passes tell them apart.

Every object and material of a new file has the pass index 0. For the time of a comparison they are numbered from 1, for both
sides. As soon as one of them carries a number its artist has a use for them, and they stay. Rejected: `foreach_set`, which
passes over what is linked from a library.
"""

import contextlib
from collections.abc import Iterator

import bpy

LARGEST = 32767  # of pass_index


@contextlib.contextmanager
def numbered() -> Iterator[None]:
    """Number the file's objects, and its materials, where all of them have the index 0."""
    blank = [blocks for blocks in (bpy.data.objects, bpy.data.materials) if not any(block.pass_index for block in blocks)]
    try:
        for blocks in blank:
            for number, block in enumerate(blocks):
                # Beyond the largest they start again: two of them may share a number then.
                block.pass_index = number % LARGEST + 1
        yield
    finally:
        for blocks in blank:
            for block in blocks:
                block.pass_index = 0
