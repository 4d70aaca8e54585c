"""Rules of games by name, and the start of a game for a scene."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sandbox.game_names import GAMES, game_specs, registered_games, spec_of
from sandbox.game_spec import GameSpec, import_part
from sandbox.games.contract import Rules, UnsuitableSceneError, VectorRules
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, Lines, SceneError


@dataclass(frozen=True)
class RulesFactory:
    """Starts a game; imports its rules when it is called."""

    path: str
    """import string"""

    def __call__(self, scene: Scene, bodies: Bodies) -> Rules:
        """Return the rules of a new game.

        Raises:
            UnsuitableSceneError: the scene lacks an element that the game needs.
        """
        rules: Rules = import_part(self.path)(scene, bodies)
        return rules


RULES: dict[str, Callable[[Scene, Bodies], Rules]] = {
    name: RulesFactory(spec.rules)
    for spec in game_specs()
    if spec.rules is not None and not spec.rules_on_request
    for name in spec.names
}
"""Games of this package whose rules always start with the scene, by name."""


def find_spec(game: str | None) -> GameSpec | None:
    """Return the spec of a game of this package or another; None if there is no such game.

    Raises:
        UnsuitableSceneError: a game of another package cannot be imported.
    """
    try:
        return spec_of(game)
    except (ImportError, AttributeError, ValueError) as error:
        source = registered_games()[game or ""].value
        raise UnsuitableSceneError(f"the game {game!r} cannot be imported from {source}: {error}") from error


def _find_rules(game: str | None, on_request: bool) -> Callable[[Scene, Bodies], Rules] | None:
    """Return the factory of the rules of a game; None if it has no rules.

    Raises:
        UnsuitableSceneError: a game of another package cannot be imported.
    """
    if game is None or game in RULES:
        return RULES.get(game or "")
    spec = find_spec(game)
    if spec is None or spec.rules is None or (spec.rules_on_request and not on_request):
        return None
    return RulesFactory(spec.rules)


def rules_of(scene: Scene, bodies: Bodies | None = None, *, on_request: bool = False) -> Rules | None:
    """Start the game that a scene names; return None if it names no game with rules.

    Args:
        scene: expanded scene.
        bodies: its bodies; default: those of the scene.
        on_request: also start rules that start only on request, `GameSpec.rules_on_request`.

    Raises:
        UnsuitableSceneError: the scene lacks an element that the game needs.
    """
    start = _find_rules(scene.play.game, on_request)
    return None if start is None else start(scene, scene.bodies if bodies is None else bodies)


def spec_in_window(scene: Scene) -> GameSpec | None:
    """Return the spec of the game that the window plays on a scene; None if it plays none.

    Raises:
        UnsuitableSceneError: a game of another package cannot be imported.
    """
    if scene.play.game is not None:
        return find_spec(scene.play.game)
    return next((spec for spec in game_specs() if spec.plays is not None and import_part(spec.plays)(scene)), None)


def rules_in_window(scene: Scene) -> Rules | None:
    """Start the game that the window plays on a scene; None if it plays none, or one without rules.

    Raises:
        UnsuitableSceneError: the scene lacks an element that the game needs.
    """
    if scene.play.game is not None:
        return rules_of(scene, on_request=True)
    spec = spec_in_window(scene)
    return None if spec is None or spec.rules is None else RulesFactory(spec.rules)(scene, scene.bodies)


def scene_in_window(scene: Scene) -> Scene:
    """Return a scene as the window plays it.

    Raises:
        UnsuitableSceneError: a game of another package cannot be imported.
    """
    spec = find_spec(scene.play.game)
    if spec is None or spec.prepare is None:
        return scene
    prepared: Scene = import_part(spec.prepare)(scene)
    return prepared


def is_real_time(game: str | None) -> bool:
    """Return whether a game runs in real time from the first step, so that the window starts it by a key press.

    Raises:
        UnsuitableSceneError: the game is of another package and cannot be imported.
    """
    spec = find_spec(game)
    return spec is not None and spec.real_time


def has_rules(scene: Scene, *, on_request: bool = False) -> bool:
    """Return whether a scene names a game with rules; with `on_request` also one whose rules start only on request.

    Games of other packages have rules.
    """
    game = scene.play.game
    if game is None or game in RULES:
        return game is not None
    return game not in GAMES or (on_request and _find_rules(game, on_request) is not None)


def required_rules(scene: Scene) -> Rules:
    """Start the game that a scene names.

    Raises:
        UnsuitableSceneError: the scene names no game with rules, or lacks an element that the game needs.
    """
    rules = rules_of(scene, on_request=True)
    if rules is None:
        raise UnsuitableSceneError(f"the scene {scene.title!r} has no game with rules: state [play] game")
    return rules


def vector_rules_of(scene: Scene, count: int) -> VectorRules | None:
    """Return the rules of many games of a scene at once; None if its game has none, or the scene names no game.

    Raises:
        UnsuitableSceneError: the scene lacks an element that the game needs.
    """
    spec = find_spec(scene.play.game)
    if spec is None or spec.vector_rules is None:
        return None
    rules: VectorRules = import_part(spec.vector_rules)(scene, scene.bodies, count)
    return rules


def fitting_rules(scene: Scene, file: str, *, on_request: bool = False) -> Rules | None:
    """Start the game that the scene of a file names; return None if it names no game with rules. As `rules_of`.

    Raises:
        SceneError: the scene lacks an element that the game needs; the error has the file and line.
    """
    try:
        return rules_of(scene, on_request=on_request)
    except UnsuitableSceneError as error:
        try:
            line = Lines(Path(file).read_text(encoding="utf-8")).find(("play", "game"))
        except (OSError, ValueError):  # the scene is not from a readable file, or is part of a session
            line = None
        raise SceneError([Fault(file, line, "play.game", str(error))]) from None
