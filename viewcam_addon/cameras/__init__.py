"""Cameras of other programs, in and out: nothing else in this project reads or writes one.

    read(text or Path, options=Options(…))        → list of Camera, recognized by content
    write(cameras, "colmap", Options(…))          → text, or the files of a folder
    save(cameras, path, "colmap", Options(…))     → written there, each whole or not at all
    choose(cameras, name)                         → the one that is meant, or a sentence with all names

    camera.py       Camera and Options
    axes.py         the one place of conventions: axes, pixels, world
    ground.py       the ground of a data set's points as z = 0; clouds.py finds these
    source.py       what is read from: text, file, folder; JSON and XML without their dangers
    distortion.py   lenses: what they do with a pinhole's picture
    undistortion.py photographs without their lens
    and a module for each format

A format is a module in `FORMATS` with

    TITLE                           what people call it
    recognizes(source) → bool       by content; False for whatever it can't be, and never an error of its own
    read(source, options) → list[Camera]            where cameras can be read; in the file's own world
    write(cameras, options) → text, or {file name: text or bytes}      where they can be written; in the file's own world
    SUFFIX                          of the file that it writes; "" where these are several in a folder
    SEVERAL                         where a file has one camera: "a folder" if several are files of one, "a text" if they stand
                                    one after another (own.py's `beginning`)
    READER                          of what only writes: the module that reads it
    notes_in(source) → texts        where a file that it wrote has this project's notes, if that is not its text
    read_again(cameras, options) → list[Camera]     where it takes its time: what `read` makes of what `write` gives
    LENSES                          of what writes a camera's lens, too, and refuses itself what it can't say
    NOT_BESIDE                      of several files: names of others with which programs would not read these
    in_world(source, options) → Options             where a file says its own axes and unit: the options with these

**To the bit.** A matrix or an angle holds fewer digits than the values of which it was made. So a writer puts these beside
(own.py's `document`, in a comment or wherever the format lets programs keep what is theirs), and here, for all formats alike, a
camera takes them if written again they are read as that camera. Where somebody changed the numbers, the numbers count.

**Damage.** Whatever a reader meets in a damaged file that it did not think of is told as a sentence (`_told_of_damage`), since
nobody who imports a file can mend this project. tests/fuzz sees what caused it, and calls it a fault. Names and sentences are
one line each of characters that show, whatever stands in the file.

Axes and scale are applied here, for all alike. The first format that recognizes something reads it: the more certain ones
stand first, and what takes any text last.
"""

import contextlib
import itertools
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np

from .. import checks, file_names, terminal
from ..errors import InputError, bug, is_of_a_path, several
from ..files import written_whole
from ..pinhole import Pinhole
from . import (
    after_effects,
    arkit,
    arrays,
    azure_kinect,
    basalt,
    blender_python,
    bop,
    bundler,
    colmap,
    colmap_binary,
    distortion,
    earth_studio,
    fspy,
    gaussian_splatting,
    gazebo,
    gltf,
    ground,
    infinigen,
    instant_ngp,
    kubric,
    llff,
    look_at,
    matrices,
    meshroom,
    metashape,
    middlebury,
    mitsuba,
    mujoco,
    mvsnet,
    naming,
    nerfies,
    nerfstudio_path,
    nuscenes,
    nvisii,
    open3d,
    opencv,
    openmvg,
    opensfm,
    own,
    pbrt,
    pose_files,
    pov_ray,
    projections,
    ray_tracer_challenge,
    realestate10k,
    realitycapture,
    ros,
    sidecar,
    supersplat,
    textbook,
    three_js,
    trajectories,
    transforms,
    unity,
    unreal,
    usd,
    visualsfm,
    vtk,
)
from .axes import leveled, moved, moved_back
from .camera import ANGLES, AXES, PIXELS, POSES, UPS, Camera, LeftOut, NoPinholeError, Options, choose
from .source import Source, image_size

