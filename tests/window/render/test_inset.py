"""The inset of a picture: what a scene asks to be shown larger, where the picture shows it small."""

import numpy as np
import pygame

from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.palette import hex_colour
from sandbox.window.render.renderer import HIGH, WIDE, InsetRenderer, Renderer
from tests.window.render.drawn import frame

SIZE = (800, 600)
FREE = pygame.Rect(0, 0, 700, 560)
COLOUR = "#ff0000"


def scene(inset: list[list[float]] | None) -> Scene:
    ball = {"position": [9.0, 0.0], "radius": 0.1, "colour": COLOUR}
    play = {"view": [[-10, -1], [10, 1]]} | ({"inset": inset} if inset is not None else {})
    return from_document({"ball": [ball], "play": play})


def drawn(of: Scene, camera: Camera) -> tuple[np.ndarray, np.ndarray, pygame.Rect | None]:
    """Return the pixels before and after, and where the inset is."""
    surface, sight = pygame.Surface(SIZE), Snapshot(of, of.bodies, frame(of))
    Renderer().draw(surface, camera, sight)
    before = pygame.surfarray.array3d(surface)
    place = InsetRenderer().draw(surface, camera, sight, FREE)
    return before, pygame.surfarray.array3d(surface), place


def far(box: tuple[tuple[float, float], tuple[float, float]] = ((-10.0, -1.0), (10.0, 1.0))) -> Camera:
    return Camera.fitting(box, SIZE)


def test_what_is_small_is_seen_larger_in_the_corner() -> None:
    before, after, place = drawn(scene([[8.0, -0.5], [10.0, 0.5]]), far())
    assert place is not None
    assert FREE.contains(place)
    assert place.width <= WIDE * FREE.width + 1
    assert place.height <= HIGH * FREE.height + 1
    assert abs(place.width - 2 * place.height) <= 2  # px: it has the shape of what it is of
    red = np.array(hex_colour(COLOUR))
    inside = after[place.left : place.right, place.top : place.bottom]
    where = np.argwhere((np.abs(inside.astype(int) - red) < 90).all(axis=2))
    middle = where.mean(axis=0)
    assert np.abs(middle - [0.5 * place.width, 0.5 * place.height]).max() < 2.0  # px; the ball is in its middle
    scale = place.width / 2.0
    area = np.pi * (0.1 * scale) ** 2
    assert 0.6 * area < len(where) < 1.1 * area  # its edge is darker
    assert not np.array_equal(before, after)


def test_no_inset_where_none_is_stated_or_the_picture_is_as_near() -> None:
    for of, camera in (
        (scene(None), far()),
        (scene([[8.0, -0.5], [10.0, 0.5]]), far(((8.0, -0.5), (10.0, 0.5)))),
        (scene([[8.0, -0.5], [10.0, 0.5]]), Camera((0.0, 0.0), 20.0, SIZE, turned=True)),
    ):
        before, after, place = drawn(of, camera)
        assert place is None
        assert np.array_equal(before, after)


def test_room_is_left_for_what_else_is_in_the_corner() -> None:
    of, camera, surface = scene([[8.0, -0.5], [10.0, 0.5]]), far(), pygame.Surface(SIZE)
    sight = Snapshot(of, of.bodies, frame(of))
    place = InsetRenderer().draw(surface, camera, sight, FREE, aside=300)
    assert place is not None
    assert place.right <= FREE.right - 300
    assert place.left >= 0
    assert InsetRenderer().draw(surface, camera, sight, pygame.Rect(0, 0, 1, 1)) is None
