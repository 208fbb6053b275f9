"""The project's own rules, held by tests.

Where Blender may be known, which room imports from which, one version, a tidy top level, a manifest that Blender accepts, and
that what documents name exists.
"""

import ast
import concurrent.futures
import functools
import graphlib
import json
import re
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from viewcam_addon import cli

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "viewcam_addon"

# The rooms of viewcam_addon, and of blender/, with those that each imports from. A new arrow is a decision: say it here, or
# leave it out. The package's __init__ and __main__ only open doors.
ROOMS = {
    "errors": "",
    "checks": "errors",
    "machine": "errors",
    "npy": "",
    "files": "errors",
    "file_names": "errors checks",
    "terminal": "",
    "events": "terminal",
    "argument_types": "",
    "html_page": "errors",
    "junit": "checks files",
    "png": "",
    "child_process": "errors events files",
    "usd_stage": "errors child_process files",
    "crashes": "",
    "exact": "",
    "pinhole": "errors checks exact",
    "roll": "errors pinhole",
    "rotation": "pinhole",
    "moves": "errors checks exact pinhole",
    "diagram": "pinhole",
    "photo_match": "errors checks pinhole",
    "image": "errors machine files terminal pinhole",
    "intrinsics": "errors checks pinhole",
    "camera_values": "errors checks pinhole roll intrinsics",
    "cameras": "errors checks files file_names terminal npy usd_stage pinhole rotation intrinsics",
    "comparison": "errors files html_page pinhole image png",
    "tracer": "errors checks machine files npy pinhole image",
    "labels": "errors machine files npy png pinhole image cameras tracer",
    "api": "errors image comparison tracer labels",
    "pytest_plugin": "errors junit jobs",
    "jobs": (
        "file_names "
        "errors checks machine files terminal events argument_types html_page child_process png pinhole moves image cameras "
        "comparison "
        "tracer labels api"
    ),
    "blender": (
        "file_names "
        "errors checks files terminal events html_page child_process png pinhole roll rotation moves diagram photo_match image "
        "intrinsics camera_values cameras comparison tracer labels jobs"
    ),
    "commands": (
        "errors files file_names terminal argument_types events crashes pinhole image cameras comparison tracer labels api jobs"
    ),
    "cli": "errors checks files junit events argument_types commands",
}
BLENDER_ROOMS = {
    "versions": "",
    "temporary_settings": "versions",
    "another_blender": "",
    "opening": "temporary_settings",
    "picture": "temporary_settings",
    "findings": "",
    "render_settings": "",
    "preferences": "render_settings",
    "datablocks": "versions",
    "pose": "versions",
    "conversion": "findings datablocks pose",
    "storage": "versions datablocks",
    "targets": "versions datablocks pose storage",
    "hold": "versions storage targets",
    "causes": "versions findings datablocks storage pose",
    "camera": "findings preferences datablocks pose conversion storage targets hold causes",
    "properties": "datablocks storage targets camera",
    "resolution": "datablocks storage camera",
    "dataset_cameras": "opening datablocks camera",
    "own_picture": "",
    "animation": "datablocks storage targets camera resolution",
    "scenes": "versions temporary_settings another_blender picture findings datablocks pose conversion camera",
    "rendering": "versions temporary_settings another_blender datablocks scenes",
    "interface": (
        "versions temporary_settings picture findings render_settings preferences datablocks storage targets hold causes "
        "pose conversion camera dataset_cameras own_picture scenes rendering jobs"
    ),
    "jobs": "versions temporary_settings opening datablocks camera resolution scenes rendering",
}
# Inside the tracer a room may import from all those before it.
TRACER_FLOORS = ["scene", "tiles", "native", "render"]
TRACER_ROOMS = {floor: " ".join(TRACER_FLOORS[:i]) for i, floor in enumerate(TRACER_FLOORS)}
HOUSES = {"": ROOMS, "blender": BLENDER_ROOMS, "tracer": TRACER_ROOMS}
ROOF = {"__init__", "__main__"}

# Modules that exist inside Blender only.
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
BUILD_FILES = {"__init__.py", "pyproject.toml", "Makefile", "LICENSE", "CONTRIBUTING.md", "hatch_build.py"}


