"""JUnit XML, which every CI system reads: what a command has found, as a test of a suite, or a test for each shot.

The format has no schema that all agree upon; this is what pytest writes (xunit2), and nothing that another reader refuses. The
figures are properties of the test: those of `--json`, their keys joined by dots, as in `passes.Position.percentiles.max.value`.
"""

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from .checks import for_json
from .files import written_whole

# XML 1.0 has no way to write these, escaped or not; surrogates are what a file's name was made of that is no text.
_NO_CHARACTERS = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def properties(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Names and values of what `--json` writes, in its order. Lists of what has no name are left out, and so is null.

    figures : values as json.dumps takes them; numbers that are not finite are null, as in the file.
    """
    return [(name, text if isinstance(text, str) else json.dumps(text)) for name, text in _leaves("", for_json(figures))]


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, list):
        is_of_names = all(isinstance(item, Mapping) and "name" in item for item in value)
        value = {item["name"]: {k: v for k, v in item.items() if k != "name"} for item in value} if is_of_names else value
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _leaves(f"{name}.{key}" if name else str(key), item)
    elif isinstance(value, list):
        if not any(isinstance(item, Mapping | list) for item in value):
            yield name, " ".join(map(str, value))
    elif value is not None:
        yield name, value


def write(path: Path, words: str, status: int, result: Mapping[str, Any], seconds: float) -> None:
    """Write one suite: one test, or one for each of the result's `shots`.

    path : the file to write.
    words : the command's words: the name of the test, or of the suite of several.
    status : the command's exit status: 0 passed, 1 failed, 3 failed where there is an `answer`, another one an error.
    result : the object that --json writes, with `sentence` or `error`.
    seconds : the seconds that it took.

    Raises InputError if it can't be written.
    """
    if shots := result.get("shots"):
        cases = [
            _case(
                shot["name"], *_outcome_of(shot, result.get("strict", False)), shot, shot.get("timing", {}).get("seconds", 0.0)
            )
            for shot in shots
        ]
    else:
        kind = {0: None, 1: "failure", 3: "failure" if "answer" in result else "error"}.get(status, "error")
        cases = [_case(words, kind, result.get("error") or result.get("sentence") or f"exit status {status}", result, seconds)]
    kinds = [child.tag for case in cases for child in case]
    counts = {"errors": kinds.count("error"), "failures": kinds.count("failure"), "skipped": kinds.count("skipped")}
    counted = {name: str(count) for name, count in {**counts, "tests": len(cases)}.items()}
    suites = ElementTree.Element("testsuites", name="viewcam")
    suite = ElementTree.SubElement(suites, "testsuite", {"name": "viewcam", **counted, "time": f"{seconds:.3f}"})
    suite.extend(cases)
    with written_whole(path) as temporary:
        ElementTree.ElementTree(suites).write(temporary, encoding="utf-8", xml_declaration=True)


def _case(name: str, kind: str | None, sentence: str, figures: Mapping[str, Any], seconds: float) -> ElementTree.Element:
    """A test case, as an element of XML.

    kind : "failure", "error" or "skipped", None where it passed.
    sentence : a sentence that says why.
    """
    case = ElementTree.Element("testcase", classname="viewcam", name=_text(name), time=f"{seconds:.3f}")
    if named := properties({key: value for key, value in figures.items() if key != "timing"}):
        of_case = ElementTree.SubElement(case, "properties")
        for key, value in named:
            ElementTree.SubElement(of_case, "property", name=_text(key), value=_text(value))
    if kind:
        ElementTree.SubElement(case, kind, message=_text(sentence)).text = _text(sentence)
    return case


def _outcome_of(shot: Mapping[str, Any], strict: bool) -> tuple[str | None, str]:
    """The outcome of a shot of a summary, and why.

    strict : true if what is not modeled fails it.
    """
    if shot["state"] == "failed":
        return "error", shot["error"]
    if shot["state"] == "left":
        return "skipped", "left to check"
    passed = shot.get("passed", True) and not (strict and shot.get("answer") == "same_but")
    return (None if passed else "failure"), shot.get("verdict", "")


def _text(text: str) -> str:
    """With `#x1B` in place of each character that XML can't hold."""
    return _NO_CHARACTERS.sub(lambda match: f"#x{ord(match[0]):02X}", text)
