"""Drops: a bank of targets that fall when they are hit, and rise together once all are down."""

import math
from collections.abc import Iterator
from itertools import pairwise

from sandbox.action import Toggle
from sandbox.games.pinball.events import Award, Device, Effect, Hit, Light, PlaySound, StepContext, points_of
from sandbox.games.pinball.playfield import Playfield, PlayfieldElement
from sandbox.scene.description.base import Point

FALL = 0.26
"""s, that a target takes to fall. Source: Visual Pinball, 60 units at its default drop speed"""

REST = 1.5
"""s, that a full bank stays down"""

FULL = 25_000
"""points of a bank"""

BONUS, EACH = 3_000, 200
"""points of the bonus for a bank, and for a target"""


class DropTargetBanks(Device):
    """One bank. A target that has been hit counts at once, and is in the way until it is down."""

    def __init__(self, board: Playfield, group: str | None, members: tuple[PlayfieldElement, ...]) -> None:
        self.board, self.group, self.members = board, group, members
        self.falling: dict[int, float] = {}
        """place of a target → when it will be down, s"""
        self.down: set[int] = set()
        self.rise: float | None = None
        """when the bank rises, s, if nothing lies on it"""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Let a target fall."""
        place = next((k for k, each in enumerate(self.members) if each is hit.element), None)
        if place is None or place in self.down or place in self.falling:
            return
        self.falling[place] = hit.time + FALL
        yield PlaySound("drop")
        yield Award("drop", points_of(hit), self.group, EACH, hit.ball)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Take fallen targets out of the way; raise a full bank."""
        for place in sorted(k for k, when in self.falling.items() if when <= now.time):
            del self.falling[place]
            self.down.add(place)
            yield Toggle(time=now.time, thing=self.members[place].name, solid=False)
            if len(self.down) == len(self.members):
                self.rise = now.time + REST
                yield PlaySound("bank")
                yield Award("bank", FULL, self.group, BONUS)
        if self.rise is not None and now.time >= self.rise:
            yield from self.raised(now)

    def raised(self, now: StepContext) -> Iterator[Effect]:
        """Raise what is down, unless a ball lies there: then later."""
        if any(self._covers(place, ball, now) for place in self.down for ball in now.live):
            self.rise = now.time
            return
        self.rise = None
        if self.down:
            yield PlaySound("raise")
        for place in sorted(self.down):
            yield Toggle(time=now.time, thing=self.members[place].name, solid=True)
        self.down.clear()

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Raise the bank for a new ball, also where it was not full."""
        for place in sorted(self.falling):
            self.down.add(place)
        self.falling.clear()
        yield from self.raised(now)

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Show which targets are down; a full bank blinks until it rises."""
        full = len(self.down) == len(self.members)
        return (Light(self.members[place].name, full) for place in sorted({*self.down, *self.falling}))

    def _covers(self, place: int, ball: int, now: StepContext) -> bool:
        """Tell whether a ball lies where a target would rise."""
        x, y = now.frame.position[ball].tolist()
        target = self.members[place]
        room = self.board.radius + target.reach
        return any(_distance((x, y), a, b) < room for a, b in pairwise(target.outline))


def _distance(point: Point, a: Point, b: Point) -> float:
    """Return how far a point is from a segment, m."""
    along = (b[0] - a[0], b[1] - a[1])
    length = along[0] ** 2 + along[1] ** 2
    fraction = ((point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1]) / length if length else 0.0
    fraction = min(max(fraction, 0.0), 1.0)
    return math.hypot(point[0] - a[0] - fraction * along[0], point[1] - a[1] - fraction * along[1])


def banks_of(board: Playfield) -> tuple[DropTargetBanks, ...]:
    """Return the banks of a table; a target without a group is one of its own."""
    alone = tuple(each for each in board.of_role("drop") if each.group is None)
    groups = [DropTargetBanks(board, name, members) for name, members in board.groups("drop").items()]
    return (*groups, *(DropTargetBanks(board, None, (each,)) for each in alone))
