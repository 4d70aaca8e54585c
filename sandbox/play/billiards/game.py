"""Game: who plays what at the table in the window, stroke by stroke.

A session is its scene and its actions; so is a game. What the rules have made of each stroke is kept by the number of
strokes before it: whoever goes back in the session finds the turn of then, and who strikes there goes another way.
"""

import math
from dataclasses import replace
from typing import Literal

import numpy as np

from sandbox.action import ActionError, Strike
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.call import Call, Decision
from sandbox.games.billiards.rules.happening import GameError
from sandbox.play.billiards.aim import Aim
from sandbox.play.billiards.cue import Cue
from sandbox.play.billiards.forecast import Forecaster
from sandbox.play.billiards.opponent import Opponent
from sandbox.play.running.live import Live
from sandbox.scene.cue import Shot
from sandbox.scene.model import Scene
from sandbox.scene.part import Point
from sandbox.trajectory import Contacts, Frame

Players = Literal["alone", "two", "bot"]
PLAYERS: tuple[Players, ...] = ("alone", "two", "bot")

STILL = 1e-9
"""m/s and rad/s: what is slower rests"""


def plays(scene: Scene) -> bool:
    """Tell whether a scene is a table to play at: it names a game, or has a floor and a ball to strike."""
    if scene.surface is None:
        return False
    return scene.play.game is not None or any(ball.name == "cue" for ball in scene.balls)


def at_rest(frame: Frame) -> bool:
    """Tell whether nothing moves or turns."""
    rates = (frame.velocity, frame.angular_velocity, *(() if frame.roll is None else (frame.roll,)))
    return all(float(np.abs(rate).max(initial=0.0)) <= STILL for rate in rates)


