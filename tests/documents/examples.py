"""The examples of README.md and docs/, and how each is run as its reader would run it.

A block of sh is as many examples as it has commands. They run in the page's order, in a folder for each page where `viewcam`
and `blender` are the ones under test, and the files that the pages speak of are small scenes (in_blender.py). Any other block
is an example as a whole: programs are run, lists of shots and scenes rendered.

A page is a test, for what stands further down in it needs what was done above. Pages of `blender`'s commands are followed in
the real Blender (tests/real_blender/test_suite.py), all others with a wheel (test_examples.py): each page once.
"""

import json
import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "sample_scenes" / "README.md"]
BLOCK = re.compile(r"^ *```(.*)\n((?:.*\n)*?) *```$", re.MULTILINE)

SHOWN = ("text",)
"""Languages of blocks that show what a program says."""

_LONG = "it takes minutes or hours; tests/benchmarks measures all of it in small"
_FARM = "there is no such host; tests/jobs/test_farm.py does the same on this machine"
_WITH = "VIEWCAM_BLENDER=/opt/blender/blender"

NOT_RUN = {
    "make demo": "it makes an environment; CI's tests of viewcam demo do what it does then",
    "make test": "it runs this test",
    "make bench": _LONG,
    "make charts": _LONG,
    "python -m benchmarks judge": _LONG,
    "python -m benchmarks judge --quick": _LONG,
    "viewcam compare traced.exr elsewhere.exr --scene scene.json --channels position=P.X,P.Y,P.Z distance=dist.Y "
    "object-index=id.X": "tests/test_cli.py names the channels of a file of its own",
    "python -m benchmarks speed": _LONG,
    "python -m benchmarks stability --only roll spheres": _LONG,
    "pip install '/path/to/virtual-pinhole[cluster]'": "what it installs is there where this test runs",
    "dask scheduler --port 8786": "it does not end; tests/jobs/test_farm.py runs it",
    f"{_WITH} dask worker tcp://farm:8786 --nworkers 1 --nthreads 1": _FARM,
    f"{_WITH} viewcam batch /shared/shot.blend /shared/shots.csv --out /shared/renders --scheduler tcp://farm:8786": _FARM,
    "blender -b --disable-autoexec /shared/shot.blend --command viewcam batch /shared/shots.csv --out /shared/renders "
    "--resume --shard 1/8": _FARM,
}
"""Commands that no test runs, and why."""

ZIP = "virtual_pinhole-VERSION-PLATFORM.zip"
WRITTEN = {
    ("docs/farm.md", "yaml"): "tests/jobs/test_cluster.py has a farm that is configured so",
    ("docs/ci.md", "yaml"): "tests/test_pytest_plugin.py does what its steps do",
    ("docs/datasets.md", "json"): "its program writes them, as tests/datasets/test_projection.py compares",
}
"""Blocks that show what another example writes, and who says so."""


@dataclass(frozen=True)
class Example:
    """A command, or a block of code, that a page shows.

    page : relative to the project.
    text : a command or a whole block.
    output : the block behind it, which it prints.
    """

    page: str
    language: str
    text: str
    output: str = ""

    def __str__(self) -> str:
        return f"{self.page}: {self.text.strip().splitlines()[0][:100]}"


def examples() -> list[Example]:
    """All of them, in the order of pages and blocks."""
    return [example for path in PAGES for example in of_page(str(path.relative_to(ROOT)), path.read_text(encoding="utf-8"))]


def of_page(page: str, text: str) -> list[Example]:
    blocks = [(match[1].strip(), match[2]) for match in BLOCK.finditer(text)]
    result = []
    for (language, block), (next_language, next_block) in zip(blocks, [*blocks[1:], ("", "")][: len(blocks)], strict=True):
        if language == "sh":
            result += [Example(page, language, command) for command in _commands(block)]
        elif language not in SHOWN:
            result.append(Example(page, language, block, next_block if next_language in SHOWN else ""))
    return result


def is_run(example: Example) -> bool:
    """True if a test runs it."""
    return (example.page, example.language) not in WRITTEN and example.text not in NOT_RUN


def pages(real: bool) -> list[str]:
    """The pages of which something is run in the real Blender, whose commands are `blender`'s alone, or with a wheel."""
    run = [example for example in examples() if is_run(example)]
    programs: dict[str, set[str]] = {example.page: set() for example in run}
    for example in run:
        if example.language == "sh":
            programs[example.page].add(example.text.split()[0])
    return [page for page, names in programs.items() if (names == {"blender"}) == real]


def _commands(block: str) -> list[str]:
    lines = re.sub(r"\\\n\s*", "", block).splitlines()
    return [command for line in lines if (command := re.sub(r"(^|\s+)#.*", "", line).strip())]


