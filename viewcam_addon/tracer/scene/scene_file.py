"""Scenes as files: JSON that a hand can write, and beside it an .npz for large arrays. docs/scene-file.md describes the format.

Reading trusts nothing: every key is known, of its type and finite, or a sentence says which one is not. Nothing in a file is
executed (no pickle), and no path leaves the file's folder. All of light may be left out; each value of it that is what it would
be without is left out when a scene is written. Angles are in radians: a file must give back the last bit of them, which degrees
can't. Rejected: glTF and USD (no spheres, no principal point, no pass indices, and float32 positions), and arrays as base64 in
the JSON (no hand writes them, and they take a third more).
"""

import dataclasses
import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import checks, npy
from ...checks import quoted
from ...errors import InputError
from ...files import is_replaced, read_bytes, written_whole
from ...pinhole import Pinhole
from . import LedgerEntry, Mesh, Object, Scene, Spheres, fields, lamps, value_nodes
from .colors import RGBE, TEXELS
from .fields import Arrays, Field, arrays_beside
from .film import Bounces, Film
from .lamps import Lamp, World
from .materials import COMPONENTS, Color, Material, Picture, sum_of
from .shader_nodes import KINDS, MOST_DEEP, Node

LARGEST_INLINE = 48  # numbers: a plane or a few spheres stay readable in the JSON


def geometry_document(geometry: Mesh | Spheres, prefix: str, arrays: dict[str, NDArray]) -> dict:
    """The JSON of a geometry; large arrays go into `arrays`, under keys that begin with the prefix."""
    document: dict = {"type": "mesh" if isinstance(geometry, Mesh) else "spheres"}
    for field in dataclasses.fields(geometry):
        array = getattr(geometry, field.name)
        if isinstance(array, dict):
            named = {
                name: array_document(values, f"{prefix}.attribute{number}", arrays)
                for number, (name, values) in enumerate(array.items())
            }
            document |= {field.name: named} if named else {}
        elif array is not None:
            document[field.name] = array_document(array, f"{prefix}.{field.name}", arrays)
    return document


def array_document(array: NDArray, key: str, arrays: dict[str, NDArray]) -> list | dict:
    """A small array itself, or where a large one stands."""
    if array.size <= LARGEST_INLINE:
        return array.tolist()
    arrays[key] = array
    return {"npz": key}


def geometry(field: Field, arrays: Arrays) -> Mesh | Spheres:
    """The geometry that a field holds."""
    kind = field.fields(("type",), others=True)["type"]
    readers: dict[str, Callable[[Field, Arrays], Mesh | Spheres]] = {"mesh": _mesh, "spheres": _spheres, "plane": _plane}
    if kind.text() not in readers:
        kind.fail(f"is {quoted(kind.value)}: give one of {', '.join(readers)}")
    return field.build(readers[kind.text()], field, arrays)


def _mesh(field: Field, arrays: Arrays) -> Mesh:
    of_corners = {"corner_normals": 3, "corner_uvs": 2, "corner_colors": 3}
    keys = field.fields(("type", "vertices", "triangles"), ("materials", "attributes", *of_corners))
    triangles = keys["triangles"].array(arrays, np.int32, (None, 3))
    count = len(triangles)
    return Mesh(
        vertices=keys["vertices"].array(arrays, np.float64, (None, 3)),
        triangles=triangles,
        materials=_materials(keys, arrays, count),
        attributes={
            name: each.array(arrays, np.float32, (count, 3, None))
            for name, each in (keys["attributes"].named("attribute").items() if "attributes" in keys else ())
        },
        **{key: keys[key].array(arrays, np.float32, (count, 3, width)) for key, width in of_corners.items() if key in keys},
    )


def _spheres(field: Field, arrays: Arrays) -> Spheres:
    keys = field.fields(("type", "centers", "radii"), ("materials",))
    centers = keys["centers"].array(arrays, np.float64, (None, 3))
    radii = keys["radii"].array(arrays, np.float64, (len(centers),))
    return Spheres(centers, radii, _materials(keys, arrays, len(centers)))


