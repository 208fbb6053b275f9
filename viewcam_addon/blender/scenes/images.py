"""Blender's images as the tracer's pictures, with the pixels that Cycles looks up (intern/cycles/blender/image.cpp, and its
ImageMetaData::detect_colorspace): bytes and sRGB files stay encoded, and are decoded after the interpolation.
"""

import bpy
import numpy as np
from numpy.typing import NDArray

from ...tracer.scene.materials import Picture
from .. import versions
from ..temporary_settings import Overrides, overridden
from . import nodes

_LINEAR = ("Non-Color", "Linear Rec.709", "Raw", "Linear")

MISSING = (1.0, 0.0, 1.0, 1.0)
"""The color that Cycles shows in place of an image that is not there, linear (kernel/types.h, IMAGE_TEXTURE_MISSING)."""


def shows_nothing(node: bpy.types.Node) -> bool:
    """True if a texture node is MISSING: has no image, or one whose file is not there, unless it is clipped, where it fades."""
    if node.type not in ("TEX_IMAGE", "TEX_ENVIRONMENT"):
        return False
    image = node.image and node.image.original
    if image is None:
        return True
    fades = getattr(node, "extension", None) == "CLIP"
    return not fades and image.source == "FILE" and not (image.has_data or min(image.size))


def missing(tree: bpy.types.NodeTree | None) -> list[str]:
    """The nodes of a tree that show no image, one clause each; whether it leads to the output is not asked."""
    result: dict[str, None] = {}  # in their order
    for node in nodes.all_of(tree) if tree else ():
        if shows_nothing(node):
            used = (
                f"shows {node.image.name!r}, which is missing" if node.image else f"has a node {node.name!r} without an image"
            )
            result[f"{used}: magenta, as Cycles has it"] = None
    return list(result)


def obstacle(image: bpy.types.Image) -> str | None:
    """The reason that this image, which is not missing, can't be a picture, one clause, or None where it can."""
    if image.source not in ("FILE", "GENERATED"):
        return f"shows {image.name!r}, which is no single still image"
    if not min(image.size):
        return f"shows {image.name!r}, which has no pixels"
    space = image.colorspace_settings.name
    if space != "sRGB" and space not in _LINEAR:
        return f"shows {image.name!r}, whose colors are {space}"
    if versions.CYCLES < (4, 5) and image.file_format == "WEBP" and image.channels == 4 and _is_read_by_cycles(image):
        return f"shows {image.name!r}, a WebP with an alpha that Cycles multiplies by in a way of its own before 4.5"
    return None


def _is_encoded(image: bpy.types.Image) -> bool:
    """True if Cycles has an image's colors as sRGB encodes them."""
    return image.colorspace_settings.name == "sRGB" and (_is_read_by_cycles(image) or not image.is_float)


def _is_read_by_cycles(image: bpy.types.Image) -> bool:
    return image.source == "FILE" and not image.packed_file and not image.is_dirty


def alpha_obstacle(image: bpy.types.Image) -> str | None:
    """The reason that the alpha of an image without another obstacle can't be a picture's, one clause, or None where it can."""
    if image.channels != 4 or not is_divided(image) or is_multiplied(image):
        return None
    if image.is_float and not _is_encoded(image):
        return None
    return f"shows the alpha of {image.name!r}, which is kept as {image.alpha_mode.lower().replace('_', ' ')}"


def is_divided(image: bpy.types.Image) -> bool:
    """True if Cycles divides an image's colors by its alpha where that is asked for."""
    return image.alpha_mode not in ("NONE", "CHANNEL_PACKED") and not image.colorspace_settings.is_data


def is_multiplied(image: bpy.types.Image) -> bool:
    """True if Cycles multiplies an image's encoded colors by its alpha, in bytes."""
    encoded = not image.is_float and image.colorspace_settings.name == "sRGB"
    is_straight = image.alpha_mode == "STRAIGHT" and "STRAIGHT" in _multiplied_modes(image, _is_read_by_cycles(image))
    return image.channels == 4 and is_straight and encoded