@functools.cache
def tree_of(source: str) -> ast.Module:
    return ast.parse(source)


def imported_modules(source: str, package: tuple[str, ...]) -> set[str]:
    """The modules that `source` imports anywhere, dotted and absolute; `package` is where its relative imports start."""
    result = set()
    for node in ast.walk(tree_of(source)):
        if isinstance(node, ast.Import):
            result |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            result.add(node.module)
        elif isinstance(node, ast.ImportFrom):
            start = [*package[: len(package) - node.level + 1], *(node.module.split(".") if node.module else [])]
            result |= {".".join([*start, name.name]) for name in node.names}
    return result


def arrows(source: str, path: Path) -> set[tuple[str, str, str]]:
    """(house, room, room it imports from) of `source`, as the file `path` relative to the package."""
    imports = imported_modules(source, ("viewcam_addon", *path.parent.parts))
    result = set()
    for house, rooms in HOUSES.items():
        inside = Path(house) if house else Path()
        if inside != Path() and inside not in path.parents:
            continue
        room = path.relative_to(inside).parts[0].removesuffix(".py")
        package = ".".join(("viewcam_addon", *inside.parts))
        others = {other for other in rooms if any(f"{name}.".startswith(f"{package}.{other}.") for name in imports)}
        result |= {(house, room, other) for other in others if room not in ROOF and other != room}
    return result


def undeclared(source: str, path: Path) -> list[str]:
    """The imports of a file that the tables do not have."""
    return sorted(
        f"{room} imports from {other}"
        for house, room, other in arrows(source, path)
        if other not in HOUSES[house].get(room, "").split()
    )


def blender_imports(source: str) -> set[str]:
    """The Blender modules that `source` imports, whether at once or in a function."""
    return {name for name in imported_modules(source, ("viewcam_addon",)) if name.split(".")[0] in BLENDER_MODULES}


def sources() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def parsed(path: Path) -> ast.Module:
    return tree_of(path.read_text(encoding="utf-8"))


def tracked_files() -> list[str]:
    return subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")[
        :-1
    ]


def test_each_room_imports_only_from_those_that_its_line_in_the_table_names():
    result = {path: undeclared(path.read_text(encoding="utf-8"), path.relative_to(PACKAGE)) for path in sources()}
    guilty = {str(path.relative_to(PACKAGE)): names for path, names in result.items() if names}
    assert not guilty, f"not in the table of tests/test_project.py: {guilty}"


def test_the_table_has_no_circle_and_no_arrow_that_nothing_uses():
    for rooms in HOUSES.values():
        graphlib.TopologicalSorter({room: names.split() for room, names in rooms.items()}).prepare()  # or CycleError
    used = set().union(*(arrows(path.read_text(encoding="utf-8"), path.relative_to(PACKAGE)) for path in sources()))
    declared = {
        (house, room, other) for house in ("", "blender") for room, names in HOUSES[house].items() for other in names.split()
    }
    assert not declared - used, f"nothing imports so: take it out of the table: {sorted(declared - used)}"


def test_every_room_has_its_line_in_the_table():
    for house, rooms in HOUSES.items():
        inside = PACKAGE / house
        result = {path.relative_to(inside).parts[0].removesuffix(".py") for path in inside.rglob("*.py")} - ROOF
        assert result == set(rooms), (
            f"say in the table of {house or 'the package'} what these import: {sorted(result ^ set(rooms))}"
        )


def circle(modules: dict[str, str]) -> list[str]:
    """Modules that import one another in a circle, whether at once, in a function or for types alone; source by dotted name."""

    def module_of(imported: str) -> str | None:
        """The module itself, else the one whose name is imported from it."""
        parent = imported.rpartition(".")[0]
        return next(
            (each for each in (imported, f"{imported}.__init__", parent, f"{parent}.__init__") if each in modules), None
        )

    def of(name: str, source: str) -> set[str]:
        return {module_of(each) for each in imported_modules(source, tuple(name.split(".")[:-1]))} - {name, None}

    try:
        graphlib.TopologicalSorter({name: of(name, source) for name, source in modules.items()}).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def test_no_modules_import_one_another_in_a_circle():
    """Neither by `if TYPE_CHECKING` nor in functions, so that each can be read without the other."""
    openers = {PACKAGE / "__init__.py", NEEDS_BLENDER / "__init__.py"}  # they import Blender's classes as they register
    files = [path for path in sources() if path not in openers]
    modules = {".".join(path.relative_to(ROOT).with_suffix("").parts): path.read_text(encoding="utf-8") for path in files}
    assert len(modules) > 100 and not (actual := circle(modules)), " → ".join(actual)


