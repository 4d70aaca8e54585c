"""A simulation that returns to a snapshot continues as it did then, bit for bit, also in the midst of contacts."""

import copy

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import Action, Impulse, Move, Remove, SetParameter, Spawn, Switch
from sandbox.engines.contract import SnapshotError
from sandbox.engines.registry import ENGINES, able
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.description.discs import Ball
from tests.engines.stepping import advance, continued
from tests.engines.test_advance import SCENES, small_scene

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

COPYING = ("exact", "reference")
CASES = [(name, engine) for name in SCENES for engine in able(small_scene(name)) if engine in COPYING]


@pytest.mark.parametrize(("name", "engine"), CASES)
@settings(max_examples=5)
@given(before=st.integers(0, 60), after=st.integers(1, 40), with_energy=st.booleans())
def test_restored_simulation_repeats_itself(name: str, engine: str, before: int, after: int, with_energy: bool) -> None:
    simulation = start(small_scene(name), engine)
    simulation.contacts()
    if with_energy:
        simulation.account()
    advance(simulation, before)
    snapshot = simulation.snapshot()
    assert snapshot.time == simulation.time
    first = continued(simulation, after)
    for _ in range(2):
        simulation.restore(snapshot)
        assert simulation.time == snapshot.time
        assert continued(simulation, after) == first
    assert continued(snapshot.resumed(), after) == first
    assert continued(copy.deepcopy(snapshot.resumed()), after) == first


ACTIONS: tuple[Action, ...] = (
    Impulse(time=0.0, body="ball-1", impulse=(0.3, 1.0)),
    Move(time=0.0, body="ball-1", position=(0.4, 1.2)),
    SetParameter(time=0.0, path="world.gravity", value=[0.0, -3.0]),
    Spawn(time=0.0, ball=Ball(name="new", position=(-0.5, 1.5), radius=0.1)),
    Remove(time=0.0, body="ball-1"),
)


@pytest.mark.parametrize("action", ACTIONS, ids=lambda action: type(action).__name__)
@pytest.mark.parametrize("engine", COPYING)
def test_actions_after_a_snapshot_are_undone(engine: str, action: Action) -> None:
    simulation = start(small_scene("one ball"), engine)
    simulation.contacts()
    advance(simulation, 50)
    snapshot, scene = simulation.snapshot(), simulation.scene
    first = continued(simulation, 30)
    simulation.restore(snapshot)
    simulation.apply(action)
    assert continued(simulation, 30) != first
    simulation.restore(snapshot)
    assert simulation.scene is scene
    assert continued(simulation, 30) == first


def test_switch_of_the_engine_is_undone() -> None:
    simulation = start(small_scene("balls that settle"), "exact")
    simulation.contacts()
    advance(simulation, 30)
    snapshot = simulation.snapshot()
    first = continued(simulation, 20)
    for engine in ("reference", "pymunk"):
        simulation.restore(snapshot)
        simulation.apply(Switch(time=0.0, engine=engine))
        advance(simulation, 10)
        assert simulation.engine == engine
        simulation.restore(snapshot)
        assert simulation.engine == "exact"
        assert continued(simulation, 20) == first


def test_observer_stays_after_a_restoration() -> None:
    simulation = start(small_scene("one ball"), "reference")
    times: list[float] = []
    simulation.watch(lambda time, *_: times.append(time))
    snapshot = simulation.snapshot()
    for _ in range(2):
        simulation.restore(snapshot)
        advance(simulation, 3)
    assert times == [0.0, 0.01, 0.02] * 2


def test_pymunk_says_that_it_cannot_be_copied() -> None:
    simulation = start(small_scene("one ball"), "pymunk")
    for attempt in (simulation.snapshot, lambda: copy.deepcopy(simulation)):
        with pytest.raises(SnapshotError, match=r"inside its space.* exact and reference"):
            attempt()
    simulation.step()  # it is not affected


def test_snapshot_of_another_engine_is_refused() -> None:
    exact, reference = (ENGINES[name].start(small_scene("one ball")) for name in COPYING)
    with pytest.raises(ValueError, match="not a snapshot of a ReferenceSimulation"):
        reference.restore(exact.snapshot())


def test_snapshot_does_not_change_with_its_simulation() -> None:
    simulation = start(small_scene("elastic gas"), "reference")
    snapshot = simulation.snapshot()
    before = snapshot.resumed().state_hash()
    advance(simulation, 20)
    assert snapshot.resumed().state_hash() == before
    assert isinstance(snapshot.resumed(), SwitchableSimulation)
