"""Pictures of renderers other than the tracer: each as the passes that are compared, and what it rounds by design.

Cycles writes every pass. EEVEE has a half float for each number of a picture and a depth buffer behind it, and no index; but it
draws any material in place of the scene's, and this one writes what is asked for in halves that add up to a float
(blender/rendering/rasters.py). Workbench has no materials: its flat color of objects holds their index, and its depth
buffer is all that tells where they are. docs/engines.md has what was measured.

An EXR made elsewhere may have less: depth, distance and position each make up for the others where the camera is known. What is
made up is not judged. Rejected: half floats as they are (positions to 2⁻¹¹ of themselves, ten thousand times Cycles' error).
"""

import os
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .. import image
from ..errors import InputError
from ..image import BACKGROUND_DEPTH, Image
from ..pinhole import Pinhole
from . import tolerances

# EEVEE's passes, of four parts or two: so many steps of each but the last, which is the rest. A half has 11 bits, and each part
# is less than 2048 of its steps: up to 65,504 units from the origin, to 2⁻²⁴ of a unit.
PARTS = {"Position": (2.0**5, 2.0**-6, 2.0**-17), "Normal": (2.0**-10,), "Object Index": (2.0**5,)}
# Workbench's colors: an index as three digits, in steps that half floats hold exactly.
DIGITS = 32

_LARGEST_HALF = float(np.finfo(np.float16).max)

NOTE = "Note"
"""The text attribute of such a picture, of Blender's own, that says who rendered it."""
MARK = "viewcam"


@dataclass(frozen=True)
class Renderer:
    """The deviations of a renderer by design, beside its roundings.

    center : pixels that its rays are beside the pixels' centers.
    edges : pixels that its edges are beside the scene's.
    normal : radians that its storage turns a normal by.
    near : the near end of the depth buffer that its depths come from, world units; or None.
    """

    name: str
    center: float = tolerances.FILTER_BIAS
    edges: float = 0.0
    normal: float = tolerances.NORMAL_STORAGE
    near: float | None = None

    def depth_storage(self, depth: NDArray[np.float64]) -> NDArray[np.float64] | float:
        """Relative: of depths that are kept as 1 − near/depth."""
        return tolerances.FLOAT32 if self.near is None else DEPTH_BUFFER * tolerances.FLOAT32 * depth / self.near


# Rasterizers move vertices to a grid of 1/256 of a pixel before they decide which pixels a triangle covers (OpenGL asks for
# 1/16 at least, and graphics cards and llvmpipe have 8 bits): by half a step each way, and an edge by no more than its ends.
SUBPIXEL = 2.0**-9 * 2**0.5
# Normals of 16 bits for each coordinate, as "High Quality Normals" has them: half a step in each of three.
_HIGH_QUALITY_NORMALS = 3**0.5 / 65534
# Roundings of a depth buffer, on the way in and out: a product, a sum and a quotient of the projection's float32 numbers each
# way, calibrated as half as much again as the worst of the sample scenes (28).
DEPTH_BUFFER = 42.0

CYCLES = Renderer("Cycles")
RENDERERS = {
    "CYCLES": CYCLES,
    "EEVEE": Renderer("EEVEE", edges=SUBPIXEL, normal=_HIGH_QUALITY_NORMALS),
    "WORKBENCH": Renderer("Workbench", edges=SUBPIXEL),
}


def read(path: str | os.PathLike[str]) -> tuple[Image, Renderer]:
    """A picture and who rendered it, of EEVEE and Workbench if rasters.py has made it. Raises as image.read does."""
    note = image.text_attribute(path, NOTE).split()
    if len(note) != 3 or note[0] != MARK or note[1] not in RENDERERS:
        return image.read(path), CYCLES
    engine = note[1]
    try:
        near = float(note[2])
    except ValueError as error:
        raise InputError(f"{path} says that its depths begin at {note[2]!r}, which is no number: render it again") from error
    renderer = replace(RENDERERS[engine], near=near) if engine == "WORKBENCH" else RENDERERS[engine]
    return _decoded(image.read_channels(path, _channels_of(engine)), engine), renderer


