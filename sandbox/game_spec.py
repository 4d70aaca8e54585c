"""Specification of a game: its names in scene files, and the import strings of its parts.

Parts are named by import strings, `module:Name`, and imported when they are first used, so that reading a scene
imports neither rules nor pygame. This module imports nothing of the package. Other packages register a game by an entry
point of the group `sandbox.games` whose object is a `GameSpec`, see `sandbox.game_names`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any


@dataclass(frozen=True)
class Environment:
    """Gymnasium environment of a game."""

    name: str
    """in the environment id"""
    scene: str
    """name of a shipped scene"""
    frame_skip: int = 1
    """number of steps per action"""
    engine: str = "pymunk"
    """name of the engine"""
    duration: float | None = None
    """longest simulated time of an episode, s; None for the duration of the scene"""
    version: int = 1
    """increases when observations, rewards or episodes of the environment change"""

    @property
    def id(self) -> str:
        """Id of the environment for `gymnasium.make`."""
        return f"sandbox/{self.name}-v{self.version}"


@dataclass(frozen=True)
class WindowGame:
    """How the window plays a game, beyond its rules and view: by import strings, and without them as other games."""

    controls: str | None = None
    """`(host, scene, options) -> GameControls`: input for games with other input than the keys of `Rules.controls`;
    `scene` is as in its file, `options` has the chosen values of `GameControls.parameters`"""
    plays: str | None = None
    """`(scene) -> bool`: whether the window plays the game on a scene that names no game"""
    prepare: str | None = None
    """`(scene) -> scene`: the scene as the window plays it, for scenes that name the game"""
    rules_on_request: bool = False
    """whether scenes also run without the rules: the window always starts them, commands only if a player is given or
    for a recording of a game"""


@dataclass(frozen=True)
class GameSpec:
    """A game: its names in a scene file, and the import strings of its parts."""

    names: tuple[str, ...]
    """values of `[play] game`"""
    rules: str | None = None
    """`(scene, bodies) -> Rules`, a class or a function; it may raise `UnsuitableSceneError`"""
    vector_rules: str | None = None
    """`(scene, bodies, count) -> VectorRules`: rules of many games at once, for compiled vector environments"""
    tables: Mapping[str, str] = field(default_factory=dict)
    """tables of scene files: heading → `GameTable` or `Preset`; only for games of this package, others are refused"""
    bot: str | None = None
    """`(seed) -> Policy`: the player `skilled`"""
    view: str | None = None
    """`() -> GameView`: draws the game-specific elements; only this part and `WindowGame.controls` import pygame"""
    environments: tuple[Environment, ...] = ()
    """Gymnasium environments; only for games of this package"""
    window: WindowGame | None = None
    """how the window plays the game, if it does more than start the rules and draw the view"""
    real_time: bool = False
    """whether the game runs in real time from the first step: the window waits for a key press to start it"""
    hint: str = ""
    """the most important keys in one line, announced when a scene is opened; default: the first keys of the rules"""
    presents: str | None = None
    """`(scene) -> bool`: whether `view` draws a scene; default: scenes whose `[play] game` is one of `names`"""
    needs_player: str | None = None
    """`(scene) -> str | None`: the reason why the game does not proceed without input, with the player `none`; None if
    it does"""

    def starts_rules(self, on_request: bool) -> bool:
        """Return whether commands start the rules: always, or only on request."""
        return self.rules is not None and (on_request or self.window is None or not self.window.rules_on_request)


def import_part(path: str) -> Any:
    """Return the object that an import string, `module:Name`, refers to.

    Raises:
        ImportError: there is no such module.
        AttributeError: the module has no such name.
    """
    module, _, name = path.partition(":")
    return getattr(import_module(module), name)
