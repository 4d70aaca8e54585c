"""Inset: a part of a scene that is drawn larger in a corner of the picture, where the picture shows it small."""

import numpy as np
import pygame

from sandbox.play.camera import Box, Camera
from sandbox.play.drawing.palette import INK, SKY, mixed
from sandbox.play.drawing.picture import Picture
from sandbox.play.sight import Sight

WIDE, HIGH = 0.72, 0.38
"""Of the picture, that an inset takes at most."""
MARGIN = 10
"""px at unit 1 to the edges of the picture"""
LARGER = 1.5
"""An inset is of use that shows things so many times as large as the picture."""
EDGE = mixed(SKY, INK, 0.25)


class Inset:
    """Draws the inset of a scene that states one."""

    def __init__(self) -> None:
        self._picture = Picture()
        self._surface: pygame.Surface | None = None

    def draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        sight: Sight,
        free: pygame.Rect,
        *,
        antialias: bool = True,
        unit: float = 1.0,
        aside: int = 0,
    ) -> pygame.Rect | None:
        """Draw it into the lower right corner, and mark what it is of; return where it is, None where there is none.

        Args:
            surface: the picture, drawn already.
            camera: what that shows.
            sight: the moment.
            free: what nothing else covers.
            antialias: whether edges are smooth.
            unit: px, of a line that is one pixel wide on a 1080p display.
            aside: px at the lower right that something else takes.
        """
        box = sight.scene.play.inset
        if box is None:
            return None
        place = _place(box, free, round(MARGIN * unit), aside)
        near = Camera.fitting(box, place.size, margin=0.0)
        if min(place.size) < 1 or near.scale < LARGER * camera.scale or camera.turned:
            return None
        if self._surface is None or self._surface.get_size() != place.size:
            self._surface = pygame.Surface(place.size, 0, surface)
        self._picture.draw(self._surface, near, sight, antialias=antialias, unit=unit, scale=False)
        surface.blit(self._surface, place)
        thick = max(round(1.5 * unit), 1)
        pygame.draw.rect(surface, EDGE, place, thick)
        (left, bottom), (right, top) = camera.to_screen(np.asarray(box)).tolist()
        seen = pygame.Rect(round(left), round(top), round(right - left), round(bottom - top)).clip(surface.get_rect())
        if not place.colliderect(seen):
            pygame.draw.rect(surface, EDGE, seen, thick)
        return place


def _place(box: Box, free: pygame.Rect, margin: int, aside: int) -> pygame.Rect:
    """Return where a box is drawn as large as it may be."""
    (left, bottom), (right, top) = box
    room = free.width - 2 * margin - (aside + margin if aside else 0)
    scale = min(min(WIDE * free.width, room) / (right - left), HIGH * free.height / (top - bottom))
    size = max(round(scale * (right - left)), 0), max(round(scale * (top - bottom)), 0)
    place = pygame.Rect((0, 0), size)
    place.bottomright = free.right - margin - (aside + margin if aside else 0), free.bottom - margin
    return place
