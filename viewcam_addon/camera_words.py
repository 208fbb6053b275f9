"""The words of `viewcam camera`, with their help, of which those on how cameras are taken are `viewcam batch`'s, too."""

import argparse
from pathlib import Path

from . import cameras, words


def add(added: argparse.ArgumentParser) -> None:
    """Add the words to the parser of the command, which has those of every command already."""
    added.add_argument("file", metavar="FILE", help="a file or folder with cameras; - for standard input")
    added.add_argument("--list", action="store_true", help="a line for each camera, and what is to be said of them")
    added.add_argument("--camera", metavar="NAME", help="only this one of them")
    added.add_argument("--from", dest="format", choices=cameras.readable(), help="the format (default: by its content)")
    added.add_argument("--to", choices=cameras.writable(), help="write them in this format")
    added.add_argument("--out", metavar="FILE", type=Path, help="where to; a folder for some formats (default: printed)")
    taken(added)
    added.add_argument("--out-axes", choices=[*cameras.AXES], default="as_is", help="the axes of what is written")
    added.add_argument("--out-scale", type=words.above_zero, metavar="S", default=1.0, help="1 unit written is S units here")


def taken(added: argparse._ActionsContainer, size: bool = True) -> None:
    """Add the words that say how cameras are to be taken. size : whether --size is one of them, and not there already."""
    if size:
        added.add_argument("--size", type=words.size, metavar="WxH", help="pixels, where the file does not say")
    added.add_argument("--axes", choices=[*cameras.AXES], default="as_is", help="y_up: y points up in the file and z here")
    added.add_argument("--scale", type=words.above_zero, metavar="S", default=1.0, help="1 unit of the file is S units here")
    added.add_argument("--distance", type=words.above_zero, metavar="D", help="view-plane distance in pixels, for poses alone")
    added.add_argument(
        "--pixel-aspect",
        type=words.above_zero,
        metavar="A",
        default=1.0,
        help="a pixel's width over its height if not said",
    )
    added.add_argument("--angles", choices=[*cameras.ANGLES], help="the unit of angles that have none")
    added.add_argument("--pixel", choices=[*cameras.PIXELS], help="where (0, 0) is, in place of the format's habit")
    added.add_argument("--without-distortion", action="store_true", help="take cameras without their lens distortion")
    added.add_argument("--unmirrored", action="store_true", help="take cameras that mirror their picture without that")
    added.add_argument("--original-world", action="store_true", help="undo a transforms.json's applied_transform")
