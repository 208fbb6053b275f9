"""From Blender's ways of placing a camera to the values': keyframes of its own channels, and a Track To.

*Convert Keyframes to Values* is the way back from Bake (baking.py): the camera is read at every frame, its values become
linear keyframes there, and its own go. Points are keyed in float32, so the look-at point is put far enough away that its
rounding turns the camera by no more than the camera's own: at half of the eye's largest coordinate, at the least. Where the
preferred up gives the picture at every frame, and is not close to the view, up is stated once; else it is keyed, as v.
The lens is keyed in millimeters, which gives back each bit of it, unless the sensor is keyed as well.
"""

from collections.abc import Iterator

import bpy
import numpy as np

from ...errors import InputError, counted
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import causes, datablocks, findings, pose, preferences, storage, targets, versions
from . import baking
from .operators import CameraOperator

_LEAST_SINE = 0.1  # the angle between view and up: below, the look-at point's rounding rolls the picture visibly


def convert_keyframes(camera_object: bpy.types.Object, scene: bpy.types.Scene, first: int, last: int) -> str:
    """Key the values that make the camera at each frame from `first` to `last`, and delete its own keyframes.

    Where motion blur is on, a frame before and one behind are keyed too. The scene is at its frame again afterwards.
    Returns one sentence: what was done, and by how much the camera differs from what it was.

    Raises InputError if the camera has no keyframes of its own, if something else than these has a say, or if it is no pinhole
    at some frame. Nothing has changed then.
    """
    keyed = _check_keyed(camera_object)
    if last < first:
        raise InputError(f"the last frame {last} is before the first frame {first}: give the range in its order")
    margin = 1 if scene.render.use_motion_blur else 0
    frames = range(first - margin, last + margin + 1)
    before = scene.frame_current, scene.frame_subframe
    try:
        seen = [_seen_at(camera_object, scene, frame) for frame in frames]
        for block, path in keyed:
            versions.remove_curves(block, path)
        _key(camera_object, scene, seen, is_sensor_keyed=any(path.startswith("sensor") for _, path in keyed))
        off = [
            frame for frame, state in zip(frames, seen, strict=True) if _differs_at(camera_object, scene, frame, state.pinhole)
        ]
    finally:
        scene.frame_set(before[0], subframe=before[1])
    what = f"the camera differs at {len(off)} of them, first at {off[0]}" if off else "the camera stands the same at each"
    return f"{camera_object.name} has its values' keyframes at {counted(len(frames), 'frame')}: {what}"


