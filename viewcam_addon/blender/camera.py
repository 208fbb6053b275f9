"""Blender's camera from a Pinhole, and a Pinhole from Blender's camera.

`apply` states a Pinhole on a camera object and moves the camera there; `read` says which Pinhole the camera is as Cycles
renders it; `stated` says which Pinhole the four values of `object.virtual_pinhole` ask for, and `follow` moves the camera
there. findings.py compares `stated` with `read`.

**How the pose is set.** As location and rotation, in whatever rotation mode the artist has, computed in float64 relative to the
parent, with delta transforms taken off: within 1.6e-7 of a matrix entry, and without trouble in gimbal lock. Rejected:
`matrix_parent_inverse` (3e-8, but the location and rotation in the sidebar would say nothing, and the camera would not be where
its channels say), `matrix_world =` (4.9e-7; 2.5e-3 in gimbal lock; wrong by whole units under a non-uniformly scaled parent),
`to_track_quat` (an arbitrary roll near vertical) and a TRACK_TO constraint (another object, and its own pole).

**What is left alone.** The scene, always. Of the camera its sensor fit, and its sensor unless the lens would fall below
Blender's 1 mm: then lens and sensor double together, and the artist's sensor comes back as soon as the distance allows. A
negative scale mirrors the picture, as in Cycles; its sign changes only if the Pinhole asks for the other picture.
"""

import contextlib
import math
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import intrinsics, rotation
from .. import roll as rolls
from ..camera_values import HOLD, CameraValues, without_border
from ..errors import InputError
from ..pinhole import Pinhole, Triple
from . import datablocks, findings, hold, pose, preferences, storage, suspects, targets

Array = NDArray[np.float64]

# A turn by less is lost in the float32 matrix in which a camera is stored, and would be shown as −0°.
_UNSEEN = 2.0**-24

# What `place` was asked for lately, with the state that it left: Blender tells of each edit once more when it evaluates it, and
# a camera that follows something would be placed where it stands already.
_in_place: set[tuple] = set()
_MOST_IN_PLACE = 256


def apply(camera_object: bpy.types.Object, pinhole: Pinhole, scene: bpy.types.Scene) -> list[str]:
    """State `pinhole` in the camera's four values, move the camera there, and read it back.

    pinhole : the camera of the picture that `scene` renders (resolution percentage and cropped border included), world space.

    Returns what a reader should know, one sentence each: why the camera is not where it was put, or will not stay.

    Raises
    ------
    InputError
        if the object is no perspective camera, if the pinhole has another size or pixel aspect than the scene renders, or if
        a number is too large for Blender. Nothing has changed then.
    """
    datablocks.check_perspective(camera_object)
    intrinsics.check_storable(camera_object.name, look_at=pinhole.look_at, up=pinhole.up, distance=pinhole.distance)
    place(camera_object, pinhole, scene)
    frame = datablocks.frame_of(scene)
    followed = targets.names(camera_object)
    at_full_size = pinhole.distance[0] * (frame.resolution_x / frame.size[0])
    state(camera_object, pinhole.eye, pinhole.look_at, pinhole.up, at_full_size, frame)
    if followed:  # being asked where these are, Blender has brought the camera back to them
        place(camera_object, pinhole, scene)
    kept = targets.names(camera_object)
    left = [f"The {words} no longer follows {name!r}" for words, name in followed.items() if words not in kept]
    return left + check(camera_object, pinhole, scene)


def state(
    camera_object: bpy.types.Object, eye: Triple, look_at: Triple, up: Triple, distance: float, frame: intrinsics.Frame
) -> None:
    """Set the four values in float64 and enable them; the camera stays where it is.

    distance : the effective one in the picture of `frame` at 100 %, zoom included.
    A target that stands exactly where the point is stated stays, any other is cleared.
    """
    released = [point for point, at in (("eye", eye), ("look_at", look_at)) if targets.place(camera_object, point) != tuple(at)]
    for point in released:
        targets.release(camera_object, point)
    before = storage.load(camera_object)
    if not storage.is_counted_in_earlier(camera_object, before):
        before = replace(before, counted_in=without_border(frame))
    said = before.stating(eye, look_at, up, distance, frame, camera_object.data.sensor_fit)
    storage.store(camera_object, said, *storage.EXACT, "counted_in", "enabled", *(["zoom"] if said.zoom != before.zoom else []))
    storage.settle(camera_object, said, frame)


