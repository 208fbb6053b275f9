"""The project's own rules, held by tests: floors, sizes, one version, a tidy top level, a manifest that Blender accepts."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "viewcam_addon"

# From the ground to the roof: a room imports from those before it. The package's __init__ and __main__ only open doors.
FLOORS = [
    "errors",
    "checks",
    "files",
    "terminal",
    "events",
    "words",
    "paper",
    "children",
    "exact",
    "pinhole",
    "roll",
    "moves",
    "diagram",
    "image",
    "intrinsics",
    "camera_text",
    "datasets",
    "compare",
    "tracer",
    "shots",
    "batch",
    "blender",
    "commands",
    "batch_words",
    "cli",
]
# The same inside the tracer.
TRACER_FLOORS = ["scene", "tiles", "native", "render"]
# And where Blender is: first what is of the camera.
BLENDER_FLOORS = [
    "versions",
    "borrowing",
    "findings",
    "rotation",
    "render_settings",
    "preferences",
    "datablocks",
    "picture",
    "targets",
    "hold",
    "pose",
    "suspects",
    "camera",
    "rolling",
    "properties",
    "resolution",
    "animation",
    "scenes",
    "rendering",
    "interface",
    "batch",
]
HOUSES = {"tracer": TRACER_FLOORS, "blender": BLENDER_FLOORS}
ROOF = {"__init__", "__main__"}

# What exists inside Blender only.
BLENDER_MODULES = {
    "bpy",
    "mathutils",
    "bmesh",
    "gpu",
    "gpu_extras",
    "blf",
    "bl_math",
    "bl_ui",
    "bl_operators",
    "bpy_extras",
    "idprop",
}
NEEDS_BLENDER = PACKAGE / "blender"

TOP_LEVEL = {"blender_manifest.toml", "viewcam_addon", "tests", "sample_scenes", "README.md", "docs", "benchmarks"}
BUILD_FILES = {"__init__.py", "pyproject.toml", "hatch_build.py", "Makefile", "LICENSE"}


def imported_modules(source: str, package: tuple[str, ...]) -> set[str]:
    """The modules that `source` imports anywhere, dotted and absolute; `package` is where its relative imports start."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found.add(node.module)
        elif isinstance(node, ast.ImportFrom):
            start = [*package[: len(package) - node.level + 1], *(node.module.split(".") if node.module else [])]
            found |= {".".join([*start, name.name]) for name in node.names}
    return found


def climbing_imports(source: str, path: Path) -> set[str]:
    """What `source`, as the file `path` relative to the package, imports from a floor above its own."""
    imports = imported_modules(source, ("viewcam_addon", *path.parent.parts))
    climbing = _climbing(imports, path.parts, "viewcam_addon", FLOORS)
    for house, floors in HOUSES.items():
        if path.parts[0] == house:
            climbing |= _climbing(imports, path.parts[1:], f"viewcam_addon.{house}", floors)
    return climbing


def _climbing(imports: set[str], path: tuple[str, ...], package: str, floors: list[str]) -> set[str]:
    floor = path[0].removesuffix(".py")
    if floor in ROOF:
        return set()
    above = floors[floors.index(floor) + 1 :]
    return {name for name in imports if any(f"{name}.".startswith(f"{package}.{room}.") for room in above)}


def blender_imports(source: str) -> set[str]:
    """The Blender modules that `source` imports, whether at once or in a function."""
    return {name for name in imported_modules(source, ("viewcam_addon",)) if name.split(".")[0] in BLENDER_MODULES}


def sources() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def tracked_files() -> list[str]:
    return subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")[
        :-1
    ]


@pytest.mark.parametrize("path", [path.relative_to(PACKAGE) for path in sources()], ids=str)
def test_imports_point_down_only(path):
    climbing = climbing_imports((PACKAGE / path).read_text(encoding="utf-8"), path)
    assert not climbing, f"{path} imports from a floor above its own: {sorted(climbing)}"


@pytest.mark.parametrize(
    ("source", "path"),
    [
        ("from . import image", "pinhole.py"),
        ("from ..blender.camera import apply", "tracer/render.py"),
        ("def late():\n    import viewcam_addon.cli", "blender/camera.py"),
        ("from .. import cli", "blender/camera.py"),
        ("from .render import Tracer", "tracer/native.py"),
        ("from ..native import CoreScene", "tracer/scene/lamps.py"),
        ("from .rendering import job", "blender/camera.py"),
    ],
)
def test_an_import_that_climbs_is_seen(source, path):
    assert climbing_imports(source, Path(path))


