"""Make the sample scenes: python sample_scenes/make.py [NAME …] [--folder DIR] [--pictures SAMPLES] [--sheet FILE]

Each scene is a module here with a build(), whose docstring goes into the file as a note. `make scenes` runs this with
bpy 4.2, so that all later Blenders open the files. --pictures also renders each with Cycles, beside its file; --sheet puts
these pictures together as docs/images/sample-scenes.jpg. Those of materials.py are made where they are named.
"""

import argparse
import importlib
from pathlib import Path

import bpy
import building
import materials

import viewcam_addon

SCENES = ("studio", "spheres", "straight_down", "portrait", "wide", "telephoto", "flight", "cornell")
ROWS = (("studio", "spheres", "portrait"), ("wide", "straight_down"), ("telephoto", "flight", "cornell"))
WIDTH, GAP = 1280, 8  # pixels of the sheet, and between two pictures


def main() -> None:
    options = argparse.ArgumentParser(description="Make the sample scenes.")
    options.add_argument("names", metavar="NAME", nargs="*", help=f"which of {', '.join(SCENES)}; all if none is named")
    options.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where the files go; here by default")
    options.add_argument("--pictures", metavar="SAMPLES", type=int, help="also render each scene to a PNG")
    options.add_argument("--sheet", metavar="FILE", type=Path, help="also put the pictures of all scenes together")
    arguments = options.parse_args()
    known = (*SCENES, *materials.BUILDERS)
    unknown = set(arguments.names) - set(known)
    if unknown:
        options.error(f"there is no scene {', '.join(sorted(unknown))}; the scenes are {', '.join(known)}")
    viewcam_addon.register()
    try:
        for name in arguments.names or SCENES:
            make(name, arguments.folder.resolve(), arguments.pictures)
        if arguments.sheet:
            write_sheet(arguments.folder.resolve(), arguments.sheet)
    finally:
        viewcam_addon.unregister()  # bpy 4.2 crashes at exit where an update callback is still registered


def make(name: str, folder: Path, picture_samples: int | None) -> None:
    """Build one scene, save it, and render it if it is wanted."""
    build = materials.BUILDERS.get(name)
    module = build or importlib.import_module(name)
    scene = (build or module.build)()
    path = folder / f"{name}.blend"
    building.save(scene, module.__doc__, path)
    print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")
    if picture_samples:
        scene.cycles.samples = picture_samples
        scene.render.filepath = str(path.with_suffix(".png"))
        bpy.ops.render.render(write_still=True)


def write_sheet(folder: Path, path: Path) -> None:
    """Put the pictures in a folder side by side, in rows that are as wide as the sheet."""
    from PIL import Image

    places, top = [], 0
    for names in ROWS:
        widths = [_width_over_height(folder / f"{name}.blend") for name in names]
        height, left = (WIDTH - GAP * (len(names) - 1)) / sum(widths), 0.0
        for name, width in zip(names, widths, strict=True):
            right = left + width * height
            picture = Image.open(folder / f"{name}.png").convert("RGB")
            size = round(right) - round(left), round(height)
            places.append((picture.resize(size, Image.Resampling.LANCZOS), (round(left), top)))
            left = right + GAP
        top += round(height) + GAP
    sheet = Image.new("RGB", (WIDTH, top - GAP), "white")
    for picture, place in places:
        sheet.paste(picture, place)
    sheet.save(path, quality=88)


def _width_over_height(blend: Path) -> float:
    """The shape of a file's picture as it is shown, whatever the shape of its pixels."""
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    render = bpy.context.scene.render
    return render.resolution_x * render.pixel_aspect_x / (render.resolution_y * render.pixel_aspect_y)


if __name__ == "__main__":
    main()