def test_imports_inside_the_package_are_relative():
    """Inside Blender the package's name is bl_ext.user_default.virtual_pinhole.viewcam_addon."""
    absolute = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in sources()
        for node in ast.walk(parsed(path))
        if (isinstance(node, ast.Import) and any(name.name.split(".")[0] == "viewcam_addon" for name in node.names))
        or (isinstance(node, ast.ImportFrom) and node.level == 0 and node.module.split(".")[0] == "viewcam_addon")
    ]
    assert not absolute, f"absolute imports of the package: {absolute}"


def names_of(tree: ast.Module) -> set[str]:
    """The names that a module defines or imports at its top level, in `if` and `try` as well."""
    result, waiting = set(), list(tree.body)
    for node in waiting:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            result.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            result |= {(each.asname or each.name).split(".")[0] for each in node.names}
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            result |= {each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)}
        else:
            waiting += [each for each in ast.iter_child_nodes(node) if isinstance(each, ast.stmt)]
    return result


def missing_names(trees: dict[Path, ast.Module]) -> list[str]:
    """The names that files import from others of the package that those do not have."""
    defined, missing = {path: names_of(tree) for path, tree in trees.items()}, []
    inside = {}
    for path in trees:
        inside.setdefault(path.parent, set()).add(path.stem)
        inside.setdefault(path.parent.parent, set()).add(path.parent.name)
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.level:
                home = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
                file = home / "__init__.py" if home / "__init__.py" in trees else home.with_suffix(".py")
                there = defined.get(file, set()) | inside.get(home, set())
                missing += [f"{path}: {each.name} from {home}" for each in node.names if each.name not in there]
    return missing


def test_what_is_imported_from_a_module_of_the_package_is_there():
    """Modules that need Blender, or something else that is not installed, are held to it, and imports in functions, too."""
    trees = {path.relative_to(ROOT): parsed(path) for path in sources()}
    assert not (missing := missing_names(trees)), missing


def vague_beginnings(source: str) -> list[str]:
    """The docstrings, and their parameters, that begin with a word after which their subject is still unknown."""
    words = "As|How|Of|That of|The same|Those|What|When|Where|Whether|Which|Who|Whose"
    parameters = re.findall(rf'(?m)^ *(?:""")?([\w`*, ]+ : (?:{words.lower()})\b.*)', source)
    return parameters + re.findall(rf'(?m)^ *r?"""((?:{words})\b.*?)(?:"""|$)', source)


NO_NAMES = "found|given|it|made|one|said|shown|some|stuff|thing|things|told"
ONLY_OF_FUNCTIONS = "how|of"  # as in CameraSync.of(camera_object)
POOR = rf"_?(?:{NO_NAMES}|{ONLY_OF_FUNCTIONS})_?"
SPELLED_AS_NAMES = [  # more or less: whole trees of syntax take ten seconds for all files
    re.compile(rf"\b{POOR}\)?( [:|+*/-]?= |, [^\"\n]* = )"),
    re.compile(rf"(?m)^ *{POOR}: "),
    re.compile(rf"\bfor [^\"\n#]*\b{POOR}[,) ][^\"\n#]*\bin "),
    re.compile(rf"\b(?:def|lambda|class) ([^\"\n]*[(* ])?{POOR}[,:=()]"),
]
# Stems, since -ise ends many other words, too.
BRITISH = "behaviour|cancell|centre|colour|favour|grey|labell|levell|metre|modell|neighbour|signall"
BRITISH += "|initialis|normalis|optimis|organis|quantis|rasteris|recognis|regularis|synchronis"


