"""The functions of `import viewcam_addon as vp`: a camera, a picture traced of a scene, and what two pictures differ by.

Everything here takes what is in memory or the path of a file, and gives what is in memory; the command line is made of the same
functions. Nothing here needs Blender. Where Blender is a module of this process, no picture may be read from a file in it or
written (image.py says why): those in memory may be compared.
"""

import functools
import os
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from . import image as images
from .errors import InputError
from .image import Image
from .tracer import render as tracing
from .tracer.scene import Scene, least_level, scene_file
from .tracer.scene.film import MOST_SAMPLES, SAMPLES

if TYPE_CHECKING:  # each function imports what no other needs: a picture is traced before half of it would be loaded
    from .comparison.light_verdict import RadianceComparison
    from .comparison.renderers import Renderer
    from .comparison.verdict import GeometryComparison
    from .labels.scene_labels import Labels

File = str | os.PathLike[str]

# From a picture's seed to those of what is traced again beside it: beyond the seeds of all rounds of a search for a bias.
_OTHER_SEEDS = 1000


def read_scene(path: File) -> Scene:
    """A scene file, as docs/scene-file.md has it and `viewcam export` writes it.

    Raises InputError if there is none, or something in it is wrong; it names the key.
    """
    return scene_file.read(Path(path))


def render(
    scene: Scene | File,
    level: str = "auto",
    samples: int = SAMPLES,
    seed: int = 0,
    threads: int | None = None,
    error: float | None = None,
    watcher: tracing.Watcher | None = None,
    keeper: tracing.Keeper | None = None,
) -> Image:
    """Trace a scene with the reference tracer.

    scene : a scene, or the path of its file; its camera is `scene.camera`, which `dataclasses.replace` changes.
    level : "geometry", "direct", "path", or "auto" for the least one that leaves nothing out.
    samples : the number of samples of each pixel, at the levels of light.
    seed : any whole number; another one gives other noise.
    threads : the number of threads to trace with; all cores where None.
    error : the standard error of each pixel, scene-linear, instead of a number of samples.
    watcher : called with the rows that are done, and may stop it.
    keeper : keeps what scenes share that are traced one after another.

    Returns the passes by name, (height, width, channels) float32, rows from the bottom, with the camera.

    Raises InputError if there is no such level, a number makes no sense, or the scene needs more memory than there is.
    """
    scene = scene if isinstance(scene, Scene) else read_scene(scene)
    level = least_level(scene)[0] if level == "auto" else level
    passes = tracing.render(scene, level, MOST_SAMPLES if error else samples, seed, threads, watcher, error, keeper)
    attributes = {"software": "Virtual Pinhole", "level": level}
    if level != "geometry":
        if error:
            samples = round(float(passes["Sample Count"].mean(dtype=float)))
            attributes["error"] = str(error)
        attributes |= {"samples": str(samples), "seed": str(seed)}
        shaders = [closure.node for material in scene.materials.values() for closure in material.closures]
        if any(shader.is_tabulated for shader in shaders):
            attributes["albedo tables"] = "yes"
        if any(shader.is_shining for shader in shaders):
            attributes["shining surfaces"] = "yes"
    return Image(passes, scene.camera, attributes)


def label(
    scene: Scene | File,
    labels: Collection[str] = ("depth", "normals", "position", "masks", "amodal"),
    previous: Scene | File | None = None,
    next: Scene | File | None = None,
    threads: int | None = None,
) -> "Labels":
    """The ground truth of a scene's picture, exact at the center of each pixel.

    scene : a scene or the path of its file, as the other two are.
    labels : some of "depth", "normals", "position", "masks", "amodal", "flow" and "coverage"; docs/labels.md says what each
        brings.
    previous, next : the frames before and after, for "flow".
    threads : the number of threads to trace with; all cores where None.

    Returns the passes as an Image, and what is told of each instance as plain JSON values.

    Raises InputError if there is no such label, flow has no other frame, or frames differ in size.
    """
    from .labels import scene_labels

    frame = scene if isinstance(scene, Scene) else read_scene(scene)
    before, after = (each if each is None or isinstance(each, Scene) else read_scene(each) for each in (previous, next))
    return scene_labels.label(frame, labels, before, after, threads)