def test_every_room_has_a_floor():
    rooms = {path.relative_to(PACKAGE).parts[0].removesuffix(".py") for path in sources()}
    assert rooms - ROOF == set(FLOORS), "say in FLOORS on which floor the new room is"
    for house, floors in HOUSES.items():
        inside = PACKAGE / house
        rooms = {path.relative_to(inside).parts[0].removesuffix(".py") for path in inside.rglob("*.py")}
        assert rooms - ROOF == set(floors), f"say in {house.upper()}_FLOORS on which floor the new room is"


def test_imports_inside_the_package_are_relative():
    """Inside Blender the package's name is bl_ext.user_default.virtual_pinhole.viewcam_addon."""
    absolute = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in sources()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if (isinstance(node, ast.Import) and any(name.name.split(".")[0] == "viewcam_addon" for name in node.names))
        or (isinstance(node, ast.ImportFrom) and node.level == 0 and node.module.split(".")[0] == "viewcam_addon")
    ]
    assert not absolute, f"absolute imports of the package: {absolute}"


def test_only_blender_knows_blender():
    outside = {
        path: blender_imports(path.read_text(encoding="utf-8")) for path in sources() if NEEDS_BLENDER not in path.parents
    }
    guilty = {str(path.relative_to(ROOT)): sorted(names) for path, names in outside.items() if names}
    assert not guilty, f"Blender's modules are imported outside viewcam_addon/blender: {guilty}"


@pytest.mark.parametrize("source", ["import bpy", "def late():\n    from mathutils import Matrix", "import bpy.types as t"])
def test_an_import_of_blender_is_seen(source):
    assert blender_imports(source)


def test_only_the_room_of_images_reads_exr_files():
    """Two copies of the OpenEXR library in Blender's process crash it: one door, which blender/ doesn't open."""
    users = {
        str(path.relative_to(PACKAGE))
        for path in sources()
        if "OpenEXR" in imported_modules(path.read_text(encoding="utf-8"), ("viewcam_addon",))
    }
    assert users == {"image.py"}


def test_everything_outside_blender_imports_where_there_is_no_blender():
    modules = ["viewcam_addon"]
    for path in sources():
        if NEEDS_BLENDER not in path.parents and path.stem not in ROOF:
            modules.append(".".join(path.relative_to(ROOT).with_suffix("").parts))
    program = "\n".join(
        [
            "import importlib, sys",
            f"sys.modules.update(dict.fromkeys({sorted(BLENDER_MODULES)}))",
            f"for name in {modules}:",
            "    importlib.import_module(name)",
        ]
    )
    outcome = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert outcome.returncode == 0, outcome.stderr


def test_the_version_stands_in_one_place():
    manifest = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "version" not in project["project"] and project["project"]["dynamic"] == ["version"]
    found = [match["version"] for match in re.finditer(project["tool"]["hatch"]["version"]["pattern"], manifest)]
    assert found == [tomllib.loads(manifest)["version"]]


def test_blender_accepts_the_manifest():
    bpy = pytest.importorskip("bpy")
    tool = Path(bpy.utils.system_resource("SCRIPTS"), "addons_core", "bl_pkg", "cli", "blender_ext.py")
    outcome = subprocess.run([sys.executable, tool, "validate", ROOT], capture_output=True, text=True)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr


def test_the_top_level_is_the_fixed_one():
    top = {Path(name).parts[0] for name in tracked_files()}
    extra = {name for name in top - TOP_LEVEL - BUILD_FILES if not name.startswith(".")}
    assert not extra, f"not a part of the top level: {sorted(extra)}"


def test_what_the_readme_says_viewcam_does_it_does():
    promised = set(re.findall(r"(?m)(?:`|--command |^ *)viewcam ([a-z]+)", (ROOT / "README.md").read_text(encoding="utf-8")))
    assert {"check", "demo"} <= promised
    for name in sorted(promised):
        command = [sys.executable, "-m", "viewcam_addon", name, "--help"]
        outcome = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        assert outcome.returncode == 0 and name in outcome.stdout, f"viewcam {name}: {outcome.stderr}"


def test_what_the_readme_says_to_make_can_be_made():
    targets = set(re.findall(r"(?m)^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8")))
    promised = set(re.findall(r"(?m)(?:`|^ *)make ([a-z-]+)", (ROOT / "README.md").read_text(encoding="utf-8")))
    assert {"demo", "test"} <= promised, f"the README doesn't show the two commands, only {sorted(promised)}"
    assert promised <= targets, f"the Makefile can't make {sorted(promised - targets)}"
