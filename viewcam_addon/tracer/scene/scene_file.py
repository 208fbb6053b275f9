"""Scenes as files: JSON that a hand can write, and beside it an .npz for large arrays. docs/scene-file.md describes the format.

Reading trusts nothing: every key is known, of its type and finite, or a sentence says which one is not. Nothing in a file is
executed (no pickle), and no path leaves the file's folder. Rejected: glTF and USD (no spheres, no principal point, no pass
indices, and float32 positions), and arrays as base64 in the JSON (no hand writes them, and they take a third more).
"""

import dataclasses
import json
import os
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ... import checks
from ...errors import InputError
from ...files import is_replaced, read_bytes, written_whole
from ...pinhole import Pinhole
from . import LedgerEntry, Object, Scene, light_fields, placing
from .fields import Arrays, Field, arrays_beside
from .geometry_fields import array_document, geometry, geometry_document

FORMAT = "virtual-pinhole-scene"
VERSION = 1

_LIST_OF_NUMBERS = re.compile(r"\[\n([-+.,\deE\s]*?)\n\s*\]")  # no text is met: in JSON it can't hold a line feed


def write(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene to `path` (.json), and its large arrays to the .npz of the same name beside it; both whole or not at all.

    Raises
    ------
    InputError
        if the folder can't be written or the disk is full, or if arrays can't stand beside `path`.
    """
    path = Path(path)
    arrays: dict[str, NDArray] = {}
    document = _document(scene, arrays)
    arrays_path = path.with_suffix(".npz")
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
                np.savez(temporary_arrays, **arrays)


def read(path: str | os.PathLike[str]) -> Scene:
    """Read a scene.

    Raises
    ------
    InputError
        if there is no such file, or if a key in it is missing, unknown, of the wrong type or out of range; it names the key.
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
        ("stated_camera", "clip", "origin", *light_fields.KEYS, "ledger", "arrays"),
    )
    with arrays_beside(path, fields.get("arrays")) as arrays:
        geometries = {name: geometry(field, arrays) for name, field in fields["geometries"].named("geometry").items()}
        light = light_fields.light(fields, arrays)
        objects = tuple(_object(field, arrays) for field in fields["objects"].items("object"))
    try:
        return Scene(
            camera=_camera(fields["camera"]),
            geometries=geometries,
            objects=objects,
            stated_camera=_camera(fields["stated_camera"]) if "stated_camera" in fields else None,
            clip=_clip(fields["clip"]) if "clip" in fields else (0.0, float("inf")),
            ledger=tuple(_ledger_entry(field) for field in fields["ledger"].items("ledger entry"))
            if "ledger" in fields
            else (),
            origin=fields["origin"].vector(3) if "origin" in fields else (0.0, 0.0, 0.0),
            **light,
        )
    except InputError as error:
        document.hand_on(error)


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
    document.update(light_fields.light_document(scene, arrays))
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
    try:
        return Pinhole(
            eye=keys["eye"].vector(3),
            look_at=keys["look_at"].vector(3),
            up=keys["up"].vector(3),
            distance=distance.vector(2) if isinstance(distance.value, list) else distance.number(),
            width=keys["width"].whole(1),
            height=keys["height"].whole(1),
            principal_point=keys["principal_point"].vector(2) if "principal_point" in keys else None,
            mirrored=keys["mirrored"].truth() if "mirrored" in keys else False,
        )
    except InputError as error:
        field.hand_on(error)


def _clip(field: Field) -> tuple[float, float]:
    start, end = field.items("bound", 2)
    return start.number(), float("inf") if end.value is None else end.number()


def _object(field: Field, arrays: Arrays) -> Object:
    links = ("receivers", "blockers")
    optional = ("matrices", "object_index", "material_indices", "materials", "hidden_from", "color", "random", *links)
    keys = field.fields(("name", "geometry"), (*placing.KEYS, *optional))
    if "matrices" not in keys:
        matrix = placing.matrix(field, keys)
    elif any(key in keys for key in placing.KEYS):
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
            hidden_from=light_fields.names(keys["hidden_from"], "kind of ray") if "hidden_from" in keys else frozenset(),
            color=keys["color"].vector(4) if "color" in keys else Object.color,
            random=keys["random"].array(arrays, np.float32, (None,)) if "random" in keys else None,
            **{key: light_fields.names(keys[key], "object's name") for key in links if key in keys},
        )
    except InputError as error:
        field.hand_on(error)


def _ledger_entry(field: Field) -> LedgerEntry:
    keys = field.fields(("object", "status"), ("reason",))
    return LedgerEntry(keys["object"].text(), keys["status"].text(), keys["reason"].text() if "reason" in keys else "")
