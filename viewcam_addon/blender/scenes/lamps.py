"""Blender's lights as the tracer's lamps: a class each.

What the settings mean is Cycles' (light.cpp of intern/cycles/blender and of intern/cycles/scene): a light of the strength s, in
watts for all but suns, has the radiance s/(π A) if it is normalized, else s/π; a sun the irradiance s, else the radiance s.
The position and the angles are the matrix's, the radius is not scaled with it.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, ClassVar

import bpy
import numpy as np

from ...errors import InputError
from ...pinhole import Pinhole
from ...tracer.scene.film import Bounces
from ...tracer.scene.lamps import RAYS, Area, Lamp, Point, Spot, Sun
from ...tracer.scene.materials import Color, Picture
from ...tracer.scene.shader_nodes import Node, closures, node
from ...tracer.scene.value_nodes import GENERATED, INCOMING, UV
from .. import versions
from ..temporary_settings import Overrides
from . import features, images, linking, nodes, shaders, shading
from .ledger import Ledger
from .nodes import Input, Output
from .shaders import RGB

_WHITE = (1.0, 1.0, 1.0)
# The largest cosine between two axes of an area light; beyond it Cycles' own formulas contradict each other.
_SHEAR = 1e-5
# From where on its pictures differ by more than chance at some samples: by two to a hundred percent at 0.1. Chosen.
_LARGE_SHEAR = 1e-3
# Radians, a little less than 1°: of what is less spread so few samples find interreflection that two pictures of up to 64 of
# them differ by what seems more than chance. Measured at 0.5°.
_LEAST_SPREAD = 0.0174
_SHEARED = "is sheared, which Cycles takes for one shape here and another there"
_FLAT = "is scaled to 0, which leaves no space to its direction or its nodes"


class _Kind:
    """One of Blender's lights as a lamp of the tracer.

    lamp : the tracer's lamp.
    settings : name of one of its numbers → Blender's property.
    size : the property that is above 0 where it has a size.
    """

    lamp: type[Lamp]
    settings: ClassVar[dict[str, str]]
    size = "shadow_soft_size"

    def values(self, light: bpy.types.Light, matrix: np.ndarray, strength: RGB) -> dict[str, Any]:
        """The values of the lamp: where it is, how strong it is, and its numbers."""
        place = {"power": strength, "matrix": matrix}
        return place | {field: getattr(light, setting) for field, setting in self.settings.items()}

    def exported(
        self, name: str, light: bpy.types.Light, matrix: np.ndarray, strength: RGB, common: dict[str, Any], ledger: Ledger
    ) -> Lamp | None:
        """The lamp, or None where there is no light. strength : in watts, or, where it is not normalized, by area."""
        if not getattr(light, "normalize", True):
            strength = _times(strength, self.area(light, matrix))
        return self.lamp(name, **self.values(light, matrix, strength), **common)

    def shear(self, light: bpy.types.Light, matrix: np.ndarray) -> float:
        """The largest cosine between two of its axes, where that counts; 0 else."""
        return 0.0

    def is_flat(self, light: bpy.types.Light, matrix: np.ndarray) -> bool:
        """True if a scale of 0 leaves it no direction, and light all the same."""
        return False

    def area(self, light: bpy.types.Light, matrix: np.ndarray) -> float:
        """The area that a strength by area is multiplied by."""
        radius = light.shadow_soft_size
        return 4 * math.pi * radius**2 if radius > 0 else 4.0

    def settings_shown(self, light: bpy.types.Light) -> tuple[str, ...]:
        """The properties that count in the picture, and no other kind of light has."""
        return tuple(self.settings.values())

    def uv(self, light: bpy.types.Light, inverse: np.ndarray) -> Node | None:
        """The node that makes its UV; None where that is not modeled. inverse : (4, 4), the world's space to the light's."""
        raise NotImplementedError


class _Sun(_Kind):
    lamp, size, settings = Sun, "angle", {"angle": "angle"}

    def values(self, light: bpy.types.Light, matrix: np.ndarray, strength: RGB) -> dict[str, Any]:
        return {"irradiance": strength, "towards": tuple(matrix[:3, 2]), "angle": light.angle}

    def is_flat(self, light: bpy.types.Light, matrix: np.ndarray) -> bool:
        return not matrix[:3, 2].any()

    def area(self, light: bpy.types.Light, matrix: np.ndarray) -> float:
        return math.pi * math.sin(light.angle / 2) ** 2 if light.angle > 0 else 1.0

    def uv(self, light: bpy.types.Light, inverse: np.ndarray) -> Node | None:
        return None


class _Point(_Kind):
    lamp, settings = Point, {"radius": "shadow_soft_size", "soft_falloff": "use_soft_falloff"}

    def values(self, light: bpy.types.Light, matrix: np.ndarray, strength: RGB) -> dict[str, Any]:
        values = super().values(light, matrix, strength)
        return values | {"position": tuple(values.pop("matrix")[:3, 3])}

    def uv(self, light: bpy.types.Light, inverse: np.ndarray) -> Node | None:
        """UV of a point lamp, around it."""
        x, y, z = _within(inverse, "normal")
        length = node("vector_math", operation="length", a=node("combine_xyz", x=x, y=y, z=z))
        across = _affine(node("math", operation="arctan2", a=x, b=y), -0.5 / math.pi, 0.5)
        down = node("math", operation="arccosine", a=node("math", operation="divide", a=z, b=length))
        return node("combine_xyz", x=across, y=_affine(down, -1.0 / math.pi, 1.0))


class _Spot(_Kind):
    lamp = Spot
    settings = _Point.settings | {"angle": "spot_size", "blend": "spot_blend"}

    def is_flat(self, light: bpy.types.Light, matrix: np.ndarray) -> bool:
        return not np.linalg.det(matrix[:3, :3])

    def settings_shown(self, light: bpy.types.Light) -> tuple[str, ...]:
        return (*super().settings_shown(light), "show_cone")

    def uv(self, light: bpy.types.Light, inverse: np.ndarray) -> Node | None:
        """UV of a spot, over its cone."""
        x, y, z = _within(inverse, "incoming")
        half = -0.5 / math.tan(light.spot_size / 2)
        across, along = (_affine(node("math", operation="divide", a=each, b=z), half, 0.5) for each in (x, y))
        return node("combine_xyz", x=across, y=along)


class _Area(_Kind):
    lamp, size, settings = Area, "size", {"spread": "spread"}

    def sides(self, light: bpy.types.Light) -> tuple[float, float]:
        return light.size, light.size if light.shape in ("SQUARE", "DISK") else light.size_y

    def values(self, light: bpy.types.Light, matrix: np.ndarray, strength: RGB) -> dict[str, Any]:
        shape = {"size": self.sides(light), "ellipse": light.shape in ("DISK", "ELLIPSE")}
        spread = light.spread if light.spread >= _LEAST_SPREAD else math.pi
        return super().values(light, matrix, strength) | shape | {"spread": spread}

    def area(self, light: bpy.types.Light, matrix: np.ndarray) -> float:
        across, along = np.linalg.norm(matrix[:3, :2], axis=0) * self.sides(light)
        return across * along * (math.pi / 4 if light.shape in ("DISK", "ELLIPSE") else 1.0)

    def is_flat(self, light: bpy.types.Light, matrix: np.ndarray) -> bool:
        return not matrix[:3, 2].any() and not light.cycles.is_portal and self.area(light, matrix) > 0

    def shear(self, light: bpy.types.Light, matrix: np.ndarray) -> float:
        if light.cycles.is_portal or not self.area(light, matrix) > 0:
            return 0.0
        lengths = np.linalg.norm(matrix[:3, :3], axis=0)
        axes = matrix[:3, :3] / np.where(lengths > 0, lengths, 1.0)
        cosines = axes.T @ axes
        return float(np.abs(cosines - np.diag(np.diag(cosines))).max())

    def exported(
        self, name: str, light: bpy.types.Light, matrix: np.ndarray, strength: RGB, common: dict[str, Any], ledger: Ledger
    ) -> Lamp | None:
        if light.cycles.is_portal:
            return None
        if not self.area(light, matrix) > 0:
            ledger.note(name, "exported", "has no size and gives no light")
            return None
        if light.spread < _LEAST_SPREAD:
            ledger.note(name, "approximated", f"has a spread of {math.degrees(light.spread):.2g}°, 180° on both sides")
            ledger.set_for_cycles(light.original, "spread", math.pi)
        return super().exported(name, light, matrix, strength, common, ledger)

    def settings_shown(self, light: bpy.types.Light) -> tuple[str, ...]:
        sides = ("size", "size_y") if light.shape in ("RECTANGLE", "ELLIPSE") else ("size",)
        return ("shape", *sides, *super().settings_shown(light))

    def uv(self, light: bpy.types.Light, inverse: np.ndarray) -> Node | None:
        """Over the whole of it."""
        position = node("geometry")
        across, along = (
            node("math", operation="add", a=shaders.dot(position, row[:3] / (side or 1.0)), b=row[3] / (side or 1.0) + 0.5)
            for row, side in zip(inverse, self.sides(light), strict=False)
        )
        return node("combine_xyz", x=across, y=along)


KINDS: dict[str, _Kind] = {kind.lamp.kind.upper(): kind for kind in (_Sun(), _Point(), _Spot(), _Area())}
"""Blender's type of a light → what it is to the tracer."""


