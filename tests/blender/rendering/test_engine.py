"""The render engine: what a render by it writes is what the tracer computes, bit for bit; what fails is one sentence."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import image
from viewcam_addon.blender import versions
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.rendering import engine
from viewcam_addon.image import SETTINGS
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer import render as renders
from viewcam_addon.tracer.render import render

pytestmark = pytest.mark.slow

LEVELS = ("geometry", "direct", "path")
SAMPLES, SEED = 3, 5


@pytest.fixture
def lit(scene, monkey, add):
    """Suzanne above a red floor, under a sun, an area lamp and a gray sky, 64 × 48 pixels, to be rendered by the engine."""
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1))
    for kind, energy in (("SUN", 2.0), ("AREA", 300.0)):
        lamp = bpy.data.lights.new(kind, kind)
        lamp.energy = energy
        add(lamp, location=(2, -3, 5))
    scene.world = bpy.data.worlds.new("Sky")
    scene.render.engine = "VIEWCAM"
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    settings = scene.virtual_pinhole_reference
    settings.level, settings.samples, settings.seed = "PATH", SAMPLES, SEED
    versions.set_multilayer_file(scene.render.image_settings)
    return scene


@pytest.fixture
def write(scene, tmp_path):
    """A function that renders the scene to a file, as F12 does, and returns its channels by name, rows from the bottom."""

    def render_to_file(**options):
        path = tmp_path / "written.exr"
        path.unlink(missing_ok=True)
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True, **options)
        return channels(path)

    return render_to_file


def channels(path):
    """Read in a process without Blender, which has an OpenEXR library of its own."""
    program = (
        "import sys, numpy, OpenEXR; parts = OpenEXR.File(sys.argv[1], separate_channels=True).parts; "
        "numpy.savez(sys.argv[2], **{name: channel.pixels[::-1] for part in parts for name, channel in part.channels.items()})"
    )
    search_path = os.pathsep.join(filter(None, sys.path))
    arrays = path.with_suffix(".npz")
    subprocess.run([sys.executable, "-c", program, path, arrays], check=True, env=os.environ | {"PYTHONPATH": search_path})
    with np.load(arrays) as archive:
        return dict(archive)


def written(name, passes, layer="ViewLayer"):
    """One pass of those that were written, (height, width, channels)."""
    names = [f"{layer}.{versions.pass_name(name)}.{letter}" for letter in image.CHANNELS[name]]
    return np.stack([passes[each] for each in names], axis=-1)


def traced(level="path", samples=SAMPLES, seed=SEED):
    """The engine's picture by another way: exported, and traced outside of any engine."""
    return render(jobs.export(Job(level=level)), level, samples, seed, threads=1)


def ask_for_all_passes(view_layer):
    for property_name in SETTINGS.values():
        setattr(view_layer, property_name, True)
    bpy.context.scene.virtual_pinhole_reference.use_pass_variance = True


@pytest.mark.parametrize("level", LEVELS)
def test_every_pass_is_what_the_tracer_computes_bit_for_bit(lit, write, level):
    lit.virtual_pinhole_reference.level = level.upper()
    ask_for_all_passes(lit.view_layers[0])
    hits, expected = write(), traced("geometry") | traced(level)
    for name in ("Combined", *SETTINGS, "Variance"):
        values = written(name, hits)
        if name in expected:
            assert np.array_equal(values, expected[name]), f"{name} differs by up to {np.abs(values - expected[name]).max()}"
        elif name != "Combined":
            assert not values.any(), f"level {level} has no {name}, and it is not empty"


@pytest.fixture
def prepared(monkeypatch):
    """One word for each tracer that is made: "same" if it has the hierarchies of one before it, else "new"."""
    result = []
    real = renders.Tracer.__init__

    def init(self, scene, threads=None, kept=None):
        before = None if kept is None else kept._core
        real(self, scene, threads, kept)
        result.append("same" if self._core is before else "new")

    monkeypatch.setattr(renders.Tracer, "__init__", init)
    return result


