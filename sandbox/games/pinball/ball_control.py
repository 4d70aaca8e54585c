"""Trough and ball search.

The trough keeps the balls that are out of play, and serves them. The ball search starts when no switch has closed for
too long.
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

SERVE_INTERVAL = 0.7
"""s, minimum time between two balls that are served"""

RELAUNCH_DELAY = 2.0
"""s after which a ball that was launched automatically, and is still in the lane, is launched again"""

REST_SPEED = 0.05
"""m/s, speed below which a ball is at rest"""


class Trough:
    """Balls in play and out of play, and the queue of balls to be served."""

    def __init__(self, board: Playfield) -> None:
        self.board = board
        self.in_play: list[int] = []
        self.idle: list[int] = list(board.balls)
        """balls out of play, the next to be served first"""
        self.home_index: dict[int, int] = {ball: k for k, ball in enumerate(board.balls[1:])}
        """ball → index of its position out of play, in `Playfield.homes`; a ball without one is in the lane"""
        self.queue: list[bool] = []
        """for each ball to be served, whether it is launched automatically"""
        self.flown: set[int] = set()
        """balls that have left the lane"""
        self.lane_since: dict[int, float] = {}
        """ball that was launched automatically, and has not left the lane → time of its last launch, s"""
        self.coil = CoilVariation(board.seed, 0)
        self.next = 0.0
        """s, earliest time at which the next ball is served"""

    def in_lane(self, ball: int, now: StepContext) -> bool:
        """Return whether a ball is in the plunger lane."""
        is_inside = now.lane.get(ball)
        if is_inside is None:
            is_inside = now.lane[ball] = self.board.in_lane(*now.frame.position[ball].tolist())
        return is_inside

    def park(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Move a ball out of play, to a free home position; without one, to the plunger."""
        self.lose(ball)
        taken = set(self.home_index.values())
        home = next((k for k in range(len(self.board.homes)) if k not in taken), None)
        if home is None:
            self.idle.insert(0, ball)  # it blocks the position where balls are served, so it is served next
        else:
            self.idle.append(ball)
            self.home_index[ball] = home
        destination = self.board.serve if home is None else self.board.homes[home]
        yield Move(time=now.time, body=self.board.names[ball], position=destination, velocity=(0.0, 0.0))

    def lose(self, ball: int) -> None:
        """Remove a ball from the balls in play without moving it, such as a body that no longer exists."""
        self.in_play.remove(ball)
        self.flown.discard(ball)
        self.lane_since.pop(ball, None)

    def serve(self, automatic: bool) -> None:
        """Queue a ball to be served once the lane is free; `automatic` launches it without the plunger."""
        self.queue.append(automatic)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Record which balls have left the lane, serve the next ball, and relaunch balls that are stuck in the lane."""
        for ball in self.in_play:
            if self.in_lane(ball, now):
                self.flown.discard(ball)
            else:
                self.flown.add(ball)
                self.lane_since.pop(ball, None)
        if self.queue and self.idle and now.time >= self.next and self._is_lane_free(now.frame):
            yield from self._serve_next(now)
        yield from self._relaunch_stuck(now)

    def launch(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Launch a ball from its position, without the plunger."""
        x, y = now.frame.position[ball].tolist()
        yield PlaySound("launch")
        yield Move(
            time=now.time, body=self.board.names[ball], position=(x, y), velocity=self.coil.throw(self.board.launch)
        )

    def _serve_next(self, now: StepContext) -> Iterator[Effect]:
        ball, automatic = self.idle.pop(0), self.queue.pop(0)
        self.home_index.pop(ball, None)
        self.in_play.append(ball)
        self.next = now.time + SERVE_INTERVAL
        if automatic:
            self.lane_since[ball] = now.time
        velocity = self.coil.throw(self.board.launch) if automatic else (0.0, 0.0)
        yield PlaySound("launch" if automatic else "serve")
        yield Move(time=now.time, body=self.board.names[ball], position=self.board.serve, velocity=velocity)

    def _relaunch_stuck(self, now: StepContext) -> Iterator[Effect]:
        """Relaunch balls that were launched automatically, and rest in the lane."""
        for ball in self.in_play:
            slow = math.hypot(*now.frame.velocity[ball].tolist()) < REST_SPEED
            if ball in self.flown or not slow or not self.in_lane(ball, now):
                continue
            since = self.lane_since.get(ball)
            if since is not None and now.time - since > RELAUNCH_DELAY:
                self.lane_since[ball] = now.time
                yield from self.launch(ball, now)

    def _is_lane_free(self, frame: Frame) -> bool:
        """Return whether no ball in play is at the position where balls are served."""
        clearance = 2.1 * self.board.radius
        x, y = self.board.serve
        positions = (frame.position[ball].tolist() for ball in self.in_play)
        return all(math.hypot(px - x, py - y) > clearance for px, py in positions)


