"""Edit › Preferences › Add-ons › Virtual Pinhole: what an artist chooses once for all files.

Blender finds an add-on's preferences under the name of its package, which is the extension's: the parent of `viewcam_addon`.
Where the package is registered from Python, without an add-on of that name, there are none, and `get` gives their defaults.
"""

from dataclasses import dataclass

import bpy

from ..pinhole import Triple
from .render_settings import LEVELS

PACKAGE = __package__.rpartition(".viewcam_addon")[0] or __package__.partition(".")[0]

_AXES = {
    "X": (1.0, 0.0, 0.0),
    "Y": (0.0, 1.0, 0.0),
    "Z": (0.0, 0.0, 1.0),
    "-X": (-1.0, 0.0, 0.0),
    "-Y": (0.0, -1.0, 0.0),
    "-Z": (0.0, 0.0, -1.0),
}


@dataclass(frozen=True)
class Defaults:
    """The preferences as they are before anybody has changed them. Colors are sRGB, with opacity."""

    default_up: str = "Z"
    default_level: str = "GEOMETRY"
    plane_color: tuple[float, float, float, float] = (0.33, 0.68, 1.0, 0.12)
    line_color: tuple[float, float, float, float] = (0.33, 0.68, 1.0, 0.9)


_DEFAULTS = Defaults()


class VIEWCAM_preferences(bpy.types.AddonPreferences):
    bl_idname = PACKAGE

    default_up: bpy.props.EnumProperty(
        name="Default Up",
        description="Up of new cameras where it gives the same picture, and of leveled ones. Roll is counted from it",
        items=[(name, name.replace("-", "−"), f"The world's {name.replace('-', '−')} axis") for name in _AXES],
        default=_DEFAULTS.default_up,
    )
    default_level: bpy.props.EnumProperty(
        name="Default Level",
        description="How much of the scene is modeled when it is compared with Cycles, unless it is said there",
        items=LEVELS,
        default=_DEFAULTS.default_level,
    )
    plane_color: bpy.props.FloatVectorProperty(
        name="View Plane Color",
        description="Color of the view plane in the 3D viewport",
        subtype="COLOR_GAMMA",
        size=4,
        min=0.0,
        max=1.0,
        default=_DEFAULTS.plane_color,
    )
    line_color: bpy.props.FloatVectorProperty(
        name="Line Color",
        description="Color of the view plane's pixels, the pyramid and the line to the look-at point. "
        "The axes have the theme's colors",
        subtype="COLOR_GAMMA",
        size=4,
        min=0.0,
        max=1.0,
        default=_DEFAULTS.line_color,
    )

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        for names in (("default_up", "default_level"), ("plane_color", "line_color")):
            column = layout.column()
            for name in names:
                column.prop(self, name)


def get() -> VIEWCAM_preferences | Defaults:
    """The preferences, or their defaults where Blender keeps none."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    return addon.preferences if addon and addon.preferences else _DEFAULTS


def up_axis() -> Triple:
    """The preferred up, a unit vector in world space."""
    return _AXES[get().default_up]


CLASSES = (VIEWCAM_preferences,)