def is_british(text: str) -> bool:
    text = text.replace("CANCELLED", "").lower().replace("cancellation", "")  # both are American
    return any(stem in text for stem in BRITISH.split("|"))


def poor_names(source: str) -> list[str]:
    """The names of values, functions and classes that say nothing of them, and those in British spelling."""
    if not is_british(source) and not any(each.search(source) for each in SPELLED_AS_NAMES):
        return []
    result = []
    for node in ast.walk(tree_of(source)):
        name, refused = "", f"{NO_NAMES}|{ONLY_OF_FUNCTIONS}"
        if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            name = node.id if isinstance(node, ast.Name) else node.attr
        elif isinstance(node, ast.arg):
            name = node.arg
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            name, refused = node.name, NO_NAMES
        result += [name] if name.strip("_") in refused.split("|") or is_british(name) else []
    return result


def guilty(check: Callable[[str], list[str]]) -> dict[str, list[str]]:
    """File → faults, of those of the project's Python files in which `check` finds some."""
    files = [name for name in tracked_files() if name.endswith(".py")]
    return {name: faults for name in files if (faults := check((ROOT / name).read_text(encoding="utf-8")))}


def test_docstrings_begin_with_what_a_thing_is_or_does():
    assert guilty(vague_beginnings) == {}


def test_parameters_in_docstrings_stand_one_a_line():
    """So an editor shows them."""
    several = re.compile(r'(?m)^ *(?:"""|.*[.] )?[a-z_, ]+ : .*[.;] [a-z_, ]+ : \w.*')
    assert guilty(several.findall) == {}
    two = "size : its size. edge " + ": its length."
    assert several.findall(f"    {two}") and several.findall(f'    """A box. {two}"""')


def test_comments_begin_with_what_a_thing_is_or_does():
    """In Python, in the core, and where things are built; those behind a line's code, too."""
    words = "How|Of|That of|The same|Those|What|Whether|Who"
    behind = rf"[^\s\"'] +(?:#|//) (?:{words}|{words.lower()})\b.*"
    vague = re.compile(rf"(?m)^ *(?:#|//) (?:{words}|Which|Whose)\b.*|{behind}")
    files = [name for name in tracked_files() if name.endswith((".py", ".h", ".cpp", "Makefile", ".toml", ".ci/run"))]
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in files}
    assert {name: faults for name, text in texts.items() if (faults := vague.findall(text))} == {}
    full, trailing = "    # Of a picture.\n// The same of four.\n", "x = 1" + "  # what it is\n" + "int y;" + "  // of four\n"
    assert len(vague.findall(full + trailing)) == 4


