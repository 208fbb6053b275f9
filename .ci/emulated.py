"""Runs Python for another platform on this machine: `python .ci/emulated.py PLATFORM ARGUMENT…`

- windows-4.2, windows-5.0: CPython for Windows under wine, with that Blender for Windows as its module.
- linux-arm64: Debian's Python for arm64 under qemu, which starts no child processes.

Made once in ~/.cache/virtual-pinhole/emulated: wine's drives, Pythons, and packages as pip unpacks them for that platform. What
belongs to this checkout lies in build/emulated: the core, compiled by ziglang, and the package's metadata.

Only on Linux for x86-64. Debian packages that are missing are installed where that needs no password. Rejected: binfmt and
multiarch, which change this machine; a Python for arm64 from elsewhere, since no package index has one.
"""

import contextlib
import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

import lief

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / ".ci")]
from environment import install_packages  # noqa: E402 - only now is it known where these are

from hatch_build import build_core, core_wheel  # noqa: E402

CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "virtual-pinhole", "emulated")
DEBIAN = {
    "wine": ["wine", "wine64"],
    "mvn": ["maven"],
    "qemu-aarch64-static": ["qemu-user-static"],
    "debootstrap": ["debootstrap"],
}
# Blender 4.2 to 5.0 have Python 3.11; of the package indexes, Maven's has the programs of a CPython for Windows.
CPYTHON = "org.bytedeco:cpython:3.11.3-1.5.9:jar:windows-x86_64"
PIP_PLATFORMS = {
    "windows-x64": ["win_amd64"],
    "linux-arm64": ["manylinux_2_28_aarch64", "manylinux2014_aarch64", "manylinux_2_17_aarch64"],
}
BLENDERS = {"4.2": ["bpy==4.2.23", "numpy==1.24.*"], "5.0": ["bpy==5.0.1", "numpy==1.26.*"]}
# Packages that pip adds on Windows alone: its markers are asked of this machine.
WINDOWS_ALONE = ["colorama"]
BUNDLED = ["OpenEXR==3.5.3", "Jinja2==3.1.6", "MarkupSafe==3.0.4", "tqdm==4.70.1"]
TESTS = ["numpy==1.26.*", "pytest>=8.3", "pytest-timeout>=2.3", "hypothesis>=6.100", "mpmath>=1.3", "pyyaml>=6"]
# The cryptography is of before Rust 1.78, whose programs need bcryptprimitives.dll, which wine 8 lacks.
WINDOWS_TESTS = ["pytest-xdist>=3.5", "lief>=0.16", "distributed>=2025.1", "cryptography==42.0.5"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# With Blender 5.0 alone, whose suite has the tests of cameras and labels.
EXTRAS = PROJECT["optional-dependencies"]
JUDGES = [*EXTRAS["judges"], *EXTRAS["flip"], "embreex>=4.4", "numpy==1.26.*"]
# The program that every Python under wine runs first.
# - wine's clocks tick every 100 ns. Dask waits until it has the same time twice, and so for ever.
# - wine 8 has VirtualAlloc2, but none of the placeholders into which Blender maps files from 5.0 on: it would read no image and
#   link no file. Where Windows is too old for that function Blender does without; so its name is hidden in kernelbase's table.
WINE_AS_WINDOWS = """\
import ctypes
import time

precise_time, precise_monotonic = time.time, time.monotonic
time.time = lambda: precise_time() * 64 // 1 / 64
time.monotonic = lambda: precise_monotonic() * 64 // 1 / 64


def unsigned(address):
    return ctypes.c_uint32.from_address(address).value


kernelbase = ctypes.WinDLL("kernelbase")._handle
header = kernelbase + unsigned(kernelbase + 60)
exports, size = kernelbase + unsigned(header + 136), unsigned(header + 140)
name = exports + 1 + ctypes.string_at(exports, size).index(b"\\0VirtualAlloc2\\0")
writable = ctypes.c_ulong(4)
ctypes.windll.kernel32.VirtualProtect(ctypes.c_void_p(name), 13, writable, ctypes.byref(writable))
ctypes.memmove(name, b"VirtualAlloc1", 13)
"""


def program(name: str) -> str:
    """The name of a program, whose Debian packages are installed where it is missing."""
    if not shutil.which(name):
        install_packages(DEBIAN[name])
    return name


@contextlib.contextmanager
def made_once(folder: Path, contents: str = "") -> Iterator[Path | None]:
    """A folder that is to be filled and is called `folder` when the block has ended well; None if that is there already.

    contents : the folder is made anew when it was made for others.
    """
    listed = folder / "contents.txt"
    CACHE.mkdir(parents=True, exist_ok=True)
    with open(CACHE / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if folder.exists() and (listed.read_text(encoding="utf-8") if listed.exists() else "") == contents:
            yield None
            return
        print(f"Making {folder}", file=sys.stderr, flush=True)
        folder.parent.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(dir=folder.parent))
        try:
            yield part
            if contents:
                (part / listed.name).write_text(contents, encoding="utf-8")
            shutil.rmtree(folder, ignore_errors=True)
            os.replace(part, folder)
        finally:
            shutil.rmtree(part, ignore_errors=True)


def python_for_windows() -> Path:
    """The program of CPython for Windows."""
    with made_once(CACHE / "python", f"{CPYTHON} python3.dll") as part:
        if part:
            copy = ["dependency:copy", f"-Dartifact={CPYTHON}", f"-DoutputDirectory={part}"]
            subprocess.run([program("mvn"), "--quiet", "--batch-mode", *copy], check=True)
            (jar,) = part.glob("*.jar")
            with zipfile.ZipFile(jar) as archive:
                archive.extractall(part)
            jar.unlink()
            (library,) = part.glob("**/python311.dll")
            _stable_abi(library)
    return next((CACHE / "python").glob("**/windows-x86_64/python.exe"))


def _stable_abi(library: Path) -> None:
    """Write python3.dll, which Maven's CPython lacks, beside python311.dll: all names of that, forwarded to it."""
    python = lief.parse(library)
    names = (entry.name for entry in python.get_export().entries if entry.name)
    with tempfile.TemporaryDirectory() as folder:
        empty, exports = Path(folder, "empty.c"), Path(folder, "python3.def")
        empty.touch()
        lines = (f"{name}={library.stem}.{name}\n" for name in names)
        exports.write_text("LIBRARY python3\nEXPORTS\n" + "".join(lines), encoding="utf-8")
        zig = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu", "-shared", "-s"]
        subprocess.run([*zig, empty, exports, "-o", library.with_name("python3.dll")], check=True)


def packages(platform: str, name: str, *requirements: str) -> Path:
    """A folder of packages for a platform, unpacked by pip."""
    with made_once(CACHE / name, " ".join(requirements)) as part:
        if part:
            pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-compile"]
            target = [*(f"--platform={tag}" for tag in PIP_PLATFORMS[platform]), "--python-version=3.11", "--implementation=cp"]
            subprocess.run([*pip, *target, "--only-binary=:all:", f"--target={part}", *requirements], check=True)
    return CACHE / name


def prefix() -> Path:
    """The folder of wine's drives and registry."""
    with made_once(CACHE / "prefix") as part:
        if part:
            _run([program("wine"), "wineboot", "--init"], part)
            _run(["wineserver", "--wait"], part)
    return CACHE / "prefix"


def _run(command: list[str], wine_prefix: Path) -> None:
    environment = os.environ | {"WINEPREFIX": str(wine_prefix), "WINEDEBUG": "-all", "DISPLAY": ""}
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def of_this_checkout(platform: str) -> Path:
    """A folder with the core of this checkout and what pip would say of it; made anew for another core alone."""
    folder = ROOT / "build" / "emulated" / platform
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
    metadata = f"Metadata-Version: 2.1\nName: {PROJECT['name']}\nVersion: {version}\n"
    plugins = "".join(f"{name} = {module}\n" for name, module in PROJECT["entry-points"]["pytest11"].items())
    # Not with every command: others may be at work in it.
    with made_once(folder, f"{build_core(platform, travels=True).parent.name}\n{metadata}{plugins}") as part:
        if part:
            with zipfile.ZipFile(core_wheel(platform, part)) as archive:
                archive.extractall(part)
            information = part / f"virtual_pinhole-{version}.dist-info"
            information.mkdir()
            (information / "METADATA").write_text(metadata, encoding="utf-8")
            (information / "entry_points.txt").write_text(f"[pytest11]\n{plugins}", encoding="utf-8")
    return folder


def of_windows(path: Path) -> str:
    """The path as programs of Windows have it: wine's drive Z is this machine's root."""
    return "Z:" + str(path.absolute()).replace("/", "\\")


def windows(blender: str, bare: bool = False) -> tuple[list[str], dict[str, str]]:
    """The command of Python for Windows and its environment variables.

    blender : a version of BLENDERS.
    bare : with what that Blender's own Python has alone: neither this checkout nor tests.
    """
    folders = [packages("windows-x64", f"blender-{blender}", *BLENDERS[blender], *WINDOWS_ALONE)]
    if not bare:
        tests = packages("windows-x64", "windows-tests", *BUNDLED, *TESTS, *WINDOWS_TESTS, *WINDOWS_ALONE)
        folders += [tests, of_this_checkout("windows-x64"), ROOT]
    if blender == "5.0":
        folders.append(packages("windows-x64", "windows-judges", *JUDGES))
    # By a file of paths in a folder of the user's packages, since tests give their child processes a PYTHONPATH of their own.
    user = ROOT / "build" / "emulated" / f"windows-{blender}{'-bare' * bare}"
    site_packages = user / "Python311" / "site-packages"
    site_packages.mkdir(parents=True, exist_ok=True)
    lines = "".join(f"{of_windows(folder)}\n" for folder in folders)
    for name, text in (("folders.pth", lines), ("usercustomize.py", WINE_AS_WINDOWS)):
        if not (site_packages / name).exists() or (site_packages / name).read_text(encoding="utf-8") != text:
            (site_packages / name).write_text(text, encoding="utf-8")
    variables = {
        "WINEPREFIX": str(prefix()),
        "WINEDEBUG": "-all",
        "DISPLAY": "",
        "PYTHONUSERBASE": of_windows(user),
    }
    return [program("wine"), of_windows(python_for_windows())], variables


def arm64() -> tuple[list[str], dict[str, str]]:
    """The command of Python for Linux on arm64 and its environment variables."""
    root = CACHE / "debian-arm64"
    with made_once(root) as part:
        if part:
            debootstrap = [program("debootstrap"), "--foreign", "--arch=arm64", "--variant=minbase"]
            wanted = "--include=python3,libstdc++6,libgomp1"
            subprocess.run([*debootstrap, wanted, "bookworm", str(part)], check=True, stdout=subprocess.DEVNULL)
            for package in part.glob("var/cache/apt/archives/*.deb"):
                subprocess.run(["dpkg-deb", "--extract", package, part], check=True)
                package.unlink()
    folders = [packages("linux-arm64", "arm64-tests", *BUNDLED, *TESTS), of_this_checkout("linux-arm64"), ROOT]
    command = [program("qemu-aarch64-static"), "-L", str(root), str(root / "usr" / "bin" / "python3")]
    return command, {"PYTHONPATH": os.pathsep.join(map(str, folders))}


PLATFORMS = {
    "windows-4.2": lambda: windows("4.2"),
    "windows-5.0": lambda: windows("5.0"),
    "windows-4.2-bare": lambda: windows("4.2", bare=True),
    "linux-arm64": arm64,
}


def start(platform: str, *arguments: str | Path, **more: str) -> subprocess.Popen:
    """Start Python for a platform in the checkout; what it prints comes by a pipe. more : environment variables.

    wine 8 hands on no file that this process may only write to.
    """
    command, variables = PLATFORMS[platform]()
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return subprocess.Popen(
        [*command, *map(str, arguments)],
        env={**kept, **variables, **more},
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


def main() -> int:
    """Run Python for a platform with these arguments; its exit status."""
    platform, *arguments = sys.argv[1:]
    if platform not in PLATFORMS:
        sys.exit(f"{platform!r} is emulated by nothing here: give one of {', '.join(PLATFORMS)}")
    with start(platform, *arguments) as child:
        while printed := child.stdout.read1():
            sys.stdout.buffer.write(printed)
            sys.stdout.buffer.flush()
    return child.returncode


if __name__ == "__main__":
    try:
        sys.exit(main())
    except subprocess.CalledProcessError as error:
        sys.exit(f"{' '.join(map(str, error.cmd))} failed with status {error.returncode}: what it says is above")
