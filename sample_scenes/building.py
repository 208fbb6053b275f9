"""All that the scenes share but nodes (nodes.py): an empty file with its settings, the camera from its four values, the parts
that sets are built of (plain-color materials, boxes, turned shapes, text, lights, a world), and saving.

Plain colors only, so that the scenes show geometry and light, need no picture files and stay small.
"""

import math
from pathlib import Path

import bmesh
import bpy

from viewcam_addon.blender import camera as virtual_pinhole
from viewcam_addon.pinhole import Pinhole


def fresh_scene(name: str, width: int, height: int):
    """Start an empty file with Cycles set to modest, clean settings and a picture of that many pixels."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.name = name
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.filepath = f"//{name}"
    scene.cycles.samples, scene.cycles.preview_samples = 128, 16
    scene.cycles.use_denoising = True
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    return scene


def distance_for(field_of_view: float, pixels: int) -> float:
    """The view-plane distance, in pixels, at which that many pixels span that angle in degrees."""
    return pixels / 2 / math.tan(math.radians(field_of_view) / 2)


def state_camera(scene, eye, look_at, distance: float, up=(0, 0, 1), principal_point=None):
    """Add the scene's camera and state it by its four values. Pixels that are not square have a distance per axis."""
    data = bpy.data.cameras.new("Virtual Pinhole")
    obj = bpy.data.objects.new("Virtual Pinhole", data)
    scene.collection.objects.link(obj)
    scene.camera = obj
    data.clip_start, data.clip_end = 0.01, 1000.0
    render = scene.render
    distances = (distance, distance * render.pixel_aspect_x / render.pixel_aspect_y)
    size = {"width": render.resolution_x, "height": render.resolution_y}
    pinhole = Pinhole(eye, look_at, up, distances, principal_point=principal_point, **size)
    did_not_stick = virtual_pinhole.apply(obj, pinhole, scene)
    if did_not_stick:
        raise RuntimeError(f"{scene.name}: {' '.join(did_not_stick)}")
    return obj


def color(code: str) -> tuple[float, float, float, float]:
    """The scene-linear color of an sRGB hex code such as "e7a58b"."""
    levels = [int(code[i : i + 2], 16) / 255 for i in (0, 2, 4)]
    linear = [level / 12.92 if level <= 0.04045 else ((level + 0.055) / 1.055) ** 2.4 for level in levels]
    return (*linear, 1.0)


def matte(name: str, code: str):
    """A Lambert surface."""
    material, tree, output = _empty_material(name, code)
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = color(code)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def glossy(name: str, code: str, roughness: float = 0.35, metallic: float = 0.0):
    """A Principled surface: glaze, lacquer or metal."""
    material, tree, output = _empty_material(name, code)
    shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = color(code)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Metallic"].default_value = metallic
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def glowing(name: str, code: str, strength: float = 1.0):
    """A surface that only emits."""
    material, tree, output = _empty_material(name, code)
    shader = tree.nodes.new("ShaderNodeEmission")
    shader.inputs["Color"].default_value = color(code)
    shader.inputs["Strength"].default_value = strength
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def mirror(name: str, code: str):
    """A perfect mirror."""
    material, tree, output = _empty_material(name, code)
    shader = tree.nodes.new("ShaderNodeBsdfAnisotropic")  # as Blender calls its Glossy BSDF
    shader.inputs["Color"].default_value = color(code)
    shader.inputs["Roughness"].default_value = 0.0
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def clear_glass(name: str, code: str, ior: float = 1.5):
    """Clear glass."""
    material, tree, output = _empty_material(name, code)
    shader = tree.nodes.new("ShaderNodeBsdfGlass")
    shader.inputs["Color"].default_value = color(code)
    shader.inputs["Roughness"].default_value = 0.0
    shader.inputs["IOR"].default_value = ior
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def _empty_material(name: str, code: str):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.diffuse_color = color(code)  # shown by the solid viewport
    material.node_tree.nodes.clear()
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (220, 0)
    return material, material.node_tree, output


