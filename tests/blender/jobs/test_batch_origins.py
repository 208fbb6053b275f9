"""The files that a batch is made from: the hash follows the content of each that the .blend reads, and nothing else."""

import os
import shutil

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import origins
from viewcam_addon.blender.jobs.renderer import BlenderRenderer
from viewcam_addon.errors import InputError

pytestmark = pytest.mark.slow


@pytest.fixture
def picture(fresh_blender):
    """A function that writes a small PNG of one gray."""

    def write(path, gray):
        image = bpy.data.images.new("gray", 2, 2)
        image.pixels = [gray, gray, gray, 1] * 4
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
    assert sorted(linked()) == ["assets/bark.png", "assets/tree.blend"]


def test_caches_beside_the_file_count(open_file, tmp_path):
    before = open_file()
    (tmp_path / "blendcache_open").mkdir()
    (tmp_path / "blendcache_open" / "cloth_000001_00.bphys").write_bytes(b"cache")
    assert [name for name, _ in origins.made_from()["linked"]] == ["blendcache_open/cloth_000001_00.bphys"]
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


def test_the_versions_count(open_file, add_camera):
    add_camera()
    open_file()
    with BlenderRenderer() as renderer:
        sources = renderer.made_from()
    assert set(sources["versions"]) == {"blender", "viewcam"}
    assert sources["versions"]["viewcam"].count(".") == 2


def test_two_files_of_one_name_that_swap_their_contents_are_other_files(open_file, picture, tmp_path):
    for folder, gray in (("left", 0.25), ("right", 0.5)):
        (tmp_path / folder).mkdir()
        picture(tmp_path / folder / "wall.png", gray)
        load(tmp_path / folder / "wall.png")
    before = open_file()
    (tmp_path / "left" / "wall.png").rename(tmp_path / "kept.png")
    (tmp_path / "right" / "wall.png").rename(tmp_path / "left" / "wall.png")
    (tmp_path / "kept.png").rename(tmp_path / "right" / "wall.png")
    assert origins.made_from() != before


def test_so_are_two_that_swap_them_outside_of_the_files_folder(open_file, picture, tmp_path_factory):
    first, other = (tmp_path_factory.mktemp("outside") / "wall.png" for _ in range(2))
    picture(first, 0.25)
    picture(other, 0.5)
    load(first)
    load(other)
    before = open_file()
    assert [name for name, _ in before["linked"]] == ["wall.png", "wall.png"]
    kept = first.read_bytes()
    first.write_bytes(other.read_bytes())
    other.write_bytes(kept)
    assert origins.made_from() != before


@pytest.fixture
def importing(fresh_blender, tmp_path):
    """A function: way → a cube whose geometry nodes import mesh.ply, its path being said in that way."""
    if not hasattr(bpy.types, "GeometryNodeImportPLY"):
        pytest.skip("this Blender's geometry nodes import nothing")

    def build(way):
        (tmp_path / "mesh.ply").write_bytes(b"ply")
        bpy.ops.mesh.primitive_cube_add()
        modifier = bpy.context.object.modifiers.new("Nodes", "NODES")
        tree = modifier.node_group = bpy.data.node_groups.new("Tree", "GeometryNodeTree")
        tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        where, operator = (tree, modifier)
        if way == "group in a group":
            inner = bpy.data.node_groups.new("Inner", "GeometryNodeTree")
            inner.interface.new_socket("Path", in_out="INPUT", socket_type="NodeSocketString")
            inner.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
            group = tree.nodes.new("GeometryNodeGroup")
            group.node_tree = inner
            group.inputs[0].default_value = "//mesh.ply"
            where = inner
        node = where.nodes.new("GeometryNodeImportPLY")
        if way == "its own":
            node.inputs[0].default_value = "//mesh.ply"
        elif way == "modifier":
            socket = tree.interface.new_socket("Path", in_out="INPUT", socket_type="NodeSocketString")
            reroute = tree.nodes.new("NodeReroute")
            tree.links.new(tree.nodes.new("NodeGroupInput").outputs[0], reroute.inputs[0])
            tree.links.new(reroute.outputs[0], node.inputs[0])
            set_input(operator, socket.identifier, "//mesh.ply")
        elif way == "string node":
            text = tree.nodes.new("FunctionNodeInputString")
            text.string = str(tmp_path / "mesh.ply")
            tree.links.new(text.outputs[0], node.inputs[0])
        elif way == "group in a group":
            inner.links.new(inner.nodes.new("NodeGroupInput").outputs[0], node.inputs[0])
        else:
            joined = tree.nodes.new("GeometryNodeStringJoin")
            tree.links.new(joined.outputs[0], node.inputs[0])

    return build


