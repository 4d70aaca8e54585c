"""Drawing of balls as lit spheres with numbers, stripes or spots, rotated as they have rolled.

The rotation is integrated from the spins for drawing only.
"""

import math
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.games.billiards.tables import POOL, SOLIDS, WHITE
from sandbox.scene.compile.bodies import Bodies
from sandbox.trajectory import Frame
from sandbox.window.camera import Camera
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.palette import Colour, hex_colour
from sandbox.window.render.sdf import sdf_surface
from sandbox.window.render.text import draw_text

TextureKind = Literal["plain", "solid", "stripe", "spots"]

IVORY: Colour = hex_colour(WHITE)
RED: Colour = (196, 44, 40)
DARK: Colour = (24, 24, 28)
STRIPE = 0.58
"""half the width of a stripe, of the radius"""
DISC = 0.46
"""radius of the disc under a number, likewise"""
SPOT = 0.17
BRIGHT = 350
"""Sum of its colour's parts, from which a ball's spots are red; else they are white."""
STRUCK = ("cue", "white", "yellow")
"""Balls that cues strike, by name; a yellow one only on a table with a white."""


class BallTexture(NamedTuple):
    """How a ball is painted."""

    kind: TextureKind
    colour: Colour
    label: str = ""


def texture_of(name: str, colour: Colour, struck: bool) -> BallTexture:
    """Return the coat of a ball.

    Args:
        name: numbers of pool have stripes and figures.
        colour: as the scene has it.
        struck: whether it is one that cues strike.
    """
    if struck:
        return BallTexture("spots", colour)
    if name not in POOL.colours or not name.isdigit():
        return BallTexture("plain", colour)
    number = int(name)
    if number <= 8:
        return BallTexture("solid", colour, name)
    full = hex_colour(SOLIDS[str(number - 8)])
    return BallTexture("stripe", full if colour == hex_colour(POOL.colours[name]) else colour, name)


def paint_texture(coat: BallTexture, ball: FloatArray, radius: float) -> FloatArray:
    """Return the colours (P, 3) at points (P, 3) of the unit sphere, in the ball's own frame.

    Args:
        coat: of the ball.
        ball: the points.
        radius: of the ball in the picture, px, for edges as soft as a pixel.
    """
    own, soft = np.asarray(coat.colour, np.float64), max(radius, 1.0)
    if coat.kind == "plain":
        return np.broadcast_to(own, ball.shape)
    if coat.kind == "spots":
        off = 1.0 - np.abs(ball).max(axis=1)  # from the nearest of the six ends of the axes, of the height
        share = np.clip((SPOT - np.sqrt(2.0 * off)) * soft + 0.5, 0.0, 1.0)
        spot = RED if sum(coat.colour) > BRIGHT else IVORY
        return np.asarray(own + (np.asarray(spot) - own) * share[:, None])
    colours = np.broadcast_to(own, ball.shape)
    if coat.kind == "stripe":
        white = np.clip((np.abs(ball[:, 1]) - STRIPE) * soft + 0.5, 0.0, 1.0)
        colours = own + (np.asarray(IVORY) - own) * white[:, None]
    x, y = ball[:, 0] * np.where(ball[:, 2] < 0.0, -1.0, 1.0), ball[:, 1]
    disc = np.clip((DISC - np.hypot(x, y)) * soft + 0.5, 0.0, 1.0)
    colours = colours + (np.asarray(IVORY) - colours) * disc[:, None]
    side = int(min(max(round(2.0 * DISC * soft), 5), 64))
    figure = _figure(coat.label, side)
    column = np.clip(((x / DISC + 1.0) * 0.5 * side).astype(np.intp), 0, side - 1)
    row = np.clip(((1.0 - y / DISC) * 0.5 * side).astype(np.intp), 0, side - 1)
    ink = figure[column, row] * (np.hypot(x, y) < DISC)
    return colours + (np.asarray(DARK) - colours) * ink[:, None]


@lru_cache(maxsize=512)
def _figure(label: str, side: int) -> FloatArray:
    """Return how much ink a number has at the pixels of its disc, (side, side)."""
    large = pygame.Surface((128, 128), pygame.SRCALPHA)
    draw_text(large, label, (64, 66), 92 if len(label) == 1 else 76, (255, 255, 255), "center", bold=True)
    small = pygame.transform.smoothscale(large, (side, side))
    return np.asarray(pygame.surfarray.array_alpha(small) / 255.0)


MAX_STEP = 0.5
"""s between two pictures over which balls are seen to roll; over more they were put where they are"""


class BallOrientations:
    """The orientations of balls, from picture to picture. Balls lie at random at first, their faces upwards."""

    def __init__(self) -> None:
        self.turned: FloatArray = np.empty((0, 3, 3))
        """(N, 3, 3) from a ball's own frame to the world's"""
        self.version: IntArray = np.empty(0, np.int64)
        """(N,) which grows when a ball turns"""
        self._time: float | None = None
        self.goes_on = False
        """whether the last picture was of a moment before"""

    def go_on(self, frame: Frame) -> None:
        """Let the balls roll on to a frame. Time that runs backwards rolls nothing back."""
        count, known = len(frame.position), len(self.turned)
        if count > known:
            self.turned = np.concatenate((self.turned, [_thrown(k) for k in range(known, count)]))
            self.version = np.append(self.version, np.zeros(count - known, np.int64))
        dt = 0.0 if self._time is None else frame.time - self._time
        self._time, self.goes_on = frame.time, 0.0 < dt < MAX_STEP
        if not self.goes_on:
            return
        spin = np.zeros((count, 3))
        spin[:, 2] = frame.angular_velocity
        if frame.roll is not None:
            spin[:, :2] = frame.roll
        who = np.flatnonzero(np.isfinite(spin).all(axis=1) & (spin != 0.0).any(axis=1))
        if len(who):
            self.turned[who] = _squared_up(_rotations(spin[who] * dt) @ self.turned[who])
            self.version[who] += 1


