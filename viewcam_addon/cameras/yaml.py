"""The part of YAML in which OpenCV, ROS and Kalibr write cameras: keys, numbers, texts, lists; blocks by indentation or in
brackets.

What is not of it is left out, so that whoever looks for a key does not find it. Rejected: PyYAML, which refuses OpenCV's first
line and tags, and which Blender's Python has not.
"""

import contextlib
import json
import re
from typing import Any

_NO_KEY = re.compile(r"[\"'#\[\]{}]")
_BRACKET = re.compile(r"[\[\]{}]")
_QUOTED = r"""(?<![^\s\[{,:])(?:"(?:[^"\\]|\\.)*"|'[^']*')"""
_IN_QUOTES = re.compile(_QUOTED)
_COMMENT = re.compile(rf"(?P<quoted>{_QUOTED})|\s#.*$")
_ITEM = re.compile(r"(\s*)-\s+(.*)$")
_FLOW = re.compile(r"""[\[\]{},]|:(?=[\s\[\]{},"']|$)|"[^"]*"|'[^']*'|[^\s\[\]{},:"'](?:[^\[\]{},:]|:(?![\s\[\]{},"']|$))*""")
_DEEPEST = 8


def read(text: str) -> tuple[dict[str, Any], list[str]]:
    """The keys of a text and what stands there; none of what is not of this part of YAML.

    Returns the keys, of several documents all of them, and the names of those that are there twice, with other values or in
    several objects of a list.
    """
    root: dict[str, Any] = {}
    twice: list[tuple[str, Any, Any]] = []
    stack: list[tuple[int, dict[str, Any]]] = [(-1, root)]
    block: list[tuple[int, list]] = []
    listed: set[int] = set()  # holders of objects of a list, which are not told apart
    for line in _joined(text):
        match = _key(line)
        if block and (item := _ITEM.match(line)) and len(item[1]) >= block[0][0] and not match:
            _append(block, len(item[1]), item[2])
            continue
        if not match:
            continue
        indent, key, value = match
        while indent <= stack[-1][0]:
            stack.pop()
        holder, block = stack[-1][1], []
        before = holder.get(key)
        if line.lstrip().startswith("- "):
            listed.add(id(holder))
        if value:
            holder[key] = _value(value)
        elif len(stack) <= _DEEPEST:
            inner = _Block()
            holder[key] = inner
            stack.append((indent, inner))
            block = [(indent, inner.items_of_list)]
        if before is not None:
            twice.append((key, None, line) if id(holder) in listed else (key, before, holder[key]))
    return _settled_blocks(root), [key for key, *values in twice if not _are_same(*values)]


def _are_same(before: Any, after: Any) -> bool:
    settled = [_settled_blocks({"": value})[""] for value in (before, after)]
    return bool(settled[0] == settled[1])


def _append(opened: list[tuple[int, list]], indent: int, text: str) -> None:
    """Add an item to the list of its indentation; the item `- 1` opens one in it. opened : (indentation, list), outer first."""
    while len(opened) > 1 and indent < opened[-1][0]:
        opened.pop()
    while (inner := _ITEM.match(text) if text else None) and len(opened) <= _DEEPEST:
        indent += len(text) - len(inner[2])
        opened[-1][1].append([])
        opened.append((indent, opened[-1][1][-1]))
        text = inner[2]
    opened[-1][1].append(_value(text.strip()))


def _key(line: str) -> tuple[int, str, str] | None:
    """The blanks before a key, the key, and the value behind it; None if the line has no key."""
    written = line.lstrip()
    key, colon, value = written.removeprefix("- ").partition(":")
    if key[:1] in ("'", '"') and key.rstrip()[1:].endswith(key[0]):
        key = key.rstrip()[1:-1]
    if not colon or not key or _NO_KEY.search(key) or not (value[:1].isspace() or not value):
        return None
    return len(line) - len(written), key.strip(), _without_tag(value.strip())


def _settled_blocks(values: dict[str, Any]) -> dict[str, Any]:
    """The blocks as what they turned out to be: objects, or lists."""
    return {
        key: (value.items_of_list or _settled_blocks(value)) if isinstance(value, _Block) else value
        for key, value in values.items()
    }


class _Block(dict):
    """The block below a key: keys of its own, or the items of a list."""

    def __init__(self) -> None:
        super().__init__()
        self.items_of_list: list = []


def _joined(text: str) -> list[str]:
    """The lines, those of one pair of brackets in one; comments and the document's marks left out."""
    lines: list[str] = []
    parts: list[str] = []
    open_brackets = 0
    for line in text.split("\n"):
        if not line or line.startswith(("%", "---", "...")) or line.lstrip().startswith("#"):
            continue
        line = _COMMENT.sub(lambda match: match["quoted"] or "", line) if "#" in line else line
        parts.append(line if not parts else line.strip())
        if _BRACKET.search(line):
            line = _IN_QUOTES.sub("", line)
            open_brackets += line.count("[") + line.count("{") - line.count("]") - line.count("}")
        if open_brackets <= 0:
            lines.append(" ".join(parts))
            parts, open_brackets = [], 0
    return lines


def _without_tag(value: str) -> str:
    return re.sub(r"^![^\s]*\s*", "", value) if value.startswith("!") else value


def _value(text: str) -> Any:
    if text[:1] == '"' and text[1:].endswith('"'):
        with contextlib.suppress(ValueError):
            return json.loads(text, strict=False)
    if text[:1] in ("[", "{"):
        try:
            return _flow(text)
        except ValueError:
            return text
    try:
        return float(text) if "_" not in text else text.strip("\"'")
    except ValueError:
        return text.strip("\"'")


def _flow(text: str) -> Any:
    """The value of what stands in brackets, [a, b] or {a: b}, which may be nested.

    Raises ValueError if the brackets do not fit together, or are nested too deeply.
    """
    opened: list[list | dict] = []
    keys: list[str | None] = []  # for each object, the one whose value comes next
    whole: Any = None
    for token in _FLOW.findall(text):
        if whole is not None or (not opened and token not in ("[", "{")) or len(opened) > _DEEPEST:
            raise ValueError
        if token in ("[", "{"):
            opened.append([] if token == "[" else {})
            keys.append(None)
        elif token in ("]", "}"):
            value, _ = opened.pop(), keys.pop()
            if isinstance(value, list) != (token == "]"):
                raise ValueError
            if opened:
                _put(opened[-1], keys, value)
            else:
                whole = value
        elif token in (",", ":"):
            continue
        elif isinstance(opened[-1], dict) and keys[-1] is None:
            keys[-1] = token.strip("\"' ")
        else:
            _put(opened[-1], keys, _value(_without_tag(token.strip())))
    if whole is None:
        raise ValueError
    return whole


def _put(holder: list | dict, keys: list[str | None], value: Any) -> None:
    if isinstance(holder, list):
        holder.append(value)
    elif keys[-1] is None:
        raise ValueError
    else:
        holder[keys[-1]] = value
        keys[-1] = None
