"""Masks as run lengths and boxes, in COCO's terms: rows from the **top**, runs down the columns, boxes by the pixels' edges.

The masks of all instances are made together, of their runs in the order of instances and places: what covers a few pixels costs
no more than these. A place is a pixel's number down the columns from the top left.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Masks = list[dict[str, Any] | None]
"""Of each instance: area in pixels, box [x, y, width, height] and uncompressed run lengths; None where it has no pixel."""


def of_picture(instance: NDArray[np.int64], count: int) -> Masks:
    """Those of what each pixel shows. instance : (height, width) numbers below `count`, −1 for none, rows from the bottom."""
    shown = instance[::-1].T.ravel()
    starts = np.flatnonzero(np.diff(shown, prepend=-2))
    ends = np.append(starts[1:], shown.size)
    owners = shown[starts]
    order = np.argsort(owners, kind="stable")
    order = order[np.searchsorted(owners[order], 0) :]
    return _described(owners[order], starts[order], ends[order], instance.shape, count)


def of_pixels(parts: Sequence[NDArray[np.intp]], shape: tuple[int, int]) -> Masks:
    """Those of each instance's pixels, counted row by row from the bottom, each once. shape : height and width."""
    height, width = shape
    rows, columns = np.divmod(np.concatenate([np.empty(0, np.intp), *parts]), width)
    owners = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    apart = height * width + 1  # so that no run goes on from one instance to the next
    places = np.sort(owners * apart + columns * height + (height - 1 - rows))
    is_first = np.diff(places, prepend=-2) != 1
    owners, starts = np.divmod(places[is_first], apart)
    ends = places[np.append(is_first[1:], True)[: len(places)]] % apart + 1
    return _described(owners, starts, ends, shape, len(parts))


def decoded(segmentation: dict[str, Any]) -> NDArray[np.bool_]:
    """(height, width), rows from the **top**: the mask of uncompressed run lengths. Raises ValueError if they don't fill it."""
    height, width = segmentation["size"]
    counts = segmentation["counts"]
    return np.repeat(np.arange(len(counts)) % 2 == 1, counts).reshape(width, height).T


def _described(
    owners: NDArray[np.intp], starts: NDArray[np.intp], ends: NDArray[np.intp], shape: tuple[int, int], count: int
) -> Masks:
    """Of runs in order: whose they are, their first places and those after their last."""
    found: Masks = [None] * count
    if not len(owners):
        return found
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
    told = zip(owners[first].tolist(), areas, boxes, rests, first.tolist(), last.tolist(), strict=True)
    for owner, area, box, rest, begin, end in told:
        runs = counts[2 * begin : 2 * end + 2] + [rest] * (rest > 0)  # of zeros first: 0 where the first pixel is set
        found[owner] = {"area": area, "bbox": box, "segmentation": {"size": [height, width], "counts": runs}}
    return found
