"""Whole tables on two engines that share no line of their physics: bats, plunger, gate, zones, layers and rubbers."""

from pathlib import Path

import numpy as np
import pytest

from sandbox.games.contract import Press
from sandbox.games.players import ScriptedInput
from sandbox.measure.run.sessions import play_out
from sandbox.scene.files.load import load

pytestmark = pytest.mark.full  # long runs and sweeps

TABLES = sorted((Path(__file__).parents[3] / "scenes" / "pinball").glob("*.toml"))

PLUNGE = (Press(0.2, "plunger", 1.0), Press(1.2, "plunger", 0.0))
"""A full pull, let go: the ball flies up the lane, through the gate and along the arch, and comes down the table."""


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_plunge_is_the_same_on_both_engines(path: Path) -> None:
    """Both have the same scheme, so that they differ by rounding, 1e-16 m, which each bounce off a post makes larger.

    Some ten times a bounce: up to here that leaves 1e-12 m or less. An angle or coefficient that is another one, a hit
    that comes one substep sooner, or a gate that stops the ball makes 1e-6 m at once.
    """
    scene = load(path, ["world.duration=3.0"])
    native, reference = (play_out(scene, ScriptedInput(PLUNGE), engine) for engine in ("pymunk", "reference"))
    one, other = native.trajectory, reference.trajectory
    np.testing.assert_allclose(other.position, one.position, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(other.velocity, one.velocity, rtol=0.0, atol=1e-7)  # m/s, of 1e-9 m in 10 ms
    np.testing.assert_array_equal(other.contact_pair, one.contact_pair)
    np.testing.assert_allclose(other.contact_time, one.contact_time, rtol=0.0, atol=1e-12)
    assert len(one.contact_time) > 50  # which a ball that stayed in the lane would not have
    assert np.ptp(one.position[:, 0, 1]) > 0.9
    assert native.score == reference.score


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_game_is_played_on_the_reference(path: Path) -> None:
    """Nothing is asked of its course, which is another one soon after the first hit of a bat, but that it is a game."""
    played = play_out(load(path, ["world.duration=8.0"]), "skilled", "reference", audit=True)
    run = played.trajectory
    assert (run.status, run.missed_contacts) == ("ok", 0)
    assert played.score > 0
    bats = [k for k, name in enumerate(run.names) if str(name).endswith("flipper")]
    assert all(np.ptp(run.angle[:, k]) > 0.8 for k in bats)  # 51° is a stroke