def collection(name: str):
    """A new collection in the scene."""
    new = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(new)
    return new


def kit(name: str):
    """A new collection whose objects show only where something instances them."""
    new = collection(name)
    bpy.context.view_layer.layer_collection.children[name].exclude = True
    return new


def instance(name: str, kit, location=(0, 0, 0), rotation=(0, 0, 0)):
    """All objects of a kit once more, by an empty that stands for them."""
    obj = place(name, None, location=location, rotation=rotation)
    obj.instance_type, obj.instance_collection = "COLLECTION", kit
    return obj


def place(name: str, data, material=None, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1), into=None):
    """Put data into the scene as an object; rotation in degrees."""
    obj = bpy.data.objects.new(name, data)
    obj.location, obj.scale = location, scale
    obj.rotation_euler = [math.radians(angle) for angle in rotation]
    (into or bpy.context.scene.collection).objects.link(obj)
    materials = material if isinstance(material, (list, tuple)) else [material]
    if data is not None and data.users == 1:
        for each in filter(None, materials):
            data.materials.append(each)
    return obj


def mesh(name: str, vertices, faces=(), edges=(), face_materials=None, smooth: bool = False):
    """A mesh from lists."""
    new = bpy.data.meshes.new(name)
    new.from_pydata([tuple(vertex) for vertex in vertices], list(edges), [tuple(face) for face in faces])
    if face_materials is not None:
        new.polygons.foreach_set("material_index", face_materials)
    new.polygons.foreach_set("use_smooth", [smooth] * len(new.polygons))
    new.update()
    return new


def primitive(name: str, create, smooth: bool = False, **arguments):
    """A mesh from one of bmesh.ops' create functions."""
    shape = bmesh.new()
    create(shape, **arguments)
    new = bpy.data.meshes.new(name)
    shape.to_mesh(new)
    shape.free()
    new.polygons.foreach_set("use_smooth", [smooth] * len(new.polygons))
    return new


def box(name: str, size, material, location=(0, 0, 0), bevel: float = 0.02, pieces: int = 1, **options):
    """A box that stands on `location`, its edges rounded, cut across x into pieces.

    A long box wants some: float32 tells little of where in a triangle of 3 m by 7 mm a ray arrives.
    """
    cube = primitive(name, _cut_cube, smooth=bevel > 0, pieces=pieces)
    cube.vertices.foreach_set("co", [value for v in cube.vertices for value in _standing(v.co, size)])
    obj = place(name, cube, material, location, **options)
    if bevel:
        round_edges(obj, bevel)
    return obj


def _cut_cube(shape, pieces: int) -> None:
    bmesh.ops.create_cube(shape)
    along = [edge for edge in shape.edges if edge.verts[0].co.x != edge.verts[1].co.x]
    if pieces > 1:
        bmesh.ops.subdivide_edges(shape, edges=along, cuts=pieces - 1, use_grid_fill=True)


def _standing(corner, size):
    return corner.x * size[0], corner.y * size[1], (corner.z + 0.5) * size[2]


def round_edges(obj, width: float, segments: int = 3) -> None:
    """Round the sharp edges while flat faces keep looking flat."""
    bevel = obj.modifiers.new("Rounded edges", "BEVEL")
    bevel.width, bevel.segments, bevel.limit_method, bevel.harden_normals = width, segments, "ANGLE", True


def turned(name: str, profile, material, location=(0, 0, 0), steps: int = 64, **options):
    """A solid of revolution about z: the outline [(radius, height), …], turned on the lathe of a Screw modifier."""
    outline = [(radius, 0.0, height) for radius, height in profile]
    edges = [(i, i + 1) for i in range(len(outline) - 1)]
    obj = place(name, mesh(name, outline, edges=edges), material, location, **options)
    screw = obj.modifiers.new("Lathe", "SCREW")
    screw.steps = screw.render_steps = steps
    screw.use_merge_vertices, screw.use_normal_calculate, screw.use_smooth_shade = True, True, True
    split = obj.modifiers.new("Crisp corners", "EDGE_SPLIT")
    split.split_angle = math.radians(35)
    return obj


