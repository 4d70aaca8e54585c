"""Interface between the rules of a game and its hosts: headless runs, the window, and Gymnasium environments.

A game is a scene and rules. After every step the rules see the state and the contacts, and return actions; they know
neither engine nor window. A host calls, at the start and after every step:

    on_step(info)                          actions of the game itself
    on_input(control, value)               actions of the player, for each control that changed

It sets the time of all actions to the present, applies those of `on_step` first, then those of `on_input`, and makes
the next step. Once `game_over` is not None, the actions of the last `on_step` are applied and the rules are not called
any more. Rules must support `copy.deepcopy`, because undo restores a copy. They are deterministic: all random numbers
derive from the seed of the scene.

Optional members, each with a protocol: `log`, `observation()`, `observation_ranges()`, `lit_lamps()`, `waiting`,
`quiet_steps(dt)`, `view_state(time)`; and of games of several players `player`, `scores`, `bots` and `winner`.

The skill of a bot is a number from 0 to 1.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple, Protocol, runtime_checkable

from sandbox.action import Action
from sandbox.recording import Press
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.scene import first_sensor
from sandbox.trajectory import Contacts, Frame

__all__ = [
    "Control",
    "HasLamps",
    "HasLog",
    "HasObservation",
    "HasObservationRanges",
    "HasPlayers",
    "HasQuietSteps",
    "HasViewState",
    "HasWaiting",
    "ObservationRange",
    "Policy",
    "Press",
    "Rules",
    "StepInfo",
    "UnsuitableSceneError",
    "position_ranges",
    "sensed_objects",
]


class UnsuitableSceneError(ValueError):
    """The scene lacks an element that the rules of its game need; raised at the start of a game.

    `str()` names the element.
    """


class StepInfo(NamedTuple):
    """Input of the rules at the start and after every step."""

    time: float
    """s"""
    frame: Frame
    contacts: Contacts
    """contacts of the last step; a lasting contact appears at every step, with the time of its first touch"""
    actions: tuple[Action, ...]
    """actions of the player that were applied before this step, from controls, or from direct manipulation of bodies"""


def sensed_objects(info: StepInfo, scene: Scene) -> dict[str, tuple[int, ...]]:
    """Return what each sensor of a scene detects at the end of a step, by the names of the sensors.

    Args:
        info: of the step.
        scene: the scene.

    Returns:
        Objects with the indices of `Contacts`: bodies from 0, and −1 − k for the k-th static object.
    """
    first, pairs = first_sensor(scene), info.contacts.pair.tolist()
    names = scene.fixed_names[-1 - first :]
    return {name: tuple(a for a, b in pairs if b == first - k) for k, name in enumerate(names)}


class Control(NamedTuple):
    """Control of a game: a key, a gamepad button, an entry of an action, or a word of a script."""

    name: str
    """one or two words, unique in the game"""
    about: str
    """description for the help overlay"""
    keys: tuple[str, ...]
    """names of its keys in the window, such as `("left shift", "z")`; never p, o, f1 or escape"""
    pad: str | None = None
    """on a gamepad: `a b x y lb rb lt rt left right up down`, or half of a stick axis such as `-leftx`, `+righty`;
    several are separated by blanks"""
    analogue: bool = False
    """whether its value is any number from 0 to 1; otherwise it is 0 or 1"""
    often: float = 1.0
    """relative frequency with which a random player presses it; greater than 0"""
    dead_zone: float = 0.0
    """value up to which an analogue control counts as released in an action of an environment, because agents rarely
    choose exactly 0"""


class Rules(Protocol):
    """Rules and state of a running game."""

    @property
    def controls(self) -> tuple[Control, ...]:
        """Controls of the player; constant during a game."""

    @property
    def score(self) -> int | float:
        """Score of the current player, or the best score."""

    @property
    def game_over(self) -> str | None:
        """Reason why the game is over; None while it runs."""

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        """Return the actions of pressing a control now (`value` > 0), or of releasing it (0)."""

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        """Update the rules after a step, and return the actions of the game itself for the next step."""

    def display_lines(self) -> Sequence[tuple[str, str]]:
        """Return the lines of the score panel, as labels and texts, the most important first."""

    def sounds(self) -> Sequence[str]:
        """Return the names of the sounds to play since the last call."""


@runtime_checkable
class HasLog(Protocol):
    """Rules that keep a log of events."""

    @property
    def log(self) -> Sequence[tuple[float, str]]:
        """Time, s, and text of each event, in order."""


@runtime_checkable
class HasRanking(Protocol):
    """Rules of a game whose score does not always count as a high score, such as the consolation points of a crash."""

    @property
    def is_ranked(self) -> bool:
        """Whether the score of the finished game may enter the high scores."""


@runtime_checkable
class HasObservation(Protocol):
    """Rules that return numbers for learning agents: the state of the game that a player reads from the window."""

    def observation(self) -> Sequence[tuple[str, float]]:
        """Return names and finite values; names and order are constant during a game, for every seed."""


class ObservationRange(NamedTuple):
    """Range and unit of an observed number."""

    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    """empty for numbers without a dimension"""


FLAG = ObservationRange(0.0, 1.0)
"""Range of a number that is 0 or 1."""


@runtime_checkable
class HasObservationRanges(Protocol):
    """Rules that state the ranges of observed numbers, as bounds of the observation space."""

    def observation_ranges(self) -> Mapping[str, ObservationRange]:
        """Return ranges by the names of `observation`, and of states of bodies, such as `ball x`.

        Numbers without a range are unbounded. Observed numbers are clipped to their ranges. The ranges are constant
        during a game, for every seed.
        """


def position_ranges(bodies: Iterable[str], lower: Point, upper: Point) -> dict[str, ObservationRange]:
    """Return the ranges of x and y of bodies that stay in a rectangle, by its lower left and upper right corner, m."""
    ranges = {axis: ObservationRange(lower[k], upper[k], "m") for k, axis in enumerate("xy")}
    return {f"{body} {axis}": each for body in bodies for axis, each in ranges.items()}


@runtime_checkable
class HasPlayers(Protocol):
    """Rules of a game of several players or teams, who take turns."""

    @property
    def player(self) -> str:
        """Name of the player whose turn it is."""

    @property
    def scores(self) -> Mapping[str, int | float]:
        """Score of each player by name; the names are constant during a game."""

    @property
    def bots(self) -> Collection[str]:
        """Names of the players that the rules play themselves; constant during a game."""

    @property
    def winner(self) -> str | None:
        """Name of the winner once the game is over; None before, and after a draw."""


@runtime_checkable
class HasLamps(Protocol):
    """Rules that light lamps."""

    def lit_lamps(self) -> frozenset[str]:
        """Return the names of the parts, `[[play.part]]`, whose lamps are lit."""


@runtime_checkable
class HasWaiting(Protocol):
    """Rules of a game in which time stops until the player acts."""

    @property
    def waiting(self) -> bool:
        """Whether the host makes no step until an input or an action of the player."""


@runtime_checkable
class HasQuietSteps(Protocol):
    """Rules that need not see every step in which nothing happens.

    A host may then leave out calls of `on_step`. State and actions of the rules must not depend on that.
    """

    def quiet_steps(self, dt: float) -> int:
        """Return the number of next steps of dt, s, of which only the last must be passed to `on_step`.

        This holds as long as nothing touches and no body leaves the scene. A step in which that happens is passed to
        `on_step`, and so is the one before it.
        """


@runtime_checkable
class HasViewState(Protocol):
    """Rules that pass values to the `GameView` of their game."""

    def view_state(self, time: float) -> object | None:
        """Return the values to draw at a time, s, up to the present; None to draw none.

        Times between the last two steps occur when the window interpolates. Earlier times occur when it shows the
        past, which the rules may not know.
        """


class Policy(Protocol):
    """Player of a game."""

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return the controls to set now and their values; called once a step, after `Rules.on_step`."""


def checked_skill(skill: float) -> float:
    """Return a valid skill unchanged.

    Raises:
        ValueError: the skill is not from 0 to 1.
    """
    if not 0.0 <= skill <= 1.0:
        raise ValueError(f"skill {skill:g} is out of range; it should be 0 to 1")
    return skill
