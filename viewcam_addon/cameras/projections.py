"""Projection matrices P = K [R | t], 3 × 4, world to pixels: of NeuS and IDR, KITTI's calibrations, PMVS, CMPMVS and DTU.

    cameras_sphere.npz, cameras.npz   world_mat_0 … 4 × 4 whose upper three rows are P; scale_mat_0 … of the sphere
    calib.txt, calib/000000.txt       P0: … P3: twelve numbers each; P_rect_00: … with S_rect_00: in calib_cam_to_cam.txt
    00000000.txt, pos_001.txt         P in three lines, after a line CONTOUR in PMVS's and CMPMVS's

P is taken apart into an upright picture and a rotation; its own scale and sign change nothing. NeuS trains in a sphere, which
scale_mat moves into the world of world_mat; the cameras stand in that world, in which its photographs were placed, and a note
says the sphere. KITTI's are the rectified cameras, in the world of the first one, which stands at the origin.

**Pixels.** NeuS, KITTI and DTU count from the first pixel's center, as the programs that calibrated them; Bundler's and
RealityCapture's files for PMVS and CMPMVS from the picture's corner. No file but calib_cam_to_cam.txt says the picture's size.

Rejected: three lines of [R | t], a pose, in which the numbers of K are missing; a file with unit vectors is one.

Source: NeuS' models/dataset.py (load_K_Rt_from_P, gen_rays_at); KITTI's devkits and Geiger et al. 2013; PMVS-2's documentation;
Bundler's Bundle2PMVS.cpp.
"""

import contextlib
import io
import re
import zipfile
import zlib

import numpy as np

from .. import npy
from ..errors import InputError, counted
from . import naming, opencv, texts
from .camera import Camera, Options
from .source import Source, flat, image_size, pixels

TITLE = "projection matrices (NeuS, IDR, KITTI, PMVS, DTU)"
SUFFIX = ".txt"
SEVERAL = "a folder"

_OF_NEUS = ("cameras_sphere.npz", "cameras.npz")
_MOST_BYTES = 2**12  # for a 4 × 4
_PICTURES = ("image", "images", "rgb")
_KITTI = re.compile(r"^[ \t]*(P(?:\d|_rect_\d\d)):[ \t]+(\S.*)$", re.MULTILINE)
_MOST_CHARACTERS = 2**16
_KITTI_SIZE = re.compile(r"^S_rect_(\d\d):[ \t]([-+\d.eE]+)[ \t]+([-+\d.eE]+)[ \t]*$", re.MULTILINE)
_CONTOUR = "CONTOUR"
_ORTHOGONAL = 1e-3


def recognizes(source: Source) -> bool:
    return bool(_of_neus(source)) or (not source.is_folder and (_is_kittis(source) or _alone(source) is not None))


def read(source: Source, options: Options) -> list[Camera]:
    if matrices := _of_neus(source):
        return _neus(source, matrices, options)
    if _is_kittis(source):
        return [_kitti(source, key, matrix, options) for key, matrix in _of_kitti(source).items()]
    matrix = _alone(source)
    if matrix is None:
        raise InputError(f"{source.name} has no projection matrix of three lines with four numbers each: correct it")
    name = source.path.stem if source.path else "camera"
    habit = "corner" if source.text.lstrip().startswith(_CONTOUR) else "center"
    picture = naming.near(f"{name}.jpg", source.path.parent.parent / "visualize") if source.path else None
    size = image_size(picture) if picture else None
    return [_camera(name, matrix, size, habit, source.name, None if habit == "corner" else "DTU", options)]


def _neus(source: Source, matrices: dict[str, np.ndarray], options: Options) -> list[Camera]:
    numbers = sorted(int(key[10:]) for key in matrices if key.startswith("world_mat_"))
    folder = source.path.parent if source.path and not source.is_folder else source.path
    images = naming.in_order(folder, _PICTURES, len(numbers))
    cameras = []
    for index, number in enumerate(numbers):
        picture = images[index] if images else None
        name = naming.stem(picture) if picture else f"{number:03d}"
        size = image_size(folder / picture) if picture and folder else None
        camera = _camera(
            name, matrices[f"world_mat_{number}"][:3], size, "center", f"camera {number}", "NeuS", options, picture
        )
        sphere = matrices.get(f"scale_mat_{number}")
        if sphere is not None and np.abs(sphere - np.eye(4)).max() > 0:
            place = f"({', '.join(f'{x:.6g}' for x in sphere[:3, 3].tolist())}) with the radius {sphere[0, 0]:.6g}"
            camera = camera.noted(f"The cameras stand in the world of world_mat, in which NeuS' sphere is about {place}")
        cameras.append(camera)
    return cameras


