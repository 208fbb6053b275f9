"""The charts of docs/: benchmarks/ measures and draws them, in a clone of the project."""

import argparse
import importlib
import importlib.util
import sys
from pathlib import Path

from ..errors import InputError
from . import Result

PROJECT = Path(__file__).parents[2]


def run(options: argparse.Namespace) -> Result:
    if not (PROJECT / "benchmarks").is_dir():
        raise InputError("the charts are measured by benchmarks/, which is not here: run this in a clone of the project")
    for package in ("bpy", "matplotlib", "mpmath"):
        if importlib.util.find_spec(package) is None:
            raise InputError(f"this needs {package}: pip install {package}")
    sys.path.append(str(PROJECT))
    charts = importlib.import_module("benchmarks.charts")
    earlier = charts.read(options.figures) if options.figures else None
    if earlier and not options.only:
        return charts.redraw(earlier, options.output)
    status, measured = importlib.import_module(f"benchmarks.{options.subject}").run(options.output, options.only, options.quick)
    return charts.beside(earlier, measured) if earlier else (status, measured)
