"""pytest-viewcam: pictures and cameras as tests. pytest finds it by its entry point (pyproject.toml); docs/ci.md shows it.

It is imported in every run of pytest in an environment that has this project, so nothing is imported here before it is used.
Everything is judged in processes of their own: what one test's Blender does can't touch the next test, and a test may use bpy
itself.
"""

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from .jobs.check import Check

Option = str | float | Path | bool | tuple[int, int] | None

_FIXTURES = {"viewcam_check", "same_picture"}
_FILES = ("scene", "report", "difference")
"""Options that are paths."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.getgroup("viewcam").addoption(
        "--viewcam-report",
        metavar="DIR",
        type=Path,
        help="write there an HTML report of each picture that viewcam_check and same_picture judge",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "viewcam(**options): options for viewcam_check and same_picture, as in viewcam(level='direct', samples=64); each test "
        "that uses one of them has this mark, so that -m 'not viewcam' leaves them out",
    )


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if _FIXTURES.intersection(getattr(item, "fixturenames", ())):
            item.add_marker("viewcam")


@pytest.fixture
def viewcam_check(request: pytest.FixtureRequest) -> "Callable[..., Check]":
    """Fails the test unless Cycles renders what a .blend file says: `viewcam_check(blend, level="direct", size="320x180")`.

    blend : its path, from the test's own folder. Options are those of `viewcam check`: `level`, `samples`, `camera`, `frame`,
    `size`, `engine`, … With `scene`, a scene file, the picture must be that scene's, whatever the .blend says now.

    Returns the viewcam_addon.Check: `.sentence`, `.figures`.
    """
    run = _Runner(request)
    return lambda blend, **options: run("check", [blend], options)


@pytest.fixture
def same_picture(request: pytest.FixtureRequest) -> "Callable[..., Check]":
    """Fails the test unless pictures are the same: `same_picture("reference.exr", "test.exr", scene="scene.json")`.

    reference : an EXR that `viewcam render` traced, or any other with those channels where `scene` tells its camera.
    tests : further EXRs; several are one picture with several seeds. Paths are from the test's folder; options are those of
        `viewcam compare`.

    Returns the viewcam_addon.Check: `.sentence`, `.figures`.
    """
    run = _Runner(request)
    return lambda reference, *tests, **options: run("compare", [reference, *tests], options)


class _Runner:
    """Runs commands for one test, and fails it with their sentences."""

    def __init__(self, request: pytest.FixtureRequest) -> None:
        self._request, self._runs = request, 0

    def __call__(self, command: str, paths: list[str | Path], stated: dict[str, Option]) -> "Check":
        from .errors import InputError
        from .jobs import check as checks

        node, folder, self._runs = self._request.node, self._request.path.parent, self._runs + 1
        options = {name: value for mark in reversed(list(node.iter_markers("viewcam"))) for name, value in mark.kwargs.items()}
        options = {name: value for name, value in (options | stated).items() if value is not None and value is not False}
        for name in _FILES:
            if isinstance(options.get(name), str | Path):
                options[name] = folder / options[name]
        reports: Path | None = self._request.config.getoption("--viewcam-report")
        if reports is not None:
            options.setdefault("report", self._report(reports))
        try:
            judged = getattr(checks, command)
            check = judged(*(folder / path for path in paths), **options)
        except InputError as error:
            pytest.fail(str(error), pytrace=False)
        except TypeError as error:  # an option that there is not
            pytest.fail(str(error), pytrace=False)
        self._record(options.get("report"), check)
        if not check.passed:
            link = f"\nreport: {Path(options['report'], 'index.html')}" if options.get("report") else ""
            pytest.fail(check.sentence + link, pytrace=False)
        return check

    def _report(self, reports: Path) -> Path:
        """A folder that no other test of this run has: node ids are told apart by more than file names can hold."""
        name = re.sub(r"[^\w.\[\]-]+", "-", self._request.node.nodeid)
        return (reports / (name if self._runs == 1 else f"{name}-{self._runs}")).absolute()

    def _record(self, report: Option, check: "Check") -> None:
        """Record a check as pytest's record_property does. In a test of several the second and later ones are numbered."""
        from . import junit

        prefix = "viewcam" if self._runs == 1 else f"viewcam-{self._runs}"
        properties = junit.properties(check.figures)
        if report:
            properties.append(("report", str(Path(str(report), "index.html"))))
        self._request.node.user_properties += [(f"{prefix}.{name}", value) for name, value in properties]
