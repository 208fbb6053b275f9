"""A hostile .blend, opened by every command: nothing of it runs, and nothing is written but what was asked for.

Each way arms an open file so that it leaves a mark. Trusted it does, or Blender itself has closed the way; untrusted it never
does. `bpy.app.handlers` can't be saved in a file. Blender's fluids end the process that simulated them, so theirs is another.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import child_process
from viewcam_addon.blender import dataset_cameras, opening, versions
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.jobs.renderer import BlenderRenderer
from viewcam_addon.errors import InputError, NotModeledError
from viewcam_addon.jobs.job import Job

pytestmark = pytest.mark.slow


def shots(**more):
    def render(blend, out, trust):
        with BlenderRenderer(blend, trust=trust) as renderer:
            warnings = []
            for frame in (1, 2, 3):
                shot = Job(f"shot_{frame}", (0, -8, 0), (0, 0, 0), (0, 0, 1), 16.0, frame=frame, **more)
                warnings = renderer.render(shot, out / "shot.exr", out / "shot.png")["warnings"]
            return warnings

    return render


def reasons(ledger):
    return [entry.reason for entry in ledger if entry.object.endswith(".blend")]


COMMANDS = {
    "batch": shots(),
    "batch of VIEWCAM": shots(engine="VIEWCAM", level="geometry"),
    "export": lambda blend, out, trust: reasons(jobs.export(Job(blend=blend, frame=2, trust=trust)).ledger),
    "cycles": lambda blend, out, trust: reasons(jobs.cycles(Job(blend=blend, frame=2, trust=trust), out / "a.exr")),
    "check": lambda blend, out, trust: reasons(
        jobs.both_sides(Job(blend=blend, frame=2, trust=trust, level="direct", samples=1), [out / "b.exr"]).ledger
    ),
    "audit": lambda blend, out, trust: list(dataset_cameras.of_pictures(["2"], blend, trust)[0].notes),
    "camera": lambda blend, out, trust: list(dataset_cameras.of_file(blend, [("frame_2", 2)], trust=trust)[0].notes),
}


# Each way: arms the open file, with a cube, a camera and a sun, so that it makes something in the folder `marks`.


def driver(scene, cube, marks):
    curve = cube.driver_add("location", 0).driver
    curve.expression = f"__import__('os').makedirs({str(marks / 'mark')!r}, exist_ok=True) or 0"


def registered_text(scene, cube, marks):
    text = bpy.data.texts.new("hostile.py")
    text.use_module = True
    text.write(
        f"import os\nos.makedirs({str(marks / 'mark')!r}, exist_ok=True)\ndef register(): pass\ndef unregister(): pass\n"
    )


def freestyle_script(scene, cube, marks):
    text = bpy.data.texts.new("hostile.py")
    text.write(f"import os\nos.makedirs({str(marks / 'mark')!r}, exist_ok=True)\n")
    scene.render.use_freestyle = True
    for layer in scene.view_layers:
        layer.use_freestyle, layer.freestyle_settings.mode = True, "SCRIPT"
        module = layer.freestyle_settings.modules.new()
        module.script, module.use = text, True


def freestyle_script_in_a_scene_of_the_compositor(scene, cube, marks):
    other = bpy.data.scenes.new("Other")
    for each in scene.objects:
        other.collection.objects.link(each)
    other.camera, other.render.engine, other.cycles.samples = scene.camera, "CYCLES", 1
    other.render.resolution_x = other.render.resolution_y = 16
    freestyle_script(other, cube, marks)
    composited(scene).scene = other


def file_output_in_a_group(scene, cube, marks):
    layers = composited(scene)
    group = bpy.data.node_groups.new("Inner", "CompositorNodeTree")
    group.interface.new_socket("Image", in_out="INPUT", socket_type="NodeSocketColor")
    start, writer = group.nodes.new("NodeGroupInput"), group.nodes.new("CompositorNodeOutputFile")
    if bpy.app.version >= (5, 0):
        writer.directory = str(marks)
        writer.file_output_items.new("RGBA", "Image")
    else:
        writer.base_path = str(marks)
    group.links.new(start.outputs[0], writer.inputs[0])
    tree = versions.compositor(scene)
    outer = tree.nodes.new("CompositorNodeGroup")
    outer.node_tree = group
    tree.links.new(layers.outputs[0], outer.inputs[0])


def cloth_cache(scene, cube, marks):
    cube.modifiers.new("Cloth", "CLOTH").point_cache.use_disk_cache = True


def soft_body_cache(scene, cube, marks):
    cube.modifiers.new("Soft", "SOFT_BODY").point_cache.use_disk_cache = True


def particle_cache(scene, cube, marks):
    cube.modifiers.new("Particles", "PARTICLE_SYSTEM")
    cube.particle_systems[0].point_cache.use_disk_cache = True


def dynamic_paint_cache(scene, cube, marks):
    bpy.context.view_layer.objects.active = cube
    cube.modifiers.new("Paint", "DYNAMIC_PAINT").ui_type = "CANVAS"
    bpy.ops.dpaint.type_toggle(type="CANVAS")
    cube.modifiers["Paint"].canvas_settings.canvas_surfaces[0].point_cache.use_disk_cache = True


def cache_in_a_folder_of_its_own(scene, cube, marks):
    cache = cube.modifiers.new("Cloth", "CLOTH").point_cache
    cache.use_external, cache.filepath = True, str(marks)
    cache.use_disk_cache = True


def output_path(scene, cube, marks):
    scene.render.filepath, scene.render.use_render_cache = f"{marks}/picture_", True
    composited(scene)


def tx_beside_images(scene, cube, marks):
    image = bpy.data.images.new("image", 64, 64)
    image.filepath_raw, image.file_format = str(marks.with_name("image.png")), "PNG"
    image.save()
    tree = emitting(cube)
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.links.new(texture.outputs[0], tree.nodes["Emission"].inputs[0])
    if bpy.app.version >= (5, 2):
        scene.render.use_texture_cache = scene.render.use_auto_generate_texture_cache = True


def fluid(scene, cube, marks):
    modifier = cube.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "DOMAIN"
    domain = modifier.domain_settings
    domain.cache_directory, domain.domain_type, domain.resolution_max = str(marks), "GAS", 32
    domain.cache_type = "REPLAY"
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, segments=8, ring_count=6)
    bpy.context.object.modifiers.new("Fluid", "FLUID").fluid_type = "FLOW"


def fluid_that_says_it_is_being_baked(scene, cube, marks):
    fluid(scene, cube, marks)
    domain = cube.modifiers["Fluid"].domain_settings
    domain.cache_type = "MODULAR"
    domain.is_cache_baking_data = True


RUNNING = [driver, registered_text, freestyle_script, freestyle_script_in_a_scene_of_the_compositor]
WRITING = [file_output_in_a_group, cloth_cache, soft_body_cache, particle_cache, dynamic_paint_cache]
WRITING += [cache_in_a_folder_of_its_own, output_path, tx_beside_images]
FLUIDS = [fluid, fluid_that_says_it_is_being_baked]
# Never written, trusted or not: a batch's files are its own.
NEVER = {"file_output_in_a_group", "output_path"}


def composited(scene):
    """A compositor that passes the picture on; its node of the render."""
    if bpy.app.version >= (5, 0):
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        output = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        output = tree.nodes.new("CompositorNodeComposite")
    layers = tree.nodes.new("CompositorNodeRLayers")
    tree.links.new(layers.outputs[0], output.inputs[0])
    return layers


def emitting(cube):
    """The nodes of a new material of the cube, with an Emission that is its surface."""
    material = bpy.data.materials.new("Material")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    cube.data.materials.append(material)
    tree = material.node_tree
    tree.nodes.clear()
    emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs[0], output.inputs[0])
    return tree


def hostile_file(way, folder):
    """A .blend that `way` has armed, and the folder of its marks, which has none yet."""
    blend, marks = folder / "file" / "hostile.blend", folder / "marks"
    blend.parent.mkdir(parents=True)
    marks.mkdir()
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    camera = scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    camera.location, camera.rotation_euler = (0, -8, 0), (1.5707964, 0, 0)
    for each in (camera, sun):
        scene.collection.objects.link(each)
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.render.resolution_x = scene.render.resolution_y = 16
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))  # caches on disk are those of a file that has a name
    way(scene, cube, marks)
    bpy.ops.wm.save_mainfile()
    remove(new_paths(folder, {blend, marks, blend.parent, folder / "image.png"}))
    return blend, marks


def new_paths(folder, known):
    """The paths below a folder that were not known."""
    return sorted(path for path in folder.rglob("*") if path not in known and path.suffix != ".blend1")


def remove(paths):
    for path in sorted(paths, reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()


def left_by(blend, trust, out):
    """The paths that each command leaves behind beside what was asked for: name of the command → paths."""
    folder, left = blend.parent.parent, {}
    known = set(folder.rglob("*"))
    for name, command in COMMANDS.items():
        command(blend, out, trust)
        new = new_paths(folder, known)
        left[name] = [str(path.relative_to(folder)) for path in new]
        remove(new)
    return left


@pytest.fixture
def temporary(monkeypatch, tmp_path):
    """Blender's folder of temporary files, in which a render's cache would be."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    paths = bpy.context.preferences.filepaths
    before = paths.temporary_directory, paths.render_cache_directory
    paths.temporary_directory = paths.render_cache_directory = str(folder)
    yield folder
    paths.temporary_directory, paths.render_cache_directory = before


