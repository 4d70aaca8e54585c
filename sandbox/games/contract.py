"""Interface between the rules of a game and its hosts: headless runs, the window, and Gymnasium environments.

A game is a scene and rules. After every step the rules see the state and the contacts, and return actions; they know
neither engine nor window. A host calls, at the start and after every step:

    on_step(info)                          actions of the game itself
    on_input(control, value)               actions of the player, for each control that changed

It sets the time of all actions to the present, applies those of `on_step` first, then those of `on_input`, and makes
the next step. Once `game_over` is not None, the actions of the last `on_step` are applied and the rules are not called
any more. Rules must support `copy.deepcopy`, because undo restores a copy. They are deterministic: all random numbers
derive from the seed of the scene.

Optional members, each with a protocol: `log`, `observation()`, `lit_lamps()`, `waiting`, `quiet_steps(dt)`,
`view_state(time)`.

`GameControls` is the input of a game in the window, where keys that set controls do not suffice. It acts on the game
through its `GameHost`. Its pygame surfaces, rectangles and events are `Any` here, so that runs without a window do
without pygame.

The skill of a bot is a number from 0 to 1.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

from sandbox.action import Action
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Members, WorldStates
from sandbox.recording import Press
from sandbox.trajectory import Contacts, Frame

__all__ = [
    "Control",
    "ControlBindings",
    "GameControls",
    "GameHud",
    "GameParameter",
    "HasLamps",
    "HasLog",
    "HasObservation",
    "HasQuietSteps",
    "HasViewState",
    "HasWaiting",
    "Policy",
    "Press",
    "Rules",
    "StepInfo",
    "UnsuitableSceneError",
    "VectorRules",
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


class VectorRules(Protocol):
    """Rules of M independent games of one scene, as arrays: what `Rules` of each game would do, bit for bit.

    Only games whose controls set levels of thrusts can have them. A host calls:

        restart(games, seeds)                  start states of new games
        set_controls(games, levels)            controls, between two steps
        on_step(games, states)                 after at most `quiet_steps(dt)` steps, and after a step with contacts

    A game in which a body is removed is over.
    """

    controls: tuple[Control, ...]
    score: IntArray
    """(M,)"""
    game_over: list[str | None]
    """reason why each game is over; None while it runs"""
    thrust_level: FloatArray
    """(M, T) level of each thrust of the scene, as the rules set it"""

    def restart(self, games: IntArray, seeds: Sequence[int]) -> Members:
        """Start games, by their (K,) indices, with K seeds; return the K start states of their bodies."""

    def set_controls(self, games: IntArray, levels: FloatArray) -> None:
        """Set the controls of K games to levels (K, C), from 0 to 1."""

    def quiet_steps(self, dt: float) -> IntArray:
        """Return for each game, (M,), what `HasQuietSteps.quiet_steps` returns."""

    def on_step(self, games: IntArray, states: WorldStates) -> None:
        """Update games, by their (K,) indices, after steps; the states are those of all M worlds."""

    def observation(self) -> FloatArray:
        """Return the values (M, O) of the observation of each game."""


@runtime_checkable
class HasViewState(Protocol):
    """Rules that pass values to the `GameView` of their game."""

    def view_state(self, time: float) -> object | None:
        """Return the values to draw at a time, s, up to the present; None to draw none.

        Times between the last two steps occur when the window interpolates. Earlier times occur when it shows the
        past, which the rules may not know.
        """


class ControlBindings(NamedTuple):
    """Keys that a game binds in the window."""

    pressed: Mapping[int, Callable[[], object]]
    """handlers of presses by pygame key code; they may raise `ActionError`"""
    released: Mapping[int, Callable[[], object]]
    """handlers of releases by pygame key code"""
    help_rows: tuple[tuple[str, str], ...]
    """(keys, action) for the help page"""


class GameParameter(NamedTuple):
    """Choice in the side panel that restarts the game."""

    key: str
    label: str
    value: str
    choices: tuple[str, ...]


class GameHud(Protocol):
    """Head-up display of a game in place of the score panel. Lengths are in px; `free` is the free area, a `Rect`."""

    def draw(self, surface: Any, free: Any, left: int, ui_scale: float) -> None:
        """Draw it.

        Args:
            surface: target.
            free: free area.
            left: right edge of the status plate at the upper left.
            ui_scale: UI scale, 1 on a display of 1080 lines.
        """

    def reserved(self, free: Any, left: int, ui_scale: float) -> list[Any]:
        """Return the rectangles of its plates, also of those that are hidden now; arguments as for `draw`."""

    def plates(self, free: Any, ui_scale: float) -> dict[str, Any]:
        """Return the rectangles of its plates as last drawn, by name."""

    def handle_event(self, event: Any, run: Callable[[Callable[[], object]], bool]) -> bool:
        """Handle a mouse event; return whether it was used. `run` calls a handler that may raise `ActionError`."""


class GameControls(Protocol):
    """Input of a game in the window, for games that need more than the keys of `Rules.controls`.

    Positions are in m. The mouse handlers may raise `ActionError`, whose text is shown as a warning.
    """

    @property
    def hint(self) -> str:
        """Message at the start: how to play."""

    @property
    def hud(self) -> GameHud:
        """Its head-up display."""

    @property
    def drag_refusal(self) -> str | None:
        """Reason why the mouse may not drag bodies now; None if it may."""

    @property
    def is_own_score(self) -> bool:
        """Whether the final score is that of a player at the window, and may enter the high scores."""

    def bindings(self) -> ControlBindings:
        """Return the key bindings; called once."""

    def press(self, position: tuple[float, float], tolerance: float) -> bool:
        """Handle a press of the left button; return whether it is used. `tolerance` for hits is in m."""

    def move(
        self,
        before: tuple[float, float],
        now: tuple[float, float],
        pixels: tuple[float, float],
        fine: bool,
        time: float,
    ) -> None:
        """Handle a movement of the mouse.

        Args:
            before: previous position.
            now: present position.
            pixels: movement to the right and downwards, px at UI scale 1.
            fine: whether Shift is held.
            time: s, of the event.
        """

    def release(self, position: tuple[float, float], moved: bool, picked: int | None) -> None:
        """Handle a release of the left button; `moved` if it was no click, `picked` is the index of a clicked body."""

    def update(self, elapsed: float) -> None:
        """Advance animations and bots by an interval of real time, s; it may raise `ActionError`."""

    def messages(self) -> list[tuple[str, str]]:
        """Return (level, text) of the messages since the last call."""

    def parameters(self) -> tuple[GameParameter, ...]:
        """Return the choices for the side panel. A changed one is among the options of the restarted game."""

    def annotate(self, snapshot: Any) -> Any:
        """Return a `Snapshot` with the values that the view of the game draws."""

    def close(self) -> None:
        """Release resources, such as threads."""


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
