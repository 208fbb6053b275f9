"""A Blender material as the tracer's: the shaders that its nodes are, or the nearest ones and why.

It is read as a tree of shader nodes, and where that is a sum of components without roughness as these (materials.simplified).
What makes an input that does not count is not followed. Measured in 4.2, 4.5, 5.0 and 5.2: with a specular IOR level of 0, or
an IOR of 1, a Principled BSDF gives the Diffuse BSDF's pixels to the last bit, whatever its roughness, anisotropy and tint,
unless a weight or the thin film is not 0.

What is not modeled is left out, and where nothing is left becomes a Lambert surface of its base color. Then Cycles is shown
the same for the time of a comparison (materials.stand_in): an approximation is never a difference between the two sides.
"""

import functools
import math
import zlib
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ...errors import InputError
from ...tracer.scene import ies
from ...tracer.scene.materials import LARGEST_RADIANCE, PLAIN, PLAIN_COLOR, Color, Material, Picture, simplified, sum_of
from ...tracer.scene.shader_nodes import KINDS, MOST_NODES, SHADERS, Node, closures, word_of
from ...tracer.scene.shader_nodes import node as _node
from ...tracer.scene.value_nodes import GENERATED, INCOMING, NORMAL, OWN, POSITION, TANGENT, UV, BlenderNode
from .. import versions
from . import cycles_attributes, images, nodes, value_nodes
from .nodes import Input, Output

RGB = tuple[float, float, float]

# Inputs that count only where one of these others is not 0.
_GLOSS = ("Metallic", "Transmission Weight", "Specular IOR Level")
_ONLY_WITH: dict[str, dict[str, tuple[str, ...]]] = {
    "glossy": dict.fromkeys(("Anisotropy", "Rotation", "Tangent"), ("Roughness",)),
    "principled": {
        **dict.fromkeys(("Roughness", "Specular Tint", "Anisotropic", "Anisotropic Rotation", "Tangent"), _GLOSS),
        **dict.fromkeys(("Coat Roughness", "Coat IOR", "Coat Tint", "Coat Normal"), ("Coat Weight",)),
        **dict.fromkeys(("Sheen Roughness", "Sheen Tint"), ("Sheen Weight",)),
        "Emission Color": ("Emission Strength",),
        "Thin Wall": ("Transmission Weight", "Subsurface Weight"),
    },
}
_CLEAR_OR_MIRRORS = ("glossy", "glass", "refraction")  # without roughness, whatever their facets
_WHITE, _ZERO = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
_RAMP = 256  # Cycles looks ramps up in a table of one more
_BESIDE = 1e-6  # share of a pixel: where a step lies is the pixel's that it leads to
# Values that Cycles computes of a mesh's edges; as attributes they can be asked for by name, too.
_OF_EDGES = {
    ("NEW_GEOMETRY", "Pointiness"): cycles_attributes.POINTINESS,
    ("NEW_GEOMETRY", "Random Per Island"): cycles_attributes.RANDOM_PER_ISLAND,
}
# Outputs of Light Path that are alike for rays that meet a light and for those that are sent to it.
_SURE_OF_PATHS = ("Is Camera Ray", "Is Shadow Ray", "Ray Length")
# Nodes that Cycles does not ask for a little beside a point, or in each version in another way.
_FIXED = {
    *("CAMERA", "NORMAL_MAP", "BUMP", "TANGENT"),
    *(("TEX_COORD", output) for output in ("Normal", "Reflection", "Window")),
    *(("NEW_GEOMETRY", output) for output in ("Incoming", "Tangent")),
    ("LIGHT_PATH", "Ray Length"),
}
_LUMINANCE = (0.2126390, 0.7151687, 0.0721923)
_MEAN = (1.0 / 3.0,) * 3
# Vectors that surfaces, or the light, have of themselves where no node is given any.
_OF_THEMSELVES = (UV, GENERATED, POSITION, INCOMING)
# Operation of a Math or Vector Math node → the inputs of which one that is 0 leaves none of the others.
_LEAVES_NOTHING = {
    **dict.fromkeys(("MULTIPLY", "DOT_PRODUCT", "CROSS_PRODUCT"), (0, 1)),
    **{"DIVIDE": (0,), "POWER": (1,), "SCALE": (0, 3)},
}
# Nodes that are a constant of the node itself → where it stands; RGB and Value have it in their output.
_CONSTANTS = {"INPUT_VECTOR": "vector", "INPUT_INT": "integer", "INPUT_BOOL": "boolean"}


# Shaders that Cycles takes for another one on a surface, and for none.
_AS = {"BACKGROUND": "EMISSION"} | versions.NODE_TYPES
_VOLUMES = ("VOLUME_ABSORPTION", "VOLUME_SCATTER", "VOLUME_COEFFICIENTS", "PRINCIPLED_VOLUME")
# Nodes that feed one another in a row. One of them may become two of the tracer's, which may be more (shader_nodes.MOST_DEEP).
_MOST_DEEP = 100


