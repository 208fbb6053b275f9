"""Other programs' cameras (cameras/) as Blender's, in a collection of their own: one object each, or one that flies.

Several cameras, and one that flies, are children of an empty at the world's origin, by which all of their world is turned and
scaled by hand.

All of it or nothing: whatever has been made and set is taken back if anything fails. What the artist has set stays, unless
asked: the scene's camera if it has one, and its size, into which each camera is fitted (picture.py).

The photograph of a camera with a lens is shown without it: as an undistorted copy in the .blend, no larger than a screen.
Rejected: a movie clip with Blender's own tracking camera, which undistorts to 0.03 pixels, but has no fisheyes, and takes the
number in a file's name for a frame: at another frame of the scene it shows another camera's photograph.

The pictures of a flight are shown frame by frame, if their numbers go with its frames; none is copied. Those of one lens are
such a movie clip, if Blender's tracking camera has the lens.

A flight is plain keyframes of location, rotation and lens, as Bake writes them. Rejected: curves of the four values, which hold
eye and look-at in float32 each, and the direction between them in fewer digits.
"""

import contextlib
import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ... import intrinsics, rotation
from ...cameras import Camera, undistortion
from ...cameras.distortion import Lens
from ...cameras.naming import picture_of
from ...errors import InputError
from ...pinhole import ViewPlane
from .. import camera as cameras
from .. import datablocks, picture, pose, versions
from ..temporary_settings import Overrides

_WIDEST = 2048  # pixels of an undistorted copy along its longer side, which takes two seconds
_NUMBERED = re.compile(r"(?P<before>.*?)(?P<number>[0-9]{1,9})(?P<after>[^0-9]*)", re.DOTALL)
"""The path of a picture of a sequence: the last number in it counts, as for Blender."""
_OF_DATA = ("lens", "shift_x", "shift_y", "sensor_width", "sensor_height")


@dataclass(frozen=True)
class ImportedCameras:
    """The result of `import_cameras`.

    objects : the new cameras.
    pictures : the number of cameras that have their picture as background.
    notes : sentences for a reader, each once.
    """

    objects: tuple[bpy.types.Object, ...]
    pictures: int
    notes: tuple[str, ...]


def import_cameras(
    cameras: Sequence[Camera],
    name: str,
    scene: bpy.types.Scene,
    folder: Path | None = None,
    set_size: bool = False,
    as_flight: bool = False,
) -> ImportedCameras:
    """Add cameras to a scene.

    name : the collection's name.
    folder : the file's folder, whose pictures become backgrounds; None for none.
    set_size : true to give the scene the size of the first one.
    as_flight : true to make one camera with a keyframe for each, at its time, or one a frame where the file says no times.

    Raises InputError if a camera, or the picture's size, is beyond Blender's numbers. Nothing has changed then.
    """
    with contextlib.ExitStack() as undo:
        imported = _CameraImport(name, scene, Overrides(undo)).run(cameras, folder, set_size, as_flight)
        undo.pop_all()
    return imported


