"""Compiles the tracer's core, and puts it into wheels: `python hatch_build.py [PLATFORM …]` makes one wheel of the core each.

The core (viewcam_addon/tracer/core) is a library with a plain C interface: it knows no Python, so that one serves all versions.
It travels as a package of its own, `viewcam_core`, which holds nothing else: inside the project's wheel when pip installs that,
editable or not, and as a wheel beside the extension's others, since Blender takes binaries as wheels only.

The system's C++20 compiler ($CXX, c++, g++, clang++) compiles for this machine; where there is none, and for other machines,
ziglang does, a clang with the headers of every system that pip installs: what GCC links here asks for this machine's C library,
and Blender itself asks for that of 2018. Compiled once for each instruction set of x86-64 that it chooses among at run time; a
library is kept in build/core/ under a name that tells what it was made from.

Rejected: an extension module (one for each Python and platform), CMake and scikit-build-core (a dozen lines of build rules, and
a second tool where there is no compiler), -ffast-math and -march=native (pictures' bits would depend on the machine).
"""

import argparse
import base64
import concurrent.futures
import contextlib
import functools
import hashlib
import inspect
import os
import platform as machine
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ModuleNotFoundError:  # compiling alone (--compile) asks for nothing beside Python
    BuildHookInterface = object

ROOT = Path(__file__).resolve().parent
CORE = ROOT / "viewcam_addon" / "tracer" / "core"
PACKAGE = "viewcam_core"

