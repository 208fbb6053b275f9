"""The values that say where a camera stands and how far it zooms, and the `Pinhole` that they make. Pure, no Blender.

Blender stores them in `object.virtual_pinhole` (blender/storage.py); panel and handles edit them; blender/camera.py brings the
camera there. Any number may stand in them, as an artist may type any: `pinhole` refuses values that make no camera.

`zoom` is a factor on d of its own, so that a zoom can be keyed and taken off again.

Where `keeps` is FIELD_OF_VIEW the distance grows with the picture: it counts pixels of the one in `counted_in`, and each time
the camera is set it is counted anew in the present one. A distance with curves or a driver of its own stays as they say, and
`counted_in` with it. Rejected: to scale the curves (the artist's, and perhaps shared or linked), and never to count anew (the
panel would show a distance in pixels that are no longer those of the picture).
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import checks, intrinsics
from . import roll as rolls
from .errors import InputError
from .intrinsics import Frame
from .pinhole import Pinhole, Triple, ViewPlane, basis_of_views

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

PIXELS, FIELD_OF_VIEW = "PIXELS", "FIELD_OF_VIEW"
CANONICAL, HOLD = "CANONICAL", "HOLD"

PARTS = EYE, VIEW, DISTANCE = "eye", "view", "distance"
# The parts of the camera that each value decides where it is animated: a moving eye turns the view, since the look-at point
# stands still.
DECIDES = {
    "eye": frozenset({EYE, VIEW}),
    "look_at": frozenset({VIEW}),
    "up": frozenset({VIEW}),
    "held_roll": frozenset({VIEW}),
    "distance": frozenset({DISTANCE}),
    "zoom": frozenset({DISTANCE}),
}
FACTORS = ("zoom",)
"""Numbers on the distance, each of which may be keyed by itself."""


@dataclass(frozen=True)
class CameraValues:
    """The values that an artist or a script gives a camera, in float64 where that is known. Points and up in world space.

    eye, look_at : a followed point is where its target stands.
    distance : pixels of the picture at 100 %, without zoom.
    enabled : true if they place the camera.
    keeps : PIXELS or FIELD_OF_VIEW, what stays when the picture gets another resolution.
    counted_in : the picture whose pixels the distance counts, None where nobody has said.
    set_for : the picture for which the camera was set last. Both without border.
    pole : CANONICAL or HOLD, what the picture does near up.
    hold_within : radians from up.
    held_roll : radians, see roll.py.
    view_when_set : (eye, look_at, up) from which the next edit sets out, None where that is not known.
    precision : the relative rounding of the values, 2⁻⁵³ where all are known in float64, else float32's 2⁻²⁴.
    follows : some of "eye" and "look_at", which are set to follow an object.
    asked : (name, number) of other looks at the values, such as a lens in millimeters or the roll, that count over them.
    """

    eye: Triple
    look_at: Triple
    up: Triple
    distance: float
    zoom: float = 1.0
    enabled: bool = False
    keeps: str = PIXELS
    counted_in: Frame | None = None
    set_for: Frame | None = None
    pole: str = CANONICAL
    hold_within: float = math.radians(10)
    held_roll: float = 0.0
    view_when_set: tuple[Triple, Triple, Triple] | None = None
    precision: float = 2.0**-24
    follows: tuple[str, ...] = ()
    asked: tuple[tuple[str, float], ...] = ()

    def view(self) -> Pinhole:
        """The direction in which the values look, in a picture of one pixel and whatever a held roll is.

        Raises InputError if eye = look-at, up = 0, or a number is not finite.
        """
        return Pinhole(self.eye, self.look_at, self.up, 1.0, 1, 1)

    def pinhole(self, plane: ViewPlane, frame: Frame, sensor_fit: str, mirrored: bool) -> Pinhole:
        """The camera that the values ask for, whatever a held roll is.

        plane : the view plane, whose size and principal point it has.
        frame : the picture that the scene renders.
        sensor_fit : "AUTO", "HORIZONTAL" or "VERTICAL".

        Raises InputError if the values make no camera: eye = look-at, up = 0, distance ≤ 0, zoom ≤ 0, a number that is not
        finite.
        """
        distance = self.distances(frame, sensor_fit)
        size, center = (plane.width, plane.height), plane.principal_point
        return Pinhole(self.eye, self.look_at, self.up, distance, *size, center, mirrored)

    def distances(self, frame: Frame, sensor_fit: str) -> tuple[float, float]:
        """(d_x, d_y) in pixels of the picture of `frame`, its percentage included."""
        distance = self.distance_at_full_size(frame, sensor_fit) * (frame.size[0] / frame.resolution_x)
        return distance, distance * (frame.pixel_aspect_x / frame.pixel_aspect_y)

    def distance_at_full_size(self, frame: Frame, sensor_fit: str) -> float:
        """The effective distance in the picture of `frame` at 100 %: zoom, and what the resolution keeps, included.

        Raises InputError if zoom is no number above 0.
        """
        if checks.number("zoom", self.zoom) <= 0:
            raise InputError(f"zoom is {self.zoom:g}: give a factor above 0")
        return self.zoomed_distance * self.growth(frame, sensor_fit)

    @property
    def zoomed_distance(self) -> float:
        """The distance with its factors, in the pixels that it counts."""
        return self.distance * self.zoom

    def growth(self, frame: Frame, sensor_fit: str) -> float:
        """The factor on the distance in the picture of `frame`: 1 unless the field of view of another picture is kept."""
        if self.keeps != FIELD_OF_VIEW or self.counted_in in (None, without_border(frame)):
            return 1.0
        return intrinsics.growth(sensor_fit, self.counted_in, frame)

    def animated(
        self, eye: Triple, look_at: Triple, up: Triple, distance: float, precision: float, **factors: float
    ) -> "CameraValues":
        """These values with the numbers of another frame; dataclasses.replace takes eight times as long.

        factors : new numbers by name, some of FACTORS.
        """
        values = object.__new__(CameraValues)
        values.__dict__.update(self.__dict__)
        values.__dict__.update(eye=eye, look_at=look_at, up=up, distance=distance, precision=precision, **factors)
        return values

    def stating(
        self, eye: Triple, look_at: Triple, up: Triple, distance: float, frame: Frame, sensor_fit: str
    ) -> "CameraValues":
        """The values that say another view, without a held roll. A zoom that can be kept stays, others become 1.

        distance : the effective one in the picture of `frame` at 100 %, zoom included.
        """
        distance /= self.growth(frame, sensor_fit)
        zoom = self.zoom if _can_divide(self.zoom, distance) else 1.0
        values = replace(
            self, eye=eye, look_at=look_at, up=up, distance=distance / zoom, zoom=zoom, enabled=True, held_roll=0.0
        )
        return values.as_set()

    def as_set(self) -> "CameraValues":
        """The values from which the next edit sets out, once the camera is where they say."""
        return replace(self, view_when_set=(self.eye, self.look_at, self.up))

    def counted_anew(self, frame: Frame, sensor_fit: str) -> "CameraValues":
        """This camera with its distance in the pixels of the picture of `frame`."""
        return replace(self, distance=self.growth(frame, sensor_fit) * self.distance, counted_in=without_border(frame))

    def seeing(self, distance: float, frame: Frame, sensor_fit: str) -> "CameraValues":
        """This view by another lens; the zoom stays. distance : the effective one in the picture of `frame` at 100 %."""
        return replace(self, distance=self.stored_distance(distance, frame, sensor_fit))

    def stored_distance(self, distance: float, frame: Frame, sensor_fit: str) -> float:
        """The value that makes an effective distance in the picture of `frame` at 100 %."""
        return distance / self.growth(frame, sensor_fit) / self.zoom

    def rolled(self, angle: float, up_axis: Triple, held: float) -> "CameraValues":
        """This view with the roll that `roll_from` says: another up, or where it is held another held roll.

        Raises InputError as `view` does.
        """
        if self.pole == HOLD:
            return replace(self, held_roll=self.held_roll + angle - self.roll_from(up_axis, held))
        return replace(self, up=rolls.rolled(rolls.turned(self.view(), held), up_axis, angle).up)

    def moved_to(
        self, pinhole: Pinhole, moved: Collection[str], bound: Collection[tuple[str, int]], up_axis: Triple, rounding: float
    ) -> "CameraValues":
        """The view of a camera that was moved, with the look-at point as far away as it was.

        pinhole : the camera as it stands.
        moved : some of "eye" and "view", which have changed by more than a rounding; what has not keeps its digits.
        bound : (name, index) of the numbers that something else decides; they stay.
        up_axis : the up to choose where that of the values does not give the picture, up to `rounding`, but it does; else up
            becomes v.
        """
        values = self.with_unbound(replace(self, eye=pinhole.eye), bound) if "eye" in moved else self
        if "view" in moved:
            _, v, w = pinhole.basis()
            look_at = values.eye - math.dist(self.eye, self.look_at) * w
            up = self.up
            if self.pole != HOLD:
                choices = (up for up in (self.up, up_axis) if np.abs(replace(pinhole, up=up).basis()[1] - v).max() <= rounding)
                up = next(choices, tuple(v.tolist()))
            values = replace(values, look_at=tuple(look_at.tolist()), up=up)
        elif values.eye != self.eye:
            values = replace(values, look_at=tuple((self.look_at + np.subtract(values.eye, self.eye)).tolist()))
        return self.with_unbound(values, bound)

    def with_unbound(self, other: "CameraValues", bound: Collection[tuple[str, int]]) -> "CameraValues":
        """Other values, but their own numbers (name, index) that something else decides."""
        if not bound:
            return other
        kept: dict[str, Any] = {}
        for name in {name for name, _ in bound}:
            own_value, other_value = getattr(self, name), getattr(other, name)
            if isinstance(own_value, tuple):
                kept[name] = tuple(
                    a if (name, i) in bound else b for i, (a, b) in enumerate(zip(own_value, other_value, strict=True))
                )
            else:
                kept[name] = own_value
        return replace(other, **kept)

    def roll_from(self, up: Triple, held: float) -> float:
        """The roll of the picture from what another up gives: radians, from u towards v. held : the roll that is held.

        Raises InputError as `view` does.
        """
        return rolls.angle_from(up, rolls.turned(self.view(), held))


def moved_poses(
    poses: Array, is_moved: Flags, is_turned: Flags, eyes: Array, axes: Array, up_axis: Triple, rounding: float
) -> Array:
    """The poses of n cameras that were moved, each as `CameraValues.moved_to` has it where nothing is bound and no roll held.

    poses : (n, 3, 3), eye, look-at and up of each.
    is_moved, is_turned : (n,) each, true for cameras whose eye, and whose view, has changed.
    eyes : (n, 3).
    axes : (n, 3, 3), u, v and w as columns.
    up_axis, rounding : see `CameraValues.moved_to`.
    """
    after, reach = poses.copy(), [math.dist(eye, look_at) for eye, look_at, _ in poses.tolist()]
    after[is_moved, 0] = eyes[is_moved]
    after[:, 1] += after[:, 0] - poses[:, 0]
    after[is_turned, 1] = (after[:, 0] - np.array(reach)[:, None] * axes[:, :, 2])[is_turned]
    turned = np.flatnonzero(is_turned & ~_are_level(after[:, 2], axes, rounding))
    for up in (None, up_axis):
        if len(turned):
            after[turned, 2] = after[turned, 2] if up is None else up
            (_, v, _), valid = basis_of_views(*after[turned].swapaxes(0, 1))
            turned = turned[valid & (np.abs(v - axes[turned, :, 1]).max(axis=-1) > rounding)]
    after[turned, 2] = axes[turned, :, 1]
    return after


def _are_level(ups: Array, axes: Array, rounding: float) -> Flags:
    """(n,): true where up gives the picture beyond doubt, so that `basis` need not be asked, which takes twenty times as long.

    ups : (n, 3).
    axes, rounding : see `moved_poses`.
    """
    across, along = np.einsum("nij,ni->jn", axes[:, :, :2], ups)
    return (np.abs(across) <= 0.25 * rounding * along) & (along > 2.0**-10 * np.abs(ups).max(axis=-1))


def without_border(frame: Frame) -> Frame:
    """The parts of a frame that values tell: resolution, percentage and pixel aspect."""
    return frame if frame.border is None and not frame.crop else replace(frame, border=None, crop=False)


def _can_divide(zoom: float, distance: float) -> bool:
    """True if a zoom is a factor above 0 that leaves of the distance a number which Blender stores with all its digits."""
    float32 = np.finfo(np.float32)
    return 0 < zoom < math.inf and float(float32.tiny) <= distance / zoom <= float(float32.max)
