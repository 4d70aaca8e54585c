"""Drop targets: a bank of targets that drop when they are hit, and rise together once all are down."""

from collections.abc import Iterator
from itertools import pairwise

from sandbox.action import Toggle
from sandbox.games.pinball.events import Award, Device, Effect, Hit, Light, PlaySound, StepContext, points_of
from sandbox.games.pinball.playfield import Playfield, PlayfieldElement
from sandbox.scene.geometry.vectors import nearest_on_segment

FALL_TIME = 0.26
"""s, time that a target takes to drop. Source: Visual Pinball, 60 units at its default drop speed"""

REST_TIME = 1.5
"""s for which a completed bank stays down"""

BANK_POINTS = 25_000
"""points of a completed bank"""

BANK_BONUS, TARGET_BONUS = 3_000, 200
"""points added to the bonus by a completed bank, and by a target"""


class DropTargetBanks(Device):
    """One bank. A target scores when it is hit, and remains solid until it is down."""

    def __init__(self, board: Playfield, group: str | None, members: tuple[PlayfieldElement, ...]) -> None:
        self.board, self.group, self.members = board, group, members
        self.falling: dict[int, float] = {}
        """index of a target → time at which it is down, s"""
        self.down: set[int] = set()
        self.rise: float | None = None
        """s, time at which the bank rises, if no ball is above a target; None if it is not due"""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Drop a target."""
        index = next((k for k, each in enumerate(self.members) if each is hit.element), None)
        if index is None or index in self.down or index in self.falling:
            return
        self.falling[index] = hit.time + FALL_TIME
        yield PlaySound("drop")
        yield Award("drop", points_of(hit), self.group, TARGET_BONUS, hit.ball)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Make dropped targets passable, award a completed bank, and raise it when its time has come."""
        for index in sorted(k for k, when in self.falling.items() if when <= now.time):
            del self.falling[index]
            self.down.add(index)
            yield Toggle(time=now.time, thing=self.members[index].name, solid=False)
            if len(self.down) == len(self.members):
                self.rise = now.time + REST_TIME
                yield PlaySound("bank")
                yield Award("bank", BANK_POINTS, self.group, BANK_BONUS)
        if self.rise is not None and now.time >= self.rise:
            yield from self.raise_targets(now)

    def raise_targets(self, now: StepContext) -> Iterator[Effect]:
        """Raise the targets that are down; if a ball is above one of them, try again at the next step."""
        if any(self._covers(index, ball, now) for index in self.down for ball in now.balls_in_play):
            self.rise = now.time
            return
        self.rise = None
        if self.down:
            yield PlaySound("raise")
        for index in sorted(self.down):
            yield Toggle(time=now.time, thing=self.members[index].name, solid=True)
        self.down.clear()

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Raise the targets that are down or dropping, for a new ball."""
        for index in sorted(self.falling):
            self.down.add(index)
        self.falling.clear()
        yield from self.raise_targets(now)

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Return the lamps of the targets that are down or dropping; those of a completed bank blink until it rises."""
        full = len(self.down) == len(self.members)
        return (Light(self.members[index].name, full) for index in sorted({*self.down, *self.falling}))

    def _covers(self, index: int, ball: int, now: StepContext) -> bool:
        """Return whether a ball overlaps the position of a target."""
        x, y = now.frame.position[ball].tolist()
        target = self.members[index]
        clearance = self.board.radius + target.reach
        return any(nearest_on_segment((x, y), a, b)[1] < clearance for a, b in pairwise(target.outline))


def banks_of(board: Playfield) -> tuple[DropTargetBanks, ...]:
    """Return the banks of a table; a target without a group is a bank of one."""
    alone = tuple(each for each in board.of_role("drop") if each.group is None)
    groups = [DropTargetBanks(board, name, members) for name, members in board.groups("drop").items()]
    return (*groups, *(DropTargetBanks(board, None, (each,)) for each in alone))
