"""Artillery in a real window: keys aim and fire, terrain is removed, and the session records all of it."""

from pathlib import Path

import pytest

from sandbox.action import Reshape
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from tests.driven.driving import OpenWindow, Shot
from tests.driven.looking import colour_at, on_screen, window_layout
from tests.driven.rooms import write_scene

pytestmark = pytest.mark.slow  # a real window in real time

FIELD = f"""
title = "Field"
[world]
gravity = [0.0, -9.81]
duration = 60.0
[solver]
dt = 0.02
[terrain]
width = 100.0
heights = {[20.0] * 100}
colour = "#7a5c3e"
[artillery]
speed = 25.0
[[artillery.player]]
name = "Red"
position = 20.0
[[artillery.player]]
name = "Blue"
position = 90.0
"""
"""Level ground 20 m high, and a first gun at 60° and 60 %: its shell flies some 20 m and hits no gun."""


def is_dirt(shot: Shot, point: tuple[float, float]) -> bool:
    """Return whether a pixel is brown terrain, not blue sky."""
    red, _, blue = colour_at(shot, point)
    return red > blue + 10


def controls(session: Recording) -> set[str]:
    return {press.control for press in session.presses}


def test_keys_aim_and_fire_and_the_shell_digs_a_crater(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, FIELD)
    window, camera = drive("play", str(path)), window_layout(path).camera
    for key, control in (("Right", "right"), ("Up", "up")):
        window.hold(key)
        window.wait_for(lambda control=control: control in controls(window.session()), f"{key} held")
        window.release_key(key)
        window.wait_for(lambda: window.session().presses[-1].value == 0.0, f"{key} released")
    window.key("space")
    fired = window.wait_for(lambda: found if "fire" in controls(found := window.session()) else None, "the shot")
    assert {"right", "up"} <= controls(fired)
    dug = window.wait_for(lambda: crater(window.session()), "a crater")
    centre, radius = dug
    inside = on_screen(camera, (centre, 20.0 - 0.6 * radius))
    beside = on_screen(camera, (centre + 1.5 * radius, 20.0 - 0.6 * radius))
    window.wait_until(
        lambda shot: not is_dirt(shot, inside) and is_dirt(shot, beside), "the hole, and ground beside it"
    )

    window.key("p")
    session = window.session()
    replay = rerun(session)
    assert replay.info["state_hash"] == session.state_hash
    assert replay.info["game"]["score"] == session.score
    assert replay.info["game"]["otherwise"] is None


def crater(session: Recording) -> tuple[float, float] | None:
    """Return the centre and the half-width of the crater along the ground, m; None if there is none."""
    outlines = [action.points for action in session.actions if isinstance(action, Reshape)]
    if not outlines:
        return None
    low = [x for x, y in outlines[-1] if y < 20.0 - 1e-3]
    return 0.5 * (low[0] + low[-1]), 0.5 * (low[-1] - low[0])
