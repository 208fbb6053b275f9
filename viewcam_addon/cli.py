"""One command, `viewcam`, over all of the project: in the shell, and inside Blender as `blender -b FILE --command viewcam`.

Exit status: 0 all well; 1 the comparison failed; 2 bad input or usage, with one line on stderr; 3 something could not be
modelled under --strict. No traceback reaches a user.

Here are the commands and what options several of them have; what they do is in commands/.
"""

import argparse
import json
import shlex
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from . import argument_types as types
from . import events
from .commands import Result, verification
from .errors import InputError, bug
from .files import check_writable, is_printed_to, written_whole
from .tracer.scene.film import SAMPLES

_FOLDERS = ("bop", "colmap", "kitti")
"""Datasets of labels that are folders, not files."""


def main(arguments: Sequence[str] | None = None, blend_is_open: bool = False, ended_by: int | None = None) -> int:
    """Run one sub-command and return its exit status.

    arguments : those of the shell by default. blend_is_open : inside Blender, where FILE.blend is the file that is open.
    ended_by : the signal that has ended the process that ran it (crashes.py): then it is only told.
    """
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    try:
        options = _parser(blend_is_open).parse_args(arguments)
    except SystemExit:  # argparse leaves after --help
        return 0
    except _UsageError as error:
        log_json = "--log-json" in arguments
        options = argparse.Namespace(command=error.command, run=error.raised, json=None, log_json=log_json, writes=())
    options.words = shlex.join(arguments)
    started = time.monotonic()
    with events.opened(options.log_json) as options.events:
        if ended_by is None:
            options.events.tell("started", command=options.command, words=options.words)
            status, result = _outcome(options)
        else:
            status, result = _told(options, InputError.exit_status, _crash(options, ended_by))
        seconds = round(time.monotonic() - started, 3)
        if result:
            status = _write_result(options, status, {"exit_status": status, **result}, seconds) or status
        options.events.tell("finished", command=options.command, exit_status=status, seconds=seconds)
    return status


def _crash(options: argparse.Namespace, number: int) -> str:
    name = signal.Signals(number).name if number in set(signal.Signals) else number
    blend = options.blend or "no file"
    sentence = f"Blender has ended with {name} at {blend}: see that the file is whole, and that there is memory enough"
    if options.command != "batch":
        return sentence
    return f"{sentence}; what is finished is kept, and with --resume --workers 1 a shot that crashes it does not end the batch"


class _UsageError(InputError):
    """The words are no command. command : the sub-command, as far as it is known."""

    def __init__(self, message: str, command: str) -> None:
        super().__init__(message)
        self.command = command

    def raised(self, _: argparse.Namespace) -> NoReturn:
        """Raise what such a command raises when it is run."""
        raise self


class _OneLineParser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        command = self.prog.partition(" ")[2]
        raise _UsageError(f"{message}; {self.prog} --help tells how it is used", command)


class _CommandParser(_OneLineParser):
    """Takes files and options in any order: Python 3.11 alone would take no file after an option where one may be left out."""

    _is_intermixing = False
    add_words: Callable[[argparse.ArgumentParser], None]
    """Adds the command's words, once it is this command that was given: what they need is imported for no other."""

    def parse_known_args(self, *arguments: Any) -> Any:  # which intermixed parsing uses itself
        if self._is_intermixing:
            return super().parse_known_args(*arguments)
        self._is_intermixing = True
        self.add_words(self)
        return self.parse_known_intermixed_args(*arguments)


