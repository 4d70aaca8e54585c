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
from sandbox.window.render.palette import RgbColour, hex_colour
from sandbox.window.render.sdf import sdf_surface
from sandbox.window.render.text import draw_text

TextureKind = Literal["plain", "solid", "stripe", "spots"]

IVORY: RgbColour = hex_colour(WHITE)
RED: RgbColour = (196, 44, 40)
DARK: RgbColour = (24, 24, 28)
STRIPE_HALF_WIDTH = 0.58
"""half width of a stripe, in ball radii"""
DISC_RADIUS = 0.46
"""radius of the disc under a number, in ball radii"""
SPOT_RADIUS = 0.17
"""radius of a spot, in ball radii"""
BRIGHT_SUM = 350
"""sum of red, green and blue, 0 to 765, above which a ball has red spots; darker balls have ivory spots"""
CUE_BALL_NAMES = ("cue", "white", "yellow")
"""Names of cue balls; `yellow` is one only on a table with a `white`."""


class BallTexture(NamedTuple):
    """Pattern and colour of a ball."""

    kind: TextureKind
    colour: RgbColour
    label: str = ""


def texture_of(name: str, colour: RgbColour, struck: bool) -> BallTexture:
    """Return the texture of a ball.

    Args:
        name: name of the ball; the numbered balls of pool have labels and stripes.
        colour: colour of the ball in the scene.
        struck: whether it is a cue ball, which has spots.
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


def paint_texture(texture: BallTexture, ball: FloatArray, radius: float) -> FloatArray:
    """Return the colours at points of the unit sphere, (P, 3), 0 to 255.

    Args:
        texture: texture of the ball.
        ball: (P, 3) points in the body frame.
        radius: radius of the drawn ball, px; edges are antialiased over a pixel.
    """
    own, soft = np.asarray(texture.colour, np.float64), max(radius, 1.0)
    if texture.kind == "plain":
        return np.broadcast_to(own, ball.shape)
    if texture.kind == "spots":
        off = 1.0 - np.abs(ball).max(axis=1)  # 1 − cos of the angle to the nearest axis; the chord is √(2·off)
        coverage = np.clip((SPOT_RADIUS - np.sqrt(2.0 * off)) * soft + 0.5, 0.0, 1.0)
        spot = RED if sum(texture.colour) > BRIGHT_SUM else IVORY
        return np.asarray(own + (np.asarray(spot) - own) * coverage[:, None])
    colours = np.broadcast_to(own, ball.shape)
    if texture.kind == "stripe":
        white = np.clip((np.abs(ball[:, 1]) - STRIPE_HALF_WIDTH) * soft + 0.5, 0.0, 1.0)
        colours = own + (np.asarray(IVORY) - own) * white[:, None]
    x, y = ball[:, 0] * np.where(ball[:, 2] < 0.0, -1.0, 1.0), ball[:, 1]
    disc = np.clip((DISC_RADIUS - np.hypot(x, y)) * soft + 0.5, 0.0, 1.0)
    colours = colours + (np.asarray(IVORY) - colours) * disc[:, None]
    side = int(min(max(round(2.0 * DISC_RADIUS * soft), 5), 64))
    figure = _figure(texture.label, side)
    column = np.clip(((x / DISC_RADIUS + 1.0) * 0.5 * side).astype(np.intp), 0, side - 1)
    row = np.clip(((1.0 - y / DISC_RADIUS) * 0.5 * side).astype(np.intp), 0, side - 1)
    ink = figure[column, row] * (np.hypot(x, y) < DISC_RADIUS)
    return colours + (np.asarray(DARK) - colours) * ink[:, None]


@lru_cache(maxsize=512)
def _figure(label: str, side: int) -> FloatArray:
    """Return the coverage of a label at the pixels of its disc, (side, side), 0 to 1."""
    large = pygame.Surface((128, 128), pygame.SRCALPHA)
    draw_text(large, label, (64, 66), 92 if len(label) == 1 else 76, (255, 255, 255), "center", bold=True)
    small = pygame.transform.smoothscale(large, (side, side))
    return np.asarray(pygame.surfarray.array_alpha(small) / 255.0)


MAX_STEP = 0.5
"""s: longest interval between drawn frames over which balls roll; after a longer one they were placed"""


class BallOrientations:
    """Orientations of balls, integrated from frame to frame. Initially random, with the labels facing up."""

    def __init__(self) -> None:
        self.turned: FloatArray = np.empty((0, 3, 3))
        """(N, 3, 3) rotation matrices from the body frame to the world frame"""
        self.version: IntArray = np.empty(0, np.int64)
        """(N,) counter that increases whenever a ball turns"""
        self._time: float | None = None
        self.is_continuous = False
        """whether the last frame directly follows the one before, within `MAX_STEP`"""

    def advance(self, frame: Frame) -> None:
        """Integrate the rotations up to a frame. A step back in time leaves them unchanged."""
        count, known = len(frame.position), len(self.turned)
        if count > known:
            self.turned = np.concatenate((self.turned, [_initial_orientation(k) for k in range(known, count)]))
            self.version = np.append(self.version, np.zeros(count - known, np.int64))
        dt = 0.0 if self._time is None else frame.time - self._time
        self._time, self.is_continuous = frame.time, 0.0 < dt < MAX_STEP
        if not self.is_continuous:
            return
        spin = np.zeros((count, 3))
        spin[:, 2] = frame.angular_velocity
        if frame.roll is not None:
            spin[:, :2] = frame.roll
        indices = np.flatnonzero(np.isfinite(spin).all(axis=1) & (spin != 0.0).any(axis=1))
        if len(indices):
            self.turned[indices] = _orthonormalised(_rotations(spin[indices] * dt) @ self.turned[indices])
            self.version[indices] += 1


def _initial_orientation(number: int) -> FloatArray:
    """Return the initial orientation of a ball, (3, 3), with its index as the random seed."""
    random = np.random.default_rng(number)
    tilt = random.uniform(-0.45, 0.45, 3)
    tilt[2] = random.uniform(-0.9, 0.9)
    return np.asarray(_rotations(tilt[None])[0])


def _rotations(vectors: FloatArray) -> FloatArray:
    """Return the matrices, (K, 3, 3), of rotations about vectors, (K, 3), by their lengths, rad (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=1)
    axis = vectors / np.maximum(angle, 1e-300)[:, None]
    x, y, z = axis.T
    zero = np.zeros_like(x)
    cross = np.stack((zero, -z, y, z, zero, -x, -y, x, zero), 1).reshape(-1, 3, 3)
    sin, cos = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + sin * cross + (1.0 - cos) * (cross @ cross))


