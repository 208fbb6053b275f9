"""The commands that prove a camera: export, render, cycles, compare, and check and demo, which are all of these in one go.

What Blender does (export, Cycles) and what OpenEXR does (the tracer's pictures, the comparison) never share a process, because
Blender brings a copy of OpenEXR of its own: `check` does the first in its own process and the second in child processes, in the
shell and inside Blender alike. Rejected: one process in the shell and several inside Blender, since that would be two programs
to test.
"""

import argparse
import dataclasses
import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..events import Events
from ..terminal import say, silent_libraries
from ..tracer.scene.film import seeds
from . import Result, blender_room

if TYPE_CHECKING:
    from ..tracer.tiles import Passes  # brings what the other commands need not wait for

DEMO_SCENE = Path(__file__).parents[2] / "sample_scenes" / "studio.blend"


def export(options: argparse.Namespace) -> Result:
    from ..tracer.scene import scene_file

    with silent_libraries():
        scene = blender_room("rendering.job").export(_request(options, options.strict))
    scene_file.write(scene, options.scene)
    say(*_ledger_lines(scene.ledger))
    result = {"scene": str(options.scene), "ledger": _ledger_json(scene.ledger)}
    return 0, result | (_told_level(scene) if options.level != "geometry" else {})


def render(options: argparse.Namespace) -> Result:
    from .. import api, image

    scene = api.read_scene(options.scene)
    if options.stated:
        if scene.stated_camera is None:
            raise InputError(
                f"{options.scene} has no stated_camera: leave --stated out, or enable the Virtual Pinhole in Blender"
            )
        scene = dataclasses.replace(scene, camera=scene.stated_camera)
    others = {name: api.read_scene(path) for name in ("previous", "next") if (path := getattr(options, name))}
    if others and "flow" not in (options.labels or ()):
        raise InputError(f"--{next(iter(others))} is for flow: add --labels flow")
    if options.size:
        scene, *resized = (
            dataclasses.replace(each, camera=each.camera.resized(*options.size)) for each in (scene, *others.values())
        )
        others = dict(zip(others, resized, strict=True))
    labels = api.label(scene, options.labels, **others, threads=options.threads) if options.labels else None
    told = _told_level(scene) if options.level == "auto" else {}
    level = told.get("level", options.level)
    progress = _Progress(options.events, scene.camera.height)
    started = time.perf_counter()
    traced = api.render(scene, level, options.samples, options.seed, options.threads, options.error, progress)
    seconds = time.perf_counter() - started
    image.write(options.image, traced)
    say(f"traced {scene.camera.width} × {scene.camera.height} pixels in {seconds:.2f} s")
    if labels:
        from ..labels import files

        told["labels"] = [str(path) for path in files.write(options.image, labels, options.depth_steps)]
        say(f"labels: {told['labels'][-1]}")
    return 0, {"image": str(options.image), "seconds": seconds} | told


def cycles(options: argparse.Namespace) -> Result:
    with silent_libraries():
        ledger = blender_room("rendering.job").render(_request(options, options.strict), options.image)
    say(*_ledger_lines(ledger))
    return 0, {"image": str(options.image), "ledger": _ledger_json(ledger)}


def compare(options: argparse.Namespace) -> Result:
    from .. import api, image
    from ..comparison import difference, light_report, radiance, renderers, report
    from ..tracer.scene import with_pairs

    image.check_same_frames([options.reference, *options.tests])
    reference = image.read(options.reference)
    is_light = radiance.carries_light(reference)
    if options.channels:
        if is_light:
            raise InputError(f"--channels are of geometry, and {options.reference} shows light: trace it at level geometry")
        tests, renderer = [image.read_channels(path, _stated(options.channels)) for path in options.tests], renderers.CYCLES
    else:
        tests, (renderer, *_) = zip(*map(renderers.read, options.tests), strict=True)
    partial = bool(options.channels) or renderer is not renderers.CYCLES
    scene = api.read_scene(options.scene) if options.scene else None
    of = reference, tests, scene, options.threads, options.test_samples, renderer, partial
    comparison = api.compare(*of, everything=options.everything)
    if partial:
        tests = [renderers.completed(test, comparison.pinhole) for test in tests]
    pairs = comparison.taken_out.pairs if is_light else comparison.in_one_place.pairs()
    ledger = with_pairs(scene.ledger, pairs) if scene else ()
    words = f"viewcam {options.repeat or options.words}"
    write_report, tests = (light_report.write_report, tests) if is_light else (report.write_report, tests[0])
    say(*_ledger_lines(ledger), *comparison.lines())
    if options.report:
        say(f"report: {write_report(comparison, reference, tests, options.report, ledger, words)}")
    result = {**comparison.to_json(), "ledger": _ledger_json(ledger)}
    if options.difference:
        result["difference"] = difference.write(comparison, options.difference)
    if options.sides:
        difference.write_sides(comparison, reference, tests if is_light else [tests], options.sides)
    return comparison.answer.exit_status(options.strict), result


def _stated(channels: Sequence[tuple[str, list[str]]]) -> dict[str, list[str]]:
    """What --channels says, checked to tell where things are."""
    if not {"Depth", "Distance", "Position"} & {name for name, _ in channels}:
        raise InputError("--channels tells nothing of where things are: name depth, distance or position")
    return dict(channels)


