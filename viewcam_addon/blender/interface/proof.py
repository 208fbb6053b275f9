"""The sub-panel "Proof": Compare with Cycles in one click, while the artist works on.

comparing.py does the work; here a modal operator with a timer looks how far it is. What it came to belongs to this session of
Blender: nothing of it is in the file but, while an Image Editor shows it, its packed image. Escape (but not the one that ends
playback), Cancel, another file, turning the add-on off and leaving Blender end a comparison without a trace.
"""

import itertools
from pathlib import Path
from typing import Any

import bpy
import bpy.utils.previews
import numpy as np

from ...comparison.answer import DIFFERENT, SAME, SAME_BUT
from ...errors import InputError
from .. import datablocks, preferences
from ..render_settings import LEVELS
from . import panel_rows, proof_image, swipe
from .background import Background, Cancels, StartsForCamera
from .comparing import Outcome, RunningComparison
from .panel_rows import CameraPanel

_SIZE = 32
_THICK = 2.6
_WAVE = [(5.0 + 2.0 * i, 3.0 * float(np.sin(i * np.pi / 5.5))) for i in range(12)]
# The color of each answer, and its strokes: corners in pixels from the lower left.
_MARKS = {
    SAME: ((0.24, 0.78, 0.36), [[(5.0, 16.0), (12.5, 8.5), (27.0, 24.0)]]),
    SAME_BUT: ((0.95, 0.65, 0.15), [[(x, y + middle) for x, y in _WAVE] for middle in (11.0, 21.0)]),
    DIFFERENT: ((0.93, 0.30, 0.26), [[(7.0, 7.0), (25.0, 25.0)], [(7.0, 25.0), (25.0, 7.0)]]),
}

_previews = None


def mark(answer: str) -> int:
    """The number of an answer's icon, for `icon_value`: a tick, waves or a cross, in colors that Blender's icons lack."""
    global _previews
    if _previews is None:
        _previews = bpy.utils.previews.new()
    if answer not in _previews:
        preview = _previews.new(answer)
        preview.icon_size = _SIZE, _SIZE
        preview.icon_pixels_float.foreach_set(_drawn(*_MARKS[answer]).ravel())
    return _previews[answer].icon_id


def forget_marks() -> None:
    """Give them back to Blender."""
    global _previews
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
    _previews = None


def _drawn(color: tuple[float, float, float], strokes: list[list[tuple[float, float]]]) -> np.ndarray:
    """(size, size, 4) float32, with soft edges."""
    pixels = np.stack(np.meshgrid(np.arange(_SIZE), np.arange(_SIZE)), axis=-1) + 0.5
    distance = np.full((_SIZE, _SIZE), np.inf)
    for start, end in (pair for corners in strokes for pair in itertools.pairwise(corners)):
        along = np.subtract(end, start)
        share = np.clip((pixels - start) @ along / (along @ along), 0.0, 1.0)
        distance = np.minimum(distance, np.linalg.norm(pixels - start - share[..., None] * along, axis=-1))
    drawn = np.empty((_SIZE, _SIZE, 4), np.float32)
    drawn[..., 3] = np.clip(_THICK + 0.5 - distance, 0.0, 1.0)
    drawn[..., :3] = np.array(color) * drawn[..., 3:]  # as Blender has it where a picture is see-through
    return drawn


_SECONDS = 0.2  # between two looks
_MOST_LACKING = 4  # objects that the panel names
_NAMES = tuple(name for name, *_ in LEVELS)

_timer: bpy.types.Timer | None = None
background = Background(_SECONDS, lambda _: _redraw(bpy.context), Outcome.discard)
"""A `RunningComparison`, and its `Outcome`."""


def _stop_timer() -> None:
    global _timer
    if _timer:
        bpy.context.window_manager.event_timer_remove(_timer)
    _timer = None


def _on_swipe(settings: "ProofSettings", _context: bpy.types.Context) -> None:
    latest = background.latest
    if latest and latest.pictures and proof_image.loaded():
        proof_image.load(latest, settings.view, settings.swipe)


def _on_view(settings: "ProofSettings", context: bpy.types.Context) -> None:
    _on_swipe(settings, context)
    proof_image.fit()