@dataclass
class Reading:
    """A Blender material as the tracer has it.

    images : key in `Color.image` → the image.
    texts : the texts of IES files, where nodes are made that show them.
    reasons : clauses about the material that say why it is approximated.
    """

    material: Material = PLAIN
    images: dict[str, bpy.types.Image] = field(default_factory=dict)
    alphas: set[str] = field(default_factory=set)
    tables: dict[str, Picture] = field(default_factory=dict)
    texts: dict[str, bpy.types.Text] = field(default_factory=dict)
    reasons: list[str] = field(default_factory=list)

    @functools.cached_property
    def asks_for_random(self) -> bool:
        """True if it is another on each instance."""
        return any(node.type == "object_info" and node["output"] == "random" for node in self.material.nodes)

    @property
    def is_bumped(self) -> bool:
        """True if it, or a shader of it, has a normal of its own."""
        return self.material.displacement is not None or any(
            KINDS[each.node.type].inputs[name] is NORMAL for each in self.material.closures for name, _ in each.node.inputs
        )

    @property
    def mixes_refractions(self) -> bool:
        """True if another closure lets light through beside one that refracts it roughly."""
        shaders = [each.node for each in self.material.closures]
        refractions = sum(shader.is_rough_refraction for shader in shaders)
        return refractions > 1 or (refractions == 1 and any(shader.type == "translucent" for shader in shaders))


def read(material: bpy.types.Material) -> Reading:
    """The reading of what Cycles would show of an evaluated material, but for what moves the surface and its volume."""
    tree = versions.node_tree(material)
    output = tree and tree.get_output_node("CYCLES")
    if not output:
        return in_the_viewport(material)
    viewport, node_input = _viewport_color(material), Input(output.inputs["Surface"])
    divided = divided_images(output)
    reader = Tree(viewport, divided=divided)
    surface = reader.surface(node_input)
    shines = any(closure.node.is_shining for closure in closures(surface))
    if shines:
        reader = Tree(viewport, shines, divided)
        surface = reader.surface(node_input)
    simple = simplified(surface)
    is_tree = surface is not None and simple is surface
    reader.reading.material = Material(simple, not is_tree or material.use_transparent_shadow)
    return _displaced(reader.reading, material, output, shines)


def _displaced(reading: Reading, material: bpy.types.Material, output: bpy.types.Node, shines: bool) -> Reading:
    """A reading with what its displacement does to the normals, where that is all that it does."""
    if shines and versions.LOSES_LIGHT_OF_BUMPED and _loses_light(output):
        reading.reasons.append("gives off light beside a displacement, where Cycles loses most of it")
    elif is_only_bumped(material):
        reader = Tree(PLAIN_COLOR, shines, divided_images(output))
        reader.reading = reading
        reading.material = replace(reading.material, displacement=reader.height(Input(output.inputs["Displacement"])))
    return reading


def _loses_light(output: bpy.types.Node) -> bool:
    """True if a Principled BSDF and a displacement feed a material's output."""
    surface, displacement = (Input(output.inputs[name]) for name in ("Surface", "Displacement"))
    has_principled = any(each.node.type == "BSDF_PRINCIPLED" for each in nodes.feeding(surface))
    return has_principled and isinstance(nodes.source(displacement), Output)


def is_only_bumped(material: bpy.types.Material) -> bool:
    """True if a displacement moves nothing, but turns the normals."""
    return material.displacement_method == "BUMP"


def in_the_viewport(material: bpy.types.Material) -> Reading:
    """A Lambert surface of the color that the material has in Blender's viewport."""
    return Reading(sum_of(diffuse=_viewport_color(material)))


def _viewport_color(material: bpy.types.Material) -> Color:
    return Color(possible(material.diffuse_color[:3]) or PLAIN_COLOR.rgb)