def _orthonormalised(matrices: FloatArray) -> FloatArray:
    """Return rotation matrices re-orthonormalised against rounding errors."""
    x = matrices[:, :, 0] / np.linalg.norm(matrices[:, :, 0], axis=1)[:, None]
    z = np.cross(x, matrices[:, :, 1])
    z /= np.linalg.norm(z, axis=1)[:, None]
    return np.stack((x, np.cross(z, x), z), 2)


MAX_MOVING_RADIUS, MAX_RESTING_RADIUS = 48.0, 160.0
"""px: largest radius at which sprites of moving and of resting balls are shaded; larger balls are scaled up"""
MAX_SHADOWED_RADIUS = 1_000.0
"""px: the shadow of a larger ball would cover the view"""
SUBPIXEL_OFFSETS = 4
"""subpixel positions of a sprite along each axis, so that slow balls move smoothly"""
SINK_TIME = 0.18
"""s: duration of the animation of a pocketed ball"""
LIGHT_DIRECTION = (-0.42, 0.50, 0.757)
"""unit vector towards the light, x to the right and y up as seen"""
SHADOW_ALPHA = 150
"""greatest opacity of a shadow, of 255"""


class ShadedBall(NamedTuple):
    """Shading of a sphere at one size and subpixel offset, for its P covered pixels."""

    side: int
    inside: npt.NDArray[np.bool_]
    """(side, side) mask of the covered pixels"""
    normal: FloatArray
    """(P, 3) normals in screen axes, x to the right and y up"""
    cover: FloatArray
    """(P,) coverage, 0 to 1"""
    shade: FloatArray
    """(P, 1) factor of the diffuse colour"""
    shine: FloatArray
    """(P, 1) specular light that is added, of 255"""