def light_of(sun: Sun, overrides: Overrides) -> tuple[bpy.types.Light, np.ndarray]:
    """The light that a sun is in Blender until the overrides end, and the (4, 4) matrix that it stands by."""
    data = bpy.data.lights.new(sun.name, "SUN")
    overrides.afterwards(bpy.data.batch_remove, [data])
    data.energy, data.angle = max(sun.irradiance), sun.angle
    data.color = tuple(value / data.energy for value in sun.irradiance)
    u, v, _ = Pinhole(sun.towards, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, 1, 1).basis()
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([u, v, sun.towards])
    return data, matrix


def _within(inverse: np.ndarray, output: str) -> Iterator[Node]:
    """The components of a direction of the geometry's in a light's space."""
    way = node("geometry", output=output)
    return (shaders.dot(way, row[:3]) for row in inverse[:3])


def _affine(value: Node, scale: float, plus: float) -> Node:
    return node("math", operation="multiply_add", a=value, b=scale, c=plus)


def lamps_in(
    depsgraph: bpy.types.Depsgraph, bounces: Bounces, ledger: Ledger, pictures: dict[str, Picture] | None = None
) -> tuple[Lamp, ...]:
    """The lamps that a render of this depsgraph shows, and their remedies for Cycles.

    pictures : receives the images of their nodes.

    A light that is sheared or flat in one place is off in all of its places.
    """
    links = linking.Links(depsgraph)
    lamps: list[tuple[bpy.types.Object, Lamp]] = []
    off: set[bpy.types.Object] = set()
    for instance in depsgraph.object_instances:
        if instance.object.type == "LIGHT" and instance.show_self:
            placed = features.placed_by(instance)
            name, light, block = placed.name, placed.evaluated.data, placed.real.original
            ledger.note(name, "exported", "a light")
            hidden_from = features.hidden_from(placed, depsgraph.view_layer_eval) - {"shadow"}
            matrix = np.array(instance.matrix_world, dtype=np.float64)
            _note(name, light, bounces, ledger)
            factor, emission, reading = _emission(name, light, matrix, ledger)
            strength = _strength(name, light, factor, ledger)
            if strength is None or not any(strength):
                continue
            kind = KINDS[light.type]
            shear = kind.shear(light, matrix)
            is_flat = kind.is_flat(light, matrix) or (emission is not None and not np.linalg.det(matrix[:3, :3]))
            if is_flat or shear > _LARGE_SHEAR:
                ledger.note(name, "skipped", f"{_FLAT if is_flat else _SHEARED}: off on both sides")
                for ray in (*RAYS[:-1], "volume_scatter"):
                    ledger.set_for_cycles(block, f"visible_{ray}", False)
                off.add(block)
                continue
            if shear > _SHEAR:
                ledger.note(name, "approximated", _SHEARED)
            common = {"hidden_from": hidden_from, "casts_shadow": light.use_shadow}
            common["multiple_importance"] = light.cycles.use_multiple_importance_sampling
            lamp = kind.exported(name, light, matrix, strength, common, ledger)
            if lamp is not None:
                receivers, blockers = links.of(placed, ledger, lamp.is_sized and lamp.multiple_importance)
                if pictures is not None and reading:
                    shading.add_pictures(reading, reading.alphas, pictures)
                lamps.append((block, replace(lamp, receivers=receivers, blockers=blockers, emission=emission)))
    return tuple(lamp for block, lamp in lamps if block not in off)


