"""Input at a billiard table: mouse and keys that aim, stroke, set english and power, call, decide and place.

`CueControls` interprets the mouse and the keys for a `BilliardsPlayer`. `BilliardsControls` joins them with the cue and
the prediction that the view draws, and with the HUD, as the `GameControls` of billiards.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Literal, NamedTuple

import pygame

from sandbox.games.billiards.game import MAX_CUE_SPEED, MIN_CUE_SPEED, BilliardsRules, select_value
from sandbox.games.billiards.view.bot_player import BotPlayer
from sandbox.games.billiards.view.hud import BilliardsHud
from sandbox.games.billiards.view.player import BOT, PLAYERS, BilliardsPlayer
from sandbox.games.billiards.view.prediction import CueAim, CueState, ShotPredictor
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.window.game_controls import ControlBindings, GameParameter
from sandbox.window.game_host import GameHost
from sandbox.window.playback.snapshot import Snapshot

CueMode = Literal["aim", "stroke", "draw", "english", "power"]

FINE_FACTOR = 0.08
"""factor of mouse movements with Shift"""
MAX_DRAW_BACK = 0.5
"""m, greatest draw-back of the cue"""
MIN_DRAW_BACK = 0.015
"""m, least draw-back for a stroke"""
SPEED_WINDOW = 0.07
"""s over which the speed of a stroke is measured"""
DIAL_RADIUS = 90.0
"""px at unit 1 of mouse movement from the centre of the ball to its edge, and for half of the power"""
MIN_AIM_DISTANCE = 1.5
"""distance of the pointer from the cue ball, in radii, below which it does not aim"""


class CueControls:
    """Interprets mouse and keys at the table."""

    def __init__(self, player: BilliardsPlayer) -> None:
        self.player = player
        self.mode: CueMode = "aim"
        self._offset: float | None = None
        """rad from the direction of the pointer to that of the cue; None before the first movement of the mouse"""
        self._strokes = 0
        self._drawn = 0.0
        self._deepest = 0.0
        self._recent: deque[tuple[float, float]] = deque()

    def begin(self, mode: CueMode) -> None:
        """Start a mode of the mouse, stroke, english or power, while its key is held."""
        self.end()
        self.mode = mode

    def end(self) -> None:
        """End the mode, when its key is released."""
        self.mode, self._drawn, self._deepest = "aim", 0.0, 0.0
        self._recent.clear()
        self.player.cue.back = 0.0

    def move(self, before: Point, now: Point, pixels: tuple[float, float], fine: bool, time: float) -> None:
        """Handle a movement of the mouse; see `GameControls`.

        Raises:
            ActionError: a stroke cannot be played.
        """
        player = self.player
        if player.carried is not None:
            player.carry(now)
            return
        if not player.is_own_turn:
            return
        cue, factor = player.cue, FINE_FACTOR if fine else 1.0
        if self.mode == "english":
            cue.tip_at(cue.side + factor * pixels[0] / DIAL_RADIUS, cue.height - factor * pixels[1] / DIAL_RADIUS)
        elif self.mode == "power":
            cue.power -= factor * pixels[1] / (2.0 * DIAL_RADIUS)
        elif self.mode == "aim":
            self._aim(before, now, fine)
        else:
            x, y = cue.direction
            self._push((now[0] - before[0]) * x + (now[1] - before[1]) * y, time)

    def _aim(self, before: Point, now: Point, fine: bool) -> None:
        player, cue, (x, y) = self.player, self.player.cue, self.player.place
        if math.dist((x, y), now) < MIN_AIM_DISTANCE * player.match.layout.radius[player.ball]:
            return
        angle = math.atan2(now[1] - y, now[0] - x)
        if self._offset is None or self._strokes != player.strokes:
            self._offset, self._strokes = 0.0, player.strokes
        if fine:
            turned = math.remainder(angle - math.atan2(before[1] - y, before[0] - x), math.tau)
            self._offset = math.remainder(cue.aim + FINE_FACTOR * turned - angle, math.tau)
        cue.aim = angle + self._offset

    def turn(self, change: float) -> None:
        """Turn the cue by an angle, rad."""
        if self.player.is_own_turn:
            self.player.cue.aim += change
            self._offset = (self._offset or 0.0) + change

    def change_power(self, change: float) -> None:
        """Change the power by a fraction of the greatest."""
        if self.player.is_own_turn:
            self.player.cue.power += change

    def _push(self, forward: float, time: float) -> None:
        """Move the cue along its direction, m; reaching the ball after a draw-back is a stroke."""
        self._drawn = min(self._drawn - forward, MAX_DRAW_BACK)
        self._deepest = max(self._deepest, self._drawn)
        self._recent.append((time, forward))
        while self._recent and self._recent[0][0] < time - SPEED_WINDOW:
            self._recent.popleft()
        cue = self.player.cue
        cue.back = max(self._drawn, 0.0)
        if self.mode == "draw":
            cue.power = min(cue.back / MAX_DRAW_BACK, 1.0)
        elif self._drawn <= 0.0 and self._deepest >= MIN_DRAW_BACK:
            speed = sum(each for _, each in self._recent) / SPEED_WINDOW
            self.end()
            self.player.shoot(min(max(speed, MIN_CUE_SPEED), MAX_CUE_SPEED))
        self._drawn = max(self._drawn, 0.0)

    def press(self, at: Point, tolerance: float) -> bool:
        """Handle a press of the left button at a point, m; return whether it is used.

        On a cue ball in hand it starts to place the ball; away from all balls it starts to draw back the cue; while
        a ball is being placed it puts the ball down.

        Raises:
            ActionError: the place of the ball is not allowed.
        """
        player = self.player
        if player.carried is not None:
            player.put_down()
            return True
        if not player.is_own_turn:
            return False
        match = player.match
        radius = match.layout.radius[player.ball]
        if math.dist(player.place, at) <= radius + tolerance:
            if match.state.in_hand is None:
                return False
            player.toggle_in_hand()
            return True
        if any(math.dist((x, y), at) <= r + tolerance for x, y, r in match.on_table.values()):
            return False
        self.begin("draw")
        return True

    def release(self, at: Point, moved: bool, picked: int | None = None) -> None:
        """Handle a release of the left button at a point, m; see `GameControls`.

        Raises:
            ActionError: a stroke or a call cannot be made, or the place of a ball is not allowed.
        """
        player = self.player
        if player.carried is not None and moved:
            player.put_down()
        elif self.mode == "draw":
            drawn = player.cue.back
            self.end()
            if drawn >= MIN_DRAW_BACK:
                player.shoot()
            elif not moved:
                self._call_pocket(at)
        elif picked is not None:
            self._call_ball(picked)

    def _call_pocket(self, at: Point) -> None:
        """Call the clicked pocket, or withdraw the call."""
        match, call = self.player.match, self.player.call
        pocket = match.layout.pocket_at(at)
        if pocket is not None and match.choices.pocket:
            self.player.call_shot(replace(call, pocket=None if pocket == call.pocket else pocket))

    def _call_ball(self, index: int) -> None:
        """Call a clicked ball if it may be called, or withdraw the call."""
        match, call = self.player.match, self.player.call
        if index >= len(match.layout.names):  # a body that was added by hand
            return
        name = match.layout.names[index]
        if self.player.is_own_turn and name in match.choices.balls:
            self.player.call_shot(replace(call, ball=None if name == call.ball else name))


TURN_STEP, FINE_TURN_STEP = 0.002, 0.0001
"""rad by which an arrow key turns the cue, without and with Shift"""
POWER_STEP = 0.02
"""fraction of the greatest power by which an arrow key changes it"""


class CueKey(NamedTuple):
    """Keys at a table, or use of the mouse, as a line of the help page."""

    label: str
    about: str
    actions: Mapping[int, Callable[[CueControls], object]] = {}
    """handlers of presses by pygame key code"""
    is_held: bool = False
    """whether the mode of the mouse that a press begins ends with the release"""


def _hold(label: str, about: str, key: int, mode: CueMode) -> CueKey:
    return CueKey(f"{label} (hold)", about, {key: lambda cue: cue.begin(mode)}, is_held=True)


CUE_KEYS = (
    CueKey("Mouse", "aim; Shift: fine"),
    CueKey(
        "Left or Right",
        "fine aim; Shift: finer",
        {pygame.K_LEFT: lambda cue: cue.turn(_angle_step()), pygame.K_RIGHT: lambda cue: cue.turn(-_angle_step())},
    ),
    CueKey(
        "Up or Down",
        "power",
        {
            pygame.K_UP: lambda cue: cue.change_power(POWER_STEP),
            pygame.K_DOWN: lambda cue: cue.change_power(-POWER_STEP),
        },
    ),
    _hold("S", "stroke: pull back, push forward", pygame.K_s, "stroke"),
    CueKey("Left-drag", "draw the cue back, release"),
    _hold("E", "english: where the tip hits", pygame.K_e, "english"),
    _hold("X", "set the power", pygame.K_x, "power"),
    CueKey("Space", "shoot", {pygame.K_SPACE: lambda cue: cue.player.shoot()}),
    CueKey("G", "cue ball in hand", {pygame.K_g: lambda cue: cue.player.toggle_in_hand()}),
    CueKey("Z", "undo shot", {pygame.K_z: lambda cue: cue.player.undo()}),
    CueKey("Click", "call a ball, or a pocket"),
    CueKey("C", "call a safety", {pygame.K_c: lambda cue: cue.player.toggle_safety()}),
    CueKey("D", "next choice, if any", {pygame.K_d: lambda cue: cue.player.choose_next()}),
    CueKey("Enter", "confirm the choice", {pygame.K_RETURN: lambda cue: cue.player.take_choice()}),
)
CUE_KEY_HELP = tuple((row.label, row.about) for row in CUE_KEYS)
"""keys and their descriptions in the help overlay"""


def cue_bindings(cue: CueControls) -> ControlBindings:
    """Return the key bindings at a table."""
    pressed = {key: partial(action, cue) for row in CUE_KEYS for key, action in row.actions.items()}
    return ControlBindings(
        pressed, {key: cue.end for row in CUE_KEYS if row.is_held for key in row.actions}, CUE_KEY_HELP
    )


def _angle_step() -> float:
    return FINE_TURN_STEP if pygame.key.get_mods() & pygame.KMOD_SHIFT else TURN_STEP


class BilliardsControls:
    """Controls of billiards in the window: player, cue, prediction, HUD and the choices in the panel."""

    hint = "Mouse: aim · Space: shoot · F1: all keys"

    def __init__(self, host: GameHost, file: Scene, options: Mapping[str, str]) -> None:
        """Start a frame.

        Args:
            host: host of a game with `BilliardsRules`.
            file: the scene as in its file; its first shot sets the cue, unless the session plays that shot itself.
            options: chosen values of `parameters`; they begin a new frame, not that of a recording.
        """
        scene, session = host.live.scene, host.live.session
        players = options.get("players")
        if session.step_number == 0 and session.is_latest and session.game is not None and not session.game.all_presses:
            count = self._rules_of(host).match.state.players
            wanted = count if players is None else 1 + (players != "one player")
            if wanted != count:
                host.set_control("players", select_value(wanted - 1, 2))
            if options.get("misses") == "on":
                host.set_control("misses", 1.0)
        along = self._rules_of(host).match.layout.along
        has_own_shot = bool(file.shots) and not scene.shots
        cue = CueState.for_shot(file.shots[0]) if has_own_shot else CueState(math.atan2(along[1], along[0]))
        self.player = BilliardsPlayer(host, cue)
        if players == "you vs bot" and self.player.match.state.players > BOT:
            self.player.opponent = BotPlayer(seed=scene.world.seed)
        self.cue_controls = CueControls(self.player)
        self.press, self.move, self.release = self.cue_controls.press, self.cue_controls.move, self.cue_controls.release
        self.hud = BilliardsHud(self.player)
        self._predictor = ShotPredictor(self.player.match.scene)
        host.touched = False  # the options are no input

    @staticmethod
    def _rules_of(host: GameHost) -> BilliardsRules:
        assert isinstance(host.rules, BilliardsRules)
        return host.rules

    def bindings(self) -> ControlBindings:
        """Return the key bindings."""
        return cue_bindings(self.cue_controls)

    @property
    def drag_refusal(self) -> str | None:
        """Reason why the mouse may not drag balls; None in free play."""
        return None if self.player.match.rules.name == "free" else "in a game, only the cue moves balls"

    @property
    def is_own_score(self) -> bool:
        """Whether the score is not that of the bot."""
        return self.player.opponent is None or self.player.match.state.winner != BOT

    def update(self, elapsed: float) -> None:
        """Advance by some real time, s; see `BilliardsPlayer.update`."""
        self.player.update(elapsed)

    def messages(self) -> list[tuple[str, str]]:
        """Return (level, text) of the messages since the last call."""
        messages, self.player.messages = self.player.messages, []
        return messages

    def parameters(self) -> tuple[GameParameter, ...]:
        """Return the choices of the players, and in snooker of the foul-and-a-miss rule."""
        player = self.player
        found = (GameParameter("players", "players", player.players, PLAYERS),)
        if player.match.rules.name != "snooker":
            return found
        return (
            *found,
            GameParameter("misses", "foul and a miss", "on" if player.rules.misses else "off", ("off", "on")),
        )

    def annotate(self, snapshot: Snapshot) -> Snapshot:
        """Return a snapshot with the aim, and with a ball that is being placed at the pointer."""
        aim = self.aim()
        if aim is None or not aim.carried:
            return replace(snapshot, game=aim)
        position = snapshot.frame.position.copy()
        position[aim.ball] = aim.place
        return replace(snapshot, game=aim, frame=replace(snapshot.frame, position=position))

    def aim(self) -> CueAim | None:
        """Return the values to draw of the next stroke; None while balls roll or the bot searches."""
        player = self.player
        if not player.can_shoot or player.is_bot_thinking:
            return None
        match, cue, call, ball = player.match, player.cue, player.call, player.ball
        carried = player.carried is not None
        pocket = match.layout.pockets.get(call.pocket or "")
        return CueAim(
            ball=ball,
            place=player.place,
            angle=cue.aim,
            side=cue.side,
            back=cue.back,
            prediction=None if carried else self._predictor.predict(cue.stroke, ball, player.position),
            carried=carried,
            refused=player.refused,
            called=None if pocket is None else ((pocket[0], pocket[1]), pocket[2]),
            nominated=match.layout.number.get(call.ball or ""),
        )

    def close(self) -> None:
        """Stop the bot."""
        self.player.close()
