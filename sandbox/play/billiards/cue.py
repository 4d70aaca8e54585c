"""Cue: how the next stroke would be."""

import math
from dataclasses import dataclass

from sandbox.scene.description.surface import MISCUE, Shot, Stroke

SLOWEST, FASTEST = 0.05, 10.0
"""m/s, of the cue: the least that is a stroke, and a hard break"""
EDGE = 0.999 * MISCUE
"""of the radius, how far from the middle the tip may be"""
USUAL = 2.5
"""m/s, with which a game begins"""


@dataclass
class Cue:
    """A cue behind a ball."""

    aim: float = 0.0
    """rad, from +x"""
    speed: float = USUAL
    """m/s, of the stroke that Space plays"""
    side: float = 0.0
    """of the radius, to the right"""
    height: float = 0.0
    """of the radius, above the middle"""
    back: float = 0.0
    """m, how far it is drawn back just now"""

    @classmethod
    def laid(cls, shot: Shot) -> "Cue":
        """Return a cue laid ready for a shot of the scene."""
        return cls(shot.aim, min(max(shot.speed, SLOWEST), FASTEST), shot.side, shot.height)

    @property
    def stroke(self) -> Stroke:
        """The stroke that it would play."""
        return Stroke(aim=self.aim, speed=self.speed, side=self.side, height=self.height)

    @property
    def power(self) -> float:
        """The speed as a share of the greatest."""
        return self.speed / FASTEST

    @power.setter
    def power(self, share: float) -> None:
        self.speed = min(max(share * FASTEST, SLOWEST), FASTEST)

    @property
    def way(self) -> tuple[float, float]:
        """Where it points, of length 1."""
        return math.cos(self.aim), math.sin(self.aim)

    def tip_at(self, side: float, height: float) -> None:
        """Set where the tip meets the ball, no farther out than it would hold."""
        off = math.hypot(side, height)
        share = min(1.0, EDGE / off) if off > 0.0 else 1.0
        self.side, self.height = side * share, height * share

    def centre(self) -> None:
        """Forget the english of the last stroke."""
        self.side = self.height = self.back = 0.0
