"""Guns: tanks with their barrels, names and health, and how the one is set whose turn it is."""

import math

import numpy as np
import pygame

from sandbox.play.artillery.gunnery import Gun, Gunnery
from sandbox.play.drawing.artillery.dots import FARTHEST, dot
from sandbox.play.drawing.palette import BACKGROUND, GREEN, INK, ORANGE, WARNING, YELLOW, Colour, mixed
from sandbox.play.drawing.strokes import Pixel, fill, stroke
from sandbox.play.drawing.text import write
from sandbox.play.drawing.view import View

BARREL = 0.75
"""of a tank's width, from its middle to the muzzle"""
LEAST = 20.0
"""px, of a tank's width: farther off it is drawn larger than it is"""
HULL = ((-0.50, -0.02), (-0.42, 0.18), (-0.20, 0.24), (0.20, 0.24), (0.42, 0.18), (0.50, -0.02))
"""Corners, in widths and heights from the middle."""
REACH = 26.0
"""m, of the dots ahead of the muzzle at full power"""


def draw_guns(view: View, gunnery: Gunnery, tints: dict[int, Colour]) -> None:
    """Draw all tanks that are in sight; `tints` are their colours by their bodies' numbers."""
    frame = view.sight.frame
    for gun in gunnery.guns:
        if gun.number >= len(frame.position) or not frame.present[gun.number]:
            continue
        x, y = view.camera.to_screen(frame.position[gun.number]).tolist()
        width = max(gunnery.size[0] * view.camera.scale, LEAST * view.unit)
        if not (abs(x) < FARTHEST and abs(y) < FARTHEST and width < FARTHEST):
            continue
        height = width * gunnery.size[1] / gunnery.size[0]
        lift = 0.5 * (height - gunnery.size[1] * view.camera.scale)  # what is drawn larger stands where it stands
        _Tank(view, (x, y - lift), (width, height), -float(frame.angle[gun.number]), tints[gun.number]).draw(gun)
        if gun.aiming:
            _setting(view, gunnery, gun, (x, y - lift), width)
        _label(view, gun, (x, y - lift - 1.1 * width), tints[gun.number])


class _Tank:
    """Draws one tank, whose middle lies at a pixel."""

    def __init__(self, view: View, at: Pixel, size: Pixel, turn: float, tint: Colour) -> None:
        self._view, self._at, self._size, self._tint = view, at, size, tint
        self._cos, self._sin = math.cos(turn), math.sin(turn)

    def _place(self, x: float, y: float) -> Pixel:
        """Return where a point lies, in widths to the right and heights upwards of a tank that stands upright."""
        right, down = x * self._size[0], -y * self._size[1]
        return (
            self._at[0] + self._cos * right - self._sin * down,
            self._at[1] + self._sin * right + self._cos * down,
        )

    def draw(self, gun: Gun) -> None:
        """Draw barrel, turret, hull, track and wheels, from the back to the front."""
        view, tint, width = self._view, self._tint, self._size[0]
        dark, light = mixed(tint, BACKGROUND, 0.55), mixed(tint, INK, 0.35)
        turret = self._place(0.0, 0.28)
        way = math.cos(gun.angle), -math.sin(gun.angle)
        muzzle = turret[0] + BARREL * width * way[0], turret[1] + BARREL * width * way[1]
        thick = max(0.10 * width, 2.0)
        stroke(view.surface, turret, muzzle, mixed(dark, BACKGROUND, 0.4), thick + 2.0 * view.unit, view.antialias)
        stroke(view.surface, turret, muzzle, mixed(tint, (90, 94, 104), 0.5), thick, view.antialias)
        brake = turret[0] + 0.86 * BARREL * width * way[0], turret[1] + 0.86 * BARREL * width * way[1]
        stroke(view.surface, brake, muzzle, light, thick + 1.0, view.antialias)
        dome = [
            self._place(0.21 * math.cos(a), 0.22 + 0.40 * math.sin(a)) for a in np.linspace(0.0, math.pi, 14).tolist()
        ]
        fill(view.surface, dome, mixed(tint, INK, 0.12), view.antialias)
        fill(view.surface, [self._place(x, y) for x, y in HULL], tint, view.antialias)
        stroke(view.surface, self._place(-0.40, 0.16), self._place(0.40, 0.16), light, 1.2 * view.unit, view.antialias)
        track = [
            self._place(x + 0.16 * math.cos(a), -0.24 + 0.26 * math.sin(a))
            for x, begin in ((0.34, -0.5), (-0.34, 0.5))
            for a in np.linspace(begin * math.pi, (begin + 1.0) * math.pi, 8).tolist()
        ]
        fill(view.surface, track, (32, 32, 38), view.antialias)
        for x in (-0.32, -0.11, 0.11, 0.32):
            dot(view.surface, self._place(x, -0.24), 0.075 * width, mixed(dark, INK, 0.25))


def _setting(view: View, gunnery: Gunnery, gun: Gun, at: Pixel, width: float) -> None:
    """Draw where the gun points, and how far its power goes: dots, and a bar below the tank."""
    turret = at[0], at[1] - 0.28 * width * gunnery.size[1] / gunnery.size[0]
    way = math.cos(gun.angle), -math.sin(gun.angle)
    reach = max(REACH * view.camera.scale, 90.0 * view.unit)
    first, count = BARREL * width + 6.0 * view.unit, 14
    for k in range(count):
        share = (k + 1) / count
        lit = share <= gun.power + 0.5 / count
        far = first + share * reach
        colour = mixed(YELLOW, ORANGE, share) if lit else (150, 150, 164)
        size = (2.6 if lit else 1.4) * view.unit
        dot(view.surface, (turret[0] + far * way[0], turret[1] + far * way[1]), size, colour)
    wide, high = 64.0 * view.unit, 7.0 * view.unit
    box = pygame.Rect(round(at[0] - 0.5 * wide), round(at[1] + 0.42 * width), round(wide), round(high))
    pygame.draw.rect(view.surface, BACKGROUND, box.inflate(4, 4), border_radius=round(high))
    full = pygame.Rect(box.left, box.top, round(box.width * gun.power), box.height)
    pygame.draw.rect(view.surface, mixed(YELLOW, ORANGE, gun.power), full, border_radius=round(0.5 * high))
    told = f"{math.degrees(gun.angle):.1f}°   {100.0 * gun.power:.1f} %"
    write(view.surface, told, (box.centerx, box.bottom + 4 * view.unit), 12 * view.unit, INK, "midtop", bold=True)


def _label(view: View, gun: Gun, at: Pixel, tint: Colour) -> None:
    """Write a name, and draw what health is left under it."""
    wide, high = 44.0 * view.unit, 4.0 * view.unit
    box = pygame.Rect(round(at[0] - 0.5 * wide), round(at[1] - high), round(wide), round(high))
    if gun.health is not None:
        pygame.draw.rect(view.surface, BACKGROUND, box.inflate(3, 3), border_radius=3)
        colour = mixed(WARNING, GREEN, gun.health)
        pygame.draw.rect(view.surface, colour, pygame.Rect(box.topleft, (round(box.width * gun.health), box.height)))
    size = 13.0 * view.unit
    name = mixed(tint, INK, 0.45)
    write(view.surface, gun.name, (at[0] + 1, box.top - 2 * view.unit + 1), size, BACKGROUND, "midbottom", bold=True)
    write(view.surface, gun.name, (at[0], box.top - 2 * view.unit), size, name, "midbottom", bold=True)