ZIGLANG = "ziglang>=0.16"
# Blender's name of a platform: zig's, that of wheels, the library's file.
PLATFORMS = {
    "linux-x64": ("x86_64-linux-gnu.2.28", "manylinux_2_28_x86_64", "libviewcam.so"),
    "linux-arm64": ("aarch64-linux-gnu.2.28", "manylinux_2_28_aarch64", "libviewcam.so"),
    "windows-x64": ("x86_64-windows-gnu", "win_amd64", "viewcam.dll"),
    "windows-arm64": ("aarch64-windows-gnu", "win_arm64", "viewcam.dll"),
    "macos-x64": ("x86_64-macos.11.0", "macosx_11_0_x86_64", "libviewcam.dylib"),
    "macos-arm64": ("aarch64-macos.11.0", "macosx_11_0_arm64", "libviewcam.dylib"),
}
# Instances of the core: x86-64's levels; any other processor has one, and so has what is only to be tested.
LEVELS = ("v2", "v3", "v4")
ONE_INSTANCE = "-DVIEWCAM_ONE_INSTANCE"
# No contraction: a product and its sum round apart, which the triangle test stands on (core/shapes/triangle_mesh.h). No errno:
# square roots are instructions.
# Nothing of wide vectors is passed between what different compilers compile, of which clang would warn a thousand times.
FLAGS = ["-std=c++20", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden", "-DNDEBUG", "-g0", "-Wno-psabi"]
_PROBE = "#include <bit>\n#include <thread>\n#include <variant>\nint main() { return std::popcount(0u); }\n"


def this_platform() -> str:
    """Blender's name of this machine's platform."""
    system = {"Linux": "linux", "Windows": "windows", "Darwin": "macos"}[machine.system()]
    return f"{system}-{'arm64' if machine.machine().lower() in ('arm64', 'aarch64') else 'x64'}"


@functools.cache
def system_compiler() -> str | None:
    """The system's C++20 compiler, or None."""
    for name in (os.environ.get("CXX"), "c++", "g++", "clang++"):
        if name and shutil.which(name):
            command = [name, "-std=c++20", "-x", "c++", "-fsyntax-only", "-"]
            if subprocess.run(command, input=_PROBE, text=True, capture_output=True).returncode == 0:
                return name
    return None


def build_core(platform: str, flags: tuple[str, ...] = (), travels: bool = False) -> Path:
    """The library for a platform, compiled where it is not there yet.

    flags : more of them, as sanitizers need.
    travels : true to compile by ziglang, for machines whose C library is older than this one's.
    """
    compiler = system_compiler() if platform == this_platform() and not travels else None
    library, options = _place(platform, compiler, flags)
    library.parent.mkdir(parents=True, exist_ok=True)
    with _alone(library.parent):
        if not library.exists():
            command = [*([compiler] if compiler else [sys.executable, "-m", "ziglang", "c++"]), *options]
            with tempfile.TemporaryDirectory(dir=library.parent) as scratch:
                os.replace(_compiled(platform, command, compiler is None, Path(scratch)), library)
    return library


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """A folder's lock, so that of two processes that need a library one compiles it, where the system has such locks."""
    try:
        import fcntl
    except ModuleNotFoundError:
        yield
        return
    with open(folder / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _place(platform: str, compiler: str | None, flags: tuple[str, ...] = ()) -> tuple[Path, list[str]]:
    """The place of the library that these make, and all options of the compiler, which is ziglang's if it is None."""
    target, _, name = PLATFORMS[platform]
    options = [
        *([] if compiler else ["-target", target]),
        *FLAGS,
        *([] if platform.startswith("windows") else ["-fPIC"]),
        *flags,
    ]
    if platform.startswith("macos"):
        options.append(f"-Wl,-install_name,@rpath/{name}")  # in place of the folder that it is linked in
    made_from = hashlib.sha256((repr((compiler, options)) + inspect.getsource(_compiled)).encode())
    for path in sorted(path for path in CORE.rglob("*") if path.suffix in (".h", ".cpp")):
        made_from.update(f"{path.relative_to(CORE)}\0".encode() + path.read_bytes())
    return ROOT / "build" / "core" / f"{platform}-{made_from.hexdigest()[:16]}" / name, options


def _compiled(platform: str, command: list[str], zig: bool, folder: Path) -> Path:
    """The library, made in a folder: the C interface once, the core once for each instruction set."""
    march = "-mcpu=x86_64_" if zig else "-march=x86-64-"
    if platform.endswith("x64") and ONE_INSTANCE not in command:
        wide = {"v4": ["-mprefer-vector-width=256"]}  # 512 slows the clock of many processors down
        parts = [("capi", [march + LEVELS[0]])]
        parts += [(level, [march + level, f"-DVIEWCAM_ISA={level}", *wide.get(level, [])]) for level in LEVELS]
    else:
        parts = [("capi", []), ("base", ["-DVIEWCAM_ISA=base"])]

    def compiled(part: tuple[str, list[str]]) -> str:
        name, flags = part
        source, target = CORE / ("capi.cpp" if name == "capi" else "instance.cpp"), folder / f"{name}.o"
        _run([*command, *flags, "-c", str(source), "-o", str(target)])
        return str(target)

    linked = [*command, "-shared", "-s"]
    if platform.startswith("linux"):
        exports = folder / "exports"  # the C interface alone: what is inlined of the standard library stays here
        exports.write_text("{ global: viewcam_*; local: *; };\n", encoding="utf-8")
        linked += ["-pthread", f"-Wl,--version-script={exports}", *([] if zig else ["-static-libstdc++", "-static-libgcc"])]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        if zig:  # which compiles its C++ library where one is first linked so: as long as it takes for three instances
            empty = folder / "empty.cpp"
            empty.touch()
            first = pool.submit(_run, [*linked, str(empty), "-o", str(folder / "empty")])
        objects = list(pool.map(compiled, parts))
        if zig:
            first.result()
    library = folder / PLATFORMS[platform][2]
    # Linkers take the first of several definitions of a name: that of the least instruction set.
    _run([*linked, *objects, "-o", str(library)])
    return library


def _run(command: list[str]) -> None:
    outcome = subprocess.run(command, capture_output=True, text=True)
    if outcome.returncode:
        sys.exit(f"{' '.join(command)} failed with status {outcome.returncode}:\n{outcome.stderr}")


def core_wheel(platform: str, folder: Path) -> Path:
    """A wheel that holds the library and nothing else, for all Pythons of a platform; what Blender's extension brings along."""
    library = build_core(platform, travels=True)
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
    tag = f"py3-none-{PLATFORMS[platform][1]}"
    info = f"{PACKAGE}-{version}.dist-info"
    contents = {
        f"{PACKAGE}/__init__.py": b"",
        f"{PACKAGE}/{library.name}": library.read_bytes(),
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {PACKAGE}\nVersion: {version}\nLicense: GPL-3.0-or-later\n".encode(),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: {PACKAGE}\nRoot-Is-Purelib: false\nTag: {tag}\n".encode(),
    }
    path = folder / f"{PACKAGE}-{version}-{tag}.whl"
    write_wheel(path, info, contents)
    return path


def write_wheel(path: Path, info: str, contents: dict[str, bytes]) -> None:
    """Write a wheel of files by name and a RECORD of them. info : NAME-VERSION.dist-info."""
    record = "".join(
        f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},{len(data)}\n"
        for name, data in contents.items()
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in [*contents.items(), (f"{info}/RECORD", f"{record}{info}/RECORD,,\n".encode())]:
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)


class CoreBuildHook(BuildHookInterface):
    """The hook that hatchling calls when pip builds the project."""

    def dependencies(self) -> list[str]:
        """A compiler, where the system has none and there is something to compile."""
        return [] if system_compiler() or _place(this_platform(), None)[0].exists() else [ZIGLANG]

    def initialize(self, version: str, build_data: dict) -> None:
        """Compile for this machine. version : "standard" or "editable"."""
        if self.target_name != "wheel":
            return
        platform = this_platform()
        library = build_core(platform)
        empty = library.with_name("__init__.py")
        empty.touch()
        included = {str(library): f"{PACKAGE}/{library.name}", str(empty): f"{PACKAGE}/__init__.py"}
        build_data["force_include_editable" if version == "editable" else "force_include"].update(included)
        build_data["pure_python"] = False
        # The platform of a core that ziglang compiled, or this machine for itself.
        tag = sysconfig.get_platform() if system_compiler() else PLATFORMS[platform][1]
        build_data["tag"] = f"py3-none-{tag.replace('-', '_').replace('.', '_')}"


def sanitized(sanitizers: str, folder: Path) -> None:
    """The package compiled for this machine with sanitizers, as compilers name them, in a folder for PYTHONPATH."""
    flags = f"-fsanitize={sanitizers}", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer", "-g1"
    library = build_core(this_platform(), (*flags, "-O1", ONE_INSTANCE))
    (folder / PACKAGE).mkdir(parents=True, exist_ok=True)
    (folder / PACKAGE / "__init__.py").touch()
    shutil.copy(library, folder / PACKAGE)


def main() -> None:
    """Make the core's wheels for platforms, this one by default, into a folder."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("platforms", nargs="*", default=[this_platform()], metavar="PLATFORM", help=", ".join(PLATFORMS))
    parser.add_argument("--into", type=Path, default=ROOT / "dist", metavar="FOLDER", help="dist by default")
    parser.add_argument("--sanitize", metavar="NAMES", help="no wheel: the package for this machine, to be tested")
    parser.add_argument(
        "--compile", action="store_true", help="no wheel: the library that pip's wheel for this machine will hold"
    )
    arguments = parser.parse_args()
    if arguments.compile:
        build_core(this_platform())
        return None
    if arguments.sanitize:
        return sanitized(arguments.sanitize, arguments.into)
    for platform in arguments.platforms:
        if platform not in PLATFORMS:
            parser.error(f"there is no platform {platform!r}: give some of {', '.join(PLATFORMS)}")
        path = core_wheel(platform, arguments.into)
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
