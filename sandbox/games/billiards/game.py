"""Running games of billiards: implements the `Rules` protocol for every billiards game with a `Match`.

A shot begins with a `Strike` and ends with the first step after which every ball is at rest. The rules collect the
contacts of the shot, let the `Match` judge it, and answer with `Move` actions that respot or rerack balls. Balls that a
player moves by hand between shots stay where they are put.

A player acts by `Strike` and `Move` actions, or by controls. Decisions and calls are controls only, so a
recording that contains actions but no control inputs is judged without calls. A strike of a ball other than the cue
ball of the player to shoot is not judged: the balls stay where they come to rest, and the turn does not change.
"""

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np

from sandbox.action import Action, Move, Strike
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision, GameError, ShotCall, player_name
from sandbox.games.billiards.table_geometry import MAX_TOUCH_GAP
from sandbox.games.contract import FLAG, Control, ObservationRange, StepInfo, UnsuitableSceneError, position_ranges
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import MISCUE, Stroke
from sandbox.trajectory import Contacts, Frame

MIN_CUE_SPEED, MAX_CUE_SPEED = 0.05, 10.0
"""m/s: the slowest stroke, and a hard break"""
MAX_TIP_OFFSET = 0.999 * MISCUE
"""greatest offset of the tip from the centre of the ball, in radii; just below the miscue limit"""
NOT_JUDGED = "not judged: "
"""start of the log entry of a shot that the rules could not judge"""
MAX_JOINED_CONTACTS = 1024
"""number of steps after which the collected contacts are merged; a lasting contact has one row per step"""

CONTROLS = (
    Control("shoot", "strike the cue ball; the value is the speed", ("space",), analogue=True),
    Control("aim", "direction of the cue, as a fraction of a turn", ("left",), analogue=True),
    Control("left english", "hit the ball left of its centre", (), analogue=True, often=0.2),
    Control("right english", "hit the ball right of its centre", (), analogue=True, often=0.2),
    Control("follow", "hit the ball above its centre", (), analogue=True, often=0.2),
    Control("draw", "hit the ball below its centre", (), analogue=True, often=0.2),
    Control("place x", "x of the place of a ball in hand, as a fraction of the table", (), analogue=True),
    Control("place y", "y of the place of a ball in hand, as a fraction of the table", (), analogue=True),
    Control("place", "place the ball in hand", ()),
    Control("call ball", "call a ball, by its index", (), analogue=True),
    Control("call pocket", "call a pocket, by its index", (), analogue=True),
    Control("call safety", "call a safety", (), often=0.1),
    Control("push out", "announce a push-out", (), often=0.1),
    Control("decide", "take one of the offered decisions, by its index", (), analogue=True),
)
"""Controls of every billiards game.

Releasing a control, value 0, resets english and announcements, and has no other effect. A control that selects the
entry k of n takes a value from k/n to (k + 1)/n; `select_value` returns the middle.
"""


SETTINGS = ("players", "misses", "withdraw calls")
"""Inputs of a player at the window besides `CONTROLS`, which no policy sets.

`players` (entry 0 or 1: one or two) and `misses` (1: the foul-and-a-miss rule of snooker applies) begin the frame anew,
before its first shot. `withdraw calls` withdraws all calls for the next shot.
"""


def select_value(index: int, count: int) -> float:
    """Return the value of a control that selects the entry `index` of `count`."""
    return (index + 0.5) / count


def selected_index(value: float, count: int) -> int | None:
    """Return the index of the entry that a control's value selects; None for 0, or if there are no entries."""
    return min(int(value * count), count - 1) if value > 0.0 and count > 0 else None


