"""Labels beside pictures that Blender writes: shots of the studio still, labeled by the tracer and by Cycles' own passes.

    python -m benchmarks.labels [--shots 1000] [--size 640x480]

Ours is `viewcam batch --labels depth,normals,position,masks --labels-only`, as a process of its own, from its start to its end.

The other way is BlenderProc's (enable_depth_output, enable_normals_output and enable_segmentation_output, with the settings of
render_segmap): each object has a pass index of its own, the camera's poses are keyframes, and one animation of Cycles writes
the passes, at a sample a pixel, with persistent data, a static BVH and no denoising. It is spared what costs it most: one EXR
has all passes, in place of one each through the compositor; and what it makes of them in loops of Python, our own code makes,
the same 16-bit depths, ids, boxes and run lengths. What it can't tell is not asked: instances of one object apart, which share
its index.

Each takes half of the shots at a time, in the order ours, theirs, theirs, ours, since a machine's speed drifts; both start anew
for each half.

Then both are read again, and every pixel of every shot compared. Two rays through the middle of one pixel that differ by a
rounding may meet two things where an edge passes, so it is told which share of the pixels differs by more than a tolerance.
Exit status 1 if that is more than edges explain, or if ours is the slower.

Needs bpy and OpenEXR, and 24 GB on the disk for 1,000 shots.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks import race
from benchmarks.batch import STILL, STUDIO
from viewcam_addon import image
from viewcam_addon.files import written_whole
from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.makers import orbit
from viewcam_addon.labels import DEPTH_STEPS, files, masks
from viewcam_addon.png import encoded

KINDS = "depth,normals,position,masks"
PASSES = ("Depth", "Normal", "Position", "Object Index", "Material Index")
# Calibrated: of the studio a pixel in a thousand differs by a quarter of these. Depth and place as shares of the depth.
TOLERANCES = {"Object Index": 0.0, "Material Index": 0.0, "Depth": 1e-4, "Position": 1e-4, "Normal": 0.01}
ON_EDGES = 1e-3
"""The share of pixels that may differ in a pass. Calibrated: the studio has a tenth, and more the larger its pixels."""

# BlenderProc's: RendererUtility.render_init, and of render_segmap set_light_bounces, samples, noise threshold and denoiser.
_CYCLES = {
    "samples": 1,
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "debug_bvh_type": "STATIC_BVH",
    "debug_use_spatial_splits": True,
    "max_bounces": 1,
    "diffuse_bounces": 1,
    "glossy_bounces": 0,
    "ao_bounces_render": 0,
    "transmission_bounces": 0,
    "transparent_max_bounces": 8,
    "volume_bounces": 0,
}


class Spent(NamedTuple):
    """Seconds that passed, and those of all processors, of processes that were waited for as well."""

    wall: float
    cpu: float


def spent(work: Callable[[], object]) -> Spent:
    before = os.times()
    work()
    passed = np.subtract(os.times(), before)
    return Spent(passed[-1], passed[:-1].sum())


def main() -> int:
    parser = argparse.ArgumentParser(prog="benchmarks.labels", description=__doc__.splitlines()[0])
    parser.add_argument("--shots", type=int, default=1000)
    parser.add_argument("--size", default="640x480", help="pixels, WIDTHxHEIGHT")
    options = parser.parse_args()
    shots = orbit(STILL.resized(*map(int, options.size.split("x"))), options.shots)
    with tempfile.TemporaryDirectory(prefix="viewcam-labels-") as name:
        folder = Path(name)
        seconds = measured(shots, folder)
        for line in table(seconds, len(shots)):
            print(line, flush=True)
        differing = compared(shots, folder)
    print("\nof all pixels differ:", ", ".join(f"{name} {share:.4%}" for name, share in differing.items()))
    return 0 if judged(seconds, differing) else 1


def judged(seconds: Mapping[str, Spent], differing: Mapping[str, float]) -> bool:
    """True if the labels are the same, and ours are not the slower."""
    expected = seconds["passes"].wall + seconds["made of them"].wall
    return seconds["ours"].wall <= expected and max(differing.values()) <= ON_EDGES


def measured(shots: Sequence[Job], folder: Path) -> dict[str, Spent]:
    """The time that ours, Cycles' passes, and what is made of them have taken; all files are in the folder."""
    blend, middle = folder / "indexed.blend", len(shots) // 2
    with race.Contestant(prepare_passes, blend, list(shots), folder / "passes") as blender:
        passes = blender.runners()["passes"]
        ours = [labeled(blend, shots[:middle], folder / "ours")]
        expected = [passes(1, middle), passes(middle + 1, len(shots))]
        ours += [labeled(blend, shots[middle:], folder / "ours")]
    pictures = sorted((folder / "passes").iterdir())
    masks_spent = spent(lambda: [of_passes(path, folder / "theirs") for path in pictures])
    return {"ours": Spent(*np.sum(ours, axis=0)), "passes": Spent(*np.sum(expected, axis=0)), "made of them": masks_spent}


def labeled(blend: Path, shots: Sequence[Job], folder: Path) -> Spent:
    """The time of `viewcam batch`, which makes a folder named as the first shot; SystemExit if it fails."""
    listed = blend.with_name("shots.json")
    listed.write_text(json.dumps([shot.to_json() for shot in shots]), encoding="utf-8")
    arguments = ["batch", blend, listed, "--labels", KINDS, "--labels-only", "--out", folder / shots[0].name]

    def run() -> None:
        process = subprocess.run([sys.executable, "-m", "viewcam_addon", *map(str, arguments)], capture_output=True, text=True)
        if process.returncode:
            sys.exit(process.stdout + process.stderr)

    return spent(run)


