"""Tip: the ball as the player sees it, with where the tip meets it; and the power of the stroke."""

import math

import pygame

from sandbox.play.billiards.cue import FASTEST, Cue
from sandbox.play.drawing.palette import FAINT, INK, LINE, ORANGE, PANEL, SKY, VERMILION, mixed
from sandbox.play.drawing.shade import Look, disc_distance, paint
from sandbox.play.drawing.table.coats import IVORY
from sandbox.play.drawing.text import write
from sandbox.play.instruments.plates import plate
from sandbox.scene.description.surface import MISCUE

TIP = 0.22
"""of the ball's radius, the tip's"""
MARKS = 5
"""on the power's scale"""


def draw_tip(surface: pygame.Surface, rect: pygame.Rect, cue: Cue, unit: float) -> None:
    """Draw the ball, the circle beyond which a tip slips, and the tip's mark."""
    (x, y), radius = (rect.centerx, rect.centery), rect.width / 2.0
    plate(surface, plate_of(rect, unit), 10 * unit, opacity=170)
    _disc(surface, (x, y), radius, Look(IVORY, mixed(IVORY, PANEL, 0.45), 1.5 * unit))
    faint = mixed(IVORY, PANEL, 0.28)
    for a, b in (((x - radius, y), (x + radius, y)), ((x, y - radius), (x, y + radius))):
        pygame.draw.line(surface, faint, a, b)
    for k in range(36):  # dashes
        if k % 2 == 0:
            turns = [math.tau * (k + part / 3.0) / 36.0 for part in range(4)]
            points = [(x + MISCUE * radius * math.cos(t), y + MISCUE * radius * math.sin(t)) for t in turns]
            pygame.draw.aalines(surface, mixed(IVORY, VERMILION, 0.75), False, points)
    at = x + cue.side * radius, y - cue.height * radius
    _disc(surface, at, TIP * radius, Look(SKY, mixed(SKY, PANEL, 0.6), 1.5 * unit, opacity=0.95))
    if cue.side or cue.height:
        text = f"{cue.side:+.2f}  {cue.height:+.2f}"
        write(surface, text, (x, rect.top - 8 * unit), 11 * unit, FAINT, "midbottom", mono=True)


def plate_of(rect: pygame.Rect, unit: float) -> pygame.Rect:
    """Return what a dial covers with its plate."""
    return rect.inflate(round(10 * unit), round(10 * unit))


def draw_power(surface: pygame.Surface, rect: pygame.Rect, cue: Cue, unit: float) -> None:
    """Draw the power as a bar, with the speed of the cue above it."""
    plate(surface, plate_of(rect, unit), 10 * unit, opacity=170)
    round_off = round(0.3 * rect.width)
    pygame.draw.rect(surface, LINE, rect, border_radius=round_off)
    high = max(round(rect.height * cue.power), 2)
    full = pygame.Rect(rect.left, rect.bottom - high, rect.width, high)
    pygame.draw.rect(surface, mixed(SKY, ORANGE, cue.power), full, border_radius=min(round_off, high // 2))
    for k in range(1, MARKS):
        level = rect.bottom - rect.height * k / MARKS
        pygame.draw.line(surface, PANEL, (rect.left, level), (rect.left + rect.width // 3, level))
    shown = f"{cue.power * FASTEST:.1f}"
    write(surface, shown, (rect.centerx, rect.top - 8 * unit), 11 * unit, INK, "midbottom", mono=True)


def _disc(surface: pygame.Surface, at: tuple[float, float], radius: float, look: Look) -> None:
    side = math.ceil(radius) + 2
    within = pygame.Rect(math.floor(at[0]) - side, math.floor(at[1]) - side, 2 * side + 1, 2 * side + 1)
    paint(surface, disc_distance(*at, radius), look, within)
