"""RULES: every game by the name that `[play] game` calls it by, but billiards, which have a host of their own."""

from collections.abc import Callable
from pathlib import Path

from sandbox.games.curling.rules import Curling
from sandbox.games.landing import Landing
from sandbox.games.pinball.pinball import Pinball
from sandbox.games.rules import Rules, UnfitError
from sandbox.scene.bodies import Bodies
from sandbox.scene.faults import Fault, Lines, SceneError
from sandbox.scene.model import Scene

REAL_TIME = frozenset({"landing", "pinball"})
"""Games in which time matters from the first step: a window starts them at a key press."""


def _artillery(scene: Scene, bodies: Bodies) -> Rules:
    from sandbox.games.artillery.rules import ArtilleryRules  # numpy, and the integrators of an engine

    return ArtilleryRules(scene, bodies)


RULES: dict[str, Callable[[Scene, Bodies], Rules]] = {
    "artillery": _artillery,
    "curling": Curling,
    "landing": Landing,
    "pinball": Pinball,
}
"""Each begins a game. A game is one line here, and its name in `scene.spots.Game`."""


def rules_of(scene: Scene, bodies: Bodies | None = None) -> Rules | None:
    """Begin the game that a scene names; none where it names none that has rules here.

    Args:
        scene: as it is played.
        bodies: its bodies; by default as it starts them.

    Raises:
        UnfitError: the scene lacks what the game needs.
    """
    begin = RULES.get(scene.play.game or "")
    return None if begin is None else begin(scene, scene.bodies if bodies is None else bodies)


def required_rules(scene: Scene) -> Rules:
    """Begin the game that a scene names.

    Raises:
        UnfitError: it names none that has rules here, or lacks what the game needs.
    """
    rules = rules_of(scene)
    if rules is None:
        raise UnfitError(f"the scene {scene.title!r} has no game with rules: state [play] game")
    return rules


def fitting_rules(scene: Scene, file: str) -> Rules | None:
    """Begin the game that the scene of a file names; none where it names none that has rules here.

    Raises:
        SceneError: the scene lacks what the game needs; it names file and line.
    """
    try:
        return rules_of(scene)
    except UnfitError as error:
        try:
            line = Lines(Path(file).read_text(encoding="utf-8")).find(("play", "game"))
        except (OSError, ValueError):  # it was read from elsewhere, or is a session
            line = None
        raise SceneError([Fault(file, line, "play.game", str(error))]) from None
