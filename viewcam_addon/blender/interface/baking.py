"""Bake: the flight of a Virtual Pinhole as plain keyframes, so that the file renders the same without this add-on.

At each whole frame, or several times a frame, the camera is placed by its values as it is live, and the channels that place it
become linear keyframes: location, rotation, lens. Each rotation continues the one before (rotation.py), so that what Blender
puts between two keyframes goes the short way. Then Blender plays them, and the camera is compared with the live one as it stood
at each keyframe, and midway between two, where a straight line is furthest from a curve. The report says how many pixels.

The sensor has one size for the whole range, the largest that any frame needs for a lens of 1 mm (intrinsics.py), unless the
artist animates it. Scale and shift stay as they are, for the values never change them; so do constraints and parents, which act
on the keyframes as they do on what is set live.

Rejected: `nla.bake` (the pose from the evaluated matrix in float32, Euler flips, no lens), Bézier keyframes (they overshoot
where a flight has corners), a copy of the scene to bake in (drivers and physics that name the scene would see another one).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...comparison.cameras import conversion_error
from ...errors import InputError
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import causes, conversion, datablocks, pose, versions
from .operators import CameraOperator

Array = NDArray[np.float64]

_SENSOR = ("sensor_width", "sensor_height")
_OF_DATA = ("lens", *_SENSOR)
_OF_OBJECT = ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle")
# The live camera and the baked one are each off by float32's rounding (ConversionError.tolerance).
_SHARE_OF_ROUNDING = 2.0


@dataclass
class _Flight:
    """The flight of a camera.

    live : the camera at every time, and the distance of its look-at point.
    at, keys, growth : each keyframe's place on the curves, numbers of each channel, and growth of the sensor.
    """

    camera_object: bpy.types.Object
    live: list[tuple[Pinhole, float]] = field(default_factory=list)
    at: list[float] = field(default_factory=list)
    keys: dict[str, list[tuple[float, ...]]] = field(default_factory=dict)
    growth: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class BakedAgreement:
    """A baked camera against the live one.

    at_keys, between : the largest displacement over corners, edges and center of the picture, at the look-at point's distance,
        in pixels: at the keyframes, and midway between two, at `frame` (nan for a single keyframe).
    ok : true if the keyframes are off by no more than the rounding of both cameras.
    """

    camera: str
    at_keys: float
    between: float
    frame: float
    ok: bool

    def sentence(self) -> str:
        """Both figures, for the report."""
        between = "" if math.isnan(self.frame) else f", and {self.between:.2g} px between them (at frame {self.frame:g})"
        return f"Baked {self.camera}: at most {self.at_keys:.2g} px off the live camera at the keyframes{between}"


def bake(
    camera_objects: Sequence[bpy.types.Object], scene: bpy.types.Scene, first: int, last: int, keys_per_frame: int = 1
) -> list[BakedAgreement]:
    """Give cameras keyframes from the frame `first` to the frame `last`, and turn their Virtual Pinholes off.

    Where motion blur is on, a frame before and one behind are keyed too, for the shutter looks there.
    The scene is at its frame again afterwards. As with Blender's own Bake Action, animated values that were edited and not
    keyed are as the animation has them then.

    Raises InputError if a camera can't be baked, or its values make no camera somewhere in the range. Nothing has changed then.
    """
    if last < first:
        raise InputError(f"the last frame {last} is before the first frame {first}: give the range in its order")
    for camera_object in camera_objects:
        _check(camera_object)
    margin = 1 if scene.render.use_motion_blur else 0
    steps = 2 * keys_per_frame  # every other time is a keyframe's
    times = [first - margin + i / steps for i in range(steps * (last - first + 2 * margin) + 1)]
    flights = [_Flight(camera_object) for camera_object in camera_objects]
    progress = bpy.context.window_manager
    before = scene.frame_current, scene.frame_subframe
    progress.progress_begin(0, 2 * len(times))
    try:
        for i, time in enumerate(times):
            _go_to(scene, time)
            for flight in flights:
                _look(flight, scene, is_key=i % 2 == 0)
            progress.progress_update(i)
        for flight in flights:
            _write(flight)
        baked = []
        for i, time in enumerate(times):
            _go_to(scene, time)
            baked.append([cameras.read(flight.camera_object, scene) for flight in flights])
            progress.progress_update(len(times) + i)
    finally:
        progress.progress_end()
        scene.frame_set(before[0], subframe=before[1])
    return [_agreement(flight, stood, times) for flight, stood in zip(flights, zip(*baked, strict=True), strict=True)]


def _go_to(scene: bpy.types.Scene, time: float) -> None:
    whole = math.floor(time)
    scene.frame_set(whole, subframe=time - whole)


def _look(flight: _Flight, scene: bpy.types.Scene, is_key: bool) -> None:
    """Note the live camera and, for a keyframe, the channels that place it."""
    camera_object, camera = flight.camera_object, flight.camera_object.data
    depsgraph = datablocks.depsgraph_of(scene)
    try:
        stated: Any = cameras.stated(camera_object.evaluated_get(depsgraph), scene)  # it is in use
        flight.live.append((cameras.read(camera_object, scene), math.dist(stated.eye, stated.look_at)))
        if not is_key:
            return
        conversion.place(camera_object, stated, scene, depsgraph)
        rotation = pose.rotation_channel(camera_object)
        if flight.at:
            parent = pose.parent_matrix(camera_object, depsgraph)
            _, turn, _ = pose.channels_of(camera_object).bringing_to(stated, parent)
            pose.set_rotation(camera_object, turn, flight.keys[rotation][-1])
    except InputError as error:
        raise InputError(f"frame {scene.frame_current + scene.frame_subframe:g}: {error}") from error
    flight.at.append(scene.frame_current_final)  # where the scene's time is stretched, that of the curves
    flight.growth.append(camera.sensor_width / datablocks.own_sensor(camera)[0])
    for path in ("location", rotation, *_OF_DATA):
        numbers = np.atleast_1d(getattr(_owner(camera_object, path), path))
        flight.keys.setdefault(path, []).append(tuple(numbers.tolist()))


def _owner(camera_object: bpy.types.Object, path: str) -> bpy.types.ID:
    return camera_object.data if path in _OF_DATA else camera_object


def _write(flight: _Flight) -> None:
    """Turn the Virtual Pinhole off and put the keyframes in the place of the curves that were there."""
    camera_object = flight.camera_object
    camera_object.virtual_pinhole.enabled = False
    channels = {path: np.array(numbers) for path, numbers in flight.keys.items()}
    # A sensor that grew and shrank would change its size within a frame: as large as it gets all the time, and the lens too.
    largest = max(flight.growth)
    for path in _OF_DATA:
        channels[path] *= (largest / np.array(flight.growth))[:, None]
    own = [channels[path][0, 0] / largest for path in _SENSOR]
    camera_object.data.virtual_pinhole_sensor = own if largest > 1 else (0.0, 0.0)
    for path, values in channels.items():
        block = _owner(camera_object, path)
        if path in _SENSOR and (values == values[0]).all():
            versions.remove_curves(block, path)
            setattr(block, path, values[0, 0])
            continue
        versions.linear_keyframes(block, path, flight.at, values)


def _agreement(flight: _Flight, baked: Sequence[Pinhole], times: list[float]) -> BakedAgreement:
    errors = [conversion_error(live, keyed, np.array([reach])) for (live, reach), keyed in zip(flight.live, baked, strict=True)]
    off = np.array([error.largest for error in errors])
    ok = all(error.share <= _SHARE_OF_ROUNDING for error in errors[::2])
    if len(off) == 1:
        return BakedAgreement(flight.camera_object.name, off[0], 0.0, math.nan, ok)
    worst = 1 + 2 * int(np.argmax(off[1::2]))
    return BakedAgreement(flight.camera_object.name, off[::2].max(), off[worst], times[worst], ok)


def _check(camera_object: bpy.types.Object) -> None:
    """Refuse, with one sentence, where keyframes would not make the live camera."""
    datablocks.check_perspective(camera_object)
    name, camera = camera_object.name, camera_object.data
    if not camera_object.virtual_pinhole.enabled:
        raise InputError(f"the Virtual Pinhole of camera {name!r} is not enabled, and the camera is plain Blender: enable it")
    if not datablocks.is_animated(camera_object):
        raise InputError(
            f"the values of camera {name!r} are not animated, and its pose and lens are plain Blender already: "
            "animate them, or leave it as it is"
        )
    for block in (camera_object, camera):
        check_editable(block)
    sharers = [other.name for other in bpy.data.objects if other.data == camera and other != camera_object]
    if sharers:
        raise InputError(
            f"the camera data {camera.name!r} is shared with {_names(sharers)}, which keyframes of the lens would zoom too: "
            "make it single-user"
        )
    for block in (camera_object, camera):
        _check_animation(block)
        check_own_action(block)


def check_editable(block: bpy.types.ID) -> None:
    """Raise InputError if a datablock, or its action, is linked."""
    action = block.animation_data.action if block.animation_data else None
    for each in filter(None, (block, action)):
        if each.library:
            raise InputError(f"{each.name!r} is linked from {each.library.name!r}: make a local copy, or a library override")


def _check_animation(block: bpy.types.ID) -> None:
    for curve in versions.drivers(block):
        if curve.data_path in (*_OF_OBJECT, *_OF_DATA):
            raise InputError(f"a driver sets {curve.data_path!r} of {block.name!r}, and would win over keyframes: remove it")
    if any(
        curve.data_path == "virtual_pinhole.enabled" for curve in (*versions.animation_curves(block), *versions.drivers(block))
    ):
        raise InputError(f"'enabled' of {block.name!r} is animated, and would turn it on again: delete its keyframes")
    if _is_mixed(block.animation_data):
        raise InputError(
            f"the NLA would mix the keyframes of {block.name!r} with its tracks: leave tweak mode and solo, and let the action "
            "replace what lies below it, at full influence"
        )


def check_own_action(block: bpy.types.ID) -> None:
    """Raise InputError if the action of a datablock moves others too."""
    kind = bpy.data.objects if isinstance(block, bpy.types.Object) else bpy.data.cameras
    sharers = [other.name for other in kind if other != block and versions.shares_animation(block, other)]
    if sharers:
        raise InputError(
            f"the action {block.animation_data.action.name!r} of {block.name!r} moves {_names(sharers)} too: "
            "make the action single-user"
        )


def _is_mixed(data: bpy.types.AnimData | None) -> bool:
    """True if NLA tracks have a say beside the action."""
    if not data or not data.use_nla or not data.nla_tracks:
        return False
    replaces = data.action_blend_type == "REPLACE" and data.action_influence == 1
    return not replaces or data.use_tweak_mode or any(track.is_solo for track in data.nla_tracks)


def _names(names: list[str]) -> str:
    return ", ".join(map(repr, sorted(names)))


class VIEWCAM_OT_bake_camera(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.bake_camera"
    bl_label = "Bake to Keyframes"
    bl_description = (
        "Give the camera plain keyframes of location, rotation and lens, so that the file renders the same without this "
        "add-on. The values and their animation are kept, but the Virtual Pinhole is turned off: turned on again it would set "
        "the camera anew at every frame"
    )

    frame_start: bpy.props.IntProperty(name="Start Frame", description="At first that of the scene", options={"SKIP_SAVE"})
    frame_end: bpy.props.IntProperty(name="End Frame", description="At first that of the scene", options={"SKIP_SAVE"})
    keys_per_frame: bpy.props.IntProperty(
        name="Keys per Frame",
        description="More than one follow a fast flight more closely between frames, where motion blur looks",
        default=1,
        min=1,
        soft_max=8,
    )
    selected: bpy.props.BoolProperty(
        name="All Selected Cameras", description="Bake every selected camera whose Virtual Pinhole is enabled", default=False
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        self._complete(context.scene)
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        for name in ("frame_start", "frame_end", "keys_per_frame", "selected"):
            layout.prop(self, name)

    def _complete(self, scene: bpy.types.Scene) -> None:
        for name in ("frame_start", "frame_end"):
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(scene, name))

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        self._complete(scene)
        chosen = {camera_object.name: camera_object}
        if self.selected:
            also = (item for item in bpy.context.selected_objects if item.type == "CAMERA" and item.virtual_pinhole.enabled)
            chosen |= {item.name: item for item in also if item.name in scene.objects}
        for flight in bake(list(chosen.values()), scene, self.frame_start, self.frame_end, self.keys_per_frame):
            self.report({"INFO"} if flight.ok else {"WARNING"}, flight.sentence())


class VIEWCAM_OT_delete_keyframes(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.delete_keyframes"
    bl_label = "Delete the Camera's Own Keyframes"
    bl_description = (
        "Delete the keyframes of location, rotation, scale, focal length and sensor, as Bake and auto keying write them, so "
        "that the four values alone say where the camera is. Keyframes of the values stay"
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask, since keyframes are deleted."""
        return context.window_manager.invoke_confirm(self, event)

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        curves = causes.keyed(camera_object, versions.action_curves)
        if not curves:
            raise InputError(
                f"no action of camera {camera_object.name!r} has keyframes of its own channels: look into its NLA tracks"
            )
        for block, _ in curves:
            check_editable(block)
            check_own_action(block)
        for block, path in curves:
            versions.remove_curves(block, path)
        if camera_object.virtual_pinhole.enabled:
            cameras.CameraSync.of(camera_object).edited(scene)


def draw(layout: bpy.types.UILayout, camera_object: bpy.types.Object) -> None:
    """The button, in the panel."""
    row = layout.row()
    row.enabled = camera_object.library is None
    row.operator("viewcam.bake_camera", icon="ACTION").camera = camera_object.name


CLASSES = (VIEWCAM_OT_bake_camera, VIEWCAM_OT_delete_keyframes)
