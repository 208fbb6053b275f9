"""A box of light, after the one at Cornell: a red wall, a green wall, a lamp in the ceiling, a mirror ball and a glass ball.

Nothing outside lights it. What the ceiling and the shadows show arrived by way of walls; the mirror and the glass bring the
lamp where its own light does not reach, and a bar glows on the tall block. Every surface is of a kind that the reference tracer
models whole: matte, perfect mirror, clear glass, emission.
"""

import building as b
from building import fresh_scene, state_camera

SIZE = 2.0


def build():
    """The scene of cornell.blend."""
    scene = fresh_scene("cornell", 720, 720)
    scene.cycles.use_denoising = False
    white = b.matte("White", "d8d4c8")
    walls(white, b.matte("Red", "b8402e"), b.matte("Green", "4f8a4a"))
    b.box("Tall block", (0.56, 0.56, 1.16), white, (-0.36, 0.32, 0), bevel=0.0, rotation=(0, 0, 17))
    b.box("Bar", (0.4, 0.06, 0.06), b.glowing("Glow", "ffb46a", 9.0), (-0.36, 0.32, 1.16), bevel=0.0, rotation=(0, 0, 17))
    b.ball("Mirror ball", 0.34, b.mirror("Mirror", "f2f2f2"), (0.38, 0.36, 0.34))
    b.ball("Glass ball", 0.27, b.clear_glass("Glass", "ffffff"), (0.12, -0.46, 0.27))
    b.softbox("Lamp", 26, "fff1dc", (0, 0, SIZE - 0.005), (0, 0, 0), 0.7, 0.5)
    state_camera(scene, eye=(0, -4.9, 1.0), look_at=(0, 0, 1.0), distance=1380.0)
    return scene


def walls(white, red, green):
    """Floor, ceiling and three walls that face inwards; the fourth is left out for the camera."""
    half = SIZE / 2
    corners = [(x, y, z) for z in (0, SIZE) for y in (-half, half) for x in (-half, half)]
    sides = {
        "Floor": ((0, 1, 3, 2), white),
        "Ceiling": ((4, 6, 7, 5), white),
        "Back": ((2, 3, 7, 6), white),
        "Left": ((0, 2, 6, 4), red),
        "Right": ((1, 5, 7, 3), green),
    }
    for name, (corner, material) in sides.items():
        b.place(name, b.mesh(name, [corners[i] for i in corner], [range(4)]), material)