class Tree:
    """Follows the nodes to a tree of shader nodes, and gathers what they ask for.

    viewport : the color that stands in for one that is not modeled.
    shines : true if the material gives off light.
    divided : see divided_images.
    """

    def __init__(self, viewport: Color, shines: bool = False, divided: frozenset[object] = frozenset()) -> None:
        self.reading = Reading()
        self.viewport = viewport
        self._shines = shines
        self._divided = divided
        self._deep = 0
        self._is_beside = False  # true while values are asked for a little beside, too, as heights are

    def surface(self, node_input: Input | None) -> Node | None:
        """The tracer's node, or None where there is no surface."""
        source = node_input and nodes.source(node_input)
        if not isinstance(source, Output) or source.node.type in _VOLUMES:
            return None
        if source.socket.type != "SHADER":
            return Node("emission", (("color", self._emission(node_input)),))
        kind = _AS.get(source.node.type, source.node.type)
        row = next(((ours, shader) for ours, shader in SHADERS.items() if shader.kind == kind), None)
        if row is None:
            self._reason(source, "is not modeled")
            name = next((name for name in ("Base Color", "Color") if name in source.node.inputs), None)
            return Node("diffuse", (("color", self._color(source, name) if name else self.viewport),))
        ours, shader = row
        for name, neutral in shader.neutral.items():
            if _counts(source, ours, name):
                self._want(source, name, neutral)
        known = KINDS[ours].inputs
        inputs: dict[str, object] = {}
        for name, theirs in shader.inputs.items():
            if not _counts(source, ours, theirs) and constant_color(source, theirs) is None:
                continue
            if known[name] is TANGENT and not Node(ours, tuple(inputs.items())).is_stretched:
                continue
            if (
                known[name] is TANGENT
                and (node_input := source.input(theirs))
                and not nodes.is_left_alone(node_input)
                and _is_nothing(node_input)
            ):
                self._reason(source, "is stretched along a Tangent of 0, which Cycles shows black")
                continue
            if known[name] in OWN:
                inputs |= self._normal(source, name, theirs)
            elif known[name] is not None and source.input(theirs) is not None:
                inputs[name] = self._input(source, theirs, known[name] if isinstance(known[name], float) else None)
        if "rotation" in inputs and (constant_number(source, "Anisotropy") or 0.0) < 0.0:
            inputs["rotation"] = _quarter_further(inputs["rotation"])
        for name in (name for name, default in known.items() if default is None):
            if (
                ours == "add"
                or inputs["factor"].varies
                or inputs["factor"].rgb[0] not in {"first": (1.0,), "second": (0.0,)}[name]
            ):
                inputs[name] = self.surface(source.input(shader.inputs[name]))
        return self._with_glow_on_top(source, Node(ours, tuple((inputs | self._words(source, ours)).items())))

    def _with_glow_on_top(self, output: Output, shader: Node) -> Node:
        """A shader whose sheen or coat does not dim its own light.

        Cycles makes no closures, so no layers, where a path ends and, before 5.2, where it asks a surface for its light: how
        much the layers take then depends on how many bounces there are and which of two samples has found the light.
        """
        is_layered = shader.type == "principled" and not (shader["sheen_weight"].is_black and shader["coat_weight"].is_black)
        if not (is_layered and shader.is_shining):
            return shader
        self._reason(output, "gives off light below its coat or sheen, which Cycles dims on some ways only")
        below = _node("principled", **{name: value for name, value in shader.inputs if not name.startswith("emission")})
        glow = _node("emission", color=shader["emission_color"], strength=shader["emission_strength"])
        alpha = shader["alpha"]
        is_opaque = not alpha.varies and alpha.rgb[0] == 1.0
        return _node("add", first=below, second=glow if is_opaque else _node("mix", factor=alpha, second=glow))

    def _emission(self, node_input: Input) -> Color | Node:
        """The emission of a surface whose shader is a color or a number."""
        value = self._value_input(node_input, None)
        return value if isinstance(value, Color | Node) else Color(value) if value and possible(value) else self.viewport

    def _color(self, output: Output, name: str | int) -> Color:
        rgb = constant_color(output, name)
        if rgb is not None:
            if possible(rgb) is None:
                self._reason(output, f"has the {output.node.inputs[name].name} {', '.join(f'{value:g}' for value in rgb)}")
            return Color(rgb) if possible(rgb) else self.viewport
        source = nodes.source(output.input(name))
        node = source.node
        if node.type == "TEX_IMAGE" and source.socket.name == "Color":
            return self._image(source)
        if _is_vertex_color(source):
            return Color(_WHITE, vertex=True)
        if node.type == "VECT_MATH" and node.operation == "MULTIPLY":
            return self._product(source)
        self._reason(source, "is not modeled")
        return self.viewport

    def _product(self, output: Output) -> Color:
        """The product that a Vector Math node makes of two colors."""
        first, second = self._color(output, 0), self._color(output, 1)
        if (first.image and second.image) or (first.vertex and second.vertex):
            self._reason(output, "multiplies two colors that vary alike")
            return first
        rgb = possible(tuple(a * b for a, b in zip(first.rgb, second.rgb, strict=True)))
        if rgb is None:
            self._reason(output, "multiplies colors beyond what light can have")
            return self.viewport
        textured = first if first.image else second
        return Color(rgb, textured.image, textured.closest, first.vertex or second.vertex)

    def _image(self, output: Output) -> Color:
        """An image that is a color alone: laid out by UV, repeated, with colors that nobody divides by its alpha."""
        node = output.node
        if _looked_up(output) in self._divided:
            self._reason(output, "has a color beside its alpha")
        if node.extension != "REPEAT":
            self._reason(output, f"does not repeat ({node.extension.lower()})")
        if node.projection != "FLAT":
            self._reason(output, "is not projected flat")
        if node.interpolation not in ("Linear", "Closest"):
            self._reason(output, f"interpolates {node.interpolation.lower()}")
        if not self._shows(output):
            return self.viewport
        vector = nodes.source(output.input("Vector"))
        if isinstance(vector, Output) and not self._is_uv(vector):
            self._reason(vector, "is not modeled")
        elif isinstance(vector, Input) and not nodes.is_left_alone(output.required("Vector")):
            self._reason(output, "shows one place")
        return Color(_WHITE, node.image.original.name_full, node.interpolation == "Closest")

    def _shows(self, output: Output) -> bool:
        """True if an Image Texture's image is one that we can have, which is noted then."""
        node = output.node
        image = node.image and node.image.original
        why = images.obstacle(image)
        if why:
            self._reason(output, why)
            return False
        if not maps_plainly(node):
            self._reason(output, "has a mapping of its own")
        self.reading.images[image.name_full] = image
        return True

    def _is_uv(self, vector: Output) -> bool:
        """True if an output is the UV map of a mesh that is active for rendering."""
        if vector.node.type == "UVMAP" and not vector.node.from_instancer:
            return not vector.node.uv_map
        return vector.node.type == "TEX_COORD" and vector.socket.name == "UV" and not vector.node.from_instancer

    def _want(self, output: Output, name: str, wanted: float) -> bool:
        """True if an input has this value, or is none in this version; a reason is noted where it has another."""
        if output.input(name) is None:
            return True
        value = constant_number(output, name)
        if value != wanted:
            self._reason(output, f"has a {name} that varies" if value is None else f"has {name} {value:.3g}")
        return value == wanted

    def _reason(self, output: Output, clause: str) -> None:
        reason = f"has a node {output.node.name!r} that {clause}"
        if reason not in self.reading.reasons:
            self.reading.reasons.append(reason)

    def height(self, node_input: Input) -> Node | None:
        """The height of a displacement along the normal, or None where it is the same everywhere or not modeled."""
        source = nodes.source(node_input)
        if not isinstance(source, Output):
            return None
        self._is_beside = True
        if source.node.type == "DISPLACEMENT":
            return self._displacement(source)
        is_vector = source.node.type == "VECTOR_DISPLACEMENT"
        offset = self._displacement_vector(source) if is_vector else self._value(source)
        return None if offset is None else _along_normal(offset)

    def _displacement(self, output: Output) -> Node | None:
        """The height that a Displacement node raises along the normal."""
        height, midlevel, scale = (self._value_input(output.input(name), 0.0) for name in ("Height", "Midlevel", "Scale"))
        if height is None or midlevel is None or scale is None:
            return None
        for by, operation, neutral in ((midlevel, "subtract", 0.0), (scale, "multiply", 1.0)):
            if by != (neutral,) * 3:
                height = _node("math", operation=operation, a=height, b=by)
        if not isinstance(height, Node):  # an image as it is, or the same everywhere
            height = _node("math", operation="multiply", a=height, b=1.0)
        normal = self._normal(output, "normal", "Normal").get("normal")
        if normal is None and output.node.space == "WORLD":
            return height
        way = normal or _node("geometry", output="normal")
        if output.node.space == "OBJECT":
            inwards = _node("vector_transform", vector=way, kind="normal", **{"from": "world", "to": "object"})
            way = _node("vector_transform", vector=inwards, **{"from": "object", "to": "world"})
        return _node("math", operation="multiply", a=height, b=_along_normal(way))

    def _displacement_vector(self, output: Output) -> Node | None:
        """The height by which a Vector Displacement node moves."""
        if output.node.space == "TANGENT":
            self._reason(output, "displaces along tangents")
            return None
        vector = self._value_input(output.input("Vector"), None)
        midlevel, scale = (self._value_input(output.input(name), 0.0) for name in ("Midlevel", "Scale"))
        if vector is None or midlevel is None or scale is None:
            return None
        offset = _node("vector_math", operation="subtract", a=vector, b=midlevel)
        offset = _node("vector_math", operation="scale", a=offset, scale=scale)
        if output.node.space == "WORLD":
            return offset
        return _node("vector_transform", vector=offset, **{"from": "object", "to": "world"})

    def _normal(self, output: Output, name: str, theirs: str) -> dict[str, Node]:
        """The node that makes a normal, where one does and is modeled."""
        node_input = output.input(theirs)
        if node_input is None or nodes.is_left_alone(node_input):
            return {}
        source, constant = nodes.source(node_input), constant_color_of(node_input)
        if isinstance(source, Output) and source.node.type == "BUMP" and _constant(source.input("Height")) is not None:
            return self._normal(source, name, "Normal")
        value = self._value(source) if constant is None else _vector(constant)
        return {name: value} if isinstance(value, Node) else {}

    def _words(self, output: Output, ours: str) -> dict[str, str]:
        result = {}
        for name, theirs in SHADERS[ours].words.items():
            word = getattr(output.node, theirs)
            known = [each for each in KINDS[ours].inputs[name] if word_of(each) == word]
            is_smooth = ours in _CLEAR_OR_MIRRORS and constant_number(output, "Roughness") == 0.0
            if not known and not is_smooth:
                self._reason(output, f"has the {name} {word}")
            result |= dict.fromkeys([name] if known else [], *known)
        return result

    def _input(self, output: Output, name: str | int, otherwise: float | None) -> Color | Node:
        """The value of an input. otherwise : the number where that is not modeled, or None of a color."""
        value = None if otherwise is None else constant_number(output, name)
        if value is None:
            source = nodes.source(output.input(name))
            before, self.reading.reasons = self.reading.reasons, []
            result: Color | Node | None = self._color(output, name)
            if self.reading.reasons and isinstance(source, Output):
                self.reading.reasons = []
                result = self._value(source)
            why, self.reading.reasons = self.reading.reasons, before
            if result is not None and not why:
                return result
            before += [reason for reason in why if reason not in before]
            return self.viewport if otherwise is None else Color((otherwise,) * 3)
        if isinstance(name, str) and name.endswith("Rotation"):
            value %= 1.0
        if name == "Anisotropy":
            value = abs(value)  # which way, Tree.surface asks
        most = 1.0 if isinstance(name, int) else LARGEST_RADIANCE
        if not math.isfinite(value) or value > LARGEST_RADIANCE or (value < 0 and str(name).endswith("Strength")):
            self._reason(output, f"has a {output.node.inputs[name].name} of {value:g}")
            value = 0.0
        return Color((min(max(value, 0.0), most),) * 3)

    def _value(self, output: Output) -> Color | Node | None:
        """The nodes that make a value; None where a reason says that it is not modeled."""
        if self._deep == _MOST_DEEP:
            self._reason(output, f"feeds {_MOST_DEEP} others in a row")
            return None
        self._deep += 1
        try:
            return self._value_of_node(output)
        finally:
            self._deep -= 1

    def _value_of_node(self, output: Output) -> Color | Node | None:
        node = output.node
        if self._is_beside and {node.type, (node.type, output.socket.name)} & _FIXED:
            self._reason(output, "makes a height of what it says here alone")
            return None
        if _is_vertex_color(output):
            return Color(_WHITE, vertex=True)
        if node.type == "UVMAP" and self._is_uv(output):
            return Node("texture_coordinate")
        if node.type == "TEX_COORD" and output.socket.name == "Object" and node.object is not None:
            return in_space_of(node.object.matrix_world)
        if (node.type, output.socket.name) in _OF_EDGES:
            return _node("attribute", name=_OF_EDGES[node.type, output.socket.name], output="number")
        if node.type == "LIGHT_FALLOFF":
            return self._falloff(output)
        if node.type == "CAMERA":
            return _from_camera(output.socket.name)
        if node.type == "VALTORGB":
            return self._ramp(output)
        if node.type == "NORMAL":
            return self._along(output)
        return self._value_by_table(output)

    def _value_by_table(self, output: Output) -> Color | Node | None:
        """The value of a node that `value_nodes` has a row of."""
        entry = value_nodes.row_of(output)
        if entry is None:
            self._reason(output, "is not modeled")
            return None
        ours, row = entry
        words = value_nodes.given_words(output, ours, row)
        why = words if isinstance(words, str) else self._departure(output, ours)
        if why:
            self._reason(output, why)
            return None
        if ours == "mapping" and _drops_its_location(output):
            return _vector(_ZERO)
        inputs = dict(words)
        if not self._add_contents(output, ours, inputs) or not self._add_sockets(output, ours, row, inputs):
            return None
        try:
            result = Node(ours, tuple(inputs.items()))
        except InputError:
            self._reason(output, f"is computed by more than {MOST_NODES} others")
            return None
        plain = Node("image", tuple((name, result[name]) for name in ("image", "interpolation"))) if ours == "image" else None
        if result == plain and result["interpolation"] != "cubic":
            return Color(_WHITE, result["image"].image, result["interpolation"] == "closest")
        return result

    def _add_contents(self, output: Output, ours: str, inputs: dict[str, object]) -> bool:
        """Add the image, the curves or the lamp's profile that a node holds; false where one can't be shown."""
        if "image" in KINDS[ours].inputs:
            if not self._shows(output):
                return False
            image = output.node.image.original
            inputs["image"] = Color(_WHITE, image.name_full)
            if ours == "image" and _looked_up(output) in self._divided:
                if why := images.alpha_obstacle(image):
                    self._reason(output, why)
                    return False
                inputs["straight"] = images.is_divided(image)
                self._ask_for_alpha(image, inputs)
        if "table" in KINDS[ours].inputs:
            inputs |= self._curves(output)
        if ours == "ies":
            inputs["text"] = text = value_nodes.ies_text(output.node)
            try:
                ies.read("it", text)
            except InputError as error:
                self._reason(output, f"shows what {str(error).partition(': ')[0].removeprefix('it ')}")
                return False
        return True

    def _add_sockets(self, output: Output, ours: str, row: BlenderNode, inputs: dict[str, object]) -> bool:
        """Add the values of a node's sockets; false where one can't be told."""
        reasons_before = len(self.reading.reasons)
        for name, theirs in row.inputs.items():
            known = KINDS[ours].inputs[name]
            if known in OWN:
                inputs |= self._normal(output, name, theirs)
                continue
            socket = value_nodes.input_of(output.node, theirs)
            if socket is None:
                inputs[name] = (row.before[name](versions.CYCLES),) * 3
                continue
            node_input = Input(socket, output.groups)
            if known in _OF_THEMSELVES and nodes.is_left_alone(node_input):
                if (of_itself := self._of_itself(output, known)) is not None:
                    inputs[name] = of_itself
                elif len(self.reading.reasons) > reasons_before:
                    return False
                continue
            is_beside, self._is_beside = self._is_beside, self._is_beside or name == "height"
            read = self._value_input(node_input, known)
            self._is_beside = is_beside
            if read is None:
                return False
            inputs[name] = _vector(read) if known in _OF_THEMSELVES and isinstance(read, tuple) else read
        return True

    def _ask_for_alpha(self, image: bpy.types.Image, inputs: dict[str, object]) -> None:
        """Note that an image's alpha is asked for: one that is packed is a picture of its own, since a picture's colors are
        multiplied by the alpha beside them."""
        key = image.name_full
        if image.alpha_mode == "CHANNEL_PACKED" and image.colorspace_settings.name == "sRGB":
            if inputs["output"] != "alpha":
                return
            key += " (alpha)"
            self.reading.images[key], inputs["image"] = image, Color(_WHITE, key)
        self.reading.alphas.add(key)

    def _value_input(self, node_input: Input, known: object) -> Color | Node | tuple[float, ...] | None:
        """The value of an input of a node that makes values. known : its default, a number where it is one."""
        constant = constant_number_of(node_input) if isinstance(known, float) else _constant(node_input)
        if constant is not None:
            three = _rgb(constant)
            if all(math.isfinite(value) and abs(value) <= LARGEST_RADIANCE for value in three):
                return three
            self.reading.reasons.append(f"has a node {node_input.socket.node.name!r} that is given {max(three, key=abs):g}")
            return None
        return self._value(nodes.source(node_input))

    def _departure(self, output: Output, ours: str) -> str | None:
        """The reason that a node that we know is another here, one clause."""
        node = output.node
        if hasattr(node, "texture_mapping") and not maps_plainly(node):
            return "has a mapping of its own"
        if ours == "texture_coordinate" and node.from_instancer and output.socket.name in ("UV", "Generated"):
            return "has its instancer's coordinates"
        if ours == "brick" and versions.ROWS_NEED_HEIGHTS and constant_number(output, "Row Height") == 0:
            return "has rows without a height, of which Cycles makes no number"
        if ours == "bump" and output.node.inputs.get("Filter Width"):
            width = constant_number(output, "Filter Width")
            if width is None or width < 0:
                return (
                    "has a Filter Width that varies" if width is None else "has a Filter Width below 0, which makes no normal"
                )
        if ours == "light_path" and self._shines and output.socket.identifier not in _SURE_OF_PATHS:
            return f"says the {output.socket.name} of light"
        return None

    def _of_itself(self, output: Output, known: object) -> Node | None:
        """The node that a node that makes values looks itself up by where nothing is given, but for what we do alike."""
        if known is INCOMING:
            return _node("vector_transform", vector=_node("geometry", output="incoming"), kind="normal")
        return None

    def _falloff(self, output: Output) -> Color | Node | None:
        """The strength that a Light Falloff node makes of light that falls off with the square of its way."""
        strength, smooth = (self._value_input(output.input(name), 0.0) for name in ("Strength", "Smooth"))
        if strength is None or smooth is None:
            return None
        way = _node("light_path", output="ray_length")
        squared = _node("math", operation="multiply", a=way, b=way)
        by: Node | None = {"Linear": way, "Constant": squared}.get(output.socket.name)
        value = strength if by is None else _node("math", operation="multiply", a=strength, b=by)
        if smooth != _ZERO:
            slower = _node("math", operation="add", a=squared, b=_node("math", operation="maximum", a=smooth, b=0.0))
            value = _node("math", operation="multiply", a=value, b=_node("math", operation="divide", a=squared, b=slower))
        return _node("math", operation="add", a=value, b=0.0)  # a number, even of a color

    def _curves(self, output: Output) -> dict[str, object]:
        """The table that Cycles makes of a node's curves."""
        mapping = output.node.mapping
        pixels, least, most = value_nodes.curve_table(mapping)
        key = f"Curves {zlib.crc32(pixels.tobytes()):08x}"
        self.reading.tables[key] = Picture(pixels)
        ends = {"least": (least,) * 3, "most": (most,) * 3}
        return ends | {"table": Color(_WHITE, key), "extrapolate": mapping.extend == "EXTRAPOLATED"}

    def _along(self, output: Output) -> Node | None:
        """The value of a Normal node: its direction, and how far another one goes along it."""
        direction = _node("vector_math", operation="normalize", a=tuple(output.node.outputs["Normal"].default_value))
        if output.socket.name == "Normal":
            return direction
        other = self._value_input(Input(output.node.inputs[0], output.groups), None)
        if other is None:
            return None
        return _node(
            "vector_math", operation="dot_product", a=direction, b=_node("vector_math", operation="normalize", a=other)
        )

    def _ramp(self, output: Output) -> Node | None:
        """A Color Ramp, as the picture of 257 pixels that Cycles makes of it."""
        factor = self._value_input(Input(output.node.inputs[0], output.groups), 0.5)
        if factor is None:
            return None
        ramp = output.node.color_ramp
        pixels = np.array([[ramp.evaluate(i / _RAMP) for i in range(_RAMP + 1)]], np.float32)
        key = f"Color Ramp {zlib.crc32(pixels.tobytes()):08x}"
        self.reading.tables[key] = Picture(pixels)
        closest = ramp.interpolation == "CONSTANT" and ramp.color_mode == "RGB"
        first = _BESIDE if closest else 0.5
        steps = _RAMP + 1
        place = _node("math", operation="multiply_add", a=factor, b=_RAMP / steps, c=first / steps, clamp=False)
        return _node(
            "image",
            image=Color(_WHITE, key),
            vector=place,
            interpolation="closest" if closest else "linear",
            extension="extend",
            output="alpha" if output.socket.name == "Alpha" else "color",
        )


