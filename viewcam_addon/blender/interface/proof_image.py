"""The image of a comparison, and the Image Editor that shows it: Cycles, the tracer and what differs, side by side or swiped.

Where not all that is in the picture is modeled, both sides show stand-ins and say so, and the artist's own picture is beside
them. Light is as the scene's view transform displays it (rendering/picture_files.py), and geometry shaded from its passes.

It is one datablock of its own, packed: a file that is saved while an editor shows it keeps it, and names no folder that ends
with Blender. Names and the legend of the colors are drawn over it, in the editor's own pixels, and are no part of it.
Rejected: turning an area of the artist's layout into an Image Editor, and `render.view_show`, which makes a Render Result.
"""

import functools
from collections.abc import Collection, Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from ...comparison import pictures
from ...comparison.statistics import plain
from ..rendering.picture_files import stored
from .comparing import Outcome

NAME = "Virtual Pinhole Proof"
VIEWS = (
    ("ALL", "Side by Side", "All pictures: Cycles, the tracer and what differs"),
    ("SWIPE", "Swipe", "Cycles on the left and the tracer on the right of a line that can be moved"),
    ("CYCLES", "Cycles", "What Cycles renders"),
    ("TRACER", "Tracer", "What the reference tracer renders"),
    ("DIFFERENCE", "Difference", "What differs, pixel by pixel"),
    ("EVERYTHING", "Everything", "The scene as Cycles renders it with everything in it, without any stand-in"),
)
_SIDES = {"everything": "Cycles, everything", "cycles": "Cycles", "tracer": "Tracer", "difference": "Difference"}
"""The name of each picture, in the order in which they stand."""
_DIFFERENCE = _SIDES["difference"]
_GAP = 8  # pixels between two pictures
_MARGIN, _LETTERS, _STRIP = 10, 12, (240, 12)  # points: around a label, its size, and the legend's strip

_SECONDS = 0.3  # from a picture to its packing, and from a new editor to its size
_BELOW = 64  # points below the picture, for the legend

_handlers: list[object] = []
_loaded: Outcome | None = None


def composed(sides: Mapping[str, NDArray[np.float32]], view: str, swipe: float = 0.5) -> NDArray[np.float32]:
    """The picture of a view.

    sides : "cycles", "tracer", "difference" and, where there is more, "everything", (height, width, 4) of one size.
    view : one of VIEWS.
    swipe : the place of the line, from 0 at the left to 1.
    """
    picture = _pictures_in(view, sides)
    if view == "SWIPE":
        at = round(swipe * sides["cycles"].shape[1])
        return np.hstack([sides[picture[0]][:, :at], sides[picture[1]][:, at:]])
    gap = np.zeros((len(sides["cycles"]), _GAP, 4), np.float32)
    return np.hstack([part for name in picture for part in (gap, sides[name])][1:])


def _pictures_in(view: str, sides: Collection[str]) -> list[str]:
    """The pictures of a view, of those that there are."""
    if view == "ALL":
        return [name for name in _SIDES if name in sides]
    if view == "SWIPE":
        return ["cycles", "tracer"]
    return [view.lower() if view.lower() in sides else "cycles"]  # where all is modeled, Cycles' picture has everything


def labels(view: str, sides: Collection[str]) -> list[str]:
    """The names of the pictures of a view, from left to right."""
    stand_ins = " with stand-ins" if "everything" in sides else ""
    return [_SIDES[name] + (stand_ins if name in ("cycles", "tracer") else "") for name in _pictures_in(view, sides)]


def begins(number: int, count: int, width: int) -> float:
    """The beginning of one of several pictures side by side, from 0 to 1.

    width : the width of all together, pixels.
    """
    return number * (width + _GAP) / (count * width)


