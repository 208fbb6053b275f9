"""The materials of surfaces, as data: trees of shader nodes (shader_nodes.py).

What a hand writes most, a sum of components without any roughness, each with a color, is such a tree, too: `sum_of` makes it,
where a scene file is read. `simplified` finds the sums among trees: their closures are fewer, and without factors.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from ... import checks
from ...errors import InputError
from .colors import LARGEST_RADIANCE, WHITE, Color, Picture, radiance
from .shader_nodes import Closure, Node, closures, node

__all__ = ["LARGEST_RADIANCE", "PLAIN", "Color", "Material", "Picture", "radiance", "simplified", "sum_of"]

LEAST_IOR, MOST_IOR = 1e-3, 1e3


# Light by half vectors that no facet has is 1.4 % of what glass of this roughness lets through, and 16 % at 0.6 (measured under
# a sky that is white all around).
_VERY_ROUGH = 0.3


@dataclass(frozen=True)
class Material:
    """The light of a surface.

    surface : its shader, None where it gives no light at all.
    transparent_shadow : true if shadow rays go through it where it is transparent.
    displacement : a node that makes a height, world units, whose slope turns the normals; nothing moves.
    """

    surface: Node | None = None
    transparent_shadow: bool = True
    displacement: Node | None = None

    def __post_init__(self) -> None:
        truth = checks.truth("transparent_shadow of a material", self.transparent_shadow)
        object.__setattr__(self, "transparent_shadow", truth)
        if self.surface is not None and self.surface.is_value:
            raise InputError(f"the surface of a material is a node {self.surface.type!r}: give a shader")
        if self.displacement is not None and not self.displacement.is_value:
            raise InputError(
                f"the displacement of a material is a shader {self.displacement.type!r}: give a node that makes a height"
            )

    @property
    def closures(self) -> tuple[Closure, ...]:
        """The closures that the core adds up."""
        return tuple(closures(self.surface))

    @property
    def shines(self) -> bool:
        """True if it gives light."""
        return any(closure.node.is_shining for closure in self.closures)

    @property
    def refracts_very_roughly(self) -> bool:
        """True if it lets light through in directions that no facet refracts, as Cycles has it of a lamp's (microfacet.h)."""
        shaders = [closure.node for closure in self.closures if closure.node.is_rough_refraction]
        return any(node["roughness"].varies or max(node["roughness"].rgb) > _VERY_ROUGH for node in shaders)

    @property
    def inputs(self) -> tuple[tuple[str, Color], ...]:
        """The inputs of all colors and numbers, each with its name in sentences."""
        result = [("displacement", color) for color in self.displacement.colors] if self.displacement else []
        for closure in self.closures:
            kind = closure.node.type
            for name, value in (*closure.node.inputs, *(("a factor", factor) for factor, _ in closure.factors)):
                colors = value.colors if isinstance(value, Node) else [value] if isinstance(value, Color) else []
                result += [(f"{name} of {kind}", color) for color in colors]
        return tuple(result)

    @property
    def nodes(self) -> Iterator[Node]:
        """The nodes of its closures and its displacement, and all that feed them."""
        makers = [maker for each in self.closures for maker in (each.node, *(factor for factor, _ in each.factors))]
        makers.append(self.displacement)
        for maker in makers:
            if isinstance(maker, Node):
                yield from maker.all

    @property
    def follows_own_uv(self) -> bool:
        """True if tangents follow the mesh's own UV map, whatever its name."""
        needs = {("normal_map", "space", "tangent"), ("tangent", "kind", "uv_map")}
        return any(
            node.type == kind and node[name] == value and not node["uv"] for node in self.nodes for kind, name, value in needs
        )

    @property
    def attributes(self) -> set[str]:
        """The names of the attributes that its nodes ask meshes for."""
        return {name for node in self.nodes for name in node.attributes}


# In the order in which the core adds them up.
COMPONENTS = {"emission": "emission", "diffuse": "diffuse", "mirror": "glossy", "glass": "glass", "refraction": "refraction"}
"""Component → the type of its shader, which has no roughness."""


