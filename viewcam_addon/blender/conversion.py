"""Blender's camera from a Pinhole, and a Pinhole from Blender's camera: both ways, and nothing is remembered here.

`place` moves a camera object to a Pinhole; `read` is the Pinhole as which Cycles renders a camera. What a camera's four values
have to do with either, camera.py knows.

**How the pose is set.** As location and rotation, in whatever rotation mode the artist has, computed in float64 relative to the
parent, with delta transforms taken off: within 1.6e-7 of a matrix entry, and without trouble in gimbal lock. Rejected:
`matrix_parent_inverse` (3e-8, but the location and rotation in the sidebar would say nothing, and the camera would not be where
its channels say), `matrix_world =` (4.9e-7; 2.5e-3 in gimbal lock; wrong by whole units under a non-uniformly scaled parent),
`to_track_quat` (an arbitrary roll near vertical) and a TRACK_TO constraint (another object, and its own pole).

**What is left alone.** The scene, always. Of the camera its sensor fit, and its sensor unless the lens would fall below
Blender's 1 mm: then lens and sensor double together, and the artist's sensor comes back as soon as the distance allows. A
negative scale mirrors the picture, as in Cycles; its sign changes only if the Pinhole asks for the other picture.
"""

import math
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import intrinsics, rotation
from ..errors import InputError
from ..pinhole import Pinhole
from . import datablocks, pose
from .findings import DISTANCE, EYE, VIEW

# The parts of a camera that can be placed apart from one another: location, rotation with scale, and lens with shift.
PARTS = frozenset({EYE, VIEW, DISTANCE})


def place(
    camera_object: bpy.types.Object,
    pinhole: Pinhole,
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph | None = None,
    parts: frozenset[str] = PARTS,
    parent: NDArray[np.float64] | None = None,
) -> None:
    """Move a perspective camera to `pinhole`, without reading back.

    pinhole : the camera of the picture that `scene` renders, in world space.
    depsgraph : the depsgraph in which to look up what carries the camera; the scene's where None. A camera whose pose tells
        what carries it is then placed once more from there, since it may have been far away.
    parts : the PARTS to set; the others stay as they are.
    parent : `parent_matrix`, where that is known.

    Raises InputError if the pinhole has another size or pixel aspect than the scene renders, if a number is too large for
    Blender, or if what carries the camera is scaled to zero. Nothing has changed then.
    """
    camera, frame = camera_object.data, datablocks.frame_of(scene)
    if parent is None:
        parent = parent_matrix(camera_object, scene, depsgraph)
    channels = pose.channels_of(camera_object)
    sensor = datablocks.own_sensor(camera)
    data = datablocks.camera_data(pinhole.plane, frame, *sensor, camera.sensor_fit)
    if not np.isfinite(channels.delta_rotation).all():
        raise pose.no_size(camera_object)
    location, turn, scale = channels.bringing_to(pinhole, parent)
    lens, shift = (data.lens, data.sensor_width), (data.shift_x, data.shift_y)
    intrinsics.check_storable(camera_object.name, distance=lens, shift=shift, eye=location)
    # Nothing fails from here on.
    if EYE in parts:
        store(camera_object, location=location)
    if VIEW in parts:
        store(camera_object, scale=scale)
        pose.set_rotation(camera_object, turn)
    if DISTANCE in parts:
        store(camera, shift_x=data.shift_x, shift_y=data.shift_y, **intrinsics.lens_and_sensor(data, sensor))
    if parent is not rotation.IDENTITY and depsgraph is None and pose.is_told_by_its_pose(camera_object):
        place(camera_object, pinhole, scene, datablocks.depsgraph_of(scene), parts)


def parent_matrix(
    camera_object: bpy.types.Object, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None
) -> NDArray[np.float64]:
    """pose.parent_matrix, which is asked only where something carries the camera. depsgraph : None: that of the scene."""
    if not camera_object.parent and not camera_object.constraints:
        return rotation.IDENTITY
    return pose.parent_matrix(camera_object, depsgraph or datablocks.depsgraph_of(scene))


