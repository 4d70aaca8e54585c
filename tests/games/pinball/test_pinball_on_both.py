"""Whole tables on two engines without common physics code, and replay of the full table."""

import json
from pathlib import Path

import numpy as np
import pytest

from sandbox.action import actions_from_json
from sandbox.games.contract import Press
from sandbox.games.players import PlayerSpec, ScriptedInput
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import play_out
from sandbox.recording import Recording
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import load

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

TABLES = [
    pytest.param(path, id=path.stem, marks=[] if path.stem == "full" else [pytest.mark.nightly])
    for path in sorted((Path(__file__).parents[3] / "scenes" / "pinball").glob("*.toml"))
]

PLUNGE = (Press(0.2, "plunger", 1.0), Press(1.2, "plunger", 0.0))
"""A full pull and release: the ball runs up the lane, through the gate and along the arch, and down the table."""


@pytest.mark.parametrize("path", TABLES)
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


@pytest.mark.parametrize("path", TABLES)
def test_game_is_played_on_the_reference_engine(path: Path) -> None:
    """The course of the game is chaotic after the first hit of a flipper, so only its validity is tested."""
    played = play_out(load(path, ["world.duration=8.0"]), "skilled", "reference", audit=True)
    run = played.trajectory
    assert (run.status, run.missed_contacts) == ("ok", 0)
    assert played.score > 0
    flippers = [k for k, name in enumerate(run.names) if str(name).endswith("flipper")]
    assert all(np.ptp(run.angle[:, k]) > 0.8 for k in flippers)  # a stroke is 51°


FULL = Path(__file__).parents[3] / "scenes" / "pinball" / "full.toml"


def test_session_of_the_full_table_replays_to_the_same_score_and_state() -> None:
    scene = load(FULL)
    scene = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 12.0})})
    first = run(scene, "pymunk", audit=False, bout=PlayerSpec("skilled").start_game(scene))
    info = first.info
    assert {"drive", "move"} <= {action["kind"] for action in info["actions"]}
    session = Recording(
        scene,
        "pymunk",
        Settings.model_validate(info["settings"]),
        actions_from_json(json.dumps(info["actions"])),
        float(first.time[-1]),
        info["state_hash"],
        presses=tuple(Press(*press) for press in info["game"]["presses"]),
    )
    session = Recording.from_json(session.to_json())
    bout = PlayerSpec.from_recording(session).start_game(session.scene)
    replayed = run(session.whole_scene, "pymunk", actions=session.actions, audit=False, bout=bout)
    assert replayed.info["state_hash"] == info["state_hash"]
    assert replayed.info["game"]["score"] == info["game"]["score"] > 0
    assert replayed.info["game"]["otherwise"] is None
