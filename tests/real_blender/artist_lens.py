"""An artist's first day: the lens, its unit, fields that are dragged and typed into, and a picture of twice the size."""

import bpy
import numpy as np
from artist_hands import PULL, in_properties, picture, pulled, room, show
from hands_in_a_window import camera, click, is_at_its_values, press, region, values, window
from tour_hands import LEFT, PROPERTIES, SIDEBAR, find, look, push, type_into, write

EMPTY_SCENE_LENS = 50.0
UNITS = ("MILLIMETERS", "HORIZONTAL", "VERTICAL", "DIAGONAL", "PIXELS")


def tick_the_box():
    assert camera().data.lens == EMPTY_SCENE_LENS
    yield from push("virtual_pinhole.enabled")
    assert values().enabled and values().lens_unit == "MILLIMETERS" and values().keeps == "FIELD_OF_VIEW"
    yield from picture("enabled", SIDEBAR)


def choose_the_unit():
    """The wheel over the unit: each has its field, which takes keyframes. A unit changes no lens."""
    lens = camera().data.lens
    place = yield from find("virtual_pinhole.focal_length")
    for unit in UNITS:
        assert values().lens_unit == unit and camera().data.lens == lens
        sides = {"HORIZONTAL": "horizontal_fov", "VERTICAL": "vertical_fov", "DIAGONAL": "diagonal_fov"}
        field = {"MILLIMETERS": "focal_length", "PIXELS": "distance", **sides}[unit]
        assert (yield from look(*place, SIDEBAR)) == f"virtual_pinhole.{field}"
        yield from picture(f"lens_{unit.lower()}", SIDEBAR)
        yield from look(*place, SIDEBAR)
        press("I", *place)
        yield
        yield
        keyed = [curve.data_path for curve in room("versions").action_curves(camera())]
        assert keyed == [f"virtual_pinhole.{field}"], f"I over the field has keyed {keyed}"
        yield from picture(f"lens_{unit.lower()}_keyed", SIDEBAR)
        camera().animation_data_clear()
        if unit != UNITS[-1]:
            unit_at = region(*SIDEBAR)[1].x + LEFT * region(*SIDEBAR)[1].width
            assert (yield from look(unit_at, place[1], SIDEBAR)) == "virtual_pinhole.lens_unit"
            window().event_simulate(type="WHEELDOWNMOUSE", value="PRESS", x=int(unit_at), y=int(place[1]), ctrl=True)
            yield
            yield
    values().lens_unit = "HORIZONTAL"
    yield
    yield from click(*place)
    yield from write("60")
    press("RET", *place)
    yield
    yield
    assert abs(np.degrees(camera().data.angle) - 60) < 1e-4, f"typed 60°, and Blender's is {np.degrees(camera().data.angle)}°"
    values().lens_unit = "MILLIMETERS"
    yield from type_into("virtual_pinhole.focal_length", "50")
    is_at_its_values()


def drag_the_fields():
    """Each goes as far as Blender's own field of the same kind."""
    yield from in_properties("DATA")
    ours = yield from pulled("virtual_pinhole.focal_length", SIDEBAR, lambda: values().focal_length)
    expected = yield from pulled("lens", PROPERTIES, lambda: camera().data.lens)
    print(f"{PULL} px: lens {ours:.2f} mm, Blender's {expected:.2f} mm", flush=True)
    assert expected > 50 and abs(ours - expected) < 1e-3 * expected
    values().lens_unit = "PIXELS"
    yield
    yield
    before = values().distance
    in_pixels = yield from pulled("virtual_pinhole.distance", SIDEBAR, lambda: values().distance)
    print(f"{PULL} px: d {in_pixels:.1f} px of {before:.1f}", flush=True)
    assert abs(in_pixels / expected / (1920 / 36) - 1) < 0.1, "not as far as in millimeters"
    values().lens_unit = "MILLIMETERS"
    pinhole = [
        (yield from pulled("virtual_pinhole.roll", SIDEBAR, lambda: values().roll)),
        (yield from pulled("virtual_pinhole.eye[0]", SIDEBAR, lambda: values().eye[0])),
    ]
    yield from type_into("virtual_pinhole.roll", "12.3456")
    yield from picture("digits", SIDEBAR)
    yield from type_into("virtual_pinhole.roll", "0")
    yield from show("Item")
    item = [
        (yield from pulled("rotation_euler[2]", SIDEBAR, lambda: camera().rotation_euler[2])),
        (yield from pulled("location[0]", SIDEBAR, lambda: camera().location[0])),
    ]
    yield from show("Pinhole")
    print(f"{PULL} px: roll and eye {pinhole}, Blender's rotation and location {item}", flush=True)
    np.testing.assert_allclose(pinhole, item, rtol=1e-3)
    is_at_its_values()


def type_millimeters():
    """In our field and in Blender's; what is edited then does not throw them back."""
    yield from type_into("virtual_pinhole.focal_length", "85")
    assert abs(camera().data.lens - 85) < 85 * 2**-23, f"typed 85 mm, and the lens is {camera().data.lens}"
    yield from type_into("lens", "35", PROPERTIES)
    assert abs(values().focal_length - 35) < 35 * 2**-22, f"typed 35 mm in Blender's field, and ours is {values().focal_length}"
    yield from type_into("virtual_pinhole.eye[2]", "6")
    assert abs(camera().data.lens - 35) < 35 * 2**-22 and values().eye[2] == 6
    is_at_its_values()


def double_the_resolution():
    """A still of twice the size shows the same."""
    lens = camera().data.lens
    yield from in_properties("OUTPUT")
    for name, pixels in (("resolution_x", 3840), ("resolution_y", 2160)):
        yield from type_into(f"render.{name}", str(pixels), PROPERTIES)
    render = bpy.context.scene.render
    assert (render.resolution_x, render.resolution_y) == (3840, 2160)
    assert abs(camera().data.lens - lens) < lens * 2**-21, f"{lens} mm became {camera().data.lens}"
    render.resolution_x, render.resolution_y = 1920, 1080
    yield from in_properties("DATA")
