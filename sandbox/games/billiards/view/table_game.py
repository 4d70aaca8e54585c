"""Game: who plays what at the table in the window, stroke by stroke.

Hearing: the contacts of a stroke, as a session tells them bit by bit.

Turns: what the rules have made of each stroke, by the number of strokes before it.

A session is its scene and its actions; so is a game. Whoever goes back in the session finds the turn of then, and who
strikes there goes another way.
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
    """All contacts since a stroke."""

    def __init__(self, live: LiveView) -> None:
        self._live = live
        self._parts: list[Contacts] = []
        live.on_contacts = self._parts.append

    def since(self, began: float) -> Contacts:
        """Return the contacts since a time, s, each once: those that last, or were seen twice, are told again."""
        if not self._parts:
            return Contacts.none()
        whole = Contacts.joined(self._parts)
        _, first = np.unique(np.column_stack((whole.time, whole.pair)), axis=0, return_index=True)
        kept = np.sort(first[whole.time[first] >= began])
        return Contacts(whole.time[kept], whole.pair[kept], whole.point[kept], whole.normal[kept], whole.impulse[kept])

    def clear(self) -> None:
        """Forget all: a stroke begins."""
        self._parts.clear()

    def close(self) -> None:
        """Listen no longer."""
        self._live.on_contacts = len


class MatchHistory:
    """Matches as they stood before each stroke, and what was called of it."""

    def __init__(self, first: Match) -> None:
        self._matches, self._calls = [first], [ShotCall()]

    def __len__(self) -> int:
        return len(self._matches)

    def match(self, strokes: int) -> Match:
        """Return the match as it stands after so many strokes, or as far as it is known."""
        return self._matches[min(strokes, len(self._matches) - 1)]

    def call(self, strokes: int) -> ShotCall:
        """Return what is called of the next stroke."""
        return self._calls[min(strokes, len(self._calls) - 1)]

    def go_another_way(self, strokes: int, match: Match) -> None:
        """Go on with another match after so many strokes; what came later is forgotten."""
        call = self.call(strokes) if match.state is self.match(strokes).state else ShotCall()
        self._matches[strokes:], self._calls[strokes:] = [match], [call]

    def say(self, strokes: int, call: ShotCall) -> None:
        """Call something of the next stroke."""
        self._matches[strokes + 1 :] = []
        self._calls[strokes:] = [call]

    def lie(self, strokes: int, position: tuple[Point, ...]) -> None:
        """Take over where the balls are, m; hands may have moved them."""
        match = self._matches[strokes]
        if match.position != position:
            self._matches[strokes] = replace(match, position=position)

    def judge(self, strokes: int, contacts: Contacts, position: FloatArray, began: float) -> Match:
        """Let the rules say what came of the last of so many strokes, and return the match after it.

        Strokes that nobody has judged, of a session that was opened again, count as this one.

        Args:
            strokes: that have been played.
            contacts: since the last.
            position: (N, 2) m, where the balls have come to rest.
            began: when that stroke was, s.

        Raises:
            GameError: it was none that could be played.
        """
        before, call = self.match(strokes - 1), self.call(strokes - 1)
        return self.record(strokes, before.played(contacts, position, call, began))

    def record(self, strokes: int, match: Match) -> Match:
        """Keep a match as that after so many strokes."""
        missing = strokes + 1 - len(self._matches)
        self._matches += [match] * missing
        self._calls += [ShotCall()] * (strokes + 1 - len(self._calls))
        return match


Players = Literal["one player", "two players", "you vs bot"]
PLAYERS: tuple[Players, ...] = get_args(Players)

BOT = 1
"""the bot's number"""


def plays(scene: Scene) -> bool:
    """Tell whether a scene is a table to play at: it names a game, or has a floor and a ball to strike."""
    if scene.surface is None or scene.play.game not in (None, *get_args(TableGame)):
        return False
    return scene.play.game is not None or any(ball.name == "cue" for ball in scene.balls)


