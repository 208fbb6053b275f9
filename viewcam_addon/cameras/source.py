"""Sources that cameras are read from: a text, a file or a folder, and safe ways into JSON, XML and YAML.

Each is parsed once, whoever asks. JSON may have comments, as instant-ngp's has; keys that appear twice are refused, since
nobody knows which counts. XML is read without a document type, entities or anything outside, and no deeper than 100 elements:
what attacks XML parsers needs one of these. Of an NPZ the small arrays of numbers are read, without pickle.
"""

import codecs
import contextlib
import io
import json
import re
import struct
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from .. import checks, npy
from ..errors import InputError, counted
from ..files import read_bytes
from . import yaml

_MOST_BYTES = 2**30
_DEEPEST = 100
_MOST_BYTES_OF_ARRAY, _MOST_ARRAYS = 2**16, 1000
_STRING = r'"[^"\\]*(?:\\.[^"\\]*)*"?'
_COMMENT = re.compile(rf"{_STRING}|//[^\n]*|/\*.*?(?P<end>\*/|\Z)", re.DOTALL)
_LIKE_INI = re.compile(r"\[[A-Za-z][\w ./-]{0,60}\][ \t]*\n")
_LIKE_XML = re.compile(r"\s*<[?!A-Za-z]")
_TRAILING_COMMA = re.compile(rf"{_STRING}|,(?=\s*[\]}}])", re.DOTALL)
_XML_DECLARATION = re.compile(rb"\s*<\?xml\s[^>]{0,200}\bencoding\s*=\s*[\"']([^\"'>]{0,40})[\"']")
_ENCODINGS = {  # as Python calls them
    *("utf-8", "utf-16", "utf-16-le", "utf-16-be", "ascii", "koi8-r", "koi8-u"),
    *(f"iso8859-{part}" for part in range(1, 17)),
    *(f"cp{page}" for page in range(1250, 1259)),
    *("shift_jis", "cp932", "euc_jp", "euc_kr", "cp949", "gb2312", "gbk", "gb18030", "big5"),
}
_UTF_16 = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"<\0?\0": "utf-16-le", b"\0<\0?": "utf-16-be"}
"""The beginnings of texts in UTF-16: a byte order mark, or XML's declaration without one."""


