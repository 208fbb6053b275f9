"""The picture of a viewport, traced in a thread: surfaces at once, then light that refines, anew for each scene and view.

Blender draws a viewport whenever it likes, and must not wait: `LiveView.follow` only says what shall be seen, and `picture` is
what has come of it by then. A view's first picture is finished, so that a view that turns without a pause has pictures, and is
coarse where a whole one would take longer than `_AT_ONCE`; what refines it ends when another is asked for. The scene is read as
the viewport's graph has it, when Blender has told of a change of more than cameras; hierarchies are kept from one view to the
next (tracer/render.py). The engine (engine.py) and the swipe over other engines (interface/swipe.py) each have one.

The camera is that of the matrices with which Blender draws, so that outlines and handles lie on what is traced.

Rejected: a child process (the scene would have to be written for each change).
"""

import contextlib
import threading
import time
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar
from weakref import WeakSet

import bpy
import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...image import BACKGROUND_DEPTH
from ...pinhole import Pinhole
from ...rotation import float64
from ...tracer.scene import Scene, least_level
from ...tracer.scene.film import LEVELS, refinement
from ...tracer.tiles import Passes, Stopped
from ..scenes import export
from ..scenes.depsgraph import only_cameras_changed

if TYPE_CHECKING:
    from ...tracer.render import Keeper, Tracer

Picture = NDArray[np.float32]

_GEOMETRY = LEVELS[0]
_SECONDS = 1 / 60  # between two looks whether there is another picture
_AT_ONCE = 0.03  # seconds that a view's first picture may take
_COARSE = 2  # pixels, the side of those of a coarse picture
_PACE = 2.5e-7  # seconds that a pixel may take, where none has been traced yet


