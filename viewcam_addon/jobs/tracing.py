"""The process that traces beside Blender: renders the reference, compares it with what was rendered, writes reports and labels.

A process of its own, kept open: scenes and hierarchies are kept from job to job, so that one costs its own pixels only. It is
no part of Blender's process, where there must be no second copy of OpenEXR. Rejected: a process for each step of each job, with
a scene to read and build each time; and one for checks and another for labels, which would hold the same scene twice.

    python -m viewcam_addon.jobs.tracing HANDLE
"""

import dataclasses
import importlib.util
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import checks, child_process
from ..cameras.calibration import Calibration
from ..cameras.distortion import Lens
from ..errors import InputError
from ..events import Events
from ..files import written_whole
from ..pinhole import Pinhole, ViewPlane
from ..tracer.scene.film import LEVELS, SAMPLES
from .job import Job

if TYPE_CHECKING:
    from ..comparison.light_verdict import RadianceComparison
    from ..comparison.sequential import Rounds
    from ..comparison.verdict import GeometryComparison
    from ..image import Image
    from ..tracer.scene import LedgerEntry, Scene

_MOST_SCENES = 4
"""Kept: a frame, its neighbors, and the one that comes next."""

PAGE = "index.html"
SIDES = {"test": "test.png", "reference": "reference.png", "everything": "everything.png", "difference": "difference.png"}
"""The pictures that `Written.sides` has beside the report; one of everything where not all of it is modeled."""


@dataclasses.dataclass(frozen=True)
class Written:
    """The files of one comparison beside its result.

    report : the folder of the HTML page.
    difference : a PNG of what differs.
    sides : a folder for PNGs of both sides.
    reference : an EXR of the tracer's picture.
    command : the command by which the page says that the comparison is repeated.
    """

    report: str | None = None
    difference: str | None = None
    sides: str | None = None
    reference: str | None = None
    command: str = ""


def lacking() -> str | None:
    """The package that a check or a label needs and does not find here, as a sentence; its search path is ours."""
    if importlib.util.find_spec("OpenEXR") is None:
        return "checks and labels need OpenEXR: install the extension from its zip, or pip install OpenEXR"
    return None


