"""The lens of a calibrated camera put on what a pinhole shows: which pinhole covers its picture, and the picture made of that.

The way back of undistortion.py. The pinhole's picture is as sharp as the calibrated camera's wherever that is: its focal length
is no shorter, and longer where the lens magnifies. A pixel of the result is interpolated between the four nearest of the
pinhole's, and where it shows more than one of them, it is the mean of several places: so edges stay where they are, which a
single place moves by up to 0.09 pixels, and what is fine at the border of a fisheye's picture does not alias.

Rejected: a renderer's own lenses (Cycles' fisheyes are not OpenCV's, and other engines have none), and the compositor's, whose
distortion is interpolated on a grid.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole, ViewPlane
from .camera import Camera, choose
from .distortion import Lens
from .undistortion import looked_up, places_back

_LATTICE = 512  # places along each side, at most, at which the lens is looked at: a polynomial of few terms has no finer detail
_LARGEST = 2**28  # pixels: 4 GiB of Blender's floats
_STILL = 1e-3  # a step of so much more than a pixel is one
_BAND = 2**19  # pixels that are computed at a time


@dataclass(frozen=True)
class Calibration:
    """A calibrated camera without its pose.

    plane : the view plane of its picture.
    lens : the lens that bends the picture.
    """

    plane: ViewPlane
    lens: Lens

    def to_json(self) -> dict[str, Any]:
        """The calibration, as JSON can hold it."""
        return {"plane": asdict(self.plane), "lens": self.lens.to_json()}

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """The calibration that `to_json` gave. Raises InputError for what is none."""
        try:
            return cls(ViewPlane(**document["plane"]), Lens.from_json(document["lens"]))
        except (LookupError, TypeError) as error:
            raise InputError("the calibration has not all that it needs: write the file again") from error

    def at(self, pinhole: Pinhole) -> Pinhole:
        """The pinhole of the calibrated camera's own plane in another's place."""
        return replace(pinhole, **vars(self.plane))

    @cached_property
    def cover(self) -> ViewPlane:
        """The view plane of a pinhole's picture with square pixels that has all that the calibrated camera shows.

        Raises InputError if the model folds within the picture or shows what no pinhole does, or if the picture were too large.
        """
        plane = self.plane
        top = plane.height - plane.principal_point[1]
        columns, down = (np.linspace(0, size, min(size, _LATTICE) + 1) for size in (plane.width, plane.height))
        pixels = np.stack(np.meshgrid(columns, down), axis=-1)
        seen = self.lens.undistort((pixels - (plane.principal_point[0], top)) / plane.distance)
        if (bad := ~np.isfinite(seen).all(axis=-1) | self.lens.folds(seen)).any():
            column, row = pixels[bad][np.argmin(np.hypot(*(pixels[bad] - (plane.principal_point[0], top)).T))]
            raise InputError(
                f"from ({column:.0f}, {row:.0f}) on its lens shows nothing that a pinhole could, since the model folds there "
                "or looks 90° and more aside: crop the picture, or calibrate with fewer terms"
            )
        steps = (np.linalg.norm(np.diff(seen, axis=axis), axis=-1) / each[1] for axis, each in enumerate((down, columns)))
        distance = max(*plane.distance, *(1 / float(each.min()) for each in steps))
        # Whole pixels aside of the calibrated camera's own, so that what no lens moves is not interpolated; and one around.
        center = np.array([plane.principal_point[0], top])
        before = np.ceil(-(seen.reshape(-1, 2).min(axis=0) * distance + center)).astype(int) + 1
        width, height = (np.ceil(seen.reshape(-1, 2).max(axis=0) * distance + center).astype(int) + before + 1).tolist()
        if width * height > _LARGEST:
            raise InputError(
                f"its lens sees so far aside that a pinhole's picture of it has {width} × {height} pixels: crop the picture, "
                "or scale it down"
            )
        return ViewPlane((distance, distance), (center[0] + before[0], height - center[1] - before[1]), width, height)

    def distorted(self, picture: np.ndarray, cut: ViewPlane, nearest: bool = False) -> np.ndarray:
        """The picture as the calibrated camera shows it, of the same type; black where it has nothing.

        picture : a pinhole's picture, (height, width, channels), rows from the top.
        cut : that picture's view plane.
        nearest : true to take the nearest pixel's number, as for masks and depths.
        """
        plane = self.plane
        at = places_back(self.lens, plane, cut)
        result = np.zeros((plane.height, plane.width, picture.shape[2]), picture.dtype)
        if nearest:
            return looked_up(picture, at, nearest=True)
        along = [np.gradient(at, axis=axis) if at.shape[axis] > 1 else np.zeros_like(at) for axis in (1, 0)]
        count = max(1, math.ceil(float(np.nanmax(np.linalg.norm(along, axis=-1))) - _STILL))
        offsets = (np.arange(count) + 0.5) / count - 0.5
        rows_at_once = max(1, _BAND // plane.width)
        for first in range(0, plane.height, rows_at_once):
            rows = slice(first, first + rows_at_once)
            total = np.zeros(result[rows].shape)
            for x in offsets:
                for y in offsets:
                    total += looked_up(picture.astype(np.float64), at[rows] + x * along[0][rows] + y * along[1][rows])
            mean = total / count**2
            result[rows] = np.rint(mean) if picture.dtype.kind == "u" else mean
        return result


@dataclass(frozen=True)
class Rig:
    """The calibrated cameras of a file.

    source : the file, as a sentence names it.
    by_name : the cameras that have a lens.
    """

    source: str
    by_name: Mapping[str, Calibration]

    @cached_property
    def _firsts(self) -> dict[Calibration, str]:
        """The first camera of each calibration."""
        return {calibration: name for name, calibration in [*self.by_name.items()][::-1]}

    def of(self, *names: str | None) -> Calibration:
        """The calibration of the camera that has the first of the names that one has, or else that all cameras share.

        Raises InputError if no camera is called so and they share none, or if no pinhole's picture covers it.
        """
        called = next((name for name in names if name in self.by_name), None)
        if called is None and len(self._firsts) > 1:
            *_, second, first = self._firsts.values()
            raise InputError(
                f"the cameras of {self.source} have {len(self._firsts)} lenses or sizes, and none is called "
                f"{' or '.join(checks.quoted(name) for name in names if name) or 'as this one'}: name one, as in {first} or "
                f"{second}, or call cameras as theirs"
            )
        called = called or next(iter(self.by_name))
        try:
            _ = self.by_name[called].cover  # refuses here, before anything is rendered
        except InputError as error:
            raise InputError(f"the camera {called} of {self.source} can't be rendered: {error}") from None
        return self.by_name[called]


def of_cameras(read: Sequence[Camera], source: str, name: str | None = None) -> Rig:
    """The calibrations of one file's cameras.

    source : the file, as a sentence names it.
    name : the name of the only one wanted.

    Raises InputError if no camera has a lens, or the named one has none.
    """
    chosen = [*read] if name is None else [choose([*read], name)]
    bent = {camera.name: Calibration(camera.pinhole.plane, camera.lens) for camera in chosen if camera.lens is not None}
    if not bent and name is not None:
        raise InputError(f"the camera {name} of {source} has no lens that distorts: name another")
    if not bent:
        raise InputError(f"no camera of {source} has a lens that distorts: give a file whose cameras have")
    return Rig(source, bent)
