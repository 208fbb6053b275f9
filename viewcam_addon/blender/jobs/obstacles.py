"""The obstacles to rendering a shot, known before anything is: of a batch of a thousand, the last one counts as well."""

import itertools
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence

import bpy

from ... import checks, html_page, intrinsics
from ...errors import InputError
from ...jobs import tracing
from ...jobs.folder import Outputs
from ...jobs.job import Job
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import datablocks, versions
from ..rendering import rasters
from .job_settings import JobSettings, engine_name

_DRAWN = (versions.EEVEE, "BLENDER_WORKBENCH")


def obstacles(
    shots: Sequence[Job], outputs: Outputs, scene: bpy.types.Scene, own: Callable[[], bpy.types.Object], settings: JobSettings
) -> Iterator[str]:
    """One sentence for each obstacle.

    outputs : the files that are wanted of each shot.
    own : a function that gives the camera for the four values.
    """
    if not any(layer.use for layer in scene.view_layers):
        yield f"scene {scene.name!r} renders nothing: all of its view layers are off, let one render"
    engines = sorted({settings.engine_of(shot) for shot in shots}) if outputs.picture else []
    if ("CYCLES" in engines or outputs.check) and not hasattr(scene, "cycles"):
        yield "Cycles is disabled: enable the add-on Cycles Render Engine in Blender's preferences"
    for engine in engines:
        if engine in _DRAWN and not rasters.can_draw():
            needs = f"{engine_name(engine)} draws with a GPU, and Blender can't open one here"
            yield f"{needs}: choose CYCLES or VIEWCAM, or start a display"
    needs_tracer = outputs.check or outputs.labels or any(shot.calibration for shot in shots)
    for lacking in (html_page.lacking(), tracing.lacking() if needs_tracer else None):
        if lacking:
            yield lacking
    among = cameras_of(scene, own() if any(shot.eye is not None for shot in shots) else None)
    read: set[str] = set()
    for shot in shots:
        try:
            if shot.eye is None:
                camera_object = camera_of(shot, scene, among, settings)
                if shot.frame is None and camera_object.name not in read:  # at other frames it may be another
                    cameras.read(camera_object, scene)
                    read.add(camera_object.name)
            else:
                frame, camera = settings.frame_of(shot), own().data
                plane = stated(shot, frame).plane  # Blender's numbers may hold no such
                intrinsics.camera_data(plane, frame, *datablocks.own_sensor(camera), camera.sensor_fit)
        except InputError as error:
            yield f"the shot {checks.quoted(shot.name)}: {error}"


def cameras_of(scene: bpy.types.Scene, own: bpy.types.Object | None) -> dict[str, bpy.types.Object]:
    """The scene's cameras but for the batch's own, by name, sorted. Where libraries have cameras of one name, it is theirs
    with the library's."""
    cameras = [each for each in scene.objects if each.type == "CAMERA" and each != own]
    times = Counter(each.name for each in cameras)
    return dict(sorted((each.name if times[each.name] == 1 else each.name_full, each) for each in cameras))


def camera_of(
    shot: Job, scene: bpy.types.Scene, among: Mapping[str, bpy.types.Object], settings: JobSettings
) -> bpy.types.Object:
    """The camera of the file that takes a shot without the four values. among : cameras_of(scene).

    The scene's own may be in another scene, and Blender renders through it all the same.

    Raises InputError if none is called so, if the scene has none of its own, or if it is no perspective camera.
    """
    camera_object = settings.scene_camera(shot.frame) if shot.camera is None else among.get(shot.camera)
    if camera_object is None or camera_object.type != "CAMERA":
        if not among:
            raise InputError(f"scene {scene.name!r} has no camera: add one, or give another file")
        name = shot.camera or (camera_object and camera_object.name)
        lacking = "no camera of its own" if name is None else f"no camera {name!r}"
        raise InputError(f"scene {scene.name!r} has {lacking}: choose from {', '.join(itertools.islice(among, 8))}")
    datablocks.check_perspective(camera_object)
    return camera_object


def stated(shot: Job, frame: intrinsics.Frame) -> Pinhole:
    """The pinhole that a shot's values ask for in the picture of `frame`."""
    assert shot.eye and shot.look_at and shot.up and shot.d  # as Job has checked
    distance = (shot.d, shot.d * (frame.pixel_aspect_x / frame.pixel_aspect_y))
    whole = Pinhole(shot.eye, shot.look_at, shot.up, distance, *frame.size, shot.principal_point, bool(shot.mirrored))
    return whole.cropped(*frame.window) if frame.crop else whole