def _left_by_folding(output: Output) -> list[Input]:
    """The inputs that Cycles leaves to a node: none to what is 0, one to a mixture that is one of its sides (constant_fold and
    simplify_settings of intern/cycles/scene/shader_nodes.cpp)."""
    node, kind = output.node, output.node.type
    inputs = [Input(socket, output.groups) for socket in node.inputs]
    if kind in ("MIX_SHADER", "MIX_RGB", "MIX"):
        data = getattr(node, "data_type", "RGBA").replace("RGBA", "COLOR").title()
        theirs = {"MIX_SHADER": ("Fac", "Shader", "Shader_001"), "MIX_RGB": ("Fac", "Color1", "Color2")}
        names = theirs.get(kind, ("Factor_Float", f"A_{data}", f"B_{data}"))
        factor, first, second = (Input(value_nodes.input_of(node, name), output.groups) for name in names)
        share, blend = constant_number_of(factor), getattr(node, "blend_type", "MIX") if data == "Color" else "MIX"
        if share is not None and getattr(node, "clamp_factor", True):
            share = min(max(share, 0.0), 1.0)
        if share == 0.0 and blend not in ("LIGHTEN", "DODGE", "BURN"):
            return [first]
        return [second] if share == 1.0 and blend == "MIX" else inputs
    if kind in ("MATH", "VECT_MATH"):
        return [] if any(_is_nothing(inputs[number]) for number in _LEAVES_NOTHING.get(node.operation, ())) else inputs
    if kind in ("EMISSION", "BACKGROUND"):
        return [] if any(_is_nothing(output.required(name)) for name in ("Color", "Strength")) else inputs
    if kind == "BSDF_PRINCIPLED":
        weights = {name: needed[0] for name, needed in _ONLY_WITH["principled"].items() if len(needed) == 1}
        return [node_input for node_input in inputs if constant_number(output, weights.get(node_input.socket.name, "")) != 0.0]
    return inputs


