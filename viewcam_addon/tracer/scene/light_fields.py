"""The light of a scene file: materials, images, lamps, world, film and bounces.

All of it may be left out, and each value that is what it would be without is left out when a scene is written. Angles are in
radians: a file must give back the last bit of them, which degrees can't.
"""

import dataclasses
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks import quoted
from ...errors import InputError
from . import Scene, lamps, placing, value_nodes
from .colors import RGBE, TEXELS
from .fields import Arrays, Field
from .film import Bounces, Film
from .geometry_fields import LARGEST_INLINE, array_document
from .lamps import Lamp, World
from .materials import COMPONENTS, Color, Material, Picture, sum_of
from .shader_nodes import KINDS, MOST_DEEP, Node

KEYS = ("images", "materials", "lamps", "world", "film", "bounces", "cycles")

_WHITE = (1.0, 1.0, 1.0)


def light_document(scene: Scene, arrays: dict[str, NDArray]) -> dict:
    """The JSON of a scene's light; large images go into `arrays`."""
    document = {
        "images": {
            name: {
                # In lists a number is what it says.
                "pixels": array_document(
                    picture.values if picture.pixels.size <= LARGEST_INLINE else picture.pixels, f"image{index}.pixels", arrays
                ),
                **({"srgb": True} if picture.srgb else {}),
            }
            for index, (name, picture) in enumerate(scene.images.items())
        },
        "materials": {name: _material_document(material) for name, material in scene.materials.items()},
        "lamps": [{"type": lamp.kind, "name": lamp.name} | _changed(lamp) for lamp in scene.lamps],
        "world": _changed(scene.world),
        "film": _changed(scene.film),
        "bounces": _changed(scene.bounces),
        "cycles": "" if scene.cycles == Scene.cycles else ".".join(map(str, scene.cycles)),
    }
    return {key: value for key, value in document.items() if value}


def light(fields: dict[str, Field], arrays: Arrays) -> dict[str, Any]:
    """The arguments of `Scene` that those of `KEYS` among the fields give."""
    result: dict[str, Any] = {}
    if "images" in fields:
        result["images"] = {name: _picture(field, arrays) for name, field in fields["images"].named("image").items()}
    if "materials" in fields:
        result["materials"] = {name: _material(field) for name, field in fields["materials"].named("material").items()}
    if "lamps" in fields:
        result["lamps"] = tuple(_lamp(field) for field in fields["lamps"].items("lamp"))
    for key, kind in (("world", World), ("film", Film), ("bounces", Bounces)):
        if key in fields:
            result[key] = _simple(kind, fields[key])
    if "cycles" in fields:
        result["cycles"] = _version(fields["cycles"])
    return result


def _version(field: Field) -> tuple[int, int]:
    if not re.fullmatch(r"[0-9]{1,2}\.[0-9]{1,2}", field.text()):
        field.fail(f'is {quoted(field.value)}: give a version of Blender, as "5.2"')
    first, second = map(int, field.value.split("."))
    return first, second


def names(field: Field, kind: str) -> frozenset[str]:
    """A list of names of things of this kind; whether there are such is asked by what has the value."""
    return frozenset(name.text() for name in field.items(kind))


def _changed(owner: Lamp | World | Film | Bounces) -> dict[str, Any]:
    """The values that are not what they are by default."""
    changed = {}
    for each in dataclasses.fields(owner):
        value = getattr(owner, each.name)
        if each.name == "matrix":
            changed["matrix"] = value.tolist()
        elif isinstance(value, World):
            changed[each.name] = _changed(value)
        elif isinstance(value, Node):
            changed[each.name] = _node_document(value)
        elif each.name != "name" and value != each.default:
            changed[each.name] = sorted(value) if isinstance(value, frozenset) else value
    return changed


def _material_document(material: Material) -> dict[str, Any]:
    trees = ((name, getattr(material, name)) for name in ("surface", "displacement"))
    document: dict[str, Any] = {name: _node_document(tree) for name, tree in trees if tree is not None}
    return document if material.transparent_shadow else document | {"transparent_shadow": False}


def _node_document(node: Node) -> dict[str, Any]:
    def value_of(name: str, value: object) -> object:
        known = KINDS[node.type].inputs[name]
        if isinstance(value, Node):
            return _node_document(value)
        three = value.rgb if isinstance(value, Color) and value == Color(value.rgb) else value
        if isinstance(known, float) and isinstance(three, tuple) and three == (three[0],) * 3:
            return three[0]
        if known is value_nodes.IMAGE:
            return value.image
        return _color_document(value) if isinstance(value, Color) else value

    return {"type": node.type} | {name: value_of(name, value) for name, value in node.inputs}


def _color_document(color: Color) -> list[float] | dict[str, Any]:
    if color == Color(color.rgb):
        return list(color.rgb)
    document = {each.name: getattr(color, each.name) for each in dataclasses.fields(color)}
    return {key: value for key, value in document.items() if value and (key, value) != ("rgb", _WHITE)}