SEARCH_AFTER = 10.0
"""s without a closed switch after which the search starts if all balls are at rest"""

SEARCH_AFTER_AT_ANY_SPEED = 30.0
"""s without a closed switch after which the search starts at any speed of the balls"""

PULSE_TIME, COIL_INTERVAL = 0.12, 0.25
"""s: duration of the pulse of a coil, and time between the pulses of two coils"""

KICK_SPEED = 0.5
"""m/s, change of a ball's velocity in the second round"""

SEARCH_ROUNDS = 3
"""number of rounds: the first pulses every coil, the second also kicks the balls, the third serves them anew"""


class BallSearch(Device):
    """Search for a stuck ball: pulses the coils one after the other, with stronger measures in each round."""

    def __init__(self, board: Playfield, holes: Kickers, banks: tuple[DropTargetBanks, ...]) -> None:
        self.board, self.holes, self.banks = board, holes, banks
        self.flippers = tuple(each.name for each in board.of_role("flipper"))
        self.last_switch = 0.0
        """s, time of the last closed switch, or of the last step in which no search was needed"""
        self.round = 0
        self.next: tuple[int, float] | None = None
        """index of the next coil of this round, and time of its pulse, s; None while no round runs"""
        self.off: dict[str, float] = {}
        """drive that is on → end of its pulse, s"""
        self.rng = draws(Stream.BALL_SEARCH, board.seed)

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Stop the search: a switch has closed."""
        self._reset(now.time)
        return iter(())

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Stop the search."""
        self._reset(now.time)
        return iter(())

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """End pulses, and start or continue the search."""
        for drive in sorted(drive for drive, when in self.off.items() if when <= now.time):
            del self.off[drive]
            yield Drive(time=now.time, drive=drive, level=0.0)
        # A raised flipper may hold a ball; a ball in the lane waits for the player.
        if now.raised_sides or not now.loose_balls:
            self._reset(now.time)
            return
        if self.next is not None:
            yield from self._pulse_next(now)
            return
        quiet_time = now.time - self.last_switch
        slow = all(math.hypot(*now.frame.velocity[ball].tolist()) < REST_SPEED for ball in now.loose_balls)
        if quiet_time >= SEARCH_AFTER_AT_ANY_SPEED or (slow and quiet_time >= SEARCH_AFTER):
            self.next = (0, now.time)
            self.round += 1
            yield ShowMessage("ball search")

    def _reset(self, time: float) -> None:
        self.last_switch, self.next, self.round = time, None, 0

    def _pulse_next(self, now: StepContext) -> Iterator[Effect]:
        """Pulse the next coil if its time has come; after the last one, end the round."""
        assert self.next is not None
        coil, when = self.next
        if now.time < when:
            return
        self.next = (coil + 1, now.time + COIL_INTERVAL)
        holes = sorted(self.holes.held)
        if coil < len(self.flippers):
            yield PlaySound("coil")
            yield Drive(time=now.time, drive=self.flippers[coil], level=1.0)
            self.off[self.flippers[coil]] = now.time + PULSE_TIME
        elif coil < len(self.flippers) + len(self.banks):
            yield from self.banks[coil - len(self.flippers)].raise_targets(now)
        elif holes:
            yield from self.holes.eject(holes[0], now)
        else:
            yield from self._end_round(now)

    def _end_round(self, now: StepContext) -> Iterator[Effect]:
        """End a round: kick the balls or serve them anew; the next round starts after half the first waiting time."""
        self.next, self.last_switch = None, now.time - SEARCH_AFTER / 2.0
        if self.round == SEARCH_ROUNDS - 1:
            for ball in now.loose_balls:
                angle = self.rng.uniform(0.0, 2.0 * math.pi)
                push = KICK_SPEED * self.board.mass[ball]
                impulse = (push * math.cos(angle), push * math.sin(angle))
                yield Impulse(time=now.time, body=self.board.names[ball], impulse=impulse)
        elif self.round >= SEARCH_ROUNDS:
            self._reset(now.time)
            for ball in now.loose_balls:
                yield RemoveBall(ball)
            yield ServeBalls(len(now.loose_balls))
            yield BallSave(0.0)
            yield ShowMessage("ball found")
