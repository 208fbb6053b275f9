"""One comparison with Cycles beside Blender: a copy of the file as it stands, and a job on it, in a process of its own.

Nothing here needs a window. Whoever starts a comparison asks it now and then how far it is, or ends it. The copy, the child's
own temporary files and what it makes stand in one folder in Blender's own temporary one, which ends with Blender.

How far it is the child tells in its log, a line of JSON for each step (events.py). Rejected: rendering in Blender's own
process (it would stop the artist, and change the scene for as long), and `bpy.data.libraries.write` for the copy (it has no
windows, and so another scene may be the current one).
"""

import dataclasses
import importlib.util
import json
import shutil
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import bpy

from ... import child_process
from ...comparison.answer import DIFFERENT, SAME_BUT, but_for, percent_of
from ...comparison.statistics import plain
from ...errors import InputError, counted, operator_reason
from ...file_names import made_fit
from ...files import written_whole
from ...jobs import plan as orders
from ...jobs.job import Job
from ...jobs.plan import Plan
from ...jobs.tracing import SIDES
from ...pinhole import Pinhole
from ...tracer.scene.film import LEVELS, SAMPLES, seeds
from .. import camera as cameras
from .. import datablocks, preferences

_RESULT, _OUTPUT, _REPORT = "result.json", "output.txt", "report"
_PICTURES = {"cycles": SIDES["test"], "tracer": SIDES["reference"], "difference": SIDES["difference"]}
_COMPRESSED = (b"\x1f\x8b", b"\x28\xb5\x2f\xfd")


