"""Person: what one who plays at the table decides, calls, and does with a cue ball in hand."""

from dataclasses import replace

from sandbox.action import ActionError
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.call import Call, Decision
from sandbox.games.billiards.rules.happening import GameError
from sandbox.play.billiards.game import Game
from sandbox.scene.description.base import Point


class Person:
    """Who sits at the window."""

    def __init__(self, game: Game) -> None:
        self.game = game
        self._carried: tuple[int, Point] | None = None  # after how many strokes, and where
        self.refused = False
        """the cue ball may not be put where the hand is"""
        self._chosen: tuple[Match, int] | None = None

    @property
    def carried(self) -> Point | None:
        """Where the hand holds the cue ball, m."""
        if self._carried is None or self._carried[0] != self.game.strokes or not self.game.mine:
            return None
        return self._carried[1]

    @property
    def place(self) -> Point:
        """Where the ball is that is struck next, m."""
        return self.carried or self.game.position[self.game.ball]

    @property
    def choice(self) -> Decision | None:
        """The decision that Enter would take; none where nothing is to be decided."""
        match = self.game.match
        decisions = match.choices.decisions
        if not decisions:
            return None
        chosen = self._chosen[1] if self._chosen is not None and self._chosen[0] is match else 0
        return decisions[chosen % len(decisions)]

    def choose_next(self) -> None:
        """Look at the next of the decisions.

        Raises:
            ActionError: there are none.
        """
        self.game.check()
        now, match = self.choice, self.game.match
        if now is None:
            raise ActionError("there is nothing to decide")
        self._chosen = match, match.choices.decisions.index(now) + 1

    def take_choice(self) -> None:
        """Take the decision that was looked at last.

        Raises:
            ActionError: there is none.
        """
        self.game.check()
        if self.choice is None:
            raise ActionError("there is nothing to decide")
        self.decide(self.choice)

    def decide(self, decision: Decision) -> None:
        """Decide what is to be decided before a stroke.

        Raises:
            ActionError: it cannot be decided now.
        """
        self.game.check()
        try:
            match = self.game.match.decide(decision)
        except GameError as error:
            raise ActionError(str(error)) from None
        self.game.go_another_way(match)

    def say(self, call: Call) -> None:
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
        """Call a safety, or take that back.

        Raises:
            ActionError: it cannot be called now.
        """
        self.say(replace(self.game.call, safety=not self.game.call.safety))

    def shoot(self, speed: float | None = None) -> None:
        """Play the stroke; a ball in the hand is put down before.

        Raises:
            ActionError: it cannot be played now.
        """
        self.put_down()
        self.game.shoot(speed)

    def take_in_hand(self) -> None:
        """Take the cue ball in hand, or put it down.

        Raises:
            ActionError: the rules do not give it.
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
        """Move the hand that holds the cue ball, m; the ball goes where it may be put, as near as can be."""
        match = self.game.match
        if self.carried is None or match.state.in_hand is None:
            return
        self.refused = match.refusal(at) is not None
        try:
            self._carried = self.game.strokes, match.nearest(at)
        except GameError:  # no room at all: it stays
            self.refused = True

    def put_down(self) -> None:
        """Put a ball that is carried down.

        Raises:
            ActionError: it cannot be put there.
        """
        at, self._carried = self.carried, None
        if at is None:
            return
        try:
            match = self.game.match.place(at)
        except GameError as error:
            raise ActionError(str(error)) from None
        self.game.go_another_way(match)