def _kitti(source: Source, key: str, matrix: np.ndarray, options: Options) -> Camera:
    sizes = {match[1]: match for match in _KITTI_SIZE.finditer(source.text)}
    size: tuple[int, int] | None = None
    if match := sizes.get(key[-2:]):
        size = pixels(f"the width of {key}", match[2]), pixels(f"the height of {key}", match[3])
    elif source.path:
        for place in (f"image_{key[-1]}", f"../image_{key[-1]}"):
            for name in (source.path.stem, "000000"):
                size = size or image_size(source.path.parent / place / f"{name}.png")
    return _camera(key, matrix, size, "center", f"{key} of {source.name}", "KITTI", options)


def _camera(
    name: str,
    matrix: np.ndarray,
    size: tuple[int, int] | None,
    habit: str,
    what: str,
    program: str | None,
    options: Options,
    image: str | None = None,
) -> Camera:
    """The camera of a projection matrix P.

    program : the program whose pixels count from the first one's center; None where they count from the corner.
    """
    half = opencv.half_pixel(options, habit)
    matrix = np.array([[1, 0, half], [0, 1, half], [0, 0, 1]]) @ matrix
    determinant = float(np.linalg.det(matrix[:, :3]))
    if not 1e-150 < abs(determinant) < 1e150:
        raise InputError(f"the projection matrix of {what} is flat, or far too large: it is no pinhole camera")
    matrix = matrix * np.sign(determinant)
    eye = tuple((-np.linalg.solve(matrix[:, :3], matrix[:, 3])).tolist())
    pinhole, notes = texts.projected(matrix[:, :3], eye, size or options.size_or_refuse(what), what)
    c_x, c_y = pinhole.principal_point
    opencv.refuse_widths(*pinhole.distance, c_x, pinhole.height - c_y, (pinhole.width, pinhole.height), what)
    notes_of_program = opencv.told_of_half_pixel(options, program) if program else ()
    return Camera(name, pinhole, size is not None, (*notes_of_program, *notes), image)


def _of_neus(source: Source) -> dict[str, np.ndarray]:
    """The 4 × 4 matrices of an NPZ by their names, if it is NeuS'."""
    file = next(filter(None, map(source.file, _OF_NEUS)), None) if source.is_folder else source
    if file is None or file.data[:4] != b"PK\x03\x04":
        return {}
    result: dict[str, np.ndarray] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(file.data)) as archive:
            for name, member in npy.members(archive).items():
                if re.fullmatch(r"(?:world|scale)_mat_\d{1,6}", name) and member.file_size < _MOST_BYTES:
                    with contextlib.suppress(ValueError), archive.open(member) as packed:
                        matrix = npy.read(packed.read(member.file_size)).astype(np.float64)
                        if matrix.shape in ((4, 4), (3, 4)):
                            result[name] = matrix
    except (ValueError, OSError, EOFError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error):
        return {}
    return result if any(name.startswith("world") for name in result) else {}


def _is_kittis(source: Source) -> bool:
    text = source.text if len(source.data) < _MOST_CHARACTERS else ""
    return any(len(match[2].split()) == 12 for match in _KITTI.finditer(text))


def _of_kitti(source: Source) -> dict[str, np.ndarray]:
    """KITTI's P by their names. Raises InputError if one is damaged or there twice."""
    matrices: dict[str, np.ndarray] = {}
    for match in _KITTI.finditer(source.text):
        numbers = flat(what := f"{match[1]} of {source.name}", match[2].split())
        if len(numbers) != 12 or match[1] in matrices:
            problem = (
                "is there twice: leave one out"
                if match[1] in matrices
                else f"has {counted(len(numbers), 'number')}: it should have 12"
            )
            raise InputError(f"{what} {problem}")
        matrices[match[1]] = np.array(numbers).reshape(3, 4)
    return matrices


def _alone(source: Source) -> np.ndarray | None:
    """P of a file that holds nothing else; None where it is something else, or a pose."""
    text = source.text[:2000].strip()
    lines = [line.split() for line in text.removeprefix(_CONTOUR).strip().split("\n")]
    if [len(line) for line in lines] != [4, 4, 4]:
        return None
    try:
        matrix = np.array([[float(word) for word in line] for line in lines])
    except ValueError:
        return None
    if "_" in text or not np.isfinite(matrix).all():
        return None
    turn = matrix[:, :3]
    is_pose = np.abs(turn).max() < 2 and np.abs(turn @ turn.T - np.eye(3)).max() < _ORTHOGONAL
    return None if is_pose else matrix