def load(outcome: Outcome, view: str = "ALL", swipe: float = 0.5) -> bpy.types.Image:
    """The image of a comparison: one datablock, packed, whose content is that view of the outcome."""
    global _loaded
    sides = {name: _pixels(path) for name, path in outcome.pictures.items()}
    height, width = (min(side.shape[axis] for side in sides.values()) for axis in (0, 1))
    # Where pictures are wider than a screen, what differs is made smaller by another rule, and may have a pixel less.
    picture = composed({name: side[-height:, :width] for name, side in sides.items()}, view, swipe)
    image = loaded() or bpy.data.images.new(NAME, 1, 1)
    if image.packed_file:
        image.unpack(method="REMOVE")
    if image.source != "GENERATED":
        image.source = "GENERATED"
    image.scale(picture.shape[1], picture.shape[0])
    image.pixels.foreach_set(picture.ravel())
    image.update()
    _loaded = outcome
    if bpy.app.background:
        _pack()
    elif not bpy.app.timers.is_registered(_pack):  # a swipe asks for many pictures, and keeps the last
        bpy.app.timers.register(_pack, first_interval=_SECONDS)
    return image


def _pack() -> None:
    image = loaded()
    if image and image.is_dirty:
        image.pack()


def loaded() -> bpy.types.Image | None:
    """The image, if it has been shown."""
    return bpy.data.images.get((NAME, None))


def show(outcome: Outcome, context: bpy.types.Context, anyway: bool = False) -> None:
    """Show the comparison in an Image Editor that is open and free for it, else in a new window.

    anyway : open one even where Blender's preferences say that a render opens none.
    """
    if not outcome.pictures:
        return
    settings = context.window_manager.virtual_pinhole_proof
    image = load(outcome, settings.view, settings.swipe)
    if bpy.app.background:
        return
    space = _free_image_editor(context.window_manager)
    if space is None and (anyway or context.preferences.view.render_display_type != "NONE"):
        space = _new_image_editor(context)
    if space:
        space.image = image
        fit()


def fit() -> None:
    """Zoom the Image Editors that show it to all of the picture, once those that are new have their size."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_fit):
        bpy.app.timers.register(_fit, first_interval=_SECONDS)


def _fit() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR" and _is_shown_in(area.spaces.active):
                part = next(part for part in area.regions if part.type == "WINDOW")
                with bpy.context.temp_override(window=window, area=area, region=part):
                    bpy.ops.image.view_all(fit_view=True)
                    margin = 2 * _BELOW * bpy.context.preferences.system.ui_scale / part.height
                    area.spaces.active.zoom_percentage *= max(0.5, 1 - margin)


_pixels = functools.lru_cache(maxsize=4)(stored)


def _free_image_editor(manager: bpy.types.WindowManager) -> bpy.types.SpaceImageEditor | None:
    """An Image Editor that shows the comparison already, else one that shows nothing and is neither pinned nor painted in."""
    areas = [area for window in manager.windows for area in window.screen.areas if area.ui_type == "IMAGE_EDITOR"]
    spaces = [area.spaces.active for area in areas]
    free = [space for space in spaces if not (space.image or space.use_image_pin) and space.mode == "VIEW"]
    return next((space for space in spaces if _is_shown_in(space)), free[0] if free else None)


def _is_shown_in(space: bpy.types.SpaceImageEditor) -> bool:
    return bool(space.image and space.image.name == NAME and not space.image.library)


def _new_image_editor(context: bpy.types.Context) -> bpy.types.SpaceImageEditor:
    windows = context.window_manager.windows
    with context.temp_override(window=context.window or windows[0]):
        bpy.ops.wm.window_new()
    area = windows[-1].screen.areas[0]
    area.ui_type = "IMAGE_EDITOR"
    return area.spaces.active


def _draw_header(header: bpy.types.Header, context: bpy.types.Context) -> None:
    if _is_shown_in(context.space_data):
        draw_view(header.layout.row(align=True), context)


def draw_view(row: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The choice of the view, and where the line is."""
    settings = context.window_manager.virtual_pinhole_proof
    row.prop(settings, "view", text="")
    if settings.view == "SWIPE":
        row.prop(settings, "swipe", text="", slider=True)


