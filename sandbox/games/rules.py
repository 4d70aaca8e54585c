"""Rules: the seam between a game and whatever plays it: a headless run, the window, an environment for learning.

A game is a scene and rules. The rules see what happened, step by step, and say what happens next, as actions; they
know no engine and no window. Whoever plays them (the host) does, at the start and after every step:

    look(seen)                            what the game itself does
    control(name, value), for each press  what the player does
    then applies what look said, then what the controls said, and steps

and stamps the present time on every action. Once `over` says why, the last look's actions are applied, and no rules
are asked any more. Rules are plain objects that `copy.deepcopy` copies: rewinding restores a copy. They are
deterministic; all chance comes from the scene's seed.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

from sandbox.action import Action
from sandbox.recording import Press
from sandbox.trajectory import Contacts, Frame

__all__ = ["Control", "Gauged", "Lit", "Logged", "Policy", "Press", "Rules", "Seen", "UnfitError"]


class UnfitError(ValueError):
    """A scene cannot be played by the rules that it names: raised as a game begins. `str()` says what it needs."""


class Seen(NamedTuple):
    """What rules see, once at the start and once after every step."""

    time: float
    """s"""
    frame: Frame
    contacts: Contacts
    """of the last step; one that lasts is seen at every step, with the time of its first touch"""
    actions: tuple[Action, ...]
    """the player's, applied before this step: those of the controls, and whatever else a hand did"""


class Control(NamedTuple):
    """One thing that a player can do: a key, a button of a gamepad, an entry of an action, a word of a script."""

    name: str
    """a word or two, unique in the game"""
    about: str
    """what it does, for help"""
    keys: tuple[str, ...]
    """as the window names them, such as `("left shift", "z")`; never p, o, f1 or escape"""
    pad: str | None = None
    """on a gamepad: `a b x y lb rb lt rt left right up down`, or a stick's half such as `-leftx`, `+righty`; several
    are separated by blanks"""
    analogue: bool = False
    """its value is 0 to 1; else it is 0 or 1"""
    often: float = 1.0
    """of the presses of usual controls, those of this one by whoever presses at chance; more than 0"""


class Rules(Protocol):
    """A game that is being played."""

    @property
    def controls(self) -> tuple[Control, ...]:
        """What a player can do; the same throughout a game."""

    @property
    def score(self) -> int | float:
        """Of who plays, or the best."""

    @property
    def over(self) -> str | None:
        """Why the game is over; None while it goes on."""

    def control(self, name: str, value: float) -> Sequence[Action]:
        """Return what comes of pressing a control now (`value` > 0), or of letting it go (0)."""

    def look(self, seen: Seen) -> Sequence[Action]:
        """See what happened, and return what the game itself does, applied before the next step."""

    def lines(self) -> Sequence[tuple[str, str]]:
        """Return what a score panel shows, as labels and texts, the most important first."""

    def cues(self) -> Sequence[str]:
        """Return the names of the sounds since the last call."""


@runtime_checkable
class Logged(Protocol):
    """Rules that tell, besides, what has happened."""

    @property
    def log(self) -> Sequence[tuple[float, str]]:
        """When, s, and what, in order."""


@runtime_checkable
class Gauged(Protocol):
    """Rules with gauges, besides: what a player reads off the window, as numbers for who learns to play."""

    def gauges(self) -> Sequence[tuple[str, float]]:
        """Return names and values, finite; the same names in the same order throughout a game, whatever the seed."""


@runtime_checkable
class Lit(Protocol):
    """Rules that light lamps, besides."""

    def lit(self) -> frozenset[str]:
        """Return the names of the parts, `[[play.part]]`, whose lamps are lit now."""


class Policy(Protocol):
    """Who plays."""

    def decide(self, seen: Seen, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return the controls that are set now, and to what; asked once a step, after the rules have looked."""