def _plane(field: Field, arrays: Arrays) -> Mesh:
    """The parallelogram from a corner along two edges, with a UV map that runs from 0 to 1 along them."""
    keys = field.fields(("type", "corner", "edges"))
    corner = np.array(keys["corner"].vector(3))
    first, second = keys["edges"].array(arrays, np.float64, (2, 3))
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    uvs = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    return Mesh(
        vertices=np.stack([corner, corner + first, corner + first + second, corner + second]),
        triangles=triangles,
        materials=np.zeros(2, np.int32),
        corner_uvs=uvs[triangles],
    )


def _materials(keys: dict[str, Field], arrays: Arrays, count: int) -> NDArray[np.int32]:
    return keys["materials"].array(arrays, np.int32, (count,)) if "materials" in keys else np.zeros(count, np.int32)


_LIGHT_KEYS = ("images", "materials", "lamps", "world", "film", "bounces", "cycles")

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


def _light(fields: dict[str, Field], arrays: Arrays) -> dict[str, Any]:
    """The arguments of `Scene` that those of `_LIGHT_KEYS` among the fields give."""
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
    first, second = map(int, field.text().split("."))
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
            return value.image if isinstance(value, Color) else value
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
    return field.build(Picture, pixels, keys["srgb"].truth() if "srgb" in keys else False)


def _material(field: Field) -> Material:
    """A tree of nodes, or components, which are read as one."""
    keys = field.fields((), (*COMPONENTS, "ior", "surface", "transparent_shadow", "displacement"))
    stated: dict[str, Any] = {name: _color(keys[name]) for name in COMPONENTS if name in keys}
    beside = [name for name, color in stated.items() if not color.is_black]
    if "surface" in keys and beside:
        field.fail(f"has a surface beside {', '.join(beside)}: give one or the other")
    if "ior" in keys:
        stated["ior"] = keys["ior"].number()
    trees: dict[str, Any] = {name: _node(keys[name]) for name in ("surface", "displacement") if name in keys}
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
    known = KINDS[kind.text()]
    keys = field.fields(("type",), tuple(known.inputs))
    stated = [
        (name, _node_input(keys[name], default, known.is_value, deep)) for name, default in known.inputs.items() if name in keys
    ]
    return field.build(Node, kind.text(), tuple(stated))


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
    return field.build(
        Color,
        rgb=keys["rgb"].vector(3) if "rgb" in keys else _WHITE,
        image=keys["image"].text() if "image" in keys else None,
        closest=keys["closest"].truth() if "closest" in keys else False,
        vertex=keys["vertex"].truth() if "vertex" in keys else False,
    )


def _lamp(field: Field) -> Lamp:
    kind = field.fields(("type", "name"), others=True)["type"]
    if kind.text() not in lamps.KINDS:
        kind.fail(f"is {quoted(kind.value)}: give one of {', '.join(lamps.KINDS)}")
    lamp = lamps.KINDS[kind.text()]
    declared = [each.name for each in dataclasses.fields(lamp) if each.name not in ("name", "matrix")]
    is_placed = len(declared) + 1 < len(dataclasses.fields(lamp))
    keys = field.fields(("type", "name"), (*declared, *(fields.PLACE_KEYS if is_placed else ())))
    values = _values(lamp, {name: keys[name] for name in declared if name in keys})
    if is_placed:
        values["matrix"] = fields.matrix(field, keys)
    return field.build(lamp, keys["name"].text(), **values)


def _simple(kind: type, field: Field, without: tuple[str, ...] = ()) -> Any:
    """A World, Film or Bounces."""
    keys = field.fields((), tuple(each.name for each in dataclasses.fields(kind) if each.name not in without))
    return field.build(kind, **_values(kind, keys))


def _values(kind: type, keys: dict[str, Field]) -> dict[str, Any]:
    """The values that `values.value` declares, as it says that they are read."""
    read = {each.name: each.metadata["read"] for each in dataclasses.fields(kind) if each.name in keys}
    return {name: _value(field, *read[name]) for name, field in keys.items()}


def _value(field: Field, reader: str, *arguments: Any) -> Any:
    if reader == "node":
        return _node(field)
    if reader == "names":
        return names(field, *arguments)
    if reader == "backdrop":
        return _simple(World, field, without=("hidden_from", "backdrop"))
    return getattr(field, reader)(*arguments)


FORMAT = "virtual-pinhole-scene"
VERSION = 1

_LIST_OF_NUMBERS = re.compile(r"\[\n([-+.,\deE\s]*?)\n\s*\]")  # no text is met: in JSON it can't hold a line feed


