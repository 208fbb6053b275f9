"""The zips of all platforms that `make extension` has built, unpacked: what each brings is for its platform and all there."""

import re
import tomllib
import zipfile
from pathlib import Path

import lief
import pytest

from hatch_build import PLATFORMS

pytestmark = pytest.mark.platforms

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
