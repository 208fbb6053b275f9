"""The words of `viewcam batch`, with their help. What they can't be together, commands/batch.py says."""

import argparse
from pathlib import Path

from . import camera_words, words
from .shots import ENGINES, LEVELS

DESCRIPTION = "Render many shots of one file: opened once, each written whole, and continued after whatever ended it."

_EXAMPLES = """\
examples:
  {command}{file} shots.csv --out renders
      a list of shots: CSV, JSON or JSON Lines, one camera a row
  {command}{file} sparse/0 --out renders
      the cameras of a COLMAP model, or of any file that viewcam camera reads
  {command}{file} --orbit 36 --size 640x360 --out turntable
      around what the scene's camera looks at
  {command}{file} --frames 1..250 --out frames --resume
      an animation; what is there from the same settings is kept
  {command}{file} --cameras 'Cam*' --out views --check
      each camera so called, compared with the reference tracer
  {command}{file} --orbit 200 --out nerf --transforms
      with transforms.json and COLMAP text for those who learn the scene
  {command}{file} shots.csv --out renders --workers 2
      on two processes; --scheduler tcp://host:8786 on a farm

exit status:
  0 all shots are there, and every check passed   1 a check failed
  2 bad input, nothing is rendered   4 shots failed or are left   130, 143 ended by SIGINT, SIGTERM
"""


def add(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    """Add the words to the parser of the command, which has those of every command already."""
    added.formatter_class = argparse.RawDescriptionHelpFormatter
    command, file = ("blender -b FILE.blend --command viewcam batch", "") if blend_is_open else ("viewcam batch", " FILE.blend")
    added.usage = f"{command}{file} (SHOTS | --orbit N | --frames A..B | --cameras GLOB) --out DIR [OPTION …]"
    added.epilog = _EXAMPLES.format(command=command, file=file)

    shots = added.add_argument_group("which shots: one of these")
    shots.add_argument(
        "shots",
        metavar="SHOTS",
        type=Path,
        nargs="?",
        help="a list (.csv, .json, .jsonl …) or any cameras",
    )
    shots.add_argument("--orbit", type=words.positive, metavar="N", help="N views around the camera's look-at point")
    shots.add_argument("--frames", metavar="A..B", help="a shot of the camera at each frame (from -5 on: --frames=-5..3)")
    shots.add_argument(
        "--cameras", metavar="GLOB", help="a shot of each camera so called: with * ? [abc]; --transforms has _ for each space"
    )
    shots.add_argument("--shard", metavar="I/N", help="of all these, every N-th from the I-th on: for a farm's own manager")

    camera_words.taken(added.add_argument_group("how cameras of another program are taken"), size=False)

    said = added.add_argument_group("what a shot does not say itself")
    said.add_argument("--camera", metavar="NAME", help="of --orbit and --frames: the camera (default: the scene's)")
    said.add_argument("--size", type=words.size, metavar="WxH", help="pixels of the picture (default: the scene's)")
    said.add_argument("--frame", type=int, metavar="N", help="the frame (default: the file's current one)")
    said.add_argument("--engine", choices=ENGINES, help="who renders (default: the scene's)")
    said.add_argument("--samples", type=words.positive, metavar="N", help="samples a pixel (default: the scene's)")
    said.add_argument("--level", choices=LEVELS, help="how much VIEWCAM models (default: the scene's)")
    said.add_argument("--seed", type=words.seed, metavar="N", help="another noise for another number (default: the scene's)")

    written = added.add_argument_group("what is written")
    written.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder of the pictures")
    kept = written.add_mutually_exclusive_group()
    kept.add_argument("--resume", action="store_true", help="keep the shots that are there from the same settings")
    known = "the same, unless what they were made from can't all be known: then render all of them anew"
    kept.add_argument("--resume-known", action="store_true", help=known)
    kept.add_argument("--overwrite", action="store_true", help="render all of them anew")
    written.add_argument("--check", action="store_true", help="compare each shot's geometry with the reference tracer")
    written.add_argument(
        "--transforms", choices=["png", "exr"], nargs="?", const="png", help="transforms.json and COLMAP text of the png or exr"
    )

    machines = added.add_argument_group("more than one process")
    limit = "seconds that a shot may take; then its Blender is ended, and the shot has failed"
    machines.add_argument("--time-limit", type=words.above_zero, metavar="SECONDS", help=limit)
    machines.add_argument("--workers", type=words.positive, metavar="N", help="render in N processes of this machine")
    where = "render on a Dask cluster, as tcp://host:8786 (without an address: on one of this machine)"
    machines.add_argument("--scheduler", metavar="ADDRESS", nargs="?", const="", type=_address, help=where)


def _address(text: str) -> str:
    if "://" not in text:
        raise argparse.ArgumentTypeError(f"{text!r} is no address of a Dask scheduler: write tcp://host:8786")
    return text
