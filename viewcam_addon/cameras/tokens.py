"""The tokens of programs and scenes, in any language: names, numbers, signs and strings.

Each is found by one pass that never goes back over what it has read, so that a text takes time by its length, whatever it
holds. A name holds no dots and a number holds all letters that stand at it, so that 4.2.1 and 3abc are one token each, and no
value. Rejected: a parser for each language, and possessive quantifiers (x++), which CPython 3.11.0 to 3.11.4 match wrongly
where the repeated part holds others.
"""

import math
import re
from collections.abc import Iterator
from typing import NamedTuple

_TOKEN = re.compile(
    r"\s*(?:((?:[^\W\d]|\$)[\w$]*)"  # a name
    r"|(0[xX][\dA-Za-z_.]*|\.?\d(?:[eE][-+](?=\d)|[\dA-Za-z_.])*)"  # anything that begins as a number
    r"|(->|::|==|\S))?"
)
_VALUE = re.compile(r"(?:0[xX]([\da-fA-F]+)|((?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?))[fFlLuU]?")
_STRING = {quote: re.compile(rf"{quote}([^{quote}\\\n]*(?:\\.[^{quote}\\\n]*)*)({quote}?)") for quote in "\"'"}
_OUTSIDE = re.compile(r"[\"'()\[\]{},;]")


class Token(NamedTuple):
    """A piece of a text.

    kind : "name", "number", "sign", or "" at the text's end.
    text : its characters.
    start, end : its place.
    """

    kind: str
    text: str
    start: int
    end: int


def token(text: str, at: int) -> Token:
    """The first token from a place on."""
    match = _TOKEN.match(text, at)
    if match is None or (group := match.lastindex) is None:
        return Token("", "", len(text), len(text))
    return Token(("name", "number", "sign")[group - 1], match[group], match.start(group), match.end())


def words(text: str) -> tuple[list[str], list[int]]:
    """All tokens, each with its place."""
    texts, places = [], []
    known: dict[str, str] = {}  # each once: a program has few words and many of each
    for match in _TOKEN.finditer(text):
        if match.lastindex is not None:
            word = match[match.lastindex]
            texts.append(known.setdefault(word, word))
            places.append(match.start(match.lastindex))
    return texts, places


def number(word: str) -> float | None:
    """The value of a number as C, Python, JavaScript … write it, which may be infinite; None if it is none."""
    match = _VALUE.fullmatch(word)
    if match and match[1]:
        return float(int(match[1], 16)) if len(match[1]) < 200 else math.inf
    return float(match[2]) if match else None


def string(text: str, at: int) -> tuple[str, int] | None:
    """The text between the quotes of which the first is at a place, and where it ends; None if its line has no second."""
    match = _STRING[text[at]].match(text, at)
    return (match[1], match.end()) if match and match[2] else None


def outside_strings(text: str, at: int, end: int | None = None) -> Iterator[tuple[str, int]]:
    """The brackets, commas and semicolons that stand in no string, each with its place."""
    end = len(text) if end is None else end
    unclosed = dict.fromkeys(_STRING, at)  # up to where a quote is known to have no second one
    while match := _OUTSIDE.search(text, at, end):
        at = match.end()
        if match[0] not in unclosed:
            yield match[0], match.start()
        elif unclosed[match[0]] <= match.start() and (quoted := _STRING[match[0]].match(text, match.start(), end)):
            at = quoted.end() if quoted[2] else at
            unclosed[match[0]] = quoted.end()
