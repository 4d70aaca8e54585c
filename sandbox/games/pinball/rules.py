"""Pinball: the game that the machines of a table make together, as rules that any host can play.

Controls: what a player of pinball can do.

Gauges: what a player of pinball reads off the table and its panel, as numbers for who learns to play.

Panel: the lines of the score panel.
"""

from collections.abc import Iterable, Iterator, Sequence

from sandbox.action import Action, Drive
from sandbox.games.contract import Control, StepInfo
from sandbox.games.pinball.ball_control import BallSearch, Trough
from sandbox.games.pinball.devices import Kickers, LaneLights, Ramps, ScoringSwitches, Spinner, lane_lights_of
from sandbox.games.pinball.drop_targets import DropTargetBanks, banks_of
from sandbox.games.pinball.events import (
    BALLS,
    Award,
    BallSave,
    Device,
    Effect,
    ExtraBall,
    Hit,
    PlayerState,
    PlaySound,
    RemoveBall,
    ServeBalls,
    ShowMessage,
    StepContext,
    Switches,
)
from sandbox.games.pinball.game_flow import GameFlow
from sandbox.games.pinball.modes import Modes, Multiball
from sandbox.games.pinball.playfield import Playfield
from sandbox.games.pinball.tilt import NudgeAndTilt
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.scene import Scene

LEFT, RIGHT, PLUNGER = "left flipper", "right flipper", "plunger"

FLIPPERS = {LEFT: "left", RIGHT: "right"}
"""control → side"""

NUDGES = {"nudge": 1.0 + 0j, "nudge left": 1j, "nudge right": -1j}
"""control → where the balls go, as a turn from up the table"""

SELDOM = 0.05
"""of the presses of other controls, those of a nudge by whoever presses at chance: three of a ball are a tilt"""

CONTROLS = (
    Control(LEFT, "left flipper; lane lights move left", ("left shift", "z"), "lb lt"),
    Control(RIGHT, "right flipper; lane lights move right", ("right shift", "/"), "rb rt"),
    Control(PLUNGER, "hold to pull the plunger, release to shoot", ("enter",), "a +righty", True),
    Control("nudge", "nudge the table: balls move up", ("space",), "y up", True, SELDOM),
    Control("nudge left", "nudge the table: balls move left", ("left",), "left", True, SELDOM),
    Control("nudge right", "nudge the table: balls move right", ("right",), "right", True, SELDOM),
)


Gauge = tuple[str, float]


def observation(
    course: GameFlow,
    modes: Modes,
    multiball: Multiball,
    lamps: Sequence[LaneLights],
    banks: Sequence[DropTargetBanks],
    saved: float,
) -> Iterator[Gauge]:
    """Yield names and values, always the same names in the same order.

    Args:
        course: of the game.
        modes: what runs.
        multiball: whether it is on.
        lamps: the sets of lanes and standing targets.
        banks: of drop targets.
        saved: s, in which drained balls come back; 0 for none.
    """
    sheet, nudge = course.sheet, course.nudge
    yield "player", course.turn
    yield "ball", sheet.ball
    yield "shoot again", sheet.again
    yield "bonus", sheet.bonus
    yield "bonus times", sheet.times
    yield "ball save", saved
    yield "balls in play", len(course.trough.live)
    yield "locked", sheet.locked
    yield "lock lit", sheet.lit
    yield "multiball", multiball.on
    yield "mode ready", modes.ready
    yield "mode", 0 if modes.mode is None else 1 + modes.modes.index(modes.mode)
    yield "mode left", 0.0 if modes.mode is None else modes.left
    yield "mode to go", 0 if modes.mode is None else modes.to_go
    yield "warnings", nudge.warnings
    yield "tilted", nudge.tilted
    for each in lamps:
        yield from ((f"{name} lit", lit) for name, lit in zip(each.names, each.lit, strict=True))
    for bank in banks:
        gone = {*bank.down, *bank.falling}
        yield from ((f"{target.name} down", place in gone) for place, target in enumerate(bank.members))


Line = tuple[str, str]


