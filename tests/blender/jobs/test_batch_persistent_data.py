"""Blender's data that is kept from shot to shot changes no picture: unlike shots of one batch against each by itself."""

import math
from dataclasses import replace

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import versions
from viewcam_addon.blender.jobs import persistent_data
from viewcam_addon.blender.jobs.renderer import BlenderRenderer
from viewcam_addon.blender.scenes import export
from viewcam_addon.jobs.job import Job

LEFT = Job("left", eye=(-6.0, -7.0, 4.0), look_at=(0.0, 0.0, 1.0), up=(0.0, 0.0, 1.0), d=40.0)
RIGHT = replace(LEFT, name="right", eye=(6.0, -7.0, 4.0))
TRACED = replace(LEFT, engine="VIEWCAM", level="direct", samples=1)

# Other cameras, frames, sizes, samples and engines, each after each other thing at least once.
UNLIKE = (
    LEFT,
    RIGHT,
    replace(RIGHT, frame=7),
    Job("own", camera="Second", frame=7),
    Job("first", camera="First", frame=7),
    replace(LEFT, width=48, height=36, samples=8),
    replace(LEFT, samples=2),
    TRACED,
    replace(TRACED, eye=(6.0, -7.0, 4.0)),
    replace(TRACED, eye=(6.0, -7.0, 4.0), frame=3, level="geometry"),
    LEFT,
)


@pytest.fixture
def stage(fresh_blender, scene):
    """A ball that moves and waves on a ground, under a sun, and two cameras, the first of which moves: small pictures."""
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 3, False
    scene.render.resolution_x, scene.render.resolution_y = 32, 18
    scene.view_layers[0].use_pass_z = True
    bpy.ops.mesh.primitive_grid_add(size=20)
    bpy.ops.object.light_add(type="SUN", rotation=(0.5, 0.3, 0))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, location=(0, 0, 1.2))
    ball = bpy.context.object
    ball.name = "Ball"
    wave = ball.modifiers.new("Wave", "WAVE")
    wave.height, wave.time_offset = 0.3, -50
    move(ball, (2, 0, 1))
    for name, place, turn in (("Second", (-6, -7, 3), -40), ("First", (6, -7, 4), 40)):
        scene.camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
        scene.collection.objects.link(scene.camera)
        scene.camera.location, scene.camera.rotation_euler = place, (math.radians(68), 0, math.radians(turn))
    move(scene.camera, (5, -8, 5))
    return scene


def move(block, to):
    block.keyframe_insert("location", frame=1)
    block.location = to
    block.keyframe_insert("location", frame=20)


@pytest.fixture
def pictures(stage, tmp_path):
    """A function: shots → the bytes of each one's EXR, by one batch of the stage, or `alone` each by a batch of its own."""

    def rendered(shots, alone=False):
        blend = tmp_path / "stage.blend"
        if not blend.exists():
            bpy.ops.wm.save_as_mainfile(filepath=str(blend))
        batches = [[shot] for shot in shots] if alone else [shots]
        result = []
        for batch in batches:
            with BlenderRenderer(blend) as renderer:
                for shot in batch:
                    renderer.render(shot, tmp_path / "shot.exr", tmp_path / "shot.png")
                    result.append((tmp_path / "shot.exr").read_bytes())
        return result

    return rendered


def differing(pictures, shots):
    """The shots that are others in a batch than alone."""
    together, alone = pictures(shots), pictures(shots, alone=True)
    assert len(set(alone)) == len(set(shots)), "two of the shots are one picture, and would hide a leak"
    return [shot for shot, first, other in zip(shots, together, alone, strict=True) if first != other]


def test_unlike_shots_are_the_same_to_the_bit_as_each_alone(pictures):
    assert differing(pictures, UNLIKE) == []


def test_what_asks_for_the_active_camera_is_evaluated_for_each(stage, pictures):
    follow_the_camera(stage.objects["Ball"])
    assert differing(pictures, (*UNLIKE[:5], TRACED, replace(TRACED, eye=(6.0, -7.0, 4.0)))) == []


