"""Agisoft Metashape's cameras as XML.

A camera's transform is from its axes (x right, y down, z into the view) to its component, and that one's to the world. The
chunk's own transform is that of its active component once more, or stands alone in files without components. The principal
point is an offset from the picture's middle, whose first pixel's center is (0.5, 0.5). b1 is what the distance across has more
than the other, b2 is skew, which is of the lens. P1 and P2 are OpenCV's p2 and p1.

A camera of a rig that has no transform of its own has a master, whose axes are those of its sensor's rotation and location: the
rotation takes its axes to the master's, the location is its eye there.

Source: the Metashape manual's camera model, and its exported files; of rigs the photogrammetry community's expert manual
(slave-sensor transform). nerfstudio's reader leaves out the chunk's transform and rigs.
"""

import dataclasses
from xml.etree import ElementTree

import numpy as np

from .. import checks
from ..errors import InputError, counted
from ..pinhole import ViewPlane
from . import axes, distortion, naming
from .camera import Camera, LeftOut, NoPinholeError, Options, not_a_pinhole
from .source import Source, flat, number, pixels

TITLE = "Agisoft Metashape XML"

_LENS = ("k1", "k2", "k3", "k4", "p1", "p2")
_NUMBERS = ("f", "cx", "cy", "b1", "b2", "p3", "p4", *_LENS)


def recognizes(source: Source) -> bool:
    head = source.text[:4000]
    if "<calibration" in head and "<projection" in head and source.xml is not None and source.xml.tag == "calibration":
        return True
    return "<document" in head and "<chunk" in source.text and source.xml is not None and source.xml.tag == "document"


def read(source: Source, options: Options) -> list[Camera]:
    if source.xml is not None and source.xml.tag == "calibration":
        return [_of_calibration(source.xml, source, options)]
    left_out, result, lost = LeftOut(), [], 0
    for chunk in source.xml.iter("chunk") if source.xml is not None else ():
        whole = _placed(chunk.find("transform"), "the chunk")
        components = {  # in the world, as the chunk's own transform repeats of the active one
            component.get("id"): _placed(component.find("transform"), f"component {component.get('id')}")
            for component in chunk.iter("component")
            if component.find("transform") is not None
        }
        planes: dict[str | None, tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]] = {}
        sensors = {sensor.get("id"): sensor for sensor in chunk.iter("sensor")}
        cameras = {camera.get("id"): camera for camera in chunk.iter("camera")}
        for camera in chunk.iter("camera"):
            label = camera.get("label") or f"camera {camera.get('id')}"
            what = f"camera {checks.quoted(label)}"
            master = cameras.get(camera.get("master_id")) if _transform(camera) is None else None
            if (own := _transform(camera if master is None else master)) is None:
                lost += 1
                continue
            sensor = camera.get("sensor_id")
            if sensor not in sensors:
                raise InputError(f"{what} is of the sensor {checks.quoted(sensor)}, which is not there: export the XML again")
            with left_out.unless_pinhole(naming.stem(label)):
                if sensor not in planes:
                    planes[sensor] = _plane(sensors[sensor], options)
                plane, lens, notes = planes[sensor]
                numbers = flat(f"the transform of {what}", own)
                if len(numbers) != 16:
                    raise InputError(f"the transform of {what} has {counted(len(numbers), 'number')}: it should have 16")
                belongs = camera.get("component_id")
                if components and belongs is not None and belongs not in components:
                    raise InputError(
                        f"component {checks.quoted(belongs)}, of which {what} is, has no transform: align it first"
                    )
                matrix = components.get(belongs, whole) @ np.array(numbers).reshape(4, 4)
                if master is not None:
                    matrix = matrix @ _on_rig(sensors[sensor], what)
                    notes = (*notes, f"{what} is of a rig: it was placed on its master {checks.quoted(master.get('label'))}")
                pinhole, more = axes.pinhole(_without_scale(axes.of_opencv(matrix)), plane, what)
                image = label if naming.has_suffix(label) else None
                result.append(Camera(naming.stem(label), pinhole, True, (*notes, *more), image, lens=lens))
    result = left_out.with_notes(result)
    if lost and not result:
        raise InputError(f"none of {counted(lost, 'camera')} of {source.name} is aligned: align them in Metashape first")
    lost_note = (f"{counted(lost, 'camera')} not aligned: left out",) if lost else ()
    return [camera.noted(*lost_note) for camera in result]


def _of_calibration(root: ElementTree.Element, source: Source, options: Options) -> Camera:
    """The camera of a calibration that was saved alone, as Tools › Camera Calibration does: at the origin, looking along z."""
    name = source.path.stem if source.path else "camera"
    sensor = ElementTree.Element("sensor", {"label": name, "type": (root.findtext("projection") or "frame").strip()})
    sides = {side: (root.findtext(side) or "").strip() for side in ("width", "height")}
    sensor.extend([ElementTree.Element("resolution", sides), root])
    plane, lens, notes = _plane(sensor, options)
    pinhole, more = axes.pinhole(axes.of_opencv(np.eye(4)), plane, f"camera {checks.quoted(name)}")
    note = "The calibration has no pose: the camera stands at the origin and looks along z, y down"
    return Camera(name, pinhole, True, (*notes, note, *more), lens=lens)


