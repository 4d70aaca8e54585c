"""Rules: the seam between a game and whatever plays it: a headless run, the window, an environment for learning.

A game is a scene and rules. The rules see what happened, step by step, and say what happens next, as actions; they
know no engine and no window. Whoever plays them (the host) does, at the start and after every step:

    look(seen)                            what the game itself does
    control(name, value), for each press  what the player does
    then applies what look said, then what the controls said, and steps

and stamps the present time on every action. Once `over` says why, the last look's actions are applied, and no rules
are asked any more. Rules are plain objects that `copy.deepcopy` copies: rewinding restores a copy. They are
deterministic; all chance comes from the scene's seed.

Skill: how well a player plays that is a program, from 0 to 1.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

from sandbox.action import Action
from sandbox.recording import Press
from sandbox.trajectory import Contacts, Frame

__all__ = [
    "Control",
    "HasLamps",
    "HasLog",
    "HasObservation",
    "Policy",
    "Press",
    "Rules",
    "StepInfo",
    "UnsuitableSceneError",
]


class UnsuitableSceneError(ValueError):
    """The scene lacks an element that the rules of its game need; raised at the start of a game.

    `str()` names the element.
    """


class StepInfo(NamedTuple):
    """Input of the rules, at the start and after every step."""

    time: float
    """s"""
    frame: Frame
    contacts: Contacts
    """contacts of the last step; a lasting contact appears at every step, with the time of its first touch"""
    actions: tuple[Action, ...]
    """actions of the player that were applied before this step, from controls or by hand"""


class Control(NamedTuple):
    """Control of a game: a key, a gamepad button, an entry of an action, or a word of a script."""

    name: str
    """one or two words, unique in the game"""
    about: str
    """description for the help overlay"""
    keys: tuple[str, ...]
    """names of its keys in the window, such as `("left shift", "z")`; never p, o, f1 or escape"""
    pad: str | None = None
    """on a gamepad: `a b x y lb rb lt rt left right up down`, or a stick's half such as `-leftx`, `+righty`; several
    are separated by blanks"""
    analogue: bool = False
    """whether its value is any number from 0 to 1; otherwise it is 0 or 1"""
    often: float = 1.0
    """frequency with which a random player presses it, relative to an ordinary control; greater than 0"""


class Rules(Protocol):
    """Rules and state of a running game."""

    @property
    def controls(self) -> tuple[Control, ...]:
        """Controls of the player; constant during a game."""

    @property
    def score(self) -> int | float:
        """Score of the present player, or the best score."""

    @property
    def over(self) -> str | None:
        """Reason why the game is over; None while it runs."""

    def control(self, name: str, value: float) -> Sequence[Action]:
        """Return the actions of pressing a control now (`value` > 0), or of releasing it (0)."""

    def look(self, seen: StepInfo) -> Sequence[Action]:
        """Update the rules after a step, and return the actions of the game itself for the next step."""

    def lines(self) -> Sequence[tuple[str, str]]:
        """Return the lines of the score panel, as labels and texts, the most important first."""

    def cues(self) -> Sequence[str]:
        """Return the names of the sounds since the last call."""


@runtime_checkable
class HasLog(Protocol):
    """Rules that also keep a log of events."""

    @property
    def log(self) -> Sequence[tuple[float, str]]:
        """Time, s, and text of each event, in order."""


@runtime_checkable
class HasObservation(Protocol):
    """Rules that also have gauges: numbers that a player reads off the window, for learning agents."""

    def gauges(self) -> Sequence[tuple[str, float]]:
        """Return names and finite values; names and order are constant during a game, for every seed."""


@runtime_checkable
class HasLamps(Protocol):
    """Rules that also light lamps."""

    def lit(self) -> frozenset[str]:
        """Return the names of the parts, `[[play.part]]`, whose lamps are lit."""


class Policy(Protocol):
    """Player of a game."""

    def decide(self, seen: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return the controls to set now and their values; called once a step, after `Rules.look`."""


def checked_skill(skill: float) -> float:
    """Return a skill as it is.

    Raises:
        ValueError: it is not from 0 to 1.
    """
    if not 0.0 <= skill <= 1.0:
        raise ValueError(f"skill {skill:g} is out of range; it should be 0 to 1")
    return skill