def follow_the_camera(block):
    """Put a copy of it beside the camera that renders, by geometry nodes."""
    tree = bpy.data.node_groups.new("Follow", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    names = ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeInputActiveCamera", "GeometryNodeObjectInfo")
    start, end, active, place = map(tree.nodes.new, names)
    transform, shorter = tree.nodes.new("GeometryNodeTransform"), tree.nodes.new("ShaderNodeVectorMath")
    shorter.operation, shorter.inputs["Scale"].default_value = "SCALE", 0.3
    for first, other in (
        (active.outputs[0], place.inputs["Object"]),
        (place.outputs["Location"], shorter.inputs[0]),
        (shorter.outputs[0], transform.inputs["Translation"]),
        (start.outputs[0], transform.inputs["Geometry"]),
        (transform.outputs[0], end.inputs[0]),
    ):
        tree.links.new(first, other)
    block.modifiers.new("Follow", "NODES").node_group = tree


def drive_by_the_camera(scene):
    """Stretch the ground by where the scene's camera stands. What moves anyway is evaluated anew, and would not do."""
    driver = scene.objects["Grid"].driver_add("scale", 0).driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.targets[0].id_type, variable.targets[0].id = "SCENE", scene
    variable.targets[0].data_path = "camera.location.x"


def grow_hair(scene):
    """Hair of particles on what waves."""
    bpy.context.view_layer.objects.active = ball = scene.objects["Ball"]
    settings = ball.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count, settings.hair_length = "HAIR", 50, 1.0


def test_a_driver_that_reads_the_scenes_camera_reads_that_of_the_shot(stage, pictures):
    drive_by_the_camera(stage)
    shots = (Job("first", camera="First"), Job("second", camera="Second"), LEFT)
    assert persistent_data.is_driven_by_camera()
    assert differing(pictures, shots) == []


def test_hair_at_another_frame_is_as_if_no_frame_was_before(stage, pictures):
    grow_hair(stage)
    assert differing(pictures, (LEFT, replace(LEFT, frame=7), replace(LEFT, frame=20))) == []


@pytest.mark.parametrize(
    ("prepare", "shots"),
    [
        (drive_by_the_camera, (Job("first", camera="First"), Job("second", camera="Second"))),
        (grow_hair, (LEFT, replace(LEFT, frame=7))),
    ],
)
def test_without_dropping_a_leak_is_seen(stage, pictures, monkeypatch, prepare, shots):
    """These two leak in 4.2, 4.5, 5.0 and 5.2; where one does not any more, `drop` is for nothing."""
    prepare(stage)
    monkeypatch.setattr(persistent_data, "drop", lambda _: None)
    assert len(differing(pictures, shots)) == 1


@pytest.fixture
def reads(monkeypatch):
    """The cameras for which our engine read the whole scene."""
    cameras, real = [], export.scene_in

    def counting(depsgraph, camera_object, *rest):
        cameras.append(camera_object.name)
        return real(depsgraph, camera_object, *rest)

    monkeypatch.setattr(export, "scene_in", counting)
    return cameras


def stand_still(scene):
    for block in bpy.data.objects:
        block.animation_data_clear()
    scene.objects["Ball"].modifiers.clear()


def test_our_engine_reads_a_scene_once_that_stands_still(stage, pictures, reads):
    stand_still(stage)
    pictures([replace(TRACED, eye=(x, -7.0, 4.0), d=40.0 + x, samples=2 + i) for i, x in enumerate((-3.0, 0.0, 3.0))])
    assert len(reads) == 1


def test_our_engine_reads_a_scene_again_at_another_frame(stage, pictures, reads):
    pictures([TRACED, replace(TRACED, frame=5)])
    assert len(reads) == 2


def test_outside_of_a_batch_our_engine_reads_the_scene_for_each_picture(stage, reads):
    """Blender does not tell a render of pixels that an artist has painted."""
    stand_still(stage)
    stage.render.engine, stage.render.use_persistent_data = "VIEWCAM", True
    for _ in range(2):
        bpy.ops.render.render()
    assert len(reads) == 2


def test_a_camera_moves_without_blender_looking_at_other_objects(stage, tmp_path):
    """Blender evaluates the batch's own camera alone for the next shot: setting a pointer, say, would touch all objects."""
    stand_still(stage)
    seen = []

    def note(_scene, depsgraph):
        seen.extend(each.id.name for each in depsgraph.updates if isinstance(each.id, bpy.types.Object))

    with BlenderRenderer() as renderer:
        renderer.render(LEFT, tmp_path / "shot.exr", tmp_path / "shot.png")
        bpy.app.handlers.depsgraph_update_post.append(note)
        try:
            renderer.render(RIGHT, tmp_path / "shot.exr", tmp_path / "shot.png")
        finally:
            bpy.app.handlers.depsgraph_update_post.remove(note)
    assert set(seen) == {"viewcam batch"}


def test_no_shot_leaves_a_datablock_behind(stage, tmp_path):
    """Nothing piles up in the file: no image, camera or scene for each shot."""

    def counts():
        kinds = [prop.identifier for prop in bpy.data.bl_rna.properties if prop.type == "COLLECTION"]
        return {kind: len(getattr(bpy.data, kind)) for kind in kinds}

    with BlenderRenderer() as renderer:
        renderer.render(LEFT, tmp_path / "shot.exr", tmp_path / "shot.png")
        before = counts()
        for shot in (RIGHT, replace(LEFT, frame=3), TRACED, LEFT):
            renderer.render(shot, tmp_path / "shot.exr", tmp_path / "shot.png")
        assert counts() == before


def test_simulations_are_found(stage):
    assert not persistent_data.is_simulated()
    stage.objects["Ball"].modifiers.new("Cloth", "CLOTH")
    assert persistent_data.is_simulated()


def test_simulation_nodes_are_found(stage):
    tree = bpy.data.node_groups.new("Simulation", "GeometryNodeTree")
    tree.nodes.new("GeometryNodeSimulationOutput")
    assert persistent_data.is_simulated() and versions.EEVEE.startswith("BLENDER_EEVEE")