def sum_of(
    ior: float = 1.45, transparent_shadow: bool = True, displacement: Node | None = None, **components: Color
) -> Material:
    """The material whose light is the sum of components; without any it is black.

    ior : the index of refraction of glass and refraction, inside over outside.
    components : their colors, by the names in `COMPONENTS`.
    diffuse : albedo of a Lambert surface, both of its sides.
    emission : radiance, of both sides.
    mirror : reflectance of a perfect mirror.
    glass : color of what is reflected and refracted by a clear dielectric, shared out by Fresnel's equations.
    refraction : color of what is refracted, nothing being reflected.
    """
    ior = checks.number("ior of a material", ior, LEAST_IOR, MOST_IOR)
    surface: Node | None = None
    for name, kind in COMPONENTS.items():
        color = components.pop(name, None)
        if color is None or color.is_black:
            continue
        more = {} if name in ("emission", "diffuse") else {"roughness": 0.0, "distribution": "ggx"}
        shader = node(kind, color=color, **more, **({"ior": ior} if name in ("glass", "refraction") else {}))
        surface = shader if surface is None else node("add", first=surface, second=shader)
    if components:
        raise TypeError(f"a material has no component {', '.join(components)}")
    return Material(surface, transparent_shadow, displacement)


def simplified(shader: Node | None) -> Node | None:
    """The shader, or the sum of components that says the same, where there is one."""
    components = _components(shader)
    return shader if components is None else sum_of(**components).surface


def _components(shader: Node | None) -> dict[str, Any] | None:
    """The components that a tree of shaders is the sum of, as `sum_of` takes them; None where no components say the same."""
    if shader is None:
        return {}
    if shader.type not in ("mix", "add"):
        return _component(shader)
    factor = _constant(shader["factor"]) if shader.type == "mix" else None
    if factor is None and shader.type == "mix":
        return None
    total: dict[str, Any] | None = {}
    for name, weight in (("first", 1.0 if factor is None else 1.0 - factor), ("second", 1.0 if factor is None else factor)):
        part = _components(shader[name]) if weight else {}
        total = None if total is None or part is None else _sum(total, part, weight)
    return total


_SMOOTH = {"diffuse": "diffuse", "glossy": "mirror", "glass": "glass", "refraction": "refraction"}
_LAYERS = ("metallic", "diffuse_roughness", "transmission_weight", "coat_weight", "sheen_weight")


def _component(shader: Node) -> dict[str, Any] | None:
    result: dict[str, Any] = {}
    if shader.type == "emission":
        result = {"emission": _scaled(shader["color"], _constant(shader["strength"]))}
    elif shader.type in _SMOOTH and _constant(shader["roughness"]) == 0.0:
        result = {_SMOOTH[shader.type]: _scaled(shader["color"], 1.0)}
        if shader.type in ("glass", "refraction"):
            ior = _constant(shader["ior"])
            result["ior"] = ior if ior is not None and LEAST_IOR <= ior <= MOST_IOR else None
    elif shader.type == "principled" and _is_diffuse(shader):
        result = {"diffuse": _scaled(shader["base_color"], 1.0)}
        if not shader["emission_strength"].is_black:
            result["emission"] = _scaled(shader["emission_color"], _constant(shader["emission_strength"]))
    is_bent = any(name in ("normal", "coat_normal") for name, _ in shader.inputs)
    return None if is_bent or not result or None in result.values() else result


def _is_diffuse(principled: Node) -> bool:
    has_gloss = _constant(principled["ior"]) != 1.0 and not principled["specular_ior_level"].is_black
    return not has_gloss and _constant(principled["alpha"]) == 1.0 and all(principled[name].is_black for name in _LAYERS)


def _sum(total: dict[str, Any], added: dict[str, Any], weight: float) -> dict[str, Any] | None:
    result = dict(total)
    for name, value in added.items():
        before = result.get(name)
        scaled = value if name == "ior" else _scaled(value, weight)
        if name == "ior" or before is None or before.is_black:
            result[name] = scaled if name != "ior" or before in (None, value) else None
        elif scaled is not None and not scaled.is_black:
            is_alike = replace(before, rgb=WHITE) == replace(scaled, rgb=WHITE)
            rgb = tuple(a + b for a, b in zip(before.rgb, scaled.rgb, strict=True))
            result[name] = replace(before, rgb=rgb) if is_alike and max(rgb) <= LARGEST_RADIANCE else None
        if result[name] is None or scaled is None:
            return None
    return result


def _scaled(value: Color | Node, factor: float | None) -> Color | None:
    """None where light can't have that, or the core alone knows what it is."""
    if factor is None or isinstance(value, Node) or max(value.rgb) * factor > LARGEST_RADIANCE:
        return None
    red, green, blue = value.rgb
    return replace(value, rgb=(red * factor, green * factor, blue * factor))


def _constant(value: Color | Node) -> float | None:
    return None if isinstance(value, Node) or value.varies or len(set(value.rgb)) > 1 else value.rgb[0]


PLAIN_COLOR = Color((0.8, 0.8, 0.8))
PLAIN = sum_of(diffuse=PLAIN_COLOR)
"""The material of a surface that has none, in Blender as here."""