class Source:
    """A source of cameras: `path` of a file or folder, or None for a text; `data`, its bytes; `text`, its characters.

    `parsed` is for formats whose content takes its time: what one has made of it, by its title.

    content : a text or its bytes, the Path of a file or folder, or the files of a folder by their names.
    """

    def __init__(self, content: "str | bytes | Path | Mapping[str, str | bytes]") -> None:
        self.path = content if isinstance(content, Path) else None
        self._content = content
        self.parsed: dict[str, Any] = {}

    @property
    def name(self) -> str:
        """The name that a sentence calls it by."""
        return str(self.path) if self.path else "the text"

    @cached_property
    def is_folder(self) -> bool:
        return self.path.is_dir() if self.path else isinstance(self._content, Mapping)

    @cached_property
    def data(self) -> bytes:
        """The bytes; none of a folder. Raises InputError if the file can't be read."""
        if self.is_folder:
            return b""
        if self.path is None:
            text: Any = self._content
            return text if isinstance(text, bytes) else text.encode("utf-8", errors="replace")
        try:
            if self.path.stat().st_size > _MOST_BYTES:
                raise InputError(f"{self.path} is larger than {_MOST_BYTES >> 20} MiB: give the file of the cameras alone")
            return read_bytes(self.path)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"{self.path} can't be read ({reason}): check its name and permissions") from None

    @cached_property
    def is_binary(self) -> bool:
        return b"\0" in self.data[:4096].rstrip(b"\0") and not self._utf_16

    @property
    def _utf_16(self) -> str | None:
        """The kind of UTF-16 that this is; None if it is none."""
        return next((name for mark, name in _UTF_16.items() if self.data.startswith(mark)), None)

    @cached_property
    def text(self) -> str:
        """The characters, with plain line ends; empty if these are no characters."""
        if self.is_binary:
            return ""
        encoding = self._encoding[0]
        return self.data.decode(encoding, errors="replace").replace("\r\n", "\n").replace("\r", "\n")

    @cached_property
    def _encoding(self) -> tuple[str, str]:
        """The encoding of the characters, and what is wrong with what an XML file says of that."""
        data, utf_16 = self.data, self._utf_16
        usual = utf_16 or "utf-8-sig"
        head = data[:1024].decode(utf_16, errors="ignore").encode("ascii", errors="ignore") if utf_16 else data[:1024]
        declared = _XML_DECLARATION.match(head.removeprefix(b"\xef\xbb\xbf"))
        if isinstance(self._content, str) or not declared:
            return usual, ""
        name = declared[1].decode("ascii", errors="replace")
        advice = "save it in UTF-8 and let it say so"
        try:
            encoding = codecs.lookup(name).name
        except (LookupError, ValueError):
            encoding = ""
        if encoding not in _ENCODINGS:
            return usual, f"{self.name} says that its encoding is {checks.quoted(name)}, which is unknown: {advice}"
        contradicts = f"{self.name} says that its encoding is {checks.quoted(name)} and is not written in it: {advice}"
        if bool(utf_16) != encoding.startswith("utf-16"):
            return usual, contradicts
        encoding = usual if encoding in ("utf-8", "utf-16", "utf-16-le", "utf-16-be") else encoding
        try:
            data.decode(encoding)
        except UnicodeDecodeError:
            return usual, contradicts
        return encoding, ""

    @cached_property
    def _json(self) -> tuple[Any, str]:
        text = self.text.strip().rstrip("\0")  # Azure Kinect's ends as a text of C
        if text[:1] not in ("{", "[") or _LIKE_INI.match(text):
            return None, ""
        problem = ""
        attempts: tuple[Callable[[], str], ...] = (lambda: text, lambda: _without_comments(text))
        for attempt in attempts:
            try:
                whole: Any = checks.whole_of_json  # floats of many digits, too
                document = json.loads(attempt(), object_pairs_hook=_unique, parse_int=whole, parse_constant=_not_finite)
                return document, ""
            except json.JSONDecodeError as error:
                problem = f"line {error.lineno}, column {error.colno}: {error.msg}"
            except RecursionError:
                problem = "its brackets are nested too deeply"
        return None, problem

    @property
    def json(self) -> Any:
        """The JSON value, or None if this is no JSON. Raises InputError if a key is there twice, or a number is none."""
        return self._json[0]

    @property
    def json_problem(self) -> str:
        """The reason that something that looks like JSON is none, or nothing."""
        return self._json[1]

    @property
    def problem(self) -> str:
        """The sentence on a text that looks like JSON or XML by how it begins, and is none; nothing if it is all right."""
        if self.json_problem:
            return f"looks like JSON and is none ({self.json_problem}): correct it"
        if self.path and _LIKE_XML.match(self.text) and self.xml is None:
            return f"looks like XML and is none ({self._xml[1]}): correct it"
        return ""

    @cached_property
    def document(self) -> Mapping[str, Any]:
        """The JSON object; empty if this is none."""
        return self.json if isinstance(self.json, dict) else {}

    @cached_property
    def xml(self) -> ElementTree.Element | None:
        """The XML's first element, or None if this is no XML.

        Raises InputError if it has a document type or entities of its own, is nested too deeply, or is not written as it says.
        """
        if not self.text.lstrip().startswith("<"):
            return None
        if self._encoding[1]:
            raise InputError(self._encoding[1])
        return self._xml[0]

    @cached_property
    def _xml(self) -> tuple[ElementTree.Element | None, str]:
        return _parsed_xml(self.text.strip())

    @cached_property
    def yaml(self) -> dict[str, Any]:
        """The keys of the part of YAML in which cameras are written."""
        return self._yaml[0]

    @property
    def yaml_twice(self) -> list[str]:
        """The keys of that which are there twice, with other values."""
        return self._yaml[1]

    @cached_property
    def _yaml(self) -> tuple[dict[str, Any], list[str]]:
        return yaml.read(self.text)

    @cached_property
    def npy(self) -> np.ndarray | None:
        """The array of an NPY; None if this is none of numbers."""
        if not self.data.startswith(b"\x93NUMPY"):
            return None
        try:
            return npy.read(self.data)
        except ValueError:
            return None

    @cached_property
    def npz(self) -> dict[str, np.ndarray]:
        """The arrays of an NPZ by their names, of those as small as a camera's are; none if this is no NPZ."""
        result: dict[str, np.ndarray] = {}
        if self.data[:4] != b"PK\x03\x04":
            return result
        try:
            with zipfile.ZipFile(io.BytesIO(self.data)) as archive:
                for name, member in npy.members(archive).items():
                    if member.file_size < _MOST_BYTES_OF_ARRAY and len(result) < _MOST_ARRAYS:
                        with contextlib.suppress(ValueError), archive.open(member) as file:
                            result[name] = npy.read(file.read(member.file_size))  # and no more, whatever is packed there
        except (ValueError, OSError, EOFError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error):
            return {}
        return result

    def file(self, *parts: str) -> "Source | None":
        """The file of that name in the folder, or beside this file; None if there is none."""
        if self.path is None:
            held = self._content.get("/".join(parts)) if isinstance(self._content, Mapping) else None
            return None if held is None else Source(held)
        path = (self.path if self.is_folder else self.path.parent).joinpath(*parts)
        try:
            return Source(path) if path.is_file() else None
        except (OSError, ValueError):
            return None

    def files(self, pattern: str) -> Iterator["Source"]:
        """The files of the folder that fit a pattern, sorted."""
        for path in sorted(self.path.glob(pattern)) if self.path and self.is_folder else ():
            if path.is_file():
                yield Source(path)


