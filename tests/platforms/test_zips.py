"""The zips of all platforms that `make extension` has built, unpacked: what each brings is for its platform and all there.

Blender's own installers put every file of their wheels where Python imports it. They are those of the Blenders that are wheels
in .venv and .venvs (`make test-matrix`), run as they stand.
"""

import importlib.util
import re
import shutil
import sys
import sysconfig
import tomllib
import types
import zipfile
from pathlib import Path

import extension
import lief
import pytest

from hatch_build import PLATFORMS

ROOT = Path(__file__).resolve().parent.parent.parent
VERSION = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
PROCESSORS = {"x64": ("X86_64", "AMD64"), "arm64": ("ARM64", "AARCH64")}
"""Blender's name of a processor → those of ELF, PE and Mach-O."""
SYSTEM = {
    "linux": r"lib(c|m|pthread|dl|rt|gcc_s|stdc\+\+)\.so\.\d|ld-linux-.*\.so\.\d",
    "macos": r"/usr/lib/.*|/System/.*",
    "windows": r"(?i:kernel32|ntdll|advapi32|vcruntime140(_1)?|python3\d*|api-ms-win-.*)\.dll",
}
"""Names of libraries that a machine with Blender has: its system's, and Blender's Python and what that brings along."""


@pytest.fixture(params=PLATFORMS)
def platform(request) -> str:
    return request.param


@pytest.fixture
def unpacked(platform, tmp_path) -> Path:
    """The folder of a platform's zip."""
    with zipfile.ZipFile(ROOT / "dist" / f"virtual_pinhole-{VERSION}-{platform.replace('-', '_')}.zip") as archive:
        archive.extractall(tmp_path)
    return tmp_path


def processor_of(library: lief.Binary) -> str:
    if isinstance(library, lief.MachO.Binary):
        return library.header.cpu_type.name
    return (library.header.machine if isinstance(library, lief.PE.Binary) else library.header.machine_type).name


@pytest.mark.platforms
def test_every_wheel_is_for_its_platform_and_the_manifest_names_them_all(platform, unpacked):
    manifest = tomllib.loads((unpacked / "blender_manifest.toml").read_text(encoding="utf-8"))
    manifest = manifest["build"]["generated"]  # where Blender writes what is left of them in a platform's zip
    assert manifest["platforms"] == [platform]
    names = sorted(path.name for path in (unpacked / "wheels").iterdir())
    assert names == sorted(Path(name).name for name in manifest["wheels"])
    system, processor = re.fullmatch(r"([a-z]+)(?:_\d+)*_(.*)", PLATFORMS[platform][1]).groups()
    of_system = [name for name in names if not name.endswith("-any.whl")]
    assert all(re.search(rf"-{system}[^-]*_{processor}\.whl$", name) for name in of_system), of_system
    for package in ("openexr", "markupsafe"):
        pythons = {name.split("-")[2] for name in of_system if name.startswith(package)}
        assert pythons == {"cp311", "cp313", "cp314"}, f"{package} is there for {pythons}"
    assert [name.split("-")[2:4] for name in of_system if name.startswith("viewcam_core")] == [["py3", "none"]]


@pytest.mark.platforms
def test_every_library_in_it_finds_all_that_it_needs(platform, unpacked):
    system, processor = SYSTEM[platform.partition("-")[0]], PROCESSORS[platform.partition("-")[2]]
    count = 0
    for wheel in (unpacked / "wheels").iterdir():
        folder = unpacked / "site-packages" / wheel.stem
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(folder)
        beside = {path.name for path in folder.rglob("*")}
        for path in folder.rglob("*"):
            if path.suffix not in (".so", ".pyd", ".dll", ".dylib"):
                continue
            library, count = lief.parse(path), count + 1
            assert processor_of(library).upper() in processor, f"{path.name} is for {processor_of(library)}"
            needed = [str(getattr(each, "name", each)) for each in library.libraries]
            missing = [name for name in needed if not re.fullmatch(system, name) and Path(name).name not in beside]
            assert not missing, f"{wheel.name}: {path.name} needs {missing}"
    assert count >= 7, "OpenEXR's and MarkupSafe's for three Pythons, and the core"


