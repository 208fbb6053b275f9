"""A camera that came from somewhere, or goes there, and what is chosen where a format leaves a choice."""

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NoReturn

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole, ViewPlane
from .distortion import Lens

AXES = {
    "as_is": "As they are: the numbers stay those of the file",
    "y_up": "Y up in the file, Z up here: (x, y, z) there is (x, −z, y) here",
    "y_down": "Y down in the file, as COLMAP's worlds often have it, Z up here: (x, y, z) there is (x, z, −y) here",
}
PIXELS = {
    "corner": "(0, 0) is the picture's corner and the first pixel's center is (0.5, 0.5)",
    "center": "(0, 0) is the center of the first pixel",
}
POSES = {
    "w2c_opencv": "World to camera, x right, y down, z into the view: OpenCV, COLMAP",
    "c2w_opencv": "Camera to world, x right, y down, z into the view: OpenCV, COLMAP",
    "w2c_opengl": "World to camera, x right, y up, z back: OpenGL, Blender",
    "c2w_opengl": "Camera to world, x right, y up, z back: OpenGL, Blender, NeRF",
}
UPS = {
    "cameras": "The mean of the cameras' up is Z here: all are turned by the least angle that makes it so",
    "ground": "The ground of the data set's points is Z = 0 here, with the cameras above it",
}
ANGLES = {"degrees": "Degrees", "radians": "Radians"}
_NAMED = 8


@dataclass(frozen=True)
class Camera:
    """A named, complete camera.

    name : the name in the file, or one made from its number there.
    pinhole : the camera without its lens: it shows the undistorted picture.
    lens : the lens that bends the picture; None where nothing does.
    size_stated : true if the file says how many pixels the picture has, or tells it by the picture itself; else they are those
        of `Options`.
    notes : sentences on what was in the file and did not come along, or how it was taken.
    image : the picture's path, as the file has it.
    picture : the picture itself, encoded, where the file holds it.
    time : the seconds at which it stands so, where the file says when.
    left_out : (name, sentence) of each camera of the same file that is no pinhole.
    world : 3 × 4, from the world of the file to this one, where `Options` had it turned, scaled or moved; None where not.
    """

    name: str
    pinhole: Pinhole
    size_stated: bool = True
    notes: tuple[str, ...] = ()
    image: str | None = None
    picture: bytes | None = field(default=None, repr=False)
    time: float | None = None
    left_out: tuple[tuple[str, str], ...] = field(default=(), repr=False)
    lens: Lens | None = None
    world: tuple[tuple[float, ...], ...] | None = field(default=None, repr=False)

    def noted(self, *notes: str) -> "Camera":
        """This camera with more notes, each of them once."""
        return replace(self, notes=tuple(dict.fromkeys((*self.notes, *notes))))


@dataclass(frozen=True)
class Options:
    """The choices where a format leaves one. Reading what was written with the same options gives the same cameras.

    axes : one of AXES.
    scale : > 0; world units here of one of the file's.
    size : (width, height) in pixels, where a file says none.
    pixel_aspect : width of a pixel over its height, where a file says none.
    view_plane : the intrinsics where a file says none.
    base : the camera whose values stand where a text says only some.
    angle_unit : one of ANGLES, where a text says none.
    pixel : one of PIXELS, in place of what the format has by habit.
    pose : one of POSES, where a name does not say which way a matrix goes.
    without_distortion : true to take a camera without its lens.
    unmirrored : true to take a camera that mirrors its picture without that.
    original_world : true to undo the turn and scale that a file says were applied to its world.
    size_fits : true if the size is that of whatever scene is open, whose shape gives way to that of a text's camera; false if
        it is the picture's own.
    up_from : one of UPS, by what the world is turned upright, once axes and scale are applied; None to leave it so.

    Raises InputError if a value is not one of these.
    """

    axes: str = "as_is"
    scale: float = 1.0
    size: tuple[int, int] | None = None
    pixel_aspect: float = 1.0
    view_plane: ViewPlane | None = None
    base: Pinhole | None = None
    angle_unit: str | None = None
    pixel: str | None = None
    pose: str | None = None
    without_distortion: bool = False
    unmirrored: bool = False
    original_world: bool = False
    size_fits: bool = False
    up_from: str | None = None

    def __post_init__(self) -> None:
        _choice("axes", self.axes, AXES)
        for name, among in (("angle_unit", ANGLES), ("pixel", PIXELS), ("pose", POSES), ("up_from", UPS)):
            if getattr(self, name) is not None:
                _choice(name, getattr(self, name), among)
        for name in ("scale", "pixel_aspect"):
            object.__setattr__(self, name, checks.number(name, getattr(self, name), 1e-12, 1e12))
        for name in ("without_distortion", "unmirrored", "original_world", "size_fits"):
            checks.truth(name, getattr(self, name))
        if self.size is not None:
            width, height = self.size
            object.__setattr__(self, "size", (checks.whole("width", width), checks.whole("height", height)))

    @property
    def remembered(self) -> str:
        """The axes and scale as what is written says them, for whoever reads it again; empty where they are as always."""
        return "" if self.axes == "as_is" and self.scale == 1 else f"virtual_pinhole: axes={self.axes} scale={self.scale!r}"

    def size_or_refuse(self, what: str) -> tuple[int, int]:
        """The size to take where a file says none.

        what : the thing that lacks a size, as a sentence names it.

        Raises InputError if none was given.
        """
        if self.size:
            return self.size
        if self.view_plane:
            return self.view_plane.width, self.view_plane.height
        if self.base:
            return self.base.width, self.base.height
        raise InputError(f"{what} does not say how many pixels its picture has: give the size, as in --size 1920x1080")

    def plane_or_refuse(self, what: str) -> ViewPlane:
        """The intrinsics to take where a file says none. Raises InputError if none were given."""
        if self.view_plane:
            return self.view_plane
        if self.base:
            return self.base.plane
        raise InputError(f"{what} says where the camera is but not how it sees: give --size and --distance (in pixels)")