@pytest.mark.parametrize("way", RUNNING + WRITING, ids=lambda way: way.__name__)
def test_nothing_of_a_hostile_file_runs_or_is_written(fresh_blender, temporary, tmp_path, way):
    blend, _ = hostile_file(way, tmp_path / "hostile")
    (tmp_path / "out").mkdir()
    left = left_by(blend, False, tmp_path / "out")
    assert not any(left.values()), left
    assert not list(temporary.rglob("cached_*"))
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.exr", "b.exr", "shot.exr", "shot.png"]


@pytest.mark.parametrize("way", RUNNING + WRITING, ids=lambda way: way.__name__)
def test_trusted_it_does_so_that_the_test_above_can_fail(fresh_blender, temporary, tmp_path, way):
    if way is tx_beside_images and bpy.app.version < (5, 2):
        pytest.skip("Blender writes tx since 5.2")
    blend, _ = hostile_file(way, tmp_path / "hostile")
    (tmp_path / "out").mkdir()
    left = left_by(blend, True, tmp_path / "out")
    assert bool(left["batch"]) == (way.__name__ not in NEVER), left


@pytest.mark.exhaustive
@pytest.mark.parametrize("way", FLUIDS, ids=lambda way: way.__name__)
@pytest.mark.parametrize("trust", [False, True])
def test_no_fluid_is_simulated_into_a_folder_of_the_files_choice(tmp_path, way, trust):
    options = {
        "env": child_process.environment(apart_from=bpy.utils.system_resource("SCRIPTS")),
        "capture_output": True,
        "text": True,
    }
    program = [sys.executable, __file__]
    if bpy.app.binary_path:
        program = [bpy.app.binary_path, "-b", "--factory-startup", "--python-use-system-env", "--python", __file__, "--"]
    subprocess.run([*program, str(tmp_path), way.__name__], check=True, **options)
    child = subprocess.run([*program, str(tmp_path), "trusted" if trust else "untrusted"], check=False, **options)
    left = [str(path.relative_to(tmp_path)) for path in (tmp_path / "hostile" / "marks").rglob("*")]
    if trust:
        assert left, f"the other test could not fail: {child.stderr}"
    else:
        assert child.returncode == 0, child.stderr
        assert not left


