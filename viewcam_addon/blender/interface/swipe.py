"""*Swipe* in the 3D viewport: the reference over what the viewport's own engine shows, left of a line that is dragged.

live_view.py reads the scene and traces it in the view's own camera, while Blender draws the rest and every tool goes on; here
a modal operator with a timer tells it of view and scene, takes the line, and ends it at Escape. Nothing of it is in the file.

The picture is shown as the scene displays it, by a table of its view transform, on the graphics card: what is drawn over a
viewport is composed after the view transform. Rejected: an image that Blender transforms, each change of which would make the
viewport's own engine begin anew.
"""

import functools
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...errors import InputError
from .. import datablocks
from ..rendering.live_view import LiveView
from ..rendering.picture_files import displayed
from . import proof_image, viewport
from .operators import possible

_SECONDS = 1 / 30  # between two looks at view and scene
_NEAR = 8  # points from the line at which the mouse takes it
_MARGIN = 10  # points around the words
# The table of the view transform: so many numbers of each channel, 0 and up to 2^6, nearly in equal steps of their logarithm
# above 2^−12, with 1 among them, where plain transforms have their edge. A step is 0.38 stops: between two of them a curve of
# exponent 1/2.2 is off by less than half of 1/255.
_COLORS, _STOPS, _LOWEST = 49, 18.0, -12.0

_FRAGMENT = """
vec3 displayed(ivec3 at) { return texelFetch(shades, ivec2(at.g * COLORS + at.r, at.b), 0).rgb; }
void main() {
    vec4 here = texelFetch(light, ivec2(gl_FragCoord.xy), 0);
    vec3 straight = here.a > 0.0 ? here.rgb / here.a : vec3(0.0);
    vec3 at = clamp(log2(max(straight, 0.0) / LOWEST + 1.0) / STOPS, 0.0, 1.0) * float(COLORS - 1);
    ivec3 low = min(ivec3(at), COLORS - 2);
    vec3 share = at - vec3(low), sum = vec3(0.0);
    for (int corner = 0; corner < 8; corner++) {
        ivec3 up = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
        vec3 weight = mix(1.0 - share, share, vec3(up));
        sum += weight.r * weight.g * weight.b * displayed(low + up);
    }
    color = vec4(sum, here.a);
}
"""


