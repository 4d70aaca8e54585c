"""Start of the game of a scene."""

from pathlib import Path

from sandbox.game_names import GAMES, game_specs, registered_games, spec_of
from sandbox.game_spec import GameSpec, import_part
from sandbox.games.contract import Rules, UnsuitableSceneError
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, Lines, SceneError


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


def _start(spec: GameSpec | None, scene: Scene) -> Rules | None:
    """Start a game; return None if it has no rules.

    Raises:
        UnsuitableSceneError: the scene lacks an element that the game needs.
    """
    if spec is None or spec.rules is None:
        return None
    rules: Rules = import_part(spec.rules)(scene, scene.bodies)
    return rules


def rules_of(scene: Scene, file: str | None = None, *, on_request: bool = False) -> Rules | None:
    """Start the game that a scene names; return None if it names no game with rules.

    Args:
        scene: expanded scene.
        file: file of the scene, for errors.
        on_request: also start rules that start only on request, `WindowGame.rules_on_request`.

    Raises:
        UnsuitableSceneError: the scene lacks an element that the game needs, and no file is given.
        SceneError: it lacks one, and a file is given; the error has the file and line.
    """
    try:
        spec = find_spec(scene.play.game)
        return _start(spec, scene) if spec is not None and spec.starts_rules(on_request) else None
    except UnsuitableSceneError as error:
        if file is None:
            raise
        try:
            line = Lines(Path(file).read_text(encoding="utf-8")).find(("play", "game"))
        except (OSError, ValueError):  # the scene is not from a readable file, or is part of a session
            line = None
        raise SceneError([Fault(file, line, "play.game", str(error))]) from None


def required_rules(scene: Scene) -> Rules:
    """Start the game that a scene names.

    Raises:
        UnsuitableSceneError: the scene names no game with rules, or lacks an element that the game needs.
    """
    rules = rules_of(scene, on_request=True)
    if rules is None:
        raise UnsuitableSceneError(f"the scene {scene.title!r} has no game with rules: state [play] game")
    return rules


def has_rules(scene: Scene, *, on_request: bool = False) -> bool:
    """Return whether a scene names a game with rules; with `on_request` also one whose rules start only on request.

    Games of other packages have rules.
    """
    game = scene.play.game
    spec = spec_of(game) if game in GAMES else None
    return game is not None if spec is None else spec.starts_rules(on_request)


def spec_in_window(scene: Scene) -> GameSpec | None:
    """Return the spec of the game that the window plays on a scene; None if it plays none.

    Raises:
        UnsuitableSceneError: a game of another package cannot be imported.
    """
    if scene.play.game is not None:
        return find_spec(scene.play.game)
    for spec in game_specs():
        if spec.window is not None and spec.window.plays is not None and import_part(spec.window.plays)(scene):
            return spec
    return None


def rules_in_window(scene: Scene) -> Rules | None:
    """Start the game that the window plays on a scene; None if it plays none, or one without rules.

    Raises:
        UnsuitableSceneError: the scene lacks an element that the game needs.
    """
    return _start(spec_in_window(scene), scene)


def scene_in_window(scene: Scene) -> Scene:
    """Return a scene as the window plays it.

    Raises:
        UnsuitableSceneError: a game of another package cannot be imported.
    """
    spec = find_spec(scene.play.game)
    if spec is None or spec.window is None or spec.window.prepare is None:
        return scene
    prepared: Scene = import_part(spec.window.prepare)(scene)
    return prepared


def is_real_time(game: str | None) -> bool:
    """Return whether a game runs in real time from the first step, so that the window starts it by a key press.

    Raises:
        UnsuitableSceneError: the game is of another package and cannot be imported.
    """
    spec = find_spec(game)
    return spec is not None and spec.real_time
