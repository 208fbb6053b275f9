"""Builds the extension with its wheels: `python .ci/extension.py BLENDER OUTPUT-FOLDER [PLATFORM…]`, all platforms by default.

The wheels are no part of the checkout, and a manifest that names missing ones can't be built; so the manifest in the checkout
names none, and Blender builds from a copy to which the wheels and their names are added. One zip a platform: the tracer's core
has one wheel for all Pythons, OpenEXR and MarkupSafe, which Jinja2 needs, one for each Python of Blender 4.2 to 5.2.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
from hatch_build import core_wheel, write_wheel  # noqa: E402 - only now is it known where that is

CONTENTS = ["__init__.py", "viewcam_addon", "README.md", "LICENSE"]

PYTHONS = ["3.11", "3.13", "3.14"]
WHEELS = {"OpenEXR": "3.5.3", "MarkupSafe": "3.0.4"}
# In Python alone: one wheel for all of them.
PURE_WHEELS = {"Jinja2": "3.1.6", "tqdm": "4.70.1"}
# Blender's name of a platform, and pip's: what a wheel may ask for and Blender 4.2's own minimum grants.
PLATFORMS = {
    "linux-x64": ["manylinux_2_28_x86_64"],
    "linux-arm64": ["manylinux_2_28_aarch64"],
    "macos-arm64": ["macosx_13_0_arm64", "macosx_11_0_arm64"],
    "macos-x64": ["macosx_13_0_x86_64"],
    "windows-x64": ["win_amd64"],
    "windows-arm64": ["win_arm64"],
}


def wheels_of(platform: str) -> list[Path]:
    """The wheels of one platform for every Python, downloaded where they are not there yet."""
    tags = [f"--platform={tag}" for tag in PLATFORMS[platform]]
    return [
        wheel
        for package, version in WHEELS.items()
        for python in PYTHONS
        for wheel in _wheels(platform, package, version, f"cp{python.replace('.', '')}", f"--python-version={python}", *tags)
    ]


def pure_wheels() -> list[Path]:
    """The wheels that any Python takes on any platform."""
    return [wheel for package, version in PURE_WHEELS.items() for wheel in _wheels("any", package, version, "py3-none-any")]


def _wheels(folder_name: str, package: str, version: str, tag: str, *target: str) -> list[Path]:
    folder = ROOT / "wheels" / folder_name
    pattern = f"{package.lower()}-{version}-{tag}*.whl"
    if not list(folder.glob(pattern)):
        print(f"Downloading {package} {version}, {folder_name}, {tag}", flush=True)
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--quiet", "--no-deps"]
        subprocess.run([*pip, "--only-binary=:all:", *target, f"--dest={folder}", f"{package}=={version}"], check=True)
    return [importable(wheel) for wheel in folder.glob(pattern)]


def importable(wheel: Path) -> Path:
    """A wheel whose every module and library lies where it is imported from: the given one, or its copy as a local version.

    Pip moves what a wheel keeps in NAME-VERSION.data/platlib or purelib to the top. The installers of Blender 4.2 and 4.3 leave
    it where it is, and no loader finds it: OpenEXR's C++ library on Windows (PEP 427; Blender's wheel_manager.py).
    The version is another, since an installer keeps what it has of the same version, from whichever add-on.
    """
    name, version, tags = wheel.stem.split("-", 2)
    old, new = f"{name}-{version}", f"{name}-{version}+importable"
    with zipfile.ZipFile(wheel) as archive:
        if not any(entry.startswith(f"{old}.data/") for entry in archive.namelist()):
            return wheel
        contents = {}
        for entry in archive.infolist():
            if entry.is_dir() or entry.filename == f"{old}.dist-info/RECORD":
                continue
            place = entry.filename.removeprefix(f"{old}.data/platlib/").removeprefix(f"{old}.data/purelib/")
            if place.startswith(f"{old}.dist-info/"):
                place = new + place.removeprefix(old)
            contents[place] = archive.read(entry)
    metadata = f"{new}.dist-info/METADATA"
    line = f"\nVersion: {version}".encode()
    contents[metadata] = contents[metadata].replace(line, line + b"+importable", 1)
    path = wheel.with_name(f"{new}-{tags}.whl")
    write_wheel(path, f"{new}.dist-info", contents)
    return path


def stage(folder: Path, platforms: list[str]) -> None:
    """Copy what belongs into the extension, with the wheels, to `folder`."""
    for name in CONTENTS:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, folder)
    wheels = [*pure_wheels(), *(wheel for platform in platforms for wheel in wheels_of(platform))]
    wheels += [core_wheel(platform, ROOT / "wheels" / platform) for platform in platforms]
    (folder / "wheels").mkdir()
    for wheel in wheels:
        os.symlink(wheel, folder / "wheels" / wheel.name)
    names = "".join(f'    "./wheels/{wheel.name}",\n' for wheel in wheels)
    manifest = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    top, permissions, rest = manifest.partition("[permissions]")
    added = f"platforms = {platforms}\nwheels = [\n{names}]\n\n".replace("'", '"')
    (folder / "blender_manifest.toml").write_text(top + added + permissions + rest, encoding="utf-8")


def main(blender: str, output: Path, platforms: list[str]) -> None:
    """Build one zip a platform into `output` and print their paths."""
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="virtual-pinhole-") as scratch:
        source, built = Path(scratch, "source"), Path(scratch, "built")
        source.mkdir()
        built.mkdir()
        stage(source, platforms)
        command = [blender, "--command", "extension", "build", "--split-platforms"]
        subprocess.run([*command, f"--source-dir={source}", f"--output-dir={built}"], check=True)
        zips = sorted(built.glob("*.zip"))
        if len(zips) != len(platforms):
            sys.exit(f"Blender built {len(zips)} zips of {len(platforms)}: what it says is above")
        for path in zips:
            print(f"{shutil.move(path, output / path.name)}  {(output / path.name).stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    try:
        main(sys.argv[1], Path(sys.argv[2]), sys.argv[3:] or list(PLATFORMS))
    except subprocess.CalledProcessError as error:
        sys.exit(f"{' '.join(map(str, error.cmd))} failed with status {error.returncode}: what it says is above")
