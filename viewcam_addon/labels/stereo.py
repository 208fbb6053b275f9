"""Stereo pairs of labeled pictures, and Middlebury's data set of them: a folder for each pair, called as its left picture.

    x₀ − x₁ = f b / Z − doffs        doffs = c_x₁ − c_x₀

A disparity is how much farther left the right picture shows the point that a pixel's center shows: positive for all points
where the principal points are alike, and exact, since it is projected and not searched. A pair is rectified: all points lie in
the same row of both pictures. A pixel is seen by both where the other picture's nearest pixel has the same disparity, to a
pixel, which is the cross-check of Middlebury's authors.

    NAME/calib.txt im0.png im1.png disp0.pfm disp1.pfm mask0nocc.png mask1nocc.png

Of the masks 255 is what both pictures see, 128 what one sees, 0 what is unknown, where disp has inf. The baseline counts in
millimeters where a scene unit is a meter.

Source: Scharstein et al., High-Resolution Stereo Datasets with Subpixel-Accurate Ground Truth, GCPR 2014, and
vision.middlebury.edu/stereo/data/scenes2014. Rejected: to find pairs by their poses (two pictures of a camera on a straight
path are rectified, too).
"""

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cameras import axes
from ..errors import InputError
from ..files import folder_written_whole
from ..image import BACKGROUND_DEPTH
from ..pinhole import Pinhole
from ..png import encoded
from . import files, surface_points
from .coco import read_pictures

Words = tuple[str, str]

WORDS: Words = ("left", "right")
"""The parts of names that tell a pair's left picture from its right one."""

_ALIKE = 1.0
"""Pixels by which the two disparities of one point may differ."""

_LEVEL = 0.01
"""Pixels by which a point may lie higher in one picture: what OpenCV's corners are accurate to is ten times that."""


@dataclass(frozen=True)
class Pair:
    """Two pictures of one moment, the left one first in each field.

    paths : the paths of the label files.
    photographs : the paths of the PNG or JPEG of each, if there is one.
    cameras : the cameras, which have the same axes.
    baseline : the distance between the eyes, scene units, > 0.
    disparities : (height, width) each, float64, pixels, rows from the **top**; nan where nothing is.
    seen_by_both : (height, width) each, true for pixels whose point the other camera sees, too.
    """

    paths: tuple[Path, Path]
    photographs: tuple[Path | None, Path | None]
    cameras: tuple[Pinhole, Pinhole]
    baseline: float
    disparities: tuple[NDArray[np.float64], NDArray[np.float64]]
    seen_by_both: tuple[NDArray[np.bool_], NDArray[np.bool_]]

    @property
    def name(self) -> str:
        """The left picture's name."""
        return files.name(self.paths[0])

    @property
    def calibrations(self) -> list[list[list[float]]]:
        """K of each camera, counting from the first pixel's center, as the programs that calibrate such cameras do."""
        of_corner = (axes.intrinsics(camera) for camera in self.cameras)
        return [[[f_x, zero, c_x - 0.5], [zero, f_y, c_y - 0.5], last] for (f_x, zero, c_x), (_, f_y, c_y), last in of_corner]


def pairs(folder: Path, words: Words = WORDS) -> Iterator[Pair]:
    """The stereo pairs of a folder of label files that have depth, in the order of their names.

    words : two words: a left picture's name has the first one where the right picture's has the second; case does not count.

    Raises InputError if there is no pair, a picture has no partner, or a pair is not rectified, is mirrored, or goes through a
    lens.
    """
    pictures, _ = read_pictures(folder)
    left, right = (word.casefold() for word in words)
    by_name = {files.name(path).casefold(): (path, document) for path, document in pictures}
    lefts = {name: name.replace(left, right) for name in by_name if left in name}
    if not lefts:
        raise InputError(f"no picture of {folder} has {words[0]!r} in its name: name the two of a pair by --pair LEFT RIGHT")
    for name, partner in lefts.items():
        if partner not in by_name or partner == name:
            raise InputError(f"{by_name[name][0]} has no partner with {words[1]!r} in its name: render that, or move this away")
        yield _pair(by_name[name], by_name[partner])


