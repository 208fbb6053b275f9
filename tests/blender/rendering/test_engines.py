"""Cycles' settings are overridden: restored whatever happens, and right while they last.

EEVEE and Workbench beside the tracer: what they draw is judged, nothing is left behind, and who can't draw says so.

A file that Blender wrote is whole or is seen not to be; attributes can be taken out of it, and nothing else.
"""

import ctypes
import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from viewcam_addon.blender.rendering.exr import is_whole, strip
from viewcam_addon.image import Image, read, write

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import another_blender, temporary_settings, versions
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.rendering import cycles, picture_files, rasters
from viewcam_addon.blender.scenes import depsgraph
from viewcam_addon.blender.temporary_settings import numbered_indices, overridden
from viewcam_addon.errors import InputError
from viewcam_addon.jobs.job import Job

# Properties that describe the settings or follow from them, and brushes (reading some of them crashes 4.2).
NO_SETTINGS = {"rna_type", "is_evaluated", "depsgraph", "tool_settings"}


def dump(block, depth=4):
    """All that can be read of a datablock's own settings, nested and as text, without following other datablocks."""
    result = {}
    for prop in block.bl_rna.properties:
        name = prop.identifier
        if name in NO_SETTINGS:
            continue
        value = getattr(block, name)
        if prop.type not in ("POINTER", "COLLECTION"):
            result[name] = repr(value[:]) if getattr(prop, "is_array", False) else repr(value)
        elif prop.type == "COLLECTION" and depth:
            result[name] = [item.name if isinstance(item, bpy.types.ID) else dump(item, depth - 1) for item in value]
        elif isinstance(value, bpy.types.ID):
            result[name] = value.name
        elif isinstance(value, bpy.types.bpy_struct) and depth:
            result[name] = dump(value, depth - 1)
    return result


def state(scene):
    """Everything of the file that a render of it may have touched."""
    return {
        "scene": dump(scene),
        "objects": {block.name: dump(block, 2) for block in bpy.data.objects},
        "cameras": {block.name: dump(block, 2) for block in bpy.data.cameras},
        "materials": {block.name: dump(block, 2) for block in bpy.data.materials},
        "lights": {block.name: dump(block, 2) for block in bpy.data.lights},
        "worlds": {block.name: dump(block, 2) for block in bpy.data.worlds},
        "trees": {
            block.name: [dump(node, 0) for node in block.node_tree.nodes]
            for block in (*bpy.data.materials, *bpy.data.lights, *bpy.data.worlds)
            if block.node_tree
        },
        "names": [[block.name for block in blocks] for blocks in (bpy.data.materials, bpy.data.scenes, bpy.data.meshes)],
        "frame": (scene.frame_current, scene.frame_subframe),
    }


