"""Particles: exact pixels as points, by numpy and by the compiled pass, and colours by age."""

import math
from dataclasses import replace

import numpy as np
import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

from sandbox.scene.compile.bodies import Bodies
from sandbox.window.camera import Camera
from sandbox.window.render import particles as module
from sandbox.window.render.particles import SHADE_COUNT, LifetimeColours, ParticleRenderer, fade_colours, packed_pixels
from tests.window.render.drawn import colour_at, frame, render, scene, snapshot

CAMERA = Camera((3.0, -2.0), 10.0, (64, 48))


def render_points(surface: pygame.Surface, position, camera=CAMERA, side=1, present=None, colours=None) -> np.ndarray:
    position = np.asarray(position, dtype=float).reshape(-1, 2)
    tints = np.full((len(position), 3), 255, np.uint8) if colours is None else np.asarray(colours, np.uint8)
    ParticleRenderer().draw(surface, camera, position, packed_pixels(tints, surface), present, side)
    return pygame.surfarray.array3d(surface)


def expected(position: np.ndarray, camera: Camera, side: int) -> np.ndarray:
    """Return the covered pixels, computed one by one, (W, H)."""
    picture = np.zeros(camera.size, bool)
    for x, y in camera.to_screen(position):
        if math.isfinite(x) and math.isfinite(y):
            for right in range(side):
                for down in range(side):
                    column, row = math.floor(x) - side // 2 + right, math.floor(y) - side // 2 + down
                    if 0 <= column < camera.size[0] and 0 <= row < camera.size[1]:
                        picture[column, row] = True
    return picture


@pytest.mark.parametrize("side", [1, 2, 3])
def test_points_cover_exactly_the_pixels_of_the_camera(side):
    position = np.random.default_rng(1).uniform((-1.0, -6.0), (7.0, 2.0), (50_000, 2))[: 200 if side > 1 else None]
    picture = render_points(pygame.Surface(CAMERA.size), position, side=side)
    assert ((picture > 0).all(2) == expected(position, CAMERA, side)).all()


@pytest.mark.parametrize("side", [1, 2, 3])
@given(
    position=st_numpy.arrays(np.float64, (20, 2), elements=st.floats(allow_nan=True, allow_infinity=True)),
    x=st.floats(-1e16, 1e16),
    power=st.floats(-14.0, 12.0),
)
def test_points_of_any_position_and_camera_equal_the_reference(side, position, x, power):
    camera = Camera((x, -x), 10.0**power, (31, 17))
    with np.errstate(over="ignore", invalid="ignore"):
        assert (
            (render_points(pygame.Surface(camera.size), position, camera, side) > 0).all(2)
            == expected(position, camera, side)
        ).all()


@pytest.mark.parametrize("depth", [8, 16, 24, 32])
def test_every_surface_format_shows_the_colours(depth):
    surface = pygame.Surface(CAMERA.size, 0, depth)
    if depth == 8:
        surface.set_palette([(0, 0, 0), (255, 0, 0), (0, 0, 255)])
    picture = render_points(surface, [(3.05, -2.05), (4.05, -1.05)], colours=[(255, 0, 0), (0, 0, 255)])
    assert (picture[32, 24] > 240).tolist() == [True, False, False]
    assert (picture[42, 14] > 240).tolist() == [False, False, True]
    assert (picture.sum(2) > 0).sum() == 2


def test_drawn_pixels_of_an_alpha_surface_are_opaque():
    surface = pygame.Surface(CAMERA.size, pygame.SRCALPHA)
    render_points(surface, [(3.05, -2.05)])
    assert surface.get_at((32, 24)) == (255, 255, 255, 255)


@pytest.mark.parametrize("side", [1, 2, 3])
def test_subsurface_and_clip_limit_the_drawn_pixels(side):
    position = np.random.default_rng(2).uniform((-1.0, -6.0), (7.0, 2.0), (500, 2))
    whole, clipped = pygame.Surface((100, 90)), pygame.Surface(CAMERA.size)
    render_points(whole.subsurface((10, 20, *CAMERA.size)), position, side=side)
    clipped.set_clip((5, 6, 20, 10))
    render_points(clipped, position, side=side)
    reference = expected(position, CAMERA, side)
    framed, inside = np.zeros((100, 90), bool), np.zeros_like(reference)
    framed[10 : 10 + 64, 20 : 20 + 48] = reference
    inside[5:25, 6:16] = reference[5:25, 6:16]
    for surface, covered in ((whole, framed), (clipped, inside)):
        assert ((pygame.surfarray.array3d(surface) > 0).all(2) == covered).all()


def test_absent_bodies_are_omitted():
    picture = render_points(
        pygame.Surface(CAMERA.size), [(3.05, -2.05), (4.05, -1.05)], present=np.asarray([False, True])
    )
    assert (picture.sum(2) > 0).sum() == 1
    assert picture[42, 14].all()


def test_later_particle_covers_an_earlier_one():
    colours = [(255, 0, 0), (0, 255, 0), (0, 0, 255)]
    picture = render_points(pygame.Surface(CAMERA.size), [(3.05, -2.05)] * 3, colours=colours)
    assert picture[32, 24].tolist() == [0, 0, 255]


CLIPPED = (97, 61)


def render_clipped(
    threshold: int, position: np.ndarray, present: np.ndarray | None, side: int, camera: Camera
) -> np.ndarray:
    surface = pygame.Surface(CLIPPED, 0, 32)
    surface.set_clip(pygame.Rect(3, 5, 80, 50))
    colours = packed_pixels(np.random.default_rng(1).integers(1, 255, (len(position), 3)).astype(np.uint8), surface)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MANY_PARTICLES", threshold)
        ParticleRenderer().draw(surface, camera, position, colours, present, side)
    return pygame.surfarray.array2d(surface)


