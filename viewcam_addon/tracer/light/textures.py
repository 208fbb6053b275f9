"""What colours materials have at points of surfaces: constants, images and the mesh's own colours.

As in Cycles (measured with 4.2, 5.0 and 5.2): of n pixels, that of number i has its centre at (i + ½)/n of UV; images repeat,
and at their border pixels are blended with those on the other side; sRGB is decoded after blending, which makes blends of
light and dark darker than half-way. Cycles has UV in float32: at 64 pixels, its colours are off by up to 2e-5 of the contrast.

Rejected: decoding images when they are loaded (not what Cycles does), and mip maps, which it has not.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Float32s, Floats, Indices, gather
from ..rays.points import Points, materials_of
from ..scene import Scene
from ..scene.materials import Colour, Picture

COMPONENTS = ("diffuse", "emission", "mirror", "glass", "refraction")

_SRGB_LINEAR = 0.04045  # below it, sRGB (IEC 61966-2-1) is a straight line


class Palette:
    """The colours of a scene's materials. Those that no surface has do not count."""

    def __init__(self, scene: Scene) -> None:
        materials = materials_of(scene)
        used = _used(scene)
        self._ior = np.array([material.ior for material in materials])
        self._colours: dict[str, list[Colour | None]] = {}
        self._constants: dict[str, Floats] = {}
        for component in COMPONENTS:
            colours = [material.colours.get(component) if used[number] else None for number, material in enumerate(materials)]
            if any(colours):
                self._colours[component] = colours
                self._constants[component] = np.array([colour.rgb if colour else (0.0, 0.0, 0.0) for colour in colours]).T
        images = {
            colour.image for colours in self._colours.values() for colour in colours if colour and colour.image is not None
        }
        self._pictures = scene.images
        self._textures = {name: Texture(scene.images[name]) for name in images}
        self._only = int(np.flatnonzero(used)[0]) if np.count_nonzero(used) == 1 else None

    def has(self, component: str) -> bool:
        """Whether any surface has this component of a material, and not in black."""
        return component in self._colours

    def having(self, component: str) -> NDArray[np.bool_]:
        """For each of `materials_of(scene)`, whether it has this component."""
        return np.array([colour is not None for colour in self._colours.get(component, [None] * len(self._ior))])

    @property
    def specular(self) -> NDArray[np.bool_]:
        """For each of `materials_of(scene)`, whether it is a mirror or clear."""
        return self.having("mirror") | self.having("glass") | self.having("refraction")

    @property
    def patterned(self) -> NDArray[np.bool_]:
        """For each of `materials_of(scene)`, whether its colours vary over the surface."""
        patterned = np.zeros(len(self._ior), bool)
        for colours in self._colours.values():
            patterned |= [colour is not None and (colour.image is not None or colour.vertex) for colour in colours]
        return patterned

    @property
    def scatters(self) -> bool:
        """Whether any surface sends light on."""
        return bool(self._colours.keys() - {"emission"})

    def ior(self, points: Points) -> Floats:
        """(n,): the indices of refraction of the materials at points."""
        return gather(self._ior, points.material)

    def colour(self, component: str, points: Points) -> Floats:
        """(3, n) float64: the colours of a component that `has` says there is; 0 where a material has none."""
        constants = self._constants[component]
        if self._only is None:
            values = gather(constants, points.material)
        else:
            values = np.repeat(constants[:, self._only, None], points.count, axis=1)
        for number, colour in enumerate(self._colours[component]):
            if colour is not None and (colour.image is not None or colour.vertex):
                which = slice(None) if number == self._only else np.flatnonzero(points.material == number)
                self._vary(values, colour, points, which)
        return values

    def _vary(self, values: Floats, colour: Colour, points: Points, which: slice | Indices) -> None:
        """Multiply values of a colour by what varies over the surface."""
        if colour.image is not None:
            values[:, which] *= self._textures[colour.image].at(points.uv[:, which], colour.closest)
        if colour.vertex:
            values[:, which] *= points.vertex_colour[:, which]

    def mean(self, component: str, material: int) -> Floats:
        """(3,): the mean colour of a component of a material, over its image, as if vertex colours were white."""
        colour = self._colours.get(component, {})[material] if self.has(component) else None
        if colour is None:
            return np.zeros(3)
        factor = 1.0 if colour.image is None else _mean(self._pictures[colour.image])
        return np.array(colour.rgb) * factor