def differences(before, after, path=""):
    if isinstance(before, dict) and isinstance(after, dict):
        for key in before.keys() | after.keys():
            yield from differences(before.get(key), after.get(key), f"{path}.{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for number, (first, other) in enumerate(zip(before, after, strict=True)):
            yield from differences(first, other, f"{path}[{number}]")
    elif before != after:
        yield f"{path}: {before!r} became {after!r}"


@pytest.fixture
def crowded(scene, camera_object):
    """A scene that has everything switched the way a comparison does not want it."""
    camera_object.location = (0, 0, 8)
    camera_object.data.dof.use_dof = True
    bpy.ops.mesh.primitive_monkey_add()
    monkey = bpy.context.object
    bpy.ops.object.shade_smooth()
    subdivision = monkey.modifiers.new("Subdivision", "SUBSURF")
    subdivision.render_levels = 1
    if hasattr(subdivision, "use_adaptive_subdivision"):
        subdivision.use_adaptive_subdivision = True
    else:
        scene.cycles.feature_set, monkey.cycles.use_adaptive_subdivision = "EXPERIMENTAL", True
    glass = bpy.data.materials.new("Glass")
    glass.use_nodes = True
    shader = glass.node_tree.nodes["Principled BSDF"]
    shader.inputs["Alpha"].default_value = 0.3
    bump = glass.node_tree.nodes.new("ShaderNodeBump")
    glass.node_tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    monkey.data.materials.append(glass)
    monkey.data.materials.append(None)
    bpy.ops.mesh.primitive_cube_add(location=(2, 0, 0))
    bpy.context.object.is_holdout = bpy.context.object.is_shadow_catcher = True
    bpy.ops.mesh.primitive_uv_sphere_add(location=(-2, 0, 0))
    world = bpy.data.worlds.new("Fog")
    world.use_nodes = True
    output = world.node_tree.nodes.get("World Output") or world.node_tree.nodes.new("ShaderNodeOutputWorld")
    world.node_tree.links.new(world.node_tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])
    world.cycles.max_bounces = 3
    scene.world = world
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    scene.collection.objects.link(lamp)
    lamp.location, lamp.data.spread = (0, 0, 5), 1.0
    lamp.data.cycles.max_bounces, lamp.data.cycles.use_multiple_importance_sampling = 3, False
    if not lamp.data.node_tree:
        lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(tree.nodes.new("ShaderNodeObjectInfo").outputs["Random"], emission.inputs["Strength"])
    held_out = bpy.data.collections.new("Held out")
    scene.collection.children.link(held_out)
    scene.view_layers[0].layer_collection.children["Held out"].holdout = True
    scene.view_layers[0].use_pass_mist = True
    scene.view_layers.new("Other")
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 160, 120, 50
    render.use_border, render.border_min_x, render.border_max_x = True, 0.1, 0.9
    render.use_motion_blur = render.use_multiview = render.use_simplify = render.use_stamp = render.use_persistent_data = True
    render.use_freestyle = False
    render.filepath, render.film_transparent = "//never/####", True
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.pixel_filter_type = 77, True, "GAUSSIAN"
    scene.cycles.use_camera_cull = scene.cycles.use_animated_seed = True
    scene.cycles.caustics_reflective, scene.cycles.film_exposure, scene.cycles.seed = False, 0.5, 5
    scene.frame_set(7)
    return scene


@pytest.mark.parametrize("file_format", ["PNG", "JPEG", "OPEN_EXR", "OPEN_EXR_MULTILAYER", "FFMPEG"])
@pytest.mark.parametrize("engine", ["CYCLES", "EEVEE", "BLENDER_WORKBENCH"])
def test_every_override_is_restored(crowded, both_sides, engine, file_format):
    if engine == "EEVEE":
        engine = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0) else "BLENDER_EEVEE"
    crowded.render.engine = engine
    settings = crowded.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = {"OPEN_EXR_MULTILAYER": "MULTI_LAYER_IMAGE", "FFMPEG": "VIDEO"}.get(file_format, "IMAGE")
    settings.file_format = file_format
    if file_format == "PNG":
        settings.color_mode, settings.color_depth, settings.compression = "RGBA", "16", 33
    if file_format == "OPEN_EXR":
        settings.color_depth, settings.exr_codec = "16", "DWAA"
    crowded.render.resolution_x, crowded.render.resolution_y = 160, 120
    before = state(crowded)
    both_sides()
    assert not (changed := list(differences(before, state(crowded)))), "\n".join(changed)


@pytest.mark.parametrize("request_", [{}, {"clay": True}, {"recenter": True}], ids=str)
def test_every_override_for_light_is_restored(crowded, tmp_path, request_):
    crowded.render.image_settings.file_format = "PNG"
    before = state(crowded)
    paths = [tmp_path / "first.exr", tmp_path / "second.exr"]
    exported = jobs.both_sides(Job(level="path", samples=4, threads=2, **request_), paths)
    assert not (changed := list(differences(before, state(crowded)))), "\n".join(changed)
    assert all(path.stat().st_size > 1000 for path in paths) and paths[0].read_bytes() != paths[1].read_bytes()
    reasons = {entry.object: entry.reason for entry in exported.ledger}
    assert "Object Info" in reasons["Lamp"] and "has a volume" in reasons["Fog"]


