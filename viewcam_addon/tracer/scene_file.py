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

from ..errors import InputError
from ..files import written_whole
from ..pinhole import Pinhole
from .fields import Arrays, Field, arrays_beside
from .scene import LedgerEntry, Mesh, Object, Scene, Spheres

FORMAT = "virtual-pinhole-scene"
VERSION = 1

_LARGEST_INLINE = 48  # numbers: a plane or a few spheres stay readable in the JSON
_LIST_OF_NUMBERS = re.compile(r"\[\n([-+.,\deE\s]*?)\n\s*\]")  # no text is met: in JSON it can't hold a line feed


def write(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene to `path` (.json), and its large arrays to the .npz of the same name beside it; both whole or not at all.

    Raises
    ------
    InputError
        if the folder can't be written or the disk is full.
    """
    path = Path(path)
    arrays: dict[str, NDArray] = {}
    document = _document(scene, arrays)
    arrays_path = path.with_suffix(".npz")
    if arrays:
        document["arrays"] = arrays_path.name
    text = json.dumps(document, indent=1, allow_nan=False)
    text = _LIST_OF_NUMBERS.sub(lambda match: "[" + " ".join(match[1].split()) + "]", text)
    with written_whole(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
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
        ("format", "version", "camera", "geometries", "objects"), ("stated_camera", "clip", "origin", "ledger", "arrays")
    )
    with arrays_beside(path, fields.get("arrays")) as arrays:
        geometries = {name: _geometry(field, arrays) for name, field in fields["geometries"].named("geometry").items()}
    objects = tuple(_object(field) for field in fields["objects"].items("object"))
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
        name: _geometry_document(geometry, str(index), arrays)
        for index, (name, geometry) in enumerate(scene.geometries.items())
    }
    document["objects"] = [
        {
            "name": placed.name,
            "geometry": placed.geometry,
            "matrix": placed.matrix.tolist(),
            "object_index": int(placed.object_index),
            "material_indices": [int(index) for index in placed.material_indices],
        }
        for placed in scene.objects
    ]
    document["ledger"] = [dataclasses.asdict(entry) for entry in scene.ledger]
    return document


def _geometry_document(geometry: Mesh | Spheres, prefix: str, arrays: dict[str, NDArray]) -> dict:
    document: dict = {"type": "mesh" if isinstance(geometry, Mesh) else "spheres"}
    for field in dataclasses.fields(geometry):
        array = getattr(geometry, field.name)
        if array is None:
            continue
        if array.size <= _LARGEST_INLINE:
            document[field.name] = array.tolist()
        else:
            key = f"{prefix}.{field.name}"
            arrays[key] = array
            document[field.name] = {"npz": key}
    return document


def _parsed(path: Path) -> object:
    """The JSON of a file, without NaN and without keys that appear twice."""

    def unique(pairs: list[tuple[str, object]]) -> dict:
        keys = [key for key, _ in pairs]
        twice = next((key for key in keys if keys.count(key) > 1), None) if len(set(keys)) < len(keys) else None
        if twice is not None:
            raise InputError(f"{path.name}: the key {twice!r} appears twice in one object: remove one")
        return dict(pairs)

    def finite(name: str) -> float:
        raise InputError(f"{path.name}: {name} is no number that a scene can hold: give a finite one")

    try:
        return json.loads(path.read_text(encoding="utf-8"), object_pairs_hook=unique, parse_constant=finite)
    except FileNotFoundError as error:
        raise InputError(f"{path} does not exist: check the name of the scene file") from error
    except OSError as error:
        raise InputError(f"{path} can't be read ({error.strerror}): check the name of the scene file") from error
    except json.JSONDecodeError as error:
        raise InputError(f"{path.name}: line {error.lineno} is not JSON ({error.msg}): correct it") from error
    except (UnicodeDecodeError, RecursionError) as error:
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


def _geometry(field: Field, arrays: Arrays) -> Mesh | Spheres:
    kind = field.fields(("type",), others=True)["type"]
    readers = {"mesh": _mesh, "spheres": _spheres, "plane": _plane}
    if kind.text() not in readers:
        kind.fail(f"is {kind.value!r}: give one of {', '.join(readers)}")
    try:
        return readers[kind.value](field, arrays)
    except InputError as error:
        field.hand_on(error)


def _mesh(field: Field, arrays: Arrays) -> Mesh:
    keys = field.fields(("type", "vertices", "triangles"), ("materials", "corner_normals", "corner_uvs"))
    triangles = keys["triangles"].array(arrays, np.int32, (None, 3))
    count = len(triangles)
    return Mesh(
        vertices=keys["vertices"].array(arrays, np.float64, (None, 3)),
        triangles=triangles,
        materials=_materials(keys, arrays, count),
        corner_normals=keys["corner_normals"].array(arrays, np.float32, (count, 3, 3)) if "corner_normals" in keys else None,
        corner_uvs=keys["corner_uvs"].array(arrays, np.float32, (count, 3, 2)) if "corner_uvs" in keys else None,
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


def _object(field: Field) -> Object:
    placing = ("location", "rotation", "scale")
    keys = field.fields(("name", "geometry"), ("matrix", *placing, "object_index", "material_indices"))
    if "matrix" in keys and any(key in keys for key in placing):
        field.fail("has a matrix beside a location, rotation or scale: give one or the other")
    matrix = keys["matrix"].array(None, np.float64, (4, 4)) if "matrix" in keys else _placed(keys)
    indices = keys["material_indices"].items("material index") if "material_indices" in keys else None
    try:
        return Object(
            name=keys["name"].text(),
            geometry=keys["geometry"].text(),
            matrix=matrix,
            object_index=keys["object_index"].whole(0) if "object_index" in keys else 0,
            material_indices=(0,) if indices is None else tuple(index.whole(0) for index in indices),
        )
    except InputError as error:
        field.hand_on(error)


def _placed(keys: dict[str, Field]) -> NDArray[np.float64]:
    """The matrix of a location, a rotation (degrees about x, then y, then z) and a scale (one number, or one for each axis)."""
    x, y, z = np.radians(keys["rotation"].vector(3) if "rotation" in keys else (0.0, 0.0, 0.0))
    about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    scale = 1.0
    if "scale" in keys:
        scale = keys["scale"].vector(3) if isinstance(keys["scale"].value, list) else keys["scale"].number()
    matrix = np.eye(4)
    matrix[:3, :3] = about_z @ about_y @ about_x * scale
    matrix[:3, 3] = keys["location"].vector(3) if "location" in keys else 0.0
    return matrix


def _ledger_entry(field: Field) -> LedgerEntry:
    keys = field.fields(("object", "status"), ("reason",))
    return LedgerEntry(keys["object"].text(), keys["status"].text(), keys["reason"].text() if "reason" in keys else "")
