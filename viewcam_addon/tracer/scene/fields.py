"""A value of a JSON file that knows where it stands, so that what is wrong with it can be said in one sentence.

Rejected: a JSON schema (another dependency, and its messages speak of the schema instead of the file), and checks that are
gathered at the end (the first wrong key usually explains the others).
"""

import contextlib
import json
import math
import os
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np
from numpy.typing import NDArray

from ... import checks, machine, npy
from ...errors import InputError

Result = TypeVar("Result")

_LARGEST_WHOLE = 2**31 - 1

# Deflate's longest match has 258 bytes and takes 2 bits (zlib's technical details): 1032 to 1.
_MOST_UNPACKED = 1032
# An array is read and then converted to the type that the tracer takes, while it is still there.
_COPIES = 2


class Field:
    """A value, its name as a sentence says it ("eye of the camera") and the file that it comes from."""

    def __init__(self, value: Any, name: str, file: str) -> None:
        self.value, self.name, self.file = value, name, file

    def fail(self, problem: str) -> NoReturn:
        """Raise InputError: the file, the name of this value, the problem (which begins with a verb)."""
        raise InputError(f"{self.file}: {self.name} {problem}")

    def hand_on(self, error: InputError) -> NoReturn:
        """Raise what was found wrong inside this value, with the file and the name unless it names them already."""
        if str(error).startswith(f"{self.file}: "):
            raise error
        raise InputError(f"{self.file}: {self.name}: {error}") from error

    def build(self, kind: Callable[..., Result], *arguments: Any, **values: Any) -> Result:
        """The result of `kind` with what this value says; an InputError there is raised as `hand_on` does."""
        try:
            return kind(*arguments, **values)
        except InputError as error:
            self.hand_on(error)

    def fields(self, required: tuple[str, ...], optional: tuple[str, ...] = (), others: bool = False) -> dict[str, "Field"]:
        """The values of an object's keys. All required ones must be there and, unless others=True, only known ones."""
        table = self._object()
        for key in required:
            if key not in table:
                self.fail(f"has no key {checks.quoted(key)}: add it")
        unknown = None if others else next((key for key in table if key not in required + optional), None)
        if unknown is not None:
            self.fail(
                f"has an unknown key {checks.quoted(unknown)}: remove it, or give one of {', '.join(required + optional)}"
            )
        return {key: Field(value, f"{checks.quoted(key)} of {self.name}", self.file) for key, value in table.items()}

    def named(self, kind: str) -> dict[str, "Field"]:
        """The values of an object whose keys are names of things of this kind."""
        return {key: Field(value, f"{kind} {checks.quoted(key)}", self.file) for key, value in self._object().items()}

    def items(self, kind: str, count: int | None = None) -> list["Field"]:
        """The values of a list of things of this kind, called by their name where they have one."""
        if not isinstance(self.value, list) or count not in (None, len(self.value)):
            self.fail(f"is no list{f' of {count}' if count else ''}: give one")
        return [Field(value, _name(kind, index, value, self), self.file) for index, value in enumerate(self.value)]

    def text(self) -> str:
        if not isinstance(self.value, str):
            self.fail(f"is {_quoted(self.value)}: give a text")
        return self.value

    def truth(self) -> bool:
        if not isinstance(self.value, bool):
            self.fail(f"is {_quoted(self.value)}: give true or false")
        return self.value

    def number(self) -> float:
        if not _is_number(self.value):
            self.fail(f"is {_quoted(self.value)}: give a finite number")
        return float(self.value)

    def whole(self, least: int) -> int:
        if type(self.value) is not int or not least <= self.value <= _LARGEST_WHOLE:
            self.fail(f"is {_quoted(self.value)}: give a whole number of at least {least}")
        return self.value

    def vector(self, count: int) -> tuple[Any, ...]:
        if not isinstance(self.value, list) or len(self.value) != count or not all(map(_is_number, self.value)):
            self.fail(f"is {_quoted(self.value)}: give a list of {count} finite numbers")
        return tuple(map(float, self.value))

    def array(
        self, arrays: "Arrays | None", dtype: Any, shape: tuple[int | None, ...], kept: Sequence[np.dtype] = ()
    ) -> NDArray:
        """A list of lists of numbers, or {"npz": key} where `arrays` are given; None in the shape stands for any number.

        kept : other types than `dtype` that an array in the .npz may have.
        """
        if arrays is not None and isinstance(self.value, dict):
            array = arrays.take(self.fields(("npz",))["npz"])
            stored = array.dtype.newbyteorder("=")
            dtype = stored if stored in kept else dtype
        else:
            array = self._nested(len(shape))
        if np.issubdtype(dtype, np.integer) and dtype not in kept:
            if array.dtype.kind not in "iu" and array.size:
                self.fail("holds numbers that are not whole: give whole ones")
            if array.size and not -_LARGEST_WHOLE <= array.min() <= array.max() <= _LARGEST_WHOLE:
                self.fail(f"holds a number beyond {_LARGEST_WHOLE}: give smaller ones")
        if array.size == 0 and shape[0] in (None, 0):
            array = array.reshape(0, *(size or 0 for size in shape[1:]))
        if array.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, array.shape, strict=True)):
            wanted = " × ".join("n" if size is None else str(size) for size in shape)
            self.fail(f"has the shape {' × '.join(map(str, array.shape))} and must have {wanted}: correct it")
        with np.errstate(over="ignore"):  # too large a number for float32 becomes infinite, and is refused here
            array = array.astype(dtype, copy=False)
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            self.fail("holds a number that is not finite: give finite ones")
        return array

    def _object(self) -> dict:
        if not isinstance(self.value, dict):
            self.fail(f"is {_quoted(self.value)}: give an object with keys")
        return self.value

    def _nested(self, depth: int) -> NDArray:
        """The array of nested lists."""
        level = [self.value]
        for _ in range(depth):
            if not all(isinstance(item, list) for item in level) or len({len(item) for item in level}) > 1:
                self.fail(f"is no list{' of equally long lists' * (depth > 1)}: give one")
            level = [value for item in level for value in item]
        if not all(map(_is_number, level)):
            self.fail("holds something that is no finite number: give numbers only")
        whole = all(type(value) is int and abs(value) <= _LARGEST_WHOLE for value in level)
        return np.array(self.value, dtype=np.int64 if whole else np.float64)


