"""Rules of pinball: controls, score panel, observation for learning agents, and the rules that run the devices."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from sandbox.action import Action, Drive
from sandbox.games.contract import FLAG, Control, ObservationRange, StepInfo, position_ranges
from sandbox.games.pinball.ball_control import BallSearch, Trough
from sandbox.games.pinball.devices import Kickers, LaneLights, Ramps, ScoringSwitches, SpinnerDevice, lane_lights_of
from sandbox.games.pinball.drop_targets import DropTargetBanks, banks_of
from sandbox.games.pinball.events import (
    BALL_COUNT,
    MAX_BONUS_MULTIPLIER,
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
from sandbox.games.pinball.game_flow import BALL_SAVE_TIME, GameFlow
from sandbox.games.pinball.modes import MULTIBALL_SAVE, Modes, Multiball
from sandbox.games.pinball.playfield import Playfield
from sandbox.games.pinball.tilt import MAX_WARNINGS, NudgeAndTilt
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene

LEFT, RIGHT, PLUNGER = "left flipper", "right flipper", "plunger"

FLIPPERS = {LEFT: "left", RIGHT: "right"}
"""control → side"""

NUDGES = {"nudge": 1.0 + 0j, "nudge left": 1j, "nudge right": -1j}
"""control → direction of the balls, as a rotation from the upward direction of the table"""

NUDGE_FREQUENCY = 0.05
"""frequency of random nudges, relative to other controls: the third nudge during a ball tilts the table"""

PLUNGER_DEAD_ZONE, NUDGE_DEAD_ZONE = 0.1, 0.5
"""values in actions of environments up to which plunger and nudges count as released"""

CONTROLS = (
    Control(LEFT, "left flipper; lane lights move left", ("left shift", "z"), "lb lt"),
    Control(RIGHT, "right flipper; lane lights move right", ("right shift", "/"), "rb rt"),
    Control(
        PLUNGER, "hold to pull the plunger, release to shoot", ("enter",), "a +righty", True, 1.0, PLUNGER_DEAD_ZONE
    ),
    Control("nudge", "nudge the table: balls move up", ("space",), "y up", True, NUDGE_FREQUENCY, NUDGE_DEAD_ZONE),
    Control(
        "nudge left", "nudge the table: balls move left", ("left",), "left", True, NUDGE_FREQUENCY, NUDGE_DEAD_ZONE
    ),
    Control(
        "nudge right", "nudge the table: balls move right", ("right",), "right", True, NUDGE_FREQUENCY, NUDGE_DEAD_ZONE
    ),
)


Gauge = tuple[str, float]


def observation(
    flow: GameFlow,
    modes: Modes,
    multiball: Multiball,
    lamps: Sequence[LaneLights],
    banks: Sequence[DropTargetBanks],
    saved: float,
) -> Iterator[Gauge]:
    """Yield names and values; names and order are constant.

    Args:
        flow: state of players and balls.
        modes: modes of the game.
        multiball: multiball of the game.
        lamps: sets of lanes and standup targets.
        banks: banks of drop targets.
        saved: remaining ball save, s; 0 for none.
    """
    sheet, nudge = flow.sheet, flow.nudge
    yield "player", flow.turn
    yield "ball", sheet.ball
    yield "shoot again", sheet.extra_balls
    yield "bonus", sheet.bonus
    yield "bonus times", sheet.bonus_multiplier
    yield "ball save", saved
    yield "balls in play", len(flow.trough.in_play)
    yield "locked", sheet.locked
    yield "lock lit", sheet.is_lock_lit
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
        down = {*bank.down, *bank.falling}
        yield from ((f"{target.name} down", k in down) for k, target in enumerate(bank.members))


DisplayLine = tuple[str, str]


def display_lines(
    sheets: Sequence[PlayerState], turn: int, modes: Modes, saved: float, message: str
) -> list[DisplayLine]:
    """Return labels and texts, the most important first, without the score, which the host shows.

    Args:
        sheets: states of the players.
        turn: index of the present player.
        modes: modes of the game.
        saved: remaining ball save, s; 0 or less for none.
        message: last message; empty for none.
    """
    sheet = sheets[turn]
    ball = f"{min(sheet.ball, BALL_COUNT)} of {BALL_COUNT}"
    lines = [("Ball", f"{ball}, shoot again" if sheet.extra_balls else ball)]
    if len(sheets) > 1:
        lines.insert(0, ("Player", f"{turn + 1} of {len(sheets)}"))
        lines += [(f"Player {k + 1}", f"{each.score:,}") for k, each in enumerate(sheets) if k != turn]
    lines.append(("Bonus", f"{sheet.bonus:,} × {sheet.bonus_multiplier}"))
    if sheet.locked or sheet.is_lock_lit:
        lit = ["lock is lit"] if sheet.is_lock_lit else []
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


MESSAGE_TIME = 3.0
"""s for which a message is shown"""

BLINK_PERIOD = 0.4
"""s"""


class PinballRules:
    """A game of three balls for one to four players."""

    controls: tuple[Control, ...] = CONTROLS

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Start a game.

        Raises:
            UnsuitableSceneError: the scene has no ball.
        """
        self.board = board = Playfield.of(scene, bodies)
        self.switches, self.holes, self.nudge = Switches(board), Kickers(board), NudgeAndTilt(board)
        self.banks, self.lamps = banks_of(board), lane_lights_of(board)
        self.modes, self.multiball = Modes(board), Multiball(board)
        self.devices: tuple[Device, ...] = (
            ScoringSwitches(), *self.lamps, *self.banks, *(SpinnerDevice(each) for each in board.of_role("spinner")),
            self.holes, Ramps(board), self.modes, self.multiball, self.nudge,
            BallSearch(board, self.holes, self.banks),
        )  # fmt: skip
        self._ticking = tuple(each for each in self.devices if type(each).tick is not Device.tick)
        self._lamped = tuple(each for each in self.devices if type(each).lights is not Device.lights)
        self.flow = GameFlow(board, self.holes, self.nudge)
        self.flow.devices = self.devices
        self.raised_sides: set[str] = set()
        """sides whose flippers are up"""
        self.message = ("", 0.0)
        """last message, and the time until which it is shown, s"""
        self._cues: list[str] = []
        self._now: StepContext | None = None

    @property
    def trough(self) -> Trough:
        """Trough: the balls in play and out of play."""
        return self.flow.trough

    @property
    def sheet(self) -> PlayerState:
        """State of the present player."""
        return self.flow.sheet

    @property
    def score(self) -> int:
        """Score of the present player; after the game, the best score."""
        return max(each.score for each in self.flow.sheets) if self.flow.phase == "over" else self.sheet.score

    @property
    def game_over(self) -> str | None:
        """Reason why the game is over; None while it runs."""
        if self.flow.phase != "over":
            return None
        return "game over" if self.flow.balls_left else "game over: no ball left on the table"

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        """Return the actions of an input. While tilted, flippers only fall, nudges do nothing, and the plunger works.

        Raises:
            KeyError: there is no such control.
        """
        now, alive = self._now, self.flow.alive
        if now is None:
            return ()
        if control in FLIPPERS:
            return self._set_flippers(FLIPPERS[control], value > 0.0 and alive, now)
        if control == PLUNGER:
            return self._apply(self._set_plunger(value if self.flow.phase == "play" else 0.0, now), now)
        direction = NUDGES[control] * complex(*self.board.up)
        return self._apply(self.nudge.jolt(direction, value, now), now) if alive and value > 0.0 else ()

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        """Run the devices on a step, and return their actions."""
        now = self._now = StepContext(info.time, info.frame, self.sheet)
        actions = self._apply(self._step(info, now), now)
        self._update_context(now)
        return actions

    def display_lines(self) -> Sequence[tuple[str, str]]:
        """Return the lines of the score panel."""
        flow, time = self.flow, 0.0 if self._now is None else self._now.time
        message, until = self.message
        if self.nudge.tilted:
            message, until = "TILT!", time + MESSAGE_TIME
        return display_lines(flow.sheets, flow.turn, self.modes, self._saved(time), message if time < until else "")

    def observation(self) -> Sequence[tuple[str, float]]:
        """Return the state of the game that panel and lamps show, as numbers."""
        saved = self._saved(0.0 if self._now is None else self._now.time)
        return list(observation(self.flow, self.modes, self.multiball, self.lamps, self.banks, max(saved, 0.0)))

    def observation_ranges(self) -> Mapping[str, ObservationRange]:
        """Return the ranges of the state of the game, and of the positions of the balls."""
        board, modes = self.board, self.modes.modes
        return {
            **position_ranges(board.names.values(), *board.corners),
            **{name: FLAG for name, _ in self.observation()},  # those that are not stated below
            "player": ObservationRange(0.0, max(board.players - 1.0, 1.0)),
            "ball": ObservationRange(1.0, BALL_COUNT + 1.0),
            "shoot again": ObservationRange(0.0),
            "bonus": ObservationRange(0.0),
            "bonus times": ObservationRange(1.0, float(MAX_BONUS_MULTIPLIER)),
            "ball save": ObservationRange(0.0, max(BALL_SAVE_TIME, MULTIBALL_SAVE), "s"),
            "balls in play": ObservationRange(0.0, float(len(board.balls))),
            "locked": ObservationRange(0.0, float(self.multiball.size)),
            "mode": ObservationRange(0.0, max(float(len(modes)), 1.0)),
            "mode left": ObservationRange(0.0, max((mode.seconds for mode in modes), default=1.0), "s"),
            "mode to go": ObservationRange(0.0, float(max((mode.needed for mode in modes), default=1))),
            "warnings": ObservationRange(0.0, MAX_WARNINGS + 1.0),
        }

    def lit_lamps(self) -> frozenset[str]:
        """Return the names of the parts whose lamps are lit; a tilted table is dark."""
        now = self._now
        if now is None or self.nudge.tilted:
            return frozenset()
        lights = [light for device in self._lamped for light in device.lights(now)]
        if not lights:
            return frozenset()
        blinking = {light.name for light in lights if light.blinks}
        on = blinking if now.time % BLINK_PERIOD < 0.5 * BLINK_PERIOD else set[str]()
        return frozenset(on | {light.name for light in lights} - blinking)

    def sounds(self) -> Sequence[str]:
        """Return the sounds since the last call."""
        cues, self._cues = self._cues, []
        return cues

    def _saved(self, time: float) -> float:
        """Return the remaining ball save at a time, s; 0 or less for none."""
        return 0.0 if self.flow.fresh else self.flow.saved - time

    def _update_context(self, now: StepContext) -> None:
        """Update the context by the state of trough and kickers."""
        trough, held = self.trough, self.holes.held
        now.sheet, now.balls_in_play, now.waiting = self.sheet, tuple(trough.in_play), len(trough.queue)
        now.loose_balls = tuple(ball for ball in trough.in_play if ball not in held and not trough.in_lane(ball, now))
        now.raised_sides = frozenset(self.raised_sides)

    def _step(self, info: StepInfo, now: StepContext) -> Iterator[Effect]:
        """Yield the effects of a step; each is applied before the next is computed."""
        self._update_context(now)
        for hit in self.switches.read(info):
            if hit.ball in now.balls_in_play:
                yield from self._hit(hit, now)
        yield from self.flow.recover_balls(now)
        self._update_context(now)
        tilted = self.nudge.tilted
        for device in self._ticking:
            yield from device.tick(now)
        if self.nudge.tilted and not tilted:
            self.flow.save(0.0)
            for side in sorted(self.raised_sides):
                yield from self._set_flippers(side, False, now)
            self._update_context(now)
        yield from self.trough.tick(now)
        yield from self.flow.update(now)

    def _hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        if hit.ball not in self.trough.in_play:  # an earlier hit of this step removed it
            return
        self.flow.touched = True
        if hit.element.role == "drain":
            yield from self.flow.on_drain(hit.ball, now)
            return
        for device in self.devices:
            yield from device.on_hit(hit, now)

    def _set_flippers(self, side: str, up: bool, now: StepContext) -> list[Action]:
        """Raise or release the flippers of a side."""
        if up and side not in self.raised_sides:
            self._cues.append("flipper")
            for lamps in self.lamps:
                lamps.rotate(side)
        (self.raised_sides.add if up else self.raised_sides.discard)(side)
        now.raised_sides = frozenset(self.raised_sides)
        return [Drive(time=now.time, drive=each.name, level=float(up)) for each in self.board.flippers(side)]

    def _set_plunger(self, value: float, now: StepContext) -> Iterator[Effect]:
        """Pull or release the plunger; a table without one launches the ball on release."""
        plungers = self.board.of_role("plunger")
        if plungers:
            yield from (Drive(time=now.time, drive=each.name, level=value) for each in plungers)
        elif not value:
            for ball in now.balls_in_play:
                if self.trough.in_lane(ball, now):
                    yield from self.trough.launch(ball, now)

    def _apply(self, effects: Iterable[Effect], now: StepContext) -> list[Action]:
        """Apply effects in order, and the effects that follow from them; return the actions among them."""
        actions: list[Action] = []
        for effect in effects:
            match effect:
                case Award():
                    actions += self._apply(self._award(effect, now), now)
                case PlaySound():
                    self._cues.append(effect.name)
                case ShowMessage():
                    self.message = (effect.text, now.time + MESSAGE_TIME)
                case RemoveBall():
                    actions += self._apply(self.flow.remove_ball(effect.ball, now), now)
                case ServeBalls():
                    for _ in range(effect.balls):
                        self.trough.serve(automatic=True)
                case BallSave():
                    self.flow.save(now.time + effect.seconds)
                case ExtraBall():
                    if self.flow.award_extra_ball(effect.reason):
                        self._cues.append("extra ball")
                        self.message = ("shoot again", now.time + MESSAGE_TIME)
                case _:
                    actions.append(effect)
        return actions

    def _award(self, award: Award, now: StepContext) -> Iterator[Effect]:
        """Add an award to the score, and notify every device; nothing happens if the table is tilted."""
        if self.nudge.tilted:
            return
        yield from self.flow.add_points(award.points, award.bonus)
        for device in self.devices:
            yield from device.on_award(award, now)
