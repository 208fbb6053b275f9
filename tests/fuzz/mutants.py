"""Files made wrong on purpose: bits flipped, ends cut off, pieces exchanged, numbers replaced by extreme ones, keys dropped.

A mutant is told by its kind and its number alone, so that one that fails is made again by these. Rejected: a fuzzer guided by
coverage (atheris), which needs an instrumented interpreter and finds other mutants in every run.
"""

import io
import json
import random
import re
import zipfile

EXTREMES = (
    *("0", "-0.0", "-1", "1", "2", "3", "7", "255", "65536", "2147483647", "2147483648", "-2147483649", "4294967296"),
    *("9223372036854775808", "1e9", "1e-9", "5e-324", "1e-310", "1e-45", "1e15", "1e18", "1e30", "3.5e38", "1e39", "1.7e308"),
    *("-1.7e308", "1e999", "NaN", "Infinity", "-Infinity", "9" * 40, "9" * 400, "9" * 5000, "0." + "3" * 5000, "1e5000000"),
)
"""Numbers, as a text file has them, from which programs shrink."""

OTHERS = (
    "null",
    "true",
    "false",
    '""',
    '"\\ud800"',
    '"\\u0000"',
    '"x"',
    "[]",
    "{}",
    "[[]]",
    "[1]",
    '{"npz": "x"}',
    "[[1, 2], 3]",
)

_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_PATTERNS = (
    b"\0",
    b"\xff",
    b"\x7f",
    b"\x80",
    b"\xff\xff\xff\x7f",
    b"\0\0\0\x80",
    b"\0\0\x80\x7f",
    b"\xff\xff\xff\xff\xff\xff\xff\x7f",
)


def of_bytes(data: bytes, other: bytes, chance: random.Random, within: int | None = None) -> bytes:
    """One to four changes of a binary file.

    other : a file whose pieces may stand in it.
    within : changes begin before here.
    """
    changed = bytearray(data)
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        end = max(min(len(changed), within or len(changed)), 1)
        place, length = chance.randrange(end), chance.choice((1, 2, 4, 8, 16, 64, 512))
        what = chance.randrange(8)
        if what <= 2 and changed:
            changed[min(place, len(changed) - 1)] ^= 1 << chance.randrange(8)
        elif what == 3:
            pattern = chance.choice(_PATTERNS)
            changed[place : place + len(pattern)] = pattern
        elif what == 4:
            changed[place : place + length] = b""
        elif what == 5:
            changed[place:place] = changed[place : place + length]
        elif what == 6:
            start = chance.randrange(max(len(other), 1))
            changed[place : place + length] = other[start : start + length]
        else:
            del changed[chance.randrange(len(changed) + 1) :]
    return bytes(changed)


def of_text(text: bytes, other: bytes, chance: random.Random) -> bytes:
    """A text file whose numbers are extreme, or that is changed as any other file."""
    if chance.random() < 0.4:
        return of_bytes(text, other, chance)
    for _ in range(chance.choice((1, 1, 2, 5))):
        if result := list(_NUMBER.finditer(text)):
            number = chance.choice(result)
            text = text[: number.start()] + chance.choice(EXTREMES).encode() + text[number.end() :]
    return text


def of_json(document: object, other: object, chance: random.Random) -> bytes:
    """A JSON document with values exchanged, keys dropped, renamed and doubled, or changed as text."""
    if chance.random() < 0.3:
        return of_text(json.dumps(document).encode(), json.dumps(other).encode(), chance)
    document = json.loads(json.dumps(document))
    marks: dict[str, str] = {}
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        owner, key = chance.choice(list(_places(document)))
        what = chance.randrange(7)
        if what == 0 and isinstance(owner, dict):
            del owner[key]
        elif what == 1 and isinstance(owner, dict):
            owner[chance.choice((key + "s", "", "\0", "name", "\ud83d", "x" * 500, chance.choice(_keys(other))))] = owner.pop(
                key
            )
        elif what == 2:
            source, from_key = chance.choice(list(_places(other)))
            owner[key] = json.loads(json.dumps(source[from_key]))
        elif what == 3 and isinstance(owner, list):
            owner[key:key] = [owner[key]] * chance.choice((1, 2, 100))
        elif what == 4:
            for _ in range(chance.choice((1, 30, 200))):
                owner[key] = [owner[key]]
        elif what == 5 and isinstance(owner, dict):
            marks[f"@{len(marks)}"] = json.dumps(key)
            owner[f"@{len(marks) - 1}"] = owner[key]
        else:
            mark = f"@{len(marks)}"
            marks[f'"{mark}"'] = chance.choice((EXTREMES, OTHERS)[chance.random() < 0.4])
            owner[key] = mark
        if not document:
            break
    text = json.dumps(document)
    for mark, stands_for in reversed(marks.items()):
        text = text.replace(mark if mark.startswith('"') else f'"{mark}"', stands_for)
    return text.encode()


def of_zip(data: bytes, other: bytes, chance: random.Random) -> bytes:
    """An archive whose members are changed and whose checksums are right, or one that is changed as any other file."""
    if chance.random() < 0.3:
        return of_bytes(data, other, chance)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = chance.choice(list(members))
    what = chance.randrange(4)
    if what == 0:
        members[name.removesuffix(".npy") + chance.choice(("", ".txt", ".npy.npy"))] = members.pop(name)
    elif what == 1:
        members[name] = members[chance.choice(list(members))]
    elif what == 2:
        members[name] = of_text(members[name][:128], b"", chance) + members[name][128:]
    else:
        members[name] = of_bytes(members[name], other, chance, 128)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", chance.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return packed.getvalue()


def _places(document: object) -> list[tuple[object, object]]:
    """Each (list or object, index or key) that a value stands at."""
    result, waiting = [], [document]
    while waiting:
        inner = waiting.pop()
        if isinstance(inner, dict | list):
            entries = inner.items() if isinstance(inner, dict) else enumerate(inner)
            for key, value in entries:
                result.append((inner, key))
                waiting.append(value)
    return result


def _keys(document: object) -> list[str]:
    return [key for owner, key in _places(document) if isinstance(owner, dict)]
