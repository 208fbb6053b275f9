"""What the panel says, as text. Pure: a test calls it without drawing."""

import math
import textwrap

from ..pinhole import Pinhole, Triple


def readouts(camera: Pinhole, lens: float, look_at_distance: str | None) -> list[tuple[str, ...]]:
    """(label, text) of the camera as Blender has it; three texts for the vectors u, v and w.

    lens : mm. look_at_distance : with its unit, or None where no look-at point is stated.
    """
    across, upright, diagonal = (math.degrees(angle) for angle in camera.field_of_view())
    rows = [
        ("Focal Length", f"{lens:.6g} mm"),
        ("Horizontal FOV", f"{across:.4f}°"),
        ("Vertical FOV", f"{upright:.4f}°"),
        ("Diagonal FOV", f"{diagonal:.4f}°"),
    ]
    rows += [(name, *_vector(axis)) for name, axis in zip("uvw", camera.axes(), strict=True)]
    if look_at_distance is not None:
        rows.append(("To Look-At", look_at_distance))
    return rows


def _vector(vector: Triple) -> tuple[str, ...]:
    return tuple(f"{round(component, 5) + 0.0:+.5f}" for component in vector)


def pose_warnings(stated: Pinhole, precision: float) -> list[str]:
    """Sentences on a pose that is singular, or so near that the rounding of the values turns the picture visibly.

    precision : the relative rounding of the values. Visible is what moves a corner of the picture by more than half a pixel.
    """
    if stated.is_singular:
        return ["The view is parallel to up, so that the roll is undefined: the axes are the canonical ones"]
    roll = stated.roll_uncertainty(precision)
    if roll * math.hypot(stated.width, stated.height) / 2 <= 0.5:
        return []
    angle = math.degrees(math.asin(min(1.0, stated.sine_to_up)))
    if roll >= math.pi:
        return [f"The view is only {angle:.2g}° from up: the rounding of the values leaves any roll possible"]
    return [
        f"The view is only {angle:.2g}° from up: the rounding of the values may turn the picture by {math.degrees(roll):.2g}°"
    ]


def wrapped(sentence: str, width: float) -> list[str]:
    """The lines of a sentence in a region of so many pixels, at the panel's mean character width."""
    return textwrap.wrap(sentence, max(20, int(width / 6.8)))
