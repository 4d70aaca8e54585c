"""Motors whose rate and largest torque change during a run, on every engine that has motors."""

import math
from typing import Any

import pytest

import sandbox
from sandbox.action import ActionError, SetParameter, Switch
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

ENGINES_WITH_MOTORS = ("pymunk", "reference", "box2d")


def wheel(**motor: Any) -> Scene:
    """Return a scene of a wheel of 2 kg·m² on a pivot to the world, with a motor."""
    body = {"name": "wheel", "position": [0.0, 0.0], "radius": 1.0, "mass": 4.0}
    joints = [
        {"kind": "pivot", "between": ["wheel"], "at": [0.0, 0.0]},
        {"kind": "motor", "name": "engine", "between": ["wheel"], "rate": 1.0, **motor},
    ]
    return from_document({"ball": [body], "joint": joints, "solver": {"dt": 0.01}})


def set_value(path: str, value: Any) -> SetParameter:
    return SetParameter(time=0.0, path=path, value=value)


@pytest.mark.parametrize("engine", ENGINES_WITH_MOTORS)
@pytest.mark.parametrize("path", ["joint.engine.rate", "joint[1].rate"])
def test_wheel_follows_the_rate_of_its_motor(engine: str, path: str) -> None:
    simulation = start(wheel(), engine)
    simulation.step()
    assert simulation.frame().angular_velocity[0] == pytest.approx(1.0, rel=1e-5)  # box2d has 32 bits
    simulation.apply(set_value(path, -3.0))
    simulation.step()
    assert simulation.frame().angular_velocity[0] == pytest.approx(-3.0, rel=1e-5)


@pytest.mark.parametrize("engine", ENGINES_WITH_MOTORS)
def test_largest_torque_accelerates_a_wheel(engine: str) -> None:
    """A torque of 6 N·m accelerates the wheel by 3 rad/s²; without a limit it has its rate at once."""
    simulation = start(wheel(max_torque=0.0, rate=50.0), engine)
    advance(simulation, 10)
    assert simulation.frame().angular_velocity[0] == 0.0
    simulation.apply(set_value("joint.engine.max_torque", 6.0))
    advance(simulation, 100)
    assert simulation.frame().angular_velocity[0] == pytest.approx(3.0, rel=1e-5)
    simulation.apply(set_value("joint.engine.max_torque", None))
    simulation.step()
    assert simulation.frame().angular_velocity[0] == pytest.approx(50.0, rel=1e-5)


@pytest.mark.parametrize("engine", ENGINES_WITH_MOTORS)
def test_changed_motor_is_kept_by_later_changes(engine: str) -> None:
    """Other changes of the scene, and a switch to another engine, keep the rate."""
    simulation = start(wheel(), engine)
    simulation.apply(set_value("joint.engine.rate", 2.0))
    simulation.apply(set_value("world.gravity", [0.0, -1.0]))
    simulation.apply(set_value("joint.engine.max_torque", 1e6))
    simulation.step()
    assert simulation.frame().angular_velocity[0] == pytest.approx(2.0, rel=1e-4)
    session = sandbox.start(wheel(), engine)
    session.apply(set_value("joint.engine.rate", 2.0))
    session.step()
    session.apply(Switch(time=0.0, engine="reference" if engine == "pymunk" else "pymunk"))
    session.step()
    assert session.frame().angular_velocity[0] == pytest.approx(2.0, rel=1e-4)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_work_of_a_motor_that_changes_is_booked(engine: str) -> None:
    """The wheel gains ½ I ω² = ω² J by its motor, before and after the change."""
    simulation = start(wheel(), engine)
    simulation.account()
    simulation.step()
    simulation.apply(set_value("joint.engine.rate", 4.0))
    simulation.step()
    account = {cause.value: value for cause, value in simulation.account().items()}
    assert account["drives"] == pytest.approx(16.0, rel=1e-9)
    assert sum(account.values()) == pytest.approx(16.0, rel=1e-9)


@pytest.mark.parametrize("engine", ENGINES_WITH_MOTORS)
@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("joint.engine.rate", math.inf), ("joint.engine.rate", "fast"), ("joint.engine.max_torque", -1.0),
        ("joint.none.rate", 1.0), ("joint[0].rate", 1.0), ("joint[7].rate", 1.0), ("joint.engine.strength", 1.0),
    ],
)  # fmt: skip
def test_invalid_change_is_refused_and_changes_nothing(engine: str, path: str, value: Any) -> None:
    simulation = start(wheel(), engine)
    with pytest.raises((ActionError, ValueError)):
        simulation.apply(set_value(path, value))
    simulation.step()
    assert simulation.frame().angular_velocity[0] == pytest.approx(1.0, rel=1e-5)


def test_motors_are_the_only_joints_that_can_change() -> None:
    with pytest.raises(ActionError, match="rate, max_torque, max_force of motors"):
        start(wheel(), "pymunk").apply(set_value("joint[0].bias", 0.5))
