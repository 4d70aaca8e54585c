import math

import numpy as np
import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

from sandbox.window.camera import Camera
from sandbox.window.render.particles import ParticleRenderer, packed_pixels

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
def test_drawing_on_a_subsurface_changes_no_other_pixels(side):
    whole = pygame.Surface((100, 90))
    position = np.random.default_rng(2).uniform((-1.0, -6.0), (7.0, 2.0), (500, 2))
    render_points(whole.subsurface((10, 20, *CAMERA.size)), position, side=side)
    picture = (pygame.surfarray.array3d(whole) > 0).all(2)
    assert (picture[10 : 10 + 64, 20 : 20 + 48] == expected(position, CAMERA, side)).all()
    picture[10 : 10 + 64, 20 : 20 + 48] = False
    assert not picture.any()


@pytest.mark.parametrize("side", [1, 2, 3])
def test_clip_of_a_surface_is_respected(side):
    surface = pygame.Surface(CAMERA.size)
    surface.set_clip((5, 6, 20, 10))
    position = np.random.default_rng(3).uniform((-1.0, -6.0), (7.0, 2.0), (500, 2))
    reference = expected(position, CAMERA, side)
    inside = np.zeros_like(reference)
    inside[5:25, 6:16] = True
    assert ((render_points(surface, position, side=side) > 0).all(2) == (reference & inside)).all()


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
