"""Background jobs beside Blender while the artist works on: at most one of its kind, and what the last one came to.

That belongs to this session of Blender and to this file. Cancel, another file, turning the add-on off and leaving Blender end
it. A batch is one of a copy of the file as it stands, into a new folder; it needs no window.
"""

import atexit
import shutil
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...errors import InputError
from ...file_names import made_fit
from ...jobs.folder import Outputs
from ...jobs.job import Job
from ...jobs.plan import Plan
from .. import datablocks, own_picture
from . import comparing
from .operators import NamesCamera, possible


class Background:
    """A kind of task that runs in the background, such as comparisons: the one on its way, and the last result.

    running : the one on its way, with `poll` (what it came to, None while it runs), `wait` and `cancel`; or None.
    latest : the last one's result, or None.
    seconds : the seconds between two looks at it.
    looked : called after each look, with the result or None, and when it is canceled.
    discard : called with the last one's result before that is forgotten.
    """

    def __init__(self, seconds: float, looked: Callable[[Any], None], discard: Callable[[Any], None] = lambda _: None) -> None:
        self.running: Any = None
        self.latest: Any = None
        self._seconds, self._looked, self._discard = seconds, looked, discard

        def look() -> float | None:
            """Blender's timer asks again after so many seconds, as long as it goes on."""
            looked(self.poll() if self.running else None)
            return self._seconds if self.running else None

        @persistent
        def on_load(*_: object) -> None:
            self.end()

        self._look, self.on_load = look, on_load

    def begin(self, operator: bpy.types.Operator, start: Callable[[], Any]) -> set[str]:
        """Start a job, and return what its operator returns; for scripts, in a Blender without a window, it waits for it.

        start : makes what runs, or raises InputError. What it came to is then (whether all went well, a sentence).
        """
        try:
            self.running = start()
        except InputError as error:
            operator.report({"ERROR"}, datablocks.sentence(error))
            return {"CANCELLED"}
        if not bpy.app.background:
            bpy.app.timers.register(self._look, first_interval=self._seconds)
            return {"FINISHED"}
        well, sentence = self.wait()
        operator.report({"INFO" if well else "ERROR"}, sentence)
        return {"FINISHED" if well else "CANCELLED"}

    def poll(self) -> Any:
        """The result of the job on its way; None while it runs."""
        outcome = self.running.poll()
        if outcome:
            self._forget()
            self.running, self.latest = None, outcome
        return outcome

    def wait(self) -> Any:
        """Wait for the task on its way, and return its result."""
        try:
            self.running.wait()
            return self.poll()
        except BaseException:  # Ctrl-C
            self.end(forget=False)
            raise

    def end(self, forget: bool = True) -> None:
        """Cancel that on its way, and forget what the last one came to."""
        if self.running:
            self.running.cancel()
        self.running = None
        if forget:
            self._forget()

    def cancel(self) -> None:
        """End it, as a button does."""
        self.end(forget=False)
        self._looked(None)

    def register(self) -> None:
        bpy.app.handlers.load_pre.append(self.on_load)
        atexit.register(self.end)

    def unregister(self) -> None:
        self.end()
        atexit.unregister(self.end)
        if bpy.app.timers.is_registered(self._look):
            bpy.app.timers.unregister(self._look)
        bpy.app.handlers.load_pre.remove(self.on_load)

    def _forget(self) -> None:
        if self.latest:
            self._discard(self.latest)
        self.latest = None


class StartsForCamera(NamesCamera):
    """An operator that starts a task in the background for a camera.

    busy : the sentence for who asks for one while another is on its way.
    """

    background: Background
    busy: str

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        has_camera = context.scene and datablocks.camera_in(context)
        return possible(cls, not cls.background.running, cls.busy) and possible(cls, has_camera, "There is no camera")


class Cancels:
    """An operator that ends what is on its way of its `background`."""

    bl_label = "Cancel"
    background: Background

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return cls.background.running is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        self.background.cancel()
        return {"FINISHED"}


_OUTPUT = "output.txt"


def shot(camera_object: bpy.types.Object, scene: bpy.types.Scene, name: str, frame: int) -> Job:
    """A camera in its own picture, at a frame.

    Raises InputError if it has pixels of another shape than the scene, which a batch can't give it.
    """
    picture, render = own_picture.of_camera(camera_object, scene), scene.render
    share = picture["resolution_percentage"] / 100
    if picture["pixel_aspect_x"] * render.pixel_aspect_y != picture["pixel_aspect_y"] * render.pixel_aspect_x:
        raise InputError(f"camera {camera_object.name!r} has pixels of another shape than the scene: render it alone")
    width, height = (max(4, int(picture[f"resolution_{axis}"] * share)) for axis in "xy")
    return Job(name, camera=camera_object.name, width=width, height=height, frame=frame)


class BackgroundBatch:
    """A batch in the background, which is on its way from the moment it is made.

    into : the folder in which one is made for it, named by file, `what` and time.
    shots : the list.
    files : the pattern of names that one file of each finished shot has there.
    outputs : the files that are made of each shot.

    Raises InputError if a folder can't be made, the copy not be written or the child not be started.
    """

    def __init__(
        self, scene: bpy.types.Scene, into: Path, what: str, shots: Sequence[Job], files: str, outputs: Outputs
    ) -> None:
        self.count, self._files = len(shots), files
        stem = Path(bpy.data.filepath).stem or "untitled"
        self.folder = into / f"{made_fit(f'{stem} {what}')} {datetime.now():%Y-%m-%d %H.%M.%S}"
        self._temporary = comparing.temporary_folder("copy")
        try:
            self.folder.mkdir(parents=True)
            copy = self._temporary / f"{stem}.blend"
            comparing.save_copy(copy)
            self._process = comparing.start(copy, scene, shots, self._temporary / _OUTPUT, Plan(self.folder, outputs))
        except OSError as error:
            self._clear()
            raise InputError(f"{self.folder} can't be written ({error.strerror}): choose another folder") from error
        except InputError:
            self._clear()
            raise

    @property
    def done(self) -> int:
        """The number of shots that are done."""
        return min(len(list(self.folder.glob(self._files))), self.count)

    def wait(self) -> None:
        """Wait until it has ended."""
        self._process.wait()

    def ended(self) -> tuple[int, str] | None:
        """The status with which it ended, and a sentence if that is not 0; None while it runs."""
        status = self._process.status()
        if status is None:
            return None
        self._process.end()
        output = (self._temporary / _OUTPUT).read_text(encoding="utf-8", errors="replace")
        self._clear()
        return status, comparing.failure(output, status) if status else ""

    def cancel(self) -> None:
        """End it at once; what is there stays."""
        self._process.end()
        self._clear()

    def _clear(self) -> None:
        """Remove the copy, and the folder of the files if there is none."""
        shutil.rmtree(self._temporary, ignore_errors=True)
        if self.folder.is_dir() and not any(self.folder.iterdir()):
            self.folder.rmdir()
