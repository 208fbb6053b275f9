"""Make a virtual environment with what pip is asked for: `python .ci/environment.py FOLDER PIP-ARGUMENT…`

Debian gives a Python without `venv`, and wheels need libraries of the system, of the X Window System even where there is no
window. Which ones, the wheels tell (`ldd`), and Debian's policy tells the package of each. What is missing is installed where
that needs no password (root, in a container or on a build machine); elsewhere one sentence says which command does it. Only the
standard library, since this runs before there is anything else. Rejected: a list of libraries, which each new wheel outdated.
"""

import contextlib
import ctypes
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

# Loaded by name and only when Blender draws, as it does for Grease Pencil, which ends the process where it is missing.
LOADED_BY_NAME = ["libEGL.so.1"]
ROOT = Path(__file__).resolve().parent.parent
CORE = ROOT / "build" / "core"
PROJECT = "virtual-pinhole"
COMPILERS = (os.environ.get("CXX"), "c++", "g++", "clang++")


def missing_libraries(folder: Path) -> list[str]:
    """The sonames that the extension modules of a folder need, what Blender loads by name among them, and this machine lacks.

    folder : site-packages; what Blender's wheel holds for a Python of its own (bpy/5.0/python) is not imported, nor asked.
    """
    libraries = [path for path in folder.rglob("*.so*") if path.is_file()]
    modules = [
        str(path)
        for path in libraries
        if path.suffix == ".so" and not path.name.startswith("lib") and "python" not in path.relative_to(folder).parts
    ]
    needed = subprocess.run(["ldd", *modules], capture_output=True, text=True).stdout if modules else ""
    missing = set(re.findall(r"^\s(\S+) => not found", needed, re.MULTILINE))
    if any(name.startswith("bpy") for name in os.listdir(folder)):
        missing |= {name for name in LOADED_BY_NAME if not _loads(name)}
    return sorted(missing - {path.name for path in libraries})


def _loads(soname: str) -> bool:
    try:
        ctypes.CDLL(soname)
    except OSError:
        return False
    return True


def debian_packages(sonames: list[str]) -> list[str]:
    """The Debian packages of libraries by Debian's policy (8.1): libX11.so.6 is in libx11-6, libatomic.so.1 in libatomic1.

    Left out are those that this Debian does not have, such as a graphics card's.
    """
    packages = []
    for soname in sonames:
        name, _, version = soname.partition(".so.")
        package = f"{name}{'-' if name[-1:].isdigit() and version else ''}{version}".lower().replace("_", "-")
        if subprocess.run(["apt-cache", "show", package], capture_output=True).returncode == 0:
            packages.append(package)
    return packages


def may_install() -> bool:
    """Return True where Debian's package manager may be used without a password."""
    return sys.platform == "linux" and os.geteuid() == 0 and shutil.which("apt-get") is not None


def update_lists() -> None:
    """Let Debian's package manager know today's packages, where this user may."""
    if may_install():
        subprocess.run(["apt-get", "update", "--quiet=2"], check=True)


def install_packages(packages: list[str]) -> None:
    """Install Debian packages as root; any other user is told the command."""
    command = ["apt-get", "install", "--yes", "--no-install-recommends", *packages]
    if not shutil.which("apt-get"):
        sys.exit(f"Missing on this machine: install what Debian calls {' '.join(packages)}, then start again")
    if os.geteuid() != 0:
        sys.exit(f"Missing on this machine: run  sudo {' '.join(command)}  then start again")
    print(f"Installing {' '.join(packages)}", flush=True)
    quiet = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    subprocess.run(command, check=True, env=quiet, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def install(python: Path, requirements: list[str]) -> None:
    """Install what pip is asked for into the environment of a Python, by uv or by pip.

    uv takes less than half of pip's processor time, downloads several wheels at once, and keeps them unpacked for the next
    environment; where it fails, as it does behind an index that only pip's own settings name, pip says why, or does it.
    """
    pip = [python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    subprocess.run([*pip, "uv"], check=True)
    # uv looks at pyproject.toml alone to see if the project has changed, and not at what the core is compiled from.
    uv = [python.with_name("uv"), "pip", "install", "--quiet", "--python", python, "--reinstall-package", PROJECT]
    if subprocess.run([*uv, *requirements], stderr=subprocess.DEVNULL).returncode:
        # Python compiles what it imports, which is a small part of what all these bring along: half a minute an environment.
        subprocess.run([*pip, "--no-compile", *requirements], check=True)


def main(folder: Path, requirements: list[str]) -> None:
    """Make the environment, or bring the one that is there up to date."""
    packages = [] if importlib.util.find_spec("ensurepip") else [f"python{sys.version_info[0]}.{sys.version_info[1]}-venv"]
    if not CORE.exists() and not any(map(shutil.which, filter(None, COMPILERS))):
        if may_install():  # half of ziglang's time, which compiles its C++ library, too
            packages.append("g++")
        else:
            print("Compiling the tracer's core by ziglang, as there is no C++ compiler: a minute or two", flush=True)
    if packages:
        update_lists()
        install_packages(packages)
    # The core is compiled while packages are downloaded: uv would begin with it when all of them are there.
    compile_core = [sys.executable, ROOT / "hatch_build.py", "--compile"]
    has_compiler = any(map(shutil.which, filter(None, COMPILERS)))
    with subprocess.Popen(compile_core, stderr=subprocess.DEVNULL) if has_compiler else contextlib.nullcontext():
        if not (folder / "bin" / "pip").exists():
            print(f"Making the Python {sys.version.split()[0]} environment {folder}", flush=True)
            subprocess.run([sys.executable, "-m", "venv", "--clear", folder], check=True)
        install(folder / "bin" / "python", requirements)
    site = next(folder.glob("lib/python3.*")) / "site-packages"
    if sys.platform == "linux" and (missing := missing_libraries(site)):
        if not shutil.which("apt-cache"):
            print(f"Perhaps missing on this machine: {' '.join(missing)}", flush=True)
            return
        update_lists()
        if packages := debian_packages(missing):
            install_packages(packages)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]), sys.argv[2:])
    except subprocess.CalledProcessError as error:
        sys.exit(f"{' '.join(map(str, error.cmd))} failed with status {error.returncode}: what it says is above")