class Tracing(child_process.ServerOnDemand):
    """The process, as the one who asks has it. events : whoever is told how far it is."""

    def __init__(self, events: Events | None = None) -> None:
        super().__init__("the tracer's process", "jobs.tracing", events)

    def ask(self, request: Mapping[str, Any]) -> Any:
        if sentence := lacking():
            raise InputError(sentence)
        return super().ask(request)

    def compare(
        self,
        scene: Path,
        tests: Sequence[Path],
        job: Job,
        camera: Pinhole | None = None,
        clip: tuple[float, float] | None = None,
        stated: Pinhole | None = None,
        ledger: "Sequence[LedgerEntry]" = (),
        written: Written | None = None,
        everything: Path | None = None,
        may_be_empty: bool = False,
        is_first_round: bool = True,
    ) -> dict[str, Any]:
        """The comparison of an engine's pictures with what the tracer makes of a scene.

        scene : a scene file; the same path is the same scene, and is not read again.
        tests : the pictures of geometry, or of light with several seeds.
        job : level (none but the levels of film.py), samples, error, find, seed, threads.
        camera, clip, stated : the camera that is said to have taken the picture, what it sees and the four values that it was
            made from, in place of the scene's.
        ledger : the ledger of the scene.
        written : files beside.
        everything : Cycles' picture with all that is not modeled, where there is any.
        may_be_empty : true to call pictures that show no object different, rather than raise an error.
        is_first_round : true in the first round of a job that finds a bias; else the samples are added to those of the calls
            before.

        Returns `passed`, `answer`, `sentence` and `not_modeled` as comparison/answer.py has them; `lines` for a terminal;
        `seconds`, how long it was traced; `result`, all that --json has; and `figures`, the few of them that a sidecar keeps:
        of geometry `pixels` compared, `position` in pixels, `share_of_tolerance` of each pass where it is largest,
        `mismatches`, and `conversion`, the stated camera against this one; of light its `samples` and `quantities`. None is
        what was not compared. Of a job that finds a bias there are `undecided` and `seconds` alone until the last round, where
        `undecided` has `expected` and `following` of light_verdict.Search; then a report's folder gets the pictures of all
        rounds.

        Raises InputError if scene or pictures can't be read or are not of the same size, there is no OpenEXR, or the process
        ended first.
        """
        request = {
            "scene": str(scene),
            "tests": [str(path) for path in tests],
            "job": job.to_json(),
            "camera": camera and dataclasses.asdict(camera),
            "clip": clip and list(clip),
            "stated": stated and dataclasses.asdict(stated),
            "ledger": [dataclasses.asdict(entry) for entry in ledger],
            "written": dataclasses.asdict(written or Written()),
            "everything": everything and str(everything),
            "may_be_empty": may_be_empty,
            "is_first_round": is_first_round,
        }
        return self.ask({"compare": request})

    def compare_files(self, reference: Path, tests: Sequence[Path], **options: Any) -> dict[str, Any]:
        """The result of `compare_files` of this module there, for a process that must not read a picture itself."""
        request = {"reference": str(reference), "tests": [str(path) for path in tests], **options}
        return self.ask({"compare_files": request})

    @staticmethod
    def frame(scene: Path, camera: Pinhole, clip: tuple[float, float]) -> dict[str, Any]:
        """The frame as the camera sees it.

        scene : a scene file; the same path is the same scene.
        camera, clip : the camera and the clip range to use, whatever the file's are.
        """
        return {"scene": str(scene), "camera": dataclasses.asdict(camera), "clip": list(clip)}

    def label(
        self,
        frames: Mapping[str, dict[str, Any]],
        picture: Path,
        kinds: Sequence[str],
        depth_steps: float,
        threads: int | None = None,
        lens: Lens | None = None,
        annotations: Mapping[str, Any] | None = None,
    ) -> list[str]:
        """Write the labels beside a picture (labels.files); the names of the files.

        frames : "here", and of flow "previous" and "next" as well.
        lens : the lens that bends the picture, whose own view plane all cameras have.
        annotations : see `label` in labels/scene_labels.py.

        Raises InputError if scenes can't be read or labels not be written, there is no OpenEXR, or the process ended first.
        """
        request = {"frames": dict(frames), "picture": str(picture), "kinds": list(kinds), "depth_steps": depth_steps}
        more = {"threads": threads, "lens": lens and lens.to_json(), "annotations": dict(annotations or {})}
        return self.ask({"label": {**request, **more}})

    def distort(self, image: Path, preview: Path, calibration: Calibration, cut: ViewPlane) -> None:
        """Put a lens on a picture's two files, EXR and PNG. cut : the view plane of the pinhole that they show.

        Raises InputError if they can't be read or written, there is no OpenEXR, or the process ended first.
        """
        files = {"image": str(image), "preview": str(preview)}
        self.ask({"distort": {**files, "calibration": calibration.to_json(), "cut": dataclasses.asdict(cut)}})


def compare_files(
    reference: str | Path,
    tests: Sequence[str | Path],
    scene: str | Path | None = None,
    threads: int | None = None,
    channels: Mapping[str, Sequence[str]] | None = None,
    written: Written | None = None,
) -> dict[str, Any]:
    """The comparison of EXRs of one camera, as `viewcam compare` makes it.

    reference : the tracer's picture.
    tests : one, or several of different seeds.
    scene : the reference's scene file: explains silhouettes, brings the ledger.
    threads : all where None.
    channels : the channels of tests that another program made: pass → names of channels.
    written : files beside.

    Returns as Tracing.compare does. Raises as api.compare does, and InputError if a file can't be written.
    """
    from .. import api, image
    from ..comparison import radiance, renderers

    image.check_same_frames([reference, *tests])
    reference_image = image.read(reference)
    if channels:
        if radiance.carries_light(reference_image):
            raise InputError(f"--channels are of geometry, and {reference} shows light: trace it at level geometry")
        if not {"Depth", "Distance", "Position"} & channels.keys():
            raise InputError("--channels tells nothing of where things are: name depth, distance or position")
        if {"Depth", "Distance"} <= channels.keys():
            raise InputError("--channels names depth and distance, of which one makes the other: leave one of them out")
        pictures, renderer = [image.read_channels(path, channels) for path in tests], renderers.CYCLES
    else:
        pictures, (renderer, *_) = map(list, zip(*map(renderers.read, tests), strict=True))
    read = api.read_scene(scene) if scene else None
    partial = bool(channels) or renderer is not renderers.CYCLES
    comparison = api.compare(reference_image, pictures, read, threads, renderer=renderer, partial=partial)
    if partial:
        pictures = [renderers.completed(picture, comparison.pinhole) for picture in pictures]
    return _to_json(comparison, reference_image, pictures, read.ledger if read else (), written or Written())


