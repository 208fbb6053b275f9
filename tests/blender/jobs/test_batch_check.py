"""The check of a batch's shots: right ones pass, faults on the way are caught, and no picture is another for it."""

import contextlib
import json
import math
from dataclasses import replace

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import cli
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks, versions
from viewcam_addon.blender.jobs import checking, scene_files
from viewcam_addon.blender.jobs import renderer as renderers
from viewcam_addon.blender.jobs.renderer import BlenderRenderer
from viewcam_addon.blender.temporary_settings import cameras_unbound, overridden
from viewcam_addon.errors import InputError
from viewcam_addon.jobs import makers
from viewcam_addon.jobs.job import Job

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("one_process")]

LEFT = Job("left", eye=(-3.0, -6.0, 2.5), look_at=(0.0, 0.0, 0.5), up=(0.0, 0.0, 1.0), d=90.0)
RIGHT = replace(LEFT, name="right", eye=(3.0, -5.0, 2.0), d=110.0)
SIZE = (96, 54)


def add(kind, **options):
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**options)
    return bpy.context.object


@pytest.fixture
def stage(fresh_blender, scene):
    """A ground, a monkey and a cone under a sun, and a camera: small pictures of few samples by Cycles."""
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 2, False
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.virtual_pinhole_reference.level, scene.virtual_pinhole_reference.samples = "DIRECT", 2
    add("grid", x_subdivisions=12, y_subdivisions=12, size=12)
    add("monkey", location=(0, 0, 1)).data.materials.append(bumpy_material())
    add("cone", location=(1.6, 0.8, 1))
    bpy.ops.object.light_add(type="SUN", rotation=(0.6, 0.3, 0))
    data = bpy.data.cameras.new("Camera")
    scene.camera = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(scene.camera)
    scene.camera.location, scene.camera.rotation_euler = (0, -7, 2), (math.radians(80), 0, 0)
    return scene


def bumpy_material():
    """A material whose normals a check straightens, and has to give back bent."""
    material = bpy.data.materials.new("Bumpy")
    if not material.node_tree:  # new materials have one from 5.0 on
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    bump, noise = nodes.new("ShaderNodeBump"), nodes.new("ShaderNodeTexNoise")
    principled = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    links.new(noise.outputs[0], bump.inputs["Height"])
    links.new(bump.outputs["Normal"], principled.inputs["Normal"])
    return material


@pytest.fixture
def batch(tmp_path):
    """batch(*shots, check=True) renders the shots of the open file: their sidecars' parts and the bytes of their files."""

    def run(*shots, check=True):
        with BlenderRenderer() as renderer:
            done = {}
            for shot in shots:
                image, preview = tmp_path / "image.exr", tmp_path / "preview.png"
                record = renderer.render(shot, image, preview)
                verdict = {"check": renderer.check(shot)} if check else {}
                done[shot.name] = record | verdict, image.read_bytes(), preview.read_bytes()
            return done

    return run


def verdicts(done):
    return {name: record["check"] for name, (record, _, _) in done.items()}


@pytest.fixture
def spoil(monkeypatch):
    """spoil(change) has Cycles render the check through a camera object that `change` has had its way with."""

    def install(change):
        render = checking.cycles.render

        def spoiled(scene, layer, camera_object, *rest, **options):
            with change(camera_object):
                render(scene, layer, camera_object, *rest, **options)

        monkeypatch.setattr(checking.cycles, "render", spoiled)

    return install


def changed(owner_of, name, value_of):
    """A context in which one property of a camera object, or of its data, is another."""

    @contextlib.contextmanager
    def change(camera_object):
        owner = owner_of(camera_object)
        before = getattr(owner, name)
        before = before if isinstance(before, float) else before.copy()
        setattr(owner, name, value_of(before))
        try:
            yield
        finally:
            setattr(owner, name, before)

    return change


def data(camera_object):
    return camera_object.data


def itself(camera_object):
    return camera_object


