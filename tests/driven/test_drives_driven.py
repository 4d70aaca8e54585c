"""Flippers in a real window: real keys drive them for as long as they are held."""

from pathlib import Path

import pytest

from sandbox.action import Drive
from sandbox.measure.run.sessions import rerun
from sandbox.scene.files.load import load
from tests.driven.driving import Play

pytestmark = pytest.mark.slow  # a real window in real time

FLIPPER = Path(__file__).parents[2] / "scenes" / "joints" / "flipper.toml"


def test_keys_that_are_held_drive_bats_and_plunger(drive: Play) -> None:
    window = drive("play", str(FLIPPER))
    for key in ("Left", "Right"):
        window.hold(key)
        window.settled()
        window.let_go(key)
    window.hold("space")
    window.settled()
    held = window.session()
    window.let_go("space")
    session = window.session()
    told = [(action.drive, action.level) for action in session.actions if isinstance(action, Drive)]
    assert told == [(name, level) for name in ("left", "right", "plunger") for level in (1.0, 0.0)]
    bats = load(FLIPPER).drives[:2]
    run = rerun(session)
    assert run.info["state_hash"] == session.state_hash
    for number, bat in zip((2, 3), bats, strict=True):  # of bodies: the ball, the rod, the bats
        assert bat.kind == "torque"
        rest, end = bat.stops
        reached = run.angle[:, number] - rest
        assert abs(reached).max() == pytest.approx(abs(end - rest), abs=0.1)  # thrown back, it may be seen before
    assert held.duration < session.duration
    assert run.position[:, 1, 1].min() < -0.21  # m: drawn back by a tenth of its way at least, from -0.2
