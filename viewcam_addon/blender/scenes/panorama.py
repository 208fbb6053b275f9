"""A world as Cycles shows it in every direction: what another Blender renders of it for world_image.py.

One sample stands in the middle of each pixel of an equirectangular picture, whose directions are an Environment Texture's to
3e-7 (measured: 4.2, 5.0 and 5.2). Discs of suns are left out of it, and measured by pictures from near.
"""

import math
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import versions
from . import nodes

Pixels = NDArray[np.float32]

_SKIES_WITH_SUN = ("NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING")
_DISC_WIDTH = 256
_MARGIN = math.radians(0.01)  # beside a disc of no size to speak of
_SAME_SIZE = 0.02  # share of a disc's angle that a circle of so many pixels may tell wrongly


def main(library: str, name: str, out: str, width: str, frame: str, subframe: str) -> None:
    """Render the world of this name in a .blend to an npz of what the camera sees and of what lights.

    `seen`, `light` : (width / 2, width, 3) float32, rows from the bottom.
    `seen_suns`, `light_suns` : (n, 7) of each disc its direction, its irradiance on what faces it, and its angle, radians;
        zeros where there is none.
    """
    scene = bpy.context.scene
    with bpy.data.libraries.load(library) as (_, wanted):
        wanted.worlds = [name]
    (scene.world,) = wanted.worlds
    tree = scene.world.node_tree
    for link in list(tree.get_output_node("CYCLES").inputs["Volume"].links):
        tree.links.remove(link)
    for link in nodes.circular_links(tree):
        link.id_data.links.remove(link)
    scene.world.cycles.sampling_method = "NONE"  # there is nothing to light
    scene.frame_set(int(frame), subframe=float(subframe))
    eye = _Eye(scene, f"{out}.exr")
    skies = [node for node in nodes.all_of(tree) if _has_sun(node)]
    for sky in skies:
        sky.sun_disc = False
    arrays: dict[str, np.ndarray] = {}
    for side in ("seen", "light"):
        if side == "light" and not blind_to_camera(tree):
            arrays |= {"light": arrays["seen"], "light_suns": arrays["seen_suns"]}
        else:
            arrays[side] = eye.around(int(width))
            arrays[f"{side}_suns"] = np.array([_sun(sky, eye) for sky in skies]).reshape(-1, 7)
    np.savez(out, **arrays)


def blind_to_camera(tree: bpy.types.NodeTree) -> bool:
    """Let a tree take the camera's rays for those that a matte surface scatters; whether it asked."""
    asked = False
    for node in list(nodes.all_of(tree)):
        if node.type != "LIGHT_PATH":
            continue
        for socket in node.outputs:
            for link in list(socket.links):
                value = node.id_data.nodes.new("ShaderNodeValue")
                value.outputs[0].default_value = float(socket.identifier in ("Is Diffuse Ray", "Is Reflection Ray"))
                node.id_data.links.new(value.outputs[0], link.to_socket)
                asked = True
    return asked


def _has_sun(node: bpy.types.Node) -> bool:
    return node.type == "TEX_SKY" and node.sky_type in _SKIES_WITH_SUN and node.sun_disc and node.sun_intensity > 0


class _Eye:
    """A camera that looks all around from the origin of an empty scene."""

    def __init__(self, scene: bpy.types.Scene, path: str) -> None:
        self._scene, self._path = scene, path
        for block in list(scene.objects):
            bpy.data.objects.remove(block)
        camera = bpy.data.cameras.new("Eye")
        self._object = scene.camera = bpy.data.objects.new("Eye", camera)
        scene.collection.objects.link(self._object)
        camera.type = "PANO"
        self._lens = versions.panorama(camera)
        self._lens.panorama_type = "EQUIRECTANGULAR"
        render, cycles = scene.render, scene.cycles
        render.engine = "CYCLES"
        cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", 1, False, False
        cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", 0.01  # the first sample is in the middle
        render.use_compositing = render.use_sequencer = False
        render.resolution_percentage = 100
        file = render.image_settings
        file.file_format, file.color_mode, file.color_depth, file.exr_codec = "OPEN_EXR", "RGB", "32", "NONE"
        render.filepath, render.use_file_extension = versions.literal_path(Path(path)), False

    def around(self, width: int) -> Pixels:
        """(width / 2, width, 3) of all directions, its middle along x, rows from the bottom."""
        # Its local −z along x, its local y along z.
        return self._look(np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), math.pi, width, width // 2)

    def towards(
        self, direction: NDArray[np.float64], reach: float, width: int
    ) -> tuple[Pixels, NDArray[np.float64], NDArray[np.float64]]:
        """(width, width, 3) round a direction, `reach` radians to all sides; their directions, and the solid angle of each."""
        beside = np.array([1.0, 0.0, 0.0]) if abs(direction[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
        right = np.cross(direction, beside)
        right /= np.linalg.norm(right)
        axes = np.column_stack([right, np.cross(right, direction), -direction])
        pixels = self._look(axes, reach, width, width)
        across = ((np.arange(width) + 0.5) / width * 2 - 1) * reach
        x, y = np.meshgrid(across, across)
        local = np.stack([np.cos(y) * np.sin(x), np.sin(y), -np.cos(y) * np.cos(x)], axis=-1)
        return pixels, local @ axes.T, np.cos(y) * (2 * reach / width) ** 2

    def _look(self, axes: NDArray[np.float64], reach: float, width: int, height: int) -> Pixels:
        matrix = np.eye(4)
        matrix[:3, :3] = axes
        self._object.matrix_world = matrix.T.tolist()
        lens = self._lens
        lens.longitude_min, lens.longitude_max = -reach, reach
        lens.latitude_min, lens.latitude_max = -min(reach, math.pi / 2), min(reach, math.pi / 2)
        self._scene.render.resolution_x, self._scene.render.resolution_y = width, height
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(self._path)
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return np.ascontiguousarray(pixels.reshape(height, width, -1)[..., :3])


def _sun(sky: bpy.types.Node, eye: _Eye) -> tuple[float, ...]:
    """The direction of a sky's sun, the irradiance on what faces it, and its angle, radians; zeros where it has none."""
    across = math.cos(sky.sun_elevation)  # nothing turns a sky that has a sun
    towards = np.array([across * math.sin(sky.sun_rotation), across * math.cos(sky.sun_rotation), math.sin(sky.sun_elevation)])
    reach = 0.6 * sky.sun_size + _MARGIN
    plain, directions, solid_angle = eye.towards(towards, reach, _DISC_WIDTH)
    sky.sun_disc = True
    light = np.maximum(eye.towards(towards, reach, _DISC_WIDTH)[0].astype(np.float64) - plain, 0.0)
    sky.sun_disc = False
    disc = light.any(axis=-1)
    if not disc.any():
        return (0.0,) * 7
    # Where the horizon cuts a disc, what is left of it counts.
    towards = solid_angle[disc] @ directions[disc]
    towards /= np.linalg.norm(towards)
    covered = solid_angle[disc].sum()
    angle = 2 * math.acos(1 - covered / (2 * np.pi))
    if abs(angle / sky.sun_size - 1) < _SAME_SIZE:
        angle = sky.sun_size
    irradiance = np.einsum("ijk,ij,ij->k", light, solid_angle, directions @ towards)
    return (*towards, *irradiance * (2 * np.pi * (1 - math.cos(angle / 2)) / covered), angle)
