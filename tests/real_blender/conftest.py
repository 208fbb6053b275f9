"""The Blenders that the extension is installed into: the real one of $BLENDER, and the older wheels of `make test-matrix`.

Each has a user folder of its own, so no test touches the extensions or the preferences of whoever runs it.
"""

import contextlib
import fcntl
import os
import platform
import re
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
INSIDE = Path(__file__).with_name("inside_blender.py")
# The newest is the real one's, and 5.0 installs as 4.5 does.
WHEELS = {version: ROOT / ".venvs" / version / "bin" / "python" for version in ("4.2", "4.5")}
LONGEST = {Path(__file__).with_name(f"test_{name}.py") for name in ("suite", "window")}
PACKAGES = ("pytest", "pytest-timeout", "hypothesis", "mpmath", "distributed", "cryptography")
PLATFORMS = {("Linux", "x86_64"): "linux-x64", ("Darwin", "arm64"): "macos-arm64", ("Darwin", "x86_64"): "macos-x64"}


def pytest_collection_modifyitems(items):
    """Begin with the tests that take minutes: else one process takes the tour alone when the other has nothing left."""
    items.sort(key=lambda item: item.path not in LONGEST)


@dataclass(frozen=True)
class Host:
    """A Blender with a user folder of its own."""

    command: tuple[str, ...]
    user_folder: Path

    @property
    def is_real(self) -> bool:
        """True if this is a program, not a Python module."""
        return self.command[0] == os.environ["BLENDER"]

    def run(self, *arguments: str | Path) -> subprocess.CompletedProcess:
        """Run the command with more arguments, from the checkout, and keep what it says."""
        environment = {**os.environ, "BLENDER_USER_RESOURCES": str(self.user_folder)}
        return subprocess.run([*self.command, *map(str, arguments)], env=environment, cwd=ROOT, capture_output=True, text=True)

    def run_in_a_window(
        self,
        script: Path,
        *arguments: str | Path,
        size: tuple[int, int] = (1600, 1000),
        scale: float = 1,
        simulated: bool = True,
        patience: float = 1200,
    ) -> subprocess.CompletedProcess:
        """Run a script (hands.py) in the real Blender's window on a virtual screen, and keep what it says.

        size : the window's size, pixels at scale 1.
        scale : the scale of Blender's interface and of the window.
        simulated : mouse and keys are the script's.
        patience : seconds, many times what it takes, on a busy machine too.
        """
        corner = ("-p", "0", "0", *(str(int(scale * pixels)) for pixels in size))
        events = ["--enable-event-simulate"] if simulated else []
        started = subprocess.Popen(
            [
                *(ROOT / ".ci" / "blender-window", "--factory-startup", "--addons", "bl_ext.user_default.virtual_pinhole"),
                *(*events, *corner, "--python", script, "--", *arguments),
            ],
            env={**os.environ, "BLENDER_USER_RESOURCES": str(self.user_folder), "VIEWCAM_UI_SCALE": str(scale)},
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        try:
            output = started.communicate(timeout=patience)
        except BaseException:
            os.killpg(started.pid, signal.SIGKILL)  # Blender and its screen, too, which else go on for hours
            started.communicate()
            raise
        return subprocess.CompletedProcess(started.args, started.returncode, *output)

    def run_inside(self, *arguments: str | Path) -> str:
        """Run inside_blender.py with these arguments; what it printed. Fails the test if that fails."""
        if self.is_real:
            outcome = self.run("-b", "--factory-startup", "--python-exit-code", "9", "--python", INSIDE, "--", *arguments)
        else:
            outcome = self.run(INSIDE, "--", *arguments)
        assert outcome.returncode == 0, outcome.stdout + outcome.stderr
        return outcome.stdout


@contextlib.contextmanager
def one_at_a_time():
    """A lock, so that one of the processes that share the tests makes what they all have."""
    (ROOT / ".venvs").mkdir(exist_ok=True)
    with open(ROOT / ".venvs" / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@pytest.fixture(scope="session")
def extension_zip(tmp_path_factory) -> Path:
    """The extension for this machine, built by the real Blender, once for all processes that share the tests."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "dist"
    target = PLATFORMS[platform.system(), platform.machine()]
    with one_at_a_time():
        if not list(folder.glob("*.zip")):
            subprocess.run([sys.executable, ROOT / ".ci" / "extension.py", os.environ["BLENDER"], folder, target], check=True)
    (built,) = folder.glob("*.zip")
    return built


@pytest.fixture(scope="session")
def real_blender(tmp_path_factory, extension_zip) -> Host:
    """The real Blender with the extension installed from the shell, as its manual says."""
    host = Host((os.environ["BLENDER"],), tmp_path_factory.mktemp("real"))
    host.run("--command", "extension", "install-file", "-r", "user_default", "-e", extension_zip)
    return host


@pytest.fixture(scope="session", params=["real", *(version for version, python in WHEELS.items() if python.exists())])
def host(request, tmp_path_factory, extension_zip) -> Host:
    """Each Blender in turn with the extension installed."""
    if request.param == "real":
        return request.getfixturevalue("real_blender")
    host = Host((str(WHEELS[request.param]),), tmp_path_factory.mktemp(f"wheel-{request.param}"))
    host.run_inside("install", extension_zip)
    return host


@pytest.fixture(scope="session")
def packages(real_blender) -> Path:
    """A folder with pytest and what the tests and their child processes import, for the Python inside this Blender."""
    script = "import sys; print('PYTHON', '.'.join(map(str, sys.version_info[:2])))"
    version = re.search(r"PYTHON (\S+)", real_blender.run("-b", "--factory-startup", "--python-expr", script).stdout)[1]
    folder = ROOT / ".venvs" / f"inside-blender-{version}-{'-'.join(PACKAGES)}"
    with one_at_a_time():
        if not (folder / "ready").exists():
            pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--upgrade"]
            target = [f"--target={folder}", f"--python-version={version}", "--only-binary=:all:"]
            subprocess.run([*pip, *target, *PACKAGES], check=True)
            # Without NumPy, which it asks for: Blender has its own.
            subprocess.run([*pip, *target, "--no-deps", "OpenEXR"], check=True)
            (folder / "ready").touch()
    return folder
