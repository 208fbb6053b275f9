"""Blender's camera from a Pinhole, and a Pinhole from Blender's camera.

`apply` states a Pinhole on a camera object and moves the camera there; `read` says which Pinhole the camera is as Cycles
renders it; `stated` says which Pinhole the four values of `object.virtual_pinhole` ask for, and `follow` moves the camera
there. findings.py compares `stated` with `read`.

**Two ways.** An edited value moves the camera at once, in its callback. So where camera and values differ when Blender has
evaluated the camera, it was Blender that moved it, and `adopt_move` brings the values there. What differs by no more than
float32 storage is no move: the values keep every bit, however often this is asked. Rejected: to keep in the file what was set
last, which undo, linking and scripts would make stale.

**How the pose is set.** As location and rotation, in whatever rotation mode the artist has, computed in float64 relative to the
parent, with delta transforms taken off: within 1.6e-7 of a matrix entry, and without trouble in gimbal lock. Rejected:
`matrix_parent_inverse` (3e-8, but the location and rotation in the sidebar would say nothing, and the camera would not be where
its channels say), `matrix_world =` (4.9e-7; 2.5e-3 in gimbal lock; wrong by whole units under a non-uniformly scaled parent),
`to_track_quat` (an arbitrary roll near vertical) and a TRACK_TO constraint (another object, and its own pole).

**What is left alone.** The scene, always. Of the camera its sensor fit, and its sensor unless the lens would fall below
Blender's 1 mm: then lens and sensor double together, and the artist's sensor comes back as soon as the distance allows. A
negative scale mirrors the picture, as in Cycles; its sign changes only if the Pinhole asks for the other picture. The focus
distance, unless the camera is told to keep it on the look-at point: that lies on the view's axis, so that |e − l| is its depth.
"""

import contextlib
import math
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import intrinsics, rotation
from .. import roll as rolls
from ..camera_values import HOLD, CameraValues, without_border
from ..errors import InputError
from ..pinhole import Pinhole, Triple
from . import causes, datablocks, findings, hold, pose, preferences, storage, targets

Array = NDArray[np.float64]

# A turn by less is lost in the float32 matrix in which a camera is stored, and would be shown as −0°.
_UNSEEN = 2.0**-24

# What `place` was asked for lately, with the state that it left: Blender tells of each edit once more when it evaluates it, and
# a camera that follows something would be placed where it stands already.
_in_place: set[tuple] = set()
_MOST_IN_PLACE = 256

# The values that a camera's move can change.
ALL = frozenset({"eye", "look_at", "up", "distance", "held_roll"})


@dataclass(frozen=True)
class _Agreement:
    """A camera's state (`_state_of`) and stored values as they were last seen to agree.

    rests : both as they were before each of the last moves since the values were edited: a move that is canceled gives the
        values back to the bit. is_moving : whether the last update that Blender made of the camera has moved it.
    """

    state: tuple
    values: CameraValues
    rests: tuple[tuple[tuple, CameraValues], ...] = ()
    is_moving: bool = False


_MOST_RESTS = 16
_agreed: dict[int, _Agreement] = {}  # by the camera's session_uid
_being_set: list[int] = []  # session_uid of cameras whose values were edited, until they stand there: neither has been moved


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
    _being_set.append(camera_object.session_uid)
    try:
        left = _apply(camera_object, pinhole, scene)
    finally:
        _being_set.pop()
    agree(camera_object)
    return left + check(camera_object, pinhole, scene)


def _apply(camera_object: bpy.types.Object, pinhole: Pinhole, scene: bpy.types.Scene) -> list[str]:
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
    return [f"The {words} no longer follows {name!r}" for words, name in followed.items() if words not in kept]


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