def _draw_labels() -> None:
    """Draw each picture's name, the line of the swipe, and the legend, in the pixels of the context's Image Editor."""
    context = bpy.context
    if _loaded is None or not _is_shown_in(context.space_data):
        return
    settings, scale = context.window_manager.virtual_pinhole_proof, context.preferences.system.ui_scale
    at, words = context.region.view2d.view_to_region, labels(settings.view, _loaded.pictures)
    swiped, width = settings.view == "SWIPE", context.space_data.image.size[0]
    for number, label in enumerate(words):
        x, y = at(number * settings.swipe if swiped else begins(number, len(words), width), 0.0, clip=False)
        write(label, x + _MARGIN * scale, y + _MARGIN * scale, scale)
        if label == _DIFFERENCE:
            _draw_legend(x + _MARGIN * scale, y - (2 * _MARGIN + 2 * _LETTERS) * scale, scale)
        elif swiped and number:
            fill(x - scale, y, 2 * scale, at(0.0, 1.0, clip=False)[1] - y, (1.0, 1.0, 1.0, 0.9))


def _draw_legend(x: float, y: float, scale: float) -> None:
    """The strip of the difference's colors, with the ends of its scale below."""
    legend = _loaded.scale if _loaded else {}
    if not legend:
        return
    colors = (pictures.signed_scale() if legend["kind"] == "signed" else pictures.color_scale()) / 255.0
    width, height = (size * scale for size in _STRIP)
    x = max(_MARGIN * scale, min(x, bpy.context.region.width - width - 2 * _MARGIN * scale))  # whole, where there is room
    for number, color in enumerate(colors):
        fill(x + width * number / len(colors), y, width / len(colors) + 1, height, (*color, 1.0))
    signed = legend["kind"] == "signed"
    low = f"−{plain(-legend['low'])}: tracer brighter" if signed else f"{plain(legend['low'])} {legend['unit']}"
    high = f"{plain(legend['high'])}: Cycles brighter" if signed else f"{plain(legend['high'])} {legend['unit']}"
    below = y - (_LETTERS + 4) * scale
    write(low, x, below, scale)
    write(high, x + width, below, scale, before=not signed)


def write(text: str, x: float, y: float, scale: float, before: bool = False) -> None:
    """A line of text that reads on any picture. before : end it there in place of beginning it."""
    import blf

    blf.size(0, _LETTERS * scale)
    width, height = blf.dimensions(0, text)
    x -= width if before else 0.0
    fill(x - 4 * scale, y - 4 * scale, width + 8 * scale, height + 8 * scale, (0.0, 0.0, 0.0, 0.6))
    blf.color(0, 1.0, 1.0, 1.0, 1.0)
    blf.position(0, x, y, 0)
    blf.draw(0, text)


def fill(x: float, y: float, width: float, height: float, color: tuple[float, ...]) -> None:
    """A rectangle in the pixels of what is drawn."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    corners = [(x, y), (x + width, y), (x, y + height), (x + width, y + height)]
    gpu.state.blend_set("ALPHA")
    shader.uniform_float("color", color)
    batch_for_shader(shader, "TRI_STRIP", {"pos": corners}).draw(shader)
    gpu.state.blend_set("NONE")


def register() -> None:
    bpy.types.IMAGE_HT_header.append(_draw_header)
    _handlers.append(bpy.types.SpaceImageEditor.draw_handler_add(_draw_labels, (), "WINDOW", "POST_PIXEL"))


def unregister() -> None:
    global _loaded
    _loaded = None
    _pixels.cache_clear()
    for later in (_pack, _fit):
        if bpy.app.timers.is_registered(later):
            bpy.app.timers.unregister(later)
    bpy.types.SpaceImageEditor.draw_handler_remove(_handlers.pop(), "WINDOW")
    bpy.types.IMAGE_HT_header.remove(_draw_header)