def picture_of(image: bpy.types.Image, alpha: bool = False) -> Picture:
    """An image without an obstacle.

    alpha : true to read its alpha too, which has no obstacle either.
    """
    # Blender decodes floats, and multiplies or divides by the alpha of files. Cycles reads a file for itself; what Blender
    # hands it stays as it is.
    by_itself = _is_read_by_cycles(image)
    srgb = _is_encoded(image)
    has_alpha = image.channels == 4 and not image.colorspace_settings.is_data
    done_by_blender = has_alpha and image.alpha_mode == ("STRAIGHT" if image.is_float else "PREMUL")
    pixels = _encoded(image) if by_itself and ((image.is_float and srgb) or done_by_blender) else _pixels(image)
    rgb = pixels[..., :3] if image.channels >= 3 else np.repeat(pixels[..., :1], 3, axis=-1)
    if alpha and image.channels == 4 and image.alpha_mode != "NONE":
        rgb = pixels
        if image.is_float and has_alpha and image.alpha_mode in _multiplied_modes(image, by_itself):
            rgb[..., :3] *= rgb[..., 3:]
    elif has_alpha and image.alpha_mode in _multiplied_modes(image, by_itself):
        if not image.is_float:
            return Picture(_multiplied(pixels, np.uint8), srgb)
        if by_itself and Picture.compact(pixels).pixels.dtype.kind == "u":
            return Picture(_multiplied(pixels, np.uint16), srgb)
        rgb = rgb * pixels[..., 3:]
    return Picture.compact(np.nan_to_num(rgb, copy=False, posinf=0.0, neginf=0.0) if image.is_float else rgb, srgb)


def _multiplied_modes(image: bpy.types.Image, by_itself: bool) -> tuple[str, ...]:
    """The alpha modes in which Cycles multiplies an image's colors by its alpha, measured: since 5.2 where it is straight;
    before, by what a kind of file usually keeps.

    by_itself : true if Cycles reads its file.
    """
    if versions.CYCLES >= (5, 2):
        return ("STRAIGHT",)
    multiplies = image.file_format == "PNG" if image.is_float else image.file_format != "WEBP"
    return ("STRAIGHT", "PREMUL") if (multiplies if by_itself else not image.is_float) else ()


def image_of(picture: Picture, name: str, overrides: Overrides, packed: bool = True) -> bpy.types.Image:
    """An image with these pixels until the overrides end: bytes where they are encoded, floats where they are linear.

    packed : true to save it with the file.

    All renders of `overrides.lasting` share one. A Cycles that keeps its data tells images by their address, and shows the
    pixels of one that is gone where another one lies at its address.
    """
    return overrides.lasting.shared(_new_image, picture, name, packed)


def _new_image(overrides: Overrides, picture: Picture, name: str, packed: bool) -> bpy.types.Image:
    height, width, channels = picture.shape
    image = bpy.data.images.new(
        name, width, height, alpha=channels == 4, float_buffer=not picture.srgb, is_data=not picture.srgb
    )
    overrides.afterwards(bpy.data.batch_remove, [image])
    if channels == 4:
        image.alpha_mode = "STRAIGHT" if picture.srgb else "CHANNEL_PACKED"
    pixels = np.concatenate([picture.values, np.ones((height, width, 4 - channels), np.float32)], axis=2)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    if packed:
        image.pack()
    return image


def linear(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """The linear values of what sRGB encodes."""
    return np.where(encoded < 0.04045, encoded / 12.92, ((np.maximum(encoded, 0) + 0.055) / 1.055) ** 2.4)


def mean(image: bpy.types.Image) -> tuple[float, float, float]:
    """The mean color, linear, of an image without an obstacle that is wrapped around the world (equirectangular)."""
    picture = picture_of(image)
    pixels = picture.values.astype(np.float64)
    if picture.srgb:
        pixels = linear(pixels)
    height = len(pixels)
    weights = np.sin((np.arange(height) + 0.5) * np.pi / height)
    return tuple(np.average(pixels.mean(axis=1), axis=0, weights=weights).tolist())


def _pixels(image: bpy.types.Image) -> np.ndarray:
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, image.channels)


def _multiplied(pixels: np.ndarray, dtype: type[np.unsignedinteger]) -> np.ndarray:
    """Colors times their alpha as Cycles does it, in whole numbers. By rows: there may be gigabytes."""
    most = np.uint32(np.iinfo(dtype).max)
    multiplied = np.empty((*pixels.shape[:2], 3), dtype)
    for row, to in zip(pixels, multiplied, strict=True):
        levels = np.rint(row * np.float32(most)).astype(np.uint32)
        to[:] = levels[:, :3] * levels[:, 3:] // most
    return multiplied


def _encoded(image: bpy.types.Image) -> np.ndarray:
    """The numbers in an image's file; what Blender decodes from two bytes is off by up to 3e-4 of itself."""
    with overridden() as overrides:
        raw = image.original.copy()
        overrides.afterwards(bpy.data.images.remove, raw)
        raw.colorspace_settings.name = "Non-Color"
        return _pixels(raw)