def follow(camera_object: bpy.types.Object, scene: bpy.types.Scene, edited: frozenset[str] = ALL) -> None:
    """Move an enabled camera to where its values, edited or not, say; a held roll is carried along (hold.py).

    edited : names of the values that count, wherever Blender has moved the camera since its last update; the others follow it.

    Raises
    ------
    InputError
        as `stated` and `apply` do. Nothing has changed then.
    """
    _being_set.append(camera_object.session_uid)
    try:
        last = _agreed.get(camera_object.session_uid)
        if edited != ALL and last and last.state != _state_of(camera_object):
            with contextlib.suppress(InputError):
                adopt_move(camera_object, scene, datablocks.depsgraph_of(scene), last.values, edited)
        values, wanted = _level(camera_object, scene)
        picture = without_border(datablocks.frame_of(scene))
        if values.pole == HOLD:
            angle = hold.roll(camera_object, values, scene)
            if not datablocks.is_animated(camera_object):  # in an animation the curves say what is held
                if before := _stood_at(camera_object, values, scene):
                    angle = hold.after_edit(before, wanted, values.held_roll, values.hold_within)
                values = replace(values, held_roll=angle)
            wanted = rolls.turned(wanted, angle)
        place(camera_object, wanted, scene)
        if values.pole == HOLD or not values.set_for == values.counted_in == picture:
            storage.settle(camera_object, values.as_set(), picture)
        agree(camera_object)
    finally:
        _being_set.pop()


def place(
    camera_object: bpy.types.Object, pinhole: Pinhole, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None
) -> None:
    """Move a perspective camera to `pinhole` without stating it and without reading back; otherwise as `apply`.

    depsgraph : where to look up what carries the camera; None: that of the scene. A camera whose pose tells what carries it
        is then placed once more from there, since it may have been far away.
    """
    camera, frame = camera_object.data, datablocks.frame_of(scene)
    is_carried = bool(camera_object.parent or camera_object.constraints)
    parent = rotation.IDENTITY
    if is_carried:
        parent = pose.parent_matrix(camera_object, depsgraph or datablocks.depsgraph_of(scene))
    before = _state_of(camera_object)
    channels, _, grown_from = before
    order = (pinhole, frame, parent.tobytes())
    if (*order, *before) not in _in_place:
        sensor = intrinsics.own_sensor((camera.sensor_width, camera.sensor_height), grown_from)
        data = datablocks.camera_data(pinhole.plane, frame, *sensor, camera.sensor_fit)
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
        _in_place.add((*order, *_state_of(camera_object)))
    if storage.is_focused_on_look_at(camera_object):
        _store(camera.dof, focus_distance=math.dist(pinhole.eye, pinhole.look_at))
    if is_carried and depsgraph is None and pose.is_told_by_its_pose(camera_object):
        place(camera_object, pinhole, scene, datablocks.depsgraph_of(scene))


def _state_of(camera_object: bpy.types.Object) -> tuple:
    """All of the camera that `place` reads or sets, what carries it aside."""
    camera = camera_object.data
    lens = (camera.lens, camera.shift_x, camera.shift_y, camera.sensor_width, camera.sensor_height, camera.sensor_fit)
    return pose.channels_of(camera_object), lens, tuple(camera.virtual_pinhole_sensor)


