"""After Effects' cameras as the scripts (.jsx) have them that Blender's add-on *Export: Adobe After Effects* writes.

A camera has `position` and `zoom` in pixels and `orientation`, the degrees of Rx Ry Rz, camera to composition with x right, y
down, z into the view. The composition's middle is the origin here, where the add-on puts Blender's; its y points down and its
unit stays, 100 of which the add-on makes of a meter. The zoom is the view-plane distance, the composition's size that of the
picture. A property has one value or keyframes; a value holds until the next one, since the add-on writes each frame at which
it changes.

Nothing is run: the script's calls are found by their form. Left out: scripts of the add-on's first versions, with a point of
interest and rotations, and keyframes that After Effects copies as text, in which nobody was seen to publish a camera.

Source: blender-addons' io_export_after_effects.py (convert_transform_matrix, convert_lens, CameraExport).
"""

import re

import numpy as np

from ..errors import InputError, counted
from ..rotation import from_euler
from . import axes
from .camera import Camera, Options
from .source import Source, flat, number

TITLE = "After Effects' script of Blender's add-on (.jsx)"

_NUMBER = r"[-+]?[\d.]+(?:[eE][-+]?\d+)?"
_COMPOSITION = re.compile(rf"\.addComp\([^;\n]{{0,200}}?,\s*(\d{{1,6}}),\s*(\d{{1,6}}),\s*({_NUMBER})\s*,")
_CAMERA = re.compile(r"^\s*var (\w{1,200}) = \w{1,200}\.layers\.addCamera\(", re.MULTILINE)
_PROPERTY = re.compile(r"^\s*(\w{1,200})\.property\(\"(\w{1,40})\"\)\.setValue(sAtTimes)?\(([^;\n]*)\);", re.MULTILINE)
_BRACKETS = str.maketrans("[]", "  ")
_SIZES = {"position": 3, "orientation": 3, "zoom": 1}
_UNITS = "After Effects counts in pixels, y down: with the axes y_down and a scale of 0.01 they are Blender's as exported"


def recognizes(source: Source) -> bool:
    return "addCamera(" in source.text and bool(_COMPOSITION.search(source.text)) and bool(_CAMERA.search(source.text))


def read(source: Source, options: Options) -> list[Camera]:
    composition = _COMPOSITION.search(source.text)
    if composition is None:
        raise InputError(f"{source.name} has no composition: export it again")
    width, height, aspect = composition.groups()
    size = int(width), int(height)
    if number("the aspect of the composition's pixels", aspect) != 1:
        raise InputError(f"the composition's pixels have the aspect {aspect}: export it with square pixels")
    notes = () if options.axes == "y_down" else (_UNITS,)
    names = _CAMERA.findall(source.text)
    values: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {name: {} for name in names}
    for name, key, times, arguments in _PROPERTY.findall(source.text):
        if name in values:
            if key in ("rotationX", "rotationY", "rotationZ", "pointOfInterest"):
                raise InputError(f"{name} has {key}, as in scripts of the add-on's first versions: export it again")
            if key in _SIZES:
                values[name][key] = _values(f"{key} of {name}", arguments, bool(times), _SIZES[key])
    return [camera for name in values for camera in _cameras(name, values[name], size, notes)]


def _values(what: str, arguments: str, animated: bool, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The times (n) and values (n, count) of a call's arguments."""
    head, _, rest = arguments.partition("],") if animated else ("0", "", arguments)
    times, numbers = (np.array(flat(what, part.translate(_BRACKETS).strip(" ,"))) for part in (head, rest))
    if not len(times) or len(numbers) != count * len(times):
        has = f"{counted(len(times), 'time')} and {counted(len(numbers), 'number')}"
        raise InputError(f"{what} has {has}: give {count} for each")
    return times, numbers.reshape(-1, count)


def _cameras(
    name: str, keyed: dict[str, tuple[np.ndarray, np.ndarray]], size: tuple[int, int], notes: tuple[str, ...]
) -> list[Camera]:
    """The camera at each of its keyframes."""
    if missing := [key for key in _SIZES if key not in keyed]:
        raise InputError(f"{name} has no {missing[0]}: it can't be a camera without")
    times = sorted({time for keys, _ in keyed.values() for time in keys.tolist()})
    cameras = []
    for index, time in enumerate(times):
        place, angles, (zoom,) = (values[max(np.searchsorted(keys, time, "right") - 1, 0)] for keys, values in keyed.values())
        if not zoom > 0:
            raise InputError(f"the zoom of {name} is {zoom:g}: give one above 0")
        turn = from_euler(np.radians(angles).tolist(), "ZYX")
        matrix = np.column_stack([turn, place - [size[0] / 2, size[1] / 2, 0]])
        plane = axes.view_plane(float(zoom), float(zoom), size[0] / 2, size[1] / 2, size)
        pinhole, more = axes.pinhole(axes.of_opencv(matrix), plane, name)
        flies = len(times) > 1
        label = f"{name} {index:05d}" if flies else name
        cameras.append(Camera(label, pinhole, True, (*notes, *more), time=time if flies else None))
    return cameras
