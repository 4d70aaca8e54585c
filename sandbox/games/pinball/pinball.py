"""Pinball: the game that the machines of a table make together, as rules that any host can play."""

from collections.abc import Iterable, Iterator, Sequence

from sandbox.action import Action, Drive
from sandbox.games.pinball.board import Board
from sandbox.games.pinball.controls import CONTROLS, FLIPPERS, NUDGES, PLUNGER
from sandbox.games.pinball.course import Course
from sandbox.games.pinball.drops import banks_of
from sandbox.games.pinball.effects import Again, Award, Cue, Effect, Machine, Now, Save, Say, Serve, Take
from sandbox.games.pinball.gauges import gauges
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
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.scene import Scene

SAID = 3.0
"""s, that a message stays"""

BLINK = 0.4
"""s, from one blink to the next"""


class Pinball:
    """A game of three balls for one to four players."""

    controls: tuple[Control, ...] = CONTROLS

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Begin a game.

        Raises:
            UnfitError: there is no ball.
        """
        self.board = board = Board.of(scene, bodies)
        self.switches, self.holes, self.nudge = Switches(board), Holes(board), Nudge(board)
        self.banks, self.lamps = banks_of(board), lamps_of(board)
        self.modes, self.multiball = Modes(board), Multiball(board)
        self.machines: tuple[Machine, ...] = (
            Targets(), *self.lamps, *self.banks, *(Spinner(each) for each in board.of_role("spinner")),
            self.holes, Ramps(board), self.modes, self.multiball, self.nudge,
            Search(board, self.holes, self.banks),
        )  # fmt: skip
        self._ticking = tuple(each for each in self.machines if type(each).tick is not Machine.tick)
        self._lamped = tuple(each for each in self.machines if type(each).lights is not Machine.lights)
        self.course = Course(board, self.holes, self.nudge)
        self.course.machines = self.machines
        self.up: set[str] = set()
        """the sides whose flippers are held up"""
        self.said = ("", 0.0)
        self._cues: list[str] = []
        self._now: Now | None = None

    @property
    def trough(self) -> Trough:
        """Where every ball is."""
        return self.course.trough

    @property
    def sheet(self) -> Sheet:
        """Of who plays."""
        return self.course.sheet

    @property
    def score(self) -> int:
        """Of who plays; at the end, the best."""
        return max(each.score for each in self.course.sheets) if self.course.phase == "over" else self.sheet.score

    @property
    def over(self) -> str | None:
        """Why the game is over; None while it goes on."""
        if self.course.phase != "over":
            return None
        return "game over" if self.course.balls_left else "game over: no ball left on the table"

    def control(self, name: str, value: float) -> Sequence[Action]:
        """Do what a player asks for; a tilted table obeys nobody, but lets go, and its plunger is only a rod.

        Raises:
            KeyError: there is no such control.
        """
        now, alive = self._now, self.course.alive
        if now is None:
            return ()
        if name in FLIPPERS:
            return self._flipped(FLIPPERS[name], value > 0.0 and alive, now)
        if name == PLUNGER:
            return self._settled(self._plunged(value if self.course.phase == "play" else 0.0, now), now)
        direction = NUDGES[name] * complex(*self.board.up)
        return self._settled(self.nudge.jolt(direction, value, now), now) if alive and value > 0.0 else ()

    def look(self, seen: Seen) -> Sequence[Action]:
        """See what happened in a step."""
        now = self._now = Now(seen.time, seen.frame, self.sheet)
        actions = self._settled(self._happens(seen, now), now)
        self._refresh(now)
        return actions

    def lines(self) -> Sequence[tuple[str, str]]:
        """Return the score panel."""
        course, time = self.course, 0.0 if self._now is None else self._now.time
        message, until = self.said
        if self.nudge.tilted:
            message, until = "TILT!", time + SAID
        return panel(course.sheets, course.turn, self.modes, self._saved(time), message if time < until else "")

    def gauges(self) -> Sequence[tuple[str, float]]:
        """Return what the panel and the lamps of lanes and targets show, as numbers."""
        saved = self._saved(0.0 if self._now is None else self._now.time)
        return list(gauges(self.course, self.modes, self.multiball, self.lamps, self.banks, max(saved, 0.0)))

    def lit(self) -> frozenset[str]:
        """Return whose lamps are lit; a tilted table is dark."""
        now = self._now
        if now is None or self.nudge.tilted:
            return frozenset()
        lights = [light for machine in self._lamped for light in machine.lights(now)]
        if not lights:
            return frozenset()
        blinking = {light.name for light in lights if light.blinks}
        on = blinking if now.time % BLINK < 0.5 * BLINK else set[str]()
        return frozenset(on | {light.name for light in lights} - blinking)

    def cues(self) -> Sequence[str]:
        """Return the sounds since the last call."""
        cues, self._cues = self._cues, []
        return cues

    def _saved(self, time: float) -> float:
        """Return for how long drained balls come back, from a time on, s; 0 or less for none."""
        return 0.0 if self.course.fresh else self.course.saved - time

    def _refresh(self, now: Now) -> None:
        """Bring up to date what others than the engine change."""
        trough = self.trough
        now.sheet, now.live, now.waiting = self.sheet, tuple(trough.live), len(trough.queue)
        now.loose = tuple(ball for ball in trough.live if ball not in self.holes.held and not trough.in_lane(ball, now))
        now.up = frozenset(self.up)

    def _happens(self, seen: Seen, now: Now) -> Iterator[Effect]:
        """Yield what a step has brought, each effect after those before it were carried out."""
        self._refresh(now)
        for hit in self.switches.read(seen):
            if hit.ball in now.live:
                yield from self._hit(hit, now)
        yield from self.course.missed(now)
        self._refresh(now)
        tilted = self.nudge.tilted
        for machine in self._ticking:
            yield from machine.tick(now)
        if self.nudge.tilted and not tilted:
            self.course.save(0.0)
            for side in sorted(self.up):
                yield from self._flipped(side, False, now)
        yield from self.trough.tick(now)
        yield from self.course.went_on(now)

    def _hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        if hit.ball not in self.trough.live:  # an earlier hit of this step has taken it
            return
        self.course.touched = True
        if hit.element.role == "drain":
            yield from self.course.drained(hit.ball, now)
            return
        for machine in self.machines:
            yield from machine.hit(hit, now)

    def _flipped(self, side: str, up: bool, now: Now) -> list[Action]:
        """Raise the flippers of a side, or let them go."""
        if up and side not in self.up:
            self._cues.append("flipper")
            for lamps in self.lamps:
                lamps.rotate(side)
        (self.up.add if up else self.up.discard)(side)
        self._refresh(now)
        return [Drive(time=now.time, drive=each.name, level=float(up)) for each in self.board.flippers(side)]

    def _plunged(self, value: float, now: Now) -> Iterator[Effect]:
        """Pull the plunger, or let it go; a table without one launches the ball when it is let go."""
        plungers = self.board.of_role("plunger")
        if plungers:
            yield from (Drive(time=now.time, drive=each.name, level=value) for each in plungers)
        elif not value:
            for ball in now.live:
                if self.trough.in_lane(ball, now):
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
                    actions += self._settled(self.course.take(effect.ball, now), now)
                case Serve():
                    for _ in range(effect.balls):
                        self.trough.serve(alone=True)
                case Save():
                    self.course.save(now.time + effect.seconds)
                case Again():
                    if self.course.again(effect.reason):
                        self._cues.append("extra ball")
                        self.said = ("shoot again", now.time + SAID)
                case _:
                    actions.append(effect)
        return actions

    def _awarded(self, award: Award, now: Now) -> Iterator[Effect]:
        """Score, unless the table is tilted, and let every machine hear of it."""
        if self.nudge.tilted:
            return
        yield from self.course.scored(award.points, award.bonus)
        for machine in self.machines:
            yield from machine.heard(award, now)
