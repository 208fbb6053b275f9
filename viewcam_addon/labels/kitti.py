"""Depth, optical flow and stereo of many pictures as KITTI has them: 16-bit PNGs in folders, each called as its picture.

depth/ is in steps of 1/256 m, 0 where nothing is, beyond 255.99 m, or nearer than half a step. flow_occ/ has 64 u + 2¹⁵,
64 v + 2¹⁵ and 1 in red, green and blue, pixels to the right and down to the next frame; where nothing is known, or it is beyond
±512 pixels, all three are 0. flow_noc/ has the same without what is hidden in the next frame. A scene unit is a meter.

Of a stereo pair, which is called as its left picture, disp_occ_0/ has that picture's disparity in steps of 1/256 pixel, 0 where
none is known, and disp_noc_0/ the same without what the right picture does not see; image_2/ and image_3/ have the
pictures, calib_cam_to_cam/ the projection matrices, in the left camera's axes.

Source: the devkits' readme.txt of KITTI's stereo, flow and depth benchmarks. Rejected: their numbers as names (000000_10.png),
since which picture is the next one no label tells.
"""

import shutil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import folder_written_whole
from ..png import encoded
from . import files, stereo
from .coco import read_pictures

DEPTH_STEPS = 256.0
"""In a meter."""

_DISPARITY_STEPS = 256.0
"""In a pixel."""

_FOLDERS = ("depth", "flow_occ", "flow_noc", "disp_occ_0", "disp_noc_0", "image_2", "image_3", "calib_cam_to_cam")

_FLOW_STEPS, _NO_FLOW = 64.0, 2.0**15


def write(folder: Path, output: Path, overwrite: bool = False, words: stereo.Words | None = None) -> dict[str, int]:
    """Write a new folder of what each picture's labels have of depth and forward flow, whole or not at all.

    folder : a folder of label files.
    output : a folder that is not there yet, or is empty.
    overwrite : true if `output` may be a folder that was written so.
    words : the words by which stereo pairs are told, see `stereo.pairs`.

    Returns how many pictures have which.

    Raises InputError if there are no label files, one has neither, or can't be read, the folder can't be written, or as
    `stereo.pairs` does.
    """
    pictures, _ = read_pictures(folder)
    counts = {"depth": 0, "flow": 0}

    with folder_written_whole(output, lambda there: overwrite and files.holds(there, (), _FOLDERS)) as temporary:
        for path, document in pictures:
            planes = _planes(files.passes(path, document, ("Depth", "Forward Flow", "Forward Hidden")))
            if not planes:
                raise InputError(f"{path} has neither depth nor forward flow: render it with --labels depth,flow --next")
            for kind, pixels in planes.items():
                _place(temporary, kind, f"{files.name(path)}.png").write_bytes(encoded(pixels))
            counts["depth"] += "depth" in planes
            counts["flow"] += "flow_occ" in planes
        if words:
            counts["pairs"] = 0
            for pair in stereo.pairs(folder, words):
                _write_pair(temporary, pair)
                counts["pairs"] += 1
    return counts


def _place(folder: Path, kind: str, name: str) -> Path:
    """The place of a file in a folder of its kind, which is made where there is none yet."""
    (folder / kind).mkdir(exist_ok=True)
    return folder / kind / name


def _write_pair(folder: Path, pair: stereo.Pair) -> None:
    occluded = disparity_levels(pair.disparities[0])
    _place(folder, "disp_occ_0", f"{pair.name}.png").write_bytes(encoded(occluded))
    visible = np.where(pair.seen_by_both[0], occluded, 0).astype(np.uint16)
    _place(folder, "disp_noc_0", f"{pair.name}.png").write_bytes(encoded(visible))
    lines = []
    for number, k, place, photograph in zip((2, 3), pair.calibrations, (0.0, pair.baseline), pair.photographs, strict=True):
        matrix = [[*row, 0.0 - place * row[0]] for row in k]
        lines.append(f"S_rect_{number:02}: {pair.cameras[0].width} {pair.cameras[0].height}\n")
        lines.append(f"P_rect_{number:02}: {' '.join(repr(value) for row in matrix for value in row)}\n")
        if photograph:
            shutil.copyfile(photograph, _place(folder, f"image_{number}", f"{pair.name}{photograph.suffix}"))
    _place(folder, "calib_cam_to_cam", f"{pair.name}.txt").write_text("".join(lines), encoding="ascii", newline="\n")


def disparity_levels(disparity: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Disparities in steps, to the nearest; 0 where none is known, or what 16 bits can't hold: nothing wraps."""
    levels = np.rint(disparity * _DISPARITY_STEPS)
    with np.errstate(invalid="ignore"):
        return np.where((levels >= 1) & (levels <= 65535), levels, 0).astype(np.uint16)


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
