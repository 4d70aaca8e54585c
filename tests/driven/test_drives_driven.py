"""Flippers in a real window: held keys activate their drives."""

from pathlib import Path

import pytest

from sandbox.action import Drive
from sandbox.measure.run.sessions import rerun
from sandbox.scene.files.load import load
from tests.driven.driving import OpenWindow

pytestmark = pytest.mark.slow  # a real window in real time

FLIPPER = Path(__file__).parents[2] / "scenes" / "joints" / "flipper.toml"


def test_held_keys_drive_flippers_and_plunger(drive: OpenWindow) -> None:
    window = drive("play", str(FLIPPER))
    for key in ("Left", "Right"):
        window.hold(key)
        window.settled_shot()
        window.release_key(key)
    window.hold("space")
    window.settled_shot()
    held = window.session()
    window.release_key("space")
    session = window.session()
    levels = [(action.drive, action.level) for action in session.actions if isinstance(action, Drive)]
    assert levels == [(name, level) for name in ("left", "right", "plunger") for level in (1.0, 0.0)]
    flippers = load(FLIPPER).drives[:2]
    run = rerun(session)
    assert run.info["state_hash"] == session.state_hash
    for index, flipper in zip((2, 3), flippers, strict=True):  # bodies: the ball, the rod, the flippers
        assert flipper.kind == "torque"
        rest, end = flipper.stops
        reached = run.angle[:, index] - rest
        assert abs(reached).max() == pytest.approx(abs(end - rest), abs=0.1)  # rebound between two samples
    assert held.duration < session.duration
    assert run.position[:, 1, 1].min() < -0.21  # m: drawn back by at least a tenth of its travel, from -0.2