def note(engine: str, near: float) -> str:
    """The note in a picture of EEVEE or Workbench.

    near : the depth at which the camera's clipping starts, world units.
    """
    return f"{MARK} {engine} {near!r}"


def _channels_of(engine: str) -> dict[str, list[str]]:
    """The channels that image.read_channels has to read of such a picture."""
    if engine == "WORKBENCH":
        return {"Combined": [f"Combined.{letter}" for letter in "RGBA"], "Depth": ["Depth.Z"]}
    parts = {part: [f"{part}.{letter}" for letter in "RGB"] for name in PARTS for part in part_names(name)}
    return {"Combined": [f"Combined.{letter}" for letter in "RGBA"], **parts}


def part_names(name: str) -> list[str]:
    """The names of the passes that add up to one."""
    return [f"Pinhole {name} {number}" for number in range(1, len(PARTS[name]) + 2)]


def _decoded(picture: Image, engine: str) -> Image:
    """The passes of geometry in a picture of `_channels_of`."""
    hit = picture["Combined"][..., 3:] > 0.5
    if engine == "WORKBENCH":
        digits = np.round(picture["Combined"][..., :3].astype(np.float64) * DIGITS) @ DIGITS ** np.arange(3.0)
        passes = {"Depth": np.where(hit, picture["Depth"], BACKGROUND_DEPTH), "Object Index": digits[..., None] * hit}
    else:
        whole = {name: sum(picture[part].astype(np.float64) for part in part_names(name)) * hit for name in PARTS}
        passes = {**whole, "Object Index": whole["Object Index"][..., :1]}
    return replace(picture, passes={name: values.astype(np.float32) for name, values in passes.items()})


def completed(picture: Image, pinhole: Pinhole) -> Image:
    """The picture with Depth and Position, each made from what there is where it lacks one: from Depth, Distance or Position.

    A Position that is made lies on the ray through its pixel's center. Nothing was hit where the first of these that is there
    has 0 (a Position in all of its coordinates), BACKGROUND_DEPTH and more, what is infinite, or as a depth the largest half
    float, or less than 0 beside others that are more; or, where none of these is anywhere, what is no number. All passes hold
    there what the tracer's do.
    """
    passes = dict(picture.passes)
    name = next(name for name in ("Depth", "Distance", "Position") if name in passes)
    measure = passes[name].astype(np.float64)
    missed = (measure == 0.0).all(axis=-1, keepdims=True) | (np.abs(measure) >= BACKGROUND_DEPTH).any(axis=-1, keepdims=True)
    if name != "Position":
        missed |= measure == _LARGEST_HALF
        if (measure[~missed] > 0.0).any():
            missed |= measure < 0.0
    if not missed.any():
        missed = np.isnan(measure).all(axis=-1, keepdims=True)
    w = pinhole.basis()[2]
    rows, columns = np.mgrid[: pinhole.height, : pinhole.width]
    directions = pinhole.ray_directions(columns.ravel(), rows.ravel()).reshape(*rows.shape, 3)
    cosine = -(directions @ w)[..., None]
    if "Depth" in passes:
        depth = measure
    elif "Distance" in passes:
        depth = measure * cosine
    else:
        depth = -(np.where(np.isfinite(measure), measure, np.nan) - pinhole.eye) @ w[:, None]
    if "Position" not in passes:
        away = np.where(missed, 0.0, depth) / cosine
        passes["Position"] = (pinhole.eye + away * directions).astype(np.float32)
    passes["Depth"] = depth.astype(np.float32)
    nothing = {"Depth": np.float32(BACKGROUND_DEPTH)}
    return replace(
        picture, passes={name: np.where(missed, nothing.get(name, np.float32(0)), values) for name, values in passes.items()}
    )
