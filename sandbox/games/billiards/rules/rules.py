"""Rules: what every game answers."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from typing import Any, Generic

from pydantic import TypeAdapter, ValidationError

from sandbox.games.billiards.rules.call import Call, Choices, Decision
from sandbox.games.billiards.rules.happening import GameError, Happening, Shot, read
from sandbox.games.billiards.rules.state import S
from sandbox.games.billiards.rules.verdict import Lie, Verdict


class Rules(ABC, Generic[S]):
    """A game. It keeps nothing: all there is to know of a frame is in its state."""

    name: str
    rack: str
    """how the balls lie at the start: `8-ball`, `9-ball`, `carom`, `snooker`"""
    cue_balls: tuple[str, ...] = ("cue",)
    kind: type[S]
    """of its states"""

    @abstractmethod
    def start(self, players: int = 2) -> S:
        """Return the state in which a frame begins.

        Raises:
            GameError: neither one nor two play.
        """

    @abstractmethod
    def legal_targets(self, state: S) -> frozenset[str]:
        """Return the balls that the cue ball may touch first; none once the frame is over."""

    def cue_ball(self, state: S) -> str:
        """Return the ball that is struck next."""
        return self.cue_balls[state.turn % len(self.cue_balls)]

    def choices(self, state: S) -> Choices:
        """Return what may be decided and called before the next shot."""
        return Choices(decisions=() if state.over else state.decisions)

    def judge(self, state: S, call: Call, happenings: Iterable[Happening], stayed_behind: bool = False) -> Verdict[S]:
        """Return what came of a shot. What was still to be decided is taken as `play`.

        Args:
            state: before the shot.
            call: what was said of it.
            happenings: in any order.
            stayed_behind: whether a cue ball in hand behind the head string first touched a ball there, and had not
                crossed the head string before.

        Raises:
            GameError: the frame is over, the call cannot be made now, or a ball is not on the table.
        """
        if state.over:
            raise GameError("the frame is over")
        self.choices(state).check(call)
        cue = self.cue_ball(state)
        shot = read(happenings, cue, state.without((cue,)), stayed_behind)
        return self._judge(replace(state, decisions=()), call, shot)

    def decide(self, state: S, decision: Decision) -> Verdict[S]:
        """Return what a decision leads to.

        Raises:
            GameError: it is not to be had now.
        """
        offered = self.choices(state).decisions
        if decision not in offered:
            raise GameError(f"{decision!r} is not offered now; options: {', '.join(offered) or 'none'}")
        return self._decide(replace(state, decisions=()), decision)

    def settle(self, state: S, lie: Lie) -> Verdict[S]:  # noqa: ARG002
        """Return the state with what follows from how the balls lie now, called after each shot and each spotting."""
        return Verdict(state)

    def document(self, state: S) -> dict[str, Any]:
        """Return a state as a JSON object."""
        plain: dict[str, Any] = self._adapter.dump_python(state, mode="json")
        return plain

    def restored(self, plain: Any) -> S:
        """Return the state of a JSON object, the inverse of `document`.

        Raises:
            GameError: it is not a state of this game, with all that is wrong.
        """
        try:
            return self._adapter.validate_python(plain)
        except ValidationError as error:
            lines = [f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors()]
            raise GameError("\n".join(lines)) from None

    @cached_property
    def _adapter(self) -> TypeAdapter[S]:
        return TypeAdapter(self.kind)

    @abstractmethod
    def _judge(self, state: S, call: Call, shot: Shot) -> Verdict[S]: ...

    def _decide(self, state: S, decision: Decision) -> Verdict[S]:
        if decision == "pass":
            return Verdict(replace(state, turn=state.other))
        return Verdict(state)
