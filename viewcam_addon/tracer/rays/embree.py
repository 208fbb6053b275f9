"""Embree: the one place that knows whether it is there, in which unit it is given coordinates, and who shares its scenes.

embreex copies a mesh number by number, in Python, which takes longer than Embree takes to build its hierarchy. So Embree's own
functions are called where they were found (compiled/library.py): a copy is then a pass of NumPy, and a hierarchy whose corners
have moved is refitted, in a tenth of the time of a new one. Embree refits only what was made for it: in a scene that is dynamic
and of low quality, a geometry whose quality is "refit" is first built as carefully as in any other scene, but it takes 32 bytes
more a triangle. So a scene is built for that when its camera moves for the first time.
"""

import ctypes
import math
import sys

import numpy as np
from numpy.typing import NDArray

from ..arrays import Float32s, Floats
from ..compiled import library
from .triangles import Triangles

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ImportError:  # no wheel for this machine: NumPy gives the same answers, slowly
    EmbreeScene = None

# Embree multiplies three coordinates: with none larger than this, and those of what is seen not less than its 10⁻²⁰ part, no
# product leaves float32's range.
_LARGEST = 2.0**30

# Embree's enumerations.
_TRIANGLES = 0
_CORNERS, _VERTICES = 0, 1
_THREE_UNSIGNED, _THREE_FLOATS = 0x5003, 0x9003
_DYNAMIC, _ROBUST = 1, 4
_LOW, _REFIT = 0, 3

_POINTER, _WHOLE, _COUNT, _SIZE = ctypes.c_void_p, ctypes.c_int, ctypes.c_uint, ctypes.c_size_t
_FUNCTIONS = {
    "rtcGetSceneDevice": (_POINTER, _POINTER),
    "rtcReleaseDevice": (None, _POINTER),
    "rtcSetSceneFlags": (None, _POINTER, _WHOLE),
    "rtcSetSceneBuildQuality": (None, _POINTER, _WHOLE),
    "rtcCommitScene": (None, _POINTER),
    "rtcNewGeometry": (_POINTER, _POINTER, _WHOLE),
    "rtcReleaseGeometry": (None, _POINTER),
    "rtcSetGeometryBuildQuality": (None, _POINTER, _WHOLE),
    "rtcSetNewGeometryBuffer": (_POINTER, _POINTER, _WHOLE, _COUNT, _WHOLE, _SIZE, _SIZE),
    "rtcGetGeometryBufferData": (_POINTER, _POINTER, _WHOLE, _COUNT),
    "rtcUpdateGeometryBuffer": (None, _POINTER, _WHOLE, _COUNT),
    "rtcCommitGeometry": (None, _POINTER),
    "rtcAttachGeometry": (_COUNT, _POINTER, _POINTER),
    "rtcGetGeometry": (_POINTER, _POINTER, _COUNT),
}
"""Of Embree's functions the result and the arguments."""


def _embree() -> ctypes.CDLL | None:
    """Embree's own functions, or None where they were not found.

    Nor inside Blender's program, which brings an Embree and a TBB of its own: a large hierarchy that is built by a call from
    outside of embreex never ends there (5.2.2). embreex's own way does, and where bpy is a module (without a program) both do.
    """
    blender = sys.modules.get("bpy")
    if not library.PROVEN or (blender and blender.app.binary_path):
        return None
    functions = library.shared()
    for name, (result, *arguments) in _FUNCTIONS.items():
        function = getattr(functions, name, None)
        if function is None:
            return None
        function.restype, function.argtypes = result, arguments
    return functions


_EMBREE = _embree()


def unit_of(largest: float) -> float:
    """Embree's units in one of the world: the power of two that makes the largest |coordinate| about `_LARGEST`."""
    return math.ldexp(_LARGEST, -math.frexp(largest or 1.0)[1])


def rows(vectors: Floats) -> Float32s:
    """(n, 3) float32 of (3, n): what Embree takes."""
    return np.ascontiguousarray(vectors.T, np.float32)