@dataclass(frozen=True)
class Outcome:
    """The outcome of a comparison.

    what : a text that names camera, frame and level.
    camera : the camera's name.
    seen : the camera as it stood then, None if it was no pinhole.
    answer : one of comparison/answer.py's, None where there is none.
    verdict : one sentence.
    headline : a few words of it.
    rows : (label, text) of the figures.
    lacking : (object, sentence) of what is not modeled as it is.
    folder : the report's folder.
    colors : the meaning of the difference's colors.
    scale : the numbers at both ends of these colors, as difference.write has them.
    temporary : the folder that `discard` removes.
    """

    what: str
    camera: str
    seen: Pinhole | None
    answer: str | None
    verdict: str
    headline: str = ""
    rows: tuple[tuple[str, str], ...] = ()
    lacking: tuple[tuple[str, str], ...] = ()
    folder: Path | None = None
    colors: str = ""
    scale: dict[str, Any] = field(default_factory=dict)
    temporary: Path | None = None

    @property
    def report(self) -> Path | None:
        return self._there("index.html")

    @property
    def pictures(self) -> dict[str, Path]:
        """The PNGs of Cycles, the tracer and what differs, by these names; empty where one is missing.

        And of everything, where not all of it is modeled: the artist's own picture, of which the others show stand-ins.
        """
        paths = {name: path for name, file in _PICTURES.items() if (path := self._there(file))}
        everything = self._there(SIDES["everything"])
        more = {"everything": everything} if everything else {}
        return more | paths if len(paths) == len(_PICTURES) else {}

    def is_of(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> bool:
        """True if the camera is still the one that was compared."""
        return camera_object.name == self.camera and camera_seen(camera_object, scene) == self.seen

    def discard(self) -> None:
        """Remove what nobody wanted to keep."""
        if self.temporary:
            shutil.rmtree(self.temporary, ignore_errors=True)

    def _there(self, name: str) -> Path | None:
        path = self.folder and self.folder / name
        return path if path and path.is_file() else None


def temporary_folder(what: str) -> Path:
    """A new folder in the one that Blender removes as it ends. what : the folder's content, as a sentence calls it."""
    try:
        return Path(tempfile.mkdtemp(prefix="viewcam-", dir=bpy.app.tempdir or None))
    except OSError as error:
        raise InputError(f"no folder for the {what} can be made ({error.strerror}): free some space") from error


class RunningComparison:
    """A comparison in the background, which is on its way from the moment it is made.

    scene : the one of the window.
    level : one of film.LEVELS, or "auto".
    find : the bias that is to be found, of a comparison of light; see Job.
    clay : true to cover everything with one matte material.
    keep_in : a folder that gets one for each report, named by file, camera, frame and time; by default the report is gone with
        Blender.

    Raises InputError if the camera is no pinhole or not in the scene, if the copy can't be written, or the child not be
    started.
    """

    def __init__(
        self,
        camera_object: bpy.types.Object,
        scene: bpy.types.Scene,
        level: str = LEVELS[0],
        find: str = "2%",
        clay: bool = False,
        keep_in: Path | None = None,
    ) -> None:
        _check_possible(camera_object, scene)
        self._camera, self._seen = camera_object.name, camera_seen(camera_object, scene)
        self._what = f"{camera_object.name}, frame {scene.frame_current}, {level}"
        self._keep_in = keep_in and keep_in / report_name(camera_object.name, scene.frame_current)
        self._pictures = seeds(level, SAMPLES)
        self._started = time.monotonic()
        job = Job(camera=camera_object.name, level=level, clay=clay, find=find if level != LEVELS[0] else None)
        self.folder = temporary_folder("comparison")
        try:
            save_copy(self.folder / _file_name())
            self._process = self._child(scene, job)
        except OSError as error:
            _remove(self.folder)
            raise InputError(f"the comparison can't be started ({error.strerror}): free some space") from error
        except InputError:
            _remove(self.folder)
            raise

    def _child(self, scene: bpy.types.Scene, job: Job) -> child_process.ProcessGroup:
        """The check of the job, on its way; the report names what repeats it with the artist's file."""
        copy, report = self.folder / _file_name(), str(self.folder / _REPORT)
        difference = str(self.folder / _REPORT / _PICTURES["difference"])
        command = f"viewcam {dataclasses.replace(job, blend=str(copy)).check_words()}"
        files = {"report": report, "difference": difference, "sides": report, "command": command}
        return start(copy, scene, [job], self.folder / _OUTPUT, files=files)

    def progress(self) -> tuple[float, str]:
        """The progress, from 0 to 1 in steps of unequal length, and the name of the step."""
        done, words = _step({"name": "rendering", "number": 1}, self._pictures)
        traced, taken, following, expected, left = 0.0, 0, 0, 1, ""
        for event in child_process.events_in(self._output().splitlines()):
            if event["event"] == "step":
                done, words = _step(event, self._pictures)
            elif event["event"] == "progress":
                traced = event["share"]
            elif event["event"] == "forecast":
                taken, following, expected = event["taken"], event["following"], event["samples"]
                left, done = f", about {event['seconds']:.0f} s more", 0
        share = (done + (traced if words == "Tracing" else 0)) / (self._pictures + 2)
        if taken:
            share = (taken + share * (following - taken)) / expected
        return share, words + left

    @property
    def seconds(self) -> float:
        """Since it was started."""
        return time.monotonic() - self._started

    def wait(self) -> None:
        """Wait until there is something to poll."""
        self._process.wait()

    def poll(self) -> Outcome | None:
        """The outcome, None while it runs. What is left of it then is the outcome's folder."""
        status = self._process.status()
        if status is None:
            return None
        self._process.end()
        outcome = self._outcome(status)
        for path in self.folder.iterdir():  # the copy, and what else is no part of the report
            if path != outcome.folder:
                _remove(path)
        if outcome.temporary is None:
            _remove(self.folder)
        return outcome

    def cancel(self) -> None:
        """End it at once, without a trace."""
        self._process.end()
        _remove(self.folder)

    def _outcome(self, status: int) -> Outcome:
        subject = (self._what, self._camera, self._seen)
        result = _read(self.folder / _RESULT)
        if "answer" not in result:
            return Outcome(*subject, None, failure(self._output(), status))
        folder = self.folder / _REPORT
        temporary: Path | None = self.folder
        if self._keep_in:
            try:
                shutil.copytree(folder, self._keep_in, copy_function=_copy_whole, dirs_exist_ok=True)
                folder, temporary = self._keep_in, None
            except (OSError, InputError) as error:
                return Outcome(*subject, None, f"The report can't be kept in {self._keep_in} ({error}): choose another folder")
        drawn = result.get("difference", {})
        return Outcome(
            *subject,
            result["answer"],
            result["sentence"],
            headline(result),
            tuple(figures(result)),
            tuple(lacking(result["ledger"])),
            folder,
            drawn.get("colors", ""),
            drawn.get("scale", {}),
            temporary,
        )

    def _output(self) -> str:
        return (self.folder / _OUTPUT).read_text(encoding="utf-8", errors="replace")


def _step(event: Mapping[str, Any], pictures: int) -> tuple[int, str]:
    """The number of steps before the one that an event tells of, and the name of that one.

    pictures : the number of Cycles' pictures.
    """
    if event["name"] == "rendering":
        number = event["number"]
        if number > pictures:
            return pictures, "Rendering what is not modeled"
        return number - 1, "Rendering with Cycles" + (f", {number} of {pictures}" if pictures > 1 else "")
    return (pictures, "Tracing") if event["name"] == "tracing" else (pictures + 1, "Comparing")


def report_name(camera: str, frame: int) -> str:
    """The name of a report's folder: by file, camera, frame and the time now."""
    name = made_fit(f"{Path(_file_name()).stem} {camera} {frame:04d}")
    return f"{name} {datetime.now():%Y-%m-%d %H.%M.%S}"


def _file_name() -> str:
    """The open file's, as a copy of it is called."""
    return f"{Path(bpy.data.filepath).stem or 'untitled'}.blend"


def save_copy(path: Path) -> None:
    """Save the file as it stands, unsaved edits included, and leave what is open as it is: name, unsaved state, paths, history.

    Raises InputError if Blender can't write it.
    """
    try:
        # Blender saves the artist's file the next time as it saved last.
        bpy.ops.wm.save_as_mainfile(
            "EXEC_DEFAULT", filepath=str(path), copy=True, relative_remap=True, compress=_is_compressed(), check_existing=False
        )
    except RuntimeError as error:
        raise InputError(f"a copy of the file can't be saved ({operator_reason(error)}): free some space") from error


def camera_seen(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole | None:
    """The camera as it stands, to tell later whether it has changed."""
    try:
        return cameras.read(camera_object, scene)
    except InputError:
        return None


def headline(result: dict[str, Any]) -> str:
    """The verdict in a few words, for a panel."""
    if result["answer"] == DIFFERENT:
        return "Cycles renders another picture"
    words = _agreement(result)
    if result["answer"] != SAME_BUT:
        return words
    share = result["not_modeled"]["share"]
    measured = "" if share is None else f" ({percent_of(share)} of the picture)"
    return f"{words}, {but_for(result['not_modeled'])}{measured}"


def _agreement(result: dict[str, Any]) -> str:
    for row in (row for row in result.get("passes", ()) if row["name"] == "Position"):
        if row["percentiles"]:
            return f"Identical to {plain(row['percentiles']['max']['value'])} px"
    for light in result.get("quantities", ())[:1]:  # Combined
        if light["noise_free"] and light["noise_free"]["percentiles"]:
            return f"Identical to {plain(100 * light['noise_free']['percentiles']['max']['value'])} % of the light"
        if light["ratio_error"] is not None:
            return f"The same light, but for noise of {plain(100 * light['ratio_error'])} %"
    return "Identical"


def lacking(ledger: Sequence[dict[str, str]]) -> list[tuple[str, str]]:
    """(object, sentence) of each entry of a ledger that is not modeled as it is."""
    return [(entry["object"], f"{entry['status']}, {entry['reason']}") for entry in ledger if entry["status"] != "exported"]


def figures(result: dict[str, Any]) -> list[tuple[str, str]]:
    """(label, text) of what `viewcam check` wrote as JSON, for a panel."""
    rows = []
    for row in (row for row in result.get("passes", ()) if row["name"] == "Position"):
        rows += _percentiles(row, "px")
    if "mismatches" in result:
        kinds = result["mismatches"]["kinds"].values()
        count, explained = (sum(kind[name] for kind in kinds) for name in ("count", "explained"))
        share = "all" if explained == count else f"{explained:,}"
        rows.append(("Mismatches", f"{count:,}" + (f", {share} explained" if count else "")))
    for light in result.get("quantities", ())[:1]:  # Combined
        if light["noise_free"]:
            rows += _percentiles(light["noise_free"], "of the light")
        else:
            ratio = "nothing" if light["ratio"] is None else f"{light['ratio']:.5f} ± {plain(light['ratio_error'])}"
            rows.append(("Light, to Tracer's", ratio))
    ledger = result["ledger"]
    whole = sum(entry["status"] == "exported" for entry in ledger)
    return [*rows, ("Modeled", f"{whole} of {counted(len(ledger), 'object')}")]


def failure(printed: str, status: int) -> str:
    """One sentence for a child that came to nothing: the error that it has told, or its last words.

    Of several problems with a list of shots it is the first, and how many more there are.
    """
    lines = printed.splitlines()
    errors = [event for event in child_process.events_in(lines) if event["event"] == "error"]
    if errors:
        sentence, *more = errors[-1].get("problems") or [errors[-1]["text"]]
        return sentence[:1].upper() + sentence[1:] + (f" (and {len(more)} more problems)" if more else "")
    ending = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
    words = [line.strip() for line in lines if line.strip() and not line.startswith('{"event"')]
    return f"The process that compares {ending}" + (f" after saying: {words[-1]}" if words else "")


def _check_possible(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
    datablocks.check_perspective(camera_object)
    if scene.objects.get(camera_object.name) != camera_object:
        raise InputError(f"camera {camera_object.name!r} is not in scene {scene.name!r}: choose one that is")
    if not hasattr(scene, "cycles"):
        raise InputError("Cycles is disabled: enable the add-on Cycles Render Engine in Blender's preferences")
    if importlib.util.find_spec("OpenEXR") is None:  # the children's search path is ours
        raise InputError("OpenEXR is missing: install the extension from its zip, which brings it along")


def start(
    copy: Path,
    scene: bpy.types.Scene,
    jobs: Sequence[Job],
    log: Path,
    plan: Plan | None = None,
    files: Mapping[str, str] | None = None,
) -> child_process.ProcessGroup:
    """Start a process that carries out jobs on a copy, in this same Blender.

    log : the file for all that it prints, its events among it; all else that it needs for a while lies beside this file.
    plan, files : see plan.write.

    Raises OSError if it can't be started; InputError if what it is to do can't be written.
    """
    if not bpy.app.binary_path:  # a module of Python, which opens the copy itself
        jobs = [dataclasses.replace(job, blend=str(copy)) for job in jobs]
        plan = plan and dataclasses.replace(plan, blend=copy)
    written = log.with_name("jobs.json")
    orders.write(written, jobs, plan, files)
    # Blender's own scripts hold what the inside of a `bpy` looks like, which hides the module from a new process.
    scripts = bpy.utils.system_resource("SCRIPTS")
    variables = child_process.environment(scripts, **{name: str(log.parent) for name in ("TMPDIR", "TMP", "TEMP")})
    return child_process.ProcessGroup(command(copy, scene, written), log, variables)


def command(copy: Path, scene: bpy.types.Scene, written: Path) -> list[str]:
    """The command of that process.

    written : the file that says what it is to do.
    """
    if not bpy.app.binary_path:
        return child_process.viewcam("serve", written)
    # The file's own scene is that of its first window. The add-on may be enabled for this session only.
    other = ["--scene", scene.name] if any(window.scene != scene for window in bpy.context.window_manager.windows[:1]) else []
    enabled = ["--addons", preferences.PACKAGE] if preferences.PACKAGE in bpy.context.preferences.addons else []
    options = ["--background", "--disable-autoexec", *enabled, str(copy), *other]
    return [bpy.app.binary_path, *options, "--command", "viewcam", "serve", str(written)]


def _is_compressed() -> bool:
    try:
        with open(bpy.data.filepath, "rb") as file:
            return file.read(4).startswith(_COMPRESSED)
    except OSError:  # never saved
        return bpy.context.preferences.filepaths.use_file_compression


def _read(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError:  # it was not written
        return {}


def _remove(path: Path) -> None:
    """Also what a process that is being killed creates meanwhile: it may take a few milliseconds to die."""
    if path.is_dir():
        ends = time.monotonic() + 1
        while path.is_dir() and time.monotonic() < ends:
            shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _percentiles(row: dict[str, Any], unit: str) -> list[tuple[str, str]]:
    """The percentiles of a row of a table that has any, as JSON has it."""
    names = (("Median", "p50"), ("99.9 % within", "p99.9"))
    percentiles = row["percentiles"]
    return [(label, f"{plain(percentiles[name]['value'])} {unit}") for label, name in names if name in percentiles]


def _copy_whole(source: str, target: str) -> None:
    with written_whole(target) as temporary:
        shutil.copyfile(source, temporary)
