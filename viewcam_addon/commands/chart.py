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
    if options.figures:
        return importlib.import_module("benchmarks.charts").redraw(options.figures, options.output)
    return importlib.import_module(f"benchmarks.{options.subject}").run(options.output, options.only, options.quick)
