"""Pictures of light as pictures: what no thread, tile or watcher may change, what passes hold, how much memory they take."""

import threading
import time
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon import image
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import native
from viewcam_addon.tracer.render import Stopped, Tracer, render
from viewcam_addon.tracer.scene.film import MOST_REFINED, Bounces, Film, refinement
from viewcam_addon.tracer.scene.lamps import Area, Point, Spot, Sun, World
from viewcam_addon.tracer.scene.materials import Color, Material, sum_of
from viewcam_addon.tracer.scene.shader_nodes import node

PASSES = {*image.LIGHT_PASSES, "Depth", "Object Index"}
FLOAT32 = 2.0**-24
SEED = 3  # gives a scene between whose things there is some of the world to see


@pytest.fixture(scope="module")
def lively(random_scene):
    """A scene with all that light can be and do: lamps with and without a size, shining things, mirrors, glass, a world."""

    def build(seed=SEED, width=96, height=54):
        scene = random_scene(seed, width, height)
        materials = {
            "red": sum_of(diffuse=Color((0.8, 0.1, 0.1))),
            "shining": sum_of(diffuse=Color((0.5,) * 3), emission=Color((2.0, 3.0, 4.0))),
            "mirror": sum_of(mirror=Color((0.9,) * 3), diffuse=Color((0.05,) * 3)),
            "glass": sum_of(glass=Color((1.0,) * 3)),
            "": sum_of(),
        }
        objects = tuple(
            replace(placed, materials=(name,))
            for placed, name in zip(scene.objects, ("red", "mirror", "glass", "shining", ""), strict=True)
        )
        matrix = np.eye(4)
        matrix[:3, 3] = (0, 0, 4)
        lamps = (
            Sun("sun", towards=(1, 2, 3), irradiance=(1, 1, 0.9), angle=0.1),
            Point("point", position=(3, -2, 1), power=(50, 60, 70)),
            Area("area", matrix=matrix, size=(2, 1), power=(80, 80, 80), ellipse=True),
        )
        del materials[""]
        return replace(scene, objects=objects, materials=materials, lamps=lamps, world=World((0.1, 0.2, 0.4)))

    return build


def assert_same(first, second):
    assert first.keys() == second.keys() == PASSES
    for name in first:
        differ = (first[name] != second[name]).any(axis=-1).sum()
        assert differ == 0, f"{name} differs in {differ} pixels"


@pytest.mark.parametrize("error", [None, 0.05])
@pytest.mark.parametrize("level", ["direct", "path"])
def test_light_is_the_same_bit_for_bit_for_any_number_of_threads(lively, level, error):
    scene = lively(SEED, 48, 40)
    reference, more = (render(scene, level, 20, 7, threads=threads, error=error) for threads in (1, 3))
    assert all(np.isfinite(values).all() for values in reference.values())
    for name, values in reference.items():
        assert np.array_equal(values, more[name]), name


@pytest.mark.parametrize("samples", [1, 2, 3, 7, 20])
def test_a_pixels_light_does_not_depend_on_the_pixels_beside_it(lively, samples):
    """Nor on which paths go along with it: of a picture that is cut, the pixels that keep their numbers keep their light."""
    whole = lively(SEED, 64, 40)
    part = replace(whole, camera=whole.camera.cropped(0, 0, 64, 21))
    pictures = [render(scene, "path", samples, 7, threads=1)["Combined"] for scene in (whole, part)]
    assert np.array_equal(pictures[0][:21], pictures[1])


@pytest.mark.parametrize("level", ["direct", "path"])
def test_light_is_the_same_bit_for_bit_on_every_instruction_set(lively, level, monkeypatch):
    pictures = {}
    best = native.core().name
    for name in ("v2", "v3", "v4"):
        monkeypatch.setenv("VIEWCAM_ISA", name)
        native.core.cache_clear()
        try:
            assert native.core().name == name.encode()
        except InputError:  # this processor, or system, has it not
            continue
        pictures[name] = render(lively(SEED, 40, 33), level, 20, 7)
    monkeypatch.undo()
    native.core.cache_clear()
    assert best in (b"base", *map(str.encode, pictures)) and (len(pictures) > 1 or best in (b"base", b"v2"))
    for passes in pictures.values():
        assert_same(passes, pictures["v2"])


def _lying(height, half=1.0):
    matrix = np.diag([half, half, half, 1.0])
    matrix[2, 3] = height
    return matrix


