"""Compare EXRs of one camera against derived tolerances and noise."""

import argparse

from .. import argument_types as types
from ..errors import InputError
from ..terminal import say
from . import Result
from . import _options as shared


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    added.add_argument("reference", metavar="REFERENCE.exr", type=types.path)
    several = "several are one picture, rendered with several seeds"
    added.add_argument("tests", metavar="TEST.exr", type=types.path, nargs="+", help=several)
    explains = "the reference's scene: explains silhouettes, brings the ledger"
    added.add_argument("--scene", metavar="SCENE.json", type=types.path, help=explains)
    shared.add_of_job(added, "strict")
    words = "what TEST.exr holds, made elsewhere: position=P.X,P.Y,P.Z depth=Z; also distance, normal, uv, object-index"
    added.add_argument("--channels", metavar="PASS=CHANNELS", type=types.channels, nargs="+", help=words)
    shared.add_report(added)


def run(options: argparse.Namespace) -> Result:
    from ..comparison.answer import exit_status
    from ..jobs.tracing import Written, compare_files

    report, difference = (path and str(path) for path in (options.report, options.difference))
    written = Written(report, difference, command=f"viewcam {options.words}")
    channels = dict(options.channels or ())
    if len(channels) < len(options.channels or ()):
        raise InputError("--channels names a pass twice: leave one of them out")
    result = compare_files(options.reference, options.tests, options.scene, options.threads, channels, written)
    say(*shared.ledger_lines(result["result"]["ledger"]), *result["lines"])
    return exit_status(result["answer"], options.strict), result["result"]