def _is_nothing(node_input: Input) -> bool:
    """True if 0 is all that Cycles leaves of an input."""
    constant, source = constant_color_of(node_input), nodes.source(node_input)
    if constant is not None or isinstance(source, Input):
        return constant == _ZERO
    is_product = source.node.type in ("MATH", "VECT_MATH") and source.node.operation != "POWER"
    return is_product and not _left_by_folding(source)


def divided_images(output: bpy.types.Node) -> frozenset[object]:
    """The ways in which images are looked up whose alpha an output asks for: there Cycles divides their colors by it.

    Nodes that are alike are one to Cycles, which asks for both.
    """
    inputs = (Input(output.inputs[name]) for name in ("Surface", "Displacement") if name in output.inputs)
    fed = set[Output]().union(*(nodes.feeding(each, _left_by_folding) for each in inputs))
    return frozenset(_looked_up(each) for each in fed if each.node.type == "TEX_IMAGE" and each.socket.name == "Alpha")


def _looked_up(output: Output) -> object:
    """The way in which an Image Texture looks its image up, the same for nodes that are alike."""
    node, vector = output.node, nodes.source(output.required("Vector"))
    place: object = vector if isinstance(vector, Output) else constant_color_of(vector)
    if isinstance(vector, Output) and vector.node.type == "TEX_COORD":
        place = vector.socket.name, vector.node.object
    return node.image, node.interpolation, node.extension, node.projection, node.projection_blend, place


