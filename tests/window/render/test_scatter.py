"""Particles: the compiled pass draws the same pixels as numpy."""

import numpy as np
import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.window.camera import Camera
from sandbox.window.render import particles as module
from sandbox.window.render.particles import ParticleRenderer, packed_pixels

SIZE = (97, 61)


def render(threshold: int, position: np.ndarray, present: np.ndarray | None, side: int, camera: Camera) -> np.ndarray:
    surface = pygame.Surface(SIZE, 0, 32)
    surface.set_clip(pygame.Rect(3, 5, 80, 50))
    colours = packed_pixels(np.random.default_rng(1).integers(1, 255, (len(position), 3)).astype(np.uint8), surface)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MANY_PARTICLES", threshold)
        ParticleRenderer().draw(surface, camera, position, colours, present, side)
    return pygame.surfarray.array2d(surface)


@given(
    st.integers(0, 2**32),
    st.integers(1, 3),
    st.booleans(),
    st.sampled_from([1e-3, 1.0, 7.3, 1e6]),
)
def test_compiled_and_numpy_draw_the_same_pixels(seed: int, side: int, with_absent: bool, scale: float) -> None:
    random = np.random.default_rng(seed)
    camera = Camera((random.normal(), random.normal()), scale, SIZE)
    # Farther apart than a point, so that the order of drawing does not matter; some are outside or invalid.
    cells = np.stack(np.meshgrid(np.arange(-4, SIZE[0] + 4, 4), np.arange(-4, SIZE[1] + 4, 4)), -1).reshape(-1, 2)
    pixels = cells + random.random(2)
    position = (pixels - np.asarray(SIZE) / 2) / (scale, -scale) + camera.centre
    position[random.random(len(position)) < 0.05] = np.nan
    position[random.random(len(position)) < 0.05] *= 1e12
    position[random.random(len(position)) < 0.02] = np.inf
    present = random.random(len(position)) < 0.7 if with_absent else None
    assert np.array_equal(render(0, position, present, side, camera), render(10**9, position, present, side, camera))


def test_one_particle_covers_nine_pixels() -> None:
    camera = Camera((0.0, 0.0), 10.0, SIZE)
    assert np.count_nonzero(render(0, np.zeros((1, 2)), None, 3, camera)) == 9
