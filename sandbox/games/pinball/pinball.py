"""Pinball: the game that the machines of a table make together, as rules that any host can play."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Literal

from sandbox.action import Action, Drive
from sandbox.games.pinball.board import Board
from sandbox.games.pinball.controls import CONTROLS, FLIPPERS, NUDGES, PLUNGER
from sandbox.games.pinball.drops import banks_of
from sandbox.games.pinball.effects import Again, Award, Cue, Effect, Machine, Now, Save, Say, Serve, Take
from sandbox.games.pinball.holes import Holes
from sandbox.games.pinball.lamps import lamps_of
from sandbox.games.pinball.modes import Modes
from sandbox.games.pinball.multiball import Multiball
from sandbox.games.pinball.nudge import Nudge
from sandbox.games.pinball.panel import panel
from sandbox.games.pinball.ramps import Ramps
from sandbox.games.pinball.search import Search
from sandbox.games.pinball.sheet import Sheet
from sandbox.games.pinball.spinner import Spinner
from sandbox.games.pinball.switches import Hit, Switches
from sandbox.games.pinball.targets import Targets
from sandbox.games.pinball.trough import Trough
from sandbox.games.rules import Control, Seen
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.trajectory import Frame

SAVED = 8.0
"""s after a ball has left the lane, in which it comes back if it drains"""

COUNT = 1.5
"""s, that the bonus is counted for"""

SETTLE = 3.0
"""s after a tilted ball, until the next"""

SAID = 3.0
"""s, that a message stays"""

EXTRA = 250_000
"""points that give an extra ball"""

Phase = Literal["start", "play", "count", "over"]


class Pinball:
    """A game of three balls for one to four players."""

    controls: tuple[Control, ...] = CONTROLS

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Begin a game.

        Raises:
            UnfitError: there is no ball.
        """
        self.board = board = Board.of(scene, bodies)
        self.switches, self.trough, self.holes = Switches(board), Trough(board), Holes(board)
        self.banks, self.lamps, self.modes = banks_of(board), lamps_of(board), Modes(board)
        self.multiball, self.nudge = Multiball(board), Nudge(board)
        self.machines: tuple[Machine, ...] = (
            Targets(), *self.lamps, *self.banks, *(Spinner(each) for each in board.of_role("spinner")),
            self.holes, Ramps(board), self.modes, self.multiball, self.nudge,
            Search(board, self.holes, self.banks),
        )  # fmt: skip
        self.sheets = [Sheet() for _ in range(board.players)]
        self.turn = 0
        self.phase: Phase = "start"
        self.until = 0.0
        """when counting ends and the next ball begins, s"""
        self.up: set[str] = set()
        self.saved = 0.0
        """until when drained balls come back, s"""
        self.fresh = True
        """whether the ball has not left the lane yet"""
        self.said = ("", 0.0)
        self._cues: list[str] = []
        self._now: Now | None = None

    @property
    def sheet(self) -> Sheet:
        """Of who plays."""
        return self.sheets[self.turn]

    @property
    def score(self) -> int:
        """Of who plays; at the end, the best."""
        return max(each.score for each in self.sheets) if self.phase == "over" else self.sheet.score

    @property
    def over(self) -> str | None:
        """Why the game is over; None while it goes on."""
        if self.phase != "over":
            return None
        return "all balls were played" if self._balls_left() else "no ball is left on the table"

    def control(self, name: str, value: float) -> Sequence[Action]:
        """Do what a player asks for; a tilted table obeys nobody, but lets go.

        Raises:
            KeyError: there is no such control.
        """
        now = self._now
        if now is None:
            return ()
        alive = self.phase == "play" and not self.nudge.tilted
        if name in FLIPPERS:
            return self._flipped(FLIPPERS[name], value > 0.0 and alive, now)
        if name == PLUNGER:
            return self._settled(self._plunged(value if alive else 0.0, now), now)
        direction = NUDGES[name] * complex(*self.board.up)
        return self._settled(self.nudge.jolt(direction, value, now), now) if alive and value > 0.0 else ()

    def look(self, seen: Seen) -> Sequence[Action]:
        """See what happened in a step."""
        now = self._now = self._how(seen.time, seen.frame)
        hits = [hit for hit in self.switches.read(seen) if hit.ball in now.live]
        actions = [action for hit in hits for action in self._settled(self._hit(hit, now), now)]
        actions += self._settled(self._missed(now), now)
        self._refresh(now)
        tilted = self.nudge.tilted
        for machine in self.machines:
            actions += self._settled(machine.tick(now), now)
        if self.nudge.tilted and not tilted:
            self.saved = 0.0
            actions += [action for side in sorted(self.up) for action in self._flipped(side, False, now)]
        actions += self._settled(self.trough.tick(now), now)
        actions += self._settled(self._went_on(now), now)
        self._refresh(now)
        return actions

    def lines(self) -> Sequence[tuple[str, str]]:
        """Return the score panel."""
        time = 0.0 if self._now is None else self._now.time
        message, until = self.said
        if self.nudge.tilted:
            message, until = "TILT", time + SAID
        saved = 0.0 if self.fresh else self.saved - time
        return panel(self.sheets, self.turn, self.modes, saved, message if time < until else "")

    def cues(self) -> Sequence[str]:
        """Return the sounds since the last call."""
        cues, self._cues = self._cues, []
        return cues

    def _how(self, time: float, frame: Frame) -> Now:
        now = Now(time, frame, self.sheet)
        self._refresh(now)
        return now

    def _refresh(self, now: Now) -> None:
        """Bring up to date what others than the engine change."""
        trough = self.trough
        now.sheet, now.live, now.waiting = self.sheet, tuple(trough.live), len(trough.queue)
        now.loose = tuple(
            ball for ball in trough.live if ball not in self.holes.held and not trough.in_lane(ball, now.frame)
        )
        now.up = frozenset(self.up)

    def _hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        if hit.ball not in self.trough.live:  # an earlier hit of this step has taken it
            return
        if hit.element.role == "drain":
            yield from self._drained(hit.ball, now)
            return
        for machine in self.machines:
            yield from machine.hit(hit, now)

    def _drained(self, ball: int, now: Now) -> Iterator[Effect]:
        self.holes.forget(ball)
        yield Cue("drain")
        yield from self.trough.park(ball, now)
        if now.time < self.saved and not self.nudge.tilted:
            self.trough.serve(alone=True)
            yield Cue("save")
            yield Say("ball saved")

    def _missed(self, now: Now) -> Iterator[Effect]:
        """Return balls that have left the table to the plunger; give up those that are gone for good."""
        for ball in now.live:
            if ball not in self.trough.live:
                continue
            if not now.frame.present[ball]:
                self.holes.forget(ball)
                self.trough.lose(ball)
                yield Say("a ball is gone")
            elif not self.board.inside(*now.frame.position[ball].tolist()):
                self.holes.forget(ball)
                yield from self.trough.park(ball, now)
                if not self.nudge.tilted:
                    self.trough.serve(alone=False)
                yield Say("ball lost: back to the plunger")

    def _went_on(self, now: Now) -> Iterator[Effect]:
        """Start the ball's save, end the ball, or begin the next."""
        trough = self.trough
        if self.phase == "play":
            if self.fresh and trough.flown:
                self.fresh, self.saved = False, max(self.saved, now.time + SAVED)
            if not trough.live and (not trough.queue or not trough.idle):
                trough.queue.clear()
                self.phase, self.until = "count", now.time + (SETTLE if self.nudge.tilted else COUNT)
                if not self.nudge.tilted and self.sheet.bonus:
                    yield Cue("bonus")
                    yield Say(f"bonus {self.sheet.bonus * self.sheet.times:,}")
        elif self.phase == "start":
            yield from self._begun(now)
        elif self.phase == "count" and now.time >= self.until:
            self._counted()
            yield from self._begun(now)

    def _counted(self) -> None:
        """Count the bonus, and pass the turn on."""
        sheet, again = self.sheet, self.sheet.again > 0
        if not self.nudge.tilted:
            sheet.score += sheet.bonus * sheet.times
        sheet.ended()
        if not again:
            self.turn = (self.turn + 1) % len(self.sheets)

    def _begun(self, now: Now) -> Iterator[Effect]:
        """Begin a ball, or end the game."""
        if self.sheet.done or not self._balls_left():
            self.phase = "over"
            yield Cue("over")
            return
        self.phase, self.fresh, self.saved = "play", True, 0.0
        self._refresh(now)
        for machine in self.machines:
            yield from machine.begin(now)
        self.trough.serve(alone=False)

    def _balls_left(self) -> bool:
        return bool(self.trough.live or self.trough.idle)

    def _flipped(self, side: str, up: bool, now: Now) -> list[Action]:
        """Raise the flippers of a side, or let them go."""
        if up and side not in self.up:
            self._cues.append("flipper")
            for lamps in self.lamps:
                lamps.rotate(side)
        (self.up.add if up else self.up.discard)(side)
        self._refresh(now)
        return [
            Drive(time=now.time, drive=each.name, level=float(up)) for each in self.board.flippers(side)
        ]  # fmt: skip

    def _plunged(self, value: float, now: Now) -> Iterator[Effect]:
        """Pull the plunger, or let it go; a table without one launches the ball when it is let go."""
        plungers = self.board.of_role("plunger")
        if plungers:
            yield from (Drive(time=now.time, drive=each.name, level=value) for each in plungers)
        elif not value:
            for ball in now.live:
                if self.trough.in_lane(ball, now.frame):
                    yield from self.trough.launched(ball, now)

    def _settled(self, effects: Iterable[Effect], now: Now) -> list[Action]:
        """Carry out effects, in order, and what machines make of them; return the actions among them."""
        actions: list[Action] = []
        for effect in effects:
            match effect:
                case Award():
                    actions += self._settled(self._awarded(effect, now), now)
                case Cue():
                    self._cues.append(effect.name)
                case Say():
                    self.said = (effect.text, now.time + SAID)
                case Take():
                    self.holes.forget(effect.ball)
                    actions += self._settled(self.trough.park(effect.ball, now), now)
                case Serve():
                    for _ in range(effect.balls):
                        self.trough.serve(alone=True)
                case Save():
                    self.saved, self.fresh = now.time + effect.seconds, False
                case Again():
                    self._again(effect.reason)
                case _:
                    actions.append(effect)
        return actions

    def _awarded(self, award: Award, now: Now) -> Iterator[Effect]:
        """Score, unless the table is tilted, and let every machine hear of it."""
        if self.nudge.tilted:
            return
        self.sheet.score += award.points
        self.sheet.bonus += award.bonus
        if self.sheet.score >= EXTRA:
            yield Again("score")
        for machine in self.machines:
            yield from machine.heard(award, now)

    def _again(self, reason: str) -> None:
        sheet = self.sheet
        if reason in sheet.had:
            return
        sheet.had.add(reason)
        sheet.again += 1
        self._cues.append("extra ball")
        self.said = ("shoot again", 0.0 if self._now is None else self._now.time + SAID)