def _counts(output: Output, ours: str, theirs: str | int) -> bool:
    """True if what an input of a shader is given has a say."""
    needed = _ONLY_WITH.get(ours, {}).get(theirs, ())
    return not needed or not all(_is_zero(output, name) for name in needed)


def _is_zero(output: Output, name: str) -> bool:
    if name == "Specular IOR Level" and constant_number(output, "IOR") == 1.0:
        return True
    return constant_number(output, name) == 0.0


def _is_vertex_color(output: Output) -> bool:
    """True if an output is the mesh's color that is active for rendering, as `Color.vertex` is; others are attributes."""
    return output.node.type == "VERTEX_COLOR" and output.socket.name == "Color" and not output.node.layer_name


def _along_normal(vector: Color | Node) -> Node:
    return _node("vector_math", operation="dot_product", a=vector, b=_node("geometry", output="normal"))


def _quarter_further(rotation: Color | Node) -> Color | Node:
    """A rotation in turns and a quarter, as stretched across a tangent is along another."""
    if rotation.varies:
        return _node("math", operation="add", a=rotation, b=(0.25,) * 3)
    return Color(((rotation.rgb[0] + 0.25) % 1.0,) * 3)


def _drops_its_location(output: Output) -> bool:
    """True if Cycles drops the location of a Mapping with what it scales by 0 (ConstantFolder::fold_mapping)."""
    others = ("Vector", "Location", "Rotation")
    return constant_color(output, "Scale") == _ZERO and None in (constant_color(output, each) for each in others)