def test_names_say_what_a_value_is_and_are_spelled_as_blender_spells():
    assert guilty(poor_names) == {}
    assert not [name for name in tracked_files() if is_british(name)]
    core = {path: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*") if path.suffix in (".h", ".cpp")}
    assert core and not [path for path, text in core.items() if is_british(text)]
    code = {path: re.sub(r'"(?:\\.|[^"\\\n])*"|//.*|/\*[\s\S]*?\*/', "", text) for path, text in core.items()}
    assert {path: poor for path, text in code.items() if (poor := re.findall(rf"\b(?:{NO_NAMES})_?\b", text))} == {}


def test_only_blender_knows_blender():
    outside = {
        path: blender_imports(path.read_text(encoding="utf-8")) for path in sources() if NEEDS_BLENDER not in path.parents
    }
    guilty = {str(path.relative_to(ROOT)): sorted(names) for path, names in outside.items() if names}
    assert not guilty, f"Blender's modules are imported outside viewcam_addon/blender: {guilty}"


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


# Only these know `object.virtual_pinhole`; what lies below the interface knows CameraValues, so that no import goes up unseen.
KNOW_THE_PROPERTY_GROUP = {"storage.py", "targets.py", "properties.py", "__init__.py"}
METHODS = {"numbers", "precision"}


def uses_of_the_property_group(source: str) -> list[str]:
    """The lines where `source` reads `….virtual_pinhole`, or takes or gives a PropertyGroup."""
    result = []
    for node in ast.walk(tree_of(source)):
        if isinstance(node, ast.Attribute) and node.attr in ("virtual_pinhole", "PropertyGroup"):
            result.append(f"{node.lineno}: {ast.unparse(node)}")
    return result


def test_below_the_interface_nothing_takes_the_property_group():
    """The camera's modules take objects and CameraValues: a call of the group's methods would be a call upward."""
    camera_side = [path for path in NEEDS_BLENDER.glob("*.py") if path.name not in KNOW_THE_PROPERTY_GROUP]
    uses = {path.name: uses_of_the_property_group(path.read_text(encoding="utf-8")) for path in camera_side}
    for name in ("render_settings.py", "own_picture.py"):  # a property group of their own
        assert len(uses.pop(name)) == 1
    guilty = {name: result for name, result in uses.items() if result}
    assert len(uses) > 8 and not guilty, f"these reach up into the property group: {guilty}"
    for name in ("storage.py", "targets.py"):
        calls = {
            node.func.attr
            for node in ast.walk(parsed(NEEDS_BLENDER / name))
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        }
        assert not calls & METHODS, f"{name} calls methods of the property group: {calls & METHODS}"


def test_the_version_stands_in_one_place():
    manifest = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "version" not in project["project"] and project["project"]["dynamic"] == ["version"]
    result = [match["version"] for match in re.finditer(project["tool"]["hatch"]["version"]["pattern"], manifest)]
    assert result == [tomllib.loads(manifest)["version"]]


def test_the_manifest_asks_for_files_and_the_clipboard_and_no_more():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert set(manifest["permissions"]) == {"files", "clipboard"}


def test_blender_accepts_the_manifest():
    bpy = pytest.importorskip("bpy")
    tool = Path(bpy.utils.system_resource("SCRIPTS"), "addons_core", "bl_pkg", "cli", "blender_ext.py")
    outcome = subprocess.run([sys.executable, tool, "validate", ROOT], capture_output=True, text=True)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr


def test_the_top_level_is_the_fixed_one():
    top = {Path(name).parts[0] for name in tracked_files()}
    extra = {name for name in top - TOP_LEVEL - BUILD_FILES if not name.startswith(".")}
    assert not extra, f"not a part of the top level: {sorted(extra)}"


def test_what_the_readme_says_viewcam_does_it_does(capsys):
    promised = set(re.findall(r"(?m)(?:`|--command |^ *)viewcam ([a-z]+)", (ROOT / "README.md").read_text(encoding="utf-8")))
    assert {"check", "demo"} <= promised
    for name in sorted(promised):
        status, output = cli.main([name, "--help"]), capsys.readouterr()
        assert status == 0 and f"viewcam {name}" in output.out, output.err


def paths_named_in(text: str) -> set[str]:
    """The words in backticks that begin with a folder of the project."""
    return set(re.findall(r"`((?:viewcam_addon|tests|docs|benchmarks|sample_scenes)/[\w./-]*)`", text))


def test_every_path_that_a_document_names_exists():
    documents = [path for path in tracked_files() if path.endswith(".md")] + ["CONTRIBUTING.md"]
    named = {path: paths_named_in((ROOT / path).read_text(encoding="utf-8")) for path in documents}
    missing = {path: gone for path, names in named.items() if (gone := {name for name in names if not (ROOT / name).exists()})}
    assert len(named["CONTRIBUTING.md"]) > 30 and not missing, missing
    assert paths_named_in("in `tests/none.py`") == {"tests/none.py"}


def dead_links(page: Path) -> list[str]:
    """The links of a page to files, and to headings, that are not there."""
    headings = functools.cache(lambda path: re.findall(r"(?m)^#+ (.*)", path.read_text(encoding="utf-8")))
    dead = []
    for link in re.findall(r"\]\(([^)\s:]+)\)", page.read_text(encoding="utf-8")):
        name, _, anchor = link.partition("#")
        path = page.parent / name if name else page
        anchors = {re.sub(r"[^\w -]", "", each.lower()).replace(" ", "-") for each in headings(path)} if anchor else {anchor}
        dead += [link] if not path.exists() or anchor not in anchors else []
    return dead


def test_every_link_of_a_document_leads_somewhere(tmp_path):
    pages = [ROOT / path for path in tracked_files() if path.endswith(".md")]
    assert {page.name: links for page in pages if (links := dead_links(page))} == {}
    page = tmp_path / "page.md"
    page.write_text("# A `b` c\n[there](#a-b-c), [gone](#b) and [nowhere](none.md)\n", encoding="utf-8")
    assert dead_links(page) == ["#b", "none.md"]


def test_every_module_that_a_comment_names_exists():
    """But for the tracer's and those of other programs, which cameras/ names as its sources."""
    expected = re.compile(r"(?<![\w/.*-])((?:[a-z_]+/)*[a-z_]+\.py)\b")
    files = {f"/{path.relative_to(ROOT)}" for path in (*sources(), *(ROOT / "tests").rglob("*.py"))}
    missing = {}
    for path in sources():
        if path.relative_to(PACKAGE).parts[0] not in ("cameras", "tracer"):
            result = set(expected.findall(path.read_text(encoding="utf-8")))
            if gone := {name for name in result if not any(file.endswith(f"/{name}") for file in files)}:
                missing[str(path.relative_to(PACKAGE))] = gone
    assert not missing, missing


@functools.cache
def races() -> dict[tuple[str, str, str], float]:
    """(race, error, "picture" or "job") → how many times as fast as the rival it was measured."""
    measured = {}
    for name, chart in json.loads((ROOT / "docs" / "charts" / "speed.json").read_text(encoding="utf-8"))["charts"].items():
        race, _, figure = name.removeprefix("speed-").rpartition("-picture")
        if not race:  # speed-RACE-whole-job, speed-mitsuba-fresh-process, speed-geometry
            race, figure = figure.removesuffix("-whole-job").removesuffix("-fresh-process"), "job"
        for each in chart["standings"]:
            if "error" in each:
                measured[race, f"{each['error']:g}", figure or "picture"] = each["ratio"]
            elif "times as fast" in each["what"]:
                measured[race, "", "picture" if "picture" in each["what"] else "job"] = each["ratio"]
    return measured


def untrue_of_races(page: str) -> list[str]:
    """The cells of a page's table of races that say otherwise than measured: race, error, picture, wanted, job, wanted."""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in page.splitlines() if line.count("|") == 7]
    entries = {
        (race.replace(" ", "-"), error, figure): cell
        for race, error, picture, of_picture, job, of_job in rows[2:]
        for figure, cell in (("picture", (picture, of_picture)), ("job", (job, of_job)))
    }
    untrue = [f"{key} is not told" for key in races() if key not in entries]
    for key, (cell, wanted) in entries.items():
        ratio = races().get(key)
        figure = "–" if ratio is None else f"{ratio:.3g}" if ratio >= float(wanted) else f"**{ratio:.3g}**"
        untrue += [] if cell == figure else [f"{key} is {figure}, not {cell}"]
    return untrue


