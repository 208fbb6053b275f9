"""What `import viewcam_addon as vp` gives: a camera, a picture traced of a scene, and what two pictures differ by.

Everything here takes what is in memory or the path of a file, and gives what is in memory; the command line is made of the same
functions. Nothing needs Blender but `check`, which runs it in a process of its own. Where Blender is a module of this process,
no picture may be read from a file in it or written (image.py says why): those in memory may be compared.
"""

import json
import os
import tempfile
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import image as images
from .errors import InputError
from .image import Image
from .tracer import render as tracing
from .tracer.scene import Scene, scene_file
from .tracer.scene.film import MOST_SAMPLES, SAMPLES
from .tracer.scene.levels import least_level

if TYPE_CHECKING:  # each function imports what no other needs: a picture is traced before half of it would be loaded
    from .comparison.light_verdict import RadianceComparison
    from .comparison.renderers import Renderer
    from .comparison.verdict import GeometryComparison
    from .labels.scene_labels import Labels

File = str | os.PathLike[str]


def read_scene(path: File) -> Scene:
    """A scene file, as docs/scene-file.md has it and `viewcam export` writes it.

    Raises
    ------
    InputError
        if there is none, or something in it is wrong; it names the key.
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
) -> Image:
    """Trace a scene with the reference tracer.

    scene : or the path of a scene file; its camera is `scene.camera`, which `dataclasses.replace` changes.
    level : "geometry", "direct", "path", or "auto" for the least one that leaves nothing out.
    samples : of each pixel, at the levels of light. seed : another for other noise. threads : all cores where None.
    error : the standard error of each pixel, scene-linear, instead of a number of samples.
    watcher : is told of rows that are done, and may stop it.

    Returns the passes by name, (height, width, channels) float32, rows from the bottom, with the camera.

    Raises
    ------
    InputError
        if there is no such level, a number makes no sense, or the scene needs more memory than there is.
    """
    scene = scene if isinstance(scene, Scene) else read_scene(scene)
    level = least_level(scene)[0] if level == "auto" else level
    passes = tracing.render(scene, level, MOST_SAMPLES if error else samples, seed, threads, watcher, error)
    attributes = {"software": "Virtual Pinhole", "level": level}
    if level != "geometry":
        if error:
            samples = round(float(passes["Sample Count"].mean(dtype=float)))
            attributes["error"] = str(error)
        attributes |= {"samples": str(samples), "seed": str(seed)}
        if any(closure.node.is_tabulated for material in scene.materials.values() for closure in material.closures):
            attributes["albedo tables"] = "yes"
    return Image(passes, scene.camera, attributes)


def label(
    scene: Scene | File,
    labels: Collection[str] = ("depth", "normals", "position", "masks", "amodal"),
    previous: Scene | File | None = None,
    next: Scene | File | None = None,
    threads: int | None = None,
) -> "Labels":
    """What is true of a scene's picture, exact at the centre of each pixel.

    scene : or the path of a scene file, as the others. labels : some of "depth", "normals", "position", "masks", "amodal",
    "flow" and "coverage"; docs/labels.md says what each brings. previous, next : the frames before and after, for "flow".
    threads : all cores where None.

    Returns the passes as an Image, and what is told of each instance as plain JSON values.

    Raises
    ------
    InputError
        if there is no such label, flow has no other frame, or frames differ in size.
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
) -> "GeometryComparison | RadianceComparison":
    """What a picture differs from the tracer's by, how much, and whether it is explained.

    reference : the tracer's, of `render` or an EXR. tests : Cycles', say; several of different seeds where there is noise.
    scene : what the reference shows, with which pixels on edges are traced again. Without it none of them is explained.
    test_samples : of each test picture, where that is not what its file tells. renderer : who made it, one of
    comparison.renderers; Cycles by default. partial : of geometry, whether it may lack passes: Depth, Distance or Position is
    enough. everything : Cycles' picture with all that the scene's ledger says is not modelled, of the first test's seed; it
    tells on how much of the picture that is.

    Returns geometry's comparison or that of light: `.answer`, `.passed`, `.sentence`, `.lines()`, `.to_json()`.

    Raises
    ------
    InputError
        if sizes differ, a pass is missing, the camera is not known, several pictures have no noise to tell, or no pixel of
        either picture shows an object.
    """
    from .comparison import geometry, radiance, renderers
    from .comparison.everything import not_modelled

    several = tests if isinstance(tests, Sequence) and not isinstance(tests, str) else [tests]
    if files := [each for each in (reference, *several) if not isinstance(each, Image)]:
        images.check_same_frames(files)
    of = reference if isinstance(reference, Image) else images.read(reference)
    whole = everything if everything is None or isinstance(everything, Image) else images.read(everything)
    pictures = [each if isinstance(each, Image) else images.read(each) for each in several]
    scene = scene if scene is None or isinstance(scene, Scene) else read_scene(scene)
    camera = of.camera or (scene.camera if scene else None)
    if camera is None:
        raise InputError(f"{of.source} does not tell its camera: give its scene with --scene, or trace it with viewcam render")
    # The picture may be of another size than the scene says, or of the stated camera.
    shown = scene and replace(scene, camera=camera)
    stated = scene.stated_camera if scene and camera == scene.camera else None
    if radiance.carries_light(of):
        lit = radiance.compare(of, pictures, camera, test_samples)
        lit = replace(lit, stated=stated)
        if shown is None or not (names := shown.not_modelled):
            return lit
        surfaces = tracing.Tracer(shown, threads).pixels_of(names)
        return replace(lit, not_modelled=not_modelled(names, surfaces, of, pictures, whole, camera))
    if len(pictures) != 1:
        raise InputError(f"{of.source} has no noise that several pictures could tell: compare it with one")
    by = renderer or renderers.CYCLES
    if shown is None:
        found = geometry.compare(of, pictures[0], camera, renderer=by, partial=partial)
    else:
        tracer = tracing.Tracer(shown, threads)
        found = geometry.compare(of, pictures[0], camera, tracer.surface_at, stated, shown.origin, by, partial)
        names = shown.not_modelled
        found = replace(found, not_modelled=not_modelled(names, tracer.pixels_of(names), of, pictures, whole))
    if found.shows_nothing:
        raise InputError(found.sentence)
    return found