def _strength(name: str, light: bpy.types.Light, emission: RGB, ledger: Ledger) -> RGB | None:
    """Energy, color, exposure and what nodes make of them everywhere, or None where light can have no such."""
    factor = light.energy * 2.0 ** getattr(light, "exposure", 0.0)
    strength = _times(tuple(light.color), factor)
    if getattr(light, "use_temperature", False):
        strength = _product(strength, light.temperature_color)
    strength = _product(strength, emission)
    possible = shaders.possible(strength)
    if possible is None:
        ledger.note(name, "skipped", f"a light of the strength {', '.join(f'{value:g}' for value in strength)}")
        ledger.set_for_cycles(light.original, "energy", 0.0)
    return possible


def _emission(
    name: str, light: bpy.types.Light, matrix: np.ndarray, ledger: Ledger
) -> tuple[RGB, Node | None, shaders.Reading | None]:
    """The factor that a light's nodes are everywhere, or the node that makes it, with what that asks for."""
    tree = versions.light_tree(light)
    if not tree:
        return _WHITE, None, None
    output = tree.get_output_node("CYCLES")
    if not output:
        return _BLACK, None, None
    if not np.linalg.det(matrix[:3, :3]):  # then only what is the same everywhere counts
        matrix = np.eye(4)
    nodes.leave_out_circles(tree, ledger, name, "has")
    for missing in images.missing(tree):
        ledger.note(name, "exported", missing)
    emission, reading = _emitted(light, matrix, output, KINDS[light.type].uv)
    if reading.reasons:
        ledger.note(name, "approximated", f"{'; '.join(reading.reasons)}: plain light stands in")
        ledger.call_for_cycles(light.original, _make_plain)
        return _WHITE, None, None
    return (_WHITE, emission, reading) if isinstance(emission, Node) else (emission, None, None)


