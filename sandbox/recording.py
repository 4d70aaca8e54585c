"""Recordings: a session as one JSON document, with scene and actions, that any engine can replay."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, Self

from pydantic import TypeAdapter, ValidationError

from sandbox.action import Action, ActionError, Switch, actions_from_json, actions_to_json
from sandbox.atomic_write import atomic_write
from sandbox.echo import short_repr
from sandbox.game_inputs import GameInputs, inputs_from_json, inputs_to_json
from sandbox.jsonable import to_json
from sandbox.resource_limits import SESSION_SIZE, read_limited
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.document import check_text, to_document
from sandbox.scene.files.load import from_session

FORMAT = 1
MAX_DURATION = 1e9  # s, as of a scene


class Press(NamedTuple):
    """One change of a control of a game, before the step that starts at its time."""

    time: float
    """s"""
    control: str
    """name of the control"""
    value: float
    """new value of the control; 0 releases it"""


@dataclass(frozen=True)
class ReplayCheck:
    """Comparison of the replay of a recorded game with the game."""

    is_equal: bool
    """whether all bodies have the states of the game after each step, bit for bit"""
    step: int | None = None
    """first step, from 1, after which a body has departed from the game by more than rounding; None if none has, or if
    the step of the game varies, so that only the end can be compared"""
    departed: str | None = None
    """the body that has departed then"""
    largest: float | None = None
    """m, largest distance of any body from the game after any step; None if only the end can be compared"""
    body: str | None = None
    """body that is farthest from the game at the end, or is missing"""
    distance: float | None = None
    """m, of that body from the game at the end; None if it is missing, or the replay did not reach the end"""
    reason: str | None = None
    """why the replay did not reach the end; None if it did"""


@dataclass(frozen=True)
class RecordedGame:
    """Program whose space was recorded: what the recording lacks, and how the program ended."""

    omitted: tuple[str, ...] = ()
    """what scene and actions cannot state, and a replay therefore lacks"""
    inexact: tuple[str, ...] = ()
    """reasons for which a replay may differ by rounding"""
    end: Mapping[str, tuple[float | None, ...]] = field(default_factory=dict)
    """states of the bodies at the end of the game: x, y, m; velocity, m/s; angle, rad; angular velocity, rad/s; None
    where pymunk has computed no finite number"""
    state_hash: str | None = None
    """hash of that state, as of a replay that equals the game; None if it was not computed"""
    replay: ReplayCheck | None = None
    """comparison of the replay with the game; None if there was none"""


@dataclass(frozen=True)
class Recording:
    """Recorded session: a scene and the actions applied to it.

    A replay with the same engine and package versions ends in the same state, bit for bit.
    """

    scene: Scene
    """scene at the start of the session"""
    engine: str
    """name of the engine at the start"""
    settings: Settings
    """settings at the start"""
    actions: tuple[Action, ...]
    """all actions, in order of time"""
    duration: float
    """s, simulated time of the session"""
    state_hash: str | None = None
    """hash of the state at the end; None if unknown"""
    presses: tuple[Press, ...] = ()
    """changes of the controls of a game; the actions that resulted are in `actions`"""
    score: float | None = None
    """score of a game at the end; None if unknown"""
    game: RecordedGame | None = None
    """the program, if the session is that of a game outside the sandbox"""
    inputs: GameInputs | None = field(default=None, repr=False)
    """inputs of the program, with which it can run again; None if they are unknown"""
    at: float | None = field(default=None, compare=False)
    """s, time to which the session had been rewound when it was saved; None if it was saved at its end"""

    @property
    def has_game(self) -> bool:
        """Whether the rules of a game ran in the session."""
        return bool(self.presses) or self.score is not None

    @property
    def whole_scene(self) -> Scene:
        """The scene with the duration of the session."""
        return self.scene.with_duration(self.duration)

    def on(self, engine: str) -> Self:
        """Return the session with another engine from start to end.

        `state_hash` and `score` of the result are None, because they depend on the engine; so is the check of a game's
        replay.

        Args:
            engine: name of the engine.
        """
        actions = tuple(
            action.model_copy(update={"engine": None}) if isinstance(action, Switch) else action
            for action in self.actions
        )
        game = None if self.game is None else replace(self.game, replay=None)
        return replace(self, engine=engine, actions=actions, state_hash=None, score=None, game=game)

    def save(self, path: str | Path) -> Path:
        """Write the recording to a JSON file.

        The file is written under a temporary name and then renamed, so an interrupted save leaves no partial file.

        Args:
            path: path of the file.

        Returns:
            The path of the file.
        """
        path = Path(path)
        with atomic_write(path) as temporary:
            temporary.write_text(self.to_json(), encoding="utf-8")
        return path

    def to_json(self) -> str:
        """Return the recording as a JSON document."""
        document = {
            "format": FORMAT,
            "scene": to_document(self.scene),
            "engine": self.engine,
            "settings": self.settings.model_dump(mode="json"),
            "actions": actions_to_json(self.actions),
            "duration": self.duration,
            "state_hash": self.state_hash,
        }
        if self.presses or self.score is not None:
            document |= {"presses": [list(press) for press in self.presses], "score": self.score}
        if self.game is not None:
            document["game"] = to_json(self.game)
        if self.inputs is not None:
            document["inputs"] = inputs_to_json(self.inputs)
        if self.at is not None:
            document["at"] = self.at
        return json.dumps(document, indent=1, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str, file: str = "<recording>") -> Self:
        """Read a recording from a JSON document.

        Args:
            text: the document.
            file: name of the document in faults.

        Raises:
            SceneError: the document, its scene or its actions have faults.
        """
        try:
            check_text(text)
            document = json.loads(text)
            if not isinstance(document, Mapping) or document.get("format") != FORMAT:
                raise ValueError(_not_a_session(document))
            duration = _part(document, "duration", (int, float))
            if not 0 <= duration <= MAX_DURATION:
                raise ValueError(f"`duration` must be 0 to {MAX_DURATION:g} s")
            at = _part(document, "at", (int, float, type(None)), None)
            if at is not None and not 0 <= at <= duration:
                raise ValueError("`at` must be between 0 and the `duration` of the session")
            return cls(
                scene=from_session(_part(document, "scene", dict), file),
                engine=_part(document, "engine", str),
                settings=Settings.model_validate_json(json.dumps(_part(document, "settings", dict))),
                actions=actions_from_json(json.dumps(_part(document, "actions", list))),
                duration=float(duration),
                state_hash=_part(document, "state_hash", (str, type(None))),
                presses=presses_from(_part(document, "presses", list, [])),
                score=_part(document, "score", (int, float, type(None)), None),
                game=_game_from(_part(document, "game", (dict, type(None)), None)),
                inputs=_inputs_from(_part(document, "inputs", (dict, type(None)), None)),
                at=None if at is None else float(at),
            )
        except ActionError as error:
            raise SceneError([Fault(file, None, "actions", line) for line in str(error).splitlines()]) from None
        except ValidationError as error:
            faults = [Fault(file, None, ".".join(("settings", *map(str, e["loc"]))), e["msg"]) for e in error.errors()]
            raise SceneError(faults) from None
        except ValueError as error:
            raise SceneError([Fault.of(file, f"cannot be read as a session: {error}")]) from None

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a recording from a file.

        Args:
            path: path of the file.

        Raises:
            SceneError: the file cannot be read or is too large, or the document, its scene or its actions have faults.
        """
        file = Path(path)
        try:
            refusal = SESSION_SIZE.refusal("its size is", file.stat().st_size)  # 0 for a pipe
            if refusal is not None:
                raise SceneError([Fault.of(str(path), refusal)])
            text = read_limited(file, SESSION_SIZE.value).decode("utf-8")
        except (OSError, ValueError) as error:
            reason = (error.strerror if isinstance(error, OSError) else None) or error
            raise SceneError([Fault.of(str(path), f"cannot be read: {reason}")]) from None
        return cls.from_json(text, str(path))