class BilliardsRules:
    """Rules and state of a running frame of billiards."""

    controls = CONTROLS

    def __init__(self, match: Match, shot_in_progress: bool = False) -> None:
        """Start a frame.

        Args:
            match: match at the start.
            shot_in_progress: whether the scene starts with a shot of its own, which counts for the first player.
        """
        self.match = match
        """match before the next shot; during a shot, the match before that shot"""
        self.call = ShotCall()
        """call for the next shot"""
        self.log: list[tuple[float, str]] = []
        """time, s, and text of decisions and shot results"""
        self._contacts: list[Contacts] = []
        self._shot_time: float | None = 0.0 if shot_in_progress else None  # s; None between shots
        self._is_judged = True  # False if a ball other than the cue ball was struck
        self._is_resting = not shot_in_progress
        self._time = 0.0
        along = match.layout.along
        self._aim = math.atan2(along[1], along[0])
        self._english = dict.fromkeys(("left english", "right english", "follow", "draw"), 0.0)
        self._place = [0.5, 0.5]
        self._sounds: list[str] = []

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return a copy that shares the immutable matches and contacts."""
        duplicate = copy.copy(self)
        for name in ("log", "_contacts", "_english", "_place", "_sounds"):
            setattr(duplicate, name, copy.copy(getattr(self, name)))
        memo[id(self)] = duplicate
        return duplicate

    @property
    def score(self) -> int:
        """Score of the winner, or the best score."""
        state = self.match.state
        return state.scores[state.winner] if state.winner is not None else max(state.scores)

    @property
    def player(self) -> str:
        """Player who shoots next, or whose shot runs."""
        return player_name(self.match.state.turn)

    @property
    def scores(self) -> dict[str, int]:
        """Score of each player."""
        return {player_name(number): score for number, score in enumerate(self.match.state.scores)}

    @property
    def bots(self) -> tuple[str, ...]:
        """No player: all shots are inputs."""
        return ()

    @property
    def winner(self) -> str | None:
        """Player who has won; None during the frame, and after a draw."""
        winner = self.match.state.winner
        return None if winner is None else player_name(winner)

    @property
    def game_over(self) -> str | None:
        """Result of the frame, such as `player 1 wins`; None while it is in progress."""
        state = self.match.state
        if not state.over:
            return None
        return "no winner" if state.winner is None else f"{player_name(state.winner)} wins"

    @property
    def misses(self) -> bool:
        """Whether the foul-and-a-miss rule applies, in snooker."""
        return bool(getattr(self.match.state, "misses", False))

    @property
    def waiting(self) -> bool:
        """Whether every ball is at rest and the last shot is judged, so that a player has to act next."""
        return self._is_resting and self._shot_time is None and not self.match.over

    @property
    def stroke(self) -> Stroke:
        """Stroke set up by the controls, at the lowest speed."""
        side = self._english["right english"] - self._english["left english"]
        height = self._english["follow"] - self._english["draw"]
        scale = MAX_TIP_OFFSET / max(math.hypot(side, height), 1.0)
        return Stroke(aim=self._aim, speed=MIN_CUE_SPEED, side=side * scale, height=height * scale)

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        """Follow strikes and moves, and judge the shot once every ball is at rest; return the moves of the rules."""
        started, self._time = self._time, info.time
        for action in info.actions:
            if isinstance(action, Strike):
                self._begin_shot(action, max(action.time, started))
            elif isinstance(action, Move) and self._shot_time is None and action.body in self.match.layout.number:
                position = list(self.match.position)
                position[self.match.layout.number[action.body]] = action.position
                self.match = replace(self.match, position=tuple(position))
        self._is_resting = info.frame.is_at_rest
        if self._shot_time is None:
            if self._is_resting:
                self._accept_position(info.frame)
            return ()
        if len(info.contacts):
            self._contacts.append(info.contacts)
            if len(self._contacts) == MAX_JOINED_CONTACTS:
                self._contacts = [Contacts.joined(self._contacts).merged()]
        return self._end_shot(info.frame) if self._is_resting and info.time > self._shot_time else ()

    def _begin_shot(self, strike: Strike, time: float) -> None:
        if self._shot_time is not None or self.match.over:
            return
        self._shot_time, self._is_judged = time, strike.ball == self.match.cue
        self._contacts = []
        self._sounds.append("shot")

    def _accept_position(self, frame: Frame) -> None:
        """Update the match to positions that changed without a shot, for example by a force."""
        now, count = frame.position, len(self.match.position)
        # Single-precision engines round the positions of moves; such differences are ignored.
        if np.abs(now[:count] - self.match.position).max(initial=0.0) > MAX_TOUCH_GAP:
            self.match = replace(self.match, position=_points(now[:count]))

    def _end_shot(self, frame: Frame) -> Sequence[Action]:
        """Judge the shot, and return the moves that take the balls to the positions of the match."""
        assert self._shot_time is not None
        count = len(self.match.position)
        position, began = frame.position[:count], self._shot_time
        after = replace(self.match, position=_points(position))
        if self._is_judged:
            contacts = Contacts.joined(self._contacts).merged() if self._contacts else Contacts.none()
            # Bodies that were added during the game are not part of it.
            contacts = contacts.some(np.max(contacts.pair, axis=1, initial=-1) < count)
            try:
                after = self.match.played(contacts, position, self.call, began)
            except GameError as error:  # an invalid call, or a pocketed ball that was moved back by hand
                self.log.append((self._time, f"{NOT_JUDGED}{error}"))
        self._contacts, self._shot_time, self.call = [], None, ShotCall()
        return self._enter(after, position)

    def _enter(self, match: Match, position: Any) -> Sequence[Action]:
        """Continue with another match; return the moves to its positions."""
        self.match = match
        if match.verdict is not None:
            self.log += [(self._time, message) for message in match.messages]
            self._sounds += ["foul"] if match.verdict.fouls else []
        if match.over:
            self._sounds.append("win")
        return match.moves(np.asarray(position, dtype=float), self._time)

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        """Set up the stroke, call, decide, place, or shoot. Input that the rules do not allow now is ignored."""
        if control in self._english:
            self._english[control] = min(max(value, 0.0), 1.0)
        elif control in SETTINGS:
            self._set(control, value)
        elif control in ("call safety", "push out"):
            self._announce(control, value > 0.0)
        elif value <= 0.0:
            return ()
        elif control == "aim":
            self._aim = math.tau * value
        elif control in ("place x", "place y"):
            self._place[control == "place y"] = value
        elif self.waiting:
            return self._act(control, value)
        return ()

    def _set(self, name: str, value: float) -> None:
        match = self.match
        if name == "withdraw calls":
            self.call = ShotCall()
        elif self.waiting and match.shots == 0:
            players = 1 + (selected_index(value, 2) or 0) if name == "players" else match.state.players
            misses = value > 0.0 if name == "misses" else self.misses
            terms = {"misses": True} if misses and match.rules.name == "snooker" else {}
            self.match = Match.begin(match.scene, match.rules.name, players, **terms)

    def _announce(self, name: str, is_on: bool) -> None:
        choices = self.match.choices
        if name == "call safety":
            self.call = replace(self.call, safety=is_on and self.waiting and choices.safety)
        else:
            self.call = replace(self.call, push_out=is_on and self.waiting and choices.push_out)

    def _act(self, name: str, value: float) -> Sequence[Action]:
        match = self.match
        if name == "shoot":
            self._is_resting = False  # until the next step has applied the stroke, so that no second one is accepted
            speed = min(max(value * MAX_CUE_SPEED, MIN_CUE_SPEED), MAX_CUE_SPEED)
            return (match.strike(self.stroke.model_copy(update={"speed": speed})),)
        if name == "place":
            return self.place(self._point())
        if name == "decide":
            options = match.choices.decisions
            index = selected_index(value, len(options))
            return () if index is None else self.decide(options[index])
        names = match.layout.names if name == "call ball" else tuple(match.layout.pockets)
        index = selected_index(value, len(names))
        if name == "call ball" and index is not None and names[index] in match.choices.balls:
            self.call = replace(self.call, ball=names[index])
        elif name == "call pocket" and index is not None and match.choices.pocket:
            self.call = replace(self.call, pocket=names[index])
        return ()

    def _point(self) -> Point:
        (x0, y0), (x1, y1) = self.match.layout.area
        return x0 + self._place[0] * (x1 - x0), y0 + self._place[1] * (y1 - y0)

    def place(self, at: Point) -> Sequence[Action]:
        """Place a cue ball in hand at the allowed place nearest to a point, m; return the moves."""
        match = self.match
        if match.state.in_hand is None:
            return ()
        before = np.array(match.position)
        return self._enter(match.place(match.nearest(at)), before)

    def decide(self, decision: Decision) -> Sequence[Action]:
        """Take a decision; return the moves that follow from it.

        Raises:
            GameError: the decision is not offered now.
        """
        before = np.array(self.match.position)
        self.log.append((self._time, f"{player_name(self.match.turn)} decides: {decision}"))
        return self._enter(self.match.decide(decision), before)

    def decision_input(self, decision: Decision) -> tuple[str, float]:
        """Return the control and the value that take an offered decision."""
        options = self.match.choices.decisions
        return "decide", select_value(options.index(decision), len(options))

    def call_inputs(self, call: ShotCall) -> tuple[tuple[str, float], ...]:
        """Return the controls and values that make a call."""
        layout = self.match.layout
        pockets = tuple(layout.pockets)
        return (
            *(
                (("call ball", select_value(layout.number[call.ball], len(layout.names))),)
                if call.ball is not None
                else ()
            ),
            *(
                (("call pocket", select_value(pockets.index(call.pocket), len(pockets))),)
                if call.pocket is not None
                else ()
            ),
            *((("call safety", 1.0),) if call.safety else ()),
            *((("push out", 1.0),) if call.push_out else ()),
        )

    def place_inputs(self, at: Point) -> tuple[tuple[str, float], ...]:
        """Return the controls and values that place the cue ball at a point, m."""
        (x0, y0), (x1, y1) = self.match.layout.area
        return ("place x", (at[0] - x0) / (x1 - x0)), ("place y", (at[1] - y0) / (y1 - y0)), ("place", 1.0)

    def stroke_inputs(self, stroke: Stroke) -> tuple[tuple[str, float], ...]:
        """Return the controls and values that play a stroke, exact to rounding errors."""
        side, height = stroke.side / MAX_TIP_OFFSET, stroke.height / MAX_TIP_OFFSET
        return (
            ("aim", (stroke.aim % math.tau) / math.tau or 1.0),
            ("right english", max(side, 0.0)),
            ("left english", max(-side, 0.0)),
            ("follow", max(height, 0.0)),
            ("draw", max(-height, 0.0)),
            ("shoot", stroke.speed / MAX_CUE_SPEED),
            ("shoot", 0.0),
        )

    def display_lines(self) -> Sequence[tuple[str, str]]:
        """Return the scores of the players, the turn, and the result of the last shot."""
        state = self.match.state
        scores = [(player_name(number), str(score)) for number, score in enumerate(state.scores)]
        if state.over:
            return scores
        turn = [("turn", player_name(state.turn))] if state.players > 1 else []
        in_hand = [("ball in hand", state.in_hand)] if state.in_hand is not None else []
        last = [("last shot", "; ".join(self.match.messages))] if self.match.messages else []
        return [*scores, *turn, *in_hand, *last]

    def sounds(self) -> Sequence[str]:
        """Return the names of the sounds since the last call."""
        sounds, self._sounds = tuple(self._sounds), []
        return sounds

    def observation(self) -> Sequence[tuple[str, float]]:
        """Return the state of the match as numbers."""
        state = self.match.state
        return (
            ("waiting", float(self.waiting)),
            ("turn", float(state.turn)),
            ("ball in hand", float(state.in_hand is not None)),
            ("decisions offered", float(len(self.match.choices.decisions))),
            *((f"score of {player_name(number)}", float(score)) for number, score in enumerate(state.scores)),
        )

    def observation_ranges(self) -> Mapping[str, ObservationRange]:
        """Return the ranges of the state of the match, and of the positions of the balls: table and pockets."""
        layout, players = self.match.layout, self.match.state.players
        (x0, y0), (x1, y1) = layout.area
        discs = [*layout.pockets.values()]
        lower = min([x0, *(x - r for x, _, r in discs)]), min([y0, *(y - r for _, y, r in discs)])
        upper = max([x1, *(x + r for x, _, r in discs)]), max([y1, *(y + r for _, y, r in discs)])
        return {
            **position_ranges(layout.names, lower, upper),
            "waiting": FLAG,
            "turn": ObservationRange(0.0, max(players - 1.0, 1.0)),
            "ball in hand": FLAG,
            "decisions offered": ObservationRange(0.0),
            **{f"score of {player_name(number)}": ObservationRange(0.0) for number in range(players)},
        }


def start_game(scene: Scene, bodies: Bodies) -> BilliardsRules:  # noqa: ARG001, the signature of `GameSpec.rules`
    """Start the game that a scene names: free play with one player, every other game with two.

    Raises:
        UnsuitableSceneError: the game cannot be played on this table.
    """
    try:
        is_free = scene.play.game in (None, "free")
        # A shot of a scene that names no game belongs to the scene, not to the player.
        has_shot = bool(scene.shots) and scene.play.game is not None
        return BilliardsRules(Match.begin(scene, players=1 if is_free else 2), has_shot)
    except GameError as error:
        raise UnsuitableSceneError(str(error)) from None


def plays(scene: Scene) -> bool:
    """Return whether the window plays free billiards on a scene without a game: it has a surface and a ball `cue`."""
    return scene.surface is not None and any(ball.name == "cue" for ball in scene.balls)


def without_shots(scene: Scene) -> Scene:
    """Return a scene without its shots, which the players of its game make instead."""
    return scene.model_copy(update={"shots": ()}) if scene.shots else scene


def needs_player(scene: Scene) -> str | None:
    """Return why a scene needs a player, namely that it has no shot of its own; None if it has one."""
    if scene.shots:
        return None
    return "player 'none' plays no shot, so nothing would move; use random, skilled or a script"


def _points(position: Any) -> tuple[Point, ...]:
    return tuple((x, y) for x, y in position.tolist())