SUN = Sun("sun", towards=(1, 2, 3), irradiance=(1, 1, 0.9))
POINT = Point("point", position=(3, -2, 3), power=(500, 600, 700))
AREA = Area("area", matrix=_lying(4), size=(2, 1), power=(80, 80, 80))
LIT_BY = {
    "a sun": [SUN],
    "a wide sun, twice": [replace(SUN, angle=0.3), replace(SUN, name="other", towards=(-1, 0, 2), angle=0.0)],
    "a point": [POINT],
    "a ball that is around some": [replace(POINT, position=(0.5, 0.2, 0.3), radius=1.0)],
    "a soft ball": [replace(POINT, radius=0.8, soft_falloff=True)],
    "two rectangles": [AREA, replace(AREA, name="other", matrix=_lying(9), power=(900, 900, 900))],
    "an ellipse with a grid": [replace(AREA, ellipse=True, spread=1.2)],
    "a spot": [Spot("spot", matrix=_lying(5), power=(900, 900, 900), angle=0.9, radius=0.2)],
    "some of each": [replace(SUN, angle=0.1), POINT, AREA],
    "many": [replace(POINT, name=f"{i}", position=(i % 7 - 3, i // 7 - 3, 3)) for i in range(40)],
    "the sky alone": [],
}


RED, BLUE = Color((0.8, 0.1, 0.1)), Color((0.1, 0.3, 0.9))
OUTWARDS = node("geometry", output="normal")  # as a number below 0 on one side, which makes mirrors of facets
WIDE = {
    "matte": node("diffuse", color=RED),
    "rough": node("diffuse", color=BLUE, roughness=0.7),
    "plastic": node("principled", base_color=RED, normal=node("bump", height=node("noise"), distance=0.1)),
    "painted": node(
        "principled",
        base_color=OUTWARDS,
        metallic=0.4,
        roughness=OUTWARDS,
        specular_ior_level=0.8,
        diffuse_roughness=0.3,
        coat_weight=OUTWARDS,
        coat_tint=RED,
    ),
    "brushed": node(
        "mix",
        factor=0.3,
        first=node("metallic", roughness=0.3),
        second=node("glossy", color=BLUE, distribution="multiscatter_ggx"),
    ),
}


@pytest.mark.parametrize("sky", [0.0, 0.3])
@pytest.mark.parametrize("lamps", LIT_BY.values(), ids=LIT_BY)
def test_what_goes_in_vectors_has_the_bits_of_what_goes_path_by_path(random_scene, lamps, sky):
    """A second closure that is black and transparent adds nothing, but with it no paths at a surface go together."""
    scene = random_scene(SEED, 24, 20)
    objects = tuple(replace(placed, materials=(name,)) for placed, name in zip(scene.objects, WIDE, strict=True))
    lit = {"lamps": tuple(lamps), "world": World((sky,) * 3), "bounces": Bounces(6, 5, 4)}
    black = node("transparent", color=Color((0.0, 0.0, 0.0)))
    wide = {name: Material(surface=shader) for name, shader in WIDE.items()}
    one_by_one = {name: Material(surface=node("add", first=shader, second=black)) for name, shader in WIDE.items()}
    for level, samples, error in (("direct", 3, None), ("path", 8, None), ("path", 32, 0.05)):
        in_vectors, in_turn = (
            render(replace(scene, objects=objects, materials=materials, **lit), level, samples, error=error)
            for materials in (wide, one_by_one)
        )
        assert in_vectors["Combined"][..., :3].any() or not (lamps or sky)
        for name, values in in_vectors.items():
            assert np.array_equal(values, in_turn[name]), (level, samples, name)


def test_seeds_give_other_noise_of_the_same_picture(lively):
    scene = lively()
    first, again, second = (render(scene, "path", 16, seed) for seed in (1, 1, 2))
    assert_same(first, again)
    apart = (first["Combined"] - second["Combined"])[..., :3].astype(float)
    variance = (first["Variance"] + second["Variance"]).astype(float)
    assert (apart != 0).any(axis=-1).mean() > 0.5
    off = apart.sum(axis=(0, 1)) / np.sqrt(variance.sum(axis=(0, 1)))
    assert (np.abs(off) < 4).all(), f"{off} standard errors apart"
    assert np.array_equal(first["Depth"], second["Depth"])


def test_a_single_sample_is_at_the_pixels_center_and_of_no_known_variance(lively):
    scene = replace(lively(), lamps=(), world=World((0, 0, 0)), film=Film(filter_width=9.0))
    passes, seen = render(scene, "direct", 1), render(scene)
    assert_same(passes, render(scene, "direct", 1, seed=5) | {name: passes[name] for name in ("Combined", "Diffuse Direct")})
    shining = seen["Object Index"][..., 0] == 4
    assert shining.any() and (passes["Emission"][shining] == (2, 3, 4)).all() and (passes["Emission"][~shining] == 0).all()
    for name in ("Depth", "Object Index"):
        assert np.array_equal(passes[name], seen[name])
    assert np.isinf(passes["Variance"]).all(), "shining surfaces are found by chance"
    plain = replace(scene, objects=scene.objects[:1], lamps=(Point("point", position=(3, -2, 1)),))
    assert (render(plain, "direct", 1)["Variance"] == 0).all(), "one lamp of no size is found with certainty"
    assert np.isinf(render(plain, "path", 1)["Variance"]).all()


def test_passes_add_up_to_the_picture(lively):
    scene = replace(lively(), film=Film(exposure=2.0))
    without = sum_of(diffuse=Color((0.3, 0.6, 0.9)))
    scene = replace(scene, materials={**scene.materials, "mirror": without, "glass": without})
    passes = {name: values.astype(float) for name, values in render(scene, "path", 8).items()}
    lit = (passes["Diffuse Direct"] + passes["Diffuse Indirect"]) * passes["Diffuse Color"]
    total = passes["Emission"] + passes["Environment"] + lit
    # Each pass is rounded once, and a quotient twice.
    assert np.allclose(passes["Combined"][..., :3], total, rtol=8 * FLOAT32, atol=8 * FLOAT32 * total.max())
    assert all(passes[name].any() for name in passes)
    single = render(replace(scene, film=Film()), "path", 8)
    for name, power in {
        **dict.fromkeys(("Combined", "Emission", "Environment", "Diffuse Direct"), 1),
        "Variance": 2,
        "Diffuse Color": 0,
    }.items():
        assert np.allclose(passes[name][..., :3], 2.0**power * single[name][..., :3], rtol=4 * FLOAT32), name


@pytest.mark.parametrize("samples", [2, 16, 48, 100])
def test_variance_is_that_of_pictures_with_other_seeds_or_somewhat_more(lively, samples):
    """Batches share out space among them, too, so that means of them differ more than means of pictures would."""
    scene = lively(SEED, 24, 14)
    pictures = [render(scene, "direct", samples, seed, threads=1) for seed in range(24)]
    true = np.var([passes["Combined"][..., :3] for passes in pictures], axis=0, ddof=1).mean(dtype=float)
    stated = np.mean([passes["Variance"] for passes in pictures], dtype=float)
    # 24 seeds of some 300 pixels, most of whose variance is that of a few: the truth is known to a fifth.
    assert 0.8 <= stated / true <= 6, f"{stated / true:.2f}"


def test_a_transparent_film_shows_the_world_in_its_pass_and_in_alpha_only(lively):
    opaque, clear = (render(replace(lively(), film=Film(transparent=transparent)), "path", 8) for transparent in (False, True))
    alpha = clear["Combined"][..., 3]
    assert (
        (opaque["Combined"][..., 3] == 1).all()
        and (alpha == 0).any()
        and (alpha == 1).any()
        and ((alpha > 0) & (alpha < 1)).any()
    )
    assert np.array_equal(opaque["Environment"], clear["Environment"])
    behind = opaque["Combined"][..., :3] - clear["Combined"][..., :3]
    assert np.allclose(behind, opaque["Environment"], atol=4 * FLOAT32 * opaque["Combined"].max())
    assert np.allclose(clear["Environment"], (1 - alpha[..., None]) * np.float32([0.1, 0.2, 0.4]), atol=4 * FLOAT32)


def test_without_light_nothing_shines(lively):
    scene = lively()
    scene = replace(scene, lamps=(), world=World((0, 0, 0)), objects=scene.objects[:3])
    passes = render(scene, "path", 4)
    assert not passes["Combined"][..., :3].any() and passes["Diffuse Color"].any()
    world = replace(scene, world=World((1, 1, 1)), objects=())
    assert (render(world, "path", 4)["Combined"] == 1).all()


class Audience:
    """A watcher that counts, and says stop after so many seconds."""

    def __init__(self, patience=np.inf):
        self.rows, self.threads, self.end = [], set(), time.monotonic() + patience

    def tile(self, passes, rows):
        self.rows += rows
        self.threads.add(threading.get_ident())
        self.filled = (passes["Combined"][rows.start : rows.stop, :, 3] == 1).all()

    def stop(self):
        return time.monotonic() > self.end


@pytest.mark.parametrize("level", ["geometry", "path"])
def test_a_watcher_is_shown_all_rows_in_the_thread_that_asked(lively, level):
    scene, audience = lively(SEED, 200, 150), Audience()
    if level == "geometry":
        audience.tile = lambda passes, rows: audience.rows.extend(rows)
    watched = render(scene, level, 4, threads=2, watcher=audience)
    assert set(audience.rows) == set(range(150))
    if level == "path":
        assert audience.threads == {threading.get_ident()} and audience.filled
        assert_same(watched, render(scene, level, 4, threads=2))


@pytest.mark.parametrize("samples", [1, 7, 40])
def test_a_picture_that_refines_is_shown_whole_at_each_step_and_ends_with_the_bits_of_one_that_does_not(lively, samples):
    """A step is what a picture has that never gets more, but for what of it is known of its noise."""
    scene, steps, tiles = lively(SEED, 70, 40), refinement(samples, 70 * 40), []
    audience = Audience()
    audience.tile = lambda passes, rows: tiles.append(
        (rows, {name: values[rows.start : rows.stop].copy() for name, values in passes.items()})
    )
    refined = render(scene, "path", samples, 7, threads=2, watcher=audience, steps=steps)
    assert_same(refined, render(scene, "path", samples, 7, threads=3))
    each = len(tiles) // len(steps)
    for step, bands in zip(steps, (tiles[i : i + each] for i in range(0, len(tiles), each)), strict=True):
        assert sorted(row for rows, _ in bands for row in rows) == list(range(40))
        picture = np.concatenate([passes["Combined"] for _, passes in sorted(bands, key=lambda band: band[0].start)])
        assert np.isfinite(picture).all()
        if step == steps[0] and samples > 1:
            # The first sample of many is not at the pixel's center, as the only one is, but of the same light.
            assert abs(picture[..., :3].mean() / refined["Combined"][..., :3].mean() - 1) < 0.3
        elif step == steps[-1]:
            np.testing.assert_array_equal(picture, refined["Combined"])


def test_a_picture_that_refines_has_each_sample_once():
    for samples in (1, 2, 3, 15, 16, 17, 64, 1000, 2**24):
        steps = refinement(samples, 1)
        assert steps[-1] == samples and (np.diff((0, *steps)) > 0).all() and max(np.diff((0, *steps))) <= 16
    assert refinement(64, MOST_REFINED + 1) == ()


def test_a_render_of_hours_stops_within_a_second(lively):
    scene = lively(SEED, 1920, 1080)
    scene = replace(scene, bounces=Bounces(64, 64, 64, 64))
    audience = Audience(patience=1.0)
    with pytest.raises(Stopped):
        render(scene, "path", 1 << 20, threads=2, watcher=audience)
    late = time.monotonic() - audience.end
    assert late < 5, f"{late:.1f} s"  # a second on two free cores; tests share theirs


def test_what_a_watcher_raises_ends_the_render(lively):
    audience = Audience()
    audience.tile = lambda *_: 1 / 0
    with pytest.raises(ZeroDivisionError):
        render(lively(), "direct", 2, watcher=audience)


@pytest.mark.exhaustive
def test_memory_beside_the_passes_does_not_grow_with_picture_and_samples(lively):
    def beside(width, height, samples):
        tracer = Tracer(lively(SEED, width, height), threads=1)
        tracemalloc.start()
        passes = tracer.render_light("path", samples, 0)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak - sum(values.nbytes for values in passes.values())

    small, large, longer = beside(200, 170, 16), beside(400, 200, 16), beside(200, 170, 32)
    for other in (small, large, longer):
        assert other <= 1e6, f"{other / 1e6:.1f} MB"


def test_memory_that_ends_while_light_is_traced_is_told(lively, monkeypatch):
    def full(*_):
        raise MemoryError

    monkeypatch.setattr(native.CoreLight, "trace", full)
    with pytest.raises(InputError, match="memory"):
        render(lively(), "path", 4)


def test_a_level_or_a_number_of_samples_that_is_none_is_told(lively):
    with pytest.raises(InputError, match="photons"):
        render(lively(), "photons")
    with pytest.raises(InputError, match="samples"):
        render(lively(), "direct", 0)


def test_an_albedo_beyond_one_and_no_end_of_bounces_end_in_a_picture(ball, make_lit):
    material = sum_of(diffuse=Color((1e18,) * 3), emission=Color((1e18,) * 3))
    camera = Pinhole((0, 0, 0), (1, 0, 0), (0, 0, 1), 10, 8, 6)
    passes = render(make_lit(camera, (ball(6), material), bounces=Bounces(1024, 1024, 1024, 1024)), "path", 2)
    assert np.isfinite(passes["Combined"]).all() and (passes["Combined"][..., :3] > 1e18).all()