def test_the_table_of_races_has_what_its_charts_have_measured_and_what_is_missed_in_bold():
    assert not untrue_of_races((ROOT / "docs" / "speed.md").read_text(encoding="utf-8"))


def test_a_figure_that_was_not_measured_is_seen_in_the_table_of_races():
    page = (ROOT / "docs" / "speed.md").read_text(encoding="utf-8")
    row = re.search(r"^\| studio \| 0.003 \|.*\n", page, re.MULTILINE)[0]
    assert len(untrue_of_races(page.replace(row, ""))) == 2
    cell = row.split("|")[3]
    for other in (" 99 ", cell.replace(cell.strip(), f"**{cell.strip()}**")):
        assert len(untrue_of_races(page.replace(row, row.replace(cell, other, 1)))) == 1


def test_how_to_add_something_is_told_in_fewer_than_ten_lines():
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("## How to add")[2]
    entries = [each for each in page.split("\n\n") if each.strip().startswith("**")]
    assert len(entries) >= 7 and max(each.count("\n") + 1 for each in entries) < 10
    assert {"format", "lamp", "pass", "command", "tolerance", "version"} <= set(re.findall(r"[a-z]+", page))
    touched = {each.split(".**")[0].strip("* "): len(paths_named_in(each)) for each in entries}
    most = {
        "A camera format": 2,
        "A command": 1,
        "A pass": 2,
        "A pass of light": 2,
        "A node that makes values": 2,
        "A material": 4,
        "A tolerance of geometry": 2,
        "A tolerance of light": 2,
        "A value of the camera": 3,
        "A Blender version": 2,
    }
    assert {name: touched.get(name) for name in most if not 0 < touched.get(name, 0) <= most[name]} == {}


