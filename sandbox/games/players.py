"""Players of headless games: no input, random input, a script, or the bot of the game.

`PlayerSpec` describes a player as a value, which is stored with a run, and starts a game with it. `POLICIES` has the
players without a script. Script files have one input per line: `time, control, value`, with the time in s; a comment
starts with #.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from sandbox.echo import short_repr, shorten
from sandbox.game_names import games_with_bot
from sandbox.game_spec import import_part
from sandbox.games.contract import Control, Policy, Press, Rules, StepInfo, UnsuitableSceneError
from sandbox.games.registry import find_spec, rules_of
from sandbox.games.session import HeadlessGame
from sandbox.recording import Recording
from sandbox.resource_limits import read_limited
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.random_streams import Stream, draws

RATE_BOUNDS = 0.2, 2.0
"""1/s, bounds of the rate at which a random player presses an ordinary control; log-uniform, drawn once a control"""
HOLD_BOUNDS = 0.05, 1.6
"""s, bounds of the time for which it holds a control; log-uniform, drawn for each press. The longest suffice to pull a
plunger"""
FULL_PRESS_PROBABILITY = 0.5
"""probability that an analogue control is pressed fully, as a key does; the values of other presses are uniform from 0
to 1"""


class NoInput:
    """Policy that presses nothing."""

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:  # noqa: ARG002
        """Return nothing."""
        return ()


class RandomInput:
    """Policy that presses each control at random: pauses are exponentially distributed, with a rate per control."""

    def __init__(self, seed: int) -> None:
        self._rng = draws(Stream.KEYS, seed)
        self._changes: dict[str, tuple[float, bool]] = {}  # by control: time of the next change, whether it is down
        self._pauses: dict[str, float] = {}  # mean time between presses, s
        self._next = -math.inf  # time of the next change, s

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return the controls that change now."""
        if info.time < self._next:
            return ()
        if not self._changes:
            self._begin(rules.controls, info.time)
        found = []
        for control in rules.controls:
            due, down = self._changes[control.name]
            if due > info.time:
                continue
            down = not down
            # A control changes at most once a step.
            lasts = self._draw(HOLD_BOUNDS) if down else float(self._rng.exponential(self._pauses[control.name]))
            self._changes[control.name] = info.time + lasts, down
            found.append((control.name, self._level(control) if down else 0.0))
        self._next = min((due for due, _ in self._changes.values()), default=math.inf)
        return found

    def _begin(self, controls: Sequence[Control], time: float) -> None:
        for control in controls:
            pause = self._pauses[control.name] = 1.0 / (self._draw(RATE_BOUNDS) * control.often)
            self._changes[control.name] = time + self._rng.exponential(pause), False

    def _draw(self, bounds: tuple[float, float]) -> float:
        return float(np.exp(self._rng.uniform(*np.log(bounds))))

    def _level(self, control: Control) -> float:
        """Return the value of a press."""
        if not control.analogue or self._rng.uniform() < FULL_PRESS_PROBABILITY:
            return 1.0
        return float(self._rng.uniform())


class ScriptedInput:
    """Policy that plays the inputs of a script, each before the first step that starts at its time or later."""

    def __init__(self, presses: Iterable[Press]) -> None:
        self._presses = sorted(presses, key=lambda press: press.time)
        self._done = 0

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:  # noqa: ARG002
        """Return the inputs that are due."""
        begin = self._done
        while self._done < len(self._presses) and self._presses[self._done].time <= info.time + 1e-9:  # rounding
            self._done += 1
        return [(press.control, press.value) for press in self._presses[begin : self._done]]


def _no_input(scene: Scene) -> Policy:
    """Return the player that presses nothing.

    Raises:
        UnsuitableSceneError: the game waits for input before anything happens.
    """
    spec = find_spec(scene.play.game)
    reason = None if spec is None or spec.needs_player is None else import_part(spec.needs_player)(scene)
    if reason is not None:
        raise UnsuitableSceneError(reason)
    return NoInput()


def _skilled(scene: Scene) -> Policy:
    """Return the bot of a game.

    Raises:
        UnsuitableSceneError: the game has no bot.
    """
    spec = find_spec(scene.play.game)
    if spec is None or spec.bot is None:
        games = ", ".join(games_with_bot())
        raise UnsuitableSceneError(f"player 'skilled' plays {games}, not {scene.play.game}; use random")
    bot: Policy = import_part(spec.bot)(scene.world.seed)
    return bot


POLICIES: dict[str, Callable[[Scene], Policy]] = {
    "random": lambda scene: RandomInput(scene.world.seed),
    "none": _no_input,
    "skilled": _skilled,
}
"""Players that need no script, by name."""


MAX_SCRIPT_TIME = 1e9
"""s, the longest duration of a scene"""

MAX_SCRIPT_SIZE = 16 * 2**20
"""bytes"""

MAX_FAULTS = 20
"""Number of faults reported: in a file that is not a script, every line is one."""


def read_script(path: str | Path) -> tuple[Press, ...]:
    """Read a script.

    Raises:
        SceneError: the file cannot be read, or has faults; the error lists them.
    """
    try:
        lines = read_limited(Path(path), MAX_SCRIPT_SIZE).decode("utf-8").splitlines()
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise SceneError([Fault.of(str(path), f"cannot be read: {reason}")]) from None
    presses, faults = [], []
    for number, text in _statements(lines):
        try:
            presses.append(_press(text))
        except ValueError as error:
            faults.append(Fault(str(path), number, "", str(error)))
    if faults:
        raise SceneError(_limit_faults(faults, str(path)))
    return tuple(sorted(presses, key=lambda press: press.time))