def follow(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Move an enabled camera to where its values, edited or not, say; a held roll is carried along (hold.py).

    Raises
    ------
    InputError
        as `stated` and `apply` do. Nothing has changed then.
    """
    values, wanted = _level(camera_object, scene)
    if values.pole == HOLD:
        angle = hold.roll(camera_object, values, scene)
        if not datablocks.is_animated(camera_object):  # in an animation the curves say what is held
            if before := _stood_at(camera_object, values, scene):
                angle = hold.after_edit(before, wanted, values.held_roll, values.hold_within)
            values = replace(values, held_roll=angle)
        wanted = rolls.turned(wanted, angle)
    place(camera_object, wanted, scene)
    storage.settle(camera_object, values.as_set(), datablocks.frame_of(scene))


def place(
    camera_object: bpy.types.Object, pinhole: Pinhole, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None
) -> None:
    """Move a perspective camera to `pinhole` without stating it and without reading back; otherwise as `apply`.

    depsgraph : where to look up what carries the camera; None: that of the scene. A camera whose pose tells what carries it
        is then placed once more from there, since it may have been far away.
    """

    def state() -> tuple:
        """All of the camera that is read or set here, what carries it aside."""
        lens = (camera.lens, camera.shift_x, camera.shift_y, camera.sensor_width, camera.sensor_height, camera.sensor_fit)
        return pose.channels_of(camera_object), lens, tuple(camera.virtual_pinhole_sensor)

    camera, frame = camera_object.data, datablocks.frame_of(scene)
    is_carried = bool(camera_object.parent or camera_object.constraints)
    within = depsgraph or datablocks.depsgraph_of(scene)
    parent = pose.parent_matrix(camera_object, within) if is_carried else rotation.IDENTITY
    before = state()
    channels, _, grown_from = before
    order = (pinhole, frame, parent.tobytes())
    if (*order, *before) not in _in_place:
        sensor = intrinsics.own_sensor((camera.sensor_width, camera.sensor_height), grown_from)
        data = intrinsics.camera_data(pinhole.plane, frame, *sensor, camera.sensor_fit)
        if not np.isfinite(channels.delta_rotation).all():
            raise pose.no_size(camera_object)
        location, turn, scale = channels.bringing_to(pinhole, parent)
        lens, shift = (data.lens, data.sensor_width), (data.shift_x, data.shift_y)
        intrinsics.check_storable(camera_object.name, distance=lens, shift=shift, eye=location)
        # Nothing fails from here on.
        _store(camera_object, location=location, scale=scale)
        pose.set_rotation(camera_object, turn)
        _store(camera, shift_x=data.shift_x, shift_y=data.shift_y, **intrinsics.lens_and_sensor(data, sensor))
        if len(_in_place) == _MOST_IN_PLACE:
            _in_place.clear()
        _in_place.add((*order, *state()))
    if is_carried and depsgraph is None and pose.is_told_by_its_pose(camera_object):
        place(camera_object, pinhole, scene, datablocks.depsgraph_of(scene))


def refit(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Set the lens anew, which the values ask for in the picture as the scene renders it now; the pose stays as it is.

    Raises
    ------
    InputError
        as `follow` does. Nothing has changed then.
    """
    camera, frame = camera_object.data, datablocks.frame_of(scene)
    plane = intrinsics.view_plane(datablocks.camera_data_of(camera_object), frame)
    distance = targets.values(camera_object).distances(frame, camera.sensor_fit)
    sensor = datablocks.own_sensor(camera)
    data = intrinsics.camera_data(replace(plane, distance=distance), frame, *sensor, camera.sensor_fit)
    intrinsics.check_storable(camera_object.name, distance=(data.lens, data.sensor_width))
    _store(camera, **intrinsics.lens_and_sensor(data, sensor))


def _store(block: bpy.types.ID, **properties: float | tuple[float, ...]) -> None:
    """Set what Blender does not hold already. It evaluates and draws anew what is set, and for a lens looks at all objects."""
    for name, value in properties.items():
        if not np.array_equal(np.float32(value), getattr(block, name)):
            setattr(block, name, value)


def check(camera_object: bpy.types.Object, wanted: Pinhole, scene: bpy.types.Scene) -> list[str]:
    """One sentence for each thing that keeps the camera from being `wanted`, or will; empty where all is well."""
    culprits = list(suspects.suspects(camera_object, scene))
    try:
        found = read(camera_object, scene)
    except InputError as error:
        return [datablocks.sentence(error), *findings.blame({}, culprits)]
    reach = pose.reach(camera_object, datablocks.depsgraph_of(scene))
    differing = findings.differences(wanted, found, reach, lambda value: datablocks.length(value, scene, digits=3))
    return findings.blame(differing, culprits)


def read(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole:
    """The Pinhole as which Cycles renders this camera: its evaluated matrix with normalised columns, and its evaluated lens.

    The look-at point is any point on the view axis, up is v. The evaluated object of another depsgraph may be given as well.

    Raises
    ------
    InputError
        if the object is no perspective camera, or takes no part in the scene, is sheared or scaled to zero.
    """
    datablocks.check_perspective(camera_object)
    evaluated = camera_object if camera_object.is_evaluated else camera_object.evaluated_get(datablocks.depsgraph_of(scene))
    if not evaluated.is_evaluated:
        raise InputError(
            f"camera {camera_object.name!r} takes no part in scene {scene.name!r}: "
            "enable it and its collection in the viewport, or make it the scene's camera"
        )
    matrix = rotation.float64(evaluated.matrix_world)
    sizes = np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.isfinite(matrix).all() or not sizes.all():
        raise pose.no_size(camera_object)
    axes = matrix[:3, :3] / sizes
    if abs(np.linalg.det(axes)) <= pose.LARGEST_SKEW:  # flat, but for rounding
        raise pose.no_size(camera_object)
    if rotation.skew(axes) > pose.LARGEST_SKEW:
        raise InputError(f"camera {camera_object.name!r} is oblique, {pose.who_shears(camera_object)}")
    mirrored = bool(np.linalg.det(axes) < 0)
    _, v, w = rotation.nearest(axes).T
    eye = matrix[:3, 3]
    # As far away as the eye's largest coordinate: then eye − reach · w loses none of w's digits.
    reach = 2.0 ** math.ceil(math.log2(max(1.0, np.abs(eye).max())))
    plane = intrinsics.view_plane(datablocks.camera_data_of(evaluated), datablocks.frame_of(scene))
    return Pinhole(
        tuple(eye.tolist()),
        tuple((eye - reach * w).tolist()),
        tuple(v.tolist()),
        plane.distance,
        plane.width,
        plane.height,
        plane.principal_point,
        mirrored,
    )


def stated(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole | None:
    """The Pinhole that `object.virtual_pinhole` asks for in the picture that `scene` renders, or None where it is not enabled.

    The principal point is that of the camera's own shift, and mirroring that of its scale: the values do not speak of them.
    Where the roll is held, up is turned by it. The evaluated object of another depsgraph may be given as well.

    Raises
    ------
    InputError
        if the values make no camera: eye = look-at, up = 0, distance ≤ 0, a number that is not finite.
    """
    if not storage.is_enabled(camera_object):
        return None
    values, level = _level(camera_object, scene)
    return rolls.turned(level, hold.roll(camera_object, values, scene))


def _level(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> tuple[CameraValues, Pinhole]:
    """The values, and the Pinhole that they ask for, whatever the roll is."""
    evaluated = camera_object if camera_object.is_evaluated else camera_object.evaluated_get(datablocks.depsgraph_of(scene))
    frame = datablocks.frame_of(scene)
    plane = intrinsics.view_plane(datablocks.camera_data_of(evaluated), frame)
    values = storage.load(camera_object)
    if values.follows:
        values = targets.followed(camera_object, values)
    return values, values.pinhole(plane, frame, camera_object.data.sensor_fit, rotation.mirrors(evaluated.matrix_world))


def _stood_at(camera_object: bpy.types.Object, values: CameraValues, scene: bpy.types.Scene) -> Pinhole | None:
    """The view before an edit, without its roll, or None if the camera does not stand where it was set (moved, constrained)."""
    if values.view_when_set is None:
        return None
    try:
        before, found = Pinhole(*values.view_when_set, 1.0, 1, 1), read(camera_object, scene)
    except InputError:
        return None
    off = np.subtract(rolls.turned(before, values.held_roll).basis(), found.basis())
    return before if np.abs(off).max() <= findings.LARGEST_TURN else None


def adopt(camera_object: bpy.types.Object, scene: bpy.types.Scene, keep: frozenset[str] = frozenset()) -> None:
    """State the four values that make the camera as it stands, and enable them. The camera does not move.

    The look-at point keeps its distance to the eye if the values were in use before; else it lies in the plane of focus (that
    of the focus object, if it stands before the camera, or the focus distance, 10 m in a new camera). Up is the world's Z where
    this gives the same picture, else v.

    keep : names of values that stay as they are; the others follow the camera.

    Raises
    ------
    InputError
        as `read` does.
    """
    standing = as_it_stands(camera_object, scene, in_use=storage.is_enabled(camera_object) and not keep)
    values, frame = targets.values(camera_object), datablocks.frame_of(scene)
    eye, look_at, up = values.eye, values.look_at, values.up
    if "eye" not in keep:
        eye = standing.eye
    if "look_at" not in keep:
        look_at = standing.look_at
    eye, look_at = _as_followed(camera_object, eye, look_at)
    if "up" not in keep:
        up = simplest_up(eye, look_at, read(camera_object, scene).basis()[1])
    distance = standing.distance[0] * frame.resolution_x / frame.size[0]
    if "distance" in keep:
        distance = values.distance_at_full_size(frame, camera_object.data.sensor_fit)
    state(camera_object, eye, look_at, up, distance, frame)


def _as_followed(camera_object: bpy.types.Object, eye: Triple, look_at: Triple) -> tuple[Triple, Triple]:
    """Eye and look-at, but the place of its target for a point that is there but for rounding, so that it stays followed."""
    rounding = findings.LARGEST_TURN * (math.dist(eye, look_at) + max(map(abs, (*eye, *look_at))))
    found = []
    for point, stated in zip(targets.POINTS, (eye, look_at), strict=True):
        at = targets.place(camera_object, point)
        found.append(at if at is not None and math.dist(at, stated) <= rounding else stated)
    return tuple(found)


def as_it_stands(camera_object: bpy.types.Object, scene: bpy.types.Scene, in_use: bool) -> Pinhole:
    """What `adopt` states, unstated: the camera as it stands, with a look-at point and an up that people would choose.

    in_use : whether the look-at point has the distance from the eye that the values say, if they say any.

    Raises
    ------
    InputError
        as `read` does.
    """
    found = read(camera_object, scene)
    _, v, w = found.basis()
    values = targets.values(camera_object)
    reach = math.dist(values.eye, values.look_at) if in_use else 0.0
    if not 0 < reach < math.inf:
        reach = _focus_distance(camera_object, found, datablocks.depsgraph_of(scene))
    look_at = tuple((np.array(found.eye) - reach * w).tolist())
    return replace(found, look_at=look_at, up=simplest_up(found.eye, look_at, v))


def simplest_up(eye: tuple, look_at: tuple, v: Array) -> Triple:
    """The preferred up where its v is the given one but for the rounding of a float32 matrix, else v."""
    vertical = preferences.up_axis()
    pinhole = Pinhole(eye, look_at, vertical, 1.0, 1, 1)
    if np.abs(pinhole.basis()[1] - v).max() <= findings.LARGEST_TURN:
        return vertical
    return tuple(v.tolist())


def _focus_distance(camera_object: bpy.types.Object, pinhole: Pinhole, depsgraph: bpy.types.Depsgraph) -> float:
    focus = camera_object.data.dof
    if focus.focus_object:
        place = rotation.float64(focus.focus_object.evaluated_get(depsgraph).matrix_world.translation)
        if np.isfinite(place).all() and (depth := float(pinhole.project(place)[2])) > 0:
            return depth
    return focus.focus_distance if focus.focus_distance > 0 else 10.0  # which nan is not


def roll(camera_object: bpy.types.Object) -> float:
    """The property `roll`, radians: 0 where the values make no camera, and below what can be seen."""
    with contextlib.suppress(InputError):
        values = targets.values(camera_object)
        found = values.roll_from(preferences.up_axis(), _held_roll(camera_object, values))
        return found if abs(found) > _UNSEEN else 0.0
    return 0.0


def turn(camera_object: bpy.types.Object, angle: float) -> None:
    """Say values with that `roll`, radians, and move nothing. Those that make no camera stay as they are."""
    with contextlib.suppress(InputError):
        values = targets.values(camera_object)
        held = _held_roll(camera_object, values)
        if values.pole == HOLD:
            more = angle - values.roll_from(preferences.up_axis(), held)
            storage.store(camera_object, replace(values, held_roll=values.held_roll + more), "held_roll")
        else:
            up = rolls.rolled(rolls.turned(values.view(), held), preferences.up_axis(), angle).up
            storage.store(camera_object, replace(storage.load(camera_object), up=up), "up")


def _held_roll(camera_object: bpy.types.Object, values: CameraValues) -> float:
    return hold.roll(camera_object, values, datablocks.scene_of(camera_object.original))
