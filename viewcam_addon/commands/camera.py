"""List the cameras of another program's file, or write them for a third one.

A .blend is such a file, too. A file, a folder or, as "-", what stands on standard input; see cameras/.
"""

import argparse
import dataclasses
import os
import sys
from pathlib import Path

from .. import argument_types as types
from .. import cameras
from ..cameras import Camera, Options, transforms, undistortion
from ..cameras.distortion import Lens
from ..errors import InputError, counted, several
from ..files import folder_written_whole
from ..jobs import makers
from ..pinhole import ViewPlane
from ..terminal import say, silent_libraries
from . import Result, blender_room

_MOST_CHARACTERS = 100_000_000


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    added.add_argument("file", metavar="FILE", help="a file or folder with cameras, a .blend too; - for standard input")
    added.add_argument("--list", action="store_true", help="a line for each camera, and what is to be said of them")
    added.add_argument("--camera", metavar="NAME", help="only this one of them")
    added.add_argument("--frames", metavar="A..B", help="of a .blend: its camera at each frame (from -5 on: --frames=-5..3)")
    added.add_argument("--trust", action="store_true", help="of a .blend: let what is in it run and write")
    added.add_argument("--from", dest="format", choices=cameras.readable(), help="the format (default: by its content)")
    added.add_argument("--to", choices=cameras.writable(), help="write them in this format")
    added.add_argument("--out", metavar="FILE", type=types.path, help="where to; a folder for some formats (default: printed)")
    add_reading_options(added)
    text = "write the pictures without their lens, and their cameras as pinholes, into this new folder"
    added.add_argument("--undistort", metavar="OUT", type=types.path, help=f"{text} (--to transforms or colmap)")
    text = "write the maps by which compositors take each lens off and put it on, and the pinholes, into this new folder"
    added.add_argument("--st-maps", metavar="OUT", type=types.path, help=text)
    text = "how much of a pinhole's picture may be empty: 0 (default): nothing; 1: as much as shows all of each photograph"
    added.add_argument("--blank", type=types.share, metavar="B", default=0.0, help=f"for these two: {text}")
    added.add_argument("--out-axes", choices=[*cameras.AXES], default="as_is", help="the axes of what is written")
    added.add_argument("--out-scale", type=types.above_zero, metavar="S", default=1.0, help="1 unit written is S units here")


def add_reading_options(added: argparse._ActionsContainer, size: bool = True) -> None:
    """Add the options that say how cameras are read.

    size : true to add --size, too; false where the command has it already.
    """
    if size:
        added.add_argument("--size", type=types.size, metavar="WxH", help="pixels, where the file does not say")
    added.add_argument(
        "--axes", choices=[*cameras.AXES], default="as_is", help="y_up, y_down: where y points in the file, and z up here"
    )
    text = "turn the world so that up is z: the mean of the cameras' up, or the ground's of the data set's points"
    ups = added.add_mutually_exclusive_group()
    ups.add_argument("--up-from", choices=[*cameras.UPS], help=text)
    text = "the same as --up-from ground: z = 0 is the ground of the points, of a COLMAP model or a .ply"
    ups.add_argument("--ground", action="store_const", dest="up_from", const="ground", help=text)
    added.add_argument("--scale", type=types.above_zero, metavar="S", default=1.0, help="1 unit of the file is S units here")
    added.add_argument("--distance", type=types.above_zero, metavar="D", help="view-plane distance in pixels, for poses alone")
    added.add_argument(
        "--pixel-aspect", type=types.above_zero, metavar="A", default=1.0, help="a pixel's width over its height if not said"
    )
    added.add_argument("--angles", choices=[*cameras.ANGLES], help="the unit of angles that have none")
    added.add_argument("--pixel", choices=[*cameras.PIXELS], help="where (0, 0) is, in place of the format's habit")
    added.add_argument("--pose", choices=[*cameras.POSES], help="which way a matrix goes whose name does not say it")
    added.add_argument("--without-distortion", action="store_true", help="take cameras without their lens distortion")
    added.add_argument("--unmirrored", action="store_true", help="take cameras that mirror their picture without that")
    added.add_argument("--original-world", action="store_true", help="undo a transforms.json's applied_transform")


def options_of(options: argparse.Namespace) -> Options:
    """The choices of the options on reading, which `viewcam batch` has, too."""
    plane = None
    if options.distance is not None:
        if options.size is None:
            raise InputError("--distance counts pixels of a picture: give --size as well")
        width, height = options.size
        distance = (options.distance, options.distance * options.pixel_aspect)
        plane = ViewPlane(distance, (width / 2, height / 2), width, height)
    return Options(
        axes=options.axes,
        scale=options.scale,
        size=options.size,
        pixel_aspect=options.pixel_aspect,
        view_plane=plane,
        angle_unit=options.angles,
        pixel=options.pixel,
        pose=options.pose,
        without_distortion=options.without_distortion,
        unmirrored=options.unmirrored,
        original_world=options.original_world,
        up_from=options.up_from,
    )


