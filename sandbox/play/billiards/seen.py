"""Seen: what a game adds to the sight of a moment."""

from dataclasses import replace

from sandbox.play.billiards.game import Game
from sandbox.play.sight import Sight


def at_table(sight: Sight, game: Game) -> Sight:
    """Return a sight with the aim of a game, and with the ball that a hand carries where the hand is."""
    aim = game.aim()
    if aim is None or not aim.carried:
        return replace(sight, aim=aim)
    position = sight.frame.position.copy()
    position[aim.ball] = aim.place
    return replace(sight, aim=aim, frame=replace(sight.frame, position=position))