def set_input(modifier, identifier, value):
    if bpy.app.version < (5, 2):
        modifier[identifier] = value
    else:
        getattr(modifier.properties.inputs, identifier).value = value


@pytest.mark.parametrize("way", ["its own", "modifier", "string node", "group in a group"])
def test_what_geometry_nodes_import_counts_whoever_says_its_path(importing, open_file, tmp_path, way):
    importing(way)
    before = open_file()
    assert [name for name, _ in before["linked"]] == ["mesh.ply"] and "unknown" not in before
    (tmp_path / "mesh.ply").write_bytes(b"ply, another")
    assert origins.made_from() != before


def test_a_path_that_nodes_compute_is_said_to_be_unknown(importing, open_file):
    importing("computed")
    (sentence,) = open_file()["unknown"]
    assert "object 'Cube', modifier 'Nodes'" in sentence and "can't be known" in sentence
    assert origins.unknown() == (sentence,)


@pytest.fixture
def usd(fresh_blender):
    """A function that reads the cache file of that path."""

    def read(path):
        bpy.ops.cachefile.open(filepath=str(path))

    return read


def test_all_layers_of_a_usd_file_count_and_what_they_read(usd, open_file, tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "stage.usda").write_text("#usda 1.0\n(\n subLayers = [@./parts/look.usda@]\n)\n")
    (tmp_path / "parts" / "look.usda").write_text('#usda 1.0\ndef "A" (references = @@@mesh.usda@@@</A>) { }\n')
    (tmp_path / "parts" / "mesh.usda").write_text("#usda 1.0\n# asset inputs:file = @bark.png@ and @../stage.usda@ again\n")
    (tmp_path / "parts" / "bark.png").write_bytes(b"bark")
    usd(tmp_path / "stage.usda")
    before = open_file()
    named = ["parts/bark.png", "parts/look.usda", "parts/mesh.usda", "stage.usda"]
    assert [name for name, _ in before["linked"]] == named and "unknown" not in before
    for name in named:
        kept = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(kept + b"\n")
        assert origins.made_from() != before, name
        (tmp_path / name).write_bytes(kept)
    assert origins.made_from() == before


def test_what_binary_usd_reads_is_said_to_be_unknown(usd, open_file, tmp_path):
    (tmp_path / "stage.usdc").write_bytes(b"PXR-USDC and more")
    usd(tmp_path / "stage.usdc")
    (sentence,) = open_file()["unknown"]
    assert "'stage.usdc' is binary USD" in sentence


def test_the_configuration_of_colors_counts_with_its_tables_and_the_variable(open_file, tmp_path, monkeypatch):
    before = open_file()
    (tmp_path / "luts").mkdir()
    (tmp_path / "luts" / "film.cube").write_text("a table")
    config = tmp_path / "config.ocio"
    config.write_text("ocio_profile_version: 2\nsearch_path: luts\nfrom_reference: !<FileTransform> {src: film.cube, a: b}\n")
    monkeypatch.setenv("OCIO", str(config))
    chosen = origins.made_from()
    assert chosen != before and chosen["linked"] == before["linked"]
    (tmp_path / "luts" / "film.cube").write_text("another table")
    changed = origins.made_from()
    assert changed != chosen
    config.write_text(config.read_text() + "# changed\n")
    assert origins.made_from() != changed
    monkeypatch.delenv("OCIO")
    assert origins.made_from() == before


