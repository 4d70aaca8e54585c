"""Recordings: a session as one JSON document, scene and actions, that any engine can replay."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, Self

from pydantic import ValidationError

from sandbox.action import Action, ActionError, Switch, actions_from_json, actions_to_json
from sandbox.scene.document import to_document
from sandbox.scene.faults import Fault, SceneError
from sandbox.scene.file import from_document
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.whole import whole

FORMAT = 1
MAX_DURATION = 1e9  # s, as of a scene


class Press(NamedTuple):
    """A control that was set at a time, before the step that starts then."""

    time: float
    """s"""
    control: str
    value: float
    """0 lets it go"""


@dataclass(frozen=True)
class Recording:
    """What was played: with the same engine and versions it leads to the same state, bit for bit."""

    scene: Scene
    engine: str
    settings: Settings
    actions: tuple[Action, ...]
    duration: float
    """s"""
    state_hash: str | None = None
    """of the state at the end, where it is known"""
    presses: tuple[Press, ...] = ()
    """what was pressed, of a game; what came of it is among the actions"""
    score: float | None = None
    """of a game at the end, where it is known"""
    at: float | None = field(default=None, compare=False)
    """s, the earlier moment that the session had gone back to when it was saved; None at its end"""

    @property
    def whole_scene(self) -> Scene:
        """The scene, with the session's duration."""
        world = self.scene.world.model_copy(update={"duration": self.duration})
        return self.scene.model_copy(update={"world": world})

    def on(self, engine: str) -> Self:
        """Return the session as another engine is to play it, from start to end."""
        actions = tuple(
            action.model_copy(update={"engine": None}) if isinstance(action, Switch) else action
            for action in self.actions
        )
        return replace(self, engine=engine, actions=actions, state_hash=None, score=None)

    def save(self, path: str | Path) -> Path:
        """Write it to a file, to a temporary name first: never half a file."""
        path = Path(path)
        with whole(path) as temporary:
            temporary.write_text(self.to_json(), encoding="utf-8")
        return path

    def to_json(self) -> str:
        """Write it as a JSON document."""
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
        if self.at is not None:
            document["at"] = self.at
        return json.dumps(document, indent=1, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str, file: str = "<recording>") -> Self:
        """Read a recording.

        Raises:
            SceneError: the document, its scene or its actions have faults.
        """
        try:
            document = json.loads(text)
            if not isinstance(document, Mapping) or document.get("format") != FORMAT:
                raise ValueError(_no_session(document))
            duration = _part(document, "duration", (int, float))
            if not 0 <= duration <= MAX_DURATION:
                raise ValueError(f"a `duration` is 0 to {MAX_DURATION:g} s")
            at = _part(document, "at", (int, float, type(None)), None)
            if at is not None and not 0 <= at <= duration:
                raise ValueError("`at` is a time of the session, 0 to its `duration`")
            return cls(
                scene=from_document(_part(document, "scene", dict), file),
                engine=_part(document, "engine", str),
                settings=Settings.model_validate_json(json.dumps(_part(document, "settings", dict))),
                actions=actions_from_json(json.dumps(_part(document, "actions", list))),
                duration=float(duration),
                state_hash=_part(document, "state_hash", (str, type(None))),
                presses=presses_from(_part(document, "presses", list, [])),
                score=_part(document, "score", (int, float, type(None)), None),
                at=None if at is None else float(at),
            )
        except ActionError as error:
            raise SceneError([Fault(file, None, "actions", line) for line in str(error).splitlines()]) from None
        except ValidationError as error:
            faults = [Fault(file, None, ".".join(("settings", *map(str, e["loc"]))), e["msg"]) for e in error.errors()]
            raise SceneError(faults) from None
        except (ValueError, RecursionError) as error:
            raise SceneError([Fault(file, None, "", f"cannot be read as a session: {error}")]) from None

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a recording from a file.

        Raises:
            SceneError: as `from_json`.
        """
        try:
            text = Path(path).read_text(encoding="utf-8")
        except (OSError, ValueError) as error:
            raise SceneError([Fault(str(path), None, "", f"cannot be read: {error}")]) from None
        return cls.from_json(text, str(path))


def _no_session(document: Any) -> str:
    """Say what a JSON document is that is no session."""
    made = {"runs": "run", "engines": "compare", "points": "tradeoff", "cells": "extremes", "$schema": "schema"}
    if isinstance(document, Mapping) and "format" not in document:
        for key, command in made.items():
            if key in document:
                return f"it is the output of `sandbox {command}{'' if command == 'schema' else ' --json'}`"
        return "it has no `format`; the window records sessions (Ctrl+S)"
    if isinstance(document, Mapping):
        return f"its format is {document['format']!r}, and this program reads format {FORMAT}"
    return "it is no JSON object; the window records sessions (Ctrl+S)"


def _part(document: Mapping[str, Any], key: str, kind: type | tuple[type, ...], without: Any = ...) -> Any:
    """Return a part of a document; one that may be missing has a value for where it is."""
    value = document.get(key) if without is ... else document.get(key, without)
    if not isinstance(value, kind) or isinstance(value, bool):
        raise ValueError(f"`{key}` is missing or of the wrong type")
    return value


def presses_from(values: Sequence[Any]) -> tuple[Press, ...]:
    """Read presses from JSON values, each `[time, control, value]`.

    Raises:
        ValueError: one is none.
    """
    return tuple(_press(value) for value in values)


def _press(value: Any) -> Press:
    match value:
        case [float() | int() as time, str() as control, float() | int() as level] if 0 <= time <= MAX_DURATION:
            return Press(float(time), control, level)
    raise ValueError(f"`presses`: {value!r} is no [time, control, value]")