class Arrays:
    """The arrays of the .npz beside a scene file; none where the scene names no such file.

    Nothing is allocated for an array before its size is known to be true: what its header says against what its archive says
    it unpacks to, this against the most that the packed bytes can hold, and all arrays together against the memory that there
    is. NumPy's own reader of archives is not used, since it allocates what a header says.
    """

    def __init__(self, file: str = "", archive: zipfile.ZipFile | None = None) -> None:
        self._file, self._archive = file, archive
        self._members = {} if archive is None else npy.members(archive)
        self._taken: dict[str, NDArray] = {}

    def take(self, key: Field) -> NDArray:
        """The array of this key, of real numbers; the same one each time."""
        if self._archive is None:
            key.fail("names an array, and the scene has no key 'arrays': add it, with the name of the .npz file")
        name = key.text()
        if name not in self._members:
            key.fail(f"is {checks.quoted(name)}, which {self._file} does not hold: export the scene again")
        if name not in self._taken:
            self._taken[name] = self._read(name)
        array = self._taken[name]
        if array.dtype.kind not in "iuf":
            key.fail(f"names an array of {array.dtype}: store real numbers")
        return array

    def _read(self, name: str) -> NDArray:
        damaged = f"{self._file}: the array {checks.quoted(name)} is damaged: export the scene again"
        member = self._members[name]
        assert self._archive is not None and self._archive.fp is not None
        try:
            with self._archive.open(member) as file:
                dtype, size = npy.header(file)
                if dtype.hasobject:
                    raise InputError(f"{self._file}: the array {checks.quoted(name)} holds pickled objects: store numbers")
                packed = min(member.compress_size, os.fstat(self._archive.fp.fileno()).st_size)
                if file.tell() + size != member.file_size or member.file_size > packed * _MOST_UNPACKED:
                    raise InputError(damaged)
            together = size + sum(array.nbytes for array in self._taken.values())
            machine.check(f"the arrays of {self._file}", _COPIES * together, "make the scene smaller")
            with self._archive.open(member) as file:
                return np.lib.format.read_array(file, allow_pickle=False)  # type: ignore[no-untyped-call] # no type in NumPy
        except (
            OSError,
            ValueError,
            EOFError,
            NotImplementedError,
            OverflowError,
            RuntimeError,
            zipfile.BadZipFile,
            zlib.error,
        ) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(damaged) from error