def _parser(blend_is_open: bool) -> argparse.ArgumentParser:
    parser = _OneLineParser(prog="viewcam", description="A camera from eye, look-at, up and distance, proven against Cycles.")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=_CommandParser)

    def command(name: str, text: str) -> Callable[[Callable[[argparse.ArgumentParser], None]], None]:
        """A decorator of the function that adds a command's options and says what runs it."""

        def add(own_words: Callable[[argparse.ArgumentParser], None]) -> None:
            def add_words(added: argparse.ArgumentParser) -> None:
                added.set_defaults(writes=())
                added.add_argument("--threads", type=types.positive, metavar="N", help="threads to use (default: all)")
                added.add_argument("--json", metavar="FILE", type=types.path, help="write the result as JSON")
                added.add_argument(
                    "--log-json", action="store_true", help="tell on standard output a JSON object for each event"
                )
                own_words(added)

            subparsers.add_parser(name, help=text, description=text).add_words = add_words

        return add

    def blend(added: argparse.ArgumentParser) -> None:
        if not blend_is_open:
            added.add_argument("blend", metavar="FILE.blend", type=types.path, help="any file that Blender opens")
        else:
            added.set_defaults(blend=None)
        trust(added)

    def trust(added: argparse.ArgumentParser) -> None:
        added.add_argument(
            "--trust", action="store_true", help="let what is in the file run and write: Python, shaders, caches"
        )

    def strict(added: argparse.ArgumentParser, when: str) -> None:
        added.add_argument("--strict", action="store_true", help=f"exit with 3 {when}")

    def scene_choices(added: argparse.ArgumentParser) -> None:
        added.add_argument("--camera", metavar="NAME", help="the camera object (default: the scene's)")
        added.add_argument("--frame", type=int, metavar="N", help="the frame (default: the file's current one)")
        added.add_argument("--size", type=types.size, metavar="WxH", help="pixels of the picture (default: the scene's)")
        strict(added, "if anything is not modelled: of the picture where one is compared, else of the file")
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
            "--samples",
            type=types.positive,
            metavar="N",
            default=SAMPLES,
            help="samples a pixel, for light (default: %(default)s)",
        )
        noise = "another noise for another number (default: 0)"
        added.add_argument("--seed", type=types.seed, metavar="N", default=0, help=noise)

    def error(added: argparse._ActionsContainer, text: str) -> None:
        text = f"for light: {text} as many samples of each pixel as it takes for a standard error of E, in the picture's units"
        added.add_argument("--error", type=types.above_zero, metavar="E", help=text)

    def report(added: argparse.ArgumentParser) -> None:
        added.add_argument("--report", metavar="DIR", type=types.path, help="write an HTML report there")
        added.add_argument("--difference", metavar="FILE.png", type=types.png, help="draw there what differs, pixel by pixel")
        added.add_argument("--junit", metavar="FILE.xml", type=types.path, help="write the result as a test's, for CI systems")
        added.set_defaults(writes=("report", "difference"))

    @command("export", "Write the scene of a .blend as the tracer reads it.")
    def add_export(added: argparse.ArgumentParser) -> None:
        added.set_defaults(run=verification.export)
        blend(added)
        added.add_argument("scene", metavar="SCENE.json", type=types.path)
        added.set_defaults(writes=("scene",))
        scene_choices(added)

    @command("render", "Trace a scene file into an EXR.")
    def add_render(added: argparse.ArgumentParser) -> None:
        added.set_defaults(run=verification.render)
        added.add_argument("scene", metavar="SCENE.json", type=types.path)
        added.add_argument("image", metavar="OUT.exr", type=types.path)
        added.set_defaults(writes=("image",))
        added.add_argument("--size", type=types.size, metavar="WxH", help="pixels of the picture (default: the scene's)")
        added.add_argument("--stated", action="store_true", help="trace the four values as stated, not as Blender stored them")
        spent = added.add_mutually_exclusive_group()
        light(added, spent)
        error(spent, "in place of --samples")
        added.add_argument(
            "--labels",
            type=types.names,
            metavar="LABELS",
            help="write ground truth beside the picture: some of depth,normals,position,masks,amodal,flow,coverage",
        )
        for other in ("previous", "next"):
            words = f"the {other} frame, for --labels flow"
            added.add_argument(f"--{other}", metavar="SCENE.json", type=types.path, help=words)
        words = "steps of the labels' 16-bit depth in a scene unit (default: 1000, millimetres of metres)"
        added.add_argument("--depth-steps", type=types.above_zero, metavar="N", default=1000.0, help=words)

    @command("cycles", "Render a .blend with Cycles so that it can be compared, and give every setting back.")
    def add_cycles(added: argparse.ArgumentParser) -> None:
        added.set_defaults(run=verification.cycles)
        blend(added)
        added.add_argument("image", metavar="OUT.exr", type=types.path)
        added.set_defaults(writes=("image",))
        scene_choices(added)

    @command("compare", "Compare EXRs of one camera against derived tolerances and noise.")
    def add_compare(added: argparse.ArgumentParser) -> None:
        added.set_defaults(run=verification.compare)
        added.add_argument("reference", metavar="REFERENCE.exr", type=types.path)
        added.add_argument(
            "tests", metavar="TEST.exr", type=types.path, nargs="+", help="several are one picture, rendered with several seeds"
        )
        added.add_argument(
            "--scene",
            metavar="SCENE.json",
            type=types.path,
            help="the reference's scene: explains silhouettes, brings the ledger",
        )
        strict(added, "if anything in the picture is not modelled")
        words = "what TEST.exr holds, made elsewhere: position=P.X,P.Y,P.Z depth=Z; also distance, normal, uv, object-index"
        added.add_argument("--channels", metavar="PASS=CHANNELS", type=types.channels, nargs="+", help=words)
        report(added)

    @command("check", "Export, trace, render with Cycles or another engine and compare, all in one go.")
    def add_check(added: argparse.ArgumentParser) -> None:
        added.set_defaults(run=verification.check)
        blend(added)
        scene_choices(added)
        from .commands import carry_out
        from .jobs.job import DEVICES, TESTED

        words = "who renders; all but Cycles at level geometry (default: %(default)s)"
        added.add_argument("--engine", choices=TESTED, default="CYCLES", help=words)
        words = "what Cycles renders on, all of that kind (default: %(default)s)"
        added.add_argument("--device", choices=DEVICES, default="CPU", help=words)
        error(added, "the tracer takes")
        against = "the scene that Cycles must show, as viewcam export wrote it (default: what the file holds now)"
        added.add_argument("--scene", metavar="SCENE.json", type=types.path, help=against)
        report(added)
        many = added.add_argument_group("many checks, a shot each; --report has their page and results")
        many.add_argument("--frames", metavar="A..B", help="the camera at each frame (from -5 on: --frames=-5..3)")
        many.add_argument("--cameras", metavar="GLOB", help="each camera so called: with * ? [abc]")
        many.add_argument("--shard", metavar="I/N", help="of all these, every N-th from the I-th on")
        kept = many.add_mutually_exclusive_group()
        kept.add_argument("--resume", action="store_true", help="keep the results that are there from the same settings")
        kept.add_argument("--overwrite", action="store_true", help="check all of them anew")
        carry_out.add_machines(added)

    @command("batch", "Render many shots of one file: opened once, each written whole, and continued after whatever ended it.")
    def add_batch(added: argparse.ArgumentParser) -> None:
        from .commands import batch

        added.set_defaults(run=batch.run)
        blend(added)
        batch.add_options(added, blend_is_open)

    @command("audit", "Tell what is wrong with a dataset's cameras, by its points or depth maps.")
    def add_audit(added: argparse.ArgumentParser) -> None:
        from .commands import audit

        added.set_defaults(run=audit.run)
        added.add_argument(
            "dataset", metavar="DATASET", type=types.path, help="transforms.json, a COLMAP model, or the folder of one"
        )
        by = added.add_mutually_exclusive_group()
        by.add_argument("--points", metavar="COLMAP", type=types.path, help="a COLMAP model of the same pictures and world")
        by.add_argument(
            "--against", metavar="CAMERAS", type=types.path, help="true cameras of the same pictures, in any format"
        )
        text = "the file that was rendered, whose cameras are called as the pictures, or whose frames end their names"
        by.add_argument("--blend", metavar="FILE.blend", type=types.path, help=text)
        trust(added)
        added.add_argument("--size", type=types.size, metavar="WxH", help="pixels, where the file does not say")

    @command("labels", "Make a dataset of the labels of a folder's pictures.")
    def add_labels(added: argparse.ArgumentParser) -> None:
        from .commands import labels

        added.set_defaults(run=labels.run, writes=("output",))
        added.add_argument("folder", metavar="FOLDER", type=types.path, help="where viewcam render --labels has written")
        added.add_argument("output", metavar="OUT", type=types.path, help="a file of COCO's; of another format a new folder")
        words = "COCO's instances (default) or panoptic format; BOP's scene; COLMAP's points and tracks; KITTI's depth and flow"
        added.add_argument("--to", choices=["coco", "panoptic", *_FOLDERS], default="coco", help=words)
        added.add_argument("--amodal", action="store_true", help="whole objects, in place of what is visible of them")
        words = "for COLMAP: points that are sampled in each picture (default: 1000)"
        added.add_argument("--points", type=types.positive, metavar="N", help=words)

    @command("camera", "List the cameras of another program's file, or write them for a third one.")
    def add_camera(added: argparse.ArgumentParser) -> None:
        from .commands import camera

        added.set_defaults(run=camera.run)
        camera.add_options(added)

    @command("demo", "Check the studio still that comes with the project, and write the report.")
    def add_demo(added: argparse.ArgumentParser) -> None:
        added.set_defaults(run=verification.demo)
        added.set_defaults(
            blend=verification.DEMO_SCENE, camera=None, frame=None, size=None, strict=False, recenter=False, clay=False
        )
        added.set_defaults(difference=None, scene=None, trust=False, engine="CYCLES", device="CPU", writes=("report",))
        added.set_defaults(frames=None, cameras=None, shard=None, resume=False, overwrite=False)
        added.set_defaults(time_limit=None, workers=None, scheduler=None)
        light(added)
        error(added, "the tracer takes")
        added.add_argument(
            "--report",
            metavar="DIR",
            type=types.path,
            default=Path("demo"),
            help="where the report goes (default: %(default)s)",
        )

    def add_serve(hidden: argparse.ArgumentParser) -> None:
        from .commands import serve

        hidden.add_argument("what")
        hidden.set_defaults(run=serve.run, json=None, log_json=True, writes=(), blend=None)

    subparsers.add_parser("serve").add_words = add_serve  # for our own processes: without a help, the list leaves it out
    return parser


