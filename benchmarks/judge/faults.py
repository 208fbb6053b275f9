"""A small room, and faults that a renderer could have: of the scene that it renders, or of the picture that it made of it.

The room is a scene file as a dict, and a fault changes a copy of it: the picture is traced of the changed one and judged
against the true one. Or a fault changes passes that were traced rightly.
"""

import copy
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SIZE = 64, 48
_DISTANCE = 70.0

Document = dict
Passes = dict[str, NDArray[np.float32]]


@dataclass(frozen=True)
class Fault:
    """A fault that is put into a scene or a picture, so that the judge has to find it.

    family : the chart that it stands in.
    name : in words.
    of_scene : a function that changes the scene.
    of_picture : a function that changes the passes, with a generator.
    """

    family: str
    name: str
    of_scene: Callable[[Document], None] | None = None
    of_picture: Callable[[Passes, np.random.Generator], None] | None = None


def room() -> Document:
    """Balls and a tent on a floor before a wall, an area lamp and a sun."""
    gray = {"diffuse": [0.6, 0.6, 0.6]}
    return {
        "format": "virtual-pinhole-scene",
        "version": 1,
        "camera": {
            "eye": [3.0, -7.0, 3.0],
            "look_at": [0.0, 0.0, 1.0],
            "up": [0.0, 0.0, 1.0],
            "distance": _DISTANCE,
            "width": SIZE[0],
            "height": SIZE[1],
            "principal_point": [SIZE[0] / 2, SIZE[1] / 2],
        },
        "geometries": {
            "floor": {"type": "plane", "corner": [-6, -6, 0], "edges": [[12, 0, 0], [0, 12, 0]]},
            "wall": {"type": "plane", "corner": [-6, 3, 0], "edges": [[12, 0, 0], [0, 0, 6]]},
            "ball": {"type": "spheres", "centers": [[0, 0, 0]], "radii": [1]},
            "tent": {
                "type": "mesh",
                "vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 1.5]],
                "triangles": [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
            },
        },
        "objects": [
            {"name": "floor", "geometry": "floor", "object_index": 1, "materials": ["gray"]},
            {"name": "wall", "geometry": "wall", "object_index": 2, "materials": ["red"]},
            {"name": "ball", "geometry": "ball", "object_index": 3, "materials": ["blue"], "location": [-1.2, 0, 1]},
            {"name": "tent", "geometry": "tent", "object_index": 4, "materials": ["gray"], "location": [1.5, -0.5, 0]},
        ],
        "materials": {"gray": gray, "red": {"diffuse": [0.7, 0.3, 0.2]}, "blue": {"diffuse": [0.2, 0.4, 0.8]}},
        "lamps": [
            {"type": "area", "name": "panel", "location": [0, -1, 5], "size": [2, 2], "power": [300, 300, 300]},
            {"type": "sun", "name": "sun", "towards": [1, -1, 1.5], "irradiance": [1, 1, 0.9], "angle": 0.1},
        ],
        "world": {"radiance": [0.1, 0.12, 0.15]},
        "bounces": {"total": 3, "diffuse": 3},
    }


def changed(fault: Fault) -> Document:
    """The room with the fault, if it is one of the scene."""
    document = copy.deepcopy(room())
    if fault.of_scene:
        fault.of_scene(document)
    return document


def _camera(family: str, name: str, change: Callable[[Document], None]) -> Fault:
    return Fault(family, name, lambda document: change(document["camera"]))


def _add(key: str, place: int, amount: float) -> Callable[[Document], None]:
    def change(holder: Document) -> None:
        holder[key][place] += amount

    return change


def _scaled(key: str, factor: float) -> Callable[[Document], None]:
    def change(holder: Document) -> None:
        value = holder[key]
        holder[key] = [each * factor for each in value] if isinstance(value, list) else value * factor

    return change


def _of(kind: str, place: int, change: Callable[[Document], None]) -> Callable[[Document], None]:
    return lambda document: change(document[kind][place])


def _put(key: str, value: object) -> Callable[[Document], None]:
    return lambda holder: holder.__setitem__(key, value)


def _light(change: Callable[[NDArray], NDArray]) -> Callable[[Passes, np.random.Generator], None]:
    """A fault that changes the colors of Combined."""

    def of_picture(passes: Passes, _: np.random.Generator) -> None:
        passes["Combined"][..., :3] = change(passes["Combined"][..., :3])

    return of_picture


def _whole(change: Callable[[NDArray], NDArray]) -> Callable[[Passes, np.random.Generator], None]:
    """A fault that changes all passes alike."""

    def of_picture(passes: Passes, _: np.random.Generator) -> None:
        for name in passes:
            passes[name] = np.ascontiguousarray(change(passes[name]))

    return of_picture


def _pixel(value: float) -> Callable[[Passes, np.random.Generator], None]:
    def of_picture(passes: Passes, rng: np.random.Generator) -> None:
        passes["Combined"][rng.integers(SIZE[1]), rng.integers(SIZE[0]), :3] = value

    return of_picture


def _tile(change: Callable[[NDArray], NDArray]) -> Callable[[Passes, np.random.Generator], None]:
    def of_picture(passes: Passes, rng: np.random.Generator) -> None:
        row, column = rng.integers(SIZE[1] - 8), rng.integers(SIZE[0] - 8)
        tile = passes["Combined"][row : row + 8, column : column + 8, :3]
        tile[:] = change(tile)

    return of_picture


def _encoded(linear: NDArray) -> NDArray:
    return np.maximum(linear, 0) ** np.float32(1 / 2.2)


def _blurred(color: NDArray) -> NDArray:
    around = np.pad(color, ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = color.shape[:2]
    return sum(around[i : i + height, j : j + width] for i in range(3) for j in range(3)) / np.float32(9)


_FLOOR, _WALL, _BALL, _TENT = range(4)
_PANEL, _SUN = range(2)

FAULTS = (
    *(_camera("camera", f"shifted by {by} px to the right", _add("principal_point", 0, by)) for by in (0.01, 0.1, 0.3, 1.0)),
    *(_camera("camera", f"shifted by {by} px upwards", _add("principal_point", 1, by)) for by in (0.01, 0.1, 0.5)),
    *(_camera("camera", f"{by:g} of the field of view", _scaled("distance", 1 + by)) for by in (3e-4, 1e-3, 1e-2)),
    *(_camera("camera", f"rolled by {by:g} rad", _add("up", 0, by)) for by in (3e-4, 1e-3, 1e-2)),
    *(_camera("camera", f"turned aside by {by:g}", _add("look_at", 0, by)) for by in (1e-3, 1e-2)),
    *(_camera("camera", f"moved by {by:g}", _add("eye", 2, by)) for by in (1e-3, 1e-2)),
    *(
        Fault("geometry", f"the ball moved by {by:g}", _of("objects", _BALL, _add("location", 0, by)))
        for by in (1e-3, 1e-2, 1e-1)
    ),
    *(Fault("geometry", f"the tent sunk by {by:g}", _of("objects", _TENT, _add("location", 2, -by))) for by in (1e-3, 1e-2)),
    *(Fault("geometry", f"the ball {by:g} larger", _of("objects", _BALL, _put("scale", 1 + by))) for by in (1e-3, 1e-2)),
    *(Fault("geometry", f"the tent turned by {by:g}°", _of("objects", _TENT, _put("rotation", [0, 0, by]))) for by in (0.1,)),
    Fault("geometry", "the ball's index is another's", _of("objects", _BALL, _put("object_index", 4))),
    Fault("geometry", "the tent is missing", lambda document: document["objects"].pop(_TENT)),
    Fault("geometry", "a face is missing", lambda document: document["geometries"]["tent"]["triangles"].pop(0)),
    Fault(
        "geometry",
        "a vertex moved by 0.01",
        lambda document: document["geometries"]["tent"]["vertices"][4].__setitem__(2, 1.51),
    ),
    Fault(
        "geometry", "the wall is 0.01 farther", lambda document: document["geometries"]["wall"]["corner"].__setitem__(1, 3.01)
    ),
    *(Fault("light", f"the lamp {by:.1%} dimmer", _of("lamps", _PANEL, _scaled("power", 1 - by))) for by in (0.01, 0.03, 0.1)),
    *(Fault("light", f"the sun {by:.1%} brighter", _of("lamps", _SUN, _scaled("irradiance", 1 + by))) for by in (0.01,)),
    Fault("light", "the sun is a fifth wider", _of("lamps", _SUN, _put("angle", 0.12))),
    Fault("light", "the sun is bluish by 5 %", _of("lamps", _SUN, _put("irradiance", [1, 1, 0.945]))),
    *(Fault("light", f"the lamp moved by {by:g}", _of("lamps", _PANEL, _add("location", 0, by))) for by in (0.03, 0.3)),
    Fault("light", "the lamp casts no shadow", _of("lamps", _PANEL, _put("casts_shadow", False))),
    Fault("light", "the ball casts no shadow", _of("objects", _BALL, _put("hidden_from", ["shadow"]))),
    Fault("light", "the world 3 % dimmer", lambda document: _scaled("radiance", 0.97)(document["world"])),
    Fault("light", "one bounce fewer", _put("bounces", {"total": 2, "diffuse": 2})),
    Fault("light", "two bounces fewer", _put("bounces", {"total": 1, "diffuse": 1})),
    Fault(
        "light", "the wall's red 2 % darker", lambda document: document["materials"]["red"].update(diffuse=[0.686, 0.3, 0.2])
    ),
    Fault("light", "light over π", _put("film", {"exposure": 1 / np.pi})),
    Fault("picture", "a box in place of the filter", _put("film", {"filter": "BOX"})),
    Fault("picture", "the filter a quarter wider", _put("film", {"filter_width": 1.875})),
    Fault("picture", "exposed by 0.5 % more", _put("film", {"exposure": 1.005})),
    Fault("picture", "a tile lost", of_picture=_tile(lambda tile: 0 * tile)),
    Fault("picture", "a tile 5 % brighter", of_picture=_tile(lambda tile: np.float32(1.05) * tile)),
    Fault("picture", "color management twice", of_picture=_light(_encoded)),
    Fault("picture", "clamped at 0.8", of_picture=_light(lambda color: np.minimum(color, np.float32(0.8)))),
    Fault("picture", "red and blue exchanged", of_picture=_light(lambda color: color[..., ::-1].copy())),
    Fault("picture", "blurred over 3 × 3 pixels", of_picture=_light(_blurred)),
    Fault("picture", "a pixel that is no number", of_picture=_pixel(np.nan)),
    Fault("picture", "a black pixel", of_picture=_pixel(0.0)),
    Fault("picture", "a firefly", of_picture=_pixel(30.0)),
    Fault("picture", "upside down", of_picture=_whole(lambda values: values[::-1])),
    Fault("picture", "mirrored", of_picture=_whole(lambda values: values[:, ::-1])),
    Fault("picture", "a pixel to the side", of_picture=_whole(lambda values: np.roll(values, 1, axis=1))),
)
FAMILIES = tuple(dict.fromkeys(fault.family for fault in FAULTS))