def _not_a_session(document: Any) -> str:
    """Return the reason why a JSON document is not a session."""
    if isinstance(document, Mapping) and "inputs" in document and "scene" not in document:
        return "it has the inputs of a game only, whose space cannot be a scene; `sandbox advise GAME.py` takes them"
    made = {"runs": "run", "engines": "compare", "points": "tradeoff", "cells": "extremes", "$schema": "schema"}
    if isinstance(document, Mapping) and "format" not in document:
        for key, command in made.items():
            if key in document:
                return f"it is the output of `sandbox {command}{'' if command == 'schema' else ' --json'}`"
        return "it has no `format`; the window saves sessions with Ctrl+S"
    if isinstance(document, Mapping):
        return f"its format is {short_repr(document['format'])}, this program reads format {FORMAT}"
    return "it is not a JSON object; the window saves sessions with Ctrl+S"


def _part(document: Mapping[str, Any], key: str, kind: type | tuple[type, ...], default: Any = ...) -> Any:
    """Return a value of a document, or a default for a missing key that is not required.

    Raises:
        ValueError: the key is required and missing, or the value has another type.
    """
    value = document.get(key) if default is ... else document.get(key, default)
    if not isinstance(value, kind) or isinstance(value, bool):
        raise ValueError(f"`{key}` is missing or of the wrong type")
    return value


_GAME: TypeAdapter[RecordedGame] = TypeAdapter(RecordedGame)


def _game_from(value: Mapping[str, Any] | None) -> RecordedGame | None:
    """Read the program of a recording from JSON values.

    Raises:
        ValueError: a value has another type.
    """
    if value is None:
        return None
    try:
        return _GAME.validate_json(json.dumps(value), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        raise ValueError(f"`game`: {'.'.join(map(str, first['loc']))}: {first['msg']}") from None


def _inputs_from(value: Mapping[str, Any] | None) -> GameInputs | None:
    return None if value is None else inputs_from_json(value)


def presses_from(values: Sequence[Any]) -> tuple[Press, ...]:
    """Read presses from JSON values, each `[time, control, value]`.

    Raises:
        ValueError: a value is not a press.
    """
    return tuple(_press(value) for value in values)


def _press(value: Any) -> Press:
    match value:
        case [float() | int() as time, str() as control, float() | int() as level] if 0 <= time <= MAX_DURATION:
            return Press(float(time), control, level)
    raise ValueError(f"`presses`: {short_repr(value)} is not [time, control, value]")
