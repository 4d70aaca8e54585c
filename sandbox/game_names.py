"""Games by name: the specs of the games of this package, and of games that other packages register.

Another package registers a game by an entry point of the group `sandbox.games`, in its pyproject.toml:

    [project.entry-points."sandbox.games"]
    keepy-uppy = "keepy_uppy:GAME"

The object is a `GameSpec`, or rules: a class or function that is called with a scene and its bodies. It is imported
when the game is first used. Entry points are read only if a scene names a game that is not in this package.
"""

import sys
from functools import cache, lru_cache
from typing import TYPE_CHECKING

from sandbox.game_spec import GameSpec, import_part

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GAME_SPECS = {
    "billiards": "sandbox.games.billiards:GAME",
    "pinball": "sandbox.games.pinball:GAME",
    "artillery": "sandbox.games.artillery:GAME",
    "curling": "sandbox.games.curling:GAME",
    "landing": "sandbox.games.landing:GAME",
}
"""Import strings of the `GameSpec` of each game of this package. A new game is a package and a line here."""

GROUP = "sandbox.games"
"""Entry-point group of games."""

_ADDED: dict[str, GameSpec] = {}
"""Games added by `register_game`, by name."""


@cache
def game_specs() -> tuple[GameSpec, ...]:
    """Return the specs of the games of this package."""
    specs = tuple(import_part(path) for path in GAME_SPECS.values())
    assert all(isinstance(spec, GameSpec) for spec in specs)
    return specs


GAMES = tuple(name for spec in game_specs() for name in spec.names)
"""Names of the games of this package."""


def game_tables() -> dict[str, str]:
    """Return the import strings of the tables that games add to scene files, by heading."""
    return {heading: path for spec in game_specs() for heading, path in spec.tables.items()}


def games_with_rules() -> tuple[str, ...]:
    """Return the names of the games of this package whose rules always start with the scene."""
    return tuple(name for spec in game_specs() if spec.starts_rules(on_request=False) for name in spec.names)


def games_with_bot() -> tuple[str, ...]:
    """Return the names of the games of this package that have a bot, the player `skilled`."""
    return tuple(name for spec in game_specs() if spec.bot is not None for name in spec.names)


def game_names() -> tuple[str, ...]:
    """Return the names of all games, those of this package first."""
    return (*GAMES, *(name for name in sorted({**registered_games(), **_ADDED}) if name not in GAMES))


def is_game(name: str) -> bool:
    """Return whether a game of this name exists."""
    return name in GAMES or name in _ADDED or name in registered_games()


def spec_of(game: str | None) -> GameSpec | None:
    """Return the spec of a game; None if there is no such game.

    If another package registers rules without a spec, the spec has only the rules.

    Raises:
        ImportError: the game is of another package, whose module cannot be imported.
        AttributeError: the game is of another package, whose module lacks the object.
        ValueError: the game is of another package, and its spec adds scene tables.
    """
    if game is None:
        return None
    if game in GAMES:
        return next(spec for spec in game_specs() if game in spec.names)
    if game in _ADDED:
        return _ADDED[game]
    entry = registered_games().get(game)
    if entry is None:
        return None
    found = entry.load()
    if isinstance(found, GameSpec):
        _check_added(found)
        return found
    return GameSpec(names=(game,), rules=entry.value, real_time=bool(getattr(found, "real_time", False)))


def register_game(spec: GameSpec) -> None:
    """Register a game in the running program, without an entry point; it replaces an earlier one of the same name.

    Raises:
        ValueError: this package has a game of that name, or the spec adds scene tables.
    """
    _check_added(spec)
    taken = [name for name in spec.names if name in GAMES]
    if taken:
        raise ValueError(f"the sandbox has a game {taken[0]!r}")
    _ADDED.update(dict.fromkeys(spec.names, spec))


def _check_added(spec: GameSpec) -> None:
    """Refuse scene tables of a game of another package: the keys of a scene are fixed when scenes are first imported.

    Raises:
        ValueError: the spec has tables.
    """
    if spec.tables:
        headings = ", ".join(f"[{heading}]" for heading in spec.tables)
        raise ValueError(
            f"it adds {headings} to scene files, which only games of this package can; remove `tables` from its "
            "GameSpec, and describe the scene by bodies, zones and [[play.part]]"
        )


def registered_games() -> "dict[str, EntryPoint]":
    """Return the entry points of the games of other packages, by name, without importing them."""
    return _entry_points(tuple(sys.path))


@lru_cache(maxsize=1)
def _entry_points(path: tuple[str, ...]) -> "dict[str, EntryPoint]":  # noqa: ARG001, cache key
    from importlib.metadata import entry_points  # takes 20 ms, needed only for games of other packages

    return {each.name: each for each in reversed(entry_points(group=GROUP))}  # of equal names, the first