def _make_plain(overrides: Overrides, light: bpy.types.Light) -> None:
    output, adder = nodes.override_output(overrides, light.node_tree, "ShaderNodeOutputLight")
    adder.link(adder.add("ShaderNodeEmission", Strength=1.0).outputs[0], output.inputs["Surface"])


def _note(name: str, light: bpy.types.Light, bounces: Bounces, ledger: Ledger) -> None:
    """Note what else Cycles does to a light, which both sides leave out."""
    settings = light.original.cycles
    if (
        not light.use_shadow and settings.use_multiple_importance_sampling and getattr(light, KINDS[light.type].size) > 0
    ):  # then Cycles shows a part of its light behind what would block it
        ledger.note(name, "approximated", "casts no shadow although it has a size: Cycles shows less of it in the shadows")
    if light.cycles.max_bounces < bounces.total:
        ledger.note(name, "approximated", "its bounces are limited, and are not on both sides")
        ledger.set_for_cycles(settings, "max_bounces", 1024)
    ledger.set_for_cycles(settings, "is_caustics_light", False, stands_in=False)


def _product(first: RGB, second: RGB) -> RGB:
    red, green, blue = (a * b for a, b in zip(first, second, strict=True))
    return red, green, blue


def _not_below_zero(rgb: RGB) -> RGB:
    red, green, blue = (max(value, 0.0) for value in rgb)
    return red, green, blue


def _times(rgb: RGB, factor: float) -> RGB:
    red, green, blue = rgb
    return red * factor, green * factor, blue * factor


_BLACK = (0.0, 0.0, 0.0)
# Nodes that say something else of a light than of a surface, or nothing.
_OF_SURFACES = {
    *("ATTRIBUTE", "VERTEX_COLOR", "CAMERA", "TANGENT", "BUMP", "NORMAL_MAP", "OBJECT_INFO", "VECT_TRANSFORM", "WIREFRAME"),
}
_PLACES = {"Position", "Normal", "True Normal", "Incoming"}

UVMaker = Callable[[bpy.types.Light, np.ndarray], Node | None]