def choose(cameras: list[Camera], name: str | None = None) -> Camera:
    """The one camera, or the one of that name.

    Raises InputError if there are several and none is named, or none is called so; it has their names.
    """
    names = ", ".join(checks.quoted(camera.name) for camera in cameras[:_NAMED]) + (" …" if len(cameras) > _NAMED else "")
    chosen = [camera for camera in cameras if name is None or camera.name == name]
    if len(chosen) == 1:
        return chosen[0]
    if not chosen:
        for left_out, sentence in (each for camera in cameras[:1] for each in camera.left_out):
            if left_out == name:
                raise InputError(sentence)
        raise InputError(f"there is no camera {checks.quoted(name)}: name one of {names}")
    if name is None:
        raise InputError(f"there are {len(chosen)} cameras and one is wanted: name one of {names}")
    raise InputError(f"{len(chosen)} cameras are called {checks.quoted(name)}: rename all but one")


class NoPinholeError(InputError):
    """A camera is well said, and is no pinhole: a panorama, a lens that nobody knows, skew."""


def not_a_pinhole(what: str, kind: str) -> NoReturn:
    """Refuse what is no pinhole by its name."""
    raise NoPinholeError(f"{what} is {kind}, which is no pinhole camera: only straight perspective can be taken")


class LeftOut:
    """The cameras of a file that are no pinholes, beside which the others are read all the same.

    kind : the error by which a camera is left out. Any InputError in a scene, whose cameras have nothing to do with each other;
    NoPinholeError alone of pictures that were measured together, where what else is wrong with one is wrong with all.
    """

    def __init__(self, kind: type[InputError] = NoPinholeError) -> None:
        self._kind, self._sentences = kind, dict[str, str]()

    @contextlib.contextmanager
    def unless_pinhole(self, name: str) -> Iterator[None]:
        """The block makes one camera.

        name : the name by which it would be chosen.
        """
        try:
            yield
        except self._kind as error:
            self._sentences.setdefault(name, str(error))

    def with_notes(self, cameras: Sequence[Camera]) -> list[Camera]:
        """The cameras, which know and tell those that were left out.

        Raises InputError if all of the file's cameras were left out.
        """
        if not self._sentences:
            return [*cameras]
        if not cameras:
            raise self._kind(next(iter(self._sentences.values())))
        names_by_sentence: dict[str, list[str]] = {}
        for name, sentence in self._sentences.items():
            names_by_sentence.setdefault(sentence, []).append(checks.quoted(name))
        notes = [
            f"Left out: {', '.join(names[:_NAMED])}{' …' if len(names) > _NAMED else ''}, since {sentence}"
            for sentence, names in names_by_sentence.items()
        ]
        left_out = tuple(self._sentences.items())
        return [replace(camera.noted(*notes), left_out=(*camera.left_out, *left_out)) for camera in cameras]


def _choice(name: str, value: object, among: dict[str, str]) -> None:
    if not isinstance(value, str) or value not in among:
        raise InputError(f"{name} is {checks.quoted(value)}: give one of {', '.join(among)}")
