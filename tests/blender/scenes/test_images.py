"""Images of Blender as pictures of the tracer: the colors that Cycles shows, whatever the alpha is kept as."""

import itertools

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.scenes import images

pytestmark = pytest.mark.slow

PIXELS = np.array([[0.1, 0.4, 0.9, 0.5], [0.5, 0.2, 0.3, 0.25], [0.9, 0.6, 0.3, 1.0], [0.3, 0.8, 0.2, 0.75]], np.float32)
FILES = {
    "float EXR": ("OPEN_EXR", "32"),
    "half EXR": ("OPEN_EXR", "16"),
    "PNG of bytes": ("PNG", "8"),
    "PNG of two bytes": ("PNG", "16"),
    "TIFF of bytes": ("TIFF", "8"),
    "TIFF of two bytes": ("TIFF", "16"),
    "Targa": ("TARGA", "8"),
    "WebP": ("WEBP", "8"),
}


def new_image(is_float, space="Linear Rec.709"):
    """An image of PIXELS that no file has."""
    image = bpy.data.images.new("Pixels", 4, 1, alpha=True, float_buffer=is_float)
    image.colorspace_settings.name = space  # it is blank afterwards
    image.pixels.foreach_set(PIXELS.ravel())
    image.update()
    return image


@pytest.fixture
def written(scene, tmp_path):
    """written(kind, depth) → the path of such a file of PIXELS."""

    def write(kind, depth):
        path, settings = str(tmp_path / f"{kind}-{depth}"), scene.render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = kind, "RGBA", depth
        scene.view_settings.view_transform = "Raw"
        new_image(True).save_render(path, scene=scene)
        return path

    return write


@pytest.fixture
def render_pixels(scene, camera_object, read_passes, tmp_path):
    """render_pixels(image) → (4, 3), the pixels as Cycles shows them on a surface that shines."""
    camera_object.data.type, camera_object.data.ortho_scale, camera_object.location = "ORTHO", 4, (0, 0, 1)
    bpy.ops.mesh.primitive_plane_add(size=4)
    material = bpy.data.materials.new("Shining")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    texture, emission, output = (tree.nodes.new(f"ShaderNode{name}") for name in ("TexImage", "Emission", "OutputMaterial"))
    texture.interpolation = "Closest"
    tree.links.new(texture.outputs["Color"], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.render.resolution_x = scene.render.resolution_y = 4
    settings, scene.render.filepath = scene.render.image_settings, str(tmp_path / "shown.exr")

    def show(image):
        texture.image = image
        settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
        bpy.ops.render.render(write_still=True)
        result = bpy.data.images.load(scene.render.filepath)
        pixels = np.array(result.pixels[:]).reshape(4, 4, -1)[0, :, :3]
        bpy.data.images.remove(result)
        return pixels

    return show


def linear(picture):
    values = picture.values.reshape(-1, 3).astype(np.float64)
    decoded = np.where(values < 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return decoded if picture.srgb else values


@pytest.mark.parametrize("kind", ["bytes", "floats", *FILES])
@pytest.mark.parametrize("space", ["sRGB", "Linear Rec.709", "Non-Color"])
def test_colors_beside_an_alpha_are_those_that_cycles_shows(kind, space, written, render_pixels):
    path = written(*FILES[kind]) if kind in FILES else None
    for alpha_mode, packed in itertools.product(("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"), (False, True)):
        image = bpy.data.images.load(path) if path else new_image(kind == "floats", space)
        if path:
            image.colorspace_settings.name = space
        image.alpha_mode = alpha_mode
        if packed:
            image.pack()
        if images.obstacle(image):
            assert kind == "WebP" and not packed and bpy.app.version < (4, 5)
            continue
        theirs, ours = render_pixels(image), linear(images.picture_of(image))
        # Half a byte's step, decoded where colors are brightest.
        assert theirs.any() and np.abs(theirs - ours).max() < 1.2 / 255, (alpha_mode, packed, theirs, ours)
        bpy.data.images.remove(image)


@pytest.mark.parametrize(("space", "is_named"), [("sRGB", False), ("Linear Rec.709", True), ("Non-Color", False)])
def test_the_alpha_of_linear_bytes_is_named(space, is_named):
    assert bool(images.alpha_obstacle(new_image(False, space))) == is_named