class _LampReader(shaders.Tree):
    """Follows the nodes of a light: the light that they make, at each place of it and in each direction.

    A lamp of the tracer has no space of its own: what Blender's nodes say in a light's is computed from places and directions
    of the world, as Cycles has them (shader_setup_from_sample, and the files of intern/cycles/kernel/light).

    matrix : (4, 4), the light's space to the world's.
    output : the node that the light is shown by.
    uv : a function that makes its UV.
    """

    def __init__(self, light: bpy.types.Light, matrix: np.ndarray, output: bpy.types.Node, uv: UVMaker) -> None:
        super().__init__(Color(_WHITE), divided=shaders.divided_images(output))
        self._light, self._matrix, self._uv = light, matrix, uv

    def emission(self, node_input: Input) -> RGB | Node:
        """The emission of the shaders: the same everywhere, or a node that makes it; if `reading` has no reasons then."""
        total: RGB | Node = _BLACK
        for closure in closures(self.surface(node_input)):
            if closure.node.type != "emission":
                self.reading.reasons.append("has nodes that scatter light")
                return _WHITE
            shone = _scaled(_color(closure.node["color"]), _number(closure.node["strength"]))
            for factor, rest in closure.factors:
                shone = _scaled(shone, _share(_number(factor), rest))
            total = shone if total == _BLACK else _sum(total, shone)
        return total if isinstance(total, Node) else _not_below_zero(total)

    def _image(self, output: Output) -> Color:
        self._reason(output, "is no color alone")  # its place is the light's to say
        return self.viewport

    def _value(self, output: Output) -> Color | Node | None:
        source, name = output.node, output.socket.name
        if source.type == "UVMAP" and source.uv_map:
            return Color(_BLACK)  # a light has no map by a name
        if source.type == "UVMAP" or (source.type, name) in (("TEX_COORD", "UV"), ("NEW_GEOMETRY", "Parametric")):
            return self._of_itself(output, UV)
        if source.type == "TEX_COORD" and name == "Normal":
            return self._turned(node("geometry", output="normal"))
        if source.type == "TEX_COORD" and (name == "Generated" or (name == "Object" and source.object is None)):
            return self._of_itself(output, GENERATED)
        unknown = source.type in _OF_SURFACES or (source.type == "TEX_COORD" and name != "Object")
        unknown |= source.type == "NEW_GEOMETRY" and name not in _PLACES
        unknown |= source.type == "LIGHT_PATH" and not (name.startswith("Is ") or name == "Ray Length")
        if unknown:
            self._reason(output, f"says the {name} of a light")
            return None
        return super()._value(output)

    def _falloff(self, output: Output) -> Color | Node | None:
        if self._light.type != "SUN":
            return super()._falloff(output)
        if output.socket.name != "Quadratic" and not versions.SUNS_HAVE_NO_FALLOFF:
            self._reason(output, "lets a sun grow with its distance")
            return None
        node_input = output.input("Strength")
        strength = node_input and self._value_input(node_input, 0.0)
        return None if strength is None else node("math", operation="add", a=strength, b=0.0)

    def _of_itself(self, output: Output, known: object) -> Node | None:
        if known is INCOMING:
            return self._turned(node("geometry", output="incoming"))
        if known is GENERATED:
            return shaders.in_space_of(self._matrix) if versions.LIGHTS_HAVE_SPACES else node("geometry")
        return self._uv_of(output) if known is UV else None

    def _turned(self, normal: Node) -> Node:
        """A normal in the light's space."""
        columns = (shaders.dot(normal, column) for column in self._matrix[:3, :3].T)
        return node("vector_math", operation="normalize", a=node("combine_xyz", **dict(zip("xyz", columns, strict=True))))

    def _uv_of(self, output: Output) -> Node | None:
        result = self._uv(self._light, np.linalg.inv(self._matrix))
        if result is None:
            self._reason(output, f"says the UV of a {self._light.type.lower()}")
        return result


def _emitted(
    light: bpy.types.Light, matrix: np.ndarray, output: bpy.types.Node, uv: UVMaker
) -> tuple[RGB | Node, shaders.Reading]:
    """The factor of its light that a light's output is shown, and what that asks for, or why there is none."""
    reader = _LampReader(light, matrix, output, uv)
    try:
        return reader.emission(Input(output.inputs["Surface"])), reader.reading
    except InputError as error:
        reader.reading.reasons.append(f"has nodes that are too much ({str(error).rpartition(': ')[0]})")
        return _WHITE, reader.reading


def _constant(value: Color | Node) -> tuple[RGB, float] | None:
    """The color that a value is everywhere, and its number; None where it varies."""
    if isinstance(value, Node):
        from ...tracer import native  # here: ctypes keeps its structures, and enabling the add-on needs none

        return native.constant_value(value)
    return value.rgb, value.rgb[0]


def _color(value: Color | Node) -> RGB | Node:
    if constant := _constant(value):
        return _not_below_zero(constant[0])
    assert isinstance(value, Node)  # a color is constant
    return value


def _number(value: Color | Node) -> float | Node:
    if constant := _constant(value):
        return constant[1]
    assert isinstance(value, Node)  # a color is constant
    return value


def _share(factor: float | Node, rest: bool) -> float | Node:
    """The share of a mixture, from 0 to 1; or what it leaves to the other side."""
    if not isinstance(factor, Node):
        share = min(max(factor, 0.0), 1.0)
        return 1.0 - share if rest else share
    return node("clamp", value=node("math", operation="subtract", a=1.0, b=factor) if rest else factor)


def _scaled(value: RGB | Node, by: float | Node) -> RGB | Node:
    if by == 1.0:
        return value
    if isinstance(value, Node) or isinstance(by, Node):
        return node("vector_math", operation="scale", a=value, scale=by)
    return _times(value, by)


def _sum(first: RGB | Node, second: RGB | Node) -> RGB | Node:
    if isinstance(first, Node) or isinstance(second, Node):
        return node("vector_math", operation="add", a=first, b=second)
    red, green, blue = (a + b for a, b in zip(first, second, strict=True))
    return red, green, blue