FAULTS = {
    "a thousandth more focal length": changed(data, "lens", lambda lens: lens * 1.001),
    "half a pixel to the right": changed(data, "shift_x", lambda shift: shift + 0.5 / SIZE[0]),
    "half a pixel upwards": changed(data, "shift_y", lambda shift: shift + 0.5 / SIZE[0]),
    "a mirrored picture": changed(itself, "scale", lambda _: (-1, 1, 1)),
    "an eye a millimeter off": changed(itself, "location", lambda at: (at[0] + 0.001, at[1], at[2])),
}


def test_shots_of_four_values_and_of_a_camera_pass_and_their_figures_say_so(stage, batch):
    checks = verdicts(batch(LEFT, RIGHT, Job("as it stands", camera="Camera")))
    assert all(each["passed"] for each in checks.values()), checks
    assert all(each["verdict"].startswith("The same picture") for each in checks.values())
    bent = ["Suzanne: material 'Bumpy' turns the normals, and a plain one stands in"]
    assert [each["ledger"] for each in checks.values()] == [bent] * 3
    assert all(each["answer"] == "same_but" and each["not_modeled"]["names"] == ["Suzanne"] for each in checks.values()), checks
    assert all(0.01 < each["not_modeled"]["share"] < 0.9 for each in checks.values()), checks
    assert checks["left"]["figures"]["conversion"]["share"] <= 1
    assert checks["as it stands"]["figures"]["conversion"] is None, "nobody stated it"


@pytest.mark.parametrize("fault", FAULTS)
def test_a_camera_in_blender_that_is_not_the_sidecars_is_caught(stage, batch, spoil, fault):
    spoil(FAULTS[fault])
    checks = verdicts(batch(LEFT))["left"]
    assert not checks["passed"] and checks["verdict"].startswith("Not the same picture"), checks


def test_without_a_fault_that_way_of_spoiling_passes(stage, batch, spoil):
    spoil(changed(data, "lens", lambda lens: lens))
    assert verdicts(batch(LEFT))["left"]["passed"]


def test_a_sidecar_that_is_not_blenders_camera_is_caught(stage, batch, monkeypatch):
    from viewcam_addon.blender.jobs import renderer

    read = renderer.cameras.read
    monkeypatch.setattr(renderer.cameras, "read", lambda *arguments: replace(read(*arguments), distance=90.09))
    checks = verdicts(batch(LEFT))["left"]
    assert not checks["passed"] and "magnified" in checks["verdict"], checks


def test_a_conversion_that_lost_the_four_values_is_caught(stage, batch, monkeypatch):
    from viewcam_addon.blender.jobs import renderer

    apply = renderer.cameras.apply
    monkeypatch.setattr(
        renderer.cameras, "apply", lambda camera, pinhole, scene: apply(camera, replace(pinhole, distance=90.09), scene)
    )
    checks = verdicts(batch(LEFT))["left"]
    assert not checks["passed"] and "the camera in Blender is" in checks["verdict"], checks
    # 0.1 % of the distance moves the corner, which is 48 and 27 pixels away, by as much.
    assert checks["figures"]["conversion"]["largest"] == pytest.approx(0.001 * math.hypot(48, 27), rel=1e-2)