class ProofSettings(bpy.types.PropertyGroup):
    """`window_manager.virtual_pinhole_proof`: how the next comparison is made."""

    chosen_level: bpy.props.StringProperty(options={"HIDDEN"})
    level: bpy.props.EnumProperty(
        name="Level",
        description="How much of the scene is compared",
        items=LEVELS,
        get=lambda group: _NAMES.index(group.chosen_level or preferences.get().default_level),
        set=lambda group, number: setattr(group, "chosen_level", _NAMES[number]),
    )
    find: bpy.props.EnumProperty(
        name="Find",
        description="How small a difference of the light is found. It takes as many samples as that needs, on both sides",
        items=(
            ("2%", "Quick", "A picture that is 2 % too bright or too dark is found in 99 of 100 cases"),
            ("0.5%", "Thorough", "A picture that is 0.5 % too bright or too dark is found in 99 of 100 cases; it takes longer"),
        ),
    )
    clay: bpy.props.BoolProperty(
        name="Clay", description="The same matte material on everything, on both sides: for scenes whose own are not modeled"
    )
    folder: bpy.props.StringProperty(
        name="Report",
        description="Where reports are kept, each in a folder named by file, camera, frame and time. "
        "Without it the report is there until another comparison or the end of Blender",
        subtype="DIR_PATH",
    )
    view: bpy.props.EnumProperty(name="View", description="What is shown", items=proof_image.VIEWS, update=_on_view)
    swipe: bpy.props.FloatProperty(
        name="Swipe",
        description="Where Cycles' picture ends and the tracer's begins",
        subtype="FACTOR",
        default=0.5,
        min=0.0,
        max=1.0,
        update=_on_swipe,
    )