class _CameraImport:
    """An import of cameras while it runs."""

    def __init__(self, name: str, scene: bpy.types.Scene, overrides: Overrides) -> None:
        self._name, self._scene, self._overrides = name, scene, overrides
        self._notes: dict[str, None] = {}
        self._collection = bpy.data.collections.new(name)
        overrides.afterwards(bpy.data.batch_remove, [self._collection])
        scene.collection.children.link(self._collection)
        self._world: bpy.types.Object | None = None

    def run(self, cameras: Sequence[Camera], folder: Path | None, set_size: bool, as_flight: bool) -> ImportedCameras:
        if set_size:
            picture.set_size(self._overrides, self._scene, cameras[0].pinhole)
        self._note(note for camera in cameras for note in camera.notes)
        if len(cameras) > 1:
            self._world = self._linked(f"{self._name} World", None)
        pictures = 0
        if as_flight:
            objects = (self._new(self._name),)
            cameras, at = self._timed(cameras)
            self._fly(objects[0], cameras, at)
            pictures = 0 if folder is None else self._show_sequence(objects[0], cameras, at, folder)
        else:
            objects = tuple(self._new(camera.name) for camera in cameras)
        if self._scene.camera is None:
            self._overrides.set(self._scene, "camera", objects[0])
        if not as_flight:
            bpy.context.view_layer.update()
            for block, camera in zip(objects, cameras, strict=True):
                self._place(block, camera)
            if folder is not None:
                pictures = sum([self._show(block, camera, folder) for block, camera in zip(objects, cameras, strict=True)])
                named = sum(camera.image is not None or camera.picture is not None for camera in cameras)
                self._note_missing(named - pictures, named)
        return ImportedCameras(objects, pictures, tuple(self._notes))

    def _note(self, notes: Iterable[str]) -> None:
        self._notes |= dict.fromkeys(notes)

    def _note_missing(self, missing: int, named: int) -> None:
        if missing:
            self._note([f"{missing} of {named} pictures were not found beside the file, nor in images/"])

    def _new(self, name: str) -> bpy.types.Object:
        data = bpy.data.cameras.new(name)
        self._overrides.afterwards(bpy.data.batch_remove, [data])
        block = self._linked(name, data)
        block.parent = self._world
        return block

    def _linked(self, name: str, data: bpy.types.Camera | None) -> bpy.types.Object:
        block = bpy.data.objects.new(name, data)
        self._overrides.afterwards(bpy.data.batch_remove, [block])
        self._collection.objects.link(block)
        return block

    def _place(self, block: bpy.types.Object, camera: Camera) -> None:
        pinhole, notes = picture.fitted(camera.pinhole, datablocks.frame_of(self._scene))
        try:
            findings = cameras.apply(block, pinhole, self._scene)
        except InputError as error:
            raise InputError(f"camera {camera.name!r}: {error}") from error
        self._note([*notes, *(f"{camera.name}: {finding}" for finding in findings)])

    # --- A flight

    def _fly(self, block: bpy.types.Object, cameras: Sequence[Camera], at: Sequence[float]) -> None:
        scene, frame = self._scene, datablocks.frame_of(self._scene)
        if len({camera.pinhole.mirrored for camera in cameras}) > 1:
            raise InputError(
                "some of the cameras are mirrored and some are not, which no flight can be: import them one by one"
            )
        block.rotation_mode = "QUATERNION"
        sensor = datablocks.own_sensor(block.data)
        keys: dict[str, list[tuple[float, ...]]] = {path: [] for path in ("location", "rotation_quaternion", *_OF_DATA)}
        for camera in cameras:
            try:
                fitted, notes = picture.fitted(camera.pinhole, frame)
                data = intrinsics.camera_data(fitted.plane, frame, *sensor, block.data.sensor_fit)
                location, turn, scale = pose.channels_of(block).bringing_to(fitted, rotation.IDENTITY)
                intrinsics.check_storable(camera.name, distance=(data.lens, data.sensor_width), eye=location)
            except InputError as error:
                raise InputError(f"camera {camera.name!r}: {error}") from error
            self._note(notes)
            block.location, block.scale = location, scale
            pose.set_rotation(block, turn, keys["rotation_quaternion"][-1] if keys["rotation_quaternion"] else None)
            for path in ("location", "rotation_quaternion"):
                keys[path].append(tuple(getattr(block, path)))
            stored: dict[str, Any] = intrinsics.lens_and_sensor(data, sensor)
            for path in _OF_DATA:
                keys[path].append((stored[path] if path in stored else getattr(data, path),))
        for path, numbers in keys.items():
            owner, values = (block.data if path in _OF_DATA else block), np.array(numbers)
            if path in _OF_DATA and (values == values[0]).all():
                setattr(owner, path, values[0, 0])
            else:
                versions.linear_keyframes(owner, path, at, values)
        for owner in (block, block.data):
            if owner.animation_data and owner.animation_data.action:
                self._overrides.afterwards(bpy.data.batch_remove, [owner.animation_data.action])
        if at[-1] > scene.frame_end:
            self._note([f"The flight ends at frame {at[-1]:.6g} and the scene at {scene.frame_end}: set its End"])

    def _timed(self, cameras: Sequence[Camera]) -> tuple[list[Camera], list[float]]:
        """The cameras in order of time, with the frame of each; the first one is at the scene's start."""
        start = self._scene.frame_start
        if any(camera.time is None for camera in cameras):
            return [*cameras], [start + i for i in range(len(cameras))]
        cameras = sorted(cameras, key=lambda camera: camera.time or 0.0)
        twice = next((camera for before, camera in itertools.pairwise(cameras) if camera.time == before.time), None)
        if twice is not None:
            raise InputError(f"two cameras have the time {twice.time!r}, {twice.name!r} one of them: import a camera each")
        render = self._scene.render
        times = [camera.time or 0.0 for camera in cameras]
        return cameras, [start + (time - times[0]) * render.fps / render.fps_base for time in times]

    # --- Pictures

    def _show(self, block: bpy.types.Object, camera: Camera, folder: Path) -> bool:
        """Give the camera its picture as background, if there is one."""
        image = self._packed(camera) if camera.picture is not None else self._loaded(camera, folder)
        if image is not None and camera.lens is not None:
            image = self._undistorted(camera, image)
        if image is None:
            return False
        self._put_behind(block, camera).image = image
        return True

    def _show_sequence(self, block: bpy.types.Object, cameras: Sequence[Camera], at: Sequence[float], folder: Path) -> int:
        """Give a camera that flies all pictures as one background; returns how many these are."""
        named = [camera for camera in cameras if camera.image is not None]
        paths = [path for camera in named if (path := picture_of(camera, folder)) is not None]
        self._note_missing(len(named) - len(paths), len(named))
        if len(paths) < len(cameras):
            return 0
        numbered = [match for path in paths if (match := _NUMBERED.fullmatch(str(path)))]
        alike = {(match["before"], len(match["number"]), match["after"]) for match in numbered}
        numbers = [int(match["number"]) for match in numbered]
        frames = [round(frame, 3) for frame in at]  # times, which are rounded
        ahead = {number - frame for number, frame in zip(numbers, frames, strict=False)}
        if len(numbered) < len(paths) or len(alike) > 1 or len(ahead) > 1 or frames[0] % 1:
            self._note(
                ["The numbers of the pictures do not go with the frames, so that they are not shown: import a camera each"]
            )
            return 0
        if any(camera.lens is not None for camera in named):
            return len(paths) if self._show_clip(block, cameras, int(frames[0]), paths[0]) else 0
        try:
            image = bpy.data.images.load(str(paths[0]))
        except RuntimeError:  # no picture by its content
            return 0
        self._overrides.afterwards(bpy.data.batch_remove, [image])
        image.source = "SEQUENCE"
        background = self._put_behind(block, cameras[0])
        background.image, user = image, background.image_user
        user.frame_start, user.frame_offset, user.frame_duration = int(frames[0]), numbers[0] - 1, numbers[-1] - numbers[0] + 1
        return len(paths)

    def _show_clip(self, block: bpy.types.Object, cameras: Sequence[Camera], start: int, path: Path) -> bool:
        """Put the sequence behind a camera that flies, undistorted by Blender, where its lens is one that Blender has."""
        lens, plane = cameras[0].lens, cameras[0].pinhole.plane
        values = None if lens is None else _of_tracking(lens, plane)
        if values is None or any((camera.lens, camera.pinhole.plane) != (lens, plane) for camera in cameras):
            self._note(
                [
                    "A flight shows pictures with a lens if it is one lens, k1 … k4, p1 and p2, at one focal length: "
                    "import what viewcam camera --undistort writes of them"
                ]
            )
            return False
        try:
            clip = bpy.data.movieclips.load(str(path))
        except RuntimeError:  # no picture by its content
            return False
        if tuple(clip.size) != (plane.width, plane.height):
            self._note([_of_another_size(cameras[0].name, clip.size, plane)])
            bpy.data.movieclips.remove(clip)
            return False
        self._overrides.afterwards(bpy.data.batch_remove, [clip])
        clip.frame_start = start
        for name, value in values.items():
            setattr(clip.tracking.camera, name, value)
        background = self._put_behind(block, cameras[0])
        background.source, background.clip, background.clip_user.use_render_undistorted = "MOVIE_CLIP", clip, True
        return True

    def _put_behind(self, block: bpy.types.Object, camera: Camera) -> bpy.types.CameraBackgroundImage:
        background = block.data.background_images.new()
        # As wide as the view, as the camera is (picture.py); what is higher is cut off in the middle.
        width, height = datablocks.frame_of(self._scene).size
        aspect = camera.pinhole.distance[1] / camera.pinhole.distance[0]
        pixel = self._scene.render.pixel_aspect_x / self._scene.render.pixel_aspect_y
        is_higher = camera.pinhole.height / aspect * width * pixel > height * camera.pinhole.width
        background.frame_method = "CROP" if is_higher else "FIT"
        block.data.show_background_images = True
        return background

    def _undistorted(self, camera: Camera, photograph: bpy.types.Image) -> bpy.types.Image | None:
        """A copy of the photograph as the pinhole sees it; None where it is of another size than its camera."""
        plane, lens = camera.pinhole.plane, camera.lens
        assert lens is not None
        if tuple(photograph.size) != (plane.width, plane.height):
            self._note([_of_another_size(camera.name, photograph.size, plane)])
            return None
        pixels = np.empty((plane.height, plane.width, 4), np.float32)
        photograph.pixels.foreach_get(pixels.ravel())
        seen = undistortion.of_screen(pixels[::-1], lens, plane, _WIDEST)
        copy = bpy.data.images.new(
            f"{camera.name} undistorted", seen.shape[1], seen.shape[0], alpha=True, float_buffer=photograph.is_float
        )
        self._overrides.afterwards(bpy.data.batch_remove, [copy])
        copy.colorspace_settings.name = photograph.colorspace_settings.name
        copy.pixels.foreach_set(np.ascontiguousarray(seen[::-1]).ravel())
        copy.pack()
        return copy

    def _packed(self, camera: Camera) -> bpy.types.Image:
        image = bpy.data.images.new(camera.name, camera.pinhole.width, camera.pinhole.height)
        self._overrides.afterwards(bpy.data.batch_remove, [image])
        assert camera.picture is not None
        image.pack(data=camera.picture, data_len=len(camera.picture))
        image.source = "FILE"
        return image

    def _loaded(self, camera: Camera, folder: Path) -> bpy.types.Image | None:
        if camera.image is None or (path := picture_of(camera, folder)) is None:
            return None
        known = set(bpy.data.images)
        try:
            image = bpy.data.images.load(str(path), check_existing=True)
        except RuntimeError:  # no picture by its content
            return None
        if image not in known:
            self._overrides.afterwards(bpy.data.batch_remove, [image])
        return image


def _of_another_size(name: str, size: Sequence[int], plane: ViewPlane) -> str:
    pixels = " × ".join(map(str, size))
    return f"{name}: its picture has {pixels} pixels and its camera {plane.width} × {plane.height}: it is not shown"


def _of_tracking(lens: Lens, plane: ViewPlane) -> dict[str, str | float | tuple[float, float]] | None:
    """The values of Blender's tracking camera with this lens, in the order in which they are set; None where it has no such.

    Its y points up, and it counts from the center of the first pixel. Measured: what it undistorts is within 0.04 pixels.
    """
    if lens != Lens(lens.terms, radial=lens.radial, tangential=lens.tangential) or len(lens.radial) > 4:
        return None
    (p1, p2), (d_x, d_y), (c_x, c_y) = lens.tangential, plane.distance, plane.principal_point
    return {
        "units": "PIXELS",
        "pixel_aspect": d_y / d_x,
        "focal_length_pixels": d_x,
        "principal_point_pixels": (c_x - 0.5, c_y - 0.5),
        "distortion_model": "BROWN",
        **{f"brown_k{i}": k for i, k in enumerate(lens.radial, 1)},
        "brown_p1": p2,
        "brown_p2": -p1,
    }
