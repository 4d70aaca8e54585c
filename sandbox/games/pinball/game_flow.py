"""Course: whose ball it is, from the plunger to the drain, the bonus, and the next player's."""

from collections.abc import Iterator
from typing import Literal

from sandbox.games.pinball.ball_control import Trough
from sandbox.games.pinball.devices import Kickers
from sandbox.games.pinball.events import Device, Effect, ExtraBall, PlayerState, PlaySound, ShowMessage, StepContext
from sandbox.games.pinball.playfield import Playfield
from sandbox.games.pinball.tilt import NudgeAndTilt

SAVED = 8.0
"""s after a ball has left the lane, in which it comes back if it drains"""

COUNT = 1.5
"""s, that the bonus is counted for"""

SETTLE = 3.0
"""s after a tilted ball, until the next"""

EXTRA = 250_000
"""points that give an extra ball"""

Phase = Literal["start", "play", "count", "over"]


class GameFlow:
    """The players' sheets, whose turn it is, and how far the ball has come."""

    def __init__(self, board: Playfield, holes: Kickers, nudge: NudgeAndTilt) -> None:
        self.board, self.holes, self.nudge, self.trough = board, holes, nudge, Trough(board)
        self.machines: tuple[Device, ...] = ()
        """which are made ready for each ball"""
        self.sheets = [PlayerState() for _ in range(board.players)]
        self.turn = 0
        self.phase: Phase = "start"
        self.until = 0.0
        """when counting ends and the next ball begins, s"""
        self.saved = 0.0
        """until when drained balls come back, s"""
        self.fresh = True
        """whether the ball has not left the lane yet"""
        self.touched = False
        """whether it has closed a switch since it was served"""

    @property
    def sheet(self) -> PlayerState:
        """Of who plays."""
        return self.sheets[self.turn]

    @property
    def alive(self) -> bool:
        """Whether the table obeys its player."""
        return self.phase == "play" and not self.nudge.tilted

    @property
    def balls_left(self) -> bool:
        """Whether there is anything to play with."""
        return bool(self.trough.live or self.trough.idle)

    def save(self, until: float) -> None:
        """Have drained balls come back until a time, s."""
        self.saved, self.fresh = until, False

    def take(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Take a ball out of play."""
        self.holes.forget(ball)
        yield from self.trough.park(ball, now)

    def drained(self, ball: int, now: StepContext) -> Iterator[Effect]:
        """Take out a ball that has drained; serve it again while balls are saved."""
        yield PlaySound("drain")
        yield from self.take(ball, now)
        if now.time < self.saved and not self.nudge.tilted:
            self.trough.serve(alone=True)
            yield PlaySound("save")
            yield ShowMessage("ball saved")

    def missed(self, now: StepContext) -> Iterator[Effect]:
        """Return balls that have left the table to the plunger; give up those that are gone for good."""
        for ball in now.live:
            if ball not in self.trough.live:
                continue
            if not now.frame.present[ball]:
                self.holes.forget(ball)
                self.trough.lose(ball)
                yield ShowMessage("ball lost")
            elif not self.board.inside(*now.frame.position[ball].tolist()):
                yield from self.take(ball, now)
                if not self.nudge.tilted:
                    self.trough.serve(alone=False)
                yield ShowMessage("ball returned")

    def went_on(self, now: StepContext) -> Iterator[Effect]:
        """Start the ball's save, end the ball, or begin the next."""
        if self.phase == "play":
            yield from self._played(now)
        elif self.phase == "start":
            yield from self._begun(now)
        elif self.phase == "count" and now.time >= self.until:
            self._counted()
            yield from self._begun(now)

    def scored(self, points: int, bonus: int) -> Iterator[Effect]:
        """Add to the sheet of who plays."""
        self.sheet.score += points
        self.sheet.bonus += bonus
        if self.sheet.score >= EXTRA:
            yield ExtraBall("score")

    def again(self, reason: str) -> bool:
        """Let the player shoot again, once for a reason; tell whether it was one."""
        if reason in self.sheet.had:
            return False
        self.sheet.had.add(reason)
        self.sheet.again += 1
        return True

    def _played(self, now: StepContext) -> Iterator[Effect]:
        trough, tilted, sheet = self.trough, self.nudge.tilted, self.sheet
        if self.fresh and trough.flown:
            self.save(now.time + SAVED)
        elif trough.live and not trough.flown and not self.touched:
            self.fresh = True  # a weak shot, which fell back into the lane
        if trough.live or (trough.queue and trough.idle):
            return
        trough.queue.clear()
        self.phase, self.until = "count", now.time + (SETTLE if tilted else COUNT)
        if sheet.bonus and not tilted:
            yield PlaySound("bonus")
            yield ShowMessage(f"bonus {sheet.bonus * sheet.times:,}")

    def _counted(self) -> None:
        """Count the bonus, and pass the turn on."""
        sheet, again = self.sheet, self.sheet.again > 0
        if not self.nudge.tilted:
            sheet.score += sheet.bonus * sheet.times
        sheet.ended()
        if not again:
            self.turn = (self.turn + 1) % len(self.sheets)

    def _begun(self, now: StepContext) -> Iterator[Effect]:
        """Begin a ball, or end the game."""
        if self.sheet.done or not self.balls_left:
            self.phase = "over"
            yield PlaySound("over")
            return
        self.phase, self.fresh, self.touched, self.saved = "play", True, False, 0.0
        now.sheet = self.sheet
        for machine in self.machines:
            yield from machine.begin(now)
        self.trough.serve(alone=False)