def run(options: argparse.Namespace) -> Result:
    if options.list and options.to:
        raise InputError("--list and --to say each what to do with the cameras: give one of them")
    if options.undistort:
        return _undistort(options)
    if options.st_maps:
        return _st_maps(options)
    if options.out and not options.to:
        raise InputError("--out says where to, but not in which format: give --to")
    if options.out and os.path.realpath(options.out) == os.path.realpath(options.file):
        raise InputError(f"{options.out} is what is read, and would be overwritten: give --out another name")
    with silent_libraries():  # Blender tells what it opens, USD all that a stage lacks
        read = _read(options)
    notes = list(dict.fromkeys(note for camera in read for note in camera.notes))
    for note in notes:
        options.events.tell("note", command=options.command, text=note)
    result = {"cameras": [{"name": each.name, **_to_json(each)} for each in read], "notes": notes}
    if options.to is None:
        say(*(_line(camera) for camera in read))
        return 0, result
    conversion = Options(axes=options.out_axes, scale=options.out_scale, pixel=options.pixel)
    if options.out is None:
        content = cameras.write(read, options.to, conversion)
        if not isinstance(content, str):
            raise InputError(f"{options.to} is {len(content)} files, {', '.join([*content][:3])}: give a folder with --out")
        say(*content.removesuffix("\n").split("\n"))
        return 0, result
    written = cameras.save(read, options.out, options.to, conversion)
    say(f"{counted(len(read), 'camera')}, as {cameras.FORMATS[options.to].TITLE}: {options.out}")
    return 0, result | {"written": [str(path) for path in written]}


def _read(options: argparse.Namespace) -> list[Camera]:
    if options.file.lower().endswith(".blend"):
        room = blender_room("dataset_cameras")
        if options.frames is not None:
            shots = [(job.name, job.frame) for job in makers.frames(options.frames)]
            return room.of_file(Path(options.file), shots, options.camera, options.trust)
        read = room.of_file(Path(options.file), trust=options.trust)
    elif options.frames is not None:
        raise InputError(f"--frames are those of a .blend, and {options.file} is none: leave them out")
    else:
        source = sys.stdin.read(_MOST_CHARACTERS) if options.file == "-" else Path(options.file)
        read = cameras.read(source, format=options.format, options=options_of(options))
    return read if options.camera is None else [cameras.choose(read, options.camera)]


def _undistort(options: argparse.Namespace) -> Result:
    dataset = Path(options.file)
    if options.file == "-" or options.list or options.out or options.camera is not None:
        raise InputError("--undistort writes all of a data set into its folder: give the data set, and leave the others out")
    if options.axes != "as_is" or options.scale != 1 or options.original_world or options.up_from:
        raise InputError("--undistort leaves the world as it is, for its points' sake: turn and scale what it has written")
    read = cameras.read(dataset, format=options.format, options=options_of(options))
    form = options.to or ("transforms" if cameras.recognized(dataset) == "transforms" else "colmap")
    if form not in undistortion.FORMS:
        raise InputError(f"--undistort writes {' or '.join(undistortion.FORMS)}: give --to one of these")
    for note in dict.fromkeys(note for camera in read for note in camera.notes):
        options.events.tell("note", command=options.command, text=note)
    written = undistortion.save(read, dataset, options.undistort, form, options.blank)
    sizes = ", ".join(dict.fromkeys(f"{each.pinhole.width} × {each.pinhole.height}" for each in written))
    bent = sum(camera.lens is not None for camera in read)
    say(f"{len(written)} pictures, {bent} of them undistorted ({sizes}): {options.undistort}")
    return 0, {"cameras": [{"name": each.name, **_to_json(each)} for each in written]}


def _st_maps(options: argparse.Namespace) -> Result:
    from .. import image

    if options.list or options.out or options.to or options.undistort:
        raise InputError("--st-maps writes maps and pinholes into its folder: leave --list, --to, --out and --undistort out")
    with silent_libraries():
        read = _read(options)
    of_lenses: dict[tuple[Lens, ViewPlane], list[str]] = {}
    for camera in read:
        if camera.lens is not None:
            of_lenses.setdefault((camera.lens, camera.pinhole.plane), []).append(camera.name)
    if not of_lenses:
        raise InputError(f"no camera of {options.file} has a lens that distorts: there is nothing to map")
    lines = []
    with folder_written_whole(options.st_maps) as temporary:
        for number, ((lens, plane), names) in enumerate(of_lenses.items(), start=1):
            cut = undistortion.undistorted(lens, plane, options.blank)
            for what, pixels in zip(("undistort", "distort"), undistortion.st_maps(lens, plane, cut), strict=True):
                image.write_rgba(temporary / f"lens_{number}.{what}.exr", pixels)
            sizes = f"{plane.width} × {plane.height} with the lens, {cut.width} × {cut.height} without"
            lines.append(f"lens_{number}: {sizes}, of {several(names)}")
        cameras.save(undistortion.straight(read, options.blank), temporary / transforms.FILE, "transforms")
    say(*lines, f"{counted(len(of_lenses), 'lens', 'lenses')} and {counted(len(read), 'pinhole')}: {options.st_maps}")
    return 0, {"lenses": [{"name": f"lens_{i}", "cameras": names} for i, names in enumerate(of_lenses.values(), start=1)]}


def _to_json(camera: Camera) -> dict:
    kept = {key: getattr(camera, key) for key in ("size_stated", "image", "time", "notes")}
    return {**kept, "camera": dataclasses.asdict(camera.pinhole)}


def _line(camera: Camera) -> str:
    pinhole = camera.pinhole
    e, l = (", ".join(f"{number + 0.0:.6g}" for number in point) for point in (pinhole.eye, pinhole.look_at))
    d = " × ".join(f"{number:.6g}" for number in dict.fromkeys(pinhole.distance))
    c = ", ".join(f"{number:.6g}" for number in pinhole.principal_point)
    shifted = "" if pinhole.principal_point == (pinhole.width / 2, pinhole.height / 2) else f", principal point {c}"
    mirrored = ", mirrored" if pinhole.mirrored else ""
    size = f"{pinhole.width} × {pinhole.height}{'' if camera.size_stated else ' (as given)'}"
    return f"{camera.name}: {size}, d = {d}{shifted}{mirrored}, eye ({e}), look-at ({l})"
