"""VTK's and PyVista's camera as Python code: out; look_at.py reads it.

`camera` is `renderer.GetActiveCamera()` in VTK and ParaView, and `plotter.camera` in PyVista. The view angle is the height's;
the window's center says the principal point, in halves of the picture. Pixels are square.

Source: VTK's documentation of vtkCamera, and its ComputeProjectionTransform.
"""

import math
from collections.abc import Sequence

from ..errors import InputError
from . import look_at, naming, own, texts
from .camera import Camera, Options

TITLE = "VTK, PyVista"
READER = look_at
SUFFIX = ".py"


def write(cameras: Sequence[Camera], options: Options) -> str:
    naming.refuse_mirrored(cameras, "VTK")
    return "\n".join(map(_written, cameras))


def _written(camera: Camera) -> str:
    pinhole = camera.pinhole
    (d_x, d_y), (c_x, c_y), (width, height) = pinhole.distance, pinhole.principal_point, (pinhole.width, pinhole.height)
    if abs(d_x / d_y - 1) > 2.0**-23:
        raise InputError(f"VTK can't say that the pixels of {camera.name} are not square: change it, or write matrices")
    lines = [
        *own.beginning(camera, "#"),
        f"windowSize = ({width}, {height})",
        *(
            f"camera.Set{name}({texts.listed(vector, ', ')})"
            for name, vector in zip(("Position", "FocalPoint", "ViewUp"), texts.look(pinhole), strict=True)
        ),
        f"camera.SetViewAngle({math.degrees(2 * math.atan2(height / 2, d_y))!r})",
        f"camera.SetWindowCenter({1 - 2 * c_x / width!r}, {1 - 2 * c_y / height!r})",
    ]
    return "\n".join([*lines, ""])
