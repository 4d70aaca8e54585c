"""Fire: ways of shells, blasts, dirt in the air, and the wind."""

import math

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.play.artillery.gunnery import Burst, Clod, Gunnery
from sandbox.play.artillery.seen import BURST
from sandbox.play.drawing.artillery.dots import dot, glow
from sandbox.play.drawing.artillery.land import GRASS, soil_of
from sandbox.play.drawing.artillery.sky import sky
from sandbox.play.drawing.palette import BACKGROUND, INK, SKY, YELLOW, Colour, mixed
from sandbox.play.drawing.strokes import arrow, stroke
from sandbox.play.drawing.text import write
from sandbox.play.drawing.view import View

SMOKE: Colour = (214, 206, 200)
FLAME: tuple[Colour, ...] = ((255, 250, 222), (255, 204, 92), (238, 116, 48), (96, 62, 58))
"""From the beginning of a blast to its end."""
OUTSIDE = 1e4
"""px from a picture's corner, beyond which nothing is seen"""
FARTHEST = 400
"""Points of a way that are drawn."""


def draw_below(view: View, gunnery: Gunnery) -> None:
    """Draw what lies behind tanks: dirt in the air, the wind, ways."""
    for clod in gunnery.clods:
        _clod(view, clod)
    for way in gunnery.ways:
        _way(view, way, bool(gunnery.flying))
    if gunnery.tracer is not None:
        for x, y in view.camera.to_screen(gunnery.tracer[::4]).tolist():
            dot(view.surface, (x, y), 1.3 * view.unit, mixed(SKY, INK, 0.4))


def draw_above(view: View, gunnery: Gunnery) -> None:
    """Draw what lies in front of all: shells, blasts, where the last shot came down, and the wind."""
    frame = view.sight.frame
    for number in gunnery.flying:
        if number < len(frame.position) and frame.present[number]:
            x, y = view.camera.to_screen(frame.position[number]).tolist()
            glow(view.surface, (x, y), 7.0 * view.unit, (255, 190, 90), 90)
            dot(view.surface, (x, y), max(2.6 * view.unit, 2.0), (255, 246, 214))
    for burst in gunnery.bursts:
        _burst(view, burst)
    if gunnery.landed is not None and not gunnery.flying:
        _landed(view, gunnery.landed)
    if gunnery.wind is not None:
        _wind(view, gunnery.wind)


def _way(view: View, way: FloatArray, flying: bool) -> None:
    """Draw where a shell has been: the older the fainter, or, once it is over, thin all along."""
    points = way[:: max(len(way) // FARTHEST, 1)]
    places = view.camera.to_screen(np.vstack((points, way[-1:]))).tolist()
    for k in range(len(places) - 1):
        age = 1.0 - k / len(places)
        share = max(0.75 - age, 0.16) if flying else 0.22
        if not flying and k % 3 == 2:
            continue  # a way that is over is dotted
        colour = mixed((70, 72, 104), SMOKE, share)
        (ax, ay), (bx, by) = places[k], places[k + 1]
        stroke(view.surface, (ax, ay), (bx, by), colour, (1.0 + 1.4 * share) * view.unit, view.antialias)


def _clod(view: View, clod: Clod) -> None:
    """Draw a column of dirt that falls, and the air that it has left where it is to lie."""
    surface = view.surface
    ends = np.array([(clod.left, clod.top), (clod.right, clod.bottom), (clod.right, clod.floor)])
    places = np.clip(view.camera.to_screen(ends), -OUTSIDE, OUTSIDE)
    (left, top), (right, bottom), (_, floor) = places.tolist()
    lies = floor - (bottom - top)
    air = pygame.Rect(math.floor(left), math.floor(lies) - 4, math.ceil(right) - math.floor(left) + 1, 1)
    air.height = max(math.ceil(floor) - air.top, 1)
    air = air.clip(surface.get_rect())
    if air.width and air.height:
        surface.blit(sky(surface.get_size()), air.topleft, air)
    dirt = pygame.Rect(math.floor(left), math.floor(top), air.width, max(math.ceil(bottom) - math.floor(top), 1))
    dirt = dirt.clip(surface.get_rect())
    if dirt.width and dirt.height:
        soil = soil_of(view.sight.scene)
        surface.fill(mixed(soil, (0, 0, 0), 0.12), dirt)
        surface.fill(mixed(GRASS, soil, 0.4), pygame.Rect(dirt.left, dirt.top, dirt.width, min(2, dirt.height)))


def _burst(view: View, burst: Burst) -> None:
    """Draw a blast: a ball of fire that grows, cools, and thins out."""
    share = min(burst.age / BURST, 1.0)
    x, y = view.camera.to_screen(np.asarray(burst.place)).tolist()
    radius = burst.radius * view.camera.scale * (0.35 + 0.75 * share**0.4)
    tones = ((150, 118, 84), (120, 94, 70), (96, 78, 62), (80, 70, 62)) if burst.dirt else FLAME
    place = share * (len(tones) - 1)
    k = min(int(place), len(tones) - 2)
    colour = mixed(tones[k], tones[k + 1], place - k)
    for part, opacity in ((1.0, 0.45), (0.72, 0.6), (0.4, 0.8)):
        hidden = round(255 * opacity * (1.0 - share))
        glow(view.surface, (x, y), radius * part, mixed(colour, tones[0], 1.0 - part), hidden)


def _landed(view: View, landed: tuple[tuple[float, float], tuple[float, float]]) -> None:
    """Mark where the last shot came down, and, as a ring, where it would have exactly."""
    (x, y), (ex, ey) = view.camera.to_screen(np.asarray(landed)).tolist()
    if all(abs(each) < 1e4 for each in (x, y, ex, ey)):
        size = 4.0 * view.unit
        for sign in (-1.0, 1.0):
            stroke(view.surface, (x - size, y - sign * size), (x + size, y + sign * size), INK, 1.6 * view.unit)
        dot(view.surface, (ex, ey), 7.0 * view.unit, YELLOW, 1.4 * view.unit)


def _back(view: View, middle: tuple[float, float], size: tuple[float, float]) -> None:
    """Darken what lies behind words."""
    box = pygame.Rect(0, 0, round(size[0]), round(size[1]))
    shade = pygame.Surface(box.size, pygame.SRCALPHA)
    pygame.draw.rect(shade, (*BACKGROUND, 120), box, border_radius=round(6.0 * view.unit))
    box.center = round(middle[0]), round(middle[1])
    view.surface.blit(shade, box)


def _wind(view: View, wind: float) -> None:
    """Draw which way the wind blows, and how hard, at the left, below what is told of the run."""
    size = 13.0 * view.unit
    middle, top = 96.0 * view.unit, max(view.sight.below, 24.0 * view.unit) + 20.0 * view.unit
    half = min(max(7.0 * abs(wind), 8.0), 84.0) * view.unit
    told = f"wind {abs(wind):.1f} m/s" if wind else "no wind"
    _back(view, (middle, top + 7.0 * view.unit), (172.0 * view.unit, 44.0 * view.unit))
    write(view.surface, told, (middle + 1, top + 9 * view.unit + 1), size, BACKGROUND, "midtop", bold=True)
    write(view.surface, told, (middle, top + 9 * view.unit), size, INK, "midtop", bold=True)
    if wind:
        ends = (middle - half, top), (middle + half, top)
        begin, end = ends if wind > 0 else ends[::-1]
        arrow(view.surface, begin, end, mixed(SKY, INK, 0.35), 4.0 * view.unit, view.antialias, edge=BACKGROUND)