def _statements(lines: Iterable[str]) -> Iterator[tuple[int, str]]:
    """Yield the numbers, from 1, and texts of the lines that are not empty, without comments."""
    for number, line in enumerate(lines, 1):
        text = line.partition("#")[0].strip()
        if text:
            yield number, text


def _press(text: str) -> Press:
    parts = [part.strip() for part in text.split(",")]
    try:
        time, control, value = float(parts[0]), ",".join(parts[1:-1]).strip(), float(parts[-1])
    except ValueError:
        raise ValueError(f"{short_repr(text)} should be `time, control, value`, such as `0.5, left, 1`") from None
    if len(parts) < 3 or not control:
        raise ValueError(f"{short_repr(text)} should be `time, control, value`, such as `0.5, left, 1`")
    if not (0.0 <= time <= MAX_SCRIPT_TIME):
        raise ValueError(f"a time of {shorten(parts[0])} s is out of range; it should be 0 to {MAX_SCRIPT_TIME:g}")
    if not (math.isfinite(value) and 0.0 <= value <= 1.0):
        raise ValueError(f"a value of {shorten(parts[-1])} is out of range; it should be 0 to 1, 0 releases it")
    return Press(time, control, value)


def faults_of(presses: Sequence[Press], controls: Sequence[Control], file: str) -> list[Fault]:
    """Return the faults of a script's inputs: unknown controls and invalid values, each once with its first line."""
    known = {control.name: control for control in controls}
    names = ", ".join(map(repr, known))
    found: dict[str, Press] = {}
    for press in presses:
        if press.control not in known:
            found.setdefault(f"there is no control {short_repr(press.control)}; the game has {names}", press)
        elif not known[press.control].analogue and press.value not in (0.0, 1.0):
            found.setdefault(f"{short_repr(press.control)} is 0 or 1, not {press.value:g}", press)
    lines = _lines(file) if found else {}
    faults = [Fault(file, lines.get(press), "", message) for message, press in found.items()]
    return _limit_faults(faults, file)


def _limit_faults(faults: list[Fault], file: str) -> list[Fault]:
    """Return the first `MAX_FAULTS` faults, and one with the number of the others."""
    more = len(faults) - MAX_FAULTS
    if more <= 0:
        return faults
    return [*faults[:MAX_FAULTS], Fault.of(file, f"{more:,} more faults")]


def _lines(file: str) -> dict[Press, int]:
    """Return the line of each input; empty if the file can no longer be read."""
    try:
        statements = [*_statements(read_limited(Path(file), MAX_SCRIPT_SIZE).decode("utf-8").splitlines())]
        return {_press(text): number for number, text in reversed(statements)}  # of equal inputs, the first
    except (OSError, ValueError):
        return {}


RECORDED = "as recorded"
"""Name of the player in the replay of a recorded session."""


@dataclass(frozen=True)
class PlayerSpec:
    """A player: one of `POLICIES`, a script, or the inputs of a recorded session."""

    name: str = "random"
    """a name in `POLICIES`, the path of a script, or `RECORDED`"""
    presses: tuple[Press, ...] = ()
    """inputs of the script or the session"""

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the player of a name in `POLICIES`, or of the path of a script.

        Raises:
            SceneError: there is no such player or file, or the script has faults.
        """
        if text in POLICIES:
            return cls(text)
        try:
            reason = "" if Path(text).exists() else "No such file"
        except (OSError, ValueError) as error:  # such as a name longer than any file's
            reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        if reason:
            message = f"cannot be read: {reason}; a player is {', '.join(POLICIES)} or a script file"
            raise SceneError([Fault.of(text, message)])
        return cls(text, read_script(text))

    @classmethod
    def from_recording(cls, session: Recording) -> Self:
        """Return the player that repeats the inputs of a session, whose actions are applied as recorded."""
        return cls(RECORDED, session.presses)

    def start_game(self, scene: Scene, file: str = "<scene>") -> HeadlessGame | None:
        """Start the game of a scene; return None if it has no game with rules.

        Args:
            scene: expanded scene.
            file: name of the scene in faults.

        Raises:
            SceneError: the scene lacks an element that its game needs, or the game lacks a control of the script.
        """
        rules = rules_of(scene, file, on_request=True)
        if rules is None:
            return None
        if self.name == RECORDED:
            return HeadlessGame(rules, None, RECORDED, self.presses)
        if self.name in POLICIES:
            try:
                return HeadlessGame(rules, POLICIES[self.name](scene), self.name)
            except UnsuitableSceneError as error:
                raise SceneError([Fault.of("--player", str(error))]) from None
        faults = faults_of(self.presses, rules.controls, self.name)
        if faults:
            raise SceneError(faults)
        return HeadlessGame(rules, ScriptedInput(self.presses), self.name)

    def to_dict(self, scene: Scene) -> dict[str, Any]:
        """Return the game, the player and its inputs as JSON values."""
        name = self.name if self.name in (*POLICIES, RECORDED) else "script"
        return {"game": scene.play.game, "player": name, "presses": [list(press) for press in self.presses]}
