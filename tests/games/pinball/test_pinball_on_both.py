"""Whole tables on two engines without common physics code: flippers, plunger, gates, zones, layers and rubbers."""

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
"""A full pull and release: the ball runs up the lane, through the gate and along the arch, and down the table."""


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_plunge_agrees_on_both_engines(path: Path) -> None:
    """Both engines use the same scheme, so they differ by rounding, 1e-16 m, which each bounce off a post amplifies.

    The factor is about ten per bounce, which gives at most 1e-12 m here. A different angle or coefficient, a hit that
    is one substep earlier, or a gate that stops the ball gives 1e-6 m at once.
    """
    scene = load(path, ["world.duration=3.0"])
    native, reference = (play_out(scene, ScriptedInput(PLUNGE), engine) for engine in ("pymunk", "reference"))
    one, other = native.trajectory, reference.trajectory
    np.testing.assert_allclose(other.position, one.position, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(other.velocity, one.velocity, rtol=0.0, atol=1e-7)  # m/s: 1e-9 m in 10 ms
    np.testing.assert_array_equal(other.contact_pair, one.contact_pair)
    np.testing.assert_allclose(other.contact_time, one.contact_time, rtol=0.0, atol=1e-12)
    assert len(one.contact_time) > 50  # a ball that stays in the lane has fewer
    assert np.ptp(one.position[:, 0, 1]) > 0.9
    assert native.score == reference.score


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_game_is_played_on_the_reference_engine(path: Path) -> None:
    """The course of the game is chaotic after the first hit of a flipper, so only its validity is tested."""
    played = play_out(load(path, ["world.duration=8.0"]), "skilled", "reference", audit=True)
    run = played.trajectory
    assert (run.status, run.missed_contacts) == ("ok", 0)
    assert played.score > 0
    flippers = [k for k, name in enumerate(run.names) if str(name).endswith("flipper")]
    assert all(np.ptp(run.angle[:, k]) > 0.8 for k in flippers)  # a stroke is 51°
