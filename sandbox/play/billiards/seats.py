"""Seats: who sits at the table that is on, if one is."""

from collections.abc import Callable
from typing import get_args

from sandbox.games.billiards.layout import Layout
from sandbox.games.billiards.rules.happening import GameError
from sandbox.games.names import TableGame
from sandbox.play.billiards.game import Game, Players, plays
from sandbox.play.billiards.gestures import Gestures
from sandbox.play.billiards.person import Person
from sandbox.play.running.live import Live
from sandbox.scene.scene import Scene


def laid(scene: Scene) -> Scene:
    """Return a scene as it is played: of one that names a game the shots are the players'."""
    return Layout.of(scene).scene if scene.play.game in get_args(TableGame) else scene


class Seats:
    """The game that is played, and what a hand does at it; none where what is on is no table."""

    def __init__(self) -> None:
        self.game: Game | None = None
        """who plays"""
        self.gestures: Gestures | None = None
        """what a hand does"""
        self.players: Players | None = None
        """who is asked to play, from the next game on; None leaves it to the game"""
        self.misses = False
        """whether snooker is played with the foul and a miss, from the next game on"""

    @property
    def waits(self) -> bool:
        """Whether time stands still until somebody strikes."""
        return self.game is not None and self.game.waits

    def take(self, live: Live, file: Scene, tell: Callable[[str, str], None]) -> None:
        """Begin a game, where a session is of a table.

        Args:
            live: the session.
            file: its scene, as the file has it.
            tell: told of what cannot be played, with its level.
        """
        if not plays(live.scene):
            return
        # A scene that starts by its own shot has been struck already.
        shot = file.shots[0] if file.shots and not live.scene.shots else None
        try:
            self.game = Game(live, self.players, shot, self.misses)
        except GameError as error:
            tell(str(error), "warning")
        else:
            self.gestures = Gestures(Person(self.game))

    def leave(self) -> None:
        """End the game."""
        if self.game is not None:
            self.game.close()
        self.game = self.gestures = None
