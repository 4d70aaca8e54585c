"""Sessions longer than their scene replay to their own state, and planes extend as far as bodies go."""

from pathlib import Path
from typing import Any

import pytest

from sandbox.action import Impulse, Spawn
from sandbox.engines.contract import Divergence
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.playback.session import Session
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def with_duration(scene: Scene, duration: float) -> Scene:
    return scene.model_copy(update={"world": scene.world.model_copy(update={"duration": duration})})


FLOOR: dict[str, Any] = {
    "world": {"duration": 1.0}, "solver": {"dt": 0.01}, "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0]}],
}  # fmt: skip
"""A floor without bodies."""


def replayed(session: Session, path: Path) -> str:
    """Save a session, load it, rerun it, and return the hash of its final state."""
    recording = session.recording()
    assert recording.state_hash == session.frame.state_hash()
    result = rerun(Recording.load(recording.save(path)))
    assert result.info["status"] == "ok"
    return str(result.info["state_hash"])


@pytest.mark.parametrize("name", ["benchmark/incline", "benchmark/pyramid", "joints/ragdoll_stairs"])
def test_session_longer_than_its_scene_replays_to_its_own_state(name, tmp_path):
    scene = with_duration(load(find(name)), 0.1)
    # a coarse step, so that 40 s have few steps
    session = Session(scene, settings=scene.solver.replace(dt=0.05, substeps=1))
    session.advance(800)
    assert session.time > 39.0
    assert replayed(session, tmp_path / "session.json") == session.frame.state_hash()


ROLLS = {"name": "rolls", "position": [0.0, 0.5], "velocity": [2000.0, 0.0], "radius": 0.5}
RESTS = {"name": "rests", "position": [0.0, 0.5], "radius": 0.5, "collides": "fixed"}
DISTANT = {**FLOOR, "ball": [ROLLS, RESTS]}
"""A ball that moves away from the origin by 20 m a step, and one that stays there."""


def height(relay: SwitchableSimulation, name: str) -> float:
    return float(relay.frame().position[relay.bodies.names.index(name), 1])


def test_plane_extends_under_a_body_that_moves_far_away():
    relay = start(from_document(DISTANT))
    advance(relay, 3000)
    assert relay.frame().position[0, 0] > 50e3  # ten times the initial extent of the planes
    # Twice the slop of 1 % of a radius; without a plane it would be 4 km deep.
    assert height(relay, "rolls") == pytest.approx(0.5, abs=0.01)
    assert height(relay, "rests") == pytest.approx(0.5, abs=0.01)


def test_body_can_be_spawned_beyond_the_initial_extent_of_planes():
    relay = start(from_document(DISTANT))
    relay.step()
    relay.apply(Spawn(time=0.0, ball=Ball(name="far", position=(4e6, 0.5), radius=0.5)))
    advance(relay, 200)
    assert height(relay, "far") == pytest.approx(0.5, abs=0.01)


def test_body_beyond_the_range_of_half_planes_ends_the_run():
    relay = start(from_document(DISTANT))
    relay.step()
    relay.apply(Impulse(time=0.0, body="rolls", impulse=(1e9, 0.0)))
    with pytest.raises(Divergence, match="half-planes"):
        advance(relay, 100)
