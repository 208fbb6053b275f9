"""Masks as run lengths and boxes, in COCO's terms: rows from the **top**, runs down the columns, boxes by the pixels' edges.

The masks of all instances are made together, of their runs in the order of instances and places: what covers a few pixels costs
no more than these. A place is a pixel's number down the columns from the top left.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Window = tuple[int, int, NDArray[np.bool_]]
"""A part of a picture: its first column and row, and which of its pixels are set, rows from the bottom."""

Masks = list[dict[str, Any] | None]
"""The mask of each instance: area in pixels, box [x, y, width, height] and uncompressed run lengths; None where it has no
pixel."""


def of_picture(instance: NDArray[np.int64], count: int) -> Masks:
    """The masks of what each pixel shows. instance : (height, width) numbers below `count`, −1 for none, rows from the
    bottom."""
    height, width = instance.shape
    owner = instance[::-1].T.ravel()
    starts = np.flatnonzero(np.diff(owner, prepend=-2))
    ends = np.append(starts[1:], owner.size)
    owners = owner[starts]
    order = np.argsort(owners, kind="stable")
    order = order[np.searchsorted(owners[order], 0) :]
    return _described(owners[order], starts[order], ends[order], (height, width), count)


def of_windows(windows: Sequence[Window | None], shape: tuple[int, int]) -> Masks:
    """The masks of each instance's part of the picture. shape : height and width of the picture."""
    height = shape[0]
    there = [(owner, *window) for owner, window in enumerate(windows) if window is not None and window[2].size]
    # Column after column from the top, each with a pixel more before its head, not set, so that none runs on in the next.
    begins = np.cumsum([0, *((len(covered) + 1) * covered.shape[1] for *_, covered in there)])
    columns = np.zeros(begins[-1] + 1, np.int8)
    for begin, end, (*_, covered) in zip(begins[:-1].tolist(), begins[1:].tolist(), there, strict=True):
        columns[begin:end].reshape(covered.shape[1], -1)[:, 1:] = covered[::-1].T
    changes = np.flatnonzero(np.diff(columns))
    starts, ends = changes[::2], changes[1::2]
    which = np.searchsorted(begins, starts, side="right") - 1
    figures = [(owner, left, height - low - len(covered), len(covered) + 1) for owner, left, low, covered in there]
    owners, left, top, rows = np.array(figures, np.intp).reshape(-1, 4)[which].T
    column, row = np.divmod(starts - begins[which], rows)
    lengths = ends - starts
    starts = (left + column) * height + top + row
    # A column that is set to its foot goes on at the head of the next.
    goes_on = np.zeros(len(starts), bool)
    goes_on[1:] = (owners[1:] == owners[:-1]) & (starts[1:] == (starts + lengths)[:-1])
    is_last = np.append(~goes_on[1:], True)[: len(starts)]
    return _described(owners[~goes_on], starts[~goes_on], (starts + lengths)[is_last], shape, len(windows))


def decoded(segmentation: dict[str, Any]) -> NDArray[np.bool_]:
    """(height, width), rows from the **top**: the mask of uncompressed run lengths. Raises ValueError if they don't fill it."""
    height, width = segmentation["size"]
    counts = segmentation["counts"]
    return np.repeat(np.arange(len(counts)) % 2 == 1, counts).reshape(width, height).T


def compressed(segmentation: dict[str, Any]) -> dict[str, Any]:
    """The mask with its run lengths as a text, which is how pycocotools' functions of masks take them.

    From the fourth on, each is its difference to the one two before; each number is five bits a character, the lowest first,
    and a sixth says that more follow. Source: cocoapi, common/maskApi.c, rleToString.
    """
    rest = np.array(segmentation["counts"])
    rest[3:] -= rest[1:-2].copy()
    more = np.ones(len(rest), bool)
    columns = []
    while more.any():
        bits, is_there = rest & 31, more
        rest = rest >> 5
        more = is_there & (rest != np.where(bits & 16, -1, 0))
        columns.append(np.where(is_there, 48 + bits + 32 * more, 0))
    letters = np.stack(columns, axis=1)
    return {**segmentation, "counts": letters[letters > 0].astype(np.uint8).tobytes().decode("ascii")}


def _described(
    owners: NDArray[np.intp], starts: NDArray[np.intp], ends: NDArray[np.intp], shape: tuple[int, int], count: int
) -> Masks:
    """The description of runs in order: whose they are, their first places and those after their last."""
    result: Masks = [None] * count
    if not len(owners):
        return result
    height, width = shape
    first = np.flatnonzero(np.diff(owners, prepend=-1))
    last = np.append(first[1:], len(owners)) - 1
    gaps = starts - np.append(0, ends[:-1])
    gaps[first] = starts[first]
    counts = np.stack([gaps, ends - starts], axis=1).ravel().tolist()
    is_across = starts // height != (ends - 1) // height  # from the foot of a column to the head of the next
    left = np.minimum.reduceat(starts // height, first)
    right = np.maximum.reduceat((ends - 1) // height, first)
    top = np.minimum.reduceat(np.where(is_across, 0, starts % height), first)
    bottom = np.maximum.reduceat(np.where(is_across, height - 1, (ends - 1) % height), first)
    boxes = np.stack([left, top, right - left + 1, bottom - top + 1], axis=1).tolist()
    areas = np.add.reduceat(ends - starts, first).tolist()
    rests = (height * width - ends[last]).tolist()
    rows = zip(owners[first].tolist(), areas, boxes, rests, first.tolist(), last.tolist(), strict=True)
    for owner, area, box, rest, begin, end in rows:
        runs = counts[2 * begin : 2 * end + 2] + [rest] * (rest > 0)  # runs of zeros first: 0 where the first pixel is set
        result[owner] = {"area": area, "bbox": box, "segmentation": {"size": [height, width], "counts": runs}}
    return result