SCRIPTS = sorted(ROOT.glob(".venv*/**/site-packages/bpy/?.?/scripts"), key=lambda scripts: scripts.parent.name)
"""A folder of Blender's own scripts for each Blender."""
SYSTEMS = {
    "linux-x64": "linux-x86_64",
    "linux-arm64": "linux-aarch64",
    "macos-arm64": "macosx-11.00-arm64",
    "macos-x64": "macosx-11.00-x86_64",
    "windows-x64": "win-amd64",
    "windows-arm64": "win-arm64",
}
"""Blender's name of a platform → what its Python says of the system (sysconfig.get_platform)."""


def loaded(name: str, path: Path) -> types.ModuleType:
    """A module from a file, under a name of its own."""
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


class Installer:
    """Blender's installer of the wheels of a zip: choose among them, then unpack."""

    def __init__(self, scripts: Path) -> None:
        name = f"bl_pkg_{scripts.parent.name.replace('.', '_')}"
        package = scripts / "addons_core" / "bl_pkg"
        self._manager = loaded(
            f"{name}_wheel_manager", scripts / "modules" / "_bpy_internal" / "extensions" / "wheel_manager.py"
        )
        sys.modules[name] = types.ModuleType(name)
        # The module whose functions bl_extension_utils hands on.
        loaded(f"{name}.bl_extension_utils", package / "cli" / "blender_ext.py")
        # The module as a whole needs bpy; this function of it needs whether Python is being debugged.
        source = (package / "bl_extension_ops.py").read_text(encoding="utf-8")
        start = source.index("def _extensions_wheel_filter_for_this_system(")
        end = source.index("\ndef ", start)
        bpy = types.SimpleNamespace(app=types.SimpleNamespace(debug_python=True))
        self._space = {"bpy": bpy, "__package__": name, "__name__": f"{name}.bl_extension_ops"}
        exec(source[start:end], self._space)

    @property
    def moves_files(self) -> bool:
        """True if it does as pip with what a wheel keeps in platlib and purelib."""
        return hasattr(self._manager, "_wheel_zipfile_normalize")

    def chosen(self, wheels: list[Path], platform: str, python: str) -> list[Path]:
        """The wheels that it takes on a platform with a Python."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sysconfig, "get_platform", lambda: SYSTEMS[platform])
            patch.setattr(sys, "version_info", (*map(int, python.split(".")), 0, "final", 0))
            names = self._space["_extensions_wheel_filter_for_this_system"]([f"./wheels/{wheel.name}" for wheel in wheels])
        return [wheel for wheel in wheels if f"./wheels/{wheel.name}" in names]

    def installed(self, wheels: list[Path], folder: Path) -> Path:
        """The folder of modules that it unpacks wheels to, in a folder of extensions."""
        site_packages, errors = folder / "lib" / "site-packages", []
        site_packages.mkdir(parents=True, exist_ok=True)
        with pytest.MonkeyPatch.context() as patch:
            # By the name that its own Python has for what to do about an error.
            remove = shutil.rmtree
            patch.setattr(shutil, "rmtree", lambda path, **on_error: remove(path))
            self._manager.apply_action(
                local_dir=str(folder),
                local_dir_site_packages=str(site_packages),
                wheel_list=[("user_default.virtual_pinhole", [str(wheel) for wheel in wheels])],
                error_fn=errors.append,
                remove_error_fn=lambda path, error: errors.append((path, error)),
                debug=False,
            )
        assert not errors, errors
        return site_packages


def files_of_pip(wheel: Path) -> set[str]:
    """The files that pip puts into the folder of modules, but for what it knows of the wheel."""
    with zipfile.ZipFile(wheel) as archive:
        names = [name for name in archive.namelist() if not name.endswith("/")]
    files = set()
    for name in names:
        top, _, rest = name.partition("/")
        if top.endswith(".data"):
            scheme, _, rest = rest.partition("/")
            if scheme in ("platlib", "purelib"):
                files.add(rest)
        elif not top.endswith(".dist-info"):
            files.add(name)
    return files


def files_in(folder: Path) -> set[str]:
    paths = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    return {path.as_posix() for path in paths if not path.parts[0].endswith((".dist-info", ".data"))}


def names_of(wheels: list[Path]) -> list[str]:
    return sorted(wheel.name.partition("-")[0].lower() for wheel in wheels)


@pytest.fixture(params=SCRIPTS, ids=lambda scripts: scripts.parent.name)
def installer(request) -> Installer:
    return Installer(request.param)


def test_there_are_installers_to_be_tried():
    assert SCRIPTS, "there is no bpy in .venv or .venvs"


@pytest.mark.platforms
@pytest.mark.parametrize("platform", extension.PLATFORMS)
def test_every_installer_puts_each_file_where_python_imports_it(installer, platform, tmp_path):
    wheels = [*extension.pure_wheels(), *extension.wheels_of(platform)]
    for python in extension.PYTHONS:
        chosen = installer.chosen(wheels, platform, python)
        assert names_of(chosen) == ["jinja2", "markupsafe", "openexr", "tqdm"], f"Python {python} takes {chosen}"
        site_packages = installer.installed(chosen, tmp_path / python)
        assert files_in(site_packages) == set.union(*map(files_of_pip, chosen)), f"with Python {python}"


@pytest.mark.platforms
@pytest.mark.parametrize("platform", extension.PLATFORMS)
def test_no_wheel_needs_an_installer_that_moves_files(platform):
    """Blender 4.2 and 4.3 move none; all supported ones get the same wheels."""
    for wheel in [*extension.pure_wheels(), *extension.wheels_of(platform)]:
        with zipfile.ZipFile(wheel) as archive:
            moved = [name for name in archive.namelist() if ".data/p" in name.partition("-")[2]]
        assert not moved, f"{wheel.name} keeps {moved}"


@pytest.fixture
def upstream(tmp_path) -> Path:
    """A wheel that keeps a library where pip moves it from, as OpenEXR's for Windows does."""
    path = tmp_path / "thing-1.2-cp311-cp311-win_amd64.whl"
    wheel = b"Wheel-Version: 1.0\nRoot-Is-Purelib: false\nTag: cp311-cp311-win_amd64\n"
    contents = {
        "thing.pyd": b"module",
        "thing-1.2.data/platlib/c.dll": b"library",
        "thing-1.2.data/purelib/pure/__init__.py": b"",
        "thing-1.2.dist-info/METADATA": b"Metadata-Version: 2.1\nName: thing\nVersion: 1.2\n\nVersion: of the text\n",
        "thing-1.2.dist-info/WHEEL": wheel,
    }
    extension.write_wheel(path, "thing-1.2.dist-info", contents)
    return path


