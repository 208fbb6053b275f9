"""Fixtures that every test may ask for: the registered add-on, an empty Blender, the folder of real models.

Modules that need Blender start with `bpy = pytest.importorskip("bpy")`, so that after collection `sys.modules` tells whether
this session is one with Blender. Rejected: registering through `addon_utils.enable`, which any `read_factory_settings` undoes.
"""

import contextlib
import ctypes
import faulthandler
import os
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import hypothesis
import numpy as np
import pytest

# tests/real_blender drives a Blender that is installed beside: make test-blender says which.
collect_ignore = [] if os.environ.get("BLENDER") else ["real_blender"]

# Every run has equal examples, so that a failure in CI is the same failure here; `pytest --hypothesis-profile=explore` looks
# for new ones, `quick` has few. No clocks: Blender's first call is slow, and so is a machine with other work.
NO_CLOCK = {"deadline": None, "suppress_health_check": [hypothesis.HealthCheck.too_slow]}
REPEATABLE = {**NO_CLOCK, "derandomize": True, "database": None}
hypothesis.settings.register_profile("repeatable", **REPEATABLE)
hypothesis.settings.register_profile("explore", **NO_CLOCK)
hypothesis.settings.register_profile("quick", **REPEATABLE, max_examples=10)
hypothesis.settings.load_profile("repeatable")


_LONG = 13 * 60  # seconds
"""The time limit of what takes minutes by its nature.

A goal takes 15 minutes, and .ci/run ends it after 30 without a word which test hung: this must come before.
"""


def pytest_configure(config):
    """Let a process that is ended from outside show where it was: no time limit holds after the last test."""
    if hasattr(faulthandler, "register"):  # not on Windows
        with config.pluginmanager.getplugin("capturemanager").global_and_fixture_disabled():
            terminal = os.dup(sys.stderr.fileno())
        faulthandler.register(signal.SIGTERM, terminal, chain=True)


def pytest_ignore_collect(collection_path, config):
    """All of tests/benchmarks is marked: where it is not asked for, the libraries of charts need not be imported."""
    if collection_path.name == "benchmarks" and {"not exhaustive", "not speed"} <= set(config.option.markexpr.split(" and ")):
        return True
    return None


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items):
    for item in items:
        if "bpy" in vars(item.module) or "fresh_blender" in item.fixturenames:
            item.add_marker(pytest.mark.blender)
        if "benchmarks" in item.path.parts and not item.get_closest_marker("speed"):
            item.add_marker(pytest.mark.exhaustive)  # benchmarks measure, and are not shipped
        if "real_blender" in item.path.parts or any(map(item.get_closest_marker, ("exhaustive", "light", "speed"))):
            item.add_marker(pytest.mark.timeout(_LONG))
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)  # the longest first


@pytest.fixture(scope="session", autouse=True)
def registered_addon():
    """The add-on, registered once for all tests where Blender is there; None in a session without Blender."""
    if "bpy" not in sys.modules:
        yield None
        return
    import viewcam_addon

    viewcam_addon.register()
    yield viewcam_addon
    viewcam_addon.unregister()


@pytest.fixture
def fresh_blender(registered_addon):
    """bpy with an empty file open, factory settings, and the add-on still registered."""
    bpy = pytest.importorskip("bpy")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    for area in (area for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D"):
        # Blender without a window keeps the last file's viewports.
        space = area.spaces.active
        space.region_3d.view_perspective, space.lock_cursor, space.use_local_camera = "PERSP", False, False
    return bpy


@pytest.fixture
def symlink():
    """symlink(link, target) makes a symbolic link; where Windows lets this user make none, the test is skipped."""

    def make(link, target):
        try:
            os.symlink(target, link)
        except OSError as error:
            if sys.platform != "win32":
                raise
            pytest.skip(f"no symbolic links here: {error}")
        if sys.platform == "win32" and not os.path.islink(link):
            pytest.skip("wine makes no symbolic links, and says that it has made one")

    return make


@pytest.fixture
def opengl():
    """Blender's drawing, as of Grease Pencil; wine has none without a window, and Blender crashes there."""
    if sys.platform == "win32" and hasattr(ctypes.windll.ntdll, "wine_get_version"):
        pytest.skip("Blender draws by OpenGL, which wine has none of without a window")


@pytest.fixture
def no_warnings():
    """NumPy raises where it would warn, and so does Python."""
    with np.errstate(all="raise"), warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.fixture(scope="session")
def models_folder() -> Path:
    """The folder of real scanned and modeled meshes that VIEWCAM_MODELS names; they are no part of the project."""
    folder = os.environ.get("VIEWCAM_MODELS")
    if not folder:
        pytest.skip("VIEWCAM_MODELS names no folder of models")
    return Path(folder).resolve(strict=True)


@pytest.fixture
def on_a_terminal():
    """Runs a command (words, environment) with a terminal of 80 columns as its standard error; its status, what that showed."""
    if sys.platform == "win32":
        pytest.skip("Windows has no pseudo-terminals that a program can open so")
    import pty
    import termios

    def run(words, environment):
        ours, its = pty.openpty()
        termios.tcsetwinsize(its, (24, 80))
        child = subprocess.Popen([*map(str, words)], stderr=its, stdout=subprocess.DEVNULL, env=environment)
        os.close(its)
        output = b""
        with contextlib.suppress(OSError):  # Linux's way to say that the other side has gone
            while part := os.read(ours, 4096):
                output += part
        os.close(ours)
        return child.wait(), output.decode()

    return run


_exit_status = pytest.StashKey[int]()


def pytest_sessionfinish(session, exitstatus):
    session.config.stash[_exit_status] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    """Leave without Python's clean-up: after properties with `update=` were registered, bpy 4.2 crashes in it and 4.5 hangs."""
    if "bpy" in sys.modules and _exit_status in config.stash:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash[_exit_status])
