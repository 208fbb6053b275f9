"""Camera poses as Unreal has them, one a line: out only.

`name,tx,ty,tz,qx,qy,qz,qw,fov,width,height`: centimeters in a left-handed world, z up, x forward, y to the right; a quaternion
(x, y, z, w); `fov` the degrees of the width. The world's y is negated on the way. Columns and order of the pose are those of
EasySynth's CameraPoses.csv. Rejected: rotators, whose signs differ between Unreal's own documents, and sensor offsets, whose
sign no document says.
"""

import math
from collections.abc import Sequence

from ..errors import InputError
from . import axes, texts
from .camera import Camera, Options

TITLE = "Unreal camera poses (CSV)"
SUFFIX = ".csv"

_CENTIMETERS = 100.0


def write(cameras: Sequence[Camera], options: Options) -> str:
    """The cameras' poses, as Unreal has them.

    Raises InputError if a camera is shifted, mirrored or has pixels that are not square: then no field of view says it.
    """
    lines, before = [], axes.UNTURNED
    for camera in cameras:
        u, v, w = camera.pinhole.axes()
        forward, right, up = ((a, -b, c) for a, b, c in (tuple(-x for x in w), u, v))
        before = axes.continued(axes.quaternion([*zip(forward, right, up, strict=True)]), before)
        lines.append(_line(camera, before))
    return "\n".join(["name,tx,ty,tz,qx,qy,qz,qw,fov,width,height", *lines, ""])


def _line(camera: Camera, quaternion: axes.Quaternion) -> str:
    pinhole = camera.pinhole
    qw, qx, qy, qz = quaternion
    place = [_CENTIMETERS * part for part in (pinhole.eye[0], -pinhole.eye[1], pinhole.eye[2])]
    fov = centered_field_of_view(camera, "Unreal")[0]
    name = camera.name.replace('"', '""')
    name = f'"{name}"' if any(sign in name for sign in ',"\n\r') else name
    return ",".join([name, texts.listed([*place, qx, qy, qz, qw, fov, pinhole.width, pinhole.height], ",")])


def centered_field_of_view(camera: Camera, engine: str) -> tuple[float, float]:
    """Degrees of the width and of the height.

    Raises InputError if no field of view says the camera: it is shifted, mirrored or has pixels that are not square.
    """
    pinhole = camera.pinhole
    (d_x, d_y), (width, height) = pinhole.distance, (pinhole.width, pinhole.height)
    odd = [
        *(["shifted"] if pinhole.principal_point != (width / 2, height / 2) else []),
        *(["mirrored"] if pinhole.mirrored else []),
        *(["of pixels that are not square"] if abs(d_x / d_y - 1) > 2.0**-23 else []),
    ]
    if odd:
        raise InputError(
            f"{camera.name} is {' and '.join(odd)}, which {engine}'s field of view can't say: change it, or write matrices"
        )
    across, along = (math.degrees(2 * math.atan(side / 2 / d)) for side, d in ((width, d_x), (height, d_y)))
    return across, along