class Reader:
    """A reader who follows the pages: folder for its work, and the Blender that it has.

    blender, viewcam : these commands, in a shell's words.
    python : the command that runs a program with `bpy`.
    environment : more variables.
    package : the add-on's name there.
    extension : the zip to install, where one can be.
    """

    def __init__(
        self,
        folder: Path,
        blender: str,
        viewcam: str,
        python: list[str],
        environment: dict[str, str],
        package: str = "viewcam_addon",
        extension: Path | None = None,
    ) -> None:
        self._folder, self._python, self._package = folder, python, package
        programs = folder / "programs"
        programs.mkdir()
        for name, words in (("blender", blender), ("viewcam", viewcam)):
            (programs / name).write_text(f"#!/bin/sh\n{words}\n", encoding="utf-8")
            (programs / name).chmod(stat.S_IRWXU)
        self._environment = {**os.environ, **environment, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
        self._files = folder / "files"
        self._files.mkdir()
        self._must([*python, str(HERE / "in_blender.py"), str(self._files)], folder)
        for page, language, name in (("docs/batch.md", "csv", "shots.csv"), ("docs/scene-file.md", "json", "scene.json")):
            first = next(each for each in examples() if (each.page, each.language) == (page, language))
            (self._files / name).write_text(first.text, encoding="utf-8")
        if extension:
            shutil.copy(extension, self._files / ZIP)

    def follow(self, page: str) -> None:
        """Run all of a page's examples; AssertionError with each that does not do what the page says."""
        failed = []
        for example in examples():
            if example.page == page and is_run(example):
                try:
                    self.run(example)
                except (AssertionError, ValueError) as error:
                    failed.append(f"{example}\n{error}")
        assert not failed, "\n\n".join(failed)

    def run(self, example: Example) -> None:
        """Run it; AssertionError if it does not do what its page says."""
        folder = self._folder / example.page.replace("/", "-")
        if not folder.exists():
            shutil.copytree(self._files, folder)
        if example.language == "sh":
            self._must(["sh", "-c", example.text.replace("/shared/", f"{folder}/")], folder)  # a farm's machines share a folder
        elif example.language == "python":
            self._run_program(example, folder)
        elif example.language == "jsonl" and "event" in json.loads(example.text.splitlines()[0]):
            self._compare_events(example, folder)
        elif example.language == "json" and "format" in json.loads(example.text):
            (folder / "example.json").write_text(example.text, encoding="utf-8")
            self._must(["viewcam", "render", "example.json", "example.exr", "--level", "path", "--samples", "1"], folder)
        elif example.language in ("csv", "json", "jsonl"):
            self._render_list(example, folder)
        else:
            raise AssertionError(f"{example}: nobody knows how to run {example.language!r}")

    def _run_program(self, example: Example, folder: Path) -> None:
        """A program has a file open, whose scene and camera it calls `scene` and `camera_object`."""
        text = example.text
        if self._package != "viewcam_addon":  # inside Blender the extension is registered, and called otherwise
            text = re.sub(r"(?m)^(import viewcam_addon|viewcam_addon\.register\(\))$", "", text)
            text = text.replace("from viewcam_addon", f"from {self._package}")
            text = text.replace("import viewcam_addon as", f"import {self._package} as")
        (folder / "example.py").write_text(text, encoding="utf-8")
        self._must([*self._python, str(HERE / "in_blender.py"), "shot.blend", "example.py"], folder)

    def _render_list(self, example: Example, folder: Path) -> None:
        name = f"shots.{example.language}"
        folder = Path(tempfile.mkdtemp(prefix="list-", dir=folder))
        (folder / name).write_text(example.text, encoding="utf-8")
        command = ["viewcam", "batch", "../shot.blend", name, "--out", "out", "--engine", "VIEWCAM", "--level", "geometry"]
        if "nothing is rendered" in example.output:
            done = self._run(command, folder)
            assert done.returncode == 2 and f"viewcam batch: {example.output}" in done.stderr, done.stderr
            assert not (folder / "out").exists()
        else:
            self._must(command, folder)
            assert {path.name for path in (folder / "out").glob("*.exr")} == {"left.exr", "right.exr"}

    def _compare_events(self, example: Example, folder: Path) -> None:
        """The keys of each event that is shown, with those of a batch in which one shot fails and of one in which none does."""
        keys_by_event = {event["event"]: [*event] for event in map(json.loads, example.text.splitlines())}
        right = folder / "events" / "right.png"
        right.parent.mkdir()
        right.symlink_to(folder / "shots.csv" / "right.png")  # which is no folder
        words = ["viewcam", "batch", "shot.blend", "shots.csv", "--out", "events", "--resume", "--log-json"]
        failed = self._run(words, folder)
        right.unlink()
        lines = (failed.stdout + self._must(words, folder)).splitlines()
        record = {event["event"]: [*event] for event in (json.loads(line) for line in lines if line.startswith("{"))}
        rare = {"stopping": ["event", "time", "signal"], "shot_elsewhere": ["event", "time", "shot"]}
        assert keys_by_event == record | rare, failed.stderr

    def _must(self, command: list[str], folder: Path) -> str:
        done = self._run(command, folder)
        assert done.returncode == 0, f"{command} ended with {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def _run(self, command: list[str], folder: Path) -> subprocess.CompletedProcess:
        return subprocess.run(command, cwd=folder, env=self._environment, capture_output=True, text=True, check=False)


def with_wheel(folder: Path) -> Reader:
    """A reader who has installed this project and a wheel of Blender."""
    blender = f'exec "{sys.executable}" "{HERE / "blender_of_a_wheel.py"}" "$@"'
    viewcam = f'exec "{sys.executable}" -m viewcam_addon "$@"'
    return Reader(folder, blender, viewcam, [sys.executable], {"PYTHONPATH": str(ROOT)})


def with_blender(folder: Path, program: str, user_folder: Path, extension: Path) -> Reader:
    """A reader who has a real Blender and the extension in it."""
    path = os.environ["PATH"]  # the program may be a script that looks for a blender of its own
    blender = f'PATH="{path}" exec "{program}" "$@"'
    viewcam = "exit 127"  # none of these pages has it
    python = ["sh", "-c", 'program=$1; shift; exec blender -b --python-exit-code 9 --python "$program" -- "$@"', "sh"]
    package = "bl_ext.user_default.virtual_pinhole.viewcam_addon"
    return Reader(folder, blender, viewcam, python, {"BLENDER_USER_RESOURCES": str(user_folder)}, package, extension)