@pytest.mark.parametrize("engine", ["CYCLES", "VIEWCAM"])
def test_pictures_are_the_same_bytes_with_and_without_their_checks(stage, batch, engine):
    """A check changes and restores most here: bent normals, a holdout, depth of field, a world's volume, indices."""
    bpy.data.objects["Cone"].is_holdout = True
    layer = bpy.context.view_layer
    layer.use_pass_object_index = layer.use_pass_material_index = layer.use_pass_normal = True
    stage.world = bpy.data.worlds.new("Fog")
    if not stage.world.node_tree:
        stage.world.use_nodes = True
    tree = stage.world.node_tree
    fog = tree.nodes.new("ShaderNodeVolumeScatter")
    fog.inputs["Density"].default_value = 0.01
    output = next((node for node in tree.nodes if node.type == "OUTPUT_WORLD"), None)
    output = output or tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(fog.outputs[0], output.inputs["Volume"])
    stage.camera.data.dof.use_dof, stage.camera.data.dof.focus_distance = True, 3.0
    shots = [replace(shot, engine=engine) for shot in (LEFT, RIGHT)] + [Job("camera", camera="Camera", engine=engine)]
    with_checks, without = batch(*shots), batch(*shots, check=False)
    for name, (record, image, preview) in without.items():
        checked, its_image, its_preview = with_checks[name]
        assert (image, preview) == (its_image, its_preview), f"{name} is another picture for having been checked"
        verdict = checked.pop("check")
        assert checked == record and verdict["passed"], verdict
    assert len({image for _, image, _ in without.values()}) == 3


@pytest.mark.parametrize("engine", ["CYCLES", "VIEWCAM"])
def test_verdicts_are_to_the_last_digit_those_of_a_batch_that_is_resumed(stage, batch, engine):
    """Whatever is kept from shot to shot, so that the sidecars are the same bytes."""
    small = replace(LEFT, name="small", width=64, height=64, samples=3)
    shots = [replace(shot, engine=engine) for shot in (LEFT, small, RIGHT, Job("camera", camera="Camera"))]
    whole = verdicts(batch(*shots))
    assert whole == verdicts(batch(shots[0])) | verdicts(batch(*shots[:0:-1]))


def test_a_check_gives_back_all_that_it_changes(stage, batch):
    def state():
        owners = [stage.render, stage.cycles, stage.render.image_settings, bpy.context.view_layer, stage.camera.data.dof]
        properties = [
            {prop.identifier: str(getattr(owner, prop.identifier)) for prop in owner.bl_rna.properties} for owner in owners
        ]
        indices = [block.pass_index for blocks in (bpy.data.objects, bpy.data.materials) for block in blocks]
        return properties, indices, stage.camera.name, len(bpy.data.scenes), len(bpy.data.materials)

    before = state()
    batch(LEFT)
    assert state() == before


def test_things_that_move_are_read_again_and_things_that_stand_are_not(stage, batch, monkeypatch):
    written = []
    write = scene_files.scene_file.write
    monkeypatch.setattr(scene_files.scene_file, "write", lambda scene, path: written.append(path) or write(scene, path))
    checks = verdicts(batch(LEFT, RIGHT, replace(LEFT, name="small", width=64, height=64)))
    assert all(each["passed"] for each in checks.values()) and len(written) == 1, "a scene that stands still is written once"
    assert not written[0].exists(), "the checks' folder is left behind"
    written.clear()
    monkey = bpy.data.objects["Suzanne"]
    for frame, height in ((1, 1.0), (20, 2.0)):
        monkey.location.z = height
        monkey.keyframe_insert("location", frame=frame)
    checks = verdicts(batch(*(replace(LEFT, name=str(frame), frame=frame) for frame in (1, 20, 20))))
    assert all(each["passed"] for each in checks.values()) and len(written) == 2, checks


