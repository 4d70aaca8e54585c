"""Artillery in a real window: aimed and fired by real keys; ground is dug away, and the session keeps it all."""

from pathlib import Path

import pytest

from sandbox.action import Reshape
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from tests.driven.driving import Play, Shot
from tests.driven.looking import at, laid_out, on_screen
from tests.driven.rooms import written

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
"""Level ground 20 m high, and a first gun at 60° and 60 %: its shell flies some 20 m, and hits nobody."""


def is_dirt(shot: Shot, place: tuple[float, float]) -> bool:
    """Tell brown from blue."""
    red, _, blue = at(shot, place)
    return red > blue + 10


def controls(session: Recording) -> set[str]:
    return {press.control for press in session.presses}


def test_keys_aim_and_fire_and_the_ground_is_dug_away(drive: Play, tmp_path: Path) -> None:
    path = written(tmp_path, FIELD)
    window, camera = drive("play", str(path)), laid_out(path).camera
    for key, control in (("Right", "right"), ("Up", "up")):
        window.hold(key)
        window.wait_for(lambda control=control: control in controls(window.session()), f"{key} held")
        window.let_go(key)
        window.wait_for(lambda: window.session().presses[-1].value == 0.0, f"{key} let go of")
    window.key("space")
    fired = window.wait_for(lambda: found if "fire" in controls(found := window.session()) else None, "the shot")
    assert {"right", "up"} <= controls(fired)
    hit = window.wait_for(lambda: crater(window.session()), "a crater")
    middle, radius = hit
    deep = on_screen(camera, (middle, 20.0 - 0.6 * radius))
    beside = on_screen(camera, (middle + 1.5 * radius, 20.0 - 0.6 * radius))
    window.wait_until(lambda shot: not is_dirt(shot, deep) and is_dirt(shot, beside), "the hole, and ground beside it")

    window.key("p")
    session = window.session()
    again = rerun(session)
    assert again.info["state_hash"] == session.state_hash
    assert again.info["game"]["score"] == session.score
    assert again.info["game"]["otherwise"] is None


def crater(session: Recording) -> tuple[float, float] | None:
    """Return where ground is missing along it, and half how far, m; None where all is as it was."""
    courses = [action.points for action in session.actions if isinstance(action, Reshape)]
    if not courses:
        return None
    low = [x for x, y in courses[-1] if y < 20.0 - 1e-3]
    return 0.5 * (low[0] + low[-1]), 0.5 * (low[-1] - low[0])
