"""A shorter run is bit for bit the prefix of a longer one, and a session replays to its own state."""

from pathlib import Path

import pytest

from sandbox.action import Impulse, Spawn
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find, shipped
from sandbox.window.playback.session import Session

pytestmark = pytest.mark.full  # long runs and sweeps

LONG = 1000.0
"""s; far longer than the duration of any scene"""

STEPS = 40
"""enough for scenes whose bodies are in contact from the start; scenes with a fall first have more"""

FALLING_FIRST = {"benchmark/pile": 120, "joints/ragdoll_stairs": 240}

MANY_EVENTS = {("benchmark/pile", "exact")}
"""scene and engine of runs that take seconds and end in `Exhaustion`"""

CASES = [
    pytest.param(scene.name, engine, marks=pytest.mark.slow if (scene.name, engine) in MANY_EVENTS else ())
    for scene in shipped()
    for engine in ENGINES
]


def with_duration(scene: Scene, duration: float) -> Scene:
    return scene.model_copy(update={"world": scene.world.model_copy(update={"duration": duration})})


def states(scene: Scene, engine: str, steps: int) -> list[str]:
    """Return the hash of each state, followed by the name of the exception if the run ended early."""
    relay, found = start(scene, engine), []
    relay.contacts()  # as a run and a session do
    for _ in range(steps):
        try:
            relay.step()
        except (Divergence, Exhaustion) as end:
            return [*found, type(end).__name__]
        found.append(relay.state_hash())
    return found


@pytest.mark.parametrize(("name", "engine"), CASES)
def test_states_do_not_depend_on_the_duration_of_the_scene(name, engine):
    scene = load(find(name))
    steps = FALLING_FIRST.get(name, STEPS)
    try:
        short = states(with_duration(scene, steps * scene.solver.dt), engine, steps)
    except Refusal:
        return  # a refused scene has no states
    assert states(with_duration(scene, LONG), engine, steps) == short


FLAT = """
[world]
duration = 1.0
[solver]
dt = 0.01
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
"""
"""A floor without bodies."""


def replayed(session: Session, path: Path) -> str:
    """Save a session, load it, rerun it, and return the hash of its final state."""
    recording = session.recording()
    assert recording.state_hash == session.frame.state_hash()
    result = rerun(Recording.load(recording.save(path)))
    assert result.info["status"] == "ok"
    return str(result.info["state_hash"])


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_session_of_spawned_balls_and_boxes_replays_to_its_own_state(engine, tmp_path):
    session = Session(loads(FLAT), engine)
    for k in range(6):
        x = 0.77 * k - 2.0
        single = Ball(position=(x, 1.0), radius=0.2) if k % 2 else Box(position=(x, 1.0), size=(0.5, 0.3))
        session.apply(Spawn(time=0.0, **{single.__class__.__name__.lower(): single}))
        session.advance(16)
    session.advance(2500)
    assert session.time > 25.0
    assert replayed(session, tmp_path / "session.json") == session.frame.state_hash()


@pytest.mark.parametrize("name", ["benchmark/incline", "benchmark/pyramid", "joints/ragdoll_stairs"])
def test_session_longer_than_its_scene_replays_to_its_own_state(name, tmp_path):
    scene = with_duration(load(find(name)), 0.1)
    # a coarse step, so that 40 s have few steps
    session = Session(scene, settings=scene.solver.replace(dt=0.05, substeps=1))
    session.advance(800)
    assert session.time > 39.0
    assert replayed(session, tmp_path / "session.json") == session.frame.state_hash()


DISTANT = """
[world]
duration = 1.0
[solver]
dt = 0.01
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
name = "rolls"
position = [0.0, 0.5]
velocity = [2000.0, 0.0]
radius = 0.5
[[ball]]
name = "rests"
position = [0.0, 0.5]
radius = 0.5
collides = "fixed"
"""
"""A ball that moves away from the origin by 20 m a step, and one that stays there."""


def height(relay: SwitchableSimulation, name: str) -> float:
    return float(relay.frame().position[relay.bodies.names.index(name), 1])


def test_plane_extends_under_a_body_that_moves_far_away():
    relay = start(loads(DISTANT))
    for _ in range(3000):
        relay.step()
    assert relay.frame().position[0, 0] > 50e3  # ten times the initial extent of the planes
    # Twice the slop of 1 % of a radius; without a plane it would be 4 km deep.
    assert height(relay, "rolls") == pytest.approx(0.5, abs=0.01)
    assert height(relay, "rests") == pytest.approx(0.5, abs=0.01)


def test_body_can_be_spawned_beyond_the_initial_extent_of_planes():
    relay = start(loads(DISTANT))
    relay.step()
    relay.apply(Spawn(time=0.0, ball=Ball(name="far", position=(4e6, 0.5), radius=0.5)))
    for _ in range(200):
        relay.step()
    assert height(relay, "far") == pytest.approx(0.5, abs=0.01)


def test_body_beyond_the_range_of_half_planes_ends_the_run():
    relay = start(loads(DISTANT))
    relay.step()
    relay.apply(Impulse(time=0.0, body="rolls", impulse=(1e9, 0.0)))
    with pytest.raises(Divergence, match="half-planes"):
        for _ in range(100):
            relay.step()