class BallRenderer:
    """Draws the balls of a table, and keeps their orientations between frames."""

    def __init__(self) -> None:
        self._rolling = BallOrientations()
        self._bodies: Bodies | None = None
        self._textures: tuple[BallTexture, ...] = ()
        self._sprites: dict[int, tuple[tuple[object, ...], pygame.Surface]] = {}
        self._fall_times: dict[int, float] = {}

    def draw(self, view: DrawContext) -> None:
        """Draw the visible balls; a pocketed ball sinks and disappears."""
        bodies, frame = view.snapshot.bodies, view.snapshot.frame
        self._update_bodies(view)
        self._rolling.advance(frame)
        sinking = self._sinking(view)
        visible = [k for k, number in enumerate(view.shown.tolist()) if sinking.get(number, 0.0) < 1.0]
        discs = [(k, int(view.shown[k]), *view.centre[k].tolist(), float(view.radius[k])) for k in visible]
        for _, number, x, y, radius in discs:
            if number not in sinking and 2.0 <= radius <= MAX_SHADOWED_RADIUS:
                shadow = _shadow(round(radius * 2.0))
                half = shadow.get_width() / 2.0
                view.surface.blit(shadow, (round(x + 0.20 * radius - half), round(y + 0.26 * radius - half)))
        moving = (frame.velocity != 0.0).any(axis=1) | (frame.angular_velocity != 0.0)
        for _, number, x, y, radius in discs:
            depth = sinking.get(number, 0.0)
            size = radius * (1.0 - 0.35 * depth)
            if not bodies.round[number]:
                continue
            self._ball(view, number, (x, y), size, bool(moving[number]) or depth > 0.0, 1.0 - depth)

    def _update_bodies(self, view: DrawContext) -> None:
        bodies = view.snapshot.bodies
        if self._bodies is bodies:
            return
        if self._bodies is None or self._bodies.names != bodies.names[: len(self._bodies.names)]:
            self._rolling, self._fall_times = BallOrientations(), {}
        self._bodies = bodies
        self._sprites.clear()
        struck = {name for name in CUE_BALL_NAMES if name != "yellow" or "white" in bodies.names}
        if view.snapshot.scene.play.game is None:  # no game, a study of spin: spots on all balls
            struck = set(bodies.names)
        colours = dict(zip(view.shown.tolist(), view.colours.tolist(), strict=True))
        self._textures = tuple(
            texture_of(name, _rgb(colours.get(number, (128, 128, 128))), name in struck)
            for number, name in enumerate(bodies.names)
        )
        if len(colours) < len(bodies):  # balls outside the view have no colour yet
            self._bodies = None

    def _sinking(self, view: DrawContext) -> dict[int, float]:
        """Return the progress of the sinking animation of pocketed balls by index, 0 to 1."""
        frame, scene = view.snapshot.frame, view.snapshot.scene
        found: dict[int, float] = {}
        for hole in scene.pockets:
            within = (frame.position == np.asarray(hole.position)).all(axis=1) & frame.present
            for number in np.flatnonzero(within).tolist():
                # A ball that was pocketed before the first drawn frame, or during a jump in time, is not animated.
                since = self._fall_times.setdefault(number, frame.time if self._rolling.is_continuous else -math.inf)
                found[number] = min((frame.time - since) / SINK_TIME, 1.0)
        for number in [each for each in self._fall_times if each not in found or self._fall_times[each] > frame.time]:
            del self._fall_times[number]
        return found

    def _ball(
        self, view: DrawContext, number: int, centre: tuple[float, float], radius: float, moving: bool, bright: float
    ) -> None:
        finest = MAX_MOVING_RADIUS if moving else MAX_RESTING_RADIUS
        size = max(round(min(radius, finest) * 8.0), 4)
        scale = radius / finest if radius > finest else 1.0
        subpixel = [math.floor(each * SUBPIXEL_OFFSETS + 0.5) for each in centre]
        offset = (subpixel[0] % SUBPIXEL_OFFSETS, subpixel[1] % SUBPIXEL_OFFSETS) if scale == 1.0 else (0, 0)
        key = (size, scale, offset, int(self._rolling.version[number]), view.camera.turned, bright)
        cached = self._sprites.get(number)
        if cached is None or cached[0] != key:
            rotation = self._rolling.turned[number]
            sprite = _sprite(self._textures[number], rotation, size, offset, view.camera, bright)
            if scale != 1.0:
                side = round(sprite.get_width() * scale)
                sprite = pygame.transform.smoothscale(sprite, (side, side))
            self._sprites[number] = cached = (key, sprite)
        half = math.ceil(size / 8.0) + 1
        if scale != 1.0:
            corner = centre[0] - half * scale, centre[1] - half * scale
        else:
            corner = subpixel[0] // SUBPIXEL_OFFSETS - half, subpixel[1] // SUBPIXEL_OFFSETS - half
        view.surface.blit(cached[1], (round(corner[0]), round(corner[1])))