def ball(name: str, radius: float, material, location=(0, 0, 0), scale=(1, 1, 1), **options):
    """A smooth sphere of triangles, stretched by `scale`. All balls share one mesh; each has its own material."""
    data = bpy.data.meshes.get("Ball")
    if data is None:
        data = primitive("Ball", bmesh.ops.create_icosphere, smooth=True, subdivisions=4, radius=1.0)
        data.materials.append(None)
    obj = place(name, data, None, location, scale=[radius * factor for factor in scale], **options)
    obj.material_slots[0].link = "OBJECT"
    obj.material_slots[0].material = material
    return obj


def suzanne(name: str, material, location, rotation, size: float):
    """Blender's monkey, subdivided and smooth."""
    obj = place(name, primitive(name, bmesh.ops.create_monkey, smooth=True), material, location, rotation, (size,) * 3)
    subdivision = obj.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 2, 3
    return obj


def ground(name: str, width: float, depth: float, material, location=(0, 0, 0), **options):
    """A flat grid of 64 × 64. Small faces keep Cycles' float32 positions precise; two huge triangles would not."""
    corners = [(x * width / 2, y * depth / 2, 0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    obj = place(name, mesh(name, corners, [range(4)]), material, location, **options)
    subdivision = obj.modifiers.new("Grid", "SUBSURF")
    subdivision.subdivision_type, subdivision.levels, subdivision.render_levels = "SIMPLE", 6, 6
    return obj


def text(name: str, body: str, material, size: float, location=(0, 0, 0), rotation=(90, 0, 0), depth=0.06, **options):
    """Solid letters in Blender's own font, upright unless rotated otherwise."""
    data = bpy.data.curves.new(name, "FONT")
    data.body, data.size = body, size
    data.extrude, data.bevel_depth, data.bevel_resolution, data.resolution_u = depth, 0.012 * size, 2, 8
    return place(name, data, material, location, rotation, **options)


def sun(strength: float, code: str, elevation: float, azimuth: float, angle: float = 1.0):
    """Sunlight from a height above the horizon and a bearing (0 from +y, 90 from +x), all in degrees."""
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.color, data.angle = strength, color(code)[:3], math.radians(angle)
    return place("Sun", data, rotation=(90 - elevation, 0, 180 - azimuth), location=(0, 0, 6))


def softbox(name: str, watts: float, code: str, location, target, width: float, height: float):
    """A rectangular area light that faces `target`."""
    data = bpy.data.lights.new(name, "AREA")
    data.shape, data.size, data.size_y = "RECTANGLE", width, height
    data.energy, data.color = watts, color(code)[:3]
    dx, dy, dz = (t - s for t, s in zip(target, location, strict=True))
    tilt = math.degrees(math.atan2(math.hypot(dx, dy), -dz))
    turn = math.degrees(math.atan2(dy, dx)) - 90 if dx or dy else 0  # straight down, the width lies along x
    return place(name, data, location=location, rotation=(tilt, 0, turn))


def sky(code: str, strength: float = 1.0):
    """A world of one color."""
    world = bpy.data.worlds.new("Sky")
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = color(code)
    background.inputs["Strength"].default_value = strength
    bpy.context.scene.world = world
    return world


def save(scene, about: str, path: Path) -> None:
    """Leave a note about the scene, look through its camera in every 3D viewport, and write a small file."""
    note = bpy.data.texts.new("About this scene")
    note.from_string(about.strip() + "\n")
    note.use_fake_user = True
    for space in (space for screen in bpy.data.screens for area in screen.areas for space in area.spaces):
        if space.type == "VIEW_3D":
            space.region_3d.view_perspective = "CAMERA"
        elif space.type == "TEXT_EDITOR":
            space.text = note
        elif space.type == "FILE_BROWSER" and space.params:
            space.params.directory = b"//"  # in place of the home folder of whoever made the file
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, check_existing=False)
