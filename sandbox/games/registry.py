"""RULES: every game by the name that `[play] game` calls it by, but billiards, which have a host of their own."""

from collections.abc import Callable

from sandbox.games.rules import Rules
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene


def _artillery(scene: Scene, bodies: Bodies) -> Rules:
    from sandbox.games.artillery.rules import ArtilleryRules  # numpy, and the integrators of an engine

    return ArtilleryRules(scene, bodies)


RULES: dict[str, Callable[[Scene, Bodies], Rules]] = {"artillery": _artillery}
"""Each begins a game. A game is one line here, and its name in `scene.spots.Game`."""


def rules_of(scene: Scene, bodies: Bodies | None = None) -> Rules | None:
    """Begin the game that a scene names; none where it names none that has rules here.

    Args:
        scene: as it is played.
        bodies: its bodies; by default as it starts them.
    """
    begin = RULES.get(scene.play.game or "")
    return None if begin is None else begin(scene, scene.bodies if bodies is None else bodies)
