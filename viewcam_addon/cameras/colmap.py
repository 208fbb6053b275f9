"""A COLMAP model as text: cameras.txt, images.txt, and a points3D.txt without points, since none are known.

**Cameras.** One line for each set of intrinsics that the pictures have: SIMPLE_PINHOLE (f, cx, cy) where pixels are square,
else PINHOLE (fx, fy, cx, cy). The upper left corner of the picture is (0, 0), its first pixel's centre (0.5, 0.5).

**Images.** Two lines each, the second one empty: it would list image points. The pose takes world space to the camera's x
right, y down, z into the view, as a unit quaternion (w first, Hamilton's) and a translation. Of the two quaternions of a
rotation it is the one whose first number that is not 0 is positive. All numbers have as many digits as bring back the same
float64.

rigs.txt and frames.txt, new in COLMAP 3.12, are left out: without them each image is a frame of its own, as older readers take
it.

Sources: COLMAP's doc/format.rst, doc/database.rst (pixel centres) and src/colmap/scene/reconstruction_io_text.cc (what parts a
line: a name ends at a space).
"""

from collections.abc import Iterable, Sequence

from ..errors import InputError
from ..pinhole import Pinhole
from . import naming
from .axes import intrinsics, quaternion, world_to_camera
from .camera import Camera, Options

TITLE = "COLMAP model (cameras, images)"
SUFFIX = ""


def recognises(_source) -> bool:
    return False


def write(cameras: Sequence[Camera], _options: Options) -> dict[str, str]:
    return texts(cameras)


def check_names(files: Iterable[str]) -> None:
    """Raise InputError if a picture's name holds a space, of any width, since some readers part there, too."""
    parted = [file for file in files if any(map(str.isspace, file))]
    if parted:
        raise InputError(f"a COLMAP model can't name a picture with a space, as {naming.several(parted)}: rename it")


def texts(cameras: Iterable[Camera]) -> dict[str, str]:
    """Name of the file → what it holds; cameras and images are numbered from 1, in their order.

    Raises
    ------
    InputError
        if there is no camera, two have one picture, one is mirrored, or the name of a picture holds a space.
    """
    cameras = naming.checked(cameras, "a COLMAP model")
    check_names(map(naming.image_of, cameras))
    numbers: dict[str, int] = {}
    images = []
    for number, camera in enumerate(cameras, start=1):
        intrinsic = numbers.setdefault(_camera(camera.pinhole), len(numbers) + 1)
        images.append(f"{number} {_pose(camera.pinhole)} {intrinsic} {naming.image_of(camera)}\n\n")
    return {
        "images.txt": "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# POINTS2D[] as X Y POINT3D_ID\n" + "".join(images),
        "cameras.txt": "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n"
        + "".join(f"{number} {camera}\n" for camera, number in numbers.items()),
        "points3D.txt": "# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n",
    }


def _camera(pinhole: Pinhole) -> str:
    (f_x, _, c_x), (_, f_y, c_y), _ = intrinsics(pinhole)
    model, focal = ("SIMPLE_PINHOLE", [f_x]) if f_x == f_y else ("PINHOLE", [f_x, f_y])
    return f"{model} {pinhole.width} {pinhole.height} {_spaced(*focal, c_x, c_y)}"


def _pose(pinhole: Pinhole) -> str:
    *rows, _ = world_to_camera(pinhole)
    return _spaced(*quaternion(rows), *(row[3] for row in rows))


def _spaced(*numbers: float) -> str:
    return " ".join(map(repr, numbers))
