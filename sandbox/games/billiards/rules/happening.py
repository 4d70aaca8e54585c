"""What rules see of one shot: who touched whom, by names, in time."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal


class GameError(ValueError):
    """What no game can take; `str()` says why. The state is as it was."""


@dataclass(frozen=True)
class Happening:
    """A ball touched a ball or a cushion, or fell into a pocket.

    A cushion is a wall or a jaw. One that a ball is frozen to when the shot begins counts only once the ball has left
    it and come back (WPA 8.4); so does a ball that the cue ball touches from the start.
    """

    time: float
    """s, of the shot"""
    ball: str
    kind: Literal["ball", "cushion", "pocket"]
    other: str
    """the name of the ball, cushion or pocket"""


@dataclass(frozen=True)
class Shot:
    """A shot as rules ask about it."""

    cue: str
    happenings: tuple[Happening, ...]
    """in order of time"""
    first: tuple[str, ...]
    """what the cue ball touched first: several, where it touched them at one time"""
    fell: tuple[tuple[str, str], ...]
    """balls and their pockets, in order of time, the cue ball too"""
    driven: frozenset[str]
    """balls that came to a cushion or fell once the cue ball had touched one"""
    stayed_behind: bool = False
    """whether a cue ball in hand behind the head string first touched a ball there without having crossed it"""

    @property
    def scratched(self) -> bool:
        """Whether the cue ball fell."""
        return any(ball == self.cue for ball, _ in self.fell)

    @property
    def down(self) -> tuple[str, ...]:
        """The object balls that fell, in order of time."""
        return tuple(ball for ball, _ in self.fell if ball != self.cue)

    def pocket_of(self, ball: str) -> str | None:
        """Return the pocket into which a ball fell."""
        return dict(self.fell).get(ball)


def read(happenings: Iterable[Happening], cue: str, table: tuple[str, ...], stayed_behind: bool = False) -> Shot:
    """Read a shot.

    Args:
        happenings: in any order.
        cue: the ball that was struck.
        table: the other balls on the table.
        stayed_behind: as in `Shot`.

    Raises:
        GameError: a happening names a ball that is not on the table.
    """
    ordered = tuple(sorted(happenings, key=lambda each: each.time))
    here = {cue, *table}
    named = {each.ball for each in ordered} | {each.other for each in ordered if each.kind == "ball"}
    if not named <= here:
        raise GameError(f"not on the table: {', '.join(sorted(named - here))}")
    touches = [(each.time, touched) for each in ordered if (touched := touched_by(cue, each)) is not None]
    start = touches[0][0] if touches else float("inf")
    first = tuple(dict.fromkeys(ball for time, ball in touches if time == start))
    fell: dict[str, str] = {}
    for each in ordered:
        if each.kind == "pocket":
            fell.setdefault(each.ball, each.other)
    driven = frozenset(each.ball for each in ordered if each.kind != "ball" and each.time >= start)
    return Shot(cue, ordered, first, tuple(fell.items()), driven, stayed_behind)


def touched_by(cue: str, each: Happening) -> str | None:
    """Return the ball that a cue ball touched in a happening, whichever of the two it names first."""
    if each.kind != "ball" or cue not in (each.ball, each.other) or each.ball == each.other:
        return None
    return each.other if each.ball == cue else each.ball


def named_first(shot: Shot) -> str:
    """Return what the cue ball touched first as the beginning of a sentence."""
    return f"the {' and the '.join(shot.first)} {'was' if len(shot.first) == 1 else 'were'}"