def compare(
    reference: Image | File,
    tests: Image | File | Sequence[Image | File],
    scene: Scene | File | None = None,
    threads: int | None = None,
    test_samples: int | None = None,
    renderer: "Renderer | None" = None,
    partial: bool = False,
    everything: Image | File | None = None,
    keeper: tracing.Keeper | None = None,
    may_be_empty: bool = False,
    false_alarms: float | None = None,
) -> "GeometryComparison | RadianceComparison":
    """The comparison of a picture with the tracer's: what differs, by how much, and whether it is explained.

    reference : the tracer's picture, of `render` or an EXR.
    tests : Cycles' picture, say; several of different seeds where there is noise.
    scene : the scene that the reference shows. Pixels on edges are traced again with it; without it none of them is explained.
    test_samples : the number of samples of each test picture, where its file tells none or another one.
    renderer : the program that made the test pictures, one of comparison.renderers; Cycles by default.
    partial : true to let a test picture of geometry lack passes: Depth, Distance or Position is enough.
    everything : Cycles' picture with all that the scene's ledger says is not modeled, of the first test's seed; it tells on how
        much of the picture that is.
    keeper : see `render`.
    may_be_empty : true to call pictures that show no object, or whose light is all a renderer's choice, different, rather than
        raise an error.
    false_alarms : the highest probability with which two pictures of the same light are called different; one in a hundred by
        default.

    Returns geometry's comparison or that of light: `.answer`, `.passed`, `.sentence`, `.lines()`, `.to_json()`.

    Raises InputError if sizes differ, a pass is missing, the camera is not known, several pictures have no noise to tell, no
    pixel of either picture shows an object, or nearly all pixels with light had to be taken out.
    """
    from .comparison import geometry, radiance
    from .comparison.everything import not_modeled
    from .comparison.light_verdict import FALSE_ALARMS
    from .comparison.renderers import CYCLES

    several = tests if isinstance(tests, Sequence) and not isinstance(tests, str) else [tests]
    if files := [each for each in (reference, *several) if not isinstance(each, Image)]:
        images.check_same_frames(files)
    traced, *pictures = (each if isinstance(each, Image) else images.read(each) for each in (reference, *several))
    whole = everything if everything is None or isinstance(everything, Image) else images.read(everything)
    scene = scene if scene is None or isinstance(scene, Scene) else read_scene(scene)
    camera = traced.camera or (scene.camera if scene else None)
    if camera is None:
        raise InputError(
            f"{traced.source} does not tell its camera: give its scene with --scene, or trace it with viewcam render"
        )
    # The picture may be of another size than the scene says, or of the stated camera.
    framed = scene and replace(scene, camera=camera)
    stated = scene.stated_camera if scene and camera == scene.camera else None
    comparison: GeometryComparison | RadianceComparison
    if radiance.carries_light(traced):
        alarms = false_alarms or FALSE_ALARMS
        if framed is None:
            return radiance.compare(traced, pictures, camera, test_samples, false_alarms=alarms)
        makes_tracer = functools.cache(lambda: (keeper or tracing.Keeper()).tracer(framed, threads))
        comparison = _compare_light(traced, pictures, framed, makes_tracer, whole, test_samples, alarms)
        comparison = replace(comparison, stated=stated)
    elif len(pictures) != 1:
        raise InputError(f"{traced.source} has no noise that several pictures could tell: compare it with one")
    elif framed is None:
        comparison = geometry.compare(traced, pictures[0], camera, renderer=renderer or CYCLES, partial=partial)
    else:
        tracer, by, names = (keeper or tracing.Keeper()).tracer(framed, threads), renderer or CYCLES, framed.not_modeled
        comparison = geometry.compare(traced, pictures[0], camera, tracer.surfaces_at, stated, framed.origin, by, partial)
        comparison = replace(comparison, not_modeled=not_modeled(names, tracer.pixels_of(names), traced, pictures, whole))
    if comparison.is_empty and not may_be_empty:
        raise InputError(comparison.sentence)
    return comparison


def _compare_light(
    traced: Image,
    pictures: Sequence[Image],
    scene: Scene,
    makes_tracer: Callable[[], tracing.Tracer],
    whole: Image | None,
    test_samples: int | None,
    false_alarms: float,
) -> "RadianceComparison":
    """The comparison of pictures of a known scene's light: what has no one answer there is traced again and taken out.

    traced : the tracer's picture.
    scene : the scene that it shows, through its camera.
    makes_tracer : called where rays are sent, which a comparison without a doubtful pixel does not.
    whole : see `everything` of `compare`.
    """
    from .comparison import radiance
    from .comparison.coincident import SAMPLES as SAMPLES_OF_COINCIDENT
    from .comparison.coincident import CoincidentLight
    from .comparison.everything import not_modeled
    from .comparison.sides import samples_of, seed_of
    from .comparison.tolerances import ROUNDINGS

    if not scene.bounces.parts_diffuse:  # a picture of another renderer may have the pass all the same
        kept = ({name: passes for name, passes in each.passes.items() if name != "Diffuse Indirect"} for each in pictures)
        pictures = [replace(each, passes=passes) for each, passes in zip(pictures, kept, strict=True)]
    level, samples, seed = traced.attributes.get("level", "path"), samples_of(traced) or 0, seed_of(traced)

    def coincident() -> CoincidentLight:
        spent = (level, SAMPLES_OF_COINCIDENT, seed + _OTHER_SEEDS)
        light, pairs, seen_otherwise = makes_tracer().coincident_light(*spent, ROUNDINGS[-1])
        total = makes_tracer().render_light(*spent)["Combined"][..., :3]
        return CoincidentLight(Image(light), total, pairs, seen_otherwise)

    def anew() -> list[Image]:
        others = (seed + _OTHER_SEEDS + 1 + number for number in range(radiance.SEEDS))
        return [Image(makes_tracer().render_light(level, samples, other), scene.camera, traced.attributes) for other in others]

    trace_anew = anew if 0 < samples <= MOST_SAMPLES and "Sample Count" not in traced.passes else None
    lit = radiance.compare(traced, pictures, scene.camera, test_samples, coincident, trace_anew, false_alarms)
    names = tuple(dict.fromkeys((*scene.not_modeled, *lit.taken_out.names)))
    if not names:
        return lit
    surfaces = makes_tracer().pixels_of(scene.not_modeled)
    surfaces |= {name: surfaces.get(name, False) | lit.taken_out.pixels for name in lit.taken_out.names}
    parts = not_modeled(names, surfaces, traced, pictures, whole, scene.camera)
    one_place, otherwise = (
        [name for name in group if name not in scene.not_modeled]
        for group in (lit.taken_out.in_one_place, lit.taken_out.seen_otherwise)
    )
    return replace(lit, not_modeled=parts.sorted_by(one_place, otherwise))
