"""Ball life cycle: serve, ball save, drain, end-of-ball bonus, next player, game over."""

from collections.abc import Iterator
from typing import Literal

from sandbox.games.pinball.ball_control import Trough
from sandbox.games.pinball.devices import Kickers
from sandbox.games.pinball.events import Device, Effect, ExtraBall, PlayerState, PlaySound, ShowMessage, StepContext
from sandbox.games.pinball.playfield import Playfield
from sandbox.games.pinball.tilt import NudgeAndTilt

BALL_SAVE_TIME = 8.0
"""s after a ball has left the lane, in which it is returned if it drains"""

BONUS_TIME = 1.5
"""s, duration of the bonus count"""

TILT_PAUSE = 3.0
"""s between a tilted ball and the next"""

EXTRA_BALL_SCORE = 250_000
"""points that award an extra ball"""

GamePhase = Literal["start", "play", "count", "over"]


class GameFlow:
    """State of the players, the present player, and the phase of the ball."""

    def __init__(self, board: Playfield, holes: Kickers, nudge: NudgeAndTilt) -> None:
        self.board, self.holes, self.nudge, self.trough = board, holes, nudge, Trough(board)
        self.devices: tuple[Device, ...] = ()
        """devices that are reset for each ball"""
        self.sheets = [PlayerState() for _ in range(board.players)]
        self.turn = 0
        self.phase: GamePhase = "start"
        self.until = 0.0
        """s, time at which the bonus count ends and the next ball starts"""
        self.saved = 0.0
        """s, time at which the ball save ends"""
        self.fresh = True
        """whether the ball has not left the plunger lane yet"""
        self.touched = False
        """whether the ball has closed a switch since it was served"""

    @property
    def sheet(self) -> PlayerState:
        """State of the present player."""
        return self.sheets[self.turn]

    @property
    def alive(self) -> bool:
        """Whether flippers and nudges work: a ball is in play, and the table is not tilted."""
        return self.phase == "play" and not self.nudge.tilted

    @property
    def balls_left(self) -> bool:
        """Whether any ball is left."""
        return bool(self.trough.in_play or self.trough.idle)

    def save(self, until: float) -> None:
        """Set the end of the ball save, s."""
        self.saved, self.fresh = until, False

    def remove_ball(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Remove a ball from play."""
        self.holes.forget(ball)
        yield from self.trough.park(ball, now)

    def on_drain(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Remove a drained ball; serve another during the ball save."""
        yield PlaySound("drain")
        yield from self.remove_ball(ball, now)
        if now.time < self.saved and not self.nudge.tilted:
            self.trough.serve(automatic=True)
            yield PlaySound("save")
            yield ShowMessage("ball saved")

    def recover_balls(self, now: StepContext) -> Iterator[Effect]:
        """Return balls that have left the table to the plunger, and drop balls that were removed from the scene."""
        for ball in now.balls_in_play:
            if ball not in self.trough.in_play:
                continue
            if not now.frame.present[ball]:
                self.holes.forget(ball)
                self.trough.lose(ball)
                yield ShowMessage("ball lost")
            elif not self.board.inside(*now.frame.position[ball].tolist()):
                yield from self.remove_ball(ball, now)
                if not self.nudge.tilted:
                    self.trough.serve(automatic=False)
                yield ShowMessage("ball returned")

    def update(self, now: StepContext) -> Iterator[Effect]:
        """Start the ball save, end the ball, or start the next one."""
        if self.phase == "play":
            yield from self._update_play(now)
        elif self.phase == "start":
            yield from self._start_ball(now)
        elif self.phase == "count" and now.time >= self.until:
            self._end_ball()
            yield from self._start_ball(now)

    def add_points(self, points: int, bonus: int) -> Iterator[Effect]:
        """Add points and bonus to the present player."""
        self.sheet.score += points
        self.sheet.bonus += bonus
        if self.sheet.score >= EXTRA_BALL_SCORE:
            yield ExtraBall("score")

    def award_extra_ball(self, reason: str) -> bool:
        """Award an extra ball, once for each reason; return whether it was awarded."""
        if reason in self.sheet.awarded_reasons:
            return False
        self.sheet.awarded_reasons.add(reason)
        self.sheet.extra_balls += 1
        return True

    def _update_play(self, now: StepContext) -> Iterator[Effect]:
        trough, tilted, sheet = self.trough, self.nudge.tilted, self.sheet
        if self.fresh and trough.flown:
            self.save(now.time + BALL_SAVE_TIME)
        elif trough.in_play and not trough.flown and not self.touched:
            self.fresh = True  # a weak shot that fell back into the lane
        if trough.in_play or (trough.queue and trough.idle):
            return
        trough.queue.clear()
        self.phase, self.until = "count", now.time + (TILT_PAUSE if tilted else BONUS_TIME)
        if sheet.bonus and not tilted:
            yield PlaySound("bonus")
            yield ShowMessage(f"bonus {sheet.bonus * sheet.bonus_multiplier:,}")

    def _end_ball(self) -> None:
        """Add the bonus, and pass the turn to the next player."""
        sheet, again = self.sheet, self.sheet.extra_balls > 0
        if not self.nudge.tilted:
            sheet.score += sheet.bonus * sheet.bonus_multiplier
        sheet.end_ball()
        if not again:
            self.turn = (self.turn + 1) % len(self.sheets)

    def _start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Start a ball, or end the game."""
        if self.sheet.done or not self.balls_left:
            self.phase = "over"
            yield PlaySound("over")
            return
        self.phase, self.fresh, self.touched, self.saved = "play", True, False, 0.0
        now.sheet = self.sheet
        for device in self.devices:
            yield from device.start_ball(now)
        self.trough.serve(automatic=False)
