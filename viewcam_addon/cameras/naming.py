"""Names: of cameras that have only a picture's path, and of the pictures that datasets name, and where these are.

A picture is looked for by its name beside the file and in the folders where data sets keep theirs. Rejected: paths that lead
elsewhere, since a file from anybody should make a program open nothing of whoever reads it, and no share of the network.
"""

import contextlib
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path, PurePosixPath, PureWindowsPath

from .. import checks, file_names
from ..errors import InputError, several
from .camera import Camera

_PLACES = (".", "images", "..", "../images", "../..", "../../images")
_SUFFIXES = ("", ".png", ".jpg", ".jpeg", ".JPG", ".PNG")
_PICTURES = (
    ".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff", ".webp", ".bmp", ".hdr", ".tga", ".ppm", ".pgm", ".heic", ".dng",
    ".avif",
)  # fmt: skip


def stem(path: str) -> str:
    """The picture's name without folders and the suffix of a picture, if it has one."""
    name = path.replace("\\", "/").rstrip("/").rpartition("/")[2]
    suffix = PurePosixPath(name).suffix
    return name[: -len(suffix)] if suffix.lower() in _PICTURES and len(suffix) < len(name) else name


def has_suffix(path: str) -> bool:
    """True if the path ends as a picture's does."""
    return PurePosixPath(path).suffix.lower() in _PICTURES


def distinct(paths: Sequence[str]) -> list[str]:
    """A name for each picture: its stem, or where two would be called alike its path, or that and its number."""
    stems = [stem(path) for path in paths]
    twice = {name for name, count in Counter(stems).items() if count > 1 or not name}
    return numbered([path if name in twice else name for path, name in zip(paths, stems, strict=True)])


def numbered(names: Sequence[str]) -> list[str]:
    """The names, from the second one of a name on with a number."""
    seen: Counter[str] = Counter()
    result = []
    for name in names:
        seen[name] += 1
        result.append(name if seen[name] == 1 and name else f"{name} #{seen[name]}".strip())
    return result


def image_of(camera: Camera) -> str:
    """The path by which a dataset names the camera's picture: the file's own inside its folder, or its name alone."""
    if camera.image is None:
        return f"{camera.name}.png"
    return inside(camera.image)


def inside(path: str) -> str:
    """A path that stays inside its folder: the path itself, or the name alone of one that leads elsewhere."""
    while path.startswith("./"):
        path = path[2:]
    return path.rpartition("/")[2] if path.startswith("/") or ".." in path.split("/") or ":" in path else path


def picture_of(camera: Camera, folder: Path) -> Path | None:
    """The file of a camera's picture, or None where there is none near the camera's own file.

    folder : the folder of the camera's own file.
    """
    return near(image_of(camera) if camera.image is None else camera.image, folder)


def near(path: str, folder: Path) -> Path | None:
    """The file that a data set's file names by a path, or None where there is none near it.

    folder : the folder of the data set's file.
    """
    path = inside(path.replace("\\", "/"))
    for name in dict.fromkeys((path, path.rpartition("/")[2])):
        for place in _PLACES:
            for suffix in _SUFFIXES:
                with contextlib.suppress(OSError, ValueError):  # a name that no file can have
                    if name and (file := folder / place / f"{name}{suffix}").is_file():
                        return file.resolve()
    return None


def in_order(folder: Path | None, places: Sequence[str], count: int) -> list[str]:
    """The paths of a data set's pictures in the order of their names, from the first of these folders that has so many of them;
    none where there is no such folder."""
    for place in places:
        if folder and (folder / place).is_dir():
            names = sorted(each.name for each in (folder / place).iterdir() if has_suffix(each.name))
            if len(names) == count:
                return [f"{place}/{each}" for each in names]
    return []


def check_image(file: object) -> None:
    """Refuse a path by which no dataset can name a picture.

    Raises InputError if it leaves its folder, or is no line of text.
    """
    is_line = isinstance(file, str) and not any(map(_is_unseen, file)) and "\\" not in file
    if not is_line or PureWindowsPath(str(file)).drive or {"", ".", ".."} & set(str(file).split("/")):
        raise InputError(
            f"file is {checks.quoted(file)}: give the picture's path inside the folder of the batch, as in images/left.png"
        )


def checked(cameras: Iterable[Camera], written: str) -> tuple[Camera, ...]:
    """The cameras, if a dataset can be made of them.

    written : the dataset, as a sentence names it.

    Raises InputError if there are none, if two have one picture or one has none that can be named, or if a camera is mirrored,
    since a rotation can't say that.
    """
    cameras = tuple(cameras)
    if not cameras:
        raise InputError(f"there is no picture for {written}: give one at least")
    for camera in cameras:
        check_image(image_of(camera))
    twice = [file for file, count in Counter(map(image_of, cameras)).items() if count > 1]
    if twice:
        raise InputError(f"{several(twice)} would be several pictures of {written}: give each a file of its own")
    refuse_mirrored(cameras, written)
    return cameras


def a_file_each(cameras: Sequence[Camera], suffix: str, text: Callable[[Camera], str]) -> str | dict[str, str]:
    """The result of `write` in a format whose files have one camera: its text, or of several the files, called as the cameras.

    text : the function that makes it. It says the camera's name, which the file's need not be.
    """
    if len(cameras) == 1:
        return text(cameras[0])
    return files(cameras, suffix, text)


def files(cameras: Sequence[Camera], suffix: str, text: Callable[[Camera], str]) -> dict[str, str]:
    """The files of a camera each, called as these, by their names. text : as `a_file_each` has it."""
    return {
        f"{name}{suffix}": text(each) for name, each in zip(file_names.distinct(c.name for c in cameras), cameras, strict=True)
    }


def refuse_mirrored(cameras: Iterable[Camera], written: str) -> None:
    """Raise InputError if a camera is mirrored and `written` can't say it."""
    mirrored = [image_of(camera) for camera in cameras if camera.pinhole.mirrored]
    if mirrored:
        raise InputError(f"{written} can't say that a camera is mirrored, as in {several(mirrored)}: make its scale positive")


def refuse_shifted(cameras: Iterable[Camera], written: str, square: bool) -> None:
    """Raise InputError if a camera's principal point is not the middle, or, if `square`, its pixels are not square.

    written : the format that can't say it, as a sentence names it.
    """
    for camera in cameras:
        pinhole = camera.pinhole
        if pinhole.principal_point != (pinhole.width / 2, pinhole.height / 2):
            raise InputError(f"{written} can't say that a camera is shifted, as {checks.quoted(camera.name)} is")
        if square and pinhole.distance[0] != pinhole.distance[1]:
            raise InputError(f"{written} has square pixels, and those of {checks.quoted(camera.name)} are none")


def _is_unseen(character: str) -> bool:
    """True if it is no character of a line of text: a control or format character, half of one, or a line's end."""
    category = unicodedata.category(character)
    return category[0] == "C" or category in ("Zl", "Zp")
