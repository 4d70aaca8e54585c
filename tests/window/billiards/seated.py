"""Tables for tests: few balls, so that strokes are short."""

from sandbox.games.billiards.table_geometry import TableGeometry
from sandbox.games.billiards.view.table_game import BilliardsGame, Players
from sandbox.scene.files.load import loads
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.session import Session

RADIUS = 0.028575
"""m, of pool balls"""

FREE = """
title = "Free"
[billiards]
table = "pool-7ft"
[billiards.place]
cue = [0.5, 0.5]
1 = [0.5, 1.0]
2 = [0.2, 1.5]
"""

NINE = """
title = "Nine"
[billiards]
table = "pool-7ft"
game = "9-ball"
[[shot]]
aim = 1.5708
speed = 4.0
side = 0.2
"""


def game_of(text: str, players: Players | None = None) -> BilliardsGame:
    """Sit down at a table."""
    scene = loads(text)
    live = LiveView(Session(TableGeometry.of(scene).scene, "exact"))
    return BilliardsGame(live, players, scene.shots[0] if scene.shots else None)


def turn(game: BilliardsGame, elapsed: float = 1.0 / 60.0) -> None:
    """Let real time pass, s, as the stage does."""
    game.live.update(elapsed, game.waits)
    game.go_on(elapsed)


def roll_out(game: BilliardsGame, until: float = 60.0) -> None:
    """Let the balls roll until the table waits."""
    turn(game)
    while not game.waits:
        assert game.live.session.time < until
        if game.live.busy is None and not game.waits:
            game.live.step()
        turn(game, 0.0)