class BilliardsGame:
    """A game that is played in a session. Time stands still at the table until somebody strikes."""

    def __init__(
        self, live: LiveView, players: Players | None = None, shot: Shot | None = None, misses: bool = False
    ) -> None:
        """Begin.

        Args:
            live: the session; its scene has no shots of its own where it names a game.
            players: by default two, and one where there are no rules.
            shot: with which the scene would have begun: the cue is laid ready for it.
            misses: whether snooker is played with the foul and a miss.

        Raises:
            GameError: the game that the scene names cannot be played on its table.
        """
        game = live.scene.play.game or "free"
        self.players: Players = players or ("one player" if game == "free" else "two players")
        self.misses = misses and game == "snooker"
        """whether a miss may be played again, in snooker"""
        self.live = live
        terms = {"misses": True} if self.misses else {}
        first = Match.begin(live.scene, game, 1 if self.players == "one player" else 2, **terms)
        self._turns = MatchHistory(first)
        along = first.layout.along
        self.cue = CueState.laid(shot) if shot is not None else CueState(math.atan2(along[1], along[0]))
        self.opponent = BotPlayer(seed=live.scene.world.seed) if self.players == "you vs bot" else None
        self._hearing = ShotContacts(live)
        self.notes: list[tuple[str, str]] = []
        """(level, text) of what happened; whoever tells it empties the list"""

    @property
    def strokes(self) -> int:
        """How many have been played up to now."""
        return len(self._strikes())

    def _strikes(self) -> list[Strike]:
        return [action for action in self.live.session.actions if isinstance(action, Strike)]

    @property
    def match(self) -> Match:
        """The game as it stands; while balls roll, as it stood before the stroke."""
        strokes = self.strokes
        return self._turns.match(strokes if self.resting else max(strokes - 1, 0))

    @property
    def call(self) -> ShotCall:
        """What is called of the next stroke."""
        return self._turns.call(self.strokes)

    @property
    def resting(self) -> bool:
        """Whether all balls are at rest, in what is shown."""
        return self.live.busy is None and is_at_rest(self.live.frame)

    @property
    def _known(self) -> bool:
        """Whether the rules have seen the last stroke."""
        return self.strokes < len(self._turns)

    @property
    def waits(self) -> bool:
        """Whether time stands still until somebody does something; not where what was done is seen again."""
        session = self.live.session
        last = not session.ahead and session.step_number >= session.history.furthest
        return last and session.ended is None and self.resting and self._known

    @property
    def aiming(self) -> bool:
        """Whether a stroke can be played now."""
        present = self.live.frame is self.live.session.frame and self.live.session.ended is None
        return present and self.resting and self._known and not self.match.over

    @property
    def mine(self) -> bool:
        """Whether it is a person's stroke."""
        return self.aiming and not self._bots(self.match)

    @property
    def names(self) -> tuple[str, ...]:
        """What the players are called."""
        called = [player_name(number) for number in range(self.match.state.players)]
        if self.players == "you vs bot":
            called[BOT] = "bot"
        return tuple(called)

    @property
    def bot_is_thinking(self) -> bool:
        """Whether it is the bot's stroke, and the cue still lies as the last player left it."""
        return self.opponent is not None and not self.opponent.is_aiming and self._bots(self.match)

    def _bots(self, match: Match) -> bool:
        return self.opponent is not None and match.turn == BOT

    @property
    def ball(self) -> int:
        """Number of the ball that is struck next."""
        match = self.match
        return match.layout.number[match.cue]

    @property
    def position(self) -> tuple[Point, ...]:
        """Where the balls are, m, by number."""
        return tuple((x, y) for x, y in self.live.frame.position.tolist())

    def go_on(self, elapsed: float) -> None:
        """Look at what has become of the table, and let a bot play, in so much real time, s.

        Raises:
            ActionError: what the rules or the bot ask for cannot be done.
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
        """Let the rules say what came of the last stroke."""
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
        """Put the balls where the game has them; in what is seen again that was done."""
        if not self.live.session.ahead:
            for move in match.moves(self.live.frame.position):
                self.live.act(move)

    def _let_play(self, opponent: BotPlayer, elapsed: float) -> None:
        """Go on with the bot's turn."""
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
        """Go on with another match from here, and put the balls where it has them."""
        self._turns.go_another_way(self.strokes, match)
        self._lay(match)

    def say(self, call: ShotCall) -> None:
        """Call a ball or a pocket of the next stroke."""
        self._turns.say(self.strokes, call)

    def check(self) -> None:
        """Refuse what only the one whose stroke it is may do.

        Raises:
            ActionError: it is nobody's here.
        """
        if self.resting and self.match.over:
            raise ActionError("the frame is over; press R for a new one")
        if not self.aiming:
            raise ActionError("wait until the balls are at rest")
        if not self.mine:
            raise ActionError("it is the bot's turn")

    def shoot(self, speed: float | None = None) -> None:
        """Play the stroke, with its own power or another speed of the cue, m/s.

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
        self.live.act(match.strike(self.cue.stroke))

    def undo(self) -> None:
        """Take back a person's last stroke, and what followed.

        Raises:
            ActionError: none was played.
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
        """Let go of the bot."""
        self._hearing.close()
        if self.opponent is not None:
            self.opponent.close()
