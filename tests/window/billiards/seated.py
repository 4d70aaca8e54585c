"""Tables for tests: few balls, so that strokes are short."""

from sandbox.games.billiards.view.controls import BilliardsControls
from sandbox.games.billiards.view.player import Players
from sandbox.scene.files.load import loads
from sandbox.window.app_state import Messages, create_session
from sandbox.window.game_host import controls_of, host_of

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


def controls_at(text: str, players: Players | None = None) -> BilliardsControls:
    """Return the controls of a new frame on the exact engine."""
    scene = loads(text)
    live = create_session(scene, "exact", None, Messages())
    assert live is not None
    host = host_of(live)
    assert host is not None
    controls = controls_of(host, scene, {} if players is None else {"players": players})
    assert isinstance(controls, BilliardsControls)
    return controls


def turn(controls: BilliardsControls, elapsed: float = 1.0 / 60.0) -> None:
    """Let real time pass, s, as the window does."""
    host = controls.player.host
    host.live.update(elapsed, host.waiting)
    controls.update(elapsed)


def roll_out(controls: BilliardsControls, until: float = 60.0) -> None:
    """Let the balls roll until the rules wait."""
    host = controls.player.host
    turn(controls)
    while not host.waiting:
        assert host.live.session.time < until
        if host.live.busy is None and not host.waiting:
            host.live.step()
        turn(controls, 0.0)