def prepare_passes(blend: Path, shots: Sequence[Job], folder: Path) -> dict[str, Callable[[int, int], Spent]]:
    """In Blender's process: the still with an index for each object and material, for both; and what renders the passes of
    shots, from which to which, counted from 1.
    """
    import bpy

    import viewcam_addon
    from viewcam_addon.blender import conversion, opening, versions
    from viewcam_addon.blender.rendering.cycles import override_all
    from viewcam_addon.blender.temporary_settings import overridden
    from viewcam_addon.pinhole import Pinhole

    viewcam_addon.register()
    opening.open_blend(STUDIO)
    for datablocks in (bpy.data.objects, bpy.data.materials):
        for number, each in enumerate(datablocks, 1):
            each.pass_index = number
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))

    def passes(start: int, end: int) -> None:
        opening.open_blend(blend)
        scene, (layer, *_) = bpy.context.scene, bpy.context.scene.view_layers
        render, first = scene.render, shots[0]
        render.engine, render.use_persistent_data, render.use_compositing = "CYCLES", True, False
        render.resolution_x, render.resolution_y, render.resolution_percentage = first.width, first.height, 100
        with overridden() as overrides:
            override_all(overrides, scene.cycles, _CYCLES)
            for name in ("z", "normal", "position", "object_index", "material_index"):
                setattr(layer, f"use_pass_{name}", True)
            versions.set_multilayer_file(render.image_settings)
            render.filepath, scene.frame_start, scene.frame_end = f"{folder}/", start, end
            data = bpy.data.cameras.new("poses")
            data.clip_start, data.clip_end = scene.camera.data.clip_start, scene.camera.data.clip_end
            scene.camera = bpy.data.objects.new("poses", data)
            scene.collection.objects.link(scene.camera)
            for frame, shot in enumerate(shots, 1):
                pinhole = Pinhole(shot.eye, shot.look_at, shot.up, shot.d, shot.width, shot.height)
                conversion.place(scene.camera, pinhole, scene)
                for path in ("location", "rotation_euler"):
                    scene.camera.keyframe_insert(path, frame=frame)
            bpy.ops.render.render(animation=True)

    return {"passes": lambda start, end: spent(lambda: passes(start, end))}


def of_passes(path: Path, folder: Path) -> None:
    """Write a picture's passes as labels beside them: depths and ids as PNG, boxes and run lengths of each index as JSON."""
    folder.mkdir(exist_ok=True)
    passes = image.read(path, ("Depth", "Object Index")).passes
    index = passes["Object Index"][..., 0].astype(np.int64)
    levels = files.depth_levels(passes["Depth"][::-1, :, 0], DEPTH_STEPS)
    values = masks.of_picture(np.where(index > 0, index, -1), int(index.max()) + 1)
    entries = [{"object_index": number, "visible": each} for number, each in enumerate(values) if each]
    for ending, content in (
        ("depth.png", encoded(levels)),
        ("instances.png", encoded(files.id_colors(index[::-1]))),
        ("json", json.dumps(entries).encode()),
    ):
        with written_whole(folder / f"{path.stem}.{ending}") as temporary:
            temporary.write_bytes(content)


def table(seconds: Mapping[str, Spent], count: int) -> Iterator[str]:
    ours, passes, masks_seconds = (seconds[name] for name in ("ours", "passes", "made of them"))
    both = Spent(*np.add(passes, masks_seconds))
    yield f"| {count} shots | seconds | CPU seconds | shots a second | of our throughput |"
    yield "|---|---|---|---|---|"
    for name, each in (("viewcam batch --labels", ours), ("Cycles' passes", passes), ("… and labels made of them", both)):
        yield f"| {name} | {each.wall:.1f} | {each.cpu:.1f} | {count / each.wall:.2f} | {ours.wall / each.wall:.0%} |"


def compared(shots: Sequence[Job], folder: Path) -> dict[str, float]:
    """The share of all pixels that differ, for each pass."""
    shares = [
        differences(_ours(folder / "ours", shot), image.read(folder / "passes" / f"{number:04d}.exr", tuple(TOLERANCES)).passes)
        for number, shot in enumerate(shots, 1)
    ]
    return {name: float(np.mean([each[name] for each in shares])) for name in TOLERANCES}


def _ours(folder: Path, shot: Job) -> dict[str, NDArray]:
    """Our passes, with the index of each instance's object."""
    (path,) = folder.glob(f"*/{shot.name}.labels.json")
    indices = {each["id"]: each["object_index"] for each in files.read(path)["instances"]}
    passes = image.read(path.with_suffix(".exr")).passes
    ids, places = np.unique(passes["Instance"], return_inverse=True)
    of_ids = np.array([indices.get(int(number), 0) for number in ids])
    return {**passes, "Object Index": of_ids[places].reshape(passes["Instance"].shape)}


def differences(ours: Mapping[str, NDArray], from_passes: Mapping[str, NDArray]) -> dict[str, float]:
    """The share of one picture's pixels that differ, for each pass. What is no number differs."""
    depth, result = ours["Depth"].astype(float), {}
    for name, tolerance in TOLERANCES.items():
        allowed = tolerance * depth if name in ("Depth", "Position") else tolerance
        result[name] = float((~(np.abs(ours[name].astype(float) - from_passes[name]) <= allowed)).any(axis=-1).mean())
    return result


if __name__ == "__main__":
    sys.exit(main())
