"""The picture's roll as a camera flies through straight down, or close by.

The eye flies an arc of 30° before the zenith to 30° behind it over its look-at point, a degree each frame, up being the
world's Z. Measured is by how much the picture turns about the view between two frames: the rotation that is left once the
smallest one that brings the view to the next has been taken off.

The two modes of the property `pole`. Canonical Axes is the text's rule, the same at every frame and in exact arithmetic: the
flip is its own, no error of rounding. Hold the Roll carries the picture along within 10° of up. The first chart is a keyframed
camera as Blender has it, frame by frame; the second draws the largest turn between two frames against how close the flight
passes by, in float64.
"""

import bpy
import numpy as np
from numpy.typing import NDArray

from viewcam_addon import roll as rolls
from viewcam_addon.blender import findings
from viewcam_addon.pinhole import basis

from ..charts import Chart, Curve
from .stage import empty_stage

Array = NDArray[np.float64]

_FRAMES = 61
_REACH, _WITHIN = np.radians(30), np.radians(10)
_NEAR_MISS = np.radians(0.1)
_Z = np.array([0.0, 0.0, 1.0])
# Each frame's matrix is within findings.LARGEST_TURN of its Pinhole, and the roll is the sum of all turns before.
_STORED = np.degrees(_FRAMES * findings.LARGEST_TURN)
# A turn is read off two bases, each component within 4e-16 (pinhole.py), and a dozen sums and products.
_COMPUTED = 16e-16


def charts(quick: bool = False) -> tuple[Chart, ...]:
    return _over_the_flight(), _against_the_miss(10 if quick else 46)


def _over_the_flight() -> Chart:
    frames, curves = np.arange(1, _FRAMES + 1), []
    for league, miss in (("exactly", 0.0), ("0.1° beside", _NEAR_MISS)):
        camera = _keyframed(_flight(miss))
        for name, pole in (("Canonical Axes", "CANONICAL"), ("Hold the Roll", "HOLD")):
            camera.virtual_pinhole.pole = pole
            roll = np.degrees(np.cumsum([0.0, *_turns(*_matrices(camera, frames))]))
            curves.append(Curve(f"{name}, {league}", frames, np.abs(roll), pole == "HOLD", league, _STORED))
    held = max(np.abs(np.diff(curve.y)).max() for curve in curves if curve.ours)
    reading = (
        "Read how the picture turns while the view passes through straight down at frame 31. By Canonical Axes it flips: from "
        "one frame to the next if the view passes exactly through up, within two frames if it passes a tenth of a degree "
        f"beside. Held, it turns by {held:.1g}° a frame at most, and hangs upside down behind the top, as in a loop."
    )
    return Chart(
        "flight",
        "The roll over a flight through straight down",
        "frame, each a degree of the view's turn",
        "how far the picture has turned about the view [°]",
        tuple(curves),
        reading,
        _STORED,
        log_x=False,
        log_y=False,
    )


def _against_the_miss(count: int) -> Chart:
    misses = np.logspace(0, -15, count) * np.radians(20)
    canonical, held = (_largest_turns(misses, within) for within in (None, _WITHIN))
    reading = (
        "Read what happens as the flight passes closer by. By Canonical Axes the picture turns more and more within one frame, "
        "up to a quarter of a turn, and another one in the next. Held within 10°, it turns ever less: what is left happens "
        "before and behind those 10°, where up rules."
    )
    return Chart(
        "flight-miss",
        "Turn of the picture within a frame against how close the view passes by up",
        "closest approach of the view to up [rad]",
        "largest turn about the view between two frames [rad]",
        (Curve("Canonical Axes", misses, canonical), Curve("Hold the Roll, within 10°", misses, held, True)),
        reading,
        _COMPUTED,
        reverse=True,
    )


def _flight(miss: float) -> Array:
    """(frames, 3): unit vectors from the look-at point to the eye, which passes up at the angle `miss`."""
    along = np.linspace(-_REACH, _REACH, _FRAMES)
    return np.sin(along)[:, None] * (1.0, 0.0, 0.0) + np.cos(along)[:, None] * (0.0, -np.sin(miss), np.cos(miss))


def _keyframed(directions: Array) -> bpy.types.Object:
    scene, camera = empty_stage()
    scene.frame_start, scene.frame_end = 1, len(directions)
    group = camera.virtual_pinhole
    group.enabled, group.look_at, group.up = True, (0, 0, 0), _Z
    for i, direction in enumerate(directions):
        group.eye = 10 * direction
        group.keyframe_insert("eye", frame=i + 1)
    return camera


def _matrices(camera: bpy.types.Object, frames: Array) -> tuple[Array, Array, Array]:
    """u, v and w of Blender's own matrix at each frame, (frames, 3) each."""
    matrices = []
    for frame in frames.tolist():
        bpy.context.scene.frame_set(frame)
        matrices.append(np.array(camera.matrix_world)[:3, :3])
    return tuple(np.moveaxis(np.array(matrices), 2, 0))


def _largest_turns(misses: Array, within: float | None) -> list[float]:
    largest = []
    for miss in misses:
        eye = _flight(miss)
        u, v, w = basis(eye, np.zeros(3), _Z)
        if within is not None:
            angle = rolls.carried(eye, np.zeros(3), _Z, within)[:, None]
            u, v = np.cos(angle) * u + np.sin(angle) * v, np.cos(angle) * v - np.sin(angle) * u
        largest.append(np.abs(_turns(u, v, w)).max())
    return largest


def _turns(u: Array, v: Array, w: Array) -> Array:
    """The turn of each picture about the view from the one before, radians; all (n, 3), (n − 1,) is returned."""
    middle = w[:-1] + w[1:]
    across = 2 * np.einsum("ij,ij->i", middle, u[:-1]) / np.einsum("ij,ij->i", middle, middle)
    carried = u[:-1] - across[:, None] * middle
    return np.arctan2(-np.einsum("ij,ij->i", carried, v[1:]), np.einsum("ij,ij->i", carried, u[1:]))
