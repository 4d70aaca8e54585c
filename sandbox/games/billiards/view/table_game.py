"""Game of billiards in the window: players, turns, and undo.

The match after each stroke is kept by the number of strokes in the session, so that stepping back in the session shows
the match of that time, and a stroke played there discards the later ones.
"""

import math
from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from sandbox.action import ActionError, Strike
from sandbox.arrays import FloatArray
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import GameError, ShotCall, player_name
from sandbox.games.billiards.view.bot_player import BotPlayer
from sandbox.games.billiards.view.prediction import CueState
from sandbox.games.names import TableGame
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Shot
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts
from sandbox.window.playback.history import is_at_rest
from sandbox.window.playback.live import LiveView


class ShotContacts:
    """Contacts since the last stroke, collected from a session."""

    def __init__(self, live: LiveView) -> None:
        self._live = live
        self._parts: list[Contacts] = []
        live.on_contacts = self._parts.append

    def since(self, began: float) -> Contacts:
        """Return the contacts since a time, s, each once; lasting and replayed contacts are reported repeatedly."""
        if not self._parts:
            return Contacts.none()
        whole = Contacts.joined(self._parts)
        _, first = np.unique(np.column_stack((whole.time, whole.pair)), axis=0, return_index=True)
        kept = np.sort(first[whole.time[first] >= began])
        return Contacts(whole.time[kept], whole.pair[kept], whole.point[kept], whole.normal[kept], whole.impulse[kept])

    def clear(self) -> None:
        """Discard all contacts, at the start of a stroke."""
        self._parts.clear()

    def close(self) -> None:
        """Stop collecting."""
        self._live.on_contacts = len


class MatchHistory:
    """Match and call before each stroke."""

    def __init__(self, first: Match) -> None:
        self._matches, self._calls = [first], [ShotCall()]

    def __len__(self) -> int:
        return len(self._matches)

    def match(self, strokes: int) -> Match:
        """Return the match after a number of strokes, or the last known one."""
        return self._matches[min(strokes, len(self._matches) - 1)]

    def call(self, strokes: int) -> ShotCall:
        """Return the call for the next stroke."""
        return self._calls[min(strokes, len(self._calls) - 1)]

    def go_another_way(self, strokes: int, match: Match) -> None:
        """Replace the match after a number of strokes, and discard later matches."""
        call = self.call(strokes) if match.state is self.match(strokes).state else ShotCall()
        self._matches[strokes:], self._calls[strokes:] = [match], [call]

    def say(self, strokes: int, call: ShotCall) -> None:
        """Set the call for the next stroke."""
        self._matches[strokes + 1 :] = []
        self._calls[strokes:] = [call]

    def lie(self, strokes: int, position: tuple[Point, ...]) -> None:
        """Accept the positions of the balls, m, which may have been moved by hand."""
        match = self._matches[strokes]
        if match.position != position:
            self._matches[strokes] = replace(match, position=position)

    def judge(self, strokes: int, contacts: Contacts, position: FloatArray, began: float) -> Match:
        """Judge the last stroke and return the match after it.

        Earlier strokes that were not judged, of a session that was reopened, get the same match.

        Args:
            strokes: number of strokes played.
            contacts: contacts since the last stroke.
            position: (N, 2) m, positions at rest.
            began: time of the last stroke, s.

        Raises:
            GameError: the rules do not allow the stroke.
        """
        before, call = self.match(strokes - 1), self.call(strokes - 1)
        return self.record(strokes, before.played(contacts, position, call, began))

    def record(self, strokes: int, match: Match) -> Match:
        """Store the match after a number of strokes."""
        missing = strokes + 1 - len(self._matches)
        self._matches += [match] * missing
        self._calls += [ShotCall()] * (strokes + 1 - len(self._calls))
        return match


Players = Literal["one player", "two players", "you vs bot"]
PLAYERS: tuple[Players, ...] = get_args(Players)

BOT = 1
"""index of the bot's player"""