def _sprite(
    texture: BallTexture, rotation: FloatArray, size: int, offset: tuple[int, int], camera: Camera, bright: float
) -> pygame.Surface:
    globe = _globe(size, offset)
    normal = globe.normal
    if camera.turned:  # +y is to the right, −x is up
        normal = np.stack((-normal[:, 1], normal[:, 0], normal[:, 2]), 1)
    colours = paint_texture(texture, normal @ rotation, size / 8.0)
    lit = np.clip((colours * globe.shade + globe.shine) * bright, 0.0, 255.0)
    parts = np.rint(lit).astype(np.uint32)
    pixels = np.zeros((globe.side, globe.side), np.uint32)
    alpha = np.rint(globe.cover * 255.0).astype(np.uint32)
    pixels[globe.inside] = alpha << 24 | parts[:, 0] << 16 | parts[:, 1] << 8 | parts[:, 2]
    return sdf_surface(pixels, encoded=False)


@lru_cache(maxsize=256)
def _globe(size: int, offset: tuple[int, int]) -> ShadedBall:
    """Return the shading of a sphere.

    Args:
        size: radius, in eighths of a pixel.
        offset: subpixel offset of the centre, in units of 1/`SUBPIXEL_OFFSETS` px.
    """
    radius = size / 8.0
    half = math.ceil(radius) + 1
    side = 2 * half + 1
    along = np.arange(side) + 0.5
    x = (along[:, None] - half - offset[0] / SUBPIXEL_OFFSETS) / radius
    y = -(along[None, :] - half - offset[1] / SUBPIXEL_OFFSETS) / radius
    distance = np.hypot(x, y)
    cover = np.clip((1.0 - distance) * radius + 0.5, 0.0, 1.0)
    inside = cover > 0.0
    shrink = np.minimum(1.0, 0.999 / np.maximum(distance, 1e-9))
    x, y = (np.broadcast_to(each, distance.shape)[inside] * shrink[inside] for each in (x, y))
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    normal = np.stack((x, y, z), 1)
    toward = normal @ np.asarray(LIGHT_DIRECTION)
    shade = 0.50 + 0.52 * np.clip(0.25 + 0.75 * toward, 0.0, 1.0) - 0.16 * (1.0 - z) ** 2
    half_way = np.asarray(LIGHT_DIRECTION) + np.asarray((0.0, 0.0, 1.0))
    mirror = np.clip(normal @ (half_way / np.linalg.norm(half_way)), 0.0, 1.0)
    shine = 150.0 * mirror**70 + 26.0 * mirror**8
    return ShadedBall(side, inside, normal, cover[inside], shade[:, None], shine[:, None])


@lru_cache(maxsize=64)
def _shadow(diameter: int) -> pygame.Surface:
    radius = diameter / 2.0
    half = math.ceil(radius * 1.35) + 1
    along = np.arange(2 * half) + 0.5 - half
    distance = np.hypot(along[:, None], along[None, :]) / radius
    depth = np.clip((1.3 - distance) / 0.6, 0.0, 1.0)
    dark = np.rint(SHADOW_ALPHA * depth * depth * (3.0 - 2.0 * depth)).astype(np.uint32)
    return sdf_surface(np.asarray(dark << 24, np.uint32), encoded=False)


def _rgb(colour: tuple[int, ...]) -> tuple[int, int, int]:
    red, green, blue = colour
    return red, green, blue
