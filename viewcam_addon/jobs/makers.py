"""Shots by rule: around a point, through an animation, one for each camera of the file."""

import dataclasses
import fnmatch
import math
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from .. import checks, moves
from .. import file_names as names
from ..cameras.calibration import Calibration
from ..errors import InputError
from ..pinhole import Pinhole
from .job import Job
from .lists import Problems

_MOST = 1_000_000
_RANGE = re.compile(r"([-+]?\d{1,9})\.\.([-+]?\d{1,9})", re.ASCII)


class _LazyJobs(Sequence[Job]):
    """Shots that are made when they are asked for: of a million views, one of many machines renders a few.

    make : a function: a number → its shot.
    numbers : the shots' numbers, in their order.
    """

    def __init__(self, make: Callable[[int], Job], numbers: range) -> None:
        self._make, self._numbers = make, numbers

    def __len__(self) -> int:
        return len(self._numbers)

    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return _LazyJobs(self._make, self._numbers[index])
        return self._make(self._numbers[index])


def orbit(pinhole: Pinhole, count: int) -> Sequence[Job]:
    """`count` views of the pinhole's look-at point, evenly around up from the pinhole itself on, towards u.

    The shots have the pinhole's size, principal point and mirroring and, as d, its distance in pixel widths; pixel aspect stays
    the scene's.

    Raises InputError if the count is not from 1 to a million.
    """
    count = _count(checks.whole("orbit's number of shots", count))
    beside = _beside_the_pose(pinhole)

    def view(i: int) -> Job:
        moved = moves.orbited(pinhole, math.tau * i / count, 0.0)
        name = f"orbit_{i:0{_digits(count - 1)}d}"
        return Job(name, moved.eye, moved.look_at, moved.up, moved.distance[0], **beside)

    return _LazyJobs(view, range(count))


def frames(text: str, camera: str | None = None) -> Sequence[Job]:
    """A shot of the camera at each frame of a range "A..B", both included.

    camera : its name; the scene's own at each frame where None, which markers may bind.

    Raises InputError if the text is none, runs backwards or beyond Blender's frames, or has more than a million.
    """
    match = _RANGE.fullmatch(text.strip())
    if not match:
        raise InputError(f"frames {checks.quoted(text)} are no range: write 1..250")
    first, last = int(match[1]), int(match[2])
    if first > last:
        raise InputError(f"frames {text} run backwards: write {last}..{first}")
    _count(last - first + 1)
    digits = _digits(max(abs(first), abs(last)))

    def still(frame: int) -> Job:
        return Job(f"frame_{'-' * (frame < 0)}{abs(frame):0{digits}d}", camera=camera, frame=frame)

    for end in (first, last):  # Blender's limits: what lies between them is within, too
        still(end)
    return _LazyJobs(still, range(first, last + 1))


def from_cameras(pattern: str, cameras: Iterable[str], spaces: bool = True) -> list[Job]:
    """A shot, of the camera's own name, of each camera whose name fits a pattern of *, ? and [abc]; sorted.

    Case counts on every system.

    spaces : true to keep spaces in the shots' names; else each becomes an underscore.

    Raises ShotsError if such a camera's name can't be a file's, or two would be one file; it has all of them. Raises InputError
    if no name fits.
    """
    cameras = sorted(cameras)
    chosen = [name for name in cameras if fnmatch.fnmatchcase(name, pattern)]
    if not chosen:
        raise InputError(f"no camera is called {checks.quoted(pattern)}: the file has {', '.join(cameras[:8]) or 'none'}")
    problems = Problems(f"the cameras {checks.quoted(pattern)}")
    files: dict[str, str] = {}  # one_file(name of the shot) → camera
    shots = {}
    for camera in chosen:
        name = camera if spaces else "".join("_" if character.isspace() else character for character in camera)
        with problems.caught():
            names.check("a camera", name)
        other = files.setdefault(names.one_file(name), camera)
        if camera in shots or other != camera:
            both = f"{checks.quoted(other)} and {checks.quoted(camera)}"
            problems.add(
                f"the cameras {both} would have one file, here or on another system: rename one, or list shots in a file"
            )
        shots[camera] = name
    problems.raise_any()
    return [Job(name, camera=camera) for camera, name in shots.items()]


def from_pinholes(pinholes: Iterable[tuple[str, Pinhole]]) -> list[Job]:
    """A shot of each named pinhole, with its size, principal point, pixel aspect and mirroring.

    Names that can't be a file's are made so: what may not stand in them is an underscore, and a number tells two apart.

    Raises ShotsError if a camera is beyond Blender's limits; it has all of them.
    """
    problems = Problems("the cameras")
    pinholes = [*pinholes]
    shots: list[Job] = []
    for name, (_, pinhole) in zip(names.distinct(camera for camera, _ in pinholes), pinholes, strict=True):
        d_x, d_y = pinhole.distance
        pose = pinhole.eye, pinhole.look_at, pinhole.up, d_x
        with problems.caught():
            shots.append(Job(name, *pose, pixel_aspect=d_y / d_x, **_beside_the_pose(pinhole)))
    problems.raise_any()
    return shots


def calibrated(job: Job, calibration: Calibration, pose: Pinhole | None = None) -> Job:
    """The job of a pinhole in the place of another job's, whose picture covers that of a calibrated camera.

    pose : the place of the other job's camera, where that is one of the file and the values are wanted.
    """
    cover = calibration.cover
    values: dict[str, Any] = {"calibration": calibration, "width": cover.width, "height": cover.height}
    if pose is not None:
        values |= {"camera": None, "eye": pose.eye, "look_at": pose.look_at, "up": pose.up, "mirrored": pose.mirrored or None}
    if pose is not None or job.eye is not None:
        values |= {"d": cover.distance[0], "principal_point": cover.principal_point, "pixel_aspect": 1.0}
    return dataclasses.replace(job, **values)


def _beside_the_pose(pinhole: Pinhole) -> dict[str, Any]:
    """The fields of a Job that a pinhole has beside eye, look-at, up and distance."""
    middle = (pinhole.width / 2, pinhole.height / 2)
    return {
        "width": pinhole.width,
        "height": pinhole.height,
        "principal_point": None if pinhole.principal_point == middle else pinhole.principal_point,
        "mirrored": pinhole.mirrored or None,
    }


def _count(count: int) -> int:
    if count > _MOST:
        raise InputError(f"these are {count} shots: make at most {_MOST} at a time")
    return count


def _digits(largest: int) -> int:
    """The digits of the numbers in names, so that files sort as these do."""
    return max(3, len(str(largest)))
