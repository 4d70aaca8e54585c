"""Sheet: where one player stands."""

from dataclasses import dataclass, field

BALLS = 3
"""of a game"""

MOST = 6
"""times that a bonus counts"""


@dataclass
class Sheet:
    """What a player has."""

    score: int = 0
    ball: int = 1
    """which is played, from 1; one more than there are once all were played"""
    again: int = 0
    """how often the player shoots again"""
    bonus: int = 0
    """points that are counted at the end of the ball"""
    times: int = 1
    """how often the bonus counts"""
    locked: int = 0
    """balls waiting for multiball"""
    lit: bool = False
    """whether the next ball in the lock counts"""
    modes: int = 0
    """how many were begun"""
    had: set[str] = field(default_factory=set)
    """reasons for which an extra ball was given"""

    @property
    def done(self) -> bool:
        """Whether all balls were played."""
        return self.ball > BALLS

    def ended(self) -> None:
        """Go on to the next ball, or shoot again."""
        if self.again:
            self.again -= 1
        else:
            self.ball += 1
        self.bonus, self.times = 0, 1