@given(st.integers(0, 2**32), st.integers(1, 3), st.booleans(), st.sampled_from([1e-3, 1.0, 7.3, 1e6]))
def test_compiled_and_numpy_draw_the_same_pixels(seed: int, side: int, with_absent: bool, scale: float) -> None:
    random = np.random.default_rng(seed)
    camera = Camera((random.normal(), random.normal()), scale, CLIPPED)
    # Farther apart than a point, so that the order of drawing does not matter; some are outside or invalid.
    cells = np.stack(np.meshgrid(np.arange(-4, CLIPPED[0] + 4, 4), np.arange(-4, CLIPPED[1] + 4, 4)), -1).reshape(-1, 2)
    pixels = cells + random.random(2)
    position = (pixels - np.asarray(CLIPPED) / 2) / (scale, -scale) + camera.centre
    position[random.random(len(position)) < 0.05] = np.nan
    position[random.random(len(position)) < 0.05] *= 1e12
    position[random.random(len(position)) < 0.02] = np.inf
    present = random.random(len(position)) < 0.7 if with_absent else None
    assert np.array_equal(
        render_clipped(0, position, present, side, camera), render_clipped(10**9, position, present, side, camera)
    )


FADING = {
    "velocity_min": [0.0, 0.0],
    "velocity_max": [0.0, 0.0],
    "lifetime": 2.0,
    "colours": ["#ff0000", "#00ff00", "#0000ff"],
}


def particle(x: float, radius: float, **more: object) -> dict:
    return {**FADING, "position": [x, 0.0], "count": 1, "radius": radius, **more}


def drawn_colour(model, time: float, x: float = 0.0, bodies: Bodies | None = None) -> tuple[int, ...]:
    shown = snapshot(model, frame=frame(model, time=time), bodies=model.bodies if bodies is None else bodies)
    return tuple(map(int, colour_at(render(shown), x, 0.0)))


def test_fade_colours_are_evenly_spaced_and_reach_both_ends():
    shades = fade_colours(("#ff0000", "#00ff00", "#0000ff")).astype(int)
    assert len(shades) == SHADE_COUNT
    assert shades[0].tolist() == [255, 0, 0]
    assert shades[-1].tolist() == [0, 0, 255]
    assert (np.abs(shades.sum(axis=1) - 255) <= 1).all()  # each channel is rounded to a whole number
    assert np.abs(np.diff(shades, axis=0)).max() <= 9  # 510/63 a step, rounded


@pytest.mark.parametrize("radius", [0.02, 1.0])
def test_particle_has_the_colour_of_its_age_since_its_birth(radius):
    model = scene(emitter=[particle(0.0, radius)])
    assert drawn_colour(model, 0.0) == (255, 0, 0)
    red, green, blue = drawn_colour(model, 1.0)
    assert max(red, blue) <= 9 and green >= 245  # half-way is between two of 64 shades
    assert drawn_colour(model, 1.999) == (0, 0, 255)
    assert drawn_colour(model, 5.0) == (0, 0, 255)  # a particle that is not retired keeps its last colour
    later = replace(model.bodies, born=np.asarray([7.0]))
    assert drawn_colour(model, 7.0, bodies=later) == (255, 0, 0)
    assert drawn_colour(model, 8.999, bodies=later) == (0, 0, 255)


@pytest.mark.parametrize("radius", [0.02, 1.0])
def test_particles_without_fading_keep_their_colours(radius):
    not_fading = {**FADING, "radius": radius, "count": 1, "colours": None, "lifetime": None}
    model = scene(
        emitter=[
            particle(-3.0, radius),
            {k: v for k, v in not_fading.items() if v is not None} | {"position": [0.0, 0.0], "colour": "#405060"},
            particle(3.0, radius, colours=["#000000", "#ffffff"]),
        ]
    )
    colours = LifetimeColours(model.bodies)
    assert len(colours) == 2
    assert np.asarray(colours.indices).tolist() == [0, 2]
    for time, first, last in ((0.0, (255, 0, 0), (0, 0, 0)), (1.999, (0, 0, 255), (255, 255, 255))):
        assert drawn_colour(model, time, -3.0) == first
        assert drawn_colour(model, time, 0.0) == (0x40, 0x50, 0x60)
        assert drawn_colour(model, time, 3.0) == last


def test_contact_colours_override_age_colours():
    model = scene(emitter=[particle(0.0, 1.0)])
    shown = render(snapshot(model, overlapping=np.asarray([False])))
    assert colour_at(shown, 0.0, 0.0) != (255, 0, 0)


def test_compiled_and_numpy_fading_agree(monkeypatch):
    crowd = {"velocity_max": [1.0, 1.0], "count": 30_000, "lifetime_jitter": 1.5, "position": [0.0, 0.0]}
    model = scene(emitter=[{**FADING, **crowd}, {**FADING, **crowd, "colours": ["#000000", "#ffffff"]}])
    bodies = replace(model.bodies, born=np.linspace(-0.5, 0.5, len(model.bodies)))
    colours = LifetimeColours(bodies)
    shades = np.arange(len(colours.shades), dtype=np.uint32)
    for time in (0.0, 0.7, 3.0):
        results = []
        for threshold in (1, 10**9):
            monkeypatch.setattr(module, "MANY_PARTICLES", threshold)
            tones = np.zeros(len(bodies), np.uint32)
            colours.fade(tones, shades, time)
            results.append(tones)
        assert np.array_equal(*results)
    assert len(np.unique(results[0])) > 2
