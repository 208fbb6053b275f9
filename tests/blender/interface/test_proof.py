"""The sub-panel Proof: what it starts from, and what is left without the add-on. What it does is in test_comparing.py."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import preferences
from viewcam_addon.blender.interface import comparing, proof, proof_image
from viewcam_addon.comparison import pictures


def test_the_level_is_the_preferred_one_until_another_is_chosen(fresh_blender, monkeypatch):
    settings = bpy.context.window_manager.virtual_pinhole_proof
    assert settings.level == "GEOMETRY"
    monkeypatch.setattr(preferences, "get", lambda: preferences.Defaults(default_level="PATH"))
    assert settings.level == "PATH"
    settings.level = "AUTO"
    assert settings.level == "AUTO"
    settings.chosen_level = ""


def test_the_render_menu_and_the_status_bar_are_as_before_without_the_add_on(registered_addon):
    def entries():
        return [
            *bpy.types.TOPBAR_MT_render._dyn_ui_initialize(),
            *bpy.types.STATUSBAR_HT_header._dyn_ui_initialize(),
            *bpy.app.handlers.load_pre,
        ]

    handlers = {proof._draw_render_menu, proof._draw_status_bar, proof.background.on_load}
    assert handlers <= set(entries())
    for _ in range(3):
        registered_addon.unregister()
        without = [each for each in entries() if each in handlers]
        registered_addon.register()
        assert without == [] and len([each for each in entries() if each in handlers]) == 3


WIDTH, HEIGHT = 12, 5


def test_where_not_all_is_modeled_the_artists_own_picture_comes_first_and_the_others_say_so(outcome):
    (outcome.folder / "everything.png").write_bytes(pictures.png(np.full((HEIGHT, WIDTH, 3), (0, 0, 255), np.uint8)))
    gap = " " * proof_image._GAP
    assert columns(proof_image.load(outcome, "ALL")) == gap.join(letter * WIDTH for letter in "brgb")
    assert columns(proof_image.load(outcome, "EVERYTHING")) == "b" * WIDTH
    assert proof_image.labels("ALL", outcome.pictures) == [
        "Cycles, everything",
        "Cycles with stand-ins",
        "Tracer with stand-ins",
        "Difference",
    ]
    assert proof_image.labels("SWIPE", outcome.pictures) == ["Cycles with stand-ins", "Tracer with stand-ins"]


def test_where_all_is_modeled_cycles_picture_has_everything(outcome):
    assert columns(proof_image.load(outcome, "EVERYTHING")) == "r" * WIDTH
    assert proof_image.labels("EVERYTHING", outcome.pictures) == ["Cycles"]
    assert proof_image.labels("ALL", outcome.pictures) == ["Cycles", "Tracer", "Difference"]


@pytest.fixture
def outcome(tmp_path, fresh_blender):
    """A verdict whose pictures are red (Cycles), green (the tracer) and blue (the difference) all over."""
    for name, color in (("test", (255, 0, 0)), ("reference", (0, 255, 0)), ("difference", (0, 0, 255))):
        (tmp_path / f"{name}.png").write_bytes(pictures.png(np.full((HEIGHT, WIDTH, 3), color, np.uint8)))
    proof_image._pixels.cache_clear()
    yield comparing.Outcome("", "Camera", None, "same", "The same picture: so it is.", folder=tmp_path)
    proof_image._pixels.cache_clear()


def columns(image):
    """The letter r, g or b of each column of the image, all the way up."""
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(image.size[1], image.size[0], 4)
    assert (pixels == pixels[:1]).all()
    return "".join("rgb"[int(color[:3].argmax())] if color[:3].any() else " " for color in pixels[0])


def test_labels_stand_where_their_pictures_begin(outcome):
    picture_columns = columns(proof_image.load(outcome, "ALL"))
    for number, letter in enumerate("rgb"):
        assert proof_image.begins(number, 3, len(picture_columns)) == pytest.approx(
            picture_columns.index(letter) / len(picture_columns), abs=1e-12
        ), letter
    assert proof_image.begins(0, 1, WIDTH) == 0


def test_each_view_is_one_image_of_its_own_that_is_saved_with_the_file(outcome):
    gap = " " * proof_image._GAP
    for view, swipe, visible in (
        ("ALL", 0.5, gap.join(letter * WIDTH for letter in "rgb")),
        ("SWIPE", 0.25, "r" * 3 + "g" * 9),
        ("SWIPE", 0.0, "g" * WIDTH),
        ("SWIPE", 1.0, "r" * WIDTH),
        ("CYCLES", 0.5, "r" * WIDTH),
        ("TRACER", 0.5, "g" * WIDTH),
        ("DIFFERENCE", 0.5, "b" * WIDTH),
    ):
        image = proof_image.load(outcome, view, swipe)
        assert columns(image) == visible, view
        assert image.packed_file and not image.is_dirty
    assert [each.name for each in bpy.data.images] == [proof_image.NAME]


def test_the_view_that_is_chosen_is_what_the_image_shows(outcome, monkeypatch):
    settings = bpy.context.window_manager.virtual_pinhole_proof
    monkeypatch.setattr(proof.background, "latest", outcome)
    settings.view = "CYCLES"
    assert proof_image.loaded() is None, "nobody has asked to see it"
    assert bpy.ops.viewcam.show_difference() == {"FINISHED"}
    try:
        assert columns(proof_image.loaded()) == "r" * WIDTH
        settings.view, settings.swipe = "SWIPE", 0.75
        assert columns(proof_image.loaded()) == "r" * 9 + "g" * 3
    finally:
        settings.property_unset("view")
        settings.property_unset("swipe")


def editor(image=None, pinned=False, mode="VIEW", ui_type="IMAGE_EDITOR"):
    space = SimpleNamespace(image=image, use_image_pin=pinned, mode=mode)
    return SimpleNamespace(ui_type=ui_type, spaces=SimpleNamespace(active=space))


def test_no_editor_loses_the_render_result_the_viewer_or_the_artist_s_own_image():
    def chosen(*areas):
        screen = SimpleNamespace(areas=areas)
        return proof_image._free_image_editor(SimpleNamespace(windows=[SimpleNamespace(screen=screen)]))

    def image(name):
        return SimpleNamespace(name=name, library=None)

    taken = [editor(image(name)) for name in ("Render Result", "Viewer Node", "Reference")]
    taken += [editor(pinned=True), editor(mode="PAINT"), editor(ui_type="UV")]
    assert chosen(*taken) is None
    free, pinned = editor(), editor(image(proof_image.NAME), pinned=True)
    assert chosen(*taken, free) is free.spaces.active
    assert chosen(*taken, free, pinned) is pinned.spaces.active


def escape(monkeypatch, playing):
    """The modal operator's response to Escape while a comparison is on its way: (its answer, whether it was ended)."""
    ended, messages = [], []
    monkeypatch.setattr(proof.background, "running", SimpleNamespace(cancel=lambda: ended.append(True)))
    screen = SimpleNamespace(is_animation_playing=playing, areas=[])
    context = SimpleNamespace(window_manager=SimpleNamespace(windows=[SimpleNamespace(screen=screen)]), workspace=None)
    operator = SimpleNamespace(report=lambda *words: messages.append(words), _leave=lambda _context: None)
    answer = proof.VIEWCAM_OT_compare_with_cycles.modal(operator, context, SimpleNamespace(type="ESC", value="PRESS"))
    return answer, bool(ended)


