"""Trough: where balls are while they are out of play, and how they come back."""

import math
from collections.abc import Iterator

from sandbox.action import Move
from sandbox.games.pinball.board import Board
from sandbox.games.pinball.coil import Coil
from sandbox.games.pinball.effects import Cue, Effect, Now
from sandbox.trajectory import Frame

GAP = 0.7
"""s, at least, between two balls that are served"""

STUCK = 2.0
"""s, that a ball which was to fly by itself may lie in the lane"""

SLOW = 0.05
"""m/s, below which a ball lies"""


class Trough:
    """Every ball of the table: in play or not, and the queue of those to come."""

    def __init__(self, board: Board) -> None:
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
        self.coil = Coil(board.seed, 0)
        self.next = 0.0
        """when the next ball may be served, s"""

    def in_lane(self, ball: int, now: Now) -> bool:
        """Tell whether a ball lies where the plunger is."""
        found = now.lane.get(ball)
        if found is None:
            found = now.lane[ball] = self.board.in_lane(*now.frame.position[ball].tolist())
        return found

    def park(self, ball: int, now: Now) -> Iterator[Effect]:
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

    def tick(self, now: Now) -> Iterator[Effect]:
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

    def launched(self, ball: int, now: Now) -> Iterator[Effect]:
        """Launch a ball from where it lies, without the plunger."""
        x, y = now.frame.position[ball].tolist()
        yield Cue("launch")
        yield Move(
            time=now.time, body=self.board.names[ball], position=(x, y), velocity=self.coil.throw(self.board.launch)
        )

    def _served(self, now: Now) -> Iterator[Effect]:
        ball, alone = self.idle.pop(0), self.queue.pop(0)
        self.home.pop(ball, None)
        self.live.append(ball)
        self.next = now.time + GAP
        if alone:
            self.lying[ball] = now.time
        velocity = self.coil.throw(self.board.launch) if alone else (0.0, 0.0)
        yield Cue("launch" if alone else "serve")
        yield Move(time=now.time, body=self.board.names[ball], position=self.board.serve, velocity=velocity)

    def _relaunched(self, now: Now) -> Iterator[Effect]:
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