def _vector(value: RGB) -> Node:
    """The node that gives a constant where nothing given would be something else."""
    return _node("combine_xyz", **dict(zip("xyz", value, strict=True)))


def in_space_of(matrix: object) -> Node:
    """The position of a point of a surface in the space of an object with this matrix."""
    inverse, position = np.linalg.inv(np.array(matrix, np.float64)), _node("geometry", output="position")
    rows = (_node("math", operation="add", a=dot(position, row[:3]), b=row[3]) for row in inverse[:3])
    return _node("combine_xyz", **dict(zip("xyz", rows, strict=True)))


def dot(vector: Node, by: object) -> Node:
    """The length of a vector along another."""
    return _node("vector_math", operation="dot_product", a=vector, b=tuple(float(number) for number in by))


def _from_camera(output: str) -> Node:
    """The node of what a Camera Data node says."""
    place = _node("texture_coordinate", output="camera")
    if output == "View Z Depth":
        return _node("separate", color=place, output="z")
    return _node("vector_math", operation="length" if output == "View Distance" else "normalize", a=place)


def maps_plainly(node: bpy.types.Node) -> bool:
    """True if a texture node has no mapping of its own."""
    mapping, colors = node.texture_mapping, node.color_mapping
    return (
        tuple(mapping.translation) == tuple(mapping.rotation) == (0.0, 0.0, 0.0)
        and tuple(mapping.scale) == _WHITE
        and (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z) == ("X", "Y", "Z")
        and not (mapping.use_min or mapping.use_max or colors.use_color_ramp)
        and (colors.brightness, colors.contrast, colors.saturation, colors.blend_factor) == (1.0, 1.0, 1.0, 0.0)
    )


