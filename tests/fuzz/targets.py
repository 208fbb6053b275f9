"""A program that reads a hostile file: `targets.py KIND FIRST COUNT FOLDER` feeds mutants FIRST … to it, one after another.

A mutant that is met with anything but success, a failed comparison or one sentence is told as a line of JSON. Before each its
number goes into FOLDER/current, so that who started this knows which one ended it: SIGALRM after `SECONDS`, a crash. All that
this process may have is `MEMORY` of address space. With one word more, FOLDER keeps the mutants.
"""

import contextlib
import io
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

TESTS = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(TESTS / "fuzz"), str(TESTS / "jobs"), str(TESTS.parent)]

import mutants
import numpy as np

SECONDS = 20.0
MEMORY = 4 * 2**30
SMALL_SECONDS, SMALL_MEMORY = 5.0, 2**30
"""For a file of cameras, labels or a scene; of computing, and beyond what this process has to begin with."""

LONGEST = 1500  # characters of a sentence, which may name files
CORNERS = np.array([[x, y] for x in (-0.5, 0.0, 0.5) for y in (-0.3, 0.0, 0.3)])  # the picture's, in the plane at distance 1

CAMERA = {"eye": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "distance": 14, "width": 16, "height": 12}
IDENTITY = np.eye(4).tolist()
WEB = {"type": "ies", "text": "IESNA\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 100\n0 90\n0\n100 50\n", "strength": 0.5}
SCENE = {
    "format": "virtual-pinhole-scene",
    "version": 1,
    "camera": CAMERA,
    "stated_camera": CAMERA | {"principal_point": [8.0, 6.0], "mirrored": False, "distance": [14.0, 14.0]},
    "arrays": "scene.npz",
    "geometries": {
        "ball": {"type": "spheres", "centers": [[0, 0, 0]], "radii": [1], "materials": [0]},
        "wall": {"type": "plane", "corner": [-3, 1, -3], "edges": [[6, 0, 0], [0, 0, 6]]},
        "far": {"type": "mesh", "vertices": {"npz": "v"}, "triangles": {"npz": "t"}, "corner_normals": {"npz": "n"}},
        "face": {
            "type": "mesh",
            "vertices": [[0, 0, 0], [1, 0, 0], [0, 0, 1]],
            "triangles": [[0, 1, 2]],
            "corner_normals": [[[0, -1, 0], [0, -1, 0], [0, -1, 0]]],
            "corner_uvs": [[[0, 0], [1, 0], [0, 1]]],
            "corner_colors": [[[1, 0, 0], [0, 1, 0], [0, 0, 1]]],
            "materials": [1],
        },
    },
    "objects": [
        {"name": "ball", "geometry": "ball", "matrix": IDENTITY, "materials": ["glass"], "hidden_from": ["shadow"]},
        {"name": "wall", "geometry": "wall", "location": [0, 0, 0], "rotation": [0, 0, 0], "scale": [1, 1, 1]},
        {"name": "far", "geometry": "far", "scale": 2, "materials": ["glowing"]},
        {"name": "face", "geometry": "face", "object_index": 3, "material_indices": [1, 2], "materials": ["", "drawn"]},
    ],
    "clip": [0.1, 1000],
    "origin": [1, 2, 3],
    "images": {"checker": {"pixels": [[[0, 0, 0], [1, 1, 1]]], "srgb": True}, "large": {"pixels": {"npz": "i"}}},
    "materials": {
        "glass": {"glass": [1, 1, 1], "ior": 1.5},
        "glowing": {"emission": [2, 1, 1], "diffuse": [0.5, 0.5, 0.5], "displacement": {"type": "wave"}},
        "drawn": {
            "diffuse": {"image": "checker", "closest": True, "vertex": True},
            "mirror": {"image": "large", "rgb": [1, 1, 1]},
        },
    },
    "lamps": [
        {"type": "sun", "name": "sun", "towards": [0, 0.5, -1], "irradiance": [1, 1, 1], "angle": 0.01},
        {
            "type": "point",
            "name": "bulb",
            "position": [0, -3, 3],
            "power": [9, 9, 9],
            "radius": 0.1,
            "soft_falloff": True,
            "emission": WEB,
        },
        {"type": "spot", "name": "spot", "matrix": IDENTITY, "power": [9, 9, 9], "angle": 1.0, "blend": 0.2, "radius": 0},
        {"type": "area", "name": "area", "location": [0, 0, 3], "size": [1, 2], "power": [9, 9, 9], "ellipse": True},
    ],
    "world": {"radiance": [0.2, 0.2, 0.3]},
    "film": {"filter": "BLACKMAN_HARRIS", "filter_width": 1.5, "exposure": 1.0, "transparent": False},
    "bounces": {"total": 4, "diffuse": 2, "glossy": 2, "transmission": 4},
    "ledger": [{"object": "Hair", "status": "skipped", "reason": "curls"}],
}


