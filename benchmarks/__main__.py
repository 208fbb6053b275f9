"""Measure the methods and draw how they compare: `python -m benchmarks SUBJECT` in a clone of the project.

The charts of docs/ are drawn by it. Exit status: 0, 1 where the method in use is behind another, 2 for bad words or files.
"""

import argparse
import importlib
import importlib.util
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from viewcam_addon.errors import InputError
from viewcam_addon.files import written_whole

SUBJECTS = {
    "stability": "every method up to where it fails",
    "speed": "error against time, of every renderer at hand",
    "light": "error against the number of samples",
    "judge": "faults that are missed against false alarms",
}


def main(words: Sequence[str] | None = None) -> int:
    """Run the sweeps of one subject and return the exit status.

    words : the command's words, the shell's by default.
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__.partition("\n")[0])
    parser.add_argument("subject", choices=SUBJECTS, help="; ".join(f"{name}: {text}" for name, text in SUBJECTS.items()))
    parser.add_argument("--output", metavar="DIR", type=Path, default=Path("docs", "charts"), help="where the SVGs go")
    parser.add_argument("--only", metavar="NAME", nargs="+", default=[], help="these sweeps and no others")
    parser.add_argument("--quick", action="store_true", help="few trials: seconds instead of minutes")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write what is measured there")
    words_of_figures = "what an earlier run has measured, its JSON: is drawn anew, or with --only kept of all others"
    parser.add_argument("--figures", metavar="FILE", type=Path, help=words_of_figures)
    options = parser.parse_args(words)
    try:
        for package in ("bpy", "matplotlib", "mpmath"):
            if importlib.util.find_spec(package) is None:
                raise InputError(f"this needs {package}: pip install {package}")
        status, figures = _measured(options)
        if options.json:
            with written_whole(options.json) as temporary:
                temporary.write_text(json.dumps(figures, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return status


def _measured(options: argparse.Namespace) -> tuple[int, dict[str, object]]:
    from . import charts  # which needs matplotlib

    earlier = charts.read(options.figures) if options.figures else None
    if earlier and not options.only:
        return charts.redraw(earlier, options.output)
    sweeps = importlib.import_module(f".{options.subject}", __package__)
    status, measured = sweeps.run(options.output, options.only, options.quick)
    return charts.beside(earlier, measured) if earlier else (status, measured)


if __name__ == "__main__":
    sys.exit(main())