class Record:
    """A JSON object whose values are checked where they are taken.

    place : its name in sentences ("frame 3").
    """

    def __init__(self, values: object, place: str) -> None:
        if not isinstance(values, dict):
            raise InputError(f"{place} is {checks.quoted(values)}: it should be an object with keys")
        self.values, self.place = values, place

    def __contains__(self, key: str) -> bool:
        return self.values.get(key) is not None

    def get(self, key: str) -> Any:
        """The value as it is, None if there is none."""
        return self.values.get(key)

    def called(self, key: str) -> str:
        return f"{key} of {self.place}"

    def needed(self, key: str) -> Any:
        if key not in self:
            raise InputError(f"{self.place} has no {key}: it can't be a camera without")
        return self.values[key]

    def number(self, key: str, default: float | None = None, least: float = -1e300, most: float = 1e300) -> float:
        """A finite number, which may be written as a text. Without a default it must be there."""
        if key not in self and default is not None:
            return default
        return number(self.called(key), self.needed(key), least, most)

    def size(self, *keys: str) -> int:
        """A whole number of pixels; the first of the keys that is there."""
        key = next((key for key in keys if key in self), keys[0])
        return pixels(self.called(key), self.needed(key))

    def text(self, key: str, default: str | None = None) -> str:
        value = self.values.get(key, default)
        if not isinstance(value, str):
            raise InputError(f"{self.called(key)} is {checks.quoted(value)}: it should be a text")
        return value

    def numbers(self, key: str, count: int) -> tuple[float, ...]:
        """So many numbers, in whatever nesting."""
        result = flat(self.called(key), self.needed(key))
        if len(result) != count:
            raise InputError(f"{self.called(key)} has {counted(len(result), 'number')}: it should have {count}")
        return result

    def record(self, key: str) -> "Record":
        return Record(self.needed(key), self.called(key))

    def records(self, key: str, kind: str) -> list["Record"]:
        """The objects of a list, or of an object by their keys.

        kind : the name of one of them in sentences ("frame").
        """
        values = self.values.get(key)
        if isinstance(values, dict):
            return [Record(value, f"{kind} {checks.quoted(name)}") for name, value in values.items()]
        if not isinstance(values, list):
            raise InputError(f"{self.called(key)} is {checks.quoted(values)}: it should be a list")
        return [Record(value, f"{kind} {number}") for number, value in enumerate(values)]


def number(name: str, value: object, least: float = -1e300, most: float = 1e300) -> float:
    """A finite number, also out of a text."""
    if isinstance(value, str) and len(value) < 400:
        try:
            if "_" in value:
                raise ValueError
            value = float(value)
        except ValueError:
            raise InputError(f"{name} is {checks.quoted(value)}: give a number") from None
    return checks.number(name, value, least, most)


def pixels(name: str, value: object) -> int:
    """A whole number ≥ 1 of pixels, also out of a text or a float."""
    size = number(name, value, 1.0, checks.LARGEST_WHOLE)
    if not size.is_integer():
        raise InputError(f"{name} is {size:g}: give whole pixels")
    return int(size)


