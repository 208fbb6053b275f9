"""Masks as run lengths and boxes, in COCO's terms: rows from the **top**, runs down the columns, boxes by the pixels' edges.

A mask comes as the numbers of its pixels, counted row by row from the **bottom**, as everywhere here: what covers a few pixels
costs no more than these.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def described(pixels: NDArray[np.intp], shape: tuple[int, int]) -> dict[str, Any] | None:
    """Area in pixels, box [x, y, width, height] and uncompressed run lengths of a mask; None where it is empty.

    pixels : (n,), each once. shape : height and width.
    """
    if not len(pixels):
        return None
    rows, columns = np.divmod(pixels, shape[1])
    rows = shape[0] - 1 - rows
    left, top = int(columns.min()), int(rows.min())
    box = [left, top, int(columns.max()) - left + 1, int(rows.max()) - top + 1]
    counts = _run_lengths(np.sort(columns * shape[0] + rows), shape[0] * shape[1])
    return {"area": len(pixels), "bbox": box, "segmentation": {"size": list(shape), "counts": counts}}


def decoded(segmentation: dict[str, Any]) -> NDArray[np.bool_]:
    """(height, width), rows from the **top**: the mask of uncompressed run lengths. Raises ValueError if they don't fill it."""
    height, width = segmentation["size"]
    counts = segmentation["counts"]
    return np.repeat(np.arange(len(counts)) % 2 == 1, counts).reshape(width, height).T


def _run_lengths(places: NDArray[np.intp], size: int) -> list[int]:
    """Lengths of runs, of zeros first (0 where the first pixel is set), of the places in order that are set."""
    breaks = np.flatnonzero(np.diff(places) > 1)
    starts = places[np.concatenate([[0], breaks + 1])]
    ends = places[np.concatenate([breaks, [len(places) - 1]])] + 1
    edges = np.stack([starts, ends], axis=1).ravel()
    counts = np.diff(edges, prepend=0, append=size)
    return counts.tolist() if counts[-1] else counts[:-1].tolist()
