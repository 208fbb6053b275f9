"""A stand-in for Blender: a program that VIEWCAM_BLENDER can name, which serves as Blender does and draws nothing."""

import importlib.util
import os
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent

# The beginning of a shot's name says what happens to it. The diary says what happened, a line each.
STAND_IN = """#!{python}
import errno, hashlib, json, os, signal, sys, time
sys.path[:0] = {path}
from viewcam_addon.jobs import served_renderer
from viewcam_addon.errors import InputError

FOLDER = {folder}

def note(*words):
    with open(os.path.join(FOLDER, "diary.txt"), "a") as diary:
        print(*words, os.getpid(), file=diary)

class Renderer:
    def __init__(self, blend, trust, events):
        note("open", blend)
        note("one-thread", os.environ.get("OMP_NUM_THREADS"))
        if not blend.exists():
            raise InputError(f"{{blend}} is not there: give another")
        self.blend = blend
    def __enter__(self):
        return self
    def __exit__(self, *_):
        pass
    cameras, scene_camera = ("Left", "Right"), "Left"
    def made_from(self):
        return {{"blend": self.blend.read_text(), "blender": "stand-in"}}
    def problems(self, shots, check):
        return [f"{{shot.name}} is impossible" for shot in shots if shot.name.startswith("impossible")]
    def render(self, shot, image, preview):
        said = {{"camera": {{"eye": shot.eye, "d": shot.d}}, "warnings": ["a warning"]}}
        said |= {{"rendered": {{"width": shot.width, "height": shot.height}}}}
        if image is None:
            return said
        note("render", shot.name, shot.threads)
        image.write_bytes(b"half of it")
        kind = shot.name.split("_")[0]
        first = sum(line.split()[1:2] == [shot.name] for line in open(os.path.join(FOLDER, "diary.txt"))) == 1
        if kind == "crash" or (kind == "crashonce" and first):
            os.kill(os.getpid(), signal.SIGKILL)
        if kind == "poison":
            os.kill(os.getppid(), signal.SIGKILL)
        if kind == "slow" and first:
            note("waits", shot.name)
            time.sleep(60)
        if kind == "steady":
            time.sleep(0.5)
        if kind == "bad":
            raise InputError(f"{{shot.name}} has no light: add some")
        if kind == "full":
            raise OSError(errno.ENOSPC, "No space left on device")
        if kind == "bug":
            raise KeyError("a bug")
        image.write_bytes(hashlib.sha256(repr((shot.seed, shot.name, shot.eye)).encode()).digest())
        preview.write_bytes(b"preview")
        return said
    def check(self, shot, has_picture, written, keep):
        first = not any(line.split()[:2] == ["check", shot.name] for line in open(os.path.join(FOLDER, "diary.txt")))
        note("check", shot.name)
        if shot.name.startswith("checkcrash") and first:
            os.kill(os.getpid(), signal.SIGKILL)
        return {{"passed": True, "verdict": "as it should be"}}

words = sys.argv[sys.argv.index("--command") + 1 :]  # -b FILE --command viewcam batch …, or -b --command viewcam serve HANDLE
if words[:2] == ["viewcam", "serve"]:
    served_renderer.serve(words[2], Renderer)
else:
    from viewcam_addon import cli
    file = next(word for word in sys.argv if word.endswith(".blend"))
    os.environ["VIEWCAM_BLENDER"] = sys.argv[0]
    sys.exit(cli.main(["batch", file, *words[2:]]))
"""


class StandIn:
    """The program, and what it has written into its diary."""

    def __init__(self, folder: Path) -> None:
        self.program, self._diary = folder / "blender", folder / "diary.txt"
        path = [str(ROOT), *(path for path in sys.path if path)]
        self.program.write_text(STAND_IN.format(python=sys.executable, path=path, folder=repr(str(folder))))
        self.program.chmod(0o755)

    def forget(self) -> None:
        """Begin the diary anew."""
        self._diary.unlink(missing_ok=True)

    def diary(self, first: str) -> list[list[str]]:
        """The words of each line that begins so; the last one is the process."""
        lines = self._diary.read_text().splitlines() if self._diary.exists() else []
        return [line.split() for line in lines if line.split()[0] == first]


@pytest.fixture(scope="module")
def stand_in_program(tmp_path_factory) -> StandIn:
    """One for all tests of a module, so that they can share workers that have it."""
    if sys.platform == "win32":
        pytest.skip("Windows runs no script by its first line")
    return StandIn(tmp_path_factory.mktemp("stand-in"))


@pytest.fixture
def stand_in(stand_in_program, monkeypatch) -> StandIn:
    """The Blender of this test, with an empty diary."""
    stand_in_program.forget()
    monkeypatch.setenv("VIEWCAM_BLENDER", str(stand_in_program.program))
    return stand_in_program


@pytest.fixture
def blend(tmp_path) -> Path:
    """A file that the stand-in takes for a .blend."""
    path = tmp_path / "scene.blend"
    path.write_text("a scene")
    return path


def runs(process: int | str) -> bool:
    """True if a process of this number runs; one that has ended and was not asked for its status does not."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def until(is_so, seconds: float = 30.0):
    """The value of `is_so`, as soon as it is true or so many seconds have passed: many times as many as it takes."""
    ends = time.monotonic() + seconds
    while not (outcome := is_so()) and time.monotonic() < ends:
        time.sleep(0.02)
    return outcome


@pytest.fixture
def processes():
    """The two functions, for tests that look at processes."""
    if not os.path.isdir("/proc/self"):
        pytest.skip("whether a process runs is read off Linux's /proc")
    return type("Processes", (), {"run": staticmethod(runs), "until": staticmethod(until)})


@pytest.fixture(scope="session")
def painting():
    """The module painting.py beside this file."""
    specification = importlib.util.spec_from_file_location("painting", Path(__file__).with_name("painting.py"))
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module