__all__ = [
    "ANGLES",
    "AXES",
    "FORMATS",
    "PIXELS",
    "POSES",
    "UPS",
    "Camera",
    "Options",
    "choose",
    "read",
    "readable",
    "recognized",
    "save",
    "writable",
    "write",
]

FORMATS: dict[str, ModuleType] = {
    "sidecar": sidecar,
    "transforms": transforms,
    "colmap": colmap,
    "colmap_binary": colmap_binary,
    "bop": bop,
    "gltf": gltf,
    "usd": usd,
    "fspy": fspy,
    "metashape": metashape,
    "realitycapture": realitycapture,
    "meshroom": meshroom,
    "openmvg": openmvg,
    "bundler": bundler,
    "visualsfm": visualsfm,
    "llff": llff,
    "mvsnet": mvsnet,
    "middlebury": middlebury,
    "projections": projections,
    "pose_files": pose_files,
    "arkit": arkit,
    "gaussian_splatting": gaussian_splatting,
    "nerfies": nerfies,
    "nerfstudio_path": nerfstudio_path,
    "instant_ngp": instant_ngp,
    "kubric": kubric,
    "nvisii": nvisii,
    "infinigen": infinigen,
    "supersplat": supersplat,
    "earth_studio": earth_studio,
    "after_effects": after_effects,
    "nuscenes": nuscenes,
    "basalt": basalt,
    "azure_kinect": azure_kinect,
    "open3d": open3d,
    "opensfm": opensfm,
    "ros": ros,
    "opencv": opencv,
    "realestate10k": realestate10k,
    "trajectories": trajectories,
    "three_js": three_js,
    "unreal": unreal,
    "unity": unity,
    "blender_python": blender_python,
    "vtk": vtk,
    "textbook": textbook,
    "gazebo": gazebo,
    "mujoco": mujoco,
    "ray_tracer_challenge": ray_tracer_challenge,
    "mitsuba": mitsuba,
    "pov_ray": pov_ray,
    "pbrt": pbrt,
    "matrices": matrices,
    "look_at": look_at,
    "arrays": arrays,
    "text": own,
}
"""Name → module, in the order in which they are asked."""

_LONGEST = 1000  # characters of a name or a sentence
_YAML = (".yaml", ".yml")
_JSON = (".json", ".gltf", ".sfm")
_CODE = ("text", "blender_python", "vtk", "textbook", "mitsuba", "pov_ray", "pbrt", "matrices", "look_at", "arrays")
"""The formats that a damaged JSON file may look like."""
_MOST_LOOKED_AT = 100
_DEEPEST = 3
_FILES_OF_DATA_SETS = (transforms.FILE, "images.bin", "images.txt")
_HEAD = 4000  # characters by which a text is known
_ON_EARTH = 6.33e6, 6.42e6  # meters from the Earth's middle, as far down and up as anybody takes pictures
_SAME_SHAPE = 1e-3  # relative: what the angles of both sides may differ by for the few digits of one
_REMEMBERED = re.compile(rf"{own.KEY}: (axes=\w+ scale=[\d.e+-]+)")


def readable() -> list[str]:
    """The formats that can be read."""
    return [name for name, module in FORMATS.items() if hasattr(module, "read")]


def writable() -> list[str]:
    """The formats that can be written."""
    return [name for name, module in FORMATS.items() if hasattr(module, "write")]


def read(content: str | Path, *, format: str | None = None, options: Options | None = None) -> list[Camera]:
    """The cameras of a text, a file or a folder.

    content : a text, or the Path of a file or folder.
    format : one of `readable()`; None to recognize it by its content.

    From the second one of a name on, that has a number: `Cam #2`.

    Raises InputError if there is no camera in it, or one that is no pinhole, lacks something, or is not what it should be.
    """
    options = options or Options()
    source = Source(content)
    module = _module(format or recognized(source), "read")
    with _told_of_damage(source, module.TITLE), np.errstate(all="ignore"):  # anything may stand in a file
        if format and not _recognizes(module, source):
            raise InputError(f"{source.name} is not {module.TITLE} by its content: leave the format out")
        read_cameras = _of_all(source, module, options)
        names = naming.numbered([camera.name for camera in read_cameras])
        read_cameras = [
            camera if camera.name == name else replace(camera, name=name)
            for camera, name in zip(read_cameras, names, strict=True)
        ]
        if options.up_from == "ground":
            return ground.leveled(read_cameras, source, options)
        return leveled(read_cameras) if options.up_from == "cameras" else read_cameras