def _outcome(options: argparse.Namespace) -> Result:
    """Exit status and result of the sub-command, whatever becomes of it; an error is told."""
    try:
        _check_outputs(options)
        return options.run(options)
    except InputError as error:
        return _told(options, error.exit_status, str(error), getattr(error, "problems", ()))
    except KeyboardInterrupt:
        return 130, {"error": "interrupted"}
    except Exception as error:  # in one line, as every other error
        return _told(options, 2, bug(error))


def _check_outputs(options: argparse.Namespace) -> None:
    """Raise InputError for what can't be written, before anything is traced or rendered."""
    for name in ("json", "junit"):
        if path := getattr(options, name, None):
            try:
                _check_output(path, is_text=not options.log_json)
            except InputError:
                setattr(options, name, None)  # where this error would be told as well
                raise
    for name in options.writes:
        if path := getattr(options, name):
            is_folder = name == "report" or getattr(options, "to", None) in _FOLDERS
            _check_output(path / "index.html" if is_folder else path, is_text=False)


def _check_output(path: Path, is_text: bool) -> None:
    """is_text : it may stand between the lines that are printed."""
    check_writable(path)
    if not is_text and is_printed_to(path):
        raise InputError(f"{path} is where viewcam prints: give the name of a file")


def _told(options: argparse.Namespace, status: int, sentence: str, problems: Sequence[str] = ()) -> Result:
    several = {"problems": list(problems)} if problems else {}
    options.events.tell("error", command=options.command, text=sentence, **several)
    return status, {"error": sentence, **several}


def _write_result(options: argparse.Namespace, status: int, result: dict[str, Any], seconds: float) -> int:
    """Write the result where that was asked for; the exit status if that fails, else 0."""
    try:
        if options.json:
            from . import checks

            with written_whole(options.json) as temporary:
                temporary.write_text(
                    json.dumps(checks.for_json(result), indent=2, allow_nan=False) + "\n", encoding="utf-8", newline="\n"
                )
        if path := getattr(options, "junit", None):
            from . import junit

            junit.write(path, options.words, status, result, seconds)
    except InputError as error:
        return _told(options, error.exit_status, str(error))[0]
    return 0