class _Seen:
    """A camera at a frame.

    at : its place on the curves.
    distance : in pixels at 100 %.
    lens : mm.
    """

    def __init__(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        self.pinhole = cameras.read(camera_object, scene)
        self.at = scene.frame_current_final
        frame = datablocks.frame_of(scene)
        self.distance = self.pinhole.distance[0] * (frame.resolution_x / frame.size[0])
        self.lens = camera_object.evaluated_get(datablocks.depsgraph_of(scene)).data.lens


def _seen_at(camera_object: bpy.types.Object, scene: bpy.types.Scene, frame: int) -> _Seen:
    scene.frame_set(frame)
    try:
        return _Seen(camera_object, scene)
    except InputError as error:
        raise InputError(f"frame {frame}: {error}") from error


def _differs_at(camera_object: bpy.types.Object, scene: bpy.types.Scene, frame: int, wanted: Pinhole) -> bool:
    scene.frame_set(frame)
    depsgraph = datablocks.depsgraph_of(scene)
    reach = pose.reach(camera_object, depsgraph) + float(np.abs(wanted.eye).max())
    return bool(findings.differences(wanted, cameras.read(camera_object, scene), reach))


def _key(camera_object: bpy.types.Object, scene: bpy.types.Scene, seen: list[_Seen], is_sensor_keyed: bool) -> None:
    """State the values of the first frame, and key what changes."""
    eyes = np.array([each.pinhole.eye for each in seen])
    axes = np.array([each.pinhole.basis() for each in seen])
    v, w = axes[:, 1], axes[:, 2]
    values = targets.values(camera_object)
    reach = float(np.linalg.norm(np.subtract(values.eye, values.look_at))) if storage.is_enabled(camera_object) else 10.0
    reach = max(reach, np.abs(eyes).max() / 2)
    look_at = eyes - reach * w
    up = np.array(preferences.up_axis())
    level = [Pinhole(tuple(e), tuple(l), tuple(up), 1.0, 1, 1) for e, l in zip(eyes.tolist(), look_at.tolist(), strict=True)]
    is_level = all(
        each.sine_to_up > _LEAST_SINE and np.abs(each.basis()[1] - wanted).max() <= findings.LARGEST_TURN
        for each, wanted in zip(level, v, strict=True)
    )
    first = seen[0]
    sync, frame = cameras.CameraSync.of(camera_object), datablocks.frame_of(scene)
    up_now = tuple(up.tolist() if is_level else v[0].tolist())
    storage.begin(camera_object)
    sync.state(tuple(eyes[0].tolist()), tuple(look_at[0].tolist()), up_now, first.distance, frame)
    columns = {"eye": eyes, "look_at": look_at}
    if not is_level:
        columns["up"] = v
    if any(each.distance != first.distance for each in seen):
        if is_sensor_keyed:
            stated = storage.load(camera_object)
            columns["distance"] = np.array([[each.distance / first.distance * stated.distance] for each in seen])
        else:
            columns["focal_length"] = np.array([[each.lens] for each in seen])
    at = [each.at for each in seen]
    for name, numbers in columns.items():
        versions.linear_keyframes(camera_object, f"virtual_pinhole.{name}", at, numbers)


def _check_keyed(camera_object: bpy.types.Object) -> list[tuple[bpy.types.ID, str]]:
    """The camera's own keyframes; refuse where values that are keyed in their place would not make the same camera."""
    datablocks.check_perspective(camera_object)
    name = camera_object.name
    keyed = causes.keyed(camera_object, versions.action_curves)
    if not keyed:
        raise InputError(f"camera {name!r} has no keyframes of its own in its action: there is nothing to convert")
    if decided := datablocks.animated_values(camera_object):
        words = ", ".join(sorted(decided)).replace("_", "-")
        raise InputError(f"the values of camera {name!r} are animated themselves ({words}): delete one or the other")
    for block in {block for block, _ in keyed}:
        baking.check_editable(block)
        baking.check_own_action(block)
    for constraint in pose.active_constraints(camera_object):
        if not pose.carries(constraint):
            raise InputError(f"the constraint {constraint.name!r} of camera {name!r} would win over the values: apply it first")
    for block in (camera_object, camera_object.data):
        for curve in versions.drivers(block):
            if not curve.data_path.startswith("virtual_pinhole.") and not versions.is_muted(curve):
                path = curve.data_path
                raise InputError(f"a driver sets {path!r} of {block.name!r}, and would win over the values: remove it")
    return keyed


def track_to_of(camera_object: bpy.types.Object) -> bpy.types.Constraint | None:
    """The Track To that turns a camera, the last of several."""
    constraints = [each for each in pose.active_constraints(camera_object) if each.type == "TRACK_TO" and each.target]
    return constraints[-1] if constraints else None


def convert_track_to(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Let the values look at what a Track To looks at, and remove it. What else places the camera stays.

    Raises InputError if there is none, or if it turns the camera otherwise than a look-at point and an upright picture. Nothing
    has changed.
    """
    track = track_to_of(camera_object)
    if track is None:
        raise InputError(f"no Track To turns camera {camera_object.name!r}: there is nothing to convert")
    baking.check_editable(camera_object)
    for obstacle in _obstacles(track):
        raise InputError(f"the constraint {track.name!r} of camera {camera_object.name!r} {obstacle}")
    if not targets.can_be_target(camera_object, track.target):
        raise InputError(f"{track.target.name!r} is moved by camera {camera_object.name!r} itself: choose another target")
    group, target, part = camera_object.virtual_pinhole, track.target, track.subtarget
    cameras.adopt(camera_object, scene)
    with storage.without_callbacks():
        group.up = (0.0, 0.0, 1.0)
        group.look_at_bone = part if target.type == "ARMATURE" else ""
        group.look_at_group = part if target.type == "MESH" else ""
    group.look_at_target = target  # while the constraint still holds the camera there
    camera_object.constraints.remove(track)
    cameras.CameraSync.of(camera_object).edited(scene)


def _obstacles(track: bpy.types.Constraint) -> Iterator[str]:
    if (track.track_axis, track.up_axis) != ("TRACK_NEGATIVE_Z", "UP_Y"):
        yield "does not turn the camera's view to its target: set it to -Z, with Y up"
    if track.influence < 1:
        yield f"turns it by {100 * track.influence:g} % alone: set its influence to 1"
    if track.use_target_z:
        yield "takes up from its target: turn Target Z off"
    if (track.owner_space, track.target_space) != ("WORLD", "WORLD"):
        yield "does not work in world space: set both of its spaces to World"
    if track.subtarget and track.target.type == "ARMATURE" and track.head_tail != 0:
        yield "looks along a bone: set Head/Tail to 0, the bone's head"


class VIEWCAM_OT_convert_keyframes(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.convert_keyframes"
    bl_label = "Convert Keyframes to Values"
    bl_description = (
        "Key eye, look-at and lens at every frame in the place of the camera's own keyframes of location, rotation and focal "
        "length, which are deleted. The camera flies as before. Bake to Keyframes is the way back"
    )

    frame_start: bpy.props.IntProperty(name="Start Frame", description="At first that of scene and keyframes")
    frame_end: bpy.props.IntProperty(name="End Frame", description="At first that of scene and keyframes")

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask, since keyframes are deleted."""
        camera_object = self.target_camera(context)
        if camera_object is None:
            return self.execute(context)
        self._complete(camera_object, context.scene)
        return context.window_manager.invoke_props_dialog(self, width=400)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        if camera_object := self.target_camera(context):
            paths = ", ".join(dict.fromkeys(path for _, path in causes.keyed(camera_object, versions.action_curves)))
            layout.label(text=f"Keyframes that are deleted: {paths}", icon="ERROR", translate=False)
        layout.use_property_split = True
        for name in ("frame_start", "frame_end"):
            layout.prop(self, name)

    def _complete(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        """The scene's range, and all keyframes beyond it."""
        curves = [curve for block in (camera_object, camera_object.data) for curve in versions.action_curves(block)]
        ranges = [(scene.frame_start, scene.frame_end), *(tuple(curve.range()) for curve in curves)]
        if not self.properties.is_property_set("frame_start"):
            self.frame_start = int(np.floor(min(start for start, _ in ranges)))
        if not self.properties.is_property_set("frame_end"):
            self.frame_end = int(np.ceil(max(end for _, end in ranges)))

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        self._complete(camera_object, scene)
        self.report({"INFO"}, convert_keyframes(camera_object, scene, self.frame_start, self.frame_end))


class VIEWCAM_OT_convert_track_to(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.convert_track_to"
    bl_label = "Convert to a Look-At Target"
    bl_description = (
        "Look at the object of the camera's Track To by the values, and remove the constraint. A path, a parent or keyframes "
        "go on to place the eye"
    )

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        convert_track_to(camera_object, scene)


def draw(layout: bpy.types.UILayout, camera_object: bpy.types.Object) -> None:
    """The buttons, in the panel, where there is anything to convert."""
    if camera_object.library:
        return
    if track_to_of(camera_object):
        layout.operator("viewcam.convert_track_to", icon="CON_TRACKTO").camera = camera_object.name
    if causes.keyed(camera_object, versions.action_curves) and not datablocks.animated_values(camera_object):
        layout.operator("viewcam.convert_keyframes", icon="KEYTYPE_KEYFRAME_VEC").camera = camera_object.name


CLASSES = (VIEWCAM_OT_convert_keyframes, VIEWCAM_OT_convert_track_to)