def _of_all(source: Source, module: ModuleType, options: Options) -> list[Camera]:
    """The cameras of a text, a file or a folder."""
    if source.is_folder and _in_folder(source, module):
        return _each_of_folder(source, module, options)
    parts = own.parts(source.text) if getattr(module, "SEVERAL", "") == "a text" else []
    if not parts:
        cameras = _read(source, module, options)
        is_one = len(cameras) == 1 and getattr(module, "SEVERAL", "") == "a folder"
        return [_called(cameras[0], source, cameras[0].name)] if is_one else cameras
    sources = [source] if len(parts) == 1 else [Source(text) for _, text in parts]
    cameras = []
    for (name, _), part in zip(parts, sources, strict=True):
        if not module.recognizes(part):
            raise InputError(f"{source.name} names the camera {checks.quoted(name)} and has no such camera: export it again")
        cameras += [replace(camera, name=_quoted(name)) for camera in _read(part, module, options)]
    return cameras


def _recognizes(module: ModuleType, source: Source) -> bool:
    return module.recognizes(source) or (source.is_folder and any(map(module.recognizes, _in_folder(source, module))))


def _in_folder(source: Source, module: ModuleType) -> list[Source]:
    """The files of a folder that may each be a camera of this format, if it has a file for each."""
    if getattr(module, "SEVERAL", "") != "a folder" or source.path is None or module.recognizes(source):
        return []
    suffixes = _YAML if module.SUFFIX in _YAML else (module.SUFFIX,)
    return [file for suffix in suffixes for file in source.files(f"*{suffix}")]


def _each_of_folder(source: Source, module: ModuleType, options: Options) -> list[Camera]:
    """The cameras of a folder's files, called as these, with a note on those that are of another format."""
    left_out, cameras, others = LeftOut(), [], []
    for file in _in_folder(source, module):
        path = Path(file.name)
        name = path.stem
        if not module.recognizes(file):
            others.append(path.name)
            continue
        with left_out.unless_pinhole(name):
            members = _read(file, module, options)
            is_one = len(members) == 1
            cameras += [_called(each, file, name) if is_one else replace(each, name=f"{name} {each.name}") for each in members]
    notes = (f"Not read, since they are not {module.TITLE}: {several(others)}",) if others else ()
    return [camera.noted(*notes) for camera in left_out.with_notes(sorted(cameras, key=lambda camera: camera.name))]


def _called(camera: Camera, file: Source, otherwise: str) -> Camera:
    """The camera by the name that its file says, if the file is called by that."""
    stated = (*(name for name, _ in own.parts(file.text)), camera.name)
    stem = file.path.stem if file.path else ""
    called = (name for name in stated if re.fullmatch(rf"{re.escape(file_names.made_fit(name))}(_\d+)?", stem))
    return replace(camera, name=_quoted(next(called, otherwise)))


def _read(source: Source, module: ModuleType, options: Options) -> list[Camera]:
    try:
        cameras = module.read(source, options)
    except InputError as error:
        if source.path and source.path.name not in str(error):
            kind = NoPinholeError if isinstance(error, NoPinholeError) else InputError
            raise kind(f"{source.name}: {error}") from error.__cause__
        raise
    if not cameras:
        raise InputError(f"{source.name} holds no camera: give another file")
    notes = module.notes_in(source) if hasattr(module, "notes_in") else [source.text]
    cameras = _to_the_bit(cameras, [pinhole for text in notes for pinhole in own.pinholes_in(text)], module, options)
    world = module.in_world(source, options) if hasattr(module, "in_world") else options
    noted = _told_of_world(notes, world)
    noted += _told_of_size(cameras, source) + _told_of_globe(cameras)
    result = [_readable(_doubted(_unmirrored(moved(camera, world), options))) for camera in cameras]
    return [camera.noted(*noted) for camera in result] if noted else result