def place_lens(camera_object: bpy.types.Object, distance: tuple[float, float], scene: bpy.types.Scene) -> None:
    """Set the lens for a distance in the picture as the scene renders it now; pose and shift stay as they are.

    distance : (d_x, d_y), pixels of the picture, its percentage included.

    Raises InputError as `place` does. Nothing has changed then.
    """
    camera, frame = camera_object.data, datablocks.frame_of(scene)
    plane = datablocks.view_plane(datablocks.camera_data_of(camera_object), frame)
    sensor = datablocks.own_sensor(camera)
    data = datablocks.camera_data(replace(plane, distance=distance), frame, *sensor, camera.sensor_fit)
    intrinsics.check_storable(camera_object.name, distance=(data.lens, data.sensor_width))
    store(camera, **intrinsics.lens_and_sensor(data, sensor))


def store(block: bpy.types.bpy_struct, **properties: float | tuple[float, ...]) -> None:
    """Set what Blender does not hold already. It evaluates and draws anew what is set, and for a lens looks at all objects."""
    for name, value in properties.items():
        held = getattr(block, name)
        if np.array(value, dtype=np.float32).tolist() != (held if isinstance(held, float) else list(held)):
            setattr(block, name, value)


def state_of(camera_object: bpy.types.Object) -> tuple:
    """All of the camera that `place` reads or sets, what carries it aside."""
    camera = camera_object.data
    sensor = (camera.sensor_width, camera.sensor_height, camera.sensor_fit, camera.virtual_pinhole_sensor[:])
    return pose.channels_of(camera_object), camera.type, camera.lens, camera.shift_x, camera.shift_y, *sensor


def evaluated(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object:
    """The camera as the scene evaluates it; the evaluated object of another depsgraph is that already."""
    return camera_object if camera_object.is_evaluated else camera_object.evaluated_get(datablocks.depsgraph_of(scene))


def takes_part(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """True if Blender evaluates the camera in the scene, so that it stands somewhere there."""
    return evaluated(camera_object, scene).is_evaluated


def read(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole:
    """The Pinhole as which Cycles renders this camera: its evaluated matrix with normalized columns, and its evaluated lens.

    The look-at point is any point on the view axis, up is v. The evaluated object of another depsgraph may be given as well.

    Raises InputError if the object is no perspective camera, or takes no part in the scene, is sheared or scaled to zero.
    """
    datablocks.check_perspective(camera_object)
    camera = evaluated(camera_object, scene)
    if not camera.is_evaluated:
        raise InputError(
            f"camera {camera_object.name!r} takes no part in scene {scene.name!r}: "
            "enable it and its collection in the viewport, or make it the scene's camera"
        )
    matrix = rotation.float64(camera.matrix_world)
    axes, volume, skew = rotation.axes_of(matrix)
    if not abs(volume) > pose.LARGEST_SKEW:  # flat, but for rounding
        raise pose.no_size(camera_object)
    if skew > pose.LARGEST_SKEW:
        raise InputError(f"camera {camera_object.name!r} is oblique, {pose.who_shears(camera_object)}")
    mirrored = bool(volume < 0)
    _, v, w = rotation.straightened(axes).T
    eye = matrix[:3, 3]
    # The look-at point is as far away as the eye's largest coordinate: then eye − reach · w loses none of w's digits.
    reach = 2.0 ** math.ceil(math.log2(max(1.0, np.abs(eye).max())))
    plane = datablocks.view_plane(datablocks.camera_data_of(camera), datablocks.frame_of(scene))
    view = tuple(eye.tolist()), tuple((eye - reach * w).tolist()), tuple(v.tolist())
    return Pinhole(*view, **vars(plane), mirrored=mirrored)
