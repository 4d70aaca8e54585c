"""Trough: where balls are while they are out of play, and how they come back.

Search: what a table does when it has not heard of its ball for too long.
"""

import math
from collections.abc import Iterator

from sandbox.action import Drive, Impulse, Move
from sandbox.games.pinball.devices import CoilVariation, Kickers
from sandbox.games.pinball.drop_targets import DropTargetBanks
from sandbox.games.pinball.events import (
    BallSave,
    Device,
    Effect,
    Hit,
    PlaySound,
    RemoveBall,
    ServeBalls,
    ShowMessage,
    StepContext,
)
from sandbox.games.pinball.playfield import Playfield
from sandbox.scene.random_streams import Stream, draws
from sandbox.trajectory import Frame

GAP = 0.7
"""s, at least, between two balls that are served"""

STUCK = 2.0
"""s, that a ball which was to fly by itself may lie in the lane"""

SLOW = 0.05
"""m/s, below which a ball lies"""


class Trough:
    """Every ball of the table: in play or not, and the queue of those to come."""

    def __init__(self, board: Playfield) -> None:
        self.board = board
        self.live: list[int] = []
        self.idle: list[int] = list(board.balls)
        """those out of play, the next to be served first"""
        self.home: dict[int, int] = {ball: k for k, ball in enumerate(board.balls[1:])}
        """ball → the place where it lies; one without a place lies in the lane"""
        self.queue: list[bool] = []
        """balls to be served, and whether each flies by itself"""
        self.flown: set[int] = set()
        """balls that were launched, and have not come back into the lane"""
        self.lying: dict[int, float] = {}
        """ball that should fly by itself → since when it lies in the lane, s"""
        self.coil = CoilVariation(board.seed, 0)
        self.next = 0.0
        """when the next ball may be served, s"""

    def in_lane(self, ball: int, now: StepContext) -> bool:
        """Tell whether a ball lies where the plunger is."""
        found = now.lane.get(ball)
        if found is None:
            found = now.lane[ball] = self.board.in_lane(*now.frame.position[ball].tolist())
        return found

    def park(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Take a ball out of play, to a free place; where there is none left, it goes to the plunger."""
        self.lose(ball)
        taken = set(self.home.values())
        place = next((k for k in range(len(self.board.homes)) if k not in taken), None)
        if place is None:
            self.idle.insert(0, ball)  # it lies where others would be served, so it is the next
        else:
            self.idle.append(ball)
            self.home[ball] = place
        where = self.board.serve if place is None else self.board.homes[place]
        yield Move(time=now.time, body=self.board.names[ball], position=where, velocity=(0.0, 0.0))

    def lose(self, ball: int) -> None:
        """Take a ball out of play, to nowhere: by itself that is for one that no longer exists."""
        self.live.remove(ball)
        self.flown.discard(ball)
        self.lying.pop(ball, None)

    def serve(self, alone: bool) -> None:
        """Have a ball served, as soon as the lane is free; `alone` it is launched by itself."""
        self.queue.append(alone)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Serve, and launch what should fly by itself but does not; note what has left the lane."""
        for ball in self.live:
            if self.in_lane(ball, now):
                self.flown.discard(ball)
            else:
                self.flown.add(ball)
                self.lying.pop(ball, None)
        if self.queue and self.idle and now.time >= self.next and self._free(now.frame):
            yield from self._served(now)
        yield from self._relaunched(now)

    def launched(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Launch a ball from where it lies, without the plunger."""
        x, y = now.frame.position[ball].tolist()
        yield PlaySound("launch")
        yield Move(
            time=now.time, body=self.board.names[ball], position=(x, y), velocity=self.coil.throw(self.board.launch)
        )

    def _served(self, now: StepContext) -> Iterator[Effect]:
        ball, alone = self.idle.pop(0), self.queue.pop(0)
        self.home.pop(ball, None)
        self.live.append(ball)
        self.next = now.time + GAP
        if alone:
            self.lying[ball] = now.time
        velocity = self.coil.throw(self.board.launch) if alone else (0.0, 0.0)
        yield PlaySound("launch" if alone else "serve")
        yield Move(time=now.time, body=self.board.names[ball], position=self.board.serve, velocity=velocity)

    def _relaunched(self, now: StepContext) -> Iterator[Effect]:
        """Launch a ball that has fallen back, if it was to fly by itself or others are in play meanwhile."""
        for ball in self.live:
            slow = math.hypot(*now.frame.velocity[ball].tolist()) < SLOW
            if ball in self.flown or not slow or not self.in_lane(ball, now):
                continue
            since = self.lying.get(ball)
            if since is not None and now.time - since > STUCK:
                self.lying[ball] = now.time
                yield from self.launched(ball, now)

    def _free(self, frame: Frame) -> bool:
        """Tell whether no ball in play is where one would be served."""
        room = 2.1 * self.board.radius
        x, y = self.board.serve
        places = (frame.position[ball].tolist() for ball in self.live)
        return all(math.hypot(px - x, py - y) > room for px, py in places)


SEARCH_AFTER = 10.0
"""s without a switch, the balls slow"""

SEARCH_AFTER_AT_ANY_SPEED = 30.0
"""s without a switch, however fast they are"""

PULSE, BETWEEN = 0.12, 0.25
"""s, that a coil is on, and from one to the next"""

KICK = 0.5
"""m/s, that the second round gives to a ball"""

ROUNDS = 3
"""the first pulses every coil, the second also kicks the balls, the third takes them back to the plunger"""


class BallSearch(Device):
    """Pulses every coil in turn, as tables do; what does not help is followed by what does."""

    def __init__(self, board: Playfield, holes: Kickers, banks: tuple[DropTargetBanks, ...]) -> None:
        self.board, self.holes, self.banks = board, holes, banks
        self.flippers = tuple(each.name for each in board.of_role("flipper"))
        self.heard_of = 0.0
        """when there was a switch, or reason to wait, s"""
        self.round = 0
        self.next: tuple[int, float] | None = None
        """the coil that is next in this round, and when, s"""
        self.off: dict[str, float] = {}
        """drive that is on → when it goes off, s"""
        self.chance = draws(Stream.BALL_SEARCH, board.seed)

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Be content: the ball is about."""
        self._content(now.time)
        return iter(())

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Be content."""
        self._content(now.time)
        return iter(())

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Wait, or search on."""
        for drive in sorted(drive for drive, when in self.off.items() if when <= now.time):
            del self.off[drive]
            yield Drive(time=now.time, drive=drive, level=0.0)
        if now.up or not now.loose:  # a ball may be cradled, or waits for the player
            self._content(now.time)
            return
        if self.next is not None:
            yield from self._searched(now)
            return
        silent = now.time - self.heard_of
        slow = all(math.hypot(*now.frame.velocity[ball].tolist()) < SLOW for ball in now.loose)
        if silent >= SEARCH_AFTER_AT_ANY_SPEED or (slow and silent >= SEARCH_AFTER):
            self.next = (0, now.time)
            self.round += 1
            yield ShowMessage("ball search")

    def _content(self, time: float) -> None:
        self.heard_of, self.next, self.round = time, None, 0

    def _searched(self, now: StepContext) -> Iterator[Effect]:
        """Pulse the next coil, when it is time; after the last, do what the round adds."""
        assert self.next is not None
        coil, when = self.next
        if now.time < when:
            return
        self.next = (coil + 1, now.time + BETWEEN)
        holes = sorted(self.holes.held)
        if coil < len(self.flippers):
            yield PlaySound("coil")
            yield Drive(time=now.time, drive=self.flippers[coil], level=1.0)
            self.off[self.flippers[coil]] = now.time + PULSE
        elif coil < len(self.flippers) + len(self.banks):
            yield from self.banks[coil - len(self.flippers)].raised(now)
        elif holes:
            yield from self.holes.thrown(holes[0], now)
        else:
            yield from self._ended(now)

    def _ended(self, now: StepContext) -> Iterator[Effect]:
        """End a round: wait half as long for a switch as before the first."""
        self.next, self.heard_of = None, now.time - SEARCH_AFTER / 2.0
        if self.round == ROUNDS - 1:
            for ball in now.loose:
                angle = self.chance.uniform(0.0, 2.0 * math.pi)
                push = KICK * self.board.mass[ball]
                impulse = (push * math.cos(angle), push * math.sin(angle))
                yield Impulse(time=now.time, body=self.board.names[ball], impulse=impulse)
        elif self.round >= ROUNDS:
            self._content(now.time)
            for ball in now.loose:
                yield RemoveBall(ball)
            yield ServeBalls(len(now.loose))
            yield BallSave(0.0)
            yield ShowMessage("ball found")
