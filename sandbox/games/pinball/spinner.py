"""Spinner: a hanging plate that a ball sets turning as it passes; each turn counts."""

import math
from collections.abc import Iterator

from sandbox.games.pinball.board import Element
from sandbox.games.pinball.effects import POINTS, Award, Cue, Effect, Machine, Now
from sandbox.games.pinball.switches import Hit

PLATE = 0.018
"""m, from the axis to the edge that the ball carries along"""

DECAY = -math.log(0.9879) / 0.01
"""1/s: the speed falls by this share of itself. Source: Visual Pinball's default damping, .9879 every 10 ms."""

LEAST = 4.0
"""rad/s: a slower plate does not get over the top again"""


class Spinner(Machine):
    """A plate with its angle and speed.

    A ball that passes with v carries the edge along: Ω = v/r, unless it turns faster already. Then Ω falls as exp(−kt)
    and the plate has turned by Ω₀/k·(1 − exp(−kt)); what it was when a turn was full scores, one by one, in time.
    """

    def __init__(self, element: Element) -> None:
        self.element = element
        self.speed = 0.0
        """rad/s"""
        self.angle = 0.0
        """rad, since the last full turn"""
        self.time = 0.0
        """of both, s"""

    def hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        """Set the plate turning."""
        if hit.element is self.element:
            yield from self._turned(hit.time)
            self.speed = max(self.speed, hit.speed / PLATE)

    def tick(self, now: Now) -> Iterator[Effect]:
        """Score the turns until now."""
        yield from self._turned(now.time)

    def _turned(self, time: float) -> Iterator[Effect]:
        passed, self.time = time - self.time, max(time, self.time)
        if not self.speed or passed <= 0.0:
            return
        left = self.speed * math.exp(-DECAY * passed)
        self.angle += (self.speed - left) / DECAY
        self.speed = left
        while self.angle >= 2.0 * math.pi:
            self.angle -= 2.0 * math.pi
            yield Cue("spinner")
            yield Award("spinner", self.element.score or POINTS["spinner"], self.element.group, 10)
        if self.speed < LEAST:
            self.speed = self.angle = 0.0
