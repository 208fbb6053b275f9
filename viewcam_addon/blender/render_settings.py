"""`scene.virtual_pinhole_reference`: how much the render engine "Virtual Pinhole Reference" models, and with how many samples.

What Cycles has a setting for (bounces, film, pixel filter), the engine takes from Cycles' own, so that both render the same.
"""

import bpy

from ..tracer.scene.film import SAMPLES

LEVELS = (
    ("AUTO", "Automatic", "The least level that the scene needs"),
    ("GEOMETRY", "Geometry", "Surfaces without materials and light, one sample, shown as a lamp at the eye would"),
    ("DIRECT", "Direct Light", "Light that comes straight from lamps, glowing surfaces and the world, with shadows"),
    ("PATH", "Light Paths", "Light that is scattered from surface to surface, mirrors and glass, up to the bounces' limits"),
)


def _update_passes(_group: "ReferenceSettings", context: bpy.types.Context) -> None:
    """Let the compositor's sockets follow the passes that were chosen."""
    context.view_layer.update_render_passes()


class ReferenceSettings(bpy.types.PropertyGroup):
    level: bpy.props.EnumProperty(name="Level", description="How much of the scene is modeled", items=LEVELS)
    samples: bpy.props.IntProperty(
        name="Samples",
        description="Paths of light through each pixel. With 1 it is the path through the pixel's center",
        default=SAMPLES,
        min=1,
        soft_max=4096,
    )
    seed: bpy.props.IntProperty(
        name="Seed", description="The same seed gives the same picture, another one another noise", min=0
    )
    clay: bpy.props.BoolProperty(name="Clay", description="All surfaces are of one gray, perfectly matt material")
    use_pass_variance: bpy.props.BoolProperty(
        name="Variance",
        description="The estimated variance of each pixel of Combined, which is a mean over its samples",
        update=_update_passes,
    )


def register() -> None:
    bpy.utils.register_class(ReferenceSettings)
    bpy.types.Scene.virtual_pinhole_reference = bpy.props.PointerProperty(type=ReferenceSettings)


def unregister() -> None:
    del bpy.types.Scene.virtual_pinhole_reference
    bpy.utils.unregister_class(ReferenceSettings)
