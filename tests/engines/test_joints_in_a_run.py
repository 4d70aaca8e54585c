"""Joints that actions add and remove while a scene runs."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Join, Remove, SetParameter, Spawn, Switch, Unjoin, actions_from_json
from sandbox.engines.energy_ledger import Cause
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.joints import Pivot, Rod, Spring, Weld
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # kernels compile

G = 10.0
ENGINES = ("pymunk", "box2d", "reference")
every_engine = pytest.mark.parametrize("engine", ENGINES)


def falling(*joints: dict[str, Any], **more: Any) -> Scene:
    """Return a scene of a ball at (1, 0) m, beside a post of the world at the origin."""
    ball = {"name": "a", "position": [1.0, 0.0], "radius": 0.1, "mass": 1.0}
    document = {"world": {"gravity": [0, -G], "duration": 1.0}, "solver": {"dt": 0.001}, "ball": [ball]}
    return from_document({**document, "joint": [*joints], **more})


def advance(simulation: sandbox.Simulation, seconds: float) -> None:
    for _ in range(round(seconds / simulation.settings.dt)):
        simulation.step()


def rod(length: float | None = None) -> Join:
    return Join(time=0.0, joint=Rod(name="hook", between=("a",), length=length))


@every_engine
def test_hook_catches_a_falling_ball_and_lets_it_go(engine: str) -> None:
    """A rod is added in the fall: the ball swings on a circle, and flies on along the tangent after it is removed."""
    simulation = sandbox.start(falling(), engine)
    advance(simulation, 0.2)
    caught = simulation.frame()
    simulation.apply(rod())
    assert simulation.frame().position.tolist() == caught.position.tolist()
    length = float(np.hypot(*caught.position[0]))
    advance(simulation, 0.3)
    swinging = simulation.frame()
    assert np.hypot(*swinging.position[0]) == pytest.approx(length, rel=1e-3)  # error of the joint in a step
    assert swinging.velocity[0, 0] < -0.5
    simulation.apply(Unjoin(time=0.0, joint="hook"))
    assert set(simulation.broken) == {0}
    advance(simulation, 0.2)
    # m/s: free fall from the moment of the release
    assert simulation.frame().velocity[0] == pytest.approx(swinging.velocity[0] + [0.0, -G * 0.2], abs=1e-4)


@every_engine
def test_joint_between_bodies_that_were_added_holds_over_a_switch(engine: str) -> None:
    simulation = sandbox.start(falling(), engine)
    simulation.apply(Spawn(time=0.0, ball=Ball(name="b", position=(2.0, 0.0), radius=0.1, mass=3.0)))
    simulation.apply(Join(time=0.0, joint=Weld(between=("a", "b"))))
    advance(simulation, 0.2)
    simulation.apply(Switch(time=0.0, engine="reference" if engine == "pymunk" else "pymunk"))
    advance(simulation, 0.2)
    frame = simulation.frame()
    assert frame.position[1] - frame.position[0] == pytest.approx([1.0, 0.0], abs=1e-3)
    simulation.apply(Remove(time=0.0, body="b"))
    advance(simulation, 0.1)
    assert simulation.frame().present.tolist() == [True, False]


def test_links_of_a_rope_can_be_cut_and_tied_again() -> None:
    rope = {"name": "line", "start": [0.0, 0.0], "end": [0.0, -1.0], "links": 5}
    simulation = sandbox.start(falling(rope=[rope]), "reference")
    names = simulation.setup.joints.names
    simulation.apply(Unjoin(time=0.0, joint=names[2]))
    advance(simulation, 0.1)
    with pytest.raises(ActionError, match="no joint is named"):
        simulation.apply(Unjoin(time=0.0, joint=names[2]))
    again = Pivot(name=names[2], between=("a",), at=(1.0, 0.0))  # the name is free again
    simulation.apply(Join(time=0.0, joint=again))
    advance(simulation, 0.1)
    assert simulation.setup.joints.names.count(names[2]) == 2


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_energy_of_a_spring_that_is_added_comes_from_the_action(engine: str) -> None:
    simulation = sandbox.start(falling(), engine)
    simulation.account()
    advance(simulation, 0.1)
    stretch = float(np.hypot(*simulation.frame().position[0])) - 0.5
    spring = Spring(name="s", between=("a",), rest_length=0.5, stiffness=20.0)
    before = dict(simulation.account())
    simulation.apply(Join(time=0.0, joint=spring))
    gained = simulation.account()[Cause.ACTIONS] - before.get(Cause.ACTIONS, 0.0)
    assert gained == pytest.approx(0.5 * 20.0 * stretch**2, rel=1e-9)
    simulation.apply(Unjoin(time=0.0, joint="s"))
    assert simulation.account()[Cause.ACTIONS] == pytest.approx(before.get(Cause.ACTIONS, 0.0), abs=1e-9)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_run_with_joint_actions_is_repeated_by_its_recording(engine: str) -> None:
    """Actions survive JSON, and a run with them equals the same steps by hand, bit for bit."""
    text = '[{"kind": "join", "time": 0.2, "joint": {"kind": "rod", "name": "hook", "between": ["a"]}},'
    text += ' {"kind": "unjoin", "time": 0.5, "joint": "hook"}]'
    actions = actions_from_json(text)
    run = sandbox.run(falling(), engine, actions=actions)
    by_hand = sandbox.start(falling(), engine)
    for action, seconds in zip((*actions, None), (0.2, 0.3, 0.5), strict=True):
        advance(by_hand, seconds)
        if action is not None:
            by_hand.apply(action)
    assert run.info["state_hash"] == by_hand.state_hash()
    assert run.info["broken"] == 1
    assert math.isfinite(run.info["energy_end"])


@pytest.mark.parametrize(
    ("action", "reason"),
    [
        (Join(time=0.0, joint=Rod(between=("q",))), "no body is named 'q'"),
        (Join(time=0.0, joint=Rod(between=("a",), anchors=((0.0, 0.0), (1.0, 0.0)))), "no direction"),
        (Join(time=0.0, joint=Rod(name="j", between=("a",))), "already named 'j'"),
        (Unjoin(time=0.0, joint="q"), "no joint is named 'q'; known names: 'j'"),
        (SetParameter(time=0.0, path="joint.q.rate", value=1.0), "q"),
    ],
    ids=str,
)
def test_invalid_change_of_joints_is_refused_and_changes_nothing(action: Any, reason: str) -> None:
    scene = falling({"name": "j", "kind": "rod", "between": ["a"]})
    simulation, other = sandbox.start(scene), sandbox.start(scene)
    with pytest.raises(ActionError, match=reason):
        simulation.apply(action)
    advance(simulation, 0.1)
    advance(other, 0.1)
    assert simulation.state_hash() == other.state_hash()


def test_engine_that_lacks_a_joint_refuses_it_by_name() -> None:
    simulation = sandbox.start(falling(), "exact")
    with pytest.raises(ActionError, match="exact refuses: it does not model rods"):
        simulation.apply(rod())
    advance(simulation, 0.1)


def test_removed_body_cannot_be_joined() -> None:
    simulation = sandbox.start(falling())
    simulation.apply(Remove(time=0.0, body="a"))
    with pytest.raises(ActionError, match="no body is named 'a'"):
        simulation.apply(rod())


@every_engine
def test_motor_set_after_one_change_of_joints_keeps_its_rate_after_another(engine: str) -> None:
    """Each change begins a new segment, from the joints with the values that they have."""
    scene = from_document(
        {
            "world": {"gravity": [0.0, 0.0]},
            "solver": {"dt": 0.01},
            "ball": [{"name": "wheel", "position": [0, 0], "radius": 0.5}, {"position": [5, 0], "radius": 0.5}],
            "joint": [
                {"kind": "pivot", "between": ["wheel"], "at": [0, 0]},
                {"name": "motor", "kind": "motor", "between": ["wheel"], "rate": 1.0},
                {"name": "link", "kind": "rod", "between": ["wheel", "ball-2"]},
            ],
        }
    )
    simulation = sandbox.start(scene, engine)
    simulation.apply(Switch(time=0.0, settings={"dt": 0.005}))
    simulation.apply(SetParameter(time=0.0, path="joint.motor.rate", value=3.0))
    simulation.apply(Unjoin(time=0.0, joint="link"))
    advance(simulation, 0.1)
    assert simulation.frame().angular_velocity[0] == pytest.approx(3.0, abs=1e-3)  # soft joints of box2d
