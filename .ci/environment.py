"""A virtual environment with what pip is asked for: `python .ci/environment.py FOLDER PIP-ARGUMENT…`

Debian gives a Python without `venv`, and bpy's wheels need a few libraries of the X Window System even where there is no
window. What is missing is installed where that needs no password (root, in a container or on a build machine); elsewhere one
sentence says which command does it. Only the standard library, since this runs before there is anything else.
"""

import ctypes
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

# What Linux's bpy wheels of 4.2 to 5.2 load and don't bring along, by Debian's package. EGL is loaded only when Blender draws,
# as it does for Grease Pencil, and ends the process where it is missing.
LIBRARIES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libICE.so.6": "libice6",
    "libSM.so.6": "libsm6",
    "libX11.so.6": "libx11-6",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libXxf86vm.so.1": "libxxf86vm1",
    "libgomp.so.1": "libgomp1",
    "libxkbcommon.so.0": "libxkbcommon0",
}


def missing_packages() -> list[str]:
    """Debian's names of what this machine lacks."""
    packages = [] if importlib.util.find_spec("ensurepip") else [f"python{sys.version_info[0]}.{sys.version_info[1]}-venv"]
    if sys.platform == "linux":
        for library, package in LIBRARIES.items():
            try:
                ctypes.CDLL(library)
            except OSError:
                packages.append(package)
    return packages


def install_packages(packages: list[str]) -> None:
    """Install Debian packages as root; any other user is told the command."""
    command = ["apt-get", "install", "--yes", "--no-install-recommends", *packages]
    if not shutil.which("apt-get"):
        sys.exit(f"Missing on this machine: install what Debian calls {' '.join(packages)}, then start again")
    if os.geteuid() != 0:
        sys.exit(f"Missing on this machine: run  sudo {' '.join(command)}  then start again")
    print(f"Installing {' '.join(packages)}", flush=True)
    quiet = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    subprocess.run(["apt-get", "update", "--quiet=2"], check=True, env=quiet)
    subprocess.run(command, check=True, env=quiet, stdout=subprocess.DEVNULL)


def main(folder: Path, requirements: list[str]) -> None:
    """Make the environment, or bring the one that is there up to date."""
    if packages := missing_packages():
        install_packages(packages)
    if not (folder / "bin" / "pip").exists():
        print(f"Making the Python {sys.version.split()[0]} environment {folder}", flush=True)
        subprocess.run([sys.executable, "-m", "venv", "--clear", folder], check=True)
    pip = [folder / "bin" / "python", "-m", "pip", "--disable-pip-version-check"]
    # Python compiles what it imports, which is a small part of what all these bring along: half a minute an environment.
    subprocess.run([*pip, "install", "--quiet", "--no-compile", *requirements], check=True)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]), sys.argv[2:])
    except subprocess.CalledProcessError as error:
        sys.exit(f"{' '.join(map(str, error.cmd))} failed with status {error.returncode}: what it says is above")
