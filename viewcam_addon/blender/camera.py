"""A camera's four values and Blender's camera, kept together: values in, camera out; camera moved, values back.

`CameraSync` owns, one for each camera, what is known of it between two calls of Blender: where it was placed last, where values
and camera were last seen to agree, and whether it is on its way. Whoever edits, moves or shows a camera calls it; it calls
storage.py (the values as Blender keeps them) and conversion.py (Blender's camera), and nothing that is above it.

**Values in, camera out.** `edited` moves the camera to its values, `apply` states a Pinhole in them first. `stated` is the
Pinhole that the values ask for, and `check` says where the camera is another.

**Camera moved, values back.** An edited value moves the camera at once, in its callback. So where camera and values differ when
Blender has evaluated the camera, it was Blender that moved it, and `updated` brings the values there. What differs by no more
than float32 storage is no move: the values keep every bit, however often this is asked. Rejected: to keep in the file what was
set last, which undo, linking and scripts would make stale.

**Who decides.** What is animated of the values (keyframes, drivers, targets) places its part of the camera at every frame; the
values of all other parts follow the camera, whether a hand, keyframes, a constraint, a driver or a parent places it. So an eye
on a path and a look-at target go together.

The focus distance is left alone, unless the camera is told to keep it on the look-at point: that lies on the view's axis, so
that |e − l| is its depth.
"""

import contextlib
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, ClassVar

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from .. import intrinsics, rotation
from .. import roll as rolls
from ..camera_values import FACTORS, HOLD, CameraValues, moved_poses, without_border
from ..errors import InputError
from ..pinhole import Pinhole, Triple, basis_of_views, make_views
from . import causes, conversion, datablocks, findings, hold, pose, preferences, storage, targets
from .conversion import read, takes_part

__all__ = [
    "ALL",
    "CameraSync",
    "adopt",
    "answer",
    "apply",
    "as_it_stands",
    "check",
    "current",
    "forget_all",
    "lens",
    "read",
    "roll",
    "simplest_up",
    "stated",
    "tag_animation",
    "takes_part",
]

Array = NDArray[np.float64]

# A turn by less is lost in the float32 matrix in which a camera is stored, and would be shown as −0°.
_UNSEEN = 2.0**-24

# The values that a camera's move can change.
ALL = frozenset({"eye", "look_at", "up", "distance", "held_roll"})

# From so many on, one pass carries cameras sooner than each by itself: calibrated, it costs one camera as much as two.
_MANY = 3