class Texture:
    """A picture, made ready to be looked up: each channel of its pixels in one piece of memory."""

    def __init__(self, picture: Picture) -> None:
        self._height, self._width = picture.pixels.shape[:2]
        self._channels = [np.ascontiguousarray(picture.pixels[..., channel]).ravel() for channel in range(3)]
        self._srgb = picture.srgb

    def at(self, uv: Floats, closest: bool) -> Floats:
        """(3, n) float64: the linear colours at (2, n) UV, blended in float32; those at 0 where UV is not finite."""
        with np.errstate(invalid="ignore"):
            u, v = uv - np.floor(uv)
        if not np.isfinite(uv).all():
            u, v = np.nan_to_num(u), np.nan_to_num(v)
        pixels = self._closest(u, v) if closest else self._around(u, v)
        colours = np.empty((3, len(u)))
        for colour, channel in zip(colours, self._channels, strict=True):
            blend = sum(channel.take(pixel, mode="clip") * share for pixel, share in pixels)
            colour[:] = decoded(blend) if self._srgb else blend
        return colours

    def _closest(self, u: Floats, v: Floats) -> list[tuple[Indices, float]]:
        """The pixel at each place, with all of the weight."""
        column = np.minimum((u * self._width).astype(np.intp), self._width - 1)
        row = np.minimum((v * self._height).astype(np.intp), self._height - 1)
        return [(row * self._width + column, np.float32(1))]

    def _around(self, u: Floats, v: Floats) -> list[tuple[Indices, Float32s]]:
        """The four pixels about whose centres each place is, and their weights."""
        columns, rows = _between(u, self._width), _between(v, self._height)
        return [(row * self._width + column, up * across) for row, up in rows for column, across in columns]


def _between(u: Floats, count: int) -> tuple[tuple[Indices, Float32s], tuple[Indices, Float32s]]:
    """The two of `count` pixels in a row about whose centres u, 0 to 1, is, and their weights."""
    place = u * count - 0.5
    first = np.floor(place)
    share = (place - first).astype(np.float32)
    first = first.astype(np.intp)
    second = first + 1
    return (np.where(first < 0, count - 1, first), 1 - share), (np.where(second >= count, 0, second), share)


def decoded(encoded: NDArray[np.floating]) -> NDArray[np.float32]:
    """The linear colours that sRGB stands for. In float32: a power of that is twenty times as fast, and right to 3e-7."""
    encoded = encoded.astype(np.float32)
    curve = np.power((np.maximum(encoded, np.float32(_SRGB_LINEAR)) + np.float32(0.055)) / np.float32(1.055), np.float32(2.4))
    return np.where(encoded <= np.float32(_SRGB_LINEAR), encoded / np.float32(12.92), curve)


def _mean(picture: Picture) -> Floats:
    if not picture.srgb:
        return picture.pixels.mean(axis=(0, 1), dtype=np.float64)
    return np.mean([decoded(row).mean(axis=0, dtype=np.float64) for row in picture.pixels], axis=0)


def _used(scene: Scene) -> NDArray[np.bool_]:
    """Which of `materials_of(scene)` any surface has."""
    numbers = {"": 0, **{name: number for number, name in enumerate(scene.materials, start=1)}}
    used = np.zeros(len(numbers), bool)
    found = {name: np.flatnonzero(np.bincount(geometry.materials)) for name, geometry in scene.geometries.items()}
    for placed in scene.objects:
        for slot in found[placed.geometry]:
            used[numbers[placed.materials[slot] if slot < len(placed.materials) else ""]] = True
    return used