def _rgb(value: object) -> RGB:
    """A socket's value as a color."""
    return (float(value),) * 3 if isinstance(value, int | float) else tuple(map(float, value[:3]))


def constant_number(output: Output, name: str | int) -> float | None:
    """The constant that a node's input is given, or None where it varies."""
    node_input = output.input(name)
    return node_input and constant_number_of(node_input)


def constant_number_of(node_input: Input) -> float | None:
    """The constant of an input as a number, or None where it varies."""
    value = _constant(node_input)
    if value is None or isinstance(value, int | float):
        return value
    end = nodes.source(node_input)
    factors = _MEAN if end.socket.type == "VECTOR" else _LUMINANCE
    return sum(factor * each for factor, each in zip(factors, _rgb(value), strict=True))


def constant_color(output: Output, name: str | int) -> RGB | None:
    """The constant color that a node's input is given, or None where it varies."""
    node_input = output.input(name)
    return node_input and constant_color_of(node_input)


def constant_color_of(node_input: Input) -> RGB | None:
    """The constant of an input as a color, or None where it varies."""
    value = _constant(node_input)
    return None if value is None else _rgb(value)


def _constant(node_input: Input) -> object:
    source = nodes.source(node_input)
    if isinstance(source, Output) and images.shows_nothing(source.node):
        return images.MISSING[3] if source.socket.name == "Alpha" else images.MISSING[:3]
    if isinstance(source, Output) and source.node.type == "LIGHT_FALLOFF" and source.socket.name == "Quadratic":
        # Light that falls off as it does of itself.
        return _constant(source.input("Strength")) if _constant(source.input("Smooth")) == 0 else None
    if isinstance(source, Output) and (name := _CONSTANTS.get(source.node.type)):
        return getattr(source.node, name)
    if isinstance(source, Output) and source.node.type not in ("RGB", "VALUE"):
        return None
    return 0.0 if isinstance(source, Input) and source.is_zero else source.socket.default_value


def possible(rgb: RGB) -> RGB | None:
    """The color, or None where light can't have it: it is negative, too large or not finite."""
    return tuple(rgb) if all(math.isfinite(value) and 0.0 <= value <= LARGEST_RADIANCE for value in rgb) else None
