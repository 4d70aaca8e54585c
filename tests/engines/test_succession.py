"""Accounts of scenes that change engine on the way: the legs' are added up, and what is done between them is booked."""

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


def stepped(relay: SwitchableSimulation, steps: int) -> SwitchableSimulation:
    for _ in range(steps):
        relay.step()
    return relay


def test_legs_are_added_up() -> None:
    relay = start(scene_of(), "reference")
    begun = total_energy(relay)
    relay.account()
    stepped(relay, 60)
    first = relay.account()
    relay.apply(Switch(time=0.6, settings={"integrator": "velocity_verlet"}))
    assert relay.account() == first
    stepped(relay, 60)
    entries = relay.account()
    assert entries[Cause.RESTITUTION] < first[Cause.RESTITUTION] < 0.0
    assert sum(entries.values()) == pytest.approx(total_energy(relay) - begun, abs=1e-12)  # of 20 J: rounding


def test_hands_are_drives_and_not_actions() -> None:
    relay = start(scene_of(), "reference")
    begun = total_energy(relay)
    relay.account()
    relay.apply(Pull(time=0.0, body="a", target=(1.0, 4.0)))
    stepped(relay, 30)
    entries = relay.account()
    assert entries[Cause.ACTIONS] == 0.0
    assert entries[Cause.DRIVES] > 1.0
    assert sum(entries.values()) == pytest.approx(total_energy(relay) - begun, abs=1e-12)  # as above


def test_a_launch_is_an_action() -> None:
    rain = {"name": "rain", "count": 3, "lower": [-1, 3], "upper": [1, 5], "radius": 0.1, "collides": "none"}
    relay = start(scene_of(scatter=[rain]), "reference")
    begun = total_energy(relay)
    relay.account()
    stepped(relay, 20)
    relay.apply(Launch(time=0.2, generator="rain", seed=7))
    stepped(relay, 20)
    entries = relay.account()
    assert entries[Cause.ACTIONS] != 0.0  # another seed, other heights
    assert sum(entries.values()) == pytest.approx(total_energy(relay) - begun, abs=1e-12)  # as above


def test_a_relay_that_is_not_asked_keeps_no_account() -> None:
    plain, asked = (start(scene_of(), "reference") for _ in range(2))
    asked.account()
    for relay in (plain, asked):
        relay.apply(Pull(time=0.0, body="a", target=(1.0, 4.0)))
        stepped(relay, 10).apply(Switch(time=0.1, settings={"substeps": 2}))
        stepped(relay, 40)
    assert plain.state_hash() == asked.state_hash()
    assert set(plain.account().values()) == {0.0}
