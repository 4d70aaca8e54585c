"""GameSpec: the names of a game in scene files, and where its parts are. This module imports nothing of the package.

Parts are named by import strings, `module:Name`, and imported when they are first used, so that reading a scene
imports neither rules nor pygame. A package of its own registers a game by an entry point of the group `sandbox.games`
whose object is a `GameSpec`, see `sandbox.games.names`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any


@dataclass(frozen=True)
class Environment:
    """Gymnasium environment of a game."""

    name: str
    """in the environment id: `sandbox/<name>-v0`"""
    scene: str
    """name of a shipped scene"""
    frame_skip: int = 1
    """number of steps per action"""


@dataclass(frozen=True)
class GameSpec:
    """A game: its names in a scene file, and the import strings of its parts."""

    names: tuple[str, ...]
    """values of `[play] game`"""
    rules: str | None = None
    """`(scene, bodies) -> Rules`, a class or a function. It may raise `UnsuitableSceneError`"""
    tables: Mapping[str, str] = field(default_factory=dict)
    """tables of scene files: heading → `GameTable` or `Preset`; only for games of this package"""
    bot: str | None = None
    """`(seed) -> Policy`: the player `skilled`"""
    view: str | None = None
    """`() -> GameView`: draws what is special to the game; the only part, besides `controls`, that imports pygame"""
    controls: str | None = None
    """input handling of the window, for games whose input is more than the keys of `Rules.controls`"""
    environments: tuple[Environment, ...] = ()
    """Gymnasium environments; only for games of this package"""
    rules_on_request: bool = False
    """whether a scene also runs without the rules: commands start them only for a named player, or for a recording with
    inputs"""
    real_time: bool = False
    """whether time matters from the first step: the window waits for a key press before it starts the game"""
    presents: str | None = None
    """`(scene) -> bool`: whether `view` draws a scene; default: scenes whose `[play] game` is one of `names`"""
    needs_player: str | None = None
    """`(scene) -> str | None`: the reason why the player `none` would leave a scene unchanged for ever"""


def import_part(path: str) -> Any:
    """Return the object that an import string, `module:Name`, refers to.

    Raises:
        ImportError: there is no such module.
        AttributeError: the module has no such name.
    """
    module, _, name = path.partition(":")
    return getattr(import_module(module), name)