class CameraSync:
    """One camera's state between Blender's calls. There is one for each camera: `CameraSync.of(camera_object)`.

    camera_object : the original.
    """

    _known: ClassVar[dict[int, "CameraSync"]] = {}  # by the camera's session_uid
    _MOST_KNOWN = 4096
    _MOST_RESTS = 16

    def __init__(self) -> None:
        self.camera_object: bpy.types.Object = None
        self.is_being_set = False  # the values were edited, and the camera does not stand there yet: neither has been moved
        # The camera as it was placed last, with the state that it left. Blender tells of each edit once more when it evaluates
        # it, and a camera that follows something would be placed where it stands already.
        self._placed: tuple = ()
        # The camera's state and its stored values as they were last seen to agree; None where nobody has looked.
        self._state: Any = None  # a tuple, and CameraValues; None until it is first seen
        self._values: Any = None
        self._matrix: Matrix | None = None  # the one that the channels of this state make
        self._was_carried = False  # a parent or a constraint had a say in where that is
        self._raw: tuple | None = None  # as Blender holds these values, once a frame has looked
        # The picture in which they decide all of the camera, each by itself, so that `carry` may bring it; None in no picture.
        self._carried_in: intrinsics.Frame | None = None
        # Both as they were before each of the last moves since the values were edited: a move that is canceled gives the
        # values back to the bit.
        self._rests: tuple[tuple[tuple, CameraValues], ...] = ()
        self._is_moving = False  # the last update that Blender made of the camera has moved it

    @classmethod
    def of(cls, camera_object: bpy.types.Object) -> "CameraSync":
        """The one of a camera, original or evaluated."""
        camera_object = camera_object.original
        known = cls._known.get(camera_object.session_uid)
        if known is None:
            if len(cls._known) >= cls._MOST_KNOWN:
                forget_all()
            known = cls._known[camera_object.session_uid] = cls()
        known.camera_object = camera_object  # Blender may have moved it in memory
        return known

    # Values in, camera out.

    def apply(self, pinhole: Pinhole, scene: bpy.types.Scene) -> list[findings.Finding]:
        """State `pinhole` in the values, enable them, move the camera there, and read it back: as the function `apply`."""
        camera_object = self.camera_object
        with self._being_set():
            datablocks.check_perspective(camera_object)
            exact = {"look_at": pinhole.look_at, "up": pinhole.up, "distance": pinhole.distance}
            intrinsics.check_storable(camera_object.name, **exact)
            free = _free(camera_object)
            self._place(pinhole, scene, parts=free)
            frame = datablocks.frame_of(scene)
            followed = targets.names(camera_object)
            at_full_size = pinhole.distance[0] * (frame.resolution_x / frame.size[0])
            self.state(pinhole.eye, pinhole.look_at, pinhole.up, at_full_size, frame)
            if followed:  # being asked where these are, Blender has brought the camera back to them
                self._place(pinhole, scene, parts=free)
        self._agree()
        kept = targets.names(camera_object)
        left = [
            findings.Finding(f"The {words} no longer follows {name!r}") for words, name in followed.items() if words not in kept
        ]
        return left + check(camera_object, pinhole, scene)

    def state(self, eye: Triple, look_at: Triple, up: Triple, distance: float, frame: intrinsics.Frame) -> None:
        """Set the four values in float64 and enable them; the camera stays where it is.

        distance : the effective one in the picture of `frame` at 100 %, zoom included.
        A target that stands exactly where the point is stated stays, any other is cleared.
        """
        camera_object = self.camera_object
        released = [
            point for point, at in (("eye", eye), ("look_at", look_at)) if targets.place(camera_object, point) != tuple(at)
        ]
        for point in released:
            targets.release(camera_object, point)
        before = storage.load(camera_object)
        if not storage.is_counted_in_earlier(camera_object, before):
            before = replace(before, counted_in=without_border(frame))
        values = before.stating(eye, look_at, up, distance, frame, camera_object.data.sensor_fit)
        changed = [name for name in FACTORS if getattr(values, name) != getattr(before, name)]
        names = [*storage.EXACT, "counted_in", "enabled", *changed]
        storage.store(camera_object, values, *names)
        storage.settle(camera_object, values, frame)

    def edited(self, scene: bpy.types.Scene, names: frozenset[str] = ALL) -> None:
        """Move an enabled camera to where its values, edited or not, say; a held roll is carried along (hold.py).

        names : the names of the values that count where Blender has moved the camera since its last update; the others follow
            it.

        Raises InputError as `stated` and `apply` do. Nothing has changed then.
        """
        camera_object = self.camera_object
        with self._being_set():
            if names != ALL and self._state and self._state != conversion.state_of(camera_object):
                with contextlib.suppress(InputError):
                    self._adopt_move(scene, datablocks.depsgraph_of(scene), self._values, names)
            values, wanted = _level(camera_object, scene)
            picture = without_border(datablocks.frame_of(scene))
            if values.pole == HOLD:
                angle = hold.roll(camera_object, values, scene)
                if not datablocks.is_animated(camera_object):  # in an animation the curves say what is held
                    if before := _stood_at(camera_object, values, scene):
                        angle = hold.after_edit(before, wanted, values.held_roll, values.hold_within)
                    values = replace(values, held_roll=angle)
                wanted = rolls.turned(wanted, angle)
            self._place(wanted, scene, parts=_free(camera_object))
            if values.pole == HOLD or not values.set_for == values.counted_in == picture:
                storage.settle(camera_object, values.as_set(), picture)
            self._agree()

    def resized(self, scene: bpy.types.Scene) -> None:
        """Set the lens anew, which the values ask for in the picture as the scene renders it now; the pose stays as it is.

        Raises InputError as `edited` does. Nothing has changed then.
        """
        frame = datablocks.frame_of(scene)
        distances = targets.values(self.camera_object).distances(frame, self.camera_object.data.sensor_fit)
        conversion.place_lens(self.camera_object, distances, scene)

    def settled(self, frame: intrinsics.Frame) -> None:
        """Take note that the lens is set for the picture of `frame`."""
        storage.settle(self.camera_object, storage.load(self.camera_object), frame)

    # Camera moved, values back.

    def adopt(self, scene: bpy.types.Scene, keep: frozenset[str] = frozenset()) -> None:
        """State the four values that make the camera as it stands, and enable them: as the function `adopt`.

        keep : names of values that stay as they are; the others follow the camera.
        """
        camera_object = self.camera_object
        was_in_use = storage.load(camera_object).set_for is not None
        standing = _standing(camera_object, scene, was_in_use and not keep)
        values = storage.load(camera_object)
        is_said_by_roll = values.enabled and values.pole == HOLD and values.held_roll != 0
        if was_in_use and not is_said_by_roll and _agreed(camera_object, scene):
            storage.enable(camera_object)
            return
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
        self.state(eye, look_at, up, distance, frame)

    def updated(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        """Blender has evaluated an enabled camera, at no new frame: what has moved it moves the values.

        Values with a driver or a target change between frames too, as what they depend on is moved.
        """
        camera_object = self.camera_object
        is_driven = bool(camera_object.animation_data) and datablocks.has_driven_values(camera_object)
        if not is_driven and targets.names(camera_object):
            targets.connect(camera_object)  # its animation data were cleared, and the targets' drivers with them
        is_moved = False
        if self.is_untouched(by_values=is_driven):
            self._is_moving = False  # the next move is another
        else:
            self.doubt()
            with contextlib.suppress(InputError):  # the panel finds the same error and shows it
                is_moved = self._adopt_move(scene, depsgraph)
        if is_driven and not is_moved:
            self.at_frame(scene, depsgraph)

    @classmethod
    def carry(
        cls, cameras: list[tuple["CameraSync", bpy.types.Object, bool]], scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph
    ) -> list["CameraSync"]:
        """Bring those cameras, in one pass, of which a frame has changed the values alone, and to those that it has moved the
        values.

        cameras : enabled ones, with their objects as Blender has evaluated them, and true where it has evaluated their data.

        Returns those that are left to `at_frame`.
        """
        if depsgraph.mode == "RENDER" or len(cameras) < _MANY:
            return [sync for sync, *_ in cameras]
        left, stated, moved = [], [], []
        try:
            picture = without_border(datablocks.frame_of(scene))
        except InputError:  # no picture at all
            return [sync for sync, *_ in cameras]
        for sync, evaluated, has_new_data in cameras:
            camera_object = sync.camera_object
            if sync._carried_in is not picture and sync._carried_in != picture:
                left.append(sync)
                continue
            sync._carried_in = picture  # two that are one and the same are compared in no time
            if _is_carried(camera_object):
                left.append(sync)
                continue
            if not datablocks.is_known_as_animated(camera_object):
                state = conversion.state_of(camera_object)
                if state != sync._state and sync._is_free(state):
                    moved.append((sync, evaluated, state))
                elif state != sync._state:
                    left.append(sync)
                continue
            raw = storage.raw(evaluated)
            if raw is None or not sync._stands(has_new_data):
                left.append(sync)
                continue
            values = sync._values if raw == sync._raw else storage.animated(sync._values, raw)
            if values is not sync._values:
                stated.append((sync, values, raw))
        if moved:
            left += cls._follow(moved, picture)
        if stated:
            poses = _poses_of([values for _, values, _ in stated])
            axes, valid = basis_of_views(*poses.swapaxes(0, 1))
            left += [stated[i][0] for i in np.flatnonzero(~valid)]
            of_modes: dict[str, list[int]] = {}
            for i in np.flatnonzero(valid).tolist():
                of_modes.setdefault(stated[i][0]._state[0].mode, []).append(i)
            axes, locations = axes.transpose(1, 2, 0), poses[:, 0].astype(np.float32)
            for mode, of_mode in of_modes.items():
                left += cls._bring([stated[i] for i in of_mode], mode, locations[of_mode], axes[of_mode], scene)
        return left

    @classmethod
    def _follow(
        cls, moved: list[tuple["CameraSync", bpy.types.Object, tuple]], picture: intrinsics.Frame
    ) -> list["CameraSync"]:
        """State in the values of cameras where a frame has moved them, as `_adopt_move` does one by one.

        moved : cameras that nothing carries and of which no value decides a part, with their evaluated objects and states.
        Returns those that are left to it.
        """
        before = _poses_of([sync._values for sync, *_ in moved])
        matrices = rotation.float64([evaluated.matrix_world for _, evaluated, _ in moved])
        axes, volumes, skews = rotation.axes_of(matrices)
        valid = (volumes > pose.LARGEST_SKEW) & (skews <= pose.LARGEST_SKEW) & make_views(*before.swapaxes(0, 1))
        if not valid.all():
            left = [sync for (sync, *_), is_valid in zip(moved, valid, strict=True) if not is_valid]
            moved = [each for each, is_valid in zip(moved, valid, strict=True) if is_valid]
            return left + (cls._follow(moved, picture) if moved else [])
        channels = [(sync._state[0], state[0]) for sync, _, state in moved]
        is_moved = np.array([here.location != there.location for here, there in channels])
        is_turned = np.array([here[:3:2] != there[:3:2] for here, there in channels])  # in its mode or its rotation
        rounding, eyes = findings.LARGEST_TURN, matrices[:, :3, 3]
        after = moved_poses(before, is_moved, is_turned, eyes, rotation.straightened(axes), preferences.up_axis(), rounding)
        is_view = make_views(*after.swapaxes(0, 1)) & (np.abs(after) <= intrinsics.LARGEST_FLOAT32).all(axis=(-2, -1))
        left = []
        for (sync, _, state), is_valid, is_changed, pose_after, vectors in zip(
            moved,
            is_view.tolist(),
            (is_moved | is_turned).tolist(),
            after.tolist(),
            storage.zeroed(after).tolist(),
            strict=True,
        ):
            values = sync._values
            distance = values.distance if state[2:] == sync._state[2:] else sync._distance_of_lens(picture)
            if not is_valid or distance is None:
                left.append(sync)
                continue
            if is_changed or distance != values.distance:
                eye, look_at, up = map(tuple, pose_after)
                sync._values, sync._raw = values.animated(eye, look_at, up, distance, 2.0**-53), None
                storage.follow(sync.camera_object, sync._values, vectors)
            sync._state, sync._matrix = state, sync.camera_object.matrix_basis.copy()
            sync._rests, sync._is_moving, sync._placed = (), False, ()
        return left

    def _distance_of_lens(self, picture: intrinsics.Frame) -> float | None:
        """The distance that the lens makes, or the value itself where they differ by rounding; None where there is none."""
        values, fit = self._values, self.camera_object.data.sensor_fit
        try:
            wanted = values.distances(picture, fit)
            seen = datablocks.view_plane(datablocks.camera_data_of(self.camera_object), picture).distance
        except InputError:
            return None
        if all(abs(a - b) <= findings.LARGEST_ZOOM * a for a, b in zip(wanted, seen, strict=True)):
            return values.distance
        distance = values.stored_distance(seen[0] * (picture.resolution_x / picture.size[0]), picture, fit)
        return distance if 0 < distance <= intrinsics.LARGEST_FLOAT32 else None

    def _stands(self, has_new_data: bool) -> bool:
        """True if the camera is in the state in which it was last seen to agree with its values, give or take a rounding.

        has_new_data : false where its lens can't be another one.
        """
        camera_object = self.camera_object
        if has_new_data:
            return conversion.state_of(camera_object) == self._state
        return camera_object.matrix_basis == self._matrix and camera_object.rotation_mode == self._state[0].mode

    def _is_free(self, state: tuple) -> bool:
        """True if nothing keeps the values of a camera that Blender has moved from following."""
        camera_object, (channels, kind, *_) = self.camera_object, state
        return channels.is_plain and kind == "PERSP" and not camera_object.library and not camera_object.data.library

    @classmethod
    def _bring(
        cls,
        stated: list[tuple["CameraSync", CameraValues, tuple]],
        mode: str,
        locations: NDArray[np.float32],
        axes: Array,
        scene: bpy.types.Scene,
    ) -> list["CameraSync"]:
        """Place n cameras that nothing carries by their new values.

        mode : their rotation mode.
        locations : their places, (n, 3).
        axes : (n, 3, 3), u, v and w as columns.

        Returns those that do not stand there now, or have no such lens.
        """
        left, cameras = [], [sync.camera_object for sync, *_ in stated]
        places = [tuple(location) for location in locations.tolist()]
        for (sync, *_), location in zip(stated, places, strict=True):
            if location != sync._state[0].location:
                sync.camera_object.location = location
        turns, matrices = pose.set_rotations(cameras, mode, rotation.numbers(axes, mode), axes)
        for (sync, values, raw), location, turn, matrix in zip(stated, places, turns.tolist(), matrices, strict=True):
            camera_object, (channels, *lens), before = sync.camera_object, sync._state, sync._values
            if matrix.translation[:] != location:  # a script has made deltas of its channels
                left.append(sync)
                continue
            if storage.is_focused_on_look_at(camera_object):
                conversion.store(camera_object.data.dof, focus_distance=math.dist(values.eye, values.look_at))
            sync._state, sync._matrix = (rotation.Channels(mode, location, tuple(turn), *channels[3:]), *lens), matrix
            sync._values, sync._raw, sync._rests, sync._is_moving, sync._placed = values, raw, (), False, ()
            if values.zoomed_distance != before.zoomed_distance:
                try:
                    sync.resized(scene)
                    sync._agree()
                except InputError:
                    left.append(sync)
        return left

    def at_frame(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        """Blender has evaluated an enabled camera at another frame: what the values decide there places it, the rest follows.

        In a render's dependency graph nothing is stored but the camera itself, which is tagged with its animation (TIME).

        Raises InputError if the values make no camera, or the camera is no pinhole.
        """
        camera_object, is_render = self.camera_object, depsgraph.mode == "RENDER"
        names = datablocks.animated_values(camera_object)
        if not names:
            if not is_render:
                with contextlib.suppress(InputError):
                    self._adopt_move(scene, depsgraph)
            return
        evaluated = camera_object.evaluated_get(depsgraph)
        if not evaluated.is_evaluated or not storage.is_enabled(evaluated):
            return
        decided = causes.decided_by(names)
        values, level = _level(evaluated, scene)
        is_asked = bool(storage.asked_of(camera_object))
        stood = values
        # A render's graph writes nothing back to the camera, so that its state says nothing of how it stands there.
        others = conversion.PARTS - decided
        is_moved = causes.may_move(camera_object, others) and (is_render or not self.is_untouched(by_values=True))
        if is_moved or (findings.DISTANCE in others and not is_render and self._has_another_lens()):
            values, level = self._carried(evaluated, values, level, decided, scene, depsgraph)
        self._place(rolls.turned(level, hold.roll(evaluated, values, scene)), scene, depsgraph, decided)
        if is_render:
            tag_animation(camera_object)
        else:
            if camera_object.animation_data.drivers:
                targets.connect(camera_object)  # one that was removed from the file leaves its driver
                targets.mirror(camera_object, evaluated)
            if is_asked or values is not stood:  # else Blender has stored them itself
                self._store_changed(storage.load(camera_object), values)
                storage.forget_asked(camera_object, datablocks.LOOKS.values())
            self._agree()

    def is_untouched(self, by_values: bool) -> bool:
        """True if neither the camera nor, unless by_values, its values have changed since they were last seen to agree."""
        camera_object = self.camera_object
        if self._was_carried or _is_carried(camera_object) or self._state != conversion.state_of(camera_object):
            return False
        return by_values or self._values == storage.load(camera_object)

    def _has_another_lens(self) -> bool:
        """True if a script has set the lens or the sensor since the camera was last seen to agree with its values."""
        return self._state is None or self._state[1:] != conversion.state_of(self.camera_object)[1:]

    def doubt(self) -> None:
        """Take it that the camera may have been moved without its values: `carry` leaves it alone until they agree."""
        self._carried_in = None

    def forget(self) -> None:
        """Undo has brought back other values, or another camera."""
        self._known.pop(self.camera_object.session_uid, None)

    @contextlib.contextmanager
    def _being_set(self) -> Iterator[None]:
        before, self.is_being_set = self.is_being_set, True
        try:
            yield
        finally:
            self.is_being_set = before

    def _place(
        self,
        pinhole: Pinhole,
        scene: bpy.types.Scene,
        depsgraph: bpy.types.Depsgraph | None = None,
        parts: frozenset[str] = conversion.PARTS,
    ) -> None:
        """conversion.place, but a camera that stands where it was placed by the same pinhole is left there; and the focus."""
        camera_object = self.camera_object
        parent = conversion.parent_matrix(camera_object, scene, depsgraph)
        order = (pinhole, datablocks.frame_of(scene), parts, parent.tobytes())
        if self._placed != (*order, conversion.state_of(camera_object)):
            conversion.place(camera_object, pinhole, scene, depsgraph, parts, parent)
            self._placed = (*order, conversion.state_of(camera_object))
        if storage.is_focused_on_look_at(camera_object):
            conversion.store(camera_object.data.dof, focus_distance=math.dist(pinhole.eye, pinhole.look_at))

    def _adopt_move(
        self,
        scene: bpy.types.Scene,
        depsgraph: bpy.types.Depsgraph,
        since: CameraValues | None = None,
        edited: frozenset[str] = frozenset(),
    ) -> bool:
        """State in an enabled camera's values where Blender has moved it since: by hand or script, its parent, its lens, a rig.

        The look-at point keeps its distance to the eye, and up stays where it gives the picture. What follows an object or has
        a driver stays as that says, and the camera is brought back to it.

        depsgraph : in which the camera was evaluated just now.
        since : the values before some were edited, where the camera does not stand there yet.
        edited : the names of these, which stay.

        Returns whether there was anything to adopt.

        Raises InputError as `read` and `stated` do. Nothing has changed then.
        """
        camera_object = self.camera_object
        frame, state = datablocks.frame_of(scene), conversion.state_of(camera_object)
        evaluated = camera_object.evaluated_get(depsgraph)
        values, level = _level(evaluated, scene)
        base, bound = since or values, {(name, i) for name in edited for i in range(3)}
        if since:
            level = since.pinhole(level.plane, frame, camera_object.data.sensor_fit, level.mirrored)
        wanted = rolls.turned(level, hold.roll(evaluated, base, scene))
        is_carried = self._was_carried or _is_carried(camera_object)
        pinhole = read(evaluated, scene)
        bound |= targets.bound(evaluated)
        moved = _moved(camera_object, wanted, pinhole, depsgraph)
        names = {name for name, _ in bound}
        if "eye" in names and not since and self._state in (None, state):
            moved -= {findings.VIEW}  # it is what the eye follows that has moved
        if values.set_for != without_border(frame):
            moved -= {findings.DISTANCE}  # the lens is that of another picture
        if not moved:
            self._agree()
            return False
        rests = self._rests_before() if self._state and not since else ()
        canceled = () if bound or is_carried else [rested for where, rested in rests if where == state]
        if canceled:
            last_canceled = canceled[-1]
        else:
            last_canceled = self._moved_to(base, pinhole, moved, bound, frame)
            last_canceled = values.with_unbound(last_canceled, bound)
        if values.pole == HOLD and findings.VIEW in moved:
            more = rolls.angle_from(last_canceled.up, pinhole) - hold.roll(evaluated, last_canceled, scene)
            more = math.remainder(more, 2 * math.pi)
            if abs(more) > findings.LARGEST_TURN:
                last_canceled = replace(last_canceled, held_roll=float(np.float32(last_canceled.held_roll + more)))
        if not self._store_changed(values, last_canceled):
            return False
        storage.settle(camera_object, last_canceled.as_set(), frame)
        if bound:
            level = last_canceled.pinhole(pinhole.plane, frame, camera_object.data.sensor_fit, pinhole.mirrored)
            turned = rolls.turned(level, hold.roll(evaluated, last_canceled, scene))
            self._place(turned, scene, depsgraph, causes.decided_by(names) & _free(camera_object))
        self._agree(rests, is_moving=True)
        return True

    def _carried(
        self,
        evaluated: bpy.types.Object,
        values: CameraValues,
        level: Pinhole,
        decided: frozenset[str],
        scene: bpy.types.Scene,
        depsgraph: bpy.types.Depsgraph,
    ) -> tuple[CameraValues, Pinhole]:
        """Values of a frame, and what they ask for, with all that they do not decide as it is in the camera there."""
        pinhole, frame = read(evaluated, scene), datablocks.frame_of(scene)
        wanted = rolls.turned(level, hold.roll(evaluated, values, scene))
        moved = _moved(self.camera_object, wanted, pinhole, depsgraph) - decided
        if values.set_for != without_border(frame):
            moved -= {findings.DISTANCE}
        if not moved:
            return values, level
        bound = {(name, i) for name in datablocks.animated_values(self.camera_object) for i in range(3)}
        values = self._moved_to(values, pinhole, moved, bound, frame)
        return values, values.pinhole(level.plane, frame, self.camera_object.data.sensor_fit, level.mirrored)

    def _moved_to(
        self, base: CameraValues, pinhole: Pinhole, moved: set[str], bound: set[tuple[str, int]], frame: intrinsics.Frame
    ) -> CameraValues:
        """The values of a camera as it was moved, but the numbers that something else decides."""
        values = base.moved_to(pinhole, moved, bound, preferences.up_axis(), findings.LARGEST_TURN)
        if findings.DISTANCE in moved:
            at_full_size = pinhole.distance[0] * (frame.resolution_x / frame.size[0])
            values = base.with_unbound(values.seeing(at_full_size, frame, self.camera_object.data.sensor_fit), bound)
        return values

    def _store_changed(self, before: CameraValues, after: CameraValues) -> bool:
        """Store what has changed of the values; whether anything has."""
        names = [name for name in ALL if getattr(after, name) != getattr(before, name)]
        if names:
            exact = {"eye": after.eye, "look_at": after.look_at, "distance": (after.distance,)}
            intrinsics.check_storable(self.camera_object.name, **exact)
            storage.store(self.camera_object, after, *names)
        return bool(names)

    def _rests_before(self) -> tuple[tuple[tuple, CameraValues], ...]:
        """The rests of a camera that is moved from where it was last seen."""
        return self._rests if self._is_moving else (*self._rests, (self._state, self._values))[-self._MOST_RESTS :]

    def _agree(self, rests: tuple[tuple[tuple, CameraValues], ...] = (), is_moving: bool = False) -> None:
        """Take note that the camera is where its values say."""
        self._state = channels, kind, *_ = conversion.state_of(self.camera_object)
        self._matrix = self.camera_object.matrix_basis.copy()
        self._was_carried = _is_carried(self.camera_object)
        self._values = values = storage.load(self.camera_object)
        self._raw, self._rests, self._is_moving = None, rests, is_moving
        is_simple = not (self._was_carried or values.pole == HOLD or values.follows) and values.set_for == values.counted_in
        self._carried_in = values.set_for if is_simple and channels.is_plain and kind == "PERSP" else None


def _poses_of(values: list[CameraValues]) -> Array:
    """(n, 3, 3): eye, look-at and up of each."""
    return np.array([(*each.eye, *each.look_at, *each.up) for each in values]).reshape(-1, 3, 3)


def tag_animation(camera_object: bpy.types.Object) -> None:
    """Let Blender evaluate a camera anew with its animation, and its lens with that."""
    camera_object.update_tag(refresh={"OBJECT", "DATA", "TIME"})
    camera_object.data.update_tag(refresh={"TIME"})


def forget_all() -> None:
    """Forget all cameras: another file is open."""
    CameraSync._known.clear()


def apply(camera_object: bpy.types.Object, pinhole: Pinhole, scene: bpy.types.Scene) -> list[str]:
    """State `pinhole` in the camera's four values, move the camera there, and read it back.

    pinhole : the camera of the picture that `scene` renders (resolution percentage and cropped border included), world space.

    Returns what a reader should know, one sentence each: why the camera is not where it was put, or will not stay.

    Raises InputError if the object is no perspective camera, if the pinhole has another size or pixel aspect than the scene
    renders, or if a number is too large for Blender. Nothing has changed then.
    """
    return [finding.sentence for finding in CameraSync.of(camera_object).apply(pinhole, scene)]


def adopt(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """State the four values that make the camera as it stands, and enable them. The camera does not move.

    Values that say so already keep every digit. If it takes a held roll as well, that goes into up, unless they were off: then
    it stays. The look-at point keeps its distance to the eye if values have ever been in use; else it lies in the plane of
    focus (that of the focus object, if it stands before the camera, or the focus distance, 10 m in a new camera). Up is the
    world's Z where this gives the same picture, else v.

    Raises InputError as `read` does.
    """
    CameraSync.of(camera_object).adopt(scene)


def check(camera_object: bpy.types.Object, wanted: Pinhole, scene: bpy.types.Scene) -> list[findings.Finding]:
    """A finding for each thing that keeps the camera from being `wanted`, or will; empty where all is well."""
    possible = list(causes.causes(camera_object, scene))
    try:
        read_back = read(camera_object, scene)
    except InputError as error:
        return [findings.Finding(datablocks.sentence(error)), *findings.explain({}, possible)]
    reach = pose.reach(camera_object, datablocks.depsgraph_of(scene))
    differing = findings.differences(wanted, read_back, reach, lambda value: datablocks.length(value, scene, digits=3))
    return findings.explain(differing, possible)


def stated(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole | None:
    """The Pinhole that `object.virtual_pinhole` asks for in the picture that `scene` renders, or None where it is not enabled.

    The principal point is that of the camera's own shift, and mirroring that of its scale: the values do not speak of them.
    Where the roll is held, up is turned by it. The evaluated object of another depsgraph may be given as well.

    Raises InputError if the values make no camera: eye = look-at, up = 0, distance ≤ 0, a number that is not finite.
    """
    if not storage.is_enabled(camera_object):
        return None
    values, level = _level(camera_object, scene)
    return rolls.turned(level, hold.roll(camera_object, values, scene))


def _level(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> tuple[CameraValues, Pinhole]:
    """The values, and the Pinhole that they ask for, whatever the roll is."""
    evaluated = conversion.evaluated(camera_object, scene)
    frame = datablocks.frame_of(scene)
    plane = datablocks.view_plane(datablocks.camera_data_of(evaluated), frame)
    values = storage.load(camera_object)
    if values.asked:
        values = _answered(camera_object, values, scene)
    if values.follows:
        values = targets.followed(camera_object, values)
    return values, values.pinhole(plane, frame, camera_object.data.sensor_fit, rotation.mirrors(evaluated.matrix_world))


def _stood_at(camera_object: bpy.types.Object, values: CameraValues, scene: bpy.types.Scene) -> Pinhole | None:
    """The view before an edit, without its roll, or None if the camera does not stand where it was set (moved, constrained)."""
    if values.view_when_set is None:
        return None
    try:
        before, pinhole = Pinhole(*values.view_when_set, 1.0, 1, 1), read(camera_object, scene)
    except InputError:
        return None
    off = np.subtract(rolls.turned(before, values.held_roll).basis(), pinhole.basis())
    return before if np.abs(off).max() <= findings.LARGEST_TURN else None


def _agreed(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole | None:
    """The Pinhole that the values, in use or not, ask for, if the camera stands there."""
    with contextlib.suppress(InputError):
        values, level = _level(camera_object, scene)
        wanted = rolls.turned(level, hold.roll(camera_object, values, scene))
        reach = pose.reach(camera_object, datablocks.depsgraph_of(scene))
        if not findings.differences(wanted, read(camera_object, scene), reach):
            return wanted
    return None


def _is_carried(camera_object: bpy.types.Object) -> bool:
    """True if its channels alone do not say where a camera stands."""
    return bool(camera_object.parent or camera_object.constraints)


def _free(camera_object: bpy.types.Object) -> frozenset[str]:
    """The parts of the camera that can be set: a constraint that adds to the others would only be fed."""
    return conversion.PARTS - causes.fed(camera_object) if camera_object.constraints else conversion.PARTS


def _moved(camera_object: bpy.types.Object, wanted: Pinhole, read_back: Pinhole, depsgraph: bpy.types.Depsgraph) -> set[str]:
    """The parts EYE, VIEW and DISTANCE that Blender has moved by more than a rounding, and nobody holds where they are."""
    differing = findings.differences(wanted, read_back, pose.reach(camera_object, depsgraph)).keys()
    moved = set(conversion.PARTS & differing)
    if findings.EYE in moved and np.array_equal(np.array(wanted.eye, np.float32), np.array(read_back.eye, np.float32)):
        moved.remove(findings.EYE)
    return moved - causes.held(camera_object) if moved else moved


def _as_followed(camera_object: bpy.types.Object, eye: Triple, look_at: Triple) -> tuple[Triple, Triple]:
    """Eye and look-at, but the place of its target for a point that is there but for rounding, so that it stays followed."""
    rounding = findings.LARGEST_TURN * (math.dist(eye, look_at) + max(map(abs, (*eye, *look_at))))
    synced: list[Triple] = []
    for point, stated in zip(targets.POINTS, (eye, look_at), strict=True):
        at = targets.place(camera_object, point)
        synced.append(at if at is not None and math.dist(at, stated) <= rounding else stated)
    return synced[0], synced[1]


def as_it_stands(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole:
    """The pinhole that `adopt` states, unstated: the camera as it stands, with a look-at point and an up that people would
    choose.

    Raises InputError as `read` does.
    """
    was_in_use = storage.load(camera_object).set_for is not None
    return (was_in_use and _agreed(camera_object, scene)) or _standing(camera_object, scene, was_in_use)


def current(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole:
    """The camera as its values state it, or where these are not enabled as it stands. Raises InputError as either does."""
    return stated(camera_object, scene) or as_it_stands(camera_object, scene)


def _standing(camera_object: bpy.types.Object, scene: bpy.types.Scene, was_in_use: bool) -> Pinhole:
    """`as_it_stands`, the look-at point as far from the eye as the values say if these were ever in use."""
    pinhole = read(camera_object, scene)
    _, v, w = pinhole.basis()
    values = targets.values(camera_object)
    reach = math.dist(values.eye, values.look_at) if was_in_use else 0.0
    if not 0 < reach < math.inf:
        reach = _focus_distance(camera_object, pinhole, datablocks.depsgraph_of(scene))
    look_at = tuple((np.array(pinhole.eye) - reach * w).tolist())
    return replace(pinhole, look_at=look_at, up=simplest_up(pinhole.eye, look_at, v))


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
    scene = datablocks.scene_of(camera_object)
    frame, fit = datablocks.frame_of(scene), camera_object.data.sensor_fit
    with contextlib.suppress(InputError, ZeroDivisionError):
        values = _answered(camera_object, storage.load(camera_object), scene)
        distance = values.distance_at_full_size(frame, fit)
        return intrinsics.lens_in(unit, distance, frame, datablocks.own_sensor(camera_object.data), fit)
    return 0.0


def roll(camera_object: bpy.types.Object) -> float:
    """The property `roll`, radians: 0 where the values make no camera, and below what can be seen."""
    with contextlib.suppress(InputError):
        asked = storage.asked_of(camera_object)
        if "roll" in asked:
            return asked["roll"]
        values = _followed(camera_object, storage.load(camera_object))
        held = hold.roll(camera_object, values, datablocks.scene_of(camera_object.original))
        angle = values.roll_from(preferences.up_axis(), held)
        return angle if abs(angle) > _UNSEEN else 0.0
    return 0.0


def _followed(camera_object: bpy.types.Object, values: CameraValues) -> CameraValues:
    """`targets.followed`, with targets as they stood last where the roll is animated.

    Blender then asks for the roll, and for other looks at values, as it evaluates: to evaluate here would begin that anew,
    without end.
    """
    is_animated = bool(values.follows) and "up" in datablocks.animated_values(camera_object.original)
    return targets.followed(camera_object, values, as_evaluated=is_animated)


def answer(camera_object: bpy.types.Object) -> None:
    """State the distance and the up that other looks at them ask for, and move nothing. What is no lens changes nothing."""
    if storage.asked_of(camera_object) and camera_object.type == "CAMERA":
        values = storage.load(camera_object)
        answered = _answered(camera_object, values, datablocks.scene_of(camera_object))
        names = [name for name in ("distance", "up", "held_roll") if getattr(answered, name) != getattr(values, name)]
        storage.store(camera_object, answered, *names)
    storage.forget_asked(camera_object, datablocks.LOOKS.values())


def _answered(camera_object: bpy.types.Object, values: CameraValues, scene: bpy.types.Scene) -> CameraValues:
    """Values as other looks at them ask for. Those that make no camera, or are asked for no lens, stay as they are."""
    frame, fit = datablocks.frame_of(scene), camera_object.data.sensor_fit
    for look, number in values.asked:
        with contextlib.suppress(InputError, ZeroDivisionError):
            if look == "roll":
                followed = _followed(camera_object, values)
                turned = followed.rolled(number, preferences.up_axis(), hold.roll(camera_object, followed, scene))
                values = replace(values, up=turned.up, held_roll=turned.held_roll)
            else:
                sensor = datablocks.own_sensor(camera_object.data)
                distance = intrinsics.distance_by_lens(datablocks.LENSES[look], number, frame, sensor, fit)
                seeing = values.seeing(distance, frame, fit)
                intrinsics.check_storable(camera_object.name, distance=(seeing.distance,))
                values = seeing
    return replace(values, asked=())
