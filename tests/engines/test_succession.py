"""Energy ledger across engine switches: segments are summed, and actions between them are booked."""

from typing import Any

import pytest

from sandbox.action import Launch, Pull, Switch
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.full  # property tests with many examples


def scene_of(**more: Any) -> Scene:
    ball = {"name": "a", "position": [0, 2], "radius": 0.5, "restitution": 0.5, "velocity": [1, 0]}
    floor = {"point": [0, 0], "normal": [0, 1], "friction": 0.5}
    return from_document(
        {"world": {"gravity": [0, -10]}, "solver": {"dt": 0.01}, "ball": [ball], "plane": [floor], **more}
    )


def advance(simulation: SwitchableSimulation, steps: int) -> SwitchableSimulation:
    for _ in range(steps):
        simulation.step()
    return simulation


def test_ledgers_of_segments_are_summed() -> None:
    simulation = start(scene_of(), "reference")
    initial = total_energy(simulation)
    simulation.account()
    advance(simulation, 60)
    first = simulation.account()
    simulation.apply(Switch(time=0.6, settings={"integrator": "velocity_verlet"}))
    assert simulation.account() == first
    advance(simulation, 60)
    entries = simulation.account()
    assert entries[Cause.RESTITUTION] < first[Cause.RESTITUTION] < 0.0
    assert sum(entries.values()) == pytest.approx(total_energy(simulation) - initial, abs=1e-12)  # rounding of 20 J


def test_pulls_are_booked_as_drives() -> None:
    simulation = start(scene_of(), "reference")
    initial = total_energy(simulation)
    simulation.account()
    simulation.apply(Pull(time=0.0, body="a", target=(1.0, 4.0)))
    advance(simulation, 30)
    entries = simulation.account()
    assert entries[Cause.ACTIONS] == 0.0
    assert entries[Cause.DRIVES] > 1.0
    assert sum(entries.values()) == pytest.approx(total_energy(simulation) - initial, abs=1e-12)  # as above


def test_launch_is_booked_as_an_action() -> None:
    rain = {"name": "rain", "count": 3, "lower": [-1, 3], "upper": [1, 5], "radius": 0.1, "collides": "none"}
    simulation = start(scene_of(scatter=[rain]), "reference")
    initial = total_energy(simulation)
    simulation.account()
    advance(simulation, 20)
    simulation.apply(Launch(time=0.2, generator="rain", seed=7))
    advance(simulation, 20)
    entries = simulation.account()
    assert entries[Cause.ACTIONS] != 0.0  # another seed gives other heights
    assert sum(entries.values()) == pytest.approx(total_energy(simulation) - initial, abs=1e-12)  # as above


def test_no_ledger_is_kept_without_accounting() -> None:
    plain, accounted = (start(scene_of(), "reference") for _ in range(2))
    accounted.account()
    for simulation in (plain, accounted):
        simulation.apply(Pull(time=0.0, body="a", target=(1.0, 4.0)))
        advance(simulation, 10).apply(Switch(time=0.1, settings={"substeps": 2}))
        advance(simulation, 40)
    assert plain.state_hash() == accounted.state_hash()
    assert set(plain.account().values()) == {0.0}