class Game:
    """A game that is played in a session."""

    def __init__(self, live: Live, players: Players | None = None, shot: Shot | None = None) -> None:
        """Begin.

        Args:
            live: the session; its scene has no shots of its own where it names a game.
            players: by default two, and one where there are no rules.
            shot: with which the scene would have begun: the cue is laid ready for it.

        Raises:
            GameError: the game that the scene names cannot be played on its table.
        """
        game = live.scene.play.game or "free"
        self.players: Players = players or ("alone" if game == "free" else "two")
        self.live = live
        first = Match.begin(live.scene, game, 1 if self.players == "alone" else 2)
        self._turns: list[Match] = [first]
        self._calls: list[Call] = [Call()]
        along = first.layout.along
        self.cue = Cue.laid(shot) if shot is not None else Cue(math.atan2(along[1], along[0]))
        self.notes: list[tuple[str, str]] = []
        """(level, text) of what happened; whoever tells it empties the list"""
        self.carried: Point | None = None
        """where a hand holds the cue ball, m"""
        self.refused = False
        """the ball may not be put where the hand is"""
        self._chosen: tuple[Match, int] | None = None
        self.opponent = Opponent(seed=live.scene.world.seed) if self.players == "bot" else None
        self._heard: list[Contacts] = []
        self._forecaster = Forecaster(first.scene)
        live.on_contacts = self._heard.append

    @property
    def strokes(self) -> int:
        """How many have been played up to now."""
        return sum(isinstance(action, Strike) for action in self.live.session.actions)

    @property
    def match(self) -> Match:
        """The game as it stands; while balls roll, as it stood before the stroke."""
        strokes = self.strokes
        if strokes >= len(self._turns) or not self.resting:
            return self._turns[max(min(strokes, len(self._turns)) - 1, 0)]
        return self._turns[strokes]

    @property
    def call(self) -> Call:
        """What is called of the next stroke."""
        return self._calls[min(self.strokes, len(self._calls) - 1)]

    @property
    def resting(self) -> bool:
        """Whether all balls are at rest, in what is shown."""
        return self.live.busy is None and at_rest(self.live.frame)

    @property
    def waits(self) -> bool:
        """Whether time stands still until somebody does something."""
        session = self.live.session
        last = not session.ahead and session.step_number >= session.history.furthest
        return last and session.ended is None and self.resting and self.strokes < len(self._turns)

    @property
    def aiming(self) -> bool:
        """Whether a stroke can be played now."""
        judged = self.resting and self.strokes < len(self._turns) and self.live.session.ended is None
        return judged and not self.match.over and self.live.frame is self.live.session.frame

    @property
    def mine(self) -> bool:
        """Whether it is a person's stroke."""
        return self.aiming and not self._bots(self.match)

    def _bots(self, match: Match) -> bool:
        return self.opponent is not None and match.turn == 1

    @property
    def ball(self) -> int:
        """Number of the ball that is struck next."""
        match = self.match
        return match.layout.number[match.cue]

    @property
    def place(self) -> Point:
        """Where that ball is, m."""
        if self.carried is not None:
            return self.carried
        x, y = self.live.frame.position[self.ball].tolist()
        return x, y

    def go_on(self, elapsed: float) -> None:
        """Look at what has become of the table, and let a bot play, in so much real time, s."""
        if not self.resting or self.live.frame is not self.live.session.frame:
            self.carried = None
            return
        if self.strokes >= len(self._turns):
            self._judge()
        elif self.waits:
            self._see()
        if self.aiming and self.waits and self.opponent is not None and self._bots(self.match):
            self._let_play(self.opponent, elapsed)

    def _see(self) -> None:
        """Take over where the balls are: hands may have moved them."""
        match, position = self._turns[self.strokes], self._position()
        if match.position != position:
            self._turns[self.strokes] = replace(match, position=position)

    def _position(self) -> tuple[Point, ...]:
        return tuple((x, y) for x, y in self.live.frame.position.tolist())

    def _judge(self) -> None:
        """Let the rules say what came of the last stroke."""
        strikes = [action for action in self.live.session.actions if isinstance(action, Strike)]
        number, frame = len(strikes) - 1, self.live.frame
        before, call = self._turns[-1], self._calls[min(number, len(self._calls) - 1)]
        try:
            after = before.played(self._contacts(strikes[-1].time), frame.position, call, strikes[-1].time)
        except GameError as error:
            self.notes.append(("warning", str(error)))
            after = replace(before, position=self._position())
        # Strokes of a session that was opened again have been seen only now.
        self._turns += [after] * (number + 2 - len(self._turns))
        self._calls += [Call()] * (number + 2 - len(self._calls))
        self.cue.centre()
        level = "warning" if after.verdict is not None and after.verdict.fouls else "info"
        self.notes += [(level, text) for text in after.messages]
        self._lay(after)

    def _contacts(self, began: float) -> Contacts:
        """Return the contacts since a time, s, each once: those that last are told again and again."""
        joined = Contacts.joined(self._heard) if self._heard else Contacts.none()
        rows = np.column_stack((joined.time, joined.pair)) if len(joined) else np.empty((0, 3))
        _, first = np.unique(rows, axis=0, return_index=True)
        kept = np.sort(first[joined.time[first] >= began])
        return Contacts(
            joined.time[kept], joined.pair[kept], joined.point[kept], joined.normal[kept], joined.impulse[kept]
        )

    def _lay(self, match: Match) -> None:
        """Put the balls where the game has them."""
        if self.live.session.ahead:
            return  # it was done then
        for move in match.moves(self.live.frame.position):
            self.live.act(move)

    def _let_play(self, opponent: Opponent, elapsed: float) -> None:
        """Go on with the bot's turn."""
        match = self.match
        thought = opponent.thought(match)
        if thought is None:
            return
        if thought.decisions or (thought.plan is not None and thought.plan.place is not None):
            for decision in thought.decisions:
                match = match.decide(decision)
            if thought.plan is not None and thought.plan.place is not None and match.state.in_hand is not None:
                match = match.place(thought.plan.place)
            if self._set(match) or thought.plan is None:
                return
        if thought.plan is not None and opponent.moves(self.cue, thought.plan.stroke, elapsed):
            self._calls[self.strokes :] = [thought.plan.call]
            opponent.forget()
            self._strike()

    def _set(self, match: Match) -> bool:
        """Go on with another match from here; tell whether the turn has passed by that."""
        passed = match.turn != self.match.turn or match.over
        self._turns[self.strokes :] = [match]
        self._lay(match)
        return passed

    def decide(self, decision: Decision) -> None:
        """Decide what is to be decided before a stroke.

        Raises:
            ActionError: it cannot be decided now.
        """
        self._check()
        try:
            match = self.match.decide(decision)
        except GameError as error:
            raise ActionError(str(error)) from None
        self._set(match)
        self.notes += [("info", text) for text in match.messages]

    @property
    def choice(self) -> Decision | None:
        """The decision that Enter would take; none where nothing is to be decided."""
        decisions = self.match.choices.decisions
        if not decisions:
            return None
        chosen = self._chosen[1] if self._chosen is not None and self._chosen[0] is self.match else 0
        return decisions[chosen % len(decisions)]

    def choose_next(self) -> None:
        """Look at the next of the decisions.

        Raises:
            ActionError: there are none.
        """
        self._check()
        decisions, now = self.match.choices.decisions, self.choice
        if now is None:
            raise ActionError("there is nothing to decide")
        self._chosen = self.match, decisions.index(now) + 1

    def take_choice(self) -> None:
        """Take the decision that was looked at last.

        Raises:
            ActionError: there is none.
        """
        self._check()
        choice = self.choice
        if choice is None:
            raise ActionError("there is nothing to decide")
        self.decide(choice)

    def call_safety(self) -> None:
        """Call a safety, or take that back.

        Raises:
            ActionError: it cannot be called now.
        """
        self._check()
        self.say(replace(self.call, safety=not self.call.safety))

    def say(self, call: Call) -> None:
        """Call a ball or a pocket.

        Raises:
            ActionError: it cannot be called now.
        """
        self._check()
        try:
            self.match.choices.check(call)
        except GameError as error:
            raise ActionError(str(error)) from None
        self._calls[self.strokes :] = [call]

    def shoot(self, speed: float | None = None) -> None:
        """Play the stroke, with its own power or another speed of the cue, m/s.

        Raises:
            ActionError: it cannot be played now.
        """
        self._check()
        choices, call = self.match.choices, self.call
        if choices.needed and call.pocket is None and not call.safety:
            raise ActionError("call the pocket first: click it")
        if self.carried is not None:
            self.put_down()
        if speed is not None:
            self.cue.speed = speed
        self._strike()

    def _strike(self) -> None:
        self._see()
        strokes, match, call = self.strokes, self.match, self.call
        self._turns[strokes:], self._calls[strokes:] = [match], [call]
        self.cue.back = 0.0
        self._heard.clear()
        self.live.act(match.strike(self.cue.stroke))

    def _check(self) -> None:
        if self.match.over and self.resting:
            raise ActionError("the frame is over; R begins another")
        if not self.aiming:
            raise ActionError("wait until the balls are at rest")
        if not self.mine:
            raise ActionError("it is the bot's turn")

    def take_in_hand(self) -> None:
        """Take the cue ball in hand, or put it down.

        Raises:
            ActionError: the rules do not give it.
        """
        if self.carried is not None:
            self.put_down()
            return
        self._check()
        if self.match.state.in_hand is None:
            if "in hand" not in self.match.choices.decisions:
                raise ActionError("the cue ball is not in hand")
            self.decide("in hand")
        self.carried, self.refused = self.place, False

    def carry(self, at: Point) -> None:
        """Move the hand that holds the cue ball; the ball stays where it may be put."""
        if self.carried is None or not self.mine or self.match.state.in_hand is None:
            return
        self.refused = self.match.refusal(at) is not None
        try:
            self.carried = self.match.nearest(at)
        except GameError:
            return

    def put_down(self) -> None:
        """Put the cue ball down.

        Raises:
            ActionError: it cannot be put there.
        """
        at, self.carried = self.carried, None
        if at is None or not self.mine:
            return
        try:
            self._set(self.match.place(at))
        except GameError as error:
            raise ActionError(str(error)) from None

    def undo(self) -> None:
        """Take back a person's last stroke, and what followed.

        Raises:
            ActionError: none was played.
        """
        strikes = [k for k, action in enumerate(self.live.session.actions) if isinstance(action, Strike)]
        known = list(zip(strikes, self._turns, strict=False))
        while known and self._bots(known[-1][1]):
            known.pop()
        if not known:
            raise ActionError("there is no stroke to take back")
        number, (place, _) = len(known) - 1, known[-1]
        struck = self.live.session.actions[place]
        assert isinstance(struck, Strike)
        self.live.retract(place)
        del self._turns[number + 1 :], self._calls[number + 1 :]
        self._heard.clear()
        self.carried = None
        if self.opponent is not None:
            self.opponent.forget()
        self.cue = Cue(struck.aim, struck.speed, struck.side, struck.height)
        self.notes.append(("info", "the stroke is taken back"))

    def aim(self) -> Aim | None:
        """Return what is drawn of the next stroke; nothing while balls roll."""
        if not self.aiming:
            return None
        match, cue, call, place = self.match, self.cue, self.call, self.place
        position = list(self._position())
        position[self.ball] = place
        pocket = match.layout.pockets.get(call.pocket or "")
        return Aim(
            self.ball,
            place,
            cue.aim,
            cue.side,
            cue.back,
            None if self.carried is not None else self._forecaster.of(cue.stroke, self.ball, tuple(position)),
            self.carried is not None,
            self.refused,
            None if pocket is None else ((pocket[0], pocket[1]), pocket[2]),
            match.layout.number.get(call.ball or ""),
        )

    def close(self) -> None:
        """Let go of the bot."""
        self.live.on_contacts = len
        if self.opponent is not None:
            self.opponent.close()