def arrays() -> dict[str, np.ndarray]:
    grid = np.arange(25.0)
    vertices = np.stack([grid % 5 - 2, np.full(25, 2.0), grid // 5 - 2], axis=1)
    triangles = np.array([[i, i + 1, i + 6] for i in range(18)], np.int32)
    normals = np.broadcast_to(np.array([0, -1, 0], np.float32), (18, 3, 3))
    return {"v": vertices, "t": triangles, "n": np.array(normals), "i": np.ones((4, 8, 3), np.float32)}


def packed(**members: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.savez(file, **members)
    return file.getvalue()


class Failure(Exception):
    """A mutant was answered otherwise than it should."""


def viewcam(*words: object) -> None:
    """Run a command in this process, and raise Failure unless all is well or told in a sentence."""
    from viewcam_addon import cli

    message = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        status = _with_events(cli, [str(word) for word in words], message)
    sentence = message.getvalue().strip()
    if status not in (0, 1, 2, 3) or (status > 1) != bool(sentence):
        raise Failure(f"status {status}: {sentence!r}")
    judge(sentence)
    if warned:
        raise Failure(f"warned: {warned[0].message} at {warned[0].filename}:{warned[0].lineno}")


def _with_events(cli: object, words: list[str], output: io.StringIO) -> int:
    """Run the command with what it says of errors sent to `output` in place of standard error."""
    from viewcam_addon import events

    @contextlib.contextmanager
    def opened(_: bool) -> Iterator[object]:
        yield events.Sentences(output)

    cli.events = type("Events", (), {"opened": staticmethod(opened)})
    return cli.main(words)


def judge(sentence: str) -> None:
    """Raise Failure if a sentence is none."""
    if "bug" in sentence or "Traceback" in sentence or len(sentence) > LONGEST or "\n" in sentence:
        raise Failure(sentence[:LONGEST])


Feed = Callable[[random.Random, Path], None]
"""Makes one mutant and gives it to what reads it."""


def scene() -> Feed:
    """Scene files and the arrays beside them, traced at every level."""
    from viewcam_addon import image

    whole = packed(**arrays())
    other = packed(v=np.zeros((1, 3)), t=np.zeros((1, 3), np.int32), n=np.array(["text"]), i=np.zeros(3, complex))

    def feed(chance: random.Random, folder: Path) -> None:
        document, beside = json.dumps(SCENE).encode(), whole
        if chance.random() < 0.7:
            document = mutants.of_json(SCENE, SCENE, chance)
        else:
            beside = mutants.of_zip(whole, other, chance)
        (folder / "scene.json").write_bytes(document)
        (folder / "scene.npz").write_bytes(beside)
        level = chance.choice(("geometry", "geometry", "direct", "path", "auto"))
        stated = ["--stated"] if chance.random() < 0.2 else []
        spent = ["--samples", chance.choice((1, 2)), "--threads", 1]
        viewcam("render", folder / "scene.json", folder / "out.exr", "--size", "8x6", "--level", level, *spent, *stated)
        if (folder / "out.exr").exists():
            passes = image.read(folder / "out.exr").passes
            passes.pop("Variance", None)  # infinite where one sample does not tell it
            for name, values in passes.items():
                if not np.isfinite(values).all():
                    raise Failure(f"{name} holds what is no finite number at level {level}")

    return feed


def exr() -> Feed:
    """Pictures of geometry and of light, on either side of a comparison."""
    import OpenEXR

    with tempfile.TemporaryDirectory() as temporary:
        scratch = Path(temporary)
        (scratch / "scene.json").write_text(json.dumps(SCENE))
        (scratch / "scene.npz").write_bytes(packed(**arrays()))
        pictures = {}
        for level, seed in (("geometry", 0), ("direct", 0), ("path", 1)):
            words = ["--size", "16x12", "--level", level, "--samples", "4", "--seed", seed]
            viewcam("render", scratch / "scene.json", scratch / "out.exr", *words)
            pictures[level] = (scratch / "out.exr").read_bytes()
        channels = OpenEXR.File(str(scratch / "out.exr"), separate_channels=True).channels()
        kinds = {"zip": OpenEXR.ZIP_COMPRESSION, "piz": OpenEXR.PIZ_COMPRESSION, "dwa": OpenEXR.DWAA_COMPRESSION}
        for name, compression in kinds.items():
            header = {"compression": compression, "type": OpenEXR.scanlineimage}
            pixels = {each: channel.pixels for each, channel in channels.items()}
            OpenEXR.File(header, pixels).write(str(scratch / "out.exr"))
            pictures[name] = (scratch / "out.exr").read_bytes()
        parts = [OpenEXR.Part({}, {each: pixels[each]}, each) for each in pixels]
        OpenEXR.File(parts).write(str(scratch / "out.exr"))
        pictures["parts"] = (scratch / "out.exr").read_bytes()
    beginning = 1200  # bytes, in which the header stands

    def feed(chance: random.Random, folder: Path) -> None:
        (folder / "scene.json").write_text(json.dumps(SCENE))
        (folder / "scene.npz").write_bytes(packed(**arrays()))
        name = chance.choice(list(pictures))
        whole = folder / "whole.exr"
        whole.write_bytes(pictures[name if name == "geometry" else chance.choice(("path", "direct"))])
        data = pictures[name]
        other = pictures[chance.choice(list(pictures))]
        if chance.random() < 0.3 and b"virtualPinhole" in data:
            data = _with_camera(data, chance)
        else:
            data = mutants.of_bytes(data, other, chance, beginning if chance.random() < 0.6 else None)
        (folder / "mutant.exr").write_bytes(data)
        sides = [folder / "mutant.exr", whole]
        if chance.random() < 0.5:
            sides.reverse()
        more: list[object] = ["--scene", folder / "scene.json"] if chance.random() < 0.3 else []
        if chance.random() < 0.2:
            more += ["--report", folder / "report", "--difference", folder / "difference.png"]
        if chance.random() < 0.2 and name != "geometry":
            sides.append(whole)
        viewcam("compare", *sides, *more, "--json", folder / "out.json", "--threads", 1)

    return feed


def _with_camera(data: bytes, chance: random.Random) -> bytes:
    """A picture whose camera is changed; what says how long it is, and where all that follows stands, stays true."""
    start = data.index(b"virtualPinhole\0string\0") + len(b"virtualPinhole\0string\0") + 4
    size = int.from_bytes(data[start - 4 : start], "little")
    text = mutants.of_json(json.loads(data[start : start + size]), SCENE, chance)
    return data[:start] + text.ljust(size)[:size] + data[start + size :]


SHOTS = {
    "defaults": {"engine": "CYCLES", "samples": 16, "up": [0, 0, 1]},
    "shots": [
        {"name": "a", "eye": [3, -6, 2.5], "look_at": [0, 0, 1], "d": 400, "width": 320, "height": 180, "frame": 3},
        {"name": "b", "camera": "Camera", "level": "path", "samples": 4, "engine": "VIEWCAM"},
        {"name": "c", "eye_x": 1, "eye_y": 2, "eye_z": 3, "look_at": [0, 0, 0], "up": [0, 1, 0], "distance": 50.5},
    ],
}
TABLE = b"""name,eye_x,eye_y,eye_z,look_at,up,d,width,height,frame,engine,samples,level
a,3,-6,2.5,"0,0,1","0,0,1",400,320,180,1,CYCLES,16,
b,3,-6.5,2.5,"0,0,1","0 0 1",40.5e1,320,180,2,VIEWCAM,16,path
"""


def shots() -> Feed:
    """Lists of shots, in every format."""
    from viewcam_addon.errors import InputError
    from viewcam_addon.jobs import lists
    from viewcam_addon.jobs.folder import settings_hash

    lines = b"".join(json.dumps(shot).encode() + b"\n" for shot in SHOTS["shots"])

    def feed(chance: random.Random, folder: Path) -> None:
        suffix = chance.choice((".csv", ".tsv", ".json", ".jsonl"))
        if suffix == ".json":
            data = mutants.of_json(chance.choice((SHOTS, SHOTS["shots"])), SHOTS, chance)
        else:
            data = mutants.of_text(TABLE if suffix in (".csv", ".tsv") else lines, TABLE + lines, chance)
        path = folder / f"shots{suffix}"
        path.write_bytes(data)
        try:
            for shot in lists.read(path, ["Camera"] if chance.random() < 0.5 else None):
                settings_hash(shot, {})
        except InputError as error:
            for sentence in getattr(error, "problems", [str(error)]):
                judge(sentence)

    return feed


def sidecar() -> Feed:
    """Sidecars in the folder of a batch that is continued, with its page, its summary and its dataset."""
    import painting

    from viewcam_addon.cameras.sidecar import record
    from viewcam_addon.errors import InputError, message_of
    from viewcam_addon.jobs import dataset, one, run
    from viewcam_addon.jobs.folder import Folder, Outputs, settings_hash
    from viewcam_addon.jobs.job import Job
    from viewcam_addon.pinhole import Pinhole

    class Painter(painting.Painter):
        def render(self, *arguments: object) -> dict:
            return {**super().render(*arguments), **record(Pinhole(**CAMERA))}

    wanted = [Job("one", camera="Camera"), Job("two", camera="Camera")]
    settings = {shot.name: settings_hash(shot, {}) for shot in wanted}
    result: dict[str, bytes] = {}

    def batch(folder: Path) -> Folder:
        place = Folder(folder)
        work = one.in_turn(place, Painter(), settings, Outputs(check=True))
        heard = painting.Listener()
        run.run(wanted, place, settings, work, heard, resume=True, outputs=Outputs(check=True))
        for _, fields in heard.heard:
            judge(str(fields.get("error", "")))
        return place

    def feed(chance: random.Random, folder: Path) -> None:
        if not result:
            result.update({path.name: path.read_bytes() for path in batch(folder / "whole").path.iterdir() if path.is_file()})
        changed = folder / "changed"
        changed.mkdir()
        for name, data in result.items():
            (changed / name).write_bytes(data)
        name = chance.choice(("one.json", "two.json", "summary.json"))
        document = json.loads(result[name])
        (changed / name).write_bytes(mutants.of_json(document, SCENE | document, chance))
        try:
            dataset.write(batch(changed), wanted, settings, "png")
        except InputError as error:
            judge(message_of(error))

    return feed


def labels() -> Feed:
    """A folder of two pictures' labels, of which one file is changed, as every dataset."""
    kinds = "depth,normals,position,masks,amodal,flow"
    with tempfile.TemporaryDirectory() as temporary:
        scratch = Path(temporary)
        (scratch / "scene.json").write_text(json.dumps(SCENE))
        (scratch / "scene.npz").write_bytes(packed(**arrays()))
        for name in ("a", "b"):
            words = ["--size", "16x12", "--labels", kinds, "--next", scratch / "scene.json", "--threads", 1]
            viewcam("render", scratch / "scene.json", scratch / f"{name}.exr", *words)
        whole = {path.name: path.read_bytes() for path in scratch.iterdir() if path.name.startswith(("a.", "b."))}
    whole["b.png"] = whole["b.instances.png"]  # a picture that stands beside its labels
    documents = [json.loads(whole[f"{name}.labels.json"]) for name in ("a", "b")]
    ways = (
        ("coco",),
        ("coco", "--amodal"),
        ("panoptic",),
        ("bop",),
        ("colmap",),
        ("colmap", "--points", 5),
        ("kitti",),
        ("middlebury", "--pair", "a", "b"),
        ("tracks",),
        ("yolo",),
    )

    def feed(chance: random.Random, folder: Path) -> None:
        shots = folder / "shots"
        shots.mkdir()
        for name, data in whole.items():
            (shots / name).write_bytes(data)
        changed = chance.choice((*["a.labels.json"] * 5, "a.labels.exr", "a.labels.exr", "b.png"))
        if changed == "a.labels.json":
            data = mutants.of_json(*documents, chance)
        else:
            data = mutants.of_bytes(whole[changed], whole["b.labels.exr"], chance, chance.choice((1200, None)))
        (shots / changed).write_bytes(data)
        way = chance.choice(ways)
        viewcam("labels", shots, folder / "out", "--to", *way)
        if way[0] in ("coco", "panoptic") and (folder / "out").exists():
            json.loads((folder / "out").read_text("utf-8"), parse_constant=partial(_is_no_json, way[0]))

    return feed


def _is_no_json(kind: str, constant: str) -> None:
    raise Failure(f"{kind} holds {constant}, which is no JSON")


def cameras_of(name: str) -> Feed:
    """A file of cameras, read with whatever may be chosen, and written again in some format."""
    import camera_files

    from viewcam_addon import cameras
    from viewcam_addon.cameras import Camera, Options
    from viewcam_addon.errors import InputError
    from viewcam_addon.intrinsics import ViewPlane

    content = {file: text if isinstance(text, bytes) else text.encode() for file, text in camera_files.files()[name].items()}
    others = [text for file, text in content.items() if file != "."]
    plane = ViewPlane((600, 600), (320, 180), 640, 360)
    choices = [
        Options(),
        Options(size=(640, 360)),
        Options(size=(640, 360), base=camera_files.SHIFTED, size_fits=True, without_distortion=True),
        Options(view_plane=plane, axes="y_up", scale=0.01, pixel="corner", unmirrored=True, original_world=True),
    ]

    def feed(chance: random.Random, folder: Path) -> None:
        changed = chance.choice([file for file in content if file != "."])
        for file, data in content.items():
            if file != ".":
                (folder / file).parent.mkdir(parents=True, exist_ok=True)
                (folder / file).write_bytes(_mutant(data, chance.choice(others), chance) if file == changed else data)
        path = folder if "." in content else folder / next(iter(content))
        options = chance.choice(choices)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                cameras_read = cameras.read(path, options=options)
        except InputError as error:
            _judge_caused(error)
            return
        for camera in cameras_read:
            for line in (camera.name, *camera.notes):
                if len(line) > LONGEST or not all(map(str.isprintable, line.split(" "))):
                    raise Failure(f"a name or note is no line of a few characters that show: {line[:200]!r}")
            if camera.lens is not None:
                camera.lens.folds(camera.lens.undistort(CORNERS))
        try:
            cameras.write(
                [Camera(f"{i}", each.pinhole) for i, each in enumerate(cameras_read[:3])], chance.choice(cameras.writable())
            )
        except InputError as error:
            _judge_caused(error)

    return feed


def cameras_of_all() -> Feed:
    """One mutant of each format after another, but for those that take their time in a process of their own."""
    names = [name for name in CAMERAS if f"cameras-{name}" not in IN_A_PROCESS]
    feeds = [cameras_of(name) for name in names]

    def feed(chance: random.Random, folder: Path) -> None:
        feeds[int(folder.name.rpartition("-")[2]) % len(feeds)](chance, folder)

    return feed


def _mutant(data: bytes, other: bytes, chance: random.Random) -> bytes:
    if data[:2] == b"PK":
        return mutants.of_zip(data, other, chance)
    if data[:1] in b"{[":
        with contextlib.suppress(ValueError):
            return mutants.of_json(json.loads(data), json.loads(data), chance)
    if b"\0" in data:
        return mutants.of_bytes(data, other, chance)
    return mutants.of_text(data, other, chance)


def _judge_caused(error: Exception) -> None:
    """Raise Failure if a sentence is none, or stands for what no reader thought of."""
    judge(str(error))
    if error.__cause__ is not None:
        place = traceback.extract_tb(error.__cause__.__traceback__)[-1]
        raise Failure(f"{type(error.__cause__).__name__} at {Path(place.filename).name}:{place.lineno}: {error.__cause__}")


def broken(kind: str) -> Feed:
    """No reader, but what one may do: the third mutant makes it."""

    def feed(chance: random.Random, folder: Path) -> None:
        if not folder.name.endswith("-2"):
            return
        if kind == "bug":
            raise Failure("a bug")
        if kind == "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        if kind == "hang":
            signal.setitimer(signal.ITIMER_REAL, 0.1)  # for 20 s
            signal.sigwait([signal.SIGUSR1])
        if kind == "greedy":
            np.ones(MEMORY // 8)

    return feed


def blend() -> Feed:
    """Blender's own files, exported in this process: a crash ends it, and `command` says what a user is told of it."""
    import bpy

    samples = []
    with tempfile.TemporaryDirectory() as temporary:
        for name in ("spheres", "wide"):
            path = Path(temporary, f"{name}.blend")
            bpy.ops.wm.open_mainfile(filepath=str(TESTS.parent / "sample_scenes" / path.name))
            bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
            samples.append(path.read_bytes())

    def feed(chance: random.Random, folder: Path) -> None:
        data, other = chance.sample(samples, 2)
        (folder / "mutant.blend").write_bytes(mutants.of_bytes(data, other, chance))
        viewcam("export", folder / "mutant.blend", folder / "scene.json")

    return feed


SMALL = ("--size", "16x9", "--samples", "1")
COMMANDS = (
    ("export", "mutant.blend", "scene.json"),
    ("cycles", "mutant.blend", "out.exr", *SMALL),
    ("check", "mutant.blend", *SMALL),
    ("batch", "mutant.blend", "--orbit", "1", "--out", "out", *SMALL),
)


def command(folder: Path) -> None:
    """Give a mutant to every command as a user does, and raise Failure unless all is well or told in a sentence."""
    options = {"cwd": folder, "env": os.environ | {"PYTHONPATH": str(TESTS.parent)}, "timeout": 120}
    for words in COMMANDS:
        program = [sys.executable, "-m", "viewcam_addon", *words]
        ran = subprocess.run(program, capture_output=True, text=True, errors="replace", check=False, **options)
        if ran.returncode < 0 or (ran.returncode > 1) != bool(ran.stderr.strip()) or "Traceback" in ran.stdout:
            raise Failure(f"viewcam {words[0]} ended with status {ran.returncode}: {ran.stderr[-LONGEST:]!r}")
        judge(ran.stderr.strip())


KINDS = {"scene": scene, "exr": exr, "shots": shots, "sidecar": sidecar, "labels": labels, "blend": blend}
IN_A_PROCESS = ("cameras-usd", "cameras-usdc", "cameras-usdz")
CAMERAS = (
    *("transforms", "transforms_applied", "colmap", "colmap_binary", "bop", "gltf", "glb", "usd", "usdc", "usdz", "sidecar"),
    *("fspy", "metashape", "metashape_bent", "realitycapture", "meshroom", "openmvg", "bundler", "llff", "polycam", "scanner"),
    *("record3d", "gaussian_splatting", "ros", "ros_window", "opencv", "opencv_json", "opencv_xml", "opencv_npz", "kalibr"),
    *("tum", "kitti", "euroc", "chan", "three_js", "mitsuba", "mitsuba_dictionary", "pov_ray", "pbrt", "matrices", "look_at"),
    *("vtk", "textbook", "looks", "looks_gl", "looks_vtk", "text", "text_of_people", "colmap_lenses", "opencv_fisheye"),
    *("transforms_lenses", "nerfstudio_path", "open3d", "opensfm"),
    *("instant_ngp", "kubric", "nvisii", "infinigen", "fspy_exported"),
    *("supersplat", "supersplat_project", "earth_studio", "after_effects"),
    *("realitycapture_table", "visualsfm", "mvsnet", "middlebury", "middlebury_pair", "neus", "kitti_calibration", "pmvs"),
    *("bop_sensor", "pose_files", "redwood", "replica", "blender_python"),
    *("realestate10k", "basalt", "azure_kinect", "nuscenes", "gazebo", "nerfies"),
)
"""The kinds of camera_files.py, which makes them only when it is asked."""

KINDS |= {f"cameras-{name}": partial(cameras_of, name) for name in CAMERAS} | {"cameras-all": cameras_of_all}
KINDS |= {kind: partial(broken, kind) for kind in ("bug", "crash", "hang", "greedy")}


def tell(stream: int, number: int, message: str) -> None:
    os.write(stream, json.dumps({"mutant": number, "said": message[:LONGEST]}).encode() + b"\n")


def main(kind: str, first: str, count: str, place: str) -> None:
    import resource

    is_small = kind.startswith(("cameras-", "labels", "scene"))
    descriptor = os.dup(1)  # Blender prints past Python
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    folder = Path(place)
    feed = KINDS[kind]()
    most = MEMORY
    if is_small and kind not in IN_A_PROCESS:  # whose own bounds it is that are tried
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        most = pages * resource.getpagesize() + SMALL_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    for number in range(int(first), int(first) + int(count)):
        (folder / "current").write_text(str(number))
        work = folder / f"{kind}-{number}"
        work.mkdir()
        spent = _spent()
        signal.setitimer(signal.ITIMER_REAL, SECONDS)
        try:
            feed(random.Random(f"{kind} {number}"), work)
            if is_small and _spent() - spent > SMALL_SECONDS:
                raise Failure(f"took {_spent() - spent:.1f} s")
        except Failure as error:
            tell(descriptor, number, str(error))
        except Exception as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            tell(descriptor, number, f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}")
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
        if len(sys.argv) < 6:
            shutil.rmtree(work, ignore_errors=True)
    (folder / "current").write_text("done")
    os._exit(0)  # bpy may crash as Python takes it apart


def _spent() -> float:
    """Seconds of computing, of this process and of those that it has started and ended."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


if __name__ == "__main__":
    main(*sys.argv[1:5])
