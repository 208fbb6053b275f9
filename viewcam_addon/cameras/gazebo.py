"""Gazebo's cameras, in a world's or a model's SDF (XML): `<sensor type="camera"><pose>…</pose><camera>…</camera></sensor>`.

A sensor stands in its link, this in its model, and that in the world, each by its pose: x y z roll pitch yaw, in radians about
the fixed axes x, y and z, or in degrees or as a quaternion where its attributes say so. The camera looks along x, y to the left
and z up. horizontal_fov is of the width, 1.047 unless given; the image 320 × 240. Where <lens> has intrinsics, these count.

A pose relative to another link, joint, frame or model of its scope, the model or world around it, is followed there; one
relative to what stands in another scope is refused. Models that are included from other files are told.

Source: sdformat.org's specification of sensor, camera, pose and link; gz-sim's camera frame (x forward, z up).
"""

import itertools
import math
from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np

from .. import checks, rotation
from ..errors import InputError, counted
from . import axes, opencv, texts
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Source, flat, number, pixels

TITLE = "Gazebo's SDF"

_SCOPES, _PLACED = ("world", "model"), ("model", "link", "joint", "frame")
_OTHERS = ("wideanglecamera", "wide_angle_camera")
_VIEW = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # columns right, up and back, in x ahead, y left, z up
_MOST = 4_000
_Frames = dict[str, ElementTree.Element | np.ndarray | None]
_DISTORTION = ("k1", "k2", "k3", "p1", "p2")
_INTRINSICS = {"fx": "277", "fy": "277", "cx": "160", "cy": "120", "s": "0"}


def recognizes(source: Source) -> bool:
    root = source.xml
    return (
        root is not None
        and root.tag in ("sdf", "gazebo", *_SCOPES, "link", "joint", "sensor")
        and root.find(".//camera") is not None
    )


def read(source: Source, options: Options) -> list[Camera]:
    root = source.xml
    if root is None:
        raise InputError(f"{source.name} is no XML: give Gazebo's world or model")
    holder = ElementTree.Element("sdf")
    holder.append(root)
    left_out, cameras = LeftOut(), []
    for sensor, camera, matrix in itertools.islice(_inside(holder, _frames(holder), np.eye(4), np.eye(4)), _MOST):
        name = sensor.get("name") or "camera"
        with left_out.unless_pinhole(name):
            cameras.append(_camera(name, sensor.get("type", "camera"), camera, matrix, options))
    included = [element.findtext("uri", "").strip() for element in root.iter("include")]
    notes = (f"Not read, since it is of other files: {', '.join(map(checks.quoted, included[:3]))}",) if included else ()
    return left_out.with_notes([camera.noted(*notes) for camera in cameras])


def _frames(scope: ElementTree.Element) -> _Frames:
    """The frames of a model or world by their names: its own, and what stands there."""
    frames: _Frames = {each.get("name", ""): each for each in scope if each.tag in _PLACED}
    return frames | {"world" if scope.tag == "world" else "__model__": np.eye(4)}


def _inside(
    holder: ElementTree.Element, frames: _Frames, around: np.ndarray, held: np.ndarray
) -> Iterator[tuple[ElementTree.Element, ElementTree.Element, np.ndarray]]:
    """Each sensor, each of its cameras, and its matrix in the world.

    frames : the frames of the model or world around.
    around : (4, 4), the matrix of this in the world.
    held : (4, 4), the holder's matrix in this.
    """
    for child in holder:
        if child.find(".//camera") is None:
            continue
        matrix = _in_scope(child, frames, held)
        if child.tag == "sensor":
            for camera in child.findall("camera"):
                yield child, camera, around @ _in_scope(camera, frames, matrix)
        elif child.tag in _SCOPES:
            yield from _inside(child, _frames(child), around @ matrix, np.eye(4))
        else:
            yield from _inside(child, frames, around, matrix)