def test_the_folder_of_a_bake_of_its_own_counts(open_file, tmp_path):
    bpy.ops.mesh.primitive_cube_add()
    modifier = bpy.context.object.modifiers.new("Nodes", "NODES")
    tree = modifier.node_group = bpy.data.node_groups.new("Tree", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    tree.nodes.new("GeometryNodeBake")
    bpy.context.view_layer.update()
    (bake,) = modifier.bakes
    bake.use_custom_path, bake.directory = True, "//own bake/"
    (tmp_path / "own bake").mkdir()
    (tmp_path / "own bake" / "0001.json").write_text("a bake")
    before = open_file()
    assert [name for name, _ in before["linked"]] == ["own bake/0001.json"]
    (tmp_path / "own bake" / "0001.json").write_text("another")
    assert origins.made_from() != before


def test_a_cache_that_is_written_while_rendering_is_no_origin_and_a_baked_one_is(open_file, tmp_path):
    """After a complete run with cloth that is cached on the disk, and not baked, --resume rendered all again."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=2)
    cache = bpy.context.object.modifiers.new("Cloth", "CLOTH").point_cache
    open_file()  # a cache on the disk stands beside the file
    cache.use_disk_cache = True
    before = open_file()
    for frame in (1, 2, 3):
        bpy.context.scene.frame_set(frame)
    written = sorted((tmp_path / "blendcache_open").glob("*.bphys"))
    assert written, "Blender has cached nothing"
    assert origins.made_from() == before
    cache.frame_end = 3
    with bpy.context.temp_override(scene=bpy.context.scene, active_object=bpy.context.object, point_cache=cache):
        bpy.ops.ptcache.bake(bake=True)
    assert cache.is_baked
    baked = origins.made_from()
    assert baked["linked"] and {name for name, _ in baked["linked"]} >= {f"blendcache_open/{path.name}" for path in written}


def named(path):
    """An image that Blender has not looked for yet."""
    image = bpy.data.images.new("named", 1, 1)
    image.source, image.filepath, image.use_fake_user = "FILE", str(path), True


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes in folders here")
@pytest.mark.parametrize("kind", ["device", "pipe"])
def test_a_device_or_a_pipe_in_place_of_an_image_is_refused_and_not_read(open_file, tmp_path, kind):
    """Each would keep its reader for ever."""
    path = "/dev/zero"
    if kind == "pipe":
        path = tmp_path / "pipe.png"
        os.mkfifo(path)
    open_file()
    named(path)
    with pytest.raises(InputError, match=f"the .blend reads {path}, which is no file"):
        origins.made_from()


def test_more_files_than_anybody_renders_from_are_refused_before_they_are_read(open_file, tmp_path, monkeypatch):
    """A file of eight exabytes, all of it a hole, is a regular one."""
    (tmp_path / "huge.png").touch()
    os.truncate(tmp_path / "huge.png", 2**40)
    open_file()
    named(tmp_path / "huge.png")
    with pytest.raises(InputError, match=r"more than 256 GiB of other files, as .*huge\.png"):
        origins.made_from()


def test_a_cache_in_a_folder_of_too_many_files_is_refused(open_file, tmp_path, monkeypatch):
    folder = tmp_path / "blendcache_open"
    folder.mkdir()
    open_file()
    monkeypatch.setattr(origins, "_MOST_FILES", 4)
    for number in range(4):
        (folder / f"{number}.vdb").touch()
    assert len(origins.made_from()["linked"]) == 4
    (folder / "5.vdb").touch()
    with pytest.raises(InputError, match=r"blendcache_open, which holds more than 4 files: give its cache a folder"):
        origins.made_from()