@pytest.fixture
def settings_of_renders(monkeypatch):
    """The settings of Cycles that each render is made with, in place of rendering."""
    seen = []

    def look(scene, to_file):
        names = ("samples", "seed", "max_bounces", "diffuse_bounces", "pixel_filter_type", "film_exposure")
        seen.append({name: getattr(scene.cycles, name) for name in names})
        passes = (f"use_pass_{name}" for name in ("z", "emit", "position", "diffuse_indirect"))
        seen[-1]["passes"] = {name for name in passes if getattr(scene.view_layers[0], name)}

    monkeypatch.setattr(cycles, "render_still", look)
    monkeypatch.setattr(cycles, "is_whole", lambda path: path.touch() is None)
    return seen


def test_pictures_of_light_share_samples_and_count_seeds(scene, camera_object, tmp_path, settings_of_renders):
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.film_exposure = 9, 3, 2.0
    scene.cycles.pixel_filter_type = "BOX"
    paths = [tmp_path / f"{number}.exr" for number in range(3)]
    jobs.both_sides(Job(level="path", samples=48, seed=7), paths)
    first = 0 if hasattr(scene.cycles, "sample_subset_length") else 1  # before 4.4 the first sample is not counted
    assert [each["samples"] for each in settings_of_renders] == [17 - first] * 3
    assert [each["seed"] for each in settings_of_renders] == [7, 8, 9]
    assert settings_of_renders[0]["max_bounces"] == 9 and settings_of_renders[0]["diffuse_bounces"] == 3
    assert settings_of_renders[0]["pixel_filter_type"] == "BOX" and settings_of_renders[0]["film_exposure"] == 2.0
    assert settings_of_renders[0]["passes"] == {"use_pass_emit", "use_pass_diffuse_indirect"}, "centers need the first sample"


def test_indirect_light_of_diffuse_surfaces_is_not_asked_for_where_they_may_not_scatter(
    scene, camera_object, tmp_path, settings_of_renders
):
    """A ray of a glossy lobe carries the diffuse lobe's value: Cycles' pass is not black, and different from the tracer's."""
    scene.cycles.diffuse_bounces = 0
    scene.view_layers[0].use_pass_diffuse_indirect = True
    exported = jobs.both_sides(Job(level="path", samples=48), [tmp_path / "picture.exr"])
    assert settings_of_renders[0]["passes"] == {"use_pass_emit"} and scene.view_layers[0].use_pass_diffuse_indirect
    assert "Diffuse Indirect" in {entry.object: entry.reason for entry in exported.ledger}[scene.name]


def test_direct_light_has_no_bounces_and_one_sample_is_the_center(scene, camera_object, tmp_path, settings_of_renders):
    jobs.both_sides(Job(level="direct", samples=1), [tmp_path / "picture.exr"])
    (seen,) = settings_of_renders
    assert (seen["samples"], seen["max_bounces"], seen["diffuse_bounces"]) == (1, 0, 0)
    assert seen["pixel_filter_type"] == "BLACKMAN_HARRIS" and seen["passes"] == {
        "use_pass_emit",
        "use_pass_diffuse_indirect",
        "use_pass_z",
    }