def _in_scope(element: ElementTree.Element, frames: _Frames, held: np.ndarray) -> np.ndarray:
    """(4, 4) of an element in the model or world around it.

    frames : the frames of this, of which those that are followed become matrices.
    held : the matrix of what holds the element, to which its pose is relative unless it says otherwise.
    """
    pose = element.find("pose")
    what = f"the pose of {element.tag} {checks.quoted(element.get('name', ''))}"
    if element.get("placement_frame"):
        raise InputError(f"{what} is that of its placement_frame, which is not followed: write that of the model, without it")
    frame = "" if pose is None else pose.get("relative_to") or pose.get("frame") or ""
    frame = frame or element.get("attached_to", "") or (element.findtext("child", "").strip() if element.tag == "joint" else "")
    if frame:
        other = frames.get(frame)
        if isinstance(other, ElementTree.Element):
            frames[frame] = None  # until it is known, so that it does not lead to itself
            other = frames[frame] = _in_scope(other, frames, np.eye(4))
        if other is None:
            problem = "leads back to it" if frame in frames else "does not stand beside it"
            raise InputError(
                f"{what} is relative to {checks.quoted(frame)}, which {problem}: write it relative to what holds it"
            )
        held = other
    return held if pose is None else held @ _pose(pose, what)


def _pose(pose: ElementTree.Element, what: str) -> np.ndarray:
    """(4, 4) of a pose's numbers."""
    result = np.eye(4)
    numbers = flat(what, (pose.text or "").strip() or "0 0 0 0 0 0")
    is_quaternion = pose.get("rotation_format") == "quat_xyzw"
    if len(numbers) != (7 if is_quaternion else 6):
        raise InputError(f"{what} has {counted(len(numbers), 'number')}: it should have {7 if is_quaternion else 6}")
    result[:3, 3] = numbers[:3]
    if is_quaternion:
        x, y, z, w = numbers[3:]
        result[:3, :3] = axes.rotation_of((w, x, y, z), what)
    else:
        unit = math.pi / 180 if pose.get("degrees") in ("true", "1") else 1.0
        result[:3, :3] = rotation.from_euler([angle * unit for angle in numbers[3:]], "XYZ")
    return result


def _camera(name: str, kind: str, camera: ElementTree.Element, matrix: np.ndarray, options: Options) -> Camera:
    what = f"camera {checks.quoted(name)}"
    if kind in _OTHERS or (projection := camera.findtext("lens/type", "").strip()) not in ("", "gnomonical"):
        not_a_pinhole(what, f"of the kind {checks.quoted(kind if kind in _OTHERS else projection)}")
    if camera.findtext("projection_type", "perspective").strip() == "orthographic":
        not_a_pinhole(what, "orthographic")
    bent = camera.find("distortion")
    if bent is not None and not options.without_distortion and any(_number(bent, key, what, "0") for key in _DISTORTION):
        not_a_pinhole(what, "a camera with a distortion, which way it goes Gazebo does not say")
    width, height = size = (
        pixels(f"width of {what}", camera.findtext("image/width", "320").strip()),
        pixels(f"height of {what}", camera.findtext("image/height", "240").strip()),
    )
    intrinsics = camera.find("lens/intrinsics")
    if intrinsics is not None:
        f_x, f_y, c_x, c_y, skew = (_number(intrinsics, key, what, usual) for key, usual in _INTRINSICS.items())
        k = [f_x, skew, c_x, 0, f_y, c_y, 0, 0, 1]
        plane = opencv.plane_of_k(k, size, opencv.half_pixel(options, "corner"), what)
    else:
        plane = texts.Film(width, height).plane(
            _number(camera, "horizontal_fov", what, "1.047"), "x", f"horizontal_fov of {what}"
        )
    turned = matrix.copy()
    turned[:3, :3] = matrix[:3, :3] @ _VIEW
    pinhole, notes = axes.pinhole(turned, plane, what)
    return Camera(name, pinhole, True, notes)


def _number(element: ElementTree.Element, key: str, what: str, usual: str) -> float:
    return number(f"{key} of {what}", element.findtext(key, usual).strip())
