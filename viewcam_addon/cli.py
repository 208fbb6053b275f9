"""One command, `viewcam`, over all of the project: in the shell, and inside Blender as `blender -b FILE --command viewcam`.

Exit status: 0 all well; 1 the comparison failed; 2 bad input or usage, with one line on stderr; 3 something could not be
modelled under --strict. No traceback reaches a user.

Here are the words; what they do is in commands.py.
"""

import argparse
import contextlib
import json
import math
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from . import commands
from .errors import InputError, bug
from .files import written_whole
from .terminal import share_one_heap
from .tracer.scene.film import SAMPLES


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
    except Exception as error:  # in one line, as every other error
        status, result = 2, {"error": bug(error)}
        print(f"viewcam {options.command}: {bug(error)}", file=sys.stderr)
    if options.json and result:
        status = _write_json(options.json, {"exit_status": status, **result}) or status
    return status


def main_and_exit() -> NoReturn:
    """The shell's entry point.

    Leaves without Python's clean-up: all files are written, and to take a large scene apart takes a tenth of a second. Where
    Blender is a module of this process, bpy 4.2 crashes in it and 4.5 hangs, after properties with `update=` were registered.
    """
    share_one_heap()
    status = main()
    with contextlib.suppress(OSError):  # whoever reads our lines may have gone
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(status)


class _OneLineParser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: {message}; {self.prog} --help tells how it is used", file=sys.stderr)
        sys.exit(2)


def _parser(blend_is_open: bool) -> argparse.ArgumentParser:
    parser = _OneLineParser(prog="viewcam", description="A camera from eye, look-at, up and distance, proven against Cycles.")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(run: Callable[[argparse.Namespace], commands.Result], name: str, text: str) -> argparse.ArgumentParser:
        added = subparsers.add_parser(name, help=text, description=text)
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
        added.add_argument("--clay", action="store_true", help="the same matte material on everything, on both sides")
        light(added)

    def light(added: argparse.ArgumentParser, samples: argparse._ActionsContainer | None = None) -> None:
        added.add_argument(
            "--level",
            choices=["geometry", "direct", "path", "auto"],
            default="geometry",
            help="how much is modelled; auto is the least that shows the scene's light (default: %(default)s)",
        )
        (samples or added).add_argument(
            "--samples", type=_positive, metavar="N", default=SAMPLES, help="samples a pixel, for light (default: %(default)s)"
        )
        added.add_argument("--seed", type=_seed, metavar="N", default=0, help="another noise for another number (default: 0)")

    def error(added: argparse._ActionsContainer, text: str) -> None:
        text = f"for light: {text} as many samples of each pixel as it takes for a standard error of E, in the picture's units"
        added.add_argument("--error", type=_error, metavar="E", help=text)

    def report(added: argparse.ArgumentParser) -> None:
        added.add_argument("--report", metavar="DIR", type=Path, help="write an HTML report there")
        added.add_argument("--difference", metavar="FILE.png", type=_png, help="draw there what differs, pixel by pixel")
        added.add_argument("--repeat", help=argparse.SUPPRESS)  # what the report shall name as its command

    added = command(commands.export, "export", "Write the scene of a .blend as the tracer reads it.")
    blend(added)
    added.add_argument("scene", metavar="SCENE.json", type=Path)
    scene_choices(added)

    added = command(commands.render, "render", "Trace a scene file into an EXR.")
    added.add_argument("scene", metavar="SCENE.json", type=Path)
    added.add_argument("image", metavar="OUT.exr", type=Path)
    added.add_argument("--size", type=_size, metavar="WxH", help="pixels of the picture (default: the scene's)")
    added.add_argument("--stated", action="store_true", help="trace the four values as stated, not as Blender stored them")
    spent = added.add_mutually_exclusive_group()
    light(added, spent)
    error(spent, "in place of --samples")

    added = command(
        commands.cycles, "cycles", "Render a .blend with Cycles so that it can be compared, and give every setting back."
    )
    blend(added)
    added.add_argument("image", metavar="OUT.exr", type=Path)
    scene_choices(added)

    added = command(commands.compare, "compare", "Compare EXRs of one camera against derived tolerances and noise.")
    added.add_argument("reference", metavar="REFERENCE.exr", type=Path)
    added.add_argument(
        "tests", metavar="TEST.exr", type=Path, nargs="+", help="several are one picture, rendered with several seeds"
    )
    added.add_argument(
        "--scene", metavar="SCENE.json", type=Path, help="the reference's scene: explains silhouettes, brings the ledger"
    )
    added.add_argument("--test-samples", type=_positive, help=argparse.SUPPRESS)  # Cycles' file counts one that is left out
    report(added)

    added = command(commands.check, "check", "Export, trace, render with Cycles and compare, all in one go.")
    blend(added)
    scene_choices(added)
    error(added, "the tracer takes")
    report(added)

    added = command(commands.demo, "demo", "Check the studio still that comes with the project, and write the report.")
    added.set_defaults(blend=commands.DEMO_SCENE, camera=None, frame=None, size=None, strict=False, recenter=False, clay=False)
    added.set_defaults(difference=None, repeat=None)
    light(added)
    error(added, "the tracer takes")
    added.add_argument(
        "--report", metavar="DIR", type=Path, default=Path("demo"), help="where the report goes (default: %(default)s)"
    )

    added = command(commands.chart, "chart", "Measure the methods and draw how they compare, in a clone of the project.")
    added.add_argument(
        "subject",
        choices=["stability", "light", "speed", "scaling", "poses"],
        help="stability: every method up to where it fails; light: error against samples; speed: error against time; "
        "scaling: time and memory against size; poses: time against error of the camera's axes",
    )
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


def _error(text: str) -> float:
    try:
        error = float(text)
    except ValueError:
        error = math.nan
    if not 0 < error < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is no number above 0")
    return error


def _seed(text: str) -> int:
    if not text.isdecimal() or int(text) >= 2**31:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number from 0 to {2**31 - 1}")
    return int(text)


def _size(text: str) -> tuple[int, int]:
    width, x, height = text.partition("x")
    if not x:
        raise argparse.ArgumentTypeError(f"{text!r} is no size: write 1920x1080")
    return _positive(width), _positive(height)


def _png(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() != ".png":
        raise argparse.ArgumentTypeError(f"{text!r} is drawn as PNG: give a name that ends in .png")
    return path


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