class _Swipe:
    """A swipe over one viewport.

    at : the line's place, from 0 at the left to 1.
    is_held : true while it is dragged.
    """

    def __init__(self, area: bpy.types.Area, scene: bpy.types.Scene) -> None:
        self.area, self.region = area, [region for region in area.regions if region.type == "WINDOW"][-1]
        self.live, self.at, self.is_held, self.message = LiveView(), 0.5, False, ""
        self._shades = shades(scene)
        self._view_transform = _view_transform(scene)
        self._drawn: tuple | None = None  # the picture that is on the graphics card, and where
        self._words = ""  # shown over it

    def is_open(self) -> bool:
        """True while the viewport is there."""
        areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas]
        return self.area in areas and self.area.type == "VIEW_3D"

    def line(self) -> float:
        """The line's place in the region, pixels from the left."""
        return round(self.at * self.region.width)

    def is_near(self, event: bpy.types.Event, scale: float) -> bool:
        x, y = event.mouse_x - self.region.x, event.mouse_y - self.region.y
        return abs(x - self.line()) <= _NEAR * scale and 0 <= y < self.region.height

    def drag(self, event: bpy.types.Event) -> None:
        self.at = min(max((event.mouse_x - self.region.x) / self.region.width, 0.0), 1.0)
        self.area.tag_redraw()

    def follow(self, context: bpy.types.Context) -> None:
        """Trace what the viewport shows by now."""
        space, depsgraph = self.area.spaces.active, context.evaluated_depsgraph_get()
        try:
            self.live.follow(depsgraph, self.region, space.region_3d, (space.clip_start, space.clip_end))
            message = ""
        except InputError as error:
            message = datablocks.sentence(error)
        if message != self.message:
            self.message = message
            self.area.tag_redraw()
        if self._view_transform != (now := _view_transform(context.scene)):
            self._view_transform, self._shades, self._drawn = now, shades(context.scene), None

    def take_picture(self) -> None:
        """Bring the latest picture to the graphics card, between two drawings: within one, the rest of it would be lost."""
        live, before = self.live, (self._drawn, self._words)
        live.drawn = live.number  # before the picture, which may change meanwhile
        picture, self._words = live.picture, live.words()
        if picture is not None and (self._drawn is None or self._drawn[0] is not picture):
            self._drawn = picture, _on_the_graphics_card(picture, self._shades)
        if self._drawn is not before[0] or self._words != before[1]:
            self.area.tag_redraw()

    def draw(self) -> None:
        """The picture left of the line, the line, and the two names, in the context's region."""
        context, line = bpy.context, self.line()
        scale, height = context.preferences.system.ui_scale, self.region.height
        if self._drawn and not self.message:
            self._draw_picture(self._drawn[1], line, height)
        proof_image.fill(line - scale, 0, 2 * scale, height, (0.0, 0.0, 0.0, 0.6))
        proof_image.fill(line - scale / 2, 0, scale, height, (1.0, 1.0, 1.0, 0.9))
        words = f"Reference: {self.message or self._words}"
        y = _MARGIN * scale
        proof_image.write(words, line - _MARGIN * scale, y, scale, before=True)
        proof_image.write(_name(context), line + _MARGIN * scale, y, scale)

    def _draw_picture(self, buffer: Any, line: float, height: float) -> None:
        import gpu
        from gpu_extras.batch import batch_for_shader

        # The viewport's picture must not be seen where the reference shows nothing.
        gradients = bpy.context.preferences.themes[0].view_3d.space.gradients
        proof_image.fill(0, 0, line, height, (*gradients.high_gradient, 1.0))
        across = line / self.region.width
        shader = gpu.shader.from_builtin("IMAGE")
        corners = [(0, 0), (line, 0), (line, height), (0, height)]
        batch = batch_for_shader(shader, "TRI_FAN", {"pos": corners, "texCoord": [(0, 0), (across, 0), (across, 1), (0, 1)]})
        shader.uniform_sampler("image", buffer.texture_color)
        gpu.state.blend_set("ALPHA")
        batch.draw(shader)
        gpu.state.blend_set("NONE")


def shades(scene: bpy.types.Scene) -> np.ndarray:
    """The table of a scene's view transform, (blue, green · red, 4) float32."""
    number = np.arange(_COLORS)
    light = 2.0**_LOWEST * (2.0 ** (_STOPS * number / (_COLORS - 1)) - 1)
    blue, green, red = np.meshgrid(light, light, light, indexing="ij")
    colors = np.stack([red, green, blue], axis=-1).astype(np.float32)
    return displayed(scene, colors.reshape(_COLORS, _COLORS**2, 3))


def _view_transform(scene: bpy.types.Scene) -> tuple:
    """All that a scene's view transform depends on but the points of its curves."""
    view = scene.view_settings
    names = ("view_transform", "look", "exposure", "gamma", "use_curve_mapping")
    return (scene.display_settings.display_device, *(getattr(view, name) for name in names))


@functools.cache
def _shader() -> Any:
    import gpu

    info = gpu.types.GPUShaderCreateInfo()
    info.define("COLORS", str(_COLORS))
    info.define("STOPS", str(_STOPS))
    info.define("LOWEST", str(2.0**_LOWEST))
    info.vertex_in(0, "VEC2", "pos")
    info.sampler(0, "FLOAT_2D", "light")
    info.sampler(1, "FLOAT_2D", "shades")
    info.fragment_out(0, "VEC4", "color")
    info.vertex_source("void main() { gl_Position = vec4(pos, 0.0, 1.0); }")
    info.fragment_source(_FRAGMENT)
    return gpu.shader.create_from_info(info)


