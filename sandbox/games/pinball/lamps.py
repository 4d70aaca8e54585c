"""Lamps: sets of lights, each lit by its own switch; a set that is full scores and goes dark."""

from collections.abc import Iterator

from sandbox.games.pinball.board import Board, Element
from sandbox.games.pinball.effects import Again, Award, Cue, Effect, Light, Machine, Now, Say
from sandbox.games.pinball.sheet import MOST
from sandbox.games.pinball.switches import Hit
from sandbox.scene.description.play import Role

FULL: dict[Role, int] = {"rollover": 10_000, "standup": 20_000}
"""points of a set"""

NEWS: dict[Role, str] = {"rollover": "lanes", "standup": "standups"}
"""what a full set is called"""

BONUS = 2_000

AGAIN = 4
"""times that the bonus counts, with which an extra ball comes"""

LEAST: dict[Role, int] = {"rollover": 3, "standup": 2}
"""of a set: a pair of rollovers is of inlanes or outlanes, which have no lamps"""


class Lamps(Machine):
    """The lights of one group of rollovers or standing targets.

    A full set of lanes counts the bonus once more. Before a ball rolls over a lane, the flippers move the lights: the
    left one to the left, the right one to the right, around the ends.
    """

    def __init__(self, group: str, members: tuple[Element, ...]) -> None:
        self.group = group
        self.role = members[0].role
        self.names = tuple(each.name for each in members)
        self.lit = [False] * len(members)

    def hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        """Light what was hit."""
        if hit.element.name not in self.names:
            return
        place = self.names.index(hit.element.name)
        if self.lit[place]:
            return
        self.lit[place] = True
        yield Cue("lit")
        if not all(self.lit):
            return
        self.lit = [False] * len(self.lit)
        if self.role == "rollover" and now.sheet.times < MOST:
            now.sheet.times += 1
            yield Say(f"bonus × {now.sheet.times}")
            if now.sheet.times == AGAIN:
                yield Again("lanes")
        yield Cue("set")
        yield Award(NEWS[self.role], FULL[self.role], self.group, BONUS, hit.ball)

    def rotate(self, side: str) -> None:
        """Move the lights of lanes by one, to the side of the flipper that was raised."""
        if self.role == "rollover":
            by = 1 if side == "left" else -1
            self.lit = self.lit[by:] + self.lit[:by]

    def begin(self, now: Now) -> Iterator[Effect]:
        """Darken everything."""
        self.lit = [False] * len(self.lit)
        return iter(())

    def lights(self, now: Now) -> Iterator[Light]:
        """Show what was hit."""
        return (Light(name) for name, on in zip(self.names, self.lit, strict=True) if on)


def lamps_of(board: Board) -> tuple[Lamps, ...]:
    """Return the sets of a table; what stands alone has no lamp."""
    return tuple(
        Lamps(name, members)
        for role, least in LEAST.items()
        for name, members in board.groups(role).items()
        if len(members) >= least
    )
