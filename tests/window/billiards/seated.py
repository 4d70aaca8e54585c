"""Billiards tables with few balls, so that strokes are short, and helpers that play on them."""

from sandbox.games.billiards.view.controls import BilliardsControls
from sandbox.games.billiards.view.player import Players
from sandbox.scene.files.load import loads
from sandbox.window.app_state import Messages, create_session
from sandbox.window.game_host import controls_of, host_of
from tests.toml_text import toml

RADIUS = 0.028575
"""Radius of pool balls, m."""

FREE = """
title = "Free"
[billiards]
table = "pool-7ft"
[billiards.place]
cue = [0.5, 0.5]
1 = [0.5, 1.0]
2 = [0.2, 1.5]
"""

NINE = (
    toml(title="Nine")
    + toml("billiards", table="pool-7ft", game="9-ball")
    + toml("shot", aim=1.5708, speed=4.0, side=0.2)
)


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


def advance(controls: BilliardsControls, elapsed: float = 1.0 / 60.0) -> None:
    """Advance by a real time, s, as the window does."""
    host = controls.player.host
    host.live.update(elapsed, host.waiting)
    controls.update(elapsed)


def roll_out(controls: BilliardsControls, limit: float = 60.0) -> None:
    """Step until the rules wait for input."""
    host = controls.player.host
    advance(controls)
    while not host.waiting:
        assert host.live.session.time < limit
        if host.live.busy is None and not host.waiting:
            host.live.step()
        advance(controls, 0.0)