@pytest.mark.parametrize("persistent", [False, True])
def test_persistent_data_keeps_what_frames_share(persistent, lit, prepared, tmp_path):
    ask_for_all_passes(lit.view_layers[0])
    lit.frame_end = 3
    for frame in (1, 3):
        lit.camera.location.x = frame / 4
        lit.camera.keyframe_insert("location", frame=frame)
    lit.render.use_persistent_data = persistent
    lit.render.filepath = str(tmp_path / "frame")
    bpy.ops.render.render(animation=True)
    assert prepared == (["new"] + ["same"] * 5 if persistent else ["new", "same"] * 3)
    for frame in (1, 2, 3):
        lit.frame_set(frame)
        read_image = channels(tmp_path / f"frame{frame:04}.exr")
        assert np.array_equal(written("Combined", read_image), traced()["Combined"]), f"frame {frame} is another picture"


def test_another_seed_is_another_picture_and_another_number_of_threads_is_not(lit, write):
    first = write()
    lit.render.threads = 1
    assert np.array_equal(written("Combined", write()), written("Combined", first))
    lit.virtual_pinhole_reference.seed += 1
    assert not np.array_equal(written("Combined", write()), written("Combined", first))


def test_only_passes_that_the_view_layer_asks_for_are_written(lit, write):
    lit.view_layers[0].use_pass_normal = True
    assert {name.rpartition(".")[0] for name in write()} == {"ViewLayer.Combined", "ViewLayer.Normal"}


def test_level_geometry_shows_surfaces_as_a_lamp_at_the_eye_would(lit, write):
    lit.virtual_pinhole_reference.level = "GEOMETRY"
    combined, expected = written("Combined", write()), traced("geometry")
    hit = expected["Depth"][..., 0] < image.BACKGROUND_DEPTH
    assert 0 < hit.mean() < 1
    assert np.array_equal(combined[..., 3], hit)
    assert all(np.array_equal(combined[..., i], expected["Facing"][..., 0]) for i in range(3))


def test_automatic_is_the_least_level_that_the_scene_needs(lit, write):
    lit.virtual_pinhole_reference.level = "AUTO"
    assert np.array_equal(written("Combined", write()), traced("path")["Combined"])
    lit.cycles.max_bounces = 0
    assert np.array_equal(written("Combined", write()), traced("direct")["Combined"])


@pytest.mark.parametrize("crop", [True, False])
def test_a_border_is_that_part_of_the_picture(lit, write, crop):
    whole = written("Combined", write())
    frame = lit.render
    frame.use_border, frame.use_crop_to_border = True, crop
    frame.border_min_x, frame.border_max_x, frame.border_min_y, frame.border_max_y = 0.25, 0.75, 0.5, 0.875
    lit.view_layers[0].use_pass_z = True
    picture = write()
    combined, part = written("Combined", picture), (slice(24, 42), slice(16, 48))
    if crop:
        assert np.array_equal(written("Depth", picture), traced()["Depth"])
        assert combined.shape == (18, 32, 4)
    else:
        assert combined.shape == whole.shape
        combined = combined[part]
    # Random numbers go by the pixel's place in what is rendered: other noise, the same mean.
    assert np.abs(combined[..., :3].mean() - whole[part][..., :3].mean()) < 0.05 * whole[part][..., :3].mean()


def test_percentage_and_pixel_aspect_are_those_of_the_tracers_camera(lit, write):
    lit.render.resolution_percentage, lit.render.pixel_aspect_x = 75, 1.5
    combined = written("Combined", write())
    assert combined.shape == (36, 48, 4)
    assert np.array_equal(combined, traced()["Combined"])


def test_each_view_layer_shows_its_own(lit, write, camera):
    bpy.ops.mesh.primitive_cube_add()
    hidden = bpy.data.collections.new("Hidden in the second")
    lit.collection.children.link(hidden)
    cube = bpy.context.object
    lit.collection.objects.unlink(cube)
    hidden.objects.link(cube)
    second = lit.view_layers.new("Second")
    second.layer_collection.children[hidden.name].exclude = True
    picture = write()
    assert np.array_equal(written("Combined", picture), traced()["Combined"])
    lit.view_layers[0].use = False
    assert np.array_equal(written("Combined", picture, "Second"), written("Combined", write(), "Second"))
    assert not np.array_equal(written("Combined", picture), written("Combined", picture, "Second"))


