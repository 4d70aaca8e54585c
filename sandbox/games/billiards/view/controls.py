"""Input at a billiard table: mouse and keys that aim, stroke, set english and power, call, decide and place.

`HumanPlayer` checks and applies the decisions of a player, `CueControls` interprets the mouse, `cue_key_handlers` the
keys. `BilliardsOverlay` adds cue and prediction to a snapshot. `TableGameHost` owns the game of the open scene.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Literal, get_args

import pygame

from sandbox.action import ActionError
from sandbox.games.billiards.game import MAX_CUE_SPEED, MIN_CUE_SPEED
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision, GameError, ShotCall
from sandbox.games.billiards.table_geometry import TableGeometry
from sandbox.games.billiards.view.prediction import CueAim, ShotPredictor
from sandbox.games.billiards.view.table_game import BilliardsGame, Players, plays
from sandbox.games.names import TableGame
from sandbox.scene.description.base import Point
from sandbox.scene.scene import Scene
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.snapshot import Snapshot


class HumanPlayer:
    """Player at the window: checks and applies decisions, calls, placements and strokes."""

    def __init__(self, game: BilliardsGame) -> None:
        self.game = game
        self._carried: tuple[int, Point] | None = None  # number of strokes at that time, and position
        self.refused = False
        """whether the cue ball may not be placed under the pointer"""
        self._chosen: tuple[Match, int] | None = None

    @property
    def carried(self) -> Point | None:
        """Position of a cue ball that is being placed, m; None if none is."""
        if self._carried is None or self._carried[0] != self.game.strokes or not self.game.mine:
            return None
        return self._carried[1]

    @property
    def place(self) -> Point:
        """Position of the ball that is struck next, m."""
        return self.carried or self.game.position[self.game.ball]

    @property
    def choice(self) -> Decision | None:
        """The decision that Enter takes; None if none is offered."""
        match = self.game.match
        decisions = match.choices.decisions
        if not decisions:
            return None
        chosen = self._chosen[1] if self._chosen is not None and self._chosen[0] is match else 0
        return decisions[chosen % len(decisions)]

    def choose_next(self) -> None:
        """Select the next of the offered decisions.

        Raises:
            ActionError: there are none.
        """
        self.game.check()
        now, match = self.choice, self.game.match
        if now is None:
            raise ActionError("there is nothing to decide")
        self._chosen = match, match.choices.decisions.index(now) + 1

    def take_choice(self) -> None:
        """Take the selected decision.

        Raises:
            ActionError: there are none.
        """
        self.game.check()
        if self.choice is None:
            raise ActionError("there is nothing to decide")
        self.decide(self.choice)

    def decide(self, decision: Decision) -> None:
        """Take a decision.

        Raises:
            ActionError: it is not offered now.
        """
        self.game.check()
        try:
            match = self.game.match.decide(decision)
        except GameError as error:
            raise ActionError(str(error)) from None
        self.game.go_another_way(match)

    def say(self, call: ShotCall) -> None:
        """Call a ball or a pocket.

        Raises:
            ActionError: it cannot be called now.
        """
        self.game.check()
        try:
            self.game.match.choices.check(call)
        except GameError as error:
            raise ActionError(str(error)) from None
        self.game.say(call)

    def call_safety(self) -> None:
        """Call a safety, or withdraw the call.

        Raises:
            ActionError: it cannot be called now.
        """
        self.say(replace(self.game.call, safety=not self.game.call.safety))

    def shoot(self, speed: float | None = None) -> None:
        """Play the stroke; a cue ball that is being placed is put down first.

        Args:
            speed: cue speed, m/s; default: the power that is set.

        Raises:
            ActionError: the stroke cannot be played now.
        """
        self.put_down()
        self.game.shoot(speed)

    def take_in_hand(self) -> None:
        """Take the cue ball in hand, or put it down.

        Raises:
            ActionError: by the rules the cue ball is not in hand.
        """
        if self.carried is not None:
            self.put_down()
            return
        self.game.check()
        if self.game.match.state.in_hand is None:
            if "in hand" not in self.game.match.choices.decisions:
                raise ActionError("the cue ball is not in hand")
            self.decide("in hand")
        self._carried, self.refused = (self.game.strokes, self.place), False

    def carry(self, at: Point) -> None:
        """Move a cue ball that is being placed to the allowed place nearest to a point, m."""
        match = self.game.match
        if self.carried is None or match.state.in_hand is None:
            return
        self.refused = match.refusal(at) is not None
        try:
            self._carried = self.game.strokes, match.nearest(at)
        except GameError:  # no room on the table: the ball stays
            self.refused = True

    def put_down(self) -> None:
        """Put down a ball that is being placed.

        Raises:
            ActionError: its place is not allowed.
        """
        at, self._carried = self.carried, None
        if at is None:
            return
        try:
            match = self.game.match.place(at)
        except GameError as error:
            raise ActionError(str(error)) from None
        self.game.go_another_way(match)


class BilliardsOverlay:
    """Computes the values to draw of the next stroke."""

    def __init__(self, person: HumanPlayer) -> None:
        self._person = person
        self._forecaster = ShotPredictor(person.game.match.scene)

    def over(self, sight: Snapshot) -> Snapshot:
        """Return a snapshot with the aim, and with a ball that is being placed at the pointer."""
        aim = self.aim()
        if aim is None or not aim.carried:
            return replace(sight, game=aim)
        position = sight.frame.position.copy()
        position[aim.ball] = aim.place
        return replace(sight, game=aim, frame=replace(sight.frame, position=position))

    def aim(self) -> CueAim | None:
        """Return the values to draw of the next stroke; None while balls roll or the bot searches."""
        person, game = self._person, self._person.game
        if not game.aiming or game.bot_is_thinking:
            return None
        match, cue, call, ball = game.match, game.cue, game.call, game.ball
        carried = person.carried is not None
        pocket = match.layout.pockets.get(call.pocket or "")
        return CueAim(
            ball=ball,
            place=person.place,
            angle=cue.aim,
            side=cue.side,
            back=cue.back,
            forecast=None if carried else self._forecaster.of(cue.stroke, ball, game.position),
            carried=carried,
            refused=person.refused,
            called=None if pocket is None else ((pocket[0], pocket[1]), pocket[2]),
            nominated=match.layout.number.get(call.ball or ""),
        )


CueMode = Literal["aim", "stroke", "draw", "english", "power"]

FINE = 0.08
"""factor of mouse movements with Shift"""
ROOM = 0.5
"""m, greatest draw-back of the cue"""
DRAWN = 0.015
"""m, least draw-back for a stroke"""
RECENT = 0.07
"""s over which the speed of a stroke is measured"""
DIAL = 90.0
"""px at unit 1 of mouse movement from the centre of the ball to its edge, and for half of the power"""
NEAR = 1.5
"""distance of the pointer from the cue ball, in radii, below which it does not aim"""


class CueControls:
    """Interprets mouse and keys at the table."""

    def __init__(self, person: HumanPlayer) -> None:
        self.person, self.game = person, person.game
        self.seen = BilliardsOverlay(person)
        self.mode: CueMode = "aim"
        self._offset: float | None = None
        """rad from the direction of the pointer to that of the cue; None before the first movement of the mouse"""
        self._strokes = 0
        self._drawn = 0.0
        self._deepest = 0.0
        self._recent: deque[tuple[float, float]] = deque()

    def begin(self, mode: CueMode) -> None:
        """Start a mode of the mouse, stroke, english or power, while its key is held."""
        self._end()
        self.mode = mode

    def end(self) -> None:
        """End the mode, when its key is released."""
        self._end()

    def _end(self) -> None:
        self.mode, self._drawn, self._deepest = "aim", 0.0, 0.0
        self._recent.clear()
        self.game.cue.back = 0.0

    def motion(self, before: Point, now: Point, pixels: tuple[float, float], fine: bool, time: float) -> None:
        """Handle a movement of the mouse.

        Args:
            before: previous position, m.
            now: present position, m.
            pixels: movement to the right and downwards, px at unit 1.
            fine: whether the effect is reduced, `FINE`.
            time: time of the event, s.

        Raises:
            ActionError: a stroke cannot be played.
        """
        game = self.game
        if self.person.carried is not None:
            self.person.carry(now)
            return
        if not game.mine:
            return
        cue, share = game.cue, FINE if fine else 1.0
        if self.mode == "english":
            cue.tip_at(cue.side + share * pixels[0] / DIAL, cue.height - share * pixels[1] / DIAL)
        elif self.mode == "power":
            cue.power -= share * pixels[1] / (2.0 * DIAL)
        elif self.mode == "aim":
            self._turn(before, now, fine)
        else:
            x, y = cue.way
            self._push((now[0] - before[0]) * x + (now[1] - before[1]) * y, time)

    def _turn(self, before: Point, now: Point, fine: bool) -> None:
        cue, (x, y) = self.game.cue, self.person.place
        match = self.game.match
        if math.dist((x, y), now) < NEAR * match.layout.radius[self.game.ball]:
            return
        angle = math.atan2(now[1] - y, now[0] - x)
        if self._offset is None or self._strokes != self.game.strokes:
            self._offset, self._strokes = 0.0, self.game.strokes
        if fine:
            turned = math.remainder(angle - math.atan2(before[1] - y, before[0] - x), math.tau)
            self._offset = math.remainder(cue.aim + FINE * turned - angle, math.tau)
        cue.aim = angle + self._offset

    def nudge(self, by: float) -> None:
        """Turn the cue by an angle, rad."""
        if self.game.mine:
            self.game.cue.aim += by
            self._offset = (self._offset or 0.0) + by

    def strengthen(self, by: float) -> None:
        """Change the power by a fraction of the greatest."""
        if self.game.mine:
            self.game.cue.power += by

    def _push(self, forth: float, time: float) -> None:
        """Move the cue along its direction, m; reaching the ball after a draw-back is a stroke."""
        self._drawn = min(self._drawn - forth, ROOM)
        self._deepest = max(self._deepest, self._drawn)
        self._recent.append((time, forth))
        while self._recent and self._recent[0][0] < time - RECENT:
            self._recent.popleft()
        self.game.cue.back = max(self._drawn, 0.0)
        if self.mode == "draw":
            self.game.cue.power = min(self.game.cue.back / ROOM, 1.0)
        elif self._drawn <= 0.0 and self._deepest >= DRAWN:
            speed = sum(each for _, each in self._recent) / RECENT
            self._end()
            self.person.shoot(min(max(speed, MIN_CUE_SPEED), MAX_CUE_SPEED))
        self._drawn = max(self._drawn, 0.0)

    def press(self, at: Point, reach: float) -> bool:
        """Handle a press of the left button at a point, m; return whether it is used.

        On a cue ball in hand it starts to place the ball; away from all balls it starts to draw back the cue; while
        a ball is being placed it puts the ball down.

        Raises:
            ActionError: the place of the ball is not allowed.
        """
        game, person = self.game, self.person
        if person.carried is not None:
            person.put_down()
            return True
        if not game.mine:
            return False
        match = game.match
        radius = match.layout.radius[game.ball]
        if math.dist(person.place, at) <= radius + reach:
            if match.state.in_hand is None:
                return False
            person.take_in_hand()
            return True
        if any(math.dist((x, y), at) <= r + reach for x, y, r in match.on_table.values()):
            return False
        self.begin("draw")
        return True

    def release(self, at: Point, moved: bool) -> bool:
        """Handle a release of the left button at a point, m; return whether it is used.

        Raises:
            ActionError: a stroke cannot be played, or the place of a ball is not allowed.
        """
        if self.person.carried is not None and moved:
            self.person.put_down()
            return True
        if self.mode != "draw":
            return False
        drawn = self.game.cue.back
        self._end()
        if drawn >= DRAWN:
            self.person.shoot()
        elif not moved:
            self._name(at)
        return True

    def _name(self, at: Point) -> None:
        """Call the clicked pocket, or withdraw the call."""
        match, call = self.game.match, self.game.call
        pocket = match.layout.pocket_at(at)
        if pocket is not None and match.choices.pocket:
            self.person.say(replace(call, pocket=None if pocket == call.pocket else pocket))

    def name_ball(self, number: int) -> bool:
        """Call a clicked ball if it may be called, or withdraw the call; return whether it may.

        Raises:
            ActionError: it cannot be called now.
        """
        match, call = self.game.match, self.game.call
        name = match.layout.names[number]
        if not self.game.mine or name not in match.choices.balls:
            return False
        self.person.say(replace(call, ball=None if name == call.ball else name))
        return True


TURN, FINER = 0.002, 0.0001
"""rad by which an arrow key turns the cue, without and with Shift"""
POWER_STEP = 0.02
"""fraction of the greatest power by which an arrow key changes it"""

CUE_KEY_HELP = (
    ("Mouse", "aim; Shift: fine"),
    ("Left or Right", "fine aim; Shift: finer"),
    ("Up or Down", "power"),
    ("S (hold)", "stroke: pull back, push forward"),
    ("Left-drag", "draw the cue back, release"),
    ("E (hold)", "english: where the tip hits"),
    ("X (hold)", "set the power"),
    ("Space", "shoot"),
    ("G", "cue ball in hand"),
    ("Z", "undo shot"),
    ("Click", "call a ball, or a pocket"),
    ("C", "call a safety"),
    ("D", "next choice, if any"),
    ("Enter", "confirm the choice"),
)
"""keys and their descriptions in the help overlay"""


def cue_key_handlers(gestures: CueControls) -> tuple[dict[int, Callable[[], object]], dict[int, Callable[[], object]]]:
    """Return the handlers of pressed and of released keys."""
    game, person = gestures.game, gestures.person
    pressed: dict[int, Callable[[], object]] = {
        pygame.K_SPACE: person.shoot,
        pygame.K_g: person.take_in_hand,
        pygame.K_z: game.undo,
        pygame.K_LEFT: lambda: gestures.nudge(_step()),
        pygame.K_RIGHT: lambda: gestures.nudge(-_step()),
        pygame.K_UP: lambda: gestures.strengthen(POWER_STEP),
        pygame.K_DOWN: lambda: gestures.strengthen(-POWER_STEP),
        pygame.K_c: person.call_safety,
        pygame.K_d: person.choose_next,
        pygame.K_RETURN: person.take_choice,
    }
    released: dict[int, Callable[[], object]] = {}
    modes: tuple[tuple[int, CueMode], ...] = (
        (pygame.K_s, "stroke"),
        (pygame.K_e, "english"),
        (pygame.K_x, "power"),
    )
    for key, mode in modes:
        pressed[key] = partial(gestures.begin, mode)
        released[key] = gestures.end
    return pressed, released


def _step() -> float:
    return FINER if pygame.key.get_mods() & pygame.KMOD_SHIFT else TURN


def prepared_scene(scene: Scene) -> Scene:
    """Return a scene as the window plays it: without its own shots if it names a game."""
    return TableGeometry.of(scene).scene if scene.play.game in get_args(TableGame) else scene


class TableGameHost:
    """Owner of the game and its controls; both are None if the open scene is not a billiard table."""

    def __init__(self) -> None:
        self.game: BilliardsGame | None = None
        """game of the open scene"""
        self.gestures: CueControls | None = None
        """controls of the game"""
        self.players: Players | None = None
        """players of the next game; None for the default of the game"""
        self.misses = False
        """whether the foul-and-a-miss rule applies, from the next game of snooker"""

    def take(self, live: LiveView, file: Scene, tell: Callable[[str, str], None]) -> None:
        """Start a game if the scene of a session is a table.

        Args:
            live: the session.
            file: its scene as in the file.
            tell: receives the reason and its level if the game cannot be played.
        """
        if not plays(live.scene):
            return
        # The cue is set to the shot of the file, unless the session plays that shot itself.
        shot = file.shots[0] if file.shots and not live.scene.shots else None
        try:
            self.game = BilliardsGame(live, self.players, shot, self.misses)
        except GameError as error:
            tell(str(error), "warning")
        else:
            self.gestures = CueControls(HumanPlayer(self.game))

    def leave(self) -> None:
        """End the game."""
        if self.game is not None:
            self.game.close()
        self.game = self.gestures = None
