"""Pictures of light are shown through the scene's view transform, and the scene stays as it is."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.rendering import displayed


def shown(scene, folder, light):
    np.save(folder / "light.npy", light)
    displayed.write_png(scene, folder / "light.npy")
    assert [path.name for path in folder.iterdir()] == ["light.png"]
    image = bpy.data.images.load(str(folder / "light.png"))
    pixels = np.empty(light.shape[0] * light.shape[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return np.round(255 * pixels.reshape(*light.shape[:2], 4)[..., :3])


def srgb(linear):
    return np.round(255 * (1.055 * np.asarray(linear) ** (1 / 2.4) - 0.055))


def test_light_is_shown_as_f12_shows_it(fresh_blender, scene, tmp_path):
    """Middle gray by sRGB's formula, twice as bright with an exposure of 1; and AgX makes another of it."""
    light = np.full((3, 5, 3), 0.18, np.float32)
    light[0, :, 1], light[2] = 0.05, 1.0  # from the lowest row on
    scene.view_settings.view_transform = "Standard"
    plain = shown(scene, tmp_path, light)
    np.testing.assert_allclose(plain[1], srgb(0.18), atol=1)
    np.testing.assert_allclose(plain[0, :, 1], srgb(0.05), atol=1)
    scene.view_settings.exposure = 1.0
    np.testing.assert_allclose(shown(scene, tmp_path, light)[1], srgb(0.36), atol=1)
    scene.view_settings.exposure, scene.view_settings.view_transform = 0.0, "AgX"
    assert plain[2].min() == 255 and shown(scene, tmp_path, light)[2].max() < 250


def test_the_scenes_own_file_settings_are_given_back(fresh_blender, scene, tmp_path):
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    images = len(bpy.data.images)
    shown(scene, tmp_path, np.zeros((2, 2, 3), np.float32))
    assert settings.file_format == "OPEN_EXR_MULTILAYER" and len(bpy.data.images) == images