def display_lines(sheets: Sequence[PlayerState], turn: int, modes: Modes, saved: float, message: str) -> list[Line]:
    """Return labels and texts, the most important first, without the score: whoever shows them has that.

    Args:
        sheets: of the players.
        turn: who plays, from 0.
        modes: what runs.
        saved: s, in which drained balls come back; 0 or less for none.
        message: the last news; empty for none.
    """
    sheet = sheets[turn]
    ball = f"{min(sheet.ball, BALLS)} of {BALLS}"
    lines = [("Ball", f"{ball}, shoot again" if sheet.again else ball)]
    if len(sheets) > 1:
        lines.insert(0, ("Player", f"{turn + 1} of {len(sheets)}"))
        lines += [(f"Player {k + 1}", f"{each.score:,}") for k, each in enumerate(sheets) if k != turn]
    lines.append(("Bonus", f"{sheet.bonus:,} × {sheet.times}"))
    if sheet.locked or sheet.lit:
        lit = ["lock is lit"] if sheet.lit else []
        lines.append(("Locked", ", ".join([str(sheet.locked), *lit])))
    if modes.mode is not None:
        lines.append((modes.mode.name.capitalize(), f"{modes.to_go} to go, {modes.left:.0f} s"))
    elif modes.ready:
        lines.append(("Mode", "ready"))
    if saved > 0.0:
        lines.append(("Ball save", f"{saved:.0f} s"))
    if message:
        lines.append(("", message))
    return lines


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
        self.board = board = Playfield.of(scene, bodies)
        self.switches, self.holes, self.nudge = Switches(board), Kickers(board), NudgeAndTilt(board)
        self.banks, self.lamps = banks_of(board), lane_lights_of(board)
        self.modes, self.multiball = Modes(board), Multiball(board)
        self.machines: tuple[Device, ...] = (
            ScoringSwitches(), *self.lamps, *self.banks, *(Spinner(each) for each in board.of_role("spinner")),
            self.holes, Ramps(board), self.modes, self.multiball, self.nudge,
            BallSearch(board, self.holes, self.banks),
        )  # fmt: skip
        self._ticking = tuple(each for each in self.machines if type(each).tick is not Device.tick)
        self._lamped = tuple(each for each in self.machines if type(each).lights is not Device.lights)
        self.course = GameFlow(board, self.holes, self.nudge)
        self.course.machines = self.machines
        self.up: set[str] = set()
        """the sides whose flippers are held up"""
        self.said = ("", 0.0)
        self._cues: list[str] = []
        self._now: StepContext | None = None

    @property
    def trough(self) -> Trough:
        """Where every ball is."""
        return self.course.trough

    @property
    def sheet(self) -> PlayerState:
        """Of who plays."""
        return self.course.sheet

    @property
    def score(self) -> int:
        """Of who plays; at the end, the best."""
        return max(each.score for each in self.course.sheets) if self.course.phase == "over" else self.sheet.score

    @property
    def game_over(self) -> str | None:
        """Why the game is over; None while it goes on."""
        if self.course.phase != "over":
            return None
        return "game over" if self.course.balls_left else "game over: no ball left on the table"

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        """Do what a player asks for; a tilted table obeys nobody, but lets go, and its plunger is only a rod.

        Raises:
            KeyError: there is no such control.
        """
        now, alive = self._now, self.course.alive
        if now is None:
            return ()
        if control in FLIPPERS:
            return self._flipped(FLIPPERS[control], value > 0.0 and alive, now)
        if control == PLUNGER:
            return self._settled(self._plunged(value if self.course.phase == "play" else 0.0, now), now)
        direction = NUDGES[control] * complex(*self.board.up)
        return self._settled(self.nudge.jolt(direction, value, now), now) if alive and value > 0.0 else ()

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        """See what happened in a step."""
        now = self._now = StepContext(info.time, info.frame, self.sheet)
        actions = self._settled(self._happens(info, now), now)
        self._refresh(now)
        return actions

    def display_lines(self) -> Sequence[tuple[str, str]]:
        """Return the score panel."""
        course, time = self.course, 0.0 if self._now is None else self._now.time
        message, until = self.said
        if self.nudge.tilted:
            message, until = "TILT!", time + SAID
        return display_lines(course.sheets, course.turn, self.modes, self._saved(time), message if time < until else "")

    def observation(self) -> Sequence[tuple[str, float]]:
        """Return what the panel and the lamps of lanes and targets show, as numbers."""
        saved = self._saved(0.0 if self._now is None else self._now.time)
        return list(observation(self.course, self.modes, self.multiball, self.lamps, self.banks, max(saved, 0.0)))

    def lit_lamps(self) -> frozenset[str]:
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

    def sounds(self) -> Sequence[str]:
        """Return the sounds since the last call."""
        cues, self._cues = self._cues, []
        return cues

    def _saved(self, time: float) -> float:
        """Return for how long drained balls come back, from a time on, s; 0 or less for none."""
        return 0.0 if self.course.fresh else self.course.saved - time

    def _refresh(self, now: StepContext) -> None:
        """Bring up to date what others than the engine change."""
        trough = self.trough
        now.sheet, now.live, now.waiting = self.sheet, tuple(trough.live), len(trough.queue)
        now.loose = tuple(ball for ball in trough.live if ball not in self.holes.held and not trough.in_lane(ball, now))
        now.up = frozenset(self.up)

    def _happens(self, info: StepInfo, now: StepContext) -> Iterator[Effect]:
        """Yield what a step has brought, each effect after those before it were carried out."""
        self._refresh(now)
        for hit in self.switches.read(info):
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

    def _hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        if hit.ball not in self.trough.live:  # an earlier hit of this step has taken it
            return
        self.course.touched = True
        if hit.element.role == "drain":
            yield from self.course.drained(hit.ball, now)
            return
        for machine in self.machines:
            yield from machine.hit(hit, now)

    def _flipped(self, side: str, up: bool, now: StepContext) -> list[Action]:
        """Raise the flippers of a side, or let them go."""
        if up and side not in self.up:
            self._cues.append("flipper")
            for lamps in self.lamps:
                lamps.rotate(side)
        (self.up.add if up else self.up.discard)(side)
        self._refresh(now)
        return [Drive(time=now.time, drive=each.name, level=float(up)) for each in self.board.flippers(side)]

    def _plunged(self, value: float, now: StepContext) -> Iterator[Effect]:
        """Pull the plunger, or let it go; a table without one launches the ball when it is let go."""
        plungers = self.board.of_role("plunger")
        if plungers:
            yield from (Drive(time=now.time, drive=each.name, level=value) for each in plungers)
        elif not value:
            for ball in now.live:
                if self.trough.in_lane(ball, now):
                    yield from self.trough.launched(ball, now)

    def _settled(self, effects: Iterable[Effect], now: StepContext) -> list[Action]:
        """Carry out effects, in order, and what machines make of them; return the actions among them."""
        actions: list[Action] = []
        for effect in effects:
            match effect:
                case Award():
                    actions += self._settled(self._awarded(effect, now), now)
                case PlaySound():
                    self._cues.append(effect.name)
                case ShowMessage():
                    self.said = (effect.text, now.time + SAID)
                case RemoveBall():
                    actions += self._settled(self.course.take(effect.ball, now), now)
                case ServeBalls():
                    for _ in range(effect.balls):
                        self.trough.serve(alone=True)
                case BallSave():
                    self.course.save(now.time + effect.seconds)
                case ExtraBall():
                    if self.course.again(effect.reason):
                        self._cues.append("extra ball")
                        self.said = ("shoot again", now.time + SAID)
                case _:
                    actions.append(effect)
        return actions

    def _awarded(self, award: Award, now: StepContext) -> Iterator[Effect]:
        """Score, unless the table is tilted, and let every machine hear of it."""
        if self.nudge.tilted:
            return
        yield from self.course.scored(award.points, award.bonus)
        for machine in self.machines:
            yield from machine.heard(award, now)
