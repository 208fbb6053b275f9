"""The share of each pixel that each instance covers, as in Cryptomatte: pairs of an id and a share, the largest share first.

A share is that of the pixel's square, each part of it as much as any other (a box filter one pixel wide), and of what is
visible. It is counted: at SAMPLES places that a lattice spreads over the square, the same in each pixel, so that an upright or
level edge is right to half of one of them. Rejected: areas of clipped polygons (spheres and smaller things than pixels would
want more than that), and a grid of rows and columns, which an upright edge crosses in few steps.

Layout, hash and header: the Cryptomatte specification 1.2 (Psyop). The hash: MurmurHash3_x86_32 (Appleby, public domain).
"""

import functools
import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..image import COVERAGE_PASSES, Image
from .surfaces import Instance, Surfaces

SAMPLES, _STEP = 34, 21
"""Fibonacci's numbers, of which lattices are as even as lattices can be."""

_LAYER = "ViewLayer.CryptoObject"
_MASK = 0xFFFFFFFF


@dataclass(frozen=True, eq=False)
class Coverage:
    """The coverage of a picture's instances.

    passes : its Cryptomatte layers.
    names, areas : the name of each instance in the layers, and its area in pixels.
    header : the layers' attributes.
    """

    passes: dict[str, NDArray[np.float32]]
    names: list[str]
    areas: NDArray[np.float64]
    header: dict[str, str]


def coverage(surfaces: Surfaces) -> Coverage:
    """The coverage of all instances."""
    names = _names(surfaces.instances)
    marks = np.array([_mark(name) for name in names], np.float32)
    shape = surfaces.instance.shape
    at_samples = np.empty((SAMPLES, surfaces.instance.size), np.int32)
    for there, place in zip(at_samples, _places(), strict=True):
        there[:] = surfaces.instances_at(place).ravel()
    pixels, owners, counts = _counted(at_samples)
    first = np.flatnonzero(np.diff(pixels, prepend=-1))
    ranks = np.arange(len(pixels)) - np.repeat(first, np.diff(first, append=len(pixels)))
    layers = max(int(ranks.max(initial=0)) // 2 + 1, 1)
    ranked = np.zeros((at_samples.shape[1], layers, 4), np.float32)
    ranked[pixels, ranks // 2, ranks % 2 * 2] = marks[owners]
    ranked[pixels, ranks // 2, ranks % 2 * 2 + 1] = counts / SAMPLES
    passes = {name: ranked[:, i].reshape(*shape, 4) for i, name in enumerate(COVERAGE_PASSES[:layers])}
    areas = np.bincount(owners, counts, len(names)) / SAMPLES
    manifest = {name: _hex(mark) for name, mark, area in zip(names, marks, areas, strict=True) if area}
    return Coverage(passes, names, areas, _header(manifest))


def soft_mask(image: Image, name: str) -> NDArray[np.float32]:
    """(height, width), rows as the image's: the share of each pixel that an instance covers.

    name : the instance's name in `coverage`.
    """
    mark = _mark(name).view(np.uint32)
    result = np.zeros(image.size[::-1], np.float32)
    for layer in filter(image.passes.__contains__, COVERAGE_PASSES):
        for i in (0, 2):
            result += np.where(np.ascontiguousarray(image[layer][..., i]).view(np.uint32) == mark, image[layer][..., i + 1], 0)
    return result


def entry(covered: Coverage, number: int) -> dict[str, Any] | None:
    """The entry of a label file about an instance's coverage; None where it has none."""
    return {"name": covered.names[number], "area": float(covered.areas[number])} if covered.areas[number] else None


def _places() -> list[tuple[float, float]]:
    """The places in a pixel where what it shows is counted, from its lower left corner."""
    return [((i + 0.5) / SAMPLES, (i * _STEP % SAMPLES + 0.5) / SAMPLES) for i in range(SAMPLES)]


def _counted(at_samples: NDArray[np.int32]) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """(pixels, instances, counts): an instance stands at so many of a pixel's places; by pixel, then the most first.

    at_samples : (SAMPLES, pixels), −1 for none.
    """
    first = at_samples[0]
    is_one = (at_samples == first).all(axis=0)
    whole = np.flatnonzero(is_one & (first >= 0))
    mixed = np.flatnonzero(~is_one)
    several = np.sort(at_samples[:, mixed].T, axis=1)
    starts = np.flatnonzero(np.diff(several, axis=1, prepend=-2))
    counts = np.diff(starts, append=several.size)
    owners, pixels = several.ravel()[starts], mixed[starts // SAMPLES]
    is_covered = owners >= 0
    pixels = np.concatenate([whole, pixels[is_covered]])
    owners = np.concatenate([first[whole], owners[is_covered]])
    counts = np.concatenate([np.full(len(whole), SAMPLES), counts[is_covered]])
    order = np.lexsort((owners, -counts, pixels))
    return pixels[order], owners[order], counts[order]


def _names(instances: list[Instance]) -> list[str]:
    """A name for each instance: its object's, from the second place on with a number (Tree, Tree #1), and no name twice."""
    taken: set[str] = {each.key[0] for each in instances}
    result = []
    for name, number in (each.key for each in instances):
        own = name
        if number:
            own = f"{name} #{number}"
            while own in taken:
                own += "#"
            taken.add(own)
        result.append(own)
    return result


def _header(manifest: dict[str, str]) -> dict[str, str]:
    key = f"cryptomatte/{murmur3(_LAYER.encode()):08x}"[: len("cryptomatte/") + 7]
    about = {"name": _LAYER, "hash": "MurmurHash3_32", "conversion": "uint32_to_float32"}
    return {f"{key}/{name}": text for name, text in {**about, "manifest": json.dumps(manifest)}.items()}


def _hex(mark: np.float32) -> str:
    return f"{int(np.float32(mark).view(np.uint32)):08x}"


@functools.lru_cache(maxsize=2**16)
def _mark(name: str) -> np.float32:
    """The float32 of a name's hash; where that were no plain number (zero, denormal, infinite, nan) with one bit turned."""
    number = murmur3(name.encode("utf-8", "surrogatepass"))
    if (number >> 23 & 255) in (0, 255):
        number ^= 1 << 23
    return np.uint32(number).view(np.float32)


def murmur3(text: bytes) -> int:
    """MurmurHash3's 32 bits, with the seed 0."""
    whole = len(text) // 4 * 4
    result = 0
    for at in range(0, whole, 4):
        result ^= _mixed(int.from_bytes(text[at : at + 4], "little"))
        result = ((result << 13 | result >> 19) * 5 + 0xE6546B64) & _MASK
    result ^= _mixed(int.from_bytes(text[whole:], "little")) ^ len(text)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        result = ((result ^ result >> shift) * factor) & _MASK
    return result


def _mixed(part: int) -> int:
    part = part * 0xCC9E2D51 & _MASK
    return (part << 15 | part >> 17) * 0x1B873593 & _MASK
