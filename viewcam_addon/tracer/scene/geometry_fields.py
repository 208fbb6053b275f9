"""Geometries as a scene file has them: meshes, spheres, and the planes that a hand writes."""

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...checks import quoted
from ...errors import InputError
from . import Mesh, Spheres
from .fields import Arrays, Field

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
    try:
        return readers[kind.text()](_as_spelled_now(field), arrays)
    except InputError as error:
        field.hand_on(error)


def _as_spelled_now(field: Field) -> Field:
    """The geometry with the key that files of the first months spell otherwise."""
    values = {key: each.value for key, each in field.fields((), others=True).items()}
    if "corner_colors" not in values and "corner_colours" in values:
        values["corner_colors"] = values.pop("corner_colours")
    return Field(values, field.name, field.file)


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
