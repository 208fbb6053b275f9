"""One command, `viewcam`, over all of the project: in the shell, and inside Blender as `blender -b FILE --command viewcam`.

Exit status: 0 all well; 1 the comparison failed; 2 bad input or usage, with one line on stderr; 3 something could not be
modelled under --strict. No traceback reaches a user.

What Blender does (export, Cycles) and what OpenEXR does (the tracer's pictures, the comparison) never share a process, because
Blender brings a copy of OpenEXR of its own: `check` does the first in its own process and the second in child processes, in the
shell and inside Blender alike. Rejected: one process in the shell and several inside Blender, since that would be two programs
to test.
"""

import argparse
import dataclasses
import importlib
import importlib.util
import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from .errors import InputError
from .files import written_whole
from .terminal import silent_libraries

PACKAGE = Path(__file__).parent
DEMO_SCENE = PACKAGE.parent / "sample_scenes" / "studio.blend"

Result = tuple[int, dict[str, Any]]


def main(arguments: Sequence[str] | None = None, blend_is_open: bool = False) -> int:
    """Run one sub-command and return its exit status.

    arguments : those of the shell by default. blend_is_open : inside Blender, where FILE.blend is the file that is open.
    """
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    try:
        options = _parser(blend_is_open).parse_args(arguments)
    except SystemExit as leaving:  # argparse leaves after --help and after an error
        return int(leaving.code or 0)
    options.words = shlex.join(arguments)
    try:
        status, result = options.run(options)
    except InputError as error:
        status, result = error.exit_status, {"error": str(error)}
        print(f"viewcam {options.command}: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        status, result = 130, {"error": "interrupted"}
    except Exception as error:  # a bug: say where, in one line, as for every other error
        place = traceback.extract_tb(error.__traceback__)[-1]
        what = f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}".splitlines()[0]
        status, result = 2, {"error": what}
        print(f"viewcam {options.command}: this is a bug, please report it ({what})", file=sys.stderr)
    if options.json and result:
        status = _write_json(options.json, {"exit_status": status, **result}) or status
    return status


def main_and_exit() -> NoReturn:
    """The shell's entry point.

    Leaves without Python's clean-up where Blender is a module of this process: after properties with `update=` were
    registered, bpy 4.2 crashes in it and 4.5 hangs.
    """
    status = main()
    if "bpy" in sys.modules:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


class _OneLineParser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: {message}; {self.prog} --help tells how it is used", file=sys.stderr)
        sys.exit(2)