class _Server:
    """The state that the process keeps from request to request."""

    def __init__(self) -> None:
        from ..labels.surfaces import Keepers
        from ..tracer.render import Keeper

        self._keeper, self._keepers = Keeper(), Keepers(_MOST_SCENES)
        self._files: dict[str, Scene] = {}
        self._rounds: Rounds | None = None

    def answer(self, request: dict[str, Any], tell: Callable[..., None]) -> Any:
        """The answer to one request of the client.

        request : {what is asked for: its arguments}.
        tell : tells an event to whoever asks.
        """
        ((name, arguments),) = request.items()
        if name == "label":
            return self._label(**arguments)
        if name == "distort":
            return _distort(**arguments)
        if name == "compare":
            return self._compare(**arguments, tell=tell)
        return compare_files(**{**arguments, "written": Written(**arguments.get("written", {}))})

    def _compare(
        self,
        scene: str,
        tests: list[str],
        job: dict[str, Any],
        camera: dict[str, Any] | None,
        clip: list[float] | None,
        stated: dict[str, Any] | None,
        ledger: list[dict[str, str]],
        written: dict[str, Any],
        everything: str | None,
        may_be_empty: bool,
        is_first_round: bool,
        tell: Callable[..., None],
    ) -> dict[str, Any]:
        from .. import api, image
        from ..comparison import renderers, sequential
        from ..comparison.light_verdict import RadianceComparison
        from ..tracer.scene import LedgerEntry
        from ..tracer.tiles import Progress

        wanted, files = Job.from_json(job), Written(**written)
        entries = tuple(LedgerEntry(**entry) for entry in ledger)
        seen = dataclasses.replace(self._seen(scene, wanted, camera, clip, stated), ledger=entries)
        level, samples = wanted.level or LEVELS[0], wanted.samples or SAMPLES
        tell("step", name="tracing")
        watcher = Progress(tell, seen.camera.height)
        spent = (level, samples, wanted.seed or 0, wanted.threads, wanted.error)
        started = time.perf_counter()
        reference = api.render(seen, *spent, watcher, self._keeper)
        seconds = time.perf_counter() - started
        reference = dataclasses.replace(reference, source=files.reference or "the tracer")
        tell("step", name="comparing")
        pictures, (renderer, *_) = map(list, zip(*map(renderers.read, tests), strict=True))
        if not files.reference:  # nothing of where they were for a while
            pictures = [dataclasses.replace(picture, source=Path(picture.source).name) for picture in pictures]
        partial = renderer is not renderers.CYCLES
        whole, alarms = image.read(everything) if everything else None, None
        if wanted.bias:
            self._rounds = sequential.Rounds() if is_first_round or self._rounds is None else self._rounds
            rounds, alarms = self._rounds, sequential.FALSE_ALARMS_OF_EACH
            rounds.add(samples, reference, pictures, whole)
            samples, reference, pictures, whole = rounds.samples, rounds.reference, rounds.tests, rounds.everything
        share = max(samples // len(tests), 1)  # Cycles' file counts one that is left out
        arguments = (seen, wanted.threads, share, renderer, partial, whole, self._keeper, may_be_empty, alarms)
        comparison = api.compare(reference, pictures, *arguments)
        if wanted.bias and isinstance(comparison, RadianceComparison):
            search = sequential.search(comparison, wanted.bias, rounds)
            if not search.is_decided:
                return {"undecided": {"expected": search.expected, "following": search.following}, "seconds": seconds}
            comparison, self._rounds = dataclasses.replace(comparison, search=search), None
            if files.report:
                for path, picture in zip(tests, pictures, strict=True):
                    image.write(path, picture)
                if everything and whole:
                    image.write(everything, whole)
        if files.reference:
            image.write(files.reference, reference)
        if partial:
            pictures = [renderers.completed(picture, comparison.pinhole) for picture in pictures]
        result = _to_json(comparison, reference, pictures, entries, files, whole)
        return {**result, "seconds": seconds}

    def _seen(
        self,
        path: str,
        wanted: Job,
        camera: dict[str, Any] | None,
        clip: list[float] | None,
        stated: dict[str, Any] | None,
    ) -> "Scene":
        """The scene of a file through the camera of a job, or in its size."""
        scene = self._scene(path)
        if camera and clip:
            stated_camera = Pinhole(**stated) if stated else None
            return dataclasses.replace(scene, camera=Pinhole(**camera), clip=(clip[0], clip[1]), stated_camera=stated_camera)
        return dataclasses.replace(scene, camera=scene.camera.resized(*wanted.size)) if wanted.size else scene

    def _label(
        self,
        frames: dict[str, dict[str, Any]],
        picture: str,
        kinds: list[str],
        depth_steps: float,
        threads: int | None,
        lens: dict[str, Any] | None,
        annotations: dict[str, Any],
    ) -> list[str]:
        from ..labels import files
        from ..labels.scene_labels import label

        scenes = {
            name: dataclasses.replace(self._scene(frame["scene"]), camera=Pinhole(**frame["camera"]), clip=tuple(frame["clip"]))
            for name, frame in frames.items()
        }
        bent = Lens.from_json(lens) if lens else None
        here, options = scenes.pop("here"), (threads, self._keepers, bent, annotations)
        labels = label(here, kinds, scenes.get("previous"), scenes.get("next"), *options)
        return [path.name for path in files.write(Path(picture), labels, depth_steps)]

    def _scene(self, path: str) -> "Scene":
        """The scene of a file, read once as long as the file is there."""
        from ..tracer.scene import scene_file

        self._files = {former: read for former, read in self._files.items() if former == path or Path(former).exists()}
        if path not in self._files:
            self._files = dict([*self._files.items()][1 - _MOST_SCENES :])
            self._files[path] = scene_file.read(path)
        return self._files[path]


def _distort(image: str, preview: str, calibration: dict[str, Any], cut: dict[str, Any]) -> None:
    from .. import image as images
    from .. import png

    lens, plane = Calibration.from_json(calibration), ViewPlane(**cut)
    images.rewrite(image, lambda pixels, is_data: lens.distorted(pixels, plane, nearest=is_data), lens.plane)
    pixels = lens.distorted(png.decoded(Path(preview).read_bytes()), plane)
    with written_whole(preview) as temporary:
        temporary.write_bytes(png.encoded(pixels if pixels.shape[2] > 2 else pixels[..., 0]))


def _to_json(
    comparison: "GeometryComparison | RadianceComparison",
    reference: "Image",
    tests: "Sequence[Image]",
    ledger: "Sequence[LedgerEntry]",
    written: Written,
    whole: "Image | None" = None,
) -> dict[str, Any]:
    """The answer about a comparison, once its files are written."""
    from ..comparison import difference, report
    from ..comparison.light_verdict import RadianceComparison
    from ..tracer.scene import with_pairs

    lines, result = comparison.lines(), comparison.to_json()
    ledger = with_pairs(ledger, comparison.pairs)
    about = (written.report or "", ledger, written.command)
    if isinstance(comparison, RadianceComparison):
        figures = _light_figures(result)
        page = report.write_light(comparison, reference, tests, *about) if written.report else None
    else:
        figures = _geometry_figures(comparison)
        page = report.write_geometry(comparison, reference, tests[0], *about) if written.report else None
    lines += [f"report: {page}"] if page else []
    result["ledger"] = [dataclasses.asdict(entry) for entry in ledger]
    if written.difference:
        result["difference"] = difference.write(comparison, written.difference)
    if written.sides:
        difference.write_sides(comparison, reference, tests, written.sides, whole)
    record = {**comparison.answer.to_json(), "lines": lines}
    return {**record, "result": checks.for_json(result), "figures": checks.for_json(figures)}


def _geometry_figures(comparison: "GeometryComparison") -> dict[str, Any]:
    position = comparison.rows[0].to_json()
    return {
        "pixels": position["count"],
        "position": {name: figure["value"] for name, figure in position["percentiles"].items()},
        "share_of_tolerance": {row.name: max(row.shares, default=None) for row in comparison.rows},
        "mismatches": {
            "count": len(comparison.mismatches.kinds),
            "unexplained": comparison.mismatches.unexplained_count,
            "allowed_unexplained": comparison.allowed_unexplained,
        },
        "conversion": comparison.conversion and comparison.conversion.to_json(),
    }


def _light_figures(result: Mapping[str, Any]) -> dict[str, Any]:
    kept = ("reference", "test", "ratio", "ratio_error", "ok")
    rows = {row["name"]: {name: row[name] for name in kept} for row in result["quantities"]}
    search = {"find": result["find"]} if "find" in result else {}
    return {"samples": result["samples"], "noisy": result["noisy"], **search, "quantities": rows}


if __name__ == "__main__":
    child_process.serve(sys.argv[1], _Server().answer)