def check(options: argparse.Namespace) -> Result:
    from ..child_process import run_viewcam

    if options.engine != "CYCLES" and (options.level != "geometry" or options.error):
        raise InputError(f"--engine {options.engine} is checked at level geometry alone: leave --level and --error out")
    if options.engine != "CYCLES" and options.device != "CPU":
        raise InputError(f"--device is for Cycles, and {options.engine} renders on what the graphics driver has: leave it out")
    with tempfile.TemporaryDirectory(prefix="viewcam-") as temporary:
        folder = options.report or Path(temporary)
        scene, reference = folder / "scene.json", folder / "reference.exr"
        count = seeds(options.level, options.samples)
        name = options.engine.lower()
        tests = [folder / f"{name}-{i + 1}.exr" for i in range(count)] if count > 1 else [folder / f"{name}.exr"]
        numbered = {} if options.scene is None else {"numbered": _numbered(options.scene)}
        everything = folder / "everything.exr"
        everything.unlink(missing_ok=True)
        level = _export_and_render(options, scene, tests, everything, engine=options.engine, device=options.device, **numbered)
        size = []
        if options.scene:
            scene, size = options.scene, ["--size", "x".join(map(str, options.size))] if options.size else []
        threads = ["--threads", str(options.threads)] if options.threads else []
        spent = ["--error", str(options.error)] if options.error else ["--samples", str(options.samples)]
        light = ["--level", level, *spent, "--seed", str(options.seed)]
        tell_on = options.events if options.log_json else None
        options.events.tell("step", name="tracing")
        status = run_viewcam("render", scene, reference, *light, *size, *threads, tell_on=tell_on)
        if status:
            return status, {"error": "the reference could not be traced"}
        outputs = [
            word
            for flag in ("report", "difference", "sides")
            if (to := getattr(options, flag))
            for word in (f"--{flag}", str(to))
        ]
        outputs += ["--strict"] if options.strict else []
        outputs += ["--everything", str(everything)] if everything.exists() else []
        outputs += ["--test-samples", str(max(options.samples // count, 1)), "--repeat", options.repeat or options.words]
        if level == "geometry":
            tests = tests[:1]
        options.events.tell("step", name="comparing")
        result = Path(temporary) / "result.json"
        outputs += ["--json", str(result)]
        status = run_viewcam("compare", reference, *tests, "--scene", scene, *threads, *outputs, tell_on=tell_on)
        return status, json.loads(result.read_bytes()) if result.exists() else {"error": "the pictures could not be compared"}


def demo(options: argparse.Namespace) -> Result:
    if not options.blend.is_file():
        raise InputError(f"{options.blend} is not here: run the demo in a clone of the project, where its sample scenes are")
    say(f"{options.blend.name}: a camera given by four values, rendered by Cycles and by the reference tracer")
    return check(options)


def _numbered(scene_path: Path) -> tuple[str, ...]:
    """What of a .blend must be numbered for its picture to be this scene's: what has numbers there."""
    from ..tracer.scene import scene_file

    objects = scene_file.read(scene_path).objects
    has_numbers = {
        "objects": any(placed.object_index for placed in objects),
        "materials": any(any(placed.material_indices) for placed in objects),
    }
    return tuple(kind for kind, has in has_numbers.items() if has)


def _export_and_render(
    options: argparse.Namespace, scene_path: Path, image_paths: Sequence[Path], everything: Path, **more: Any
) -> str:
    """What of a check needs Blender: both sides from one evaluated state, under one numbering of the indices.

    everything : as in job.export_and_render. more : of the request. Returns the level, the least one where that is asked for.
    """
    from ..tracer.scene import scene_file

    started = time.perf_counter()

    def rendering(number: int) -> None:
        options.events.tell("step", name="rendering", number=number, of=max(number, len(image_paths)))

    with silent_libraries():
        scene = blender_room("rendering.job").export_and_render(_request(options, **more), image_paths, rendering, everything)
    scene_file.write(scene, scene_path)
    say(f"exported and rendered with {options.engine.capitalize()} in {time.perf_counter() - started:.1f} s")
    return _told_level(scene)["level"] if options.level == "auto" else options.level


def _told_level(scene: Any) -> dict[str, str]:
    """The least level that models all of a scene's light, and why; said on the way."""
    from ..tracer.scene.levels import least_level

    level, reason = least_level(scene)
    say(f"level {level} is enough. {reason}")
    return {"level": level, "reason": reason}


def _request(options: argparse.Namespace, strict: bool = False, **more: Any) -> Any:
    """strict : whether anything of the file that is not modelled ends it; where pictures are compared, theirs alone counts."""
    return blender_room("rendering.job").Request(
        blend=options.blend,
        camera=options.camera,
        frame=options.frame,
        size=options.size,
        strict=strict,
        recenter=options.recenter,
        threads=options.threads,
        level=options.level,
        samples=options.samples,
        seed=options.seed,
        clay=options.clay,
        trust=options.trust,
        **more,
    )


def _ledger_lines(ledger: Sequence[Any]) -> list[str]:
    exported = sum(entry.is_modelled for entry in ledger)
    rest = [f"  {entry.status}: {entry.object}: {entry.reason}" for entry in ledger if not entry.is_modelled]
    return [f"{exported} of {len(ledger)} objects exported whole", *rest] if ledger else []


def _ledger_json(ledger: Sequence[Any]) -> list[dict[str, str]]:
    return [{"object": entry.object, "status": entry.status, "reason": entry.reason} for entry in ledger]


class _Progress:
    """A tracer's watcher that tells `progress`, with the share of the rows that are done, at each whole percent.

    rows : how many the picture has.
    """

    def __init__(self, events: Events, rows: int) -> None:
        self._events, self._done, self._percent = events, bytearray(rows), 0
        events.tell("progress", share=0.0)

    def tile(self, passes: "Passes", rows: range) -> None:
        self._done[rows.start : rows.stop] = b"\1" * len(rows)
        percent = 100 * sum(self._done) // len(self._done)
        if percent > self._percent:
            self._percent = percent
            self._events.tell("progress", share=percent / 100)

    def stop(self) -> bool:
        return False
