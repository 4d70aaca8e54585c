"""Player of billiards at the window, and the bot as an opponent: strokes, calls, decisions, placement and undo.

The rules in the session hold the match. Strokes and placements are actions of the session, calls and decisions are
inputs of the rules, so that a recording contains all of them.
"""

from dataclasses import dataclass, replace
from typing import Literal, get_args

from sandbox.action import ActionError, Move, Strike
from sandbox.games.billiards.game import NOT_JUDGED, BilliardsRules
from sandbox.games.billiards.headless import FramePlan
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision, GameError, ShotCall, player_name
from sandbox.games.billiards.view.bot_player import BotPlayer
from sandbox.games.billiards.view.prediction import CueState
from sandbox.scene.description.base import Point
from sandbox.window.game_host import GameHost

Players = Literal["one player", "two players", "you vs bot"]
PLAYERS: tuple[Players, ...] = get_args(Players)

BOT = 1
"""index of the bot's player"""

STROKE_CONTROLS = frozenset({"shoot", "aim", "left english", "right english", "follow", "draw"})
"""controls that belong to a stroke: an undo of the stroke removes their inputs"""


@dataclass
class _Turn:
    """Preparation of the next stroke; a stroke ends it."""

    strokes: int
    """number of strokes before it"""
    carried: Point | None = None
    """position of a cue ball that is being placed, m"""
    chosen: Decision | None = None
    """selected decision; None for the first that is offered"""
    plan: FramePlan | None = None
    """next shot of the bot"""