class VIEWCAM_OT_compare_with_cycles(StartsForCamera, bpy.types.Operator):
    bl_idname = "viewcam.compare_with_cycles"
    bl_label = "Compare with Cycles"
    bl_description = (
        "Render the picture of this camera with Cycles and with the reference tracer, in the background, and tell how far they "
        "differ. The file stays as it is, and its unsaved edits count"
    )
    background, busy = background, "A comparison is on its way"

    _last_drawn = ("", 0)  # the step and the second that were drawn last

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if bpy.app.background:
            return self.execute(context)
        if not self._begins(context):
            return {"CANCELLED"}
        global _timer
        _timer = context.window_manager.event_timer_add(_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        _redraw(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC" and event.value == "PRESS" and not _is_playing(context):
            background.end(forget=False)
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        if background.running is None:
            self.report({"INFO"}, "The comparison is canceled")
            self._leave(context)
            return {"CANCELLED"}
        outcome = background.poll()
        if outcome is None:
            self._show(context)
            return {"PASS_THROUGH"}
        self._leave(context)
        return self._tells(outcome, context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender closes the window or the file."""
        background.end(forget=False)
        self._leave(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Compare and wait for the answer, as scripts want it."""
        if not self._begins(context):
            return {"CANCELLED"}
        return self._tells(background.wait(), context)

    def _begins(self, context: bpy.types.Context) -> bool:
        try:
            settings = context.window_manager.virtual_pinhole_proof
            folder = Path(bpy.path.abspath(settings.folder)) if settings.folder else None
            asked = settings.level.lower(), settings.find, settings.clay, folder
            background.running = RunningComparison(self.required_camera(context), context.scene, *asked)
        except InputError as error:
            self.report({"ERROR"}, datablocks.sentence(error))
            return False
        return True

    def _show(self, context: bpy.types.Context) -> None:
        """Draw what has changed since the last look."""
        step, second = background.running.progress()[1], int(background.running.seconds)
        if (step, second) != self._last_drawn:
            _redraw(context, status_bar=step != self._last_drawn[0])
        self._last_drawn = step, second

    def _leave(self, context: bpy.types.Context) -> None:
        _stop_timer()
        _redraw(context)

    def _tells(self, outcome: Outcome, context: bpy.types.Context) -> set[str]:
        if outcome.answer is None:
            self.report({"ERROR"}, outcome.verdict)
            return {"CANCELLED"}
        self.report({"INFO" if outcome.answer == SAME else "WARNING"}, outcome.verdict)
        if outcome.answer == DIFFERENT:
            proof_image.show(outcome, context)
        return {"FINISHED"}


class VIEWCAM_OT_cancel_comparison(Cancels, bpy.types.Operator):
    bl_idname = "viewcam.cancel_comparison"
    bl_description = "End the comparison with Cycles"
    background = background


class VIEWCAM_OT_show_difference(bpy.types.Operator):
    bl_idname = "viewcam.show_difference"
    bl_label = "Show"
    bl_description = "Show Cycles' picture, the tracer's and what differs, in an Image Editor"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return bool(background.latest and background.latest.pictures)

    def execute(self, context: bpy.types.Context) -> set[str]:
        proof_image.show(background.latest, context, anyway=True)
        return {"FINISHED"}


class VIEWCAM_OT_open_report(bpy.types.Operator):
    bl_idname = "viewcam.open_report"
    bl_label = "Open Report"
    bl_description = "Open the report of the comparison in the browser"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return bool(background.latest and background.latest.report)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        return bpy.ops.wm.url_open(url=background.latest.report.absolute().as_uri())


class _ProofPanel(CameraPanel):
    """The button and the last verdict, on show below the camera's values."""

    bl_label = "Proof"

    def draw(self, context: bpy.types.Context) -> None:
        camera_object: Any = datablocks.camera_in(context)
        if background.running:
            _draw_progress(self.layout)
        else:
            self.layout.operator("viewcam.compare_with_cycles", icon="PLAY").camera = camera_object.name
        swipe.draw_button(self.layout)
        if background.latest:
            column = self.layout.column()
            column.active = background.running is None
            _draw_outcome(column, background.latest, camera_object, context)
        header, body = self.layout.panel("viewcam_proof_settings", default_closed=True)
        header.label(text="Settings")
        if body:
            _draw_settings(body, context)


VIEWCAM_PT_data_proof, VIEWCAM_PT_sidebar_proof = panel_rows.in_both_places("proof", _ProofPanel)


def _draw_settings(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    panel_rows.begin(layout, context)
    settings, column = context.window_manager.virtual_pinhole_proof, layout.column()
    column.active = background.running is None
    panel_rows.field(column, settings, "level")
    if settings.level != "GEOMETRY":
        panel_rows.field(column, settings, "find")
        column.prop(settings, "clay")
    panel_rows.field(column, settings, "folder")


def _draw_progress(layout: bpy.types.UILayout, timed: bool = True) -> None:
    share, words = background.running.progress()
    row = layout.row(align=True)
    row.progress(factor=share, text=f"{words} ({background.running.seconds:.0f} s)" if timed else words)
    row.operator("viewcam.cancel_comparison", text="", icon="CANCEL")


def _draw_outcome(
    layout: bpy.types.UILayout, outcome: Outcome, camera_object: bpy.types.Object, context: bpy.types.Context
) -> None:
    lines = [(outcome.headline or outcome.verdict, mark(outcome.answer) if outcome.answer else "ERROR")]
    if outcome.answer == DIFFERENT:
        rest = outcome.verdict.partition(": ")[2]
        lines.append((rest[:1].upper() + rest[1:], "BLANK1"))
    column = layout.column(align=True)
    if camera_object.name != outcome.camera:
        lines.append((f"Of another camera: {outcome.what}", "INFO"))
    elif not outcome.is_of(camera_object, context.scene):
        lines.append((f"The camera has changed since: {outcome.what}", "INFO"))
    lines += [(f"{name}: {reason}", "INFO") for name, reason in outcome.lacking[:_MOST_LACKING]]
    more = len(outcome.lacking) - _MOST_LACKING
    lines += [(f"and {more} more, in the report", "BLANK1")] if more > 0 else []
    for sentence, icon in lines:
        panel_rows.sentence(column, context, sentence, icon)
    if outcome.report:
        row = panel_rows.buttons(layout, context)
        row.operator("viewcam.show_difference", icon="IMAGE_DATA")
        row.operator("viewcam.open_report", text="Report", icon="URL")
        if proof_image.loaded():
            proof_image.draw_view(layout.row(align=True), context)
    if outcome.rows:
        _draw_figures(layout, outcome, context)


def _draw_figures(layout: bpy.types.UILayout, outcome: Outcome, context: bpy.types.Context) -> None:
    header, body = layout.panel("viewcam_proof_figures", default_closed=True)
    header.label(text="Figures")
    if body is None:
        return
    column = body.column(align=True)
    for label, text in outcome.rows:
        panel_rows.described(column, context, label, (text,), share=0.46)
    panel_rows.sentence(column, context, outcome.colors)


def _is_playing(context: bpy.types.Context) -> bool:
    """True if some window plays: Escape is then for that."""
    return any(window.screen.is_animation_playing for window in context.window_manager.windows)


def _draw_status_bar(header: bpy.types.Header, _context: bpy.types.Context) -> None:
    if background.running:
        row = header.layout.row()
        row.ui_units_x = 14
        _draw_progress(row, timed=False)


def _draw_render_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.operator_context = "INVOKE_DEFAULT"
    menu.layout.operator("viewcam.compare_with_cycles")


def _redraw(context: bpy.types.Context, status_bar: bool = True) -> None:
    """The panels and the status bar; nothing else of the screen."""
    panel_rows.redraw()
    if status_bar and context.workspace:
        context.workspace.status_text_set(None)  # as no status bar is in a screen's areas, nothing else tells it to draw


CLASSES = (
    VIEWCAM_OT_compare_with_cycles,
    VIEWCAM_OT_cancel_comparison,
    VIEWCAM_OT_show_difference,
    VIEWCAM_OT_open_report,
    VIEWCAM_PT_data_proof,
    VIEWCAM_PT_sidebar_proof,
)


def register() -> None:
    bpy.utils.register_class(ProofSettings)
    bpy.types.WindowManager.virtual_pinhole_proof = bpy.props.PointerProperty(type=ProofSettings)
    bpy.types.TOPBAR_MT_render.append(_draw_render_menu)
    bpy.types.STATUSBAR_HT_header.append(_draw_status_bar)
    background.register()
    proof_image.register()


def unregister() -> None:
    background.unregister()
    proof_image.unregister()
    forget_marks()
    _stop_timer()  # Blender takes a modal operator that is unregistered away without its cancel()
    bpy.types.STATUSBAR_HT_header.remove(_draw_status_bar)
    bpy.types.TOPBAR_MT_render.remove(_draw_render_menu)
    del bpy.types.WindowManager.virtual_pinhole_proof
    bpy.utils.unregister_class(ProofSettings)
