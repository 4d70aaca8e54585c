"""Cue keys: what a table claims of the keyboard."""

from collections.abc import Callable
from functools import partial

import pygame

from sandbox.play.billiards.gestures import Gestures, Mode
from sandbox.play.running.live import Live

Deed = Callable[[Live], object]

TURN, FINER = 0.002, 0.0001
"""rad that an arrow key turns the cue, and with Shift"""
POWER = 0.02
"""of the greatest, that an arrow key adds"""

TOLD = (
    ("Mouse", "aim; Shift: fine"),
    ("Left or Right", "fine aim; Shift: finer"),
    ("Up or Down", "power"),
    ("S (hold)", "stroke: pull back, push forward"),
    ("Left-drag", "draw the cue back, release"),
    ("E (hold)", "english: where the tip hits"),
    ("X (hold)", "set the power"),
    ("Space", "shoot"),
    ("G", "cue ball in hand"),
    ("Z", "undo shot"),
    ("Click", "call a ball, or a pocket"),
    ("C", "call a safety"),
    ("D", "next choice, if any"),
    ("Enter", "confirm the choice"),
)
"""as help lists them"""


def deeds(gestures: Gestures) -> tuple[dict[int, Deed], dict[int, Deed]]:
    """Return what keys do, and what is done when they are let go."""
    game, person = gestures.game, gestures.person
    pressed: dict[int, Deed] = {
        pygame.K_SPACE: lambda _: person.shoot(),
        pygame.K_g: lambda _: person.take_in_hand(),
        pygame.K_z: lambda _: game.undo(),
        pygame.K_LEFT: lambda _: gestures.nudge(_step()),
        pygame.K_RIGHT: lambda _: gestures.nudge(-_step()),
        pygame.K_UP: lambda _: gestures.strengthen(POWER),
        pygame.K_DOWN: lambda _: gestures.strengthen(-POWER),
        pygame.K_c: lambda _: person.call_safety(),
        pygame.K_d: lambda _: person.choose_next(),
        pygame.K_RETURN: lambda _: person.take_choice(),
    }
    released: dict[int, Deed] = {}
    modes: tuple[tuple[int, Mode], ...] = (
        (pygame.K_s, "stroke"),
        (pygame.K_e, "english"),
        (pygame.K_x, "power"),
    )
    for key, mode in modes:
        pressed[key] = partial(_begin, gestures=gestures, mode=mode)
        released[key] = partial(_end, gestures=gestures)
    return pressed, released


def _begin(_: Live, gestures: Gestures, mode: Mode) -> None:
    gestures.begin(mode)


def _end(_: Live, gestures: Gestures) -> None:
    gestures.end()


def _step() -> float:
    return FINER if pygame.key.get_mods() & pygame.KMOD_SHIFT else TURN