def flat(name: str, value: object) -> tuple[float, ...]:
    """All numbers of a list of lists, also out of a text that separates them by blanks, commas or semicolons."""
    if isinstance(value, str):
        value = re.split(r"[\s,;]+", value.strip())
    if not isinstance(value, list | tuple):
        raise InputError(f"{name} is {checks.quoted(value)}: give a list of numbers")
    result: list[float] = []
    for item in value:
        result += flat(name, item) if isinstance(item, list) else [number(name, item)]
    return tuple(result)


def numbered_lines(source: Source) -> list[tuple[int, str]]:
    """The lines that are neither empty nor comments, with their numbers from 1."""
    lines = enumerate((line.strip() for line in source.text.split("\n")), start=1)
    return [(number, line) for number, line in lines if line and not line.startswith("#")]


def table(name: str, lines: Sequence[tuple[int, str]]) -> np.ndarray:
    """(n, m) finite: the numbers of lines that have as many each, separated by blanks or commas.

    name : the file's. At once, which is twenty times as fast as one by one, unless one is to be told of.

    Raises InputError of the first line that is none.
    """
    try:
        result = (
            np.loadtxt([line.replace(",", " ") for _, line in lines], comments=None, ndmin=2) if lines else np.zeros((0, 0))
        )
        if np.isfinite(result).all():
            return result
    except ValueError:
        pass
    rows: list[tuple[float, ...]] = []
    for number, line in lines:
        rows.append(flat(f"line {number} of {name}", line.rstrip(",")))
        if len(rows[-1]) != len(rows[0]):
            has = counted(len(rows[-1]), "number")
            raise InputError(f"line {number} of {name} has {has} and others have {len(rows[0])}: correct it")
    return np.array(rows)


def image_size(path: Path) -> tuple[int, int] | None:
    """(width, height) of a PNG or JPEG, from its head; None if it is none or is not there."""
    try:
        if not path.is_file():
            return None
        with path.open("rb") as file:
            return _size_in(file.read(2**18))
    except (OSError, ValueError):
        return None


def _size_in(head: bytes) -> tuple[int, int] | None:
    if head.startswith(b"\x89PNG\r\n\x1a\n") and len(head) >= 24:
        return struct.unpack(">II", head[16:24])
    at = 2
    while head.startswith(b"\xff\xd8") and at + 9 <= len(head) and head[at] == 0xFF:
        marker, length = head[at + 1], struct.unpack(">H", head[at + 2 : at + 4])[0]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", head[at + 5 : at + 9])
            return (width, height)
        at += 2 + length
    return None


def _without_comments(text: str) -> str:
    text = _COMMENT.sub(lambda match: match[0] if match[0][0] == '"' or match["end"] == "" else " ", text)
    return _TRAILING_COMMA.sub(lambda match: match[0] if match[0][0] == '"' else " ", text)


def _unique(pairs: list[tuple[str, object]]) -> dict:
    result = dict(pairs)
    if len(result) < len(pairs):
        twice, _ = Counter(key for key, _ in pairs).most_common(1)[0]
        raise InputError(f"the key {checks.quoted(twice)} is given twice: leave one out")
    return result


def _not_finite(name: str) -> float:
    return float(name.replace("Infinity", "inf"))  # refused where a number is wanted


def _parsed_xml(text: str) -> tuple[ElementTree.Element | None, str]:
    """The first element, or None and the reason."""
    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate("utf-8", namespace_separator="}")
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise InputError(f"the XML is nested more than {_DEEPEST} elements deep: give the file of the cameras alone")
        builder.start(_local(tag), {_local(key): value for key, value in attributes.items()})

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(_local(tag))

    def refuse(*_: object) -> Any:
        raise InputError("the XML declares entities of its own: take them out, none is read")

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, builder.data
    parser.EntityDeclHandler = parser.UnparsedEntityDeclHandler = parser.ExternalEntityRefHandler = refuse
    parser.buffer_text = True
    try:
        parser.Parse(text.encode("utf-8", errors="replace"), True)  # whatever its declaration says
        return builder.close(), ""
    except expat.ExpatError as error:
        return None, f"line {error.lineno}, column {error.offset + 1}: {expat.ErrorString(error.code)}"
    except AssertionError:
        return None, "it ends too early"


def _local(tag: str) -> str:
    """The name without its namespace."""
    return tag.rpartition("}")[2]