def test_what_is_public_is_what_the_page_names_and_can_be_imported_without_blender():
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`vp\.(\w+)`", page))
    program = f"""
import sys
sys.modules.update(dict.fromkeys({sorted(BLENDER_MODULES)}))
import viewcam_addon as vp
assert "numpy" not in sys.modules, "Blender's start would wait for it"
assert {{name: getattr(vp, name).__doc__ for name in vp.__all__}}
assert set(vp.__all__) == {named | {"Scene", "Image", "Check", "Labels"}}
assert callable(vp.compare) and callable(vp.check), "a room has the name of a function"
try:
    vp.nothing
except AttributeError as error:
    print(error)
"""
    outcome = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert outcome.returncode == 0 and "has no attribute 'nothing'" in outcome.stdout, outcome.stderr


def test_rooms_that_tests_in_a_window_ask_for_by_name_are_there():
    """They are looked up only there, in a Blender that most changes never start."""
    rooms = {
        (path.name, name.removeprefix("blender."))
        for path in (ROOT / "tests" / "real_blender").glob("*.py")
        for name in re.findall(r'\broom\("([\w.]+)"\)', path.read_text(encoding="utf-8"))
    }
    lost = [(file, name) for file, name in rooms if not (PACKAGE / "blender" / f"{name.replace('.', '/')}.py").exists()]
    assert len(rooms) > 20 and not lost, lost


def test_what_the_readme_says_to_make_can_be_made():
    targets = set(re.findall(r"(?m)^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8")))
    promised = set(re.findall(r"(?m)(?:`|^ *)make ([a-z-]+)", (ROOT / "README.md").read_text(encoding="utf-8")))
    assert {"demo", "test"} <= promised, f"the README doesn't show the two commands, only {sorted(promised)}"
    assert promised <= targets, f"the Makefile can't make {sorted(promised - targets)}"


def typed(folder: Path, program: str) -> subprocess.CompletedProcess:
    """mypy, as strict as pyproject.toml has it, on a program that uses the package."""
    (folder / "program.py").write_text(program, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", folder / "program.py"]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


def test_the_examples_of_the_api_are_typed_and_a_wrong_one_is_told(tmp_path):
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    page, _, _ = page.partition("## Blender's cameras")  # mypy knows no types of Blender's
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    outcome = typed(tmp_path, "\n".join(blocks))
    assert len(blocks) > 3 and outcome.returncode == 0, outcome.stdout
    assert 'incompatible type "str"' in typed(tmp_path, blocks[0].replace("distance=1500", 'distance="1500"')).stdout


def test_a_core_that_two_need_at_a_time_is_compiled_once_and_a_broken_one_is_left_to_the_next(tmp_path, monkeypatch):
    pytest.importorskip("fcntl", reason="Windows has locks of another kind")
    monkeypatch.syspath_prepend(ROOT)
    import hatch_build

    compiled = []

    def compile_slowly(platform, command, zig, folder):
        time.sleep(0.2)
        compiled.append(command)
        if len(compiled) == 1:
            sys.exit("the compiler was killed")
        (folder / "library").write_bytes(b"\x7fELF")
        return folder / "library"

    monkeypatch.setattr(hatch_build, "_compiled", compile_slowly)
    monkeypatch.setattr(hatch_build, "_place", lambda *words: (tmp_path / "core" / "library", []))
    monkeypatch.setattr(hatch_build, "system_compiler", lambda: "c++")
    platform = hatch_build.this_platform()
    with pytest.raises(SystemExit):
        hatch_build.build_core(platform)
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        libraries = set(pool.map(hatch_build.build_core, [platform] * 4))
    assert libraries == {tmp_path / "core" / "library"} and len(compiled) == 2