SMOKE = """
import os, sys, bpy
bpy.ops.mesh.primitive_cube_add(size=2)
modifier = bpy.context.object.modifiers.new("Fluid", "FLUID")
modifier.show_viewport = False
modifier.fluid_type = "DOMAIN"
modifier.domain_settings.domain_type, modifier.domain_settings.cache_type = "GAS", sys.argv[-2]
modifier.domain_settings.cache_directory = "//gone"
material = bpy.data.materials.new("Smoke")
material.use_nodes = True
tree = material.node_tree
output = tree.nodes["Material Output"]
tree.links.remove(output.inputs["Surface"].links[0])
tree.links.new(tree.nodes.new("ShaderNodeVolumePrincipled").outputs[0], output.inputs["Volume"])
bpy.context.object.data.materials.append(material)
camera = bpy.context.scene.camera
camera.location, camera.rotation_euler = (0, 0, 9), (0, 0, 0)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1])
os._exit(0)
"""


@pytest.mark.slow
@pytest.mark.skipif(bool(bpy.app.binary_path), reason="a Python without Blender's module has no such command; wheels run this")
@pytest.mark.parametrize(
    ("cache", "words", "reason", "answer"),
    [
        ("ALL", ["--trust"], "its cache //gone is missing", "The same picture: "),
        (
            "REPLAY",
            [],
            "it is not baked",
            "The same picture, but for 2 objects that are not modeled (Cube.001, smoke.blend; on ",
        ),
    ],
)
def test_smoke_that_is_off_is_told_and_makes_amber_what_blender_may_show(tmp_path, cache, words, reason, answer):
    """Blender ended with SIGABRT as it evaluated a cache that is missing, and Cycles with SIGSEGV as it asked for the smoke."""
    environment = child_process.environment(apart_from=bpy.utils.system_resource("SCRIPTS"))
    blend, options = tmp_path / "smoke.blend", {"env": environment, "capture_output": True, "text": True}
    subprocess.run([sys.executable, "-c", SMOKE, cache, str(blend)], check=True, **options)
    child = subprocess.run([*child_process.viewcam("check"), str(blend), "--size", "48x27", *words], check=False, **options)
    assert child.returncode == 0, child.stderr
    assert f"the modifier 'Fluid' of 'Cube.001' is off: {reason}" in child.stdout, child.stdout
    assert child.stdout.splitlines()[-1].startswith(answer), child.stdout