def embree_scene(vertices: Floats, triangles: NDArray[np.int32], unit: float = 1.0, moving: bool = False) -> "EmbreeScene":
    """A scene of triangles, ready for any thread.

    vertices : (v, 3). triangles : (m, 3) indices. unit : what the vertices are multiplied by. moving : whether it can be
    refitted.
    """
    scene = EmbreeScene(robust=True)
    if _EMBREE is None:
        TriangleMesh(scene, np.multiply(vertices, unit, order="C").astype(np.float32), np.ascontiguousarray(triangles))
        scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))  # builds the hierarchy, once, before threads come
        return scene
    own = library.pointer_of(scene)
    if moving:
        _EMBREE.rtcSetSceneFlags(own, _ROBUST | _DYNAMIC)
        _EMBREE.rtcSetSceneBuildQuality(own, _LOW)
    device = _EMBREE.rtcGetSceneDevice(own)
    geometry = _EMBREE.rtcNewGeometry(device, _TRIANGLES)
    _EMBREE.rtcReleaseDevice(device)
    if moving:
        _EMBREE.rtcSetGeometryBuildQuality(geometry, _REFIT)
    corners = _EMBREE.rtcSetNewGeometryBuffer(geometry, _CORNERS, 0, _THREE_UNSIGNED, 12, len(triangles))
    places = _EMBREE.rtcSetNewGeometryBuffer(geometry, _VERTICES, 0, _THREE_FLOATS, 12, len(vertices))
    if not (corners and places):
        _EMBREE.rtcReleaseGeometry(geometry)
        raise MemoryError
    _at(corners, triangles.shape, ctypes.c_uint32)[:] = triangles
    np.multiply(vertices, unit, out=_at(places, vertices.shape, ctypes.c_float), casting="same_kind")
    _EMBREE.rtcCommitGeometry(geometry)
    _EMBREE.rtcAttachGeometry(own, geometry)
    _EMBREE.rtcReleaseGeometry(geometry)
    _EMBREE.rtcCommitScene(own)
    scene.is_committed = 1
    return scene


def _refit(scene: "EmbreeScene", vertices: Floats, unit: float) -> None:
    """Move the vertices of a scene that `embree_scene` made to be moved, and what is built on them."""
    own = library.pointer_of(scene)
    geometry = _EMBREE.rtcGetGeometry(own, 0)
    places = _EMBREE.rtcGetGeometryBufferData(geometry, _VERTICES, 0)
    np.multiply(vertices, unit, out=_at(places, vertices.shape, ctypes.c_float), casting="same_kind")
    _EMBREE.rtcUpdateGeometryBuffer(geometry, _VERTICES, 0)
    _EMBREE.rtcCommitGeometry(geometry)
    _EMBREE.rtcCommitScene(own)


def _at(address: int, shape: tuple[int, int], kind: type) -> NDArray:
    """The array in Embree's memory."""
    return np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(kind)), shape)


def scene_of(triangles: Triangles, left_out: NDArray[np.bool_], unit: float) -> "EmbreeScene | None":
    """The scene of triangles without some, in a unit; made once, and None where there are none.

    left_out : (m,). They keep their numbers and are never met.
    """
    key = (np.packbits(left_out).tobytes(), unit)
    if key not in triangles.embree_scenes:
        triangles.embree_scenes[key] = (
            None if left_out.all() else _refitted(triangles, key) or _built(triangles, left_out, unit)
        )
    return triangles.embree_scenes[key]


def _refitted(triangles: Triangles, key: tuple[bytes, float]) -> "EmbreeScene | None":
    """A former scene without the same triangles, refitted, if there is one."""
    left_out, unit = key
    former = next((former for former in triangles.former_scenes if former[0] == left_out), None)
    if former is None or _EMBREE is None:
        return None
    scene = triangles.former_scenes.pop(former)
    _refit(scene, triangles.vertices.T, unit)
    return scene


def _built(triangles: Triangles, left_out: NDArray[np.bool_], unit: float) -> "EmbreeScene":
    corners = triangles.corners.T
    if left_out.any():
        corners = corners.copy()
        corners[left_out] = 0  # points
    return embree_scene(triangles.vertices.T, corners, unit, triangles.moving)
