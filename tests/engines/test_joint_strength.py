"""Joints that break: at their strength, permanently, and without effect on the released bodies."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import Force, Impulse, Launch, Remove, SetParameter, Switch
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs

ENGINES = ("pymunk", "reference")
G = 10.0

every_engine = pytest.mark.parametrize("engine", ENGINES)


def scene_of(*joints: dict[str, Any], gravity: float = -G, substeps: int = 1, **document: Any) -> Scene:
    world = {"gravity": [0, gravity], "duration": 3.0}
    return from_document({"world": world, "solver": {"dt": 0.01, "substeps": substeps}, "joint": [*joints], **document})


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.1, "mass": 1.0, **more}


def joint(kind: str, *between: str, **more: Any) -> dict[str, Any]:
    return {"kind": kind, "between": list(between), **more}


def chain(*strengths: float | None, collides: str = "none") -> Scene:
    """Return balls of 1 kg on rods of 1 m that hang from the origin; the first rod carries the largest load."""
    balls = [ball(f"b{k}", 0, -1 - k, collides=collides) for k in range(len(strengths))]
    pairs = [[each["name"] for each in balls[max(k - 1, 0) : k + 1]] for k in range(len(strengths))]
    rods = [
        joint("rod", *pair, **({} if strength is None else {"strength": strength}))
        for pair, strength in zip(pairs, strengths, strict=True)
    ]
    return scene_of(*rods, ball=balls)


def breaking_force(simulation: SwitchableSimulation, body: str, rise: float, steps: int = 400) -> float:
    """Pull a body down by a force that grows with each step until a joint breaks; return that force, N."""
    for k in range(steps):
        simulation.apply(Force(time=0.0, body=body, force=(0.0, -rise * k)))
        simulation.step()
        if simulation.broken:
            return rise * k
    raise AssertionError("no joint broke")


@every_engine
@pytest.mark.parametrize(
    "table",
    [{"kind": "rod"}, {"kind": "pivot", "at": [0, 0]}, {"kind": "spring", "stiffness": 2e3, "damping": 20.0}],
    ids=lambda table: str(table["kind"]),
)
def test_joint_breaks_under_the_load_of_its_strength(engine: str, table: dict[str, Any]) -> None:
    simulation = start(scene_of({**table, "between": ["w"], "strength": 20.0}, ball=[ball("w", 0, -1)]), engine)
    rise = 0.05
    # The load is G m plus the force. The spring lags it by less than one step of load and oscillates by less than one.
    assert breaking_force(simulation, "w", rise) + G == pytest.approx(20.0, abs=1.5 * rise)
    assert simulation.broken == {0: simulation.time}


@pytest.mark.parametrize("method", ["relaxation", "xpbd", "rattle"])
@pytest.mark.parametrize("kind", ["rod", "spring"])
def test_joint_solved_by_positions_breaks_under_the_same_load(method: str, kind: str) -> None:
    more = {"stiffness": 2e3, "damping": 20.0} if kind == "spring" else {}
    scene = scene_of(joint(kind, "w", strength=20.0, **more), ball=[ball("w", 0, -1)])
    simulation = start(scene, "reference", scene.solver.replace(joints=method))
    # N, a step and a half of load, as above
    assert breaking_force(simulation, "w", 0.05) + G == pytest.approx(20.0, abs=0.075)


@every_engine
def test_joint_below_its_strength_does_not_break(engine: str) -> None:
    simulation = start(chain(G * 1.0001), engine)  # a single rod is solved to rounding
    advance(simulation, 50)
    assert not simulation.broken


@every_engine
def test_chain_breaks_at_its_weakest_link_and_the_rest_falls_freely(engine: str) -> None:
    simulation = start(chain(50.0, 60.0, 24.0, 30.0), engine)  # loads of 40, 30, 20 and 10 N plus the growing force
    breaking_force(simulation, "b3", 0.05)
    assert set(simulation.broken) == {2}
    simulation.apply(Force(time=0.0, body="b3", force=(0.0, 0.0)))
    before = simulation.frame()
    after = advance(simulation, 30).frame()
    assert set(simulation.broken) == {2}
    held, fallen = after.position[1, 1], after.velocity[2:, 1] - before.velocity[2:, 1]
    assert held == pytest.approx(-2.0, abs=0.005)  # m; the two above stay up to the residual stretch of the solver
    assert fallen.mean() == pytest.approx(-G * 0.3, rel=1e-12)  # v = g t, to rounding: free fall


@every_engine
def test_spring_breaks_at_the_stretch_of_its_strength(engine: str) -> None:
    stiffness, strength = 100.0, 12.0
    spring = joint("spring", "w", stiffness=stiffness, rest_length=1.0, strength=strength)
    simulation = start(scene_of(spring, ball=[ball("w", 0, -1)]), engine)
    stretch = 0.0
    while not simulation.broken and simulation.time < 1.0:
        assert stiffness * stretch <= strength * (1.0 + 1e-4)  # pymunk's springs exert slightly more than k·x
        simulation.step()
        stretch = -float(simulation.frame().position[0, 1]) - 1.0
    assert set(simulation.broken) == {0}
    assert stiffness * stretch > strength * (1.0 - 1e-4)  # as above


@every_engine
def test_rotary_spring_breaks_at_the_angle_of_its_strength(engine: str) -> None:
    spring = joint("rotary_spring", "w", stiffness=2.0, strength=0.5)
    pivot = joint("pivot", "w", at=[0, 0])
    simulation = start(scene_of(spring, pivot, gravity=0.0, ball=[ball("w", 0, 0, angular_velocity=40.0)]), engine)
    turned = 0.0
    while not simulation.broken and simulation.time < 1.0:
        assert 2.0 * turned <= 0.5
        simulation.step()
        turned = float(simulation.frame().angle[0])
    assert 2.0 * turned > 0.5
    spin = simulation.frame().angular_velocity[0]
    simulation.step()
    assert set(simulation.broken) == {0}
    assert simulation.frame().angular_velocity[0] == spin  # no torque is left


@every_engine
def test_momentum_is_conserved_when_a_spring_breaks(engine: str) -> None:
    spring = joint("spring", "a", "b", stiffness=80.0, strength=40.0)
    balls = [ball("a", 0, 0, velocity=[-3, 1], mass=2.0), ball("b", 1, 0, velocity=[5, 0])]
    scene = scene_of(spring, gravity=0.0, ball=balls)
    simulation = start(scene, engine)
    advance(simulation, 60)
    assert simulation.broken
    frame = simulation.frame()
    assert scene.bodies.mass @ frame.velocity == pytest.approx([-1.0, 2.0], abs=1e-13)  # a few roundings of 6 kg·m/s
    velocity = frame.velocity
    simulation.step()
    assert np.array_equal(simulation.frame().velocity, velocity)  # free motion


@every_engine
@pytest.mark.parametrize("kind", ["ball", "box"])
def test_bodies_of_a_joint_collide_once_it_is_broken(engine: str, kind: str) -> None:
    size = {"radius": 0.1} if kind == "ball" else {"size": [0.2, 0.2]}
    post = {"name": "post", "position": [0, 0], "fixed": True, "restitution": 1.0, **size}
    stone = {"name": "stone", "position": [1, 0], "velocity": [3, 0], "mass": 1.0, "restitution": 1.0, **size}
    string = joint("slide", "post", "stone", most=1.2, strength=5.0)
    for holds in (True, False):
        table = {key: value for key, value in string.items() if not (holds and key == "strength")}
        simulation = start(scene_of(table, gravity=0.0, **{kind: [post, stone]}), engine)
        advance(simulation, 20)
        simulation.apply(
            Impulse(time=0.0, body="stone", impulse=(-3.0 - float(simulation.frame().velocity[1, 0]), 0.0))
        )
        frame = advance(simulation, 50).frame()
        if holds:
            assert not simulation.broken
            assert frame.position[1, 0] < 0.0  # through the post
        else:
            assert set(simulation.broken) == {0}
            assert frame.velocity[1, 0] == pytest.approx(3.0, rel=1e-9)  # bounces elastically off the post


@every_engine
def test_break_is_reported_at_the_end_of_its_substep(engine: str) -> None:
    simulation = start(scene_of(joint("rod", "w", strength=1.0), substeps=4, ball=[ball("w", 0, -1)]), engine)
    simulation.step()
    assert simulation.broken == {0: 0.0025}  # the first of four substeps of 2.5 ms
    assert dict(start(chain(None), engine).broken) == {}


def broken_chain(engine: str) -> SwitchableSimulation:
    """Return a chain of five whose fourth rod is broken and whose first ball is removed, which shifts body indices."""
    simulation = start(chain(None, None, None, 20.5, 12.0), engine)
    breaking_force(simulation, "b3", 0.5)
    assert set(simulation.broken) == {3}
    simulation.apply(Force(time=0.0, body="b3", force=(0.0, 0.0)))
    simulation.apply(Remove(time=0.0, body="b0"))
    return simulation


@every_engine
@pytest.mark.parametrize("to", ENGINES)
def test_joint_stays_broken_after_an_engine_switch(engine: str, to: str) -> None:
    simulation = broken_chain(engine)
    broken, links = dict(simulation.broken), simulation.setup.joints
    simulation.apply(Switch(time=0.0, engine=to))
    assert simulation.broken == broken
    assert np.array_equal(simulation.setup.joints.number, links.number)
    assert np.array_equal(simulation.setup.joints.b, links.b)  # by the body indices of the whole run
    simulation.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, -5.0]))
    before = simulation.frame().velocity[3:].mean(axis=0)
    advance(simulation, 10)
    # free fall
    assert simulation.frame().velocity[3:].mean(axis=0) - before == pytest.approx([0.0, -5.0 * 0.1], abs=1e-12)
    switched = simulation.time
    already_broken, steps = {**simulation.broken}, 0
    while len(simulation.broken) == len(already_broken) and steps < 200:
        simulation.apply(Force(time=0.0, body="b4", force=(0.0, -2.0 * steps)))
        simulation.apply(Force(time=0.0, body="b3", force=(0.0, 2.0 * steps)))
        simulation.step()
        steps += 1
    assert set(simulation.broken) == {3, 4}
    assert simulation.broken[3] == broken[3]
    assert switched < simulation.broken[4] == pytest.approx(simulation.time, abs=1e-12)  # s, in time of the whole run


@every_engine
def test_broken_rope_stays_broken_after_it_is_launched_again(engine: str) -> None:
    rope = {"name": "r", "start": [0, 0], "end": [0, -1], "links": 4, "mass": 1.0, "strength": 35.0, "fix": ["start"]}
    simulation = start(scene_of(rope=[rope]), engine)
    while not simulation.broken and simulation.time < 1.0:  # until impulses converge to the weights
        simulation.step()
    assert set(simulation.broken) == {0}  # of 40, 30, 20 and 10 N
    simulation.apply(Launch(time=0.0, generator="r", seed=1))
    before = simulation.frame().velocity[1:].mean(axis=0)
    advance(simulation, 10)
    assert set(simulation.broken) == {0}
    # The rest is in free fall: v = g t, to rounding.
    assert simulation.frame().velocity[1:].mean(axis=0) - before == pytest.approx([0.0, -G * 0.1], abs=1e-12)


@every_engine
def test_joints_of_a_cloth_have_the_same_strength(engine: str) -> None:
    cloth = {"corner": [0, 0], "columns": 3, "rows": 3, "spacing": [0.1, 0.1], "stiffness": 100.0, "mass": 0.1}
    scene = scene_of(cloth=[{**cloth, "strength": 1.5}])
    assert (scene.joint_arrays.strength == 1.5).all()
    assert np.isinf(scene_of(cloth=[cloth]).joint_arrays.strength).all()
    simulation = start(scene, engine)
    advance(simulation, 30)
    broken_pairs = {(int(scene.joint_arrays.a[k]), int(scene.joint_arrays.b[k])) for k in simulation.broken}
    assert broken_pairs == {(0, 3), (1, 4), (2, 5)}  # the uppermost threads carry twice 1 N of weight and oscillate