@dataclass(frozen=True)
class Check:
    """What `check` has found, or a comparison of files.

    passed : whether Cycles renders the camera, or the pictures are the same. sentence : by how much. figures : all that --json
    writes. answer : one of "same", "same_but" (the same, but for objects that are not modelled) and "different".
    """

    passed: bool
    sentence: str
    figures: dict[str, Any]

    @property
    def answer(self) -> str:
        return str(self.figures["answer"])


def check(blend: File, *options: File) -> Check:
    """True if Cycles renders the camera of a .blend file, by `viewcam check` in a process of its own.

    options : those of the command, as in `check("shot.blend", "--camera", "Camera", "--level", "direct")`.

    Raises
    ------
    InputError
        as the command does: no Blender, no such file or camera, no such option.
    """
    return run("check", blend, *options)


def run(command: str, *words: File) -> Check:
    """What `viewcam check` or `viewcam compare` finds, in a process of its own; raises as `check` does."""
    from . import child_process

    with tempfile.TemporaryDirectory(prefix="viewcam-") as folder:
        result, errors = Path(folder) / "result.json", _Errors()
        given = [str(word) for word in (*words, "--json", result)]
        status = child_process.run_viewcam(command, *given, tell_on=errors, apart_from=child_process.blender_scripts())
        if not result.exists() or "answer" not in (figures := json.loads(result.read_text(encoding="utf-8"))):
            raise InputError(errors.last or f"viewcam {command} ended with status {status} and without a word")
    return Check(status == 0, figures["sentence"], figures)


class _Errors:
    """The last sentence of what goes wrong."""

    last = ""

    def tell(self, event: str, **fields: Any) -> None:
        if event == "error":
            self.last = fields["text"]
