"""Names of games: those of this package, and those that other packages register.

Another package registers a game by an entry point of the group `sandbox.games`, in its pyproject.toml:

    [project.entry-points."sandbox.games"]
    keepy-uppy = "keepy_uppy:KeepyUppy"

The object is called with a scene and its bodies, and returns rules, as those in `games.registry.RULES` do. Scenes that
name no game of another package do not look for entry points.
"""

import sys
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, get_args

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "sandbox.games"
"""Entry-point group of games."""

TableGame = Literal["8-ball", "9-ball", "three-cushion", "straight-rail", "snooker", "free"]
"""Games of billiards, which need a table."""

GAMES = (*get_args(TableGame), "artillery", "curling", "landing", "pinball")
"""Games of this package; those that need no table are in `games.registry.RULES` too."""


def game_names() -> tuple[str, ...]:
    """Return the names of all games, those of this package first."""
    return (*GAMES, *(name for name in sorted(registered_games()) if name not in GAMES))


def is_game(name: str) -> bool:
    """Return whether there is a game of this name."""
    return name in GAMES or name in registered_games()


def registered_games() -> "dict[str, EntryPoint]":
    """Return the games of other packages by name. They are imported when one is played."""
    return _entry_points(tuple(sys.path))


@lru_cache(maxsize=1)
def _entry_points(path: tuple[str, ...]) -> "dict[str, EntryPoint]":  # noqa: ARG001, where packages are looked for
    from importlib.metadata import entry_points  # 20 ms, which scenes with a game of this package do without

    return {each.name: each for each in reversed(entry_points(group=GROUP))}  # the first of a name counts