def _pair(*pictures: tuple[Path, dict[str, Any]]) -> Pair:
    paths = tuple(path for path, _ in pictures)
    names = " and ".join(path.name for path in paths)
    cameras, points = [], []
    for path, document in pictures:
        with files.understood(path):
            camera, passes = files.camera(path, document), files.passes(path, document, ("Depth",))
        if not passes:
            raise InputError(f"{path} has no depth: render it with --labels depth")
        if camera.lens or camera.pinhole.mirrored:
            raise InputError(f"{path} is {'mirrored' if camera.pinhole.mirrored else 'seen through a lens'}: no stereo pair is")
        cameras.append(camera.pinhole)
        depth = passes["Depth"][..., 0].astype(np.float64)
        depth[depth >= BACKGROUND_DEPTH] = np.nan
        rows, columns = np.indices(depth.shape)
        points.append(surface_points.positions(camera, rows, columns, depth))
    left, right = cameras
    if (left.distance, left.width, left.height) != (right.distance, right.width, right.height):
        raise InputError(f"{names} have different distances or sizes: give both cameras the same")
    across = np.arange(left.width) + 0.5
    upward = left.height - (np.arange(left.height) + 0.5)[:, None]
    disparities, offsets = [], []
    for other, seen, sign in ((right, points[0], 1), (left, points[1], -1)):
        known = np.isfinite(seen).all(axis=-1)
        column, row, _ = other.project(np.where(known[..., None], seen, np.array(other.eye)))
        disparities.append(sign * (across - column))
        offsets.append(np.abs(row - upward)[known])
    off = np.concatenate([*offsets, [0.0]]).max()
    baseline = float((np.array(right.eye) - left.eye) @ left.basis()[0])
    if not off <= _LEVEL or baseline <= 0:
        why = f"show points up to {off:.2g} rows apart" if baseline > 0 else "have the left camera on the right"
        raise InputError(f"{names} {why}: turn both cameras alike, and move the right one along its x alone")
    d0, d1 = disparities
    both = _agree(d0, d1, -1), _agree(d1, d0, 1)
    photographs = tuple(files.photograph(path, document) for path, document in pictures)
    return Pair((paths[0], paths[1]), (photographs[0], photographs[1]), (left, right), baseline, (d0, d1), both)


def _agree(disparity: NDArray[np.float64], other: NDArray[np.float64], sign: int) -> NDArray[np.bool_]:
    """True where the other picture's pixel nearest to a point has its disparity.

    sign : the sign of the step to that picture.
    """
    height, width = disparity.shape
    rows, columns = np.indices((height, width))
    with np.errstate(invalid="ignore"):
        there = np.rint(columns + sign * disparity)
        inside = (there >= 0) & (there < width)
        nearest = other[rows, np.where(inside, there, 0).astype(int)]
        return inside & (np.abs(nearest - disparity) <= _ALIKE)


def write(folder: Path, output: Path, overwrite: bool = False, words: Words = WORDS) -> dict[str, int]:
    """Write a new folder with Middlebury's folder of each pair, whole or not at all.

    folder : a folder of label files with depth.
    output : a folder that is not there yet, or is empty.
    overwrite : true if `output` may be a folder that was written so.
    words : see `pairs`.

    Returns how many pairs there are.

    Raises InputError as `pairs` does, or if the folder can't be written.
    """
    count = 0

    def may_replace(there: Path) -> bool:
        return overwrite and all((each / "calib.txt").is_file() for each in there.iterdir())

    with folder_written_whole(output, may_replace) as temporary:
        for pair in pairs(folder, words):
            count += 1
            own = temporary / pair.name
            own.mkdir()
            (own / "calib.txt").write_text(_calibration(pair), encoding="ascii", newline="\n")
            for i in (0, 1):
                disparity = pair.disparities[i]
                known = np.isfinite(disparity)
                (own / f"disp{i}.pfm").write_bytes(_pfm(np.where(known, disparity, np.inf)))
                mask = np.where(known, np.where(pair.seen_by_both[i], 255, 128), 0).astype(np.uint8)
                (own / f"mask{i}nocc.png").write_bytes(encoded(mask))
                if photograph := pair.photographs[i]:
                    shutil.copyfile(photograph, own / f"im{i}{photograph.suffix}")
    return {"pairs": count}


def _calibration(pair: Pair) -> str:
    k0, k1 = pair.calibrations
    known = pair.disparities[0][np.isfinite(pair.disparities[0])]
    least, most = (int(np.floor(known.min())), int(np.ceil(known.max()))) if known.size else (0, 0)
    values = {
        **{f"cam{i}": f"[{'; '.join(' '.join(map(repr, row)) for row in k)}]" for i, k in enumerate((k0, k1))},
        "doffs": repr(k1[0][2] - k0[0][2]),
        "baseline": repr(pair.baseline * 1000),
        "width": pair.cameras[0].width,
        "height": pair.cameras[0].height,
        "ndisp": most + 1,
        "isint": 0,
        "vmin": least,
        "vmax": most,
        "dyavg": 0,
        "dymax": 0,
    }
    return "".join(f"{key}={value}\n" for key, value in values.items())


def _pfm(values: NDArray[np.float64]) -> bytes:
    """A portable float map, which has its rows from the bottom. values : (height, width), rows from the top."""
    height, width = values.shape
    return f"Pf\n{width} {height}\n-1\n".encode() + values[::-1].astype("<f4").tobytes()