def test_what_is_off_is_told(fresh_blender, tmp_path):
    blend, _ = hostile_file(freestyle_script, tmp_path / "hostile")
    (tmp_path / "out").mkdir()
    for name, command in COMMANDS.items():
        first, *_ = command(blend, tmp_path / "out", False)  # Blender 4.5 and 5.2 have a second to say
        assert "Freestyle draws no lines in view layer 'ViewLayer'" in first and "--trust" in first, name
        assert command(blend, tmp_path / "out", True) == [], name
    with pytest.raises(NotModeledError, match="Freestyle"):
        jobs.export(Job(blend=blend, strict=True))


def test_a_file_that_blender_reads_but_for_something_is_open_and_that_is_told(fresh_blender, scene, camera_object, tmp_path):
    """A strip in a channel that Blender has no more: it says "Error", and goes on."""
    strips = scene.sequence_editor_create()
    strips = strips.strips if hasattr(strips, "strips") else strips.sequences
    length = "length" if bpy.app.version >= (5, 0) else "frame_end"
    strips.new_effect("Strip", "COLOR", channel=113, frame_start=1, **{length: 20})
    blend = tmp_path / "strip.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), compress=False)
    blend.write_bytes(blend.read_bytes().replace((113).to_bytes(4, "little"), (200).to_bytes(4, "little")))
    (entry,) = jobs.export(Job(blend=blend)).ledger
    assert entry.status == "approximated" and "channel larger than 128" in entry.reason and "--trust" not in entry.reason


@pytest.mark.parametrize("way", [driver, registered_text])
def test_python_that_did_not_run_is_told(fresh_blender, tmp_path, way):
    blend, _ = hostile_file(way, tmp_path / "hostile")
    (tmp_path / "out").mkdir()
    for name, command in COMMANDS.items():
        (sentence,) = command(blend, tmp_path / "out", False)
        assert "ython of the file does not run" in sentence and "--trust" in sentence, name