def _picture(field: Field, arrays: Arrays) -> Picture:
    keys = field.fields(("pixels",), ("srgb",))
    pixels = keys["pixels"].array(arrays, np.float32, (None, None, None), kept=TEXELS)
    if pixels.shape[2] not in (3, 4) and pixels.dtype != RGBE:
        keys["pixels"].fail(f"has {pixels.shape[2]} numbers a pixel and must have 3 or 4: correct it")
    try:
        return Picture(pixels, keys["srgb"].truth() if "srgb" in keys else False)
    except InputError as error:
        field.hand_on(error)


def _material(field: Field) -> Material:
    """A tree of nodes, or components, which are read as one."""
    keys = field.fields((), (*COMPONENTS, "ior", "surface", "transparent_shadow", "displacement"))
    stated: dict[str, Any] = {name: _color(keys[name]) for name in COMPONENTS if name in keys}
    beside = [name for name, color in stated.items() if not color.is_black]
    if "surface" in keys and beside:
        field.fail(f"has a surface beside {', '.join(beside)}: give one or the other")
    if "ior" in keys:
        stated["ior"] = keys["ior"].number()
    trees = {name: _node(keys[name]) for name in ("surface", "displacement") if name in keys}
    if "transparent_shadow" in keys:
        trees["transparent_shadow"] = keys["transparent_shadow"].truth()
    try:
        return dataclasses.replace(sum_of(**stated), **trees)
    except InputError as error:
        field.hand_on(error)


def _node(field: Field, deep: int = 1) -> Node:
    if deep > MOST_DEEP:
        raise InputError(f"{field.file}: more than {MOST_DEEP} nodes feed one another in a row: give fewer")
    kind = field.fields(("type",), others=True)["type"]
    if kind.text() not in KINDS:
        kind.fail(f"is {quoted(kind.value)}: give one of {', '.join(KINDS)}")
    known = KINDS[kind.value]
    keys = field.fields(("type",), tuple(known.inputs))
    try:
        stated = (
            (name, _node_input(keys[name], default, known.is_value, deep))
            for name, default in known.inputs.items()
            if name in keys
        )
        return Node(kind.value, tuple(stated))
    except InputError as error:
        field.hand_on(error)


def _node_input(field: Field, default: object, of_value: bool, deep: int) -> Any:
    is_node = isinstance(field.value, dict) and "type" in field.value
    if default is None or is_node:
        return _node(field, deep + 1)
    if isinstance(default, bool):
        return field.truth()
    if default is value_nodes.IMAGE:
        return Color(_WHITE, field.text())
    if default in (value_nodes.NAME, value_nodes.IES) or (isinstance(default, tuple) and isinstance(default[0], str)):
        return field.text()
    if isinstance(field.value, list) and of_value:
        return field.vector(3)
    return _color(field) if isinstance(field.value, list | dict) else field.number()


def _color(field: Field) -> Color:
    """Three numbers, or an object where an image or the mesh's own colors come in."""
    is_varied = isinstance(field.value, dict)
    keys = field.fields((), ("rgb", "image", "closest", "vertex")) if is_varied else {"rgb": field}
    try:
        return Color(
            rgb=keys["rgb"].vector(3) if "rgb" in keys else _WHITE,
            image=keys["image"].text() if "image" in keys else None,
            closest=keys["closest"].truth() if "closest" in keys else False,
            vertex=keys["vertex"].truth() if "vertex" in keys else False,
        )
    except InputError as error:
        field.hand_on(error)


def _lamp(field: Field) -> Lamp:
    kind = field.fields(("type", "name"), others=True)["type"]
    if kind.text() not in lamps.KINDS:
        kind.fail(f"is {quoted(kind.value)}: give one of {', '.join(lamps.KINDS)}")
    lamp = lamps.KINDS[kind.value]
    declared = [each.name for each in dataclasses.fields(lamp) if each.name not in ("name", "matrix")]
    is_placed = len(declared) + 1 < len(dataclasses.fields(lamp))
    keys = field.fields(("type", "name"), (*declared, *(placing.KEYS if is_placed else ())))
    values = _values(lamp, {name: keys[name] for name in declared if name in keys})
    if is_placed:
        values["matrix"] = placing.matrix(field, keys)
    try:
        return lamp(keys["name"].text(), **values)
    except InputError as error:
        field.hand_on(error)


def _simple(kind: type, field: Field, without: tuple[str, ...] = ()) -> Any:
    """A World, Film or Bounces."""
    keys = field.fields((), tuple(each.name for each in dataclasses.fields(kind) if each.name not in without))
    values = _values(kind, keys)
    try:
        return kind(**values)
    except InputError as error:
        field.hand_on(error)


def _values(kind: type, keys: dict[str, Field]) -> dict[str, Any]:
    """The values that `values.value` declares, as it says that they are read."""
    read = {each.name: each.metadata["read"] for each in dataclasses.fields(kind) if each.name in keys}
    return {name: _value(field, *read[name]) for name, field in keys.items()}


def _value(field: Field, how: str, *arguments: Any) -> Any:
    if how == "node":
        return _node(field)
    if how == "names":
        return names(field, *arguments)
    if how == "backdrop":
        return _simple(World, field, without=("hidden_from", "backdrop"))
    return getattr(field, how)(*arguments)