def write(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene to `path` (.json), and its large arrays to the .npz of the same name beside it; both whole or not at all.

    Raises InputError if the folder can't be written or the disk is full, or if arrays can't stand beside `path`.
    """
    path = Path(path)
    arrays: dict[str, NDArray] = {}
    document = _document(scene, arrays)
    arrays_path = path.with_suffix(".npz")
    if arrays_path == path:
        raise InputError(f"{path} is where this scene's arrays stand: give the name of a file that ends in .json")
    if arrays and not is_replaced(path):
        raise InputError(f"{path} is no file, and this scene has arrays that stand in one beside it: give the name of a file")
    if arrays:
        document["arrays"] = arrays_path.name
    text = json.dumps(document, indent=1, allow_nan=False)
    text = _LIST_OF_NUMBERS.sub(lambda match: "[" + " ".join(match[1].split()) + "]", text)
    with written_whole(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8", newline="\n")
        if arrays:
            with written_whole(arrays_path) as temporary_arrays:
                npy.write_archive(temporary_arrays, arrays)


def read(path: str | os.PathLike[str]) -> Scene:
    """Read a scene from its file.

    Raises InputError if there is no such file, or if a key in it is missing, unknown, of the wrong type or out of range; it
    names the key.
    """
    path = Path(path)
    document = Field(_parsed(path), "the scene", path.name)
    header = document.fields(("format", "version"), others=True)
    if header["format"].text() != FORMAT:
        header["format"].fail(f"is not {FORMAT!r}: this is no scene file")
    if header["version"].whole(0) != VERSION:
        header["version"].fail(f"is {header['version'].value}, and this program reads {VERSION}: write the scene again")
    fields = document.fields(
        ("format", "version", "camera", "geometries", "objects"),
        ("stated_camera", "clip", "origin", *_LIGHT_KEYS, "ledger", "arrays"),
    )
    with arrays_beside(path, fields.get("arrays")) as arrays:
        geometries = {name: geometry(field, arrays) for name, field in fields["geometries"].named("geometry").items()}
        light = _light(fields, arrays)
        objects = tuple(_object(field, arrays) for field in fields["objects"].items("object"))
    return document.build(
        Scene,
        camera=_camera(fields["camera"]),
        geometries=geometries,
        objects=objects,
        stated_camera=_camera(fields["stated_camera"]) if "stated_camera" in fields else None,
        clip=_clip(fields["clip"]) if "clip" in fields else (0.0, float("inf")),
        ledger=tuple(map(_ledger_entry, fields["ledger"].items("ledger entry"))) if "ledger" in fields else (),
        origin=fields["origin"].vector(3) if "origin" in fields else (0.0, 0.0, 0.0),
        **light,
    )


def _document(scene: Scene, arrays: dict[str, NDArray]) -> dict:
    """The scene as JSON has it; large arrays go into `arrays`."""
    document = {"format": FORMAT, "version": VERSION, "camera": dataclasses.asdict(scene.camera)}
    if scene.stated_camera is not None:
        document["stated_camera"] = dataclasses.asdict(scene.stated_camera)
    start, end = scene.clip
    document["clip"] = [start, end if np.isfinite(end) else None]
    if any(scene.origin):
        document["origin"] = list(scene.origin)
    document["geometries"] = {
        name: geometry_document(each, str(index), arrays) for index, (name, each) in enumerate(scene.geometries.items())
    }
    document["objects"] = [_object_document(placed, str(index), arrays) for index, placed in enumerate(scene.objects)]
    document.update(light_document(scene, arrays))
    document["ledger"] = [dataclasses.asdict(entry) for entry in scene.ledger]
    return document


def _object_document(placed: Object, prefix: str, arrays: dict[str, NDArray]) -> dict:
    is_one = placed.matrix.ndim == 2
    document = {
        "name": placed.name,
        "geometry": placed.geometry,
        **(
            {"matrix": placed.matrix.tolist()}
            if is_one
            else {"matrices": array_document(placed.matrix, f"object {prefix}.matrices", arrays)}
        ),
        "object_index": int(placed.object_index),
        "material_indices": [int(index) for index in placed.material_indices],
    }
    if any(placed.materials):
        document["materials"] = list(placed.materials)
    if placed.hidden_from:
        document["hidden_from"] = sorted(placed.hidden_from)
    if placed.color != Object.color:
        document["color"] = list(placed.color)
    if placed.random is not None:
        document["random"] = array_document(placed.random, f"object {prefix}.random", arrays)
    links = {"receivers": placed.receivers, "blockers": placed.blockers}
    document |= {key: sorted(names) for key, names in links.items() if names is not None}
    return document


def _parsed(path: Path) -> object:
    """The JSON of a file, without NaN and without keys that appear twice."""

    def unique(pairs: list[tuple[str, object]]) -> dict:
        table = {}
        for key, value in pairs:
            if key in table:
                raise InputError(f"{path.name}: the key {checks.quoted(key)} appears twice in one object: remove one")
            table[key] = value
        return table

    def finite(name: str) -> float:
        raise InputError(f"{path.name}: {name} is no number that a scene can hold: give a finite one")

    try:
        text = read_bytes(path).decode("utf-8")
        document = json.loads(text, object_pairs_hook=unique, parse_constant=finite, parse_int=checks.whole_of_json)
        if r"\ud" in text.lower():
            json.dumps(document, ensure_ascii=False).encode()  # half a character, which only JSON can write, is no text
        return document
    except FileNotFoundError as error:
        raise InputError(f"{path} does not exist: check the name of the scene file") from error
    except OSError as error:
        raise InputError(f"{path} can't be read ({error.strerror}): check the name of the scene file") from error
    except json.JSONDecodeError as error:
        raise InputError(f"{path.name}: line {error.lineno} is not JSON ({error.msg}): correct it") from error
    except RecursionError as error:
        raise InputError(f"{path.name}: its JSON nests lists or objects too deep: give a scene file") from error
    except UnicodeError as error:
        raise InputError(f"{path.name}: this is no JSON text: give a scene file") from error


def _camera(field: Field) -> Pinhole:
    keys = field.fields(("eye", "look_at", "up", "distance", "width", "height"), ("principal_point", "mirrored"))
    distance = keys["distance"]
    return field.build(
        Pinhole,
        eye=keys["eye"].vector(3),
        look_at=keys["look_at"].vector(3),
        up=keys["up"].vector(3),
        distance=distance.vector(2) if isinstance(distance.value, list) else distance.number(),
        width=keys["width"].whole(1),
        height=keys["height"].whole(1),
        principal_point=keys["principal_point"].vector(2) if "principal_point" in keys else None,
        mirrored=keys["mirrored"].truth() if "mirrored" in keys else False,
    )


def _clip(field: Field) -> tuple[float, float]:
    start, end = field.items("bound", 2)
    return start.number(), float("inf") if end.value is None else end.number()


def _object(field: Field, arrays: Arrays) -> Object:
    links = ("receivers", "blockers")
    optional = ("matrices", "object_index", "material_indices", "materials", "hidden_from", "color", "random", *links)
    keys = field.fields(("name", "geometry"), (*fields.PLACE_KEYS, *optional))
    if "matrices" not in keys:
        matrix = fields.matrix(field, keys)
    elif any(key in keys for key in fields.PLACE_KEYS):
        field.fail("has matrices beside a matrix, location, rotation or scale: give one or the other")
    else:
        matrix = keys["matrices"].array(arrays, np.float64, (None, 4, 4))
    indices = keys["material_indices"].items("material index") if "material_indices" in keys else None
    try:
        return Object(
            name=keys["name"].text(),
            geometry=keys["geometry"].text(),
            matrix=matrix,
            object_index=keys["object_index"].whole(0) if "object_index" in keys else 0,
            material_indices=(0,) if indices is None else tuple(index.whole(0) for index in indices),
            materials=tuple(each.text() for each in keys["materials"].items("material")) if "materials" in keys else (),
            hidden_from=names(keys["hidden_from"], "kind of ray") if "hidden_from" in keys else frozenset(),
            color=keys["color"].vector(4) if "color" in keys else Object.color,
            random=keys["random"].array(arrays, np.float32, (None,)) if "random" in keys else None,
            **{key: names(keys[key], "object's name") for key in links if key in keys},
        )
    except InputError as error:
        field.hand_on(error)


def _ledger_entry(field: Field) -> LedgerEntry:
    keys = field.fields(("object", "status"), ("reason",))
    return LedgerEntry(keys["object"].text(), keys["status"].text(), keys["reason"].text() if "reason" in keys else "")
