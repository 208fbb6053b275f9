"""A batch beside Blender: of a copy of the file as it stands, into a new folder, while the artist works on.

Nothing here needs a window. Whoever starts one asks it now and then how far it is, or ends it.
"""

import shutil
import tempfile
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import bpy

from ...errors import InputError
from ...jobs.folder import Outputs
from ...jobs.job import Job
from ...jobs.names import made_fit
from ...jobs.plan import Plan
from .. import own_picture
from . import comparing

_OUTPUT = "output.txt"


def shot(camera_object: bpy.types.Object, scene: bpy.types.Scene, name: str, frame: int) -> Job:
    """A camera in its own picture, at a frame.

    Raises
    ------
    InputError
        if it has pixels of another shape than the scene, which a batch can't give it.
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

    Raises
    ------
    InputError
        if a folder can't be made, the copy not be written or the child not be started.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        into: Path,
        what: str,
        shots: Sequence[Job],
        files: str,
        outputs: Outputs,
    ) -> None:
        self.count, self._files = len(shots), files
        stem = Path(bpy.data.filepath).stem or "untitled"
        self.folder = into / f"{made_fit(f'{stem} {what}')} {datetime.now():%Y-%m-%d %H.%M.%S}"
        try:
            self._temporary = Path(tempfile.mkdtemp(prefix="viewcam-", dir=bpy.app.tempdir or None))
        except OSError as error:
            raise InputError(f"no folder for the copy can be made ({error.strerror}): free some space") from error
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