def test_frames_of_an_animation_show_the_animated_pinhole(lit, camera_object, tmp_path):
    group = camera_object.virtual_pinhole
    group.enabled = True
    for frame, height in ((1, 4), (2, 6)):
        group.eye = (0, -7, height)
        group.keyframe_insert("eye", frame=frame)
    lit.frame_start, lit.frame_end = 1, 2
    lit.render.filepath = str(tmp_path / "frame")
    lit.frame_set(1)
    bpy.ops.render.render(animation=True)
    pictures = [written("Combined", channels(tmp_path / f"frame000{frame}.exr")) for frame in (1, 2)]
    for frame, picture in zip((1, 2), pictures, strict=True):
        lit.frame_set(frame)
        assert np.array_equal(picture, traced()["Combined"])
    assert not np.array_equal(*pictures)


def test_a_transparent_film_leaves_the_sky_see_through(lit, write):
    lit.render.film_transparent = True
    combined = written("Combined", write())
    assert np.array_equal(combined, traced()["Combined"])
    alpha = combined[..., 3]
    assert alpha.min() == 0 and alpha.max() == 1 and not combined[alpha == 0].any()


def test_clay_is_one_material_for_all(lit, write, monkey):
    lit.virtual_pinhole_reference.clay = True
    plain = written("Combined", write())
    material = bpy.data.materials.new("Red")
    monkey.data.materials.append(material)
    versions_tree(material).nodes["Principled BSDF"].inputs["Base Color"].default_value = (1, 0, 0, 1)
    assert np.array_equal(written("Combined", write()), plain)
    lit.virtual_pinhole_reference.clay = False
    assert not np.array_equal(written("Combined", write()), plain)


def versions_tree(material):
    material.use_nodes = True
    return material.node_tree


def fails(write, words):
    with pytest.raises(RuntimeError) as caught:
        write()
    (sentence,) = set(str(caught.value).strip().splitlines())
    assert words in sentence and "Traceback" not in sentence, sentence
    assert not Path(bpy.context.scene.render.filepath).exists()


def test_a_camera_that_is_no_pinhole_is_one_sentence_and_no_file(lit, write, camera_object):
    camera_object.data.type = "ORTHO"
    fails(write, "Camera 'Camera' is orthographic")


def test_no_camera_is_one_sentence_and_no_file(lit, write):
    lit.camera = None
    fails(write, "no camera")


def test_stereoscopy_is_one_sentence_and_no_file(lit, write):
    lit.render.use_multiview = True
    fails(write, "Stereoscopy is on")


@pytest.mark.parametrize("after", [0, 1])
def test_a_bug_is_one_sentence_and_no_file_even_when_part_of_the_picture_is_there(lit, write, monkeypatch, capfd, after):
    real = engine.bands

    def broken(*arguments):
        bands = real(*arguments)
        for _ in range(after):
            yield next(bands)
        raise KeyError("gone")

    monkeypatch.setattr(engine, "bands", broken)
    fails(write, "this is a bug, please report it (KeyError at test_engine.py:")
    assert "Traceback" not in "".join(capfd.readouterr())


def test_what_can_not_be_modeled_is_one_warning(lit, write, monkey, camera_object, capfd):
    camera_object.data.dof.use_dof = True
    monkey.is_shadow_catcher = True
    write()
    output = [line for line in "".join(capfd.readouterr()).splitlines() if "Not modeled" in line]
    assert len(output) == 1, output
    assert "Depth of field is on" in output[0] or "a shadow catcher" in output[0]


def test_a_render_changes_nothing_in_the_file(lit, write):
    ask_for_all_passes(lit.view_layers[0])
    lit.render.use_border = True
    bpy.context.view_layer.update()
    before = settings_of(lit)
    write()
    after = settings_of(lit)
    assert {name for name in after if after[name] != before[name]} == {"render.filepath"}


def settings_of(scene):
    result = {}
    owners = {"": scene, "render.": scene.render, "cycles.": scene.cycles, "layer.": scene.view_layers[0]}
    owners |= {f"{block.name}.": block for block in scene.objects}
    owners |= {f"{block.name}.data.": block.data for block in scene.objects}
    for prefix, owner in owners.items():
        for prop in owner.bl_rna.properties:
            if prop.type in ("BOOLEAN", "INT", "FLOAT", "ENUM", "STRING") and not prop.is_readonly:
                value = getattr(owner, prop.identifier)
                result[prefix + prop.identifier] = tuple(map(repr, value)) if getattr(prop, "is_array", False) else repr(value)
    return result | {"counts": [len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "materials", "scenes")]}
