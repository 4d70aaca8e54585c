"""RULES: every game by the name that `[play] game` calls it by, but billiards, which have a host of their own."""

from collections.abc import Callable
from pathlib import Path

from sandbox.games.contract import Rules, UnsuitableSceneError
from sandbox.games.curling.rules import Curling
from sandbox.games.landing.rules import Landing
from sandbox.games.names import GAMES, registered_games
from sandbox.games.pinball.rules import Pinball
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.errors import Fault, Lines, SceneError
from sandbox.scene.scene import Scene

REAL_TIME = frozenset({"landing", "pinball"})
"""Games of this package in which time matters from the first step: a window starts them at a key press."""


def _artillery(scene: Scene, bodies: Bodies) -> Rules:
    from sandbox.games.artillery.rules import ArtilleryRules  # numpy, and the integrators of an engine

    return ArtilleryRules(scene, bodies)


RULES: dict[str, Callable[[Scene, Bodies], Rules]] = {
    "artillery": _artillery,
    "curling": Curling,
    "landing": Landing,
    "pinball": Pinball,
}
"""Each begins a game. A game of this package is one line here, and its name in `games.names.GAMES`."""


def _rules_named(game: str | None) -> Callable[[Scene, Bodies], Rules] | None:
    """Return the rules of a game of this package or another.

    Raises:
        UnfitError: those of another package cannot be imported.
    """
    if game is None or game in RULES or game in GAMES:
        return RULES.get(game or "")
    entry = registered_games().get(game)
    if entry is None:
        return None
    try:
        rules: Callable[[Scene, Bodies], Rules] = entry.load()
    except (ImportError, AttributeError) as error:
        raise UnsuitableSceneError(f"the game {game!r} cannot be imported from {entry.value}: {error}") from error
    return rules


def rules_of(scene: Scene, bodies: Bodies | None = None) -> Rules | None:
    """Begin the game that a scene names; none where it names none that has rules here.

    Args:
        scene: as it is played.
        bodies: its bodies; by default as it starts them.

    Raises:
        UnfitError: the scene lacks what the game needs.
    """
    begin = _rules_named(scene.play.game)
    return None if begin is None else begin(scene, scene.bodies if bodies is None else bodies)


def is_real_time(game: str | None) -> bool:
    """Return whether time matters from the first step of a game; rules of other packages state it as `real_time`.

    Raises:
        UnfitError: the rules are of another package and cannot be imported.
    """
    return game in REAL_TIME or bool(getattr(_rules_named(game), "real_time", False))


def has_rules(scene: Scene) -> bool:
    """Return whether a scene names a game that has rules here."""
    game = scene.play.game
    return game in RULES or (game is not None and game not in GAMES)


def required_rules(scene: Scene) -> Rules:
    """Begin the game that a scene names.

    Raises:
        UnfitError: it names none that has rules here, or lacks what the game needs.
    """
    rules = rules_of(scene)
    if rules is None:
        raise UnsuitableSceneError(f"the scene {scene.title!r} has no game with rules: state [play] game")
    return rules


def fitting_rules(scene: Scene, file: str) -> Rules | None:
    """Begin the game that the scene of a file names; none where it names none that has rules here.

    Raises:
        SceneError: the scene lacks what the game needs; it names file and line.
    """
    try:
        return rules_of(scene)
    except UnsuitableSceneError as error:
        try:
            line = Lines(Path(file).read_text(encoding="utf-8")).find(("play", "game"))
        except (OSError, ValueError):  # it was read from elsewhere, or is a session
            line = None
        raise SceneError([Fault(file, line, "play.game", str(error))]) from None
