"""Balls: spheres that lie on a table, lit, painted, and turned as they have rolled."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.arrays import FloatArray
from sandbox.play.camera import Camera
from sandbox.play.drawing.shade import surface_of
from sandbox.play.drawing.table.coats import STRUCK, Coat, coat_of, painted
from sandbox.play.drawing.table.rolling import Rolling
from sandbox.play.drawing.view import View
from sandbox.scene.compile.bodies import Bodies

FINEST, LARGEST = 48.0, 160.0
"""px: what moves is drawn no finer than the first, what rests than the second, and larger by scaling"""
OFFSETS = 4
"""Balls lie at quarters of a pixel, so that slow ones do not jerk."""
DROP = 0.18
"""s in which a ball that has fallen is seen to sink"""
LIGHT = (-0.42, 0.50, 0.757)
SHADOW = 150
"""of 255, at its darkest"""


class Globe(NamedTuple):
    """The pixels of a sphere of some size, P of them inside."""

    side: int
    inside: npt.NDArray[np.bool_]
    """(side, side)"""
    normal: FloatArray
    """(P, 3) as seen, x to the right and y up"""
    cover: FloatArray
    """(P,)"""
    shade: FloatArray
    """(P, 1) of its colour"""
    shine: FloatArray
    """(P, 1) added, of 255"""


class Balls:
    """Draws the balls of a table, and keeps how they lie between pictures."""

    def __init__(self) -> None:
        self._rolling = Rolling()
        self._known: Bodies | None = None
        self._coats: tuple[Coat, ...] = ()
        self._sprites: dict[int, tuple[tuple[object, ...], pygame.Surface]] = {}
        self._fell: dict[int, float] = {}

    def draw(self, view: View) -> None:
        """Draw those that are in sight; who lies in a pocket is not seen."""
        bodies, frame = view.sight.bodies, view.sight.frame
        self._know(view)
        self._rolling.go_on(frame)
        sunk = self._sunk(view)
        seen = [k for k, number in enumerate(view.shown.tolist()) if sunk.get(number, 0.0) < 1.0]
        places = [(k, int(view.shown[k]), *view.centre[k].tolist(), float(view.radius[k])) for k in seen]
        for _, number, x, y, radius in places:
            if number not in sunk and radius >= 2.0:
                shadow = _shadow(round(radius * 2.0))
                half = shadow.get_width() / 2.0
                view.surface.blit(shadow, (round(x + 0.20 * radius - half), round(y + 0.26 * radius - half)))
        moving = (frame.velocity != 0.0).any(axis=1) | (frame.angular_velocity != 0.0)
        for _, number, x, y, radius in places:
            depth = sunk.get(number, 0.0)
            size = radius * (1.0 - 0.35 * depth)
            if not bodies.round[number]:
                continue
            self._ball(view, number, (x, y), size, bool(moving[number]) or depth > 0.0, 1.0 - depth)

    def _know(self, view: View) -> None:
        bodies = view.sight.bodies
        if self._known is bodies:
            return
        if self._known is None or self._known.names != bodies.names[: len(self._known.names)]:
            self._rolling, self._fell = Rolling(), {}
        self._known = bodies
        self._sprites.clear()
        struck = {name for name in STRUCK if name != "yellow" or "white" in bodies.names}
        if view.sight.scene.play.game is None:  # a study of spin: all of it is to be seen
            struck = set(bodies.names)
        colours = dict(zip(view.shown.tolist(), view.colours.tolist(), strict=True))
        self._coats = tuple(
            coat_of(name, _three(colours.get(number, (128, 128, 128))), name in struck)
            for number, name in enumerate(bodies.names)
        )
        if len(colours) < len(bodies):  # who is out of sight has no colour yet
            self._known = None

    def _sunk(self, view: View) -> dict[int, float]:
        """Return how far balls have sunk that lie in a pocket, from 0 to 1."""
        frame, scene = view.sight.frame, view.sight.scene
        found: dict[int, float] = {}
        for hole in scene.pockets:
            within = (frame.position == np.asarray(hole.position)).all(axis=1) & frame.present
            for number in np.flatnonzero(within).tolist():
                # Who lay there when it was looked at for the first time was not seen to fall.
                since = self._fell.setdefault(number, frame.time if self._rolling.goes_on else -math.inf)
                found[number] = min((frame.time - since) / DROP, 1.0)
        for number in [each for each in self._fell if each not in found or self._fell[each] > frame.time]:
            del self._fell[number]
        return found

    def _ball(
        self, view: View, number: int, centre: tuple[float, float], radius: float, moving: bool, bright: float
    ) -> None:
        finest = FINEST if moving else LARGEST
        size = max(round(min(radius, finest) * 8.0), 4)
        larger = radius / finest if radius > finest else 1.0
        place = [math.floor(each * OFFSETS + 0.5) for each in centre]
        offset = (place[0] % OFFSETS, place[1] % OFFSETS) if larger == 1.0 else (0, 0)
        key = (size, larger, offset, int(self._rolling.version[number]), view.camera.turned, bright)
        known = self._sprites.get(number)
        if known is None or known[0] != key:
            turned = self._rolling.turned[number]
            sprite = _sprite(self._coats[number], turned, size, offset, view.camera, bright)
            if larger != 1.0:
                side = round(sprite.get_width() * larger)
                sprite = pygame.transform.smoothscale(sprite, (side, side))
            self._sprites[number] = known = (key, sprite)
        half = math.ceil(size / 8.0) + 1
        if larger != 1.0:
            corner = centre[0] - half * larger, centre[1] - half * larger
        else:
            corner = place[0] // OFFSETS - half, place[1] // OFFSETS - half
        view.surface.blit(known[1], (round(corner[0]), round(corner[1])))


def _sprite(
    coat: Coat, turned: FloatArray, size: int, offset: tuple[int, int], camera: Camera, bright: float
) -> pygame.Surface:
    globe = _globe(size, offset)
    normal = globe.normal
    if camera.turned:  # to the right is y, up is −x
        normal = np.stack((-normal[:, 1], normal[:, 0], normal[:, 2]), 1)
    colours = painted(coat, normal @ turned, size / 8.0)
    lit = np.clip((colours * globe.shade + globe.shine) * bright, 0.0, 255.0)
    parts = np.rint(lit).astype(np.uint32)
    pixels = np.zeros((globe.side, globe.side), np.uint32)
    alpha = np.rint(globe.cover * 255.0).astype(np.uint32)
    pixels[globe.inside] = alpha << 24 | parts[:, 0] << 16 | parts[:, 1] << 8 | parts[:, 2]
    return surface_of(pixels, encoded=False)


@lru_cache(maxsize=256)
def _globe(size: int, offset: tuple[int, int]) -> Globe:
    """Return the pixels of a sphere of a radius in eighths of a pixel, its middle at quarters of one."""
    radius = size / 8.0
    half = math.ceil(radius) + 1
    side = 2 * half + 1
    along = np.arange(side) + 0.5
    x = (along[:, None] - half - offset[0] / OFFSETS) / radius
    y = -(along[None, :] - half - offset[1] / OFFSETS) / radius
    away = np.hypot(x, y)
    cover = np.clip((1.0 - away) * radius + 0.5, 0.0, 1.0)
    inside = cover > 0.0
    shrunk = np.minimum(1.0, 0.999 / np.maximum(away, 1e-9))
    x, y = (np.broadcast_to(each, away.shape)[inside] * shrunk[inside] for each in (x, y))
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    normal = np.stack((x, y, z), 1)
    toward = normal @ np.asarray(LIGHT)
    shade = 0.50 + 0.52 * np.clip(0.25 + 0.75 * toward, 0.0, 1.0) - 0.16 * (1.0 - z) ** 2
    half_way = np.asarray(LIGHT) + np.asarray((0.0, 0.0, 1.0))
    mirror = np.clip(normal @ (half_way / np.linalg.norm(half_way)), 0.0, 1.0)
    shine = 150.0 * mirror**70 + 26.0 * mirror**8
    return Globe(side, inside, normal, cover[inside], shade[:, None], shine[:, None])


@lru_cache(maxsize=64)
def _shadow(diameter: int) -> pygame.Surface:
    radius = diameter / 2.0
    half = math.ceil(radius * 1.35) + 1
    along = np.arange(2 * half) + 0.5 - half
    away = np.hypot(along[:, None], along[None, :]) / radius
    depth = np.clip((1.3 - away) / 0.6, 0.0, 1.0)
    dark = np.rint(SHADOW * depth * depth * (3.0 - 2.0 * depth)).astype(np.uint32)
    return surface_of(np.asarray(dark << 24, np.uint32), encoded=False)


def _three(colour: tuple[int, ...]) -> tuple[int, int, int]:
    red, green, blue = colour
    return red, green, blue