def _on_the_graphics_card(picture: np.ndarray, table: np.ndarray) -> Any:
    """A picture of light, as it is displayed: (height, width, 4) → an off-screen buffer."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    def texture(values: np.ndarray) -> object:
        height, width, _ = values.shape
        pixels = gpu.types.Buffer("FLOAT", values.size, values.ravel())
        return gpu.types.GPUTexture((width, height), format="RGBA16F", data=pixels)

    height, width, _ = picture.shape
    target, shader = gpu.types.GPUOffScreen(width, height, format="RGBA8"), _shader()
    batch = batch_for_shader(shader, "TRI_FAN", {"pos": [(-1, -1), (1, -1), (1, 1), (-1, 1)]})
    with target.bind():
        gpu.state.blend_set("NONE")
        textures = {"light": texture(picture), "shades": texture(table)}  # which must live until it is drawn
        for name, each in textures.items():
            shader.uniform_sampler(name, each)
        batch.draw(shader)
    return target


def _name(context: bpy.types.Context) -> str:
    """The name of what draws the viewport."""
    shading, settings = context.space_data.shading, context.scene.render
    if shading.type != "RENDERED":
        return shading.bl_rna.properties["type"].enum_items[shading.type].name
    if item := settings.bl_rna.properties["engine"].enum_items.get(settings.engine):
        return item.name
    own = settings.engine.removeprefix("BLENDER_").capitalize()  # Workbench, which nothing names
    classes = bpy.types.RenderEngine.__subclasses__()  # add-ons' classes; one, Blender's base of Hydra's, has no bl_idname
    return next((each.bl_label for each in classes if getattr(each, "bl_idname", "") == settings.engine), own)


_running: _Swipe | None = None
_handler = None


def _begin(area: bpy.types.Area, scene: bpy.types.Scene) -> _Swipe:
    global _running, _handler
    _running = _Swipe(area, scene)
    _handler = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_PIXEL")
    for handlers in (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post):
        handlers.append(_on_change)
    area.tag_redraw()
    return _running


def _end() -> None:
    global _running, _handler
    if _running is None:
        return
    for handlers in (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post):
        handlers.remove(_on_change)
    bpy.types.SpaceView3D.draw_handler_remove(_handler, "WINDOW")
    _running.live.close()
    if _running.is_open():
        _running.area.tag_redraw()
    _running = _handler = None


def _draw() -> None:
    if _running and bpy.context.area == _running.area and bpy.context.region == _running.region:
        _running.draw()


@persistent
def _on_change(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if _running:
        _running.live.scene_changed(depsgraph)


class VIEWCAM_OT_swipe_reference(bpy.types.Operator):
    bl_idname = "viewcam.swipe_reference"
    bl_label = "Swipe in Viewport"
    bl_description = (
        "Show what the reference tracer makes of this view, over what the viewport shows, left of a line that can be dragged. "
        "Escape or this button ends it"
    )
    bl_options: ClassVar[set[str]] = set()

    _timer: bpy.types.Timer | None = None
    _swipe: _Swipe

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        has_viewport = not bpy.app.background and context.window and viewport.area_in(context)
        return possible(cls, has_viewport, "There is no 3D viewport")

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if _running:
            _end()
            return {"FINISHED"}
        self._swipe = _begin(viewport.area_in(context), context.scene)
        self._timer = context.window_manager.event_timer_add(_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        swipe = self._swipe
        if swipe is not _running or not swipe.is_open():
            return self._leave(context)
        if event.type == "TIMER":
            swipe.follow(context)
            swipe.take_picture()
        elif event.type == "ESC" and event.value == "PRESS" and not context.screen.is_animation_playing:
            return self._leave(context)
        elif event.type == "LEFTMOUSE" and event.value == "PRESS":
            swipe.is_held = swipe.is_near(event, context.preferences.system.ui_scale)
            if swipe.is_held:
                return {"RUNNING_MODAL"}
        elif swipe.is_held:
            swipe.drag(event)
            swipe.is_held = event.type != "LEFTMOUSE"
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender closes the window or the file."""
        self._leave(context)

    def _leave(self, context: bpy.types.Context) -> set[str]:
        context.window_manager.event_timer_remove(self._timer)
        if self._swipe is _running:
            _end()
        return {"CANCELLED"}


def draw_button(layout: bpy.types.UILayout) -> None:
    """The button that begins a swipe, or ends it."""
    if _running:
        layout.operator("viewcam.swipe_reference", text="End Swipe", icon="X", depress=True)
    else:
        layout.operator("viewcam.swipe_reference", icon="UV_SYNC_SELECT")


CLASSES = (VIEWCAM_OT_swipe_reference,)


def unregister() -> None:
    _end()
    _shader.cache_clear()
