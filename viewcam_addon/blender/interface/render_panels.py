"""The panels of the render engine "Virtual Pinhole Reference", and those of Blender that it shares.

Blender shows a panel to the engines that its class names in COMPAT_ENGINES. Generic panels (output, color management, camera,
physics, ...) name BLENDER_RENDER and are shared, as other engines' add-ons do, and so are EEVEE's for the nodes of materials
and worlds. Where one shows what is not modeled (EEVEE's lamps) or would stand above ours (Simplify), ours takes its place.
Rejected: sharing Cycles' own panels, which ask their common base class for its engines and can be had only all together.
"""

import re
from collections.abc import Iterator
from typing import ClassVar

import bpy

from ...image import GEOMETRY_PASSES, LIGHT_PASSES, SETTINGS
from ..rendering.engine import VIEWCAM_RenderEngine

ENGINE = VIEWCAM_RenderEngine.bl_idname

_SHARED = ("EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface")
_NOT_SHARED = re.compile("freestyle|RENDER_PT_simplify|DATA_PT_(preview|light|spot)$")


class _Panel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = frozenset({ENGINE})
    layout: bpy.types.UILayout

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def column(self, **options: str | bool) -> bpy.types.UILayout:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout.column(**options)


class VIEWCAM_RENDER_PT_sampling(_Panel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw(self, context: bpy.types.Context) -> None:
        settings, column = context.scene.virtual_pinhole_reference, self.column()
        column.prop(settings, "level")
        sampled = column.column()
        sampled.active = settings.level != "GEOMETRY"
        for name in ("samples", "seed", "clay"):
            sampled.prop(settings, name)


class _CyclesSettingsPanel(_Panel):
    """A panel of Cycles' own, for what Cycles has a setting for."""

    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and hasattr(context.scene, "cycles")


class VIEWCAM_RENDER_PT_light_paths(_CyclesSettingsPanel, bpy.types.Panel):
    bl_label = "Light Paths"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column(align=True)
        column.active = context.scene.virtual_pinhole_reference.level in ("AUTO", "PATH")
        column.prop(context.scene.cycles, "max_bounces", text="Max Bounces Total")
        for name in ("diffuse", "glossy", "transmission"):
            column.prop(context.scene.cycles, f"{name}_bounces", text=name.title())


class VIEWCAM_RENDER_PT_film(_CyclesSettingsPanel, bpy.types.Panel):
    bl_label = "Film"

    def draw(self, context: bpy.types.Context) -> None:
        scene, column = context.scene, self.column()
        column.prop(scene.cycles, "film_exposure")
        column.prop(scene.render, "film_transparent", text="Transparent")
        column.prop(scene.cycles, "pixel_filter_type", text="Pixel Filter")
        if scene.cycles.pixel_filter_type != "BOX":
            column.prop(scene.cycles, "filter_width", text="Width")


class VIEWCAM_RENDER_PT_simplify(_Panel, bpy.types.Panel):
    bl_label = "Simplify"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "use_simplify", text="")

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        column.active = context.scene.render.use_simplify
        column.prop(context.scene.render, "simplify_subdivision_render", text="Max Subdivision")
        column.prop(context.scene.render, "simplify_child_particles_render", text="Max Child Particles")


class VIEWCAM_VIEWLAYER_PT_passes(_Panel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: bpy.types.Context) -> None:
        for heading, passes in (("Data", GEOMETRY_PASSES), ("Light", LIGHT_PASSES)):
            column = self.column(heading=heading)
            for name in filter(SETTINGS.get, passes):
                column.prop(context.view_layer, SETTINGS[name], text=name)
        column.prop(context.scene.virtual_pinhole_reference, "use_pass_variance")


class VIEWCAM_LIGHT_PT_light(_Panel, bpy.types.Panel):
    bl_label = "Light"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.light

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.row().prop(context.light, "type", expand=True)
        column = self.column()
        for name in lamp_settings(context.light):
            column.prop(context.light, name)


def lamp_settings(lamp: bpy.types.Light) -> Iterator[str]:
    """The settings that count in the picture; some versions know fewer of them."""
    yield "color"
    if hasattr(lamp, "use_temperature"):
        yield from ("use_temperature", "temperature") if lamp.use_temperature else ("use_temperature",)
    yield "energy"
    yield from (name for name in ("exposure", "normalize") if hasattr(lamp, name))
    from ..scenes.lamps import KINDS  # here, since Blender starts without

    yield from KINDS[lamp.type].settings_shown(lamp)
    yield "use_shadow"


class VIEWCAM_OBJECT_PT_ray_visibility(_Panel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        for ray in ("camera", "diffuse", "glossy", "transmission", "shadow"):
            column.prop(context.object, f"visible_{ray}", text=ray.title())


CLASSES = (
    VIEWCAM_RENDER_PT_sampling,
    VIEWCAM_RENDER_PT_light_paths,
    VIEWCAM_RENDER_PT_film,
    VIEWCAM_RENDER_PT_simplify,
    VIEWCAM_VIEWLAYER_PT_passes,
    VIEWCAM_LIGHT_PT_light,
    VIEWCAM_OBJECT_PT_ray_visibility,
)


def register() -> None:
    for each in _blenders_panels():
        each.COMPAT_ENGINES.add(ENGINE)


def unregister() -> None:
    for each in _blenders_panels():
        each.COMPAT_ENGINES.discard(ENGINE)


def _blenders_panels() -> Iterator[type[bpy.types.Panel]]:
    """The panels that are shared."""
    for each in bpy.types.Panel.__subclasses__():
        engines = vars(each).get("COMPAT_ENGINES", ())
        if each.__name__ in _SHARED or ("BLENDER_RENDER" in engines and not _NOT_SHARED.search(each.__name__)):
            yield each