def _thrown(number: int) -> FloatArray:
    """Return how a ball lies at first: about its own number, and always the same."""
    random = np.random.default_rng(number)
    tilt = random.uniform(-0.45, 0.45, 3)
    tilt[2] = random.uniform(-0.9, 0.9)
    return np.asarray(_rotations(tilt[None])[0])


def _rotations(vectors: FloatArray) -> FloatArray:
    """Return the rotations (K, 3, 3) about vectors (K, 3) by their lengths, rad (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=1)
    axis = vectors / np.maximum(angle, 1e-300)[:, None]
    x, y, z = axis.T
    zero = np.zeros_like(x)
    cross = np.stack((zero, -z, y, z, zero, -x, -y, x, zero), 1).reshape(-1, 3, 3)
    sin, cos = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + sin * cross + (1.0 - cos) * (cross @ cross))


def _squared_up(matrices: FloatArray) -> FloatArray:
    """Return rotations without what rounding has added to them."""
    x = matrices[:, :, 0] / np.linalg.norm(matrices[:, :, 0], axis=1)[:, None]
    z = np.cross(x, matrices[:, :, 1])
    z /= np.linalg.norm(z, axis=1)[:, None]
    return np.stack((x, np.cross(z, x), z), 2)


FINEST, LARGEST = 48.0, 160.0
"""px: what moves is drawn no finer than the first, what rests than the second, and larger by scaling"""
OFFSETS = 4
"""Balls lie at quarters of a pixel, so that slow ones do not jerk."""
DROP = 0.18
"""s in which a ball that has fallen is seen to sink"""
LIGHT = (-0.42, 0.50, 0.757)
SHADOW = 150
"""of 255, at its darkest"""


class ShadedBall(NamedTuple):
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


class BallRenderer:
    """Draws the balls of a table, and keeps how they lie between pictures."""

    def __init__(self) -> None:
        self._rolling = BallOrientations()
        self._known: Bodies | None = None
        self._coats: tuple[BallTexture, ...] = ()
        self._sprites: dict[int, tuple[tuple[object, ...], pygame.Surface]] = {}
        self._fell: dict[int, float] = {}

    def draw(self, view: DrawContext) -> None:
        """Draw those that are in sight; who lies in a pocket is not seen."""
        bodies, frame = view.snapshot.bodies, view.snapshot.frame
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

    def _know(self, view: DrawContext) -> None:
        bodies = view.snapshot.bodies
        if self._known is bodies:
            return
        if self._known is None or self._known.names != bodies.names[: len(self._known.names)]:
            self._rolling, self._fell = BallOrientations(), {}
        self._known = bodies
        self._sprites.clear()
        struck = {name for name in STRUCK if name != "yellow" or "white" in bodies.names}
        if view.snapshot.scene.play.game is None:  # a study of spin: all of it is to be seen
            struck = set(bodies.names)
        colours = dict(zip(view.shown.tolist(), view.colours.tolist(), strict=True))
        self._coats = tuple(
            texture_of(name, _three(colours.get(number, (128, 128, 128))), name in struck)
            for number, name in enumerate(bodies.names)
        )
        if len(colours) < len(bodies):  # who is out of sight has no colour yet
            self._known = None

    def _sunk(self, view: DrawContext) -> dict[int, float]:
        """Return how far balls have sunk that lie in a pocket, from 0 to 1."""
        frame, scene = view.snapshot.frame, view.snapshot.scene
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
        self, view: DrawContext, number: int, centre: tuple[float, float], radius: float, moving: bool, bright: float
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
    coat: BallTexture, turned: FloatArray, size: int, offset: tuple[int, int], camera: Camera, bright: float
) -> pygame.Surface:
    globe = _globe(size, offset)
    normal = globe.normal
    if camera.turned:  # to the right is y, up is −x
        normal = np.stack((-normal[:, 1], normal[:, 0], normal[:, 2]), 1)
    colours = paint_texture(coat, normal @ turned, size / 8.0)
    lit = np.clip((colours * globe.shade + globe.shine) * bright, 0.0, 255.0)
    parts = np.rint(lit).astype(np.uint32)
    pixels = np.zeros((globe.side, globe.side), np.uint32)
    alpha = np.rint(globe.cover * 255.0).astype(np.uint32)
    pixels[globe.inside] = alpha << 24 | parts[:, 0] << 16 | parts[:, 1] << 8 | parts[:, 2]
    return sdf_surface(pixels, encoded=False)


@lru_cache(maxsize=256)
def _globe(size: int, offset: tuple[int, int]) -> ShadedBall:
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
    return ShadedBall(side, inside, normal, cover[inside], shade[:, None], shine[:, None])


@lru_cache(maxsize=64)
def _shadow(diameter: int) -> pygame.Surface:
    radius = diameter / 2.0
    half = math.ceil(radius * 1.35) + 1
    along = np.arange(2 * half) + 0.5 - half
    away = np.hypot(along[:, None], along[None, :]) / radius
    depth = np.clip((1.3 - away) / 0.6, 0.0, 1.0)
    dark = np.rint(SHADOW * depth * depth * (3.0 - 2.0 * depth)).astype(np.uint32)
    return sdf_surface(np.asarray(dark << 24, np.uint32), encoded=False)


def _three(colour: tuple[int, ...]) -> tuple[int, int, int]:
    red, green, blue = colour
    return red, green, blue
