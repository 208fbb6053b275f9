"""EEVEE and Workbench beside the tracer: what they draw is judged, nothing is left behind, and who can't draw says so."""

import subprocess
import sys

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.rendering import displayed, graphics
from viewcam_addon.errors import InputError
from viewcam_addon.jobs.job import Job


@pytest.fixture
def ball(fresh_blender, scene):
    """A ball on a floor, 64 × 48 pixels."""
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, location=(0, 0, 1))
    bpy.ops.mesh.primitive_plane_add(size=20)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -8, 3), (1.3, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return bpy.data.objects["Sphere"]


def settings(scene):
    """The settings that a raster render overrides, as they stand."""
    shading, layer = scene.display.shading, scene.view_layers[0]
    return [
        scene.render.engine,
        scene.render.film_transparent,
        scene.render.filter_size,
        scene.render.use_stamp_note,
        scene.render.stamp_note_text,
        scene.eevee.taa_render_samples,
        shading.light,
        shading.color_type,
        layer.material_override,
        layer.use_pass_z,
        [output.name for output in layer.aovs],
        [material.name for material in bpy.data.materials],
        [tuple(each.color) for each in bpy.data.objects],
    ]


def verdict(folder, engine, scene):
    """The sentence of a comparison with the tracer, made in a process without Blender's OpenEXR; and the exit status."""
    from viewcam_addon.tracer.scene import scene_file

    before = settings(scene)
    scene.view_layers[0].aovs.add().name = "Artist's"
    before[-3] = ["Artist's"]
    exported = jobs.both_sides(Job(engine=engine, threads=2), [folder / "test.exr"])
    assert settings(scene) == before
    scene_file.write(exported, folder / "scene.json")
    program = """
import sys
from viewcam_addon.cli import main
scene, traced, test = sys.argv[1:]
main(["render", scene, traced]) and sys.exit(9)
sys.exit(main(["compare", traced, test, "--scene", scene]))
"""
    words = [str(folder / name) for name in ("scene.json", "traced.exr", "test.exr")]
    done = subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True)
    return done.returncode, done.stdout.splitlines()[-1] + done.stderr


@pytest.mark.exhaustive
@pytest.mark.parametrize("engine", ["EEVEE", "WORKBENCH"])
def test_what_an_engine_draws_is_what_the_tracer_sees_or_it_is_refused(engine, ball, scene, tmp_path):
    """EEVEE compiles its shaders for ten seconds where there is no graphics card."""
    is_old = engine == "EEVEE" and bpy.app.version < (5, 0)
    if is_old or not graphics.are_there():
        with pytest.raises(InputError, match="5.0 or newer" if is_old else "graphics driver"):
            jobs.both_sides(Job(engine=engine), [tmp_path / "test.exr"])
        return
    status, sentence = verdict(tmp_path, engine, scene)
    assert status == 0 and sentence.startswith("The same picture"), sentence


def test_without_a_driver_there_is_one_sentence_and_no_file(ball, scene, tmp_path, monkeypatch):
    monkeypatch.setattr(graphics, "are_there", lambda: False)
    with pytest.raises(InputError, match="WORKBENCH needs a graphics driver, and there is none: install one"):
        jobs.both_sides(Job(engine="WORKBENCH"), [tmp_path / "test.exr"])
    assert not list(tmp_path.iterdir())


# --- Pictures of light are shown through the scene's view transform, and the scene stays as it is


def displayed_bytes(scene, folder, light):
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
    plain = displayed_bytes(scene, tmp_path, light)
    np.testing.assert_allclose(plain[1], srgb(0.18), atol=1)
    np.testing.assert_allclose(plain[0, :, 1], srgb(0.05), atol=1)
    scene.view_settings.exposure = 1.0
    np.testing.assert_allclose(displayed_bytes(scene, tmp_path, light)[1], srgb(0.36), atol=1)
    scene.view_settings.exposure, scene.view_settings.view_transform = 0.0, "AgX"
    assert plain[2].min() == 255 and displayed_bytes(scene, tmp_path, light)[2].max() < 250


def test_the_scenes_own_file_settings_are_given_back(fresh_blender, scene, tmp_path):
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    images = len(bpy.data.images)
    displayed_bytes(scene, tmp_path, np.zeros((2, 2, 3), np.float32))
    assert settings.file_format == "OPEN_EXR_MULTILAYER" and len(bpy.data.images) == images