def test_a_repacked_wheel_is_installed_in_place_of_what_another_add_on_left_half_unpacked(installer, upstream, tmp_path):
    repacked = extension.importable(upstream)
    assert repacked.name == "thing-1.2+importable-cp311-cp311-win_amd64.whl"
    installer.installed([upstream], tmp_path / "extensions")
    site_packages = installer.installed([upstream, repacked], tmp_path / "extensions")
    assert files_in(site_packages) >= {"thing.pyd", "c.dll", "pure/__init__.py"}
    metadata = (site_packages / "thing-1.2+importable.dist-info" / "METADATA").read_text(encoding="utf-8")
    assert metadata.splitlines()[2:] == ["Version: 1.2+importable", "", "Version: of the text"]
    assert not list(installer.installed([], tmp_path / "extensions").iterdir()), "removed, it leaves something behind"


def test_a_wheel_without_data_is_taken_as_it_is(upstream):
    assert extension.importable(extension.importable(upstream)) == extension.importable(upstream)


def test_a_wheel_as_upstream_makes_it_lacks_a_library_where_an_installer_moves_nothing(installer, upstream, tmp_path):
    """The reason for the repacking: once every supported Blender moves files, it can go."""
    whole = files_in(installer.installed([upstream], tmp_path / "extensions")) == files_of_pip(upstream)
    assert whole == installer.moves_files
