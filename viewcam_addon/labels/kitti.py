"""Depth and optical flow of many pictures as KITTI has them: 16-bit PNGs in folders of their own, each called as its picture.

depth/ is in steps of 1/256 m, 0 where nothing is, beyond 255.99 m, or nearer than half a step. flow_occ/ has 64 u + 2¹⁵,
64 v + 2¹⁵ and 1 in red, green and blue, pixels to the right and down to the next frame; where nothing is known, or it is beyond
±512 pixels, all three are 0. flow_noc/ has the same without what is hidden in the next frame. A scene unit is a meter.

Source: the devkits' readme.txt of KITTI's stereo, flow and depth benchmarks. Rejected: their numbers as names (000000_10.png),
since which picture is the next one no label tells.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import folder_written_whole
from ..png import encoded
from . import files
from .coco import read_pictures

DEPTH_STEPS = 256.0
"""In a meter."""

_FLOW_STEPS, _NO_FLOW = 64.0, 2.0**15


def write(folder: Path, output: Path, overwrite: bool = False) -> dict[str, int]:
    """Write a new folder of what each picture's labels have of depth and forward flow, whole or not at all.

    folder : of label files. output : must not be there yet, or be empty. overwrite : whether it may be what was written so.

    Returns how many pictures have which.

    Raises
    ------
    InputError
        if there are no label files, one has neither, or can't be read, or the folder can't be written.
    """
    pictures, _ = read_pictures(folder)
    counts = {"depth": 0, "flow": 0}

    def may_replace(there: Path) -> bool:
        return overwrite and files.holds(there, (), ("depth", "flow_occ", "flow_noc"))

    with folder_written_whole(output, may_replace) as temporary:
        for path, document in pictures:
            planes = _planes(files.passes(path, document, ("Depth", "Forward Flow", "Forward Hidden")))
            if not planes:
                raise InputError(f"{path} has neither depth nor forward flow: render it with --labels depth,flow --next")
            for kind, pixels in planes.items():
                (temporary / kind).mkdir(exist_ok=True)
                (temporary / kind / f"{files.name(path)}.png").write_bytes(encoded(pixels))
            counts["depth"] += "depth" in planes
            counts["flow"] += "flow_occ" in planes
    return counts


def _planes(passes: dict[str, NDArray[np.float32]]) -> dict[str, NDArray[np.uint16]]:
    planes = {}
    if "Depth" in passes:
        planes["depth"] = files.depth_levels(passes["Depth"][..., 0], DEPTH_STEPS)
    if "Forward Flow" in passes:
        planes["flow_occ"] = flow_levels(passes["Forward Flow"])
        planes["flow_noc"] = np.where(passes["Forward Hidden"] == 0, planes["flow_occ"], 0).astype(np.uint16)
    return planes


def flow_levels(flow: NDArray[np.float32]) -> NDArray[np.uint16]:
    """(height, width, 3) of a flow (height, width, 2) in pixels right and down, nan where unknown; nothing wraps."""
    levels = np.rint(flow.astype(np.float64) * _FLOW_STEPS + _NO_FLOW)
    with np.errstate(invalid="ignore"):
        known = ((levels >= 0) & (levels <= 65535)).all(axis=-1, keepdims=True)
    return np.where(known, np.concatenate([levels, np.ones_like(known)], axis=-1), 0).astype(np.uint16)
