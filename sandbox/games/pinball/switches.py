"""Switches: the hits in what an engine noted of a step, each told once."""

import math
from typing import NamedTuple

from sandbox.games.pinball.board import Board, Element
from sandbox.games.rules import Seen

LOOKS = 2
"""In so many looks from its first touch a hit gives its impulse: one, or two where it spans the end of a step. What
comes later is the weight of a ball that leans."""


class Hit(NamedTuple):
    """A switch that closed."""

    time: float
    """s"""
    ball: int
    """number of the body"""
    element: Element
    speed: float
    """of the ball, after the step, m/s"""


class Touch(NamedTuple):
    """A contact that has been seen: how often, and what it has given, as impulse over mass along its normal, m/s."""

    looks: int
    given: float
    told: bool


class Switches:
    """Reads hits. A contact is known by its first touch and its pair, as engines tell one that lasts again.

    Whether a struck switch closes is a matter of the speed v with which the ball came, which neither frame shows: a
    ball may meet three things in one step. The contact's impulse does: J/m = (1 + e)·v, and more where the thing
    kicks, but a thing kicks only above its threshold. So the switch closes where J/m exceeds (1 + e) times its own.
    """

    def __init__(self, board: Board) -> None:
        self._board = board
        self._open: dict[tuple[float, int, int], Touch] = {}

    def read(self, seen: Seen) -> list[Hit]:
        """Return the switches that closed since the last look, in the order of their first touch."""
        now: dict[tuple[float, int, int], Touch] = {}
        hits = []
        for time, (first, second), _, normal, impulse in seen.contacts:
            element = self._board.switches.get(second)
            mass = self._board.mass.get(first)
            if element is None or mass is None:
                continue
            key = (time, first, second)
            touch = now.get(key) or self._open.get(key) or Touch(0, 0.0, False)
            given = touch.given + (impulse[0] * normal[0] + impulse[1] * normal[1]) / mass
            closes = not touch.told and touch.looks < LOOKS and (not element.least or given > element.least)
            now[key] = Touch(touch.looks + 1, given, touch.told or closes)
            if closes:
                hits.append(Hit(time, first, element, math.hypot(*seen.frame.velocity[first].tolist())))
        self._open = now
        return hits