def test_escape_during_playback_ends_the_playback_and_not_the_comparison(monkeypatch):
    assert escape(monkeypatch, playing=True) == ({"PASS_THROUGH"}, False)
    assert escape(monkeypatch, playing=False) == ({"CANCELLED"}, True)


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (
            {"answer": "same", "passes": [{"name": "Position", "percentiles": {"max": {"value": 3.04e-4}}}]},
            "Identical to 0.0003 px",
        ),
        ({"answer": "same", "passes": [{"name": "Position", "percentiles": {}}]}, "Identical"),
        (
            {"answer": "same", "quantities": [{"noise_free": None, "ratio_error": 3e-4}]},
            "The same light, but for noise of 0.03 %",
        ),
        (
            {"answer": "same", "quantities": [{"noise_free": {"percentiles": {"max": {"value": 2e-7}}}}]},
            "Identical to 0.00002 % of the light",
        ),
        (
            {
                "answer": "same_but",
                "not_modeled": {"names": ["Hair"], "share": 0.125},
                "quantities": [{"noise_free": None, "ratio_error": 3e-4}],
            },
            "The same light, but for noise of 0.03 %, but for 1 object that is not modeled (12 % of the picture)",
        ),
        (
            {"answer": "same_but", "not_modeled": {"names": ["Fog"], "share": None}},
            "Identical, but for 1 object that is not modeled",
        ),
        ({"answer": "different"}, "Cycles renders another picture"),
    ],
)
def test_the_first_line_says_it_in_words(result, words):
    assert comparing.headline(result) == words


@pytest.mark.parametrize("width", [150, 202, 260, 600])
def test_the_green_line_is_read_whole_in_a_sidebar_of_any_width(posed_camera, monkeypatch, width):
    """At the mean width of a character, by which all sentences of the panel are wrapped."""
    monkeypatch.setattr(proof, "mark", lambda answer: 7)
    layout, column = MagicMock(), MagicMock()
    layout.column.return_value = column
    context = SimpleNamespace(
        scene=bpy.context.scene,
        region=SimpleNamespace(width=width),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
    )
    seen = comparing.camera_seen(posed_camera, context.scene)
    passed = comparing.Outcome("", "Camera", seen, "same", "The same picture: so it is.", "Identical to 0.000086 px")
    proof._draw_outcome(layout, passed, posed_camera, context)
    first, *more = [call.kwargs for call in column.label.call_args_list]
    assert first["icon_value"] == 7 and all(line["icon"] == "BLANK1" for line in more)
    assert " ".join(line["text"] for line in (first, *more)) == passed.headline
    assert max(len(line["text"]) for line in (first, *more)) * 6.8 <= width - 60


def test_what_is_approximated_is_told_by_name():
    ledger = [
        {"object": "Fog", "status": "skipped", "reason": "a volume"},
        {"object": "Suzanne", "status": "exported", "reason": ""},
        {"object": "Hair", "status": "approximated", "reason": "curves as tubes"},
    ]
    assert comparing.lacking(ledger) == [("Fog", "skipped, a volume"), ("Hair", "approximated, curves as tubes")]