class LiveView:
    """The picture of one viewport.

    picture : (height, width, 4) float32, scene linear, rows from the bottom; None until there is one.
    number : the picture's number, which grows with each.
    samples : the number of samples of light that it has, 0 where it shows surfaces.
    message : a sentence that says why there is none.
    """

    _all: ClassVar[WeakSet["LiveView"]] = WeakSet()

    def __init__(self) -> None:
        self.picture: Picture | None = None
        self.number, self.drawn, self.samples, self.message = 0, 0, 0, ""
        self._asked = threading.Condition()
        self._next: tuple[Scene, str, int] | None = None
        self._pace = _PACE  # seconds that a pixel's surface took last
        self._is_begun = False  # the view that is under way has no picture yet
        self._steps: list[int] = []  # samples of the pictures of light that are still to come
        self._rows = 0  # rows of the next one that are there
        self._is_at_work = self._is_closed = False
        self._read: tuple[bool, Scene] | None = None  # true with light, and the scene
        self._followed: tuple | None = None  # view and settings
        self._all.add(self)
        threading.Thread(target=self._work, name="viewcam view", daemon=True).start()

    def scene_changed(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Have the scene read anew, unless nothing but cameras has changed."""
        if depsgraph.id_type_updated("SCENE") or not only_cameras_changed(depsgraph):
            self._read = None

    def follow(
        self,
        depsgraph: bpy.types.Depsgraph,
        region: bpy.types.Region,
        view: bpy.types.RegionView3D,
        clip: tuple[float, float],
    ) -> None:
        """Show what a viewport shows, with the settings of the reference, unless that is on its way already.

        Raises InputError if the view is orthographic, or the scene can't be read.
        """
        settings, camera = depsgraph.scene_eval.virtual_pinhole_reference, camera_of(region, view)
        lit = settings.level != "GEOMETRY"
        if self._read is None or self._read[0] != lit:
            self._read, self._followed = (lit, export.scene_through(depsgraph, camera, clip, lit)), None
        scene = self._read[1]
        level = least_level(scene)[0] if settings.level == "AUTO" else settings.level.lower()
        followed = camera, clip, level, settings.samples, settings.clay
        if followed != self._followed:
            self._followed, scene = followed, replace(scene, camera=camera, clip=clip)
            self.show(of_clay(scene) if settings.clay else scene, level, settings.samples)

    def words(self) -> str:
        """The subject of the picture, or why there is none."""
        return self.message or (f"{self.samples} samples" if self.samples else "Surfaces")

    def show(self, scene: Scene, level: str, samples: int) -> None:
        """Begin with another picture.

        samples : the most samples of light.
        """
        with self._asked:
            self._next, self._is_at_work = (scene, level, samples), True
            self._asked.notify()
        if not bpy.app.timers.is_registered(_redraw):
            bpy.app.timers.register(_redraw, first_interval=_SECONDS)

    def close(self) -> None:
        """End the thread."""
        with self._asked:
            self._is_closed = True
            self._asked.notify()

    @property
    def is_settled(self) -> bool:
        """True if the picture that is drawn is the last that there will be."""
        return self._is_closed or (not self._is_at_work and self.drawn == self.number)

    def tile(self, passes: Passes, rows: range) -> None:
        """Publish light where all rows have come to the next step: pictures are shown whole."""
        if not self._steps:
            return
        picture = passes["Combined"]
        self._rows += len(rows)
        if self._rows == len(picture):
            self._rows, samples = 0, self._steps.pop(0)
            self._publish(picture.copy(), samples)

    def stop(self) -> bool:
        """True if what is under way is not wanted any more."""
        return self._is_closed or (self._next is not None and not self._is_begun)

    def _work(self) -> None:
        from ...tracer.render import Keeper  # loads the tracer, which Blender's start need not wait for

        keeper = Keeper()
        while True:
            with self._asked:
                self._is_at_work = self._next is not None
                self._asked.wait_for(lambda: self._next is not None or self._is_closed)
                if self._is_closed or self._next is None:
                    return
                (scene, level, samples), self._next = self._next, None
                self._is_at_work = True
            with contextlib.suppress(Stopped):
                try:
                    self._trace(scene, level, samples, keeper)
                except InputError as error:
                    self._publish(None, 0, str(error))

    def _trace(self, scene: Scene, level: str, samples: int, keeper: "Keeper") -> None:
        width, height = scene.camera.width, scene.camera.height
        self._steps, self._rows, self._is_begun = [], 0, True
        if self._pace * width * height > _AT_ONCE:
            coarse = scene.camera.resized(-(-width // _COARSE), -(-height // _COARSE))
            self._show_surfaces(keeper.tracer(replace(scene, camera=coarse)), coarse)
        tracer = keeper.tracer(scene)
        self._show_surfaces(tracer, scene.camera)
        if level != _GEOMETRY:
            steps = refinement(samples, width * height) or (samples,)
            self._steps = list(steps)
            tracer.render_light(level, samples, 0, self, steps=steps)

    def _show_surfaces(self, tracer: "Tracer", camera: Pinhole) -> None:
        started = time.perf_counter()
        self._publish(lit_from_the_eye(tracer.render(self, ("Depth", "Facing"))), 0)
        self._pace = (time.perf_counter() - started) / (camera.width * camera.height)
        self._is_begun = False

    def _publish(self, picture: Picture | None, samples: int, message: str = "") -> None:
        if picture is not None:
            self.picture = np.ascontiguousarray(picture, np.float32)
        self.samples, self.message = samples, message
        self.number += 1


def of_clay(scene: Scene) -> Scene:
    """The scene with one material on everything."""
    return replace(scene, objects=tuple(replace(placed, materials=()) for placed in scene.objects))


def lit_from_the_eye(passes: Passes) -> Picture:
    """The Combined pass of level geometry, (height, width, 4): transparent where nothing is."""
    hit = (passes["Depth"] < BACKGROUND_DEPTH).astype(np.float32)
    return np.concatenate([passes["Facing"]] * 3 + [hit], axis=-1)


def camera_of(region: bpy.types.Region, view: bpy.types.RegionView3D) -> Pinhole:
    """The pinhole with which a viewport is drawn, its picture the region. Raises InputError if the view is orthographic."""
    if not view.is_perspective:
        raise InputError("the viewport is orthographic, no pinhole: switch it to perspective")
    to_picture, pose = float64(view.window_matrix), np.linalg.inv(float64(view.view_matrix))
    size = np.array([region.width, region.height])
    eye, w, v = pose[:3, 3], pose[:3, 2], pose[:3, 1]
    return Pinhole(
        tuple(eye.tolist()),
        tuple((eye - w).tolist()),
        tuple(v.tolist()),
        tuple((to_picture[[0, 1], [0, 1]] * size / 2).tolist()),
        region.width,
        region.height,
        tuple(((1 - to_picture[:2, 2]) * size / 2).tolist()),
    )


def _redraw() -> float | None:
    """Have the viewports that show pictures drawn where there are others; called by a timer while any may come."""
    if any(each.drawn != each.number for each in LiveView._all):
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                if area.type == "VIEW_3D" and area.spaces.active.shading.type == "RENDERED":
                    area.tag_redraw()
    return None if all(each.is_settled for each in LiveView._all) else _SECONDS


def unregister() -> None:
    """End the threads of all viewports."""
    for each in list(LiveView._all):
        each.close()
    if bpy.app.timers.is_registered(_redraw):
        bpy.app.timers.unregister(_redraw)