class BilliardsPlayer:
    """Player at the window: checks and applies strokes, calls, decisions and placements, and plays the bot's turns."""

    def __init__(self, host: GameHost, cue: CueState, opponent: BotPlayer | None = None) -> None:
        self.host, self.live, self.cue, self.opponent = host, host.live, cue, opponent
        self.refused = False
        """whether the cue ball may not be placed under the pointer"""
        self.messages: list[tuple[str, str]] = []
        """(level, text); the reader empties the list"""
        self._latest_turn = _Turn(0)  # of the last access
        self._bot_strokes: set[float] = set()  # s, times of the strokes of the bot
        self._strokes = self.strokes  # after which the tip was centred last
        self._read = len(self.rules.log)  # number of log entries that are known

    # --- State ---------------------------------------------------------------------------------------------------

    @property
    def rules(self) -> BilliardsRules:
        """The present rules; a step back replaces them by a copy."""
        rules = self.host.rules
        assert isinstance(rules, BilliardsRules)
        return rules

    @property
    def match(self) -> Match:
        """The present match; while balls roll, the match before the stroke."""
        return self.rules.match

    @property
    def call(self) -> ShotCall:
        """The call for the next stroke."""
        return self.rules.call

    @property
    def strokes(self) -> int:
        """Number of strokes played."""
        return len(self._strikes())

    def _strikes(self) -> list[int]:
        """Return the indices of the strokes among the actions of the session."""
        return [k for k, action in enumerate(self.live.session.actions) if isinstance(action, Strike)]

    @property
    def _turn(self) -> _Turn:
        """Preparation of the next stroke."""
        strokes = self.strokes
        if self._latest_turn.strokes != strokes:
            self._latest_turn = _Turn(strokes)
        return self._latest_turn

    @property
    def players(self) -> Players:
        """Players of the frame."""
        if self.match.state.players == 1:
            return "one player"
        return "two players" if self.opponent is None else "you vs bot"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the players."""
        names = [player_name(index) for index in range(self.match.state.players)]
        if self.players == "you vs bot":
            names[BOT] = "bot"
        return tuple(names)

    @property
    def is_at_rest(self) -> bool:
        """Whether all balls are at rest in the displayed state."""
        return self.live.busy is None and self.live.frame.is_at_rest

    @property
    def can_shoot(self) -> bool:
        """Whether a stroke can be played now, by the player at the window or by the bot."""
        session = self.live.session
        is_present = self.live.frame is session.frame and session.ended is None and session.game is not None
        if not is_present or session.game is None or not self.is_at_rest or not self.rules.waiting:
            return False
        return not any(isinstance(action, Strike) for action in session.game.pending_actions)

    @property
    def is_own_turn(self) -> bool:
        """Whether the player at the window can play a stroke now."""
        return self.can_shoot and not self.is_bots_turn

    @property
    def is_bots_turn(self) -> bool:
        """Whether the bot is the player to shoot."""
        return self.opponent is not None and self.match.turn == BOT

    @property
    def is_bot_thinking(self) -> bool:
        """Whether the bot searches for its shot."""
        return self.is_bots_turn and self._turn.plan is None

    @property
    def ball(self) -> int:
        """Index of the ball that is struck next."""
        match = self.match
        return match.layout.number[match.cue]

    @property
    def position(self) -> tuple[Point, ...]:
        """Positions of the bodies, m."""
        return tuple((x, y) for x, y in self.live.frame.position.tolist())

    @property
    def carried(self) -> Point | None:
        """Position of a cue ball that is being placed, m; None if none is."""
        carried = self._turn.carried
        return carried if carried is not None and self.is_own_turn else None

    @property
    def place(self) -> Point:
        """Position of the ball that is struck next, m."""
        return self.carried or self.position[self.ball]

    # --- Decisions and calls -------------------------------------------------------------------------------------

    def require_turn(self) -> None:
        """Check that the player at the window can play now.

        Raises:
            ActionError: it is the bot's turn, or no stroke can be played.
        """
        if self.is_at_rest and self.match.over:
            raise ActionError("the frame is over; press R for a new one")
        if not self.can_shoot:
            raise ActionError("wait until the balls are at rest")
        if self.is_bots_turn:
            raise ActionError("it is the bot's turn")

    @property
    def choice(self) -> Decision | None:
        """The decision that Enter takes; None if none is offered."""
        decisions, chosen = self.match.choices.decisions, self._turn.chosen
        return chosen if chosen in decisions else next(iter(decisions), None)

    def choose_next(self) -> None:
        """Select the next of the offered decisions.

        Raises:
            ActionError: there are none.
        """
        self.require_turn()
        decisions, now = self.match.choices.decisions, self.choice
        if now is None:
            raise ActionError("there is nothing to decide")
        self._turn.chosen = decisions[(decisions.index(now) + 1) % len(decisions)]

    def take_choice(self) -> None:
        """Take the selected decision.

        Raises:
            ActionError: there are none.
        """
        self.require_turn()
        if self.choice is None:
            raise ActionError("there is nothing to decide")
        self.decide(self.choice)

    def decide(self, decision: Decision) -> None:
        """Take a decision.

        Raises:
            ActionError: it is not offered now.
        """
        self.require_turn()
        try:
            self.match.decide(decision)
        except GameError as error:
            raise ActionError(str(error)) from None
        self._turn.chosen = None
        self.host.set_control(*self.rules.decision_input(decision))

    def call_shot(self, call: ShotCall) -> None:
        """Call a ball, a pocket or a safety for the next stroke, in place of the call before.

        Raises:
            ActionError: it cannot be called now.
        """
        self.require_turn()
        try:
            self.match.choices.check(call)
        except GameError as error:
            raise ActionError(str(error)) from None
        self._press_call(call)

    def _press_call(self, call: ShotCall) -> None:
        if self.call != ShotCall():
            self.host.set_control("withdraw calls", 1.0)
        for control, value in self.rules.call_inputs(call):
            self.host.set_control(control, value)

    def toggle_safety(self) -> None:
        """Call a safety, or withdraw the call.

        Raises:
            ActionError: it cannot be called now.
        """
        self.call_shot(replace(self.call, safety=not self.call.safety))

    # --- Ball in hand --------------------------------------------------------------------------------------------

    def toggle_in_hand(self) -> None:
        """Take the cue ball in hand, or put it down.

        Raises:
            ActionError: by the rules the cue ball is not in hand.
        """
        if self.carried is not None:
            self.put_down()
            return
        self.require_turn()
        if self.match.state.in_hand is None:
            if "in hand" not in self.match.choices.decisions:
                raise ActionError("the cue ball is not in hand")
            self.decide("in hand")
        self._turn.carried, self.refused = self.place, False

    def carry(self, at: Point) -> None:
        """Move a cue ball that is being placed to the allowed place nearest to a point, m."""
        match = self.match
        if self.carried is None or match.state.in_hand is None:
            return
        self.refused = match.refusal(at) is not None
        try:
            self._turn.carried = match.nearest(at)
        except GameError:  # no room on the table: the ball remains where it is
            self.refused = True

    def put_down(self) -> None:
        """Put down a ball that is being placed.

        Raises:
            ActionError: its place is not allowed.
        """
        at, self._turn.carried = self.carried, None
        if at is not None:
            self._place(at)

    def _place(self, at: Point) -> None:
        try:
            match = self.match.place(at)
        except GameError as error:
            raise ActionError(str(error)) from None
        self.host.apply(Move(time=0.0, body=match.cue, position=at, velocity=(0.0, 0.0)))

    # --- Strokes -------------------------------------------------------------------------------------------------

    def shoot(self, speed: float | None = None) -> None:
        """Play the stroke; a cue ball that is being placed is put down first.

        Args:
            speed: cue speed, m/s; default: the power that is set.

        Raises:
            ActionError: the stroke cannot be played now.
        """
        self.put_down()
        self.require_turn()
        if self.match.choices.needed and self.call.pocket is None and not self.call.safety:
            raise ActionError("call the pocket first: click it")
        if speed is not None:
            self.cue.speed = speed
        self._strike()

    def _strike(self) -> None:
        now = self.live.session.time
        self._bot_strokes = {time for time in self._bot_strokes if time < now}
        self.cue.back = 0.0
        self.host.apply(self.match.strike(self.cue.stroke))

    def undo(self) -> None:
        """Undo the last stroke that was not the bot's, and everything after it; its call remains.

        Raises:
            ActionError: there is none.
        """
        session, game = self.live.session, self.live.session.game
        actions = session.actions
        strikes = [k for k in self._strikes() if actions[k].time not in self._bot_strokes]
        if not strikes or game is None:
            raise ActionError("no shot to undo")
        struck = actions[strikes[-1]]
        assert isinstance(struck, Strike)
        presses = game.all_presses
        # Time waits for the player, so decisions and calls before the stroke have the same time.
        is_undone = [p.time > struck.time or (p.time == struck.time and p.control in STROKE_CONTROLS) for p in presses]
        kept = is_undone.index(True) if True in is_undone else len(presses)
        self.live.retract(strikes[-1], kept)
        self._strokes = len([action for action in actions[: strikes[-1]] if isinstance(action, Strike)])
        self._latest_turn = _Turn(self._strokes)
        if self.opponent is not None:
            self.opponent.reset()
        self.cue = CueState(struck.aim, struck.speed, struck.side, struck.height)
        self.messages.append(("info", "shot undone"))

    # --- Real time -----------------------------------------------------------------------------------------------

    def update(self, elapsed: float) -> None:
        """Centre the tip after a shot, and advance the turn of a bot by some real time, s.

        Raises:
            ActionError: an action of the bot cannot be applied.
        """
        log, known = self.rules.log, min(self._read, len(self.rules.log))
        self._read = len(log)
        self.messages += [("warning", text) for _, text in log[known:] if text.startswith(NOT_JUDGED)]
        if not self.can_shoot:
            return
        strokes = self.strokes
        if strokes > self._strokes:
            self.cue.centre()
        self._strokes = strokes
        if self.opponent is not None and self.is_bots_turn and self.live.session.is_latest:
            self._play_bot(self.opponent, elapsed)

    def _play_bot(self, opponent: BotPlayer, elapsed: float) -> None:
        """Continue the bot's turn: search, decide, place the cue ball, aim, and shoot."""
        turn = self._turn
        if turn.plan is None:
            found = opponent.search(self.match)
            if found is None:
                return
            opponent.reset()
            if found.decision is not None:
                self.host.set_control(*self.rules.decision_input(found.decision))
            if found.plan is None:
                return
            turn.plan = found.plan
            if found.plan.place is not None and self.match.state.in_hand is not None:
                self._place(found.plan.place)
        plan = turn.plan
        if not opponent.animate(self.cue, plan.stroke, elapsed):
            return
        turn.plan = None
        opponent.reset()
        self._press_call(plan.call)
        self._strike()
        self._bot_strokes.add(self.live.session.time)

    def close(self) -> None:
        """Stop the bot."""
        if self.opponent is not None:
            self.opponent.close()
