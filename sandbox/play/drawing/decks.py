"""Decks: what is on other layers than the ground, drawn above the bodies there, and see-through."""

import numpy as np
import pygame

from sandbox.play.camera import Camera
from sandbox.play.drawing.fixtures import draw_fixtures
from sandbox.scene.model import Scene
from sandbox.scene.zone import mask_of
from sandbox.trajectory import Frame, IntArray

OPACITY = 165
"""of 255, of what is above the ground"""
MARGIN = 4
"""px around what is drawn"""


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


def draw_deck(surface: pygame.Surface, camera: Camera, deck: Scene, unit: float, antialias: bool) -> None:
    """Draw walls and posts over a picture so that it shines through.

    They are drawn on a copy of that part of the picture where they are, which is then laid over it: what is drawn
    there of several parts that overlap looks like one.
    """
    places = [(point, wall.thickness / 2.0) for wall in deck.walls for point in wall.points]
    places += [(post.position, post.radius) for post in deck.posts]
    if not places:
        return
    pixels = np.asarray(camera.to_screen(np.asarray([place for place, _ in places])))
    reach = np.asarray([[size * camera.scale] for _, size in places]) + MARGIN * unit
    low, high = (pixels - reach).min(axis=0).clip(-1e6, 1e6), (pixels + reach).max(axis=0).clip(-1e6, 1e6)
    box = pygame.Rect(*low.astype(int).tolist(), *(high - low + 2.0).astype(int).tolist()).clip(surface.get_clip())
    if not box.width or not box.height:
        return
    clip = surface.get_clip()
    surface.set_clip(box)
    before = surface.subsurface(box).copy()
    draw_fixtures(surface, camera, deck, unit, antialias)
    before.set_alpha(255 - OPACITY)
    surface.blit(before, box.topleft)
    surface.set_clip(clip)
