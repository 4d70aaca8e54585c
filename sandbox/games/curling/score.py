"""Score: how a match stands, end by end. The hammer, the last stone of an end, goes to the team that did not score."""

from typing import NamedTuple

from sandbox.games.curling.sheet import STONES, TEAMS


class Score(NamedTuple):
    """How a match stands."""

    ends: int
    """that are to be played; more where it is even then"""
    points: tuple[int, int] = (0, 0)
    played: int = 0
    """ends"""
    hammer: int = 1
    """the team that throws last in the present end"""
    thrown: int = 0
    """stones of the present end"""

    @property
    def team(self) -> int:
        """Whose turn it is: the team without the hammer begins."""
        return (1 - self.hammer + self.thrown) % 2

    @property
    def number(self) -> int:
        """Which of its stones that team throws, from 0."""
        return self.thrown // 2

    @property
    def full(self) -> bool:
        """Whether all stones of the end have been thrown."""
        return self.thrown == 2 * STONES

    @property
    def over(self) -> str | None:
        """Why the match is over; None while it goes on."""
        red, yellow = self.points
        if self.played < self.ends or red == yellow:
            return None
        return f"{TEAMS[yellow > red]} wins {max(red, yellow)} : {min(red, yellow)}"

    def after_stone(self) -> "Score":
        """Return the score after one more stone."""
        return self._replace(thrown=self.thrown + 1)

    def after_end(self, team: int | None, points: int) -> "Score":
        """Return the score after an end that a team has won, or nobody."""
        red, yellow = self.points
        total = (red + points * (team == 0), yellow + points * (team == 1))
        hammer = self.hammer if team is None else 1 - team
        return self._replace(points=total, played=self.played + 1, hammer=hammer, thrown=0)