@contextlib.contextmanager
def _told_of_damage(source: Source, title: str) -> Iterator[None]:
    """A context that turns what no reader thought of into a sentence, with its cause."""
    try:
        yield
    except InputError as error:
        if (sentence := _quoted(str(error))) == str(error):
            raise
        raise InputError(sentence) from error.__cause__
    except (ArithmeticError, AttributeError, LookupError, MemoryError, OSError, RuntimeError, TypeError, ValueError) as error:
        if is_of_a_path(error):
            raise InputError(bug(error)) from error
        raise InputError(f"{source.name} is damaged where it says its cameras ({title}): export it again") from error


_BY_BLENDER = "is read by Blender itself: import it there, save, and give the .blend"
_PACKED, _A_PICTURE = "is packed: unpack it, and give what was in it", "is a picture: give the file of its camera"
_A_PAGE = "is a page of the web: download the file itself that it shows"
_OTHER_FILES = {
    b"version https://git-lfs": "is Git LFS's pointer to the file, and not the file: get it by git lfs pull",
    **dict.fromkeys((b"Kaydara FBX Binary", b"; FBX ", b"Ogawa"), _BY_BLENDER),
    **dict.fromkeys((b"\x1f\x8b", b"BZh", b"\xfd7zXZ", b"(\xb5/\xfd", b"7z\xbc\xaf", b"Rar!"), _PACKED),
    **dict.fromkeys((b"\x89PNG", b"\xff\xd8\xff", b"v/1\x01", b"II*\0", b"MM\0*", b"RIFF"), _A_PICTURE),
    **dict.fromkeys((b"<!DOCTYPE html", b"<!doctype html", b"<html"), _A_PAGE),
    **dict.fromkeys((b"ply\n", b"ply\r"), "is a point cloud or a mesh, which has no cameras: give the file of these"),
    **dict.fromkeys((b"FOR4", b"FOR8"), "is a scene of Maya's: export its camera as USD or FBX"),
    b"QC4DC4D": "is a scene of Cinema 4D's: export its camera as USD or FBX",
    b"\xd0\xcf\x11\xe0": "is a document, or a scene of 3ds Max's: export its camera as USD or FBX",
    b"SQLite format 3": "is a database, as COLMAP's, which has no poses: give the model, as the folder sparse/0",
    **dict.fromkeys(
        (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"), "is a pickle, which may run programs: save JSON or NPZ"
    ),
    **dict.fromkeys((b"\x89HDF", b"MATLAB 5.0"), "is of a kind that is not read: save its numbers as JSON or as text"),
}
"""The first bytes of files that hold no camera that is read here, and what is to be said of them."""


_OTHER_TEXTS = {
    re.compile(r"^//Maya ASCII|^requires maya |^createNode camera ", re.MULTILINE): "a scene of Maya's",
    re.compile(r"^\[gd_scene |^\[node name=", re.MULTILINE): "a scene of Godot's",
    re.compile(r"<COLLADA\b", re.MULTILINE): "a scene of Collada's",
    re.compile(r"^#! ?\S{0,200}[Nn]uke|^Camera[234]? \{$", re.MULTILINE): "a script of Nuke's",
    re.compile(r"^ ?persp_camera$", re.MULTILINE): "a scene of Arnold's",
    re.compile(r"^##RenderMan RIB|^ ?Projection \"perspective\"", re.MULTILINE): "a scene of RenderMan's",
    re.compile(r"^scene\.camera\.(?:lookat\.|fieldofview ?=|screenwindow ?=)", re.MULTILINE): "a scene of LuxCore's",
    re.compile(r"^%TAG !u! tag:unity3d", re.MULTILINE): "a scene of Unity's",
    re.compile(r"^ ?RenderView \w{1,60} ?\{", re.MULTILINE): "a scene of V-Ray's",
    re.compile(r"^#VRML |<X3D\b", re.MULTILINE): "a scene of X3D or VRML",
    re.compile(r"<cycles>", re.MULTILINE): "a scene of Cycles' own",
    re.compile(r"<project format_revision=", re.MULTILINE): "a scene of Appleseed's",
    re.compile(r"\"autoClear\":", re.MULTILINE): "a scene of Babylon's",
    re.compile(r"^Begin (?:Map|Actor|Object)\b", re.MULTILINE): "a part of a level of Unreal's",
    re.compile(r"^(?:name|id),tx,ty,tz,qx,qy,qz,qw\b", re.MULTILINE): "a table of poses of Unreal's",
}
"""The first lines of texts of other programs that are not read, with one blank for several, and what these are."""


def _refuse_others(source: Source) -> None:
    """Raise InputError if it is a text of a program whose cameras are not read."""
    head = re.sub(r"[ \t]+", " ", source.text[:_HEAD])
    for pattern, kind in _OTHER_TEXTS.items():
        if pattern.search(head):
            raise InputError(f"{source.name} is {kind}, which is not read: export its cameras as USD, glTF or FBX")


def recognized(source: str | Path | Source) -> str:
    """The name of the format. Raises InputError if it is none that can be read."""
    source = source if isinstance(source, Source) else Source(source)
    if source.path is None and not source.text.strip():
        raise InputError("there is no text: copy a camera first")
    is_json = source.path is not None and source.path.suffix.lower() in _JSON
    _refuse_others(source)
    for name in readable():
        with _told_of_damage(source, FORMATS[name].TITLE):
            if _recognizes(FORMATS[name], source):
                if is_json and name in _CODE and source.json_problem and not own.lines_of(source):
                    break
                return name
    for beginning, sentence in _OTHER_FILES.items():
        if source.data.startswith(beginning):
            raise InputError(f"{source.name} {sentence}")
    if source.path and source.path.suffix.lower() in (".npy", ".npz"):
        raise InputError(
            f"{source.name} holds no arrays of a camera, or is damaged: save it again, with K, R and t or as a pose"
        )
    if source.data.startswith(b"PK\x03\x04"):
        raise InputError(f"{source.name} {_PACKED}")
    if not source.is_folder and not source.data.strip():
        raise InputError(f"{source.name} is empty: export it again")
    for file in (source, *itertools.islice(source.files("*.[jx]*[nlp]"), _MOST_LOOKED_AT)):
        if file.problem:
            raise InputError(f"{file.name} {file.problem}")
    for there, lacks in itertools.permutations(colmap.FILES):
        for suffix in (".bin", ".txt"):
            if source.is_folder and source.file(f"{there}{suffix}"):
                raise InputError(
                    f"{source.name} has {there}{suffix} of a COLMAP model and no {lacks}{suffix}: put it there, too"
                )
    if source.is_folder and source.path and (folders := _data_sets_in(source.path)):
        raise InputError(f"{source.name} has no cameras itself: give {several(folders)} in it")
    if source.path is None:
        place = checks.quoted(source.text.strip()[:40])
        raise InputError(
            f"the text is no camera that is understood, from its beginning {place} on: copy a whole camera, or write "
            "eye=1,2,3 look_at=0,0,0 up=0,0,1 d=1000"
        )
    raise InputError(f"{source.name} is no camera that is understood: give a file of {', '.join(readable())}")


def _data_sets_in(folder: Path) -> list[str]:
    """The folders in a folder, to three deep, that have cameras by the names of their files."""
    folders, level = list[Path](), [folder]
    for _ in range(_DEEPEST):
        with contextlib.suppress(OSError):
            level = [Path(each) for parent in level for each in os.scandir(parent) if each.is_dir(follow_symlinks=False)]
        level = sorted(level)[:_MOST_LOOKED_AT]
        folders += [each for each in level if any((each / name).is_file() for name in _FILES_OF_DATA_SETS)]
    return [each.relative_to(folder).as_posix() for each in folders]


def write(cameras: Iterable[Camera], format: str, options: Options | None = None) -> str | dict[str, str | bytes]:
    """The cameras as a text, or as files: relative name → content.

    Raises InputError if there is none, or the format can't say what one of them is.
    """
    options = options or Options()
    cameras = [moved_back(camera, options) for camera in cameras]
    if not cameras:
        raise InputError("there is no camera to write: give one at least")
    module = _module(format, "write")
    for camera in () if hasattr(module, "LENSES") else cameras:
        distortion.refuse(camera.lens, camera.pinhole.plane, camera.name, module.TITLE)
    written: str | dict[str, str | bytes] = module.write(cameras, options)
    return written


def save(cameras: Iterable[Camera], path: str | os.PathLike[str], format: str, options: Options | None = None) -> list[Path]:
    """Write the cameras: a text to the file `path`, several files into the folder `path`. Returns what was written.

    Raises InputError as `write` does, or if a file can't be written or would be read with others of its folder; FullDiskError
    if the disk is full.
    """
    content = write(cameras, format, options)
    check_no_other_model(path, format)
    files: Mapping[Path, str | bytes] = (
        {Path(path): content}
        if isinstance(content, str | bytes)
        else {Path(path, name): each for name, each in content.items()}
    )
    with contextlib.ExitStack() as stack:
        for file, each in files.items():
            stack.enter_context(written_whole(file)).write_bytes(each if isinstance(each, bytes) else each.encode("utf-8"))
    return [*files]


def check_no_other_model(path: str | os.PathLike[str], format: str) -> None:
    """Raise InputError if a folder has files of another model, by which programs would read this one otherwise."""
    others = [name for name in getattr(_module(format, "write"), "NOT_BESIDE", ()) if Path(path, name).exists()]
    if others:
        raise InputError(
            f"{os.fspath(path)} has {several(others)} of another model, which programs would read with this one or in its "
            "place: choose another folder, or take them out"
        )


def _module(name: str, does: str) -> ModuleType:
    able: Sequence[str] = readable() if does == "read" else writable()
    if name not in able:
        raise InputError(
            f"the format {checks.quoted(name)} can't be {'read' if does == 'read' else 'written'}: {', '.join(able)} can"
        )
    return FORMATS[name]


def _to_the_bit(cameras: list[Camera], stated: list[Pinhole], module: ModuleType, options: Options) -> list[Camera]:
    """The cameras, with the stated values where these, written and read again, are the same camera."""
    exact: dict[Pinhole, list[Pinhole]] = {}  # as it is read: the values, of which several may be read alike
    writers = [each for each in FORMATS.values() if each is module or getattr(each, "READER", None) is module]
    if len(stated) > len(cameras):  # then they are of others
        return cameras
    for writer in writers if stated else ():
        again = _read_again(stated, writer, module, options)
        for camera, pinhole in zip(reversed(again), reversed(stated), strict=False):
            if (camera.pinhole.width, camera.pinhole.height) == (pinhole.width, pinhole.height):
                exact.setdefault(camera.pinhole, []).append(pinhole)
    return [replace(camera, pinhole=same.pop()) if (same := exact.get(camera.pinhole)) else camera for camera in cameras]


def _read_again(pinholes: list[Pinhole], writer: ModuleType, reader: ModuleType, options: Options) -> list[Camera]:
    """The cameras that are read of these pinholes once they are written; nothing if they can't be."""
    if not hasattr(writer, "write"):
        return []
    try:
        cameras = [Camera(f"{number}", pinhole) for number, pinhole in enumerate(pinholes)]
        if hasattr(writer, "read_again"):
            return [*writer.read_again(cameras, options)]
        again = reader.read(Source(writer.write(cameras, options)), options)
    except InputError:
        return []
    return again if len(again) == len(pinholes) else []


def _told_of_world(notes: Iterable[str], options: Options) -> tuple[str, ...]:
    """A note where the file remembers that it was written with other axes or another scale than it is read with."""
    remembered = next((match for text in notes if (match := _REMEMBERED.search(text[:10_000]))), None)
    if remembered is None or remembered[1] == options.remembered.partition(": ")[2]:
        return ()
    return (f"The file says that it was written with {remembered[1]}: choose the same to have the cameras back",)


def _told_of_size(cameras: Sequence[Camera], source: Source) -> tuple[str, ...]:
    """A note where the first picture that is there has another size than its camera says, as reduced copies have."""
    folder = source.path if source.is_folder or source.path is None else source.path.parent
    first = next((camera for camera in cameras if camera.size_stated and camera.image), None)
    if first is None or folder is None or (file := naming.picture_of(first, folder)) is None:
        return ()
    size, stated = image_size(file), (first.pinhole.width, first.pinhole.height)
    if size in (None, stated):
        return ()
    pixels, of_camera = (f"{width} × {height}" for width, height in (size or stated, stated))
    return (f"{file} has {pixels} pixels and its camera {of_camera}, which counts",)


def _told_of_globe(cameras: Sequence[Camera]) -> tuple[str, ...]:
    """A note where a camera is as far from the origin as what stands on the Earth is from its middle."""
    if not any(_ON_EARTH[0] < math.hypot(*camera.pinhole.eye) < _ON_EARTH[1] for camera in cameras):
        return ()
    return (
        "The cameras are as far from the origin as the Earth's surface from its middle: in geocentric coordinates z is not up, "
        "and float32 keeps half a meter; export it in local coordinates",
    )


def _doubted(camera: Camera) -> Camera:
    """The camera, with notes where its principal point, size and pixels can't well be those of one picture."""
    (c_x, c_y), (d_x, d_y), pinhole = camera.pinhole.principal_point, camera.pinhole.distance, camera.pinhole
    shape, size = pinhole.width / pinhole.height, f"{pinhole.width} × {pinhole.height}"
    if abs(d_x / d_y / shape - 1) < _SAME_SHAPE < abs(d_x / d_y - 1) / 10:
        words = "high as wide" if shape > 1 else "wide as high"
        camera = camera.noted(
            f"{camera.name} sees as far across as up in a picture of {size} pixels, which are then "
            f"{max(shape, 1 / shape):.3g} times as {words}: are they?"
        )
    if not (0 <= c_x <= pinhole.width and 0 <= c_y <= pinhole.height):
        return camera.noted(
            f"The principal point of {camera.name} lies outside of a picture of {size} pixels: is that its size?"
        )
    if max(min(c_x, pinhole.width - c_x), min(c_y, pinhole.height - c_y)) > 0.5:
        return camera
    return camera.noted(f"The principal point of {camera.name} lies in a corner of its picture: is it known?")


def _readable(camera: Camera) -> Camera:
    """The camera, whose name and notes show as they are; a picture's path that does not leads nowhere."""
    texts = (camera.name, camera.image or "", *camera.notes)
    if all(text.isprintable() and len(text) <= _LONGEST for text in texts):
        return camera
    image = camera.image if camera.image == _quoted(camera.image or "") else None
    return replace(camera, name=_quoted(camera.name), image=image, notes=tuple(map(_quoted, camera.notes)))


def _quoted(text: str) -> str:
    """The text on one line of characters that show, and not too long a one."""
    text = terminal.plain(text)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _unmirrored(camera: Camera, options: Options) -> Camera:
    if not (options.unmirrored and camera.pinhole.mirrored):
        return camera
    pinhole = camera.pinhole
    turned_over = (pinhole.width - pinhole.principal_point[0], pinhole.principal_point[1])
    return replace(camera, pinhole=replace(pinhole, mirrored=False, principal_point=turned_over)).noted(
        f"The picture of {camera.name} is mirrored, and was taken without that"
    )
