"""fSpy projects: a camera matched to a photograph, which comes along.

"fspy", version 1, the lengths of state and picture, the state as JSON, the picture. The picture's longer side reaches from −1
to 1, so the distance is the relative focal length times half of it; the field of view that a project names horizontal is that
of the longer side, too, and is not asked. Camera axes are x right, y up, z away from the view.

Source: fSpy's project_file_format.md and src/solver.
"""

import struct

import numpy as np

from ..errors import InputError
from ..pinhole import ViewPlane
from . import axes
from .camera import Camera, Options
from .source import Record, Source

TITLE = "fSpy"

_NO_UNIT = "No unit"


def recognizes(source: Source) -> bool:
    return source.data[:4] == b"fspy"


def read(source: Source, _options: Options) -> list[Camera]:
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
    camera = state.record("cameraParameters")
    width, height = camera.size("imageWidth"), camera.size("imageHeight")
    half = max(width, height) / 2
    point = camera.record("principalPoint")
    focal = camera.number("relativeFocalLength", least=1e-9)
    plane = ViewPlane(
        (focal * half, focal * half),
        (width / 2 + point.number("x") * half, height / 2 + point.number("y") * half),
        width,
        height,
    )
    matrix = np.array(camera.record("cameraTransform").numbers("rows", 16)).reshape(4, 4)
    pinhole, notes = axes.pinhole(matrix, plane, "the camera")
    settings = state.values.get("calibrationSettingsBase")
    unit = settings.get("referenceDistanceUnit") if isinstance(settings, dict) else None
    if isinstance(unit, str) and unit not in (_NO_UNIT, "Meters"):
        notes += (f"The project counts in {unit.lower()}: its numbers stay, unless a scale is chosen",)
    picture = data[16 + state_size : 16 + state_size + picture_size] or None
    name = source.path.stem if source.path else "fSpy"
    return [Camera(name, pinhole, True, notes, picture=picture)]
