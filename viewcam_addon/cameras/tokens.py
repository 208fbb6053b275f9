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
    r"|(0[xX][\dA-Za-z_.]*|\.?\d(?:[eE][-+](?=\d)|[\dA-Za-z_.])*)"  # what begins as a number
    r"|(->|::|==|\S))?"
)
_VALUE = re.compile(r"(?:0[xX]([\da-fA-F]+)|((?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?))[fFlLuU]?")
_STRING = {quote: re.compile(rf"{quote}([^{quote}\\\n]*(?:\\.[^{quote}\\\n]*)*)({quote}?)") for quote in "\"'"}
_OUTSIDE = re.compile(r"[\"'()\[\]{},;]")


class Token(NamedTuple):
    """kind : "name", "number", "sign", or "" at the text's end. text : its characters. start, end : its place."""

    kind: str
    text: str
    start: int
    end: int


def token(text: str, at: int) -> Token:
    """The first token from a place on."""
    found = _TOKEN.match(text, at)
    if found is None or (group := found.lastindex) is None:
        return Token("", "", len(text), len(text))
    return Token(("name", "number", "sign")[group - 1], found[group], found.start(group), found.end())


def words(text: str) -> tuple[list[str], list[int]]:
    """All tokens, each with its place."""
    texts, places = [], []
    known: dict[str, str] = {}  # each once: a program has few words and many of each
    for found in _TOKEN.finditer(text):
        if found.lastindex is not None:
            word = found[found.lastindex]
            texts.append(known.setdefault(word, word))
            places.append(found.start(found.lastindex))
    return texts, places


def number(word: str) -> float | None:
    """The value of a number as C, Python, JavaScript … write it, which may be infinite; None if it is none."""
    found = _VALUE.fullmatch(word)
    if found and found[1]:
        return float(int(found[1], 16)) if len(found[1]) < 200 else math.inf
    return float(found[2]) if found else None


def string(text: str, at: int) -> tuple[str, int] | None:
    """The text between the quotes of which the first is at a place, and where it ends; None if its line has no second."""
    found = _STRING[text[at]].match(text, at)
    return (found[1], found.end()) if found and found[2] else None


def outside_strings(text: str, at: int, end: int | None = None) -> Iterator[tuple[str, int]]:
    """The brackets, commas and semicolons that stand in no string, each with its place."""
    end = len(text) if end is None else end
    unclosed = dict.fromkeys(_STRING, at)  # up to where a quote is known to have no second one
    while found := _OUTSIDE.search(text, at, end):
        at = found.end()
        if found[0] not in unclosed:
            yield found[0], found.start()
        elif unclosed[found[0]] <= found.start() and (quoted := _STRING[found[0]].match(text, found.start(), end)):
            at = quoted.end() if quoted[2] else at
            unclosed[found[0]] = quoted.end()
