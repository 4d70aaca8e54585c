"""Policies: who plays where nobody sits at the window. But for the skilled they look at nothing: they press keys.

Script files: who presses what when, a line each: `time, control, value`; what follows a # is a remark.

Player: who plays a headless game, as a value that a run can be known by.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from sandbox.echo import short_repr, shorten
from sandbox.games.contract import Control, Policy, Press, Rules, StepInfo, UnsuitableSceneError
from sandbox.games.names import games_with_bot
from sandbox.games.registry import find_spec, fitting_rules
from sandbox.games.session import HeadlessGame
from sandbox.games.spec import import_part
from sandbox.recording import Recording
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.random_streams import Stream, draws
from sandbox.scene.scene import Scene
from sandbox.whole import read_whole

RATES = 0.2, 2.0
"""1/s, how often a random player presses a usual control: one rate for each, drawn evenly by factors between these"""
HOLDS = 0.05, 1.6
"""s, how long it holds a control: drawn likewise, for each press anew; what takes a second to draw is drawn at times"""
FULL = 0.5
"""of the presses of what can be pressed by halves, those all the way, as keys do; others are even from 0 to 1"""


class NoInput:
    """Presses nothing."""

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:  # noqa: ARG002
        """Return nothing."""
        return ()


class RandomInput:
    """Presses each control at random times, exponentially distributed at a rate of its own, and holds it a while."""

    def __init__(self, seed: int) -> None:
        self._chance = draws(Stream.KEYS, seed)
        self._turns: dict[str, tuple[float, bool]] = {}  # by control: when it changes next, and whether it is down
        self._pauses: dict[str, float] = {}  # s between presses, on average
        self._next = -math.inf  # when anything changes, s

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return what changes now."""
        if info.time < self._next:
            return ()
        if not self._turns:
            self._begin(rules.controls, info.time)
        found = []
        for control in rules.controls:
            due, down = self._turns[control.name]
            if due > info.time:
                continue
            down = not down
            # No sooner than the next step: a control changes once a step.
            lasts = self._drawn(HOLDS) if down else float(self._chance.exponential(self._pauses[control.name]))
            self._turns[control.name] = info.time + lasts, down
            found.append((control.name, self._level(control) if down else 0.0))
        self._next = min((due for due, _ in self._turns.values()), default=math.inf)
        return found

    def _begin(self, controls: Sequence[Control], time: float) -> None:
        for control in controls:
            pause = self._pauses[control.name] = 1.0 / (self._drawn(RATES) * control.often)
            self._turns[control.name] = time + self._chance.exponential(pause), False

    def _drawn(self, bounds: tuple[float, float]) -> float:
        return float(np.exp(self._chance.uniform(*np.log(bounds))))

    def _level(self, control: Control) -> float:
        """Return how far a control is pressed."""
        if not control.analogue or self._chance.uniform() < FULL:
            return 1.0
        return float(self._chance.uniform())


class ScriptedInput:
    """Presses what a script says, each before the first step that starts at its time or later."""

    def __init__(self, presses: Iterable[Press]) -> None:
        self._presses = sorted(presses, key=lambda press: press.time)
        self._done = 0

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:  # noqa: ARG002
        """Return what is due."""
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
        UnsuitableSceneError: the game has none.
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
"""Those that need no script, by name."""


MAX_SCRIPT_TIME = 1e9
"""s, as of a scene"""

MAX_BYTES = 16 * 2**20

MAX_FAULTS = 20
"""Faults that are reported; of a file that is no script, every line is wrong."""


def read_script(path: str | Path) -> tuple[Press, ...]:
    """Read a script.

    Raises:
        SceneError: it cannot be read, or lines are wrong; all of them are told.
    """
    try:
        lines = read_whole(Path(path), MAX_BYTES).decode("utf-8").splitlines()
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise SceneError([Fault(str(path), None, "", f"cannot be read: {reason}")]) from None
    presses, faults = [], []
    for number, text in _said(lines):
        try:
            presses.append(_press(text))
        except ValueError as error:
            faults.append(Fault(str(path), number, "", str(error)))
    if faults:
        raise SceneError(_some(faults, str(path)))
    return tuple(sorted(presses, key=lambda press: press.time))


def _said(lines: Iterable[str]) -> Iterator[tuple[int, str]]:
    """Yield the lines that say something, without remarks, and their numbers from 1 on."""
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
    """Return what of a script a game cannot do, each fault once, with the line where it is first."""
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
    return _some(faults, file)


def _some(faults: list[Fault], file: str) -> list[Fault]:
    """Return the first `MAX_FAULTS` faults, and one that stands for the others."""
    more = len(faults) - MAX_FAULTS
    if more <= 0:
        return faults
    return [*faults[:MAX_FAULTS], Fault(file, None, "", f"{more:,} more faults")]


def _lines(file: str) -> dict[Press, int]:
    """Return the line of each press; none where the file has gone since it was read."""
    try:
        said = [*_said(read_whole(Path(file), MAX_BYTES).decode("utf-8").splitlines())]
        return {_press(text): number for number, text in reversed(said)}  # of equals the first
    except (OSError, ValueError):
        return {}


RECORDED = "as recorded"
"""What the player of a session is called that is seen again."""


@dataclass(frozen=True)
class PlayerSpec:
    """One of the policies, who presses what a script says, or whoever played a session."""

    name: str = "random"
    """of `POLICIES`, a script's file, or `RECORDED`"""
    presses: tuple[Press, ...] = ()
    """of a script or a session"""

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the player that a text names: one of `POLICIES`, or else the file of a script.

        Raises:
            SceneError: there is none, or the script cannot be read, or has faults.
        """
        if text in POLICIES:
            return cls(text)
        try:
            reason = "" if Path(text).exists() else "No such file"
        except (OSError, ValueError) as error:  # such as a name longer than any file's
            reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        if reason:
            message = f"cannot be read: {reason}; a player is {', '.join(POLICIES)} or a script file"
            raise SceneError([Fault(text, None, "", message)])
        return cls(text, read_script(text))

    @classmethod
    def from_recording(cls, session: Recording) -> Self:
        """Return who played a session: what was done is known, and the rules look on."""
        return cls(RECORDED, session.presses)

    def start_game(self, scene: Scene, file: str = "<scene>") -> HeadlessGame | None:
        """Begin the game of a scene; none where it has no game with rules.

        Args:
            scene: as it is run.
            file: what faults call it.

        Raises:
            SceneError: the scene lacks what its game needs, or the game what the script presses.
        """
        rules = fitting_rules(scene, file, on_request=True)
        if rules is None:
            return None
        if self.name == RECORDED:
            return HeadlessGame(rules, None, RECORDED, self.presses)
        if self.name in POLICIES:
            try:
                return HeadlessGame(rules, POLICIES[self.name](scene), self.name)
            except UnsuitableSceneError as error:
                raise SceneError([Fault("--player", None, "", str(error))]) from None
        faults = faults_of(self.presses, rules.controls, self.name)
        if faults:
            raise SceneError(faults)
        return HeadlessGame(rules, ScriptedInput(self.presses), self.name)

    def to_dict(self, scene: Scene) -> dict[str, Any]:
        """Return what of the player decides how a game goes, as JSON values."""
        name = self.name if self.name in (*POLICIES, RECORDED) else "script"
        return {"game": scene.play.game, "player": name, "presses": [list(press) for press in self.presses]}