def _parser(blend_is_open: bool) -> argparse.ArgumentParser:
    parser = _OneLineParser(prog="viewcam", description="A camera from eye, look-at, up and distance, proven against Cycles.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(run: Callable[[argparse.Namespace], Result], name: str, text: str) -> argparse.ArgumentParser:
        added = commands.add_parser(name, help=text, description=text)
        added.set_defaults(run=run)
        added.add_argument("--threads", type=_positive, metavar="N", help="threads to use (default: all)")
        added.add_argument("--json", metavar="FILE", type=Path, help="write the result as JSON")
        return added

    def blend(added: argparse.ArgumentParser) -> None:
        if not blend_is_open:
            added.add_argument("blend", metavar="FILE.blend", type=Path, help="any file that Blender opens")
        else:
            added.set_defaults(blend=None)

    def scene_choices(added: argparse.ArgumentParser) -> None:
        added.add_argument("--camera", metavar="NAME", help="the camera object (default: the scene's)")
        added.add_argument("--frame", type=int, metavar="N", help="the frame (default: the file's current one)")
        added.add_argument("--size", type=_size, metavar="WxH", help="pixels of the picture (default: the scene's)")
        added.add_argument("--strict", action="store_true", help="exit with 3 if anything can not be modelled")
        added.add_argument("--recenter", action="store_true", help="put the origin at the eye: for scenes far from it")
        level(added)

    def level(added: argparse.ArgumentParser) -> None:
        added.add_argument(
            "--level", choices=["geometry"], default="geometry", help="how much is modelled (default: %(default)s)"
        )

    def report(added: argparse.ArgumentParser) -> None:
        added.add_argument("--report", metavar="DIR", type=Path, help="write an HTML report there")

    added = command(_export, "export", "Write the scene of a .blend as the tracer reads it.")
    blend(added)
    added.add_argument("scene", metavar="SCENE.json", type=Path)
    scene_choices(added)

    added = command(_render, "render", "Trace a scene file into an EXR.")
    added.add_argument("scene", metavar="SCENE.json", type=Path)
    added.add_argument("image", metavar="OUT.exr", type=Path)
    added.add_argument("--size", type=_size, metavar="WxH", help="pixels of the picture (default: the scene's)")
    added.add_argument("--stated", action="store_true", help="trace the four values as stated, not as Blender stored them")
    level(added)

    added = command(
        _cycles, "cycles", "Render a .blend with Cycles so that it can be compared: one sample at each pixel's centre."
    )
    blend(added)
    added.add_argument("image", metavar="OUT.exr", type=Path)
    scene_choices(added)

    added = command(_compare, "compare", "Compare two EXRs of one camera, pass by pass, against the derived tolerances.")
    added.add_argument("reference", metavar="REFERENCE.exr", type=Path)
    added.add_argument("test", metavar="TEST.exr", type=Path)
    added.add_argument(
        "--scene", metavar="SCENE.json", type=Path, help="the reference's scene: explains silhouettes, brings the ledger"
    )
    added.add_argument("--repeat", help=argparse.SUPPRESS)  # what the report shall name as its command
    report(added)

    added = command(_check, "check", "Export, trace, render with Cycles and compare, all in one go.")
    blend(added)
    scene_choices(added)
    report(added)

    added = command(_demo, "demo", "Check the studio still that comes with the project, and write the report.")
    added.set_defaults(blend=DEMO_SCENE, camera=None, frame=None, size=None, strict=False, recenter=False, level="geometry")
    added.add_argument(
        "--report", metavar="DIR", type=Path, default=Path("demo"), help="where the report goes (default: %(default)s)"
    )

    added = command(_chart, "chart", "Measure the methods and draw how they compare, in a clone of the project.")
    added.add_argument("subject", choices=["stability"], help="stability: every method up to where it fails")
    added.add_argument(
        "--output", metavar="DIR", type=Path, default=Path("docs", "charts"), help="where the SVGs go (default: %(default)s)"
    )
    added.add_argument("--only", metavar="NAME", nargs="+", default=[], help="these sweeps and no others")
    added.add_argument("--quick", action="store_true", help="few trials: seconds instead of minutes")
    return parser


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number above 0")
    return int(text)


def _size(text: str) -> tuple[int, int]:
    width, x, height = text.partition("x")
    if not x:
        raise argparse.ArgumentTypeError(f"{text!r} is no size: write 1920x1080")
    return _positive(width), _positive(height)


def _export(options: argparse.Namespace) -> Result:
    from .tracer import scene_file

    with silent_libraries():
        scene = _job().export(_request(options))
    scene_file.write(scene, options.scene)
    lines = _ledger_lines(scene.ledger)
    print(*lines, sep="\n")
    return 0, {"scene": str(options.scene), "ledger": _ledger_json(scene.ledger)}


def _render(options: argparse.Namespace) -> Result:
    from . import image
    from .tracer import scene_file
    from .tracer.render import render

    scene = scene_file.read(options.scene)
    if options.stated:
        if scene.stated_camera is None:
            raise InputError(
                f"{options.scene} has no stated_camera: leave --stated out, or enable the Virtual Pinhole in Blender"
            )
        scene = dataclasses.replace(scene, camera=scene.stated_camera)
    if options.size:
        scene = dataclasses.replace(scene, camera=scene.camera.resized(*options.size))
    started = time.perf_counter()
    passes = render(scene, options.threads)
    seconds = time.perf_counter() - started
    image.write(options.image, image.Image(passes, scene.camera, {"software": "Virtual Pinhole"}))
    print(f"traced {scene.camera.width} × {scene.camera.height} pixels in {seconds:.2f} s")
    return 0, {"image": str(options.image), "seconds": seconds}


def _cycles(options: argparse.Namespace) -> Result:
    with silent_libraries():
        ledger = _job().render(_request(options), options.image)
    print(*_ledger_lines(ledger), sep="\n")
    return 0, {"image": str(options.image), "ledger": _ledger_json(ledger)}


def _compare(options: argparse.Namespace) -> Result:
    from . import image
    from .compare.geometry import compare
    from .compare.report import write_report
    from .tracer import scene_file
    from .tracer.render import Tracer

    reference, test = image.read(options.reference), image.read(options.test)
    scene = scene_file.read(options.scene) if options.scene else None
    camera = reference.camera or (scene and scene.camera)
    if camera is None:
        raise InputError(
            f"{options.reference} does not tell its camera: give its scene with --scene, or trace it with viewcam render"
        )
    surface_at = stated = None
    if scene:
        # The picture may be of another size than the scene says, or of the stated camera.
        surface_at = Tracer(dataclasses.replace(scene, camera=camera), options.threads).surface_at
        stated = scene.stated_camera if camera == scene.camera else None
    comparison = compare(reference, test, camera, surface_at, stated, scene.origin if scene else (0.0, 0.0, 0.0))
    ledger = scene.ledger if scene else ()
    print(*_ledger_lines(ledger), *comparison.lines(), sep="\n")
    if options.report:
        words = f"viewcam {options.repeat or options.words}"
        written = write_report(comparison, reference, test, options.report, ledger, words)
        print(f"report: {written}")
    return 0 if comparison.passed else 1, {**comparison.to_json(), "ledger": _ledger_json(ledger)}


def _check(options: argparse.Namespace) -> Result:
    with tempfile.TemporaryDirectory(prefix="viewcam-") as temporary:
        folder = options.report or Path(temporary)
        scene, reference, test = folder / "scene.json", folder / "reference.exr", folder / "cycles.exr"
        _export_and_render(options, scene, test)
        threads = ["--threads", str(options.threads)] if options.threads else []
        status = _child("render", scene, reference, *threads)
        if status:
            return status, {"error": "the reference could not be traced"}
        outputs = [word for flag in ("json", "report") if (to := getattr(options, flag)) for word in (f"--{flag}", str(to))]
        # The child has written the JSON: there is nothing to add.
        return _child("compare", reference, test, "--scene", scene, "--repeat", options.words, *threads, *outputs), {}


def _demo(options: argparse.Namespace) -> Result:
    if not options.blend.is_file():
        raise InputError(f"{options.blend} is not here: run the demo in a clone of the project, where its sample scenes are")
    print(f"{options.blend.name}: a camera given by four values, rendered by Cycles and by the reference tracer")
    return _check(options)


def _chart(options: argparse.Namespace) -> Result:
    if not (PACKAGE.parent / "benchmarks").is_dir():
        raise InputError("the charts are measured by benchmarks/, which is not here: run this in a clone of the project")
    for package in ("bpy", "matplotlib", "mpmath"):
        if importlib.util.find_spec(package) is None:
            raise InputError(f"this needs {package}: pip install {package}")
    sys.path.append(str(PACKAGE.parent))
    return importlib.import_module(f"benchmarks.{options.subject}").run(options.output, options.only, options.quick)


def _export_and_render(options: argparse.Namespace, scene_path: Path, image_path: Path) -> None:
    """What of a check needs Blender: both sides from one evaluated state, under one numbering of the indices."""
    from .tracer import scene_file

    started = time.perf_counter()
    with silent_libraries():
        scene = _job().export_and_render(_request(options), image_path)
    scene_file.write(scene, scene_path)
    print(f"exported and rendered with Cycles in {time.perf_counter() - started:.1f} s", flush=True)


def _request(options: argparse.Namespace) -> Any:
    return _job().Request(
        blend=options.blend,
        camera=options.camera,
        frame=options.frame,
        size=options.size,
        strict=options.strict,
        recenter=options.recenter,
        threads=options.threads,
    )


def _job() -> Any:
    """blender/job.py, where there is Blender."""
    if importlib.util.find_spec("bpy") is None:
        raise InputError(
            "this needs Blender: install it as a module (pip install bpy), or run blender -b FILE.blend --command viewcam"
        )
    from .blender import job

    return job


def _child(*arguments: str | Path) -> int:
    """Run a sub-command in a Python process of its own, with the same modules in reach as here."""
    search_path = os.pathsep.join([str(PACKAGE.parent), *filter(None, sys.path)])
    command = [sys.executable, "-m", f"{PACKAGE.name}.cli", *map(str, arguments)]
    sys.stdout.flush()
    return subprocess.run(command, env=os.environ | {"PYTHONPATH": search_path}, check=False).returncode


def _ledger_lines(ledger: Sequence[Any]) -> list[str]:
    exported = sum(entry.status == "exported" for entry in ledger)
    rest = [f"  {entry.status}: {entry.object}: {entry.reason}" for entry in ledger if entry.status != "exported"]
    return [f"{exported} of {len(ledger)} objects exported whole", *rest] if ledger else []


def _ledger_json(ledger: Sequence[Any]) -> list[dict[str, str]]:
    return [{"object": entry.object, "status": entry.status, "reason": entry.reason} for entry in ledger]


def _write_json(path: Path, result: dict[str, Any]) -> int:
    """Write the result; the exit status if that fails, else 0."""
    try:
        with written_whole(path) as temporary:
            temporary.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    except InputError as error:
        print(f"viewcam: {error}", file=sys.stderr)
        return error.exit_status
    return 0


if __name__ == "__main__":
    main_and_exit()
