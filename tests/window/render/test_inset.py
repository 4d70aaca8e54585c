"""Inset: an enlarged view of a region that the scene states, while the main view shows it small."""

import numpy as np
import pygame

from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.palette import hex_colour
from sandbox.window.render.renderer import MAX_INSET_HEIGHT, MAX_INSET_WIDTH, InsetRenderer, Renderer
from tests.window.render.drawn import frame

SIZE = (800, 600)
FREE = pygame.Rect(0, 0, 700, 560)
COLOUR = "#ff0000"


def scene(inset: list[list[float]] | None) -> Scene:
    ball = {"position": [9.0, 0.0], "radius": 0.1, "colour": COLOUR}
    play = {"view": [[-10, -1], [10, 1]]} | ({"inset": inset} if inset is not None else {})
    return from_document({"ball": [ball], "play": play})


def render(model: Scene, camera: Camera) -> tuple[np.ndarray, np.ndarray, pygame.Rect | None]:
    """Return the pixels before and after, and the rectangle of the inset."""
    surface, snapshot = pygame.Surface(SIZE), Snapshot(model, model.bodies, frame(model))
    Renderer().draw(surface, camera, snapshot)
    before = pygame.surfarray.array3d(surface)
    rect = InsetRenderer().draw(surface, camera, snapshot, FREE)
    return before, pygame.surfarray.array3d(surface), rect


def wide_camera(box: tuple[tuple[float, float], tuple[float, float]] = ((-10.0, -1.0), (10.0, 1.0))) -> Camera:
    return Camera.fitting(box, SIZE)


def test_inset_shows_its_region_enlarged_in_the_corner() -> None:
    before, after, rect = render(scene([[8.0, -0.5], [10.0, 0.5]]), wide_camera())
    assert rect is not None
    assert FREE.contains(rect)
    assert rect.width <= MAX_INSET_WIDTH * FREE.width + 1
    assert rect.height <= MAX_INSET_HEIGHT * FREE.height + 1
    assert abs(rect.width - 2 * rect.height) <= 2  # px: it has the aspect ratio of its region
    red = np.array(hex_colour(COLOUR))
    inside = after[rect.left : rect.right, rect.top : rect.bottom]
    ball_pixels = np.argwhere((np.abs(inside.astype(int) - red) < 90).all(axis=2))
    middle = ball_pixels.mean(axis=0)
    assert np.abs(middle - [0.5 * rect.width, 0.5 * rect.height]).max() < 2.0  # px: the ball is at its centre
    scale = rect.width / 2.0
    area = np.pi * (0.1 * scale) ** 2
    assert 0.6 * area < len(ball_pixels) < 1.1 * area  # its edge is darker
    assert not np.array_equal(before, after)


def test_no_inset_without_a_region_or_when_the_view_is_as_close() -> None:
    for model, camera in (
        (scene(None), wide_camera()),
        (scene([[8.0, -0.5], [10.0, 0.5]]), wide_camera(((8.0, -0.5), (10.0, 0.5)))),
        (scene([[8.0, -0.5], [10.0, 0.5]]), Camera((0.0, 0.0), 20.0, SIZE, turned=True)),
    ):
        before, after, rect = render(model, camera)
        assert rect is None
        assert np.array_equal(before, after)


def test_inset_leaves_space_for_other_widgets_in_the_corner() -> None:
    model, camera, surface = scene([[8.0, -0.5], [10.0, 0.5]]), wide_camera(), pygame.Surface(SIZE)
    snapshot = Snapshot(model, model.bodies, frame(model))
    rect = InsetRenderer().draw(surface, camera, snapshot, FREE, aside=300)
    assert rect is not None
    assert rect.right <= FREE.right - 300
    assert rect.left >= 0
    assert InsetRenderer().draw(surface, camera, snapshot, pygame.Rect(0, 0, 1, 1)) is None