def test_a_file_that_is_open_is_disarmed_and_given_back(fresh_blender, tmp_path):
    blend, _ = hostile_file(freestyle_script, tmp_path / "hostile")
    layer = bpy.context.view_layer
    with opening.opened(None) as (_, off):
        assert not layer.use_freestyle and len(off) == 1
    assert layer.use_freestyle
    with opening.opened(None, trust=True) as (_, off):
        assert layer.use_freestyle and not off
    hostile = tmp_path / "other"
    fresh_blender.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    blend, _ = hostile_file(registered_text, hostile)
    bpy.ops.wm.open_mainfile(filepath=str(blend), use_scripts=False)
    with pytest.raises(InputError, match="--enable-autoexec before the file"), opening.opened(None, trust=True):
        pass


SHADER = "shader red(output color C = 0) { C = color(1, 0, 0); }"


@pytest.mark.parametrize("mode", ["EXTERNAL", "INTERNAL"])
def test_a_shader_of_the_file_shades_nothing_unless_it_is_trusted(fresh_blender, tmp_path, mode):
    import _cycles

    if not _cycles.with_osl:
        pytest.skip("this Blender has no Open Shading Language")

    def script_node(scene, cube, marks):
        source, bytecode = tmp_path / "red.osl", tmp_path / "red.oso"
        source.write_text(SHADER)
        assert _cycles.osl_compile(str(source), str(bytecode))
        scene.cycles.shading_system = True
        scene.view_settings.view_transform = "Standard"
        tree = emitting(cube)
        node = tree.nodes.new("ShaderNodeScript")
        node.mode = mode
        if mode == "EXTERNAL":
            node.filepath = str(bytecode)
        else:
            node.script = bpy.data.texts.new("red.osl")
            node.script.write(SHADER)
            node.bytecode, node.bytecode_hash = bytecode.read_text(), "any"
        if not node.outputs:
            node.outputs.new("NodeSocketColor", "C")
        tree.links.new(node.outputs[0], tree.nodes["Emission"].inputs[0])

    blend, _ = hostile_file(script_node, tmp_path / "hostile")
    (tmp_path / "out").mkdir()
    red = {}
    for trust in (True, False):
        entries = COMMANDS["batch"](blend, tmp_path / "out", trust)
        image = bpy.data.images.load(str(tmp_path / "out" / "shot.png"), check_existing=False)
        middle = tuple(image.pixels)[4 * (8 * 16 + 8) :][:3]
        red[trust] = middle == (1, 0, 0)
        assert any("Open Shading Language is off" in sentence for sentence in entries) is not trust, entries
        bpy.data.images.remove(image)
    assert red == {True: True, False: False}


def test_a_camera_that_is_a_program_has_none_unless_it_is_trusted(fresh_blender, tmp_path):
    if bpy.app.version < (5, 0):
        pytest.skip("cameras are programs since Blender 5.0")

    def custom_camera(scene, cube, marks):
        data = scene.camera.data
        data.type, data.custom_mode, data.custom_filepath = "CUSTOM", "EXTERNAL", str(marks / "camera.oso")
        data.custom_bytecode = "OpenShadingLanguage 1.00"

    blend, _ = hostile_file(custom_camera, tmp_path / "hostile")
    for trust in (True, False):
        with opening.opened(blend, trust):
            data = bpy.context.scene.camera.data
            assert data.type == "CUSTOM" and bool(data.custom_filepath) == bool(data.custom_bytecode) == trust