def _transform(camera: ElementTree.Element) -> str | None:
    """The numbers of the camera's own transform as they stand there; None if it has none."""
    return camera.findtext("transform", "").strip() or None


def _on_rig(sensor: ElementTree.Element, what: str) -> np.ndarray:
    """4 × 4, from the axes of a rig's sensor to those of its master."""
    if sensor.find("rotation") is None and sensor.find("location") is None:
        raise InputError(f"{what} is of a rig and has no pose, and where its sensor stands there is not said: export it again")
    matrix = np.eye(4)
    turn = flat(f"the rotation of {what} on its rig", sensor.findtext("rotation") or "1 0 0 0 1 0 0 0 1")
    place = flat(f"the location of {what} on its rig", sensor.findtext("location") or "0 0 0")
    if len(turn) != 9 or len(place) != 3:
        raise InputError(f"where {what} stands on its rig should be 9 and 3 numbers: export the XML again")
    matrix[:3, :3], matrix[:3, 3] = np.array(turn).reshape(3, 3), place
    return matrix


def _placed(transform: ElementTree.Element | None, what: str) -> np.ndarray:
    matrix = np.eye(4)
    if transform is None:
        return matrix
    parts = {
        child.tag: flat(f"the {child.tag} of {what}", child.text or "") for child in transform if (child.text or "").strip()
    }
    scale = parts.get("scale", (1.0,))[0]
    turn = parts.get("rotation", tuple(np.eye(3).flat))
    moved = parts.get("translation", (0.0, 0.0, 0.0))
    if len(turn) != 9 or len(moved) != 3 or not scale > 0:
        raise InputError(f"the transform of {what} should have 9, 3 and 1 numbers above 0: export the XML again")
    matrix[:3, :3] = scale * np.array(turn).reshape(3, 3)
    matrix[:3, 3] = moved
    return matrix


def _without_scale(matrix: np.ndarray) -> np.ndarray:
    matrix = matrix.copy()
    size = abs(float(np.linalg.det(matrix[:3, :3]))) ** (1 / 3)
    if 1e-100 < size < 1e100:
        matrix[:3, :3] /= size
    return matrix


def _plane(sensor: ElementTree.Element, options: Options) -> tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]:
    what = f"sensor {checks.quoted(sensor.get('label') or sensor.get('id'))}"
    if sensor.get("type", "frame") not in ("frame", "fisheye"):
        not_a_pinhole(what, f"of the type {checks.quoted(sensor.get('type'))}")
    calibrations = [each for each in sensor.findall("calibration") if each.find("f") is not None]
    adjusted = [each for each in calibrations if each.get("class") == "adjusted"] or calibrations
    if not adjusted and sensor.find("calibration/fx") is not None:
        raise InputError(f"{what} is from before Metashape 1.2, whose numbers mean something else: export it with a newer one")
    if not adjusted:
        raise InputError(f"{what} has no calibration: align the photos in Metashape first")
    calibration = adjusted[-1]
    resolution = calibration.find("resolution")
    resolution = sensor.find("resolution") if resolution is None else resolution
    if resolution is None:
        raise InputError(f"{what} has no resolution: export the XML again")
    width, height = (pixels(f"the {side} of {what}", resolution.get(side)) for side in ("width", "height"))
    values: dict[str, float] = {}
    for child in calibration:
        if child.tag in _NUMBERS:
            values[child.tag] = number(f"{child.tag} of {what}", (child.text or "").strip())
    focal = values.get("f", 0.0)
    if not (focal > 0 and focal + values.get("b1", 0.0) > 0):
        raise InputError(f"{what} has the focal length {focal:g}: give one above 0")
    across = focal + values.get("b1", 0.0)
    plane = axes.view_plane(
        across, focal, width / 2 + values.get("cx", 0.0), height / 2 + values.get("cy", 0.0), (width, height)
    )
    if any(map(values.get, ("p1", "p2"))) and any(map(values.get, ("p3", "p4"))) and not options.without_distortion:
        raise NoPinholeError(f"{what} has the tangential distortion p3 and p4, which is not read: align it again without these")
    bent = {name: values[name] for name in (*_LENS, "b2") if name in values}
    lens = distortion.opencv(
        {
            **{name: bent.get(name, 0.0) for name in ("k1", "k2", "k3")},
            "r8": bent.get("k4", 0.0),
            "p1": bent.get("p2", 0.0),
            "p2": bent.get("p1", 0.0),
        },
        bent,
        skew=bent.get("b2", 0.0) / across,
    )
    if sensor.get("type") == "fisheye":
        lens = dataclasses.replace(lens, projection="equidistant")
    return plane, *distortion.settle(lens, plane, what, options.without_distortion)
