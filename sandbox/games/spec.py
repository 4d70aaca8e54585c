"""Specification of a game: its names in scene files, and the import strings of its parts.

Parts are named by import strings, `module:Name`, and imported when they are first used, so that reading a scene
imports neither rules nor pygame. This module imports nothing of the package. Other packages register a game by an entry
point of the group `sandbox.games` whose object is a `GameSpec`, see `sandbox.games.names`.
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
    """`(scene, bodies) -> Rules`, a class or a function; it may raise `UnsuitableSceneError`"""
    tables: Mapping[str, str] = field(default_factory=dict)
    """tables of scene files: heading → `GameTable` or `Preset`; only for games of this package"""
    bot: str | None = None
    """`(seed) -> Policy`: the player `skilled`"""
    view: str | None = None
    """`() -> GameView`: draws the game-specific elements; only this part and `controls` import pygame"""
    controls: str | None = None
    """input handling of the window, for games with other input than the keys of `Rules.controls`"""
    environments: tuple[Environment, ...] = ()
    """Gymnasium environments; only for games of this package"""
    rules_on_request: bool = False
    """whether scenes also run without the rules: commands start them only if a player is given, or for a recording with
    inputs"""
    real_time: bool = False
    """whether the game runs in real time from the first step: the window waits for a key press to start it"""
    presents: str | None = None
    """`(scene) -> bool`: whether `view` draws a scene; default: scenes whose `[play] game` is one of `names`"""
    needs_player: str | None = None
    """`(scene) -> str | None`: the reason why the game does not proceed without input, with the player `none`; None if
    it does"""


def import_part(path: str) -> Any:
    """Return the object that an import string, `module:Name`, refers to.

    Raises:
        ImportError: there is no such module.
        AttributeError: the module has no such name.
    """
    module, _, name = path.partition(":")
    return getattr(import_module(module), name)
