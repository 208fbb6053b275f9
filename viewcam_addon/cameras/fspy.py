"""fSpy: a camera matched to a photograph, as a project or as the JSON of *Export › Camera parameters*.

A project is "fspy", version 1, the lengths of state and picture, the state as JSON, the picture, which comes along. In the
state stands what is exported alone, `cameraParameters`; fSpy's command line leaves it so called, too. The picture's longer side
reaches from −1 to 1, so the distance is the relative focal length times half of it; the field of view that is called horizontal
is that of the longer side, too, and is asked only where others write the JSON without a relative focal length. Camera axes are
x right, y up, z away from the view.

Source: fSpy's project_file_format.md, src/gui/App.tsx (onExportIPCMessage) and src/gui/solver/solver.ts (computeFieldOfView).
"""

import math
import struct

import numpy as np

from ..errors import InputError
from . import axes
from .camera import Camera, Options
from .source import Record, Source

TITLE = "fSpy (project, exported parameters)"

_NO_UNIT = "No unit"


def recognizes(source: Source) -> bool:
    return source.data[:4] == b"fspy" or _exported(source) is not None


def read(source: Source, _options: Options) -> list[Camera]:
    exported = _exported(source)
    camera, unit, picture = _of_project(source) if exported is None else (exported, None, None)
    size = camera.size("imageWidth"), camera.size("imageHeight")
    half = max(size) / 2
    point = camera.record("principalPoint")
    if "relativeFocalLength" in camera:
        focal = camera.number("relativeFocalLength", least=1e-9)
    else:
        focal = 1 / math.tan(camera.number("horizontalFieldOfView", least=1e-9, most=math.pi - 1e-9) / 2)
    c_x, c_top = size[0] / 2 + point.number("x") * half, size[1] / 2 - point.number("y") * half
    plane = axes.view_plane(focal * half, focal * half, c_x, c_top, size)
    matrix = np.array(camera.record("cameraTransform").numbers("rows", 16)).reshape(4, 4)
    pinhole, notes = axes.pinhole(matrix, plane, "the camera")
    if isinstance(unit, str) and unit not in (_NO_UNIT, "Meters"):
        notes += (f"The project counts in {unit.lower()}: its numbers stay, unless a scale is chosen",)
    return [Camera(source.path.stem if source.path else "fSpy", pinhole, True, notes, picture=picture)]


def _exported(source: Source) -> Record | None:
    """The parameters of an export, or of the command line's result; None of anything else."""
    parameters = source.document.get("cameraParameters", source.document)
    is_one = isinstance(parameters, dict) and {"cameraTransform", "principalPoint"} <= parameters.keys()
    return Record(parameters, "the camera") if is_one else None


def _of_project(source: Source) -> tuple[Record, object, bytes | None]:
    """The parameters, the unit, and the picture of a project."""
    data = source.data
    if len(data) < 16:
        raise InputError(f"{source.name} ends in the middle: save the project again")
    version, state_size, picture_size = struct.unpack("<III", data[4:16])
    if version != 1:
        raise InputError(f"{source.name} is of version {version} of fSpy's files: save it with fSpy 1")
    if len(data) < 16 + state_size + picture_size:
        raise InputError(f"{source.name} ends in the middle: save the project again")
    state = Record(Source(data[16 : 16 + state_size].decode("utf-8", errors="replace")).document, "the project")
    if "cameraParameters" not in state:
        raise InputError(f"{source.name} has no camera yet: place the vanishing points in fSpy and save it again")
    settings = state.get("calibrationSettingsBase")
    unit = settings.get("referenceDistanceUnit") if isinstance(settings, dict) else None
    return state.record("cameraParameters"), unit, data[16 + state_size : 16 + state_size + picture_size] or None
