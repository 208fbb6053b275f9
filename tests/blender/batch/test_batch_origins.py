"""What a batch is made from: the hash follows the content of every file that the .blend reads, and nothing else."""

import os
import shutil

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.batch import origins
from viewcam_addon.blender.batch.renderer import BlenderRenderer
from viewcam_addon.errors import InputError


@pytest.fixture
def picture(fresh_blender):
    """A function that writes a small PNG of one grey."""

    def write(path, grey):
        image = bpy.data.images.new("grey", 2, 2)
        image.pixels = [grey, grey, grey, 1] * 4
        image.filepath_raw, image.file_format = str(path), "PNG"
        image.save()
        bpy.data.images.remove(image)

    return write


@pytest.fixture
def open_file(scene, tmp_path):
    """A function that saves the open file; then `made_from` has something to tell of."""

    def save():
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "open.blend"))
        return origins.made_from()

    return save


def load(path, source="FILE"):
    image = bpy.data.images.load(str(path))
    image.source, image.use_fake_user = source, True


def linked():
    return dict(map(tuple, origins.made_from()["linked"]))


def test_a_file_that_links_nothing_is_its_own_hash(open_file, tmp_path):
    before = open_file()
    assert before["linked"] == [] and len(before["blend"]) == 64
    with open(tmp_path / "open.blend", "ab") as file:
        file.write(b"\0")
    assert origins.made_from()["blend"] != before["blend"]


def test_a_file_that_was_never_saved_can_not_be_told(fresh_blender):
    with pytest.raises(InputError, match="never saved"):
        origins.made_from()


def test_an_image_counts_by_its_content_and_not_by_its_time(open_file, picture, tmp_path):
    picture(tmp_path / "wall.png", 0.25)
    load(tmp_path / "wall.png")
    before = open_file()
    assert [name for name, _ in before["linked"]] == ["wall.png"]
    os.utime(tmp_path / "wall.png", (1, 1))
    assert origins.made_from() == before
    picture(tmp_path / "wall.png", 0.5)
    assert origins.made_from() != before


def test_a_missing_file_counts_as_missing(open_file, picture, tmp_path):
    picture(tmp_path / "wall.png", 0.25)
    load(tmp_path / "wall.png")
    before = open_file()
    (tmp_path / "wall.png").unlink()
    assert linked() == {"wall.png": "missing"} and origins.made_from() != before


def test_all_files_of_a_sequence_count_and_others_beside_do_not(open_file, picture, tmp_path):
    for name in ("smoke_1_001.png", "smoke_1_002.png", "smoke_1_003.png", "smoke_2_001.png", "smoke_1_001.jpg"):
        picture(tmp_path / name, 0.25)
    load(tmp_path / "smoke_1_002.png", "SEQUENCE")
    open_file()
    assert sorted(linked()) == ["smoke_1_001.png", "smoke_1_002.png", "smoke_1_003.png"]


def test_all_tiles_of_an_image_count(open_file, picture, tmp_path):
    for name in ("skin.1001.png", "skin.1002.png"):
        picture(tmp_path / name, 0.25)
    load(tmp_path / "skin.1001.png", "TILED")
    open_file()
    assert sorted(linked()) == ["skin.1001.png", "skin.1002.png"]


def test_a_packed_image_is_in_the_file_itself(open_file, picture, tmp_path):
    picture(tmp_path / "wall.png", 0.25)
    load(tmp_path / "wall.png")
    bpy.data.images["wall.png"].pack()
    assert open_file()["linked"] == []


def test_a_library_counts_and_what_it_reads_itself(open_file, picture, tmp_path):
    (tmp_path / "assets").mkdir()
    picture(tmp_path / "assets" / "bark.png", 0.25)
    load(tmp_path / "assets" / "bark.png")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "assets" / "tree.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "assets" / "tree.blend"), link=True) as (_, wanted):
        wanted.images = ["bark.png"]
    bpy.data.images["bark.png"].use_fake_user = True
    material = bpy.data.materials.new("Bark")
    material.use_nodes, material.use_fake_user = True, True
    material.node_tree.nodes.new("ShaderNodeTexImage").image = bpy.data.images["bark.png"]
    open_file()
    assert sorted(linked()) == ["bark.png", "tree.blend"]


def test_caches_beside_the_file_count(open_file, tmp_path):
    before = open_file()
    (tmp_path / "blendcache_open").mkdir()
    (tmp_path / "blendcache_open" / "cloth_000001_00.bphys").write_bytes(b"cache")
    assert [name for name, _ in origins.made_from()["linked"]] == ["cloth_000001_00.bphys"]
    shutil.rmtree(tmp_path / "blendcache_open")
    assert origins.made_from() == before


def test_the_same_project_elsewhere_is_the_same(open_file, picture, tmp_path):
    (tmp_path / "textures").mkdir()
    picture(tmp_path / "textures" / "wall.png", 0.25)
    load(tmp_path / "textures" / "wall.png")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "open.blend"), relative_remap=True)
    bpy.ops.file.make_paths_relative()
    before = open_file()
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(tmp_path / "textures", elsewhere / "textures")
    shutil.copy(tmp_path / "open.blend", elsewhere)
    shutil.rmtree(tmp_path / "textures")
    bpy.ops.wm.open_mainfile(filepath=str(elsewhere / "open.blend"))
    assert origins.made_from() == before


def test_the_seed_and_the_versions_count(open_file, add_camera):
    add_camera()
    open_file()
    with BlenderRenderer(seed=3) as renderer:
        told = renderer.made_from()
    assert told["seed"] == 3 and set(told["versions"]) == {"blender", "viewcam"}
    assert told["versions"]["viewcam"].count(".") == 2