@contextlib.contextmanager
def arrays_beside(scene_path: Path, field: Field | None) -> Iterator[Arrays]:
    """Open the .npz that the field names, for the time of the block."""
    if field is None:
        yield Arrays()
        return
    path = _beside(scene_path, field)
    refusal = f"{checks.quoted(path.name)} is no .npz file of arrays: export the scene again"
    with contextlib.ExitStack() as opened:
        try:
            if path.exists() and not path.is_file():
                raise InputError(refusal)
            archive = Arrays(path.name, opened.enter_context(zipfile.ZipFile(path)))
        except FileNotFoundError:
            field.fail(f"names {checks.quoted(path.name)}, which is not there: put it beside the scene file")
        except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile) as error:
            raise InputError(refusal) from error
        yield archive


def _beside(scene_path: Path, field: Field) -> Path:
    """The path of a file in the scene file's own folder."""
    folder = scene_path.resolve().parent
    path = folder / field.text()
    try:
        inside = "\0" not in field.value and path.resolve().parent == folder and path.name == field.value
    except (OSError, ValueError):  # too long for the system to tell
        inside = False
    if not inside:
        field.fail(f"is {checks.quoted(field.value)}, which leaves the scene file's folder: give the name of a file in it")
    return path


def _name(kind: str, index: int, value: object, parent: Field) -> str:
    name = value.get("name", value.get("object")) if isinstance(value, dict) else None
    return f"{kind} {checks.quoted(name)}" if isinstance(name, str) else f"{kind} {index} of {parent.name}"


def _is_number(value: object) -> bool:
    if type(value) is int:
        return abs(value) <= 2**1000
    return type(value) is float and math.isfinite(value)


def _quoted(value: object) -> str:
    if isinstance(value, list | dict):
        return "a list" if isinstance(value, list) else "an object"
    return json.dumps(value) if value is None or isinstance(value, bool) else checks.quoted(value)


PLACE_KEYS = ("matrix", "location", "rotation", "scale")
"""The place of something: a matrix, or what a hand writes instead of one."""


def matrix(field: Field, keys: dict[str, Field]) -> NDArray[np.float64]:
    """(4, 4), to world space: that of `keys`, or of a location, a rotation (degrees about x, then y, then z) and a scale (one
    number, or one for each axis).

    field : the placed object's field.
    """
    if "matrix" not in keys:
        return _placed(keys)
    if any(key in keys for key in PLACE_KEYS[1:]):
        field.fail("has a matrix beside a location, rotation or scale: give one or the other")
    return keys["matrix"].array(None, np.float64, (4, 4))


def rotated(angles: Sequence[float] | NDArray) -> NDArray[np.float64]:
    """(3, 3): a rotation by angles in radians about x, then y, then z."""
    x, y, z = angles
    about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _placed(keys: dict[str, Field]) -> NDArray[np.float64]:
    rotation = rotated(np.radians(keys["rotation"].vector(3) if "rotation" in keys else (0.0, 0.0, 0.0)))
    scale: float | tuple[float, ...] = 1.0
    if "scale" in keys:
        scale = keys["scale"].vector(3) if isinstance(keys["scale"].value, list) else keys["scale"].number()
    placed = np.eye(4)
    placed[:3, :3] = rotation * scale
    placed[:3, 3] = keys["location"].vector(3) if "location" in keys else 0.0
    return placed