def test_the_level_is_the_least_where_it_is_left_to_the_scene(scene, camera_object, tmp_path, settings_of_renders):
    bpy.ops.mesh.primitive_cube_add()
    scene.world = None
    exported = jobs.both_sides(Job(level="auto"), [tmp_path / "dark.exr"])
    assert settings_of_renders[-1]["passes"] >= {"use_pass_position"} and not exported.lamps
    scene.collection.objects.link(bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN")))
    exported = jobs.both_sides(Job(level="auto"), [tmp_path / "lit.exr"])
    assert settings_of_renders[-1]["max_bounces"] == exported.bounces.total and exported.lamps


def test_everything_is_given_back_after_an_error(crowded, camera_object, tmp_path, monkeypatch):
    crowded.render.image_settings.file_format = "OPEN_EXR"
    before = state(crowded)

    def fail(*_arguments, **_options):
        raise RuntimeError("Error: out of everything")

    monkeypatch.setattr(cycles, "render_still", fail)
    with pytest.raises(RuntimeError, match="out of everything"):
        cycles.render(crowded, crowded.view_layers[0], camera_object, tmp_path / "picture.exr")
    assert not (changed := list(differences(before, state(crowded)))), "\n".join(changed)
    assert not list(tmp_path.iterdir()), "a partial file remains"


def test_a_change_is_seen_by_the_dump(crowded):
    """The tests above must be able to fail."""
    before = state(crowded)
    crowded.render.image_settings.color_mode = "BW"
    crowded.cycles.samples = 78
    bpy.data.objects["Cube"].pass_index = 1
    bpy.data.materials["Glass"].node_tree.nodes["Principled BSDF"].mute = True
    changed = [each.partition(":")[0] for each in differences(before, state(crowded))]
    assert len(changed) >= 4, changed


def test_a_loan_is_given_back_in_reverse_even_when_giving_back_fails(scene):
    scene.cycles.samples = 5
    order = []

    def fail():
        order.append("failed")
        raise ValueError("gone")

    with pytest.raises(ValueError, match="gone"), overridden() as overrides:
        overrides.set(scene.cycles, "samples", 1)
        overrides.afterwards(fail)
        overrides.afterwards(order.append, "first")
    assert order == ["first", "failed"] and scene.cycles.samples == 5


def test_an_error_in_the_visit_of_a_depsgraph_is_raised_and_the_engine_given_back(scene, camera_object):
    scene.render.engine = "CYCLES"

    def fail(_depsgraph):
        raise InputError("nobody is here: come back later")

    with pytest.raises(InputError, match="nobody is here"):
        depsgraph.visit(scene, fail)
    assert scene.render.engine == "CYCLES"
    assert not hasattr(bpy.types, "VIEWCAM_VISITOR") and depsgraph.visit(scene, lambda graph: graph.mode) == "RENDER"


def test_a_scene_without_a_camera_can_not_be_rendered_and_says_why(scene):
    with pytest.raises(InputError, match="can't render scene 'Scene'"):
        depsgraph.visit(scene, lambda graph: graph.mode)


def test_threads_are_limited_for_the_time_of_the_render(scene, camera_object, tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(
        cycles, "render_still", lambda scene, to_file: seen.append((scene.render.threads_mode, scene.render.threads))
    )
    with pytest.raises(InputError):  # nothing was written
        cycles.render(scene, scene.view_layers[0], camera_object, tmp_path / "picture.exr", threads=3)
    assert seen == [("FIXED", 3)] and scene.render.threads_mode == "AUTO"


def test_objects_and_materials_are_numbered_from_one_where_all_have_none(scene, camera_object):
    bpy.ops.mesh.primitive_cube_add()
    first, second = bpy.data.materials.new("First"), bpy.data.materials.new("Second")
    with numbered_indices():
        assert sorted(block.pass_index for block in bpy.data.objects) == [1, 2]
        assert (first.pass_index, second.pass_index) == (1, 2)
    assert not any(block.pass_index for block in (*bpy.data.objects, *bpy.data.materials))


def test_an_artists_own_numbers_stay(scene, camera_object):
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.pass_index = 40
    bpy.data.materials.new("First")
    with pytest.raises(KeyError), numbered_indices():
        assert sorted(block.pass_index for block in bpy.data.objects) == [0, 40]
        assert bpy.data.materials["First"].pass_index == 1
        raise KeyError
    assert sorted(block.pass_index for block in bpy.data.objects) == [0, 40]
    assert bpy.data.materials["First"].pass_index == 0


def test_more_objects_than_indices_start_again(scene, camera_object, monkeypatch):
    monkeypatch.setattr(temporary_settings, "LARGEST_INDEX", 2)
    for name in "abc":
        bpy.data.objects.new(name, None)
    with numbered_indices():
        assert [block.pass_index for block in bpy.data.objects] == [1, 2, 1, 2]


def test_a_file_whose_color_mode_its_format_does_not_know_is_rendered(crowded, tmp_path):
    """Some real files have such a mode, and no property of Blender's can set it."""
    settings = crowded.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode = "JPEG", "RGB"
    start = (ctypes.c_ubyte * 8).from_address(settings.as_pointer())
    start[list(start).index(24)] = 32  # bits a pixel
    assert settings.color_mode == "", "this Blender keeps it elsewhere"
    view_layer = crowded.view_layers[0]
    cycles.render(crowded, view_layer, crowded.camera, tmp_path / "picture.exr")
    assert settings.file_format == "JPEG" and settings.color_mode in ("BW", "RGB")


def test_a_video_with_an_alpha_channel_is_given_back_with_its_codec(crowded):
    settings, video = crowded.render.image_settings, crowded.render.ffmpeg
    if hasattr(settings, "media_type"):
        settings.media_type = "VIDEO"
    settings.file_format = "FFMPEG"
    video.format = video.codec = "WEBM"  # 4.2 makes it MKV as it comes back to videos, which knows no alpha
    settings.color_mode = "RGBA"
    with overridden() as overrides:
        picture_files.override_formats(overrides, crowded)
        versions.set_multilayer_file(settings)
    kept = (settings.file_format, video.format, video.codec, settings.color_mode)
    assert kept == ("FFMPEG", "WEBM", "WEBM", "RGBA")


class _Device:
    def __init__(self, kind):
        self.type, self.use = kind, kind == "CPU"


class _Preferences:
    """Cycles' own, of a machine with a graphics card."""

    def __init__(self):
        self.compute_device_type = "NONE"
        self.devices = [_Device("CUDA"), _Device("CPU")]

    def get_device_types(self, _context):
        return [("NONE", "None", "", 0), ("CUDA", "CUDA", "", 1), ("HIP", "HIP", "", 4)]

    def get_devices_for_type(self, kind):
        return [each for each in self.devices if each.type in (kind, "CPU")]


def test_a_device_is_all_of_its_kind_and_no_processor_beside_them(fresh_blender, scene, monkeypatch):
    preferences = _Preferences()
    addons = {"cycles": SimpleNamespace(preferences=preferences)}
    context = SimpleNamespace(preferences=SimpleNamespace(addons=addons))
    monkeypatch.setattr(cycles, "bpy", SimpleNamespace(context=context))
    with overridden() as overrides:
        cycles._override_device(overrides, scene, "CUDA")
        assert [each.use for each in preferences.devices] == [True, False]
        assert preferences.compute_device_type == "CUDA" and scene.cycles.device == "GPU"
    assert [each.use for each in preferences.devices] == [False, True] and preferences.compute_device_type == "NONE"
    with overridden() as overrides, pytest.raises(InputError, match=r"no HIP device that Cycles .* are CUDA, HIP\): leave"):
        cycles._override_device(overrides, scene, "HIP")
    assert scene.cycles.device == "CPU"


def test_a_device_that_is_not_there_is_one_sentence_and_nothing_is_rendered(fresh_blender, scene, camera, tmp_path):
    with pytest.raises(InputError, match="there is no METAL device that Cycles could render on"):
        cycles.render(scene, scene.view_layers[0], camera, tmp_path / "a.exr", device="METAL")
    assert not (tmp_path / "a.exr").exists()


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
    if is_old or not rasters.can_draw():
        with pytest.raises(InputError, match="5.0 or newer" if is_old else "graphics driver"):
            jobs.both_sides(Job(engine=engine), [tmp_path / "test.exr"])
        return
    status, sentence = verdict(tmp_path, engine, scene)
    assert status == 0 and sentence.startswith("The same picture"), sentence


def test_another_blender_keeps_its_hands_off_the_users_extensions():
    """One that reads factory settings has none enabled, and removes the wheels of all that are installed."""
    done = another_blender.run("import bpy; print('EXTENSIONS', bpy.utils.user_resource('EXTENSIONS'))", 60)
    line = next(line for line in done.stdout.decode().splitlines() if line.startswith("EXTENSIONS"))
    assert bpy.utils.user_resource("EXTENSIONS") not in line, line


def test_without_a_driver_there_is_one_sentence_and_no_file(ball, scene, tmp_path, monkeypatch):
    monkeypatch.setattr(rasters, "can_draw", lambda: False)
    with pytest.raises(InputError, match="WORKBENCH needs a graphics driver, and there is none: install one"):
        jobs.both_sides(Job(engine="WORKBENCH"), [tmp_path / "test.exr"])
    assert not list(tmp_path.iterdir())


# --- Pictures of light are shown through the scene's view transform, and the scene stays as it is


def displayed_bytes(scene, folder, light):
    np.save(folder / "light.npy", light)
    picture_files.write_png(scene, folder / "light.npy")
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


@pytest.fixture(params=[1, 15, 16, 17, 100])
def picture(request, tmp_path):
    """An EXR of one part, with as many rows."""
    noise = np.random.default_rng(1).random((request.param, 50, 1), np.float32)
    write(tmp_path / "picture.exr", Image({"Depth": noise}))
    return tmp_path / "picture.exr"


def test_a_whole_file_is_whole(picture):
    assert is_whole(picture)


def test_a_file_cut_short_is_not(picture):
    content = picture.read_bytes()
    for share in (0.0, 0.01, 0.1, 0.3, 0.9, 0.999):
        picture.write_bytes(content[: int(len(content) * share)])
        assert not is_whole(picture), f"{share} of the file"


def test_a_chunk_that_was_never_written_is_missed(picture):
    """OpenEXR leaves such a chunk behind on a full disk: its offset in the table is 0."""
    content = bytearray(picture.read_bytes())
    chunks = read(picture).size[1]  # one row each, as RLE has them
    # The table ends where the first chunk begins, and its first entry says so.
    table = next(at for at in range(len(content)) if int.from_bytes(content[at : at + 8], "little") == at + 8 * chunks)
    content[table : table + 8] = bytes(8)
    picture.write_bytes(content)
    assert not is_whole(picture)


def test_what_is_no_exr_is_not_whole(tmp_path):
    (tmp_path / "text").write_text("nothing of the kind, but long enough for a header and more")
    assert not is_whole(tmp_path / "text") and not is_whole(tmp_path / "missing")


PARTS = """
import sys, numpy as np, OpenEXR
noise = np.random.default_rng(2).random((40, 30), np.float32)
parts = [
    OpenEXR.Part({"Date": "yesterday", "Note": name, "type": OpenEXR.scanlineimage}, {f"{name}.Z": noise + i}, name)
    for i, name in enumerate(sys.argv[2:])
]
OpenEXR.File(parts).write(sys.argv[1])
"""
TOLD = """
import sys, hashlib, OpenEXR
for part in OpenEXR.File(sys.argv[1], separate_channels=True).parts:
    print(sorted(set(part.header) & {"Date", "Note"}), *(hashlib.md5(c.pixels).hexdigest() for c in part.channels.values()))
"""


def outside(program, *arguments):
    """The text that a program prints that uses OpenEXR, in a process without Blender."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)], env=environment, check=True, text=True, capture_output=True
    ).stdout


@pytest.mark.parametrize("names", [["one"], ["one", "two", "three"]])
def test_an_attribute_is_taken_out_of_each_part_and_no_pixel_changes(tmp_path, names):
    path = tmp_path / "parts.exr"
    outside(PARTS, path, *names)
    before, size = outside(TOLD, path), path.stat().st_size
    strip(path, lambda name: name == "Date")
    assert outside(TOLD, path) == before.replace("'Date', ", "")
    # Name, type, size and value, the first two with a zero at their ends.
    assert size - path.stat().st_size == len(names) * len(b"Date\0string\0....yesterday")
    assert is_whole(path)


def test_what_is_unwanted_by_nobody_stays_byte_for_byte(picture):
    before = picture.read_bytes()
    strip(picture, lambda name: name == "Nothing")
    assert picture.read_bytes() == before
