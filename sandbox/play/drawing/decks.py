"""Decks: what is on other layers than the ground, drawn above the bodies there, and see-through."""

from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import IntArray
from sandbox.play.camera import Camera
from sandbox.play.drawing.fixtures import draw_fixtures
from sandbox.scene.description.fixed import mask_of
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame

OPACITY = 165
"""of 255, of what is above the ground"""
MARGIN = 4
"""px around what is drawn"""


Sprite = tuple[pygame.Surface, tuple[int, int]]
"""A picture, and where its upper left corner belongs."""


class _Drawn(NamedTuple):
    """A deck as it was drawn."""

    of: tuple[object, ...]
    picture: Sprite | None


def lowest(mask: int) -> int:
    """Return the number of the lowest of some layers, as bits."""
    return (mask & -mask).bit_length() - 1


def on_layer(scene: Scene, layer: int) -> Scene:
    """Return a scene with only those walls and posts that have this one for their lowest layer, and planes below."""

    def here(layers: tuple[str, ...]) -> bool:
        return lowest(mask_of(layers, scene.layers)) == layer

    walls = tuple(wall for wall in scene.walls if here(wall.layers))
    posts = tuple(post for post in scene.posts if here(post.layers))
    return scene.model_copy(update={"walls": walls, "posts": posts, "planes": () if layer else scene.planes})


def layers_among(frame: Frame, numbers: IntArray) -> IntArray:
    """Return on which layer each of some bodies is, (K,)."""
    return np.zeros(len(numbers), np.int64) if frame.layer is None else frame.layer[numbers]


class Decks:
    """What is above the ground, drawn anew only where it, or the camera, has changed."""

    def __init__(self) -> None:
        self._scene: Scene | None = None
        self._decks: tuple[Scene, ...] = ()
        self._drawn: dict[int, _Drawn] = {}

    def draw(
        self, surface: pygame.Surface, camera: Camera, scene: Scene, layer: int, unit: float, antialias: bool
    ) -> None:
        """Draw the walls and posts of a layer over a picture so that it shines through."""
        if self._scene is not scene:  # another scene may have the same decks: on the ground a target fell
            self._scene = scene
            self._decks = tuple(on_layer(scene, k) for k in range(len(scene.layers)))
        deck = self._decks[layer]
        wanted = deck.walls, deck.posts, camera, unit, antialias
        known = self._drawn.get(layer)
        if known is None or known.of != wanted:
            self._drawn[layer] = known = _Drawn(wanted, _deck(surface, camera, deck, unit, antialias))
        if known.picture is not None:
            surface.blit(*known.picture)


def _deck(surface: pygame.Surface, camera: Camera, deck: Scene, unit: float, antialias: bool) -> Sprite | None:
    """Return a see-through picture of a layer and where it belongs; several parts that overlap look like one."""
    places = [(point, wall.thickness / 2.0) for wall in deck.walls for point in wall.points]
    places += [(post.position, post.radius) for post in deck.posts]
    if not places:
        return None
    pixels = np.asarray(camera.to_screen(np.asarray([place for place, _ in places])))
    reach = np.asarray([[size * camera.scale] for _, size in places]) + MARGIN * unit
    low, high = (pixels - reach).min(axis=0).clip(-1e6, 1e6), (pixels + reach).max(axis=0).clip(-1e6, 1e6)
    box = pygame.Rect(*low.astype(int).tolist(), *(high - low + 2.0).astype(int).tolist()).clip(surface.get_rect())
    if not box.width or not box.height:
        return None
    # Of fixtures on black and of the same on white, the difference tells how much they cover.
    dark, light = (pygame.Surface(surface.get_size(), 0, 32) for _ in range(2))
    for ground, colour in ((dark, (0, 0, 0)), (light, (255, 255, 255))):
        ground.fill(colour)
        ground.set_clip(box)
        draw_fixtures(ground, camera, deck, unit, antialias)
    black, white = (pygame.surfarray.array3d(each.subsurface(box)).astype(np.int32) for each in (dark, light))
    cover = (255 - (white - black).mean(axis=2)).clip(0, 255)
    picture = pygame.Surface(box.size, pygame.SRCALPHA, 32)
    own = black * (255.0 / np.maximum(cover, 1.0))[:, :, None]
    pygame.surfarray.pixels3d(picture)[:] = own.clip(0, 255).astype(np.uint8)
    pygame.surfarray.pixels_alpha(picture)[:] = (cover * (OPACITY / 255.0)).astype(np.uint8)
    return picture, box.topleft
