"""Sparse scenes: without bodies, with one, or with nothing that can move, and later without those it speaks of."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import (
    ActionError,
    Drive,
    Force,
    Launch,
    Move,
    Pull,
    Remove,
    SetParameter,
    Spawn,
    Switch,
    Throttle,
)
from sandbox.engines.contract import Divergence, Exhaustion, Refusal, Simulation
from sandbox.engines.registry import ENGINES, start
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads
from tests.laws.features import BODIES, FEATURES, JOINTS, document

pytestmark = pytest.mark.slow  # some 45 s together

CHOICES: list[dict[str, Any]] = [
    {},
    {"joints": "relaxation"},
    {"joints": "xpbd"},
    {"joints": "rattle"},
    {"detection": "bisect"},
    {"detection": "swept"},
    {"detection": "shrink"},
    {"broad_phase": "grid"},
    {"broad_phase": "sweep"},
    {"response": "penalty"},
    {"integrator": "rk4"},
    {"half_kick": True},
]

ACTIONS = (
    Pull(time=0.0, body="a", target=(0.0, 3.0)),
    Force(time=0.0, body="a", force=(0.1, 0.0)),
    Throttle(time=0.0, thrust="t", level=0.5),
    Drive(time=0.0, drive="d", level=0.5),
)

LATER = (
    Launch(time=0.0, generator="g", seed=3),
    Throttle(time=0.0, thrust="t", level=1.0),
    Drive(time=0.0, drive="d", level=1.0),
    SetParameter(time=0.0, path="world.gravity", value=[0.0, -1.0]),
    Spawn.model_validate({"time": 0.0, "ball": {"position": (9.0, 3.0), "radius": 0.5}}),
)


def _scene(bodies: str, feature: str) -> Scene | None:
    """Return a scene; None where it has faults, such as a feature of a body that is not there."""
    try:
        return from_document(document(bodies, feature))
    except SceneError:
        return None


def _step(simulation: Simulation) -> bool:
    """Advance, and ask for all that can be known; tell whether it can go on."""
    try:
        simulation.step()
    except (Divergence, Exhaustion):  # such as next to what attracts
        return False
    _read(simulation)
    return True


def _read(simulation: Simulation) -> None:
    """Ask for all that can be known; it is finite."""
    frame = simulation.frame()
    assert np.isfinite(frame.position).all() and np.isfinite(frame.velocity).all()
    simulation.contacts(), simulation.account(), simulation.state_hash()
    assert loads(dumps(simulation.scene)) is not None


def _apply(simulation: Simulation, action: Any) -> bool:
    """Do what an action says; tell whether it can be done."""
    try:
        simulation.apply(action)
    except ActionError:
        return False
    return True


@pytest.mark.parametrize("feature", FEATURES)
def test_each_feature_runs_whatever_moves(feature: str) -> None:
    """A scene that loads is run, or refused."""
    for bodies in BODIES:
        scene = _scene(bodies, feature)
        for engine in ENGINES if scene is not None else ():
            for choice in CHOICES if engine == "reference" else ({},):
                assert scene is not None
                try:
                    simulation = start(scene, engine, scene.solver.replace(**choice))
                except Refusal:
                    continue
                simulation.contacts(), simulation.account()
                if _step(simulation):
                    _step(simulation)


@pytest.mark.parametrize("gone", ["a", "all"])
@pytest.mark.parametrize("feature", FEATURES)
def test_engines_take_over_a_scene_that_speaks_of_bodies_that_are_gone(feature: str, gone: str) -> None:
    """By removal; after it the scene goes on, with launches and other actions, and there and back."""
    for bodies in ("one of two fixed", "two"):
        scene = _scene(bodies, feature)
        for engine in ENGINES if scene is not None else ():
            assert scene is not None
            try:
                first = SwitchableSimulation(scene, engine)
            except Refusal:
                continue
            if not _step(first):
                continue
            for action in ACTIONS:
                _apply(first, action)
            for name in first.bodies.names if gone == "all" else ("a",):
                _apply(first, Remove(time=0.0, body=name))
            if not _step(first):
                continue
            point = first.checkpoint()
            for other in ENGINES:
                relay = SwitchableSimulation.resumed(point)
                if not _apply(relay, Switch(time=0.0, engine=other)) or not _step(relay):
                    continue
                for action in LATER:
                    _apply(relay, action)
                if _step(relay) and _apply(relay, Switch(time=0.0, engine=engine)) and _step(relay):
                    _read(SwitchableSimulation.resumed(relay.checkpoint()))


@pytest.mark.parametrize("feature", ["attraction to a body", "attractions", "thrusts", "emitter", "bounds", "pockets"])
def test_engines_take_over_whoever_left_by_itself(feature: str) -> None:
    """Out of world.bounds, at the end of its life, or into a pocket."""
    found = document("two", feature)
    found["world"].setdefault("bounds", [[-50.0, -50.0], [50.0, 50.0]])
    scene = from_document(found)
    for engine in ENGINES:
        try:
            first = SwitchableSimulation(scene, engine)
        except Refusal:
            continue
        _apply(first, Move(time=0.0, body="a", position=(1e3, 3.0)))
        for _ in range(5):
            first.step()
        for other in ENGINES:
            relay = SwitchableSimulation.resumed(first.checkpoint())
            if _apply(relay, Switch(time=0.0, engine=other)):
                _step(relay)


def test_who_left_attracts_no_more_and_thrusts_keep_their_throttles() -> None:
    """The engines agree on what goes on after a body has left, as does one that did not change."""
    found = document("two", "thrusts")
    found["attraction"] = [{"toward": "a", "strength": 1e3}, {"toward": [0.0, 50.0], "strength": 1.0}]
    found["world"]["gravity"] = [0.0, 0.0]
    scene = from_document(found)
    ends = []
    for engine, other in (
        ("pymunk", "pymunk"),
        ("pymunk", "reference"),
        ("reference", "pymunk"),
        ("reference", "reference"),
    ):
        relay = SwitchableSimulation(scene, engine)
        relay.apply(Throttle(time=0.0, thrust="u", level=0.5))
        relay.apply(Remove(time=0.0, body="a"))
        relay.apply(Switch(time=0.0, engine=other, settings={"dt": 0.001}))
        for _ in range(100):
            relay.step()
        ends.append(relay.frame().velocity[1])
    assert ends[0][0] > 0.0
    np.testing.assert_allclose(ends, [ends[0]] * 4, rtol=1e-2, atol=1e-6)


@pytest.mark.parametrize("kind", JOINTS)
@pytest.mark.parametrize("others", [(), ("fixed",), ("stroke",), ("plunger",)])
def test_joint_between_what_no_joint_can_move_is_refused_by_name(kind: str, others: tuple[str, ...]) -> None:
    found = document("two", f"{kind} between two" if others else f"{kind} to the world")
    drive = {"kind": "stroke", "stops": [0, 1], "rate": 1.0}
    found["drive"] = [{**drive, "body": "a", "pivot": [0.0, 3.0]}]
    if others == ("fixed",):
        found["ball"][1]["fixed"] = True
    elif others == ("stroke",):
        found["drive"].append({**drive, "body": "b", "pivot": [2.0, 3.0]})
    elif others == ("plunger",):
        found["drive"].append({"kind": "plunger", "body": "b", "direction": [0, 1], "travel": 1.0, "speed": 1.0})
    with pytest.raises(SceneError, match="'a'") as raised:
        from_document(found)
    assert [fault.path for fault in raised.value.faults] == ["joint.j.between"]


@pytest.mark.parametrize("kind", JOINTS)
def test_joint_between_a_led_body_and_one_that_moves_holds(kind: str) -> None:
    found = document("two", f"{kind} between two")
    found["drive"] = [{"kind": "stroke", "body": "a", "pivot": [0.0, 3.0], "stops": [0, 1], "rate": 1.0}]
    simulation = start(from_document(found), "pymunk")
    for _ in range(10):
        simulation.step()
    _read(simulation)