def pipe(scene, cube, marks):
    """In place of an image that a material shows."""
    tree = emitting(cube)
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("pipe", 1, 1)
    node.image.source, node.image.filepath = "FILE", str(marks / "pipe.png")
    tree.links.new(node.outputs[0], tree.nodes["Emission"].inputs[0])


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes in folders here")
def test_a_pipe_in_place_of_an_image_is_refused_by_every_command_and_not_waited_for(fresh_blender, tmp_path):
    blend, marks = hostile_file(pipe, tmp_path / "hostile")
    os.mkfifo(marks / "pipe.png")
    for trust in (False, True):
        for name, command in COMMANDS.items():
            with pytest.raises(InputError, match=r"pipe\.png, which is no file: give a file"):
                command(blend, tmp_path, trust)
                pytest.fail(f"{name} reads it")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes in folders here")
def test_a_pipe_in_place_of_a_library_is_refused_and_not_waited_for(link_object, tmp_path, monkeypatch):
    """Blender opens it before anybody can look."""
    monkeypatch.setattr(opening, "_WAITED", 0.2)
    library = tmp_path / "library.blend"
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    link_object(library, "Cube")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "hostile.blend"))
    library.unlink()
    os.mkfifo(library)
    signal.setitimer(signal.ITIMER_REAL, 0)  # which pytest has for this test's time limit
    handler = signal.getsignal(signal.SIGALRM)
    with pytest.raises(InputError, match=r"library\.blend, which is no file: give a file"):
        opening.open_blend(tmp_path / "hostile.blend")
    assert signal.getsignal(signal.SIGALRM) is handler


# The types of a .blend that name a file, by what becomes of it in a render.
READ = {"CacheFile", "CacheFileLayer", "Image", "ImagePackedFile", "Library", "LibraryWeakReference", "MeshCacheModifier"}
READ |= {"MovieClip", "MultiresModifier", "OceanModifier", "ShaderNodeTexIES", "Sound", "VectorFont", "Volume", "VolumeGrids"}
READ |= {"NodeSocketStringFilePath", "NodeTreeInterfaceSocketStringFilePath", "BlendImportContextLibrary", "BlendData", "Brush"}
WRITTEN_WHEN_ASKED = {"BakeSettings", "DynamicPaintSurface", "NodesModifier", "NodesModifierBake", "CollectionExport"}
SEQUENCER_WHICH_IS_OFF = {"ImageSequence", "MovieSequence", "SequenceEditor", "SequenceProxy", "MovieClipProxy"}
SEQUENCER_WHICH_IS_OFF |= {"ImageStrip", "MovieStrip", "StripProxy"}
CLOSED = {"CompositorNodeOutputFile", "FluidDomainSettings", "PointCache", "PointCacheItem", "RenderSettings"}
CLOSED |= {"ShaderNodeScript", "Camera"}
NO_PART_OF_A_FILE = ("Preferences", "User", "File", "Studio", "Theme", "ScriptDirectory", "PathCompare")


def test_every_path_in_a_file_is_known():
    """A Blender that brings a new one wants it looked at."""
    paths = set()
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name)
        if isinstance(kind, type) and issubclass(kind, bpy.types.bpy_struct) and not issubclass(kind, bpy.types.Operator):
            for prop in getattr(getattr(kind, "bl_rna", None), "properties", ()):
                inherited = kind.bl_rna.base and prop.identifier in kind.bl_rna.base.properties
                if prop.type == "STRING" and prop.subtype in ("FILE_PATH", "DIR_PATH") and not inherited:
                    paths.add(name)
    known = READ | WRITTEN_WHEN_ASKED | SEQUENCER_WHICH_IS_OFF | CLOSED
    new = {name for name in paths - known if not name.startswith(NO_PART_OF_A_FILE)}
    assert not {name for name in new if not name.startswith(("VIEWCAM", "Virtual", "Proof"))}, new
    assert len(paths & CLOSED) >= 5, "the search finds nothing"


if __name__ == "__main__":
    folder, what = Path(sys.argv[-2]), sys.argv[-1]
    if what in globals():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        (folder / "out").mkdir()
        hostile_file(globals()[what], folder / "hostile")
        os._exit(0)
    for command in COMMANDS.values():
        command(folder / "hostile" / "file" / "hostile.blend", folder / "out", what == "trusted")
    os._exit(0)
