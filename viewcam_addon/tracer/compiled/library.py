"""Embree's own library, the one that embreex brings and runs on, and the scenes that embreex makes in it.

embreex traces rays one by one. What it calls for that stands beside the packet functions in Embree's library, which the linker
finds through embreex on Linux and macOS; on Windows it is looked for among the files of the wheel. The scene stands in
embreex's object, right behind what every Python object starts with. Nothing of that is promised, so it is proven before use:
by the object's other members, which are known, and then by a triangle.
"""

import ctypes
import os
from pathlib import Path

import numpy as np

try:
    from embreex import rtcore, rtcore_scene
    from embreex.mesh_construction import TriangleMesh
except ImportError:  # no wheel for this machine
    rtcore_scene = None

FUNCTIONS = ("rtcIntersect16", "rtcOccluded16")

# struct RTCRayHit16 as rows of 16 float32 or int32, and a row for which lanes hold rays, and one for what else Embree is told.
LANES = 16
ORIGIN, NEAR, DIRECTION, TIME, FAR, MASK, ID, FLAGS = 0, 3, 4, 7, 8, 9, 10, 11
PRIMITIVE, GEOMETRY, INSTANCE, INSTANCE_PRIMITIVE, VALID = 17, 18, 19, 20, 21
ARGUMENTS = 22  # struct RTCIntersectArguments: flags, which features (all), and null pointers
ROWS = 23
COHERENT = 1 << 16  # RTC_RAY_QUERY_FLAG_COHERENT
ALIGNMENT = 64  # bytes

_SCENE = object.__basicsize__  # cdef class EmbreeScene: the scene, whether it is committed, its device
_COMMITTED, _DEVICE = _SCENE + 8, _SCENE + 16


def pointer_of(scene: "rtcore_scene.EmbreeScene") -> int:
    """Embree's own scene (RTCScene) in embreex's; valid as long as that lives."""
    return ctypes.c_size_t.from_address(id(scene) + _SCENE).value


def shared() -> ctypes.CDLL:
    """Embree's library.

    Raises
    ------
    OSError
        if it is not there.
    """
    return ctypes.CDLL(str(_windows_library() if os.name == "nt" else rtcore_scene.__file__))


def addresses() -> dict[str, int]:
    """Where in memory Embree's packet functions are.

    Raises
    ------
    OSError, AttributeError
        if there are none.
    """
    library = shared()
    return {name: ctypes.cast(getattr(library, name), ctypes.c_void_p).value for name in FUNCTIONS}


def _windows_library() -> Path:
    package = Path(rtcore_scene.__file__).parent
    for folder in (package, package.with_name("embreex.libs")):
        for path in folder.glob("*embree4*.dll"):
            return path
    raise OSError("embreex brings no Embree")


def _is_proven() -> bool:
    """Whether a packet through embreex's scene meets a triangle where it is, and nothing beside it."""
    if rtcore_scene is None or ctypes.sizeof(ctypes.c_void_p) != 8:
        return False
    try:
        functions = addresses()
    except (OSError, AttributeError):
        return False
    device = rtcore.EmbreeDevice()
    scene = rtcore_scene.EmbreeScene(device, robust=True)
    if type(scene).__basicsize__ < _DEVICE + 8 or not _holds(scene, device, committed=0):
        return False
    TriangleMesh(scene, np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1]], np.float32), np.array([[0, 1, 2]], np.int32))
    scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
    return _holds(scene, device, committed=1) and _traces(functions, pointer_of(scene))


def _holds(scene: "rtcore_scene.EmbreeScene", device: object, committed: int) -> bool:
    """Whether the members of embreex's object are where they are expected."""
    return (
        ctypes.c_int.from_address(id(scene) + _COMMITTED).value == scene.is_committed == committed
        and ctypes.c_size_t.from_address(id(scene) + _DEVICE).value == id(device)
        and pointer_of(scene) != 0
        and pointer_of(scene) % 8 == 0
    )


def _traces(functions: dict[str, int], scene: int) -> bool:
    """Whether of sixteen rays upwards from the plane z = 0 those below the triangle meet it. Two lanes hold no ray."""
    memory = np.zeros((ROWS + 1, LANES), np.float32)
    offset = -memory.ctypes.data % ALIGNMENT // 4
    packet = memory.ravel()[offset : offset + ROWS * LANES].reshape(ROWS, LANES)
    bits = packet.view(np.int32)
    x, y = np.arange(LANES) % 4 / 3 - 0.1, np.arange(LANES) // 4 / 3 - 0.1
    packet[ORIGIN], packet[ORIGIN + 1], packet[DIRECTION + 2], packet[FAR] = x, y, 1, 2
    bits[[MASK, PRIMITIVE, GEOMETRY, INSTANCE, INSTANCE_PRIMITIVE, VALID]] = -1
    bits[VALID, [5, 6]] = 0
    below = (x > 0) & (y > 0) & (x + y < 1) & (bits[VALID] != 0)
    call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4)
    address = packet.ctypes.data
    call(functions["rtcIntersect16"])(address + VALID * ALIGNMENT, scene, address, None)
    met = (bits[PRIMITIVE] == 0) & (packet[FAR] == 1)
    packet[FAR] = 2
    call(functions["rtcOccluded16"])(address + VALID * ALIGNMENT, scene, address, None)
    return np.array_equal(met, below) and np.array_equal(packet[FAR] < 0, below)


PROVEN = _is_proven()
"""Whether Embree's packets can be used."""
