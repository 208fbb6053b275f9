"""JUnit XML, which every CI system reads: what a command has found, as the one test of a suite.

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

    figures : as json.dumps takes them, but for numbers that are not finite: these are null, as in the file.
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
    """Write one test of one suite.

    path : the file. words : those of the command, the test's name. status : its exit status: 0 passed, 1 failed, 3 failed where
    there is an `answer`, another one an error. result : what --json writes, with `sentence` or `error`. seconds : it took.

    Raises
    ------
    InputError
        if it can't be written.
    """
    kind = {0: None, 1: "failure", 3: "failure" if "answer" in result else "error"}.get(status, "error")
    counts = {"errors": kind == "error", "failures": kind == "failure", "skipped": False, "tests": True}
    took = f"{seconds:.3f}"
    suites = ElementTree.Element("testsuites", name="viewcam")
    counted = {name: str(int(count)) for name, count in counts.items()}
    suite = ElementTree.SubElement(suites, "testsuite", name="viewcam", **counted, time=took)
    case = ElementTree.SubElement(suite, "testcase", classname="viewcam", name=_text(words), time=took)
    if figures := properties(result):
        of_case = ElementTree.SubElement(case, "properties")
        for name, value in figures:
            ElementTree.SubElement(of_case, "property", name=_text(name), value=_text(value))
    if kind:
        sentence = _text(result.get("error") or result.get("sentence") or f"exit status {status}")
        ElementTree.SubElement(case, kind, message=sentence).text = sentence
    with written_whole(path) as temporary:
        ElementTree.ElementTree(suites).write(temporary, encoding="utf-8", xml_declaration=True)


def _text(text: str) -> str:
    """With `#x1B` in place of each character that XML can't hold."""
    return _NO_CHARACTERS.sub(lambda found: f"#x{ord(found[0]):02X}", text)