def refit(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Set the lens anew, which the values ask for in the picture as the scene renders it now; the pose stays as it is.

    Raises
    ------
    InputError
        as `follow` does. Nothing has changed then.
    """
    camera, frame = camera_object.data, datablocks.frame_of(scene)
    plane = datablocks.view_plane(datablocks.camera_data_of(camera_object), frame)
    distance = targets.values(camera_object).distances(frame, camera.sensor_fit)
    sensor = datablocks.own_sensor(camera)
    data = datablocks.camera_data(replace(plane, distance=distance), frame, *sensor, camera.sensor_fit)
    intrinsics.check_storable(camera_object.name, distance=(data.lens, data.sensor_width))
    _store(camera, **intrinsics.lens_and_sensor(data, sensor))


def _store(block: bpy.types.ID, **properties: float | tuple[float, ...]) -> None:
    """Set what Blender does not hold already. It evaluates and draws anew what is set, and for a lens looks at all objects."""
    for name, value in properties.items():
        held = getattr(block, name)
        if np.float32(value).tolist() != (held if isinstance(held, float) else list(held)):
            setattr(block, name, value)


def check(camera_object: bpy.types.Object, wanted: Pinhole, scene: bpy.types.Scene) -> list[str]:
    """One sentence for each thing that keeps the camera from being `wanted`, or will; empty where all is well."""
    possible = list(causes.causes(camera_object, scene))
    try:
        found = read(camera_object, scene)
    except InputError as error:
        return [datablocks.sentence(error), *findings.explain({}, possible)]
    reach = pose.reach(camera_object, datablocks.depsgraph_of(scene))
    differing = findings.differences(wanted, found, reach, lambda value: datablocks.length(value, scene, digits=3))
    return findings.explain(differing, possible)


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
    plane = datablocks.view_plane(datablocks.camera_data_of(evaluated), datablocks.frame_of(scene))
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
    plane = datablocks.view_plane(datablocks.camera_data_of(evaluated), frame)
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
    storage.begin(camera_object)
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


def is_being_set(camera_object: bpy.types.Object) -> bool:
    """Whether the camera is on its way to its values, as Blender evaluates it."""
    return camera_object.session_uid in _being_set


def is_untouched(camera_object: bpy.types.Object, by_values: bool) -> bool:
    """Whether neither the camera nor, unless by_values, its values have changed since they were last seen to agree."""
    last = _agreed.get(camera_object.session_uid)
    if last is None or camera_object.parent or camera_object.constraints or last.state != _state_of(camera_object):
        return False
    return by_values or last.values == storage.load(camera_object)


def adopt_move(
    camera_object: bpy.types.Object,
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    since: CameraValues | None = None,
    edited: frozenset[str] = frozenset(),
) -> bool:
    """State in an enabled camera's values where Blender has moved it since: by hand or by script, its parent or its lens.

    The look-at point keeps its distance to the eye, and up stays where it gives the picture. What follows an object or has a
    driver stays as that says, and the camera is brought back to it. Nothing is adopted of what a constraint, a driver or a
    library sets in the camera itself: these win, and `check` names them.

    depsgraph : in which the camera was evaluated just now. since : the values before some were edited, where the camera does
        not stand there yet. edited : the names of these, which stay. Returns whether there was anything to adopt.

    Raises
    ------
    InputError
        as `read` and `stated` do. Nothing has changed then.
    """
    frame, state = datablocks.frame_of(scene), _state_of(camera_object)
    evaluated = camera_object.evaluated_get(depsgraph)
    values, level = _level(evaluated, scene)
    base, bound = since or values, {(name, i) for name in edited for i in range(3)}
    if since:
        level = since.pinhole(level.plane, frame, camera_object.data.sensor_fit, level.mirrored)
    wanted = rolls.turned(level, hold.roll(evaluated, base, scene))
    is_carried = bool(camera_object.parent or camera_object.constraints)
    found = read(evaluated, scene)
    bound |= targets.bound(evaluated)
    moved = _moved(camera_object, wanted, found, depsgraph)
    last = _agreed.get(camera_object.session_uid)
    if "eye" in {name for name, _ in bound} and not since and (last is None or last.state == state):
        moved -= {findings.VIEW}  # it is what the eye follows that has moved
    if values.set_for != without_border(frame):
        moved -= {findings.DISTANCE}  # the lens is that of another picture
    if not moved:
        agree(camera_object)
        return False
    rests = _rests(last) if last and not since else ()
    canceled = () if bound or is_carried else [rested for where, rested in rests if where == state]
    if canceled:
        said = canceled[-1]
    else:
        said = base.moved_to(found, moved, bound, preferences.up_axis(), findings.LARGEST_TURN)
        if findings.DISTANCE in moved:
            at_full_size = found.distance[0] * (frame.resolution_x / frame.size[0])
            said = base.with_unbound(said.seeing(at_full_size, frame, camera_object.data.sensor_fit), bound)
        said = values.with_unbound(said, bound)
    if values.pole == HOLD and findings.VIEW in moved:
        more = rolls.angle_from(said.up, found) - hold.roll(evaluated, said, scene)
        more = math.remainder(more, 2 * math.pi)
        if abs(more) > findings.LARGEST_TURN:
            said = replace(said, held_roll=float(np.float32(said.held_roll + more)))
    stored = [name for name in ALL if getattr(said, name) != getattr(values, name)]
    if not stored:
        return False
    intrinsics.check_storable(camera_object.name, eye=said.eye, look_at=said.look_at, distance=(said.distance,))
    storage.store(camera_object, said, *stored)
    storage.settle(camera_object, said.as_set(), frame)
    if bound:
        level = said.pinhole(found.plane, frame, camera_object.data.sensor_fit, found.mirrored)
        place(camera_object, rolls.turned(level, hold.roll(evaluated, said, scene)), scene, depsgraph)
    agree(camera_object, rests, is_moving=True)
    return True


def end_move(camera_object: bpy.types.Object) -> None:
    """Take note that Blender has made an update of a camera and not moved it: what moves it next is another move."""
    last = _agreed.get(camera_object.session_uid)
    if last and last.is_moving:
        _agreed[camera_object.session_uid] = replace(last, is_moving=False)


def _rests(last: _Agreement) -> tuple[tuple[tuple, CameraValues], ...]:
    """Those of a camera that is moved from where it was last seen."""
    return last.rests if last.is_moving else (*last.rests, (last.state, last.values))[-_MOST_RESTS:]


def _moved(camera_object: bpy.types.Object, wanted: Pinhole, found: Pinhole, depsgraph: bpy.types.Depsgraph) -> set[str]:
    """Which of EYE, VIEW and DISTANCE Blender has moved by more than a rounding, and nobody holds where they are."""
    differing = findings.differences(wanted, found, pose.reach(camera_object, depsgraph)).keys()
    moved = {findings.EYE, findings.VIEW, findings.DISTANCE} & differing
    if findings.EYE in moved and np.array_equal(np.float32(wanted.eye), np.float32(found.eye)):
        moved.remove(findings.EYE)
    return moved - causes.held(camera_object) if moved else moved


def agree(camera_object: bpy.types.Object, rests: tuple[tuple[tuple, CameraValues], ...] = (), is_moving: bool = False) -> None:
    """Take note that the camera is where its values say. rests, is_moving : as an _Agreement has them."""
    if len(_agreed) >= _MOST_IN_PLACE:
        _agreed.clear()
    _agreed[camera_object.session_uid] = _Agreement(_state_of(camera_object), storage.load(camera_object), rests, is_moving)


def forget(camera_object: bpy.types.Object | None = None) -> None:
    """Forget that a camera, or all, agreed: undo has brought back other values."""
    if camera_object is None:
        _agreed.clear()
    else:
        _agreed.pop(camera_object.session_uid, None)


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


def lens(camera_object: bpy.types.Object, unit: str) -> float:
    """The lens in one of intrinsics.LENS_UNITS, zoom included; 0 where there is none.

    Blender reads it of every object, cameras or not: as it looks for what a library override has changed.
    """
    if camera_object.type != "CAMERA":
        return 0.0
    frame, fit = datablocks.frame_of(datablocks.scene_of(camera_object)), camera_object.data.sensor_fit
    with contextlib.suppress(InputError, ZeroDivisionError):
        distance = storage.load(camera_object).distance_at_full_size(frame, fit)
        return intrinsics.lens_in(unit, distance, frame, datablocks.own_sensor(camera_object.data), fit)
    return 0.0


def set_lens(camera_object: bpy.types.Object, unit: str, value: float) -> None:
    """Say the distance that is this lens, and move nothing. The zoom stays, and what is no lens changes nothing."""
    if camera_object.type != "CAMERA":
        return
    frame, fit = datablocks.frame_of(datablocks.scene_of(camera_object)), camera_object.data.sensor_fit
    with contextlib.suppress(InputError, ZeroDivisionError):
        distance = intrinsics.distance_by_lens(unit, value, frame, datablocks.own_sensor(camera_object.data), fit)
        said = storage.load(camera_object).seeing(distance, frame, fit)
        intrinsics.check_storable(camera_object.name, distance=(said.distance,))
        storage.store(camera_object, said, "distance")


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