def plays(scene: Scene) -> bool:
    """Return whether a scene can be played: it has a surface, and names a game or has a ball named `cue`."""
    if scene.surface is None or scene.play.game not in (None, *get_args(TableGame)):
        return False
    return scene.play.game is not None or any(ball.name == "cue" for ball in scene.balls)


class BilliardsGame:
    """Game of billiards in a session. Time stops between strokes."""

    def __init__(
        self, live: LiveView, players: Players | None = None, shot: Shot | None = None, misses: bool = False
    ) -> None:
        """Start a game.

        Args:
            live: session of a scene without shots.
            players: default: two, in free play one.
            shot: shot for which the cue is prepared; default: along the table.
            misses: whether the foul-and-a-miss rule of snooker applies.

        Raises:
            GameError: the game that the scene names cannot be played on its table.
        """
        game = live.scene.play.game or "free"
        self.players: Players = players or ("one player" if game == "free" else "two players")
        self.misses = misses and game == "snooker"
        """whether the foul-and-a-miss rule applies, in snooker"""
        self.live = live
        terms = {"misses": True} if self.misses else {}
        first = Match.begin(live.scene, game, 1 if self.players == "one player" else 2, **terms)
        self._turns = MatchHistory(first)
        along = first.layout.along
        self.cue = CueState.laid(shot) if shot is not None else CueState(math.atan2(along[1], along[0]))
        self.opponent = BotPlayer(seed=live.scene.world.seed) if self.players == "you vs bot" else None
        self._hearing = ShotContacts(live)
        self.notes: list[tuple[str, str]] = []
        """messages, as level and text; the window empties the list"""

    @property
    def strokes(self) -> int:
        """Number of strokes played."""
        return len(self._strikes())

    def _strikes(self) -> list[Strike]:
        return [action for action in self.live.session.actions if isinstance(action, Strike)]

    @property
    def match(self) -> Match:
        """The present match; while balls roll, the match before the stroke."""
        strokes = self.strokes
        return self._turns.match(strokes if self.resting else max(strokes - 1, 0))

    @property
    def call(self) -> ShotCall:
        """The call for the next stroke."""
        return self._turns.call(self.strokes)

    @property
    def resting(self) -> bool:
        """Whether all balls are at rest in the shown frame."""
        return self.live.busy is None and is_at_rest(self.live.frame)

    @property
    def _known(self) -> bool:
        """Whether the last stroke is judged."""
        return self.strokes < len(self._turns)

    @property
    def waits(self) -> bool:
        """Whether time stops until a player acts; not during a replay."""
        session = self.live.session
        last = not session.has_future and session.step_number >= session.history.last_step
        return last and session.ended is None and self.resting and self._known

    @property
    def aiming(self) -> bool:
        """Whether a stroke can be played now."""
        present = self.live.frame is self.live.session.frame and self.live.session.ended is None
        return present and self.resting and self._known and not self.match.over

    @property
    def mine(self) -> bool:
        """Whether the player at the window can play a stroke now."""
        return self.aiming and not self._bots(self.match)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the players."""
        called = [player_name(number) for number in range(self.match.state.players)]
        if self.players == "you vs bot":
            called[BOT] = "bot"
        return tuple(called)

    @property
    def bot_is_thinking(self) -> bool:
        """Whether the bot searches for its shot."""
        return self.opponent is not None and not self.opponent.is_aiming and self._bots(self.match)

    def _bots(self, match: Match) -> bool:
        return self.opponent is not None and match.turn == BOT

    @property
    def ball(self) -> int:
        """Index of the ball that is struck next."""
        match = self.match
        return match.layout.number[match.cue]

    @property
    def position(self) -> tuple[Point, ...]:
        """Positions of the bodies, m."""
        return tuple((x, y) for x, y in self.live.frame.position.tolist())

    def go_on(self, elapsed: float) -> None:
        """Judge a completed stroke, and advance the turn of a bot by some real time, s.

        Raises:
            ActionError: an action of the rules or the bot cannot be applied.
        """
        if not self.resting or self.live.frame is not self.live.session.frame:
            return
        if not self._known:
            self._judge()
        elif self.waits:
            self._turns.lie(self.strokes, self.position)
        if self.waits and self.opponent is not None and self.aiming and self._bots(self.match):
            self._let_play(self.opponent, elapsed)

    def _judge(self) -> None:
        """Judge the last stroke."""
        strikes = self._strikes()
        began = strikes[-1].time
        try:
            after = self._turns.judge(len(strikes), self._hearing.since(began), self.live.frame.position, began)
        except GameError as error:
            self.notes.append(("warning", str(error)))
            after = self._turns.record(len(strikes), self._turns.match(len(strikes)))
        self.cue.centre()
        self._lay(after)

    def _lay(self, match: Match) -> None:
        """Move the balls to the positions of a match; in a replay the session contains these moves."""
        if not self.live.session.has_future:
            for move in match.moves(self.live.frame.position):
                self.live.apply(move)

    def _let_play(self, opponent: BotPlayer, elapsed: float) -> None:
        """Continue the bot's turn."""
        match = self.match
        thought = opponent.thought(match)
        if thought is None:
            return
        plan = thought.plan
        if thought.decision is not None:
            match = match.decide(thought.decision)
        if plan is None:
            self.go_another_way(match)
            return
        if plan.place is not None and match.state.in_hand is not None:
            match = match.place(plan.place)
        if match is not self.match:
            self.go_another_way(match)
            opponent.stays(self.match)
        if opponent.moves(self.cue, plan.stroke, elapsed):
            opponent.forget()
            self._turns.say(self.strokes, plan.call)
            self._strike()

    def go_another_way(self, match: Match) -> None:
        """Continue with another match, and move the balls to its positions."""
        self._turns.go_another_way(self.strokes, match)
        self._lay(match)

    def say(self, call: ShotCall) -> None:
        """Set the call for the next stroke."""
        self._turns.say(self.strokes, call)

    def check(self) -> None:
        """Check that the player at the window can play now.

        Raises:
            ActionError: it is the bot's turn, or no stroke can be played.
        """
        if self.resting and self.match.over:
            raise ActionError("the frame is over; press R for a new one")
        if not self.aiming:
            raise ActionError("wait until the balls are at rest")
        if not self.mine:
            raise ActionError("it is the bot's turn")

    def shoot(self, speed: float | None = None) -> None:
        """Play the stroke, with the power of the cue or another cue speed, m/s.

        Raises:
            ActionError: it cannot be played now.
        """
        self.check()
        call = self.call
        if self.match.choices.needed and call.pocket is None and not call.safety:
            raise ActionError("call the pocket first: click it")
        if speed is not None:
            self.cue.speed = speed
        self._strike()

    def _strike(self) -> None:
        strokes = self.strokes
        self._turns.lie(strokes, self.position)
        match = self._turns.match(strokes)
        self._turns.say(strokes, self.call)
        self.cue.back = 0.0
        self._hearing.clear()
        self.live.apply(match.strike(self.cue.stroke))

    def undo(self) -> None:
        """Undo the last stroke that was not the bot's, and everything after it.

        Raises:
            ActionError: there is none.
        """
        strikes = [k for k, action in enumerate(self.live.session.actions) if isinstance(action, Strike)]
        while strikes and self._bots(self._turns.match(len(strikes) - 1)):
            strikes.pop()
        if not strikes:
            raise ActionError("no shot to undo")
        struck = self.live.session.actions[strikes[-1]]
        assert isinstance(struck, Strike)
        self.live.retract(strikes[-1])
        before = len(strikes) - 1
        self._turns.say(before, self._turns.call(before))
        self._hearing.clear()
        if self.opponent is not None:
            self.opponent.forget()
        self.cue = CueState(struck.aim, struck.speed, struck.side, struck.height)
        self.notes.append(("info", "shot undone"))

    def close(self) -> None:
        """Stop the bot, and stop collecting contacts."""
        self._hearing.close()
        if self.opponent is not None:
            self.opponent.close()
