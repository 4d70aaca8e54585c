import math

import numpy as np
import pygame
import pytest

from sandbox.window.render.circles import (
    MAX_SPRITE_RADIUS,
    SPRITE_BUDGET,
    CircleRenderer,
    CircleStyle,
    darken,
    draw_rotation_marks,
)

WHITE = (255, 255, 255)
PLAIN = CircleStyle(line=0.0)


def disc(
    x: float, y: float, radius: float, style: CircleStyle = PLAIN, size: tuple[int, int] = (300, 300)
) -> np.ndarray:
    surface = pygame.Surface(size)
    CircleRenderer().draw(surface, np.asarray([(x, y)]), np.asarray([radius]), np.full((1, 3), 255, np.uint8), style)
    return pygame.surfarray.array3d(surface)[..., 0] / 255.0


@pytest.mark.parametrize("radius", [3.0, 4.7, 10.0, 33.3, MAX_SPRITE_RADIUS, 120.0])
@pytest.mark.parametrize("offset", [0.0, 0.25, 0.4])
def test_antialiased_disc_has_its_area_and_centre(radius, offset):
    picture = disc(150.0 + offset, 150.0 - offset, radius)
    assert picture.sum() == pytest.approx(math.pi * radius**2, rel=0.01)  # pixels have 8 bits, radii 1/128 px
    along = np.arange(300) + 0.5
    near = 0.02 if offset % 0.25 == 0.0 else 0.125  # px: 8 bits a pixel; the centre is rounded to quarters
    assert (picture.sum(1) * along).sum() / picture.sum() == pytest.approx(150.0 + offset, abs=near)
    assert (picture.sum(0) * along).sum() / picture.sum() == pytest.approx(150.0 - offset, abs=near)


@pytest.mark.parametrize("radius", [10.0, 33.3, 120.0])
def test_area_without_antialiasing_is_close_to_the_disc(radius):
    picture = disc(150.0, 150.0, radius, CircleStyle(0.0, antialias=False))
    assert set(np.unique(picture)) == {0.0, 1.0}
    assert picture.sum() == pytest.approx(math.pi * radius**2, abs=2 * math.pi * radius * 0.5)  # half a px at the edge


def test_rim_is_darker_than_the_filling():
    surface = pygame.Surface((100, 100))
    colour = (200, 100, 40)
    CircleRenderer().draw(
        surface, np.asarray([(50.0, 50.0)]), np.asarray([30.0]), np.asarray([colour], np.uint8), CircleStyle(3.0)
    )
    assert surface.get_at((50, 50))[:3] == colour
    assert surface.get_at((50, 50 - 28))[:3] == darken(colour)


def test_a_ring_is_hollow():
    surface = pygame.Surface((100, 100))
    CircleRenderer().ring(surface, (50.0, 50.0), 30.0, WHITE, CircleStyle(4.0))
    assert surface.get_at((50, 50))[:3] == (0, 0, 0)
    assert surface.get_at((50 + 28, 50))[:3] == WHITE


@pytest.mark.parametrize("radius", [1e3, 1e8, 1e14])
def test_disc_of_any_size_is_filled_and_ends_at_its_edge(radius):
    assert (disc(150.0, 140.0, radius) == 1.0).all()
    picture = disc(150.0 - radius, 150.0, radius)
    assert (picture[:148, 150] == 1.0).all()
    assert (picture[152:, 150] == 0.0).all()


def test_discs_outside_change_no_pixel():
    for x, y, radius in ((-2e9, 0.0, 1e9), (1e18, -1e18, 1e6), (500.0, 150.0, 199.0), (150.0, -200.0, 150.0)):
        assert not disc(x, y, radius).any()


def test_sprite_cache_is_bounded():
    discs, surface = CircleRenderer(), pygame.Surface((100, 100))
    for k in range(400):
        radius = np.asarray([95.0 - k / 20])
        discs.draw(surface, np.asarray([(50.0, 50.0)]), radius, np.full((1, 3), 9, np.uint8), PLAIN)
    kept = [sprite for sprites in discs._sprites.values() for sprite in sprites.values()]
    pixels = sum(s.get_width() * s.get_height() for s in kept)
    assert pixels <= SPRITE_BUDGET + 200**2  # plus the sprites of one picture
    assert len(kept) < 400


def test_many_large_discs_are_still_drawn():
    surface = pygame.Surface((200, 200))
    centre = np.stack((np.linspace(0, 200, 60), np.full(60, 100.0)), 1)
    CircleRenderer().draw(surface, centre, np.full(60, 100.0), np.full((60, 3), 255, np.uint8), PLAIN)
    assert (pygame.surfarray.array3d(surface)[:, 100] == 255).all()


@pytest.mark.parametrize("angle", [0.0, math.pi / 2, 2.5, -1.0])
@pytest.mark.parametrize(("radius", "antialias"), [(10.0, True), (10.0, False), (40.0, True), (40.0, False)])
def test_spoke_points_along_the_angle_with_y_up(angle, radius, antialias):
    surface = pygame.Surface((100, 100))
    surface.fill(WHITE)
    tint = np.full((1, 3), 255, np.uint8)
    middle = np.asarray([(50.5, 50.5)])
    draw_rotation_marks(surface, middle, np.asarray([radius]), np.asarray([angle]), tint, antialias)
    inked = 255.0 - pygame.surfarray.array3d(surface).mean(2)
    along = np.arange(100) + 0.5
    x = (inked.sum(1) * along).sum() / inked.sum() - 50.5
    y = (inked.sum(0) * along).sum() / inked.sum() - 50.5
    assert math.atan2(-y, x) == pytest.approx(math.remainder(angle, 2 * math.pi), abs=0.12)  # whole pixels, 6 px out
    assert inked[50, 50] == 0.0


def test_spoke_with_a_nan_angle_is_omitted():
    surface = pygame.Surface((100, 100))
    draw_rotation_marks(
        surface, np.asarray([(50.0, 50.0)]), np.asarray([30.0]), np.asarray([math.nan]), np.ones((1, 3), np.uint8), True
    )
    assert not pygame.surfarray.array3d(surface).any()
