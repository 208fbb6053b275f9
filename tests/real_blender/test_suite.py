"""The tests of viewcam_addon/blender once more, inside a real Blender: its own Python, its own NumPy, no wheel of bpy."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent


def packages_for(blender) -> Path:
    """A folder with pytest and what the tests and their child processes import, for the Python inside this Blender."""
    script = "import sys; print('PYTHON', '.'.join(map(str, sys.version_info[:2])))"
    version = re.search(r"PYTHON (\S+)", blender.run("-b", "--factory-startup", "--python-expr", script).stdout)[1]
    folder = ROOT / ".venvs" / f"inside-blender-{version}"
    if not (folder / "ready").exists():
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--upgrade"]
        target = [f"--target={folder}", f"--python-version={version}", "--only-binary=:all:"]
        subprocess.run([*pip, *target, "pytest", "hypothesis", "mpmath"], check=True)
        # Without NumPy, which these two ask for: Blender has its own.
        subprocess.run([*pip, *target, "--no-deps", "OpenEXR", "embreex"], check=True)
        (folder / "ready").touch()
    return folder


def test_the_tests_of_blender_pass_inside_it(real_blender):
    packages = packages_for(real_blender)
    said = real_blender.run_inside("pytest", packages, "-q", "-p", "no:cacheprovider", "tests/blender")
    summary = said.strip().splitlines()[-1]
    print(summary)
    assert re.search(r"\d+ passed", summary), said
