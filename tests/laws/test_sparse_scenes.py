"""Sparse scenes: no bodies, one body, only static bodies, or removed bodies that other elements refer to."""

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
from sandbox.engines.registry import ENGINES, able, start
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads
from tests.laws.features import BODIES, FEATURES, JOINTS, document

pytestmark = pytest.mark.slow  # about 45 s together

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
    """Return a scene; None if it has faults, such as a reference to a missing body."""
    try:
        return from_document(document(bodies, feature))
    except SceneError:
        return None


def _step(simulation: Simulation) -> bool:
    """Advance by a step and read everything; return whether the simulation can continue."""
    try:
        simulation.step()
    except (Divergence, Exhaustion):  # e.g. close to an attracting body
        return False
    _read(simulation)
    return True


def _read(simulation: Simulation) -> None:
    """Read everything, and check that the state is finite."""
    frame = simulation.frame()
    assert np.isfinite(frame.position).all() and np.isfinite(frame.velocity).all()
    simulation.contacts(), _account(simulation), simulation.state_hash()
    assert loads(dumps(simulation.scene)) is not None


def _account(simulation: Simulation) -> None:
    """Switch energy accounting on, or read it; an engine without impulses refuses it by name."""
    try:
        simulation.account()
    except Refusal as refusal:
        assert refusal.engine == "box2d"
        assert "impulses" in str(refusal)


def _apply(simulation: Simulation, action: Any) -> bool:
    """Apply an action; return whether it was accepted."""
    try:
        simulation.apply(action)
    except ActionError:
        return False
    return True


@pytest.mark.parametrize("feature", FEATURES)
def test_each_feature_runs_with_any_set_of_bodies(feature: str) -> None:
    """Every scene that loads runs or is refused."""
    for bodies in BODIES:
        scene = _scene(bodies, feature)
        for engine in ENGINES if scene is not None else ():
            for choice in CHOICES if engine == "reference" else ({},):
                assert scene is not None
                try:
                    simulation = start(scene, engine, scene.solver.replace(**choice))
                except Refusal:
                    continue
                simulation.contacts(), _account(simulation)
                if _step(simulation):
                    _step(simulation)


@pytest.mark.parametrize("removed", ["a", "all"])
@pytest.mark.parametrize("feature", FEATURES)
def test_engine_switch_keeps_elements_that_refer_to_removed_bodies(feature: str, removed: str) -> None:
    """After the removal the scene continues, with launches and other actions, and through a switch back."""
    for bodies in ("one of two fixed", "two"):
        scene = _scene(bodies, feature)
        for engine in ENGINES if scene is not None else ():
            assert scene is not None
            try:
                original = SwitchableSimulation(scene, engine)
            except Refusal:
                continue
            if not _step(original):
                continue
            for action in ACTIONS:
                _apply(original, action)
            for name in original.bodies.names if removed == "all" else ("a",):
                _apply(original, Remove(time=0.0, body=name))
            if not _step(original):
                continue
            point = original.checkpoint()
            for other in ENGINES:
                switched = SwitchableSimulation.resumed(point)
                if not _apply(switched, Switch(time=0.0, engine=other)) or not _step(switched):
                    continue
                for action in LATER:
                    _apply(switched, action)
                if _step(switched) and _apply(switched, Switch(time=0.0, engine=engine)) and _step(switched):
                    _read(SwitchableSimulation.resumed(switched.checkpoint()))


@pytest.mark.parametrize("feature", ["attraction to a body", "attractions", "thrusts", "emitter", "bounds", "pockets"])
def test_engine_switch_keeps_bodies_that_were_removed(feature: str) -> None:
    """Removed outside of world.bounds, at the end of its lifetime, or in a pocket."""
    whole = document("two", feature)
    whole["world"].setdefault("bounds", [[-50.0, -50.0], [50.0, 50.0]])
    scene = from_document(whole)
    for engine in ENGINES:
        try:
            original = SwitchableSimulation(scene, engine)
        except Refusal:
            continue
        _apply(original, Move(time=0.0, body="a", position=(1e3, 3.0)))
        for _ in range(5):
            original.step()
        removed = ~original.frame().present
        for other in ENGINES:
            switched = SwitchableSimulation.resumed(original.checkpoint())
            if _apply(switched, Switch(time=0.0, engine=other)):
                _step(switched)
                assert not switched.frame().present[removed].any()


def test_removed_body_attracts_no_more_and_thrusts_keep_their_throttles() -> None:
    """The engines agree after a body is removed, with and without a switch."""
    whole = document("two", "thrusts")
    whole["attraction"] = [{"toward": "a", "strength": 1e3}, {"toward": [0.0, 50.0], "strength": 1.0}]
    whole["world"]["gravity"] = [0.0, 0.0]
    scene = from_document(whole)
    velocities = []
    for engine, other in (
        ("pymunk", "pymunk"),
        ("pymunk", "reference"),
        ("reference", "pymunk"),
        ("reference", "reference"),
    ):
        switched = SwitchableSimulation(scene, engine)
        switched.apply(Throttle(time=0.0, thrust="u", level=0.5))
        switched.apply(Remove(time=0.0, body="a"))
        switched.apply(Switch(time=0.0, engine=other, settings={"dt": 0.001}))
        for _ in range(100):
            switched.step()
        velocities.append(switched.frame().velocity[1])
    assert velocities[0][0] > 0.0
    np.testing.assert_allclose(velocities, [velocities[0]] * 4, rtol=1e-2, atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "others"),
    [
        (kind, others)
        for kind in JOINTS
        for others in ((), ("fixed",), ("stroke",), ("plunger",))
        if others or f"{kind} to the world" in FEATURES  # a pulley joins two bodies
    ],
)
def test_joint_between_immovable_bodies_is_refused_by_name(kind: str, others: tuple[str, ...]) -> None:
    whole = document("two", f"{kind} between two" if others else f"{kind} to the world")
    drive = {"kind": "stroke", "stops": [0, 1], "rate": 1.0}
    whole["drive"] = [{**drive, "body": "a", "pivot": [0.0, 3.0]}]
    if others == ("fixed",):
        whole["ball"][1]["fixed"] = True
    elif others == ("stroke",):
        whole["drive"].append({**drive, "body": "b", "pivot": [2.0, 3.0]})
    elif others == ("plunger",):
        whole["drive"].append({"kind": "plunger", "body": "b", "direction": [0, 1], "travel": 1.0, "speed": 1.0})
    with pytest.raises(SceneError, match="'a'") as raised:
        from_document(whole)
    assert [fault.path for fault in raised.value.faults] == ["joint.j.between"]


@pytest.mark.parametrize("kind", JOINTS)
def test_joint_between_a_driven_and_a_free_body_holds(kind: str) -> None:
    whole = document("two", f"{kind} between two")
    whole["drive"] = [{"kind": "stroke", "body": "a", "pivot": [0.0, 3.0], "stops": [0, 1], "rate": 1.0}]
    scene = from_document(whole)
    engines = able(scene)
    assert engines or kind == "pulley"  # a pulley is on `reference` only, which refuses joints to driven bodies
    for engine in engines:
        simulation = start(scene, engine)
        for _ in range(10):
            simulation.step()
        _read(simulation)
