"""The camera of textbook ray tracers as C++ code: eye, look-at, up and view-plane distance; out; look_at.py reads it.

Pixels have the size 1, so that the distance counts them. What such a camera can't say is refused: a principal point that is not
the picture's middle, pixels that are not square, mirroring.

Source: K. Suffern, Ray Tracing from the Ground Up, chapter 9.
"""

from collections.abc import Sequence

from . import look_at, own, texts
from .camera import Camera, Options
from .unreal import centered_field_of_view

TITLE = "textbook ray tracer (set_eye, set_lookat …)"
READER = look_at
SUFFIX = ".cpp"


def write(cameras: Sequence[Camera], options: Options) -> str:
    return "\n".join(map(_written, cameras))


def _written(camera: Camera) -> str:
    pinhole = camera.pinhole
    centered_field_of_view(camera, "a textbook ray tracer")
    lines = [
        *own.beginning(camera, "//"),
        "Pinhole* camera = new Pinhole;",
        *(
            f"camera->set_{name}({texts.listed(vector, ', ')});"
            for name, vector in zip(("eye", "lookat", "up"), texts.look(pinhole), strict=True)
        ),
        f"camera->set_view_distance({pinhole.distance[1]!r});",
        "camera->compute_uvw();",
        f"vp.set_hres({pinhole.width});",
        f"vp.set_vres({pinhole.height});",
        "vp.set_pixel_size(1.0);",
    ]
    return "\n".join([*lines, ""])