def follow_the_camera(moved):
    """Geometry nodes that move an object by a tenth of where the active camera is."""
    tree = bpy.data.node_groups.new("Follow", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    kinds = ("GroupInput", "GroupOutput")
    start, end = (tree.nodes.new(f"Node{kind}") for kind in kinds)
    camera, info = tree.nodes.new("GeometryNodeInputActiveCamera"), tree.nodes.new("GeometryNodeObjectInfo")
    scaled, move = tree.nodes.new("ShaderNodeVectorMath"), tree.nodes.new("GeometryNodeSetPosition")
    info.transform_space, scaled.operation = "RELATIVE", "SCALE"
    scaled.inputs["Scale"].default_value = 0.1
    tree.links.new(camera.outputs[0], info.inputs["Object"])
    tree.links.new(info.outputs["Location"], scaled.inputs[0])
    tree.links.new(scaled.outputs[0], move.inputs["Offset"])
    tree.links.new(start.outputs[0], move.inputs["Geometry"])
    tree.links.new(move.outputs[0], end.inputs[0])
    moved.modifiers.new("Follow", "NODES").node_group = tree


def test_what_geometry_nodes_move_with_the_active_camera_is_read_for_each_shot(stage, batch, monkeypatch):
    """Nothing in the file has changed from shot to shot, and the scene is another all the same."""
    read = []
    export = scene_files.export_scene
    monkeypatch.setattr(scene_files, "export_scene", lambda *arguments: read.append(1) or export(*arguments))
    shots = (LEFT, RIGHT, replace(LEFT, name="again"))
    assert all(each["passed"] for each in verdicts(batch(*shots)).values()) and len(read) == 1
    read.clear()
    follow_the_camera(bpy.data.objects["Cone"])
    checks = verdicts(batch(*shots))
    assert all(each["passed"] for each in checks.values()) and len(read) == 3, checks


@pytest.mark.parametrize("crop", [False, True], ids=["in the whole frame", "cropped"])
def test_a_render_border_is_checked_as_the_picture_has_it(stage, batch, crop):
    stage.render.use_border, stage.render.use_crop_to_border = True, crop
    stage.render.border_min_x, stage.render.border_max_x = 0.25, 0.75
    stage.render.border_min_y, stage.render.border_max_y = 0.25, 1.0
    done = batch(LEFT)
    assert verdicts(done)["left"]["passed"], verdicts(done)
    assert done["left"][0]["camera"]["width"] == (48 if crop else 96)
    assert (stage.render.use_border, stage.render.use_crop_to_border) == (True, crop)


def test_a_mirrored_camera_of_the_file_passes_as_what_it_is(stage, batch):
    stage.camera.scale = (-1, 1, 1)
    record, _, _ = batch(Job("mirrored", camera="Camera"))["mirrored"]
    assert record["camera"]["mirrored"] and record["check"]["passed"], record["check"]


def test_a_picture_of_a_few_pixels_passes(stage, batch):
    """There the bias of Cycles' filter table is more than all roundings."""
    checks = verdicts(batch(*(replace(LEFT, name=str(n), width=n, height=n, d=0.9 * n) for n in (8, 16, 24))))
    assert all(each["passed"] for each in checks.values()), {name: each["verdict"] for name, each in checks.items()}


def test_what_both_sides_leave_out_is_told_in_a_few_words(stage, batch):
    for number in range(8):
        curve = bpy.data.objects.new(f"Hair {number}", bpy.data.hair_curves.new("Hair"))
        stage.collection.objects.link(curve)
    ledger = verdicts(batch(LEFT))["left"]["ledger"]
    assert len(ledger) == 6 and "hair and curves" in ledger[0] and ledger[-1] == "and 4 more, which viewcam check tells", ledger


def test_the_camera_of_a_shot_by_eevee_is_checked_with_cycles(stage, tracing):
    """Without a picture by EEVEE, which needs a GPU: what is checked is the camera."""
    stage.render.engine = versions.EEVEE
    camera = cameras.read(stage.camera, stage)
    job, wrong = Job("camera", camera="Camera"), replace(camera, distance=1.001 * camera.distance[0])
    with checking.Checker(tracing) as checker:
        assert checker.check_picture(job, stage, stage.camera, camera)["passed"]
        assert not checker.check_picture(job, stage, stage.camera, wrong)["passed"]
    assert stage.render.engine == versions.EEVEE


@pytest.fixture
def other(stage):
    """A second camera, which a marker binds from frame 8 on; the stage's own is bound from frame 1 on."""
    other = bpy.data.objects.new("Other", stage.camera.data)
    stage.collection.objects.link(other)
    other.location, other.rotation_euler = (1, -7, 2), (math.radians(80), 0, 0.1)
    for frame, camera_object in ((1, stage.camera), (8, other)):
        stage.timeline_markers.new(camera_object.name, frame=frame).camera = camera_object
    return other


# Both answer for frame 8 with the camera of frame 1, or of the file.
WRONG_CAMERAS = [lambda bindings, _: bindings[0][1], lambda *_: None]


@pytest.mark.parametrize("wrong", WRONG_CAMERAS)
def test_a_check_through_another_camera_than_its_markers_fails(stage, other, monkeypatch, wrong):
    """Cycles and tracer took the same wrong camera, and the check passed."""
    shots = makers.frames("7..8")

    def passed():
        with BlenderRenderer() as renderer:
            without_picture = [renderer.check(shot, has_picture=False)["passed"] for shot in shots]
            of_sidecar = [renderer.render(shot, None, None) and renderer.check(shot)["passed"] for shot in shots]
            return without_picture, of_sidecar

    assert passed() == ([True, True], [True, True])
    monkeypatch.setattr(datablocks, "bound_camera", wrong)
    assert passed() == ([True, False], [True, False])


@pytest.mark.parametrize("wrong", WRONG_CAMERAS)
def test_blender_itself_chooses_the_camera_of_a_frames_picture_and_the_sidecar_names_it(other, batch, monkeypatch, wrong):
    shots = makers.frames("7..8")
    right = batch(*shots, check=False)
    monkeypatch.setattr(datablocks, "bound_camera", wrong)
    done = batch(*shots, check=False)
    for name, camera_name in (("frame_007", "Camera"), ("frame_008", "Other")):
        assert done[name] == right[name]
        assert done[name][0]["rendered"]["camera"] == camera_name


def test_a_frame_taken_by_another_camera_than_its_markers_is_caught(stage, other, batch, monkeypatch):
    camera_object, render_still = stage.camera, renderers.render_still

    def through_one_camera(scene):
        with overridden() as overrides:
            cameras_unbound(overrides, scene)
            scene.camera = camera_object
            render_still(scene)
        scene.camera = camera_object

    monkeypatch.setattr(renderers, "render_still", through_one_camera)
    checks = verdicts(batch(*makers.frames("7..8")))
    assert checks["frame_007"]["passed"] and not checks["frame_008"]["passed"], checks


def test_a_failed_check_is_exit_status_1_and_one_that_passes_after_it_is_0(stage, spoil, monkeypatch, tmp_path, capfd):
    blend, out, listed = tmp_path / "stage.blend", tmp_path / "out", tmp_path / "shots.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    listed.write_text('[{"name": "as it stands", "camera": "Camera"}]')
    command = ["batch", str(blend), str(listed), "--out", str(out), "--check"]
    render = checking.cycles.render
    spoil(FAULTS["half a pixel to the right"])
    assert cli.main(command) == 1
    assert "1 different: as it stands" in capfd.readouterr().out
    record = json.loads((out / "as it stands.json").read_text(encoding="utf-8"))
    assert not record["check"]["passed"] and "the picture is shifted by" in record["check"]["verdict"]
    monkeypatch.setattr(checking.cycles, "render", render)
    assert cli.main([*command, "--resume"]) == 1, "what is kept keeps its verdict"
    assert cli.main([*command, "--overwrite"]) == 0
    assert json.loads((out / "as it stands.json").read_text(encoding="utf-8"))["check"]["passed"]


def test_an_error_in_one_check_is_that_shots_and_the_next_is_checked(stage, tmp_path, monkeypatch):
    render = checking.cycles.render

    def fail(*_, **__):
        monkeypatch.setattr(checking.cycles, "render", render)
        raise InputError("the lamp is broken: mend it")

    with BlenderRenderer() as renderer:
        renderer.render(LEFT, tmp_path / "a.exr", tmp_path / "a.png")
        monkeypatch.setattr(checking.cycles, "render", fail)
        with pytest.raises(InputError, match="the lamp is broken"):
            renderer.check(LEFT)
        assert renderer.check(LEFT)["passed"]
